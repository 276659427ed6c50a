//! Where else a fit is started if it does not fit well: at other distances from the camera, and with another body height.

use super::super::height::HeightSource;
use super::super::route::Route;
use super::super::search::Hypothesis;
use super::of_walk::Tracked;
use super::problem::{Glance, StartGait};
use super::{FitError, FitFrame, FitOptions, FitVerdict, Problem, WalkFit, fitted_route};
use crate::model::{Body, Walker};

/// Other distances from the camera at which a fit is tried, as factors of the tracker's: of somebody whom the first one fits in
/// part, and also those of somebody whom it fits poorly or not at all.
const DISTANCES: [f64; 2] = [0.85, 1.16];
const DISTANCES_OF_POORLY: [f64; 4] = [0.85, 0.92, 1.08, 1.16];
/// A fit at another distance is taken if it costs less than this factor of the one at the tracker's, which fits in part or
/// poorly. Of people whom the tracker has 0.5 m and more too far away, it costs 0.62 to 0.80 of it, and 0.94 of one who fits poorly.
/// Of those who are at most 13 cm off, it costs 0.89 to 0.99; most of them come out nearer to the truth, but a filmed woman, with
/// 0.95, has the ankles 13 instead of 6 pixels off.
const LIKELIER: f64 = 0.9;
const LIKELIER_THAN_POORLY: f64 = 0.955;

/// Factors of the tracker's distance at which somebody of another height than the given one starts: taller than the truth by a
/// tenth, the tracker has that person up to a third too far away.
const FARTHER: [f64; 7] = [0.65, 0.75, 0.84, 0.92, 1.0, 1.09, 1.2];
/// As many of these starts are followed to the end.
const LIKELIEST: usize = 2;
/// A given height from which that of the rectangles differs by less than this share is not doubted because of a fit in part.
const AS_TALL: f64 = 0.03;

impl Tracked<'_> {
    /// The fit at another distance from the camera, if it is clearly likelier, for somebody whom a fit at the tracker's distance
    /// does not fit well. The tracker keeps the distance of the first frames, where others may have hidden the feet. A fit finds
    /// the distance from starts up to about a tenth off; from farther ones it seeks the feet in the shanks or below the shoes.
    /// `glance` is that at the tracker's distance, and `tracked_m` are the tracker's places of the frames along its route.
    pub(super) fn at_another_distance(
        &self,
        here: Result<WalkFit, FitError>,
        glance: Glance,
        frames: &mut [FitFrame],
        tracked_m: &[f64],
        options: &FitOptions,
    ) -> Result<WalkFit, FitError> {
        let verdict = match &here {
            Ok(fit) => fit.quality.verdict(),
            Err(FitError::Misfit { .. }) => FitVerdict::Poorly,
            Err(_) => return here,
        };
        let (distances, most_cost) = match verdict {
            FitVerdict::Well => return here,
            FitVerdict::InPart => (&DISTANCES[..], LIKELIER),
            FitVerdict::Poorly => (&DISTANCES_OF_POORLY[..], LIKELIER_THAN_POORLY),
        };
        let moved = |frames: &mut [FitFrame], factor: f64| {
            for (frame, along_m) in frames.iter_mut().zip(tracked_m) {
                frame.start.along_m = factor * along_m;
            }
            self.scaled_route(factor, self.average, frames, options)
        };
        // 1. Where a few of the frames are likeliest.
        let glance_at = |&factor: &f64| {
            let route = moved(frames, factor);
            Some((factor, self.problem(&route, frames, options).glance(0.0).ok()?))
        };
        let glances: Vec<_> = distances.iter().filter_map(glance_at).collect();
        let likeliest = glances.into_iter().min_by(|(_, a), (_, b)| a.total_cost.total_cmp(&b.total_cost));
        let is_likelier = |there: &(f64, Glance)| there.1.total_cost < glance.total_cost;
        let Some((factor, Glance { gait, .. })) = likeliest.filter(is_likelier) else { return here };
        // 2. All frames there. What the tracker said of the sides, contours said that lay elsewhere.
        let route = moved(frames, factor);
        let problem = self.problem(&route, frames, options);
        let there = problem.fit(gait, Some(0.5));
        let is_likelier = match (&here, &there) {
            (Ok(here), Ok(there)) => there.quality.total_cost < most_cost * here.quality.total_cost,
            (Err(_), Ok(there)) => there.quality.verdict() != FitVerdict::Poorly,
            (_, Err(_)) => false,
        };
        if is_likelier { there } else { here }
    }

    /// The same with the height that the picture shows if the given one is far from it: the fit near the given height
    /// tells that it is wrong, but not by how much. One whose soles are not on the ground tells nothing else.
    ///
    /// The tracker believed the given height, so somebody taller or smaller starts at other distances too.
    pub(super) fn with_height_of_its_own(
        &self,
        fit: WalkFit,
        gait: StartGait,
        frames: &mut [FitFrame],
        tracked_m: &[f64],
        options: &FitOptions,
    ) -> WalkFit {
        let shown = self.shown_height_m.map(|shown_m| shown_m / self.height.height_m);
        let is_shown_right = shown.is_some_and(|taller| (taller - 1.0).abs() < AS_TALL);
        let is_off = fit.height.is_none_or(|seen| self.height.contradicts(&seen))
            || fit.quality.verdict() != FitVerdict::Well && !is_shown_right;
        if self.height.source != HeightSource::Given || self.tilt.is_some() || !is_off {
            return fit;
        }
        // 1. A few of the frames from the height of the rectangles at several distances, and from the given one.
        let tracked: Vec<Hypothesis> = frames.iter().map(|frame| frame.start).collect();
        let moved = |frames: &mut [FitFrame], [taller, farther]: [f64; 2]| {
            let body = Body::from_height(taller * self.average.body.height_m).ok()?;
            for ((frame, along_m), start) in frames.iter_mut().zip(tracked_m).zip(&tracked) {
                frame.start = Hypothesis {
                    along_m: farther * along_m,
                    height_m: taller * start.height_m,
                    phase: start.phase,
                };
            }
            let average = Walker { body, ..self.average.clone() };
            let route = self.scaled_route(farther, &average, frames, options);
            Some((average, route))
        };
        let starts = FARTHER.map(|farther| [shown.unwrap_or(1.0), farther]).into_iter().chain([[1.0; 2]]);
        let mut costs = Vec::new();
        for start in starts {
            let Some((average, route)) = moved(frames, start) else { continue };
            let problem = Problem::new(self.camera, &average, &route, frames, options).of_any_height();
            costs.extend(problem.few_cost(gait).map(|cost| (cost, start)));
        }
        costs.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        // 2. All frames from the likeliest ones.
        let mut fits = Vec::new();
        for (_, start) in costs.into_iter().take(LIKELIEST) {
            let Some((average, route)) = moved(frames, start) else { continue };
            let problem = Problem::new(self.camera, &average, &route, frames, options).of_any_height();
            fits.extend(problem.fit(gait, None));
        }
        let best = fits.into_iter().min_by(|a, b| a.quality.total_cost.total_cmp(&b.quality.total_cost));
        match best.and_then(|best| best.height) {
            Some(seen) => WalkFit { height: Some(seen), ..fit },
            None => fit,
        }
    }

    /// The tracker's route that much farther away, as it is fitted, through the starts of the frames.
    fn scaled_route(
        &self,
        farther: f64,
        average: &Walker,
        frames: &mut [FitFrame],
        options: &FitOptions,
    ) -> Route {
        let route = self.walk.route.scaled(self.camera.position().truncate(), farther);
        fitted_route(self.camera, average, &route, self.ends_m().map(|end| farther * end), frames, options)
    }
}
