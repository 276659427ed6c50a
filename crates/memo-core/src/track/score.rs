//! Similarity of model contours and image edges (Rohr 1994, section 4.3, eqs. 7-11).
//!
//! Symbols of the paper: l_M `model_px`, l `overlap_px`, d `distance_px`, delta phi `angle_rad`.
//!
//! The search window of a model line is the rectangle of the line's length and half width r = c_r l_M about it.
//! An edge is clipped to that window before it is compared. Each model line is matched with one edge, the best;
//! with the first if several are equal. Both are straight lines in ideal (distortion-free) pixels. Scores are f32
//! and differ from f64 by some 1e-7; geometry is f64 until it is projected.

use crate::OptionError;
use crate::model::body::PART_COUNT;

/// Measure that compares one model line with one edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Measure {
    /// Eqs. (7), (8): Gaussian in missing length, distance and angle, weighted by the overlap.
    #[default]
    Rohr,
    /// Eq. (10), Lowe 1987: l_GW² / ((l_M - l_GW) d delta phi) on edges that are not clipped, for comparison. The
    /// measure has a pole where a factor is 0, so each factor is held above one hundredth of its window, and the
    /// value is scaled to 1 there.
    Lowe,
}

/// Parameters of the similarity. The paper gives no values; each default states its source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimilarityOptions {
    /// sigma_l = c_l l_M. Default 1: real edges are broken, and 0.5 penalises a half-detected limb so much that
    /// correct single frames drop from 94 % to 81 % on real footage. Values from 1 to 3 give similar results.
    pub c_l: f32,
    /// sigma_d = c_d c_r l_M. Default 0.5: an edge at the window's border is two sigma away.
    pub c_d: f32,
    /// Half width of the search window as a share of the line's length. Default 0.25 separates the two sides of a
    /// limb; 0.5 mixes them.
    pub c_r: f32,
    /// sigma of the angle, radians. Default 12 degrees: differences of people's joint angles from the average
    /// gait.
    pub sigma_phi_rad: f32,
    /// w_K: significance of each body part in the order of `Part::ALL`. All equal, as in the paper's
    /// experiments.
    pub part_weights: [f32; PART_COUNT],
    /// w_G = min(1, gradient / this), grey levels per pixel. `None` gives all edges the same weight, which was
    /// best in measurements.
    pub full_gradient: Option<f32>,
    /// w_V = min(1, velocity / this), pixels per frame, for edges with a velocity; `None` ignores it.
    pub full_velocity: Option<f32>,
    /// The measure of a line and an edge.
    pub measure: Measure,
}

impl SimilarityOptions {
    /// The defaults.
    pub const DEFAULT: Self = Self {
        c_l: 1.0,
        c_d: 0.5,
        c_r: 0.25,
        sigma_phi_rad: 12.0 * std::f32::consts::PI / 180.0,
        part_weights: [1.0; PART_COUNT],
        full_gradient: None,
        full_velocity: None,
        measure: Measure::Rohr,
    };
}

impl Default for SimilarityOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl SimilarityOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        for (name, got) in [
            ("c_l", Some(self.c_l)),
            ("c_d", Some(self.c_d)),
            ("c_r", Some(self.c_r)),
            ("sigma_phi_rad", Some(self.sigma_phi_rad)),
            ("full_gradient", self.full_gradient),
            ("full_velocity", self.full_velocity),
        ] {
            got.map_or(Ok(()), |got| OptionError::unless_positive(name, f64::from(got)))?;
        }
        let (name, wanted) = ("part_weights", "14 numbers from 0, not all 0");
        let refused = self.part_weights.into_iter().find(|w| !(w.is_finite() && *w >= 0.0));
        OptionError::unless(refused.is_none(), name, wanted, f64::from(refused.unwrap_or_default()))?;
        OptionError::unless(self.part_weights.into_iter().any(|w| w > 0.0), name, wanted, 0.0)
    }
}

/// A straight image edge in ideal pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeLine {
    /// One end point, pixels.
    pub start: [f32; 2],
    /// The other end point, pixels.
    pub end: [f32; 2],
    /// Mean gradient magnitude, grey levels per pixel.
    pub gradient: f32,
    /// Image speed at the edge, pixels per frame; 0 if no velocity field was computed.
    pub velocity: f32,
}

/// A visible piece of a model contour in ideal pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelLine {
    /// Index of the body part in the order of `Part::ALL`.
    pub part: u8,
    /// One end point, pixels.
    pub start: [f32; 2],
    /// The other end point, pixels.
    pub end: [f32; 2],
}

/// A model line and the edge matched with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Index of the model line.
    pub line: usize,
    /// Index of the edge.
    pub edge: usize,
    /// l: length of the clipped edge projected onto the model line, pixels.
    pub overlap_px: f32,
    /// d: distance of the clipped edge's midpoint from the model line, pixels.
    pub distance_px: f32,
    /// Angle between the two lines without direction, in [0, pi/2], radians.
    pub angle_rad: f32,
    /// s_i, weighted, pixels.
    pub similarity_px: f32,
}

/// The overall similarity of eq. (11) with its parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarity {
    /// s(p): sum of the weighted s_i over the sum of l_M; 0 if the model shows no line.
    pub value: f32,
    /// Sum of l_M, pixels.
    pub model_px: f32,
    /// The lines that match an edge.
    pub matches: Vec<Match>,
}

/// Compares all model lines with all edges and keeps the best edge of each line.
pub fn similarity(lines: &[ModelLine], edges: &[EdgeLine], options: &SimilarityOptions) -> Similarity {
    let scorer = Scorer::new(edges, options);
    let mut total = 0.0;
    let mut model_px = 0.0;
    let mut matches = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let Some(frame) = LineFrame::new(line, options) else { continue };
        model_px += frame.length;
        let best = (0..edges.len()).filter_map(|e| scorer.pair(&frame, e).map(|p| (e, p))).fold(
            None,
            |best: Option<(usize, Pair)>, (e, p)| match best {
                Some((_, b)) if b.value >= p.value => best,
                _ => Some((e, p)),
            },
        );
        if let Some((edge, p)) = best {
            let similarity_px = p.value * options.part_weights[line.part as usize];
            total += similarity_px;
            let (overlap_px, distance_px, angle_rad) = (p.overlap, p.distance, p.angle);
            matches.push(Match { line: index, edge, overlap_px, distance_px, angle_rad, similarity_px });
        }
    }
    Similarity { value: if model_px > 0.0 { total / model_px } else { 0.0 }, model_px, matches }
}

/// Edges with precomputed values for many comparisons.
struct Scorer<'a> {
    edges: Vec<PreparedEdge>,
    options: &'a SimilarityOptions,
}

/// An edge with the values every comparison needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct PreparedEdge {
    pub(super) start: [f32; 2],
    pub(super) end: [f32; 2],
    /// Unit direction.
    pub(super) direction: [f32; 2],
    pub(super) length: f32,
    /// w_G w_V.
    pub(super) weight: f32,
}

/// A model line's own axes: x along the line from its start, y across it.
#[derive(Debug, Clone, Copy)]
struct LineFrame {
    origin: [f32; 2],
    direction: [f32; 2],
    /// l_M.
    length: f32,
    half_width: f32,
    inverse_sigma_l: f32,
    inverse_sigma_d: f32,
}

#[derive(Clone, Copy)]
struct Pair {
    value: f32,
    overlap: f32,
    distance: f32,
    angle: f32,
}

/// Lines shorter than this have no reliable direction and are left out of both sums, pixels.
pub(super) const SHORTEST_LINE_PX: f32 = 1.0;
/// Edges at an angle beyond this many sigma would contribute less than 2 % and are not compared.
pub(super) const ANGLE_CUT_SIGMA: f32 = 2.8;

impl LineFrame {
    fn new(line: &ModelLine, options: &SimilarityOptions) -> Option<Self> {
        let (dx, dy) = (line.end[0] - line.start[0], line.end[1] - line.start[1]);
        let length = (dx * dx + dy * dy).sqrt();
        if length.is_nan() || length < SHORTEST_LINE_PX {
            return None;
        }
        let half_width = options.c_r * length;
        Some(Self {
            origin: line.start,
            direction: [dx / length, dy / length],
            length,
            half_width,
            inverse_sigma_l: 1.0 / (options.c_l * length),
            inverse_sigma_d: 1.0 / (options.c_d * half_width),
        })
    }
}

impl<'a> Scorer<'a> {
    fn new(edges: &[EdgeLine], options: &'a SimilarityOptions) -> Self {
        Self { edges: edges.iter().map(|edge| PreparedEdge::new(edge, options)).collect(), options }
    }

    fn pair(&self, frame: &LineFrame, edge: usize) -> Option<Pair> {
        match self.options.measure {
            Measure::Rohr => self.rohr(frame, &self.edges[edge]),
            Measure::Lowe => self.lowe(frame, &self.edges[edge]),
        }
    }

    /// Eq. (7): s = l exp(-((l_M - l)² / sigma_l² + d² / sigma_d² + dphi² / sigma_phi²) / 2).
    fn rohr(&self, frame: &LineFrame, edge: &PreparedEdge) -> Option<Pair> {
        let cut = edge.cut(frame)?;
        let angle = edge.angle_to(frame, self.options.sigma_phi_rad)?;
        let missing = (frame.length - cut.overlap) * frame.inverse_sigma_l;
        let away = cut.distance * frame.inverse_sigma_d;
        let turned = angle / self.options.sigma_phi_rad;
        let value =
            edge.weight * cut.overlap * (-0.5 * (missing * missing + away * away + turned * turned)).exp();
        Some(Pair { value, overlap: cut.overlap, distance: cut.distance, angle })
    }

    /// Eq. (10) on the edge that is not clipped; only edges that reach the window are compared.
    fn lowe(&self, frame: &LineFrame, edge: &PreparedEdge) -> Option<Pair> {
        let cut = edge.cut(frame)?;
        let [_, y0] = frame.local(edge.start);
        let [_, y1] = frame.local(edge.end);
        let distance = (0.5 * (y0 + y1)).abs();
        let angle = edge.sine_to(frame).abs().min(1.0).asin();
        let floor = 0.01;
        let missing = ((frame.length - edge.length).abs() / frame.length).max(floor);
        let away = (distance / frame.half_width).max(floor);
        let turned = (angle / std::f32::consts::FRAC_PI_2).max(floor);
        let ratio = edge.length / frame.length;
        let value = edge.weight * frame.length * ratio * ratio * floor.powi(3) / (missing * away * turned);
        Some(Pair { value, overlap: cut.overlap, distance, angle })
    }
}

/// An edge clipped to a line's window.
struct Cut {
    overlap: f32,
    distance: f32,
}

impl LineFrame {
    fn local(&self, point: [f32; 2]) -> [f32; 2] {
        let (x, y) = (point[0] - self.origin[0], point[1] - self.origin[1]);
        let [ux, uy] = self.direction;
        [x * ux + y * uy, y * ux - x * uy]
    }
}

impl PreparedEdge {
    pub(super) fn new(edge: &EdgeLine, options: &SimilarityOptions) -> Self {
        let (dx, dy) = (edge.end[0] - edge.start[0], edge.end[1] - edge.start[1]);
        let length = (dx * dx + dy * dy).sqrt();
        let full = |value: f32, limit: Option<f32>| limit.map_or(1.0, |limit| (value / limit).min(1.0));
        Self {
            start: edge.start,
            end: edge.end,
            direction: if length > 0.0 { [dx / length, dy / length] } else { [1.0, 0.0] },
            length,
            weight: full(edge.gradient, options.full_gradient) * full(edge.velocity, options.full_velocity),
        }
    }

    fn sine_to(&self, frame: &LineFrame) -> f32 {
        self.direction[1] * frame.direction[0] - self.direction[0] * frame.direction[1]
    }

    /// The angle between the two lines without direction; `None` beyond [`ANGLE_CUT_SIGMA`].
    fn angle_to(&self, frame: &LineFrame, sigma: f32) -> Option<f32> {
        let angle = self.sine_to(frame).abs().min(1.0).asin();
        (angle <= ANGLE_CUT_SIGMA * sigma).then_some(angle)
    }

    /// Clips the edge to the window [0, l_M] x [-r, r] (Liang and Barsky).
    fn cut(&self, frame: &LineFrame) -> Option<Cut> {
        let [x0, y0] = frame.local(self.start);
        let [x1, y1] = frame.local(self.end);
        let (mut t0, mut t1) = (0.0f32, 1.0f32);
        clip(x0, x1 - x0, 0.0, frame.length, &mut t0, &mut t1);
        clip(y0, y1 - y0, -frame.half_width, frame.half_width, &mut t0, &mut t1);
        if t0 >= t1 {
            return None;
        }
        let overlap = ((x1 - x0) * (t1 - t0)).abs();
        let distance = (y0 + 0.5 * (t0 + t1) * (y1 - y0)).abs();
        Some(Cut { overlap, distance })
    }
}

/// Narrows [t0, t1] to the part where low <= p + t d <= high; makes it empty if there is none.
fn clip(p: f32, d: f32, low: f32, high: f32, t0: &mut f32, t1: &mut f32) {
    if d.abs() < 1e-12 {
        if p < low || p > high {
            *t1 = -1.0;
        }
        return;
    }
    let (a, b) = ((low - p) / d, (high - p) / d);
    *t0 = t0.max(a.min(b));
    *t1 = t1.min(a.max(b));
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use proptest::prelude::*;

    fn model(start: [f32; 2], end: [f32; 2]) -> ModelLine {
        ModelLine { part: 0, start, end }
    }

    fn edge(start: [f32; 2], end: [f32; 2]) -> EdgeLine {
        EdgeLine { start, end, gradient: 20.0, velocity: 0.0 }
    }

    fn value(line: ModelLine, edges: &[EdgeLine], options: &SimilarityOptions) -> f32 {
        similarity(&[line], edges, options).value
    }

    #[test]
    fn a_perfect_edge_scores_one_and_longer_edges_are_cut_to_the_line() {
        let options = SimilarityOptions::default();
        let line = model([10.0, 10.0], [10.0, 50.0]);
        assert!((value(line, &[edge([10.0, 10.0], [10.0, 50.0])], &options) - 1.0).abs() < 1e-6);
        assert!((value(line, &[edge([10.0, 90.0], [10.0, -30.0])], &options) - 1.0).abs() < 1e-6);
        assert_eq!(value(line, &[], &options), 0.0);
    }

    #[test]
    fn each_quantity_lowers_the_similarity_as_eq_7_says() {
        let o = SimilarityOptions::default();
        let line = model([0.0, 0.0], [40.0, 0.0]);
        let half = value(line, &[edge([0.0, 0.0], [20.0, 0.0])], &o);
        assert!((half - 0.5 * (-0.5f32 * 0.25).exp()).abs() < 1e-6, "half found: l = l_M / 2");
        let away = value(line, &[edge([0.0, 5.0], [40.0, 5.0])], &o);
        assert!((away - (-0.5f32).exp()).abs() < 1e-6, "one sigma away: d = c_d c_r l_M");
        let turned = 6.0f32.to_radians();
        let (s, c) = turned.sin_cos();
        let tilted = value(line, &[edge([20.0 - 20.0 * c, -20.0 * s], [20.0 + 20.0 * c, 20.0 * s])], &o);
        let expected = c * (-0.5 * ((1.0 - c).powi(2) + 0.25)).exp();
        assert!((tilted - expected).abs() < 1e-5, "half a sigma turned: {tilted} against {expected}");
    }

    #[test]
    fn the_best_edge_answers_and_weights_scale() {
        let mut o = SimilarityOptions::default();
        let line = model([0.0, 0.0], [40.0, 0.0]);
        let edges = [edge([0.0, 4.0], [40.0, 4.0]), edge([0.0, 1.0], [40.0, 1.0])];
        let all = similarity(&[line], &edges, &o);
        assert_eq!(all.matches[0].edge, 1);
        o.full_gradient = Some(40.0);
        o.part_weights[0] = 0.5;
        assert!((similarity(&[line], &edges, &o).value - 0.25 * all.value).abs() < 1e-6);
    }

    #[test]
    fn lowes_measure_prefers_the_same_pair_but_ignores_scale() {
        let o = SimilarityOptions { measure: Measure::Lowe, ..SimilarityOptions::default() };
        let small = value(model([0.0, 0.0], [10.0, 0.0]), &[edge([0.0, 0.5], [9.0, 0.7])], &o);
        let large = value(model([0.0, 0.0], [100.0, 0.0]), &[edge([0.0, 5.0], [90.0, 7.0])], &o);
        assert!((small - large).abs() < 1e-6 * large.max(1.0));
        let worse = value(model([0.0, 0.0], [10.0, 0.0]), &[edge([0.0, 1.5], [7.0, 1.7])], &o);
        assert!(worse < small);
    }

    /// Eq. (7) without clipping: the edge is sampled, and samples inside the line's window are kept.
    fn sampled(line: &ModelLine, e: &EdgeLine, o: &SimilarityOptions) -> f64 {
        let point = |p: [f32; 2]| DVec2::new(f64::from(p[0]), f64::from(p[1]));
        let (start, along) = (point(line.start), point(line.end) - point(line.start));
        let length = along.length();
        let (from, to) = (point(e.start) - start, point(e.end) - start);
        let local = |p: DVec2| DVec2::new(p.dot(along), along.perp_dot(p)) / length;
        let half_width = f64::from(o.c_r) * length;
        let inside = |p: &DVec2| (0.0..=length).contains(&p.x) && p.y.abs() <= half_width;
        let shown: Vec<DVec2> =
            (0..=20_000).map(|k| local(from.lerp(to, f64::from(k) / 2e4))).filter(inside).collect();
        let (Some(first), Some(last)) = (shown.first(), shown.last()) else { return 0.0 };
        let (overlap, distance) = ((last.x - first.x).abs(), (0.5 * (first.y + last.y)).abs());
        let (missing, away) = (length - overlap, distance / f64::from(o.c_d) / half_width);
        let turned = angle_between(along, to - from) / f64::from(o.sigma_phi_rad);
        let sum_sq = (missing / (f64::from(o.c_l) * length)).powi(2) + away * away + turned * turned;
        overlap * (-0.5 * sum_sq).exp() / length
    }

    /// Angle between lines without direction, radians.
    fn angle_between(a: DVec2, b: DVec2) -> f64 {
        let turn = a.angle_to(b).abs();
        turn.min(std::f64::consts::PI - turn)
    }

    #[test]
    fn gradient_and_velocity_weigh_an_edge_up_to_their_full_values() {
        let line = model([0.0, 0.0], [40.0, 0.0]);
        let moving = EdgeLine { velocity: 1.0, ..edge([0.0, 0.0], [40.0, 0.0]) };
        for (full_gradient, full_velocity, weight) in [
            (None, None, 1.0),
            (Some(80.0), None, 0.25),
            (Some(20.0), None, 1.0),
            (Some(5.0), None, 1.0),
            (None, Some(2.0), 0.5),
            (None, Some(0.5), 1.0),
            (Some(80.0), Some(2.0), 0.125),
        ] {
            let options = SimilarityOptions { full_gradient, full_velocity, ..SimilarityOptions::default() };
            let found = value(line, &[moving], &options);
            assert!((found - weight).abs() < 1e-6, "{full_gradient:?}, {full_velocity:?}: {found}");
        }
    }

    #[test]
    fn by_default_all_edges_weigh_alike() {
        let line = model([0.0, 0.0], [40.0, 0.0]);
        for (gradient, velocity) in [(0.1, 0.0), (300.0, 9.0)] {
            let e = EdgeLine { gradient, velocity, ..edge([0.0, 0.0], [40.0, 0.0]) };
            assert!((value(line, &[e], &SimilarityOptions::default()) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn with_w_v_a_moving_edge_answers_before_a_nearer_one_that_stands_still() {
        let line = model([0.0, 0.0], [40.0, 0.0]);
        let moving = EdgeLine { velocity: 2.0, ..edge([0.0, 3.0], [40.0, 3.0]) };
        let edges = [edge([0.0, 0.0], [40.0, 0.0]), moving];
        let plain = SimilarityOptions::default();
        let weighted = SimilarityOptions { full_velocity: Some(2.0), ..plain };
        assert_eq!(similarity(&[line], &edges, &plain).matches[0].edge, 0);
        assert_eq!(similarity(&[line], &edges, &weighted).matches[0].edge, 1);
    }

    #[test]
    fn each_part_has_its_own_weight_and_eq_11_weighs_lines_by_length() {
        let mut options = SimilarityOptions::default();
        (options.part_weights[2], options.part_weights[9]) = (0.5, 0.125);
        let lines = [(2, 10.0f32, 0.0), (9, 30.0, 100.0), (5, 60.0, 200.0)]
            .map(|(part, length, y)| ModelLine { part, start: [0.0, y], end: [length, y] });
        let edges = lines.map(|l| edge(l.start, l.end));
        let found = similarity(&lines, &edges, &options);
        assert_eq!(found.model_px, 100.0);
        assert!((found.value - (0.5 * 10.0 + 0.125 * 30.0 + 60.0) / 100.0).abs() < 1e-6);
        // A line without a matching edge counts in the sum of l_M; a line below the shortest length does not.
        let unanswered = similarity(&lines, &edges[2..], &options);
        assert!((unanswered.value - 0.6).abs() < 1e-6 && unanswered.matches.len() == 1);
        let speck = ModelLine { part: 5, start: [0.0, 200.0], end: [0.9, 200.0] };
        assert_eq!(similarity(&[lines[2], speck], &edges, &options).model_px, 60.0);
        let short = model([0.0, 0.0], [2.0, 0.0]);
        assert!((value(short, &[edge([0.0, 0.0], [2.0, 0.0])], &options) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn angles_are_compared_up_to_the_cut() {
        let o = SimilarityOptions::default();
        let line = model([0.0, 0.0], [40.0, 0.0]);
        let turned = |sigma: f32| {
            let (s, c) = (sigma * o.sigma_phi_rad).sin_cos();
            value(line, &[edge([20.0 - 4.0 * c, -4.0 * s], [20.0 + 4.0 * c, 4.0 * s])], &o)
        };
        assert!(turned(2.75) > 1e-3 && turned(-2.75) > 1e-3);
        assert!(turned(2.85) == 0.0 && turned(-2.85) == 0.0);
    }

    #[test]
    fn of_equal_edges_the_first_answers() {
        let line = model([0.0, 0.0], [40.0, 0.0]);
        let edges = [edge([0.0, 2.0], [40.0, 2.0]), edge([0.0, -2.0], [40.0, -2.0])];
        assert_eq!(similarity(&[line], &edges, &SimilarityOptions::default()).matches[0].edge, 0);
    }

    /// Eq. (10) is known up to a factor, so ratios of two pairs are compared.
    #[test]
    fn lowes_measure_falls_with_each_factor_of_eq_10() {
        let o = SimilarityOptions { measure: Measure::Lowe, ..SimilarityOptions::default() };
        let pair = |length: f32, distance: f32, turn: f32| {
            let (s, c) = turn.sin_cos();
            let [x, y] = [0.5 * length * c, 0.5 * length * s];
            let e = edge([50.0 - x, distance - y], [50.0 + x, distance + y]);
            f64::from(value(model([0.0, 0.0], [100.0, 0.0]), &[e], &o))
        };
        let eq_10 =
            |length: f64, distance: f64, turn: f64| length * length / ((100.0 - length) * distance * turn);
        let (base, printed) = (pair(80.0, 5.0, 0.2), eq_10(80.0, 5.0, 0.2));
        for (length, distance, turn) in
            [(60.0, 5.0, 0.2), (80.0, 12.0, 0.2), (80.0, 5.0, 0.5), (40.0, 8.0, 0.1)]
        {
            let ratio = pair(length, distance, turn) / base;
            let expected = eq_10(f64::from(length), f64::from(distance), f64::from(turn)) / printed;
            assert!((ratio / expected - 1.0).abs() < 1e-4, "{ratio} against {expected}");
        }
        let turned = value(model([0.0, 0.0], [100.0, 0.0]), &[edge([50.0, -40.0], [50.0, 40.0])], &o);
        assert!(turned > 0.0, "there is no cut of the angle");
        let perfect = value(model([0.0, 0.0], [100.0, 0.0]), &[edge([0.0, 0.0], [100.0, 0.0])], &o);
        assert!((perfect - 1.0).abs() < 1e-6, "scaled to 1 at the pole");
    }

    proptest! {
        #[test]
        fn the_similarity_equals_eq_7_of_the_edge_sampled_in_the_window(
            e in prop::array::uniform4(-20.0f32..80.0),
            line in prop::array::uniform4(0.0f32..60.0),
            (c_l, c_d, c_r) in (0.4f32..2.0, 0.3f32..1.5, 0.1f32..0.8),
            sigma_phi_rad in 0.1f32..0.7,
        ) {
            let options = SimilarityOptions { c_l, c_d, c_r, sigma_phi_rad, ..SimilarityOptions::default() };
            let line = model([line[0], line[1]], [line[2], line[3]]);
            let e = edge([e[0], e[1]], [e[2], e[3]]);
            let direction = |a: [f32; 2], b: [f32; 2]| DVec2::new(f64::from(b[0] - a[0]), f64::from(b[1] - a[1]));
            let (along, across) = (direction(line.start, line.end), direction(e.start, e.end));
            prop_assume!(along.length() > 5.0 && across.length() > 1.0);
            let angle = angle_between(along, across);
            let cut = f64::from(ANGLE_CUT_SIGMA * sigma_phi_rad);
            let expected = if angle <= cut { sampled(&line, &e, &options) } else { 0.0 };
            let found = f64::from(value(line, &[e], &options));
            prop_assert!((angle - cut).abs() < 1e-4 || (found - expected).abs() < 0.01, "{found} against {expected}");
        }
    }

    proptest! {
        #[test]
        fn similarity_is_between_zero_and_one_and_blind_to_direction(
            e in prop::array::uniform4(-50.0f32..150.0),
            line in prop::array::uniform4(0.0f32..100.0),
        ) {
            let options = SimilarityOptions::default();
            let forward = value(model([line[0], line[1]], [line[2], line[3]]), &[edge([e[0], e[1]], [e[2], e[3]])], &options);
            let back = value(model([line[2], line[3]], [line[0], line[1]]), &[edge([e[2], e[3]], [e[0], e[1]])], &options);
            prop_assert!((0.0..=1.0 + 1e-5).contains(&forward));
            prop_assert!((forward - back).abs() < 1e-4);
        }
    }
}
