//! Phase of the gait cycle of a walking person, from the swings of all limbs together.
//!
//! A limb that swings through the vertical has two nearly equal roots there, and a motion that bounces off is as
//! smooth as one that goes through. What tells them apart is the rest of the body: arms and legs follow one cycle.
//! The phase is found before the roots are chosen: at each phase, a limb costs as much as the cheapest of its roots.
//!
//! Limits: the curves are averages of healthy adults who walk forward. Limbs that do not follow them cost the static
//! prior and [`CyclePrior::apart_nats`], so that some of them do not decide about the others.

use super::Problem;
use super::limbs::Pair;
use crate::model::gait::{Gait, GaitStyle};
use crate::model::skeleton::Side;

/// Number of phases.
const PHASES: usize = 200;

/// Time of one step of the path, seconds.
const STEP_S: f64 = 0.08;

/// Slowest and fastest cycle, in phases per step: 0.25 and 1.5 Hz.
const ADVANCES: [usize; 2] = [4, 24];

/// Cost of a change of the advance by one, nats.
const CHANGE_NATS: f64 = 0.5;

/// A longer gap begins a new path, seconds, whatever times of frames are rounded to.
const GAP_S: f64 = 0.5 + 1e-6;

/// Swings of upper arm, forearm, thigh and shank over the right side's cycle.
type Curves = Vec<[f64; 4]>;

/// The gait cycle of a sequence.
pub(super) struct Cycle {
    curves: Curves,
    /// Phase of every frame, 0 to [`PHASES`].
    phase: Vec<f64>,
}

impl Cycle {
    /// The path of phases of least cost; `None` if the motion has no cycle. `limbs` are arms and legs.
    pub fn find(problem: &Problem, limbs: &[Pair; 2]) -> Option<Self> {
        problem.options.prior.cycle?;
        let style = GaitStyle::default();
        let curves: Curves = (0..PHASES)
            .map(|k| {
                let right = Gait::dense().posture(k as f64 / PHASES as f64, &style).right;
                [right.shoulder, right.shoulder + right.elbow, right.hip, right.hip - right.knee]
            })
            .collect();
        let times_s = problem.times_s();
        let mut phase = Vec::with_capacity(times_s.len());
        while phase.len() < times_s.len() {
            let from = phase.len();
            let next = (from + 1..times_s.len()).find(|&t| times_s[t] - times_s[t - 1] > GAP_S);
            let to = next.unwrap_or(times_s.len());
            // 1. Costs of every phase, in steps of equal time, between which each frame is shared.
            let between = |t: usize| {
                let steps = (times_s[t] - times_s[from]) / STEP_S;
                (steps as usize, steps.fract())
            };
            let mut costs = vec![[0.0; PHASES]; between(to - 1).0 + 2];
            for t in from..to {
                let (step, later) = between(t);
                let [before, after] = &mut costs[step..].first_chunk_mut::<2>().expect("a step after it");
                for (k, (before, after)) in before.iter_mut().zip(after).enumerate() {
                    let cost = phase_cost(problem, limbs, &curves, t, k);
                    *before += (1.0 - later) * cost;
                    *after += later * cost;
                }
            }
            // 2. The path of least cost.
            let path = path(&costs);
            // 3. The phase of each frame, by its time between two steps.
            phase.extend((from..to).map(|t| {
                let (step, later) = between(t);
                let advance = (path[step + 1] + PHASES - path[step]) % PHASES;
                (path[step] as f64 + advance as f64 * later) % PHASES as f64
            }));
        }
        Some(Self { curves, phase })
    }

    /// Average swings of inner and outer segment of a limb in a frame; pair 0 is the arms.
    pub fn swings(&self, t: usize, pair: usize, side: usize) -> [f64; 2] {
        let (before, later) = (self.phase[t] as usize, self.phase[t].fract());
        let [before, after] = [before, before + 1].map(|phase| swings(&self.curves, phase, pair, side));
        [0, 1].map(|segment| before[segment] + later * (after[segment] - before[segment]))
    }
}

fn swings(curves: &Curves, phase: usize, pair: usize, side: usize) -> [f64; 2] {
    let shift = if side == Side::Left as usize { PHASES / 2 } else { 0 };
    let all = curves[(phase + shift) % PHASES];
    [all[2 * pair], all[2 * pair + 1]]
}

/// Cost of a phase in a frame: that of the cheapest roots of each limb.
fn phase_cost(problem: &Problem, limbs: &[Pair; 2], curves: &Curves, t: usize, phase: usize) -> f64 {
    let weight = 0.5 * problem.weight(t);
    let mut cost = 0.0;
    for (pair, limbs) in limbs.iter().enumerate() {
        for (side, frames) in limbs.frames.iter().enumerate() {
            let (limb, usual) = (&frames[t], swings(curves, phase, pair, side));
            let of = |bits: usize| {
                limb.cost[bits]
                    + weight * problem.options.prior.swing_cost(pair, limb.swing[bits], Some(usual))
            };
            cost += (0..4).map(of).fold(f64::INFINITY, f64::min);
        }
    }
    cost
}

/// The path of least cost through phases that advance steadily: at each step by [`ADVANCES`], which changes by at
/// most one from step to step.
fn path(costs: &[[f64; PHASES]]) -> Vec<usize> {
    let [slowest, fastest] = ADVANCES;
    let rates = fastest - slowest + 1;
    // Cost of the best path to a phase with the last advance; index phase * rates + advance - slowest.
    let mut best: Vec<f64> = (0..PHASES * rates).map(|i| costs[0][i / rates]).collect();
    let mut before: Vec<Vec<u8>> = Vec::with_capacity(costs.len());
    for own in &costs[1..] {
        let mut next = vec![f64::INFINITY; best.len()];
        let mut from = vec![0; best.len()];
        for phase in 0..PHASES {
            for rate in 0..rates {
                let start = (phase + PHASES - slowest - rate) % PHASES;
                for last in rate.saturating_sub(1)..(rate + 2).min(rates) {
                    let change = if last == rate { 0.0 } else { CHANGE_NATS };
                    let cost = best[start * rates + last] + change;
                    if cost < next[phase * rates + rate] {
                        next[phase * rates + rate] = cost;
                        from[phase * rates + rate] = last as u8;
                    }
                }
                next[phase * rates + rate] += own[phase];
            }
        }
        best = next;
        before.push(from);
    }
    let mut at = crate::estimate::viterbi::argmin(best.iter().copied());
    let mut phases = vec![at / rates];
    for from in before.iter().rev() {
        let (phase, rate) = (at / rates, at % rates);
        at = (phase + PHASES - slowest - rate) % PHASES * rates + usize::from(from[at]);
        phases.push(at / rates);
    }
    phases.reverse();
    phases
}

#[cfg(test)]
mod tests {
    use super::super::tests::sequence;
    use super::super::trunk::Trunk;
    use super::*;
    use crate::model::skeleton::Joint;
    use crate::posture::link::{LinkFrame, LinkOptions};
    use crate::posture::prior::MotionPrior;
    use crate::synth::Random;

    /// Costs of a path that was planted: squared differences of the phase, and noise.
    fn planted(phases: &[usize], seen: impl Fn(usize) -> bool) -> Vec<[f64; PHASES]> {
        let mut random = Random::new(3);
        let mut cost = |t: usize, k: usize| {
            let apart = phases[t].abs_diff(k).min(PHASES - phases[t].abs_diff(k)) as f64;
            let noise = f64::from(random.normal_pair()[0]);
            if seen(t) { 0.02 * apart * apart + noise } else { 0.0 }
        };
        (0..phases.len()).map(|t| std::array::from_fn(|k| cost(t, k))).collect()
    }

    /// A walk that becomes faster is followed, also through steps in which nothing was seen.
    #[test]
    fn a_planted_path_is_found() {
        let mut phases = vec![150];
        for t in 1..60 {
            phases.push((phases[t - 1] + 8 + t / 15) % PHASES);
        }
        for unseen in [60..60, 20..32] {
            let found = path(&planted(&phases, |t| !unseen.contains(&t)));
            for (t, (found, planted)) in found.iter().zip(&phases).enumerate() {
                let apart = found.abs_diff(*planted).min(PHASES - found.abs_diff(*planted));
                assert!(apart <= 8, "step {t}: {found} {planted}");
            }
        }
        assert_eq!(path(&planted(&[17], |_| true)).len(), 1);
    }

    /// The path has the least cost of all paths: each is tried, with few phases of the first step.
    #[test]
    fn no_other_path_costs_less() {
        let mut random = Random::new(8);
        let costs: Vec<[f64; PHASES]> =
            (0..4).map(|_| std::array::from_fn(|_| random.uniform(0.0, 2.0))).collect();
        let cost_of = |phases: &[usize]| {
            let advance = |pair: &[usize]| (pair[1] + PHASES - pair[0]) % PHASES;
            let rates: Vec<usize> = phases.windows(2).map(advance).collect();
            assert!(rates.iter().all(|rate| (ADVANCES[0]..=ADVANCES[1]).contains(rate)), "{rates:?}");
            assert!(rates.windows(2).all(|two| two[0].abs_diff(two[1]) <= 1), "{rates:?}");
            let changes = rates.windows(2).filter(|two| two[0] != two[1]).count() as f64;
            phases.iter().zip(&costs).map(|(&k, costs)| costs[k]).sum::<f64>() + CHANGE_NATS * changes
        };
        let found = cost_of(&path(&costs));
        let [slowest, fastest] = ADVANCES;
        let mut least = f64::INFINITY;
        for start in 0..PHASES {
            for first in slowest..=fastest {
                for second in (first - 1).max(slowest)..=(first + 1).min(fastest) {
                    for third in (second - 1).max(slowest)..=(second + 1).min(fastest) {
                        let phases = [0, first, first + second, first + second + third];
                        least = least.min(cost_of(&phases.map(|k| (start + k) % PHASES)));
                    }
                }
            }
        }
        assert!((found - least).abs() < 1e-9, "{found} {least}");
    }

    fn cycle_of(
        frames: &[LinkFrame],
        lengths: &crate::SegmentLengths,
        options: &LinkOptions,
    ) -> Option<Cycle> {
        let problem = Problem { frames, lengths, options };
        Cycle::find(&problem, &[0, 1].map(|pair| Pair::new(&problem, &Trunk::link(&problem)[0], pair)))
    }

    /// From the front a thigh is nearly as long in the image forward as backward. The phase tells them apart.
    #[test]
    fn thighs_of_another_gait_swing_as_the_phase_says() {
        for yaw_deg in [0.0, 30.0, 90.0, 180.0_f64] {
            let (truth, mut frames, lengths, options) = sequence(yaw_deg.to_radians());
            // A second without anybody begins a new path.
            frames[30..].iter_mut().for_each(|frame| frame.time_s += 1.0);
            let cycle = cycle_of(&frames, &lengths, &options).unwrap();
            let ahead = options.moving_direction.unwrap();
            let mut clear = 0;
            for (t, figure) in truth.iter().enumerate() {
                for (side, [hip, knee]) in
                    [[Joint::RightHip, Joint::RightKnee], [Joint::LeftHip, Joint::LeftKnee]]
                        .into_iter()
                        .enumerate()
                {
                    let swing = (figure[knee] - figure[hip]).normalize().dot(ahead).asin();
                    let usual = cycle.swings(t, 1, side)[0];
                    if swing.abs() > 12f64.to_radians() {
                        clear += 1;
                        assert!(swing * usual > 0.0, "{yaw_deg} deg, frame {t}: {swing} {usual}");
                    }
                }
            }
            assert!(clear > 40, "{clear}");
        }
    }

    /// Any motion has no phase.
    /// At 25 frames per second, every second frame is in the middle between two steps.
    #[test]
    fn how_times_are_rounded_does_not_decide() {
        let (_, frames, lengths, options) = sequence(0.5);
        let swings = |stretched: f64| {
            let mut frames = frames.clone();
            let times = (0..frames.len()).map(|t| 0.04 * t as f64 * stretched);
            frames.iter_mut().zip(times).for_each(|(frame, time_s)| frame.time_s = time_s);
            let cycle = cycle_of(&frames, &lengths, &options).unwrap();
            (0..frames.len()).flat_map(|t| cycle.swings(t, 1, 0)).collect::<Vec<_>>()
        };
        for (longer, shorter) in swings(1.0 + 1e-12).into_iter().zip(swings(1.0 - 1e-12)) {
            assert!((longer - shorter).abs() < 1e-6, "{longer} {shorter}");
        }
    }

    #[test]
    fn only_walks_have_a_phase() {
        let (_, frames, lengths, options) = sequence(0.0);
        assert!(cycle_of(&frames, &lengths, &LinkOptions { prior: MotionPrior::any(), ..options }).is_none());
    }
}
