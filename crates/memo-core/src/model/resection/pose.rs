//! A pose of the head with its covariance, and the quantities derived from it.

use super::PaperView;
use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Matrix3x6, Matrix6, SMatrix, SVector};

/// Rotation vector (3), translation (3), focal length (1).
pub(super) type Matrix7 = SMatrix<f64, 7, 7>;
pub(super) type Vector7 = SVector<f64, 7>;
type Matrix3x7 = SMatrix<f64, 3, 7>;

/// A point with its first-order covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointEstimate {
    /// The point, in the unit of the head points.
    pub position: DVec3,
    /// Its covariance, in that unit squared.
    pub covariance: DMat3,
}

impl PointEstimate {
    /// Standard deviations along the axes.
    pub fn sd(&self) -> DVec3 {
        let c = self.covariance;
        DVec3::new(c.x_axis.x.sqrt(), c.y_axis.y.sqrt(), c.z_axis.z.sqrt())
    }
}

/// The facing direction of the head: the normal of the head plane, the head's x axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Unit vector in camera axes (x right, y down, z forward); it points towards -z for a face seen from the
    /// front.
    pub direction: DVec3,
    /// First-order covariance of the direction.
    pub covariance: DMat3,
    /// Standard deviation of the turn about the head's vertical, radians.
    pub turn_sd_rad: f64,
    /// Standard deviation of the nod about the head's left-right axis, radians.
    pub nod_sd_rad: f64,
}

impl Facing {
    /// Root mean square angle between the true direction and this direction, radians.
    pub fn sd_rad(&self) -> f64 {
        self.turn_sd_rad.hypot(self.nod_sd_rad)
    }
}

/// A least-squares pose of the head, in OpenCV axes.
#[derive(Debug, Clone, PartialEq)]
pub struct ResectedPose {
    /// Rotation of `camera_from_head`: x_cam = R x_head + t.
    pub rotation: DMat3,
    /// Translation of `camera_from_head`, in the unit of the head points.
    pub translation: DVec3,
    /// Focal lengths along u and v, image units.
    pub focal: DVec2,
    /// Whether the focal length was estimated.
    pub is_focal_free: bool,
    /// Projected minus measured point, image units, in the order of the points.
    pub residuals: Vec<DVec2>,
    /// Standard deviation of an image coordinate, given or estimated, image units.
    pub image_sd: f64,
    /// Sum of the squared residuals divided by `image_sd`²; about `degrees_of_freedom` if model and noise are
    /// correct. Carries no information if `image_sd` was estimated.
    pub chi_squared: f64,
    /// Number of image coordinates minus number of parameters.
    pub degrees_of_freedom: usize,
    /// Probability among the poses of a solution, with equal prior probabilities.
    pub probability: f64,
    /// Covariance of rotation vector w (in the head's frame, R -> R exp w), translation and focal length.
    pub(super) covariance: Matrix7,
}

impl ResectedPose {
    /// Covariance of (w, t): w is the rotation vector in the head's frame that turns R into R exp(w),
    /// radians.
    pub fn covariance(&self) -> Matrix6<f64> {
        self.covariance.fixed_view::<6, 6>(0, 0).into_owned()
    }

    /// Covariance of (w, t, f); the last row and column are zero if f was known.
    pub fn covariance_with_focal(&self) -> SMatrix<f64, 7, 7> {
        self.covariance
    }

    /// Standard deviation of the focal length, image units; zero if it was known.
    pub fn focal_sd(&self) -> f64 {
        self.covariance[(6, 6)].sqrt()
    }

    /// Root mean square length of the residuals, image units.
    pub fn residual_rms(&self) -> f64 {
        let sum: f64 = self.residuals.iter().map(|r| r.length_squared()).sum();
        (sum / self.residuals.len().max(1) as f64).sqrt()
    }

    /// A head point in camera axes, whether it was measured or not: q = R p + t, dq = R (w x p) + dt.
    pub fn point_in_camera(&self, point_in_head: DVec3) -> PointEstimate {
        let mut jacobian = Matrix3x7::zeros();
        jacobian.fixed_view_mut::<3, 6>(0, 0).copy_from(&point_jacobian(self.rotation, point_in_head));
        self.estimate(self.rotation * point_in_head + self.translation, jacobian)
    }

    /// The centre of projection in the head's frame: -Rᵀ t.
    pub fn camera_in_head(&self) -> PointEstimate {
        self.on_axis_in_head(0.0, false)
    }

    /// The paper's camera position, the origin on the image plane, in the head's frame: Rᵀ (f e_z - t).
    ///
    /// Meaningful if image and head have the same unit.
    pub fn paper_camera_in_head(&self) -> PointEstimate {
        self.on_axis_in_head(self.focal.x, self.is_focal_free)
    }

    /// The pose in the paper's terms, with f = `focal.x`.
    pub fn paper_view(&self) -> PaperView {
        PaperView::from_opencv(self.rotation, self.translation, self.focal.x)
    }

    /// A head point in the paper's camera frame: as [`Self::point_in_camera`] with y inverted and z reduced
    /// by f.
    pub fn point_in_paper_camera(&self, point_in_head: DVec3) -> PointEstimate {
        let mut jacobian = Matrix3x7::zeros();
        jacobian.fixed_view_mut::<3, 6>(0, 0).copy_from(&point_jacobian(self.rotation, point_in_head));
        jacobian.row_mut(1).neg_mut();
        jacobian[(2, 6)] = if self.is_focal_free { -1.0 } else { 0.0 };
        self.estimate(self.paper_view().point_in_paper_camera(point_in_head), jacobian)
    }

    /// The facing direction: n = R e_x, dn = R (w x e_x).
    pub fn facing(&self) -> Facing {
        let mut jacobian = point_jacobian(self.rotation, DVec3::X);
        jacobian.fixed_view_mut::<3, 3>(0, 3).fill(0.0);
        let covariance = jacobian * self.covariance() * jacobian.transpose();
        Facing {
            direction: self.rotation.x_axis,
            covariance: DMat3::from_cols_slice(covariance.as_slice()),
            turn_sd_rad: self.covariance[(1, 1)].sqrt(),
            nod_sd_rad: self.covariance[(2, 2)].sqrt(),
        }
    }

    /// c = Rᵀ (d e_z - t), dc = c x w + Rᵀ (e_z dd - dt).
    fn on_axis_in_head(&self, depth: f64, is_depth_focal: bool) -> PointEstimate {
        let transposed = self.rotation.transpose();
        let position = transposed * (DVec3::Z * depth - self.translation);
        let mut jacobian = Matrix3x7::zeros();
        for axis in 0..3 {
            let turn = position.cross(DVec3::AXES[axis]);
            let shift = -transposed.col(axis);
            for row in 0..3 {
                jacobian[(row, axis)] = turn[row];
                jacobian[(row, 3 + axis)] = shift[row];
                if is_depth_focal {
                    jacobian[(row, 6)] = transposed.z_axis[row];
                }
            }
        }
        self.estimate(position, jacobian)
    }

    fn estimate(&self, position: DVec3, jacobian: Matrix3x7) -> PointEstimate {
        let covariance = jacobian * self.covariance * jacobian.transpose();
        PointEstimate { position, covariance: DMat3::from_cols_slice(covariance.as_slice()) }
    }
}

/// Derivative of R exp(w) p + t with respect to (w, t) at w = 0.
pub(super) fn point_jacobian(rotation: DMat3, point: DVec3) -> Matrix3x6<f64> {
    let mut jacobian = Matrix3x6::zeros();
    for axis in 0..3 {
        let turn = rotation * DVec3::AXES[axis].cross(point);
        for row in 0..3 {
            jacobian[(row, axis)] = turn[row];
        }
        jacobian[(axis, 3 + axis)] = 1.0;
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::super::{Focal, ResectionOptions, resect};
    use super::*;
    use crate::posture::head::HeadModel;

    /// A head seen obliquely from 3 m, with point errors of a pixel.
    fn pose() -> ResectedPose {
        let model = HeadModel::lee_chen();
        let turn = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(0.2);
        let rotation = turn * DMat3::from_cols(DVec3::NEG_Z, DVec3::NEG_Y, DVec3::NEG_X);
        let focal = 1000.0;
        let image: Vec<DVec2> = model
            .points_m
            .iter()
            .map(|point| rotation * (*point - model.points_m[0]) + DVec3::new(0.2, -0.1, 3.0))
            .map(|q| focal * q.truncate() / q.z)
            .collect();
        let options = ResectionOptions { image_sd: Some(1.0), ..ResectionOptions::default() };
        let known = Focal::Known(DVec2::splat(focal));
        resect(&model.points_m, &image, known, &options).unwrap().best().clone()
    }

    /// The paper's axes invert y and shift z: the covariance is transformed in the same way.
    #[test]
    fn the_paper_s_axes_turn_the_covariance() {
        let pose = pose();
        let point = HeadModel::lee_chen().points_m[2];
        let (own, paper) = (pose.point_in_camera(point), pose.point_in_paper_camera(point));
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        let expected = mirror * own.covariance * mirror;
        assert!((paper.covariance - expected).abs_diff_eq(DMat3::ZERO, 1e-9 * expected.z_axis.z));
        assert!(expected.y_axis.z.abs() > 1e-3 * expected.z_axis.z, "{expected}");
        let shifted = mirror * own.position - DVec3::Z * pose.focal.x;
        assert!((paper.position - shifted).length() < 1e-9);
    }

    /// Turning moves the facing direction to the side of the head, nodding up and down.
    #[test]
    fn turning_and_nodding_are_the_facing_s_own_directions() {
        let pose = pose();
        let facing = pose.facing();
        let along = |axis: DVec3| axis.dot(facing.covariance * axis).sqrt();
        assert!((along(pose.rotation.z_axis) / facing.turn_sd_rad - 1.0).abs() < 1e-9);
        assert!((along(pose.rotation.y_axis) / facing.nod_sd_rad - 1.0).abs() < 1e-9);
        assert!((facing.turn_sd_rad / facing.nod_sd_rad - 1.0).abs() > 0.01, "{facing:?}");
        assert!(along(pose.rotation.x_axis) < 1e-9);
    }
}
