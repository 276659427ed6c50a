//! Joints of one view and what they say about posture.

pub mod detector;
pub mod person;
pub mod unswap;
