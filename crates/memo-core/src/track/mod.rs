//! Model-based tracking: similarity of model and edges, search, starting phase, filter, tracker.

mod active;
mod approach;
mod bend;
mod candidate;
mod column;
mod crowd;
pub mod cycles;
mod decisions;
pub(crate) mod event;
pub mod evidence;
pub mod explain;
pub mod fit;
mod frontal;
pub(crate) mod gait_parameters;
pub mod height;
pub mod locate;
pub mod normal_gait;
pub(crate) mod options;
mod people;
pub mod plausible;
pub(crate) mod result;
pub mod route;
pub mod score;
pub mod search;
mod standing;
pub mod start;
pub mod steady;
pub mod swap;
pub(crate) mod tracker;
pub mod treadmill;
pub mod walk;

pub use event::EventKind;
pub use gait_parameters::LIKELY_MISTAKEN;
pub use options::GaitChoice;
pub use result::{Event, Row};
pub use tracker::{LONGEST_WALK, Now, SeekReport};
