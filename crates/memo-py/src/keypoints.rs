//! Keypoint detectors: names and orders of their points, and the joints of the stick figure.

use crate::array::{numpy_from_column, numpy_from_track, scores_from_numpy, track_from_numpy};
use crate::error::{value_error, wrong_type};
use crate::whole::{Whole, WholeNumbers};
use glam::DVec2;
use memo_core::keypoints::people::{FollowOptions, follow_everyone as core_follow_everyone};
use memo_core::keypoints::{DetectorError, LAYOUTS, WeightedPoints, joint_name as core_joint_name};
use memo_core::{Detector, Layout};
use numpy::{PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

/// Names of all keypoint layouts.
#[pyfunction]
pub fn keypoint_layouts() -> Vec<&'static str> {
    LAYOUTS.iter().map(|layout| layout.name).collect()
}

/// The name of a layout and its joints in order.
#[pyfunction]
pub fn keypoint_layout(name: &str) -> PyResult<(&'static str, Vec<&'static str>)> {
    let layout = Layout::by_name(name).map_err(value_error)?;
    Ok((layout.name, layout.joints.to_vec()))
}

/// The layout of points (T, K, 2), from their number. If several layouts have this number, the positions of neck
/// and middle of the hips decide.
#[pyfunction]
pub fn guess_layout(points: &Bound<'_, PyAny>) -> PyResult<&'static str> {
    let track = track_from_numpy(points)?;
    Layout::from_points(track.joints, &track.points_px).map(|layout| layout.name).map_err(value_error)
}

/// The standard name of a joint in any known spelling; `None` if the name is unlike all known names. A name that
/// is nearly a known one is an error.
#[pyfunction]
pub fn joint_name(name: &str) -> PyResult<Option<&'static str>> {
    match core_joint_name(name) {
        Ok(known) => Ok(Some(known)),
        Err(DetectorError::UnknownJoint { nearest: None, .. }) => Ok(None),
        Err(misspelt) => Err(value_error(misspelt)),
    }
}

/// A layout's name, or the names of the points.
pub enum LayoutOrNames {
    /// The name of a layout.
    Layout(String),
    /// The names of the points.
    Names(Vec<String>),
}

impl<'py> FromPyObject<'_, 'py> for LayoutOrNames {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(name) = object.extract() {
            return Ok(Self::Layout(name));
        }
        let wanted = "the name of a layout or a list of the names of points";
        object.extract().map(Self::Names).map_err(|_| wrong_type("layout_or_names", wanted, &object))
    }
}

impl LayoutOrNames {
    fn detector(&self) -> PyResult<Detector> {
        match self {
            Self::Layout(name) => Layout::by_name(name).map(Detector::from_layout),
            Self::Names(names) => Detector::from_names(names),
        }
        .map_err(value_error)
    }
}

/// Points (T, N, 2) and weights (T, N).
type PointsAndWeights<'py> = (Bound<'py, PyArray3<f64>>, Bound<'py, PyArray2<f64>>);

/// The 14 joints of the stick figure, neck to left ankle, from points (T, K, 2) and scores (T, K): points (T, 14,
/// 2) and weights (T, 14). NaN and weight 0 if a source point is missing.
#[pyfunction]
pub fn stick_joints<'py>(
    py: Python<'py>,
    layout_or_names: LayoutOrNames,
    points: &Bound<'py, PyAny>,
    scores: &Bound<'py, PyAny>,
) -> PyResult<PointsAndWeights<'py>> {
    collect(py, &layout_or_names, points, scores, Detector::stick_joints)
}

/// The 6 head points neck, nose, right eye, left eye, right ear, left ear; formats as in `stick_joints`.
#[pyfunction]
pub fn head_points<'py>(
    py: Python<'py>,
    layout_or_names: LayoutOrNames,
    points: &Bound<'py, PyAny>,
    scores: &Bound<'py, PyAny>,
) -> PyResult<PointsAndWeights<'py>> {
    collect(py, &layout_or_names, points, scores, Detector::head_points)
}

/// The 4 foot points right big toe, left big toe, right heel, left heel; formats as in `stick_joints`.
#[pyfunction]
pub fn foot_points<'py>(
    py: Python<'py>,
    layout_or_names: LayoutOrNames,
    points: &Bound<'py, PyAny>,
    scores: &Bound<'py, PyAny>,
) -> PyResult<PointsAndWeights<'py>> {
    collect(py, &layout_or_names, points, scores, Detector::foot_points)
}

fn collect<'py, const N: usize>(
    py: Python<'py>,
    layout_or_names: &LayoutOrNames,
    points: &Bound<'py, PyAny>,
    scores: &Bound<'py, PyAny>,
    one_frame: impl Fn(&Detector, &[DVec2], &[f64]) -> Result<WeightedPoints<N>, DetectorError>,
) -> PyResult<PointsAndWeights<'py>> {
    let detector = layout_or_names.detector()?;
    let track = track_from_numpy(points)?;
    let scores = scores_from_numpy(scores, &track)?;
    let mut found = Vec::with_capacity(track.frames);
    for t in 0..track.frames {
        let range = t * track.joints..(t + 1) * track.joints;
        found.push(
            one_frame(&detector, &track.points_px[range.clone()], &scores[range]).map_err(value_error)?,
        );
    }
    let points = found.iter().flat_map(|frame| frame.points_px).collect();
    let weights: Vec<f64> = found.iter().flat_map(|frame| frame.weights).collect();
    let weights = numpy_from_column(py, weights).reshape([track.frames, N])?;
    Ok((numpy_from_track(py, points, N)?, weights))
}

/// Pairs of right and left points: (group "legs", "arms" or "head", part, index of the right, index of the left).
#[pyfunction]
pub fn side_pairs(
    layout_or_names: LayoutOrNames,
) -> PyResult<Vec<(&'static str, &'static str, usize, usize)>> {
    let pairs = layout_or_names.detector()?.side_pairs();
    Ok(pairs.into_iter().map(|pair| (pair.group.name(), pair.part, pair.right, pair.left)).collect())
}

/// The number of the person of each detection, and where two people may be exchanged.
type NumbersAndDoubts = (Vec<Option<usize>>, Vec<(usize, usize, i64, f64)>);

/// Everyone in detections: frames (N,) in order, points (N, K, 2), scores (N, K). Returns the number of each detection's
/// person, the most prominent first, `None` for a second detection; and doubts: two people who may be exchanged, from
/// which frame on, and the probability.
#[pyfunction]
pub fn follow_everyone(
    py: Python<'_>,
    frames: Vec<Whole<i64>>,
    points: &Bound<'_, PyAny>,
    scores: &Bound<'_, PyAny>,
) -> PyResult<NumbersAndDoubts> {
    let frames = frames.must_be("frames", "whole numbers of 64 bits")?;
    let people = track_from_numpy(points)?;
    let scores = scores_from_numpy(scores, &people)?;
    let options = FollowOptions::default();
    let found = py
        .detach(|| core_follow_everyone(&frames, people.joints, &people.points_px, &scores, &options))
        .map_err(value_error)?;
    let doubts = found.doubts.iter().map(|d| (d.people[0], d.people[1], d.frame, d.probability)).collect();
    Ok((found.person, doubts))
}
