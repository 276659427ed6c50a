//! One rod: two points in planar motion.
//!
//! Source: Hoffman and Flinchbaugh 1982, Proposition 1 and appendix 1.

use super::Plane;
use super::fit::{self, FitError, FitOptions};
use glam::{DMat3, DVec2};

/// A rod fitted to three or more views.
#[derive(Debug, Clone, PartialEq)]
pub struct RodFit {
    /// Plane of the motion, or its mirror.
    pub plane: Plane,
    /// Length of the rod, in the unit of the points.
    pub length: f64,
    /// Covariance of (p, q, length): the noise given or the residuals, whichever is larger. Infinite where
    /// the views do not determine the plane. First order: meaningless for planes within a few degrees of
    /// parallel to the image.
    pub covariance: DMat3,
    /// Depth of the end relative to the pivot per view; NaN where a point is missing. Or all with the other
    /// sign.
    pub depth: Vec<f64>,
    /// Residual per view (distance in the image), outliers included; NaN where missing.
    pub residuals: Vec<f64>,
    /// Views left out as outliers.
    pub outliers: Vec<bool>,
    /// RMS of the residuals of the views used.
    pub residual_rms: f64,
    /// RMS distance of the image vector from its mean.
    pub motion: f64,
    /// Equations less unknowns; 0 = the views cannot contradict a plane.
    pub redundancy: usize,
    /// Whether the plane lies at the largest tilt allowed: length and depths are then lower bounds at best.
    pub at_tilt_limit: bool,
}

/// Fits a rod in planar motion to views of its two ends (any translation; NaN = not seen).
///
/// # Errors
/// Differing numbers of views, infinite positions, fewer than three views, no motion, senseless options.
pub fn fit_rod(pivot: &[DVec2], end: &[DVec2], options: &FitOptions) -> Result<RodFit, FitError> {
    let views = fit::views(pivot, [end])?;
    let fit = fit::fit(&views, options)?;
    let c = &fit.covariance;
    Ok(RodFit {
        plane: fit.plane,
        length: fit.lengths[0],
        covariance: DMat3::from_cols_array_2d(&std::array::from_fn(|i| std::array::from_fn(|j| c[(i, j)]))),
        depth: views.iter().map(|v| fit.plane.depth(v[0])).collect(),
        residuals: fit.residuals.iter().map(|r| r[0]).collect(),
        outliers: fit.outliers,
        residual_rms: fit.residual_rms,
        motion: fit.motion[0],
        redundancy: fit.redundancy,
        at_tilt_limit: fit.at_tilt_limit,
    })
}
