//! Two-dimensional keypoints of people, as detectors write them: which person they belong to, which joints
//! they show, and where the right and left labels are swapped.

pub(crate) mod detector;
pub(crate) mod layouts;
pub(crate) mod names;
pub mod people;
pub(crate) mod unswap;

pub use detector::{FOOT_POINTS, HEAD_POINTS, SidePair, WeightedPoints};
pub use layouts::{LAYOUTS, MIDDLE_FAR, MIDDLE_NEAR};
pub use names::{DetectorError, STICK_JOINTS, SwapGroup, joint_name, joint_names};
pub use unswap::{
    FrameRun, GroupResult, Keypoints, Level, LimbGroup, MAX_LEVELS, Reason, SideVerdict, UnswapError,
    Unswapped,
};
