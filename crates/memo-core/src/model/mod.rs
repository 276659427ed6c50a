//! What a walker would show: camera, body, gait, contours and what hides what.

pub mod body;
pub mod camera;
pub mod cylinder;
pub mod gait;
pub mod spline;

pub use body::{Body, PosedBody, Proportions, SideJoints, Walker};
pub use camera::Camera;
pub use cylinder::EllipticCylinder;
pub use gait::{Gait, GaitStyle, Posture, SideAngles};
