//! Links arms and legs of a sequence, given the trunk.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::cycle::Cycle;
use super::flip::{Chain, Flip};
use super::trunk::Trunk;
use super::{Problem, place};
use crate::estimate::smooth::{Measured, smooth_track};
use crate::estimate::viterbi::least_path;
use crate::model::angles::{elbow_rad, knee_rad, swing_rad};
use crate::model::skeleton::{Joint, PerJoint, Side, StickFigure};

/// Both limbs of a pair, right and left: the joint of the trunk, the middle joint, the end. Pair 0 is the arms.
const PAIRS: [[[Joint; 3]; 2]; 2] = [
    [
        [Joint::RightShoulder, Joint::RightElbow, Joint::RightWrist],
        [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist],
    ],
    [
        [Joint::RightHip, Joint::RightKnee, Joint::RightAnkle],
        [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle],
    ],
];

/// Bits of a pair's reading: inner and outer segment of the right limb, then of the left; 1 is the far root.
const SEGMENTS: usize = 4;

/// Number of readings of a pair.
const READINGS: usize = 1 << SEGMENTS;

/// Sets of segments that may be mirrored together: one segment, a whole limb, both inner segments, all.
const MASKS: [usize; 8] = [1, 2, 4, 8, 3, 12, 5, 15];

/// Both inner segments.
const INNER: usize = 5;

/// One limb's four readings in a frame.
#[derive(Clone, Copy)]
pub(super) struct LimbFrame {
    /// Signed extents of inner and outer segment.
    extents: [[Measured; 2]; 4],
    /// Cost of the limb's attitude but its swings, nats.
    pub cost: [f64; 4],
    /// Swings of inner and outer segment with their standard deviations, radians.
    pub swing: [[Measured; 2]; 4],
    /// Height of the end above that of a supporting foot, metres; NaN for arms and if it is not known.
    lift_m: [f64; 4],
    /// How far an ankle is behind the place below the body's centre, as seen from the camera, metres; nothing for
    /// arms and without balance.
    behind_m: [Measured; 4],
}

/// The reading of one limb in a pair's reading.
fn limb_bits(state: usize, side: usize) -> usize {
    state >> (2 * side) & 3
}

/// The readings of one pair of limbs.
pub(super) struct Pair {
    /// `[side][frame]`.
    pub frames: [Vec<LimbFrame>; 2],
    /// Transition costs of one limb: `[side][frame][k * 16 + i * 4 + j]`.
    transitions: [Vec<[f64; 64]>; 2],
    acceleration_mps2: [f64; SEGMENTS],
}

/// The limbs' paths.
pub(super) struct Limbs {
    /// Figures of every frame, trunk and limbs, smoothed.
    pub smoothed: Vec<StickFigure>,
    /// Standard deviation of each joint along its ray, relative to its starting joint, metres.
    pub sd_m: Vec<PerJoint<f64>>,
    /// Cost of the paths, nats.
    pub cost: f64,
    flips: [Vec<Flip>; 2],
}

impl Limbs {
    pub fn link(problem: &Problem, trunk: &Trunk) -> Self {
        // 1. The roots of both pairs of limbs in every frame.
        let pairs = [0, 1].map(|pair| Pair::new(problem, trunk, pair));
        // 2. The phase of the gait cycle, from all limbs together.
        let cycle = Cycle::find(problem, &pairs);
        // 3. Each pair's path, and its other readings.
        let times_s = problem.times_s();
        let mut total = 0.0;
        let linked = [0, 1].map(|pair| {
            let cost = pair_costs(problem, &pairs[pair], pair, cycle.as_ref());
            let mut states = pairs[pair].path(&cost);
            let (flips, path_cost) = pairs[pair].refine(&times_s, &cost, &mut states);
            total += path_cost;
            (states, flips)
        });
        let [(arms, arm_flips), (legs, leg_flips)] = linked;
        let mut limbs = Self {
            smoothed: trunk.smoothed.clone(),
            sd_m: trunk.sd_m.clone(),
            cost: total,
            flips: [arm_flips, leg_flips],
        };
        for (pair, states) in [arms, legs].into_iter().enumerate() {
            limbs.smooth(problem, pair, &pairs[pair], &states);
        }
        limbs
    }

    /// Other readings: the stretch that is mirrored, and its joints.
    pub fn readings(&self) -> impl Iterator<Item = (Flip, Vec<Joint>)> + '_ {
        self.flips.iter().enumerate().flat_map(|(pair, flips)| {
            flips.iter().map(move |&flip| {
                let bits = (0..SEGMENTS).filter(|bit| flip.mask >> bit & 1 == 1);
                (flip, bits.map(|bit| PAIRS[pair][bit / 2][bit % 2 + 1]).collect())
            })
        })
    }

    fn smooth(&mut self, problem: &Problem, pair: usize, readings: &Pair, states: &[usize]) {
        let times_s = problem.times_s();
        for bit in 0..SEGMENTS {
            let joint = PAIRS[pair][bit / 2][bit % 2 + 1];
            let measured: Vec<Measured> =
                states.iter().enumerate().map(|(t, &state)| readings.extent(bit, t, state)).collect();
            let track = smooth_track(&times_s, &measured, readings.acceleration_mps2[bit]);
            for (t, extent) in track.iter().enumerate() {
                place(&mut self.smoothed[t], joint, problem.ray(t, joint), extent.value);
                self.sd_m[t][joint] = extent.sd;
            }
        }
    }
}

impl Pair {
    pub fn new(problem: &Problem, trunk: &Trunk, pair: usize) -> Self {
        let frames = [0, 1].map(|side| {
            let limb = |t| problem.limb_frame(t, trunk, pair, side);
            (0..trunk.smoothed.len()).into_par_iter().map(limb).collect::<Vec<_>>()
        });
        let transitions = [0, 1].map(|side| {
            let steps = (0..frames[side].len()).into_par_iter();
            steps.map(|t| problem.limb_transitions(t, &frames[side], pair)).collect()
        });
        let segments = &problem.options.prior.segments[2 * pair..][..2];
        let [inner, outer] = [segments[0].acceleration_mps2, segments[1].acceleration_mps2];
        Self { frames, transitions, acceleration_mps2: [inner, outer, inner, outer] }
    }

    fn extent(&self, bit: usize, t: usize, state: usize) -> Measured {
        let side = bit / 2;
        self.frames[side][t].extents[limb_bits(state, side)][bit % 2]
    }

    /// The pair's path of the smallest cost.
    fn path(&self, cost: &[[f64; READINGS]]) -> Vec<usize> {
        let step = |side: usize, t: usize, [k, i, j]: [usize; 3]| {
            let [k, i, j] = [k, i, j].map(|state| limb_bits(state, side));
            self.transitions[side][t][k * 16 + i * 4 + j]
        };
        least_path(
            &vec![READINGS; cost.len()],
            |t, s| cost[t][s],
            |t, k, i, j| step(0, t, [k, i, j]) + step(1, t, [k, i, j]),
        )
    }

    /// Applies the mirrorings of a path that reduce the cost. Returns the other mirrorings and the cost of the path.
    fn refine(&self, times_s: &[f64], cost: &[[f64; READINGS]], states: &mut [usize]) -> (Vec<Flip>, f64) {
        let chain = Chain {
            times_s,
            acceleration_mps2: &self.acceleration_mps2,
            masks: &MASKS,
            leading: |mask| if mask & INNER == 0 { mask } else { mask & INNER },
            affected: |mask| mask | (mask & INNER) << 1,
            extent: &|bit, t, state| self.extent(bit, t, state),
            cost: &|t, state| cost[t][state],
        };
        chain.refine(states);
        (chain.flips(states), chain.total(states))
    }
}

/// Costs of the readings of a pair in every frame, nats.
fn pair_costs(problem: &Problem, limbs: &Pair, pair: usize, cycle: Option<&Cycle>) -> Vec<[f64; READINGS]> {
    (0..problem.frames.len())
        .map(|t| {
            let weight = 0.5 * problem.weight(t);
            let limbs = [0, 1].map(|side| &limbs.frames[side][t]);
            let own = [0, 1].map(|side| {
                let usual = cycle.map(|cycle| cycle.swings(t, pair, side));
                std::array::from_fn::<f64, 4, _>(|bits| {
                    let swing = problem.options.prior.swing_cost(pair, limbs[side].swing[bits], usual);
                    limbs[side].cost[bits] + weight * swing
                })
            });
            std::array::from_fn(|state| {
                let bits = [0, 1].map(|side| limb_bits(state, side));
                let lift_m = [0, 1].map(|side| limbs[side].lift_m[bits[side]]);
                let behind_m = [0, 1].map(|side| limbs[side].behind_m[bits[side]]);
                let standing = problem.support_cost(lift_m) + problem.balance_cost(behind_m);
                own[0][bits[0]] + own[1][bits[1]] + weight * standing
            })
        })
        .collect()
}

impl Problem<'_> {
    fn limb_frame(&self, t: usize, trunk: &Trunk, pair: usize, side: usize) -> LimbFrame {
        let reference = self.reference(&trunk.smoothed[t]);
        let mut limb = LimbFrame {
            extents: [[Measured::NOTHING; 2]; 4],
            cost: [0.0; 4],
            swing: [[Measured { value: f64::NAN, sd: 0.0 }; 2]; 4],
            lift_m: [f64::NAN; 4],
            behind_m: [Measured::NOTHING; 4],
        };
        let [hung, middle, end] = PAIRS[pair][side];
        for bits in 0..4 {
            let [(inner, u), (outer, v)] = self.limb_extents(t, trunk, pair, side, bits);
            limb.extents[bits] = [inner, outer];
            if pair == 1 {
                let ankle = trunk.smoothed[t][hung] + u + v;
                limb.lift_m[bits] = self.lift_m(end, ankle);
                let sd = inner.sd.hypot(outer.sd);
                limb.behind_m[bits] = Measured { value: self.behind_m(t, &trunk.smoothed[t], ankle), sd };
            }
            if let Some(axes) = reference {
                limb.swing[bits] =
                    [(middle, u, inner.sd), (end, v, outer.sd)].map(|(joint, vector, sd_m)| {
                        let noise = sd_m * axes.x_axis.dot(self.ray(t, joint)).abs() / self.lengths.to[joint];
                        Measured { value: swing_rad(&axes, vector), sd: noise }
                    });
                let cost = self.limb_cost(t, &axes, [u, v], [inner.sd, outer.sd], pair, side);
                limb.cost[bits] = 0.5 * self.weight(t) * cost;
            }
        }
        limb
    }

    /// Inner and outer segment of a reading: signed extent along the ray of its end, and the vector.
    fn limb_extents(
        &self,
        t: usize,
        trunk: &Trunk,
        pair: usize,
        side: usize,
        bits: usize,
    ) -> [(Measured, DVec3); 2] {
        let joints = PAIRS[pair][side];
        let mut start = trunk.smoothed[t][joints[0]];
        let mut start_sd = trunk.sd_m[t][joints[0]];
        if let Some(parent) = joints[0].start() {
            start_sd = start_sd.hypot(trunk.sd_m[t][parent]);
        }
        [0, 1].map(|segment| {
            let end = joints[segment + 1];
            let found = self.roots(t, start, start_sd, end);
            start_sd = start_sd.hypot(found.sd_m);
            let point = if bits >> segment & 1 == 0 { found.near } else { found.far };
            let vector = point - start;
            start = point;
            (Measured { value: vector.dot(self.ray(t, end)), sd: found.sd_m }, vector)
        })
    }

    /// Twice the cost of a limb's attitude but its swings: tilts to the side, and the limits of its middle joint.
    fn limb_cost(
        &self,
        t: usize,
        axes: &DMat3,
        segments: [DVec3; 2],
        sd_m: [f64; 2],
        pair: usize,
        side: usize,
    ) -> f64 {
        let prior = &self.options.prior;
        let joints = PAIRS[pair][side];
        let outward = match Side::BOTH[side] {
            Side::Right => -axes.z_axis,
            Side::Left => axes.z_axis,
        };
        let mut cost = 0.0;
        for (i, w) in segments.into_iter().enumerate() {
            let usual = &prior.segments[pair * 2 + i];
            let end = joints[i + 1];
            let noise = sd_m[i] * axes.z_axis.dot(self.ray(t, end)).abs() / self.lengths.to[end];
            let aside = outward.dot(w.normalize()).clamp(-1.0, 1.0).asin();
            let drift = usual.outward_per_swing * swing_rad(axes, w).clamp(-1.5, 1.5);
            cost += usual.outward.cost(aside - drift, noise);
        }
        let [u, v] = segments;
        let bend = if pair == 0 { elbow_rad(axes, u, v) } else { knee_rad(axes, u, v) };
        let noise = (sd_m[0] / self.lengths.to[joints[1]]).hypot(sd_m[1] / self.lengths.to[joints[2]]);
        cost + prior.least_bend[pair].cost_beyond(bend, noise)
    }

    fn limb_transitions(&self, t: usize, limb: &[LimbFrame], pair: usize) -> [f64; 64] {
        if t < 2 {
            return [0.0; 64];
        }
        let three = [&limb[t - 2], &limb[t - 1], &limb[t]];
        std::array::from_fn(|index| {
            let states = [index >> 4, index >> 2 & 3, index & 3];
            (0..2)
                .map(|segment| {
                    let extents = std::array::from_fn(|n| three[n].extents[states[n]][segment]);
                    let sd = self.options.prior.segments[pair * 2 + segment].acceleration_mps2;
                    self.acceleration_cost(t, extents, sd)
                })
                .sum()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FrontPoints, LinkFrame, LinkOptions};
    use super::*;
    use crate::model::skeleton::SegmentLengths;
    use crate::posture::lift::JointRays;
    use crate::posture::prior::MotionPrior;
    use crate::reproduce::stick_walker::StickWalker;

    /// A walk of the paper's walker 4 m away, facing right: ten frames in 0.36 s.
    fn frames() -> (Vec<LinkFrame>, SegmentLengths, LinkOptions) {
        let walker = StickWalker::lee_chen();
        let camera_from_walker = |v: DVec3| DVec3::new(v.x, -v.y, v.z);
        let frames = (0..10).map(|t| {
            let figure = walker.posed(0.3 + t as f64 / 25.0, DVec3::ZERO);
            let place = |p: DVec3| camera_from_walker(p) + DVec3::new(0.0, -0.3, 4.0);
            let figure = PerJoint(figure.0.map(place));
            let rays = JointRays { noise_rad: 1e-3, ..JointRays::from_points(&figure) };
            let front = FrontPoints::UNSEEN;
            LinkFrame { time_s: t as f64 / 25.0, rays, neck: figure[Joint::Neck], front }
        });
        let options =
            LinkOptions { up: Some(-DVec3::Y), moving_direction: Some(DVec3::X), ..LinkOptions::default() };
        (frames.collect(), *walker.lengths(), options)
    }

    /// An inner segment's root changes the outer segment's extent: the extra cost of mirroring contains both.
    #[test]
    fn mirroring_a_segment_moves_what_hangs_on_it() {
        let (frames, lengths, options) = frames();
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let trunk = &Trunk::link(&problem)[0];
        for pair in [0, 1] {
            let readings = Pair::new(&problem, trunk, pair);
            let cost = vec![[0.0; READINGS]; 10];
            let mut states = readings.path(&cost);
            let (flips, total) = readings.refine(&problem.times_s(), &cost, &mut states);
            let mut inner = 0;
            for flip in flips {
                let mut mirrored = states.clone();
                mirrored[flip.from..flip.to].iter_mut().for_each(|state| *state ^= flip.mask);
                let chain = Chain {
                    times_s: &problem.times_s(),
                    acceleration_mps2: &readings.acceleration_mps2,
                    masks: &MASKS,
                    leading: |mask| mask,
                    affected: |_| READINGS - 1,
                    extent: &|bit, t, state| readings.extent(bit, t, state),
                    cost: &|_, _| 0.0,
                };
                // All ten frames are within the cost of a stretch.
                let difference = chain.total(&mirrored) - total;
                assert!((flip.delta - difference).abs() < 1e-9, "{flip:?} {difference}");
                inner += usize::from(flip.mask & 0b0101 != 0);
            }
            assert!(inner > 0);
        }
    }

    /// An elbow or a knee bent the wrong way costs the square of the angle in standard deviations of its limit.
    #[test]
    fn bending_the_wrong_way_costs() {
        let (frames, lengths, options) = frames();
        let options = LinkOptions { prior: MotionPrior::any(), ..options };
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let axes = DMat3::IDENTITY;
        let shank = |deg: f64| DVec3::new(deg.to_radians().sin(), deg.to_radians().cos(), 0.0);
        for (pair, wrong_deg, limit) in [(0, -20.0, 20.0 / 15.0), (1, 20.0, 20.0 / 10.0f64)] {
            let cost = |deg: f64| problem.limb_cost(0, &axes, [DVec3::Y, shank(deg)], [0.0; 2], pair, 0);
            // In the prior of any motion forearm and shank may swing freely; only the bend differs.
            assert!((cost(wrong_deg) - cost(-wrong_deg) - limit * limit).abs() < 1e-9, "{pair}");
        }
    }

    /// The outer segment starts where the inner one ends, with the same standard deviation along its ray.
    #[test]
    fn an_outer_segment_is_as_unsure_as_its_start() {
        let (frames, lengths, options) = frames();
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let trunk = &Trunk::link(&problem)[0];
        let [shoulder, elbow, wrist] = PAIRS[0][1];
        let shoulder_sd = trunk.sd_m[3][shoulder].hypot(trunk.sd_m[3][Joint::Neck]);
        for bits in 0..4 {
            let [(inner, u), (outer, v)] = problem.limb_extents(3, trunk, 0, 1, bits);
            let start = trunk.smoothed[3][shoulder];
            let first = problem.roots(3, start, shoulder_sd, elbow);
            assert_eq!(inner.sd, first.sd_m);
            let second = problem.roots(3, start + u, shoulder_sd.hypot(inner.sd), wrist);
            assert_eq!(outer.sd, second.sd_m);
            assert!((outer.value - v.dot(frames[3].rays.ray[wrist])).abs() < 1e-12);
        }
    }
}
