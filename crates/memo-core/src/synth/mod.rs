//! Seeded generators of scenes with ground truth, shared by tests, benches and the demo.

pub mod clothed;
pub mod motion;
pub mod pointlight;
pub mod random;
pub mod scene;

pub use clothed::{ClothedOptions, ClothedScene, ClothedTruth, FootContact, Mover};
pub use motion::{
    MotionError, PointMotion, SampledWalkOptions, WALKER_HEIGHT_M, WALKER_LIMBS, limbs_of, sampled_walk,
};
pub use pointlight::{
    CycleOptions, DisplayView, DotPicture, DotShape, DotSource, LifeSites, LimitedLife, Locomotion,
    NoiseDots, NoiseKind, PhaseScramble, PointLightDisplay, PointLightError, PointLightOptions,
    PositionScramble, ScrambleAxes, displays_together, point_light_display,
};
pub use random::Random;
pub use scene::{SceneError, SceneOptions, SynthScene, Truth, Uneven};
