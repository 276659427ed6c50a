//! The sums that a refinement step needs, over several views at a time.

use super::{Solution, View};
use nalgebra::{Matrix4, Vector4};
use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// Numbers of as many views as a vector of the processor holds.
#[derive(Clone, Copy)]
struct Lanes<S: Simd>(S, S::f64s);

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.add_f64s(self.1, other.1))
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.sub_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.mul_f64s(self.1, other.1))
    }
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn all(simd: S, value: f64) -> Self {
        Self(simd, simd.splat_f64s(value))
    }

    /// Self times another plus a third.
    #[inline(always)]
    fn times_plus(self, by: Self, plus: Self) -> Self {
        Self(self.0, self.0.mul_add_e_f64s(self.1, by.1, plus.1))
    }

    /// One over the square root.
    #[inline(always)]
    fn inverse_root(self) -> Self {
        let one = self.0.splat_f64s(1.0);
        Self(self.0, self.0.div_f64s(one, self.0.sqrt_f64s(self.1)))
    }

    #[inline(always)]
    fn sum(self) -> f64 {
        self.0.reduce_sum_f64s(self.1)
    }
}

/// A multiple of every vector's length.
const PADDING: usize = 8;

/// Image vectors of one rod, coordinate by coordinate, padded; weight 0 where missing, else 1.
#[derive(Debug, Clone)]
struct Column {
    x: Vec<f64>,
    y: Vec<f64>,
    weight: Vec<f64>,
}

/// The views of K rods, column by column.
#[derive(Debug, Clone)]
pub(super) struct Columns<const K: usize>([Column; K]);

/// Cost, normal matrix and right side of the least squares, in the order (p, q, c of the first rod, of the second).
pub(super) type NormalEquations = (f64, Matrix4<f64>, Vector4<f64>);

impl<const K: usize> Columns<K> {
    /// Views as columns; `size` is the length of a harmless vector.
    pub(super) fn new(views: &[View<K>], size: f64) -> Self {
        let long = views.len().next_multiple_of(PADDING);
        Self(std::array::from_fn(|k| {
            let filled = |missing: f64, of: &dyn Fn(glam::DVec2) -> f64| {
                let mut values = Vec::with_capacity(long);
                values.extend(views.iter().map(|v| if v[k].x.is_nan() { missing } else { of(v[k]) }));
                values.resize(long, missing);
                values
            };
            Column { x: filled(size, &|d| d.x), y: filled(0.0, &|d| d.y), weight: filled(0.0, &|_| 1.0) }
        }))
    }

    /// The equations at a solution; residuals of a hinge whitened.
    pub(super) fn normal_equations(&self, solution: &Solution<K>, floor_sq: f64) -> NormalEquations {
        pulp::Arch::new().dispatch(Sums { columns: self, solution, floor_sq })
    }
}

struct Sums<'a, const K: usize> {
    columns: &'a Columns<K>,
    solution: &'a Solution<K>,
    floor_sq: f64,
}

/// One rod in some views: residual, its derivatives by p, q and c, and M d; see [`Problem`](super::Problem).
#[derive(Clone, Copy)]
struct Terms<S: Simd> {
    r: Lanes<S>,
    by_p: Lanes<S>,
    by_q: Lanes<S>,
    by_c: Lanes<S>,
    m_x: Lanes<S>,
    m_y: Lanes<S>,
}

impl<const K: usize> pulp::WithSimd for Sums<'_, K> {
    type Output = NormalEquations;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> NormalEquations {
        let all = |value: f64| Lanes::all(simd, value);
        let (p, q, floor) = (all(self.solution.g.x), all(self.solution.g.y), all(self.floor_sq));
        let (half, two, four) = (all(0.5), all(2.0), all(4.0));
        let c = self.solution.c.map(all);
        let columns: [[&[S::f64s]; 3]; K] = std::array::from_fn(|k| {
            let Column { x, y, weight } = &self.columns.0[k];
            [x, y, weight].map(|values| S::as_simd_f64s(values).0)
        });
        // Inlined by force: a call would pass vectors through memory.
        let terms = #[inline(always)]
        |k: usize, i: usize| {
            let [x, y, weight] = columns[k].map(|column| Lanes(simd, column[i]));
            let depth = p.times_plus(x, q * y);
            let (m_x, m_y) = (depth.times_plus(p, x), depth.times_plus(q, y));
            let by_w = half * m_x.times_plus(m_x, m_y.times_plus(m_y, floor)).inverse_root();
            let r = (x.times_plus(x, y.times_plus(y, depth * depth)) - c[k]) * by_w;
            let (w_by, along) = (four * by_w, m_x.times_plus(p, m_y * q));
            let (twice, by_w) = (two * depth, by_w * weight);
            let by_p = (twice * x - r * w_by * along.times_plus(x, depth * m_x)) * by_w;
            let by_q = (twice * y - r * w_by * along.times_plus(y, depth * m_y)) * by_w;
            Terms { r: r * weight, by_p, by_q, by_c: all(0.0) - by_w, m_x, m_y }
        };
        let (mut cost, mut right, mut normal) = (all(0.0), [all(0.0); 4], [[all(0.0); 4]; 4]);
        let mut add = #[inline(always)]
        |r: Lanes<S>, row: [Lanes<S>; 4], unknowns: usize| {
            cost = r.times_plus(r, cost);
            for i in 0..unknowns {
                for j in 0..=i {
                    normal[i][j] = row[i].times_plus(row[j], normal[i][j]);
                }
                right[i] = right[i] - row[i] * r;
            }
        };
        for i in 0..columns[0][0].len() {
            let first = terms(0, i);
            let first_row = [first.by_p, first.by_q, first.by_c, all(0.0)];
            add(first.r, first_row, 3);
            if K == 2 {
                let second = terms(1, i);
                let correlation =
                    two * first.m_x.times_plus(second.m_x, first.m_y * second.m_y) * first.by_c * second.by_c;
                let sharpen = (all(1.0) - correlation * correlation).inverse_root();
                let whitened = #[inline(always)]
                |second: Lanes<S>, first: Lanes<S>| (second - correlation * first) * sharpen;
                let row = [second.by_p, second.by_q, all(0.0), second.by_c];
                let row = [
                    whitened(row[0], first_row[0]),
                    whitened(row[1], first_row[1]),
                    whitened(row[2], first_row[2]),
                    row[3] * sharpen,
                ];
                add(whitened(second.r, first.r), row, 4);
            }
        }
        let mut matrix = Matrix4::from_fn(|i, j| normal[i.max(j)][i.min(j)].sum());
        if K == 1 {
            matrix[(3, 3)] = 1.0;
        }
        (cost.sum(), matrix, Vector4::from_fn(|i, _| right[i].sum()))
    }
}
