//! All exceptions: every error of the core is a `ValueError` with the core's message.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::{PyErr, create_exception};
use std::panic::set_hook;
use std::sync::Mutex;

create_exception!(memo, InternalError, PyRuntimeError, "A bug in memo, not a mistake in what it was given.");

/// Where the core last panicked. Only tried, never waited for: a forked child may find it locked.
static PLACE: Mutex<String> = Mutex::new(String::new());

/// The Python exception for an error of the core.
pub fn value_error(error: impl std::error::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The Python exception for a panic of the core, from its message.
pub fn internal_error(message: String) -> PyErr {
    let place = PLACE.try_lock().map(|place| place.clone()).unwrap_or_default();
    InternalError::new_err(format!("{message} ({place}): this is a bug in memo, please report it"))
}

/// Notes where the core panics, besides what Rust prints on standard error.
pub fn note_panics() {
    let usual = std::panic::take_hook();
    set_hook(Box::new(move |panic| {
        if let (Some(at), Ok(mut place)) = (panic.location(), PLACE.try_lock()) {
            *place = at.to_string();
        }
        usual(panic);
    }));
}
