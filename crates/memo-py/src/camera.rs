//! `Camera`.

use crate::array::{numpy_from_column, numpy_from_rows, numpy_of_shape, vectors_from_numpy};
use crate::error::value_error;
use crate::whole::{A_SIZE, Size, Whole, WholeNumbers, size_px};
use glam::{DMat3, DVec2, DVec3};
use memo_core::Camera;
use memo_core::model::{
    CameraFileError, CameraFileOptions, Distortion, FootPosition, LengthUnit, Midpoints, PositionError,
    PositionOptions, TsaiParameters, position_from_rectangle, position_on_ground,
};
use memo_core::wording::counted;
use numpy::{PyArray1, PyArray2, PyArrayDyn};
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A calibrated camera: OpenCV axes, world Z up, metres.
#[pyclass(name = "Camera", module = "memo", frozen, eq, from_py_object)]
#[derive(Clone, PartialEq)]
pub struct PyCamera(pub Camera);

/// All parameters of a camera, to the last bit, for pickling: size, (fx, fy), (cx, cy), lens with its
/// coefficients, the rotation column by column, translation.
type Parameters = ((u32, u32), (f64, f64), (f64, f64), (String, Vec<f64>), Vec<f64>, (f64, f64, f64));

const POINTS: &str = "wanted points: numpy array of shape (..., 3)";

/// The camera from the parameters of `Camera.__reduce__`.
#[pyfunction(name = "_camera")]
pub fn camera_of_parameters(
    size: Size,
    focal_px: (f64, f64),
    centre_px: (f64, f64),
    lens: (String, Vec<f64>),
    rotation: Vec<f64>,
    translation_m: (f64, f64, f64),
) -> PyResult<PyCamera> {
    let distortion = match (lens.0.as_str(), lens.1.as_slice()) {
        ("none", []) => Distortion::None,
        ("brown", &[k1, k2, p1, p2, k3]) => Distortion::Brown { k1, k2, p1, p2, k3 },
        ("tsai", &[kappa]) => Distortion::Tsai { kappa },
        (name, coefficients) => {
            let message = format!("no lens {name:?} with {}", counted(coefficients.len(), "coefficient"));
            return Err(PyValueError::new_err(message));
        }
    };
    let Ok(rotation) = <[f64; 9]>::try_from(rotation) else {
        return Err(PyValueError::new_err("the rotation must have 9 elements"));
    };
    let camera = Camera {
        size: size_px(size)?,
        focal_px: focal_px.into(),
        centre_px: centre_px.into(),
        distortion,
        rotation: DMat3::from_cols_array(&rotation),
        translation: translation_m.into(),
    };
    camera.validated().map(PyCamera).map_err(value_error)
}

#[pymethods]
impl PyCamera {
    /// From K (3, 3), R and t of x_camera = R x_world + t, t in metres, as OpenCV's `calibrateCamera` and `solvePnP`
    /// give them: `rotation` is R (3, 3) or the vector of axis times angle (3,), `distortion` k1, k2, p1, p2 and k3.
    #[new]
    #[pyo3(signature = (matrix, rotation, translation, size, *, distortion=None))]
    fn new(
        matrix: &Bound<'_, PyAny>,
        rotation: &Bound<'_, PyAny>,
        translation: &Bound<'_, PyAny>,
        size: Size,
        distortion: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let k = square(matrix, "matrix")?;
        if k[1][0] != 0.0 || k[2] != [0.0, 0.0, 1.0] || k[0][1] != 0.0 {
            let message = format!("matrix must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {k:?}");
            return Err(PyValueError::new_err(message));
        }
        let numbers = flat(rotation, "rotation")?;
        let rotation = match numbers.len() {
            3 => Camera::rotation_of_vector(DVec3::from_slice(&numbers)),
            _ => {
                let [x, y, z] = square(rotation, "rotation")?;
                DMat3::from_cols_array_2d(&[x, y, z]).transpose()
            }
        };
        let t = flat(translation, "translation")?;
        let Ok(translation) = <[f64; 3]>::try_from(t.as_slice()) else {
            return Err(PyValueError::new_err(format!("translation must be 3 numbers, got {}", t.len())));
        };
        let lens = distortion.map_or(Ok(vec![0.0; 5]), |lens| flat(lens, "distortion"))?;
        let coefficients = match *lens.as_slice() {
            [k1, k2, p1, p2] => [k1, k2, p1, p2, 0.0],
            [k1, k2, p1, p2, k3] => [k1, k2, p1, p2, k3],
            _ => {
                let message = format!(
                    "distortion must be 4 or 5 coefficients (k1, k2, p1, p2, k3), got {}",
                    lens.len()
                );
                return Err(PyValueError::new_err(message));
            }
        };
        let camera = Camera {
            size: size_px(size)?,
            focal_px: DVec2::new(k[0][0], k[1][1]),
            centre_px: DVec2::new(k[0][2], k[1][2]),
            distortion: Distortion::from_opencv(coefficients),
            rotation,
            translation: DVec3::from_array(translation),
        };
        camera.validated().map(Self).map_err(value_error)
    }

    /// K of pixels: [[fx, 0, cx], [0, fy, cy], [0, 0, 1]].
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Camera { focal_px: f, centre_px: c, .. } = &self.0;
        numpy_from_rows(py, vec![[f.x, 0.0, c.x], [0.0, f.y, c.y], [0.0, 0.0, 1.0]])
    }

    /// R of x_camera = R x_world + t, (3, 3).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        numpy_from_rows(py, self.0.rotation.transpose().to_cols_array_2d().to_vec())
    }

    /// t of x_camera = R x_world + t, metres, (3,).
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        numpy_from_column(py, self.0.translation.to_array().to_vec())
    }

    /// Reads a Pose2Sim/anipose TOML file; `name` chooses one of several cameras.
    #[staticmethod]
    #[pyo3(signature = (path, name=None))]
    fn from_toml(path: std::path::PathBuf, name: Option<&str>) -> PyResult<Self> {
        let unreadable = |error| pyo3::exceptions::PyOSError::new_err(format!("{}: {error}", path.display()));
        let text = std::fs::read_to_string(&path).map_err(unreadable)?;
        let camera = Camera::from_toml_str(&text, name);
        camera.map(Self).map_err(|error| PyValueError::new_err(format!("{}: {error}", path.display())))
    }

    /// Reads a calibration: TOML (Pose2Sim, anipose), YAML, JSON or XML (OpenCV, ROS), XML with Tsai's
    /// parameters, or a table of DLT coefficients. `name` chooses one of several cameras. `unit` of lengths is
    /// "m", "cm" or "mm". `size` is the image size if the file does not give it. `v_up` tells whether v of DLT
    /// coefficients increases upward.
    #[staticmethod]
    /// With `lens_only` the file needs no rotation and translation; those of the result are not valid.
    #[pyo3(signature = (path, name=None, unit=None, *, size=None, v_up=None, lens_only=false))]
    fn from_file(
        path: std::path::PathBuf,
        name: Option<&str>,
        unit: Option<&str>,
        size: Option<Size>,
        v_up: Option<bool>,
        lens_only: bool,
    ) -> PyResult<Self> {
        let wrong_unit =
            |unit| PyValueError::new_err(format!("wanted unit \"m\", \"cm\" or \"mm\"; got {unit:?}"));
        let of_name = |unit| LengthUnit::from_name(unit).ok_or_else(|| wrong_unit(unit));
        let options = CameraFileOptions {
            name,
            unit: unit.map(of_name).transpose()?,
            size: size.map(size_px).transpose()?,
            is_lens_only: lens_only,
            v_up,
        };
        Camera::from_file(&path, &options).map(Self).map_err(|error| match error {
            CameraFileError::Read { .. } => PyOSError::new_err(error.to_string()),
            error => PyValueError::new_err(format!("{}: {error}", path.display())),
        })
    }

    /// Writes the camera as a section `[name]` of a TOML file, in the format of Pose2Sim and anipose.
    #[pyo3(signature = (path, name="cam"))]
    fn to_toml(&self, py: Python<'_>, path: std::path::PathBuf, name: &str) -> PyResult<()> {
        let text = self.0.to_toml_string(name).map_err(value_error)?;
        py.import("memo.unfinished")?.getattr("write_complete")?.call1((path, text))?;
        Ok(())
    }

    /// Distance in pixels between a point (x, y, z) and the point `height_m` above it, without distortion; NaN if
    /// the camera does not see both.
    fn pixel_height(&self, point: (f64, f64, f64), height_m: f64) -> f64 {
        self.0.pixel_height_at(DVec3::from(point), height_m).unwrap_or(f64::NAN)
    }

    /// A camera from Tsai's parameters, lengths in mm, angles in radians.
    #[staticmethod]
    #[pyo3(signature = (*, size, pixel_mm, focal_mm, kappa1_per_mm2, centre_px, sx, translation_mm, rotation_rad))]
    #[allow(clippy::too_many_arguments, reason = "Tsai's model has this many parameters")]
    fn from_tsai(
        size: Size,
        pixel_mm: (f64, f64),
        focal_mm: f64,
        kappa1_per_mm2: f64,
        centre_px: (f64, f64),
        sx: f64,
        translation_mm: (f64, f64, f64),
        rotation_rad: (f64, f64, f64),
    ) -> PyResult<Self> {
        let tsai = TsaiParameters {
            size: size_px(size)?,
            pixel_mm: DVec2::from(pixel_mm),
            focal_mm,
            kappa1_per_mm2,
            centre_px: DVec2::from(centre_px),
            sx,
            translation_mm: DVec3::from(translation_mm),
            rotation_rad: DVec3::from(rotation_rad),
        };
        Camera::from_tsai(&tsai).map(Self).map_err(value_error)
    }

    /// A level camera without distortion that looks along world Y. The origin is on the ground, `distance_m` in
    /// front of it.
    #[staticmethod]
    fn level(size: Size, fov_deg: f64, camera_height_m: f64, distance_m: f64) -> PyResult<Self> {
        Camera::level(size_px(size)?, fov_deg.to_radians(), camera_height_m, distance_m)
            .map(Self)
            .map_err(value_error)
    }

    /// A camera from the result of `parameters`.
    #[staticmethod]
    pub fn from_parameters(parameters: &Bound<'_, PyDict>) -> PyResult<Self> {
        let matrix: [[f64; 3]; 3] = parameter(parameters, "matrix")?;
        let coefficients: [f64; 5] = parameter(parameters, "distortions")?;
        let kappa: Option<f64> = parameters.get_item("tsai_kappa")?.map(|k| k.extract()).transpose()?;
        let turn = DVec3::from_array(parameter(parameters, "rotation")?);
        let camera = Camera {
            size: parameter::<[Whole<u32>; 2]>(parameters, "size")?.must_be("camera: size", A_SIZE)?,
            focal_px: DVec2::new(matrix[0][0], matrix[1][1]),
            centre_px: DVec2::new(matrix[0][2], matrix[1][2]),
            distortion: kappa
                .map_or_else(|| Distortion::from_opencv(coefficients), |kappa| Distortion::Tsai { kappa }),
            rotation: Camera::rotation_of_vector(turn),
            translation: DVec3::from_array(parameter(parameters, "translation")?),
        };
        camera.validated().map(Self).map_err(value_error)
    }

    /// The camera for the same images with `n` by `n` pixels averaged to one, as in `VideoReader` with
    /// `shrink=n`.
    fn shrunk(&self, n: Whole<u32>) -> PyResult<Self> {
        let n = n.must_be("n", "between 1 and the shorter side of the pictures")?;
        self.0.shrunk(n).map(Self).map_err(value_error)
    }

    /// The parameters as in a section of a Pose2Sim TOML file: `size`, `matrix`, `distortions` (k1, k2, p1, p2,
    /// k3), `rotation` (axis times angle), `translation` (metres). For Tsai's lens `distortions` is the best
    /// approximation over the image, or zeros if there is none, and `tsai_kappa` is the exact coefficient.
    pub fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Camera { size, focal_px: f, centre_px: c, distortion, translation, .. } = &self.0;
        let dict = PyDict::new(py);
        dict.set_item("size", size)?;
        dict.set_item("matrix", [[f.x, 0.0, c.x], [0.0, f.y, c.y], [0.0, 0.0, 1.0]])?;
        dict.set_item("distortions", self.0.nearest_opencv_lens().coefficients)?;
        dict.set_item("rotation", self.0.rotation_vector().to_array())?;
        dict.set_item("translation", translation.to_array())?;
        if let Distortion::Tsai { kappa } = *distortion {
            dict.set_item("tsai_kappa", kappa)?;
        }
        Ok(dict)
    }

    /// Image width and height, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.0.size.into()
    }

    /// The centre of projection in world axes, metres.
    #[getter]
    fn position(&self) -> (f64, f64, f64) {
        self.0.position().into()
    }

    /// Pixels (N, 2) of world points (N, 3); NaN for points the camera does not see.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (points, shape) = vectors_from_numpy(points, POINTS)?;
        let pixel = |p: [f64; 3]| self.0.project(DVec3::from(p)).unwrap_or(DVec2::NAN).to_array();
        numpy_of_shape(py, points.into_iter().map(pixel), shape)
    }

    /// World points (N, 3) in the camera's axes, metres: x right, y down, z forward.
    fn camera_from_world<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (points, shape) = vectors_from_numpy(points, POINTS)?;
        let in_camera = |p: [f64; 3]| self.0.camera_from_world(DVec3::from(p)).to_array();
        numpy_of_shape(py, points.into_iter().map(in_camera), shape)
    }

    /// Points (N, 3) at which the rays of pixels (N, 2) meet the plane `z_m` metres above the ground; NaN for
    /// rays that do not meet it.
    #[pyo3(signature = (pixels, z_m=0.0))]
    fn ground_points<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
        z_m: f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (pixels, shape) = vectors_from_numpy(pixels, "wanted pixels: numpy array of shape (..., 2)")?;
        let point = |pixel: [f64; 2]| {
            let ideal = self.0.undistort(DVec2::from(pixel)).ok();
            ideal.and_then(|p| self.0.point_at_height(p, z_m)).unwrap_or(DVec3::NAN).to_array()
        };
        numpy_of_shape(py, pixels.into_iter().map(point), shape)
    }

    /// Position (x, y, z), metres, of a person of known height from the bounding rectangle: eq. (6). Depth
    /// depends on the rectangle's height. The ground is not used, so z shows how well camera, height and
    /// rectangle agree.
    fn position_from_rectangle(
        &self,
        bottom_px: (f64, f64),
        top_px: (f64, f64),
        height_m: f64,
    ) -> PyResult<(f64, f64, f64)> {
        self.standing_point(position_from_rectangle, bottom_px, top_px, height_m)
    }

    /// As `position_from_rectangle`, but by least squares with the soles on the ground z = 0.
    fn position_on_ground(
        &self,
        bottom_px: (f64, f64),
        top_px: (f64, f64),
        height_m: f64,
    ) -> PyResult<(f64, f64, f64)> {
        self.standing_point(position_on_ground, bottom_px, top_px, height_m)
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, Parameters)> {
        let camera = &slf.get().0;
        let lens = match camera.distortion {
            Distortion::None => ("none", vec![]),
            Distortion::Brown { k1, k2, p1, p2, k3 } => ("brown", vec![k1, k2, p1, p2, k3]),
            Distortion::Tsai { kappa } => ("tsai", vec![kappa]),
        };
        let restore = slf.py().import("memo._memo")?.getattr("_camera")?.unbind();
        let parameters = (
            camera.size.into(),
            camera.focal_px.into(),
            camera.centre_px.into(),
            (lens.0.to_owned(), lens.1),
            camera.rotation.to_cols_array().to_vec(),
            camera.translation.into(),
        );
        Ok((restore, parameters))
    }

    fn __repr__(&self) -> String {
        let [width, height] = self.0.size;
        let p = self.0.position();
        format!(
            "Camera({width}x{height}, f={:.0} px, at ({:.2}, {:.2}, {:.2}) m)",
            self.0.focal_px.x, p.x, p.y, p.z
        )
    }
}

/// The numbers of an array of any shape, row by row.
fn flat(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let numbers = object.py().import("numpy")?.call_method1("ravel", (object,))?;
    let kind: char = numbers.getattr("dtype")?.getattr("kind")?.extract()?;
    if !matches!(kind, 'f' | 'i' | 'u') {
        return Err(PyTypeError::new_err(format!(
            "{name} must be numbers, got {}",
            object.get_type().name()?
        )));
    }
    numbers.call_method1("astype", ("float64",))?.extract()
}

fn square(object: &Bound<'_, PyAny>, name: &str) -> PyResult<[[f64; 3]; 3]> {
    let (rows, _) = vectors_from_numpy::<3>(object, &format!("wanted {name}: numpy array of shape (3, 3)"))?;
    let count = counted(rows.len(), "row");
    let refused =
        |_| PyValueError::new_err(format!("wanted {name}: numpy array of shape (3, 3); got {count}"));
    <[[f64; 3]; 3]>::try_from(rows).map_err(refused)
}

fn parameter<'py, T: FromPyObjectOwned<'py>>(parameters: &Bound<'py, PyDict>, key: &str) -> PyResult<T> {
    let item = parameters.get_item(key)?;
    let item = item.ok_or_else(|| PyValueError::new_err(format!("camera: {key} is missing")))?;
    item.extract::<T>().map_err(|error| {
        let error: PyErr = error.into();
        PyValueError::new_err(format!("camera: {key}: {error}"))
    })
}

/// A function that computes a position from the midpoints of a rectangle.
type PositionFn = fn(&Camera, &Midpoints, f64, &PositionOptions) -> Result<FootPosition, PositionError>;

impl PyCamera {
    fn standing_point(
        &self,
        find: PositionFn,
        bottom_px: (f64, f64),
        top_px: (f64, f64),
        height_m: f64,
    ) -> PyResult<(f64, f64, f64)> {
        let midpoints =
            Midpoints::undistorted(&self.0, bottom_px.into(), top_px.into()).map_err(value_error)?;
        let found = find(&self.0, &midpoints, height_m, &PositionOptions::default()).map_err(value_error)?;
        Ok(found.point_in_world.into())
    }
}
