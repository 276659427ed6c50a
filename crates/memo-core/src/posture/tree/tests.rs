//! Compares the tree with one that evaluates every constraint at every leaf.

use std::collections::{BTreeMap, BTreeSet};

use super::*;
use crate::model::skeleton::Side;
use crate::posture::placed::Bearings;
use crate::posture::rules::{MotionModel, Rule, Tolerance};
use crate::synth::Random;

/// A person upright in camera axes, 4 m away, with every segment rotated at random by up to `spread_rad`.
fn figure(lengths: &SegmentLengths, facing_rad: f64, spread_rad: f64, random: &mut Random) -> StickFigure {
    let turn = glam::DQuat::from_rotation_y(facing_rad);
    let rest = |joint: Joint| match joint {
        Joint::RightShoulder => DVec3::new(-1.0, 0.0, 0.1),
        Joint::LeftShoulder => DVec3::new(1.0, 0.0, 0.1),
        Joint::RightHip => DVec3::new(-0.85, 0.5, 0.0),
        Joint::LeftHip => DVec3::new(0.85, 0.5, 0.0),
        _ => DVec3::Y,
    };
    let mut figure = StickFigure::UNKNOWN;
    figure[Joint::Neck] = DVec3::new(random.uniform(-0.3, 0.3), -0.3, 4.0);
    for joint in Joint::ALL.into_iter().skip(1) {
        let spread = if joint < Joint::RightElbow { 0.2 * spread_rad } else { spread_rad };
        let mut angle = || random.uniform(-spread, spread);
        let bend = glam::DQuat::from_euler(glam::EulerRot::XYZ, angle(), angle(), angle());
        let direction = turn * bend * rest(joint).normalize();
        figure[joint] = figure[joint.start().unwrap()] + lengths.to[joint] * direction;
    }
    figure
}

fn view_of(seed: u64, noise_rad: f64) -> View {
    let lengths = SegmentLengths::lee_chen();
    let mut random = Random::new(seed);
    let facing_rad = random.uniform(-3.0, 3.0);
    let spread_rad = random.uniform(0.05, 0.5);
    let figure = figure(&lengths, facing_rad, spread_rad, &mut random);
    let mut rays = JointRays::from_points(&figure);
    for ray in &mut rays.ray.0 {
        let [a, b] = random.normal_pair().map(f64::from);
        *ray = (*ray + noise_rad * DVec3::new(a, b, 0.0)).normalize();
    }
    rays.noise_rad = noise_rad;
    View::new(rays, figure[Joint::Neck], lengths)
}

fn every_rule() -> MotionModel {
    Rule::ALL.into_iter().fold(MotionModel::walking(), |model, rule| {
        let tolerance = model.tolerance(rule).unwrap_or(Tolerance::from_deg(35.0));
        model.with(rule, tolerance)
    })
}

/// The expected result of the walk, by visiting each of the 2^13 leaves and evaluating every constraint on the
/// path to it.
#[derive(Default)]
struct Plain {
    survivors: BTreeSet<TreePath>,
    reached: [BTreeSet<TreePath>; JOINT_COUNT],
    survived: [BTreeSet<TreePath>; JOINT_COUNT],
    cuts: BTreeMap<(usize, TreePath), String>,
}

fn plain(view: &View, options: &TreeOptions) -> Plain {
    let mut plain = Plain::default();
    'leaf: for bits in 0..1u16 << 13 {
        let leaf = TreePath(bits << 1);
        let mut placed = PerJoint([Placed::UNKNOWN; JOINT_COUNT]);
        placed[Joint::Neck] = view.root();
        let mut way = Vec::new();
        for joint in Joint::ALL.into_iter().skip(1) {
            let (candidates, count) = view.candidates(placed[joint.start().unwrap()].point, joint);
            if count == 1 && leaf.is_far(joint) {
                continue 'leaf;
            }
            placed[joint] = candidates[usize::from(leaf.is_far(joint))];
            let path = TreePath(leaf.0 & ((1u32 << (joint as u32 + 1)) - 1) as u16);
            let figure = PlacedFigure::of(&placed);
            let known = figure.known();
            let trunk = Trunk::of(&figure, &options.bearings);
            let broken = Constraint::ALL.into_iter().find(|&constraint| {
                constraint.level() == joint
                    && options.asks(constraint)
                    && known.contains(constraint.joints())
                    && options.check(constraint, &figure, &trunk, &view.lengths).is_some()
            });
            if let Some(constraint) = broken {
                plain.cuts.insert((joint as usize, path), constraint.name());
                continue 'leaf;
            }
            plain.reached[joint as usize].insert(path);
            way.push((joint as usize, path));
        }
        plain.survivors.insert(leaf);
        for (level, path) in way {
            plain.survived[level].insert(path);
        }
    }
    plain
}

fn assert_same(view: &View, options: &TreeOptions) -> usize {
    let found = view.interpret(options).unwrap();
    let plain = plain(view, options);
    let survivors: BTreeSet<TreePath> = found.survivors.iter().copied().collect();
    assert_eq!(survivors, plain.survivors);
    assert_eq!(survivors.len(), found.survivors.len());
    for joint in Joint::ALL.into_iter().skip(1) {
        let level = joint as usize;
        assert_eq!(found.counts[joint].reached as usize, plain.reached[level].len(), "{joint:?}");
        assert_eq!(found.counts[joint].survived as usize, plain.survived[level].len(), "{joint:?}");
    }
    let mut reasons = BTreeMap::<String, u32>::new();
    plain.cuts.values().for_each(|name| *reasons.entry(name.clone()).or_default() += 1);
    let found_reasons = found.reasons.iter().map(|r| (r.constraint.name(), r.branches)).collect();
    assert_eq!(reasons, found_reasons);
    let cuts: BTreeMap<(usize, TreePath), String> = found
        .cuts
        .iter()
        .map(|cut| ((cut.violation.joint as usize, cut.path), cut.violation.constraint.name()))
        .collect();
    assert_eq!(cuts, plain.cuts);
    found.survivors.len()
}

#[test]
fn the_walk_is_the_plain_tree() {
    let bearings = Bearings {
        up: Some(DVec3::new(0.02, -1.0, 0.05).normalize()),
        heading: None,
        head: Some(glam::DMat3::from_rotation_y(0.4)),
    };
    let mut survivors = Vec::new();
    for seed in 0..14 {
        let mut view = view_of(seed, [0.0, 1e-3, 3e-3][seed as usize % 3]);
        view.merge_m = [0.0, 0.04][seed as usize % 2];
        let mut options = match seed % 4 {
            0 => TreeOptions::physical(),
            1 => TreeOptions::physical_paper().with_motion(MotionModel::walking_general_paper()),
            2 => TreeOptions::physical().with_motion(every_rule()),
            _ => TreeOptions { limits: None, ..TreeOptions::physical().with_motion(every_rule()) },
        };
        options.keep_cuts = true;
        if seed % 3 == 1 {
            options.bearings = bearings;
        }
        if seed % 5 == 4 {
            view.rays.ray[Joint::LeftElbow] = DVec3::NAN;
        }
        if seed == 13 {
            view.rays.ray[Joint::RightHip] = DVec3::NAN;
        }
        survivors.push(assert_same(&view, &options));
    }
    assert!(survivors.iter().filter(|&&n| n > 0).count() >= 6, "{survivors:?}");
}

#[test]
fn without_constraints_every_leaf_survives() {
    let options = TreeOptions { limits: None, collisions: None, ..TreeOptions::physical() };
    // After a wrong root the next segment may have none, so not every view has all 2^13 leaves.
    let full = |view: &View| view.interpret(&options).unwrap().survivors.len() == 8192;
    let view = (0..50).map(|seed| view_of(seed, 0.0)).find(full).unwrap();
    let found = view.interpret(&options).unwrap();
    for joint in Joint::ALL {
        assert_eq!(found.counts[joint].reached, 1 << joint as u32);
        assert_eq!(found.counts[joint].survived, 1 << joint as u32);
    }
    assert!(found.reasons.is_empty() && found.least_violating.is_none());
    for interpretation in found.interpretations().take(100) {
        for joint in Joint::ALL.into_iter().skip(1) {
            let length = interpretation.figure.segment(joint).length();
            assert!((length - view.lengths.to[joint]).abs() < 1e-9);
        }
    }
}

/// The least violating posture is that of an exhaustive search, and it has the reported violations.
#[test]
fn the_least_violating_posture_has_no_better() {
    let mut tried = 0;
    for seed in 0..40 {
        let view = view_of(seed, 0.0);
        let options = TreeOptions::physical_paper().with_motion(MotionModel::walking_paper());
        let found = view.interpret(&options).unwrap();
        let Some(least) = &found.least_violating else {
            assert!(!found.survivors.is_empty());
            continue;
        };
        tried += 1;
        let total = |path| view.violations(path, &options).iter().map(|v| v.severity().powi(2)).sum::<f64>();
        let exhaustive = (0..1u16 << 13).map(|bits| total(TreePath(bits << 1))).fold(f64::MAX, f64::min);
        assert!((least.total - exhaustive).abs() < 1e-9 * (1.0 + exhaustive));
        assert!((total(least.interpretation.path) - exhaustive).abs() < 1e-9 * (1.0 + exhaustive));
        assert!(!least.violations.is_empty());
        if tried == 3 {
            break;
        }
    }
    assert_eq!(tried, 3);
}

#[test]
fn unseen_joints_are_left_open_with_all_that_hangs_on_them() {
    let mut view = view_of(5, 0.0);
    view.rays.ray[Joint::RightElbow] = DVec3::NAN;
    let found = view.interpret(&TreeOptions::physical()).unwrap();
    assert!(found.open.contains(&Constraint::ElbowExtension(Side::Right)));
    assert!(!found.open.contains(&Constraint::ElbowExtension(Side::Left)));
    let first = found.interpretations().next();
    let interpretation = first.or(found.least_violating.map(|l| l.interpretation));
    let interpretation = interpretation.unwrap();
    assert!(interpretation.figure[Joint::RightWrist].is_nan());
    assert!(interpretation.kinds[Joint::RightWrist].is_none());
    assert!(interpretation.figure[Joint::RightKnee].is_finite());

    view.rays.ray = PerJoint([DVec3::NAN; JOINT_COUNT]);
    let nothing = view.interpret(&TreeOptions::physical()).unwrap();
    assert_eq!(nothing.survivors, [TreePath::default()]);
    assert!(nothing.reasons.is_empty() && !nothing.open.is_empty());
}

#[test]
fn bad_input_is_refused_with_its_values() {
    let view = view_of(1, 0.0);
    let options = TreeOptions::physical();
    let refused = |change: &dyn Fn(&mut View)| {
        let mut view = view;
        change(&mut view);
        view.interpret(&options).unwrap_err().to_string()
    };
    assert!(refused(&|view| view.neck.z = -1.0).contains("neck"));
    assert!(refused(&|view| view.neck.x = f64::NAN).contains("neck"));
    assert!(refused(&|view| view.rays.ray[Joint::LeftKnee] *= 2.0).contains("left_knee"));
    assert!(refused(&|view| view.rays.noise_rad = f64::NAN).contains("noise_rad"));
    assert!(refused(&|view| view.merge_m = -0.1).contains("merge_m"));
    assert!(refused(&|view| view.lengths.to[Joint::LeftKnee] = 38.0).contains("metres"));
    let options = options.clone().with_bearings(Bearings { up: Some(DVec3::ZERO), ..Bearings::default() });
    assert!(view.interpret(&options).unwrap_err().to_string().contains("up"));
}

/// Noise of a joint's depth adds up along its chain, including the neck's; without image noise, it is that of
/// each length.
#[test]
fn depths_are_as_unsure_as_their_chain() {
    let view = View { neck_sd_m: 0.05, ..view_of(3, 1e-3) };
    let found = view.interpretation(TreePath::default());
    for joint in Joint::ALL.into_iter().skip(1) {
        let mut variance = 0.05f64.powi(2);
        let mut end = joint;
        while let Some(start) = end.start() {
            variance += found.segment_sd_m[end].powi(2);
            end = start;
        }
        assert!((found.depth_sd_m[joint] - variance.sqrt()).abs() < 1e-12, "{joint:?}");
    }
    let quiet = View { length_sd_m: 0.02, ..view_of(3, 0.0) };
    let found = quiet.interpretation(TreePath::default());
    for joint in Joint::ALL.into_iter().skip(1) {
        let ray = quiet.rays.ray[joint];
        let start = found.figure[joint.start().unwrap()];
        let across = (start - start.dot(ray) * ray).length();
        let extent = (quiet.lengths.to[joint].powi(2) - across * across).max(0.0).sqrt();
        let expected = crate::posture::lift::extent_sd(extent, across, 0.02);
        assert!((found.segment_sd_m[joint] - expected).abs() < 1e-9, "{joint:?}");
    }
}

/// The path of a figure depends on its segments, not on its position.
#[test]
fn a_figure_elsewhere_has_the_same_path() {
    for seed in 0..10 {
        let view = view_of(seed, 0.0);
        let path = TreePath((seed as u16 * 1237) << 1);
        let figure = view.interpretation(path).figure;
        let again = view.interpretation(view.nearest_path(&figure)).figure;
        let moved = PerJoint(figure.0.map(|p| p + DVec3::new(0.7, -0.2, 1.5)));
        let elsewhere = view.interpretation(view.nearest_path(&moved)).figure;
        for joint in Joint::ALL {
            assert!((again[joint] - figure[joint]).length() < 1e-9);
            assert!((elsewhere[joint] - figure[joint]).length() < 1e-9);
        }
    }
}

/// Cut branches are in depth-first order: near before far, at the first joint at which they differ.
#[test]
fn cuts_are_in_the_order_of_the_walk() {
    let options = TreeOptions { keep_cuts: true, ..TreeOptions::physical() };
    let found = view_of(5, 1e-3).interpret(&options).unwrap();
    assert!(found.cuts.len() > 20);
    for pair in found.cuts.windows(2) {
        let parts =
            Joint::ALL.into_iter().find(|&joint| pair[0].path.is_far(joint) != pair[1].path.is_far(joint));
        assert!(parts.is_none_or(|joint| !pair[0].path.is_far(joint)), "{pair:?}");
    }
}

/// Among postures with the same violations, the first of the walk is taken.
#[test]
fn of_equally_bad_postures_the_first_is_taken() {
    let view = view_of(4, 0.0);
    let mut lengths = view.lengths;
    // The shoulders are much too near in every posture, and nothing else is evaluated.
    lengths.rigid = [1.4; 4];
    let anything = |limits: &mut crate::model::limits::Limits| {
        let free = crate::model::limits::AngleRange::from_deg(-400.0, 400.0);
        (limits.shoulder_swing, limits.shoulder_abduction, limits.hip_swing) = (free, free, free);
        (limits.hip_abduction, limits.elbow, limits.knee, limits.pelvis_flexion) = (free, free, free, free);
        limits.pelvis_rotation_rad = 9.0;
        limits.pelvis_bending_rad = 9.0;
        limits.hip_flexion_straight_rad = 9.0;
    };
    let mut options = TreeOptions::physical_paper();
    options.collisions = None;
    anything(options.limits.as_mut().unwrap());
    let found = View { lengths, ..view }.interpret(&options).unwrap();
    let least = found.least_violating.unwrap();
    // Limbs are free: all their joints at the nearer root.
    for side in Side::BOTH {
        for joint in [side.elbow(), side.wrist(), side.knee(), side.ankle()] {
            assert!(!least.interpretation.path.is_far(joint), "{joint:?}");
        }
    }
}

/// Limits of the neck are evaluated if the head is known.
#[test]
fn the_neck_s_limits_need_the_head() {
    use crate::posture::constraint::Constraint;
    let without = TreeOptions::physical();
    let head = Bearings { head: Some(glam::DMat3::IDENTITY), ..Bearings::default() };
    let with = TreeOptions::physical().with_bearings(head);
    for constraint in [
        Constraint::NeckFlexion,
        Constraint::NeckExtension,
        Constraint::NeckRotation,
        Constraint::NeckBending,
    ] {
        assert!(!without.asks(constraint) && with.asks(constraint));
    }
    assert!(without.asks(Constraint::PelvisFlexion) && with.asks(Constraint::PelvisFlexion));
}
