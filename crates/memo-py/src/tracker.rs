//! `Tracker`.

use crate::array::{boxes_from_numpy, frame_from_numpy};
use crate::camera::PyCamera;
use crate::defaults::dict;
use crate::error::{value_error, wrong_type};
use crate::result::{objects, result};
use crate::steady::{FrameMotion, LostView, Wider, reach, wider_of};
use crate::wait::{LOOK, watched};
use crate::walk::Walk;
use crate::whole::{Whole, WholeNumbers};
use memo_core::image::{BackgroundOptions, FlowOptions};
use memo_core::model::DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD;
use memo_core::track::fit::FitOptions;
use memo_core::track::height::{POPULATION_HEIGHT_M, POPULATION_SD_M};
use memo_core::track::left_out::Shot;
use memo_core::track::score::Measure;
use memo_core::track::steady::SteadyOptions;
use memo_core::track::{GaitChoice, Now};
use memo_core::wording::counted;
use memo_core::{Tracker, TrackerOptions};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Tracks everybody who walks through a stream of grey frames; memory does not grow with the length of the stream.
///
/// An interrupted call keeps running in the background: its frame is processed, and the next call waits for it.
#[pyclass(name = "Tracker", module = "memo._memo", frozen)]
pub struct PyTracker(Arc<Shared>);

result! {
    /// Filtered state of a person who is followed.
    WalkerState |_py, now: Now| {
        /// Number of the person, in order of appearance.
        person: usize,
        /// The frame, from 0.
        frame: usize,
        /// Its time, seconds.
        time_s: f64,
        /// Centre of the torso, world metres.
        x_m: f64 = now.torso_centre.x,
        y_m: f64 = now.torso_centre.y,
        z_m: f64 = now.torso_centre.z,
        /// Angle of the body's forward axis about world Z, radians.
        heading_rad: f64,
        /// Gait phase in [0, 1), 0 at right heel strike.
        phase: f64,
        /// Probability that left and right are swapped.
        p_swapped: f64,
        /// Speed along the path, m/s.
        speed_mps: f64,
    }
    |own| {
        let place = format!("({:.2}, {:.2}, {:.2}) m", own.x_m, own.y_m, own.z_m);
        format!("person {} in frame {} at {place}, phase {:.2}", own.person, own.frame, own.phase)
    }
}

result! {
    /// Counts over a stream; if nobody was followed, they show why.
    SeekReport |_py, report: memo_core::track::SeekReport| {
        /// Frames seen.
        frames: usize,
        /// Frames with a moving region large enough for a person.
        frames_with_candidate: usize,
        /// Of these, frames in which the image border cut the region.
        frames_cut_off: usize,
        /// Refused starts: the region moved too slowly, did not fit the height, or did not walk. Walks that were
        /// taken back count too.
        refused_starts: usize,
        /// Frames of a starting phase at the rate of the frames.
        start_frames: usize,
        /// People and things that moved and were not followed.
        left_out: usize,
        /// Frames whose brightness differed suddenly and was made that of the others.
        frames_relit: usize = report.light.frames,
        /// Largest such difference, as a share of the brightness.
        largest_flicker: f64 = report.light.largest,
    }
    |own| format!("{}, {} with a candidate", counted(own.frames, "frame"), own.frames_with_candidate)
}

result! {
    /// Somebody or something that moved and was not followed.
    LeftOut |_py, left: memo_core::track::left_out::LeftOut| {
        /// First and last frame in which it was seen, from 0.
        first_frame: usize = left.first().frame,
        last_frame: usize = left.last().frame,
        /// Their times, seconds.
        start_s: f64 = left.first().time_s,
        end_s: f64 = left.last().time_s,
        /// Number of frames in which it was seen.
        frames: usize,
        /// Why it was not followed.
        reason: String = left.reason.name(),
        /// The figure of the reason: pixels, m/s or frames.
        value: Option<f64> = left.reason.value(),
        /// Frame, left, top, width and height of up to 16 boxes, from the first frame to the last, pixels.
        boxes: Vec<[usize; 5]> = left.shots.iter().map(box_of).collect::<Vec<_>>(),
    }
    |own| format!("frames {} to {}: {}", own.first_frame, own.last_frame, own.reason)
}

fn box_of(shot: &Shot) -> [usize; 5] {
    let r = &shot.rectangle;
    [shot.frame, r.left, r.top, r.width(), r.height()]
}

/// Body heights, metres.
enum Heights {
    Everybody(f64),
    /// Of people in order of appearance.
    Each(Vec<f64>),
}

impl<'py> FromPyObject<'_, 'py> for Heights {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(height_m) = object.extract() {
            return Ok(Self::Everybody(height_m));
        }
        let wanted = "a number of metres or a list with one for each person";
        object.extract().map(Self::Each).map_err(|_| wrong_type("height_m", wanted, &object))
    }
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
        height_m=None, camera=None, *, fov_deg=None, gait=None, adapt=true, start_frames=None, treadmill=None,
        compensate_gain=false, background=false, steady=true, measure=None, full_gradient=None, full_velocity=None,
        part_weights=None, reach_px=None, reach_from_rad=None
    ))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments in Python")]
    fn new(
        height_m: Option<Heights>,
        camera: Option<PyCamera>,
        fov_deg: Option<f64>,
        gait: Option<&str>,
        adapt: bool,
        start_frames: Option<Whole<usize>>,
        treadmill: Option<bool>,
        compensate_gain: bool,
        background: bool,
        steady: bool,
        measure: Option<&str>,
        full_gradient: Option<f32>,
        full_velocity: Option<f32>,
        part_weights: Option<[f32; 14]>,
        reach_px: Option<Whole<[u32; 4]>>,
        reach_from_rad: Option<[f64; 3]>,
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
        options.field_of_view_rad = fov_deg.map(f64::to_radians);
        if let Some(gait) = gait {
            let known = [GaitChoice::Dense, GaitChoice::Sampled10];
            let found = known.into_iter().find(|known| gait_name(*known) == gait);
            let refused = || choice_error("gait", "'dense' or 'sampled_10'", gait);
            options.gait = found.ok_or_else(refused)?;
        }
        options.evidence.change.compensate_gain = compensate_gain;
        options.evidence.background = background.then(BackgroundOptions::default);
        let reach = reach(reach_px, reach_from_rad)?;
        options.steady = steady.then(|| SteadyOptions { reach, ..SteadyOptions::default() });
        options.evidence.flow = full_velocity.map(|_| FlowOptions::default());
        let similarity = &mut options.walk.similarity;
        if let Some(measure) = measure {
            let found = [Measure::Rohr, Measure::Lowe].into_iter().find(|m| measure_name(*m) == measure);
            similarity.measure = found.ok_or_else(|| choice_error("measure", "'rohr' or 'lowe'", measure))?;
        }
        similarity.full_gradient = full_gradient;
        similarity.full_velocity = full_velocity;
        similarity.part_weights = part_weights.unwrap_or(similarity.part_weights);
        options.treadmill = treadmill;
        options.fit = adapt.then(FitOptions::default);
        let start_frames = start_frames.must_be("start_frames", "between 5 and 100")?;
        options.start_frames = start_frames.unwrap_or(options.start_frames);
        let tracker = Mutex::new(Some(Box::new(Tracker::new(options).map_err(value_error)?)));
        Ok(Self(Arc::new(Shared { tracker, returned: Condvar::new(), calls: AtomicU64::new(0) })))
    }

    /// Adds the next frame, (H, W) uint8, and its time in seconds; with the boxes (N, 4) of the people in it, nobody is
    /// looked for elsewhere.
    #[pyo3(signature = (frame, time_s, boxes=None))]
    fn update(
        &self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        time_s: f64,
        boxes: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let image = frame_from_numpy(frame)?.into_image()?;
        let size = [image.width(), image.height()];
        let boxes = boxes.map(|boxes| boxes_from_numpy(boxes, size)).transpose()?;
        let update = move |tracker: &mut Tracker| match boxes {
            None => tracker.update(&image.as_frame(), time_s),
            Some(boxes) => tracker.update_with_boxes(&image.as_frame(), time_s, &boxes),
        };
        self.call(py, update)?.map_err(value_error)
    }

    /// Ends the stream: processes the last frame and ends the current walk.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        self.call(py, Tracker::finish)?.map_err(value_error)
    }

    /// The walks that have ended since the last call.
    fn take_finished(&self, py: Python<'_>) -> PyResult<Vec<Py<Walk>>> {
        let walks = self.read(py, Tracker::take_finished)?;
        objects(py, walks.into_iter().map(|walk| Walk::of_tracked(py, walk)))
    }

    /// Filtered states of everybody who is followed, in order of appearance.
    fn people(&self, py: Python<'_>) -> PyResult<Vec<Py<WalkerState>>> {
        let people = self.read(py, |tracker| tracker.people())?;
        objects(py, people.into_iter().map(|now| WalkerState::of(py, now)))
    }

    /// What was found of the camera in each of the last 25 000 frames; empty with `steady=False`.
    fn camera_motion(&self, py: Python<'_>) -> PyResult<Vec<Py<FrameMotion>>> {
        let motions = self.read(py, |tracker| tracker.camera_motions().cloned().collect::<Vec<_>>())?;
        objects(py, motions.iter().map(|motion| FrameMotion::of(py, motion)))
    }

    /// Of a camera that pans, the `reach_px` and `reach_from_rad` with which a tracker sees all of the frames; None if this one did.
    fn wider(&self, py: Python<'_>) -> PyResult<Option<Wider>> {
        Ok(self.read(py, |tracker| tracker.wider())?.map(wider_of))
    }

    /// Where a view of the camera ended.
    fn lost_views(&self, py: Python<'_>) -> PyResult<Vec<Py<LostView>>> {
        let losses = self.read(py, |tracker| tracker.losses().to_vec())?;
        objects(py, losses.iter().map(|loss| LostView::of(py, loss)))
    }

    /// Who or what moved and was not followed, in order of the first frames; complete after `finish`.
    fn left_out(&self, py: Python<'_>) -> PyResult<Vec<Py<LeftOut>>> {
        let left_out = self.read(py, |tracker| tracker.left_out())?;
        objects(py, left_out.into_iter().map(|left| LeftOut::of(py, left)))
    }

    /// Counts over the whole stream; if nobody was followed, they show why.
    fn seek_report(&self, py: Python<'_>) -> PyResult<SeekReport> {
        SeekReport::of(py, self.read(py, |tracker| tracker.seek_report())?)
    }
}

/// The defaults of a tracker.
pub fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let options = TrackerOptions::default();
    dict!(py, {
        fov_deg: DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD.to_degrees(),
        gait: gait_name(options.gait),
        adapt: options.fit.is_some(),
        start_frames: options.start_frames,
        compensate_gain: options.evidence.change.compensate_gain,
        background: options.evidence.background.is_some(),
        steady: options.steady.is_some(),
        measure: measure_name(options.walk.similarity.measure),
    })
}

/// Body height of the population and its standard deviation, metres: (mean, sd).
#[pyfunction]
pub fn population_height_m() -> (f64, f64) {
    (POPULATION_HEIGHT_M, POPULATION_SD_M)
}

fn gait_name(gait: GaitChoice) -> &'static str {
    match gait {
        GaitChoice::Dense => "dense",
        GaitChoice::Sampled10 => "sampled_10",
    }
}

fn measure_name(measure: Measure) -> &'static str {
    match measure {
        Measure::Rohr => "rohr",
        Measure::Lowe => "lowe",
    }
}

pub(crate) fn choice_error(name: &str, wanted: &str, got: &str) -> PyErr {
    PyValueError::new_err(format!("{name} must be {wanted}, got {got:?}"))
}
