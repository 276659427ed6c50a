//! All possible positions of the joints of a view: each joint for every choice of roots above it.

use super::View;
use super::nodes::all_choices;
use crate::model::skeleton::{JOINT_COUNT, Joint, PerJoint};
use crate::posture::collision::Span;
use crate::posture::placed::{MOST_PLACES, Placed};

/// A joint and the joints between it and the neck, as bits of a node number: their roots determine its position.
pub(super) const CHAINS: [usize; JOINT_COUNT] = {
    let mut chains = [0; JOINT_COUNT];
    let mut level = 1;
    while level < JOINT_COUNT {
        chains[level] = 1 << (level - 1);
        if let Some(start) = Joint::ALL[level].start() {
            chains[level] |= chains[start as usize];
        }
        level += 1;
    }
    chains
};

/// The bits of each chain from the neck outwards; past its end, a bit that no number has.
const CHAIN_BITS: [[u8; 4]; JOINT_COUNT] = {
    let mut bits = [[15; 4]; JOINT_COUNT];
    let mut level = 1;
    while level < JOINT_COUNT {
        let mut found = 0;
        let mut bit = 0;
        while bit < JOINT_COUNT {
            if CHAINS[level] >> bit & 1 == 1 {
                bits[level][found] = bit as u8;
                found += 1;
            }
            bit += 1;
        }
        level += 1;
    }
    bits
};

/// Index of the first position of each joint.
const OFFSETS: [usize; JOINT_COUNT + 1] = {
    let mut offsets = [0; JOINT_COUNT + 1];
    let mut level = 0;
    while level < JOINT_COUNT {
        offsets[level + 1] = offsets[level] + (1 << CHAINS[level].count_ones());
        level += 1;
    }
    offsets
};

const PLACE_COUNT: usize = OFFSETS[JOINT_COUNT];

const _: () = assert!(PLACE_COUNT <= MOST_PLACES);

/// The positions of all joints.
#[derive(Debug)]
pub(super) struct Places {
    at: [Placed; PLACE_COUNT],
    /// True if a position is one of two roots.
    of_two: [bool; PLACE_COUNT],
}

impl Places {
    pub fn of(view: &View) -> Self {
        let mut places = Self { at: [Placed::UNKNOWN; PLACE_COUNT], of_two: [false; PLACE_COUNT] };
        places.at[0] = view.root();
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = joint.start().unwrap_or(Joint::Neck);
            for above in all_choices(CHAINS[start as usize]) {
                let (candidates, count) = view.candidates(places.at(start, above).point, joint);
                let near = place(joint, above);
                let far = place(joint, above | 1 << (joint as usize - 1));
                for (at, place) in [near, far].into_iter().zip(candidates) {
                    places.at[at] = Placed { number: at as u8, ..place };
                }
                places.of_two[near] = count == 2;
                places.of_two[far] = count == 2;
            }
        }
        places
    }

    /// The range of distances along its ray for each joint.
    pub fn spans(&self) -> PerJoint<Span> {
        PerJoint(Joint::ALL.map(|joint| {
            let places = &self.at[OFFSETS[joint as usize]..OFFSETS[joint as usize + 1]];
            let distances = || places.iter().map(|placed| placed.ray.dot(placed.point));
            Span {
                ray: places[0].ray,
                near_m: distances().fold(f64::INFINITY, f64::min),
                far_m: distances().fold(f64::NEG_INFINITY, f64::max),
            }
        }))
    }

    /// A joint at the roots of a node.
    pub fn at(&self, joint: Joint, node: usize) -> &Placed {
        &self.at[place(joint, node)]
    }

    /// True if the segment to the joint has two roots at a node.
    pub fn has_two(&self, joint: Joint, node: usize) -> bool {
        self.of_two[place(joint, node)]
    }
}

fn place(joint: Joint, node: usize) -> usize {
    let [a, b, c, d] = CHAIN_BITS[joint as usize].map(|bit| node >> bit & 1);
    OFFSETS[joint as usize] + (a | b << 1 | c << 2 | d << 3)
}
