//! Tests of the whole of memo-core, one topic per file: one binary, so that it is linked once.
//!
//! `cargo test --release -p memo-tests TOPIC -- --nocapture` prints what a topic measures. Unit tests are in the
//! files of memo-core; `tests/*.py` are the tests of the Python package.
#![cfg(test)]

mod clothed_walks;
mod gait_parameters;
mod mocap;
mod pets_positions;
mod planar_figure;
mod planar_legs;
mod planar_posture;
mod planar_rates;
mod posture_anchor;
mod posture_detections;
mod posture_length;
mod posture_linking;
mod posture_survival;
mod recorded;
mod recordings;
mod synthetic_walks;
mod unswap_walks;
mod visibility_oracle;
