//! A plane of motion through the pivot, z = p x + q y.

use glam::{DMat2, DVec2, DVec3};

/// Plane z = p x + q y; x right, y down, z away from the camera.
///
/// In parallel projection it cannot be distinguished from its [mirror](Plane::mirror).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// dz/dx.
    pub p: f64,
    /// dz/dy.
    pub q: f64,
}

impl Plane {
    /// The plane of a slope (p, q).
    pub fn from_slope(slope: DVec2) -> Self {
        Self { p: slope.x, q: slope.y }
    }

    /// (p, q).
    pub fn slope(&self) -> DVec2 {
        DVec2::new(self.p, self.q)
    }

    /// The plane reflected about the image plane: the mirror solution of the same images.
    #[must_use]
    pub fn mirror(&self) -> Self {
        Self { p: -self.p, q: -self.q }
    }

    /// Depth of an image vector that starts at the pivot.
    pub fn depth(&self, image: DVec2) -> f64 {
        self.slope().dot(image)
    }

    /// The vector in space of an image vector that starts at the pivot.
    pub fn lift(&self, image: DVec2) -> DVec3 {
        image.extend(self.depth(image))
    }

    /// Standard deviation of the depth of an image vector (first order): from the slope with its covariance, and
    /// from the noise `noise_sd` of each coordinate of both ends.
    pub(super) fn depth_sd(&self, slope_covariance: DMat2, image: DVec2, noise_sd: f64) -> f64 {
        let of_slope = image.dot(slope_covariance * image);
        (of_slope + 2.0 * noise_sd * noise_sd * self.slope().length_squared()).sqrt()
    }

    /// Unit normal, towards the camera (z < 0).
    pub fn normal(&self) -> DVec3 {
        DVec3::new(self.p, self.q, -1.0).normalize()
    }

    /// Angle between the plane and the image plane, radians.
    pub fn tilt_rad(&self) -> f64 {
        self.slope().length().atan()
    }

    /// Angle between the normals of this plane and another or its mirror, whichever is nearer; radians.
    pub fn angle_up_to_mirror_rad(&self, other: &Self) -> f64 {
        let angle = |other: &Self| {
            let (a, b) = (self.normal(), other.normal());
            a.cross(b).length().atan2(a.dot(b))
        };
        angle(other).min(angle(&other.mirror()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lifted_vectors_lie_in_the_plane() {
        let plane = Plane { p: 0.7, q: -1.9 };
        for image in [DVec2::X, DVec2::Y, DVec2::new(-0.3, 0.8)] {
            assert!(plane.normal().dot(plane.lift(image)).abs() < 1e-15);
        }
        assert!((Plane { p: 0.0, q: 1.0 }.tilt_rad() - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
        assert_eq!(plane.angle_up_to_mirror_rad(&plane.mirror()), 0.0);
    }
}
