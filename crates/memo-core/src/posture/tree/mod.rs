//! The interpretation tree: every posture that the joints of one view allow (Lee and Chen 1985, sections 2.2,
//! 3.1-3.3).
//!
//! The tree has a level for each joint in the order of [`Joint::ALL`]. A node has two successors, the two roots
//! of the next segment: near (first) and far. A branch is cut at the level at which all joints of a constraint
//! are placed. If a branch breaks several constraints, the first in the order of [`Constraint::ALL`] is the
//! reason. A segment without a real root has one successor, the nearest point on its ray. A joint that is not
//! seen also has one successor; it and the joints beyond it on the limb stay unknown.
//!
//! Survivors and cuts are the same as for a depth-first walk along every branch. For speed, whole levels are
//! grown at once, and a constraint is evaluated once for all nodes at which its joints have the same positions.
//!
//! Limits: the tree does not choose a posture. Hard constraints that true postures satisfy leave tens to hundreds
//! of leaves.

mod checks;
mod interpretation;
mod least;
mod nodes;
mod options;
mod places;
#[cfg(test)]
mod tests;
mod walk;

use glam::DVec3;
use thiserror::Error;

use super::constraint::{Constraint, Violation};
use super::lift::{JointRays, roots};
use super::placed::{Placed, PlacedFigure, Trunk, placed_points};
use crate::model::skeleton::{JOINT_COUNT, Joint, LengthError, PerJoint, SegmentLengths, StickFigure};

pub use interpretation::{
    Cut, CutCount, Interpretation, Interpretations, LeastViolating, LevelCount, TreePath,
};
pub use options::TreeOptions;
use walk::walk;

/// Uncertainty of a segment's length, including the positions of the joints on the body, metres: with medians
/// over walks of motion capture, 3-8 mm remain.
pub const DEFAULT_LENGTH_SD_M: f64 = 0.005;

/// Why a tree was not grown.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TreeError {
    /// The neck is not a point in front of the camera.
    #[error("the neck must be a point before the camera (z > 0, finite), got {neck}")]
    Neck {
        /// The point.
        neck: DVec3,
    },
    /// A ray is not a unit vector.
    #[error("the ray of {} must have length 1 (NaN where it is not seen), got {ray}", joint.name())]
    Ray {
        /// Its joint.
        joint: Joint,
        /// The vector.
        ray: DVec3,
    },
    /// A quantity is negative or not finite.
    #[error("{name} must be finite and not negative, got {value}")]
    Quantity {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A direction of the bearings is zero or not finite.
    #[error("{name} must be a finite direction, got {value}")]
    Direction {
        /// Its name.
        name: &'static str,
        /// The vector.
        value: DVec3,
    },
    /// The segment lengths are not valid.
    #[error(transparent)]
    Length(#[from] LengthError),
}

/// One view of one person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rays of the joints.
    pub rays: JointRays,
    /// The neck, camera axes, metres. It replaces the ray of the neck.
    pub neck: DVec3,
    /// Standard deviation of the neck's distance, metres. It moves the whole figure and does not change which
    /// branches are cut.
    pub neck_sd_m: f64,
    /// Lengths of the segments.
    pub lengths: SegmentLengths,
    /// Standard deviation of each length, metres.
    pub length_sd_m: f64,
    /// Roots closer together than this are merged into their middle, metres. With 0 only equal roots are merged;
    /// the counts of the paper are reproduced with 0.04.
    pub merge_m: f64,
}

impl View {
    /// A view with a known neck position and the default uncertainty of lengths; only equal roots are merged.
    pub fn new(rays: JointRays, neck: DVec3, lengths: SegmentLengths) -> Self {
        Self { rays, neck, neck_sd_m: 0.0, lengths, length_sd_m: DEFAULT_LENGTH_SD_M, merge_m: 0.0 }
    }

    /// Grows and prunes the tree.
    ///
    /// If nothing survives, the result is not an error: `reasons` gives the causes, and `least_violating` is the
    /// nearest posture.
    pub fn interpret(&self, options: &TreeOptions) -> Result<Interpretations, TreeError> {
        self.check(options)?;
        Ok(walk(self, options))
    }

    /// The posture at the end of a path.
    pub fn interpretation(&self, path: TreePath) -> Interpretation {
        let placed = self.place(path);
        let mut kinds = PerJoint([None; JOINT_COUNT]);
        let mut depth_sd_m = PerJoint([self.neck_sd_m; JOINT_COUNT]);
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = joint.start().unwrap_or(Joint::Neck);
            kinds[joint] = placed[joint].point.is_finite().then_some(placed[joint].kind);
            depth_sd_m[joint] = depth_sd_m[start].hypot(placed[joint].sd_m);
        }
        let segment_sd_m = PerJoint(placed.0.map(|joint| joint.sd_m));
        Interpretation { figure: PlacedFigure::of(&placed).points(), path, kinds, segment_sd_m, depth_sd_m }
    }

    /// The path to the posture nearest to a figure: at every segment the root whose segment vector is nearer to
    /// the figure's (the near root if the figure's is unknown).
    pub fn nearest_path(&self, figure: &StickFigure) -> TreePath {
        let mut path = TreePath::default();
        let mut points = PerJoint([self.neck; JOINT_COUNT]);
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = points[joint.start().unwrap_or(Joint::Neck)];
            let (candidates, count) = self.candidates(start, joint);
            let distance = |c: &Placed| (c.point - start).distance(figure.segment(joint));
            let far = count == 2 && distance(&candidates[1]) < distance(&candidates[0]);
            if far {
                path = path.with_far(joint);
            }
            points[joint] = candidates[usize::from(far)].point;
        }
        path
    }

    /// All constraints that the posture at the end of a path breaks.
    pub fn violations(&self, path: TreePath, options: &TreeOptions) -> Vec<Violation> {
        all_violations(&PlacedFigure::of(&self.place(path)), &self.lengths, options)
    }

    fn check(&self, options: &TreeOptions) -> Result<(), TreeError> {
        if !(self.neck.is_finite() && self.neck.z > 0.0) {
            return Err(TreeError::Neck { neck: self.neck });
        }
        for joint in Joint::ALL {
            let ray = self.rays.ray[joint];
            if self.rays.sees(joint) && !(1.0 - 1e-6..1.0 + 1e-6).contains(&ray.length()) {
                return Err(TreeError::Ray { joint, ray });
            }
        }
        let quantities = [
            ("noise_rad", self.rays.noise_rad),
            ("neck_sd_m", self.neck_sd_m),
            ("length_sd_m", self.length_sd_m),
            ("merge_m", self.merge_m),
        ];
        for (name, value) in quantities {
            if !(value.is_finite() && value >= 0.0) {
                return Err(TreeError::Quantity { name, value });
            }
        }
        let bearings = &options.bearings;
        let head = bearings.head.map(|head| head.x_axis);
        for (name, direction) in [("up", bearings.up), ("heading", bearings.heading), ("head", head)] {
            if let Some(value) = direction.filter(|d| d.try_normalize().is_none()) {
                return Err(TreeError::Direction { name, value });
            }
        }
        self.lengths.validated()?;
        Ok(())
    }

    fn root(&self) -> Placed {
        Placed { point: self.neck, ray: self.neck.normalize(), ..Placed::UNKNOWN }
    }

    /// The positions of a joint from its starting joint: two, or one (which may be unknown).
    ///
    /// The length's uncertainty enters d of eq. (7) like an image noise of length_sd / (√2 distance).
    fn candidates(&self, start: DVec3, joint: Joint) -> ([Placed; 2], usize) {
        let ray = self.rays.ray[joint];
        if start.is_nan() || ray.is_nan() {
            return ([Placed::UNKNOWN; 2], 1);
        }
        let noise_rad = self.rays.noise_rad;
        let length_noise_sq = 0.5 * self.length_sd_m * self.length_sd_m / start.length_squared();
        let noise = (noise_rad * noise_rad + length_noise_sq).sqrt();
        let found = roots(start, ray, self.lengths.to[joint], noise, self.merge_m);
        let (points, count) = found.candidates();
        let number = joint as u8;
        let placed = |point| Placed { number, ..Placed::at_root(start, point, ray, &found, noise_rad) };
        (points.map(placed), count)
    }

    fn place(&self, path: TreePath) -> PerJoint<Placed> {
        let mut placed = PerJoint([Placed::UNKNOWN; JOINT_COUNT]);
        placed[Joint::Neck] = self.root();
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = placed[joint.start().unwrap_or(Joint::Neck)].point;
            let (candidates, count) = self.candidates(start, joint);
            placed[joint] = candidates[usize::from(count == 2 && path.is_far(joint))];
        }
        placed
    }
}

/// All constraints that a figure in space breaks, without noise. Constraints on unknown joints are skipped.
///
/// The figure may be in any axes, if the bearings of the options are in the same axes.
pub fn explain(figure: &StickFigure, lengths: &SegmentLengths, options: &TreeOptions) -> Vec<Violation> {
    all_violations(&PlacedFigure::of(&placed_points(figure)), lengths, options)
}

fn all_violations(figure: &PlacedFigure, lengths: &SegmentLengths, options: &TreeOptions) -> Vec<Violation> {
    let known = figure.known();
    let trunk = Trunk::of(figure, &options.bearings);
    Constraint::ALL
        .into_iter()
        .filter(|&constraint| options.asks(constraint) && known.contains(constraint.joints()))
        .filter_map(|constraint| options.check(constraint, figure, &trunk, lengths))
        .collect()
}
