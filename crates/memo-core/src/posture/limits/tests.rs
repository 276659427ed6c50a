use super::*;
use crate::model::skeleton::{Joint, PerJoint, StickFigure};
use crate::posture::example::{
    ARM_M, LEG_M, TRUNK_M, WIDTH_M, forward_deg, lengths_of, outward_deg, seen_along, standing, turned,
};
use crate::posture::placed::{Bearings, PlacedFigure};
use crate::posture::tree::{TreeOptions, explain};

/// The violation of a constraint by a figure with the lengths of a standing person.
fn against(
    limits: Limits,
    figure: &StickFigure,
    head: Option<DMat3>,
    constraint: Constraint,
) -> Option<Violation> {
    let options = TreeOptions {
        limits: Some(limits),
        collisions: None,
        motion: None,
        bearings: Bearings { head, ..Bearings::default() },
        keep_cuts: false,
    };
    let found = explain(figure, &lengths_of(&standing()), &options);
    found.into_iter().find(|violation| violation.constraint == constraint)
}

/// The same for noisy joints.
fn against_noisy(limits: &Limits, placed: &PerJoint<Placed>, constraint: Constraint) -> Option<Violation> {
    let figure = PlacedFigure::of(placed);
    let trunk = Trunk::of(&figure, &Bearings::default());
    limits.check(constraint, &figure, &trunk, &lengths_of(&standing()), None)
}

/// The hip part rotated about an axis through the pelvis.
fn with_hips(turn: DMat3) -> StickFigure {
    let mut figure = standing();
    for side in Side::BOTH {
        figure[side.hip()] = figure[Joint::Pelvis] + turn * (figure[side.hip()] - figure[Joint::Pelvis]);
    }
    figure
}

/// A figure or head with one angle, degrees, that only the named constraint limits.
type Posed = (StickFigure, Option<DMat3>);
/// A constraint, its bound in degrees, and the posture for an angle.
type Row = (Constraint, f64, Box<dyn Fn(f64) -> Posed>);

/// Table 1 of Lee and Chen: every bound in degrees with a posture for an angle. The knee bends backward.
fn table_1() -> Vec<Row> {
    use Constraint as C;
    let mut rows: Vec<Row> = Vec::new();
    let mut add = |constraint, bound: f64, pose: Box<dyn Fn(f64) -> Posed>| {
        rows.push((constraint, bound, pose));
    };
    for s in Side::BOTH {
        let limb = move |end: Joint, direction: DVec3| (turned(&standing(), end, direction), None);
        let bent_knee = move |angle: f64| {
            let swung = turned(&standing(), s.knee(), forward_deg(angle));
            (turned(&swung, s.ankle(), forward_deg(angle - 60.0)), None)
        };
        add(C::ShoulderFlexion(s), 180.0, Box::new(move |a| limb(s.elbow(), forward_deg(a))));
        add(C::ShoulderExtension(s), 50.0, Box::new(move |a| limb(s.elbow(), forward_deg(-a))));
        add(C::ShoulderAbduction(s), 180.0, Box::new(move |a| limb(s.elbow(), outward_deg(s, a))));
        add(C::ShoulderAdduction(s), 50.0, Box::new(move |a| limb(s.elbow(), outward_deg(s, -a))));
        add(C::HipFlexion(s), 120.0, Box::new(bent_knee));
        add(
            C::HipFlexionStraight(s),
            90.0,
            Box::new(move |a| {
                let swung = turned(&standing(), s.knee(), forward_deg(a));
                (turned(&swung, s.ankle(), forward_deg(a)), None)
            }),
        );
        add(C::HipExtension(s), 40.0, Box::new(move |a| limb(s.knee(), forward_deg(-a))));
        add(C::HipAbduction(s), 45.0, Box::new(move |a| limb(s.knee(), outward_deg(s, a))));
        add(C::HipAdduction(s), 30.0, Box::new(move |a| limb(s.knee(), outward_deg(s, -a))));
        add(C::ElbowFlexion(s), 160.0, Box::new(move |a| limb(s.wrist(), forward_deg(a))));
        add(C::ElbowExtension(s), 0.0, Box::new(move |a| limb(s.wrist(), forward_deg(-a))));
        add(C::KneeFlexion(s), 130.0, Box::new(move |a| limb(s.ankle(), forward_deg(-a))));
        add(C::KneeExtension(s), 0.0, Box::new(move |a| limb(s.ankle(), forward_deg(a))));
    }
    // The hips' normal moves up if the torso bends forward, and the chin moves down with the head's.
    let about = |axis: DVec3, angle: f64| DMat3::from_axis_angle(axis, angle.to_radians());
    add(C::PelvisFlexion, 75.0, Box::new(move |a| (with_hips(about(DVec3::NEG_Z, a)), None)));
    add(C::PelvisExtension, 30.0, Box::new(move |a| (with_hips(about(DVec3::Z, a)), None)));
    add(C::NeckFlexion, 45.0, Box::new(move |a| (standing(), Some(about(DVec3::Z, a)))));
    add(C::NeckExtension, 55.0, Box::new(move |a| (standing(), Some(about(DVec3::NEG_Z, a)))));
    for sign in [1.0, -1.0] {
        add(C::PelvisRotation, 30.0, Box::new(move |a| (with_hips(about(sign * DVec3::Y, a)), None)));
        add(C::PelvisBending, 35.0, Box::new(move |a| (with_hips(about(sign * DVec3::X, a)), None)));
        add(C::NeckRotation, 70.0, Box::new(move |a| (standing(), Some(about(sign * DVec3::Y, a)))));
        add(C::NeckBending, 40.0, Box::new(move |a| (standing(), Some(about(sign * DVec3::X, a)))));
    }
    rows
}

#[test]
fn table_1_of_the_paper_holds_to_half_a_degree() {
    for (constraint, bound, pose) in table_1() {
        for beyond in [-0.5, 0.5] {
            let (figure, head) = pose(bound + beyond);
            let found = against(Limits::paper(), &figure, head, constraint);
            assert_eq!(found.is_some(), beyond > 0.0, "{constraint:?} at {} deg: {found:?}", bound + beyond);
            if let Some(Violation { value, limit, .. }) = found {
                assert!((limit.to_degrees() - bound).abs() < 1e-9, "{constraint:?} {limit}");
                assert!((value.to_degrees() - bound - beyond).abs() < 1e-9, "{constraint:?} {value}");
            }
        }
    }
}

/// By how much the measured limits are wider than Table 1, as documented, degrees.
fn widened_by_deg(constraint: Constraint) -> f64 {
    use Constraint as C;
    match constraint {
        C::ShoulderExtension(_) | C::KneeFlexion(_) => 10.0,
        C::KneeExtension(_) => 8.0,
        _ => 5.0,
    }
}

#[test]
fn measured_limits_are_table_1_with_the_documented_margins() {
    let limits = Limits::measured();
    for (constraint, bound, pose) in table_1() {
        let bound = bound + widened_by_deg(constraint);
        // An arm cannot be more than 90 degrees out of the sagittal plane, which no limit cuts.
        if matches!(constraint, Constraint::ShoulderAbduction(_)) {
            continue;
        }
        for beyond in [-0.5, 0.5] {
            let (figure, head) = pose(bound + beyond);
            let found = against(limits, &figure, head, constraint);
            assert_eq!(found.is_some(), beyond > 0.0, "{constraint:?} at {} deg: {found:?}", bound + beyond);
        }
    }
}

/// Straight down, an arm held 90 degrees backward is 40 beyond the extension limit and 90 before the flexion
/// limit.
#[test]
fn the_nearer_of_two_bounds_counts() {
    let range = AngleRange::from_deg(-50.0, 180.0);
    let cases = [(-90.0, -40.0), (-110.0, -60.0), (-120.0, 60.0), (-179.0, 1.0), (270.0, -40.0), (0.0, 0.0)];
    for (angle, excess) in cases {
        assert!((range.excess(f64::to_radians(angle)).to_degrees() - excess).abs() < 1e-9, "{angle}");
    }
    for s in Side::BOTH {
        let back = turned(&standing(), s.elbow(), forward_deg(-90.0));
        let found = against(Limits::paper(), &back, None, Constraint::ShoulderExtension(s)).unwrap();
        assert!((found.excess.to_degrees() - 40.0).abs() < 1e-9, "{found:?}");
        assert_eq!(against(Limits::paper(), &back, None, Constraint::ShoulderFlexion(s)), None);
    }
}

#[test]
fn a_thigh_may_be_raised_higher_when_the_knee_is_bent() {
    for s in Side::BOTH {
        let raised = |knee_deg: f64| {
            let swung = turned(&standing(), s.knee(), forward_deg(100.0));
            turned(&swung, s.ankle(), forward_deg(100.0 - knee_deg))
        };
        for (knee_deg, is_cut) in [(0.0, true), (9.0, true), (11.0, false), (60.0, false)] {
            let found = against(Limits::paper(), &raised(knee_deg), None, Constraint::HipFlexionStraight(s));
            assert_eq!(found.is_some(), is_cut, "knee at {knee_deg} deg: {found:?}");
        }
    }
}

/// If noise could have straightened or bent a knee, it is not certainly straight.
#[test]
fn noise_of_the_knee_lets_the_thigh_pass() {
    let s = Side::Left;
    let swung = turned(&standing(), s.knee(), forward_deg(100.0));
    let figure = turned(&swung, s.ankle(), forward_deg(95.0));
    let limits = Limits { noise_factor: 1.5, ..Limits::paper() };
    let mut placed = seen_along(&figure, DVec3::Z);
    let constraint = Constraint::HipFlexionStraight(s);
    let quiet = against_noisy(&limits, &placed, constraint).unwrap();
    assert!((quiet.limit.to_degrees() - 90.0).abs() < 1e-9);
    // 1.5 standard deviations of 2 degrees per segment: 5 and 4.2 degrees are straight; with 4 degrees not.
    for (segment_sd_deg, is_cut) in [(2.0, true), (4.0, false)] {
        for joint in [s.knee(), s.ankle()] {
            placed[joint].lateral_m = LEG_M * f64::to_radians(segment_sd_deg);
        }
        let found = against_noisy(&limits, &placed, constraint);
        assert_eq!(found.is_some(), is_cut, "{segment_sd_deg} deg");
    }
}

/// The smallest angle between a limb and a half-plane of limbs with the same swing, by trying its directions.
fn least_turn(limb: DVec3, swing_rad: f64) -> f64 {
    let in_plane = DVec3::new(swing_rad.sin(), swing_rad.cos(), 0.0);
    (-9000..=9000)
        .map(|i| {
            let rise = f64::from(i) / 9000.0 * FRAC_PI_2;
            limb.angle_between(rise.cos() * in_plane + rise.sin() * DVec3::Z)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The rotation back into the range is the smallest, for any angle of the limb out of the sagittal plane.
#[test]
fn a_turn_back_into_the_range_is_the_least_one() {
    let limits = Limits { noise_factor: 0.0, ..Limits::measured() };
    let s = Side::Left;
    let [shoulder, hip] = [limits.shoulder_swing.min_rad, limits.hip_swing.min_rad];
    let arm = (Constraint::ShoulderExtension(s), s.elbow(), shoulder);
    let thigh = (Constraint::HipExtension(s), s.knee(), hip);
    for ((constraint, end, bound), swing_deg) in
        [(arm, -75.0), (arm, -110.0), (thigh, -130.0), (thigh, -139.0)]
    {
        for out in [0.0, 0.5, 2.0, 10.0] {
            let limb = (forward_deg(swing_deg) + out * DVec3::Z).normalize();
            let found = against(limits, &turned(&standing(), end, limb), None, constraint);
            // Beyond a quarter turn, the nearest limb on the bound is the one straight to the side.
            let expected = least_turn(limb, bound);
            let excess = found.map_or(0.0, |violation| violation.excess);
            assert!(
                (excess - expected).abs() < 1e-3,
                "{constraint:?} {swing_deg} {out}: {excess} {expected}"
            );
        }
    }
    // Held out sideways, the arm has almost no flexion; read literally, it is bent back by 90 degrees.
    let aside = turned(&standing(), s.elbow(), DVec3::new(-0.02, 0.0, 1.0));
    assert_eq!(
        against(limits, &aside, None, Constraint::ShoulderExtension(s)).map(|v| v.excess < 0.02),
        Some(true)
    );
    let literal = against(Limits::paper(), &aside, None, Constraint::ShoulderExtension(s)).unwrap();
    assert!((literal.excess.to_degrees() - 40.0).abs() < 1e-9);
}

/// A forearm slightly outside the half-space of upper arm and z is slightly bent the wrong way.
#[test]
fn a_hinge_bent_the_wrong_way_counts_out_of_its_half_space() {
    let limits = Limits { noise_factor: 0.0, ..Limits::measured() };
    for s in Side::BOTH {
        // 70 degrees to the side and 7 degrees backward: sin 7 out of the half-space.
        let aside = 70f64.to_radians();
        let forearm = DVec3::new(-7f64.to_radians().sin(), 0.0, 0.0)
            + 7f64.to_radians().cos() * DVec3::new(0.0, aside.cos(), aside.sin());
        let figure = turned(&standing(), s.wrist(), forearm);
        let found = against(limits, &figure, None, Constraint::ElbowExtension(s)).unwrap();
        assert!((found.value.to_degrees() - 7.0).abs() < 1e-9, "{found:?}");
        assert_eq!(against(limits, &figure, None, Constraint::ElbowFlexion(s)), None);
        let literal = against(Limits::paper(), &figure, None, Constraint::ElbowExtension(s)).unwrap();
        assert!(literal.value.to_degrees() > 60.0, "{literal:?}");
        // Folded back with w_z < 0, the paper counts an extension and no flexion; a rotation counts both.
        let folded = turned(&standing(), s.wrist(), forward_deg(-170.0));
        assert_eq!(against(Limits::paper(), &folded, None, Constraint::ElbowFlexion(s)), None);
        assert!(against(limits, &folded, None, Constraint::ElbowFlexion(s)).is_some());
    }
}

/// Every limit grows by the noise of the limb and of the trunk's axes: `noise_factor` standard deviations of the
/// displacement in each direction divided by its length.
#[test]
fn limits_grow_by_the_noise_of_limb_and_trunk() {
    let (k, limb_m, trunk_m) = (1.5, 0.012, 0.02);
    let limits = Limits { noise_factor: k, ..Limits::measured() };
    let s = Side::Left;
    let back = turned(&standing(), s.elbow(), forward_deg(-80.0));
    let across = turned(&standing(), s.knee(), outward_deg(s, 60.0));
    let hinge = turned(&standing(), s.wrist(), forward_deg(-20.0));
    let folded = turned(&standing(), s.wrist(), forward_deg(175.0));
    let straight = turned(&turned(&standing(), s.knee(), forward_deg(110.0)), s.ankle(), forward_deg(110.0));
    // The joints that move, their displacement across the rays, and the resulting noise of the angle.
    let cases = [
        (Constraint::ShoulderExtension(s), back, s.elbow(), limb_m / ARM_M, trunk_m / TRUNK_M),
        (Constraint::HipAbduction(s), across, s.knee(), limb_m / LEG_M, trunk_m / TRUNK_M),
        (Constraint::ElbowExtension(s), hinge, s.wrist(), limb_m / ARM_M, 0.0),
        (Constraint::ElbowExtension(s), hinge, s.elbow(), limb_m / ARM_M, 0.0),
        (Constraint::ElbowFlexion(s), folded, s.elbow(), limb_m / ARM_M, 0.0),
        (Constraint::ElbowFlexion(s), folded, s.wrist(), limb_m / ARM_M, 0.0),
        (Constraint::HipFlexionStraight(s), straight, s.knee(), limb_m / LEG_M, trunk_m / TRUNK_M),
    ];
    for (constraint, figure, joint, of_limb, of_trunk) in cases {
        let mut placed = seen_along(&figure, DVec3::Z);
        let quiet = against_noisy(&limits, &placed, constraint).unwrap();
        placed[joint].lateral_m = limb_m;
        placed[Joint::Pelvis].lateral_m = trunk_m;
        let noisy = against_noisy(&limits, &placed, constraint).unwrap();
        let expected = k * f64::hypot(of_limb, of_trunk);
        assert!((noisy.limit - quiet.limit - expected).abs() < 1e-3 * expected, "{constraint:?} {joint:?}");
        assert_eq!(noisy.value, quiet.value);
        // The paper's limits contain no noise.
        let paper = Limits { noise_factor: 0.0, ..limits };
        assert_eq!(against_noisy(&paper, &placed, constraint), Some(quiet));
    }
}

/// The same for hips and torso: the displacement of the hips divided by their drop and width, with the torso's.
#[test]
fn limits_of_the_pelvis_grow_by_the_noise_of_hips_and_torso() {
    let (k, hip_m, torso_m) = (1.5, 0.003, 0.004);
    let limits = Limits { noise_factor: k, ..Limits::paper() };
    let about = |axis: DVec3, angle: f64| with_hips(DMat3::from_axis_angle(axis, f64::to_radians(angle)));
    // If two points are each off by s in one direction, their difference is off by √2 s and their mean by s/√2.
    let both = std::f64::consts::SQRT_2;
    let drop = hip_m / both / 0.1;
    let cases = [
        (Constraint::PelvisFlexion, about(DVec3::NEG_Z, 80.0), drop, torso_m / TRUNK_M),
        (Constraint::PelvisExtension, about(DVec3::Z, 40.0), drop, torso_m / TRUNK_M),
        (Constraint::PelvisBending, about(DVec3::X, 50.0), drop, torso_m / TRUNK_M),
        (Constraint::PelvisRotation, about(DVec3::Y, 40.0), both * hip_m / WIDTH_M, both * torso_m / WIDTH_M),
    ];
    for (constraint, figure, of_hips, of_torso) in cases {
        let mut placed = seen_along(&figure, DVec3::new(1.0, 2.0, 3.0));
        let quiet = against_noisy(&limits, &placed, constraint).unwrap();
        for side in Side::BOTH {
            placed[side.hip()].lateral_m = hip_m;
            placed[side.shoulder()].lateral_m = torso_m;
        }
        placed[Joint::Pelvis].lateral_m = torso_m;
        let noisy = against_noisy(&limits, &placed, constraint).unwrap();
        let expected = k * f64::hypot(of_hips, of_torso);
        assert!((noisy.limit - quiet.limit - expected).abs() < 1e-9, "{constraint:?} {noisy:?} {expected}");
    }
}

/// Shoulders whose distance is wrong by more than the tolerance, or than noise along and across it explains.
#[test]
fn rigid_distances_hold_to_their_tolerance_and_noise() {
    let distance = RigidDistance::Shoulders;
    let constraint = Constraint::Rigid(distance);
    let stretched = |by_m: f64| {
        let mut figure = standing();
        figure[Joint::LeftShoulder].z += by_m;
        figure
    };
    for (by_m, is_cut) in [(0.019, false), (0.021, true), (-0.019, false), (-0.021, true)] {
        let found = against(Limits::paper(), &stretched(by_m), None, constraint);
        assert_eq!(found.is_some(), is_cut, "{by_m}");
        if let Some(found) = found {
            assert!((found.value - 0.021).abs() < 1e-9 && (found.limit - 0.02).abs() < 1e-12);
        }
    }
    let k = 1.5;
    let limits = Limits { noise_factor: k, ..Limits::paper() };
    let limit = |ray: DVec3, depth_sd_m: f64, lateral_m: f64| {
        let mut placed = seen_along(&stretched(0.1), ray);
        for joint in distance.joints() {
            (placed[joint].sd_m, placed[joint].lateral_m) = (depth_sd_m, lateral_m);
        }
        against_noisy(&limits, &placed, constraint).unwrap().limit - 0.02
    };
    let both = std::f64::consts::SQRT_2;
    // Along the shoulder line, the noise of both joints adds to their distance.
    assert!((limit(DVec3::Z, 0.01, 0.0) - k * both * 0.01).abs() < 1e-12);
    assert!((limit(DVec3::X, 0.0, 0.01) - k * both * 0.01).abs() < 1e-12);
    // Across it, the distance of two points w apart is longer if they are k standard deviations out of line.
    let out_of_line = k * both * 0.05;
    let longer = WIDTH_M.hypot(out_of_line) - WIDTH_M;
    assert!((limit(DVec3::X, 0.05, 0.0) - longer).abs() < 0.02 * longer);
}
