//! The rhythm of steps in the places of the lowest changes: the line of phase that explains them better than even motion.

use super::super::search::Path;
use super::super::start::CadenceRange;
use super::reach::{Expected, NEARER_OFF_M, Reach};
use crate::estimate::line::line_through;
use glam::DVec2;

/// Lines of phase that are compared at a start: cadences, and phases within half a cycle.
const RATES: usize = 40;
const OFFSETS: usize = 25;
/// Things that are no walkers may be off even motion by any of these scales of Cauchy's distribution, metres.
const SCALES_M: [f64; 8] = [0.02, 0.035, 0.05, 0.075, 0.1, 0.15, 0.3, 0.6];
/// Steps of the reweighted line.
const STEPS: usize = 6;

/// A line of phase that explains the feet.
pub(super) struct Line {
    /// Time of the first frame.
    pub(super) first_s: f64,
    pub(super) phase_at_start: f64,
    pub(super) rate_hz: f64,
    /// Place at the first frame and speed.
    pub(super) place: [f64; 2],
    /// Logarithm of the likelihood of the feet on it.
    pub(super) likelihood: f64,
}

impl Line {
    /// The one from which feet at (time, place) are the least off.
    pub(super) fn nearest(reach: &mut Reach, points: &[(f64, f64)], rates: &CadenceRange) -> Option<Self> {
        let ([first_m, speed_mps], _) = reweighted_line(points);
        let first_s = points.first()?.0;
        let mut best: Option<Self> = None;
        for k in 0..RATES * OFFSETS {
            let rate_hz =
                rates.low_hz + (rates.high_hz - rates.low_hz) * (k / OFFSETS) as f64 / (RATES - 1) as f64;
            let phase_at_start = 0.5 * (k % OFFSETS) as f64 / OFFSETS as f64;
            let expected: Vec<Expected> = points
                .iter()
                .map(|(t, _)| {
                    let elapsed_s = t - first_s;
                    reach.at(first_m + speed_mps * elapsed_s, phase_at_start + rate_hz * elapsed_s)
                })
                .collect();
            let mut place = [first_m, speed_mps];
            for _ in 0..STEPS {
                place = line_of(points.iter().zip(&expected).map(|((t, along_m), expected)| {
                    let led_m = place[0] + place[1] * (t - first_s);
                    let ([reach_m, ..], scale_m, _) = expected.likelier(along_m - led_m);
                    let off_m = along_m - led_m - reach_m;
                    (t - first_s, along_m - reach_m, 1.0 / (scale_m * scale_m + off_m * off_m))
                }));
            }
            let of_point = |((t, along_m), expected): (&(f64, f64), &Expected)| {
                expected.likelier(along_m - place[0] - place[1] * (t - first_s)).2
            };
            let likelihood = points.iter().zip(&expected).map(of_point).sum();
            if best.as_ref().is_none_or(|best| likelihood > best.likelihood) {
                best = Some(Self { first_s, phase_at_start, rate_hz, place, likelihood });
            }
        }
        best
    }
}

/// The path on which somebody was seen at (time, place) on the ground, and the speed.
pub(super) fn path_through(seen: &[(f64, DVec2)]) -> Option<(Path, f64)> {
    let first_s = seen.first()?.0;
    let [(vx, x), (vy, y)] = [DVec2::X, DVec2::Y].map(|axis| {
        line_through(&seen.iter().map(|(t, place)| (t - first_s, axis.dot(*place))).collect::<Vec<_>>())
    });
    let velocity = DVec2::new(vx, vy);
    Some((Path { origin: DVec2::new(x, y), heading_rad: velocity.to_angle() }, velocity.length()))
}

/// Place at time 0 and speed of the line through (time, place, weight).
fn line_of(points: impl Iterator<Item = (f64, f64, f64)>) -> [f64; 2] {
    let [mut w, mut wt, mut wtt, mut wx, mut wtx] = [0.0; 5];
    for (t, x, weight) in points {
        w += weight;
        wt += weight * t;
        wtt += weight * t * t;
        wx += weight * x;
        wtx += weight * t * x;
    }
    let speed_mps = (w * wtx - wt * wx) / (w * wtt - wt * wt);
    [(wx - speed_mps * wt) / w, speed_mps]
}

/// Place at the first time and speed of the line through (time, place), by Cauchy weights; and how far the points are off,
/// metres.
fn reweighted_line(points: &[(f64, f64)]) -> ([f64; 2], Vec<f64>) {
    let first_s = points.first().map_or(0.0, |p| p.0);
    let mut line = [0.0; 2];
    let mut off_m: Vec<f64> = vec![0.0; points.len()];
    for _ in 0..STEPS {
        let weight = |off_m: &f64| 1.0 / (1.0 + (off_m / NEARER_OFF_M).powi(2));
        line = line_of(off_m.iter().zip(points).map(|(off_m, (t, x))| (t - first_s, *x, weight(off_m))));
        let off = |(time_s, x): &(f64, f64)| x - line[0] - line[1] * (time_s - first_s);
        off_m = points.iter().map(off).collect();
    }
    (line, off_m)
}

/// Logarithm of the likelihood of points (time, place) of something that moves evenly.
pub(super) fn evenly(points: &[(f64, f64)]) -> f64 {
    let (_, off_m) = reweighted_line(points);
    SCALES_M.iter().map(|scale_m| likelihood(&off_m, *scale_m)).fold(f64::MIN, f64::max)
}

/// Logarithm of the likelihood of residuals after Cauchy's distribution of this scale, up to a constant.
fn likelihood(off_m: &[f64], scale_m: f64) -> f64 {
    -off_m.iter().map(|off| scale_m.ln() + (off / scale_m).powi(2).ln_1p()).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reweighted_line_ignores_what_lies_far_off() {
        let mut points: Vec<(f64, f64)> =
            (0..40).map(|k| (0.04 * f64::from(k), 2.0 + 0.04 * f64::from(k))).collect();
        (0..8).for_each(|k| points[5 * k].1 -= 1.5);
        let ([place, speed], off_m) = reweighted_line(&points);
        assert!((place - 2.0).abs() < 0.02 && (speed - 1.0).abs() < 0.02, "{place} {speed}");
        assert!(off_m[0] < -1.4 && off_m[1].abs() < 0.03);
    }
}
