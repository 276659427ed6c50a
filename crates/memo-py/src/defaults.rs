//! The defaults of the core's options, for help and documentation.

use crate::{image, planar, pointlight, posture, score, tracker, walk};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A dictionary of named values.
macro_rules! dict {
    ($py:expr, { $($name:ident: $value:expr,)* }) => {{
        let dict = pyo3::types::PyDict::new($py);
        $(dict.set_item(stringify!($name), $value)?;)*
        Ok(dict)
    }};
}
pub(crate) use dict;

/// The defaults of the options of a function, by its name.
#[pyfunction]
pub fn defaults<'py>(py: Python<'py>, function: &str) -> PyResult<Bound<'py, PyDict>> {
    match function {
        "edge_segments" => image::edge_defaults(py),
        "fit_walk" => walk::fit_defaults(py),
        "planar" => planar::defaults(py),
        "pointlight" => pointlight::defaults(py),
        "pointlight_frames" => pointlight::picture_defaults(py),
        "posture" => posture::defaults(py),
        "track" => tracker::defaults(py),
        "similarity" => score::defaults(py),
        "silhouettes" => image::silhouette_defaults(py),
        "walker_motion" => pointlight::walker_defaults(py),
        _ => Err(PyValueError::new_err(format!("no defaults of a function {function:?}"))),
    }
}
