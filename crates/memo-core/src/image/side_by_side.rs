//! People side by side whose changes touch.
//!
//! Feet of people who walk beside or behind each other overlap in the image long before their trunks do. The upper half
//! of such a region is several areas that reach from the heads to the middle of the region, and the region is divided
//! between them (Haritaoglu, Harwood and Davis, W4, IEEE PAMI 22:809, 2000, find heads by projecting the silhouette).
//!
//! Limits: people whose trunks overlap stay one region. Below the middle, what is nearer to the other trunk's column is
//! the other's, also the foot of a long step.

use super::region::{Rectangle, Region};
use super::runs::{Connectivity, Run, connected_runs};

/// A trunk begins, with its head, in this upper share of the region: people differ by a fifth in height, and stand at several
/// distances. With 0.2, 29 walks of single people are the same, and one man in a filmed street is followed for a shorter time.
const HEAD_SHARE: f64 = 0.3;
/// It is at least so high, as a share of the region's height.
const LEAST_TRUNK: f64 = 0.2;
/// Least distance between the middles of two trunks as a share of the region's height. The front and the back of one
/// trunk, of which only the edges changed, are nearer: a trunk is a quarter of the body height wide.
const LEAST_APART: f64 = 0.3;

/// The parts of a region that are beside each other, from left to right; the region itself if it is not divided.
pub(crate) fn side_by_side(region: Region) -> Vec<Region> {
    let Rectangle { top, bottom, .. } = region.rectangle;
    let height = (bottom - top + 1) as f64;
    let middle = |trunk: &Rectangle| 0.5 * (trunk.left + trunk.right) as f64;
    // 1. Areas of the upper half that reach from a head to the middle of the region.
    let cut = top + (0.5 * height) as usize;
    let upper: Vec<Run> = region.runs.iter().copied().filter(|run| run.y < cut).collect();
    let areas = connected_runs(&upper, Connectivity::Eight).into_iter().map(Region::from_runs);
    let is_trunk = |area: &Rectangle| {
        ((area.top - top) as f64) < HEAD_SHARE * height
            && area.bottom + 1 == cut
            && area.height() as f64 >= LEAST_TRUNK * height
    };
    let mut trunks: Vec<Rectangle> = areas.map(|area| area.rectangle).filter(is_trunk).collect();
    trunks.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
    // 2. Those that are near each other are of one person.
    trunks.dedup_by(|next, kept| {
        let is_near = middle(next) - middle(kept) < LEAST_APART * height;
        if is_near {
            *kept = kept.union(next);
        }
        is_near
    });
    // 3. Borders half way between their sides, or between their middles if one is over others: an arm, an umbrella. The
    // middles increase, and so do the borders between them.
    let between = |left: fn(&Rectangle) -> usize, right: fn(&Rectangle) -> usize| -> Vec<usize> {
        trunks.windows(2).map(|pair| (left(&pair[0]) + right(&pair[1])).div_ceil(2)).collect()
    };
    let mut borders = between(|trunk| trunk.right, |trunk| trunk.left);
    if !borders.is_sorted_by(|a, b| a < b) {
        let middle = |trunk: &Rectangle| (trunk.left + trunk.right).div_ceil(2);
        borders = between(middle, middle);
    }
    if borders.is_empty() {
        return vec![region];
    }
    let mut parts = vec![Vec::new(); trunks.len()];
    for run in region.runs {
        for (k, part) in parts.iter_mut().enumerate() {
            let low = k.checked_sub(1).map_or(0, |k| borders[k]);
            let high = borders.get(k).copied().unwrap_or(usize::MAX);
            let (start, end) = (run.start.max(low), run.end.min(high));
            if start < end {
                part.push(Run { start, end, ..run });
            }
        }
    }
    parts.into_iter().filter(|part| !part.is_empty()).map(Region::from_runs).collect()
}

#[cfg(test)]
mod tests {
    use super::super::region::regions;
    use super::super::region::tests::mask_of;
    use super::*;

    /// Columns of the parts of a region drawn with `#`.
    fn parts(rows: &[&str]) -> Vec<(usize, usize)> {
        let [region] = <[Region; 1]>::try_from(regions(&mask_of(rows), 1)).unwrap();
        let (area, pixels) = (region.area, region.runs.clone());
        let parts = side_by_side(region);
        assert_eq!(parts.iter().map(|part| part.area).sum::<usize>(), area);
        for run in pixels {
            let owners = |x: usize| parts.iter().filter(|part| part.contains(x, run.y)).count();
            assert!((run.start..run.end).all(|x| owners(x) == 1), "{run:?}");
        }
        parts.iter().map(|part| (part.rectangle.left, part.rectangle.right)).collect()
    }

    #[test]
    fn two_trunks_over_crossing_legs_are_two_people() {
        let two = [
            "....##......",
            "....##....##",
            "...###....##",
            "...###...###",
            "...###...###",
            "...###..####",
            "..#####.#..#",
            ".##..####..#",
            "##.....#...#",
            "##......#..#",
        ];
        assert_eq!(parts(&two), [(0, 6), (7, 11)]);
        // The second trunk begins too far down, or does not reach the middle: a bag, an arm.
        let mut low = two;
        for row in &mut low[1..4] {
            *row = "...###......";
        }
        assert_eq!(parts(&low), [(0, 11)]);
    }

    /// The rectangle of the first trunk, with its umbrella, holds the others.
    #[test]
    fn an_umbrella_over_others_leaves_each_pixel_with_one_person() {
        let mut rows = vec![vec![b'.'; 110]; 60];
        let mut draw = |ys: std::ops::Range<usize>, xs: std::ops::Range<usize>| {
            rows[ys].iter_mut().for_each(|row| row[xs.clone()].fill(b'#'));
        };
        draw(0..60, 0..11);
        draw(0..2, 0..101);
        draw(4..60, 66..73);
        draw(4..60, 76..99);
        draw(58..60, 0..99);
        let rows: Vec<&str> = rows.iter().map(|row| std::str::from_utf8(row).unwrap()).collect();
        assert_eq!(parts(&rows), [(0, 59), (60, 77), (78, 100)]);
    }

    #[test]
    fn the_edges_of_one_trunk_are_one_person() {
        let hollow = [
            "...##....",
            "..#..#...",
            "..#..#...",
            "..#..#...",
            "..#..#...",
            "..#..#...",
            "..####...",
            "..#..#...",
            ".#....#..",
            ".#....#..",
            ".#....##.",
            "##.....##",
        ];
        assert_eq!(parts(&hollow), [(0, 8)]);
        let headless: Vec<&str> = hollow[1..].to_vec();
        assert_eq!(parts(&headless), [(0, 8)]);
    }

    #[test]
    fn three_in_a_row_are_three_people() {
        let three = [
            ".#....#....#.",
            ".#....#....#.",
            "###..###..###",
            "###..###..###",
            "###..###..###",
            "#############",
            ".#....#....#.",
            ".#....#....#.",
            ".#....#....#.",
            ".#....#....#.",
        ];
        assert_eq!(parts(&three), [(0, 3), (4, 8), (9, 12)]);
        assert_eq!(parts(&["#"]), [(0, 0)]);
    }
}
