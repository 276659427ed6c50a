//! `Tracker` and its walks.

use crate::array::{frame_from_numpy, numpy_from_column, numpy_from_rows, numpy_from_segments};
use crate::camera::PyCamera;
use crate::cycles::{self, CycleTuple};
use crate::defaults::dict;
use crate::error::value_error;
use crate::explain::record_of;
use crate::fit::WalkFit;
use crate::steady::{MotionTuple, loss_tuple, motion_tuple};
use crate::wait::{LOOK, watched};
use glam::{DVec2, DVec3};
use memo_core::image::BackgroundOptions;
use memo_core::image::flow::FlowOptions;
use memo_core::model::visibility::visible_contours;
use memo_core::model::{Camera, SideJoints, VisibilityOptions, VisibleSegment};
use memo_core::track::fit::FitOptions;
use memo_core::track::gait_parameters::GaitParameter;
use memo_core::track::height::{BodyHeight, POPULATION_HEIGHT_M, POPULATION_SD_M};
use memo_core::track::options::{GaitChoice, TrackerOptions};
use memo_core::track::result::{Row, TrackedWalk};
use memo_core::track::score::Measure;
use memo_core::track::start::Direction;
use memo_core::track::steady::SteadyOptions;
use memo_core::track::tracker::{Now, Tracker};
use memo_core::track::treadmill::Treadmill;
use memo_core::track::walk::Step;
use memo_core::wording::counted;
use numpy::{PyArray1, PyArray2, PyArrayDyn};
use pyo3::exceptions::{PyIndexError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Tracks everybody who walks through a stream of grey frames; memory does not grow with the length of the stream.
///
/// An interrupted call keeps running in the background: its frame is processed, and the next call waits for it.
#[pyclass(name = "Tracker", module = "memo._memo", frozen)]
pub struct PyTracker(Arc<Shared>);

/// Body heights, metres.
#[derive(FromPyObject)]
enum Heights {
    Everybody(f64),
    /// Of people in order of appearance.
    Each(Vec<f64>),
}

/// A tracker shared by calls, one at a time.
struct Shared {
    /// `None` while a call uses it. No call waits for it on a thread of the pool, because that thread may be the
    /// one that uses it.
    tracker: Mutex<Option<Box<Tracker>>>,
    /// Notifies that the tracker is back.
    returned: Condvar,
    /// The number of current calls in the lower half, and their process in the upper half.
    calls: AtomicU64,
}

/// A call that waits or runs.
struct Call(Arc<Shared>);

impl Call {
    /// A child forked during a call of its parent would wait for that call forever, so it gets an error.
    fn enter(shared: &Arc<Shared>) -> PyResult<Self> {
        let process = u64::from(std::process::id()) << 32;
        let counted = |calls: u64| {
            let count = calls & u64::from(u32::MAX);
            (count == 0 || calls - count == process).then_some(process | (count + 1))
        };
        match shared.calls.fetch_update(Ordering::SeqCst, Ordering::SeqCst, counted) {
            Ok(_) => Ok(Self(Arc::clone(shared))),
            Err(_) => Err(PyRuntimeError::new_err(
                "the process was forked while this Tracker was at work: make a new one in the child",
            )),
        }
    }

    /// Takes the tracker when other calls have returned it.
    fn taken(self, py: Python<'_>) -> PyResult<Taken> {
        loop {
            let taken = py.detach(|| {
                let waited = self.0.returned.wait_timeout_while(self.tracker(), LOOK, |t| t.is_none());
                waited.unwrap_or_else(PoisonError::into_inner).0.take()
            });
            if taken.is_some() {
                return Ok(Taken { tracker: taken, call: self });
            }
            py.check_signals()?;
        }
    }

    fn tracker(&self) -> MutexGuard<'_, Option<Box<Tracker>>> {
        self.0.tracker.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Call {
    fn drop(&mut self) {
        self.0.calls.fetch_sub(1, Ordering::SeqCst);
    }
}

/// A tracker that is returned on drop.
struct Taken {
    tracker: Option<Box<Tracker>>,
    call: Call,
}

impl Taken {
    fn with<T>(mut self, work: impl FnOnce(&mut Tracker) -> T) -> T {
        work(self.tracker.as_mut().expect("it is returned no sooner"))
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        *self.call.tracker() = self.tracker.take();
        self.call.0.returned.notify_one();
    }
}

impl PyTracker {
    /// Reads the tracker when no interrupted call is running.
    pub fn read<T>(&self, py: Python<'_>, look: impl FnOnce(&mut Tracker) -> T) -> PyResult<T> {
        Ok(Call::enter(&self.0)?.taken(py)?.with(look))
    }

    /// Runs a call of the tracker on the threads of this process.
    fn call<T: Send + 'static>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Tracker) -> T + Send + 'static,
    ) -> PyResult<T> {
        let taken = Call::enter(&self.0)?.taken(py)?;
        watched(py, None, |_| taken.with(work))
    }
}

#[pymethods]
impl PyTracker {
    #[new]
    #[pyo3(signature = (
        height_m=None, camera=None, *, fov_deg=None, gait="dense", adapt=true, start_frames=13, treadmill=None,
        compensate_gain=false, background=false, steady=true, measure="rohr", full_gradient=None, full_velocity=None,
        part_weights=None
    ))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments in Python")]
    fn new(
        height_m: Option<Heights>,
        camera: Option<PyCamera>,
        fov_deg: Option<f64>,
        gait: &str,
        adapt: bool,
        start_frames: i64,
        treadmill: Option<bool>,
        compensate_gain: bool,
        background: bool,
        steady: bool,
        measure: &str,
        full_gradient: Option<f32>,
        full_velocity: Option<f32>,
        part_weights: Option<[f32; 14]>,
    ) -> PyResult<Self> {
        let mut options = TrackerOptions::default();
        match height_m {
            Some(Heights::Everybody(height_m)) => options.height_m = Some(height_m),
            Some(Heights::Each(heights_m)) => {
                let mut heights_m = heights_m.into_iter();
                options.height_m = heights_m.next();
                options.further_heights_m = heights_m.collect();
            }
            None => {}
        }
        options.camera = camera.map(|camera| camera.0);
        if let Some(degrees) = fov_deg {
            options.field_of_view_rad = degrees.to_radians();
        }
        options.gait = match gait {
            "dense" => GaitChoice::Dense,
            "sampled_10" => GaitChoice::Sampled10,
            "boulic" => GaitChoice::Boulic,
            other => return Err(choice_error("gait", "'dense', 'sampled_10' or 'boulic'", other)),
        };
        options.evidence.change.compensate_gain = compensate_gain;
        options.evidence.background = background.then(BackgroundOptions::default);
        options.steady = steady.then(SteadyOptions::default);
        options.evidence.flow = full_velocity.map(|_| FlowOptions::default());
        let similarity = &mut options.walk.similarity;
        similarity.measure = match measure {
            "rohr" => Measure::Rohr,
            "lowe" => Measure::Lowe,
            other => return Err(choice_error("measure", "'rohr' or 'lowe'", other)),
        };
        similarity.full_gradient = full_gradient;
        similarity.full_velocity = full_velocity;
        similarity.part_weights = part_weights.unwrap_or(similarity.part_weights);
        options.treadmill = treadmill;
        options.fit = adapt.then(FitOptions::default);
        options.start_frames = usize::try_from(start_frames).unwrap_or(0);
        let tracker = Mutex::new(Some(Box::new(Tracker::new(options).map_err(value_error)?)));
        Ok(Self(Arc::new(Shared { tracker, returned: Condvar::new(), calls: AtomicU64::new(0) })))
    }

    /// Adds the next frame, (H, W) uint8, and its time in seconds.
    fn update(&self, py: Python<'_>, frame: &Bound<'_, PyAny>, time_s: f64) -> PyResult<()> {
        let image = frame_from_numpy(frame)?.into_image()?;
        self.call(py, move |tracker| tracker.update(&image.as_frame(), time_s))?.map_err(value_error)
    }

    /// Ends the stream: processes the last frame and ends the current walk.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Tracker::finish)?.map_err(value_error)
    }

    /// The walks that have ended since the last call.
    fn take_finished(&self, py: Python<'_>) -> PyResult<Vec<PyWalk>> {
        Ok(self.read(py, Tracker::take_finished)?.into_iter().map(PyWalk::new).collect())
    }

    /// Filtered states of everybody who is followed, in order of appearance: dicts of person, time, position, phase,
    /// speed and `p_swapped`.
    fn people<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let people = self.read(py, |tracker| tracker.people())?;
        people.iter().map(|now| now_as_dict(py, now)).collect()
    }

    /// What was found of the camera in each of the last 25 000 frames: (frame, state, turn_rad, shift_px, rms_px,
    /// support), state "still", "turned", "unknown" or "lost"; empty with `steady=False`.
    fn camera_motion(&self, py: Python<'_>) -> PyResult<Vec<MotionTuple>> {
        self.read(py, |tracker| tracker.camera_motions().map(motion_tuple).collect())
    }

    /// Where a view of the camera ended: (first frame of another view, "cut", "zoom" or "other view").
    fn lost_views(&self, py: Python<'_>) -> PyResult<Vec<(usize, &'static str)>> {
        self.read(py, |tracker| tracker.losses().iter().map(loss_tuple).collect())
    }

    /// Counts over the whole stream; if nobody was followed, they show why.
    fn seek_report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let report = self.read(py, |tracker| tracker.seek_report())?;
        let dict = PyDict::new(py);
        dict.set_item("frames", report.frames)?;
        dict.set_item("frames_with_candidate", report.frames_with_candidate)?;
        dict.set_item("frames_cut_off", report.frames_cut_off)?;
        dict.set_item("refused_starts", report.refused_starts)?;
        Ok(dict)
    }
}

fn now_as_dict<'py>(py: Python<'py>, now: &Now) -> PyResult<Bound<'py, PyDict>> {
    dict!(py, {
        person: now.person,
        frame: now.frame,
        time_s: now.time_s,
        x_m: now.torso_centre.x,
        y_m: now.torso_centre.y,
        z_m: now.torso_centre.z,
        heading_rad: now.heading_rad,
        phase: now.phase,
        p_swapped: now.p_swapped,
        speed_mps: now.speed_mps,
    })
}

/// The defaults of a track.
pub fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    dict!(py, {
        height_m: POPULATION_HEIGHT_M,
        height_sd_m: POPULATION_SD_M,
    })
}

pub(crate) fn choice_error(name: &str, wanted: &str, got: &str) -> PyErr {
    PyValueError::new_err(format!("{name} must be {wanted}, got {got:?}"))
}

/// A finished walk.
#[pyclass(name = "Walk", module = "memo._memo", frozen)]
pub struct PyWalk {
    pub(crate) walk: TrackedWalk,
    pub(crate) rows: Vec<Row>,
}

impl PyWalk {
    fn new(walk: TrackedWalk) -> Self {
        let rows = walk.rows();
        Self { walk, rows }
    }

    fn column(&self, value: impl Fn(&Row) -> f64) -> Vec<f64> {
        self.rows.iter().map(value).collect()
    }

    /// A point of each row in pixels of its frame, as the camera of that frame saw it.
    fn pixels(&self, point: impl Fn(&Row) -> DVec3) -> (Vec<f64>, Vec<f64>) {
        let pixel = |(k, row): (usize, &Row)| {
            let pixel = self.walk.camera_of(k).project(point(row)).unwrap_or(DVec2::NAN);
            (pixel.x, pixel.y)
        };
        self.rows.iter().enumerate().map(pixel).collect()
    }
}

/// Segments (n, 2, 2) and the body part of each (n,).
pub type SegmentsWithParts<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<u8>>);

/// Visible pieces of contours in image pixels; pieces the camera does not see are omitted.
pub fn segments_with_parts<'py>(
    py: Python<'py>,
    visible: &[VisibleSegment],
    camera: &Camera,
) -> PyResult<SegmentsWithParts<'py>> {
    let seen = |v: &VisibleSegment| Some((v.ends_px(camera)?.map(|p| p.to_array()), v.part as u8));
    let (segments, parts) = visible.iter().filter_map(seen).unzip();
    Ok((numpy_from_segments(py, segments)?, numpy_from_column(py, parts)))
}

#[pymethods]
impl PyWalk {
    /// The columns of `track.csv`, one array per column.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let frames: Vec<i64> = self.rows.iter().map(|row| row.frame as i64).collect();
        dict.set_item("frame", numpy_from_column(py, frames))?;
        let set = |name: &str, column: Vec<f64>| dict.set_item(name, numpy_from_column(py, column));
        set("time_s", self.column(|r| r.time_s))?;
        set("x_m", self.column(|r| r.torso_centre.x))?;
        set("y_m", self.column(|r| r.torso_centre.y))?;
        set("z_m", self.column(|r| r.torso_centre.z))?;
        set("heading_rad", self.column(|r| r.heading_rad))?;
        set("phase", self.column(|r| r.phase))?;
        set("p_swapped", self.column(|r| r.p_swapped))?;
        set("speed_mps", self.column(|r| r.speed_mps))?;
        for (i, name) in ["sd_x_m", "sd_y_m", "sd_z_m", "sd_phase"].into_iter().enumerate() {
            set(name, self.column(|r| r.sd[i]))?;
        }
        for side in ["right", "left"] {
            let angles = |r: &Row| if side == "right" { r.posture.right } else { r.posture.left };
            let index = usize::from(side == "left");
            for (joint, name) in ["hip", "knee", "ankle", "shoulder", "elbow"].into_iter().enumerate() {
                let plain =
                    |r: &Row| [angles(r).hip, angles(r).knee, f64::NAN, angles(r).shoulder, angles(r).elbow];
                let measured = |r: &Row| match r.measured {
                    Some(sides) => sides[index].angles[joint].unwrap_or([f64::NAN; 2]),
                    None => [plain(r)[joint], f64::NAN],
                };
                set(&format!("{side}_{name}_deg"), self.column(|r| measured(r)[0].to_degrees()))?;
                set(&format!("sd_{side}_{name}_deg"), self.column(|r| measured(r)[1].to_degrees()))?;
            }
            for (i, joint) in SideJoints::NAMES.into_iter().enumerate() {
                let at = |r: &Row| if side == "right" { r.right.to_array()[i] } else { r.left.to_array()[i] };
                set(&format!("{side}_{joint}_x_m"), self.column(|r| at(r).x))?;
                set(&format!("{side}_{joint}_y_m"), self.column(|r| at(r).y))?;
                set(&format!("{side}_{joint}_z_m"), self.column(|r| at(r).z))?;
                let (u_px, v_px) = self.pixels(at);
                set(&format!("{side}_{joint}_u_px"), u_px)?;
                set(&format!("{side}_{joint}_v_px"), v_px)?;
            }
        }
        set("similarity", self.column(|r| r.similarity))?;
        Ok(dict)
    }

    /// Gait parameters: (parameter, side, value, unit, low, high, n); side "" for both, NaN if unknown.
    #[allow(clippy::type_complexity, reason = "a plain tuple crosses the border best")]
    fn gait_parameters(&self) -> Vec<(&'static str, &'static str, f64, &'static str, f64, f64, usize)> {
        let line = |p: GaitParameter| {
            let side = p.side.map_or("", |side| side.name());
            let [low, high] = p.interval.unwrap_or([f64::NAN; 2]);
            (p.quantity.name(), side, p.value.unwrap_or(f64::NAN), p.quantity.unit(), low, high, p.n)
        };
        self.walk.gait_parameters().into_iter().map(line).collect()
    }

    /// Gait cycles, right then left, each side's mean last: (side, curve, start_s, end_s, values); curve is "cycle",
    /// "partial" or "mean", values are (5, 101, 6): of hip, knee, ankle, shoulder and elbow, at 0 to 100 %, angle,
    /// stated standard deviation, standard deviation over cycles, low and high end of the 95 % interval (degrees), and
    /// number of cycles; NaN if unknown.
    fn cycles<'py>(&self, py: Python<'py>) -> PyResult<Vec<CycleTuple<'py>>> {
        cycles::cycles_of(py, &self.walk)
    }

    /// Joints whose mean cycle is outside of average walking: (side, joint, excess_deg, half of its 95 % interval,
    /// at_percent, share of the cycle); more flexed is positive.
    fn departures(&self) -> Vec<(&'static str, &'static str, f64, f64, usize, f64)> {
        cycles::departures_of(&self.walk)
    }

    /// The record of the walk, as plain numbers: see `Explainer`.
    fn record<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        record_of(py, &self.walk, &self.rows)
    }

    /// Gait events: (time_s, frame, event, side).
    fn events(&self) -> Vec<(f64, f64, &'static str, &'static str)> {
        self.walk.events().into_iter().map(|e| (e.time_s, e.frame, e.kind.name(), e.side.name())).collect()
    }

    /// Best measured hypotheses per frame, (rows, 3): world x of the position along the path and z in metres,
    /// phase; NaN for frames without a measurement.
    fn measured<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let row = |step: &Step| match &step.measured {
            Some(h) => {
                let vertical = self.walk.walk.walker.gait.vertical_m(h.phase);
                [step.look.path.point(h.along_m, 0.0).x, h.height_m + vertical, h.phase]
            }
            None => [f64::NAN; 3],
        };
        numpy_from_rows(py, self.walk.steps().iter().map(row).collect())
    }

    /// Visible contours of the model in a row, in pixels of its frame: (segments, 2, 2), and the body part of each
    /// segment.
    fn contours<'py>(&self, py: Python<'py>, row: usize) -> PyResult<SegmentsWithParts<'py>> {
        if row >= self.rows.len() {
            let message = format!("row {row} of a walk with {}", counted(self.rows.len(), "row"));
            return Err(PyIndexError::new_err(message));
        }
        let mut visible = Vec::new();
        let cylinders = self.walk.pose_of(row, &self.rows[row]).cylinders;
        visible_contours(&cylinders, self.walk.camera.position(), &VisibilityOptions::DRAWN, &mut visible);
        segments_with_parts(py, &visible, &self.walk.camera_of(row))
    }

    /// The starting phase: frames, best phase of each, similarity (frames, phases), and the lines chosen by the
    /// two rules.
    fn start<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let start = &self.walk.start;
        let dict = PyDict::new(py);
        dict.set_item("frame", numpy_from_column(py, start.frames.iter().map(|f| *f as i64).collect()))?;
        dict.set_item("time_s", numpy_from_column(py, start.curves.iter().map(|c| c.time_s).collect()))?;
        dict.set_item("phase", numpy_from_column(py, start.curves.iter().map(|c| c.best_phase()).collect()))?;
        let scores: Vec<Vec<f32>> = start.curves.iter().map(|c| c.scores.clone()).collect();
        dict.set_item("similarity", PyArray2::from_vec2(py, &scores)?)?;
        for (name, line) in [
            ("line", start.lines.best),
            ("twin", start.lines.twin),
            ("other_direction", start.other_direction),
            ("two_line_rule", start.two_line_rule.line),
        ] {
            dict.set_item(name, (line.phase_at_start, line.rate_hz, line.similarity))?;
        }
        dict.set_item("p_other_direction", start.p_other_direction)?;
        Ok(dict)
    }

    /// Number of the person, in order of appearance.
    #[getter]
    fn person(&self) -> usize {
        self.walk.person
    }

    /// Body height, its standard deviation (metres), and where it comes from: "given", "measured" or "assumed".
    #[getter]
    fn height(&self) -> (f64, f64, &'static str) {
        let BodyHeight { height_m, sd_m, source } = self.walk.height;
        (height_m, sd_m, source.name())
    }

    /// Body height and standard deviation that the fit measured in a calibrated camera, metres, also if another was
    /// given; None if it measured none.
    #[getter]
    fn measured_height(&self) -> Option<(f64, f64)> {
        self.walk.fitted()?.height.map(|height| (height.height_m, height.sd_m))
    }

    /// True if the measured height contradicts the given one by more than three standard deviations.
    #[getter]
    fn height_is_contradicted(&self) -> bool {
        self.walk.is_height_contradicted()
    }

    /// Step length over cadence, and the smallest and largest usual for this height, m per step per minute; None for
    /// backward or very short walks.
    #[getter]
    fn walk_ratio(&self) -> Option<(f64, f64, f64)> {
        self.walk.walk_ratio().map(|ratio| (ratio.value, ratio.usual[0], ratio.usual[1]))
    }

    /// Speed of the treadmill's belt with its standard deviation, m/s, and the heading that looks alike from the camera
    /// with its probability (radians; None if there is none); None for a walk over ground.
    #[getter]
    #[allow(clippy::type_complexity, reason = "a plain tuple crosses the border best")]
    fn treadmill(&self) -> Option<(f64, f64, Option<(f64, f64)>)> {
        let Treadmill { belt, mirrored } = self.walk.treadmill()?;
        Some((belt.speed_mps, belt.sd_mps, mirrored.map(|m| (m.heading_rad, m.probability))))
    }

    /// True for a walk towards the camera or away from it, whose place and phase the feet show: left and right stay open,
    /// and the angles are those of average walking.
    #[getter]
    fn is_frontal(&self) -> bool {
        self.walk.is_frontal
    }

    /// The camera, given or assumed.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.walk.camera.clone())
    }

    /// "forward" or "backward".
    #[getter]
    fn direction(&self) -> &'static str {
        match self.walk.direction() {
            Direction::Forward => "forward",
            Direction::Backward => "backward",
        }
    }

    /// Probability that the person walks in the other direction.
    #[getter]
    fn p_other_direction(&self) -> f64 {
        self.walk.start.p_other_direction
    }

    /// Probability that left and right are swapped.
    #[getter]
    fn p_swapped(&self) -> f64 {
        self.walk.p_swapped()
    }

    /// The measured person; None if there was no fit, or if it failed.
    #[getter]
    fn fit(&self, py: Python<'_>) -> PyResult<Option<WalkFit>> {
        self.walk.fitted().map(|fit| WalkFit::of(py, fit)).transpose()
    }

    /// Why no person was measured; None if there is a fit, or if none was asked for.
    #[getter]
    fn fit_problem(&self) -> Option<String> {
        self.walk.fit.as_ref()?.as_ref().err().map(ToString::to_string)
    }

    fn __len__(&self) -> usize {
        self.rows.len()
    }
}
