//! Repair of swapped left and right labels in 2D joints over time, from any detector.
//!
//! A detector that confuses the left leg with the right one swaps two labels and moves no joint. For a
//! pair with difference d = right - left this changes the sign of d. The labels are taken as correct where d
//! moves smoothly: a second-order chain (change of velocity, irregular times allowed) over the bits of the
//! levels of a limb group (hip, knee, ankle), solved for its best path (Viterbi 1967) and for the posterior
//! of each bit (forward-backward). Noise and acceleration are estimated from the data, so image scale and
//! frame rate do not matter.
//!
//! Supported: groups swapped independently of one another; within a group every pattern of swapped
//! levels, where a change of pattern has a high cost; missing joints, gaps and uneven times; single bad
//! detections, which are left out.
//!
//! Limits. The method cannot determine
//! * which leg is the left one: this is decided by the majority of the input's frames, and has a probability;
//! * whether the legs passed one another in a gap: the runs of frames on either side get separate label
//!   decisions;
//! * which label is correct where both joints of a pair coincide; there it matters little;
//! * the side of a joint whose partner is missing: it follows its group and is no evidence;
//! * that a detector put both labels on one leg: such a sample is at best left out.
//!
//! Only a left and a right entry are ever swapped; no point is moved, added or removed.

mod chain;
mod relative;

use crate::OptionError;
use crate::wording::counted;
use chain::{Chain, Posterior, Prior, Step};
use relative::{Sample, Scale, Track};

use glam::DVec2;

/// Maximum number of levels per group: the number of states grows as 4^levels.
pub const MAX_LEVELS: usize = 4;
/// Largest accepted coordinate, px.
const MAX_PX: f64 = 1e7;
/// Smallest accepted time between frames, s.
const MIN_STEP_S: f64 = 1e-6;
/// Probability above which a level may differ from the most informative one: twice as likely as not.
const LEVEL_PARTS: f64 = 2.0 / 3.0;
/// Probability, relative to the first frame of a run, that the bits of the run must reach.
const RUN_SURE: f64 = 0.95;
/// A run ends after this many uncertain frames; with fewer, the joints coincide only for a moment.
const RUN_PATIENCE: usize = 12;

/// Joints over time, as given by a detector.
#[derive(Debug, Clone, Copy)]
pub struct Keypoints<'a> {
    /// Time of every frame, s, increasing.
    pub times_s: &'a [f64],
    /// Number of joints per frame.
    pub joints: usize,
    /// (u, v) px, frame after frame, `joints` entries per frame; NaN where missing.
    pub points_px: &'a [[f64; 2]],
    /// Score of every point, in [0, 1]; weights the noise. 0 or NaN means missing.
    pub scores: Option<&'a [f64]>,
}

/// Pairs at one level of a limb, such as the knee, or the ankle with heel and toes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Level {
    /// Name in reports.
    pub name: String,
    /// Indices (left, right) of joints that are swapped together.
    pub pairs: Vec<[usize; 2]>,
}

/// A limb on both sides of the body, from the trunk outwards.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LimbGroup {
    /// Name in reports.
    pub name: String,
    /// One to [`MAX_LEVELS`] levels.
    pub levels: Vec<Level>,
}

/// Priors, in nats (natural log of odds), and the probability required for a decision.
#[derive(Debug, Clone, PartialEq)]
pub struct UnswapOptions {
    /// Prior per frame against swapped labels. Default 0.2: a run of 15 swapped frames costs 3, far less
    /// than two breaks in the motion (10 to 30), and a surplus of 11 frames decides a label with probability
    /// 0.9. Larger values are worse for long runs. Frames count as independent: if a detector errs in runs
    /// longer than half a step, the probability of a run's label is overconfident.
    pub as_is_nats: f64,
    /// Prior against a difference between neighbouring levels starting (once in ninety frames).
    pub partial_begin_nats: f64,
    /// Prior against such a difference continuing for another frame.
    pub partial_stay_nats: f64,
    /// Probability from which on a frame's label counts as decided.
    pub decided_at: f64,
}

impl Default for UnswapOptions {
    fn default() -> Self {
        Self { as_is_nats: 0.2, partial_begin_nats: 4.5, partial_stay_nats: 0.3, decided_at: 0.9 }
    }
}

/// Why input was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnswapError {
    /// The number of points disagrees with the number of frames.
    #[error("wanted {} x {} = {}, got {got}", counted(*frames, "frame"), counted(*joints, "joint"), counted(*wanted, "point"))]
    Points {
        /// Number of times.
        frames: usize,
        /// Joints per frame.
        joints: usize,
        /// Number of points expected, the product of both.
        wanted: usize,
        /// Points given.
        got: usize,
    },
    /// The number of scores disagrees with the number of points.
    #[error("wanted a score for each of {}, got {got}", counted(*wanted, "point"))]
    Scores {
        /// Points given.
        wanted: usize,
        /// Scores given.
        got: usize,
    },
    /// A time is not finite, or not later than the previous one.
    #[error(
        "wanted times within +-1e12 s at least 1e-6 s apart, got {time_s} s at frame {frame} after {before_s} s"
    )]
    Time {
        /// Frame with the invalid time.
        frame: usize,
        /// The time of that frame, s.
        time_s: f64,
        /// The previous time (at frame 0 the same time), s.
        before_s: f64,
    },
    /// A coordinate is infinite or larger than 1e7 px.
    #[error(
        "wanted coordinates within +-1e7 px (NaN where missing), got ({u}, {v}) at frame {frame}, joint {joint}"
    )]
    Coordinate {
        /// Frame of the point.
        frame: usize,
        /// Index of the joint.
        joint: usize,
        /// Coordinate u, px.
        u: f64,
        /// Coordinate v, px.
        v: f64,
    },
    /// A score is outside [0, 1].
    #[error("wanted scores in [0, 1], got {score} at frame {frame}, joint {joint}")]
    Score {
        /// Frame of the score.
        frame: usize,
        /// Index of the joint.
        joint: usize,
        /// The score.
        score: f64,
    },
    /// A group has too few or too many levels.
    #[error("wanted 1 to 4 levels of a limb, got {levels} in group \"{group}\"")]
    Levels {
        /// Name of the group.
        group: String,
        /// Number of levels given.
        levels: usize,
    },
    /// A level has no pairs.
    #[error("wanted (left, right) pairs of joints, got none in level \"{level}\" of group \"{group}\"")]
    NoPairs {
        /// Name of the group.
        group: String,
        /// Name of the level.
        level: String,
    },
    /// A joint index does not exist.
    #[error("wanted joints 0 to {joints} - 1, got {joint} in group \"{group}\"")]
    Joint {
        /// Name of the group.
        group: String,
        /// Index given.
        joint: usize,
        /// Joints per frame.
        joints: usize,
    },
    /// A joint is used twice.
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

/// Why a frame has its labels.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// The motion of these levels is smooth with these labels; swapping this frame alone would cost
    /// `gain_nats`.
    Continuity {
        /// Levels that show this on their own, most informative first; empty if only the levels together do.
        levels: Vec<usize>,
        /// Natural log of the odds.
        gain_nats: f64,
    },
    /// The run of frames begins or ends at a gap in which the limbs may have passed one another.
    UnseenCrossing {
        /// Time between the frames on either side, s.
        gap_s: f64,
    },
    /// The distance between left and right is within the noise.
    Coincide {
        /// The largest distance within a pair, px.
        distance_px: f64,
    },
    /// The run begins or ends where the motion fits both label assignments, without a gap.
    Unclear,
    /// The labels are consistent over time, but about as many frames favour one assignment as the other.
    GlobalLabel,
    /// No pair is visible on both sides: the labels stay unchanged.
    NothingSeen,
}

/// The result for one group in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct SideVerdict {
    /// Whether each level's entries were swapped.
    pub level_flipped: Vec<bool>,
    /// Whether the probability of each level's output label suffices for a decision, too.
    pub level_decided: Vec<bool>,
    /// Posterior probability that each level was swapped in the input; a level that is not visible takes
    /// the value of the nearest visible one.
    pub level_probability: Vec<f64>,
    /// Whether the most informative level of the group was swapped.
    pub flipped: bool,
    /// Whether some of the levels were swapped and others not.
    pub partial: bool,
    /// Posterior probability that the most informative level was swapped in the input; 0.5 where nothing is
    /// visible.
    pub probability: f64,
    /// Whether that probability suffices for a decision; if not, `flipped` is only the best guess.
    pub decided: bool,
    /// The reason for the result.
    pub reason: Reason,
}

/// Frames whose labels are determined relative to one another.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRun {
    /// First frame.
    pub start: usize,
    /// Frame after the last one.
    pub end: usize,
    /// Mean posterior probability of the output labels in this run.
    pub probability: f64,
    /// Time without samples before the run (0 for the first run), s.
    pub gap_before_s: f64,
}

/// The result for one group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupResult {
    /// One verdict per frame.
    pub verdicts: Vec<SideVerdict>,
    /// Runs of frames, separated by places where the limbs may have crossed unobserved.
    pub runs: Vec<FrameRun>,
    /// Probability that the global label is correct, as opposed to all output labels being swapped, judging
    /// by the majority of the input's labels.
    pub global_probability: f64,
    /// Estimated standard deviation of a joint coordinate, px.
    pub noise_px: f64,
    /// (frame, left joint) of the pairs left out as bad detections; their labels follow their group.
    pub left_out: Vec<[usize; 2]>,
}

/// The joints with swapped labels repaired, and the results for each group.
#[derive(Debug, Clone, PartialEq)]
pub struct Unswapped {
    /// As [`Keypoints::points_px`].
    pub points_px: Vec<[f64; 2]>,
    /// As [`Keypoints::scores`], swapped together with their points.
    pub scores: Option<Vec<f64>>,
    /// One result per group, in the order given.
    pub groups: Vec<GroupResult>,
}

impl SideVerdict {
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

/// Finds and undoes swapped left and right labels, group by group.
///
/// # Errors
/// [`UnswapError`] if shapes disagree or values are out of range.
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
    /// Level of each track.
    level_of: Vec<usize>,
    tracks: Vec<Track>,
    left_out: Vec<[usize; 2]>,
    /// Frames that show at least one level on both sides, with those levels.
    shown: Vec<(usize, usize)>,
}

/// The solution for the bits of a group.
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

    /// Estimates the scales from the smoothest signs, then a path; the scales from the signs of that path,
    /// twice; then the posterior.
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
        let mut solution = Solution { scales, costs, path, posterior, starts };
        self.turn_unlikely_runs(&mut solution);
        solution
    }

    /// Exchanges the sides of whole runs whose labels are likelier the other way: the likeliest sequence is one of many, and
    /// how runs go together is known least.
    fn turn_unlikely_runs(&self, solution: &mut Solution) {
        for run in 0..solution.starts.len() {
            let steps = self.steps_of(solution, run);
            if self.mean_probability(solution, steps.clone()) < 0.5 {
                solution.path[steps].iter_mut().for_each(|bits| *bits ^= (1 << self.levels) - 1);
            }
        }
    }

    /// The steps of a run.
    fn steps_of(&self, solution: &Solution, run: usize) -> std::ops::Range<usize> {
        solution.starts[run]..solution.starts.get(run + 1).copied().unwrap_or(self.shown.len())
    }

    /// Mean posterior probability of the labels on the path.
    fn mean_probability(&self, solution: &Solution, steps: std::ops::Range<usize>) -> f64 {
        let count = steps.len() as f64;
        steps.map(|k| self.probability_of_path(solution, k, self.furthest(k).0)).sum::<f64>() / count
    }

    /// Costs per step and level, from the last two frames of the level; zero where they do not exist yet.
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

    fn runs(&self, solution: &Solution) -> Vec<FrameRun> {
        let starts = &solution.starts;
        let run = |(i, &first): (usize, &usize)| {
            let end = starts.get(i + 1).map_or(self.times_s.len(), |&next| self.shown[next].0);
            FrameRun {
                start: if i == 0 { 0 } else { self.shown[first].0 },
                end,
                probability: self.mean_probability(solution, self.steps_of(solution, i)),
                gap_before_s: self.gap_before(first),
            }
        };
        starts.iter().enumerate().map(run).collect()
    }

    /// Time since the previous step, s.
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

    /// Level and distance (px) of the pair with the largest distance.
    fn furthest(&self, step: usize) -> (usize, f64) {
        let t = self.shown[step].0;
        let apart = self
            .tracks
            .iter()
            .zip(&self.level_of)
            .filter_map(|(track, &level)| track[t].map(|sample| (level, sample.difference.length())));
        apart.fold((0, -1.0), |best, other| if other.1 > best.1 { other } else { best })
    }

    fn verdicts(&self, solution: &Solution, runs: &[FrameRun], options: &UnswapOptions) -> Vec<SideVerdict> {
        let nothing = SideVerdict {
            level_flipped: vec![false; self.levels],
            level_decided: vec![false; self.levels],
            level_probability: vec![0.5; self.levels],
            flipped: false,
            partial: false,
            probability: 0.5,
            decided: false,
            reason: Reason::NothingSeen,
        };
        let mut verdicts = vec![nothing; self.times_s.len()];
        let usual_s =
            relative::upper_median(&mut self.times_s.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
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
            // A level whose joints coincide takes the label of the most informative level, but is not exchanged where its
            // own labels are rather right.
            let sure = |level: usize| self.probability_of_path(solution, step, level) >= LEVEL_PARTS;
            let follows = |level: usize| flipped && (!decided || p(level) >= 0.5);
            let level_flipped: Vec<bool> =
                sources.iter().map(|&l| if sure(l) { bits >> l & 1 == 1 } else { follows(l) }).collect();
            let right = |(&level, &flipped): (&usize, &bool)| if flipped { p(level) } else { 1.0 - p(level) };
            let level_right = sources.iter().zip(&level_flipped).map(right);
            let differs = |level: usize| seen >> level & 1 == 1 && level_flipped[level] != flipped;
            verdicts[t] = SideVerdict {
                partial: (0..self.levels).any(differs),
                level_decided: level_right.map(|p| decided && p >= options.decided_at).collect(),
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

    /// Why the label of a run is uncertain.
    fn doubt(&self, solution: &Solution, run: usize, usual_s: f64) -> Reason {
        if solution.starts.len() == 1 {
            return Reason::GlobalLabel;
        }
        let ends = [Some(&solution.starts[run]), solution.starts.get(run + 1)];
        let gap_s = ends.into_iter().flatten().map(|&step| self.gap_before(step)).fold(0.0, f64::max);
        if gap_s > 1.5 * usual_s { Reason::UnseenCrossing { gap_s } } else { Reason::Unclear }
    }

    /// Per step and level: the cost that swapping that sample alone adds to the motion, nats.
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

    /// Probability of all output labels against all of them swapped: the motion cost is the same for both,
    /// the prior differs.
    fn global_probability(&self, solution: &Solution, options: &UnswapOptions) -> f64 {
        let surplus = self.shown.iter().zip(&solution.path).map(|(&(_, seen), bits)| {
            1.0 - 2.0 * (bits & seen).count_ones() as f64 / seen.count_ones() as f64
        });
        1.0 / (1.0 + (-options.as_is_nats * surplus.sum::<f64>()).exp())
    }
}

/// The levels that support the labels on their own with at least 1 nat.
fn continuity(gains: &[f64]) -> Reason {
    let mut levels: Vec<usize> = (0..gains.len()).filter(|&level| gains[level] >= 1.0).collect();
    levels.sort_by(|&a, &b| gains[b].total_cmp(&gains[a]));
    Reason::Continuity { levels, gain_nats: gains.iter().sum() }
}

/// The sample of left and right in a frame where both are present.
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
