//! Links the trunk of a sequence: shoulders, pelvis and hips.

use glam::DVec3;
use rayon::prelude::*;

use super::super::prior::chi_sq;
use super::flip::{Chain, Flip};
use super::front::Front;
use super::{Problem, place};
use crate::estimate::smooth::{Measured, smooth_track};
use crate::estimate::viterbi::least_path;
use crate::model::angles::{hip_axes, swing_rad, trunk_axes};
use crate::model::skeleton::{Joint, PerJoint, RigidDistance, StickFigure};

/// Joints of the trunk in the order of their levels. Bit i of a reading is the root of joint i, 1 the far one.
const JOINTS: [Joint; 5] =
    [Joint::RightShoulder, Joint::LeftShoulder, Joint::Pelvis, Joint::RightHip, Joint::LeftHip];

/// Number of readings.
const READINGS: usize = 1 << JOINTS.len();

/// Number of readings of a frame in the dynamic program: those of the smallest cost.
const KEPT: usize = 8;

/// Share of a usual spread that is constant over a sequence.
const STEADY_SHARE: f64 = 0.7;

/// Sets of segments that may be mirrored together: one segment, both shoulders, both hips, all four.
const MASKS: [usize; 8] = [1, 2, 4, 8, 16, 3, 24, TURN];

/// The set that flips a trunk: shoulders and hips.
const TURN: usize = 27;

/// Both shoulders.
const SHOULDERS: usize = 3;

/// Skip flipped trunks that cost more than 20 nats per second (of at least one second) above the best trunk. On
/// walks the limbs compensated for up to 9 nats per second.
const WORTH_TRYING_PER_S: f64 = 20.0;

/// The trunk's path.
pub(super) struct Trunk {
    /// Cost above that of the best trunk, nats, without limbs.
    pub delta: f64,
    /// The set flipped relative to the best trunk.
    pub turn: usize,
    /// Neck and trunk of every frame, smoothed.
    pub smoothed: Vec<StickFigure>,
    /// Standard deviation of each joint along its ray, relative to its starting joint, metres.
    pub sd_m: Vec<PerJoint<f64>>,
    flips: Vec<Flip>,
}

/// One reading of the trunk in a frame.
#[derive(Clone, Copy)]
struct Reading {
    extents: [Measured; 5],
    cost: f64,
}

impl Trunk {
    /// The trunk of the smallest cost, and the flipped trunk if the limbs may compensate for its cost.
    pub fn link(problem: &Problem) -> Vec<Self> {
        let readings: Vec<[Reading; READINGS]> = (0..problem.frames.len())
            .into_par_iter()
            .map(|t| {
                let front = Front::find(problem, t);
                std::array::from_fn(|bits| problem.trunk_reading(t, bits, front.as_ref()))
            })
            .collect();
        let kept: Vec<Vec<usize>> = readings.iter().map(cheapest).collect();
        let counts: Vec<usize> = kept.iter().map(Vec::len).collect();
        let acceleration = problem.options.prior.trunk_acceleration_mps2;
        let path = least_path(
            &counts,
            |t, s| readings[t][kept[t][s]].cost,
            |t, k, i, j| {
                let three = [&readings[t - 2][kept[t - 2][k]], &readings[t - 1][kept[t - 1][i]]];
                let now = &readings[t][kept[t][j]];
                (0..JOINTS.len())
                    .map(|joint| {
                        let extents = [three[0].extents[joint], three[1].extents[joint], now.extents[joint]];
                        problem.acceleration_cost(t, extents, acceleration)
                    })
                    .sum()
            },
        );
        let mut states: Vec<usize> = path.iter().enumerate().map(|(t, &s)| kept[t][s]).collect();
        let chain = Chain {
            times_s: &problem.times_s(),
            acceleration_mps2: &[acceleration; 5],
            masks: &MASKS,
            leading: |mask| if mask == TURN { SHOULDERS } else { mask },
            affected: |mask| if mask & 4 == 4 { 4 | 8 | 16 } else { mask },
            extent: &|bit, t, state| readings[t][state].extents[bit],
            cost: &|t, state| readings[t][state].cost,
        };
        chain.refine(&mut states);
        let turned = (!states.is_empty()).then(|| (TURN, chain.delta(&states, TURN, 0, states.len())));
        let times_s = chain.times_s;
        let span_s = times_s.last().zip(times_s.first()).map_or(0.0, |(last, first)| last - first);
        let worth = WORTH_TRYING_PER_S * span_s.max(1.0);
        std::iter::once((0, 0.0))
            .chain(turned.filter(|(_, delta)| *delta < worth))
            .map(|(turn, delta)| {
                let states: Vec<usize> = states.iter().map(|state| state ^ turn).collect();
                let flips = chain.flips(&states);
                let extents: Vec<[Measured; 5]> =
                    states.iter().enumerate().map(|(t, &state)| readings[t][state].extents).collect();
                let (smoothed, sd_m) = problem.smooth_trunk(&extents);
                Self { delta, turn, smoothed, sd_m, flips }
            })
            .collect()
    }

    /// Other readings: the stretch that is mirrored, and its joints.
    pub fn readings(&self) -> impl Iterator<Item = (Flip, Vec<Joint>)> + '_ {
        self.flips.iter().map(|&flip| (flip, joints_of(flip.mask)))
    }
}

/// The joints of a mask.
pub(super) fn joints_of(mask: usize) -> Vec<Joint> {
    let bits = JOINTS.into_iter().enumerate().filter(|(bit, _)| mask >> bit & 1 == 1);
    bits.map(|(_, joint)| joint).collect()
}

/// The readings of the smallest cost; among equal ones, those of lower number. Where near and far root are one point, the
/// near one stands for both.
fn cheapest(readings: &[Reading; READINGS]) -> Vec<usize> {
    let stands = |bits: usize| {
        (0..JOINTS.len()).all(|bit| {
            let [own, near] = [bits, bits & !(1 << bit)].map(|bits| readings[bits].extents[bit].value);
            bits >> bit & 1 == 0 || own.total_cmp(&near).is_ne()
        })
    };
    let mut order: Vec<usize> = (0..READINGS).filter(|&bits| stands(bits)).collect();
    order.sort_by(|&a, &b| readings[a].cost.total_cmp(&readings[b].cost));
    order.truncate(KEPT);
    order
}

impl Problem<'_> {
    fn trunk_reading(&self, t: usize, bits: usize, front: Option<&Front>) -> Reading {
        let mut figure = StickFigure::UNKNOWN;
        figure[Joint::Neck] = self.frames[t].neck;
        let mut extents = [Measured::NOTHING; 5];
        for (i, joint) in JOINTS.into_iter().enumerate() {
            let start = figure[joint.start().unwrap_or(Joint::Neck)];
            let parent = joint.start().and_then(|start| JOINTS.iter().position(|&other| other == start));
            let start_sd = parent.map_or(0.0, |parent| extents[parent].sd);
            let found = self.roots(t, start, start_sd, joint);
            figure[joint] = if bits >> i & 1 == 0 { found.near } else { found.far };
            let value = (figure[joint] - start).dot(self.ray(t, joint));
            extents[i] = Measured { value, sd: found.sd_m };
        }
        let sd_m =
            PerJoint(std::array::from_fn(|joint| extents.get(joint.wrapping_sub(1)).map_or(0.0, |e| e.sd)));
        let cost =
            self.rigid_cost(t, &figure, &sd_m) + self.weight(t) * self.attitude_cost(t, &figure, &sd_m);
        let front = front.map_or(0.0, |front| self.weight(t) * front.cost(&figure));
        Reading { extents, cost: 0.5 * cost + front }
    }

    /// Twice the cost of the distances within torso and hip part.
    fn rigid_cost(&self, t: usize, figure: &StickFigure, sd_m: &PerJoint<f64>) -> f64 {
        let lateral_m = self.frames[t].rays.noise_rad * self.frames[t].neck.length();
        RigidDistance::ALL
            .into_iter()
            .map(|distance| {
                let [a, b] = distance.joints();
                let between = figure[b] - figure[a];
                let unit = between.normalize_or_zero();
                let [sd_a, sd_b] = [a, b].map(|joint| unit.dot(self.ray(t, joint)) * sd_m[joint]);
                let sd = self
                    .options
                    .prior
                    .rigid_m
                    .hypot(sd_a.hypot(sd_b))
                    .hypot(std::f64::consts::SQRT_2 * lateral_m);
                chi_sq((between.length() - self.lengths.rigid[distance as usize]) / sd)
            })
            .sum()
    }

    /// Twice the cost of the trunk's inclination and rotation.
    fn attitude_cost(&self, t: usize, figure: &StickFigure, sd_m: &PerJoint<f64>) -> f64 {
        let Some(axes) = self.reference(figure) else { return 0.0 };
        let prior = &self.options.prior;
        // How far a joint may be off along an axis.
        let noise_m = |joint: Joint, axis: DVec3| axis.dot(self.ray(t, joint)).abs() * sd_m[joint];
        let spine = figure.segment(Joint::Pelvis);
        let roll = axes.z_axis.dot(spine).atan2(axes.y_axis.dot(spine));
        let spine_noise = |axis: DVec3| noise_m(Joint::Pelvis, axis) / spine.length();
        let mut cost = prior.trunk_lean.cost(-swing_rad(&axes, spine), spine_noise(axes.x_axis))
            + prior.trunk_roll.cost(roll, spine_noise(axes.z_axis));
        for (right, left, soft) in [
            (Joint::RightShoulder, Joint::LeftShoulder, prior.shoulder_turn),
            (Joint::RightHip, Joint::LeftHip, prior.hip_turn),
        ] {
            let line = figure[left] - figure[right];
            let turn = axes.x_axis.dot(line).atan2(axes.z_axis.dot(line));
            let [noise_right, noise_left] = [right, left].map(|joint| noise_m(joint, axes.x_axis));
            cost += soft.cost(turn, noise_right.hypot(noise_left) / line.length());
        }
        let [right, left] = [Joint::RightShoulder, Joint::LeftShoulder];
        let forward = axes.x_axis.dot(figure[Joint::Neck] - 0.5 * (figure[right] + figure[left]));
        let sd = prior.neck_forward_sd_m.hypot(0.5 * sd_m[right].hypot(sd_m[left]));
        cost += chi_sq((forward - self.neck_forward_m()) / sd);
        if let (Some(torso), Some(hips)) = (trunk_axes(figure), hip_axes(figure))
            && torso.x_axis.dot(hips.x_axis) < 0.0
        {
            cost += prior.hips_against_torso;
        }
        cost
    }

    /// The trunk smoothed over time, with the prior as a further measurement.
    fn smooth_trunk(&self, extents: &[[Measured; 5]]) -> (Vec<StickFigure>, Vec<PerJoint<f64>>) {
        let times_s = self.times_s();
        let mut figures: Vec<StickFigure> = self
            .frames
            .iter()
            .map(|frame| {
                let mut figure = StickFigure::UNKNOWN;
                figure[Joint::Neck] = frame.neck;
                figure
            })
            .collect();
        let mut sd_m = vec![PerJoint::default(); figures.len()];
        for (i, joint) in JOINTS.into_iter().enumerate() {
            let measured: Vec<Measured> = extents
                .iter()
                .enumerate()
                .map(|(t, extents)| {
                    self.usual_extent(t, joint).map_or(extents[i], |usual| extents[i].fused(usual))
                })
                .collect();
            let smoothed = smooth_track(&times_s, &measured, self.options.prior.trunk_acceleration_mps2);
            for (t, figure) in figures.iter_mut().enumerate() {
                place(figure, joint, self.ray(t, joint), smoothed[t].value);
                // Smoothing does not reduce deviations that last for the whole sequence, such as an unusual lean.
                let steady =
                    self.usual_extent(t, joint).map_or(0.0, |usual| usual.sd * self.weight(t).sqrt());
                sd_m[t][joint] = smoothed[t].sd.max(STEADY_SHARE * steady);
            }
        }
        (figures, sd_m)
    }

    /// Distance of the neck in front of the shoulder line, by the lengths of the rigid torso.
    fn neck_forward_m(&self) -> f64 {
        let half = 0.5 * self.lengths.rigid[RigidDistance::Shoulders as usize];
        let to_shoulder =
            0.5 * (self.lengths.to[Joint::RightShoulder] + self.lengths.to[Joint::LeftShoulder]);
        (to_shoulder * to_shoulder - half * half).max(0.0).sqrt()
    }

    /// Expected position of a joint of the trunk along its ray from its starting joint, if up and the moving
    /// direction are given.
    fn usual_extent(&self, t: usize, joint: Joint) -> Option<Measured> {
        self.options.up.and(self.options.moving_direction)?;
        let axes = self.reference(&StickFigure::UNKNOWN)?;
        let prior = &self.options.prior;
        let length = self.lengths.to[joint];
        let half = |distance: RigidDistance| {
            let half = 0.5 * self.lengths.rigid[distance as usize];
            if matches!(joint, Joint::RightShoulder | Joint::RightHip) { -half } else { half }
        };
        let (usual, sd_m) = match joint {
            Joint::Pelvis => (length * axes.y_axis, length * prior.trunk_lean.forward_sd_rad),
            Joint::RightShoulder | Joint::LeftShoulder => {
                let side = half(RigidDistance::Shoulders);
                let back = self.neck_forward_m() * axes.x_axis;
                (
                    side * axes.z_axis - back,
                    (side * prior.shoulder_turn.sd_rad).hypot(prior.neck_forward_sd_m),
                )
            }
            _ => {
                let side = half(RigidDistance::Hips);
                let down = (length * length - side * side).max(0.0).sqrt();
                (side * axes.z_axis + down * axes.y_axis, (side * prior.hip_turn.sd_rad).abs())
            }
        };
        let sd = sd_m / self.weight(t).sqrt();
        sd.is_finite().then(|| Measured { value: usual.dot(self.ray(t, joint)), sd })
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::super::{FrontPoints, LinkFrame, LinkOptions};
    use super::*;
    use crate::model::skeleton::SegmentLengths;
    use crate::posture::lift::JointRays;
    use crate::posture::prior::MotionPrior;
    use crate::reproduce::stick_walker::StickWalker;

    /// A person upright facing the camera, 4 m away; the trunk of Table A.1, its shoulders behind the neck.
    fn facing() -> (Vec<LinkFrame>, StickFigure, SegmentLengths, LinkOptions) {
        let walker = StickWalker::lee_chen();
        let figure = walker.posed(0.25, DVec3::ZERO);
        let figure = PerJoint(figure.0.map(|v| DVec3::new(-v.z, -v.y, -v.x) + DVec3::new(0.0, -0.3, 4.0)));
        let frames = (0..50).map(|t| LinkFrame {
            time_s: t as f64 / 25.0,
            rays: JointRays::from_points(&figure),
            neck: figure[Joint::Neck],
            front: FrontPoints::UNSEEN,
        });
        let options =
            LinkOptions { up: Some(-DVec3::Y), moving_direction: Some(-DVec3::Z), ..LinkOptions::default() };
        (frames.collect(), figure, *walker.lengths(), options)
    }

    /// Twice the cost of an attitude, without noise.
    fn cost(options: &LinkOptions, figure: &StickFigure) -> f64 {
        let (frames, _, lengths, _) = facing();
        let problem = Problem { frames: &frames, lengths: &lengths, options };
        problem.attitude_cost(0, figure, &PerJoint::default())
    }

    /// The neck is 3.77 cm in front of the shoulders by the lengths of Table A.1, ± 2 cm.
    #[test]
    fn shoulders_before_the_neck_cost_their_distance_from_where_they_belong() {
        let (_, figure, lengths, options) = facing();
        let behind_m = 0.0377;
        let moved = |by_m: f64| {
            let mut moved = figure;
            for joint in [Joint::RightShoulder, Joint::LeftShoulder] {
                moved[joint].z -= by_m;
            }
            moved
        };
        let usual = cost(&options, &figure);
        for by_m in [0.01, -0.02, behind_m, 2.0 * behind_m] {
            let expected = f64::powi(by_m / 0.02, 2).min(25.0);
            assert!((cost(&options, &moved(by_m)) - usual - expected).abs() < 0.15, "{by_m}");
        }
        let (frames, ..) = facing();
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        assert!((problem.neck_forward_m() - behind_m).abs() < 1e-4);
    }

    /// Hips that face opposite to the torso cost 25 in addition to their rotation.
    #[test]
    fn hips_that_face_against_the_torso_cost() {
        let (_, figure, _, options) = facing();
        let options = LinkOptions { prior: MotionPrior::any(), ..options };
        let turned = |deg: f64| {
            let mut turned = figure;
            for joint in [Joint::RightHip, Joint::LeftHip] {
                let turn = DMat3::from_rotation_y(f64::to_radians(deg));
                turned[joint] = figure[Joint::Pelvis] + turn * (figure[joint] - figure[Joint::Pelvis]);
            }
            turned
        };
        // Both rotations are beyond the cap; the second one is more than a quarter turn.
        let difference = cost(&options, &turned(175.0)) - cost(&options, &turned(-89.0));
        // 89 degrees are 4.45 standard deviations of 20.
        assert!((difference - 25.0 - (25.0 - 4.45f64.powi(2))).abs() < 1.5, "{difference}");
    }

    /// Expected positions of trunk and hips along the rays, for a person who faces the camera: the pelvis level
    /// with the neck, shoulders 3.77 cm farther, right and left the same.
    #[test]
    fn usual_extents_are_those_of_an_upright_trunk() {
        let (frames, _, lengths, options) = facing();
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let usual = |joint: Joint| problem.usual_extent(0, joint).unwrap();
        let off = |joint: Joint, vector: DVec3| usual(joint).value - vector.dot(frames[0].rays.ray[joint]);
        let half = 0.5 * lengths.rigid[RigidDistance::Shoulders as usize];
        let hip = 0.5 * lengths.rigid[RigidDistance::Hips as usize];
        let drop = (lengths.to[Joint::LeftHip].powi(2) - hip * hip).sqrt();
        // Facing the camera, the person's left is on its right.
        for (joint, vector) in [
            (Joint::LeftShoulder, DVec3::new(half, 0.0, 0.0377)),
            (Joint::RightShoulder, DVec3::new(-half, 0.0, 0.0377)),
            (Joint::Pelvis, DVec3::new(0.0, lengths.to[Joint::Pelvis], 0.0)),
            (Joint::LeftHip, DVec3::new(hip, drop, 0.0)),
            (Joint::RightHip, DVec3::new(-hip, drop, 0.0)),
        ] {
            assert!(off(joint, vector).abs() < 1e-4, "{joint:?} {}", off(joint, vector));
        }
        // Frames 40 ms apart have half the weight: spreads grow by the square root of two.
        let lean = 8f64.to_radians() * lengths.to[Joint::Pelvis];
        assert!((usual(Joint::Pelvis).sd - 2f64.sqrt() * lean).abs() < 1e-9);
        let turn = (8f64.to_radians() * half).hypot(0.02);
        assert!((usual(Joint::LeftShoulder).sd - 2f64.sqrt() * turn).abs() < 1e-9);
        let nowhere = LinkOptions { moving_direction: None, ..options };
        let problem = Problem { frames: &frames, lengths: &lengths, options: &nowhere };
        assert_eq!(problem.usual_extent(0, Joint::Pelvis), None);
    }

    /// Deviations of a person's usual posture do not average out over fifty frames.
    #[test]
    fn a_trunk_stays_as_unsure_as_people_hold_it() {
        let (frames, _, lengths, options) = facing();
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let trunk = &Trunk::link(&problem)[0];
        let steady = 0.7 * 8f64.to_radians() * lengths.to[Joint::Pelvis];
        for sd_m in &trunk.sd_m {
            assert!(sd_m[Joint::Pelvis] >= steady - 1e-12, "{} {steady}", sd_m[Joint::Pelvis]);
        }
    }
}
