//! Postures of a sequence of keypoints.

use crate::array::{
    head_points_from_numpy, numpy_from_column, numpy_from_figures, numpy_from_rows, points_from_numpy,
    scores_from_numpy, times_from_numpy, track_from_numpy,
};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::wait::watched;
use glam::{DVec2, DVec3};
use memo_core::model::skeleton::{JOINT_COUNT, Joint, PerJoint, SegmentLengths, StickFigure};
use memo_core::posture::anchor::AnchorSource;
use memo_core::posture::lift::JointRays;
use memo_core::posture::sequence::{
    AnchorChoice, DEFAULT_DISTANCE_SD_M, FrameReading, KeypointSequence, Motion, PostureSequence,
    SequenceLengths, SequenceOptions, Strength, postures_with_progress, reason_totals,
};
use memo_core::posture::tree::{LevelCount, View};
use memo_core::progress::Progress;
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;

/// One distance for all frames, or one per frame.
#[derive(FromPyObject)]
pub enum Distances {
    /// The same for all frames.
    One(f64),
    /// One per frame.
    Each(Vec<f64>),
}

/// Postures of one person: times (T,) s, points (T, 14, 2) px of the stick figure's joints with NaN if missing,
/// weights (T, 14). Results in world axes, metres, Z up. `progress` is called with the work done and the work in
/// all.
#[pyfunction]
#[pyo3(signature = (
    times_s, points, weights, camera, *, lengths=None, height_m=None, noise_px=2.0, rules="walking",
    strength="measured", anchor="auto", distance_m=None, distance_sd_m=None, moving_direction=None,
    head_points=None, group_m=0.10, max_groups=64, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn posture<'py>(
    py: Python<'py>,
    times_s: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
    weights: &Bound<'py, PyAny>,
    camera: &PyCamera,
    lengths: Option<HashMap<String, f64>>,
    height_m: Option<f64>,
    noise_px: f64,
    rules: &str,
    strength: &str,
    anchor: &str,
    distance_m: Option<Distances>,
    distance_sd_m: Option<f64>,
    moving_direction: Option<[f64; 3]>,
    head_points: Option<&Bound<'py, PyAny>>,
    group_m: f64,
    max_groups: usize,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let times_s = times_from_numpy(times_s)?;
    let track = track_from_numpy(points)?;
    if track.joints != JOINT_COUNT {
        let got = [track.frames, track.joints, 2];
        return Err(PyValueError::new_err(format!("wanted points of shape (T, 14, 2); got {got:?}")));
    }
    let weights = per_joint(&scores_from_numpy(weights, &track)?);
    let points_px: Vec<PerJoint<DVec2>> = per_joint(&track.points_px);
    let head_points_px = head_points.map(head_points_from_numpy).transpose()?;
    let options = SequenceOptions {
        lengths: lengths.map(lengths_from_names).transpose()?,
        height_m,
        noise_px,
        motion: named("rules", rules, Motion::from_name, &Motion::ALL.map(Motion::name))?,
        strength: named("strength", strength, Strength::from_name, &["measured", "paper"])?,
        anchor: anchor_choice(anchor, distance_m, distance_sd_m)?,
        moving_direction: moving_direction.map(DVec3::from),
        group_m,
        max_groups,
        ..SequenceOptions::default()
    };
    let camera = camera.0.clone();
    let interpret = move |progress: &Progress| {
        let sequence = KeypointSequence {
            times_s: &times_s,
            points_px: &points_px,
            weights: &weights,
            head_points_px: head_points_px.as_deref(),
        };
        postures_with_progress(&sequence, &camera, &options, progress)
    };
    let found = watched(py, progress, interpret)?.map_err(value_error)?;
    dict_from_postures(py, found)
}

/// All postures that one view allows. `rays` (14, 3) are unit vectors in camera axes with NaN for joints that are
/// not seen; the neck's position (3,) is in metres. Returns the surviving postures (N, 14, 3), camera axes,
/// metres, in depth-first order. Upward and forward directions are those of the trunk.
#[pyfunction]
#[pyo3(signature = (rays, neck, lengths, *, rules="physical", strength="measured", noise_rad=0.0))]
pub fn posture_tree<'py>(
    py: Python<'py>,
    rays: &Bound<'py, PyAny>,
    neck: [f64; 3],
    lengths: HashMap<String, f64>,
    rules: &str,
    strength: &str,
    noise_rad: f64,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let rays = points_from_numpy(rays)?;
    let Ok(ray) = <[[f64; 3]; JOINT_COUNT]>::try_from(rays.as_slice()) else {
        return Err(PyValueError::new_err(format!("wanted rays of shape (14, 3); got ({}, 3)", rays.len())));
    };
    let rays =
        JointRays { ray: PerJoint(ray.map(DVec3::from)), weight: PerJoint([1.0; JOINT_COUNT]), noise_rad };
    let motion = named("rules", rules, Motion::from_name, &Motion::ALL.map(Motion::name))?;
    let strength = named("strength", strength, Strength::from_name, &["measured", "paper"])?;
    let view = View::new(rays, DVec3::from(neck), lengths_from_names(lengths)?);
    let interpret = || view.interpret(&motion.tree(strength)).map(|found| found.figures());
    numpy_from_figures(py, &py.detach(interpret).map_err(value_error)?)
}

fn per_joint<T: Copy>(flat: &[T]) -> Vec<PerJoint<T>> {
    flat.chunks_exact(JOINT_COUNT).map(|row| PerJoint(std::array::from_fn(|j| row[j]))).collect()
}

fn named<T>(what: &str, name: &str, of: impl Fn(&str) -> Option<T>, all: &[&str]) -> PyResult<T> {
    of(name).ok_or_else(|| PyValueError::new_err(format!("wanted {what} as one of {all:?}; got {name:?}")))
}

/// All 17 lengths from their names.
fn lengths_from_names(named: HashMap<String, f64>) -> PyResult<SegmentLengths> {
    let mut lengths = SegmentLengths::lee_chen();
    let names: Vec<String> = lengths.named().map(|(name, _)| name).collect();
    let missing: Vec<&String> = names.iter().filter(|name| !named.contains_key(*name)).collect();
    let unknown: Vec<&String> = named.keys().filter(|name| !names.contains(name)).collect();
    if !(missing.is_empty() && unknown.is_empty()) {
        return Err(PyValueError::new_err(format!(
            "wanted lengths of {names:?}; missing {missing:?}, unknown {unknown:?}"
        )));
    }
    for (name, length_m) in named {
        lengths.set(&name, length_m);
    }
    Ok(lengths)
}

fn anchor_choice(name: &str, distance_m: Option<Distances>, sd_m: Option<f64>) -> PyResult<AnchorChoice> {
    let of_source = |name: &str| match name {
        "auto" => Some(AnchorChoice::Auto),
        "given" => Some(AnchorChoice::Given { distance_m: Vec::new(), sd_m: DEFAULT_DISTANCE_SD_M }),
        _ => AnchorSource::from_name(name).map(AnchorChoice::Source),
    };
    let names = ["auto", "ground", "trunk", "extent", "head", "combined", "given"];
    let choice = named("anchor", name, of_source, &names)?;
    if let (None, Some(sd_m)) = (&distance_m, sd_m) {
        return Err(PyValueError::new_err(format!("distance_sd_m goes with distance_m; got {sd_m} alone")));
    }
    match (choice, distance_m) {
        (AnchorChoice::Given { .. } | AnchorChoice::Auto, Some(distances)) => Ok(AnchorChoice::Given {
            distance_m: match distances {
                Distances::One(distance_m) => vec![distance_m],
                Distances::Each(distances_m) => distances_m,
            },
            sd_m: sd_m.unwrap_or(DEFAULT_DISTANCE_SD_M),
        }),
        (AnchorChoice::Given { .. }, None) => {
            Err(PyValueError::new_err("anchor \"given\" wants distance_m, a number or one for each frame"))
        }
        (_, Some(_)) => {
            Err(PyValueError::new_err(format!("distance_m goes with anchor \"given\", not with {name:?}")))
        }
        (choice, None) => Ok(choice),
    }
}

fn dict_from_postures(py: Python<'_>, found: PostureSequence) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    set_lengths(&dict, &found.lengths)?;
    set_neck(&dict, &found)?;
    set_frames(&dict, &found)?;
    set_linked(&dict, &found)?;
    dict.set_item("heading_source", found.heading.from.name())?;
    let warnings: Vec<String> = found.warnings.iter().map(ToString::to_string).collect();
    dict.set_item("warnings", warnings)?;
    Ok(dict)
}

fn set_lengths(dict: &Bound<'_, PyDict>, lengths: &SequenceLengths) -> PyResult<()> {
    let [length_m, sd_m, basis] = [(); 3].map(|()| PyDict::new(dict.py()));
    for (i, (name, length)) in lengths.lengths.named().enumerate() {
        length_m.set_item(&name, length)?;
        sd_m.set_item(&name, lengths.sd_m[i])?;
        basis.set_item(&name, lengths.origin[i].name())?;
    }
    dict.set_item("lengths", length_m)?;
    dict.set_item("length_sd", sd_m)?;
    dict.set_item("length_basis", basis)?;
    dict.set_item("scale_from", lengths.scale_name())
}

fn set_neck(dict: &Bound<'_, PyDict>, found: &PostureSequence) -> PyResult<()> {
    let neck = &found.neck;
    dict.set_item("anchor_m", numpy_from_column(dict.py(), neck.distance_m.clone()))?;
    dict.set_item("anchor_sd_m", numpy_from_column(dict.py(), neck.sd_m.clone()))?;
    let sources: Vec<&str> = neck.from.iter().map(|from| from.name()).collect();
    dict.set_item("anchor_source", sources)?;
    let conflicts: Vec<String> = neck.conflicts.iter().map(ToString::to_string).collect();
    dict.set_item("anchor_conflicts", conflicts)
}

/// Adds the results of each frame alone.
fn set_frames(dict: &Bound<'_, PyDict>, found: &PostureSequence) -> PyResult<()> {
    let py = dict.py();
    let levels = |of: fn(&LevelCount) -> u32| -> PyResult<Bound<'_, PyArray2<i64>>> {
        let row = |frame: Option<&FrameReading>| match frame {
            Some(frame) => frame.tree.counts.0.map(|level| i64::from(of(&level))),
            None => [0; JOINT_COUNT],
        };
        numpy_from_rows(py, found.frames.iter().map(|frame| row(frame.as_ref().ok())).collect())
    };
    dict.set_item("level_reached", levels(|level| level.reached)?)?;
    dict.set_item("level_survived", levels(|level| level.survived)?)?;
    dict.set_item("level_without_root", levels(|level| level.without_root)?)?;
    let reasons = |frame: &FrameReading| -> Vec<(String, &str, u32)> {
        let cut = |cut: &memo_core::posture::tree::CutCount| {
            (cut.constraint.name(), cut.joint.name(), cut.branches)
        };
        frame.tree.reasons.iter().map(cut).collect()
    };
    let of_frames: Vec<_> =
        found.frames.iter().map(|frame| frame.as_ref().map(reasons).unwrap_or_default()).collect();
    dict.set_item("reasons", of_frames)?;
    let totals: Vec<(String, &str, &str, u64, usize, String)> = reason_totals(&found.frames)
        .into_iter()
        .map(|total| {
            let constraint = total.constraint;
            let (name, kind, joint) = (constraint.name(), constraint.kind().name(), total.joint.name());
            (name, kind, joint, total.branches, total.frames, constraint.description())
        })
        .collect();
    dict.set_item("reason_totals", totals)?;
    let survivors = found.frames.iter().map(|f| f.as_ref().map_or(0, |f| f.survivors() as i64)).collect();
    dict.set_item("survivors", numpy_from_column::<i64>(py, survivors))?;
    let (mut groups, mut sizes) = (Vec::new(), Vec::new());
    for frame in &found.frames {
        let of_frame = frame.as_ref().map_or(&[][..], |frame| &frame.groups);
        let figures: Vec<StickFigure> = of_frame.iter().map(|group| group.figure).collect();
        groups.push(numpy_from_figures(py, &figures)?);
        sizes.push(numpy_from_column(py, of_frame.iter().map(|group| group.size as i64).collect()));
    }
    let group_counts: Vec<Option<usize>> =
        found.frames.iter().map(|frame| frame.as_ref().map_or(Some(0), |frame| frame.group_count)).collect();
    let cut_all: Vec<Option<Vec<String>>> =
        found.frames.iter().map(|frame| frame.as_ref().ok().and_then(FrameReading::cut_all)).collect();
    let problems: Vec<Option<String>> =
        found.frames.iter().map(|frame| frame.as_ref().err().map(ToString::to_string)).collect();
    dict.set_item("problems", problems)?;
    dict.set_item("group_counts", group_counts)?;
    dict.set_item("groups", groups)?;
    dict.set_item("group_sizes", sizes)?;
    dict.set_item("cut_all", cut_all)
}

fn set_linked(dict: &Bound<'_, PyDict>, found: &PostureSequence) -> PyResult<()> {
    let py = dict.py();
    let linked = &found.linked;
    let table = |rows: &[PerJoint<f64>]| numpy_from_rows(py, rows.iter().map(|row| row.0).collect());
    dict.set_item("linked", numpy_from_figures(py, &linked.figures)?)?;
    dict.set_item("smoothed", numpy_from_figures(py, &linked.smoothed)?)?;
    dict.set_item("sd_m", table(&found.sd_m)?)?;
    dict.set_item("gap_m", table(&linked.gap_m)?)?;
    dict.set_item("margin", numpy_from_column(py, linked.margin.clone()))?;
    let mirrored = |t: usize| Joint::ALL.map(|joint| linked.probability_mirrored(t, joint));
    dict.set_item("p_mirrored", numpy_from_rows(py, (0..linked.figures.len()).map(mirrored).collect())?)?;
    let breaks: Vec<Vec<String>> =
        found.linked_breaks.iter().map(|broken| broken.iter().map(|c| c.name()).collect()).collect();
    dict.set_item("linked_breaks", breaks)?;
    let second = linked.second.as_ref().map(|second| -> PyResult<_> {
        let dict = PyDict::new(py);
        let joints: Vec<&str> = second.joints.iter().map(|&joint| Joint::name(joint)).collect();
        dict.set_item("joints", joints)?;
        dict.set_item("from", second.from)?;
        dict.set_item("to", second.to)?;
        dict.set_item("postures", numpy_from_figures(py, &second.figures)?)?;
        dict.set_item("margin", second.margin)?;
        dict.set_item("p", second.probability())?;
        Ok(dict)
    });
    dict.set_item("second", second.transpose()?)
}
