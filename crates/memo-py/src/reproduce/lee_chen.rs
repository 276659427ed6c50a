//! Lee and Chen (1985): the tables' inputs and results.

use crate::array::{numpy_from_column, numpy_from_figures, numpy_from_rows};
use crate::error::value_error;
use crate::result::result;
use crate::whole::{Whole, WholeNumbers};
use memo_core::model::JOINT_COUNT;
use memo_core::model::limits::{AngleRange, Limits};
use memo_core::posture::head::{HeadModel, HeadPoint};
use memo_core::reproduce::head_table::{HeadTableColumn, exact_projections, table_2};
use memo_core::reproduce::lee_chen;
use memo_core::reproduce::lee_chen::{Counts, LevelCounts, Reading, Sequence};
use memo_core::reproduce::stick_walker::FRAME_S;
use memo_core::wording::counted;
use memo_core::{Joint, SegmentLengths};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

result! {
    /// Table 3 or 4 on the synthetic walker, and as printed: numbers of nodes of shape (14 levels, 3 frames), `physical`
    /// and `rules_1_2`. `truth_kept` (3 frames, 2): whether the true posture is left, in the same order.
    CountTable |py, found: lee_chen::CountTable, as_printed: &Counts| {
        phases: [f64; 3],
        counts: Py<PyDict> = named(py, &found.counts)?,
        printed: Py<PyDict> = named(py, as_printed)?,
        truth_kept: [[bool; 2]; 3],
    }
    |own| format!("phases {:?}", own.phases)
}

result! {
    /// Result of rules 1 to 5 and grouping at one phase; `broken` names the constraints that the true posture breaks.
    LastStage |_py, found: lee_chen::LastStage| {
        phase: f64,
        postures: usize,
        groups: usize,
        truth_kept: bool,
        broken: Vec<String> = found.broken.iter().map(|constraint| constraint.name()).collect::<Vec<_>>(),
    }
    |own| format!("phase {:.3}, {}", own.phase, counted(own.postures, "posture"))
}

result! {
    /// The postures of a frame that satisfy the physical constraints and rules 1 and 2: `figures` (N, 14, 3) and
    /// `truth` (14, 3) in camera axes, metres; `groups` of figures within 5 cm, each with its representative and
    /// members; `passes`, whether a figure satisfies rules 3 to 5 too; `true_one`, the index of the figure with the
    /// true roots.
    FrameSurvivors |py, found: lee_chen::FrameSurvivors| {
        figures: Py<PyArray3<f64>> = numpy_from_figures(py, &found.figures)?,
        truth: Py<PyArray2<f64>> = numpy_from_figures(py, &[found.truth])?.reshape([JOINT_COUNT, 3])?,
        groups: Vec<(usize, Vec<usize>)> =
            found.groups.into_iter().map(|group| (group.representative, group.members)).collect::<Vec<_>>(),
        true_one: Option<usize>,
        passes: Vec<bool>,
    }
    |own| format!("{} in {}", counted(own.passes.len(), "figure"), counted(own.groups.len(), "group"))
}

result! {
    /// Table 2 by a method: `transform` (4, 3), `rotation` (3, 3); centimetres, the paper's axes.
    HeadColumn |py, found: HeadTableColumn| {
        method: String,
        transform: Py<PyArray2<f64>> =
            numpy_from_rows(py, (0..4).map(|row| found.transform.map(|c| c[row])).collect())?,
        rotation: Py<PyArray2<f64>> =
            numpy_from_rows(py, found.rotation.transpose().to_cols_array_2d().to_vec())?,
        focal: f64,
        camera_position: [f64; 3],
        camera_position_sd: Option<[f64; 3]> = found.camera_position_sd.map(|sd| sd.to_array()),
        points: Py<PyDict> = {
            let points = found.points.map(|point| point.to_array());
            HeadPoint::ALL.map(HeadPoint::name).into_iter().zip(points).into_py_dict(py)?
        },
    }
    |own| own.method.clone()
}

result! {
    /// Inputs of the tables, as used by the code: `angles`, names with (least, largest) in degrees (Table 1);
    /// `lengths_cm`, names with lengths (A.1); `head_cm` (6, 3) and `projections_cm` (6, 2) of the head points seen
    /// from (400, 0, 0) with f = 5 (A.2); `frame_s`; `cameras_cm`, image planes of SEQ1 and SEQ2.
    TableInputs |py, limits: Limits| {
        angles: Vec<(String, (f64, f64))> = angles(&limits),
        lengths_cm: Vec<(String, f64)> =
            SegmentLengths::lee_chen().named().map(|(name, m)| (name, 100.0 * m)).collect::<Vec<_>>(),
        head_cm: Py<PyArray2<f64>> =
            numpy_from_rows(py, HeadModel::lee_chen().points_m.map(|m| (100.0 * m).to_array()).to_vec())?,
        projections_cm: Py<PyArray2<f64>> =
            numpy_from_rows(py, exact_projections().map(|point| point.to_array()).to_vec())?,
        frame_s: f64 = FRAME_S,
        cameras_cm: [[f64; 3]; 2] = Sequence::ALL.map(plane_cm),
    }
    |own| format!("{}, {}", counted(own.angles.len(), "angle"), counted(own.lengths_cm.len(), "length"))
}

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

/// Table 3 (SEQ1) or 4 (SEQ2).
#[pyfunction]
#[pyo3(signature = (sequence, merge_m=lee_chen::MERGE_M))]
pub fn lee_chen_counts(py: Python<'_>, sequence: &str, merge_m: f64) -> PyResult<CountTable> {
    let sequence = sequence_of(sequence)?;
    let table = py
        .detach(|| lee_chen::count_table(sequence, &lee_chen::table_walker(), merge_m))
        .map_err(value_error)?;
    CountTable::of(py, table, sequence.printed())
}

fn named<'py>(py: Python<'py>, counts: &Counts) -> PyResult<Bound<'py, PyDict>> {
    let array = |levels: &LevelCounts| numpy_from_rows(py, levels.to_vec());
    [("physical", array(&counts.physical)?), ("rules_1_2", array(&counts.rules_1_2)?)].into_py_dict(py)
}

/// Results of rules 1 to 5 and grouping, over ten phases and three frames. `reading` is "as_printed" or
/// "rigid_torso".
#[pyfunction]
#[pyo3(signature = (sequence, reading, merge_m=lee_chen::MERGE_M))]
pub fn lee_chen_last_stage(
    py: Python<'_>,
    sequence: &str,
    reading: &str,
    merge_m: f64,
) -> PyResult<Vec<LastStage>> {
    let sequence = sequence_of(sequence)?;
    let reading = Reading::from_name(reading).ok_or_else(|| {
        PyValueError::new_err(format!("reading must be as_printed or rigid_torso, got {reading}"))
    })?;
    let phases = lee_chen::LAST_STAGE_PHASES;
    let stages =
        py.detach(|| lee_chen::last_stage(sequence, reading, &phases, merge_m)).map_err(value_error)?;
    stages.into_iter().map(|stage| LastStage::of(py, stage)).collect()
}

/// The postures left in frame 1.
#[pyfunction]
pub fn lee_chen_figures(py: Python<'_>, sequence: &str) -> PyResult<FrameSurvivors> {
    let sequence = sequence_of(sequence)?;
    let left = py
        .detach(|| lee_chen::frame_survivors(sequence, &lee_chen::table_walker(), 0))
        .map_err(value_error)?;
    FrameSurvivors::of(py, left)
}

/// Table 2 by each method.
#[pyfunction]
pub fn lee_chen_head(py: Python<'_>) -> PyResult<Vec<HeadColumn>> {
    let table = py.detach(table_2).map_err(value_error)?;
    let columns = [table.printed, table.linear, table.linear_exact, table.focal_free, table.focal_known];
    columns.into_iter().map(|column| HeadColumn::of(py, column)).collect()
}

/// Inputs of the tables.
#[pyfunction]
pub fn lee_chen_inputs(py: Python<'_>) -> PyResult<TableInputs> {
    TableInputs::of(py, Limits::paper())
}

fn angles(l: &Limits) -> Vec<(String, (f64, f64))> {
    let range = |r: AngleRange| (r.min_rad.to_degrees(), r.max_rad.to_degrees());
    let either = |rad: f64| (-rad.to_degrees(), rad.to_degrees());
    let straight = (l.hip_swing.min_rad.to_degrees(), l.hip_flexion_straight_rad.to_degrees());
    let named = [
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
    named.map(|(name, range)| (name.to_owned(), range)).to_vec()
}

/// The image plane of a sequence: the lens is f behind it, and the paper calls its position the camera's.
fn plane_cm(sequence: Sequence) -> [f64; 3] {
    let lens = sequence.camera().lens_in_head;
    (100.0 * (lens - 0.05 * lens.normalize_or_zero())).to_array()
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
    frames: Whole<usize>,
) -> PyResult<(Bound<'py, PyArray3<f64>>, Bound<'py, PyArray1<f64>>)> {
    let frames = frames.must_be("frames", &format!("between 0 and {MOST_FRAMES}"))?;
    if frames > MOST_FRAMES {
        return Err(PyValueError::new_err(format!("frames must be at most {MOST_FRAMES}, got {frames}")));
    }
    let (camera, walker) = (sequence_of(sequence)?.camera(), lee_chen::table_walker());
    let figures: Vec<_> = (0..frames).map(|frame| camera.view(&walker, frame).figure).collect();
    let phases = (0..frames).map(|frame| walker.phase(frame)).collect();
    Ok((numpy_from_figures(py, &figures)?, numpy_from_column(py, phases)))
}
