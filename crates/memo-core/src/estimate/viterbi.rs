//! Second-order path of least cost through a few states per frame, by dynamic programming.
//!
//! Cost = Σ u_t(s_t) + Σ a_t(s_{t-2}, s_{t-1}, s_t). A first-order cost cannot distinguish a value that
//! crosses zero from one that bounces off it; the change of velocity can, and it needs three frames. The
//! search runs over pairs of consecutive states.

/// The path of least cost. `counts[t]` is the number of states in frame t, each at least one.
///
/// `unary(t, s)` and `ternary(t, s_{t-2}, s_{t-1}, s_t)`, t >= 2, must not be NaN. Of states with equal cost
/// the lower one wins.
///
/// # Panics
///
/// If one of several frames has no state.
pub fn least_path(
    counts: &[usize],
    unary: impl Fn(usize, usize) -> f64,
    ternary: impl Fn(usize, usize, usize, usize) -> f64,
) -> Vec<usize> {
    let frames = counts.len();
    if frames < 2 {
        return counts.iter().map(|&n| argmin((0..n).map(|s| unary(0, s)))).collect();
    }
    assert!(counts.iter().all(|&n| n > 0), "each frame must have a state, got {counts:?}");
    // Cost of the best path that ends in states i, j of frames t-1, t; index i * n_t + j.
    let mut costs: Vec<f64> = (0..counts[0])
        .flat_map(|i| (0..counts[1]).map(move |j| [i, j]))
        .map(|[i, j]| unary(0, i) + unary(1, j))
        .collect();
    let mut best_before: Vec<Vec<u32>> = vec![vec![]; frames];
    for t in 2..frames {
        let [n2, n1, n0] = [counts[t - 2], counts[t - 1], counts[t]];
        let mut next = vec![f64::INFINITY; n1 * n0];
        let mut before = vec![0; n1 * n0];
        for k in 0..n2 {
            for i in 0..n1 {
                let start = costs[k * n1 + i];
                for j in 0..n0 {
                    let cost = start + ternary(t, k, i, j);
                    if cost < next[i * n0 + j] {
                        next[i * n0 + j] = cost;
                        before[i * n0 + j] = k as u32;
                    }
                }
            }
        }
        for j in 0..n0 {
            let own = unary(t, j);
            (0..n1).for_each(|i| next[i * n0 + j] += own);
        }
        costs = next;
        best_before[t] = before;
    }
    let mut states = vec![0; frames];
    let last = argmin(costs.iter().copied());
    [states[frames - 2], states[frames - 1]] = [last / counts[frames - 1], last % counts[frames - 1]];
    for t in (2..frames).rev() {
        states[t - 2] = best_before[t][states[t - 1] * counts[t] + states[t]] as usize;
    }
    states
}

/// Index of the smallest value, the first of equal ones; 0 without values.
pub fn argmin(costs: impl Iterator<Item = f64>) -> usize {
    costs.enumerate().reduce(|best, next| if next.1 < best.1 { next } else { best }).map_or(0, |best| best.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    /// The path of least cost, found by trying all paths.
    fn brute(
        counts: &[usize],
        unary: &dyn Fn(usize, usize) -> f64,
        ternary: &dyn Fn(usize, usize, usize, usize) -> f64,
    ) -> Vec<usize> {
        let mut paths = vec![(vec![], 0.0)];
        for (t, &n) in counts.iter().enumerate() {
            paths = paths
                .iter()
                .flat_map(|(path, cost): &(Vec<usize>, f64)| {
                    (0..n).map(move |s| {
                        let step = if t < 2 { 0.0 } else { ternary(t, path[t - 2], path[t - 1], s) };
                        let mut longer = path.clone();
                        longer.push(s);
                        (longer, cost + unary(t, s) + step)
                    })
                })
                .collect();
        }
        paths.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0
    }

    #[test]
    fn the_path_is_the_least_of_all_paths() {
        let counts = [vec![3, 2, 4, 1, 3, 2], vec![2, 2], vec![4], vec![1, 3, 3], vec![2; 11]];
        for (seed, counts) in counts.into_iter().enumerate() {
            let draw = |key: usize| Random::new(key as u64 * 7919 + seed as u64).uniform(0.0, 1.0);
            let unary = |t: usize, s: usize| draw(t * 10 + s);
            let ternary =
                |t: usize, k: usize, i: usize, j: usize| 2.0 * draw(1000 + ((t * 10 + k) * 10 + i) * 10 + j);
            assert_eq!(least_path(&counts, unary, ternary), brute(&counts, &unary, &ternary));
        }
        assert!(least_path(&[], |_, _| 0.0, |_, _, _, _| 0.0).is_empty());
    }

    #[test]
    #[should_panic(expected = "each frame must have a state, got [2, 2, 0]")]
    fn a_frame_without_a_state_is_refused() {
        least_path(&[2, 2, 0], |_, _| 0.0, |_, _, _, _| 0.0);
    }

    /// |x| is known and x swings through zero: the second-order path crosses zero.
    #[test]
    fn a_swing_known_up_to_sign_crosses_zero_and_does_not_bounce() {
        let swing: Vec<f64> = (0..60).map(|t| (t as f64 * 0.2 + 0.37).sin()).collect();
        let value = |t: usize, s: usize| if s == 0 { swing[t].abs() } else { -swing[t].abs() };
        let found = least_path(
            &[2; 60],
            |t, s| if t == 0 && s == 1 { 1.0 } else { 0.0 },
            |t, k, i, j| (value(t, j) - 2.0 * value(t - 1, i) + value(t - 2, k)).powi(2),
        );
        assert!(found.iter().enumerate().all(|(t, &s)| (value(t, s) - swing[t]).abs() < 1e-12));
    }

    #[test]
    fn of_equal_costs_the_lower_state_wins() {
        for frames in 1..6 {
            let found = least_path(&vec![3; frames], |_, _| 1.0, |_, _, _, _| 2.0);
            assert_eq!(found, vec![0; frames]);
            // The first state is too expensive: the second state wins over the third, which has the same
            // cost.
            let found = least_path(&vec![3; frames], |_, s| if s == 0 { 9.0 } else { 1.0 }, |_, _, _, _| 0.0);
            assert_eq!(found, vec![1; frames]);
        }
        assert_eq!(argmin([2.0, 1.0, 3.0, 1.0].into_iter()), 1);
    }
}
