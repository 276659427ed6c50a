//! What the three papers print, computed again: their tables, figures and examples.
//!
//! Nothing else needs it; it is compiled with the feature `reproduce`.

pub mod head_table;
pub mod hoffman_flinchbaugh;
pub mod lee_chen;
pub mod rohr;
pub mod stick_walker;

pub use stick_walker::{StickCamera, StickView, StickWalker};
