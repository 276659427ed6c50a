//! Least squares for one plane common to one or two rods, over any number of views.
//!
//! Hoffman and Flinchbaugh 1982 prove what the minimum number of views determines. This fit uses the same
//! constraint with more views and noise. A rod's image vector d_i = (x_i, y_i), from its pivot, has depth g . d_i
//! with g = (p, q), so
//!
//! ```text
//! h_i(g) = |d_i|^2 + (g . d_i)^2 = d_i' M d_i = c,    M = I + g g',  c = length^2
//! ```
//!
//! The residual is the error of h_i divided by the length of its gradient in the image, 2 |M d_i|: a distance in
//! the image (Sampson). Two rods have the same g, and each has its own c. In a hinge the pivot's noise enters
//! both rods: their residuals are correlated by (M a . M b) / (2 |M a| |M b|), which the fit takes into account.
//!
//! Starting values come from moments of (x^2, 2 x y, y^2), for which the cost of a plane takes constant time: a
//! coarse grid of planes and the linear ellipse fit (footnote 14 of the paper, Horn).
//!
//! The search has its own damping, not that of `estimate::least_squares`: it counts rejected steps, because all
//! starts are given a few steps before the best of them is followed, and it ends far from rounding.
//!
//! Limits: a rod cannot be distinguished from its mirror. Depth is not determined for a plane parallel to the
//! image (the slope's variance grows without bound), and neither are directions within a plane seen edge-on
//! (hence the tilt limit). For motion far from planar the cost has several minima, and the second best may be
//! returned (1 of 30 samples, with 12 % higher cost).

#[cfg(test)]
mod example;
mod lanes;
mod moments;
mod options;
mod robust;

pub(super) use moments::{form, slope_from_form};
pub use options::{FitError, FitOptions};

use super::Plane;
use glam::DVec2;
use lanes::{Columns, NormalEquations};
use moments::Moments;
use nalgebra::{Matrix4, Vector4};

/// Slopes beyond this share of the limit are at the limit: 79.8 of 80 degrees.
const AT_LIMIT: f64 = 0.98;

/// One view of K rods with a common pivot: image vectors, NaN if missing.
pub(super) type View<const K: usize> = [DVec2; K];

/// Result of a fit of K rods.
#[derive(Debug, Clone)]
pub(super) struct Fit<const K: usize> {
    pub plane: Plane,
    pub lengths: [f64; K],
    /// Of (p, q, length 1, length 2).
    pub covariance: Matrix4<f64>,
    pub residuals: Vec<[f64; K]>,
    pub outliers: Vec<bool>,
    pub residual_rms: f64,
    pub motion: [f64; K],
    pub motion_in_space: [f64; K],
    pub redundancy: usize,
    pub at_tilt_limit: bool,
}

/// Checked image vectors from the pivot.
pub(super) fn views<const K: usize>(pivot: &[DVec2], ends: [&[DVec2]; K]) -> Result<Vec<View<K>>, FitError> {
    for end in ends {
        if end.len() != pivot.len() {
            return Err(FitError::Lengths { pivot: pivot.len(), end: end.len() });
        }
    }
    for view in 0..pivot.len() {
        let infinite = |v: DVec2| v.x.is_infinite() || v.y.is_infinite();
        if infinite(pivot[view]) || ends.iter().any(|end| infinite(end[view])) {
            return Err(FitError::Infinite { view });
        }
    }
    let difference = |view: usize| {
        ends.map(|end| {
            let d = end[view] - pivot[view];
            if d.is_finite() { d } else { DVec2::NAN }
        })
    };
    Ok((0..pivot.len()).map(difference).collect())
}

/// Fits one plane to K rods: moments, starting values, refinement, then without outliers.
pub(super) fn fit<const K: usize>(views: &[View<K>], options: &FitOptions) -> Result<Fit<K>, FitError> {
    options.check()?;
    let needed = if K == 1 { 3 } else { 2 };
    for k in 0..K {
        let found = count(views, k);
        if found < needed {
            return Err(FitError::TooFewViews { found, needed });
        }
    }
    let motion = motion_of(views);
    let least = motion.iter().copied().fold(f64::INFINITY, f64::min);
    let size = largest(views);
    if size > 0.0 && !(1e-70..1e70).contains(&size) {
        return Err(FitError::Size { largest: size });
    }
    if least <= 1e-12 * size {
        return Err(FitError::NoMotion { motion: least });
    }
    let all = Problem::new(views, size, options);
    let (solution, outliers) =
        all.without_outliers(needed).unwrap_or_else(|| (all.solve(), vec![false; views.len()]));
    Ok(all.report(solution, outliers, motion))
}

/// Number of views that show rod k.
fn count<const K: usize>(views: &[View<K>], k: usize) -> usize {
    views.iter().filter(|v| !v[k].x.is_nan()).count()
}

/// Length of the longest image vector.
fn largest<const K: usize>(views: &[View<K>]) -> f64 {
    views.iter().flatten().filter(|d| !d.x.is_nan()).fold(0.0, |most, d| d.length().max(most))
}

/// RMS distance of each rod's image vectors from their mean.
fn motion_of<const K: usize>(views: &[View<K>]) -> [f64; K] {
    std::array::from_fn(|k| {
        let seen = || views.iter().map(|v| v[k]).filter(|d| !d.x.is_nan());
        let n = seen().count().max(1) as f64;
        let mean = seen().sum::<DVec2>() / n;
        (seen().map(|d| (d - mean).length_squared()).sum::<f64>() / n).sqrt()
    })
}

/// RMS distance of each rod's vectors in space from their mean, for a slope and depths whose noise has the variance
/// `noise_sq` |g|^2.
fn motion_in_space<const K: usize>(views: &[View<K>], motion: [f64; K], g: DVec2, noise_sq: f64) -> [f64; K] {
    std::array::from_fn(|k| {
        let depths = || views.iter().map(|v| g.dot(v[k])).filter(|depth| !depth.is_nan());
        let n = depths().count().max(1) as f64;
        let mean = depths().sum::<f64>() / n;
        let variance = depths().map(|depth| (depth - mean).powi(2)).sum::<f64>() / n;
        (motion[k].powi(2) + (variance - noise_sq * g.length_squared()).max(0.0)).sqrt()
    })
}

/// Slope and squared lengths during the iteration.
#[derive(Debug, Clone, Copy)]
struct Solution<const K: usize> {
    g: DVec2,
    c: [f64; K],
    cost: f64,
}

/// A solution during the iteration, with the equations of the next step.
#[derive(Debug, Clone, Copy)]
struct Stand<const K: usize> {
    at: Solution<K>,
    normal: Matrix4<f64>,
    right: Vector4<f64>,
}

/// Views, with values that all steps of a fit need.
struct Problem<'a, const K: usize> {
    views: &'a [View<K>],
    columns: Columns<K>,
    options: &'a FitOptions,
    size: f64,
    /// Variance of an image coordinate of a rod's vector: both ends have noise.
    noise_sq: f64,
    /// Added to |M d|^2, because an image vector of length 0 has no gradient.
    floor_sq: f64,
    slope_limit: f64,
}

impl<'a, const K: usize> Problem<'a, K> {
    fn new(views: &'a [View<K>], size: f64, options: &'a FitOptions) -> Self {
        let noise_sq = 2.0 * options.noise_sd * options.noise_sd;
        Self {
            views,
            columns: Columns::new(views, size),
            options,
            size,
            noise_sq,
            floor_sq: noise_sq.max(1e-16 * size * size),
            slope_limit: options.max_tilt_deg.to_radians().tan(),
        }
    }

    /// The same problem with other views.
    fn of<'b>(&self, views: &'b [View<K>]) -> Problem<'b, K>
    where
        'a: 'b,
    {
        Problem { views, columns: Columns::new(views, self.size), ..*self }
    }

    /// r = (h - c) / w, w^2 = 4 (|M d|^2 + floor); NaN if missing.
    fn residuals(&self, view: &View<K>, s: &Solution<K>) -> [f64; K] {
        std::array::from_fn(|k| {
            let depth = s.g.dot(view[k]);
            let m_d = view[k] + depth * s.g;
            let by_w = 0.5 / (m_d.length_squared() + self.floor_sq).sqrt();
            (view[k].length_squared() + depth * depth - s.c[k]) * by_w
        })
    }

    /// Cost, normal matrix and right-hand side at a solution; residuals of a hinge whitened.
    ///
    /// With w the length of the gradient, dw/dp = 4 (M d) . (x g + depth e_x) / w. Residuals of a hinge's rods
    /// are correlated through the noise of the pivot, by 2 (M a . M b) da/dc db/dc in [-1/2, 1/2].
    fn normal_equations(&self, s: &Solution<K>) -> NormalEquations {
        self.columns.normal_equations(s, self.floor_sq)
    }

    fn stand(&self, at: Solution<K>) -> Stand<K> {
        let (cost, normal, right) = self.normal_equations(&at);
        Stand { at: Solution { cost, ..at }, normal, right }
    }

    /// A slope within the limit, with the best squared lengths for it, rod by rod.
    fn at_slope(&self, g: DVec2) -> Stand<K> {
        let g = g.clamp_length_max(0.9999 * self.slope_limit);
        let c = std::array::from_fn(|k| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for d in self.views.iter().map(|v| v[k]).filter(|d| !d.x.is_nan()) {
                let depth = g.dot(d);
                let w = 1.0 / ((d + depth * g).length_squared() + self.floor_sq);
                sum += w * (d.length_squared() + depth * depth);
                weight += w;
            }
            sum / weight
        });
        self.stand(Solution { g, c, cost: 0.0 })
    }

    /// Refines the starting values for a few steps, and the best of them to convergence.
    fn solve(&self) -> Solution<K> {
        let starts = Moments::new(self.views).starts(self.slope_limit);
        let refined = starts.into_iter().flatten().map(|g| self.refine(self.at_slope(g), 3));
        let cheaper = |a: &Stand<K>, b: &Stand<K>| a.at.cost.total_cmp(&b.at.cost);
        let best = self.refine(refined.min_by(cheaper).expect("there is always one start"), 12);
        if best.at.g.length() < AT_LIMIT * self.slope_limit {
            return best.at;
        }
        // The cost from moments favours the limit more than the exact cost does, so slopes inside are tried as
        // well.
        let [rival, other] = [0.55, 0.15].map(|part| self.refine(self.at_slope(part * best.at.g), 4));
        let rival = if other.at.cost < rival.at.cost { other } else { rival };
        // A candidate that is still much worse after some steps is dropped.
        let rival = if rival.at.cost < 1.5 * best.at.cost { self.refine(rival, 8) } else { rival };
        if rival.at.cost < best.at.cost { rival.at } else { best.at }
    }

    /// Levenberg-Marquardt on (u, c) with g = limit u / sqrt(1 + |u|^2), which keeps the slope within its
    /// limit.
    fn refine(&self, start: Stand<K>, iterations: usize) -> Stand<K> {
        let limit = self.slope_limit;
        let mut best = start;
        let mut damping = 1e-4;
        for _ in 0..iterations {
            let Stand { at, normal, right } = best;
            let root = (limit * limit - at.g.length_squared()).sqrt();
            // dg/du, symmetric: root / limit (limit I - g g' / limit)
            let scale = root / limit;
            let along = at.g / limit;
            let by_u = Matrix4::new(
                scale * limit * (1.0 - along.x * along.x),
                -scale * limit * along.x * along.y,
                0.0,
                0.0,
                -scale * limit * along.x * along.y,
                scale * limit * (1.0 - along.y * along.y),
                0.0,
                0.0,
                0.0,
                0.0,
                1.0,
                0.0,
                0.0,
                0.0,
                0.0,
                1.0,
            );
            let mut damped = by_u * normal * by_u;
            for i in 0..4 {
                damped[(i, i)] *= 1.0 + damping;
                damped[(i, i)] += f64::MIN_POSITIVE;
            }
            let step = damped.cholesky().map_or(Vector4::repeat(f64::NAN), |c| c.solve(&(by_u * right)));
            let u = at.g / root + DVec2::new(step[0], step[1]);
            let g = (limit * u / (1.0 + u.length_squared()).sqrt()).clamp_length_max(0.9999 * limit);
            let c = std::array::from_fn(|k| at.c[k] + step[2 + k]);
            let next = self.stand(Solution { g, c, cost: 0.0 });
            if next.at.cost < at.cost {
                let gain = (at.cost - next.at.cost) / at.cost;
                best = next;
                damping = (0.1 * damping).max(1e-15);
                if gain < 1e-4 {
                    break;
                }
            } else {
                damping *= 10.0;
                // The step is lost in rounding, or too small to matter.
                if damping > 1e3 || step.rows(0, 2).norm() <= 1e-13 * (1.0 + u.length()) {
                    break;
                }
            }
        }
        best
    }

    /// Lengths, covariance and residuals at a solution; `self` holds all views.
    ///
    /// The noise adds noise^2 trace(M) to every h, so c is too large by this.
    fn report(&self, s: Solution<K>, outliers: Vec<bool>, motion: [f64; K]) -> Fit<K> {
        let residuals: Vec<[f64; K]> = self.views.iter().map(|v| self.residuals(v, &s)).collect();
        let kept: Vec<View<K>> =
            self.views.iter().zip(&outliers).filter(|(_, o)| !**o).map(|(v, _)| *v).collect();
        let (_, normal, _) = if outliers.contains(&true) {
            self.of(&kept).normal_equations(&s)
        } else {
            self.normal_equations(&s)
        };
        let inside = residuals.iter().zip(&outliers).filter(|(_, o)| !**o).flat_map(|(r, _)| r);
        let (mut squares, mut used) = (0.0, 0);
        for r in inside.filter(|r| !r.is_nan()) {
            squares += r * r;
            used += 1;
        }
        let redundancy = used - (2 + K).min(used);
        let bias = self.noise_sq * (2.0 + s.g.length_squared());
        let lengths = s.c.map(|c| if c > 2.0 * bias { (c - bias).sqrt() } else { c.max(0.0).sqrt() });
        let variance = self.noise_sq.max(if redundancy > 0 { squares / redundancy as f64 } else { 0.0 });
        let mut covariance = normal.try_inverse().map_or(Matrix4::repeat(f64::INFINITY), |c| c * variance);
        // From c to length: d length = d c / (2 length).
        for k in 0..K {
            for i in 0..4 {
                covariance[(i, 2 + k)] /= 2.0 * lengths[k];
                covariance[(2 + k, i)] /= 2.0 * lengths[k];
            }
        }
        Fit {
            plane: Plane::from_slope(s.g),
            lengths,
            covariance,
            residual_rms: (squares / used.max(1) as f64).sqrt(),
            residuals,
            outliers,
            motion,
            motion_in_space: motion_in_space(&kept, motion, s.g, self.noise_sq),
            redundancy,
            at_tilt_limit: s.g.length() >= AT_LIMIT * self.slope_limit,
        }
    }
}

#[cfg(test)]
mod tests;
