//! One walk being followed: prediction, narrow search, filter update, for both half-cycle twins (Rohr 1994,
//! sections 5.2, 6).
//!
//! A track started half a cycle off never corrects itself: its legs fit almost as well. So both twins are
//! followed, each with its own filters, and the similarities they collect decide between them.

use super::kalman::{ConstantVelocity, FilterOptions};
use super::score::{EdgeLine, SimilarityOptions};
use super::search::{Axis, Grid, HiddenLines, Hypothesis, PHASE_STEP, POSITION_STEP_M, Path, Scene, search};
use super::start::{SwapModel, swap_probability};
use crate::image::Rectangle;
use crate::model::{Camera, Walker};

/// Options of the following stage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WalkOptions {
    /// Comparison of contours and edges.
    pub similarity: SimilarityOptions,
    /// Noise of the filter.
    pub filter: FilterOptions,
    /// How the twins' margin turns into a probability.
    pub swap: SwapModel,
    /// How often hidden lines are removed in the search.
    pub hidden_lines: HiddenLines,
}

/// Smallest and largest half widths of the search: along the path, in height (metres) and in phase. The
/// largest are the printed ones; the smallest keep three steps on each side.
const HALF_WIDTHS: [(f64, f64); 3] = [(0.06, 0.2), (0.06, 0.1), (0.06, 0.2)];

/// How well the ground and the length of the legs fix the height of the torso, metres. The printed 10 cm is
/// what one frame's contours fix it to.
const GROUND_SD_M: f64 = 0.02;

/// The filtered state of one twin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Place along the path, metres.
    pub along: ConstantVelocity,
    /// Level height of the torso's centre, metres.
    pub height: ConstantVelocity,
    /// Gait phase, cycles, not wrapped.
    pub phase: ConstantVelocity,
}

impl State {
    /// The hypothesis at the state's mean.
    pub fn hypothesis(&self) -> Hypothesis {
        Hypothesis {
            along_m: self.along.position,
            height_m: self.height.position,
            phase: self.phase.position.rem_euclid(1.0),
        }
    }

    /// Eqs. (14), (15) for all coordinates.
    #[must_use]
    pub fn predict(&self, dt_s: f64, options: &FilterOptions) -> Self {
        Self {
            along: self.along.predict(dt_s, &options.along),
            height: self.height.predict(dt_s, &options.vertical),
            phase: self.phase.predict(dt_s, &options.phase),
        }
    }

    /// Eqs. (16)-(18) for all coordinates; the measured phase is taken at the turn nearest to the state's.
    fn update(&self, measured: &Hypothesis, options: &FilterOptions) -> Self {
        let off = measured.phase - self.phase.position;
        let phase = self.phase.position + off - off.round();
        Self {
            along: self.along.update(measured.along_m, &options.along),
            height: self.height.update(measured.height_m, &options.vertical),
            phase: self.phase.update(phase, &options.phase),
        }
    }

    /// The grid around a prediction; its size follows the predicted covariance.
    fn grid(&self) -> Grid {
        let half = |state: &ConstantVelocity, (low, high): (f64, f64)| state.position_sd().clamp(low, high);
        let [along, height, phase] = HALF_WIDTHS;
        Grid {
            along: Axis::around(self.along.position, half(&self.along, along), POSITION_STEP_M),
            height: Axis::around(self.height.position, half(&self.height, height), POSITION_STEP_M),
            phase: Axis::around(self.phase.position, half(&self.phase, phase), PHASE_STEP),
        }
    }
}

/// Where in a frame one twin was looked for: with the frame, all that its similarity hangs on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The part of the image edges were taken from.
    pub window: Rectangle,
    /// The heights of the search grid; hidden lines were removed at the middle one.
    pub heights: Axis,
    /// The grid point of the highest similarity; the prediction where nothing was matched.
    pub best: Hypothesis,
}

/// One frame of one twin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Number of the frame.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// State after the frame.
    pub state: State,
    /// The best hypothesis of the frame; `None` where nothing was matched and the filter coasted.
    pub measured: Option<Hypothesis>,
    /// The similarity of the best grid point, 0 where nothing matched.
    pub similarity: f32,
    /// Where it was looked for.
    pub look: Look,
}

/// One of the two half-cycle hypotheses.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    /// All frames so far.
    pub steps: Vec<Step>,
    /// Sum of the similarities over all frames, dropped ones included.
    pub similarity_sum: f64,
}

/// Where a walk begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beginning {
    /// Time the values hold for, seconds.
    pub time_s: f64,
    /// Place along the path, metres.
    pub along_m: f64,
    /// Gait phase.
    pub phase: f64,
    /// Speed along the path in the direction faced, metres a second.
    pub speed_mps: f64,
    /// Gait cycles a second.
    pub rate_hz: f64,
}

/// The edges of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameEdges {
    /// Number of the frame.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// The part of the image they were taken from.
    pub window: Rectangle,
    /// Straight edges in ideal pixels.
    pub edges: Vec<EdgeLine>,
}

/// A person being followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Walk {
    /// Body, gait and style.
    pub walker: Walker,
    /// The line walked and the direction faced.
    pub path: Path,
    /// Where it began; the second twin began half a cycle later.
    pub beginning: Beginning,
    /// The two half-cycle hypotheses.
    pub twins: [Twin; 2],
    first_time_s: Option<f64>,
}

impl Walk {
    /// A walk at its beginning, no frame followed yet.
    pub fn new(walker: Walker, path: Path, beginning: Beginning) -> Self {
        let twin = Twin { steps: Vec::new(), similarity_sum: 0.0 };
        Self { walker, path, beginning, twins: [twin.clone(), twin], first_time_s: None }
    }

    /// Follows both twins into a frame.
    pub fn follow(&mut self, edges: &FrameEdges, camera: &Camera, options: &WalkOptions) {
        let scene = Scene { walker: &self.walker, camera, path: &self.path };
        let step = |twin: usize| {
            let predicted = self.predict(twin, edges.time_s, &options.filter);
            match_frame(edges, &scene, &predicted, options)
        };
        let (first, second) = rayon::join(|| step(0), || step(1));
        for (twin, step) in self.twins.iter_mut().zip([first, second]) {
            twin.similarity_sum += f64::from(step.similarity);
            twin.steps.push(step);
        }
        self.first_time_s.get_or_insert(edges.time_s);
    }

    /// A twin's prediction for a time: from its last step, or from the beginning with the measurement's
    /// uncertainty.
    pub fn predict(&self, twin: usize, time_s: f64, options: &FilterOptions) -> State {
        match self.twins[twin].steps.last() {
            Some(step) => step.state.predict(time_s - step.time_s, options),
            None => self.initial_state(twin, time_s, options),
        }
    }

    /// P_0 = R for place and phase, the 30 % deviation of section 6 for the velocities; the height is the
    /// walker's own over the ground.
    fn initial_state(&self, twin: usize, time_s: f64, options: &FilterOptions) -> State {
        let b = &self.beginning;
        let dt = time_s - b.time_s;
        let start = |position: f64, velocity: f64, variance: f64| {
            ConstantVelocity::new(position + dt * velocity, velocity, variance, (0.3 * velocity).powi(2))
        };
        let phase = b.phase + 0.5 * twin as f64;
        State {
            along: start(b.along_m, b.speed_mps, options.along.measurement_variance),
            height: start(self.walker.level_torso_height_m(), 0.0, GROUND_SD_M * GROUND_SD_M),
            phase: start(phase, b.rate_hz, options.phase.measurement_variance),
        }
    }

    /// Index of the twin with the higher summed similarity, the first of equals.
    pub fn best(&self) -> usize {
        usize::from(self.twins[1].similarity_sum > self.twins[0].similarity_sum)
    }

    /// Probability that the other twin and not the best is the true one.
    pub fn swap_probability(&self, options: &SwapModel) -> f64 {
        let best = self.best();
        let duration_s = match (self.first_time_s, self.twins[best].steps.last()) {
            (Some(first), Some(last)) => last.time_s - first,
            _ => 0.0,
        };
        swap_probability(
            self.twins[best].similarity_sum,
            self.twins[1 - best].similarity_sum,
            duration_s,
            options,
        )
    }

    /// Keeps a range of the steps; the similarity sums keep what they have seen.
    pub(crate) fn keep(&mut self, range: std::ops::Range<usize>) {
        for twin in &mut self.twins {
            twin.steps.truncate(range.end);
            twin.steps.drain(..range.start);
        }
    }

    /// The last step of the best twin.
    pub fn last(&self) -> Option<&Step> {
        self.twins[self.best()].steps.last()
    }
}

/// Searches around a prediction and updates the state with what was found.
fn match_frame(edges: &FrameEdges, scene: &Scene<'_>, predicted: &State, options: &WalkOptions) -> Step {
    let grid = predicted.grid();
    let found = search(&edges.edges, scene, &grid, &options.similarity, options.hidden_lines);
    let similarity = found.best_score();
    let measured = (similarity > 0.0).then(|| found.refined());
    let state = measured.map_or(*predicted, |measured| predicted.update(&measured, &options.filter));
    let best = measured.map_or(predicted.hypothesis(), |_| found.best());
    let look = Look { window: edges.window, heights: grid.height, best };
    Step { frame: edges.frame, time_s: edges.time_s, state, measured, similarity, look }
}
