//! Eq. (11) for several positions and heights at once (Rohr 1994, sections 4.3 and 6).
//!
//! The arithmetic of [`similarity`](super::score::similarity) without branches, in lanes of f32, one lane per
//! point of the grid. The compiler vectorises the loops over lanes, so every function they call is `#[inline(always)]` and
//! the caller dispatches on the instruction set. No operation is fused or reordered: the scores have the same
//! bits on every instruction set.
//!
//! Differences from the plain similarity: asin and exp are polynomials of known error, and the projection is in
//! f32 (some 1e-4 px).
#![allow(clippy::needless_range_loop, reason = "one index runs through the lanes of several arrays at once")]

use super::score::{ANGLE_CUT_SIGMA, EdgeLine, Measure, PreparedEdge, SHORTEST_LINE_PX, SimilarityOptions};
use crate::model::Camera;
use glam::{DVec2, DVec3};

/// Points of the grid evaluated together.
pub(super) const LANES: usize = 16;
/// One f32 for each point.
pub(super) type Lanes = [f32; LANES];
/// Edges tested together for being near a line, one byte of a word each. It is 16 because loops of 8 are unrolled
/// before they can be vectorised, which makes this test more than twice as slow.
const BATCH: usize = 16;
/// Minimum depth that is projected, metres.
const NEAR_M: f32 = 1e-6;
/// Maximum effect of rounding on a window's border, pixels.
const SLACK_PX: f32 = 0.01;
/// Maximum effect of rounding on the direction of an edge, as a sine.
const SLACK_SINE: f32 = 1e-4;

/// The image of a point moved ahead by x and up by z, in homogeneous pixels: `base` + x `per_metre[0]` +
/// z `per_metre[1]`, because the projection is linear before its division.
#[derive(Clone, Copy)]
struct MovedPoint {
    base: [f32; 3],
    per_metre: [[f32; 3]; 2],
}

/// Projection to ideal pixels for a body that was posed elsewhere and is moved to its position.
pub(super) struct Projection<'a> {
    camera: &'a Camera,
    place: DVec3,
    per_metre: [[f32; 3]; 2],
    /// Outer borders of the outermost pixels.
    low: [f32; 2],
    high: [f32; 2],
}

impl<'a> Projection<'a> {
    /// The projection of points that are moved by `place` first, then in the direction `ahead` and up.
    pub(super) fn new(camera: &'a Camera, place: DVec3, ahead: DVec2) -> Self {
        let of_direction = |direction: DVec3| homogeneous(camera, camera.rotation * direction);
        Self {
            camera,
            place,
            per_metre: [of_direction(ahead.extend(0.0)), of_direction(DVec3::Z)],
            low: [-0.5; 2],
            high: camera.size.map(|size| size as f32 - 0.5),
        }
    }

    #[inline(always)]
    fn point(&self, point: DVec3) -> MovedPoint {
        let base = homogeneous(self.camera, self.camera.camera_from_world(point + self.place));
        MovedPoint { base, per_metre: self.per_metre }
    }
}

/// Eq. (2) before its division: (f x + c z, z).
#[inline(always)]
fn homogeneous(camera: &Camera, in_camera: DVec3) -> [f32; 3] {
    let scaled = in_camera.truncate() * camera.focal_px + camera.centre_px * in_camera.z;
    [scaled.x as f32, scaled.y as f32, in_camera.z as f32]
}

/// A model line's own axes, x along the line from its start, y across it; all zeros if no line is visible.
#[derive(Clone, Copy)]
struct Line {
    start: [f32; 2],
    direction: [f32; 2],
    /// l_M.
    length: f32,
    inverse_length: f32,
}

/// A visible piece of contour at each point, clipped to the image.
pub(super) struct LineLanes {
    start: [Lanes; 2],
    direction: [Lanes; 2],
    pub(super) length: Lanes,
    inverse_length: Lanes,
}

impl LineLanes {
    /// The piece from `start` to `end`, moved ahead and up by each value of `moved_m`.
    #[inline(always)]
    pub(super) fn new(projection: &Projection<'_>, start: DVec3, end: DVec3, moved_m: &[Lanes; 2]) -> Self {
        let (start, end) = (projection.point(start), projection.point(end));
        let zero = [0.0; LANES];
        let mut lanes = Self { start: [zero; 2], direction: [zero; 2], length: zero, inverse_length: zero };
        for i in 0..LANES {
            let line = Line::new(projection, &start, &end, [moved_m[0][i], moved_m[1][i]]);
            lanes.start[0][i] = line.start[0];
            lanes.start[1][i] = line.start[1];
            lanes.direction[0][i] = line.direction[0];
            lanes.direction[1][i] = line.direction[1];
            lanes.length[i] = line.length;
            lanes.inverse_length[i] = line.inverse_length;
        }
        lanes
    }

    #[inline(always)]
    fn line(&self, i: usize) -> Line {
        Line {
            start: [self.start[0][i], self.start[1][i]],
            direction: [self.direction[0][i], self.direction[1][i]],
            length: self.length[i],
            inverse_length: self.inverse_length[i],
        }
    }
}

impl Line {
    #[inline(always)]
    fn new(projection: &Projection<'_>, start: &MovedPoint, end: &MovedPoint, moved_m: [f32; 2]) -> Self {
        let ([x0, y0], depth0) = start.pixel(moved_m);
        let ([x1, y1], depth1) = end.pixel(moved_m);
        let (dx, dy) = (x1 - x0, y1 - y0);
        let (x_in, x_out) = clip(x0, dx, projection.low[0], projection.high[0]);
        let (y_in, y_out) = clip(y0, dy, projection.low[1], projection.high[1]);
        let (t0, t1) = (max(0.0, max(x_in, y_in)), min(1.0, min(x_out, y_out)));
        let (x, y) = (dx * (t1 - t0), dy * (t1 - t0));
        let length = (x * x + y * y).sqrt();
        let shown = (min(depth0, depth1) > NEAR_M) & (t0 < t1) & (length >= SHORTEST_LINE_PX);
        let inverse_length = 1.0 / length;
        Self {
            start: [select(shown, x0 + t0 * dx), select(shown, y0 + t0 * dy)],
            direction: [select(shown, x * inverse_length), select(shown, y * inverse_length)],
            length: select(shown, length),
            inverse_length: select(shown, inverse_length),
        }
    }

    #[inline(always)]
    fn turned(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [ux, uy] = self.direction;
        [x * ux + y * uy, y * ux - x * uy]
    }

    #[inline(always)]
    fn local(&self, point: [f32; 2]) -> [f32; 2] {
        self.turned([point[0] - self.start[0], point[1] - self.start[1]])
    }

    #[inline(always)]
    fn end(&self) -> [f32; 2] {
        let at = |k: usize| self.start[k] + self.length * self.direction[k];
        [at(0), at(1)]
    }
}

impl MovedPoint {
    /// The pixel and the depth.
    #[inline(always)]
    fn pixel(&self, [x, z]: [f32; 2]) -> ([f32; 2], f32) {
        let at = |k: usize| self.base[k] + x * self.per_metre[0][k] + z * self.per_metre[1][k];
        let (x, y, depth) = (at(0), at(1), at(2));
        let inverse_depth = 1.0 / depth;
        ([x * inverse_depth, y * inverse_depth], depth)
    }
}

/// The edges of a frame, prepared for the columns of a grid.
pub(super) struct LaneScorer<'a> {
    /// In descending order of the most they can contribute.
    edges: Vec<PreparedEdge>,
    batches: Vec<EdgeBatch>,
    options: &'a SimilarityOptions,
    constants: Constants,
}

/// Constants of eq. (7) from the options.
struct Constants {
    /// r / l_M.
    c_r: f32,
    /// l_M / sigma_l.
    inverse_c_l: f32,
    /// l_M / sigma_d.
    inverse_c_d_c_r: f32,
    inverse_sigma_phi: f32,
    /// Sine of the largest angle compared; above 1 if all angles are compared.
    sine_cut: f32,
}

impl Constants {
    fn new(options: &SimilarityOptions) -> Self {
        let angle_cut = match options.measure {
            Measure::Rohr => ANGLE_CUT_SIGMA * options.sigma_phi_rad,
            Measure::Lowe => f32::INFINITY,
        };
        Self {
            c_r: options.c_r,
            inverse_c_l: 1.0 / options.c_l,
            inverse_c_d_c_r: 1.0 / (options.c_d * options.c_r),
            inverse_sigma_phi: 1.0 / options.sigma_phi_rad,
            sine_cut: if angle_cut < std::f32::consts::FRAC_PI_2 { angle_cut.sin() } else { 2.0 },
        }
    }
}

impl<'a> LaneScorer<'a> {
    pub(super) fn new(edges: &[EdgeLine], options: &'a SimilarityOptions) -> Self {
        let mut edges: Vec<_> = edges.iter().map(|edge| PreparedEdge::new(edge, options)).collect();
        edges.sort_by(|a, b| b.most().total_cmp(&a.most()));
        let batches = edges.chunks(BATCH).map(EdgeBatch::new).collect();
        Self { edges, batches, options, constants: Constants::new(options) }
    }

    /// w_K s_i of a line at each point: the best of the edges in `near`.
    #[inline(always)]
    pub(super) fn best(&self, part: usize, lines: &LineLanes, near: &[u32]) -> Lanes {
        let mut best = match self.options.measure {
            Measure::Rohr => self.best_by_rohr(lines, near),
            Measure::Lowe => self.best_by_lowe(lines, near),
        };
        for best in &mut best {
            *best *= self.options.part_weights[part];
        }
        best
    }

    /// By eq. (7) no edge contributes more than its length: once every point has more than that, the remaining
    /// edges are skipped.
    #[inline(always)]
    fn best_by_rohr(&self, lines: &LineLanes, near: &[u32]) -> Lanes {
        let mut best = [0.0; LANES];
        // Points at which no line is visible need no edge.
        let mut least = [0.0; LANES];
        for i in 0..LANES {
            least[i] = if lines.length[i] > 0.0 { 0.0 } else { f32::INFINITY };
        }
        for &e in near {
            let edge = self.edges[e as usize];
            if edge.most() <= reduce(least, min) {
                break;
            }
            for i in 0..LANES {
                best[i] = max(best[i], rohr(&lines.line(i), &edge, &self.constants));
                least[i] = max(least[i], best[i]);
            }
        }
        best
    }

    #[inline(always)]
    fn best_by_lowe(&self, lines: &LineLanes, near: &[u32]) -> Lanes {
        let mut best = [0.0; LANES];
        for &e in near {
            let edge = self.edges[e as usize];
            for i in 0..LANES {
                best[i] = max(best[i], lowe(&lines.line(i), &edge, &self.constants));
            }
        }
        best
    }

    /// The edges that may match the line at one of the points.
    #[inline(always)]
    pub(super) fn near(&self, lines: &LineLanes, near: &mut Vec<u32>) {
        near.clear();
        let area = Area::new(lines, &self.constants);
        for (batch, first) in self.batches.iter().zip((0u32..).step_by(BATCH)) {
            let mut marks = batch.marks(&area);
            while marks != 0 {
                near.push(first + marks.trailing_zeros() / 8);
                marks &= marks - 1;
            }
        }
    }
}

impl PreparedEdge {
    /// The most an edge can contribute by eq. (7): l is no longer than the edge.
    #[inline(always)]
    fn most(&self) -> f32 {
        self.weight * self.length
    }
}

/// Eq. (7): s = l exp(-((l_M - l)² / sigma_l² + d² / sigma_d² + dphi² / sigma_phi²) / 2).
#[inline(always)]
fn rohr(line: &Line, edge: &PreparedEdge, constants: &Constants) -> f32 {
    let cut = Cut::new(line, edge, constants.c_r * line.length);
    let missing = (1.0 - cut.overlap * line.inverse_length) * constants.inverse_c_l;
    let away = cut.distance * line.inverse_length * constants.inverse_c_d_c_r;
    let turned_sq = angle_sq(cut.sine) * (constants.inverse_sigma_phi * constants.inverse_sigma_phi);
    let value = edge.weight * cut.overlap * exp(-0.5 * (missing * missing + away * away + turned_sq));
    select(cut.sine <= constants.sine_cut, value)
}

/// Eq. (10) on the edge that is not clipped; only edges that reach the window are compared.
#[inline(always)]
fn lowe(line: &Line, edge: &PreparedEdge, constants: &Constants) -> f32 {
    let half_width = constants.c_r * line.length;
    let cut = Cut::new(line, edge, half_width);
    let (y0, y1) = (line.local(edge.start)[1], line.local(edge.end)[1]);
    let floor = 0.01;
    let missing = max((edge.length - line.length).abs() * line.inverse_length, floor);
    let away = max((0.5 * (y0 + y1)).abs() / half_width, floor);
    let turned = max(angle_sq(cut.sine).sqrt() * std::f32::consts::FRAC_2_PI, floor);
    let ratio = edge.length * line.inverse_length;
    let value =
        edge.weight * line.length * ratio * ratio * (floor * floor * floor) / (missing * away * turned);
    select(cut.reaches, value)
}

/// An edge clipped to a line's window [0, l_M] x [-r, r].
struct Cut {
    reaches: bool,
    overlap: f32,
    distance: f32,
    /// Sine of the angle between the two lines without direction.
    sine: f32,
}

impl Cut {
    #[inline(always)]
    fn new(line: &Line, edge: &PreparedEdge, half_width: f32) -> Self {
        let [x, y] = line.local(edge.start);
        let [dx, dy] = line.turned([edge.end[0] - edge.start[0], edge.end[1] - edge.start[1]]);
        let (x_in, x_out) = clip(x, dx, 0.0, line.length);
        let (y_in, y_out) = clip(y, dy, -half_width, half_width);
        let (t0, t1) = (max(0.0, max(x_in, y_in)), min(1.0, min(x_out, y_out)));
        Self {
            reaches: t0 < t1,
            overlap: dx.abs() * max(t1 - t0, 0.0),
            distance: (y + 0.5 * (t0 + t1) * dy).abs(),
            sine: line.turned(edge.direction)[1].abs(),
        }
    }
}

/// The range of t with low <= p + t d <= high (Liang and Barsky). A d of 0 is replaced by one too small to
/// matter.
#[inline(always)]
fn clip(p: f32, d: f32, low: f32, high: f32) -> (f32, f32) {
    let inverse = 1.0 / if d.abs() < 1e-12 { 1e-12 } else { d };
    let (a, b) = ((low - p) * inverse, (high - p) * inverse);
    (min(a, b), max(a, b))
}

/// asin² of 0 <= x <= 1 with relative error 4e-6: a polynomial in q = x² up to q = 1/2; above, asin x = pi/2 -
/// asin sqrt(1 - q).
#[inline(always)]
fn angle_sq(sine: f32) -> f32 {
    let q = min(sine * sine, 1.0);
    let small = min(q, 1.0 - q);
    let p = 0.158_193_29 + small * (-0.068_856_44 + small * 0.267_757_5);
    let p = small * (0.999_998_31 + small * (0.333_575_75 + small * (0.172_293_4 + small * p)));
    let rest = std::f32::consts::FRAC_PI_2 - p.sqrt();
    if q <= 0.5 { p } else { rest * rest }
}

/// e^x of x <= 0 with relative error 3e-7 plus the rounding of x; 2^-126 below -87. With n the nearest integer to
/// x / ln 2, e^x = 2^n 2^f.
#[inline(always)]
fn exp(x: f32) -> f32 {
    let y = max(x, -87.0) * std::f32::consts::LOG2_E;
    // Adding 1.5 * 2^23 rounds to an integer, which is then in the lowest bits.
    let magic = 12_582_912.0;
    let shifted = y + magic;
    let f = y - (shifted - magic);
    let p = 0.055_503_57 + f * (0.009_676_03 + f * 0.001_339_09);
    let p = 1.000_000_1 + f * (std::f32::consts::LN_2 + f * (0.240_221_07 + f * p));
    p * f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23))
}

// The functions of the standard library treat NaN in a way that takes two more instructions.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn select(condition: bool, value: f32) -> f32 {
    if condition { value } else { 0.0 }
}

/// The rectangle that contains the windows of a line at all points, in axes along the line's mean direction.
struct Area {
    axes: Line,
    middle: [f32; 2],
    half: [f32; 2],
    /// An upper bound of the sine of the largest angle with the mean direction: sin (a + b) <= sin a + sin b.
    sine_cut: f32,
}

impl Area {
    #[inline(always)]
    fn new(lines: &LineLanes, constants: &Constants) -> Self {
        let axes = Line::mean(lines);
        let zero = [0.0; LANES];
        let (mut low, mut high, mut turn) = ([zero; 2], [zero; 2], zero);
        for i in 0..LANES {
            let line = lines.line(i);
            let shown = line.length > 0.0;
            let (start, end) = (axes.local(line.start), axes.local(line.end()));
            for k in 0..2 {
                low[k][i] = if shown { min(start[k], end[k]) } else { f32::INFINITY };
                high[k][i] = if shown { max(start[k], end[k]) } else { -f32::INFINITY };
            }
            turn[i] = axes.turned(line.direction)[1].abs();
        }
        let low = [reduce(low[0], min), reduce(low[1], min)];
        let high = [reduce(high[0], max), reduce(high[1], max)];
        let reach = constants.c_r * reduce(lines.length, max) + SLACK_PX;
        let sine_cut = constants.sine_cut + reduce(turn, max) + SLACK_SINE;
        let middle = |k: usize| 0.5 * (low[k] + high[k]);
        let half = |k: usize| 0.5 * (high[k] - low[k]) + reach;
        Self { axes, middle: [middle(0), middle(1)], half: [half(0), half(1)], sine_cut }
    }
}

impl Line {
    /// Axes at the start of the first point's line (at the origin if it has none) along the mean direction of all
    /// points.
    #[inline(always)]
    fn mean(lines: &LineLanes) -> Self {
        let sum = |lanes: Lanes| reduce(lanes, |a, b| a + b);
        let (x, y) = (sum(lines.direction[0]), sum(lines.direction[1]));
        let length = (x * x + y * y).sqrt();
        let direction = if length > 0.0 { [x / length, y / length] } else { [1.0, 0.0] };
        Self { direction, ..lines.line(0) }
    }
}

/// Reduces all lanes by folding halves. The steps are written out: a loop over them keeps the lanes in memory, which makes a
/// search a fifth slower.
#[inline(always)]
fn reduce(lanes: Lanes, fold: impl Fn(f32, f32) -> f32) -> f32 {
    let (mut eight, mut four) = ([0.0; 8], [0.0; 4]);
    for i in 0..8 {
        eight[i] = fold(lanes[i], lanes[i + 8]);
    }
    for i in 0..4 {
        four[i] = fold(eight[i], eight[i + 4]);
    }
    fold(fold(four[0], four[2]), fold(four[1], four[3]))
}

/// A batch of edges as a structure of arrays. The last batch is filled with NaN, which is near nothing.
struct EdgeBatch {
    middle: [[f32; BATCH]; 2],
    /// Vector from the middle to the end.
    half: [[f32; BATCH]; 2],
    half_length: [f32; BATCH],
}

impl EdgeBatch {
    fn new(edges: &[PreparedEdge]) -> Self {
        let side_by_side =
            |of: &dyn Fn(&PreparedEdge) -> f32| std::array::from_fn(|i| edges.get(i).map_or(f32::NAN, of));
        Self {
            middle: [0, 1].map(|k| side_by_side(&|edge| 0.5 * (edge.start[k] + edge.end[k]))),
            half: [0, 1].map(|k| side_by_side(&|edge| 0.5 * (edge.end[k] - edge.start[k]))),
            half_length: side_by_side(&|edge| 0.5 * edge.length),
        }
    }

    /// Byte i is 1 if edge i reaches the area and its angle is not too large.
    #[inline(always)]
    fn marks(&self, area: &Area) -> u128 {
        let mut marks = [0u8; BATCH];
        for (i, mark) in marks.iter_mut().enumerate() {
            let [x, y] = area.axes.local([self.middle[0][i], self.middle[1][i]]);
            let [dx, dy] = area.axes.turned([self.half[0][i], self.half[1][i]]);
            let is_near = ((x - area.middle[0]).abs() <= area.half[0] + dx.abs())
                & ((y - area.middle[1]).abs() <= area.half[1] + dy.abs())
                & (dy.abs() <= area.sine_cut * self.half_length[i]);
            *mark = u8::from(is_near);
        }
        u128::from_le_bytes(marks)
    }
}

#[cfg(test)]
mod tests {
    use super::super::score::{ModelLine, similarity};
    use super::super::search::project;
    use super::*;
    use crate::model::{ContourKind, VisibleSegment};
    use glam::Vec2;
    use proptest::prelude::*;

    #[test]
    fn exp_and_the_angle_keep_their_stated_errors() {
        for i in 0..=100_000 {
            let share = i as f32 / 100_000.0;
            let x = -80.0 * share * share;
            let exact = f64::from(x).exp();
            let allowed = 3e-7 + 1e-7 * f64::from(x).abs();
            assert!((f64::from(exp(x)) / exact - 1.0).abs() < allowed, "e^{x}");
            let exact = f64::from(share).asin().powi(2);
            assert!((f64::from(angle_sq(share)) - exact).abs() <= 4e-6 * exact, "asin² {share}");
        }
        assert!(exp(-1e9) < 2e-38 && exp(0.0) == 1.000_000_1);
    }

    #[test]
    fn reduction_uses_every_lane() {
        for i in 0..LANES {
            let mut lanes = [0.0; LANES];
            lanes[i] = -1.0;
            assert_eq!(reduce(lanes, min), -1.0);
            assert_eq!(reduce(lanes, |a, b| a + b), -1.0);
        }
    }

    fn camera() -> Camera {
        Camera::level([640, 480], 0.9, 1.1, 6.0).unwrap()
    }

    /// The direction in which points are moved.
    const AHEAD: DVec2 = DVec2::new(0.8, 0.6);

    /// s_i at each point by the plain similarity; `None` if an angle is so close to the largest compared angle
    /// that rounding decides.
    fn plainly(piece: &VisibleSegment, moved_m: &[Lanes; 2], edges: &[EdgeLine]) -> Option<Lanes> {
        let options = SimilarityOptions::default();
        let mut all = [0.0; LANES];
        for (i, s) in all.iter_mut().enumerate() {
            let [x, z] = moved_m.map(|m| f64::from(m[i]));
            let moved = (x * AHEAD).extend(z);
            let piece = VisibleSegment { start: piece.start + moved, end: piece.end + moved, ..*piece };
            let Some(line) = project(&piece, &camera()) else { continue };
            let found = similarity(&[line], edges, &options);
            let cut = ANGLE_CUT_SIGMA * options.sigma_phi_rad;
            if edges.iter().any(|edge| (angle(&line, edge) - cut).abs() < 1e-3) {
                return None;
            }
            *s = found.value * found.model_px;
        }
        Some(all)
    }

    /// An edge whose middle, length and angle are given relative to the line's length and direction.
    fn edge_about(line: &ModelLine, (along, across, length, turn_rad): (f32, f32, f32, f32)) -> EdgeLine {
        let (start, end) = (Vec2::from(line.start), Vec2::from(line.end));
        let middle = start + along * (end - start) + across * (end - start).perp();
        let half = 0.5 * length * Vec2::from_angle(turn_rad).rotate(end - start);
        EdgeLine { start: (middle - half).into(), end: (middle + half).into(), gradient: 1.0, velocity: 0.0 }
    }

    fn angle(line: &ModelLine, edge: &EdgeLine) -> f32 {
        let direction = |a: [f32; 2], b: [f32; 2]| Vec2::from(b) - Vec2::from(a);
        let (l, e) = (direction(line.start, line.end), direction(edge.start, edge.end));
        (l.perp_dot(e).abs() / (l.length() * e.length())).min(1.0).asin()
    }

    proptest! {
        /// Also tests pieces that leave the image, pass behind the camera or are short.
        #[test]
        fn every_point_answers_as_the_plain_similarity(
            ends in prop::array::uniform3(-1.5f64..1.5),
            along in prop::array::uniform3(-0.6f64..0.6),
            depth in -6.5f64..8.0,
            spans in prop::array::uniform2(prop_oneof![Just(0.0f32), 0.0f32..0.5]),
            edges in prop::collection::vec(
                (-0.5f32..1.5, prop_oneof![-0.05f32..0.05, -0.5f32..0.5], 0.0f32..1.5, prop_oneof![-0.1f32..0.1, -0.8f32..0.8]), 1..20),
        ) {
            let camera = camera();
            let start = DVec3::new(ends[0], ends[1] + depth, 1.1 + ends[2]);
            let piece = VisibleSegment { part: 3, kind: ContourKind::Left, start, end: start + DVec3::from(along) };
            let line = project(&piece, &camera).unwrap_or(ModelLine { part: 3, start: [300.0, 80.0], end: [310.0, 180.0] });
            let edges: Vec<_> = edges.iter().map(|&shape| edge_about(&line, shape)).collect();
            // Up from low to high, and ahead in another order.
            let steps = [5, 1].map(|factor: usize| std::array::from_fn(|i| ((factor * i) % LANES) as f32 / 7.5 - 1.0));
            let moved_m = [0, 1].map(|k| (steps[k] as Lanes).map(|step| spans[k] * step));
            let plain = plainly(&piece, &moved_m, &edges);
            prop_assume!(plain.is_some());
            let options = SimilarityOptions::default();
            let scorer = LaneScorer::new(&edges, &options);
            let place = DVec3::new(0.3, -0.2, 0.1);
            let projection = Projection::new(&camera, place, AHEAD);
            let lines = LineLanes::new(&projection, start - place, piece.end - place, &moved_m);
            let mut near = Vec::new();
            scorer.near(&lines, &mut near);
            let fast = scorer.best(piece.part, &lines, &near);
            for (i, (f, p)) in fast.iter().zip(plain.unwrap()).enumerate() {
                prop_assert!((f - p).abs() < 1e-3 * lines.length[i].max(1.0), "lane {i}: {f} against {p}, {} px", lines.length[i]);
            }
        }
    }
}
