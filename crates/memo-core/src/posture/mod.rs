//! Joints of one view and what they say about posture.

pub mod unswap;
