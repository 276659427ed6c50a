use super::*;
use nalgebra::{Matrix6x5, Vector5, Vector6};
use proptest::prelude::*;

fn level() -> Camera {
    Camera::level([960, 540], 0.9, 1.3, 6.0).unwrap()
}

/// The level camera rotated about its own centre.
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

/// T* X* + b* of eq. (6) as printed; the paper's second column is our third.
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
    // Verticals are parallel columns: both midpoints move to the column halfway between them.
    assert!((found.bottom_px - DVec2::new(502.0, 400.0)).length() < 1e-10);
    assert!((found.top_px - DVec2::new(502.0, 200.0)).length() < 1e-10);
    assert!((found.bottom_shift_px - 2.0).abs() < 1e-10);
}

#[test]
fn a_nearly_level_camera_agrees_with_a_level_one() {
    let midpoints = Midpoints { bottom_px: DVec2::new(500.0, 400.0), top_px: DVec2::new(504.0, 200.0) };
    let at = |pitch| position_from_rectangle(&turned(0.0, pitch, 0.0), &midpoints, 1.7, &options()).unwrap();
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
    let certain_head = PositionOptions { bottom_sd_px: 40.0, top_sd_px: 1.0, height_sd_m: 0.02, ..options() };
    let miss = |found: Result<FootPosition, PositionError>| (found.unwrap().point_in_world - sole).length();
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
    // With an unknown height the position is that of the feet.
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
    // Minus twice the log-likelihood, minimised over the height.
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
    let text =
        |m: Midpoints, h, o: PositionOptions| position_on_ground(&camera, &m, h, &o).unwrap_err().to_string();
    assert_eq!(text(good, -1.0, options()), "person height must be positive and finite metres, got -1");
    assert!(text(good, 0.0, options()).ends_with("got 0"));
    assert!(text(good, f64::NAN, options()).ends_with("got NaN"));
    let swapped = Midpoints { bottom_px: good.top_px, top_px: good.bottom_px };
    assert_eq!(
        text(swapped, 1.7, options()),
        "rectangle upside down or without height: top midpoint [500, 400] is not above bottom midpoint [500, 200]"
    );
    assert!(text(Midpoints { top_px: good.bottom_px, ..good }, 1.7, options()).contains("without height"));
    assert!(text(Midpoints { top_px: DVec2::NAN, ..good }, 1.7, options()).contains("must be finite"));
    let options_with =
        |column_sd_px, bottom_weight| PositionOptions { column_sd_px, bottom_weight, ..options() };
    assert_eq!(text(good, 1.7, options_with(0.0, 0.5)), "column_sd_px must be positive and finite, got 0");
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
    // Looking straight down from 3 m: verticals diverge from the centre of the image.
    let camera = turned(0.0, std::f64::consts::FRAC_PI_2, 0.0);
    let c = camera.centre_px;
    let across = Midpoints { bottom_px: c - DVec2::Y * 80.0, top_px: c + DVec2::Y * 20.0 };
    let error = position_from_rectangle(&camera, &across, 1.2, &options()).unwrap_err();
    assert!(matches!(error, PositionError::UpsideDown { .. }), "{error}");
    let outward = Midpoints { bottom_px: c + DVec2::Y * 80.0, top_px: c + DVec2::Y * 200.0 };
    assert!(position_from_rectangle(&camera, &outward, 1.2, &options()).is_ok());
    // Looking straight up: an upright person on the ground points towards the centre of the image, but not
    // beyond it.
    let camera = turned(0.0, -std::f64::consts::FRAC_PI_2, 0.0);
    let past = Midpoints { bottom_px: c + DVec2::Y * 80.0, top_px: c - DVec2::Y * 20.0 };
    let error = position_from_rectangle(&camera, &past, 1.2, &options()).unwrap_err();
    assert!(matches!(error, PositionError::AtVanishingPoint { .. }), "{error}");
}

/// Rays through the shifted midpoints, computed independently: the sole lies on one ray; the head, higher by
/// the height of the person, lies on the other.
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
    // The points on both rays that come closest to lying one below the other.
    let [a, b] = [found.bottom_px, found.top_px].map(ray);
    let gap = |s: f64, t: f64| (from + b * t - from - a * s - DVec3::Z * 1.7).length();
    let (s, t) =
        ((found.point_in_world - from).length(), (found.point_in_world + DVec3::Z * 1.7 - from).length());
    assert!(gap(s, t) < 1e-9 && gap(s * 1.001, t) > 1e-3 && gap(s, t * 1.001) > 1e-3);
}

/// Limbs move the centre of a walker's rectangle by 0.07 to 0.1 m: with the default options, the sideways
/// position of a walker 200 to 300 pixels high has that uncertainty.
#[test]
fn a_walker_is_as_uncertain_as_limbs_swing() {
    let camera = level();
    for height_px in [200.0, 250.0, 280.0] {
        let midpoints =
            Midpoints { bottom_px: DVec2::new(480.0, 400.0), top_px: DVec2::new(480.0, 400.0 - height_px) };
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
        // No other line through the vanishing point is closer.
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
        // The sixteen corners of the cube of one standard deviation have exactly the unit covariance.
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
