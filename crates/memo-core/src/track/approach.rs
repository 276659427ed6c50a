//! Starts people who walk towards the camera or away from it, and lays their walks through the feet of [`Frontal`].

use super::active::Active;
use super::frontal::{Frontal, Lowest, WINDOW};
use super::height::BodyHeight;
use super::locate::{Course, Sighting};
use super::options::TrackerOptions;
use super::route::Route;
use super::standing::Standing;
use super::start::{Direction, StartReport, start};
use super::walk::{Beginning, FrameEdges, Walk, WalkOptions};
use crate::model::{Camera, Walker};
use std::collections::BTreeMap;

/// What a start needs besides the frames.
pub(super) struct Approach<'a> {
    pub camera: &'a Camera,
    pub height: BodyHeight,
    pub walker: Walker,
    pub options: &'a TrackerOptions,
}

impl Approach<'_> {
    /// Starts a walk towards the camera or away from it; gives the frames back if the feet show none.
    pub fn begin(&self, standing: Standing) -> Result<Active, Standing> {
        let Self { camera, height, walker, options } = self;
        let Some(frontal) = Frontal::begin(&standing, camera, walker, &options.cadence) else {
            return Err(standing);
        };
        let beginning = frontal.beginning();
        let Some(start) = self.report(&standing, &frontal, &beginning) else { return Err(standing) };
        let walk = Walk::new(walker.clone(), frontal.route.clone(), beginning);
        let mut active = Active {
            depth_sd_m: frontal.depth_sd_m(),
            settled: true,
            kept: standing.kept,
            pieces: standing.pieces,
            feet: standing.feet,
            frontal: Some(frontal),
            ..Active::new(walk, start, (*camera).clone(), *height)
        };
        let count = active.kept.len();
        active.follow_on(&active.walk.route.clone(), 0..count, usize::MAX, &options.walk);
        Ok(active)
    }

    /// The similarities of the first frames, which show little; the path and phase are those of the feet.
    fn report(&self, standing: &Standing, frontal: &Frontal, beginning: &Beginning) -> Option<StartReport> {
        let options = self.options;
        let frames: Vec<&FrameEdges> =
            standing.kept.iter().map(|(_, edges)| edges).take(options.start_frames).collect();
        let course = Course {
            path: frontal.route.at(beginning.along_m),
            along_m: frontal.paces.iter().map(|pace| pace.along_m).collect(),
            speed_mps: beginning.speed_mps,
            depth_sd_m: frontal.depth_sd_m(),
        };
        let seen = start(&frames, &course, &self.walker, self.camera, &options.cadence, &options.walk)?;
        let (path, beginning) = (course.path, *beginning);
        let direction = Direction::Forward;
        Some(StartReport { path, beginning, direction, p_other_direction: 0.0, ..seen })
    }
}

impl Active {
    /// Whether the feet alone showed place and phase all along.
    pub(super) fn is_frontal(&self) -> bool {
        self.frontal.is_some() && self.steps().iter().all(|step| step.by_feet)
    }

    /// The lowest rows of a kept frame.
    pub(super) fn lowest(&self, sighting: Option<Sighting>, frame: usize) -> Lowest {
        Lowest { firm: sighting, all: self.feet.get(&frame).copied() }
    }

    /// What feet and contours showed so far.
    pub(super) fn recorded(&self) -> Frontal {
        let firm: BTreeMap<usize, Sighting> =
            self.kept.iter().filter_map(|(sighting, edges)| Some((edges.frame, (*sighting)?))).collect();
        Frontal::of_steps(&self.walk, |frame| self.lowest(firm.get(&frame).copied(), frame), &self.camera)
    }

    /// Records feet and contours anew after the walk was followed again.
    pub(super) fn pace_again(&mut self, options: &TrackerOptions) {
        self.frontal = match self.frontal {
            Some(_) if !self.walk.route.is_straight() => Some(self.recorded()),
            _ => None,
        };
        if self.frontal.is_some() {
            let last = self.steps().last().map_or(0, |step| step.frame);
            self.follow_on(&self.walk.route.clone(), 0..self.steps().len(), last, &options.walk);
        }
    }

    /// Where the feet of the last frame are along the line of sight, and elsewhere what the contours showed.
    pub(super) fn pace(&mut self, sighting: Option<Sighting>) {
        let last = self.steps().len() - 1;
        let step = self.steps()[last];
        let lowest = self.lowest(sighting, step.frame);
        let Some(frontal) = &mut self.frontal else { return };
        frontal.push(step.time_s, &lowest);
        if !frontal.is_by_feet(last) {
            return frontal.see(last, &self.walk);
        }
        let Some(variances) = frontal.solve(last.saturating_sub(WINDOW)) else { return };
        frontal.lay(last, variances[variances.len() - 1], &mut self.walk);
    }

    /// The same of all frames, each from those before and after it.
    pub(super) fn pace_all(&mut self) {
        let Some(frontal) = &mut self.frontal else { return };
        let Some(variances) = frontal.solve(0) else { return };
        for (k, of) in variances.into_iter().enumerate() {
            frontal.lay(k, of, &mut self.walk);
        }
    }

    /// Follows the steps of a range again, up to the frame `last`, on another route: by the feet where they show the walk.
    pub(super) fn follow_on(
        &mut self,
        route: &Route,
        steps: std::ops::Range<usize>,
        last: usize,
        options: &WalkOptions,
    ) {
        let mut frontal = self.frontal.take();
        let variances = frontal.as_mut().and_then(|frontal| frontal.solve(0)).unwrap_or_default();
        match &frontal {
            Some(frontal) if steps.start == 0 && frontal.is_by_feet(0) => {
                self.walk = Walk::new(self.walk.walker.clone(), route.clone(), frontal.beginning());
            }
            _ => {
                let at_m = self.walk.beginning.along_m;
                self.walk.beginning.along_m = route.along(self.walk.route.place(at_m), at_m);
                self.walk.go_back_to(steps.start);
                self.walk.route = route.clone();
            }
        }
        let end = self.kept.partition_point(|(_, edges)| edges.frame <= last);
        for (k, (_, edges)) in steps.clone().zip(&self.kept[end.saturating_sub(steps.len())..end]) {
            self.walk.follow(edges, &self.camera, options);
            match (&mut frontal, variances.get(k)) {
                (Some(frontal), Some(of)) if frontal.is_by_feet(k) => frontal.lay(k, *of, &mut self.walk),
                (Some(frontal), _) => frontal.see(k, &self.walk),
                _ => {}
            }
        }
        self.frontal = frontal;
        self.pace_all();
    }

    /// Follows all frames again, on the line through all feet. Without a fit, the first frames of a long walk are gone, and
    /// it stays on its path.
    pub(super) fn straighten(&mut self, options: &WalkOptions) {
        let Some(frontal) = &self.frontal else { return };
        if !frontal.route.is_straight() || self.kept.len() != self.steps().len() {
            return;
        }
        let Some((mut renewed, variances)) = frontal.on_path_of_all() else { return };
        let mut walk = Walk::new(self.walk.walker.clone(), renewed.route.clone(), renewed.beginning());
        for (k, ((_, edges), of)) in self.kept.iter().zip(variances).enumerate() {
            walk.follow(edges, &self.camera, options);
            renewed.lay(k, of, &mut walk);
        }
        self.walk = walk;
        self.frontal = Some(renewed);
    }
}
