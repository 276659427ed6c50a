//! The current walk: whether it continues, its path, and the fit of the person at its end.

use super::candidate::Seen;
use super::crowd::{Expected, body_box, expected};
use super::decisions::{
    DECIDING_SHARE, LEAST_CHANGING, LONGEST_HIDDEN_S, LOST_SHARE, MOST_MISSED_TO_ADOPT, SLANT_GAIN,
    SLOWEST_HZ, SLOWEST_MPS, STANDING_SHARE, STRIDE_HEIGHTS,
};
use super::fit::of_walk::Tracked;
use super::fit::views::{Backdrop, Piece};
use super::fit::{FitError, LEAST_FRAMES, WalkFit};
use super::frontal::Frontal;
use super::height::{BodyHeight, HeightSource};
use super::locate::{Crown, Sighting, locate_slanting};
use super::options::TrackerOptions;
use super::people::{Now, Sign};
use super::search::Scene;
use super::standing::Standing;
use super::start::{StartReport, start};
use super::steady::CameraMotion;
use super::walk::{Beginning, FrameEdges, Step, Twin, Walk};
use crate::calibrate::TiltEstimate;
use crate::image::Sides;
use crate::model::body::PART_COUNT;
use crate::model::{Camera, EllipticCylinder, Walker};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

/// Somebody who moves faster over the last frames has left the treadmill, m/s.
const LEAVING_MPS: f64 = 0.7;
/// Number of last frames that decide whether a walk continues.
const RECENT_FRAMES: usize = 12;

/// Of a walk, at most this share of the frames may show no change where the model walks. Of 43 drawn people (29 walks, ten
/// scenes), none had such a frame while in view; one who stood and waved, taken for a walker before, had 15 of 25.
const MOST_EMPTY: f64 = 0.25;
/// So many last frames without the person are removed; a single one may only be matched badly.
const LEAST_GONE: usize = 3;

/// Mean similarity of frames by the share that is visible; `None` if they show too little.
fn matched(steps: &[Step]) -> Option<f64> {
    let visible: f32 = steps.iter().map(|s| s.visible).sum();
    let found: f32 = steps.iter().map(|s| s.similarity * s.visible).sum();
    (visible >= DECIDING_SHARE * steps.len() as f32).then(|| f64::from(found / visible))
}

/// Mean share of the image about a person that changes, by the share that is visible; `None` if it is mostly unknown.
fn changing(steps: &[Step]) -> Option<f32> {
    let known = || steps.iter().filter_map(|step| Some((step.visible, step.changing?)));
    let visible: f32 = known().map(|(visible, _)| visible).sum();
    let changing: f32 = known().map(|(visible, changing)| visible * changing).sum();
    (visible >= DECIDING_SHARE * steps.len() as f32).then(|| changing / visible)
}

/// True if somebody is in most of the frames of which the changes are known. A model that was lost for longer follows nobody.
fn is_somebody_there(steps: &[Step]) -> bool {
    let least = least_changing(steps);
    let known: Vec<f32> =
        steps.iter().filter(|s| s.visible >= DECIDING_SHARE).filter_map(|s| s.changing).collect();
    let empty = known.iter().filter(|&&changing| changing < least).count();
    empty as f64 <= MOST_EMPTY * known.len() as f64
}

/// Nobody is where less than this share of the image about the model changes: much less than usually.
fn least_changing(steps: &[Step]) -> f32 {
    let usual = changing(steps).unwrap_or(0.0);
    LEAST_CHANGING.max(LOST_SHARE as f32 * usual)
}

/// Mean similarity of a twin by the share that is visible.
fn mean_similarity(twin: &Twin) -> f64 {
    twin.similarity_sum / twin.visible_sum.max(f64::MIN_POSITIVE)
}

/// The same of a walk that turns into the line of sight, where contours are less similar: the lower of the two.
fn usual_similarity(twin: &Twin) -> f64 {
    let of = |by_feet: bool| {
        let of_kind = || twin.steps.iter().filter(|step| step.by_feet == by_feet);
        let visible: f64 = of_kind().map(|step| f64::from(step.visible)).sum();
        let found: f64 = of_kind().map(|step| f64::from(step.similarity * step.visible)).sum();
        (visible > 0.0).then_some(found / visible)
    };
    match [true, false].map(of) {
        [Some(feet), Some(contours)] => feet.min(contours),
        _ => mean_similarity(twin),
    }
}

/// Frames kept for fitting.
pub(super) type Kept = [(Option<Sighting>, FrameEdges)];

/// The current walk.
#[derive(Debug, Clone)]
pub(super) struct Active {
    /// Number of the person, in order of appearance.
    pub(super) person: usize,
    /// Whether somebody was followed when the walk started.
    pub(super) started_near: bool,
    pub(super) camera: Camera,
    /// How the assumed camera is tilted; `None` of a given one.
    pub(super) tilt: Option<TiltEstimate>,
    /// The body height with which the walk started.
    pub(super) height: BodyHeight,
    pub(super) depth_sd_m: f64,
    pub(super) start: StartReport,
    pub(super) walk: Walk,
    /// The average walker of the person's height.
    pub(super) average: Walker,
    /// The frames so far, to follow them again on another route; without a fit, the latest.
    pub(super) kept: Vec<(Option<Sighting>, FrameEdges)>,
    pub(super) gait_speed_mps: f64,
    /// Whether path and person were settled.
    pub(super) settled: bool,
    /// What the fit needs of each frame.
    pub(super) pieces: Vec<Piece>,
    /// Whether the person walks on the spot.
    pub(super) is_on_treadmill: bool,
    /// On the spot, the frames of the stream until the start: later ones do not show the empty scene.
    pub(super) early: Option<Backdrop>,
    /// The rectangles of all changes, by frame: they reach down to feet that hardly move.
    pub(super) feet: BTreeMap<usize, Sighting>,
    /// What was seen before the walk started.
    pub(super) earlier: Standing,
    /// What the regions of the frames before the start showed.
    pub(super) before: Vec<Arc<Seen>>,
    /// What the feet show of somebody who walks towards the camera or away from it.
    pub(super) frontal: Option<Frontal>,
}

impl Active {
    /// The filtered state of the better twin.
    pub(super) fn now(&self, options: &TrackerOptions) -> Option<Now> {
        let step = self.walk.last()?;
        let hypothesis = step.state.hypothesis();
        Some(Now {
            person: self.person,
            frame: step.frame,
            time_s: step.time_s,
            torso_centre: self.scene(hypothesis.along_m).pose(&hypothesis).torso_centre,
            heading_rad: self.walk.route.at(hypothesis.along_m).heading_rad,
            phase: hypothesis.phase,
            p_swapped: self.p_swapped(options),
            speed_mps: step.state.along.velocity,
        })
    }

    /// Probability that left and right are swapped; the feet of somebody who walks towards the camera do not show it.
    pub(super) fn p_swapped(&self, options: &TrackerOptions) -> f64 {
        if self.is_frontal() { 0.5 } else { self.walk.swap_probability(&options.walk.swap) }
    }

    /// The mean height of the crown.
    pub(super) fn crown(&self) -> Crown {
        Crown { height_m: self.walk.walker.level_crown_height_m(), sd_m: self.height.sd_in_camera_m() }
    }

    /// The scene near a place along the route.
    pub(super) fn scene(&self, along_m: f64) -> Scene<'_> {
        Scene::new(&self.walk.walker, &self.camera, &self.walk.route.at(along_m))
    }

    /// How far the bodies of this walk and of another overlap in the image in the frames of both, on average (intersection
    /// over union of their boxes); 0 without such frames.
    pub(super) fn overlap(&self, other: &Self) -> f64 {
        let others: HashMap<usize, &Step> = other.steps().iter().map(|step| (step.frame, step)).collect();
        let both = self.steps().iter().filter_map(|step| Some((step, *others.get(&step.frame)?)));
        let overlaps: Vec<f64> = both
            .filter_map(|(here, there)| Some(self.box_in(here)?.overlap(&other.box_in(there)?)))
            .collect();
        if overlaps.is_empty() { 0.0 } else { overlaps.iter().sum::<f64>() / overlaps.len() as f64 }
    }

    /// The box of the body in the image.
    fn box_in(&self, step: &Step) -> Option<Sides> {
        let hypothesis = step.state.hypothesis();
        let body = self.scene(hypothesis.along_m).pose(&hypothesis).cylinders;
        let [low, high] = body_box(&self.camera, &body)?;
        Some(Sides { left: low.x, top: low.y, right: high.x, bottom: high.y })
    }

    /// The body in the last frame.
    pub(super) fn body(&self) -> Option<[EllipticCylinder; PART_COUNT]> {
        let hypothesis = self.walk.last()?.state.hypothesis();
        Some(self.scene(hypothesis.along_m).pose(&hypothesis).cylinders)
    }

    /// Where the person is and goes on the ground.
    pub(super) fn sign(&self) -> Option<Sign> {
        self.sign_at(self.steps().len().checked_sub(1)?)
    }

    /// The frames of the better twin.
    pub(super) fn steps(&self) -> &[Step] {
        &self.walk.twins[self.walk.best()].steps
    }

    /// Number of frames before a time.
    pub(super) fn frames_before(&self, time_s: f64) -> usize {
        self.steps().partition_point(|step| step.time_s < time_s)
    }

    /// Where the person was and went in the last frame before a time.
    pub(super) fn sign_before(&self, time_s: f64) -> Option<Sign> {
        self.sign_at(self.frames_before(time_s).checked_sub(1)?)
    }

    /// Drops the frames from a time on.
    pub(super) fn end_before(&mut self, time_s: f64) {
        self.walk.keep(0..self.frames_before(time_s));
    }

    /// Where the person was and went in a frame.
    pub(super) fn sign_at(&self, index: usize) -> Option<Sign> {
        let step = self.steps().get(index)?;
        let path = self.walk.route.at(step.state.along.position);
        Some(Sign {
            time_s: step.time_s,
            place_m: path.point(step.state.along.position, 0.0).truncate(),
            velocity_mps: step.state.along.velocity * path.direction(),
            stands: false,
        })
    }

    /// Where the person is if the walk ended because the person stopped: the person was seen to the end and was by then
    /// much slower than before. Who is lost or hidden seems to go on.
    pub(super) fn standing(&self) -> Option<Sign> {
        let twin = &self.walk.twins[self.walk.best()];
        let recent = &twin.steps[twin.steps.len().checked_sub(RECENT_FRAMES)?..];
        let (first, last) = (&twin.steps[0], &recent[RECENT_FRAMES - 1]);
        let covered_m = last.state.along.position - first.state.along.position;
        let mean_mps = covered_m.abs() / (last.time_s - first.time_s);
        // Who turns round on the spot is slow for a moment only.
        let speeds_mps = recent.iter().map(|step| step.state.along.velocity.abs());
        let speed_mps = speeds_mps.fold(f64::INFINITY, f64::min);
        let is_seen = matched(recent).is_some_and(|found| found >= LOST_SHARE * mean_similarity(twin));
        let stands = is_seen && speed_mps < STANDING_SHARE * mean_mps;
        let is_on_a_path = !self.is_on_treadmill && !last.by_feet;
        self.sign().filter(|_| stands && is_on_a_path).map(|sign| Sign { stands, ..sign })
    }

    /// The person as followed in the last frame.
    pub(super) fn as_followed(&self) -> Option<Expected> {
        let twins = [self.walk.best(), 1 - self.walk.best()].map(|twin| self.walk.twins[twin].steps.last());
        let [Some(best), Some(other)] = twins else { return None };
        let [low, high] = body_box(&self.camera, &self.body()?)?;
        let scene = self.scene(best.state.along.position);
        let twins = [best, other].map(|step| step.state.hypothesis());
        Some(expected(&scene, twins, best.look.window, high.y - low.y))
    }

    /// True if in the last frames the person stood still or the model matched little.
    pub(super) fn is_over(&self) -> bool {
        let twin = &self.walk.twins[self.walk.best()];
        let count = twin.steps.len();
        if count < 2 * RECENT_FRAMES {
            return false;
        }
        let recent = &twin.steps[count - RECENT_FRAMES..];
        let (first, last) = (&recent[0], &recent[RECENT_FRAMES - 1]);
        let covered_m = (last.state.along.position - first.state.along.position).abs();
        let cycles = (last.state.phase.position - first.state.phase.position).abs();
        let elapsed_s = last.time_s - first.time_s;
        let is_slow = covered_m < SLOWEST_MPS * elapsed_s;
        let left = if self.is_on_treadmill { covered_m > LEAVING_MPS * elapsed_s } else { is_slow };
        let stopped = left || cycles < SLOWEST_HZ * elapsed_s;
        let unseen = |frontal: &Frontal| count - frontal.seen().min(count) >= RECENT_FRAMES;
        let is_unseen = last.by_feet && self.frontal.as_ref().is_some_and(unseen);
        stopped
            || is_unseen
            || matched(recent).is_some_and(|found| found < LOST_SHARE * usual_similarity(twin))
    }

    /// True if for some time too little of the person was visible for a decision.
    pub(super) fn is_hidden(&self) -> bool {
        let steps = &self.walk.twins[self.walk.best()].steps;
        let Some(last) = steps.last() else { return false };
        let seen = steps.iter().rev().find(|step| step.visible >= DECIDING_SHARE);
        last.time_s - seen.unwrap_or(&steps[0]).time_s > LONGEST_HIDDEN_S
    }

    /// True if the person is somewhere else than at the start.
    pub(super) fn moves_on(&self) -> bool {
        let twin = &self.walk.twins[self.walk.best()];
        let (Some(first), Some(last)) = (twin.steps.first(), twin.steps.last()) else { return false };
        let covered_m = last.state.along.position - first.state.along.position;
        covered_m.abs() >= SLOWEST_MPS * (last.time_s - first.time_s)
    }

    /// True if the moving thing walked: over all frames it moved on where something changes, and its displacement per
    /// cycle is possible for legs of its height.
    ///
    /// Swinging arms and carried things can look like a walker for half a second, but then the legs of the model
    /// do not fit the displacement.
    pub(super) fn is_walk(&self) -> bool {
        let twin = &self.walk.twins[self.walk.best()];
        let (Some(first), Some(last)) = (twin.steps.first(), twin.steps.last()) else { return false };
        let elapsed_s = last.time_s - first.time_s;
        let covered_m = last.state.along.position - first.state.along.position;
        let cycles = last.state.phase.position - first.state.phase.position;
        if self.is_on_treadmill {
            return cycles >= SLOWEST_HZ * elapsed_s;
        }
        let stride = covered_m / cycles / self.walk.walker.body.height_m;
        is_somebody_there(&twin.steps)
            && covered_m.abs() >= SLOWEST_MPS * elapsed_s
            && cycles.abs() >= SLOWEST_HZ * elapsed_s
            && STRIDE_HEIGHTS.contains(&stride)
    }

    /// Removes the frames before the person appeared and those after the walk was over or the person was gone.
    ///
    /// A person who appears between two frames also changes the empty frame, because eq. (1) uses both
    /// neighbours.
    pub(super) fn trim(&mut self) {
        let twin = &self.walk.twins[self.walk.best()];
        let low = LOST_SHARE * usual_similarity(twin);
        let absent = twin.steps.iter().take_while(|s| f64::from(s.similarity) < low).count();
        let least = least_changing(&twin.steps);
        let is_empty = |s: &Step| s.changing.is_some_and(|changing| changing < least);
        let is_gone = |s: &&Step| f64::from(s.similarity) < low || s.visible < DECIDING_SHARE || is_empty(s);
        let gone =
            Some(twin.steps.iter().rev().take_while(is_gone).count()).filter(|gone| *gone >= LEAST_GONE);
        let over = if self.is_over() { RECENT_FRAMES / 2 } else { 0 };
        let end = twin.steps.len() - over.max(gone.unwrap_or(0));
        let frontal = self.frontal.as_ref().filter(|_| twin.steps.last().is_some_and(|step| step.by_feet));
        let end = frontal.map_or(end, |frontal| frontal.seen().min(end));
        self.walk.keep(absent.min(end)..end);
    }

    /// Drops the frames from this one on.
    pub(super) fn drop_from(&mut self, frame: usize) {
        let steps = &self.walk.twins[0].steps;
        let end = steps.partition_point(|step| step.frame < frame);
        self.walk.keep(0..end);
        self.kept.retain(|(_, edges)| edges.frame < frame);
    }

    /// The rotations of the camera in the frames of the walk; none if it stood still in all of them.
    pub(super) fn turns<'a>(&self, motions: impl Iterator<Item = &'a CameraMotion>) -> Vec<DVec3> {
        let steps = &self.walk.twins[self.walk.best()].steps;
        let known: HashMap<usize, DVec3> = motions.map(|motion| (motion.frame, motion.turn_rad)).collect();
        let turns: Vec<DVec3> =
            steps.iter().map(|step| known.get(&step.frame).copied().unwrap_or(DVec3::ZERO)).collect();
        if turns.iter().any(|turn| *turn != DVec3::ZERO) { turns } else { Vec::new() }
    }

    /// True if path and person can be settled: so many frames were followed, or as many as a fit needs of somebody who moves
    /// on, but for as long. Who stays needs all of them for a start on the spot.
    pub(super) fn shows_path(&self, options: &TrackerOptions) -> bool {
        let ends = self.kept.first().zip(self.kept.last());
        let lasts_s = ends.map_or(0.0, |((_, first), (_, last))| last.time_s - first.time_s);
        let is_long = self.kept.len() >= LEAST_FRAMES && lasts_s >= options.path_s();
        self.kept.len() >= options.path_frames || is_long && self.moves_on()
    }

    /// Starts again with smaller steps if the phase stands still, on an oblique path if the kept frames show one, and with
    /// the person's own body and gait. This happens once per walk.
    pub(super) fn settle(&mut self, backdrop: &Backdrop, options: &TrackerOptions) {
        if !std::mem::replace(&mut self.settled, true) {
            let kept = std::mem::take(&mut self.kept);
            if !self.is_on_treadmill {
                self.look_for_steps(&kept, options);
                self.turn_path(&kept, options);
            }
            self.adopt_person(&kept, backdrop, options);
            self.kept = kept;
            self.pace_again(options);
        }
    }

    /// Fits the person to the frames so far, from the smoothed track; `None` without the option. With the
    /// probability of exchanged sides, the sides are decided anew.
    pub(super) fn fit(
        &self,
        backdrop: &Backdrop,
        options: &TrackerOptions,
        p_swapped: Option<f64>,
    ) -> Option<Result<WalkFit, FitError>> {
        let fit = options.fit.as_ref()?;
        if self.is_frontal() {
            return Some(Err(FitError::Frontal));
        }
        let steps = &self.walk.twins[self.walk.best()].steps;
        let shown: HashSet<usize> =
            steps.iter().filter(|step| !step.by_feet).map(|step| step.frame).collect();
        let pieces = self.pieces.iter().filter(|piece| shown.contains(&piece.frame));
        let views = match self.is_on_treadmill {
            true => self.early.as_ref().unwrap_or(backdrop).views_on_the_spot(pieces),
            false => backdrop.views(pieces),
        };
        let on_scale = |fit: WalkFit| {
            let height = fit.height.map(|height| height.on_scale(self.height.scale_sd));
            WalkFit { height, ..fit }
        };
        Some(self.tracked(options).fit(views, fit, p_swapped).map(on_scale))
    }

    /// Row of the crown in each frame by the changes, pixels.
    pub(super) fn crowns_px(&self) -> Vec<Option<f64>> {
        let known: HashMap<usize, f64> =
            self.pieces.iter().filter_map(|piece| Some((piece.frame, piece.crown_px?))).collect();
        if self.pieces.is_empty() {
            return Vec::new();
        }
        self.steps().iter().map(|step| known.get(&step.frame).copied()).collect()
    }

    /// What a fit starts from.
    fn tracked<'a>(&'a self, options: &'a TrackerOptions) -> Tracked<'a> {
        Tracked {
            walk: &self.walk,
            camera: &self.camera,
            tilt: self.tilt.as_ref(),
            average: &self.average,
            height: &self.height,
            is_on_treadmill: self.is_on_treadmill,
            depth_sd_m: self.depth_sd_m,
            filter: &options.walk.filter,
        }
    }

    /// True unless the fitted feet of a person on the spot take steps that no legs of that height take.
    pub(super) fn takes_steps(&self, fit: Option<&WalkFit>) -> bool {
        let Some((fit, belt)) = fit.and_then(|fit| Some((fit, fit.belt?))) else { return true };
        let steps = &self.walk.twins[self.walk.best()].steps;
        let elapsed_s = steps[steps.len() - 1].time_s - steps[0].time_s;
        let cycles = fit.frames[fit.frames.len() - 1].phase - fit.frames[0].phase;
        STRIDE_HEIGHTS.contains(&(belt.speed_mps * elapsed_s / cycles / fit.body.height_m))
    }

    /// The given or assumed height, or the one that a fit measured.
    pub(super) fn height_by(&self, fit: Option<&WalkFit>) -> BodyHeight {
        let measured = fit.and_then(|fit| fit.height);
        match (self.height.source, measured) {
            (HeightSource::Given, _) | (_, None) => self.height,
            (_, Some(measured)) => measured,
        }
    }

    /// Follows the kept frames again, and from then on the person instead of the average, if the person could be
    /// fitted to them and is nearer to the edges than the average.
    pub(super) fn adopt_person(&mut self, kept: &Kept, backdrop: &Backdrop, options: &TrackerOptions) {
        let Some(Ok(fit)) = self.fit(backdrop, options, None) else { return };
        if fit.quality.missed > MOST_MISSED_TO_ADOPT {
            return;
        }
        self.average.body.height_m = self.height_by(Some(&fit)).height_m;
        let [first, last] = [&fit.frames[0], &fit.frames[fit.frames.len() - 1]];
        let steps = &self.walk.twins[self.walk.best()].steps;
        let elapsed_s = steps[steps.len() - 1].time_s - steps[0].time_s;
        let beginning = Beginning {
            time_s: steps[0].time_s,
            along_m: first.along_m,
            phase: first.phase,
            speed_mps: (last.along_m - first.along_m) / elapsed_s,
            rate_hz: (last.phase - first.phase) / elapsed_s,
        };
        let average = self.walk.clone();
        self.follow_again(Walk::new(fit.walker(), fit.route.clone(), beginning), kept, options);
        let summed = |walk: &Walk| walk.twins[walk.best()].similarity_sum;
        let height_m = self.average.body.height_m;
        if summed(&self.walk) <= summed(&average) || self.walk.is_less_usual_than(&average, height_m) {
            self.walk = average;
        }
    }

    /// Starts again on an oblique path if the sightings show one and the contours fit it better.
    fn turn_path(&mut self, kept: &Kept, options: &TrackerOptions) {
        let sightings: Vec<Sighting> = kept.iter().filter_map(|(sighting, _)| *sighting).collect();
        let crown =
            Crown { height_m: self.walk.walker.level_crown_height_m(), sd_m: self.height.sd_in_camera_m() };
        let Some(course) = locate_slanting(&sightings, &self.camera, &crown) else { return };
        let frames: Vec<&FrameEdges> = kept.iter().map(|(_, e)| e).take(options.start_frames).collect();
        let walker = &self.walk.walker;
        if let Some(start) = start(&frames, &course, walker, &self.camera, &options.cadence, &options.walk) {
            let straight = self.walk.clone();
            self.follow_again(Walk::new(walker.clone(), start.path, start.beginning), kept, options);
            let summed = |walk: &Walk| walk.twins[walk.best()].similarity_sum;
            let is_worse = self.walk.is_less_usual_than(&straight, self.average.body.height_m);
            if !is_worse && summed(&self.walk) > (1.0 + SLANT_GAIN) * summed(&straight) {
                self.start = start;
            } else {
                self.walk = straight;
            }
        }
    }

    fn follow_again(&mut self, mut walk: Walk, kept: &Kept, options: &TrackerOptions) {
        for (_, edges) in kept {
            walk.follow(edges, &self.camera, &options.walk);
        }
        self.walk = walk;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::fit::edge_search::View;
    use super::super::route::Route;
    use super::super::search::tests::{camera, edges_of, rectangle_of, walker};
    use super::super::search::{Axis, Hypothesis, Path, Scene};
    use super::super::start::Direction;
    use super::super::start::tests::report;
    use super::super::walk::{Look, State, Step};
    use super::*;
    use crate::estimate::kalman::ConstantVelocity;
    use crate::image::{Image, Rectangle};
    use glam::DVec2;

    pub const PATH: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    pub const BEGINNING: Beginning =
        Beginning { time_s: 0.0, along_m: -0.6, phase: 0.2, speed_mps: 1.2, rate_hz: 0.9 };
    const WINDOW: Rectangle = Rectangle { left: 0, top: 0, right: 639, bottom: 479 };
    const FRAME_S: f64 = 0.05;

    /// A walk of the given steps; the second twin is worse.
    pub fn active(steps: Vec<Step>) -> Active {
        let mut walk = Walk::new(walker(), PATH, BEGINNING);
        walk.twins[0].similarity_sum = steps.iter().map(|s| f64::from(s.similarity)).sum();
        walk.twins[0].visible_sum = steps.iter().map(|s| f64::from(s.visible)).sum();
        walk.twins[0].frame_count = steps.len();
        walk.twins[0].steps = steps;
        walk.twins[1].steps = walk.twins[0].steps.clone();
        Active {
            camera: camera(),
            tilt: None,
            height: BodyHeight::given(1.75),
            depth_sd_m: 0.1,
            start: report(PATH, BEGINNING, Direction::Forward),
            walk,
            average: walker(),
            person: 0,
            started_near: false,
            kept: Vec::new(),
            gait_speed_mps: 1.2,
            settled: false,
            pieces: Vec::new(),
            is_on_treadmill: false,
            early: None,
            feet: BTreeMap::new(),
            earlier: Standing::default(),
            before: Vec::new(),
            frontal: None,
        }
    }

    /// A step with this similarity at a position and phase.
    fn step(frame: usize, [along_m, cycles]: [f64; 2], similarity: f32) -> Step {
        let state = State {
            along: ConstantVelocity::new(along_m, 1.2, 1e-4, 1e-3),
            height: ConstantVelocity::new(1.15, 0.0, 1e-4, 0.0),
            phase: ConstantVelocity::new(cycles, 0.9, 1e-4, 1e-3),
        };
        let (alongs, heights) = (Axis::around(along_m, 0.1, 0.02), Axis::around(1.15, 0.1, 0.02));
        let look = Look { window: WINDOW, alongs, heights, best: state.hypothesis(), path: PATH };
        let (time_s, measured) = (FRAME_S * frame as f64, Some(state.hypothesis()));
        Step {
            frame,
            time_s,
            state,
            measured,
            similarity,
            visible: 1.0,
            changing: None,
            shared: false,
            by_feet: false,
            look,
        }
    }

    /// A good walk of `count` frames whose last twelve have these speeds and this similarity.
    fn ending(count: usize, speed_mps: f64, rate_hz: f64, similarity: f32) -> Active {
        let mut at = [0.0, 0.0];
        let next = |k: usize| {
            let is_last = k + 12 >= count;
            if k > 0 {
                // The first of the last twelve frames is reached at the usual speeds.
                let moves = if k + 12 > count { [speed_mps, rate_hz] } else { [1.2, 0.9] };
                at = [at[0] + moves[0] * FRAME_S, at[1] + moves[1] * FRAME_S];
            }
            step(k, at, if is_last { similarity } else { 0.5 })
        };
        active((0..count).map(next).collect())
    }

    #[test]
    fn fewer_frames_that_last_as_long_show_a_path_of_who_moves_on() {
        let options = TrackerOptions::default();
        let followed = |count: usize, frame_s: f64, speed_mps: f64| {
            let steps = (0..count).map(|k| step(k, [speed_mps * FRAME_S * k as f64, 0.05 * k as f64], 0.5));
            let mut active = active(steps.collect());
            active.kept = (0..count).map(|k| (None, frame_at(k, frame_s * k as f64))).collect();
            active.shows_path(&options)
        };
        assert!(!followed(39, 0.04, 1.2) && followed(40, 0.04, 1.2), "25 frames per second");
        assert!(!followed(19, 0.083, 1.2) && followed(20, 0.083, 1.2), "12 frames per second");
        assert!(!followed(14, 0.143, 1.2) && followed(15, 0.143, 1.2), "what a fit needs");
        assert!(!followed(39, 0.143, 0.1) && followed(40, 0.143, 0.1), "who stays");
    }

    fn frame_at(frame: usize, time_s: f64) -> FrameEdges {
        FrameEdges::of_one_alone(frame, time_s, WINDOW, Vec::new())
    }

    #[test]
    fn a_walk_goes_on_while_body_and_legs_move_and_the_model_fits() {
        assert!(!ending(40, 1.2, 0.9, 0.5).is_over());
        assert!(!ending(40, -1.2, -0.9, 0.5).is_over(), "backwards");
        assert!(ending(40, 0.0, 0.0, 0.5).is_over());
        // A person who stands still or glides no longer walks: 0.25 m/s, 0.3 Hz.
        for (speed_mps, rate_hz, is_over) in [
            (0.24, 0.9, true),
            (0.26, 0.9, false),
            (1.2, 0.29, true),
            (1.2, 0.31, false),
            (-0.26, -0.31, false),
        ] {
            assert_eq!(ending(40, speed_mps, rate_hz, 0.5).is_over(), is_over, "{speed_mps}, {rate_hz}");
        }
    }

    /// A phase that runs at half the rate makes steps of twice the length.
    #[test]
    fn a_walk_with_impossible_steps_gives_way_to_one_with_usual_ones() {
        let walked = |speed_mps: f64, rate_hz: f64| {
            let at = |k: usize| [speed_mps, rate_hz].map(|rate| rate * FRAME_S * k as f64);
            active((0..40).map(|k| step(k, at(k), 0.5)).collect()).walk
        };
        let (usual, halved) = (walked(1.2, 0.9), walked(1.2, 0.45));
        assert!(halved.is_less_usual_than(&usual, 1.75) && !usual.is_less_usual_than(&halved, 1.75));
        assert!(!usual.is_less_usual_than(&walked(1.3, 1.0), 1.75));
        // Twice too high a frame rate: neither has steps as people take them.
        assert!(!walked(2.4, 0.9).is_less_usual_than(&walked(2.4, 1.8), 1.75));
        assert!(!walked(1.2, 0.0).is_less_usual_than(&walked(0.0, 0.0), 1.75), "on the spot");
        assert!(walked(1.2, 0.0).is_less_usual_than(&usual, 1.75), "the phase stands still");
        assert!(!usual.is_less_usual_than(&active(Vec::new()).walk, 1.75));
    }

    /// At 0.6 of the mean speed and less; who is hidden or lost, or walks on a treadmill, does not stand.
    #[test]
    fn who_is_seen_to_slow_down_stands() {
        let slowed = |share: f64| {
            let mut walk = ending(40, 1.2, 0.9, 0.5);
            walk.walk.twins[0].steps[39].state.along.velocity = share * 1.2;
            walk
        };
        let last = slowed(0.1).sign().unwrap();
        assert_eq!(slowed(0.1).standing(), Some(Sign { stands: true, ..last }));
        for (share, stands) in [(0.59, true), (-0.59, true), (0.61, false), (-0.61, false), (1.0, false)] {
            assert_eq!(slowed(share).standing().is_some(), stands, "{share}");
        }
        let mut turned_round = slowed(1.0);
        turned_round.walk.twins[0].steps[33].state.along.velocity = 0.1;
        assert!(turned_round.standing().is_some(), "slow for a moment");
        for (visible, similarity) in [(0.2, 0.5), (1.0, 0.1)] {
            let mut unseen = slowed(0.1);
            for step in &mut unseen.walk.twins[0].steps[28..] {
                (step.visible, step.similarity) = (visible, similarity);
            }
            assert_eq!(unseen.standing(), None, "{visible}, {similarity}");
        }
        assert_eq!(Active { is_on_treadmill: true, ..slowed(0.1) }.standing(), None);
        assert_eq!(active(Vec::new()).standing(), None);
    }

    /// Frames in which others hide the person do not end a walk.
    #[test]
    fn hidden_frames_end_no_walk() {
        let behind = |visible: f32| {
            let mut walk = ending(40, 1.2, 0.9, 0.0);
            walk.walk.twins[0].steps[28..].iter_mut().for_each(|step| step.visible = visible);
            walk.is_over()
        };
        assert!(behind(1.0) && behind(0.5) && !behind(0.4) && !behind(0.0));
    }

    #[test]
    fn the_fit_is_told_how_much_of_the_person_each_frame_shows() {
        let mut walk = ending(40, 1.2, 0.9, 0.5);
        walk.walk.twins[0].steps.iter_mut().for_each(|step| step.visible = step.frame as f32 / 64.0);
        let view = View {
            corner: [0, 0],
            pixels: Image::filled(1, 1, [0; 2]),
            is_empty_known: false,
            others: Vec::new(),
            crown_px: None,
        };
        let options = options();
        let frames = walk.tracked(&options).frames(vec![view; 40]);
        assert_eq!(frames.len(), 40);
        for (k, frame) in frames.iter().enumerate() {
            assert_eq!(frame.visible, k as f64 / 64.0);
        }
    }

    #[test]
    fn a_walk_ends_where_the_model_finds_less_than_its_share() {
        // Twelve of 40 frames at s, the others at 0.5: the share is 0.45 of (14 + 12 s) / 40.
        let border = 0.45 * 14.0 / (40.0 - 0.45 * 12.0);
        assert!(ending(40, 1.2, 0.9, border - 0.005).is_over());
        assert!(!ending(40, 1.2, 0.9, border + 0.005).is_over());
        assert!(ending(40, 1.2, 0.9, 0.0).is_over());
    }

    #[test]
    fn bodies_overlap_in_the_frames_of_both() {
        let walk = |from: usize, ahead_m: f64| {
            let at = |k: usize| [ahead_m + 1.2 * FRAME_S * k as f64, 0.9 * FRAME_S * k as f64];
            active((from..from + 20).map(|k| step(k, at(k), 0.5)).collect())
        };
        let first = walk(0, 0.0);
        assert!((first.overlap(&walk(10, 0.0)) - 1.0).abs() < 1e-9);
        let beside = first.overlap(&walk(0, 0.3));
        assert!((0.2..0.7).contains(&beside), "{beside}");
        assert_eq!(first.overlap(&walk(0, 3.0)), 0.0, "elsewhere");
        assert_eq!(first.overlap(&walk(20, 0.0)), 0.0, "later");
    }

    #[test]
    fn a_young_walk_is_not_over() {
        assert!(!ending(23, 0.0, 0.0, 0.0).is_over() && ending(24, 0.0, 0.0, 0.0).is_over());
        assert!(!active(Vec::new()).is_over());
    }

    /// 40 frames at these speeds, of a person 1.75 m tall.
    fn steady(speed_mps: f64, rate_hz: f64) -> Active {
        let at = |k: usize| [speed_mps, rate_hz].map(|v| v * FRAME_S * k as f64);
        active((0..40).map(|k| step(k, at(k), 0.5)).collect())
    }

    #[test]
    fn what_does_not_get_on_with_its_legs_is_no_walk() {
        for (speed_mps, rate_hz, is_walk) in [
            (1.2, 0.9, true),
            (-1.2, -0.9, true),
            // Short and long strides: 0.5 and 1.2 body heights.
            (0.7 * 0.5 * 1.75, 0.7, true),
            (1.2 * 1.2 * 1.75, 1.2, true),
            // The legs walk forward while the body moves backward.
            (1.2, -0.9, false),
            (-1.2, 0.9, false),
            // Less than 0.25 m/s or 0.3 Hz, with a valid stride.
            (0.24, 0.35, false),
            (0.26, 0.35, true),
            (0.5, 0.29, false),
            (0.5, 0.31, true),
            // Strides of 0.24 and 1.7 heights.
            (0.24 * 1.75, 1.0, false),
            (0.26 * 1.75, 1.0, true),
            (1.7 * 1.75, 1.0, false),
            (1.5 * 1.75, 1.0, true),
            (0.0, 0.0, false),
        ] {
            assert_eq!(steady(speed_mps, rate_hz).is_walk(), is_walk, "{speed_mps} m/s, {rate_hz} Hz");
        }
        assert!(!active(Vec::new()).is_walk(), "without a frame");
    }

    /// Somebody stands and swings the arms, and the model walks away and comes back.
    #[test]
    fn a_model_that_walks_where_nothing_changes_is_no_walk() {
        let walk = |away: usize, visible: f32| {
            let mut walk = steady(1.2, 0.9);
            for step in walk.walk.twins.iter_mut().flat_map(|twin| &mut twin.steps) {
                step.visible = visible;
                // What changed before the walk started is not known.
                step.changing = (step.frame >= 12).then_some(if step.frame < 12 + away { 0.0 } else { 0.5 });
            }
            walk
        };
        assert!(walk(0, 1.0).is_walk() && walk(7, 1.0).is_walk());
        assert!(!walk(8, 1.0).is_walk() && !walk(14, 1.0).is_walk());
        assert!(walk(14, 0.3).is_walk(), "it says nothing about somebody who is hidden");
    }

    fn frames(active: &Active) -> (usize, usize) {
        let steps = &active.walk.twins[0].steps;
        assert_eq!(active.walk.twins[1].steps.len(), steps.len(), "both twins alike");
        (steps[0].frame, steps[steps.len() - 1].frame)
    }

    #[test]
    fn frames_before_the_person_and_after_the_walk_are_taken_off() {
        let mut good = ending(40, 1.2, 0.9, 0.5);
        good.trim();
        assert_eq!(frames(&good), (0, 39));
        let mut stopped = ending(40, 0.0, 0.0, 0.5);
        stopped.trim();
        assert_eq!(frames(&stopped), (0, 33), "half of the last twelve");
        let mut late = ending(40, 1.2, 0.9, 0.5);
        let steps = &mut late.walk.twins[0].steps;
        steps[..3].iter_mut().for_each(|step| step.similarity = 0.1);
        steps[20].similarity = 0.1;
        late.trim();
        assert_eq!(frames(&late), (3, 39), "a gap within stays");
        let mut lost = ending(40, 1.2, 0.9, 0.0);
        lost.walk.twins[0].steps.iter_mut().for_each(|step| step.similarity = 0.0);
        lost.trim();
        assert!(lost.walk.twins[0].steps.is_empty(), "nobody was there");
    }

    /// Somebody vanishes, and the model walks on along edges of the room.
    #[test]
    fn a_walk_does_not_end_where_nothing_changes() {
        let last = |usual: f32, end: f32, visible: f32| {
            let mut walk = ending(40, 1.2, 0.9, 0.4);
            for twin in &mut walk.walk.twins {
                twin.steps.iter_mut().for_each(|step| step.changing = Some(usual));
                twin.steps[34..].iter_mut().for_each(|step| step.changing = Some(end));
                twin.steps.iter_mut().for_each(|step| step.visible = visible);
                twin.steps[15].changing = Some(0.0);
            }
            walk.trim();
            frames(&walk)
        };
        assert_eq!(last(0.7, 0.0, 1.0), (0, 33));
        assert_eq!(last(0.7, 0.2, 0.5), (0, 33), "as much as another person beside leaves");
        assert_eq!(last(0.7, 0.4, 1.0), (0, 39), "a person who turns into the line of sight");
        assert_eq!(last(0.3, 0.2, 1.0), (0, 39), "who walks towards the camera changes little");
        assert_eq!(last(0.3, 0.1, 1.0), (0, 33));
    }

    /// Twelve frames with the contours of a person who walks along `path` and the rectangles of a person who
    /// walks along `seen`.
    fn kept(path: &Path, seen: &Path) -> Vec<(Option<Sighting>, FrameEdges)> {
        frames_on(12, 0.1, &(*path).into(), &(*seen).into())
    }

    /// The same of any number of frames, at this distance in seconds.
    pub fn frames_on(
        count: usize,
        frame_s: f64,
        route: &Route,
        seen: &Route,
    ) -> Vec<(Option<Sighting>, FrameEdges)> {
        let (walker, camera) = (walker(), camera());
        let frame = |k: usize| {
            let time_s = frame_s * k as f64;
            let along_m = -0.6 + 1.2 * time_s;
            let height_m = walker.level_torso_height_m();
            let scene = Scene::new(&walker, &camera, &route.at(along_m));
            let edges = edges_of(&scene, &Hypothesis { along_m, height_m, phase: 0.2 + 0.9 * time_s });
            (
                Some(Sighting {
                    time_s,
                    rectangle: rectangle_of(&walker, &camera, &seen.at(along_m), along_m),
                }),
                FrameEdges::of_one_alone(k, time_s, WINDOW, edges),
            )
        };
        (0..count).map(frame).collect()
    }

    pub fn options() -> TrackerOptions {
        TrackerOptions { start_frames: 5, fit: None, ..TrackerOptions::for_height(1.75) }
    }

    /// A walk followed through the kept frames on a path parallel to the image plane, then turned.
    fn refitted(kept: Vec<(Option<Sighting>, FrameEdges)>) -> Active {
        let mut active = active(Vec::new());
        for (_, edges) in &kept {
            active.walk.follow(edges, &active.camera, &options().walk);
        }
        active.kept = kept;
        active.settle(&Backdrop::default(), &options());
        assert!(active.settled);
        active
    }

    #[test]
    fn a_slanting_path_is_taken_where_rectangles_and_contours_show_it() {
        let slanting = Path { heading_rad: 0.4, ..PATH };
        let turned = refitted(kept(&slanting, &slanting));
        let path = turned.walk.route.at(0.0);
        assert!((path.heading_rad - 0.4).abs() < 0.1, "{path:?}");
        assert_eq!((turned.start.path, turned.walk.beginning), (path, turned.start.beginning));
        assert_eq!(turned.walk.twins[0].steps.len(), 12);
        assert!(turned.walk.twins[0].similarity_sum > 8.0);
    }

    #[test]
    fn a_path_that_only_the_rectangles_show_is_not_taken() {
        let straight = refitted(kept(&PATH, &Path { heading_rad: 0.4, ..PATH }));
        assert_eq!((straight.walk.route, straight.start.path), (PATH.into(), PATH));
        assert!(straight.walk.twins[0].similarity_sum > 10.0);
    }

    #[test]
    fn a_walk_is_settled_once() {
        let mut active = active(Vec::new());
        active.settled = true;
        active.kept = kept(&PATH, &PATH);
        active.settle(&Backdrop::default(), &options());
        assert_eq!(active.kept.len(), 12, "left alone");
    }
}
