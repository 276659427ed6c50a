use proptest::prelude::*;

use super::*;
use crate::model::skeleton::StickFigure;
use crate::posture::constraint::ConstraintKind;
use crate::posture::example::{ARM_M, seen_along, standing, turned};
use crate::synth::Random;

fn point() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Smallest distance of points sampled over two sets of parameters, refined about the best.
fn sampled(distance: impl Fn(&[f64]) -> f64, dimensions: usize) -> f64 {
    let mut best = vec![0.5; dimensions];
    let mut step = 0.5;
    let mut least = distance(&best);
    // The distance is convex: random steps that get shorter only when none of them helps.
    let mut random = crate::synth::Random::new(1);
    while step > 1e-6 {
        let centre = best.clone();
        let before = least;
        for _ in 0..100 {
            let mut at = centre.clone();
            for value in &mut at {
                *value = (*value + random.uniform(-step, step)).clamp(0.0, 1.0);
            }
            let d = distance(&at);
            if d < least {
                (least, best) = (d, at);
            }
        }
        if least == before {
            step *= 0.7;
        }
    }
    least
}

/// All faces of a triangle, segment or point: the subsets of its corners.
fn faces(corners: &[DVec3]) -> impl Iterator<Item = Vec<DVec3>> + '_ {
    (1..1usize << corners.len())
        .map(|set| (0..corners.len()).filter(|i| set >> i & 1 == 1).map(|i| corners[i]).collect())
}

/// Distance of two simplices: least squares over the flats of every pair of faces; pairs count if their nearest
/// points are inside the faces.
fn simplex_distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    let mut least = f64::MAX;
    for (p, q) in faces(a).flat_map(|p| faces(b).map(move |q| (p.clone(), q))) {
        let columns: Vec<DVec3> =
            p[1..].iter().map(|x| x - p[0]).chain(q[1..].iter().map(|x| q[0] - x)).collect();
        let apart = q[0] - p[0];
        let mut weights = nalgebra::DVector::zeros(columns.len());
        if !columns.is_empty() {
            let matrix = nalgebra::DMatrix::from_fn(3, columns.len(), |r, c| columns[c][r]);
            let target = nalgebra::DVector::from_row_slice(&apart.to_array());
            weights = matrix.svd(true, true).solve(&target, 1e-12).unwrap();
        }
        let (of_p, of_q) = weights.as_slice().split_at(p.len() - 1);
        let inside = |w: &[f64]| w.iter().all(|&x| x >= -1e-9) && w.iter().sum::<f64>() <= 1.0 + 1e-9;
        if inside(of_p) && inside(of_q) {
            let reached: DVec3 = columns.iter().zip(weights.iter()).map(|(c, w)| *c * *w).sum();
            least = least.min((apart - reached).length());
        }
    }
    least
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn segment_distance_is_the_least_of_samples(a in point(), b in point(), c in point(), d in point(),
                                                 degenerate in 0..4) {
        let (b, d) = match degenerate {
            1 => (a, d),
            2 => (b, c + (b - a)),
            3 => (b, c),
            _ => (b, d),
        };
        let oracle = sampled(|p| a.lerp(b, p[0]).distance(c.lerp(d, p[1])), 2);
        prop_assert!((segment_distance(a, b, c, d) - oracle).abs() < 1e-5);
    }

    #[test]
    fn clearance_is_that_of_the_nearest_faces(a in point(), b in point(), c in point(), d in point(),
                                         e in point(), f in point()) {
        let clearance = quadrilateral_clearance(&[a, b, c, d], e, f);
        let oracle = triangles(&[a, b, c, d])
            .iter()
            .map(|t| simplex_distance(t, &[e, f]))
            .fold(f64::MAX, f64::min);
        prop_assert!((clearance.max(0.0) - oracle).abs() < 1e-7, "{clearance} {oracle}");
    }
}

#[test]
fn a_forearm_through_the_torso_has_a_negative_clearance() {
    let corners = [
        DVec3::new(0.2, 0.0, 0.0),
        DVec3::new(-0.2, 0.0, 0.0),
        DVec3::new(-0.2, 0.5, 0.0),
        DVec3::new(0.2, 0.5, 0.0),
    ];
    let through = quadrilateral_clearance(&corners, DVec3::new(0.1, 0.2, -0.06), DVec3::new(0.1, 0.2, 0.2));
    assert!((through + 0.06).abs() < 1e-12, "{through}");
    let over_the_border =
        quadrilateral_clearance(&corners, DVec3::new(0.17, 0.2, -0.3), DVec3::new(0.17, 0.2, 0.2));
    assert!((over_the_border + 0.03).abs() < 1e-12, "{over_the_border}");
    let before = quadrilateral_clearance(&corners, DVec3::new(0.1, 0.2, 0.05), DVec3::new(0.1, 0.4, 0.2));
    assert!((before - 0.05).abs() < 1e-12);
}

/// A figure with joints anywhere in a room as small as the body, so that its parts often collide.
fn anywhere(random: &mut Random) -> StickFigure {
    let mut draw = || random.uniform(-0.5, 0.5);
    PerJoint(Joint::ALL.map(|_| DVec3::new(draw(), draw(), draw())))
}

/// The segments of a name, by their ends: `right_arm`, `left_thigh`, `other_thigh` of a side.
fn segments_called(part: &str, side: Side) -> Vec<[Joint; 2]> {
    let (side, part) = match part.split_once('_') {
        Some(("right", part)) => (Side::Right, part),
        Some(("left", part)) => (Side::Left, part),
        Some(("other", part)) => (side.other(), part),
        _ => (side, part),
    };
    match part {
        "arm" => vec![[side.shoulder(), side.elbow()], [side.elbow(), side.wrist()]],
        "thigh" => vec![[side.hip(), side.knee()]],
        "shank" => vec![[side.knee(), side.ankle()]],
        _ => panic!("{part}"),
    }
}

/// Both parts of a constraint and the sum of their radii, read from its name.
fn parts(constraint: Constraint, radii: &Collisions) -> Option<([Vec<[Joint; 2]>; 2], f64)> {
    let name = constraint.name();
    let (first, second) = name.split_once("_in_")?;
    if second.contains("torso") {
        return None;
    }
    // "thigh_in_thigh": both sides.
    let is_of_both = first == second;
    let side = if first.starts_with("left") { Side::Left } else { Side::Right };
    let second_side = if is_of_both { side.other() } else { side };
    let radius = |part: &str| if part.ends_with("arm") { radii.arm_m } else { radii.leg_m };
    let both = [segments_called(first, side), segments_called(second, second_side)];
    Some((both, radius(first) + radius(second)))
}

/// Exactly the pairs of limbs that collide are found; the segments are read from the names.
#[test]
fn limbs_collide_where_their_segments_come_nearer_than_their_radii() {
    let radii =
        Collisions { arm_m: 0.05, leg_m: 0.08, torso_m: 0.06, shoulder_part: 1.0 / 3.0, noise_factor: 0.0 };
    let mut random = Random::new(3);
    let (mut met, mut met_torso) = (0, 0);
    for _ in 0..300 {
        let points = anywhere(&mut random);
        let placed = seen_along(&points, DVec3::Z);
        let figure = PlacedFigure::of(&placed);
        let distance =
            |a: &[Joint; 2], b: &[Joint; 2]| simplex_distance(&a.map(|j| points[j]), &b.map(|j| points[j]));
        for constraint in Constraint::ALL.into_iter().filter(|c| c.kind() == ConstraintKind::Collision) {
            let found = radii.check(constraint, &figure);
            let (nearest, least) = match parts(constraint, &radii) {
                Some(([first, second], sum)) => {
                    let pairs = first.iter().flat_map(|a| second.iter().map(move |b| (a, b)));
                    (pairs.map(|(a, b)| distance(a, b)).fold(f64::MAX, f64::min), sum)
                }
                None => (torso_distance(constraint, &points), radii.torso_m),
            };
            assert_eq!(found.is_some(), nearest < least, "{constraint:?} {nearest} {found:?}");
            if let Some(found) = found {
                assert!((found.value.max(0.0) - nearest).abs() < 1e-7 && found.limit == least, "{found:?}");
                met += 1;
                met_torso += usize::from(parts(constraint, &radii).is_none());
            }
        }
    }
    assert!(met > 1000 && met_torso > 200, "{met} {met_torso}");
}

/// Distance of the evaluated part of an upper arm or of a forearm from the two triangles of the torso.
fn torso_distance(constraint: Constraint, points: &StickFigure) -> f64 {
    use Joint::{LeftHip, LeftShoulder, RightHip, RightShoulder};
    let (start, end) = match constraint {
        Constraint::UpperArmTorso(s) => {
            let (shoulder, elbow) = (points[s.shoulder()], points[s.elbow()]);
            (shoulder + (elbow - shoulder) / 3.0, elbow)
        }
        Constraint::ForearmTorso(s) => (points[s.elbow()], points[s.wrist()]),
        _ => panic!("{constraint:?}"),
    };
    let [a, b, c, d] = [RightShoulder, LeftShoulder, LeftHip, RightHip].map(|joint| points[joint]);
    [[a, b, c], [a, c, d]].iter().map(|t| simplex_distance(t, &[start, end])).fold(f64::MAX, f64::min)
}

/// The upper arm begins at a corner of the torso: its first third may touch it, the rest may not.
#[test]
fn the_shoulder_s_part_of_the_upper_arm_is_not_looked_at() {
    let near = Collisions { torso_m: 0.05, ..Collisions::paper() };
    let against = |direction: DVec3, constraint| {
        let placed = seen_along(&turned(&standing(), Side::Left.elbow(), direction), DVec3::Z);
        near.check(constraint, &PlacedFigure::of(&placed))
    };
    let upper = Constraint::UpperArmTorso(Side::Left);
    // To the side: the nearest evaluated point is a third of 30 cm away; without the rule it would be within 5
    // cm.
    assert_eq!(against(DVec3::Z, upper), None);
    assert_eq!(against(DVec3::X, upper), None);
    // Across the chest, 0.2 of the arm's length in front of it: 2 cm at the beginning of the evaluated part.
    let across = DVec3::new(0.2, 0.6, -(1.0f64 - 0.2 * 0.2 - 0.6 * 0.6).sqrt());
    let found = against(across, upper).unwrap();
    assert!((found.value - 0.2 * ARM_M / 3.0).abs() < 1e-9, "{found:?}");
    assert_eq!(Collisions::measured().shoulder_part, 1.0 / 3.0);
}

/// Only a forearm that passes through the torso is cut: exactly for the paper's stick figures, otherwise with
/// noise.
#[test]
fn a_forearm_may_touch_the_torso_and_not_pass_it() {
    let s = Side::Left;
    // The upper arm forward, the forearm back to the middle of the chest and some centimetres beyond.
    let reaching = |beyond_m: f64| {
        let forward = turned(&standing(), s.elbow(), DVec3::new(0.2, 0.15, -0.1));
        let elbow = forward[s.elbow()];
        let towards = DVec3::new(-elbow.x, 0.1, -0.05).normalize();
        let way_m = elbow.x / -towards.x + beyond_m;
        let mut figure = forward;
        figure[s.wrist()] = elbow + way_m * towards;
        (seen_along(&figure, DVec3::X), -beyond_m * towards.x)
    };
    let constraint = Constraint::ForearmTorso(s);
    let (touching, _) = reaching(-0.01);
    assert_eq!(Collisions::paper().check(constraint, &PlacedFigure::of(&touching)), None);
    let (mut passing, depth_m) = reaching(0.05);
    let found = Collisions::paper().check(constraint, &PlacedFigure::of(&passing)).unwrap();
    assert!((found.value + depth_m).abs() < 1e-9 && found.limit == 0.0, "{found:?} {depth_m}");
    // 1.5 standard deviations of the forearm's position: 2 cm do not explain it, 4 cm do.
    for (sd_m, is_cut) in [(0.02, true), (0.04, false)] {
        passing[s.wrist()].sd_m = sd_m;
        let found = Collisions::measured().check(constraint, &PlacedFigure::of(&passing));
        assert_eq!(found.is_some(), is_cut, "{sd_m}");
        assert!(Collisions::paper().check(constraint, &PlacedFigure::of(&passing)).is_some());
    }
}

/// The minimum clearance decreases by the noise of both limbs' positions, by each cause, and by nothing else.
#[test]
fn limbs_may_come_nearer_by_their_noise() {
    // Feet together and shanks crossed: all legs within 10 cm of each other.
    let mut figure = standing();
    for side in Side::BOTH {
        for joint in [side.hip(), side.knee(), side.ankle()] {
            figure[joint].z *= 0.1;
        }
    }
    let (k, radii) = (1.5, Collisions { leg_m: 0.1, ..Collisions::measured() });
    let r = Side::Right;
    let thighs =
        (Constraint::ThighThigh, vec![(r.knee(), true), (r.knee(), false), (r.other().knee(), true)]);
    let shanks = (
        Constraint::ShankShank,
        vec![(r.knee(), true), (r.ankle(), true), (r.knee(), false), (r.other().ankle(), true)],
    );
    let mixed = (Constraint::ShankThigh(r), vec![(r.ankle(), true), (r.other().knee(), true)]);
    for (constraint, causes) in [thighs, shanks, mixed] {
        let limit =
            |placed: &PerJoint<Placed>| radii.check(constraint, &PlacedFigure::of(placed)).unwrap().limit;
        let quiet = seen_along(&figure, DVec3::X);
        assert!((limit(&quiet) - 0.2).abs() < 1e-12);
        let mut all = quiet;
        for &(joint, is_depth) in &causes {
            let mut noisy = quiet;
            for placed in [&mut noisy[joint], &mut all[joint]] {
                *(if is_depth { &mut placed.sd_m } else { &mut placed.lateral_m }) = 0.02;
            }
            assert!((limit(&quiet) - limit(&noisy) - k * 0.02).abs() < 1e-12, "{constraint:?} {joint:?}");
        }
        let together = k * 0.02 * (causes.len() as f64).sqrt();
        assert!((limit(&quiet) - limit(&all) - together).abs() < 1e-12, "{constraint:?}");
        let paper = Collisions { noise_factor: 0.0, ..radii };
        let found = paper.check(constraint, &PlacedFigure::of(&all)).unwrap();
        assert!((found.limit - 0.2).abs() < 1e-12);
    }
    assert_eq!(Collisions::paper().noise_factor, 0.0);
    let default = Collisions::default();
    assert_eq!((default.arm_m + default.leg_m, default.torso_m, default.noise_factor), (0.03, 0.0, 1.5));
}

fn span(ray: DVec3, near_m: f64, far_m: f64) -> Span {
    Span { ray: ray.normalize(), near_m, far_m }
}

/// Segments that the test on rays separates are apart wherever their ends are on their rays, and it separates
/// most of those that are never near.
#[test]
fn what_is_out_of_reach_is_never_reached() {
    let mut random = Random::new(8);
    let (mut told, mut never) = (0, 0);
    for _ in 0..2000 {
        let least_m = random.uniform(0.0, 0.3);
        let part = if random.uniform(0.0, 1.0) < 0.5 { 0.0 } else { 1.0 / 3.0 };
        let mut draw = || {
            let ray = DVec3::new(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 1.0);
            let near_m = random.uniform(1.0, 2.0);
            span(ray, near_m, near_m + random.uniform(0.0, 0.3))
        };
        let [a, b, c, d] = [(); 4].map(|()| draw());
        let mut nearest = f64::MAX;
        for i in 0..81 {
            let at = |span: &Span, digit: u32| {
                let share = f64::from(i / 3_u32.pow(digit) % 3) / 2.0;
                span.ray * (span.near_m + share * (span.far_m - span.near_m))
            };
            let (start, end) = (at(&a, 0), at(&b, 1));
            let start = start + part * (end - start);
            nearest = nearest.min(segment_distance(start, end, at(&c, 2), at(&d, 3)));
        }
        let is_apart = apart(&[a, b], part, &[c, d], least_m);
        assert!(!is_apart || nearest > least_m, "{nearest} {least_m}");
        told += usize::from(is_apart);
        never += usize::from(nearest > least_m);
    }
    assert!(told > 500 && 2 * told > never, "{told} of {never}");
}

/// Without its first third a segment is farther from things beside its start.
#[test]
fn reach_leaves_the_shoulder_s_part_out() {
    let [start, end] = [span(DVec3::new(0.0, 0.0, 1.0), 2.0, 2.0), span(DVec3::new(0.3, 0.0, 1.0), 2.0, 2.0)];
    let other = [DVec3::new(0.0, 0.1, 1.0), DVec3::new(0.0, -0.1, 1.0)].map(|ray| span(ray, 1.9, 2.1));
    // At a third of its length the segment is 20 cm from the plane through the rays of the others.
    assert!(!apart(&[start, end], 0.0, &other, 0.1));
    assert!(apart(&[start, end], 1.0 / 3.0, &other, 0.15));
    assert!(!apart(&[start, end], 1.0 / 3.0, &other, 0.25));
}
