//! Exceptions: every error of the core is a `ValueError` with the core's message, a panic is an `InternalError`.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::panic::PanicException;
use pyo3::prelude::*;

/// The Python exception for an error of the core.
pub fn value_error(error: impl std::error::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Converts panics in any binding to an ordinary exception, `memo.InternalError`. PyO3 raises an exception that
/// `except Exception` does not catch.
pub fn add_internal_error(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    let panic = py.get_type::<PanicException>();
    panic.setattr("__bases__", (py.get_type::<PyRuntimeError>(),))?;
    panic.setattr("__module__", "memo")?;
    panic.setattr("__name__", "InternalError")?;
    panic.setattr("__qualname__", "InternalError")?;
    panic.setattr(
        "__doc__",
        "A bug in memo, not a mistake in what it was given; standard error says where it is.",
    )?;
    module.add("InternalError", panic)
}
