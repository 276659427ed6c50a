//! A linkage from unnamed moving points: which points are linked, the planes in which they swing, and the lengths
//! of the limbs.
//!
//! Hoffman and Flinchbaugh 1982, section 6: divide the points into groups of two and three, test each group for
//! planar motion, combine. They do not specify "combine", and for real walking the test alone is not sufficient:
//! joints of one body are related, so several false groups fit as well as the true ones. Here the groups compete:
//! the figure is the division of all points into hinges (three points), rods (two) and single points with the
//! smallest cost (exact cover). The cost of a group is what its plane leaves unexplained, a small cost of its
//! length, and its separation from the nearest part of the rest of the body: the end of a limb is attached to a
//! trunk that hardly moves relative to other trunk points, whereas wrong parts of a limb are not attached. If
//! there are too many points, a minimum spanning tree over rods (`Method::Forest`) is used instead: with little
//! noise it finds nine limbs in ten, with false links among them; at 2 px eight in ten.
//!
//! Costs are in units of the figure's size. They were chosen on four walks (see `tests/planar_figure.rs`).
//!
//! Limits: a chain cannot be distinguished from its mirror, the depth of one chain relative to another is not
//! known, and figures whose limbs leave their planes (turning, spinning) cannot be interpreted; their windows are
//! reported as lost. A limb that hardly moves in the image is linked only because it is short; its links have a
//! low confidence.

mod cover;
mod depth;
#[cfg(test)]
mod example;
mod group;
mod jump;
mod linkage;
mod reflection;
mod verdict;

pub use cover::MOST_POINTS;
pub use depth::DepthSource;
pub use linkage::{Chain, Contact, Figure, Link, Method};
pub use reflection::joint_of;
pub use verdict::FigureEvidence;

use super::{FitOptions, PlanarEvidenceOptions, Verdict};
use crate::model::skeleton::Joint;
use crate::wording::counted;
use crate::{OptionError, Progress, Stopped};
use depth::depth_over_time;
use glam::DVec2;
use group::best_figure;
use jump::without_jumps;
use rayon::prelude::*;
use reflection::reflect_by_anatomy;
use thiserror::Error;

/// Maximum number of points.
pub const MOST_TRACKS: usize = 200;

/// Why no figure was found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FigureError {
    /// Fewer than two points, or too many.
    #[error("{}: between 2 and {MOST_TRACKS} can be linked", counted(*points, "point"))]
    Points {
        /// Number of points.
        points: usize,
    },
    /// A track has not as many positions as there are times.
    #[error("track {track} has {} for {}", counted(*positions, "position"), counted(*times, "time"))]
    Lengths {
        /// Index of the track.
        track: usize,
        /// Number of its positions.
        positions: usize,
        /// Number of times.
        times: usize,
    },
    /// There are not as many names as tracks.
    #[error("{} for {}", counted(*names, "name"), counted(*tracks, "track"))]
    Names {
        /// Number of names.
        names: usize,
        /// Number of tracks.
        tracks: usize,
    },
    /// There are too few frames for any test.
    #[error("too few frames: {frames}, at least {FEWEST_FRAMES} wanted")]
    Frames {
        /// Number of frames.
        frames: usize,
    },
    /// A position is infinite or too large.
    #[error("track {track} at frame {frame} is at ({u}, {v}): pixels wanted, NaN for unseen")]
    Position {
        /// Index of the track.
        track: usize,
        /// Index of the frame.
        frame: usize,
        /// Column, u.
        u: f64,
        /// Row, v.
        v: f64,
    },
    /// The times do not increase.
    #[error("times must be finite and increase, frame {frame} does not")]
    Times {
        /// Index of the first such frame.
        frame: usize,
    },
    /// All points have the same position, or none is ever seen.
    #[error("the points have no extent: nothing to link")]
    NoExtent,
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// Cancelled by the caller.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// A pause in the tracks is longer than this many usual intervals and than this share of a window.
const MISSED_FRAMES: f64 = 5.0;
const PAUSE_OF_WINDOW: f64 = 0.25;

/// Accepted sizes of a figure, in the unit of its positions: costs relative to them stay finite.
const SIZES: std::ops::RangeInclusive<f64> = 1e-9..=1e12;
/// Minimum number of frames of a window.
const FEWEST_FRAMES: usize = 8;

/// Costs of the groups, in units of the figure's size (RMS distance of the points from their middle; about
/// 0.42 m for a person).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Costs {
    /// Cost per unit of length, dimensionless. Default 0.02: true links are shorter than false ones that fit as
    /// well. Values from 0.01 to 0.03 give nearly the same results.
    pub length: f64,
    /// Cost of a rod, because limbs have two segments.
    pub rod: f64,
    /// Maximum cost of a single point; near another point the cost is their separation.
    pub alone: f64,
    /// Maximum cost of a group that is not in contact with another.
    pub detached: f64,
    /// Share of the noise's part of the residual that is not counted. Not all of it: false groups are noisy too.
    pub noise: f64,
    /// Scale of the costs for weighting covers, from which the confidence is computed.
    pub temperature: f64,
}

impl Default for Costs {
    fn default() -> Self {
        Self { length: 0.02, rod: 0.018, alone: 0.061, detached: 0.08, noise: 0.6, temperature: 0.0045 }
    }
}

/// Options of [`interpret_figure`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FigureOptions {
    /// Options of the fits; `noise_sd` in the unit of the tracks, by default 0.5: dots placed to the pixel. Single
    /// wrong positions are removed from the tracks first, so by default the fits do not look for outliers.
    pub fit: FitOptions,
    /// Options of the verdicts, with the false-target rate.
    pub evidence: PlanarEvidenceOptions,
    /// Costs of the groups.
    pub costs: Costs,
    /// Size of the figure in the unit of the tracks (RMS distance of its joints from their middle, about a
    /// quarter of a person's height); `None` uses that of the given points.
    pub size: Option<f64>,
    /// Duration of the windows, seconds. Default 1.2, about a stride; half a stride is sufficient, less is not.
    /// Tracks of up to one and a half windows are one window.
    pub window_s: f64,
    /// Maximum number of points for the exact cover, at most [`MOST_POINTS`]; more are linked by a spanning tree.
    pub most_covered: usize,
    /// True to carry a figure's lengths through windows in which it is lost.
    pub carries_structure: bool,
}

impl Default for FigureOptions {
    fn default() -> Self {
        Self {
            fit: FitOptions { noise_sd: 0.5, max_outlier_fraction: 0.0, ..FitOptions::default() },
            evidence: PlanarEvidenceOptions::default(),
            costs: Costs::default(),
            size: None,
            window_s: 1.2,
            most_covered: MOST_POINTS,
            carries_structure: false,
        }
    }
}

/// Status of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The figure is that of a body, at the requested false-target rate.
    Interpreted,
    /// The evidence is not sufficient: dots that do not belong together, a motion out of planes, or so many points that
    /// a spanning tree links them, for which there is no evidence.
    Lost,
    /// Almost nothing moves: no chain is evidence for or against planes.
    Still,
    /// Too little was seen for any chain.
    Unseen,
}

/// A window in time.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureWindow {
    /// Index of the first frame.
    pub start: usize,
    /// Index of the last frame plus one.
    pub end: usize,
    /// Whether it could be read.
    pub status: Status,
    /// Number of chains that move in their plane, that leave it, and without a verdict.
    pub chains: [usize; 3],
    /// Evidence for the figure as a whole; `None` for a spanning tree.
    pub evidence: Option<FigureEvidence>,
    /// The best figure, also if the status is lost.
    pub figure: Figure,
}

/// Result for all tracks.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureInterpretation {
    /// The windows, in order; they overlap by half.
    pub windows: Vec<FigureWindow>,
    /// Depth of each point relative to the first point of its chain, T x K, in the unit of the tracks; NaN if not
    /// known. The sign is consistent between overlapping windows; each chain may be reflected.
    pub depth: Vec<f64>,
    /// Source of the depths of each frame.
    pub sources: Vec<DepthSource>,
}

/// Finds a linkage in unnamed tracks (K tracks of T image positions, NaN for points not seen), window by window.
///
/// # Errors
/// Fewer than two tracks, too many, different lengths, too few frames, infinite positions, times that do not
/// increase, invalid options.
pub fn interpret_figure(
    tracks: &[Vec<DVec2>],
    times_s: &[f64],
    options: &FigureOptions,
) -> Result<FigureInterpretation, FigureError> {
    interpret_with_progress(tracks, None, times_s, options, &Progress::new())
}

/// [`interpret_figure`] for points of which some are known joints: if limbs consist of them, joint limits
/// distinguish each limb from its mirror ([`Chain::reflection_margin_deg`]).
///
/// # Errors
/// Those of [`interpret_figure`]; not as many names as tracks.
pub fn interpret_named_figure(
    tracks: &[Vec<DVec2>],
    joints: &[Option<Joint>],
    times_s: &[f64],
    options: &FigureOptions,
) -> Result<FigureInterpretation, FigureError> {
    interpret_with_progress(tracks, Some(joints), times_s, options, &Progress::new())
}

/// [`interpret_figure`], or [`interpret_named_figure`] if joints are given, with progress and cancellation; the
/// units are windows.
///
/// # Errors
/// Those of these functions, and [`FigureError::Stopped`].
pub fn interpret_with_progress(
    tracks: &[Vec<DVec2>],
    joints: Option<&[Option<Joint>]>,
    times_s: &[f64],
    options: &FigureOptions,
    progress: &Progress,
) -> Result<FigureInterpretation, FigureError> {
    if let Some(joints) = joints
        && joints.len() != tracks.len()
    {
        return Err(FigureError::Names { names: joints.len(), tracks: tracks.len() });
    }
    check(tracks, times_s, options)?;
    let size = options.size.unwrap_or_else(|| size_of(tracks));
    if !SIZES.contains(&size) {
        return Err(FigureError::NoExtent);
    }
    // 1. Remove single wrong positions, and divide the tracks into windows.
    let clean: Vec<Vec<DVec2>> =
        tracks.iter().map(|track| without_jumps(track, options.fit.noise_sd)).collect();
    let ranges = windows(times_s, options.window_s);
    progress.expect(ranges.len());
    // 2. The best figure of each window.
    let read = |(start, end)| {
        let part: Vec<&[DVec2]> = clean.iter().map(|track| &track[start..end]).collect();
        let figure = best_figure(&part, size, options);
        progress.advance(1)?;
        Ok(FigureWindow::judged(start, end, figure, options))
    };
    let mut windows = ranges.into_par_iter().map(read).collect::<Result<Vec<_>, Stopped>>()?;
    // 3. Reflections from joint limits, and depths over time.
    if let Some(joints) = joints {
        reflect_by_anatomy(&mut windows, tracks, joints);
    }
    let (depth, sources) = depth_over_time(tracks, &windows, options.carries_structure);
    Ok(FigureInterpretation { windows, depth, sources })
}

impl FigureWindow {
    /// The window of a figure, with its status.
    fn judged(start: usize, end: usize, figure: Figure, options: &FigureOptions) -> Self {
        let planar = figure.count(|v| v == Verdict::Planar);
        let refuted = figure.count(|v| v == Verdict::NotPlanar);
        let silent = figure.chains.len() - planar - refuted;
        let linked: usize = figure.chains.iter().map(|chain| chain.points.len()).sum();
        let evidence = (figure.method == Method::Cover)
            .then(|| FigureEvidence::of(&figure, linked + figure.alone.len(), options));
        let is_body = evidence.is_some_and(|evidence| evidence.is_body());
        let status = match (planar, refuted, silent) {
            (0, 0, 0) => Status::Unseen,
            (0, 0, _) => Status::Still,
            _ if is_body => Status::Interpreted,
            _ => Status::Lost,
        };
        Self { start, end, status, chains: [planar, refuted, silent], evidence, figure }
    }
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
    for (name, value) in [
        ("length cost", c.length),
        ("rod cost", c.rod),
        ("cost of a point alone", c.alone),
        ("cost of a detached group", c.detached),
        ("share of the noise", c.noise),
    ] {
        OptionError::unless((0.0..=1e6).contains(&value), name, "between 0 and 1,000,000", value)?;
    }
    OptionError::unless_positive("temperature", c.temperature)?;
    OptionError::unless_positive("window_s", options.window_s)?;
    if let Some(size) = options.size {
        OptionError::unless(SIZES.contains(&size), "size", "between 1e-9 and 1e12", size)?;
    }
    options.fit.check()?;
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

/// Windows of a given duration that overlap by half; the last one ends with the tracks.
fn windows(times_s: &[f64], window_s: f64) -> Vec<(usize, usize)> {
    let frames = times_s.len();
    let mut intervals_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = intervals_s.len() / 2;
    let usual_s = *intervals_s.select_nth_unstable_by(middle, f64::total_cmp).1;
    // Where times of frames are rounded decides nothing.
    let long = ((window_s / usual_s + 1e-6).round().clamp(0.0, 1e9) as usize).max(FEWEST_FRAMES);
    // No window contains a pause.
    let pause_s = (1.0 + 1e-6) * (MISSED_FRAMES * usual_s).max(PAUSE_OF_WINDOW * window_s);
    let after_pause = (1..frames).filter(|&t| times_s[t] - times_s[t - 1] > pause_s);
    let bounds: Vec<usize> = std::iter::once(0).chain(after_pause).chain([frames]).collect();
    let stretches = bounds.windows(2).map(|pair| (pair[0], pair[1]));
    let long_enough = stretches.filter(|(start, end)| end - start >= FEWEST_FRAMES);
    long_enough.flat_map(|(start, end)| windows_of(start, end, long)).collect()
}

fn windows_of(start: usize, end: usize, long: usize) -> Vec<(usize, usize)> {
    let frames = end - start;
    if 2 * frames <= 3 * long {
        return vec![(start, end)];
    }
    let steps = (2 * (frames - long)).div_ceil(long).max(1);
    (0..=steps).map(|i| start + i * (frames - long) / steps).map(|from| (from, from + long)).collect()
}

#[cfg(test)]
mod tests {
    use super::example::{limbs, sorted_links, walker};
    use super::*;

    #[test]
    fn threads_and_runs_do_not_change_the_figure() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 1.0);
        let options = FigureOptions {
            fit: FitOptions { noise_sd: 1.0, ..FigureOptions::default().fit },
            ..FigureOptions::default()
        };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            format!("{:?}", pool.install(|| interpret_figure(&tracks, &times_s, &options)))
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn no_window_spans_a_pause_and_short_stretches_are_none() {
        let pause_after =
            |t: usize, pause: f64| f64::from(t as u32) / 60.0 + if t >= 70 { pause } else { 0.0 };
        let times_s: Vec<f64> = (0..150).map(|t| pause_after(t, 10.0)).collect();
        let found = windows(&times_s, 1.2);
        assert!(found.iter().all(|&(start, end)| end <= 70 || start >= 70), "{found:?}");
        assert!(found.contains(&(0, 70)) && found.last().unwrap().1 == 150);
        // How times are rounded does not decide: ten frames per second, of which four are missing.
        let from = |start_s: f64| {
            let times_s: Vec<f64> = (0..40).map(|t| start_s + 0.1 * f64::from(t + 4 * (t / 20))).collect();
            [1.0, 1.25].map(|window_s| windows(&times_s, window_s))
        };
        assert!([0.1, 0.3, 7.7, 100.0].iter().all(|&start_s| from(start_s) == from(0.0)));
        let scattered: Vec<f64> = (0..12).map(|t| f64::from(t) / 60.0 + 5.0 * f64::from(t / 3)).collect();
        assert!(windows(&scattered, 1.2).is_empty());
        let (tracks, ..) = walker(12, |_| 0.0, 0.0);
        let answer = interpret_figure(&tracks, &scattered, &FigureOptions::default()).unwrap();
        assert!(answer.windows.is_empty() && answer.depth.iter().all(|z| z.is_nan()));
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
            assert!(matches!(refused(&tracks, &times_s, options), FigureError::Option(_)));
            let options =
                FigureOptions { fit: FitOptions { noise_sd: bad, ..FitOptions::default() }, ..fresh() };
            assert!(matches!(refused(&tracks, &times_s, options), FigureError::Option(_)));
        }
        // With noise and so small a size, costs would be infinite.
        let fit = FitOptions { noise_sd: 3.0, ..FitOptions::default() };
        for size in [5e-324, 1e-300, 1e-10, 0.0, -1.0, 1e300, f64::NAN, f64::INFINITY] {
            let options = FigureOptions { size: Some(size), fit, ..fresh() };
            assert!(matches!(
                refused(&tracks, &times_s, options),
                FigureError::Option(OptionError { name: "size", .. })
            ));
        }
        let tiny: Vec<Vec<DVec2>> = tracks.iter().map(|t| t.iter().map(|p| *p * 1e-310).collect()).collect();
        assert_eq!(refused(&tiny, &times_s, FigureOptions { fit, ..fresh() }), FigureError::NoExtent);
    }

    /// Windows have the requested duration and overlap by half or more; up to one and a half windows are one.
    #[test]
    fn windows_cover_a_stretch_and_overlap_by_half() {
        for (frames, long) in [(30, 20), (31, 20), (40, 20), (59, 20), (61, 20), (200, 24)] {
            let found = windows_of(7, 7 + frames, long);
            if 2 * frames <= 3 * long {
                assert_eq!(found, [(7, 7 + frames)]);
                continue;
            }
            assert!(found.iter().all(|(start, end)| end - start == long), "{found:?}");
            assert_eq!((found[0].0, found.last().unwrap().1), (7, 7 + frames));
            for pair in found.windows(2) {
                assert!(pair[0].0 < pair[1].0 && 2 * (pair[0].1 - pair[1].0) >= long, "{found:?}");
            }
            // No more windows than half-overlaps need.
            assert!((found.len() - 2) * long < 2 * (frames - long), "{found:?}");
        }
    }

    /// A cover is read by its evidence, a spanning tree never; chains without evidence for or against planes are still.
    #[test]
    fn a_window_is_judged_by_the_evidence_of_its_figure() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 0.0);
        let options = FigureOptions::default();
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let figure = &found.windows[0].figure;
        use Verdict::{NotPlanar, Planar, Unfalsifiable};
        for (verdicts, chains) in [
            ([Planar, Planar, NotPlanar, Unfalsifiable], [2, 1, 1]),
            ([Planar, NotPlanar, Unfalsifiable, Unfalsifiable], [1, 1, 2]),
            ([NotPlanar, NotPlanar, Planar, Planar], [2, 2, 0]),
            ([NotPlanar, Unfalsifiable, Unfalsifiable, Unfalsifiable], [0, 1, 3]),
            ([Unfalsifiable; 4], [0, 0, 4]),
        ] {
            let unless_still = |status| if chains == [0, 0, 4] { Status::Still } else { status };
            let mut tree = Figure { method: Method::Forest, ..figure.clone() };
            for (chain, verdict) in tree.chains.iter_mut().zip(verdicts) {
                chain.evidence.verdict = verdict;
            }
            let cover = Figure { method: Method::Cover, ..tree.clone() };
            let judged = FigureWindow::judged(0, 66, tree, &options);
            assert_eq!((judged.status, judged.evidence), (unless_still(Status::Lost), None));
            assert_eq!(judged.chains, chains);
            let judged = FigureWindow::judged(0, 66, cover.clone(), &options);
            assert_eq!((judged.status, judged.chains), (unless_still(Status::Interpreted), chains));
            let mut bad = cover;
            bad.chains.iter_mut().for_each(|chain| chain.residual_rms = 0.4 * bad.size);
            let judged = FigureWindow::judged(0, 66, bad, &options);
            assert_eq!(judged.status, unless_still(Status::Lost));
        }
        let alone = Figure { chains: vec![], ..figure.clone() };
        assert_eq!(FigureWindow::judged(0, 66, alone, &options).status, Status::Unseen);
    }

    /// Points at (±3, ±4) about a moving middle are at distance 5 from it; points not seen do not count.
    #[test]
    fn the_size_is_the_distance_from_the_middle() {
        let corner = |x: f64, y: f64| -> Vec<DVec2> {
            (0..9).map(|t| DVec2::new(x + 10.0 * f64::from(t), y)).collect()
        };
        let mut tracks = vec![corner(3.0, 4.0), corner(-3.0, 4.0), corner(3.0, -4.0), corner(-3.0, -4.0)];
        tracks.push(vec![DVec2::NAN; 9]);
        assert!((size_of(&tracks) - 5.0).abs() < 1e-12);
    }
}
