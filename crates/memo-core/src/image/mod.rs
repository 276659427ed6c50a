//! What the pixels say: from grey frames to moving regions, velocities and straight edges.

pub mod background;
pub mod change;
pub mod clean;
pub mod frame;
pub mod gain;
pub mod outline;
pub mod region;

pub use background::{Background, BackgroundError, BackgroundOptions};
pub use change::{
    CHANGE_REACH_PX, ChangeDetector, ChangeOptions, fit_norms, noise_sd, pair_changes, pair_threshold,
    threshold_for_noise,
};
pub use clean::{CleanError, CleanOptions, clean, dilate, fill_holes};
pub use frame::{Frame, FrameError, Image, Mask};
pub use gain::{Gain, estimate_gain};
pub use outline::{Outline, outlines};
pub use region::{GroupOptions, Rectangle, Region, Run, Sides, group_regions, regions};
