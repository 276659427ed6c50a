//! Similarity of model contours and image edges.

use crate::array::{numpy_from_rows, segments_from_numpy};
use crate::error::value_error;
use memo_core::track::score::{EdgeLine, ModelLine, SimilarityOptions, similarity as core_similarity};
use numpy::PyArray2;
use pyo3::prelude::*;

/// Similarity (eqs. 7 and 11) of model lines (N, 2, 2) and edges (M, 2, 2) in pixels: the value, and for each
/// matched line a row of line, edge, overlap l, distance d, angle (radians), s_i.
#[pyfunction]
#[pyo3(signature = (
    lines, edges, *, c_l=SimilarityOptions::DEFAULT.c_l, c_d=SimilarityOptions::DEFAULT.c_d,
    c_r=SimilarityOptions::DEFAULT.c_r, sigma_phi_rad=SimilarityOptions::DEFAULT.sigma_phi_rad
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
