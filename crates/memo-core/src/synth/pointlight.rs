//! Point-light displays: a motion reduced to dots, and the controls that vision science compares it with.
//!
//! Sources: Johansson 1973 (lights at the joints); Cutting 1978 (the synthetic walker on the spot); Sumi 1984
//! (inversion); Cutting, Moore and Morrison 1988 (masks of scrambled walkers); Neri, Morrone and Burr 1998 and
//! Beintema and Lappe 2002 (limited lifetime); van Boxtel and Lu 2013 (the usual set of options).
//!
//! The steps, in their order: time reversal, locomotion, phase scrambling (in space); projection; position
//! scrambling, inversion and mirroring (in the image); limited lifetime; noise dots; pixel noise. Every step
//! draws from its own stream of the seed, so that switching one on does not change the others.
//!
//! Dots are not hidden by the body (Cutting's walker hid those behind a limb): mark what is hidden as NaN in
//! the motion. Nothing is drawn here.

use super::motion::{Motion, limbs_of};
use super::random::Random;
use crate::model::Camera;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};
use thiserror::Error;

/// More dots than this over all frames are not made.
const MOST_DOTS: usize = 50_000_000;

/// Why a display could not be made.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum PointLightError {
    /// A number is out of its range.
    #[error("{parameter} must be {wanted}, got {value}")]
    Parameter {
        /// Its name.
        parameter: &'static str,
        /// What it may be.
        wanted: &'static str,
        /// Its value.
        value: f64,
    },
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
    #[error("{dots} dots on {points} joints have nowhere to jump: fewer dots than joints wanted")]
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
    #[error("limb ({}, {}) of a motion with {points} points", limb[0], limb[1])]
    Limb {
        /// The two indices.
        limb: [usize; 2],
        /// Points of the motion.
        points: usize,
    },
    /// More dots than can be held.
    #[error("{dots} dots in {frames} frames are too many")]
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

/// What a dot shows in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DotSource {
    /// A point of the motion, by index.
    Joint(usize),
    /// A place on a limb: ends by index, and the fraction of the way from the first to the second.
    Limb([usize; 2], f64),
    /// A noise dot, with the index of the point whose trajectory it copies, if it does.
    Noise(Option<usize>),
}

/// A point-light display. Dots keep their index over time, also when they jump.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLightDisplay {
    /// Times of the T frames, seconds.
    pub times_s: Vec<f64>,
    /// Number of dots N.
    pub dots: usize,
    /// Pixels (u, v), frame after frame, T x N; NaN where the dot is not visible.
    pub positions_px: Vec<DVec2>,
    /// What each dot shows, T x N.
    pub sources: Vec<DotSource>,
}

impl PointLightDisplay {
    /// A dot at a frame, `None` where it is not visible or does not exist.
    pub fn at(&self, frame: usize, dot: usize) -> Option<DVec2> {
        if dot >= self.dots {
            return None;
        }
        self.positions_px.get(frame * self.dots + dot).copied().filter(|p| p.is_finite())
    }
}

/// Makes a point-light display of a motion.
pub fn point_light_display(
    motion: &Motion,
    options: &PointLightOptions,
) -> Result<PointLightDisplay, PointLightError> {
    checked(motion, options)?;
    let mut motion = motion.clone();
    if options.is_reversed {
        let last = motion.frames() - 1;
        let forward = motion.clone();
        motion = motion.map(|t, k, _| forward.positions()[(last - t) * forward.points() + k]);
    }
    motion = without_advance(motion, options.locomotion);
    if let Some(scramble) = &options.scrambles_phase {
        motion = phase_scrambled(&motion, scramble, &mut stream(options.seed, 1))?;
    }
    let mut figure = Figure::seen(&motion, &options.view)?;
    if options.scrambles_position {
        figure.scramble_positions(&mut stream(options.seed, 2));
    }
    figure.flip(DVec2::new(sign(options.is_mirrored), sign(options.is_inverted)));
    let shown = match &options.limited_life {
        Some(life) => limited(&figure, life, limbs(&motion, life)?, &mut stream(options.seed, 3)),
        None => figure.all_points(),
    };
    let noise = options.noise_dots.map_or_else(Layer::default, |noise| {
        let life = options.limited_life.as_ref();
        let interval_s = motion.frame_interval_s();
        noise_layer(&figure, &noise, life, interval_s, &mut stream(options.seed, 4))
    });
    let mut display = beside(shown, noise, motion.times_s().to_vec());
    if options.noise_sd_px > 0.0 {
        let mut random = stream(options.seed, 5);
        for p in &mut display.positions_px {
            let [du, dv] = random.normal_pair();
            *p += DVec2::new(f64::from(du), f64::from(dv)) * options.noise_sd_px;
        }
    }
    Ok(display)
}

/// The random numbers of one step.
fn stream(seed: u64, step: u64) -> Random {
    Random::new(seed ^ step.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

fn sign(is_flipped: bool) -> f64 {
    if is_flipped { -1.0 } else { 1.0 }
}

/// A random index below `count`, which must not be 0.
fn below(random: &mut Random, count: usize) -> usize {
    (random.uniform(0.0, count as f64) as usize).min(count - 1)
}

fn checked(motion: &Motion, options: &PointLightOptions) -> Result<(), PointLightError> {
    let refuse = |parameter, wanted, value| Err(PointLightError::Parameter { parameter, wanted, value });
    if let View::Orthographic { azimuth_rad, elevation_rad, px_per_m } = options.view {
        if !azimuth_rad.is_finite() {
            return refuse("azimuth", "finite radians", azimuth_rad);
        }
        if !(-FRAC_PI_2..=FRAC_PI_2).contains(&elevation_rad) {
            return refuse("elevation", "between -pi/2 and pi/2 radians", elevation_rad);
        }
        if !(px_per_m > 0.0 && px_per_m <= 1e6) {
            return refuse("pixels per metre", "positive and at most 1,000,000", px_per_m);
        }
    }
    if !(0.0..=1e6).contains(&options.noise_sd_px) {
        return refuse("noise_sd_px", "from 0 to 1,000,000 pixels", options.noise_sd_px);
    }
    let mut dots = motion.points();
    if let Some(life) = &options.limited_life {
        if life.dots == 0 || life.frames == 0 {
            return refuse("dots and frames of a limited life", "at least 1", 0.0);
        }
        if life.sites == LifeSites::Joints && life.dots >= motion.points() {
            return Err(PointLightError::NoFreeJoint { dots: life.dots, points: motion.points() });
        }
        dots = life.dots;
    }
    if let Some(noise) = &options.noise_dots {
        if !(noise.area_scale > 0.0 && noise.area_scale <= 1000.0) {
            return refuse("area_scale of the noise dots", "positive and at most 1000", noise.area_scale);
        }
        if let NoiseKind::Linear { speed_px_s } = noise.kind
            && !(-1e6..=1e6).contains(&speed_px_s)
        {
            return refuse("speed of the noise dots", "at most 1,000,000 pixels a second", speed_px_s);
        }
        dots = dots.saturating_add(noise.count);
    }
    let frames = motion.frames();
    if dots.saturating_mul(frames) > MOST_DOTS {
        return Err(PointLightError::TooMany { dots, frames });
    }
    Ok(())
}

/// Takes the advance out, keeping the place of the middle of the motion.
fn without_advance(motion: Motion, locomotion: Locomotion) -> Motion {
    let path = motion.pelvis_path();
    let mean = path.iter().sum::<DVec3>() / path.len() as f64;
    match locomotion {
        Locomotion::Translating => motion,
        Locomotion::PelvisFixed => motion.map(|t, _, p| p - path[t] + mean),
        Locomotion::Treadmill => {
            let times = motion.times_s();
            let mean_s = times.iter().sum::<f64>() / times.len() as f64;
            let spread: f64 = times.iter().map(|t| (t - mean_s).powi(2)).sum();
            let moment: DVec3 = times.iter().zip(&path).map(|(t, p)| (*p - mean) * (t - mean_s)).sum();
            let velocity = if spread > 0.0 { moment.with_z(0.0) / spread } else { DVec3::ZERO };
            motion.map(|t, _, p| p - velocity * (motion.times_s()[t] - mean_s))
        }
    }
}

/// p_k(t) = c(t) + r_k(t + s_k) with the horizontal path c of the body, r_k = p_k - c and a shift s_k a point.
fn phase_scrambled(
    motion: &Motion,
    scramble: &PhaseScramble,
    random: &mut Random,
) -> Result<Motion, PointLightError> {
    let (frames, interval_s) = (motion.frames(), motion.frame_interval_s());
    let in_frames = |parameter, seconds: f64| {
        if !(seconds >= 0.0 && seconds.is_finite()) {
            let wanted = "a duration in seconds";
            return Err(PointLightError::Parameter { parameter, wanted, value: seconds });
        }
        let available_s = interval_s * frames as f64;
        if seconds > available_s * (1.0 + 1e-9) {
            return Err(PointLightError::TooShort { parameter, wanted_s: seconds, available_s });
        }
        Ok(if interval_s > 0.0 { (seconds / interval_s).round() as usize } else { 0 })
    };
    let (period, shifts, kept) = match *scramble {
        PhaseScramble::Periodic { period_s: None } => (frames, frames, frames),
        PhaseScramble::Periodic { period_s: Some(period_s) } => {
            let period = in_frames("period_s", period_s)?.clamp(1, frames);
            (period, period, frames)
        }
        PhaseScramble::Shortened { max_shift_s } => {
            let longest = in_frames("max_shift_s", max_shift_s)?.min(frames - 1);
            (frames, longest + 1, frames - longest)
        }
    };
    let shift: Vec<usize> = (0..motion.points()).map(|_| below(random, shifts)).collect();
    let path: Vec<DVec3> = motion.pelvis_path().into_iter().map(|p| p.with_z(0.0)).collect();
    let shifted = motion.map(|t, k, _| {
        let later = t + shift[k];
        let periods = if later < frames { 0 } else { (later - frames) / period + 1 };
        let source = later - period * periods;
        motion.positions()[source * motion.points() + k] - path[source] + path[t]
    });
    Ok(shifted.truncated(kept))
}

/// A rectangle of the image.
#[derive(Debug, Clone, Copy)]
struct Extent {
    low: DVec2,
    high: DVec2,
}

impl Extent {
    const NOTHING: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    /// Around all finite points.
    fn of(points: impl Iterator<Item = DVec2>) -> Self {
        points
            .filter(|p| p.is_finite())
            .fold(Self::NOTHING, |e, p| Self { low: e.low.min(p), high: e.high.max(p) })
    }

    fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    fn middle(&self) -> DVec2 {
        0.5 * (self.low + self.high)
    }

    fn scaled(&self, factor: f64) -> Self {
        let half = 0.5 * factor * (self.high - self.low);
        Self { low: self.middle() - half, high: self.middle() + half }
    }

    fn draw(&self, random: &mut Random) -> DVec2 {
        let (x, y) = (random.uniform(0.0, 1.0), random.uniform(0.0, 1.0));
        self.low + DVec2::new(x, y) * (self.high - self.low)
    }

    /// A shift that puts `part` at a random place within this extent, as far as it fits.
    fn draw_shift(&self, part: &Self, random: &mut Random) -> DVec2 {
        let (least, most) = (self.low - part.low, self.high - part.high);
        Self { low: least.min(most), high: least.max(most) }.draw(random)
    }
}

/// The points of a motion in the image, with the place of the body.
#[derive(Debug, Clone)]
struct Figure {
    points: usize,
    /// T x K, NaN where not seen.
    positions: Vec<DVec2>,
    /// Image of the body's place, T.
    path: Vec<DVec2>,
}

impl Figure {
    fn seen(motion: &Motion, view: &View) -> Result<Self, PointLightError> {
        let project =
            |p: &DVec3| if p.is_nan() { DVec2::NAN } else { view.project(*p).unwrap_or(DVec2::NAN) };
        let places = motion.pelvis_path();
        let level = places.iter().map(|p| p.z).sum::<f64>() / places.len() as f64;
        let positions: Vec<DVec2> = motion.positions().iter().map(project).collect();
        if positions.iter().all(|p| p.is_nan()) {
            return Err(PointLightError::NothingSeen);
        }
        let frames = places.iter().zip(positions.chunks(motion.points()));
        let path = frames.map(|(place, seen)| {
            let body = project(&place.with_z(level));
            let around = Extent::of(seen.iter().copied());
            if body.is_finite() || around.is_empty() { body } else { around.middle() }
        });
        Ok(Self { points: motion.points(), path: path.collect(), positions })
    }

    fn at(&self, frame: usize, point: usize) -> DVec2 {
        self.positions[frame * self.points + point]
    }

    /// Where a point is against the body.
    fn against_body(&self, frame: usize, point: usize) -> DVec2 {
        self.at(frame, point) - self.path[frame]
    }

    fn trajectory_extent(&self, point: usize) -> Extent {
        Extent::of((0..self.path.len()).map(|t| self.against_body(t, point)))
    }

    fn body_extent(&self) -> Extent {
        Extent::of((0..self.positions.len()).map(|i| self.positions[i] - self.path[i / self.points]))
    }

    fn scramble_positions(&mut self, random: &mut Random) {
        let body = self.body_extent();
        for k in 0..self.points {
            let own = self.trajectory_extent(k);
            let shift = if own.is_empty() { DVec2::ZERO } else { body.draw_shift(&own, random) };
            self.positions.iter_mut().skip(k).step_by(self.points).for_each(|p| *p += shift);
        }
    }

    /// Flips about the middle of all that is shown, by axis where `sign` is -1.
    fn flip(&mut self, sign: DVec2) {
        let middle = Extent::of(self.positions.iter().copied()).middle();
        for p in self.positions.iter_mut().chain(&mut self.path) {
            *p = middle + (*p - middle) * sign;
        }
    }

    fn all_points(&self) -> Layer {
        let sources = (0..self.positions.len()).map(|i| DotSource::Joint(i % self.points)).collect();
        Layer { dots: self.points, positions: self.positions.clone(), sources }
    }

    fn place(&self, frame: usize, source: DotSource) -> DVec2 {
        match source {
            DotSource::Joint(k) => self.at(frame, k),
            DotSource::Limb([a, b], fraction) => self.at(frame, a).lerp(self.at(frame, b), fraction),
            DotSource::Noise(_) => DVec2::NAN,
        }
    }
}

/// Some dots of a display, T x dots.
#[derive(Debug, Default)]
struct Layer {
    dots: usize,
    positions: Vec<DVec2>,
    sources: Vec<DotSource>,
}

/// The limbs on which dots may live.
fn limbs(motion: &Motion, life: &LimitedLife) -> Result<Vec<[usize; 2]>, PointLightError> {
    let LifeSites::Limbs(given) = &life.sites else { return Ok(Vec::new()) };
    let limbs = if given.is_empty() { limbs_of(motion.names()) } else { given.clone() };
    let points = motion.points();
    if let Some(&limb) = limbs.iter().find(|limb| limb.iter().any(|&end| end >= points)) {
        return Err(PointLightError::Limb { limb, points });
    }
    if limbs.is_empty() { Err(PointLightError::NoLimbs) } else { Ok(limbs) }
}

/// In which frames a dot jumps: its ages at frame 0, then every `frames` frames.
fn first_ages(dots: usize, life: &LimitedLife, random: &mut Random) -> Vec<usize> {
    (0..dots).map(|_| if life.synchronous { 0 } else { below(random, life.frames) }).collect()
}

fn limited(figure: &Figure, life: &LimitedLife, limbs: Vec<[usize; 2]>, random: &mut Random) -> Layer {
    let mut layer = Layer { dots: life.dots, ..Layer::default() };
    let age = first_ages(life.dots, life, random);
    let mut now: Vec<DotSource> = Vec::with_capacity(life.dots);
    for frame in 0..figure.path.len() {
        for dot in 0..life.dots {
            let is_new = frame == 0 || (frame + age[dot]).is_multiple_of(life.frames);
            if is_new {
                let next = match &life.sites {
                    LifeSites::Joints => free_joint(&now, figure.points, random),
                    LifeSites::Limbs(_) => {
                        DotSource::Limb(limbs[below(random, limbs.len())], random.uniform(0.0, 1.0))
                    }
                };
                if frame == 0 { now.push(next) } else { now[dot] = next }
            }
            layer.positions.push(figure.place(frame, now[dot]));
            layer.sources.push(now[dot]);
        }
    }
    layer
}

/// A joint that has no dot now, which excludes the dot's own.
fn free_joint(taken: &[DotSource], points: usize, random: &mut Random) -> DotSource {
    let free: Vec<usize> = (0..points).filter(|&k| !taken.contains(&DotSource::Joint(k))).collect();
    DotSource::Joint(free[below(random, free.len())])
}

fn noise_layer(
    figure: &Figure,
    noise: &NoiseDots,
    life: Option<&LimitedLife>,
    interval_s: f64,
    random: &mut Random,
) -> Layer {
    let body = figure.body_extent().scaled(noise.area_scale);
    let screen = Extent::of(figure.positions.iter().copied()).scaled(noise.area_scale);
    let trajectories: Vec<Extent> = (0..figure.points).map(|k| figure.trajectory_extent(k)).collect();
    let seen: Vec<usize> = (0..figure.points).filter(|&k| !trajectories[k].is_empty()).collect();
    let new_dot = |i: usize, since: usize, random: &mut Random| {
        let point = seen[if life.is_some() { below(random, seen.len()) } else { i % seen.len() }];
        let place = match noise.kind {
            NoiseKind::ScrambledWalker => body.draw_shift(&trajectories[point], random),
            NoiseKind::Linear { .. } | NoiseKind::Flicker => screen.draw(random),
        };
        NoiseDot { place, point, since, direction_rad: random.uniform(0.0, TAU) }
    };
    let age = life.map(|life| first_ages(noise.count, life, random));
    let mut layer = Layer { dots: noise.count, ..Layer::default() };
    let mut dots: Vec<NoiseDot> = (0..noise.count).map(|i| new_dot(i, 0, random)).collect();
    for frame in 0..figure.path.len() {
        for (i, dot) in dots.iter_mut().enumerate() {
            let lived = life.zip(age.as_ref());
            let dies = lived.is_some_and(|(life, age)| (frame + age[i]).is_multiple_of(life.frames));
            if frame > 0 && (dies || noise.kind == NoiseKind::Flicker) {
                *dot = new_dot(i, frame, random);
            }
            let (position, copied) = dot.at(frame, figure, noise.kind, &screen, interval_s);
            layer.positions.push(position);
            layer.sources.push(DotSource::Noise(copied));
        }
    }
    layer
}

/// One noise dot since its last jump.
struct NoiseDot {
    /// Shift of its trajectory, or its first place.
    place: DVec2,
    point: usize,
    since: usize,
    direction_rad: f64,
}

impl NoiseDot {
    /// Where it is, and which point's trajectory it copies.
    fn at(
        &self,
        frame: usize,
        figure: &Figure,
        kind: NoiseKind,
        screen: &Extent,
        interval_s: f64,
    ) -> (DVec2, Option<usize>) {
        match kind {
            NoiseKind::ScrambledWalker => (figure.at(frame, self.point) + self.place, Some(self.point)),
            NoiseKind::Flicker => (self.place, None),
            NoiseKind::Linear { speed_px_s } => {
                let travelled = speed_px_s * interval_s * (frame - self.since) as f64;
                (wrapped(self.place + DVec2::from_angle(self.direction_rad) * travelled, screen), None)
            }
        }
    }
}

/// A point that left the area, re-entered on the other side.
fn wrapped(point: DVec2, area: &Extent) -> DVec2 {
    let side = area.high - area.low;
    let wrap = |x: f64, low: f64, side: f64| if side > 0.0 { low + (x - low).rem_euclid(side) } else { low };
    DVec2::new(wrap(point.x, area.low.x, side.x), wrap(point.y, area.low.y, side.y))
}

/// The dots of two layers side by side.
fn beside(first: Layer, second: Layer, times_s: Vec<f64>) -> PointLightDisplay {
    let dots = first.dots + second.dots;
    let mut positions_px = Vec::with_capacity(dots * times_s.len());
    let mut sources = Vec::with_capacity(dots * times_s.len());
    for frame in 0..times_s.len() {
        for layer in [&first, &second] {
            let row = frame * layer.dots..(frame + 1) * layer.dots;
            positions_px.extend_from_slice(&layer.positions[row.clone()]);
            sources.extend_from_slice(&layer.sources[row]);
        }
    }
    PointLightDisplay { times_s, dots, positions_px, sources }
}

#[cfg(test)]
mod tests {
    use super::super::motion::{WalkOptions, sampled_walk};
    use super::*;
    use crate::model::{Body, Gait, GaitStyle, Walker};

    /// One whole cycle of the model walking along X.
    fn cycle() -> Motion {
        let body = Body::from_height(1.75).unwrap();
        let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
        let cycle_s = WalkOptions::default().cycle_s(&walker);
        sampled_walk(&walker, &WalkOptions { rate_hz: 60.0 / cycle_s, ..WalkOptions::default() }).unwrap()
    }

    fn display(options: PointLightOptions) -> PointLightDisplay {
        point_light_display(&cycle(), &options).unwrap()
    }

    fn trajectory(display: &PointLightDisplay, dot: usize) -> Vec<DVec2> {
        display.positions_px.iter().skip(dot).step_by(display.dots).copied().collect()
    }

    #[test]
    fn views_have_the_documented_axes() {
        let view =
            |azimuth_rad, elevation_rad| View::Orthographic { azimuth_rad, elevation_rad, px_per_m: 100.0 };
        let quarter = std::f64::consts::FRAC_PI_2;
        for (view, x, y, z) in [
            (view(0.0, 0.0), [100.0, 0.0], [0.0, 0.0], [0.0, -100.0]),
            (view(quarter, 0.0), [0.0, 0.0], [100.0, 0.0], [0.0, -100.0]),
            (view(0.0, quarter), [100.0, 0.0], [0.0, -100.0], [0.0, 0.0]),
        ] {
            for (axis, wanted) in [(DVec3::X, x), (DVec3::Y, y), (DVec3::Z, z)] {
                assert!((view.project(axis).unwrap() - DVec2::from(wanted)).length() < 1e-9);
            }
        }
        // A camera far away sees what the parallel projection sees.
        let camera = Camera::level([640, 480], 0.02, 1.0, 60.0).unwrap();
        let (middle, scale) = (camera.centre_px, camera.focal_px.x / 60.0);
        let point = DVec3::new(0.4, 0.2, 1.3);
        let parallel = View::Orthographic { azimuth_rad: 0.0, elevation_rad: 0.0, px_per_m: scale };
        let wanted = parallel.project(point).unwrap() - parallel.project(DVec3::Z).unwrap();
        let seen = View::Perspective(Box::new(camera)).project(point).unwrap() - middle;
        assert!((seen - wanted).length() < 0.005 * wanted.length(), "{seen} {wanted}");
    }

    #[test]
    fn the_treadmill_keeps_the_bob_and_the_fixed_pelvis_does_not() {
        let at = |locomotion| display(PointLightOptions { locomotion, ..PointLightOptions::default() });
        let spread = |d: &PointLightDisplay, k| {
            let e = Extent::of(trajectory(d, k).into_iter());
            e.high - e.low
        };
        let hip = 6;
        let translating = spread(&at(Locomotion::Translating), hip);
        assert!(
            (translating.x - 200.0 * 1.3 * 59.0 / 60.0 * WalkOptions::default().cycle_s(&walker())).abs()
                < 1.0
        );
        let treadmill = spread(&at(Locomotion::Treadmill), hip);
        assert!(treadmill.x < 1.0 && treadmill.y > 2.0, "{treadmill}");
        assert!(spread(&at(Locomotion::PelvisFixed), hip).length() < 1e-9);
    }

    fn walker() -> Walker {
        let body = Body::from_height(1.75).unwrap();
        Walker { body, gait: Gait::dense(), style: GaitStyle::default() }
    }

    #[test]
    fn inversion_flips_up_and_down_only_and_mirroring_left_and_right_only() {
        let upright = display(PointLightOptions::default());
        let inverted = display(PointLightOptions { is_inverted: true, ..PointLightOptions::default() });
        let mirrored = display(PointLightOptions { is_mirrored: true, ..PointLightOptions::default() });
        let sums = |d: &PointLightDisplay| {
            let pairs = upright.positions_px.iter().zip(&d.positions_px);
            pairs.map(|(a, b)| (*a - *b, *a + *b)).collect::<Vec<_>>()
        };
        for (difference, sum) in sums(&inverted) {
            assert!(difference.x.abs() < 1e-9 && (sum.y - sums(&inverted)[0].1.y).abs() < 1e-9);
        }
        for (difference, sum) in sums(&mirrored) {
            assert!(difference.y.abs() < 1e-9 && (sum.x - sums(&mirrored)[0].1.x).abs() < 1e-9);
        }
        let reversed = display(PointLightOptions { is_reversed: true, ..PointLightOptions::default() });
        let (forth, mut back) = (trajectory(&upright, 2), trajectory(&reversed, 2));
        back.reverse();
        assert!(forth.iter().zip(&back).all(|(a, b)| (*a - *b).length() < 1e-9));
    }

    #[test]
    fn scrambled_positions_keep_every_local_motion_and_stay_in_the_figure() {
        let upright = display(PointLightOptions::default());
        let scrambled =
            display(PointLightOptions { scrambles_position: true, ..PointLightOptions::default() });
        let figure = Extent::of(upright.positions_px.iter().copied());
        let mut moved = 0;
        for k in 0..13 {
            let (before, after) = (trajectory(&upright, k), trajectory(&scrambled, k));
            let shift = after[0] - before[0];
            assert!(before.iter().zip(&after).all(|(a, b)| (*b - *a - shift).length() < 1e-9));
            moved += usize::from(shift.length() > 10.0);
        }
        assert!(moved > 9, "{moved} of 13 dots moved");
        let after = Extent::of(scrambled.positions_px.iter().copied());
        assert!(after.low.cmpge(figure.low - 2.0).all() && after.high.cmple(figure.high + 2.0).all());
    }

    #[test]
    fn phase_scrambling_shifts_whole_cycles_without_a_jump_and_keeps_the_mean_places() {
        let options =
            PointLightOptions { locomotion: Locomotion::PelvisFixed, ..PointLightOptions::default() };
        let upright = display(options.clone());
        let scramble = Some(PhaseScramble::Periodic { period_s: None });
        let shifted = display(PointLightOptions { scrambles_phase: scramble, ..options });
        let mut shifts = Vec::new();
        for k in 0..13 {
            let (before, after) = (trajectory(&upright, k), trajectory(&shifted, k));
            let equal = |s: usize| (0..60).all(|t| (before[(t + s) % 60] - after[t]).length() < 1e-9);
            shifts.extend((0..60).find(|&s| equal(s)));
        }
        assert_eq!(shifts.len(), 13, "every trajectory is a rotation of its own: {shifts:?}");
        shifts.sort_unstable();
        shifts.dedup();
        assert!(shifts.len() > 7);
        // With a translating walker the advance is not shifted, so steps stay small over the seam.
        let walking = display(PointLightOptions {
            locomotion: Locomotion::Translating,
            scrambles_phase: scramble,
            ..PointLightOptions::default()
        });
        for k in 0..13 {
            let steps = trajectory(&walking, k).windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max);
            assert!(steps < 20.0, "dot {k} jumps {steps} px");
        }
        let shortened = Some(PhaseScramble::Shortened { max_shift_s: 0.3 });
        let shorter =
            display(PointLightOptions { scrambles_phase: shortened, ..PointLightOptions::default() });
        assert!(shorter.times_s.len() < 60 && shorter.times_s.len() > 35);
    }

    #[test]
    fn dots_on_joints_live_their_frames_and_never_share_a_joint() {
        let life = LimitedLife { dots: 6, frames: 3, sites: LifeSites::Joints, synchronous: false };
        let shown = display(PointLightOptions { limited_life: Some(life), ..PointLightOptions::default() });
        let all = display(PointLightOptions::default());
        let joint = |t: usize, dot: usize| match shown.sources[t * 6 + dot] {
            DotSource::Joint(k) => k,
            other => panic!("{other:?}"),
        };
        let mut jumps_a_frame = Vec::new();
        for t in 0..60 {
            let mut taken: Vec<usize> = (0..6).map(|dot| joint(t, dot)).collect();
            for (dot, &k) in taken.iter().enumerate() {
                assert_eq!(shown.at(t, dot), all.at(t, k));
            }
            taken.sort_unstable();
            taken.dedup();
            assert_eq!(taken.len(), 6, "two dots on one joint");
            if t > 0 {
                jumps_a_frame.push((0..6).filter(|&dot| joint(t, dot) != joint(t - 1, dot)).count());
            }
        }
        for dot in 0..6 {
            let jumps: Vec<usize> = (1..60).filter(|&t| joint(t, dot) != joint(t - 1, dot)).collect();
            assert!(jumps.windows(2).all(|w| w[1] - w[0] == 3), "a lifetime other than 3 frames");
        }
        assert_eq!(jumps_a_frame[..3].iter().sum::<usize>(), 6, "every dot jumps once in three frames");
    }

    #[test]
    fn dots_on_limbs_lie_on_them_all_along() {
        let life = LimitedLife { frames: 4, synchronous: true, ..LimitedLife::default() };
        let shown = display(PointLightOptions { limited_life: Some(life), ..PointLightOptions::default() });
        let all = display(PointLightOptions::default());
        for t in 0..60 {
            for dot in 0..8 {
                let DotSource::Limb([a, b], fraction) = shown.sources[t * 8 + dot] else { panic!() };
                assert!((0.0..1.0).contains(&fraction) && b == a + 1);
                let (p, a, b) = (shown.at(t, dot).unwrap(), all.at(t, a).unwrap(), all.at(t, b).unwrap());
                assert!((p.distance(a) + p.distance(b) - a.distance(b)).abs() < 1e-9);
                let has_jumped = t > 0 && shown.sources[t * 8 + dot] != shown.sources[(t - 1) * 8 + dot];
                assert_eq!(has_jumped, t > 0 && t % 4 == 0);
            }
        }
    }

    #[test]
    fn noise_dots_copy_local_motions_or_drift_or_flicker() {
        let with = |kind| {
            let noise_dots = Some(NoiseDots { count: 26, kind, area_scale: 2.0 });
            display(PointLightOptions { noise_dots, ..PointLightOptions::default() })
        };
        let masked = with(NoiseKind::ScrambledWalker);
        assert_eq!(masked.dots, 39);
        for dot in 13..39 {
            let DotSource::Noise(Some(k)) = masked.sources[dot] else { panic!() };
            let (copy, original) = (trajectory(&masked, dot), trajectory(&masked, k));
            assert!((1..60).all(|t| (copy[t] - copy[0] - original[t] + original[0]).length() < 1e-9));
        }
        let drifting = with(NoiseKind::Linear { speed_px_s: 60.0 });
        let step = trajectory(&drifting, 20).windows(2).map(|w| w[0].distance(w[1])).fold(f64::MAX, f64::min);
        let interval_s = drifting.times_s[1];
        assert!((step - 60.0 * interval_s).abs() < 1e-9);
        let flicker = trajectory(&with(NoiseKind::Flicker), 20);
        assert!(flicker.windows(2).all(|w| w[0] != w[1]));
    }

    #[test]
    fn seeds_repeat_and_options_do_not_disturb_each_other() {
        let options = PointLightOptions {
            seed: 3,
            scrambles_position: true,
            noise_dots: Some(NoiseDots::default()),
            noise_sd_px: 1.0,
            ..PointLightOptions::default()
        };
        assert_eq!(display(options.clone()), display(options.clone()));
        assert_ne!(display(options.clone()), display(PointLightOptions { seed: 4, ..options.clone() }));
        let (noisy, clean) =
            (display(options.clone()), display(PointLightOptions { noise_sd_px: 0.0, ..options }));
        let differences: Vec<f64> = noisy
            .positions_px
            .iter()
            .zip(&clean.positions_px)
            .flat_map(|(a, b)| (*a - *b).to_array())
            .collect();
        let sd = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64).sqrt();
        assert!((sd - 1.0).abs() < 0.05, "{sd}");
    }

    #[test]
    fn unknown_points_are_unseen_dots() {
        let mut positions = cycle().positions().to_vec();
        positions[2] = DVec3::NAN;
        let motion = Motion::new(positions, cycle().names().to_vec(), cycle().times_s().to_vec()).unwrap();
        let noise_dots = Some(NoiseDots::default());
        let options =
            PointLightOptions { scrambles_position: true, noise_dots, ..PointLightOptions::default() };
        let shown = point_light_display(&motion, &options).unwrap();
        assert!(shown.at(0, 2).is_none() && shown.at(1, 2).is_some() && shown.at(0, 3).is_some());
        let nothing = motion.map(|_, _, _| DVec3::NAN);
        assert_eq!(point_light_display(&nothing, &options), Err(PointLightError::NothingSeen));
        let behind = View::Perspective(Box::new(Camera::level([64, 48], 1.0, 1.0, 5.0).unwrap()));
        let away = motion.map(|_, _, p| p - DVec3::Y * 20.0);
        let options = PointLightOptions { view: behind, ..options };
        assert_eq!(point_light_display(&away, &options), Err(PointLightError::NothingSeen));
    }

    #[test]
    fn bad_options_are_refused_with_their_values() {
        let refused =
            |options: PointLightOptions| point_light_display(&cycle(), &options).unwrap_err().to_string();
        let fresh = PointLightOptions::default;
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            assert!(refused(PointLightOptions { noise_sd_px: bad, ..fresh() }).contains("noise_sd_px"));
            let view = View::Orthographic { azimuth_rad: 0.0, elevation_rad: 0.0, px_per_m: bad };
            assert!(refused(PointLightOptions { view, ..fresh() }).contains("pixels per metre"));
            let noise_dots = Some(NoiseDots { area_scale: bad, ..NoiseDots::default() });
            assert!(refused(PointLightOptions { noise_dots, ..fresh() }).contains("area_scale"));
            let scrambles_phase = Some(PhaseScramble::Periodic { period_s: Some(bad) });
            refused(PointLightOptions { scrambles_phase, ..fresh() });
        }
        let scrambles_phase = Some(PhaseScramble::Shortened { max_shift_s: 1e9 });
        assert!(refused(PointLightOptions { scrambles_phase, ..fresh() }).contains("longer motion"));
        let life = LimitedLife { dots: 13, sites: LifeSites::Joints, ..LimitedLife::default() };
        assert!(
            refused(PointLightOptions { limited_life: Some(life), ..fresh() }).contains("nowhere to jump")
        );
        let life = LimitedLife { sites: LifeSites::Limbs(vec![[0, 99]]), ..LimitedLife::default() };
        assert!(refused(PointLightOptions { limited_life: Some(life), ..fresh() }).contains("99"));
        let noise_dots = Some(NoiseDots { count: usize::MAX, ..NoiseDots::default() });
        assert!(refused(PointLightOptions { noise_dots, ..fresh() }).contains("too many"));
        let one = Motion::new(vec![DVec3::ZERO], vec!["dot".into()], vec![0.0]).unwrap();
        let everything = PointLightOptions {
            scrambles_position: true,
            is_inverted: true,
            is_reversed: true,
            scrambles_phase: Some(PhaseScramble::Periodic { period_s: None }),
            noise_dots: Some(NoiseDots {
                kind: NoiseKind::Linear { speed_px_s: 9.0 },
                ..NoiseDots::default()
            }),
            ..fresh()
        };
        assert_eq!(point_light_display(&one, &everything).unwrap().dots, 41);
    }
}
