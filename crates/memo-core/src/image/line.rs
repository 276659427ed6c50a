//! Straight edges: chains of edge points are split where they bend, and each piece is fitted by an
//! eigenvector line.
//!
//! Sources: Rohr 1994, section 4.3; Duda & Hart, "Pattern Classification and Scene Analysis", 1973, p. 332
//! (eigenvector line fitting) and p. 338 (splitting at the point farthest from the chord).
//!
//! Limits: a segment never extends over the end of a chain, so collinear pieces of an interrupted edge stay
//! separate. Curves become polygons within the tolerance; the exact split points on a curve are arbitrary.

use super::edge::{EdgeChains, EdgeDomain, EdgeError, EdgeOptions, Edgel, edge_chains};
use super::frame::Frame;
use crate::OptionError;
use glam::DVec2;
use std::ops::Range;
use thiserror::Error;

/// Why no straight edges were computed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LineError {
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// Edge detection failed.
    #[error(transparent)]
    Edge(#[from] EdgeError),
}

/// Options for fitting straight edges to chains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineOptions {
    /// Largest distance of an edge point from its line, pixels. Default 1: five times the scatter of edge
    /// points in compressed video; the outline of a limb 100 px long that bows by 2 px is split once.
    pub max_deviation_px: f64,
    /// Minimum length of a segment, pixels. Default 8: shorter segments also arise from noise, and their
    /// direction scatters by degrees.
    pub min_length_px: f64,
}

impl Default for LineOptions {
    fn default() -> Self {
        Self { max_deviation_px: 1.0, min_length_px: 8.0 }
    }
}

impl LineOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let Self { max_deviation_px, min_length_px } = *self;
        OptionError::unless(max_deviation_px > 0.0, "max_deviation_px", "positive", max_deviation_px)?;
        OptionError::unless(min_length_px >= 0.0, "min_length_px", "0 or more", min_length_px)
    }
}

/// A straight edge. The brighter side is on the right of the direction from start to end, as seen in the
/// image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSegment {
    /// Start point, pixels.
    pub start_px: DVec2,
    /// End point, pixels.
    pub end_px: DVec2,
    /// Mean gradient magnitude of the edge points, grey levels per pixel.
    pub mean_gradient: f64,
    /// Root mean square distance of the edge points from the line, pixels, without the rounded ends.
    pub residual_rms_px: f64,
    /// Number of edge points along the segment.
    pub edgel_count: usize,
}

impl EdgeSegment {
    /// Distance between the two ends, pixels.
    pub fn length_px(&self) -> f64 {
        self.start_px.distance(self.end_px)
    }

    /// Unit vector from start to end; zero if they coincide.
    pub fn direction(&self) -> DVec2 {
        (self.end_px - self.start_px).normalize_or_zero()
    }

    /// Unit vector across the edge towards the brighter side; zero if the ends coincide.
    pub fn normal(&self) -> DVec2 {
        self.direction().perp()
    }

    /// The midpoint of the segment, pixels.
    pub fn midpoint_px(&self) -> DVec2 {
        self.start_px.midpoint(self.end_px)
    }
}

/// Finds the straight edges of a frame.
///
/// 1. Edge points, linked into chains ([`edge_chains`]).
/// 2. Chains cut and fitted ([`segments_from_chains`]).
///
/// # Errors
///
/// Options out of range, or a mask that differs in size from the frame.
pub fn edge_segments(
    frame: &Frame<'_>,
    domain: &EdgeDomain<'_>,
    edge_options: &EdgeOptions,
    line_options: &LineOptions,
) -> Result<Vec<EdgeSegment>, LineError> {
    let chains = edge_chains(frame, domain, edge_options)?;
    segments_from_chains(&chains, line_options)
}

/// Approximates each chain by straight segments, in the order of the chains.
///
/// 1. Split a piece at its farthest point from the chord until every piece is within the tolerance of its own
///    line.
/// 2. Join neighbouring pieces that one line fits within the tolerance, those that it fits best first.
/// 3. Keep the pieces that are long enough.
///
/// # Errors
///
/// Options out of range.
pub fn segments_from_chains(
    chains: &EdgeChains,
    options: &LineOptions,
) -> Result<Vec<EdgeSegment>, LineError> {
    options.check()?;
    let mut segments = Vec::new();
    for edgels in chains.iter().filter(|edgels| edgels.len() >= 2) {
        let chain = Chain::new(edgels);
        let pieces = chain.join(chain.split(options.max_deviation_px), options.max_deviation_px);
        segments.extend(pieces.into_iter().filter_map(|piece| chain.segment(piece, options)));
    }
    Ok(segments)
}

/// A line as a point on it and a unit direction.
struct Line {
    point: DVec2,
    direction: DVec2,
    /// Sum of the squared distances of the points it was fitted to, and their number.
    residual_sq: f64,
    count: f64,
}

impl Line {
    fn residual_rms(&self) -> f64 {
        (self.residual_sq / self.count).sqrt()
    }

    fn distance(&self, point: DVec2) -> f64 {
        self.direction.perp_dot(point - self.point).abs()
    }
}

/// Sums over the points of a chain from its start, relative to its first point.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sum: DVec2,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Moments {
    fn plus(self, p: DVec2) -> Self {
        Self {
            count: self.count + 1.0,
            sum: self.sum + p,
            xx: self.xx + p.x * p.x,
            xy: self.xy + p.x * p.y,
            yy: self.yy + p.y * p.y,
        }
    }

    fn minus(self, other: Self) -> Self {
        Self {
            count: self.count - other.count,
            sum: self.sum - other.sum,
            xx: self.xx - other.xx,
            xy: self.xy - other.xy,
            yy: self.yy - other.yy,
        }
    }

    /// The line through the mean along the eigenvector of the larger eigenvalue of the scatter matrix
    /// S = sum (p - m)(p - m)^T. With d = `S_xx` - `S_yy` and r = sqrt(d^2 + 4 `S_xy`^2) the eigenvector is
    /// (r + d, 2 `S_xy`) or, without cancellation where d < 0, (2 `S_xy`, r - d); the smaller eigenvalue
    /// (`S_xx` + `S_yy` - r) / 2 is the sum of squared distances.
    fn line(self) -> Line {
        let mean = self.sum / self.count;
        let xx = self.xx - self.sum.x * mean.x;
        let xy = self.xy - self.sum.x * mean.y;
        let yy = self.yy - self.sum.y * mean.y;
        let d = xx - yy;
        let r = (d * d + 4.0 * xy * xy).sqrt();
        let along = if d >= 0.0 { DVec2::new(r + d, 2.0 * xy) } else { DVec2::new(2.0 * xy, r - d) };
        Line {
            point: mean,
            direction: along.normalize_or(DVec2::X),
            residual_sq: (0.5 * (xx + yy - r)).max(0.0),
            count: self.count,
        }
    }
}

/// A chain of edge points with prefix sums, which make the line through any piece of it cheap.
struct Chain<'a> {
    edgels: &'a [Edgel],
    origin: DVec2,
    /// Positions relative to the origin.
    points: Vec<DVec2>,
    /// Entry i sums over the first i points.
    moments: Vec<Moments>,
}

impl<'a> Chain<'a> {
    fn new(edgels: &'a [Edgel]) -> Self {
        let origin = edgels[0].position_px.as_dvec2();
        let points: Vec<DVec2> = edgels.iter().map(|e| e.position_px.as_dvec2() - origin).collect();
        let mut moments = vec![Moments::default()];
        moments.extend(points.iter().scan(Moments::default(), |sum, &p| {
            *sum = sum.plus(p);
            Some(*sum)
        }));
        Self { edgels, origin, points, moments }
    }

    fn whole(&self) -> Range<usize> {
        0..self.points.len()
    }

    fn line(&self, piece: &Range<usize>) -> Line {
        self.moments[piece.end].minus(self.moments[piece.start]).line()
    }

    fn is_straight(&self, piece: &Range<usize>, max_deviation_px: f64) -> bool {
        let line = self.line(piece);
        self.points[piece.clone()].iter().all(|&p| line.distance(p) <= max_deviation_px)
    }

    /// Pieces in order, each within the tolerance of its own line. The point of a cut is the end of both its pieces, so that
    /// a chain has the same pieces from either end.
    fn split(&self, max_deviation_px: f64) -> Vec<Range<usize>> {
        let mut pieces = Vec::new();
        let mut open = vec![self.whole()];
        while let Some(piece) = open.pop() {
            if piece.len() <= 2 || self.is_straight(&piece, max_deviation_px) {
                pieces.push(piece);
                continue;
            }
            let cut = self.farthest_from_chord(&piece);
            open.push(cut..piece.end);
            open.push(piece.start..cut + 1);
        }
        pieces
    }

    /// The inner point farthest from the chord. The fitted line cannot be used instead: the line fitted to a
    /// corner runs through both sides, and the ends may be as far from it as the corner.
    fn farthest_from_chord(&self, piece: &Range<usize>) -> usize {
        let (a, b) = (self.points[piece.start], self.points[piece.end - 1]);
        let chord = b - a;
        let distance = |i: &usize| {
            let p = self.points[*i] - a;
            if chord == DVec2::ZERO { p.length_squared() } else { chord.perp_dot(p).abs() }
        };
        let inner = piece.start + 1..piece.end - 1;
        inner.max_by(|i, j| distance(i).total_cmp(&distance(j))).unwrap_or(piece.start + 1)
    }

    /// Joins neighbours whose common line is within the tolerance, those that it fits best first.
    fn join(&self, mut pieces: Vec<Range<usize>>, max_deviation_px: f64) -> Vec<Range<usize>> {
        let common = |before: &Range<usize>, after: &Range<usize>| {
            let both = before.start..after.end;
            self.is_straight(&both, max_deviation_px).then(|| self.line(&both).residual_rms())
        };
        // Entry i is of pieces i and i + 1.
        let mut residuals: Vec<Option<f64>> =
            pieces.windows(2).map(|pair| common(&pair[0], &pair[1])).collect();
        let best = |residuals: &[Option<f64>]| {
            let joinable = residuals.iter().enumerate().filter_map(|(i, residual)| Some((i, (*residual)?)));
            joinable.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
        };
        while let Some(i) = best(&residuals) {
            pieces[i].end = pieces.remove(i + 1).end;
            residuals.remove(i);
            for k in i.saturating_sub(1)..(i + 1).min(residuals.len()) {
                residuals[k] = common(&pieces[k], &pieces[k + 1]);
            }
        }
        pieces
    }

    /// The line refitted without the points more than twice the RMS distance away: the Gaussian rounds
    /// corners, and the rounded ends would turn and shift the line. These points must still be within the
    /// tolerance.
    fn line_without_rounded_ends(&self, piece: &Range<usize>, max_deviation_px: f64) -> Line {
        let points = &self.points[piece.clone()];
        let line = self.line(piece);
        let limit = 2.0 * line.residual_rms();
        let near = points.iter().filter(|&&p| line.distance(p) <= limit);
        let refitted = near.fold(Moments::default(), |sum, &p| sum.plus(p)).line();
        let is_near = || points.iter().all(|&p| refitted.distance(p) <= max_deviation_px);
        if 2.0 * refitted.count >= line.count && is_near() { refitted } else { line }
    }

    /// The segment fitted to a piece, `None` if it is too short.
    fn segment(&self, piece: Range<usize>, options: &LineOptions) -> Option<EdgeSegment> {
        if piece.len() < 2 {
            return None;
        }
        let line = self.line_without_rounded_ends(&piece, options.max_deviation_px);
        let edgels = &self.edgels[piece.clone()];
        let count = piece.len() as f64;
        let gradient = edgels.iter().map(|e| e.gradient.as_dvec2()).sum::<DVec2>();
        let direction =
            if line.direction.perp_dot(gradient) < 0.0 { -line.direction } else { line.direction };
        let along = self.points[piece].iter().map(|&p| direction.dot(p - line.point));
        let (from, to) = along.fold((f64::MAX, f64::MIN), |(from, to), t| (from.min(t), to.max(t)));
        let foot = self.origin + line.point;
        (to - from >= options.min_length_px).then(|| EdgeSegment {
            start_px: foot + from * direction,
            end_px: foot + to * direction,
            mean_gradient: edgels.iter().map(|e| f64::from(e.gradient.length())).sum::<f64>() / count,
            residual_rms_px: line.residual_rms(),
            edgel_count: edgels.len(),
        })
    }
}

#[cfg(test)]
mod tests;
