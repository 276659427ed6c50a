//! Changes to the motion in space before projection: removal of the locomotion, and shifts in time.

use super::{Locomotion, PhaseScramble, PointLightError, below};
use crate::option_error::OptionError;
use crate::synth::Random;
use crate::synth::motion::PointMotion;
use glam::DVec3;

/// Removes the locomotion and keeps the position of the middle of the motion.
pub(super) fn without_advance(motion: PointMotion, locomotion: Locomotion) -> PointMotion {
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

/// p_k(t) = c(t) + r_k(t + s_k) with the horizontal path c of the body, r_k = p_k - c and one shift s_k per
/// point.
pub(super) fn phase_scrambled(
    motion: &PointMotion,
    scramble: &PhaseScramble,
    random: &mut Random,
) -> Result<PointMotion, PointLightError> {
    let (frames, interval_s) = (motion.frames(), motion.frame_interval_s());
    let in_frames = |parameter, seconds: f64| {
        if !(seconds >= 0.0 && seconds.is_finite()) {
            let wanted = "a duration in seconds";
            return Err(PointLightError::Option(OptionError { name: parameter, wanted, got: seconds }));
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
