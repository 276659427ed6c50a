//! The camera: full perspective projection with lens distortion (Rohr 1994, eq. 2).
//!
//! *Ideal* pixels obey eq. (2) exactly. Pixels without that word are pixels of the image file, which the lens
//! distorts. All geometry uses ideal pixels: a pipeline undistorts its measurements once and does not need
//! the lens afterwards.
//!
//! Limits: the camera is static and has no skew; fisheye lenses are not supported.

use std::f64::consts::PI;

use glam::{DMat2, DMat3, DQuat, DVec2, DVec3};
use nalgebra::Matrix3x4;
use thiserror::Error;

use super::distortion::Distortion;
use super::tilt::Tilt;

/// Horizontal field of view assumed without calibration, radians (62 degrees).
///
/// The main camera of a phone has the field of view of a 24-28 mm lens on 36 mm film. Video recording crops
/// this to that of a lens of about 28-31 mm for stabilisation: 60-65 degrees across the long side of a
/// landscape video. In portrait orientation the same camera covers about 37 degrees.
pub const DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD: f64 = 62.0 * PI / 180.0;

/// Horizontal field of view assumed without calibration for pictures of a size, radians:
/// [`DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD`] across the longer side.
pub fn assumed_field_of_view_rad([width, height]: [u32; 2]) -> f64 {
    let share = f64::from(width) / f64::from(width.max(height).max(1));
    2.0 * (share * (0.5 * DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD).tan()).atan()
}

/// Relative standard deviation of an assumed focal length: fields of view from 45 to 75 degrees, equally likely, when
/// one in the middle is assumed.
pub const ASSUMED_FOCAL_SD: f64 = 0.18;

/// A camera farther from the origin of the world than this, metres, was probably calibrated in millimetres.
pub const MAX_DISTANCE_M: f64 = 200.0;

/// Why a camera was refused or could not compute a result.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// An image side is zero.
    #[error("image size must be positive, got {}x{}", size[0], size[1])]
    Size {
        /// Width and height, pixels.
        size: [u32; 2],
    },
    /// A parameter is NaN or infinite.
    #[error("{parameter} must be finite")]
    NotFinite {
        /// Its name.
        parameter: &'static str,
    },
    /// A focal length is not positive.
    #[error("focal lengths must be positive pixels, got fx = {}, fy = {}", focal_px.x, focal_px.y)]
    FocalLength {
        /// (fx, fy), pixels.
        focal_px: DVec2,
    },
    /// The principal point is more than an image side outside the image.
    #[error("principal point ({}, {}) lies far outside the {}x{} image", centre_px.x, centre_px.y, size[0], size[1])]
    CentreOutside {
        /// (cx, cy), pixels.
        centre_px: DVec2,
        /// Width and height, pixels.
        size: [u32; 2],
    },
    /// The matrix is not orthonormal, or it mirrors.
    #[error(
        "not a rotation: determinant {determinant:.6} (a rotation has +1), columns off orthonormal by {deviation:.2e}"
    )]
    NotARotation {
        /// Determinant of the matrix.
        determinant: f64,
        /// Largest absolute element of RᵀR - I.
        deviation: f64,
    },
    /// The camera is implausibly far from the origin of the world.
    #[error(
        "camera is {distance_m:.0} m from the world's origin, a 1.7 m person there {person_px:.2} px high: the translation looks like millimetres, in which it would be {:.0} px; say so by the unit mm (--camera-unit mm)",
        person_px * 1000.0
    )]
    LooksLikeMillimetres {
        /// Distance between camera and origin if the translation is in metres.
        distance_m: f64,
        /// Image height of a person of 1.7 m at the origin, pixels.
        person_px: f64,
    },
    /// The camera is implausibly close to the origin of the world.
    #[error(
        "camera is {:.1} mm from the world's origin, a 1.7 m person there {person_px:.0} px high: the unit is rather metres, in which it would be {:.0} px",
        distance_m * 1000.0, person_px / 1000.0
    )]
    LooksLikeMetres {
        /// Distance between camera and origin, metres.
        distance_m: f64,
        /// Image height of a person of 1.7 m at the origin, pixels.
        person_px: f64,
    },
    /// A quantity that must be positive is not.
    #[error("{parameter} must be positive and finite, got {value}")]
    NotPositive {
        /// Its name.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
    /// The field of view is not between 0 and 180 degrees.
    #[error("horizontal field of view must lie between 0 and pi radians, got {field_of_view_rad}")]
    FieldOfView {
        /// The value, radians.
        field_of_view_rad: f64,
    },
    /// The head of a person is not above the feet in the image.
    #[error("the head's row must be less than the feet's, got head {head_row_px}, feet {foot_row_px}")]
    PersonRows {
        /// Row of the crown, pixels.
        head_row_px: f64,
        /// Row of the soles, pixels.
        foot_row_px: f64,
    },
    /// The feet are at or above the horizon of a level camera.
    #[error(
        "the feet at row {foot_row_px} are not below the horizon of a level camera (row {horizon_row_px}): the camera must look down, give its calibration"
    )]
    FeetAboveHorizon {
        /// Row of the soles, pixels.
        foot_row_px: f64,
        /// Row of the horizon, pixels.
        horizon_row_px: f64,
    },
    /// The lens model maps no ideal pixel to this pixel.
    #[error("no undistorted point for pixel ({}, {}): it lies beyond the fold of the lens model", pixel.x, pixel.y)]
    NoIdealPixel {
        /// The distorted pixel.
        pixel: DVec2,
    },
}

/// A calibrated camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Image width and height, pixels.
    pub size: [u32; 2],
    /// Focal lengths (fx, fy), pixels.
    pub focal_px: DVec2,
    /// Principal point (cx, cy), pixels.
    pub centre_px: DVec2,
    /// The lens distortion.
    pub distortion: Distortion,
    /// Rotation R of `x_cam = R x_world + t`.
    pub rotation: DMat3,
    /// Translation t of `x_cam = R x_world + t`, metres.
    pub translation: DVec3,
}

/// Tsai's calibration as PETS and ETISEO publish it, in its own units (R. Tsai 1987).
#[derive(Debug, Clone, PartialEq)]
pub struct TsaiParameters {
    /// Image width and height, pixels (`width`, `height`).
    pub size: [u32; 2],
    /// Size of a pixel in the frame buffer (`dpx`, `dpy`), mm.
    pub pixel_mm: DVec2,
    /// Focal length (`focal`), mm.
    pub focal_mm: f64,
    /// Radial distortion (`kappa1`), 1/mm².
    pub kappa1_per_mm2: f64,
    /// Centre of distortion and principal point (`cx`, `cy`), pixels.
    pub centre_px: DVec2,
    /// Tsai's uncertainty factor of the horizontal scale (`sx`), near 1.
    pub sx: f64,
    /// Translation of `x_cam = R x_world + t` (`tx`, `ty`, `tz`), mm.
    pub translation_mm: DVec3,
    /// Angles of R = Rz Ry Rx (`rx`, `ry`, `rz`), radians.
    pub rotation_rad: DVec3,
}

impl Camera {
    /// A camera from Tsai's parameters.
    ///
    /// On the sensor x_d = dpx (u - cx) / sx and y_d = dpy (v - cy); the ideal point is x_d (1 + kappa1
    /// r_d²), all in mm. Division by the focal length f gives fx = sx f / dpx, fy = f / dpy, kappa = kappa1
    /// f².
    ///
    /// # Errors
    ///
    /// A pixel size, focal length or `sx` that is not positive, or an invalid camera ([`Camera::validated`]).
    pub fn from_tsai(tsai: &TsaiParameters) -> Result<Self, CameraError> {
        positive("dpx", tsai.pixel_mm.x)?;
        positive("dpy", tsai.pixel_mm.y)?;
        positive("focal", tsai.focal_mm)?;
        positive("sx", tsai.sx)?;
        let DVec3 { x: rx, y: ry, z: rz } = tsai.rotation_rad;
        let camera = Self {
            size: tsai.size,
            focal_px: DVec2::new(tsai.sx, 1.0) * tsai.focal_mm / tsai.pixel_mm,
            centre_px: tsai.centre_px,
            distortion: Distortion::Tsai { kappa: tsai.kappa1_per_mm2 * tsai.focal_mm * tsai.focal_mm },
            rotation: DMat3::from_rotation_z(rz) * DMat3::from_rotation_y(ry) * DMat3::from_rotation_x(rx),
            translation: tsai.translation_mm / 1000.0,
        };
        camera.validated()
    }

    /// A level camera without distortion that looks along world Y.
    ///
    /// World X points right in the image, Y away from the camera and Z up. The origin lies on the ground in
    /// the centre column of the image, `distance_m` in front of the camera.
    ///
    /// # Errors
    ///
    /// A field of view outside 0 to 180 degrees, a camera height that is not positive, or an invalid camera
    /// ([`Camera::validated`]).
    pub fn level(
        size: [u32; 2],
        horizontal_field_of_view_rad: f64,
        camera_height_m: f64,
        distance_m: f64,
    ) -> Result<Self, CameraError> {
        positive("camera height", camera_height_m)?;
        let focal_px = focal_from_field_of_view(size, horizontal_field_of_view_rad)?;
        let camera = Self {
            size,
            focal_px: DVec2::splat(focal_px),
            centre_px: image_centre(size),
            distortion: Distortion::None,
            rotation: DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y),
            translation: DVec3::new(0.0, camera_height_m, distance_m),
        };
        camera.validated()
    }

    /// A level camera at the origin of the world, for pictures without calibration: X right in the image, Y away from
    /// the camera, Z up. The ground is unknown, and with it what the camera's height would tell. The focal length has
    /// the relative standard deviation [`ASSUMED_FOCAL_SD`].
    ///
    /// # Errors
    ///
    /// A field of view outside 0 to 180 degrees, or an image without pixels.
    pub fn assumed(size: [u32; 2], horizontal_field_of_view_rad: f64) -> Result<Self, CameraError> {
        let level = Self::level(size, horizontal_field_of_view_rad, 1.0, 0.0)?;
        Self { translation: DVec3::ZERO, ..level }.validated()
    }

    /// A level camera estimated from one upright person of known height, for video without calibration.
    ///
    /// The soles of the person are at row `foot_row_px`, the crown at row `head_row_px`. With f the focal
    /// length for the field of view, the person is at depth f H / (foot - head), and the camera is depth
    /// (foot - cy) / f above the ground. World axes as in [`Camera::level`], with the origin at the person's
    /// depth: a walk parallel to the image plane is along y = 0.
    ///
    /// Depths are proportional to the assumed focal length; heights and sideways positions at the person's
    /// depth do not depend on it.
    ///
    /// # Errors
    ///
    /// A person height that is not positive, a head that is not above the feet in the image, feet at or above the
    /// horizon, and the errors of [`Camera::level`].
    pub fn from_person(
        size: [u32; 2],
        horizontal_field_of_view_rad: f64,
        person_height_m: f64,
        foot_row_px: f64,
        head_row_px: f64,
    ) -> Result<Self, CameraError> {
        positive("person height", person_height_m)?;
        let focal_px = focal_from_field_of_view(size, horizontal_field_of_view_rad)?;
        let height_px = foot_row_px - head_row_px;
        if !(height_px > 0.0 && height_px.is_finite()) {
            return Err(CameraError::PersonRows { head_row_px, foot_row_px });
        }
        let horizon_row_px = image_centre(size).y;
        if foot_row_px <= horizon_row_px {
            return Err(CameraError::FeetAboveHorizon { foot_row_px, horizon_row_px });
        }
        let depth_m = focal_px * person_height_m / height_px;
        let camera_height_m = depth_m * (foot_row_px - horizon_row_px) / focal_px;
        Self::level(size, horizontal_field_of_view_rad, camera_height_m, depth_m)
    }

    /// The same camera turned about its centre of projection, from the level axes it has to tilted ones.
    #[must_use]
    pub fn tilted(self, tilt: &Tilt) -> Self {
        let turn = tilt.rotation();
        Self { rotation: turn * self.rotation, translation: turn * self.translation, ..self }
    }

    /// The camera itself if its parameters are valid.
    ///
    /// # Errors
    ///
    /// A side of the image that is zero, a parameter that is not finite, a focal length that is not positive,
    /// a principal point more than an image side outside the image, a matrix that is not a rotation, or a
    /// distance of more than [`MAX_DISTANCE_M`] from the origin of the world.
    pub fn validated(self) -> Result<Self, CameraError> {
        check_size(self.size)?;
        self.check_finite()?;
        if self.focal_px.min_element() <= 0.0 {
            return Err(CameraError::FocalLength { focal_px: self.focal_px });
        }
        let size = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]));
        if (self.centre_px / size - 0.5).abs().max_element() > 1.5 {
            return Err(CameraError::CentreOutside { centre_px: self.centre_px, size: self.size });
        }
        check_rotation(&self.rotation, 1e-6)?;
        let distance_m = self.translation.length();
        if distance_m > MAX_DISTANCE_M {
            let person_px = self.focal_px.y * 1.7 / distance_m;
            return Err(CameraError::LooksLikeMillimetres { distance_m, person_px });
        }
        Ok(self)
    }

    /// A world point in camera axes (x right, y down, z forward), metres.
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

    /// The pixel of a world point; `None` behind the camera and beyond the fold of the lens model.
    pub fn project(&self, point_in_world: DVec3) -> Option<DVec2> {
        self.distort(self.project_ideal(point_in_world)?)
    }

    /// The pixel to which the lens maps an ideal pixel; `None` beyond the fold of the lens model.
    pub fn distort(&self, ideal_px: DVec2) -> Option<DVec2> {
        let distorted = self.distortion.distort(self.plane_from_pixel(ideal_px))?;
        Some(self.pixel_from_plane(distorted))
    }

    /// The derivative of [`Camera::distort`] at an ideal pixel, by central differences over one pixel, within which a
    /// lens is linear to 1e-6; `None` beyond the fold of the lens model.
    pub(crate) fn distortion_slope(&self, ideal_px: DVec2) -> Option<DMat2> {
        if self.distortion == Distortion::None {
            return Some(DMat2::IDENTITY);
        }
        let slope = |axis: DVec2| {
            let [low, high] = [-0.5, 0.5].map(|by| self.distort(ideal_px + by * axis));
            Some(high? - low?)
        };
        Some(DMat2::from_cols(slope(DVec2::X)?, slope(DVec2::Y)?))
    }

    /// The ideal pixel that the lens maps to `pixel`, accurate to 1e-10 px.
    ///
    /// # Errors
    ///
    /// The lens model maps no ideal pixel to `pixel`.
    pub fn undistort(&self, pixel: DVec2) -> Result<DVec2, CameraError> {
        let ideal = self.distortion.undistort(self.plane_from_pixel(pixel));
        ideal.map(|x| self.pixel_from_plane(x)).ok_or(CameraError::NoIdealPixel { pixel })
    }

    /// Unit direction, in the world, of the ray from [`Camera::position`] through an ideal pixel.
    pub fn ray_in_world(&self, ideal_px: DVec2) -> DVec3 {
        (self.rotation.transpose() * self.plane_from_pixel(ideal_px).extend(1.0)).normalize()
    }

    /// The intersection of the ray through an ideal pixel with the ground z = 0, metres; `None` at and above
    /// the horizon.
    pub fn ground_point(&self, ideal_px: DVec2) -> Option<DVec3> {
        self.point_at_height(ideal_px, 0.0)
    }

    /// The intersection of the ray through an ideal pixel with the horizontal plane z = `z_m`, metres; `None`
    /// unless it lies in front of the camera.
    pub fn point_at_height(&self, ideal_px: DVec2, z_m: f64) -> Option<DVec3> {
        let (origin, ray) = (self.position(), self.ray_in_world(ideal_px));
        let length_m = (z_m - origin.z) / ray.z;
        (length_m > 0.0 && length_m.is_finite()).then(|| (origin + ray * length_m).with_z(z_m))
    }

    /// The matrix T of eq. (2) without its arbitrary third row: h (u, v, 1)ᵀ = T (X, Y, Z, 1)ᵀ in ideal
    /// pixels.
    ///
    /// The scale is chosen so that h is the depth in metres.
    pub fn matrix(&self) -> Matrix3x4<f64> {
        let intrinsics = self.intrinsics();
        let columns = [self.rotation.x_axis, self.rotation.y_axis, self.rotation.z_axis, self.translation];
        Matrix3x4::from_columns(&columns.map(|c| (intrinsics * c).to_array().into()))
    }

    /// The vanishing point of vertical lines, T (0, 0, 1, 0)ᵀ, in homogeneous ideal pixels; the third element
    /// is zero for a level camera.
    pub fn vanishing_point_of_vertical(&self) -> DVec3 {
        self.intrinsics() * self.rotation.z_axis
    }

    /// Distance in ideal pixels between a point and the point `height_m` above it; `None` if one of them is
    /// behind the camera.
    pub fn pixel_height_at(&self, point_on_ground: DVec3, height_m: f64) -> Option<f64> {
        let foot = self.project_ideal(point_on_ground)?;
        let head = self.project_ideal(point_on_ground + DVec3::Z * height_m)?;
        Some(foot.distance(head))
    }

    /// The camera for the same images resized by `factor`. Pixel centres are at integers, so the corner
    /// (-0.5, -0.5) stays fixed.
    ///
    /// # Errors
    ///
    /// A factor that is not positive, or an image side that becomes zero.
    pub fn scaled(&self, factor: f64) -> Result<Self, CameraError> {
        positive("scale factor", factor)?;
        let scaled = Self {
            size: self.size.map(|side| (f64::from(side) * factor).round() as u32),
            focal_px: self.focal_px * factor,
            centre_px: (self.centre_px + 0.5) * factor - 0.5,
            ..self.clone()
        };
        scaled.validated()
    }

    /// The camera for the same images with each block of `n` by `n` pixels averaged to one pixel. Columns at
    /// the right and rows at the bottom that do not fill a block are dropped.
    ///
    /// # Errors
    ///
    /// `n` is zero, or an image side becomes zero.
    pub fn shrunk(&self, n: u32) -> Result<Self, CameraError> {
        let scaled = self.scaled(1.0 / f64::from(n))?;
        Self { size: self.size.map(|side| side / n), ..scaled }.validated()
    }

    /// The camera after a rotation about its centre by a rotation vector, radians, camera axes.
    #[must_use]
    pub fn turned(&self, turn_rad: DVec3) -> Self {
        let turned = DMat3::from_quat(DQuat::from_scaled_axis(turn_rad));
        Self { rotation: turned * self.rotation, translation: turned * self.translation, ..self.clone() }
    }

    /// The same camera without its distortion, with an image that goes on beyond the borders of this one by so many pixels: left,
    /// top, right and bottom.
    #[must_use]
    pub fn widened(&self, [left, top, right, bottom]: [u32; 4]) -> Self {
        Self {
            size: [self.size[0] + left + right, self.size[1] + top + bottom],
            centre_px: self.centre_px + DVec2::new(f64::from(left), f64::from(top)),
            distortion: Distortion::None,
            ..self.clone()
        }
    }

    /// The matrix K of `h (u, v, 1)ᵀ = K x_cam`.
    pub(crate) fn intrinsics(&self) -> DMat3 {
        let (f, c) = (self.focal_px, self.centre_px);
        DMat3::from_cols(DVec3::X * f.x, DVec3::Y * f.y, c.extend(1.0))
    }

    fn plane_from_pixel(&self, pixel: DVec2) -> DVec2 {
        (pixel - self.centre_px) / self.focal_px
    }

    fn pixel_from_plane(&self, x: DVec2) -> DVec2 {
        x * self.focal_px + self.centre_px
    }

    fn check_finite(&self) -> Result<(), CameraError> {
        let parameters = [
            ("focal length", self.focal_px.is_finite()),
            ("principal point", self.centre_px.is_finite()),
            ("distortion", self.distortion.is_finite()),
            ("rotation", self.rotation.is_finite()),
            ("translation", self.translation.is_finite()),
        ];
        match parameters.into_iter().find(|(_, is_finite)| !is_finite) {
            Some((parameter, _)) => Err(CameraError::NotFinite { parameter }),
            None => Ok(()),
        }
    }
}

/// Returns an error for a matrix whose columns deviate from orthonormal by more than `tolerance`, or that
/// mirrors.
pub(crate) fn check_rotation(rotation: &DMat3, tolerance: f64) -> Result<(), CameraError> {
    let excess = rotation.transpose() * *rotation - DMat3::IDENTITY;
    let deviation = excess.to_cols_array().into_iter().fold(0.0, |most: f64, e| most.max(e.abs()));
    let determinant = rotation.determinant();
    if determinant > 0.0 && deviation <= tolerance {
        return Ok(());
    }
    Err(CameraError::NotARotation { determinant, deviation })
}

fn check_size(size: [u32; 2]) -> Result<(), CameraError> {
    if size.contains(&0) { Err(CameraError::Size { size }) } else { Ok(()) }
}

fn positive(parameter: &'static str, value: f64) -> Result<(), CameraError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(CameraError::NotPositive { parameter, value }) }
}

fn image_centre(size: [u32; 2]) -> DVec2 {
    DVec2::new(f64::from(size[0]), f64::from(size[1])) / 2.0 - 0.5
}

/// f = (width / 2) / tan(angle / 2), pixels.
fn focal_from_field_of_view(size: [u32; 2], field_of_view_rad: f64) -> Result<f64, CameraError> {
    check_size(size)?;
    if !(field_of_view_rad > 0.0 && field_of_view_rad < PI) {
        return Err(CameraError::FieldOfView { field_of_view_rad });
    }
    Ok(f64::from(size[0]) / 2.0 / (field_of_view_rad / 2.0).tan())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn level() -> Camera {
        Camera::level([640, 480], DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD, 1.4, 5.0).unwrap()
    }

    fn rotated(roll: f64, pitch: f64, yaw: f64) -> Camera {
        let turn = DMat3::from_rotation_z(roll) * DMat3::from_rotation_x(pitch) * DMat3::from_rotation_y(yaw);
        let camera = level();
        let rotation = turn * camera.rotation;
        Camera { translation: rotation * -camera.position(), rotation, ..camera }
    }

    fn bent() -> Camera {
        let axis = DVec3::new(1.2, -0.7, 0.4);
        Camera {
            size: [1280, 720],
            focal_px: DVec2::new(820.5, 815.75),
            centre_px: DVec2::new(655.25, 351.5),
            distortion: Distortion::from_opencv([-0.28, 0.09, 0.0011, -0.0023, -0.012]),
            rotation: DMat3::from_axis_angle(axis.normalize(), axis.length()),
            translation: DVec3::new(0.31, -0.52, 4.7),
        }
    }

    /// Pixels printed by cv2.projectPoints (OpenCV 5.0.0): world point, ideal, distorted.
    const OPENCV: [([f64; 3], [f64; 2], [f64; 2]); 4] = [
        ([0.0, 0.0, 0.0], [709.368085106, 261.246808511], [709.057112743, 261.728091336]),
        ([0.8, -0.4, 1.1], [787.740699397, 75.773764053], [782.303822678, 86.663267301]),
        ([-1.3, 0.9, -0.6], [459.879847804, 434.657287113], [463.086993138, 433.298510466]),
        ([1.5, 1.4, 0.3], [708.719975386, 296.526604396], [708.548232150, 296.694011437]),
    ];

    /// The fields of view in the comment at the default: 60 to 65 degrees, upright about 37.
    #[test]
    fn an_upright_picture_is_that_of_the_same_camera_turned() {
        for size in [[1920, 1080], [640, 480], [99, 99]] {
            let field_rad = assumed_field_of_view_rad(size);
            assert!((field_rad - DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD).abs() < 1e-12, "{size:?}");
        }
        let [flat, upright] = [[1920, 1080], [1080, 1920]]
            .map(|size| Camera::assumed(size, assumed_field_of_view_rad(size)).unwrap());
        assert!((flat.focal_px - upright.focal_px).length() < 1e-9);
        assert!((assumed_field_of_view_rad([1080, 1920]).to_degrees() - 37.3).abs() < 0.5);
        assert_eq!((flat.position(), flat.camera_from_world(DVec3::Y)), (DVec3::ZERO, DVec3::Z));
    }

    #[test]
    fn projection_agrees_with_opencv() {
        let camera = bent();
        for (point, ideal, distorted) in OPENCV {
            let point = DVec3::from(point);
            assert!((camera.project_ideal(point).unwrap() - DVec2::from(ideal)).length() < 2e-9);
            assert!((camera.project(point).unwrap() - DVec2::from(distorted)).length() < 2e-9);
            assert!((camera.undistort(DVec2::from(distorted)).unwrap() - DVec2::from(ideal)).length() < 4e-9);
        }
    }

    #[test]
    fn a_pixel_beyond_the_fold_is_reported() {
        let camera = Camera { distortion: Distortion::from_opencv([-0.5, 0.0, 0.0, 0.0, 0.0]), ..level() };
        let pixel = DVec2::new(5000.0, 240.0);
        assert_eq!(camera.undistort(pixel), Err(CameraError::NoIdealPixel { pixel }));
        // Far to the side, the polynomial without the fold check would map back into the image.
        let far_to_the_side = DVec3::new(7.0, 0.0, 1.4);
        assert!(camera.project_ideal(far_to_the_side).is_some());
        assert_eq!(camera.project(far_to_the_side), None);
    }

    #[test]
    fn the_matrix_projects() {
        let camera = rotated(0.1, 0.2, -0.3);
        let point = DVec3::new(0.4, 0.9, 1.1);
        let h_uv = camera.matrix() * nalgebra::Vector4::new(point.x, point.y, point.z, 1.0);
        let pixel = camera.project_ideal(point).unwrap();
        assert!((h_uv[2] - camera.camera_from_world(point).z).abs() < 1e-12);
        assert!((DVec2::new(h_uv[0], h_uv[1]) / h_uv[2] - pixel).length() < 1e-10);
    }

    #[test]
    fn verticals_meet_at_the_vanishing_point() {
        let camera = rotated(0.05, 0.3, 0.2);
        let v = camera.vanishing_point_of_vertical();
        for foot in [DVec3::ZERO, DVec3::new(1.0, 2.0, 0.0)] {
            let [a, b] = [foot, foot + DVec3::Z].map(|p| camera.project_ideal(p).unwrap());
            let toward_v = v.truncate() / v.z - a;
            assert!(toward_v.normalize().perp_dot((b - a).normalize()).abs() < 1e-10);
        }
        assert_eq!(level().vanishing_point_of_vertical().z, 0.0);
    }

    #[test]
    fn no_ground_at_or_above_the_horizon() {
        let camera = level();
        assert_eq!(camera.ground_point(camera.centre_px), None);
        assert_eq!(camera.ground_point(camera.centre_px - DVec2::Y), None);
        assert!(camera.ground_point(camera.centre_px + DVec2::Y).is_some());
        assert!(camera.point_at_height(camera.centre_px - DVec2::Y, 2.0).is_some());
    }

    #[test]
    fn a_shrunk_image_has_the_means_of_its_pixels() {
        let camera = Camera::level([643, 481], 0.9, 1.3, 6.0).unwrap();
        let shrunk = camera.shrunk(3).unwrap();
        assert_eq!(shrunk.size, [214, 160]);
        let point = DVec3::new(0.4, 0.2, 1.1);
        // The nine pixels 0, 1, 2 have their mean at 1, which is pixel 0 of the shrunk image.
        let expected = (camera.project(point).unwrap() - 1.0) / 3.0;
        assert!((shrunk.project(point).unwrap() - expected).length() < 1e-9);
        assert!(camera.shrunk(0).is_err() && camera.shrunk(1000).is_err());
        assert_eq!(camera.shrunk(1).unwrap(), camera);
    }

    #[test]
    fn a_resized_image_shows_the_same_scene() {
        let camera = bent();
        let half = camera.scaled(0.5).unwrap();
        assert_eq!(half.size, [640, 360]);
        let point = DVec3::new(0.8, -0.4, 1.1);
        let expected = (camera.project(point).unwrap() + 0.5) * 0.5 - 0.5;
        assert!((half.project(point).unwrap() - expected).length() < 1e-10);
        let error = camera.scaled(0.0).unwrap_err();
        assert_eq!(error.to_string(), "scale factor must be positive and finite, got 0");
        assert_eq!(camera.scaled(1e-4), Err(CameraError::Size { size: [0, 0] }));
    }

    #[test]
    fn the_default_view_is_the_image_wide() {
        let camera = level();
        let ray = camera.ray_in_world(DVec2::new(639.5, camera.centre_px.y));
        assert!((ray.x.atan2(ray.y) * 2.0 - DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD).abs() < 1e-12);
        assert!((camera.position() - DVec3::new(0.0, -5.0, 1.4)).length() < 1e-12);
    }

    /// Between the fields of view of 28 mm and 31 mm lenses on film 36 mm wide.
    #[test]
    fn the_default_view_is_that_of_a_phone() {
        let across = |focal_mm: f64| 2.0 * (18.0 / focal_mm).atan();
        assert!((across(31.0)..across(28.0)).contains(&DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD));
        let portrait =
            2.0 * (f64::from(1080) / 1920.0 * (DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD / 2.0).tan()).atan();
        assert!((portrait.to_degrees() - 37.0).abs() < 1.0, "{portrait}");
    }

    #[test]
    fn a_guessed_camera_that_cannot_be_is_refused() {
        let guess = |fov, height, foot, head| Camera::from_person([640, 480], fov, height, foot, head);
        let text = |r: Result<Camera, CameraError>| r.unwrap_err().to_string();
        assert!(
            text(guess(1.0, 0.0, 400.0, 100.0)).contains("person height must be positive and finite, got 0")
        );
        assert!(text(guess(3.2, 1.7, 400.0, 100.0)).contains("between 0 and pi radians, got 3.2"));
        assert!(text(guess(1.0, 1.7, 100.0, 400.0)).contains("got head 400, feet 100"));
        assert!(text(guess(1.0, 1.7, f64::NAN, 400.0)).contains("got head 400, feet NaN"));
        assert!(
            text(guess(1.0, 1.7, 200.0, 100.0))
                .contains("not below the horizon of a level camera (row 239.5)")
        );
        assert!(text(Camera::level([0, 480], 1.0, 1.0, 5.0)).contains("got 0x480"));
        assert!(text(Camera::level([640, 480], 1.0, -1.0, 5.0)).contains("camera height must be positive"));
    }

    #[test]
    fn nonsense_is_refused_with_its_values() {
        let text = |camera: Camera| camera.validated().unwrap_err().to_string();
        let camera = level;
        assert_eq!(
            text(Camera { focal_px: DVec2::new(500.0, -1.0), ..camera() }),
            "focal lengths must be positive pixels, got fx = 500, fy = -1"
        );
        assert_eq!(
            text(Camera { centre_px: DVec2::new(3000.0, 240.0), ..camera() }),
            "principal point (3000, 240) lies far outside the 640x480 image"
        );
        assert!(text(Camera { rotation: -camera().rotation, ..camera() }).contains("determinant -1.000000"));
        assert!(
            text(Camera { rotation: camera().rotation * 1.1, ..camera() }).contains("determinant 1.331000")
        );
        let far = text(Camera { translation: DVec3::new(0.0, 984.0, 6060.0), ..camera() });
        assert!(far.contains("camera is 6139 m from the world's origin, a 1.7 m person there 0."), "{far}");
        assert!(far.contains("the translation looks like millimetres"), "{far}");
        assert_eq!(
            text(Camera { translation: DVec3::new(0.0, f64::NAN, 0.0), ..camera() }),
            "translation must be finite"
        );
        let distortion = Distortion::Tsai { kappa: f64::INFINITY };
        assert_eq!(text(Camera { distortion, ..camera() }), "distortion must be finite");
    }

    /// Tsai's parameters with the rotation matrix written out as in the code PETS distributes.
    #[test]
    fn tsai_is_its_published_formulas() {
        let tsai = TsaiParameters {
            size: [768, 576],
            pixel_mm: DVec2::new(5.1e-3, 4.65e-3),
            focal_mm: 5.55,
            kappa1_per_mm2: 5.1e-3,
            centre_px: DVec2::new(324.2, 282.6),
            sx: 1.09,
            translation_mm: DVec3::new(828.7, -3175.5, 35469.3),
            rotation_rad: DVec3::new(2.04, -0.89, -0.43),
        };
        let camera = Camera::from_tsai(&tsai).unwrap();
        let ((sa, ca), (sb, cb), (sg, cg)) =
            (2.04_f64.sin_cos(), (-0.89_f64).sin_cos(), (-0.43_f64).sin_cos());
        let point = DVec3::new(-4100.0, -7300.0, 0.0);
        let x = cb * cg * point.x + (cg * sa * sb - ca * sg) * point.y + 828.7;
        let y = cb * sg * point.x + (sa * sb * sg + ca * cg) * point.y - 3175.5;
        let z = -sb * point.x + cb * sa * point.y + 35469.3;

        let pixel = camera.project(point / 1000.0).unwrap();
        let sensor = DVec2::new(5.1e-3 * (pixel.x - 324.2) / 1.09, 4.65e-3 * (pixel.y - 282.6));
        let undistorted = sensor * (1.0 + 5.1e-3 * sensor.length_squared());
        assert!((undistorted - DVec2::new(5.55 * x / z, 5.55 * y / z)).length() < 1e-12);

        let error = Camera::from_tsai(&TsaiParameters { sx: 0.0, ..tsai }).unwrap_err();
        assert_eq!(error.to_string(), "sx must be positive and finite, got 0");
    }

    proptest! {
        #[test]
        fn undistort_undoes_distort(u in 0.0..1280.0_f64, v in 0.0..720.0_f64) {
            let (camera, ideal) = (bent(), DVec2::new(u, v));
            let back = camera.undistort(camera.distort(ideal).unwrap()).unwrap();
            prop_assert!((back - ideal).length() < 1e-10);
        }

        #[test]
        fn a_ground_point_is_found_again(
            roll in -0.3..0.3_f64, pitch in -0.1..1.2_f64, yaw in -0.5..0.5_f64,
            x in -3.0..3.0_f64, y in -3.0..20.0_f64, z in 0.0..1.3_f64,
        ) {
            let (camera, point) = (rotated(roll, pitch, yaw), DVec3::new(x, y, z));
            if let Some(pixel) = camera.project_ideal(point) {
                let found = camera.point_at_height(pixel, z).unwrap();
                prop_assert!((found - point).length() < 1e-8);
            }
        }

        #[test]
        fn the_guessed_camera_sees_the_person_where_it_was(
            fov in 0.5..1.5_f64, height in 1.0..2.1_f64, foot in 241.0..479.0_f64, span in 20.0..400.0_f64,
        ) {
            let camera = Camera::from_person([640, 480], fov, height, foot, foot - span);
            prop_assume!(camera.as_ref().is_ok_and(|c| c.translation.z < 100.0));
            let camera = camera.unwrap();
            let soles = camera.project(DVec3::ZERO).unwrap();
            let crown = camera.project(DVec3::new(0.0, 0.0, height)).unwrap();
            prop_assert!((soles - DVec2::new(319.5, foot)).length() < 1e-9);
            prop_assert!((crown - DVec2::new(319.5, foot - span)).length() < 1e-9);
            prop_assert!((camera.pixel_height_at(DVec3::ZERO, height).unwrap() - span).abs() < 1e-9);
            // X to the right, Y into the depth.
            prop_assert!(camera.project(DVec3::X * 0.1).unwrap().x > 319.5);
            prop_assert!(camera.camera_from_world(DVec3::Y).z > camera.translation.z);
        }
    }
}
