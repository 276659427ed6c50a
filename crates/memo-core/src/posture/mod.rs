//! One view, known lengths: every 3D posture the joints of one picture allow (Lee and Chen 1985).

pub mod anchor;
pub mod angles;
pub mod length;
pub mod lift;
pub mod skeleton;
pub mod uncertainty;
