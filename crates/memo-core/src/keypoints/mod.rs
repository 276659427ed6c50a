//! Keypoints of people in two dimensions, as detectors write them: whose they are, which joints they show, and
//! where right and left were exchanged.

pub mod detector;
pub mod layouts;
pub mod names;
pub mod person;
pub mod unswap;

pub use detector::{Detector, HEAD_POINTS, SidePair, WeightedPoints};
pub use layouts::{LAYOUTS, Layout};
pub use names::{DetectorError, STICK_JOINTS, SwapGroup, joint_name, joint_names};
