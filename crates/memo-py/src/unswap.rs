//! Correction of swapped left and right labels.

use crate::array::{numpy_from_column, scores_from_numpy, times_from_numpy, track_from_numpy};
use crate::error::value_error;
use crate::wait::interruptible;
use memo_core::keypoints::unswap::{
    GroupResult, Keypoints, Level, LimbGroup, UnswapOptions, Unswapped, unswap as core_unswap,
};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Corrects swaps of left and right in joints over time: times (T,) s, points (T, K, 2) px with NaN if missing,
/// scores (T, K) in [0, 1] or None, groups {limb: {level: [(left, right), ...]}} from the trunk outwards.
/// Returns, per limb, arrays over frames and `p_global`, the probability that most labels are right.
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
    dict_from_unswapped(py, found, &groups)
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

fn dict_from_unswapped<'py>(
    py: Python<'py>,
    found: Unswapped,
    groups: &[LimbGroup],
) -> PyResult<Bound<'py, PyDict>> {
    let of_groups = PyDict::new(py);
    for (group, found) in groups.iter().zip(&found.groups) {
        of_groups.set_item(&group.name, dict_from_group(py, group, found)?)?;
    }
    Ok(of_groups)
}

fn dict_from_group<'py>(
    py: Python<'py>,
    group: &LimbGroup,
    found: &GroupResult,
) -> PyResult<Bound<'py, PyDict>> {
    let verdicts = &found.verdicts;
    let shape = [verdicts.len(), group.levels.len()];
    let result = PyDict::new(py);
    result.set_item("decided", numpy_from_column(py, verdicts.iter().map(|v| v.decided).collect()))?;
    let probability = verdicts.iter().map(|v| v.probability).collect();
    result.set_item("p_flipped", numpy_from_column(py, probability))?;
    let reasons: Vec<String> = verdicts.iter().map(|v| v.describe(group)).collect();
    result.set_item("reason", reasons)?;
    let levels: Vec<&str> = group.levels.iter().map(|level| level.name.as_str()).collect();
    result.set_item("levels", levels)?;
    let flipped: Vec<bool> = verdicts.iter().flat_map(|v| v.level_flipped.iter().copied()).collect();
    result.set_item("level_flipped", flipped.into_pyarray(py).reshape(shape)?)?;
    let p: Vec<f64> = verdicts.iter().flat_map(|v| v.level_probability.iter().copied()).collect();
    result.set_item("level_p_flipped", p.into_pyarray(py).reshape(shape)?)?;
    result.set_item("p_global", found.global_probability)?;
    Ok(result)
}
