//! The camera: full perspective projection with lens distortion (Rohr 1994, eq. 2).

use glam::{DMat3, DVec2, DVec3};

/// A calibrated camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Image width and height, pixels.
    pub size: [u32; 2],
    /// Focal lengths (fx, fy), pixels.
    pub focal_px: DVec2,
    /// Principal point (cx, cy), pixels.
    pub centre_px: DVec2,
    /// Rotation of `x_cam = R x_world + t`.
    pub rotation: DMat3,
    /// Translation of `x_cam = R x_world + t`, metres.
    pub translation: DVec3,
}

impl Camera {
    /// A world point in the camera's axes (x right, y down, z forward), metres.
    pub fn camera_from_world(&self, point_in_world: DVec3) -> DVec3 {
        self.rotation * point_in_world + self.translation
    }

    /// The centre of projection in the world, metres.
    pub fn position(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// The ideal (distortion-free) pixel of a world point, `None` behind the camera.
    pub fn project_ideal(&self, point_in_world: DVec3) -> Option<DVec2> {
        let p = self.camera_from_world(point_in_world);
        (p.z > 1e-9).then(|| p.truncate() / p.z * self.focal_px + self.centre_px)
    }
}
