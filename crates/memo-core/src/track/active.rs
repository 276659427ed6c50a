//! The current walk: where the person is in each frame, and the fit of the person at its end.

use super::candidate::Seen;
use super::crowd::{Expected, body_box, expected};
use super::decisions::STRIDE_HEIGHTS;
use super::fit::edge_search::View;
use super::fit::of_walk::Tracked;
use super::fit::views::{Backdrop, Piece};
use super::fit::{FitError, WalkFit};
use super::frontal::Frontal;
use super::height::{BodyHeight, HeightSource};
use super::locate::{Crown, Rows, Sighting};
use super::options::TrackerOptions;
use super::people::{Now, Sign};
use super::rate::mean_interval_s;
use super::search::Scene;
use super::standing::Standing;
use super::start::StartReport;
use super::steady::CameraMotion;
use super::walk::{FrameEdges, Step, Walk};
use crate::calibrate::TiltEstimate;
use crate::image::Sides;
use crate::model::body::PART_COUNT;
use crate::model::{Camera, EllipticCylinder, GaitStyle, Walker};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

/// Frames kept for fitting.
pub(super) type Kept = [(Option<Sighting>, FrameEdges)];

/// The current walk.
#[derive(Debug, Clone)]
pub(super) struct Active {
    /// Number of the person, in order of appearance.
    pub(super) person: usize,
    /// The frame after which somebody else can be told from the person: that in which the walk was started, later that from
    /// which on the person is followed instead of the average. `None` if it goes on from an earlier one.
    pub(super) known_frame: Option<usize>,
    /// Whether somebody was followed when the walk started.
    pub(super) started_near: bool,
    pub(super) camera: Camera,
    /// How the assumed camera is tilted; `None` of a given one.
    pub(super) tilt: Option<TiltEstimate>,
    /// The body height with which the walk started.
    pub(super) height: BodyHeight,
    /// The body height that the first rectangles show in a calibrated camera, if a height was given, metres.
    pub(super) shown_height_m: Option<f64>,
    pub(super) depth_sd_m: f64,
    pub(super) start: StartReport,
    pub(super) walk: Walk,
    /// The average walker of the person's height.
    pub(super) average: Walker,
    /// The frames so far, to follow them again on another route; without a fit, the latest.
    pub(super) kept: Vec<(Option<Sighting>, FrameEdges)>,
    /// Whether path and person were settled.
    pub(super) settled: bool,
    /// What the fit needs of each frame.
    pub(super) pieces: Vec<Piece>,
    /// Whether the person walks on the spot.
    pub(super) is_on_treadmill: bool,
    /// On the spot, the frames of the stream until the start: later ones do not show the empty scene.
    pub(super) early: Option<Backdrop>,
    /// The rectangles of all changes, by frame: they reach down to feet that hardly move.
    pub(super) feet: BTreeMap<usize, Sighting>,
    /// What was seen before the walk started.
    pub(super) earlier: Standing,
    /// What the regions of the frames before the start showed.
    pub(super) before: Vec<Arc<Seen>>,
    /// What changes beside the legs and nobody explains, in the frames that show it.
    pub(super) unexplained: Vec<f64>,
    /// What changes at the legs and the others who are followed do not explain, of somebody who was started beside them.
    pub(super) of_its_own: Vec<f64>,
    /// What the feet show of somebody who walks towards the camera or away from it.
    pub(super) frontal: Option<Frontal>,
    /// The rows of the rectangles that show where the person is.
    pub(super) rows: Rows,
}

impl Active {
    /// A walk at its beginning, of a body height, in a camera.
    pub(super) fn new(walk: Walk, start: StartReport, camera: Camera, height: BodyHeight) -> Self {
        Self {
            person: 0,
            known_frame: None,
            started_near: false,
            camera,
            tilt: None,
            height,
            shown_height_m: None,
            depth_sd_m: 0.0,
            average: Walker { style: GaitStyle::default(), ..walk.walker.clone() },
            start,
            walk,
            kept: Vec::new(),
            settled: false,
            pieces: Vec::new(),
            is_on_treadmill: false,
            early: None,
            feet: BTreeMap::new(),
            earlier: Standing::default(),
            before: Vec::new(),
            unexplained: Vec::new(),
            of_its_own: Vec::new(),
            frontal: None,
            rows: Rows::Both,
        }
    }

    /// The filtered state of the better twin.
    pub(super) fn now(&self, options: &TrackerOptions) -> Option<Now> {
        let step = self.walk.last()?;
        let hypothesis = step.state.hypothesis();
        Some(Now {
            person: self.person,
            frame: step.frame,
            time_s: step.time_s,
            torso_centre: self.scene(hypothesis.along_m).pose(&hypothesis).torso_centre,
            heading_rad: self.walk.route.at(hypothesis.along_m).heading_rad,
            phase: hypothesis.phase,
            p_swapped: self.p_swapped(options),
            speed_mps: step.state.along.velocity,
        })
    }

    /// Probability that left and right are swapped; the feet of somebody who walks towards the camera do not show it.
    pub(super) fn p_swapped(&self, options: &TrackerOptions) -> f64 {
        if self.is_frontal() { 0.5 } else { self.walk.swap_probability(&options.walk.swap) }
    }

    /// The mean height of the crown.
    pub(super) fn crown(&self) -> Crown {
        Crown { height_m: self.walk.walker.level_crown_height_m(), sd_m: self.height.sd_in_camera_m() }
    }

    /// The scene near a place along the route.
    pub(super) fn scene(&self, along_m: f64) -> Scene<'_> {
        Scene::new(&self.walk.walker, &self.camera, &self.walk.route.at(along_m))
    }

    /// How far the bodies of this walk and of another overlap in the image in the frames of both, on average (intersection
    /// over union of their boxes); 0 without such frames.
    pub(super) fn overlap(&self, other: &Self) -> f64 {
        let others: HashMap<usize, &Step> = other.steps().iter().map(|step| (step.frame, step)).collect();
        let both = self.steps().iter().filter_map(|step| Some((step, *others.get(&step.frame)?)));
        let overlaps: Vec<f64> = both
            .filter_map(|(here, there)| Some(self.box_in(here)?.overlap(&other.box_in(there)?)))
            .collect();
        if overlaps.is_empty() { 0.0 } else { overlaps.iter().sum::<f64>() / overlaps.len() as f64 }
    }

    /// The box of the body in the image.
    fn box_in(&self, step: &Step) -> Option<Sides> {
        let hypothesis = step.state.hypothesis();
        let body = self.scene(hypothesis.along_m).pose(&hypothesis).cylinders;
        body_box(&self.camera, &body)
    }

    /// The body in the last frame.
    pub(super) fn body(&self) -> Option<[EllipticCylinder; PART_COUNT]> {
        let hypothesis = self.walk.last()?.state.hypothesis();
        Some(self.scene(hypothesis.along_m).pose(&hypothesis).cylinders)
    }

    /// Where the person is and goes on the ground.
    pub(super) fn sign(&self) -> Option<Sign> {
        self.sign_at(self.steps().len().checked_sub(1)?)
    }

    /// The frames of the better twin.
    pub(super) fn steps(&self) -> &[Step] {
        self.walk.steps()
    }

    /// Number of frames before a time.
    pub(super) fn frames_before(&self, time_s: f64) -> usize {
        self.steps().partition_point(|step| step.time_s < time_s)
    }

    /// Drops the frames from a time on.
    pub(super) fn end_before(&mut self, time_s: f64) {
        let first = self.steps().get(self.frames_before(time_s)).map(|step| step.frame);
        first.into_iter().for_each(|frame| self.drop_from(frame));
    }

    /// Where the person was and went in a frame.
    pub(super) fn sign_at(&self, index: usize) -> Option<Sign> {
        let step = self.steps().get(index)?;
        let path = self.walk.route.at(step.state.along.position);
        let speed_mps = step.state.along.velocity;
        let (velocity_mps, way) = match self.is_on_treadmill {
            true => (DVec2::ZERO, path.direction()),
            false => (speed_mps * path.direction(), speed_mps.signum() * path.direction()),
        };
        let place_m = path.point(step.state.along.position, 0.0).truncate();
        // The turn of the last second.
        let before = self.walk.route.at(step.state.along.position - speed_mps);
        let turn_rad_per_s = if self.is_on_treadmill { 0.0 } else { path.heading_rad - before.heading_rad };
        Some(Sign { time_s: step.time_s, place_m, velocity_mps, way, turn_rad_per_s, stands: false })
    }

    /// The person as followed in the last frame.
    pub(super) fn as_followed(&self) -> Option<Expected> {
        let twins = [self.walk.best(), 1 - self.walk.best()].map(|twin| self.walk.twins[twin].steps.last());
        let [Some(best), Some(other)] = twins else { return None };
        let height_px = body_box(&self.camera, &self.body()?)?.height();
        let scene = self.scene(best.state.along.position);
        let twins = [best, other].map(|step| step.state.hypothesis());
        Some(expected(&scene, twins, best.look.window, height_px))
    }

    /// Drops the frames from this one on.
    pub(super) fn drop_from(&mut self, frame: usize) {
        let steps = &self.walk.twins[0].steps;
        let end = steps.partition_point(|step| step.frame < frame);
        self.walk.keep(0..end);
        self.kept.retain(|(_, edges)| edges.frame < frame);
        self.frontal.iter_mut().for_each(|frontal| frontal.paces.truncate(end));
    }

    /// The rotations of the camera in the frames of the walk; none if it stood still in all of them.
    pub(super) fn turns<'a>(&self, motions: impl Iterator<Item = &'a CameraMotion>) -> Vec<DVec3> {
        let steps = self.steps();
        let known: HashMap<usize, DVec3> = motions.map(|motion| (motion.frame, motion.turn_rad)).collect();
        let turns: Vec<DVec3> =
            steps.iter().map(|step| known.get(&step.frame).copied().unwrap_or(DVec3::ZERO)).collect();
        if turns.iter().any(|turn| *turn != DVec3::ZERO) { turns } else { Vec::new() }
    }

    /// Fits the person to the frames so far, from the smoothed track; `None` without the option. With the
    /// probability of exchanged sides, the sides are decided anew.
    pub(super) fn fit(
        &self,
        backdrop: &Backdrop,
        options: &TrackerOptions,
        p_swapped: Option<f64>,
    ) -> Option<Result<WalkFit, FitError>> {
        let fit = options.fit.as_ref()?;
        if self.is_frontal() {
            return Some(Err(FitError::Frontal));
        }
        let views = self.views(backdrop).into_iter().map(|(_, view)| view).collect();
        let on_scale = |fit: WalkFit| {
            let height = fit.height.map(|height| height.on_scale(self.height.scale_sd));
            WalkFit { height, ..fit }
        };
        Some(self.tracked(options).fit(views, fit, p_swapped).map(on_scale))
    }

    /// Mean time from frame to frame, seconds.
    pub(super) fn every_s(&self) -> f64 {
        mean_interval_s(self.steps().iter().map(|step| step.time_s))
    }

    /// What the frames show in which contours show the walk.
    pub(super) fn views(&self, backdrop: &Backdrop) -> Vec<(usize, View)> {
        let shown: HashSet<usize> =
            self.steps().iter().filter(|step| !step.by_feet).map(|step| step.frame).collect();
        let pieces = || self.pieces.iter().filter(|piece| shown.contains(&piece.frame));
        let views = match self.is_on_treadmill {
            true => self.early.as_ref().unwrap_or(backdrop).views_on_the_spot(pieces()),
            false => backdrop.views(pieces()),
        };
        pieces().map(|piece| piece.frame).zip(views).collect()
    }

    /// Row of the crown in each frame by the changes, pixels.
    pub(super) fn crowns_px(&self) -> Vec<Option<f64>> {
        let known: HashMap<usize, f64> =
            self.pieces.iter().filter_map(|piece| Some((piece.frame, piece.crown_px?))).collect();
        if self.pieces.is_empty() {
            return Vec::new();
        }
        self.steps().iter().map(|step| known.get(&step.frame).copied()).collect()
    }

    /// What a fit starts from.
    fn tracked<'a>(&'a self, options: &'a TrackerOptions) -> Tracked<'a> {
        Tracked {
            walk: &self.walk,
            camera: &self.camera,
            tilt: self.tilt.as_ref(),
            average: &self.average,
            height: &self.height,
            shown_height_m: self.shown_height_m,
            is_on_treadmill: self.is_on_treadmill,
            depth_sd_m: self.depth_sd_m,
            filter: &options.walk.filter,
        }
    }

    /// True unless the fitted feet of a person on the spot take steps that no legs of that height take.
    pub(super) fn takes_steps(&self, fit: Option<&WalkFit>) -> bool {
        let Some((fit, belt)) = fit.and_then(|fit| Some((fit, fit.belt?))) else { return true };
        let steps = self.steps();
        let elapsed_s = steps[steps.len() - 1].time_s - steps[0].time_s;
        let cycles = fit.frames[fit.frames.len() - 1].phase - fit.frames[0].phase;
        STRIDE_HEIGHTS.contains(&(belt.speed_mps * elapsed_s / cycles / fit.body.height_m))
    }

    /// The given or assumed height, or the one that a fit measured.
    pub(super) fn height_by(&self, fit: Option<&WalkFit>) -> BodyHeight {
        let measured = fit.and_then(|fit| fit.height);
        match (self.height.source, measured) {
            (HeightSource::Given, _) | (_, None) => self.height,
            (_, Some(measured)) => measured,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::route::Route;
    use super::super::search::tests::{camera, edges_of, rectangle_of, walker};
    use super::super::search::{Hypothesis, Path, Scene};
    use super::super::start::Direction;
    use super::super::start::tests::report;
    use super::super::walk::tests::step_in;
    use super::super::walk::{Beginning, State};
    use super::*;
    use crate::estimate::kalman::ConstantVelocity;
    use crate::image::{Image, Rectangle};
    use glam::DVec2;

    pub const PATH: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    pub const BEGINNING: Beginning =
        Beginning { time_s: 0.0, along_m: -0.6, phase: 0.2, speed_mps: 1.2, rate_hz: 0.9 };
    pub const WINDOW: Rectangle = Rectangle { left: 0, top: 0, right: 639, bottom: 479 };
    pub const FRAME_S: f64 = 0.05;

    /// A walk of the given steps; the second twin is worse.
    pub fn active(steps: Vec<Step>) -> Active {
        let mut walk = Walk::new(walker(), PATH, BEGINNING);
        walk.twins[0].similarity_sum = steps.iter().map(|s| f64::from(s.similarity)).sum();
        walk.twins[0].visible_sum = steps.iter().map(|s| f64::from(s.visible)).sum();
        walk.twins[0].frame_count = steps.len();
        walk.twins[0].steps = steps;
        walk.twins[1].steps = walk.twins[0].steps.clone();
        let start = report(PATH, BEGINNING, Direction::Forward);
        Active { depth_sd_m: 0.1, ..Active::new(walk, start, camera(), BodyHeight::given(1.75)) }
    }

    /// A step with this similarity at a position and phase.
    pub fn step(frame: usize, [along_m, cycles]: [f64; 2], similarity: f32) -> Step {
        let state = State {
            along: ConstantVelocity::new(along_m, 1.2, 1e-4, 1e-3),
            height: ConstantVelocity::new(1.15, 0.0, 1e-4, 0.0),
            phase: ConstantVelocity::new(cycles, 0.9, 1e-4, 1e-3),
        };
        Step { similarity, ..step_in(frame, FRAME_S * frame as f64, state) }
    }

    #[test]
    fn the_fit_is_told_how_much_of_the_person_each_frame_shows() {
        let mut walk = active((0..40).map(|k| step(k, [0.06 * k as f64, 0.045 * k as f64], 0.5)).collect());
        walk.walk.twins[0].steps.iter_mut().for_each(|step| step.visible = step.frame as f32 / 64.0);
        let view = View {
            corner: [0, 0],
            pixels: Image::filled(1, 1, [0; 2]),
            is_empty_known: false,
            others: Vec::new(),
            crown_px: None,
        };
        let options = options();
        let frames = walk.tracked(&options).frames(vec![view; 40]);
        assert_eq!(frames.len(), 40);
        for (k, frame) in frames.iter().enumerate() {
            assert_eq!(frame.visible, k as f64 / 64.0);
        }
    }

    #[test]
    fn a_walk_that_ends_earlier_keeps_no_later_frames() {
        let mut walk = active((0..20).map(|k| step(k, [0.06 * k as f64, 0.045 * k as f64], 0.5)).collect());
        walk.kept = frames_on(20, FRAME_S, &PATH.into(), &PATH.into());
        walk.frontal = Some(walk.recorded());
        walk.end_before(FRAME_S * 12.0 - 1e-6);
        assert_eq!((walk.steps().len(), walk.kept.len()), (12, 12));
        assert_eq!(walk.frontal.map(|frontal| frontal.paces.len()), Some(12));
    }

    #[test]
    fn bodies_overlap_in_the_frames_of_both() {
        let walk = |from: usize, ahead_m: f64| {
            let at = |k: usize| [ahead_m + 1.2 * FRAME_S * k as f64, 0.9 * FRAME_S * k as f64];
            active((from..from + 20).map(|k| step(k, at(k), 0.5)).collect())
        };
        let first = walk(0, 0.0);
        assert!((first.overlap(&walk(10, 0.0)) - 1.0).abs() < 1e-9);
        let beside = first.overlap(&walk(0, 0.3));
        assert!((0.2..0.7).contains(&beside), "{beside}");
        assert_eq!(first.overlap(&walk(0, 3.0)), 0.0, "elsewhere");
        assert_eq!(first.overlap(&walk(20, 0.0)), 0.0, "later");
    }

    /// Frames with the contours of a person who walks along `route` and the rectangles of a person who walks along `seen`.
    pub fn frames_on(
        count: usize,
        frame_s: f64,
        route: &Route,
        seen: &Route,
    ) -> Vec<(Option<Sighting>, FrameEdges)> {
        let (walker, camera) = (walker(), camera());
        let frame = |k: usize| {
            let time_s = frame_s * k as f64;
            let along_m = -0.6 + 1.2 * time_s;
            let height_m = walker.level_torso_height_m();
            let scene = Scene::new(&walker, &camera, &route.at(along_m));
            let edges = edges_of(&scene, &Hypothesis { along_m, height_m, phase: 0.2 + 0.9 * time_s });
            (
                Some(Sighting {
                    time_s,
                    rectangle: rectangle_of(&walker, &camera, &seen.at(along_m), along_m),
                }),
                FrameEdges::of_one_alone(k, time_s, WINDOW, edges),
            )
        };
        (0..count).map(frame).collect()
    }

    pub fn options() -> TrackerOptions {
        TrackerOptions { start_frames: 5, fit: None, ..TrackerOptions::for_height(1.75) }
    }
}
