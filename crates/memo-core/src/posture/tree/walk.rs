//! Grows and prunes the tree, all nodes of a level at once.
//!
//! A constraint depends on few joints, and their positions depend on few roots: those of the joints and of the
//! joints between them and the neck. This set of roots is the scope of the constraint. Each constraint is
//! evaluated once per distinct choice within its scope, and the result holds for all nodes with that choice.
//! Survivors and cuts are the same as for a depth-first walk along every branch.

use super::checks::{Asked, Tree};
use super::least::least_violating;
use super::nodes::{Nodes, all_choices};
use super::places::CHAINS;
use super::{Cut, CutCount, Interpretations, LevelCount, TreeOptions, TreePath, View};
use crate::model::skeleton::{Joint, PerJoint};
use crate::posture::constraint::CONSTRAINT_COUNT;
use crate::posture::lift::RootKind;

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

/// The remaining nodes of one level, and the cuts above it.
struct Pruned {
    nodes: Nodes,
    /// Number of branches cut by each constraint of [`Constraint::ALL`].
    cut: [u32; CONSTRAINT_COUNT],
    cuts: Vec<Cut>,
}

impl Pruned {
    /// Grows the level of a joint.
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

    /// Cuts the nodes that break a constraint of a group; the first constraint broken is the reason.
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
            cuts.extend(violations.map(|violation| Cut { path: TreePath((node as u16) << 1), violation }));
        }
    }
}
