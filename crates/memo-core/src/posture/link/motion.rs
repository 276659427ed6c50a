//! A linked motion smoothed in space.
//!
//! The positions of all joints in all frames are fitted together: to the image points with their noise, to
//! constant lengths, to the neck's distance, and to small accelerations. Joints leave their noisy rays, and a
//! segment leaves the ray's root. The roots must be chosen before: this cost does not choose between them (it is
//! lower at the true ones in about a third of the cases).
//!
//! Noise of lengths and accelerations were chosen on motion capture, with the people and motions for tuning of
//! `tests/score_postures.py`; one set of accelerations serves walking and other motions.
//!
//! Gauss-Newton with normal equations banded over time: time and memory grow with the number of frames.

use glam::{DVec2, DVec3};

use super::LinkFrame;
use super::denoise::image_point;
use crate::estimate::arrow::{Arrow, velocity_change};
use crate::model::skeleton::{JOINT_COUNT, Joint, PerJoint, RigidDistance, SegmentLengths, StickFigure};
use crate::posture::prior::acceleration_mps2;

/// Unknowns of a frame: three coordinates of each joint.
const BLOCK: usize = 3 * JOINT_COUNT;

/// Most iterations; about five are usual.
const MOST_ITERATIONS: usize = 12;
/// The fit ends when no joint moves by more, metres.
const ENOUGH_M: f64 = 1e-3;

/// Standard deviation of the apparent length of a segment, metres.
const LENGTH_SD_M: f64 = 0.01;
/// Standard deviation of the neck's distance from its given path, metres: constant lengths may correct it.
const NECK_SD_M: f64 = 0.1;
/// Smallest noise of an image point, radians.
const LEAST_NOISE_RAD: f64 = 2e-4;
/// A step moves a joint by about this at most if nothing else holds it, metres.
const STEP_M: f64 = 0.2;
/// Points count less if they are farther than this from the fitted ones, in standard deviations.
const ROBUST_SIGMAS: f64 = 4.0;
/// The accelerations are those of frames this far apart, seconds.
const ACCELERATION_STEP_S: f64 = 1.0 / 30.0;
/// Frames farther apart are not smoothed together, seconds.
const LONGEST_STEP_S: f64 = 0.25 + 1e-6;

/// The motion that starts at `start`, smoothed in space; camera axes, metres. Joints that `start` does not have
/// stay unknown.
pub(super) fn smoothed(
    frames: &[LinkFrame],
    lengths: &SegmentLengths,
    start: &[StickFigure],
) -> Vec<StickFigure> {
    let fit = MotionFit { frames, segments: segments(lengths), start };
    let mut figures = start.to_vec();
    let (mut cost, mut hold) = (fit.cost(&figures), 1.0);
    for _ in 0..MOST_ITERATIONS {
        let lower = fit.step(&figures, hold).map(|next| (fit.cost(&next), next)).filter(|next| next.0 < cost);
        let Some((next_cost, next)) = lower else {
            hold *= 10.0;
            continue;
        };
        (cost, hold) = (next_cost, f64::max(1.0, 0.1 * hold));
        let known = |t: usize| Joint::ALL.into_iter().filter(move |&joint| start[t][joint].is_finite());
        let moved_m = (0..figures.len())
            .flat_map(|t| known(t).map(move |joint| (t, joint)))
            .map(|(t, joint)| figures[t][joint].distance(next[t][joint]))
            .fold(0.0, f64::max);
        figures = next;
        if moved_m < ENOUGH_M {
            break;
        }
    }
    figures
}

/// The joints of all 17 segments and their lengths, metres.
fn segments(lengths: &SegmentLengths) -> Vec<([Joint; 2], f64)> {
    let to_end = Joint::ALL.into_iter().filter_map(|end| Some(([end.start()?, end], lengths.to[end])));
    let rigid = RigidDistance::ALL.into_iter().map(|pair| (pair.joints(), lengths.rigid[pair as usize]));
    to_end.chain(rigid).collect()
}

struct MotionFit<'a> {
    frames: &'a [LinkFrame],
    segments: Vec<([Joint; 2], f64)>,
    start: &'a [StickFigure],
}

impl MotionFit<'_> {
    /// The cost: twice the negative log likelihood, without constants.
    fn cost(&self, figures: &[StickFigure]) -> f64 {
        let known = |value: f64| if value.is_nan() { 0.0 } else { value };
        let mut cost = 0.0;
        for (t, (frame, figure)) in self.frames.iter().zip(figures).enumerate() {
            let sd = frame.rays.noise_rad.max(LEAST_NOISE_RAD);
            for (point, ray) in figure.0.iter().zip(frame.rays.ray.0) {
                let square = (image_point(*point) - image_point(ray)).length_squared() / (sd * sd);
                cost += known(square / (1.0 + square / ROBUST_SIGMAS.powi(2)));
            }
            let nearer_m = figure[Joint::Neck].dot(frame.neck.normalize()) - frame.neck.length();
            cost += known((nearer_m / NECK_SD_M).powi(2));
            for &([a, b], length_m) in &self.segments {
                cost += known(((figure[a].distance(figure[b]) - length_m) / LENGTH_SD_M).powi(2));
            }
            if let Some((factors, variance)) = self.change_of_velocity(t) {
                for joint in Joint::ALL {
                    let three = [t - 1, t, t + 1].map(|t| figures[t][joint]);
                    let change = factors[0] * three[0] + factors[1] * three[1] + factors[2] * three[2];
                    cost += known(change.length_squared() / (acceleration_mps2(joint).powi(2) * variance));
                }
            }
        }
        cost
    }

    /// One step of Gauss and Newton; `None` if the equations have no solution. `hold` is the weight of staying.
    fn step(&self, figures: &[StickFigure], hold: f64) -> Option<Vec<StickFigure>> {
        // The farthest unknowns that touch are the same coordinate of a joint two frames apart.
        let mut arrow = Arrow::banded(figures.len(), BLOCK, 2 * BLOCK);
        for (t, figure) in figures.iter().enumerate() {
            self.add_points(&mut arrow, t, figure);
            self.add_lengths(&mut arrow, t, figure);
            self.add_damping(&mut arrow, t, figure, hold);
            self.add_acceleration(&mut arrow, t);
        }
        let solved = arrow.solve()?.frames;
        let at = |t: usize, joint: Joint| {
            if self.start[t][joint].is_finite() {
                let first = BLOCK * t + 3 * joint as usize;
                DVec3::new(solved[first], solved[first + 1], solved[first + 2])
            } else {
                DVec3::NAN
            }
        };
        let figure = |t: usize| PerJoint(Joint::ALL.map(|joint| at(t, joint)));
        let next: Vec<StickFigure> = (0..figures.len()).map(figure).collect();
        let ahead = next.iter().flat_map(|figure| figure.0).all(|point| point.is_nan() || point.z > 0.0);
        ahead.then_some(next)
    }

    /// Image points with their noise, and the neck's distance.
    fn add_points(&self, arrow: &mut Arrow, t: usize, figure: &StickFigure) {
        let rays = &self.frames[t].rays;
        for joint in Joint::ALL {
            let (point, ray) = (figure[joint], rays.ray[joint]);
            if !point.is_finite() || !ray.is_finite() || ray.z <= 0.0 {
                continue;
            }
            let off: DVec2 = image_point(point) - image_point(ray);
            let sd = rays.noise_rad.max(LEAST_NOISE_RAD);
            let far_sq = off.length_squared() / (ROBUST_SIGMAS * sd).powi(2);
            let weight = (sd * (1.0 + far_sq)).powi(-2);
            let index = arrow.index(t, 3 * joint as usize);
            for axis in 0..2 {
                let slope = [1.0 / point.z, -point[axis] / (point.z * point.z)];
                let terms = [(index + axis, slope[0]), (index + 2, slope[1])];
                let now = slope[0] * point[axis] + slope[1] * point.z;
                arrow.add_row(&terms, now - off[axis], weight);
            }
        }
        let (neck, path) = (figure[Joint::Neck], self.frames[t].neck);
        let ray = path.normalize();
        let terms = [0, 1, 2].map(|axis| (arrow.index(t, axis), ray[axis]));
        if neck.is_finite() {
            arrow.add_row(&terms, path.length(), NECK_SD_M.powi(-2));
        }
    }

    fn add_lengths(&self, arrow: &mut Arrow, t: usize, figure: &StickFigure) {
        for &([a, b], length_m) in &self.segments {
            let Some(along) = (figure[b] - figure[a]).try_normalize() else { continue };
            let [from, to] = [a, b].map(|joint| arrow.index(t, 3 * joint as usize));
            let terms: [(usize, f64); 6] =
                std::array::from_fn(
                    |k| {
                        if k < 3 { (from + k, -along[k]) } else { (to + k - 3, along[k - 3]) }
                    },
                );
            arrow.add_row(&terms, length_m, LENGTH_SD_M.powi(-2));
        }
    }

    /// Holds what the other terms leave free where it is.
    fn add_damping(&self, arrow: &mut Arrow, t: usize, figure: &StickFigure, hold: f64) {
        for joint in Joint::ALL {
            let at = if figure[joint].is_finite() { figure[joint] } else { DVec3::ZERO };
            for axis in 0..3 {
                let index = arrow.index(t, 3 * joint as usize + axis);
                arrow.add_row(&[(index, 1.0)], at[axis], hold * STEP_M.powi(-2));
            }
        }
    }

    /// Factors of three positions whose sum is the change of velocity in a frame, and its variance for an
    /// acceleration of 1 m/s²; `None` at the ends and beside long gaps.
    fn change_of_velocity(&self, t: usize) -> Option<([f64; 3], f64)> {
        let time_s = |t: usize| Some(self.frames.get(t)?.time_s);
        let [before_s, after_s] = [time_s(t)? - time_s(t.checked_sub(1)?)?, time_s(t + 1)? - time_s(t)?];
        let (factors, variance_s) = velocity_change(before_s, after_s);
        (before_s.max(after_s) <= LONGEST_STEP_S).then_some((factors, ACCELERATION_STEP_S * variance_s))
    }

    /// Changes of velocity between a frame's neighbours.
    fn add_acceleration(&self, arrow: &mut Arrow, t: usize) {
        let Some((factors, variance)) = self.change_of_velocity(t) else { return };
        for joint in Joint::ALL {
            if (t - 1..=t + 1).any(|t| !self.start[t][joint].is_finite()) {
                continue;
            }
            let weight = 1.0 / (acceleration_mps2(joint).powi(2) * variance);
            for axis in 0..3 {
                let terms: [(usize, f64); 3] =
                    std::array::from_fn(|k| (arrow.index(t + k - 1, 3 * joint as usize + axis), factors[k]));
                arrow.add_row(&terms, 0.0, weight);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::lift::JointRays;
    use crate::posture::link::FrontPoints;
    use crate::reproduce::stick_walker::StickWalker;
    use crate::synth::Random;

    /// A walk of the paper's walker 4 m away with noise in the rays, and its true figures.
    fn walk(count: usize, noise_rad: f64) -> (Vec<LinkFrame>, Vec<StickFigure>, SegmentLengths) {
        let walker = StickWalker::lee_chen();
        let mut random = Random::new(3);
        let truth: Vec<StickFigure> = (0..count)
            .map(|t| walker.posed(t as f64 / 25.0, DVec3::ZERO))
            .map(|figure| {
                PerJoint(figure.0.map(|v| DVec3::new(v.x, -v.y, -v.z) + DVec3::new(0.0, -0.3, 4.0)))
            })
            .collect();
        let frames = truth.iter().enumerate().map(|(t, figure)| {
            let mut rays = JointRays { noise_rad, ..JointRays::from_points(figure) };
            for ray in &mut rays.ray.0 {
                let [u, v] = random.normal_pair().map(f64::from);
                *ray = (*ray / ray.z + noise_rad * DVec3::new(u, v, 0.0)).normalize();
            }
            LinkFrame { time_s: t as f64 / 25.0, rays, neck: figure[Joint::Neck], front: FrontPoints::UNSEEN }
        });
        (frames.collect(), truth, *walker.lengths())
    }

    /// The cost that the fit is to minimise, written out anew.
    fn cost(frames: &[LinkFrame], figures: &[StickFigure], lengths: &SegmentLengths) -> f64 {
        let mut sum = 0.0;
        for (frame, figure) in frames.iter().zip(figures) {
            for (point, ray) in figure.0.iter().zip(frame.rays.ray.0) {
                let off = (point.truncate() / point.z - ray.truncate() / ray.z) / frame.rays.noise_rad;
                let square = off.length_squared();
                sum += square / (1.0 + square / 16.0);
            }
            sum += ((figure[Joint::Neck].dot(frame.neck.normalize()) - frame.neck.length()) / 0.1).powi(2);
            for joint in Joint::ALL.into_iter().skip(1) {
                sum += ((figure.segment(joint).length() - lengths.to[joint]) / 0.01).powi(2);
            }
            for (pair, length_m) in RigidDistance::ALL.into_iter().zip(lengths.rigid) {
                let [a, b] = pair.joints();
                sum += ((figure[a].distance(figure[b]) - length_m) / 0.01).powi(2);
            }
        }
        for (t, three) in figures.windows(3).enumerate() {
            let [before_s, now_s, after_s] = [0, 1, 2].map(|k| frames[t + k].time_s);
            for joint in Joint::ALL {
                let change = (three[2][joint] - three[1][joint]) / (after_s - now_s)
                    - (three[1][joint] - three[0][joint]) / (now_s - before_s);
                let sd = acceleration_mps2(joint) * (0.5 * (after_s - before_s) / 30.0).sqrt();
                sum += change.length_squared() / (sd * sd);
            }
        }
        sum
    }

    /// No small change of a joint lowers the cost, and the error is much smaller than that of the start.
    #[test]
    fn the_smoothed_motion_has_the_least_cost_and_little_error() {
        let (frames, truth, lengths) = walk(25, 1e-3);
        let mut random = Random::new(8);
        let mut moved =
            || DVec3::from_array(std::array::from_fn(|_| 0.03 * f64::from(random.normal_pair()[0])));
        let start: Vec<StickFigure> =
            truth.iter().map(|figure| PerJoint(figure.0.map(|point| point + moved()))).collect();
        let found = smoothed(&frames, &lengths, &start);
        let least = cost(&frames, &found, &lengths);
        for (t, joint) in
            [(0, Joint::Neck), (7, Joint::LeftWrist), (12, Joint::Pelvis), (24, Joint::RightKnee)]
        {
            for step in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z] {
                let mut other = found.clone();
                other[t][joint] += 0.02 * step;
                assert!(cost(&frames, &other, &lengths) > least, "{t} {joint:?} {step}");
            }
        }
        let error_m = |figures: &[StickFigure]| {
            let pairs = figures.iter().zip(&truth).flat_map(|(a, b)| a.0.into_iter().zip(b.0));
            pairs.map(|(a, b)| a.distance(b)).sum::<f64>() / (14 * truth.len()) as f64
        };
        assert!(error_m(&found) < 0.5 * error_m(&start), "{} {}", error_m(&found), error_m(&start));
    }

    /// A point far off is left out; what is not known stays so and does not disturb the rest.
    #[test]
    fn outliers_and_missing_joints_leave_the_rest_alone() {
        let (frames, truth, lengths) = walk(15, 1e-3);
        let clean = smoothed(&frames, &lengths, &truth);
        let mut disturbed = frames.clone();
        disturbed[7].rays.ray[Joint::RightWrist] =
            (disturbed[7].rays.ray[Joint::RightWrist] + DVec3::new(0.05, 0.0, 0.0)).normalize();
        let mut start = truth.clone();
        for (frame, figure) in disturbed.iter_mut().zip(&mut start).take(6) {
            for joint in [Joint::LeftKnee, Joint::LeftAnkle] {
                (frame.rays.ray[joint], figure[joint]) = (DVec3::NAN, DVec3::NAN);
            }
        }
        let found = smoothed(&disturbed, &lengths, &start);
        for (t, (a, b)) in found.iter().zip(&clean).enumerate() {
            for joint in Joint::ALL {
                let is_part = matches!(joint, Joint::LeftKnee | Joint::LeftAnkle);
                let is_missing = is_part && t < 6;
                assert_eq!(a[joint].is_nan(), is_missing, "{t} {joint:?}");
                // Close to its end, the missing stretch leaves the motion less certain.
                assert!(is_part && t < 9 || a[joint].distance(b[joint]) < 0.02, "{t} {joint:?}");
            }
        }
    }

    #[test]
    fn short_motions_and_none_have_an_end() {
        let (frames, truth, lengths) = walk(2, 1e-3);
        assert_eq!(smoothed(&[], &lengths, &[]), []);
        assert_eq!(smoothed(&frames[..1], &lengths, &truth[..1]).len(), 1);
        // Without acceleration, points and lengths alone hold two frames, each within a few of its noise.
        for (figure, frame) in smoothed(&frames, &lengths, &truth).iter().zip(&frames) {
            for joint in Joint::ALL {
                let off = image_point(figure[joint]) - image_point(frame.rays.ray[joint]);
                assert!(off.length() < 4.0 * frame.rays.noise_rad, "{joint:?} {off}");
            }
        }
    }
}
