//! Point-light displays: a motion reduced to dots, with the control conditions of vision science.
//!
//! Sources: Johansson 1973 (lights at the joints); Cutting 1978 (the synthetic walker on the spot); Sumi 1984
//! (inversion); Cutting, Moore and Morrison 1988 (masks of scrambled walkers); Neri, Morrone and Burr 1998
//! and Beintema and Lappe 2002 (limited lifetime); van Boxtel and Lu 2013 (the usual set of options).
//!
//! The steps, in order: repetition of a cycle, time reversal, locomotion, phase scrambling (in space);
//! projection; position scrambling, inversion and mirroring (in the image); limited lifetime; noise dots;
//! pixel noise. Every step uses its own random stream of the seed, so that switching one step on does not
//! change the others. A [`DotPicture`] draws the dots at the scale of the display, whatever its extent.
//!
//! Limits: the body does not hide dots (Cutting's walker hid dots behind a limb); mark hidden points as NaN
//! in the motion.

mod course;
mod cycle;
mod dots;
mod figure;
mod options;
mod period;
mod picture;

pub use cycle::common_cycle;
pub use options::{
    CycleCut, CycleOptions, DisplayView, LifeSites, LimitedLife, Locomotion, NoiseDots, NoiseKind,
    PhaseScramble, PointLightError, PointLightOptions, PositionScramble, ScrambleAxes,
};
pub use picture::{DotPicture, DotShape};

use super::motion::PointMotion;
use super::random::Random;
use crate::OptionError;
use course::Course;
use cycle::closed_cycle;
use dots::{Layer, all_points, beside, limbs, limited, noise_layer};
use figure::Figure;
use glam::DVec2;
use std::f64::consts::FRAC_PI_2;

/// Largest number of dots over all frames.
const MOST_DOTS: usize = 50_000_000;

/// What a dot shows in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DotSource {
    /// A point of the motion, by index.
    Joint(usize),
    /// A point on a limb: its ends by index, and the fraction of the distance from the first end to the
    /// second.
    Limb([usize; 2], f64),
    /// A noise dot, with the index of the point whose trajectory it copies, if any.
    Noise(Option<usize>),
}

/// A point-light display. Dots keep their index over time, even when they jump.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLightDisplay {
    /// Times of the T frames, seconds.
    pub times_s: Vec<f64>,
    /// Number of dots N.
    pub dots: usize,
    /// Number of points of the motion, or of all motions of a display of several.
    pub points: usize,
    /// Pixel that belongs in the middle of a picture of the display: the middle of the figure before
    /// scrambling and noise, or of the camera's picture. Controls of the same motion have the same one.
    pub centre_px: DVec2,
    /// Duration of the cycle that the display repeats, seconds.
    pub period_s: Option<f64>,
    /// Pixel positions (u, v), frame after frame, T x N; NaN where the dot is not visible.
    pub positions_px: Vec<DVec2>,
    /// What each dot shows, T x N.
    pub sources: Vec<DotSource>,
}

impl PointLightDisplay {
    /// The position of a dot at a frame, pixels; `None` where it is not visible or does not exist.
    pub fn at(&self, frame: usize, dot: usize) -> Option<DVec2> {
        if dot >= self.dots {
            return None;
        }
        let index = frame.checked_mul(self.dots)?.checked_add(dot)?;
        self.positions_px.get(index).copied().filter(|p| p.is_finite())
    }

    /// The tracks of the dots, N tracks of T pixel positions, in the form of
    /// [`interpret_figure`](crate::interpret_figure).
    pub fn tracks(&self) -> Vec<Vec<DVec2>> {
        let track = |dot| self.positions_px.iter().skip(dot).step_by(self.dots).copied().collect();
        (0..self.dots).map(track).collect()
    }
}

/// Makes a point-light display of a motion.
///
/// # Errors
///
/// An option out of range, a motion that is too short for the phase scrambling, hips, limbs or joints that the
/// fixed pelvis or the limited lifetime needs but the motion lacks, too many dots, or a motion of which no point is visible.
pub fn point_light_display(
    motion: &PointMotion,
    options: &PointLightOptions,
) -> Result<PointLightDisplay, PointLightError> {
    checked(options)?;
    if options.locomotion == Locomotion::PelvisFixed && motion.hips().is_none() {
        let shown: Vec<&str> = motion.names().iter().take(5).map(String::as_str).collect();
        return Err(PointLightError::NoHips { names: shown.join(", ") });
    }
    let (course, period_s) = course_of(motion, options)?;
    check_dots(course.still.frames(), motion, options)?;
    let unscrambled = course.clone().shown(options.locomotion);
    let middle = Figure::seen(&unscrambled, &options.view)?.extent().middle();
    let centre_px = match &options.view {
        DisplayView::Perspective(camera) => 0.5 * (DVec2::from(camera.size.map(f64::from)) - 1.0),
        DisplayView::Orthographic { .. } => middle,
    };
    let motion = phase_scrambled(course, period_s, options)?.shown(options.locomotion);
    let mut figure = Figure::seen(&motion, &options.view)?;
    if let Some(scramble) = &options.scrambles_position {
        figure.scramble_positions(scramble, &mut stream(options.seed, 2));
    }
    figure.flip(middle, DVec2::new(sign(options.is_mirrored), sign(options.is_inverted)));
    let shown = match &options.limited_life {
        Some(life) => limited(&figure, life, limbs(&motion, life)?, &mut stream(options.seed, 3)),
        None => all_points(&figure),
    };
    let noise = options.noise_dots.map_or_else(Layer::default, |noise| {
        let life = options.limited_life.as_ref();
        let interval_s = motion.frame_interval_s();
        noise_layer(&figure, &noise, life, interval_s, &mut stream(options.seed, 4))
    });
    let (dots, positions_px, sources) = beside(shown, noise, motion.frames());
    let (times_s, points) = (motion.times_s().to_vec(), motion.points());
    let mut display = PointLightDisplay { times_s, dots, points, centre_px, period_s, positions_px, sources };
    add_noise(&mut display, options);
    Ok(display)
}

/// The displays of several actors as one; `offsets_px` are added to the positions of each. Indices of points
/// count on from one display to the next.
///
/// # Errors
///
/// No display, not one offset for each, offsets that are not finite, or displays with different times.
pub fn displays_together(
    displays: &[PointLightDisplay],
    offsets_px: &[DVec2],
) -> Result<PointLightDisplay, PointLightError> {
    let (count, offsets) = (displays.len(), offsets_px.len());
    let Some(first) = displays.first().filter(|_| count == offsets) else {
        return Err(PointLightError::Actors { displays: count, offsets });
    };
    let is_near = |x: &f64| x.abs() <= 1e6;
    if let Some(got) = offsets_px.iter().flat_map(|offset| offset.to_array()).find(|x| !is_near(x)) {
        let wanted = "at most 1,000,000 pixels";
        return Err(PointLightError::Option(OptionError { name: "offsets_px", wanted, got }));
    }
    let frames = first.times_s.len();
    if let Some(actor) = displays.iter().position(|other| other.times_s != first.times_s) {
        return Err(PointLightError::Clocks { actor, frames, others: displays[actor].times_s.len() });
    }
    let mut all = PointLightDisplay {
        dots: displays.iter().map(|display| display.dots).sum(),
        points: displays.iter().map(|display| display.points).sum(),
        centre_px: displays.iter().zip(offsets_px).map(|(one, by)| one.centre_px + *by).sum::<DVec2>()
            / count as f64,
        period_s: first.period_s.filter(|_| displays.iter().all(|other| other.period_s == first.period_s)),
        times_s: first.times_s.clone(),
        positions_px: Vec::new(),
        sources: Vec::new(),
    };
    for frame in 0..frames {
        let mut points = 0;
        for (display, offset) in displays.iter().zip(offsets_px) {
            let row = frame * display.dots..(frame + 1) * display.dots;
            all.positions_px.extend(display.positions_px[row.clone()].iter().map(|p| *p + *offset));
            all.sources.extend(display.sources[row].iter().map(|source| source.counted_from(points)));
            points += display.points;
        }
    }
    Ok(all)
}

impl DotSource {
    /// The same with indices of points counted from `points`.
    fn counted_from(self, points: usize) -> Self {
        match self {
            Self::Joint(k) => Self::Joint(k + points),
            Self::Limb([a, b], fraction) => Self::Limb([a + points, b + points], fraction),
            Self::Noise(copied) => Self::Noise(copied.map(|k| k + points)),
        }
    }
}

/// The motion, or its repeated cycle with its duration, in the direction of time and with the pelvis as asked
/// for.
fn course_of(
    motion: &PointMotion,
    options: &PointLightOptions,
) -> Result<(Course, Option<f64>), PointLightError> {
    let (repetitions, tempo) = match (&options.cycles, &options.scrambles_phase) {
        (Some(repeated), _) => (Some(repeated.cycles), repeated.tempo),
        (None, Some(PhaseScramble::Periodic)) => (None, 1.0),
        (None, _) => return Ok((prepared(Course::of(motion), options), None)),
    };
    let cycle = closed_cycle(motion, options.period_s, options.cycle_start_s, tempo)?;
    let frames = repetitions.map_or(motion.frames(), |cycles| cycle.frames.saturating_mul(cycles));
    check_dots(frames, motion, options)?;
    Ok((prepared(cycle.repeated(frames, motion), options), Some(cycle.period_s())))
}

fn prepared(course: Course, options: &PointLightOptions) -> Course {
    let course = if options.is_reversed { course.reversed() } else { course };
    if options.locomotion == Locomotion::PelvisFixed { course.fixed() } else { course }
}

fn phase_scrambled(
    course: Course,
    period_s: Option<f64>,
    options: &PointLightOptions,
) -> Result<Course, PointLightError> {
    let mut random = stream(options.seed, 1);
    match (options.scrambles_phase, period_s) {
        (Some(PhaseScramble::Periodic), Some(period_s)) => {
            let interval_s = course.still.frame_interval_s();
            let period = if interval_s > 0.0 { (period_s / interval_s).round() as usize } else { 1 };
            Ok(course.shifted_within(period.max(1), &mut random))
        }
        (Some(PhaseScramble::Shortened { max_shift_s }), _) => course.shortened(max_shift_s, &mut random),
        _ => Ok(course),
    }
}

fn add_noise(display: &mut PointLightDisplay, options: &PointLightOptions) {
    if options.noise_sd_px > 0.0 {
        let mut random = stream(options.seed, 5);
        for p in &mut display.positions_px {
            let [du, dv] = random.normal_pair();
            *p += DVec2::new(f64::from(du), f64::from(dv)) * options.noise_sd_px;
        }
    }
}

/// The random stream of one step.
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

fn checked(options: &PointLightOptions) -> Result<(), PointLightError> {
    let refuse = |parameter, wanted, value| {
        Err(PointLightError::Option(OptionError { name: parameter, wanted, got: value }))
    };
    if let DisplayView::Orthographic { azimuth_rad, elevation_rad, px_per_m } = options.view {
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
    if let Some(life) = &options.limited_life
        && (life.dots == 0 || life.frames == 0)
    {
        return refuse("dots and frames of a limited life", "at least 1", 0.0);
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
    }
    if let Some(limit_px) = options.scrambles_position.and_then(|scramble| scramble.limit_px)
        && !(limit_px > 0.0 && limit_px <= 1e6)
    {
        return refuse("scramble_limit_px", "positive and at most 1,000,000 pixels", limit_px);
    }
    if options.cycles.as_ref().is_some_and(|repeated| repeated.cycles == 0) {
        return refuse("cycles", "at least 1", 0.0);
    }
    let is_periodic = options.scrambles_phase == Some(PhaseScramble::Periodic);
    match options.period_s {
        Some(_) if options.cycles.is_none() && !is_periodic => Err(PointLightError::IdlePeriod),
        _ if options.cycle_start_s.is_some() && options.cycles.is_none() && !is_periodic => {
            Err(PointLightError::IdleStart)
        }
        _ => Ok(()),
    }
}

/// Refuses more dots than can be stored, and more than there are places for.
fn check_dots(
    frames: usize,
    motion: &PointMotion,
    options: &PointLightOptions,
) -> Result<(), PointLightError> {
    let points = motion.points();
    let mut dots = points;
    if let Some(life) = &options.limited_life {
        if life.sites == LifeSites::Joints && life.dots >= points {
            return Err(PointLightError::NoFreeJoint { dots: life.dots, points });
        }
        dots = life.dots;
    }
    let dots = dots.saturating_add(options.noise_dots.map_or(0, |noise| noise.count));
    if dots.max(points).saturating_mul(frames) > MOST_DOTS {
        return Err(PointLightError::TooMany { dots, frames });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
