//! Estimation methods that are independent of walkers: filters, paths and least squares.

pub mod arrow;
pub mod assignment;
pub mod kalman;
pub(crate) mod least_squares;
pub(crate) mod line;
pub(crate) mod median;
pub mod smooth;
pub mod viterbi;
