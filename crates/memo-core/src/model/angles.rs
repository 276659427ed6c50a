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
}
