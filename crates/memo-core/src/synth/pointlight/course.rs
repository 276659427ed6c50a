//! A motion as its positions on the spot and the constant velocity of the body, and what displays change in
//! both: the locomotion, the direction of time, and shifts of single points in time.

use super::{Locomotion, PointLightError, below};
use crate::OptionError;
use crate::synth::Random;
use crate::synth::motion::PointMotion;
use glam::DVec3;

/// p_k(t) = still_k(t) + velocity (t - t_mean).
#[derive(Debug, Clone)]
pub(super) struct Course {
    pub still: PointMotion,
    /// Horizontal, m/s.
    pub velocity: DVec3,
}

impl Course {
    /// The velocity is the slope of the least-squares line through the horizontal path of the body.
    pub fn of(motion: &PointMotion) -> Self {
        let (path, times) = (motion.pelvis_path(), motion.times_s());
        let mean = path.iter().sum::<DVec3>() / path.len() as f64;
        let mean_s = middle_s(motion);
        let spread: f64 = times.iter().map(|t| (t - mean_s).powi(2)).sum();
        let moment: DVec3 = times.iter().zip(&path).map(|(t, p)| (*p - mean) * (t - mean_s)).sum();
        let velocity = if spread > 0.0 { moment.with_z(0.0) / spread } else { DVec3::ZERO };
        Self { still: motion.map(|t, _, p| p - velocity * (times[t] - mean_s)), velocity }
    }

    /// The same motion backwards in time.
    pub fn reversed(self) -> Self {
        let last = self.still.frames() - 1;
        let still = self.still.map(|t, k, _| self.still.positions()[(last - t) * self.still.points() + k]);
        Self { still, velocity: -self.velocity }
    }

    /// With the midpoint of the hips fixed.
    pub fn fixed(self) -> Self {
        let path = self.still.pelvis_path();
        let mean = path.iter().sum::<DVec3>() / path.len() as f64;
        Self { still: self.still.map(|t, _, p| p - path[t] + mean), ..self }
    }

    /// Every point starts its trajectory on the spot at its own random frame of the `period` frames.
    pub fn shifted_within(self, period: usize, random: &mut Random) -> Self {
        let (frames, points) = (self.still.frames(), self.still.points());
        let shift: Vec<usize> = (0..points).map(|_| below(random, period)).collect();
        let still = self.still.map(|t, k, _| {
            let later = t + shift[k];
            let periods = if later < frames { 0 } else { (later - frames) / period + 1 };
            self.still.positions()[(later - period * periods) * points + k]
        });
        Self { still, ..self }
    }

    /// Every point's trajectory on the spot is delayed by its own random time; the motion becomes shorter.
    pub fn shortened(self, max_shift_s: f64, random: &mut Random) -> Result<Self, PointLightError> {
        let (frames, points) = (self.still.frames(), self.still.points());
        let (parameter, interval_s) = ("max_shift_s", self.still.frame_interval_s());
        OptionError::unless_at_least_0(parameter, max_shift_s)?;
        let available_s = interval_s * frames as f64;
        if max_shift_s > available_s * (1.0 + 1e-9) {
            return Err(PointLightError::TooShort { parameter, wanted_s: max_shift_s, available_s });
        }
        let longest = if interval_s > 0.0 { (max_shift_s / interval_s).round() as usize } else { 0 };
        let longest = longest.min(frames - 1);
        let shift: Vec<usize> = (0..points).map(|_| below(random, longest + 1)).collect();
        let later = |t: usize, k: usize| self.still.positions()[(t + shift[k]).min(frames - 1) * points + k];
        let still = self.still.map(|t, k, _| later(t, k)).truncated(frames - longest);
        Ok(Self { still, ..self })
    }

    /// The motion shown.
    pub fn shown(self, locomotion: Locomotion) -> PointMotion {
        let mean_s = middle_s(&self.still);
        match locomotion {
            Locomotion::Treadmill | Locomotion::PelvisFixed => self.still,
            Locomotion::Translating => {
                self.still.map(|t, _, p| p + self.velocity * (self.still.times_s()[t] - mean_s))
            }
        }
    }
}

fn middle_s(motion: &PointMotion) -> f64 {
    motion.times_s().iter().sum::<f64>() / motion.frames() as f64
}
