//! The papers' experiments.

use crate::array::numpy_from_figures;
use crate::error::value_error;
use memo_core::posture::experiment::{self, Counts, LevelCounts, Reading, Sequence};
use memo_core::posture::head::{HeadPoint, HeadTableColumn, table_2};
use memo_core::posture::skeleton::{JOINT_COUNT, Joint, SegmentLengths};
use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

fn sequence_of(name: &str) -> PyResult<Sequence> {
    Sequence::from_name(name)
        .ok_or_else(|| PyValueError::new_err(format!("sequence must be SEQ1 or SEQ2, got {name}")))
}

/// Names of the joints in the order of the levels of the tree.
#[pyfunction]
pub fn joint_names() -> Vec<&'static str> {
    Joint::ALL.map(Joint::name).to_vec()
}

/// Names of the 17 segment lengths, such as `right_hip_to_right_knee`.
#[pyfunction]
pub fn segment_names() -> Vec<String> {
    SegmentLengths::lee_chen().named().map(|(name, _)| name).collect()
}

/// Table 3 (SEQ1) or 4 (SEQ2) on the walker made anew, beside the printed one: `phases`, and for each of
/// `physical`, `rules_1_2`, `printed_physical` and `printed_rules_1_2` nodes of shape (14 levels, 3 frames);
/// `truth_kept` (3 frames, 2).
#[pyfunction]
#[pyo3(signature = (sequence, merge_m=experiment::MERGE_M))]
pub fn lee_chen_counts<'py>(py: Python<'py>, sequence: &str, merge_m: f64) -> PyResult<Bound<'py, PyDict>> {
    let sequence = sequence_of(sequence)?;
    let table = py
        .detach(|| experiment::count_table(sequence, &experiment::table_walker(), merge_m))
        .map_err(value_error)?;
    let dict = PyDict::new(py);
    dict.set_item("phases", table.phases)?;
    set_counts(&dict, "", &table.counts)?;
    set_counts(&dict, "printed_", sequence.printed())?;
    dict.set_item("truth_kept", table.truth_kept.map(Vec::from).to_vec())?;
    Ok(dict)
}

fn set_counts(dict: &Bound<'_, PyDict>, prefix: &str, counts: &Counts) -> PyResult<()> {
    let array = |levels: &LevelCounts| -> PyResult<Bound<'_, PyArray2<u32>>> {
        levels.concat().into_pyarray(dict.py()).reshape([JOINT_COUNT, 3])
    };
    dict.set_item(format!("{prefix}physical"), array(&counts.physical)?)?;
    dict.set_item(format!("{prefix}rules_1_2"), array(&counts.rules_1_2)?)
}

/// What rules 1 to 5 and grouping leave, over ten phases and three frames: a list of dicts with `phase`,
/// `postures`, `groups`, `truth_kept` and `broken`, names of the constraints that the true posture breaks.
///
/// `reading` is "as_printed" or "rigid_torso".
#[pyfunction]
#[pyo3(signature = (sequence, reading, merge_m=experiment::MERGE_M))]
pub fn lee_chen_last_stage<'py>(
    py: Python<'py>,
    sequence: &str,
    reading: &str,
    merge_m: f64,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let sequence = sequence_of(sequence)?;
    let reading = Reading::from_name(reading).ok_or_else(|| {
        PyValueError::new_err(format!("reading must be as_printed or rigid_torso, got {reading}"))
    })?;
    let phases = experiment::LAST_STAGE_PHASES;
    let stages =
        py.detach(|| experiment::last_stage(sequence, reading, &phases, merge_m)).map_err(value_error)?;
    let dict_of = |stage: experiment::LastStage| {
        let dict = PyDict::new(py);
        dict.set_item("phase", stage.phase)?;
        dict.set_item("postures", stage.postures)?;
        dict.set_item("groups", stage.groups)?;
        dict.set_item("truth_kept", stage.truth_kept)?;
        let broken: Vec<String> = stage.broken.into_iter().map(|constraint| constraint.name()).collect();
        dict.set_item("broken", broken)?;
        Ok(dict)
    };
    stages.into_iter().map(dict_of).collect()
}

/// The postures of frame 1 that physical constraints and rules 1 and 2 leave: `figures` (N, 14, 3) and
/// `truth` (14, 3) in camera axes, metres; `groups` of figures within 5 cm, each its representative and
/// members; `passes`, whether a figure passes rules 3 to 5 too; `true_one`, which takes the true roots.
#[pyfunction]
pub fn lee_chen_figures<'py>(py: Python<'py>, sequence: &str) -> PyResult<Bound<'py, PyDict>> {
    let sequence = sequence_of(sequence)?;
    let left = py
        .detach(|| experiment::frame_survivors(sequence, &experiment::table_walker(), 0))
        .map_err(value_error)?;
    let dict = PyDict::new(py);
    dict.set_item("figures", numpy_from_figures(py, &left.figures)?)?;
    dict.set_item("truth", numpy_from_figures(py, &[left.truth])?.reshape([JOINT_COUNT, 3])?)?;
    let groups: Vec<(usize, Vec<usize>)> =
        left.groups.into_iter().map(|group| (group.representative, group.members)).collect();
    dict.set_item("groups", groups)?;
    dict.set_item("true_one", left.true_one)?;
    dict.set_item("passes", left.passes)?;
    Ok(dict)
}

/// Table 2 by each method: a list of dicts with `method`, `transform` (4, 3), `rotation` (3, 3), `focal`,
/// `camera_position`, `camera_position_sd` or None, and `points` by name; centimetres, the paper's axes.
#[pyfunction]
pub fn lee_chen_head(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let table = py.detach(table_2).map_err(value_error)?;
    let columns = [table.printed, table.linear, table.linear_exact, table.focal_free, table.focal_known];
    let dict_of = |column: HeadTableColumn| {
        let dict = PyDict::new(py);
        dict.set_item("method", column.method)?;
        let transform: Vec<f64> = (0..4).flat_map(|row| column.transform.map(|c| c[row])).collect();
        dict.set_item("transform", transform.into_pyarray(py).reshape([4, 3])?)?;
        let rotation = column.rotation.transpose().to_cols_array().to_vec();
        dict.set_item("rotation", rotation.into_pyarray(py).reshape([3, 3])?)?;
        dict.set_item("focal", column.focal)?;
        dict.set_item("camera_position", column.camera_position.to_array())?;
        dict.set_item("camera_position_sd", column.camera_position_sd.map(|sd| sd.to_array()))?;
        let points = PyDict::new(py);
        for (name, point) in HeadPoint::ALL.map(HeadPoint::name).into_iter().zip(column.points) {
            points.set_item(name, point.to_array())?;
        }
        dict.set_item("points", points)?;
        Ok(dict)
    };
    columns.into_iter().map(dict_of).collect()
}
