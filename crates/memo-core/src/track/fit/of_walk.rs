//! The fit of a tracked walk: where the problem starts, and a fit to pictures that are given afterwards.

use super::super::height::{BodyHeight, HeightSource};
use super::super::result::{TrackedWalk, smoothed_hypotheses};
use super::super::route::Route;
use super::super::search::{Hypothesis, mirrored};
use super::super::steady;
use super::super::walk::{Step, Walk};
use super::edge_search::View;
use super::views::{Backdrop, Piece};
use super::{FitError, FitFrame, FitOptions, Problem, WalkFit, fit_on_the_spot, fitted_route, straightened};
use crate::calibrate::TiltEstimate;
use crate::estimate::kalman::FilterOptions;
use crate::image::Image;
use crate::model::{Camera, Walker};
use glam::{DVec2, DVec3};

/// A slightly bent route is given up for a straight line unless the line costs more than this factor. Of 29 drawn people who
/// went straight, with and without a height, the tracker bends four routes: one by 15 degrees, which costs 0.98 on the line, and
/// three by 5 to 7, which cost 1.02 to 1.08 and stay. Of 17 who turned by 20 to 40 degrees, 16 cost 1.04 to 1.28; one, of 20
/// degrees, costs 0.93, with lengths of the body nearer to the average.
const STRAIGHT: f64 = 1.02;

/// A walk as it was tracked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tracked<'a> {
    pub walk: &'a Walk,
    pub camera: &'a Camera,
    /// How an assumed camera is tilted; `None` of a given one.
    pub tilt: Option<&'a TiltEstimate>,
    /// The average walker of the person's height.
    pub average: &'a Walker,
    pub height: &'a BodyHeight,
    /// The body height that the first rectangles show, if a height was given, metres.
    pub shown_height_m: Option<f64>,
    pub is_on_treadmill: bool,
    /// Standard deviation of the distance from the camera, metres.
    pub depth_sd_m: f64,
    pub filter: &'a FilterOptions,
}

impl Tracked<'_> {
    /// Fits the person to the views of all frames in which contours show the walk, from the smoothed track. With the
    /// probability by the tracker that the sides are exchanged, they are decided anew.
    pub fn fit(
        &self,
        views: Vec<View>,
        options: &FitOptions,
        p_swapped: Option<f64>,
    ) -> Result<WalkFit, FitError> {
        let mut frames = self.frames(views);
        if frames.is_empty() {
            return Err(FitError::Frontal);
        }
        let tracked_m: Vec<f64> = frames.iter().map(|frame| frame.start.along_m).collect();
        let ends_m = self.ends_m();
        let route = fitted_route(self.camera, self.average, &self.walk.route, ends_m, &mut frames, options);
        let with_tilt = |mut fit: WalkFit| {
            self.tilt.iter().for_each(|tilt| fit.add_tilt(self.camera, tilt));
            fit
        };
        if !self.is_on_treadmill {
            // What the tracker said of the sides, it said of other phases.
            let is_counted = !self.count_steps_again(&route, &mut frames, options);
            let p_swapped = p_swapped.map(|p| if is_counted { p } else { 0.5 });
            let problem = self.problem(&route, &frames, options);
            let glance = problem.glance(0.0)?;
            let bent = problem.fit(glance.gait, p_swapped);
            // A walk goes on along its route and in its distance, so only those of a whole walk are given up; and on the ground of
            // an assumed camera a straight line may be bent, and the distance is the height's.
            let is_compared = p_swapped.is_some() && self.tilt.is_none();
            let line = is_compared.then(|| straightened(&route, &mut frames)).flatten();
            let fit = match line {
                None => bent,
                Some(line) => {
                    let problem = self.problem(&line, &frames, options);
                    let gait = problem.glance(0.0).map(|glance| glance.gait);
                    nearer(gait.and_then(|gait| problem.fit(gait, p_swapped)), bent)
                }
            };
            let fit = match is_compared {
                true => self.at_another_distance(fit, glance, &mut frames, &tracked_m, options),
                false => fit,
            };
            let fit = match p_swapped {
                Some(_) => self.with_height_of_its_own(fit?, glance.gait, &mut frames, &tracked_m, options),
                None => fit?,
            };
            return Ok(with_tilt(self.with_feet(fit)));
        }
        let problem = |route| self.problem(route, &frames, options);
        let route = &route;
        let mirrored = mirrored(&route.at(0.0), self.camera).into();
        let [here, there] = [route, &mirrored].map(|route| problem(route).on_treadmill());
        fit_on_the_spot(&here, &there, p_swapped).map(with_tilt)
    }

    pub(super) fn problem<'a>(
        &'a self,
        route: &'a Route,
        frames: &'a [FitFrame],
        options: &'a FitOptions,
    ) -> Problem<'a> {
        let problem = Problem::new(self.camera, self.average, route, frames, options);
        match self.height.source {
            _ if self.tilt.is_some() => problem.of_assumed_camera(),
            HeightSource::Given => problem,
            _ => problem.of_height(self.height),
        }
    }

    /// The frames to be fitted, in their views, from where the smoothed track has the person.
    pub fn frames(&self, views: Vec<View>) -> Vec<FitFrame> {
        let walker = &self.walk.walker;
        let steps = self.steps();
        let half_torso_m = 0.5 * walker.body.torso_length_m();
        let places = smoothed_hypotheses(steps, self.filter);
        let frame = |((step, place), view): ((&Step, Hypothesis), View)| {
            let height_m = place.height_m + walker.gait.vertical_m(place.phase) - half_torso_m;
            let start = Hypothesis { height_m, ..place };
            FitFrame { time_s: step.time_s, view, visible: step.visible.into(), start }
        };
        let shown = steps.iter().zip(places).filter(|(step, _)| !step.by_feet);
        shown.zip(views).map(frame).collect()
    }

    pub(super) fn steps(&self) -> &[Step] {
        self.walk.steps()
    }

    /// Where the first and the last frame are along the route.
    pub(super) fn ends_m(&self) -> [f64; 2] {
        let steps = self.steps();
        let ends = [steps.first(), steps.last()];
        ends.map(|step| step.map_or(0.0, |step| step.state.along.position))
    }
}

/// The fit on a straight line, unless that on a bent route is clearly nearer to the edges.
fn nearer(line: Result<WalkFit, FitError>, bent: Result<WalkFit, FitError>) -> Result<WalkFit, FitError> {
    match (&line, &bent) {
        (Ok(on_line), Ok(on_bent)) if on_line.quality.cost > STRAIGHT * on_bent.quality.cost => bent,
        (Err(_), _) => bent,
        _ => line,
    }
}

impl WalkFit {
    /// Adds the error of the camera's tilt to the angles against the vertical, those of hip and shoulder: of its turns
    /// about the viewing direction and about the picture's rows, the share about the axis across the way.
    fn add_tilt(&mut self, camera: &Camera, tilt: &TiltEstimate) {
        let level = |axis: DVec3| (camera.rotation.transpose() * axis).truncate().normalize_or_zero();
        let (right, ahead) = (level(DVec3::X), level(DVec3::Z));
        let sd_rad = |heading_rad: f64| {
            let across = DVec2::from_angle(heading_rad).perp();
            (tilt.roll_sd_rad * ahead.dot(across)).hypot(tilt.pitch_sd_rad * right.dot(across))
        };
        for frame in &mut self.frames {
            let sd_rad = sd_rad(frame.heading_rad);
            for [hip, _, _, shoulder, _] in frame.measured.iter_mut().map(|side| &mut side.angles) {
                hip.iter_mut().chain(shoulder).for_each(|[_, sd]| *sd = sd.hypot(sd_rad));
            }
        }
        let all_sd = sd_rad(self.frames[self.frames.len() / 2].heading_rad);
        for [hip, _, _, shoulder, _] in &mut self.mean_sd.angles {
            hip.iter_mut().chain(shoulder).for_each(|sd| *sd = sd.hypot(all_sd));
        }
    }
}

impl TrackedWalk {
    /// The walk with another fit, and with the height that it measured, unless one was given.
    #[must_use]
    pub fn with_fit(self, fit: Result<WalkFit, FitError>) -> Self {
        let measured = fit.as_ref().ok().and_then(|fit| fit.height);
        let height = measured.filter(|_| self.height.source != HeightSource::Given).unwrap_or(self.height);
        Self { height, fit: Some(fit), ..self }
    }

    /// Fits the person again to pictures of one's own: the frames with other options, cleaned frames, or silhouettes
    /// from a segmentation, white before a black `empty` scene. The walk keeps the fit it has.
    ///
    /// `pictures` are those of the rows of the walk, in order, as large as the frames. `empty` is the scene without
    /// people; without it, it is the median of the pictures where the person is elsewhere. Other people are taken for
    /// part of the scene.
    ///
    /// # Errors
    ///
    /// An option is outside its range, the pictures are not those of the walk, or why no person was measured.
    pub fn fit(
        &self,
        pictures: &[Image<u8>],
        empty: Option<&Image<u8>>,
        options: &FitOptions,
    ) -> Result<WalkFit, FitError> {
        options.check()?;
        // 1. The pictures in the camera of the walk.
        let steps = self.steps();
        if pictures.len() != steps.len() {
            return Err(FitError::Pictures { got: pictures.len(), wanted: steps.len() });
        }
        let frame_camera = self.first_camera();
        let wanted = frame_camera.size.map(|side| side as usize);
        let others = |picture: &&Image<u8>| [picture.width(), picture.height()] != wanted;
        if let Some(other) = pictures.iter().chain(empty).find(others) {
            return Err(FitError::PictureSize { got: [other.width(), other.height()], wanted });
        }
        if self.is_frontal {
            return Err(FitError::Frontal);
        }
        let in_canvas = |picture: &Image<u8>, turn: DVec3, beyond: &Image<u8>| {
            steady::turned_back(picture, frame_camera, &self.camera, turn, beyond)
        };
        let is_wide = self.frame_camera.is_some();
        let [wide, high] = self.camera.size.map(|side| side as usize);
        let beyond = is_wide
            .then(|| in_canvas(empty.unwrap_or(&pictures[0]), DVec3::ZERO, &Image::filled(wide, high, 0)).0);
        let beyond = beyond.as_ref().unwrap_or(empty.unwrap_or(&pictures[0]));
        let turned_back = |k: usize| match self.camera_turns.get(k).copied().unwrap_or_default() {
            turn if turn != DVec3::ZERO || is_wide => {
                let (picture, unseen) = in_canvas(&pictures[k], turn, beyond);
                (picture, Some(unseen))
            }
            _ => (pictures[k].clone(), None),
        };
        // 2. The part around the person, and the empty scene behind it.
        let mut backdrop = Backdrop::default();
        let mut pieces = Vec::with_capacity(steps.len());
        for (k, step) in steps.iter().enumerate() {
            let (picture, unseen) = turned_back(k);
            backdrop.push(k, &picture, unseen.as_ref());
            backdrop.occupy(k, step.look.window);
            if step.by_feet {
                continue;
            }
            let piece = Piece::new(k, &picture, step.look.window, Vec::new());
            pieces.push(Piece { crown_px: self.crowns_px.get(k).copied().flatten(), ..piece });
        }
        let views = match empty {
            Some(_) => pieces.into_iter().map(|piece| piece.before(beyond)).collect(),
            None if self.is_on_treadmill => backdrop.views_on_the_spot(pieces.iter()),
            None => backdrop.views(pieces.iter()),
        };
        // 3. The fit, with the sides open as they were to the tracker. A height that was measured in the same pictures
        // tells nothing more about them.
        let height = match self.height.source {
            HeightSource::Given => self.height,
            _ => BodyHeight::POPULATION,
        };
        let tracked = Tracked {
            walk: &self.walk,
            camera: &self.camera,
            tilt: self.tilt.as_ref(),
            average: &self.average,
            height: &height,
            shown_height_m: self.shown_height_m,
            is_on_treadmill: self.is_on_treadmill,
            depth_sd_m: self.depth_sd_m,
            filter: &self.options.filter,
        };
        tracked.fit(views, options, Some(self.walk.swap_probability(&self.options.swap)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::problem::tests::{Drawn, TWO_STEPS, drawn_for};
    use super::*;
    use crate::estimate::kalman::ConstantVelocity;
    use crate::model::Body;
    use crate::track::walk::tests::step_in;
    use crate::track::walk::{Beginning, State};

    /// The fit of a drawn walk whose tracker had all distances from the camera wrong by a factor.
    fn fit_from(factor: f64) -> WalkFit {
        fit_of(factor, 1.0, |phase| phase)
    }

    /// The same of somebody whose given height was wrong by another factor, and whose rectangles show the true one; and the tracker
    /// took phases for others.
    fn fit_of(factor: f64, taller: f64, tracked: impl Fn(f64) -> f64) -> WalkFit {
        let Drawn { camera, walker, route, frames } = drawn_for(TWO_STEPS);
        let shown_m = walker.body.height_m;
        let body = Body::from_height(taller * shown_m).unwrap();
        let walker = Walker { body, ..walker };
        let elapsed_s = frames[1].time_s - frames[0].time_s;
        let speed = |from: f64, to: f64| (to - from) / elapsed_s;
        let [first, second] = [0, 1].map(|k| frames[k].start);
        let beginning = Beginning {
            time_s: frames[0].time_s,
            along_m: factor * first.along_m,
            phase: first.phase,
            speed_mps: factor * speed(first.along_m, second.along_m),
            rate_hz: speed(first.phase, second.phase),
        };
        let mut walk =
            Walk::new(walker.clone(), route.scaled(camera.position().truncate(), factor), beginning);
        let half_torso_m = 0.5 * walker.body.torso_length_m();
        let step = |(k, frame): (usize, &FitFrame)| {
            let Hypothesis { along_m, height_m, phase } = frame.start;
            let phase = tracked(phase);
            let level_m = height_m + half_torso_m - walker.gait.vertical_m(phase);
            let state = State {
                along: ConstantVelocity::new(factor * along_m, beginning.speed_mps, 1e-4, 0.01),
                height: ConstantVelocity::new(level_m, 0.0, 1e-4, 0.0),
                phase: ConstantVelocity::new(phase, beginning.rate_hz, 1e-4, 0.01),
            };
            step_in(k, frame.time_s, state)
        };
        walk.twins[0].steps = frames.iter().enumerate().map(step).collect();
        let tracked = Tracked {
            walk: &walk,
            camera: &camera,
            tilt: None,
            average: &walker,
            height: &BodyHeight::given(walker.body.height_m),
            shown_height_m: Some(shown_m),
            is_on_treadmill: false,
            depth_sd_m: 0.0,
            filter: &FilterOptions::default(),
        };
        let views = frames.into_iter().map(|frame| frame.view).collect();
        tracked.fit(views, &FitOptions::default(), Some(0.1)).unwrap()
    }

    /// Of such a walk the contours show nothing, whatever is known of it.
    #[test]
    fn a_walk_of_feet_alone_is_not_fitted() {
        let walk = crate::track::result::tests::beside(0.0, 0, 30);
        let mut by_feet = walk.clone();
        by_feet.walk.twins.iter_mut().flat_map(|twin| &mut twin.steps).for_each(|step| step.by_feet = true);
        let [width, height] = walk.camera.size.map(|side| side as usize);
        let pictures = vec![Image::filled(width, height, 100u8); 30];
        for is_frontal in [false, true] {
            let walk = TrackedWalk { is_frontal, ..by_feet.clone() };
            assert_eq!(walk.fit(&pictures, None, &FitOptions::default()), Err(FitError::Frontal));
        }
        // What is left of a walk that turned into the line of sight.
        let mut turned = walk;
        turned.walk.twins[0].steps[10..].iter_mut().for_each(|step| step.by_feet = true);
        let kept = |first: usize, last: usize| turned.clone().outside([first, last], 1).unwrap();
        let frame = |k: usize| turned.walk.steps()[k].frame;
        assert!(kept(0, frame(9)).is_frontal && !kept(frame(20), frame(29)).is_frontal);
    }

    #[test]
    fn a_given_height_that_is_wrong_is_measured_whatever_distance_it_led_to() {
        let right_m = drawn_for(TWO_STEPS).walker.body.height_m;
        for (taller, factor) in [(0.9, 0.9), (1.1, 1.0), (1.1, 1.3)] {
            let height = fit_of(factor, taller, |phase| phase).height.unwrap();
            assert!((height.height_m - right_m).abs() < 0.03, "{taller} {factor}: {height:?}");
            assert!(
                BodyHeight::given(taller * right_m).contradicts(&height),
                "{taller} {factor}: {height:?}"
            );
        }
    }

    /// From a phase that stands for a step, a fit has the legs the wrong way round from then on.
    #[test]
    fn a_step_that_the_tracker_left_out_is_counted() {
        let Drawn { frames, .. } = drawn_for(TWO_STEPS);
        let stands_at = frames[frames.len() / 3].start.phase;
        let tracked = |phase: f64| if phase < stands_at { phase } else { stands_at.max(phase - 0.5) };
        let fit = fit_of(1.0, 1.0, tracked);
        for (fitted, frame) in fit.frames.iter().zip(&frames) {
            let off = 2.0 * (fitted.phase - frame.start.phase);
            assert!((off - off.round()).abs() < 0.1, "{} instead of {}", fitted.phase, frame.start.phase);
        }
    }

    /// A sixth too far or too near, the fit alone seeks the feet in the shanks or below the shoes.
    #[test]
    fn a_person_whom_the_tracker_has_at_a_wrong_distance_is_found() {
        let middle = |fit: &WalkFit| fit.frames[fit.frames.len() / 2].torso_centre;
        let here = fit_from(1.0);
        for factor in [0.86, 1.17] {
            let there = fit_from(factor);
            let off_m = middle(&there) - middle(&here);
            assert!(off_m.length() < 0.03, "{factor}: {off_m}");
            assert_eq!(there.quality.verdict(), here.quality.verdict());
        }
    }
}
