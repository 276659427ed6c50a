//! Python bindings of memo-core: convert, release the interpreter lock, one call, convert back.

use pyo3::prelude::*;

/// The compiled core of the `memo` package.
#[pymodule]
mod _memo {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
