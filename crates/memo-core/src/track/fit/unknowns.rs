//! The unknowns of the fit, their priors, and how the figure of a frame depends on them.
//!
//! Two vectors describe the walk. The unknowns of the whole are the body, the path and the person's joint curves:
//! each curve is the average curve plus a Fourier series, one series common to both sides, shifted by half a cycle,
//! and one that has opposite signs on the two sides. The unknowns of a frame are the place along the path, the
//! height of the pelvis, the gait phase, and what each angle deviates from its curve in this frame alone.
//!
//! The *figure* of a frame is what its contours depend on directly: place, angles and body.

use super::lines::KINDS;
use crate::model::{Body, Gait, GaitStyle, Posture, Proportions, SideAngles};
use std::f64::consts::TAU;

/// Joint angles of one side: hip, knee, ankle, shoulder, elbow.
pub const JOINTS: usize = 5;
/// Tilts of one side: thigh and shank.
pub const LEG: usize = 2;

/// Coordinates of the figure: place of the pelvis along the path, across it and above the ground, and heading.
pub const ALONG: usize = 0;
pub const ACROSS: usize = 1;
pub const HEIGHT: usize = 2;
pub const HEADING: usize = 3;
/// Lean of the trunk.
pub const LEAN: usize = 4;
/// Rotation of the pelvis about the vertical.
pub const PELVIS: usize = 5;
/// Height of the ground.
pub const GROUND: usize = 6;
/// Joint angles of the right side, then of the left.
pub const ANGLES: usize = 7;
/// Outward tilts in the frontal plane: thigh and shank of the right side, then of the left.
pub const TILTS: usize = ANGLES + 2 * JOINTS;
/// Coordinates of the body, in the order of the constants below.
pub const BODY: usize = TILTS + 2 * LEG;
/// Number of coordinates of the figure.
pub const FIGURE: usize = BODY + BODY_COUNT;

/// Coordinates of the body: lengths as shares of the stated height, more than the average's.
pub const THIGH: usize = 0;
pub const SHANK: usize = 1;
pub const ANKLE: usize = 2;
pub const TORSO: usize = 3;
/// From the shoulder to the crown.
pub const CROWN: usize = 4;
pub const UPPER_ARM: usize = 5;
pub const FOREARM: usize = 6;
pub const HEAD_FORWARD: usize = 7;
pub const FOOT: usize = 8;
pub const HEEL: usize = 9;
pub const HIP_WIDTH: usize = 10;
pub const SHOULDER_WIDTH: usize = 11;
/// Natural logarithms of the thickness of head, torso, upper arm, forearm, hand, thigh, shank and foot.
pub const WIDTHS: usize = 12;
/// Tapers of torso, upper arm, forearm, thigh and shank: how much thicker than the middle the upper end is.
pub const TAPERS: usize = WIDTHS + KINDS;
/// Number of coordinates of the body.
pub const BODY_COUNT: usize = TAPERS + 5;

/// Coefficients of what the route of a person who turns is off ([`Bend`](super::route::Bend)).
pub const BEND: usize = 7;

/// Unknowns of the whole: the body, then lean, heading, place across the path, cosine and sine of the pelvis's rotation
/// and of its sway to the left, height of the ground, the bend of the route, then the series of the tilts and of the joint
/// curves.
pub const WHOLE_LEAN: usize = BODY_COUNT;
pub const WHOLE_HEADING: usize = BODY_COUNT + 1;
pub const WHOLE_ACROSS: usize = BODY_COUNT + 2;
pub const WHOLE_PELVIS: usize = BODY_COUNT + 3;
pub const WHOLE_SWAY: usize = BODY_COUNT + 5;
pub const WHOLE_GROUND: usize = BODY_COUNT + 7;
pub const WHOLE_BEND: usize = BODY_COUNT + 8;
pub const WHOLE_TILTS: usize = WHOLE_BEND + BEND;
pub const WHOLE_SERIES: usize = WHOLE_TILTS + LEG * TILT_TERMS;
/// Number of unknowns of the whole.
pub const WHOLE: usize = WHOLE_SERIES + series_start(JOINTS);

/// Unknowns of a frame: place along the path, height of the pelvis, phase, then deviations of the ten angles.
pub const FRAME_ALONG: usize = 0;
pub const FRAME_HEIGHT: usize = 1;
pub const FRAME_PHASE: usize = 2;
pub const FRAME_ANGLES: usize = 3;
/// Number of unknowns of a frame.
pub const FRAME: usize = FRAME_ANGLES + 2 * JOINTS;

/// Harmonics of the series of each joint.
const HARMONICS: [usize; JOINTS] = [3, 4, 2, 2, 2];
const MOST_HARMONICS: usize = 4;
/// Terms of the series of a tilt, the same for both sides: the mean and two harmonics.
const TILT_TERMS: usize = 5;

/// Terms of a joint's series: the mean, then a cosine and a sine per harmonic.
const fn terms(joint: usize) -> usize {
    1 + 2 * HARMONICS[joint]
}

/// Where the two series of a joint begin, after `WHOLE_SERIES`: first the common one, then the opposite one.
const fn series_start(joint: usize) -> usize {
    let (mut before, mut sum) = (0, 0);
    while before < joint {
        sum += 2 * terms(before);
        before += 1;
    }
    sum
}

/// Index of the mean of a joint's common series.
pub const fn mean_of(joint: usize) -> usize {
    WHOLE_SERIES + series_start(joint)
}

/// Makes a joint of one side swing less about its mean, by a share of the average's swing.
pub fn flatten(gait: &Gait, whole: &mut [f64], joint: usize, side: usize, share: f64) {
    let (count, sign) = (terms(joint), SIDES[side].1);
    let samples: Vec<f64> = (0..CURVE_SAMPLES).map(|k| k as f64 / CURVE_SAMPLES as f64).collect();
    for term in 1..count {
        let coefficient: f64 =
            samples.iter().map(|&phase| average(gait, phase)[joint] * fourier(phase)[0][term]).sum();
        // Half of it in the common series and half in the opposite one leave the other side as it is.
        let half = -0.5 * share * 2.0 * coefficient / CURVE_SAMPLES as f64;
        whole[mean_of(joint) + term] += half;
        whole[mean_of(joint) + count + term] += sign * half;
    }
}

/// Standard deviation of the height of the ground, metres: calibrations are off by as much, and so are floors and soles. With 0.007 to
/// 0.020, hip and knee of five drawn people are equal to 0.1 degrees in 40 clips, and distances are 0 to 2 cm better the larger it is;
/// with 0.020, the sixth person is 66 cm too far away in one of six.
const FLOOR_SD_M: f64 = 0.010;

/// Standard deviation over people of the lean of the trunk.
pub const LEAN_SD_RAD: f64 = 0.08;

/// Mean and standard deviation over people of an unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    pub mean: f64,
    pub sd: f64,
}

/// How much longer the thigh is than the shank, as a share of the height, beside what [`priors`] says of each.
///
/// A leg is long or short as a whole: in five of six motion-captured people the difference is -0.01 to 0.025, and the mean
/// of thigh and shank 0.223 to 0.243. (The skeleton of the sixth has -0.06.) Populations differ as much: the tibia has 0.81 of the
/// length of the femur in Europeans (Meyers 1905) and 0.85 in 400 Urhobo (Ebeye, Crural Index and its Possible use in
/// Identification), which is 0.011 of the height. With 0.006, the near hip of a filmed woman comes out better by 0.2 degrees, and
/// oblique walks of the sixth worse by as much. It is the mean and the scale of Student's t of four degrees of freedom: as those of a
/// normal distribution, the sixth comes out half a metre too far away in one of three walks in side view, and the others come out alike.
pub const THIGH_OVER_SHANK: Prior = Prior { mean: 0.012, sd: 0.01 };

/// Priors of the unknowns of the whole.
///
/// They are deviations from [`Proportions`](crate::model::Proportions), whose landmarks are those of Drillis and
/// Contini. The upper arm between joint centres is shorter by 0.02 of the height (de Leva, J Biomech 29:1223, 1996).
/// The joint centres of six motion-captured people stood 0.048 to 0.066 of the height above the ground at the ankle
/// and 0.21 to 0.30 apart between hips and shoulders. The average hip and knee curves are those of clinical models,
/// which lie 5 and 9 degrees above the angles between joint centres (means of eight motion-captured people).
/// Their thighs tilted outwards by -6 to 5 degrees and their shanks by -4 to -1 (four people of tuning; one more has
/// knees that cross, which no body has). The thigh tilts outwards by 7 degrees more in swing than in stance, while the
/// pelvis sways over the standing foot: means of three people of tuning, whose coefficients differ by a degree and half a
/// centimetre; Boulic, Thalmann and Thalmann 1990 have a sway of the same phase, and 3 cm. Standard deviations are
/// chosen, and wide where clothes hide the body.
pub fn priors() -> Vec<Prior> {
    let deg = 1f64.to_radians();
    let mut priors = vec![Prior { mean: 0.0, sd: 1.0 }; WHOLE];
    for (at, mean, sd) in [
        (THIGH, 0.0, 0.013),
        (SHANK, -0.012, 0.013),
        (ANKLE, 0.012, 0.008),
        (TORSO, -0.008, 0.03),
        (CROWN, 0.0, 0.04),
        (UPPER_ARM, -0.02, 0.01),
        (FOREARM, 0.0, 0.012),
        (HEAD_FORWARD, 0.015, 0.02),
        (FOOT, 0.0, 0.012),
        (HEEL, 0.0, 0.008),
        (HIP_WIDTH, -0.003, 0.008),
        (SHOULDER_WIDTH, -0.01, 0.012),
        (WHOLE_LEAN, 0.03, LEAN_SD_RAD),
        (WHOLE_HEADING, 0.0, 0.1),
        (WHOLE_ACROSS, 0.0, 0.5),
        // The right hip is ahead at right heel strike, by 4 degrees.
        (WHOLE_PELVIS, 4.0 * deg, 3.0 * deg),
        (WHOLE_PELVIS + 1, 0.0, 3.0 * deg),
        // The pelvis is above the standing foot: metres.
        (WHOLE_SWAY, 0.013, 0.006),
        (WHOLE_SWAY + 1, -0.02, 0.01),
        (WHOLE_GROUND, 0.0, FLOOR_SD_M),
    ] {
        priors[at] = Prior { mean, sd };
    }
    // Head, torso, upper arm, forearm, hand, thigh, shank, foot; sleeves are looser than the table's arms.
    let widths = [
        (0.0, 0.25),
        (0.0, 0.25),
        (0.1, 0.12),
        (0.1, 0.12),
        (0.1, 0.12),
        (0.0, 0.25),
        (0.0, 0.25),
        (0.0, 0.15),
    ];
    for (width, (mean, sd)) in widths.into_iter().enumerate() {
        priors[WIDTHS + width] = Prior { mean, sd };
    }
    for (taper, mean) in [0.0, 0.0, 0.0, 0.15, 0.0].into_iter().enumerate() {
        priors[TAPERS + taper] = Prior { mean, sd: 0.3 };
    }
    // Mean, cosine, sine and those of twice the phase of the thigh's tilt, then of the shank's, degrees.
    let tilts = [
        [(-1.5, 4.0), (0.2, 1.0), (-3.4, 1.2), (-1.0, 0.5), (0.2, 0.5)],
        [(-3.0, 2.5), (2.4, 1.5), (0.3, 1.5), (1.4, 1.0), (-1.0, 0.8)],
    ];
    for (n, (mean, sd)) in tilts.into_iter().flatten().enumerate() {
        priors[WHOLE_TILTS + n] = Prior { mean: mean * deg, sd: sd * deg };
    }
    // Mean of each joint, then standard deviations of the mean and of each harmonic, degrees.
    let series = [
        (-5.0, [8.0, 4.0, 2.0, 1.2, 0.7]),
        (-9.0, [10.0, 5.0, 4.0, 2.0, 1.3]),
        (0.0, [8.0, 4.0, 3.0, 2.0, 1.0]),
        (0.0, [12.0, 8.0, 3.0, 1.0, 1.0]),
        (0.0, [12.0, 8.0, 4.0, 1.0, 1.0]),
    ];
    for (joint, (mean, sds)) in series.into_iter().enumerate() {
        for term in 0..terms(joint) {
            let sd = sds[term.div_ceil(2)] * deg;
            let (common, opposite) = (mean_of(joint) + term, mean_of(joint) + terms(joint) + term);
            priors[common] = Prior { mean: if term == 0 { mean * deg } else { 0.0 }, sd };
            priors[opposite] = Prior { mean: 0.0, sd: 0.5 * sd };
        }
    }
    priors
}

/// All unknowns of a walk.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknowns {
    pub whole: Vec<f64>,
    pub frames: Vec<[f64; FRAME]>,
}

impl Unknowns {
    /// The same movement of the other side's limbs.
    pub fn exchanged(&self) -> Self {
        let Self { mut whole, mut frames } = self.clone();
        frames.iter_mut().for_each(|frame| frame[FRAME_PHASE] += 0.5);
        for joint in 0..JOINTS {
            let opposite = mean_of(joint) + terms(joint);
            whole[opposite..opposite + terms(joint)].iter_mut().for_each(|term| *term = -*term);
        }
        Self { whole, frames }
    }
}

/// The terms of a Fourier series at a phase, and their derivatives by it: 1, cos, sin, cos of twice the phase, ...
fn fourier(phase: f64) -> [[f64; 1 + 2 * MOST_HARMONICS]; 2] {
    let mut terms = [[0.0; 1 + 2 * MOST_HARMONICS]; 2];
    terms[0][0] = 1.0;
    for harmonic in 1..=MOST_HARMONICS {
        let rate = TAU * harmonic as f64;
        let (sin, cos) = (rate * phase).sin_cos();
        (terms[0][2 * harmonic - 1], terms[0][2 * harmonic]) = (cos, sin);
        (terms[1][2 * harmonic - 1], terms[1][2 * harmonic]) = (-rate * sin, rate * cos);
    }
    terms
}

/// The average curves of the side whose heel strike is at phase 0.
fn average(gait: &Gait, phase: f64) -> [f64; JOINTS] {
    let angles = gait.posture(phase, &GaitStyle::default()).right;
    [angles.hip, angles.knee, angles.ankle, angles.shoulder, angles.elbow]
}

/// Their slopes per cycle. The curves are piecewise cubic, so the central difference is as exact as they are smooth.
fn average_slope(gait: &Gait, phase: f64) -> [f64; JOINTS] {
    let step = 1e-4;
    let (before, after) = (average(gait, phase - step), average(gait, phase + step));
    std::array::from_fn(|joint| (after[joint] - before[joint]) / (2.0 * step))
}

/// Of each side: how much later in the cycle it is, and the sign of its opposite series.
const SIDES: [(f64, f64); 2] = [(0.0, 1.0), (0.5, -1.0)];

/// The joint angles of a frame, right side first, radians.
pub fn angles(gait: &Gait, whole: &[f64], frame: &[f64; FRAME]) -> [f64; 2 * JOINTS] {
    let mut angles = [0.0; 2 * JOINTS];
    for (side, (later, sign)) in SIDES.into_iter().enumerate() {
        let phase = frame[FRAME_PHASE] + later;
        let ([terms_at, _], average) = (fourier(phase), average(gait, phase));
        for (joint, average) in average.into_iter().enumerate() {
            let (common, count) = (mean_of(joint), terms(joint));
            let series: f64 = (0..count)
                .map(|n| terms_at[n] * (whole[common + n] + sign * whole[common + count + n]))
                .sum();
            let at = side * JOINTS + joint;
            angles[at] = average + series + frame[FRAME_ANGLES + at];
        }
    }
    angles
}

/// The person's curves at equally spaced phases from the side's own heel strike: hip, knee, ankle, shoulder, elbow of
/// the right side, then of the left, radians. `zero` is the phase of that heel strike.
pub fn curves(gait: &Gait, whole: &[f64], zero: f64) -> [Vec<f64>; 2 * JOINTS] {
    let at = |n: usize, phase: f64| {
        let mut frame = [0.0; FRAME];
        frame[FRAME_PHASE] = phase + zero - SIDES[n / JOINTS].0;
        angles(gait, whole, &frame)[n]
    };
    std::array::from_fn(|n| (0..CURVE_SAMPLES).map(|k| at(n, k as f64 / CURVE_SAMPLES as f64)).collect())
}

/// Samples of a curve.
pub const CURVE_SAMPLES: usize = 50;

/// Outward tilts of a leg, thigh and shank, at the phase of its side.
fn tilts(whole: &[f64], phase: f64) -> [f64; LEG] {
    let [terms, _] = fourier(phase);
    let series = |n: usize| &whole[WHOLE_TILTS + n * TILT_TERMS..][..TILT_TERMS];
    std::array::from_fn(|n| terms.iter().zip(series(n)).map(|(term, x)| term * x).sum())
}

/// How far the pelvis is to the left of the path, metres.
pub fn sway_m(whole: &[f64], phase: f64) -> f64 {
    let (sin, cos) = (TAU * phase).sin_cos();
    whole[WHOLE_ACROSS] + whole[WHOLE_SWAY] * cos + whole[WHOLE_SWAY + 1] * sin
}

/// A coordinate of the figure, an unknown (of the whole, then of the frame) and the derivative of one by the other.
pub type Slope = (usize, usize, f64);

/// The derivatives of the figure by the unknowns that are not 0.
pub fn slopes(gait: &Gait, whole: &[f64], frame: &[f64; FRAME], slopes: &mut Vec<Slope>) {
    slopes.clear();
    slopes.extend([
        (ALONG, WHOLE + FRAME_ALONG, 1.0),
        (HEIGHT, WHOLE + FRAME_HEIGHT, 1.0),
        (ACROSS, WHOLE_ACROSS, 1.0),
        (HEADING, WHOLE_HEADING, 1.0),
        (LEAN, WHOLE_LEAN, 1.0),
        (GROUND, WHOLE_GROUND, 1.0),
    ]);
    slopes.extend((0..BODY_COUNT).map(|n| (BODY + n, n, 1.0)));
    let (sin, cos) = (TAU * frame[FRAME_PHASE]).sin_cos();
    let turning = TAU * (whole[WHOLE_PELVIS + 1] * cos - whole[WHOLE_PELVIS] * sin);
    slopes.extend([
        (PELVIS, WHOLE_PELVIS, cos),
        (PELVIS, WHOLE_PELVIS + 1, sin),
        (PELVIS, WHOLE + FRAME_PHASE, turning),
    ]);
    let swaying = TAU * (whole[WHOLE_SWAY + 1] * cos - whole[WHOLE_SWAY] * sin);
    slopes.extend([
        (ACROSS, WHOLE_SWAY, cos),
        (ACROSS, WHOLE_SWAY + 1, sin),
        (ACROSS, WHOLE + FRAME_PHASE, swaying),
    ]);
    for (side, (later, sign)) in SIDES.into_iter().enumerate() {
        let phase = frame[FRAME_PHASE] + later;
        let ([terms_at, rates_at], average) = (fourier(phase), average_slope(gait, phase));
        for n in 0..LEG {
            let (tilt, series) = (TILTS + side * LEG + n, WHOLE_TILTS + n * TILT_TERMS);
            slopes.extend((0..TILT_TERMS).map(|term| (tilt, series + term, terms_at[term])));
            let rate: f64 = (0..TILT_TERMS).map(|term| rates_at[term] * whole[series + term]).sum();
            slopes.push((tilt, WHOLE + FRAME_PHASE, rate));
        }
        for (joint, mut rate) in average.into_iter().enumerate() {
            let (common, count, at) = (mean_of(joint), terms(joint), side * JOINTS + joint);
            for n in 0..count {
                slopes.push((ANGLES + at, common + n, terms_at[n]));
                slopes.push((ANGLES + at, common + count + n, sign * terms_at[n]));
                rate += rates_at[n] * (whole[common + n] + sign * whole[common + count + n]);
            }
            slopes.push((ANGLES + at, WHOLE + FRAME_PHASE, rate));
            slopes.push((ANGLES + at, WHOLE + FRAME_ANGLES + at, 1.0));
        }
    }
}

/// The angles of one side, in the order of the joints, with the tilts of its leg.
pub fn side_angles(a: &[f64], tilts: &[f64]) -> SideAngles {
    SideAngles {
        hip: a[0],
        knee: a[1],
        ankle: a[2],
        shoulder: a[3],
        elbow: a[4],
        thigh_tilt: tilts[0],
        shank_tilt: tilts[1],
    }
}

/// The posture of a frame.
pub fn posture(gait: &Gait, whole: &[f64], frame: &[f64; FRAME]) -> Posture {
    let angles = angles(gait, whole, frame);
    let side = |n: usize| side_angles(&angles[n * JOINTS..], &tilts(whole, frame[FRAME_PHASE] + SIDES[n].0));
    let (sin, cos) = (TAU * frame[FRAME_PHASE]).sin_cos();
    Posture {
        right: side(0),
        left: side(1),
        trunk_lean: whole[WHOLE_LEAN],
        pelvis_rotation: whole[WHOLE_PELVIS] * cos + whole[WHOLE_PELVIS + 1] * sin,
    }
}

/// The body of the unknowns; `average` has the stated height.
pub fn body(average: &Body, whole: &[f64]) -> Body {
    let (mut body, a) = (*average, &average.proportions);
    let p = &mut body.proportions;
    p.ankle_height = a.ankle_height + whole[ANKLE];
    p.knee_height = p.ankle_height + (a.knee_height - a.ankle_height) + whole[SHANK];
    p.hip_height = p.knee_height + (a.hip_height - a.knee_height) + whole[THIGH];
    p.shoulder_height = p.hip_height + (a.shoulder_height - a.hip_height) + whole[TORSO];
    p.chin_height = p.shoulder_height + (a.chin_height - a.shoulder_height);
    p.crown_height = p.shoulder_height + (a.crown_height - a.shoulder_height) + whole[CROWN];
    p.upper_arm += whole[UPPER_ARM];
    p.forearm += whole[FOREARM];
    p.head_forward += whole[HEAD_FORWARD];
    p.foot += whole[FOOT];
    p.heel += whole[HEEL];
    p.hip_half_width += whole[HIP_WIDTH];
    p.shoulder_half_width += whole[SHOULDER_WIDTH];
    for (axes, log) in p.semi_axes.iter_mut().zip(&whole[WIDTHS..TAPERS]) {
        *axes = (axes.0 * log.exp(), axes.1 * log.exp());
    }
    body
}

/// The lengths that add up to the standing height.
pub const STATURE: [usize; 5] = [ANKLE, SHANK, THIGH, TORSO, CROWN];

/// How much taller the person is than the average walker, as a share of the walker's height.
pub fn excess(whole: &[f64]) -> f64 {
    STATURE.iter().map(|&n| whole[n]).sum()
}

/// The length of the average walker from which an unknown of the body deviates, as a share of the height; `None` of what is no length.
pub fn length(average: &Proportions, unknown: usize) -> Option<f64> {
    let p = average;
    Some(match unknown {
        ANKLE => p.ankle_height,
        SHANK => p.knee_height - p.ankle_height,
        THIGH => p.hip_height - p.knee_height,
        TORSO => p.shoulder_height - p.hip_height,
        CROWN => p.crown_height - p.shoulder_height,
        UPPER_ARM => p.upper_arm,
        FOREARM => p.forearm,
        HEAD_FORWARD => p.head_forward,
        FOOT => p.foot,
        HEEL => p.heel,
        HIP_WIDTH => p.hip_half_width,
        SHOULDER_WIDTH => p.shoulder_half_width,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unknowns away from the average, each in its own way.
    fn unknowns() -> (Vec<f64>, [f64; FRAME]) {
        let whole =
            priors().iter().enumerate().map(|(n, p)| p.mean + 0.5 * p.sd * (1.7 * n as f64).sin()).collect();
        let mut frame = [0.0; FRAME];
        frame[FRAME_PHASE] = 3.37;
        frame[FRAME_ANGLES..].iter_mut().enumerate().for_each(|(n, x)| *x = 0.02 * (n as f64).cos());
        (whole, frame)
    }

    /// Pelvis, angles and tilts of the figure, then its sway.
    fn figure(whole: &[f64], frame: &[f64; FRAME]) -> Vec<(usize, f64)> {
        let gait = Gait::dense();
        let posture = posture(&gait, whole, frame);
        let tilts = [posture.right, posture.left].into_iter().flat_map(|s| [s.thigh_tilt, s.shank_tilt]);
        let turned = [posture.pelvis_rotation, whole[WHOLE_GROUND]].into_iter();
        let turned = turned.chain(angles(&gait, whole, frame)).chain(tilts);
        let mut all: Vec<(usize, f64)> = (PELVIS..).zip(turned).collect();
        all.push((ACROSS, sway_m(whole, frame[FRAME_PHASE])));
        all
    }

    #[test]
    fn slopes_are_those_of_central_differences() {
        let (whole, frame) = unknowns();
        let mut found = Vec::new();
        slopes(&Gait::dense(), &whole, &frame, &mut found);
        for unknown in 0..WHOLE + FRAME {
            let moved = |by: f64| {
                let (mut whole, mut frame) = (whole.clone(), frame);
                if unknown < WHOLE {
                    whole[unknown] += by
                } else {
                    frame[unknown - WHOLE] += by
                }
                figure(&whole, &frame)
            };
            let (low, high) = (moved(-1e-5), moved(1e-5));
            for (&(at, low), (_, high)) in low.iter().zip(&high) {
                let expected = (high - low) / 2e-5;
                let slope: f64 = found.iter().filter(|s| (s.0, s.1) == (at, unknown)).map(|s| s.2).sum();
                assert!(
                    (slope - expected).abs() < 1e-3 * expected.abs().max(1.0),
                    "{at} by {unknown}: {slope} {expected}"
                );
            }
        }
    }

    #[test]
    fn the_left_curves_are_half_a_cycle_later_but_for_the_opposite_series() {
        let (mut whole, mut frame) = unknowns();
        for joint in 0..JOINTS {
            whole[mean_of(joint) + terms(joint)..mean_of(joint) + 2 * terms(joint)].fill(0.0);
        }
        frame[FRAME_ANGLES..].fill(0.0);
        let now = angles(&Gait::dense(), &whole, &frame);
        frame[FRAME_PHASE] += 0.5;
        let later = angles(&Gait::dense(), &whole, &frame);
        (0..JOINTS).for_each(|joint| assert!((now[JOINTS + joint] - later[joint]).abs() < 1e-12));
        // A mean of the opposite series bends one knee more and the other less.
        whole[mean_of(1) + terms(1)] = 0.1;
        let uneven = angles(&Gait::dense(), &whole, &frame);
        assert!(
            (uneven[1] - later[1] - 0.1).abs() < 1e-12
                && (uneven[JOINTS + 1] - later[JOINTS + 1] + 0.1).abs() < 1e-12
        );
    }

    #[test]
    fn a_flattened_joint_swings_less_on_its_side_alone() {
        let gait = Gait::dense();
        let mut whole = vec![0.0; WHOLE];
        flatten(&gait, &mut whole, 1, 0, 0.6);
        let [plain, flat] = [&vec![0.0; WHOLE], &whole].map(|whole| curves(&gait, whole, 0.0));
        let range = |curve: &[f64]| {
            curve.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b))
                - curve.iter().fold(f64::INFINITY, |a, &b| a.min(b))
        };
        let ratio = range(&flat[1]) / range(&plain[1]);
        assert!((0.35..0.5).contains(&ratio), "{ratio}");
        let other = flat[JOINTS + 1].iter().zip(&plain[JOINTS + 1]);
        other.for_each(|(a, b)| assert!((a - b).abs() < 1e-12));
    }

    #[test]
    fn lengths_of_the_body_add_up_to_its_height() {
        let (whole, _) = unknowns();
        let body = body(&Body::from_height(1.7).unwrap(), &whole);
        let grown: f64 = STATURE.iter().map(|&n| whole[n]).sum();
        assert!((body.proportions.crown_height - 1.0 - grown).abs() < 1e-12);
        let p = &body.proportions;
        assert!((p.hip_height - p.knee_height - 0.245 - whole[THIGH]).abs() < 1e-12);
        assert!((p.shoulder_height - p.hip_height - 0.288 - whole[TORSO]).abs() < 1e-12);
        assert!((p.semi_axes[6].0 - 0.030 * whole[WIDTHS + 6].exp()).abs() < 1e-12);
    }
}
