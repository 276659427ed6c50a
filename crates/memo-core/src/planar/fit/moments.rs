//! Starting values of the fit: moments for which the cost of a plane takes constant time.

use super::View;
use glam::{DMat3, DVec2, DVec3};

const DIRECTIONS: usize = 12;
const TILTS: usize = 7;

/// Slopes in all directions, up to the mirror, with all tilts.
pub(super) fn grid(slope_limit: f64) -> [[DVec2; TILTS]; DIRECTIONS] {
    let tilts: [f64; TILTS] =
        std::array::from_fn(|tilt| (slope_limit.atan() * (tilt as f64 + 0.7) / TILTS as f64).tan());
    std::array::from_fn(|direction| {
        let along = DVec2::from_angle(std::f64::consts::PI * direction as f64 / DIRECTIONS as f64);
        tilts.map(|tilt| tilt * along)
    })
}

/// Moments of u = (x^2, 2 x y, y^2) about each rod's mean, and second moments of the image vectors.
///
/// With v = (1 + p^2, p q, 1 + q^2): h = u . v, and a plane's cost is about v' S v / v' N v.
pub(super) struct Moments {
    s: DMat3,
    n: DMat3,
}

impl Moments {
    pub(super) fn new<const K: usize>(views: &[View<K>]) -> Self {
        let (mut s, mut n) = (DMat3::ZERO, DMat3::ZERO);
        for k in 0..K {
            let seen = || views.iter().map(|v| v[k]).filter(|d| !d.x.is_nan());
            let powers = |d: DVec2| DVec3::new(d.x * d.x, 2.0 * d.x * d.y, d.y * d.y);
            let (total, number) = seen().fold((DVec3::ZERO, 0.0), |(t, m), d| (t + powers(d), m + 1.0));
            let mean = total / number;
            for d in seen() {
                let u = powers(d) - mean;
                s += DMat3::from_cols(u.x * u, u.y * u, u.z * u);
            }
            // The sum of |M d|^2 as a quadratic form in v.
            let (xx, xy, yy) = (total.x, 0.5 * total.y, total.z);
            n += DMat3::from_cols(
                DVec3::new(xx, xy, 0.0),
                DVec3::new(xy, xx + yy, xy),
                DVec3::new(0.0, xy, yy),
            );
        }
        Self { s, n }
    }

    fn cost(&self, g: DVec2) -> f64 {
        let v = form(g);
        v.dot(self.s * v) / v.dot(self.n * v)
    }

    /// Newton steps on the cost: with A = v' S v and T = A / (v' N v), the gradient of T is that of A - T v' N v,
    /// and near a minimum the same holds for the Hessian.
    fn descend(&self, mut g: DVec2, slope_limit: f64) -> (f64, DVec2) {
        let mut cost = self.cost(g);
        for _ in 0..10 {
            let v = form(g);
            let (v_p, v_q) = (DVec3::new(2.0 * g.x, g.y, 0.0), DVec3::new(0.0, g.x, 2.0 * g.y));
            let d = self.s - self.n * cost;
            let (d_v, d_p, d_q) = (d * v, d * v_p, d * v_q);
            let gradient = DVec2::new(d_v.dot(v_p), d_v.dot(v_q));
            let (pp, pq, qq) = (v_p.dot(d_p) + 2.0 * d_v.x, v_p.dot(d_q) + d_v.y, v_q.dot(d_q) + 2.0 * d_v.z);
            // Made positive definite if it is not.
            let least = 0.5 * (pp + qq) - (0.25 * (pp - qq) * (pp - qq) + pq * pq).sqrt();
            let add = if least > 0.0 { 0.0 } else { -2.0 * least + 1e-3 * (pp.abs() + qq.abs()) };
            let (pp, qq) = (pp + add, qq + add);
            let step = DVec2::new(qq * gradient.x - pq * gradient.y, pp * gradient.y - pq * gradient.x)
                / -(pp * qq - pq * pq);
            if !step.is_finite() {
                break;
            }
            let shrunk = [1.0, 0.3, 0.05].into_iter().map(|size| {
                let next = (g + size * step).clamp_length_max(slope_limit);
                (self.cost(next), next)
            });
            let Some((next_cost, next)) = shrunk.into_iter().find(|(next, _)| *next < cost) else { break };
            let gain = cost - next_cost;
            (cost, g) = (next_cost, next);
            if gain < 1e-3 * cost {
                break;
            }
        }
        (cost, g)
    }

    /// Slopes to refine: the ellipse fit, if it gives a plane within the limit, and the two best minima of a
    /// grid.
    pub(super) fn starts(&self, slope_limit: f64) -> [Option<DVec2>; 2] {
        let grid = grid(slope_limit);
        let costs = grid.map(|row| row.map(|g| self.cost(g)));
        let mut best: [Option<(f64, DVec2)>; 2] = [None; 2];
        for direction in 0..DIRECTIONS {
            for tilt in 0..TILTS {
                let cost = costs[direction][tilt];
                let turned = |by: usize| costs[(direction + by) % DIRECTIONS][tilt];
                let lower_tilt = tilt == 0 || costs[direction][tilt - 1] >= cost;
                let higher_tilt = tilt + 1 == TILTS || costs[direction][tilt + 1] >= cost;
                if turned(1) < cost || turned(DIRECTIONS - 1) < cost || !lower_tilt || !higher_tilt {
                    continue;
                }
                let found = Some((cost, grid[direction][tilt]));
                if best[0].is_none_or(|(least, _)| cost < least) {
                    best = [found, best[0]];
                } else if best[1].is_none_or(|(least, _)| cost < least) {
                    best[1] = found;
                }
            }
        }
        let fallback = DVec2::new(0.5, 0.5).clamp_length_max(0.5 * slope_limit);
        let [first, second] = best.map(|b| b.map(|(_, g)| self.descend(g, slope_limit)));
        let first = first.unwrap_or((self.cost(fallback), fallback));
        // A second minimum may be better with the exact weights, unless it is far worse with these.
        let is_rival = |rival: DVec2, cost: f64| {
            cost < 4.0 * first.0 && (rival - first.1).length().min((rival + first.1).length()) > 0.1
        };
        let second = second.filter(|(cost, g)| is_rival(*g, *cost)).map(|(_, g)| g);
        let ellipse = self.ellipse(form(first.1), slope_limit);
        // The exact ellipse replaces a minimum equal to it; the data may have no noise.
        match ellipse {
            Some(g) if self.cost(g) <= first.0 => [Some(g), second],
            _ => [Some(first.1), second],
        }
    }

    /// The ellipse with the smallest v' S v / v' N v, by inverse iteration; `None` if it is not that of a rod.
    fn ellipse(&self, start: DVec3, slope_limit: f64) -> Option<DVec2> {
        let trace = self.s.x_axis.x + self.s.y_axis.y + self.s.z_axis.z;
        let norm = self.n.x_axis.x + self.n.y_axis.y + self.n.z_axis.z;
        let inverse = (self.s + self.n * (1e-14 * trace / norm)).inverse();
        let mut v = start;
        for _ in 0..4 {
            v = (inverse * (self.n * v)).try_normalize()?;
        }
        slope_from_form(v, v.x * v.z - v.y * v.y).filter(|g| g.length() <= slope_limit)
    }
}

/// (1 + p^2, p q, 1 + q^2), the entries of M.
pub(in crate::planar) fn form(g: DVec2) -> DVec3 {
    DVec3::new(1.0 + g.x * g.x, g.x * g.y, 1.0 + g.y * g.y)
}

/// Slope of a quadratic form (A, B, C) proportional to that of a plane; p >= 0. `None` if the form is indefinite.
///
/// The determinant A C - B^2 is an argument, because its differences may cancel.
pub(in crate::planar) fn slope_from_form(v: DVec3, determinant: f64) -> Option<DVec2> {
    let half_difference = 0.5 * (v.x - v.z);
    let spread = half_difference.hypot(v.y);
    let mean = 0.5 * (v.x + v.z);
    // The sign of the form is arbitrary; the smaller eigenvalue belongs to the full length of the rod.
    let (mean, half_difference, b) =
        if mean < 0.0 { (-mean, -half_difference, -v.y) } else { (mean, half_difference, v.y) };
    let least = determinant / (mean + spread);
    if least <= 0.0 || least.is_nan() {
        return None;
    }
    // |g|^2 = largest/least - 1; 2 angle of g = angle of (A - C, 2 B).
    let size = (2.0 * spread / least).sqrt();
    if spread == 0.0 {
        return Some(DVec2::ZERO);
    }
    let cos_sq = 0.5 * (1.0 + half_difference / spread);
    let (cosine, sine) = if half_difference >= 0.0 {
        let cosine = cos_sq.sqrt();
        (cosine, 0.5 * b / (spread * cosine))
    } else {
        let sine = (0.5 * (1.0 - half_difference / spread)).sqrt();
        let signed = 0.5 * b / (spread * sine);
        if signed >= 0.0 { (signed, sine) } else { (-signed, -sine) }
    };
    Some(size * DVec2::new(cosine, sine))
}
