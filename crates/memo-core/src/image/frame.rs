//! Grey images: one owned image type, one borrowed view.
//!
//! Frames are 8-bit grey images, because cameras and codecs deliver 8 bits and because change detection is
//! exact in integers. Derived quantities are `Image<f32>`: a grey value has fewer than the seven digits of
//! `f32`, and `f64` would double the memory traffic.

use crate::wording::counted;
use glam::DVec2;
use thiserror::Error;

/// Why a frame was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The buffer is shorter than the image needs; for an owned image, its length differs from the image's.
    #[error("a {width}x{height} frame with rows {stride} apart needs {}, got {got}", counted(*needed, "byte"))]
    TooShort {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Distance between the starts of two rows, in elements.
        stride: usize,
        /// Number of elements needed.
        needed: usize,
        /// Number of elements given.
        got: usize,
    },
    /// An image side is zero, or the rows overlap.
    #[error(
        "frame of {width}x{height} pixels with rows {stride} apart: sides must be positive and rows must not overlap"
    )]
    BadShape {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Distance between the starts of two rows, in elements.
        stride: usize,
    },
    /// Two frames that must have the same size differ in size.
    #[error("frame size changed: expected {expected_width}x{expected_height}, got {width}x{height}")]
    SizeChanged {
        /// Width of the first frame.
        expected_width: usize,
        /// Height of the first frame.
        expected_height: usize,
        /// Width of this frame.
        width: usize,
        /// Height of this frame.
        height: usize,
    },
}

/// An owned image, row-major without padding. `Image<u8>` is a grey frame, [`Mask`] a set of pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Image<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

/// A set of pixels.
pub type Mask = Image<bool>;

impl<T: Copy> Image<T> {
    /// An image filled with one value.
    ///
    /// # Panics
    ///
    /// If a side is zero, or there are more pixels than memory can hold.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        assert!(width > 0 && height > 0, "an image of {width}x{height} pixels: sides must be positive");
        Self::perhaps_empty(width, height, value)
    }

    /// The same, but without pixels if a side is zero: what a window outside an image shows of it.
    pub(crate) fn perhaps_empty(width: usize, height: usize, value: T) -> Self {
        let Some(count) = width.checked_mul(height) else {
            panic!("an image of {width}x{height} pixels: more than memory can hold")
        };
        Self { width, height, data: vec![value; count] }
    }

    /// Takes row-major data of `width * height` elements.
    ///
    /// # Errors
    ///
    /// A side is zero, or the number of elements is not `width * height`.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Result<Self, FrameError> {
        if width == 0 || height == 0 {
            return Err(FrameError::BadShape { width, height, stride: width });
        }
        let needed = width.saturating_mul(height);
        if data.len() != needed {
            return Err(FrameError::TooShort { width, height, stride: width, needed, got: data.len() });
        }
        Ok(Self { width, height, data })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row by row, mutable.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// One row.
    ///
    /// # Panics
    ///
    /// If `y` is not less than the height.
    #[inline]
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// One row, mutable.
    ///
    /// # Panics
    ///
    /// If `y` is not less than the height.
    #[inline]
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.data[y * self.width..(y + 1) * self.width]
    }

    /// The value at column `x`, row `y`.
    ///
    /// # Panics
    ///
    /// If the index `y * width + x` is past the last pixel. `x` is not compared with the width: a larger `x`
    /// reads a pixel of a later row.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// Sets the value at column `x`, row `y`.
    ///
    /// # Panics
    ///
    /// If the index `y * width + x` is past the last pixel. `x` is not compared with the width: a larger `x`
    /// sets a pixel of a later row.
    pub fn set(&mut self, x: usize, y: usize, value: T) {
        self.data[y * self.width + x] = value;
    }

    /// The row-major data.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }
}

impl Image<u8> {
    /// Borrows the image as a [`Frame`].
    #[inline]
    pub fn as_frame(&self) -> Frame<'_> {
        Frame { data: &self.data, width: self.width, height: self.height, stride: self.width }
    }
}

/// A borrowed 8-bit grey frame. Rows may be padded, so the luma plane of a video decoder can be used in
/// place.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    data: &'a [u8],
    width: usize,
    height: usize,
    stride: usize,
}

impl<'a> Frame<'a> {
    /// Borrows `height` rows of `width` bytes; each row starts `stride` bytes after the previous one.
    ///
    /// # Errors
    ///
    /// A side is zero, the stride is less than the width, or the data are too short.
    pub fn new(data: &'a [u8], width: usize, height: usize, stride: usize) -> Result<Self, FrameError> {
        if width == 0 || height == 0 || stride < width {
            return Err(FrameError::BadShape { width, height, stride });
        }
        let needed = (height - 1).saturating_mul(stride).saturating_add(width);
        if data.len() < needed {
            return Err(FrameError::TooShort { width, height, stride, needed, got: data.len() });
        }
        Ok(Self { data, width, height, stride })
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// One row of grey values.
    ///
    /// # Panics
    ///
    /// If `y` is not less than the height.
    #[inline]
    pub fn row(&self, y: usize) -> &'a [u8] {
        let start = y * self.stride;
        &self.data[start..start + self.width]
    }

    /// The grey value at column `x`, row `y`.
    ///
    /// # Panics
    ///
    /// If the index `y * stride + x` is past the end of the data. `x` is not compared with the width: a
    /// larger `x` reads padding or a later row.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> u8 {
        self.data[y * self.stride + x]
    }

    /// The grey value between four pixels, linear along both axes; `None` outside the centres of the outermost pixels.
    #[inline]
    pub(crate) fn between(&self, p: DVec2) -> Option<f64> {
        Between::new(p, [self.width, self.height], self.stride).map(|place| place.of(self.data))
    }

    /// An owned copy without padding.
    pub fn to_image(&self) -> Image<u8> {
        let mut data = Vec::with_capacity(self.width * self.height);
        for y in 0..self.height {
            data.extend_from_slice(self.row(y));
        }
        Image { width: self.width, height: self.height, data }
    }

    /// Returns an error if `other` differs in size.
    pub fn check_same_size(&self, other: &Frame<'_>) -> Result<(), FrameError> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(FrameError::SizeChanged {
            expected_width: self.width,
            expected_height: self.height,
            width: other.width,
            height: other.height,
        })
    }
}

/// A place between four pixels of pictures of one size.
#[derive(Clone, Copy)]
pub(crate) struct Between {
    /// Index of the upper left pixel, and that of the lower left one.
    rows: [usize; 2],
    /// How far the place is from the upper left pixel, pixels.
    right: f64,
    down: f64,
}

impl Between {
    /// `None` outside the centres of the outermost pixels.
    #[inline]
    pub(crate) fn new(p: DVec2, [width, height]: [usize; 2], stride: usize) -> Option<Self> {
        let is_inside = p.x >= 0.0 && p.y >= 0.0 && p.x < width as f64 - 1.0 && p.y < height as f64 - 1.0;
        if !is_inside {
            return None;
        }
        let (x, y) = (p.x as usize, p.y as usize);
        let at = y * stride + x;
        Some(Self { rows: [at, at + stride], right: p.x - x as f64, down: p.y - y as f64 })
    }

    /// The grey value there, linear along both axes.
    #[inline]
    pub(crate) fn of(&self, data: &[u8]) -> f64 {
        let [upper, lower] = self.rows;
        let (a, b) = (f64::from(data[upper]), f64::from(data[upper + 1]));
        let (c, d) = (f64::from(data[lower]), f64::from(data[lower + 1]));
        let (above, below) = (a + self.right * (b - a), c + self.right * (d - c));
        above + self.down * (below - above)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_have_pixels() {
        let filled = |width, height| std::panic::catch_unwind(|| Image::filled(width, height, 0u8)).is_ok();
        assert!(filled(1, 3));
        assert!(![(0, 0), (0, 3), (3, 0), (1 << 32, 1 << 32)].into_iter().any(|(w, h)| filled(w, h)));
    }

    #[test]
    fn padded_rows_are_read_in_place() {
        let data = [1, 2, 9, 3, 4];
        let frame = Frame::new(&data, 2, 2, 3).unwrap();
        assert_eq!(frame.to_image().pixels(), [1, 2, 3, 4]);
    }

    #[test]
    fn a_short_buffer_says_what_came_and_what_was_wanted() {
        let error = Frame::new(&[0; 5], 3, 2, 3).unwrap_err();
        assert_eq!(error, FrameError::TooShort { width: 3, height: 2, stride: 3, needed: 6, got: 5 });
        assert!(Frame::new(&[0; 5], 0, 2, 3).is_err());
        assert!(Image::from_vec(2, 2, vec![0u8; 3]).is_err());
    }

    #[test]
    fn shapes_beyond_all_memory_are_refused() {
        let half = usize::MAX / 2 + 1;
        assert!(Frame::new(&[0; 5], 3, 2, usize::MAX - 1).is_err());
        assert!(Frame::new(&[0; 5], 3, half + 1, 4).is_err());
        assert!(Image::<u8>::from_vec(half, 2, vec![]).is_err());
    }
}
