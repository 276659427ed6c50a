//! What the pixels say: from grey frames to moving regions, velocities and straight edges.

pub mod frame;

pub use frame::{Frame, FrameError, Image, Mask};
