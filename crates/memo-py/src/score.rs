//! Similarity of model contours and image edges.

use crate::array::{numpy_from_rows, segments_from_numpy};
use crate::defaults::dict;
use crate::error::value_error;
use memo_core::track::score::{EdgeLine, ModelLine, SimilarityOptions, similarity as core_similarity};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Similarity (eqs. 7 and 11) of model lines (N, 2, 2) and edges (M, 2, 2) in pixels: the value, and for each
/// matched line a row of line, edge, overlap l, distance d, angle (radians), s_i. The angle's standard deviation
/// `sigma_phi_rad` is 12 degrees by default.
#[pyfunction]
#[pyo3(signature = (
    lines, edges, *, c_l=1.0, c_d=0.5, c_r=0.25, sigma_phi_rad=0.20943952
))]
pub fn similarity<'py>(
    py: Python<'py>,
    lines: &Bound<'py, PyAny>,
    edges: &Bound<'py, PyAny>,
    c_l: f32,
    c_d: f32,
    c_r: f32,
    sigma_phi_rad: f32,
) -> PyResult<(f32, Bound<'py, PyArray2<f64>>)> {
    let lines: Vec<ModelLine> = segments_from_numpy(lines)?
        .into_iter()
        .map(|[start, end]| ModelLine { part: 0, start, end })
        .collect();
    let edges: Vec<EdgeLine> = segments_from_numpy(edges)?
        .into_iter()
        .map(|[start, end]| EdgeLine { start, end, gradient: 0.0, velocity: 0.0 })
        .collect();
    let options = SimilarityOptions { c_l, c_d, c_r, sigma_phi_rad, ..SimilarityOptions::DEFAULT };
    options.check().map_err(value_error)?;
    let found = py.detach(|| core_similarity(&lines, &edges, &options));
    let row = |m: &memo_core::track::score::Match| {
        [
            m.line as f64,
            m.edge as f64,
            m.overlap_px.into(),
            m.distance_px.into(),
            m.angle_rad.into(),
            m.similarity_px.into(),
        ]
    };
    Ok((found.value, numpy_from_rows(py, found.matches.iter().map(row).collect())?))
}

pub fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let SimilarityOptions { c_l, c_d, c_r, sigma_phi_rad, .. } = SimilarityOptions::DEFAULT;
    dict!(py, { c_l: c_l, c_d: c_d, c_r: c_r, sigma_phi_rad: sigma_phi_rad, })
}
