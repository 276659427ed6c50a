//! Euler angles of rotations.

use crate::array::{motion_from_numpy, numpy_from_rows};
use glam::{DMat3, DVec3};
use memo_core::model::euler::{EulerOrder, euler_angles as core_euler_angles};
use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Angles a, b, c (T, 3), radians, of rotations (T, 3, 3) that are R_i(a) R_j(b) R_k(c), for the order ijk of the
/// axes, such as "YXZ". b is at most a quarter turn. NaN stays NaN.
#[pyfunction]
pub fn euler_angles<'py>(
    py: Python<'py>,
    rotations: &Bound<'py, PyAny>,
    order: &str,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let Some(order) = EulerOrder::from_name(order) else {
        return Err(PyValueError::new_err(format!(
            "order must name each of X, Y and Z once, such as \"YXZ\"; got {order:?}"
        )));
    };
    let (rows, frames, count) = motion_from_numpy::<3>(rotations)?;
    let (matrices, _) = rows.as_chunks::<3>();
    if count != 3 {
        return Err(PyValueError::new_err(format!(
            "wanted rotations of shape (T, 3, 3); got ({frames}, {count}, 3)"
        )));
    }
    let angles = |rows: &[[f64; 3]; 3]| {
        let [x, y, z] = rows.map(DVec3::from);
        core_euler_angles(&DMat3::from_cols(x, y, z).transpose(), order)
    };
    numpy_from_rows(py, matrices.iter().map(angles).collect())
}
