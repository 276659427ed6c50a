//! Structure from positions and velocities instead of several views.
//!
//! Source: the continuous kind of input in fig. 2 of Hoffman and Flinchbaugh 1982, which the paper does not treat;
//! this module derives it. A rod's image vector d satisfies d' M d = length^2 with M = I + g g', g = (p, q). The
//! time derivative of this equation does not contain the length:
//!
//! ```text
//! d' M v = 0:    (1 + p^2) x vx + p q (x vy + y vx) + (1 + q^2) y vy = 0
//! ```
//!
//! This is one linear, homogeneous equation in (1 + p^2, p q, 1 + q^2) for every rod and instant. Two of them
//! determine the plane up to its mirror: **one instant of a hinge, or two of a rod**, like two views of a hinge
//! and three of a rod. The two instants of a rod must differ in direction.
//!
//! Limits: two equations are as many as unknowns and are not evidence of planar motion. Velocities are
//! differences of noisy positions: if views are available, [`fit_hinge`](super::fit_hinge) uses them better.

use super::Plane;
use super::fit::{form, slope_from_form};
use super::rod::difference_of_powers;
use glam::{DVec2, DVec3};
use nalgebra::{Matrix3, SymmetricEigen};
use thiserror::Error;

/// Image vector of a rod from its pivot, and its rate of change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RodMotion {
    /// Image vector, in the unit of the points.
    pub position: DVec2,
    /// Image velocity of the end relative to the pivot, unit of the points per second.
    pub velocity: DVec2,
}

/// Why motions determine no plane or more than one.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum MotionRefusal {
    /// A vector, or its square, is NaN or infinite.
    #[error("a position or velocity is not a usable number")]
    NotFinite,
    /// Fewer than two rods or instants with motion.
    #[error("2 motions that give an equation are needed, got {found}")]
    TooFew {
        /// Number of motions that are not zero.
        found: usize,
    },
    /// All motions give the same equation: a family of planes fits.
    #[error("all motions give the same equation")]
    SameEquation,
    /// All velocities are perpendicular to their rods: the plane is parallel to the image.
    #[error("the plane is parallel to the image")]
    ParallelToImage,
    /// The best form is not that of a plane: not one planar motion.
    #[error("no planar motion has these positions and velocities")]
    Imaginary,
}

/// The plane of motions in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFit {
    /// The plane, or its mirror.
    pub plane: Plane,
    /// Length of the rod from each motion, in the unit of the points.
    pub lengths: Vec<f64>,
    /// Residuals: velocity along the rod in space divided by that expected from noise; 1 is typical.
    pub residuals: Vec<f64>,
    /// Number of equations less unknowns; at 0 nothing can contradict a plane.
    pub redundancy: usize,
}

/// Fits a plane to motions of one or more rods in it: one instant of a hinge's two rods, or any number of
/// instants. `position_sd` and `velocity_sd` are the standard deviations of the coordinates of the vectors. If
/// both are 0, positions and velocities are weighted as if one second were the unit of time.
///
/// # Errors
/// A [`MotionRefusal`].
pub fn plane_from_motions(
    motions: &[RodMotion],
    position_sd: f64,
    velocity_sd: f64,
) -> Result<MotionFit, MotionRefusal> {
    let rows = rows(motions)?;
    let moving = || rows.iter().zip(motions).filter(|(row, _)| **row != DVec3::ZERO);
    let noise_free = position_sd <= 0.0 && velocity_sd <= 0.0;
    let (position_sd, velocity_sd) = if noise_free { (1.0, 1.0) } else { (position_sd, velocity_sd) };
    // Standard deviation of d' M v.
    let spread = |m: &RodMotion, v: DVec3| {
        let times = |d: DVec2| DVec2::new(v.x * d.x + v.y * d.y, v.y * d.x + v.z * d.y);
        (times(m.velocity) * position_sd).length().hypot((times(m.position) * velocity_sd).length())
    };
    let mut slope = DVec2::ZERO;
    for _ in 0..10 {
        let mut normal = Matrix3::zeros();
        for (row, motion) in moving() {
            let row = nalgebra::Vector3::from(row.to_array()) / spread(motion, form(slope));
            normal += row * row.transpose();
        }
        let v = smallest(normal)?;
        let before = slope;
        slope = slope_from_form(v, v.x * v.z - v.y * v.y).ok_or(MotionRefusal::Imaginary)?;
        if (slope - before).length() <= 1e-12 * (1.0 + slope.length()) {
            break;
        }
    }
    let plane = Plane::from_slope(slope);
    let v = form(slope);
    Ok(MotionFit {
        plane,
        lengths: motions.iter().map(|m| plane.lift(m.position).length()).collect(),
        residuals: rows
            .iter()
            .zip(motions)
            .map(|(row, m)| if *row == DVec3::ZERO { 0.0 } else { row.dot(v) / spread(m, v) })
            .collect(),
        redundancy: moving().count() - 2,
    })
}

/// The checked coefficients of (1 + p^2, p q, 1 + q^2) for each motion.
fn rows(motions: &[RodMotion]) -> Result<Vec<DVec3>, MotionRefusal> {
    // With d and v as two views, |d + v / 2|^2 - |d - v / 2|^2 and the like have twice these coefficients.
    let row = |m: &RodMotion| {
        0.5 * difference_of_powers(m.position + 0.5 * m.velocity, m.position - 0.5 * m.velocity)
    };
    let rows: Vec<DVec3> = motions.iter().map(row).collect();
    if rows.iter().any(|row| !row.is_finite()) {
        return Err(MotionRefusal::NotFinite);
    }
    let found = rows.iter().filter(|row| **row != DVec3::ZERO).count();
    if found < 2 {
        return Err(MotionRefusal::TooFew { found });
    }
    let square =
        |m: &RodMotion| m.position.dot(m.velocity).abs() <= 1e-13 * m.position.length() * m.velocity.length();
    if motions.iter().all(square) { Err(MotionRefusal::ParallelToImage) } else { Ok(rows) }
}

/// Eigenvector of the smallest eigenvalue; an error if it is not unique.
fn smallest(normal: Matrix3<f64>) -> Result<DVec3, MotionRefusal> {
    if normal.iter().any(|x| !x.is_finite()) {
        return Err(MotionRefusal::NotFinite);
    }
    let eigen = SymmetricEigen::new(normal);
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    if eigen.eigenvalues[order[1]] <= 1e-24 * eigen.eigenvalues[order[2]] {
        return Err(MotionRefusal::SameEquation);
    }
    let v = eigen.eigenvectors.column(order[0]);
    Ok(DVec3::new(v[0], v[1], v[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::hinge_from_two_views;
    use crate::synth::Random;
    use proptest::prelude::*;

    /// A rod in the plane at an angle, rotating.
    fn turning(slope: DVec2, angle: f64, rate: f64, length: f64) -> RodMotion {
        let along = slope.try_normalize().unwrap_or(DVec2::X);
        let cos_tilt = 1.0 / (1.0 + slope.length_squared()).sqrt();
        let image = |c: f64, s: f64| length * (c * cos_tilt * along + s * along.perp());
        RodMotion {
            position: image(angle.cos(), angle.sin()),
            velocity: rate * image(-angle.sin(), angle.cos()),
        }
    }

    proptest! {
        #[test]
        fn one_instant_of_a_hinge_gives_its_plane(
            p in -2.0..2.0f64, q in -2.0..2.0f64, start in 0.0..6.3f64, between in 0.2..1.3f64, rate in 0.3..3.0f64,
        ) {
            let slope = DVec2::new(p, q);
            prop_assume!(slope.length() > 0.1);
            let rods = [turning(slope, start, rate, 0.4), turning(slope, start + between, -2.0, 0.5)];
            let fit = plane_from_motions(&rods, 0.0, 0.0).unwrap();
            prop_assert!(fit.plane.angle_up_to_mirror_rad(&Plane::from_slope(slope)) < 1e-7);
            prop_assert!((fit.lengths[0] - 0.4).abs() < 1e-6 && (fit.lengths[1] - 0.5).abs() < 1e-6);
            prop_assert_eq!(fit.redundancy, 0);
            // It is the limit of two views close together in time.
            let views = |rod: f64, rate: f64, length: f64| {
                [-5e-5, 5e-5].map(|t| turning(slope, rod + rate * t, 0.0, length).position)
            };
            let hinge = hinge_from_two_views(&views(start, rate, 0.4), &views(start + between, -2.0, 0.5)).unwrap();
            prop_assert!(fit.plane.angle_up_to_mirror_rad(&hinge.plane) < 1e-4);
        }
    }

    #[test]
    fn many_noisy_instants_of_a_rod_give_its_plane() {
        let mut random = Random::new(3);
        let slope = DVec2::new(0.8, 0.3);
        let noise =
            |sd: f64, random: &mut Random| sd * DVec2::from_array(random.normal_pair().map(f64::from));
        let motions: Vec<RodMotion> = (0..200)
            .map(|i| {
                let t = 0.05 * i as f64;
                let exact = turning(slope, 1.2 * t.sin(), 1.2 * t.cos(), 0.4);
                RodMotion {
                    position: exact.position + noise(0.004, &mut random),
                    velocity: exact.velocity + noise(0.02, &mut random),
                }
            })
            .collect();
        let fit = plane_from_motions(&motions, 0.004, 0.02).unwrap();
        assert!(fit.plane.angle_up_to_mirror_rad(&Plane::from_slope(slope)) < 0.03, "{:?}", fit.plane);
        let rms = (fit.residuals.iter().map(|r| r * r).sum::<f64>() / 198.0).sqrt();
        assert!((0.85..1.15).contains(&rms), "{rms}");
    }

    #[test]
    fn degenerate_motions_are_named() {
        let slope = DVec2::new(0.8, 0.3);
        let rod = |angle: f64, rate: f64| turning(slope, angle, rate, 0.4);
        let refuse = |motions: &[RodMotion]| plane_from_motions(motions, 0.0, 0.0).unwrap_err();
        let nan = RodMotion { position: DVec2::NAN, velocity: DVec2::X };
        assert_eq!(refuse(&[rod(0.1, 1.0), nan]), MotionRefusal::NotFinite);
        assert_eq!(refuse(&[rod(0.1, 1.0), rod(0.5, 0.0)]), MotionRefusal::TooFew { found: 1 });
        assert_eq!(refuse(&[]), MotionRefusal::TooFew { found: 0 });
        assert_eq!(refuse(&[rod(0.1, 1.0), rod(0.1, 2.0)]), MotionRefusal::SameEquation);
        let flat = |angle: f64| turning(DVec2::ZERO, angle, 1.0, 0.4);
        assert_eq!(refuse(&[flat(0.3), flat(1.1)]), MotionRefusal::ParallelToImage);
        let apart = |d: DVec2| RodMotion { position: d, velocity: d };
        assert_eq!(refuse(&[apart(DVec2::X), apart(DVec2::Y)]), MotionRefusal::Imaginary);
    }

    /// Weights and plane are consistent: least squares once more with the weights of the plane found give the
    /// same plane.
    #[test]
    fn the_plane_is_that_of_its_own_weights() {
        let mut random = Random::new(13);
        for _ in 0..20 {
            let slope = random.uniform(0.3, 2.0) * DVec2::from_angle(random.uniform(0.0, 6.3));
            let mut shake =
                |p: DVec2, sd: f64| p + sd * DVec2::from_array(random.normal_pair().map(f64::from));
            let motions: Vec<RodMotion> = (0..30)
                .map(|i| {
                    let exact = turning(slope, 0.3 * f64::from(i), 1.0 + 0.1 * f64::from(i), 0.4);
                    RodMotion { position: shake(exact.position, 0.02), velocity: shake(exact.velocity, 0.05) }
                })
                .collect();
            let Ok(fit) = plane_from_motions(&motions, 0.02, 0.05) else { continue };
            let g = fit.plane.slope();
            // d'V v = 0 with V = [1 + p², pq; pq, 1 + q²]: its variance by the errors of d and v.
            let v = glam::DMat2::from_cols_array(&[1.0 + g.x * g.x, g.x * g.y, g.x * g.y, 1.0 + g.y * g.y]);
            let mut normal = Matrix3::zeros();
            for (m, residual) in motions.iter().zip(&fit.residuals) {
                let sd = (0.02 * (v * m.velocity).length()).hypot(0.05 * (v * m.position).length());
                assert!((m.position.dot(v * m.velocity) / sd - residual).abs() < 1e-9);
                let (d, w) = (m.position, m.velocity);
                let row = nalgebra::Vector3::new(d.x * w.x, d.x * w.y + d.y * w.x, d.y * w.y) / sd;
                normal += row * row.transpose();
            }
            let v = smallest(normal).unwrap();
            let again = slope_from_form(v, v.x * v.z - v.y * v.y).unwrap();
            assert!(
                (again - g).length().min((again + g).length()) < 1e-6 * (1.0 + g.length()),
                "{again} {g}"
            );
        }
    }
}
