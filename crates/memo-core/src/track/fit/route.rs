//! The route of a person who turns, as the contours show it.
//!
//! The tracker's route comes from rectangles and is off by some decimetres. It is moved sideways by
//!
//! ```text
//! a(s) = Σ_j c_j P_j(2 s / L - 1),   j = 0 .. 6
//! ```
//!
//! at the length s of L, with the Legendre polynomials P_j, and turned there by a'(s). With body, gait and places held,
//! each step solves for the c_j that bring the contours to the edges.

use super::FitOptions;
use super::lines::Figure;
use super::problem::{FitFrame, Problem, Room, Width};
use super::unknowns::{ACROSS, ALONG, FIGURE, HEADING, Unknowns};
use crate::model::{Camera, Walker};
use crate::track::route::Route;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Number of coefficients.
const COUNT: usize = 7;
/// Standard deviations of what the tracker's route is off: place, metres, heading, radians, and curvature, 1/m, which is
/// another one every metre.
const PLACE_SD_M: f64 = 0.3;
const HEADING_SD_RAD: f64 = 0.2;
const CURVATURE_SD: f64 = 0.15;
/// Distance of the points of a moved route, metres.
const POINTS_M: f64 = 0.1;

/// Number of steps.
const STEPS: usize = 2;

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
        let Some(next) = Problem::new(camera, walker, &route, frames, options).moved_route(ends_m) else {
            break;
        };
        for frame in frames.iter_mut() {
            let along_m = frame.start.along_m;
            frame.start.along_m = next.along(route.place(along_m), along_m);
        }
        ends_m = ends_m.map(|along_m| next.along(route.place(along_m), along_m));
        route = next;
    }
    route
}

impl Problem<'_> {
    /// The route after one step; `None` if the contours do not determine one.
    fn moved_route(&self, whole_m: [f64; 2]) -> Option<Route> {
        let (unknowns, _) = self.best_start(0.0)?;
        let ends = [0, unknowns.frames.len() - 1].map(|k| self.along(&unknowns.frames[k]));
        let length_m = ends[1] - ends[0];
        // 1. The normal equations of the coefficients.
        let width = self.last_start_width(&unknowns)?;
        let terms: Vec<_> = (0..unknowns.frames.len())
            .into_par_iter()
            .map_init(Room::default, |room, k| self.sideways_terms(&unknowns, k, ends, &width, room))
            .collect();
        let mut normal = DMatrix::<f64>::zeros(COUNT, COUNT);
        let mut right = DVector::<f64>::zeros(COUNT);
        for (of_frame, right_of_frame) in &terms {
            normal += of_frame;
            right += right_of_frame;
        }
        // 2. The route moved by them.
        let coefficients = most_probable(normal, &right, length_m)?;
        let [from_m, to_m] =
            if length_m > 0.0 { [whole_m[0].min(ends[0]), whole_m[1].max(ends[1])] } else { ends };
        let count = ((to_m - from_m).abs() / POINTS_M).ceil() as usize;
        let point = |k: usize| {
            let along_m = from_m + (to_m - from_m) * k as f64 / count as f64;
            let left_m: f64 =
                sideways(along_m, ends).iter().zip(&coefficients).map(|(of, c)| of[0] * c).sum();
            let tangent = self.route().at(along_m);
            tangent.point(along_m, 0.0).truncate() + left_m * tangent.direction().perp()
        };
        Route::through(&(0..=count).map(point).collect::<Vec<_>>(), from_m)
    }

    /// Normal equations of the coefficients in one frame.
    fn sideways_terms(
        &self,
        unknowns: &Unknowns,
        frame: usize,
        ends: [f64; 2],
        width: &Width,
        room: &mut Room,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let (figure, normal, right, _) = self.figure_terms(unknowns, frame, width, room);
        let mut slopes = DMatrix::<f64>::zeros(FIGURE, COUNT);
        for (j, of) in sideways(self.along(&unknowns.frames[frame]), ends).into_iter().enumerate() {
            for (coordinate, slope) in figure_slopes(&figure, of) {
                slopes[(coordinate, j)] = slope;
            }
        }
        let transposed = slopes.transpose();
        (&transposed * normal * slopes, transposed * right)
    }
}

/// What a figure that moves to the left and turns about its pelvis does in its coordinates, where the heading turns it
/// about the origin.
fn figure_slopes(figure: &Figure, [moved, turned, _]: [f64; 3]) -> [(usize, f64); 3] {
    let from_origin = figure.pelvis.truncate() - figure.origin;
    let [ahead_m, left_m] = [figure.ahead, figure.ahead.perp()].map(|axis| from_origin.dot(axis));
    [(ACROSS, moved - ahead_m * turned), (ALONG, left_m * turned), (HEADING, turned)]
}

/// The coefficients after a step, from what the contours say and the prior.
fn most_probable(contours: DMatrix<f64>, right: &DVector<f64>, length_m: f64) -> Option<DVector<f64>> {
    Some((contours + prior(length_m)).cholesky()?.solve(right))
}

/// The precision of the coefficients before the contours are seen.
fn prior(length_m: f64) -> DMatrix<f64> {
    let mut precision = DMatrix::<f64>::zeros(COUNT, COUNT);
    precision[(0, 0)] = PLACE_SD_M.powi(-2);
    precision[(1, 1)] = (HEADING_SD_RAD * 0.5 * length_m).powi(-2);
    for k in 0..CURVATURES {
        let along_m = length_m * (k as f64 + 0.5) / CURVATURES as f64;
        let curvature = DVector::from_iterator(COUNT, sideways(along_m, [0.0, length_m]).map(|of| of[2]));
        precision +=
            &curvature * curvature.transpose() * (length_m.abs() / CURVATURES as f64 / CURVATURE_SD.powi(2));
    }
    precision
}

/// Number of places at which the prior looks at the curvature.
const CURVATURES: usize = 50;

/// P_j at a length along the route, and its first two derivatives by that length, for every coefficient; beyond the ends
/// as at them.
fn sideways(along_m: f64, [first_m, last_m]: [f64; 2]) -> [[f64; 3]; COUNT] {
    let rate = 2.0 / (last_m - first_m);
    let x = (rate * (along_m - first_m) - 1.0).clamp(-1.0, 1.0);
    // j P_j = (2 j - 1) x P_(j-1) - (j - 1) P_(j-2), and its derivatives.
    let mut p = [[0.0; 3]; COUNT];
    (p[0], p[1]) = ([1.0, 0.0, 0.0], [x, 1.0, 0.0]);
    for j in 2..COUNT {
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
    use glam::{DVec2, DVec3};

    #[test]
    fn the_series_is_that_of_legendre_s_polynomials() {
        let ends = [-1.0, 4.0];
        for along_m in [-0.7, 0.3, 1.5, 3.9] {
            let x: f64 = 2.0 * (along_m + 1.0) / 5.0 - 1.0;
            let [before, at, after] = [-1e-4, 0.0, 1e-4].map(|by| sideways(along_m + by, ends));
            // As printed by Abramowitz and Stegun, table 22.9.
            let p5 = (63.0 * x.powi(5) - 70.0 * x.powi(3) + 15.0 * x) / 8.0;
            assert!((at[5][0] - p5).abs() < 1e-12);
            for j in 0..COUNT {
                let slope = (after[j][0] - before[j][0]) / 2e-4;
                let curvature = (after[j][0] - 2.0 * at[j][0] + before[j][0]) / 1e-8;
                assert!((at[j][1] - slope).abs() < 1e-5, "{along_m}, {j}");
                assert!((at[j][2] - curvature).abs() < 1e-3, "{along_m}, {j}");
            }
        }
        assert_eq!(sideways(-9.0, ends)[3], sideways(-1.0, ends)[3], "beyond the end as at the end");
    }

    #[test]
    fn before_anything_is_seen_a_bend_is_as_unlikely_as_its_curvature() {
        let length_m = 5.0_f64;
        // A parabola with the curvature of one standard deviation everywhere, in five independent metres.
        let parabola = CURVATURE_SD * (0.5 * length_m).powi(2) / 3.0;
        let mut coefficients = DVector::<f64>::zeros(COUNT);
        coefficients[2] = parabola;
        let cost = (coefficients.transpose() * prior(length_m) * &coefficients)[(0, 0)];
        assert!((cost - 5.0).abs() < 1e-9, "{cost}");
        coefficients[2] = 0.0;
        coefficients[0] = PLACE_SD_M;
        let cost = (coefficients.transpose() * prior(length_m) * &coefficients)[(0, 0)];
        assert!((cost - 1.0).abs() < 1e-9, "{cost}");
    }

    /// Contours that show the place of the first half metre alone, 2 cm to the left to a centimetre.
    #[test]
    fn a_route_of_which_the_contours_show_the_beginning_goes_on_as_it_did() {
        let length_m = 5.0;
        let (mut normal, mut right) = (DMatrix::<f64>::zeros(COUNT, COUNT), DVector::<f64>::zeros(COUNT));
        for k in 0..10 {
            let at =
                DVector::from_iterator(COUNT, sideways(0.05 * k as f64, [0.0, length_m]).map(|of| of[0]));
            normal += &at * at.transpose() / 0.01f64.powi(2);
            right += 0.02 * at / 0.01f64.powi(2);
        }
        let found = most_probable(normal, &right, length_m).unwrap();
        let at = |along_m: f64, n: usize| -> f64 {
            sideways(along_m, [0.0, length_m]).iter().zip(&found).map(|(of, c)| of[n] * c).sum()
        };
        assert!((at(0.25, 0) - 0.02).abs() < 0.005, "{}", at(0.25, 0));
        assert!(at(4.9, 0).abs() < 0.3 && at(4.9, 1).abs() < 0.1, "{} {}", at(4.9, 0), at(4.9, 1));
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
            let slopes = figure_slopes(&figure, [moved, turned, 0.0]);
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
