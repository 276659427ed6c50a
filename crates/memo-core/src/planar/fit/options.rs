//! Options of the fits, and their errors.

use crate::OptionError;
use thiserror::Error;

/// Why points in several views could not be fitted.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// The points have different numbers of views.
    #[error("the points must have as many views as each other, got {pivot} and {end}")]
    Lengths {
        /// Number of views of the pivot.
        pivot: usize,
        /// Number of views of the other point.
        end: usize,
    },
    /// A position is infinite.
    #[error("a position in view {view} is infinite; mark missing points with NaN")]
    Infinite {
        /// Index of the first such view.
        view: usize,
    },
    /// The points are so far apart or so close together that fourth powers overflow or underflow.
    #[error("the longest image vector is {largest}; use a unit in which it is nearer to 1")]
    Size {
        /// Length of the longest image vector.
        largest: f64,
    },
    /// Too few views show a rod.
    #[error("{needed} views of a rod's points are needed, got {found}")]
    TooFewViews {
        /// Number of views found.
        found: usize,
        /// Number of views needed.
        needed: usize,
    },
    /// The points do not move relative to each other, so every plane fits.
    #[error("the points do not move relative to each other (motion {motion})")]
    NoMotion {
        /// RMS motion of the rod that moves least.
        motion: f64,
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Options of the fits over many views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Standard deviation of each image coordinate of each point, in the unit of the points. With 0 the
    /// covariance comes from the residuals alone.
    pub noise_sd: f64,
    /// Largest tilt of the plane from the image plane, degrees. Default 80: nearer to edge-on the slope is only
    /// noise.
    pub max_tilt_deg: f64,
    /// A view is an outlier if a residual exceeds this many robust standard deviations (1.4826 median |residual|,
    /// at least that of the noise), first about the plane of the smallest median residual.
    pub outlier_sd: f64,
    /// Largest fraction of the views that may be excluded as outliers; if there are more, none is excluded. 0 =
    /// keep all.
    pub max_outlier_fraction: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { noise_sd: 0.0, max_tilt_deg: 80.0, outlier_sd: 4.5, max_outlier_fraction: 0.2 }
    }
}

impl FitOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let Self { noise_sd, max_tilt_deg, outlier_sd, max_outlier_fraction } = *self;
        OptionError::unless((0.0..=1e9).contains(&noise_sd), "noise_sd", "between 0 and 1e9", noise_sd)?;
        let is_tilt = max_tilt_deg > 0.0 && max_tilt_deg < 90.0;
        OptionError::unless(is_tilt, "max_tilt_deg", "more than 0 and less than 90", max_tilt_deg)?;
        OptionError::unless_positive("outlier_sd", outlier_sd)?;
        let (name, is_minority) = ("max_outlier_fraction", (0.0..=0.5).contains(&max_outlier_fraction));
        OptionError::unless(is_minority, name, "between 0 and 0.5", max_outlier_fraction)
    }
}
