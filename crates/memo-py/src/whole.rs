//! Whole numbers as arguments.

use crate::error::shown;
use pyo3::exceptions::{PyIndexError, PyOverflowError, PyValueError};
use pyo3::prelude::*;

/// A whole number of Python. PyO3 refuses what the type does not hold, such as a negative number, with an `OverflowError` that
/// names neither the argument nor what it may be; this keeps such a number as text for [`WholeNumbers::must_be`].
pub struct Whole<T>(Result<T, String>);

/// The numbers of a 64-bit type, from 0 and from 1.
pub const FROM_0: &str = "between 0 and 18446744073709551615";
pub const FROM_1: &str = "between 1 and 18446744073709551615";

/// The numbers of a grey value or a part of a colour.
pub const A_BYTE: &str = "between 0 and 255";

impl<T> From<T> for Whole<T> {
    fn from(number: T) -> Self {
        Self(Ok(number))
    }
}

impl<'a, 'py, T: FromPyObject<'a, 'py>> FromPyObject<'a, 'py> for Whole<T> {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let error: PyErr = match object.extract::<T>() {
            Ok(number) => return Ok(Self(Ok(number))),
            Err(error) => error.into(),
        };
        let is_beyond = error.is_instance_of::<PyOverflowError>(object.py());
        if is_beyond { Ok(Self(Err(shown(&object)))) } else { Err(error) }
    }
}

/// Arguments of whole numbers: one, an optional one, or several.
pub trait WholeNumbers {
    /// The same as numbers.
    type Held;

    /// The numbers; a `ValueError` that names the argument and the numbers `wanted` if the type does not hold one of them.
    fn must_be(self, name: &str, wanted: &str) -> PyResult<Self::Held>;
}

impl<T> WholeNumbers for Whole<T> {
    type Held = T;

    fn must_be(self, name: &str, wanted: &str) -> PyResult<T> {
        self.0.map_err(|got| PyValueError::new_err(format!("{name} must be {wanted}, got {got}")))
    }
}

impl<N: WholeNumbers> WholeNumbers for Option<N> {
    type Held = Option<N::Held>;

    fn must_be(self, name: &str, wanted: &str) -> PyResult<Self::Held> {
        self.map(|numbers| numbers.must_be(name, wanted)).transpose()
    }
}

impl<N: WholeNumbers> WholeNumbers for Vec<N> {
    type Held = Vec<N::Held>;

    fn must_be(self, name: &str, wanted: &str) -> PyResult<Self::Held> {
        self.into_iter().map(|numbers| numbers.must_be(name, wanted)).collect()
    }
}

impl<N: WholeNumbers> WholeNumbers for [N; 2] {
    type Held = [N::Held; 2];

    fn must_be(self, name: &str, wanted: &str) -> PyResult<Self::Held> {
        let [a, b] = self;
        Ok([a.must_be(name, wanted)?, b.must_be(name, wanted)?])
    }
}

impl<N: WholeNumbers> WholeNumbers for [N; 3] {
    type Held = [N::Held; 3];

    fn must_be(self, name: &str, wanted: &str) -> PyResult<Self::Held> {
        let [a, b, c] = self;
        Ok([a.must_be(name, wanted)?, b.must_be(name, wanted)?, c.must_be(name, wanted)?])
    }
}

impl Whole<usize> {
    /// The index of one of `count` things; an `IndexError` for any other, which says `thing`, the index and `of` what.
    pub fn index(self, count: usize, thing: &str, of: &str) -> PyResult<usize> {
        let got = match self.0 {
            Ok(index) if index < count => return Ok(index),
            Ok(index) => index.to_string(),
            Err(got) => got,
        };
        Err(PyIndexError::new_err(format!("{thing} {got} of {of}")))
    }
}

/// Width and height of pictures, as they are given.
pub type Size = (Whole<u32>, Whole<u32>);

/// Width and height of pictures, pixels.
pub fn size_px((width, height): Size) -> PyResult<[u32; 2]> {
    [width, height].must_be("size", A_SIZE)
}

/// The numbers of a side of a picture.
pub const A_SIZE: &str = "between 1 and 4294967295";
