//! The neck's distance over a sequence: constant velocity, unequal intervals, missing frames, outliers.
//!
//! A Kalman filter with Rauch-Tung-Striebel smoothing ([`crate::estimate::kalman`]), repeated with weights: a
//! frame far from the track gets less weight (Huber's weights). Errors common to all frames (lengths, posture of
//! the person) do not average out. They are estimated from the scatter: the part of a stated variance that
//! exceeds the scatter of the frames about the track is assumed common and stays in the result. Scatter that is
//! correlated between neighbouring frames (the steps of a walk) counts as fewer frames.

use crate::estimate::median::median;
use glam::DVec3;

use super::{Anchor, AnchorError, positive};
use crate::estimate::kalman::{ConstantVelocity, Noise, smooth as smooth_states};

/// Options of [`smooth`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothOptions {
    /// Increase of the velocity's variance per second, (m/s)²/s. Default 0.1: a walker's speed changes by 0.3 m/s
    /// in a second.
    pub velocity_variance_per_s: f64,
    /// Prior standard deviation of the velocity, m/s.
    pub velocity_sd_m_per_s: f64,
    /// Residuals beyond this many standard deviations get less weight.
    pub robust_sigmas: f64,
}

impl Default for SmoothOptions {
    fn default() -> Self {
        Self { velocity_variance_per_s: 0.1, velocity_sd_m_per_s: 2.0, robust_sigmas: 1.5 }
    }
}

/// Distances of the neck over a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthTrack {
    /// Distance along the neck's ray in each frame, metres, including frames without an anchor.
    pub distance_m: Vec<f64>,
    /// Its standard deviation, metres.
    pub sd_m: Vec<f64>,
    /// Residual of each frame's anchor divided by its standard deviation; NaN for frames without an anchor.
    pub residual_sigmas: Vec<f64>,
    /// Standard deviation of the frames about the track, metres.
    pub scatter_m: f64,
    /// Correlation of residuals of neighbouring frames, 0 to 1.
    pub correlation: f64,
    /// Standard deviation of the error common to all frames, metres.
    pub common_sd_m: f64,
}

impl DepthTrack {
    /// Position of the neck of a frame on its ray.
    pub fn neck(&self, frame: usize, ray: DVec3) -> DVec3 {
        ray * self.distance_m[frame]
    }

    /// Frames whose anchor is more than this many standard deviations from the track.
    pub fn outliers(&self, sigmas: f64) -> Vec<usize> {
        (0..self.residual_sigmas.len()).filter(|&i| self.residual_sigmas[i].abs() > sigmas).collect()
    }
}

const PASSES: usize = 6;
/// A larger correlation is a drift of the track and not of its noise.
const MOST_CORRELATION: f64 = 0.9;

/// Smooths the distances of a sequence; `None` for frames without an anchor.
pub fn smooth(
    times_s: &[f64],
    anchors: &[Option<Anchor>],
    options: &SmoothOptions,
) -> Result<DepthTrack, AnchorError> {
    check(times_s, anchors, options)?;
    let count = times_s.len();
    let seen: Vec<usize> = (0..count).filter(|&i| anchors[i].is_some()).collect();
    let measured: Vec<(f64, f64)> = anchors
        .iter()
        .map(|a| a.as_ref().map_or((f64::NAN, f64::INFINITY), |a| (a.distance_m, a.sd_depth_m.powi(2))))
        .collect();
    let stated = median(&mut seen.iter().map(|&i| measured[i].1).collect::<Vec<_>>()).unwrap_or(0.0);
    // Stated deviations relative to each other; their scale is measured below.
    let relative: Vec<f64> = measured.iter().map(|m| m.1 / stated).collect();
    let mut scatter_sq = stated;
    let mut correlation = 0.0;
    let mut weights = vec![1.0; count];
    let mut states = Vec::new();
    for _ in 0..PASSES {
        let grown = scatter_sq * (1.0 + correlation) / (1.0 - correlation);
        let variances: Vec<f64> = (0..count).map(|i| relative[i] * grown / weights[i]).collect();
        states = filtered(times_s, &measured, &variances, &seen, options);
        let residual = |i: usize| (measured[i].0 - states[i].position) / relative[i].sqrt();
        let residuals: Vec<f64> = seen.iter().map(|&i| residual(i)).collect();
        let spread =
            1.4826 * median(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<_>>()).unwrap_or(0.0);
        // At least a tenth of the stated deviation: a few frames can lie on a line by chance.
        scatter_sq = (spread * spread).max(0.01 * stated);
        correlation = neighbour_correlation(&seen, &residuals, 3.0 * scatter_sq.sqrt());
        for (&i, r) in seen.iter().zip(&residuals) {
            weights[i] = (options.robust_sigmas * scatter_sq.sqrt() / r.abs()).min(1.0);
        }
    }
    let common_sq = (stated - scatter_sq).max(0.0);
    Ok(DepthTrack {
        distance_m: states.iter().map(|s| s.position).collect(),
        sd_m: states.iter().map(|s| s.position_sd().hypot(common_sq.sqrt())).collect(),
        residual_sigmas: (0..count)
            .map(|i| (measured[i].0 - states[i].position) / (relative[i] * scatter_sq).sqrt())
            .collect(),
        scatter_m: scatter_sq.sqrt(),
        correlation,
        common_sd_m: common_sq.sqrt(),
    })
}

fn check(times_s: &[f64], anchors: &[Option<Anchor>], options: &SmoothOptions) -> Result<(), AnchorError> {
    if times_s.len() != anchors.len() {
        return Err(AnchorError::Counts { times: times_s.len(), anchors: anchors.len() });
    }
    positive("velocity_variance_per_s", options.velocity_variance_per_s)?;
    positive("velocity_sd_m_per_s", options.velocity_sd_m_per_s)?;
    positive("robust_sigmas", options.robust_sigmas)?;
    for (i, pair) in times_s.windows(2).enumerate() {
        if !(pair[1] > pair[0] && (pair[1] - pair[0]).is_finite()) {
            return Err(AnchorError::Times { frame: i + 1, before_s: pair[0], after_s: pair[1] });
        }
    }
    for anchor in anchors.iter().flatten() {
        positive("distance_m", anchor.distance_m)?;
        positive("sd_depth_m", anchor.sd_depth_m)?;
    }
    if anchors.iter().all(Option::is_none) { Err(AnchorError::Empty) } else { Ok(()) }
}

/// Filter and smoother over all frames, with given variances of the measurements.
fn filtered(
    times_s: &[f64],
    measured: &[(f64, f64)],
    variances: &[f64],
    seen: &[usize],
    options: &SmoothOptions,
) -> Vec<ConstantVelocity> {
    let noise = |measurement_variance: f64| Noise {
        velocity_variance_per_s: options.velocity_variance_per_s,
        measurement_variance,
    };
    let dt_s: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    let first = measured[seen[0]].0;
    // No prior: the range of distances is that of the scene.
    let mut state = ConstantVelocity::new(first, 0.0, first * first, options.velocity_sd_m_per_s.powi(2));
    let mut states = Vec::with_capacity(times_s.len());
    for i in 0..times_s.len() {
        if i > 0 {
            state = state.predict(dt_s[i - 1], &noise(0.0));
        }
        if measured[i].0.is_finite() {
            state = state.update(measured[i].0, &noise(variances[i]));
        }
        states.push(state);
    }
    smooth_states(&states, &dt_s, &noise(0.0))
}

/// Correlation of the residuals of neighbouring frames, clipped to `most`.
fn neighbour_correlation(seen: &[usize], residuals: &[f64], most: f64) -> f64 {
    let cut: Vec<f64> = residuals.iter().map(|r| r.clamp(-most, most)).collect();
    let square: f64 = cut.iter().map(|r| r * r).sum::<f64>() / cut.len() as f64;
    let pairs: Vec<f64> =
        (1..seen.len()).filter(|&i| seen[i] == seen[i - 1] + 1).map(|i| cut[i] * cut[i - 1]).collect();
    if pairs.len() < 4 || square <= 0.0 {
        return 0.0;
    }
    (pairs.iter().sum::<f64>() / pairs.len() as f64 / square).clamp(0.0, MOST_CORRELATION)
}

#[cfg(test)]
mod tests {
    use super::super::{Anchor, AnchorSource};
    use super::*;
    use crate::synth::Random;

    fn anchor(distance_m: f64, sd_m: f64) -> Anchor {
        Anchor::single(DVec3::Z, distance_m, sd_m, 0.0, AnchorSource::Given)
    }

    /// A walk away from the camera at unequal intervals; a third of the frames is missing, and two are outliers.
    #[test]
    fn a_planted_walk_is_followed() {
        let mut random = Random::new(2);
        let times_s: Vec<f64> = (0..90).map(|i| f64::from(i) / 25.0 + 0.01 * f64::from(i % 3)).collect();
        let truth = |t: f64| 4.0 + 1.2 * t;
        let anchors: Vec<Option<Anchor>> = times_s
            .iter()
            .enumerate()
            .map(|(i, &t)| {
                let noise = 0.1 * f64::from(random.normal_pair()[0]);
                let off = if [20, 50].contains(&i) { 2.0 } else { 0.0 };
                (i % 3 != 1).then(|| anchor(truth(t) + noise + off, 0.1))
            })
            .collect();
        let track = smooth(&times_s, &anchors, &SmoothOptions::default()).unwrap();
        let errors: Vec<f64> = times_s.iter().zip(&track.distance_m).map(|(&t, d)| d - truth(t)).collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
        assert!(rms < 0.06, "{rms}");
        let inside = errors.iter().zip(&track.sd_m).filter(|(e, sd)| e.abs() < 2.0 * **sd).count();
        assert!(inside > 80, "{inside}");
        assert_eq!(track.outliers(5.0), [20, 50]);
        assert!((track.scatter_m - 0.1).abs() < 0.03, "{}", track.scatter_m);
        let again = smooth(&times_s, &anchors, &SmoothOptions::default()).unwrap();
        assert_eq!(track.distance_m, again.distance_m);
    }

    /// Frames that agree much better than stated have a common error: it stays.
    #[test]
    fn a_common_error_does_not_average_out() {
        let times_s: Vec<f64> = (0..50).map(|i| f64::from(i) / 25.0).collect();
        let anchors: Vec<Option<Anchor>> =
            times_s.iter().map(|t| Some(anchor(5.0 + 0.01 * (t * 40.0).sin(), 0.2))).collect();
        let track = smooth(&times_s, &anchors, &SmoothOptions::default()).unwrap();
        assert!(track.common_sd_m > 0.19 && track.sd_m.iter().all(|sd| *sd > 0.19));
    }

    #[test]
    fn sequences_that_make_no_sense_are_refused() {
        let options = SmoothOptions::default();
        assert_eq!(smooth(&[0.0], &[None], &options), Err(AnchorError::Empty));
        assert_eq!(smooth(&[], &[], &options), Err(AnchorError::Empty));
        assert_eq!(smooth(&[0.0], &[], &options), Err(AnchorError::Counts { times: 1, anchors: 0 }));
        let two = [Some(anchor(4.0, 0.1)), Some(anchor(4.0, 0.1))];
        assert!(matches!(smooth(&[1.0, 1.0], &two, &options), Err(AnchorError::Times { frame: 1, .. })));
        assert!(smooth(&[0.0, f64::NAN], &two, &options).is_err());
        let alone = smooth(&[0.0], &[Some(anchor(4.0, 0.1))], &options).unwrap();
        assert!((alone.distance_m[0] - 4.0).abs() < 1e-9 && (alone.sd_m[0] - 0.1).abs() < 0.01);
    }

    /// The deviation is recovered for normal scatter of 10 cm about a steady walk.
    #[test]
    fn the_scatter_is_a_standard_deviation() {
        let mut random = Random::new(7);
        let times_s: Vec<f64> = (0..1500).map(|i| f64::from(i) / 25.0).collect();
        let mut noise = || 0.1 * f64::from(random.normal_pair()[0]);
        let anchors: Vec<Option<Anchor>> =
            times_s.iter().map(|t| Some(anchor(4.0 + 0.1 * t + noise(), 0.1))).collect();
        let track = smooth(&times_s, &anchors, &SmoothOptions::default()).unwrap();
        assert!((track.scatter_m / 0.1 - 1.0).abs() < 0.07, "{}", track.scatter_m);
        assert!(track.correlation < 0.1, "{}", track.correlation);
    }

    /// If errors are equal in neighbouring frames, only different ones count: the stated deviation follows from
    /// the number of independent errors.
    #[test]
    fn errors_alike_in_neighbouring_frames_average_out_less() {
        let mut ratios = Vec::new();
        for seed in 0..20 {
            let mut random = Random::new(seed);
            let times_s: Vec<f64> = (0..200).map(|i| f64::from(i) / 25.0).collect();
            let mut error = 0.0;
            let anchors: Vec<Option<Anchor>> = times_s
                .iter()
                .map(|_| {
                    error = 0.8 * error + 0.06 * f64::from(random.normal_pair()[0]);
                    Some(anchor(5.0 + error, 0.1))
                })
                .collect();
            let options = SmoothOptions { velocity_variance_per_s: 0.01, ..SmoothOptions::default() };
            let track = smooth(&times_s, &anchors, &options).unwrap();
            assert!(track.correlation > 0.4, "{}", track.correlation);
            let rms = (track.distance_m.iter().map(|d| (d - 5.0).powi(2)).sum::<f64>() / 200.0).sqrt();
            let stated = track.sd_m.iter().sum::<f64>() / 200.0;
            ratios.push(rms / stated.hypot(0.0));
        }
        ratios.sort_by(f64::total_cmp);
        assert!((0.4..1.4).contains(&ratios[10]), "{ratios:?}");
    }

    /// Frames that are far apart are not neighbours, even if their errors are similar.
    #[test]
    fn only_neighbouring_frames_are_compared() {
        let times_s: Vec<f64> = (0..300).map(|i| f64::from(i) / 25.0).collect();
        // Every third frame is seen; its error is a slow wave.
        let wave = |i: usize| 0.1 * (0.2 * i as f64).sin();
        let anchors: Vec<Option<Anchor>> =
            (0..300_usize).map(|i| i.is_multiple_of(3).then(|| anchor(5.0 + wave(i), 0.1))).collect();
        let stiff = SmoothOptions { velocity_variance_per_s: 1e-5, ..SmoothOptions::default() };
        assert_eq!(smooth(&times_s, &anchors, &stiff).unwrap().correlation, 0.0);
        let all: Vec<Option<Anchor>> = (0..300).map(|i| Some(anchor(5.0 + wave(i), 0.1))).collect();
        assert!(smooth(&times_s, &all, &stiff).unwrap().correlation > 0.8);
    }
}
