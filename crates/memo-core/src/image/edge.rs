//! Edge points: where the magnitude of the grey-value gradient is largest across the edge, located to a
//! fraction of a pixel and linked into chains.
//!
//! The image is differentiated with the gradient of a Gaussian of one given scale, thinned across the edge
//! and cleared of faint points by hysteresis. The remaining points are linked along the edge.
//!
//! Sources: Rohr 1994, section 4.3; Korn, "Toward a symbolic representation of intensity changes in images",
//! PAMI 10, 1988 (gradient of Gaussian); Canny, PAMI 8, 1986 (hysteresis); Devernay, INRIA RR-2724, 1995
//! (thinning and localising along the image axis nearest to the gradient).
//!
//! Limits: there is one scale only; Korn's selection of the best scale for each point is not implemented. Two
//! edges closer than about 2 sigma shift each other, corners are rounded over about sigma, and lines thinner
//! than about 2 sigma give two edges.

use super::frame::{Frame, FrameError, Mask};
use crate::OptionError;
use glam::Vec2;
use std::ops::Range;
use thiserror::Error;

/// Why edge detection failed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EdgeError {
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The mask differs in size from the frame.
    #[error(transparent)]
    Mask(#[from] FrameError),
}

/// Smallest and largest allowed scale, pixels: below the smallest, the Gaussian falls between the pixels.
const SIGMA_PX: (f32, f32) = (0.4, 50.0);

/// Options for edge detection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeOptions {
    /// Scale of the Gaussian, pixels. Default 1: finer scales follow sensor noise; at 2 px the two edges of a
    /// limb 4 px wide shift each other apart.
    pub sigma_px: f32,
    /// Smallest gradient of an edge point, grey levels per pixel. Default 5: at sigma = 1, noise of 5 grey
    /// levels leaves a gradient of 1 along either axis, and a step of 13 grey levels passes.
    pub low: f32,
    /// Gradient that at least one point of a connected edge must reach, grey levels per pixel. Default 12: a
    /// step of 31 grey levels.
    pub high: f32,
}

impl Default for EdgeOptions {
    fn default() -> Self {
        Self { sigma_px: 1.0, low: 5.0, high: 12.0 }
    }
}

impl EdgeOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let Self { sigma_px, low, high } = *self;
        let is_sampled = (SIGMA_PX.0..=SIGMA_PX.1).contains(&sigma_px);
        OptionError::unless(is_sampled, "sigma_px", "between 0.4 and 50 px", f64::from(sigma_px))?;
        OptionError::unless_positive("low", f64::from(low))?;
        let is_above = low <= high && high.is_finite();
        OptionError::unless(is_above, "high", "at least low, and finite", f64::from(high))
    }
}

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

/// The part of the frame to search for edges: the intersection of the fields that are set, the whole frame by
/// default.
///
/// The Gaussian also reads grey values outside the domain, so an edge found here is the same as in the whole
/// frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct EdgeDomain<'a> {
    /// Pixels that may be edge points.
    pub mask: Option<&'a Mask>,
    /// Rectangle that may hold edge points; only this rectangle is computed.
    pub window: Option<Window>,
}

/// An edge point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edgel {
    /// Image position, pixels, with subpixel precision across the edge.
    pub position_px: Vec2,
    /// Gradient of the smoothed image, grey levels per pixel; it points to the brighter side.
    pub gradient: Vec2,
}

impl Edgel {
    /// Direction of the edge (not normalised), with the brighter side on its right as seen in the image.
    pub fn tangent(&self) -> Vec2 {
        -self.gradient.perp()
    }
}

/// Edge points in order along their edges, as chains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EdgeChains {
    edgels: Vec<Edgel>,
    ends: Vec<usize>,
}

impl EdgeChains {
    /// The chains. Each runs with the brighter side on its right as seen in the image; none contains a
    /// junction.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[Edgel]> {
        (0..self.ends.len()).map(|i| {
            let start = if i == 0 { 0 } else { self.ends[i - 1] };
            &self.edgels[start..self.ends[i]]
        })
    }

    /// A single chain of the given edge points.
    #[cfg(test)]
    pub(super) fn single(edgels: &[Edgel]) -> Self {
        Self { edgels: edgels.to_vec(), ends: vec![edgels.len()] }
    }

    /// All edge points, chain after chain.
    pub fn edgels(&self) -> &[Edgel] {
        &self.edgels
    }
}

/// Finds the edges of a frame and links them into chains.
///
/// 1. Gradient of Gaussian and its local maxima across the edge, above the low threshold.
/// 2. Hysteresis: connected maxima stay if one of them reaches the high threshold.
/// 3. Each point is linked to its successor and predecessor along the edge.
///
/// # Errors
///
/// Options out of range, or a mask that differs in size from the frame.
pub fn edge_chains(
    frame: &Frame<'_>,
    domain: &EdgeDomain<'_>,
    options: &EdgeOptions,
) -> Result<EdgeChains, EdgeError> {
    options.check()?;
    let Some(window) = window_of_domain(frame, domain)? else {
        return Ok(EdgeChains::default());
    };
    let mut maxima = pulp::Arch::new().dispatch(FindMaxima { frame, window, mask: domain.mask, options });
    maxima.drop_faint(options.high);
    let links = maxima.link();
    Ok(maxima.chains(&links))
}

/// The rectangle that holds every pixel of the domain, `None` if there is none.
fn window_of_domain(frame: &Frame<'_>, domain: &EdgeDomain<'_>) -> Result<Option<Window>, EdgeError> {
    let (width, height) = (frame.width(), frame.height());
    let asked = domain.window.unwrap_or(Window { x: 0, y: 0, width, height });
    let (x0, y0) = (asked.x.min(width), asked.y.min(height));
    let x1 = asked.x.saturating_add(asked.width).min(width);
    let y1 = asked.y.saturating_add(asked.height).min(height);
    let window = Window { x: x0, y: y0, width: x1 - x0, height: y1 - y0 };
    let window = match domain.mask {
        Some(mask) => shrink_to_mask(frame, window, mask)?,
        None => window,
    };
    Ok((window.width > 0 && window.height > 0).then_some(window))
}

/// The smallest rectangle that holds the mask's pixels inside `window`.
fn shrink_to_mask(frame: &Frame<'_>, window: Window, mask: &Mask) -> Result<Window, EdgeError> {
    if (mask.width(), mask.height()) != (frame.width(), frame.height()) {
        return Err(EdgeError::Mask(FrameError::SizeChanged {
            expected_width: frame.width(),
            expected_height: frame.height(),
            width: mask.width(),
            height: mask.height(),
        }));
    }
    let (mut x0, mut x1, mut y0, mut y1) = (usize::MAX, 0, usize::MAX, 0);
    for y in window.y..window.y + window.height {
        let row = &mask.row(y)[window.x..window.x + window.width];
        let Some(first) = row.iter().position(|&m| m) else { continue };
        let last = row.iter().rposition(|&m| m).unwrap_or(first);
        (x0, x1) = (x0.min(window.x + first), x1.max(window.x + last + 1));
        (y0, y1) = (y0.min(y), y + 1);
    }
    Ok(Window { x: x0.min(x1), y: y0.min(y1), width: x1.saturating_sub(x0), height: y1.saturating_sub(y0) })
}

/// One half (0..=radius) of the sampled Gaussian g(k) ~ exp(-k^2 / 2 sigma^2) and of its derivative ~ k g(k),
/// scaled so that a constant is preserved and a ramp of 1 grey/px has slope 1.
struct Taps {
    smooth: Vec<f32>,
    slope: Vec<f32>,
}

impl Taps {
    /// Truncates at 3 sigma, where a step of 255 grey levels still contributes 0.3 grey levels.
    fn new(sigma_px: f32) -> Self {
        let radius = (3.0 * sigma_px).ceil() as usize;
        let gauss = |k: usize| (-((k * k) as f32) / (2.0 * sigma_px * sigma_px)).exp();
        let sum: f32 = gauss(0) + 2.0 * (1..=radius).map(gauss).sum::<f32>();
        let moment: f32 = 2.0 * (1..=radius).map(|k| (k * k) as f32 * gauss(k)).sum::<f32>();
        Self {
            smooth: (0..=radius).map(|k| gauss(k) / sum).collect(),
            slope: (0..=radius).map(|k| k as f32 * gauss(k) / moment).collect(),
        }
    }

    fn radius(&self) -> usize {
        self.smooth.len() - 1
    }
}

/// Columns computed together: one register of the widest vectors, two or four registers of narrower ones.
const BLOCK: usize = 16;

/// A frame row after filtering along x.
#[derive(Clone)]
struct FilteredRow {
    smooth: Vec<f32>,
    slope: Vec<f32>,
}

/// The gradient along a row and its squared magnitude.
#[derive(Clone)]
struct GradientRow {
    x: Vec<f32>,
    y: Vec<f32>,
    magnitude_sq: Vec<f32>,
}

/// The search for gradient maxima, compiled for each vector width.
struct FindMaxima<'a> {
    frame: &'a Frame<'a>,
    window: Window,
    mask: Option<&'a Mask>,
    options: &'a EdgeOptions,
}

impl pulp::WithSimd for FindMaxima<'_> {
    type Output = Maxima;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Maxima {
        gradient_maxima(self.frame, &self.window, self.mask, self.options)
    }
}

/// Gradient maxima inside `window`, above the low threshold.
///
/// Rows are streamed: each row is filtered along x once, and only the rows that the filter along y needs are
/// kept. The rows are one pixel wider than the window on either side, because the test for a maximum reads
/// the neighbours.
#[inline(always)]
fn gradient_maxima(frame: &Frame<'_>, window: &Window, mask: Option<&Mask>, options: &EdgeOptions) -> Maxima {
    let taps = Taps::new(options.sigma_px);
    let radius = taps.radius();
    let width = (window.width + 2).next_multiple_of(BLOCK);
    let zeros = vec![0.0f32; width];
    let mut grey = vec![0.0f32; width + 2 * radius];
    let mut filtered = vec![FilteredRow { smooth: zeros.clone(), slope: zeros.clone() }; 2 * radius + 1];
    let mut gradient = vec![GradientRow { x: zeros.clone(), y: zeros.clone(), magnitude_sq: zeros }; 3];
    let mut maxima = Maxima::new(*window);
    let first = window.y as isize - 1 - radius as isize;
    let last = (window.y + window.height + radius) as isize;
    for y in first..=last {
        filtered.rotate_left(1);
        let frame_row = frame.row(y.clamp(0, frame.height() as isize - 1) as usize);
        pad_row(frame_row, window.x as isize - 1 - radius as isize, &mut grey);
        filter_along_row(&grey, &taps, &mut filtered[2 * radius]);
        if y >= first + 2 * radius as isize {
            gradient.rotate_left(1);
            filter_across_rows(&filtered, &taps, &mut gradient[2]);
        }
        if y >= first + 2 * radius as isize + 2 {
            maxima.collect_row((y as usize) - radius - 1, &gradient, mask, options.low);
        }
    }
    maxima
}

/// The grey values from column `x0` on; beyond the sides of the frame the border value is repeated.
#[inline(always)]
fn pad_row(row: &[u8], x0: isize, grey: &mut [f32]) {
    let left = ((-x0).max(0) as usize).min(grey.len());
    let from = (x0.max(0) as usize).min(row.len());
    let count = (row.len() - from).min(grey.len() - left);
    grey[..left].fill(f32::from(row[0]));
    for (g, &value) in grey[left..left + count].iter_mut().zip(&row[from..from + count]) {
        *g = f32::from(value);
    }
    grey[left + count..].fill(f32::from(row[row.len() - 1]));
}

/// smooth = g * I and slope = g' * I along x.
#[inline(always)]
fn filter_along_row(grey: &[f32], taps: &Taps, out: &mut FilteredRow) {
    let radius = taps.radius();
    let blocks = out.smooth.chunks_exact_mut(BLOCK).zip(out.slope.chunks_exact_mut(BLOCK));
    for (block, (smooth, slope)) in blocks.enumerate() {
        let centre = block * BLOCK + radius;
        let (mut g, mut d) = ([0.0f32; BLOCK], [0.0f32; BLOCK]);
        for i in 0..BLOCK {
            g[i] = taps.smooth[0] * grey[centre..centre + BLOCK][i];
        }
        for k in 1..=radius {
            let right = &grey[centre + k..centre + k + BLOCK];
            let left = &grey[centre - k..centre - k + BLOCK];
            for i in 0..BLOCK {
                g[i] += taps.smooth[k] * (right[i] + left[i]);
                d[i] += taps.slope[k] * (right[i] - left[i]);
            }
        }
        smooth.copy_from_slice(&g);
        slope.copy_from_slice(&d);
    }
}

/// `I_x = g * (g' * I)` and `I_y = g' * (g * I)`: the inner factor was applied along x, the outer one is
/// applied along y.
#[inline(always)]
fn filter_across_rows(rows: &[FilteredRow], taps: &Taps, out: &mut GradientRow) {
    let radius = taps.radius();
    for start in (0..out.x.len()).step_by(BLOCK) {
        let block = start..start + BLOCK;
        let (mut dx, mut dy) = ([0.0f32; BLOCK], [0.0f32; BLOCK]);
        let centre = &rows[radius].slope[block.clone()];
        for i in 0..BLOCK {
            dx[i] = taps.smooth[0] * centre[i];
        }
        for k in 1..=radius {
            let (below, above) = (&rows[radius + k], &rows[radius - k]);
            let (slope_below, slope_above) = (&below.slope[block.clone()], &above.slope[block.clone()]);
            let (smooth_below, smooth_above) = (&below.smooth[block.clone()], &above.smooth[block.clone()]);
            for i in 0..BLOCK {
                dx[i] += taps.smooth[k] * (slope_below[i] + slope_above[i]);
                dy[i] += taps.slope[k] * (smooth_below[i] - smooth_above[i]);
            }
        }
        for ((magnitude_sq, dx), dy) in out.magnitude_sq[block.clone()].iter_mut().zip(dx).zip(dy) {
            *magnitude_sq = dx * dx + dy * dy;
        }
        out.x[block.clone()].copy_from_slice(&dx);
        out.y[block].copy_from_slice(&dy);
    }
}

/// Free cells around the grid, so that neighbour searches need no bounds checks.
const MARGIN: usize = 2;

/// Marks a missing edge point.
const NONE: u32 = u32::MAX;

/// Edge points and the pixels they belong to.
struct Maxima {
    window: Window,
    edgels: Vec<Edgel>,
    /// The grid cell of each edge point.
    cells: Vec<usize>,
    /// For each pixel of the window, with margin: the index of its edge point plus one; 0 without an edge
    /// point.
    grid: Vec<u32>,
}

impl Maxima {
    fn new(window: Window) -> Self {
        let grid = vec![0; (window.width + 2 * MARGIN) * (window.height + 2 * MARGIN)];
        Self { window, edgels: Vec::new(), cells: Vec::new(), grid }
    }

    fn stride(&self) -> usize {
        self.window.width + 2 * MARGIN
    }

    /// Adds the maxima of frame row `y`, the middle one of the three rows. Blocks below the threshold are
    /// skipped.
    #[inline(always)]
    fn collect_row(&mut self, y: usize, rows: &[GradientRow], mask: Option<&Mask>, low: f32) {
        let width = self.window.width;
        for start in (1..=width).step_by(BLOCK) {
            let block = start..(start + BLOCK).min(width + 1);
            let magnitudes_sq = &rows[1].magnitude_sq[block.clone()];
            if magnitudes_sq.iter().fold(false, |is_any, &m| is_any | (m >= low * low)) {
                self.collect_block(y, block, rows, mask, low);
            }
        }
    }

    /// The magnitude is compared along the image axis nearest to the gradient. Along a straight edge this
    /// finds the same points as a comparison along the gradient, one per row or column, without
    /// interpolation.
    fn collect_block(
        &mut self,
        y: usize,
        block: Range<usize>,
        rows: &[GradientRow],
        mask: Option<&Mask>,
        low: f32,
    ) {
        let [above, row, below] = rows else { return };
        for i in block {
            let (here, x) = (row.magnitude_sq[i], self.window.x + i - 1);
            if here < low * low || mask.is_some_and(|m| !m.at(x, y)) {
                continue;
            }
            let gradient = Vec2::new(row.x[i], row.y[i]);
            let along_x = gradient.x.abs() >= gradient.y.abs();
            let (before, after, axis) = if along_x {
                (row.magnitude_sq[i - 1], row.magnitude_sq[i + 1], Vec2::X)
            } else {
                (above.magnitude_sq[i], below.magnitude_sq[i], Vec2::Y)
            };
            if here > before && here >= after {
                let position_px = Vec2::new(x as f32, y as f32) + peak_offset(before, here, after) * axis;
                self.push(x, y, Edgel { position_px, gradient });
            }
        }
    }

    fn push(&mut self, x: usize, y: usize, edgel: Edgel) {
        let cell = (y - self.window.y + MARGIN) * self.stride() + x - self.window.x + MARGIN;
        self.edgels.push(edgel);
        self.cells.push(cell);
        self.grid[cell] = self.edgels.len() as u32;
    }

    /// Hysteresis: removes the edge points that are not connected, over neighbouring edge points, to an edge
    /// point of gradient `high`.
    fn drop_faint(&mut self, high: f32) {
        let mut is_kept: Vec<bool> =
            self.edgels.iter().map(|e| e.gradient.length_squared() >= high * high).collect();
        let mut open: Vec<usize> = (0..is_kept.len()).filter(|&i| is_kept[i]).collect();
        while let Some(i) = open.pop() {
            self.for_each_neighbour(i, 1, |j| {
                if !is_kept[j] {
                    is_kept[j] = true;
                    open.push(j);
                }
            });
        }
        for (&cell, _) in self.cells.iter().zip(&is_kept).filter(|&(_, &kept)| !kept) {
            self.grid[cell] = 0;
        }
    }

    /// Visits the edge points within `reach` pixels of edge point `i`, except `i` itself.
    #[inline(always)]
    fn for_each_neighbour(&self, i: usize, reach: usize, mut visit: impl FnMut(usize)) {
        let (cell, stride) = (self.cells[i], self.stride());
        let corner = cell - reach * stride - reach;
        for row in 0..=2 * reach {
            for &number in &self.grid[corner + row * stride..][..=2 * reach] {
                if number != 0 && number as usize != i + 1 {
                    visit(number as usize - 1);
                }
            }
        }
    }

    fn is_kept(&self, i: usize) -> bool {
        self.grid[self.cells[i]] != 0
    }

    /// Links neighbours first, then bridges gaps of one pixel between the remaining ends.
    fn link(&self) -> Links {
        let mut links =
            Links { next: vec![NONE; self.edgels.len()], previous: vec![NONE; self.edgels.len()] };
        self.link_within(1, &mut links);
        self.link_within(2, &mut links);
        links
    }

    /// Links each free end to the best free start within `reach` that in turn prefers this end to all others.
    /// At a junction only one pair prefers each other, so the other chains end there.
    fn link_within(&self, reach: usize, links: &mut Links) {
        let kept = || (0..self.edgels.len()).filter(|&i| self.is_kept(i));
        let mut best = Links { next: links.next.clone(), previous: links.previous.clone() };
        for i in kept().filter(|&i| links.next[i] == NONE || links.previous[i] == NONE) {
            (best.next[i], best.previous[i]) = self.best_neighbours(i, reach, links);
        }
        for i in kept() {
            let j = best.next[i];
            if j != NONE && best.previous[j as usize] == i as u32 {
                links.next[i] = j;
                links.previous[j as usize] = i as u32;
            }
        }
    }

    /// The successor and the predecessor that edge point `i` prefers among the free ones.
    fn best_neighbours(&self, i: usize, reach: usize, links: &Links) -> (u32, u32) {
        let (mut next, mut previous) = (links.next[i], links.previous[i]);
        let (mut next_cost, mut previous_cost) = (f32::INFINITY, f32::INFINITY);
        self.for_each_neighbour(i, reach, |j| {
            let Some(step) = step_between(&self.edgels[i], &self.edgels[j]) else { return };
            if step.is_forward {
                let is_free = links.next[i] == NONE && links.previous[j] == NONE;
                if is_free && step.cost < next_cost {
                    (next, next_cost) = (j as u32, step.cost);
                }
            } else {
                let is_free = links.previous[i] == NONE && links.next[j] == NONE;
                if is_free && step.cost < previous_cost {
                    (previous, previous_cost) = (j as u32, step.cost);
                }
            }
        });
        (next, previous)
    }

    /// Follows the links: first the open chains from their starts, then the closed ones.
    fn chains(&self, links: &Links) -> EdgeChains {
        let mut chains = EdgeChains::default();
        let mut is_done: Vec<bool> = (0..self.edgels.len()).map(|i| !self.is_kept(i)).collect();
        let starts = (0..self.edgels.len()).filter(|&i| links.previous[i] == NONE);
        for start in starts.chain(0..self.edgels.len()).filter(|&i| self.is_kept(i)) {
            if is_done[start] {
                continue;
            }
            for i in links.from(self.start_of_loop(start, links)) {
                is_done[i] = true;
                chains.edgels.push(self.edgels[i]);
            }
            chains.ends.push(chains.edgels.len());
        }
        chains
    }

    /// The point at which to open a closed chain through `i`: the point farthest from `i`, which is a corner
    /// if there is one. An open chain keeps its start.
    fn start_of_loop(&self, i: usize, links: &Links) -> usize {
        if links.previous[i] == NONE {
            return i;
        }
        let distance = |j: &usize| self.edgels[*j].position_px.distance_squared(self.edgels[i].position_px);
        links.from(i).max_by(|j, k| distance(j).total_cmp(&distance(k))).unwrap_or(i)
    }
}

/// The chains an edge point belongs to, as linked lists.
struct Links {
    next: Vec<u32>,
    previous: Vec<u32>,
}

impl Links {
    /// A chain from `start` to its end, or once around if it is closed.
    fn from(&self, start: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(start), move |&i| {
            let next = self.next[i];
            (next != NONE && next as usize != start).then_some(next as usize)
        })
    }
}

/// The maximum of the parabola through the logarithms of three equidistant (squared) magnitudes, in (-1/2,
/// 1/2].
///
/// Across a step edge the magnitude is a Gaussian, whose logarithm is a parabola. The remaining error, 0.03
/// px at a step without any blur, comes from the width of the pixels.
#[inline(always)]
fn peak_offset(before: f32, here: f32, after: f32) -> f32 {
    let [before, here, after] = [before, here, after].map(|m| m.max(f32::MIN_POSITIVE).ln());
    let bend = 2.0 * here - before - after;
    if bend > 0.0 { (0.5 * (after - before) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

/// A step from one edge point to the next.
struct Step {
    is_forward: bool,
    cost: f32,
}

/// How well `to` continues the edge at `from`. `None` if it belongs to another edge: the gradients differ by
/// more than 60 degrees, or `to` lies beside `from` rather than ahead or behind.
fn step_between(from: &Edgel, to: &Edgel) -> Option<Step> {
    let (a, b) = (from.gradient, to.gradient);
    let dot = a.dot(b);
    if dot <= 0.0 || 4.0 * dot * dot < a.length_squared() * b.length_squared() {
        return None;
    }
    let step = to.position_px - from.position_px;
    let normal = a + b;
    let (along_sq, across_sq) = (normal.perp_dot(step).powi(2), normal.dot(step).powi(2));
    let is_forward = normal.perp_dot(step) < 0.0;
    (along_sq > across_sq)
        .then(|| Step { is_forward, cost: (along_sq + 4.0 * across_sq) / normal.length_squared() })
}

#[cfg(test)]
mod tests;
