//! Depths of many rods from three views each, or of hinges from two, without other results.
//!
//! Hoffman and Flinchbaugh 1982, Propositions 1 and 2, by Horn's ellipse (footnote 14). Both give two pairs of
//! image vectors, each pair of one length: |a|^2 + (g.a)^2 = |b|^2 + (g.b)^2. So M = I + g g' is perpendicular to
//! two differences of (x^2, 2 x y, y^2), and
//!
//! ```text
//! (A, B, C) = k (1 + p^2, p q, 1 + q^2)    k = (A + C)/2 - sqrt((A - C)^2/4 + B^2), its smaller eigenvalue
//! g = (A - k, B) / sqrt(k (A - k)) = (B, C - k) / sqrt(k (C - k))
//! ```
//!
//! The results are not refined and have no condition number. k loses digits by cancellation if the plane is seen
//! nearly edge-on (three times as many as the problem requires). If that matters, use
//! [`rod_from_three_views`](super::rod_from_three_views) and
//! [`hinge_from_two_views`](super::hinge_from_two_views). NaN means that there is no interpretation, that the
//! plane is parallel to the image, or that two views are equal.

/// Number of problems per block: its columns fit in the cache.
const BLOCK: usize = 64;

/// Depths z1, z2, z3 of rods from (x, y) from pivot to end, view by view; all NaN if there is no rod. All signs
/// may be opposite.
///
/// # Panics
/// If the numbers of depths and problems differ.
pub fn rod_depths(problems: &[[[f64; 2]; 3]], depths: &mut [[f64; 3]]) {
    assert_eq!(problems.len(), depths.len(), "a row of depths for every problem");
    let pairs = |d: &[[f64; 2]; 3]| [d[0], d[1], d[0], d[2]];
    let lift = |[p, q]: [f64; 2], d: &[[f64; 2]; 3]| d.map(|[x, y]| p * x + q * y);
    pulp::Arch::new().dispatch(Blocks { problems, depths, pairs, lift });
}

/// Depths of hinges from (x, y) from the pivot to the first end in both views, then to the second; depths in the
/// same order; all NaN if there is no hinge. All signs may be opposite.
///
/// # Panics
/// If the numbers of depths and problems differ.
pub fn hinge_depths(problems: &[[[f64; 2]; 4]], depths: &mut [[f64; 4]]) {
    assert_eq!(problems.len(), depths.len(), "a row of depths for every problem");
    let pairs = |d: &[[f64; 2]; 4]| *d;
    let lift = |[p, q]: [f64; 2], d: &[[f64; 2]; 4]| d.map(|[x, y]| p * x + q * y);
    pulp::Arch::new().dispatch(Blocks { problems, depths, pairs, lift });
}

/// Processes blocks: problems into columns, slopes of columns, depths back into rows.
struct Blocks<'a, P, Z, Pairs, Lift> {
    problems: &'a [P],
    depths: &'a mut [Z],
    pairs: Pairs,
    lift: Lift,
}

impl<P, Z, Pairs: Fn(&P) -> [[f64; 2]; 4], Lift: Fn([f64; 2], &P) -> Z> pulp::WithSimd
    for Blocks<'_, P, Z, Pairs, Lift>
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let mut columns = [[0.0f64; BLOCK]; 8];
        let mut slopes = [[0.0f64; BLOCK]; 2];
        for (problems, depths) in self.problems.chunks(BLOCK).zip(self.depths.chunks_mut(BLOCK)) {
            for (i, problem) in problems.iter().enumerate() {
                for (k, [x, y]) in (self.pairs)(problem).into_iter().enumerate() {
                    columns[2 * k][i] = x;
                    columns[2 * k + 1][i] = y;
                }
            }
            slopes_of_columns(&columns, &mut slopes);
            for (i, (problem, z)) in problems.iter().zip(depths).enumerate() {
                *z = (self.lift)([slopes[0][i], slopes[1][i]], problem);
            }
        }
    }
}

/// Slopes (p, q) for x and y of a, b and c, d, pairs of the same length in space.
#[inline(always)]
fn slopes_of_columns(columns: &[[f64; BLOCK]; 8], slopes: &mut [[f64; BLOCK]; 2]) {
    let [ax, ay, bx, by, cx, cy, dx, dy] = columns;
    for i in 0..BLOCK {
        let difference = |ax: f64, ay: f64, bx: f64, by: f64| {
            let (mx, my, sx, sy) = (ax - bx, ay - by, ax + bx, ay + by);
            [mx * sx, mx * sy + sx * my, my * sy]
        };
        let [u0, u1, u2] = difference(ax[i], ay[i], bx[i], by[i]);
        let [v0, v1, v2] = difference(cx[i], cy[i], dx[i], dy[i]);
        let (a, b, c) = (u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0);
        // The sign of the form is free.
        let sign = 0.5f64.copysign(a + c);
        let (mean, half, b) = (sign * (a + c), sign * (a - c), 2.0 * sign * b);
        let spread = (half * half + b * b).sqrt();
        let least = mean - spread;
        let along = spread + half.abs();
        let scale = 1.0 / (least * along).sqrt();
        let (large, small) = (along * scale, b * scale);
        slopes[0][i] = if half >= 0.0 { large } else { small };
        slopes[1][i] = if half >= 0.0 { small } else { large };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::{hinge_from_two_views, rod_from_three_views};
    use crate::synth::Random;
    use glam::DVec2;

    fn vectors<const N: usize>(random: &mut Random) -> [[f64; 2]; N] {
        [(); N].map(|()| random.normal_pair().map(f64::from))
    }

    /// Compares depths, divided by the size of the problem, with those of the accurate solution, up to the
    /// mirror.
    fn is_near(z: &[f64], truth: &[f64], tolerance: f64) -> bool {
        let off = |sign: f64| z.iter().zip(truth).map(|(z, t)| (z - sign * t).abs()).fold(0.0, f64::max);
        z.iter().all(|z| z.is_finite()) && off(1.0).min(off(-1.0)) <= tolerance
    }

    #[test]
    fn rods_are_those_of_the_careful_solution() {
        let mut random = Random::new(4);
        let problems: Vec<[[f64; 2]; 3]> = (0..5003).map(|_| vectors(&mut random)).collect();
        let mut depths = vec![[0.0; 3]; problems.len()];
        rod_depths(&problems, &mut depths);
        let (mut same, mut refused) = (0, 0);
        for (problem, z) in problems.iter().zip(&depths) {
            match rod_from_three_views(&problem.map(DVec2::from)) {
                Ok(rod) if rod.condition < 1e4 => {
                    assert!(is_near(z, &rod.depth, 1e-9 * rod.length), "{problem:?} {z:?} {rod:?}");
                    same += 1;
                }
                Ok(_) => {}
                Err(_) => {
                    assert!(z.iter().all(|z| z.is_nan()), "{problem:?} {z:?}");
                    refused += 1;
                }
            }
        }
        assert!(same > 1000 && refused > 2500, "{same} {refused}");
    }

    #[test]
    fn hinges_are_those_of_the_careful_solution() {
        let mut random = Random::new(5);
        let mut problems: Vec<[[f64; 2]; 4]> = (0..5000).map(|_| vectors(&mut random)).collect();
        problems.push([[f64::NAN; 2], [1.0; 2], [2.0; 2], [0.0, 1.0]]);
        problems.push([[0.0; 2]; 4]);
        let mut depths = vec![[0.0; 4]; problems.len()];
        hinge_depths(&problems, &mut depths);
        for (problem, z) in problems.iter().zip(&depths) {
            let [first, second] = [0, 2].map(|k| [problem[k], problem[k + 1]].map(DVec2::from));
            match hinge_from_two_views(&first, &second) {
                Ok(hinge) if hinge.condition < 1e4 => {
                    let [before, after] = hinge.depth;
                    let truth = [before[0], after[0], before[1], after[1]];
                    let length = hinge.lengths[0].max(hinge.lengths[1]);
                    assert!(is_near(z, &truth, 1e-9 * length), "{first:?} {second:?} {z:?} {hinge:?}");
                }
                Ok(_) => {}
                Err(_) => assert!(z.iter().all(|z| z.is_nan()), "{first:?} {second:?} {z:?}"),
            }
        }
    }
}
