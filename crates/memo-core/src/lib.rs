//! 3D human motion from one fixed camera by explicit geometry.
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
pub mod synth;
pub mod track;
