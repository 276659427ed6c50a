//! Repair of exchanged left and right labels in anybody's 2D joints over time.
//!
//! A detector that takes the left leg for the right one exchanges two labels; it moves no joint. For a pair
//! with difference d = right - left that is a change of the sign of d. The labels are taken as right where d
//! moves smoothly: a second-order chain (change of velocity, irregular times allowed) over the bits of a limb
//! group's levels (hip, knee, ankle), solved for its best path (Viterbi 1967) and for each bit's posterior
//! (forward-backward). Noise and acceleration come from the data, so image scale and frame rate do not matter.
//!
//! Handled: groups apart from one another; within a group every pattern of exchanged levels, a change of
//! pattern being dear; missing joints, gaps, uneven times; single bad detections, which are left out.
//!
//! It cannot know
//! * which leg is the left one: that is what most frames of the input say, and has a probability;
//! * whether the legs passed one another in a gap: such runs of frames get each their own label decision;
//! * which label is right where both joints of a pair coincide, where it matters as little;
//! * the side of a joint whose partner is missing: it goes with its group and is no evidence;
//! * that a detector put both labels on one leg: such a sample is at best left out.
//!
//! Only ever are a left and a right entry exchanged; nothing is moved, made up or removed.

mod chain;
mod relative;

use crate::estimate::median::median;
use crate::option_error::OptionError;
use crate::wording::counted;
use chain::{Chain, Posterior, Prior, Step};
use relative::{Sample, Scale, Track};

use glam::DVec2;

/// At most this many levels a group: states grow with 4^levels.
pub const MAX_LEVELS: usize = 4;
/// Largest coordinate taken, px.
const MAX_PX: f64 = 1e7;
/// Least time between frames, s.
const MIN_STEP_S: f64 = 1e-6;
/// A level parts from the most telling one where that is twice as likely as not.
const LEVEL_PARTS: f64 = 2.0 / 3.0;
/// A run is as sure as this of its bits relative to its first frame.
const RUN_SURE: f64 = 0.95;
/// Doubt for so many frames ends a run; fewer are a moment in which the joints coincide.
const RUN_PATIENCE: usize = 12;

/// Joints over time as a detector gave them.
#[derive(Debug, Clone, Copy)]
pub struct Keypoints<'a> {
    /// Time of every frame, s, increasing.
    pub times_s: &'a [f64],
    /// Joints in a frame.
    pub joints: usize,
    /// (u, v) px, frame after frame, `joints` to a frame; NaN where missing.
    pub points_px: &'a [[f64; 2]],
    /// Of every point, in [0, 1]; weights the noise, 0 or NaN is missing.
    pub scores: Option<&'a [f64]>,
}

/// Pairs at one place of a limb, such as knee, or ankle with heel and toes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Level {
    /// What reports call it.
    pub name: String,
    /// Indices (left, right) of joints that are exchanged together.
    pub pairs: Vec<[usize; 2]>,
}

/// A limb on both sides, from the trunk outwards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LimbGroup {
    /// What reports call it.
    pub name: String,
    /// One to [`MAX_LEVELS`].
    pub levels: Vec<Level>,
}

/// Priors, in nats (natural log of odds), and when to be sure.
#[derive(Debug, Clone, PartialEq)]
pub struct UnswapOptions {
    /// Per frame, against its labels being exchanged. 0.2: a run of 15 exchanged frames costs 3, far less than
    /// two broken motions (10 to 30), and 11 more frames one way than the other decide a label with 0.9. Larger
    /// values harm long runs. Frames count as independent: a detector that errs in runs longer than half a
    /// step makes the probability of a run's label too sure.
    pub as_is_nats: f64,
    /// Against neighbouring levels beginning to differ (once in ninety frames).
    pub partial_begin_nats: f64,
    /// Against their differing for a further frame.
    pub partial_stay_nats: f64,
    /// From this probability on a frame's label counts as decided.
    pub decided_at: f64,
}

impl Default for UnswapOptions {
    fn default() -> Self {
        Self { as_is_nats: 0.2, partial_begin_nats: 4.5, partial_stay_nats: 0.3, decided_at: 0.9 }
    }
}

/// Input that cannot be repaired because it is not joints over time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnswapError {
    /// Counts of points and frames disagree.
    #[error("wanted {} x {} = {}, got {got}", counted(*frames, "frame"), counted(*joints, "joint"), counted(*wanted, "point"))]
    Points {
        /// Number of times.
        frames: usize,
        /// Joints in a frame.
        joints: usize,
        /// Their product.
        wanted: usize,
        /// Points given.
        got: usize,
    },
    /// Counts of scores and points disagree.
    #[error("wanted a score for each of {}, got {got}", counted(*wanted, "point"))]
    Scores {
        /// Points given.
        wanted: usize,
        /// Scores given.
        got: usize,
    },
    /// A time that is not finite, or not later than the one before.
    #[error(
        "wanted times within +-1e12 s at least 1e-6 s apart, got {time_s} s at frame {frame} after {before_s} s"
    )]
    Time {
        /// Frame of the bad time.
        frame: usize,
        /// The time there, s.
        time_s: f64,
        /// The time before (itself at frame 0), s.
        before_s: f64,
    },
    /// A coordinate that is infinite or absurd.
    #[error(
        "wanted coordinates within +-1e7 px (NaN where missing), got ({u}, {v}) at frame {frame}, joint {joint}"
    )]
    Coordinate {
        /// Frame of the point.
        frame: usize,
        /// Index of the joint.
        joint: usize,
        /// px.
        u: f64,
        /// px.
        v: f64,
    },
    /// A score outside [0, 1].
    #[error("wanted scores in [0, 1], got {score} at frame {frame}, joint {joint}")]
    Score {
        /// Frame of the score.
        frame: usize,
        /// Index of the joint.
        joint: usize,
        /// The score.
        score: f64,
    },
    /// A group with too few or too many levels.
    #[error("wanted 1 to 4 levels of a limb, got {levels} in group \"{group}\"")]
    Levels {
        /// Name of the group.
        group: String,
        /// Levels given.
        levels: usize,
    },
    /// A level without pairs.
    #[error("wanted (left, right) pairs of joints, got none in level \"{level}\" of group \"{group}\"")]
    NoPairs {
        /// Name of the group.
        group: String,
        /// Name of the level.
        level: String,
    },
    /// A joint that does not exist.
    #[error("wanted joints 0 to {joints} - 1, got {joint} in group \"{group}\"")]
    Joint {
        /// Name of the group.
        group: String,
        /// Index given.
        joint: usize,
        /// Joints in a frame.
        joints: usize,
    },
    /// A joint in two places.
    #[error("wanted every joint in one pair only, got {joint} a second time in group \"{group}\"")]
    JointTwice {
        /// Name of the group.
        group: String,
        /// Index given twice.
        joint: usize,
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Why a frame's labels are what they are.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// The motion of these levels is smooth this way; exchanging this frame alone would cost `gain_nats`.
    Continuity {
        /// Levels that say so, most telling first; none where only the levels together do.
        levels: Vec<usize>,
        /// Natural log of the odds.
        gain_nats: f64,
    },
    /// The run of frames begins or ends at a gap in which the limbs may have passed one another.
    UnseenCrossing {
        /// Between the frames on either side, s.
        gap_s: f64,
    },
    /// Left and right are less apart than noise tells.
    Coincide {
        /// The largest distance within a pair, px.
        distance_px: f64,
    },
    /// The run begins or ends where the motion fits both labels, with no gap.
    Unclear,
    /// The labels follow from one another, but about as many frames say one thing as the other.
    GlobalLabel,
    /// No pair is seen on both sides: labels stay as they came.
    NothingSeen,
}

/// What was found for one group in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Whether each level's entries were exchanged.
    pub level_flipped: Vec<bool>,
    /// Posterior probability that each level came exchanged; unseen levels go with the nearest seen one.
    pub level_probability: Vec<f64>,
    /// Whether the group's most telling level was exchanged.
    pub flipped: bool,
    /// Whether some of the levels were exchanged and others not.
    pub partial: bool,
    /// Posterior probability that the most telling level came exchanged; 0.5 where nothing is seen.
    pub probability: f64,
    /// Whether that is sure enough; if not, `flipped` is only the best guess.
    pub decided: bool,
    /// Why.
    pub reason: Reason,
}

/// Frames whose labels follow from one another.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// First frame.
    pub start: usize,
    /// Frame after the last one.
    pub end: usize,
    /// Mean posterior probability of the labels given out in this run.
    pub probability: f64,
    /// Time without samples before it (0 for the first), s.
    pub gap_before_s: f64,
}

/// What was found for one group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupResult {
    /// One a frame.
    pub verdicts: Vec<Verdict>,
    /// Runs of frames between crossings that were not seen.
    pub runs: Vec<Run>,
    /// Probability that the global label is right, rather than everything given out being exchanged, as far as
    /// the majority of the input's labels tells.
    pub global_probability: f64,
    /// Standard deviation of a joint's coordinate found, px.
    pub noise_px: f64,
    /// (frame, left joint) of pairs that were left out as bad detections; they went with their group.
    pub left_out: Vec<[usize; 2]>,
}

/// Joints with left and right exchanged where that was found, and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Unswapped {
    /// As [`Keypoints::points_px`].
    pub points_px: Vec<[f64; 2]>,
    /// As [`Keypoints::scores`], exchanged with their points.
    pub scores: Option<Vec<f64>>,
    /// In the order of the groups given.
    pub groups: Vec<GroupResult>,
}

impl Verdict {
    /// The reason in words, with the names of the group's levels.
    pub fn describe(&self, group: &LimbGroup) -> String {
        let done = match (self.partial, self.flipped) {
            (true, _) => "flipped in part",
            (false, true) => "flipped",
            (false, false) => "kept",
        };
        match &self.reason {
            Reason::Continuity { levels, gain_nats } => {
                let names: Vec<&str> =
                    levels.iter().filter_map(|&l| group.levels.get(l)).map(|l| l.name.as_str()).collect();
                let names = if names.is_empty() { "the levels together".into() } else { names.join(", ") };
                format!("{done}: continuity of {names}, gain {gain_nats:.1}")
            }
            Reason::UnseenCrossing { gap_s } => {
                format!("undecided: crossing unseen in a gap of {gap_s:.2} s")
            }
            Reason::Coincide { distance_px } => {
                format!("undecided: joints coincide within {distance_px:.1} px")
            }
            Reason::Unclear => "undecided: motion fits both labels".into(),
            Reason::GlobalLabel => {
                "undecided: labels agree with one another, no majority for either side".into()
            }
            Reason::NothingSeen => "kept: nothing seen".into(),
        }
    }
}

/// Finds and undoes exchanges of left and right, group by group.
///
/// # Errors
/// [`UnswapError`] where shapes disagree or values are out of range.
pub fn unswap(
    keypoints: &Keypoints,
    groups: &[LimbGroup],
    options: &UnswapOptions,
) -> Result<Unswapped, UnswapError> {
    check_keypoints(keypoints)?;
    check_groups(groups, keypoints.joints)?;
    check_options(options)?;
    let mut points_px = keypoints.points_px.to_vec();
    let mut scores = keypoints.scores.map(<[f64]>::to_vec);
    let mut results = Vec::with_capacity(groups.len());
    for group in groups {
        let result = Limb::new(keypoints, group).solve(options);
        for (frame, verdict) in result.verdicts.iter().enumerate() {
            let exchanged = group.levels.iter().zip(&verdict.level_flipped).filter(|(_, flipped)| **flipped);
            for [left, right] in exchanged.flat_map(|(level, _)| &level.pairs) {
                let row = frame * keypoints.joints;
                points_px.swap(row + left, row + right);
                if let Some(scores) = &mut scores {
                    scores.swap(row + left, row + right);
                }
            }
        }
        results.push(result);
    }
    Ok(Unswapped { points_px, scores, groups: results })
}

/// One group over time.
struct Limb<'a> {
    times_s: &'a [f64],
    levels: usize,
    /// Level of every track.
    level_of: Vec<usize>,
    tracks: Vec<Track>,
    left_out: Vec<[usize; 2]>,
    /// Frames that show at least one level on both sides, and which levels.
    shown: Vec<(usize, usize)>,
}

/// Everything found about the bits of a group.
struct Solution {
    scales: Vec<Scale>,
    /// Per step and level, the costs of the four sign patterns.
    costs: Vec<Vec<[f64; 4]>>,
    path: Vec<usize>,
    posterior: Posterior,
    /// First steps of the runs.
    starts: Vec<usize>,
}

impl<'a> Limb<'a> {
    fn new(keypoints: &Keypoints<'a>, group: &LimbGroup) -> Self {
        let mut level_of = Vec::new();
        let mut tracks = Vec::new();
        let mut left_out = Vec::new();
        for (index, level) in group.levels.iter().enumerate() {
            for &[left, right] in &level.pairs {
                let mut track: Track =
                    (0..keypoints.times_s.len()).map(|t| sample(keypoints, t, left, right)).collect();
                let dropped = relative::drop_outliers(keypoints.times_s, &mut track);
                left_out.extend(dropped.into_iter().map(|frame| [frame, left]));
                level_of.push(index);
                tracks.push(track);
            }
        }
        left_out.sort_unstable();
        let seen = |t: usize| {
            let levels = tracks.iter().zip(&level_of).filter(|(track, _)| track[t].is_some());
            levels.fold(0, |mask, (_, level)| mask | 1 << level)
        };
        let shown = (0..keypoints.times_s.len()).map(|t| (t, seen(t))).filter(|(_, seen)| *seen != 0);
        let (times_s, levels) = (keypoints.times_s, group.levels.len());
        let shown = shown.collect();
        Self { times_s, levels, level_of, tracks, left_out, shown }
    }

    fn solve(self, options: &UnswapOptions) -> GroupResult {
        let solution = self.solution(options);
        let runs = self.runs(&solution);
        let verdicts = self.verdicts(&solution, &runs, options);
        GroupResult {
            verdicts,
            global_probability: self.global_probability(&solution, options),
            noise_px: solution.scales.first().map_or(0.0, |s| s.noise_sq.sqrt()),
            left_out: self.left_out,
            runs,
        }
    }

    /// Scales from the smoothest signs, a path; scales from that path's signs, twice; then the posterior.
    fn solution(&self, options: &UnswapOptions) -> Solution {
        let prior = Prior {
            as_is: options.as_is_nats,
            partial_begin: options.partial_begin_nats,
            partial_stay: options.partial_stay_nats,
        };
        let mut scales = relative::scales(self.times_s, &self.tracks, None);
        for _ in 0..2 {
            let steps = self.steps(&self.costs(&scales));
            let path = Chain::new(self.levels, &steps, prior).best_path();
            scales = relative::scales(self.times_s, &self.tracks, Some(&self.signs(&path)));
        }
        let costs = self.costs(&scales);
        let steps = self.steps(&costs);
        let chain = Chain::new(self.levels, &steps, prior);
        let path = chain.best_path();
        let posterior = chain.posterior();
        let motion_only = Chain::new(self.levels, &steps, Prior { as_is: 0.0, ..prior });
        let starts = motion_only.runs(&path, &motion_only.posterior(), RUN_SURE, RUN_PATIENCE);
        Solution { scales, costs, path, posterior, starts }
    }

    /// Costs per step and level, from the level's last two frames; zero where there are none yet.
    fn costs(&self, scales: &[Scale]) -> Vec<Vec<[f64; 4]>> {
        let mut past: Vec<[Option<usize>; 2]> = vec![[None; 2]; self.levels];
        let mut all = Vec::with_capacity(self.shown.len());
        for &(t, seen) in &self.shown {
            let mut costs = vec![[0.0; 4]; self.levels];
            for ((track, &level), scale) in self.tracks.iter().zip(&self.level_of).zip(scales) {
                let [Some(before), Some(last)] = past[level] else { continue };
                let [Some(a), Some(b), Some(c)] = [before, last, t].map(|t| track[t]) else { continue };
                let times_s = [before, last, t].map(|t| self.times_s[t]);
                let triple = relative::triple_costs(times_s, [a, b, c], scale);
                costs[level].iter_mut().zip(triple).for_each(|(sum, cost)| *sum += cost);
            }
            let seen = past.iter_mut().enumerate().filter(|(level, _)| seen >> level & 1 == 1);
            for (_, past) in seen {
                *past = [past[1], Some(t)];
            }
            all.push(costs);
        }
        all
    }

    fn steps(&self, costs: &[Vec<[f64; 4]>]) -> Vec<Step> {
        let n = 1 << self.levels;
        let step = |(&(_, seen), costs): (&(usize, usize), &Vec<[f64; 4]>)| {
            let cost = |i: usize| {
                let (turned_before, turned_now) = (i / n, i % n);
                let of_level =
                    |(l, c): (usize, &[f64; 4])| c[2 * (turned_before >> l & 1) + (turned_now >> l & 1)];
                costs.iter().enumerate().map(of_level).sum()
            };
            let motion: Vec<f64> = (0..n * n).map(cost).collect();
            let least = motion.iter().copied().fold(f64::INFINITY, f64::min);
            Step { seen, motion: motion.into_iter().map(|cost| cost - least).collect() }
        };
        self.shown.iter().zip(costs).map(step).collect()
    }

    /// +1 or -1 per track and frame.
    fn signs(&self, path: &[usize]) -> Vec<Vec<f64>> {
        let of_track = |level: &usize| {
            let mut signs = vec![1.0; self.times_s.len()];
            for (&(t, _), bits) in self.shown.iter().zip(path) {
                signs[t] = if bits >> level & 1 == 1 { -1.0 } else { 1.0 };
            }
            signs
        };
        self.level_of.iter().map(of_track).collect()
    }

    fn runs(&self, solution: &Solution) -> Vec<Run> {
        let starts = &solution.starts;
        let run = |(i, &first): (usize, &usize)| {
            let after = starts.get(i + 1).copied().unwrap_or(self.shown.len());
            let right = (first..after).map(|k| {
                let (level, _) = self.furthest(k);
                self.probability_of_path(solution, k, level)
            });
            let end = starts.get(i + 1).map_or(self.times_s.len(), |&next| self.shown[next].0);
            Run {
                start: if i == 0 { 0 } else { self.shown[first].0 },
                end,
                probability: right.sum::<f64>() / (after - first) as f64,
                gap_before_s: self.gap_before(first),
            }
        };
        starts.iter().enumerate().map(run).collect()
    }

    /// Time since the step before, s.
    fn gap_before(&self, step: usize) -> f64 {
        if step == 0 || step >= self.shown.len() {
            return 0.0;
        }
        self.times_s[self.shown[step].0] - self.times_s[self.shown[step - 1].0]
    }

    fn probability_of_path(&self, solution: &Solution, step: usize, level: usize) -> f64 {
        let p = solution.posterior.exchanged(step, level, self.levels);
        if solution.path[step] >> level & 1 == 1 { p } else { 1.0 - p }
    }

    /// Level and distance, px, of the pair furthest apart.
    fn furthest(&self, step: usize) -> (usize, f64) {
        let t = self.shown[step].0;
        let apart = self
            .tracks
            .iter()
            .zip(&self.level_of)
            .filter_map(|(track, &level)| track[t].map(|sample| (level, sample.difference.length())));
        apart.fold((0, -1.0), |best, other| if other.1 > best.1 { other } else { best })
    }

    fn verdicts(&self, solution: &Solution, runs: &[Run], options: &UnswapOptions) -> Vec<Verdict> {
        let nothing = Verdict {
            level_flipped: vec![false; self.levels],
            level_probability: vec![0.5; self.levels],
            flipped: false,
            partial: false,
            probability: 0.5,
            decided: false,
            reason: Reason::NothingSeen,
        };
        let mut verdicts = vec![nothing; self.times_s.len()];
        let usual_s = median(&mut self.times_s.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
        let gains = self.gains(solution);
        let mut run = 0;
        for (step, &(t, seen)) in self.shown.iter().enumerate() {
            while runs.get(run + 1).is_some_and(|next| next.start <= t) {
                run += 1;
            }
            let bits = solution.path[step];
            let source = |level: usize| {
                let near = (0..self.levels).filter(|other| seen >> other & 1 == 1);
                near.min_by_key(|other| other.abs_diff(level)).unwrap_or(level)
            };
            let sources: Vec<usize> = (0..self.levels).map(source).collect();
            let p = |level: usize| solution.posterior.exchanged(step, level, self.levels);
            let (telling, distance_px) = self.furthest(step);
            let flipped = bits >> telling & 1 == 1;
            let right = self.probability_of_path(solution, step, telling);
            let decided = right >= options.decided_at;
            // Where both joints of a level coincide it goes along with the most telling level.
            let sure = |level: usize| self.probability_of_path(solution, step, level) >= LEVEL_PARTS;
            let level_flipped: Vec<bool> =
                sources.iter().map(|&l| if sure(l) { bits >> l & 1 == 1 } else { flipped }).collect();
            let differs = |level: usize| seen >> level & 1 == 1 && level_flipped[level] != flipped;
            verdicts[t] = Verdict {
                partial: (0..self.levels).any(differs),
                level_flipped,
                level_probability: sources.iter().map(|&level| p(level)).collect(),
                flipped,
                probability: p(telling),
                decided,
                reason: if decided {
                    continuity(&gains[step])
                } else if distance_px < 3.0 * (2.0 * solution.scales[0].noise_sq).sqrt() {
                    Reason::Coincide { distance_px }
                } else {
                    self.doubt(solution, run, usual_s.unwrap_or(0.0))
                },
            };
        }
        verdicts
    }

    /// Why a run's label is not known.
    fn doubt(&self, solution: &Solution, run: usize, usual_s: f64) -> Reason {
        if solution.starts.len() == 1 {
            return Reason::GlobalLabel;
        }
        let ends = [Some(&solution.starts[run]), solution.starts.get(run + 1)];
        let gap_s = ends.into_iter().flatten().map(|&step| self.gap_before(step)).fold(0.0, f64::max);
        if gap_s > 1.5 * usual_s { Reason::UnseenCrossing { gap_s } } else { Reason::Unclear }
    }

    /// Per step and level: by how much exchanging that sample alone makes the motion dearer, nats.
    fn gains(&self, solution: &Solution) -> Vec<Vec<f64>> {
        let mut gains = vec![vec![0.0; self.levels]; self.shown.len()];
        let levels = 0..self.levels;
        for level in levels {
            let steps: Vec<usize> =
                (0..self.shown.len()).filter(|&k| self.shown[k].1 >> level & 1 == 1).collect();
            for w in steps.windows(3) {
                let [a, b, c] = [w[0], w[1], w[2]].map(|k| solution.path[k] >> level & 1);
                let costs = &solution.costs[w[2]][level];
                let cost = |a: usize, b: usize, c: usize| costs[2 * (a ^ b) + (b ^ c)];
                let now = cost(a, b, c);
                gains[w[0]][level] += cost(a ^ 1, b, c) - now;
                gains[w[1]][level] += cost(a, b ^ 1, c) - now;
                gains[w[2]][level] += cost(a, b, c ^ 1) - now;
            }
        }
        gains
    }

    /// Of all labels given out against all of them exchanged: motion says the same for both, the prior not.
    fn global_probability(&self, solution: &Solution, options: &UnswapOptions) -> f64 {
        let surplus = self.shown.iter().zip(&solution.path).map(|(&(_, seen), bits)| {
            1.0 - 2.0 * (bits & seen).count_ones() as f64 / seen.count_ones() as f64
        });
        1.0 / (1.0 + (-options.as_is_nats * surplus.sum::<f64>()).exp())
    }
}

/// The levels that alone say so with at least 1 nat.
fn continuity(gains: &[f64]) -> Reason {
    let mut levels: Vec<usize> = (0..gains.len()).filter(|&level| gains[level] >= 1.0).collect();
    levels.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
    Reason::Continuity { levels, gain_nats: gains.iter().sum() }
}

/// Left and right of a frame where both are there.
fn sample(keypoints: &Keypoints, frame: usize, left: usize, right: usize) -> Option<Sample> {
    let at = |joint: usize| {
        let i = frame * keypoints.joints + joint;
        let score = keypoints.scores.map_or(1.0, |scores| scores[i]);
        let point = DVec2::from_array(keypoints.points_px[i]);
        (point.is_finite() && score > 0.0).then_some((point, score.max(1e-3)))
    };
    let ((left, l), (right, r)) = (at(left)?, at(right)?);
    let weight = 2.0 / (1.0 / l + 1.0 / r);
    Some(Sample { difference: right - left, mean: 0.5 * (left + right), weight })
}

fn check_keypoints(keypoints: &Keypoints) -> Result<(), UnswapError> {
    let Keypoints { times_s, joints, points_px, scores } = *keypoints;
    let wanted = times_s.len().saturating_mul(joints);
    if points_px.len() != wanted {
        return Err(UnswapError::Points { frames: times_s.len(), joints, wanted, got: points_px.len() });
    }
    if let Some(got) = scores.map(<[f64]>::len).filter(|got| *got != wanted) {
        return Err(UnswapError::Scores { wanted, got });
    }
    for (frame, &time_s) in times_s.iter().enumerate() {
        let before_s = times_s[frame.saturating_sub(1)];
        let finite = time_s.is_finite() && time_s.abs() < 1e12;
        if !finite || (frame > 0 && time_s - before_s < MIN_STEP_S) {
            return Err(UnswapError::Time { frame, time_s, before_s });
        }
    }
    for (i, &[u, v]) in points_px.iter().enumerate() {
        if u.abs() > MAX_PX || v.abs() > MAX_PX {
            return Err(UnswapError::Coordinate { frame: i / joints, joint: i % joints, u, v });
        }
    }
    for (i, &score) in scores.unwrap_or_default().iter().enumerate() {
        if !(score.is_nan() || (0.0..=1.0).contains(&score)) {
            return Err(UnswapError::Score { frame: i / joints, joint: i % joints, score });
        }
    }
    Ok(())
}

fn check_groups(groups: &[LimbGroup], joints: usize) -> Result<(), UnswapError> {
    let mut used = std::collections::BTreeSet::new();
    for group in groups {
        if !(1..=MAX_LEVELS).contains(&group.levels.len()) {
            return Err(UnswapError::Levels { group: group.name.clone(), levels: group.levels.len() });
        }
        for level in &group.levels {
            if level.pairs.is_empty() {
                return Err(UnswapError::NoPairs { group: group.name.clone(), level: level.name.clone() });
            }
            for &joint in level.pairs.iter().flatten() {
                if joint >= joints {
                    return Err(UnswapError::Joint { group: group.name.clone(), joint, joints });
                }
                if !used.insert(joint) {
                    return Err(UnswapError::JointTwice { group: group.name.clone(), joint });
                }
            }
        }
    }
    Ok(())
}

fn check_options(options: &UnswapOptions) -> Result<(), UnswapError> {
    let nats = [
        ("as_is_nats", options.as_is_nats),
        ("partial_begin_nats", options.partial_begin_nats),
        ("partial_stay_nats", options.partial_stay_nats),
    ];
    for (name, value) in nats {
        OptionError::unless((0.0..=100.0).contains(&value), name, "0 to 100 nats", value)?;
    }
    let value = options.decided_at;
    OptionError::unless(value > 0.5 && value < 1.0, "decided_at", "a probability in (0.5, 1)", value)?;
    Ok(())
}

#[cfg(test)]
mod tests;
