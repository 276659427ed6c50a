//! Soft prior of the motion: means and standard deviations of angles and accelerations.
//!
//! The hard limits of the interpretation tree exclude what is impossible. This prior describes what is usual, for
//! choosing among the possible postures. Angles are relative to upright axes: x the moving direction, y down, z
//! to the left.
//!
//! Chosen on four walks of motion capture (two Plug-in-Gait walkers of BTKData, CMU 02_01 and 12_01). The spreads
//! are two to three times those of one walker, to allow for differences between people.

use glam::DVec3;

use crate::estimate::smooth::Measured;
use crate::model::skeleton::Joint;

/// Usual value and spread of an angle, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Soft {
    /// Usual value.
    pub mean_rad: f64,
    /// Spread over people and time: the standard deviation of a normal density, or the scale of a heavy-tailed one.
    pub sd_rad: f64,
    /// True if values far from the usual one are not rare ([`heavy_tailed`]).
    pub is_heavy_tailed: bool,
}

/// A squared deviation is capped at this many squared standard deviations, to limit the effect of outliers.
const CAP: f64 = 25.0;

/// A squared deviation in standard deviations, capped; 0 if it is not known (NaN).
pub fn chi_sq(deviation: f64) -> f64 {
    capped(deviation * deviation)
}

/// The same for a value that is already squared.
pub fn capped(square: f64) -> f64 {
    if square.is_nan() { 0.0 } else { square.min(CAP) }
}

/// Degrees of freedom of the heavy-tailed density.
const FREEDOM: f64 = 2.0;

/// Twice the cost of a deviation from Student's density of 2 degrees of freedom, in units of its scale; 0 for NaN.
/// Arms mostly hang and now and then reach up: far values cost only the logarithm of their distance.
///
/// ```text
/// -2 ln p = (ν + 1) ln(1 + z²/ν) + constant,   ν = 2
/// ```
pub fn heavy_tailed(deviation: f64) -> f64 {
    let cost = (FREEDOM + 1.0) * (deviation * deviation / FREEDOM).ln_1p();
    if cost.is_nan() { 0.0 } else { cost }
}

impl Soft {
    /// No prior: any value costs nothing.
    pub const FREE: Self = Self { mean_rad: 0.0, sd_rad: f64::INFINITY, is_heavy_tailed: false };

    /// The same from degrees.
    pub fn degrees(mean_deg: f64, sd_deg: f64) -> Self {
        Self { mean_rad: mean_deg.to_radians(), sd_rad: sd_deg.to_radians(), is_heavy_tailed: false }
    }

    /// A heavy-tailed density of a scale in degrees.
    pub fn mostly(usual_deg: f64, scale_deg: f64) -> Self {
        Self { is_heavy_tailed: true, ..Self::degrees(usual_deg, scale_deg) }
    }

    /// Twice the cost of a value measured with a standard deviation: its squared deviation, or [`heavy_tailed`]; 0
    /// for NaN.
    pub fn cost(&self, value_rad: f64, noise_rad: f64) -> f64 {
        let deviation = (value_rad - self.mean_rad) / self.sd_rad.hypot(noise_rad);
        if self.is_heavy_tailed { heavy_tailed(deviation) } else { chi_sq(deviation) }
    }

    /// The same only for values below the mean: the mean is a limit.
    pub fn cost_beyond(&self, value_rad: f64, noise_rad: f64) -> f64 {
        self.cost(value_rad.min(self.mean_rad), noise_rad)
    }
}

/// Usual lean of the trunk from the vertical, forward positive, with its spreads to both sides, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lean {
    /// Usual lean.
    pub mean_rad: f64,
    /// Standard deviation of smaller leans.
    pub backward_sd_rad: f64,
    /// Standard deviation of larger leans.
    pub forward_sd_rad: f64,
}

impl Lean {
    /// From degrees.
    pub fn degrees(mean_deg: f64, backward_sd_deg: f64, forward_sd_deg: f64) -> Self {
        let [mean_rad, backward_sd_rad, forward_sd_rad] =
            [mean_deg, backward_sd_deg, forward_sd_deg].map(f64::to_radians);
        Self { mean_rad, backward_sd_rad, forward_sd_rad }
    }

    /// The spread on the side of a lean.
    pub fn sd_rad(&self, lean_rad: f64) -> f64 {
        if lean_rad < self.mean_rad { self.backward_sd_rad } else { self.forward_sd_rad }
    }

    /// Twice the cost of a lean measured with a standard deviation.
    pub fn cost(&self, lean_rad: f64, noise_rad: f64) -> f64 {
        chi_sq((lean_rad - self.mean_rad) / self.sd_rad(lean_rad).hypot(noise_rad))
    }
}

/// Balance of a person who stands on one foot or on both, however bent: the body's centre is above the feet.
///
/// The centre is taken as the middle between neck and hips. In five motions of CMU subject 02 (jumping, punching,
/// bending, ...) it is 6 ± 5 cm in front of the middle of the ankles, and the neck 8 ± 11 cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// How far the centre is in front of the ankles, metres.
    pub ahead_m: f64,
    /// Standard deviation of the horizontal distance, metres.
    pub sd_m: f64,
}

impl Balance {
    /// The place whose vertical goes through the ankles, given neck and middle of the hips and the horizontal unit
    /// vector to the front.
    pub fn above_ankles(&self, neck: DVec3, hips: DVec3, front: DVec3) -> DVec3 {
        neck.midpoint(hips) - self.ahead_m * front
    }
}

/// Prior of a limb's segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentPrior {
    /// Angle from the vertical in the moving direction, forward positive.
    pub swing: Soft,
    /// Angle out of the vertical plane of the moving direction, outward positive, at swing 0.
    pub outward: Soft,
    /// Outward angle per radian of swing: arms that swing forward move in front of the body.
    pub outward_per_swing: f64,
    /// Acceleration of the segment's end relative to its start, m/s².
    pub acceleration_mps2: f64,
    /// Relative standard deviation of the segment's apparent length: the centres of joints are not exact pivots.
    pub length_sd: f64,
}

/// Swings over the gait cycle: how far those of a person are from the average curves of walking
/// ([`Gait::dense`](crate::model::gait::Gait::dense)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CyclePrior {
    /// Standard deviations of the swings of upper arm, forearm, thigh and shank from the curves, radians.
    pub sd_rad: [f64; 4],
    /// Cost of a limb that does not follow the curves at all, nats.
    pub apart_nats: f64,
}

/// Prior of a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPrior {
    /// Upper arm, forearm, thigh, shank.
    pub segments: [SegmentPrior; 4],
    /// Minimum flexion of elbow and knee, with the softness of the limit.
    pub least_bend: [Soft; 2],
    /// Swings over the gait cycle; `None` if the motion has none.
    pub cycle: Option<CyclePrior>,
    /// Angle of the trunk from the vertical, forward positive.
    pub trunk_lean: Lean,
    /// Balance above the feet; `None` in walking, where a person falls from foot to foot.
    pub balance: Option<Balance>,
    /// Angle of the trunk from the vertical, to the left positive.
    pub trunk_roll: Soft,
    /// Rotation of the shoulder line about the vertical.
    pub shoulder_turn: Soft,
    /// Rotation of the hip line about the vertical.
    pub hip_turn: Soft,
    /// Standard deviation of the neck's forward position relative to that from the lengths of the torso, metres.
    pub neck_forward_sd_m: f64,
    /// Standard deviation of the distances within the trunk, metres.
    pub rigid_m: f64,
    /// Relative standard deviation of the apparent lengths of the trunk's segments.
    pub trunk_length_sd: f64,
    /// Cost of a torso that faces opposite to the hips.
    pub hips_against_torso: f64,
    /// Acceleration of a joint of the trunk relative to its starting joint, m/s².
    pub trunk_acceleration_mps2: f64,
    /// Standard deviation of the height of the lower ankle above that of a foot on the ground, metres: lifted
    /// heel and error of the neck's distance.
    pub support_sd_m: f64,
    /// Factor by which differences of cost are overconfident; margins are divided by it. Measured as the share of
    /// mirrored segments by margin, on four walks in three views at 1 and 3 px.
    pub overconfidence: f64,
    /// Time after which another frame is independent evidence, seconds.
    pub independence_s: f64,
    /// Probability that a limb's segment is mirrored.
    pub mirrored: MirrorOdds,
}

/// Probability that a limb's segment is mirrored in depth, from two things: how far it extends along its ray, and
/// how much more a reading costs that mirrors it. Short extents are exceeded by noise; a margin is only as good
/// as the prior of the motion.
///
/// Logistic regression on motion capture at 0, 2 and 5 px of noise (`python tests/score_postures.py` prints the
/// rates of mirrored segments); for any motion also with points that are off by the same 3.5 px (standard deviation)
/// in all frames, as those of detectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirrorOdds {
    /// Log odds without extent and margin.
    pub base: f64,
    /// Decrease of the log odds per metre of extent.
    pub per_m: f64,
    /// Decrease of the log odds per nat of margin.
    pub per_nat: f64,
}

/// Margins beyond this are as sure as this, nats.
const MOST_MARGIN_NATS: f64 = 8.0;

impl MirrorOdds {
    /// The probability for an extent along the ray and a margin, 0 to 0.5; NaN for NaN.
    pub fn probability(&self, extent_m: f64, margin_nats: f64) -> f64 {
        let margin = if margin_nats > MOST_MARGIN_NATS { MOST_MARGIN_NATS } else { margin_nats };
        let against = self.per_m * extent_m.abs() + self.per_nat * margin - self.base;
        1.0 / (1.0 + if against < 0.0 { 0.0 } else { against }.exp())
    }
}

/// Standard deviation of a joint's acceleration over 1/30 s, m/s²: trunk, elbows and knees, wrists and ankles.
pub(crate) fn acceleration_mps2(joint: Joint) -> f64 {
    match joint.class() {
        Some('c') if !matches!(joint, Joint::RightWrist | Joint::LeftWrist) => 10.0,
        Some('c' | 'd') => 20.0,
        _ if matches!(joint, Joint::RightElbow | Joint::LeftElbow) => 10.0,
        _ => 5.0,
    }
}

impl MotionPrior {
    /// Prior of a walking person.
    pub fn walking() -> Self {
        let segment =
            |swing: (f64, f64), outward: (f64, f64), outward_per_swing, acceleration_mps2, length_sd| {
                SegmentPrior {
                    swing: Soft::degrees(swing.0, swing.1),
                    outward: Soft::degrees(outward.0, outward.1),
                    outward_per_swing,
                    acceleration_mps2,
                    length_sd,
                }
            };
        Self {
            segments: [
                segment((-9.0, 20.0), (10.0, 9.0), 0.25, 4.0, 0.005),
                segment((25.0, 45.0), (4.0, 7.0), -0.15, 6.0, 0.005),
                segment((5.0, 22.0), (-1.0, 6.0), 0.0, 8.0, 0.025),
                segment((-15.0, 30.0), (-2.0, 5.0), 0.0, 15.0, 0.025),
            ],
            least_bend: [Soft::degrees(5.0, 8.0), Soft::degrees(0.0, 8.0)],
            cycle: Some(CyclePrior {
                sd_rad: [15.0, 20.0, 10.0, 12.0].map(f64::to_radians),
                apart_nats: 3.0,
            }),
            trunk_lean: Lean::degrees(0.0, 8.0, 8.0),
            balance: None,
            trunk_roll: Soft::degrees(0.0, 4.0),
            shoulder_turn: Soft::degrees(0.0, 8.0),
            hip_turn: Soft::degrees(0.0, 10.0),
            neck_forward_sd_m: 0.02,
            rigid_m: 0.01,
            trunk_length_sd: 0.025,
            hips_against_torso: 25.0,
            trunk_acceleration_mps2: 3.0,
            support_sd_m: 0.10,
            overconfidence: 2.0,
            independence_s: 0.08,
            mirrored: MirrorOdds { base: -0.5, per_m: 13.9, per_nat: 0.33 },
        }
    }

    /// Prior for any motion: how people mostly hold their limbs, balance, and inertia.
    ///
    /// Limbs mostly hang, shanks slope back a little, and any of them may be anywhere now and then: heavy-tailed
    /// densities about the medians of ten motions of CMU subjects 01, 02 and 03 (jumps, punches, bending, fencing, a
    /// playground, ...). Scales 1.4 times as wide change the mean error on these by less than 0.1 cm. The trunk bends
    /// farther forwards than backwards. Use it without a moving direction, so that swings are relative to the trunk.
    pub fn any() -> Self {
        let segment = |swing: Soft, outward: Soft, acceleration_mps2| SegmentPrior {
            swing,
            outward,
            outward_per_swing: 0.0,
            acceleration_mps2,
            length_sd: 0.025,
        };
        Self {
            segments: [
                segment(Soft::mostly(-5.0, 25.0), Soft::mostly(8.0, 12.0), 8.0),
                segment(Soft::mostly(55.0, 50.0), Soft::mostly(2.0, 14.0), 15.0),
                segment(Soft::mostly(15.0, 15.0), Soft::mostly(2.0, 8.0), 8.0),
                segment(Soft::mostly(-21.0, 14.0), Soft::mostly(-1.0, 6.0), 15.0),
            ],
            least_bend: [Soft::degrees(0.0, 15.0), Soft::degrees(0.0, 10.0)],
            cycle: None,
            trunk_lean: Lean::degrees(5.0, 20.0, 30.0),
            balance: Some(Balance { ahead_m: 0.07, sd_m: 0.10 }),
            trunk_roll: Soft::degrees(0.0, 15.0),
            shoulder_turn: Soft::FREE,
            hip_turn: Soft::degrees(0.0, 20.0),
            overconfidence: 12.0,
            mirrored: MirrorOdds { base: -0.7, per_m: 4.3, per_nat: 0.38 },
            ..Self::walking()
        }
    }

    /// Twice the cost of the swings of inner and outer segment of a limb (pair 0 is the arms), with those that are
    /// usual at the phase of the gait cycle: the smaller of following them and of swinging anyhow.
    pub(crate) fn swing_cost(&self, pair: usize, swings: [Measured; 2], usual: Option<[f64; 2]>) -> f64 {
        let mut anyhow = 0.0;
        let mut following = 0.0;
        for (i, Measured { value, sd }) in swings.into_iter().enumerate() {
            let soft = self.segments[2 * pair + i].swing;
            anyhow += soft.cost(value, sd);
            if let (Some(cycle), Some(usual)) = (self.cycle, usual)
                && !value.is_nan()
            {
                let own = Soft { mean_rad: usual[i], sd_rad: cycle.sd_rad[2 * pair + i], ..soft };
                following += own.cost(value, sd) + 2.0 * (own.sd_rad.hypot(sd) / soft.sd_rad.hypot(sd)).ln();
            }
        }
        match self.cycle.filter(|_| usual.is_some()) {
            Some(cycle) => following.min(anyhow + 2.0 * cycle.apart_nats),
            None => anyhow,
        }
    }

    /// Relative standard deviation of the apparent length of the segment that ends at a joint.
    pub(crate) fn length_sd(&self, end: Joint) -> f64 {
        match end {
            Joint::RightElbow | Joint::LeftElbow => self.segments[0].length_sd,
            Joint::RightWrist | Joint::LeftWrist => self.segments[1].length_sd,
            Joint::RightKnee | Joint::LeftKnee => self.segments[2].length_sd,
            Joint::RightAnkle | Joint::LeftAnkle => self.segments[3].length_sd,
            _ => self.trunk_length_sd,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::gait::{Gait, GaitStyle, SideAngles};

    #[test]
    fn costs_are_squared_deviations_with_their_noise_and_end_somewhere() {
        let soft = Soft::degrees(10.0, 3.0);
        let deg = |angle: f64| angle.to_radians();
        assert!((soft.cost(deg(16.0), 0.0) - 4.0).abs() < 1e-12);
        // Spread and noise together are 5 degrees.
        assert!((soft.cost(deg(20.0), deg(4.0)) - 4.0).abs() < 1e-12);
        assert!((soft.cost(deg(90.0), 0.0) - 25.0).abs() < 1e-12);
        assert_eq!(soft.cost(f64::NAN, 0.0), 0.0);
        assert_eq!(Soft::FREE.cost(deg(90.0), 0.0), 0.0);
        // Only values below the limit cost.
        assert!((soft.cost_beyond(deg(7.0), 0.0) - 1.0).abs() < 1e-12);
        assert_eq!(soft.cost_beyond(deg(30.0), 0.0), 0.0);
        assert_eq!([chi_sq(-2.0), chi_sq(9.0), capped(7.0), capped(f64::NAN)], [4.0, 25.0, 7.0, 0.0]);
    }

    /// Student's density of two degrees of freedom is (2 + z²)^(-3/2).
    #[test]
    fn far_values_of_a_heavy_tailed_density_cost_their_logarithm() {
        for deviation in [0.0_f64, 0.4, -1.0, 3.0, 40.0] {
            let density = |z: f64| (2.0 + z * z).powf(-1.5);
            let expected = -2.0 * (density(deviation) / density(0.0)).ln();
            assert!((heavy_tailed(deviation) - expected).abs() < 1e-12, "{deviation}");
        }
        assert_eq!(heavy_tailed(f64::NAN), 0.0);
        let soft = Soft::mostly(10.0, 4.0);
        let noise_rad = 3f64.to_radians();
        assert!((soft.cost(20f64.to_radians(), noise_rad) - heavy_tailed(2.0)).abs() < 1e-12);
        assert!((Soft::degrees(10.0, 4.0).cost(18f64.to_radians(), 0.0) - 4.0).abs() < 1e-12);
    }

    /// A trunk leans forwards by one spread and backwards by two: twice the cost is 1 and 4.
    #[test]
    fn leans_to_the_front_and_to_the_back_have_their_own_spread() {
        let lean = Lean::degrees(5.0, 10.0, 40.0);
        let cost = |deg: f64, noise: f64| lean.cost(deg.to_radians(), noise);
        assert!((cost(45.0, 0.0) - 1.0).abs() < 1e-12 && (cost(-15.0, 0.0) - 4.0).abs() < 1e-12);
        assert!((cost(-15.0, 24f64.to_radians()) - (20.0 / 26.0_f64).powi(2)).abs() < 1e-12);
    }

    /// Neck 30 cm in front of the hips, 60 cm above them: the middle is 15 cm in front, the ankles 7 cm behind it.
    #[test]
    fn a_bent_body_is_balanced_about_its_middle() {
        let balance = Balance { ahead_m: 0.07, sd_m: 0.1 };
        let (neck, hips) = (DVec3::new(0.3, 0.0, 1.4), DVec3::new(0.0, 0.0, 0.8));
        let above = balance.above_ankles(neck, hips, DVec3::X);
        assert!((above - DVec3::new(0.08, 0.0, 1.1)).length() < 1e-12, "{above}");
    }

    /// Swings near the curves cost their deviation, with the density of the narrower curve; others as much as anywhere
    /// and what not following costs. Without curves, or in a motion that has none, only the usual range counts.
    #[test]
    fn a_limb_follows_the_cycle_or_swings_anyhow() {
        let prior = MotionPrior::walking();
        let cycle = prior.cycle.unwrap();
        let [thigh, shank] = [prior.segments[2].swing, prior.segments[3].swing];
        let swings = |thigh_deg: f64, shank_deg: f64| {
            [thigh_deg, shank_deg].map(|deg| Measured { value: deg.to_radians(), sd: 0.0 })
        };
        let usual = [25.0, 20.0].map(f64::to_radians);
        let cost = |swings| prior.swing_cost(1, swings, Some(usual));
        let narrower = 2.0 * ((cycle.sd_rad[2] / thigh.sd_rad).ln() + (cycle.sd_rad[3] / shank.sd_rad).ln());
        assert!((cost(swings(25.0, 20.0)) - narrower).abs() < 1e-12);
        // One standard deviation of the thigh, two of the shank.
        assert!((cost(swings(35.0, -4.0)) - (1.0 + 4.0 + narrower)).abs() < 1e-12);
        // The mirror image of a thigh is far from the curve.
        let apart = thigh.cost(-25f64.to_radians(), 0.0) + shank.cost(-20f64.to_radians(), 0.0);
        assert!((cost(swings(-25.0, -20.0)) - (apart + 2.0 * cycle.apart_nats)).abs() < 1e-12);
        assert!((prior.swing_cost(1, swings(-25.0, -20.0), None) - apart).abs() < 1e-12);
        let any = MotionPrior::any();
        let far = swings(-25.0, -20.0);
        assert_eq!(any.swing_cost(1, far, Some(usual)), any.swing_cost(1, far, None));
        // What is not seen costs nothing but that.
        let unseen = [Measured { value: f64::NAN, sd: 0.0 }; 2];
        assert_eq!(cost(unseen), 0.0);
    }

    /// Over the measured cycle of [`Gait`] each segment swings about the prior's mean, well within its spread.
    #[test]
    fn a_measured_walk_is_usual() {
        let prior = MotionPrior::walking();
        let phases =
            (0..100).map(|i| Gait::dense().posture(f64::from(i) / 100.0, &GaitStyle::default()).right);
        let angles: Vec<SideAngles> = phases.collect();
        let swings: [fn(&SideAngles) -> f64; 4] =
            [|a| a.shoulder, |a| a.shoulder + a.elbow, |a| a.hip, |a| a.hip - a.knee];
        for (segment, swing) in prior.segments.iter().zip(swings) {
            let mean = angles.iter().map(swing).sum::<f64>() / 100.0;
            let variance = angles.iter().map(|a| (swing(a) - mean).powi(2)).sum::<f64>() / 100.0;
            let off_deg = (segment.swing.mean_rad - mean).to_degrees();
            assert!(off_deg.abs() < 6.0, "{off_deg}");
            let ratio = segment.swing.sd_rad / variance.sqrt();
            assert!((1.0..4.5).contains(&ratio), "{ratio}");
        }
        // Arms hang away from the body, and come inwards in front of it.
        let [upper_arm, forearm, ..] = prior.segments;
        assert!(upper_arm.outward.mean_rad > 0.0 && upper_arm.outward_per_swing > 0.0);
        assert!(forearm.outward_per_swing < 0.0);
    }

    /// Log odds of 0.5 - 10 · 0.1 - 0.25 · 2 = -1; a limit at even odds and for large margins.
    #[test]
    fn long_extents_and_large_margins_are_surer() {
        let odds = MirrorOdds { base: 0.5, per_m: 10.0, per_nat: 0.25 };
        for extent_m in [0.1, -0.1] {
            assert!((odds.probability(extent_m, 2.0) - 1.0 / (1.0 + 1f64.exp())).abs() < 1e-12);
        }
        assert_eq!(odds.probability(0.0, 0.0), 0.5);
        assert_eq!(odds.probability(0.2, f64::INFINITY), odds.probability(0.2, 8.0));
        assert!(odds.probability(0.2, f64::INFINITY) > 0.0);
        assert!(odds.probability(f64::NAN, 1.0).is_nan() && odds.probability(0.1, f64::NAN).is_nan());
    }

    #[test]
    fn a_walker_s_trunk_faces_ahead_and_anybody_s_need_not() {
        let [walking, any] = [MotionPrior::walking(), MotionPrior::any()];
        let aside = 60f64.to_radians();
        for soft in [walking.shoulder_turn, walking.hip_turn, walking.trunk_roll] {
            assert_eq!(soft.cost(aside, 0.0), CAP);
            assert_eq!(soft.mean_rad, 0.0);
        }
        assert_eq!(walking.trunk_lean.cost(aside, 0.0), CAP);
        assert_eq!(walking.trunk_lean.cost(-aside, 0.0), CAP);
        assert_eq!(any.shoulder_turn.cost(aside, 0.0), 0.0);
        assert!(any.cycle.is_none());
        assert!(any.trunk_lean.cost(0.3, 0.0) < walking.trunk_lean.cost(0.3, 0.0));
        assert!(any.balance.is_some() && walking.balance.is_none());
    }

    #[test]
    fn lengths_are_as_sure_as_those_of_their_segment() {
        let mut prior = MotionPrior::walking();
        for (segment, length_sd) in prior.segments.iter_mut().zip([0.1, 0.2, 0.3, 0.4]) {
            segment.length_sd = length_sd;
        }
        use crate::model::skeleton::Side;
        for side in Side::BOTH {
            let ends = [side.elbow(), side.wrist(), side.knee(), side.ankle()];
            assert_eq!(ends.map(|end| prior.length_sd(end)), [0.1, 0.2, 0.3, 0.4]);
            assert_eq!(prior.length_sd(side.hip()), prior.trunk_length_sd);
        }
    }
}
