//! Walking towards the camera or away from it.
//!
//! Seen along the path, the contours of all phases are nearly the same, so a search of the contours does not find the
//! phase. The feet show it: the ray of the lowest changed row meets the ground at the foot that is nearer to the camera.
//! With the place x along the path and the reach F of the model's nearer foot,
//!
//! f(t) = x(t) + F(x(t), phase(t)).
//!
//! 1. The path is the line through those points.
//! 2. A walk starts on the line of phase whose steps leave the least of f, if they leave so much less than even motion
//!    does that it is not one of many lines by chance.
//! 3. Place and phase of every frame, with slowly changing speed and cadence, are solved for by Gauss and Newton's
//!    method.
//! 4. When the walk is over, the path is the line through the feet of all its frames, on which they are followed again.
//!
//! Both feet reach alike, so the phase is known up to half a cycle: left and right stay open. Only walking forwards is
//! looked for.

use super::decisions::{ALONG_THE_SIGHT_RAD, COMMON_ROW_SD_PX, FASTEST_MPS, FRONTAL_GAIN, SLOWEST_MPS};
use super::locate::{MASK_MARGIN_PX, Sighting};
use super::route::Route;
use super::search::{Hypothesis, Path};
use super::standing::Standing;
use super::start::CadenceRange;
use super::walk::{Beginning, State, Walk};
use crate::estimate::arrow::{Arrow, velocity_change};
use crate::estimate::kalman::ConstantVelocity;
use crate::estimate::line::line_through;
use crate::model::{Camera, Walker};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Phases in the table of reaches.
const PHASES: usize = 64;
/// Distance of the places in the table of reaches, metres.
const NODE_M: f64 = 0.5;
/// Lines of phase that are compared at a start: cadences, and phases within half a cycle.
const RATES: usize = 40;
const OFFSETS: usize = 25;
/// How much earlier in the cycle the nearer foot is seen than it stands there, of people who come nearer and who go away.
/// Changes show feet while they move: in front, a foot goes out of sight soon after it has landed, and behind, it comes
/// into sight only when it is lifted. Measured on people drawn by two programs: 0.11 to 0.15, and -0.10 to -0.21.
const LEAD: [f64; 2] = [0.12, -0.15];
/// The lowest changes of who goes away are nearer to the camera than the ankle, by so many lengths of the foot. Measured on
/// people drawn by two programs: in the mean of a walk, 24 of four people are -0.07 to 0.13 m off along the path, and ten of five
/// others -0.09 to 0.03 m. Of who comes nearer, 17 are -0.16 to -0.02 m off and nine of the others 0.17 to 0.33 m, so nothing
/// is added.
const SHOE: f64 = 1.25;
/// How far the feet of walkers are off their line of phase, the scale of Cauchy's distribution, metres. Things that are no
/// walkers may be off even motion by any of `SCALES_M`.
const WALKERS_OFF_M: f64 = 0.06;
const SCALES_M: [f64; 8] = [0.02, 0.035, 0.05, 0.075, 0.1, 0.15, 0.3, 0.6];
/// Steps of the reweighted line and of Gauss and Newton's method.
const STEPS: usize = 6;
/// Standard deviation of the reach of people's feet about the model's, metres, and of the lowest row, pixels.
const REACH_SD_M: f64 = 0.08;
const ROW_SD_PX: f64 = 1.5;
/// Residuals of so many neighbouring frames are alike.
const LIKE_FRAMES: f64 = 4.0;
/// Beyond this many standard deviations, residuals count ever less (Cauchy weights).
const CAUCHY_SD: f64 = 1.5;
/// Standard deviations of the place along the route, metres, and of the phase, cycles, that contours show.
const CONTOURS_SD_M: f64 = 0.05;
const CONTOURS_PHASE_SD: f64 = 0.03;
/// On a curve, the feet show place and phase within this angle of the line of sight, and contours beyond it.
const BY_FEET_RAD: f64 = 0.5;
/// Frames that show the speed and cadence with which places and phases go on.
const LEADING: usize = 12;
/// Changes in a second, as standard deviations: of the speed, m/s, and of the cadence, cycles/s.
const SPEED_CHANGE_SD: f64 = 0.1;
const CADENCE_CHANGE_SD: f64 = 0.03;
/// A live walk solves for so many last frames at a time; the first two of them are held.
pub(super) const WINDOW: usize = 250;
const HELD: f64 = 1e6;

/// What the feet of one frame show: where the ray of the lowest row meets the ground, and that of one pixel farther up.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Feet {
    place: DVec2,
    above: DVec2,
}

/// Place along the route and phase (not wrapped) of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pace {
    time_s: f64,
    feet: Option<Feet>,
    /// The same as the contours show it; `None` where only the feet do.
    contours: Option<[f64; 2]>,
    pub(super) along_m: f64,
    phase: f64,
}

/// The lowest rows of a frame: those of the firm changes and of all changes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Lowest {
    pub(super) firm: Option<Sighting>,
    pub(super) all: Option<Sighting>,
}

/// A walk that the feet show where it goes along the line of sight, and contours elsewhere.
#[derive(Debug, Clone)]
pub(super) struct Frontal {
    pub(super) route: Route,
    reach: Reach,
    pub(super) paces: Vec<Pace>,
    /// Whether the feet are those of all changes, or those of the firm ones: of who goes away, and of who comes nearer.
    by_all: [bool; 2],
}

/// How far the lowest row of the nearer foot lies ahead of the torso on the ground, metres, at places along a route.
#[derive(Debug, Clone)]
struct Reach {
    walker: Walker,
    camera: Camera,
    route: Route,
    /// Height of the ankle of a foot that stands.
    ankle_m: f64,
    nodes: BTreeMap<i64, [f64; PHASES]>,
}

impl Reach {
    fn new(walker: &Walker, camera: &Camera, route: &Route) -> Self {
        let ankle_m = |k: usize| walker.pose(DVec3::ZERO, 0.0, k as f64 / PHASES as f64).right.ankle.z;
        let lowest_m = (0..PHASES).map(ankle_m).fold(f64::INFINITY, f64::min);
        Self {
            walker: walker.clone(),
            camera: camera.clone(),
            route: route.clone(),
            ankle_m: lowest_m + walker.level_torso_height_m(),
            nodes: BTreeMap::new(),
        }
    }

    /// The reach at a place and phase, with its slopes by both.
    fn at(&mut self, along_m: f64, phase: f64) -> [f64; 3] {
        let (x, y) = (along_m / NODE_M, phase.rem_euclid(1.0) * PHASES as f64);
        let (node, t) = (x.floor() as i64, x - x.floor());
        let (k, u) = (y.floor() as usize % PHASES, y - y.floor());
        let [[a, b], [c, d]] = [node, node + 1].map(|node| {
            let values = self.node(node);
            [values[k], values[(k + 1) % PHASES]]
        });
        let [near, far] = [a + u * (b - a), c + u * (d - c)];
        let by_phase = PHASES as f64 * ((1.0 - t) * (b - a) + t * (d - c));
        [near + t * (far - near), (far - near) / NODE_M, by_phase]
    }

    fn node(&mut self, node: i64) -> [f64; PHASES] {
        if let Some(values) = self.nodes.get(&node) {
            return *values;
        }
        let along_m = node as f64 * NODE_M;
        let path = self.route.at(along_m);
        let foot_m = self.walker.body.proportions.foot * self.walker.body.height_m;
        let comes_nearer = comes_nearer(&path, along_m, &self.camera);
        let [lead, shoe_m] = if comes_nearer { [LEAD[0], 0.0] } else { [LEAD[1], -SHOE * foot_m] };
        let values = std::array::from_fn(|k| {
            let phase = k as f64 / PHASES as f64 + lead;
            // Both sides have the same curve, half a cycle apart.
            0.5 * (self.nearer(&path, along_m, phase) + self.nearer(&path, along_m, phase + 0.5)) + shoe_m
        });
        self.nodes.insert(node, values);
        values
    }

    /// The reach of the foot whose sole is lower in the image, below the torso; 0 where the camera does not see it.
    fn nearer(&self, path: &Path, along_m: f64, phase: f64) -> f64 {
        let height_m = self.walker.level_torso_height_m() + self.walker.gait.vertical_m(phase);
        let torso = path.point(along_m, height_m);
        let posed = self.walker.pose(torso, path.heading_rad, phase);
        let soles = [posed.right, posed.left].map(|side| side.ankle - self.ankle_m * DVec3::Z);
        let pixels = soles.iter().filter_map(|sole| self.camera.project_ideal(*sole));
        let lowest = pixels.map(|pixel| pixel.y).reduce(f64::max);
        let column = self.camera.project_ideal(torso).map(|pixel| pixel.x);
        let pixel = column.zip(lowest).map(|(x, y)| DVec2::new(x, y));
        let point = pixel.and_then(|pixel| self.camera.ground_point(pixel));
        point.map_or(0.0, |point| path.along(point.truncate()) - along_m)
    }
}

impl Feet {
    /// Metres on the ground per pixel of the lowest row.
    fn row_m(&self) -> f64 {
        self.place.distance(self.above)
    }
}

/// Where the lowest changes of a rectangle lie on the ground, and one pixel farther up; `None` above the horizon.
fn feet(sighting: &Sighting, camera: &Camera) -> Option<Feet> {
    let r = &sighting.rectangle;
    let (middle, bottom) = (0.5 * (r.left + r.right) as f64, r.bottom as f64 - MASK_MARGIN_PX);
    let on_ground = |row: f64| {
        let pixel = DVec2::new(middle, row);
        camera.ground_point(camera.undistort(pixel).ok()?).map(DVec3::truncate)
    };
    Some(Feet { place: on_ground(bottom)?, above: on_ground(bottom - 1.0)? })
}

/// A line of phase that explains the feet.
struct Line {
    /// Time of the first frame.
    first_s: f64,
    phase_at_start: f64,
    rate_hz: f64,
    /// Place at the first frame and speed.
    place: [f64; 2],
    /// Logarithm of the likelihood of the feet on it.
    likelihood: f64,
}

impl Frontal {
    /// A walk of which nothing was seen yet.
    fn on_route(route: &Route, walker: &Walker, camera: &Camera) -> Self {
        let reach = Reach::new(walker, camera, route);
        Self { route: route.clone(), reach, paces: Vec::new(), by_all: [true, false] }
    }

    /// The walk that the feet of some frames show; `None` if they show none. Feet that come nearer are seen best in the
    /// firm changes, and those that go away in all changes, so both are tried.
    pub(super) fn begin(
        standing: &Standing,
        camera: &Camera,
        walker: &Walker,
        rates: &CadenceRange,
    ) -> Option<Self> {
        let firm: Vec<Sighting> = standing.sightings();
        let all: Vec<Sighting> = standing.feet.values().copied().collect();
        let tried = [(false, firm), (true, all)]
            .map(|(by_all, sightings)| Self::on_line(&sightings, by_all, camera, walker, rates));
        let (gain, mut frontal, line) =
            tried.into_iter().flatten().reduce(|a, b| if b.0 > a.0 { b } else { a })?;
        if gain < FRONTAL_GAIN || line.place[1] < SLOWEST_MPS {
            return None;
        }
        for (firm, edges) in &standing.kept {
            let seen = Lowest { firm: *firm, all: standing.feet.get(&edges.frame).copied() };
            let elapsed_s = edges.time_s - line.first_s;
            let along_m = line.place[0] + line.place[1] * elapsed_s;
            let phase = line.phase_at_start + line.rate_hz * elapsed_s;
            let feet = frontal.feet_of(&seen, along_m);
            frontal.paces.push(Pace { time_s: edges.time_s, feet, contours: None, along_m, phase });
        }
        frontal.solve(0);
        Some(frontal)
    }

    /// The walk that contours followed so far.
    pub(super) fn of_steps(walk: &Walk, lowest: impl Fn(usize) -> Lowest, camera: &Camera) -> Self {
        let mut frontal = Self::on_route(&walk.route, &walk.walker, camera);
        let best = walk.best();
        for step in &walk.twins[best].steps {
            let (along_m, phase) = (step.state.along.position, step.state.phase.position - 0.5 * best as f64);
            let feet = frontal.feet_of(&lowest(step.frame), along_m);
            let contours = Some([along_m, phase]);
            frontal.paces.push(Pace { time_s: step.time_s, feet, contours, along_m, phase });
        }
        frontal
    }

    /// The best line of phase through sightings, and how much more likely it is than even motion.
    fn on_line(
        sightings: &[Sighting],
        by_all: bool,
        camera: &Camera,
        walker: &Walker,
        rates: &CadenceRange,
    ) -> Option<(f64, Self, Line)> {
        // 1. The path.
        let seen: Vec<(f64, DVec2)> =
            sightings.iter().filter_map(|s| Some((s.time_s, feet(s, camera)?.place))).collect();
        let (path, speed_mps) = path_through(&seen)?;
        let is_along = off_the_sight_rad(&path, 0.0, camera) < ALONG_THE_SIGHT_RAD;
        if !(SLOWEST_MPS..FASTEST_MPS).contains(&speed_mps) || !is_along {
            return None;
        }
        let mut frontal = Self::on_route(&path.into(), walker, camera);
        frontal.by_all[usize::from(comes_nearer(&path, 0.0, camera))] = by_all;
        // 2. The best line of phase against even motion.
        let points: Vec<(f64, f64)> = seen.iter().map(|(t, place)| (*t, path.along(*place))).collect();
        let line = frontal.best_line(&points, rates)?;
        let gain = (line.likelihood - evenly(&points)) / LIKE_FRAMES;
        Some((gain, frontal, line))
    }

    /// Whether feet and not contours show a place and its phase. A straight walk was started by the feet.
    pub(super) fn is_along(&self, along_m: f64) -> bool {
        self.route.is_straight()
            || off_the_sight_rad(&self.route.at(along_m), along_m, &self.reach.camera) < BY_FEET_RAD
    }

    fn feet_of(&self, seen: &Lowest, along_m: f64) -> Option<Feet> {
        let camera = &self.reach.camera;
        let by_all = self.by_all[usize::from(comes_nearer(&self.route.at(along_m), along_m, camera))];
        feet(&if by_all { seen.all } else { seen.firm }?, camera)
    }

    /// The same walk on the line through the feet of all frames, with the variances of place and phase.
    pub(super) fn on_path_of_all(&self) -> Option<(Self, Vec<[f64; 2]>)> {
        let seen: Vec<(f64, DVec2)> =
            self.paces.iter().filter_map(|pace| Some((pace.time_s, pace.feet?.place))).collect();
        let (path, _) = path_through(&seen)?;
        let mut renewed = self.moved_to(&path.into());
        let variances = renewed.solve(0)?;
        Some((renewed, variances))
    }

    /// The same places on another route.
    pub(super) fn moved_to(&self, route: &Route) -> Self {
        let reach = Reach::new(&self.reach.walker, &self.reach.camera, route);
        let mut moved = Self { route: route.clone(), reach, ..self.clone() };
        for pace in &mut moved.paces {
            let place = |along_m: f64| route.along(self.route.place(along_m), along_m);
            pace.along_m = place(pace.along_m);
            pace.contours = pace.contours.map(|[along_m, phase]| [place(along_m), phase]);
        }
        moved
    }

    /// The line of phase from which feet at (time, place) are the least off.
    fn best_line(&mut self, points: &[(f64, f64)], rates: &CadenceRange) -> Option<Line> {
        let ([first_m, speed_mps], _) = reweighted_line(points);
        let first_s = points.first()?.0;
        let mut best: Option<Line> = None;
        for k in 0..RATES * OFFSETS {
            let rate_hz =
                rates.low_hz + (rates.high_hz - rates.low_hz) * (k / OFFSETS) as f64 / (RATES - 1) as f64;
            let phase_at_start = 0.5 * (k % OFFSETS) as f64 / OFFSETS as f64;
            let bodies: Vec<(f64, f64)> = points
                .iter()
                .map(|(t, along_m)| {
                    let elapsed_s = t - first_s;
                    let near_m = first_m + speed_mps * elapsed_s;
                    (*t, along_m - self.reach.at(near_m, phase_at_start + rate_hz * elapsed_s)[0])
                })
                .collect();
            let (place, off_m) = reweighted_line(&bodies);
            let likelihood = likelihood(&off_m, WALKERS_OFF_M);
            if best.as_ref().is_none_or(|best| likelihood > best.likelihood) {
                best = Some(Line { first_s, phase_at_start, rate_hz, place, likelihood });
            }
        }
        best
    }

    /// State at the first frame.
    pub(super) fn beginning(&self) -> Beginning {
        let (first, last) = (&self.paces[0], &self.paces[self.paces.len() - 1]);
        let elapsed_s = last.time_s - first.time_s;
        Beginning {
            time_s: first.time_s,
            along_m: first.along_m,
            phase: first.phase,
            speed_mps: (last.along_m - first.along_m) / elapsed_s,
            rate_hz: (last.phase - first.phase) / elapsed_s,
        }
    }

    /// Standard deviation that all places along the path have in common, metres: of the reach of a person and of the
    /// lowest row.
    pub(super) fn depth_sd_m(&self) -> f64 {
        let row_m: Vec<f64> = self.paces.iter().filter_map(|pace| Some(pace.feet?.row_m())).collect();
        let mean_m = row_m.iter().sum::<f64>() / row_m.len().max(1) as f64;
        REACH_SD_M.hypot(COMMON_ROW_SD_PX * mean_m)
    }

    /// A further frame, at first where speed and cadence lead.
    pub(super) fn push(&mut self, time_s: f64, seen: &Lowest) {
        let last = self.paces[self.paces.len() - 1];
        let before = self.paces[self.paces.len().saturating_sub(1 + LEADING)];
        let share = (time_s - last.time_s) / (last.time_s - before.time_s);
        let along_m = last.along_m + share * (last.along_m - before.along_m);
        let phase = last.phase + share * (last.phase - before.phase);
        let feet = self.feet_of(seen, along_m);
        self.paces.push(Pace { time_s, feet, contours: None, along_m, phase });
    }

    /// A frame before the first, near a place, where the phase of the next frames leads.
    pub(super) fn precede(&mut self, time_s: f64, seen: &Lowest, place: DVec2) {
        let (first, later) = (self.paces[0], self.paces[LEADING.min(self.paces.len() - 1)]);
        let rate_hz = (later.phase - first.phase) / (later.time_s - first.time_s);
        let along_m = self.route.along(place, first.along_m);
        let phase = first.phase - rate_hz * (first.time_s - time_s);
        let feet = self.feet_of(seen, along_m);
        self.paces.insert(0, Pace { time_s, feet, contours: None, along_m, phase });
    }

    /// The mean speed of some frames, m/s.
    pub(super) fn speed_mps(&self, range: std::ops::Range<usize>) -> f64 {
        let [first, last] = [range.start, range.end - 1].map(|k| &self.paces[k]);
        (last.along_m - first.along_m) / (last.time_s - first.time_s)
    }

    /// How much more likely (logarithm) the feet of some frames along the line of sight are as solved than in even motion;
    /// `None` if they are too few.
    pub(super) fn gain(&mut self, range: std::ops::Range<usize>) -> Option<f64> {
        let (mut points, mut off_m) = (Vec::new(), Vec::new());
        for k in range {
            let Pace { time_s, feet, along_m, phase, .. } = self.paces[k];
            let Some(feet) = feet.filter(|_| self.is_along(along_m)) else { continue };
            let seen_m = self.route.at(along_m).along(feet.place);
            off_m.push(seen_m - along_m - self.reach.at(along_m, phase)[0]);
            points.push((time_s, seen_m));
        }
        if points.len() < LEADING {
            return None;
        }
        Some((likelihood(&off_m, WALKERS_OFF_M) - evenly(&points)) / LIKE_FRAMES)
    }

    /// Whether feet and not contours show the place and phase of a frame.
    pub(super) fn is_by_feet(&self, k: usize) -> bool {
        self.paces.get(k).is_some_and(|pace| self.is_along(pace.along_m))
    }

    /// What the contours of the better twin show of a frame; the phase is that of the first twin.
    pub(super) fn see(&mut self, k: usize, walk: &Walk) {
        let best = walk.best();
        let (Some(pace), Some(step)) = (self.paces.get_mut(k), walk.twins[best].steps.get(k)) else { return };
        let phase = step.state.phase.position - 0.5 * best as f64;
        // The better twin may have changed.
        let phase = phase - (2.0 * (phase - pace.phase)).round() / 2.0;
        (pace.along_m, pace.phase) = (step.state.along.position, phase);
        pace.contours = Some([pace.along_m, phase]);
    }

    /// Number of frames up to the last one that shows the feet.
    pub(super) fn seen(&self) -> usize {
        self.paces.iter().rposition(|pace| pace.feet.is_some()).map_or(0, |last| last + 1)
    }

    /// The state of one twin in a frame.
    fn state(&self, k: usize, twin: usize, [place, phase]: [f64; 2], before: &State) -> State {
        let pace = &self.paces[k];
        let (a, b) = (&self.paces[k.saturating_sub(1)], &self.paces[(k + 1).min(self.paces.len() - 1)]);
        let rate = |of: fn(&Pace) -> f64| (of(b) - of(a)) / (b.time_s - a.time_s);
        let of = |position, velocity, variance, velocity_sd: f64| {
            ConstantVelocity::new(position, velocity, variance, velocity_sd.powi(2))
        };
        State {
            along: of(pace.along_m, rate(|p| p.along_m), place, SPEED_CHANGE_SD),
            phase: of(pace.phase + 0.5 * twin as f64, rate(|p| p.phase), phase, CADENCE_CHANGE_SD),
            ..*before
        }
    }

    /// Gives both twins the place and phase of a frame, if the feet show it.
    pub(super) fn lay(&mut self, k: usize, variances: [f64; 2], walk: &mut Walk) {
        let is_by_feet = self.is_by_feet(k);
        for (n, twin) in walk.twins.iter_mut().enumerate() {
            let Some(step) = twin.steps.get_mut(k) else { continue };
            step.by_feet = is_by_feet;
            if is_by_feet {
                step.state = self.state(k, n, variances, &step.state);
                step.measured = self.measured(k, &step.state);
            }
        }
    }

    /// What the feet of a frame measure at its phase.
    fn measured(&mut self, k: usize, state: &State) -> Option<Hypothesis> {
        let Pace { feet, along_m, phase, .. } = self.paces[k];
        let reach_m = self.reach.at(along_m, phase)[0];
        let path = self.route.at(along_m);
        feet.map(|feet| Hypothesis { along_m: path.along(feet.place) - reach_m, ..state.hypothesis() })
    }

    /// Solves for places and phases from an index on.
    ///
    /// Smallest Σ w (f - x - F)² / sd² + Σ (change of speed)² / (sd² time) + Σ (change of cadence)² / (sd² time).
    /// Returns the variances of place and phase: of all frames, or of the last one if earlier ones are held.
    pub(super) fn solve(&mut self, from: usize) -> Option<Vec<[f64; 2]>> {
        let mut variances = None;
        for step in 0..STEPS {
            let count = self.paces.len() - from;
            let mut arrow = Arrow::new(count, 2, 0);
            for k in 0..count {
                let Pace { feet, contours, along_m, phase, .. } = self.paces[from + k];
                let [x, p] = [arrow.index(k, 0), arrow.index(k, 1)];
                if from > 0 && k < 2 {
                    arrow.add_row(&[(x, 1.0)], along_m, HELD);
                    arrow.add_row(&[(p, 1.0)], phase, HELD);
                }
                if !self.is_along(along_m) {
                    let Some([seen_m, seen]) = contours else { continue };
                    arrow.add_row(&[(x, 1.0)], seen_m, 1.0 / (LIKE_FRAMES * CONTOURS_SD_M.powi(2)));
                    arrow.add_row(&[(p, 1.0)], seen, 1.0 / (LIKE_FRAMES * CONTOURS_PHASE_SD.powi(2)));
                    continue;
                }
                let Some(feet) = feet else { continue };
                let [reach_m, by_place, by_phase] = self.reach.at(along_m, phase);
                let variance = REACH_SD_M.powi(2) + (ROW_SD_PX * feet.row_m()).powi(2);
                let off_m = self.route.at(along_m).along(feet.place) - along_m - reach_m;
                let weight = 1.0 / (1.0 + off_m * off_m / (CAUCHY_SD * CAUCHY_SD * variance));
                let right = off_m + (1.0 + by_place) * along_m + by_phase * phase;
                arrow.add_row(
                    &[(x, 1.0 + by_place), (p, by_phase)],
                    right,
                    weight / (LIKE_FRAMES * variance),
                );
            }
            for k in 1..count.saturating_sub(1) {
                let time_s = |k: usize| self.paces[from + k].time_s;
                let (factors, lasts_s) =
                    velocity_change(time_s(k) - time_s(k - 1), time_s(k + 1) - time_s(k));
                for (unknown, sd) in [(0, SPEED_CHANGE_SD), (1, CADENCE_CHANGE_SD)] {
                    let terms = [0, 1, 2].map(|n| (arrow.index(k + n - 1, unknown), factors[n]));
                    arrow.add_row(&terms, 0.0, 1.0 / (sd * sd * lasts_s));
                }
            }
            let solution = arrow.clone().solve()?;
            for k in 0..count {
                let pace = &mut self.paces[from + k];
                pace.along_m = solution.frames[2 * k];
                pace.phase = solution.frames[2 * k + 1];
            }
            if step + 1 == STEPS {
                let covariance = solution.covariance();
                let of = |k: usize| [2 * k, 2 * k + 1].map(|i| covariance.variance(&[], &[(i, 1.0)]));
                let wanted = if from == 0 { 0..count } else { count - 1..count };
                variances = Some(wanted.map(of).collect());
            }
        }
        variances
    }
}

/// The angle between a path and the line of sight to a place on it, in either direction.
pub(super) fn off_the_sight_rad(path: &Path, along_m: f64, camera: &Camera) -> f64 {
    let place = path.point(along_m, 0.0).truncate();
    let sight = (place - camera.position().truncate()).normalize_or_zero();
    path.direction().perp_dot(sight).abs().asin()
}

/// Whether who walks on a path comes nearer to the camera at a place on it.
fn comes_nearer(path: &Path, along_m: f64, camera: &Camera) -> bool {
    let place = path.point(along_m, 0.0).truncate();
    path.direction().dot(camera.position().truncate() - place) > 0.0
}

/// The path on which somebody was seen at (time, place) on the ground, and the speed.
fn path_through(seen: &[(f64, DVec2)]) -> Option<(Path, f64)> {
    let first_s = seen.first()?.0;
    let [(vx, x), (vy, y)] = [DVec2::X, DVec2::Y].map(|axis| {
        line_through(&seen.iter().map(|(t, place)| (t - first_s, axis.dot(*place))).collect::<Vec<_>>())
    });
    let velocity = DVec2::new(vx, vy);
    Some((Path { origin: DVec2::new(x, y), heading_rad: velocity.to_angle() }, velocity.length()))
}

/// Place at the first time and speed of the line through (time, place), by Cauchy weights; and how far the points are off,
/// metres.
fn reweighted_line(points: &[(f64, f64)]) -> ([f64; 2], Vec<f64>) {
    let first_s = points.first().map_or(0.0, |p| p.0);
    let mut line = [0.0; 2];
    let mut off_m: Vec<f64> = vec![0.0; points.len()];
    for _ in 0..STEPS {
        let [mut w, mut wt, mut wtt, mut wx, mut wtx] = [0.0; 5];
        for (off_m, (time_s, x)) in off_m.iter().zip(points) {
            let (t, weight) = (time_s - first_s, 1.0 / (1.0 + (off_m / WALKERS_OFF_M).powi(2)));
            w += weight;
            wt += weight * t;
            wtt += weight * t * t;
            wx += weight * x;
            wtx += weight * t * x;
        }
        let speed_mps = (w * wtx - wt * wx) / (w * wtt - wt * wt);
        line = [(wx - speed_mps * wt) / w, speed_mps];
        let off = |(time_s, x): &(f64, f64)| x - line[0] - line[1] * (time_s - first_s);
        off_m = points.iter().map(off).collect();
    }
    (line, off_m)
}

/// Logarithm of the likelihood of points (time, place) of something that moves evenly.
fn evenly(points: &[(f64, f64)]) -> f64 {
    let (_, off_m) = reweighted_line(points);
    SCALES_M.iter().map(|scale_m| likelihood(&off_m, *scale_m)).fold(f64::MIN, f64::max)
}

/// Logarithm of the likelihood of residuals after Cauchy's distribution of this scale, up to a constant.
fn likelihood(off_m: &[f64], scale_m: f64) -> f64 {
    -off_m.iter().map(|off| scale_m.ln() + (off / scale_m).powi(2).ln_1p()).sum::<f64>()
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::decisions::HINDSIGHT_GAIN;
    use super::super::search::tests::{camera, walker};
    use super::super::walk::FrameEdges;
    use super::*;
    use crate::image::Rectangle;

    const FRAME_S: f64 = 0.04;
    const STEP_S: f64 = 0.5;
    pub const SPEED_MPS: f64 = 1.2;
    /// The middle of the picture, and where the walk is half-way through it.
    pub const MIDDLE: DVec2 = DVec2::new(0.0, 0.0);

    /// A frame in which the lowest changes are at a point of the ground.
    fn frame(k: usize, place: DVec2) -> (Option<Sighting>, FrameEdges) {
        let sole = camera().project(place.extend(0.0)).unwrap();
        let [column, bottom] = [sole.x.round() as usize, (sole.y + MASK_MARGIN_PX).round() as usize];
        let rectangle = Rectangle { left: column - 30, right: column + 30, top: bottom - 200, bottom };
        let (window, time_s) = (rectangle, FRAME_S * k as f64);
        let edges = FrameEdges::of_one_alone(k, time_s, window, vec![]);
        (Some(Sighting { time_s, rectangle }), edges)
    }

    pub fn standing(count: usize, foot: impl Fn(f64) -> DVec2) -> Standing {
        let kept = (0..count).map(|k| frame(k, foot(FRAME_S * k as f64))).collect();
        Standing { kept, ..Standing::default() }
    }

    /// Towards the camera, which looks along the y axis.
    pub fn towards() -> DVec2 {
        (camera().position().truncate() - MIDDLE).normalize()
    }

    /// The nearer foot of a model that walks evenly, seen `LEAD` too early: the right heel strikes at 0, the left one a step
    /// later. The picture is rendered and seen elsewhere, in the clothed walks.
    pub fn feet_of_steps(time_s: f64) -> DVec2 {
        let walker = walker();
        let phase = 0.5 * time_s / STEP_S + LEAD[0];
        let along_m = SPEED_MPS * time_s - 1.2;
        let height_m = walker.level_torso_height_m() + walker.gait.vertical_m(phase);
        let torso = (MIDDLE + towards() * along_m).extend(height_m);
        let posed = walker.pose(torso, towards().to_angle(), phase);
        let pixels = [posed.right.ankle, posed.left.ankle]
            .map(|ankle| camera().project_ideal(ankle - 0.055 * DVec3::Z).unwrap());
        let lower = if pixels[0].y > pixels[1].y { pixels[0] } else { pixels[1] };
        camera().ground_point(lower).unwrap().truncate()
    }

    /// The same rectangle by both kinds of changes.
    fn lowest(sighting: Option<Sighting>) -> Lowest {
        Lowest { firm: sighting, all: sighting }
    }

    fn begun(standing: &Standing) -> Option<Frontal> {
        Frontal::begin(standing, &camera(), &walker(), &CadenceRange::default())
    }

    #[test]
    fn steps_towards_the_camera_show_path_speed_and_cadence() {
        let frontal = begun(&standing(66, feet_of_steps)).unwrap();
        let beginning = frontal.beginning();
        assert!(frontal.route.at(0.0).direction().dot(towards()) > 0.998, "{:?}", frontal.route);
        assert!((beginning.speed_mps - SPEED_MPS).abs() < 0.06, "{beginning:?}");
        assert!((beginning.rate_hz - 0.5 / STEP_S).abs() < 0.03, "{beginning:?}");
        for pace in &frontal.paces {
            let off = 2.0 * pace.phase - pace.time_s / STEP_S;
            assert!((off - off.round()).abs() < 0.06, "{}: {off}", pace.time_s);
            assert!(
                (pace.along_m - frontal.route.at(0.0).along(MIDDLE) + 1.2 - SPEED_MPS * pace.time_s).abs()
                    < 0.05
            );
        }
    }

    #[test]
    fn even_motion_and_noise_about_it_start_nobody() {
        let even = |t: f64| MIDDLE + towards() * (SPEED_MPS * t - 1.2);
        assert!(begun(&standing(66, even)).is_none());
        // Rocking at the rate of steps, but by much less than legs reach, and noise.
        let rocking = |t: f64| even(t) + towards() * 0.04 * (t / STEP_S * std::f64::consts::TAU).sin();
        assert!(begun(&standing(66, rocking)).is_none());
        let noisy = |t: f64| even(t) + towards() * 0.3 * ((t * 1e4).sin() * 43_758.5).fract();
        assert!(begun(&standing(66, noisy)).is_none());
        // What stays, and what cannot be seen on the ground.
        assert!(begun(&standing(66, |_| MIDDLE)).is_none());
        assert!(begun(&Standing::default()).is_none());
    }

    #[test]
    fn a_path_far_beside_the_line_of_sight_starts_nobody() {
        let turned = |deg: f64| {
            let turn = DVec2::from_angle(deg.to_radians());
            standing(66, move |t| MIDDLE + turn.rotate(feet_of_steps(t) - MIDDLE))
        };
        assert!(begun(&turned(20.0)).is_some() && begun(&turned(-20.0)).is_some());
        assert!(begun(&turned(45.0)).is_none() && begun(&turned(-45.0)).is_none());
    }

    #[test]
    fn frames_without_feet_lead_on_and_further_frames_are_solved() {
        let mut frontal = begun(&standing(66, feet_of_steps)).unwrap();
        let (seen, speed_mps) = (frontal.seen(), frontal.beginning().speed_mps);
        assert_eq!(seen, 66);
        for k in 66..76 {
            frontal.push(FRAME_S * k as f64, &Lowest::default());
        }
        assert_eq!((frontal.seen(), frontal.paces.len()), (66, 76));
        let led = frontal.paces[75].along_m - frontal.paces[65].along_m;
        assert!((led - speed_mps * 10.0 * FRAME_S).abs() < 0.05, "{led}");
        for k in 76..90 {
            let sighting = frame(k, feet_of_steps(FRAME_S * k as f64)).0;
            frontal.push(FRAME_S * k as f64, &lowest(sighting));
            assert!(frontal.solve(frontal.paces.len() - 60).is_some());
        }
        let last = frontal.paces[89];
        let true_m = SPEED_MPS * last.time_s - 1.2;
        let place = frontal.route.at(0.0).point(last.along_m, 0.0).truncate();
        assert!((place.dot(towards()) - true_m).abs() < 0.2, "{place}, {true_m}");
        // Held frames stay where they are.
        let before = frontal.paces[40];
        frontal.solve(40);
        assert!((frontal.paces[40].along_m - before.along_m).abs() < 1e-3);
    }

    #[test]
    fn the_path_is_that_of_all_feet_in_the_end() {
        // At first somebody drifts sideways.
        let across = |t: f64| 0.16 * (2.0 - t).max(0.0) * towards().perp();
        let place = |t: f64| feet_of_steps(t) + across(t);
        let mut frontal = begun(&standing(50, place)).unwrap();
        for k in 50..130 {
            frontal.push(FRAME_S * k as f64, &lowest(frame(k, place(FRAME_S * k as f64)).0));
        }
        let off_deg =
            |frontal: &Frontal| towards().angle_to(frontal.route.at(0.0).direction()).to_degrees().abs();
        assert!(off_deg(&frontal) > 7.0, "{}", off_deg(&frontal));
        let (renewed, variances) = frontal.on_path_of_all().unwrap();
        assert!(off_deg(&renewed) < 3.0, "{}", off_deg(&renewed));
        assert_eq!((renewed.paces.len(), variances.len()), (130, 130));
        for pace in &renewed.paces {
            let body = MIDDLE + towards() * (SPEED_MPS * pace.time_s - 1.2);
            let off = renewed.route.at(0.0).point(pace.along_m, 0.0).truncate() - body;
            let most_m = 0.1 + across(pace.time_s).length();
            assert!(off.length() < most_m, "{}: {off} m", pace.time_s);
        }
        assert!(variances.iter().flatten().all(|variance| *variance > 0.0 && *variance < 0.01));
    }

    #[test]
    fn reach_repeats_every_half_cycle_and_its_slopes_are_those_of_its_values() {
        let path = Path { origin: MIDDLE, heading_rad: towards().to_angle() };
        let mut reach = Reach::new(&walker(), &camera(), &path.into());
        for k in 0..40 {
            let (along_m, phase) = (-1.0 + 0.053 * f64::from(k), 0.037 * f64::from(k));
            let [value, by_place, by_phase] = reach.at(along_m, phase);
            assert!((value - reach.at(along_m, phase + 0.5)[0]).abs() < 1e-9);
            let small = 1e-7;
            let numeric = [
                (reach.at(along_m + small, phase)[0] - value) / small,
                (reach.at(along_m, phase + small)[0] - value) / small,
            ];
            assert!((by_place - numeric[0]).abs() < 1e-3 && (by_phase - numeric[1]).abs() < 1e-3);
        }
    }

    /// A frame's own measurement lies where the body is; feet that are far off move neither place nor phase.
    #[test]
    fn feet_measure_the_place_of_the_body_and_outliers_move_nothing() {
        let spoilt = |t: f64| {
            let is_off = (t / FRAME_S).round() as usize % 5 == 2;
            feet_of_steps(t) - if is_off { 1.2 * towards() } else { DVec2::ZERO }
        };
        let mut frontal = begun(&standing(66, feet_of_steps)).unwrap();
        for k in 66..130 {
            frontal.push(FRAME_S * k as f64, &lowest(frame(k, spoilt(FRAME_S * k as f64)).0));
        }
        frontal.solve(0).unwrap();
        let still = ConstantVelocity::new(0.0, 0.0, 1.0, 1.0);
        let before = State { along: still, height: still, phase: still };
        let start_m = frontal.route.at(0.0).along(MIDDLE) - 1.2;
        for k in 0..130 {
            let pace = frontal.paces[k];
            let true_m = start_m + SPEED_MPS * pace.time_s;
            assert!((pace.along_m - true_m).abs() < 0.08, "{k}: {} of {true_m}", pace.along_m);
            let state = frontal.state(k, 0, [0.01, 0.01], &before);
            let measured_m = frontal.measured(k, &state).unwrap().along_m;
            let expected_m = if k >= 66 && k % 5 == 2 { true_m - 1.2 } else { true_m };
            assert!((measured_m - expected_m).abs() < 0.1, "{k}: {measured_m} of {expected_m}");
        }
    }

    /// Feet whose errors are alike in neighbouring frames: places are off by about as much as is stated.
    #[test]
    fn the_stated_variance_is_that_of_errors_that_last_for_frames() {
        let (mut sum, mut count) = (0.0, 0.0);
        for draw in 0..12u64 {
            let mut random = crate::synth::Random::new(draw);
            let blocks: Vec<f64> = (0..40).map(|_| REACH_SD_M * f64::from(random.normal_pair()[0])).collect();
            let place = |t: f64| {
                let block = (t / FRAME_S / LIKE_FRAMES).round() as usize;
                feet_of_steps(t) + blocks[block] * towards()
            };
            let Some(mut frontal) = begun(&standing(66, place)) else { continue };
            for k in 66..110 {
                frontal.push(FRAME_S * k as f64, &lowest(frame(k, place(FRAME_S * k as f64)).0));
            }
            let variances = frontal.solve(0).unwrap();
            let start_m = frontal.route.at(0.0).along(MIDDLE) - 1.2;
            for k in (10..100).step_by(10) {
                let off_m = frontal.paces[k].along_m - start_m - SPEED_MPS * frontal.paces[k].time_s;
                (sum, count) = (sum + off_m * off_m / variances[k][0], count + 1.0);
            }
        }
        let z = f64::sqrt(sum / count);
        println!("errors over stated deviations: {z:.2} of {count}");
        assert!(count >= 72.0 && (0.4..1.0).contains(&z), "{z} of {count}");
    }

    /// A way that comes towards the camera and turns across the picture: a straight line, a quarter of a circle, a line.
    fn corner() -> Route {
        const RADIUS_M: f64 = 1.5;
        let turn_m = RADIUS_M * std::f64::consts::FRAC_PI_2;
        let point = |k: i32| {
            let along_m = 0.02 * f64::from(k);
            let on_turn_m = along_m.clamp(3.0, 3.0 + turn_m) - 3.0;
            let angle = on_turn_m / RADIUS_M;
            let before = DVec2::new(0.0, -along_m.min(3.0));
            let turned = RADIUS_M * DVec2::new(1.0 - angle.cos(), -angle.sin());
            let after = DVec2::new((along_m - 3.0 - turn_m).max(0.0), 0.0);
            DVec2::new(-0.3, 2.5) + before + turned + after
        };
        Route::through(&(0..=400).map(point).collect::<Vec<_>>(), 0.0).unwrap()
    }

    /// The lower foot of somebody on a route, where the row of its sole meets the ground below the trunk.
    fn feet_on(route: &Route, along_m: f64, phase: f64) -> DVec2 {
        let walker = walker();
        let path = route.at(along_m);
        let torso = path.point(along_m, walker.level_torso_height_m() + walker.gait.vertical_m(phase));
        let posed = walker.pose(torso, path.heading_rad, phase);
        let rows = [posed.right, posed.left]
            .map(|side| camera().project_ideal(side.ankle - 0.055 * DVec3::Z).unwrap().y);
        let pixel = DVec2::new(camera().project_ideal(torso).unwrap().x, rows[0].max(rows[1]));
        camera().ground_point(pixel).unwrap().truncate()
    }

    /// Feet lead along the line of sight, contours beyond; both in the same cycle, and where the feet alone are seen too.
    #[test]
    fn feet_and_contours_show_one_way_around_a_corner() {
        let route = corner();
        let along = |k: usize| SPEED_MPS * FRAME_S * k as f64;
        let cycle = |k: usize| 0.5 * FRAME_S * k as f64 / STEP_S;
        let mut frontal = Frontal::on_route(&route, &walker(), &camera());
        let mut turned = 0;
        for k in 0..130 {
            let seen = frame(k, feet_on(&route, along(k), cycle(k) + LEAD[0])).0;
            let feet = frontal.feet_of(&lowest(seen), along(k));
            // Places and phases start off by a little, and contours are far off where they do not count.
            let is_across = !frontal.is_along(along(k));
            turned += usize::from(is_across);
            let off = if is_across { 0.0 } else { 0.2 };
            let contours = Some([along(k) + off, cycle(k) + off]);
            let (along_m, phase) = (along(k) + 0.1, cycle(k) + 0.05);
            frontal.paces.push(Pace { time_s: FRAME_S * k as f64, feet, contours, along_m, phase });
        }
        assert!((30..100).contains(&turned), "{turned}");
        let variances = frontal.solve(0).unwrap();
        assert_eq!(variances.len(), 130);
        for (k, pace) in frontal.paces.iter().enumerate() {
            assert!((pace.along_m - along(k)).abs() < 0.08, "{k}: {} {}", pace.along_m, along(k));
            assert!((pace.phase - cycle(k)).abs() < 0.04, "{k}: {} {}", pace.phase, cycle(k));
        }
    }

    #[test]
    fn frames_before_a_walk_go_on_with_its_steps_backwards_and_even_motion_does_not() {
        let route = corner();
        let along = |k: usize| SPEED_MPS * FRAME_S * k as f64;
        let cycle = |k: usize| 0.5 * FRAME_S * k as f64 / STEP_S;
        let gain = |is_walking: bool| {
            let mut frontal = Frontal::on_route(&route, &walker(), &camera());
            for k in 50..110 {
                let contours = Some([along(k), cycle(k)]);
                let (along_m, phase) = (along(k), cycle(k));
                frontal.paces.push(Pace { time_s: FRAME_S * k as f64, feet: None, contours, along_m, phase });
            }
            for k in (0..50).rev() {
                let place = match is_walking {
                    true => feet_on(&route, along(k), cycle(k) + LEAD[0]),
                    false => route.place(along(k) + 0.3),
                };
                frontal.precede(FRAME_S * k as f64, &lowest(frame(k, place).0), route.place(along(k)));
                frontal.solve(0).unwrap();
            }
            if is_walking {
                for (k, pace) in frontal.paces.iter().enumerate() {
                    assert!((pace.along_m - along(k)).abs() < 0.1, "{k}: {} {}", pace.along_m, along(k));
                    assert!((pace.phase - cycle(k)).abs() < 0.06, "{k}: {} {}", pace.phase, cycle(k));
                }
                assert!((frontal.speed_mps(0..50) - SPEED_MPS).abs() < 0.1);
            }
            frontal.gain(0..50).unwrap()
        };
        let gains = [true, false].map(gain);
        assert!(gains[0] > 2.0 * HINDSIGHT_GAIN && gains[1] < 0.0, "{gains:?}");
    }

    #[test]
    fn places_on_another_route_are_where_they_were() {
        let route = corner();
        let mut frontal = Frontal::on_route(&route, &walker(), &camera());
        for k in 0..60 {
            let (along_m, phase) = (0.1 * f64::from(k), 0.05 * f64::from(k));
            let contours = Some([along_m, phase]);
            frontal.paces.push(Pace { time_s: f64::from(k), feet: None, contours, along_m, phase });
        }
        let start = route.place(1.0);
        let moved = frontal.moved_to(&route.moved(start, 1.0, 0.0, 0.0));
        for (a, b) in frontal.paces.iter().zip(&moved.paces) {
            assert!(route.place(a.along_m).distance(moved.route.place(b.along_m)) < 0.01);
            assert!((b.contours.unwrap()[0] - b.along_m).abs() < 1e-9 && a.phase == b.phase);
        }
    }

    #[test]
    fn a_reweighted_line_ignores_what_lies_far_off() {
        let mut points: Vec<(f64, f64)> =
            (0..40).map(|k| (0.04 * f64::from(k), 2.0 + 0.04 * f64::from(k))).collect();
        (0..8).for_each(|k| points[5 * k].1 -= 1.5);
        let ([place, speed], off_m) = reweighted_line(&points);
        assert!((place - 2.0).abs() < 0.02 && (speed - 1.0).abs() < 0.02, "{place} {speed}");
        assert!(off_m[0] < -1.4 && off_m[1].abs() < 0.03);
    }
}
