//! Dots: all points of the figure, dots of limited lifetime on it, and noise dots around it.

use super::figure::{Extent, Figure};
use super::{DotSource, LifeSites, LimitedLife, NoiseDots, NoiseKind, PointLightError, below};
use crate::synth::Random;
use crate::synth::motion::{PointMotion, limbs_of};
use glam::DVec2;
use std::f64::consts::TAU;

/// The dots of one kind in a display, T x dots.
#[derive(Debug, Default)]
pub(super) struct Layer {
    dots: usize,
    positions: Vec<DVec2>,
    sources: Vec<DotSource>,
}

/// A dot on every point.
pub(super) fn all_points(figure: &Figure) -> Layer {
    let sources = (0..figure.positions.len()).map(|i| DotSource::Joint(i % figure.points)).collect();
    Layer { dots: figure.points, positions: figure.positions.clone(), sources }
}

/// The limbs on which dots may be placed.
pub(super) fn limbs(motion: &PointMotion, life: &LimitedLife) -> Result<Vec<[usize; 2]>, PointLightError> {
    let LifeSites::Limbs(given) = &life.sites else { return Ok(Vec::new()) };
    let limbs = if given.is_empty() { limbs_of(motion.names()) } else { given.clone() };
    let points = motion.points();
    if let Some(&limb) = limbs.iter().find(|limb| limb.iter().any(|&end| end >= points)) {
        return Err(PointLightError::Limb { limb, points });
    }
    if limbs.is_empty() { Err(PointLightError::NoLimbs) } else { Ok(limbs) }
}

/// The ages of the dots at frame 0; a dot jumps every `frames` frames of age.
fn first_ages(dots: usize, life: &LimitedLife, random: &mut Random) -> Vec<usize> {
    (0..dots).map(|_| if life.synchronous { 0 } else { below(random, life.frames) }).collect()
}

pub(super) fn limited(
    figure: &Figure,
    life: &LimitedLife,
    limbs: Vec<[usize; 2]>,
    random: &mut Random,
) -> Layer {
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

/// A joint without a dot; this excludes the dot's own joint.
fn free_joint(taken: &[DotSource], points: usize, random: &mut Random) -> DotSource {
    let free: Vec<usize> = (0..points).filter(|&k| !taken.contains(&DotSource::Joint(k))).collect();
    DotSource::Joint(free[below(random, free.len())])
}

pub(super) fn noise_layer(
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
            NoiseKind::ScrambledWalker => body.shifts_of(&trajectories[point]).draw(random),
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
    /// Shift of its trajectory, or its initial position.
    place: DVec2,
    point: usize,
    since: usize,
    direction_rad: f64,
}

impl NoiseDot {
    /// Its position, and the point whose trajectory it copies.
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

/// A point that left the area, moved to the opposite side.
fn wrapped(point: DVec2, area: &Extent) -> DVec2 {
    let side = area.high - area.low;
    let wrap = |x: f64, low: f64, side: f64| if side > 0.0 { low + (x - low).rem_euclid(side) } else { low };
    DVec2::new(wrap(point.x, area.low.x, side.x), wrap(point.y, area.low.y, side.y))
}

/// The dots of two layers beside each other: their number, positions and sources.
pub(super) fn beside(first: Layer, second: Layer, frames: usize) -> (usize, Vec<DVec2>, Vec<DotSource>) {
    let dots = first.dots + second.dots;
    let mut positions = Vec::with_capacity(dots * frames);
    let mut sources = Vec::with_capacity(dots * frames);
    for frame in 0..frames {
        for layer in [&first, &second] {
            let row = frame * layer.dots..(frame + 1) * layer.dots;
            positions.extend_from_slice(&layer.positions[row.clone()]);
            sources.extend_from_slice(&layer.sources[row]);
        }
    }
    (dots, positions, sources)
}
