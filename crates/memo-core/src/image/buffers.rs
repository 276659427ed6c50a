//! Frames from and pictures to the buffers of the [`image`](::image) crate (feature `image`).

use super::frame::{Frame, FrameError, Image, Mask};
use ::image::{GrayImage, Luma};

/// Borrows the grey values in place.
///
/// # Errors
///
/// A picture without pixels.
impl<'a> TryFrom<&'a GrayImage> for Frame<'a> {
    type Error = FrameError;

    fn try_from(picture: &'a GrayImage) -> Result<Self, FrameError> {
        let [width, height] = [picture.width(), picture.height()].map(|side| side as usize);
        Self::new(picture.as_raw(), width, height, width)
    }
}

/// Takes the grey values over without a copy.
///
/// # Errors
///
/// A picture without pixels.
impl TryFrom<GrayImage> for Image<u8> {
    type Error = FrameError;

    fn try_from(picture: GrayImage) -> Result<Self, FrameError> {
        let [width, height] = [picture.width(), picture.height()].map(|side| side as usize);
        Self::from_vec(width, height, picture.into_raw())
    }
}

/// A copy of the frame, without the padding of its rows.
impl From<&Frame<'_>> for GrayImage {
    fn from(frame: &Frame<'_>) -> Self {
        drawn(frame.width(), frame.height(), |x, y| frame.at(x, y))
    }
}

/// A copy of the image.
impl From<&Image<u8>> for GrayImage {
    fn from(image: &Image<u8>) -> Self {
        (&image.as_frame()).into()
    }
}

/// 255 where a pixel is marked, else 0.
impl From<&Mask> for GrayImage {
    fn from(mask: &Mask) -> Self {
        drawn(mask.width(), mask.height(), |x, y| if mask.at(x, y) { 255 } else { 0 })
    }
}

/// Marks the pixels of 255, or of any other value than 0, as masks drawn by hand have them.
///
/// # Errors
///
/// A picture without pixels.
impl TryFrom<&GrayImage> for Mask {
    type Error = FrameError;

    fn try_from(picture: &GrayImage) -> Result<Self, FrameError> {
        let marks = picture.as_raw().iter().map(|&grey| grey > 0).collect();
        Self::from_vec(picture.width() as usize, picture.height() as usize, marks)
    }
}

fn drawn(width: usize, height: usize, grey: impl Fn(usize, usize) -> u8) -> GrayImage {
    // No side is longer than a u32 can say: the pixels would not fit in memory.
    GrayImage::from_fn(width as u32, height as u32, |x, y| Luma([grey(x as usize, y as usize)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> GrayImage {
        GrayImage::from_fn(5, 3, |x, y| Luma([(10 * y + x) as u8]))
    }

    #[test]
    fn a_frame_borrows_the_picture_and_gives_it_back() {
        let picture = picture();
        let frame = Frame::try_from(&picture).unwrap();
        assert_eq!((frame.width(), frame.height(), frame.at(4, 2)), (5, 3, 24));
        assert_eq!(frame.row(0).as_ptr(), picture.as_raw().as_ptr(), "no copy");
        assert_eq!(GrayImage::from(&frame), picture);
        let padded = [1, 2, 0, 3, 4];
        let frame = Frame::new(&padded, 2, 2, 3).unwrap();
        assert_eq!(GrayImage::from(&frame).into_raw(), [1, 2, 3, 4]);
    }

    #[test]
    fn an_image_takes_the_pixels_over() {
        let picture = picture();
        let address = picture.as_raw().as_ptr();
        let image = Image::<u8>::try_from(picture).unwrap();
        assert_eq!((image.pixels().as_ptr(), image.at(1, 2)), (address, 21));
        assert_eq!(GrayImage::from(&image), self::picture());
    }

    #[test]
    fn masks_are_black_and_white() {
        let mut mask = Mask::filled(5, 3, false);
        mask.set(2, 1, true);
        let shown = GrayImage::from(&mask);
        assert_eq!((shown.get_pixel(2, 1), shown.get_pixel(1, 1)), (&Luma([255]), &Luma([0])));
        assert_eq!(Mask::try_from(&shown).unwrap(), mask);
    }

    #[test]
    fn a_picture_without_pixels_is_refused() {
        let empty = GrayImage::new(0, 4);
        assert!(Frame::try_from(&empty).is_err());
        assert!(Image::<u8>::try_from(empty.clone()).is_err() && Mask::try_from(&empty).is_err());
    }
}
