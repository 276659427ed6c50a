//! The pixels for which the velocity field is computed.

use crate::image::edge::Window;
use crate::image::frame::Mask;

/// Pixels of the region in a window, with a free cell on every side so that every pixel has four neighbours.
#[derive(Clone)]
pub(super) struct Domain {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) is_inside: Vec<bool>,
}

impl Domain {
    pub(super) fn empty(width: usize, height: usize) -> Self {
        Self { width, height, is_inside: vec![false; (width + 2) * (height + 2)] }
    }

    pub(super) fn of_region(region: &Mask, window: &Window) -> Self {
        let mut domain = Self::empty(window.width, window.height);
        for y in 0..window.height {
            let row = &region.row(window.y + y)[window.x..window.x + window.width];
            let start = domain.cell(0, y);
            domain.is_inside[start..start + window.width].copy_from_slice(row);
        }
        domain
    }

    pub(super) fn stride(&self) -> usize {
        self.width + 2
    }

    pub(super) fn cell(&self, x: usize, y: usize) -> usize {
        (y + 1) * self.stride() + x + 1
    }

    /// Columns, rows and cells of the pixels inside, in reading order.
    pub(super) fn pixels(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        let all = (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y)));
        all.map(|(x, y)| (x, y, self.cell(x, y))).filter(|&(_, _, cell)| self.is_inside[cell])
    }

    /// Half the size; a pixel is inside if one of the four pixels it covers is inside.
    pub(super) fn halved(&self) -> Self {
        let mut half = Self::empty(self.width.div_ceil(2), self.height.div_ceil(2));
        for (x, y, _) in self.pixels() {
            let cell = half.cell(x / 2, y / 2);
            half.is_inside[cell] = true;
        }
        half
    }

    /// The cells connected to `start`, beginning with `start`.
    pub(super) fn connected_to(&self, start: usize, is_seen: &mut [bool]) -> Vec<usize> {
        let mut found = vec![start];
        is_seen[start] = true;
        let mut next = 0;
        while next < found.len() {
            let cell = found[next];
            next += 1;
            for neighbour in [cell - self.stride(), cell - 1, cell + 1, cell + self.stride()] {
                if self.is_inside[neighbour] && !is_seen[neighbour] {
                    is_seen[neighbour] = true;
                    found.push(neighbour);
                }
            }
        }
        found
    }
}
