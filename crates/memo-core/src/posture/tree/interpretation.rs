//! Result of the interpretation tree: surviving postures and the reasons for cuts.

use super::View;
use crate::model::skeleton::{Joint, PerJoint, StickFigure};
use crate::posture::constraint::{Constraint, Violation};
use crate::posture::lift::RootKind;
use crate::posture::placed::{HeadingSource, PlacedFigure};

/// A path down the tree: near or far root for each joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct TreePath(
    /// Bit n is set if the joint of level n is at the far root.
    pub u16,
);

impl TreePath {
    /// True if a joint is at the far root; false if it has only one root.
    pub fn is_far(self, joint: Joint) -> bool {
        self.0 >> joint as u16 & 1 == 1
    }

    /// The same with a joint at the far root.
    #[must_use]
    pub fn with_far(self, joint: Joint) -> Self {
        Self(self.0 | 1 << joint as u16)
    }
}

/// A posture at a leaf of the tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpretation {
    /// The joints, camera axes, metres; NaN where unknown.
    pub figure: StickFigure,
    /// Its path down the tree.
    pub path: TreePath,
    /// Number of roots of each segment; `None` for the neck and unknown joints. For a segment without a real root
    /// it holds the gap.
    pub kinds: PerJoint<Option<RootKind>>,
    /// Standard deviation of the extent of each segment along its ray, metres; NaN for the neck.
    pub segment_sd_m: PerJoint<f64>,
    /// Standard deviation of each joint's distance from the camera, metres: of the neck and of the segments
    /// between neck and joint.
    pub depth_sd_m: PerJoint<f64>,
}

impl Interpretation {
    /// Segments without a real root, with the distance by which the joint's ray misses them, metres.
    pub fn gaps_m(&self) -> impl Iterator<Item = (Joint, f64)> + '_ {
        Joint::ALL.into_iter().filter_map(|joint| match self.kinds[joint] {
            Some(RootKind::None { gap_m }) => Some((joint, gap_m)),
            _ => None,
        })
    }
}

/// Number of nodes of one level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LevelCount {
    /// Nodes reached and not cut by a constraint.
    pub reached: u32,
    /// Those of them with a surviving leaf: the paper's way of counting (Tables 3 and 4).
    pub survived: u32,
    /// Nodes reached, cut or not, whose segment has one root: equal roots, or roots merged into their middle.
    pub degenerate: u32,
    /// Nodes reached, cut or not, whose segment has no real root.
    pub without_root: u32,
}

/// Number of branches that a constraint cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CutCount {
    /// The constraint.
    pub constraint: Constraint,
    /// The level at which it cuts.
    pub joint: Joint,
    /// Branches cut.
    pub branches: u32,
}

/// A cut branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// The path down to the level of the violation.
    pub path: TreePath,
    /// The violation that cut it.
    pub violation: Violation,
}

/// The posture that breaks the constraints least, if no posture keeps them all.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastViolating {
    /// The posture.
    pub interpretation: Interpretation,
    /// Its violations.
    pub violations: Vec<Violation>,
    /// Sum of the squared severities ([`Violation::severity`]); no posture has a smaller sum.
    pub total: f64,
}

/// Surviving postures of a view, and counts of what was cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpretations {
    /// The view.
    pub view: View,
    /// Paths to the surviving leaves, in depth-first order, near root first.
    pub survivors: Vec<TreePath>,
    /// Nodes of each level.
    pub counts: PerJoint<LevelCount>,
    /// Number of branches cut, for each constraint that cut any, in the order of [`Constraint::ALL`].
    pub reasons: Vec<CutCount>,
    /// Requested constraints that could not be evaluated, because joints are unknown.
    pub open: Vec<Constraint>,
    /// Source of the moving direction that rules used.
    pub heading_source: HeadingSource,
    /// Every cut branch in depth-first order, if requested.
    pub cuts: Vec<Cut>,
    /// If nothing survived: the posture that breaks the constraints least.
    pub least_violating: Option<LeastViolating>,
}

impl Interpretations {
    /// The surviving postures.
    pub fn interpretations(&self) -> impl ExactSizeIterator<Item = Interpretation> + '_ {
        self.survivors.iter().map(|&path| self.view.interpretation(path))
    }

    /// The figures of the surviving postures.
    pub fn figures(&self) -> Vec<StickFigure> {
        self.survivors.iter().map(|&path| PlacedFigure::of(&self.view.place(path)).points()).collect()
    }
}
