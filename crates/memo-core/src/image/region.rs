//! Moving regions: connected areas of a change mask, their bounding rectangles, and their grouping into
//! candidates.
//!
//! Source: Rohr 1994, section 4.1: the area of the cleaned mask represents the person; its bounding rectangle
//! and its outline are computed. In real footage a person splits into several areas where clothes resemble
//! the background or where nothing moves (a foot in stance is not detected at all), so [`group_regions`]
//! joins neighbouring areas.
//!
//! Limits: people who overlap in the image are not separated, nor is a person from shadow and reflection.

#[cfg(doc)]
use super::change::CHANGE_REACH_PX;
use super::frame::{Image, Mask};
use super::outline::{Outline, outlines};
use super::runs::{Connectivity, Run, connected_runs, runs};
use crate::OptionError;
use std::cmp::Reverse;

/// An axis-aligned rectangle of whole pixels. The first and the last column and row belong to it.
///
/// The rectangle around a region of changes is larger than the moving object: by about [`CHANGE_REACH_PX`] on
/// every side, and along the motion by what the object covers in the neighbouring frames.
/// [`Rectangle::sides`] corrects the first effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rectangle {
    /// First column.
    pub left: usize,
    /// First row.
    pub top: usize,
    /// Last column.
    pub right: usize,
    /// Last row.
    pub bottom: usize,
}

impl Rectangle {
    /// Number of columns; 0 if the last one is before the first.
    pub fn width(&self) -> usize {
        self.right.checked_sub(self.left).map_or(0, |more| more + 1)
    }

    /// Number of rows; 0 if the last one is above the first.
    pub fn height(&self) -> usize {
        self.bottom.checked_sub(self.top).map_or(0, |more| more + 1)
    }

    /// The outer sides of the outermost pixels, moved inwards by `reach_px`: 0 for a silhouette,
    /// [`CHANGE_REACH_PX`] for a region of changes, where an error of 0.7 px either way remains for contrasts
    /// of 20 to 100 grey levels. A rectangle narrower than twice the reach shrinks to its middle.
    pub fn sides(&self, reach_px: f64) -> Sides {
        let shrunk = |first: usize, last: usize| {
            let (low, high) = (first as f64 - 0.5, last as f64 + 0.5);
            let reach = reach_px.min((high - low) / 2.0);
            (low + reach, high - reach)
        };
        let ((left, right), (top, bottom)) = (shrunk(self.left, self.right), shrunk(self.top, self.bottom));
        Sides { left, top, right, bottom }
    }

    /// The smallest rectangle that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }

    /// Free columns and rows between two rectangles; 0 where they overlap or touch.
    pub fn gap(&self, other: &Self) -> [usize; 2] {
        let free = |end: usize, start: usize| start.saturating_sub(end + 1);
        [
            free(self.right, other.left).max(free(other.right, self.left)),
            free(self.bottom, other.top).max(free(other.bottom, self.top)),
        ]
    }
}

/// The sides of an axis-aligned rectangle in pixel coordinates; pixel centres are at integer coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sides {
    /// Column of the left side.
    pub left: f64,
    /// Row of the upper side.
    pub top: f64,
    /// Column of the right side.
    pub right: f64,
    /// Row of the lower side.
    pub bottom: f64,
}

impl Sides {
    /// Area of the intersection of two boxes over that of their union.
    pub fn overlap(&self, other: &Self) -> f64 {
        let shared = self.shared_area(other);
        shared / (self.area() + other.area() - shared)
    }

    /// Area of the intersection of two boxes over that of the smaller one.
    pub fn overlap_of_smaller(&self, other: &Self) -> f64 {
        self.shared_area(other) / self.area().min(other.area())
    }

    /// Distance of the upper side from the lower one.
    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    fn area(&self) -> f64 {
        (self.right - self.left) * self.height()
    }

    fn shared_area(&self, other: &Self) -> f64 {
        let shared = |low: f64, high: f64| (high - low).max(0.0);
        let width = shared(self.left.max(other.left), self.right.min(other.right));
        width * shared(self.top.max(other.top), self.bottom.min(other.bottom))
    }
}

/// A set of pixels that represents one moving object: a connected area, or several areas grouped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Region {
    /// Its pixels, row by row and left to right.
    pub runs: Vec<Run>,
    /// The smallest rectangle that holds them.
    pub rectangle: Rectangle,
    /// Number of pixels.
    pub area: usize,
}

impl Region {
    /// From at least one run, in any order; no two may overlap.
    pub(super) fn from_runs(mut runs: Vec<Run>) -> Self {
        runs.sort_unstable();
        let rectangle = enclosing(&runs).unwrap_or(Rectangle { left: 0, top: 0, right: 0, bottom: 0 });
        let area = runs.iter().map(|run| run.end - run.start).sum();
        Self { runs, rectangle, area }
    }

    /// Regions that do not overlap, as one; `None` without any.
    pub(crate) fn of_parts(parts: Vec<Self>) -> Option<Self> {
        (!parts.is_empty()).then(|| Self::from_runs(parts.into_iter().flat_map(|part| part.runs).collect()))
    }

    /// Whether a pixel belongs to the region.
    pub fn contains(&self, x: usize, y: usize) -> bool {
        let after = self.runs.partition_point(|run| (run.y, run.start) <= (y, x));
        after.checked_sub(1).is_some_and(|i| self.runs[i].y == y && x < self.runs[i].end)
    }

    /// The region as a mask of the given size; pixels outside it are dropped.
    ///
    /// # Panics
    ///
    /// If a side is zero, or a run ends before it starts.
    pub fn mask(&self, width: usize, height: usize) -> Mask {
        let mut mask = Image::filled(width, height, false);
        for run in self.runs.iter().filter(|run| run.y < height && run.start < width) {
            mask.row_mut(run.y)[run.start..run.end.min(width)].fill(true);
        }
        mask
    }

    /// The borders of the region in frame coordinates; see [`outlines`]. None without runs.
    ///
    /// # Panics
    ///
    /// If a run ends before it starts.
    pub fn outlines(&self) -> Vec<Outline> {
        if self.runs.is_empty() {
            return Vec::new();
        }
        let Self { mut runs, rectangle, .. } = Self::from_runs(self.runs.clone());
        let Rectangle { left, top, .. } = rectangle;
        for run in &mut runs {
            *run = Run { y: run.y - top, start: run.start - left, end: run.end - left };
        }
        let local = Self::from_runs(runs).mask(rectangle.width(), rectangle.height());
        let mut outlines = outlines(&local);
        for [x, y] in outlines.iter_mut().flat_map(|outline| &mut outline.pixels) {
            *x += left;
            *y += top;
        }
        outlines
    }
}

/// The connected areas (8 neighbours) with at least `min_area` pixels, largest first; areas of equal size
/// from top to bottom.
pub fn regions(mask: &Mask, min_area: usize) -> Vec<Region> {
    let areas = connected_runs(&runs(mask, true), Connectivity::Eight);
    let mut regions: Vec<Region> = areas.into_iter().map(Region::from_runs).collect();
    regions.retain(|region| region.area >= min_area);
    regions.sort_by_key(|region| Reverse(region.area));
    regions
}

/// Options for grouping areas into candidates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupOptions {
    /// Areas smaller than this are joined to no group, pixels: noise far from a person would enlarge the
    /// rectangle. Default 16: less than a shoe leaves after the 5x5 windows have widened it, more than most
    /// specks that remain after cleaning.
    pub min_part_area: usize,
    /// Groups smaller than this are no candidates, pixels. The default 150 is a person 30 pixels high; below
    /// that height no limb is visible.
    pub min_area: usize,
    /// Largest vertical gap between a group and a further area, as a fraction of the group's height. Default
    /// 0.3: the shank of a trouser leg that resembles the floor may be missing.
    pub gap_y: f64,
    /// Largest horizontal gap between a group and a further area, as a fraction of the group's height.
    /// Default 0.05: wide enough for a forearm, narrower than the space between two people side by side.
    pub gap_x: f64,
    /// Largest ratio of width to height of a group after an area is added. Default 0.75: a long step
    /// including what the neighbouring frames add; two people side by side, or a row of small objects, are
    /// wider.
    pub max_aspect: f64,
}

impl Default for GroupOptions {
    fn default() -> Self {
        Self { min_part_area: 16, min_area: 150, gap_y: 0.3, gap_x: 0.05, max_aspect: 0.75 }
    }
}

impl GroupOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        OptionError::unless_at_least_0("gap_y", self.gap_y)?;
        OptionError::unless_at_least_0("gap_x", self.gap_x)?;
        OptionError::unless_positive("max_aspect", self.max_aspect)
    }
}

/// Joins regions whose rectangles overlap or nearly touch into upright candidates, largest first.
///
/// The largest region takes in the areas that are near enough, largest first, until none is left; then the
/// largest remaining region does the same, and so on.
///
/// # Errors
///
/// An option is outside its range.
///
/// # Panics
///
/// If a run of a region ends before it starts.
pub fn group_regions(regions: &[Region], options: &GroupOptions) -> Result<Vec<Region>, OptionError> {
    options.check()?;
    Ok(group_regions_of(regions, options, |_| true))
}

/// The same by options that were checked, but no group takes in an area with which its rectangle cannot be that of one object.
pub(crate) fn group_regions_of(
    regions: &[Region],
    options: &GroupOptions,
    can_be_one: impl Fn(&Rectangle) -> bool,
) -> Vec<Region> {
    let mut parts: Vec<&Region> = regions.iter().filter(|part| part.area >= options.min_part_area).collect();
    parts.sort_by_key(|part| (Reverse(part.area), part.runs.first().copied()));
    let mut groups = Vec::new();
    while !parts.is_empty() {
        let mut members = vec![parts.remove(0)];
        let mut whole = members[0].rectangle;
        while let Some(i) = parts.iter().position(|part| {
            let joined = whole.union(&part.rectangle);
            belongs(&whole, &part.rectangle, options) && (joined == whole || can_be_one(&joined))
        }) {
            whole = whole.union(&parts[i].rectangle);
            members.push(parts.remove(i));
        }
        groups.push(Region::from_runs(members.iter().flat_map(|part| part.runs.iter().copied()).collect()));
    }
    groups.retain(|group| group.area >= options.min_area);
    groups.sort_by_key(|group| (Reverse(group.area), group.runs.first().copied()));
    groups
}

/// Whether an area is near enough to a group and leaves the group upright.
fn belongs(group: &Rectangle, part: &Rectangle, options: &GroupOptions) -> bool {
    let height = group.height() as f64;
    let [gap_x, gap_y] = group.gap(part);
    let whole = group.union(part);
    let is_upright =
        whole.width() <= group.width() || whole.width() as f64 <= options.max_aspect * whole.height() as f64;
    gap_x as f64 <= options.gap_x * height && gap_y as f64 <= options.gap_y * height && is_upright
}

/// The bounding rectangle of all runs, which are ordered by row.
pub(super) fn enclosing(runs: &[Run]) -> Option<Rectangle> {
    Some(Rectangle {
        left: runs.iter().map(|run| run.start).min()?,
        top: runs.first()?.y,
        right: runs.iter().map(|run| run.end - 1).max()?,
        bottom: runs.last()?.y,
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::image::change::{CHANGE_REACH_PX, ChangeOptions, pair_changes};
    use proptest::prelude::*;
    use std::collections::VecDeque;

    /// A mask drawn with `#` for marked pixels.
    pub fn mask_of(rows: &[&str]) -> Mask {
        let pixels = rows.iter().flat_map(|row| row.bytes().map(|c| c == b'#')).collect();
        Image::from_vec(rows[0].len(), rows.len(), pixels).unwrap()
    }

    #[test]
    fn boxes_overlap_by_their_common_area_over_all_of_it() {
        let own = Sides { left: 0.0, top: 0.0, right: 4.0, bottom: 3.0 };
        let beside = |by: f64| Sides { left: own.left + by, right: own.right + by, ..own };
        assert_eq!([0.0, 2.0, 4.0, 9.0].map(|by| own.overlap(&beside(by))), [1.0, 6.0 / 18.0, 0.0, 0.0]);
        let inside = Sides { left: 1.0, top: 1.0, right: 2.0, bottom: 2.0 };
        assert_eq!([own.overlap(&inside), inside.overlap(&own)], [1.0 / 12.0; 2]);
    }

    /// Masks from nearly empty to nearly full, wide enough for whole blocks.
    pub fn random_mask() -> impl Strategy<Value = Mask> {
        (1usize..90, 1usize..24, 0.02f64..0.98).prop_flat_map(|(w, h, density)| {
            proptest::collection::vec(proptest::bool::weighted(density), w * h)
                .prop_map(move |pixels| Image::from_vec(w, h, pixels).unwrap())
        })
    }

    /// Connected areas as sorted pixel lists, by breadth-first search.
    fn areas_by_search(mask: &Mask) -> Vec<Vec<(usize, usize)>> {
        let mut left = mask.clone();
        let mut areas = Vec::new();
        for (x, y) in (0..mask.height()).flat_map(|y| (0..mask.width()).map(move |x| (x, y))) {
            let (mut queue, mut area) = (VecDeque::from([(x, y)]), Vec::new());
            while let Some((x, y)) = queue.pop_front() {
                if x < mask.width() && y < mask.height() && left.at(x, y) {
                    left.set(x, y, false);
                    area.push((y, x));
                    let near = (0..9).map(|i| ((x + i % 3).wrapping_sub(1), (y + i / 3).wrapping_sub(1)));
                    queue.extend(near);
                }
            }
            if !area.is_empty() {
                area.sort_unstable();
                areas.push(area);
            }
        }
        areas
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        #[test]
        fn regions_are_the_areas_a_search_finds(mask in random_mask(), min_area in 1usize..6) {
            let mut expected = areas_by_search(&mask);
            expected.retain(|area| area.len() >= min_area);
            expected.sort_by_key(|area| Reverse(area.len()));
            let found = regions(&mask, min_area);
            prop_assert_eq!(found.len(), expected.len());
            for (region, pixels) in found.iter().zip(&expected) {
                let own = region.runs.iter().flat_map(|run| (run.start..run.end).map(|x| (run.y, x)));
                prop_assert_eq!(&own.collect::<Vec<_>>(), pixels);
                prop_assert_eq!(region.area, pixels.len());
                let columns = || pixels.iter().map(|&(_, x)| x);
                let rectangle = Rectangle {
                    left: columns().min().unwrap(),
                    top: pixels[0].0,
                    right: columns().max().unwrap(),
                    bottom: pixels[pixels.len() - 1].0,
                };
                prop_assert_eq!(region.rectangle, rectangle);
            }
        }

        #[test]
        fn masks_and_membership_agree(mask in random_mask()) {
            let mut all = Image::filled(mask.width(), mask.height(), false);
            for region in regions(&mask, 1) {
                let own = region.mask(mask.width(), mask.height());
                for (i, pixel) in all.pixels_mut().iter_mut().enumerate() {
                    let (x, y) = (i % mask.width(), i / mask.width());
                    prop_assert_eq!(region.contains(x, y), own.at(x, y));
                    *pixel |= own.at(x, y);
                }
            }
            prop_assert_eq!(all, mask);
        }
    }

    #[test]
    fn a_row_of_things_is_no_person() {
        let row: Vec<Region> = (0..8).map(|i| block(40 + 32 * i, 90, 30, 14)).collect();
        assert_eq!(group_regions(&row, &GroupOptions::default()).unwrap(), row);
    }

    /// A frame of 110 grey levels with a disc of radius 20 around (x, y); the pixels on its border are
    /// weighted by 8x8 samples.
    fn disc(x: f64, y: f64, contrast: f64) -> Image<u8> {
        let covered = |column: usize, row: usize| {
            let inside = |i: usize| {
                let sample = |pixel: usize, i: usize| pixel as f64 + (i as f64 + 0.5) / 8.0 - 0.5;
                (sample(column, i % 8) - x).powi(2) + (sample(row, i / 8) - y).powi(2) < 400.0
            };
            (0..64).filter(|&i| inside(i)).count() as f64 / 64.0
        };
        let pixels = (0..80 * 80).map(|i| (110.0 + contrast * covered(i % 80, i / 80)).round() as u8);
        Image::from_vec(80, 80, pixels.collect()).unwrap()
    }

    #[test]
    fn corrected_sides_lie_at_the_edges_of_a_moving_disc() {
        let options = ChangeOptions { threshold: Some(4.0), ..ChangeOptions::default() };
        for (contrast, tolerance) in [(20.0, 1.1), (50.0, 0.7), (100.0, 0.7)] {
            for i in 0..8 {
                let y = 40.0 + i as f64 / 8.0;
                let (a, b) = (disc(36.0, y, contrast), disc(42.0, y, contrast));
                let mask = pair_changes(&a.as_frame(), &b.as_frame(), &options).unwrap();
                let found = group_regions(
                    &regions(&mask, 1),
                    &GroupOptions { max_aspect: 2.0, gap_x: 1.0, ..GroupOptions::default() },
                )
                .unwrap();
                let sides = found[0].rectangle.sides(CHANGE_REACH_PX);
                assert!((sides.top - (y - 20.0)).abs() < tolerance, "{contrast} {y} {sides:?}");
                assert!((sides.bottom - (y + 20.0)).abs() < tolerance, "{contrast} {y} {sides:?}");
                assert!((sides.left - 16.0).abs() < tolerance, "{contrast} {y} {sides:?}");
                assert!((sides.right - 62.0).abs() < tolerance, "{contrast} {y} {sides:?}");
            }
        }
    }

    fn block(left: usize, top: usize, width: usize, height: usize) -> Region {
        Region::from_runs((top..top + height).map(|y| Run { y, start: left, end: left + width }).collect())
    }

    #[test]
    fn a_person_in_pieces_is_one_candidate_and_two_people_are_two() {
        let trunk = block(100, 50, 30, 60);
        let (shoe, neighbour, speck) = (block(95, 125, 12, 8), block(140, 50, 30, 80), block(131, 60, 3, 3));
        let groups =
            group_regions(&[trunk.clone(), shoe.clone(), neighbour.clone(), speck], &GroupOptions::default())
                .unwrap();
        assert_eq!(groups.len(), 2);
        assert_eq!(groups[0], neighbour);
        assert_eq!(groups[1].rectangle, trunk.rectangle.union(&shoe.rectangle));
        assert_eq!(groups[1].area, trunk.area + shoe.area);
    }

    #[test]
    fn group_options_outside_their_ranges_are_refused() {
        let usual = GroupOptions::default();
        for (name, options) in [
            ("gap_x", GroupOptions { gap_x: f64::NAN, ..usual }),
            ("gap_y", GroupOptions { gap_y: -0.1, ..usual }),
            ("max_aspect", GroupOptions { max_aspect: 0.0, ..usual }),
        ] {
            assert_eq!(group_regions(&[], &options).unwrap_err().name, name);
        }
    }

    /// All fields of regions and rectangles are public.
    #[test]
    fn regions_that_nobody_found_have_no_pixels_or_those_of_their_runs() {
        let nowhere = Rectangle { left: 9, top: 9, right: 3, bottom: 8 };
        assert_eq!([nowhere.width(), nowhere.height()], [0, 0]);
        let empty = Region { runs: Vec::new(), rectangle: nowhere, area: 400 };
        assert_eq!(group_regions(&[empty.clone(), empty.clone()], &GroupOptions::default()), Ok(Vec::new()));
        assert!(empty.outlines().is_empty());
        let found = block(20, 30, 5, 4);
        let mut runs = found.runs.clone();
        runs.reverse();
        assert_eq!(Region { runs, rectangle: nowhere, ..found.clone() }.outlines(), found.outlines());
    }

    #[test]
    fn areas_that_cannot_be_one_object_stay_apart() {
        let (near, far) = (block(100, 100, 30, 80), block(105, 30, 28, 65));
        let parts = [near.clone(), far.clone()];
        assert_eq!(group_regions(&parts, &GroupOptions::default()).unwrap().len(), 1);
        let is_low = |whole: &Rectangle| whole.height() <= 100;
        assert_eq!(group_regions_of(&parts, &GroupOptions::default(), is_low), [near.clone(), far]);
        // What is inside a group's rectangle makes it no taller: here between the bars of an L.
        let bars = [block(100, 100, 10, 120), block(100, 210, 40, 10)];
        let l = Region::from_runs(bars.iter().flat_map(|bar| bar.runs.iter().copied()).collect());
        let parts = [l, block(112, 150, 20, 30)];
        assert_eq!(group_regions_of(&parts, &GroupOptions::default(), |_| false).len(), 1);
    }

    #[test]
    fn grouping_does_not_depend_on_the_order() {
        let parts =
            [block(100, 50, 30, 60), block(95, 125, 12, 20), block(120, 160, 12, 20), block(300, 0, 20, 40)];
        let groups = group_regions(&parts, &GroupOptions::default()).unwrap();
        let mut reversed = parts;
        reversed.reverse();
        assert_eq!(groups, group_regions(&reversed, &GroupOptions::default()).unwrap());
        assert_eq!(groups.iter().map(|group| group.rectangle.height()).collect::<Vec<_>>(), [130, 40]);
    }

    #[test]
    fn outlines_are_in_frame_coordinates() {
        let outlines = block(7, 5, 2, 2).outlines();
        assert_eq!(outlines.len(), 1);
        assert_eq!(outlines[0].pixels, [[7, 5], [7, 6], [8, 6], [8, 5]]);
    }

    fn group_sizes(parts: &[Region]) -> Vec<usize> {
        let areas = group_regions(parts, &GroupOptions::default()).unwrap();
        areas.iter().map(|group| group.area).collect()
    }

    /// By default a group takes in areas up to 5 % of its height beside it and up to 30 % above or below it,
    /// and stays no wider than 75 % of its height.
    #[test]
    fn areas_are_joined_up_to_the_default_gaps() {
        let body = || block(100, 50, 40, 100);
        for (gap, is_one) in [(0, true), (5, true), (6, false), (30, false)] {
            for left in [140 + gap, 90 - gap] {
                let found = group_sizes(&[body(), block(left, 60, 10, 50)]);
                assert_eq!(found.len() == 1, is_one, "{gap} beside: {found:?}");
            }
        }
        for (gap, is_one) in [(0, true), (30, true), (31, false)] {
            for top in [150 + gap, 40 - gap] {
                let found = group_sizes(&[body(), block(110, top, 20, 10)]);
                assert_eq!(found.len() == 1, is_one, "{gap} above or below: {found:?}");
            }
        }
        for (width, is_one) in [(35, true), (36, false)] {
            let found = group_sizes(&[body(), block(140, 50, width, 100)]);
            assert_eq!(found.len() == 1, is_one, "{width} wide: {found:?}");
        }
        // A group that is already wide may still grow downwards.
        assert_eq!(group_sizes(&[block(0, 0, 90, 100), block(20, 105, 50, 20)]), [10_000]);
        assert_eq!(group_sizes(&[block(0, 0, 90, 100), block(20, 105, 70, 20)]), [10_400]);
    }

    /// A gap is measured relative to the grown group: a chain of small gaps reaches far.
    #[test]
    fn a_grown_group_reaches_farther() {
        let parts = [block(100, 50, 40, 100), block(105, 178, 30, 30), block(105, 255, 30, 20)];
        assert_eq!(group_sizes(&parts), [5500]);
        // Without the middle part, 105 rows are free.
        assert_eq!(group_sizes(&[parts[0].clone(), parts[2].clone()]), [4000, 600]);
    }

    #[test]
    fn small_areas_neither_join_nor_are_candidates() {
        let body = || block(100, 50, 40, 100);
        assert_eq!(group_sizes(&[body(), block(110, 152, 4, 4)]), [4016]);
        assert_eq!(group_sizes(&[body(), block(110, 152, 5, 3)]), [4000]);
        assert_eq!(group_sizes(&[block(0, 0, 10, 15)]), [150]);
        assert!(group_sizes(&[block(0, 0, 149, 1)]).is_empty());
    }
}
