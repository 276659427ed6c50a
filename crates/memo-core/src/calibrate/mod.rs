//! A camera from what its picture shows: measured points, or a person who walks.
//!
//! | function | needs | leaves open |
//! |---|---|---|
//! | [`camera_from_points`] | six points whose places are measured, four in a plane | nothing but what they do not show |
//! | [`camera_from_walker`] | a person of known height at several distances | where the world's X axis points |
//!
//! Both fit by least squares and give the covariance of what they fitted. Pixels are taken as square.

pub mod points;
pub mod walker;

pub use points::{KnownLens, PointCalibration, PointError, PointOptions, camera_from_points};
pub use walker::{
    Sighting, WalkerCalibration, WalkerError, WalkerOptions, camera_from_walker, sightings_from_joints,
};

/// A fitted number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// What it is, with its unit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sd: f64,
}
