//! Gait parameters of a walk with 95 % intervals: cadence, speed, stride and steps, side by side.
//!
//! Two things are measured in every frame: the gait phase and the position of the trunk. Cadence and speed use
//! all frames. A heel strike (initial contact) is the time at which the measured phase passes 0 (right) or 1/2
//! (left). A step length is the displacement of the trunk between two strikes. The model's feet land at the same
//! distance ahead of the trunk on both sides and are in stance for the same share of the cycle. So stance and
//! double support are the values of average adults, not measurements, and a reach asymmetry of the two feet is
//! not visible: the intervals of the sides contain its spread over people.
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
//!    assumed camera, on `FOCAL_SD`.
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

use super::result::{Row, Side, TrackedWalk};
use super::start::Direction;
use super::walk::Step;
use crate::estimate::line::line_through;

/// If the probability that sides are swapped, or that the person walks in the other direction, is larger, no
/// value by side is reported.
pub const LIKELY_MISTAKEN: f64 = 0.2;

/// Standard deviation over people of the image-based phase at heel strike, cycles, independent for each side.
const STRIKE_SD_CYCLES: f64 = 0.008;
/// Standard deviation over people of the reach asymmetry, metres: how much farther ahead of the trunk one foot
/// lands.
const REACH_SD_M: f64 = 0.012;
/// Step-length error per metre of reach asymmetry: a leg that swings farther ahead also looks later in the cycle.
const REACH_COUNTS: f64 = 1.35;
/// Step variability of a healthy adult, as a share of step length or step time.
const NATURAL_SHARE: f64 = 0.03;
/// Weight of the prior step variability, in observed steps.
const PRIOR_STEPS: f64 = 4.0;
/// Relative standard deviation over people of the height while walking, compared with the model of the same body
/// height: legs bend more or less than the average's, and feet point in other directions.
const POSTURE_SD: f64 = 0.015;
/// Relative standard deviation of an assumed focal length: fields of view from 45 to 75 degrees, equally likely,
/// when 60 is assumed.
const FOCAL_SD: f64 = 0.18;
/// Frames within this distance of a strike, in cycles, are used for its time.
const NEAR_STRIKE: f64 = 0.125;
/// Minimum number of frames near a strike.
const LEAST_NEAR: usize = 3;
/// Minimum number of frames and of cycles of a walk that has gait parameters.
const LEAST_FRAMES: usize = 8;
const LEAST_CYCLES: f64 = 0.5;
/// Neighbouring frames have similar errors: this many of them count as one.
const FRAMES_ALIKE: f64 = 2.0;
/// 97.5 % quantile of the normal distribution.
const Z: f64 = 1.959_964;
/// Stance and double support, per cent of the cycle: adults at free speed.
const STANCE_PERCENT: f64 = 61.0;
const DOUBLE_SUPPORT_PERCENT: f64 = 22.0;

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
    /// Stance of one foot, per cent of the cycle: assumed, not measured.
    Stance,
    /// Stance of both feet, per cent of the cycle: assumed, not measured.
    DoubleSupport,
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
            Self::DoubleSupport => "double_support",
        }
    }

    /// The unit in tables.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Cadence => "1/min",
            Self::Speed => "m/s",
            Self::StrideTime | Self::StepTime => "s",
            Self::StrideLength | Self::StepLength => "m",
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
    /// 95 % interval; `None` if the value is not known or not measured.
    pub interval: Option<[f64; 2]>,
    /// Number of steps used; 0 if the value is not known or not measured.
    pub n: usize,
}

impl TrackedWalk {
    /// The gait parameters with 95 % intervals. Every walk gets the same lines in the same order.
    pub fn gait_parameters(&self) -> Vec<GaitParameter> {
        let whole = Whole::of(self);
        let sides = whole.as_ref().and_then(|whole| self.sides(whole));
        let mut table = Vec::new();
        let mut add = |quantity, side, estimate: Option<Estimate>| {
            let (value, interval) = (estimate.map(|e| e.value), estimate.map(|e| e.interval()));
            table.push(GaitParameter { quantity, side, value, interval, n: estimate.map_or(0, |e| e.n) });
        };
        use GaitQuantity::{
            Cadence, DoubleSupport, Speed, Stance, StepLength, StepLengthSymmetry, StepTime,
            StepTimeSymmetry, StrideLength, StrideTime,
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
        let stands = whole.is_some() && self.direction() == Direction::Forward;
        for (quantity, percent) in [(Stance, STANCE_PERCENT), (DoubleSupport, DOUBLE_SUPPORT_PERCENT)] {
            let value = stands.then_some(percent);
            table.push(GaitParameter { quantity, side: None, value, interval: None, n: 0 });
        }
        table
    }

    /// Steps by side; `None` if the sides are ambiguous or the walk is backward.
    fn sides(&self, whole: &Whole) -> Option<Sides> {
        let is_sure = self.p_swapped() <= LIKELY_MISTAKEN && self.start.p_other_direction <= LIKELY_MISTAKEN;
        if !is_sure || self.direction() == Direction::Backward {
            return None;
        }
        let steps = steps_between(&strikes(self.steps(), whole.rate_hz.value), &self.rows());
        let (rate_hz, speed_mps) = (whole.rate_hz.value, whole.speed_mps.value.abs());
        let strike_sd_s = STRIKE_SD_CYCLES / rate_hz;
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
                scale_sd: whole.scale_sd,
            },
        );
        Some(Sides { time_s, length_m })
    }

    /// Relative standard deviation of lengths along the path, from distance and posture. For an assumed camera
    /// also from the focal length, which scales displacement along the line of sight.
    fn scale_sd(&self) -> f64 {
        let eye = self.camera.position().truncate();
        let nearest = self.walk.path.point(self.walk.path.along(eye), 0.0).truncate();
        let distance = (self.depth_sd_m / (nearest - eye).length()).hypot(POSTURE_SD);
        let view = (self.camera.rotation.transpose() * glam::DVec3::Z).truncate().normalize_or_zero();
        let along_view_sq = self.walk.path.direction().dot(view).powi(2);
        if self.camera_is_guessed { distance.hypot(FOCAL_SD * along_view_sq) } else { distance }
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
}

impl Whole {
    fn of(walk: &TrackedWalk) -> Option<Self> {
        let measured =
            walk.steps().iter().filter_map(|s| Some((s.time_s, unwrapped(s)?, s.measured?.along_m)));
        let (phases, places): (Vec<_>, Vec<_>) = measured.map(|(t, p, a)| ((t, p), (t, a))).unzip();
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
        let speed_share = half_slope(&places, 2.0 * cycles) / speed_mps.abs();
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
        })
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
        let independent = (count as f64 / FRAMES_ALIKE).max(1.0);
        let side = if index.rem_euclid(2) == 0 { Side::Right } else { Side::Left };
        Some(Strike { side, index, time_s, variance_s2: sum_sq / (count - 1) as f64 / independent })
    };
    ((2.0 * first).ceil() as i64..=(2.0 * last).floor() as i64).filter_map(strike).collect()
}

/// A step from the other side's strike to the strike of `side`.
#[derive(Debug, Clone, Copy)]
struct StepTaken {
    side: Side,
    time_s: f64,
    length_m: f64,
    variance_s2: f64,
}

fn steps_between(strikes: &[Strike], rows: &[Row]) -> Vec<StepTaken> {
    let neighbours = strikes.windows(2).filter(|pair| pair[1].index == pair[0].index + 1);
    neighbours
        .map(|pair| StepTaken {
            side: pair[1].side,
            time_s: pair[1].time_s - pair[0].time_s,
            length_m: place_at(rows, pair[1].time_s) - place_at(rows, pair[0].time_s),
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

/// Prior knowledge of a quantity's spread.
struct Spread {
    /// Variance of single steps.
    prior_variance: f64,
    /// Standard deviation of the shift common to all strikes of one side.
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
fn student_quantile(freedom: f64) -> f64 {
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
