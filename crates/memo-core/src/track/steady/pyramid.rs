//! A picture at half, quarter, ... resolution.
//!
//! Each level halves the one below with the kernel (1, 3, 3, 1) / 8 along x and y, so that the centre of a pixel of the
//! upper level is the common corner of four pixels of the lower one: u_upper = (u_lower - 1/2) / 2.

use crate::image::{Frame, Image};

/// A picture and its reductions, the finest first.
#[derive(Debug)]
pub struct Pyramid<'a> {
    finest: Frame<'a>,
    reduced: Vec<Image<u8>>,
}

impl<'a> Pyramid<'a> {
    /// A picture with `levels` levels in all.
    pub fn new(finest: Frame<'a>, levels: usize) -> Self {
        let mut reduced: Vec<Image<u8>> = Vec::with_capacity(levels);
        for _ in 1..levels {
            let next = halved(&reduced.last().map_or(finest, Image::as_frame));
            reduced.push(next);
        }
        Self { finest, reduced }
    }

    /// The picture of a level; level 0 is the finest.
    pub fn level(&self, level: usize) -> Frame<'_> {
        if level == 0 { self.finest } else { self.reduced[level - 1].as_frame() }
    }

    /// The picture of the last level.
    pub fn coarsest(&self) -> Frame<'_> {
        self.level(self.levels() - 1)
    }

    /// Number of levels.
    pub fn levels(&self) -> usize {
        self.reduced.len() + 1
    }
}

/// A pixel of the finest level in pixels of a level.
pub fn at_level(pixel: f64, level: usize) -> f64 {
    (pixel + 0.5) / f64::from(1u32 << level) - 0.5
}

/// A pixel of a level in pixels of the finest level.
pub fn at_finest(pixel: f64, level: usize) -> f64 {
    (pixel + 0.5) * f64::from(1u32 << level) - 0.5
}

/// The picture at half its width and height, both rounded down. Beyond the border the border pixels are repeated.
fn halved(frame: &Frame<'_>) -> Image<u8> {
    let (width, height) = (frame.width() / 2, frame.height() / 2);
    let mut out = Image::filled(width, height, 0u8);
    let mut columns = vec![0u16; frame.width()];
    for y in 0..height {
        let row = |k: usize| frame.row((2 * y + k).saturating_sub(1).min(frame.height() - 1));
        let [a, b, c, d] = [0, 1, 2, 3].map(row);
        for (x, sum) in columns.iter_mut().enumerate() {
            *sum = u16::from(a[x]) + 3 * (u16::from(b[x]) + u16::from(c[x])) + u16::from(d[x]);
        }
        let at = |x: usize| u32::from(columns[x.min(columns.len() - 1)]);
        for (x, grey) in out.row_mut(y).iter_mut().enumerate() {
            let sum = at((2 * x).saturating_sub(1)) + 3 * (at(2 * x) + at(2 * x + 1)) + at(2 * x + 2);
            *grey = ((sum + 32) / 64) as u8;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_stays_a_ramp_at_the_places_of_the_levels() {
        let ramp = Image::from_vec(64, 48, (0..64 * 48).map(|i| (3 * (i % 64) + i / 64) as u8).collect());
        let ramp = ramp.unwrap();
        let pyramid = Pyramid::new(ramp.as_frame(), 3);
        assert_eq!(pyramid.levels(), 3);
        for level in 1..3 {
            let frame = pyramid.level(level);
            for (x, y) in [(3, 3), (7, 5), (9, 8)] {
                let [u, v] = [x, y].map(|p| at_finest(p as f64, level));
                assert!((f64::from(frame.at(x, y)) - (3.0 * u + v)).abs() <= 1.0, "{level} {x} {y}");
                assert!((at_level(u, level) - x as f64).abs() < 1e-12);
            }
        }
    }
}
