//! The angles of a stick figure in the paper's axes (Lee and Chen 1985, sections 3.1 and 3.2 A).
//!
//! The axes of the trunk, with the origin at the neck: y to the pelvis (down the trunk), z from the right
//! shoulder to the left, x = y × z forward. y and z are not exactly perpendicular; z is replaced by x × y.
//! Angles are signed, in radians; the direction the paper names first is positive: flexion, abduction.
//!
//! The paper's angle from y to the projection of a limb has a clockwise sign, as atan2 of the two components
//! has. The sign of the knee is opposite to that of the elbow, because a knee bends backwards: the paper's
//! "by the same token" cannot be meant literally.

use glam::{DMat3, DVec3};

use super::skeleton::{Joint, Side, StickFigure};

/// The axes of the trunk: columns x forward, y from neck to pelvis, z from right to left.
///
/// `None` where neck, pelvis or a shoulder is unknown or the four points lie on a line.
pub fn trunk_axes(figure: &StickFigure) -> Option<DMat3> {
    axes(figure.segment(Joint::Pelvis), figure[Joint::LeftShoulder] - figure[Joint::RightShoulder])
}

/// The axes of the hip part, in the same sense: y from the pelvis to the midpoint of the hips, z from the
/// right hip to the left. Its x is the normal of the paper's hip plane.
pub fn hip_axes(figure: &StickFigure) -> Option<DMat3> {
    let [right, left] = [figure[Joint::RightHip], figure[Joint::LeftHip]];
    axes(0.5 * (right + left) - figure[Joint::Pelvis], left - right)
}

fn axes(down: DVec3, across: DVec3) -> Option<DMat3> {
    let y = down.try_normalize()?;
    let x = y.cross(across).try_normalize()?;
    Some(DMat3::from_cols(x, y, x.cross(y)))
}

/// The axes of a leg below the knee, in the same sense: y from the knee to the ankle, z from the right hip to the left.
pub fn leg_axes(figure: &StickFigure, side: Side) -> Option<DMat3> {
    axes(figure.segment(side.ankle()), figure[Joint::LeftHip] - figure[Joint::RightHip])
}

/// Flexion (+) or extension (-) of a limb of direction `u`, radians: θ, the angle from y to u in the xy
/// plane.
pub fn swing_rad(axes: &DMat3, u: DVec3) -> f64 {
    axes.x_axis.dot(u).atan2(axes.y_axis.dot(u))
}

/// Abduction (+) or adduction (-) of a limb of direction `u` on one side, radians: φ, the angle from y to u
/// in the yz plane.
pub fn abduction_rad(axes: &DMat3, u: DVec3, side: Side) -> f64 {
    let outward = match side {
        Side::Right => -axes.z_axis.dot(u),
        Side::Left => axes.z_axis.dot(u),
    };
    outward.atan2(axes.y_axis.dot(u))
}

/// Flexion (+) or extension (-) at an elbow between upper arm `u` and forearm `v`, radians: ψ with the sign
/// of w_z, w = v × u.
pub fn elbow_rad(axes: &DMat3, u: DVec3, v: DVec3) -> f64 {
    let w = v.cross(u);
    w.length().atan2(u.dot(v)).copysign(axes.z_axis.dot(w) + 0.0)
}

/// Flexion (+) or extension (-) at a knee between thigh `u` and shank `v`, radians: ψ with the sign of -w_z.
pub fn knee_rad(axes: &DMat3, u: DVec3, v: DVec3) -> f64 {
    let w = v.cross(u);
    w.length().atan2(u.dot(v)).copysign(0.0 - axes.z_axis.dot(w))
}

/// Angles of one rigid part relative to another: of the hip part or the head relative to the torso.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartAngles {
    /// δ, the angle of the part's normal from x in the xy plane, radians: flexion (bent forward) positive.
    pub flexion_rad: f64,
    /// Angle of the part's normal from x in the zx plane, radians: turned to the left positive.
    pub rotation_rad: f64,
    /// Angle of the part's long axis from y in the yz plane, radians: bent to the left positive.
    pub bending_rad: f64,
}

impl PartAngles {
    pub(crate) const UNKNOWN: Self =
        Self { flexion_rad: f64::NAN, rotation_rad: f64::NAN, bending_rad: f64::NAN };

    /// Angles at the pelvis joint.
    ///
    /// Flexion bends the torso towards the front of the hips; the normal of the hip part then points upwards
    /// in the torso's axes, towards -y.
    pub fn of_hips(torso: &DMat3, hips: &DMat3) -> Self {
        Self::between(torso, hips.x_axis, hips.y_axis)
    }

    /// Angles at the neck joint. `head` has the same sense as the torso's axes: x in the facing direction, y
    /// down.
    ///
    /// Flexion lowers the chin: the normal of the head points towards +y.
    pub fn of_head(torso: &DMat3, head: &DMat3) -> Self {
        let angles = Self::between(torso, head.x_axis, -head.y_axis);
        Self { flexion_rad: -angles.flexion_rad, ..angles }
    }

    fn between(torso: &DMat3, normal: DVec3, long_axis: DVec3) -> Self {
        let n = torso.transpose() * normal;
        let axis = torso.transpose() * long_axis;
        Self {
            flexion_rad: (-n.y).atan2(n.x),
            rotation_rad: n.z.atan2(n.x),
            bending_rad: axis.z.atan2(axis.y.abs()),
        }
    }
}

/// Angles at the joints of one side in the sense of gait analysis, radians; NaN where a joint they need is unknown.
///
/// Thigh and upper arm: R_z(flexion) R_x(adduction) as in OpenSim's models, z along the line of the hips or of the
/// shoulders and y along the trunk, made perpendicular to z. So flexion is in the plane across the line of the joints,
/// and adduction is how far the limb is turned out of this plane. [`swing_rad`] and [`abduction_rad`] are the paper's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointAngles {
    /// Thigh against the trunk, to the front positive.
    pub hip_flexion_rad: f64,
    /// Thigh towards the other leg, positive.
    pub hip_adduction_rad: f64,
    /// Shank against the thigh, to the back positive; positive too where a hip is unknown.
    pub knee_flexion_rad: f64,
    /// Upper arm against the trunk, to the front positive.
    pub shoulder_flexion_rad: f64,
    /// Upper arm towards the trunk, positive.
    pub shoulder_adduction_rad: f64,
    /// Forearm against the upper arm, 0 to π.
    pub elbow_flexion_rad: f64,
}

impl JointAngles {
    /// No knee bends farther to the front. A larger angle in that sense is that of a leg turned about its length.
    const MOST_BACKWARDS_RAD: f64 = 30.0 * std::f64::consts::PI / 180.0;

    /// The angles of a side.
    pub fn of(figure: &StickFigure, side: Side) -> Self {
        let down = figure[Joint::Pelvis] - figure[Joint::Neck];
        let hips = across(down, figure[Joint::LeftHip] - figure[Joint::RightHip]);
        let shoulders = across(down, figure[Joint::LeftShoulder] - figure[Joint::RightShoulder]);
        let [thigh, shank] = [side.knee(), side.ankle()].map(|joint| figure.segment(joint).normalize());
        let [upper_arm, forearm] =
            [side.elbow(), side.wrist()].map(|joint| figure.segment(joint).normalize());
        let bend_rad = thigh.angle_between(shank);
        let backwards = hips.z_axis.dot(shank.cross(thigh)) > 0.0 && bend_rad < Self::MOST_BACKWARDS_RAD;
        Self {
            hip_flexion_rad: swing_rad(&hips, thigh),
            hip_adduction_rad: turned_inwards_rad(&hips, thigh, side),
            knee_flexion_rad: if backwards { -bend_rad } else { bend_rad },
            shoulder_flexion_rad: swing_rad(&shoulders, upper_arm),
            shoulder_adduction_rad: turned_inwards_rad(&shoulders, upper_arm, side),
            elbow_flexion_rad: upper_arm.angle_between(forearm),
        }
    }
}

/// Height of the ankle over the tip of the big toe when a foot stands, as a share of the shank's length: an ankle is
/// 0.17 of it above the ground, the tip of the toe 0.05.
const ANKLE_OVER_TOE: f64 = 0.12;

/// Dorsiflexion (+) or plantar flexion (-) of a foot, radians: the angle in the plane of [`leg_axes`] between the shank
/// and the line from the ankle to the tip of the big toe, 0 if the sole is perpendicular to the shank. NaN if a joint is
/// unknown.
pub fn ankle_flexion_rad(figure: &StickFigure, toe: DVec3, side: Side) -> f64 {
    let foot = toe - figure[side.ankle()];
    let standing_rad = (ANKLE_OVER_TOE * figure.segment(side.ankle()).length() / foot.length()).asin();
    leg_axes(figure, side)
        .map_or(f64::NAN, |axes| swing_rad(&axes, foot) - std::f64::consts::FRAC_PI_2 + standing_rad)
}

/// Axes in the sense of [`trunk_axes`], but with z exactly from right to left; NaN if unknown.
fn across(down: DVec3, left: DVec3) -> DMat3 {
    let z = left.normalize();
    let x = down.cross(z).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

/// Angle of a limb of direction `u` out of the plane across `axes.z_axis`, radians, towards the other side positive.
fn turned_inwards_rad(axes: &DMat3, u: DVec3, side: Side) -> f64 {
    let inward = if side == Side::Left { -axes.z_axis } else { axes.z_axis };
    inward.dot(u).clamp(-1.0, 1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// An upright person, looking along X, Z up, Y to the left.
    fn upright() -> StickFigure {
        let mut figure = StickFigure::UNKNOWN;
        figure[Joint::Neck] = DVec3::new(0.0, 0.0, 1.4);
        figure[Joint::RightShoulder] = DVec3::new(0.0, -0.2, 1.4);
        figure[Joint::LeftShoulder] = DVec3::new(0.0, 0.2, 1.4);
        figure[Joint::Pelvis] = DVec3::new(0.0, 0.0, 1.0);
        figure[Joint::RightHip] = DVec3::new(0.0, -0.1, 0.9);
        figure[Joint::LeftHip] = DVec3::new(0.0, 0.1, 0.9);
        figure
    }

    #[test]
    fn the_trunk_looks_forward() {
        let axes = trunk_axes(&upright()).unwrap();
        assert!(axes.x_axis.distance(DVec3::X) < 1e-12);
        assert!(axes.y_axis.distance(-DVec3::Z) < 1e-12);
        assert!(axes.z_axis.distance(DVec3::Y) < 1e-12);
        assert!((axes.determinant() - 1.0).abs() < 1e-12);
        assert!(trunk_axes(&StickFigure::UNKNOWN).is_none());
    }

    #[test]
    fn limbs_flex_forward_and_abduct_outward() {
        let axes = trunk_axes(&upright()).unwrap();
        assert!((swing_rad(&axes, DVec3::X) - FRAC_PI_2).abs() < 1e-12);
        assert!(swing_rad(&axes, DVec3::new(-0.1, 0.0, -1.0)) < 0.0);
        assert!((abduction_rad(&axes, -DVec3::Y, Side::Right) - FRAC_PI_2).abs() < 1e-12);
        assert!((abduction_rad(&axes, DVec3::Y, Side::Left) - FRAC_PI_2).abs() < 1e-12);
        assert!(abduction_rad(&axes, DVec3::new(0.0, 0.1, -1.0), Side::Right) < 0.0);
    }

    #[test]
    fn elbows_bend_forwards_and_knees_backwards() {
        let axes = trunk_axes(&upright()).unwrap();
        let (down, forward) = (-DVec3::Z, DVec3::new(1.0, 0.0, -1.0));
        let quarter = std::f64::consts::FRAC_PI_4;
        assert!((elbow_rad(&axes, down, forward) - quarter).abs() < 1e-12);
        assert!((elbow_rad(&axes, forward, down) + quarter).abs() < 1e-12);
        assert!((knee_rad(&axes, forward, down) - quarter).abs() < 1e-12);
        assert!((knee_rad(&axes, down, forward) + quarter).abs() < 1e-12);
        assert_eq!(elbow_rad(&axes, down, down), 0.0);
        assert_eq!(knee_rad(&axes, down, down), 0.0);
    }

    /// A sole on the ground under an upright shank is at 0, whichever way the person faces; a foot turned up by 0.3 is
    /// at 0.3, also when its toes point outwards.
    #[test]
    fn ankles_flex_to_the_front() {
        let mut figure = upright();
        for (side, y) in [(Side::Right, -0.1), (Side::Left, 0.1)] {
            figure[side.knee()] = DVec3::new(0.0, y, 0.47);
            figure[side.ankle()] = DVec3::new(0.0, y, 0.07);
            let forward = (0.18f64.powi(2) - 0.048f64.powi(2)).sqrt();
            let standing = DVec3::new(forward, 0.0, -0.048);
            for raised_rad in [0.0, 0.3, -0.7] {
                // Turned about the right-to-left axis, up at the front.
                let foot = DMat3::from_rotation_y(-raised_rad) * standing;
                let toe = figure[side.ankle()] + foot;
                assert!((ankle_flexion_rad(&figure, toe, side) - raised_rad).abs() < 1e-9, "{raised_rad}");
            }
            let outwards = DMat3::from_rotation_z(y.signum() * 0.2) * standing;
            assert!(ankle_flexion_rad(&figure, figure[side.ankle()] + outwards, side).abs() < 0.01);
            assert!(ankle_flexion_rad(&figure, DVec3::NAN, side).is_nan());
        }
        assert!(ankle_flexion_rad(&upright(), DVec3::ZERO, Side::Right).is_nan());
    }

    #[test]
    fn hips_flex_turn_and_bend_as_named() {
        let torso = trunk_axes(&upright()).unwrap();
        // The trunk bends forward over the hips by 0.3: in its axes the hips turn the opposite way about z.
        let mut figure = upright();
        let bend = |p: DVec3, a: f64| {
            let about = DVec3::new(0.0, 0.0, 1.0);
            about + glam::DQuat::from_axis_angle(DVec3::Y, a) * (p - about)
        };
        for joint in [Joint::Neck, Joint::RightShoulder, Joint::LeftShoulder] {
            figure[joint] = bend(figure[joint], 0.3);
        }
        let angles = PartAngles::of_hips(&trunk_axes(&figure).unwrap(), &hip_axes(&figure).unwrap());
        assert!((angles.flexion_rad - 0.3).abs() < 1e-12, "{angles:?}");
        assert!(angles.rotation_rad.abs() < 1e-12 && angles.bending_rad.abs() < 1e-12);

        let turned = DMat3::from_axis_angle(DVec3::Z, 0.2) * hip_axes(&upright()).unwrap();
        assert!((PartAngles::of_hips(&torso, &turned).rotation_rad - 0.2).abs() < 1e-12);
        let nodding = DMat3::from_axis_angle(DVec3::Y, 0.25) * torso;
        assert!((PartAngles::of_head(&torso, &nodding).flexion_rad - 0.25).abs() < 1e-12);
        let tilted = DMat3::from_axis_angle(DVec3::X, -0.25) * torso;
        assert!((PartAngles::of_head(&torso, &tilted).bending_rad - 0.25).abs() < 1e-12);
    }

    #[test]
    fn joint_angles_are_those_a_figure_was_turned_by() {
        // OpenSim's axes: X forward, Y up, Z to the right. The limbs hang along -Y and are turned by R_z R_x.
        let from_opensim = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
        let turn = |flexion: f64, adduction: f64| {
            DMat3::from_rotation_z(flexion) * DMat3::from_rotation_x(adduction)
        };
        for tilt in [0.0, 0.4] {
            for (flexion, adduction, bend) in
                [(0.5, 0.1, 0.9), (-0.2, -0.15, 0.02), (1.4, 0.6, 2.0), (0.1, 0.0, -0.1)]
            {
                for side in Side::BOTH {
                    let mut figure = upright();
                    let about_x = if side == Side::Right { adduction } else { -adduction };
                    let mut hang = |start: Joint, end: Joint, tip: Joint, sense: f64| {
                        let upper = turn(flexion, about_x);
                        let lower = upper * DMat3::from_rotation_z(sense * bend);
                        figure[end] = figure[start] + 0.4 * (from_opensim * upper * -DVec3::Y);
                        figure[tip] = figure[end] + 0.35 * (from_opensim * lower * -DVec3::Y);
                    };
                    hang(side.hip(), side.knee(), side.ankle(), -1.0);
                    hang(side.shoulder(), side.elbow(), side.wrist(), 1.0);
                    // Angles are those of the body, however it leans and is turned.
                    let pose = DMat3::from_rotation_z(2.0 * tilt) * DMat3::from_rotation_y(tilt);
                    figure.0.iter_mut().for_each(|joint| *joint = pose * *joint);

                    let angles = JointAngles::of(&figure, side);
                    let close =
                        |got: f64, wanted: f64| assert!((got - wanted).abs() < 1e-7, "{angles:?} {wanted}");
                    close(angles.hip_flexion_rad, flexion);
                    close(angles.hip_adduction_rad, adduction);
                    close(angles.knee_flexion_rad, bend);
                    close(angles.shoulder_flexion_rad, flexion);
                    close(angles.shoulder_adduction_rad, adduction);
                    close(angles.elbow_flexion_rad, bend.abs());
                    assert!(JointAngles::of(&figure, side.other()).knee_flexion_rad.is_nan());
                }
            }
        }
    }
}
