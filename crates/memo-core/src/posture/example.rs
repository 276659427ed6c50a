//! Hand-made figures for tests of single constraints.
//!
//! Axes are those of an upright trunk: x forward, y down, z to the left, metres.

use std::array::from_fn;

use glam::DVec3;

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
