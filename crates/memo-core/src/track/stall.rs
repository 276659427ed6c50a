//! People whose phase stands still in the model while they walk on.
//!
//! Where the legs of the model swing farther than those of the person, the most similar posture of every frame is one in
//! which the model's legs are about to pass each other, and the phase goes to and fro about it. Over all frames so far,
//! the lines of phase of gaits with smaller steps tell the cadence.

use super::active::{Active, Kept};
use super::locate::{Crown, Sighting, locate};
use super::options::TrackerOptions;
use super::rate::latest;
use super::start::{StartReport, start};
use super::walk::{FrameEdges, Walk};
use crate::model::{GaitStyle, Walker};

/// The gaits that are tried.
const SMALLER_STEPS: [GaitStyle; 2] = [GaitStyle::SHORT_STEPS, GaitStyle::SHUFFLING];
/// A phase that moves on more slowly in the last frames stands still, gait cycles per second. Walks start with 0.65 and
/// more. Chosen, with no margin measured: what seems to stand still is only started again.
const STALLED_HZ: f64 = 0.45;
/// Number of last frames that decide, at the usual rate.
const LAST_FRAMES: usize = 20;

impl Active {
    /// Follows the kept frames again with smaller steps, if the phase stands still and that makes it move.
    pub(super) fn look_for_steps(&mut self, kept: &Kept, options: &TrackerOptions) {
        if !stalls(&self.walk) {
            return;
        }
        let starts = SMALLER_STEPS.into_iter().filter_map(|style| self.started_with(style, kept, options));
        let best = starts
            .filter(|(start, walk)| start.frozen.similarity < start.lines.best.similarity && !stalls(walk))
            .max_by(|a, b| a.1.similarity_sum().total_cmp(&b.1.similarity_sum()));
        if let Some((start, walk)) = best {
            (self.start, self.walk) = (start, walk);
        }
    }

    /// The start and the walk of a gait on the kept frames.
    fn started_with(
        &self,
        style: GaitStyle,
        kept: &Kept,
        options: &TrackerOptions,
    ) -> Option<(StartReport, Walk)> {
        let (sightings, frames): (Vec<Sighting>, Vec<&FrameEdges>) =
            kept.iter().filter_map(|(sighting, edges)| Some(((*sighting)?, edges))).unzip();
        let walker = Walker { style, ..self.average.clone() };
        let crown = Crown { height_m: walker.level_crown_height_m(), sd_m: self.height.sd_in_camera_m() };
        let course = locate(&sightings, &self.camera, &crown).ok()?;
        let start = start(&frames, &course, &walker, &self.camera, &options.cadence, &options.walk)?;
        let walk = Walk::new(walker, start.path, start.beginning);
        let walk = walk.through(kept.iter().map(|(_, edges)| edges), &self.camera, &options.walk);
        Some((start, walk))
    }
}

/// True if the phase stands still in the last frames.
fn stalls(walk: &Walk) -> bool {
    let steps = walk.steps();
    let Some(recent) = latest(steps, LAST_FRAMES) else { return false };
    let (first, last) = (&recent[0], &recent[recent.len() - 1]);
    let cycles = (last.state.phase.position - first.state.phase.position).abs();
    cycles < STALLED_HZ * (last.time_s - first.time_s)
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::active;
    use super::super::search::tests::{camera, edges_of, rectangle_of, walker};
    use super::super::search::{Hypothesis, Path, Scene};
    use super::super::walk::Beginning;
    use super::*;
    use glam::DVec2;

    const PATH: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    const RATE_HZ: f64 = 0.9;

    fn phase(k: usize) -> f64 {
        0.1 + RATE_HZ * 0.04 * k as f64
    }

    /// Somebody whose legs swing this share as far as the average's, and frames of the way.
    fn walking(swing: f64) -> Vec<(Option<Sighting>, FrameEdges)> {
        let style = GaitStyle { leg_amplitude: swing, arm_amplitude: swing, ..GaitStyle::default() };
        let (walker, camera) = (Walker { style, ..walker() }, camera());
        let scene = Scene::new(&walker, &camera, &PATH);
        let frame = |k: usize| {
            let (time_s, height_m) = (0.04 * k as f64, walker.level_torso_height_m());
            let along_m = -0.5 + 0.6 * time_s;
            let edges = edges_of(&scene, &Hypothesis { along_m, height_m, phase: phase(k) });
            let rectangle = rectangle_of(&walker, &camera, &PATH, along_m);
            let edges = FrameEdges::of_one_alone(k, time_s, rectangle, edges);
            (Some(Sighting { time_s, rectangle }), edges)
        };
        (0..40).map(frame).collect()
    }

    /// Followed with the average gait from the true state.
    fn followed(kept: &Kept, rate_hz: f64) -> Active {
        let beginning = Beginning { time_s: 0.0, along_m: -0.5, phase: phase(0), speed_mps: 0.6, rate_hz };
        let mut walk = Walk::new(walker(), PATH, beginning);
        for (_, edges) in kept {
            walk.follow(edges, &camera(), &TrackerOptions::default().walk);
        }
        Active { walk, ..active(Vec::new()) }
    }

    #[test]
    fn small_steps_are_found_where_the_phase_of_large_ones_stands_still() {
        let kept = walking(0.4);
        let mut person = followed(&kept, RATE_HZ);
        assert!(stalls(&person.walk), "the average's legs swing too far");
        person.look_for_steps(&kept, &TrackerOptions::default());
        let walk = &person.walk;
        assert_eq!(walk.walker.style, GaitStyle::SHUFFLING);
        assert!((person.start.lines.best.rate_hz - RATE_HZ).abs() < 0.05);
        for step in &walk.steps()[20..] {
            let off = step.state.phase.position - phase(step.frame);
            // The two half-cycle twins look almost alike.
            assert!((2.0 * off - (2.0 * off).round()).abs() < 0.1, "frame {}: {off}", step.frame);
        }
    }

    #[test]
    fn steps_too_small_for_every_gait_change_nothing() {
        let kept = walking(0.2);
        let mut person = followed(&kept, RATE_HZ);
        assert!(stalls(&person.walk));
        person.look_for_steps(&kept, &TrackerOptions::default());
        assert_eq!(person.walk.walker.style, GaitStyle::default());
    }

    #[test]
    fn who_steps_on_keeps_the_gait() {
        let kept = walking(1.0);
        let mut person = followed(&kept, RATE_HZ);
        let before = person.walk.clone();
        person.look_for_steps(&kept, &TrackerOptions::default());
        assert_eq!(person.walk.walker.style, before.walker.style);
        assert_eq!(person.walk.twins[0].steps, before.twins[0].steps);
    }

    #[test]
    fn what_stands_still_in_one_posture_does_not_step() {
        // The same posture in every frame, carried along.
        let still = walking(0.4)[5].1.edges.clone();
        let mut kept = walking(0.4);
        for (k, (_, edges)) in kept.iter_mut().enumerate() {
            let moved_px = (rectangle_of(&walker(), &camera(), &PATH, -0.5 + 0.024 * k as f64).left as f32)
                - (rectangle_of(&walker(), &camera(), &PATH, -0.5 + 0.024 * 5.0).left as f32);
            edges.edges = still.clone();
            for edge in &mut edges.edges {
                edge.start[0] += moved_px;
                edge.end[0] += moved_px;
            }
        }
        let mut person = followed(&kept, RATE_HZ);
        let before = person.walk.clone();
        assert!(stalls(&before));
        person.look_for_steps(&kept, &TrackerOptions::default());
        assert_eq!(person.walk.walker.style, before.walker.style);
    }
}
