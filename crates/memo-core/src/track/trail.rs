//! The places of a person on the ground by the rectangles, and the curve through them.
//!
//! Each rectangle is a point on the ground, by the rows of feet and crown. The points are smoothed to a curve of slowly
//! changing acceleration. Of somebody who goes straight, a straight path explains them as well, at whatever speed.

use super::locate::{Crown, Rows, Sighting, foot};
use super::rate::{mean_interval_s, more};
use crate::estimate::arrow::{Arrow, velocity_change};
use crate::estimate::smooth::Measured;
use crate::model::Camera;
use glam::{DVec2, DVec3};

/// Standard deviation of the places on the route so far to which a curve is joined, metres.
const ANCHOR_SD_M: f64 = 0.05;
/// How much the acceleration of a person who turns changes in a second, m/s². Twice as much moves headings by about a
/// degree.
pub(super) const JERK_SD: f64 = 0.25;
/// The same of people who turn a corner.
pub(super) const CORNER_JERK_SD: f64 = 1.0;
/// Standard deviation of the acceleration of people, m/s²: who walks at 1.2 m/s turns by 24 degrees in a second.
const ACCELERATION_SD: f64 = 0.5;
/// Rounds in which a straight path and the places on it are fitted in turn.
const LINE_STEPS: usize = 5;
/// Errors of so many neighbouring rectangles are alike, at the usual rate: arms and feet stay where they are for some frames.
const LIKE_FRAMES: f64 = 4.0;

/// A place on the route so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Anchor {
    pub time_s: f64,
    pub place_m: DVec2,
}

/// The places in order of time, along the sight and across it.
pub(super) struct Trail {
    times_s: Vec<f64>,
    axes: [DVec2; 2],
    places: [Vec<Measured>; 2],
}

impl Trail {
    /// From the anchors through the sightings by some of their rows, all in order of time. Sightings that show no place are
    /// left out.
    pub fn new(
        rows: Rows,
        anchors: &[Anchor],
        sightings: &[Sighting],
        camera: &Camera,
        crown: &Crown,
    ) -> Self {
        let sight = (camera.rotation.transpose() * DVec3::Z).truncate().normalize_or(DVec2::Y);
        let axes = [sight, sight.perp()];
        let mut times_s: Vec<f64> = anchors.iter().map(|anchor| anchor.time_s).collect();
        let anchored = |axis: DVec2| {
            anchors.iter().map(move |anchor| Measured { value: axis.dot(anchor.place_m), sd: ANCHOR_SD_M })
        };
        let mut places = axes.map(|axis| anchored(axis).collect::<Vec<_>>());
        let alike = LIKE_FRAMES * more(mean_interval_s(sightings.iter().map(|s| s.time_s)));
        for sighting in sightings {
            let Ok(foot) = foot(rows, sighting, camera, crown) else { continue };
            times_s.push(sighting.time_s);
            for (axis, places) in axes.iter().zip(&mut places) {
                let value = axis.dot(foot.point_in_world.truncate());
                let variance = axis.extend(0.0).dot(foot.covariance * axis.extend(0.0));
                places.push(Measured { value, sd: (alike * variance).sqrt() });
            }
        }
        Self { times_s, axes, places }
    }

    /// The times of the places, seconds.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Points on the ground along a smooth curve, one for each place.
    pub fn curve(&self, jerk_sd: f64) -> Vec<DVec2> {
        let smoothed = |places: &Vec<Measured>| smoothed(&self.times_s, places, jerk_sd);
        self.points(&self.places.each_ref().map(smoothed))
    }

    /// The same along the most likely straight path.
    pub fn straight(&self) -> Vec<DVec2> {
        self.points(&self.on_a_line())
    }

    fn points(&self, [along, across]: &[Vec<f64>; 2]) -> Vec<DVec2> {
        let points = along.iter().zip(across);
        points.map(|(along, across)| along * self.axes[0] + across * self.axes[1]).collect()
    }

    /// How far the place of a time is from a point, as minus the logarithm of its likelihood; 0 without such a place.
    pub fn cost(&self, time_s: f64, point: DVec2) -> f64 {
        let Some(k) = self.times_s.iter().position(|t| *t == time_s) else { return 0.0 };
        let off = |(axis, places): (&DVec2, &Vec<Measured>)| {
            let Measured { value, sd } = places[k];
            0.5 * ((axis.dot(point) - value) / sd).powi(2)
        };
        self.axes.iter().zip(&self.places).map(off).sum()
    }

    /// How much more likely the places are on their curve than on any straight path, as the logarithm of the ratio. On the
    /// path the speed may change as much as on the curve: who slows down, stops or sets off does not turn.
    pub fn turn_gain(&self) -> f64 {
        let on_curve = self.places.each_ref().map(|places| smoothed(&self.times_s, places, JERK_SD));
        self.cost_of(&self.on_a_line()) - self.cost_of(&on_curve)
    }

    /// How far the places are from others, as minus the logarithm of their likelihood.
    fn cost_of(&self, others: &[Vec<f64>; 2]) -> f64 {
        let off = |(m, x): (&Measured, &f64)| 0.5 * ((m.value - x) / m.sd).powi(2);
        self.places.iter().zip(others).flat_map(|(places, others)| places.iter().zip(others)).map(off).sum()
    }

    /// The most likely places on a straight path, by axis: those along it at a smoothly changing speed, and the line of
    /// least squares given these, in turn.
    fn on_a_line(&self) -> [Vec<f64>; 2] {
        let mut along = self.times_s.clone();
        for _ in 0..LINE_STEPS {
            let lines = self.places.each_ref().map(|places| line(&along, places));
            let speed = lines[0][1].hypot(lines[1][1]).max(f64::MIN_POSITIVE);
            let seen = |k: usize| {
                let (mut value, mut weight) = (0.0, 0.0);
                for (places, [first, slope]) in self.places.iter().zip(&lines) {
                    let Measured { value: place, sd } = places[k];
                    let towards = slope / speed;
                    value += towards * (place - first) / (sd * sd);
                    weight += towards * towards / (sd * sd);
                }
                Measured { value: value / weight, sd: weight.powf(-0.5) }
            };
            along = smoothed(&self.times_s, &(0..along.len()).map(seen).collect::<Vec<_>>(), JERK_SD);
        }
        self.places.each_ref().map(|places| {
            let [first, slope] = line(&along, places);
            along.iter().map(|x| first + slope * x).collect()
        })
    }
}

/// Value at 0 and slope of the line of least squares.
fn line(at: &[f64], measured: &[Measured]) -> [f64; 2] {
    let middle = at.iter().sum::<f64>() / at.len() as f64;
    let [mut w, mut wt, mut wtt, mut wx, mut wtx] = [0.0; 5];
    for (at, m) in at.iter().zip(measured) {
        let (t, weight) = (at - middle, m.sd.powi(-2));
        w += weight;
        wt += weight * t;
        wtt += weight * t * t;
        wx += weight * m.value;
        wtx += weight * t * m.value;
    }
    let slope = (w * wtx - wt * wx) / (w * wtt - wt * wt);
    [(wx - slope * wt) / w - slope * middle, slope]
}

/// The values of smallest Σ (x - measured)² / sd² + Σ (change of the acceleration)² / (jerk² time) + mean of
/// acceleration² / sd². Over a short time, measurements do not show an acceleration, and the values lie on a line.
fn smoothed(times_s: &[f64], measured: &[Measured], jerk_sd: f64) -> Vec<f64> {
    let mut arrow = Arrow::banded(measured.len(), 1, 3);
    for (k, Measured { value, sd }) in measured.iter().enumerate() {
        arrow.add_row(&[(k, 1.0)], *value, sd.powi(-2));
    }
    let step_s = |k: usize| times_s[k + 1] - times_s[k];
    // The acceleration is the change of velocity over the time between the middles of the intervals.
    let acceleration = |k: usize| {
        let (factors, lasts_s) = velocity_change(step_s(k), step_s(k + 1));
        factors.map(|factor| factor / lasts_s)
    };
    let count = measured.len().saturating_sub(2);
    for k in 0..count {
        let now = acceleration(k);
        let terms = [0, 1, 2].map(|n| (k + n, now[n]));
        arrow.add_row(&terms, 0.0, ACCELERATION_SD.powi(-2) / count as f64);
        if k + 1 < count {
            let next = acceleration(k + 1);
            let terms =
                [(k, -now[0]), (k + 1, next[0] - now[1]), (k + 2, next[1] - now[2]), (k + 3, next[2])];
            arrow.add_row(&terms, 0.0, 1.0 / (jerk_sd * jerk_sd * step_s(k + 1)));
        }
    }
    arrow.solve().map_or_else(
        || measured.iter().map(|m| m.value).collect(),
        |solution| solution.frames.iter().copied().collect(),
    )
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::active::tests::{BEGINNING, active, frames_on};
    use super::super::decisions::CLEAR_TURN;
    use super::super::route::Route;
    use super::super::search::tests::camera;
    use super::*;

    pub const FRAME_S: f64 = 0.05;

    /// A route that leaves the straight path in a circle of this radius, metres; positive to the left.
    pub fn arc(radius_m: f64) -> Route {
        let point = |k: i32| {
            let angle = 0.05 * f64::from(k) / radius_m;
            DVec2::new(-0.6, 0.0) + radius_m * DVec2::new(angle.sin(), 1.0 - angle.cos())
        };
        Route::through(&(0..=80).map(point).collect::<Vec<_>>(), BEGINNING.along_m).unwrap()
    }

    /// Four times as many rectangles in the same time say no more.
    #[test]
    fn rectangles_tell_no_more_at_a_high_frame_rate() {
        let crown = Crown { height_m: active(Vec::new()).walk.walker.level_crown_height_m(), sd_m: 0.02 };
        let gain = |more: usize| {
            let frames = frames_on(50 * more, FRAME_S / more as f64, &arc(2.5), &arc(2.5));
            let sightings: Vec<Sighting> = frames.iter().filter_map(|(sighting, _)| *sighting).collect();
            Trail::new(Rows::Both, &[], &sightings, &camera(), &crown).turn_gain()
        };
        // Up to 30 frames per second each one counts, as 20 and 30 do here.
        let [usual, fast] = [1, 8].map(gain);
        assert!((1.3..1.7).contains(&(fast / usual)), "{usual} {fast}");
    }

    #[test]
    fn rectangles_show_the_curve_of_who_turns() {
        let crown = Crown { height_m: active(Vec::new()).walk.walker.level_crown_height_m(), sd_m: 0.02 };
        for radius_m in [2.5, -2.5, 1e6] {
            let route = arc(radius_m);
            let frames = frames_on(50, FRAME_S, &route, &route);
            let sightings: Vec<Sighting> = frames.iter().filter_map(|(sighting, _)| *sighting).collect();
            let points = Trail::new(Rows::Both, &[], &sightings, &camera(), &crown).curve(JERK_SD);
            assert_eq!(points.len(), 50);
            for (k, point) in points.iter().enumerate() {
                let truth = route.place(BEGINNING.along_m + 1.2 * FRAME_S * k as f64);
                // Whole pixels of the rectangles are some centimetres in depth, and ends are seen from one side.
                let most_m = if (5..45).contains(&k) { 0.1 } else { 0.15 };
                assert!(point.distance(truth) < most_m, "{radius_m}, {k}: {point} {truth}");
            }
        }
    }

    /// An acceleration that a fifth of a second does not show is none.
    #[test]
    fn places_of_a_short_time_lie_on_a_line() {
        let times_s: Vec<f64> = (0..6).map(|k| 0.04 * f64::from(k)).collect();
        let noise_m = [0.02, -0.03, 0.04, 0.05, -0.02, -0.06];
        let places = times_s.iter().zip(noise_m).map(|(t, off)| Measured { value: 1.2 * t + off, sd: 0.05 });
        let smooth = smoothed(&times_s, &places.collect::<Vec<_>>(), JERK_SD);
        for three in smooth.windows(3) {
            let acceleration = (three[0] - 2.0 * three[1] + three[2]) / 0.04f64.powi(2);
            assert!(acceleration.abs() < 3.0 * ACCELERATION_SD, "{smooth:?}");
        }
    }

    #[test]
    fn an_anchored_curve_begins_on_the_route_so_far() {
        let crown = Crown { height_m: active(Vec::new()).walk.walker.level_crown_height_m(), sd_m: 0.02 };
        let route = arc(1e6);
        let frames = frames_on(40, FRAME_S, &route, &route);
        let sightings: Vec<Sighting> = frames[10..].iter().filter_map(|(sighting, _)| *sighting).collect();
        // Half a metre farther than the rectangles say.
        let anchor = |k: usize| Anchor {
            time_s: FRAME_S * k as f64,
            place_m: route.place(BEGINNING.along_m + 1.2 * FRAME_S * k as f64) + 0.5 * DVec2::Y,
        };
        let anchors: Vec<Anchor> = (0..10).map(anchor).collect();
        let points = Trail::new(Rows::Both, &anchors, &sightings, &camera(), &crown).curve(JERK_SD);
        assert!(points[5].distance(anchors[5].place_m) < 0.05);
        assert!(points[39].y < 0.25, "{}", points[39]);
    }

    #[test]
    fn rectangles_on_a_curve_turn_clearly_and_those_on_a_line_do_not() {
        let crown = Crown { height_m: active(Vec::new()).walk.walker.level_crown_height_m(), sd_m: 0.02 };
        let gain = |radius_m: f64, frame_s: f64, count: usize| {
            let route = arc(radius_m);
            let sightings: Vec<Sighting> = frames_on(count, frame_s, &route, &route)
                .iter()
                .filter_map(|(sighting, _)| *sighting)
                .collect();
            Trail::new(Rows::Both, &[], &sightings, &camera(), &crown).turn_gain()
        };
        assert!(gain(1e6, FRAME_S, 50) < 0.5 * CLEAR_TURN, "{}", gain(1e6, FRAME_S, 50));
        for radius_m in [1.5, -1.5] {
            let gains = [gain(radius_m, FRAME_S, 50), gain(radius_m, 0.5 * FRAME_S, 100)];
            assert!(gains[0] > 2.0 * CLEAR_TURN, "{gains:?}");
            // Twice as many frames in the same time show hardly more.
            assert!(gains[1] < 1.7 * gains[0], "{gains:?}");
        }
    }

    /// Places of somebody who goes along X at 1.2 m/s until a second and then, at changing speed, straight on or to the left.
    fn changing(speed_mps: fn(f64) -> f64, left: bool) -> Trail {
        let times_s: Vec<f64> = (0..50).map(|k| 0.04 * f64::from(k)).collect();
        let mut place = DVec2::ZERO;
        let mut places = [Vec::new(), Vec::new()];
        for (k, t) in times_s.iter().enumerate() {
            let way = if left && *t > 1.0 { DVec2::Y } else { DVec2::X };
            place += 0.04 * speed_mps(*t) * way;
            // Rectangles are off by some centimetres, farther in depth.
            let off = DVec2::new((1.9 * k as f64).sin(), (1.3 * k as f64).cos());
            for (n, sd) in [0.06, 0.2].into_iter().enumerate() {
                places[n].push(Measured { value: (place + 0.3 * sd * off)[n], sd });
            }
        }
        Trail { times_s, axes: [DVec2::X, DVec2::Y], places }
    }

    #[test]
    fn who_slows_down_stops_or_sets_off_does_not_turn() {
        let walks = |_: f64| 1.2;
        let slows_down = |t: f64| 1.2 - 0.4 * t;
        let stops = |t: f64| 1.2 * ((1.6 - t) / 0.6).clamp(0.0, 1.0);
        let sets_off = |t: f64| 1.2 * (t / 0.8 - 0.5).clamp(0.0, 1.0);
        for straight in [walks as fn(f64) -> f64, slows_down, stops, sets_off] {
            let gain = changing(straight, false).turn_gain();
            assert!(gain < 0.3 * CLEAR_TURN, "{gain}");
        }
        let gain = changing(walks, true).turn_gain();
        assert!(gain > 2.0 * CLEAR_TURN, "{gain}");
    }

    #[test]
    fn a_point_costs_half_the_square_of_its_distance_in_standard_deviations() {
        let anchor = |k: i32| Anchor { time_s: f64::from(k), place_m: DVec2::new(f64::from(k), 1.0) };
        let crown = Crown { height_m: 1.7, sd_m: 0.02 };
        let trail = Trail::new(Rows::Both, &[anchor(0), anchor(1)], &[], &camera(), &crown);
        let off = DVec2::new(2.0 * ANCHOR_SD_M, -ANCHOR_SD_M);
        assert!((trail.cost(1.0, anchor(1).place_m + off) - 2.5).abs() < 1e-9);
        assert!(trail.cost(0.0, anchor(0).place_m) < 1e-12 && trail.cost(0.5, DVec2::ZERO) == 0.0);
        assert!(trail.turn_gain().abs() < 1e-9);
    }
}
