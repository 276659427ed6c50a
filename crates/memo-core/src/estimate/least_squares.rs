//! The method of Levenberg and Marquardt: the damped step, scaled as by Marquardt (1963), and a search with
//! numerical derivatives for about a dozen parameters.

use nalgebra::allocator::Allocator;
use nalgebra::{DMatrix, DVector, DefaultAllocator, Dim, OMatrix, OVector};

/// Maximum number of iterations in the search for a camera.
pub(crate) const MOST_ITERATIONS: usize = 200;
/// Relative decrease of the sum of squares below which the search ends.
const TOLERANCE: f64 = 1e-14;
/// Least square of a parameter's influence, in pixels: that of one without influence is a rounding error.
const LEAST_SQUARE: f64 = 1e-12;

/// The damping between two steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Damping {
    share: f64,
    least_square: f64,
}

impl Damping {
    /// Before the first step; diag JᵀJ is taken as at least `least_square`.
    pub(crate) fn start(least_square: f64) -> Self {
        Self { share: 1e-3, least_square }
    }

    /// What the first step s of (JᵀJ + damping diag JᵀJ) s = -Jᵀr leads to that is accepted, with increasing
    /// damping; `lead` returns `None` for a step that is not, since the sum of squares increases. `None` if no
    /// step is accepted.
    pub(crate) fn descend<D: Dim, T>(
        &mut self,
        normal: &OMatrix<f64, D, D>,
        gradient: &OVector<f64, D>,
        lead: impl Fn(&OVector<f64, D>) -> Option<T>,
    ) -> Option<T>
    where
        DefaultAllocator: Allocator<D> + Allocator<D, D>,
    {
        while self.share < 1e12 {
            let mut damped = normal.clone();
            for i in 0..damped.nrows() {
                damped[(i, i)] += self.share * normal[(i, i)].max(self.least_square);
            }
            let found = damped.cholesky().and_then(|factor| lead(&-factor.solve(gradient)));
            if found.is_some() {
                self.share = (self.share * 0.2).max(1e-14);
                return found;
            }
            self.share *= 8.0;
        }
        None
    }
}

/// The end of a search.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) parameters: DVector<f64>,
    pub(crate) residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl Fit {
    pub(crate) fn sum_sq(&self) -> f64 {
        self.residuals.norm_squared()
    }

    /// Covariance for residuals of unit variance: (JᵀJ)⁻¹; `None` if a parameter has no influence.
    pub(crate) fn unit_covariance(&self) -> Option<DMatrix<f64>> {
        // Scaled to unit diagonal, so that the units of the parameters do not affect the test for
        // singularity.
        let normal = self.jacobian.tr_mul(&self.jacobian);
        let scale: Vec<f64> = normal.diagonal().iter().map(|d| d.sqrt()).collect();
        if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
            return None;
        }
        let count = scale.len();
        let correlation = DMatrix::from_fn(count, count, |i, j| normal[(i, j)] / (scale[i] * scale[j]));
        let eigen = correlation.clone().symmetric_eigen();
        if eigen.eigenvalues.min() < 1e-13 {
            return None;
        }
        let inverse = correlation.cholesky()?.inverse();
        Some(DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] / (scale[i] * scale[j])))
    }
}

/// The parameters with the smallest sum of squared residuals, reached from `start` in at most the given
/// number of iterations; `steps` are the step sizes of the derivatives.
///
/// `residuals` returns `None` where the model is undefined, for example for a point behind the camera.
pub(crate) fn minimise(
    start: DVector<f64>,
    steps: &[f64],
    iterations: usize,
    residuals: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
) -> Option<Fit> {
    let mut parameters = start;
    let mut current = residuals(&parameters)?;
    let mut jacobian = derivatives(&parameters, steps, &residuals)?;
    let mut damping = Damping::start(LEAST_SQUARE);
    for _ in 0..iterations {
        let normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&current);
        let before = current.norm_squared();
        let lead = |step: &DVector<f64>| {
            let tried = &parameters + step;
            residuals(&tried).filter(|r| r.norm_squared() <= before).map(|r| (tried, r))
        };
        let Some((tried, r)) = damping.descend(&normal, &gradient, lead) else { break };
        let decrease = before - r.norm_squared();
        (parameters, current) = (tried, r);
        jacobian = derivatives(&parameters, steps, &residuals)?;
        if decrease <= TOLERANCE * before {
            break;
        }
    }
    current.iter().all(|r| r.is_finite()).then_some(Fit { parameters, residuals: current, jacobian })
}

/// Derivatives by central differences.
fn derivatives(
    parameters: &DVector<f64>,
    steps: &[f64],
    residuals: &impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
) -> Option<DMatrix<f64>> {
    let mut columns = Vec::with_capacity(steps.len());
    for (i, step) in steps.iter().enumerate() {
        let at = |sign: f64| {
            let mut moved = parameters.clone();
            moved[i] += sign * step;
            residuals(&moved)
        };
        columns.push((at(1.0)? - at(-1.0)?) / (2.0 * step));
    }
    Some(DMatrix::from_columns(&columns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_that_are_no_numbers_have_no_covariance() {
        for wrong in [f64::NAN, f64::INFINITY, 1e200, 0.0] {
            let jacobian = DMatrix::from_row_slice(3, 2, &[1.0, wrong, 2.0, wrong, 3.0, wrong]);
            let fit = Fit { parameters: DVector::zeros(2), residuals: DVector::zeros(3), jacobian };
            assert_eq!(fit.unit_covariance(), None, "{wrong}");
        }
    }

    fn vector(values: &[f64]) -> DVector<f64> {
        DVector::from_column_slice(values)
    }

    /// A straight line through points: parameters and their unit covariance from the normal equations,
    /// written out.
    #[test]
    fn a_line_has_the_covariance_of_the_textbook() {
        let points = [(0.0, 1.1), (1.0, 2.9), (2.0, 5.2), (4.0, 8.8)];
        let residuals = |p: &DVector<f64>| Some(vector(&points.map(|(x, y)| p[0] + p[1] * x - y)));
        let fit = minimise(vector(&[0.0, 0.0]), &[1e-3, 1e-3], MOST_ITERATIONS, residuals).unwrap();
        let (n, x, xx, y, xy) = (4.0, 7.0, 21.0, 18.0, 2.9 + 10.4 + 35.2);
        let determinant = n * xx - x * x;
        assert!((fit.parameters[0] - (xx * y - x * xy) / determinant).abs() < 1e-9);
        assert!((fit.parameters[1] - (n * xy - x * y) / determinant).abs() < 1e-9);
        let covariance = fit.unit_covariance().unwrap();
        for (row, column, expected) in [(0, 0, xx), (0, 1, -x), (1, 0, -x), (1, 1, n)] {
            assert!((covariance[(row, column)] - expected / determinant).abs() < 1e-9, "{covariance}");
        }
        let by_hand = points.map(|(x, y)| (fit.parameters[0] + fit.parameters[1] * x - y).powi(2));
        assert!((fit.sum_sq() - by_hand.iter().sum::<f64>()).abs() < 1e-12);
    }

    /// Two parameters with nearly the same effect have no covariance once rounding would determine it.
    #[test]
    fn parameters_that_do_the_same_have_no_covariance() {
        let with = |difference: f64| {
            let residuals = |p: &DVector<f64>| {
                Some(DVector::from_fn(4, |i, _| p[0] + p[1] * (1.0 + difference * i as f64) - 1.0))
            };
            minimise(vector(&[0.2, 0.3]), &[1.0, 1.0], MOST_ITERATIONS, residuals).unwrap().unit_covariance()
        };
        assert!(with(1e-4).is_some());
        assert!(with(1e-7).is_none() && with(0.0).is_none());
        let idle = |p: &DVector<f64>| Some(vector(&[p[0] - 1.0, p[0] + 1.0]));
        assert!(
            minimise(vector(&[0.2, 0.3]), &[1e-3, 1e-3], MOST_ITERATIONS, idle)
                .unwrap()
                .unit_covariance()
                .is_none()
        );
    }

    /// Rosenbrock's valley, (1 - x, 10 (y - x²)) from (-1.2, 1): its minimum at (1, 1) is far along a curve.
    #[test]
    fn a_bent_valley_is_followed_to_its_end() {
        let residuals = |p: &DVector<f64>| Some(vector(&[1.0 - p[0], 10.0 * (p[1] - p[0] * p[0])]));
        let fit = minimise(vector(&[-1.2, 1.0]), &[1e-6, 1e-6], MOST_ITERATIONS, residuals).unwrap();
        assert!((fit.parameters - vector(&[1.0, 1.0])).norm() < 1e-6);
    }

    /// Undamped, the step from 3 on the arc tangent goes to -9.5 and diverges from there.
    #[test]
    fn steps_that_lead_away_are_shortened() {
        let fit = minimise(vector(&[3.0]), &[1e-6], MOST_ITERATIONS, |p| Some(p.map(f64::atan))).unwrap();
        assert!(fit.parameters[0].abs() < 1e-9, "{}", fit.parameters[0]);
    }

    /// From 20 the step to the root of ln x - 1 goes to -20, where the logarithm is undefined.
    #[test]
    fn steps_to_where_the_model_has_no_answer_are_shortened() {
        let residuals = |p: &DVector<f64>| (p[0] > 0.0).then(|| p.map(|x| x.ln() - 1.0));
        let fit = minimise(vector(&[20.0]), &[1e-6], MOST_ITERATIONS, residuals).unwrap();
        assert!((fit.parameters[0] - std::f64::consts::E).abs() < 1e-8);
        assert!(minimise(vector(&[-1.0]), &[1e-6], MOST_ITERATIONS, residuals).is_none());
    }
}
