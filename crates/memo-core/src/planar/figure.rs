//! From unnamed moving points to a linkage: which points are joined, in which planes they swing, how long the
//! limbs are.
//!
//! Hoffman and Flinchbaugh 1982, section 6: divide the points into groups of two and three, test each group for
//! planar motion, combine. They leave "combine" open, and with real walking the test alone does not do: joints
//! of one body are related, so several false groups fit as well as the true ones. Here the groups compete: the
//! figure is the least costly division of all points into hinges (three points), rods (two) and points left
//! alone ([exact cover](super::cover)). A group costs what its plane leaves unexplained, a little for its length,
//! and what sets it apart from the nearest rest of the body: the end of a limb sits on a trunk that hardly moves
//! against other trunk points, whereas the pieces of a limb cut wrongly do not. Where there are too many points,
//! a minimum spanning tree over rods (`Method::Forest`) takes its place: with little noise it finds nine limbs in ten, with
//! false links among them, at 2 px eight in ten.
//!
//! Costs are in units of the figure's size and were chosen on four walks (see `tests/planar_figure.rs`).
//!
//! What it cannot do: tell a chain from its mirror; give the depth of one chain against another; read figures
//! whose limbs leave their planes (turning, spinning): such windows are reported lost. A limb that hardly moves
//! in the image is joined by its shortness alone; its links say so by their confidence.

pub use super::cover::MOST_POINTS;
use super::cover::{Piece, best_cover};
use super::{
    Evidence, EvidenceOptions, FitError, FitOptions, HingeFit, Plane, RodFit, Verdict, fit_hinge, fit_rod,
    hinge_evidence, rod_evidence,
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use thiserror::Error;

/// More points than this are refused.
pub const MOST_TRACKS: usize = 200;

/// Why tracks could not be read as a figure.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FigureError {
    /// Fewer than two points, or too many.
    #[error("{points} points: between 2 and {MOST_TRACKS} can be linked")]
    Points {
        /// Points given.
        points: usize,
    },
    /// A track does not have one position a time.
    #[error("track {track} has {positions} positions for {times} times")]
    Lengths {
        /// The track.
        track: usize,
        /// Its positions.
        positions: usize,
        /// Times given.
        times: usize,
    },
    /// Too few frames for any test.
    #[error("{frames} frames are too few: at least {FEWEST_FRAMES} wanted")]
    Frames {
        /// Frames given.
        frames: usize,
    },
    /// A position is infinite or absurd.
    #[error("track {track} at frame {frame} is at ({u}, {v}): pixels wanted, NaN for unseen")]
    Position {
        /// The track.
        track: usize,
        /// The frame.
        frame: usize,
        /// Column given.
        u: f64,
        /// Row given.
        v: f64,
    },
    /// Times do not increase.
    #[error("times must be finite and increase, frame {frame} does not")]
    Times {
        /// First such frame.
        frame: usize,
    },
    /// All points are in one place, or none is ever seen.
    #[error("the points have no extent: nothing to link")]
    NoExtent,
    /// An option makes no sense.
    #[error("{option} must be {wanted}, got {value}")]
    Option {
        /// Its name.
        option: &'static str,
        /// What it may be.
        wanted: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Fewest frames of a window.
const FEWEST_FRAMES: usize = 8;

/// Costs of the groups, in units of the figure's size (RMS distance of the points from their middle; about 0.42 m for
/// a person).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// Of each unit of length, without a unit. 0.02: true links are shorter than false ones that fit as well;
    /// anything from 0.01 to 0.03 does nearly as well.
    pub length: f64,
    /// Of a rod, because limbs have two segments.
    pub rod: f64,
    /// Of a point left alone, at most: one that stays close to another point costs what sets them apart.
    pub alone: f64,
    /// Of a group that sits on nothing, at most.
    pub detached: f64,
    /// Share of the noise's part of the residual that is not counted. Not all: false groups are noisy too.
    pub noise: f64,
    /// Scale of the costs at which covers are weighed against each other for the confidence.
    pub temperature: f64,
}

impl Default for Costs {
    fn default() -> Self {
        Self { length: 0.02, rod: 0.018, alone: 0.061, detached: 0.08, noise: 0.6, temperature: 0.0045 }
    }
}

/// How tracks are read as a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FigureOptions {
    /// Options of the fits; `noise_sd` in the unit of the tracks.
    pub fit: FitOptions,
    /// Rate of false targets of the verdicts.
    pub evidence: EvidenceOptions,
    /// Costs of the groups.
    pub costs: Costs,
    /// Size of the figure in the unit of the tracks (RMS distance of its joints from their middle, about a
    /// quarter of a person's height); `None` takes that of the points given.
    pub size: Option<f64>,
    /// Length of the windows in time, seconds. 1.2, about a stride; half a stride still does, less does not.
    /// Tracks of up to one and a half windows are read as one.
    pub window_s: f64,
    /// Most points that are divided by exact cover, at most [`MOST_POINTS`]; more are linked by a spanning tree.
    pub most_covered: usize,
    /// Whether a figure's lengths are carried through windows in which it is lost.
    pub carries_structure: bool,
}

impl Default for FigureOptions {
    fn default() -> Self {
        Self {
            fit: FitOptions::default(),
            evidence: EvidenceOptions::default(),
            costs: Costs::default(),
            size: None,
            window_s: 1.2,
            most_covered: MOST_POINTS,
            carries_structure: false,
        }
    }
}

/// How the links were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The least costly exact cover.
    Cover,
    /// A minimum spanning tree over rods: too many points for a cover.
    Forest,
}

/// A limb segment: two points at a fixed distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The two points, the lower index first.
    pub points: [usize; 2],
    /// Length, in the unit of the tracks.
    pub length: f64,
    /// Its standard deviation (first order).
    pub length_sd: f64,
    /// By how much the best figure without this link costs more, in the unit of the tracks; infinite if there is
    /// none.
    pub margin: f64,
    /// Share of the weight of all figures that have this link, in [0, 1]; NaN for a forest.
    pub confidence: f64,
}

/// One or two links in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// End and end (2), or end, pivot, end (3). The first is nearest to the rest of the body.
    pub points: Vec<usize>,
    /// The links, in that order.
    pub links: Vec<Link>,
    /// Plane of the motion, or its mirror.
    pub plane: Plane,
    /// RMS of the residuals, in the unit of the tracks.
    pub residual_rms: f64,
    /// Whether its motion is evidence of a plane.
    pub evidence: Evidence,
    /// Depth of each point against the first, frame by frame in the order of `points`; NaN where unseen.
    /// Or all with the other sign.
    pub depth: Vec<Vec<f64>>,
    /// Angle at the pivot frame by frame, radians, π = straight; empty for a rod. The mirror has the same.
    pub angle_rad: Vec<f64>,
}

/// Where two groups sit on each other: a pair of points that hardly moves apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// A point of each group.
    pub points: [usize; 2],
    /// What sets them apart (residual and motion), in the unit of the tracks.
    pub apart: f64,
}

/// A linkage found in one window.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// How it was found.
    pub method: Method,
    /// Its chains.
    pub chains: Vec<Chain>,
    /// How chains and single points sit on each other, best first; points of no joint stand free.
    pub joints: Vec<Joint>,
    /// Points in no chain.
    pub alone: Vec<usize>,
    /// Cost of the cover in the unit of the tracks; NaN for a forest.
    pub cost: f64,
    /// The size that costs are relative to, in the unit of the tracks.
    pub size: f64,
}

impl Figure {
    /// All links.
    pub fn links(&self) -> impl Iterator<Item = &Link> {
        self.chains.iter().flat_map(|chain| &chain.links)
    }

    /// Number of chains with a verdict of this kind.
    fn count(&self, is_kind: impl Fn(Verdict) -> bool) -> usize {
        self.chains.iter().filter(|chain| is_kind(chain.evidence.verdict)).count()
    }
}

/// Whether a window could be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// More chains move in planes than leave them.
    Interpreted,
    /// As many chains leave their planes as move in them, or more.
    Lost,
    /// Hardly anything moves: no chain speaks for or against planes.
    Still,
    /// Too little was seen for any chain.
    Unseen,
}

/// One window in time.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureWindow {
    /// First frame.
    pub start: usize,
    /// Frame after the last.
    pub end: usize,
    /// Whether it could be read.
    pub status: Status,
    /// Chains that move in their plane, leave it, and say nothing.
    pub chains: [usize; 3],
    /// The best figure, also when lost.
    pub figure: Figure,
}

/// Where the points of a frame in space come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthSource {
    /// From a plane.
    Planar,
    /// From lengths of an earlier or later planar period.
    Carried,
    /// Not known.
    Unknown,
}

/// What was made of all tracks.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpretation {
    /// The windows, in order; they overlap by half.
    pub windows: Vec<FigureWindow>,
    /// Depth of each point against the first point of its chain, T x K, in the unit of the tracks; NaN where
    /// not known. The sign follows from window to window while these overlap; each chain may be reflected.
    pub depth: Vec<f64>,
    /// By frame.
    pub sources: Vec<DepthSource>,
}

/// Reads unnamed tracks (K tracks of T image positions, NaN where unseen) as a figure, window by window.
///
/// # Errors
/// Fewer than two tracks, too many, differing lengths, too few frames, infinite positions, times that do not
/// increase, senseless options.
pub fn interpret_figure(
    tracks: &[Vec<DVec2>],
    times_s: &[f64],
    options: &FigureOptions,
) -> Result<Interpretation, FigureError> {
    check(tracks, times_s, options)?;
    let size = options.size.unwrap_or_else(|| size_of(tracks));
    if !(size > 0.0 && size.is_finite()) {
        return Err(FigureError::NoExtent);
    }
    let ranges = windows(times_s, options.window_s);
    let windows: Vec<FigureWindow> = ranges
        .into_par_iter()
        .map(|(start, end)| {
            let part: Vec<&[DVec2]> = tracks.iter().map(|track| &track[start..end]).collect();
            let figure = best_figure(&part, size, options);
            let planar = figure.count(|v| v == Verdict::Planar);
            let refuted = figure.count(|v| v == Verdict::NotPlanar);
            let silent = figure.chains.len() - planar - refuted;
            let status = match (planar, refuted, silent) {
                (0, 0, 0) => Status::Unseen,
                (0, 0, _) => Status::Still,
                _ if planar > refuted => Status::Interpreted,
                _ => Status::Lost,
            };
            FigureWindow { start, end, status, chains: [planar, refuted, silent], figure }
        })
        .collect();
    let (depth, sources) = depth_over_time(tracks, &windows, options.carries_structure);
    Ok(Interpretation { windows, depth, sources })
}

fn check(tracks: &[Vec<DVec2>], times_s: &[f64], options: &FigureOptions) -> Result<(), FigureError> {
    if !(2..=MOST_TRACKS).contains(&tracks.len()) {
        return Err(FigureError::Points { points: tracks.len() });
    }
    let times = times_s.len();
    if times < FEWEST_FRAMES {
        return Err(FigureError::Frames { frames: times });
    }
    for (track, positions) in tracks.iter().enumerate() {
        if positions.len() != times {
            return Err(FigureError::Lengths { track, positions: positions.len(), times });
        }
        let is_absurd = |p: &DVec2| p.to_array().iter().any(|x| x.abs() > 1e9);
        if let Some(frame) = positions.iter().position(is_absurd) {
            return Err(FigureError::Position { track, frame, u: positions[frame].x, v: positions[frame].y });
        }
    }
    let goes_on =
        |frame: usize| times_s[frame].is_finite() && (frame == 0 || times_s[frame] > times_s[frame - 1]);
    if let Some(frame) = (0..times).find(|&frame| !goes_on(frame)) {
        return Err(FigureError::Times { frame });
    }
    let c = &options.costs;
    for (option, value) in [
        ("length cost", c.length),
        ("rod cost", c.rod),
        ("cost of a point alone", c.alone),
        ("cost of a detached group", c.detached),
        ("share of the noise", c.noise),
    ] {
        if !(0.0..=1e6).contains(&value) {
            return Err(FigureError::Option { option, wanted: "between 0 and 1,000,000", value });
        }
    }
    for (option, value) in [
        ("temperature", c.temperature),
        ("window_s", options.window_s),
        ("size", options.size.unwrap_or(1.0)),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(FigureError::Option { option, wanted: "positive and finite", value });
        }
    }
    let f = &options.fit;
    for (option, wanted, value, is_good) in [
        ("noise_sd", "finite and not negative", f.noise_sd, (0.0..=1e9).contains(&f.noise_sd)),
        ("max_tilt_deg", "between 0 and 90", f.max_tilt_deg, f.max_tilt_deg > 0.0 && f.max_tilt_deg < 90.0),
        ("outlier_sd", "positive", f.outlier_sd, f.outlier_sd > 0.0 && f.outlier_sd.is_finite()),
        (
            "max_outlier_fraction",
            "between 0 and 0.5",
            f.max_outlier_fraction,
            (0.0..=0.5).contains(&f.max_outlier_fraction),
        ),
    ] {
        if !is_good {
            return Err(FigureError::Option { option, wanted, value });
        }
    }
    Ok(())
}

/// RMS distance of the points from their middle, over all frames.
fn size_of(tracks: &[Vec<DVec2>]) -> f64 {
    let frames = tracks.first().map_or(0, Vec::len);
    let (mut squares, mut number) = (0.0, 0.0);
    for frame in 0..frames {
        let seen: Vec<DVec2> = tracks.iter().map(|t| t[frame]).filter(|p| p.is_finite()).collect();
        let middle = seen.iter().sum::<DVec2>() / seen.len().max(1) as f64;
        squares += seen.iter().map(|p| p.distance_squared(middle)).sum::<f64>();
        number += seen.len() as f64;
    }
    if number > 0.0 { (squares / number).sqrt() } else { 0.0 }
}

/// Windows of a length in time that overlap by half; the last ends with the tracks.
fn windows(times_s: &[f64], window_s: f64) -> Vec<(usize, usize)> {
    let frames = times_s.len();
    let interval_s = (times_s[frames - 1] - times_s[0]) / (frames - 1) as f64;
    let long = ((window_s / interval_s).round().clamp(0.0, 1e9) as usize).max(FEWEST_FRAMES);
    if 2 * frames <= 3 * long {
        return vec![(0, frames)];
    }
    let steps = (2 * (frames - long)).div_ceil(long).max(1);
    (0..=steps).map(|i| i * (frames - long) / steps).map(|start| (start, start + long)).collect()
}

/// Fits of all rods of a window, and what they cost.
struct Rods {
    points: usize,
    /// Of i < j at i * points + j; `None` where they cannot be fitted.
    fits: Vec<Option<RodFit>>,
    /// What sets two points apart, both ways, relative to the size.
    apart: Vec<f64>,
}

impl Rods {
    fn fitted(tracks: &[&[DVec2]], size: f64, options: &FigureOptions) -> Self {
        let points = tracks.len();
        let both_ways = |index: usize| (index / points, index % points);
        let results: Vec<Result<RodFit, FitError>> = (0..points * points)
            .into_par_iter()
            .map(|index| match both_ways(index) {
                (i, j) if i < j => fit_rod(tracks[i], tracks[j], &options.fit),
                _ => Err(FitError::TooFewViews { found: 0, needed: 0 }),
            })
            .collect();
        let apart = (0..points * points).map(|index| {
            let (i, j) = both_ways(index);
            match &results[i.min(j) * points + i.max(j)] {
                Ok(fit) => {
                    (unexplained(fit.residual_rms, options) + clean_motion(fit.motion, options)) / size
                }
                Err(FitError::NoMotion { .. }) => 0.0,
                Err(_) => f64::INFINITY,
            }
        });
        let apart = apart.collect();
        Self { points, fits: results.into_iter().map(Result::ok).collect(), apart }
    }

    fn fit(&self, i: usize, j: usize) -> Option<&RodFit> {
        self.fits[i.min(j) * self.points + i.max(j)].as_ref()
    }

    fn apart(&self, i: usize, j: usize) -> f64 {
        self.apart[i * self.points + j]
    }

    /// What sets a group apart from the nearest point outside it, by one of its ends.
    fn detachment(&self, ends: &[usize], group: &[usize], most: f64) -> f64 {
        let outside = |j: &usize| !group.contains(j);
        let nearest = |&end: &usize| (0..self.points).filter(outside).map(move |j| self.apart(end, j));
        ends.iter().flat_map(nearest).fold(most, f64::min)
    }
}

/// A residual without (a share of) what noise adds to it.
fn unexplained(residual_rms: f64, options: &FigureOptions) -> f64 {
    residual_rms - options.costs.noise * std::f64::consts::SQRT_2 * options.fit.noise_sd
}

/// RMS motion of an image vector without what noise adds to it: four coordinates.
fn clean_motion(motion: f64, options: &FigureOptions) -> f64 {
    (motion * motion - 4.0 * options.fit.noise_sd.powi(2)).max(0.0).sqrt()
}

/// A hinge of the window that may be part of the figure.
struct Candidate {
    /// End, pivot, end; or end, end; or one point.
    points: Vec<usize>,
    cost: f64,
}

/// The figure of least cost in one window.
fn best_figure(tracks: &[&[DVec2]], size: f64, options: &FigureOptions) -> Figure {
    let rods = Rods::fitted(tracks, size, options);
    if tracks.len() > options.most_covered.min(MOST_POINTS) {
        return forest(tracks, &rods, size, options);
    }
    let candidates = candidates(tracks, &rods, size, options);
    let pieces: Vec<Piece> = candidates
        .iter()
        .map(|c| Piece { mask: c.points.iter().fold(0, |mask, &p| mask | 1 << p), cost: c.cost })
        .collect();
    let cover = best_cover(tracks.len(), &pieces, options.costs.temperature)
        .expect("single points are among the pieces");
    let rival = |link: [usize; 2]| {
        // Every cover has one piece that holds the link's first point.
        let holds = |c: &Candidate| c.points.contains(&link[0]) && !links_of(&c.points).any(|l| l == link);
        let others = candidates.iter().zip(&cover.cost_with).filter(|(c, _)| holds(c));
        others.map(|(_, &cost)| cost).fold(f64::INFINITY, f64::min)
    };
    let share = |link: [usize; 2]| {
        let having =
            candidates.iter().zip(&cover.share).filter(|(c, _)| links_of(&c.points).any(|l| l == link));
        having.map(|(_, share)| share).sum::<f64>().min(1.0)
    };
    let judge = |link: [usize; 2]| ((rival(link) - cover.cost) * size, share(link));
    let groups: Vec<Vec<usize>> = cover.chosen.iter().map(|&i| candidates[i].points.clone()).collect();
    let joints = joints(&groups, &rods, size, options);
    let chains = groups.iter().filter(|g| g.len() > 1);
    let chains = chains.filter_map(|group| chain(group, tracks, &rods, &joints, options, &judge)).collect();
    let alone = groups.iter().filter(|g| g.len() == 1).map(|g| g[0]).collect();
    Figure { method: Method::Cover, chains, joints, alone, cost: cover.cost * size, size }
}

/// The links of a chain's points in order.
fn links_of(points: &[usize]) -> impl Iterator<Item = [usize; 2]> {
    points.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])])
}

/// All single points, rods and hinges with their costs.
fn candidates(tracks: &[&[DVec2]], rods: &Rods, size: f64, options: &FigureOptions) -> Vec<Candidate> {
    let (points, costs) = (tracks.len(), &options.costs);
    let most = 3.0 * costs.alone + costs.detached;
    let mut found: Vec<Candidate> = (0..points)
        .map(|i| Candidate { points: vec![i], cost: rods.detachment(&[i], &[i], costs.alone) })
        .collect();
    for i in 0..points {
        for j in i + 1..points {
            let Some(fit) = rods.fit(i, j) else { continue };
            let own =
                unexplained(fit.residual_rms, options) / size + costs.length * fit.length / size + costs.rod;
            let cost = own + rods.detachment(&[i, j], &[i, j], costs.detached);
            if cost < most {
                found.push(Candidate { points: vec![i, j], cost });
            }
        }
    }
    let triples: Vec<[usize; 3]> = (0..points)
        .flat_map(|pivot| (0..points).map(move |i| (pivot, i)))
        .flat_map(|(pivot, i)| (i + 1..points).map(move |j| [i, pivot, j]))
        .filter(|[i, pivot, j]| i != pivot && j != pivot)
        .collect();
    found.par_extend(triples.into_par_iter().filter_map(|[i, pivot, j]| {
        let fit = fit_hinge(tracks[i], tracks[pivot], tracks[j], &options.fit).ok()?;
        let length = (fit.lengths[0] + fit.lengths[1]) / size;
        let own = unexplained(fit.residual_rms, options) / size + costs.length * length;
        let cost = own + rods.detachment(&[i, j], &[i, pivot, j], costs.detached);
        (cost < most).then_some(Candidate { points: vec![i, pivot, j], cost })
    }));
    found
}

/// How groups sit on each other: the least spanning forest over ends that stay together.
fn joints(groups: &[Vec<usize>], rods: &Rods, size: f64, options: &FigureOptions) -> Vec<Joint> {
    let ends = |group: &[usize]| [group[0], group[group.len() - 1]];
    let mut pairs = Vec::new();
    for (a, first) in groups.iter().enumerate() {
        for (b, second) in groups.iter().enumerate().skip(a + 1) {
            let between =
                ends(first).into_iter().flat_map(|i| ends(second).map(|j| (rods.apart(i, j), i, j)));
            if let Some((apart, i, j)) = between.min_by(|x, y| x.0.total_cmp(&y.0)) {
                pairs.push((apart, a, b, [i, j]));
            }
        }
    }
    pairs.retain(|pair| pair.0 < options.costs.detached);
    let edges = spanning_forest(groups.len(), &mut pairs);
    edges.into_iter().map(|(apart, points)| Joint { points, apart: apart * size }).collect()
}

/// Kruskal's forest over edges (weight, node, node, what), weights and whats returned, lightest first.
fn spanning_forest(nodes: usize, edges: &mut [(f64, usize, usize, [usize; 2])]) -> Vec<(f64, [usize; 2])> {
    edges.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.3.cmp(&y.3)));
    let mut tree: Vec<usize> = (0..nodes).collect();
    let mut kept = Vec::new();
    for &(weight, a, b, what) in edges.iter() {
        let (a, b) = (tree[a], tree[b]);
        if a != b {
            tree.iter_mut().filter(|t| **t == b).for_each(|t| *t = a);
            kept.push((weight, what));
        }
    }
    kept
}

/// A group of the figure with all that is known about it; `None` if its points cannot be fitted.
fn chain(
    group: &[usize],
    tracks: &[&[DVec2]],
    rods: &Rods,
    joints: &[Joint],
    options: &FigureOptions,
    judge: &impl Fn([usize; 2]) -> (f64, f64),
) -> Option<Chain> {
    let mut points = group.to_vec();
    let sits_on = |end: usize| {
        joints.iter().filter(|j| j.points.contains(&end)).map(|j| j.apart).fold(f64::INFINITY, f64::min)
    };
    if sits_on(points[points.len() - 1]) < sits_on(points[0]) {
        points.reverse();
    }
    let lengths = |lengths: &[f64], sds: &[f64]| -> Vec<Link> {
        let of = |(k, pair): (usize, [usize; 2])| {
            let (margin, confidence) = judge(pair);
            Link { points: pair, length: lengths[k], length_sd: sds[k], margin, confidence }
        };
        links_of(&points).enumerate().map(of).collect()
    };
    if let [a, b] = points[..] {
        let fit = rods.fit(a, b)?;
        let depth_of = |sign: f64| fit.depth.iter().map(|z| sign * z).collect::<Vec<_>>();
        // The fit's pivot is the lower index.
        let depth = depth_of(if a < b { 1.0 } else { -1.0 });
        return Some(Chain {
            links: lengths(&[fit.length], &[fit.covariance.z_axis.z.sqrt()]),
            plane: fit.plane,
            residual_rms: fit.residual_rms,
            evidence: rod_evidence(fit, options.fit.noise_sd, &options.evidence),
            depth: depth.iter().map(|&z| vec![0.0, z]).collect(),
            angle_rad: Vec::new(),
            points,
        });
    }
    let [a, pivot, b] = points[..] else { return None };
    let fit = fit_hinge(tracks[a], tracks[pivot], tracks[b], &options.fit).ok()?;
    let sd = |k: usize| fit.covariance[(2 + k, 2 + k)].sqrt();
    Some(Chain {
        links: lengths(&fit.lengths, &[sd(0), sd(1)]),
        plane: fit.plane,
        residual_rms: fit.residual_rms,
        evidence: hinge_evidence(&fit, options.fit.noise_sd, &options.evidence),
        depth: fit.depth.iter().map(|[first, second]| vec![0.0, -first, second - first]).collect(),
        angle_rad: (0..tracks[pivot].len())
            .map(|t| angle(&fit, [a, pivot, b].map(|p| tracks[p][t]), t))
            .collect(),
        points,
    })
}

/// Angle at the pivot of a hinge in one frame, radians; NaN where unseen.
fn angle(fit: &HingeFit, [a, pivot, b]: [DVec2; 3], frame: usize) -> f64 {
    let [first, second] = fit.depth[frame];
    let (u, v): (DVec3, DVec3) = ((a - pivot).extend(first), (b - pivot).extend(second));
    u.cross(v).length().atan2(u.dot(v))
}

/// Links by a minimum spanning tree over rods; each a chain of its own.
///
/// A rod weighs its residual and twice the cover's cost of its length: rods alone leave more to the length than
/// hinges do. (Residual times length loses a few limbs more at 0 px and many at 2 px.)
fn forest(tracks: &[&[DVec2]], rods: &Rods, size: f64, options: &FigureOptions) -> Figure {
    let points = tracks.len();
    let mut edges = Vec::new();
    for i in 0..points {
        for j in i + 1..points {
            if let Some(fit) = rods.fit(i, j) {
                edges.push((fit.residual_rms + 2.0 * options.costs.length * fit.length, i, j, [i, j]));
            }
        }
    }
    let kept: Vec<[usize; 2]> =
        spanning_forest(points, &mut edges).into_iter().map(|(_, pair)| pair).collect();
    let judge = |_: [usize; 2]| (f64::NAN, f64::NAN);
    let chains: Vec<Chain> =
        kept.iter().filter_map(|pair| chain(pair, tracks, rods, &[], options, &judge)).collect();
    let alone = (0..points).filter(|p| !kept.iter().any(|pair| pair.contains(p))).collect();
    Figure { method: Method::Forest, chains, joints: Vec::new(), alone, cost: f64::NAN, size }
}

/// Depths of all points over all frames: from the interpreted window whose middle is nearest, each chain's
/// reflection following the window before; then, if asked, carried through the rest.
fn depth_over_time(
    tracks: &[Vec<DVec2>],
    windows: &[FigureWindow],
    carries: bool,
) -> (Vec<f64>, Vec<DepthSource>) {
    let (points, frames) = (tracks.len(), tracks[0].len());
    let mut depth = vec![f64::NAN; points * frames];
    let mut sources = vec![DepthSource::Unknown; frames];
    let read: Vec<&FigureWindow> = windows.iter().filter(|w| w.status == Status::Interpreted).collect();
    let nearest = |frame: usize| {
        let holding = read.iter().enumerate().filter(|(_, w)| (w.start..w.end).contains(&frame));
        holding.min_by_key(|(_, w)| (w.start + w.end).abs_diff(2 * frame + 1)).map(|(index, _)| index)
    };
    let signs = reflections(&read);
    for frame in 0..frames {
        let Some(index) = nearest(frame) else { continue };
        sources[frame] = DepthSource::Planar;
        for (chain, sign) in read[index].figure.chains.iter().zip(&signs[index]) {
            for (&point, z) in chain.points.iter().zip(&chain.depth[frame - read[index].start]) {
                depth[frame * points + point] = sign * z;
            }
        }
    }
    if carries {
        carry(tracks, &read, &mut depth, &mut sources);
    }
    (depth, sources)
}

/// For each chain of each window the sign that fits the same points in the window before where they overlap.
fn reflections(windows: &[&FigureWindow]) -> Vec<Vec<f64>> {
    let mut signs: Vec<Vec<f64>> = Vec::with_capacity(windows.len());
    for (index, window) in windows.iter().enumerate() {
        let sign_of = |chain: &Chain| {
            let Some(before) = index.checked_sub(1) else { return 1.0 };
            let previous = windows[before];
            let pair = |other: &Chain| other.points == chain.points;
            let Some(k) = previous.figure.chains.iter().position(pair) else { return 1.0 };
            let other = &previous.figure.chains[k];
            let agreement: f64 = (window.start..previous.end.max(window.start))
                .flat_map(|t| chain.depth[t - window.start].iter().zip(&other.depth[t - previous.start]))
                .map(|(a, b)| a * b)
                .filter(|product| product.is_finite())
                .sum();
            if agreement * signs[before][k] < 0.0 { -1.0 } else { 1.0 }
        };
        signs.push(window.figure.chains.iter().map(sign_of).collect());
    }
    signs
}

/// Goes on with the lengths of the chains that did not leave their planes where no plane is known, forwards from the window before, then
/// backwards from the window after.
///
/// A link of length L and image vector d has |z| = sqrt(L² - |d|²), or 0 where the image is too long. The sign
/// is the one nearer to the depth that goes on as before (z + dz/dt). Where the link passes parallel to the
/// image the two signs meet: there continuity of the motion decides, and may decide wrongly.
fn carry(tracks: &[Vec<DVec2>], read: &[&FigureWindow], depth: &mut [f64], sources: &mut [DepthSource]) {
    let (points, frames) = (tracks.len(), sources.len());
    for step in [1isize, -1] {
        for window in read {
            let from = if step > 0 { window.end as isize } else { window.start as isize - 1 };
            let mut frame = from;
            while frame >= 0 && (frame as usize) < frames && sources[frame as usize] == DepthSource::Unknown {
                frame += step;
            }
            let last = frame;
            let kept = window.figure.chains.iter().filter(|c| c.evidence.verdict != Verdict::NotPlanar);
            for chain in kept {
                for (pair, link) in chain.points.windows(2).zip(&chain.links) {
                    let at = |depth: &[f64], t: isize| {
                        let row = usize::try_from(t).ok().filter(|&t| t < frames)? * points;
                        Some(depth[row + pair[1]] - depth[row + pair[0]]).filter(|z| z.is_finite())
                    };
                    let mut state =
                        at(depth, from - step).map(|z| (z, at(depth, from - 2 * step).unwrap_or(z)));
                    let mut t = from;
                    while t != last {
                        let image = tracks[pair[1]][t as usize] - tracks[pair[0]][t as usize];
                        let (Some((now, before)), true) = (state, image.is_finite()) else { break };
                        let expected = 2.0 * now - before;
                        let size = (link.length * link.length - image.length_squared()).max(0.0).sqrt();
                        let z = if expected < 0.0 { -size } else { size };
                        let row = t as usize * points;
                        if pair[0] == chain.points[0] {
                            depth[row + pair[0]] = 0.0;
                        }
                        depth[row + pair[1]] = depth[row + pair[0]] + z;
                        state = Some((z, now));
                        t += step;
                    }
                }
            }
            let mut t = from;
            while t != last {
                let row = t as usize * points;
                if depth[row..row + points].iter().any(|z| z.is_finite()) {
                    sources[t as usize] = DepthSource::Carried;
                }
                t += step;
            }
        }
    }
}

/// Which reflection of a two-link chain bends as the joint can: knees backwards, elbows forwards.
///
/// With v from the first to the middle point and u from the middle to the last, the part of u across v points
/// against `facing` at a knee and along it at an elbow. `facing`: direction of the body in the camera's axes
/// (x right, y down, z away). Returns +1 for the depths as given, -1 for the mirror, and by how many degrees of
/// mean bend it is better; near 0 says that the view cannot tell (a pure side view never can).
pub fn reflection_by_bend(
    positions: &[[DVec2; 3]],
    depth: &[Vec<f64>],
    facing: DVec3,
    bends_forward: bool,
) -> Option<(f64, f64)> {
    let facing = facing.try_normalize()?;
    let wanted = if bends_forward { 1.0 } else { -1.0 };
    let bend = |sign: f64| {
        let frames = positions.iter().zip(depth).filter_map(|(p, z)| {
            let [a, b, c] = [0, 1, 2].map(|k| p[k].extend(sign * z[k]));
            let v = (b - a).try_normalize()?;
            let u = (c - b).try_normalize()?;
            let across = u - v * u.dot(v);
            Some(wanted * across.dot(facing).clamp(-1.0, 1.0).asin()).filter(|x| x.is_finite())
        });
        let bends: Vec<f64> = frames.collect();
        (!bends.is_empty()).then(|| bends.iter().sum::<f64>() / bends.len() as f64)
    };
    let (given, mirrored) = (bend(1.0)?, bend(-1.0)?);
    let sign = if mirrored > given { -1.0 } else { 1.0 };
    Some((sign, (given - mirrored).abs().to_degrees()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Body, Gait, GaitStyle, Walker};
    use crate::synth::{Random, View, WalkOptions, limbs_of, sampled_walk};
    use std::f64::consts::TAU;

    /// The model walking for `frames` frames at 60 Hz, turned about its pelvis by `turn(time)`, seen 35 degrees
    /// off the side at 200 px/m: tracks and true depths (T x 12) of the 12 joints.
    fn walker(
        frames: usize,
        turn: impl Fn(f64) -> f64,
        noise_px: f64,
    ) -> (Vec<Vec<DVec2>>, Vec<f64>, Vec<f64>) {
        let body = Body::from_height(1.75).unwrap();
        let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
        let motion = sampled_walk(&walker, &WalkOptions { frames, ..WalkOptions::default() }).unwrap();
        let (azimuth_rad, px_per_m) = (0.6f64, 200.0);
        let view = View::Orthographic { azimuth_rad, elevation_rad: 0.0, px_per_m };
        let away = DVec3::new(-azimuth_rad.sin(), azimuth_rad.cos(), 0.0);
        let (path, times_s) = (motion.pelvis_path(), motion.times_s().to_vec());
        let mut random = Random::new(9);
        let mut tracks = vec![Vec::new(); 12];
        let mut depth = Vec::new();
        for t in 0..frames {
            let turned = glam::DMat3::from_rotation_z(turn(times_s[t]));
            for (k, track) in tracks.iter_mut().enumerate() {
                let p = turned * (motion.at(t, k).unwrap() - path[t]) + path[t];
                let [du, dv] = random.normal_pair().map(|n| f64::from(n) * noise_px);
                track.push(view.project(p).unwrap() + DVec2::new(du, dv));
                depth.push(away.dot(p) * px_per_m);
            }
        }
        (tracks, times_s, depth)
    }

    fn limbs() -> Vec<[usize; 2]> {
        limbs_of(&crate::synth::motion::WALKER_NAMES.map(String::from))
    }

    fn sorted_links(figure: &Figure) -> Vec<[usize; 2]> {
        let mut links: Vec<[usize; 2]> = figure.links().map(|l| l.points).collect();
        links.sort_unstable();
        links
    }

    #[test]
    fn the_model_is_linked_with_its_lengths_depths_and_angles() {
        let (tracks, times_s, truth) = walker(66, |_| 0.0, 0.0);
        let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
        let [window] = &found.windows[..] else { panic!("one window") };
        assert_eq!((window.status, window.chains), (Status::Interpreted, [4, 0, 0]));
        assert_eq!(sorted_links(&window.figure), limbs());
        for chain in &window.figure.chains {
            for link in &chain.links {
                let [a, b] = link.points;
                let depth = truth[b] - truth[a];
                let length = (tracks[b][0] - tracks[a][0]).extend(depth).length();
                assert!((link.length / length - 1.0).abs() < 1e-3, "{link:?} {length}");
                assert!(link.confidence > 0.9 && link.margin > 0.0);
            }
            let [a, pivot, b] = chain.points[..] else { panic!() };
            let sign = (chain.depth[0][1] * (truth[pivot] - truth[a])).signum();
            for t in 0..66 {
                let at = |k: usize| truth[t * 12 + k] - truth[t * 12 + a];
                assert!((sign * chain.depth[t][2] - at(b)).abs() < 1.0, "frame {t}");
                let point = |k: usize| tracks[k][t].extend(truth[t * 12 + k]);
                let angle = (point(a) - point(pivot)).angle_between(point(b) - point(pivot));
                assert!((chain.angle_rad[t] - angle).abs() < 0.02);
            }
        }
        // The four chains sit on each other by shoulders and hips.
        assert_eq!(window.figure.joints.len(), 3);
        assert!(window.figure.joints.iter().all(|j| j.points.iter().all(|p| p % 3 == 0)));
    }

    #[test]
    fn threads_and_runs_do_not_change_the_figure() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 1.0);
        let options = FigureOptions {
            fit: FitOptions { noise_sd: 1.0, ..FitOptions::default() },
            ..FigureOptions::default()
        };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            format!("{:?}", pool.install(|| interpret_figure(&tracks, &times_s, &options)))
        };
        assert_eq!(with(1), with(3));
    }

    /// One full turn between 1.8 and 2.6 s of 4.4 s.
    fn spin(time_s: f64) -> f64 {
        TAU * ((time_s - 1.8) / 0.8).clamp(0.0, 1.0)
    }

    #[test]
    fn a_spin_is_lost_and_found_again() {
        let (tracks, times_s, _) = walker(264, spin, 0.5);
        let fit = FitOptions { noise_sd: 0.5, ..FitOptions::default() };
        let options = FigureOptions { fit, window_s: 0.9, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let mut seen = Vec::new();
        for window in &found.windows {
            let (from, to) = (times_s[window.start], times_s[window.end - 1]);
            println!("{from:.2} to {to:.2} s: {:?} {:?}", window.status, window.chains);
            if to < 1.8 || from > 2.6 {
                assert_eq!(window.status, Status::Interpreted, "{from} to {to} s");
                assert_eq!(sorted_links(&window.figure), limbs(), "{from} to {to} s");
            }
            if from > 1.6 && to < 2.8 || from < 2.0 && to > 2.4 {
                assert_eq!(window.status, Status::Lost, "{from} to {to} s");
            }
            seen.push(window.status);
        }
        assert!(seen.contains(&Status::Lost));
        let middle = (2.2 * 60.0) as usize;
        assert_eq!(found.sources[middle], DepthSource::Unknown);
        assert!(found.depth[middle * 12..][..12].iter().all(|z| z.is_nan()));
        assert_eq!((found.sources[0], found.sources[263]), (DepthSource::Planar, DepthSource::Planar));
    }

    #[test]
    fn lengths_are_carried_into_a_turn() {
        let (tracks, times_s, truth) = walker(264, spin, 0.0);
        let options = FigureOptions { window_s: 0.9, carries_structure: true, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let carried: Vec<usize> = (0..264).filter(|&t| found.sources[t] == DepthSource::Carried).collect();
        assert!(carried.len() > 10, "{carried:?}");
        let mut errors = Vec::new();
        for &t in &carried {
            for [a, b] in limbs() {
                let depth = |z: &[f64]| z[t * 12 + b] - z[t * 12 + a];
                let length = (tracks[b][t] - tracks[a][t]).extend(depth(&truth)).length();
                // Up to the chain's reflection: the sign is open.
                errors.push((depth(&found.depth).abs() - depth(&truth).abs()).abs() / length);
            }
        }
        errors.sort_by(f64::total_cmp);
        println!(
            "carried depth, relative to length: median {:.4}, p90 {:.4}",
            errors[errors.len() / 2],
            errors[errors.len() * 9 / 10]
        );
        assert!(errors[errors.len() * 9 / 10] < 0.1);
    }

    #[test]
    fn missing_points_and_still_figures_are_reported() {
        let (mut tracks, times_s, _) = walker(66, |_| 0.0, 0.0);
        tracks[2] = vec![DVec2::NAN; 66];
        tracks[8][20..30].fill(DVec2::NAN);
        let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
        let figure = &found.windows[0].figure;
        assert!(figure.alone.contains(&2));
        let mut wanted = limbs();
        wanted.retain(|l| !l.contains(&2));
        assert_eq!(sorted_links(figure), wanted);
        let still: Vec<Vec<DVec2>> = tracks.iter().map(|t| vec![t[0]; 66]).collect();
        let found = interpret_figure(&still, &times_s, &FigureOptions::default()).unwrap();
        assert_ne!(found.windows[0].status, Status::Interpreted);
        let unseen = vec![vec![DVec2::NAN; 66]; 12];
        assert_eq!(
            interpret_figure(&unseen, &times_s, &FigureOptions::default()),
            Err(FigureError::NoExtent)
        );
    }

    #[test]
    fn many_points_are_linked_by_a_forest() {
        let (mut tracks, times_s, _) = walker(66, |_| 0.0, 0.0);
        let options = FigureOptions { most_covered: 4, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let links = sorted_links(&found.windows[0].figure);
        assert_eq!(found.windows[0].figure.method, Method::Forest);
        assert_eq!(links.len(), 11);
        tracks.extend(
            (0..8).map(|i| tracks[i].iter().map(|p| *p + 5.0).collect::<Vec<_>>()).collect::<Vec<_>>(),
        );
        let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
        assert_eq!(found.windows[0].figure.method, Method::Forest);
    }

    #[test]
    fn bad_input_is_refused_with_its_values() {
        let (tracks, times_s, _) = walker(20, |_| 0.0, 0.0);
        let fresh = FigureOptions::default;
        let refused = |tracks: &[Vec<DVec2>], times_s: &[f64], options| {
            interpret_figure(tracks, times_s, &options).unwrap_err()
        };
        assert_eq!(refused(&tracks[..1], &times_s, fresh()), FigureError::Points { points: 1 });
        assert_eq!(refused(&tracks, &times_s[..3], fresh()), FigureError::Frames { frames: 3 });
        assert!(matches!(refused(&tracks, &times_s[..12], fresh()), FigureError::Lengths { track: 0, .. }));
        let backwards: Vec<f64> = times_s.iter().map(|t| -t).collect();
        assert_eq!(refused(&tracks, &backwards, fresh()), FigureError::Times { frame: 1 });
        let mut far = tracks.clone();
        far[3][4].y = f64::INFINITY;
        assert!(matches!(refused(&far, &times_s, fresh()), FigureError::Position { track: 3, frame: 4, .. }));
        let one_place = vec![vec![DVec2::ONE; 20]; 3];
        assert_eq!(refused(&one_place, &times_s, fresh()), FigureError::NoExtent);
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            let options = FigureOptions { window_s: bad, ..fresh() };
            assert!(matches!(refused(&tracks, &times_s, options), FigureError::Option { .. }));
            let options =
                FigureOptions { fit: FitOptions { noise_sd: bad, ..FitOptions::default() }, ..fresh() };
            assert!(matches!(refused(&tracks, &times_s, options), FigureError::Option { .. }));
        }
    }

    #[test]
    fn a_knee_seen_from_the_front_shows_which_way_it_bends() {
        // Seen from the front, facing the camera: the knee towards it, the ankle back.
        let positions = vec![[DVec2::ZERO, DVec2::new(2.0, 80.0), DVec2::new(3.0, 160.0)]; 5];
        let depth = vec![vec![0.0, -30.0, 10.0]; 5];
        let facing = -DVec3::Z;
        let (sign, degrees) = reflection_by_bend(&positions, &depth, facing, false).unwrap();
        assert!(sign == 1.0 && degrees > 20.0);
        assert_eq!(reflection_by_bend(&positions, &depth, facing, true).unwrap().0, -1.0);
        let (_, degrees) = reflection_by_bend(&positions, &depth, DVec3::X, false).unwrap();
        assert!(degrees < 1e-9, "the side view cannot tell");
        assert_eq!(reflection_by_bend(&positions, &depth, DVec3::ZERO, true), None);
    }
}
