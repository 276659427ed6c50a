//! Walking towards the camera or away from it.
//!
//! Seen along the path, the contours of all phases are nearly the same, so a search of the contours does not find the
//! phase. The feet show it: the ray of the lowest changed row meets the ground at the foot that is nearer to the camera,
//! or, while that one stands and does not change, at the one that swings (`reach`). With the place x along the path and the
//! reach F of the likelier foot of the model,
//!
//! f(t) = x(t) + F(x(t), phase(t)).
//!
//! 1. The path is the line through those points.
//! 2. A walk starts on the line of phase whose steps leave the least of f, if they leave so much less than even motion
//!    does that it is not one of many lines by chance (`rhythm`).
//! 3. Place and phase of every frame, with slowly changing speed and cadence, are solved for by Gauss and Newton's
//!    method.
//! 4. When the walk is over, the path is the line through the feet of all its frames, on which they are followed again.
//!
//! Both feet reach alike, so the phase is known up to half a cycle: left and right stay open. Only walking forwards is
//! looked for.

mod reach;
mod rhythm;

use super::decisions::{ALONG_THE_SIGHT_RAD, COMMON_ROW_SD_PX, FASTEST_MPS, FRONTAL_GAIN, SLOWEST_MPS};
use super::locate::Sighting;
use super::rate::{lasting, mean_interval_s, more};
use super::route::Route;
use super::search::Hypothesis;
use super::standing::Standing;
use super::start::CadenceRange;
use super::walk::{Beginning, State, Walk};
use crate::estimate::arrow::{Arrow, velocity_change};
use crate::estimate::kalman::ConstantVelocity;
use crate::model::{Camera, Walker};
use glam::DVec2;
use reach::{Feet, NEARER_OFF_M, Reach, comes_nearer, feet};
use rhythm::{Line, evenly, path_through};

pub(super) use reach::off_the_sight_rad;

/// Steps of Gauss and Newton's method.
const STEPS: usize = 6;
/// Standard deviation of the reach of people's feet about the model's, metres, and of the lowest row, pixels.
const REACH_SD_M: f64 = 0.08;
const ROW_SD_PX: f64 = 1.5;
/// Residuals of so many neighbouring frames are alike, at the usual rate.
const LIKE_FRAMES: f64 = 4.0;
/// Beyond this many standard deviations, residuals count ever less (Cauchy weights).
const CAUCHY_SD: f64 = 1.5;
/// Standard deviations of the place along the route, metres, and of the phase, cycles, that contours show.
const CONTOURS_SD_M: f64 = 0.05;
const CONTOURS_PHASE_SD: f64 = 0.03;
/// On a curve, the feet show place and phase within this angle of the line of sight, and contours beyond it.
const BY_FEET_RAD: f64 = 0.5;
/// Frames that show the speed and cadence with which places and phases go on, at the usual rate.
const LEADING: usize = 12;
/// Changes in a second, as standard deviations: of the speed, m/s, and of the cadence, cycles/s.
const SPEED_CHANGE_SD: f64 = 0.1;
const CADENCE_CHANGE_SD: f64 = 0.03;
/// A live walk solves for so many last frames at a time; the first two of them are held.
pub(super) const WINDOW: usize = 250;
const HELD: f64 = 1e6;

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
        frontal.reach.is_firm = !frontal.by_all[1];
        // 2. The best line of phase against even motion.
        let points: Vec<(f64, f64)> = seen.iter().map(|(t, place)| (*t, path.along(*place))).collect();
        let line = Line::nearest(&mut frontal.reach, &points, rates)?;
        let gain = (line.likelihood - evenly(&points)) / alike(&points);
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
        let reach = self.reach.on(route);
        let mut moved = Self { route: route.clone(), reach, ..self.clone() };
        for pace in &mut moved.paces {
            let place = |along_m: f64| route.along(self.route.place(along_m), along_m);
            pace.along_m = place(pace.along_m);
            pace.contours = pace.contours.map(|[along_m, phase]| [place(along_m), phase]);
        }
        moved
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

    /// Mean time from frame to frame, seconds.
    fn every_s(&self) -> f64 {
        mean_interval_s(self.paces.iter().map(|pace| pace.time_s))
    }

    /// A further frame, at first where speed and cadence lead.
    pub(super) fn push(&mut self, time_s: f64, seen: &Lowest) {
        let last = self.paces[self.paces.len() - 1];
        let before = self.paces[self.paces.len().saturating_sub(1 + lasting(LEADING, self.every_s()))];
        let share = (time_s - last.time_s) / (last.time_s - before.time_s);
        let along_m = last.along_m + share * (last.along_m - before.along_m);
        let phase = last.phase + share * (last.phase - before.phase);
        let feet = self.feet_of(seen, along_m);
        self.paces.push(Pace { time_s, feet, contours: None, along_m, phase });
    }

    /// A frame before the first, near a place, where the phase of the next frames leads.
    pub(super) fn precede(&mut self, time_s: f64, seen: &Lowest, place: DVec2) {
        let leading = lasting(LEADING, self.every_s()).min(self.paces.len() - 1);
        let (first, later) = (self.paces[0], self.paces[leading]);
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
        let (mut points, mut likelihood) = (Vec::new(), 0.0);
        for k in range {
            let Pace { time_s, feet, along_m, phase, .. } = self.paces[k];
            let Some(feet) = feet.filter(|_| self.is_along(along_m)) else { continue };
            let seen_m = self.route.at(along_m).along(feet.place);
            likelihood += self.reach.at(along_m, phase).likelier(seen_m - along_m).2;
            points.push((time_s, seen_m));
        }
        if points.len() < LEADING {
            return None;
        }
        Some((likelihood - evenly(&points)) / alike(&points))
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
        let expected = self.reach.at(along_m, phase);
        let path = self.route.at(along_m);
        feet.map(|feet| {
            let seen_m = path.along(feet.place);
            let ([reach_m, ..], ..) = expected.likelier(seen_m - along_m);
            Hypothesis { along_m: seen_m - reach_m, ..state.hypothesis() }
        })
    }

    /// Solves for places and phases from an index on.
    ///
    /// Smallest Σ w (f - x - F)² / sd² + Σ (change of speed)² / (sd² time) + Σ (change of cadence)² / (sd² time).
    /// Returns the variances of place and phase: of all frames, or of the last one if earlier ones are held.
    pub(super) fn solve(&mut self, from: usize) -> Option<Vec<[f64; 2]>> {
        let mut variances = None;
        let alike = LIKE_FRAMES * more(self.every_s());
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
                    arrow.add_row(&[(x, 1.0)], seen_m, 1.0 / (alike * CONTOURS_SD_M.powi(2)));
                    arrow.add_row(&[(p, 1.0)], seen, 1.0 / (alike * CONTOURS_PHASE_SD.powi(2)));
                    continue;
                }
                let Some(feet) = feet else { continue };
                let ahead_m = self.route.at(along_m).along(feet.place) - along_m;
                let ([reach_m, by_place, by_phase], scale_m, _) =
                    self.reach.at(along_m, phase).likelier(ahead_m);
                let reach_sd_m = REACH_SD_M * scale_m / NEARER_OFF_M;
                let variance = reach_sd_m.powi(2) + (ROW_SD_PX * feet.row_m()).powi(2);
                let off_m = ahead_m - reach_m;
                let weight = 1.0 / (1.0 + off_m * off_m / (CAUCHY_SD * CAUCHY_SD * variance));
                let right = off_m + (1.0 + by_place) * along_m + by_phase * phase;
                arrow.add_row(&[(x, 1.0 + by_place), (p, by_phase)], right, weight / (alike * variance));
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

/// How many residuals of points in order of time are alike.
fn alike(points: &[(f64, f64)]) -> f64 {
    LIKE_FRAMES * more(mean_interval_s(points.iter().map(|(time_s, _)| *time_s)))
}

#[cfg(test)]
pub(super) mod tests;
