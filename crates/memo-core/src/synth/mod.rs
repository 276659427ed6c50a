//! Seeded generators of scenes with ground truth, shared by tests, benches and the demo.

pub mod clothed;
pub mod motion;
pub mod pointlight;
pub mod random;
pub mod scene;

pub use clothed::{ClothedOptions, ClothedScene, ClothedTruth, Contact, Mover};
pub use motion::{Motion, MotionError, WALKER_HEIGHT_M, WALKER_LIMBS, WalkOptions, limbs_of, sampled_walk};
pub use pointlight::{
    DotSource, LifeSites, LimitedLife, Locomotion, NoiseDots, NoiseKind, PhaseScramble, PointLightDisplay,
    PointLightError, PointLightOptions, View, point_light_display,
};
pub use random::Random;
pub use scene::{SceneError, SceneOptions, SynthScene, Truth, Uneven};
