//! Camera calibration from an image: from measured points, from a person who walks, or from vertical lines.
//!
//! | function | needs | undetermined |
//! |---|---|---|
//! | [`camera_from_points`] | six points with measured positions, four in a plane | what the points leave open |
//! | [`camera_from_walker`] | a person of known height at several distances | the direction of the world's X axis |
//! | [`camera_tilt`] | upright lines, the focal length | all but roll and pitch |
//!
//! [`camera_from_points`]: crate::camera_from_points
//! [`camera_from_walker`]: crate::camera_from_walker
//! [`camera_tilt`]: crate::camera_tilt
//!
//! The first two fit by least squares and return the covariance of the fitted parameters. Pixels are assumed to be
//! square.

pub(crate) mod points;
pub(crate) mod tilt;
pub(crate) mod walker;

pub use points::{KnownLens, PointCalibration, PointError, PointOptions};
pub use tilt::{TiltError, TiltEstimate, tilt_of_lines};
pub use walker::{WalkerCalibration, WalkerError, WalkerOptions, WalkerSighting, sightings_from_joints};

/// The focal length is determined if its relative standard deviation is below this.
const MAX_FOCAL_SD: f64 = 0.25;
/// A point or sighting is left out if, by chance, the largest of all errors would be as large less often than this.
const CHANCE: f64 = 0.01;

/// A fitted parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Name of the parameter, with its unit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard deviation, in the same unit.
    pub sd: f64,
}
