//! Experiments of the papers.

pub mod hoffman_flinchbaugh;
pub mod lee_chen;
pub mod rohr;
