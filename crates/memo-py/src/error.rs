//! Exceptions: every error of the core is a `ValueError` with the core's message, a panic is an `InternalError`.

use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::panic::PanicException;
use pyo3::prelude::*;

/// The Python exception for an error of the core.
pub fn value_error(error: impl std::error::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Longest value that a message repeats, characters.
const LONGEST: usize = 60;

/// What was given, for a message of one line: the value if it is short, or else its type.
pub fn shown(given: &Bound<'_, PyAny>) -> String {
    let repr = given.repr().ok().map(|text| text.to_string());
    let short = repr.filter(|text| text.chars().count() <= LONGEST && !text.contains('\n'));
    short.unwrap_or_else(|| {
        let kind = given.get_type().name().map_or_else(|_| "object".to_owned(), |name| name.to_string());
        format!("a value of type {kind}")
    })
}

/// The `TypeError` of an argument that is none of the accepted types.
pub fn wrong_type(name: &str, wanted: &str, given: &Bound<'_, PyAny>) -> PyErr {
    PyTypeError::new_err(format!("{name} must be {wanted}, got {}", shown(given)))
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
