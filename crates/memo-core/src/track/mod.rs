//! Where evidence and model meet: similarity, search, start, filter, tracker.

mod column;
pub mod evidence;
pub mod kalman;
pub mod locate;
pub mod score;
pub mod search;
pub mod start;
