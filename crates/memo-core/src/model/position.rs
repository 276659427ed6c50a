//! The position of a person from the rectangle around the image region (Rohr 1994, section 4.2, eqs. 2-6).
//!
//! The midpoints of the bottom and the top edge of the rectangle are taken as the images of the sole and of
//! the top of the head of an upright person of known height H. The paper's Y axis is our Z: H = (0, 0, H,
//! 0)ᵀ.
//!
//! | function | uses | depth depends on |
//! |---|---|---|
//! | [`position_from_rectangle`] | both midpoints, eq. (6) | the rectangle's height; the ground is not used |
//! | [`position_from_feet`] | bottom midpoint, ground z = 0 | the bottom row and the camera's calibration |
//! | [`position_from_head`] | top midpoint, plane z = H | the top row, H and the calibration |
//! | [`position_on_ground`] | all of these, weighted | the more certain measurements |
//!
//! The height of a rectangle is a poor measure of depth: an error of one per cent in height is an error of
//! one per cent in depth, and reflections, shadows or missed feet change the height by more. With a
//! calibrated ground, use [`position_on_ground`].
//!
//! Limits: each function uses one rectangle and does not filter over time; a stooped or seated person gets a
//! wrong position.

use crate::OptionError;
use glam::{DMat2, DMat3, DVec2, DVec3};
use thiserror::Error;

use super::camera::{Camera, CameraError};

/// The midpoints of a rectangle's bottom and top edges, ideal pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Midpoints {
    /// x_u, the image of the sole.
    pub bottom_px: DVec2,
    /// x_o, the image of the top of the head.
    pub top_px: DVec2,
}

impl Midpoints {
    /// The midpoints from distorted pixels measured in the image; undistorts them.
    ///
    /// # Errors
    ///
    /// The lens model maps no ideal pixel to a midpoint.
    pub fn undistorted(camera: &Camera, bottom_px: DVec2, top_px: DVec2) -> Result<Self, CameraError> {
        Ok(Self { bottom_px: camera.undistort(bottom_px)?, top_px: camera.undistort(top_px)? })
    }
}

/// Uncertainties of the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionOptions {
    /// Weight in [0, 1] of the bottom midpoint when both midpoints are shifted onto the image of a vertical
    /// line; with 1 the bottom midpoint stays in place.
    pub bottom_weight: f64,
    /// Standard deviation of the rectangle's centre column, pixels.
    pub column_sd_px: f64,
    /// Standard deviation of the bottom row, pixels.
    pub bottom_sd_px: f64,
    /// Standard deviation of the top row, pixels.
    pub top_sd_px: f64,
    /// Standard deviation of the person's height, metres.
    pub height_sd_m: f64,
}

impl Default for PositionOptions {
    /// Values for regions found by change detection around walkers 200 to 400 pixels tall.
    fn default() -> Self {
        Self {
            // The nearest line: neither midpoint is known to be better centred.
            bottom_weight: 0.5,
            // Arms and feet move the centre of a walker's rectangle by 0.07-0.1 m.
            column_sd_px: 10.0,
            // The feet merge with their shadow and reflection, or are missed on dark ground.
            bottom_sd_px: 4.0,
            // The head is compact and seldom touches other objects in the image.
            top_sd_px: 2.0,
            // Adult stature has a standard deviation of 0.07 m within one sex.
            height_sd_m: 0.07,
        }
    }
}

/// The position of a person's feet and its fit to the rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct FootPosition {
    /// X_u, the sole in the world, metres. Eq. (6) alone does not place it on the ground.
    pub point_in_world: DVec3,
    /// h_u, depth of the sole along the optical axis, metres.
    pub depth_m: f64,
    /// Image of the sole, ideal pixels; for eq. (6) the shifted bottom midpoint.
    pub bottom_px: DVec2,
    /// Image of the top of the head, ideal pixels; for eq. (6) the shifted top midpoint.
    pub top_px: DVec2,
    /// Distance of `bottom_px` from the measured midpoint, pixels.
    pub bottom_shift_px: f64,
    /// Distance of `top_px` from the measured midpoint, pixels.
    pub top_shift_px: f64,
    /// First-order covariance of `point_in_world` from the options' standard deviations, square metres.
    pub covariance: DMat3,
    /// First-order standard deviation of `depth_m`, metres.
    pub depth_sd_m: f64,
}

/// Why no position was found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PositionError {
    /// The height is not positive.
    #[error("person height must be positive and finite metres, got {height_m}")]
    Height {
        /// The height, metres.
        height_m: f64,
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// A midpoint is NaN or infinite.
    #[error("midpoints must be finite, got bottom {bottom_px}, top {top_px}")]
    NotFinite {
        /// Bottom midpoint, pixels.
        bottom_px: DVec2,
        /// Top midpoint, pixels.
        top_px: DVec2,
    },
    /// The top midpoint is not above the bottom midpoint along the image of the vertical.
    #[error(
        "rectangle upside down or without height: top midpoint {top_px} is not above bottom midpoint {bottom_px}"
    )]
    UpsideDown {
        /// Bottom midpoint, pixels.
        bottom_px: DVec2,
        /// Top midpoint, pixels.
        top_px: DVec2,
    },
    /// The vertical vanishing point lies on the rectangle: the person would be behind or around the camera.
    #[error("no upright person spans {bottom_px} to {top_px}: verticals meet between them")]
    AtVanishingPoint {
        /// Bottom midpoint, pixels.
        bottom_px: DVec2,
        /// Top midpoint, pixels.
        top_px: DVec2,
    },
    /// A ray does not intersect its plane in front of the camera.
    #[error("the ray through pixel {pixel} does not meet the plane z = {z_m} m in front of the camera")]
    NoIntersection {
        /// The ideal pixel.
        pixel: DVec2,
        /// Height of the plane, metres.
        z_m: f64,
    },
    /// The least-squares search for the position did not converge.
    #[error("no standing place fits bottom midpoint {bottom_px} and top midpoint {top_px}")]
    NoFit {
        /// Bottom midpoint, pixels.
        bottom_px: DVec2,
        /// Top midpoint, pixels.
        top_px: DVec2,
    },
}

/// Position by eq. (6): the last three equations hold exactly after the shift, and the first three give X_u.
///
/// # Errors
///
/// Midpoints that are not finite, upside down or at the vertical vanishing point; a height or an option out
/// of range.
pub fn position_from_rectangle(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
) -> Result<FootPosition, PositionError> {
    foot_position(camera, midpoints, height_m, options, |midpoints, height_m| {
        Ok(camera.position()
            + sole_from_camera_per_metre(camera, midpoints, options.bottom_weight)? * height_m)
    })
}

/// Position from the bottom midpoint alone, on the ground z = 0.
///
/// The height is only used to predict the image of the head.
///
/// # Errors
///
/// As [`position_from_rectangle`], and a ray that does not meet the ground in front of the camera.
pub fn position_from_feet(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
) -> Result<FootPosition, PositionError> {
    foot_position(camera, midpoints, height_m, options, |midpoints, _| {
        plane_point(camera, midpoints.bottom_px, 0.0)
    })
}

/// Position from the top midpoint alone: the head lies on the plane z = H, the sole below it on the ground.
///
/// The result is useless where the camera is at head height, because the plane is seen edge-on; the
/// covariance is large there.
///
/// # Errors
///
/// As [`position_from_rectangle`], and a ray that does not meet the plane z = H in front of the camera.
pub fn position_from_head(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
) -> Result<FootPosition, PositionError> {
    foot_position(camera, midpoints, height_m, options, |midpoints, height_m| {
        Ok(plane_point(camera, midpoints.top_px, height_m)?.with_z(0.0))
    })
}

/// Position on the ground z = 0 by weighted least squares on both midpoints.
///
/// Minimises the squared distances of the images of sole and head from the midpoints, each in units of its
/// standard deviation. An uncertain height increases the standard deviation of the head along the image of
/// the vertical.
///
/// # Errors
///
/// As [`position_from_rectangle`], rays that meet neither plane in front of the camera, and a search that
/// does not converge.
pub fn position_on_ground(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
) -> Result<FootPosition, PositionError> {
    foot_position(camera, midpoints, height_m, options, |midpoints, height_m| {
        least_squares_on_ground(camera, midpoints, height_m, options)
    })
}

/// The height H for which eq. (6) places the sole on the ground z = 0, metres.
///
/// `bottom_weight` as in [`PositionOptions`].
///
/// # Errors
///
/// Midpoints as in [`position_from_rectangle`], a weight out of range, and a rectangle for which no positive
/// height places the sole on the ground.
pub fn height_on_ground(
    camera: &Camera,
    midpoints: &Midpoints,
    bottom_weight: f64,
) -> Result<f64, PositionError> {
    check_midpoints(camera, midpoints)?;
    check_weight(bottom_weight)?;
    let height_m = -camera.position().z / sole_from_camera_per_metre(camera, midpoints, bottom_weight)?.z;
    if height_m > 0.0 && height_m.is_finite() {
        return Ok(height_m);
    }
    Err(PositionError::NoIntersection { pixel: midpoints.bottom_px, z_m: 0.0 })
}

/// A line through the vertical vanishing point and the positions of both midpoints on it.
struct VerticalLine {
    /// A point on the line, pixels.
    origin: DVec2,
    /// Unit direction in which the image of a rising point moves.
    along: DVec2,
    /// Position of the shifted bottom midpoint, relative to `origin`, pixels.
    s_u: f64,
    /// Position of the shifted top midpoint, relative to `origin`, pixels.
    s_o: f64,
}

/// Projects the midpoints onto the nearest line through the vertical vanishing point v = T (0, 0, 1, 0)ᵀ.
///
/// With w the weight of the bottom let m = w x_u + (1-w) x_o, δ = x_o - x_u and v' = v_xy - v_h m. A line
/// nᵀ(x - m) = d through v has d = nᵀv' / v_h, and the weighted sum of squared distances is nᵀ(w (1-w) δ δᵀ +
/// v' v'ᵀ / v_h²) n. Multiplied by v_h² it stays finite for v at infinity (v_h = 0). In the basis of e =
/// v'/|v'| and f perpendicular to it, the largest principal axis of the matrix M is the direction of the
/// line; it is turned from e by φ with tan 2φ = 2 M_ef / (M_ee - M_ff).
fn nearest_vertical(camera: &Camera, midpoints: &Midpoints, bottom_weight: f64) -> Option<VerticalLine> {
    let Midpoints { bottom_px: x_u, top_px: x_o } = *midpoints;
    let v = camera.vanishing_point_of_vertical();
    let m = x_u * bottom_weight + x_o * (1.0 - bottom_weight);
    let delta = x_o - x_u;
    let rise = v.truncate() - m * v.z;
    let e = rise.try_normalize()?;
    let (delta_e, delta_f) = (delta.dot(e), e.perp_dot(delta));

    let spread = v.z * v.z * bottom_weight * (1.0 - bottom_weight);
    let m_ef = spread * delta_e * delta_f;
    let m_ee_less_m_ff = rise.length_squared() + spread * (delta_e * delta_e - delta_f * delta_f);
    let phi = 0.5 * (2.0 * m_ef).atan2(m_ee_less_m_ff);
    let along = DVec2::from_angle(phi).rotate(e);
    let d = if v.z == 0.0 { 0.0 } else { -phi.sin() * rise.length() / v.z };
    let length = delta.dot(along);
    Some(VerticalLine {
        origin: m + along.perp() * d,
        along,
        s_u: -length * (1.0 - bottom_weight),
        s_o: length * bottom_weight,
    })
}

/// Eq. (6) for H = 1 after the shift: the sole relative to the centre of projection. It is proportional to H.
///
/// Row 6 is h_o = h_u + v_h. Rows 4 and 5 along the line are h_u s_u - h_o s_o + v' = 0, with v' the rise of
/// the origin of the line. Rows 1 to 3 are h_u x_u = K (R X_u + t).
fn sole_from_camera_per_metre(
    camera: &Camera,
    midpoints: &Midpoints,
    bottom_weight: f64,
) -> Result<DVec3, PositionError> {
    let Midpoints { bottom_px, top_px } = *midpoints;
    let at_vanishing_point = || PositionError::AtVanishingPoint { bottom_px, top_px };
    let line = nearest_vertical(camera, midpoints, bottom_weight).ok_or_else(at_vanishing_point)?;
    let v = camera.vanishing_point_of_vertical();
    let rise = (v.truncate() - line.origin * v.z).dot(line.along);
    let h_u = (rise - v.z * line.s_o) / (line.s_o - line.s_u);
    let h_o = h_u + v.z;
    if !(h_u > 0.0 && h_o > 0.0 && h_u.is_finite()) {
        return Err(at_vanishing_point());
    }
    let x_u = line.origin + line.along * line.s_u;
    let sole_in_camera = camera.intrinsics().inverse() * x_u.extend(1.0) * h_u;
    Ok(camera.rotation.transpose() * sole_in_camera)
}

fn plane_point(camera: &Camera, pixel: DVec2, z_m: f64) -> Result<DVec3, PositionError> {
    camera.point_at_height(pixel, z_m).ok_or(PositionError::NoIntersection { pixel, z_m })
}

/// Gauss-Newton on (X, Y), starting from the position of the feet or, failing that, of the head.
fn least_squares_on_ground(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
) -> Result<DVec3, PositionError> {
    let from_head = |_| plane_point(camera, midpoints.top_px, height_m);
    let start = plane_point(camera, midpoints.bottom_px, 0.0).or_else(from_head)?;
    let mut place = start.truncate();
    for _ in 0..50 {
        let Some(step) = ground_step(camera, midpoints, height_m, options, place) else { break };
        place += step;
        if step.length() <= 1e-11 * (1.0 + place.length()) {
            return Ok(place.extend(0.0));
        }
    }
    Err(PositionError::NoFit { bottom_px: midpoints.bottom_px, top_px: midpoints.top_px })
}

/// (Σ JᵀC⁻¹J)⁻¹ Σ JᵀC⁻¹r over the two midpoints, r = measured - projected.
fn ground_step(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
    place: DVec2,
) -> Option<DVec2> {
    // Both midpoints contain the one measured column: together they must count once.
    let column_variance = 2.0 * options.column_sd_px.powi(2);
    let diagonal = |row_sd: f64| DMat2::from_diagonal(DVec2::new(column_variance, row_sd * row_sd));
    let (sole, head) = (place.extend(0.0), place.extend(height_m));
    let (sole_slope, _) = projection_slope(camera, sole);
    let (head_slope, head_rise) = projection_slope(camera, head);
    let head_drift = head_rise * options.height_sd_m;
    let head_covariance =
        diagonal(options.top_sd_px) + DMat2::from_cols(head_drift * head_drift.x, head_drift * head_drift.y);
    let bottom =
        (midpoints.bottom_px - camera.project_ideal(sole)?, sole_slope, diagonal(options.bottom_sd_px));
    let top = (midpoints.top_px - camera.project_ideal(head)?, head_slope, head_covariance);

    let (mut normal, mut right) = (DMat2::ZERO, DVec2::ZERO);
    for (residual, slope, covariance) in [bottom, top] {
        let weighted = slope.transpose() * covariance.inverse();
        normal += weighted * slope;
        right += weighted * residual;
    }
    Some(normal.inverse() * right).filter(|step| step.is_finite())
}

/// Derivatives of the ideal pixel with respect to (X, Y) and to Z.
fn projection_slope(camera: &Camera, point_in_world: DVec3) -> (DMat2, DVec2) {
    let p = camera.camera_from_world(point_in_world);
    let column = |axis: DVec3| (axis.truncate() - p.truncate() / p.z * axis.z) / p.z * camera.focal_px;
    let rotation = &camera.rotation;
    (DMat2::from_cols(column(rotation.x_axis), column(rotation.y_axis)), column(rotation.z_axis))
}

/// Runs `solve` for the position of the sole and completes the result.
fn foot_position(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
    solve: impl Fn(&Midpoints, f64) -> Result<DVec3, PositionError>,
) -> Result<FootPosition, PositionError> {
    check_midpoints(camera, midpoints)?;
    check_options(options)?;
    if !(height_m > 0.0 && height_m.is_finite()) {
        return Err(PositionError::Height { height_m });
    }
    let point_in_world = solve(midpoints, height_m)?;
    let image_of = |point| {
        let Midpoints { bottom_px, top_px } = *midpoints;
        camera.project_ideal(point).ok_or(PositionError::AtVanishingPoint { bottom_px, top_px })
    };
    let (bottom_px, top_px) = (image_of(point_in_world)?, image_of(point_in_world + DVec3::Z * height_m)?);
    let covariance = covariance(midpoints, height_m, options, solve)?;
    let forward = camera.rotation.row(2);
    Ok(FootPosition {
        point_in_world,
        depth_m: camera.camera_from_world(point_in_world).z,
        bottom_px,
        top_px,
        bottom_shift_px: bottom_px.distance(midpoints.bottom_px),
        top_shift_px: top_px.distance(midpoints.top_px),
        covariance,
        depth_sd_m: forward.dot(covariance * forward).max(0.0).sqrt(),
    })
}

/// Σ J Jᵀ σ² over the independent measurements: centre column, bottom row, top row, height.
///
/// J by central differences; the steps are far below any standard deviation and far above rounding.
fn covariance(
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
    solve: impl Fn(&Midpoints, f64) -> Result<DVec3, PositionError>,
) -> Result<DMat3, PositionError> {
    const STEP_PX: f64 = 1e-3;
    const STEP_RELATIVE: f64 = 1e-5;
    let moved = |bottom: DVec2, top: DVec2, rise_m: f64| {
        let moved = Midpoints { bottom_px: midpoints.bottom_px + bottom, top_px: midpoints.top_px + top };
        solve(&moved, height_m + rise_m)
    };
    let (column, row, step_m) = (DVec2::X * STEP_PX, DVec2::Y * STEP_PX, height_m * STEP_RELATIVE);
    let steps = [
        (column, column, 0.0, options.column_sd_px / STEP_PX),
        (row, DVec2::ZERO, 0.0, options.bottom_sd_px / STEP_PX),
        (DVec2::ZERO, row, 0.0, options.top_sd_px / STEP_PX),
        (DVec2::ZERO, DVec2::ZERO, step_m, options.height_sd_m / step_m),
    ];
    let mut covariance = DMat3::ZERO;
    for (bottom, top, rise_m, sd_in_steps) in steps {
        let difference = moved(bottom, top, rise_m)? - moved(-bottom, -top, -rise_m)?;
        let spread = difference * (0.5 * sd_in_steps);
        covariance += DMat3::from_cols(spread * spread.x, spread * spread.y, spread * spread.z);
    }
    Ok(covariance)
}

/// Returns an error unless the midpoints are finite and the top is above the bottom along the image of the
/// vertical.
fn check_midpoints(camera: &Camera, midpoints: &Midpoints) -> Result<(), PositionError> {
    let Midpoints { bottom_px, top_px } = *midpoints;
    if !(bottom_px.is_finite() && top_px.is_finite()) {
        return Err(PositionError::NotFinite { bottom_px, top_px });
    }
    let v = camera.vanishing_point_of_vertical();
    let rise = v.truncate() - bottom_px * v.z;
    if (top_px - bottom_px).dot(rise) <= 0.0 {
        return Err(PositionError::UpsideDown { bottom_px, top_px });
    }
    Ok(())
}

fn check_options(options: &PositionOptions) -> Result<(), PositionError> {
    check_weight(options.bottom_weight)?;
    let sds = [
        ("column_sd_px", options.column_sd_px),
        ("bottom_sd_px", options.bottom_sd_px),
        ("top_sd_px", options.top_sd_px),
    ];
    for (option, value) in sds {
        check_option(option, "positive and finite", value, value > 0.0)?;
    }
    check_option(
        "height_sd_m",
        "zero or positive and finite",
        options.height_sd_m,
        options.height_sd_m >= 0.0,
    )
}

fn check_weight(value: f64) -> Result<(), PositionError> {
    check_option("bottom_weight", "between 0 and 1", value, (0.0..=1.0).contains(&value))
}

fn check_option(
    name: &'static str,
    wanted: &'static str,
    got: f64,
    is_in_range: bool,
) -> Result<(), PositionError> {
    Ok(OptionError::unless(is_in_range && got.is_finite(), name, wanted, got)?)
}

#[cfg(test)]
mod tests;
