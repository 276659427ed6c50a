//! Whether two walks are of one person.
//!
//! Models of two people each have a part of the picture of their own, even where one hides half of the other. A second model of
//! somebody lies mostly on the same body, and where it does not, nobody is. How far the two lie on each other does not tell
//! this: of people side by side, the boxes overlap as much as those of second models that are off.
//!
//! 1. In each frame of both walks, the pixels are counted that are on the first body only, on the second one only, and on both.
//! 2. A pixel shows somebody if it differs from the empty scene by half of what the pixels on both differ by (median).
//! 3. The own share of a body is the share of it that is not on the other and shows somebody, divided by the share of what is on both
//!    that does. If one of them has hardly any, both are of one person.
//! 4. Of the two, the one is second that is mostly where nobody is, or fits poorly, or is shorter. In the frames of both it is
//!    withdrawn. It stays in frames that the other one does not have: there, it goes on with the person.

use super::crowd::{body_box, paint_body};
use super::decisions::{OWN_BODY, SAME_BODY, SAME_WAY, SHOWN_BODY};
use super::fit::FitVerdict;
use super::fit::edge_search::View;
use super::result::TrackedWalk;
use super::walk::Step;
use crate::image::Mask;
use crate::model::PosedBody;
use glam::DVec2;
use std::collections::BTreeMap;

/// Fewer frames in which one walk goes on as the other one does tell nothing: somebody may pass the other.
const LEAST_COMMON: usize = 7;

/// A walk and the bodies in its frames.
struct Bodies<'a> {
    walk: &'a TrackedWalk,
    of_frames: BTreeMap<usize, PosedBody>,
}

impl<'a> Bodies<'a> {
    fn new(walk: &'a TrackedWalk) -> Self {
        let rows = walk.rows();
        let of_frames = rows.iter().enumerate().map(|(k, row)| (row.frame, walk.pose_of(k, row))).collect();
        Self { walk, of_frames }
    }

    fn fits_poorly(&self) -> bool {
        self.walk.fitted().is_some_and(|fit| fit.quality.verdict() == FitVerdict::Poorly)
    }
}

impl TrackedWalk {
    /// Which of two walks of one person is the second model of that person: `Some(true)` for this one, `Some(false)` for the
    /// other one, `None` for walks of two people, or if less than half of the shorter walk's frames are common to both and
    /// neither goes on as the other one does. The longer walk is the first, unless it alone is where nobody is or fits
    /// poorly and half of its frames are common to both. The `views` are those of this walk, with their frames.
    pub(super) fn is_second_model(&self, other: &Self, views: &[(usize, View)]) -> Option<bool> {
        if !are_at_a_time(self.steps(), other.steps()) {
            return None;
        }
        let both @ [own, others] = &[self, other].map(Bodies::new);
        let common: Vec<usize> =
            own.of_frames.keys().copied().filter(|frame| others.of_frames.contains_key(frame)).collect();
        let [own_frames, other_frames] = [own, others].map(|bodies| bodies.of_frames.len());
        let is_common = |frames: usize| 2 * common.len() >= frames;
        if !is_common(own_frames.min(other_frames)) && !is_in_turn([self, other], &common) {
            return None;
        }
        let shares = shares(both, views);
        let is_same = match &shares {
            Some(shares) => shares.iter().any(|body| body.own < OWN_BODY),
            None => mean_overlap(both, &common) > SAME_BODY,
        };
        if !is_same {
            return None;
        }
        // 4. The worse one, if it is off in most of its frames.
        let is_nobody = shares.map_or([false; 2], |shares| shares.map(|body| body.shown < SHOWN_BODY));
        let worse = [is_nobody, both.each_ref().map(Bodies::fits_poorly)].into_iter().find(|[a, b]| a != b);
        Some(match worse {
            Some([true, _]) if is_common(own_frames) => true,
            Some([_, true]) if is_common(other_frames) => false,
            _ => own_frames <= other_frames,
        })
    }

    /// The same of two walks that may have one number: nobody is in two places, so the shorter one is second.
    pub(super) fn is_second_to(&self, other: &Self, views: &[(usize, View)]) -> Option<bool> {
        if self.person == other.person && are_at_a_time(self.steps(), other.steps()) {
            return Some(self.steps().len() <= other.steps().len());
        }
        self.is_second_model(other, views)
    }

    /// First and last frame.
    pub(super) fn first_and_last(&self) -> Option<[usize; 2]> {
        Some([self.steps().first()?.frame, self.steps().last()?.frame])
    }

    /// The longer part of a walk before or after some frames; `None` if it has fewer than `least` frames.
    pub(super) fn outside(mut self, [first, last]: [usize; 2], least: usize) -> Option<Self> {
        let steps = self.steps();
        let (before, after) =
            (steps.partition_point(|s| s.frame < first), steps.partition_point(|s| s.frame <= last));
        let kept = if before >= steps.len() - after { 0..before } else { after..steps.len() };
        if kept.len() < least {
            return None;
        }
        let times_s = steps[kept.start].time_s..=steps[kept.end - 1].time_s;
        self.walk.keep(kept.clone());
        self.is_frontal |= self.steps().iter().all(|step| step.by_feet);
        if !self.camera_turns.is_empty() {
            self.camera_turns = self.camera_turns[kept.clone()].to_vec();
        }
        if !self.crowns_px.is_empty() {
            self.crowns_px = self.crowns_px[kept.clone()].to_vec();
        }
        if let Some(Ok(fit)) = &mut self.fit {
            fit.frames = fit.frames[kept].to_vec();
            fit.contacts.retain(|contact| times_s.contains(&contact.time_s));
        }
        Some(self)
    }
}

/// True if one of two walks begins and ends before the other one, which goes the same way.
fn is_in_turn([own, others]: [&TrackedWalk; 2], common: &[usize]) -> bool {
    let Some(([first, last], [other_first, other_last])) = own.first_and_last().zip(others.first_and_last())
    else {
        return false;
    };
    let is_earlier = first < other_first && last < other_last || first > other_first && last > other_last;
    let way = |walk: &TrackedWalk| {
        let row = walk.rows().into_iter().find(|row| Some(&row.frame) == common.last())?;
        Some(row.speed_mps.signum() * DVec2::from_angle(row.heading_rad))
    };
    let is_same_way = || way(own).zip(way(others)).is_some_and(|(a, b)| a.dot(b) >= SAME_WAY);
    is_earlier && common.len() >= LEAST_COMMON && is_same_way()
}

/// True for walks of which one begins before the other ends.
pub(super) fn are_at_a_time(steps: &[Step], others: &[Step]) -> bool {
    let ends = |steps: &[Step]| Some((steps.first()?.frame, steps.last()?.frame));
    ends(steps).zip(ends(others)).is_some_and(|((a, b), (c, d))| a <= d && c <= b)
}

/// Mean overlap of the boxes of both bodies in the image, intersection over union.
fn mean_overlap([own, others]: &[Bodies<'_>; 2], common: &[usize]) -> f64 {
    let side = |bodies: &Bodies<'_>, frame: &usize| {
        body_box(&bodies.walk.camera, &bodies.of_frames[frame].cylinders)
    };
    let of_frame = |frame| Some(side(own, frame)?.overlap(&side(others, frame)?));
    common.iter().filter_map(of_frame).sum::<f64>() / common.len().max(1) as f64
}

/// Pixels on the first body only, on the second one only, and on both.
#[derive(Debug, Clone, Copy)]
enum On {
    First,
    Second,
    Both,
}

/// Numbers of pixels by where they are and how much they differ from the empty scene, grey levels.
struct Differences([[u64; 256]; 3]);

impl Differences {
    fn count(&self, on: On) -> u64 {
        self.0[on as usize].iter().sum()
    }

    fn count_from(&self, on: On, level: usize) -> u64 {
        self.0[on as usize][level..].iter().sum()
    }

    fn median(&self, on: On) -> usize {
        let (count, mut below) = (self.count(on), 0);
        let reaches_half = |&number: &u64| {
            below += number;
            2 * below >= count
        };
        self.0[on as usize].iter().position(reaches_half).unwrap_or(0)
    }
}

/// What shows somebody, as shares of a body, divided by the share of what is on both bodies that does.
#[derive(Debug, Clone, Copy)]
struct Shares {
    /// What is not on the other body.
    own: f64,
    /// All of the body.
    shown: f64,
}

/// The shares of both bodies, steps 1 to 3 of the module; `None` without frames in which the empty scene is known.
fn shares([own, others]: &[Bodies<'_>; 2], views: &[(usize, View)]) -> Option<[Shares; 2]> {
    // 1. The pixels of all frames.
    let mut differences = Differences([[0; 256]; 3]);
    let mut is_known = false;
    for (frame, view) in views.iter().filter(|(_, view)| view.is_empty_known) {
        let Some(bodies) = own.of_frames.get(frame).zip(others.of_frames.get(frame)) else { continue };
        is_known = true;
        let cover = |bodies: &Bodies<'_>, posed: &PosedBody| {
            let mut mask = Mask::filled(view.pixels.width(), view.pixels.height(), false);
            paint_body(&mut mask, view.corner, &bodies.walk.camera, &posed.cylinders, 0.0, true);
            mask
        };
        let (first, second) = (cover(own, bodies.0), cover(others, bodies.1));
        for y in 0..view.pixels.height() {
            let covered = first.row(y).iter().zip(second.row(y));
            for (&[seen, empty], covered) in view.pixels.row(y).iter().zip(covered) {
                let on = match covered {
                    (true, false) => On::First,
                    (false, true) => On::Second,
                    (true, true) => On::Both,
                    (false, false) => continue,
                };
                differences.0[on as usize][usize::from(seen.abs_diff(empty))] += 1;
            }
        }
    }
    if !is_known {
        return None;
    }
    // 2. What shows somebody.
    let level = differences.median(On::Both).div_ceil(2).max(1);
    let shown = |on: On| differences.count_from(on, level) as f64;
    // 3. Their shares of the bodies; all of them where the bodies are nowhere on each other.
    let both = differences.count(On::Both) as f64;
    if shown(On::Both) == 0.0 {
        return Some([Shares { own: 1.0, shown: 1.0 }; 2]);
    }
    Some([On::First, On::Second].map(|on| {
        let of_body = differences.count(on) as f64 + both;
        let share = |count: f64| count / of_body / (shown(On::Both) / both);
        Shares { own: share(shown(on)), shown: share(shown(on) + shown(On::Both)) }
    }))
}

#[cfg(test)]
mod tests;
