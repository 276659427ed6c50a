//! Pairs of two kinds whose costs have the smallest sum (the assignment problem).
//!
//! Shortest augmenting paths with potentials, O(rows² columns): R. Jonker and A. Volgenant, Computing 38:325, 1987.

/// For every row the column it is paired with, or `None`: of all ways to leave a row alone at the cost `alone` or to pair
/// it with a column of its own at `cost(row, column)`, one with the smallest sum. A cost that is not finite is no pair.
pub fn assignment(
    rows: usize,
    columns: usize,
    alone: f64,
    cost: impl Fn(usize, usize) -> f64,
) -> Vec<Option<usize>> {
    // Each row has a column of its own in which it is alone.
    let width = columns + rows;
    let costs: Vec<f64> = (0..rows)
        .flat_map(|row| (0..width).map(move |column| (row, column)))
        .map(|(row, column)| match column.checked_sub(columns) {
            None => cost(row, column),
            Some(own) if own == row => alone,
            Some(_) => f64::INFINITY,
        })
        .map(|cost| if cost.is_finite() { cost } else { f64::INFINITY })
        .collect();
    let cost = |row: usize, column: usize| costs[row * width + column];
    let (mut of_row, mut of_column) = (vec![0.0; rows], vec![0.0; width]);
    let mut row_of: Vec<Option<usize>> = vec![None; width];
    for first in 0..rows {
        // 1. The shortest path from the row to a free column, over pairs that are made already.
        let (mut least, mut before) = (vec![f64::INFINITY; width], vec![None; width]);
        let mut done = vec![false; width];
        let (mut row, mut from, mut length) = (first, None, 0.0);
        let end = loop {
            for column in (0..width).filter(|&column| !done[column]) {
                let to = length + cost(row, column) - of_row[row] - of_column[column];
                if to < least[column] {
                    (least[column], before[column]) = (to, from);
                }
            }
            let nearest = (0..width)
                .filter(|&column| !done[column])
                .min_by(|&a, &b| least[a].total_cmp(&least[b]))
                .expect("a row can be alone");
            (done[nearest], length, from) = (true, least[nearest], Some(nearest));
            match row_of[nearest] {
                Some(next) => row = next,
                None => break nearest,
            }
        };
        // 2. The potentials that keep every pair on a shortest path.
        of_row[first] += length;
        for column in (0..width).filter(|&column| done[column] && column != end) {
            let paired = row_of[column].expect("only the last column of a path is free");
            of_row[paired] += length - least[column];
            of_column[column] -= length - least[column];
        }
        // 3. The pairs along the path exchanged.
        let mut column = end;
        while let Some(earlier) = before[column] {
            row_of[column] = row_of[earlier];
            column = earlier;
        }
        row_of[column] = Some(first);
    }
    let mut column_of = vec![None; rows];
    for (column, row) in row_of.iter().take(columns).enumerate() {
        if let Some(row) = row {
            column_of[*row] = Some(column);
        }
    }
    column_of
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::random::Random;

    /// The smallest sum over all ways, by trying them.
    fn least(costs: &[Vec<f64>], alone: f64, row: usize, used: &mut Vec<bool>) -> f64 {
        if row == costs.len() {
            return 0.0;
        }
        let mut best = alone + least(costs, alone, row + 1, used);
        for column in 0..used.len() {
            if !used[column] && costs[row][column].is_finite() {
                used[column] = true;
                best = best.min(costs[row][column] + least(costs, alone, row + 1, used));
                used[column] = false;
            }
        }
        best
    }

    #[test]
    fn no_other_way_to_pair_costs_less() {
        let mut random = Random::new(5);
        for draw in 0..400 {
            let [rows, columns] = [draw % 6, draw / 7 % 6];
            let mut one =
                || if random.uniform(0.0, 1.0) < 0.2 { f64::NAN } else { random.uniform(-1.0, 3.0).round() };
            let costs: Vec<Vec<f64>> = (0..rows).map(|_| (0..columns).map(|_| one()).collect()).collect();
            let found = assignment(rows, columns, 1.5, |row, column| costs[row][column]);
            let sum: f64 = (0..rows).map(|row| found[row].map_or(1.5, |column| costs[row][column])).sum();
            let mut taken: Vec<usize> = found.iter().copied().flatten().collect();
            taken.sort_unstable();
            taken.dedup();
            assert_eq!(taken.len(), found.iter().flatten().count(), "a column of its own: {found:?}");
            let wanted = least(&costs, 1.5, 0, &mut vec![false; columns]);
            assert!((sum - wanted).abs() < 1e-9, "{sum} instead of {wanted}: {costs:?}");
        }
    }

    #[test]
    fn nobody_is_paired_with_nobody() {
        assert_eq!(assignment(0, 3, 1.0, |_, _| 0.0), []);
        assert_eq!(assignment(2, 0, 1.0, |_, _| 0.0), [None, None]);
        assert_eq!(assignment(2, 2, 1.0, |_, _| f64::INFINITY), [None, None]);
    }
}
