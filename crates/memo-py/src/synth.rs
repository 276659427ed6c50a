//! Synthetic scenes.

use crate::array::numpy_from_image;
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::whole::{FROM_0, Whole, WholeNumbers};
use memo_core::model::{SideAngles, SideJoints};
use memo_core::synth::{ClothedOptions, Mover, Pause, SceneOptions};
use memo_core::wording::counted;
use memo_core::{ClothedScene, Image, SynthScene};
use numpy::{PyArray2, PyArray3, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Maximum number of frames: half a day at 25 frames per second.
const MOST_FRAMES: usize = 1_000_000;

/// A seed, and a number of frames of at least `least`.
fn seed_and_frames(seed: Whole<u64>, frames: Whole<usize>, least: usize) -> PyResult<(u64, usize)> {
    let (wanted, range) = (format!("between {least} and {MOST_FRAMES}"), least..=MOST_FRAMES);
    let (seed, frames) = (seed.must_be("seed", FROM_0)?, frames.must_be("frames", &wanted)?);
    if range.contains(&frames) {
        return Ok((seed, frames));
    }
    Err(PyValueError::new_err(format!("frames must be {wanted}, got {frames}")))
}

/// Centre of the torso, phase, and joints (2, 6, 3) or joint angles.
type Truth<T> = ((f64, f64, f64), f64, T);

fn grey_frame(
    py: Python<'_>,
    index: Whole<usize>,
    count: usize,
    draw: impl FnOnce(usize) -> Image<u8> + Send,
) -> PyResult<Bound<'_, PyArray2<u8>>> {
    let index = index.index(count, "frame", &format!("a scene with {}", counted(count, "frame")))?;
    numpy_from_image(py, py.detach(|| draw(index)))
}

fn joints_array(py: Python<'_>, sides: [SideJoints; 2]) -> PyResult<Bound<'_, PyArray3<f64>>> {
    let joints = sides.iter().flat_map(|side| side.to_array()).flat_map(|joint| joint.to_array()).collect();
    numpy::PyArray1::from_vec(py, joints).reshape([2, 6, 3])
}

/// Angles of right hip, knee, shoulder, elbow, then left, degrees.
fn angles_deg(sides: [SideAngles; 2]) -> [f64; 8] {
    let [[a, b, c, d], [e, f, g, h]] = sides.map(|s| [s.hip, s.knee, s.shoulder, s.elbow]);
    [a, b, c, d, e, f, g, h].map(f64::to_degrees)
}

/// A clothed person who walks through a room; body and gait differ from the model's.
#[pyclass(name = "ClothedScene", module = "memo._memo", frozen)]
pub struct PyClothedScene(ClothedScene);

#[pymethods]
impl PyClothedScene {
    #[new]
    #[pyo3(
        signature = (
            seed=Whole::from(0), *, frames=Whole::from(80), noise_sd=None, leftward=None, late_left=None, slant_rad=None,
            turn_rad=0.0, pause_s=None, mover="walker"
        ),
        text_signature = "(seed=0, *, frames=80, noise_sd=None, leftward=None, late_left=None, slant_rad=None, turn_rad=0.0, pause_s=None, mover=\"walker\")"
    )]
    #[allow(clippy::too_many_arguments, reason = "keywords in Python")]
    fn new(
        seed: Whole<u64>,
        frames: Whole<usize>,
        noise_sd: Option<f32>,
        leftward: Option<bool>,
        late_left: Option<f64>,
        slant_rad: Option<f64>,
        turn_rad: f64,
        pause_s: Option<(f64, f64)>,
        mover: &str,
    ) -> PyResult<Self> {
        let (seed, frames) = seed_and_frames(seed, frames, 1)?;
        let mover = match mover {
            "walker" => Mover::Walker,
            "rider" => Mover::Rider,
            "waver" => Mover::Waver,
            "trolley" => Mover::Trolley,
            "treadmill" => Mover::Treadmill,
            _ => {
                let message =
                    format!("mover must be walker, rider, waver, trolley or treadmill, got {mover:?}");
                return Err(PyValueError::new_err(message));
            }
        };
        let options = ClothedOptions {
            seed,
            frames,
            noise_sd,
            leftward,
            late_left,
            slant_rad,
            turn_rad,
            pause: pause_s.map(|(at_s, lasts_s)| Pause { at_s, lasts_s }),
            mover,
            ..ClothedOptions::default()
        };
        ClothedScene::new(options).map(Self).map_err(value_error)
    }

    /// One grey frame, (H, W) uint8.
    fn frame<'py>(&self, py: Python<'py>, index: Whole<usize>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        grey_frame(py, index, self.0.len(), |index| self.0.frame(index))
    }

    /// Time of a frame, seconds.
    fn time_s(&self, index: Whole<usize>) -> PyResult<f64> {
        Ok(self.0.time_s(index.must_be("index", FROM_0)?))
    }

    /// The true state in a frame: torso centre (x, y, z), phase, the 12 joints (2, 6, 3) in the order right then
    /// left shoulder, elbow, wrist, hip, knee, ankle, and the eight joint angles, degrees. None if nobody walks.
    #[allow(clippy::type_complexity, reason = "a plain tuple crosses the border best")]
    fn truth<'py>(
        &self,
        py: Python<'py>,
        index: Whole<usize>,
    ) -> PyResult<Option<Truth<(Bound<'py, PyArray3<f64>>, [f64; 8])>>> {
        let Some(truth) = self.0.truth(index.must_be("index", FROM_0)?) else { return Ok(None) };
        let joints = joints_array(py, [truth.right, truth.left])?;
        Ok(Some((truth.torso_centre.into(), truth.phase, (joints, angles_deg(truth.angles)))))
    }

    /// Direction of the path where the person is in a frame, radians; None if nobody walks.
    fn heading_at(&self, index: Whole<usize>) -> PyResult<Option<f64>> {
        Ok(self.0.truth(index.must_be("index", FROM_0)?).map(|truth| truth.heading_rad))
    }

    /// Initial contacts and toe-offs: time in seconds, kind and side.
    fn contacts(&self) -> Vec<(f64, &'static str, &'static str)> {
        self.0.contacts().iter().map(|c| (c.time_s, c.kind.name(), c.side.name())).collect()
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.0.camera.clone())
    }

    /// Body height of the person, metres.
    #[getter]
    fn height_m(&self) -> f64 {
        self.0.height_m
    }

    /// Mean speed, m/s.
    #[getter]
    fn speed_mps(&self) -> f64 {
        self.0.speed_mps
    }

    /// Direction the body faces, radians about world Z.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.heading_rad
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}

/// A synthetic walker in front of a wall with known parameters; frames are drawn on request.
#[pyclass(name = "Scene", module = "memo._memo", frozen)]
pub struct PyScene(SynthScene);

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(
        signature = (seed=Whole::from(0), *, frames=Whole::from(80), noise_sd=5.0, leftward=None, late_left=0.0),
        text_signature = "(seed=0, *, frames=80, noise_sd=5.0, leftward=None, late_left=0.0)"
    )]
    fn new(
        seed: Whole<u64>,
        frames: Whole<usize>,
        noise_sd: f32,
        leftward: Option<bool>,
        late_left: f64,
    ) -> PyResult<Self> {
        let usual = SceneOptions::default();
        let (seed, frames) = seed_and_frames(seed, frames, usual.empty_frames + 1)?;
        let options = SceneOptions { seed, frames, noise_sd, leftward, late_left, ..usual };
        SynthScene::new(options).map(Self).map_err(value_error)
    }

    /// One grey frame, (H, W) uint8.
    fn frame<'py>(&self, py: Python<'py>, index: Whole<usize>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        grey_frame(py, index, self.0.len(), |index| self.0.frame(index))
    }

    /// Time of a frame, seconds.
    fn time_s(&self, index: Whole<usize>) -> PyResult<f64> {
        Ok(self.0.time_s(index.must_be("index", FROM_0)?))
    }

    /// The true state in a frame: torso centre (x, y, z), phase, the 12 joints (12, 3) in the order right then
    /// left shoulder, elbow, wrist, hip, knee, ankle. None before the walker appears.
    #[allow(clippy::type_complexity, reason = "a plain tuple crosses the border best")]
    fn truth<'py>(
        &self,
        py: Python<'py>,
        index: Whole<usize>,
    ) -> PyResult<Option<Truth<Bound<'py, PyArray3<f64>>>>> {
        let Some(truth) = self.0.truth(index.must_be("index", FROM_0)?) else { return Ok(None) };
        let joints = joints_array(py, [truth.posed.right, truth.posed.left])?;
        Ok(Some((truth.posed.torso_centre.into(), truth.hypothesis.phase, joints)))
    }

    /// Joint angles at a phase, degrees: right hip, knee, shoulder, elbow, then left.
    fn angles_deg(&self, phase: f64) -> [f64; 8] {
        let p = self.0.walker.gait.posture(phase, &self.0.walker.style);
        angles_deg([p.right, p.left])
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

    /// Speed of the walker, m/s.
    #[getter]
    fn speed_mps(&self) -> f64 {
        self.0.speed_mps
    }

    /// Direction the body faces, radians about world Z.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.path.heading_rad
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }
}
