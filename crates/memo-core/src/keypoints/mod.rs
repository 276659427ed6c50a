//! Two-dimensional keypoints of people, as detectors write them: which person they belong to, which joints
//! they show, and where the right and left labels are swapped.

pub mod detector;
pub mod layouts;
pub mod names;
pub mod person;
pub mod unswap;

pub use detector::{Detector, FOOT_POINTS, HEAD_POINTS, SidePair, WeightedPoints};
pub use layouts::{LAYOUTS, Layout};
pub use names::{DetectorError, STICK_JOINTS, SwapGroup, joint_name, joint_names};
