//! Levenberg and Marquardt's method with numerical derivatives, for a dozen parameters.

use nalgebra::{DMatrix, DVector};

/// Iterations after which a camera's search is given up.
pub(crate) const MOST_ITERATIONS: usize = 200;
/// Relative decrease of the sum of squares that ends the search.
const TOLERANCE: f64 = 1e-14;

/// Where the search ended.
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

    /// Covariance for residuals of unit variance: (JᵀJ)⁻¹; `None` if some parameter has no influence.
    pub(crate) fn unit_covariance(&self) -> Option<DMatrix<f64>> {
        // Scaled to unit diagonal, so that the parameters' units do not decide what is singular.
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

/// The parameters of least squared residuals reached from `start` in at most so many iterations; `steps` are those of
/// the derivatives.
///
/// `residuals` gives `None` where the model has no answer, such as a point behind the camera.
pub(crate) fn minimise(
    start: DVector<f64>,
    steps: &[f64],
    iterations: usize,
    residuals: impl Fn(&DVector<f64>) -> Option<DVector<f64>>,
) -> Option<Fit> {
    let mut parameters = start;
    let mut current = residuals(&parameters)?;
    let mut jacobian = derivatives(&parameters, steps, &residuals)?;
    let mut damping = 1e-3;
    for _ in 0..iterations {
        let normal = jacobian.tr_mul(&jacobian);
        let gradient = jacobian.tr_mul(&current);
        let before = current.norm_squared();
        let mut accepted = None;
        while damping < 1e12 {
            let mut damped = normal.clone();
            for i in 0..damped.nrows() {
                damped[(i, i)] += damping * normal[(i, i)].max(1e-12);
            }
            let tried = damped.cholesky().map(|c| &parameters - c.solve(&gradient));
            let found = tried.and_then(|tried| residuals(&tried).map(|r| (tried, r)));
            match found {
                Some((tried, r)) if r.norm_squared() <= before => {
                    accepted = Some((tried, r));
                    damping = (damping * 0.2).max(1e-14);
                    break;
                }
                _ => damping *= 8.0,
            }
        }
        let Some((tried, r)) = accepted else { break };
        let decrease = before - r.norm_squared();
        (parameters, current) = (tried, r);
        jacobian = derivatives(&parameters, steps, &residuals)?;
        if decrease <= TOLERANCE * before {
            break;
        }
    }
    current.iter().all(|r| r.is_finite()).then_some(Fit { parameters, residuals: current, jacobian })
}

/// Central differences.
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
}
