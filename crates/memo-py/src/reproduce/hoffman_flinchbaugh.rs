//! Hoffman and Flinchbaugh (1982): the propositions on random problems.

use crate::array::rows_from_numpy;
use crate::wait::interruptible;
use glam::DVec2;
use memo_core::reproduce::hoffman_flinchbaugh::{
    DEGENERATE, PrintedRod, degenerate_refusals, false_targets, hinge_trials, rod_trials,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Maximum number of problems; more take hours.
const MOST_TRIALS: usize = 100_000_000;

fn checked(trials: usize) -> PyResult<usize> {
    if trials > MOST_TRIALS {
        return Err(PyValueError::new_err(format!("trials must be at most {MOST_TRIALS}, got {trials}")));
    }
    Ok(trials)
}

/// Proposition 1 on random rods in three views: counts and largest errors by name.
#[pyfunction]
pub fn hoffman_flinchbaugh_rods<'py>(
    py: Python<'py>,
    trials: usize,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let trials = checked(trials)?;
    let t = interruptible(py, move || rod_trials(trials, seed))?;
    let dict = PyDict::new(py);
    for (name, count) in [
        ("trials", t.trials),
        ("recovered", t.recovered),
        ("recovered_by_ellipse", t.recovered_by_ellipse),
        ("recovered_as_printed", t.recovered_as_printed),
        ("one_root", t.one_root),
        ("printed_z1", t.printed_z1),
        ("full_rank", t.full_rank),
        ("never_extended", t.never_extended),
        ("never_extended_recovered", t.never_extended_recovered),
        ("equal_images", t.equal_images),
        ("equal_images_one_root", t.equal_images_one_root),
    ] {
        dict.set_item(name, count)?;
    }
    dict.set_item("triple_product_error", t.triple_product_error)?;
    dict.set_item("jacobian_error", t.jacobian_error)?;
    Ok(dict)
}

/// Proposition 2 on random hinges in two views: counts by name. For the first `searched`, all planes are found by
/// search.
#[pyfunction]
pub fn hoffman_flinchbaugh_hinges<'py>(
    py: Python<'py>,
    trials: usize,
    searched: usize,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let trials = checked(trials)?;
    let t = interruptible(py, move || hinge_trials(trials, searched, seed))?;
    let dict = PyDict::new(py);
    for (name, count) in [
        ("trials", t.trials),
        ("recovered", t.recovered),
        ("full_rank", t.full_rank),
        ("searched", t.searched),
        ("one_plane", t.one_plane),
        ("most_planes", t.most_planes),
        ("joint_in_the_middle", t.joint_in_the_middle),
        ("joint_at_an_end", t.joint_at_an_end),
    ] {
        dict.set_item(name, count)?;
    }
    Ok(dict)
}

/// The number of `trials` unrelated pairs in three views, and triples in two, with a planar interpretation.
#[pyfunction]
pub fn hoffman_flinchbaugh_false_targets(py: Python<'_>, trials: usize, seed: u64) -> PyResult<[usize; 2]> {
    let trials = checked(trials)?;
    interruptible(py, move || false_targets(trials, seed))
}

/// The number of `trials` degenerate problems that are refused, by kind.
#[pyfunction]
pub fn hoffman_flinchbaugh_degenerate(
    py: Python<'_>,
    trials: usize,
    seed: u64,
) -> PyResult<Vec<(&'static str, usize)>> {
    let trials = checked(trials)?;
    let refused = interruptible(py, move || degenerate_refusals(trials, seed))?;
    Ok(DEGENERATE.into_iter().zip(refused).collect())
}

/// Eqs. (4)-(14) on three views (1, 3, 2) from pivot to end: `k` (5), `roots` (2) or None, `z3_sq` (2),
/// `valid_roots`, `depths` (3) or None.
#[pyfunction]
pub fn hoffman_flinchbaugh_rod<'py>(
    py: Python<'py>,
    views: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let views = rows_from_numpy(views, 3)?;
    let (problems, _) = views.as_slice()?.as_chunks::<2>().0.as_chunks::<3>();
    let [problem] = problems else {
        return Err(PyValueError::new_err(format!("wanted one rod, got {}", problems.len())));
    };
    let printed = PrintedRod::new(&problem.map(DVec2::from_array));
    let dict = PyDict::new(py);
    dict.set_item("k", printed.k)?;
    dict.set_item("roots", printed.roots)?;
    dict.set_item("z3_sq", printed.z3_sq)?;
    dict.set_item("valid_roots", printed.valid_roots())?;
    dict.set_item("depths", printed.depths())?;
    Ok(dict)
}
