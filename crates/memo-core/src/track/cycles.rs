//! Gait cycles: the measured joint angles from an initial contact to the next one of the same side, at 101 points,
//! and their mean over the cycles of a side.
//!
//! 0 % is the initial contact, 100 % the next; time is linear in between, as is usual in clinical gait analysis.
//! Between two frames an angle is the cubic whose slopes at the frames are those of the parabola through the frame and
//! its neighbours (at the ends of a stretch, through the last three frames). Its standard deviation is interpolated
//! linearly. Nothing is extrapolated: a point is known only between two successive frames that show the limb.
//!
//! A side without two successive contacts has partial cycles instead: one of their contacts is outside of the frames,
//! and is placed one mean stride from the other, with an error as large as strides vary.
//!
//! The 95 % interval of the mean is for the person's mean cycle, of which the measured cycles are a sample. Two terms
//! decrease with their number: the variation of a person from cycle to cycle (`CYCLE_SD_DEG`), and late or early
//! contacts, which matter where the angle is steep. Both are a prior scatter, combined with that of the cycles as the
//! steps of [`gait_parameters`](crate::TrackedWalk::gait_parameters). Two terms do not: the stated standard deviation of the angles,
//! and the error that contacts have in common.

use super::decisions::{CONTACT_COMMON_SD_S, CONTACT_SD_S};
use super::event::EventKind;
use super::fit::JOINTS;
use super::gait_parameters::{LONGEST_STRIDE, NATURAL_SHARE, PRIOR_STEPS, Z, student_quantile};
use super::result::{Event, TrackedWalk};
use crate::model::skeleton::Side;

/// Points of a cycle: 0, 1, ..., 100 %.
pub const CYCLE_POINTS: usize = 101;

/// Standard deviation of an angle from cycle to cycle, degrees: hip, knee, ankle, shoulder, elbow. Measured on
/// three motion-captured people who repeat cycles (6 degrees of freedom).
const CYCLE_SD_DEG: [f64; JOINTS] = [1.5, 2.2, 1.9, 4.0, 4.5];

/// An angle and its standard deviation, radians; `None` where it was not measured.
pub type AngleAt = Option<[f64; 2]>;

/// One cycle of one side.
#[derive(Debug, Clone, PartialEq)]
pub struct GaitCycle {
    /// The side whose contacts begin and end it.
    pub side: Side,
    /// Time of 0 %, seconds.
    pub start_s: f64,
    /// Time of 100 %, seconds.
    pub end_s: f64,
    /// Whether both contacts were measured; if not, one of the times is that of the other and the mean stride.
    pub is_whole: bool,
    /// The angles of [`JOINTS`] joints at [`CYCLE_POINTS`] points.
    pub angles: [Vec<AngleAt>; JOINTS],
}

/// The mean angle of several cycles at one point, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanAngle {
    /// The mean.
    pub mean: f64,
    /// The stated standard deviation of the angles: root mean square over the cycles.
    pub stated_sd: f64,
    /// Standard deviation over the cycles; `None` for one cycle.
    pub cycle_sd: Option<f64>,
    /// Half the 95 % interval.
    pub half: f64,
    /// Number of cycles.
    pub n: usize,
}

/// The mean cycle of one side.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanCycle {
    /// The side.
    pub side: Side,
    /// The angles of [`JOINTS`] joints at [`CYCLE_POINTS`] points; `None` where no cycle was measured.
    pub angles: [Vec<Option<MeanAngle>>; JOINTS],
}

impl TrackedWalk {
    /// The measured cycles, first those of the right side. None without a fit of the person or of a backward walk.
    pub fn cycles(&self) -> Vec<GaitCycle> {
        let (Some(fit), Some(stride_s)) = (self.fitted(), self.stride_s()) else { return Vec::new() };
        let times_s: Vec<f64> = self.steps().iter().map(|step| step.time_s).take(fit.frames.len()).collect();
        let events = self.events();
        let of = |(index, side): (usize, Side)| {
            let angles: [Vec<AngleAt>; JOINTS] = std::array::from_fn(|joint| {
                fit.frames.iter().map(|frame| frame.measured[index].angles[joint]).collect()
            });
            let strikes = strikes_of(&events, side);
            let is_measured = |cycle: &GaitCycle| cycle.angles.iter().flatten().any(Option::is_some);
            spans(&strikes, stride_s)
                .into_iter()
                .map(|span| span.cycle(side, &times_s, &angles))
                .filter(is_measured)
                .collect::<Vec<_>>()
        };
        [Side::Right, Side::Left].into_iter().enumerate().flat_map(of).collect()
    }
}

/// The mean cycle of each side that has cycles.
pub fn mean_cycles(cycles: &[GaitCycle]) -> Vec<MeanCycle> {
    let of = |side: Side| {
        let own: Vec<&GaitCycle> = cycles.iter().filter(|cycle| cycle.side == side).collect();
        let stride_s = own.iter().map(|cycle| cycle.end_s - cycle.start_s).sum::<f64>() / own.len() as f64;
        let is_whole = own.iter().all(|cycle| cycle.is_whole);
        let stride_sd = if is_whole { 0.0 } else { NATURAL_SHARE };
        let contact_sd = stride_sd.hypot(CONTACT_SD_S / stride_s);
        let timing = Timing { contact_sd, common_sd: CONTACT_COMMON_SD_S / stride_s };
        let angles = std::array::from_fn(|joint| {
            let at = |point: usize| own.iter().filter_map(|cycle| cycle.angles[joint][point]).collect();
            let points: Vec<Vec<[f64; 2]>> = (0..CYCLE_POINTS).map(at).collect();
            mean_angles(&points, timing, CYCLE_SD_DEG[joint].to_radians())
        });
        (!own.is_empty()).then_some(MeanCycle { side, angles })
    };
    [Side::Right, Side::Left].into_iter().filter_map(of).collect()
}

/// Standard deviations of the times of contacts, cycles.
#[derive(Debug, Clone, Copy)]
struct Timing {
    /// Of each contact; where one was placed a mean stride from the other, with the variation of strides.
    contact_sd: f64,
    /// Of the error that all contacts have in common.
    common_sd: f64,
}

/// The mean at each point, given the angles of the cycles there.
fn mean_angles(points: &[Vec<[f64; 2]>], timing: Timing, prior_sd: f64) -> Vec<Option<MeanAngle>> {
    let mean = |angles: &Vec<[f64; 2]>| {
        (!angles.is_empty()).then(|| angles.iter().map(|[angle, _]| angle).sum::<f64>() / angles.len() as f64)
    };
    let means: Vec<Option<f64>> = points.iter().map(mean).collect();
    let last = points.len() - 1;
    let at = |point: usize| {
        let (before, after) = (point.saturating_sub(1), (point + 1).min(last));
        let rise = means[after].zip(means[before]).map_or(0.0, |(b, a)| b - a);
        let rate = rise * last as f64 / (after - before) as f64;
        let share = point as f64 / last as f64;
        let late_sd = rate * timing.contact_sd * share.hypot(1.0 - share);
        mean_angle(&points[point], means[point]?, prior_sd.hypot(late_sd), rate * timing.common_sd)
    };
    (0..points.len()).map(at).collect()
}

/// `prior_sd`: of a cycle about the mean; `common_sd`: an error of all cycles, besides the stated one.
fn mean_angle(angles: &[[f64; 2]], mean: f64, prior_sd: f64, common_sd: f64) -> Option<MeanAngle> {
    let n = angles.len();
    let count = n as f64;
    let sum_sq: f64 = angles.iter().map(|[angle, _]| (angle - mean).powi(2)).sum();
    let stated_sd = (angles.iter().map(|[_, sd]| sd * sd).sum::<f64>() / count).sqrt();
    let freedom = PRIOR_STEPS + count - 1.0;
    let variance = (PRIOR_STEPS * prior_sd * prior_sd + sum_sq) / freedom;
    let scatter = student_quantile(freedom) * (variance / count).sqrt();
    let half = scatter.hypot(Z * stated_sd.hypot(common_sd));
    let cycle_sd = (n > 1).then(|| (sum_sq / (count - 1.0)).sqrt());
    (n > 0).then_some(MeanAngle { mean, stated_sd, cycle_sd, half, n })
}

fn strikes_of(events: &[Event], side: Side) -> Vec<f64> {
    let own = events.iter().filter(|event| event.side == side && event.kind == EventKind::HeelStrike);
    own.map(|event| event.time_s).collect()
}

/// The times of a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    start_s: f64,
    end_s: f64,
    is_whole: bool,
}

impl Span {
    fn cycle(&self, side: Side, times_s: &[f64], angles: &[Vec<AngleAt>; JOINTS]) -> GaitCycle {
        let Self { start_s, end_s, is_whole } = *self;
        let at = |point: usize| start_s + (end_s - start_s) * point as f64 / (CYCLE_POINTS - 1) as f64;
        let at_s: Vec<f64> = (0..CYCLE_POINTS).map(at).collect();
        let angles = angles.each_ref().map(|angle| resampled(times_s, angle, &at_s));
        GaitCycle { side, start_s, end_s, is_whole, angles }
    }
}

/// The cycles between strikes of one side, or the partial cycles before and after each if no two are successive.
fn spans(strikes: &[f64], stride_s: f64) -> Vec<Span> {
    let whole = strikes.windows(2).filter(|pair| pair[1] - pair[0] < LONGEST_STRIDE * stride_s);
    let whole: Vec<Span> =
        whole.map(|pair| Span { start_s: pair[0], end_s: pair[1], is_whole: true }).collect();
    if !whole.is_empty() {
        return whole;
    }
    let partial = |start_s: f64| Span { start_s, end_s: start_s + stride_s, is_whole: false };
    strikes.iter().flat_map(|&strike| [partial(strike - stride_s), partial(strike)]).collect()
}

/// Angles at other times than those of the frames.
fn resampled(times_s: &[f64], angles: &[AngleAt], at_s: &[f64]) -> Vec<AngleAt> {
    let slopes = slopes(times_s, angles);
    let between = |&time_s: &f64| {
        let after = times_s.partition_point(|&frame_s| frame_s < time_s);
        if after < times_s.len() && times_s[after] == time_s {
            return angles[after];
        }
        let before = after.checked_sub(1)?;
        let ([a, a_sd], [b, b_sd]) = (angles[before]?, (*angles.get(after)?)?);
        let step_s = times_s[after] - times_s[before];
        let x = (time_s - times_s[before]) / step_s;
        let [rise_a, rise_b] = [slopes[before] * step_s, slopes[after] * step_s];
        let bend_a = (1.0 - x) * (rise_a - (b - a)) - x * (rise_b - (b - a));
        Some([a + x * (b - a) + x * (1.0 - x) * bend_a, a_sd + x * (b_sd - a_sd)])
    };
    at_s.iter().map(between).collect()
}

/// The slope at each measured frame: that of the parabola through three successive measured frames, itself in the
/// middle where it can be; of the line through two; 0 alone.
fn slopes(times_s: &[f64], angles: &[AngleAt]) -> Vec<f64> {
    let known = |k: usize| angles.get(k).copied().flatten().map(|[angle, _]| angle);
    let rise = |a: usize, b: usize| Some((known(b)? - known(a)?) / (times_s[b] - times_s[a]));
    let parabola = |first: usize, k: usize| {
        let (early, late) = (rise(first, first + 1)?, rise(first + 1, first + 2)?);
        let [t0, t1, t2] = [times_s[first], times_s[first + 1], times_s[first + 2]];
        let bend = (late - early) / (t2 - t0);
        Some(early + bend * (2.0 * times_s[k] - t0 - t1))
    };
    let slope = |k: usize| {
        let before = k.checked_sub(1);
        before
            .and_then(|first| parabola(first, k))
            .or_else(|| parabola(k, k))
            .or_else(|| parabola(k.checked_sub(2)?, k))
            .or_else(|| rise(k, k + 1))
            .or_else(|| rise(before?, k))
            .unwrap_or(0.0)
    };
    (0..angles.len()).map(|k| if angles[k].is_some() { slope(k) } else { 0.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES_S: [f64; 6] = [0.0, 0.04, 0.09, 0.12, 0.16, 0.22];

    fn parabola(time_s: f64) -> f64 {
        0.3 - 2.0 * time_s + 7.0 * time_s * time_s
    }

    #[test]
    fn a_parabola_is_resampled_exactly_and_not_extrapolated() {
        let angles: Vec<AngleAt> = TIMES_S.iter().map(|&t| Some([parabola(t), 0.1 + t])).collect();
        let at_s: Vec<f64> = (0..=30).map(|k| -0.02 + 0.01 * f64::from(k)).collect();
        for (time_s, angle) in at_s.iter().zip(resampled(&TIMES_S, &angles, &at_s)) {
            let is_inside = (0.0..=0.22).contains(time_s);
            assert_eq!(angle.is_some(), is_inside, "{time_s}");
            if let Some([angle, sd]) = angle {
                assert!((angle - parabola(*time_s)).abs() < 1e-12 && (sd - 0.1 - time_s).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_point_is_known_only_between_two_frames_that_show_the_limb() {
        let mut angles: Vec<AngleAt> = TIMES_S.iter().map(|&t| Some([t, 0.1])).collect();
        angles[2] = None;
        let found = resampled(&TIMES_S, &angles, &[0.02, 0.04, 0.06, 0.09, 0.10, 0.12, 0.14]);
        let known: Vec<bool> = found.iter().map(Option::is_some).collect();
        assert_eq!(known, [true, true, false, false, false, true, true]);
        assert!((found[0].unwrap()[0] - 0.02).abs() < 1e-12);
        // One frame alone has no neighbour to interpolate to.
        assert_eq!(resampled(&[0.0], &[Some([1.0, 0.1])], &[-0.1, 0.0, 0.1]), [None, Some([1.0, 0.1]), None]);
    }

    #[test]
    fn contacts_that_are_not_successive_make_partial_cycles() {
        let whole = |pair: &[f64; 2]| Span { start_s: pair[0], end_s: pair[1], is_whole: true };
        assert_eq!(spans(&[1.0, 2.1, 3.0], 1.05), [[1.0, 2.1], [2.1, 3.0]].map(|pair| whole(&pair)));
        // The contact near 2.1 s was missed: from 1.0 to 3.2 s are two cycles.
        assert_eq!(spans(&[1.0, 3.2, 4.3], 1.1), [whole(&[3.2, 4.3])]);
        let partial = |start_s: f64| Span { start_s, end_s: start_s + 1.0, is_whole: false };
        assert_eq!(spans(&[1.5], 1.0), [partial(0.5), partial(1.5)]);
        assert!(spans(&[], 1.0).is_empty());
    }

    fn level(angle: f64) -> [Vec<AngleAt>; JOINTS] {
        std::array::from_fn(|_| vec![Some([angle, 0.02]); CYCLE_POINTS])
    }

    fn cycle(side: Side, angle: f64) -> GaitCycle {
        GaitCycle { side, start_s: 1.0, end_s: 2.0, is_whole: true, angles: level(angle) }
    }

    #[test]
    fn the_mean_has_the_scatter_of_the_cycles_and_the_stated_error() {
        let mut cycles = [cycle(Side::Left, 0.30), cycle(Side::Left, 0.36), cycle(Side::Right, 1.0)];
        cycles[1].angles[0][7] = None;
        let [right, left] = mean_cycles(&cycles).try_into().unwrap();
        let alone = right.angles[1][50].unwrap();
        assert_eq!((right.side, alone.mean, alone.cycle_sd, alone.n), (Side::Right, 1.0, None, 1));
        let both = left.angles[0][50].unwrap();
        assert!((both.mean - 0.33).abs() < 1e-12 && both.n == 2 && (both.stated_sd - 0.02).abs() < 1e-12);
        assert!((both.cycle_sd.unwrap() - 0.06 / 2f64.sqrt()).abs() < 1e-12);
        // Four prior cycles of 1.5 degrees and one degree of freedom of the two.
        let variance = (4.0 * 1.5f64.to_radians().powi(2) + 0.0018) / 5.0;
        let wanted = (2.5706 * (variance / 2.0).sqrt()).hypot(1.96 * 0.02);
        assert!((both.half / wanted - 1.0).abs() < 1e-3);
        assert_eq!(left.angles[0][7].unwrap().n, 1);
    }

    #[test]
    fn a_steep_angle_has_the_error_of_the_contacts() {
        let angle = |point: usize| Some([0.05 * point as f64, 0.0]);
        let angles = std::array::from_fn(|_| (0..CYCLE_POINTS).map(angle).collect());
        let steep = GaitCycle { angles, ..cycle(Side::Right, 0.0) };
        let [mean] = mean_cycles(std::slice::from_ref(&steep)).try_into().unwrap();
        // 5 radians per cycle of a second; at the start only the first contact counts.
        let prior = (2.2f64.to_radians()).hypot(5.0 * CONTACT_SD_S);
        let wanted = (2.776 * prior).hypot(1.96 * 5.0 * CONTACT_COMMON_SD_S);
        assert!((mean.angles[1][0].unwrap().half / wanted - 1.0).abs() < 2e-3);
        let middle = (2.2f64.to_radians()).hypot(5.0 * CONTACT_SD_S * 0.5f64.sqrt());
        let wanted = (2.776 * middle).hypot(1.96 * 5.0 * CONTACT_COMMON_SD_S);
        assert!((mean.angles[1][50].unwrap().half / wanted - 1.0).abs() < 2e-3);
        // A contact that was placed is as late as strides vary, too.
        let partial = GaitCycle { is_whole: false, ..steep };
        let [mean] = mean_cycles(&[partial]).try_into().unwrap();
        let prior = (2.2f64.to_radians()).hypot(5.0 * CONTACT_SD_S.hypot(NATURAL_SHARE));
        let wanted = (2.776 * prior).hypot(1.96 * 5.0 * CONTACT_COMMON_SD_S);
        assert!((mean.angles[1][0].unwrap().half / wanted - 1.0).abs() < 2e-3);
    }
}
