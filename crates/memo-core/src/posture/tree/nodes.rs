//! Sets of the nodes of one level.
//!
//! A node has a number: bit n is set if the joint of level n + 1 is at the far root. So the successors of a node
//! have its own number and that number with the next bit set. A scope is a set of joints, given by the same bits.
//! Two nodes whose numbers agree in these bits make the same choice within the scope; the choice has the number
//! of the node that is near in all other bits.

use crate::model::skeleton::JOINT_COUNT;
use crate::posture::tree::TreePath;

/// Number of roots that a path chooses.
const CHOICES: usize = JOINT_COUNT - 1;

/// Number of bits of a node number that select a bit within a word.
const WORD_BITS: usize = 6;

const WORDS: usize = 1 << (CHOICES - WORD_BITS);

/// For each of these bits, the positions in a word whose number does not have the bit set.
const WITHOUT_BIT: [u64; WORD_BITS] = [
    0x5555_5555_5555_5555,
    0x3333_3333_3333_3333,
    0x0f0f_0f0f_0f0f_0f0f,
    0x00ff_00ff_00ff_00ff,
    0x0000_ffff_0000_ffff,
    0x0000_0000_ffff_ffff,
];

/// A set of nodes of one level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Nodes {
    words: [u64; WORDS],
    /// Number of roots chosen down to the level.
    level: usize,
}

impl Nodes {
    /// The root of the tree: the neck, with no choice made.
    pub fn neck() -> Self {
        Self::of([0], 0)
    }

    /// Nodes of a level by their numbers.
    pub fn of(numbers: impl IntoIterator<Item = usize>, level: usize) -> Self {
        let mut nodes = Self { words: [0; WORDS], level };
        for number in numbers {
            nodes.words[number >> WORD_BITS] |= 1 << (number % 64);
        }
        nodes
    }

    /// The words in use at the level.
    fn words(&self) -> &[u64] {
        &self.words[..1 << self.level.saturating_sub(WORD_BITS)]
    }

    fn words_mut(&mut self) -> &mut [u64] {
        &mut self.words[..1 << self.level.saturating_sub(WORD_BITS)]
    }

    /// The successors: the near root for every node, and the far root for the nodes of a subset.
    pub fn successors(&self, with_far: &Self) -> Self {
        let mut nodes = Self { level: self.level + 1, ..self.clone() };
        if self.level < WORD_BITS {
            nodes.words[0] |= with_far.words[0] << (1 << self.level);
        } else {
            let half = self.words().len();
            nodes.words[half..2 * half].copy_from_slice(with_far.words());
        }
        nodes
    }

    /// The nodes of the level above that have a successor in the set.
    pub fn parents(&self) -> Self {
        let level = self.level.saturating_sub(1);
        let mut nodes = Self { words: [0; WORDS], level };
        if level < WORD_BITS {
            let half = 1 << level;
            nodes.words[0] = (self.words[0] | self.words[0] >> half) & ((1 << half) - 1);
        } else {
            let (near, far) = self.words().split_at(self.words().len() / 2);
            nodes.words.iter_mut().zip(near.iter().zip(far)).for_each(|(word, (n, f))| *word = n | f);
        }
        nodes
    }

    pub fn is_empty(&self) -> bool {
        self.words().iter().all(|&word| word == 0)
    }

    pub fn count(&self) -> u32 {
        self.words().iter().map(|word| word.count_ones()).sum()
    }

    /// The choices that the nodes make within a scope.
    pub fn choices(&self, scope: usize) -> Self {
        let mut choices = Self { words: [0; WORDS], level: self.level };
        for (w, word) in self.words().iter().enumerate() {
            choices.words[w & scope >> WORD_BITS] |= word;
        }
        let outside = (0..WORD_BITS).filter(|bit| scope >> bit & 1 == 0);
        let mut near = u64::MAX;
        for bit in outside {
            choices.words_mut().iter_mut().for_each(|word| *word |= *word >> (1 << bit));
            near &= WITHOUT_BIT[bit];
        }
        choices.words_mut().iter_mut().for_each(|word| *word &= near);
        choices
    }

    /// The nodes whose choice within a scope is in `choices`.
    pub fn choosing(&self, scope: usize, choices: &Self) -> Self {
        let mut nodes = self.clone();
        let mut others = self.clone();
        others.remove_choosing(scope, choices.clone());
        nodes.words_mut().iter_mut().zip(others.words()).for_each(|(word, other)| *word &= !other);
        nodes
    }

    /// Removes the nodes whose choice within a scope is in `choices`; returns their number.
    pub fn remove_choosing(&mut self, scope: usize, mut choices: Self) -> u32 {
        for bit in (0..WORD_BITS).filter(|bit| scope >> bit & 1 == 0) {
            choices.words_mut().iter_mut().for_each(|word| *word |= *word << (1 << bit));
        }
        let mut removed = 0;
        for (w, word) in self.words_mut().iter_mut().enumerate() {
            let choosing = choices.words[w & scope >> WORD_BITS];
            removed += (*word & choosing).count_ones();
            *word &= !choosing;
        }
        removed
    }

    /// The numbers of the nodes, ascending.
    pub fn numbers(&self) -> impl Iterator<Item = usize> + '_ {
        self.words().iter().enumerate().flat_map(|(i, &word)| {
            let rest = std::iter::successors(Some(word), |word| Some(word & word.wrapping_sub(1)));
            rest.take_while(|&word| word != 0).map(move |word| 64 * i + word.trailing_zeros() as usize)
        })
    }

    /// The paths to the nodes in depth-first order, near root first.
    pub fn paths(&self) -> Vec<TreePath> {
        // The first choice is the most significant: with reversed bits, the numbers ascend.
        let reversed = |number: usize| usize::from((number as u16).reverse_bits() >> (16 - CHOICES));
        let in_order = Self::of(self.numbers().map(reversed), CHOICES);
        let mut paths = Vec::with_capacity(self.count() as usize);
        paths.extend(in_order.numbers().map(|number| TreePath((reversed(number) as u16) << 1)));
        paths
    }
}

/// All possible choices within a scope, ascending.
pub(super) fn all_choices(scope: usize) -> impl Iterator<Item = usize> {
    let next = move |&choice: &usize| (choice != scope).then(|| choice.wrapping_sub(scope) & scope);
    std::iter::successors(Some(0), next)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn numbers(nodes: &Nodes) -> BTreeSet<usize> {
        nodes.numbers().collect()
    }

    proptest::proptest! {
        #[test]
        fn sets_of_nodes_are_sets_of_numbers(
            a in proptest::collection::btree_set(0..8192_usize, 0..300),
            b in proptest::collection::btree_set(0..8192_usize, 0..300),
            scope in 0..8192_usize,
            level in 1..14_usize,
        ) {
            let [a, b] = [a, b].map(|set| set.into_iter().map(|n| n % (1 << level)).collect::<BTreeSet<_>>());
            let scope = scope % (1 << level);
            let [mut nodes, others] = [&a, &b].map(|set| Nodes::of(set.iter().copied(), level));
            assert!(nodes.numbers().eq(a.iter().copied()));
            assert_eq!(nodes.count() as usize, a.len());
            assert_eq!(nodes.is_empty(), a.is_empty());
            let choices: BTreeSet<usize> = a.iter().map(|n| n & scope).collect();
            assert_eq!(numbers(&nodes.choices(scope)), choices);
            assert!(choices.is_subset(&all_choices(scope).collect()));
            let choosing = nodes.choosing(scope, &others.choices(scope));
            let expected: BTreeSet<usize> =
                a.iter().copied().filter(|n| b.iter().any(|m| (n ^ m) & scope == 0)).collect();
            assert_eq!(numbers(&choosing), expected);
            let half = 1 << (level - 1);
            assert_eq!(numbers(&nodes.parents()), a.iter().map(|n| n % half).collect());
            let far = Nodes::of(b.iter().copied().filter(|n| n & half != 0).map(|n| n ^ half), level - 1);
            let near = Nodes::of(a.iter().map(|n| n % half), level - 1);
            let both: BTreeSet<usize> =
                a.iter().map(|n| n % half).chain(b.iter().copied().filter(|n| n & half != 0)).collect();
            assert_eq!(numbers(&near.successors(&far)), both);
            let kept: BTreeSet<usize> = &a - &expected;
            assert_eq!(nodes.remove_choosing(scope, others.choices(scope)) as usize, a.len() - kept.len());
            assert_eq!(numbers(&nodes), kept);
        }
    }

    #[test]
    fn paths_are_in_the_order_of_a_walk() {
        let every = Nodes::of(0..8192, 13).paths();
        let ways: Vec<Vec<bool>> =
            every.iter().map(|path| (1..14).map(|n| path.0 >> n & 1 == 1).collect()).collect();
        assert!(ways.len() == 8192 && ways.is_sorted());
    }

    #[test]
    fn a_scope_has_all_its_choices() {
        assert!(all_choices(0b1010).eq([0, 0b10, 0b1000, 0b1010]));
        assert!(all_choices(0).eq([0]));
    }
}
