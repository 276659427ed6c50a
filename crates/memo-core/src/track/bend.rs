//! People who turn: the route through the rectangles, and the choice between it and the route so far.
//!
//! 1. Each rectangle is a point on the ground, by the rows of feet and crown.
//! 2. The points are smoothed to a curve of slowly changing acceleration.
//! 3. The curve is taken instead of the route so far if the contours of the latest frames are more similar on it.
//!
//! While somebody is followed, the latest frames show the turn from one side only. So when the walk is over, the whole
//! route of a person who turned is smoothed again.

use super::active::Active;
use super::decisions::{EARLY_TURN_GAIN, QUICK_TURN_GAIN, TURN_GAIN};
use super::locate::{Crown, Sighting, foot};
use super::options::TrackerOptions;
use super::route::Route;
use super::search::{Axis, Grid, Hypothesis, PHASE_STEP, POSITION_STEP_M, Scene, search_peak};
use super::walk::{Beginning, FrameEdges, Step, Walk};
use crate::estimate::arrow::{Arrow, velocity_change};
use crate::estimate::smooth::Measured;
use crate::model::Camera;
use glam::{DVec2, DVec3};

/// A turn is looked for after this many further frames.
const EVERY: usize = 10;
/// The quick comparison looks at one frame of so many.
const QUICK_EVERY: usize = 4;
/// Number of last frames on the route so far to which a curve is joined, and the standard deviation of their places,
/// metres.
const ANCHORS: usize = 10;
const ANCHOR_SD_M: f64 = 0.05;
/// How much the acceleration of a person who turns changes in a second, m/s². Twice as much moves headings by about a
/// degree.
const JERK_SD: f64 = 0.25;
/// Standard deviation of the acceleration of people, m/s²: who walks at 1.2 m/s turns by 24 degrees in a second.
const ACCELERATION_SD: f64 = 0.5;
/// Errors of so many neighbouring rectangles are alike: arms and feet stay where they are for some frames.
const LIKE_FRAMES: f64 = 4.0;

/// A place on the route so far.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Anchor {
    time_s: f64,
    place_m: DVec2,
}

impl Active {
    /// Looks for a turn in the latest frames from time to time.
    pub(super) fn turn(&mut self, options: &TrackerOptions) {
        if options.fit.is_none() {
            let longest = options.path_frames.max(options.start_frames) + EVERY;
            self.kept.drain(..self.kept.len().saturating_sub(longest));
        }
        if self.settled && self.steps().len().is_multiple_of(EVERY) {
            self.bend(self.latest(options), TURN_GAIN, true, options);
        }
    }

    /// Looks for a turn when the walk seems to be over; true if it goes on around one.
    pub(super) fn goes_on(&mut self, options: &TrackerOptions) -> bool {
        let before = self.walk.clone();
        let goes_on = self.bend(self.latest(options), TURN_GAIN, false, options) && !self.is_over();
        if !goes_on {
            self.walk = before;
        }
        goes_on
    }

    /// Looks for a turn in the latest frames; true if there is one.
    pub(super) fn has_turned(&mut self, options: &TrackerOptions) -> bool {
        let least_gain = if self.settled { TURN_GAIN } else { EARLY_TURN_GAIN };
        self.bend(self.latest(options), least_gain, false, options)
    }

    /// Smooths the whole route of somebody who turned, from before and after each frame.
    pub(super) fn turned(&mut self, options: &TrackerOptions) {
        if !self.walk.route.is_straight() {
            self.bend(0, 0.0, false, options);
        }
    }

    /// Index of the first kept frame in which a turn is looked for: at first all, then the latest.
    fn latest(&self, options: &TrackerOptions) -> usize {
        let (kept, window) = (self.kept.len(), options.path_frames);
        if self.walk.route.is_straight() && kept <= 2 * window { 0 } else { kept.saturating_sub(window) }
    }

    /// Follows the kept frames from an index on again, on the curve through their sightings, if that gains so much
    /// similarity; true if it does. Unless a `quick` comparison denies it.
    fn bend(&mut self, from: usize, least_gain: f64, is_quick: bool, options: &TrackerOptions) -> bool {
        if self.is_on_treadmill || self.frontal.is_some() {
            return false;
        }
        let end = self.steps().last().map_or(0, |step| step.frame);
        let kept: Vec<_> = self.kept[from..].iter().filter(|(_, edges)| edges.frame <= end).collect();
        let Some(first_s) = kept.first().map(|(_, edges)| edges.time_s) else { return false };
        let sightings: Vec<Sighting> = kept.iter().filter_map(|(sighting, _)| *sighting).collect();
        if sightings.len() < options.start_frames {
            return false;
        }
        // 1. The curve, joined to the route so far.
        let before = self.frames_before(first_s);
        let anchored = &self.steps()[before.saturating_sub(ANCHORS)..];
        let Some(along_m) = anchored.first().map(|step| step.state.along.position) else { return false };
        let route = &self.walk.route;
        let anchors: Vec<Anchor> = anchored[..before.min(ANCHORS)]
            .iter()
            .map(|step| Anchor { time_s: step.time_s, place_m: route.place(step.state.along.position) })
            .collect();
        let crown =
            Crown { height_m: self.walk.walker.level_crown_height_m(), sd_m: self.height.sd_in_camera_m() };
        let points = curve(&anchors, &sightings, &self.camera, &crown);
        let Some(curved) = route.continued(&points, along_m) else { return false };
        // 2. A quick look whether it can be better.
        let frames = || self.steps()[before..].iter().zip(&kept).step_by(QUICK_EVERY);
        let quick = |new: &Route| -> f64 {
            frames().map(|(step, (_, edges))| self.similarity_on(new, step, edges, options)).sum()
        };
        if is_quick && quick(&curved) < (1.0 + QUICK_TURN_GAIN) * quick(route) {
            return false;
        }
        // 3. The frames on the curve.
        let mut walk = self.walk.clone();
        walk.go_back_to(before);
        if before == 0 {
            let Beginning { along_m: at_m, .. } = walk.beginning;
            walk.beginning.along_m = curved.along(route.place(at_m), at_m);
        }
        walk.route = curved;
        kept.iter().for_each(|(_, edges)| walk.follow(edges, &self.camera, &options.walk));
        // 4. The more similar of the two.
        let latest = |walk: &Walk| -> f64 {
            let steps = &walk.twins[walk.best()].steps;
            steps[before..].iter().map(|step| f64::from(step.similarity * step.visible)).sum()
        };
        let is_better = latest(&walk) > (1.0 + least_gain) * latest(&self.walk);
        if is_better {
            self.walk = walk;
        }
        is_better
    }

    /// The best similarity near a followed hypothesis that is moved onto another route, along its ray of sight.
    fn similarity_on(&self, route: &Route, step: &Step, edges: &FrameEdges, options: &TrackerOptions) -> f64 {
        let Hypothesis { along_m, height_m, phase } = step.state.hypothesis();
        let (place, eye) = (self.walk.route.place(along_m), self.camera.position().truncate());
        let near = route.at(route.along(place, along_m));
        let across = near.direction().perp();
        let far = (near.origin - eye).dot(across) / (place - eye).dot(across);
        let along_m = near.along(eye + far * (place - eye));
        let scene = Scene::new(&self.walk.walker, &self.camera, &route.at(along_m));
        let grid = Grid {
            along: Axis::around(along_m, 3.0 * POSITION_STEP_M, POSITION_STEP_M),
            height: Axis::around(height_m, 2.0 * POSITION_STEP_M, POSITION_STEP_M),
            phase: Axis::around(phase, PHASE_STEP, PHASE_STEP),
        };
        let found =
            search_peak(&edges.edges, &scene, &grid, &options.walk.similarity, options.walk.hidden_lines);
        f64::from(found.best_score())
    }
}

/// Points on the ground along a smooth curve from the anchors through the sightings, all in order of time.
fn curve(anchors: &[Anchor], sightings: &[Sighting], camera: &Camera, crown: &Crown) -> Vec<DVec2> {
    // 1. Points along the sight and across it.
    let sight = (camera.rotation.transpose() * DVec3::Z).truncate().normalize_or(DVec2::Y);
    let axes = [sight, sight.perp()];
    let mut times_s: Vec<f64> = anchors.iter().map(|anchor| anchor.time_s).collect();
    let anchored = |axis: DVec2| {
        anchors.iter().map(move |anchor| Measured { value: axis.dot(anchor.place_m), sd: ANCHOR_SD_M })
    };
    let mut places = axes.map(|axis| anchored(axis).collect::<Vec<_>>());
    for sighting in sightings {
        let Ok(foot) = foot(sighting, camera, crown) else { continue };
        times_s.push(sighting.time_s);
        for (axis, places) in axes.iter().zip(&mut places) {
            let value = axis.dot(foot.point_in_world.truncate());
            let variance = axis.extend(0.0).dot(foot.covariance * axis.extend(0.0));
            places.push(Measured { value, sd: (LIKE_FRAMES * variance).sqrt() });
        }
    }
    // 2. Smoothed.
    let [along, across] = places.each_ref().map(|places| smoothed(&times_s, places));
    let points = along.iter().zip(&across);
    points.map(|(along, across)| along * axes[0] + across * axes[1]).collect()
}

/// The values of smallest Σ (x - measured)² / sd² + Σ (change of the acceleration)² / (jerk² time) + mean of
/// acceleration² / sd². Over a short time, measurements do not show an acceleration, and the values lie on a line.
fn smoothed(times_s: &[f64], measured: &[Measured]) -> Vec<f64> {
    let mut arrow = Arrow::banded(measured.len(), 1, 3);
    for (k, Measured { value, sd }) in measured.iter().enumerate() {
        arrow.add_row(&[(k, 1.0)], *value, sd.powi(-2));
    }
    let step_s = |k: usize| times_s[k + 1] - times_s[k];
    // The acceleration is the change of velocity over the time between the middles of the intervals.
    let acceleration = |k: usize| {
        let (factors, lasts_s) = velocity_change(step_s(k), step_s(k + 1));
        factors.map(|factor| factor / lasts_s)
    };
    let count = measured.len().saturating_sub(2);
    for k in 0..count {
        let now = acceleration(k);
        let terms = [0, 1, 2].map(|n| (k + n, now[n]));
        arrow.add_row(&terms, 0.0, ACCELERATION_SD.powi(-2) / count as f64);
        if k + 1 < count {
            let next = acceleration(k + 1);
            let terms =
                [(k, -now[0]), (k + 1, next[0] - now[1]), (k + 2, next[1] - now[2]), (k + 3, next[2])];
            arrow.add_row(&terms, 0.0, 1.0 / (JERK_SD * JERK_SD * step_s(k + 1)));
        }
    }
    arrow.solve().map_or_else(
        || measured.iter().map(|m| m.value).collect(),
        |solution| solution.frames.iter().copied().collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::{BEGINNING, PATH, active, frames_on, options};
    use super::super::search::tests::camera;
    use super::*;

    const FRAME_S: f64 = 0.05;

    /// A route that leaves the straight path in a circle of this radius, metres; positive to the left.
    fn arc(radius_m: f64) -> Route {
        let point = |k: i32| {
            let angle = 0.05 * f64::from(k) / radius_m;
            DVec2::new(-0.6, 0.0) + radius_m * DVec2::new(angle.sin(), 1.0 - angle.cos())
        };
        Route::through(&(0..=80).map(point).collect::<Vec<_>>(), BEGINNING.along_m).unwrap()
    }

    /// A walk followed on the straight path through frames whose contours are on one route and whose rectangles are on
    /// another.
    fn followed(contours: &Route, rectangles: &Route) -> Active {
        let mut active = active(Vec::new());
        active.kept = frames_on(50, FRAME_S, contours, rectangles);
        for (_, edges) in &active.kept {
            active.walk.follow(edges, &active.camera, &options().walk);
        }
        active.settled = true;
        active
    }

    #[test]
    fn rectangles_show_the_curve_of_who_turns() {
        let crown = Crown { height_m: active(Vec::new()).walk.walker.level_crown_height_m(), sd_m: 0.02 };
        for radius_m in [2.5, -2.5, 1e6] {
            let route = arc(radius_m);
            let frames = frames_on(50, FRAME_S, &route, &route);
            let sightings: Vec<Sighting> = frames.iter().filter_map(|(sighting, _)| *sighting).collect();
            let points = curve(&[], &sightings, &camera(), &crown);
            assert_eq!(points.len(), 50);
            for (k, point) in points.iter().enumerate() {
                let truth = route.place(BEGINNING.along_m + 1.2 * FRAME_S * k as f64);
                // Whole pixels of the rectangles are some centimetres in depth, and ends are seen from one side.
                let most_m = if (5..45).contains(&k) { 0.1 } else { 0.15 };
                assert!(point.distance(truth) < most_m, "{radius_m}, {k}: {point} {truth}");
            }
        }
    }

    /// An acceleration that a fifth of a second does not show is none.
    #[test]
    fn places_of_a_short_time_lie_on_a_line() {
        let times_s: Vec<f64> = (0..6).map(|k| 0.04 * f64::from(k)).collect();
        let noise_m = [0.02, -0.03, 0.04, 0.05, -0.02, -0.06];
        let places = times_s.iter().zip(noise_m).map(|(t, off)| Measured { value: 1.2 * t + off, sd: 0.05 });
        let smooth = smoothed(&times_s, &places.collect::<Vec<_>>());
        for three in smooth.windows(3) {
            let acceleration = (three[0] - 2.0 * three[1] + three[2]) / 0.04f64.powi(2);
            assert!(acceleration.abs() < 3.0 * ACCELERATION_SD, "{smooth:?}");
        }
    }

    #[test]
    fn an_anchored_curve_begins_on_the_route_so_far() {
        let crown = Crown { height_m: active(Vec::new()).walk.walker.level_crown_height_m(), sd_m: 0.02 };
        let route = arc(1e6);
        let frames = frames_on(40, FRAME_S, &route, &route);
        let sightings: Vec<Sighting> = frames[10..].iter().filter_map(|(sighting, _)| *sighting).collect();
        // Half a metre farther than the rectangles say.
        let anchor = |k: usize| Anchor {
            time_s: FRAME_S * k as f64,
            place_m: route.place(BEGINNING.along_m + 1.2 * FRAME_S * k as f64) + 0.5 * DVec2::Y,
        };
        let anchors: Vec<Anchor> = (0..10).map(anchor).collect();
        let points = curve(&anchors, &sightings, &camera(), &crown);
        assert!(points[5].distance(anchors[5].place_m) < 0.05);
        assert!(points[39].y < 0.25, "{}", points[39]);
    }

    #[test]
    fn a_curve_that_rectangles_and_contours_show_is_taken() {
        let route = arc(-2.5);
        let mut turning = followed(&route, &route);
        let straight = turning.walk.clone();
        turning.turn(&options());
        assert!(!turning.walk.route.is_straight());
        assert_eq!(turning.steps().len(), 50);
        assert!(turning.walk.twins[0].similarity_sum > straight.twins[0].similarity_sum);
        for step in &turning.steps()[10..40] {
            let path = turning.walk.route.at(step.state.along.position);
            let along_m = BEGINNING.along_m + 1.2 * step.time_s;
            let off_rad = path.heading_rad - route.at(along_m).heading_rad;
            assert!(off_rad.abs() < 0.15, "{}: {off_rad}", step.frame);
            let place = turning.walk.route.place(step.state.along.position);
            assert!(place.distance(route.place(along_m)) < 0.12, "{}", step.frame);
        }
        // The sums are those of the steps that are left.
        let sum: f64 = turning.walk.twins[0].steps.iter().map(|s| f64::from(s.similarity * s.visible)).sum();
        assert!((sum - turning.walk.twins[0].similarity_sum).abs() < 1e-9);
    }

    #[test]
    fn a_curve_that_only_the_rectangles_show_is_not_taken() {
        let mut straight = followed(&PATH.into(), &arc(2.5));
        let before = straight.walk.clone();
        straight.turn(&options());
        assert!(!straight.has_turned(&options()));
        assert_eq!(straight.walk, before);
    }

    #[test]
    fn nobody_turns_on_a_treadmill_or_before_there_are_enough_rectangles() {
        let route = arc(2.5);
        let mut on_the_spot = followed(&route, &route);
        on_the_spot.is_on_treadmill = true;
        let mut unseen = followed(&route, &route);
        unseen.kept.iter_mut().skip(4).for_each(|(sighting, _)| *sighting = None);
        for mut active in [on_the_spot, unseen] {
            let before = active.walk.clone();
            assert!(!active.has_turned(&options()));
            active.turned(&options());
            assert_eq!(active.walk, before);
        }
    }
}
