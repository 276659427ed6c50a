//! What the tracker notes of those who move and are not followed.

use super::super::left_out::{Noticed, SMALLEST_PX, Shot, WalkBoxes};
use super::*;
use crate::image::Region;

/// Regions that move, those of the size of a person and smaller ones, the largest first.
#[derive(Debug, Default)]
pub(super) struct Moving {
    pub regions: Vec<Rectangle>,
    pub small: Vec<Rectangle>,
}

impl Moving {
    pub(super) fn new(found: Vec<Region>, group: &GroupOptions) -> Self {
        let (regions, small): (Vec<Region>, Vec<Region>) =
            found.into_iter().partition(|region| region.area >= group.min_area);
        let boxes = |regions: Vec<Region>| regions.into_iter().map(|region| region.rectangle).collect();
        Self { regions: boxes(regions), small: boxes(small) }
    }

    /// None of them is too small.
    pub(super) fn of_size(regions: Vec<Rectangle>) -> Self {
        Self { regions, small: Vec::new() }
    }
}

/// The same grouping, down to people half as high as the smallest that can be followed.
pub(super) fn with_small_ones(group: &GroupOptions) -> GroupOptions {
    GroupOptions { min_area: group.min_area / 4, ..*group }
}

/// Where somebody was in the frames of a walk that was started in a frame, if it was.
pub(super) fn walk_boxes(active: &Active, started: Option<usize>) -> Option<WalkBoxes> {
    let shot = |step: &super::super::walk::Step| {
        let hypothesis = step.state.hypothesis();
        let body = active.scene(hypothesis.along_m).pose(&hypothesis).cylinders;
        let rectangle = body_rectangle(&active.camera, &body)?;
        Some(Shot { frame: step.frame, time_s: step.time_s, rectangle })
    };
    WalkBoxes::new(active.steps().iter().filter_map(shot), started)
}

/// The rectangle of a body in the image; `None` if it is outside.
fn body_rectangle(camera: &Camera, body: &[EllipticCylinder]) -> Option<Rectangle> {
    let [low, high] = body_box(camera, body)?;
    let last = DVec2::new(f64::from(camera.size[0]), f64::from(camera.size[1])) - 1.0;
    if high.min_element() < 0.0 || low.x > last.x || low.y > last.y {
        return None;
    }
    let (low, high) = (low.clamp(DVec2::ZERO, last), high.clamp(DVec2::ZERO, last));
    Some(Rectangle {
        left: low.x as usize,
        top: low.y as usize,
        right: high.x as usize,
        bottom: high.y as usize,
    })
}

impl Tracker {
    /// Notes the regions of a frame, each with what hinders a start.
    pub(super) fn notice(&mut self, evidence: &Evidence, moving: &Moving, hindrances: &[Option<Hindrance>]) {
        let followed: Vec<Rectangle> =
            self.people.iter().filter_map(|active| body_rectangle(&active.camera, &active.body()?)).collect();
        let noticed = |rectangle: &Rectangle, hindrance: Option<Hindrance>| {
            let beside = followed.iter().any(|own| own.gap(rectangle) == [0, 0]);
            Noticed { rectangle: *rectangle, hindrance, beside }
        };
        let regions = moving.regions.iter().zip(hindrances).map(|(r, hindrance)| noticed(r, *hindrance));
        // What has few pixels but is tall is a part of something.
        let is_whole = |r: &&Rectangle| (r.height() as f64) < SMALLEST_PX;
        let small = moving.small.iter().filter(is_whole).map(|r| {
            let is_cut = whole(r, evidence).is_none();
            noticed(r, Some(if is_cut { Hindrance::CutOff } else { Hindrance::Small }))
        });
        let all: Vec<Noticed> = regions.chain(small).collect();
        self.unfollowed.notice(evidence.frame, evidence.time_s, &all);
    }

    /// Decides on what is gone, once no walk of its time goes on or can still start.
    pub(super) fn settle_unfollowed(&mut self) {
        let fading = self.fading.iter().map(|(_, active)| active);
        let walks =
            self.people.iter().chain(fading).filter_map(|active| Some(active.steps().first()?.time_s));
        let candidates =
            self.candidates.iter().filter_map(|candidate| Some(candidate.seen.first()?.edges.time_s));
        let standing = self.standing.kept.first().map(|(_, edges)| edges.time_s);
        let since_s = walks.chain(candidates).chain(standing).fold(f64::INFINITY, f64::min);
        self.unfollowed.settle(since_s, self.options.start_frames);
    }

    /// Takes a walk back that was none.
    pub(super) fn withdraw(&mut self, person: usize, walk_boxes: Option<WalkBoxes>, reason: Reason) {
        self.report.refused_starts += 1;
        self.identities.withdraw(person);
        walk_boxes.into_iter().for_each(|walk_boxes| self.unfollowed.withdrawn(walk_boxes, reason));
    }
}
