//! One view, known lengths: every 3D posture the joints of one picture allow (Lee and Chen 1985).

pub mod anchor;
pub mod angles;
pub mod length;
pub mod lift;
pub mod link;
pub mod prior;
pub mod skeleton;
pub mod smooth;
pub mod viterbi;
//! One view, known lengths: 3D postures from the image points of one frame (Lee and Chen 1985).

pub mod head;

pub use head::{HeadError, HeadModel, HeadPose, HeadSolution};
//! Joints of one view and what they say about posture.

pub mod detector;
pub mod person;
pub mod unswap;
pub mod uncertainty;
