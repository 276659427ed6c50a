//! The linear equations of a velocity field on one grid and their solution: conjugate gradients
//! preconditioned by one multigrid cycle, with block Jacobi smoothing; each grid has half the size of the
//! finer one.
//!
//! It solves the equations that [`super`] has linearised and does not depend on frames or pyramids. On
//! components where the equations are singular it finds one of the solutions; [`super`] removes such
//! components beforehand.

use super::domain::Domain;
use glam::DVec2;
use std::ops::Range;

/// A vector for each cell of a domain; zero outside.
#[derive(Clone, Debug)]
pub(super) struct Vectors {
    pub(super) u: Vec<f64>,
    pub(super) v: Vec<f64>,
}

impl Vectors {
    pub(super) fn zero(cells: usize) -> Self {
        Self { u: vec![0.0; cells], v: vec![0.0; cells] }
    }

    #[inline(always)]
    fn dot(&self, other: &Self) -> f64 {
        dot(&self.u, &other.u) + dot(&self.v, &other.v)
    }

    #[inline(always)]
    fn norm(&self) -> f64 {
        self.dot(self).sqrt()
    }

    /// `self = scale * self + factor * other`
    #[inline(always)]
    fn combine(&mut self, scale: f64, factor: f64, other: &Self) {
        combine(&mut self.u, scale, factor, &other.u);
        combine(&mut self.v, scale, factor, &other.v);
    }
}

#[inline(always)]
fn combine(a: &mut [f64], scale: f64, factor: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a = scale * *a + factor * b;
    }
}

/// Eight partial sums, so that the order of summation does not depend on the vector width.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_blocks, b_blocks) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_blocks.remainder().iter().zip(b_blocks.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a_blocks.zip(b_blocks) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// A symmetric 2x2 matrix for each cell of a domain; zero outside.
struct Blocks {
    uu: Vec<f64>,
    uv: Vec<f64>,
    vv: Vec<f64>,
}

impl Blocks {
    fn zero(cells: usize) -> Self {
        Self { uu: vec![0.0; cells], uv: vec![0.0; cells], vv: vec![0.0; cells] }
    }

    /// `out += factor * self * r`, cell by cell.
    #[inline(always)]
    fn multiply_add(&self, factor: f64, r: &Vectors, out: &mut Vectors) {
        let n = self.uu.len();
        let (uu, uv, vv) = (&self.uu[..n], &self.uv[..n], &self.vv[..n]);
        let (ru, rv) = (&r.u[..n], &r.v[..n]);
        let (out_u, out_v) = (&mut out.u[..n], &mut out.v[..n]);
        for i in 0..n {
            out_u[i] += factor * (uu[i] * ru[i] + uv[i] * rv[i]);
            out_v[i] += factor * (uv[i] * ru[i] + vv[i] * rv[i]);
        }
    }
}

/// Result of a solution.
pub(super) struct Solved {
    pub(super) iterations: usize,
    pub(super) relative_residual: f64,
}

/// Damping of the block Jacobi steps: with 0.8, every step at least halves all waves shorter than four
/// pixels.
const DAMPING: f64 = 0.8;

/// Block Jacobi steps on the coarsest grid, which has at most 2x2 cells.
const COARSEST_STEPS: usize = 12;

/// The linear equations A x = b of the minimum on one grid, with the buffers for solving them. At each pixel
/// p, with the sum over its neighbours q inside the domain,
///
/// ```text
/// g g^T (u, v)_p + sum of w_pq ((u, v)_p - (u, v)_q) = -g c
/// ```
struct GridLevel {
    domain: Domain,
    /// Weight w of the difference to the neighbour on the right; 0 unless both are inside.
    right: Vec<f64>,
    /// Weight w of the difference to the neighbour below.
    below: Vec<f64>,
    /// Sum of the weights of a pixel's neighbours.
    weights: Vec<f64>,
    /// g g^T.
    data: Blocks,
    /// The blocks on the diagonal of A: g g^T plus the weights of all neighbours.
    diagonal: Blocks,
    /// Their inverses; zero for singular blocks, whose cells are left to the other smoothing steps.
    inverse: Blocks,
    right_side: Vectors,
    solution: Vectors,
    residual: Vectors,
}

impl GridLevel {
    fn new(domain: Domain, right: Vec<f64>, below: Vec<f64>) -> Self {
        let (cells, stride) = (right.len(), domain.stride());
        let mut weights = vec![0.0; cells];
        for (_, _, i) in domain.pixels() {
            weights[i] = right[i] + right[i - 1] + below[i] + below[i - stride];
        }
        let (data, diagonal, inverse) = (Blocks::zero(cells), Blocks::zero(cells), Blocks::zero(cells));
        let zero = Vectors::zero(cells);
        let (right_side, solution, residual) = (zero.clone(), zero.clone(), zero);
        Self { domain, right, below, weights, data, diagonal, inverse, right_side, solution, residual }
    }

    /// The pixel grid: w = lambda^2.
    fn finest(domain: &Domain, lambda_sq: f64) -> Self {
        let (mut right, mut below) = (vec![0.0; domain.is_inside.len()], vec![0.0; domain.is_inside.len()]);
        for (_, _, cell) in domain.pixels() {
            let weight = |neighbour: usize| if domain.is_inside[neighbour] { lambda_sq } else { 0.0 };
            right[cell] = weight(cell + 1);
            below[cell] = weight(cell + domain.stride());
        }
        Self::new(domain.clone(), right, below)
    }

    /// The equations for vectors constant on blocks of 2x2 pixels: the weights across the borders of the
    /// blocks are added and halved, because they now weigh a slope over two pixels instead of a jump over
    /// one.
    fn halved(&self) -> Self {
        let half = self.domain.halved();
        let (mut right, mut below) = (vec![0.0; half.is_inside.len()], vec![0.0; half.is_inside.len()]);
        for (x, y, cell) in self.domain.pixels() {
            let parent = half.cell(x / 2, y / 2);
            if x % 2 == 1 {
                right[parent] += 0.5 * self.right[cell];
            }
            if y % 2 == 1 {
                below[parent] += 0.5 * self.below[cell];
            }
        }
        Self::new(half, right, below)
    }

    /// The diagonal and its inverse for the current data.
    #[inline(always)]
    fn update_diagonal(&mut self) {
        for i in 0..self.weights.len() {
            let (uu, vv) = (self.data.uu[i] + self.weights[i], self.data.vv[i] + self.weights[i]);
            let uv = self.data.uv[i];
            let determinant = uu * vv - uv * uv;
            let is_regular = determinant > 1e-12 * (uu + vv) * (uu + vv);
            let scale = if is_regular { 1.0 / determinant } else { 0.0 };
            (self.diagonal.uu[i], self.diagonal.uv[i], self.diagonal.vv[i]) = (uu, uv, vv);
            (self.inverse.uu[i], self.inverse.uv[i], self.inverse.vv[i]) =
                (scale * vv, -scale * uv, scale * uu);
        }
    }

    /// Sums the data over the blocks of the coarser grid.
    #[inline(always)]
    fn restrict_data(&self, coarse: &mut GridLevel) {
        sum_blocks(&self.domain, &self.data.uu, &coarse.domain, &mut coarse.data.uu);
        sum_blocks(&self.domain, &self.data.uv, &coarse.domain, &mut coarse.data.uv);
        sum_blocks(&self.domain, &self.data.vv, &coarse.domain, &mut coarse.data.vv);
    }

    /// `out = A x`
    #[inline(always)]
    fn multiply(&self, x: &Vectors, out: &mut Vectors) {
        self.combine_products(x, out, |_, product| product);
    }

    /// residual = b - A x
    #[inline(always)]
    fn update_residual(&mut self) {
        let mut residual = std::mem::replace(&mut self.residual, Vectors::zero(0));
        let inner = self.inner_cells();
        let (bu, bv) = (&self.right_side.u[inner.clone()], &self.right_side.v[inner]);
        self.combine_products(&self.solution, &mut residual, |i, [u, v]| [bu[i] - u, bv[i] - v]);
        self.residual = residual;
    }

    /// The cells without the free first and last rows.
    fn inner_cells(&self) -> Range<usize> {
        self.domain.stride()..self.right.len() - self.domain.stride()
    }

    /// `out_i = f(i, (A x)_i)` at the i-th of the inner cells.
    #[inline(always)]
    fn combine_products(&self, x: &Vectors, out: &mut Vectors, f: impl Fn(usize, [f64; 2]) -> [f64; 2]) {
        let (inner, stride) = (self.inner_cells(), self.domain.stride());
        let [uu, uv, vv] =
            [&self.diagonal.uu, &self.diagonal.uv, &self.diagonal.vv].map(|d| &d[inner.clone()]);
        let weights = [
            &self.right[inner.start - 1..inner.end - 1],
            &self.right[inner.clone()],
            &self.below[..inner.len()],
            &self.below[inner.clone()],
        ];
        let (u, v) = (Plus::new(&x.u, stride), Plus::new(&x.v, stride));
        let (out_u, out_v) = (&mut out.u[inner.clone()], &mut out.v[inner.clone()]);
        for i in 0..inner.len() {
            let w = weights.map(|w| w[i]);
            let product_u = uu[i] * u.centre[i] + uv[i] * v.centre[i] - u.weighted(i, w);
            let product_v = uv[i] * u.centre[i] + vv[i] * v.centre[i] - v.weighted(i, w);
            [out_u[i], out_v[i]] = f(i, [product_u, product_v]);
        }
    }

    /// One damped block Jacobi step.
    #[inline(always)]
    fn smooth(&mut self) {
        self.update_residual();
        self.inverse.multiply_add(DAMPING, &self.residual, &mut self.solution);
    }

    /// One damped block Jacobi step from the start value zero.
    #[inline(always)]
    fn smooth_from_zero(&mut self) {
        self.solution.u.fill(0.0);
        self.solution.v.fill(0.0);
        self.inverse.multiply_add(DAMPING, &self.right_side, &mut self.solution);
    }

    /// Restricts the residual to the coarser grid as its right-hand side.
    #[inline(always)]
    fn restrict_residual(&mut self, coarse: &mut GridLevel) {
        self.update_residual();
        sum_blocks(&self.domain, &self.residual.u, &coarse.domain, &mut coarse.right_side.u);
        sum_blocks(&self.domain, &self.residual.v, &coarse.domain, &mut coarse.right_side.v);
    }

    /// Adds the correction computed on the coarser grid.
    #[inline(always)]
    fn correct(&mut self, coarse: &GridLevel) {
        add_parents(&coarse.domain, &coarse.solution.u, &self.domain, &mut self.solution.u);
        add_parents(&coarse.domain, &coarse.solution.v, &self.domain, &mut self.solution.v);
    }
}

/// Sums over blocks of 2x2 pixels. The free cells on the right and below are zero and complete odd sizes.
#[inline(always)]
fn sum_blocks(fine: &Domain, values: &[f64], coarse: &Domain, sums: &mut [f64]) {
    for y in 0..coarse.height {
        let row = |y: usize| values[fine.cell(0, y)..][..2 * coarse.width].chunks_exact(2);
        let sums = &mut sums[coarse.cell(0, y)..][..coarse.width];
        for ((sum, upper), lower) in sums.iter_mut().zip(row(2 * y)).zip(row(2 * y + 1)) {
            *sum = upper[0] + upper[1] + lower[0] + lower[1];
        }
    }
}

/// Adds to each pixel of the domain the value of its block.
#[inline(always)]
fn add_parents(coarse: &Domain, parents: &[f64], fine: &Domain, values: &mut [f64]) {
    for y in 0..fine.height {
        let row = fine.cell(0, y)..fine.cell(0, y) + 2 * coarse.width;
        let pairs = values[row.clone()].chunks_exact_mut(2).zip(fine.is_inside[row].chunks_exact(2));
        for ((pair, is_inside), parent) in pairs.zip(&parents[coarse.cell(0, y / 2)..]) {
            pair[0] += if is_inside[0] { *parent } else { 0.0 };
            pair[1] += if is_inside[1] { *parent } else { 0.0 };
        }
    }
}

/// The inner cells of a grid and their four neighbours, each at the index of the cell it belongs to.
struct Plus<'a> {
    centre: &'a [f64],
    left: &'a [f64],
    right: &'a [f64],
    above: &'a [f64],
    below: &'a [f64],
}

impl<'a> Plus<'a> {
    #[inline(always)]
    fn new(values: &'a [f64], stride: usize) -> Self {
        let count = values.len() - 2 * stride;
        Self {
            centre: &values[stride..][..count],
            left: &values[stride - 1..][..count],
            right: &values[stride + 1..][..count],
            above: &values[..count],
            below: &values[2 * stride..][..count],
        }
    }

    /// Sum over the neighbours on the left, right, above and below, weighted.
    #[inline(always)]
    fn weighted(&self, i: usize, [left, right, above, below]: [f64; 4]) -> f64 {
        let across = left * self.left[i] + right * self.right[i];
        across + (above * self.above[i] + below * self.below[i])
    }
}

/// Conjugate gradients preconditioned by one multigrid cycle.
pub(super) struct Multigrid {
    /// Finest grid first.
    levels: Vec<GridLevel>,
    /// The right-hand side b of the equations.
    right_side: Vectors,
    residual: Vectors,
    direction: Vectors,
    product: Vectors,
}

impl Multigrid {
    /// The grids of a domain, down to at most 2x2 cells.
    pub(super) fn new(domain: &Domain, lambda_sq: f64) -> Self {
        let mut levels = vec![GridLevel::finest(domain, lambda_sq)];
        while levels.last().is_some_and(|l| l.domain.width > 2 || l.domain.height > 2) {
            let coarser = levels[levels.len() - 1].halved();
            levels.push(coarser);
        }
        let zero = Vectors::zero(domain.is_inside.len());
        let (right_side, residual, direction) = (zero.clone(), zero.clone(), zero.clone());
        Self { levels, right_side, residual, direction, product: zero }
    }

    /// Sets the constraint g . (u, v) + c = 0 of a pixel.
    pub(super) fn set_constraint(&mut self, cell: usize, g: DVec2, c: f64) {
        let data = &mut self.levels[0].data;
        (data.uu[cell], data.uv[cell], data.vv[cell]) = (g.x * g.x, g.x * g.y, g.y * g.y);
        (self.right_side.u[cell], self.right_side.v[cell]) = (-g.x * c, -g.y * c);
    }

    /// Solves A x = b, starting from the given x, until |b - A x| <= tolerance |b|.
    pub(super) fn solve(&mut self, x: &mut Vectors, goal: Goal) -> Solved {
        pulp::Arch::new().dispatch(Solve { grids: self, x, goal })
    }

    /// Completes A on all grids after the constraints have been set.
    #[inline(always)]
    fn update_diagonals(&mut self) {
        for k in 0..self.levels.len() {
            self.levels[k].update_diagonal();
            if let [fine, coarse, ..] = &mut self.levels[k..] {
                fine.restrict_data(coarse);
            }
        }
    }

    #[inline(always)]
    fn conjugate_gradients(&mut self, x: &mut Vectors, goal: Goal) -> Solved {
        let least_norm = goal.tolerance * self.right_side.norm();
        self.levels[0].multiply(x, &mut self.residual);
        self.residual.combine(-1.0, 1.0, &self.right_side);
        let (mut residual_norm, mut slope, mut iterations) = (self.residual.norm(), f64::INFINITY, 0);
        while residual_norm > least_norm && iterations < goal.max_iterations {
            self.precondition();
            let preconditioned = &self.levels[0].solution;
            let next_slope = self.residual.dot(preconditioned);
            let memory = if iterations == 0 { 0.0 } else { next_slope / slope };
            self.direction.combine(memory, 1.0, preconditioned);
            slope = next_slope;
            self.levels[0].multiply(&self.direction, &mut self.product);
            let step = slope / self.direction.dot(&self.product);
            x.combine(1.0, step, &self.direction);
            self.residual.combine(1.0, -step, &self.product);
            residual_norm = self.residual.norm();
            iterations += 1;
        }
        let scale = self.right_side.norm();
        Solved { iterations, relative_residual: if scale > 0.0 { residual_norm / scale } else { 0.0 } }
    }

    /// One cycle down to the coarsest grid and up again, with a smoothing step before and after each grid:
    /// multiplies the residual by a symmetric approximation of the inverse of A. The result is the solution
    /// on the finest grid.
    #[inline(always)]
    fn precondition(&mut self) {
        self.levels[0].right_side.clone_from(&self.residual);
        let coarsest = self.levels.len() - 1;
        for k in 0..coarsest {
            let (fine, coarse) = self.levels.split_at_mut(k + 1);
            fine[k].smooth_from_zero();
            fine[k].restrict_residual(&mut coarse[0]);
        }
        self.levels[coarsest].smooth_from_zero();
        for _ in 1..COARSEST_STEPS {
            self.levels[coarsest].smooth();
        }
        for k in (0..coarsest).rev() {
            let (fine, coarse) = self.levels.split_at_mut(k + 1);
            fine[k].correct(&coarse[0]);
            fine[k].smooth();
        }
    }
}

/// When a solution is accurate enough.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// Residual relative to the right-hand side.
    pub(super) tolerance: f64,
    /// Iterations after which the solver stops.
    pub(super) max_iterations: usize,
}

/// The solver, compiled for each vector width.
struct Solve<'a> {
    grids: &'a mut Multigrid,
    x: &'a mut Vectors,
    goal: Goal,
}

impl pulp::WithSimd for Solve<'_> {
    type Output = Solved;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Solved {
        self.grids.update_diagonals();
        self.grids.conjugate_gradients(self.x, self.goal)
    }
}
