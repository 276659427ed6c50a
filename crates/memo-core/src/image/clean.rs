//! Binary image operations that turn a change mask into solid areas.
//!
//! Source: Rohr 1994, section 4.1: detected pixels with a small number of detected neighbours in the 3x3
//! window are deleted, and undetected pixels with a large number are marked, recursively, because each step
//! changes the numbers of its neighbours. Remaining holes are filled by a separate algorithm. The paper does
//! not print the thresholds.
//!
//! The recursion terminates. Let m be the number of marked pixels, p the number of marked neighbour pairs,
//! and c = (few + many) / 2. Deleting a pixel with n <= few neighbours changes E = c m - p by n - c; marking
//! one with n >= many changes it by c - n. With few < many both lower E by at least 1/2, and E cannot fall
//! below -4 times the number of pixels. The result may depend on the order of steps, which is fixed: row by
//! row, then first come, first served.
//!
//! Limits: two people who touch become one area, and a person of low contrast becomes several.

use super::frame::{Image, Mask};
use super::region::{self, Rectangle};
use super::runs::{Connectivity, connected_runs, runs};
use crate::OptionError;
use std::collections::VecDeque;

/// Numbers of neighbours at which a pixel changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CleanOptions {
    /// A marked pixel with at most this many marked neighbours out of 8 is deleted. The default 2 removes
    /// specks, lines and spurs one pixel wide and keeps every corner of an area at least two pixels wide.
    pub few: u8,
    /// An unmarked pixel with at least this many marked neighbours out of 8 is marked; 9 marks none. The
    /// default 5 closes slots up to three pixels wide and leaves straight edges and outer corners unchanged.
    pub many: u8,
}

impl Default for CleanOptions {
    fn default() -> Self {
        Self { few: 2, many: 5 }
    }
}

impl CleanOptions {
    /// Refuses thresholds with which the recursion could run for ever, and numbers of neighbours that no pixel has.
    pub fn check(&self) -> Result<(), OptionError> {
        OptionError::unless(self.few < self.many, "few", "less than many", f64::from(self.few))?;
        OptionError::unless(self.many <= 9, "many", "at most 9", f64::from(self.many))
    }
}

/// Deletes pixels with few neighbours and marks pixels with many until neither is left. Pixels outside
/// the mask count as unmarked.
pub fn clean(mask: &Mask, options: &CleanOptions) -> Result<Mask, OptionError> {
    options.check()?;
    let many = options.many;
    let Some(marked) = region::enclosing(&runs(mask, true)) else { return Ok(mask.clone()) };
    // A pixel outside the rectangle has at most 3 marked neighbours, so it stays unmarked.
    let area = if many > 3 { marked } else { whole(mask) };
    let mut grid = NeighbourGrid::new(mask, &area);
    grid.settle(options);
    let mut cleaned = Image::filled(mask.width(), mask.height(), false);
    grid.write_marks(&mut cleaned, &area);
    Ok(cleaned)
}

fn whole(mask: &Mask) -> Rectangle {
    Rectangle { left: 0, top: 0, right: mask.width() - 1, bottom: mask.height() - 1 }
}

/// Added to the number of neighbours of a pixel that is itself marked.
const MARKED: u8 = 16;
/// Value of the rim, which is not marked and never changes.
const RIM: u8 = 128;

/// For each pixel the number of marked neighbours, plus [`MARKED`], inside a rim one pixel wide.
struct NeighbourGrid {
    width: usize,
    state: Vec<u8>,
}

impl NeighbourGrid {
    fn new(mask: &Mask, area: &Rectangle) -> Self {
        let (width, height) = (area.width() + 2, area.height() + 2);
        let mut grid = Self { width, state: vec![RIM; width * height] };
        let mut padded = vec![0u8; width * height];
        for y in 0..area.height() {
            let row = &mut padded[(y + 1) * width + 1..][..area.width()];
            let marks = &mask.row(area.top + y)[area.left..=area.right];
            row.iter_mut().zip(marks).for_each(|(pixel, &marked)| *pixel = u8::from(marked));
        }
        let mut columns = vec![0u8; width];
        for y in 1..height - 1 {
            let [above, row, below] = [y - 1, y, y + 1].map(|y| &padded[y * width..][..width]);
            for x in 0..width {
                columns[x] = above[x] + row[x] + below[x];
            }
            let states = &mut grid.state[y * width..][..width];
            for x in 1..width - 1 {
                states[x] = columns[x - 1] + columns[x] + columns[x + 1] + (MARKED - 1) * row[x];
            }
        }
        grid
    }

    /// Deletes and marks pixels until no pixel changes.
    fn settle(&mut self, options: &CleanOptions) {
        let mut unstable = self.unstable(options);
        while let Some(at) = unstable.pop_front() {
            if self.is_unstable(at, options) {
                self.flip(at);
                unstable.extend(self.neighbours(at).filter(|&near| self.is_unstable(near, options)));
            }
        }
    }

    fn is_unstable(&self, at: usize, options: &CleanOptions) -> bool {
        is_unstable(self.state[at], options)
    }

    /// The pixels to change, row by row. Rows are searched in blocks, most of which contain none.
    fn unstable(&self, options: &CleanOptions) -> VecDeque<usize> {
        const BLOCK: usize = 64;
        let mut found = VecDeque::new();
        for (i, block) in self.state.chunks(BLOCK).enumerate() {
            if block.iter().fold(false, |any, &state| any | is_unstable(state, options)) {
                let unstable = (0..block.len()).filter(|&j| is_unstable(block[j], options));
                found.extend(unstable.map(|j| i * BLOCK + j));
            }
        }
        found
    }

    fn neighbours(&self, at: usize) -> impl Iterator<Item = usize> + use<> {
        let width = self.width;
        let above = at - width;
        let below = at + width;
        [above - 1, above, above + 1, at - 1, at + 1, below - 1, below, below + 1].into_iter()
    }

    fn flip(&mut self, at: usize) {
        self.state[at] ^= MARKED;
        let marked = self.state[at] & MARKED != 0;
        for near in self.neighbours(at) {
            if self.state[near] & RIM == 0 {
                self.state[near] = if marked { self.state[near] + 1 } else { self.state[near] - 1 };
            }
        }
    }

    fn write_marks(&self, mask: &mut Mask, area: &Rectangle) {
        for y in 0..area.height() {
            let states = &self.state[(y + 1) * self.width + 1..][..area.width()];
            let row = &mut mask.row_mut(area.top + y)[area.left..=area.right];
            for (pixel, state) in row.iter_mut().zip(states) {
                *pixel = state & MARKED != 0;
            }
        }
    }
}

fn is_unstable(state: u8, options: &CleanOptions) -> bool {
    let deleted = (MARKED..=MARKED + options.few).contains(&state);
    let marked = (options.many..MARKED).contains(&state);
    deleted | marked
}

/// Marks every unmarked area enclosed by marked pixels: an area from which no path of horizontal and vertical
/// steps over unmarked pixels leads to the border of the mask.
pub fn fill_holes(mask: &Mask) -> Mask {
    let (right, bottom) = (mask.width(), mask.height() - 1);
    let mut filled = mask.clone();
    for area in connected_runs(&runs(mask, false), Connectivity::Four) {
        let at_edge =
            |run: &super::runs::Run| run.start == 0 || run.end == right || run.y == 0 || run.y == bottom;
        if !area.iter().any(at_edge) {
            for run in area {
                filled.row_mut(run.y)[run.start..run.end].fill(true);
            }
        }
    }
    filled
}

/// Marks every pixel within a Euclidean distance of `radius_px` of a marked pixel; a radius below 1 changes
/// nothing.
pub fn dilate(mask: &Mask, radius_px: f64) -> Mask {
    let mut dilated = mask.clone();
    let (width, height) = (mask.width(), mask.height());
    let radius = radius_px.clamp(0.0, (width + height) as f64);
    for run in runs(mask, true) {
        let reach = radius as usize;
        for y in run.y.saturating_sub(reach)..(run.y + reach + 1).min(height) {
            let rise = y.abs_diff(run.y) as f64;
            let half = (radius * radius - rise * rise).sqrt() as usize;
            let end = (run.end + half).min(width);
            dilated.row_mut(y)[run.start.saturating_sub(half)..end].fill(true);
        }
    }
    dilated
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::region::tests::{mask_of, random_mask};
    use proptest::prelude::*;

    fn neighbour_number(mask: &Mask, x: usize, y: usize) -> u8 {
        let columns = x.saturating_sub(1)..(x + 2).min(mask.width());
        let rows = y.saturating_sub(1)..(y + 2).min(mask.height());
        let near = rows.flat_map(|v| columns.clone().map(move |u| (u, v)));
        near.filter(|&(u, v)| (u, v) != (x, y) && mask.at(u, v)).count() as u8
    }

    /// Unmarked pixels that a walk from the border reaches, one pixel at a time.
    fn outside(mask: &Mask) -> Mask {
        let (w, h) = (mask.width(), mask.height());
        let mut reached = Image::filled(w, h, false);
        let mut stack: Vec<_> = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).collect();
        stack.retain(|&(x, y)| x == 0 || y == 0 || x == w - 1 || y == h - 1);
        while let Some((x, y)) = stack.pop() {
            if !mask.at(x, y) && !reached.at(x, y) {
                reached.set(x, y, true);
                stack.extend([(x.saturating_sub(1), y), (x, y.saturating_sub(1))]);
                stack.extend([((x + 1).min(w - 1), y), (x, (y + 1).min(h - 1))]);
            }
        }
        reached
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn a_clean_mask_is_stable(mask in random_mask(), few in 0u8..4, gap in 1u8..6) {
            let options = CleanOptions { few, many: few + gap };
            let cleaned = clean(&mask, &options).unwrap();
            for (i, &marked) in cleaned.pixels().iter().enumerate() {
                let n = neighbour_number(&cleaned, i % mask.width(), i / mask.width());
                let is_stable = if marked { n > options.few } else { n < options.many };
                prop_assert!(is_stable);
            }
            prop_assert_eq!(&clean(&cleaned, &options).unwrap(), &cleaned);
        }

        #[test]
        fn free_surroundings_change_nothing(mask in random_mask(), few in 0u8..4, many in 4u8..10) {
            let options = CleanOptions { few, many };
            let amid = |mask: &Mask| {
                let mut larger = Image::filled(mask.width() + 5, mask.height() + 4, false);
                for y in 0..mask.height() {
                    larger.row_mut(y + 1)[3..3 + mask.width()].copy_from_slice(mask.row(y));
                }
                larger
            };
            let mut grid = NeighbourGrid::new(&mask, &whole(&mask));
            grid.settle(&options);
            let mut cleaned = mask.clone();
            grid.write_marks(&mut cleaned, &whole(&mask));
            prop_assert_eq!(&clean(&mask, &options).unwrap(), &cleaned);
            prop_assert_eq!(clean(&amid(&mask), &options).unwrap(), amid(&cleaned));
        }

        #[test]
        fn filled_is_all_that_the_edge_does_not_reach(mask in random_mask()) {
            let (filled, outside) = (fill_holes(&mask), outside(&mask));
            prop_assert!(filled.pixels().iter().zip(outside.pixels()).all(|(filled, outside)| filled != outside));
        }

        #[test]
        fn dilation_marks_all_within_the_radius(mask in random_mask(), radius in 0.0f64..6.0) {
            let dilated = dilate(&mask, radius);
            let (w, h) = (mask.width(), mask.height());
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                let near = (0..w * h).filter(|&i| mask.pixels()[i]).any(|i| {
                    let (dx, dy) = ((i % w).abs_diff(x) as f64, (i / w).abs_diff(y) as f64);
                    dx * dx + dy * dy <= radius * radius
                });
                prop_assert_eq!(dilated.at(x, y), near);
            }
        }
    }

    #[test]
    fn specks_go_and_slots_close() {
        let mask = mask_of(&["...........", ".#..###.###", "....###.###", "....#######", "....#######"]);
        let cleaned = mask_of(&["...........", "....#######", "....#######", "....#######", "....#######"]);
        assert_eq!(clean(&mask, &CleanOptions::default()).unwrap(), cleaned);
    }

    #[test]
    fn rectangles_survive() {
        let mask = mask_of(&["......", ".###..", ".###..", "......"]);
        assert_eq!(clean(&mask, &CleanOptions::default()).unwrap(), mask);
    }

    #[test]
    fn thresholds_that_meet_are_refused() {
        let mask = mask_of(&["#"]);
        let error = clean(&mask, &CleanOptions { few: 4, many: 4 }).unwrap_err();
        assert_eq!(error, OptionError { name: "few", wanted: "less than many", got: 4.0 });
    }

    /// Larger numbers would count the rim around the mask among the marked pixels.
    #[test]
    fn more_neighbours_than_eight_are_refused() {
        let mask = mask_of(&["##", "##"]);
        for (few, many) in [(2, 10), (112, 113), (240, 241), (254, 255)] {
            let error = clean(&mask, &CleanOptions { few, many }).unwrap_err();
            assert_eq!(error, OptionError { name: "many", wanted: "at most 9", got: f64::from(many) });
        }
        assert_eq!(clean(&mask, &CleanOptions { few: 8, many: 9 }).unwrap(), Image::filled(2, 2, false));
    }

    /// Pixels with up to two of eight neighbours are deleted: lines of one pixel from end to end, and spurs.
    #[test]
    fn thin_lines_go() {
        let mut mask = Image::filled(30, 20, false);
        mask.row_mut(10)[3..27].fill(true);
        let cleaned = clean(&mask, &CleanOptions::default()).unwrap();
        assert!(cleaned.pixels().iter().all(|p| !p));
        (9..12).for_each(|y| mask.row_mut(y)[3..15].fill(true));
        let cleaned = clean(&mask, &CleanOptions::default()).unwrap();
        // Corners have three neighbours and remain; so does the pixel of the line that touches the block.
        assert_eq!(cleaned.pixels().iter().filter(|p| **p).count(), 3 * 12 + 1);
    }
}
