//! Stretches of a linked path that could be read the other way round.
//!
//! Between two moments in which a segment stands perpendicular to its ray, all its roots may be mirrored
//! together: an excursion. The dynamic program remembers two frames; whether a limb crossed or bounced is
//! decided better by its whole motion before and after. So every excursion of a path is mirrored on trial and
//! costed by a Kalman filter run over it, and the mirrored one kept where it costs less. What the others
//! would cost is the margin of the choice.

use rayon::prelude::*;

use super::super::prior::capped;
use super::super::smooth::{Innovation, Measured, filter_step};

/// Time before and after a stretch over which it is judged, seconds.
const AROUND_S: f64 = 0.5;

/// Longest stretch, in excursions. A stride holds about four.
const LONGEST: usize = 4;

/// Rounds of mirroring; each takes every mirroring that helps and does not touch a better one.
const ROUNDS: usize = 8;

/// Innovations whose variances are multiplied before a logarithm is taken: far from where floats end.
const LOG_EVERY: usize = 8;

/// Something that is read in one of several states a frame; each bit of a state is the root of a segment.
pub(super) struct Chain<'a> {
    /// Times of the frames, seconds.
    pub times_s: &'a [f64],
    /// Acceleration of each bit's segment, m/s².
    pub acceleration_mps2: &'a [f64],
    /// Sets of bits that may be mirrored together.
    pub masks: &'a [usize],
    /// The bits whose extents change with those of a mask.
    pub affected: fn(usize) -> usize,
    /// `(bit, frame, state)`: signed extent of the bit's segment along the ray.
    pub extent: &'a (dyn Fn(usize, usize, usize) -> Measured + Sync),
    /// `(frame, state)`: cost of a state by itself, nats.
    pub cost: &'a (dyn Fn(usize, usize) -> f64 + Sync),
}

/// One stretch mirrored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flip {
    /// The bits that change.
    pub mask: usize,
    /// First frame.
    pub from: usize,
    /// One past the last frame.
    pub to: usize,
    /// What it costs more, nats.
    pub delta: f64,
}

impl Chain<'_> {
    /// Mirrors what is better mirrored.
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

    /// All mirrorings of a path, cheapest first; of equal ones the earlier.
    pub fn flips(&self, states: &[usize]) -> Vec<Flip> {
        self.flips_near(states, &[[0, states.len()]])
    }

    /// The mirrorings whose cost depends on any of some stretches, cheapest first.
    fn flips_near(&self, states: &[usize], stretches: &[[usize; 2]]) -> Vec<Flip> {
        let mut spans: Vec<[usize; 3]> = Vec::new();
        for &mask in self.masks {
            let bounds = self.bounds(states, mask.trailing_zeros() as usize);
            for (i, &from) in bounds.iter().enumerate() {
                let ends = bounds[i + 1..].iter().take(LONGEST);
                spans.extend(ends.map(|&to| [mask, from, to]));
            }
            if bounds.len() > LONGEST + 1 {
                spans.push([mask, 0, states.len()]);
            }
        }
        let mut flips: Vec<Flip> = spans
            .into_par_iter()
            .filter(|&[_, from, to]| overlaps(stretches, self.around(from, to)))
            .map(|[mask, from, to]| Flip { mask, from, to, delta: self.delta(states, mask, from, to) })
            .collect();
        flips.sort_by(|a, b| a.delta.total_cmp(&b.delta));
        flips
    }

    /// Frames in which a bit's segment may pass perpendicular to its ray, with the first frame and the end.
    fn bounds(&self, states: &[usize], bit: usize) -> Vec<usize> {
        let extents: Vec<Measured> =
            states.iter().enumerate().map(|(t, &state)| (self.extent)(bit, t, state)).collect();
        let size = |t: usize| extents[t].value.abs();
        let mut bounds = vec![0];
        for t in 1..states.len() {
            let least = size(t) <= size(t - 1) && (t + 1 == states.len() || size(t) < size(t + 1));
            let crossing = extents[t - 1].value * extents[t].value < 0.0;
            let unseen = extents[t].value.is_nan() != extents[t - 1].value.is_nan();
            if crossing || unseen || (least && size(t) <= 2.0 * extents[t].sd) {
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

    /// Cost of mirroring a stretch.
    pub fn delta(&self, states: &[usize], mask: usize, from: usize, to: usize) -> f64 {
        let reach = self.around(from, to);
        let mirrored = |t: usize| if (from..to).contains(&t) { states[t] ^ mask } else { states[t] };
        let own: f64 = (from..to).map(|t| (self.cost)(t, states[t] ^ mask) - (self.cost)(t, states[t])).sum();
        let affected = (self.affected)(mask);
        own + self.motion(affected, reach, mirrored) - self.motion(affected, reach, |t| states[t])
    }

    /// Cost of a path: its states' and its motion's.
    pub fn total(&self, states: &[usize]) -> f64 {
        let own: f64 = states.iter().enumerate().map(|(t, &state)| (self.cost)(t, state)).sum();
        let all = (1 << self.acceleration_mps2.len()) - 1;
        own + self.motion(all, [0, states.len()], |t| states[t])
    }

    /// Negative log likelihood of some segments' motion over a stretch.
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

/// Negative log likelihood of a track, (time in seconds, measurement) after the other, under a motion of that
/// acceleration: Σ ½ min(ν²/S, cap) + ½ ln S over innovations ν of variance S.
fn motion_cost(track: impl Iterator<Item = (f64, Measured)>, acceleration_sd: f64) -> f64 {
    let mut cost = 0.0;
    // Logarithms of products: one for several frames.
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
