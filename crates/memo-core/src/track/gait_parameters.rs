//! Gait parameters of a walk with 95 % intervals: cadence, speed, stride and steps, side by side.
//!
//! Cadence and speed use the gait phase and the position of the trunk in all frames. With a fit of the person
//! ([`fit`](super::fit)) heel strikes (initial contacts) and toe-offs are those of the fitted feet, and stance, swing
//! and supports, ranges of motion and the peak flexion of the knee are measured. Without one, a heel strike is the
//! time at which the measured phase passes 0 (right) or 1/2 (left), and these parameters are unknown: the average
//! gait has them, not the person. A step length is the displacement of the trunk between two strikes, so a
//! difference in the reach of the two feet is not visible: the intervals of the sides contain its spread over people.
//!
//! The intervals are for the person's gait, of which the observed steps are a sample. They are wider than
//! intervals for the observed steps alone. Four terms enter:
//!
//! 1. the scatter of frames or strikes about the fit, measured in the walk itself;
//! 2. step variability, `NATURAL_SHARE`, combined by side with the variability of the observed steps;
//! 3. errors common to all steps of a side, because a person differs from the model: `STRIKE_SD_CYCLES`,
//!    `REACH_SD_M`;
//! 4. for lengths, the scale, which is the distance from the camera. It depends on the body height given (to 2
//!    cm), on the rows of sole and crown (`track::locate`), on `POSTURE_SD` and, for oblique paths seen by an
//!    assumed camera, on `ASSUMED_FOCAL_SD`.
//!
//! On a treadmill, lengths and speed are those on the belt: displacement of the trunk plus that of the belt, whose
//! standard deviation is a fifth term.
//!
//! Sources of the numbers. Measured on four motion-captured walks (two of the Biomechanical-ToolKit data, CMU
//! 02_01 and 12_01; contacts by the ankle's speed, 11 degrees of freedom): a step differs from its side's mean by
//! 3.3 % in time and 3.6 % in length, part of which is error of the contacts; the feet differ in reach by 0.012 m
//! (root mean square). Measured on videos of three of them: `STRIKE_SD_CYCLES`. Published: lengths vary by 4.6 %
//! of the mean at a person's own speed, and people differ in that by a third (J NeuroEng Rehabil 9:69, 2012,
//! table 1), which is as informative as 4 to 5 observed steps: `PRIOR_STEPS`. Measured on drawn walkers:
//! `REACH_COUNTS`, `POSTURE_SD`. Assumed: the distribution of fields of view, the 2 cm, and that all these
//! deviations are normal and independent.
//!
//! `tests/gait_parameters.rs` draws a population with these deviations and counts how often the intervals contain
//! the truth. The unit tests simulate the measurements of 1,000 people without drawing them and check that the
//! intervals are neither too narrow nor too wide. A late strike is not drawn; the true strike times are shifted
//! instead, relative to the drawn strike of the average gait. Not in the population, and so not tested, are
//! people whose joint curves have another shape than the average's (nothing published says how such shapes go
//! together over the cycle), shadows and reflections at the feet, for which the scale leaves room, and a tilted
//! camera if none is given.

use super::decisions::{
    BELT_CONTACT_SD_S, CONTACT_COMMON_SD_S, CONTACT_SD_S, CONTACT_SIDE_SD_S, POSTURE_SD, RANGE_SD_RAD,
    REACH_COUNTS, REACH_SD_M, STRIKE_SD_CYCLES, TOE_OFF_COMMON_SD_S,
};
use super::event::EventKind;
use super::fit::belt::Belt;
use super::fit::contacts::Contact;
use super::rate::{mean_interval_s, more};
use super::result::{Row, TrackedWalk};
use super::start::Direction;
use super::walk::Step;
use crate::estimate::line::line_through;
use crate::model::ASSUMED_FOCAL_SD;
use crate::model::skeleton::Side;
use std::ops::RangeInclusive;

/// If the probability that sides are swapped, or that the person walks in the other direction or has the other heading on a
/// treadmill, is larger, no value by side is reported.
pub const LIKELY_MISTAKEN: f64 = 0.2;

/// Step variability of a healthy adult, as a share of step length or step time.
pub(super) const NATURAL_SHARE: f64 = 0.03;
/// Weight of the prior step variability, in observed steps.
pub(super) const PRIOR_STEPS: f64 = 4.0;
/// Frames within this distance of a strike, in cycles, are used for its time.
const NEAR_STRIKE: f64 = 0.125;
/// Minimum number of frames near a strike.
const LEAST_NEAR: usize = 3;
/// Minimum number of frames and of cycles of a walk that has gait parameters.
const LEAST_FRAMES: usize = 8;
const LEAST_CYCLES: f64 = 0.5;
/// Neighbouring frames have similar errors: this many of them count as one, at the usual rate.
const FRAMES_ALIKE: f64 = 2.0;
/// 97.5 % quantile of the normal distribution.
pub(super) const Z: f64 = 1.959_964;
/// A fitted strike this much later than the one before is not its next, strides.
const LONGEST_STEP: f64 = 0.8;
/// Two strikes of one side that are farther apart are not successive, strides.
pub(super) const LONGEST_STRIDE: f64 = 1.5;

/// A gait parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum GaitQuantity {
    /// Steps per minute.
    Cadence,
    /// Speed in the direction the body faces, m/s; negative for backward walking.
    Speed,
    /// Duration of a cycle (two steps), s.
    StrideTime,
    /// Displacement of the trunk in a cycle, m.
    StrideLength,
    /// Time from the other side's heel strike to this side's, s.
    StepTime,
    /// Displacement of the trunk in that time, m.
    StepLength,
    /// 100 (right - left) / mean of the step times, per cent.
    StepTimeSymmetry,
    /// 100 (right - left) / mean of the step lengths, per cent.
    StepLengthSymmetry,
    /// Stance of a foot, per cent of the cycle; without a side, of either.
    Stance,
    /// Swing of a foot, per cent of the cycle; without a side, of either.
    Swing,
    /// Stance of a foot alone, per cent of the cycle; without a side, the sum of both.
    SingleSupport,
    /// Stance of both feet, per cent of the cycle.
    DoubleSupport,
    /// Largest less smallest angle of the thigh against the vertical, degrees.
    HipRange,
    /// Largest less smallest flexion of the knee, degrees.
    KneeRange,
    /// Largest flexion of the knee, degrees.
    KneePeak,
}

impl GaitQuantity {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cadence => "cadence",
            Self::Speed => "speed",
            Self::StrideTime => "stride_time",
            Self::StrideLength => "stride_length",
            Self::StepTime => "step_time",
            Self::StepLength => "step_length",
            Self::StepTimeSymmetry => "step_time_symmetry",
            Self::StepLengthSymmetry => "step_length_symmetry",
            Self::Stance => "stance",
            Self::Swing => "swing",
            Self::SingleSupport => "single_support",
            Self::DoubleSupport => "double_support",
            Self::HipRange => "hip_range",
            Self::KneeRange => "knee_range",
            Self::KneePeak => "knee_peak",
        }
    }

    /// The unit in tables.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Cadence => "1/min",
            Self::Speed => "m/s",
            Self::StrideTime | Self::StepTime => "s",
            Self::StrideLength | Self::StepLength => "m",
            Self::HipRange | Self::KneeRange | Self::KneePeak => "deg",
            _ => "%",
        }
    }
}

/// One line of the table of gait parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaitParameter {
    /// The gait parameter.
    pub quantity: GaitQuantity,
    /// The side, `None` for both.
    pub side: Option<Side>,
    /// The value in the quantity's unit; `None` if it is not known.
    pub value: Option<f64>,
    /// 95 % interval, without what is impossible; `None` if the value is not known.
    pub interval: Option<[f64; 2]>,
    /// Number of steps used, or of cycles; 0 if the value is not known.
    pub n: usize,
}

impl TrackedWalk {
    /// The gait parameters with 95 % intervals. Every walk gets the same lines in the same order.
    pub fn gait_parameters(&self) -> Vec<GaitParameter> {
        let whole = Whole::of(self);
        let sides = whole.as_ref().and_then(|whole| self.sides(whole));
        let mut table = Vec::new();
        let mut add = |quantity, side, estimate: Option<Estimate>| {
            let possible = possible(quantity);
            let estimate = estimate.filter(|e| possible.contains(&e.value));
            let within = |end: f64| end.clamp(*possible.start(), *possible.end());
            let (value, interval) = (estimate.map(|e| e.value), estimate.map(|e| e.interval().map(within)));
            table.push(GaitParameter { quantity, side, value, interval, n: estimate.map_or(0, |e| e.n) });
        };
        use GaitQuantity::{
            Cadence, DoubleSupport, HipRange, KneePeak, KneeRange, SingleSupport, Speed, Stance, StepLength,
            StepLengthSymmetry, StepTime, StepTimeSymmetry, StrideLength, StrideTime, Swing,
        };
        add(Cadence, None, whole.map(|w| w.rate_hz.times(120.0)));
        add(Speed, None, whole.map(|w| w.speed_mps));
        add(StrideTime, None, whole.map(|w| w.stride_s()));
        add(StrideLength, None, whole.map(|w| w.stride_m()));
        add(StepTime, None, whole.map(|w| w.stride_s().times(0.5)));
        add(StepLength, None, whole.map(|w| w.stride_m().times(0.5)));
        for (index, side) in [Side::Right, Side::Left].into_iter().enumerate() {
            add(StepTime, Some(side), sides.and_then(|s| s.time_s.mean[index]));
            add(StepLength, Some(side), sides.and_then(|s| s.length_m.mean[index]));
        }
        add(StepTimeSymmetry, None, sides.and_then(|s| s.time_s.symmetry));
        add(StepLengthSymmetry, None, sides.and_then(|s| s.length_m.symmetry));
        let stance = |side: Option<Side>| whole.as_ref().and_then(|whole| self.stance(whole, side));
        let rest = |e: Estimate| Estimate { value: 100.0 - e.value, ..e };
        let both = stance(None);
        let double = both.map(|e| Estimate { value: 2.0 * e.value - 100.0, half: 2.0 * e.half, ..e });
        add(Stance, None, both);
        add(Swing, None, both.map(rest));
        add(SingleSupport, None, double.map(rest));
        add(DoubleSupport, None, double);
        let [right, left] = [Side::Right, Side::Left].map(|side| stance(Some(side)));
        // One foot stands alone while the other swings, and no longer than it stands.
        let is_on_ground = right.zip(left).is_none_or(|(right, left)| right.value + left.value >= 100.0);
        for (side, own, other) in [(Side::Right, right, left), (Side::Left, left, right)] {
            add(Stance, Some(side), own);
            add(Swing, Some(side), own.map(rest));
            add(SingleSupport, Some(side), other.map(rest).filter(|_| is_on_ground));
        }
        for side in [Side::Right, Side::Left] {
            add(HipRange, Some(side), self.motion(side, 0).map(|m| m.range));
            add(KneeRange, Some(side), self.motion(side, 1).map(|m| m.range));
            add(KneePeak, Some(side), self.motion(side, 1).map(|m| m.peak));
        }
        table
    }

    /// Mean duration of a cycle, seconds.
    pub(super) fn stride_s(&self) -> Option<f64> {
        Whole::of(self).map(|whole| whole.stride_s().value)
    }

    /// True if it is known which side is which.
    fn are_sides_sure(&self) -> bool {
        let mistakes = [self.p_swapped(), self.start.p_other_direction, self.p_other_heading()];
        mistakes.iter().all(|&p| p <= LIKELY_MISTAKEN)
    }

    /// Stance from the contacts of the fitted feet: from a strike to the toe-off of that foot, of both sides together or of
    /// one, if it is known which is which.
    fn stance(&self, whole: &Whole, side: Option<Side>) -> Option<Estimate> {
        if self.direction() == Direction::Backward || side.is_some() && !self.are_sides_sure() {
            return None;
        }
        let contacts = &self.fitted()?.contacts;
        let stride_s = 1.0 / whole.rate_hz.value;
        let until_off = |strike: &Contact| {
            let offs = contacts.iter().filter(|c| c.kind == EventKind::ToeOff && c.side == strike.side);
            let next = offs.map(|c| c.time_s - strike.time_s).find(|&elapsed_s| elapsed_s > 0.0)?;
            (next < LONGEST_STEP * stride_s).then_some(next)
        };
        let of_side = |side: Side| -> Vec<f64> {
            let own = |c: &&Contact| c.kind == EventKind::HeelStrike && c.side == side;
            contacts.iter().filter(own).filter_map(until_off).collect()
        };
        let asked = side.map_or(vec![Side::Right, Side::Left], |side| vec![side]);
        let stances: Vec<Vec<f64>> = asked.into_iter().map(of_side).filter(|own| !own.is_empty()).collect();
        let n = stances.iter().map(Vec::len).sum::<usize>();
        if n == 0 {
            return None;
        }
        // Both sides count alike, however many stances each has.
        let mean_of = |stances: &[f64]| stances.iter().sum::<f64>() / stances.len() as f64;
        let means: Vec<f64> = stances.iter().map(|own| mean_of(own)).collect();
        let mean = mean_of(&means);
        let sum_sq: f64 = stances.iter().flatten().map(|s| (s - mean).powi(2)).sum();
        let prior_variance = 2.0 * CONTACT_SD_S.powi(2);
        let freedom = n as f64 - 1.0;
        let variance = (PRIOR_STEPS * prior_variance + sum_sq) / (PRIOR_STEPS + freedom);
        let scatter = student_quantile(PRIOR_STEPS + freedom) * (variance / n as f64).sqrt();
        // Of the difference between the sides, half is in each.
        let of_side_s = if side.is_some() { 0.5 * CONTACT_SIDE_SD_S } else { 0.0 };
        let common_s = CONTACT_COMMON_SD_S.hypot(TOE_OFF_COMMON_SD_S);
        let half = scatter.hypot(Z * common_s.hypot(std::f64::consts::SQRT_2 * of_side_s));
        Some(Estimate { value: mean, half, n }.times(100.0 / stride_s))
    }

    /// Range and peak of a measured joint over at least a cycle, degrees; joint 0 is the hip, 1 the knee.
    fn motion(&self, side: Side, joint: usize) -> Option<JointMotion> {
        let fit = self.fitted()?;
        if !self.are_sides_sure() {
            return None;
        }
        let index = usize::from(side == Side::Left);
        let (first, last) = (fit.frames.first()?, fit.frames.last()?);
        let cycles = (last.phase - first.phase).abs();
        let measured: Vec<[f64; 2]> =
            fit.frames.iter().filter_map(|f| f.measured[index].angles[joint]).collect();
        if cycles < 1.0 || measured.len() < fit.frames.len() {
            return None;
        }
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for [angle, _] in &measured {
            (least, most) = (least.min(*angle), most.max(*angle));
        }
        let sd = (measured.iter().map(|[_, sd]| sd * sd).sum::<f64>() / measured.len() as f64).sqrt();
        let estimate = |value: f64, sd: f64| Estimate {
            value: value.to_degrees(),
            half: Z * sd.to_degrees(),
            n: cycles as usize,
        };
        Some(JointMotion {
            range: estimate(most - least, (std::f64::consts::SQRT_2 * sd).hypot(RANGE_SD_RAD[joint])),
            peak: estimate(most, sd),
        })
    }

    /// Steps by side; `None` if the sides are ambiguous, the walk is backward or the fit failed.
    fn sides(&self, whole: &Whole) -> Option<Sides> {
        // Without the fit that was wanted, contacts are those of the average gait, and a hidden leg looks like an uneven step.
        let is_misfit = matches!(self.fit, Some(Err(_)));
        if !self.are_sides_sure() || is_misfit || self.direction() == Direction::Backward {
            return None;
        }
        let strikes = match self.fitted() {
            Some(fit) => fitted_strikes(&fit.contacts, whole.rate_hz.value),
            None => strikes(self.steps(), whole.rate_hz.value),
        };
        let steps = steps_between(&strikes, &self.rows(), whole.belt.speed_mps);
        let (rate_hz, speed_mps) = (whole.rate_hz.value, whole.speed_mps.value.abs());
        let strike_sd_s = match self.fitted() {
            Some(_) if self.is_on_treadmill => contact_shift_sd_s().hypot(BELT_CONTACT_SD_S),
            Some(_) => contact_shift_sd_s(),
            None => STRIKE_SD_CYCLES / rate_hz,
        };
        let noise_sq = steps.iter().map(|s| s.variance_s2).sum::<f64>() / steps.len().max(1) as f64;
        let (step_s, step_m) = (0.5 / rate_hz, 0.5 * speed_mps / rate_hz);
        let time_s = BySide::of(
            &steps,
            |s| s.time_s,
            &Spread {
                prior_variance: noise_sq + (NATURAL_SHARE * step_s).powi(2),
                side_sd: strike_sd_s,
                scale_sd: 0.0,
            },
        );
        let length_m = BySide::of(
            &steps,
            |s| s.length_m,
            &Spread {
                prior_variance: noise_sq * speed_mps.powi(2) + (NATURAL_SHARE * step_m).powi(2),
                side_sd: (strike_sd_s * speed_mps)
                    .hypot(REACH_COUNTS * REACH_SD_M / std::f64::consts::SQRT_2),
                scale_sd: whole.scale_sd.hypot(whole.belt_share()),
            },
        );
        Some(Sides { time_s, length_m })
    }

    /// Relative standard deviation of lengths along the path, from distance and posture. For an assumed camera
    /// also from the focal length, which scales displacement along the line of sight.
    pub(super) fn scale_sd(&self) -> f64 {
        let middle = self.steps().len() / 2;
        let middle_m = match self.fitted() {
            Some(fit) => fit.frames[middle].along_m,
            None => self.steps().get(middle).map_or(0.0, |step| step.state.along.position),
        };
        let (eye, path) = (self.camera.position().truncate(), self.route().at(middle_m));
        let depth_sd_m = match self.fitted() {
            Some(fit) if self.tilt.is_none() => {
                fit.frames.iter().map(|f| f.sd[1]).sum::<f64>() / fit.frames.len() as f64
            }
            _ => self.depth_sd_m,
        };
        // Along the line of sight, the length of a row on the ground grows with the square of the distance.
        let relative = match self.steps().get(middle).is_some_and(|step| step.by_feet) {
            true => 2.0 * depth_sd_m / path.point(middle_m, 0.0).truncate().distance(eye),
            false => depth_sd_m / path.distance(eye),
        };
        let distance = relative.hypot(POSTURE_SD);
        let along_view_sq = path.direction().dot(self.view()).powi(2);
        if self.tilt.is_some() { distance.hypot(ASSUMED_FOCAL_SD * along_view_sq) } else { distance }
    }
}

/// What a value can be: a share of the cycle is 0 to 100 %. Who walks has no time without a foot on the ground, so a walk whose
/// double support comes out below zero shows none.
fn possible(quantity: GaitQuantity) -> RangeInclusive<f64> {
    use GaitQuantity::{DoubleSupport, SingleSupport, Stance, Swing};
    match quantity {
        Stance | Swing | SingleSupport | DoubleSupport => 0.0..=100.0,
        _ => f64::NEG_INFINITY..=f64::INFINITY,
    }
}

/// A value with half the width of its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Estimate {
    value: f64,
    half: f64,
    n: usize,
}

impl Estimate {
    fn interval(&self) -> [f64; 2] {
        [self.value - self.half, self.value + self.half]
    }

    fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, half: self.half * factor.abs(), ..self }
    }
}

/// Estimates from all frames of the walk.
#[derive(Debug, Clone, Copy)]
struct Whole {
    /// Cadence in cycles per second, positive.
    rate_hz: Estimate,
    speed_mps: Estimate,
    /// Half the interval of the stride length, relative.
    stride_share: f64,
    scale_sd: f64,
    /// The belt of a treadmill.
    belt: Belt,
}

impl Whole {
    fn of(walk: &TrackedWalk) -> Option<Self> {
        let belt = walk.belt();
        let (phases, places) = measured(walk, &belt);
        if phases.len() < LEAST_FRAMES {
            return None;
        }
        let (rate_hz, _) = line_through(&phases);
        let duration_s = phases.last()?.0 - phases.first()?.0;
        let cycles = (rate_hz * duration_s).abs();
        if !(cycles >= LEAST_CYCLES && cycles.is_finite()) {
            return None;
        }
        let n = (2.0 * cycles).floor() as usize;
        let (speed_mps, _) = line_through(&places);
        let half_rate = half_slope(&phases, 2.0 * cycles);
        let speed_share = half_slope(&places, 2.0 * cycles).hypot(Z * belt.sd_mps) / speed_mps.abs();
        let scale_sd = walk.scale_sd();
        // The slope of a random walk of n steps varies sqrt(6 / 5) times as much as the mean of its steps. The
        // scatter about the line contains their variation too, so the larger of both is used.
        let sampled = Z * NATURAL_SHARE * (1.2 / (2.0 * cycles).max(1.0)).sqrt();
        let rate_share = half_rate / rate_hz.abs();
        let of_place = |seen: f64| seen.max(sampled).hypot(Z * scale_sd);
        let half_rate = rate_hz.abs() * rate_share.max(sampled);
        Some(Self {
            rate_hz: Estimate { value: rate_hz.abs(), half: half_rate, n },
            speed_mps: Estimate { value: speed_mps, half: speed_mps.abs() * of_place(speed_share), n },
            stride_share: of_place(rate_share.hypot(speed_share)),
            scale_sd,
            belt,
        })
    }

    /// Relative standard deviation of the belt's speed.
    fn belt_share(&self) -> f64 {
        if self.belt.speed_mps == 0.0 { 0.0 } else { self.belt.sd_mps / self.belt.speed_mps.abs() }
    }

    fn stride_s(&self) -> Estimate {
        let value = 1.0 / self.rate_hz.value;
        Estimate { value, half: value * self.rate_hz.half / self.rate_hz.value, n: self.rate_hz.n }
    }

    fn stride_m(&self) -> Estimate {
        let value = self.speed_mps.value.abs() / self.rate_hz.value;
        Estimate { value, half: value * self.stride_share, n: self.rate_hz.n }
    }
}

/// Half the interval of a line's slope. Within a step a person deviates from the model in the same way every
/// time, so steps and not frames count as independent: sd sqrt(12) / (duration sqrt(steps)).
fn half_slope(points: &[(f64, f64)], steps: f64) -> f64 {
    let (slope, level) = line_through(points);
    let sum_sq: f64 = points.iter().map(|(t, x)| (x - level - slope * t).powi(2)).sum();
    let sd = (sum_sq / (points.len() as f64 - 2.0)).sqrt();
    let duration_s = points[points.len() - 1].0 - points[0].0;
    Z * sd * 12f64.sqrt() / (duration_s * steps.max(1.0).sqrt())
}

/// Times and values.
type OverTime = Vec<(f64, f64)>;

/// Time and phase, and time and place on the ground or the belt, of each frame of the fit, or else of each measured
/// frame of the tracker.
fn measured(walk: &TrackedWalk, belt: &Belt) -> (OverTime, OverTime) {
    let steps = walk.steps();
    let on_belt = |time_s: f64, along_m: f64| along_m + belt.speed_mps * time_s;
    match walk.fitted() {
        Some(fit) => {
            let timed = steps.iter().zip(&fit.frames);
            timed.map(|(s, f)| ((s.time_s, f.phase), (s.time_s, on_belt(s.time_s, f.along_m)))).unzip()
        }
        None => {
            let seen = steps.iter().filter_map(|s| Some((s.time_s, unwrapped(s)?, s.measured?.along_m)));
            seen.map(|(t, p, a)| ((t, p), (t, on_belt(t, a)))).unzip()
        }
    }
}

/// The measured phase in the cycle nearest to the filtered phase, not wrapped, cycles.
fn unwrapped(step: &Step) -> Option<f64> {
    let (filtered, measured) = (step.state.phase.position, step.measured?.phase);
    let off = measured - filtered;
    Some(filtered + off - off.round())
}

/// A heel strike found in the measured phases.
#[derive(Debug, Clone, Copy)]
struct Strike {
    side: Side,
    /// Number of half cycles since phase 0.
    index: i64,
    time_s: f64,
    variance_s2: f64,
}

/// Heel strikes: each frame near a strike gives an estimate of its time, and the strike is their median. The
/// phases are those before smoothing, because smoothing would reduce the difference between the sides.
fn strikes(steps: &[Step], rate_hz: f64) -> Vec<Strike> {
    let phases: Vec<(f64, f64)> = steps.iter().filter_map(|s| Some((s.time_s, unwrapped(s)?))).collect();
    let (slope, level) = line_through(&phases);
    let at = |step: &Step| level + slope * step.time_s;
    let alike = FRAMES_ALIKE * more(mean_interval_s(phases.iter().map(|(time_s, _)| *time_s)));
    let (Some(first), Some(last)) = (steps.first().map(at), steps.last().map(at)) else { return Vec::new() };
    let strike = |index: i64| {
        let mark = 0.5 * index as f64;
        let mut times: Vec<f64> = phases
            .iter()
            .filter(|(t, _)| (level + slope * t - mark).abs() < NEAR_STRIKE)
            .map(|(t, phase)| t + (mark - phase) / rate_hz)
            .collect();
        if times.len() < LEAST_NEAR {
            return None;
        }
        times.sort_by(f64::total_cmp);
        let count = times.len();
        let time_s = 0.5 * (times[(count - 1) / 2] + times[count / 2]);
        let sum_sq: f64 = times.iter().map(|t| (t - time_s).powi(2)).sum();
        let independent = (count as f64 / alike).max(1.0);
        let side = if index.rem_euclid(2) == 0 { Side::Right } else { Side::Left };
        Some(Strike { side, index, time_s, variance_s2: sum_sq / (count - 1) as f64 / independent })
    };
    ((2.0 * first).ceil() as i64..=(2.0 * last).floor() as i64).filter_map(strike).collect()
}

/// The heel strikes of the fitted feet, numbered so that only successive ones make a step.
fn fitted_strikes(contacts: &[Contact], rate_hz: f64) -> Vec<Strike> {
    let mut strikes: Vec<Strike> = Vec::new();
    for contact in contacts.iter().filter(|c| c.kind == EventKind::HeelStrike) {
        let follows = strikes.last().is_some_and(|last| {
            last.side != contact.side && (contact.time_s - last.time_s) * rate_hz < LONGEST_STEP
        });
        let index = strikes.last().map_or(0, |last| last.index + if follows { 1 } else { 2 });
        let variance_s2 = CONTACT_SD_S.powi(2);
        strikes.push(Strike { side: contact.side, index, time_s: contact.time_s, variance_s2 });
    }
    strikes
}

/// A step from the other side's strike to the strike of `side`.
#[derive(Debug, Clone, Copy)]
struct StepTaken {
    side: Side,
    time_s: f64,
    length_m: f64,
    variance_s2: f64,
}

fn steps_between(strikes: &[Strike], rows: &[Row], belt_mps: f64) -> Vec<StepTaken> {
    let neighbours = strikes.windows(2).filter(|pair| pair[1].index == pair[0].index + 1);
    neighbours
        .map(|pair| StepTaken {
            side: pair[1].side,
            time_s: pair[1].time_s - pair[0].time_s,
            length_m: place_at(rows, pair[1].time_s) - place_at(rows, pair[0].time_s)
                + belt_mps * (pair[1].time_s - pair[0].time_s),
            variance_s2: pair[0].variance_s2 + pair[1].variance_s2,
        })
        .collect()
}

/// Smoothed position along the path at a time, linear between frames.
fn place_at(rows: &[Row], time_s: f64) -> f64 {
    let after = rows.partition_point(|row| row.time_s < time_s).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[after - 1], &rows[after]);
    let t = (time_s - a.time_s) / (b.time_s - a.time_s);
    a.hypothesis.along_m + t * (b.hypothesis.along_m - a.hypothesis.along_m)
}

/// Range and peak of an angle, degrees.
#[derive(Debug, Clone, Copy)]
struct JointMotion {
    range: Estimate,
    peak: Estimate,
}

/// Steps by side.
#[derive(Debug, Clone, Copy)]
struct Sides {
    time_s: BySide,
    length_m: BySide,
}

/// One quantity of the steps, by side.
#[derive(Debug, Clone, Copy)]
struct BySide {
    mean: [Option<Estimate>; 2],
    symmetry: Option<Estimate>,
}

/// Standard deviation of a shift of one side's contacts: the difference between the sides has `CONTACT_SIDE_SD_S`.
fn contact_shift_sd_s() -> f64 {
    CONTACT_SIDE_SD_S / std::f64::consts::SQRT_2
}

/// Prior knowledge of a quantity's spread.
struct Spread {
    /// Variance of single steps.
    prior_variance: f64,
    /// Standard deviation of the shift common to all strikes of one side, independent of the other side's.
    side_sd: f64,
    /// Relative standard deviation common to all steps.
    scale_sd: f64,
}

impl BySide {
    fn of(steps: &[StepTaken], value: impl Fn(&StepTaken) -> f64, spread: &Spread) -> Self {
        let values = [Side::Right, Side::Left]
            .map(|side| steps.iter().filter(|s| s.side == side).map(&value).collect::<Vec<f64>>());
        let means = values.each_ref().map(|v| v.iter().sum::<f64>() / v.len() as f64);
        // 1. The variance of a step: the observed variance about the mean of its side, combined with the prior.
        let sum_sq: f64 =
            values.iter().zip(means).flat_map(|(v, m)| v.iter().map(move |x| (x - m).powi(2))).sum();
        let freedom = steps.len() as f64 - values.iter().filter(|v| !v.is_empty()).count() as f64;
        let variance = (PRIOR_STEPS * spread.prior_variance + sum_sq) / (PRIOR_STEPS + freedom);
        let t = student_quantile(PRIOR_STEPS + freedom);
        // 2. The mean of a side. A late strike of one side makes its own step longer and the other's shorter.
        let share = |side: usize| variance / values[side].len() as f64;
        let mean = [0, 1].map(|side| {
            let scatter = t * share(side).sqrt();
            let common = Z * (std::f64::consts::SQRT_2 * spread.side_sd).hypot(spread.scale_sd * means[side]);
            let n = values[side].len();
            (n > 0).then_some(Estimate { value: means[side], half: scatter.hypot(common), n })
        });
        // 3. Their difference. It contains such a shift twice and does not contain the scale.
        let symmetry = (mean[0].is_some() && mean[1].is_some()).then(|| {
            let scatter = t * (share(0) + share(1)).sqrt();
            let half = scatter.hypot(Z * 2.0 * std::f64::consts::SQRT_2 * spread.side_sd);
            let percent = 100.0 / (0.5 * (means[0] + means[1]));
            Estimate { value: means[0] - means[1], half, n: steps.len() }.times(percent)
        });
        Self { mean, symmetry }
    }
}

/// 97.5 % quantile of Student's t, by its expansion about the normal one (Abramowitz and Stegun 26.7.5). The
/// error is 0.1 % at 3 degrees of freedom.
pub(super) fn student_quantile(freedom: f64) -> f64 {
    let z = Z;
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
        (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z)
            / 92160.0,
    ];
    z + terms.iter().zip(1..).map(|(term, power)| term / freedom.powi(power)).sum::<f64>()
}

#[cfg(test)]
mod tests;
