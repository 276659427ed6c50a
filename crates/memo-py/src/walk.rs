//! `Walk`: a walk that has ended, and what it consists of.

use crate::array::{frame_from_numpy, numpy_from_column, numpy_from_rows};
use crate::camera::PyCamera;
use crate::cycles::{Departure, GaitCycle, departures_of, gait_cycles_of};
use crate::defaults::dict;
use crate::error::value_error;
use crate::fit::WalkFit;
use crate::record::{Recorded, SegmentsWithParts, WalkRecord};
use crate::result::{objects, result};
use crate::wait::watched;
use crate::whole::Whole;
use glam::{DVec2, DVec3};
use memo_core::calibrate::TiltEstimate;
use memo_core::model::SideJoints;
use memo_core::track::fit::{FitError, FitOptions};
use memo_core::track::start::{Direction, PhaseLine as CoreLine, StartReport};
use memo_core::track::walk::Step;
use memo_core::track::{Event, Row, height, plausible, treadmill};
use memo_core::wording::counted;
use memo_core::{Image, TrackedWalk};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::OnceLock;

result! {
    /// A gait event.
    GaitEvent |_py, event: &Event| {
        /// Time, seconds.
        time_s: f64,
        /// The same as a frame, between frames.
        frame: f64,
        /// "heel_strike" or "toe_off".
        event: String = event.kind.name(),
        /// "right" or "left".
        side: String = event.side.name(),
    }
    |own| format!("{} {} at {:.2} s", own.side, own.event, own.time_s)
}

result! {
    /// A gait parameter with its 95 % interval.
    GaitParameter |_py, line: &memo_core::GaitParameter| {
        /// Its name, a key of `memo.gait.DEFINITIONS`.
        parameter: String = line.quantity.name(),
        /// "right", "left", or "" for both.
        side: String = line.side.map_or("", |side| side.name()),
        /// NaN if unknown, as are the ends of the interval.
        value: f64 = line.value.unwrap_or(f64::NAN),
        /// Unit of value and interval.
        unit: String = line.quantity.unit(),
        /// Lower end of the interval.
        low: f64 = line.interval.map_or(f64::NAN, |ends| ends[0]),
        /// Upper end of the interval.
        high: f64 = line.interval.map_or(f64::NAN, |ends| ends[1]),
        /// Number of steps or cycles used.
        n: usize,
    }
    |own| format!("{} {} {:.3} {} ({:.3} to {:.3})", own.side, own.parameter, own.value, own.unit, own.low, own.high)
}

result! {
    /// A body height.
    BodyHeight |_py, height: &height::BodyHeight| {
        /// Crown to sole, metres.
        height_m: f64,
        /// Its standard deviation, metres.
        sd_m: f64,
        /// "given", "measured" or "assumed".
        source: String = height.source.name(),
    }
    |own| format!("{:.3} m +- {:.3}, {}", own.height_m, own.sd_m, own.source)
}

result! {
    /// How a camera is tilted, by the upright lines in its picture.
    CameraTilt |_py, found: &TiltEstimate| {
        /// Rotation about the viewing direction, degrees; positive if upright lines lean to the right.
        roll_deg: f64 = found.tilt.roll_rad.to_degrees(),
        /// Downwards from the horizon, degrees, for the focal length that was given or assumed.
        pitch_deg: f64 = found.tilt.pitch_rad.to_degrees(),
        /// Standard deviation of the roll, degrees.
        roll_sd_deg: f64 = found.roll_sd_rad.to_degrees(),
        /// Standard deviation of the pitch, degrees.
        pitch_sd_deg: f64 = found.pitch_sd_rad.to_degrees(),
        /// How many lines are upright under this tilt, less those expected by chance.
        upright_lines: f64,
    }
    |own| format!(
        "roll {:.1} +- {:.1} deg, pitch {:.1} +- {:.1} deg, {:.0} upright lines",
        own.roll_deg, own.roll_sd_deg, own.pitch_deg, own.pitch_sd_deg, own.upright_lines
    )
}

result! {
    /// Step length over cadence, metres per step per minute.
    WalkRatio |_py, ratio: plausible::WalkRatio| {
        /// That of the walk.
        value: f64,
        /// The smallest that is usual at this height.
        low: f64 = ratio.usual[0],
        /// The largest.
        high: f64 = ratio.usual[1],
    }
    |own| format!("{:.4}, usual {:.4} to {:.4}", own.value, own.low, own.high)
}

result! {
    /// A treadmill under a walk.
    Treadmill |_py, found: &treadmill::Treadmill| {
        /// Speed of the belt, m/s.
        belt_mps: f64 = found.belt.speed_mps,
        /// Its standard deviation, m/s.
        belt_sd_mps: f64 = found.belt.sd_mps,
        /// The heading that looks alike from the camera, radians; None if there is none.
        other_heading_rad: Option<f64> = found.mirrored.map(|other| other.heading_rad),
        /// Probability of that heading.
        p_other_heading: Option<f64> = found.mirrored.map(|other| other.probability),
    }
    |own| format!("{:.2} +- {:.2} m/s", own.belt_mps, own.belt_sd_mps)
}

result! {
    /// A line of the gait phase over time.
    PhaseLine |_py, line: CoreLine| {
        /// Phase at the first frame, in [0, 1).
        phase_at_start: f64,
        /// Gait cycles per second; negative for a cycle run backwards.
        rate_hz: f64,
        /// Mean similarity along the line.
        similarity: f64,
    }
    |own| format!("{:.3} + {:.3} Hz t, similarity {:.3}", own.phase_at_start, own.rate_hz, own.similarity)
}

result! {
    /// The starting phase of a walk.
    WalkStart |py, start: &StartReport| {
        /// Its frames, (N,).
        frame: Py<PyArray1<i64>> = numpy_from_column(py, start.frames.iter().map(|f| *f as i64).collect()),
        /// Their times, (N,) seconds.
        time_s: Py<PyArray1<f64>> = numpy_from_column(py, start.curves.iter().map(|c| c.time_s).collect()),
        /// The most similar phase of each, (N,).
        phase: Py<PyArray1<f64>> =
            numpy_from_column(py, start.curves.iter().map(|c| c.best_phase()).collect()),
        /// Similarity of each frame over the whole cycle, (N, phases).
        similarity: Py<PyArray2<f32>> = {
            let scores: Vec<Vec<f32>> = start.curves.iter().map(|c| c.scores.clone()).collect();
            PyArray2::from_vec2(py, &scores)?
        },
        /// The chosen line.
        line: Py<PhaseLine> = Py::new(py, PhaseLine::of(py, start.lines.best)?)?,
        /// The best line of the other half cycle.
        twin: Py<PhaseLine> = Py::new(py, PhaseLine::of(py, start.lines.twin)?)?,
        /// The best line in the other walking direction.
        other_direction: Py<PhaseLine> = Py::new(py, PhaseLine::of(py, start.other_direction)?)?,
        /// The line of the paper's rule, for comparison.
        two_line_rule: Py<PhaseLine> = Py::new(py, PhaseLine::of(py, start.two_line_rule.line)?)?,
        /// Probability of the other walking direction.
        p_other_direction: f64,
    }
    |own| format!("p_other_direction {:.3}", own.p_other_direction)
}

result! {
    /// One walk that has ended.
    Walk |py, walk: TrackedWalk, rows: Vec<Row>| {
        /// Number of the person, in order of appearance.
        person: usize,
        /// "forward" or "backward".
        direction: String = direction(&walk),
        /// Probability that the person walks in the other direction.
        p_other_direction: f64 = walk.start.p_other_direction,
        /// Probability that left and right are swapped.
        p_swapped: f64 = walk.p_swapped(),
        /// True for a walk towards the camera or away from it, whose place and phase the feet show: left and right stay
        /// open, and the angles are those of average walking.
        is_frontal: bool,
        /// The columns of `track.csv`, one array per column.
        columns: Py<PyDict> = columns(py, &walk, &rows)?,
        /// Gait events in order of time.
        events: Vec<Py<GaitEvent>> = objects(py, walk.events().iter().map(|event| GaitEvent::of(py, event)))?,
        /// Gait parameters; every walk has the same.
        gait_parameters: Vec<Py<GaitParameter>> =
            objects(py, walk.gait_parameters().iter().map(|line| GaitParameter::of(py, line)))?,
        /// Gait cycles, right then left, each side's mean last.
        cycles: Vec<Py<GaitCycle>> = gait_cycles_of(py, &walk)?,
        /// Joints whose mean cycle is outside of average walking.
        departures: Vec<Py<Departure>> = departures_of(py, &walk)?,
        /// The body height that the walk was tracked with.
        height: Py<BodyHeight> = Py::new(py, BodyHeight::of(py, &walk.height)?)?,
        /// The height that the fit measured in a calibrated camera, also if another was given; None if it measured none.
        measured_height: Option<Py<BodyHeight>> = {
            let found = walk.fitted().and_then(|fit| fit.height.as_ref());
            found.map(|height| Py::new(py, BodyHeight::of(py, height)?)).transpose()?
        },
        /// True if the measured height contradicts the given one by more than three standard deviations.
        height_is_contradicted: bool = walk.is_height_contradicted(),
        /// None for backward or very short walks.
        walk_ratio: Option<Py<WalkRatio>> =
            walk.walk_ratio().map(|ratio| Py::new(py, WalkRatio::of(py, ratio)?)).transpose()?,
        /// Changes beside the legs that nobody explains, as a share of the area of two legs; None if too few frames show it.
        unexplained: Option<f64> = walk.unexplained,
        /// True if so much changes there that somebody else may walk there, or something moves with the person.
        is_beside_somebody: bool = walk.is_beside_somebody(),
        /// None for a walk over ground.
        treadmill: Option<Py<Treadmill>> =
            walk.treadmill().map(|found| Py::new(py, Treadmill::of(py, &found)?)).transpose()?,
        /// The measured person; None if there was no fit, or if it failed.
        fit: Option<Py<WalkFit>> = {
            let found = walk.fitted().zip(walk.mean_sd());
            found.map(|(fit, sd)| Py::new(py, WalkFit::of(py, fit, &sd)?)).transpose()?
        },
        /// Why no person was measured; None if there is a fit, or if none was asked for.
        fit_problem: Option<String> =
            walk.fit.as_ref().and_then(|fit| fit.as_ref().err()).map(ToString::to_string),
        /// The camera, given or assumed.
        camera: PyCamera = PyCamera(walk.first_camera().clone()),
        /// How the assumed camera is tilted; None if a camera was given.
        camera_tilt: Option<Py<CameraTilt>> =
            walk.tilt.as_ref().map(|tilt| Py::new(py, CameraTilt::of(py, tilt)?)).transpose()?,
        /// The starting phase.
        start: Py<WalkStart> = Py::new(py, WalkStart::of(py, &walk.start)?)?,
        /// Best measured hypotheses per frame, (rows, 3): world x of the position along the path and z in metres, phase;
        /// NaN for frames without a measurement.
        measured: Py<PyArray2<f64>> = {
            numpy_from_rows(py, walk.steps().iter().map(|step| measured(&walk, step)).collect())?
        },
        /// What `memo.explain` needs besides the video, as plain numbers.
        record: Py<PyDict> = WalkRecord::of(py, &walk, &rows)?.into_dict(py)?,
    }
    @hidden {
        recorded: OnceLock<Recorded> = OnceLock::new(),
        tracked: Option<(TrackedWalk, Vec<Row>)> = Some((walk, rows)),
    }
    |own| {
        let rows = Python::attach(|py| own.measured.bind(py).len().unwrap_or(0));
        format!("person {}, {}, {}", own.person, counted(rows, "row"), own.direction)
    }; methods {
        /// Visible contours of the model in a row, in pixels of its frame: (segments, 2, 2), and the body part of each
        /// segment.
        fn contours<'py>(&self, py: Python<'py>, row: Whole<usize>) -> PyResult<SegmentsWithParts<'py>> {
            let rows = self.__len__(py);
            let row = row.index(rows, "row", &format!("a walk with {}", counted(rows, "row")))?;
            let recorded = match self.recorded.get() {
                Some(recorded) => recorded,
                None => {
                    let read = Recorded::read(self.record.bind(py))?;
                    self.recorded.get_or_init(|| read)
                }
            };
            recorded.contours(py, recorded.frame(row))
        }

        fn __len__(&self, py: Python<'_>) -> usize {
            self.measured.bind(py).len().unwrap_or(0)
        }
    }
}

impl Walk {
    /// A walk as it crosses to Python.
    pub fn of_tracked(py: Python<'_>, walk: TrackedWalk) -> PyResult<Self> {
        let rows = walk.rows();
        Self::of(py, walk, rows)
    }

    /// The core's walk; a walk from another process has none.
    pub fn tracked(&self) -> PyResult<&(TrackedWalk, Vec<Row>)> {
        self.tracked.as_ref().ok_or_else(|| PyRuntimeError::new_err("the walk is from another process"))
    }
}

/// The walk with the person fitted again to pictures of its rows, (H, W) uint8 each, before the `empty` scene, which is
/// otherwise the median of the pictures where the person is elsewhere. `height_sd` and `frame_sd_deg` are how well a
/// given height is known, as a share of it, and how much hip and knee vary about the person's curves.
#[pyfunction]
#[pyo3(signature = (walk, pictures, *, empty=None, height_sd=None, frame_sd_deg=None))]
pub fn fit_walk(
    py: Python<'_>,
    walk: &Walk,
    pictures: Vec<Bound<'_, PyAny>>,
    empty: Option<&Bound<'_, PyAny>>,
    height_sd: Option<f64>,
    frame_sd_deg: Option<f64>,
) -> PyResult<Walk> {
    let walk = walk.tracked()?.0.clone();
    let image = |picture: &Bound<'_, PyAny>| frame_from_numpy(picture)?.into_image();
    let pictures: Vec<Image<u8>> = pictures.iter().map(image).collect::<PyResult<_>>()?;
    let empty = empty.map(image).transpose()?;
    if let Some(got) = frame_sd_deg.filter(|&sd| !(sd > 0.0 && sd.is_finite())) {
        let refusal = format!("frame_sd_deg must be positive and finite, got {got}");
        return Err(PyValueError::new_err(refusal));
    }
    let usual = FitOptions::default();
    let options = FitOptions {
        height_sd: height_sd.unwrap_or(usual.height_sd),
        frame_sd_rad: frame_sd_deg.map_or(usual.frame_sd_rad, f64::to_radians),
        ..usual
    };
    let walk = watched(py, None, move |_| {
        let fit = walk.fit(&pictures, empty.as_ref(), &options);
        if let Err(FitError::Option(_) | FitError::Pictures { .. } | FitError::PictureSize { .. }) = fit {
            return fit.map(|_| walk);
        }
        Ok(walk.with_fit(fit))
    })?;
    Walk::of_tracked(py, walk.map_err(value_error)?)
}

/// The defaults of [`fit_walk`].
pub fn fit_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let options = FitOptions::default();
    let frame_sd_deg = (options.frame_sd_rad.to_degrees() * 1e9).round() / 1e9;
    dict!(py, { height_sd: options.height_sd, frame_sd_deg: frame_sd_deg, })
}

fn direction(walk: &TrackedWalk) -> &'static str {
    match walk.direction() {
        Direction::Forward => "forward",
        Direction::Backward => "backward",
    }
}

fn measured(walk: &TrackedWalk, step: &Step) -> [f64; 3] {
    let Some(found) = &step.measured else { return [f64::NAN; 3] };
    let vertical_m = walk.walk.walker.gait.vertical_m(found.phase);
    [step.look.path.point(found.along_m, 0.0).x, found.height_m + vertical_m, found.phase]
}

/// The columns of `track.csv`.
fn columns<'py>(py: Python<'py>, walk: &TrackedWalk, rows: &[Row]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("frame", numpy_from_column(py, rows.iter().map(|row| row.frame as i64).collect()))?;
    let column = |value: &dyn Fn(&Row) -> f64| -> Vec<f64> { rows.iter().map(value).collect() };
    let set = |name: &str, column: Vec<f64>| dict.set_item(name, numpy_from_column(py, column));
    set("time_s", column(&|r| r.time_s))?;
    set("x_m", column(&|r| r.torso_centre.x))?;
    set("y_m", column(&|r| r.torso_centre.y))?;
    set("z_m", column(&|r| r.torso_centre.z))?;
    set("heading_rad", column(&|r| r.heading_rad))?;
    set("phase", column(&|r| r.phase))?;
    set("p_swapped", column(&|r| r.p_swapped))?;
    set("speed_mps", column(&|r| r.speed_mps))?;
    for (i, name) in ["sd_x_m", "sd_y_m", "sd_z_m", "sd_phase"].into_iter().enumerate() {
        set(name, column(&|r| r.sd[i]))?;
    }
    for (index, side) in ["right", "left"].into_iter().enumerate() {
        for (joint, name) in ["hip", "knee", "ankle", "shoulder", "elbow"].into_iter().enumerate() {
            let angle = |r: &Row| angle(walk, r, index, joint);
            set(&format!("{side}_{name}_deg"), column(&|r| angle(r)[0].to_degrees()))?;
            set(&format!("sd_{side}_{name}_deg"), column(&|r| angle(r)[1].to_degrees()))?;
        }
        for (joint, name) in SideJoints::NAMES.into_iter().enumerate() {
            let at = |r: &Row| [r.right, r.left][index].to_array()[joint];
            set(&format!("{side}_{name}_x_m"), column(&|r| at(r).x))?;
            set(&format!("{side}_{name}_y_m"), column(&|r| at(r).y))?;
            set(&format!("{side}_{name}_z_m"), column(&|r| at(r).z))?;
            let (u_px, v_px) = pixels(walk, rows, at);
            set(&format!("{side}_{name}_u_px"), u_px)?;
            set(&format!("{side}_{name}_v_px"), v_px)?;
        }
    }
    set("similarity", column(&|r| r.similarity))?;
    Ok(dict)
}

/// A joint's angle and standard deviation, radians: the measured ones, or the model's if no fit was asked for; NaN if
/// unknown.
fn angle(walk: &TrackedWalk, row: &Row, side: usize, joint: usize) -> [f64; 2] {
    if walk.fit.is_some() {
        return row.measured.and_then(|sides| sides[side].angles[joint]).unwrap_or([f64::NAN; 2]);
    }
    let angles = [row.posture.right, row.posture.left][side];
    [[angles.hip, angles.knee, f64::NAN, angles.shoulder, angles.elbow][joint], f64::NAN]
}

/// A point of each row in pixels of its frame, as the camera of that frame saw it.
fn pixels(walk: &TrackedWalk, rows: &[Row], point: impl Fn(&Row) -> DVec3) -> (Vec<f64>, Vec<f64>) {
    let pixel = |(k, row): (usize, &Row)| {
        let pixel = walk.camera_of(k).project(point(row)).unwrap_or(DVec2::NAN);
        (pixel.x, pixel.y)
    };
    rows.iter().enumerate().map(pixel).collect()
}
