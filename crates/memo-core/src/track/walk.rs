//! Following one walk: prediction, narrow search and filter update for both half-cycle twins (Rohr 1994, sections
//! 5.2, 6).
//!
//! A track that starts half a cycle off does not correct itself, because its legs fit almost as well. So both
//! twins are followed, each with its own filters, and the sums of their similarities decide between them.

use super::rate::latest;
use super::route::Route;
use super::score::{EdgeLine, SimilarityOptions};
use super::search::{
    Axis, Grid, HiddenLines, Hypothesis, PHASE_STEP, POSITION_STEP_M, Path, Scene, search_peak,
};
use super::swap::{SwapModel, swap_probability};
use crate::OptionError;
use crate::estimate::kalman::{ConstantVelocity, FilterOptions};
use crate::image::Rectangle;
use crate::model::{Camera, EllipticCylinder, Gait, GaitStyle, Others, Walker};

/// Options of the following stage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WalkOptions {
    /// Comparison of contours and edges.
    pub similarity: SimilarityOptions,
    /// Noise of the filter.
    pub filter: FilterOptions,
    /// Model of the margin between the twins, which turns it into a probability.
    pub swap: SwapModel,
    /// How often hidden lines are removed in the search.
    pub hidden_lines: HiddenLines,
}

impl WalkOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        self.similarity.check()?;
        self.filter.check()?;
        self.swap.check()
    }
}

/// Smallest and largest half widths of the search: along the path, in height (metres) and in phase (cycles). The
/// largest are the paper's; the smallest keep three steps on each side.
const HALF_WIDTHS: [(f64, f64); 3] = [(0.06, 0.2), (0.06, 0.1), (0.06, 0.2)];

/// In the first frames, at the usual rate, a wrong phase is still put right in either direction: without them, right and left of one of
/// three drawn people became uncertain.
const FIRST_FRAMES: usize = 13;

/// People whose legs swing this share as far as the average's or farther show the phase as well as the average. With
/// 0.65, one more of 18 drawn people with half the swing was lost, and with 1 the sides of somebody hardly visible.
const USUAL_SWING: f64 = 0.75;

/// Standard deviation of the torso's height given the ground and the leg length, metres. The paper's 10 cm is the
/// standard deviation given the contours of one frame.
const GROUND_SD_M: f64 = 0.02;

/// A person of whom less is visible is not measured: the filter predicts.
const LEAST_VISIBLE: f32 = 0.05;

/// What is measured beside somebody who may soon start counts as if this share of the person were visible: the standard
/// deviation doubles. Chosen on a drawn scene of three people, all of whom are followed with it with four sets of heights;
/// with 1, some are lost in three of these. With 0.2 and 0.3, what is left over from one of 28 people who walk alone starts
/// as somebody else; with 0.4 and 0.5 it does not.
const BESIDE_NEWCOMER: f32 = 0.5;

/// The filtered state of one twin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State {
    /// Position along the path, metres.
    pub along: ConstantVelocity,
    /// Level height of the torso's centre, metres.
    pub height: ConstantVelocity,
    /// Gait phase, cycles, not wrapped to [0, 1).
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

    /// Eqs. (16)-(18) for all coordinates; the measured phase is shifted to the cycle nearest to the state's
    /// phase.
    fn update(&self, measured: &Hypothesis, options: &FilterOptions) -> Self {
        let off = measured.phase - self.phase.position;
        let phase = self.phase.position + off - off.round();
        Self {
            along: self.along.update(measured.along_m, &options.along),
            height: self.height.update(measured.height_m, &options.vertical),
            phase: self.phase.update(phase, &options.phase),
        }
    }

    /// The search grid around a prediction; its size depends on the predicted covariance.
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

/// Where one twin was searched in a frame. With the frame, this is all the similarity depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The part of the image from which edges were taken.
    pub window: Rectangle,
    /// The positions along the path of the search grid.
    pub alongs: Axis,
    /// Its heights.
    pub heights: Axis,
    /// The grid point of the highest similarity; the prediction if nothing matched.
    pub best: Hypothesis,
    /// The path on which it was searched: the tangent of the route at the prediction.
    pub path: Path,
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
    /// The best hypothesis of the frame; `None` if nothing matched, and the filter only predicted.
    pub measured: Option<Hypothesis>,
    /// Similarity of the best grid point; 0 if nothing matched.
    pub similarity: f32,
    /// Share of the person's contours that no other person hides, 0 to 1.
    pub visible: f32,
    /// Share of the image about the visible body that changes; `None` if that is not known.
    pub changing: Option<f32>,
    /// True if other people were near.
    pub shared: bool,
    /// True if the state is what the feet show of somebody who walks along the line of sight.
    pub by_feet: bool,
    /// Where the twin was searched.
    pub look: Look,
}

/// One of the two half-cycle hypotheses.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    /// All frames so far.
    pub steps: Vec<Step>,
    /// Sum over all frames, including those dropped from `steps`, of the similarity times the visible share.
    pub similarity_sum: f64,
    /// Sum of the visible shares of the same frames.
    pub visible_sum: f64,
    /// Number of the same frames.
    pub frame_count: usize,
}

/// State at the beginning of a walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beginning {
    /// Time of the state, seconds.
    pub time_s: f64,
    /// Position along the path, metres.
    pub along_m: f64,
    /// Gait phase.
    pub phase: f64,
    /// Speed along the path in the direction the body faces, m/s.
    pub speed_mps: f64,
    /// Cadence in gait cycles per second.
    pub rate_hz: f64,
}

/// The edges of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameEdges {
    /// Number of the frame.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// The part of the image from which they were taken.
    pub window: Rectangle,
    /// Straight edges in ideal pixels, without those of other people.
    pub edges: Vec<EdgeLine>,
    /// The bodies of other people near the window, who may stand in front.
    pub others: Vec<EllipticCylinder>,
    /// True if other people were near, so that edges may have been left to them.
    pub shared: bool,
    /// True if somebody may be near who is not followed yet, so that some of the edges may be that person's.
    pub newcomer: bool,
    /// Share of the image about the person's visible body that changes; `None` if that is not known.
    pub changing: Option<f32>,
}

impl FrameEdges {
    /// The edges near a person who is alone.
    pub fn of_one_alone(frame: usize, time_s: f64, window: Rectangle, edges: Vec<EdgeLine>) -> Self {
        let (others, changing) = (Vec::new(), None);
        Self { frame, time_s, window, edges, others, shared: false, newcomer: false, changing }
    }
}

/// A person being followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Walk {
    /// Body, gait and style.
    pub walker: Walker,
    /// The way walked and the direction the body faces.
    pub route: Route,
    /// State at the beginning; that of the second twin is half a cycle later.
    pub beginning: Beginning,
    /// The two half-cycle hypotheses.
    pub twins: [Twin; 2],
    first_time_s: Option<f64>,
    /// How far the legs swing, as a share of what is usual, at most 1.
    swing: f64,
}

impl Walk {
    /// A walk at its beginning, with no frame followed.
    pub fn new(walker: Walker, route: impl Into<Route>, beginning: Beginning) -> Self {
        let twin = Twin { steps: Vec::new(), similarity_sum: 0.0, visible_sum: 0.0, frame_count: 0 };
        let average = Gait::dense().leg_swing_rad(&GaitStyle::default());
        let swing = (walker.gait.leg_swing_rad(&walker.style) / (USUAL_SWING * average)).min(1.0);
        Self {
            walker,
            route: route.into(),
            beginning,
            twins: [twin.clone(), twin],
            first_time_s: None,
            swing,
        }
    }

    /// The walk after these frames.
    pub fn through<'a>(
        mut self,
        frames: impl IntoIterator<Item = &'a FrameEdges>,
        camera: &Camera,
        options: &WalkOptions,
    ) -> Self {
        for edges in frames {
            self.follow(edges, camera, options);
        }
        self
    }

    /// Follows both twins into a frame.
    pub fn follow(&mut self, edges: &FrameEdges, camera: &Camera, options: &WalkOptions) {
        let others = Others::new(&edges.others, camera.position());
        let options = &WalkOptions { filter: options.filter.of_swing(self.swing), ..*options };
        let step = |twin: usize| {
            let predicted = self.predict(twin, edges.time_s, &options.filter);
            let path = self.route.at(predicted.along.position);
            let scene = Scene::new(&self.walker, camera, &path).among(&others);
            let mut step = match_frame(edges, &scene, &predicted, options);
            let steps = &self.twins[twin].steps;
            if let Some(before) = steps.last().filter(|_| latest(steps, FIRST_FRAMES).is_some()) {
                step.state.phase =
                    onward(&step.state.phase, before.state.phase.position, self.beginning.rate_hz);
            }
            step
        };
        let (first, second) = rayon::join(|| step(0), || step(1));
        for (twin, step) in self.twins.iter_mut().zip([first, second]) {
            twin.similarity_sum += f64::from(step.similarity * step.visible);
            twin.visible_sum += f64::from(step.visible);
            twin.frame_count += 1;
            twin.steps.push(step);
        }
        self.first_time_s.get_or_insert(edges.time_s);
    }

    /// Prediction of a twin for a time: from its last step, or from the beginning with the uncertainty of a
    /// measurement.
    pub fn predict(&self, twin: usize, time_s: f64, options: &FilterOptions) -> State {
        match self.twins[twin].steps.last() {
            Some(step) => step.state.predict(time_s - step.time_s, options),
            None => self.initial_state(twin, time_s, options),
        }
    }

    /// P_0 = R for position and phase, and the 30 % deviation of section 6 for the velocities. The height is that
    /// of the walker's torso above the ground.
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

    /// Index of the twin with the larger sum of similarities, the first if they are equal.
    pub fn best(&self) -> usize {
        usize::from(self.twins[1].similarity_sum > self.twins[0].similarity_sum)
    }

    /// The better twin.
    pub fn best_twin(&self) -> &Twin {
        &self.twins[self.best()]
    }

    /// The frames of the better twin.
    pub fn steps(&self) -> &[Step] {
        &self.best_twin().steps
    }

    /// Sum of the better twin's similarities.
    pub fn similarity_sum(&self) -> f64 {
        self.best_twin().similarity_sum
    }

    /// Mean share of the person that nobody else hid, 0 to 1.
    pub fn visible_share(&self) -> f64 {
        let twin = self.best_twin();
        if twin.frame_count == 0 { 1.0 } else { twin.visible_sum / twin.frame_count as f64 }
    }

    /// Probability that the worse twin is the true one. Of a person who was hidden in part, fewer glimpses count.
    pub fn swap_probability(&self, options: &SwapModel) -> f64 {
        let best = self.best();
        let duration_s = match (self.first_time_s, self.twins[best].steps.last()) {
            (Some(first), Some(last)) => (last.time_s - first) * self.visible_share(),
            _ => 0.0,
        };
        swap_probability(
            self.twins[best].similarity_sum,
            self.twins[1 - best].similarity_sum,
            duration_s,
            options,
        )
    }

    /// Keeps a range of the steps; the sums of similarities do not change.
    pub(crate) fn keep(&mut self, range: std::ops::Range<usize>) {
        for twin in &mut self.twins {
            twin.steps.truncate(range.end);
            twin.steps.drain(..range.start.min(twin.steps.len()));
        }
    }

    /// Forgets the steps from an index on, to follow their frames again.
    pub(crate) fn go_back_to(&mut self, end: usize) {
        for twin in &mut self.twins {
            for step in twin.steps.split_off(end.min(twin.steps.len())) {
                twin.similarity_sum -= f64::from(step.similarity * step.visible);
                twin.visible_sum -= f64::from(step.visible);
                twin.frame_count -= 1;
            }
        }
    }

    /// The last step of the best twin.
    pub fn last(&self) -> Option<&Step> {
        self.steps().last()
    }
}

/// Nobody steps back in the gait cycle: a phase that would go against its way stays where it was.
fn onward(phase: &ConstantVelocity, before: f64, rate_hz: f64) -> ConstantVelocity {
    let way = rate_hz.signum();
    let position = before + way * (way * (phase.position - before)).max(0.0);
    ConstantVelocity { position, velocity: way * (way * phase.velocity).max(0.0), ..*phase }
}

/// Searches around a prediction and updates the state with the result.
fn match_frame(edges: &FrameEdges, scene: &Scene<'_>, predicted: &State, options: &WalkOptions) -> Step {
    let grid = predicted.grid();
    let found = search_peak(&edges.edges, scene, &grid, &options.similarity, options.hidden_lines);
    let similarity = found.best_score();
    let visible = scene.visible_share(&predicted.hypothesis());
    let measured = (similarity > 0.0 && visible >= LEAST_VISIBLE).then(|| found.refined());
    // A part of the contours measures less well than all of them, and so do edges of which some may be another's.
    let trusted = if edges.newcomer { visible * BESIDE_NEWCOMER } else { visible };
    let filter = options.filter.of_visible_share(trusted.into());
    let state = measured.map_or(*predicted, |measured| predicted.update(&measured, &filter));
    let best = measured.map_or(predicted.hypothesis(), |_| found.best());
    let look =
        Look { window: edges.window, alongs: grid.along, heights: grid.height, best, path: scene.path };
    Step {
        frame: edges.frame,
        time_s: edges.time_s,
        state,
        measured,
        similarity,
        visible,
        changing: edges.changing,
        shared: edges.shared,
        by_feet: false,
        look,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::search::tests::{camera, edges_of, walker};
    use super::*;
    use glam::DVec2;

    const PATH: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    const BEGINNING: Beginning =
        Beginning { time_s: 2.0, along_m: -0.3, phase: 0.7, speed_mps: 1.3, rate_hz: 0.9 };

    fn walk() -> Walk {
        Walk::new(walker(), PATH, BEGINNING)
    }

    #[test]
    fn a_phase_goes_on_its_way_or_stays() {
        let phase = |position: f64, velocity: f64| ConstantVelocity::new(position, velocity, 1e-4, 1e-3);
        assert_eq!(onward(&phase(3.1, 0.9), 3.06, 0.9), phase(3.1, 0.9));
        assert_eq!(onward(&phase(3.0, -0.2), 3.06, 0.9), phase(3.06, 0.0));
        assert_eq!(onward(&phase(3.0, 0.3), 3.06, 0.9), phase(3.06, 0.3));
        assert_eq!(onward(&phase(-3.1, -0.9), -3.06, -0.9), phase(-3.1, -0.9), "backwards");
        assert_eq!(onward(&phase(-3.0, 0.2), -3.06, -0.9), phase(-3.06, 0.0));
    }

    /// After the first frames, edges whose cycle runs the other way do not turn the phase round.
    #[test]
    fn edges_that_step_back_hold_the_phase() {
        let mut walk = walk();
        for k in 0..30 {
            let time_s = 2.0 + 0.04 * k as f64;
            let turned = if k < 20 { time_s } else { 2.0 + 0.04 * (40 - k) as f64 };
            let edges = FrameEdges { time_s, ..planted(k, turned) };
            walk.follow(&edges, &camera(), &WalkOptions::default());
        }
        let phases: Vec<f64> = walk.twins[0].steps.iter().map(|s| s.state.phase.position).collect();
        assert!(phases[19] - phases[10] > 0.25);
        assert!(phases[FIRST_FRAMES..].windows(2).all(|w| w[1] >= w[0]), "{phases:?}");
    }

    /// The true state of the planted walker, on the line from `BEGINNING`.
    fn truth(time_s: f64) -> Hypothesis {
        let elapsed_s = time_s - BEGINNING.time_s;
        Hypothesis {
            along_m: BEGINNING.along_m + elapsed_s * BEGINNING.speed_mps,
            height_m: walker().level_torso_height_m(),
            phase: (BEGINNING.phase + elapsed_s * BEGINNING.rate_hz).rem_euclid(1.0),
        }
    }

    const WINDOW: Rectangle = Rectangle { left: 10, top: 20, right: 300, bottom: 400 };

    /// The contours of the planted walker as edges.
    fn planted(frame: usize, time_s: f64) -> FrameEdges {
        let (walker, camera) = (walker(), camera());
        let edges = edges_of(&Scene::new(&walker, &camera, &PATH), &truth(time_s));
        FrameEdges::of_one_alone(frame, time_s, WINDOW, edges)
    }

    fn empty(frame: usize, time_s: f64) -> FrameEdges {
        FrameEdges::of_one_alone(frame, time_s, WINDOW, Vec::new())
    }

    /// Filter noise that differs between coordinates.
    fn filter() -> FilterOptions {
        let mut filter = FilterOptions::default();
        filter.vertical.velocity_variance_per_s = 0.3;
        filter.phase.velocity_variance_per_s = 0.7;
        filter.phase.measurement_variance = 0.02;
        filter
    }

    fn state(along: [f64; 2], height: [f64; 2], phase: [f64; 2]) -> State {
        let of = |[position, sd]: [f64; 2]| ConstantVelocity::new(position, 0.4, sd * sd, 0.05);
        State { along: of(along), height: of(height), phase: of(phase) }
    }

    /// A step that was measured as its state says, of a person who is wholly visible.
    pub fn step_in(frame: usize, time_s: f64, state: State) -> Step {
        let best = state.hypothesis();
        let (alongs, heights) =
            (Axis::around(best.along_m, 0.1, 0.02), Axis::around(best.height_m, 0.1, 0.02));
        let look = Look { window: WINDOW, alongs, heights, best, path: PATH };
        Step {
            frame,
            time_s,
            state,
            measured: Some(best),
            similarity: 0.5,
            visible: 1.0,
            changing: None,
            shared: false,
            by_feet: false,
            look,
        }
    }

    /// A step of the planted walker.
    fn step(time_s: f64, similarity: f32) -> Step {
        let Hypothesis { along_m, height_m, phase } = truth(time_s);
        let state = State {
            along: ConstantVelocity::new(along_m, 1.3, 0.01, 0.01),
            height: ConstantVelocity::new(height_m, 0.0, 1e-4, 0.0),
            phase: ConstantVelocity::new(phase, 0.9, 0.01, 0.01),
        };
        Step { similarity, ..step_in(0, time_s, state) }
    }

    #[test]
    fn a_walk_begins_with_the_printed_uncertainties_and_its_twin_half_a_cycle_on() {
        let (walk, filter) = (walk(), filter());
        let [first, second] = [0, 1].map(|twin| walk.predict(twin, 2.2, &filter));
        assert_eq!((first.along, first.height), (second.along, second.height));
        assert!((second.phase.position - first.phase.position - 0.5).abs() < 1e-12);
        // At 2.2 s the walker has moved for 0.2 s.
        assert!((first.along.position + 0.3 - 0.2 * 1.3).abs() < 1e-12);
        assert!((first.phase.position - 0.7 - 0.2 * 0.9).abs() < 1e-12);
        assert!((first.height.position - walker().level_torso_height_m()).abs() < 1e-12);
        // Section 6: P_0 = R, and velocities deviate by 30 % from the average.
        assert_eq!((first.along.velocity, first.phase.velocity, first.height.velocity), (1.3, 0.9, 0.0));
        assert!((first.along.position_sd() - 0.2).abs() < 1e-12);
        assert!((first.along.velocity_sd() - 0.3 * 1.3).abs() < 1e-12);
        assert!((first.phase.position_sd() - 0.02f64.sqrt()).abs() < 1e-12);
        assert!((first.phase.velocity_sd() - 0.3 * 0.9).abs() < 1e-12);
        assert!((first.height.position_sd() - 0.02).abs() < 1e-12, "the ground holds the height");
    }

    #[test]
    fn edges_beside_a_newcomer_draw_the_person_less_away() {
        let drawn_m = |newcomer: bool| {
            let mut walk = walk();
            for k in 0..20 {
                // From frame 15 on, the edges stay where they are, as those of somebody who comes the other way may.
                let time_s = 2.0 + 0.04 * k as f64;
                let is_drawn = k >= 15;
                let edges = planted(k, if is_drawn { 2.0 + 0.04 * 15.0 } else { time_s });
                let edges = FrameEdges { time_s, newcomer: newcomer && is_drawn, ..edges };
                walk.follow(&edges, &camera(), &WalkOptions::default());
            }
            let last = walk.last().unwrap();
            truth(last.time_s).along_m - last.state.along.position
        };
        let (plain_m, cautious_m) = (drawn_m(false), drawn_m(true));
        assert!(cautious_m > 0.0 && cautious_m < 0.75 * plain_m, "{plain_m} {cautious_m}");
    }

    #[test]
    fn a_prediction_goes_from_the_last_step_with_each_coordinate_s_own_noise() {
        let (mut walk, filter) = (walk(), filter());
        walk.twins[1].steps.extend([step(2.0, 0.5), step(2.1, 0.5)]);
        let predicted = walk.predict(1, 2.25, &filter);
        let last = walk.twins[1].steps[1].state;
        for (predicted, last, noise) in [
            (predicted.along, last.along, filter.along),
            (predicted.height, last.height, filter.vertical),
            (predicted.phase, last.phase, filter.phase),
        ] {
            assert!((predicted.position - last.position - 0.15 * last.velocity).abs() < 1e-12);
            let gained = predicted.covariance[2] - last.covariance[2];
            assert!((gained - 0.15 * noise.velocity_variance_per_s).abs() < 1e-12, "{predicted:?}");
        }
    }

    #[test]
    fn an_update_weighs_each_coordinate_by_its_own_noise_at_the_nearest_turn() {
        let filter = filter();
        let before = state([0.5, 0.1], [1.2, 0.05], [3.97, 0.2]);
        let measured = Hypothesis { along_m: 0.6, height_m: 1.1, phase: 0.03 };
        let after = before.update(&measured, &filter);
        // K = P / (P + R).
        for (before, after, off, noise) in [
            (before.along, after.along, 0.1, filter.along),
            (before.height, after.height, -0.1, filter.vertical),
            (before.phase, after.phase, 0.06, filter.phase),
        ] {
            let gain = before.covariance[0] / (before.covariance[0] + noise.measurement_variance);
            assert!((after.position - before.position - gain * off).abs() < 1e-12, "{after:?}");
            assert!((after.covariance[0] - (1.0 - gain) * before.covariance[0]).abs() < 1e-12);
        }
        let back = before.update(&Hypothesis { phase: 0.9, ..measured }, &filter);
        assert!((3.89..3.97).contains(&back.phase.position), "{back:?}");
    }

    #[test]
    fn the_grid_reaches_one_standard_deviation_within_its_limits() {
        let centres = |grid: &Grid| [grid.along.centre, grid.height.centre, grid.phase.centre];
        let counts = |grid: &Grid| [grid.along.count, grid.height.count, grid.phase.count];
        // The paper's grid is the largest: 40 cm, 20 cm and 0.4 of the cycle.
        let wide = state([0.3, 1.0], [1.2, 1.0], [0.8, 1.0]).grid();
        assert_eq!((centres(&wide), counts(&wide)), ([0.3, 1.2, 0.8], [21, 11, 21]));
        let narrow = state([0.3, 1e-3], [1.2, 1e-3], [0.8, 1e-3]).grid();
        assert_eq!(counts(&narrow), [7, 7, 7], "three steps on either side");
        let between = state([0.3, 0.12], [1.2, 0.08], [0.8, 0.16]).grid();
        assert_eq!(counts(&between), [13, 9, 17]);
        assert_eq!([between.along.step, between.height.step, between.phase.step], [0.02; 3]);
    }

    #[test]
    fn where_nothing_is_matched_the_filter_coasts() {
        let (mut walk, options) = (walk(), WalkOptions::default());
        walk.twins.iter_mut().for_each(|twin| twin.steps.push(step(2.0, 0.5)));
        let predicted = walk.predict(0, 2.04, &options.filter);
        walk.follow(&empty(1, 2.04), &camera(), &options);
        let coasted = walk.twins[0].steps[1];
        assert_eq!((coasted.measured, coasted.similarity, coasted.state), (None, 0.0, predicted));
        assert_eq!((coasted.look.best, coasted.look.window), (predicted.hypothesis(), WINDOW));
        assert_eq!((coasted.frame, coasted.time_s), (1, 2.04));
    }

    #[test]
    fn a_planted_walker_is_followed_at_uneven_times_through_a_gap() {
        let (mut walk, options) = (walk(), WalkOptions::default());
        let times_s = [2.0, 2.03, 2.1, 2.12, 2.2, 2.24];
        for (frame, time_s) in times_s.into_iter().enumerate() {
            let edges = if frame == 3 { empty(frame, time_s) } else { planted(frame, time_s) };
            walk.follow(&edges, &camera(), &options);
        }
        let [first, second] = &walk.twins;
        assert_eq!(first.steps.len(), times_s.len());
        for (k, (step, time_s)) in first.steps.iter().zip(times_s).enumerate() {
            let (found, truth) = (step.state.hypothesis(), truth(time_s));
            assert!((found.along_m - truth.along_m).abs() < 0.012, "{k}: {found:?} against {truth:?}");
            assert!((found.height_m - truth.height_m).abs() < 0.012, "{k}: {found:?} against {truth:?}");
            assert!((found.phase - truth.phase).abs() < 0.012, "{k}: {found:?} against {truth:?}");
            assert_eq!((step.frame, step.time_s, step.measured.is_none()), (k, time_s, k == 3));
        }
        assert!(first.steps[3].state.along.position_sd() > first.steps[2].state.along.position_sd());
        // The sums include all frames, also the empty one.
        for twin in [first, second] {
            let sum: f64 = twin.steps.iter().map(|s| f64::from(s.similarity)).sum();
            assert!((twin.similarity_sum - sum).abs() < 1e-9);
        }
        assert!(first.similarity_sum > 4.5 && first.similarity_sum > 1.05 * second.similarity_sum);
        assert_eq!((walk.best(), walk.last().unwrap().frame), (0, 5));
    }

    #[test]
    fn the_better_twin_has_the_larger_sum_and_the_swap_its_margin_and_duration() {
        let (mut walk, model) = (walk(), SwapModel::default());
        assert_eq!((walk.best(), walk.swap_probability(&model)), (0, 0.5), "the first of equals");
        walk.first_time_s = Some(2.0);
        for (twin, sum) in walk.twins.iter_mut().zip([4.0, 5.0]) {
            twin.steps.extend([step(2.5, 0.1), step(4.0, 0.2)]);
            twin.similarity_sum = sum;
        }
        walk.twins[1].steps[1].frame = 17;
        assert_eq!((walk.best(), walk.last().unwrap().frame), (1, 17));
        // Two seconds are 10 glimpses of 0.2 s: log odds 2 mu m / (person² + glimpse² / 10), m = 1 / 5.
        let log_odds = 2.0 * 0.13 * 0.2 / (0.05f64.powi(2) + 0.16f64.powi(2) / 10.0);
        assert!((walk.swap_probability(&model) - 1.0 / (1.0 + log_odds.exp())).abs() < 1e-12);
        // Of a person half of whom is hidden, these are 5 glimpses.
        (walk.twins[1].visible_sum, walk.twins[1].frame_count) = (1.0, 2);
        let log_odds = 2.0 * 0.13 * 0.2 / (0.05f64.powi(2) + 0.16f64.powi(2) / 5.0);
        assert!((walk.swap_probability(&model) - 1.0 / (1.0 + log_odds.exp())).abs() < 1e-12);
    }

    #[test]
    fn followed_frames_count_from_the_first_one() {
        let (mut walk, options) = (walk(), WalkOptions::default());
        for (frame, time_s) in [2.0, 2.04, 2.08].into_iter().enumerate() {
            walk.follow(&empty(frame, time_s), &camera(), &options);
        }
        assert_eq!(walk.first_time_s, Some(2.0));
    }

    #[test]
    fn kept_steps_lose_no_similarity() {
        let mut walk = walk();
        for twin in &mut walk.twins {
            twin.steps = (0..10).map(|k| step(2.0 + f64::from(k), 0.5)).collect();
            twin.similarity_sum = 5.0;
        }
        walk.keep(2..7);
        for twin in &walk.twins {
            let times_s: Vec<f64> = twin.steps.iter().map(|s| s.time_s).collect();
            assert_eq!(times_s, [4.0, 5.0, 6.0, 7.0, 8.0]);
            assert_eq!(twin.similarity_sum, 5.0);
        }
    }
}
