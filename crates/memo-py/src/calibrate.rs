//! Calibration from measured points and from a walker.

use crate::array::{
    motion_from_numpy, numpy_from_column, numpy_from_rows, pixels_from_numpy, points_from_numpy,
};
use crate::camera::PyCamera;
use crate::error::value_error;
use glam::{DVec2, DVec3};
use memo_core::calibrate::{
    Estimate, KnownLens, PointOptions, Sighting, WalkerOptions, camera_from_points, camera_from_walker,
    sightings_from_joints,
};
use memo_core::wording::counted;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The camera that projects points (N, 3), metres, to pixels (N, 2).
#[pyfunction]
#[pyo3(signature = (places, pixels, size, *, focal_px=None, lens=None))]
pub fn calibrate_points<'py>(
    py: Python<'py>,
    places: &Bound<'py, PyAny>,
    pixels: &Bound<'py, PyAny>,
    size: (u32, u32),
    focal_px: Option<f64>,
    lens: Option<PyCamera>,
) -> PyResult<Bound<'py, PyDict>> {
    let places: Vec<DVec3> = points_from_numpy(places)?.into_iter().map(DVec3::from).collect();
    let pixels = pixels_from_numpy(pixels)?;
    let options = PointOptions { size: size.into(), lens: known_lens(focal_px, lens)? };
    let found = py.detach(|| camera_from_points(&places, &pixels, &options)).map_err(value_error)?;
    let dict = PyDict::new(py);
    dict.set_item("camera", PyCamera(found.camera))?;
    dict.set_item("estimates", estimates(py, &found.estimates)?)?;
    let rows = found.covariance.nrows();
    let covariance = numpy_from_column(py, found.covariance.as_slice().to_vec()).reshape([rows, rows])?;
    dict.set_item("covariance", covariance)?;
    dict.set_item("residuals_px", numpy_from_rows(py, residuals(&found.residuals_px))?)?;
    dict.set_item("outliers", found.outliers)?;
    dict.set_item("rms_px", found.rms_px)?;
    dict.set_item("noise_px", found.noise_px)?;
    dict.set_item("degrees_of_freedom", found.degrees_of_freedom)?;
    dict.set_item("is_planar", found.is_planar)?;
    Ok(dict)
}

/// The camera that sees a person of `height_m` with feet (N, 2) and heads (N, 2), pixels in order of time. The
/// shares (N,) are the heights of the two points above the ground, relative to the body height: 0 and 1 for soles
/// and crown.
#[pyfunction]
#[pyo3(signature = (feet, heads, size, height_m, *, foot_share=None, head_share=None, focal_px=None, lens=None))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn calibrate_walker<'py>(
    py: Python<'py>,
    feet: &Bound<'py, PyAny>,
    heads: &Bound<'py, PyAny>,
    size: (u32, u32),
    height_m: f64,
    foot_share: Option<Vec<f64>>,
    head_share: Option<Vec<f64>>,
    focal_px: Option<f64>,
    lens: Option<PyCamera>,
) -> PyResult<Bound<'py, PyDict>> {
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
    let sighting = |i: usize| Sighting {
        foot_px: feet[i],
        head_px: heads[i],
        foot_share: foot_share[i],
        head_share: head_share[i],
    };
    let sightings: Vec<Sighting> = (0..feet.len()).map(sighting).collect();
    let options = WalkerOptions { size: size.into(), height_m, lens: known_lens(focal_px, lens)? };
    let found = py.detach(|| camera_from_walker(&sightings, &options)).map_err(value_error)?;
    let dict = PyDict::new(py);
    dict.set_item("camera", PyCamera(found.camera))?;
    dict.set_item("estimates", estimates(py, &found.estimates)?)?;
    dict.set_item("residuals_px", numpy_from_rows(py, residuals(&found.residuals_px))?)?;
    dict.set_item("outliers", found.outliers)?;
    dict.set_item("rms_px", found.rms_px)?;
    dict.set_item("person_px", found.person_px)?;
    dict.set_item("alike", found.alike)?;
    dict.set_item("places", numpy_from_rows(py, found.places.iter().map(|p| p.to_array()).collect())?)?;
    Ok(dict)
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
    let rows = |of: fn(&Sighting) -> DVec2| found.iter().map(|s| of(s).to_array()).collect();
    let column = |of: fn(&Sighting) -> f64| found.iter().map(of).collect();
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

/// A dict of (value, standard deviation) by name.
fn estimates<'py>(py: Python<'py>, estimates: &[Estimate]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for estimate in estimates {
        dict.set_item(estimate.name, (estimate.value, estimate.sd))?;
    }
    Ok(dict)
}

fn residuals(residuals_px: &[DVec2]) -> Vec<[f64; 2]> {
    residuals_px.iter().map(|r| r.to_array()).collect()
}
