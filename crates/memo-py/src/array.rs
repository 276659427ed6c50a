//! All traffic with numpy.

use memo_core::image::{Image, Mask};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// An 8-bit grey frame of shape (H, W), copied once so that the interpreter lock can be released. Any strides are taken.
pub fn frame_from_numpy(frame: &Bound<'_, PyAny>) -> PyResult<Image<u8>> {
    let wanted = "wanted a grey frame: numpy array of shape (H, W), dtype uint8";
    let Ok(array) = frame.cast::<PyUntypedArray>() else {
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", frame.get_type().name()?)));
    };
    let describe = || format!("{wanted}; got shape {:?}, dtype {}", array.shape(), array.dtype());
    if array.ndim() != 2 {
        return Err(PyValueError::new_err(describe()));
    }
    let Ok(grey) = frame.cast::<PyArray2<u8>>() else { return Err(PyTypeError::new_err(describe())) };
    let grey = grey.readonly();
    let view = grey.as_array();
    let (height, width) = view.dim();
    let pixels = match view.as_slice() {
        Some(slice) => slice.to_vec(),
        None => view.iter().copied().collect(),
    };
    Image::from_vec(width, height, pixels).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// A boolean mask of shape (H, W).
pub fn mask_from_numpy(mask: &Bound<'_, PyAny>) -> PyResult<Mask> {
    let Ok(array) = mask.cast::<PyArray2<bool>>() else {
        return Err(PyTypeError::new_err("wanted a mask: numpy array of shape (H, W), dtype bool"));
    };
    let array = array.readonly();
    let view = array.as_array();
    let (height, width) = view.dim();
    Image::from_vec(width, height, view.iter().copied().collect())
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

/// An image as an array of shape (H, W).
pub fn numpy_from_image<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    image: Image<T>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let (width, height) = (image.width(), image.height());
    image.into_vec().into_pyarray(py).reshape([height, width])
}

/// Rows of N numbers each as an array of shape (rows, N).
pub fn numpy_from_rows<const N: usize>(
    py: Python<'_>,
    rows: Vec<[f64; N]>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len();
    rows.into_iter().flatten().collect::<Vec<f64>>().into_pyarray(py).reshape([count, N])
}

/// Line segments as an array of shape (segments, 2, 2): start and end, each (u, v).
pub fn numpy_from_segments(
    py: Python<'_>,
    segments: Vec<[[f64; 2]; 2]>,
) -> PyResult<Bound<'_, PyArrayDyn<f64>>> {
    let count = segments.len();
    let flat: Vec<f64> = segments.into_iter().flatten().flatten().collect();
    flat.into_pyarray(py).reshape(vec![count, 2, 2])
}

/// A column of numbers.
pub fn numpy_from_column<T: numpy::Element>(py: Python<'_>, column: Vec<T>) -> Bound<'_, PyArray1<T>> {
    column.into_pyarray(py)
}

/// Points of shape (N, 3).
pub fn points_from_numpy(points: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    let wanted = "wanted points: numpy array of shape (N, 3), dtype float64";
    let Ok(array) = points.cast::<PyArray2<f64>>() else { return Err(PyTypeError::new_err(wanted)) };
    let array = array.readonly();
    let view = array.as_array();
    if view.ncols() != 3 {
        return Err(PyValueError::new_err(format!("{wanted}; got shape {:?}", view.shape())));
    }
    Ok(view.rows().into_iter().map(|row| [row[0], row[1], row[2]]).collect())
}
