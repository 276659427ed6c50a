//! The second-order chain of swap bits of one limb group: best path, posterior, posterior from an anchor.
//!
//! A level (hip, knee, ankle) has one bit in every frame that shows it: swapped or not. The state holds the
//! bit of each level at the last frame that showed it (`last`) and at the frame before that (`before`), so a
//! level that is missing for some frames keeps its bits. With L levels there are 4^L states and 2^L
//! transitions from each; the time is linear in the number of frames.

/// The costs of one frame for the bits of the levels it shows.
#[derive(Debug, Clone)]
pub(super) struct Step {
    /// Bit mask of the levels this frame shows on both sides.
    pub seen: usize,
    /// Cost in nats of (before ^ last, last ^ now), both restricted to `seen`; index `(b << levels) | n`.
    pub motion: Vec<f64>,
}

/// Prior costs in nats.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    /// Cost of swapping all levels seen in a frame.
    pub as_is: f64,
    /// Cost of a difference between two neighbouring levels starting.
    pub partial_begin: f64,
    /// Cost of such a difference continuing for another frame.
    pub partial_stay: f64,
}

/// A chain over the frames that show at least one level.
pub(super) struct Chain<'a> {
    levels: usize,
    steps: &'a [Step],
    /// Prior cost per (seen, last, now), shared by all frames.
    prior: Vec<f64>,
    /// e^-cost of each prior cost.
    prior_weight: Vec<f64>,
}

/// Scaled forward and backward variables, `[step][state]`.
pub(super) struct Posterior {
    alpha: Vec<f64>,
    beta: Vec<f64>,
}

impl<'a> Chain<'a> {
    pub fn new(levels: usize, steps: &'a [Step], prior: Prior) -> Self {
        let n = 1 << levels;
        let table = (0..n * n * n).map(|i| {
            let (seen, last, now) = (i / (n * n), i / n % n, i % n);
            prior_cost(levels, seen, last, now, prior)
        });
        let prior: Vec<f64> = table.collect();
        Self { levels, steps, prior_weight: weights(&prior), prior }
    }

    fn states(&self) -> usize {
        1 << (2 * self.levels)
    }

    /// Calls `f(state, next_state, index of the motion cost, index of the prior cost)` for every transition.
    fn each_way(&self, seen: usize, mut f: impl FnMut(usize, usize, usize, usize)) {
        let (l, n) = (self.levels, 1 << self.levels);
        for before in 0..n {
            for last in 0..n {
                let kept = last & !seen;
                let next_before = (before & !seen) | (last & seen);
                let turn = ((before ^ last) & seen) << l;
                let mut bits = seen;
                loop {
                    let now = kept | bits;
                    let motion = turn | ((last ^ now) & seen);
                    f((before << l) | last, (next_before << l) | now, motion, (seen * n + last) * n + now);
                    if bits == 0 {
                        break;
                    }
                    bits = (bits - 1) & seen;
                }
            }
        }
    }

    /// The bits of least total cost per step: for each level, at the last frame that showed it.
    pub fn best_path(&self) -> Vec<usize> {
        let states = self.states();
        let mut cost = vec![f64::INFINITY; states];
        cost[0] = 0.0;
        let mut from = vec![0u16; states * self.steps.len()];
        for (step, from) in self.steps.iter().zip(from.chunks_mut(states)) {
            let mut next = vec![f64::INFINITY; states];
            self.each_way(step.seen, |state, to, motion, prior| {
                let c = step.motion[motion] + self.prior[prior];
                if cost[state] + c < next[to] {
                    next[to] = cost[state] + c;
                    from[to] = state as u16;
                }
            });
            cost = next;
        }
        let mut state = (0..states).fold(0, |best, s| if cost[s] < cost[best] { s } else { best });
        let mut path = vec![0; self.steps.len()];
        for (bits, from) in path.iter_mut().zip(from.chunks(states)).rev() {
            *bits = state & ((1 << self.levels) - 1);
            state = from[state].into();
        }
        path
    }

    /// Forward-backward, scaled at every step.
    pub fn posterior(&self) -> Posterior {
        let states = self.states();
        let mut alpha = vec![0.0; states * self.steps.len()];
        let mut now = vec![0.0; states];
        now[0] = 1.0;
        for (step, row) in self.steps.iter().zip(alpha.chunks_mut(states)) {
            self.forward(step, &now, row);
            now.copy_from_slice(row);
        }
        let mut beta = vec![1.0; states * self.steps.len()];
        for k in (1..self.steps.len()).rev() {
            let (earlier, later) = beta.split_at_mut(k * states);
            let row = &mut earlier[(k - 1) * states..];
            let later = &later[..states];
            row.fill(0.0);
            let step = &self.steps[k];
            let motion_weight = weights(&step.motion);
            self.each_way(step.seen, |state, to, motion, prior| {
                row[state] += motion_weight[motion] * self.prior_weight[prior] * later[to];
            });
            scale(row);
        }
        Posterior { alpha, beta }
    }

    fn forward(&self, step: &Step, now: &[f64], next: &mut [f64]) {
        next.fill(0.0);
        let motion_weight = weights(&step.motion);
        self.each_way(step.seen, |state, to, motion, prior| {
            next[to] += now[state] * motion_weight[motion] * self.prior_weight[prior];
        });
        scale(next);
    }

    /// Splits the path where its bits no longer determine one another. Returns the first steps of the runs; 0
    /// is always among them.
    ///
    /// The first step of a run is taken as correct. For each later step, the probability that its best-known
    /// level has the path's bit is computed; the run ends where this stays below `sure` for `patience` steps
    /// or to the end.
    pub fn runs(&self, path: &[usize], posterior: &Posterior, sure: f64, patience: usize) -> Vec<usize> {
        let (states, mask) = (self.states(), (1 << self.levels) - 1);
        let mut starts = Vec::new();
        let mut start = 0;
        while start < path.len() {
            starts.push(start);
            let mut now = posterior.alpha[start * states..][..states].to_vec();
            for (state, a) in now.iter_mut().enumerate() {
                if (state ^ path[start]) & self.steps[start].seen & mask != 0 {
                    *a = 0.0;
                }
            }
            let mut next = vec![0.0; states];
            let mut doubt = None;
            for (k, &bits) in path.iter().enumerate().skip(start + 1) {
                self.forward(&self.steps[k], &now, &mut next);
                std::mem::swap(&mut now, &mut next);
                let beta = &posterior.beta[k * states..][..states];
                let known = self.agreement(&now, beta, self.steps[k].seen, bits);
                if known >= sure {
                    doubt = None;
                } else if k - *doubt.get_or_insert(k) + 1 >= patience {
                    break;
                }
            }
            start = doubt.unwrap_or(path.len());
        }
        starts
    }

    /// The largest probability, over the visible levels, that a level has the path's bit.
    fn agreement(&self, alpha: &[f64], beta: &[f64], seen: usize, bits: usize) -> f64 {
        (0..self.levels)
            .filter(|level| seen >> level & 1 == 1)
            .map(|level| {
                let p = probability_set(alpha, beta, level);
                if bits >> level & 1 == 1 { p } else { 1.0 - p }
            })
            .fold(0.0, f64::max)
    }
}

impl Posterior {
    /// The probability that the level is swapped at the last frame up to `step` that showed it.
    pub fn exchanged(&self, step: usize, level: usize, levels: usize) -> f64 {
        let states = 1 << (2 * levels);
        let row = step * states..(step + 1) * states;
        probability_set(&self.alpha[row.clone()], &self.beta[row], level)
    }
}

fn probability_set(alpha: &[f64], beta: &[f64], level: usize) -> f64 {
    let (mut set, mut all) = (0.0, 0.0);
    for (state, (a, b)) in alpha.iter().zip(beta).enumerate() {
        all += a * b;
        if state >> level & 1 == 1 {
            set += a * b;
        }
    }
    if all > 0.0 { set / all } else { 0.5 }
}

fn weights(costs: &[f64]) -> Vec<f64> {
    costs.iter().map(|cost| (-cost).exp()).collect()
}

fn scale(row: &mut [f64]) {
    let most = row.iter().copied().fold(0.0, f64::max);
    if most > 0.0 {
        row.iter_mut().for_each(|v| *v /= most);
    }
}

/// Only levels visible in this frame count, and neighbours are neighbours among them.
fn prior_cost(levels: usize, seen: usize, last: usize, now: usize, prior: Prior) -> f64 {
    let shown: Vec<usize> = (0..levels).filter(|level| seen >> level & 1 == 1).collect();
    if shown.is_empty() {
        return 0.0;
    }
    let share = (now & seen).count_ones() as f64 / shown.len() as f64;
    let partial = shown.windows(2).map(|pair| {
        let differ = |bits: usize| (bits >> pair[0] ^ bits >> pair[1]) & 1 == 1;
        match (differ(last), differ(now)) {
            (_, false) => 0.0,
            (false, true) => prior.partial_begin,
            (true, true) => prior.partial_stay,
        }
    });
    prior.as_is * share + partial.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    /// Frames that show random levels, with arbitrary motion costs; costs in frames 0 and 1 too.
    fn drawn(levels: usize, frames: usize, random: &mut Random) -> Vec<Step> {
        let n = 1 << levels;
        let mut step = || {
            let seen = 1 + (random.uniform(0.0, (n - 1) as f64) as usize).min(n - 2);
            let mut motion = vec![0.0; n * n];
            for (i, cost) in motion.iter_mut().enumerate() {
                // The motion has no cost for levels that are not visible.
                if (i / n) & !seen == 0 && (i % n) & !seen == 0 {
                    *cost = random.uniform(0.0, 3.0);
                }
            }
            Step { seen, motion }
        };
        (0..frames).map(|_| step()).collect()
    }

    /// Every history of bits with its cost, level by level as in the module documentation: each level has a
    /// list of its own bits in the frames that show it; before the first it was not swapped.
    fn histories(levels: usize, steps: &[Step], prior: Prior) -> Vec<(Vec<Vec<usize>>, f64)> {
        let mut all: Vec<(Vec<Vec<usize>>, f64)> = vec![(vec![vec![]; levels], 0.0)];
        for step in steps {
            let shown: Vec<usize> = (0..levels).filter(|level| step.seen >> level & 1 == 1).collect();
            all = all
                .iter()
                .flat_map(|history| (0..1usize << shown.len()).map(move |choice| (history, choice)))
                .map(|((bits, cost), choice)| {
                    let last = |level: usize, back: usize| {
                        bits[level].len().checked_sub(back).map_or(0, |at| bits[level][at])
                    };
                    let now = |i: usize| choice >> i & 1;
                    let (mut turned_before, mut turned_now) = (0, 0);
                    for (i, &level) in shown.iter().enumerate() {
                        turned_before |= (last(level, 2) ^ last(level, 1)) << level;
                        turned_now |= (last(level, 1) ^ now(i)) << level;
                    }
                    let mut cost = cost + step.motion[(turned_before << levels) | turned_now];
                    cost += prior.as_is * choice.count_ones() as f64 / shown.len() as f64;
                    for i in 1..shown.len() {
                        let differed = last(shown[i - 1], 1) != last(shown[i], 1);
                        if now(i - 1) != now(i) {
                            cost += if differed { prior.partial_stay } else { prior.partial_begin };
                        }
                    }
                    let mut longer = bits.clone();
                    shown.iter().enumerate().for_each(|(i, &level)| longer[level].push(now(i)));
                    (longer, cost)
                })
                .collect();
        }
        all
    }

    /// Best path and probabilities against an enumeration of all histories.
    #[test]
    fn path_and_posterior_are_those_of_all_histories() {
        let prior = Prior { as_is: 0.7, partial_begin: 1.1, partial_stay: 0.4 };
        let mut random = Random::new(6);
        for (levels, frames) in [(1, 8), (2, 6), (3, 4), (2, 7), (3, 5)] {
            for _ in 0..4 {
                let steps = drawn(levels, frames, &mut random);
                let chain = Chain::new(levels, &steps, prior);
                let (path, posterior) = (chain.best_path(), chain.posterior());
                let all = histories(levels, &steps, prior);
                let total: f64 = all.iter().map(|(_, cost)| (-cost).exp()).sum();
                let (best, _) = all.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
                let mut shown = vec![0; levels];
                for (k, step) in steps.iter().enumerate() {
                    for (level, shown) in shown.iter_mut().enumerate() {
                        *shown += step.seen >> level & 1;
                        let Some(at) = shown.checked_sub(1) else { continue };
                        assert_eq!(path[k] >> level & 1, best[level][at], "step {k} level {level}");
                        let exchanged = all.iter().filter(|(bits, _)| bits[level][at] == 1);
                        let p = exchanged.map(|(_, cost)| (-cost).exp()).sum::<f64>() / total;
                        assert!((posterior.exchanged(k, level, levels) - p).abs() < 1e-12, "{k} {level}");
                    }
                }
            }
        }
    }

    /// Motion of one level in which every swap costs 9 nats; the `silent` frames carry no information.
    fn one_level(frames: usize, silent: &[usize]) -> Vec<Step> {
        let motion = |k: usize| if silent.contains(&k) { vec![0.0; 4] } else { vec![0.0, 9.0, 9.0, 18.0] };
        (0..frames).map(|k| Step { seen: 1, motion: motion(k) }).collect()
    }

    #[test]
    fn runs_end_where_motion_leaves_the_label_open_for_long() {
        let no_prior = Prior { as_is: 0.0, partial_begin: 0.0, partial_stay: 0.0 };
        let runs = |steps: &[Step], sure: f64, patience: usize| {
            let chain = Chain::new(1, steps, no_prior);
            chain.runs(&vec![0; steps.len()], &chain.posterior(), sure, patience)
        };
        assert_eq!(runs(&one_level(20, &[]), 0.95, 3), [0]);
        // After two silent frames it is unknown whether the label is the same as before.
        assert_eq!(runs(&one_level(20, &[8, 9]), 0.95, 3), [0, 8]);
        assert_eq!(runs(&one_level(20, &[8, 9, 14, 15]), 0.95, 3), [0, 8, 14]);
        // A probability of one half suffices if the caller asks for it.
        assert_eq!(runs(&one_level(20, &[8, 9]), 0.4, 3), [0]);
        // A single silent frame causes only a moment of doubt: the following frames continue from before it.
        let mut steps = one_level(20, &[8]);
        // Frame 9 compares itself with frame 7, whatever frame 8 is.
        steps[9].motion = vec![0.0, 9.0, 9.0, 0.0];
        assert_eq!(runs(&steps, 0.95, 3), [0]);
        // A doubt shorter than the patience begins a run if it lasts to the end: here at frame 18, and again
        // at 19.
        assert_eq!(runs(&one_level(20, &[18, 19]), 0.95, 12), [0, 18, 19]);
        assert_eq!(runs(&[], 0.95, 3), [] as [usize; 0]);
    }

    /// One certain level out of two is enough.
    #[test]
    fn a_run_goes_on_while_any_level_is_sure() {
        let motion = |is_silent: bool| {
            let cost = |i: usize| {
                let (turned_before, turned_now) = (i / 4, i % 4);
                let turns = |level: usize| (turned_before >> level & 1) + (turned_now >> level & 1);
                9.0 * (turns(0) as f64 + if is_silent { 0.0 } else { turns(1) as f64 })
            };
            (0..16).map(cost).collect()
        };
        let steps: Vec<Step> =
            (0..12).map(|k| Step { seen: 3, motion: motion((5..7).contains(&k)) }).collect();
        let chain = Chain::new(2, &steps, Prior { as_is: 0.0, partial_begin: 0.0, partial_stay: 0.0 });
        assert_eq!(chain.runs(&[0; 12], &chain.posterior(), 0.95, 2), [0]);
    }
}
