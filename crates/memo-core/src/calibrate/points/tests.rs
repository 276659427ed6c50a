use super::*;
use proptest::prelude::*;

fn planted(focal_px: f64, turn: DVec3, depth_m: f64) -> Camera {
    let level = Camera::level([1280, 720], 1.0, 1.5, depth_m).unwrap();
    let rotation = DMat3::from_quat(DQuat::from_scaled_axis(turn)) * level.rotation;
    let centre = DVec3::new(0.0, 0.0, 1.0);
    // The midpoint of the points stays in front of the camera, at the requested depth.
    let translation = DVec3::Z * depth_m - rotation * centre;
    Camera { focal_px: DVec2::splat(focal_px), rotation, translation, ..level }
}

/// Ten points on two walls that fill the image of a camera with a field of view of 45 degrees.
fn walls(size: [u32; 2]) -> (Camera, Vec<DVec3>, Vec<DVec2>) {
    let camera = Camera::level(size, 45_f64.to_radians(), 1.5, 5.0).unwrap();
    let places: Vec<DVec3> = (0..10)
        .map(|i| {
            let [row, column] = [i / 5, i % 5].map(f64::from);
            DVec3::new(0.7 * column - 1.4, 0.4 * column + 1.5 * row, 0.8 + 1.1 * row + 0.1 * column)
        })
        .collect();
    let pixels = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    (camera, places, pixels)
}

#[test]
fn a_planted_camera_is_recovered_in_pictures_of_any_size() {
    // In the smallest image the pixels do not determine the focal length, so it is given.
    for (size, is_known) in [
        ([16, 12], true),
        ([97, 31], true),
        ([180, 144], false),
        ([240, 180], false),
        ([266, 200], false),
        ([320, 240], false),
        ([1920, 1080], false),
        ([8000, 6000], false),
    ] {
        let (camera, places, pixels) = walls(size);
        let focal_px = camera.focal_px.x;
        let lens = if is_known { KnownLens::Focal(focal_px) } else { KnownLens::Nothing };
        let found = camera_from_points(&places, &pixels, &PointOptions { size, lens }).unwrap();
        assert!((found.camera.focal_px.x / focal_px - 1.0).abs() < 1e-5, "{size:?}");
        assert!((found.camera.position() - camera.position()).length() < 1e-4, "{size:?}");
    }
}

#[test]
fn a_mistaken_point_of_a_small_picture_is_left_out() {
    let (camera, places, mut pixels) = walls([180, 144]);
    pixels[3].x += 25.0;
    let options = PointOptions { size: camera.size, lens: KnownLens::Nothing };
    let found = camera_from_points(&places, &pixels, &options).unwrap();
    assert_eq!(found.outliers, [3]);
    assert!((found.camera.position() - camera.position()).length() < 1e-3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_planted_camera_is_recovered(
        focal_px in 600.0..2500.0_f64, turn in prop::array::uniform3(-0.8..0.8_f64), depth_m in 4.0..9.0_f64,
        points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 8..14),
    ) {
        let camera = planted(focal_px, DVec3::from(turn), depth_m);
        let places: Vec<DVec3> =
            points.into_iter().map(|p| DVec3::new(1.5 * p[0], 1.5 * p[1], 1.0 + p[2])).collect();
        prop_assume!(Shape::of(&places).ratios[1] > 0.2);
        let pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
        let options = PointOptions { size: camera.size, lens: KnownLens::Nothing };
        let found = match camera_from_points(&places, &pixels, &options) {
            // Some draws do not determine the focal length, which is a correct answer as well.
            Err(PointError::FocalUnknown { .. }) => return Ok(()),
            found => found.unwrap(),
        };
        prop_assert!((found.camera.focal_px.x / focal_px - 1.0).abs() < 1e-5, "{}", found.camera.focal_px);
        prop_assert!((found.camera.position() - camera.position()).length() < 1e-4);
        prop_assert!(found.outliers.is_empty() && found.rms_px < 1e-4);
    }

    #[test]
    fn no_input_makes_it_panic(
        points in prop::collection::vec(prop::array::uniform3(prop::num::f64::ANY), 0..9),
        pixels in prop::collection::vec(prop::array::uniform2(-1e7..1e7_f64), 0..9),
        size in prop::array::uniform2(0_u32..700),
    ) {
        let places: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
        let pixels: Vec<DVec2> = pixels.into_iter().map(DVec2::from).collect();
        let options = PointOptions { size, lens: KnownLens::Nothing };
        if let Ok(found) = camera_from_points(&places, &pixels, &options) {
            prop_assert!(found.camera.validated().is_ok());
        }
    }
}

#[test]
fn the_shape_of_points_does_not_depend_on_their_unit() {
    for unit in [1e-3, 1.0, 1e3] {
        let corners: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)))
            .map(|corner| unit * DVec3::new(4.0, 2.0, 1.0) * corner)
            .collect();
        let shape = Shape::of(&corners);
        assert!((shape.ratios[0] - 0.5).abs() < 1e-9 && (shape.ratios[1] - 0.25).abs() < 1e-9, "{shape:?}");
        assert!((shape.normal.z.abs() - 1.0).abs() < 1e-9);
    }
}

/// Points that fill the image, and a camera that is turned slightly.
fn scattered(count: usize, seed: u64) -> (Camera, Vec<DVec3>) {
    let camera = planted(900.0, DVec3::new(0.1, -0.15, 0.05), 6.0);
    let mut random = crate::synth::Random::new(seed);
    let places = (0..count).map(|_| {
        let [x, y, z] = std::array::from_fn(|_| random.uniform(-1.0, 1.0));
        DVec3::new(2.5 * x, 2.0 * y, 1.0 + 1.2 * z)
    });
    (camera, places.collect())
}

fn with_noise(pixels: &mut [DVec2], sd_px: f64, seed: u64) {
    let mut random = crate::synth::Random::new(seed);
    for pixel in pixels {
        *pixel += DVec2::from(random.normal_pair().map(f64::from)) * sd_px;
    }
}

fn calibrated(
    camera: &Camera,
    places: &[DVec3],
    pixels: &[DVec2],
    lens: KnownLens,
) -> Result<PointCalibration, PointError> {
    camera_from_points(places, pixels, &PointOptions { size: camera.size, lens })
}

fn names(found: &PointCalibration) -> Vec<&'static str> {
    found.estimates.iter().map(|estimate| estimate.name).collect()
}

/// Standard deviations of the focal length and of the camera position, from derivatives of the projection
/// with respect to these parameters and three small rotations.
fn deviations(camera: &Camera, places: &[DVec3], noise_px: f64) -> Vec<f64> {
    let pixels = |change: [f64; 7]| -> Vec<f64> {
        let turn = DQuat::from_scaled_axis(DVec3::new(change[4], change[5], change[6]));
        let rotation = DMat3::from_quat(turn) * camera.rotation;
        let position = camera.position() + DVec3::new(change[1], change[2], change[3]);
        let focal_px = camera.focal_px + change[0];
        let moved = Camera { focal_px, rotation, translation: -(rotation * position), ..camera.clone() };
        places.iter().flat_map(|p| moved.project(*p).unwrap().to_array()).collect()
    };
    let jacobian = DMatrix::from_fn(2 * places.len(), 7, |row, column| {
        let mut change = [0.0; 7];
        change[column] = 1e-5;
        let ahead = pixels(change)[row];
        change[column] = -1e-5;
        (ahead - pixels(change)[row]) / 2e-5
    });
    let covariance = jacobian.tr_mul(&jacobian).try_inverse().unwrap() * noise_px.powi(2);
    (0..4).map(|i| covariance[(i, i)].sqrt()).collect()
}

#[test]
fn deviations_are_those_of_the_projection() {
    let (camera, places) = scattered(14, 1);
    let mut pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    with_noise(&mut pixels, 0.4, 2);
    let found = calibrated(&camera, &places, &pixels, KnownLens::Nothing).unwrap();
    assert_eq!(names(&found), ["focal_px", "x_m", "y_m", "z_m"]);
    assert!(found.outliers.is_empty());
    let sum_sq: f64 =
        places.iter().zip(&pixels).map(|(p, q)| found.camera.project(*p).unwrap().distance_squared(*q)).sum();
    assert!((found.rms_px - (sum_sq / 14.0).sqrt()).abs() < 1e-9);
    assert_eq!(found.degrees_of_freedom, 21);
    assert!((found.noise_px - ((sum_sq + 1.0) / 22.0).sqrt()).abs() < 1e-9);
    let expected = deviations(&found.camera, &places, found.noise_px);
    for (estimate, sd) in found.estimates.iter().zip(expected) {
        assert!((estimate.sd / sd - 1.0).abs() < 1e-3, "{estimate:?} {sd}");
    }
    let place = found.camera.position();
    assert!(place.distance(camera.position()) < 4.0 * found.estimates[1..].iter().map(|e| e.sd).sum::<f64>());
    assert!((found.camera.focal_px.x - 900.0).abs() < 4.0 * found.estimates[0].sd);
}

/// A principal point away from the centre and a distortion are found if the points determine them.
#[test]
fn a_planted_lens_is_recovered() {
    let (camera, places) = scattered(60, 3);
    let distortion = Distortion::from_opencv([-0.24, 0.07, 0.0, 0.0, 0.0]);
    let camera = Camera { centre_px: DVec2::new(655.0, 350.0), distortion, ..camera };
    let pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    let found = calibrated(&camera, &places, &pixels, KnownLens::Nothing).unwrap();
    assert_eq!(names(&found)[..5], ["focal_px", "centre_u_px", "centre_v_px", "k1", "k2"]);
    for (estimate, value) in found.estimates.iter().zip([900.0, 655.0, 350.0, -0.24, 0.07]) {
        assert!((estimate.value - value).abs() < 1e-4 * value.abs(), "{estimate:?}");
    }
    assert!(found.rms_px < 1e-4, "{}", found.rms_px);
}

/// Noise alone leads to neither a principal point nor a distortion.
#[test]
fn a_plain_lens_stays_plain() {
    for seed in 0..4 {
        let (camera, places) = scattered(20, 10 + seed);
        let mut pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
        with_noise(&mut pixels, 0.5, seed);
        let found = calibrated(&camera, &places, &pixels, KnownLens::Nothing).unwrap();
        assert_eq!(names(&found), ["focal_px", "x_m", "y_m", "z_m"], "{seed}");
    }
}

/// m ln(S / m) + 2 p + 2 p (p + 1) / (m - p - 1): Hurvich and Tsai 1989 for m normal residuals and p
/// parameters with the variance.
#[test]
fn the_criterion_is_the_published_one() {
    let (camera, places) = scattered(12, 5);
    let mut pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    with_noise(&mut pixels, 0.7, 6);
    let options = PointOptions { size: camera.size, lens: KnownLens::Nothing };
    let problem = Problem::new(&places, &pixels, &options).unwrap();
    let found = problem.fitted().unwrap();
    assert_eq!(found.free.len(), 7);
    let seen = problem.camera(&found.state);
    let sum_sq: f64 =
        places.iter().zip(&pixels).map(|(p, q)| seen.project(*p).unwrap().distance_squared(*q)).sum();
    let expected = 24.0 * (sum_sq / 24.0).ln() + 16.0 + 2.0 * 8.0 * 9.0 / 15.0;
    let criterion = problem.criterion(&found, &(0..12).collect::<Vec<_>>()).unwrap();
    assert!((criterion - expected).abs() < 1e-9, "{criterion} {expected}");
}

/// Every point is measured to half a pixel, except one or two.
#[test]
fn mistaken_points_are_left_out() {
    let (camera, places) = scattered(14, 7);
    let exact: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    for wrong in [vec![], vec![4], vec![0, 9]] {
        let mut pixels = exact.clone();
        with_noise(&mut pixels, 0.5, 8);
        wrong.iter().for_each(|&i| pixels[i] += DVec2::new(12.0, -9.0));
        let found = calibrated(&camera, &places, &pixels, KnownLens::Nothing).unwrap();
        assert_eq!(found.outliers, wrong);
        assert!((0.2..1.0).contains(&found.noise_px), "{}", found.noise_px);
        for &i in &wrong {
            assert!(
                found.residuals_px[i].distance(DVec2::new(-12.0, 9.0)) < 3.0,
                "{}",
                found.residuals_px[i]
            );
        }
    }
}

/// A plane seen straight on does not determine the focal length; an oblique one does.
#[test]
fn a_plane_head_on_does_not_tell_the_focal_length() {
    let board: Vec<DVec3> =
        (0..20).map(|i| DVec3::new(f64::from(i % 5) - 2.0, 0.0, f64::from(i / 5))).collect();
    let seen = |turn: f64| {
        let level = Camera::level([1280, 720], 1.0, 1.5, 8.0).unwrap();
        let places: Vec<DVec3> = board.iter().map(|p| DMat3::from_rotation_z(turn) * *p).collect();
        let mut pixels: Vec<DVec2> = places.iter().map(|p| level.project(*p).unwrap()).collect();
        with_noise(&mut pixels, 0.3, 3);
        calibrated(&level, &places, &pixels, KnownLens::Nothing)
    };
    assert!(matches!(seen(0.0), Err(PointError::FocalUnknown { relative_sd }) if relative_sd > 0.25));
    let found = seen(0.8).unwrap();
    assert!(found.is_planar && (found.camera.focal_px.x / 1171.5 - 1.0).abs() < 0.05, "{found:?}");
}

/// Points on the ground also fit a mirrored image, with the camera below the ground.
#[test]
fn a_mirrored_ground_is_refused() {
    let camera = planted(900.0, DVec3::new(0.6, 0.1, 0.0), 6.0);
    let places: Vec<DVec3> =
        (0..12).map(|i| DVec3::new(f64::from(i % 4) - 1.5, f64::from(i / 4) - 1.0, 0.3)).collect();
    let pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    let lens = KnownLens::Focal(900.0);
    assert!(calibrated(&camera, &places, &pixels, lens).is_ok());
    let mirrored: Vec<DVec2> = pixels.iter().map(|p| DVec2::new(1279.0 - p.x, p.y)).collect();
    assert_eq!(calibrated(&camera, &places, &mirrored, lens), Err(PointError::Mirrored));
}

/// A known lens with oblong pixels and distortion: residuals are in the given pixels.
#[test]
fn a_known_lens_is_taken_as_it_is() {
    let (camera, places) = scattered(14, 9);
    let (focal_px, centre_px) = (DVec2::new(900.0, 780.0), DVec2::new(650.0, 352.0));
    let distortion = Distortion::from_opencv([-0.2, 0.05, 1e-3, -2e-3, 0.0]);
    let camera = Camera { focal_px, centre_px, distortion, ..camera };
    let mut pixels: Vec<DVec2> = places.iter().map(|p| camera.project(*p).unwrap()).collect();
    pixels[5] += DVec2::new(0.0, 30.0);
    let lens = KnownLens::All { focal_px, centre_px, distortion };
    let found = calibrated(&camera, &places, &pixels, lens).unwrap();
    assert!(found.camera.position().distance(camera.position()) < 1e-5);
    assert_eq!((names(&found).len(), found.outliers), (3, vec![5]));
    for (i, residual) in found.residuals_px.iter().enumerate() {
        let expected = if i == 5 { DVec2::new(0.0, -30.0) } else { DVec2::ZERO };
        assert!(residual.distance(expected) < 1e-3, "{i}: {residual}");
    }
}
