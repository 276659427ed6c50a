//! `Steadier`: frames of a camera held in the hand, as the camera of the first frame would have seen them.

use crate::array::{frame_from_numpy, numpy_from_image};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::result::{objects, result};
use crate::wait::pooled;
use crate::whole::{Whole, WholeNumbers};
use memo_core::OptionError;
use memo_core::track::steady::{CameraMotion, FieldSeeker, Loss, Reach, Steadied, Steadier, SteadyOptions};
use numpy::PyArray2;
use pyo3::prelude::*;

result! {
    /// The camera in a frame.
    FrameMotion |_py, motion: &CameraMotion| {
        /// Number of the frame, from 0.
        frame: usize,
        /// "still", "turned", "uneven_light", "unknown" or "lost".
        state: String = motion.state.name(),
        /// Rotation vector from the first frame's camera to this one's, radians, camera axes.
        turn_rad: [f64; 3] = motion.turn_rad.to_array(),
        /// Largest displacement of the picture against the first frame, pixels.
        shift_px: f64 = motion.shift_px[0],
        /// Its root mean square over the picture, pixels.
        rms_px: f64 = motion.shift_px[1],
        /// Share of the points that the rotation explains; NaN where none was estimated.
        support: f64,
    }
    |own| format!("frame {}, {}, {:.2} px", own.frame, own.state, own.shift_px)
}

result! {
    /// Where a view of the camera ended.
    LostView |_py, loss: &Loss| {
        /// The first frame of another view.
        frame: usize,
        /// "cut", "zoom" or "other view".
        reason: String = loss.reason.name(),
    }
    |own| format!("{} at frame {}", own.reason, own.frame)
}

result! {
    /// A frame after steadying.
    SteadiedFrame |py, found: &CameraMotion, steadied: Steadied| {
        /// The camera in it.
        motion: Py<FrameMotion> = Py::new(py, FrameMotion::of(py, found)?)?,
        /// (H, W) as the camera of the first frame would have seen it; None if the frame was left as it is.
        picture: Option<Py<PyArray2<u8>>> = match &steadied {
            Steadied::Moved { picture, .. } => Some(numpy_from_image(py, picture.clone())?.unbind()),
            _ => None,
        },
        /// (H, W) pixels that the frame does not show.
        unseen: Option<Py<PyArray2<bool>>> = match &steadied {
            Steadied::Moved { unseen, .. } => Some(numpy_from_image(py, unseen.clone())?.unbind()),
            _ => None,
        },
    }
    |own| own.motion.get().__repr__()
}

/// `reach_px` and `reach_from_rad`.
pub type Wider = ([u32; 4], [f64; 3]);

pub fn wider_of(reach: Reach) -> Wider {
    (reach.px, reach.turn_rad.to_array())
}

/// How far pictures go on beyond frames, of these arguments.
pub fn reach(reach_px: Option<Whole<[u32; 4]>>, reach_from_rad: Option<[f64; 3]>) -> PyResult<Reach> {
    let px = reach_px.must_be("reach_px", "four whole numbers from 0 to 2000")?.unwrap_or_default();
    Ok(Reach { turn_rad: reach_from_rad.unwrap_or_default().into(), px })
}

/// Steadies a stream of frames, as `Tracker` does before it compares them.
#[pyclass(name = "Steadier", module = "memo._memo")]
pub struct PySteadier(Steadier);

#[pymethods]
impl PySteadier {
    /// Without a camera, one of the field of view `fov_deg` is assumed.
    #[new]
    #[pyo3(signature = (camera=None, *, fov_deg=None, still_px=None, reach_px=None, reach_from_rad=None))]
    fn new(
        camera: Option<PyCamera>,
        fov_deg: Option<f64>,
        still_px: Option<f64>,
        reach_px: Option<Whole<[u32; 4]>>,
        reach_from_rad: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        if let Some(got) = fov_deg.filter(|fov_deg| !(5.0..=170.0).contains(fov_deg)) {
            let wanted = "between 5 and 170 degrees";
            return Err(value_error(OptionError { name: "field of view", wanted, got }));
        }
        let mut options = SteadyOptions::default();
        options.still_px = still_px.unwrap_or(options.still_px);
        options.reach = reach(reach_px, reach_from_rad)?;
        options.check().map_err(value_error)?;
        Ok(Self(Steadier::new(options, camera.map(|c| c.0).as_ref(), fov_deg.map(f64::to_radians))))
    }

    /// Takes the next frame, (H, W) uint8.
    fn update(&mut self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<SteadiedFrame> {
        let array = frame_from_numpy(frame)?;
        let frame = array.as_frame()?;
        let steadier = &mut self.0;
        let steadied = pooled(py, || steadier.push(&frame))?.map_err(value_error)?;
        let motion = self.0.motions().back().expect("every frame leaves one");
        SteadiedFrame::of(py, motion, steadied)
    }

    /// Of a camera that pans, the `reach_px` and `reach_from_rad` with which pictures show all of the frames; None if these did.
    fn wider(&self) -> Option<Wider> {
        self.0.wider().map(wider_of)
    }

    /// The views that have ended.
    fn losses(&self, py: Python<'_>) -> PyResult<Vec<Py<LostView>>> {
        objects(py, self.0.losses().iter().map(|loss| LostView::of(py, loss)))
    }
}

/// Measures the field of view of a camera that pans, from a stream of frames.
#[pyclass(name = "FieldSeeker", module = "memo._memo")]
pub struct PyFieldSeeker(FieldSeeker);

#[pymethods]
impl PyFieldSeeker {
    #[new]
    fn new() -> Self {
        Self(FieldSeeker::default())
    }

    /// Takes the next frame, (H, W) uint8. Returns whether further frames add anything.
    fn update(&mut self, py: Python<'_>, frame: &Bound<'_, PyAny>) -> PyResult<bool> {
        let array = frame_from_numpy(frame)?;
        let frame = array.as_frame()?;
        let seeker = &mut self.0;
        pooled(py, || seeker.push(&frame))?.map_err(value_error)?;
        Ok(!self.0.has_all())
    }

    /// The horizontal field of view and its standard deviation, degrees; None if the camera did not pan.
    fn found(&self, py: Python<'_>) -> PyResult<Option<(f64, f64)>> {
        let found = pooled(py, || self.0.found())?;
        Ok(found.map(|field| (field.horizontal_rad.to_degrees(), field.sd_rad.to_degrees())))
    }
}
