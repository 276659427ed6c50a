//! What the pixels say: from grey frames to moving regions, velocities and straight edges.

pub mod edge;
pub mod flow;
pub mod frame;
pub mod line;

pub use edge::{EdgeChains, EdgeDomain, EdgeError, EdgeOptions, Edgel, Window, edge_chains};
pub use flow::{Evidence, FlowComponent, FlowError, FlowField, FlowOptions, velocity_field};
pub use frame::{Frame, FrameError, Image, Mask};
pub use line::{EdgeSegment, LineError, LineOptions, edge_segments, segments_from_chains};
