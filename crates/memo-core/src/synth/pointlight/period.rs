//! The period of a motion: the lag at which it repeats itself best, that is, with the least mean squared
//! difference between the motion and itself a lag later.

use super::PointLightError;
use crate::synth::motion::PointMotion;
use glam::DVec3;

/// Shortest period that is looked for, seconds: shorter than that of a sprinter.
const LEAST_PERIOD_S: f64 = 0.3;

/// Longest period that is looked for, as a share of the motion: at least a quarter of a cycle is repeated.
const LONGEST_SHARE: f64 = 0.8;

/// Longest period that is looked for, seconds.
const LONGEST_PERIOD_S: f64 = 10.0;

/// Largest mismatch of a period; 1 is the mismatch of unrelated positions.
const MOST_MISMATCH: f64 = 0.2;

/// A multiple of the period may fit better than the period by this mismatch: up to 0.03 in recorded walks.
const MULTIPLE_MISMATCH: f64 = 0.05;

/// A motion closes by itself if its first frame is within this share of a step of where the last one leads.
const CLOSED_SHARE: f64 = 0.25;

/// Frames compared at each lag, at most.
const COMPARED_FRAMES: usize = 2000;

/// The shortest lag at which the motion repeats itself nearly as well as at any other, in frames.
pub(super) fn found_period(still: &PointMotion, interval_s: f64) -> Result<f64, PointLightError> {
    let frames = still.frames();
    let least = ((LEAST_PERIOD_S / interval_s).round().max(2.0) as usize).min(frames);
    let longest = (LONGEST_SHARE * frames as f64).min((LONGEST_PERIOD_S / interval_s).round());
    let most = (longest as usize).min(frames.saturating_sub(2));
    let unrelated = 2.0 * spread_sq(still);
    let mismatch_at = |lag| difference_sq(still, lag).map_or(f64::INFINITY, |d| d / unrelated);
    let mismatches: Vec<f64> = (least - 1..most + 2).map(mismatch_at).collect();
    let is_lowest = |i: &usize| mismatches[*i] <= mismatches[i - 1] && mismatches[*i] < mismatches[i + 1];
    let lowest: Vec<usize> = (1..mismatches.len().saturating_sub(1)).filter(is_lowest).collect();
    let Some(mismatch) = lowest.iter().map(|&i| mismatches[i]).min_by(f64::total_cmp) else {
        return Err(PointLightError::NoPeriod {
            mismatch: f64::INFINITY,
            searched_s: most as f64 * interval_s,
        });
    };
    let fits = |i: &usize| mismatches[*i] <= (mismatch + MULTIPLE_MISMATCH).min(MOST_MISMATCH);
    let Some(first) = lowest.into_iter().find(fits) else {
        return Err(PointLightError::NoPeriod { mismatch, searched_s: most as f64 * interval_s });
    };
    // The lowest point of the parabola through the three mismatches around the minimum.
    let [before, at, after] = [mismatches[first - 1], mismatches[first], mismatches[first + 1]];
    let bend = before - 2.0 * at + after;
    let shift = if bend > 0.0 && bend.is_finite() { 0.5 * (before - after) / bend } else { 0.0 };
    Ok((first + least - 1) as f64 + shift.clamp(-0.5, 0.5))
}

/// Whether the step from the last frame to the first continues the steps before and after it.
pub(super) fn closes_itself(still: &PointMotion) -> bool {
    let frames = still.frames();
    if frames == 1 {
        return true;
    }
    let missed_sq = |k: usize| {
        let [a, b] = [still.at(frames - 2, k)?, still.at(frames - 1, k)?];
        let [c, d] = [still.at(0, k)?, still.at(1, k)?];
        Some((b + 0.5 * (b - a + d - c)).distance_squared(c))
    };
    let missed_sq: Option<Vec<f64>> = (0..still.points()).map(missed_sq).collect();
    let missed_sq = missed_sq.and_then(|all| mean(all.into_iter()));
    let step_sq = difference_sq(still, 1);
    missed_sq.zip(step_sq).is_some_and(|(missed, step)| missed <= CLOSED_SHARE * CLOSED_SHARE * step)
}

/// Mean of the squared differences between the motion and itself `lag` frames later, m²; `None` if no point
/// is known in both.
fn difference_sq(still: &PointMotion, lag: usize) -> Option<f64> {
    let frames = still.frames().saturating_sub(lag);
    let every = frames.div_ceil(COMPARED_FRAMES).max(1);
    let pairs = (0..frames).step_by(every).flat_map(|t| (0..still.points()).map(move |k| (t, k)));
    mean(pairs.filter_map(|(t, k)| Some(still.at(t + lag, k)?.distance_squared(still.at(t, k)?))))
}

/// Mean squared distance of the points from their mean positions, m².
fn spread_sq(still: &PointMotion) -> f64 {
    let of_point = |k: usize| {
        let known: Vec<DVec3> = (0..still.frames()).filter_map(|t| still.at(t, k)).collect();
        let middle = known.iter().sum::<DVec3>() / known.len() as f64;
        mean(known.iter().map(|p| p.distance_squared(middle)))
    };
    mean((0..still.points()).filter_map(of_point)).unwrap_or(0.0)
}

pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}
