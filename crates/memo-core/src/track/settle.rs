//! Path and person, once enough frames are followed: smaller steps, an oblique path, and the person's own body and gait.

use super::active::{Active, Kept};
use super::decisions::{MOST_MISSED_TO_ADOPT, SLANT_GAIN};
use super::fit::LEAST_FRAMES;
use super::fit::views::Backdrop;
use super::locate::{Sighting, locate_slanting};
use super::options::TrackerOptions;
use super::start::start;
use super::walk::{Beginning, FrameEdges, Walk};

impl Active {
    /// True if path and person can be settled: so many frames were followed, or as many as a fit needs of somebody who moves
    /// on, but for as long. Who stays needs all of them for a start on the spot.
    pub(super) fn shows_path(&self, options: &TrackerOptions) -> bool {
        let ends = self.kept.first().zip(self.kept.last());
        let lasts_s = ends.map_or(0.0, |((_, first), (_, last))| last.time_s - first.time_s);
        let is_long = self.kept.len() >= LEAST_FRAMES && lasts_s >= options.path_s();
        self.kept.len() >= options.path_frames || is_long && self.moves_on()
    }

    /// Starts again with smaller steps if the phase stands still, on an oblique path if the kept frames show one, and with
    /// the person's own body and gait. This happens once per walk.
    pub(super) fn settle(&mut self, backdrop: &Backdrop, options: &TrackerOptions) {
        if !std::mem::replace(&mut self.settled, true) {
            let kept = std::mem::take(&mut self.kept);
            if !self.is_on_treadmill {
                self.look_for_steps(&kept, options);
                self.turn_path(&kept, options);
            }
            self.adopt_person(&kept, backdrop, options);
            self.kept = kept;
            self.pace_again(options);
        }
    }

    /// Starts again on an oblique path if the sightings show one and the contours fit it better.
    fn turn_path(&mut self, kept: &Kept, options: &TrackerOptions) {
        let (sightings, mut frames): (Vec<Sighting>, Vec<&FrameEdges>) =
            kept.iter().filter_map(|(sighting, edges)| Some(((*sighting)?, edges))).unzip();
        let Some(course) = locate_slanting(&sightings, &self.camera, &self.crown()) else { return };
        frames.truncate(options.start_frames);
        let walker = &self.walk.walker;
        if let Some(start) = start(&frames, &course, walker, &self.camera, &options.cadence, &options.walk) {
            let straight = self.walk.clone();
            let walk = Walk::new(walker.clone(), start.path, start.beginning);
            self.follow_again(walk, kept, options);
            let is_worse = self.walk.is_less_usual_than(&straight, self.average.body.height_m);
            if !is_worse && self.walk.similarity_sum() > (1.0 + SLANT_GAIN) * straight.similarity_sum() {
                self.start = start;
            } else {
                self.walk = straight;
            }
        }
    }

    /// Follows the kept frames again, and from then on the person instead of the average, if the person could be
    /// fitted to them and is nearer to the edges than the average.
    pub(super) fn adopt_person(&mut self, kept: &Kept, backdrop: &Backdrop, options: &TrackerOptions) {
        let Some(Ok(fit)) = self.fit(backdrop, options, None) else { return };
        if fit.quality.missed > MOST_MISSED_TO_ADOPT {
            return;
        }
        self.average.body.height_m = self.height_by(Some(&fit)).height_m;
        let [first, last] = [&fit.frames[0], &fit.frames[fit.frames.len() - 1]];
        let steps = self.steps();
        let elapsed_s = steps[steps.len() - 1].time_s - steps[0].time_s;
        let beginning = Beginning {
            time_s: steps[0].time_s,
            along_m: first.along_m,
            phase: first.phase,
            speed_mps: (last.along_m - first.along_m) / elapsed_s,
            rate_hz: (last.phase - first.phase) / elapsed_s,
        };
        let average = self.walk.clone();
        self.follow_again(Walk::new(fit.walker(), fit.route.clone(), beginning), kept, options);
        let height_m = self.average.body.height_m;
        let is_nearer = self.walk.similarity_sum() > average.similarity_sum();
        if !is_nearer || self.walk.is_less_usual_than(&average, height_m) {
            self.walk = average;
        }
    }

    fn follow_again(&mut self, walk: Walk, kept: &Kept, options: &TrackerOptions) {
        self.walk = walk.through(kept.iter().map(|(_, edges)| edges), &self.camera, &options.walk);
    }
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::{FRAME_S, PATH, WINDOW, active, frames_on, options, step};
    use super::super::search::Path;
    use super::*;

    #[test]
    fn fewer_frames_that_last_as_long_show_a_path_of_who_moves_on() {
        let options = TrackerOptions::default();
        let followed = |count: usize, frame_s: f64, speed_mps: f64| {
            let steps = (0..count).map(|k| step(k, [speed_mps * FRAME_S * k as f64, 0.05 * k as f64], 0.5));
            let mut active = active(steps.collect());
            active.kept = (0..count).map(|k| (None, frame_at(k, frame_s * k as f64))).collect();
            active.shows_path(&options)
        };
        assert!(!followed(39, 0.04, 1.2) && followed(40, 0.04, 1.2), "25 frames per second");
        assert!(!followed(19, 0.083, 1.2) && followed(20, 0.083, 1.2), "12 frames per second");
        assert!(!followed(14, 0.143, 1.2) && followed(15, 0.143, 1.2), "what a fit needs");
        assert!(!followed(39, 0.143, 0.1) && followed(40, 0.143, 0.1), "who stays");
    }

    /// A phase that runs at half the rate makes steps of twice the length.
    #[test]
    fn a_walk_with_impossible_steps_gives_way_to_one_with_usual_ones() {
        let walked = |speed_mps: f64, rate_hz: f64| {
            let at = |k: usize| [speed_mps, rate_hz].map(|rate| rate * FRAME_S * k as f64);
            active((0..40).map(|k| step(k, at(k), 0.5)).collect()).walk
        };
        let (usual, halved) = (walked(1.2, 0.9), walked(1.2, 0.45));
        assert!(halved.is_less_usual_than(&usual, 1.75) && !usual.is_less_usual_than(&halved, 1.75));
        assert!(!usual.is_less_usual_than(&walked(1.3, 1.0), 1.75));
        // Twice too high a frame rate: neither has steps as people take them.
        assert!(!walked(2.4, 0.9).is_less_usual_than(&walked(2.4, 1.8), 1.75));
        assert!(!walked(1.2, 0.0).is_less_usual_than(&walked(0.0, 0.0), 1.75), "on the spot");
        assert!(walked(1.2, 0.0).is_less_usual_than(&usual, 1.75), "the phase stands still");
        assert!(!usual.is_less_usual_than(&active(Vec::new()).walk, 1.75));
    }

    fn frame_at(frame: usize, time_s: f64) -> FrameEdges {
        FrameEdges::of_one_alone(frame, time_s, WINDOW, Vec::new())
    }

    /// Twelve frames with contours along `path` and rectangles along `seen`.
    fn kept(path: &Path, seen: &Path) -> Vec<(Option<Sighting>, FrameEdges)> {
        frames_on(12, 0.1, &(*path).into(), &(*seen).into())
    }

    /// A walk followed through the kept frames on a path parallel to the image plane, then turned.
    fn refitted(kept: Vec<(Option<Sighting>, FrameEdges)>) -> Active {
        let mut active = active(Vec::new());
        for (_, edges) in &kept {
            active.walk.follow(edges, &active.camera, &options().walk);
        }
        active.kept = kept;
        active.settle(&Backdrop::default(), &options());
        assert!(active.settled);
        active
    }

    #[test]
    fn a_slanting_path_is_taken_where_rectangles_and_contours_show_it() {
        let slanting = Path { heading_rad: 0.4, ..PATH };
        let turned = refitted(kept(&slanting, &slanting));
        let path = turned.walk.route.at(0.0);
        assert!((path.heading_rad - 0.4).abs() < 0.1, "{path:?}");
        assert_eq!((turned.start.path, turned.walk.beginning), (path, turned.start.beginning));
        assert_eq!(turned.walk.twins[0].steps.len(), 12);
        assert!(turned.walk.twins[0].similarity_sum > 8.0);
    }

    #[test]
    fn a_path_that_only_the_rectangles_show_is_not_taken() {
        let straight = refitted(kept(&PATH, &Path { heading_rad: 0.4, ..PATH }));
        assert_eq!((straight.walk.route, straight.start.path), (PATH.into(), PATH));
        assert!(straight.walk.twins[0].similarity_sum > 10.0);
    }

    #[test]
    fn a_walk_is_settled_once() {
        let mut active = active(Vec::new());
        active.settled = true;
        active.kept = kept(&PATH, &PATH);
        active.settle(&Backdrop::default(), &options());
        assert_eq!(active.kept.len(), 12, "left alone");
    }
}
