//! Step 1 of the tracker: the regions that nobody explains who is followed, and the candidates that they are added to.

use super::super::candidate::{Candidate, Seen};
use super::super::crowd::{body_box, clear_explained, keep_unowned};
use super::super::evidence::Evidence;
use super::super::fit::views::Piece;
use super::super::height::{is_of_a_person, is_of_one_person};
use super::super::left_out::{Hindrance, SMALLEST_PX};
use super::super::locate::{MASK_MARGIN_PX, Sighting, same_person};
use super::super::walk::FrameEdges;
use super::unfollowed::{Moving, with_small_ones};
use super::{TrackError, Tracker, WINDOW_MARGIN_PX, grown, whole};
use crate::image::{GroupOptions, Mask, Rectangle, Region, group_regions_of, regions, side_by_side};
use crate::model::Camera;
use std::sync::Arc;

/// At most this many regions are looked at in a frame, the largest: they bound its time.
const MOST_CANDIDATES: usize = 8;
/// People are sought apart after they have been side by side in so many frames in a row.
const APART_FRAMES: usize = 4;
/// A box belongs to somebody who is followed if it overlaps the body's box by this, intersection over union.
const OWN_BOX: f64 = 0.3;
/// A region is a part of a candidate that was seen before if so much of it is where that was.
const PART_OVERLAP: f64 = 0.5;

impl Tracker {
    /// Adds the regions that nobody explains to the candidates, and starts those that walk.
    pub(super) fn seek(
        &mut self,
        evidence: &Evidence,
        moving: Moving,
        are_given: bool,
    ) -> Result<(), TrackError> {
        let regions = &moving.regions;
        self.report.frames_with_candidate += usize::from(!regions.is_empty());
        let is_cut_off = regions.first().is_some_and(|region| whole(region, evidence).is_none());
        self.report.frames_cut_off += usize::from(is_cut_off);
        let largest = regions.first().filter(|_| self.people.is_empty());
        let largest = largest.and_then(|region| whole(region, evidence));
        let moving = match are_given {
            _ if self.people.is_empty() => moving,
            true => Moving::of_size(self.unclaimed(moving.regions)),
            false => self.unexplained(evidence),
        };
        self.candidates.iter_mut().for_each(|candidate| candidate.missed += 1);
        let camera = if self.people.is_empty() { None } else { self.camera() };
        let can_be = |sighting: &Sighting| camera.is_none_or(|camera| self.is_of_a_person(camera, sighting));
        let most = if are_given { usize::MAX } else { MOST_CANDIDATES };
        let mut sightings: Vec<Sighting> = Vec::new();
        let mut hinder = |region: &Rectangle| {
            if (region.height() as f64) < SMALLEST_PX {
                return Some(Hindrance::Small);
            }
            let Some(sighting) = whole(region, evidence) else { return Some(Hindrance::CutOff) };
            if !can_be(&sighting) {
                return Some(Hindrance::WrongSize);
            }
            if sightings.len() == most {
                return Some(Hindrance::Crowded);
            }
            sightings.push(sighting);
            None
        };
        let hindrances: Vec<Option<Hindrance>> = moving.regions.iter().map(&mut hinder).collect();
        self.notice(evidence, &moving, &hindrances);
        let first = evidence.frame.saturating_sub(self.options.path_frames);
        self.sought.retain(|seen| seen.edges.frame >= first);
        self.stand(evidence, largest, &sightings)?;
        for sighting in sightings {
            let seen = self.seen(evidence, sighting)?;
            self.sought.push(Arc::new(seen.clone()));
            let rectangle = &sighting.rectangle;
            let known = self.candidates.iter_mut().filter(|c| c.missed > 0 && c.is_at(rectangle));
            let nearest = known.max_by(|a, b| a.overlap(rectangle).total_cmp(&b.overlap(rectangle)));
            match nearest {
                Some(candidate) => candidate.add(seen),
                None => self.candidates.push(Candidate { seen: vec![seen], ..Candidate::default() }),
            }
        }
        self.candidates.retain(|candidate| candidate.missed <= self.most_missed);
        self.start(evidence);
        self.start_on_the_spot(evidence);
        self.settle_unfollowed();
        Ok(())
    }

    /// Boxes that are not those of the people who are followed: each has the box that overlaps the body most.
    pub(super) fn unclaimed(&self, mut boxes: Vec<Rectangle>) -> Vec<Rectangle> {
        for active in &self.people {
            let Some(body) = active.as_followed().and_then(|seen| body_box(&active.camera, &seen.body))
            else {
                continue;
            };
            let overlaps = boxes.iter().map(|r| r.sides(0.0).overlap(&body)).enumerate();
            let own = overlaps.max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((k, _)) = own.filter(|(_, part)| *part >= OWN_BOX) {
                boxes.remove(k);
            }
        }
        boxes
    }

    /// Regions of change that the bodies of the people do not explain.
    fn unexplained(&self, evidence: &Evidence) -> Moving {
        let mut mask: Mask = evidence.firm_mask.clone();
        for active in &self.people {
            if let Some(seen) = active.as_followed() {
                clear_explained(&mut mask, &active.camera, &seen.body, seen.height_px);
            }
        }
        let group: &GroupOptions = &self.options.evidence.group;
        let parts = regions(&mask, group.min_part_area);
        let found = group_regions_of(&parts, &with_small_ones(group), |r| self.can_be_one(r));
        let before = self.candidates.iter().filter_map(Candidate::last_rectangle);
        Moving::new(whole_again(found, before, |r| self.can_be_one(r)), group)
    }

    /// Regions divided where people have been side by side for some frames, largest first.
    pub(super) fn apart(&mut self, regions: Vec<Region>, min_area: usize) -> Vec<Region> {
        let before = std::mem::take(&mut self.side_by_side);
        let mut apart = Vec::new();
        for region in regions {
            let parts = side_by_side(region.clone());
            let last = before.iter().filter(|(last, _)| same_person(last, &region.rectangle));
            let frames = 1 + last.map(|(_, frames)| *frames).max().unwrap_or(0);
            if parts.len() > 1 {
                self.side_by_side.push((region.rectangle, frames));
            }
            if parts.len() > 1 && frames >= APART_FRAMES {
                // What was seen of them as one thing belongs to neither.
                if frames == APART_FRAMES {
                    self.candidates.retain(|candidate| !candidate.is_at(&region.rectangle));
                }
                apart.extend(parts.into_iter().filter(|part| part.area >= min_area));
            } else {
                apart.push(region);
            }
        }
        apart.sort_by_key(|region| std::cmp::Reverse(region.area));
        apart
    }

    /// False if a rectangle is too tall for one person who stands on the ground of a given camera.
    pub(super) fn can_be_one(&self, rectangle: &Rectangle) -> bool {
        self.options.camera.as_ref().is_none_or(|camera| is_of_one_person(camera, rectangle))
    }

    /// What a candidate shows in a frame, without the edges of people who are followed.
    fn seen(&mut self, evidence: &Evidence, sighting: Sighting) -> Result<Seen, TrackError> {
        let window = grown(&sighting.rectangle, evidence, WINDOW_MARGIN_PX);
        let edges = self.unowned_edges(evidence, &window)?;
        let piece = self.options.fit.map(|_| {
            self.backdrop.occupy(evidence.frame, sighting.rectangle);
            let alone = (!edges.shared).then_some(&sighting);
            Piece::new(evidence.frame, &evidence.grey, sighting.rectangle, edges.others.clone())
                .with_crown(alone)
        });
        Ok(Seen { sighting, edges, piece })
    }

    /// True if a camera shows a region to be as high as a person, or as one of a given height.
    pub(super) fn is_of_a_person(&self, camera: &Camera, sighting: &Sighting) -> bool {
        let given_m = self.options.height_m.iter().chain(&self.options.further_heights_m).copied();
        is_of_a_person(camera, sighting, given_m)
    }

    /// The edges of a window that are nobody's who is followed, with the bodies of those.
    pub(super) fn unowned_edges(
        &mut self,
        evidence: &Evidence,
        window: &Rectangle,
    ) -> Result<FrameEdges, TrackError> {
        let mut edges = self.edges(evidence, window, self.camera())?;
        for active in &self.people {
            let Some(expected) = active.as_followed() else { continue };
            if expected.window.gap(window) == [0, 0] {
                edges.shared = true;
                keep_unowned(&mut edges.edges, &[&expected]);
                edges.others.extend(expected.body);
            }
        }
        Ok(edges)
    }

    /// The boxes given for a frame, the largest first; `None` if none were given.
    pub(super) fn given_boxes(&mut self, evidence: &Evidence) -> Option<Vec<Rectangle>> {
        let later = self.boxes.split_off(&(evidence.frame + 1));
        let given = std::mem::replace(&mut self.boxes, later).remove(&evidence.frame)?;
        let size = [evidence.grey.width(), evidence.grey.height()];
        // Changes reach above the crown, and everything expects it of their rectangles.
        let place = |r: &Rectangle| {
            let r = self.stream.in_steadied(evidence.frame, r, size);
            Rectangle { top: r.top.saturating_sub(MASK_MARGIN_PX as usize), ..r }
        };
        let mut boxes: Vec<Rectangle> = given.iter().map(place).collect();
        boxes.sort_by_key(|r| std::cmp::Reverse(r.width() * r.height()));
        Some(boxes)
    }
}

/// Joins regions that somebody in front divides, the largest first: they are where a candidate was before, and only together
/// as tall.
fn whole_again(
    mut regions: Vec<Region>,
    before: impl IntoIterator<Item = Rectangle>,
    can_be_one: impl Fn(&Rectangle) -> bool,
) -> Vec<Region> {
    for last in before {
        let is_it = |region: &Region| same_person(&last, &region.rectangle);
        if regions.iter().any(is_it) {
            continue;
        }
        let place = last.sides(0.0);
        let is_part = |region: &Region| region.rectangle.sides(0.0).overlap_of_smaller(&place) > PART_OVERLAP;
        let (parts, mut others): (Vec<Region>, Vec<Region>) = regions.iter().cloned().partition(is_part);
        let whole = Region::of_parts(parts);
        if let Some(whole) = whole.filter(|whole| is_it(whole) && can_be_one(&whole.rectangle)) {
            others.push(whole);
            regions = others;
        }
    }
    regions.sort_by_key(|region| std::cmp::Reverse(region.area));
    regions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    /// Rectangles of changes; no two touch.
    fn found(rectangles: &[[usize; 4]]) -> Vec<Region> {
        let mut mask: Mask = Image::filled(200, 200, false);
        for &[left, top, right, bottom] in rectangles {
            (top..=bottom).for_each(|y| mask.row_mut(y)[left..=right].fill(true));
        }
        regions(&mask, 1)
    }

    fn boxed([left, top, right, bottom]: [usize; 4]) -> Rectangle {
        Rectangle { left, top, right, bottom }
    }

    const HEAD: [usize; 4] = [60, 20, 75, 40];
    const LEGS: [usize; 4] = [50, 100, 80, 159];
    const WHOLE: [usize; 4] = [50, 20, 80, 159];

    #[test]
    fn head_and_legs_beside_somebody_in_front_are_one_person_where_one_was_before() {
        let beside = [120, 90, 150, 159];
        let all = found(&[HEAD, LEGS, beside]);
        let boxes = |regions: Vec<Region>| regions.iter().map(|r| r.rectangle).collect::<Vec<_>>();
        let was = boxed([46, 22, 77, 158]);
        let joined = whole_again(all.clone(), [was], |_| true);
        assert_eq!(boxes(joined.clone()), [boxed(WHOLE), boxed(beside)]);
        let area = |regions: &[Region]| regions.iter().map(|r| r.area).sum::<usize>();
        assert_eq!(area(&joined), area(&all));

        let apart = boxes(all.clone());
        let elsewhere = boxed([150, 22, 190, 158]);
        assert_eq!(boxes(whole_again(all.clone(), [elsewhere], |_| true)), apart);
        assert_eq!(boxes(whole_again(all.clone(), [], |_| true)), apart, "nobody was seen before");
        assert_eq!(boxes(whole_again(all, [was], |r| r.height() < 120)), apart, "too tall for one");
    }

    #[test]
    fn what_is_as_tall_alone_takes_nothing_in() {
        let all = found(&[[50, 20, 80, 120], [55, 130, 75, 159]]);
        assert_eq!(whole_again(all.clone(), [boxed(WHOLE)], |_| true), all);
    }
}
