//! What is left of a tree, and what was cut.

use super::View;
use crate::model::skeleton::{Joint, PerJoint, StickFigure};
use crate::posture::constraint::{Constraint, Violation};
use crate::posture::lift::RootKind;
use crate::posture::placed::{HeadingSource, PlacedFigure};

/// A way down the tree: for each joint near or far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Path(
    /// Bit n is set where the joint of level n is at the far root.
    pub u16,
);

impl Path {
    /// Whether a joint is at the far root; false where it has but one.
    pub fn is_far(self, joint: Joint) -> bool {
        self.0 >> joint as u16 & 1 == 1
    }

    /// The same with a joint at the far root.
    #[must_use]
    pub fn with_far(self, joint: Joint) -> Self {
        Self(self.0 | 1 << joint as u16)
    }
}

/// A posture that the tree leads to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpretation {
    /// The joints, camera axes, metres; NaN where unknown.
    pub figure: StickFigure,
    /// Its way down the tree.
    pub path: Path,
    /// How many roots each segment had; None for the neck and unknown joints. A segment without a real root
    /// has its gap here.
    pub kinds: PerJoint<Option<RootKind>>,
    /// Standard deviation of the extent of each segment along its ray, metres; NaN for the neck.
    pub segment_sd_m: PerJoint<f64>,
    /// Standard deviation of each joint's distance from the camera, metres: those of the neck and of the
    /// segments down to it.
    pub depth_sd_m: PerJoint<f64>,
}

impl Interpretation {
    /// Segments without a real root and by how much their joint's ray passes too far, metres.
    pub fn gaps_m(&self) -> impl Iterator<Item = (Joint, f64)> + '_ {
        Joint::ALL.into_iter().filter_map(|joint| match self.kinds[joint] {
            Some(RootKind::None { gap_m }) => Some((joint, gap_m)),
            _ => None,
        })
    }
}

/// Nodes of one level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LevelCount {
    /// Nodes the walk came to and no constraint cut.
    pub reached: u32,
    /// Those of them from which a leaf survives: the paper's way of counting (Tables 3 and 4).
    pub survived: u32,
    /// Nodes the walk came to, cut or not, whose segment has one root: equal, or merged into their middle.
    pub degenerate: u32,
    /// Nodes the walk came to, cut or not, whose segment has no real root.
    pub without_root: u32,
}

/// How many branches a constraint cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CutCount {
    /// The constraint.
    pub constraint: Constraint,
    /// The level at which it cuts.
    pub joint: Joint,
    /// Branches cut.
    pub branches: u32,
}

/// A branch that was cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// The way down to the level of the violation.
    pub path: Path,
    /// Why.
    pub violation: Violation,
}

/// The posture that breaks the constraints least, where all break some.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastViolating {
    /// The posture.
    pub interpretation: Interpretation,
    /// What it breaks.
    pub violations: Vec<Violation>,
    /// Sum of the squares of their severities ([`Violation::severity`]); no posture has less.
    pub total: f64,
}

/// What is left of the tree, and what was cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpretations {
    /// The view they are of.
    pub view: View,
    /// Ways to the leaves that survived, in the order of the walk.
    pub survivors: Vec<Path>,
    /// Nodes of each level.
    pub counts: PerJoint<LevelCount>,
    /// Branches cut by each constraint that cut any, in the order of [`Constraint::ALL`].
    pub reasons: Vec<CutCount>,
    /// Constraints that were asked for and could not be tried, because joints are unknown.
    pub open: Vec<Constraint>,
    /// Where rules took the moving direction from.
    pub heading_source: HeadingSource,
    /// Every cut branch in the order of the walk, if asked for.
    pub cuts: Vec<Cut>,
    /// Where nothing survived: the posture nearest to surviving.
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
