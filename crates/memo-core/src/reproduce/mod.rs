//! Reproduction of the three papers: their tables, figures and examples, computed again.
//!
//! No other module uses it; it is compiled with the feature `reproduce`.

pub mod head_table;
pub mod hoffman_flinchbaugh;
pub mod lee_chen;
pub mod rohr;
pub mod stick_walker;

pub use stick_walker::{StickCamera, StickView, StickWalker};
