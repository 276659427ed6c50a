//! A picture as the first view's camera would have seen it.
//!
//! The pixel of the turned camera is computed exactly, lens included, at the nodes of a grid of 16 px and linearly in
//! between: the second derivative of the map is about its displacement over the squared focal length, so that the
//! error is below 0.01 px. Grey values are interpolated from 4 x 4 pixels with the cubic kernel of Keys (1981,
//! a = -1/2): a linear one would blur the wall, differently in each frame.

use super::Turned;
use super::template::{pixel_of, ray_of};
use crate::image::{Frame, Image, Mask};
use crate::model::Camera;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Distance of the nodes, pixels.
const CELL_PX: usize = 16;
/// Positions between two pixels for which the kernel is tabulated.
const PHASES: usize = 256;

/// The rays of the nodes of a camera.
#[derive(Debug, Clone)]
pub struct Warp {
    /// (x, y, 1), row by row; `None` where the lens has no ideal pixel.
    rays: Vec<Option<DVec3>>,
    across: usize,
    kernel: Vec<[i16; 4]>,
}

impl Warp {
    /// The nodes of a camera's picture.
    pub fn new(camera: &Camera) -> Self {
        let [across, down] = camera.size.map(|side| (side as usize).div_ceil(CELL_PX) + 1);
        let ray = |k: usize| {
            let pixel = DVec2::new((k % across * CELL_PX) as f64, (k / across * CELL_PX) as f64);
            ray_of(camera, pixel)
        };
        Self { rays: (0..across * down).map(ray).collect(), across, kernel: kernel() }
    }

    /// The picture in the camera of the nodes, and the pixels that the frame, of a camera turned from it, does not show; those
    /// have the grey values of `beyond`.
    pub fn steadied(
        &self,
        frame: &Frame<'_>,
        camera: &Camera,
        turned: &Turned,
        beyond: &Image<u8>,
    ) -> (Image<u8>, Mask) {
        let place =
            |ray: &Option<DVec3>| ray.and_then(|ray| pixel_of(camera, turned, ray)).unwrap_or(DVec2::NAN);
        let places: Vec<DVec2> = self.rays.iter().map(place).collect();
        let width = beyond.width();
        let mut picture = beyond.clone();
        let mut unseen = Image::filled(width, beyond.height(), true);
        let bands = picture.pixels_mut().par_chunks_mut(CELL_PX * width);
        bands.zip(unseen.pixels_mut().par_chunks_mut(CELL_PX * width)).enumerate().for_each(
            |(band, (greys, unseen))| {
                let nodes = &places[band * self.across..(band + 2) * self.across];
                for (y, (greys, unseen)) in greys.chunks_mut(width).zip(unseen.chunks_mut(width)).enumerate()
                {
                    self.row(frame, nodes, y, greys, unseen);
                }
            },
        );
        (picture, unseen)
    }

    /// One row, `y` below the nodes of the band.
    fn row(&self, frame: &Frame<'_>, nodes: &[DVec2], y: usize, greys: &mut [u8], unseen: &mut [bool]) {
        let down = y as f64 / CELL_PX as f64;
        let (upper, lower) = nodes.split_at(self.across);
        let at = |k: usize| upper[k].lerp(lower[k], down);
        for (cell, (greys, unseen)) in greys.chunks_mut(CELL_PX).zip(unseen.chunks_mut(CELL_PX)).enumerate() {
            let (start, end) = (at(cell), at(cell + 1));
            let step = (end - start) / CELL_PX as f64;
            if !(start.is_finite() && end.is_finite()) {
                continue;
            }
            for (x, (grey, unseen)) in greys.iter_mut().zip(unseen.iter_mut()).enumerate() {
                if let Some(found) = self.cubic(frame, start + step * x as f64) {
                    (*grey, *unseen) = (found, false);
                }
            }
        }
    }

    /// The grey value at a place; `None` outside the picture.
    #[inline]
    fn cubic(&self, frame: &Frame<'_>, at: DVec2) -> Option<u8> {
        let unit = PHASES as f64;
        let (x, y) = ((at.x * unit).round() as i64, (at.y * unit).round() as i64);
        let (left, top) = (x.div_euclid(PHASES as i64), y.div_euclid(PHASES as i64));
        let (width, height) = (frame.width() as i64, frame.height() as i64);
        let is_inside =
            x >= 0 && y >= 0 && x <= (width - 1) * PHASES as i64 && y <= (height - 1) * PHASES as i64;
        if !is_inside {
            return None;
        }
        let of_x = &self.kernel[x.rem_euclid(PHASES as i64) as usize];
        let of_y = &self.kernel[y.rem_euclid(PHASES as i64) as usize];
        let mut sum = 0i32;
        if left >= 1 && top >= 1 && left + 2 < width && top + 2 < height {
            for (k, &weight) in of_y.iter().enumerate() {
                let row = &frame.row(top as usize - 1 + k)[left as usize - 1..left as usize + 3];
                let line: i32 = row.iter().zip(of_x).map(|(&grey, &w)| i32::from(grey) * i32::from(w)).sum();
                sum += ((line + 64) >> 7) * i32::from(weight);
            }
        } else {
            for (k, &weight) in of_y.iter().enumerate() {
                let row = frame.row((top - 1 + k as i64).clamp(0, height - 1) as usize);
                let grey = |i: usize| i32::from(row[(left - 1 + i as i64).clamp(0, width - 1) as usize]);
                let line: i32 = (0..4).map(|i| grey(i) * i32::from(of_x[i])).sum();
                sum += ((line + 64) >> 7) * i32::from(weight);
            }
        }
        Some(((sum + (1 << 20)) >> 21).clamp(0, 255) as u8)
    }
}

/// Weights of four pixels for each position between the middle two, in units of 2^-14.
fn kernel() -> Vec<[i16; 4]> {
    let weights = |phase: usize| {
        let t = phase as f64 / PHASES as f64;
        let (t2, t3) = (t * t, t * t * t);
        let of = [
            -0.5 * t3 + t2 - 0.5 * t,
            1.5 * t3 - 2.5 * t2 + 1.0,
            -1.5 * t3 + 2.0 * t2 + 0.5 * t,
            0.5 * t3 - 0.5 * t2,
        ];
        of.map(|w| (w * 16384.0).round() as i16)
    };
    (0..PHASES).map(weights).collect()
}
