//! What the pixels say: from grey frames to moving regions, velocities and straight edges.

pub mod change;
pub mod frame;
pub mod gain;

pub use change::{
    ChangeDetector, ChangeOptions, fit_norms, noise_sd, pair_changes, pair_threshold, threshold_for_noise,
};
pub use frame::{Frame, FrameError, Image, Mask};
pub use gain::{Gain, estimate_gain};
