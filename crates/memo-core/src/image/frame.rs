//! Grey images: one owned image type, one borrowed view.
//!
//! Frames arrive as 8-bit grey values because every camera and codec delivers them so and
//! because change detection is exact in integers. Derived quantities are `Image<f32>`: seven digits are more
//! than a grey value has, and half the memory traffic of `f64`.

use crate::wording::counted;
use thiserror::Error;

/// Why a frame was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The buffer is shorter than the image it should hold; for an owned image, of another length.
    #[error("a {width}x{height} frame with rows {stride} apart needs {}, got {got}", counted(*needed, "byte"))]
    TooShort {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Distance of two rows in elements.
        stride: usize,
        /// Number of elements needed.
        needed: usize,
        /// Number of elements given.
        got: usize,
    },
    /// An image side is zero, or rows overlap.
    #[error(
        "frame of {width}x{height} pixels with rows {stride} apart: sides must be positive and rows must not overlap"
    )]
    BadShape {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Distance of two rows in elements.
        stride: usize,
    },
    /// Two frames that must agree in size do not.
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
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }

    /// Takes row-major data of `width * height` elements.
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

    /// All pixels, row by row.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// One row.
    ///
    /// # Panics
    ///
    /// Below the last row.
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }

    /// One row.
    ///
    /// # Panics
    ///
    /// Below the last row.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.data[y * self.width..(y + 1) * self.width]
    }

    /// The value at column `x`, row `y`.
    ///
    /// # Panics
    ///
    /// Beyond the last pixel. That `x` is less than the width is not checked: beyond it is the next row.
    pub fn at(&self, x: usize, y: usize) -> T {
        self.data[y * self.width + x]
    }

    /// Sets the value at column `x`, row `y`.
    ///
    /// # Panics
    ///
    /// Beyond the last pixel. That `x` is less than the width is not checked: beyond it is the next row.
    pub fn set(&mut self, x: usize, y: usize, value: T) {
        self.data[y * self.width + x] = value;
    }

    /// The row-major data.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }
}

impl Image<u8> {
    /// Borrows the image as a frame.
    pub fn as_frame(&self) -> Frame<'_> {
        Frame { data: &self.data, width: self.width, height: self.height, stride: self.width }
    }
}

/// A borrowed 8-bit grey frame; rows may be padded (a video decoder's luma plane can be used in place).
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    data: &'a [u8],
    width: usize,
    height: usize,
    stride: usize,
}

impl<'a> Frame<'a> {
    /// Borrows `height` rows of `width` bytes, each starting `stride` bytes after the one before.
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
    /// Below the last row.
    pub fn row(&self, y: usize) -> &'a [u8] {
        let start = y * self.stride;
        &self.data[start..start + self.width]
    }

    /// The grey value at column `x`, row `y`.
    ///
    /// # Panics
    ///
    /// Beyond the last pixel. That `x` is less than the width is not checked: beyond it is the next row.
    pub fn at(&self, x: usize, y: usize) -> u8 {
        self.data[y * self.stride + x]
    }

    /// An owned copy without padding.
    pub fn to_image(&self) -> Image<u8> {
        let mut data = Vec::with_capacity(self.width * self.height);
        for y in 0..self.height {
            data.extend_from_slice(self.row(y));
        }
        Image { width: self.width, height: self.height, data }
    }

    /// Refuses another frame of a different size.
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

#[cfg(test)]
mod tests {
    use super::*;

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
