//! One posture per frame: the roots of a sequence are linked over time (Lee and Chen 1985 announce this as future
//! work in their summary).
//!
//! When a limb becomes parallel to the image plane, it meets its mirror image. To first order in time "it
//! crossed" and "it bounced" have the same cost, so the cost uses three frames: a change of velocity. The trunk
//! is linked first, then both arms and both legs, each pair jointly, given the trunk and the phase of the gait cycle
//! (`cycle`). Costs are negative log likelihoods, in nats. Limits of the body and habits of walking are soft ([`MotionPrior`]).
//!
//! Before linking, noise in the image is reduced (`denoise`); the cost of a trunk contains which way it faces in the
//! image (`front`); afterwards the motion is smoothed in space (`motion`), and feet are put to its ankles (`toes`).
//!
//! Candidates are all roots, not only the survivors of the tree: a hard limit exceeded by one degree of noise
//! would break the chain. Short gaps in a joint's track are interpolated for the decision only; the figures
//! contain only what was seen.

mod cycle;
mod denoise;
mod flip;
mod front;
mod limbs;
mod motion;
mod toes;
mod trunk;

use glam::{DMat3, DVec3};
use thiserror::Error;

use super::anchor::{AnchorOptions, Ground};
use super::lift::{JointRays, RootKind, Roots, extent_sd, roots};
use super::prior::{MotionPrior, chi_sq, heavy_tailed};
use crate::estimate::smooth::Measured;
use crate::model::angles::trunk_axes;
use crate::model::skeleton::{JOINT_COUNT, Joint, LengthError, PerJoint, SegmentLengths, StickFigure};
use crate::{Progress, Stopped};
use flip::Flip;
pub use front::FrontPoints;
use limbs::Limbs;
use trunk::{Trunk, joints_of};

/// Why a sequence cannot be linked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The times do not increase.
    #[error("times must increase: frame {frame} is at {time_s} s, the one before at {before_s} s")]
    Times {
        /// The frame.
        frame: usize,
        /// Its time, seconds.
        time_s: f64,
        /// The time of the frame before, seconds.
        before_s: f64,
    },
    /// A neck is not finite or not in front of the camera.
    #[error("the neck of frame {frame} must be before the camera or unknown (NaN), got {neck} m")]
    Neck {
        /// The frame.
        frame: usize,
        /// The neck given, metres.
        neck: DVec3,
    },
    /// A direction is zero or not finite.
    #[error("{parameter} must be a finite direction, got {value}")]
    Direction {
        /// Name of the direction.
        parameter: &'static str,
        /// The direction given.
        value: DVec3,
    },
    /// The segment lengths are not valid.
    #[error(transparent)]
    Lengths(#[from] LengthError),
    /// Cancelled by the caller.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Input of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkFrame {
    /// Time, seconds.
    pub time_s: f64,
    /// Rays to the joints, camera axes.
    pub rays: JointRays,
    /// The neck, camera axes, metres; NaN if it is not known, and then the frame is not used.
    pub neck: DVec3,
    /// Points that show the person's front.
    pub front: FrontPoints,
}

/// Options of [`link`].
#[derive(Debug, Clone, PartialEq)]
pub struct LinkOptions {
    /// Prior of the motion.
    pub prior: MotionPrior,
    /// The world's upward direction in camera axes; `None` uses the trunk's own axis.
    pub up: Option<DVec3>,
    /// The ground the person is on; with `None` feet may be at any height.
    pub ground: Option<Ground>,
    /// The moving direction in camera axes; `None` uses the trunk's forward axis.
    pub moving_direction: Option<DVec3>,
    /// The direction that the person mostly faces, camera axes, if it is known and is not the moving direction of
    /// the prior.
    pub facing: Option<DVec3>,
    /// Gaps of a joint's track up to this duration are interpolated for the decision, seconds: a quarter of a
    /// step.
    pub bridge_s: f64,
    /// Two readings differ if they place a joint farther apart than this, metres.
    pub distinct_m: f64,
}

impl Default for LinkOptions {
    fn default() -> Self {
        Self {
            prior: MotionPrior::walking(),
            up: None,
            ground: None,
            moving_direction: None,
            facing: None,
            bridge_s: 0.12,
            distinct_m: 0.10,
        }
    }
}

/// Another reading of a sequence: some segments are mirrored over some frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Alternative {
    /// The joints at the ends of the mirrored segments.
    pub joints: Vec<Joint>,
    /// First frame.
    pub from: usize,
    /// One past the last frame.
    pub to: usize,
    /// The postures of these frames, camera axes, metres.
    pub figures: Vec<StickFigure>,
    /// Cost above that of the best reading, nats, divided by the prior's overconfidence: exp(-margin) is its
    /// odds.
    pub margin: f64,
}

impl Alternative {
    /// Its probability if it and the best reading are the only ones, 0 to 0.5.
    pub fn probability(&self) -> f64 {
        1.0 / (1.0 + self.margin.exp())
    }
}

/// A linked sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkedPath {
    /// The posture of every frame, camera axes, metres. Every joint is at one of its roots; NaN if the joint, or
    /// a joint between it and the neck, was not seen.
    pub figures: Vec<StickFigure>,
    /// The postures smoothed in space: near the image points, with constant lengths and small accelerations.
    pub smoothed: Vec<StickFigure>,
    /// Tips of the right and the left big toe of the smoothed postures; NaN if the toe, its ankle or knee was not seen.
    pub toes: Vec<[DVec3; 2]>,
    /// Standard deviation of each joint along its ray, relative to its starting joint, from the frames around it,
    /// metres.
    pub sd_m: Vec<PerJoint<f64>>,
    /// Distance of each joint of `figures` from its starting joint, less the length of its segment, metres: more
    /// than 0 if there was no real root.
    pub gap_m: Vec<PerJoint<f64>>,
    /// The cheapest reading that places a joint elsewhere; `None` if there is none.
    pub second: Option<Alternative>,
    /// For each segment, by the joint at its end, the smallest margin of a reading that mirrors it, alone or with
    /// others, over some frames; infinite if there is none. When a trunk is mirrored for this, the limbs are not
    /// linked again.
    pub mirror_margin: Vec<PerJoint<f64>>,
    /// For each frame, the smallest cost of placing one of its joints elsewhere, nats; infinite if none can be
    /// elsewhere.
    pub margin: Vec<f64>,
    /// Probability that the segment that ends at a joint is mirrored in depth, 0 to 0.5; NaN if the joint is not
    /// known. For limbs by the prior's [`MirrorOdds`](super::prior::MirrorOdds), for the trunk by its margin.
    pub p_mirrored: Vec<PerJoint<f64>>,
}

impl LinkedPath {
    /// Probability that the segment that ends at a joint is mirrored in depth in a frame, 0 to 0.5; NaN if the
    /// joint is not known.
    pub fn probability_mirrored(&self, t: usize, joint: Joint) -> f64 {
        self.p_mirrored[t][joint]
    }
}

/// Links the frames of a sequence.
///
/// # Errors
/// Times that do not increase, a neck behind the camera, a direction without length, impossible lengths.
pub fn link(
    frames: &[LinkFrame],
    lengths: &SegmentLengths,
    options: &LinkOptions,
) -> Result<LinkedPath, LinkError> {
    link_with_progress(frames, lengths, options, &Progress::new())
}

/// [`link`] with progress and cancellation; each frame is one unit of `progress`.
///
/// # Errors
/// Those of [`link`], and [`LinkError::Stopped`].
pub(super) fn link_with_progress(
    frames: &[LinkFrame],
    lengths: &SegmentLengths,
    options: &LinkOptions,
    progress: &Progress,
) -> Result<LinkedPath, LinkError> {
    lengths.validated()?;
    check(frames, options)?;
    let known: Vec<usize> = (0..frames.len()).filter(|&t| !frames[t].neck.is_nan()).collect();
    let seen: Vec<LinkFrame> = known.iter().map(|&t| frames[t]).collect();
    // 1. For the decision, interpolate short gaps and reduce the noise in the image.
    let bridged = bridge(&seen, options.bridge_s);
    let clean = denoise::denoised(&bridged);
    let problem = Problem { frames: &clean, lengths, options };
    // 2. The trunk, then arms and legs in turn, each given the other. The limbs may show better which way the
    //    trunk faces, so the flipped trunk is tried as well.
    let trunks = Trunk::link(&problem);
    let share = frames.len() / trunks.len();
    let mut bodies = Vec::with_capacity(trunks.len());
    for trunk in trunks {
        let limbs = Limbs::link(&problem, &trunk);
        bodies.push((trunk.delta + limbs.cost, trunk, limbs));
        progress.advance(share)?;
    }
    bodies.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (best, trunk, limbs) = &bodies[0];
    let turned: Vec<Flip> = bodies[1..]
        .iter()
        .map(|(cost, other, _)| Flip {
            mask: other.turn ^ trunk.turn,
            from: 0,
            to: seen.len(),
            delta: cost - best,
        })
        .collect();
    // 3. The motion smoothed in space with its feet, leaves of the tree, the second-best reading and margins.
    let smoothed = motion::smoothed(&bridged, lengths, &limbs.smoothed);
    let path = problem.path(&seen, trunk, limbs, &turned, smoothed);
    Ok(path.spread(&known, frames.len()))
}

fn check(frames: &[LinkFrame], options: &LinkOptions) -> Result<(), LinkError> {
    for (frame, pair) in frames.windows(2).enumerate() {
        let [before_s, time_s] = [pair[0].time_s, pair[1].time_s];
        if !(time_s > before_s && time_s.is_finite() && before_s.is_finite()) {
            return Err(LinkError::Times { frame: frame + 1, time_s, before_s });
        }
    }
    for (frame, &LinkFrame { neck, .. }) in frames.iter().enumerate() {
        if !(neck.is_nan() || neck.is_finite() && neck.z > 0.0) {
            return Err(LinkError::Neck { frame, neck });
        }
    }
    for (parameter, value) in
        [("up", options.up), ("moving_direction", options.moving_direction), ("facing", options.facing)]
    {
        if let Some(value) = value.filter(|v| v.try_normalize().is_none()) {
            return Err(LinkError::Direction { parameter, value });
        }
    }
    Ok(())
}

/// Fills gaps of a joint's rays up to `bridge_s` long by linear interpolation.
fn bridge(frames: &[LinkFrame], bridge_s: f64) -> Vec<LinkFrame> {
    let mut bridged = frames.to_vec();
    for joint in Joint::ALL {
        let mut last: Option<usize> = None;
        for (t, frame) in frames.iter().enumerate().filter(|(_, frame)| frame.rays.sees(joint)) {
            let from = last.replace(t).unwrap_or(t);
            let span_s = frame.time_s - frames[from].time_s;
            if t > from + 1 && span_s <= bridge_s + 1e-9 {
                for gap in from + 1..t {
                    let share = (frames[gap].time_s - frames[from].time_s) / span_s;
                    let ray = frames[from].rays.ray[joint].lerp(frame.rays.ray[joint], share);
                    bridged[gap].rays.ray[joint] = ray.normalize();
                }
            }
        }
    }
    bridged
}

/// The sequence with the options and priors of linking.
#[derive(Clone, Copy)]
struct Problem<'a> {
    frames: &'a [LinkFrame],
    lengths: &'a SegmentLengths,
    options: &'a LinkOptions,
}

impl Problem<'_> {
    fn times_s(&self) -> Vec<f64> {
        self.frames.iter().map(|frame| frame.time_s).collect()
    }

    fn ray(&self, t: usize, joint: Joint) -> DVec3 {
        self.frames[t].rays.ray[joint]
    }

    /// The roots of a segment whose starting joint is known along its ray to `start_sd_m`.
    ///
    /// The distance d of start and ray is uncertain because of the noise of the image, the variation of the
    /// segment's length, and the starting joint's own position: if it moves along its ray, it comes nearer to the
    /// ray of the end.
    fn roots(&self, t: usize, start: DVec3, start_sd_m: f64, end: Joint) -> Roots {
        let rays = &self.frames[t].rays;
        let length = self.lengths.to[end];
        let ray = rays.ray[end];
        let mut found = roots(start, ray, length, rays.noise_rad, 0.0);
        let half = 0.5 * found.near.distance(found.far);
        let across = (0.5 * (found.near + found.far)).distance(start);
        let noise = std::f64::consts::SQRT_2 * rays.noise_rad * start.length();
        let drift = start_sd_m * start.normalize().cross(ray).length();
        found.sd_m =
            extent_sd(half, across, noise.hypot(self.options.prior.length_sd(end) * length).hypot(drift));
        found
    }

    /// Axes forward, down, left, relative to which swings are measured.
    fn reference(&self, trunk: &StickFigure) -> Option<DMat3> {
        let own = trunk_axes(trunk);
        let down = self.options.up.map(|up| -up.normalize()).or(own.map(|axes| axes.y_axis))?;
        let forward = self.options.moving_direction.or(own.map(|axes| axes.x_axis))?;
        let forward = (forward - forward.dot(down) * down).try_normalize()?;
        Some(DMat3::from_cols(forward, down, forward.cross(down)))
    }

    /// Weight of a frame in the evidence of the priors: neighbouring frames are not independent.
    fn weight(&self, t: usize) -> f64 {
        let last = self.frames.len() - 1;
        let [before, after] = [t.saturating_sub(1), (t + 1).min(last)];
        if before == after {
            return 1.0;
        }
        let dt = (self.frames[after].time_s - self.frames[before].time_s) / (after - before) as f64;
        (dt / self.options.prior.independence_s).min(1.0)
    }

    /// Height of an ankle above the ankle of a foot on the ground, metres; NaN without a ground.
    fn lift_m(&self, ankle: Joint, point: DVec3) -> f64 {
        let standing = AnchorOptions::default().ankle_height_over_shank * self.lengths.to[ankle];
        self.options.ground.map_or(f64::NAN, |ground| ground.height_m(point) - standing)
    }

    /// Twice the cost of the ankles' heights: at least one foot is on the ground. If the height of one is not
    /// known, the other may be in the air, but not below the ground.
    fn support_cost(&self, lift_m: [f64; 2]) -> f64 {
        let lower = lift_m[0].min(lift_m[1]);
        let both = !lift_m[0].is_nan() && !lift_m[1].is_nan();
        chi_sq(if both { lower } else { lower.min(0.0) } / self.options.prior.support_sd_m)
    }

    /// How far an ankle is behind the vertical through the body's centre, along the horizontal direction of view,
    /// metres; NaN without a balance, and if vertical or trunk are not known.
    fn behind_m(&self, t: usize, trunk: &StickFigure, ankle: DVec3) -> f64 {
        let known = || {
            let balance = self.options.prior.balance?;
            let up = self.options.up?.try_normalize()?;
            let front = self.reference(trunk)?.x_axis;
            let hips = trunk[Joint::RightHip].midpoint(trunk[Joint::LeftHip]);
            let away = self.ray(t, Joint::Neck).reject_from_normalized(up).try_normalize()?;
            Some((ankle - balance.above_ankles(trunk[Joint::Neck], hips, front)).dot(away))
        };
        known().unwrap_or(f64::NAN)
    }

    /// Twice the cost of a body that is not in balance: its centre is above one of the feet or between them. Nothing
    /// if one of the feet is not seen: the body may stand on it.
    fn balance_cost(&self, behind_m: [Measured; 2]) -> f64 {
        let Some(balance) = self.options.prior.balance else { return 0.0 };
        let [right, left] = behind_m;
        let is_between = right.value * left.value <= 0.0;
        if is_between || right.value.is_nan() || left.value.is_nan() {
            return 0.0;
        }
        let next = if right.value.abs() < left.value.abs() { right } else { left };
        heavy_tailed(next.value / balance.sd_m.hypot(next.sd))
    }

    /// Half the squared change of velocity in units of its standard deviation; 0 if an extent is not known.
    fn acceleration_cost(&self, t: usize, extents: [Measured; 3], sd_mps2: f64) -> f64 {
        let before_s = self.frames[t - 1].time_s - self.frames[t - 2].time_s;
        let after_s = self.frames[t].time_s - self.frames[t - 1].time_s;
        let [a, b, c] = extents;
        let change = (c.value - b.value) / after_s - (b.value - a.value) / before_s;
        let noise = [a.sd / before_s, b.sd * (1.0 / before_s + 1.0 / after_s), c.sd / after_s];
        let own = sd_mps2 * 0.5 * (before_s + after_s);
        let variance = own * own + noise.iter().map(|n| n * n).sum::<f64>();
        0.5 * chi_sq(change / variance.sqrt())
    }

    /// Leaves, margins and the second-best reading of a linked sequence.
    fn path(
        &self,
        seen: &[LinkFrame],
        trunk: &Trunk,
        limbs: &Limbs,
        turned: &[Flip],
        smoothed: Vec<StickFigure>,
    ) -> LinkedPath {
        let leaves: Vec<Leaf> = (0..seen.len()).map(|t| self.leaf(&seen[t], &smoothed[t], &[])).collect();
        let whole = turned.iter().map(|&flip| (flip, joints_of(flip.mask)));
        let readings = trunk.readings().chain(limbs.readings()).chain(whole);
        let mut margin = vec![f64::INFINITY; seen.len()];
        let mut mirror_margin = vec![PerJoint([f64::INFINITY; JOINT_COUNT]); seen.len()];
        let mut second: Option<(Flip, Vec<Joint>)> = None;
        for (flip, joints) in readings {
            let apart = |t: usize| {
                joints.iter().any(|&joint| 2.0 * leaves[t].extent_m[joint].abs() > self.options.distinct_m)
            };
            let delta = flip.delta.max(0.0) / self.options.prior.overconfidence;
            for margin in &mut mirror_margin[flip.from..flip.to] {
                joints.iter().for_each(|&joint| margin[joint] = margin[joint].min(delta));
            }
            let mut distinct = false;
            for t in (flip.from..flip.to).filter(|&t| apart(t)) {
                margin[t] = margin[t].min(delta);
                distinct = true;
            }
            if distinct && second.as_ref().is_none_or(|(best, _)| flip.delta < best.delta) {
                second = Some((flip, joints));
            }
        }
        let second = second.map(|(flip, joints)| Alternative {
            from: flip.from,
            to: flip.to,
            figures: (flip.from..flip.to)
                .map(|t| self.leaf(&seen[t], &smoothed[t], &joints).figure)
                .collect(),
            margin: flip.delta.max(0.0) / self.options.prior.overconfidence,
            joints,
        });
        let mut sd_m = limbs.sd_m.clone();
        for (sd_m, frame) in sd_m.iter_mut().zip(seen) {
            unseen(frame).for_each(|joint| sd_m[joint] = f64::NAN);
        }
        let p_mirrored = self.probabilities(&leaves, &smoothed, &mirror_margin);
        let smoothed = only_seen(smoothed, seen);
        LinkedPath {
            p_mirrored,
            toes: toes::toes(seen, self.lengths, &smoothed),
            smoothed,
            sd_m,
            second,
            margin,
            mirror_margin,
            gap_m: leaves.iter().map(|leaf| leaf.gap_m).collect(),
            figures: leaves.into_iter().map(|leaf| leaf.figure).collect(),
        }
    }

    /// Probabilities that the segments of the leaves are mirrored.
    fn probabilities(
        &self,
        leaves: &[Leaf],
        smoothed: &[StickFigure],
        margin: &[PerJoint<f64>],
    ) -> Vec<PerJoint<f64>> {
        let of_joint = |t: usize, joint: Joint| {
            if leaves[t].figure[joint].is_nan() {
                return f64::NAN;
            }
            match joint.start() {
                Some(start) if joint >= Joint::RightElbow => {
                    let extent_m = (smoothed[t][joint] - smoothed[t][start]).dot(self.ray(t, joint));
                    self.options.prior.mirrored.probability(extent_m, margin[t][joint])
                }
                _ => 1.0 / (1.0 + margin[t][joint].exp()),
            }
        };
        (0..leaves.len()).map(|t| PerJoint(Joint::ALL.map(|joint| of_joint(t, joint)))).collect()
    }

    /// The leaf of the tree whose segments point to the same side along their rays as the figure's, except those
    /// in `mirrored`.
    fn leaf(&self, frame: &LinkFrame, like: &StickFigure, mirrored: &[Joint]) -> Leaf {
        let mut leaf = Leaf {
            figure: StickFigure::UNKNOWN,
            extent_m: PerJoint([f64::NAN; JOINT_COUNT]),
            gap_m: PerJoint([f64::NAN; JOINT_COUNT]),
        };
        leaf.figure[Joint::Neck] = frame.neck;
        leaf.gap_m[Joint::Neck] = 0.0;
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = joint.start().unwrap_or(Joint::Neck);
            let ray = frame.rays.ray[joint];
            let found = roots(leaf.figure[start], ray, self.lengths.to[joint], 0.0, 0.0);
            let away = (like[joint] - like[start]).dot(ray) >= 0.0;
            leaf.figure[joint] = if away != mirrored.contains(&joint) { found.far } else { found.near };
            leaf.extent_m[joint] = (leaf.figure[joint] - leaf.figure[start]).dot(ray);
            if leaf.figure[joint].is_finite() {
                leaf.gap_m[joint] = if let RootKind::None { gap_m } = found.kind { gap_m } else { 0.0 };
            }
        }
        leaf
    }
}

/// The joints that a frame does not show; its neck is known.
fn unseen(frame: &LinkFrame) -> impl Iterator<Item = Joint> + '_ {
    Joint::ALL.into_iter().filter(|&joint| joint != Joint::Neck && !frame.rays.sees(joint))
}

/// The figures without the joints that their frames do not show.
fn only_seen(mut figures: Vec<StickFigure>, seen: &[LinkFrame]) -> Vec<StickFigure> {
    for (figure, frame) in figures.iter_mut().zip(seen) {
        unseen(frame).for_each(|joint| figure[joint] = DVec3::NAN);
    }
    figures
}

/// A leaf of the interpretation tree.
struct Leaf {
    figure: StickFigure,
    extent_m: PerJoint<f64>,
    gap_m: PerJoint<f64>,
}

/// Puts a joint on its ray, at an extent along it from its starting joint.
fn place(figure: &mut StickFigure, joint: Joint, ray: DVec3, extent_m: f64) {
    let start = figure[joint.start().unwrap_or(Joint::Neck)];
    figure[joint] = (start.dot(ray) + extent_m) * ray;
}

impl LinkedPath {
    /// The path with its frames at their indices in the whole sequence; frames in between are unknown.
    fn spread(self, known: &[usize], frames: usize) -> Self {
        if known.len() == frames {
            return self;
        }
        fn at<T: Clone>(values: Vec<T>, known: &[usize], frames: usize, unknown: T) -> Vec<T> {
            let mut spread = vec![unknown; frames];
            for (&t, value) in known.iter().zip(values) {
                spread[t] = value;
            }
            spread
        }
        let nothing = PerJoint([f64::NAN; JOINT_COUNT]);
        Self {
            figures: at(self.figures, known, frames, StickFigure::UNKNOWN),
            smoothed: at(self.smoothed, known, frames, StickFigure::UNKNOWN),
            toes: at(self.toes, known, frames, [DVec3::NAN; 2]),
            sd_m: at(self.sd_m, known, frames, nothing),
            gap_m: at(self.gap_m, known, frames, nothing),
            margin: at(self.margin, known, frames, f64::NAN),
            mirror_margin: at(self.mirror_margin, known, frames, nothing),
            p_mirrored: at(self.p_mirrored, known, frames, nothing),
            second: self.second.map(|second| {
                let [from, to] = [known[second.from], known[second.to - 1] + 1];
                let inside: Vec<usize> = (second.from..second.to).map(|t| known[t] - from).collect();
                Alternative {
                    figures: at(second.figures, &inside, to - from, StickFigure::UNKNOWN),
                    from,
                    to,
                    ..second
                }
            }),
        }
    }
}

#[cfg(test)]
mod tests;
