//! Hand-made figures for tests.
//!
//! Unless stated otherwise, axes are those of an upright trunk: x forward, y down, z to the left, metres.

use std::array::from_fn;

use glam::{DMat3, DVec3};

use super::anchor::rigid_trunk;
use super::placed::{Placed, placed_points};
use crate::model::skeleton::{Joint, PerJoint, SegmentLengths, Side, StickFigure};

/// Length of upper arm and forearm.
pub(super) const ARM_M: f64 = 0.3;
/// Length of thigh and shank.
pub(super) const LEG_M: f64 = 0.4;
/// Distance of the shoulders and of the hips.
pub(super) const WIDTH_M: f64 = 0.4;
/// Length of the trunk, neck to pelvis.
pub(super) const TRUNK_M: f64 = 0.5;

/// A standing person: limbs straight down, hips below and beside the pelvis.
pub(super) fn standing() -> StickFigure {
    let mut figure = StickFigure::UNKNOWN;
    figure[Joint::Neck] = DVec3::ZERO;
    figure[Joint::Pelvis] = DVec3::Y * TRUNK_M;
    for side in Side::BOTH {
        let outward = 0.5 * WIDTH_M * outward(side);
        figure[side.shoulder()] = outward;
        figure[side.hip()] = figure[Joint::Pelvis] + outward + DVec3::Y * 0.1;
        figure[side.elbow()] = figure[side.shoulder()] + DVec3::Y * ARM_M;
        figure[side.wrist()] = figure[side.elbow()] + DVec3::Y * ARM_M;
        figure[side.knee()] = figure[side.hip()] + DVec3::Y * LEG_M;
        figure[side.ankle()] = figure[side.knee()] + DVec3::Y * LEG_M;
    }
    figure
}

/// A person 4 m in front of a level camera at 1.2 m who faces it, bent forwards, the body's middle 7 cm in front of
/// the ankles and the arms hanging; camera axes.
pub(super) fn bent(lengths: &SegmentLengths, lean_rad: f64) -> StickFigure {
    let trunk = rigid_trunk(lengths);
    let facing = DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X);
    let turn = DMat3::from_rotation_x(lean_rad) * facing;
    let mut figure = PerJoint(trunk.0.map(|joint| turn * joint));
    let hips = figure[Joint::RightHip].midpoint(figure[Joint::LeftHip]);
    let feet_z = 0.5 * hips.z + 0.07;
    for side in Side::BOTH {
        let (thigh, shank) = (lengths.to[side.knee()], lengths.to[side.ankle()]);
        let hip = figure[side.hip()];
        let reach = 0.97 * (thigh + shank);
        let back = feet_z - hip.z;
        let leg = DVec3::new(0.0, (reach * reach - back * back).sqrt(), back) / reach;
        let along = (reach * reach + thigh * thigh - shank * shank) / (2.0 * reach);
        let knee = along * leg + (thigh * thigh - along * along).sqrt() * DVec3::new(0.0, leg.z, -leg.y);
        figure[side.knee()] = hip + knee;
        let shoulder = figure[side.shoulder()];
        figure[side.elbow()] = shoulder + lengths.to[side.elbow()] * DVec3::Y;
        figure[side.wrist()] = figure[side.elbow()] + lengths.to[side.wrist()] * DVec3::Y;
        figure[side.ankle()] = hip + reach * leg;
    }
    let sole = 0.17 * lengths.to[Joint::RightAnkle];
    let lift = 1.2 - sole - figure[Joint::RightAnkle].y;
    PerJoint(figure.0.map(|p| p + DVec3::new(0.1, lift, 4.0)))
}

/// The direction away from the body's middle.
pub(super) fn outward(side: Side) -> DVec3 {
    if side == Side::Left { DVec3::Z } else { DVec3::NEG_Z }
}

/// The direction of a segment that hangs down, rotated forward by an angle.
pub(super) fn forward_deg(angle_deg: f64) -> DVec3 {
    let (sine, cosine) = angle_deg.to_radians().sin_cos();
    DVec3::new(sine, cosine, 0.0)
}

/// The direction of a segment of a side that hangs down, rotated outward by an angle.
pub(super) fn outward_deg(side: Side, angle_deg: f64) -> DVec3 {
    let (sine, cosine) = angle_deg.to_radians().sin_cos();
    sine * outward(side) + DVec3::Y * cosine
}

/// The same figure with another direction of the segment that ends at a joint; the joints beyond it are shifted.
pub(super) fn turned(figure: &StickFigure, end: Joint, direction: DVec3) -> StickFigure {
    let segment = figure.segment(end).length() * direction.normalize();
    shifted(figure, end, segment - figure.segment(end))
}

/// The same figure with a joint and the joints beyond it shifted.
pub(super) fn shifted(figure: &StickFigure, end: Joint, by: DVec3) -> StickFigure {
    let mut shifted = *figure;
    for joint in Joint::ALL.into_iter().skip(1) {
        let own = if joint == end { by } else { DVec3::ZERO };
        shifted[joint] = shifted[joint.start().unwrap()] + figure.segment(joint) + own;
    }
    shifted
}

/// The lengths of a figure.
pub(super) fn lengths_of(figure: &StickFigure) -> SegmentLengths {
    SegmentLengths::from_figures(&[*figure]).unwrap()
}

/// The joints of a figure without noise, as seen along one direction from far away.
pub(super) fn seen_along(figure: &StickFigure, ray: DVec3) -> PerJoint<Placed> {
    let placed = placed_points(figure);
    PerJoint(from_fn(|joint| Placed { ray: ray.normalize(), ..placed.0[joint] }))
}
