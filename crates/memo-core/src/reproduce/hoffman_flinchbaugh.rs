//! The claims of Hoffman and Flinchbaugh (1982), tested by counts over random problems: whether three views of a
//! rod and two of a hinge determine the plane, which of the two roots of eq. (9) is valid, what makes a problem
//! degenerate, and how often unrelated points have a planar interpretation.
//!
//! Results depend only on the seed. Rods and hinges have a plane tilted between 5 and 85 degrees, and all angles
//! are uniform. A depth counts as recovered if its error is less than 1e-6 of the length, up to the mirror. The
//! counts hold for these distributions and are not a proof for every problem.

use crate::planar::Plane;
use crate::planar::hinge::{HingeRefusal, hinge_from_two_views};
use crate::planar::rod::{RodRefusal, rod_by_paper, rod_from_ellipse, rod_from_three_views};
use crate::synth::Random;
use glam::{DVec2, DVec3};
use nalgebra::{Matrix3, Matrix4};
use std::f64::consts::TAU;

/// Limit of a recovered depth's error divided by the length, and of the error of a satisfied equation.
const EXACT: f64 = 1e-6;
/// A Jacobian has lost rank if its smallest singular value is below this share of its largest.
const RANK: f64 = 1e-9;
/// A rod is never extended if its image is always shorter than this share of its full length.
const EXTENDED: f64 = 0.9;

/// Eqs. (4)-(14) of appendix 1 on three views, as printed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrintedRod {
    /// k1 to k5.
    pub k: [f64; 5],
    /// The two roots x = z2 / z3 of eq. (9); `None` if they are complex or a = 0.
    pub roots: Option<[f64; 2]>,
    /// z3^2 of eq. (14) for each root; a root is valid if this is positive.
    pub z3_sq: [f64; 2],
}

impl PrintedRod {
    /// Computed as in the text: k's of footnote 11, roots by (10), z3^2 by (14).
    pub fn new(views: &[DVec2; 3]) -> Self {
        let k = ks(views);
        let [k1, k2, k3, k4, k5] = k;
        let a = k2 * (k4 * k4 - k3 * k3) - k1 * k4 * k4;
        let b = 2.0 * k4 * k5 * (k2 - k1);
        let c = k2 * k5 * k5 - k1 * (k5 * k5 - k3 * k3);
        let discriminant = b * b - 4.0 * a * c;
        let roots = (discriminant >= 0.0 && a != 0.0)
            .then(|| [1.0, -1.0].map(|sign| (-b + sign * discriminant.sqrt()) / (2.0 * a)));
        let z3_sq = |x: f64| -k1 * k3 * k3 / ((k4 * k4 - k3 * k3) * x * x + k5 * k5 + 2.0 * k4 * k5 * x);
        Self { k, roots, z3_sq: roots.map_or([f64::NAN; 2], |roots| roots.map(z3_sq)) }
    }

    /// Number of roots that give a real z3 and, with either sign of z1, satisfy (4)-(6).
    pub fn valid_roots(&self) -> usize {
        self.solutions().filter(|(_, _, error)| *error < EXACT).count()
    }

    /// For each root with a real z3: (z1, z2, z3) with z3 > 0, whether z1 has the printed sign (+), and the error
    /// of (6) divided by the largest term.
    fn solutions(&self) -> impl Iterator<Item = ([f64; 3], bool, f64)> + '_ {
        let [_, k2, k3, k4, k5] = self.k;
        let of_root = move |(x, z3_sq): (f64, f64)| {
            let z1_sq = z3_sq - k2;
            if !(z3_sq > 0.0 && z1_sq >= 0.0) {
                return None;
            }
            let (z3, z1) = (z3_sq.sqrt(), z1_sq.sqrt());
            let fails = |z1: f64| {
                let terms = [k3 * z1, k4 * x * z3, k5 * z3];
                terms.iter().sum::<f64>().abs() / terms.iter().fold(0.0, |most: f64, t| most.max(t.abs()))
            };
            let (plus, minus) = (fails(z1), fails(-z1));
            let is_printed = plus <= minus;
            Some(([if is_printed { z1 } else { -z1 }, x * z3, z3], is_printed, plus.min(minus)))
        };
        self.roots.into_iter().flatten().zip(self.z3_sq).filter_map(of_root)
    }

    /// z1, z2, z3 of the valid root, z3 > 0; its mirror fits as well.
    pub fn depths(&self) -> Option<[f64; 3]> {
        self.solutions().min_by(|a, b| a.2.total_cmp(&b.2)).map(|(z, _, _)| z)
    }
}

/// k1 to k5 of footnote 11.
fn ks(d: &[DVec2; 3]) -> [f64; 5] {
    let square = |i: usize| d[i].length_squared();
    let cross = |i: usize, j: usize| d[i].perp_dot(d[j]);
    [square(0) - square(1), square(0) - square(2), cross(1, 2), cross(2, 0), cross(0, 1)]
}

/// Results for random rods in three views (Proposition 1).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RodTrials {
    /// Number of rods.
    pub trials: usize,
    /// Rods with depths recovered by [`rod_from_three_views`].
    pub recovered: usize,
    /// Recovered by the ellipse of footnote 14.
    pub recovered_by_ellipse: usize,
    /// Recovered by eqs. (4)-(14) in the printed order.
    pub recovered_as_printed: usize,
    /// Rods with exactly one valid root of eq. (9).
    pub one_root: usize,
    /// Rods for which the printed z1 = + sqrt(z3^2 - k2) has the sign required by (6), for positive z3.
    pub printed_z1: usize,
    /// Rods whose Jacobian has rank three.
    pub full_rank: usize,
    /// Largest |[a1 a2 a3] - (k3 z1 + k4 z2 + k5 z3)| divided by length^3, for any three vectors.
    pub triple_product_error: f64,
    /// Largest |det J - 4 (k3 z2 z3 + k4 z1 z3 + k5 z1 z2)| divided by length^4.
    pub jacobian_error: f64,
    /// Rods whose images are never longer than nine tenths of their length.
    pub never_extended: usize,
    /// Of these, recovered.
    pub never_extended_recovered: usize,
    /// Rods with images of equal length in views 2 and 3 (k1 = k2), not collinear.
    pub equal_images: usize,
    /// Of these, rods with exactly one valid root of eq. (9).
    pub equal_images_one_root: usize,
}

/// Solves random rods.
pub fn rod_trials(trials: usize, seed: u64) -> RodTrials {
    let mut random = Random::new(seed);
    let mut tally = RodTrials { trials, ..RodTrials::default() };
    for _ in 0..trials {
        let plane = drawn_plane(&mut random);
        let angles = [0; 3].map(|_| random.uniform(0.0, TAU));
        let views = angles.map(|angle| in_plane(plane, angle));
        let truth = views.map(|d| plane.depth(d));
        let is_recovered = |depth: Option<[f64; 3]>| depth.is_some_and(|z| up_to_mirror(&z, &truth) < EXACT);
        let printed = PrintedRod::new(&views);
        let recovered = is_recovered(rod_from_three_views(&views).ok().map(|rod| rod.depth));
        tally.recovered += usize::from(recovered);
        tally.recovered_by_ellipse +=
            usize::from(is_recovered(rod_from_ellipse(&views).ok().map(|rod| rod.depth)));
        tally.recovered_as_printed +=
            usize::from(is_recovered(rod_by_paper(&views).ok().map(|rod| rod.depth)));
        tally.one_root += usize::from(printed.valid_roots() == 1);
        tally.printed_z1 += usize::from(truth[0] * truth[2] > 0.0);
        let jacobian = rod_jacobian(printed.k, truth);
        tally.full_rank += usize::from(is_full_rank(jacobian.singular_values().as_slice()));
        let [z1, z2, z3] = truth;
        let [_, _, k3, k4, k5] = printed.k;
        let by_formula = 4.0 * (k3 * z2 * z3 + k4 * z1 * z3 + k5 * z1 * z2);
        tally.jacobian_error = tally.jacobian_error.max((jacobian.determinant() - by_formula).abs());
        tally.triple_product_error = tally.triple_product_error.max(triple_product_error(&mut random));
        if views.iter().all(|d| d.length() < EXTENDED) {
            tally.never_extended += 1;
            tally.never_extended_recovered += usize::from(recovered);
        }
        // Views 2 and 3 mirrored in the axis of the ellipse have the same length.
        let mirrored = [angles[0], angles[1], -angles[1]].map(|angle| in_plane(plane, angle));
        tally.equal_images += 1;
        tally.equal_images_one_root += usize::from(PrintedRod::new(&mirrored).valid_roots() == 1);
    }
    tally
}

/// Results for random hinges in two views (Proposition 2).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HingeTrials {
    /// Number of hinges.
    pub trials: usize,
    /// Hinges with depths recovered by [`hinge_from_two_views`].
    pub recovered: usize,
    /// Hinges whose Jacobian has rank four.
    pub full_rank: usize,
    /// Hinges whose planes were counted by search.
    pub searched: usize,
    /// Of these, with exactly one plane up to the mirror.
    pub one_plane: usize,
    /// Largest number of planes found for one.
    pub most_planes: usize,
    /// Problems with an interpretation if the middle point is taken as the joint.
    pub joint_in_the_middle: usize,
    /// Problems with an interpretation if an end point is taken as the joint.
    pub joint_at_an_end: usize,
}

/// Solves random hinges; for the first `searched`, planes are counted by brute force.
pub fn hinge_trials(trials: usize, searched: usize, seed: u64) -> HingeTrials {
    let mut random = Random::new(seed);
    let mut tally = HingeTrials { trials, searched: searched.min(trials), ..HingeTrials::default() };
    for trial in 0..trials {
        let plane = drawn_plane(&mut random);
        let [first, second] =
            [1.0, 0.8].map(|length| [0; 2].map(|_| length * in_plane(plane, random.uniform(0.0, TAU))));
        let truth = [first, second].map(|rod| rod.map(|d| plane.depth(d)));
        let found = hinge_from_two_views(&first, &second).ok();
        let flat = [truth[0][0], truth[1][0], truth[0][1], truth[1][1]];
        let is_recovered = found.is_some_and(|hinge| {
            let [[a1, b1], [a2, b2]] = hinge.depth;
            up_to_mirror(&[a1, b1, a2, b2], &flat) < EXACT
        });
        tally.recovered += usize::from(is_recovered);
        let jacobian = hinge_jacobian(&first, &second, truth);
        tally.full_rank += usize::from(is_full_rank(jacobian.singular_values().as_slice()));
        if trial < tally.searched {
            let planes = planes_by_search(&first, &second).len();
            tally.one_plane += usize::from(planes == 1);
            tally.most_planes = tally.most_planes.max(planes);
        }
        // With the first end as the joint, vectors to the other end and the middle point start there.
        let from_end = [[-first[0], -first[1]], [second[0] - first[0], second[1] - first[1]]];
        tally.joint_in_the_middle += usize::from(found.is_some());
        tally.joint_at_an_end += usize::from(hinge_from_two_views(&from_end[0], &from_end[1]).is_ok());
    }
    tally
}

/// Number of `trials` unrelated pairs in three views, and of triples in two, with a planar interpretation: image
/// vectors are independent normal numbers.
pub fn false_targets(trials: usize, seed: u64) -> [usize; 2] {
    let mut random = Random::new(seed);
    let mut draw = || DVec2::from_array(random.normal_pair().map(f64::from));
    let rods = (0..trials).filter(|_| rod_from_three_views(&[draw(), draw(), draw()]).is_ok()).count();
    let hinges =
        (0..trials).filter(|_| hinge_from_two_views(&[draw(), draw()], &[draw(), draw()]).is_ok()).count();
    [rods, hinges]
}

/// Number of `trials` rods and hinges that are refused if the problem is made degenerate, in the order of
/// [`DEGENERATE`].
pub fn degenerate_refusals(trials: usize, seed: u64) -> [usize; DEGENERATE.len()] {
    let mut random = Random::new(seed);
    let mut refused = [0; DEGENERATE.len()];
    for _ in 0..trials {
        let plane = drawn_plane(&mut random);
        let [a, b, c] = [0; 3].map(|_| random.uniform(0.0, TAU));
        let flat = Plane { p: 0.0, q: 0.0 };
        let rod = |plane: Plane, angles: [f64; 3]| angles.map(|angle| in_plane(plane, angle));
        let edge_on = [a, b, c].map(|angle| angle.cos() * DVec2::from_angle(c));
        let half_turn = a + 0.5 * TAU;
        let [same_a, same_b] = [0; 2].map(|_| in_plane(plane, a));
        let is = [
            matches!(rod_from_three_views(&rod(flat, [a, b, c])), Err(RodRefusal::ParallelToImage { .. })),
            matches!(rod_from_three_views(&edge_on), Err(RodRefusal::CollinearImages { .. })),
            matches!(
                rod_from_three_views(&rod(plane, [a, b, half_turn])),
                Err(RodRefusal::EqualProjections { .. })
            ),
            matches!(
                hinge_from_two_views(&[same_a, same_b], &[in_plane(plane, b), in_plane(plane, c)]),
                Err(HingeRefusal::EqualProjections { .. })
            ),
        ];
        for (count, is) in refused.iter_mut().zip(is) {
            *count += usize::from(is);
        }
    }
    refused
}

/// Kinds of problems of [`degenerate_refusals`].
pub const DEGENERATE: [&str; 4] = [
    "rod in a plane parallel to the image",
    "rod in a plane seen edge-on",
    "rod with two opposite images",
    "hinge with one rod that does not move",
];

/// All planes through the pivot in which both vectors of each pair have the same length, by search: the sign
/// changes of the second equation along the curve of slopes that satisfy the first.
///
/// Along the direction u the first equation gives |g|^2 = -(|a|^2 - |b|^2) / ((u.a)^2 - (u.b)^2). One slope of
/// each mirror pair. The search does not use the closed forms; it misses planes closer to each other than 0.025
/// degrees.
pub fn planes_by_search(first: &[DVec2; 2], second: &[DVec2; 2]) -> Vec<DVec2> {
    const STEPS: usize = 7200;
    let excess = |rod: &[DVec2; 2], g: DVec2| {
        let length_sq = |d: DVec2| d.length_squared() + g.dot(d).powi(2);
        length_sq(rod[0]) - length_sq(rod[1])
    };
    let on_first = |angle: f64| {
        let u = DVec2::from_angle(angle);
        let by_size = u.dot(first[0]).powi(2) - u.dot(first[1]).powi(2);
        let size_sq = -(first[0].length_squared() - first[1].length_squared()) / by_size;
        (size_sq > 0.0 && size_sq < 1e12).then(|| size_sq.sqrt() * u)
    };
    let value = |angle: f64| on_first(angle).map(|g| excess(second, g));
    let step = std::f64::consts::PI / STEPS as f64;
    let mut found = Vec::new();
    for i in 0..STEPS {
        let (mut low, mut high) = (i as f64 * step, (i + 1) as f64 * step);
        let (Some(at_low), Some(at_high)) = (value(low), value(high)) else { continue };
        if at_low.signum() == at_high.signum() {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match value(middle) {
                Some(v) if v.signum() == at_low.signum() => low = middle,
                _ => high = middle,
            }
        }
        let Some(g) = on_first(low) else { continue };
        // At a pole of |g| the sign changes as well, but there is no zero.
        if excess(second, g).abs() < EXACT * (1.0 + g.length_squared()) {
            found.push(g);
        }
    }
    found
}

/// A plane whose tilt is uniform between 5 and 85 degrees.
fn drawn_plane(random: &mut Random) -> Plane {
    let tilt_rad = random.uniform(5f64.to_radians(), 85f64.to_radians());
    Plane::from_slope(tilt_rad.tan() * DVec2::from_angle(random.uniform(0.0, TAU)))
}

/// Image of the unit vector at `angle` in the plane, measured from its line of steepest slope.
fn in_plane(plane: Plane, angle: f64) -> DVec2 {
    let slope = plane.slope();
    let steepest = slope.try_normalize().unwrap_or(DVec2::X);
    angle.cos() * plane.tilt_rad().cos() * steepest + angle.sin() * steepest.perp()
}

/// The largest difference of depths, for the better of the two mirror solutions.
fn up_to_mirror<const N: usize>(found: &[f64; N], truth: &[f64; N]) -> f64 {
    let off = |sign: f64| (0..N).map(|i| (found[i] - sign * truth[i]).abs()).fold(0.0, f64::max);
    off(1.0).min(off(-1.0))
}

fn is_full_rank(singular_values: &[f64]) -> bool {
    let (least, most) =
        singular_values.iter().fold((f64::INFINITY, 0.0), |(l, m): (f64, f64), v| (l.min(*v), m.max(*v)));
    least > RANK * most
}

/// The Jacobian printed in appendix 1.
fn rod_jacobian([_, _, k3, k4, k5]: [f64; 5], [z1, z2, z3]: [f64; 3]) -> Matrix3<f64> {
    Matrix3::new(2.0 * z1, -2.0 * z2, 0.0, 2.0 * z1, 0.0, -2.0 * z3, k3, k4, k5)
}

/// The Jacobian printed in appendix 2; unknowns (za1, za2, zb1, zb2).
fn hinge_jacobian(a: &[DVec2; 2], b: &[DVec2; 2], [za, zb]: [[f64; 2]; 2]) -> Matrix4<f64> {
    // [a1 b1 a2] = k3 za1 + k4 zb1 + k5 za2, [a1 b1 b2] = k6 za1 + k7 zb1 + k8 zb2.
    let (k3, k4, k5) = (b[0].perp_dot(a[1]), a[1].perp_dot(a[0]), a[0].perp_dot(b[0]));
    let (k6, k7, k8) = (b[0].perp_dot(b[1]), b[1].perp_dot(a[0]), a[0].perp_dot(b[0]));
    #[rustfmt::skip]
    let rows = Matrix4::new(
        2.0 * za[0], -2.0 * za[1], 0.0, 0.0,
        0.0, 0.0, 2.0 * zb[0], -2.0 * zb[1],
        k3, k5, k4, 0.0,
        k6, 0.0, k7, k8,
    );
    rows
}

/// Eq. (3) compared with eq. (6) for three vectors that need not be in a plane.
fn triple_product_error(random: &mut Random) -> f64 {
    let vectors = [0; 3].map(|_| DVec3::from_array([0; 3].map(|_| random.uniform(-1.0, 1.0))));
    let [_, _, k3, k4, k5] = ks(&vectors.map(|v| v.truncate()));
    let product = vectors[0].dot(vectors[1].cross(vectors[2]));
    (product - (k3 * vectors[0].z + k4 * vectors[1].z + k5 * vectors[2].z)).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_views_of_a_rod_leave_one_root_and_its_mirror() {
        let t = rod_trials(2000, 1);
        // Problems may be nearly degenerate; nearly all are recovered.
        assert!(t.recovered > 1990 && t.recovered_by_ellipse > 1990, "{t:?}");
        assert!(t.one_root > 1950 && t.equal_images_one_root > 1950, "{t:?}");
        assert!(t.triple_product_error < 1e-14 && t.jacobian_error < 1e-12, "{t:?}");
        // The printed sign of z1 is right if z1 and z3 have the same sign: half of the time.
        assert!((850..1150).contains(&t.printed_z1), "{t:?}");
        assert!(t.never_extended_recovered * 100 >= t.never_extended * 99, "{t:?}");
    }

    #[test]
    fn the_printed_equations_solve_a_rod_worked_by_hand() {
        // Plane z = x (45 degrees): unit vectors at 0, 90 and 45 degrees in it.
        let h = 0.5f64.sqrt();
        let views = [DVec2::new(h, 0.0), DVec2::new(0.0, 1.0), DVec2::new(0.5, h)];
        let printed = PrintedRod::new(&views);
        let expected = [-0.5, -0.25, -0.5, -0.5, h];
        assert!(printed.k.iter().zip(expected).all(|(k, e)| (k - e).abs() < 1e-12), "{printed:?}");
        assert_eq!(printed.valid_roots(), 1);
        let depths = printed.depths().unwrap();
        assert!(up_to_mirror(&depths, &[h, 0.0, 0.5]) < 1e-7, "{depths:?}");
    }

    #[test]
    fn two_views_of_a_hinge_leave_one_plane_and_its_mirror() {
        let t = hinge_trials(2000, 100, 2);
        assert!(t.recovered > 1980 && t.full_rank == 2000, "{t:?}");
        assert!(t.most_planes == 1 && t.one_plane > 95, "{t:?}");
        assert!(t.joint_in_the_middle > 1990 && t.joint_at_an_end > 400, "{t:?}");
    }

    #[test]
    fn degenerate_problems_are_refused_and_unrelated_points_are_not() {
        assert_eq!(degenerate_refusals(200, 3), [200; 4]);
        let [rods, hinges] = false_targets(20_000, 4);
        assert!((6600..7400).contains(&rods) && (6200..7000).contains(&hinges), "{rods} {hinges}");
    }

    /// Some rods, but not all, are never seen at more than nine tenths of their length.
    #[test]
    fn never_extended_rods_are_counted_apart() {
        let t = rod_trials(2000, 7);
        let mut random = Random::new(7);
        // The same share as that of three short projections with random tilts and angles, from other samples.
        let share = (0..4000)
            .filter(|_| {
                let plane = drawn_plane(&mut random);
                [(); 3].iter().all(|()| in_plane(plane, random.uniform(0.0, TAU)).length() < EXTENDED)
            })
            .count() as f64
            / 4000.0;
        assert!((t.never_extended as f64 / 2000.0 - share).abs() < 0.04, "{} {share}", t.never_extended);
        assert!(0 < t.never_extended && t.never_extended < 1900);
    }
}
