use super::super::gait::SideAngles;
use super::*;

fn walker() -> Walker {
    Walker { body: Body::from_height(1.8).unwrap(), gait: Gait::dense(), style: GaitStyle::default() }
}

#[test]
fn proportions_and_postures_are_the_same_after_a_round_trip() {
    let values = std::array::from_fn(|n| 0.01 * (n + 1) as f64);
    let proportions = Proportions::from_array(&values);
    assert_eq!(proportions.to_array(), values);
    assert_eq!((proportions.heel, proportions.semi_axes[7]), (0.12, (0.29, 0.3)));
    let values = std::array::from_fn(|n| 0.1 * (n + 1) as f64);
    let posture = Posture::from_array(&values);
    assert_eq!(posture.to_array(), values);
    assert_eq!((posture.left.hip, posture.pelvis_rotation), (values[7], values[15]));
}

#[test]
fn standing_joints_stand_at_the_table_heights() {
    let body = Body::from_height(1.8).unwrap();
    let centre = DVec3::new(1.0, 2.0, 0.5 * (0.818 + 0.530) * 1.8);
    let posed = body.pose(centre, 0.7, &Posture::default());
    for (z, fraction) in [
        (posed.left.shoulder.z, 0.818),
        (posed.left.elbow.z, 0.818 - 0.186),
        (posed.right.hip.z, 0.530),
        (posed.right.knee.z, 0.285),
        (posed.right.ankle.z, 0.039),
    ] {
        assert!((z - fraction * 1.8).abs() < 1e-12);
    }
    let head = posed.cylinders[Part::Head as usize];
    assert!((head.centre().z + head.half_length - 1.8).abs() < 1e-12, "the crown is at body height");
    let foot = posed.cylinders[Part::LeftFoot as usize];
    assert!((foot.centre().z - foot.semi_axes.x).abs() < 1e-12, "the sole is on the ground");
    let to_left = posed.left.hip - posed.right.hip;
    assert!(to_left.dot(DVec3::new(-(0.7f64.sin()), 0.7f64.cos(), 0.0)) > 0.0);
}

#[test]
fn flexion_moves_each_limb_the_anatomical_way() {
    let body = Body::from_height(1.8).unwrap();
    let bent = SideAngles { hip: 0.3, knee: 0.5, shoulder: 0.3, elbow: 0.5, ..SideAngles::default() };
    let posed = body.pose(DVec3::Z, 0.0, &Posture { right: bent, ..Posture::default() });
    let r = posed.right;
    assert!(r.knee.x > r.hip.x && r.elbow.x > r.shoulder.x, "hip and shoulder flex forward");
    assert!(
        r.ankle.x < r.knee.x && (r.wrist.x - r.elbow.x) > (r.elbow.x - r.shoulder.x),
        "knee back, elbow forward"
    );
}

#[test]
fn lean_turns_the_trunk_and_leaves_the_thighs_against_the_vertical() {
    let body = Body::from_height(1.8).unwrap();
    let posed = body.pose(DVec3::Z, 0.0, &Posture { trunk_lean: 0.2, ..Posture::default() });
    assert!(posed.left.shoulder.x > posed.left.hip.x);
    assert!((posed.left.knee.x - posed.left.hip.x).abs() < 1e-12);
}

#[test]
fn the_stance_foot_slides_little_when_the_walker_advances_at_its_own_speed() {
    // During mid-stance (phase 0.1 to 0.4) the ankle moves back relative to the body by as much as the
    // body moves forward.
    let walker = walker();
    let ankle_x = |phase: f64| walker.pose(DVec3::ZERO, 0.0, phase).right.ankle.x;
    let stride = (ankle_x(0.1) - ankle_x(0.4)) / 0.3;
    assert!((1.2..1.8).contains(&stride), "stride length implied by the stance leg: {stride} m");
}

#[test]
fn level_height_is_a_little_below_standing() {
    let height = walker().level_torso_height_m();
    let standing = 0.5 * (0.818 + 0.530) * 1.8;
    assert!(height < standing && height > standing - 0.08, "{height} against {standing}");
}

#[test]
fn implausible_heights_are_refused_with_a_hint() {
    for height in [0.0, -1.7, f64::NAN, f64::INFINITY] {
        assert!(Body::from_height(height).is_err());
    }
    assert!(Body::from_height(170.0).unwrap_err().to_string().contains("centimetres"));
}

/// A person one metre high, upright on the ground, walking along x.
fn upright() -> PosedBody {
    let body = Body::from_height(1.0).unwrap();
    body.pose(DVec3::Z * 0.5 * (0.818 + 0.530), 0.0, &Posture::default())
}

/// The extent of a cylinder along a direction of the world, from minimum to maximum.
fn reach(cylinder: &EllipticCylinder, direction: DVec3) -> (f64, f64) {
    let places = (0..720).flat_map(|i| {
        let rim = DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 720.0) * cylinder.semi_axes;
        [-1.0, 1.0].map(|end| rim.extend(end * cylinder.half_length))
    });
    let along = places.map(|p| cylinder.world_from_cylinder.transform_point3(p).dot(direction));
    along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
}

fn extent(parts: &[Part], direction: DVec3) -> f64 {
    let body = upright();
    let (low, high) = parts
        .iter()
        .map(|&part| reach(&body.cylinders[part as usize], direction))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (from, to)| (low.min(from), high.max(to)));
    high - low
}

/// Lengths after Drillis and Contini 1966, as printed in Winter, Biomechanics and Motor Control of Human
/// Movement, 4th edition 2009, fig. 4.1, as fractions of the height.
#[test]
fn parts_reach_from_joint_to_joint_as_published() {
    let body = upright();
    for (part, low, high) in [
        (Part::Head, 0.870, 1.0),
        (Part::Torso, 0.530, 0.818),
        (Part::LeftUpperArm, 0.818 - 0.186, 0.818),
        (Part::RightForearm, 0.818 - 0.186 - 0.146, 0.818 - 0.186),
        (Part::RightThigh, 0.285, 0.530),
        (Part::LeftShank, 0.039, 0.285),
    ] {
        let (from, to) = reach(&body.cylinders[part as usize], DVec3::Z);
        assert!((from - low).abs() < 1e-12 && (to - high).abs() < 1e-12, "{part:?}: {from} to {to}");
    }
    assert!((extent(&[Part::RightFoot], DVec3::X) - 0.152).abs() < 1e-12);
    // With straight fingers 0.108; the palm alone is 0.6 of that.
    let hand = extent(&[Part::LeftHand], DVec3::Z);
    assert!((0.6 * 0.108..0.8 * 0.108).contains(&hand), "{hand}");
}

/// A quarter of the foot lies behind the ankle (Perry and Burnfield, Gait Analysis, 2nd edition 2010, on
/// the heel rocker), and its sole is on the ground.
#[test]
fn the_foot_stands_about_the_ankle() {
    let (body, foot) = (upright(), Part::RightFoot as usize);
    let (heel, toe) = reach(&body.cylinders[foot], DVec3::X);
    let behind = (body.right.ankle.x - heel) / (toe - heel);
    assert!((0.2..0.3).contains(&behind), "{behind}");
    let (sole, instep) = reach(&body.cylinders[foot], DVec3::Z);
    assert!(sole.abs() < 1e-12 && instep > body.right.ankle.z && instep < 0.05, "{sole} {instep}");
}

/// Means of 4082 men over their mean height of 1756 mm, in the second survey of the US Army: Gordon and
/// others, NATICK/TR-15/007, 2014.
#[test]
fn parts_are_as_broad_and_deep_as_measured() {
    let (ahead, left) = (DVec3::X, DVec3::Y);
    let near = |found: f64, mm: f64, share: f64| {
        assert!((found / (mm / 1756.0) - 1.0).abs() < share, "{found} for {mm} mm");
    };
    // Chest, waist and hip, which one cylinder represents.
    near(extent(&[Part::Torso], left), (289.0 + 326.0 + 346.0) / 3.0, 0.1);
    near(extent(&[Part::Torso], ahead), (254.0 + 238.0 + 246.0) / 3.0, 0.1);
    near(extent(&[Part::Head], left), 154.0, 0.1);
    near(extent(&[Part::Head], ahead), 199.0, 0.1);
    near(extent(&[Part::RightThigh, Part::LeftThigh], left), 346.0, 0.06);
    near(extent(&[Part::LeftFoot], left), 102.0, 0.15);
    // A hanging hand has its palm at the thigh.
    near(extent(&[Part::LeftHand], ahead), 88.0, 0.15);
    assert!(extent(&[Part::LeftHand], left) < 0.6 * 88.0 / 1756.0);
    // Across both arms: the shoulder width of the proportions, 0.259, and that of the survey, 510 mm.
    let shoulders = extent(&[Part::RightUpperArm, Part::LeftUpperArm], left);
    assert!((0.259..510.0 / 1756.0).contains(&shoulders), "{shoulders}");
    // Girths between the thinnest and the thickest place of a limb.
    for (part, thin, thick) in [
        (Part::LeftUpperArm, 176.0, 358.0),
        (Part::RightForearm, 176.0, 310.0),
        (Part::RightThigh, 392.0, 625.0),
        (Part::LeftShank, 229.0, 392.0),
    ] {
        for direction in [ahead, left] {
            let girth = std::f64::consts::PI * extent(&[part], direction) * 1756.0;
            assert!((thin..thick).contains(&girth), "{part:?}: {girth} mm");
        }
    }
}

/// Whatever the flexion of a limb, the ends of its parts are its joints.
#[test]
fn bent_limbs_hang_from_their_joints() {
    let bent = SideAngles { hip: 0.4, knee: 0.9, shoulder: -0.3, elbow: 1.1, ..SideAngles::default() };
    let posture = Posture { right: bent, left: bent, trunk_lean: 0.2, pelvis_rotation: 0.0 };
    let body = Body::from_height(1.7).unwrap().pose(DVec3::new(1.0, -2.0, 0.9), 0.8, &posture);
    let right = [
        (Part::RightUpperArm, body.right.shoulder, Some(body.right.elbow)),
        (Part::RightForearm, body.right.elbow, Some(body.right.wrist)),
        (Part::RightHand, body.right.wrist, None),
        (Part::RightThigh, body.right.hip, Some(body.right.knee)),
        (Part::RightShank, body.right.knee, Some(body.right.ankle)),
    ];
    for (part, upper, lower) in right {
        let cylinder = &body.cylinders[part as usize];
        let end = |z: f64| cylinder.world_from_cylinder.transform_point3(DVec3::Z * z * cylinder.half_length);
        assert!(end(1.0).distance(upper) < 1e-12, "{part:?}");
        assert!(lower.is_none_or(|joint| end(-1.0).distance(joint) < 1e-12), "{part:?}");
    }
    // The hand continues the forearm.
    let [forearm, hand] = [Part::RightForearm, Part::RightHand]
        .map(|part| body.cylinders[part as usize].world_from_cylinder.matrix3.z_axis);
    assert!(forearm.distance(hand) < 1e-12);
}

/// Legs with fixed joint angles lower the trunk as the cosines of the angles give, and the crown by the
/// same amount.
#[test]
fn bent_legs_lower_trunk_and_crown() {
    let stiff = GaitStyle { leg_amplitude: 0.0, ..GaitStyle::default() };
    let mean = Gait::dense().posture(0.0, &stiff).right;
    let style = GaitStyle { hip_offset: 0.3 - mean.hip, knee_offset: 0.4 - mean.knee, ..stiff };
    let walker = Walker { style, ..walker() };
    let leg = 0.245 * 0.3f64.cos() + 0.246 * 0.1f64.cos() + 0.039;
    let found = walker.level_torso_height_m();
    assert!((found - 1.8 * (leg + 0.5 * (0.818 - 0.530))).abs() < 1e-12, "{found}");
    let crown = walker.level_crown_height_m();
    assert!((crown - 1.8 * (1.0 - 0.530 + leg)).abs() < 1e-12, "{crown}");
}

#[test]
fn the_lower_ankle_carries_the_body() {
    let walker = walker();
    let ankles = (0..40).map(|i| {
        let posture = walker.gait.posture(f64::from(i) / 40.0, &walker.style);
        let body = walker.body.pose(DVec3::ZERO, 0.0, &posture);
        body.right.ankle.z.min(body.left.ankle.z)
    });
    let expected = 0.039 * 1.8 - ankles.sum::<f64>() / 40.0;
    assert!((walker.level_torso_height_m() - expected).abs() < 1e-12);
}

/// The trunk of a walker moves up and down by 4 to 5 cm twice per cycle: highest in single support,
/// lowest in double support (Saunders, Inman and Eberhart 1953: 1.8 inches).
#[test]
fn a_walker_bobs_as_measured() {
    let walker = walker();
    let height = |phase: f64| walker.pose(DVec3::Z, 0.0, phase).torso_centre.z;
    for (low, high) in [(0.05, 0.30), (0.55, 0.80)] {
        let bob = height(high) - height(low);
        assert!((0.04..0.05).contains(&bob), "{bob}");
    }
    assert!((height(0.3) - height(0.8)).abs() < 1e-12);
}
