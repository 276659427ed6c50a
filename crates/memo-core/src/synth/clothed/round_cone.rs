//! Round cones: the convex hull of two spheres, and its intersection with a ray.
//!
//! In the half plane through the axis, with x along the axis from the centre of sphere a and r the distance
//! from the axis, the hull is bounded by both circles and their common tangent. With sin alpha = (r_a - r_b)
//! / L the tangent has the outward normal (sin alpha, cos alpha), so it is the set x sin alpha + r cos alpha
//! = r_a. It touches the circles where s = x cos alpha - r sin alpha is 0 and L cos alpha.

use glam::DVec3;

/// The convex hull of two spheres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RoundCone {
    /// Centres of the spheres, metres.
    pub(super) ends: [DVec3; 2],
    /// Their radii, metres.
    pub(super) radii: [f64; 2],
}

/// The intersection of a ray with a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    /// Position on the ray, in multiples of its direction.
    pub(super) t: f64,
    /// Outward unit normal.
    pub(super) normal: DVec3,
    /// Fraction of the distance from the first end to the second, 0 to 1.
    pub(super) along: f64,
}

impl RoundCone {
    pub(super) fn new(start: DVec3, end: DVec3, start_radius: f64, end_radius: f64) -> Self {
        Self { ends: [start, end], radii: [start_radius, end_radius] }
    }

    /// A sphere.
    pub(super) fn ball(centre: DVec3, radius: f64) -> Self {
        Self::new(centre, centre, radius, radius)
    }

    /// The first point of the hull on the ray from `origin` in `direction` (of any length), in front of the
    /// origin.
    pub(super) fn hit(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let mut first: Option<Hit> = None;
        let mut offer = |hit: Option<Hit>| {
            if let Some(hit) = hit
                && first.is_none_or(|first| hit.t < first.t)
            {
                first = Some(hit);
            }
        };
        offer(self.sphere_hit(0, origin, direction));
        offer(self.sphere_hit(1, origin, direction));
        offer(self.side_hit(origin, direction));
        first
    }

    fn sphere_hit(&self, end: usize, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let (m, radius) = (origin - self.ends[end], self.radii[end]);
        let t =
            first_root(direction.length_squared(), m.dot(direction), m.length_squared() - radius * radius)?;
        let normal = (m + t * direction) / radius;
        Some(Hit { t, normal, along: end as f64 })
    }

    /// The first of the two roots of (x sin alpha - r_a)² = r² cos² alpha that lies between the circles.
    fn side_hit(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let axis = self.ends[1] - self.ends[0];
        let length = axis.length();
        let sine = (self.radii[0] - self.radii[1]) / length;
        // One sphere contains the other, or both are equal.
        if length == 0.0 || sine.abs() >= 1.0 {
            return None;
        }
        let (unit, cosine_sq) = (axis / length, 1.0 - sine * sine);
        let cosine = cosine_sq.sqrt();
        let m = origin - self.ends[0];
        let (mu, du) = (m.dot(unit), direction.dot(unit));
        // r² = |p|² - x²; both sides are quadratic in t.
        let slack = mu * sine - self.radii[0];
        let a = cosine_sq * (direction.length_squared() - du * du) - sine * sine * du * du;
        let b = cosine_sq * (m.dot(direction) - mu * du) - slack * sine * du;
        let c = cosine_sq * (m.length_squared() - mu * mu) - slack * slack;
        roots(a, b, c).into_iter().flatten().find_map(|t| {
            let x = mu + t * du;
            let radial = m + t * direction - x * unit;
            let r = radial.length();
            let s = x * cosine - r * sine;
            let is_outside = self.radii[0] - x * sine >= 0.0;
            (t > 0.0 && is_outside && (0.0..=length * cosine).contains(&s)).then(|| Hit {
                t,
                normal: cosine * radial / r + sine * unit,
                along: s / (length * cosine),
            })
        })
    }
}

/// The smallest positive root of a t² + 2 b t + c for a > 0; `None` if the origin is inside.
fn first_root(a: f64, b: f64, c: f64) -> Option<f64> {
    let discriminant = b * b - a * c;
    let t = (-b - discriminant.max(0.0).sqrt()) / a;
    (discriminant >= 0.0 && t > 0.0).then_some(t)
}

/// Both real roots of a t² + 2 b t + c in ascending order.
fn roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - a * c;
    if discriminant < 0.0 || a == 0.0 {
        return [None, None];
    }
    let root = discriminant.sqrt();
    let (low, high) = ((-b - root) / a, (-b + root) / a);
    [Some(low.min(high)), Some(low.max(high))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    /// Distance from the surface of the hull, by searching for the nearest sphere of the sweep: an
    /// independent method that does not use tangents.
    fn distance(cone: &RoundCone, point: DVec3) -> f64 {
        let at = |s: f64| {
            let centre = cone.ends[0].lerp(cone.ends[1], s);
            point.distance(centre) - (cone.radii[0] + s * (cone.radii[1] - cone.radii[0]))
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..100 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if at(a) < at(b) { high = b } else { low = a }
        }
        at(0.5 * (low + high)).min(at(0.0)).min(at(1.0))
    }

    fn point(random: &mut Random, size: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| random.uniform(-size, size)))
    }

    #[test]
    fn rays_meet_the_sweep_of_spheres_where_marching_along_them_does() {
        let mut random = Random::new(1);
        let mut met = 0;
        for _ in 0..4000 {
            let cone = RoundCone::new(
                point(&mut random, 1.0),
                point(&mut random, 1.0),
                random.uniform(0.02, 0.8),
                random.uniform(0.02, 0.8),
            );
            let origin = 4.0 * point(&mut random, 1.0).normalize();
            let direction = point(&mut random, 1.5) - origin;
            // Sphere tracing with the distance above.
            let mut t = 0.0;
            let marched = loop {
                let away = distance(&cone, origin + t * direction);
                if away < 1e-9 {
                    break Some(t);
                }
                t += away / direction.length();
                if t > 3.0 {
                    break None;
                }
            };
            match (cone.hit(origin, direction), marched) {
                (Some(hit), Some(t)) => {
                    met += 1;
                    // At a grazing ray, sphere tracing stops within its tolerance of the surface.
                    assert!((hit.t - t).abs() < 1e-4, "{hit:?} against {t} for {cone:?}");
                    let surface = origin + hit.t * direction;
                    let step = |by: f64| distance(&cone, surface + by * hit.normal);
                    assert!((step(1e-3) - 1e-3).abs() < 1e-8 && hit.normal.dot(direction) <= 1e-9);
                }
                (hit, None) => assert!(hit.is_none(), "{hit:?} for {cone:?}"),
                (None, Some(t)) => {
                    let near = distance(&cone, origin + (t + 1e-4) * direction);
                    assert!(near > 0.0, "missed {cone:?} at {t}");
                }
            }
        }
        assert!(met > 500, "{met}");
    }

    #[test]
    fn a_ball_is_a_sphere_and_nothing_behind_the_origin_is_met() {
        let ball = RoundCone::ball(DVec3::new(0.0, 3.0, 0.0), 0.5);
        let hit = ball.hit(DVec3::ZERO, 2.0 * DVec3::Y).unwrap();
        assert!((hit.t - 1.25).abs() < 1e-12 && (hit.normal + DVec3::Y).length() < 1e-12);
        assert!(ball.hit(DVec3::ZERO, -DVec3::Y).is_none());
    }
}
