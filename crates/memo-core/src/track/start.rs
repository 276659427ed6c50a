//! Starting phase: from similarity curves of single frames to a line of phase over time (Rohr 1994, sections
//! 5.1 and 6).
//!
//! A walker's phase grows linearly, so the estimates of 10-15 frames lie on a line. Because the two legs look
//! alike, about as many estimates lie on its twin half a cycle away. There are two methods:
//!
//! * [`two_line_rule`] is the paper's: assign the best phases of the frames to the two lines, and choose by
//!   count, or by mean similarity if the counts are close.
//! * [`phase_lines`] is the better one, and the tracker uses it: sum the whole similarity curves along every
//!   line.
//!
//! Both twins are returned, and [`swap_probability`] is the probability that the wrong one was chosen.

use super::decisions::OTHER_WAY_SHARE;
use super::locate::Course;
use super::search::{Grid, Hypothesis, Path, Scene, search_each_phase};
use super::swap::swap_probability;
use super::walk::{Beginning, FrameEdges, WalkOptions};
use crate::estimate::line::line_through;
use crate::model::{Camera, Others, Walker};
use std::f64::consts::TAU;

/// Similarity of one frame over the whole cycle, at equally spaced phases from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseCurve {
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// Best similarity at each phase.
    pub scores: Vec<f32>,
}

impl PhaseCurve {
    /// The similarity at any phase, by linear interpolation.
    pub fn at(&self, phase: f64) -> f64 {
        let n = self.scores.len();
        let x = phase.rem_euclid(1.0) * n as f64;
        let (i, t) = (x.floor() as usize % n, x.fract());
        f64::from(self.scores[i]) * (1.0 - t) + f64::from(self.scores[(i + 1) % n]) * t
    }

    /// The phase of the highest similarity, the first if several are equal.
    pub fn best_phase(&self) -> f64 {
        let best =
            self.scores.iter().enumerate().fold(0, |b, (i, v)| if *v > self.scores[b] { i } else { b });
        best as f64 / self.scores.len() as f64
    }
}

/// A line of constant cadence: phase(t) = phase_at_start + rate (t - first time).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseLine {
    /// Phase at the first frame, in [0, 1).
    pub phase_at_start: f64,
    /// Gait cycles per second; negative for a cycle run backwards.
    pub rate_hz: f64,
    /// Mean similarity along the line.
    pub similarity: f64,
}

impl PhaseLine {
    /// The phase `elapsed_s` after the first frame, in [0, 1).
    pub fn at(&self, elapsed_s: f64) -> f64 {
        (self.phase_at_start + self.rate_hz * elapsed_s).rem_euclid(1.0)
    }
}

/// Range of cadences, gait cycles per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CadenceRange {
    /// Lowest cadence.
    pub low_hz: f64,
    /// Highest cadence.
    pub high_hz: f64,
}

impl Default for CadenceRange {
    /// 0.65 to 1.3 cycles per second: slow walks of 0.8 m/s to brisk walks of 2 m/s.
    fn default() -> Self {
        Self { low_hz: 0.65, high_hz: 1.3 }
    }
}

/// The best line and its twin half a cycle away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwinLines {
    /// The line of the highest mean similarity.
    pub best: PhaseLine,
    /// The same line shifted by half a cycle.
    pub twin: PhaseLine,
}

const RATE_STEPS: usize = 40;
const OFFSET_STEPS: usize = 100;

/// Sums the similarity curves along every line of the cadence range (signs as given). Returns the best line with
/// its twin, `None` without curves. Among equal lines the one with the lowest rate, then the lowest phase, is
/// best.
pub fn phase_lines(curves: &[PhaseCurve], rates: &CadenceRange) -> Option<TwinLines> {
    let first = curves.first()?.time_s;
    let mean_along = |phase: f64, rate: f64| {
        curves.iter().map(|c| c.at(phase + rate * (c.time_s - first))).sum::<f64>() / curves.len() as f64
    };
    let line = |index: usize| {
        let rate_hz =
            rates.low_hz + (rates.high_hz - rates.low_hz) * (index / OFFSET_STEPS) as f64 / RATE_STEPS as f64;
        let phase_at_start = (index % OFFSET_STEPS) as f64 / OFFSET_STEPS as f64;
        PhaseLine { phase_at_start, rate_hz, similarity: mean_along(phase_at_start, rate_hz) }
    };
    let best = (0..(RATE_STEPS + 1) * OFFSET_STEPS)
        .map(line)
        .reduce(|best, line| if line.similarity > best.similarity { line } else { best })?;
    let phase_at_start = (best.phase_at_start + 0.5).rem_euclid(1.0);
    let twin = PhaseLine { phase_at_start, similarity: mean_along(phase_at_start, best.rate_hz), ..best };
    Some(TwinLines { best, twin })
}

/// The best line of constant phase, `None` without curves. It fits a person who stands or is carried along in one
/// posture.
pub fn frozen_line(curves: &[PhaseCurve]) -> Option<PhaseLine> {
    if curves.is_empty() {
        return None;
    }
    let line = |index: usize| {
        let phase_at_start = index as f64 / OFFSET_STEPS as f64;
        let sum: f64 = curves.iter().map(|curve| curve.at(phase_at_start)).sum();
        PhaseLine { phase_at_start, rate_hz: 0.0, similarity: sum / curves.len() as f64 }
    };
    (0..OFFSET_STEPS)
        .map(line)
        .reduce(|best, line| if line.similarity > best.similarity { line } else { best })
}

/// Best phase and similarity of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseEstimate {
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// Best phase.
    pub phase: f64,
    /// Similarity at the best phase.
    pub similarity: f64,
}

/// The paper's choice between the two lines.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoLineChoice {
    /// The chosen line, by linear regression of its estimates.
    pub line: PhaseLine,
    /// True for estimates on the chosen line; the others are on the line half a cycle away.
    pub on_line: Vec<bool>,
    /// True if mean similarity decided (the counts were within a factor of two), false if the count did.
    pub by_similarity: bool,
}

/// Assigns single-frame estimates to two lines half a cycle apart and chooses one (section 6).
///
/// Rate and offset modulo half a cycle maximise the sum of cos(4 pi (phase - line)) over the frames, which is the
/// same for both twins. "Number for one line higher than half of the number for the other" is read as min > max /
/// 2: then the line with the higher mean similarity is chosen, otherwise the line with more estimates. So the
/// line with more estimates is chosen at exactly twice the number. If the means are equal, the line of the
/// maximum is chosen; among equal maxima, the lowest rate. `None` without estimates.
pub fn two_line_rule(estimates: &[PhaseEstimate], rates: &CadenceRange) -> Option<TwoLineChoice> {
    let first = estimates.first()?.time_s;
    let (rate, offset) = vote(estimates, rates, first);
    let residual = |e: &PhaseEstimate| e.phase - offset - rate * (e.time_s - first);
    let on_a: Vec<bool> = estimates.iter().map(|e| (TAU * residual(e)).cos() >= 0.0).collect();
    let mean = |wanted: bool| {
        let of: Vec<f64> =
            estimates.iter().zip(&on_a).filter(|(_, a)| **a == wanted).map(|(e, _)| e.similarity).collect();
        (of.len(), of.iter().sum::<f64>() / of.len().max(1) as f64)
    };
    let ((count_a, mean_a), (count_b, mean_b)) = (mean(true), mean(false));
    let by_similarity = 2 * count_a.min(count_b) > count_a.max(count_b);
    let choose_a = if by_similarity { mean_a >= mean_b } else { count_a >= count_b };
    let on_line: Vec<bool> = on_a.iter().map(|a| *a == choose_a).collect();
    let base = if choose_a { offset } else { offset + 0.5 };
    let similarity = if choose_a { mean_a } else { mean_b };
    let line = regression(estimates, &on_line, base, rate, similarity);
    Some(TwoLineChoice { line, on_line, by_similarity })
}

/// Rate and offset (modulo 1/2) that maximise the sum of cos(4 pi (phase - line)).
fn vote(estimates: &[PhaseEstimate], rates: &CadenceRange, first: f64) -> (f64, f64) {
    let at_rate = |step: usize| {
        let rate = rates.low_hz + (rates.high_hz - rates.low_hz) * step as f64 / RATE_STEPS as f64;
        let (mut x, mut y) = (0.0, 0.0);
        for e in estimates {
            let (s, c) = (2.0 * TAU * (e.phase - rate * (e.time_s - first))).sin_cos();
            x += c;
            y += s;
        }
        (x.hypot(y), rate, y.atan2(x) / (2.0 * TAU))
    };
    let (_, rate, offset) =
        (0..=RATE_STEPS).map(at_rate).fold((-1.0, 0.0, 0.0), |b, v| if v.0 > b.0 { v } else { b });
    (rate, offset)
}

/// Linear regression of phase over time on the chosen estimates, unwrapped about the given line.
fn regression(
    estimates: &[PhaseEstimate],
    on_line: &[bool],
    base: f64,
    rate: f64,
    similarity: f64,
) -> PhaseLine {
    let first = estimates[0].time_s;
    let points: Vec<(f64, f64)> = estimates
        .iter()
        .zip(on_line)
        .filter(|(_, on)| **on)
        .map(|(e, _)| {
            let t = e.time_s - first;
            let residual = e.phase - base - rate * t;
            (t, residual - residual.round())
        })
        .collect();
    let (slope, level) = line_through(&points);
    PhaseLine { phase_at_start: (base + level).rem_euclid(1.0), rate_hz: rate + slope, similarity }
}

/// Direction of movement relative to the direction the body faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// Forward walking.
    Forward,
    /// Backward walking: the gait cycle runs in reverse.
    Backward,
}

/// Report of the starting phase.
#[derive(Debug, Clone, PartialEq)]
pub struct StartReport {
    /// The line walked and the direction the body faces.
    pub path: Path,
    /// State at the first start frame on the best line.
    pub beginning: Beginning,
    /// Forward or backward, whichever has the higher similarity.
    pub direction: Direction,
    /// Probability that the other direction is the true one.
    pub p_other_direction: f64,
    /// Best line and half-cycle twin of the chosen direction.
    pub lines: TwinLines,
    /// Best line of the other direction.
    pub other_direction: PhaseLine,
    /// Best line of constant phase, in the chosen direction.
    pub frozen: PhaseLine,
    /// The choice of the paper's rule on the same frames, for comparison.
    pub two_line_rule: TwoLineChoice,
    /// Similarity over the whole cycle, one curve per frame, in the chosen direction.
    pub curves: Vec<PhaseCurve>,
    /// Frame numbers of the curves.
    pub frames: Vec<usize>,
}

impl StartReport {
    /// Similarity along the best line divided by the mean over all phases. It is near 1 if no phase fits better
    /// than another, as for things that do not walk; 0 if nothing matched at all.
    pub fn contrast(&self) -> f64 {
        contrast(self.lines.best.similarity, &self.curves)
    }
}

/// Whole-cycle search, for one direction the body may face.
#[derive(Debug, Clone)]
struct Faced {
    path: Path,
    /// Best hypothesis and similarity at each phase, of the frames searched so far.
    found: Vec<Option<Vec<(Hypothesis, f32)>>>,
    /// True once some frames were enough to tell that the body does not face this way.
    is_out: bool,
}

/// The search for a start on a few frames: [`glance`](Self::glance) at some of them, then [`finish`](Self::finish).
#[derive(Debug, Clone)]
pub struct StartSearch<'a> {
    frames: &'a [&'a FrameEdges],
    course: &'a Course,
    walker: &'a Walker,
    camera: &'a Camera,
    /// Cadences forwards and backwards.
    rates: [CadenceRange; 2],
    options: &'a WalkOptions,
    /// The body ahead and turned about.
    faced: [Faced; 2],
}

/// What some of the frames say of a start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glance {
    /// Similarity along the best line, in the better direction.
    pub similarity: f64,
    /// As [`StartReport::contrast`].
    pub contrast: f64,
}

/// Starts a walk on a few frames: whole-cycle search, phase lines for forward and backward walking, regression.
/// `None` if there are no frames.
pub fn start(
    frames: &[&FrameEdges],
    course: &Course,
    walker: &Walker,
    camera: &Camera,
    rates: &CadenceRange,
    options: &WalkOptions,
) -> Option<StartReport> {
    StartSearch::new(frames, course, walker, camera, rates, options).finish()
}

impl<'a> StartSearch<'a> {
    /// A search on frames that nobody has looked at yet.
    pub fn new(
        frames: &'a [&'a FrameEdges],
        course: &'a Course,
        walker: &'a Walker,
        camera: &'a Camera,
        rates: &CadenceRange,
        options: &'a WalkOptions,
    ) -> Self {
        let path = course.path;
        let back = Path { heading_rad: path.heading_rad + std::f64::consts::PI, ..path };
        let faced = [path, back].map(|path| Faced { path, found: vec![None; frames.len()], is_out: false });
        let reversed = CadenceRange { low_hz: -rates.high_hz, high_hz: -rates.low_hz };
        Self { frames, course, walker, camera, rates: [*rates, reversed], options, faced }
    }

    /// The same with what another search on these frames found of the directions that the body does not face.
    #[must_use]
    pub fn after(mut self, other: &Self) -> Self {
        for (faced, known) in self.faced.iter_mut().zip(&other.faced).filter(|(_, known)| known.is_out) {
            faced.found.clone_from(&known.found);
            faced.is_out = true;
        }
        self
    }

    /// Searches every `every`-th frame. `None` if there are no frames. A direction that is much worse than the other is not
    /// looked at any more.
    pub fn glance(&mut self, every: usize) -> Option<Glance> {
        self.look(every);
        let curves = self.curves();
        let lines = self.lines(&curves)?;
        let better = usize::from(lines[1].best.similarity > lines[0].best.similarity);
        let similarity = lines[better].best.similarity;
        self.faced[1 - better].is_out = lines[1 - better].best.similarity < OTHER_WAY_SHARE * similarity;
        Some(Glance { similarity, contrast: contrast(similarity, &curves[better]) })
    }

    /// Searches all frames and decides. `None` if there are no frames.
    pub fn finish(mut self) -> Option<StartReport> {
        // 1. Similarity over the whole cycle, for both directions the body may face.
        self.look(1);
        let [ahead, back] = self.curves();
        // 2. The best line of phase over time for each direction.
        let [forward, backward] = self.lines(&[ahead.clone(), back.clone()])?;
        let is_forward = forward.best.similarity >= backward.best.similarity;
        let (direction, faced, curves, rates, lines, other) = if is_forward {
            (Direction::Forward, &self.faced[0], ahead, self.rates[0], forward, backward)
        } else {
            (Direction::Backward, &self.faced[1], back, self.rates[1], backward, forward)
        };
        let duration_s = self.frames.last()?.time_s - self.frames.first()?.time_s;
        let (here, there) = (lines.best.similarity, other.best.similarity);
        let p_other_direction = swap_probability(here, there, duration_s, &self.options.swap);
        // 3. Position and speed by regression over the hypotheses on the line.
        let beginning = beginning(self.frames, faced, &lines.best)?;
        let two_line_rule = two_line_rule(&estimates(&curves), &rates)?;
        let frozen = frozen_line(&curves)?;
        Some(StartReport {
            path: faced.path,
            beginning,
            direction,
            p_other_direction,
            lines,
            other_direction: other.best,
            frozen,
            two_line_rule,
            curves,
            frames: self.frames.iter().map(|f| f.frame).collect(),
        })
    }

    /// Searches every `every`-th frame that has not been searched yet, for the directions that the body may face.
    fn look(&mut self, every: usize) {
        let height_m = self.walker.level_torso_height_m();
        for (faced, sign) in self.faced.iter_mut().zip([1.0, -1.0]).filter(|(faced, _)| !faced.is_out) {
            let scene = Scene::new(self.walker, self.camera, &faced.path);
            let frames = self.frames.iter().zip(&self.course.along_m).zip(&mut faced.found);
            for ((frame, along_m), found) in frames.step_by(every) {
                if found.is_none() {
                    let others = Others::new(&frame.others, self.camera.position());
                    let scene = scene.among(&others);
                    let grid = Grid::whole_cycle(sign * along_m, height_m);
                    let (similarity, hidden_lines) = (&self.options.similarity, self.options.hidden_lines);
                    *found = Some(
                        search_each_phase(&frame.edges, &scene, &grid, similarity, hidden_lines).curve(),
                    );
                }
            }
        }
    }

    /// The similarity curves of the frames searched so far, for both directions.
    fn curves(&self) -> [Vec<PhaseCurve>; 2] {
        [0, 1].map(|k| {
            let frames = self.frames.iter().zip(&self.faced[k].found);
            let of = |(frame, found): (&&FrameEdges, &Option<Vec<(Hypothesis, f32)>>)| {
                let scores = found.as_ref()?.iter().map(|(_, score)| *score).collect();
                Some(PhaseCurve { time_s: frame.time_s, scores })
            };
            frames.filter_map(of).collect()
        })
    }

    /// The best lines through the curves, for both directions.
    fn lines(&self, curves: &[Vec<PhaseCurve>; 2]) -> Option<[TwinLines; 2]> {
        let [ahead, back] = curves;
        Some([phase_lines(ahead, &self.rates[0])?, phase_lines(back, &self.rates[1])?])
    }
}

/// The similarity along a line over the mean of all phases; 0 if nothing matched at all.
fn contrast(similarity: f64, curves: &[PhaseCurve]) -> f64 {
    let all: Vec<f64> = curves.iter().flat_map(|c| &c.scores).map(|s| f64::from(*s)).collect();
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    if mean > 0.0 { similarity / mean } else { 0.0 }
}

/// Regression of position over time, over each frame's best hypothesis at the line's phase.
fn beginning(frames: &[&FrameEdges], faced: &Faced, line: &PhaseLine) -> Option<Beginning> {
    let first = frames.first()?.time_s;
    let on_line = |(frame, found): (&&FrameEdges, &Option<Vec<(Hypothesis, f32)>>)| {
        let (elapsed, found) = (frame.time_s - first, found.as_ref()?);
        let index = (line.at(elapsed) * found.len() as f64).round() as usize % found.len();
        Some((elapsed, found[index].0))
    };
    let found: Vec<(f64, Hypothesis)> = frames.iter().zip(&faced.found).filter_map(on_line).collect();
    let (speed_mps, along_m) = line_through(&found.iter().map(|(t, h)| (*t, h.along_m)).collect::<Vec<_>>());
    Some(Beginning { time_s: first, along_m, phase: line.phase_at_start, speed_mps, rate_hz: line.rate_hz })
}

fn estimates(curves: &[PhaseCurve]) -> Vec<PhaseEstimate> {
    let estimate = |c: &PhaseCurve| {
        let phase = c.best_phase();
        PhaseEstimate { time_s: c.time_s, phase, similarity: c.at(phase) }
    };
    curves.iter().map(estimate).collect()
}

#[cfg(test)]
pub(super) mod tests;
