//! Image processing: from grey frames to moving regions, velocity fields and straight edges.

pub(crate) mod background;
#[cfg(feature = "image")]
mod buffers;
pub(crate) mod change;
pub(crate) mod clean;
pub(crate) mod edge;
mod fit;
pub(crate) mod flow;
pub(crate) mod frame;
pub(crate) mod gain;
pub(crate) mod light;
pub(crate) mod line;
pub(crate) mod outline;
pub(crate) mod region;
pub(crate) mod runs;
pub(crate) mod shrink;
mod side_by_side;
pub(crate) mod silhouette;

pub use background::{Background, BackgroundError, BackgroundOptions};
pub(crate) use change::unite;
pub use change::{
    CHANGE_REACH_PX, ChangeDetector, ChangeError, ChangeOptions, fit_norms, noise_sd, pair_changes,
    pair_threshold, threshold_for_noise,
};
pub use clean::{CleanOptions, clean, dilate, fill_holes};
pub use edge::{EdgeChains, EdgeDomain, EdgeError, EdgeOptions, Edgel, Window, edge_chains};
pub use flow::{FlowComponent, FlowError, FlowEvidence, FlowField, FlowOptions, velocity_field};
pub use frame::FrameError;
pub use gain::{Gain, estimate_gain};
pub use light::{LightReport, SteadyLight};
pub use line::{EdgeSegment, LineError, LineOptions, edge_segments, segments_from_chains};
pub use outline::{Outline, outlines};
pub(crate) use region::group_regions_of;
pub use region::{GroupOptions, Rectangle, Region, Sides, group_regions, regions};
pub use runs::Run;
pub use shrink::shrunk;
pub(crate) use side_by_side::side_by_side;
pub use silhouette::{SILHOUETTE_THRESHOLD, SilhouetteError, silhouettes};
// Public at the top of the crate alone.
pub(crate) use frame::{Frame, Image, Mask};
