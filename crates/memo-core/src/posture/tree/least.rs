//! The posture that breaks the constraints least.

use super::checks::{Asked, Tree};
use super::{LeastViolating, TreePath};
use crate::model::skeleton::{JOINT_COUNT, Joint};

/// Branch and bound, depth first, for the leaf with the smallest sum of squared severities.
pub(super) fn least_violating(tree: &Tree) -> LeastViolating {
    let levels = Joint::ALL.map(|joint| tree.groups(joint).map(Costs::of).collect());
    let mut search = Search { tree, levels, best: (f64::INFINITY, 0) };
    search.descend(1, 0, 0.0);
    let (total, node) = search.best;
    let path = TreePath((node as u16) << 1);
    LeastViolating {
        interpretation: tree.view.interpretation(path),
        violations: tree.view.violations(path, tree.options),
        total,
    }
}

/// Costs of the choices within the scope of a group of constraints; NaN if not yet computed.
struct Costs<'a> {
    group: &'a [Asked],
    scope: usize,
    costs: Vec<f64>,
}

impl<'a> Costs<'a> {
    fn of(group: &'a [Asked]) -> Self {
        let scope = group.first().map_or(0, |asked| asked.scope);
        Self { group, scope, costs: vec![f64::NAN; 1 << scope.count_ones()] }
    }

    fn at(&mut self, tree: &Tree, node: usize) -> f64 {
        let bits = (0..JOINT_COUNT).filter(|bit| self.scope >> bit & 1 == 1);
        let choice = bits.enumerate().fold(0, |choice, (i, bit)| choice | (node >> bit & 1) << i);
        let cost = &mut self.costs[choice];
        if cost.is_nan() {
            let violations = tree.violations(self.group, node);
            *cost = violations.map(|violation| violation.severity().powi(2)).sum();
        }
        *cost
    }
}

struct Search<'a> {
    tree: &'a Tree<'a>,
    levels: [Vec<Costs<'a>>; JOINT_COUNT],
    /// Cost and number of the best leaf so far.
    best: (f64, usize),
}

impl Search<'_> {
    fn descend(&mut self, level: usize, node: usize, cost: f64) {
        if level == JOINT_COUNT {
            self.best = (cost, node);
            return;
        }
        let far = node | 1 << (level - 1);
        let count = if self.tree.places.has_two(Joint::ALL[level], node) { 2 } else { 1 };
        for node in [node, far].into_iter().take(count) {
            let costs = self.levels[level].iter_mut();
            let cost = cost + costs.map(|costs| costs.at(self.tree, node)).sum::<f64>();
            if cost < self.best.0 {
                self.descend(level + 1, node, cost);
            }
        }
    }
}
