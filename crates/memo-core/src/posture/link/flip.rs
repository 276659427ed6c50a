//! Mirrored stretches of a linked path.
//!
//! An excursion is the interval between two times at which a segment is perpendicular to its ray. All its roots
//! may be mirrored together. The dynamic program uses two previous frames; whether a limb crossed or bounced is
//! decided better by its whole motion before and after. So every excursion of a path is mirrored on trial, with a
//! cost from a Kalman filter run over it, and stays mirrored if that costs less. The extra cost of the other
//! choice is the margin.

use rayon::prelude::*;

use super::super::prior::capped;
use crate::estimate::smooth::{Innovation, Measured, filter_step};

/// Time before and after a stretch that is included in its cost, seconds.
const AROUND_S: f64 = 0.5;

/// Longest stretch, in excursions. A stride has about four.
const LONGEST: usize = 4;

/// Rounds of mirroring. Each round applies all mirrorings that reduce the cost and do not overlap a better one.
const ROUNDS: usize = 8;

/// An extent smaller than this share of its standard deviation is zero: that of a segment too short to reach its ray is
/// either sign of a rounding error.
const ZERO_SD: f64 = 1e-6;

/// Number of innovations whose variances are multiplied before a logarithm is taken: far from overflow.
const LOG_EVERY: usize = 8;

/// A chain with one of several states per frame; each bit of a state is the root of a segment.
pub(super) struct Chain<'a> {
    /// Times of the frames, seconds.
    pub times_s: &'a [f64],
    /// Acceleration of each bit's segment, m/s².
    pub acceleration_mps2: &'a [f64],
    /// Sets of bits that may be mirrored together.
    pub masks: &'a [usize],
    /// The bits of a mask whose excursions are those of the mask: of both sides alike.
    pub leading: fn(usize) -> usize,
    /// The bits whose extents change if those of a mask change.
    pub affected: fn(usize) -> usize,
    /// `(bit, frame, state)`: signed extent of the bit's segment along the ray.
    pub extent: &'a (dyn Fn(usize, usize, usize) -> Measured + Sync),
    /// `(frame, state)`: cost of a state alone, nats.
    pub cost: &'a (dyn Fn(usize, usize) -> f64 + Sync),
}

/// A mirrored stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flip {
    /// The bits that change.
    pub mask: usize,
    /// First frame.
    pub from: usize,
    /// One past the last frame.
    pub to: usize,
    /// Extra cost, nats.
    pub delta: f64,
}

impl Chain<'_> {
    /// Applies the mirrorings that reduce the cost.
    pub fn refine(&self, states: &mut [usize]) {
        let everywhere = vec![[0, states.len()]];
        let mut changed = everywhere;
        for _ in 0..ROUNDS {
            let flips = self.flips_near(states, &changed);
            changed = Vec::new();
            for flip in flips.into_iter().take_while(|flip| flip.delta < -1e-9) {
                let reach = self.around(flip.from, flip.to);
                if !overlaps(&changed, reach) {
                    states[flip.from..flip.to].iter_mut().for_each(|state| *state ^= flip.mask);
                    changed.push(reach);
                }
            }
            if changed.is_empty() {
                break;
            }
        }
    }

    /// All mirrorings of a path, cheapest first; among equal ones the earlier first.
    pub fn flips(&self, states: &[usize]) -> Vec<Flip> {
        self.flips_near(states, &[[0, states.len()]])
    }

    /// The mirrorings whose cost depends on any of the given stretches, cheapest first.
    fn flips_near(&self, states: &[usize], stretches: &[[usize; 2]]) -> Vec<Flip> {
        let mut spans: Vec<[usize; 3]> = Vec::new();
        let all_bounds: Vec<Vec<usize>> =
            (0..self.acceleration_mps2.len()).map(|bit| self.bounds(states, bit)).collect();
        for &mask in self.masks {
            let leading = (self.leading)(mask);
            for (_, bounds) in all_bounds.iter().enumerate().filter(|(bit, _)| leading >> bit & 1 == 1) {
                for (i, &from) in bounds.iter().enumerate() {
                    let ends = bounds[i + 1..].iter().take(LONGEST);
                    spans.extend(ends.map(|&to| [mask, from, to]));
                }
                spans.push([mask, 0, states.len()]);
            }
        }
        spans.sort_unstable();
        spans.dedup();
        let mut flips: Vec<Flip> = spans
            .into_par_iter()
            .filter(|&[_, from, to]| overlaps(stretches, self.around(from, to)))
            .map(|[mask, from, to]| Flip { mask, from, to, delta: self.delta(states, mask, from, to) })
            .collect();
        flips.sort_by(|a, b| a.delta.total_cmp(&b.delta));
        flips
    }

    /// Frames at which a bit's segment may be perpendicular to its ray or begins or ends to be too short for it, with the
    /// first frame and the end.
    fn bounds(&self, states: &[usize], bit: usize) -> Vec<usize> {
        let extent = |(t, &state): (usize, &usize)| {
            let Measured { value, sd } = (self.extent)(bit, t, state);
            Measured { value: if value.abs() <= ZERO_SD * sd { 0.0 } else { value }, sd }
        };
        let extents: Vec<Measured> = states.iter().enumerate().map(extent).collect();
        let size = |t: usize| extents[t].value.abs();
        let mut bounds = vec![0];
        for t in 1..states.len() {
            let least = size(t) <= size(t - 1) && (t + 1 == states.len() || size(t) < size(t + 1));
            let crossing = extents[t - 1].value * extents[t].value < 0.0;
            let unseen = extents[t].value.is_nan() != extents[t - 1].value.is_nan();
            // Frames in which the segment is too short belong to the excursion before or after them.
            let is_short = |t: usize| size(t) == 0.0;
            let short = is_short(t) != is_short(t - 1);
            if crossing || unseen || short || (least && size(t) <= 2.0 * extents[t].sd) {
                bounds.push(t);
            }
        }
        bounds.push(states.len());
        bounds.dedup();
        bounds
    }

    fn around(&self, from: usize, to: usize) -> [usize; 2] {
        let times = self.times_s;
        let first = times.partition_point(|&time| time < times[from] - AROUND_S);
        [first, times.partition_point(|&time| time <= times[to - 1] + AROUND_S)]
    }

    /// Extra cost of mirroring a stretch.
    pub fn delta(&self, states: &[usize], mask: usize, from: usize, to: usize) -> f64 {
        let reach = self.around(from, to);
        let mirrored = |t: usize| if (from..to).contains(&t) { states[t] ^ mask } else { states[t] };
        let own: f64 = (from..to).map(|t| (self.cost)(t, states[t] ^ mask) - (self.cost)(t, states[t])).sum();
        let affected = (self.affected)(mask);
        own + self.motion(affected, reach, mirrored) - self.motion(affected, reach, |t| states[t])
    }

    /// Cost of a path: of its states and of its motion.
    pub fn total(&self, states: &[usize]) -> f64 {
        let own: f64 = states.iter().enumerate().map(|(t, &state)| (self.cost)(t, state)).sum();
        let all = (1 << self.acceleration_mps2.len()) - 1;
        own + self.motion(all, [0, states.len()], |t| states[t])
    }

    /// Negative log likelihood of the motion of some segments over a stretch.
    fn motion(&self, bits: usize, [from, to]: [usize; 2], state: impl Fn(usize) -> usize) -> f64 {
        let moving = self.acceleration_mps2.iter().enumerate().filter(|(bit, _)| bits >> bit & 1 == 1);
        moving
            .map(|(bit, &acceleration)| {
                let track = (from..to).map(|t| (self.times_s[t], (self.extent)(bit, t, state(t))));
                motion_cost(track, acceleration)
            })
            .sum()
    }
}

fn overlaps(stretches: &[[usize; 2]], [from, to]: [usize; 2]) -> bool {
    stretches.iter().any(|stretch| stretch[0] < to && from < stretch[1])
}

/// Negative log likelihood of a track of (time in seconds, measurement), for a motion with that acceleration: Σ ½
/// min(ν²/S, cap) + ½ ln S over innovations ν of variance S.
fn motion_cost(track: impl Iterator<Item = (f64, Measured)>, acceleration_sd: f64) -> f64 {
    let mut cost = 0.0;
    // Logarithms of products: one logarithm for several frames.
    let (mut variances, mut factors) = (1.0, 0);
    let mut filter = None;
    let mut before_s = None;
    for (time_s, measured) in track {
        let step_s = before_s.map_or(0.0, |before| time_s - before);
        before_s = Some(time_s);
        let (next, innovation) = filter_step(filter, step_s, measured, acceleration_sd);
        filter = next;
        if let Some(Innovation { value, variance }) = innovation {
            cost += capped(value * value / variance);
            variances *= variance;
            factors += 1;
            if factors == LOG_EVERY {
                cost += f64::ln(std::mem::replace(&mut variances, 1.0));
                factors = 0;
            }
        }
    }
    0.5 * (cost + variances.ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    /// A track of noisy positions, one of them an outlier.
    fn track(frames: usize) -> Vec<(f64, Measured)> {
        let mut random = Random::new(2);
        (0..frames)
            .map(|t| {
                let value = 0.2 * (0.3 * t as f64).sin() + 0.02 * f64::from(random.normal_pair()[0]);
                let off = if t == 13 { 3.0 } else { 0.0 };
                let measured =
                    if t == 5 { Measured::NOTHING } else { Measured { value: value + off, sd: 0.03 } };
                (0.04 * t as f64 + random.uniform(0.0, 0.02), measured)
            })
            .collect()
    }

    /// The likelihood of normal innovations, frame by frame, with outliers capped at 25.
    #[test]
    fn the_cost_of_a_motion_is_its_likelihood() {
        for frames in [1, 2, 7, 8, 9, 10, 30] {
            let track = track(frames);
            let (mut filter, mut before_s, mut cost) = (None, track[0].0, 0.0);
            let mut capped = 0;
            for &(time_s, measured) in &track {
                let (next, innovation) = filter_step(filter, time_s - before_s, measured, 3.0);
                (filter, before_s) = (next, time_s);
                let Some(Innovation { value, variance }) = innovation else { continue };
                let square: f64 = value * value / variance;
                capped += usize::from(square > 25.0);
                cost += 0.5 * (square.min(25.0) + variance.ln());
            }
            assert_eq!(capped > 0, frames == 30);
            assert!((motion_cost(track.into_iter(), 3.0) - cost).abs() < 1e-9, "{frames}");
        }
    }

    /// Two connected segments with four states per frame; bit 0 also changes the extent of bit 1.
    fn extent(bit: usize, t: usize, state: usize) -> Measured {
        let size = if bit == 0 { (0.25 * t as f64 - 2.0).sin() } else { 0.3 + 0.02 * t as f64 };
        let is_far = |bit: usize| state >> bit & 1 == 1;
        let value = match bit {
            0 => {
                if is_far(0) {
                    size
                } else {
                    -size
                }
            }
            _ => (if is_far(1) { size } else { -size }) + if is_far(0) { 0.1 } else { 0.0 },
        };
        Measured { value, sd: 0.02 }
    }

    fn chain<'a>(
        times_s: &'a [f64],
        cost: &'a (dyn Fn(usize, usize) -> f64 + Sync),
        extent: &'a (dyn Fn(usize, usize, usize) -> Measured + Sync),
    ) -> Chain<'a> {
        let affected = |mask: usize| if mask & 1 == 1 { 3 } else { mask };
        Chain {
            times_s,
            acceleration_mps2: &[4.0, 6.0],
            masks: &[1, 2, 3],
            leading: |mask| mask,
            affected,
            extent,
            cost,
        }
    }

    /// If the whole path is within the cost of the stretch, the extra cost of mirroring is the difference of the
    /// totals.
    #[test]
    fn mirroring_costs_the_difference_of_the_paths() {
        let times_s: Vec<f64> = (0..10).map(|t| 0.04 * t as f64).collect();
        let cost = |t: usize, state: usize| 0.3 * ((t * 7 + state * 5) % 4) as f64;
        let chain = chain(&times_s, &cost, &extent);
        let states = [0, 3, 1, 0, 2, 2, 3, 0, 0, 1];
        let flips = chain.flips(&states);
        assert!(flips.len() > 5 && flips.is_sorted_by(|a, b| a.delta <= b.delta), "{flips:?}");
        for flip in flips {
            let mut mirrored = states;
            mirrored[flip.from..flip.to].iter_mut().for_each(|state| *state ^= flip.mask);
            let difference = chain.total(&mirrored) - chain.total(&states);
            assert!((flip.delta - difference).abs() < 1e-9, "{flip:?} {difference}");
        }
    }

    /// The cost of a stretch includes half a second before and after it.
    #[test]
    fn a_stretch_is_judged_by_what_is_around_it() {
        let times_s: Vec<f64> = (0..100).map(|t| 0.04 * t as f64).collect();
        let none = |_: usize, _: usize| 0.0;
        let chain = chain(&times_s, &none, &extent);
        assert_eq!(chain.around(40, 50), [28, 62]);
        assert_eq!(chain.around(3, 98), [0, 100]);
    }

    /// Where an extent crosses zero, where it is smallest and not clearly different from zero, where it is not
    /// seen.
    #[test]
    fn stretches_begin_where_a_segment_may_stand_across_its_ray() {
        let times_s: Vec<f64> = (0..12).map(|t| 0.04 * t as f64).collect();
        let none = |_: usize, _: usize| 0.0;
        let bounds = |values: [f64; 12], sd: f64| {
            let extent = move |_: usize, t: usize, _: usize| Measured { value: values[t], sd };
            chain(&times_s, &none, &extent).bounds(&[0; 12], 0)
        };
        let high = 0.5;
        let mut crossing = [high; 12];
        crossing[6..].fill(-high);
        assert_eq!(bounds(crossing, 0.01), [0, 6, 12]);
        let mut dip = [high; 12];
        dip[7] = 0.1;
        assert_eq!(bounds(dip, 0.01), [0, 12]);
        assert_eq!(bounds(dip, 0.06), [0, 7, 12]);
        let mut unseen = [high; 12];
        unseen[3..5].fill(f64::NAN);
        assert_eq!(bounds(unseen, 0.01), [0, 3, 5, 12]);
        // Where the segment is too short to reach its ray, the extent is zero but for rounding.
        let short = |rounded: [f64; 4]| {
            let mut values = [high; 12];
            values[4..8].copy_from_slice(&rounded);
            bounds(values, 0.01)
        };
        assert_eq!(short([0.0; 4]), [0, 4, 7, 8, 12]);
        assert_eq!(short([1e-15, -1e-15, 2e-15, -1e-16]), short([0.0; 4]));
    }

    /// A path mirrored over a stretch is corrected, for any number of excursions in the stretch.
    #[test]
    fn what_is_better_mirrored_is_mirrored() {
        let times_s: Vec<f64> = (0..120).map(|t| 0.04 * t as f64).collect();
        let none = |_: usize, _: usize| 0.0;
        let swing = |_: usize, t: usize, state: usize| {
            let value = 0.4 * (0.25 * t as f64).sin();
            Measured { value: if state & 1 == 1 { value } else { -value }, sd: 0.03 }
        };
        let affected = |mask: usize| mask;
        let chain = Chain {
            times_s: &times_s,
            acceleration_mps2: &[15.0],
            masks: &[1],
            leading: |mask| mask,
            affected,
            extent: &swing,
            cost: &none,
        };
        // Truth: the same state throughout. Wrong between two zero crossings, 12 or 13 frames apart: one
        // excursion, and three together.
        for (from, to) in [(13, 26), (26, 63)] {
            let mut states = vec![0; 120];
            states[from..to].fill(1);
            chain.refine(&mut states);
            // Within the noise of zero the state cannot be determined.
            let is_clear = |t: usize| swing(0, t, 0).value.abs() > 0.03;
            let clear: Vec<usize> = (0..120).filter(|&t| is_clear(t)).map(|t| states[t]).collect();
            assert!(clear.iter().all(|state| *state == clear[0]), "{states:?}");
        }
    }
}
