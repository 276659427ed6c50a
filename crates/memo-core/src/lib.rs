//! 3D human motion from one fixed camera by explicit geometry.
//!
//! No training, no drawing, no result files. The inputs are frames, keypoints or tracks of dots. The outputs are
//! positions, postures and limbs with their uncertainty. Every stage in between can be called alone.
//!
//! # A walker through frames
//!
//! Frames are borrowed grey values. This example draws them; frames of a camera are
//! [`Frame::new`]`(&bytes, width, height, stride)`.
//!
//! ```
//! use memo_core::SynthScene;
//! use memo_core::synth::SceneOptions;
//! use memo_core::{Tracker, TrackerOptions};
//!
//! let scene = SynthScene::new(SceneOptions::default())?;
//! let height_m = scene.walker.body.height_m;
//! let options = TrackerOptions { camera: Some(scene.camera.clone()), ..TrackerOptions::for_height(height_m) };
//! let mut tracker = Tracker::new(options)?;
//! for frame in 0..scene.len() {
//!     tracker.update(&scene.frame(frame).as_frame(), scene.time_s(frame))?;
//! }
//! tracker.finish()?;
//!
//! let walks = tracker.take_finished();
//! println!("right and left are interchanged with probability {:.3}", walks[0].p_swapped());
//! for row in walks[0].rows() {
//!     let true_phase = scene.truth(row.frame).expect("the walker is there").hypothesis.phase;
//!     let error = (row.phase - true_phase + 0.5).rem_euclid(1.0) - 0.5;
//!     assert!(error.abs() < 0.02);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `tracker.current()` is the filtered estimate while frames are still coming.
//! [`TrackedWalk::events`] and [`gait_parameters`](TrackedWalk::gait_parameters)
//! are the gait events and gait parameters of a finished walk.
//!
//! # Postures from keypoints
//!
//! The inputs are image points of joints, a camera, and segment lengths or a body height.
//! [`postures`] returns every posture they allow and the most probable motion.
//! [`Detector`] converts the points of a detector to the fourteen joints, and
//! [`Camera::from_file`] reads the camera.
//!
//! ```
//! use memo_core::glam::DVec2;
//! use memo_core::sampled_walk;
//! use memo_core::synth::SampledWalkOptions;
//! use memo_core::{
//!     Camera, Detector, Joint, KeypointSequence, PerJoint, SequenceOptions, TrackerOptions, postures,
//! };
//!
//! // A walk seen from its side. Its points are named RSH, REL and so on; for a known detector use
//! // `Detector::from_layout(Layout::by_name("coco-17")?)`.
//! let walker = TrackerOptions::for_height(1.75).walker(1.75)?;
//! let options = SampledWalkOptions { frames: 30, rate_hz: 25.0, ..SampledWalkOptions::default() };
//! let walk = sampled_walk(&walker, &options)?;
//! let camera = Camera::level([1280, 720], 1.0, 1.2, 6.0)?;
//! let detector = Detector::from_names(walk.names())?;
//! let (mut points_px, mut weights) = (Vec::new(), Vec::new());
//! for frame in 0..walk.frames() {
//!     let pixel = |point| camera.project(walk.at(frame, point)?);
//!     let seen: Vec<DVec2> = (0..walk.points()).map(|p| pixel(p).unwrap_or(DVec2::NAN)).collect();
//!     let joints = detector.stick_joints(&seen, &vec![1.0; seen.len()])?;
//!     points_px.push(PerJoint(joints.points_px));
//!     weights.push(PerJoint(joints.weights));
//! }
//!
//! let keypoints = KeypointSequence {
//!     times_s: walk.times_s(),
//!     points_px: &points_px,
//!     weights: &weights,
//!     head_points_px: None,
//!     foot_points_px: None,
//! };
//! let options = SequenceOptions { height_m: Some(1.75), noise_px: 0.5, ..SequenceOptions::default() };
//! let found = postures(&keypoints, &camera, &options)?;
//! found.warnings.iter().for_each(|warning| println!("{warning}"));
//!
//! let ankle = walk.index_of("RAN").expect("a point of the walk");
//! for (frame, figure) in found.linked.figures.iter().enumerate() {
//!     let truth = walk.at(frame, ankle).expect("known throughout");
//!     assert!(figure[Joint::RightAnkle].distance(truth) < 0.25);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Limbs among unnamed dots
//!
//! [`interpret_figure`] finds which dots are linked, and in which planes they swing.
//!
//! ```
//! use memo_core::{PointLightOptions, point_light_display, sampled_walk};
//! use memo_core::synth::{SampledWalkOptions, limbs_of};
//! use memo_core::{FigureOptions, TrackerOptions, interpret_figure};
//!
//! let walker = TrackerOptions::for_height(1.75).walker(1.75)?;
//! let walk = sampled_walk(&walker, &SampledWalkOptions::default())?;
//! let shown = point_light_display(&walk, &PointLightOptions::default())?;
//!
//! let read = interpret_figure(&shown.tracks(), &shown.times_s, &FigureOptions::default())?;
//! let links: Vec<[usize; 2]> = read.windows[0].figure.links().map(|link| link.points).collect();
//! assert!(limbs_of(walk.names()).iter().all(|limb| links.contains(limb)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Other entry points
//!
//! * A camera that is not calibrated: [`calibrate`], from measured points, a walking person or upright lines.
//! * A stage alone: [`image`] from pixels to edges, [`model`] from a phase to visible contours, [`track::score`]
//!   for the similarity of the two.
//!
//! # Errors, threads, versions
//!
//! Bad input is a typed error that holds the offending values. There is one error enum per concept; each may get
//! more variants. Every type is [`Send`] and [`Sync`]. Points and matrices of the interface are types of [`glam`]
//! and [`nalgebra`], which are re-exported in the versions used here.
//!
//! # Conventions
//!
//! * World: right-handed, Z up, ground at z = 0, metres.
//! * Camera: OpenCV axes (x right, y down, z forward), `x_cam = R x_world + t`.
//! * Pixels: the centre of a pixel is its integer coordinate; u right, v down.
//! * Body: x forward, y to the body's left, z up; origin at the centre of the torso.
//! * Heading: angle of the body's forward axis about world Z, 0 along world X.
//! * Gait phase in [0, 1), 0 = right heel strike; the left side is at phase + 0.5.
//! * Angles are in radians, flexion positive; names in files end in `_deg` where the values are degrees.

pub use {glam, nalgebra};

pub mod calibrate;
pub mod estimate;
pub mod image;
pub mod keypoints;
pub mod model;
mod option_error;
pub mod planar;
pub mod posture;
mod progress;
#[cfg(any(test, feature = "reproduce"))]
pub mod reproduce;
pub mod synth;
pub mod track;
pub mod wording;

// What most callers need. Each public item has one path: here, or in its wing.
pub use calibrate::points::camera_from_points;
pub use calibrate::tilt::camera_tilt;
pub use calibrate::walker::camera_from_walker;
pub use image::frame::{Frame, Image, Mask};
pub use keypoints::detector::Detector;
pub use keypoints::layouts::Layout;
pub use keypoints::unswap::{UnswapOptions, unswap};
pub use model::body::{Body, Walker};
pub use model::camera::Camera;
pub use model::gait::Gait;
pub use model::skeleton::{Joint, PerJoint, SegmentLengths, Side, StickFigure};
pub use option_error::OptionError;
pub use planar::figure::{FigureOptions, interpret_figure, interpret_named_figure};
pub use posture::sequence::{KeypointSequence, PostureSequence, SequenceError, SequenceOptions, postures};
pub use progress::{Progress, Stopped};
pub use synth::clothed::ClothedScene;
pub use synth::motion::sampled_walk;
pub use synth::pointlight::{PointLightOptions, point_light_display};
pub use synth::scene::SynthScene;
pub use track::gait_parameters::{GaitParameter, GaitQuantity};
pub use track::options::TrackerOptions;
pub use track::result::TrackedWalk;
pub use track::tracker::{TrackError, Tracker};

#[cfg(test)]
mod tests {
    /// Compiles only if all these types may be sent to another thread.
    #[test]
    fn what_people_hold_is_send_and_sync() {
        fn sent_and_shared<T: Send + Sync + 'static>() {}
        sent_and_shared::<crate::Camera>();
        sent_and_shared::<crate::model::CameraFileError>();
        sent_and_shared::<crate::Image<u8>>();
        sent_and_shared::<crate::Frame<'static>>();
        sent_and_shared::<crate::Tracker>();
        sent_and_shared::<crate::TrackError>();
        sent_and_shared::<crate::TrackedWalk>();
        sent_and_shared::<crate::PostureSequence>();
        sent_and_shared::<crate::SequenceError>();
        sent_and_shared::<crate::planar::FigureInterpretation>();
        sent_and_shared::<crate::planar::FigureError>();
        sent_and_shared::<crate::calibrate::PointCalibration>();
        sent_and_shared::<crate::calibrate::WalkerCalibration>();
        sent_and_shared::<crate::Progress>();
        sent_and_shared::<crate::SynthScene>();
    }
}
