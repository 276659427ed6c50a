//! Normal equations of a frame: those over the coordinates of its figure, and from these, those over the unknowns.
//!
//! With the slopes A of the coordinates by the unknowns, H and b over the figure are Aᵀ H A and Aᵀ b over the unknowns.

use super::unknowns::{FIGURE, Slope};
use crate::estimate::arrow::{FrameTerms, OfFrame};
use nalgebra::{DMatrix, DVector};

/// Normal equations over the coordinates of the figure.
#[derive(Debug)]
pub struct FigureTerms {
    normal: DMatrix<f64>,
    right: DVector<f64>,
    /// The latest terms, which depend on the same few coordinates: those of the samples of one part.
    part: PartTerms,
}

#[derive(Debug, Default)]
struct PartTerms {
    coordinates: Vec<usize>,
    slopes: Vec<f64>,
    normal: Vec<f64>,
    right: Vec<f64>,
}

impl FigureTerms {
    pub fn new() -> Self {
        Self {
            normal: DMatrix::zeros(FIGURE, FIGURE),
            right: DVector::zeros(FIGURE),
            part: PartTerms::default(),
        }
    }

    /// Adds weight (Σ slope q - offset)².
    pub fn add(
        &mut self,
        slopes: impl ExactSizeIterator<Item = (usize, f64)> + Clone,
        offset: f64,
        weight: f64,
    ) {
        let coordinates = slopes.clone().map(|(q, _)| q);
        if !coordinates.clone().eq(self.part.coordinates.iter().copied()) {
            self.add_part();
            let count = slopes.len();
            self.part.coordinates.clear();
            self.part.coordinates.extend(coordinates);
            for sums in [&mut self.part.normal, &mut self.part.right] {
                sums.clear();
            }
            self.part.normal.resize(count * count, 0.0);
            self.part.right.resize(count, 0.0);
        }
        let PartTerms { slopes: values, normal, right, .. } = &mut self.part;
        values.clear();
        values.extend(slopes.map(|(_, slope)| slope));
        for ((row, right), a) in normal.chunks_exact_mut(values.len().max(1)).zip(right).zip(values.iter()) {
            add_scaled(row, values, weight * a);
            *right += weight * a * offset;
        }
    }

    fn add_part(&mut self) {
        let PartTerms { coordinates, normal, right, .. } = &self.part;
        for ((&i, row), of_right) in
            coordinates.iter().zip(normal.chunks_exact(coordinates.len().max(1))).zip(right)
        {
            for (&j, sum) in coordinates.iter().zip(row) {
                self.normal[(i, j)] += sum;
            }
            self.right[i] += of_right;
        }
    }

    pub fn sums(mut self) -> (DMatrix<f64>, DVector<f64>) {
        self.add_part();
        (self.normal, self.right)
    }
}

/// Working memory.
#[derive(Debug, Default)]
pub struct Chain {
    /// Coordinates and slopes, sorted by the unknown, and where those of each unknown begin.
    slopes: Vec<(usize, f64)>,
    starts: Vec<usize>,
    /// Aᵀ H, one column per coordinate.
    half: Vec<f64>,
}

impl Chain {
    /// Adds Aᵀ H A and Aᵀ b of a frame, over as many unknowns of the whole as the terms have and the first `block` of the
    /// frame. The slopes of the others are left out.
    pub fn add(
        &mut self,
        normal: &DMatrix<f64>,
        right: &DVector<f64>,
        slopes: &[Slope],
        block: usize,
        terms: &mut FrameTerms,
    ) {
        let whole = terms.right_whole.len();
        let count = whole + block;
        self.sort(slopes, count);
        // 1. Aᵀ H.
        self.half.clear();
        self.half.resize(FIGURE * count, 0.0);
        for (half, of_coordinate) in
            self.half.chunks_exact_mut(count).zip(normal.as_slice().chunks_exact(FIGURE))
        {
            for (sum, unknown) in half.iter_mut().zip(self.starts.windows(2)) {
                *sum = self.slopes[unknown[0]..unknown[1]]
                    .iter()
                    .map(|&(q, slope)| slope * of_coordinate[q])
                    .sum();
            }
        }
        // 2. Aᵀ H A below the diagonal, and Aᵀ b.
        let mut of_frame = OfFrame {
            coupling: DMatrix::zeros(whole, block),
            own: DMatrix::zeros(block, block),
            right: DVector::zeros(block),
        };
        for (unknown, range) in self.starts.windows(2).enumerate() {
            for &(q, slope) in &self.slopes[range[0]..range[1]] {
                let half = &self.half[q * count..(q + 1) * count];
                match unknown.checked_sub(whole) {
                    None => {
                        let column = &mut terms.whole.as_mut_slice()[unknown * whole..(unknown + 1) * whole];
                        add_scaled(&mut column[unknown..], &half[unknown..whole], slope);
                        terms.right_whole[unknown] += slope * right[q];
                    }
                    Some(i) => {
                        add_scaled(of_frame.coupling.column_mut(i).as_mut_slice(), &half[..whole], slope);
                        add_scaled(of_frame.own.column_mut(i).as_mut_slice(), &half[whole..], slope);
                        of_frame.right[i] += slope * right[q];
                    }
                }
            }
        }
        terms.frames.push(of_frame);
    }

    /// The slopes by the first `count` unknowns, sorted by the unknown.
    fn sort(&mut self, slopes: &[Slope], count: usize) {
        let wanted = || slopes.iter().filter(|slope| slope.1 < count);
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        wanted().for_each(|slope| self.starts[slope.1 + 1] += 1);
        (0..count).for_each(|n| self.starts[n + 1] += self.starts[n]);
        self.slopes.clear();
        self.slopes.resize(self.starts[count], (0, 0.0));
        // Each is put where those of its unknown begin, which then moves on; then all begin where the one before ended.
        for &(q, unknown, slope) in wanted() {
            self.slopes[self.starts[unknown]] = (q, slope);
            self.starts[unknown] += 1;
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
}

/// A plain loop is several times as fast as a library call for columns of a hundred numbers.
fn add_scaled(into: &mut [f64], from: &[f64], by: f64) {
    into.iter_mut().zip(from).for_each(|(x, y)| *x += by * y);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_over_the_unknowns_are_those_of_the_dense_products() {
        let (whole, block) = (5, 2);
        let value = |n: usize| ((37 * n + 11) % 23) as f64 / 7.0 - 1.5;
        let root = DMatrix::from_fn(FIGURE, FIGURE, |i, j| value(i + 3 * j));
        let (normal, right) = (&root * root.transpose(), DVector::from_fn(FIGURE, |i, _| value(5 * i)));
        // Two slopes of one unknown, none of another, and some beyond the unknowns that are wanted.
        let of_frame = |shift: usize| -> Vec<Slope> {
            vec![
                (3, 1, 2.0),
                (9, 0, -1.0),
                (4 + shift, 1, 0.5),
                (7, 5, 1.5),
                (8, 4, 1.0),
                (2, 6, -0.3),
                (1, 2, 0.7),
                (0, 7, 9.0),
            ]
        };
        let mut terms = FrameTerms::new(whole);
        let (mut sum, mut sum_right) = (DMatrix::zeros(whole, whole), DVector::zeros(whole));
        let mut chain = Chain::default();
        for shift in 0..2 {
            let slopes = of_frame(shift);
            chain.add(&normal, &right, &slopes, block, &mut terms);
            let mut a = DMatrix::zeros(FIGURE, whole + block);
            slopes.iter().filter(|s| s.1 < whole + block).for_each(|s| a[(s.0, s.1)] += s.2);
            let (dense, dense_right) = (a.tr_mul(&(&normal * &a)), a.tr_mul(&right));
            sum += dense.view((0, 0), (whole, whole));
            sum_right += dense_right.rows(0, whole);
            let found = &terms.frames[shift];
            assert!((&found.coupling - dense.view((0, whole), (whole, block))).norm() < 1e-9);
            let own = dense.view((whole, whole), (block, block));
            assert!((found.own.lower_triangle() - own.lower_triangle()).norm() < 1e-9);
            assert!((&found.right - dense_right.rows(whole, block)).norm() < 1e-9);
        }
        assert!((&terms.whole - sum.lower_triangle()).norm() < 1e-9);
        assert!((&terms.right_whole - sum_right).norm() < 1e-9);
    }
}
