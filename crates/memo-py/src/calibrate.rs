//! Calibration from measured points and from a walker.

use crate::array::{
    motion_from_numpy, numpy_from_column, numpy_from_rows, pixels_from_numpy, points_from_numpy,
};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::result::result;
use crate::whole::{Size, size_px};
use glam::{DVec2, DVec3};
use memo_core::calibrate::{
    Estimate, KnownLens, PointOptions, WalkerOptions, WalkerSighting, sightings_from_joints,
};
use memo_core::wording::counted;
use memo_core::{camera_from_points, camera_from_walker};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

result! {
    /// A camera calibrated from measured points, and its uncertainty.
    PointCalibration |py, found: memo_core::calibrate::PointCalibration| {
        /// The camera.
        camera: PyCamera = PyCamera(found.camera),
        /// Value and standard deviation of what was fitted: `focal_px`, `centre_u_px`, `centre_v_px`, `k1`, `k2`, and
        /// the camera's position `x_m`, `y_m`, `z_m`. Standard deviations are NaN if there are as many equations as
        /// unknowns.
        estimates: Py<PyDict> = estimates(py, &found.estimates)?,
        /// Covariance (n, n) of the fitted parameters: those of the lens as in `estimates`, but with the logarithm of
        /// the focal length, then the rotation (a vector in camera axes, radians) and the translation, metres.
        covariance: Py<PyArray2<f64>> =
            numpy_from_column(py, found.covariance.as_slice().to_vec()).reshape(found.covariance.shape())?,
        /// Projected minus given pixel of every point, (N, 2).
        residuals_px: Py<PyArray2<f64>> = residuals(py, &found.residuals_px)?,
        /// Indices of the points left out, from 0.
        outliers: Vec<usize>,
        /// Root mean square distance of projected and given pixels, over the points not left out.
        rms_px: f64,
        /// Standard deviation of a pixel coordinate, estimated from the residuals.
        noise_px: f64,
        /// Number of equations minus number of unknowns.
        degrees_of_freedom: usize,
        /// Whether all points lie in one plane.
        is_planar: bool,
    }
    |own| format!("{:.3} px RMS, {} left out", own.rms_px, counted(own.outliers.len(), "point"))
}

result! {
    /// A camera calibrated from a walker, and its uncertainty. The origin is on the ground below the mean position of
    /// the person, Y is the viewing direction.
    WalkerCalibration |py, found: memo_core::calibrate::WalkerCalibration| {
        /// The camera.
        camera: PyCamera = PyCamera(found.camera),
        /// Value and standard deviation of `focal_px` unless it was given, `pitch_deg` (down), `roll_deg`, and
        /// `height_m` of the camera.
        estimates: Py<PyDict> = estimates(py, &found.estimates)?,
        /// Fitted minus measured head of every sighting (N, 2), pixels; NaN where the feet are above the horizon.
        residuals_px: Py<PyArray2<f64>> = residuals(py, &found.residuals_px)?,
        /// Indices of the sightings left out, from 0.
        outliers: Vec<usize>,
        /// Root mean square of the residuals of the other sightings.
        rms_px: f64,
        /// Median distance between head and feet.
        person_px: f64,
        /// Number of consecutive sightings with similar errors.
        alike: f64,
        /// Where the person stood (N, 3), world axes, metres; NaN where the feet are above the horizon.
        places: Py<PyArray2<f64>> = numpy_from_rows(py, found.places.iter().map(|p| p.to_array()).collect())?,
    }
    |own| format!("{:.3} px RMS, {} left out", own.rms_px, counted(own.outliers.len(), "sighting"))
}

/// The camera that projects points (N, 3), metres, to pixels (N, 2).
#[pyfunction]
#[pyo3(signature = (places, pixels, size, *, focal_px=None, lens=None))]
pub fn calibrate_points(
    py: Python<'_>,
    places: &Bound<'_, PyAny>,
    pixels: &Bound<'_, PyAny>,
    size: Size,
    focal_px: Option<f64>,
    lens: Option<PyCamera>,
) -> PyResult<PointCalibration> {
    let places: Vec<DVec3> = points_from_numpy(places)?.into_iter().map(DVec3::from).collect();
    let pixels = pixels_from_numpy(pixels)?;
    let options = PointOptions { size: size_px(size)?, lens: known_lens(focal_px, lens)? };
    let found = py.detach(|| camera_from_points(&places, &pixels, &options)).map_err(value_error)?;
    PointCalibration::of(py, found)
}

/// The camera that sees a person of `height_m` with feet (N, 2) and heads (N, 2), pixels in order of time. The
/// shares (N,) are the heights of the two points above the ground, relative to the body height: 0 and 1 for soles
/// and crown.
#[pyfunction]
#[pyo3(signature = (feet, heads, size, height_m, *, foot_share=None, head_share=None, focal_px=None, lens=None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn calibrate_walker(
    py: Python<'_>,
    feet: &Bound<'_, PyAny>,
    heads: &Bound<'_, PyAny>,
    size: Size,
    height_m: f64,
    foot_share: Option<Vec<f64>>,
    head_share: Option<Vec<f64>>,
    focal_px: Option<f64>,
    lens: Option<PyCamera>,
) -> PyResult<WalkerCalibration> {
    let (feet, heads) = (pixels_from_numpy(feet)?, pixels_from_numpy(heads)?);
    let shares = |given: Option<Vec<f64>>, usual| given.unwrap_or_else(|| vec![usual; feet.len()]);
    let (foot_share, head_share) = (shares(foot_share, 0.0), shares(head_share, 1.0));
    let lengths = [heads.len(), foot_share.len(), head_share.len()];
    if lengths != [feet.len(); 3] {
        let message = format!(
            "heads, foot_share and head_share must be as many as feet ({}), got {lengths:?}",
            feet.len()
        );
        return Err(PyValueError::new_err(message));
    }
    let sighting = |i: usize| WalkerSighting {
        foot_px: feet[i],
        head_px: heads[i],
        foot_share: foot_share[i],
        head_share: head_share[i],
    };
    let sightings: Vec<WalkerSighting> = (0..feet.len()).map(sighting).collect();
    let options = WalkerOptions { size: size_px(size)?, height_m, lens: known_lens(focal_px, lens)? };
    let found = py.detach(|| camera_from_walker(&sightings, &options)).map_err(value_error)?;
    WalkerCalibration::of(py, found)
}

/// Feet and heads of a person from joints over time (T, K, 2): feet (N, 2), heads (N, 2), and the heights of both
/// as shares of the body height, (N,) each.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "four arrays")]
pub fn walker_sightings<'py>(
    py: Python<'py>,
    names: Vec<String>,
    points: &Bound<'py, PyAny>,
) -> PyResult<(
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
)> {
    let (flat, _, joints) = motion_from_numpy::<2>(points)?;
    if joints != names.len() {
        return Err(PyValueError::new_err(format!(
            "{} for {}",
            counted(names.len(), "name"),
            counted(joints, "joint")
        )));
    }
    let rows: Vec<Vec<DVec2>> =
        flat.chunks(joints.max(1)).map(|row| row.iter().copied().map(DVec2::from).collect()).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let found = sightings_from_joints(&names, &rows);
    let rows = |of: fn(&WalkerSighting) -> DVec2| found.iter().map(|s| of(s).to_array()).collect();
    let column = |of: fn(&WalkerSighting) -> f64| found.iter().map(of).collect();
    Ok((
        numpy_from_rows(py, rows(|s| s.foot_px))?,
        numpy_from_rows(py, rows(|s| s.head_px))?,
        numpy_from_column(py, column(|s| s.foot_share)),
        numpy_from_column(py, column(|s| s.head_share)),
    ))
}

fn known_lens(focal_px: Option<f64>, lens: Option<PyCamera>) -> PyResult<KnownLens> {
    match (focal_px, lens) {
        (Some(_), Some(_)) => Err(PyValueError::new_err("lens already holds the focal length")),
        (Some(focal_px), None) => Ok(KnownLens::Focal(focal_px)),
        (None, Some(PyCamera(camera))) => Ok(KnownLens::All {
            focal_px: camera.focal_px,
            centre_px: camera.centre_px,
            distortion: camera.distortion,
        }),
        (None, None) => Ok(KnownLens::Nothing),
    }
}

/// (value, standard deviation) by name.
fn estimates<'py>(py: Python<'py>, estimates: &[Estimate]) -> PyResult<Bound<'py, PyDict>> {
    estimates.iter().map(|estimate| (estimate.name, (estimate.value, estimate.sd))).into_py_dict(py)
}

fn residuals<'py>(py: Python<'py>, residuals_px: &[DVec2]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    numpy_from_rows(py, residuals_px.iter().map(|r| r.to_array()).collect())
}
