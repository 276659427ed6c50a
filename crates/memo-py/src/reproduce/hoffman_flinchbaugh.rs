//! Hoffman and Flinchbaugh (1982): the propositions on random problems.

use crate::array::rows_from_numpy;
use crate::result::result;
use crate::wait::interruptible;
use crate::whole::{FROM_0, Whole, WholeNumbers};
use glam::DVec2;
use memo_core::reproduce::hoffman_flinchbaugh::{
    self, DEGENERATE, degenerate_refusals, false_targets, hinge_trials, rod_trials,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

result! {
    /// Proposition 1 on random rods in three views: counts and largest errors.
    RodTrials |_py, found: hoffman_flinchbaugh::RodTrials| {
        trials: usize,
        recovered: usize,
        recovered_by_ellipse: usize,
        recovered_as_printed: usize,
        one_root: usize,
        printed_z1: usize,
        full_rank: usize,
        triple_product_error: f64,
        jacobian_error: f64,
        never_extended: usize,
        never_extended_recovered: usize,
        equal_images: usize,
        equal_images_one_root: usize,
    }
    |own| format!("{} of {} recovered", own.recovered, own.trials)
}

result! {
    /// Proposition 2 on random hinges in two views: counts.
    HingeTrials |_py, found: hoffman_flinchbaugh::HingeTrials| {
        trials: usize,
        recovered: usize,
        full_rank: usize,
        searched: usize,
        one_plane: usize,
        most_planes: usize,
        joint_in_the_middle: usize,
        joint_at_an_end: usize,
    }
    |own| format!("{} of {} recovered", own.recovered, own.trials)
}

result! {
    /// Eqs. (4)-(14) on three views of a rod.
    PrintedRod |_py, found: hoffman_flinchbaugh::PrintedRod| {
        k: [f64; 5],
        roots: Option<[f64; 2]>,
        z3_sq: [f64; 2],
        valid_roots: usize = found.valid_roots(),
        depths: Option<[f64; 3]> = found.depths(),
    }
    |own| format!("k = {:?}", own.k)
}

/// Maximum number of problems; more take hours.
const MOST_TRIALS: usize = 100_000_000;

fn checked(trials: Whole<usize>) -> PyResult<usize> {
    let trials = trials.must_be("trials", &format!("between 0 and {MOST_TRIALS}"))?;
    if trials > MOST_TRIALS {
        return Err(PyValueError::new_err(format!("trials must be at most {MOST_TRIALS}, got {trials}")));
    }
    Ok(trials)
}

/// Proposition 1 on random rods in three views.
#[pyfunction]
pub fn hoffman_flinchbaugh_rods(
    py: Python<'_>,
    trials: Whole<usize>,
    seed: Whole<u64>,
) -> PyResult<RodTrials> {
    let (trials, seed) = (checked(trials)?, seed.must_be("seed", FROM_0)?);
    RodTrials::of(py, interruptible(py, move || rod_trials(trials, seed))?)
}

/// Proposition 2 on random hinges in two views. For the first `searched`, all planes are found by search.
#[pyfunction]
pub fn hoffman_flinchbaugh_hinges(
    py: Python<'_>,
    trials: Whole<usize>,
    searched: Whole<usize>,
    seed: Whole<u64>,
) -> PyResult<HingeTrials> {
    let (trials, seed) = (checked(trials)?, seed.must_be("seed", FROM_0)?);
    let searched = searched.must_be("searched", FROM_0)?;
    HingeTrials::of(py, interruptible(py, move || hinge_trials(trials, searched, seed))?)
}

/// The number of `trials` unrelated pairs in three views, and triples in two, with a planar interpretation.
#[pyfunction]
pub fn hoffman_flinchbaugh_false_targets(
    py: Python<'_>,
    trials: Whole<usize>,
    seed: Whole<u64>,
) -> PyResult<[usize; 2]> {
    let (trials, seed) = (checked(trials)?, seed.must_be("seed", FROM_0)?);
    interruptible(py, move || false_targets(trials, seed))
}

/// The number of `trials` degenerate problems that are refused, by kind.
#[pyfunction]
pub fn hoffman_flinchbaugh_degenerate(
    py: Python<'_>,
    trials: Whole<usize>,
    seed: Whole<u64>,
) -> PyResult<Vec<(&'static str, usize)>> {
    let (trials, seed) = (checked(trials)?, seed.must_be("seed", FROM_0)?);
    let refused = interruptible(py, move || degenerate_refusals(trials, seed))?;
    Ok(DEGENERATE.into_iter().zip(refused).collect())
}

/// Eqs. (4)-(14) on three views (1, 3, 2) from pivot to end.
#[pyfunction]
pub fn hoffman_flinchbaugh_rod(py: Python<'_>, views: &Bound<'_, PyAny>) -> PyResult<PrintedRod> {
    let views = rows_from_numpy(views, 3)?;
    let (problems, _) = views.as_slice()?.as_chunks::<2>().0.as_chunks::<3>();
    let [problem] = problems else {
        return Err(PyValueError::new_err(format!("wanted one rod, got {}", problems.len())));
    };
    PrintedRod::of(py, hoffman_flinchbaugh::PrintedRod::new(&problem.map(DVec2::from_array)))
}
