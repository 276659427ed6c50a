//! The sums of a refinement step, over several views at a time.

use super::{Solution, View};
use nalgebra::{Matrix4, Vector4};
use pulp::Simd;
use std::ops::{Add, Mul, Sub};

/// One number per view, as many as a vector of the processor holds.
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

    /// Self times `by` plus `plus`.
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

/// A multiple of every vector length.
const PADDING: usize = 8;

/// Image vectors of one rod, one array per coordinate, padded; weight 0 if missing, else 1.
#[derive(Debug, Clone)]
struct Column {
    x: Vec<f64>,
    y: Vec<f64>,
    weight: Vec<f64>,
}

/// The views of K rods, one column per rod.
#[derive(Debug, Clone)]
pub(super) struct Columns<const K: usize>([Column; K]);

/// Cost, normal matrix and right-hand side of the least squares, in the order (p, q, c of the first rod, of the
/// second).
pub(super) type NormalEquations = (f64, Matrix4<f64>, Vector4<f64>);

impl<const K: usize> Columns<K> {
    /// Views as columns; `size` is the length of the vector used for missing views.
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

/// Terms of one rod in some views: residual, its derivatives by p, q and c, and M d; see
/// [`Problem`](super::Problem).
#[derive(Clone, Copy)]
struct Terms<S: Simd> {
    r: Lanes<S>,
    by_p: Lanes<S>,
    by_q: Lanes<S>,
    by_c: Lanes<S>,
    m_x: Lanes<S>,
    m_y: Lanes<S>,
}

/// The slope and constants, in every lane.
struct At<S: Simd> {
    p: Lanes<S>,
    q: Lanes<S>,
    zero: Lanes<S>,
    floor: Lanes<S>,
    half: Lanes<S>,
    two: Lanes<S>,
    four: Lanes<S>,
}

impl<S: Simd> At<S> {
    /// Terms of image vectors (x, y) with a weight and a squared length c.
    #[inline(always)]
    fn terms(&self, [x, y, weight]: [Lanes<S>; 3], c: Lanes<S>) -> Terms<S> {
        let (p, q) = (self.p, self.q);
        let depth = p.times_plus(x, q * y);
        let (m_x, m_y) = (depth.times_plus(p, x), depth.times_plus(q, y));
        let by_w = self.half * m_x.times_plus(m_x, m_y.times_plus(m_y, self.floor)).inverse_root();
        let r = (x.times_plus(x, y.times_plus(y, depth * depth)) - c) * by_w;
        let (r_by, along) = (r * self.four * by_w, m_x.times_plus(p, m_y * q));
        let (twice, by_w) = (self.two * depth, by_w * weight);
        let by_p = (twice * x - r_by * along.times_plus(x, depth * m_x)) * by_w;
        let by_q = (twice * y - r_by * along.times_plus(y, depth * m_y)) * by_w;
        Terms { r: r * weight, by_p, by_q, by_c: self.zero - by_w, m_x, m_y }
    }
}

/// The accumulated sums.
struct Total<S: Simd> {
    cost: Lanes<S>,
    right: [Lanes<S>; 4],
    /// Lower triangle.
    normal: [[Lanes<S>; 4]; 4],
}

impl<S: Simd> Total<S> {
    /// Adds residuals and their derivatives by the first `unknowns` unknowns.
    #[inline(always)]
    fn add(&mut self, r: Lanes<S>, row: [Lanes<S>; 4], unknowns: usize) {
        self.cost = r.times_plus(r, self.cost);
        for i in 0..unknowns {
            for j in 0..=i {
                self.normal[i][j] = row[i].times_plus(row[j], self.normal[i][j]);
            }
            self.right[i] = self.right[i] - row[i] * r;
        }
    }
}

impl<const K: usize> pulp::WithSimd for Sums<'_, K> {
    type Output = NormalEquations;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> NormalEquations {
        let zero = Lanes::all(simd, 0.0);
        let at = At {
            p: Lanes::all(simd, self.solution.g.x),
            q: Lanes::all(simd, self.solution.g.y),
            zero,
            floor: Lanes::all(simd, self.floor_sq),
            half: Lanes::all(simd, 0.5),
            two: Lanes::all(simd, 2.0),
            four: Lanes::all(simd, 4.0),
        };
        let (one, last) = (Lanes::all(simd, 1.0), K - 1);
        let columns = [0, last].map(|k| {
            let Column { x, y, weight } = &self.columns.0[k];
            [S::as_simd_f64s(x).0, S::as_simd_f64s(y).0, S::as_simd_f64s(weight).0]
        });
        let c = [Lanes::all(simd, self.solution.c[0]), Lanes::all(simd, self.solution.c[last])];
        let mut total = Total { cost: zero, right: [zero; 4], normal: [[zero; 4]; 4] };
        for i in 0..columns[0][0].len() {
            let [x, y, weight] = columns[0];
            let a = at.terms([Lanes(simd, x[i]), Lanes(simd, y[i]), Lanes(simd, weight[i])], c[0]);
            total.add(a.r, [a.by_p, a.by_q, a.by_c, zero], 3);
            if K == 2 {
                let [x, y, weight] = columns[1];
                let b = at.terms([Lanes(simd, x[i]), Lanes(simd, y[i]), Lanes(simd, weight[i])], c[1]);
                let correlation = at.two * a.m_x.times_plus(b.m_x, a.m_y * b.m_y) * a.by_c * b.by_c;
                let sharpen = (one - correlation * correlation).inverse_root();
                let row = [
                    (b.by_p - correlation * a.by_p) * sharpen,
                    (b.by_q - correlation * a.by_q) * sharpen,
                    (zero - correlation * a.by_c) * sharpen,
                    b.by_c * sharpen,
                ];
                total.add((b.r - correlation * a.r) * sharpen, row, 4);
            }
        }
        let mut matrix = Matrix4::zeros();
        let mut right = Vector4::zeros();
        for i in 0..4 {
            for j in 0..=i {
                matrix[(i, j)] = total.normal[i][j].sum();
                matrix[(j, i)] = matrix[(i, j)];
            }
            right[i] = total.right[i].sum();
        }
        if K == 1 {
            matrix[(3, 3)] = 1.0;
        }
        (total.cost.sum(), matrix, right)
    }
}
