//! Synthetic scenes.

use crate::array::numpy_from_image;
use crate::camera::PyCamera;
use crate::error::value_error;
use memo_core::synth::{SceneOptions, SynthScene};
use numpy::{PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;

/// Half a day at 25 frames per second.
const MOST_FRAMES: usize = 1_000_000;

/// A walker before a wall with everything known; frames are drawn when asked for.
#[pyclass(name = "Scene", module = "memo._memo", frozen)]
pub struct PyScene(SynthScene);

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (seed=0, *, frames=80, noise_sd=5.0, leftward=None, late_left=0.0))]
    fn new(
        seed: u64,
        frames: usize,
        noise_sd: f32,
        leftward: Option<bool>,
        late_left: f64,
    ) -> PyResult<Self> {
        let options = SceneOptions { seed, frames, noise_sd, leftward, late_left, ..SceneOptions::default() };
        let least = options.empty_frames + 1;
        if !(least..=MOST_FRAMES).contains(&frames) {
            let message = format!("frames must be between {least} and {MOST_FRAMES}, got {frames}");
            return Err(PyValueError::new_err(message));
        }
        SynthScene::new(options).map(Self).map_err(value_error)
    }

    /// One grey frame, (H, W) uint8.
    fn frame<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyArray2<u8>>> {
        if index >= self.0.len() {
            return Err(PyIndexError::new_err(format!(
                "frame {index} of a scene with {} frames",
                self.0.len()
            )));
        }
        let image = py.detach(|| self.0.frame(index));
        numpy_from_image(py, image)
    }

    /// Time of a frame, seconds.
    fn time_s(&self, index: usize) -> f64 {
        self.0.time_s(index)
    }

    /// The truth of a frame: torso centre (x, y, z), phase, the 12 joints (12, 3) in the order right then
    /// left shoulder, elbow, wrist, hip, knee, ankle; None before the walker is there.
    #[allow(clippy::type_complexity, reason = "a plain tuple crosses the border best")]
    fn truth<'py>(
        &self,
        py: Python<'py>,
        index: usize,
    ) -> PyResult<Option<((f64, f64, f64), f64, Bound<'py, PyArray3<f64>>)>> {
        let Some(truth) = self.0.truth(index) else { return Ok(None) };
        let joints: Vec<f64> = [truth.posed.right, truth.posed.left]
            .iter()
            .flat_map(|side| side.to_array())
            .flat_map(|joint| joint.to_array())
            .collect();
        let joints = numpy::PyArray1::from_vec(py, joints).reshape([2, 6, 3])?;
        Ok(Some((truth.posed.torso_centre.into(), truth.hypothesis.phase, joints)))
    }

    /// Joint angles of a phase, degrees: right hip, knee, shoulder, elbow, then left.
    fn angles_deg(&self, phase: f64) -> [f64; 8] {
        let p = self.0.walker.gait.posture(phase, &self.0.walker.style);
        let side = |s: memo_core::model::SideAngles| [s.hip, s.knee, s.shoulder, s.elbow];
        let ([a, b, c, d], [e, f, g, h]) = (side(p.right), side(p.left));
        [a, b, c, d, e, f, g, h].map(f64::to_degrees)
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.0.camera.clone())
    }

    /// Body height of the walker, metres.
    #[getter]
    fn height_m(&self) -> f64 {
        self.0.walker.body.height_m
    }

    /// Speed of the walker, metres a second.
    #[getter]
    fn speed_mps(&self) -> f64 {
        self.0.speed_mps
    }

    /// Direction faced, radians.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.path.heading_rad
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}
