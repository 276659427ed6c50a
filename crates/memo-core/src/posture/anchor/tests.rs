use super::*;
use crate::model::skeleton::StickFigure;
use glam::DMat3;
use proptest::prelude::*;

/// A person upright with legs slightly apart, facing an azimuth, seen by a level camera at 1.2 m.
fn standing(
    lengths: &SegmentLengths,
    distance_m: f64,
    azimuth_rad: f64,
    stride_rad: f64,
) -> (StickFigure, Ground) {
    let trunk = trunk::rigid_trunk(lengths);
    let turn = DMat3::from_rotation_y(azimuth_rad);
    let mut figure = StickFigure::UNKNOWN;
    for joint in Joint::ALL {
        if trunk[joint].is_finite() {
            figure[joint] = turn * trunk[joint];
        }
    }
    for (side, swing) in [(Side::Right, stride_rad), (Side::Left, -stride_rad)] {
        let leg = turn * DVec3::new(swing.sin(), swing.cos(), 0.0);
        figure[side.knee()] = figure[side.hip()] + leg * lengths.to[side.knee()];
        figure[side.ankle()] = figure[side.knee()] + leg * lengths.to[side.ankle()];
    }
    let ankle = AnchorOptions::default().ankle_height_over_shank * lengths.to[Joint::RightAnkle];
    let shift = DVec3::new(0.2, 1.2 - ankle - figure[Joint::RightAnkle].y, distance_m);
    for joint in Joint::ALL {
        figure[joint] += shift;
    }
    (figure, Ground { up_in_camera: -DVec3::Y, camera_height_m: 1.2 })
}

/// Lengths are certain, so that the planted distance must be found.
fn exact() -> AnchorOptions {
    AnchorOptions { scale_sd: 0.001, length_sd: 0.002, ankle_height_sd_m: 0.005, ..AnchorOptions::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    /// All facing directions, including the trunk perpendicular to the view and edge on.
    #[test]
    fn a_planted_distance_is_found(
        distance in 2.0..9.0_f64, azimuth in 0.0..std::f64::consts::TAU, stride in 0.0..0.4_f64, height in 1.4..2.0_f64,
    ) {
        let lengths = SegmentLengths::from_height(height).unwrap();
        let (figure, ground) = standing(&lengths, distance, azimuth, stride);
        let rays = JointRays { noise_rad: 1e-5, ..JointRays::from_points(&figure) };
        let truth = figure[Joint::Neck].length();
        let up = Some(ground.up_in_camera);
        let trunk = from_trunk(&rays, &lengths, up, &exact()).unwrap();
        prop_assert!((trunk.anchor.distance_m / truth - 1.0).abs() < 0.02, "{trunk:?} {truth}");
        let ground = from_ground(&rays, &lengths, &ground, &exact()).unwrap();
        prop_assert!((ground.distance_m - truth).abs() < 3.0 * ground.sd_depth_m, "{ground:?} {truth}");
        prop_assert!((ground.distance_m / truth - 1.0).abs() < 0.05, "{ground:?} {truth}");
        let extent = from_extent(&rays, &lengths, up, &exact()).unwrap();
        prop_assert!((extent.distance_m - truth).abs() < 3.0 * extent.sd_depth_m, "{extent:?} {truth}");
    }
}

/// The mirror attitude of a trunk at an oblique angle fits nearly as well, at nearly the same distance.
#[test]
fn the_trunks_mirror_attitude_is_kept() {
    let lengths = SegmentLengths::from_height(1.75).unwrap();
    let (figure, ground) = standing(&lengths, 6.0, 0.6, 0.1);
    let rays = JointRays { noise_rad: 5e-4, ..JointRays::from_points(&figure) };
    let fit = from_trunk(&rays, &lengths, Some(ground.up_in_camera), &AnchorOptions::default()).unwrap();
    assert!(fit.attitudes.len() >= 2, "{:?}", fit.attitudes);
    let [a, b] = [fit.attitudes[0], fit.attitudes[1]];
    assert!((a.depth.distance_m - b.depth.distance_m).abs() < a.depth.sd_m);
    // Mirrored through the image: the depth components of the facing directions are opposite.
    let facing = |a: &TrunkAttitude| a.camera_from_trunk.z_axis.z;
    assert!(
        (facing(&a) + facing(&b)).abs() < 0.25 && facing(&a).abs() > 0.3,
        "{} {}",
        facing(&a),
        facing(&b)
    );
    let sum: f64 = fit.attitudes.iter().map(|a| a.depth.probability).sum();
    assert!((sum - 1.0).abs() < 1e-12);
}

#[test]
fn sources_combine_by_their_variances_and_conflicts_are_told() {
    let ray = DVec3::new(0.1, 0.0, 1.0).normalize();
    let anchor = |d, sd, source| Anchor::single(ray, d, sd, 0.0, source);
    let a = anchor(4.0, 0.1, AnchorSource::Ground);
    let both = combine(&[a.clone(), anchor(4.1, 0.2, AnchorSource::Trunk)]).unwrap();
    assert!((both.anchor.distance_m - 4.02).abs() < 1e-12 && both.conflicts.is_empty());
    assert!((both.anchor.sd_depth_m - (0.8f64.powi(2) * 0.01 + 0.2f64.powi(2) * 0.04).sqrt()).abs() < 1e-12);
    let far = combine(&[a.clone(), anchor(5.0, 0.1, AnchorSource::Trunk)]).unwrap();
    let [conflict] = far.conflicts[..] else { panic!("{far:?}") };
    assert!((conflict.sigmas - 1.0 / 0.02f64.sqrt()).abs() < 1e-9);
    assert_eq!(conflict.distances_m, [4.0, 5.0]);
    assert!(far.anchor.sd_depth_m > 0.45, "{far:?}");
    assert_eq!(combine(&[]), Err(AnchorError::Empty));
    let other = Anchor::single(DVec3::Z, 4.0, 0.1, 0.0, AnchorSource::Head);
    assert!(matches!(combine(&[a, other]), Err(AnchorError::DifferentRays { .. })));
}

#[test]
fn bad_input_is_refused_with_its_values() {
    let lengths = SegmentLengths::from_height(1.75).unwrap();
    let (mut figure, ground) = standing(&lengths, 4.0, 0.0, 0.1);
    let rays = JointRays::from_points(&figure);
    let options = AnchorOptions::default();
    assert!(from_given(&rays, f64::NAN, 0.1).unwrap_err().to_string().contains("NaN"));
    assert!(from_given(&rays, 4.0, 0.0).is_err());
    let bad = AnchorOptions { length_sd: -0.1, ..options };
    assert!(from_ground(&rays, &lengths, &ground, &bad).is_err());
    assert!(from_trunk(&rays, &lengths, Some(DVec3::ZERO), &options).is_err());
    assert!(from_extent(&rays, &lengths, Some(DVec3::NAN), &options).is_err());
    let below = Ground { camera_height_m: -1.0, ..ground };
    assert!(from_ground(&rays, &lengths, &below, &options).is_err());
    let mut broken = lengths;
    broken.to[Joint::Pelvis] = f64::INFINITY;
    assert!(from_trunk(&rays, &broken, None, &options).is_err());
    // One leg is enough; no leg is not, nor is a frame without the neck.
    figure[Joint::RightKnee] = DVec3::NAN;
    let one_leg = from_ground(&JointRays::from_points(&figure), &lengths, &ground, &options).unwrap();
    assert!((one_leg.distance_m - figure[Joint::Neck].length()).abs() < 3.0 * one_leg.sd_depth_m);
    figure[Joint::LeftAnkle] = DVec3::NAN;
    let error = from_ground(&JointRays::from_points(&figure), &lengths, &ground, &options).unwrap_err();
    assert!(error.to_string().contains("ground") && error.to_string().contains("one side"), "{error}");
    figure[Joint::Neck] = DVec3::NAN;
    let error = from_given(&JointRays::from_points(&figure), 4.0, 0.1).unwrap_err();
    assert!(matches!(error, AnchorError::NotSeen { missing: "neck", .. }));
}

#[test]
fn a_density_of_two_summits_has_two_modes() {
    let distances: Vec<f64> = (0..200).map(|i| 3.0 + 0.01 * f64::from(i)).collect();
    let bump = |x: f64, m: f64| (-0.5 * ((x - m) / 0.05).powi(2)).exp();
    let density: Vec<f64> = distances.iter().map(|&x| bump(x, 3.5) + 0.5 * bump(x, 4.2)).collect();
    let anchor = anchor_of_density(DVec3::Z, &distances, &density, 0.0, AnchorSource::Ground).unwrap();
    let [first, second] = anchor.modes[..] else { panic!("{anchor:?}") };
    assert!((first.distance_m - 3.5).abs() < 0.01 && (second.distance_m - 4.2).abs() < 0.01);
    assert!((first.probability - 2.0 / 3.0).abs() < 0.01 && (first.sd_m - 0.05).abs() < 0.005);
}

/// Two sources of 5 cm with a common scale part of 4 cm: only their own 3 cm average out.
#[test]
fn what_sources_share_does_not_average_out() {
    let ray = DVec3::Z;
    let anchor = |d, source| Anchor::single(ray, d, 0.05, 0.04, source);
    let both = combine(&[anchor(4.0, AnchorSource::Ground), anchor(4.02, AnchorSource::Trunk)]).unwrap();
    let expected = (0.03f64 * 0.03 / 2.0 + 0.04 * 0.04).sqrt();
    assert!((both.anchor.sd_depth_m - expected).abs() < 1e-12, "{both:?}");
    assert!((both.anchor.sd_scale_m - 0.04).abs() < 1e-12);
    // 15 cm apart is 3.54 deviations of the difference, which does not contain the common part.
    let apart = combine(&[anchor(4.0, AnchorSource::Ground), anchor(4.15, AnchorSource::Trunk)]).unwrap();
    let [conflict] = apart.conflicts[..] else { panic!("{apart:?}") };
    assert!((conflict.sigmas - 0.15 / (2.0 * 0.03f64 * 0.03).sqrt()).abs() < 1e-9);
    // One source has no scale part: the scale of the other one is in the difference.
    let given = Anchor::single(ray, 4.15, 0.03, 0.0, AnchorSource::Given);
    let found = combine(&[anchor(4.0, AnchorSource::Ground), given]).unwrap();
    assert!(found.conflicts.is_empty(), "{found:?}");
}

/// A standing person, seen as rays, with the neck's true distance.
fn seen(azimuth: f64) -> (JointRays, SegmentLengths, DVec3, f64) {
    let lengths = SegmentLengths::from_height(1.75).unwrap();
    let (figure, ground) = standing(&lengths, 5.0, azimuth, 0.2);
    (JointRays::from_points(&figure), lengths, ground.up_in_camera, figure[Joint::Neck].length())
}

/// All causes of the extent's deviation as small as possible.
fn hardly_any() -> AnchorOptions {
    AnchorOptions { scale_sd: 0.0, balance_sd_m: 1e-9, ..AnchorOptions::default() }
}

/// Each part of the extent's deviation against the change of distance for a small change of its cause.
#[test]
fn the_extent_is_as_unsure_as_its_causes_make_it() {
    let (rays, lengths, up, _) = seen(0.4);
    let distance =
        |rays: &JointRays| from_extent(rays, &lengths, Some(up), &hardly_any()).unwrap().distance_m;
    let sd = |rays: &JointRays, options: &AnchorOptions| {
        from_extent(rays, &lengths, Some(up), options).unwrap().sd_depth_m
    };
    // Only the rise: 0.022 of 0.943 of the distance.
    let rise = sd(&rays, &hardly_any());
    let expected = distance(&rays) * 0.022 / 0.943;
    assert!((rise / expected - 1.0).abs() < 1e-6, "{rise} {expected}");
    let beside = |sd: f64| (sd * sd - rise * rise).sqrt();
    // Image noise of neck and ankles, each ray rotated in two directions.
    let noise_rad = 1e-3;
    let mut square = 0.0;
    for joint in [Joint::Neck, Joint::RightAnkle, Joint::LeftAnkle] {
        let (e1, e2) = rays.ray[joint].any_orthonormal_pair();
        for e in [e1, e2] {
            let moved = |sign: f64| {
                let mut moved = rays;
                moved.ray[joint] = (rays.ray[joint] + sign * 1e-6 * e).normalize();
                distance(&moved)
            };
            square += ((moved(1.0) - moved(-1.0)) / 2e-6).powi(2);
        }
    }
    let found = beside(sd(&JointRays { noise_rad, ..rays }, &hardly_any()));
    // The formula uses the exact slope across the vertical for both directions.
    let ratio = found / (noise_rad * square.sqrt());
    assert!((1.0..1.1).contains(&ratio), "{ratio}");
    // The ankles 10 cm from the neck's vertical, to the side and to the front.
    let neck = 5.0 * rays.ray[Joint::Neck];
    let standing = |aside: DVec3| {
        let feet = (neck - up * 0.943 * standing_span_m(&lengths) + aside).normalize();
        let mut moved = rays;
        (moved.ray[Joint::RightAnkle], moved.ray[Joint::LeftAnkle]) = (feet, feet);
        moved
    };
    let square: f64 = [DVec3::X, DVec3::Z]
        .map(|aside| distance(&standing(1e-5 * aside)) - distance(&standing(-1e-5 * aside)))
        .map(|change| (change / 2e-5).powi(2))
        .iter()
        .sum();
    let rays = standing(DVec3::ZERO);
    let [rise, found] =
        [1e-9, 0.1].map(|balance_sd_m| sd(&rays, &AnchorOptions { balance_sd_m, ..hardly_any() }));
    let found = (found * found - rise * rise).sqrt();
    assert!((found / (0.1 * square.sqrt()) - 1.0).abs() < 0.01, "{found} {}", 0.1 * square.sqrt());
    // The scale of the lengths is that of the distance.
    let scale =
        from_extent(&rays, &lengths, Some(up), &AnchorOptions { scale_sd: 0.03, ..hardly_any() }).unwrap();
    assert!((scale.sd_scale_m - 0.03 * scale.distance_m).abs() < 1e-12);
    assert!((scale.sd_depth_m - rise.hypot(scale.sd_scale_m)).abs() < 1e-9);
}

/// Without the vertical, the line from neck to feet may be tilted by 15 degrees: the rise times 0.26 beside the
/// balance.
#[test]
fn an_unknown_tilt_is_a_larger_offset() {
    let (rays, lengths, ..) = seen(0.4);
    let options = AnchorOptions::default();
    let tilted = from_extent(&rays, &lengths, None, &options).unwrap();
    let feet = (rays.ray[Joint::RightAnkle] + rays.ray[Joint::LeftAnkle]).normalize();
    let up = rays.ray[Joint::Neck] - feet;
    let rise = 0.943 * standing_span_m(&lengths);
    let wide = AnchorOptions { balance_sd_m: options.balance_sd_m.hypot(0.26 * rise), ..options };
    let upright = from_extent(&rays, &lengths, Some(up), &wide).unwrap();
    assert!((tilted.distance_m - upright.distance_m).abs() < 1e-9);
    assert!((tilted.sd_depth_m - upright.sd_depth_m).abs() < 1e-9);
    assert!(tilted.sd_depth_m > from_extent(&rays, &lengths, Some(up), &options).unwrap().sd_depth_m);
}

/// With one ankle the neck is 0.95 of trunk and leg above it, with two 0.943 above their middle.
#[test]
fn the_neck_is_as_high_above_the_feet_as_measured_walkers() {
    let (mut rays, lengths, up, _) = seen(0.0);
    let span = standing_span_m(&lengths);
    assert!(
        (span
            - (lengths.to[Joint::Pelvis]
                + pelvis_to_hip_line_m(&lengths)
                + lengths.to[Joint::LeftKnee]
                + lengths.to[Joint::LeftAnkle]))
            .abs()
            < 1e-12
    );
    let neck = DVec3::new(0.3, -0.2, 4.0);
    rays.ray[Joint::Neck] = neck.normalize();
    for (share, ankles) in [(0.943, 2), (0.95, 1)] {
        let feet = (neck - up * share * span).normalize();
        rays.ray[Joint::RightAnkle] = feet;
        rays.ray[Joint::LeftAnkle] = if ankles == 2 { feet } else { DVec3::NAN };
        let found = from_extent(&rays, &lengths, Some(up), &AnchorOptions::default()).unwrap();
        assert!((found.distance_m - neck.length()).abs() < 1e-9, "{found:?}");
    }
    let error = from_extent(&rays, &lengths, Some(-up), &AnchorOptions::default()).unwrap_err();
    assert!(matches!(error, AnchorError::UpsideDown { .. }), "{error}");
}

/// The height of a foot above the ground for a camera at 1.2 m that looks down.
#[test]
fn the_ground_is_the_world_s_plane() {
    let mut camera = Camera::level([640, 480], 1.0, 1.2, 3.0).unwrap();
    camera.rotation = DMat3::from_rotation_x(-0.2) * camera.rotation;
    camera.translation = -(camera.rotation * DVec3::new(0.5, -3.0, 1.2));
    let ground = Ground::of(&camera);
    for place in [DVec3::new(0.2, 0.1, 0.0), DVec3::new(-1.0, 2.0, 0.7)] {
        assert!((ground.height_m(camera.camera_from_world(place)) - place.z).abs() < 1e-12);
    }
}
