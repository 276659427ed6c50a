//! One view, known lengths: every 3D posture the joints of one picture allow (Lee and Chen 1985).

pub mod angles;
pub mod collision;
pub mod constraint;
pub mod experiment;
pub mod group;
pub mod head;
pub mod lift;
pub mod limits;
pub(crate) mod placed;
pub mod rules;
pub mod skeleton;
pub mod tree;

pub use head::{HeadError, HeadModel, HeadPose, HeadSolution};
pub use placed::{Bearings, HeadingSource};
