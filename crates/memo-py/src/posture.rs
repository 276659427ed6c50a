//! Postures of a sequence of keypoints.

use crate::array::{
    numpy_from_column, numpy_from_figures, numpy_from_rows, points_from_numpy, points_of_part_from_numpy,
    scores_from_numpy, times_from_numpy, track_from_numpy,
};
use crate::camera::PyCamera;
use crate::defaults::dict;
use crate::error::{value_error, wrong_type};
use crate::result::result;
use crate::wait::watched;
use crate::whole::{FROM_0, Size, Whole, WholeNumbers, size_px};
use glam::{DVec2, DVec3};
use memo_core::model::angles::{JointAngles, ankle_flexion_rad};
use memo_core::model::{
    ASSUMED_FOCAL_SD, DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD, JOINT_COUNT, assumed_field_of_view_rad,
};
use memo_core::posture::anchor::AnchorSource;
use memo_core::posture::lift::JointRays;
use memo_core::posture::link::{Alternative, LinkedPath};
use memo_core::posture::tree::{CutCount, LevelCount, View};
use memo_core::posture::{
    AnchorChoice, DEFAULT_DISTANCE_SD_M, FrameProblem, FrameReading, Motion, ReasonTotal, Strength,
    postures_with_progress, reason_totals,
};
use memo_core::wording::counted;
use memo_core::{
    Camera, Joint, KeypointSequence, PerJoint, Progress, SegmentLengths, SequenceOptions, Side, StickFigure,
};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use std::collections::HashMap;

result! {
    /// What `memo.Postures` is made of; its fields have the same names.
    PostureSequence |py, found: memo_core::PostureSequence, camera: PyCamera, kept_all: bool| {
        camera: PyCamera = PyCamera(camera.0.clone()),
        lengths_m: Py<PyDict> = found.lengths.lengths.named().into_py_dict(py)?,
        length_sd_m: Py<PyDict> = names(&found).zip(&found.lengths.sd_m).into_py_dict(py)?,
        length_basis: Py<PyDict> =
            names(&found).zip(found.lengths.origin.iter().map(|origin| origin.name())).into_py_dict(py)?,
        scale_from: String = found.lengths.scale_name(),
        anchor_source: Vec<String> = texts(found.neck.from.iter().map(|from| from.name())),
        anchor_conflicts: Vec<String> = texts(&found.neck.conflicts),
        anchor_m: Py<PyArray1<f64>> = numpy_from_column(py, found.neck.distance_m),
        anchor_sd_m: Py<PyArray1<f64>> = numpy_from_column(py, found.neck.sd_m),
        level_reached: Py<PyArray2<i64>> = levels(py, &found.frames, |level| level.reached)?,
        level_survived: Py<PyArray2<i64>> = levels(py, &found.frames, |level| level.survived)?,
        level_without_root: Py<PyArray2<i64>> = levels(py, &found.frames, |level| level.without_root)?,
        reasons: Vec<Vec<Reason>> = each(&found.frames, |f| f.tree.reasons.iter().map(reason).collect()),
        reason_totals: Vec<Total> = reason_totals(&found.frames).into_iter().map(total).collect::<Vec<_>>(),
        survivors: Py<PyArray1<i64>> =
            numpy_from_column(py, each(&found.frames, |frame| frame.survivors() as i64)),
        groups_m: Vec<Py<PyArray3<f64>>> = {
            let figures = each(&found.frames, |f| f.groups.iter().map(|g| g.figure).collect::<Vec<_>>());
            figures.iter().map(|of| Ok(numpy_from_figures(py, of)?.unbind())).collect::<PyResult<Vec<_>>>()?
        },
        interpretations: Vec<Interpretations> = if kept_all {
            found.frames.iter().map(|frame| interpretations(py, frame, &camera.0)).collect::<PyResult<Vec<_>>>()?
        } else {
            Vec::new()
        },
        group_sizes: Vec<Py<PyArray1<i64>>> = {
            let sizes = each(&found.frames, |frame| frame.groups.iter().map(|g| g.size as i64).collect());
            sizes.into_iter().map(|of| numpy_from_column(py, of).unbind()).collect::<Vec<_>>()
        },
        group_counts: Vec<Option<usize>> =
            found.frames.iter().map(|f| f.as_ref().map_or(Some(0), |f| f.group_count)).collect::<Vec<_>>(),
        cut_all: Vec<Option<Vec<String>>> = each(&found.frames, FrameReading::cut_all),
        problems: Vec<Option<String>> =
            found.frames.iter().map(|f| f.as_ref().err().map(ToString::to_string)).collect::<Vec<_>>(),
        linked_m: Py<PyArray3<f64>> = numpy_from_figures(py, &found.linked.figures)?,
        linked_breaks: Vec<Vec<String>> =
            found.linked_breaks.iter().map(|c| texts(c.iter().map(|c| c.name()))).collect::<Vec<_>>(),
        smoothed_m: Py<PyArray3<f64>> = numpy_from_figures(py, &found.linked.smoothed)?,
        toes_m: Py<PyArray3<f64>> = {
            let flat: Vec<f64> = found.linked.toes.iter().flatten().flat_map(|toe| toe.to_array()).collect();
            flat.into_pyarray(py).reshape([found.linked.toes.len(), 2, 3])?
        },
        angles_deg: Py<PyDict> = angles(py, &found.linked)?,
        sd_m: Py<PyArray2<f64>> = numpy_from_rows(py, found.sd_m.iter().map(|row| row.0).collect())?,
        gap_m: Py<PyArray2<f64>> = numpy_from_rows(py, found.linked.gap_m.iter().map(|row| row.0).collect())?,
        margin_nats: Py<PyArray1<f64>> = numpy_from_column(py, found.linked.margin.clone()),
        p_mirrored: Py<PyArray2<f64>> = {
            let frame = |t| Joint::ALL.map(|joint| found.linked.probability_mirrored(t, joint));
            numpy_from_rows(py, (0..found.linked.figures.len()).map(frame).collect())?
        },
        second: Option<Py<SecondMotion>> = match &found.linked.second {
            Some(second) => Some(Py::new(py, SecondMotion::of(py, second)?)?),
            None => None,
        },
        heading_source: String = found.heading.from.name(),
        rules: String = found.rules.name(),
        warnings: Vec<String> = texts(&found.warnings),
    }
    |own| counted(own.problems.len(), "frame")
}

result! {
    /// What `memo.postures.SecondBest` is made of; `first_row` is the first of the rows of its postures.
    SecondMotion |py, second: &Alternative| {
        joints: Vec<String> = texts(second.joints.iter().map(|&joint| Joint::name(joint))),
        first_row: usize = second.from,
        postures_m: Py<PyArray3<f64>> = numpy_from_figures(py, &second.figures)?,
        margin_nats: f64 = second.margin,
        p: f64 = second.probability(),
    }
    |own| own.joints.join(", ")
}

/// The fields of `memo.postures.Reason`.
type Reason = (String, String, u32);
/// The fields of `memo.postures.ReasonTotal`.
type Total = (String, String, String, u64, usize, String);

fn reason(cut: &CutCount) -> Reason {
    (cut.constraint.name(), cut.joint.name().to_owned(), cut.branches)
}

fn total(total: ReasonTotal) -> Total {
    let (constraint, joint) = (total.constraint, total.joint.name().to_owned());
    let kind = constraint.kind().name().to_owned();
    (constraint.name(), kind, joint, total.branches, total.frames, constraint.description())
}

fn names(found: &memo_core::PostureSequence) -> impl Iterator<Item = String> {
    found.lengths.lengths.named().map(|(name, _)| name)
}

/// The angle of each name, such as `right_knee`, in all frames, degrees.
fn angles<'py>(py: Python<'py>, motion: &LinkedPath) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    for side in Side::BOTH {
        let frames: Vec<JointAngles> =
            motion.smoothed.iter().map(|figure| JointAngles::of(figure, side)).collect();
        let name = |joint: &str, angle: fn(&JointAngles) -> f64| {
            let column = frames.iter().map(|angles| angle(angles).to_degrees()).collect();
            named.set_item(format!("{}_{joint}", side.name()), numpy_from_column(py, column))
        };
        name("hip", |angles| angles.hip_flexion_rad)?;
        name("hip_adduction", |angles| angles.hip_adduction_rad)?;
        name("knee", |angles| angles.knee_flexion_rad)?;
        name("shoulder", |angles| angles.shoulder_flexion_rad)?;
        name("shoulder_adduction", |angles| angles.shoulder_adduction_rad)?;
        name("elbow", |angles| angles.elbow_flexion_rad)?;
        let feet = motion.smoothed.iter().zip(&motion.toes);
        let ankle =
            feet.map(|(figure, toes)| ankle_flexion_rad(figure, toes[side as usize], side).to_degrees());
        named.set_item(format!("{}_ankle", side.name()), numpy_from_column(py, ankle.collect()))?;
    }
    Ok(named)
}

/// The fields of `memo.postures.Interpretations`.
type Interpretations = (Py<PyArray3<f64>>, Py<PyArray3<f64>>, Vec<String>);

fn interpretations(
    py: Python<'_>,
    frame: &Result<FrameReading, FrameProblem>,
    camera: &Camera,
) -> PyResult<Interpretations> {
    let survivors = frame.as_ref().map(|frame| frame.survivor_figures(camera)).unwrap_or_default();
    let cuts = frame.as_ref().map(|frame| frame.cut_figures(camera)).unwrap_or_default();
    let (cut, by): (Vec<StickFigure>, Vec<String>) =
        cuts.into_iter().map(|(figure, constraint)| (figure, constraint.name())).unzip();
    Ok((numpy_from_figures(py, &survivors)?.unbind(), numpy_from_figures(py, &cut)?.unbind(), by))
}

fn texts(items: impl IntoIterator<Item: ToString>) -> Vec<String> {
    items.into_iter().map(|item| item.to_string()).collect()
}

/// A value of each frame, the default if the frame cannot be used.
fn each<T: Default>(
    frames: &[Result<FrameReading, FrameProblem>],
    value: impl Fn(&FrameReading) -> T,
) -> Vec<T> {
    frames.iter().map(|frame| frame.as_ref().map(&value).unwrap_or_default()).collect()
}

fn levels<'py>(
    py: Python<'py>,
    frames: &[Result<FrameReading, FrameProblem>],
    count: fn(&LevelCount) -> u32,
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    numpy_from_rows(py, each(frames, |frame| frame.tree.counts.0.map(|level| i64::from(count(&level)))))
}

/// One distance for all frames, or one per frame.
pub enum Distances {
    /// The same for all frames.
    One(f64),
    /// One per frame.
    Each(Vec<f64>),
}

impl<'py> FromPyObject<'_, 'py> for Distances {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(distance_m) = object.extract() {
            return Ok(Self::One(distance_m));
        }
        let wanted = "a number of metres or one for each frame";
        object.extract().map(Self::Each).map_err(|_| wrong_type("distance_m", wanted, &object))
    }
}

/// Postures of one person: times (T,) s, points (T, 14, 2) px of the stick figure's joints with NaN if missing,
/// weights (T, 14). Results in world axes, metres, Z up. `progress` is called with the work done and the work in
/// all. Without a camera, one of the field of view `fov_deg` is assumed for pictures of `size`.
#[pyfunction]
#[pyo3(signature = (
    times_s, points, weights, camera=None, *, size=None, fov_deg=None, lengths=None, height_m=None, noise_px=None, rules=None,
    strength=None, anchor=None, distance_m=None, distance_sd_m=None, moving_direction=None,
    head_points=None, foot_points=None, group_m=None, max_groups=None, keep_all=false, progress=None
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn posture(
    py: Python<'_>,
    times_s: &Bound<'_, PyAny>,
    points: &Bound<'_, PyAny>,
    weights: &Bound<'_, PyAny>,
    camera: Option<&PyCamera>,
    size: Option<Size>,
    fov_deg: Option<f64>,
    lengths: Option<HashMap<String, f64>>,
    height_m: Option<f64>,
    noise_px: Option<f64>,
    rules: Option<&str>,
    strength: Option<&str>,
    anchor: Option<&str>,
    distance_m: Option<Distances>,
    distance_sd_m: Option<f64>,
    moving_direction: Option<[f64; 3]>,
    head_points: Option<&Bound<'_, PyAny>>,
    foot_points: Option<&Bound<'_, PyAny>>,
    group_m: Option<f64>,
    max_groups: Option<Whole<usize>>,
    keep_all: bool,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PostureSequence> {
    let (size, max_groups) = (size.map(size_px).transpose()?, max_groups.must_be("max_groups", FROM_0)?);
    let times_s = times_from_numpy(times_s)?;
    let track = track_from_numpy(points)?;
    if track.joints != JOINT_COUNT {
        let got = [track.frames, track.joints, 2];
        return Err(PyValueError::new_err(format!("wanted points of shape (T, 14, 2); got {got:?}")));
    }
    let weights = per_joint(&scores_from_numpy(weights, &track)?);
    let points_px: Vec<PerJoint<DVec2>> = per_joint(&track.points_px);
    let head_points_px = head_points.map(|points| points_of_part_from_numpy(points, "head")).transpose()?;
    let foot_points_px = foot_points.map(|points| points_of_part_from_numpy(points, "feet")).transpose()?;
    let usual = SequenceOptions::default();
    let options = SequenceOptions {
        lengths: lengths.map(lengths_from_names).transpose()?,
        height_m,
        noise_px: noise_px.unwrap_or(usual.noise_px),
        motion: motion_of(rules)?,
        strength: strength_of(strength)?,
        anchor: anchor_choice(anchor, distance_m, distance_sd_m)?,
        focal_sd: if camera.is_some() { 0.0 } else { ASSUMED_FOCAL_SD },
        moving_direction: moving_direction.map(DVec3::from),
        group_m: group_m.unwrap_or(usual.group_m),
        max_groups: max_groups.unwrap_or(usual.max_groups),
        keep_cuts: keep_all,
        ..usual
    };
    let camera = match (camera, size) {
        (Some(camera), None) if fov_deg.is_none() => camera.0.clone(),
        (None, Some(size)) => {
            let fov_rad = fov_deg.map_or_else(|| assumed_field_of_view_rad(size), f64::to_radians);
            Camera::assumed(size, fov_rad).map_err(value_error)?
        }
        _ => {
            let wanted = "wanted a camera, or the size of the pictures with or without their field of view";
            return Err(PyValueError::new_err(wanted));
        }
    };
    let used = PyCamera(camera.clone());
    let interpret = move |progress: &Progress| {
        let sequence = KeypointSequence {
            times_s: &times_s,
            points_px: &points_px,
            weights: &weights,
            head_points_px: head_points_px.as_deref(),
            foot_points_px: foot_points_px.as_deref(),
        };
        postures_with_progress(&sequence, &camera, &options, progress)
    };
    let found = watched(py, progress, interpret)?.map_err(value_error)?;
    PostureSequence::of(py, found, used, keep_all)
}

/// All postures that one view allows. `rays` (14, 3) are unit vectors in camera axes with NaN for joints that are
/// not seen; the neck's position (3,) is in metres. Returns the surviving postures (N, 14, 3), camera axes,
/// metres, in depth-first order. Upward and forward directions are those of the trunk.
#[pyfunction]
#[pyo3(signature = (rays, neck, lengths, *, rules=None, strength=None, noise_rad=0.0))]
pub fn posture_tree<'py>(
    py: Python<'py>,
    rays: &Bound<'py, PyAny>,
    neck: [f64; 3],
    lengths: HashMap<String, f64>,
    rules: Option<&str>,
    strength: Option<&str>,
    noise_rad: f64,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let rays = points_from_numpy(rays)?;
    let Ok(ray) = <[[f64; 3]; JOINT_COUNT]>::try_from(rays.as_slice()) else {
        return Err(PyValueError::new_err(format!("wanted rays of shape (14, 3); got ({}, 3)", rays.len())));
    };
    let rays =
        JointRays { ray: PerJoint(ray.map(DVec3::from)), weight: PerJoint([1.0; JOINT_COUNT]), noise_rad };
    let view = View::new(rays, DVec3::from(neck), lengths_from_names(lengths)?);
    let tree = motion_of(rules)?.tree(strength_of(strength)?);
    let interpret = || view.interpret(&tree).map(|found| found.figures());
    numpy_from_figures(py, &py.detach(interpret).map_err(value_error)?)
}

fn per_joint<T: Copy>(flat: &[T]) -> Vec<PerJoint<T>> {
    flat.chunks_exact(JOINT_COUNT).map(|row| PerJoint(std::array::from_fn(|j| row[j]))).collect()
}

fn named<T>(what: &str, name: &str, of: impl Fn(&str) -> Option<T>, all: &[&str]) -> PyResult<T> {
    of(name).ok_or_else(|| PyValueError::new_err(format!("wanted {what} as one of {all:?}; got {name:?}")))
}

pub fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let usual = SequenceOptions::default();
    dict!(py, {
        rules: usual.motion.name(),
        strength: usual.strength.name(),
        anchor: usual.anchor.name(),
        distance_sd_m: DEFAULT_DISTANCE_SD_M,
        noise_px: usual.noise_px,
        fov_deg: DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD.to_degrees(),
        group_m: usual.group_m,
        max_groups: usual.max_groups,
    })
}

fn motion_of(rules: Option<&str>) -> PyResult<Motion> {
    rules.map_or(Ok(SequenceOptions::default().motion), |name| {
        named("rules", name, Motion::from_name, &Motion::ALL.map(Motion::name))
    })
}

fn strength_of(strength: Option<&str>) -> PyResult<Strength> {
    strength.map_or(Ok(SequenceOptions::default().strength), |name| {
        named("strength", name, Strength::from_name, &["measured", "paper"])
    })
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

fn anchor_choice(
    name: Option<&str>,
    distance_m: Option<Distances>,
    sd_m: Option<f64>,
) -> PyResult<AnchorChoice> {
    let of_source = |name: &str| match name {
        "auto" => Some(AnchorChoice::Auto),
        "given" => Some(AnchorChoice::Given { distance_m: Vec::new(), sd_m: DEFAULT_DISTANCE_SD_M }),
        _ => AnchorSource::from_name(name).map(AnchorChoice::Source),
    };
    let names = ["auto", "ground", "trunk", "extent", "head", "combined", "given"];
    let usual = Ok(SequenceOptions::default().anchor);
    let choice = name.map_or(usual, |name| named("anchor", name, of_source, &names))?;
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
        (choice, Some(_)) => Err(PyValueError::new_err(format!(
            "distance_m goes with anchor \"given\", not with {:?}",
            choice.name()
        ))),
        (choice, None) => Ok(choice),
    }
}
