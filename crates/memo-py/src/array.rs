//! Conversions between numpy arrays and core types.

use crate::error::value_error;
use glam::DVec2;
use memo_core::image::Rectangle;
use memo_core::model::JOINT_COUNT;
use memo_core::{Frame, Image, Mask, StickFigure};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// An 8-bit grey frame of shape (H, W): the memory of numpy if its rows are contiguous, a copy for other strides.
///
/// Keep it alive while the interpreter lock is released. If another thread writes into the array in that time, the
/// result depends on when it writes, as for numpy's own functions.
pub enum FrameArray<'py> {
    /// Rows are contiguous in memory.
    Borrowed(PyReadonlyArray2<'py, u8>),
    /// Transposed, cropped or padded arrays.
    Copied(Image<u8>),
}

impl FrameArray<'_> {
    /// The frame; it can be read without the interpreter lock.
    pub fn as_frame(&self) -> PyResult<Frame<'_>> {
        match self {
            Self::Borrowed(array) => {
                let (height, width) = array.as_array().dim();
                Frame::new(array.as_slice()?, width, height, width).map_err(value_error)
            }
            Self::Copied(image) => Ok(image.as_frame()),
        }
    }

    /// The frame in its own memory, for another thread.
    pub fn into_image(self) -> PyResult<Image<u8>> {
        match self {
            Self::Borrowed(array) => {
                let (height, width) = array.as_array().dim();
                Image::from_vec(width, height, array.as_slice()?.to_vec()).map_err(value_error)
            }
            Self::Copied(image) => Ok(image),
        }
    }
}

/// Reads a frame: an array of shape (H, W), dtype uint8, with any strides.
pub fn frame_from_numpy<'py>(frame: &Bound<'py, PyAny>) -> PyResult<FrameArray<'py>> {
    let wanted = "wanted a grey frame: numpy array of shape (H, W), dtype uint8";
    let Ok(array) = frame.cast::<PyUntypedArray>() else {
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", frame.get_type().name()?)));
    };
    let describe = || format!("{wanted}; got shape {:?}, dtype {}", array.shape(), array.dtype());
    if array.ndim() != 2 {
        return Err(PyValueError::new_err(describe()));
    }
    let Ok(grey) = frame.cast::<PyArray2<u8>>() else { return Err(PyTypeError::new_err(describe())) };
    let grey = grey.try_readonly()?;
    if grey.is_c_contiguous() {
        return Ok(FrameArray::Borrowed(grey));
    }
    let view = grey.as_array();
    let (height, width) = view.dim();
    let mut pixels = Vec::with_capacity(width * height);
    for row in view.rows() {
        match row.as_slice() {
            Some(slice) => pixels.extend_from_slice(slice),
            None => pixels.extend(row.iter().copied()),
        }
    }
    Image::from_vec(width, height, pixels).map(FrameArray::Copied).map_err(value_error)
}

/// Description of the object for messages: shape and dtype of an array, the type of anything else.
fn describe(object: &Bound<'_, PyAny>) -> PyResult<String> {
    match object.cast::<PyUntypedArray>() {
        Ok(array) => Ok(format!("shape {:?}, dtype {}", array.shape(), array.dtype())),
        Err(_) => Ok(object.get_type().name()?.to_string()),
    }
}

/// Reads a boolean mask of shape (H, W).
pub fn mask_from_numpy(mask: &Bound<'_, PyAny>) -> PyResult<Mask> {
    let Ok(array) = mask.cast::<PyArray2<bool>>() else {
        let wanted = "wanted a mask: numpy array of shape (H, W), dtype bool";
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", describe(mask)?)));
    };
    let array = array.try_readonly()?;
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
pub fn numpy_from_rows<T: numpy::Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    rows.into_iter().flatten().collect::<Vec<T>>().into_pyarray(py).reshape([count, N])
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

/// Reads points (N, 3): an array of any number type, or a sequence of triples.
pub fn points_from_numpy(points: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    numbers_from_numpy(points, "points")
}

/// Reads pixels (N, 2): an array of any number type, or a sequence of pairs.
pub fn pixels_from_numpy(pixels: &Bound<'_, PyAny>) -> PyResult<Vec<DVec2>> {
    Ok(numbers_from_numpy(pixels, "pixels")?.into_iter().map(DVec2::from_array).collect())
}

/// Rows of N numbers from any object that numpy converts.
fn numbers_from_numpy<const N: usize>(object: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<[f64; N]>> {
    let wanted = format!("wanted {what}: numpy array of shape (N, {N})");
    let (rows, shape) = vectors_from_numpy(object, &wanted)?;
    if rows.is_empty() || shape.len() == 1 {
        return Ok(rows);
    }
    Err(PyValueError::new_err(format!("{wanted}; got {}", describe(object)?)))
}

/// Numbers of shape (..., N) as rows of N, and the shape before the last axis; an empty list is no row.
pub fn vectors_from_numpy<const N: usize>(
    object: &Bound<'_, PyAny>,
    wanted: &str,
) -> PyResult<(Vec<[f64; N]>, Vec<usize>)> {
    let array = object.py().import("numpy")?.call_method1("asarray", (object,)).ok();
    let described = || describe(array.as_ref().unwrap_or(object));
    let kind =
        array.as_ref().and_then(|a| a.getattr("dtype").ok()?.getattr("kind").ok()?.extract::<char>().ok());
    let (Some(array), Some('f' | 'i' | 'u')) = (&array, kind) else {
        return Err(PyTypeError::new_err(format!("{wanted} of numbers; got {}", described()?)));
    };
    let numbers = array.call_method1("astype", ("float64",))?;
    let refused = || Ok::<_, PyErr>(PyValueError::new_err(format!("{wanted}; got {}", described()?)));
    let Ok(numbers) = numbers.cast::<PyArrayDyn<f64>>() else { return Err(refused()?) };
    let shape = match numbers.shape() {
        [0] => return Ok((Vec::new(), vec![0])),
        [before @ .., last] if *last == N => before.to_vec(),
        _ => return Err(refused()?),
    };
    let numbers = numbers.try_readonly()?;
    let flat: Vec<f64> = numbers.as_array().iter().copied().collect();
    Ok((flat.chunks_exact(N).map(|row| std::array::from_fn(|i| row[i])).collect(), shape))
}

/// Boxes (N, 4), left, top, width and height in pixels, as the pixels of a picture that they cover.
pub fn boxes_from_numpy(boxes: &Bound<'_, PyAny>, [width, height]: [usize; 2]) -> PyResult<Vec<Rectangle>> {
    let (rows, shape) = vectors_from_numpy::<4>(boxes, "boxes must have shape (N, 4)")?;
    if shape.len() != 1 {
        return Err(PyValueError::new_err("boxes must have shape (N, 4): those of one frame"));
    }
    let covered = |(k, row): (usize, &[f64; 4])| {
        let [left, top, wide, high] = *row;
        let (first, last) = ([left, top], [left + wide, top + high]);
        let size = [width as f64, height as f64];
        let is_seen =
            (0..2).all(|i| last[i] - first[i] >= 1.0 && last[i] >= 1.0 && first[i] <= size[i] - 1.0);
        if !(row.iter().all(|number| number.is_finite()) && is_seen) {
            return Err(PyValueError::new_err(format!(
                "box {k} must be left, top, width and height of pixels in a {width}x{height} picture, got {row:?}"
            )));
        }
        let [low, high] = [first.map(f64::round), last.map(|end| end.round() - 1.0)];
        let within = |value: f64, i: usize| value.clamp(0.0, size[i] - 1.0) as usize;
        Ok(Rectangle {
            left: within(low[0], 0),
            top: within(low[1], 1),
            right: within(high[0].max(low[0]), 0),
            bottom: within(high[1].max(low[1]), 1),
        })
    };
    rows.iter().enumerate().map(covered).collect()
}

/// Rows of N numbers as an array of shape (..., N), `shape` standing before the last axis.
pub fn numpy_of_shape<const N: usize>(
    py: Python<'_>,
    rows: impl Iterator<Item = [f64; N]>,
    mut shape: Vec<usize>,
) -> PyResult<Bound<'_, PyArrayDyn<f64>>> {
    shape.push(N);
    rows.flatten().collect::<Vec<f64>>().into_pyarray(py).reshape(shape)
}

/// Reads line segments of shape (N, 2, 2).
pub fn segments_from_numpy(segments: &Bound<'_, PyAny>) -> PyResult<Vec<[[f32; 2]; 2]>> {
    let wanted = "wanted segments: numpy array of shape (N, 2, 2), dtype float64";
    let Ok(array) = segments.cast::<PyArray3<f64>>() else {
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", describe(segments)?)));
    };
    let array = array.try_readonly()?;
    let view = array.as_array();
    if view.dim().1 != 2 || view.dim().2 != 2 {
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(segments)?)));
    }
    let at = |s: usize, e: usize, k: usize| view[[s, e, k]] as f32;
    Ok((0..view.dim().0).map(|s| [0, 1].map(|e| [at(s, e, 0), at(s, e, 1)])).collect())
}

/// Reads points over time of shape (T, K, D): the flat values with T and K.
pub fn motion_from_numpy<const D: usize>(
    points: &Bound<'_, PyAny>,
) -> PyResult<(Vec<[f64; D]>, usize, usize)> {
    let wanted = format!("wanted points over time: numpy array of shape (T, K, {D}), dtype float64");
    let Ok(array) = points.cast::<numpy::PyArray3<f64>>() else {
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", describe(points)?)));
    };
    let array = array.try_readonly()?;
    let view = array.as_array();
    let (frames, count, dimensions) = view.dim();
    if dimensions != D {
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(points)?)));
    }
    let at = |t: usize, k: usize| std::array::from_fn(|d| view[[t, k, d]]);
    Ok((
        (0..frames).flat_map(|t| (0..count).map(move |k| (t, k))).map(|(t, k)| at(t, k)).collect(),
        frames,
        count,
    ))
}

/// Reads image vectors of shape (N, `each`, 2) from numpy's own memory, which must be contiguous.
pub fn rows_from_numpy<'py>(points: &Bound<'py, PyAny>, each: usize) -> PyResult<PyReadonlyArray3<'py, f64>> {
    let wanted =
        format!("wanted image vectors: contiguous numpy array of shape (N, {each}, 2), dtype float64");
    let array = points.cast::<PyArray3<f64>>().ok();
    let Some(array) = array.filter(|a| a.shape()[1..] == [each, 2] && a.is_c_contiguous()) else {
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(points)?)));
    };
    Ok(array.try_readonly()?)
}

/// Flat values as an array of a shape.
pub fn numpy_from_flat<T: numpy::Element>(
    py: Python<'_>,
    flat: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Bound<'_, PyArrayDyn<T>>> {
    flat.into_pyarray(py).reshape(shape)
}

/// Image points over time.
pub struct Track {
    /// Number of frames T.
    pub frames: usize,
    /// Number of points per frame K.
    pub joints: usize,
    /// T * K points in pixels, frame by frame, NaN for missing points.
    pub points_px: Vec<DVec2>,
}

/// Reads image points of shape (T, K, 2).
pub fn track_from_numpy(points: &Bound<'_, PyAny>) -> PyResult<Track> {
    let wanted = "wanted image points: numpy array of shape (T, K, 2), dtype float64";
    let Ok(array) = points.cast::<PyArray3<f64>>() else {
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", describe(points)?)));
    };
    let array = array.try_readonly()?;
    let view = array.as_array();
    let (frames, joints, axes) = view.dim();
    if axes != 2 {
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(points)?)));
    }
    let points_px = view.rows().into_iter().map(|row| DVec2::new(row[0], row[1])).collect();
    Ok(Track { frames, joints, points_px })
}

/// Reads scores of shape (T, K) for a track.
pub fn scores_from_numpy(scores: &Bound<'_, PyAny>, track: &Track) -> PyResult<Vec<f64>> {
    let (frames, joints) = (track.frames, track.joints);
    let wanted = format!("wanted scores: numpy array of shape ({frames}, {joints}), dtype float64");
    let Ok(array) = scores.cast::<PyArray2<f64>>() else {
        return Err(PyTypeError::new_err(format!("{wanted}; got {}", describe(scores)?)));
    };
    let array = array.try_readonly()?;
    let view = array.as_array();
    if view.dim() != (frames, joints) {
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(scores)?)));
    }
    Ok(view.iter().copied().collect())
}

/// Image points, frame by frame, as an array of shape (T, joints, 2).
pub fn numpy_from_track(
    py: Python<'_>,
    points_px: Vec<DVec2>,
    joints: usize,
) -> PyResult<Bound<'_, PyArray3<f64>>> {
    let frames = points_px.len() / joints.max(1);
    points_px
        .into_iter()
        .flat_map(|point| point.to_array())
        .collect::<Vec<f64>>()
        .into_pyarray(py)
        .reshape([frames, joints, 2])
}

/// Reads times of shape (T,), s.
pub fn times_from_numpy(times: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let wanted = "wanted times: numpy array of shape (T,), dtype float64";
    let Ok(array) = times.cast::<PyArray1<f64>>() else {
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(times)?)));
    };
    Ok(array.try_readonly()?.as_array().iter().copied().collect())
}

/// Reads N points over time, shape (T, N, 2), such as those of the "head".
pub fn points_of_part_from_numpy<const N: usize>(
    points: &Bound<'_, PyAny>,
    part: &str,
) -> PyResult<Vec<[DVec2; N]>> {
    let track = track_from_numpy(points)?;
    if track.joints != N {
        let wanted = format!("wanted points of the {part}: numpy array of shape (T, {N}, 2), dtype float64");
        return Err(PyValueError::new_err(format!("{wanted}; got {}", describe(points)?)));
    }
    Ok(track.points_px.chunks_exact(N).map(|row| std::array::from_fn(|i| row[i])).collect())
}

/// Figures of 14 joints as an array of shape (figures, 14, 3).
pub fn numpy_from_figures<'py>(
    py: Python<'py>,
    figures: &[StickFigure],
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let flat: Vec<f64> = figures.iter().flat_map(|figure| figure.0).flat_map(|p| p.to_array()).collect();
    flat.into_pyarray(py).reshape([figures.len(), JOINT_COUNT, 3])
}
