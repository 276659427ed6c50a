//! Image processing: from grey frames to moving regions, velocity fields and straight edges.

pub mod background;
#[cfg(feature = "image")]
mod buffers;
pub mod change;
pub mod clean;
pub mod edge;
mod fit;
pub mod flow;
pub mod frame;
pub mod gain;
pub mod line;
pub mod outline;
pub mod region;
pub mod runs;
pub mod shrink;
pub mod silhouette;

pub use background::{Background, BackgroundError, BackgroundOptions};
pub use change::{
    CHANGE_REACH_PX, ChangeDetector, ChangeOptions, fit_norms, noise_sd, pair_changes, pair_threshold,
    threshold_for_noise,
};
pub use clean::{CleanOptions, clean, dilate, fill_holes};
pub use edge::{EdgeChains, EdgeDomain, EdgeError, EdgeOptions, Edgel, Window, edge_chains};
pub use flow::{FlowComponent, FlowError, FlowEvidence, FlowField, FlowOptions, velocity_field};
pub use frame::{Frame, FrameError, Image, Mask};
pub use gain::{Gain, estimate_gain};
pub use line::{EdgeSegment, LineError, LineOptions, edge_segments, segments_from_chains};
pub use outline::{Outline, outlines};
pub use region::{GroupOptions, Rectangle, Region, Sides, group_regions, regions};
pub use runs::Run;
pub use shrink::shrunk;
pub use silhouette::{SILHOUETTE_THRESHOLD, SilhouetteError, silhouettes};
