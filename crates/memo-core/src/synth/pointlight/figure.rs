//! The points of a motion in the image, and the areas they cover.

use super::{DisplayView, DotSource, PointLightError, PositionScramble, ScrambleAxes};
use crate::synth::Random;
use crate::synth::motion::PointMotion;
use glam::{DVec2, DVec3};

/// A rectangle in the image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub low: DVec2,
    pub high: DVec2,
}

impl Extent {
    pub const NOTHING: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    /// The bounding rectangle of all finite points.
    pub fn of(points: impl Iterator<Item = DVec2>) -> Self {
        points
            .filter(|p| p.is_finite())
            .fold(Self::NOTHING, |e, p| Self { low: e.low.min(p), high: e.high.max(p) })
    }

    pub fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    pub fn middle(&self) -> DVec2 {
        0.5 * (self.low + self.high)
    }

    pub fn scaled(&self, factor: f64) -> Self {
        let half = 0.5 * factor * (self.high - self.low);
        Self { low: self.middle() - half, high: self.middle() + half }
    }

    pub fn draw(&self, random: &mut Random) -> DVec2 {
        let (x, y) = (random.uniform(0.0, 1.0), random.uniform(0.0, 1.0));
        self.low + DVec2::new(x, y) * (self.high - self.low)
    }

    /// The shifts that keep `part` within this extent, if it fits.
    pub fn shifts_of(&self, part: &Self) -> Self {
        let (least, most) = (self.low - part.low, self.high - part.high);
        Self { low: least.min(most), high: least.max(most) }
    }
}

/// The points of a motion in the image, with the position of the body.
#[derive(Debug, Clone)]
pub(super) struct Figure {
    pub points: usize,
    /// T x K, NaN where not visible.
    pub positions: Vec<DVec2>,
    /// Image of the body position, T.
    pub path: Vec<DVec2>,
}

impl Figure {
    pub fn seen(motion: &PointMotion, view: &DisplayView) -> Result<Self, PointLightError> {
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

    pub fn at(&self, frame: usize, point: usize) -> DVec2 {
        self.positions[frame * self.points + point]
    }

    /// Position of a point relative to the body.
    pub fn against_body(&self, frame: usize, point: usize) -> DVec2 {
        self.at(frame, point) - self.path[frame]
    }

    pub fn trajectory_extent(&self, point: usize) -> Extent {
        Extent::of((0..self.path.len()).map(|t| self.against_body(t, point)))
    }

    pub fn body_extent(&self) -> Extent {
        Extent::of((0..self.positions.len()).map(|i| self.positions[i] - self.path[i / self.points]))
    }

    /// The rectangle that the figure covers over all frames.
    pub fn extent(&self) -> Extent {
        Extent::of(self.positions.iter().copied())
    }

    pub fn scramble_positions(&mut self, scramble: &PositionScramble, random: &mut Random) {
        let body = self.body_extent();
        let limit = DVec2::splat(scramble.limit_px.unwrap_or(f64::INFINITY));
        let free = match scramble.axes {
            ScrambleAxes::Both => DVec2::ONE,
            ScrambleAxes::Horizontal => DVec2::X,
            ScrambleAxes::Vertical => DVec2::Y,
        };
        for k in 0..self.points {
            let own = self.trajectory_extent(k);
            if own.is_empty() {
                continue;
            }
            let Extent { low, high } = body.shifts_of(&own);
            let allowed = Extent { low: low.clamp(-limit, limit), high: high.clamp(-limit, limit) };
            let shift = allowed.draw(random) * free;
            self.positions.iter_mut().skip(k).step_by(self.points).for_each(|p| *p += shift);
        }
    }

    /// Mirrors about a point, along each axis where `sign` is -1.
    pub fn flip(&mut self, middle: DVec2, sign: DVec2) {
        for p in self.positions.iter_mut().chain(&mut self.path) {
            *p = middle + (*p - middle) * sign;
        }
    }

    pub fn place(&self, frame: usize, source: DotSource) -> DVec2 {
        match source {
            DotSource::Joint(k) => self.at(frame, k),
            DotSource::Limb([a, b], fraction) => self.at(frame, a).lerp(self.at(frame, b), fraction),
            DotSource::Noise(_) => DVec2::NAN,
        }
    }
}
