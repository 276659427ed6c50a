//! Postures from one view with known segment lengths: every 3D posture that the joints of one image allow (Lee
//! and Chen 1985), and one posture per frame for a sequence.

pub mod anchor;
pub mod collision;
pub mod constraint;
#[cfg(test)]
mod example;
pub mod group;
pub mod head;
pub mod length;
pub mod lift;
pub mod limits;
pub mod link;
pub(crate) mod placed;
pub mod prior;
pub mod rules;
pub(crate) mod sequence;
pub mod tree;
pub mod uncertainty;

pub use placed::{Bearings, HeadingSource};
pub use sequence::{
    AnchorChoice, DEFAULT_DISTANCE_SD_M, FrameProblem, FrameReading, Heading, HeadingFrom, LengthOrigin,
    MOST_GROUPED, Motion, NeckFrom, NeckTrack, ReasonTotal, RepresentedGroup, SequenceLengths,
    SourceConflict, Strength, Warning, figure_in_camera, figure_in_world, postures_with_progress,
    reason_totals,
};
