//! Least squares over a sequence whose frames share some unknowns: normal equations in block-arrow form.
//!
//! The unknowns are those of each frame, which touch at most the two frames before and after, and those of the whole
//! sequence, which touch every frame: H = [[F, C], [Cᵀ, W]] with F banded. With F = L Lᵀ and Y = L⁻¹ C, the part of
//! the whole solves (W - Yᵀ Y) x_w = b_w - Yᵀ L⁻¹ b_f, and L Lᵀ x_f = b_f - C x_w. Time and memory are linear in the
//! number of frames.

use nalgebra::{Cholesky, DMatrix, DVector, DVectorView, Dyn};

/// The change of velocity between two intervals, for motion whose velocity is a random walk with a variance of one per
/// second: the factors of three successive values whose sum it is, and the variance (before + after) / 2 to weight it by.
///
/// This is the variance between the velocities at the middles of the intervals. The sum is the difference of the mean
/// velocities, whose own variance is (before + after) / 3, and successive sums share a covariance of a sixth of their common
/// interval. Terms that are added as independent neglect it; with the larger variance, they have the same power at low
/// frequencies.
pub fn velocity_change(before_s: f64, after_s: f64) -> ([f64; 3], f64) {
    ([1.0 / before_s, -1.0 / before_s - 1.0 / after_s, 1.0 / after_s], 0.5 * (before_s + after_s))
}

/// Normal equations H x = b, to which terms are added.
#[derive(Debug, Clone)]
pub struct Arrow {
    /// Unknowns per frame.
    block: usize,
    frames: Banded,
    /// Cᵀ: one column per unknown of a frame.
    coupling: DMatrix<f64>,
    /// Its lower triangle; what is above the diagonal is not read.
    whole: DMatrix<f64>,
    right_frames: Vec<f64>,
    right_whole: DVector<f64>,
}

/// Normal equations of some frames in a row.
#[derive(Debug, Clone)]
pub struct FrameTerms {
    /// Over the unknowns of the whole: the lower triangle.
    pub whole: DMatrix<f64>,
    /// The right side of these.
    pub right_whole: DVector<f64>,
    /// The rest, by frame.
    pub frames: Vec<OfFrame>,
}

/// Normal equations of one frame, but for those over the unknowns of the whole alone.
#[derive(Debug, Clone)]
pub struct OfFrame {
    /// Over the unknowns of the whole (rows) and of the frame (columns).
    pub coupling: DMatrix<f64>,
    /// Over those of the frame: the lower triangle.
    pub own: DMatrix<f64>,
    /// The right side of these.
    pub right: DVector<f64>,
}

impl FrameTerms {
    /// No frames yet, of a sequence with so many unknowns of the whole.
    pub fn new(whole: usize) -> Self {
        Self { whole: DMatrix::zeros(whole, whole), right_whole: DVector::zeros(whole), frames: Vec::new() }
    }
}

/// A symmetric matrix, or its factor L, as the lower band by rows: row i holds columns i - width to i.
#[derive(Debug, Clone)]
struct Banded {
    width: usize,
    values: Vec<f64>,
}

impl Banded {
    fn zeros(size: usize, width: usize) -> Self {
        Self { width, values: vec![0.0; size * (width + 1)] }
    }

    /// The first column of a row that is in the band.
    fn first(&self, row: usize) -> usize {
        row.saturating_sub(self.width)
    }

    fn index(&self, row: usize, column: usize) -> usize {
        row * (self.width + 1) + self.width + column - row
    }

    /// The entries of a row from its first column in the band to the diagonal.
    fn row(&self, row: usize) -> &[f64] {
        &self.values[self.index(row, self.first(row))..=self.index(row, row)]
    }

    /// Replaces the matrix by its Cholesky factor; `None` if it is not positive definite.
    fn factored(mut self, size: usize) -> Option<Self> {
        // 1 / L_ii: a division takes as long as a third of the sum.
        let mut inverse: Vec<f64> = Vec::with_capacity(size);
        for i in 0..size {
            let first = self.first(i);
            for j in first..=i {
                let from = first.max(self.first(j));
                let (a, b) = (self.index(i, from), self.index(j, from));
                let count = j - from;
                let at = self.index(i, j);
                let left = self.values[at] - dot(&self.values[a..a + count], &self.values[b..b + count]);
                self.values[at] = if j < i {
                    left * inverse[j]
                } else if left > 0.0 {
                    inverse.push(1.0 / left.sqrt());
                    left.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(self)
    }
}

/// Σ a b of two slices of the same length; nalgebra adds in eight sums at a time, which need not wait for each other.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(b, b.len()))
}

impl Arrow {
    /// Equations without terms: `frames` frames of `block` unknowns, and `whole` unknowns of the whole sequence.
    pub fn new(frames: usize, block: usize, whole: usize) -> Self {
        Self::with_width(frames, block, whole, (3 * block).saturating_sub(1))
    }

    /// Equations of frames alone, whose terms touch no unknowns with indices farther apart than `width`.
    pub fn banded(frames: usize, block: usize, width: usize) -> Self {
        Self::with_width(frames, block, 0, width)
    }

    fn with_width(frames: usize, block: usize, whole: usize, width: usize) -> Self {
        let count = frames * block;
        Self {
            block,
            frames: Banded::zeros(count, width),
            coupling: DMatrix::zeros(whole, count),
            whole: DMatrix::zeros(whole, whole),
            right_frames: vec![0.0; count],
            right_whole: DVector::zeros(whole),
        }
    }

    /// Index of an unknown of a frame, for [`Arrow::add_row`] and [`Covariance::variance`].
    pub fn index(&self, frame: usize, unknown: usize) -> usize {
        frame * self.block + unknown
    }

    /// Adds the normal equations of some frames, the first of which is `first`.
    pub fn add_frames(&mut self, first: usize, terms: &FrameTerms) {
        self.whole += &terms.whole;
        self.right_whole += &terms.right_whole;
        for (n, of_frame) in terms.frames.iter().enumerate() {
            let before = (first + n) * self.block;
            for i in 0..self.block {
                let mut column = self.coupling.column_mut(before + i);
                column += of_frame.coupling.column(i);
                for j in 0..=i {
                    let index = self.frames.index(before + i, before + j);
                    self.frames.values[index] += of_frame.own[(i, j)];
                }
                self.right_frames[before + i] += of_frame.right[i];
            }
        }
    }

    /// Adds `weight` (Σ coefficient x - `right`)² over unknowns of at most three neighbouring frames.
    ///
    /// # Panics
    ///
    /// If the unknowns are farther apart, or than the width of [`Arrow::banded`].
    pub fn add_row(&mut self, terms: &[(usize, f64)], right: f64, weight: f64) {
        for (n, &(i, a)) in terms.iter().enumerate() {
            for &(j, b) in &terms[..=n] {
                let width = self.frames.width;
                assert!(i.abs_diff(j) <= width, "unknowns {i} and {j} are farther apart than {width}");
                let index = self.frames.index(i.max(j), i.min(j));
                self.frames.values[index] += weight * a * b;
            }
            self.right_frames[i] += weight * a * right;
        }
    }

    /// Adds `weight` (Σ coefficient x - `right`)² over unknowns of the whole.
    pub fn add_whole_row(&mut self, terms: &[(usize, f64)], right: f64, weight: f64) {
        for &(i, a) in terms {
            for &(j, b) in terms {
                self.whole[(i, j)] += weight * a * b;
            }
            self.right_whole[i] += weight * a * right;
        }
    }

    /// The solution; `None` if the terms do not determine it.
    pub fn solve(self) -> Option<Solution> {
        let Self { frames, mut coupling, mut whole, mut right_frames, right_whole, .. } = self;
        let (count, shared) = (right_frames.len(), right_whole.len());
        let factor = frames.factored(count)?;
        // Y and L⁻¹ b_f, forwards.
        for i in 0..count {
            let first = factor.first(i);
            let row = factor.row(i);
            let (done, rest) = coupling.as_mut_slice().split_at_mut(i * shared);
            let column = &mut rest[..shared];
            for (k, &l) in (first..i).zip(row) {
                if l != 0.0 {
                    let before = &done[k * shared..(k + 1) * shared];
                    column.iter_mut().zip(before).for_each(|(x, y)| *x -= l * y);
                    right_frames[i] -= l * right_frames[k];
                }
            }
            let scale = 1.0 / row[row.len() - 1];
            column.iter_mut().for_each(|x| *x *= scale);
            right_frames[i] *= scale;
        }
        let half = DVector::from_vec(right_frames);
        whole.gemm(-1.0, &coupling, &coupling.transpose(), 1.0);
        let schur = Cholesky::new(whole)?;
        let x_whole = schur.solve(&(right_whole - &coupling * &half));
        // L Lᵀ x_f = b_f - C x_w, backwards.
        let mut x = half - coupling.tr_mul(&x_whole);
        for i in (0..count).rev() {
            let (first, row) = (factor.first(i), factor.row(i));
            x[i] /= row[row.len() - 1];
            let value = x[i];
            for (k, &l) in (first..i).zip(row) {
                x[k] -= l * value;
            }
        }
        Some(Solution { whole: x_whole, frames: x, factor, coupling, schur })
    }
}

/// A solution with the factors that its covariance needs.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Unknowns of the whole.
    pub whole: DVector<f64>,
    /// Unknowns of the frames.
    pub frames: DVector<f64>,
    factor: Banded,
    coupling: DMatrix<f64>,
    schur: Cholesky<f64, Dyn>,
}

impl Solution {
    /// Variance of a linear form of the unknowns of the whole and of any frames, for example of a mean over all of
    /// them, with indices by [`Arrow::index`].
    ///
    /// With e the form's part over the frames, a that over the whole, L u = e and d = a - Y u: uᵀ u + dᵀ S⁻¹ d.
    pub fn variance(&self, whole: &[(usize, f64)], frames: &[(usize, f64)]) -> f64 {
        let mut u = DVector::zeros(self.coupling.ncols());
        for &(i, a) in frames {
            u[i] += a;
        }
        for i in 0..u.len() {
            let (first, row) = (self.factor.first(i), self.factor.row(i));
            let (before, diagonal) = row.split_at(i - first);
            u[i] = (u[i] - dot(before, &u.as_slice()[first..i])) / diagonal[0];
        }
        let mut left = -(&self.coupling * &u);
        for &(i, a) in whole {
            left[i] += a;
        }
        u.norm_squared() + left.dot(&self.schur.solve(&left))
    }

    /// The covariance of the unknowns, as far as neighbouring frames go, in time that is linear in their number.
    ///
    /// Entries Z = F⁻¹ within the band follow from L Lᵀ Z = 1, whose lower triangle is that of Lᵀ Z = L⁻¹: from the last
    /// column on, Z_ij = (δ_ij / L_jj - Σ_k>j L_kj Z_ki) / L_jj (Takahashi et al. 1973). G = F⁻¹ C solves Lᵀ G = Y.
    pub fn covariance(&self) -> Covariance {
        let (factor, mut led, schur) = (&self.factor, self.coupling.clone(), self.schur.clone());
        let (count, shared, width) = (led.ncols(), led.nrows(), factor.width);
        let mut inverse = Banded::zeros(count, width);
        for j in (0..count).rev() {
            let last = (j + width).min(count - 1);
            let below: Vec<f64> = (j + 1..=last).map(|k| factor.values[factor.index(k, j)]).collect();
            let diagonal = factor.values[factor.index(j, j)];
            for i in (j..=last).rev() {
                let known = (j + 1..=last).zip(&below);
                let sum: f64 =
                    known.map(|(k, l)| l * inverse.values[inverse.index(k.max(i), k.min(i))]).sum();
                let one = if i == j { 1.0 / diagonal } else { 0.0 };
                let at = inverse.index(i, j);
                inverse.values[at] = (one - sum) / diagonal;
            }
        }
        for i in (0..count).rev() {
            let (before, rest) = led.as_mut_slice().split_at_mut(i * shared);
            let (first, row, column) = (factor.first(i), factor.row(i), &mut rest[..shared]);
            let scale = 1.0 / row[row.len() - 1];
            column.iter_mut().for_each(|x| *x *= scale);
            for (k, &l) in (first..i).zip(row) {
                if l != 0.0 {
                    let above = &mut before[k * shared..(k + 1) * shared];
                    above.iter_mut().zip(&*column).for_each(|(x, y)| *x -= l * y);
                }
            }
        }
        Covariance { inverse, led, schur }
    }
}

/// The covariance of a solution.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// F⁻¹ within the band.
    inverse: Banded,
    /// (F⁻¹ C)ᵀ: one column per unknown of a frame.
    led: DMatrix<f64>,
    schur: Cholesky<f64, Dyn>,
}

impl Covariance {
    /// Variance of a linear form of the unknowns of the whole and of at most three neighbouring frames, with indices by
    /// [`Arrow::index`].
    ///
    /// With e the form's part over the frames, a that over the whole, d = a - Cᵀ F⁻¹ e: eᵀ F⁻¹ e + dᵀ S⁻¹ d.
    ///
    /// # Panics
    ///
    /// If frames of the form are farther apart.
    pub fn variance(&self, whole: &[(usize, f64)], frames: &[(usize, f64)]) -> f64 {
        let mut left = DVector::zeros(self.led.nrows());
        for &(i, a) in whole {
            left[i] += a;
        }
        let mut of_frames = 0.0;
        for &(i, a) in frames {
            left.axpy(-a, &self.led.column(i), 1.0);
            for &(j, b) in frames {
                assert!(
                    i.abs_diff(j) <= self.inverse.width,
                    "unknowns {i} and {j} are in frames too far apart"
                );
                of_frames += a * b * self.inverse.values[self.inverse.index(i.max(j), i.min(j))];
            }
        }
        of_frames + left.dot(&self.schur.solve(&left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    /// A uniform number in [-1, 1).
    fn draw(random: &mut Xoshiro256PlusPlus) -> f64 {
        (random.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Random terms of every kind, as arrow equations and as one dense system.
    fn both(frames: usize, block: usize, whole: usize) -> (Arrow, DMatrix<f64>, DVector<f64>) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64((frames * 100 + block * 10 + whole) as u64);
        let size = whole + frames * block;
        let (mut arrow, mut h, mut b) =
            (Arrow::new(frames, block, whole), DMatrix::zeros(size, size), DVector::zeros(size));
        let mut add = |row: DVector<f64>, right: f64, weight: f64| {
            h += weight * &row * row.transpose();
            b += weight * right * row;
        };
        let mut terms = FrameTerms::new(whole);
        for frame in 0..frames {
            // More observations than unknowns of a frame.
            let (mut normal, mut right) =
                (DMatrix::zeros(whole + block, whole + block), DVector::zeros(whole + block));
            for _ in 0..block + 2 {
                let row = DVector::from_fn(whole + block, |_, _| draw(&mut random));
                let value = draw(&mut random);
                normal += &row * row.transpose();
                right += value * &row;
                let mut dense = DVector::zeros(size);
                dense.rows_mut(0, whole).copy_from(&row.rows(0, whole));
                dense.rows_mut(whole + frame * block, block).copy_from(&row.rows(whole, block));
                add(dense, value, 1.0);
            }
            // What is above the diagonal is not read.
            let whole_only = (normal.view((0, 0), (whole, whole)).lower_triangle(), right.rows(0, whole));
            terms.whole += whole_only.0;
            terms.right_whole += whole_only.1;
            terms.frames.push(OfFrame {
                coupling: normal.view((0, whole), (whole, block)).into_owned(),
                own: normal.view((whole, whole), (block, block)).lower_triangle(),
                right: right.rows(whole, block).into_owned(),
            });
            // Two frames are added at a time.
            if terms.frames.len() == 2 || frame + 1 == frames {
                let added = std::mem::replace(&mut terms, FrameTerms::new(whole));
                arrow.add_frames(frame + 1 - added.frames.len(), &added);
            }
            if frame >= 2 {
                let unknown = frame % block;
                let terms: Vec<_> =
                    (0..3).map(|k| (arrow.index(frame - 2 + k, unknown), draw(&mut random))).collect();
                arrow.add_row(&terms, 0.3, 2.5);
                let mut dense = DVector::zeros(size);
                terms.iter().for_each(|&(i, a)| dense[whole + i] += a);
                add(dense, 0.3, 2.5);
            }
        }
        let terms: Vec<_> = (0..whole).map(|i| (i, draw(&mut random))).collect();
        arrow.add_whole_row(&terms, -0.7, 1.5);
        let mut dense = DVector::zeros(size);
        terms.iter().for_each(|&(i, a)| dense[i] += a);
        add(dense, -0.7, 1.5);
        (arrow, h, b)
    }

    #[test]
    fn solutions_and_variances_are_those_of_the_dense_system() {
        for (frames, block, whole) in [(1, 3, 2), (2, 2, 4), (7, 3, 5), (12, 4, 1)] {
            let (arrow, h, b) = both(frames, block, whole);
            // Of the first frame and of the last of three, and of the last frame alone.
            let third = arrow.index(2.min(frames - 1), block - 1);
            let last = arrow.index(frames - 1, 0);
            let solution = arrow.solve().expect("enough terms");
            let covariance = solution.covariance();
            let inverse = h.clone().try_inverse().unwrap();
            let expected = &inverse * &b;
            assert!((&solution.whole - expected.rows(0, whole)).norm() < 1e-8);
            assert!((&solution.frames - expected.rows(whole, frames * block)).norm() < 1e-8);
            for (of_whole, of_frames) in [
                (vec![(0, 1.0)], vec![]),
                (vec![], vec![(0, 1.0)]),
                (vec![(whole - 1, 0.4)], vec![(0, -1.2), (third, 0.7)]),
                (vec![(0, 0.3)], vec![(last, 1.0), (last + block - 1, -2.0)]),
            ] {
                let mut form = DVector::zeros(whole + frames * block);
                of_whole.iter().for_each(|&(i, a): &(usize, f64)| form[i] += a);
                of_frames.iter().for_each(|&(i, a): &(usize, f64)| form[whole + i] += a);
                let dense = form.dot(&(&inverse * &form));
                let found =
                    [covariance.variance(&of_whole, &of_frames), solution.variance(&of_whole, &of_frames)];
                for found in found {
                    assert!((found - dense).abs() < 1e-8 * dense.max(1.0), "{found} against {dense}");
                }
            }
            // A mean over frames that are far apart, one of them twice.
            let everywhere: Vec<_> =
                (0..frames).chain([0]).map(|k| (k * block, 1.0 / frames as f64)).collect();
            let mut form = DVector::zeros(whole + frames * block);
            form[whole - 1] = -0.5;
            everywhere.iter().for_each(|&(i, a)| form[whole + i] += a);
            let dense = form.dot(&(&inverse * &form));
            let found = solution.variance(&[(whole - 1, -0.5)], &everywhere);
            assert!((found - dense).abs() < 1e-8 * dense.max(1.0), "{found} against {dense}");
        }
    }

    #[test]
    #[should_panic(expected = "unknowns 10 and 0 are farther apart than 2")]
    fn a_row_over_frames_too_far_apart_is_refused() {
        Arrow::new(11, 1, 1).add_row(&[(0, 1.0), (10, 1.0)], 0.0, 1.0);
    }

    #[test]
    fn what_the_terms_do_not_determine_has_no_solution() {
        let mut arrow = Arrow::new(3, 1, 1);
        arrow.add_row(&[(0, 1.0), (1, -1.0)], 0.0, 1.0);
        arrow.add_whole_row(&[(0, 1.0)], 1.0, 1.0);
        assert!(arrow.solve().is_none());
    }
}
