use super::*;
use crate::model::skeleton::Side;
use crate::posture::example::{LEG_M, TRUNK_M, WIDTH_M, seen_along, standing, turned};
use crate::posture::lift::roots;
use crate::synth::Random;

/// An oblique segment with a noisy end.
fn noisy() -> Placed {
    let mut placed = seen_along(&standing(), DVec3::new(0.3, 0.8, 0.5))[Joint::LeftKnee];
    (placed.sd_m, placed.lateral_m) = (0.03, 0.012);
    placed
}

/// Displacements of the end of a segment: along the ray, and the same in all directions.
fn drawn(placed: &Placed, random: &mut Random) -> DVec3 {
    let mut normal = || f64::from(random.normal_pair()[0]);
    placed.ray * (placed.sd_m * normal()) + placed.lateral_m * DVec3::new(normal(), normal(), normal())
}

#[test]
fn the_noise_of_a_direction_is_the_spread_of_drawn_ends() {
    let placed = noisy();
    let mut random = Random::new(5);
    let towards = [DVec3::X, DVec3::Z, DVec3::new(0.6, 0.0, -0.8)];
    let mut sums = [0.0; 3];
    let draws = 40_000;
    for _ in 0..draws {
        let unit = (placed.unit * placed.length_m + 0.1 * drawn(&placed, &mut random)).normalize();
        (0..3).for_each(|i| sums[i] += (unit.dot(towards[i]) * 10.0).powi(2));
    }
    for (sum, towards) in sums.into_iter().zip(towards) {
        let spread = (sum / f64::from(draws)).sqrt();
        assert!((placed.direction_sd(towards) - spread).abs() < 0.02 * spread, "{towards} {spread}");
        assert!(placed.direction_sd(towards) <= placed.worst_direction_sd());
    }
    // The largest over all directions across the segment.
    let largest = (0..360)
        .map(|deg| DVec3::new(f64::to_radians(deg.into()).cos(), 0.0, f64::to_radians(deg.into()).sin()))
        .map(|towards| placed.direction_sd(towards))
        .fold(0.0, f64::max);
    assert!((placed.worst_direction_sd() - largest).abs() < 1e-4 * largest);
}

/// Two image points with noise across the ray give √2 of it for the ends of a segment.
#[test]
fn a_joint_at_a_root_has_the_noise_of_two_image_points() {
    let (start, ray) = (DVec3::new(0.2, -0.1, 4.0), DVec3::new(0.1, 0.05, 1.0).normalize());
    let found = roots(start, ray, 0.5, 0.002, 0.0);
    let placed = Placed::at_root(start, found.near, ray, &found, 0.002);
    assert!(
        (placed.length_m - 0.5).abs() < 1e-12 && (placed.unit * 0.5 - (found.near - start)).length() < 1e-12
    );
    assert!((placed.lateral_m - 2f64.sqrt() * 0.002 * found.near.length()).abs() < 1e-12);
    assert_eq!(placed.sd_m, found.sd_m);
}

/// Rotation of the axes of trunk or hips by a small displacement of one joint, radians about x, y, z.
fn turn_of(displaced: Joint, by: DVec3, axes: fn(&StickFigure) -> Option<DMat3>) -> DVec3 {
    let mut figure = standing();
    let before = axes(&figure).unwrap();
    figure[displaced] += by;
    let turn = glam::DQuat::from_mat3(&(axes(&figure).unwrap() * before.transpose())).to_scaled_axis();
    turn / by.length()
}

/// The noise of the axes, for each displacement alone, against the rotations of the axes themselves.
#[test]
fn the_axes_are_as_noisy_as_their_joints_turn_them() {
    let noise_m = 0.01;
    for axis in [DVec3::X, DVec3::Z] {
        let mut placed = seen_along(&standing(), axis);
        for joint in
            [Joint::Pelvis, Joint::RightShoulder, Joint::LeftShoulder, Joint::RightHip, Joint::LeftHip]
        {
            placed[joint].sd_m = noise_m;
        }
        let figure = PlacedFigure::of(&placed);
        let trunk = Trunk::of(&figure, &Bearings::default());
        let squares = |joints: &[Joint], axes: fn(&StickFigure) -> Option<DMat3>| {
            let turns = joints.iter().map(|&joint| turn_of(joint, 1e-6 * axis, axes));
            let sum: DVec3 = turns.map(|turn| turn * turn).sum();
            noise_m * DVec3::new(sum.x.sqrt(), sum.y.sqrt(), sum.z.sqrt())
        };
        // The pelvis, which rotates the trunk's y, and the shoulders, which rotate the trunk about y.
        let torso = squares(&[Joint::Pelvis, Joint::RightShoulder, Joint::LeftShoulder], trunk_axes);
        assert!((trunk.torso_sd - torso).abs().max_element() < 1e-6, "{} {torso}", trunk.torso_sd);
        let hips = squares(&[Joint::RightHip, Joint::LeftHip], hip_axes);
        assert!(
            (trunk.hips_sd(&figure) - hips).abs().max_element() < 1e-6,
            "{} {hips}",
            trunk.hips_sd(&figure)
        );
    }
    assert!((trunk_of_quiet().torso_sd).length() == 0.0);
}

fn trunk_of_quiet() -> Trunk {
    Trunk::of(&PlacedFigure::of(&seen_along(&standing(), DVec3::Z)), &Bearings::default())
}

/// A given direction is used before the face's, and that before the trunk's.
#[test]
fn the_moving_direction_is_the_given_one_else_the_faces_else_the_trunks() {
    let placed = seen_along(&standing(), DVec3::Z);
    let figure = PlacedFigure::of(&placed);
    let given = DVec3::new(0.8, 0.1, 0.6);
    let head = DMat3::from_rotation_y(0.4);
    let normal = |v: DVec3| (v - v.dot(DVec3::Y) * DVec3::Y).normalize();
    for (heading, head, source, forward) in [
        (Some(given), Some(head), HeadingSource::Given, given),
        (Some(given), None, HeadingSource::Given, given),
        (None, Some(head), HeadingSource::Head, head.x_axis),
        (None, None, HeadingSource::Trunk, DVec3::X),
    ] {
        let bearings = Bearings { heading, head, up: None };
        let trunk = Trunk::of(&figure, &bearings);
        assert_eq!(bearings.heading_source(), source);
        assert!((trunk.body_normal - normal(forward)).length() < 1e-12, "{source:?}");
        assert!(trunk.lateral.dot(forward).abs() < 1e-12 && trunk.lateral.dot(trunk.up).abs() < 1e-12);
        assert!((trunk.up - DVec3::NEG_Y).length() < 1e-12);
    }
}

/// If the trunk leans forward, its own upward direction is not that of gravity.
#[test]
fn the_vertical_is_the_given_one_else_the_trunks() {
    let leaning = turned(&standing(), Joint::Pelvis, DVec3::new(-0.5, 1.0, 0.0));
    let placed = seen_along(&leaning, DVec3::Z);
    let figure = PlacedFigure::of(&placed);
    let own = Trunk::of(&figure, &Bearings::default());
    assert!((own.up - DVec3::new(0.5, -1.0, 0.0).normalize()).length() < 1e-12);
    let given = Bearings { up: Some(DVec3::new(0.0, -3.0, 0.0)), ..Bearings::default() };
    assert!((Trunk::of(&figure, &given).up - DVec3::NEG_Y).length() < 1e-12);
    // The body's plane is that of the trunk: its normal is perpendicular to the spine, not horizontal.
    let heading = Bearings { heading: Some(DVec3::X), ..given };
    let trunk = Trunk::of(&figure, &heading);
    assert!(trunk.body_normal.dot(DVec3::new(-0.5, 1.0, 0.0)).abs() < 1e-12 && trunk.body_normal.x > 0.8);
}

#[test]
fn a_figure_knows_which_joints_it_has() {
    let mut figure = standing();
    figure[Joint::LeftWrist] = DVec3::NAN;
    let placed = placed_points(&figure);
    let known = PlacedFigure::of(&placed).known();
    for joint in Joint::ALL {
        assert_eq!(known.contains(JointSet::of(&[joint])), joint != Joint::LeftWrist);
    }
    assert!((placed[Joint::LeftKnee].length_m - LEG_M).abs() < 1e-12);
    assert!((placed[Joint::Pelvis].length_m - TRUNK_M).abs() < 1e-12);
    let width = placed[Side::Left.shoulder()].point.distance(placed[Side::Right.shoulder()].point);
    assert!((width - WIDTH_M).abs() < 1e-12);
}
