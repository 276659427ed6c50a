//! A hinge: two rods that share a pivot and a plane.
//!
//! Source: Hoffman and Flinchbaugh 1982, Proposition 2 and appendix 2.

use super::Plane;
use super::fit::{self, FitError, FitOptions};
use glam::DVec2;
use nalgebra::Matrix4;

/// A hinge fitted to two or more views.
#[derive(Debug, Clone, PartialEq)]
pub struct HingeFit {
    /// Plane of the motion, or its mirror.
    pub plane: Plane,
    /// Lengths of the rods from the pivot to each end, in the unit of the points.
    pub lengths: [f64; 2],
    /// Covariance of (p, q, length to the first end, length to the second): the noise given or the residuals,
    /// whichever is larger. Infinite where the views do not determine the plane.
    pub covariance: Matrix4<f64>,
    /// Depth of each end relative to the pivot per view; NaN where missing. Or all with the other sign.
    pub depth: Vec<[f64; 2]>,
    /// Residuals per view and rod (distance in the image), outliers included; NaN where missing.
    pub residuals: Vec<[f64; 2]>,
    /// Views left out as outliers.
    pub outliers: Vec<bool>,
    /// RMS of the residuals of the views used.
    pub residual_rms: f64,
    /// RMS distance of each rod's image vector from its mean.
    pub motion: [f64; 2],
    /// Equations less unknowns; 0 = the views cannot contradict a plane.
    pub redundancy: usize,
    /// Whether the plane lies at the largest tilt allowed: lengths and depths are then lower bounds at best.
    pub at_tilt_limit: bool,
}

/// Fits a hinge in planar motion to views of its ends and pivot (any translation; NaN = not seen).
///
/// # Errors
/// Differing numbers of views, infinite positions, fewer than two views, no motion, senseless options.
pub fn fit_hinge(
    first: &[DVec2],
    pivot: &[DVec2],
    second: &[DVec2],
    options: &FitOptions,
) -> Result<HingeFit, FitError> {
    let views = fit::views(pivot, [first, second])?;
    let fit = fit::fit(&views, options)?;
    Ok(HingeFit {
        plane: fit.plane,
        lengths: fit.lengths,
        covariance: fit.covariance,
        depth: views.iter().map(|v| v.map(|d| fit.plane.depth(d))).collect(),
        residuals: fit.residuals,
        outliers: fit.outliers,
        residual_rms: fit.residual_rms,
        motion: fit.motion,
        redundancy: fit.redundancy,
        at_tilt_limit: fit.at_tilt_limit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    #[test]
    fn planted_hinges_are_recovered() {
        let mut random = Random::new(3);
        let mut missed = 0;
        for _ in 0..200 {
            let tilt = random.uniform(0.1, 1.35);
            let slope = tilt.tan() * DVec2::from_angle(random.uniform(0.0, 6.3));
            let basis = [
                DVec2::from_angle(slope.to_angle()) * tilt.cos(),
                DVec2::from_angle(slope.to_angle()).perp(),
            ];
            let rate = random.uniform(0.5, 2.0);
            let start = random.uniform(0.0, 6.0);
            let swing = random.uniform(0.5, 1.0);
            let (mut a, mut o, mut b) = (vec![], vec![], vec![]);
            for i in 0..30 {
                let t = i as f64 * 0.1;
                let pivot = DVec2::new(t, (t * 3.0).sin());
                let at = |angle: f64, length: f64| {
                    pivot + length * (angle.cos() * basis[0] + angle.sin() * basis[1])
                };
                o.push(pivot);
                a.push(at(start + swing * (rate * t).sin(), 0.4));
                b.push(at(start + 2.0 + swing * (rate * t).cos(), 0.45));
            }
            let fit = fit_hinge(&a, &o, &b, &FitOptions::default()).unwrap();
            let good = (fit.lengths[0] - 0.4).abs() < 1e-6 && (fit.lengths[1] - 0.45).abs() < 1e-6;
            if !good {
                missed += 1;
                println!("{tilt} {fit:?} {slope}");
            }
        }
        assert_eq!(missed, 0);
    }
}
