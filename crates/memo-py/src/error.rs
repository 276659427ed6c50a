//! All exceptions: every error of the core is a `ValueError` with the core's message.

use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// The Python exception for an error of the core.
pub fn value_error(error: impl std::error::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}
