//! Growing and pruning the tree, all nodes of a level at once.
//!
//! A constraint looks at few joints, and where they are depends on few roots: those of the joints and of what
//! they hang on, its scope. It is asked once for each choice within its scope that some node of the level
//! makes, and the verdict goes to all nodes that make the choice. What is left and what was cut is what
//! a walk down the branches, one by one, leaves and cuts.

use super::least::least_violating;
use super::nodes::{Nodes, all_choices};
use super::places::{CHAINS, Places};
use super::{Cut, CutCount, Interpretations, LevelCount, Path, TreeOptions, View};
use crate::posture::collision::Collisions;
use crate::posture::constraint::{CONSTRAINT_COUNT, Constraint, JointSet, Violation};
use crate::posture::lift::RootKind;
use crate::posture::placed::{PlacedFigure, Trunk};
use crate::posture::skeleton::{Joint, PerJoint};

/// A constraint and what it looks at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked {
    pub constraint: Constraint,
    /// Its place in [`Constraint::ALL`].
    index: usize,
    level: Joint,
    /// Joints it cannot be asked without.
    joints: JointSet,
    /// The choices it depends on.
    pub scope: usize,
}

thread_local! {
    /// All constraints by level, those of a level in the order of [`Constraint::ALL`]. Of each thread, because one
    /// of all threads could be half made in a process that is forked meanwhile.
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

/// A view whose joints are placed, and what is asked of them.
pub(super) struct Tree<'a> {
    pub view: &'a View,
    pub options: &'a TreeOptions,
    pub places: Places,
    /// Of every choice of the roots of shoulders and pelvis.
    torsos: [Trunk; TORSO + 1],
    /// Constraints asked for that can be tried, by level.
    asked: Vec<Asked>,
    /// Constraints asked for that cannot be tried.
    open: Vec<Constraint>,
}

impl<'a> Tree<'a> {
    fn new(view: &'a View, options: &'a TreeOptions) -> Self {
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

    /// The constraints of a level, those of one scope that follow each other together.
    pub fn groups(&self, level: Joint) -> impl Iterator<Item = &[Asked]> {
        let start = self.asked.partition_point(|asked| asked.level < level);
        let end = self.asked.partition_point(|asked| asked.level <= level);
        self.asked[start..end].chunk_by(|a, b| a.scope == b.scope)
    }

    /// A figure to place joints in.
    pub fn figure(&self) -> PlacedFigure<'_> {
        let mut figure = PlacedFigure::UNKNOWN_PLACES;
        figure[Joint::Neck] = self.places.at(Joint::Neck, 0);
        figure
    }

    /// Places the joints of a scope at the roots of a node; those that hang on none of the changed choices
    /// stand there already.
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

    /// The trunk of a node whose joints are placed, with its hips where a level asks for them.
    fn trunk<'b>(
        &'b self,
        level: Joint,
        figure: &PlacedFigure,
        node: usize,
        with_hips: &'b mut Option<Trunk>,
    ) -> &'b Trunk {
        let torso = &self.torsos[node & TORSO];
        if level == Joint::LeftHip { with_hips.insert(torso.with_hips(figure)) } else { torso }
    }

    fn check(&self, asked: &Asked, figure: &PlacedFigure, trunk: &Trunk) -> Option<Violation> {
        self.options.check(asked.constraint, figure, trunk, &self.view.lengths)
    }

    /// What a group of constraints has against a node.
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

/// Grows and prunes the tree of a view.
pub(super) fn walk(view: &View, options: &TreeOptions) -> Interpretations {
    let tree = Tree::new(view, options);
    let mut counts = PerJoint::<LevelCount>::default();
    let mut pruned = Pruned { nodes: Nodes::neck(), cut: [0; CONSTRAINT_COUNT], cuts: Vec::new() };
    counts[Joint::Neck].reached = 1;
    for joint in Joint::ALL.into_iter().skip(1) {
        pruned.grow(&tree, joint, &mut counts[joint]);
        for group in tree.groups(joint) {
            pruned.prune(&tree, group);
        }
        counts[joint].reached = pruned.nodes.count();
    }
    let survivors = pruned.nodes.paths();
    let mut nodes = pruned.nodes;
    for joint in Joint::ALL.into_iter().rev() {
        counts[joint].survived = nodes.count();
        nodes = nodes.parents();
    }
    let mut reasons: Vec<&Asked> = tree.asked.iter().filter(|asked| pruned.cut[asked.index] > 0).collect();
    reasons.sort_by_key(|asked| asked.index);
    let count = |asked: &Asked| CutCount {
        constraint: asked.constraint,
        joint: asked.level,
        branches: pruned.cut[asked.index],
    };
    pruned.cuts.sort_by_key(|cut| cut.path.0.reverse_bits());
    Interpretations {
        view: *view,
        counts,
        reasons: reasons.into_iter().map(count).collect(),
        heading_source: options.bearings.heading_source(),
        cuts: pruned.cuts,
        least_violating: survivors.is_empty().then(|| least_violating(&tree)),
        survivors,
        open: tree.open,
    }
}

/// The nodes of one level that are left, and what was cut on the way to it.
struct Pruned {
    nodes: Nodes,
    /// Branches cut by each constraint of [`Constraint::ALL`].
    cut: [u32; CONSTRAINT_COUNT],
    cuts: Vec<Cut>,
}

impl Pruned {
    /// Goes on to the level of a joint.
    fn grow(&mut self, tree: &Tree, joint: Joint, count: &mut LevelCount) {
        let chain = CHAINS[joint as usize];
        let bit = 1 << (joint as usize - 1);
        let of_one = |node: &usize| !tree.places.has_two(joint, *node);
        if all_choices(chain ^ bit).any(|node| of_one(&node)) {
            let ones = Nodes::of(all_choices(chain ^ bit).filter(of_one), joint as usize - 1);
            let mut twos = self.nodes.clone();
            twos.remove_choosing(chain ^ bit, ones);
            self.nodes = self.nodes.successors(&twos);
        } else {
            self.nodes = self.nodes.successors(&self.nodes);
        }
        let of_kind = |is: fn(RootKind) -> bool| {
            let places = |&node: &usize| {
                let placed = tree.places.at(joint, node);
                placed.point.is_finite() && is(placed.kind)
            };
            let choices = Nodes::of(all_choices(chain).filter(places), joint as usize);
            if choices.is_empty() { 0 } else { self.nodes.choosing(chain, &choices).count() }
        };
        count.degenerate = of_kind(|kind| kind == RootKind::Degenerate);
        count.without_root = of_kind(|kind| matches!(kind, RootKind::None { .. }));
    }

    /// Cuts the nodes that break a constraint of a group, each by the first one it breaks.
    fn prune(&mut self, tree: &Tree, group: &[Asked]) {
        let Some(Asked { scope, level, .. }) = group.first().copied() else { return };
        let mut figure = tree.figure();
        let mut changed = scope;
        let mut before = 0;
        let mut broken: Vec<(usize, usize)> = Vec::new();
        for node in self.nodes.choices(scope).numbers() {
            tree.place(&mut figure, scope, node, changed | node ^ before);
            (changed, before) = (0, node);
            let mut with_hips = None;
            let trunk = tree.trunk(level, &figure, node, &mut with_hips);
            let first = group.iter().find(|asked| tree.check(asked, &figure, trunk).is_some());
            broken.extend(first.map(|asked| (asked.index, node)));
        }
        for &asked in group {
            let choices = broken.iter().filter(|(index, _)| *index == asked.index).map(|&(_, node)| node);
            let choices = Nodes::of(choices, level as usize);
            if choices.is_empty() {
                continue;
            }
            if tree.options.keep_cuts {
                Self::keep(&mut self.cuts, tree, asked, &self.nodes.choosing(scope, &choices));
            }
            self.cut[asked.index] = self.nodes.remove_choosing(scope, choices);
        }
    }

    fn keep(cuts: &mut Vec<Cut>, tree: &Tree, asked: Asked, cut: &Nodes) {
        let group = [asked];
        for node in cut.numbers() {
            let violations = tree.violations(&group, node);
            cuts.extend(violations.map(|violation| Cut { path: Path((node as u16) << 1), violation }));
        }
    }
}
