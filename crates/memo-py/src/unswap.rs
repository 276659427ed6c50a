//! Correction of swapped left and right labels.

use crate::array::{numpy_from_column, scores_from_numpy, times_from_numpy, track_from_numpy};
use crate::error::value_error;
use crate::result::result;
use crate::wait::interruptible;
use memo_core::keypoints::{GroupResult, Keypoints, Level, LimbGroup};
use memo_core::wording::counted;
use memo_core::{UnswapOptions, unswap as core_unswap};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use std::sync::Arc;

result! {
    /// Right and left of a limb over T frames, at L levels from the trunk outwards.
    LimbSides |py, group: &LimbGroup, found: &GroupResult| {
        /// Names of the levels.
        levels: Vec<String> = group.levels.iter().map(|level| level.name.clone()).collect::<Vec<_>>(),
        /// Whether the labels are decided, (T,).
        decided: Py<PyArray1<bool>> =
            numpy_from_column(py, found.verdicts.iter().map(|v| v.decided).collect()),
        /// Probability that the labels are exchanged, (T,).
        p_flipped: Py<PyArray1<f64>> =
            numpy_from_column(py, found.verdicts.iter().map(|v| v.probability).collect()),
        /// Why, in words, (T,).
        reason: Vec<String> = found.verdicts.iter().map(|v| v.describe(group)).collect::<Vec<_>>(),
        /// Whether the labels of each level are exchanged, (T, L).
        level_flipped: Py<PyArray2<bool>> = {
            let flipped: Vec<bool> = found.verdicts.iter().flat_map(|v| v.level_flipped.clone()).collect();
            flipped.into_pyarray(py).reshape([found.verdicts.len(), group.levels.len()])?
        },
        /// Whether these labels are decided, (T, L).
        level_decided: Py<PyArray2<bool>> = {
            let decided: Vec<bool> = found.verdicts.iter().flat_map(|v| v.level_decided.clone()).collect();
            decided.into_pyarray(py).reshape([found.verdicts.len(), group.levels.len()])?
        },
        /// Probability that they are exchanged, (T, L).
        level_p_flipped: Py<PyArray2<f64>> = {
            let p: Vec<f64> = found.verdicts.iter().flat_map(|v| v.level_probability.clone()).collect();
            p.into_pyarray(py).reshape([found.verdicts.len(), group.levels.len()])?
        },
        /// Probability that most labels are right.
        p_global: f64 = found.global_probability,
    }
    |own| format!("{}, {}", own.levels.join(", "), counted(own.reason.len(), "frame"))
}

/// Corrects swaps of left and right in joints over time: times (T,) s, points (T, K, 2) px with NaN if missing,
/// scores (T, K) in [0, 1] or None, groups {limb: {level: [(left, right), ...]}} from the trunk outwards.
#[pyfunction]
#[pyo3(signature = (
    times_s, points, scores=None, *, groups, as_is_nats=None, partial_begin_nats=None,
    partial_stay_nats=None, decided_at=None
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn unswap<'py>(
    py: Python<'py>,
    times_s: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    scores: Option<&Bound<'py, PyAny>>,
    groups: &Bound<'py, PyDict>,
    as_is_nats: Option<f64>,
    partial_begin_nats: Option<f64>,
    partial_stay_nats: Option<f64>,
    decided_at: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let times_s = times_from_numpy(times_s)?;
    let track = track_from_numpy(points)?;
    let points_px: Vec<[f64; 2]> = track.points_px.iter().map(|point| point.to_array()).collect();
    let scores = scores.map(|scores| scores_from_numpy(scores, &track)).transpose()?;
    let groups = groups_from_dict(groups)?;
    let default = UnswapOptions::default();
    let options = UnswapOptions {
        as_is_nats: as_is_nats.unwrap_or(default.as_is_nats),
        partial_begin_nats: partial_begin_nats.unwrap_or(default.partial_begin_nats),
        partial_stay_nats: partial_stay_nats.unwrap_or(default.partial_stay_nats),
        decided_at: decided_at.unwrap_or(default.decided_at),
    };
    let groups = Arc::new(groups);
    let of_worker = Arc::clone(&groups);
    let repair = move || {
        let keypoints = Keypoints {
            times_s: &times_s,
            joints: track.joints,
            points_px: &points_px,
            scores: scores.as_deref(),
        };
        core_unswap(&keypoints, &of_worker, &options)
    };
    let found = interruptible(py, repair)?.map_err(value_error)?;
    let limbs = groups.iter().zip(&found.groups);
    let limbs: PyResult<Vec<_>> =
        limbs.map(|(group, found)| Ok((&group.name, LimbSides::of(py, group, found)?))).collect();
    limbs?.into_py_dict(py)
}

/// Limbs in the given order.
fn groups_from_dict(groups: &Bound<'_, PyDict>) -> PyResult<Vec<LimbGroup>> {
    let wanted = "wanted groups as {limb: {level: [(left, right), ...]}}";
    let bad = |got: &Bound<'_, PyAny>| {
        pyo3::exceptions::PyValueError::new_err(format!("{wanted}; got {got} in its place"))
    };
    let level = |(name, pairs): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let pairs = pairs.extract::<Vec<[usize; 2]>>().map_err(|_| bad(&pairs))?;
        Ok(Level { name: name.extract().map_err(|_| bad(&name))?, pairs })
    };
    let group = |(name, levels): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let levels = levels.cast::<PyDict>().map_err(|_| bad(&levels))?;
        let levels = levels.iter().map(level).collect::<PyResult<_>>()?;
        Ok(LimbGroup { name: name.extract().map_err(|_| bad(&name))?, levels })
    };
    groups.iter().map(group).collect()
}
