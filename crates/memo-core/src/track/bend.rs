//! People who turn: the route through the rectangles, and the choice between it and the route so far.
//!
//! 1. The rectangles are smoothed to a curve on the ground ([`Trail`]), by both rows and, before a given camera, by the soles'
//!    alone; the one with the more similar contours is looked at.
//! 2. The curve is taken instead of the route so far if the contours of the latest frames are more similar on it.
//! 3. Along the line of sight, contours tell less. Rectangles turn clearly if a curve explains them better than a straight
//!    path on which the person may slow down, stop or set off. Then the curve is taken of somebody followed by the feet if the
//!    contours are not less similar on it, and of somebody whose walk would be over if contours and rectangles together are likelier.
//!
//! While somebody is followed, the latest frames show the turn from one side only. So when the walk is over, the whole
//! route of a person who turned is smoothed again, or given up for a straight path if all rectangles together do not turn.

use super::active::Active;
use super::decisions::{CLEAR_TURN, EARLY_TURN_GAIN, QUICK_TURN_GAIN, SLIGHT_TURN_RAD, TURN_GAIN};
use super::frontal::Frontal;
use super::locate::{Rows, Sighting};
use super::options::TrackerOptions;
use super::rate::lasting;
use super::route::Route;
use super::search::{Axis, Grid, Hypothesis, PHASE_STEP, POSITION_STEP_M, Path, Scene, search_peak};
use super::swap::log_odds;
use super::trail::{Anchor, CORNER_JERK_SD, JERK_SD, Trail};
use super::walk::{FrameEdges, Step, Walk};
use glam::DVec2;

/// A turn is looked for after this many further frames, here and below at the usual rate.
const EVERY: usize = 10;
/// The quick comparison looks at one frame of so many.
const QUICK_EVERY: usize = 4;
/// Number of last frames on the route so far to which a curve is joined.
const ANCHORS: usize = 10;

/// When a turn is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum When {
    /// From time to time, after a quick comparison.
    Regularly,
    /// Before somebody else is started beside the person.
    BesideOthers,
    /// When the walk seems to be over.
    Over,
    /// In the whole of a walk that is over.
    Ended,
}

impl Active {
    /// Looks for a turn in the latest frames from time to time.
    pub(super) fn turn(&mut self, options: &TrackerOptions) {
        let every = lasting(EVERY, self.every_s());
        if options.fit.is_none() {
            let longest = options.path_frames.max(options.start_frames) + every;
            self.kept.drain(..self.kept.len().saturating_sub(longest));
        }
        if self.settled && self.steps().len().is_multiple_of(every) {
            let (first, latest) = (self.latest(options), self.kept.len().saturating_sub(options.path_frames));
            let has_turned = self.bend(first, When::Regularly, JERK_SD, options);
            // Contours on a curve through all frames may tell less than those in the latest ones.
            if !has_turned && first < latest && self.rectangles_turn(first) {
                self.bend(latest, When::Regularly, JERK_SD, options);
            }
        }
    }

    /// True if the rectangles of somebody on a straight path, from a kept frame on, turn clearly.
    fn rectangles_turn(&self, from: usize) -> bool {
        let sightings: Vec<Sighting> =
            self.kept[from..].iter().filter_map(|(sighting, _)| *sighting).collect();
        Trail::new(self.rows, &[], &sightings, &self.camera, &self.crown()).turn_gain() > CLEAR_TURN
    }

    /// Looks for a turn when the walk seems to be over, also around a corner; true if it goes on around one.
    pub(super) fn goes_on(&mut self, options: &TrackerOptions) -> bool {
        let before = (self.walk.clone(), self.frontal.clone(), self.rows);
        for jerk_sd in [JERK_SD, CORNER_JERK_SD] {
            if self.bend(self.latest(options), When::Over, jerk_sd, options) && !self.is_over() {
                return true;
            }
            (self.walk, self.frontal, self.rows) = before.clone();
        }
        false
    }

    /// Looks for a turn in the latest frames; true if there is one.
    pub(super) fn has_turned(&mut self, options: &TrackerOptions) -> bool {
        self.bend(self.latest(options), When::BesideOthers, JERK_SD, options)
    }

    /// Smooths the whole route of somebody who turned, from before and after each frame.
    pub(super) fn turned(&mut self, options: &TrackerOptions) {
        if !self.walk.route.is_straight() {
            for jerk_sd in [JERK_SD, CORNER_JERK_SD] {
                self.bend(0, When::Ended, jerk_sd, options);
            }
            self.turn_back(options);
        }
    }

    /// Gives up a curve that only contours show: all rectangles of the walk together do not turn. Contours that are unlike the
    /// model's, as of somebody who walks very slowly, may be more similar on any other route.
    fn turn_back(&mut self, options: &TrackerOptions) {
        let steps = self.steps();
        let (Some(first), Some(last)) = (steps.first(), steps.last()) else { return };
        let (along_m, count) = (first.state.along.position, steps.len());
        let headings = steps.iter().map(|step| self.walk.route.at(step.state.along.position).direction());
        let middle = self.walk.route.at(steps[steps.len() / 2].state.along.position).direction();
        let (least, most) = headings.fold((0.0f64, 0.0f64), |(least, most), ahead| {
            let off_rad = middle.angle_to(ahead);
            (least.min(off_rad), most.max(off_rad))
        });
        let is_whole = self.kept.first().is_some_and(|(_, edges)| edges.frame == first.frame);
        if !is_whole || most - least < SLIGHT_TURN_RAD || steps.iter().any(|step| step.by_feet) {
            return;
        }
        let last = last.frame;
        let seen = self.kept.iter().filter(|(_, edges)| edges.frame <= last);
        let sightings: Vec<Sighting> = seen.filter_map(|(sighting, _)| *sighting).collect();
        let trail = Trail::new(self.rows, &[], &sightings, &self.camera, &self.crown());
        let places = trail.straight();
        let (Some(from), Some(to)) = (places.first(), places.last()) else { return };
        if trail.turn_gain() < CLEAR_TURN {
            let heading_rad = (*to - *from).to_angle();
            let origin = *from - along_m * DVec2::from_angle(heading_rad);
            // Feet show the way of those alone who turn.
            self.frontal = None;
            self.follow_on(&Path { origin, heading_rad }.into(), 0..count, last, &options.walk);
        }
    }

    /// Index of the first kept frame in which a turn is looked for: at first all, then the latest.
    fn latest(&self, options: &TrackerOptions) -> usize {
        let (kept, window) = (self.kept.len(), options.path_frames);
        if self.walk.route.is_straight() && kept <= 2 * window { 0 } else { kept.saturating_sub(window) }
    }

    /// The relative gain of similarity that a curve needs: none of somebody followed by the feet whose rectangles turn
    /// clearly, as contours tell less.
    fn least_gain(&self, when: When, is_clear: bool) -> f64 {
        match when {
            _ if is_clear && self.is_frontal() => 0.0,
            When::BesideOthers if !self.settled => EARLY_TURN_GAIN,
            _ => TURN_GAIN,
        }
    }

    /// Follows the kept frames from an index on again, on the curve through their sightings, if that is better; true if
    /// it is.
    fn bend(&mut self, from: usize, when: When, jerk_sd: f64, options: &TrackerOptions) -> bool {
        if self.is_on_treadmill {
            return false;
        }
        let (end, end_s) = self.steps().last().map_or((0, 0.0), |step| (step.frame, step.time_s));
        let kept: Vec<_> = self.kept[from..].iter().filter(|(_, edges)| edges.frame <= end).collect();
        let Some(first_s) = kept.first().map(|(_, edges)| edges.time_s) else { return false };
        let sightings: Vec<Sighting> = kept.iter().filter_map(|(sighting, _)| *sighting).collect();
        if sightings.len() < options.start_frames.min(options.path_frames) {
            return false;
        }
        // 1. The curve, joined to the route so far, by the rows with which the contours are more similar.
        let before = self.frames_before(first_s);
        let most = lasting(ANCHORS, self.every_s());
        let anchored = &self.steps()[before.saturating_sub(most)..];
        let Some(along_m) = anchored.first().map(|step| step.state.along.position) else { return false };
        let route = &self.walk.route;
        let anchors: Vec<Anchor> = anchored[..before.min(most)]
            .iter()
            .map(|step| Anchor { time_s: step.time_s, place_m: route.place(step.state.along.position) })
            .collect();
        let quick_every = lasting(QUICK_EVERY, self.every_s());
        let frames = || self.steps()[before..].iter().zip(&kept).step_by(quick_every);
        let quick = |new: &Route| -> f64 {
            frames().map(|(step, (_, edges))| self.similarity_on(new, step, edges, options)).sum()
        };
        // Of a straight route from its beginning on, nothing is left.
        let onto = |points: &[DVec2]| match before {
            0 if route.is_straight() => Route::through(points, along_m),
            _ => route.continued(points, along_m),
        };
        let by = |rows: &Rows| {
            let trail = Trail::new(*rows, &anchors, &sightings, &self.camera, &self.crown());
            let curved = onto(&trail.curve(jerk_sd))?;
            let similarity = quick(&curved);
            // Other rows also show another distance, which is no turn.
            let is_turn = *rows == self.rows || {
                let straight = onto(&trail.straight());
                straight.is_none_or(|straight| similarity > (1.0 + QUICK_TURN_GAIN) * quick(&straight))
            };
            is_turn.then_some((*rows, trail, curved, similarity))
        };
        let ways = if options.camera.is_some() { &[Rows::Both, Rows::Soles][..] } else { &[Rows::Both] };
        // Both rows together are more accurate where none is wrong.
        let least_gain = if when == When::Ended { TURN_GAIN } else { 0.0 };
        let better = |best: (_, _, _, f64), next: (_, _, _, f64)| {
            if next.3 > (1.0 + least_gain) * best.3 { next } else { best }
        };
        let best = ways.iter().filter_map(by).reduce(better);
        let Some((rows, trail, curved, similarity)) = best else { return false };
        let turn_gain = trail.turn_gain();
        let is_clear = turn_gain > CLEAR_TURN;
        // 2. A quick look whether it can be better.
        let is_quick = when == When::Regularly && !(is_clear && self.is_frontal());
        if is_quick && similarity < (1.0 + QUICK_TURN_GAIN) * quick(route) {
            return false;
        }
        // 3. The frames on the curve.
        let (walk, frontal) = self.on_route(&curved, before, options);
        // 4. The more similar of the two.
        let latest = |walk: &Walk| -> f64 {
            walk.steps()[before..].iter().map(|step| f64::from(step.similarity * step.visible)).sum()
        };
        let is_more_similar = latest(&walk) > (1.0 + self.least_gain(when, is_clear)) * latest(&self.walk);
        // The rectangles of who stops go anywhere, as changes vanish, but then the contours do not follow them.
        let contours = || log_odds(latest(&walk), latest(&self.walk), end_s - first_s, &options.walk.swap);
        let is_better = match when {
            When::Ended => self.log_odds_of(&walk, &trail, options) > 0.0,
            When::Over => is_more_similar || is_clear && turn_gain + contours() > 0.0,
            When::Regularly | When::BesideOthers => is_more_similar,
        };
        if is_better {
            (self.walk, self.frontal, self.rows) = (walk, frontal, rows);
        }
        is_better
    }

    /// Log odds of the same walk on another route: where contours show the walk, by the similarities, and where the feet
    /// show it, by the rectangles.
    fn log_odds_of(&self, other: &Walk, trail: &Trail, options: &TrackerOptions) -> f64 {
        let [here, there] = [&self.walk, other].map(Walk::steps);
        let (mut similarity, mut lasts_s, mut odds) = ([0.0; 2], 0.0, 0.0);
        for (k, (a, b)) in here.iter().zip(there).enumerate() {
            if a.by_feet || b.by_feet {
                let place = |walk: &Walk, step: &Step| walk.route.place(step.state.along.position);
                odds += trail.cost(a.time_s, place(&self.walk, a)) - trail.cost(b.time_s, place(other, b));
            } else {
                let of = |step: &Step| f64::from(step.similarity * step.visible);
                similarity = [similarity[0] + of(a), similarity[1] + of(b)];
                lasts_s += here.get(k + 1).map_or(0.0, |next| next.time_s - a.time_s);
            }
        }
        odds + log_odds(similarity[1], similarity[0], lasts_s, &options.walk.swap)
    }

    /// The walk on another route from the step `before` on: by the feet where it goes along the line of sight of a
    /// calibrated camera.
    fn on_route(
        &mut self,
        route: &Route,
        before: usize,
        options: &TrackerOptions,
    ) -> (Walk, Option<Frontal>) {
        let as_it_was = (self.walk.clone(), self.frontal.clone());
        if options.camera.is_some() {
            let mut frontal = self.frontal.take().unwrap_or_else(|| self.recorded()).moved_to(route);
            frontal.paces.truncate(self.steps().len());
            self.frontal = Some(frontal);
        }
        let last = self.steps().last().map_or(0, |step| step.frame);
        self.follow_on(route, before..self.steps().len(), last, &options.walk);
        let found = (self.walk.clone(), self.frontal.take());
        (self.walk, self.frontal) = as_it_was;
        found
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

#[cfg(test)]
mod tests {
    use super::super::active::tests::{BEGINNING, PATH, active, frames_on, options};
    use super::super::search::tests::camera;
    use super::super::trail::tests::{FRAME_S, arc};
    use super::*;

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

    /// The head and the shirt of somebody have the colour of the wall, more and less of them as the wall changes.
    fn without_crown(mut active: Active) -> Active {
        for (k, (sighting, _)) in active.kept.iter_mut().enumerate() {
            let rectangle = &mut sighting.as_mut().expect("a rectangle in each frame").rectangle;
            let share = 0.15 + 0.2 * (0.13 * k as f64).sin().powi(2);
            rectangle.top += (share * rectangle.height() as f64) as usize;
        }
        active
    }

    #[test]
    fn the_soles_show_the_turn_of_somebody_whose_crown_is_not_seen() {
        let options = TrackerOptions { camera: Some(camera()), ..options() };
        let route = arc(-2.5);
        let mut turning = without_crown(followed(&route, &route));
        turning.turn(&options);
        assert!(!turning.walk.route.is_straight() && turning.rows == Rows::Soles);
        for step in &turning.steps()[10..40] {
            let path = turning.walk.route.at(step.state.along.position);
            let at = route.at(BEGINNING.along_m + 1.2 * step.time_s);
            assert!((path.heading_rad - at.heading_rad).abs() < 0.2, "{}", step.frame);
        }
        let mut straight = without_crown(followed(&PATH.into(), &PATH.into()));
        straight.turn(&options);
        assert!(straight.walk.route.is_straight());
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
    fn a_curve_is_given_up_at_the_end_if_all_rectangles_together_do_not_turn() {
        let (route, given) = (arc(-2.5), TrackerOptions { camera: Some(camera()), ..options() });
        for (rectangles, is_straight) in [(PATH.into(), true), (route.clone(), false)] {
            let mut turning = followed(&route, &rectangles);
            (turning.walk, turning.frontal) = turning.on_route(&route, 0, &given);
            turning.turn_back(&given);
            assert_eq!((turning.walk.route.is_straight(), turning.steps().len()), (is_straight, 50));
            assert!(turning.frontal.is_none() == is_straight);
            assert!(!is_straight || turning.steps().iter().all(|step| !step.by_feet));
            let heading_rad = turning.walk.route.at(turning.steps()[25].state.along.position).heading_rad;
            assert!(!is_straight || (heading_rad - PATH.heading_rad).abs() < 0.1, "{heading_rad}");
        }
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
