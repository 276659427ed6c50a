//! What the tracker notes of those who move and are not followed.

use super::super::active::Active;
use super::super::crowd::body_box;
use super::super::evidence::Evidence;
use super::super::left_out::{Hindrance, Noticed, Reason, SMALLEST_PX, Shot, WalkBoxes};
use super::super::walk::Step;
use super::{Tracker, whole};
use crate::image::{GroupOptions, Rectangle, Region, Sides};
use crate::model::{Camera, EllipticCylinder};

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

/// Where somebody was in the frames of a walk.
pub(super) fn walk_boxes(active: &Active) -> Option<WalkBoxes> {
    let shot = |step: &Step| {
        let hypothesis = step.state.hypothesis();
        let body = active.scene(hypothesis.along_m).pose(&hypothesis).cylinders;
        let rectangle = body_rectangle(&active.camera, &body)?;
        Some(Shot { frame: step.frame, time_s: step.time_s, rectangle })
    };
    WalkBoxes::new(active.steps().iter().filter_map(shot), active.known_frame)
}

/// The rectangle of a body in the image; `None` if it is outside.
fn body_rectangle(camera: &Camera, body: &[EllipticCylinder]) -> Option<Rectangle> {
    let Sides { left, top, right, bottom } = body_box(camera, body)?;
    let [last_x, last_y] = camera.size.map(|size| f64::from(size) - 1.0);
    if right.min(bottom) < 0.0 || left > last_x || top > last_y {
        return None;
    }
    let [column, row] = [last_x, last_y].map(|last| move |at: f64| at.clamp(0.0, last) as usize);
    Some(Rectangle { left: column(left), top: row(top), right: column(right), bottom: row(bottom) })
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
        let since_s = self.since_s();
        self.unfollowed.settle(since_s, self.options.start_frames);
    }

    /// The first time of all walks that go on or can still start.
    pub(super) fn since_s(&self) -> f64 {
        let fading = self.fading.iter().map(|(_, active)| active);
        let walks =
            self.people.iter().chain(fading).filter_map(|active| Some(active.steps().first()?.time_s));
        let candidates =
            self.candidates.iter().filter_map(|candidate| Some(candidate.seen.first()?.edges.time_s));
        let standing = self.standings.iter().filter_map(|standing| Some(standing.kept.first()?.1.time_s));
        walks.chain(candidates).chain(standing).fold(f64::INFINITY, f64::min)
    }

    /// Takes a walk back that was none.
    pub(super) fn withdraw(&mut self, person: usize, walk_boxes: Option<WalkBoxes>, reason: Reason) {
        self.report.refused_starts += 1;
        self.identities.withdraw(person);
        walk_boxes.into_iter().for_each(|walk_boxes| self.unfollowed.withdrawn(walk_boxes, reason));
    }
}
