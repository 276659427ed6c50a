//! From an image point to the two possible positions of its joint (Lee and Chen 1985, section 2.2, eqs. 6-7).
//!
//! Axes are the camera's (OpenCV: x right, y down, z forward). The paper's camera is left-handed with y up, which
//! changes neither the equation nor its roots. Instead of the paper's k along the image point, the unknown is the
//! distance along a unit ray: it gives the same two points and is well conditioned at any focal length.

use glam::{DVec2, DVec3};

use crate::model::camera::{Camera, CameraError};
use crate::model::skeleton::{JOINT_COUNT, Joint, PerJoint};

/// Rays and weights of the joints in one view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRays {
    /// Unit vectors from the camera through the joints, camera axes; NaN if a joint is not seen.
    pub ray: PerJoint<DVec3>,
    /// Weights of the joints, 0 to 1: a detector's scores, 1 for a measured point.
    pub weight: PerJoint<f64>,
    /// Standard deviation of a joint across its ray, as an angle, radians: that of a pixel divided by the focal
    /// length.
    pub noise_rad: f64,
}

impl JointRays {
    /// The rays of the pixels at which a camera shows the joints (NaN: not seen).
    ///
    /// `noise_px` is the standard deviation of a pixel coordinate. An infinite pixel, or a pixel to which the
    /// lens maps nothing, is an error.
    pub fn from_pixels(
        camera: &Camera,
        pixels: &PerJoint<DVec2>,
        weight: &PerJoint<f64>,
        noise_px: f64,
    ) -> Result<Self, CameraError> {
        let mut ray = PerJoint([DVec3::NAN; JOINT_COUNT]);
        for joint in Joint::ALL {
            if pixels[joint].is_nan() {
                continue;
            }
            let ideal_px = camera.undistort(pixels[joint])?;
            ray[joint] = ((ideal_px - camera.centre_px) / camera.focal_px).extend(1.0).normalize();
        }
        Ok(Self {
            ray,
            weight: *weight,
            noise_rad: noise_px / (camera.focal_px.x * camera.focal_px.y).sqrt(),
        })
    }

    /// Rays to points in camera axes, for exact data.
    pub fn from_points(points_in_camera: &PerJoint<DVec3>) -> Self {
        Self {
            ray: PerJoint(points_in_camera.0.map(DVec3::normalize)),
            weight: PerJoint([1.0; JOINT_COUNT]),
            noise_rad: 0.0,
        }
    }

    /// True if a joint is seen.
    pub fn sees(&self, joint: Joint) -> bool {
        !self.ray[joint].is_nan()
    }
}

/// Number of possible positions of a segment's ending joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RootKind {
    /// Two.
    Two,
    /// One: the segment is perpendicular to the ray, or nearly (the paper's degenerate case).
    Degenerate,
    /// None: the distance of the ray from the starting joint is greater than the length. The nearest point on the
    /// ray is used instead.
    None {
        /// Distance of the nearest point on the ray, less the length, metres.
        gap_m: f64,
    },
}

/// The possible positions of an ending joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roots {
    /// The position nearer to the camera.
    pub near: DVec3,
    /// The position farther from it; the same as `near` if there is only one.
    pub far: DVec3,
    /// Number of positions.
    pub kind: RootKind,
    /// Standard deviation of the segment's extent along the ray, metres, from the noise of its two image points.
    pub sd_m: f64,
}

impl Roots {
    /// The positions and their number, two or one.
    pub fn candidates(&self) -> ([DVec3; 2], usize) {
        let count = if self.kind == RootKind::Two { 2 } else { 1 };
        ([self.near, self.far], count)
    }
}

/// Solves eq. (7) for an ending joint on a unit ray, a known length from its starting joint.
///
/// ```text
/// l_se² = |x_s - k r|²   =>   k = x_s·r ± sqrt(l_se² - d²),   d² = |x_s|² - (x_s·r)²
/// ```
///
/// Roots closer together than `merge_m` are merged into their middle. A root behind the camera (k <= 0) does not
/// count. `noise_rad` is the noise of an image point as an angle.
pub fn roots(start: DVec3, ray: DVec3, length_m: f64, noise_rad: f64, merge_m: f64) -> Roots {
    let middle = start.dot(ray);
    let across = (start - middle * ray).length();
    let half_sq = (length_m - across) * (length_m + across);
    let half = half_sq.max(0.0).sqrt();
    let noise_m = std::f64::consts::SQRT_2 * noise_rad * start.length();
    let sd_m = extent_sd(half, across, noise_m);
    let at = |k: f64| k * ray;
    let one = |k: f64, kind| Roots { near: at(k), far: at(k), kind, sd_m };
    if half_sq < 0.0 {
        return one(middle.max(0.0), RootKind::None { gap_m: across - length_m });
    }
    if middle + half <= 0.0 {
        return one(0.0, RootKind::None { gap_m: start.length() - length_m });
    }
    if middle - half <= 0.0 {
        return one(middle + half, RootKind::Degenerate);
    }
    if 2.0 * half <= merge_m {
        return one(middle, RootKind::Degenerate);
    }
    Roots { near: at(middle - half), far: at(middle + half), kind: RootKind::Two, sd_m }
}

/// Standard deviation of a segment's extent h = sqrt(l² - d²) along the ray, for an error e of d or of l.
///
/// The error has the largest effect if the segment is nearly perpendicular to the ray. sqrt(h² + 2 d e + e²) - h
/// is d e / h for small errors and stays finite at h = 0.
pub fn extent_sd(extent_m: f64, across_m: f64, error_m: f64) -> f64 {
    (extent_m * extent_m + 2.0 * across_m * error_m + error_m * error_m).sqrt() - extent_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The paper's own form: x' and k of eq. (6) in its left-handed camera with the image plane at f.
        #[test]
        fn roots_are_those_of_the_papers_quadratic(
            sx in -1.0..1.0_f64, sy in -1.0..1.0_f64, sz in 2.0..8.0_f64,
            dx in -0.3..0.3_f64, dy in -0.3..0.3_f64, dz in -0.3..0.3_f64,
        ) {
            let (start, step) = (DVec3::new(sx, sy, sz), DVec3::new(dx, dy, dz));
            let end = start + step;
            let length = step.length();
            prop_assume!(length > 1e-3);
            let f = 0.05;
            // Eq. (6b): z_e = f (k - 1), with the paper's origin at the image plane, f in front of the lens.
            let (xs, ys, zs) = (start.x, -start.y, start.z - f);
            let (xp, yp) = (f * end.x / end.z, f * -end.y / end.z);
            let a = xp * xp + yp * yp + f * f;
            let b = -2.0 * (xs * xp + ys * yp + f * (zs + f));
            let c = xs * xs + ys * ys + (zs + f) * (zs + f) - length * length;
            let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
            let depth = |k: f64| f * (k - 1.0) + f;
            let found = roots(start, end.normalize(), length, 0.0, 0.0);
            let conditioning = 1e-9 + 1e-12 / (found.far - found.near).length().max(1e-6);
            prop_assert!((depth((-b - root) / (2.0 * a)) - found.near.z).abs() < 1e3 * conditioning);
            prop_assert!((depth((-b + root) / (2.0 * a)) - found.far.z).abs() < 1e3 * conditioning);
            let nearer = found.near.distance(end).min(found.far.distance(end));
            prop_assert!(nearer < 1e3 * conditioning, "{nearer}");
        }
    }

    #[test]
    fn a_segment_too_short_gives_the_nearest_point_and_the_gap() {
        let start = DVec3::new(0.0, 0.0, 4.0);
        let ray = DVec3::new(0.2, 0.0, 1.0).normalize();
        let found = roots(start, ray, 0.5, 0.0, 0.0);
        let RootKind::None { gap_m } = found.kind else { panic!("{found:?}") };
        assert!((found.near.distance(start) - 0.5 - gap_m).abs() < 1e-12);
        assert!((found.near - start).dot(ray).abs() < 1e-12);
    }

    /// Monte Carlo: the spread of the extent along the ray is the stated one, away from the degenerate case.
    #[test]
    fn noise_of_the_image_reaches_the_depth_as_stated() {
        let (start, end) = (DVec3::new(0.1, 0.2, 4.0), DVec3::new(0.3, 0.3, 4.25));
        let length = start.distance(end);
        let noise_rad = 2e-4;
        let stated = roots(start, end.normalize(), length, noise_rad, 0.0).sd_m;
        let mut random = crate::synth::Random::new(3);
        let mut draw = |p: DVec3| {
            let [a, b] = random.normal_pair().map(f64::from);
            (p / p.z + noise_rad * DVec3::new(a, b, 0.0)).normalize()
        };
        let extents: Vec<f64> = (0..4000)
            .map(|_| {
                let start = draw(start) * start.length();
                let found = roots(start, draw(end), length, 0.0, 0.0);
                (found.far - found.near).length() / 2.0
            })
            .collect();
        let mean = extents.iter().sum::<f64>() / extents.len() as f64;
        let sd = (extents.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / extents.len() as f64).sqrt();
        assert!((sd / stated - 1.0).abs() < 0.1, "measured {sd}, stated {stated}");
    }

    /// Only positions in front of the camera count. With the start one metre ahead and a ray to the side, a long
    /// segment has one end in front of the camera and one behind it; a ray away from the start has none.
    #[test]
    fn roots_behind_the_camera_do_not_count() {
        let start = DVec3::new(0.0, 0.0, 1.0);
        let aside = DVec3::new(0.8, 0.0, 0.6);
        // k = 0.6 ± sqrt(1.5² - 0.8²), of which the nearer one is behind.
        let beyond = (1.5f64 * 1.5 - 0.8 * 0.8).sqrt();
        let one = roots(start, aside, 1.5, 0.0, 0.0);
        assert_eq!(one.kind, RootKind::Degenerate);
        assert!((one.near - (0.6 + beyond) * aside).length() < 1e-12 && one.far == one.near);
        assert_eq!(one.candidates().1, 1);
        let both = roots(start, aside, 0.9, 0.0, 0.0);
        assert_eq!((both.kind, both.candidates().1), (RootKind::Two, 2));
        // Away from the start: both roots are behind, and the camera itself is the nearest point of the ray, 1 m
        // off.
        let away = DVec3::new(0.8, 0.0, -0.6);
        let none = roots(start, away, 0.9, 0.0, 0.0);
        assert_eq!(none.near, DVec3::ZERO);
        let RootKind::None { gap_m } = none.kind else { panic!("{:?}", none.kind) };
        assert!((gap_m - 0.1).abs() < 1e-12);
        // The same if the segment is too short to reach the line of the ray.
        let short = roots(start, away, 0.5, 0.0, 0.0);
        assert_eq!(short.near, DVec3::ZERO);
        assert!(matches!(short.kind, RootKind::None { .. }));
    }

    /// Roots within the limit are merged into their middle; roots farther apart are not.
    #[test]
    fn roots_merge_within_the_distance_between_them() {
        let (start, ray) = (DVec3::new(0.3, 0.0, 3.0), DVec3::Z);
        // The roots lie 2 sqrt(0.5² - 0.3²) = 0.8 apart.
        let merged = roots(start, ray, 0.5, 0.0, 0.81);
        assert_eq!(merged.kind, RootKind::Degenerate);
        assert!((merged.near - 3.0 * ray).length() < 1e-12);
        assert_eq!(roots(start, ray, 0.5, 0.0, 0.79).kind, RootKind::Two);
    }

    /// If the segment is perpendicular to the ray, a longer one reaches sqrt((l + e)² - l²) along it. Elsewhere a
    /// small error e of the distance across changes sqrt(l² - d²) by d e / sqrt(l² - d²).
    #[test]
    fn the_noise_of_an_extent_is_that_of_a_side_of_its_triangle() {
        for error in [1e-3, 0.01, 0.1] {
            let reached = ((0.5 + error) * (0.5 + error) - 0.25f64).sqrt();
            assert!((extent_sd(0.0, 0.5, error) - reached).abs() < 1e-12);
        }
        for across in [0.1, 0.3, 0.48] {
            let extent = |across: f64| (0.25 - across * across).sqrt();
            let change = extent(across - 1e-6) - extent(across + 1e-6);
            assert!((extent_sd(extent(across), across, 1e-6) / (0.5 * change) - 1.0).abs() < 1e-4);
        }
    }

    /// Rays of pixels are undistorted, and their noise is that of a pixel divided by the focal length.
    #[test]
    fn rays_of_pixels_undo_the_lens() {
        let mut camera = Camera::level([1280, 720], 1.0, 1.2, 4.0).unwrap();
        camera.distortion =
            crate::model::Distortion::Brown { k1: -0.2, k2: 0.05, p1: 0.001, p2: -0.002, k3: 0.0 };
        camera.focal_px = DVec2::new(1000.0, 1210.0);
        let mut points = PerJoint([DVec3::NAN; JOINT_COUNT]);
        let mut pixels = PerJoint([DVec2::NAN; JOINT_COUNT]);
        for (i, joint) in Joint::ALL.into_iter().enumerate().skip(1) {
            points[joint] = DVec3::new(0.2 * i as f64 - 1.2, 0.1 * i as f64, 1.0 + 0.05 * i as f64);
            pixels[joint] = camera.project(points[joint]).unwrap();
        }
        let rays = JointRays::from_pixels(&camera, &pixels, &PerJoint([0.5; JOINT_COUNT]), 2.2).unwrap();
        for joint in Joint::ALL.into_iter().skip(1) {
            let truth = camera.camera_from_world(points[joint]).normalize();
            assert!((rays.ray[joint] - truth).length() < 1e-9, "{joint:?}");
        }
        assert!(!rays.sees(Joint::Neck) && rays.weight[Joint::Neck] == 0.5);
        // 2.2 px over the mean focal length sqrt(1000 * 1210) = 1100.
        assert!((rays.noise_rad - 0.002).abs() < 1e-15);
    }
}
