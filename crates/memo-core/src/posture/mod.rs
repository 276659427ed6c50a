//! One view, known lengths: 3D postures from the image points of one frame (Lee and Chen 1985).

pub mod head;

pub use head::{HeadError, HeadModel, HeadPose, HeadSolution};
