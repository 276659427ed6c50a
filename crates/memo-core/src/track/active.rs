//! The walk under way: whether it goes on, and what its first frames say of path, person and distance.

use super::locate::{Sighting, locate_slanting};
use super::person::{PersonFit, PersonOptions, fit_distance, fit_person};
use super::search::{Hypothesis, Scene};
use super::start::{StartReport, start};
use super::tracker::TrackerOptions;
use super::walk::{Beginning, FrameEdges, Walk};
use crate::model::Camera;

/// Slower than this nobody walks, metres a second.
pub(super) const SLOWEST_MPS: f64 = 0.25;
/// Slower than this no legs walk, gait cycles a second.
const SLOWEST_HZ: f64 = 0.3;
/// A slanting path must explain the frames better than one parallel to the image by this share of similarity:
/// seen from above a walk can seem to slant, and then fits worse.
const SLANT_GAIN: f64 = 0.02;
/// Number of last frames that tell whether a walk goes on.
const RECENT_FRAMES: usize = 12;
/// A walk ends when their similarity falls below this share of the walk's mean.
const LOST_SHARE: f64 = 0.45;

/// Frames kept for fitting.
type Kept = [(Option<Sighting>, FrameEdges)];

/// The walk under way.
#[derive(Debug)]
pub(super) struct Active {
    pub(super) camera: Camera,
    pub(super) depth_sd_m: f64,
    pub(super) start: StartReport,
    pub(super) walk: Walk,
    /// Evidence kept until the person is fitted.
    pub(super) kept: Vec<(Option<Sighting>, FrameEdges)>,
    pub(super) gait_speed_mps: f64,
    pub(super) person_fit: Option<PersonFit>,
    pub(super) fitted: bool,
}

impl Active {
    /// Whether over the last frames the person stood still or the model found little.
    pub(super) fn is_over(&self) -> bool {
        let twin = &self.walk.twins[self.walk.best()];
        let count = twin.steps.len();
        if count < 2 * RECENT_FRAMES {
            return false;
        }
        let recent = &twin.steps[count - RECENT_FRAMES..];
        let (first, last) = (&recent[0], &recent[RECENT_FRAMES - 1]);
        let covered_m = (last.state.along.position - first.state.along.position).abs();
        let cycles = (last.state.phase.position - first.state.phase.position).abs();
        let elapsed_s = last.time_s - first.time_s;
        let stopped = covered_m < SLOWEST_MPS * elapsed_s || cycles < SLOWEST_HZ * elapsed_s;
        let similarity = recent.iter().map(|s| f64::from(s.similarity)).sum::<f64>() / RECENT_FRAMES as f64;
        let lost = similarity < LOST_SHARE * twin.similarity_sum / count as f64;
        stopped || lost
    }

    /// Takes off the frames in which the person was not there yet, and those in which the walk was already
    /// over.
    ///
    /// A person who appears between two frames changes the empty one too, eq. (1) looking both ways.
    pub(super) fn trim(&mut self) {
        let twin = &self.walk.twins[self.walk.best()];
        let low = LOST_SHARE * twin.similarity_sum / twin.steps.len() as f64;
        let absent = twin.steps.iter().take_while(|s| f64::from(s.similarity) < low).count();
        let over = if self.is_over() { RECENT_FRAMES / 2 } else { 0 };
        let end = twin.steps.len() - over;
        self.walk.keep(absent.min(end)..end);
    }

    /// Fits the person to the kept frames and follows them again if that is believed; once.
    pub(super) fn refit(&mut self, options: &TrackerOptions) {
        if std::mem::replace(&mut self.fitted, true) {
            return;
        }
        let kept = std::mem::take(&mut self.kept);
        self.turn_path(&kept, options);
        let Some(person) = &options.person else { return };
        let Walk { walker, path, beginning, .. } = &self.walk;
        let fit =
            fit_person(&self.frames(&kept), walker, &self.camera, path, &options.walk.similarity, person);
        self.person_fit = Some(fit);
        if fit.is_believed {
            let walk = Walk::new(fit.deviation.apply(walker), *path, *beginning);
            self.follow_again(walk, &kept, options);
        } else {
            self.refit_distance(&kept, options, person);
        }
    }

    /// Starts again on a slanting path where the sightings show one and the contours agree.
    fn turn_path(&mut self, kept: &Kept, options: &TrackerOptions) {
        let sightings: Vec<Sighting> = kept.iter().filter_map(|(sighting, _)| *sighting).collect();
        let crown_m = self.walk.walker.level_crown_height_m();
        let Some(course) = locate_slanting(&sightings, &self.camera, crown_m) else { return };
        let frames: Vec<&FrameEdges> = kept.iter().map(|(_, e)| e).take(options.start_frames).collect();
        let walker = &self.walk.walker;
        if let Some(start) = start(&frames, &course, walker, &self.camera, &options.cadence, &options.walk) {
            let straight = self.walk.clone();
            self.follow_again(Walk::new(walker.clone(), start.path, start.beginning), kept, options);
            let summed = |walk: &Walk| walk.twins[walk.best()].similarity_sum;
            if summed(&self.walk) > (1.0 + SLANT_GAIN) * summed(&straight) {
                self.start = start;
            } else {
                self.walk = straight;
            }
        }
    }

    /// Of a body known to be average the apparent size tells the distance; a deviating one could as well be
    /// nearer or farther.
    fn refit_distance(&mut self, kept: &Kept, options: &TrackerOptions, person: &PersonOptions) {
        let Walk { walker, path, beginning, .. } = &self.walk;
        let scene = Scene { walker, camera: &self.camera, path };
        let distance = fit_distance(&self.frames(kept), &scene, &options.walk.similarity, person);
        let beginning = Beginning {
            along_m: distance.along(beginning.along_m),
            speed_mps: beginning.speed_mps * distance.factor,
            ..*beginning
        };
        let walk = Walk::new(walker.clone(), distance.path, beginning);
        self.follow_again(walk, kept, options);
    }

    /// The kept frames with where the better twin saw the person in them.
    fn frames<'a>(&self, kept: &'a Kept) -> Vec<(&'a FrameEdges, Hypothesis)> {
        let twin = &self.walk.twins[self.walk.best()];
        kept.iter().zip(&twin.steps).map(|((_, e), step)| (e, step.state.hypothesis())).collect()
    }

    fn follow_again(&mut self, mut walk: Walk, kept: &Kept, options: &TrackerOptions) {
        for (_, edges) in kept {
            walk.follow(edges, &self.camera, &options.walk);
        }
        self.walk = walk;
    }
}
