//! Seeded generators of scenes with ground truth, shared by tests, benches and the demo.

pub(crate) mod clothed;
pub(crate) mod motion;
pub(crate) mod pointlight;
pub(crate) mod random;
pub(crate) mod scene;

pub use clothed::{ClothedOptions, ClothedTruth, FootContact, Mover, Pause};
pub use motion::{
    MotionError, PointMotion, SampledWalkOptions, WALKER_HEIGHT_M, WALKER_LIMBS, WALKER_NAMES, limbs_of,
};
pub use pointlight::{
    CycleCut, CycleOptions, DisplayView, DotPicture, DotShape, DotSource, LifeSites, LimitedLife, Locomotion,
    NoiseDots, NoiseKind, PhaseScramble, PointLightDisplay, PointLightError, PositionScramble, ScrambleAxes,
    common_cycle, displays_together,
};
pub use random::Random;
pub use scene::{SceneError, SceneOptions, Truth, Uneven};
