//! Roll and pitch of a camera.

use glam::{DMat3, DVec3};

/// How a camera is turned against a level one that looks along the horizon.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tilt {
    /// Rotation about the viewing direction, radians; positive if the camera is turned anticlockwise as seen from
    /// behind it, so that upright people lean to the right in the picture.
    pub roll_rad: f64,
    /// Downwards from the horizon, radians.
    pub pitch_rad: f64,
}

impl Tilt {
    /// The rotation from a level camera's axes to those of the tilted camera.
    pub fn rotation(&self) -> DMat3 {
        DMat3::from_rotation_z(self.roll_rad) * DMat3::from_rotation_x(self.pitch_rad)
    }

    /// The direction of gravity in the camera's axes.
    pub fn down(&self) -> DVec3 {
        self.rotation() * DVec3::Y
    }
}
