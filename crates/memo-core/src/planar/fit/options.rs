//! Options of the fits, and why points cannot be fitted.

use crate::option_error::OptionError;
use thiserror::Error;

/// Why points in several views could not be fitted.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// Every point needs one position a view.
    #[error("the points must have as many views as each other, got {pivot} and {end}")]
    Lengths {
        /// Views of the pivot.
        pivot: usize,
        /// Views of the other point.
        end: usize,
    },
    /// A position is infinite.
    #[error("a position in view {view} is infinite; mark missing points with NaN")]
    Infinite {
        /// First such view.
        view: usize,
    },
    /// The points lie so far apart or so near each other that fourth powers leave the range of numbers.
    #[error("the longest image vector is {largest}; use a unit in which it is nearer to 1")]
    Size {
        /// Length of the longest image vector.
        largest: f64,
    },
    /// Too few views show a rod.
    #[error("{needed} views of a rod's points are needed, got {found}")]
    TooFewViews {
        /// Views found.
        found: usize,
        /// Views needed.
        needed: usize,
    },
    /// The points do not move relative to each other: every plane fits.
    #[error("the points do not move relative to each other (motion {motion})")]
    NoMotion {
        /// RMS motion of the least moving rod.
        motion: f64,
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Options of the fits over many views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Standard deviation of each image coordinate of each point, in the unit of the points. 0 is allowed:
    /// the covariance then comes from the residuals alone.
    pub noise_sd: f64,
    /// Largest tilt of the plane against the image, degrees. 80: nearer to edge-on the slope is noise.
    pub max_tilt_deg: f64,
    /// A view is an outlier when a residual exceeds this many robust standard deviations (1.4826 median
    /// |residual|, at least that of the noise), first about the plane of least median residual.
    pub outlier_sd: f64,
    /// Largest fraction of the views that may be left out as outliers; with more, none is. 0 = keep all.
    pub max_outlier_fraction: f64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { noise_sd: 0.0, max_tilt_deg: 80.0, outlier_sd: 4.5, max_outlier_fraction: 0.2 }
    }
}

impl FitOptions {
    pub(super) fn check(&self) -> Result<(), FitError> {
        let positive = "positive and finite";
        let checks = [
            ("noise_sd", "finite and not negative", self.noise_sd, self.noise_sd >= 0.0),
            (
                "max_tilt_deg",
                "in (0, 90)",
                self.max_tilt_deg,
                self.max_tilt_deg > 0.0 && self.max_tilt_deg < 90.0,
            ),
            ("outlier_sd", positive, self.outlier_sd, self.outlier_sd > 0.0),
            (
                "max_outlier_fraction",
                "in [0, 0.5]",
                self.max_outlier_fraction,
                (0.0..=0.5).contains(&self.max_outlier_fraction),
            ),
        ];
        for (name, wanted, value, is_good) in checks {
            OptionError::unless(is_good && value.is_finite(), name, wanted, value)?;
        }
        Ok(())
    }
}
