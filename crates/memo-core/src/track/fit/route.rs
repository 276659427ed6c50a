//! The route of a person who turns, as the contours show it.
//!
//! The tracker's route comes from rectangles and is off by some decimetres. It is moved sideways by
//!
//! ```text
//! a(s) = Σ_j c_j P_j(2 s / L - 1),   j = 0 .. 6
//! ```
//!
//! at the length s of L, with the Legendre polynomials P_j, and turned there by a'(s):
//!
//! 1. Before the fit, with body and curves held, two steps solve for the c_j that bring the contours to the edges.
//! 2. Then the c_j are unknowns of the fit, beside body and curves. A person who is nearer and smaller has nearly
//!    the same contours, so while the distance is held, the body is fitted to it.
//!
//! A route that turns only slightly may be that of somebody who goes straight: after the fit it is compared with a line.
//!
//! Solved for from the first step on, with edges searched far, the ends of a route ran off the person in 5 of 12 drawn walks.

use super::FitOptions;
use super::lines::Figure;
use super::problem::{FitFrame, Problem, Room, Width};
use super::unknowns::{ACROSS, ALONG, BEND, FIGURE, HEADING, Unknowns, WHOLE_BEND};
use crate::estimate::line::line_through;
use crate::model::{Camera, Walker};
use crate::track::decisions::SLIGHT_TURN_RAD;
use crate::track::route::Route;
use crate::track::search::Path;
use glam::DVec2;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Standard deviations of what the tracker's route is off: place, metres, heading, radians, and curvature, 1/m, which is
/// another one every metre.
const PLACE_SD_M: f64 = 0.3;
const HEADING_SD_RAD: f64 = 0.2;
const CURVATURE_SD: f64 = 0.15;
/// Distance of the points of a moved route, metres.
const POINTS_M: f64 = 0.1;
/// How often the route is moved before the fit.
const STEPS: usize = 2;

/// Where the sideways movement of a route is described: between these lengths along it, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bend {
    ends_m: [f64; 2],
}

impl Bend {
    /// The bend of a route between these lengths; `None` if they are the same.
    pub fn between([a, b]: [f64; 2]) -> Option<Self> {
        (a != b).then_some(Self { ends_m: [a.min(b), a.max(b)] })
    }

    /// P_j at a length along the route, and its first two derivatives by that length.
    pub fn terms(&self, along_m: f64) -> [[f64; 3]; BEND] {
        sideways(along_m, self.ends_m)
    }

    /// a, a' and a'' at a length along the route.
    pub fn at(&self, whole: &[f64], along_m: f64) -> [f64; 3] {
        let coefficients = &whole[WHOLE_BEND..][..BEND];
        let terms = self.terms(along_m);
        std::array::from_fn(|n| terms.iter().zip(coefficients).map(|(of, c)| of[n] * c).sum())
    }

    /// What is known of the coefficients before the contours are seen: combinations with their precisions, whose mean is 0.
    pub fn priors(&self) -> Vec<([f64; BEND], f64)> {
        let length_m = self.ends_m[1] - self.ends_m[0];
        let one = |j: usize| std::array::from_fn(|n| if n == j { 1.0 } else { 0.0 });
        let turned = (HEADING_SD_RAD * 0.5 * length_m).powi(-2);
        let mut rows = vec![(one(0), PLACE_SD_M.powi(-2)), (one(1), turned)];
        rows.extend((0..CURVATURES).map(|k| {
            let along_m = self.ends_m[0] + length_m * (k as f64 + 0.5) / CURVATURES as f64;
            let curvature = self.terms(along_m).map(|of| of[2]);
            (curvature, length_m / CURVATURES as f64 / CURVATURE_SD.powi(2))
        }));
        rows
    }

    /// The route moved sideways, as far as from the one to the other of `whole_m` at least; lengths along it begin where they
    /// did.
    pub fn moved(&self, whole: &[f64], route: &Route, whole_m: [f64; 2]) -> Option<Route> {
        let [a, b] = whole_m;
        let [from_m, to_m] = [a.min(b).min(self.ends_m[0]), a.max(b).max(self.ends_m[1])];
        let count = ((to_m - from_m) / POINTS_M).ceil() as usize;
        let point = |k: usize| {
            let along_m = from_m + (to_m - from_m) * k as f64 / count as f64;
            let tangent = route.at(along_m);
            let [left_m, ..] = self.at(whole, along_m);
            tangent.point(along_m, 0.0).truncate() + left_m * tangent.direction().perp()
        };
        Route::through(&(0..=count).map(point).collect::<Vec<_>>(), from_m)
    }
}

/// The route of somebody who turned, moved until the contours lie on the edges, and the frames on it; a straight route
/// as it is. The way goes from one of `ends_m` to the other.
pub(crate) fn fitted_route(
    camera: &Camera,
    walker: &Walker,
    route: &Route,
    mut ends_m: [f64; 2],
    frames: &mut [FitFrame],
    options: &FitOptions,
) -> Route {
    let mut route = route.clone();
    for _ in 0..if route.is_straight() { 0 } else { STEPS } {
        let problem = Problem::new(camera, walker, &route, frames, options);
        let Some(next) = problem.moved_route(ends_m) else { break };
        for frame in frames.iter_mut() {
            let along_m = frame.start.along_m;
            frame.start.along_m = next.along(route.place(along_m), along_m);
        }
        ends_m = ends_m.map(|along_m| next.along(route.place(along_m), along_m));
        route = next;
    }
    route
}

/// The straight line through the places of the frames on a route that turns only slightly, and the frames on it; `None` of
/// other routes, and of a straight one.
pub(crate) fn straightened(route: &Route, frames: &mut [FitFrame]) -> Option<Route> {
    let alongs: Vec<f64> = frames.iter().map(|frame| frame.start.along_m).collect();
    let line = line_of(route, &alongs)?;
    for (frame, along_m) in frames.iter_mut().zip(alongs) {
        frame.start.along_m = line.along(route.place(along_m));
    }
    Some(line.into())
}

/// The straight line through the places at these lengths along a route that turns only slightly between them.
fn line_of(route: &Route, alongs: &[f64]) -> Option<Path> {
    let headings = alongs.iter().map(|&along_m| route.at(along_m).heading_rad);
    let [least, most] = [f64::min, f64::max].map(|far| headings.clone().reduce(far));
    if route.is_straight() || most? - least? > SLIGHT_TURN_RAD {
        return None;
    }
    let [x, y] = [DVec2::X, DVec2::Y].map(|axis| {
        let places = alongs.iter().map(|&along_m| (along_m, axis.dot(route.place(along_m))));
        line_through(&places.collect::<Vec<_>>())
    });
    let ahead = DVec2::new(x.0, y.0).try_normalize()?;
    Some(Path { origin: DVec2::new(x.1, y.1), heading_rad: ahead.to_angle() })
}

impl Problem<'_> {
    /// The route after one step in which body and curves are held; `None` if the contours do not determine one.
    fn moved_route(&self, ends_m: [f64; 2]) -> Option<Route> {
        let bend = self.bend()?;
        let (mut unknowns, _) = self.best_start(0.0).ok()?;
        let width = self.last_start_width(&unknowns)?;
        // 1. The normal equations of the coefficients.
        let terms: Vec<_> = (0..unknowns.frames.len())
            .into_par_iter()
            .map_init(Room::default, |room, k| self.bend_terms(&bend, &unknowns, k, &width, room))
            .collect();
        let mut normal = DMatrix::<f64>::zeros(BEND, BEND);
        let mut right = DVector::<f64>::zeros(BEND);
        for (of_frame, right_of_frame) in &terms {
            normal += of_frame;
            right += right_of_frame;
        }
        // 2. The route moved by them.
        let coefficients = most_probable(normal, &right, &bend)?;
        unknowns.whole[WHOLE_BEND..][..BEND].copy_from_slice(coefficients.as_slice());
        bend.moved(&unknowns.whole, self.route(), ends_m)
    }

    /// Normal equations of the coefficients in one frame.
    fn bend_terms(
        &self,
        bend: &Bend,
        unknowns: &Unknowns,
        frame: usize,
        width: &Width,
        room: &mut Room,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let (figure, normal, right, _) = self.figure_terms(unknowns, frame, width, room);
        let mut slopes = DMatrix::<f64>::zeros(FIGURE, BEND);
        for (j, [moved, turned, _]) in bend.terms(self.along(&unknowns.frames[frame])).into_iter().enumerate()
        {
            for (coordinate, slope) in figure_slopes(&figure, [moved, turned]) {
                slopes[(coordinate, j)] = slope;
            }
        }
        let transposed = slopes.transpose();
        (&transposed * normal * slopes, transposed * right)
    }
}

/// The coefficients, from what the contours and the priors say.
fn most_probable(mut contours: DMatrix<f64>, right: &DVector<f64>, bend: &Bend) -> Option<DVector<f64>> {
    for (row, precision) in bend.priors() {
        let row = DVector::from_row_slice(&row);
        contours += precision * &row * row.transpose();
    }
    Some(contours.cholesky()?.solve(right))
}

/// What a figure that moves to the left and turns about its pelvis does in its coordinates, where the heading turns it
/// about the origin.
pub(super) fn figure_slopes(figure: &Figure, [moved, turned]: [f64; 2]) -> [(usize, f64); 3] {
    let from_origin = figure.pelvis.truncate() - figure.origin;
    let [ahead_m, left_m] = [figure.ahead, figure.ahead.perp()].map(|axis| from_origin.dot(axis));
    [(ACROSS, moved - ahead_m * turned), (ALONG, left_m * turned), (HEADING, turned)]
}

/// Number of places at which the prior looks at the curvature.
const CURVATURES: usize = 50;

/// P_j at a length along the route, and its first two derivatives by that length, for every coefficient; beyond the ends
/// as at them.
fn sideways(along_m: f64, [first_m, last_m]: [f64; 2]) -> [[f64; 3]; BEND] {
    let rate = 2.0 / (last_m - first_m);
    let x = (rate * (along_m - first_m) - 1.0).clamp(-1.0, 1.0);
    // j P_j = (2 j - 1) x P_(j-1) - (j - 1) P_(j-2), and its derivatives.
    let mut p = [[0.0; 3]; BEND];
    (p[0], p[1]) = ([1.0, 0.0, 0.0], [x, 1.0, 0.0]);
    for j in 2..BEND {
        let (k, [a, b]) = (j as f64, [p[j - 1], p[j - 2]]);
        let of = |n: usize| {
            let raised = x * a[n] + if n > 0 { n as f64 * a[n - 1] } else { 0.0 };
            ((2.0 * k - 1.0) * raised - (k - 1.0) * b[n]) / k
        };
        p[j] = [of(0), of(1), of(2)];
    }
    p.map(|[value, slope, curvature]| [value, rate * slope, rate * rate * curvature])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Body, Posture};
    use glam::DVec3;

    #[test]
    fn the_series_is_that_of_legendre_s_polynomials() {
        let ends = [-1.0, 4.0];
        for along_m in [-0.7, 0.3, 1.5, 3.9] {
            let x: f64 = 2.0 * (along_m + 1.0) / 5.0 - 1.0;
            let [before, at, after] = [-1e-4, 0.0, 1e-4].map(|by| sideways(along_m + by, ends));
            // As printed by Abramowitz and Stegun, table 22.9.
            let p5 = (63.0 * x.powi(5) - 70.0 * x.powi(3) + 15.0 * x) / 8.0;
            assert!((at[5][0] - p5).abs() < 1e-12);
            for j in 0..BEND {
                let slope = (after[j][0] - before[j][0]) / 2e-4;
                let curvature = (after[j][0] - 2.0 * at[j][0] + before[j][0]) / 1e-8;
                assert!((at[j][1] - slope).abs() < 1e-5, "{along_m}, {j}");
                assert!((at[j][2] - curvature).abs() < 1e-3, "{along_m}, {j}");
            }
        }
        assert_eq!(sideways(-9.0, ends)[3], sideways(-1.0, ends)[3], "beyond the end as at the end");
    }

    fn cost(bend: &Bend, coefficients: &[f64; BEND]) -> f64 {
        let product = |row: &[f64; BEND]| row.iter().zip(coefficients).map(|(a, b)| a * b).sum::<f64>();
        bend.priors().iter().map(|(row, precision)| precision * product(row).powi(2)).sum()
    }

    #[test]
    fn before_anything_is_seen_a_bend_is_as_unlikely_as_its_curvature() {
        let length_m = 5.0_f64;
        for bend in [[-1.0, 4.0], [4.0, -1.0]].map(|ends_m| Bend::between(ends_m).unwrap()) {
            // A parabola with the curvature of one standard deviation everywhere, in five independent metres.
            let mut coefficients = [0.0; BEND];
            coefficients[2] = CURVATURE_SD * (0.5 * length_m).powi(2) / 3.0;
            assert!((cost(&bend, &coefficients) - 5.0).abs() < 1e-9);
            let mut coefficients = [0.0; BEND];
            coefficients[0] = PLACE_SD_M;
            assert!((cost(&bend, &coefficients) - 1.0).abs() < 1e-9);
            coefficients = [0.0; BEND];
            coefficients[1] = HEADING_SD_RAD * 0.5 * length_m;
            assert!((cost(&bend, &coefficients) - 1.0).abs() < 1e-9);
        }
        assert_eq!(Bend::between([1.0, 1.0]), None);
    }

    /// Contours that show the place of the first half metre alone, 2 cm to the left to a centimetre.
    #[test]
    fn a_route_of_which_the_contours_show_the_beginning_goes_on_as_it_did() {
        let bend = Bend::between([0.0, 5.0]).unwrap();
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(BEND, BEND), DVector::<f64>::zeros(BEND));
        for k in 0..10 {
            let at = DVector::from_iterator(BEND, bend.terms(0.05 * k as f64).map(|of| of[0]));
            normal += &at * at.transpose() / 0.01f64.powi(2);
            right += 0.02 * at / 0.01f64.powi(2);
        }
        let mut whole = vec![0.0; WHOLE_BEND + BEND];
        whole[WHOLE_BEND..].copy_from_slice(most_probable(normal, &right, &bend).unwrap().as_slice());
        let [left_m, ..] = bend.at(&whole, 0.25);
        assert!((left_m - 0.02).abs() < 0.005, "{left_m}");
        let [left_m, turned, _] = bend.at(&whole, 4.9);
        assert!(left_m.abs() < 0.3 && turned.abs() < 0.1, "{left_m} {turned}");
    }

    /// On a circle about the origin of 2 m, 10 cm to the left are a circle of 1.9 m, on which lengths are shorter.
    #[test]
    fn a_moved_route_has_lengths_of_its_own() {
        let circle = |radius_m: f64| {
            let point = |k: usize| radius_m * DVec2::from_angle(0.05 * k as f64);
            Route::through(&(0..60).map(point).collect::<Vec<_>>(), 0.0).unwrap()
        };
        let bend = Bend::between([0.0, 5.0]).unwrap();
        let mut whole = vec![0.0; WHOLE_BEND + BEND];
        whole[WHOLE_BEND] = 0.1;
        let moved = bend.moved(&whole, &circle(2.0), [0.5, 5.5]).unwrap();
        for length_m in [0.5, 2.0, 4.5] {
            let (found, wanted) = (moved.place(length_m), circle(1.9).place(length_m));
            assert!(found.distance(wanted) < 0.01, "{length_m}: {found} {wanted}");
            assert!((moved.at(length_m).heading_rad - circle(1.9).at(length_m).heading_rad).abs() < 0.02);
        }
    }

    /// Also of somebody who walks backwards, for whom lengths along the route become less.
    #[test]
    fn the_line_of_a_slight_turn_is_its_chord_and_faces_as_the_route_does() {
        let arc = |turn_rad: f64| {
            let radius_m = 4.0 / turn_rad;
            let point = |k: usize| radius_m * DVec2::from_angle(turn_rad * (k as f64 / 40.0 - 0.5));
            Route::through(&(0..=40).map(point).collect::<Vec<_>>(), 1.0).unwrap()
        };
        let alongs: Vec<f64> = (0..80).map(|k| 1.0 + 4.0 * f64::from(k) / 79.0).collect();
        let backwards: Vec<f64> = alongs.iter().rev().copied().collect();
        for alongs in [&alongs, &backwards] {
            let route = arc(0.3);
            let line = line_of(&route, alongs).unwrap();
            assert!((line.heading_rad - std::f64::consts::FRAC_PI_2).abs() < 0.01, "{}", line.heading_rad);
            for &along_m in alongs {
                let place = route.place(along_m);
                // A sagitta of L a / 8, between the line and the farthest places.
                assert!(line.distance(place) < 4.0 * 0.3 / 8.0);
                assert!((line.along(place) - along_m).abs() < 0.03);
            }
            assert_eq!(line_of(&arc(0.8), alongs), None, "that is a turn");
            assert_eq!(line_of(&line.into(), alongs), None, "it is straight");
        }
    }

    #[test]
    fn a_figure_on_a_moved_route_moves_sideways_and_turns_about_its_pelvis() {
        let (body, heading_rad) = (Body::from_height(1.7).unwrap(), 0.6);
        let pelvis = DVec3::new(1.2, -0.4, 0.9);
        let ahead = DVec2::from_angle(heading_rad);
        let posed = body.pose(pelvis, heading_rad, &Posture::default());
        let figure = Figure { body, posed, pelvis, ahead, origin: DVec2::new(-0.7, 0.5) };
        let point = DVec3::new(1.5, -0.1, 1.3);
        let (ahead, left) = (ahead.extend(0.0), ahead.perp().extend(0.0));
        for (moved, turned) in [(1.0, 0.0), (0.0, 1.0), (0.4, -0.8)] {
            let slopes = figure_slopes(&figure, [moved, turned]);
            let motion: DVec3 = slopes
                .iter()
                .map(|&(coordinate, slope)| {
                    slope
                        * match coordinate {
                            ALONG => ahead,
                            ACROSS => left,
                            _ => DVec3::Z.cross(point - figure.origin.extend(0.0)),
                        }
                })
                .sum();
            let wanted = moved * left + turned * DVec3::Z.cross(point - pelvis);
            assert!(motion.distance(wanted) < 1e-12, "{moved}, {turned}: {motion} {wanted}");
        }
    }
}
