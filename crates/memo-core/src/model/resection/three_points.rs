//! The rotations for which three points lie on three rays, in closed form: starts for the search for a pose.
//!
//! Source: Grunert 1841, reviewed by Haralick, Lee, Ottenberg and Nölle 1994 (IJCV 13, 331-356). The distances
//! s_1, s_2 = u s_1, s_3 = v s_1 of the points along their unit rays satisfy, with c_ij the cosine between two
//! rays,
//!
//! ```text
//! s_1² (1 + u² - 2 u c_12)    = |p_1 p_2|²
//! s_1² (1 + v² - 2 v c_13)    = |p_1 p_3|²
//! s_1² (u² + v² - 2 u v c_23) = |p_2 p_3|²
//! ```
//!
//! With A = |p_2 p_3|² / |p_1 p_3|², C = |p_1 p_2|² / |p_1 p_3|² and Q = 1 + v² - 2 v c_13, the third
//! equation minus the first is u D = N with D = 2 (c_12 - v c_23) and N = (A - C) Q + 1 - v²; the first times
//! D² is the quartic
//!
//! ```text
//! N² - 2 N D c_12 + D² (1 - C Q) = 0.
//! ```
//!
//! Where rounding or noise makes two of its roots complex, their real part is used, because the two real
//! roots met near it.
//!
//! Limits: the result is not exact where two roots coincide, or for distant points, where all four approach
//! each other; the search uses these poses as starts only.

use glam::{DMat3, DVec3};
use nalgebra::Matrix4;
use nalgebra::linalg::Schur;

/// Of the two roots u for one v, a root is dropped if its error in u D = N is larger by this factor.
const TOLD_APART: f64 = 10.0;
/// Errors in u D = N up to this are the rounding of a double root: both roots are kept.
const ROUNDING: f64 = 1e-6;

/// At most eight rotations that map the points onto the rays; the rays have unit length.
///
/// Empty if the points lie on a line.
pub(super) fn rotations_onto_rays(points: [DVec3; 3], rays: [DVec3; 3]) -> Vec<DMat3> {
    let Some(axes) = triangle_axes(points) else {
        return Vec::new();
    };
    let [p1, p2, p3] = points;
    let [c12, c13, c23] = [rays[0].dot(rays[1]), rays[0].dot(rays[2]), rays[1].dot(rays[2])];
    let side_sq = p1.distance_squared(p3);
    let (a, c) = (p2.distance_squared(p3) / side_sq, p1.distance_squared(p2) / side_sq);
    // Polynomials in v, the constant coefficient first.
    let q = [1.0, -2.0 * c13, 1.0];
    let n = [(a - c) * q[0] + 1.0, (a - c) * q[1], (a - c) * q[2] - 1.0];
    let d = [2.0 * c12, -2.0 * c23];
    let n_squared = product(&n, &n);
    let n_d = product(&n, &d);
    let last = product(&product(&d, &d), &[1.0 - c * q[0], -c * q[1], -c * q[2]]);
    let quartic: [f64; 5] =
        std::array::from_fn(|k| n_squared[k] - 2.0 * c12 * n_d.get(k).unwrap_or(&0.0) + last[k]);
    let mut rotations = Vec::new();
    for v in real_parts_of_roots(&quartic) {
        let half_gap = (c12 * c12 - 1.0 + c * value(&q, v)).max(0.0).sqrt();
        let candidates = [c12 + half_gap, c12 - half_gap];
        let misfits = candidates.map(|u| (u * value(&d, v) - value(&n, v)).abs());
        for (k, u) in candidates.into_iter().enumerate() {
            let is_in_front = u > 0.0 && v > 0.0;
            if is_in_front && misfits[k] <= TOLD_APART * misfits[1 - k] + ROUNDING {
                let turned = triangle_axes([rays[0], u * rays[1], v * rays[2]]);
                rotations.extend(turned.map(|turned| turned * axes.transpose()));
            }
        }
    }
    rotations
}

/// Right-handed axes: along the side from the first corner to the second, perpendicular to it in the plane of
/// the triangle, and normal to the triangle.
fn triangle_axes(corners: [DVec3; 3]) -> Option<DMat3> {
    let along = (corners[1] - corners[0]).try_normalize()?;
    let normal = along.cross(corners[2] - corners[0]).try_normalize()?;
    Some(DMat3::from_cols(along, normal.cross(along), normal))
}

/// The product of two polynomials.
fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut coefficients = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            coefficients[i + j] += x * y;
        }
    }
    coefficients
}

/// The value of a polynomial.
fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Real parts of the roots, as eigenvalues of the companion matrix; empty if the leading coefficient
/// vanishes.
fn real_parts_of_roots(quartic: &[f64; 5]) -> Vec<f64> {
    let mut companion = Matrix4::zeros();
    for row in 0..4 {
        companion[(row, 3)] = -quartic[row] / quartic[4];
        if row > 0 {
            companion[(row, row - 1)] = 1.0;
        }
    }
    if !companion.iter().all(|x| x.is_finite()) {
        return Vec::new();
    }
    let schur = Schur::try_new(companion, f64::EPSILON, 1000);
    let mut roots: Vec<f64> =
        schur.map_or(Vec::new(), |schur| schur.complex_eigenvalues().iter().map(|root| root.re).collect());
    // Both roots of a complex pair have the same real part.
    roots.dedup();
    roots
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    fn nearest(points: [DVec3; 3], rotation: DMat3, translation: DVec3) -> f64 {
        let rays = points.map(|p| (rotation * p + translation).normalize());
        let found = rotations_onto_rays(points, rays);
        let size = |m: DMat3| m.to_cols_array().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        found.iter().map(|r| size(*r - rotation)).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_true_rotation_is_among_those_of_a_triangle() {
        let mut random = Random::new(4);
        let mut errors = Vec::new();
        for _ in 0..1000 {
            let mut draw = || DVec3::from_array(std::array::from_fn(|_| random.uniform(-1.0, 1.0)));
            let points = [draw(), draw(), draw()];
            let rotation = DMat3::from_axis_angle(draw().normalize(), 3.0 * draw().x);
            errors.push(nearest(points, rotation, DVec3::new(0.3, -0.2, 4.0)));
        }
        errors.sort_by(f64::total_cmp);
        assert!(errors[500] < 1e-12, "{}", errors[500]);
        // The largest errors come from double roots.
        assert!(errors[999] < 1e-2, "{}", errors[999]);
    }

    /// Seen symmetrically, D vanishes at the double root v = 1, and both u belong to it. A double root has
    /// half of the digits.
    #[test]
    fn an_isosceles_triangle_seen_symmetrically_is_found() {
        for (height, nod) in
            [0.4, 1.0, 1.5, 2.2].into_iter().flat_map(|h| [-0.9, -0.2, 0.0, 0.3, 1.1].map(|n| (h, n)))
        {
            let points = [DVec3::NEG_X, height * DVec3::Y, DVec3::X];
            let error = nearest(points, DMat3::from_rotation_x(nod), DVec3::new(0.0, 0.1, 5.0));
            assert!(error < 1e-4, "{height} {nod}: {error}");
        }
    }

    /// Distances along the rays by least squares on the rotated sides; in front of the centre of projection
    /// they are positive.
    #[test]
    fn no_rotation_puts_the_triangle_on_the_rays_behind_the_eye() {
        let mut random = Random::new(11);
        let (mut exact, mut triangles) = (0, 0);
        for _ in 0..300 {
            let mut draw = || DVec3::from_array(std::array::from_fn(|_| random.uniform(-1.0, 1.0)));
            let points = [draw(), draw(), draw()];
            let turned = DMat3::from_axis_angle(draw().normalize(), 3.0 * draw().x);
            let rays = points.map(|p| (turned * p + DVec3::new(0.3, -0.2, 2.5)).normalize());
            triangles += 1;
            for rotation in rotations_onto_rays(points, rays) {
                let sides = [1, 2].map(|i| rotation * (points[i] - points[0]));
                let a = nalgebra::SMatrix::<f64, 6, 3>::from_fn(|row, column| {
                    let (side, axis) = (row / 3, row % 3);
                    match column {
                        0 => -rays[0][axis],
                        _ if column == side + 1 => rays[column][axis],
                        _ => 0.0,
                    }
                });
                let b = nalgebra::SVector::<f64, 6>::from_fn(|row, _| sides[row / 3][row % 3]);
                let distances = a.svd(true, true).solve(&b, 1e-12).unwrap();
                // For nearly double roots the midpoint is returned, which does not satisfy the equations
                // exactly.
                if (a * distances - b).norm() < 1e-6 {
                    assert!(distances.min() > 0.0, "{distances}");
                    exact += 1;
                }
            }
        }
        assert!(exact >= triangles && exact <= 4 * triangles, "{exact} of {triangles}");
    }

    #[test]
    fn three_points_on_a_line_have_no_axes() {
        let line = [1.0, 2.0, 4.0].map(|x| DVec3::X * x);
        assert!(rotations_onto_rays(line, line.map(|p| (p + DVec3::Z).normalize())).is_empty());
    }
}
