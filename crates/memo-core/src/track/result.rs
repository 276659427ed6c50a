//! The result of tracking: one row of position, phase, joint angles and joints per frame, and gait events.
//!
//! Rows come from the fit of the person ([`fit`](super::fit)) if one was made. Otherwise they come from the smoothed
//! states of the better twin: each row uses all frames of the walk, later ones included. The noise that the paper gives for the filter is generous, so standard deviations are scaled by the
//! observed distance of measurements from predictions. Two errors that do not average out over frames are added:
//! the difference between the person's body and the model, and the distance.

use super::decisions::{ACROSS_SD_M, COMMON_PHASE_SD};
use super::event::EventKind;
use super::fit::contacts::Contact;
use super::fit::{FitError, FittedFrame, MeanSd, Measured, WalkFit};
use super::height::{BodyHeight, HeightSource};
use super::route::Route;
use super::search::{Hypothesis, Scene};
use super::start::{Direction, StartReport};
use super::walk::{Step, Walk, WalkOptions};
use crate::calibrate::TiltEstimate;
use crate::estimate::kalman::{ConstantVelocity, FilterOptions, Noise, smooth};
use crate::model::{ASSUMED_FOCAL_SD, Camera, PosedBody, Posture, SideJoints, Walker};
use glam::{DVec2, DVec3};
use std::borrow::Cow;

use crate::model::skeleton::Side;

/// A finished walk with all intermediate results.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedWalk {
    /// Number of the person, in order of appearance. One person can have several walks.
    pub person: usize,
    /// Both twins with all their steps.
    pub walk: Walk,
    /// The camera of the pictures in which the walk was tracked, given or assumed; of a camera that moves, in the first frame of
    /// its view. [`TrackedWalk::first_camera`] is that of the frames.
    pub camera: Camera,
    /// The camera of the first frame of the view, if the steadied pictures are larger than the frames.
    pub frame_camera: Option<Camera>,
    /// Rotation vector of `frame_camera_from_first_camera` of each row, radians; empty if the camera stood still.
    pub camera_turns: Vec<DVec3>,
    /// How the assumed camera is tilted; `None` if a camera was given.
    pub tilt: Option<TiltEstimate>,
    /// The body height that the walk was tracked with: given, measured or assumed.
    pub height: BodyHeight,
    /// The body height that the first rectangles show in a calibrated camera, if a height was given, metres.
    pub shown_height_m: Option<f64>,
    /// The average walker of the person's height, from which a fit starts.
    pub average: Walker,
    /// Standard deviation of the path's distance from the camera, metres.
    pub depth_sd_m: f64,
    /// Report of the starting phase.
    pub start: StartReport,
    /// Whether the person walks on a treadmill ([`TrackedWalk::treadmill`]).
    pub is_on_treadmill: bool,
    /// Whether the person walks towards the camera or away from it: then the feet show place and phase, left and right
    /// stay open, and the angles are those of the average gait.
    pub is_frontal: bool,
    /// Row of the crown in each row by the changes, pixels; `None` where they do not show the person alone. Empty without
    /// a fit.
    pub crowns_px: Vec<Option<f64>>,
    /// Changes beside the legs that nobody explains who is followed, as a share of the area of two legs: the median over the
    /// frames; `None` if too few show it. [`TrackedWalk::is_beside_somebody`] judges it.
    pub unexplained: Option<f64>,
    /// The fit of the person, or why there is none; `None` if none was asked for.
    pub fit: Option<Result<WalkFit, FitError>>,
    /// The options used.
    pub options: WalkOptions,
}

/// One frame of the result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Time, seconds.
    pub time_s: f64,
    /// Centre of the torso, metres, world Z up.
    pub torso_centre: DVec3,
    /// Direction the body faces, radians about world Z.
    pub heading_rad: f64,
    /// Gait phase in [0, 1), 0 = right heel strike (initial contact).
    pub phase: f64,
    /// Probability that left and right are swapped.
    pub p_swapped: f64,
    /// Speed along the path, m/s; negative for backward walking, relative to the belt on a treadmill.
    pub speed_mps: f64,
    /// Standard deviations of x, y, z (metres) and phase.
    pub sd: [f64; 4],
    /// Joint angles, radians: those of the fitted person, or of the average gait.
    pub posture: Posture,
    /// The angles that were measured, right then left; `None` without a fit.
    pub measured: Option<[Measured; 2]>,
    /// Joints of the right side, metres.
    pub right: SideJoints,
    /// Joints of the left side, metres.
    pub left: SideJoints,
    /// Similarity of the best hypothesis of the frame; 0 for frames without a measurement.
    pub similarity: f64,
    /// Place along the path, level height and phase.
    pub hypothesis: Hypothesis,
}

/// A gait event; its time lies between two frames in general.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time, seconds.
    pub time_s: f64,
    /// Frame number, fractional.
    pub frame: f64,
    /// Heel strike (initial contact) or toe-off.
    pub kind: EventKind,
    /// Which foot.
    pub side: Side,
}

/// Errors common to all frames of a walk, standard deviations measured on motion-captured walks: along the path
/// (metres), height (metres), phase (cycles; due to the definition of heel strike).
const COMMON_SD: [f64; 3] = [0.015, 0.02, 0.015];

impl TrackedWalk {
    /// The measured person, if the fit succeeded.
    pub fn fitted(&self) -> Option<&WalkFit> {
        self.fit.as_ref()?.as_ref().ok()
    }

    /// Probability that left and right are swapped in the whole walk: of the fit, or of the twins' similarities. A model
    /// that is not on the person does not show it, and neither do the feet of somebody who walks along the line of sight.
    pub fn p_swapped(&self) -> f64 {
        match &self.fit {
            Some(Ok(fit)) => fit.p_swapped,
            Some(Err(FitError::Misfit { .. })) => 0.5,
            _ if self.is_frontal => 0.5,
            _ => self.walk.swap_probability(&self.options.swap),
        }
    }

    /// Probability that somebody on a treadmill has the other heading that looks alike, in which the steps are others.
    pub fn p_other_heading(&self) -> f64 {
        self.fitted().and_then(|fit| fit.mirrored).map_or(0.0, |mirrored| mirrored.probability)
    }

    /// True if a height was given and the fit contradicts it by more than three standard deviations.
    pub fn is_height_contradicted(&self) -> bool {
        let measured = self.fitted().and_then(|fit| fit.height);
        self.height.source == HeightSource::Given
            && measured.is_some_and(|seen| self.height.contradicts(&seen))
    }

    /// The way walked: that of the fit, or the tracker's.
    pub fn route(&self) -> &Route {
        self.fitted().map_or(&self.walk.route, |fit| &fit.route)
    }

    /// The body in a row of [`TrackedWalk::rows`], placed in the world.
    ///
    /// # Panics
    ///
    /// There is no such row in the fit.
    pub fn pose_of(&self, index: usize, row: &Row) -> PosedBody {
        match self.fitted() {
            Some(fit) => fit.pose(index),
            None => self.scene(row.hypothesis.along_m).pose(&row.hypothesis),
        }
    }

    /// The camera of the frame of a row: its pixels are those of the frame as it was given.
    pub fn camera_of(&self, index: usize) -> Cow<'_, Camera> {
        match self.camera_turns.get(index).filter(|turn| **turn != DVec3::ZERO) {
            None => Cow::Borrowed(self.first_camera()),
            Some(turn) => Cow::Owned(self.first_camera().turned(*turn)),
        }
    }

    /// The camera, given or assumed, of the first frame of the view.
    pub fn first_camera(&self) -> &Camera {
        self.frame_camera.as_ref().unwrap_or(&self.camera)
    }

    /// Forward or backward walking.
    pub fn direction(&self) -> Direction {
        self.start.direction
    }

    /// The tracker's walker and camera, and the tangent of its route at a place along it, metres.
    pub fn scene(&self, along_m: f64) -> Scene<'_> {
        Scene::new(&self.walk.walker, &self.camera, &self.walk.route.at(along_m))
    }

    /// Steps of the better twin: measurements and filtered states.
    pub fn steps(&self) -> &[Step] {
        self.walk.steps()
    }

    /// One row per frame.
    pub fn rows(&self) -> Vec<Row> {
        let steps = self.steps();
        match self.fitted() {
            Some(fit) => (0..fit.frames.len()).map(|k| self.fitted_row(&steps[k], fit, k)).collect(),
            None => self.tracked_rows(steps),
        }
    }

    fn tracked_rows(&self, steps: &[Step]) -> Vec<Row> {
        let p_swapped = self.p_swapped();
        let coordinates = coordinates(steps, &self.options.filter);
        let at = |k: usize| match steps[k].by_feet {
            // The feet of all frames show it.
            true => {
                [steps[k].state.along, steps[k].state.height, steps[k].state.phase].map(|state| (state, 1.0))
            }
            false => coordinates.each_ref().map(|c| (c.smoothed[k], c.sd_scale)),
        };
        steps.iter().enumerate().map(|(k, step)| self.row(step, p_swapped, at(k))).collect()
    }

    fn fitted_row(&self, step: &Step, fit: &WalkFit, k: usize) -> Row {
        let frame = &fit.frames[k];
        let posed = fit.pose(k);
        let ahead = DVec2::from_angle(frame.heading_rad);
        let [along, across, height, phase] = self.with_scale(frame, frame.sd);
        let by_focal = self.focal_sd_m(posed.torso_centre.truncate());
        let phase_at = frame.phase.rem_euclid(1.0);
        Row {
            frame: step.frame,
            time_s: step.time_s,
            torso_centre: posed.torso_centre,
            heading_rad: frame.heading_rad,
            phase: phase_at,
            p_swapped: fit.p_swapped,
            speed_mps: speed(&fit.frames, self.steps(), k) + self.belt().speed_mps,
            sd: [
                (ahead.x * along).hypot(ahead.y * across).hypot(by_focal.x),
                (ahead.y * along).hypot(ahead.x * across).hypot(by_focal.y),
                height,
                phase,
            ],
            posture: frame.posture,
            measured: Some(frame.measured),
            right: posed.right,
            left: posed.left,
            similarity: f64::from(step.similarity),
            hypothesis: Hypothesis {
                along_m: frame.along_m,
                height_m: posed.torso_centre.z - self.walk.walker.gait.vertical_m(phase_at),
                phase: phase_at,
            },
        }
    }

    /// Standard deviations of the means over the frames that were fitted; `None` without a fit. Those of the place are of an
    /// assumed height and an assumed camera too.
    pub fn mean_sd(&self) -> Option<MeanSd> {
        let fit = self.fitted()?;
        let middle = &fit.frames[fit.frames.len() / 2];
        let [along, across, height, phase] = self.with_scale(middle, fit.mean_sd.place);
        let centres = fit.frames.iter().map(|frame| frame.torso_centre.truncate());
        let by_focal = self.focal_sd_m(centres.sum::<DVec2>() / fit.frames.len() as f64);
        let ahead = DVec2::from_angle(middle.heading_rad);
        let place =
            [along.hypot(by_focal.dot(ahead)), across.hypot(by_focal.dot(ahead.perp())), height, phase];
        Some(MeanSd { angles: fit.mean_sd.angles, place })
    }

    /// Horizontal direction of the line of sight; zero if the camera looks straight down.
    pub(super) fn view(&self) -> DVec2 {
        (self.camera.rotation.transpose() * DVec3::Z).truncate().normalize_or_zero()
    }

    /// Standard deviation of a place by the focal length of an assumed camera, in the direction of sight, metres. The world
    /// begins where the first person was seen; with the height known, what lies beyond is farther away by f / f0, and what lies
    /// beside it is where it is seen.
    fn focal_sd_m(&self, place: DVec2) -> DVec2 {
        if self.tilt.is_none() {
            return DVec2::ZERO;
        }
        let view = self.view();
        ASSUMED_FOCAL_SD * place.dot(view) * view
    }

    /// Standard deviations near a fitted frame. An assumed height scales the walk about the camera's foot point.
    fn with_scale(&self, frame: &FittedFrame, sd: [f64; 4]) -> [f64; 4] {
        let [along, across, height, phase] = sd;
        let scale_sd = self.height.assumed_scale_sd();
        let (eye, path) = (self.camera.position().truncate(), self.route().at(frame.along_m));
        let off_axis_m = frame.along_m - path.along(eye);
        [
            along.hypot(scale_sd * off_axis_m),
            across.hypot(scale_sd * path.distance(eye)),
            height.hypot(scale_sd * frame.torso_centre.z),
            phase,
        ]
    }

    fn row(&self, step: &Step, p_swapped: f64, [along, height, phase]: [(ConstantVelocity, f64); 3]) -> Row {
        let hypothesis = Hypothesis {
            along_m: along.0.position,
            height_m: height.0.position,
            phase: phase.0.position.rem_euclid(1.0),
        };
        let scene = self.scene(hypothesis.along_m);
        let posed = scene.pose(&hypothesis);
        let sd = |(state, scale): (ConstantVelocity, f64), common: f64| {
            (state.position_sd() * scale).hypot(common)
        };
        // An error of depth also shifts the position along the path, in proportion to its distance from the
        // camera's foot point.
        let eye = self.camera.position().truncate();
        let off_axis = (hypothesis.along_m - scene.path.along(eye)).abs();
        let distance = scene.path.distance(eye);
        let [along_sd, across_sd] = match step.by_feet {
            true => [sd(along, self.depth_sd_m), ACROSS_SD_M],
            false => [sd(along, COMMON_SD[0]).hypot(self.depth_sd_m * off_axis / distance), self.depth_sd_m],
        };
        let heading = scene.path.direction();
        let (forward, across) = (heading.abs() * along_sd, heading.perp().abs() * across_sd);
        let by_focal = self.focal_sd_m(posed.torso_centre.truncate());
        Row {
            frame: step.frame,
            time_s: step.time_s,
            torso_centre: posed.torso_centre,
            heading_rad: scene.path.heading_rad,
            phase: hypothesis.phase,
            p_swapped,
            speed_mps: along.0.velocity + self.belt().speed_mps,
            sd: [
                forward.x.hypot(across.x).hypot(by_focal.x),
                forward.y.hypot(across.y).hypot(by_focal.y),
                sd(height, COMMON_SD[1]).hypot(self.height.assumed_scale_sd() * posed.torso_centre.z),
                sd(phase, if step.by_feet { COMMON_PHASE_SD } else { COMMON_SD[2] }),
            ],
            posture: self.walk.walker.gait.posture(hypothesis.phase, &self.walk.walker.style),
            measured: None,
            right: posed.right,
            left: posed.left,
            similarity: f64::from(step.similarity),
            hypothesis,
        }
    }

    /// Heel strikes (initial contacts) and toe-offs in order of time: those of the fitted feet. Where none are fitted, heel
    /// strikes are the times when the phase of the gait passes them, and there are no toe-offs, which only the feet show. Empty
    /// for backward walking, where toes land first and the phases of contact are not known, and where the model does not fit
    /// the person.
    pub fn events(&self) -> Vec<Event> {
        let is_misfit = matches!(self.fit, Some(Err(FitError::Misfit { .. } | FitError::Undetermined)));
        if self.direction() == Direction::Backward || is_misfit {
            return Vec::new();
        }
        let (rows, steps) = (self.rows(), self.steps());
        if let Some(fit) = self.fitted() {
            let event = |c: &Contact| Event {
                time_s: c.time_s,
                frame: frame_at(&rows, c.time_s),
                kind: c.kind,
                side: c.side,
            };
            let mut events: Vec<Event> = fit.contacts.iter().map(event).collect();
            events.extend(self.passed(&rows, |k| steps[k].by_feet));
            events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
            return events;
        }
        self.passed(&rows, |_| true)
    }

    /// Heel strikes by the phase between two rows of a kind, in order of time.
    fn passed(&self, rows: &[Row], is_of_kind: impl Fn(usize) -> bool) -> Vec<Event> {
        let marks = [(0.0, Side::Right), (0.5, Side::Left)];
        let mut events = Vec::new();
        for (_, pair) in rows.windows(2).enumerate().filter(|(k, _)| is_of_kind(*k) && is_of_kind(k + 1)) {
            for (phase, side) in marks {
                events.extend(crossing(&pair[0], &pair[1], phase).map(|t| Event {
                    time_s: pair[0].time_s + t * (pair[1].time_s - pair[0].time_s),
                    frame: pair[0].frame as f64 + t * (pair[1].frame - pair[0].frame) as f64,
                    kind: EventKind::HeelStrike,
                    side,
                }));
            }
        }
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        events
    }
}

/// The fractional frame number at a time within the rows.
fn frame_at(rows: &[Row], time_s: f64) -> f64 {
    let after = rows.partition_point(|row| row.time_s < time_s).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[after - 1], &rows[after]);
    a.frame as f64 + (time_s - a.time_s) / (b.time_s - a.time_s) * (b.frame - a.frame) as f64
}

/// Speed along the path at a frame, m/s: the difference between its neighbours.
fn speed(frames: &[FittedFrame], steps: &[Step], k: usize) -> f64 {
    let (before, after) = (k.saturating_sub(1), (k + 1).min(frames.len() - 1));
    (frames[after].along_m - frames[before].along_m) / (steps[after].time_s - steps[before].time_s)
}

/// The smoothed place, level height and phase (not wrapped) of each step.
pub(super) fn smoothed_hypotheses(steps: &[Step], filter: &FilterOptions) -> Vec<Hypothesis> {
    let [along, height, phase] = coordinates(steps, filter).map(|c| c.smoothed);
    let at = |k: usize| Hypothesis {
        along_m: along[k].position,
        height_m: height[k].position,
        phase: phase[k].position,
    };
    (0..steps.len()).map(at).collect()
}

/// Place, height and phase of the steps, smoothed.
fn coordinates(steps: &[Step], filter: &FilterOptions) -> [Coordinate; 3] {
    let dt_s: Vec<f64> = steps.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    [
        Coordinate::new(steps, &dt_s, &filter.along, |s| s.state.along, |h, _| h.along_m),
        Coordinate::new(steps, &dt_s, &filter.vertical, |s| s.state.height, |h, _| h.height_m),
        Coordinate::new(
            steps,
            &dt_s,
            &filter.phase,
            |s| s.state.phase,
            |h, p| h.phase - (h.phase - p).round(),
        ),
    ]
}

/// Fraction of the interval between two rows, in [0, 1), at which the phase passes a mark, in either direction.
fn crossing(a: &Row, b: &Row, mark: f64) -> Option<f64> {
    let wrapped = |x: f64| x - x.round();
    let advance = wrapped(b.phase - a.phase);
    let to_mark = wrapped(mark - a.phase);
    let t = to_mark / advance;
    (advance != 0.0 && (0.0..1.0).contains(&t)).then_some(t)
}

/// One smoothed coordinate, and the factor that fits its standard deviations to the observed scatter.
struct Coordinate {
    smoothed: Vec<ConstantVelocity>,
    sd_scale: f64,
}

impl Coordinate {
    fn new(
        steps: &[Step],
        dt_s: &[f64],
        noise: &Noise,
        state: impl Fn(&Step) -> ConstantVelocity,
        measured: impl Fn(&Hypothesis, f64) -> f64,
    ) -> Self {
        let filtered: Vec<ConstantVelocity> = steps.iter().map(&state).collect();
        let smoothed = smooth(&filtered, dt_s, noise);
        let ratio = |k: usize| {
            let prior = filtered[k - 1].predict(dt_s[k - 1], noise);
            // What the feet say was filtered with them.
            let z = measured(steps[k].measured.as_ref().filter(|_| !steps[k].by_feet)?, prior.position);
            Some((z - prior.position).powi(2) / (prior.covariance[0] + noise.measurement_variance))
        };
        let ratios: Vec<f64> = (1..steps.len()).filter_map(ratio).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len().max(1) as f64;
        Self { smoothed, sd_scale: if ratios.is_empty() { 1.0 } else { mean.sqrt() } }
    }
}

#[cfg(test)]
pub(super) mod tests;
