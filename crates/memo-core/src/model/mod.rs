//! What a walker would show: camera, body, gait, contours and what hides what.

pub mod camera;
pub mod cylinder;

pub use camera::Camera;
pub use cylinder::EllipticCylinder;
