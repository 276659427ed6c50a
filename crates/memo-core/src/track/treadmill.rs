//! Walking on a treadmill: the legs walk and the body stays where it is.
//!
//! Rectangles show the direction of a walk by their drift. On a treadmill this is noise, so more frames are collected
//! before a walk on the spot can begin (`Standing`), and the model is compared with them in a fan of headings, the
//! whole cycle each. Arms are left out, because arms also swing in people who stand.
//!
//! The fan has a broad maximum and cannot tell a heading from its mirror image at the line of sight with left and right
//! exchanged: their outlines are the same in parallel projection. The fit of the person compares both, because feet
//! ahead stand higher or lower in the image than feet behind ([`fit`](super::fit)). Walking backwards on a treadmill is
//! not looked for.

use super::active::Active;
use super::decisions::{SLOWEST_MPS, TREADMILL_CONTRAST};
use super::fit::MirroredHeading;
use super::fit::belt::Belt;
use super::fit::views::Backdrop;
use super::height::BodyHeight;
use super::locate::Course;
use super::options::TrackerOptions;
use super::rate::lasting;
use super::result::TrackedWalk;
use super::search::{Grid, Path, Scene, search_each_phase};
use super::standing::Standing;
use super::start::{CadenceRange, Direction, PhaseCurve, StartReport, phase_lines, start};
use super::walk::{FrameEdges, Walk, WalkOptions};
use crate::calibrate::TiltEstimate;
use crate::model::{Camera, Walker};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Headings of the fan: every 15 degrees.
const HEADINGS: usize = 24;
/// Half widths of the search at each heading, along the path and in height, metres.
const REACH_M: [f64; 2] = [0.1, 0.04];
/// Every third frame is compared.
const EVERY: usize = 3;
/// Arms in the order of the parts of the body.
const ARMS: std::ops::Range<usize> = 2..8;

/// What is known of the treadmill of a walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Treadmill {
    /// Speed of the belt and its standard deviation with that of the distance from the camera.
    pub belt: Belt,
    /// The heading that looks alike, if it is another one.
    pub mirrored: Option<MirroredHeading>,
}

impl TrackedWalk {
    /// The treadmill; `None` over ground. Without a fit of the person, the belt has the speed of the average gait.
    pub fn treadmill(&self) -> Option<Treadmill> {
        let belt = self.belt();
        let sd_mps = belt.sd_mps.hypot(self.scale_sd() * belt.speed_mps);
        let mirrored = self.fitted().and_then(|fit| fit.mirrored);
        self.is_on_treadmill.then_some(Treadmill { belt: Belt { sd_mps, ..belt }, mirrored })
    }

    /// Speed of the belt without the distance's standard deviation, m/s; 0 over ground.
    pub(super) fn belt(&self) -> Belt {
        if !self.is_on_treadmill {
            return Belt { speed_mps: 0.0, sd_mps: 0.0 };
        }
        self.fitted().and_then(|fit| fit.belt).unwrap_or_else(|| self.belt_of_average_gait())
    }

    /// The speed at which the model's ankle moves backwards in the middle of its stance, at the walk's cadence.
    fn belt_of_average_gait(&self) -> Belt {
        let walker = &self.walk.walker;
        let ankle = |phase: f64| walker.pose(DVec3::ZERO, 0.0, phase).right.ankle.x;
        let [begin, end] = MIDDLE_OF_STANCE;
        let metres_per_cycle = (ankle(begin) - ankle(end)) / (end - begin);
        let steps = self.steps();
        let rate_hz = match (steps.first(), steps.last()) {
            (Some(first), Some(last)) if last.time_s > first.time_s => {
                (last.state.phase.position - first.state.phase.position) / (last.time_s - first.time_s)
            }
            _ => 0.0,
        };
        let speed_mps = metres_per_cycle * rate_hz;
        Belt { speed_mps, sd_mps: AVERAGE_GAIT_SHARE * speed_mps.abs() }
    }
}

/// Phases between which the foot of the average gait is flat.
const MIDDLE_OF_STANCE: [f64; 2] = [0.1, 0.4];
/// Standard deviation over people of the speed at the same cadence, as a share of it.
const AVERAGE_GAIT_SHARE: f64 = 0.15;

/// Who moves farther in the frames of a start is not on a treadmill, also where one was asked for, metres. Chosen, not varied.
const LONGEST_DRIFT_M: f64 = 1.0;

/// What a start on the spot needs besides the frames.
pub(super) struct Spot<'a> {
    pub(super) camera: Camera,
    /// How the assumed camera is tilted; `None` of a given one.
    pub(super) tilt: Option<TiltEstimate>,
    /// The courses of the rectangles as of somebody who walks along the image plane: by both rows, if they fit a person, and
    /// by each row alone.
    pub(super) courses: Vec<Course>,
    pub(super) height: BodyHeight,
    pub(super) walker: Walker,
    pub(super) backdrop: &'a Backdrop,
    pub(super) options: &'a TrackerOptions,
}

impl Spot<'_> {
    /// Starts a walk on the spot; `None` if the thing moves on, or if its legs do not walk.
    pub(super) fn begin(&self, standing: Standing) -> Result<Active, Standing> {
        let is_forced = self.options.treadmill == Some(true);
        let moves_on = |course: &Course| match is_forced {
            // Belts are short.
            true => course.speed_mps * standing.lasts_s() > LONGEST_DRIFT_M,
            false => course.speed_mps >= SLOWEST_MPS,
        };
        if self.courses.first().is_none_or(moves_on) {
            return Err(standing);
        }
        let frames: Vec<&FrameEdges> = standing
            .kept
            .iter()
            .map(|(_, edges)| edges)
            .step_by(lasting(EVERY, standing.every_s()))
            .collect();
        let Some((course, start)) = self.start(&frames) else { return Err(standing) };
        let Self { camera, tilt, height, walker, options, .. } = self;
        let walk = Walk::new(walker.clone(), start.path, start.beginning);
        let walk = walk.through(standing.kept.iter().map(|(_, edges)| edges), camera, &options.walk);
        Ok(Active {
            tilt: *tilt,
            depth_sd_m: course.depth_sd_m,
            kept: standing.kept,
            pieces: standing.pieces,
            feet: standing.feet,
            is_on_treadmill: true,
            early: Some(self.backdrop.clone()),
            ..Active::new(walk, start, camera.clone(), *height)
        })
    }

    /// The start of a walk where the model is most similar: in the best heading of a fan at the first course, and at those
    /// that contradict it.
    fn start(&self, frames: &[&FrameEdges]) -> Option<(&Course, StartReport)> {
        let mut options = self.options.walk;
        options.similarity.part_weights[ARMS].fill(0.0);
        let (walker, camera, cadence) = (&self.walker, &self.camera, &self.options.cadence);
        let fan = Fan { frames, walker, camera, cadence, options: &options };
        // Where no row is wrong, both together are more accurate.
        let first = self.courses.first()?;
        let contradicts = |other: &Course| place(other).distance(place(first)) > other.depth_sd_m;
        let courses =
            self.courses.iter().filter(|course| std::ptr::eq(*course, first) || contradicts(course));
        let best = courses.filter_map(|course| Some((course, fan.best(place(course))?)));
        let higher =
            |best: (_, (f64, f64)), next: (_, (f64, f64))| if next.1.1 > best.1.1 { next } else { best };
        let (course, (heading_rad, _)) = best.reduce(higher)?;
        let path = Path { origin: place(course), heading_rad };
        let headed = Course { path, along_m: vec![0.0; frames.len()], ..course.clone() };
        let start = start(frames, &headed, walker, camera, cadence, &options)?;
        let walks =
            start.contrast() >= TREADMILL_CONTRAST && start.frozen.similarity < start.lines.best.similarity;
        (walks && start.direction == Direction::Forward).then_some((course, start))
    }
}

/// Where a thing stays, on the ground.
fn place(course: &Course) -> DVec2 {
    let Course { path, along_m, .. } = course;
    path.point(along_m.iter().sum::<f64>() / along_m.len() as f64, 0.0).truncate()
}

/// Compares the model with frames in a fan of headings.
struct Fan<'a> {
    frames: &'a [&'a FrameEdges],
    walker: &'a Walker,
    camera: &'a Camera,
    cadence: &'a CadenceRange,
    options: &'a WalkOptions,
}

impl Fan<'_> {
    /// The heading that is most similar to what stays at a place, and its similarity.
    fn best(&self, origin: DVec2) -> Option<(f64, f64)> {
        let heading = |k: usize| {
            let heading_rad = TAU * k as f64 / HEADINGS as f64;
            self.similarity(&Path { origin, heading_rad }).map(|similarity| (heading_rad, similarity))
        };
        let fan: Vec<(f64, f64)> = (0..HEADINGS).into_par_iter().filter_map(heading).collect();
        fan.into_iter().reduce(|best, next| if next.1 > best.1 { next } else { best })
    }

    /// The similarity along the best line of phase of somebody who stays at the origin of a path.
    fn similarity(&self, path: &Path) -> Option<f64> {
        let scene = Scene::new(self.walker, self.camera, path);
        let grid = Grid::whole_cycle_within(0.0, self.walker.level_torso_height_m(), REACH_M);
        let WalkOptions { similarity, hidden_lines, .. } = self.options;
        let curve = |frame: &&FrameEdges| {
            let found = search_each_phase(&frame.edges, &scene, &grid, similarity, *hidden_lines);
            let scores = found.curve().iter().map(|(_, score)| *score).collect();
            PhaseCurve { time_s: frame.time_s, scores }
        };
        let curves: Vec<PhaseCurve> = self.frames.iter().map(curve).collect();
        phase_lines(&curves, self.cadence).map(|lines| lines.best.similarity)
    }
}

#[cfg(test)]
mod tests {
    use super::super::locate::Sighting;
    use super::super::locate::{Crown, Rows, locate_by};
    use super::super::result::tests::tracked;
    use super::super::search::Hypothesis;
    use super::super::search::mirrored;
    use super::super::search::tests::{camera, edges_of, rectangle_of, walker};
    use super::super::walk::FrameEdges;
    use super::super::walk::WalkOptions;
    use super::*;
    use crate::image::Rectangle;
    use std::f64::consts::PI;

    const PLACE: DVec2 = DVec2::new(0.2, 0.3);

    fn path(heading_rad: f64) -> Path {
        Path { origin: PLACE, heading_rad }
    }

    /// Twelve frames of the contours and rectangles of a person who stays, with legs and arms at these rates and
    /// drifting at this speed.
    fn standing(heading_rad: f64, rate_hz: f64, drift_mps: f64) -> Standing {
        let (walker, camera) = (walker(), camera());
        let path = path(heading_rad);
        let scene = Scene::new(&walker, &camera, &path);
        let height_m = walker.level_torso_height_m();
        let window = Rectangle { left: 0, top: 0, right: 639, bottom: 479 };
        let frame = |k: usize| {
            let time_s = 0.1 * k as f64;
            let along_m = drift_mps * time_s;
            let edges = edges_of(&scene, &Hypothesis { along_m, height_m, phase: 0.3 + rate_hz * time_s });
            (
                Some(Sighting { time_s, rectangle: rectangle_of(&walker, &camera, &path, along_m) }),
                FrameEdges::of_one_alone(k, time_s, window, edges),
            )
        };
        Standing { kept: (0..12).map(frame).collect(), ..Standing::default() }
    }

    fn begun(standing: Standing, treadmill: Option<bool>) -> Option<Active> {
        let options = TrackerOptions { treadmill, fit: None, ..TrackerOptions::for_height(1.75) };
        let (walker, backdrop) = (walker(), Backdrop::default());
        let crown = Crown { height_m: walker.level_crown_height_m(), sd_m: 0.02 };
        let (sightings, camera) = (standing.sightings(), camera());
        let ways = [Rows::Both, Rows::Soles, Rows::Crown].into_iter();
        let courses = ways.filter_map(|rows| locate_by(rows, &sightings, &camera, &crown).ok()).collect();
        let height = BodyHeight::given(1.75);
        let (backdrop, options) = (&backdrop, &options);
        let spot = Spot { camera, tilt: None, courses, height, walker, backdrop, options };
        spot.begin(standing).ok()
    }

    #[test]
    fn legs_that_walk_on_the_spot_begin_a_walk_in_their_heading() {
        let heading_rad = PI - 0.5;
        let active = begun(standing(heading_rad, 0.9, 0.0), None).unwrap();
        assert!(active.is_on_treadmill && active.start.direction == Direction::Forward);
        let found = active.walk.route.at(0.0);
        let off = |path: &Path| (path.heading_rad - heading_rad).sin().abs();
        // The mirrored heading has the same outlines, but not the one that faces the other way.
        assert!(off(&found).min(off(&mirrored(&found, &camera()))) < 0.3, "{heading_rad}: {found:?}");
        assert!((found.heading_rad - heading_rad).cos() > 0.3);
        assert!((active.start.lines.best.rate_hz - 0.9).abs() < 0.05);
        assert!(found.origin.distance(PLACE) < 0.1, "{found:?}");
        assert_eq!(active.walk.twins[0].steps.len(), 12);
    }

    /// Before a wall of the colour of the shirt, changes show the legs and some arm; on a bright floor, the reflection too.
    #[test]
    fn a_walk_on_the_spot_begins_where_its_person_is_though_one_row_is_wrong() {
        for (share, below_px) in [(0.0, 0), (0.25, 0), (0.35, 0), (0.45, 0), (0.0, 40)] {
            let mut seen = standing(PI, 0.9, 0.0);
            for sighting in seen.kept.iter_mut().filter_map(|(sighting, _)| sighting.as_mut()) {
                let rectangle = &mut sighting.rectangle;
                rectangle.top += (share * rectangle.height() as f64) as usize;
                rectangle.bottom += below_px;
            }
            let active = begun(seen, None).unwrap();
            let off_m = active.walk.route.at(0.0).origin.distance(PLACE);
            assert!(off_m < 0.2, "{share}, {below_px} px: {off_m}");
        }
    }

    /// Legs alone, seen as somebody far away: the heading in which that somebody is most similar is not the person's.
    #[test]
    fn each_place_is_looked_at_in_its_own_heading() {
        for heading_rad in [0.0, 0.5, PI - 0.5, PI, PI + 0.5] {
            let mut seen = standing(heading_rad, 0.9, 0.0);
            for sighting in seen.kept.iter_mut().filter_map(|(sighting, _)| sighting.as_mut()) {
                let rectangle = &mut sighting.rectangle;
                rectangle.top += (0.38 * rectangle.height() as f64) as usize;
            }
            let active = begun(seen, None).unwrap();
            let off_m = active.walk.route.at(0.0).origin.distance(PLACE);
            assert!(off_m < 0.2, "{heading_rad}: {off_m}");
        }
    }

    /// Without a fit, the speed is that of the walker whose legs swing like that over ground.
    #[test]
    fn the_belt_of_the_average_gait_has_the_walker_s_speed() {
        let active = begun(standing(PI - 0.5, 0.9, 0.0), None).unwrap();
        let walk = tracked(active.walk, active.start, WalkOptions::default());
        let belt = TrackedWalk { is_on_treadmill: true, ..walk }.belt();
        // In single stance the body moves over the ankle, which lies still: by its way while the other leg swings.
        let ankle = |phase: f64| walker().pose(DVec3::ZERO, 0.0, phase).right.ankle.x;
        let swing = 0.5 - 0.11;
        let speed_mps = 0.9 * (ankle(0.11) - ankle(0.11 + swing)) / swing;
        assert!((belt.speed_mps / speed_mps - 1.0).abs() < 0.15, "{belt:?} of {speed_mps}");
        assert_eq!(belt.sd_mps, AVERAGE_GAIT_SHARE * belt.speed_mps);
    }

    #[test]
    fn what_moves_on_or_stands_begins_no_walk_on_the_spot() {
        assert!(begun(standing(0.0, 0.9, 1.2), None).is_none(), "a walk over ground");
        assert!(
            begun(standing(0.0, 0.9, 1.2), Some(true)).is_none(),
            "over ground, although a treadmill was asked for"
        );
        assert!(begun(standing(0.0, 0.0, 0.0), Some(true)).is_none(), "somebody stands");
    }

    #[test]
    fn a_mirrored_heading_is_that_at_the_line_of_sight() {
        let camera = camera();
        for heading_rad in [0.4, 2.0, -1.2] {
            let there = mirrored(&path(heading_rad), &camera);
            let sight = (PLACE - camera.position().truncate()).normalize();
            let [ahead, other] = [DVec2::from_angle(heading_rad), there.direction()];
            assert!((ahead.dot(sight) + other.dot(sight)).abs() < 1e-12);
            assert!((ahead.dot(sight.perp()) - other.dot(sight.perp())).abs() < 1e-12);
            assert_eq!(there.origin, PLACE);
        }
    }

    fn edges(frame: usize) -> FrameEdges {
        let window = Rectangle { left: 10, top: 10, right: 60, bottom: 90 };
        FrameEdges::of_one_alone(frame, 0.04 * frame as f64, window, Vec::new())
    }

    #[test]
    fn frames_of_what_was_gone_or_is_elsewhere_are_forgotten() {
        let rectangle = Rectangle { left: 20, top: 20, right: 50, bottom: 80 };
        let seen = Some(Sighting { time_s: 0.0, rectangle });
        let three = Standing::default().with(seen, None, edges(0), None).with(None, None, edges(1), None);
        let three = three.with(seen, None, edges(2), None);
        assert_eq!((three.kept.len(), three.sightings().len()), (3, 2));
        let wider = Rectangle { right: 70, ..rectangle };
        assert_eq!(three.window(Some(&wider)), Some(rectangle.union(&wider)));
        assert_eq!(three.window(None), Some(rectangle));
        let far = Rectangle { left: 200, right: 230, ..rectangle };
        assert_eq!(three.window(Some(&far)), Some(far));
        let elsewhere = FrameEdges { window: far, ..edges(3) };
        assert_eq!(
            Standing::default().with(seen, None, edges(2), None).with(seen, None, elsewhere, None).kept.len(),
            1
        );
        let gone = (3..6).fold(three, |standing, k| standing.with(None, None, edges(k), None));
        assert_eq!(gone.kept.len(), 6);
        assert_eq!(gone.with(seen, None, edges(6), None).kept.len(), 1);
        assert_eq!(Standing::default().window(None), None);
    }

    #[test]
    fn frames_before_a_walk_come_first_and_once() {
        let with = |standing: Standing, k: usize| standing.with(None, None, edges(k), None);
        let before = (0..4).fold(Standing::default(), |standing, k| {
            let seen = Sighting { time_s: 0.0, rectangle: edges(0).window };
            standing.with(Some(seen), None, edges(k), None)
        });
        let walk: Vec<_> = (2..6).map(|k| (None, edges(k))).collect();
        let all = before.followed_by(&walk, &[], &Default::default());
        let frames = |standing: &Standing| standing.kept.iter().map(|(_, e)| e.frame).collect::<Vec<_>>();
        assert_eq!(frames(&all), [0, 1, 2, 3, 4, 5]);
        assert_eq!(frames(&all.later(4)), [4, 5]);
        assert!(with(Standing::default(), 0).later(9).kept.is_empty());
    }
}
