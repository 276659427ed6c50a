//! Options of a display, and errors.

use crate::OptionError;
use crate::model::Camera;
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
        /// The parameter.
        parameter: &'static str,
        /// The duration requested, seconds.
        wanted_s: f64,
        /// Length of the motion, seconds.
        available_s: f64,
    },
    /// The motion does not repeat itself.
    #[error(
        "no period found up to {searched_s:.2} s: {}; give period_s, or shift the phases with \"shortened\"",
        best_lag(*.mismatch)
    )]
    NoPeriod {
        /// Mismatch at the best lag, as a share of that of unrelated positions; infinite if no lag is better
        /// than those around it.
        mismatch: f64,
        /// Longest lag searched, seconds.
        searched_s: f64,
    },
    /// There is a period, but no cycle is repeated and no phase is shifted by it.
    #[error("period_s has an effect only with cycles or with scramble_phase \"periodic\"")]
    IdlePeriod,
    /// There is a start, but no cycle is cut out.
    #[error("cycle_start_s has an effect only with cycles or with scramble_phase \"periodic\"")]
    IdleStart,
    /// The pelvis is to be fixed, but the motion has no hips.
    #[error(
        "locomotion \"pelvis\" needs a right and a left hip: names such as RHP and LHP wanted, got {names}"
    )]
    NoHips {
        /// The first names of the motion, with commas.
        names: String,
    },
    /// There is no motion.
    #[error("wanted the motion of at least one actor, got none")]
    NoActor,
    /// Displays of several actors need one offset for each.
    #[error("wanted displays with an offset each, got {} and {}", counted(*displays, "display"), counted(*offsets, "offset"))]
    Actors {
        /// Number of displays.
        displays: usize,
        /// Number of offsets.
        offsets: usize,
    },
    /// Displays or motions of several actors have different times.
    #[error("actor {actor} has other times than actor 0: {} after {}", counted(*others, "frame"), counted(*frames, "frame"))]
    Clocks {
        /// Index of the actor.
        actor: usize,
        /// Number of frames of actor 0.
        frames: usize,
        /// Number of frames of this actor.
        others: usize,
    },
    /// The dots are on joints with a limited lifetime, and there is no free joint to jump to.
    #[error("nowhere to jump for {} on {}: fewer dots than joints wanted", counted(*dots, "dot"), counted(*points, "joint"))]
    NoFreeJoint {
        /// Number of dots requested.
        dots: usize,
        /// Number of points of the motion.
        points: usize,
    },
    /// The dots are on limbs, and the motion has no limb.
    #[error("dots on limbs need limbs: none given and none of the usual joint names (RSH, REL, ...) found")]
    NoLimbs,
    /// A limb refers to a point that does not exist.
    #[error("limb ({}, {}) of a motion with {}", limb[0], limb[1], counted(*points, "point"))]
    Limb {
        /// The two indices.
        limb: [usize; 2],
        /// Number of points of the motion.
        points: usize,
    },
    /// There are more dots than can be stored.
    #[error("too many dots to be held: {} in {}", counted(*dots, "dot"), counted(*frames, "frame"))]
    TooMany {
        /// Dots per frame.
        dots: usize,
        /// Number of frames.
        frames: usize,
    },
    /// No point of the motion is known and in front of the camera.
    #[error("no point of the motion is ever seen")]
    NothingSeen,
}

/// The projection of the motion.
#[derive(Debug, Clone, PartialEq)]
pub enum DisplayView {
    /// Parallel projection. Pixel (0, 0) is the origin of the world, u points right, v down.
    Orthographic {
        /// Viewing direction about world Z, radians: at 0 the viewer looks along world +Y and sees world X to
        /// the right (a walk along X from its right side); at +π/2 the viewer is at +X (a walk along X from
        /// the front).
        azimuth_rad: f64,
        /// Elevation of the viewer above the horizontal, radians: π/2 looks straight down.
        elevation_rad: f64,
        /// Scale, pixels per metre.
        px_per_m: f64,
    },
    /// A calibrated camera.
    Perspective(Box<Camera>),
}

impl DisplayView {
    /// The image of a world point, pixels; `None` where the camera does not see it.
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

/// Treatment of the walker's forward motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Locomotion {
    /// Unchanged.
    Translating,
    /// The straight motion at constant speed is removed; the body still moves up and down, sideways and back
    /// and forth.
    Treadmill,
    /// The midpoint of the hips is fixed. The motion needs both, by any name that
    /// [`joint_name`](crate::keypoints::joint_name) knows.
    PelvisFixed,
}

/// One cycle of the motion, repeated without a jump from its end to its start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleOptions {
    /// Number of cycles, at least 1.
    pub cycles: usize,
    /// Speed as a multiple of that of the motion, 0.1 to 10. It is adjusted so that a cycle takes a whole number
    /// of frames.
    pub tempo: f64,
}

impl Default for CycleOptions {
    fn default() -> Self {
        Self { cycles: 1, tempo: 1.0 }
    }
}

/// Where a cycle is in a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CycleCut {
    /// Its duration, seconds.
    pub period_s: f64,
    /// Its start, seconds after the first frame.
    pub start_s: f64,
}

/// Phase scrambling: the trajectory of each point on the spot is shifted in time by its own random amount.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PhaseScramble {
    /// Shifts of up to one period. The motion is one cycle, repeated without a jump.
    Periodic,
    /// Shifts from 0 to this value, for motions that are not periodic; the display becomes shorter.
    Shortened {
        /// Largest shift, seconds.
        max_shift_s: f64,
    },
}

/// The directions in which position scrambling moves points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScrambleAxes {
    /// Horizontally and vertically.
    Both,
    /// Horizontally only: heights are kept.
    Horizontal,
    /// Vertically only.
    Vertical,
}

/// Position scrambling: the trajectory of each point is shifted as a whole to a random position within the
/// extent of the figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionScramble {
    /// Directions of the shifts.
    pub axes: ScrambleAxes,
    /// Largest shift along each axis, pixels; `None` for the extent of the figure.
    pub limit_px: Option<f64>,
}

impl Default for PositionScramble {
    fn default() -> Self {
        Self { axes: ScrambleAxes::Both, limit_px: None }
    }
}

/// Positions of dots with limited lifetime.
#[derive(Debug, Clone, PartialEq)]
pub enum LifeSites {
    /// On the joints: after its lifetime a dot jumps to another joint without a dot (Neri, Morrone and Burr
    /// 1998).
    Joints,
    /// On the limbs: after its lifetime a dot jumps to a random position on a random limb, all limbs equally
    /// likely, and moves with it (Beintema and Lappe 2002, with lifetimes of 1, 2, 4 or 8 frames). Limbs are
    /// pairs of points; an empty list means the eight usual ones by name.
    Limbs(Vec<[usize; 2]>),
}

impl PhaseScramble {
    /// Default of the largest shift, seconds: half a cycle of a slow walk.
    pub const MAX_SHIFT_S: f64 = 0.5;
}

/// Dots that jump after a number of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitedLife {
    /// Number of dots visible at a time. Beintema and Lappe used 1 to 8.
    pub dots: usize,
    /// Lifetime in frames, at least 1.
    pub frames: usize,
    /// Positions of the dots.
    pub sites: LifeSites,
    /// Whether all dots jump in the same frame. By default each dot starts with a random age, so that about
    /// dots / frames jump in each frame.
    pub synchronous: bool,
}

impl Default for LimitedLife {
    fn default() -> Self {
        Self { dots: 8, frames: 2, sites: LifeSites::Limbs(Vec::new()), synchronous: false }
    }
}

/// Motion of noise dots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoiseKind {
    /// As the figure's own points, at other positions: every noise dot has the trajectory of one point (each
    /// point about equally often), shifted to a random position (Cutting, Moore and Morrison 1988).
    ScrambledWalker,
    /// In a straight line in a random direction, re-entering on the opposite side of the area.
    Linear {
        /// Speed, pixels per second.
        speed_px_s: f64,
    },
    /// At a new random position in every frame.
    Flicker,
}

impl NoiseKind {
    /// Default speed of dots that move in a straight line, pixels per second.
    pub const SPEED_PX_S: f64 = 60.0;
}

/// Dots that belong to no figure. A limited lifetime applies to them too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseDots {
    /// Number of noise dots.
    pub count: usize,
    /// Their motion.
    pub kind: NoiseKind,
    /// Sides of their area as multiples of the figure's extent. The area of scrambled-walker dots moves with
    /// the figure; that of the others is fixed around everything the figure covers.
    pub area_scale: f64,
}

impl Default for NoiseDots {
    fn default() -> Self {
        Self { count: 40, kind: NoiseKind::ScrambledWalker, area_scale: 1.5 }
    }
}

/// Options of a display; the default is the upright walker from the side, on the spot, at 200 px/m.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLightOptions {
    /// Seed of all random numbers.
    pub seed: u64,
    /// The projection.
    pub view: DisplayView,
    /// Whether the forward motion is kept or removed.
    pub locomotion: Locomotion,
    /// Inverted: the display is flipped about the horizontal line through the middle of the figure before
    /// scrambling; the facing direction does not change.
    pub is_inverted: bool,
    /// Mirrored about the vertical line through the middle of the figure before scrambling, which then faces the
    /// other way.
    pub is_mirrored: bool,
    /// Time-reversed.
    pub is_reversed: bool,
    /// Repetition of one cycle.
    pub cycles: Option<CycleOptions>,
    /// Period of the motion, seconds, for `cycles` and periodic phase scrambling. By default, the whole motion if
    /// its end leads to its start, otherwise the lag at which the motion repeats itself best.
    pub period_s: Option<f64>,
    /// Start of the cycle, seconds after the first frame of the motion; the nearest frame is taken. By default,
    /// where the motion differs least from itself one period later. [`common_cycle`](super::common_cycle) finds
    /// one for several actors.
    pub cycle_start_s: Option<f64>,
    /// Position scrambling.
    pub scrambles_position: Option<PositionScramble>,
    /// Phase scrambling.
    pub scrambles_phase: Option<PhaseScramble>,
    /// Dots with limited lifetime.
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
            view: DisplayView::Orthographic { azimuth_rad: 0.0, elevation_rad: 0.0, px_per_m: 200.0 },
            locomotion: Locomotion::Treadmill,
            is_inverted: false,
            is_mirrored: false,
            is_reversed: false,
            cycles: None,
            period_s: None,
            cycle_start_s: None,
            scrambles_position: None,
            scrambles_phase: None,
            limited_life: None,
            noise_dots: None,
            noise_sd_px: 0.0,
        }
    }
}

/// What the best of the lags came to.
fn best_lag(mismatch: f64) -> String {
    if mismatch.is_finite() {
        format!(
            "at the best lag, the mismatch is {mismatch:.2} of that of unrelated positions (at most 0.2 wanted)"
        )
    } else {
        "no lag fits better than those around it".to_owned()
    }
}
