//! A stick figure prepared for evaluating constraints: directions, lengths and noise of each segment, and the
//! axes of its trunk.
//!
//! Noise of a segment is taken to first order: its vector has the standard deviation `sd_m` along the ray of
//! its ending joint and `lateral_m` across it, independent. A direction then has the standard deviation
//! hypot(lateral, sd (r·g)) / length towards a unit vector g perpendicular to it.

use std::cell::Cell;
use std::rc::Rc;

use glam::{DMat3, DVec3};

use super::constraint::JointSet;
use super::lift::{RootKind, Roots};
use crate::model::angles::{PartAngles, hip_axes, knee_rad, swing_rad, trunk_axes};
use crate::model::skeleton::{JOINT_COUNT, Joint, PerJoint, StickFigure};

/// A joint at a position, and the segment that ends there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Placed {
    /// The joint, camera axes, metres.
    pub point: DVec3,
    /// Its ray.
    pub ray: DVec3,
    /// Direction of the segment.
    pub unit: DVec3,
    pub length_m: f64,
    /// Standard deviation of the segment's extent along the ray.
    pub sd_m: f64,
    /// Standard deviation of the segment across the ray.
    pub lateral_m: f64,
    pub kind: RootKind,
    /// Number that distinguishes the positions evaluated on one trunk, below [`MOST_PLACES`].
    pub number: u8,
}

/// More than the number of positions that all choices of roots give the joints of one view.
pub(crate) const MOST_PLACES: usize = 96;

impl Placed {
    pub const UNKNOWN: Self = Self {
        point: DVec3::NAN,
        ray: DVec3::NAN,
        unit: DVec3::NAN,
        length_m: f64::NAN,
        sd_m: f64::NAN,
        lateral_m: f64::NAN,
        kind: RootKind::Degenerate,
        number: 0,
    };

    /// The joint at one of the roots of its segment.
    pub fn at_root(start: DVec3, point: DVec3, ray: DVec3, roots: &Roots, noise_rad: f64) -> Self {
        let segment = point - start;
        let length_m = segment.length();
        let lateral_m = std::f64::consts::SQRT_2 * noise_rad * point.length();
        let unit = segment / length_m;
        Self { point, ray, unit, length_m, sd_m: roots.sd_m, lateral_m, kind: roots.kind, number: 0 }
    }

    /// Standard deviation of the segment's direction towards a unit vector perpendicular to it, radians.
    pub fn direction_sd(&self, towards: DVec3) -> f64 {
        self.along(towards) / self.length_m
    }

    /// The largest standard deviation of the segment's direction, radians.
    pub fn worst_direction_sd(&self) -> f64 {
        let across = (1.0 - self.ray.dot(self.unit).powi(2)).max(0.0);
        (self.lateral_m.powi(2) + self.sd_m.powi(2) * across).sqrt() / self.length_m
    }

    /// Standard deviation of the ending joint relative to the starting joint along a vector, metres.
    pub fn along(&self, towards: DVec3) -> f64 {
        let depth = self.sd_m * self.ray.dot(towards);
        (self.lateral_m * self.lateral_m + depth * depth).sqrt()
    }
}

/// The joints of a figure known in space without noise, in any axes.
pub(crate) fn placed_points(figure: &StickFigure) -> PerJoint<Placed> {
    PerJoint(Joint::ALL.map(|joint| {
        let point = figure[joint];
        let segment = figure.segment(joint);
        let length_m = segment.length();
        let ray = point.normalize_or_zero();
        let unit = segment / length_m;
        let number = joint as u8;
        Placed { point, ray, unit, length_m, number, sd_m: 0.0, lateral_m: 0.0, kind: RootKind::Degenerate }
    }))
}

/// All joints at their positions.
pub(crate) type PlacedFigure<'a> = PerJoint<&'a Placed>;

impl<'a> PlacedFigure<'a> {
    pub(crate) const UNKNOWN_PLACES: Self = Self([&Placed::UNKNOWN; JOINT_COUNT]);

    pub(crate) fn of(placed: &'a PerJoint<Placed>) -> Self {
        Self(placed.0.each_ref())
    }

    pub(crate) fn points(&self) -> StickFigure {
        PerJoint(self.0.map(|placed| placed.point))
    }

    /// The joints that are known.
    pub(crate) fn known(&self) -> JointSet {
        let known = Joint::ALL.into_iter().filter(|&joint| self[joint].point.is_finite());
        known.fold(JointSet::default(), |known, joint| known.with(JointSet::of(&[joint])))
    }
}

/// Directions in a figure's surroundings, in the axes of the figure (for a tree, the camera's).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bearings {
    /// Upward direction, against gravity; `None` uses the trunk's, from pelvis to neck.
    pub up: Option<DVec3>,
    /// The moving direction.
    pub heading: Option<DVec3>,
    /// Axes of the head, like those of the trunk: x the direction the face looks, y down, z to its left.
    pub head: Option<DMat3>,
}

/// Source of the moving direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HeadingSource {
    /// Given by the caller.
    Given,
    /// The direction the face looks: the paper's normal of the head plane.
    Head,
    /// The forward axis of the trunk, a different one in each branch.
    Trunk,
}

impl HeadingSource {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Head => "head",
            Self::Trunk => "trunk",
        }
    }
}

impl Bearings {
    /// The source in use: a given direction first, then the head's, then the trunk's.
    pub fn heading_source(&self) -> HeadingSource {
        match (self.heading, self.head) {
            (Some(_), _) => HeadingSource::Given,
            (None, Some(_)) => HeadingSource::Head,
            (None, None) => HeadingSource::Trunk,
        }
    }
}

/// Axes of a figure's trunk with their uncertainty, and the directions of its motion.
#[derive(Debug, Clone)]
pub(crate) struct Trunk {
    /// Columns x, y, z; NaN where unknown.
    pub torso: DMat3,
    /// Standard deviation of a rotation of the torso about its x, y, z, radians.
    pub torso_sd: DVec3,
    pub hips: DMat3,
    /// Angles of the hips relative to the torso.
    pub hip_angles: PartAngles,
    pub up: DVec3,
    /// Horizontal direction across the moving direction.
    pub lateral: DVec3,
    /// Standard deviation of that direction.
    pub lateral_sd: f64,
    /// Normal of the plane of the body without swing, forward: perpendicular to the trunk (rule 3).
    pub body_normal: DVec3,
    /// Cached angles of limbs relative to the torso: flexion of a limb, flexion at a knee.
    swings: Rc<Memo>,
    knees: Rc<Memo>,
}

/// One number per position, NaN if not yet known.
#[derive(Debug, Clone)]
struct Memo([Cell<f64>; MOST_PLACES]);

impl Memo {
    fn empty() -> Self {
        Self([const { Cell::new(f64::NAN) }; MOST_PLACES])
    }

    fn get(&self, place: &Placed, compute: impl FnOnce() -> f64) -> f64 {
        let known = &self.0[usize::from(place.number) % MOST_PLACES];
        if known.get().is_nan() {
            known.set(compute());
        }
        known.get()
    }
}

impl Trunk {
    pub fn unknown() -> Self {
        Self {
            torso: DMat3::NAN,
            torso_sd: DVec3::NAN,
            hips: DMat3::NAN,
            hip_angles: PartAngles::UNKNOWN,
            up: DVec3::NAN,
            lateral: DVec3::NAN,
            lateral_sd: f64::NAN,
            body_normal: DVec3::NAN,
            swings: Rc::new(Memo::empty()),
            knees: Rc::new(Memo::empty()),
        }
    }

    /// The trunk from shoulders and pelvis, without the hips.
    pub fn of_torso(figure: &PlacedFigure, bearings: &Bearings) -> Self {
        let torso = trunk_axes(&figure.points()).unwrap_or(DMat3::NAN);
        let torso_sd = torso_sd(figure, &torso);
        let source = bearings.heading_source();
        let forward = match source {
            HeadingSource::Given => bearings.heading.unwrap_or(DVec3::NAN),
            HeadingSource::Head => bearings.head.map_or(DVec3::NAN, |head| head.x_axis),
            HeadingSource::Trunk => torso.x_axis,
        };
        let down = torso.y_axis;
        let up = bearings.up.map_or(-down, DVec3::normalize);
        let normal = forward - forward.dot(down) * down;
        Self {
            torso,
            torso_sd,
            up,
            lateral: up.cross(forward).try_normalize().unwrap_or(DVec3::NAN),
            lateral_sd: if source == HeadingSource::Trunk { torso_sd.y } else { 0.0 },
            body_normal: normal.try_normalize().unwrap_or(DVec3::NAN),
            ..Self::unknown()
        }
    }

    /// The same with the hips.
    pub fn with_hips(&self, figure: &PlacedFigure) -> Self {
        let hips = hip_axes(&figure.points()).unwrap_or(DMat3::NAN);
        Self { hips, hip_angles: PartAngles::of_hips(&self.torso, &hips), ..self.clone() }
    }

    /// Standard deviation of a rotation of the hips about their x, y, z, radians.
    pub fn hips_sd(&self, figure: &PlacedFigure) -> DVec3 {
        let [right, left] = [figure[Joint::RightHip], figure[Joint::LeftHip]];
        let drop = (0.5 * (right.point + left.point) - figure[Joint::Pelvis].point).length();
        let width = right.point.distance(left.point);
        let both = |g: DVec3| right.along(g).hypot(left.along(g));
        let [x, z] = [self.hips.x_axis, self.hips.z_axis];
        DVec3::new(0.5 * both(z) / drop, both(x) / width, 0.5 * both(x) / drop)
    }

    /// Flexion (+) or extension of a limb relative to the torso.
    pub fn swing_rad(&self, limb: &Placed) -> f64 {
        self.swings.get(limb, || swing_rad(&self.torso, limb.unit))
    }

    /// Flexion (+) or extension at a knee; the position of the shank must determine that of the thigh.
    pub fn knee_rad(&self, thigh: &Placed, shank: &Placed) -> f64 {
        self.knees.get(shank, || knee_rad(&self.torso, thigh.unit, shank.unit))
    }

    pub fn of(figure: &PlacedFigure, bearings: &Bearings) -> Self {
        Self::of_torso(figure, bearings).with_hips(figure)
    }
}

fn torso_sd(figure: &PlacedFigure, torso: &DMat3) -> DVec3 {
    let pelvis = figure[Joint::Pelvis];
    let [right, left] = [figure[Joint::RightShoulder], figure[Joint::LeftShoulder]];
    let [x, z] = [torso.x_axis, torso.z_axis];
    let width = right.point.distance(left.point);
    DVec3::new(pelvis.direction_sd(z), right.along(x).hypot(left.along(x)) / width, pelvis.direction_sd(x))
}

#[cfg(test)]
mod tests;
