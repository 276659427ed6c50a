//! Starts people who walk towards the camera or away from it, and lays their walks through the feet of [`Frontal`].

use super::active::Active;
use super::frontal::{Frontal, WINDOW};
use super::height::BodyHeight;
use super::locate::{Course, Sighting};
use super::options::TrackerOptions;
use super::standing::Standing;
use super::start::{Direction, StartReport, start};
use super::walk::{Beginning, FrameEdges, Walk, WalkOptions};
use crate::model::{Camera, Walker};

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
        let mut active = Active {
            person: 0,
            started_near: false,
            camera: (*camera).clone(),
            tilt: None,
            height: *height,
            depth_sd_m: frontal.depth_sd_m(),
            start,
            walk: Walk::new(walker.clone(), frontal.path, beginning),
            average: walker.clone(),
            kept: Vec::new(),
            gait_speed_mps: beginning.speed_mps,
            settled: true,
            is_on_treadmill: false,
            early: None,
            pieces: Vec::new(),
            frontal: None,
        };
        for (_, edges) in &standing.kept {
            active.walk.follow(edges, camera, &options.walk);
        }
        active.kept = standing.kept;
        active.frontal = Some(frontal);
        active.pace_all();
        Ok(active)
    }

    /// The similarities of the first frames, which show little; the path and phase are those of the feet.
    fn report(&self, standing: &Standing, frontal: &Frontal, beginning: &Beginning) -> Option<StartReport> {
        let options = self.options;
        let frames: Vec<&FrameEdges> =
            standing.kept.iter().map(|(_, edges)| edges).take(options.start_frames).collect();
        let course = Course {
            path: frontal.path,
            along_m: frontal.paces.iter().map(|pace| pace.along_m).collect(),
            speed_mps: beginning.speed_mps,
            depth_sd_m: frontal.depth_sd_m(),
        };
        let seen = start(&frames, &course, &self.walker, self.camera, &options.cadence, &options.walk)?;
        let (path, beginning) = (frontal.path, *beginning);
        let direction = Direction::Forward;
        Some(StartReport { path, beginning, direction, p_other_direction: 0.0, ..seen })
    }
}

impl Active {
    /// Where the feet of the last frame are, of somebody who walks towards the camera or away from it.
    pub(super) fn pace(&mut self, time_s: f64, feet: Option<&Sighting>) {
        let Some(frontal) = &mut self.frontal else { return };
        frontal.push(time_s, feet);
        let last = frontal.paces.len() - 1;
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

    /// Follows all frames again, on the line through all feet. Without a fit, the first frames of a long walk are gone, and
    /// it stays on its path.
    pub(super) fn straighten(&mut self, options: &WalkOptions) {
        let Some(frontal) = &self.frontal else { return };
        if self.kept.len() != self.steps().len() {
            return;
        }
        let Some((mut renewed, variances)) = frontal.on_path_of_all() else { return };
        let mut walk = Walk::new(self.walk.walker.clone(), renewed.path, renewed.beginning());
        for (k, ((_, edges), of)) in self.kept.iter().zip(variances).enumerate() {
            walk.follow(edges, &self.camera, options);
            renewed.lay(k, of, &mut walk);
        }
        self.walk = walk;
        self.frontal = Some(renewed);
    }
}
