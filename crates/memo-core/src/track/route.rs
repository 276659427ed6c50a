//! The way that a person walks on the ground: a straight [`Path`], or a smooth curve for somebody who turns.
//!
//! The papers' walkers go straight. A body that turns slowly moves, over a few centimetres, as along the tangent of its
//! route, so whatever compares one frame takes the tangent ([`Route::at`]) for the path.

use super::search::Path;
use glam::DVec2;

/// A straight path, or a chain of short circular arcs with straight ends.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The path of a straight route; of a curved one, its tangent at the beginning.
    start: Path,
    /// Where the arcs of a curved route begin, and the last one ends; in order of `along_m`.
    knots: Vec<Knot>,
}

/// A point of a curved route.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    /// Length of the route up to here, metres.
    along_m: f64,
    place: DVec2,
    /// Not wrapped: neighbouring knots differ by less than half a turn.
    heading_rad: f64,
}

impl From<Path> for Route {
    fn from(path: Path) -> Self {
        Self { start: path, knots: Vec::new() }
    }
}

impl Route {
    /// The route through points on the ground, metres, with the given distance along it at the first one. Headings are
    /// those of the chords. `None` for fewer than three different points.
    pub fn through(points: &[DVec2], along_m: f64) -> Option<Self> {
        let mut distinct: Vec<DVec2> = Vec::with_capacity(points.len());
        for &point in points {
            if distinct.last().is_none_or(|last| last.distance(point) > LEAST_CHORD_M) {
                distinct.push(point);
            }
        }
        if distinct.len() < 3 {
            return None;
        }
        // 1. Heading at a point: that of the chord between its neighbours, or of the only chord at the ends.
        let count = distinct.len();
        let chord = |k: usize| distinct[(k + 1).min(count - 1)] - distinct[k.saturating_sub(1)];
        let mut headings: Vec<f64> = (0..count).map(|k| chord(k).to_angle()).collect();
        for k in 1..count {
            headings[k] = headings[k - 1] + DVec2::from_angle(headings[k - 1]).angle_to(chord(k));
        }
        // 2. Arcs from knot to knot: an arc that turns by a is longer than its chord by a² / 24 of it.
        let mut knots = vec![Knot { along_m, place: distinct[0], heading_rad: headings[0] }];
        for k in 1..count {
            let turn = headings[k] - headings[k - 1];
            let length_m = distinct[k].distance(distinct[k - 1]) * (1.0 + turn * turn / 24.0);
            knots.push(Knot {
                along_m: knots[k - 1].along_m + length_m,
                place: distinct[k],
                heading_rad: headings[k],
            });
        }
        Some(Self { start: tangent(&knots[0]), knots })
    }

    /// The route up to the length `along_m`, and from there through points; `None` for fewer than three different ones.
    pub fn continued(&self, points: &[DVec2], along_m: f64) -> Option<Self> {
        let new = Self::through(points, along_m)?;
        let mut before: Vec<Knot> =
            self.knots.iter().copied().take_while(|knot| knot.along_m < along_m).collect();
        if before.is_empty() {
            // It is straight up to there.
            let from_m = along_m - STRAIGHT_BEFORE_M;
            before.push(Knot {
                along_m: from_m,
                place: self.place(from_m),
                heading_rad: self.start.heading_rad,
            });
        }
        Some(Self { start: self.start, knots: before.into_iter().chain(new.knots).collect() })
    }

    /// True for a straight path.
    pub fn is_straight(&self) -> bool {
        self.knots.is_empty()
    }

    /// The tangent where the length along the route is `along_m`: a path on which that point has the same `along`.
    pub fn at(&self, along_m: f64) -> Path {
        let after = self.knots.partition_point(|knot| knot.along_m <= along_m);
        let (Some(before), Some(knot)) = (after.checked_sub(1), self.knots.get(after)) else {
            return self.knots.last().filter(|_| after > 0).map_or(self.start, tangent);
        };
        let before = &self.knots[before];
        let share = (along_m - before.along_m) / (knot.along_m - before.along_m);
        let [bend, other] = [knot, before].map(|k| k.heading_rad - before.heading_rad);
        let heading_rad = before.heading_rad + share * (bend - other);
        // The chord from the knot before has the mean heading; what the chain of arcs misses the next knot by is shared.
        let along_chord =
            (along_m - before.along_m) * DVec2::from_angle(0.5 * (before.heading_rad + heading_rad));
        let whole = (knot.along_m - before.along_m)
            * DVec2::from_angle(0.5 * (before.heading_rad + knot.heading_rad));
        let place = before.place + along_chord + share * (knot.place - before.place - whole);
        tangent(&Knot { along_m, place, heading_rad })
    }

    /// The point of the ground where the length along the route is `along_m`.
    pub fn place(&self, along_m: f64) -> DVec2 {
        self.at(along_m).point(along_m, 0.0).truncate()
    }

    /// Length along the route at the foot of a point's perpendicular, metres; of several, the one nearest to
    /// `near_m`.
    pub fn along(&self, point: DVec2, near_m: f64) -> f64 {
        let mut along_m = near_m;
        for _ in 0..if self.is_straight() { 1 } else { FOOT_STEPS } {
            along_m = self.at(along_m).along(point);
        }
        along_m
    }

    /// The route that is farther from a point by a factor, and as much longer.
    #[must_use]
    pub fn scaled(&self, about: DVec2, factor: f64) -> Self {
        let moved = |place: DVec2| about + factor * (place - about);
        let knot = |knot: &Knot| Knot { along_m: factor * knot.along_m, place: moved(knot.place), ..*knot };
        let start = Path { origin: moved(self.start.origin), ..self.start };
        Self { start, knots: self.knots.iter().map(knot).collect() }
    }

    /// The route turned about a point, and then moved to its left; lengths along it begin at the point.
    #[must_use]
    pub fn moved(&self, about: DVec2, about_along_m: f64, turn_rad: f64, left_m: f64) -> Self {
        let turn = DVec2::from_angle(turn_rad);
        let moved = |place: DVec2, heading_rad: f64| {
            let heading_rad = heading_rad + turn_rad;
            about + turn.rotate(place - about) + left_m * DVec2::from_angle(heading_rad).perp()
        };
        let start = self.at(about_along_m);
        let straight =
            Path { origin: moved(about, start.heading_rad), heading_rad: start.heading_rad + turn_rad };
        let places: Vec<DVec2> = self.knots.iter().map(|knot| moved(knot.place, knot.heading_rad)).collect();
        let Some(mut route) = Self::through(&places, 0.0) else { return straight.into() };
        let zero_m = route.along(straight.origin, about_along_m - self.knots[0].along_m);
        route.knots.iter_mut().for_each(|knot| knot.along_m -= zero_m);
        route.start = tangent(&route.knots[0]);
        route
    }
}

/// Points nearer to each other are one, metres.
const LEAST_CHORD_M: f64 = 0.01;
/// A straight route that goes on elsewhere is left as it is up to so far before, metres.
const STRAIGHT_BEFORE_M: f64 = 0.3;
/// The foot of a perpendicular on a curve is found on tangents, one after the other.
const FOOT_STEPS: usize = 4;

fn tangent(knot: &Knot) -> Path {
    let origin = knot.place - knot.along_m * DVec2::from_angle(knot.heading_rad);
    Path { origin, heading_rad: knot.heading_rad }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    const RADIUS_M: f64 = 3.0;

    /// How far a route turns between two lengths.
    fn turn(route: &Route, from_m: f64, to_m: f64) -> f64 {
        route.at(to_m).heading_rad - route.at(from_m).heading_rad
    }

    /// Points of a circle about the origin from (3, 0) on, counter-clockwise, by the length of the arc.
    fn on_circle(along_m: f64) -> DVec2 {
        RADIUS_M * DVec2::from_angle(along_m / RADIUS_M)
    }

    /// Most of a circle from the length 2 m on.
    fn circle() -> Route {
        let points: Vec<DVec2> = (0..=300).map(|k| on_circle(0.05 * f64::from(k))).collect();
        Route::through(&points, 2.0).unwrap()
    }

    #[test]
    fn a_straight_route_is_its_path_everywhere() {
        let path = Path { origin: DVec2::new(0.3, -2.0), heading_rad: 4.0 };
        let route = Route::from(path);
        assert!(route.is_straight());
        for along_m in [-1e6, 0.0, 2.5] {
            assert_eq!(route.at(along_m), path);
            assert_eq!(route.place(along_m), path.point(along_m, 0.0).truncate());
        }
        let point = DVec2::new(5.0, 1.0);
        assert_eq!(route.along(point, 77.0), path.along(point));
        assert_eq!(turn(&route, -3.0, 8.0), 0.0);
    }

    /// Each place moves away from the point on the ray through it, and the headings stay.
    #[test]
    fn a_scaled_route_is_seen_from_the_point_as_before() {
        let straight = Route::from(Path { origin: DVec2::new(0.3, -2.0), heading_rad: 4.0 });
        let about = DVec2::new(1.0, -7.0);
        for route in [straight, circle()] {
            let far = route.scaled(about, 1.3);
            for along_m in [-1.0, 2.0, 3.7, 9.1, 17.5, 40.0] {
                let place = about + 1.3 * (route.place(along_m) - about);
                assert!(far.place(1.3 * along_m).distance(place) < 1e-9, "{along_m}");
                assert!((far.at(1.3 * along_m).heading_rad - route.at(along_m).heading_rad).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn points_of_a_circle_are_a_circle_with_its_length_and_headings() {
        let route = circle();
        assert!(!route.is_straight());
        // Chords give the headings, so the two ends are off by half a chord's turn.
        for k in 10..140 {
            let along_m = 0.1 * f64::from(k) + 0.037;
            let path = route.at(2.0 + along_m);
            assert!(route.place(2.0 + along_m).distance(on_circle(along_m)) < 1e-3, "{along_m}");
            let heading_rad = FRAC_PI_2 + along_m / RADIUS_M;
            assert!((path.heading_rad - heading_rad).abs() < 2e-3, "{} {heading_rad}", path.heading_rad);
            // On the tangent, the point has the same length.
            assert!((path.along(route.place(2.0 + along_m)) - 2.0 - along_m).abs() < 1e-9);
        }
        assert!((turn(&route, 3.0, 15.0) - 12.0 / RADIUS_M).abs() < 2e-3);
    }

    #[test]
    fn beyond_its_ends_a_route_is_straight() {
        let route = circle();
        for (end_m, beyond_m) in [(2.0, -1.5), (17.0, 1.5)] {
            let [end, far] = [end_m, end_m + beyond_m].map(|along_m| route.at(along_m));
            assert!((end.heading_rad - far.heading_rad).abs() < 1e-9);
            let ahead = DVec2::from_angle(far.heading_rad);
            assert!(route.place(end_m + beyond_m).distance(route.place(end_m) + beyond_m * ahead) < 1e-3);
        }
    }

    #[test]
    fn the_length_at_a_point_beside_the_route_is_that_of_its_foot() {
        let route = circle();
        for k in 5..140 {
            let along_m = 0.1 * f64::from(k);
            let beside = on_circle(along_m) * (1.0 + 0.1 / RADIUS_M);
            let found = route.along(beside, 2.0 + along_m - 0.3);
            assert!((found - 2.0 - along_m).abs() < 2e-3, "{along_m}: {found}");
        }
    }

    #[test]
    fn a_moved_circle_is_turned_about_the_point_and_wider() {
        let (route, about) = (circle(), on_circle(6.0));
        let moved = route.moved(about, 8.0, 0.2, -0.5);
        // The new circle has its centre turned about the point, and a radius of 3.5 m.
        let centre = about + DVec2::from_angle(0.2).rotate(-about);
        for k in -30..40 {
            let along_m = 0.1 * f64::from(k);
            assert!((moved.place(along_m).distance(centre) - RADIUS_M - 0.5).abs() < 2e-3, "{along_m}");
        }
        let outwards = DVec2::from_angle(0.2).rotate(about.normalize());
        assert!(moved.place(0.0).distance(about + 0.5 * outwards) < 2e-3);
        assert!((turn(&moved, 0.0, 3.5) - 1.0).abs() < 2e-3);
        // Of a straight route likewise.
        let path = Path { origin: DVec2::new(1.0, 2.0), heading_rad: 0.3 };
        let moved = Route::from(path).moved(path.point(4.0, 0.0).truncate(), 4.0, 0.1, 0.2).at(0.0);
        let wanted = path.point(4.0, 0.0).truncate() + 0.2 * DVec2::from_angle(0.4).perp();
        assert!(moved.origin.distance(wanted) < 1e-12 && (moved.heading_rad - 0.4).abs() < 1e-12);
    }

    #[test]
    fn a_route_is_continued_where_the_new_points_begin() {
        let east: Vec<DVec2> = (0..50).map(|k| DVec2::new(0.1 * f64::from(k), 0.0)).collect();
        let old = Route::through(&east, 0.0).unwrap();
        let north: Vec<DVec2> = (0..30).map(|k| DVec2::new(2.0, 0.1 * f64::from(k))).collect();
        let new = old.continued(&north, 2.0).unwrap();
        assert!(new.place(1.5).distance(DVec2::new(1.5, 0.0)) < 1e-6);
        assert!(new.place(4.0).distance(DVec2::new(2.0, 2.0)) < 1e-6);
        assert!((turn(&new, 0.5, 4.0) - FRAC_PI_2).abs() < 1e-6);
        // A straight route keeps what lies before, but for a short way to the new points.
        let new = Route::from(Path { origin: DVec2::ZERO, heading_rad: 0.0 }).continued(&north, 2.0).unwrap();
        for k in -20..=17 {
            let along_m = 0.1 * f64::from(k);
            assert!(new.place(along_m).distance(DVec2::new(along_m, 0.0)) < 1e-9, "{along_m}");
        }
        assert!(new.place(4.0).distance(DVec2::new(2.0, 2.0)) < 1e-6);
        assert!((turn(&new, 1.7, 4.0) - FRAC_PI_2).abs() < 1e-6);
    }

    #[test]
    fn headings_are_not_wrapped_and_repeated_points_count_once() {
        let route = circle();
        assert!((turn(&route, 2.5, 16.5) - 14.0 / RADIUS_M).abs() < 2e-3 && 14.0 / RADIUS_M < TAU);
        let twice: Vec<DVec2> = (0..40).map(|k| DVec2::new(0.1 * f64::from(k / 2), 0.0)).collect();
        let line = Route::through(&twice, 0.0).unwrap();
        assert!((line.along(DVec2::new(1.9, 0.3), 0.0) - 1.9).abs() < 1e-9);
        for few in [&twice[..0], &twice[..1], &twice[..4]] {
            assert_eq!(Route::through(few, 0.0), None);
        }
    }
}
