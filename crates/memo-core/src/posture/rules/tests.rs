use std::collections::BTreeSet;

use super::*;
use crate::model::skeleton::{PerJoint, StickFigure};
use crate::posture::example::{
    ARM_M, LEG_M, TRUNK_M, WIDTH_M, forward_deg, lengths_of, outward_deg, seen_along, shifted, standing,
    turned,
};
use crate::posture::placed::Bearings;
use crate::posture::tree::{TreeOptions, explain};

/// The rules that a figure breaks when it moves forward, with the violations.
fn broken(model: &MotionModel, figure: &StickFigure) -> Vec<Violation> {
    let bearings = Bearings { heading: Some(DVec3::X), ..Bearings::default() };
    let options = TreeOptions {
        limits: None,
        collisions: None,
        motion: Some(model.clone()),
        bearings,
        keep_cuts: false,
    };
    explain(figure, &lengths_of(&standing()), &options)
}

/// The names of the rules that a figure breaks.
fn rules(model: &MotionModel, figure: &StickFigure) -> Vec<Rule> {
    let broken = broken(model, figure);
    let rules: BTreeSet<usize> = broken.iter().map(|v| Rule::of(v.constraint).unwrap() as usize).collect();
    rules.into_iter().map(|rule| Rule::ALL[rule]).collect()
}

/// A figure whose segments swing forward by these degrees, by ending joint; the others hang down.
fn swung(swings_deg: &[(Joint, f64)]) -> StickFigure {
    swings_deg.iter().fold(standing(), |figure, &(end, angle)| turned(&figure, end, forward_deg(angle)))
}

/// A person with the right one of two joints in front of the body's plane and the left one behind it, by this
/// much.
fn ahead(right: Joint, by_m: f64, swings_deg: &[(Joint, f64)]) -> StickFigure {
    let figure = shifted(&standing(), right, by_m * DVec3::X);
    let figure = shifted(&figure, right.mirrored(), -by_m * DVec3::X);
    swings_deg.iter().fold(figure, |figure, &(end, angle)| turned(&figure, end, forward_deg(angle)))
}

/// The same for the hips.
fn hips_ahead(by_m: f64, swings_deg: &[(Joint, f64)]) -> StickFigure {
    ahead(Joint::RightHip, by_m, swings_deg)
}

/// The same for the shoulders.
fn shoulders_ahead(by_m: f64, swings_deg: &[(Joint, f64)]) -> StickFigure {
    ahead(Joint::RightShoulder, by_m, swings_deg)
}

/// A limb's segment out of the sagittal plane.
fn aside(side: Side, end: Joint, angle_deg: f64) -> StickFigure {
    turned(&standing(), end, outward_deg(side, angle_deg))
}

const R: Side = Side::Right;
const L: Side = Side::Left;

/// Both thighs vertical, the shanks bent back.
fn knees(right_deg: f64, left_deg: f64) -> StickFigure {
    swung(&[(Joint::RightAnkle, -right_deg), (Joint::LeftAnkle, -left_deg)])
}

/// The right knee flexed, the left leg straight and leaning forward.
fn one_knee(flexed_deg: f64, lean_deg: f64) -> StickFigure {
    swung(&[(Joint::RightAnkle, -flexed_deg), (Joint::LeftKnee, lean_deg), (Joint::LeftAnkle, lean_deg)])
}

/// A rule, its tolerance in degrees, and postures that exceed the tolerance by some degrees.
type Row = (Rule, f64, Box<dyn Fn(f64) -> StickFigure>);

/// For every rule, postures on both sides of the body that break it and no other rule.
fn rows(model: &MotionModel) -> Vec<Row> {
    use Joint::{LeftAnkle, LeftElbow, LeftKnee, LeftWrist, RightAnkle, RightElbow, RightKnee, RightWrist};
    let mut rows: Vec<Row> = Vec::new();
    let mut add = |rule: Rule, pose: Box<dyn Fn(f64) -> StickFigure>| {
        if let Some(tolerance) = model.tolerance(rule) {
            rows.push((rule, tolerance.angle_rad.to_degrees(), pose));
        }
    };
    for sign in [1.0, -1.0] {
        // The smaller of both swings counts: the other one is larger by 5 degrees.
        let both =
            move |a: Joint, b: Joint, angle: f64| swung(&[(a, sign * angle), (b, sign * (angle + 5.0))]);
        add(Rule::ArmsOpposed, Box::new(move |a| both(RightElbow, LeftElbow, a)));
        add(Rule::ArmOpposesLeg, Box::new(move |a| both(RightElbow, RightKnee, a)));
        add(Rule::ArmOpposesLeg, Box::new(move |a| both(LeftKnee, LeftElbow, a)));
        // If the thigh swings back and its shank is straight down, the knee is bent the wrong way, which no rule
        // forbids.
        add(Rule::LegsOpposed, Box::new(move |a| both(RightKnee, LeftKnee, a)));
    }
    for (end, beyond) in [(RightElbow, RightWrist), (LeftElbow, LeftWrist)] {
        add(Rule::ElbowWrist, Box::new(move |a| swung(&[(end, -a - 5.0), (beyond, a)])));
    }
    for (end, beyond) in [(RightKnee, RightAnkle), (LeftKnee, LeftAnkle)] {
        add(Rule::KneeAnkle, Box::new(move |a| swung(&[(end, a), (beyond, -a - 5.0)])));
    }
    add(Rule::HipKnee, Box::new(|a| hips_ahead(0.05, &[(RightKnee, -a), (RightAnkle, -a)])));
    add(Rule::HipKnee, Box::new(|a| hips_ahead(-0.05, &[(LeftKnee, -a), (LeftAnkle, -a)])));
    add(Rule::HipKnee, Box::new(|a| hips_ahead(-0.05, &[(RightKnee, a), (RightAnkle, a)])));
    add(Rule::ShoulderElbow, Box::new(|a| shoulders_ahead(0.05, &[(RightElbow, -a), (RightWrist, -a)])));
    add(Rule::ShoulderElbow, Box::new(|a| shoulders_ahead(0.05, &[(LeftElbow, a), (LeftWrist, a)])));
    for (side, angle_sign) in [(R, 1.0), (L, 1.0), (R, -1.0), (L, -1.0)] {
        for end in [side.elbow(), side.wrist()] {
            add(Rule::ArmPlane, Box::new(move |a| aside(side, end, angle_sign * a)));
        }
        for end in [side.knee(), side.ankle()] {
            add(Rule::LegPlane, Box::new(move |a| aside(side, end, angle_sign * a)));
        }
    }
    add(Rule::OneKneeFlexed, Box::new(|a| knees(a, a + 5.0)));
    add(Rule::OneKneeFlexed, Box::new(|a| knees(a + 5.0, a)));
    let flexed_deg = model.knee_flexed_rad.to_degrees() + 1.0;
    add(Rule::OtherLegUpright, Box::new(move |a| one_knee(flexed_deg, a)));
    add(Rule::OtherLegUpright, Box::new(move |a| one_knee(flexed_deg, -a)));
    add(Rule::OtherLegUpright, Box::new(move |a| mirrored(&one_knee(flexed_deg, a))));
    rows
}

/// Right and left exchanged.
fn mirrored(figure: &StickFigure) -> StickFigure {
    let reflect = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
    PerJoint(Joint::ALL.map(|joint| reflect(figure[joint.mirrored()])))
}

/// Each rule cuts a posture that no other rule of the model cuts if it exceeds the tolerance, and no rule cuts it
/// within the tolerance.
fn cuts_alone(model: &MotionModel, tolerances_deg: &[(Rule, f64)]) {
    let applying: Vec<Rule> = Rule::ALL.into_iter().filter(|&rule| model.tolerance(rule).is_some()).collect();
    let rows = rows(model);
    for &(rule, tolerance_deg) in tolerances_deg {
        let of_rule = || rows.iter().filter(move |row| row.0 == rule);
        assert!(of_rule().count() > 0, "{rule:?}");
        for (_, tolerance, pose) in of_rule() {
            assert!((tolerance - tolerance_deg).abs() < 1e-9, "{rule:?} {tolerance}");
            let passing = broken(model, &pose(tolerance_deg + 0.5));
            assert_eq!(rules(model, &pose(tolerance_deg + 0.5)), [rule], "{passing:?}");
            assert!((passing[0].excess.to_degrees() - 0.5).abs() < 1e-6, "{passing:?}");
            assert_eq!(rules(model, &pose(tolerance_deg - 0.5)), [], "{rule:?}");
        }
    }
    assert_eq!(tolerances_deg.iter().map(|t| t.0).collect::<Vec<_>>(), applying);
}

/// Tolerances at which true walks of motion capture keep the rules.
#[test]
fn each_rule_of_walking_cuts_what_no_other_rule_cuts() {
    cuts_alone(
        &MotionModel::walking(),
        &[
            (Rule::ArmsOpposed, 15.0),
            (Rule::LegsOpposed, 20.0),
            (Rule::ArmOpposesLeg, 15.0),
            (Rule::ElbowWrist, 30.0),
            (Rule::HipKnee, 10.0),
            (Rule::ArmPlane, 30.0),
            (Rule::LegPlane, 20.0),
            (Rule::OneKneeFlexed, 40.0),
            (Rule::OtherLegUpright, 20.0),
        ],
    );
}

#[test]
fn each_rule_of_walking_in_general_cuts_what_no_other_rule_cuts() {
    let opposed = [Rule::ArmsOpposed, Rule::LegsOpposed, Rule::ArmOpposesLeg];
    let general = [15.0, 20.0, 15.0];
    cuts_alone(&MotionModel::walking_general(), &[0, 1, 2].map(|i| (opposed[i], general[i])));
    cuts_alone(&MotionModel::walking_general_paper(), &opposed.map(|rule| (rule, 10.0)));
}

/// Only rules of the paper, because one as tight as printed mostly breaks another one too.
#[test]
fn each_rule_of_the_paper_cuts_beyond_its_tolerance() {
    let paper = MotionModel::walking_paper();
    assert_eq!((paper.knee_flexed_rad, paper.noise_factor), (15f64.to_radians(), 0.0));
    for (rule, tolerance_deg, distance_m) in [
        (Rule::ArmsOpposed, 10.0, 0.0),
        (Rule::LegsOpposed, 10.0, 0.0),
        (Rule::ArmOpposesLeg, 10.0, 0.0),
        (Rule::ShoulderElbow, 5.0, 0.01),
        (Rule::HipKnee, 5.0, 0.01),
        (Rule::ArmPlane, 15.0, 0.0),
        (Rule::LegPlane, 15.0, 0.0),
        (Rule::OneKneeFlexed, 15.0, 0.0),
        (Rule::OtherLegUpright, 20.0, 0.0),
    ] {
        let tolerance = paper.tolerance(rule).unwrap();
        assert!((tolerance.angle_rad.to_degrees() - tolerance_deg).abs() < 1e-9, "{rule:?}");
        assert_eq!(tolerance.distance_m, distance_m, "{rule:?}");
        let without = MotionModel { knee_flexed_rad: paper.knee_flexed_rad, ..MotionModel::without_rules() };
        cuts_alone(&without.with(rule, tolerance), &[(rule, tolerance_deg)]);
    }
    let walking = Rule::ALL.into_iter().filter(|rule| paper.tolerance(*rule).is_some());
    assert_eq!(walking.map(|rule| rule.number()).collect::<Vec<_>>(), [1, 1, 2, 3, 3, 4, 4, 5, 5]);
    let without = MotionModel::without_rules();
    let readings = [Rule::KneeAnkle, Rule::ElbowWrist].map(|rule| (rule, Tolerance::from_deg(20.0)));
    for (rule, tolerance) in readings {
        cuts_alone(&without.clone().with(rule, tolerance), &[(rule, 20.0)]);
        assert_eq!(rule.number(), 3);
    }
}

/// Rules 1 to 3 forbid a common or an opposite swing; the other way round is allowed.
#[test]
fn swings_that_a_walker_makes_pass() {
    use Joint::{LeftAnkle, LeftElbow, LeftKnee, LeftWrist, RightAnkle, RightElbow, RightKnee, RightWrist};
    let walking = MotionModel::walking();
    // Right arm and left leg forward, by any angle.
    let stride = swung(&[
        (RightElbow, 35.0),
        (RightWrist, 50.0),
        (LeftElbow, -35.0),
        (LeftWrist, -20.0),
        (RightKnee, -35.0),
        (RightAnkle, -35.0),
        (LeftKnee, 35.0),
        (LeftAnkle, 35.0),
    ]);
    assert_eq!(rules(&walking, &stride), []);
    // Thigh and hip on one side of the body's plane, thigh forward and shank backward.
    let hips = hips_ahead(0.05, &[(RightKnee, 25.0), (LeftKnee, -25.0), (LeftAnkle, -60.0)]);
    assert_eq!(rules(&walking, &hips), []);
    // Hips within the distance may swing opposite to their thighs.
    let near = hips_ahead(0.029, &[(RightKnee, -19.0), (RightAnkle, -19.0)]);
    assert_eq!(rules(&walking, &near), []);
    assert_eq!(
        rules(&walking, &hips_ahead(0.031, &[(RightKnee, -19.0), (RightAnkle, -19.0)])),
        [Rule::HipKnee]
    );
    // One flexed knee with an upright leg; two slightly flexed knees with leaning legs.
    assert_eq!(rules(&walking, &one_knee(60.0, 19.0)), []);
    assert_eq!(rules(&walking, &one_knee(39.0, 25.0)), []);
    // A knee counts as flexed from 40 degrees: at 45, with the other leg leaning, the posture is not walking.
    assert_eq!(rules(&walking, &one_knee(45.0, 25.0)), [Rule::OtherLegUpright]);
    assert_eq!(rules(&walking, &mirrored(&one_knee(45.0, 25.0))), [Rule::OtherLegUpright]);
    assert_eq!(rules(&walking, &knees(45.0, 45.0)), [Rule::OneKneeFlexed]);
}

/// The violation of a constraint by a figure of noisy joints that moves forward.
fn against(model: &MotionModel, placed: &PerJoint<Placed>, constraint: Constraint) -> Option<Violation> {
    let figure = PlacedFigure::of(placed);
    let bearings = Bearings { heading: Some(DVec3::X), ..Bearings::default() };
    model.check(constraint, &figure, &Trunk::of(&figure, &bearings))
}

/// A value is moved towards 0 by `noise_factor` standard deviations of its noise: displacements across the rays
/// divided by the lengths of limb and trunk.
#[test]
fn values_are_drawn_in_by_the_noise_of_limb_and_trunk() {
    use Constraint as C;
    let (limb_m, trunk_m) = (0.012, 0.015);
    let (arm, leg, trunk) = (limb_m / ARM_M, limb_m / LEG_M, trunk_m / TRUNK_M);
    let leg_line = limb_m / (2.0 * LEG_M);
    let mut model = MotionModel::walking();
    model = model.with(Rule::KneeAnkle, Tolerance::from_deg(10.0));
    let hips = hips_ahead(0.05, &[(Joint::RightKnee, -30.0)]);
    let cases = [
        (
            C::ArmsOpposed,
            swung(&[(Joint::RightElbow, 30.0), (Joint::LeftElbow, 60.0)]),
            Joint::RightElbow,
            arm,
            trunk,
        ),
        (
            C::ArmOpposesLeg(R),
            swung(&[(Joint::RightElbow, 60.0), (Joint::RightKnee, 30.0)]),
            Joint::RightKnee,
            leg,
            trunk,
        ),
        (
            C::ElbowWrist(L),
            swung(&[(Joint::LeftElbow, -70.0), (Joint::LeftWrist, 45.0)]),
            Joint::LeftWrist,
            arm,
            trunk,
        ),
        (
            C::KneeAnkle(L),
            swung(&[(Joint::LeftKnee, 25.0), (Joint::LeftAnkle, -70.0)]),
            Joint::LeftKnee,
            leg,
            trunk,
        ),
        (C::HipKnee(R), hips, Joint::RightKnee, leg, trunk),
        (C::UpperArmPlane(L), aside(L, Joint::LeftElbow, 60.0), Joint::LeftElbow, arm, 0.0),
        (C::ShankPlane(R), aside(R, Joint::RightAnkle, 60.0), Joint::RightAnkle, leg, 0.0),
        (C::OneKneeFlexed, knees(60.0, 90.0), Joint::RightKnee, leg, 0.0),
        (C::OneKneeFlexed, knees(60.0, 90.0), Joint::RightAnkle, leg, 0.0),
    ];
    for noise_factor in [1.0, 2.0] {
        let model = MotionModel { noise_factor, ..model.clone() };
        for (constraint, figure, joint, of_limb, of_trunk) in cases {
            let mut placed = seen_along(&figure, DVec3::Z);
            let quiet = against(&model, &placed, constraint).unwrap();
            placed[joint].lateral_m = limb_m;
            placed[Joint::Pelvis].lateral_m = trunk_m;
            let noisy = against(&model, &placed, constraint).unwrap();
            let expected = noise_factor * f64::hypot(of_limb, of_trunk);
            assert!(
                (quiet.value - noisy.value - expected).abs() < 1e-9,
                "{constraint:?} {joint:?} {noisy:?}"
            );
            assert_eq!(quiet.limit, noisy.limit);
        }
        // The line of a leg is as long as the leg, and its ends move only in depth.
        let leaning = seen_along(&one_knee(60.0, 40.0), DVec3::X);
        let mut placed = leaning;
        let quiet = against(&model, &placed, C::OtherLegUpright).unwrap();
        placed[Joint::LeftKnee].sd_m = limb_m;
        let noisy = against(&model, &placed, C::OtherLegUpright).unwrap();
        assert!((quiet.value - noisy.value - noise_factor * leg_line).abs() < 1e-9, "{noisy:?}");
    }
}

/// A hip in front of the body's plane by less than its noise breaks no rule.
#[test]
fn noise_of_the_hip_lets_rule_3_pass() {
    let figure = hips_ahead(0.05, &[(Joint::RightKnee, -30.0), (Joint::RightAnkle, -30.0)]);
    let mut placed = seen_along(&figure, DVec3::Z);
    for (hip_m, is_cut) in [(0.0, true), (0.018, true), (0.022, false)] {
        placed[Joint::RightHip].lateral_m = hip_m;
        let found = against(&MotionModel::walking(), &placed, Constraint::HipKnee(R));
        assert_eq!(found.is_some(), is_cut, "{hip_m}");
    }
}

/// If the moving direction comes from the trunk alone, its noise is in rule 4: if both shoulders are off by s,
/// the line between them turns by √2 s divided by its length.
#[test]
fn a_direction_taken_from_the_trunk_is_as_noisy_as_the_shoulders() {
    let shoulder_m = 0.02;
    let mut placed = seen_along(&aside(L, Joint::LeftElbow, 60.0), DVec3::Y);
    let value = |placed: &PerJoint<Placed>, bearings: &Bearings| {
        let figure = PlacedFigure::of(placed);
        let trunk = Trunk::of(&figure, bearings);
        MotionModel::walking().check(Constraint::UpperArmPlane(L), &figure, &trunk).unwrap().value
    };
    let given = Bearings { heading: Some(DVec3::X), ..Bearings::default() };
    let quiet = value(&placed, &Bearings::default());
    for side in Side::BOTH {
        placed[side.shoulder()].lateral_m = shoulder_m;
    }
    let expected = std::f64::consts::SQRT_2 * shoulder_m / WIDTH_M;
    assert!((quiet - value(&placed, &Bearings::default()) - expected).abs() < 1e-9);
    assert!((quiet - value(&placed, &given)).abs() < 1e-12);
}

#[test]
fn names_and_numbers_lead_to_their_rules() {
    for rule in Rule::ALL {
        assert_eq!(Rule::from_name(rule.name()), Some(rule));
        assert_eq!(Rule::ALL[rule as usize], rule);
    }
    for constraint in Constraint::ALL {
        let is_rule = constraint.kind() == crate::posture::constraint::ConstraintKind::Rule;
        assert_eq!(Rule::of(constraint).is_some(), is_rule, "{constraint:?}");
    }
}
