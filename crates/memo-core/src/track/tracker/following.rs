//! Step 3 of the tracker: where everybody is expected, and everybody followed into a frame, near to far.

use super::super::active::Active;
use super::super::crowd::{Expected, body_box, changing_share, expected, keep_own};
use super::super::decisions::OUTSIDE_SHARE;
use super::super::evidence::Evidence;
use super::super::fit::views::Piece;
use super::super::height::is_as_tall;
use super::super::left_out::Reason;
use super::super::unexplained::{beside_legs, never_has_legs};
use super::super::walk::FrameEdges;
use super::unfollowed::walk_boxes;
use super::{TrackError, Tracker, WINDOW_MARGIN_PX, feet, whole};
use crate::image::{Rectangle, Sides};
use crate::model::{Camera, EllipticCylinder};
use glam::DVec2;
use rayon::prelude::*;

/// Who has no legs of its own for so long is nobody, seconds: about two steps.
const WITHOUT_LEGS_S: f64 = 1.0;

impl Tracker {
    /// Sorts the people by distance and predicts each.
    pub(super) fn expect(&mut self, evidence: &Evidence) -> Vec<Expected> {
        let (mut all, mut gone) = (Vec::new(), Vec::new());
        for active in std::mem::take(&mut self.people) {
            match self.predicted(&active, evidence) {
                Some(expected) => all.push((active, expected)),
                None => gone.push(active),
            }
        }
        all.sort_by(|a, b| a.1.distance_m.total_cmp(&b.1.distance_m));
        let expected;
        (self.people, expected) = all.into_iter().unzip();
        gone.into_iter().for_each(|active| self.end_walk(active));
        expected
    }

    /// Where a person is expected; `None` if too much of the body is outside the image.
    pub(super) fn predicted(&self, active: &Active, evidence: &Evidence) -> Option<Expected> {
        let best = active.walk.best();
        let predict = |twin| active.walk.predict(twin, evidence.time_s, &self.options.walk.filter);
        let (predicted, other) = (predict(best), predict(1 - best));
        let scene = active.scene(predicted.along.position);
        let body = scene.pose(&predicted.hypothesis()).cylinders;
        let Sides { left, top, right, bottom } = body_box(&active.camera, &body)?;
        let (low, high) = (DVec2::new(left, top), DVec2::new(right, bottom));
        let size = DVec2::new(evidence.grey.width() as f64, evidence.grey.height() as f64);
        let (low_in, high_in) = (low.max(DVec2::ZERO), high.min(size - 1.0));
        let shown = (high_in - low_in) / (high - low);
        if shown.min_element() < 1.0 - OUTSIDE_SHARE {
            return None;
        }
        let reach =
            DVec2::new(predicted.along.position_sd().min(0.2), predicted.height.position_sd().min(0.1));
        let scale = (high.y - low.y) / active.walk.walker.body.height_m;
        let margin = reach * scale + WINDOW_MARGIN_PX;
        let (low_in, high_in) = ((low - margin).max(DVec2::ZERO), (high + margin).min(size - 1.0));
        let window = Rectangle {
            left: low_in.x as usize,
            top: low_in.y as usize,
            right: high_in.x as usize,
            bottom: high_in.y as usize,
        };
        let twins = [predicted.hypothesis(), other.hypothesis()];
        Some(expected(&scene, twins, window, high.y - low.y))
    }

    /// Follows everybody into a frame.
    pub(super) fn follow(
        &mut self,
        evidence: &Evidence,
        expected: &[Expected],
        regions: &[Rectangle],
    ) -> Result<(), TrackError> {
        let cameras: Vec<&Camera> = self.people.iter().map(|active| &active.camera).collect();
        let windows = expected.par_iter().zip(cameras);
        let edges: Vec<FrameEdges> = windows
            .map(|(own, camera)| self.edges(evidence, &own.window, Some(camera)))
            .collect::<Result<_, _>>()?;
        for (k, (own, mut edges)) in expected.iter().zip(edges).enumerate() {
            let meeting: Vec<usize> =
                (0..expected.len()).filter(|&other| other != k && own.meets(&expected[other])).collect();
            // 1. Nearer people, whose places in this frame are known, stand in front.
            let nearer = meeting.iter().filter(|&&other| other < k);
            let others: Vec<EllipticCylinder> =
                nearer.filter_map(|&other| self.people[other].body()).flatten().collect();
            // 2. Edges of one's own.
            keep_own(
                &mut edges.edges,
                own,
                &meeting.iter().map(|&other| &expected[other]).collect::<Vec<_>>(),
            );
            edges.shared = !meeting.is_empty();
            edges.newcomer = self.candidates.iter().any(|candidate| candidate.is_newcomer(&own.window));
            let camera = &self.people[k].camera;
            edges.changing = changing_share(&evidence.mask, camera, own, &others);
            edges.others.clone_from(&others);
            // 3. A rectangle that nobody else is in.
            let is_alone = meeting.iter().all(|&other| self.is_unproven(other));
            let region = if is_alone { most_within(regions, &own.window) } else { None };
            let region = region.filter(|region| meeting.is_empty() || self.is_of(k, region, own));
            let sighting = region.and_then(|region| whole(region, evidence));
            let active = &mut self.people[k];
            active.walk.follow(&edges, &active.camera, &self.options.walk);
            if self.options.fit.is_some() {
                let piece = Piece::new(evidence.frame, &evidence.grey, own.window, others);
                active.pieces.push(piece.with_crown(sighting.as_ref()));
                self.backdrop.occupy(evidence.frame, own.window);
            }
            if self.options.camera.is_some() && !active.is_on_treadmill {
                let feet = sighting.and_then(|sighting| feet(&sighting, evidence, &self.options));
                active.feet.extend(feet.map(|feet| (evidence.frame, feet)));
            }
            active.pace(sighting);
            active.kept.push((sighting, edges));
            self.settle(k);
            self.people[k].turn(&self.options);
        }
        self.note_unexplained(evidence);
        self.withdraw_without_legs();
        Ok(())
    }

    /// Withdraws models of nobody: started beside others, and for long enough without legs of their own. The others get the
    /// contours back that they took.
    fn withdraw_without_legs(&mut self) {
        let is_nobody = |active: &mut Active| {
            let ends = active.steps().first().zip(active.steps().last());
            active.started_near
                && ends.is_some_and(|(first, last)| last.time_s - first.time_s >= WITHOUT_LEGS_S)
                && never_has_legs(&active.of_its_own)
        };
        let nobody: Vec<Active> = self.people.extract_if(.., is_nobody).collect();
        for active in nobody {
            self.withdraw(active.person, walk_boxes(&active), Reason::Beside);
        }
    }

    /// Notes what changes beside the legs of everybody who is followed.
    fn note_unexplained(&mut self, evidence: &Evidence) {
        let bodies: Vec<_> = self.people.iter().map(Active::body).collect();
        let followed: Vec<&[EllipticCylinder]> = bodies.iter().flatten().map(|body| &body[..]).collect();
        for (k, active) in self.people.iter_mut().enumerate() {
            let Some(own) = &bodies[k] else { continue };
            let beside = |bodies: &[&[EllipticCylinder]]| {
                beside_legs(&evidence.firm_mask, &active.camera, own, bodies)
            };
            let share = beside(&followed);
            let of_its_own = active.started_near.then(|| {
                let others = bodies.iter().enumerate().filter(|(other, _)| *other != k);
                let others: Vec<_> = others.filter_map(|(_, body)| Some(&body.as_ref()?[..])).collect();
                beside(&others)
            });
            active.unexplained.extend(share.map(|share| share.more));
            active.of_its_own.extend(of_its_own.flatten().map(|share| share.at_legs));
        }
    }

    /// True for somebody who was started beside another person and may be a part of that person.
    fn is_unproven(&self, k: usize) -> bool {
        self.people[k].started_near && !self.people[k].settled
    }

    /// True if a region shows one trunk, is as tall as somebody who is followed, and does not reach beyond where that person is
    /// expected.
    fn is_of(&self, k: usize, region: &Rectangle, expected: &Expected) -> bool {
        let Active { camera, height, .. } = &self.people[k];
        let has_trunks = self.side_by_side.iter().any(|(other, _)| other == region);
        let is_within = expected.window.union(region) == expected.window;
        is_within && !has_trunks && is_as_tall(camera, region, height)
    }

    /// Settles path and person of somebody who was followed for long enough.
    fn settle(&mut self, k: usize) {
        let active = &self.people[k];
        if active.settled || !active.shows_path(&self.options) {
            return;
        }
        let earlier = self.people[k].earlier.clone();
        let active = self.people.remove(k);
        let active = self.begun_otherwise(active);
        self.people.insert(k, active);
        self.people[k].settle(&self.backdrop, &self.options);
        let followed = self.people[k].steps().last().map(|step| step.frame);
        self.people[k].known_frame = self.people[k].known_frame.and(followed);
        let active = &mut self.people[k];
        active.earlier = earlier.before(active.kept.first().map_or(0, |(_, edges)| edges.frame));
        let mut active = self.people.remove(k);
        let (person, joined) = (active.person, self.gone_on(&active));
        // Two walks became one.
        if joined.is_some() {
            self.identities.withdraw(person);
        } else {
            self.identify_again(&mut active);
        }
        self.people.insert(k, joined.unwrap_or(active));
    }
}

/// The region that overlaps a window most; `None` if none touches it.
fn most_within<'a>(regions: &'a [Rectangle], window: &Rectangle) -> Option<&'a Rectangle> {
    let overlap = |region: &Rectangle| region.sides(0.0).overlap(&window.sides(0.0));
    let touching = regions.iter().filter(|region| region.gap(window) == [0, 0]);
    touching.max_by(|a, b| overlap(a).total_cmp(&overlap(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside a larger one that reaches into the window.
    #[test]
    fn the_region_of_somebody_is_that_which_is_most_where_the_person_is() {
        let boxed = |left: usize, top: usize, width: usize, height: usize| Rectangle {
            left,
            top,
            right: left + width - 1,
            bottom: top + height - 1,
        };
        let (window, own, nearer) =
            (boxed(100, 100, 80, 200), boxed(110, 104, 60, 190), boxed(172, 40, 120, 330));
        for regions in [[nearer, own], [own, nearer]] {
            assert_eq!(most_within(&regions, &window), Some(&own));
        }
        assert_eq!(most_within(&[nearer], &window), Some(&nearer));
        assert_eq!(most_within(&[boxed(300, 40, 60, 190)], &window), None);
    }
}
