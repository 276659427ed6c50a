//! Lee and Chen (1985): the tables' inputs and results.

use crate::array::{numpy_from_column, numpy_from_figures, numpy_from_rows};
use crate::error::value_error;
use memo_core::model::limits::{AngleRange, Limits};
use memo_core::model::skeleton::{JOINT_COUNT, Joint, SegmentLengths};
use memo_core::posture::head::{HeadModel, HeadPoint};
use memo_core::reproduce::head_table::{HeadTableColumn, exact_projections, table_2};
use memo_core::reproduce::lee_chen;
use memo_core::reproduce::lee_chen::{Counts, LevelCounts, Reading, Sequence};
use memo_core::reproduce::stick_walker::FRAME_S;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
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

/// Table 3 (SEQ1) or 4 (SEQ2) on the synthetic walker, beside the printed one: `phases`; `physical`, `rules_1_2`,
/// `printed_physical` and `printed_rules_1_2`, numbers of nodes of shape (14 levels, 3 frames); `truth_kept` (3
/// frames, 2).
#[pyfunction]
#[pyo3(signature = (sequence, merge_m=lee_chen::MERGE_M))]
pub fn lee_chen_counts<'py>(py: Python<'py>, sequence: &str, merge_m: f64) -> PyResult<Bound<'py, PyDict>> {
    let sequence = sequence_of(sequence)?;
    let table = py
        .detach(|| lee_chen::count_table(sequence, &lee_chen::table_walker(), merge_m))
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

/// Results of rules 1 to 5 and grouping, over ten phases and three frames: a list of dicts with `phase`,
/// `postures`, `groups`, `truth_kept` and `broken`, the names of the constraints that the true posture breaks.
///
/// `reading` is "as_printed" or "rigid_torso".
#[pyfunction]
#[pyo3(signature = (sequence, reading, merge_m=lee_chen::MERGE_M))]
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
    let phases = lee_chen::LAST_STAGE_PHASES;
    let stages =
        py.detach(|| lee_chen::last_stage(sequence, reading, &phases, merge_m)).map_err(value_error)?;
    let dict_of = |stage: lee_chen::LastStage| {
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

/// The postures of frame 1 that satisfy the physical constraints and rules 1 and 2: `figures` (N, 14, 3) and
/// `truth` (14, 3) in camera axes, metres; `groups` of figures within 5 cm, each with its representative and
/// members; `passes`, whether a figure satisfies rules 3 to 5 too; `true_one`, the index of the figure with the
/// true roots.
#[pyfunction]
pub fn lee_chen_figures<'py>(py: Python<'py>, sequence: &str) -> PyResult<Bound<'py, PyDict>> {
    let sequence = sequence_of(sequence)?;
    let left = py
        .detach(|| lee_chen::frame_survivors(sequence, &lee_chen::table_walker(), 0))
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

/// Inputs of the tables, as used by the code: `angles`, names with (least, largest) in degrees (Table 1);
/// `lengths_cm`, names with lengths (A.1); `head_cm` (6, 3) and `projections_cm` (6, 2) of the head points seen
/// from (400, 0, 0) with f = 5 (A.2); `frame_s`; `cameras_cm`, image planes of SEQ1 and SEQ2.
#[pyfunction]
pub fn lee_chen_inputs(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let l = Limits::paper();
    let range = |r: AngleRange| (r.min_rad.to_degrees(), r.max_rad.to_degrees());
    let either = |rad: f64| (-rad.to_degrees(), rad.to_degrees());
    let straight = (l.hip_swing.min_rad.to_degrees(), l.hip_flexion_straight_rad.to_degrees());
    let angles = [
        ("shoulder swing", range(l.shoulder_swing)),
        ("shoulder abduction", range(l.shoulder_abduction)),
        ("hip swing, straight knee", straight),
        ("hip swing", range(l.hip_swing)),
        ("hip abduction", range(l.hip_abduction)),
        ("elbow", range(l.elbow)),
        ("knee", range(l.knee)),
        ("pelvis flexion", range(l.pelvis_flexion)),
        ("pelvis rotation", either(l.pelvis_rotation_rad)),
        ("pelvis bending", either(l.pelvis_bending_rad)),
        ("neck flexion", range(l.neck_flexion)),
        ("neck rotation", either(l.neck_rotation_rad)),
        ("neck bending", either(l.neck_bending_rad)),
    ];
    let dict = PyDict::new(py);
    dict.set_item("angles", angles.to_vec())?;
    let lengths = SegmentLengths::lee_chen();
    let lengths: Vec<(String, f64)> = lengths.named().map(|(name, length)| (name, 100.0 * length)).collect();
    dict.set_item("lengths_cm", lengths)?;
    let head = HeadModel::lee_chen().points_m.map(|point| (100.0 * point).to_array());
    dict.set_item("head_cm", numpy_from_rows(py, head.to_vec())?)?;
    let projections = exact_projections().map(|point| point.to_array());
    dict.set_item("projections_cm", numpy_from_rows(py, projections.to_vec())?)?;
    dict.set_item("frame_s", FRAME_S)?;
    // The lens is f behind the image plane, whose position the paper calls the camera's.
    let plane = |sequence: Sequence| {
        let lens = sequence.camera().lens_in_head;
        (100.0 * (lens - 0.05 * lens.normalize_or_zero())).to_array()
    };
    dict.set_item("cameras_cm", Sequence::ALL.map(plane))?;
    Ok(dict)
}

/// Maximum number of frames; more do not fit in the memory of most machines.
const MOST_FRAMES: usize = 1_000_000;

/// The synthetic walker in frames of a sequence, counted from 0: joints (frames, 14, 3) in camera axes, metres,
/// and the gait phase of each frame.
#[pyfunction]
#[allow(clippy::type_complexity, reason = "a plain tuple crosses the border best")]
pub fn lee_chen_walker<'py>(
    py: Python<'py>,
    sequence: &str,
    frames: usize,
) -> PyResult<(Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<f64>>)> {
    if frames > MOST_FRAMES {
        return Err(PyValueError::new_err(format!("frames must be at most {MOST_FRAMES}, got {frames}")));
    }
    let (camera, walker) = (sequence_of(sequence)?.camera(), lee_chen::table_walker());
    let figures: Vec<_> = (0..frames).map(|frame| camera.view(&walker, frame).figure).collect();
    let phases = (0..frames).map(|frame| walker.phase(frame)).collect();
    Ok((numpy_from_figures(py, &figures)?, numpy_from_column(py, phases)))
}
