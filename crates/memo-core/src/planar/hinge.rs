//! A hinge: three points, two rods that share a pivot and a plane.
//!
//! Source: Hoffman and Flinchbaugh 1982, Proposition 2 and appendix 2, eqs. (1)-(8); the paper omits the proof of
//! uniqueness. With the plane z = p x + q y, eqs. (7) and (8) are always satisfied, and (5), (6) become two
//! quadratic forms in (p, q), one per rod, where a_1 and a_2 are the image vectors in the two views:
//!
//! ```text
//! (1 + p^2) X + 2 p q Y + (1 + q^2) Z = 0    X = x1^2 - x2^2, Y = x1 y1 - x2 y2, Z = y1^2 - y2^2
//! ```
//!
//! Multiplying each equation by X + Z of the other and subtracting gives one homogeneous quadratic in (p, q).
//! Written for the ellipse (A, B, C) = (1 + p^2, p q, 1 + q^2), both equations are linear and homogeneous, so (A,
//! B, C) is the cross product of the two rows (X, 2 Y, Z). Unless the rows are parallel, there is one plane up to
//! the mirror, or none if the form is indefinite. This is the proof.
//!
//! Limits: two views have as many equations as unknowns, and a third of unrelated triples have an interpretation,
//! so two views are not evidence of planar motion. [`fit_hinge`] takes more views.

use super::Plane;
use super::fit::{self, FitError, FitOptions};
use super::rod::{ROUNDING, condition, difference_of_powers, is_same_or_opposite, polish, slope_of_pairs};
use glam::{DMat2, DVec2};
use nalgebra::Matrix4;
use thiserror::Error;

/// Rows are parallel if the sine of their angle is smaller than this.
const PARALLEL: f64 = 1e-13;

/// Why two views of three points determine no hinge or more than one.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum HingeRefusal {
    /// An image vector is NaN, infinite, or so large or small that its square is not a number.
    #[error("an image vector is not a usable number")]
    NotFinite,
    /// A rod has equal or opposite image vectors in both views: one equation is left for two unknowns.
    #[error("rod {rod} shows equal or opposite image vectors")]
    EqualProjections {
        /// Index of the rod: 0 to the first end, 1 to the second.
        rod: usize,
    },
    /// All image vectors are on one line: the plane is seen edge-on, and the lengths are not determined.
    #[error("all image vectors are collinear")]
    CollinearImages,
    /// The projections of both rods keep their lengths: the plane is parallel to the image and all depths are 0,
    /// accurate only to the square root of the input's precision.
    #[error("the plane is parallel to the image; the rods are {} and {} long", .lengths[0], .lengths[1])]
    ParallelToImage {
        /// Lengths of the rods.
        lengths: [f64; 2],
    },
    /// Both rods give the same equation (their bisectors are parallel or perpendicular in space): a family of
    /// planes fits.
    #[error("both rods give the same equation")]
    SameEquation,
    /// All roots are imaginary: no hinge in planar motion has these images.
    #[error("no hinge in planar motion has these images")]
    Imaginary,
}

/// A hinge from two views. Its mirror (all depths and both slopes with the opposite sign) fits as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// Plane of the motion.
    pub plane: Plane,
    /// Lengths from the pivot to the first and the second end, in the unit of the points.
    pub lengths: [f64; 2],
    /// Depths relative to the pivot, `depth[view][rod]`.
    pub depth: [[f64; 2]; 2],
    /// Determinant of the Jacobian of the two quadratic forms by (p, q), each divided by its length^2.
    pub jacobian: f64,
    /// First-order bound of (depth error / length) / (relative error of the input's coordinates).
    pub condition: f64,
}

impl Hinge {
    /// The mirror solution of the same images.
    #[must_use]
    pub fn mirror(&self) -> Self {
        Self { plane: self.plane.mirror(), depth: self.depth.map(|view| view.map(|z| -z)), ..*self }
    }

    /// Bound of a depth's error divided by its rod's length, for input that is exact to double precision.
    pub fn relative_error(&self) -> f64 {
        ROUNDING * self.condition
    }
}

/// The hinge from two views of three points: `first` and `second` are each end's image vectors from the pivot in
/// the two views.
///
/// # Errors
/// A [`HingeRefusal`].
pub fn hinge_from_two_views(first: &[DVec2; 2], second: &[DVec2; 2]) -> Result<Hinge, HingeRefusal> {
    let rods = [first, second];
    check(rods)?;
    let rows = rods.map(|rod| difference_of_powers(rod[0], rod[1]));
    if rows[0].cross(rows[1]).length() <= PARALLEL * rows[0].length() * rows[1].length() {
        return Err(HingeRefusal::SameEquation);
    }
    let pairs = [*first, *second];
    let slope = slope_of_pairs(pairs).ok_or(HingeRefusal::Imaginary)?;
    let plane = Plane::from_slope(polish(pairs, slope));
    let length_sq =
        rods.map(|rod| 0.5 * (plane.lift(rod[0]).length_squared() + plane.lift(rod[1]).length_squared()));
    let jacobian: [DVec2; 2] = std::array::from_fn(|k| {
        let [before, after] = rods[k].map(|d| plane.depth(d) * d);
        2.0 * (before - after) / length_sq[k]
    });
    let hinge = Hinge {
        plane,
        lengths: length_sq.map(f64::sqrt),
        depth: std::array::from_fn(|view| rods.map(|rod| plane.depth(rod[view]))),
        jacobian: jacobian[0].perp_dot(jacobian[1]),
        condition: condition(jacobian, plane),
    };
    let finite = plane.slope().is_finite() && hinge.lengths.iter().all(|l| l.is_finite());
    if finite { Ok(hinge) } else { Err(HingeRefusal::NotFinite) }
}

/// An error for degenerate cases.
fn check(rods: [&[DVec2; 2]; 2]) -> Result<(), HingeRefusal> {
    let largest = |rod: &[DVec2; 2]| rod[0].length_squared().max(rod[1].length_squared());
    let finite =
        |rod: &[DVec2; 2]| rod.iter().all(|d| d.is_finite()) && (1e-100..1e100).contains(&largest(rod));
    if !rods.iter().all(|rod| finite(rod)) {
        return Err(HingeRefusal::NotFinite);
    }
    if let Some(rod) = rods.iter().position(|rod| is_same_or_opposite(rod[0], rod[1])) {
        return Err(HingeRefusal::EqualProjections { rod });
    }
    let longest = rods
        .iter()
        .flat_map(|rod| rod.iter())
        .copied()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let line = longest.expect("there are four vectors");
    let on_line = |d: &DVec2| d.perp_dot(line).abs() <= PARALLEL * d.length() * line.length();
    if rods.iter().flat_map(|rod| rod.iter()).all(on_line) {
        return Err(HingeRefusal::CollinearImages);
    }
    if rods.iter().all(|rod| (rod[0] - rod[1]).dot(rod[0] + rod[1]).abs() <= PARALLEL * largest(rod)) {
        return Err(HingeRefusal::ParallelToImage { lengths: rods.map(|rod| largest(rod).sqrt()) });
    }
    Ok(())
}

/// A hinge fitted to two or more views.
#[derive(Debug, Clone, PartialEq)]
pub struct HingeFit {
    /// Plane of the motion, or its mirror.
    pub plane: Plane,
    /// Lengths of the rods from the pivot to each end, in the unit of the points.
    pub lengths: [f64; 2],
    /// Covariance of (p, q, length to the first end, length to the second), from the given noise or the
    /// residuals, whichever is larger. Infinite if the views do not determine the plane.
    pub covariance: Matrix4<f64>,
    /// Depth of each end relative to the pivot per view; NaN if missing. All signs may be opposite.
    pub depth: Vec<[f64; 2]>,
    /// Residuals per view and rod (distance in the image), including outliers; NaN if missing.
    pub residuals: Vec<[f64; 2]>,
    /// True for views excluded as outliers.
    pub outliers: Vec<bool>,
    /// RMS of the residuals of the views used.
    pub residual_rms: f64,
    /// RMS distance of each rod's image vector from its mean.
    pub motion: [f64; 2],
    /// RMS distance of each rod's vector in space from its mean.
    pub motion_in_space: [f64; 2],
    /// Number of equations less unknowns; at 0 the views cannot contradict a plane.
    pub redundancy: usize,
    /// True if the plane has the largest tilt allowed: then lengths and depths are lower bounds at best.
    pub at_tilt_limit: bool,
}

impl HingeFit {
    /// Standard deviation of the depth of an end at an image vector from the pivot (first order): from the plane
    /// and from the noise `noise_sd` of each coordinate of both points.
    pub fn depth_sd(&self, image: DVec2, noise_sd: f64) -> f64 {
        let c = &self.covariance;
        let of_slope = DMat2::from_cols_array(&[c[(0, 0)], c[(1, 0)], c[(0, 1)], c[(1, 1)]]);
        self.plane.depth_sd(of_slope, image, noise_sd)
    }
}

/// Fits a hinge in planar motion to views of its ends and pivot (any translation; NaN for points not seen).
///
/// # Errors
/// Different numbers of views, infinite positions, fewer than two views, no motion, invalid options.
pub fn fit_hinge(
    first: &[DVec2],
    pivot: &[DVec2],
    second: &[DVec2],
    options: &FitOptions,
) -> Result<HingeFit, FitError> {
    let views = fit::views(pivot, [first, second])?;
    let fit = fit::fit(&views, options)?;
    Ok(HingeFit {
        plane: fit.plane,
        lengths: fit.lengths,
        covariance: fit.covariance,
        depth: views.iter().map(|v| v.map(|d| fit.plane.depth(d))).collect(),
        residuals: fit.residuals,
        outliers: fit.outliers,
        residual_rms: fit.residual_rms,
        motion: fit.motion,
        motion_in_space: fit.motion_in_space,
        redundancy: fit.redundancy,
        at_tilt_limit: fit.at_tilt_limit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reproduce::hoffman_flinchbaugh::planes_by_search;
    use crate::synth::Random;

    /// The image vectors of both ends in two views; angles[view][rod] within the plane.
    fn planted_views(slope: DVec2, angles: [[f64; 2]; 2], lengths: [f64; 2]) -> [[DVec2; 2]; 2] {
        let along = slope.try_normalize().unwrap_or(DVec2::X);
        let cos_tilt = 1.0 / (1.0 + slope.length_squared()).sqrt();
        std::array::from_fn(|rod| {
            angles.map(|a| lengths[rod] * (a[rod].cos() * cos_tilt * along + a[rod].sin() * along.perp()))
        })
    }

    fn draw(random: &mut Random) -> (DVec2, [[f64; 2]; 2], [f64; 2]) {
        let tiny = 10f64.powf(random.uniform(-9.0, -1.0));
        let mut tilt = random.uniform(0.0, 1.5);
        let mut angles = [[0; 2]; 2].map(|view| view.map(|_| random.uniform(0.0, std::f64::consts::TAU)));
        match random.uniform(0.0, 9.0) as usize {
            0 => tilt = tiny,
            1 => tilt = std::f64::consts::FRAC_PI_2 - tiny,
            2 => angles[1][0] = angles[0][0] + tiny,
            3 => angles[1][1] = angles[0][1] + std::f64::consts::PI - tiny,
            // Parallel bisectors: both rods give the same equation.
            4 => angles[1][1] = angles[0][0] + angles[1][0] - angles[0][1] + tiny,
            _ => {}
        }
        let slope = tilt.tan() * DVec2::from_angle(random.uniform(0.0, std::f64::consts::TAU));
        (slope, angles, [0; 2].map(|_| 10f64.powf(random.uniform(-1.0, 1.0))))
    }

    /// The criterion is depth error divided by length <= ROUNDING condition, and 1e-8 unless that bound is
    /// larger. Returns (recovered, flagged, refused).
    fn plant_and_recover(count: usize) -> [usize; 3] {
        let mut random = Random::new(23);
        let mut tally = [0; 3];
        for _ in 0..count {
            let (slope, angles, lengths) = draw(&mut random);
            let [first, second] = planted_views(slope, angles, lengths);
            let truth = Plane::from_slope(slope);
            match hinge_from_two_views(&first, &second) {
                Ok(hinge) => {
                    let off = |sign: f64| {
                        let at = |view: usize, rod: usize| {
                            let z = truth.depth([first, second][rod][view]);
                            (hinge.depth[view][rod] - sign * z).abs() / lengths[rod]
                        };
                        at(0, 0).max(at(0, 1)).max(at(1, 0)).max(at(1, 1))
                    };
                    let error = off(1.0).min(off(-1.0));
                    assert!(error <= hinge.relative_error(), "{error} {hinge:?}");
                    tally[usize::from(hinge.relative_error() > 1e-8)] += 1;
                }
                Err(refusal) => {
                    tally[2] += 1;
                    let z = |rod: [DVec2; 2], l: f64| {
                        2.0 / (l * l) * (truth.depth(rod[0]) * rod[0] - truth.depth(rod[1]) * rod[1])
                    };
                    let rows = [z(first, lengths[0]), z(second, lengths[1])];
                    assert!(ROUNDING * condition(rows, truth) > 1e-8, "{refusal:?} {slope} {angles:?}");
                }
            }
        }
        tally
    }

    #[test]
    fn planted_hinges_in_two_views_are_recovered_as_far_as_their_condition_allows() {
        let draws = if std::env::var_os("MEMO_FULL").is_some() { 1_000_000 } else { 50_000 };
        let tally = plant_and_recover(draws);
        println!("recovered, flagged, refused: {tally:?}");
        assert!(10 * tally[0] > 6 * draws, "{tally:?}");
    }

    #[test]
    fn brute_force_finds_one_plane_and_the_same() {
        let mut random = Random::new(31);
        let mut compared = 0;
        for _ in 0..300 {
            let slope = random.uniform(0.2, 3.0) * DVec2::from_angle(random.uniform(0.0, 6.3));
            let angles = [[0; 2]; 2].map(|view| view.map(|_| random.uniform(0.0, 6.3)));
            let [first, second] = planted_views(slope, angles, [0.8, 1.0]);
            let Ok(hinge) = hinge_from_two_views(&first, &second) else { panic!("{slope} {angles:?}") };
            if hinge.condition > 200.0 {
                continue;
            }
            compared += 1;
            let planes = planes_by_search(&first, &second);
            assert_eq!(planes.len(), 1, "{slope} {angles:?} {planes:?}");
            assert!(Plane::from_slope(planes[0]).angle_up_to_mirror_rad(&hinge.plane) < 1e-6);
            assert!(Plane::from_slope(slope).angle_up_to_mirror_rad(&hinge.plane) < 1e-9);
        }
        assert!(compared > 200, "{compared}");
    }

    #[test]
    fn a_third_of_unrelated_triples_are_a_hinge_in_two_views() {
        let mut random = Random::new(41);
        let mut draw = || [0; 2].map(|_| DVec2::from_array(random.normal_pair().map(f64::from)));
        let planar = (0..20_000).filter(|_| hinge_from_two_views(&draw(), &draw()).is_ok()).count();
        assert!((0.31..0.35).contains(&(planar as f64 / 20_000.0)), "{planar}");
    }

    #[test]
    fn degenerate_views_are_named() {
        let v = DVec2::new;
        let good = [v(1.0, 0.3), v(0.2, 0.9)];
        let bend = |slope: DVec2, angles| planted_views(slope, angles, [1.0, 1.0]);
        let [same_a, same_b] = bend(v(0.7, 0.4), [[0.1, 0.3], [0.9, 0.7]]);
        let [flat_a, flat_b] = bend(DVec2::ZERO, [[0.1, 2.3], [0.9, 3.7]]);
        let cases = [
            (good, [v(f64::NAN, 0.0), v(1.0, 0.0)], HingeRefusal::NotFinite),
            (good, [v(f64::INFINITY, 0.0), v(1.0, 0.0)], HingeRefusal::NotFinite),
            (good, [DVec2::ZERO; 2], HingeRefusal::NotFinite),
            (good, [v(0.4, 0.5), v(-0.4, -0.5)], HingeRefusal::EqualProjections { rod: 1 }),
            ([v(1.0, 0.5), v(0.6, 0.3)], [v(0.2, 0.1), v(-0.8, -0.4)], HingeRefusal::CollinearImages),
            (same_a, same_b, HingeRefusal::SameEquation),
            // X, Y, Z of (1, 0, 1) and (1, 0, 2): both forms positive.
            ([v(1.0, 0.0), v(0.0, 0.0)], [v(1.0, 0.1), v(0.2, 0.0)], HingeRefusal::Imaginary),
        ];
        for (first, second, refusal) in cases {
            assert_eq!(hinge_from_two_views(&first, &second), Err(refusal), "{first:?} {second:?}");
        }
        let flat = hinge_from_two_views(&flat_a, &flat_b);
        assert!(matches!(flat, Err(HingeRefusal::ParallelToImage { .. })), "{flat:?}");
    }

    #[test]
    fn planted_hinges_are_recovered() {
        let mut random = Random::new(3);
        let mut missed = 0;
        for _ in 0..200 {
            let tilt = random.uniform(0.1, 1.35);
            let slope = tilt.tan() * DVec2::from_angle(random.uniform(0.0, 6.3));
            let basis = [
                DVec2::from_angle(slope.to_angle()) * tilt.cos(),
                DVec2::from_angle(slope.to_angle()).perp(),
            ];
            let rate = random.uniform(0.5, 2.0);
            let start = random.uniform(0.0, 6.0);
            let swing = random.uniform(0.5, 1.0);
            let (mut a, mut o, mut b) = (vec![], vec![], vec![]);
            for i in 0..30 {
                let t = i as f64 * 0.1;
                let pivot = DVec2::new(t, (t * 3.0).sin());
                let at = |angle: f64, length: f64| {
                    pivot + length * (angle.cos() * basis[0] + angle.sin() * basis[1])
                };
                o.push(pivot);
                a.push(at(start + swing * (rate * t).sin(), 0.4));
                b.push(at(start + 2.0 + swing * (rate * t).cos(), 0.45));
            }
            let fit = fit_hinge(&a, &o, &b, &FitOptions::default()).unwrap();
            let good = (fit.lengths[0] - 0.4).abs() < 1e-6 && (fit.lengths[1] - 0.45).abs() < 1e-6;
            if !good {
                missed += 1;
                println!("{tilt} {fit:?} {slope}");
            }
        }
        assert_eq!(missed, 0);
    }

    #[test]
    fn the_mirror_lies_in_the_mirrored_plane() {
        let [first, second] = planted_views(DVec2::new(0.7, -0.4), [[0.1, 1.3], [2.0, 0.4]], [0.5, 0.8]);
        let hinge = hinge_from_two_views(&first, &second).unwrap();
        let mirror = hinge.mirror();
        for view in 0..2 {
            for (rod, image) in [first, second].into_iter().enumerate() {
                assert_eq!(mirror.depth[view][rod], -hinge.depth[view][rod]);
                assert!((mirror.plane.depth(image[view]) - mirror.depth[view][rod]).abs() < 1e-12);
            }
        }
    }

    /// Jacobian and condition are those of the equations divided by the rods' lengths: a rod twice as long
    /// changes neither.
    #[test]
    fn the_condition_does_not_depend_on_the_rods_lengths() {
        let hinge = |lengths: [f64; 2]| {
            let [first, second] = planted_views(DVec2::new(0.7, -0.4), [[0.1, 1.3], [2.0, 0.4]], lengths);
            hinge_from_two_views(&first, &second).unwrap()
        };
        let [one, other] = [hinge([1.0, 1.0]), hinge([3.0, 0.2])];
        assert!((one.jacobian / other.jacobian - 1.0).abs() < 1e-9, "{one:?} {other:?}");
        assert!((one.condition / other.condition - 1.0).abs() < 1e-9);
    }

    /// Hinges seen nearly edge-on, where eliminations lose digits: depth errors stay within what is stated.
    #[test]
    fn hinges_near_edge_on_are_recovered_as_far_as_their_condition_allows() {
        let mut random = Random::new(37);
        let mut ratios = Vec::new();
        for _ in 0..20_000 {
            let (slope, angles, lengths) = draw(&mut random);
            let steep = 10f64.powf(random.uniform(2.0, 6.0)) * slope.normalize_or(DVec2::X);
            let [first, second] = planted_views(steep, angles, lengths);
            let Ok(hinge) = hinge_from_two_views(&first, &second) else { continue };
            if hinge.condition.is_infinite() {
                continue;
            }
            let plane = Plane::from_slope(steep);
            let off = |s: f64| {
                let at = |view: usize, rod: usize| {
                    (hinge.depth[view][rod] - s * plane.depth([first, second][rod][view])).abs()
                        / lengths[rod]
                };
                at(0, 0).max(at(0, 1)).max(at(1, 0)).max(at(1, 1))
            };
            ratios.push(off(1.0).min(off(-1.0)) / hinge.condition / f64::EPSILON);
        }
        let worst = ratios.iter().copied().fold(0.0, f64::max);
        assert!(ratios.len() > 10_000 && worst <= ROUNDING / f64::EPSILON, "{worst}");
    }

    /// A plane seen nearly edge-on: the fit stops at the largest tilt and reports it; the default is 80 degrees.
    #[test]
    fn a_fit_at_the_tilt_limit_says_so() {
        use crate::planar::fit_rod;
        let mut random = Random::new(5);
        for (tilt_deg, is_at_limit) in [(87.0, true), (83.0, true), (60.0, false)] {
            let slope = f64::to_radians(tilt_deg).tan() * DVec2::from_angle(1.0);
            let basis = [slope.normalize() * f64::to_radians(tilt_deg).cos(), slope.normalize().perp()];
            let (mut a, mut b) = (vec![], vec![]);
            for i in 0..40 {
                let t = 0.15 * f64::from(i);
                let at = |angle: f64, length: f64, random: &mut Random| {
                    let noise = 0.002 * DVec2::from_array(random.normal_pair().map(f64::from));
                    length * (angle.cos() * basis[0] + angle.sin() * basis[1]) + noise
                };
                a.push(at(0.8 * t.sin(), 0.4, &mut random));
                b.push(at(2.0 + 0.8 * t.cos(), 0.45, &mut random));
            }
            let (o, options) =
                (vec![DVec2::ZERO; 40], FitOptions { noise_sd: 0.002, ..FitOptions::default() });
            assert_eq!(fit_hinge(&a, &o, &b, &options).unwrap().at_tilt_limit, is_at_limit, "{tilt_deg}");
            assert_eq!(fit_rod(&o, &a, &options).unwrap().at_tilt_limit, is_at_limit, "{tilt_deg}");
            let steeper = FitOptions { max_tilt_deg: 89.5, ..options };
            assert!(!fit_hinge(&a, &o, &b, &steeper).unwrap().at_tilt_limit, "{tilt_deg}");
        }
    }
}
