//! One view, known lengths: every 3D posture the joints of one picture allow (Lee and Chen 1985), and one of
//! them a frame for a sequence.

pub mod anchor;
pub mod angles;
pub mod collision;
pub mod constraint;
pub mod detector;
#[cfg(test)]
mod example;
pub mod experiment;
pub mod group;
pub mod head;
pub mod length;
pub mod lift;
pub mod limits;
pub mod link;
pub mod person;
pub(crate) mod placed;
pub mod prior;
pub mod rules;
pub mod sequence;
pub mod skeleton;
pub mod smooth;
pub mod tree;
pub mod uncertainty;
pub mod unswap;
pub mod viterbi;

pub use placed::{Bearings, HeadingSource};
