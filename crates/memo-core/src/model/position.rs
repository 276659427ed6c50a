//! Where a person stands, from the rectangle around the image region (Rohr 1994, section 4.2, eqs. 2-6).
//!
//! The midpoints of the rectangle's bottom and top edges are taken for the sole and the top of the head of an
//! upright person of known height H. The paper's Y axis is our Z: H = (0, 0, H, 0)ᵀ.
//!
//! | function | uses | depth hangs on |
//! |---|---|---|
//! | [`position_from_rectangle`] | both midpoints, eq. (6) | the rectangle's height; the ground is not used |
//! | [`position_from_feet`] | bottom midpoint, ground z = 0 | the bottom row and the camera's calibration |
//! | [`position_from_head`] | top midpoint, plane z = H | the top row, H and the calibration |
//! | [`position_on_ground`] | all of these, weighted | whichever is certain |
//!
//! A rectangle's height is a poor gauge of depth: one per cent of it is one per cent of depth, and
//! reflections, shadows or missed feet change it by more. With a calibrated ground prefer
//! [`position_on_ground`].
//!
//! One rectangle only: nothing is filtered over time, and a stooped or seated person is placed wrongly.

use glam::{DMat2, DMat3, DVec2, DVec3};
use thiserror::Error;

use super::camera::{Camera, CameraError};

/// The midpoints of a rectangle's bottom and top edges, ideal pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Midpoints {
    /// x_u, the sole.
    pub bottom_px: DVec2,
    /// x_o, the top of the head.
    pub top_px: DVec2,
}

impl Midpoints {
    /// From midpoints measured in the image, which the lens has bent.
    pub fn undistorted(camera: &Camera, bottom_px: DVec2, top_px: DVec2) -> Result<Self, CameraError> {
        Ok(Self { bottom_px: camera.undistort(bottom_px)?, top_px: camera.undistort(top_px)? })
    }
}

/// How certain the measurements are.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionOptions {
    /// Share in [0, 1] of the bottom midpoint when both are shifted onto a vertical line; 1 leaves it in
    /// place.
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
    /// For regions found by change detection around walkers 200 to 400 pixels tall.
    fn default() -> Self {
        Self {
            // The nearest line: neither end is known to be better centred.
            bottom_weight: 0.5,
            // Arms and feet swing the centre of a walker's rectangle by 0.07-0.1 m.
            column_sd_px: 10.0,
            // Feet merge with their shadow and reflection, or are missed on dark ground.
            bottom_sd_px: 4.0,
            // A head is compact and seldom touches anything.
            top_sd_px: 2.0,
            // Adult stature varies by 0.07 m within one sex.
            height_sd_m: 0.07,
        }
    }
}

/// A standing place, and what it makes of the rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct FootPosition {
    /// X_u, the sole in the world, metres. Eq. (6) alone does not put it on the ground.
    pub point_in_world: DVec3,
    /// h_u, depth of the sole along the optical axis, metres.
    pub depth_m: f64,
    /// Image of the sole, ideal pixels: for eq. (6) the shifted bottom midpoint.
    pub bottom_px: DVec2,
    /// Image of the top of the head, ideal pixels: for eq. (6) the shifted top midpoint.
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
    /// An option is out of its range.
    #[error("{option} must be {expected}, got {value}")]
    Option {
        /// Field of [`PositionOptions`].
        option: &'static str,
        /// Its range.
        expected: &'static str,
        /// Its value.
        value: f64,
    },
    /// A midpoint is NaN or infinite.
    #[error("midpoints must be finite, got bottom {bottom_px}, top {top_px}")]
    NotFinite {
        /// Bottom midpoint, pixels.
        bottom_px: DVec2,
        /// Top midpoint, pixels.
        top_px: DVec2,
    },
    /// The top midpoint is not above the bottom one, along the image of the vertical.
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
    /// A ray does not meet its plane in front of the camera.
    #[error("the ray through pixel {pixel} does not meet the plane z = {z_m} m in front of the camera")]
    NoIntersection {
        /// The ideal pixel.
        pixel: DVec2,
        /// Height of the plane, metres.
        z_m: f64,
    },
    /// The least-squares search for the standing place did not settle.
    #[error("no standing place fits bottom midpoint {bottom_px} and top midpoint {top_px}")]
    NoFit {
        /// Bottom midpoint, pixels.
        bottom_px: DVec2,
        /// Top midpoint, pixels.
        top_px: DVec2,
    },
}

/// Position by eq. (6): the last three equations hold exactly after the shift, the first three give X_u.
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
/// The height only serves to say where the head should have been seen.
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

/// Position from the top midpoint alone: the head on the plane z = H, the sole below it on the ground.
///
/// Useless where the camera is at head height (the plane is seen edge-on); the covariance says so.
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
/// Minimises the squared distances of the sole's and the head's image from the midpoints, each in units of
/// its standard deviation; an uncertain height widens the head's along the image of the vertical.
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

/// The height H with which eq. (6) puts the sole on the ground z = 0, metres.
///
/// `bottom_weight` as in [`PositionOptions`].
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

/// A line through the vertical vanishing point and the places of both midpoints on it.
struct VerticalLine {
    /// A point of the line, pixels.
    origin: DVec2,
    /// Unit direction in which the image of a point moves when it rises.
    along: DVec2,
    /// Place of the shifted bottom midpoint from `origin`, pixels.
    s_u: f64,
    /// Place of the shifted top midpoint from `origin`, pixels.
    s_o: f64,
}

/// Projects the midpoints onto the nearest line through the vertical vanishing point v = T (0, 0, 1, 0)ᵀ.
///
/// With the bottom's weight w let m = w x_u + (1-w) x_o, δ = x_o - x_u and v' = v_xy - v_h m. A line nᵀ(x -
/// m) = d through v has d = nᵀv' / v_h and the weighted sum of squared distances nᵀ(w (1-w) δ δᵀ + v' v'ᵀ /
/// v_h²) n. Times v_h² that stays finite for v at infinity (v_h = 0). In the basis e = v'/|v'| and f across
/// it the matrix M has its greatest axis, the line's direction, turned from e by φ with tan 2φ = 2 M_ef /
/// (M_ee - M_ff).
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

/// Eq. (6) for H = 1 after the shift: the sole as seen from the centre of projection. It is proportional to
/// H.
///
/// Row 6 is h_o = h_u + v_h; rows 4 and 5 along the line are h_u s_u - h_o s_o + v' = 0, with v' the rise of
/// the line's origin; rows 1 to 3 are h_u x_u = K (R X_u + t).
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

/// Gauss-Newton on (X, Y), from the feet's place or else the head's.
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
    // Both midpoints carry the one measured column: together they must count once.
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

/// Derivative of the ideal pixel by (X, Y), and by Z.
fn projection_slope(camera: &Camera, point_in_world: DVec3) -> (DMat2, DVec2) {
    let p = camera.camera_from_world(point_in_world);
    let column = |axis: DVec3| (axis.truncate() - p.truncate() / p.z * axis.z) / p.z * camera.focal_px;
    let rotation = &camera.rotation;
    (DMat2::from_cols(column(rotation.x_axis), column(rotation.y_axis)), column(rotation.z_axis))
}

/// Runs `solve` for the sole's place and describes the answer.
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
/// J by central differences; the steps are far below any sd and far above rounding.
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

/// Finite, and the top above the bottom along the image of the vertical.
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
    option: &'static str,
    expected: &'static str,
    value: f64,
    is_in_range: bool,
) -> Result<(), PositionError> {
    if is_in_range && value.is_finite() {
        Ok(())
    } else {
        Err(PositionError::Option { option, expected, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6x5, Vector5, Vector6};
    use proptest::prelude::*;

    fn level() -> Camera {
        Camera::level([960, 540], 0.9, 1.3, 6.0).unwrap()
    }

    /// The level camera turned about its own centre.
    fn turned(roll: f64, pitch: f64, yaw: f64) -> Camera {
        let level = level();
        let turn = DMat3::from_rotation_z(roll) * DMat3::from_rotation_x(pitch) * DMat3::from_rotation_y(yaw);
        let rotation = turn * level.rotation;
        Camera { translation: rotation * -level.position(), rotation, ..level }
    }

    fn seen(camera: &Camera, sole: DVec3, height_m: f64) -> Option<Midpoints> {
        let bottom_px = camera.project_ideal(sole)?;
        Some(Midpoints { bottom_px, top_px: camera.project_ideal(sole + DVec3::Z * height_m)? })
    }

    fn options() -> PositionOptions {
        PositionOptions::default()
    }

    /// T* X* + b* of eq. (6) as printed, with the paper's second column our third.
    fn equation_6(camera: &Camera, found: &FootPosition, height_m: f64) -> Vector6<f64> {
        let t = camera.matrix();
        let (x_u, x_o, foot) = (found.bottom_px, found.top_px, found.point_in_world);
        let mut t_star = Matrix6x5::zeros();
        t_star.fixed_view_mut::<3, 3>(0, 0).copy_from(&t.fixed_view::<3, 3>(0, 0));
        let ends = [x_u.extend(1.0).to_array(), x_o.extend(1.0).to_array()];
        for row in 0..3 {
            t_star[(row, 3)] = -ends[0][row];
            t_star[(row + 3, 3)] = ends[0][row];
            t_star[(row + 3, 4)] = -ends[1][row];
        }
        let b = Vector6::from_fn(|i, _| if i < 3 { t[(i, 3)] } else { height_m * t[(i - 3, 2)] });
        let h_o = camera.camera_from_world(foot + DVec3::Z * height_m).z;
        t_star * Vector5::new(foot.x, foot.y, foot.z, found.depth_m, h_o) + b
    }

    #[test]
    fn a_level_camera_reads_depth_off_the_height() {
        let camera = level();
        let midpoints = Midpoints { bottom_px: DVec2::new(500.0, 400.0), top_px: DVec2::new(504.0, 200.0) };
        let found = position_from_rectangle(&camera, &midpoints, 1.7, &options()).unwrap();
        assert!((found.depth_m - camera.focal_px.y * 1.7 / 200.0).abs() < 1e-12);
        // Verticals are parallel columns: both midpoints move to the middle one.
        assert!((found.bottom_px - DVec2::new(502.0, 400.0)).length() < 1e-10);
        assert!((found.top_px - DVec2::new(502.0, 200.0)).length() < 1e-10);
        assert!((found.bottom_shift_px - 2.0).abs() < 1e-10);
    }

    #[test]
    fn a_nearly_level_camera_agrees_with_a_level_one() {
        let midpoints = Midpoints { bottom_px: DVec2::new(500.0, 400.0), top_px: DVec2::new(504.0, 200.0) };
        let at =
            |pitch| position_from_rectangle(&turned(0.0, pitch, 0.0), &midpoints, 1.7, &options()).unwrap();
        for pitch in [1e-6, 1e-9, 1e-12, 1e-15, 1e-170] {
            let difference = at(pitch).point_in_world - at(0.0).point_in_world;
            assert!(difference.length() < 20.0 * pitch + 1e-12, "{pitch}: {difference}");
        }
    }

    #[test]
    fn weight_one_leaves_the_bottom_where_it_is() {
        let camera = turned(0.1, 0.4, 0.2);
        let midpoints = Midpoints { bottom_px: DVec2::new(500.0, 420.0), top_px: DVec2::new(560.0, 180.0) };
        let shifts = |bottom_weight| {
            let options = PositionOptions { bottom_weight, ..options() };
            let found = position_from_rectangle(&camera, &midpoints, 1.7, &options).unwrap();
            (found.bottom_shift_px, found.top_shift_px)
        };
        assert!(shifts(1.0).0 < 1e-9 && shifts(1.0).1 > 5.0);
        assert!(shifts(0.0).1 < 1e-9 && shifts(0.0).0 > 5.0);
        let (bottom, top) = shifts(0.5);
        let sum = |w| shifts(w).0.powi(2) + shifts(w).1.powi(2);
        assert!(bottom > 1.0 && top > 1.0 && sum(0.5) < sum(0.45) && sum(0.5) < sum(0.55));
    }

    #[test]
    fn a_reflection_spoils_the_rectangle_but_not_the_head() {
        let camera = turned(0.0, 0.1, 0.0);
        let camera = Camera { translation: camera.rotation * -DVec3::new(0.0, -6.0, 3.0), ..camera };
        let sole = DVec3::new(0.5, 0.0, 0.0);
        let mut midpoints = seen(&camera, sole, 1.7).unwrap();
        midpoints.bottom_px.y += 0.15 * midpoints.bottom_px.distance(midpoints.top_px);
        let certain_head =
            PositionOptions { bottom_sd_px: 40.0, top_sd_px: 1.0, height_sd_m: 0.02, ..options() };
        let miss =
            |found: Result<FootPosition, PositionError>| (found.unwrap().point_in_world - sole).length();
        assert!(miss(position_from_rectangle(&camera, &midpoints, 1.7, &certain_head)) > 0.6);
        assert!(miss(position_from_head(&camera, &midpoints, 1.7, &certain_head)) < 1e-9);
        assert!(miss(position_on_ground(&camera, &midpoints, 1.7, &certain_head)) < 0.15);
    }

    #[test]
    fn a_certain_row_rules_the_fit() {
        let camera = turned(0.0, 0.2, 0.0);
        let mut midpoints = seen(&camera, DVec3::new(0.4, 1.0, 0.0), 1.7).unwrap();
        midpoints.top_px.y += 12.0;
        let fit = |o| position_on_ground(&camera, &midpoints, 1.7, &o).unwrap().point_in_world;
        let feet = position_from_feet(&camera, &midpoints, 1.7, &options()).unwrap().point_in_world;
        let head = position_from_head(&camera, &midpoints, 1.7, &options()).unwrap().point_in_world;
        let sure = |bottom_sd_px, top_sd_px, height_sd_m| {
            fit(PositionOptions { bottom_sd_px, top_sd_px, height_sd_m, ..options() })
        };
        assert!((feet - head).length() > 0.2);
        assert!((sure(1e-4, 10.0, 0.0) - feet).length() < 2e-2);
        assert!((sure(10.0, 1e-4, 0.0) - head).length() < 2e-2);
        // A height nobody knows leaves the feet alone.
        assert!((sure(1.0, 1.0, 1e3) - feet).length() < 2e-2);
    }

    #[test]
    fn the_fit_is_the_likeliest_place_and_height() {
        let camera = turned(0.3, 0.3, 0.2);
        let options = PositionOptions {
            column_sd_px: 1.5,
            bottom_sd_px: 5.0,
            top_sd_px: 0.7,
            height_sd_m: 0.02,
            ..options()
        };
        let mut midpoints = seen(&camera, DVec3::new(0.6, 1.5, 0.0), 1.7).unwrap();
        midpoints.bottom_px += DVec2::new(1.0, 4.0);
        midpoints.top_px += DVec2::new(1.0, -1.0);
        // Minus twice the logarithm of the likelihood, least over the height.
        let cost = |place: DVec2| {
            let at_height = |height: f64| {
                let model = seen(&camera, place.extend(0.0), height).unwrap();
                let (b, t) = (midpoints.bottom_px - model.bottom_px, midpoints.top_px - model.top_px);
                (b.x * b.x + t.x * t.x) / (2.0 * 1.5 * 1.5)
                    + (b.y / 5.0).powi(2)
                    + (t.y / 0.7).powi(2)
                    + ((height - 1.7) / 0.02).powi(2)
            };
            (0..400).map(|i| at_height(1.6 + f64::from(i) * 5e-4)).fold(f64::INFINITY, f64::min)
        };
        let found = position_on_ground(&camera, &midpoints, 1.7, &options).unwrap().point_in_world.truncate();
        for turn in 0..8 {
            let aside = DVec2::from_angle(f64::from(turn) * std::f64::consts::FRAC_PI_4) * 0.005;
            assert!(cost(found) < cost(found + aside), "{aside}");
        }
    }

    #[test]
    fn no_person_fits_these() {
        let camera = level();
        let good = Midpoints { bottom_px: DVec2::new(500.0, 400.0), top_px: DVec2::new(500.0, 200.0) };
        let text = |m: Midpoints, h, o: PositionOptions| {
            position_on_ground(&camera, &m, h, &o).unwrap_err().to_string()
        };
        assert_eq!(text(good, -1.0, options()), "person height must be positive and finite metres, got -1");
        assert!(text(good, 0.0, options()).ends_with("got 0"));
        assert!(text(good, f64::NAN, options()).ends_with("got NaN"));
        let swapped = Midpoints { bottom_px: good.top_px, top_px: good.bottom_px };
        assert_eq!(
            text(swapped, 1.7, options()),
            "rectangle upside down or without height: top midpoint [500, 400] is not above bottom midpoint [500, 200]"
        );
        assert!(
            text(Midpoints { top_px: good.bottom_px, ..good }, 1.7, options()).contains("without height")
        );
        assert!(text(Midpoints { top_px: DVec2::NAN, ..good }, 1.7, options()).contains("must be finite"));
        let options_with =
            |column_sd_px, bottom_weight| PositionOptions { column_sd_px, bottom_weight, ..options() };
        assert_eq!(
            text(good, 1.7, options_with(0.0, 0.5)),
            "column_sd_px must be positive and finite, got 0"
        );
        assert_eq!(text(good, 1.7, options_with(1.0, 1.5)), "bottom_weight must be between 0 and 1, got 1.5");
        let above_horizon = Midpoints { bottom_px: DVec2::new(500.0, 260.0), ..good };
        let error = position_from_feet(&camera, &above_horizon, 1.7, &options()).unwrap_err();
        assert!(error.to_string().contains("does not meet the plane z = 0 m in front"), "{error}");
        assert!(matches!(
            height_on_ground(&camera, &above_horizon, 0.5),
            Err(PositionError::NoIntersection { .. })
        ));
    }

    #[test]
    fn a_person_around_the_vertical_vanishing_point_is_refused() {
        // Looking straight down from 3 m: verticals spread from the centre of the image.
        let camera = turned(0.0, std::f64::consts::FRAC_PI_2, 0.0);
        let c = camera.centre_px;
        let across = Midpoints { bottom_px: c - DVec2::Y * 80.0, top_px: c + DVec2::Y * 20.0 };
        let error = position_from_rectangle(&camera, &across, 1.2, &options()).unwrap_err();
        assert!(matches!(error, PositionError::UpsideDown { .. }), "{error}");
        let outward = Midpoints { bottom_px: c + DVec2::Y * 80.0, top_px: c + DVec2::Y * 200.0 };
        assert!(position_from_rectangle(&camera, &outward, 1.2, &options()).is_ok());
        // Looking straight up: what stands on the ground points inward, and no further than the centre.
        let camera = turned(0.0, -std::f64::consts::FRAC_PI_2, 0.0);
        let past = Midpoints { bottom_px: c + DVec2::Y * 80.0, top_px: c - DVec2::Y * 20.0 };
        let error = position_from_rectangle(&camera, &past, 1.2, &options()).unwrap_err();
        assert!(matches!(error, PositionError::AtVanishingPoint { .. }), "{error}");
    }

    /// Rays cast by hand through the shifted midpoints: the sole lies on the one, the head, as much higher as the
    /// person is, on the other.
    #[test]
    fn sole_and_head_lie_on_the_rays_through_the_shifted_midpoints() {
        let camera = turned(0.15, 0.35, 0.2);
        let midpoints = Midpoints { bottom_px: DVec2::new(500.0, 420.0), top_px: DVec2::new(540.0, 180.0) };
        let found = position_from_rectangle(&camera, &midpoints, 1.7, &options()).unwrap();
        let ray = |pixel: DVec2| {
            let (x, y) = ((pixel.x - 479.5) / camera.focal_px.x, (pixel.y - 269.5) / camera.focal_px.y);
            let r = camera.rotation;
            let row = |v: DVec3| DVec3::new(v.dot(r.x_axis), v.dot(r.y_axis), v.dot(r.z_axis));
            row(DVec3::new(x, y, 1.0)).normalize()
        };
        let from = camera.position();
        let distance = |point: DVec3, pixel: DVec2| ray(pixel).cross(point - from).length();
        assert!(distance(found.point_in_world, found.bottom_px) < 1e-9);
        assert!(distance(found.point_in_world + DVec3::Z * 1.7, found.top_px) < 1e-9);
        // The places on both rays that come nearest to being one below the other.
        let [a, b] = [found.bottom_px, found.top_px].map(ray);
        let gap = |s: f64, t: f64| (from + b * t - from - a * s - DVec3::Z * 1.7).length();
        let (s, t) =
            ((found.point_in_world - from).length(), (found.point_in_world + DVec3::Z * 1.7 - from).length());
        assert!(gap(s, t) < 1e-9 && gap(s * 1.001, t) > 1e-3 && gap(s, t * 1.001) > 1e-3);
    }

    /// Limbs swing the middle of a walker's rectangle by 0.07 to 0.1 m: with the default options the place of one
    /// 200 to 300 pixels high is as uncertain aside.
    #[test]
    fn a_walker_is_as_uncertain_as_limbs_swing() {
        let camera = level();
        for height_px in [200.0, 250.0, 280.0] {
            let midpoints = Midpoints {
                bottom_px: DVec2::new(480.0, 400.0),
                top_px: DVec2::new(480.0, 400.0 - height_px),
            };
            let found = position_from_rectangle(&camera, &midpoints, 1.7, &options()).unwrap();
            let aside_m = found.covariance.x_axis.x.sqrt();
            assert!((0.06..0.1).contains(&aside_m), "{height_px}: {aside_m}");
        }
    }

    proptest! {
        #[test]
        fn a_planted_person_is_recovered_by_every_way(
            roll in -0.4..0.4_f64, pitch in -0.3..1.4_f64, yaw in -0.5..0.5_f64,
            x in -3.0..3.0_f64, y in -4.0..15.0_f64, height in 0.9..2.1_f64, bottom_weight in 0.0..=1.0_f64,
        ) {
            let (camera, sole) = (turned(roll, pitch, yaw), DVec3::new(x, y, 0.0));
            let Some(midpoints) = seen(&camera, sole, height) else { return Ok(()) };
            let depth = camera.camera_from_world(sole).z;
            let is_seen_end_on = midpoints.bottom_px.distance(midpoints.top_px) < 20.0;
            prop_assume!(depth > 0.3 && depth - height > 0.3 && !is_seen_end_on);
            let options = PositionOptions { bottom_weight, ..options() };
            let ways = [position_from_rectangle, position_from_feet, position_on_ground];
            for (way, find) in ways.into_iter().enumerate() {
                let found = find(&camera, &midpoints, height, &options).unwrap();
                prop_assert!((found.point_in_world - sole).length() < 1e-7, "{way}: {}", found.point_in_world);
                prop_assert!(found.bottom_shift_px < 1e-7 && found.top_shift_px < 1e-7);
            }
            if (height - 1.3).abs() > 0.05 {
                let found = position_from_head(&camera, &midpoints, height, &options).unwrap();
                prop_assert!((found.point_in_world - sole).length() < 1e-7);
            }
            prop_assert!((height_on_ground(&camera, &midpoints, bottom_weight).unwrap() - height).abs() < 1e-8);
        }

        #[test]
        fn equation_6_holds_exactly_after_the_shift(
            roll in -0.4..0.4_f64, pitch in -0.3..0.8_f64, column in 100.0..900.0_f64, lean in -40.0..40.0_f64,
            bottom in 300.0..530.0_f64, span in 40.0..280.0_f64, bottom_weight in 0.0..=1.0_f64,
        ) {
            let camera = turned(roll, pitch, 0.0);
            let top_px = DVec2::new(column + lean, bottom - span);
            let midpoints = Midpoints { bottom_px: DVec2::new(column, bottom), top_px };
            let options = PositionOptions { bottom_weight, ..options() };
            let Ok(found) = position_from_rectangle(&camera, &midpoints, 1.7, &options) else {
                return Err(TestCaseError::reject("no person"));
            };
            let residual = equation_6(&camera, &found, 1.7);
            prop_assert!(residual.amax() < 1e-8 * (1.0 + found.depth_m), "{residual}");
            // No other line through the vanishing point is nearer.
            let v = camera.vanishing_point_of_vertical();
            let cost = |turn: f64| {
                let through = DVec2::from_angle(turn).rotate(found.top_px - found.bottom_px).normalize();
                let anchor = if v.z.abs() < 1e-9 { found.bottom_px } else { v.truncate() / v.z };
                let distance = |p: DVec2| through.perp_dot(p - anchor);
                bottom_weight * distance(midpoints.bottom_px).powi(2)
                    + (1.0 - bottom_weight) * distance(midpoints.top_px).powi(2)
            };
            prop_assert!(cost(0.0) <= cost(1e-4) && cost(0.0) <= cost(-1e-4));
        }

        #[test]
        fn covariance_is_the_spread_of_noisy_answers(
            pitch in 0.05..0.6_f64, x in -1.0..1.0_f64, y in 0.0..4.0_f64, way in 0..3_usize,
        ) {
            let camera = turned(0.0, pitch, 0.0);
            let options = PositionOptions {
                column_sd_px: 0.1, bottom_sd_px: 0.05, top_sd_px: 0.08, height_sd_m: 0.002, ..options()
            };
            let find = [position_from_rectangle, position_from_feet, position_on_ground][way];
            let midpoints = seen(&camera, DVec3::new(x, y, 0.0), 1.7).unwrap();
            let found = find(&camera, &midpoints, 1.7, &options).unwrap();
            // All sixteen corners of the cube of one sd have exactly the unit covariance.
            let mut spread = DMat3::ZERO;
            for corner in 0..16 {
                let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let column = DVec2::X * options.column_sd_px * sign(0);
                let noisy = Midpoints {
                    bottom_px: midpoints.bottom_px + column + DVec2::Y * options.bottom_sd_px * sign(1),
                    top_px: midpoints.top_px + column + DVec2::Y * options.top_sd_px * sign(2),
                };
                let height = 1.7 + options.height_sd_m * sign(3);
                let off = find(&camera, &noisy, height, &options).unwrap().point_in_world - found.point_in_world;
                spread += DMat3::from_cols(off * off.x, off * off.y, off * off.z) * (1.0 / 16.0);
            }
            let largest = found.covariance.to_cols_array().iter().fold(0.0, |m: f64, c| m.max(c.abs()));
            prop_assert!(spread.abs_diff_eq(found.covariance, 0.02 * largest), "{spread}\n{}", found.covariance);
        }
    }
}
