//! Results as classes of Python.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use pyo3::{PyClass, PyClassInitializer};

/// Declares a class whose objects hold one result: read-only attributes, which pickling keeps, each with its type and
/// what it is made of, or else the field of the same name of the core's result; hidden fields, if any, which pickling
/// drops for their default; the text within the `repr`; and methods, if any.
macro_rules! result {
    (@value $core:ident $field:ident) => { $core.$field };
    (@value $core:ident $field:ident $value:expr) => { $value };
    (
        $(#[$about:meta])*
        $name:ident |$py:ident, $core:ident: $of:ty $(, $given:ident: $kind:ty)*| {
            $($(#[$meaning:meta])* $field:ident: $type:ty $(= $value:expr)?,)*
        }
        $(@hidden { $($hidden:ident: $kept:ty = $made:expr,)* })?
        $described:expr
        $(; methods { $($methods:tt)* })?
    ) => {
        $(#[$about])*
        #[pyo3::pyclass(frozen, module = "memo._memo")]
        pub struct $name {
            $($(#[$meaning])* #[pyo3(get)] pub $field: $type,)*
            $($(pub $hidden: $kept,)*)?
        }

        impl $name {
            pub(crate) fn of($py: Python<'_>, $core: $of $(, $given: $kind)*) -> PyResult<Self> {
                Ok(Self {
                    $($field: crate::result::result!(@value $core $field $($value)?).into(),)*
                    $($($hidden: $made,)*)?
                })
            }
        }

        #[pyo3::pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (*fields))]
            fn new(fields: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<Self> {
                let mut fields = fields.iter();
                Ok(Self {
                    $($field: crate::result::next_field(&mut fields, stringify!($field))?,)*
                    $($($hidden: Default::default(),)*)?
                })
            }

            fn __getnewargs__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, pyo3::types::PyTuple>> {
                crate::result::fields_of(slf, &[$(stringify!($field)),*])
            }

            fn __repr__(&self) -> String {
                let described: fn(&Self) -> String = $described;
                format!("{}({})", stringify!($name), described(self))
            }

            fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<String> {
                crate::result::html_of(slf, &[$(stringify!($field)),*])
            }

            $($($methods)*)?
        }
    };
}
pub(crate) use result;

/// The next of the fields that `__getnewargs__` gave.
pub fn next_field<'py, T: FromPyObjectOwned<'py>>(
    fields: &mut impl Iterator<Item = Bound<'py, PyAny>>,
    name: &str,
) -> PyResult<T> {
    let field = fields.next().ok_or_else(|| PyTypeError::new_err(format!("{name} is missing")))?;
    field.extract().map_err(Into::into)
}

/// The values of these attributes.
pub fn fields_of<'py, T>(object: &Bound<'py, T>, names: &[&str]) -> PyResult<Bound<'py, PyTuple>> {
    let fields: PyResult<Vec<_>> = names.iter().map(|name| object.as_any().getattr(name)).collect();
    PyTuple::new(object.py(), fields?)
}

/// A table of these attributes, for notebooks.
pub fn html_of<T>(object: &Bound<'_, T>, names: &[&str]) -> PyResult<String> {
    let notebook = object.py().import("memo.notebook")?;
    let title = object.as_any().repr()?;
    notebook.call_method1("table", (title, names.to_vec(), fields_of(object, names)?))?.extract()
}

/// One object for each of several results.
pub fn objects<T: PyClass + Into<PyClassInitializer<T>>>(
    py: Python<'_>,
    results: impl Iterator<Item = PyResult<T>>,
) -> PyResult<Vec<Py<T>>> {
    results.map(|result| Py::new(py, result?)).collect()
}
