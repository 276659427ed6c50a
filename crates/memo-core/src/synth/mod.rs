//! The seeded generator of scenes with ground truth that tests, benches and the demo share.

pub mod random;
pub mod scene;

pub use random::Random;
pub use scene::{SceneOptions, SynthScene, Truth};
