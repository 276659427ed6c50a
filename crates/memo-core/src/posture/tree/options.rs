//! Constraints that prune the tree.

use crate::model::limits::Limits;
use crate::model::skeleton::SegmentLengths;
use crate::posture::collision::Collisions;
use crate::posture::constraint::{Constraint, ConstraintKind, Violation};
use crate::posture::placed::{Bearings, PlacedFigure, Trunk};
use crate::posture::rules::{MotionModel, Rule};

/// Which constraints prune the tree, and the directions they use.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeOptions {
    /// Limits of joint angles and of rigid distances.
    pub limits: Option<Limits>,
    /// Collisions between body parts.
    pub collisions: Option<Collisions>,
    /// Rules of a motion model.
    pub motion: Option<MotionModel>,
    /// Vertical, moving direction and head, camera axes.
    pub bearings: Bearings,
    /// True to return every cut branch with its reason.
    pub keep_cuts: bool,
}

impl TreeOptions {
    /// Physical constraints with limits that real people keep; no motion model.
    pub fn physical() -> Self {
        Self {
            limits: Some(Limits::measured()),
            collisions: Some(Collisions::measured()),
            motion: None,
            bearings: Bearings::default(),
            keep_cuts: false,
        }
    }

    /// Physical constraints as the paper prints them.
    pub fn physical_paper() -> Self {
        Self { limits: Some(Limits::paper()), collisions: Some(Collisions::paper()), ..Self::physical() }
    }

    /// The same options with a motion model.
    #[must_use]
    pub fn with_motion(self, motion: MotionModel) -> Self {
        Self { motion: Some(motion), ..self }
    }

    /// The same options with bearings in camera axes.
    #[must_use]
    pub fn with_bearings(self, bearings: Bearings) -> Self {
        Self { bearings, ..self }
    }

    /// True if a constraint is requested.
    pub fn asks(&self, constraint: Constraint) -> bool {
        use Constraint::{NeckBending, NeckExtension, NeckFlexion, NeckRotation};
        match constraint.kind() {
            ConstraintKind::Distance => self.limits.is_some(),
            ConstraintKind::Angle => {
                let neck = [NeckFlexion, NeckExtension, NeckRotation, NeckBending].contains(&constraint);
                self.limits.is_some() && (!neck || self.bearings.head.is_some())
            }
            ConstraintKind::Collision => self.collisions.is_some(),
            ConstraintKind::Rule => {
                let rule = Rule::of(constraint);
                self.motion.as_ref().zip(rule).is_some_and(|(motion, rule)| motion.tolerance(rule).is_some())
            }
        }
    }

    /// Checks one constraint; `None` if it holds or is not requested.
    pub(super) fn check(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        trunk: &Trunk,
        lengths: &SegmentLengths,
    ) -> Option<Violation> {
        match constraint.kind() {
            ConstraintKind::Collision => self.collisions.as_ref()?.check(constraint, figure),
            ConstraintKind::Rule => self.motion.as_ref()?.check(constraint, figure, trunk),
            ConstraintKind::Angle | ConstraintKind::Distance => {
                let head = self.bearings.head.as_ref();
                self.limits.as_ref()?.check(constraint, figure, trunk, lengths, head)
            }
        }
    }
}

impl Default for TreeOptions {
    fn default() -> Self {
        Self::physical()
    }
}
