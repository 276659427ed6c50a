//! The linear solution (Lee and Chen 1985, eqs. (1)-(5)).
//!
//! ```text
//! (x, y, z, 1) [T] = (X, Y, H),  x' = X/H,  y' = Y/H                                                  (1)
//!
//!       |  a   b  -c/f |      | a b c |
//! [T] = |  g   h  -i/f |  [R] = | g h i |   fourth row  -(x0 y0 z0) [a b -c/f; g h -i/f; p q -r/f] + (0 0 1)
//!       |  p   q  -r/f |      | p q r |
//! ```
//!
//! Each point gives two equations (2) in the twelve elements of `[T]`; together they are A W = 0 (3). W is
//! the right singular vector of the smallest singular value of A: the exact solution for six points, the
//! least-squares solution for more.
//!
//! Limits: `[R]` is not constrained to be a rotation, and small heads magnify noise: the paper's own input,
//! printed to five digits, places the camera 4 cm off. With 1 px of noise on a head at 4 m and 480 px/m,
//! nearly half the solutions are refused and the others are off by some 3 m. For measured images use
//! [`super::resect`].

use super::{MIN_SHAPE_RATIO, ResectionError, Shape};
use super::{centroid_and_spread, checked_shape, nearest_rotation, right_svd};
use glam::{DMat3, DVec2, DVec3, DVec4};
use nalgebra::DMatrix;

/// Points needed by eq. (3).
pub(super) const LINEAR_POINTS: usize = 6;
/// Smallest allowed ratio of the last but one to the first singular value of A.
const MIN_RATIO: f64 = 1e-9;

/// The coordinates in which eq. (3) is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Conditioning {
    /// Centred and scaled to unit spread in head and image (Hartley 1997), which balances the equations.
    #[default]
    Normalised,
    /// Unchanged, as in the paper.
    AsPrinted,
}

/// The linear solution in the paper's letters, axes (left-handed, y up, origin on the image plane) and units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearResection {
    /// `[T]`: its columns are the coefficients of X, Y and H for (x, y, z, 1).
    pub transform: [DVec4; 3],
    /// `[R]` by eq. (4): columns (a, g, p), (b, h, q), (c, i, r). Orthonormal only without noise.
    pub rotation: DMat3,
    /// f in image units, from the norm of the third column.
    pub focal: f64,
    /// (x0, y0, z0) by eq. (5), in the head's frame. Meaningful only if image and head have the same unit.
    pub camera_position: DVec3,
    /// Ratio of the last but one to the first singular value of A: the smaller, the less `[T]` is determined.
    pub singular_ratio: f64,
    /// Determinant of `[R]`: 1 without noise.
    pub determinant: f64,
}

/// A camera in the paper's terms, from a pose in OpenCV axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperView {
    /// `[R]`.
    pub rotation: DMat3,
    /// (x0, y0, z0): the point at distance f in front of the centre of projection, in the head's frame.
    pub camera_position: DVec3,
    /// f, in the unit of head and image.
    pub focal: f64,
}

/// Eqs. (1)-(5) on six or more points.
///
/// `points_in_head` in any unit; `image_points` (x' right, **y' up**) relative to the principal point, in the
/// same unit if [`LinearResection::camera_position`] is to be meaningful. k of eq. (4) comes from the first
/// column; its sign is such that H > 0.
///
/// # Errors
///
/// Invalid, too few or coplanar points, configurations that leave `[T]` undetermined, and solutions that
/// place points behind the camera or mirror the head, which noise can cause.
pub fn linear_resection(
    points_in_head: &[DVec3],
    image_points: &[DVec2],
    conditioning: Conditioning,
) -> Result<LinearResection, ResectionError> {
    let shape = checked_shape("the linear solution", LINEAR_POINTS, points_in_head, image_points)?;
    if shape.ratios[1] < MIN_SHAPE_RATIO {
        return Err(ResectionError::Coplanar { ratio: shape.ratios[1] });
    }
    let [head_change, image_change] = match conditioning {
        Conditioning::Normalised => normalisations(&shape, image_points),
        Conditioning::AsPrinted => [Change::NONE; 2],
    };
    let head: Vec<DVec3> = points_in_head.iter().map(|p| head_change.apply(*p)).collect();
    let image: Vec<DVec2> =
        image_points.iter().map(|q| image_change.apply(q.extend(0.0)).truncate()).collect();
    let (solution, singular_ratio) = null_vector(&head, &image)?;
    let unscaled = undo_changes(solution, head_change, image_change);
    interpret(unscaled, points_in_head, singular_ratio)
}

/// x -> scale (x - origin).
#[derive(Clone, Copy)]
struct Change {
    origin: DVec3,
    scale: f64,
}

impl Change {
    const NONE: Self = Self { origin: DVec3::ZERO, scale: 1.0 };

    fn apply(self, point: DVec3) -> DVec3 {
        self.scale * (point - self.origin)
    }
}

fn normalisations(shape: &Shape, image_points: &[DVec2]) -> [Change; 2] {
    let (centroid, spread) = centroid_and_spread(image_points);
    [
        Change { origin: shape.centroid, scale: 1.0 / shape.radius },
        Change { origin: centroid.extend(0.0), scale: 1.0 / spread },
    ]
}

/// The columns of `[S]` with A W = 0, eq. (3), and the singular ratio, which shows whether the solution is
/// unique.
fn null_vector(head: &[DVec3], image: &[DVec2]) -> Result<([DVec4; 3], f64), ResectionError> {
    let mut equations = DMatrix::zeros(2 * head.len(), 12);
    for (i, (point, image)) in head.iter().zip(image).enumerate() {
        let homogeneous = point.extend(1.0).to_array();
        for (row, &x) in homogeneous.iter().enumerate() {
            // Eq. (2): (x, y, z, 1) (T_1 - x' T_3) = 0, (x, y, z, 1) (T_2 - y' T_3) = 0.
            equations[(2 * i, 3 * row)] = x;
            equations[(2 * i, 3 * row + 2)] = -x * image.x;
            equations[(2 * i + 1, 3 * row + 1)] = x;
            equations[(2 * i + 1, 3 * row + 2)] = -x * image.y;
        }
    }
    let undetermined = |ratio| ResectionError::Undetermined { ratio, needed: MIN_RATIO };
    let (sigma, v_t) = right_svd(equations).ok_or_else(|| undetermined(0.0))?;
    let ratio = sigma[10] / sigma[0];
    if ratio.is_nan() || ratio < MIN_RATIO {
        return Err(undetermined(ratio));
    }
    let column = |c: usize| DVec4::from_array(std::array::from_fn(|row| v_t[(11, 3 * row + c)]));
    Ok(([column(0), column(1), column(2)], ratio))
}

/// `[S]` in the original coordinates.
///
/// With p~ = s (p - o): p~ S = s p S_123 + (S_4 - s o S_123). With q~ = s' (q - o'): X = X~ / s' + o' H.
fn undo_changes(solution: [DVec4; 3], head: Change, image: Change) -> [DVec4; 3] {
    let [x, y, h] = solution.map(|column| {
        let direction = head.scale * column.truncate();
        direction.extend(column.w - direction.dot(head.origin))
    });
    [x / image.scale + image.origin.x * h, y / image.scale + image.origin.y * h, h]
}

/// Eqs. (4) and (5).
fn interpret(
    columns: [DVec4; 3],
    points_in_head: &[DVec3],
    singular_ratio: f64,
) -> Result<LinearResection, ResectionError> {
    let scale_of = |p: &DVec3| columns[2].dot(p.extend(1.0));
    let sum: f64 = points_in_head.iter().map(scale_of).sum();
    let k = sum.signum() / columns[0].truncate().length();
    let transform = columns.map(|column| column * k);
    let focal = transform[2].truncate().length().recip();
    if !(k.is_finite() && focal.is_finite()) {
        return Err(ResectionError::Undetermined { ratio: 0.0, needed: MIN_RATIO });
    }
    for (index, point) in points_in_head.iter().enumerate() {
        let scale = k * scale_of(point);
        if scale <= 0.0 {
            return Err(ResectionError::BehindCamera { index, scale });
        }
    }
    let [first, second, third] = transform.map(|column| column.truncate());
    let rotation = DMat3::from_cols(first, second, -focal * third);
    let determinant = rotation.determinant();
    if determinant.is_nan() || determinant <= 0.0 {
        return Err(ResectionError::Mirrored { determinant });
    }
    let [t41, t42, t44] = transform.map(|column| column.w);
    let camera_position = rotation * DVec3::new(-t41, -t42, (t44 - 1.0) * focal);
    Ok(LinearResection { transform, rotation, focal, camera_position, singular_ratio, determinant })
}

impl LinearResection {
    /// A head point in the paper's camera frame, as in Table 2(d).
    pub fn point_in_paper_camera(&self, point_in_head: DVec3) -> DVec3 {
        self.view().point_in_paper_camera(point_in_head)
    }

    /// Rotation, position and focal length together.
    pub fn view(&self) -> PaperView {
        PaperView { rotation: self.rotation, camera_position: self.camera_position, focal: self.focal }
    }

    /// `camera_from_head` in OpenCV axes: x_cam = M x_head + t with t in head units. M is as orthonormal as
    /// `[R]`.
    pub fn camera_from_head(&self) -> (DMat3, DVec3) {
        let [t41, t42, t44] = self.transform.map(|column| column.w);
        (opencv_rows(self.rotation), DVec3::new(t41, -t42, t44 * self.focal))
    }

    /// The rotation of `camera_from_head`, OpenCV axes, nearest to `[R]`; `None` if the decomposition fails.
    pub fn nearest_rotation(&self) -> Option<DMat3> {
        nearest_rotation(opencv_rows(self.rotation))
    }
}

/// Rows (a g p), -(b h q), -(c i r): the paper's camera axes with y down and z forward.
fn opencv_rows(rotation: DMat3) -> DMat3 {
    DMat3::from_cols(rotation.x_axis, -rotation.y_axis, -rotation.z_axis).transpose()
}

impl PaperView {
    /// From a pose x_cam = R x_head + t in OpenCV axes: (x0, y0, z0) = Rᵀ (f e_z - t).
    pub fn from_opencv(rotation: DMat3, translation: DVec3, focal: f64) -> Self {
        let axes = rotation.transpose();
        Self {
            rotation: DMat3::from_cols(axes.x_axis, -axes.y_axis, -axes.z_axis),
            camera_position: axes * (DVec3::Z * focal - translation),
            focal,
        }
    }

    /// A head point in the paper's camera frame: ((x, y, z) - (x0, y0, z0)) `[R]` with the third axis
    /// inverted.
    pub fn point_in_paper_camera(&self, point_in_head: DVec3) -> DVec3 {
        let turned = self.rotation.transpose() * (point_in_head - self.camera_position);
        turned * DVec3::new(1.0, 1.0, -1.0)
    }

    /// `[T]` of this camera, as columns.
    pub fn transform(&self) -> [DVec4; 3] {
        let [a, b, c] = [self.rotation.x_axis, self.rotation.y_axis, -self.rotation.z_axis / self.focal];
        let column = |axis: DVec3, constant: f64| axis.extend(constant - axis.dot(self.camera_position));
        [column(a, 0.0), column(b, 0.0), column(c, 1.0)]
    }

    /// (x', y') of a head point by eq. (1), y' up; `None` behind the centre of projection.
    pub fn project(&self, point_in_head: DVec3) -> Option<DVec2> {
        let [x, y, h] = self.transform().map(|column| column.dot(point_in_head.extend(1.0)));
        (h > 0.0).then(|| DVec2::new(x, y) / h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Points in front of a camera at the origin of the OpenCV axes, image y up.
    fn seen(points: &[DVec3], (rotation, translation): (DMat3, DVec3), focal: f64) -> Vec<DVec2> {
        let project = |p: &DVec3| {
            let q = rotation * *p + translation;
            focal * DVec2::new(q.x, -q.y) / q.z
        };
        points.iter().map(project).collect()
    }

    fn box_corners() -> Vec<DVec3> {
        let side = [-1.0, 1.0];
        side.iter().flat_map(|x| side.map(|y| side.map(|z| DVec3::new(*x, y, z)))).flatten().collect()
    }

    #[test]
    fn both_frames_project_alike() {
        let rotation = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_z(-2.0);
        let translation = DVec3::new(0.3, -0.8, 9.0);
        let view = PaperView::from_opencv(rotation, translation, 2.5);
        for (point, image) in
            box_corners().into_iter().zip(seen(&box_corners(), (rotation, translation), 2.5))
        {
            assert!((view.project(point).unwrap() - image).length() < 1e-14);
            let in_opencv = rotation * point + translation;
            let expected = DVec3::new(in_opencv.x, -in_opencv.y, in_opencv.z - 2.5);
            assert!((view.point_in_paper_camera(point) - expected).length() < 1e-14);
        }
        assert_eq!(view.project(rotation.transpose() * (DVec3::NEG_Z * 20.0 - translation)), None);
    }

    #[test]
    fn bad_points_are_refused_with_their_values() {
        let points = box_corners();
        let image = seen(&points, (DMat3::IDENTITY, DVec3::Z * 8.0), 1.0);
        let solve =
            |points: &[DVec3], image: &[DVec2]| linear_resection(points, image, Conditioning::Normalised);
        assert!(matches!(
            solve(&points[..5], &image[..5]),
            Err(ResectionError::TooFewPoints { count: 5, needed: 6, .. })
        ));
        let flat: Vec<DVec3> = (0..7).map(|i| DVec3::new(f64::from(i), f64::from(i * i), 1.0)).collect();
        let flat_image = seen(&flat, (DMat3::from_rotation_x(0.3), DVec3::Z * 99.0), 1.0);
        assert!(
            matches!(solve(&flat, &flat_image), Err(ResectionError::Coplanar { ratio }) if ratio < 1e-12)
        );
    }

    /// Points on a twisted cubic through the centre of projection: every camera on the cubic gets the same
    /// image.
    #[test]
    fn a_critical_curve_is_recognised() {
        let cubic = |t: f64| DVec3::new(t, t * t, t * t * t);
        let points: Vec<DVec3> = (2..10).map(|i| cubic(0.2 * f64::from(i))).collect();
        let forward = DVec3::ONE.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let error =
            linear_resection(&points, &seen(&points, (rotation, DVec3::ZERO), 1.0), Conditioning::Normalised);
        assert!(
            matches!(error, Err(ResectionError::Undetermined { ratio, .. }) if ratio < 1e-12),
            "{error:?}"
        );
    }

    /// A mirrored image of points is not an image of the points.
    #[test]
    fn mirrored_images_are_refused() {
        let points = box_corners();
        let pose = (DMat3::from_rotation_y(0.4), DVec3::Z * 8.0);
        let image: Vec<DVec2> = seen(&points, pose, 1.0).iter().map(|q| DVec2::new(-q.x, q.y)).collect();
        let error = linear_resection(&points, &image, Conditioning::Normalised);
        assert!(
            matches!(error, Err(ResectionError::Mirrored { determinant }) if determinant < -0.9),
            "{error:?}"
        );
    }

    /// Points seen by a camera in their midst, some of them behind the centre of projection.
    #[test]
    fn points_behind_the_camera_are_refused() {
        let points: Vec<DVec3> =
            box_corners().iter().map(|p| *p * DVec3::new(1.0, 1.2, 1.0) + DVec3::Z * 0.3 * p.x).collect();
        let pose = (DMat3::from_rotation_y(0.4), DVec3::new(0.1, 0.05, 0.2));
        let error = linear_resection(&points, &seen(&points, pose, 1.0), Conditioning::Normalised);
        assert!(matches!(error, Err(ResectionError::BehindCamera { scale, .. }) if scale < 0.0), "{error:?}");
    }

    proptest! {
        /// Without noise both kinds of conditioning recover the camera, from shapes with a flatness down to a
        /// hundredth.
        #[test]
        fn a_planted_camera_is_recovered(
            shape in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 6..12),
            flatness in -2.0..0.0_f64,
            turn in prop::array::uniform3(-3.0..3.0_f64),
            (x, y, depth, focal) in (-1.0..1.0_f64, -1.0..1.0_f64, 4.0..20.0_f64, 0.5..5.0_f64),
        ) {
            let points: Vec<DVec3> =
                shape.iter().map(|p| DVec3::from(*p) * DVec3::new(1.0, 1.0, 10_f64.powf(flatness))).collect();
            let rotation = DMat3::from_rotation_z(turn[0])
                * DMat3::from_rotation_x(turn[1])
                * DMat3::from_rotation_z(turn[2]);
            let truth = (rotation, DVec3::new(x, y, depth));
            let image = seen(&points, truth, focal);
            for conditioning in [Conditioning::Normalised, Conditioning::AsPrinted] {
                let linear = linear_resection(&points, &image, conditioning);
                // Six points can be close to a critical curve by chance.
                prop_assume!(linear.as_ref().is_ok_and(|l| l.singular_ratio > 1e-5));
                let linear = linear.unwrap();
                let tolerance = 1e-12 / linear.singular_ratio;
                let view = PaperView::from_opencv(rotation, truth.1, focal);
                prop_assert!((linear.focal / focal - 1.0).abs() < tolerance);
                prop_assert!(linear.camera_position.distance(view.camera_position) < depth * tolerance);
                prop_assert!((linear.determinant - 1.0).abs() < tolerance);
                let (matrix, translation) = linear.camera_from_head();
                prop_assert!((matrix - rotation).to_cols_array().iter().all(|d| d.abs() < tolerance));
                prop_assert!(translation.distance(truth.1) < depth * tolerance);
                let nearest = linear.nearest_rotation().unwrap();
                prop_assert!((nearest - rotation).to_cols_array().iter().all(|d| d.abs() < tolerance));
                prop_assert!((nearest.determinant() - 1.0).abs() < 1e-12);
            }
        }
    }
}
