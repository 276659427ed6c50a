//! 3D human motion from one fixed camera by explicit geometry.
//!
//! No training, no drawing, no files of results: frames, keypoints or tracks of dots go in, positions, postures
//! and limbs with their uncertainty come out, and every stage in between can be called alone.
//!
//! # A walker through frames
//!
//! Frames are borrowed grey values. Here they are drawn; from a camera they are
//! [`image::Frame::new`]`(&bytes, width, height, stride)`.
//!
//! ```
//! use memo_core::synth::{SceneOptions, SynthScene};
//! use memo_core::track::tracker::{Tracker, TrackerOptions};
//!
//! let scene = SynthScene::new(SceneOptions::default());
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
//! # Ok::<(), memo_core::track::tracker::TrackError>(())
//! ```
//!
//! # The other ways in
//!
//! * Image points of joints, a camera, lengths: [`posture::sequence::postures`] gives every posture they allow
//!   and the likeliest motion.
//! * Unnamed moving dots: [`planar::interpret_figure`] finds which are linked, and in which planes they swing.
//! * A stage alone: [`image`] from pixels to edges, [`model`] from a phase to visible contours, [`track::score`]
//!   where the two meet.
//!
//! # Conventions
//!
//! * World: right-handed, Z up, ground at z = 0, metres.
//! * Camera: OpenCV axes (x right, y down, z forward), `x_cam = R x_world + t`.
//! * Pixels: the centre of a pixel is its integer coordinate; u right, v down.
//! * Body: x forward, y to the body's left, z up; origin at the centre of the torso.
//! * Heading: angle of the body's forward axis about world Z, 0 along world X.
//! * Gait phase in [0, 1), 0 = right heel strike; the left side is at phase + 0.5.
//! * Angles in radians inside, flexion positive; files say `_deg` where they hold degrees.

pub mod calibrate;
pub mod image;
pub mod model;
pub mod planar;
pub mod posture;
pub mod progress;
pub mod synth;
pub mod track;
