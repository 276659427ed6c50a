use super::*;

const LEVEL: Camera = Camera {
    size: [1280, 720],
    focal_px: DVec2::splat(1000.0),
    centre_px: DVec2::new(639.5, 359.5),
    distortion: Distortion::None,
    rotation: DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::new(0.0, -1.0, 0.0)),
    translation: DVec3::ZERO,
};

/// A person of 1.8 m on a circle in front of a camera 3 m high that looks down.
fn sightings(pitch_rad: f64, roll_rad: f64) -> Vec<WalkerSighting> {
    let rotation = DMat3::from_rotation_z(roll_rad) * DMat3::from_rotation_x(pitch_rad) * LEVEL.rotation;
    let translation = rotation * DVec3::new(0.0, 0.0, -3.0);
    let camera = Camera { rotation, translation, ..LEVEL };
    let place = |i: i32| {
        let turn = f64::from(i) * 0.2;
        DVec3::new(2.0 * turn.cos(), 9.0 + 3.0 * turn.sin(), 0.0)
    };
    let sighting = |p: DVec3| {
        let [foot, head] = [p, p + DVec3::Z * 1.8].map(|p| camera.project(p).unwrap());
        WalkerSighting::from_rectangle(foot, head)
    };
    (0..30).map(place).map(sighting).collect()
}

#[test]
fn a_planted_camera_is_recovered() {
    let options = WalkerOptions { size: LEVEL.size, height_m: 1.8, lens: KnownLens::Nothing };
    let found = camera_from_walker(&sightings(0.25, 0.0), &options).unwrap();
    let value = |name: &str| found.estimates.iter().find(|e| e.name == name).unwrap().value;
    // The prior shifts it towards the image width of 1280 px, but only slightly.
    assert!((value("focal_px") - 1000.0).abs() < 0.5, "{}", value("focal_px"));
    assert!((value("pitch_deg").to_radians() - 0.25).abs() < 2e-4);
    assert!((value("height_m") - 3.0).abs() < 2e-3);
    assert!((found.camera.position().z - 3.0).abs() < 2e-3);
}

#[test]
fn a_known_lens_leaves_pitch_roll_and_height() {
    let (focal_px, centre_px) = (LEVEL.focal_px, LEVEL.centre_px);
    let lens = KnownLens::All { focal_px, centre_px, distortion: Distortion::None };
    let options = WalkerOptions { size: LEVEL.size, height_m: 1.8, lens };
    let found = camera_from_walker(&sightings(0.15, 0.02), &options).unwrap();
    assert!(found.estimates.iter().all(|e| e.name != "focal_px"));
    let roll = found.estimates.iter().find(|e| e.name == "roll_deg").unwrap().value;
    // The prior shifts it towards zero, but only slightly.
    assert!((roll.to_radians() - 0.02).abs() < 2e-3, "{roll}");
}

#[test]
fn runs_of_alike_values_are_counted() {
    let alternating: Vec<f64> = (0..100).map(|i| f64::from(i % 2)).collect();
    assert_eq!(alike(&alternating), 1.0);
    let runs: Vec<f64> = (0..400).map(|i| f64::from((i / 10) * 7919 % 13)).collect();
    assert!((5.0..15.0).contains(&alike(&runs)), "{}", alike(&runs));
    assert_eq!(alike(&[1.0, 1.0]), 1.0);
}

fn options(lens: KnownLens) -> WalkerOptions {
    WalkerOptions { size: LEVEL.size, height_m: 1.8, lens }
}

fn value(found: &WalkerCalibration, name: &str) -> Estimate {
    *found.estimates.iter().find(|e| e.name == name).unwrap()
}

/// A camera 3 m high that looks down.
fn looking_down(pitch_rad: f64, focal_px: DVec2) -> Camera {
    let rotation = DMat3::from_rotation_x(pitch_rad) * LEVEL.rotation;
    Camera { rotation, translation: rotation * DVec3::new(0.0, 0.0, -3.0), focal_px, ..LEVEL }
}

/// A person of 1.8 m, from one fraction of the height to another.
fn seen_at(camera: &Camera, places: &[DVec3], foot_share: f64, head_share: f64) -> Vec<WalkerSighting> {
    let pixel = |p: &DVec3, share: f64| camera.project(*p + DVec3::Z * 1.8 * share).unwrap();
    let sighting = |p| WalkerSighting {
        foot_px: pixel(p, foot_share),
        head_px: pixel(p, head_share),
        foot_share,
        head_share,
    };
    places.iter().map(sighting).collect()
}

/// A circle that ends where it begins.
fn circle() -> Vec<DVec3> {
    let turn = |i: i32| f64::from(i) * std::f64::consts::TAU / 32.0;
    (0..=32).map(|i| DVec3::new(2.0 * turn(i).cos(), 9.0 + 3.0 * turn(i).sin(), 0.0)).collect()
}

/// An oblique path in one direction.
fn one_way() -> Vec<DVec3> {
    (0..=32).map(|i| DVec3::new(-2.0 + 0.12 * f64::from(i), 6.0 + 0.2 * f64::from(i), 0.0)).collect()
}

#[test]
fn ankles_and_eyes_stand_where_they_are() {
    let camera = looking_down(0.25, LEVEL.focal_px);
    for (foot_share, head_share) in [(0.1, 1.0), (0.0, 0.8), (0.05, 0.9)] {
        let found = camera_from_walker(
            &seen_at(&camera, &circle(), foot_share, head_share),
            &options(KnownLens::Nothing),
        )
        .unwrap();
        assert!((value(&found, "focal_px").value - 1000.0).abs() < 0.5);
        assert!((value(&found, "height_m").value - 3.0).abs() < 3e-3);
        // The feet are seen above their positions on the ground.
        for (place, planted) in found.places.iter().zip(circle()) {
            let ground = camera.project(planted).unwrap();
            assert!(found.camera.project(*place).unwrap().distance(ground) < 0.2, "{place}");
        }
        let mean = found.places.iter().sum::<DVec3>() / found.places.len() as f64;
        assert!(mean.length() < 1e-9);
    }
}

#[test]
fn a_known_lens_may_have_oblong_pixels() {
    let camera = looking_down(0.2, DVec2::new(1000.0, 850.0));
    let lens = KnownLens::All {
        focal_px: camera.focal_px,
        centre_px: camera.centre_px,
        distortion: Distortion::None,
    };
    let found = camera_from_walker(&seen_at(&camera, &circle(), 0.0, 1.0), &options(lens)).unwrap();
    assert!((value(&found, "pitch_deg").value.to_radians() - 0.2).abs() < 1e-4);
    assert!((value(&found, "height_m").value - 3.0).abs() < 1e-3 && found.rms_px < 0.05);
}

/// Standard deviations of the parameters if each coordinate of head and foot has unit variance, from
/// derivatives of the camera's own ground point and projection. The priors on roll (2 degrees) and focal
/// length (a factor of e about the image width) have the weight of a sighting with an error of half a
/// hundredth.
fn unit_deviations(camera: &Camera, sightings: &[WalkerSighting]) -> [f64; 4] {
    let heights: Vec<f64> = sightings.iter().map(|s| s.head_px.distance(s.foot_px)).collect();
    let noise_px = 0.005 * median(heights);
    let heads = |change: [f64; 4]| -> Vec<f64> {
        let rotation =
            DMat3::from_rotation_z(change[2]) * DMat3::from_rotation_x(change[1]) * camera.rotation;
        let position = camera.position() + DVec3::Z * change[3];
        let moved = Camera {
            focal_px: camera.focal_px + change[0],
            rotation,
            translation: -(rotation * position),
            ..camera.clone()
        };
        let head = |s: &WalkerSighting| {
            moved.project(moved.ground_point(s.foot_px).unwrap() + DVec3::Z * 1.8).unwrap().to_array()
        };
        let mut all: Vec<f64> = sightings.iter().flat_map(head).map(|v| v / 2f64.sqrt()).collect();
        all.extend([change[2] / 2f64.to_radians() * noise_px, (moved.focal_px.x / 1280.0).ln() * noise_px]);
        all
    };
    let count = heads([0.0; 4]).len();
    let jacobian = nalgebra::DMatrix::from_fn(count, 4, |row, column| {
        let mut change = [0.0; 4];
        change[column] = 1e-6;
        let ahead = heads(change)[row];
        change[column] = -1e-6;
        (ahead - heads(change)[row]) / 2e-6
    });
    let covariance = jacobian.tr_mul(&jacobian).try_inverse().unwrap();
    std::array::from_fn(|i| covariance[(i, i)].sqrt())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Without noise only the lean remains: two hundredths of the height, common to all sightings, if the person
/// walks in one direction; none if the person comes back.
#[test]
fn a_walk_one_way_may_lean() {
    let camera = looking_down(0.25, LEVEL.focal_px);
    let sightings = seen_at(&camera, &one_way(), 0.0, 1.0);
    let found = camera_from_walker(&sightings, &options(KnownLens::Nothing)).unwrap();
    let units = unit_deviations(&camera, &sightings);
    let lean_px = 0.02 * found.person_px * (sightings.len() as f64).sqrt();
    for (name, unit) in [("focal_px", units[0]), ("height_m", units[3])] {
        let sd = value(&found, name).sd;
        assert!((sd / (unit * lean_px) - 1.0).abs() < 0.02, "{name}: {sd} {}", unit * lean_px);
    }
    for (name, unit) in [("pitch_deg", units[1]), ("roll_deg", units[2])] {
        let sd = value(&found, name).sd.to_radians();
        assert!((sd / (unit * lean_px) - 1.0).abs() < 0.02, "{name}: {sd} {}", unit * lean_px);
    }
    let back =
        camera_from_walker(&seen_at(&camera, &circle(), 0.0, 1.0), &options(KnownLens::Nothing)).unwrap();
    assert!(back.estimates.iter().all(|e| e.sd < 1e-2 * value(&found, e.name).sd), "{:?}", back.estimates);
}

/// Independent noise of each sighting on a closed path: the standard deviations follow it.
#[test]
fn noise_makes_the_deviations_of_a_walk_back() {
    let camera = looking_down(0.25, LEVEL.focal_px);
    let exact = seen_at(&camera, &circle(), 0.0, 1.0);
    let mut random = crate::synth::Random::new(5);
    let mut noisy = || DVec2::from(random.normal_pair().map(f64::from));
    let sightings: Vec<WalkerSighting> = exact
        .iter()
        .map(|s| WalkerSighting { foot_px: s.foot_px + noisy(), head_px: s.head_px + noisy(), ..*s })
        .collect();
    let found = camera_from_walker(&sightings, &options(KnownLens::Nothing)).unwrap();
    // Head and foot together have twice the variance, along both axes.
    assert!((1.6..2.4).contains(&found.rms_px), "{}", found.rms_px);
    assert!(found.outliers.len() <= 1, "{:?}", found.outliers);
    let units = unit_deviations(&camera, &sightings);
    for (name, unit) in [("focal_px", units[0]), ("height_m", units[3])] {
        let sd = value(&found, name).sd / found.alike.sqrt();
        assert!((0.75..1.25).contains(&(sd / unit)), "{name}: {sd} {unit}");
    }
}

#[test]
fn mistaken_sightings_are_left_out() {
    let mut sightings = seen_at(&looking_down(0.25, LEVEL.focal_px), &circle(), 0.0, 1.0);
    let mut random = crate::synth::Random::new(6);
    for sighting in &mut sightings {
        sighting.head_px += DVec2::from(random.normal_pair().map(f64::from)) * 0.5;
    }
    sightings[7].head_px.y += 12.0;
    sightings[20].foot_px.x -= 12.0;
    let found = camera_from_walker(&sightings, &options(KnownLens::Nothing)).unwrap();
    assert_eq!(found.outliers, [7, 20]);
    assert!((0.4..1.0).contains(&found.rms_px), "{}", found.rms_px);
}

#[test]
fn walks_that_do_not_tell_the_camera_are_refused() {
    let refused =
        |sightings: &[WalkerSighting], lens| camera_from_walker(sightings, &options(lens)).unwrap_err();
    // Walking parallel to the image plane of a level camera: closer with a shorter focal length looks the
    // same.
    let across: Vec<DVec3> = (0..20).map(|i| DVec3::new(-1.5 + 0.15 * f64::from(i), 8.0, 0.0)).collect();
    let sightings = seen_at(&looking_down(0.0, LEVEL.focal_px), &across, 0.0, 1.0);
    assert!(matches!(refused(&sightings, KnownLens::Nothing), WalkerError::FocalUnknown { .. }));
    // Standing still: a lower camera with less pitch sees the same.
    let still = seen_at(&looking_down(0.1, LEVEL.focal_px), &[DVec3::new(0.0, 30.0, 0.0); 12], 0.0, 1.0);
    let error = refused(&still, KnownLens::Focal(1000.0));
    assert!(matches!(error, WalkerError::PitchUnknown { .. }), "{error}");
}

#[test]
fn what_is_no_walk_is_refused() {
    let camera = looking_down(0.25, LEVEL.focal_px);
    let good = seen_at(&camera, &circle(), 0.0, 1.0);
    let refused = |sightings: &[WalkerSighting]| {
        camera_from_walker(sightings, &options(KnownLens::Nothing)).unwrap_err()
    };
    let turned = |count: usize| -> Vec<WalkerSighting> {
        let upside_down =
            |s: &WalkerSighting| WalkerSighting { foot_px: s.head_px, head_px: s.foot_px, ..*s };
        good.iter().enumerate().map(|(i, s)| if i < count { upside_down(s) } else { *s }).collect()
    };
    assert_eq!(refused(&turned(17)), WalkerError::UpsideDown { count: 17, total: 33 });
    assert!(!matches!(
        camera_from_walker(&turned(16), &options(KnownLens::Nothing)),
        Err(WalkerError::UpsideDown { .. })
    ));
    // Heights that vary between half and one and a half of a person's height are not a person.
    let wild: Vec<WalkerSighting> = good
        .iter()
        .enumerate()
        .map(|(i, s)| WalkerSighting {
            head_px: s.foot_px.lerp(s.head_px, 0.5 + (i * 7 % 11) as f64 / 10.0),
            ..*s
        })
        .collect();
    let error = refused(&wild);
    assert!(matches!(error, WalkerError::NoCamera { rms_px, .. } if rms_px.is_finite()), "{error}");
    assert_eq!(refused(&good[..3]), WalkerError::TooFew { count: 3 });
}

#[test]
fn runs_of_ten_are_ten_alike() {
    let mut random = crate::synth::Random::new(9);
    let runs: Vec<f64> = (0..1000).map(|_| f64::from(random.normal_pair()[0])).collect();
    let values: Vec<f64> = runs.iter().flat_map(|v| [*v; 10]).collect();
    assert!((8.5..11.5).contains(&alike(&values)), "{}", alike(&values));
}

/// Ankles that pass each other every 15 frames, with an ear, an eye and a nose above them.
fn strides(frames: usize, names: &[&str]) -> Vec<Vec<DVec2>> {
    (0..frames)
        .map(|t| {
            let apart = 40.0 * (std::f64::consts::PI * (t as f64 - 7.0) / 15.0).sin();
            let place = |name: &&str| match *name {
                "right_ankle" => DVec2::new(300.0 + apart, 500.0),
                "left_ankle" => DVec2::new(300.0 - apart, 494.0),
                "nose" => DVec2::new(305.0, 212.0),
                "right_ear" => DVec2::new(301.0, 206.0),
                "left_ear" => DVec2::new(299.0, 208.0),
                _ => DVec2::new(304.0, 204.0),
            };
            names.iter().map(place).collect()
        })
        .collect()
}

#[test]
fn sightings_are_where_the_ankles_pass() {
    let names = ["right_ankle", "left_ankle", "nose"];
    let found = sightings_from_joints(&names, &strides(150, &names));
    // Frames 7, 22, 37 and so on.
    assert_eq!(found.len(), 10);
    assert!(found.iter().all(|s| s.foot_px == DVec2::new(300.0, 500.0)));
    assert_eq!(found[0].head_px, DVec2::new(305.0, 212.0));
    // Too few such frames: all frames are returned.
    assert_eq!(sightings_from_joints(&names, &strides(105, &names)).len(), 105);
}

/// Heights of detected points as fractions of body height: eyes 0.936 and ankles 0.039 after Drillis and
/// Contini 1966 (in Winter 2009, fig. 4.1), tragions 0.925 and malleoli 0.0415 from the means of 4082 men in
/// Gordon and others 2014.
#[test]
fn points_are_as_high_as_on_a_body() {
    let shares = |names: &[&str]| {
        let found = sightings_from_joints(names, &strides(2, names));
        (found[0].foot_share, found[0].head_share, found[0].head_px)
    };
    let (foot, ears, place) = shares(&["right_ankle", "left_ankle", "nose", "left_ear", "right_ear"]);
    assert!((foot - 0.04).abs() < 0.003 && (ears - 0.925).abs() < 0.003);
    assert_eq!(place, DVec2::new(300.0, 207.0));
    let (_, eyes, _) = shares(&["right_ankle", "left_ankle", "nose", "left_eye"]);
    assert!((eyes - 0.936).abs() < 0.003);
    // Between the chin, 0.870, and the eyes.
    let (_, nose, _) = shares(&["right_ankle", "left_ankle", "nose"]);
    assert!((0.89..0.925).contains(&nose), "{nose}");
}
