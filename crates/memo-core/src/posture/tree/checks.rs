//! A view with placed joints, and the constraints to evaluate on it.

use super::nodes::all_choices;
use super::places::{CHAINS, Places};
use super::{TreeOptions, View};
use crate::model::skeleton::{Joint, PerJoint};
use crate::posture::collision::Collisions;
use crate::posture::constraint::{CONSTRAINT_COUNT, Constraint, JointSet, Violation};
use crate::posture::placed::{PlacedFigure, Trunk};

/// A constraint with the joints and choices it depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub constraint: Constraint,
    /// Its index in [`Constraint::ALL`].
    pub index: usize,
    pub level: Joint,
    /// Joints without which it cannot be evaluated.
    joints: JointSet,
    /// The choices of roots it depends on.
    pub scope: usize,
}

thread_local! {
    /// All constraints by level, those of one level in the order of [`Constraint::ALL`]. It is thread-local,
    /// because a value shared by all threads could be half initialised in a process forked at that moment.
    static BY_LEVEL: [Asked; CONSTRAINT_COUNT] = {
        let mut index = 0..CONSTRAINT_COUNT;
        let mut all = Constraint::ALL.map(|constraint| {
            let joints = constraint.joints();
            let scope = joints.iter().fold(0, |scope, joint| scope | CHAINS[joint as usize]);
            Asked { constraint, index: index.next().unwrap_or(0), level: constraint.level(), joints, scope }
        });
        all.sort_by_key(|asked| asked.level);
        all
    };
}

const TORSO: usize = CHAINS[Joint::RightShoulder as usize]
    | CHAINS[Joint::LeftShoulder as usize]
    | CHAINS[Joint::Pelvis as usize];

/// A view with placed joints, and the constraints to evaluate on it.
pub(super) struct Tree<'a> {
    pub view: &'a View,
    pub options: &'a TreeOptions,
    pub places: Places,
    /// The trunk for every choice of the roots of shoulders and pelvis.
    torsos: [Trunk; TORSO + 1],
    /// Requested constraints that can be evaluated, by level.
    pub asked: Vec<Asked>,
    /// Requested constraints that cannot be evaluated.
    pub open: Vec<Constraint>,
}

impl<'a> Tree<'a> {
    pub fn new(view: &'a View, options: &'a TreeOptions) -> Self {
        let places = Places::of(view);
        let known = PerJoint(Joint::ALL.map(|joint| places.at(joint, 0))).known();
        let is_known = |asked: &Asked| known.contains(asked.joints);
        let spans = places.spans();
        let out_of_reach =
            |collisions: &Collisions, asked: &Asked| collisions.is_out_of_reach(asked.constraint, &spans);
        let can_break = |asked: &Asked| !options.collisions.as_ref().is_some_and(|c| out_of_reach(c, asked));
        let by_level = BY_LEVEL.with(|all| *all);
        let wanted = || by_level.iter().filter(|asked| options.asks(asked.constraint));
        let mut open: Vec<&Asked> = wanted().filter(|asked| !is_known(asked)).collect();
        open.sort_by_key(|asked| asked.index);
        let mut tree = Self {
            view,
            options,
            places,
            torsos: std::array::from_fn(|_| Trunk::unknown()),
            asked: wanted().filter(|asked| is_known(asked) && can_break(asked)).copied().collect(),
            open: open.iter().map(|asked| asked.constraint).collect(),
        };
        for node in all_choices(TORSO) {
            let mut figure = tree.figure();
            tree.place(&mut figure, TORSO, node, TORSO);
            tree.torsos[node] = Trunk::of_torso(&figure, &options.bearings);
        }
        tree
    }

    /// The constraints of a level; consecutive constraints with the same scope form one group.
    pub fn groups(&self, level: Joint) -> impl Iterator<Item = &[Asked]> {
        let start = self.asked.partition_point(|asked| asked.level < level);
        let end = self.asked.partition_point(|asked| asked.level <= level);
        self.asked[start..end].chunk_by(|a, b| a.scope == b.scope)
    }

    /// An empty figure in which to place joints.
    pub fn figure(&self) -> PlacedFigure<'_> {
        let mut figure = PlacedFigure::UNKNOWN_PLACES;
        figure[Joint::Neck] = self.places.at(Joint::Neck, 0);
        figure
    }

    /// Places the joints of a scope at the roots of a node. Joints that depend on none of the changed choices are
    /// already in place.
    pub fn place<'b>(&'b self, figure: &mut PlacedFigure<'b>, scope: usize, node: usize, changed: usize) {
        let mut left = scope;
        while left != 0 {
            let joint = Joint::ALL[left.trailing_zeros() as usize + 1];
            if CHAINS[joint as usize] & changed != 0 {
                figure[joint] = self.places.at(joint, node);
            }
            left &= left - 1;
        }
    }

    /// The trunk of a node whose joints are placed, with its hips if the level needs them.
    pub fn trunk<'b>(
        &'b self,
        level: Joint,
        figure: &PlacedFigure,
        node: usize,
        with_hips: &'b mut Option<Trunk>,
    ) -> &'b Trunk {
        let torso = &self.torsos[node & TORSO];
        if level == Joint::LeftHip { with_hips.insert(torso.with_hips(figure)) } else { torso }
    }

    pub fn check(&self, asked: &Asked, figure: &PlacedFigure, trunk: &Trunk) -> Option<Violation> {
        self.options.check(asked.constraint, figure, trunk, &self.view.lengths)
    }

    /// The violations of a group of constraints at a node.
    pub fn violations(&self, group: &[Asked], node: usize) -> impl Iterator<Item = Violation> {
        let mut violations = Vec::new();
        if let Some(&Asked { scope, level, .. }) = group.first() {
            let mut figure = self.figure();
            self.place(&mut figure, scope, node, scope);
            let mut with_hips = None;
            let trunk = self.trunk(level, &figure, node, &mut with_hips);
            violations.extend(group.iter().filter_map(|asked| self.check(asked, &figure, trunk)));
        }
        violations.into_iter()
    }
}
