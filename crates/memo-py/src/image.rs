//! Image evidence: changed pixels, background, edges, velocities.

use crate::array::{frame_from_numpy, mask_from_numpy, numpy_from_image, numpy_from_rows};
use crate::defaults::dict;
use crate::error::value_error;
use crate::wait::interruptible;
use crate::walk::CameraTilt;
use crate::whole::{Whole, WholeNumbers};
use memo_core::Image;
use memo_core::image::silhouettes as core_silhouettes;
use memo_core::image::{
    ChangeOptions, CleanOptions, EdgeDomain, EdgeOptions, FlowOptions, GroupOptions, LineOptions,
    SILHOUETTE_THRESHOLD, clean, edge_segments as core_edge_segments, fill_holes, group_regions,
    pair_changes, regions, shrunk as core_shrunk, velocity_field as core_velocity_field,
};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Means of `n` by `n` grey values of a frame (H, W), rounded, (H // n, W // n); a rest at the right and at the bottom is
/// left out.
#[pyfunction]
pub fn shrunk<'py>(
    py: Python<'py>,
    frame: &Bound<'py, PyAny>,
    n: Whole<usize>,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let n = n.must_be("n", "between 1 and the shorter side of the frame")?;
    let frame = frame_from_numpy(frame)?;
    let frame = frame.as_frame()?;
    numpy_from_image(py, py.detach(|| core_shrunk(&frame, n)).map_err(value_error)?)
}

/// Mask of pixels that changed between two frames (eq. 1); `threshold` in grey levels, by default from the noise.
#[pyfunction]
#[pyo3(signature = (a, b, threshold=None))]
pub fn change_mask<'py>(
    py: Python<'py>,
    a: &Bound<'py, PyAny>,
    b: &Bound<'py, PyAny>,
    threshold: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<bool>>> {
    let (a, b) = (frame_from_numpy(a)?, frame_from_numpy(b)?);
    let (a, b) = (a.as_frame()?, b.as_frame()?);
    let threshold = threshold.map(|t| not_negative("threshold", t)).transpose()?;
    let options = ChangeOptions { threshold, ..ChangeOptions::default() };
    let mask = py.detach(|| pair_changes(&a, &b, &options)).map_err(value_error)?;
    numpy_from_image(py, mask)
}

/// Candidate regions of a change mask after the binary operations: (n, 5) of left, top, right, bottom (inclusive)
/// and area, largest first.
#[pyfunction]
pub fn moving_regions<'py>(py: Python<'py>, mask: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let mask = mask_from_numpy(mask)?;
    let group = GroupOptions::default();
    let cleaned = py.detach(|| clean(&mask, &CleanOptions::default())).map_err(value_error)?;
    let found = py
        .detach(|| group_regions(&regions(&fill_holes(&cleaned), group.min_part_area), &group))
        .map_err(value_error)?;
    let row = |r: &memo_core::image::Region| {
        let q = r.rectangle;
        [q.left, q.top, q.right, q.bottom, r.area].map(|v| v as f64)
    };
    numpy_from_rows(py, found.iter().map(row).collect())
}

/// Silhouettes of moving regions for a static camera, for a clip of frames (T, H, W): eq. (1) against the
/// temporal median, restricted to pixels that differ from it by `threshold` grey levels. Defaults: `threshold` 25.
#[pyfunction]
#[pyo3(signature = (frames, threshold=None))]
pub fn silhouettes<'py>(
    py: Python<'py>,
    frames: Vec<Bound<'py, PyAny>>,
    threshold: Option<f64>,
) -> PyResult<Vec<Bound<'py, PyArray2<bool>>>> {
    let threshold = threshold.unwrap_or(SILHOUETTE_THRESHOLD);
    let images =
        frames.iter().map(|frame| frame_from_numpy(frame)?.into_image()).collect::<PyResult<Vec<_>>>()?;
    let found = move || core_silhouettes(&images.iter().map(Image::as_frame).collect::<Vec<_>>(), threshold);
    let masks = interruptible(py, found)?.map_err(value_error)?;
    masks.into_iter().map(|mask| numpy_from_image(py, mask)).collect()
}

/// Straight edges of a frame: (n, 6) of u0, v0, u1, v1, mean gradient, residual RMS.
/// Defaults: `sigma_px` 1, `low` 5, `high` 12, `min_length_px` 8.
#[pyfunction]
#[pyo3(signature = (frame, mask=None, *, sigma_px=None, low=None, high=None, min_length_px=None))]
pub fn edge_segments<'py>(
    py: Python<'py>,
    frame: &Bound<'py, PyAny>,
    mask: Option<&Bound<'py, PyAny>>,
    sigma_px: Option<f32>,
    low: Option<f32>,
    high: Option<f32>,
    min_length_px: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let image = frame_from_numpy(frame)?.into_image()?;
    let mask = mask.map(mask_from_numpy).transpose()?;
    let (edge, line) = (EdgeOptions::default(), LineOptions::default());
    let edge = EdgeOptions {
        sigma_px: sigma_px.unwrap_or(edge.sigma_px),
        low: low.unwrap_or(edge.low),
        high: high.unwrap_or(edge.high),
    };
    let line = LineOptions { min_length_px: min_length_px.unwrap_or(line.min_length_px), ..line };
    let segments = move || {
        let domain = EdgeDomain { mask: mask.as_ref(), window: None };
        core_edge_segments(&image.as_frame(), &domain, &edge, &line)
    };
    let found = interruptible(py, segments)?.map_err(value_error)?;
    let row = |s: &memo_core::image::EdgeSegment| {
        [s.start_px.x, s.start_px.y, s.end_px.x, s.end_px.y, s.mean_gradient, s.residual_rms_px]
    };
    numpy_from_rows(py, found.iter().map(row).collect())
}

/// How a camera is tilted, by the upright lines of one of its pictures. Without `fov_deg`, 62 degrees across the longer
/// side are assumed. `still` marks the pixels to use: what moves, such as people, is not upright.
#[pyfunction]
#[pyo3(signature = (frame, still=None, *, fov_deg=None))]
pub fn camera_tilt(
    py: Python<'_>,
    frame: &Bound<'_, PyAny>,
    still: Option<&Bound<'_, PyAny>>,
    fov_deg: Option<f64>,
) -> PyResult<CameraTilt> {
    let image = frame_from_numpy(frame)?.into_image()?;
    let still = still.map(mask_from_numpy).transpose()?;
    let estimate =
        move || memo_core::camera_tilt(&image.as_frame(), still.as_ref(), fov_deg.map(f64::to_radians));
    CameraTilt::of(py, &interruptible(py, estimate)?.map_err(value_error)?)
}

/// The components of a velocity field, (H, W) each.
type Velocities<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>);

/// Velocity (u, v) of the pixels of a region from one frame to the next: two (H, W) arrays in pixels per frame,
/// NaN where it is not known.
#[pyfunction]
pub fn velocity_field<'py>(
    py: Python<'py>,
    first: &Bound<'py, PyAny>,
    second: &Bound<'py, PyAny>,
    region: &Bound<'py, PyAny>,
) -> PyResult<Velocities<'py>> {
    let (first, second) = (frame_from_numpy(first)?.into_image()?, frame_from_numpy(second)?.into_image()?);
    let region = mask_from_numpy(region)?;
    let (width, height) = (first.width(), first.height());
    let velocities =
        move || core_velocity_field(&first.as_frame(), &second.as_frame(), &region, &FlowOptions::default());
    let field = interruptible(py, velocities)?.map_err(value_error)?;
    let mut components = [vec![f32::NAN; width * height], vec![f32::NAN; width * height]];
    for y in 0..height {
        for x in 0..width {
            if let Some(velocity) = field.at(x, y) {
                components[0][y * width + x] = velocity.x as f32;
                components[1][y * width + x] = velocity.y as f32;
            }
        }
    }
    let image = |data| memo_core::Image::from_vec(width, height, data).map_err(value_error);
    let [u, v] = components;
    Ok((numpy_from_image(py, image(u)?)?, numpy_from_image(py, image(v)?)?))
}

pub fn silhouette_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    dict!(py, { threshold: SILHOUETTE_THRESHOLD, })
}

pub fn edge_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let EdgeOptions { sigma_px, low, high } = EdgeOptions::default();
    dict!(py, {
        sigma_px: sigma_px,
        low: low,
        high: high,
        min_length_px: LineOptions::default().min_length_px,
    })
}

fn not_negative(name: &str, value: f64) -> PyResult<f64> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(pyo3::exceptions::PyValueError::new_err(format!(
        "{name} must be a number of grey levels from 0, got {value}"
    )))
}
