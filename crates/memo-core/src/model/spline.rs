//! Periodic cubic interpolation on the unit cycle.
//!
//! Source: Rohr 1994, section 3.2 (periodic cubic splines, after Schwarz 1986). The monotone variant after
//! Fritsch and Butland 1984 is for curves given by their extremes (Boulic et al. 1990). Knots must be
//! distinct modulo 1.

/// A cubic polynomial on each interval of the cycle, given by values and slopes at the knots (Hermite form).
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicCubic {
    knots: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl PeriodicCubic {
    /// The twice continuously differentiable periodic spline through equally spaced samples; the first sample
    /// is at phase 0.
    ///
    /// With h the spacing, continuity of the second derivative at knot i is s_(i-1) + 4 s_i + s_(i+1) = 3
    /// (y_(i+1) - y_(i-1)) / h.
    ///
    /// # Panics
    /// With fewer than three samples.
    pub fn spline(samples: &[f64]) -> Self {
        let n = samples.len();
        assert!(n >= 3, "a periodic spline needs three samples, got {n}");
        let h = 1.0 / n as f64;
        let right: Vec<f64> =
            (0..n).map(|i| 3.0 * (samples[(i + 1) % n] - samples[(i + n - 1) % n]) / h).collect();
        Self {
            knots: (0..n).map(|i| i as f64 * h).collect(),
            values: samples.to_vec(),
            slopes: solve_cyclic_1_4_1(&right),
        }
    }

    /// The periodic monotone cubic through (phase, value) control points: no overshoot between neighbours.
    ///
    /// The slope at a knot is the weighted harmonic mean of the neighbouring secants, 0 at an extreme
    /// (Fritsch and Butland 1984, eq. 5).
    ///
    /// # Panics
    /// With fewer than two points of distinct phase.
    pub fn monotone(points: &[(f64, f64)]) -> Self {
        let mut points: Vec<(f64, f64)> = points.iter().map(|&(p, y)| (p.rem_euclid(1.0), y)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by(|a, b| a.0 - b.0 < 1e-9);
        let n = points.len();
        assert!(n >= 2, "a periodic curve needs two distinct points, got {n}");
        let width = |i: usize| {
            let next = points[(i + 1) % n].0 + if i + 1 == n { 1.0 } else { 0.0 };
            next - points[i].0
        };
        let secant = |i: usize| (points[(i + 1) % n].1 - points[i].1) / width(i);
        let slopes = (0..n)
            .map(|i| {
                let before = (i + n - 1) % n;
                let (d0, d1, h0, h1) = (secant(before), secant(i), width(before), width(i));
                if d0 * d1 <= 0.0 {
                    return 0.0;
                }
                let (w0, w1) = (2.0 * h1 + h0, h1 + 2.0 * h0);
                (w0 + w1) / (w0 / d0 + w1 / d1)
            })
            .collect();
        Self {
            knots: points.iter().map(|p| p.0).collect(),
            values: points.iter().map(|p| p.1).collect(),
            slopes,
        }
    }

    /// The value at any phase (taken modulo 1).
    pub fn at(&self, phase: f64) -> f64 {
        let phase = phase.rem_euclid(1.0);
        let n = self.knots.len();
        let i = (self.knots.partition_point(|&k| k <= phase) + n - 1) % n;
        let j = (i + 1) % n;
        let h = (self.knots[j] - self.knots[i]).rem_euclid(1.0);
        let t = (phase - self.knots[i]).rem_euclid(1.0) / h;
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * self.values[i]
            + (t3 - 2.0 * t2 + t) * h * self.slopes[i]
            + (3.0 * t2 - 2.0 * t3) * self.values[j]
            + (t3 - t2) * h * self.slopes[j]
    }

    /// The same curve with every value multiplied by `factor` and then increased by `offset`.
    #[must_use]
    pub fn affine(&self, factor: f64, offset: f64) -> Self {
        Self {
            knots: self.knots.clone(),
            values: self.values.iter().map(|v| v * factor + offset).collect(),
            slopes: self.slopes.iter().map(|s| s * factor).collect(),
        }
    }
}

/// Solves x_(i-1) + 4 x_i + x_(i+1) = r_i with indices modulo n.
///
/// Gauss-Seidel contracts by at least 1/2 per sweep (the matrix is diagonally dominant), so 60 sweeps
/// converge to the last bit for any n.
fn solve_cyclic_1_4_1(right: &[f64]) -> Vec<f64> {
    let n = right.len();
    let mut x: Vec<f64> = right.iter().map(|r| r / 6.0).collect();
    for _ in 0..60 {
        for i in 0..n {
            x[i] = (right[i] - x[(i + n - 1) % n] - x[(i + 1) % n]) / 4.0;
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_spline_passes_its_samples_and_is_smooth_across_the_seam() {
        let samples = [23.8, 22.4, 12.0, 0.0, -9.0, -13.7, -7.3, 11.4, 23.9, 25.0];
        let curve = PeriodicCubic::spline(&samples);
        for (i, y) in samples.iter().enumerate() {
            assert!((curve.at(i as f64 / 10.0) - y).abs() < 1e-12);
        }
        let e = 1e-4;
        for knot in [0.0, 0.3] {
            let second = |p: f64| (curve.at(p + e) - 2.0 * curve.at(p) + curve.at(p - e)) / (e * e);
            assert!(
                (second(knot - 2.0 * e) - second(knot + 2.0 * e)).abs() < 30.0,
                "second derivative jumps at {knot}"
            );
        }
    }

    #[test]
    fn a_sampled_sine_comes_back_to_fourth_order() {
        let error = |n: usize| {
            let samples: Vec<f64> = (0..n).map(|i| (TAU * i as f64 / n as f64).sin()).collect();
            let curve = PeriodicCubic::spline(&samples);
            (0..1000)
                .map(|i| f64::from(i) / 1000.0)
                .fold(0.0f64, |m, p| m.max((curve.at(p) - (TAU * p).sin()).abs()))
        };
        let ratio = error(20) / error(40);
        assert!((14.0..18.0).contains(&ratio), "halving the spacing divides the error by 16, got {ratio}");
    }

    #[test]
    fn monotone_curves_stay_between_their_control_points() {
        let curve = PeriodicCubic::monotone(&[(-0.1, 25.0), (0.5, -15.0)]);
        for i in 0..200 {
            let y = curve.at(f64::from(i) / 200.0);
            assert!((-15.0..=25.0).contains(&y));
        }
        assert!((curve.at(0.9) - 25.0).abs() < 1e-12 && (curve.at(1.5) + 15.0).abs() < 1e-12);
    }

    /// The slope at a knot between secants d0, d1 over h0, h1 is 3 (h0 + h1) divided by (2 h1 + h0) / d0 +
    /// (h1 + 2 h0) / d1. SciPy 1.17.1 uses the same formula:
    /// `x = np.array([0.1, 0.25, 0.6, 0.7]); y = np.array([2.0, 5.0, 6.0, 1.0])`
    /// `PchipInterpolator(np.concatenate([x - 1, x, x + 1]), np.tile(y, 3))(t)`.
    #[test]
    fn monotone_curves_agree_with_scipy() {
        let curve = PeriodicCubic::monotone(&[(0.6, 6.0), (0.1, 2.0), (-0.3, 1.0), (1.25, 5.0)]);
        for (phase, expected) in [
            (0.0, 1.5603530534351147),
            (0.17, 3.3537476203939307),
            (0.25, 5.0),
            (0.4, 5.665694849368319),
            (0.55, 5.978620019436345),
            (0.65, 3.4999999999999956),
            (0.8, 1.0617843511450382),
            (0.95, 1.388388597328244),
        ] {
            assert!((curve.at(phase) - expected).abs() < 1e-12, "{phase}: {}", curve.at(phase));
        }
    }

    /// SciPy 1.17.1: `CubicSpline(np.arange(11) / 10, np.append(y, y[0]), bc_type='periodic')(t)`.
    #[test]
    fn periodic_splines_agree_with_scipy() {
        let curve = PeriodicCubic::spline(&[23.8, 22.4, 12.0, 0.0, -9.0, -13.7, -7.3, 11.4, 23.9, 25.0]);
        for (phase, expected) in [
            (0.05, 23.784150717703348),
            (0.13, 20.127043540669852),
            (0.37, -6.628956459330143),
            (0.5, -13.7),
            (0.81, 24.43121722488038),
            (0.96, 24.097554066985648),
        ] {
            assert!((curve.at(phase) - expected).abs() < 1e-12, "{phase}: {}", curve.at(phase));
            let shifted = curve.affine(-2.0, 3.0).at(phase);
            assert!((shifted - (3.0 - 2.0 * expected)).abs() < 1e-11, "{phase}: {shifted}");
        }
    }
}
