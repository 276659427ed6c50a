//! The second-order chain of exchange bits of one limb group: best path, posterior, posterior from an anchor.
//!
//! A level (hip, knee, ankle) has at every frame that shows it a bit: exchanged or not. The state holds every
//! level's bit at the last frame that showed it (`last`) and at the one before (`before`), so a level that is
//! missing for some frames simply waits. With L levels there are 4^L states and 2^L ways on from each; the
//! work is linear in the number of frames.

/// What one frame says about the bits of the levels it shows.
#[derive(Debug, Clone)]
pub(super) struct Step {
    /// Bit mask of the levels this frame shows on both sides.
    pub seen: usize,
    /// Cost in nats of (before ^ last, last ^ now), both restricted to `seen`: index `(b << levels) | n`.
    pub motion: Vec<f64>,
}

/// Prior costs in nats.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    /// Of exchanging all levels seen in a frame.
    pub as_is: f64,
    /// Of two neighbouring levels beginning to differ.
    pub partial_begin: f64,
    /// Of two neighbouring levels differing for a further frame.
    pub partial_stay: f64,
}

/// A chain over the frames that show at least one level.
pub(super) struct Chain<'a> {
    levels: usize,
    steps: &'a [Step],
    /// Prior cost per (seen, last, now), shared by all frames.
    prior: Vec<f64>,
    /// e^-cost of each.
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

    /// Calls `f(state, next_state, index of the motion's cost, index of the prior's)` for every way on.
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

    /// The bits of least total cost per step: of every level at the last frame that showed it.
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

    /// Where the path's bits stop following from one another: first steps of the runs, 0 always among them.
    ///
    /// From the first step of a run, taken as right, the probability that a later step's best-known level has
    /// the path's bit is followed; a run ends where it stays under `sure` for `patience` steps or to the end.
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

    /// The greatest probability, over the levels seen, that a level has the path's bit.
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
    /// The probability that the level is exchanged at the last frame up to `step` that showed it.
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

/// Only levels seen in this frame count; neighbours are neighbours among them.
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
