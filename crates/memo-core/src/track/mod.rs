//! Where evidence and model meet: similarity, search, start, filter, tracker.

pub mod kalman;
pub mod score;
pub mod search;
pub mod start;
