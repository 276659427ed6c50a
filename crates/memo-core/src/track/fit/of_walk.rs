//! The fit of a tracked walk: where the problem starts, and a fit to pictures that are given afterwards.

use super::super::decisions::{ACROSS_SD_M, COMMON_PHASE_SD};
use super::super::height::{BodyHeight, HeightSource};
use super::super::result::{TrackedWalk, smoothed_hypotheses};
use super::super::search::{Hypothesis, mirrored};
use super::super::steady;
use super::super::walk::{Step, Walk};
use super::contacts::Contact;
use super::edge_search::View;
use super::views::{Backdrop, Piece};
use super::{
    FitError, FitFrame, FitOptions, FitVerdict, FittedFrame, Problem, WalkFit, fit_on_the_spot, fitted_route,
};
use crate::calibrate::TiltEstimate;
use crate::estimate::kalman::FilterOptions;
use crate::image::Image;
use crate::model::{Camera, Walker};
use glam::{DVec2, DVec3};

/// Number of frames beside those of the feet whose places and phases these go on with.
const SEAM: usize = 8;

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
        let ends_m = self.ends_m();
        let route = &fitted_route(self.camera, self.average, &self.walk.route, ends_m, &mut frames, options);
        let problem = |route| {
            let problem = Problem::new(self.camera, self.average, route, &frames, options);
            match self.height.source {
                _ if self.tilt.is_some() => problem.of_assumed_camera(),
                HeightSource::Given => problem,
                _ => problem.of_height(self.height),
            }
        };
        let with_tilt = |mut fit: WalkFit| {
            self.tilt.iter().for_each(|tilt| fit.add_tilt(self.camera, tilt));
            fit
        };
        if !self.is_on_treadmill {
            let mut fit = problem(route).fit(p_swapped)?;
            if p_swapped.is_some() {
                fit = self.with_height_of_its_own(fit, problem(route));
            }
            return Ok(with_tilt(self.with_feet(fit)));
        }
        let mirrored = mirrored(&route.at(0.0), self.camera).into();
        let [here, there] = [route, &mirrored].map(|route| problem(route).on_treadmill());
        fit_on_the_spot(&here, &there, p_swapped).map(with_tilt)
    }

    /// The same with the height that the picture shows if the given one is far from it: the fit near the given height
    /// tells that it is wrong, but not by how much.
    fn with_height_of_its_own(&self, fit: WalkFit, problem: Problem<'_>) -> WalkFit {
        let is_given = self.height.source == HeightSource::Given && self.tilt.is_none();
        let is_off = fit.quality.verdict() != FitVerdict::Well
            || fit.height.is_some_and(|seen| self.height.contradicts(&seen));
        let height = || problem.of_height(&BodyHeight::POPULATION).fit(None).ok()?.height;
        match (is_given && is_off).then(height).flatten() {
            Some(seen) => WalkFit { height: Some(seen), ..fit },
            None => fit,
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

    fn steps(&self) -> &[Step] {
        &self.walk.twins[self.walk.best()].steps
    }

    /// Where the first and the last frame are along the route.
    fn ends_m(&self) -> [f64; 2] {
        let steps = self.steps();
        let ends = [steps.first(), steps.last()];
        ends.map(|step| step.map_or(0.0, |step| step.state.along.position))
    }

    /// The fit with the frames in which the feet alone show the walk: there the person goes on along the fitted route as
    /// the feet say, with the person's own curves, of which nothing is measured.
    fn with_feet(&self, fit: WalkFit) -> WalkFit {
        let steps = self.steps();
        if steps.iter().all(|step| !step.by_feet) {
            return fit;
        }
        let walker = fit.walker();
        let shown: Vec<usize> = (0..steps.len()).filter(|&k| !steps[k].by_feet).collect();
        // 1. What the fit says differs from what the tracker says, on either side of the frames.
        let near_m = |k: usize| {
            let along_m = steps[k].state.along.position;
            let off_m = fit.frames[0].along_m - steps[shown[0]].state.along.position;
            fit.route.along(self.walk.route.place(along_m), along_m + off_m)
        };
        let off = |n: usize| {
            let (frame, step) = (&fit.frames[n], &steps[shown[n]]);
            [frame.along_m - near_m(shown[n]), frame.phase - step.state.phase.position]
        };
        let mean = |range: std::ops::Range<usize>| {
            let count = range.len() as f64;
            range.map(off).fold([0.0; 2], |sum, off| [0, 1].map(|i| sum[i] + off[i] / count))
        };
        let height_m = |n: usize| fit.frames[n].torso_centre.z - walker.gait.vertical_m(fit.frames[n].phase);
        let level_m = (0..shown.len()).map(height_m).sum::<f64>() / shown.len() as f64;
        // 2. The frames with it.
        let frame = |k: usize| {
            let after = shown.partition_point(|&other| other < k);
            if shown.get(after) == Some(&k) {
                return fit.frames[after].clone();
            }
            let before = (after > 0).then(|| mean(after.saturating_sub(SEAM)..after));
            let behind = (after < shown.len()).then(|| mean(after..(after + SEAM).min(shown.len())));
            let [along_off_m, phase_off] = match (before, behind) {
                (Some(a), Some(b)) => {
                    let time_s = |k: usize| steps[k].time_s;
                    let (from, to) = (time_s(shown[after - 1]), time_s(shown[after]));
                    let t = (time_s(k) - from) / (to - from);
                    // The two may be half a cycle apart, if the feet lost count.
                    [0, 1].map(|i| a[i] + t * (b[i] - a[i]))
                }
                (a, b) => a.or(b).unwrap_or_default(),
            };
            let state = &steps[k].state;
            let (along_m, phase) = (near_m(k) + along_off_m, state.phase.position + phase_off);
            let path = fit.route.at(along_m);
            let nearest = &fit.frames[after.min(shown.len() - 1)];
            FittedFrame {
                torso_centre: path.point(along_m, level_m + walker.gait.vertical_m(phase)),
                heading_rad: path.heading_rad,
                along_m,
                phase,
                posture: walker.gait.posture(phase.rem_euclid(1.0), &walker.style),
                measured: Default::default(),
                sd: [
                    state.along.position_sd().hypot(self.depth_sd_m),
                    nearest.sd[1].hypot(ACROSS_SD_M),
                    nearest.sd[2],
                    state.phase.position_sd().hypot(COMMON_PHASE_SD),
                ],
            }
        };
        let frames = (0..steps.len()).map(frame).collect();
        // 3. Contacts are those of feet that were seen as a whole.
        let is_shown = |contact: &Contact| {
            let after = steps.partition_point(|step| step.time_s < contact.time_s);
            let near = [after.saturating_sub(1), after.min(steps.len() - 1)];
            near.iter().all(|&k| !steps[k].by_feet)
        };
        let contacts = fit.contacts.iter().copied().filter(is_shown).collect();
        WalkFit { frames, contacts, ..fit }
    }
}

impl WalkFit {
    /// Adds the error of the camera's tilt to the angles against the vertical, those of hip and shoulder: of its turns
    /// about the viewing direction and about the picture's rows, the share about the axis across the way.
    fn add_tilt(&mut self, camera: &Camera, tilt: &TiltEstimate) {
        let level = |axis: DVec3| (camera.rotation.transpose() * axis).truncate().normalize_or_zero();
        let (right, ahead) = (level(DVec3::X), level(DVec3::Z));
        for frame in &mut self.frames {
            let across = DVec2::from_angle(frame.heading_rad).perp();
            let sd_rad = (tilt.roll_sd_rad * ahead.dot(across)).hypot(tilt.pitch_sd_rad * right.dot(across));
            for [hip, _, _, shoulder, _] in frame.measured.iter_mut().map(|side| &mut side.angles) {
                hip.iter_mut().chain(shoulder).for_each(|[_, sd]| *sd = sd.hypot(sd_rad));
            }
        }
    }
}

impl TrackedWalk {
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
        let wanted = self.camera.size.map(|side| side as usize);
        let others = |picture: &&Image<u8>| [picture.width(), picture.height()] != wanted;
        if let Some(other) = pictures.iter().chain(empty).find(others) {
            return Err(FitError::PictureSize { got: [other.width(), other.height()], wanted });
        }
        if self.is_frontal {
            return Err(FitError::Frontal);
        }
        let turned_back = |k: usize| match self.camera_turns.get(k) {
            Some(turn) if *turn != DVec3::ZERO => {
                steady::turned_back(&pictures[k], &self.camera, *turn, empty.unwrap_or(&pictures[0]))
            }
            _ => pictures[k].clone(),
        };
        // 2. The part around the person, and the empty scene behind it.
        let mut backdrop = Backdrop::default();
        let mut pieces = Vec::with_capacity(steps.len());
        for (k, step) in steps.iter().enumerate() {
            let picture = turned_back(k);
            backdrop.push(k, &picture);
            backdrop.occupy(k, step.look.window);
            if step.by_feet {
                continue;
            }
            let piece = Piece::new(k, &picture, step.look.window, Vec::new());
            pieces.push(Piece { crown_px: self.crowns_px.get(k).copied().flatten(), ..piece });
        }
        let views = match empty {
            Some(empty) => pieces.into_iter().map(|piece| piece.before(empty)).collect(),
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
            is_on_treadmill: self.is_on_treadmill,
            depth_sd_m: self.depth_sd_m,
            filter: &self.options.filter,
        };
        tracked.fit(views, options, Some(self.walk.swap_probability(&self.options.swap)))
    }
}
