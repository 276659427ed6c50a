//! Exact cover: the division of points into pieces with the smallest cost, and the certainty of each piece.
//!
//! Every subset of the points is visited once (dynamic programming over bit masks), so the smallest cost and the
//! sum over all covers are exact. Time and memory grow with 2^points.

/// Maximum number of points to cover.
pub const MOST_POINTS: usize = 16;

/// A set of points that may form a group, with its cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Bit mask of the points; not empty.
    pub mask: u32,
    /// Its cost, finite.
    pub cost: f64,
}

/// The cover of the smallest cost, and the cost and weight of all covers for each piece.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cover {
    /// Indices of its pieces, in the order of their lowest points.
    pub chosen: Vec<usize>,
    /// Sum of their costs.
    pub cost: f64,
    /// For each piece, the smallest cost of a cover that contains it; infinite if there is none.
    pub cost_with: Vec<f64>,
    /// For each piece, the share of the weight exp(-cost / temperature) of all covers that contain it.
    pub share: Vec<f64>,
}

/// The best cover of `points` points; `None` if the pieces cannot cover them.
///
/// Pieces are added in the order of the lowest point not covered, so that every cover is counted once. Let B(S)
/// be the smallest cost of covering the set S, and A(S) that of having covered all but S. Then
///
/// ```text
/// B(S) = min over pieces p that hold the lowest point of S of  cost(p) + B(S \ p)
/// ```
///
/// and the smallest cost with p is min over S of A(S) + cost(p) + B(S \ p). Sums of weights are computed in the
/// same way.
pub(super) fn best_cover(points: usize, pieces: &[Piece], temperature: f64) -> Option<Cover> {
    assert!((1..=MOST_POINTS).contains(&points), "between 1 and {MOST_POINTS} points can be covered");
    let by_lowest =
        |i: usize| pieces.iter().enumerate().filter(move |(_, p)| p.mask.trailing_zeros() as usize == i);
    let lowest: Vec<Vec<(usize, Piece)>> =
        (0..points).map(|i| by_lowest(i).map(|(index, &p)| (index, p)).collect()).collect();
    let fitting = |set: usize| {
        let pieces = &lowest[set.trailing_zeros() as usize];
        pieces.iter().copied().filter(move |(_, p)| p.mask as usize & !set == 0)
    };
    let full = (1usize << points) - 1;
    let mut least = vec![f64::INFINITY; full + 1];
    let mut taken = vec![usize::MAX; full + 1];
    least[0] = 0.0;
    for set in 1..=full {
        for (index, piece) in fitting(set) {
            let cost = piece.cost + least[set ^ piece.mask as usize];
            if cost < least[set] {
                (least[set], taken[set]) = (cost, index);
            }
        }
    }
    if !least[full].is_finite() {
        return None;
    }
    // Weights relative to the best cover of the same set, so that no significant weight underflows.
    let weight = |from: f64, to: f64, cost: f64| ((from - cost - to) / temperature).exp();
    let mut sum = vec![0.0; full + 1];
    sum[0] = 1.0;
    for set in 1..=full {
        if least[set].is_finite() {
            for (_, p) in fitting(set) {
                let rest = set ^ p.mask as usize;
                if least[rest].is_finite() {
                    sum[set] += weight(least[set], least[rest], p.cost) * sum[rest];
                }
            }
        }
    }
    let (mut reached, mut arrived) = (vec![f64::INFINITY; full + 1], vec![0.0; full + 1]);
    (reached[full], arrived[full]) = (0.0, 1.0 / sum[full]);
    let (mut cost_with, mut share) = (vec![f64::INFINITY; pieces.len()], vec![0.0; pieces.len()]);
    for set in (1..=full).rev() {
        if !(reached[set].is_finite() && least[set].is_finite()) {
            continue;
        }
        for (index, p) in fitting(set) {
            let rest = set ^ p.mask as usize;
            if least[rest].is_finite() {
                let factor = weight(least[set], least[rest], p.cost);
                cost_with[index] = f64::min(cost_with[index], reached[set] + p.cost + least[rest]);
                reached[rest] = reached[rest].min(reached[set] + p.cost);
                share[index] += arrived[set] * factor * sum[rest];
                arrived[rest] += arrived[set] * factor;
            }
        }
    }
    let mut chosen = Vec::new();
    let mut set = full;
    while set != 0 {
        chosen.push(taken[set]);
        set ^= pieces[taken[set]].mask as usize;
    }
    Some(Cover { chosen, cost: least[full], cost_with, share })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    /// All covers, by trying all pieces in all ways.
    fn all_covers(left: u32, pieces: &[Piece]) -> Vec<Vec<usize>> {
        if left == 0 {
            return vec![vec![]];
        }
        let mut covers = Vec::new();
        for (index, piece) in pieces.iter().enumerate() {
            if piece.mask & !left == 0 && piece.mask & (left & left.wrapping_neg()) != 0 {
                for mut rest in all_covers(left & !piece.mask, pieces) {
                    rest.insert(0, index);
                    covers.push(rest);
                }
            }
        }
        covers
    }

    #[test]
    fn equals_trying_every_cover() {
        let mut random = Random::new(5);
        for points in 1..=6 {
            let pieces: Vec<Piece> = (1u32..1 << points)
                .filter(|mask| mask.count_ones() <= 3)
                .flat_map(|mask| [mask; 2])
                .map(|mask| Piece { mask, cost: random.uniform(-0.2, 1.0) })
                .collect();
            let temperature = 0.3;
            let cover = best_cover(points, &pieces, temperature).unwrap();
            let all = all_covers((1 << points) - 1, &pieces);
            let cost = |c: &[usize]| c.iter().map(|&i| pieces[i].cost).sum::<f64>();
            let best = all.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap();
            assert_eq!(&cover.chosen, best);
            assert!((cover.cost - cost(best)).abs() < 1e-12);
            let total: f64 = all.iter().map(|c| (-cost(c) / temperature).exp()).sum();
            for index in 0..pieces.len() {
                let having = || all.iter().filter(|c| c.contains(&index));
                let least = having().map(|c| cost(c)).fold(f64::INFINITY, f64::min);
                let share = having().map(|c| (-cost(c) / temperature).exp()).sum::<f64>() / total;
                assert!((cover.cost_with[index] - least).abs() < 1e-12);
                assert!((cover.share[index] - share).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn points_without_a_piece_cannot_be_covered() {
        assert_eq!(best_cover(2, &[Piece { mask: 1, cost: 0.0 }], 1.0), None);
    }

    #[test]
    fn extreme_costs_give_numbers() {
        let piece = |mask, cost| Piece { mask, cost };
        let cover = best_cover(2, &[piece(1, 1e9), piece(2, 1e9), piece(3, -1e9)], 1e-3).unwrap();
        assert_eq!((cover.chosen, cover.share), (vec![2], vec![0.0, 0.0, 1.0]));
    }
}
