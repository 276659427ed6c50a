//! Writes a camera as a TOML section that Pose2Sim and anipose can read.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, Vector3};

use super::CameraFileError;
use crate::model::camera::Camera;
use crate::model::distortion::Distortion;

/// Largest difference between a lens and the k1, k2, k3 written for it, pixels.
const MAX_LENS_ERROR_PX: f64 = 0.1;
const LENS_SAMPLES: usize = 200;

/// A lens as OpenCV's coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestLens {
    /// k1, k2, p1, p2, k3; all zero where no coefficients approximate the lens.
    pub coefficients: [f64; 5],
    /// Largest difference from the lens in the image, pixels.
    pub error_px: f64,
}

impl Camera {
    /// The camera as a section `[name]` of TOML.
    ///
    /// Tsai's lens is written as the k1, k2, k3 that fit it best over the image.
    ///
    /// # Errors
    ///
    /// The fitted coefficients differ from the lens by more than 0.1 px.
    pub fn to_toml_string(&self, name: &str) -> Result<String, CameraFileError> {
        let [k1, k2, p1, p2, k3] = self.opencv_distortion()?;
        let (f, c, r, t) = (self.focal_px, self.centre_px, self.rotation_vector(), self.translation);
        let title = quoted(name);
        let k3 = if k3 == 0.0 { String::new() } else { format!(", {k3:?}") };
        Ok(format!(
            "[{title}]\nname = {title}\nsize = [{}, {}]\n\
             matrix = [[{:?}, 0.0, {:?}], [0.0, {:?}, {:?}], [0.0, 0.0, 1.0]]\n\
             distortions = [{k1:?}, {k2:?}, {p1:?}, {p2:?}{k3}]\n\
             rotation = [{:?}, {:?}, {:?}]\ntranslation = [{:?}, {:?}, {:?}]\nfisheye = false\n",
            self.size[0], self.size[1], f.x, c.x, f.y, c.y, r.x, r.y, r.z, t.x, t.y, t.z
        ))
    }

    /// The rotation vector of the camera as in OpenCV: axis times angle, radians.
    pub fn rotation_vector(&self) -> DVec3 {
        DQuat::from_mat3(&self.rotation).to_scaled_axis()
    }

    /// The rotation matrix for a vector as returned by [`Camera::rotation_vector`].
    pub fn rotation_of_vector(vector: DVec3) -> DMat3 {
        DMat3::from_quat(DQuat::from_scaled_axis(vector))
    }

    /// OpenCV's k1, k2, p1, p2, k3 of the lens.
    ///
    /// # Errors
    ///
    /// A Tsai lens from which the fitted coefficients differ by more than 0.1 px somewhere in the image.
    pub fn opencv_distortion(&self) -> Result<[f64; 5], CameraFileError> {
        let NearestLens { coefficients, error_px } = self.nearest_opencv_lens();
        if error_px <= MAX_LENS_ERROR_PX { Ok(coefficients) } else { Err(CameraFileError::Lens { error_px }) }
    }

    /// The lens as OpenCV's coefficients, or the coefficients that fit it best over the image.
    pub fn nearest_opencv_lens(&self) -> NearestLens {
        match self.distortion {
            Distortion::None => NearestLens { coefficients: [0.0; 5], error_px: 0.0 },
            Distortion::Brown { k1, k2, p1, p2, k3 } => {
                NearestLens { coefficients: [k1, k2, p1, p2, k3], error_px: 0.0 }
            }
            Distortion::Tsai { .. } => self.nearest_radial(),
        }
    }

    /// Least squares of r_d = r (1 + k1 r² + k2 r⁴ + k3 r⁶) over the radii of the image.
    fn nearest_radial(&self) -> NearestLens {
        let (width, height) = (f64::from(self.size[0]), f64::from(self.size[1]));
        let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
        let reach = corners
            .map(|(u, v)| ((glam::DVec2::new(u, v) - self.centre_px) / self.focal_px).length())
            .into_iter()
            .fold(0.0, f64::max);
        // Distorted radii up to the corner, with their ideal radii.
        let sampled = (1..=LENS_SAMPLES).filter_map(|i| {
            let distorted = reach * i as f64 / LENS_SAMPLES as f64;
            self.distortion.undistort(glam::DVec2::new(distorted, 0.0)).map(|ideal| (ideal.x, distorted))
        });
        let pairs: Vec<(f64, f64)> = sampled.collect();
        let most = pairs.last().map_or(1.0, |(ideal, _)| *ideal);
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (r, r_d) in &pairs {
            let s = r / most;
            let row = Vector3::new(s.powi(3), s.powi(5), s.powi(7));
            normal += row * row.transpose();
            right += row * ((r_d - r) / most);
        }
        let fitted = normal.cholesky().map_or_else(Vector3::zeros, |c| c.solve(&right));
        let [k1, k2, k3] = [fitted[0] / most.powi(2), fitted[1] / most.powi(4), fitted[2] / most.powi(6)];
        let lens = Distortion::from_opencv([k1, k2, 0.0, 0.0, k3]);
        let miss = |(r, r_d): &(f64, f64)| {
            lens.distort(glam::DVec2::new(*r, 0.0)).map_or(f64::INFINITY, |d| (d.x - r_d).abs())
        };
        let error_px = pairs.iter().map(miss).fold(0.0, f64::max) * self.focal_px.max_element();
        let coefficients = [k1, k2, 0.0, 0.0, k3];
        if pairs.len() < LENS_SAMPLES || !coefficients.iter().all(|k| k.is_finite()) {
            return NearestLens { coefficients: [0.0; 5], error_px: f64::INFINITY };
        }
        NearestLens { coefficients, error_px }
    }
}

/// A TOML string; control characters are written as their numbers.
fn quoted(name: &str) -> String {
    let escaped = name.chars().map(|c| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04X}", u32::from(c)),
        c => c.to_string(),
    });
    format!("\"{}\"", escaped.collect::<String>())
}
