//! Camera calibration from an image: from measured points, or from a person who walks.
//!
//! | function | needs | undetermined |
//! |---|---|---|
//! | [`camera_from_points`] | six points with measured positions, four in a plane | only what the points do
//! not determine |
//! | [`camera_from_walker`] | a person of known height at several distances | the direction of the world's X
//! axis |
//!
//! Both fit by least squares and return the covariance of the fitted parameters. Pixels are assumed to be
//! square.

pub mod points;
pub mod walker;

pub use points::{KnownLens, PointCalibration, PointError, PointOptions, camera_from_points};
pub use walker::{
    WalkerCalibration, WalkerError, WalkerOptions, WalkerSighting, camera_from_walker, sightings_from_joints,
};

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
