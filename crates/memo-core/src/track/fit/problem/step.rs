//! One Gauss-Newton step of the fit: its edges and normal equations.

use super::cost::{CLEAR_STEP, importance, is_sole, robust, student};
use super::{Problem, STEPS, Stage};
use crate::estimate::arrow::{Arrow, FrameTerms, Solution, velocity_change};
use crate::model::body::Part;
use crate::track::fit::edge_search::{Border, Reach};
use crate::track::fit::lines::{Figure, SurfacePoint, Workspace, gradient, row_of, samples};
use crate::track::fit::normal::{Chain, FigureTerms};
use crate::track::fit::route::{Bend, figure_slopes};
use crate::track::fit::seen::{LEAST_STEP, Seen};
use crate::track::fit::unknowns::{
    BEND, BODY, FRAME, FRAME_ALONG, FRAME_ANGLES, FRAME_HEIGHT, FRAME_PHASE, GROUND, JOINTS, Prior, SHANK,
    STATURE, Slope, THIGH, THIGH_OVER_SHANK, Unknowns, WHOLE, WHOLE_BEND, WHOLE_GROUND, excess, length,
    slopes,
};
use glam::{DVec2, DVec3};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// How far edges are searched, and the distance at which an edge counts a quarter: shares of the person's height at
/// the first and at the last step.
const REACH: [f64; 2] = [0.06, 0.02];
const SCALE: [f64; 2] = [0.03, 0.008];
/// Where the background is beyond an outline: so far from it, a share of the person's height. Farther out is another limb, nearer
/// the blur of what moves. Between 0.030 and 0.034 hip and knee differ little, with 0.040 they are in dull clothes 0.5 degrees worse,
/// with 0.022 the knee.
const BEYOND: f64 = 0.033;
/// So many frames in a row are a task, and the normal equations of so many tasks are in memory at a time.
const FRAMES_OF_TASK: usize = 4;
const TASKS_AT_ONCE: usize = 64;
/// Sample points per body height. Their edges err together, so each counts with a standard deviation of their
/// distance from each other.
const SAMPLES_PER_HEIGHT: f64 = 75.0;
const LEAST_SPACING_PX: f64 = 2.0;
const LEAST_REACH_PX: f64 = 4.0;
/// The changes may end so far from the crown, and the standard deviation of what is beyond, shares of the person's height.
/// Models that are on the person are within 0.010 of them ([`POORLY_CROWN`](super::super::decisions)).
const CROWN_FREE: f64 = 0.012;
const CROWN_SD: f64 = 0.01;
/// Random walk of the velocities of the frames' unknowns: per square root of a second, m/s of place and height,
/// cycles/s of the phase, rad/s of the angles. Of the size that prototypes on motion-captured walks used; the
/// result hardly depends on them.
const RATES: [f64; FRAME] = {
    let mut rates = [75.0 * std::f64::consts::PI / 180.0; FRAME];
    rates[FRAME_ALONG] = 0.5;
    rates[FRAME_HEIGHT] = 0.75;
    rates[FRAME_PHASE] = 0.19;
    rates
};

impl Problem<'_> {
    /// One Gauss-Newton step of the unknowns of a stage.
    pub(super) fn step(
        &self,
        unknowns: &mut Unknowns,
        width: &Width,
        stage: Stage,
    ) -> Option<(Seen, Solution)> {
        // While only curves are fitted, frames have no angles of their own.
        let block = if stage == Stage::Frames { FRAME } else { FRAME_ANGLES };
        let mut arrow = Arrow::new(self.frames.len(), block, WHOLE);
        let mut seen = Seen::default();
        let frames: Vec<usize> = (0..self.frames.len()).collect();
        // The terms of all frames of a long walk would need much memory at once. Those of a task are added in their order,
        // whatever the number of threads.
        for frames in frames.chunks(TASKS_AT_ONCE * FRAMES_OF_TASK) {
            let terms = frames.par_chunks(FRAMES_OF_TASK).map_init(Room::default, |room, frames| {
                let mut terms = FrameTerms::new(WHOLE);
                let mut seen = Seen::default();
                for &frame in frames {
                    seen.add(&self.add_frame(unknowns, frame, stage, width, room, &mut terms));
                }
                (frames[0], terms, seen)
            });
            for (first, terms, of_frames) in terms.collect::<Vec<_>>() {
                arrow.add_frames(first, &terms);
                seen.add(&of_frames);
            }
        }
        self.add_priors(unknowns, block, &mut arrow);
        let solution = arrow.solve()?;
        for (x, step) in unknowns.whole.iter_mut().zip(solution.whole.iter()) {
            *x += step;
        }
        let moved = unknowns.frames.iter_mut().flat_map(|frame| &mut frame[..block]);
        moved.zip(solution.frames.iter()).for_each(|(x, step)| *x += step);
        Some((seen, solution))
    }

    /// Adds the normal equations of one frame; returns what was seen.
    fn add_frame(
        &self,
        unknowns: &Unknowns,
        frame: usize,
        stage: Stage,
        width: &Width,
        room: &mut Room,
        terms: &mut FrameTerms,
    ) -> Seen {
        let block = if stage == Stage::Frames { FRAME } else { FRAME_ANGLES };
        let (figure, normal, right, seen) = self.figure_terms(unknowns, frame, width, room);
        slopes(&self.walker.gait, &unknowns.whole, &unknowns.frames[frame], &mut room.slopes);
        // That the heading changes along a route does not place the person on it: who turns does not face right along the
        // way. With that slope, two of ten drawn people on arcs are 8 and 10 cm off instead of 1 and 2.
        if let Some(bend) = self.bend.filter(|_| stage != Stage::Start) {
            let along_m = self.along(&unknowns.frames[frame]);
            for (j, [moved, turned, _]) in bend.terms(along_m).into_iter().enumerate() {
                let slopes = figure_slopes(&figure, [moved, turned]);
                room.slopes.extend(slopes.map(|(q, slope)| (q, WHOLE_BEND + j, slope)));
            }
        }
        room.chain.add(&normal, &right, &room.slopes, block, terms);
        seen
    }

    /// The figure of a frame, the normal equations over its coordinates, and what was seen.
    pub(in super::super) fn figure_terms(
        &self,
        unknowns: &Unknowns,
        frame: usize,
        width: &Width,
        room: &mut Room,
    ) -> (Figure, DMatrix<f64>, DVector<f64>, Seen) {
        let figure = self.figure(unknowns, frame);
        let work = &mut room.work;
        let view = &self.frames[frame].view;
        samples(&figure, &view.others, self.camera, &unknowns.whole, width.spacing_px(), work);
        let mut terms = FigureTerms::new();
        let mut seen = Seen::default();
        let Workspace { samples, motion, profile, .. } = work;
        for sample in samples.iter() {
            let border = match sample.is_outer {
                true => Border::Outer { body_level: self.body_levels[row_of(sample.point.part)] },
                false => Border::Inner,
            };
            let Some(edge) = view.search(sample.point_px, sample.normal, &width.reach, border, profile)
            else {
                continue;
            };
            let importance = importance(sample);
            let [cost, near] = robust(edge.offset_px / width.scale_px);
            seen.count(sample, &edge, importance * cost);
            if edge.strength < LEAST_STEP {
                continue;
            }
            let clear = edge.strength / (edge.strength + CLEAR_STEP);
            let trust = if is_sole(sample) { width.sole } else { 1.0 };
            let weight = importance * trust * near * clear / width.sd_px().powi(2);
            figure.motion(&sample.point, motion);
            let n_j = gradient(self.camera, sample.point.world, sample.normal);
            terms.add(motion.iter().map(|(q, dx)| (*q, n_j.dot(*dx))), edge.offset_px, weight);
        }
        // The head ends where the changes do, but for what hair and the windows of the change detection make of it.
        if let Some((crown, off_px)) = view.crown_px.and_then(|crown_px| self.crown(&figure, crown_px)) {
            let free_px = CROWN_FREE * width.height_px;
            let beyond_px = off_px - off_px.clamp(-free_px, free_px);
            let weight = if beyond_px == 0.0 { 0.0 } else { (CROWN_SD * width.height_px).powi(-2) };
            figure.motion(&crown, motion);
            let n_j = gradient(self.camera, crown.world, DVec2::NEG_Y);
            terms.add(motion.iter().map(|(q, dx)| (*q, n_j.dot(*dx))), beyond_px, weight);
        }
        // The lower foot stands on the ground, whose height is an unknown.
        let lowest = figure.lowest_point();
        figure.motion(&lowest, motion);
        motion.retain(|&(q, _)| width.is_placed || q < BODY);
        motion.push((GROUND, DVec3::NEG_Z));
        let above_m = lowest.world.z - unknowns.whole[WHOLE_GROUND];
        terms.add(motion.iter().map(|(q, dx)| (*q, dx.z)), -above_m, self.ground_precision());
        let (normal, right) = terms.sums();
        (figure, normal, right, seen)
    }

    /// The top of the head, and how far the crown of the changes is above it, pixels.
    pub(super) fn crown(&self, figure: &Figure, crown_px: f64) -> Option<(SurfacePoint, f64)> {
        let head = &figure.posed.cylinders[Part::Head as usize];
        let world = head.centre() + head.world_from_cylinder.matrix3.z_axis * head.half_length;
        let point_px = self.camera.project(world)?;
        let point = SurfacePoint { part: Part::Head, world, radius: DVec3::ZERO, z: 1.0, taper: 0.0 };
        Some((point, point_px.y - crown_px))
    }

    /// A length of the mean person, as a share of the height, and zero of what is no length.
    fn share(&self, unknown: usize) -> f64 {
        let length = length(&self.walker.body.proportions, unknown);
        length.map_or(0.0, |average| average + self.priors[unknown].mean)
    }

    /// An unknown of somebody of the walker's height with the same proportions: of a person who is taller by e, the priors are of
    /// x - (average + mean) e.
    pub(super) fn of_its_size(&self, whole: &[f64], unknown: usize) -> f64 {
        whole[unknown] - self.share(unknown) * excess(whole)
    }

    /// The slopes of a sum of such unknowns.
    pub(super) fn size_terms(&self, sum: &[(usize, f64)]) -> Vec<(usize, f64)> {
        let share: f64 = sum.iter().map(|&(n, factor)| factor * self.share(n)).sum();
        let grown = STATURE.iter().map(|&part| (part, -share)).filter(|_| share != 0.0);
        sum.iter().copied().chain(grown).collect()
    }

    /// Priors of people, of the stated height and of smooth motion.
    pub(super) fn add_priors(&self, unknowns: &Unknowns, block: usize, arrow: &mut Arrow) {
        for (n, prior) in self.priors.iter().enumerate() {
            let off = self.of_its_size(&unknowns.whole, n);
            arrow.add_whole_row(&self.size_terms(&[(n, 1.0)]), prior.mean - off, prior.sd.powi(-2));
        }
        let [thigh, shank] = [THIGH, SHANK].map(|n| self.of_its_size(&unknowns.whole, n));
        let Prior { mean, sd } = THIGH_OVER_SHANK;
        let terms = self.size_terms(&[(THIGH, 1.0), (SHANK, -1.0)]);
        let off = mean - (thigh - shank);
        arrow.add_whole_row(&terms, off, student(off / sd) * sd.powi(-2));
        for (row, precision) in self.bend.iter().flat_map(Bend::priors) {
            let terms: [(usize, f64); BEND] = std::array::from_fn(|j| (WHOLE_BEND + j, row[j]));
            let now: f64 = terms.iter().map(|&(n, factor)| factor * unknowns.whole[n]).sum();
            arrow.add_whole_row(&terms, -now, precision);
        }
        let excess = excess(&unknowns.whole);
        // An unknown height is held until the curves are found: long legs look like bent ones at first.
        let Prior { mean, sd } =
            if block == FRAME { self.excess } else { Prior { mean: 0.0, sd: self.options.height_sd } };
        arrow.add_whole_row(&STATURE.map(|n| (n, 1.0)), mean - excess, sd.powi(-2));
        let joint_of = |unknown: usize| (unknown - FRAME_ANGLES) % JOINTS;
        for (k, frame) in unknowns.frames.iter().enumerate() {
            for (unknown, value) in frame.iter().enumerate().take(block).skip(FRAME_ANGLES) {
                let sd = match joint_of(unknown) {
                    0 | 1 => self.options.frame_sd_rad,
                    _ => 2.0 * self.options.frame_sd_rad,
                };
                arrow.add_row(&[(arrow.index(k, unknown), 1.0)], -value, sd.powi(-2));
            }
        }
        // Velocities change as in a random walk.
        for k in 1..unknowns.frames.len().saturating_sub(1) {
            let time = |k: usize| self.frames[k].time_s;
            let (before_s, after_s) = (time(k) - time(k - 1), time(k + 1) - time(k));
            let (factors, variance_s) = velocity_change(before_s, after_s);
            for (unknown, rate) in RATES.iter().enumerate().take(block) {
                let terms = [0, 1, 2].map(|n| (arrow.index(k - 1 + n, unknown), factors[n]));
                let now: f64 = (0..3).map(|n| factors[n] * unknowns.frames[k - 1 + n][unknown]).sum();
                arrow.add_row(&terms, -now, 1.0 / (rate * rate * variance_s));
            }
        }
    }
}

/// Search width and weights of one step.
#[derive(Debug, Clone)]
pub(in super::super) struct Width {
    pub(super) reach: Reach,
    pub(super) scale_px: f64,
    pub(super) height_px: f64,
    /// What the edge of a sole counts in the step, of what it counts in the cost.
    pub(super) sole: f64,
    /// False in the steps that move the person to the ground. There the ground does not change the lengths of the legs: a person
    /// who starts too low would get short legs, and the feet would be sought in the shanks.
    pub(super) is_placed: bool,
}

impl Width {
    pub(super) fn of_step(n: usize, height_px: f64) -> Self {
        let done = n as f64 / (STEPS.iter().sum::<usize>() - 1) as f64;
        let at = |[first, last]: [f64; 2]| height_px * (first + (last - first) * done);
        let reach = Reach::new(at(REACH).max(LEAST_REACH_PX), BEYOND * height_px);
        Self { reach, scale_px: at(SCALE).max(1.0), height_px, sole: 1.0, is_placed: true }
    }

    pub(super) fn spacing_px(&self) -> f64 {
        (self.height_px / SAMPLES_PER_HEIGHT).max(LEAST_SPACING_PX)
    }

    /// Standard deviation of the edge of one sample.
    fn sd_px(&self) -> f64 {
        (self.height_px / SAMPLES_PER_HEIGHT).max(1.0)
    }
}

/// Working memory of a thread.
#[derive(Debug, Default)]
pub(in super::super) struct Room {
    work: Workspace,
    slopes: Vec<Slope>,
    chain: Chain,
}
