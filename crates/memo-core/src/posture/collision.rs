//! Collisions: two body parts cannot be in one place (Lee and Chen 1985, section 3.2 C: arms and torso, arms and
//! legs; here also leg and leg).
//!
//! Limbs are capsules about their segments. The torso is the quadrilateral of shoulders and hips, two triangles.
//! A clearance is the distance of the two axes. If a limb passes through the torso, the clearance is minus the
//! shortest way out, over the border or by an end.
//!
//! The paper gives no radii. The default radii are half of 3 cm: at 3 cm no true arm and leg of four walks, a
//! jump and a bout of punching collide (the smallest true distance of arm and leg in walking is 10 cm). Without
//! noise, no true forearm in these data passes through the quadrilateral. Radii of flesh were not tested.

use glam::DVec3;

use super::constraint::{Constraint, Violation};
use super::placed::{Placed, PlacedFigure};
use crate::model::skeleton::{Joint, PerJoint, Side};

/// Radii of body parts and tolerances of collisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collisions {
    /// Radius of upper arm and forearm, metres.
    pub arm_m: f64,
    /// Radius of thigh and shank, metres.
    pub leg_m: f64,
    /// Minimum clearance of arm and torso quadrilateral, metres; 0: the forearm must not pass through it.
    pub torso_m: f64,
    /// Share of the upper arm next to the shoulder that is ignored, because the shoulder is a corner of the
    /// torso.
    pub shoulder_part: f64,
    /// Every clearance may be too small by this many standard deviations of the propagated noise.
    pub noise_factor: f64,
}

impl Collisions {
    /// Stick figures without noise: the forearm must not pass through the torso, and arms and legs are at least 3
    /// cm apart.
    pub fn paper() -> Self {
        Self { noise_factor: 0.0, ..Self::measured() }
    }

    /// The same with a margin for noise.
    pub fn measured() -> Self {
        Self { arm_m: 0.015, leg_m: 0.015, torso_m: 0.0, shoulder_part: 1.0 / 3.0, noise_factor: 1.5 }
    }

    /// Checks one constraint; `None` if it holds or is not a collision.
    pub(crate) fn check(&self, constraint: Constraint, figure: &PlacedFigure) -> Option<Violation> {
        use Constraint as C;
        match constraint {
            C::UpperArmTorso(s) => {
                let elbow = figure[s.elbow()];
                let shoulder = figure[s.shoulder()].point;
                let start = shoulder.lerp(elbow.point, self.shoulder_part);
                self.check_torso(constraint, figure, start, elbow.point, elbow, None)
            }
            C::ForearmTorso(s) => {
                let [elbow, wrist] = [figure[s.elbow()], figure[s.wrist()]];
                self.check_torso(constraint, figure, elbow.point, wrist.point, elbow, Some(wrist))
            }
            _ => self.check_limbs(constraint, figure, self.limbs(constraint)?),
        }
    }

    /// The segments that must not collide, by the joints they end at: one or two of a limb and one of another;
    /// and the sum of their radii.
    fn limbs(&self, constraint: Constraint) -> Option<([Option<Joint>; 2], Joint, f64)> {
        use Constraint as C;
        let arm = |side: Side| [Some(side.elbow()), Some(side.wrist())];
        let of_legs = 2.0 * self.leg_m;
        let of_both = self.arm_m + self.leg_m;
        Some(match constraint {
            C::ThighThigh => ([Some(Side::Right.knee()), None], Side::Left.knee(), of_legs),
            C::ShankThigh(s) => ([Some(s.ankle()), None], s.other().knee(), of_legs),
            C::ShankShank => ([Some(Side::Right.ankle()), None], Side::Left.ankle(), of_legs),
            C::ArmThigh { arm: a, leg } => (arm(a), leg.knee(), of_both),
            C::ArmShank { arm: a, leg } => (arm(a), leg.ankle(), of_both),
            _ => return None,
        })
    }

    /// True if the rays of a view keep two body parts so far apart that no choice of roots can break the
    /// constraint.
    pub(crate) fn is_out_of_reach(&self, constraint: Constraint, spans: &PerJoint<Span>) -> bool {
        use Joint::{LeftHip, LeftShoulder, RightHip, RightShoulder};
        let segment = |end: Joint| [end.start().unwrap_or(end), end].map(|joint| spans[joint]);
        let torso = [RightShoulder, LeftShoulder, LeftHip, RightHip].map(|joint| spans[joint]);
        match constraint {
            Constraint::UpperArmTorso(s) => {
                apart(&segment(s.elbow()), self.shoulder_part, &torso, self.torso_m)
            }
            Constraint::ForearmTorso(s) => apart(&segment(s.wrist()), 0.0, &torso, self.torso_m),
            _ => self.limbs(constraint).is_some_and(|(ends, other, radii_m)| {
                let other = segment(other);
                ends.into_iter().flatten().all(|end| apart(&segment(end), 0.0, &other, radii_m))
            }),
        }
    }

    /// Standard deviation of a limb's position relative to the body's, metres: that of its outer end.
    fn spread(&self, upper: &Placed, lower: Option<&Placed>) -> f64 {
        let lower = lower.map_or(0.0, |placed| placed.sd_m);
        self.noise_factor * upper.sd_m.hypot(lower).hypot(upper.lateral_m)
    }

    fn check_torso(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        start: DVec3,
        end: DVec3,
        upper: &Placed,
        lower: Option<&Placed>,
    ) -> Option<Violation> {
        use Joint::{LeftHip, LeftShoulder, RightHip, RightShoulder};
        let corners = [RightShoulder, LeftShoulder, LeftHip, RightHip].map(|joint| figure[joint].point);
        if self.torso_m <= 0.0 && passes_beside(&corners, start, end) {
            return None;
        }
        let crosses = |triangle| crossing(triangle, start, end).is_some();
        if self.torso_m <= 0.0 && !triangles(&corners).iter().any(crosses) {
            return None;
        }
        let clearance = quadrilateral_clearance(&corners, start, end);
        if clearance >= self.torso_m {
            return None;
        }
        let slack = if self.noise_factor > 0.0 { self.spread(upper, lower) } else { 0.0 };
        Violation::under(constraint, clearance, self.torso_m - slack)
    }

    fn check_limbs(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        (ends_of_one, b, radii_m): ([Option<Joint>; 2], Joint, f64),
    ) -> Option<Violation> {
        let violation = |a: Joint| {
            let [[a0, a1], [b0, b1]] = [a, b].map(|end| ends(figure, end));
            // Bounding spheres of the segments first: most pairs are far apart.
            let apart_sq = 0.25 * (a0 + a1 - b0 - b1).length_squared();
            let reach = radii_m + 0.5 * (figure[a].length_m + figure[b].length_m);
            if apart_sq > reach * reach {
                return None;
            }
            let distance = segment_distance(a0, a1, b0, b1);
            if distance >= radii_m {
                return None;
            }
            let slack = if self.noise_factor > 0.0 {
                self.limb_spread(figure, a).hypot(self.limb_spread(figure, b))
            } else {
                0.0
            };
            Violation::under(constraint, distance, radii_m - slack)
        };
        ends_of_one.into_iter().flatten().filter_map(violation).max_by(|a, b| a.excess.total_cmp(&b.excess))
    }

    /// Spread of the segment that ends at a joint.
    fn limb_spread(&self, figure: &PlacedFigure, end: Joint) -> f64 {
        match end {
            Joint::RightElbow | Joint::LeftElbow | Joint::RightKnee | Joint::LeftKnee => {
                self.spread(figure[end], None)
            }
            _ => self.spread(figure[end.start().unwrap_or(end)], Some(figure[end])),
        }
    }
}

/// The range of distances along its ray in which a joint can be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub ray: DVec3,
    pub near_m: f64,
    pub far_m: f64,
}

impl Span {
    /// Smallest and largest component along a vector.
    fn along(&self, direction: DVec3) -> [f64; 2] {
        let [a, b] = [self.near_m, self.far_m].map(|k| k * self.ray.dot(direction));
        [a.min(b), a.max(b)]
    }
}

/// True if a segment without its first part is farther than `least_m` from a polygon or another segment, for all
/// positions of the corners on their rays: if they are apart along the normal of a plane through the camera and
/// two corners.
fn apart([start, end]: &[Span; 2], part: f64, other: &[Span], least_m: f64) -> bool {
    let edges = (0..other.len()).map(|i| [&other[i], &other[(i + 1) % other.len()]]);
    std::iter::once([start, end]).chain(edges).any(|[a, b]| {
        let normal = a.ray.cross(b.ray).normalize_or_zero();
        let [[start_low, start_high], [low, high]] = [start, end].map(|span| span.along(normal));
        let others = || other.iter().map(|span| span.along(normal));
        let other_low = others().fold(f64::INFINITY, |least, [low, _]| least.min(low));
        let other_high = others().fold(f64::NEG_INFINITY, |most, [_, high]| most.max(high));
        let from = |start: f64, end: f64| start + part * (end - start);
        let above = low.min(from(start_low, low)) - other_high;
        let below = other_low - high.max(from(start_high, high));
        above.max(below) > least_m + ROUNDING_M
    })
}

/// More than the effect of rounding on a distance.
const ROUNDING_M: f64 = 1e-9;

/// The two ends of the segment that ends at a joint.
fn ends(figure: &PlacedFigure, end: Joint) -> [DVec3; 2] {
    [figure[end.start().unwrap_or(end)].point, figure[end].point]
}

impl Default for Collisions {
    fn default() -> Self {
        Self::measured()
    }
}

/// Distance of two segments in space, metres (Ericson 2005, Real-Time Collision Detection, 5.1.9). Either may be
/// a point.
pub fn segment_distance(a0: DVec3, a1: DVec3, b0: DVec3, b1: DVec3) -> f64 {
    let (u, v, r) = (a1 - a0, b1 - b0, a0 - b0);
    let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
    let (ur, vr) = (u.dot(r), v.dot(r));
    let fraction = |top: f64, bottom: f64| if bottom > 0.0 { (top / bottom).clamp(0.0, 1.0) } else { 0.0 };
    let mut s = fraction(uv * vr - ur * vv, uu * vv - uv * uv);
    let mut t = if vv > 0.0 { (uv * s + vr) / vv } else { 0.0 };
    if !(0.0..=1.0).contains(&t) || vv == 0.0 {
        t = t.clamp(0.0, 1.0);
        s = fraction(uv * t - ur, uu);
    }
    (r + s * u - t * v).length()
}

/// True if a segment is on one side of the planes of both triangles, so that it crosses neither.
fn passes_beside(corners: &[DVec3; 4], start: DVec3, end: DVec3) -> bool {
    triangles(corners).iter().all(|[a, b, c]| {
        let normal = (b - a).cross(c - a);
        normal.dot(start - a) * normal.dot(end - a) > 0.0
    })
}

fn triangles(corners: &[DVec3; 4]) -> [[DVec3; 3]; 2] {
    [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
}

/// Clearance of a segment and a quadrilateral in space, metres: their distance, or minus the shortest way out if
/// the segment passes through it.
///
/// The quadrilateral consists of two triangles that share the diagonal from its first to its third corner.
pub fn quadrilateral_clearance(corners: &[DVec3; 4], start: DVec3, end: DVec3) -> f64 {
    let border = |p: DVec3| {
        (0..4).map(|i| segment_distance(p, p, corners[i], corners[(i + 1) % 4])).fold(f64::MAX, f64::min)
    };
    let mut clearance = f64::MAX;
    for triangle in triangles(corners) {
        match crossing(&triangle, start, end) {
            Some((point, to_ends)) => clearance = clearance.min(-to_ends.min(border(point))),
            None => clearance = clearance.min(triangle_distance(&triangle, start, end)),
        }
    }
    clearance
}

/// The point at which a segment crosses a triangle, and the smaller distance of its ends from the triangle's
/// plane.
fn crossing([a, b, c]: &[DVec3; 3], start: DVec3, end: DVec3) -> Option<(DVec3, f64)> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    let [from, to] = [start, end].map(|p| normal.dot(p - a));
    if from * to >= 0.0 {
        return None;
    }
    let point = start.lerp(end, from / (from - to));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(point - *p).dot(normal) >= 0.0);
    inside.then_some((point, from.abs().min(to.abs())))
}

/// Distance of a segment and a triangle that it does not cross.
fn triangle_distance([a, b, c]: &[DVec3; 3], start: DVec3, end: DVec3) -> f64 {
    let edges = [(a, b), (b, c), (c, a)];
    let beside = edges.iter().map(|(p, q)| segment_distance(start, end, **p, **q)).fold(f64::MAX, f64::min);
    let Some(normal) = (b - a).cross(c - a).try_normalize() else { return beside };
    let above = |p: DVec3| {
        let over = edges.iter().all(|(e, f)| (**f - **e).cross(p - **e).dot(normal) >= 0.0);
        if over { normal.dot(p - *a).abs() } else { f64::MAX }
    };
    beside.min(above(start)).min(above(end))
}

#[cfg(test)]
mod tests;
