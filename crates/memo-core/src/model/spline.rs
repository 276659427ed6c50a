//! Periodic cubic interpolation on the unit cycle.
//!
//! Source: Rohr 1994, section 3.2 (periodic cubic splines, after Schwarz 1986).

/// A cubic polynomial on each of equal intervals of the cycle, given by values and slopes at their starts (Hermite
/// form). The first starts at phase 0.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicCubic {
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
        Self { values: samples.to_vec(), slopes: solve_cyclic_1_4_1(&right) }
    }

    /// The value at any phase (taken modulo 1).
    pub fn at(&self, phase: f64) -> f64 {
        let n = self.values.len();
        let (h, along) = (1.0 / n as f64, phase.rem_euclid(1.0) * n as f64);
        // A phase just below 0 is rounded to 1.
        let i = along as usize % n;
        let j = (i + 1) % n;
        let t = along.fract();
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
