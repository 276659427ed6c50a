//! One cycle of a motion, cut and closed so that it repeats without a jump.
//!
//! The cut is where position and velocity differ least one period later. What still differs in position is
//! taken out evenly over the cycle, point by point. The end of the cycle then turns into what precedes its
//! start, if that was recorded, so that the velocity does not jump either. The cycle is sampled in whole frames.

use super::course::Course;
use super::period::{closes_itself, found_period, mean};
use super::{CycleCut, PointLightError};
use crate::OptionError;
use crate::synth::motion::PointMotion;
use glam::DVec3;
use std::f64::consts::TAU;

/// A cycle on the spot that continues in its own first frame.
pub(super) struct Cycle {
    /// Positions, frame after frame, metres.
    still: Vec<DVec3>,
    points: usize,
    pub frames: usize,
    /// Mean velocity of the body, m/s.
    velocity: DVec3,
    interval_s: f64,
}

/// The share of the cycle at its end that turns into what precedes its start.
const TURN: f64 = 0.1;

/// Largest change of the speed, and of its inverse.
const MOST_TEMPO: f64 = 10.0;

/// The cycle that several motions at the same times have in common: the period, if it is not given, and the start
/// are those that fit all of them best together. Displays that repeat it keep the timing between the actors.
///
/// # Errors
///
/// No motion, motions at different times, a period out of range, or none that fits.
pub fn common_cycle(motions: &[PointMotion], period_s: Option<f64>) -> Result<CycleCut, PointLightError> {
    let first = motions.first().ok_or(PointLightError::NoActor)?;
    if let Some(actor) = motions.iter().position(|other| other.times_s() != first.times_s()) {
        let [frames, others] = [first.frames(), motions[actor].frames()];
        return Err(PointLightError::Clocks { actor, frames, others });
    }
    let stills: Vec<PointMotion> = motions.iter().map(|one| Course::of(one).still).collect();
    let (still, interval_s) = (PointMotion::beside(&stills), first.frame_interval_s());
    let is_closed = closes_itself(&still);
    let period = period_of(&still, interval_s, period_s, is_closed)?;
    let start = if is_closed { 0.0 } else { best_start(&still, period) as f64 };
    Ok(CycleCut { period_s: period * interval_s, start_s: start * interval_s })
}

/// One cycle of a motion, played `tempo` times as fast. The period and the start are found if they are not given.
pub(super) fn closed_cycle(
    motion: &PointMotion,
    period_s: Option<f64>,
    start_s: Option<f64>,
    tempo: f64,
) -> Result<Cycle, PointLightError> {
    let is_possible = (1.0 / MOST_TEMPO..=MOST_TEMPO).contains(&tempo);
    OptionError::unless(is_possible, "tempo", "between 0.1 and 10", tempo)?;
    let (course, interval_s) = (Course::of(motion), motion.frame_interval_s());
    let (still, whole) = (&course.still, motion.frames() as f64);
    let is_closed = closes_itself(still);
    let period = period_of(still, interval_s, period_s, is_closed)?;
    let frames = ((period / tempo).round() as usize).max(1);
    let start = match start_s {
        Some(start_s) => asked_start(start_s, period, interval_s, motion.frames())?,
        None if is_closed => 0.0,
        None => best_start(still, period) as f64,
    };
    let turn = if start >= TURN * period { TURN } else { 0.0 };
    let of_point = |k: usize| move |frame: usize| still.at(frame, k).unwrap_or(DVec3::NAN);
    let path = still.pelvis_path();
    let drift = |positions: &dyn Fn(usize) -> DVec3| {
        let apart =
            between(positions, still.frames(), start + period) - between(positions, still.frames(), start);
        if apart.is_nan() || (is_closed && period == whole) { DVec3::ZERO } else { apart }
    };
    let drifts: Vec<DVec3> = (0..motion.points()).map(|k| drift(&of_point(k))).collect();
    let sampled = (0..frames * motion.points()).map(|i| {
        let (share, k) = ((i / motion.points()) as f64 / frames as f64, i % motion.points());
        let at = |share: f64| {
            between(&of_point(k), still.frames(), start + period * share) - drifts[k] * (share - 0.5)
        };
        turned(at(share), at(share - 1.0), 1.0 - (1.0 - share) / turn)
    });
    let duration_s = (frames as f64 * interval_s).max(f64::MIN_POSITIVE);
    let advance = course.velocity * (period * interval_s) + drift(&|frame| path[frame]).with_z(0.0);
    Ok(Cycle {
        still: sampled.collect(),
        points: motion.points(),
        frames,
        velocity: advance / duration_s,
        interval_s,
    })
}

impl Cycle {
    /// Duration of the cycle, seconds.
    pub fn period_s(&self) -> f64 {
        self.frames as f64 * self.interval_s
    }

    /// The cycle repeated over a number of frames, with the names and the first instant of `motion`.
    pub fn repeated(&self, frames: usize, motion: &PointMotion) -> Course {
        let positions = (0..frames * self.points).map(|i| self.still[i % self.still.len()]).collect();
        let first_s = motion.times_s()[0];
        let times_s = (0..frames).map(|frame| first_s + frame as f64 * self.interval_s).collect();
        Course { still: motion.replaced(positions, times_s), velocity: self.velocity }
    }
}

/// From one position to another: the first up to `done` 0, the second from 1 on, with no jump of the velocity.
fn turned(from: DVec3, to: DVec3, done: f64) -> DVec3 {
    let is_turning = done > 0.0 && !to.is_nan();
    if is_turning { from.lerp(to, done * done * (3.0 - 2.0 * done)) } else { from }
}

/// The period of a motion on the spot in frames, found if it is not given.
fn period_of(
    still: &PointMotion,
    interval_s: f64,
    period_s: Option<f64>,
    is_closed: bool,
) -> Result<f64, PointLightError> {
    match period_s {
        Some(period_s) => asked_period(period_s, interval_s, still.frames()),
        None if is_closed => Ok(part_of(still.frames() as f64, found_period(still, interval_s).ok())),
        None => found_period(still, interval_s),
    }
}

/// A start in whole frames, after which there is a whole period.
fn asked_start(start_s: f64, period: f64, interval_s: f64, frames: usize) -> Result<f64, PointLightError> {
    let start = if interval_s > 0.0 { (start_s / interval_s).round() } else { start_s };
    let is_possible = start == 0.0 || (start > 0.0 && start + period <= frames as f64);
    OptionError::unless(is_possible, "cycle_start_s", "at least 0 and before a whole cycle", start_s)?;
    Ok(start)
}

/// A period in frames; within a frame of the whole motion, it is the whole motion.
fn asked_period(period_s: f64, interval_s: f64, frames: usize) -> Result<f64, PointLightError> {
    let parameter = "period_s";
    OptionError::unless_positive(parameter, period_s)?;
    let available_s = interval_s * frames as f64;
    if period_s > available_s * (1.0 + 1e-9) {
        return Err(PointLightError::TooShort { parameter, wanted_s: period_s, available_s });
    }
    let period = (period_s / interval_s).max(1.0);
    Ok(if period > frames as f64 - 1.0 { frames as f64 } else { period })
}

/// The duration of one cycle of a motion that closes by itself, in frames: a part of the whole, if that repeats.
fn part_of(whole: f64, found: Option<f64>) -> f64 {
    let parts = found.map_or(1.0, |found| (whole / found).round().max(1.0));
    let is_part = found.is_some_and(|found| (whole / parts - found).abs() < 0.5);
    if is_part { whole / parts } else { whole }
}

/// The first frame whose position and velocity differ least from those one period later; one that leaves enough
/// frames before it, if there is any.
fn best_start(still: &PointMotion, period: f64) -> usize {
    let latest = (still.frames() - 1) as f64 - period;
    if latest < 1.0 {
        return 0;
    }
    let before = (TURN * period).ceil();
    let first = if before <= latest { before as usize } else { 0 };
    let pace = period / TAU; // turns velocities into distances, as in a motion of one harmonic
    let apart_sq = |start: f64, k: usize| {
        let at = |t: f64| between(&|frame| still.at(frame, k).unwrap_or(DVec3::NAN), still.frames(), t);
        let moved = |t: f64| 0.5 * (at(t + 1.0) - at(t - 1.0));
        let apart = at(start + period) - at(start);
        let sum = apart.length_squared() + (pace * (moved(start + period) - moved(start))).length_squared();
        sum.is_finite().then_some(sum)
    };
    let cost = |start: usize| mean((0..still.points()).filter_map(|k| apart_sq(start as f64, k)));
    let costs: Vec<f64> = (first..=latest as usize).map(|t| cost(t).unwrap_or(f64::INFINITY)).collect();
    (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).map_or(0, |best| first + best)
}

/// A position between frames by cubic interpolation (Catmull and Rom 1974), NaN if unknown. Beyond the first
/// and the last frame it continues with the nearest step.
fn between(positions: &dyn Fn(usize) -> DVec3, frames: usize, at: f64) -> DVec3 {
    let last = frames - 1;
    let frame = at.floor().clamp(0.0, last.saturating_sub(1) as f64) as usize;
    let (b, t) = (positions(frame), at - frame as f64);
    if t == 0.0 || last == 0 {
        return b;
    }
    let c = positions(frame + 1);
    if !(0.0..1.0).contains(&t) {
        return if t == 1.0 { c } else { b + (c - b) * t };
    }
    let known = |p: Option<DVec3>, straight: DVec3| p.filter(|p| !p.is_nan()).unwrap_or(straight);
    let a = known(frame.checked_sub(1).map(positions), 2.0 * b - c);
    let d = known((frame + 2 <= last).then(|| positions(frame + 2)), 2.0 * c - b);
    let [slope, bend, twist] = [c - a, 2.0 * a - 5.0 * b + 4.0 * c - d, 3.0 * (b - c) + d - a];
    b + 0.5 * t * (slope + t * (bend + t * twist))
}
