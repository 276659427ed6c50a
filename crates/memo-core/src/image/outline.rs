//! Outlines: the ordered pixels along the borders of marked areas.
//!
//! Border following of Suzuki and Abe 1985 (step 3): it walks along the border pixels of an area (8
//! neighbours) with the unmarked side always on the same hand. The start of each border is known from the
//! connected areas of marked and of unmarked pixels, so the paper's labels of borders already followed are
//! not needed. The nesting of borders is not computed.

use super::frame::Mask;
use super::runs::{Connectivity, Run, connected_runs, runs};

/// One border. Consecutive pixels are neighbours, as are the last and the first. Where the area is one pixel
/// wide, a pixel occurs twice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outline {
    /// Column and row of each border pixel; all are marked. Outer borders run anticlockwise in the image as
    /// seen and start in the top row of the area; borders of holes run clockwise and start on the left of the
    /// top row of the hole.
    pub pixels: Vec<[usize; 2]>,
    /// Whether this is the border of a hole.
    pub is_hole: bool,
}

/// The outer border of each connected area (8 neighbours), then the border of each hole (4 neighbours), each
/// from top to bottom.
pub fn outlines(mask: &Mask) -> Vec<Outline> {
    let first_pixel = |area: Vec<Run>| [area[0].start, area[0].y];
    let outer = connected_runs(&runs(mask, true), Connectivity::Eight).into_iter().map(first_pixel);
    let mut outlines: Vec<Outline> =
        outer.map(|start| Outline { pixels: follow(mask, start, WEST), is_hole: false }).collect();
    let (right, bottom) = (mask.width(), mask.height() - 1);
    let is_inside = |run: &Run| run.start > 0 && run.end < right && run.y > 0 && run.y < bottom;
    for area in connected_runs(&runs(mask, false), Connectivity::Four) {
        if area.iter().all(is_inside) {
            let [x, y] = first_pixel(area);
            outlines.push(Outline { pixels: follow(mask, [x - 1, y], EAST), is_hole: true });
        }
    }
    outlines
}

/// Steps to the eight neighbours, clockwise in the image as seen.
const STEPS: [[isize; 2]; 8] = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];
const EAST: usize = 0;
const WEST: usize = 4;

/// The border through `start`; its unmarked side lies in the direction `unmarked` from `start`.
fn follow(mask: &Mask, start: [usize; 2], unmarked: usize) -> Vec<[usize; 2]> {
    let clockwise = (1..8).map(|turn| (unmarked + turn) % 8);
    let Some(to_last) = clockwise.into_iter().find(|&direction| neighbour(mask, start, direction).is_some())
    else {
        return vec![start];
    };
    let mut pixels = vec![start];
    let (mut at, mut back) = (start, to_last);
    loop {
        let (next, direction) = next_anticlockwise(mask, at, back);
        // Closed: the next step leads from the last pixel of the border to its start.
        if next == start && Some(at) == neighbour(mask, start, to_last) {
            return pixels;
        }
        pixels.push(next);
        (at, back) = (next, (direction + 4) % 8);
    }
}

/// The first marked neighbour of `at`, anticlockwise from the direction `back`, which itself leads to a
/// marked pixel.
fn next_anticlockwise(mask: &Mask, at: [usize; 2], back: usize) -> ([usize; 2], usize) {
    let directions = (1..8).map(|turn| (back + 8 - turn) % 8);
    let found = directions.into_iter().find_map(|d| neighbour(mask, at, d).map(|next| (next, d)));
    found.or_else(|| neighbour(mask, at, back).map(|next| (next, back))).unwrap_or((at, back))
}

/// The neighbour in a direction, if it lies inside the mask and is marked.
fn neighbour(mask: &Mask, [x, y]: [usize; 2], direction: usize) -> Option<[usize; 2]> {
    let [dx, dy] = STEPS[direction];
    let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
    (x < mask.width() && y < mask.height() && mask.at(x, y)).then_some([x, y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::fill_holes;
    use crate::image::region::tests::{mask_of, random_mask};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Twice the signed area of a closed chain, positive when clockwise in the image as seen.
    fn doubled_area(pixels: &[[usize; 2]]) -> isize {
        let next = pixels.iter().cycle().skip(1);
        let cross = |(a, b): (&[usize; 2], &[usize; 2])| (a[0] * b[1]) as isize - (b[0] * a[1]) as isize;
        pixels.iter().zip(next).map(cross).sum()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn outlines_are_closed_chains_over_all_border_pixels(mask in random_mask()) {
            let found = outlines(&mask);
            for outline in &found {
                let pixels = &outline.pixels;
                for (a, b) in pixels.iter().zip(pixels.iter().cycle().skip(1)) {
                    prop_assert!(a[0].abs_diff(b[0]) <= 1 && a[1].abs_diff(b[1]) <= 1);
                    prop_assert!(pixels.len() == 1 || a != b);
                    prop_assert!(mask.at(a[0], a[1]));
                }
                let area = doubled_area(pixels);
                let turns_as_stated = if outline.is_hole { area >= 0 } else { area <= 0 };
                prop_assert!(turns_as_stated);
            }
            let followed: BTreeSet<_> = found.iter().flat_map(|outline| outline.pixels.clone()).collect();
            let expected: BTreeSet<_> = border_pixels(&mask).into_iter().collect();
            prop_assert_eq!(followed, expected);
        }

        #[test]
        fn outer_borders_are_those_of_the_filled_mask(mask in random_mask()) {
            let outer: Vec<_> = outlines(&fill_holes(&mask)).into_iter().collect();
            prop_assert!(outer.iter().all(|outline| !outline.is_hole));
            let border: BTreeSet<_> = border_pixels(&fill_holes(&mask)).into_iter().collect();
            prop_assert_eq!(outer.into_iter().flat_map(|outline| outline.pixels).collect::<BTreeSet<_>>(), border);
        }
    }

    /// Marked pixels with an unmarked neighbour, or the border of the mask, on one of four sides.
    fn border_pixels(mask: &Mask) -> Vec<[usize; 2]> {
        let marked = |x: Option<usize>, y: Option<usize>| match (x, y) {
            (Some(x), Some(y)) => x < mask.width() && y < mask.height() && mask.at(x, y),
            _ => false,
        };
        let inner = |[x, y]: [usize; 2]| {
            marked(x.checked_sub(1), Some(y))
                && marked(Some(x + 1), Some(y))
                && marked(Some(x), y.checked_sub(1))
                && marked(Some(x), Some(y + 1))
        };
        let all = (0..mask.height()).flat_map(|y| (0..mask.width()).map(move |x| [x, y]));
        all.filter(|&pixel| mask.at(pixel[0], pixel[1]) && !inner(pixel)).collect()
    }

    #[test]
    fn a_ring_has_an_outer_border_and_a_hole() {
        let found = outlines(&mask_of(&["###", "#.#", "###"]));
        let outer = vec![[0, 0], [0, 1], [0, 2], [1, 2], [2, 2], [2, 1], [2, 0], [1, 0]];
        let hole = vec![[0, 1], [1, 0], [2, 1], [1, 2]];
        assert_eq!(
            found,
            [Outline { pixels: outer, is_hole: false }, Outline { pixels: hole, is_hole: true }]
        );
    }

    #[test]
    fn a_line_is_walked_there_and_back() {
        let found = outlines(&mask_of(&["....", ".###", "...."]));
        assert_eq!(found[0].pixels, [[1, 1], [2, 1], [3, 1], [2, 1]]);
        assert_eq!(outlines(&mask_of(&["...", ".#.", "..."]))[0].pixels, [[1, 1]]);
    }
}
