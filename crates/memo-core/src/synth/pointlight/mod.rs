//! Point-light displays: a motion reduced to dots, with the control conditions of vision science.
//!
//! Sources: Johansson 1973 (lights at the joints); Cutting 1978 (the synthetic walker on the spot); Sumi 1984
//! (inversion); Cutting, Moore and Morrison 1988 (masks of scrambled walkers); Neri, Morrone and Burr 1998
//! and Beintema and Lappe 2002 (limited lifetime); van Boxtel and Lu 2013 (the usual set of options).
//!
//! The steps, in order: time reversal, locomotion, phase scrambling (in space); projection; position
//! scrambling, inversion and mirroring (in the image); limited lifetime; noise dots; pixel noise. Every step
//! uses its own random stream of the seed, so that switching one step on does not change the others.
//!
//! Limits: the body does not hide dots (Cutting's walker hid dots behind a limb); mark hidden points as NaN
//! in the motion. This module does not render images.

mod dots;
mod figure;
mod motion;
mod options;

pub use options::{
    DisplayView, LifeSites, LimitedLife, Locomotion, NoiseDots, NoiseKind, PhaseScramble, PointLightError,
    PointLightOptions,
};

use super::motion::PointMotion;
use super::random::Random;
use crate::option_error::OptionError;
use dots::{Layer, all_points, beside, limbs, limited, noise_layer};
use figure::Figure;
use glam::DVec2;
use motion::{phase_scrambled, without_advance};
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
    /// [`interpret_figure`](crate::planar::interpret_figure).
    pub fn tracks(&self) -> Vec<Vec<DVec2>> {
        let track = |dot| self.positions_px.iter().skip(dot).step_by(self.dots).copied().collect();
        (0..self.dots).map(track).collect()
    }
}

/// Makes a point-light display of a motion.
///
/// # Errors
///
/// An option out of range, a motion that is too short for the phase scrambling, limbs or joints that the
/// limited lifetime needs but the motion lacks, too many dots, or a motion of which no point is visible.
pub fn point_light_display(
    motion: &PointMotion,
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
        None => all_points(&figure),
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

fn checked(motion: &PointMotion, options: &PointLightOptions) -> Result<(), PointLightError> {
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

#[cfg(test)]
mod tests;
