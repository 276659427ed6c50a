//! People who walk in depth, and the error of parallel projection.
//!
//! Hoffman and Flinchbaugh 1982 assume parallel (orthographic) projection. If a person approaches, the image
//! grows: scaled orthography, image_i = s_i (X_i, Y_i). Given scales are divided out. Otherwise a hinge determines
//! them, under the assumption of a steady walk: the distance changes linearly with time,
//! s_i ~ 1 / (1 + change tau_i), tau from -1/2 to 1/2 over the views.
//!
//! Limits: perspective within the figure is not modelled. [`perspective_error_px`] gives the resulting error.

use super::{FitError, FitOptions, HingeFit, fit_hinge};
use crate::wording::counted;
use glam::DVec2;
use thiserror::Error;

/// Why views could not be scaled.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ScaleError {
    /// There are not as many scales or times as views.
    #[error("{} of the points, scales or times of {given}", counted(*points, "view"))]
    Lengths {
        /// Number of views.
        points: usize,
        /// Number of scales or times.
        given: usize,
    },
    /// A scale is not positive, or a time is not finite or does not increase.
    #[error("view {view}: {value} is no scale or comes out of order as a time")]
    Value {
        /// Index of the view.
        view: usize,
        /// Its scale or time.
        value: f64,
    },
    /// The hinge could not be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Image points with their scales divided out.
///
/// # Errors
/// Different numbers of views, scales that are not positive.
pub fn at_one_scale(points: &[DVec2], scales: &[f64]) -> Result<Vec<DVec2>, ScaleError> {
    if points.len() != scales.len() {
        return Err(ScaleError::Lengths { points: points.len(), given: scales.len() });
    }
    if let Some(view) = scales.iter().position(|s| !(*s > 0.0 && s.is_finite())) {
        return Err(ScaleError::Value { view, value: scales[view] });
    }
    Ok(points.iter().zip(scales).map(|(p, s)| *p / *s).collect())
}

/// A hinge that approaches or moves away at constant speed.
#[derive(Debug, Clone, PartialEq)]
pub struct RecedingHinge {
    /// The hinge at the scale of the middle of the time; its covariance is that for a known change.
    pub fit: HingeFit,
    /// Change of the distance over the views, relative to the distance in the middle; positive = moving away. At
    /// +-0.6, the largest change tried, the true change may be larger.
    pub distance_change: f64,
}

/// Largest relative change of distance that is tried.
const LARGEST_CHANGE: f64 = 0.6;

/// Fits a hinge and the constant change of its distance; one unknown more than [`fit_hinge`].
///
/// The change is found on a grid, then by golden-section search. Only the lengths distinguish a person who walks
/// away from one who swings the limbs in place: use several steps if possible.
///
/// # Errors
/// Those of [`fit_hinge`], times that are not finite or do not increase.
pub fn fit_hinge_in_depth(
    first: &[DVec2],
    pivot: &[DVec2],
    second: &[DVec2],
    times_s: &[f64],
    options: &FitOptions,
) -> Result<RecedingHinge, ScaleError> {
    let n = times_s.len();
    if n != pivot.len() {
        return Err(ScaleError::Lengths { points: pivot.len(), given: n });
    }
    let disorder = (0..n).find(|&i| !times_s[i].is_finite() || i > 0 && times_s[i] <= times_s[i - 1]);
    if let Some(view) = disorder {
        return Err(ScaleError::Value { view, value: times_s[view] });
    }
    // Errors of the points are found before they are scaled.
    fit_hinge(first, pivot, second, options)?;
    let span = times_s
        .last()
        .zip(times_s.first())
        .map_or(1.0, |(last, first)| (last - first).max(f64::MIN_POSITIVE));
    let at = |change: f64| {
        let middle = times_s.first().copied().unwrap_or(0.0) + 0.5 * span;
        let grow: Vec<f64> = times_s.iter().map(|t| 1.0 + change * (t - middle) / span).collect();
        let scaled = |points: &[DVec2]| points.iter().zip(&grow).map(|(p, s)| *p * *s).collect::<Vec<_>>();
        // The scale is about the pivot, so a translation has no effect.
        let relative = |points: &[DVec2]| points.iter().zip(pivot).map(|(p, o)| *p - *o).collect::<Vec<_>>();
        fit_hinge(&scaled(&relative(first)), &vec![DVec2::ZERO; n], &scaled(&relative(second)), options)
    };
    let cost = |fit: &Result<HingeFit, FitError>| fit.as_ref().map_or(f64::INFINITY, |fit| fit.residual_rms);
    const STEPS: usize = 12;
    let change = |i: usize| LARGEST_CHANGE * (2.0 * i as f64 / STEPS as f64 - 1.0);
    let costs: Vec<f64> = (0..=STEPS).map(|i| cost(&at(change(i)))).collect();
    let best = (0..=STEPS).min_by(|&i, &j| costs[i].total_cmp(&costs[j])).unwrap_or(0);
    let (mut low, mut high) = (change(best.saturating_sub(1)), change((best + 1).min(STEPS)));
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..24 {
        let (left, right) = (high - golden * (high - low), low + golden * (high - low));
        if cost(&at(left)) < cost(&at(right)) { high = right } else { low = left }
    }
    let distance_change = 0.5 * (low + high);
    let mut fit = at(distance_change)?;
    fit.redundancy = fit.redundancy.saturating_sub(1);
    Ok(RecedingHinge { fit, distance_change })
}

/// Error of a joint's image, pixels, if central projection is approximated by scaled parallel projection.
///
/// A joint `depth_m` behind or in front of its pivot at `distance_m`, seen `offset_px` from the principal point:
/// X f / (Z + z) and X f / Z differ by offset z / Z. Compare it with the noise: if it is larger, residuals of
/// that size are to be expected.
///
/// First order in depth over distance. Infinite for distances that are not positive; NaN for NaN.
pub fn perspective_error_px(offset_px: f64, depth_m: f64, distance_m: f64) -> f64 {
    let ratio = depth_m.abs() / distance_m;
    if ratio.is_nan() || offset_px.is_nan() {
        f64::NAN
    } else if distance_m <= 0.0 {
        f64::INFINITY
    } else {
        offset_px.abs() * ratio
    }
}

/// Largest displacement of a figure's points by perspective, pixels: [`perspective_error_px`] of all points of
/// known depth (T x K), relative to the middle of the figure, whose ray gives the direction of projection.
///
/// In pixels at the figure's scale, its distance **is** the focal length, so no other value is needed. NaN if no
/// depth is known.
pub fn perspective_of_figure_px(tracks: &[Vec<DVec2>], depth: &[f64], focal_px: f64) -> f64 {
    let count = tracks.len().max(1);
    let errors = depth.chunks(count).enumerate().flat_map(|(t, row)| {
        let seen = || tracks.iter().filter_map(move |track| track.get(t)).filter(|p| p.is_finite());
        let middle = seen().sum::<DVec2>() / seen().count().max(1) as f64;
        tracks.iter().zip(row).filter_map(move |(track, z)| {
            let offset = track.get(t)?.distance(middle);
            Some(perspective_error_px(offset, *z, focal_px)).filter(|error| !error.is_nan())
        })
    });
    errors.fold(f64::NAN, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    fn leg(views: usize, change: f64, sd: f64) -> [Vec<DVec2>; 4] {
        let mut random = Random::new(8);
        let mut noise = || sd * DVec2::from_array(random.normal_pair().map(f64::from));
        let mut points = [vec![], vec![], vec![], vec![]];
        for view in 0..views {
            let tau = view as f64 / (views - 1) as f64 - 0.5;
            let t = 12.0 * tau;
            let swing = |angle: f64| DVec2::new(0.7 * angle.sin(), angle.cos());
            let scale = 1.0 / (1.0 + change * tau);
            let knee = DVec2::new(3.0 + tau, 1.0 + 0.1 * t.sin());
            let hip = knee - 0.45 * swing(0.4 * t.cos());
            let ankle = knee + 0.42 * swing(0.4 * t.cos() - 0.5 - 0.45 * (t + 0.8).sin());
            points[0].push(hip * scale + noise());
            points[1].push(knee * scale + noise());
            points[2].push(ankle * scale + noise());
            points[3].push(DVec2::new(2.0 + 0.04 * view as f64, scale));
        }
        points
    }

    #[test]
    fn a_steady_walk_in_depth_is_found() {
        for change in [-0.3, 0.0, 0.25] {
            let [hip, knee, ankle, meta] = leg(60, change, 0.002);
            let times: Vec<f64> = meta.iter().map(|m| m.x).collect();
            let options = FitOptions { noise_sd: 0.002, ..FitOptions::default() };
            let found = fit_hinge_in_depth(&hip, &knee, &ankle, &times, &options).unwrap();
            assert!((found.distance_change - change).abs() < 0.03, "{change}: {}", found.distance_change);
            assert!((found.fit.lengths[0] - 0.45).abs() < 0.01, "{:?}", found.fit.lengths);
            assert!((found.fit.plane.tilt_rad().cos() - 0.7).abs() < 0.04, "{:?}", found.fit.plane);
            // Given scales have the same effect.
            let scales: Vec<f64> = meta.iter().map(|m| m.y).collect();
            let [a, o, b] = [&hip, &knee, &ankle].map(|points| at_one_scale(points, &scales).unwrap());
            let given = fit_hinge(&a, &o, &b, &options).unwrap();
            assert!((given.lengths[1] - 0.42).abs() < 0.01, "{:?}", given.lengths);
        }
    }

    #[test]
    fn bad_scales_and_times_are_refused() {
        let points = [DVec2::X; 3];
        assert!(matches!(at_one_scale(&points, &[1.0]), Err(ScaleError::Lengths { points: 3, given: 1 })));
        assert!(matches!(at_one_scale(&points, &[1.0, 0.0, 1.0]), Err(ScaleError::Value { view: 1, .. })));
        let fit =
            |times: &[f64]| fit_hinge_in_depth(&points, &points, &points, times, &FitOptions::default());
        assert!(matches!(fit(&[0.0, 1.0]), Err(ScaleError::Lengths { .. })));
        assert!(matches!(fit(&[0.0, f64::NAN, 1.0]), Err(ScaleError::Value { view: 1, .. })));
        assert!(matches!(fit(&[0.0, 2.0, 1.0]), Err(ScaleError::Value { view: 2, .. })));
        assert!(matches!(fit(&[0.0, 1.0, 2.0]), Err(ScaleError::Fit(FitError::NoMotion { .. }))));
    }

    #[test]
    fn the_perspective_error_is_that_of_a_pinhole() {
        let (focal_px, distance) = (1000.0, 5.0);
        for (x, z) in [(0.4, 0.2), (-0.9, -0.1), (0.1, 0.3)] {
            let parallel_px = focal_px * x / distance;
            let central_px = focal_px * x / (distance + z);
            let bound = perspective_error_px(parallel_px, z, distance);
            let error: f64 = central_px - parallel_px;
            assert!((bound / error.abs() - 1.0).abs() < 0.07, "{bound} {error}");
        }
        let tracks = [vec![DVec2::ZERO], vec![DVec2::new(80.0, 0.0)]];
        assert!((perspective_of_figure_px(&tracks, &[0.0, 50.0], 1000.0) - 2.0).abs() < 1e-12);
        assert!(perspective_of_figure_px(&tracks, &[f64::NAN; 2], 1000.0).is_nan());
        assert_eq!(perspective_error_px(100.0, 0.2, 0.0), f64::INFINITY);
        assert!(perspective_error_px(f64::NAN, 0.2, 3.0).is_nan());
    }

    /// The change of the distance is one more unknown than in the plain fit.
    #[test]
    fn the_change_takes_one_equation() {
        let [hip, knee, ankle, meta] = leg(30, 0.1, 0.002);
        let times: Vec<f64> = meta.iter().map(|m| m.x).collect();
        let options = FitOptions { noise_sd: 0.002, ..FitOptions::default() };
        let found = fit_hinge_in_depth(&hip, &knee, &ankle, &times, &options).unwrap();
        // 30 views of two rods: 60 equations; plane, two lengths and the change.
        assert_eq!(found.fit.redundancy, 60 - 4 - 1);
    }
}
