//! Which display is made, and why one could not be.

use crate::model::Camera;
use crate::option_error::OptionError;
use crate::wording::counted;
use glam::{DVec2, DVec3};
use thiserror::Error;

/// Why a display could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PointLightError {
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The recording is shorter than the period or shift asked for.
    #[error("{parameter} of {wanted_s} s needs a longer motion: it lasts {available_s} s")]
    TooShort {
        /// What was asked for.
        parameter: &'static str,
        /// How long it is, seconds.
        wanted_s: f64,
        /// Length of the motion, seconds.
        available_s: f64,
    },
    /// Dots on joints with a limited lifetime, and no free joint to jump to.
    #[error("nowhere to jump for {} on {}: fewer dots than joints wanted", counted(*dots, "dot"), counted(*points, "joint"))]
    NoFreeJoint {
        /// Dots asked for.
        dots: usize,
        /// Points of the motion.
        points: usize,
    },
    /// Dots on limbs, and no limb.
    #[error("dots on limbs need limbs: none given and none of the usual joint names (RSH, REL, ...) found")]
    NoLimbs,
    /// A limb names a point that does not exist.
    #[error("limb ({}, {}) of a motion with {}", limb[0], limb[1], counted(*points, "point"))]
    Limb {
        /// The two indices.
        limb: [usize; 2],
        /// Points of the motion.
        points: usize,
    },
    /// More dots than can be held.
    #[error("too many dots to be held: {} in {}", counted(*dots, "dot"), counted(*frames, "frame"))]
    TooMany {
        /// Dots a frame.
        dots: usize,
        /// Frames.
        frames: usize,
    },
    /// Nothing of the motion is known or before the camera.
    #[error("no point of the motion is ever seen")]
    NothingSeen,
}

/// From where the motion is seen.
#[derive(Debug, Clone, PartialEq)]
pub enum View {
    /// Parallel projection. Pixel (0, 0) is the world's origin, u right, v down.
    Orthographic {
        /// Direction of the viewer about world Z, radians: at 0 the viewer looks along world +Y and sees world
        /// X to the right (a walk along X from its right side); at +π/2 the viewer stands at +X (a walk along X
        /// from the front).
        azimuth_rad: f64,
        /// Height of the viewer above the horizontal, radians: π/2 looks straight down.
        elevation_rad: f64,
        /// Scale, pixels per metre.
        px_per_m: f64,
    },
    /// A calibrated camera.
    Perspective(Box<Camera>),
}

impl View {
    /// Where a point of the world is seen, pixels; `None` where the camera cannot see it.
    pub fn project(&self, point_in_world: DVec3) -> Option<DVec2> {
        match self {
            Self::Perspective(camera) => camera.project(point_in_world),
            Self::Orthographic { azimuth_rad, elevation_rad, px_per_m } => {
                let (sin_a, cos_a) = azimuth_rad.sin_cos();
                let (sin_e, cos_e) = elevation_rad.sin_cos();
                let right = DVec3::new(cos_a, sin_a, 0.0);
                let down = DVec3::new(-sin_a * -sin_e, cos_a * -sin_e, -cos_e);
                let seen = DVec2::new(right.dot(point_in_world), down.dot(point_in_world)) * *px_per_m;
                seen.is_finite().then_some(seen)
            }
        }
    }
}

/// What happens to the walker's advance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Locomotion {
    /// Left as it is.
    Translating,
    /// The straight advance at constant speed is taken out; the body still bobs, sways and surges.
    Treadmill,
    /// The middle of the hips (or of all points, where there are no hips) is fixed.
    PelvisFixed,
}

/// Each point's trajectory shifted in time by its own random amount, against the horizontal path of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PhaseScramble {
    /// The motion repeats: a shift of up to one period, later frames taken from one period earlier. The
    /// trajectory has no jump if the motion has this period.
    Periodic {
        /// The period, seconds; `None` for the whole motion (one cycle, or a whole number of them).
        period_s: Option<f64>,
    },
    /// The motion does not repeat: shifts from 0 to this; the display is shorter by it.
    Shortened {
        /// Largest shift, seconds.
        max_shift_s: f64,
    },
}

/// Where dots of limited lifetime live.
#[derive(Debug, Clone, PartialEq)]
pub enum LifeSites {
    /// On the joints: after its lifetime a dot goes to another joint that has no dot (Neri, Morrone and Burr
    /// 1998).
    Joints,
    /// Anywhere on the limbs: after its lifetime a dot goes to a random place on a random limb, all limbs
    /// alike, and moves with it (Beintema and Lappe 2002, whose lifetime was 1, 2, 4 or 8 frames). Limbs as
    /// pairs of points; empty for the eight usual ones by name.
    Limbs(Vec<[usize; 2]>),
}

/// Dots that live for a number of frames, then jump.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitedLife {
    /// Dots shown at a time. Beintema and Lappe showed 1 to 8.
    pub dots: usize,
    /// Lifetime in frames, at least 1.
    pub frames: usize,
    /// Where they live.
    pub sites: LifeSites,
    /// Whether all dots jump in the same frame. By default they do not: each starts with a random age, so that
    /// about dots / frames jump in each frame.
    pub synchronous: bool,
}

impl Default for LimitedLife {
    fn default() -> Self {
        Self { dots: 8, frames: 2, sites: LifeSites::Limbs(Vec::new()), synchronous: false }
    }
}

/// How noise dots move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseKind {
    /// As the figure's own points do, at other places: every noise dot has the trajectory of one point (each
    /// point about equally often), moved to a random place (Cutting, Moore and Morrison 1988).
    ScrambledWalker,
    /// In a straight line in a random direction, re-entering on the other side of the area.
    Linear {
        /// Speed, pixels a second.
        speed_px_s: f64,
    },
    /// At a new random place in every frame.
    Flicker,
}

/// Dots that belong to no figure. With a limited lifetime they have it too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseDots {
    /// How many.
    pub count: usize,
    /// How they move.
    pub kind: NoiseKind,
    /// Sides of their area as multiples of the figure's extent. The area of scrambled-walker dots goes with
    /// the figure; that of the others stands still around everything the figure covers.
    pub area_scale: f64,
}

impl Default for NoiseDots {
    fn default() -> Self {
        Self { count: 40, kind: NoiseKind::ScrambledWalker, area_scale: 1.5 }
    }
}

/// Which display is made; the default is the upright walker from the side, in one place, at 200 px/m.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLightOptions {
    /// Of everything random.
    pub seed: u64,
    /// From where.
    pub view: View,
    /// Advance kept, or taken out.
    pub locomotion: Locomotion,
    /// Upside down: the display is flipped about the horizontal through its middle; the facing direction
    /// stays.
    pub is_inverted: bool,
    /// Flipped about the vertical through its middle: the figure faces the other way.
    pub is_mirrored: bool,
    /// Played backwards.
    pub is_reversed: bool,
    /// Each point's trajectory moved as a whole to a random place, within the extent of the figure.
    pub scrambles_position: bool,
    /// Each point's trajectory shifted in time.
    pub scrambles_phase: Option<PhaseScramble>,
    /// Dots that live for some frames only.
    pub limited_life: Option<LimitedLife>,
    /// Dots that belong to no figure.
    pub noise_dots: Option<NoiseDots>,
    /// Standard deviation of the noise added to both coordinates of every dot in every frame, pixels.
    pub noise_sd_px: f64,
}

impl Default for PointLightOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            view: View::Orthographic { azimuth_rad: 0.0, elevation_rad: 0.0, px_per_m: 200.0 },
            locomotion: Locomotion::Treadmill,
            is_inverted: false,
            is_mirrored: false,
            is_reversed: false,
            scrambles_position: false,
            scrambles_phase: None,
            limited_life: None,
            noise_dots: None,
            noise_sd_px: 0.0,
        }
    }
}
