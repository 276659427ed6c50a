//! The least-squares problem of the fit: what is fitted, from which gait it starts, and in which steps. `step` is one of these steps,
//! `cost` what edges and priors count, `outcome` what the fit says of the person.

mod cost;
mod outcome;
mod step;

pub(super) use step::{Room, Width};

use super::contrast::Contrast;
use super::edge_search::View;
use super::lines::{Figure, KINDS, Workspace, samples};
use super::route::Bend;
use super::seen::Seen;
use super::unknowns::{
    FRAME, FRAME_ALONG, FRAME_HEIGHT, FRAME_PHASE, LEAN_SD_RAD, Prior, Unknowns, WHOLE_ACROSS, WHOLE_HEADING,
    WHOLE_LEAN, body, flatten, mean_of, posture, priors, sway_m,
};
use super::{FitError, FitOptions, LEAST_FRAMES, WalkFit, sides};
use crate::estimate::arrow::Solution;
use crate::model::{Camera, Gait, GaitStyle, Walker};
use crate::track::height::BodyHeight;
use crate::track::route::Route;
use crate::track::search::{Hypothesis, Path};
use cost::SOLE;
use glam::DVec2;
use rayon::prelude::*;

/// A frame to be fitted: its time, its picture around the person, and where the tracker found the person.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FitFrame {
    pub time_s: f64,
    pub view: View,
    /// Share of the person that nobody else hid, 0 to 1.
    pub visible: f64,
    /// Where the pelvis is: along the path and above the ground; and the phase, not wrapped.
    pub start: Hypothesis,
}

/// What stays the same during a fit.
pub(crate) struct Problem<'a> {
    camera: &'a Camera,
    /// The average walker of the given or supposed height.
    walker: &'a Walker,
    /// The tracker's route.
    route: &'a Route,
    frames: Vec<&'a FitFrame>,
    options: &'a FitOptions,
    priors: Vec<Prior>,
    /// How much taller the person is than the walker, as a share of the walker's height.
    excess: Prior,
    /// True if the camera shows how far away, and so how tall, the person is.
    is_scale_seen: bool,
    /// Standard deviation of the height of a standing foot, metres.
    ground_sd_m: f64,
    is_on_treadmill: bool,
    /// What the edge of a sole counts in the last steps, of what it counts in the cost.
    sole: f64,
    /// The difference from the empty scene that belongs to the body, by kind of part, grey levels.
    body_levels: [f32; KINDS],
    /// Mean share of the person that nobody else hid.
    visible_share: f64,
    /// The foot of the walk's middle, about which the heading turns, and its place along the tracker's path.
    origin: DVec2,
    origin_along_m: f64,
    /// Where the route of somebody who turned bends; `None` of a straight one.
    bend: Option<Bend>,
}

/// A gait from which the fit starts. People who walk unlike the average are not always reached from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartGait {
    Average,
    /// [`GaitStyle::CROUCHED`].
    Crouched,
    /// One knee, of the side 0 or 1, flexes by 0.4 of the average's swing.
    StiffKnee(usize),
    /// The average with a trunk that leans farther forward than most people's, or farther back.
    Leaning {
        /// Which of the two.
        is_forward: bool,
    },
}

impl StartGait {
    const ALL: [Self; 6] = [
        Self::Average,
        Self::Crouched,
        Self::StiffKnee(0),
        Self::StiffKnee(1),
        Self::Leaning { is_forward: true },
        Self::Leaning { is_forward: false },
    ];

    pub fn mirrored(self) -> Self {
        match self {
            Self::StiffKnee(side) => Self::StiffKnee(1 - side),
            same => same,
        }
    }

    /// Factor on its cost: few people walk unlike the average.
    fn handicap(self) -> f64 {
        match self {
            Self::Average | Self::Leaning { .. } => 1.0,
            Self::Crouched | Self::StiffKnee(_) => 1.0 + LEAST_GAIN,
        }
    }

    fn apply(self, gait: &Gait, whole: &mut [f64]) {
        match self {
            Self::Average => {}
            Self::Crouched => {
                whole[mean_of(0)] += GaitStyle::CROUCHED.hip_offset;
                whole[mean_of(1)] += GaitStyle::CROUCHED.knee_offset;
            }
            Self::StiffKnee(side) => flatten(gait, whole, 1, side, 0.6),
            Self::Leaning { is_forward } => {
                whole[WHOLE_LEAN] += if is_forward { START_LEAN_RAD } else { -START_LEAN_RAD };
            }
        }
    }
}

/// What a few of the frames say of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Glance {
    /// The gait from which they come nearest to their edges.
    pub gait: StartGait,
    /// Their [total cost](super::FitQuality::total_cost) with curves from there.
    pub total_cost: f64,
}

/// Share of its cost by which a start from another gait than the average must be nearer to the edges once the curves are
/// fitted. Of 43 drawn walks of people without a crouch or a stiff knee, others are nearer by at most 4 %, but by 6 % in a
/// piece of 36 frames and by 9 and 12 % in clothes that hardly differ from the background. Of people who walk so, crouched gait
/// is nearer by 21 % and more, or reached from the average too, and a stiff knee by 10 to 25 %, or reached too. After the first
/// steps alone a stiff knee was nearer by only 0.4 and 6 % in two of six, and the knee 8 and 10 degrees off. The curves for all
/// frames begin with first steps of their own: with the curves of the few, sides and clips in dull clothes came out wrong.
const LEAST_GAIN: f64 = 0.065;
/// The curves are fitted from gaits that cost at most so many times the least after the first steps. Of twelve drawn people
/// with a stiff knee, the gait that is right in the end cost at most 1.21 times as much; with a limit of 1.12, one was missed.
const MOST_START_COST: f64 = 1.3;

/// From where a trunk starts that leans: two standard deviations over people from the mean. What shows of somebody behind another
/// may be too little to reach it from there: of a pair who walk side by side, the head of the farther one, who leans back by twice
/// the usual, was sought behind that of the nearer one, 20 cm ahead of its own and 9 cm above it.
const START_LEAN_RAD: f64 = 2.0 * LEAN_SD_RAD;

/// What is fitted in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The body and the curves, on the route of the tracker.
    Start,
    /// The route too.
    Curves,
    /// What single frames deviate from the curves, too.
    Frames,
}

/// Steps from every starting gait, then steps with the person's curves, then with what single frames deviate.
const STEPS: [usize; 3] = [4, 4, 4];
/// The first step with what single frames deviate.
const FRAMES_STEP: usize = STEPS[0] + STEPS[1];

/// From which gait a fit starts is decided by at most this many frames, about evenly spaced, but by at least one in so many
/// seconds: steps take half a second.
const FEW_FRAMES: usize = 24;
const FEW_S: f64 = 0.125;

/// Below this visible share, the fit with exchanged sides does not start from the steps of the other fit, and fits start from leaning
/// trunks too. Reasoned, not varied:
/// of a pair of whom one is half visible, it made the right sides the likelier ones with one more of eight sets of heights.
const SEEN_SHARE: f64 = 0.8;

impl<'a> Problem<'a> {
    pub fn new(
        camera: &'a Camera,
        walker: &'a Walker,
        route: &'a Route,
        frames: &'a [FitFrame],
        options: &'a FitOptions,
    ) -> Self {
        let origin_along_m = frames.get(frames.len() / 2).map_or(0.0, |frame| frame.start.along_m);
        let origin = route.place(origin_along_m);
        let visible: f64 = frames.iter().map(|frame| frame.visible).sum();
        let ends = frames.first().zip(frames.last()).filter(|_| !route.is_straight());
        let bend = ends.and_then(|(first, last)| Bend::between([first.start.along_m, last.start.along_m]));
        let mut priors = priors();
        if bend.is_some() {
            // The bend can do the same.
            priors[WHOLE_HEADING].sd = HELD_SD;
            priors[WHOLE_ACROSS].sd = HELD_SD;
        }
        let mut problem = Self {
            camera,
            walker,
            route,
            frames: frames.iter().collect(),
            options,
            priors,
            excess: Prior { mean: 0.0, sd: options.height_sd },
            is_scale_seen: true,
            ground_sd_m: GROUND_SD_M,
            is_on_treadmill: false,
            sole: SOLE,
            body_levels: [f32::INFINITY; KINDS],
            visible_share: visible / frames.len().max(1) as f64,
            origin,
            origin_along_m,
            bend,
        };
        problem.body_levels = problem.contrast().body_levels();
        problem
    }

    /// The person's contrast, where the tracker found the average walker in at most [`FEW_FRAMES`].
    fn contrast(&self) -> Contrast {
        let mut contrast = Contrast::default();
        let start = self.start(0.0);
        let Some(height_px) = self.height_px(&start) else { return contrast };
        let spacing_px = Width::of_step(0, height_px).spacing_px();
        let mut work = Workspace::default();
        for frame in (0..self.frames.len()).step_by(self.frames.len().div_ceil(FEW_FRAMES)) {
            let view = &self.frames[frame].view;
            let figure = self.figure(&start, frame);
            samples(&figure, &view.others, self.camera, &start.whole, spacing_px, &mut work);
            work.samples.iter().for_each(|sample| contrast.add(sample, view, height_px));
        }
        contrast
    }

    /// The same of a person whose height is only known as well as this.
    pub fn of_height(mut self, height: &BodyHeight) -> Self {
        let height_m = self.walker.body.height_m;
        self.excess =
            Prior { mean: height.height_m / height_m - 1.0, sd: height.sd_in_camera_m() / height_m };
        self
    }

    /// The same of a person of any height. It follows from the distance, and that from the soles, so they count fully.
    pub fn of_any_height(self) -> Self {
        Self { sole: 1.0, ..self.of_height(&BodyHeight::POPULATION) }
    }

    /// The same in an assumed camera, whose ground and whose direction of sight are assumed too: distance and heading
    /// stay near those that the tracker found from the person's size.
    pub fn of_assumed_camera(mut self) -> Self {
        self.priors[WHOLE_HEADING].sd = ASSUMED_HEADING_SD_RAD;
        self.priors[WHOLE_ACROSS].sd = ASSUMED_ACROSS_SD_M;
        self.ground_sd_m = ASSUMED_GROUND_SD_M;
        self.bend = None;
        self.is_scale_seen = false;
        self
    }

    /// The same of a person on a treadmill, whose heading no movement shows.
    pub fn on_treadmill(mut self) -> Self {
        self.priors[WHOLE_HEADING].sd = UNSEEN_HEADING_SD_RAD;
        self.is_on_treadmill = true;
        self
    }

    /// Further steps from a fit, in the heading of the route.
    pub(super) fn with_heading_held(&self, fitted: &Fitted) -> Option<(Self, Fitted)> {
        let mut priors = self.priors.clone();
        priors[WHOLE_HEADING].sd = FIXED_SD_RAD;
        let held = Self { frames: self.frames.clone(), priors, ..*self };
        let mut unknowns = fitted.unknowns.clone();
        unknowns.whole[WHOLE_HEADING] = 0.0;
        let fitted = held.finished(unknowns)?;
        Some((held, fitted))
    }

    /// Probability that the sides are those of the `other` fit; `p_tracked` is that by the tracker.
    pub(super) fn p_other_sides(&self, chosen: &Fitted, other: &Fitted, p_tracked: f64) -> f64 {
        sides::p_other(&chosen.seen, &other.seen, p_tracked, self.visible_share)
    }

    /// Fits the person from a gait, steps 1 to 7 of the module. `p_tracked_swapped` is the probability by the tracker that
    /// the sides are exchanged; without it, the sides stay as tracked.
    pub fn fit(&self, gait: StartGait, p_tracked_swapped: Option<f64>) -> Result<WalkFit, FitError> {
        let (_, start) = self.started(0.0, gait).ok_or(FitError::Undetermined)?;
        // What is hidden holds no fit in place, so one with exchanged sides then takes first steps of its own.
        let exchanged = p_tracked_swapped.and_then(|_| match self.is_hidden() {
            true => self.best_start(0.5).ok().map(|(start, _)| start),
            false => Some(start.exchanged()),
        });
        let (as_tracked, exchanged) =
            rayon::join(|| self.finished(start), || exchanged.and_then(|start| self.finished(start)));
        let as_tracked = as_tracked.ok_or(FitError::Undetermined)?;
        let p_tracked = p_tracked_swapped.unwrap_or(0.0);
        let p_exchanged =
            exchanged.as_ref().map_or(0.0, |other| self.p_other_sides(&as_tracked, other, p_tracked));
        let (best, p_swapped) = match exchanged {
            Some(other) if p_exchanged > 0.5 => (other, 1.0 - p_exchanged),
            _ => (as_tracked, p_exchanged),
        };
        self.checked(&best, p_swapped)
    }

    /// The result of a fit, unless it ended in a wrong place.
    pub(super) fn checked(&self, fitted: &Fitted, p_swapped: f64) -> Result<WalkFit, FitError> {
        let quality = self.quality(fitted);
        if quality.is_misfit() {
            let residual = quality.residual_px / quality.height_px;
            return Err(FitError::Misfit { missed: quality.missed, residual });
        }
        Ok(self.result(fitted, p_swapped, quality))
    }

    pub(super) fn route_heading_rad(&self) -> f64 {
        self.route.at(self.origin_along_m).heading_rad
    }

    pub(super) fn heading_rad(&self, fitted: &Fitted) -> f64 {
        self.heading_at(&fitted.unknowns.whole, self.origin_along_m)
    }

    /// The first steps from the best gait to start from, with the tracker's phase shifted by some cycles.
    pub(super) fn best_start(&self, phase: f64) -> Result<(Unknowns, StartGait), FitError> {
        let gait = self.glance(phase)?.gait;
        let (_, start) = self.started(phase, gait).ok_or(FitError::Undetermined)?;
        Ok((start, gait))
    }

    /// True of somebody of whom others hide a good part.
    fn is_hidden(&self) -> bool {
        self.visible_share < SEEN_SHARE
    }

    /// The gait from which a few of the frames come nearest to their edges once the person's curves are fitted.
    pub fn glance(&self, phase: f64) -> Result<Glance, FitError> {
        if self.frames.len() < LEAST_FRAMES {
            return Err(FitError::TooFewFrames { got: self.frames.len() });
        }
        // 1. The first steps from every gait. What is far off after them stays so.
        let few = self.of_few_frames();
        let is_tried = |gait: &StartGait| self.is_hidden() || !matches!(gait, StartGait::Leaning { .. });
        let started: Vec<_> = StartGait::ALL
            .into_par_iter()
            .filter(is_tried)
            .filter_map(|gait| few.started(phase, gait).map(|(cost, unknowns)| (cost, unknowns, gait)))
            .collect();
        let least = started.iter().map(|(cost, ..)| *cost).fold(f64::INFINITY, f64::min);
        // 2. The curves from those that may be right. A stiff knee is often reached from the average, and often not.
        let costs: Vec<_> = started
            .into_par_iter()
            .filter(|(cost, ..)| *cost <= MOST_START_COST * least)
            .filter_map(|(_, unknowns, gait)| Some((gait, few.curves_costs(unknowns)?)))
            .map(|(gait, [cost, total_cost])| (cost * gait.handicap(), Glance { gait, total_cost }))
            .collect();
        let best = costs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, best)| best).ok_or(FitError::Undetermined)
    }

    /// The total cost of a few of the frames with the person's curves, from one gait.
    pub fn few_cost(&self, gait: StartGait) -> Option<f64> {
        let few = self.of_few_frames();
        let (_, start) = few.started(0.0, gait)?;
        let [_, total_cost] = few.curves_costs(start)?;
        Some(total_cost)
    }

    /// The same with every second, third ... frame, so that there are at most [`FEW_FRAMES`], but at least one in [`FEW_S`].
    fn of_few_frames(&self) -> Self {
        let count = self.frames.len();
        let ends = self.frames.first().zip(self.frames.last());
        let every_s = ends.map_or(0.0, |(first, last)| last.time_s - first.time_s) / count.max(2) as f64;
        let every = count.div_ceil(FEW_FRAMES).min((FEW_S / every_s) as usize).max(1);
        let frames = self.frames.iter().copied().step_by(every).collect();
        Self { frames, priors: self.priors.clone(), ..*self }
    }

    /// The first steps from one gait, and their cost.
    pub(super) fn started(&self, phase: f64, gait: StartGait) -> Option<(f64, Unknowns)> {
        let mut unknowns = self.start(phase);
        gait.apply(&self.walker.gait, &mut unknowns.whole);
        let height_px = self.height_px(&unknowns)?;
        let mut cost = f64::INFINITY;
        for n in 0..STEPS[0] {
            cost = self.cost(&self.step(&mut unknowns, &self.width(n, height_px), Stage::Start)?.0);
        }
        Some((cost, unknowns))
    }

    /// The cost after the steps with the person's curves, and the total one.
    fn curves_costs(&self, mut unknowns: Unknowns) -> Option<[f64; 2]> {
        let height_px = self.height_px(&unknowns)?;
        let mut seen = Seen::default();
        for n in STEPS[0]..FRAMES_STEP {
            seen = self.step(&mut unknowns, &self.width(n, height_px), Stage::Curves)?.0;
        }
        Some([self.cost(&seen), self.total_cost(&unknowns, &seen)])
    }

    /// The other steps.
    pub(super) fn finished(&self, mut unknowns: Unknowns) -> Option<Fitted> {
        let height_px = self.height_px(&unknowns)?;
        let mut last = None;
        for n in STEPS[0]..STEPS.iter().sum() {
            let stage = if n < FRAMES_STEP { Stage::Curves } else { Stage::Frames };
            last = Some(self.step(&mut unknowns, &self.width(n, height_px), stage)?);
        }
        let (seen, solution) = last?;
        Some(Fitted { unknowns, seen, solution, height_px })
    }

    /// Means over people, at the places and phases that the tracker found.
    fn start(&self, phase: f64) -> Unknowns {
        let frame = |f: &FitFrame| {
            let mut frame = [0.0; FRAME];
            frame[FRAME_ALONG] = f.start.along_m - self.origin_along_m;
            frame[FRAME_HEIGHT] = f.start.height_m;
            frame[FRAME_PHASE] = f.start.phase + phase;
            frame
        };
        Unknowns {
            whole: self.priors.iter().map(|prior| prior.mean).collect(),
            frames: self.frames.iter().copied().map(frame).collect(),
        }
    }

    /// Length along the route up to a frame's pelvis.
    pub(super) fn along(&self, frame: &[f64; FRAME]) -> f64 {
        self.origin_along_m + frame[FRAME_ALONG]
    }

    /// The tangent of the tracker's route where a frame's pelvis is.
    fn tangent(&self, frame: &[f64; FRAME]) -> Path {
        self.route.at(self.along(frame))
    }

    /// Where the body faces at a length along the tracker's route, not wrapped.
    fn heading_at(&self, whole: &[f64], along_m: f64) -> f64 {
        let turned = self.bend.map_or(0.0, |bend| bend.at(whole, along_m)[1].atan());
        self.route.at(along_m).heading_rad + whole[WHOLE_HEADING] + turned
    }

    pub(super) fn route(&self) -> &Route {
        self.route
    }

    pub(super) fn bend(&self) -> Option<Bend> {
        self.bend
    }

    /// Search width and weights of the last step from a starting gait.
    pub(super) fn last_start_width(&self, unknowns: &Unknowns) -> Option<Width> {
        Some(self.width(STEPS[0] - 1, self.height_px(unknowns)?))
    }

    /// Search width and weights of a step.
    fn width(&self, n: usize, height_px: f64) -> Width {
        let is_placed = n >= FRAMES_STEP;
        let sole = if is_placed { self.sole } else { 1.0 };
        Width { sole, is_placed, ..Width::of_step(n, height_px) }
    }

    /// The figure of a frame.
    fn figure(&self, unknowns: &Unknowns, frame: usize) -> Figure {
        self.figure_of(&unknowns.whole, &unknowns.frames[frame])
    }

    /// The figure with these unknowns.
    fn figure_of(&self, whole: &[f64], frame: &[f64; FRAME]) -> Figure {
        let body = body(&self.walker.body, whole);
        let tangent = self.tangent(frame);
        let along_m = self.along(frame);
        let left_m = self.bend.map_or(0.0, |bend| bend.at(whole, along_m)[0]);
        let heading_rad = self.heading_at(whole, along_m);
        let ahead = DVec2::from_angle(heading_rad);
        let place = tangent.point(along_m, 0.0).truncate() + left_m * tangent.direction().perp();
        let turned = DVec2::from_angle(whole[WHOLE_HEADING]).rotate(place - self.origin);
        let ground = self.origin + turned + sway_m(whole, frame[FRAME_PHASE]) * ahead.perp();
        let pelvis = ground.extend(frame[FRAME_HEIGHT]);
        let (sin, cos) = whole[WHOLE_LEAN].sin_cos();
        let torso_centre = pelvis + 0.5 * body.torso_length_m() * (sin * ahead).extend(cos);
        let posed = body.pose(torso_centre, heading_rad, &posture(&self.walker.gait, whole, frame));
        Figure { body, posed, pelvis, ahead, origin: self.origin }
    }

    /// Height of the person in the middle frame, pixels.
    fn height_px(&self, unknowns: &Unknowns) -> Option<f64> {
        let figure = self.figure(unknowns, unknowns.frames.len() / 2);
        self.camera.pixel_height_at(figure.pelvis.with_z(0.0), figure.body.height_m)
    }
}

/// A fit with one choice of sides.
pub(super) struct Fitted {
    unknowns: Unknowns,
    pub(super) seen: Seen,
    solution: Solution,
    height_px: f64,
}

/// Standard deviation of the height of a standing foot, metres.
const GROUND_SD_M: f64 = 0.015;
/// The same, and the standard deviations of heading and distance, in an assumed camera.
const ASSUMED_GROUND_SD_M: f64 = 0.06;
const ASSUMED_HEADING_SD_RAD: f64 = 0.02;
const ASSUMED_ACROSS_SD_M: f64 = 0.1;
/// What another unknown says is held.
const HELD_SD: f64 = 1e-3;
/// Less than all contours of a long walk determine together.
const FIXED_SD_RAD: f64 = 1e-5;
/// Standard deviation of the heading about the start's, where nothing but the outlines shows it.
const UNSEEN_HEADING_SD_RAD: f64 = 0.5;

#[cfg(test)]
pub(in crate::track::fit) mod tests;
