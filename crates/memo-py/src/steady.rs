//! `Steadier`: frames of a camera held in the hand, as the camera of the first frame would have seen them.

use crate::array::{frame_from_numpy, numpy_from_image};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::wait::pooled;
use memo_core::model::DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD;
use memo_core::option_error::OptionError;
use memo_core::track::steady::{CameraMotion, Loss, Steadied, Steadier, SteadyOptions};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The camera in a frame: (frame, state, turn_rad, shift_px, rms_px, support).
pub type MotionTuple = (usize, &'static str, [f64; 3], f64, f64, f64);

/// The columns of `camera_motion.csv` for one frame.
pub fn motion_tuple(motion: &CameraMotion) -> MotionTuple {
    let [shift_px, rms_px] = motion.shift_px;
    (motion.frame, motion.state.name(), motion.turn_rad.to_array(), shift_px, rms_px, motion.support)
}

/// The end of a view: its first frame that is another one, and what happened.
pub fn loss_tuple(loss: &Loss) -> (usize, &'static str) {
    (loss.frame, loss.reason.name())
}

/// Steadies a stream of frames, as `Tracker` does before it compares them.
#[pyclass(name = "Steadier", module = "memo._memo")]
pub struct PySteadier(Steadier);

#[pymethods]
impl PySteadier {
    /// Without a camera, one of the field of view `fov_deg` is assumed.
    #[new]
    #[pyo3(signature = (camera=None, *, fov_deg=None, still_px=None))]
    fn new(camera: Option<PyCamera>, fov_deg: Option<f64>, still_px: Option<f64>) -> PyResult<Self> {
        let field_of_view_rad = fov_deg.map_or(DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD, f64::to_radians);
        let fov_deg = field_of_view_rad.to_degrees();
        if !(5.0..=170.0).contains(&fov_deg) {
            let wanted = "between 5 and 170 degrees";
            return Err(value_error(OptionError { name: "field of view", wanted, got: fov_deg }));
        }
        let mut options = SteadyOptions::default();
        options.still_px = still_px.unwrap_or(options.still_px);
        options.check().map_err(value_error)?;
        Ok(Self(Steadier::new(options, camera.map(|c| c.0).as_ref(), field_of_view_rad)))
    }

    /// Takes the next frame, (H, W) uint8: a dict of `frame`, `state`, `turn_rad`, `shift_px`, `rms_px`, `support`, and
    /// of a frame that was steadied also `picture` (H, W) and `unseen`, the pixels that the frame does not show.
    fn update<'py>(&mut self, py: Python<'py>, frame: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
        let array = frame_from_numpy(frame)?;
        let frame = array.as_frame()?;
        let steadier = &mut self.0;
        let steadied = pooled(py, || steadier.push(&frame))?.map_err(value_error)?;
        let motion = self.0.motions().back().expect("every frame leaves one");
        let (frame, state, turn_rad, shift_px, rms_px, support) = motion_tuple(motion);
        let dict = PyDict::new(py);
        dict.set_item("frame", frame)?;
        dict.set_item("state", state)?;
        dict.set_item("turn_rad", turn_rad)?;
        dict.set_item("shift_px", shift_px)?;
        dict.set_item("rms_px", rms_px)?;
        dict.set_item("support", support)?;
        if let Steadied::Moved { picture, unseen } = steadied {
            dict.set_item("picture", numpy_from_image(py, picture)?)?;
            dict.set_item("unseen", numpy_from_image(py, unseen)?)?;
        }
        Ok(dict)
    }

    /// The views that have ended: (first frame of another view, "cut", "zoom" or "other view").
    fn losses(&self) -> Vec<(usize, &'static str)> {
        self.0.losses().iter().map(loss_tuple).collect()
    }
}
