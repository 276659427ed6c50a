//! Frames of fewer pixels: each is the mean of n by n.

use super::frame::{Frame, Image};
use crate::OptionError;

/// Means of `n` by `n` grey values, rounded to the nearest, halves up. Columns at the right and rows at the bottom
/// that do not fill `n` are left out.
///
/// # Errors
///
/// `n` is zero or more than a side of the frame.
pub fn shrunk(frame: &Frame<'_>, n: usize) -> Result<Image<u8>, OptionError> {
    let most = frame.width().min(frame.height());
    if !(1..=most).contains(&n) {
        return Err(OptionError {
            name: "shrink",
            wanted: "1 to the shorter side of the frame",
            got: n as f64,
        });
    }
    let (width, height) = (frame.width() / n, frame.height() / n);
    let mut small = Image::filled(width, height, 0u8);
    let mut sums = vec![0u64; width];
    let (count, half) = ((n * n) as u64, (n * n / 2) as u64);
    for y in 0..height {
        sums.fill(half);
        for row in (y * n..(y + 1) * n).map(|y| frame.row(y)) {
            for (sum, pixels) in sums.iter_mut().zip(row.chunks_exact(n)) {
                *sum += u64::from(pixels.iter().map(|grey| u32::from(*grey)).sum::<u32>());
            }
        }
        for (pixel, sum) in small.row_mut(y).iter_mut().zip(&sums) {
            *pixel = (sum / count) as u8;
        }
    }
    Ok(small)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_rounded_and_a_rest_is_left_out() {
        // Rows are four apart, of which three are pixels; the last column and row do not fill two.
        let data = [1, 2, 9, 0, 3, 4, 9, 0, 9, 9, 9, 0];
        let frame = Frame::new(&data, 3, 3, 4).unwrap();
        let small = shrunk(&frame, 2).unwrap();
        assert_eq!((small.width(), small.height(), small.pixels()), (1, 1, &[3u8][..]), "2.5 rounds up");
        assert_eq!(shrunk(&frame, 1).unwrap(), frame.to_image());
        assert_eq!(shrunk(&frame, 3).unwrap().pixels(), [6], "55 / 9");
    }

    #[test]
    fn white_stays_white_however_many_pixels_are_averaged() {
        let white = Image::filled(700, 650, 255u8);
        for n in [2, 17, 300, 650] {
            assert!(shrunk(&white.as_frame(), n).unwrap().pixels().iter().all(|grey| *grey == 255), "{n}");
        }
    }

    #[test]
    fn numbers_that_leave_no_pixel_are_refused() {
        let frame = Image::filled(4, 3, 7u8);
        for n in [0, 4, usize::MAX] {
            let error = shrunk(&frame.as_frame(), n).unwrap_err();
            assert_eq!((error.name, error.got), ("shrink", n as f64));
        }
    }
}
