//! The seeded generator of scenes with ground truth that tests, benches and the demo share.

pub mod random;
pub mod scene;
pub mod stick_walker;

pub use random::Random;
pub use scene::{SceneOptions, SynthScene, Truth};
pub use stick_walker::{StickCamera, StickView, StickWalker};
