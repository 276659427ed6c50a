//! The position of right and left relative to one another, its noise and its acceleration.
//!
//! With the difference d = right - left and the mean m of a pair, a swap changes the sign of d and
//! leaves m unchanged. So m gives the noise whatever the labels, and the labels are correct where the signs
//! make d smooth.

use glam::DVec2;

/// A pair visible on both sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Right minus left as labelled, px.
    pub difference: DVec2,
    /// Mean of right and left, px.
    pub mean: DVec2,
    /// Weight from the two scores, (0, 1]; the noise variance is divided by it.
    pub weight: f64,
}

/// One pair over time; `None` where a side is missing or the sample is an outlier.
pub(super) type Track = Vec<Option<Sample>>;

/// Noise and acceleration of one pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Variance of one coordinate of one joint, px^2.
    pub noise_sq: f64,
    /// Mean square of one coordinate of the acceleration of d, (px/s^2)^2.
    pub acceleration_sq: f64,
    /// Lower bound of the variance of a residual, px^2.
    pub floor_sq: f64,
}

/// Degrees of freedom of the Student distribution of the residuals: heavy tails for heel strikes and bad
/// detections.
const NU: f64 = 4.0;
/// Upper bound of the information from one triple of samples, nats: any event has at least the odds e^-8.
/// With a smaller bound a swap of knee and ankle alone is lost; with a larger one single bad detections
/// swap a whole run.
const MOST_NATS: f64 = 8.0;
/// Residuals of neighbouring triples share two of three samples: for white noise the log odds of a single
/// swap have a variance of 7.8 (d / sd)^2, while independent residuals of the same mean would have 4.
/// Doubling the noise variance keeps the odds from being overconfident.
const SHARED: f64 = 2.0;
/// Over this lag, s, the acceleration of walking is nearly constant and noise no longer masks it.
const LAG_S: f64 = 0.1;
/// Distance of an outlier from the line between its neighbours, in medians of that distance.
const OUTLIER_MEDIANS: f64 = 4.5;
/// Median of |r|^2 divided by the variance of a coordinate, for two Gaussian coordinates: 2 ln 2.
const MEDIAN_CHI2: f64 = 2.0 * std::f64::consts::LN_2;

/// The costs in nats of the four sign patterns (before * last, last * now), index `2 * (turned) + turned`.
///
/// With the steps h1 = t1 - t0, h2 = t2 - t1 and q = h2 / h1:
/// r = d2 - d1 - q (d1 - d0), var r = noise (1 + (1 + q)^2 + q^2) + (a h2 (h1 + h2) / 2)^2;
/// cost = (nu + 2) / 2 ln(1 + |r|^2 / (nu var r)).
pub(super) fn triple_costs(times_s: [f64; 3], samples: [Sample; 3], scale: &Scale) -> [f64; 4] {
    let [h1, h2] = [times_s[1] - times_s[0], times_s[2] - times_s[1]];
    let q = h2 / h1;
    let coefficients = [q, 1.0 + q, 1.0];
    let shared: f64 = coefficients.iter().zip(&samples).map(|(c, s)| c * c / s.weight).sum();
    let bend = 0.5 * h2 * (h1 + h2);
    let variance =
        2.0 * SHARED * scale.noise_sq * shared + scale.acceleration_sq * bend * bend + scale.floor_sq;
    let [d0, d1, d2] = samples.map(|s| s.difference);
    let cost = |turns: usize| {
        let [s0, s2] = [turns >> 1, turns & 1].map(|turned| if turned == 1 { -1.0 } else { 1.0 });
        let r = s2 * d2 - (1.0 + q) * d1 + q * s0 * d0;
        0.5 * (NU + 2.0) * (r.length_squared() / (NU * variance)).ln_1p()
    };
    let costs = [0, 1, 2, 3].map(cost);
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    costs.map(|c| (c - least).min(MOST_NATS))
}

/// Drops samples that lie off the line between their neighbours whatever the signs; returns the frames
/// dropped.
pub(super) fn drop_outliers(times_s: &[f64], track: &mut Track) -> Vec<usize> {
    let mut dropped = Vec::new();
    for _ in 0..3 {
        let seen: Vec<usize> = (0..track.len()).filter(|&t| track[t].is_some()).collect();
        let off = distances_from_line(times_s, track, &seen);
        let lengths = seen.iter().filter_map(|&t| track[t]).map(|s| s.difference.length());
        let (Some(typical), Some(length)) =
            (upper_median(&mut off.clone()), upper_median(&mut lengths.collect::<Vec<_>>()))
        else {
            break;
        };
        let limit = (OUTLIER_MEDIANS * typical).max(0.3 * length);
        let at = |i: usize| off.get(i).copied().unwrap_or(0.0);
        let worst =
            (0..off.len()).filter(|&i| at(i) > limit && (i == 0 || at(i) > at(i - 1)) && at(i) >= at(i + 1));
        let worst: Vec<usize> = worst.map(|i| seen[i + 1]).collect();
        if worst.is_empty() {
            break;
        }
        for t in worst {
            track[t] = None;
            dropped.push(t);
        }
    }
    dropped.sort_unstable();
    dropped
}

/// The distance of every inner sample from the line between its neighbours: of m and, for the best signs, of
/// d / 2.
///
/// Divided by the ratio of the neighbours' spacing to the usual spacing, because the bend is proportional to
/// h1 h2.
fn distances_from_line(times_s: &[f64], track: &Track, seen: &[usize]) -> Vec<f64> {
    let Some(step) =
        upper_median(&mut seen.windows(2).map(|w| times_s[w[1]] - times_s[w[0]]).collect::<Vec<_>>())
    else {
        return Vec::new();
    };
    let distance = |w: &[usize]| {
        let [Some(a), Some(b), Some(c)] = [track[w[0]], track[w[1]], track[w[2]]] else { return 0.0 };
        let [h1, h2] = [times_s[w[1]] - times_s[w[0]], times_s[w[2]] - times_s[w[1]]];
        let x = h1 / (h1 + h2);
        let of_mean = b.mean.distance_squared(a.mean.lerp(c.mean, x));
        let of_difference = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .map(|(p, n)| b.difference.distance_squared((p * a.difference).lerp(n * c.difference, x)))
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        (of_mean + 0.25 * of_difference).sqrt() / (h1 * h2 / (step * step)).max(1.0)
    };
    seen.windows(3).map(distance).collect()
}

/// Noise from the means of a group's pairs, then the acceleration of each pair from its differences.
///
/// `signs` are those of an earlier path; without them the smoothest of the four patterns is used.
pub(super) fn scales(times_s: &[f64], tracks: &[Track], signs: Option<&[Vec<f64>]>) -> Vec<Scale> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    let step_s = upper_median(&mut steps).unwrap_or(1.0);
    let lag = ((LAG_S / step_s).round() as usize).clamp(1, 50);
    let of_means: Vec<[f64; 2]> = tracks.iter().map(|t| noise_and_bend(times_s, t, step_s, lag)).collect();
    let noise_sq = upper_median(&mut of_means.iter().map(|m| m[0]).collect::<Vec<_>>()).unwrap_or(0.0);
    let lengths = tracks.iter().flatten().flatten().map(|s| s.difference.length());
    let floor_sq = (0.005 * upper_median(&mut lengths.collect::<Vec<_>>()).unwrap_or(0.0)).powi(2) + 1e-12;
    let scale = |(i, track): (usize, &Track)| {
        let lag = if signs.is_some() { lag } else { 1 };
        let r_sq = |w: [usize; 3]| {
            let s = w.map(|t| track[t].map(|s| s.difference));
            let [Some(a), Some(b), Some(c)] = s else { return None };
            let q = (times_s[w[2]] - times_s[w[1]]) / (times_s[w[1]] - times_s[w[0]]);
            let with = |p: f64, n: f64| (n * c - (1.0 + q) * b + q * p * a).length_squared();
            Some(match signs {
                Some(signs) => with(signs[i][w[0]] * signs[i][w[1]], signs[i][w[1]] * signs[i][w[2]]),
                None => with(1.0, 1.0).min(with(1.0, -1.0)).min(with(-1.0, 1.0)).min(with(-1.0, -1.0)),
            })
        };
        let total = second_difference_variance(times_s, track, step_s, lag, r_sq).unwrap_or(0.0);
        let bend_sq = (total - 12.0 * noise_sq).max(0.0) / (lag as f64).powi(4);
        let acceleration_sq = bend_sq.max(of_means[i][1]) / step_s.powi(4);
        Scale { noise_sq, acceleration_sq, floor_sq }
    };
    tracks.iter().enumerate().map(scale).collect()
}

/// Noise variance of a joint and mean square bend a^2 h^4 of the mean m, from second differences over one
/// step and over `lag` steps: R_1 = 3 noise + bend, R_k = 3 noise + k^4 bend.
///
/// With a lag of one step the two cannot be separated: then all but a tenth counts as bend.
fn noise_and_bend(times_s: &[f64], track: &Track, step_s: f64, lag: usize) -> [f64; 2] {
    let variance = |lag| {
        second_difference_variance(times_s, track, step_s, lag, |w| {
            let [Some(a), Some(b), Some(c)] = w.map(|t| track[t].map(|s| s.mean)) else { return None };
            let q = (times_s[w[2]] - times_s[w[1]]) / (times_s[w[1]] - times_s[w[0]]);
            Some((c - (1.0 + q) * b + q * a).length_squared())
        })
    };
    let one = variance(1).unwrap_or(0.0);
    match (lag, variance(lag)) {
        (2.., Some(many)) => {
            let bend = ((many - one) / ((lag as f64).powi(4) - 1.0)).clamp(0.0, one);
            [((one - bend) / 3.0).max(0.01 * one), bend]
        }
        _ => [0.1 * one / 3.0, 0.9 * one],
    }
}

/// Robust variance of a coordinate of the second differences over `lag` samples, from evenly spaced triples.
fn second_difference_variance(
    times_s: &[f64],
    track: &Track,
    step_s: f64,
    lag: usize,
    r_sq: impl Fn([usize; 3]) -> Option<f64>,
) -> Option<f64> {
    let wanted = step_s * lag as f64;
    let even = |a: usize, b: usize| (times_s[b] - times_s[a] - wanted).abs() < 0.3 * wanted;
    let values = (2 * lag..track.len())
        .map(|t| [t - 2 * lag, t - lag, t])
        .filter(|w| even(w[0], w[1]) && even(w[1], w[2]))
        .filter_map(r_sq);
    upper_median(&mut values.collect::<Vec<_>>()).map(|m| m / MEDIAN_CHI2)
}
/// The middle value; of the two in the middle of an even number the larger, because noise that is underestimated
/// makes swaps of noise.
pub(super) fn upper_median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    fn sample(difference: DVec2, mean: DVec2, weight: f64) -> Sample {
        Sample { difference, mean, weight }
    }

    /// The formula above, written out: steps of 0.1 and 0.2 s, so q = 2, and different weights.
    #[test]
    fn costs_of_sign_patterns_are_those_of_the_formula() {
        let [d0, d1, d2] = [DVec2::new(3.0, 1.0), DVec2::new(4.0, 0.0), DVec2::new(7.0, -2.5)];
        let scale = Scale { noise_sq: 0.5, acceleration_sq: 200.0, floor_sq: 0.25 };
        let samples = [(d0, 0.5), (d1, 1.0), (d2, 2.0)].map(|(d, w)| sample(d, DVec2::ZERO, w));
        let found = triple_costs([1.0, 1.1, 1.3], samples, &scale);
        // The noise of q d0, (1 + q) d1 and d2 by their weights, for differences of two joints, and doubled;
        // the change of velocity that an acceleration causes over both steps; the lower bound.
        let noise = 2.0 * 2.0 * 0.5 * (4.0 / 0.5 + 9.0 + 1.0 / 2.0);
        let bend = 0.5 * 0.2 * 0.3;
        let variance = noise + 200.0 * bend * bend + 0.25;
        let costs: Vec<f64> = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .into_iter()
            .map(|(before, now)| {
                // From d1 with the velocity of the previous step: d1 + q (d1 - d0).
                let expected = d1 + 2.0 * (d1 - before * d0);
                3.0 * (1.0 + (now * d2 - expected).length_squared() / (4.0 * variance)).ln()
            })
            .collect();
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        for (found, cost) in found.into_iter().zip(&costs) {
            assert!((found - (cost - least)).abs() < 1e-12, "{found} {costs:?}");
        }
        assert!(found.iter().any(|cost| *cost > 0.5), "{found:?}");
    }

    /// Uniform motion without a swap costs nothing, at uneven times; a single frame never costs more
    /// than 8.
    #[test]
    fn uniform_motion_is_free_and_no_frame_decides_alone() {
        let at = |time_s: f64| DVec2::new(50.0 + 30.0 * time_s, -20.0 * time_s);
        let times_s = [0.0, 0.03, 0.11];
        let scale = Scale { noise_sq: 1e-6, acceleration_sq: 0.0, floor_sq: 1e-9 };
        let samples = times_s.map(|time_s| sample(at(time_s), DVec2::ZERO, 1.0));
        assert_eq!(triple_costs(times_s, samples, &scale), [0.0, 8.0, 8.0, 8.0]);
    }

    /// A sum of slow sines of random phases, the mean square of its acceleration, and added noise.
    struct Drawn {
        means: Vec<DVec2>,
        differences: Vec<DVec2>,
        acceleration_sq: f64,
    }

    fn drawn(times_s: &[f64], noise_sd: f64, random: &mut Random) -> Drawn {
        let waves: Vec<[f64; 4]> = (0..12)
            .map(|_| [random.uniform(2.0, 6.0), random.uniform(0.0, 6.3), random.uniform(0.0, 6.3), 0.0])
            .collect();
        let at = |time_s: f64, size: f64| -> DVec2 {
            waves
                .iter()
                .map(|[rate, x, y, _]| {
                    size * DVec2::new((rate * time_s + x).sin(), (rate * time_s + y).sin())
                })
                .sum()
        };
        let mut noise = || noise_sd * DVec2::from(random.normal_pair().map(f64::from));
        let (mut means, mut differences) = (vec![], vec![]);
        for &time_s in times_s {
            // Noise of the right and of the left joint.
            let (right, left) = (noise(), noise());
            means.push(at(time_s, 4.0) + 0.5 * (right + left));
            differences.push(at(time_s, 12.0) + right - left);
        }
        let acceleration_sq = waves.iter().map(|[rate, ..]| 0.5 * (12.0 * rate * rate).powi(2)).sum();
        Drawn { means, differences, acceleration_sq }
    }

    /// The estimates recover the true noise and acceleration, whatever the frame rate.
    #[test]
    fn planted_noise_and_acceleration_are_found() {
        let mut random = Random::new(17);
        for rate_hz in [50.0, 100.0] {
            let times_s: Vec<f64> = (0..4000).map(|t| f64::from(t) / rate_hz).collect();
            let drawn = drawn(&times_s, 1.5, &mut random);
            let pairs = drawn.differences.iter().zip(&drawn.means);
            let track: Track = pairs.map(|(d, m)| Some(sample(*d, *m, 1.0))).collect();
            let signs = vec![vec![1.0; track.len()]];
            let [found] = scales(&times_s, &[track], Some(&signs))[..] else { panic!() };
            let noise_sd = found.noise_sq.sqrt();
            assert!((noise_sd / 1.5 - 1.0).abs() < 0.1, "{rate_hz} Hz: {noise_sd}");
            let ratio = (found.acceleration_sq / drawn.acceleration_sq).sqrt();
            assert!((ratio - 1.0).abs() < 0.25, "{rate_hz} Hz: {ratio}");
            // Half a percent of the usual distance is the lower bound of the uncertainty.
            let mut lengths: Vec<f64> = drawn.differences.iter().map(|d| d.length()).collect();
            lengths.sort_by(f64::total_cmp);
            assert!((found.floor_sq.sqrt() / (0.005 * lengths[2000]) - 1.0).abs() < 0.01);
        }
    }

    /// Without signs the smoothest pattern of each triple is used: swaps do not change the estimates.
    #[test]
    fn exchanges_do_not_disturb_the_scales() {
        let mut random = Random::new(4);
        let times_s: Vec<f64> = (0..600).map(|t| f64::from(t) / 50.0).collect();
        let drawn = drawn(&times_s, 0.5, &mut random);
        let track = |flip: &dyn Fn(usize) -> bool| -> Track {
            let sign = |t: usize| if flip(t) { -1.0 } else { 1.0 };
            (0..600).map(|t| Some(sample(sign(t) * drawn.differences[t], drawn.means[t], 1.0))).collect()
        };
        let straight = scales(&times_s, &[track(&|_| false)], None)[0];
        let exchanged = scales(&times_s, &[track(&|t| t % 3 == 0)], None)[0];
        assert_eq!(straight.noise_sq, exchanged.noise_sq);
        assert!((straight.acceleration_sq / exchanged.acceleration_sq - 1.0).abs() < 1e-9);
    }

    /// Detections off the line between their neighbours are dropped, also a small one beside a large one, in
    /// mean or difference; swaps are kept.
    #[test]
    fn outliers_go_and_exchanges_stay() {
        let mut random = Random::new(8);
        let times_s: Vec<f64> = (0..120).map(|t| f64::from(t) / 25.0).collect();
        let drawn = drawn(&times_s, 0.3, &mut random);
        let mut track: Track =
            (0..120).map(|t| Some(sample(drawn.differences[t], drawn.means[t], 1.0))).collect();
        let far = DVec2::new(90.0, -70.0);
        for (t, size) in [(20, 10.0), (22, 1.0), (80, 1.0)] {
            track[t] = Some(sample(drawn.differences[t], drawn.means[t] + size * far, 1.0));
        }
        // Both joints are off in opposite directions, so the mean is unchanged.
        track[50] = Some(sample(drawn.differences[50] + 2.0 * far, drawn.means[50], 1.0));
        for t in [35, 36, 65] {
            track[t] = Some(sample(-drawn.differences[t], drawn.means[t], 1.0));
        }
        assert_eq!(drop_outliers(&times_s, &mut track), [20, 22, 50, 80]);
        let left: Vec<usize> = (0..120).filter(|&t| track[t].is_none()).collect();
        assert_eq!(left, [20, 22, 50, 80]);
    }
}
