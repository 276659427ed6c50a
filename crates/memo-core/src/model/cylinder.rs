//! The only primitive of the body: a finite cylinder with elliptic cross section (Rohr 1994, section 3.1).

use glam::{DAffine3, DVec2, DVec3};

/// A solid elliptic cylinder in the world.
///
/// In the cylinder's own frame the axis is z, the centre is the origin and the solid is (x/a)² + (y/b)² <= 1,
/// |z| <= `half_length`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EllipticCylinder {
    /// Rigid pose: the columns are the cylinder's x, y and z axes in the world; the translation is its
    /// centre, metres.
    pub world_from_cylinder: DAffine3,
    /// Semi-axes (a, b) along the cylinder's x and y, metres.
    pub semi_axes: DVec2,
    /// Half the length along z, metres.
    pub half_length: f64,
}

impl EllipticCylinder {
    /// The centre in the world, metres.
    pub fn centre(&self) -> DVec3 {
        self.world_from_cylinder.translation
    }

    /// A world point in the cylinder's frame, metres (the pose is rigid, so the inverse rotation is the
    /// transpose).
    pub fn cylinder_from_world(&self, point_in_world: DVec3) -> DVec3 {
        self.world_from_cylinder.matrix3.transpose() * (point_in_world - self.world_from_cylinder.translation)
    }

    /// Whether a point lies inside or on the surface.
    pub fn contains(&self, point_in_world: DVec3) -> bool {
        let p = self.cylinder_from_world(point_in_world);
        p.z.abs() <= self.half_length && (p.truncate() / self.semi_axes).length_squared() <= 1.0
    }
}
