//! Checks a posture against the [joint limits](crate::model::limits) (Lee and Chen 1985, section 3.2 A and B),
//! with the noise of its limbs.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec3};

use super::constraint::{Constraint, Unit, Violation};
use super::placed::{Placed, PlacedFigure, Trunk};
use crate::model::angles::{PartAngles, abduction_rad, elbow_rad, knee_rad};
use crate::model::limits::{AngleRange, AngleReading, Limits};
use crate::model::skeleton::{RigidDistance, SegmentLengths, Side};

impl Limits {
    /// Checks one constraint of angle or distance; `None` if it holds or is of another kind.
    pub(crate) fn check(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        trunk: &Trunk,
        lengths: &SegmentLengths,
        head: Option<&DMat3>,
    ) -> Option<Violation> {
        use Constraint as C;
        match constraint {
            C::Rigid(distance) => self.check_distance(distance, figure, lengths),
            C::NeckFlexion | C::NeckExtension | C::NeckRotation | C::NeckBending => {
                self.check_neck(constraint, trunk, head?)
            }
            C::PelvisFlexion | C::PelvisExtension | C::PelvisRotation | C::PelvisBending => {
                self.check_pelvis(constraint, figure, trunk)
            }
            C::ShoulderFlexion(s) | C::ShoulderExtension(s) => {
                self.check_swing(constraint, self.shoulder_swing, figure[s.elbow()], trunk)
            }
            C::HipFlexion(s) | C::HipExtension(s) => {
                self.check_swing(constraint, self.hip_swing, figure[s.knee()], trunk)
            }
            C::HipFlexionStraight(s) => self.check_straight_leg(constraint, s, figure, trunk),
            C::ShoulderAbduction(s) | C::ShoulderAdduction(s) => {
                self.check_abduction(constraint, self.shoulder_abduction, figure[s.elbow()], trunk, s)
            }
            C::HipAbduction(s) | C::HipAdduction(s) => {
                self.check_abduction(constraint, self.hip_abduction, figure[s.knee()], trunk, s)
            }
            C::ElbowFlexion(s) | C::ElbowExtension(s) => {
                let [u, v] = [s.elbow(), s.wrist()].map(|joint| figure[joint]);
                self.check_hinge(constraint, self.elbow, u, v, trunk, 1.0)
            }
            C::KneeFlexion(s) | C::KneeExtension(s) => {
                let [u, v] = [s.knee(), s.ankle()].map(|joint| figure[joint]);
                self.check_hinge(constraint, self.knee, u, v, trunk, -1.0)
            }
            _ => None,
        }
    }

    /// The violation of a bound from within; bound and excess are angles, the margin is in standard deviations.
    fn beyond(&self, constraint: Constraint, bound: f64, excess: f64, sd: f64) -> Option<Violation> {
        let margin = if self.noise_factor == 0.0 { 0.0 } else { self.noise_factor * sd };
        Violation::over(constraint, bound + excess, bound + margin, Unit::Radians)
    }

    /// The tolerance is increased by the noise along the distance, and by the lengthening due to noise across it.
    fn check_distance(
        &self,
        distance: RigidDistance,
        figure: &PlacedFigure,
        lengths: &SegmentLengths,
    ) -> Option<Violation> {
        let [a, b] = distance.joints().map(|joint| figure[joint]);
        let between = b.point - a.point;
        let length = between.length();
        let deviation = (length - lengths.rigid[distance as usize]).abs();
        let mut tolerance = match distance {
            RigidDistance::Shoulders | RigidDistance::Hips => self.distance_m,
            RigidDistance::RightShoulderPelvis | RigidDistance::LeftShoulderPelvis => self.shoulder_pelvis_m,
        };
        if deviation <= tolerance {
            return None;
        }
        if self.noise_factor > 0.0 {
            let unit = between / length.max(1e-9);
            let along = a.along(unit).hypot(b.along(unit));
            let depth_sq = a.sd_m * a.sd_m + b.sd_m * b.sd_m;
            let across_sq = depth_sq * (1.0 - a.ray.dot(unit).powi(2)).max(0.0);
            let k = self.noise_factor;
            tolerance += k * along + 0.5 * k * k * across_sq / lengths.rigid[distance as usize];
        }
        Violation::over(Constraint::Rigid(distance), deviation, tolerance, Unit::Metres)
    }

    fn check_swing(
        &self,
        constraint: Constraint,
        range: AngleRange,
        limb: &Placed,
        trunk: &Trunk,
    ) -> Option<Violation> {
        let axes = &trunk.torso;
        let excess = range.excess(trunk.swing_rad(limb));
        let flexion = matches!(constraint, Constraint::ShoulderFlexion(_) | Constraint::HipFlexion(_));
        if excess == 0.0 || flexion != (excess > 0.0) {
            return None;
        }
        let bound = if flexion { range.max_rad } else { -range.min_rad };
        let excess = self.turn(excess.abs(), axes.z_axis.dot(limb.unit));
        let towards = axes.z_axis.cross(limb.unit).normalize_or_zero();
        self.beyond(constraint, bound, excess, limb.direction_sd(towards).hypot(trunk.torso_sd.z))
    }

    /// The excess of a projected angle as a rotation of the limb, whose component along the axis of projection is
    /// given.
    fn turn(&self, excess: f64, along_axis: f64) -> f64 {
        if self.reading == AngleReading::Literal {
            return excess;
        }
        let projected = (1.0 - along_axis * along_axis).max(0.0).sqrt();
        if excess < FRAC_PI_2 { (projected * excess.sin()).asin() } else { projected.min(1.0).asin() }
    }

    fn check_abduction(
        &self,
        constraint: Constraint,
        range: AngleRange,
        limb: &Placed,
        trunk: &Trunk,
        side: Side,
    ) -> Option<Violation> {
        let axes = &trunk.torso;
        let outward = if side == Side::Left { axes.z_axis } else { -axes.z_axis };
        let angle = match self.reading {
            AngleReading::Literal => abduction_rad(axes, limb.unit, side),
            AngleReading::Turn => outward.dot(limb.unit).clamp(-1.0, 1.0).asin(),
        };
        let excess = range.excess(angle);
        let abduction = matches!(constraint, Constraint::ShoulderAbduction(_) | Constraint::HipAbduction(_));
        if excess == 0.0 || abduction != (excess > 0.0) {
            return None;
        }
        let bound = if abduction { range.max_rad } else { -range.min_rad };
        let sd = limb.direction_sd(axes.z_axis).hypot(trunk.torso_sd.x);
        self.beyond(constraint, bound, excess.abs(), sd)
    }

    /// `sense` is 1 if flexion has w_z >= 0 (elbow), -1 if it has w_z <= 0 (knee).
    fn check_hinge(
        &self,
        constraint: Constraint,
        range: AngleRange,
        u: &Placed,
        v: &Placed,
        trunk: &Trunk,
        sense: f64,
    ) -> Option<Violation> {
        let axes = &trunk.torso;
        let flexion = matches!(constraint, Constraint::ElbowFlexion(_) | Constraint::KneeFlexion(_));
        if flexion {
            if u.unit.dot(v.unit) > range.max_rad.cos() {
                return None;
            }
            let angle = u.unit.cross(v.unit).length().atan2(u.unit.dot(v.unit));
            let literal = if sense > 0.0 { elbow_rad } else { knee_rad }(axes, u.unit, v.unit);
            let counts = self.reading == AngleReading::Turn || literal > 0.0;
            let sd = u.worst_direction_sd().hypot(v.worst_direction_sd());
            return counts
                .then(|| self.beyond(constraint, range.max_rad, angle - range.max_rad, sd))
                .flatten();
        }
        let hinge = u.unit.cross(axes.z_axis);
        let w_z = v.unit.dot(hinge);
        if sense * w_z >= 0.0 {
            return None;
        }
        let angle = match self.reading {
            AngleReading::Literal => u.unit.angle_between(v.unit),
            AngleReading::Turn => w_z.abs().min(1.0).asin(),
        };
        if angle <= -range.min_rad {
            return None;
        }
        let sd = v.along(hinge) / v.length_m;
        let sd = sd.hypot(u.along(axes.z_axis.cross(v.unit)) / u.length_m);
        self.beyond(constraint, -range.min_rad, angle + range.min_rad, sd)
    }

    fn check_straight_leg(
        &self,
        constraint: Constraint,
        side: Side,
        figure: &PlacedFigure,
        trunk: &Trunk,
    ) -> Option<Violation> {
        let [thigh, shank] = [figure[side.knee()], figure[side.ankle()]];
        let swing = trunk.swing_rad(thigh);
        let excess = swing - self.hip_flexion_straight_rad;
        if excess <= 0.0 {
            return None;
        }
        let hinge_sd = thigh.worst_direction_sd().hypot(shank.worst_direction_sd());
        let slack = if self.noise_factor > 0.0 { self.noise_factor * hinge_sd } else { 0.0 };
        if trunk.knee_rad(thigh, shank) + slack > self.straight_knee_rad {
            return None;
        }
        let excess = self.turn(excess, trunk.torso.z_axis.dot(thigh.unit));
        let sd = thigh.worst_direction_sd().hypot(trunk.torso_sd.z);
        self.beyond(constraint, self.hip_flexion_straight_rad, excess, sd)
    }

    fn check_pelvis(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        trunk: &Trunk,
    ) -> Option<Violation> {
        let sd = || {
            let [torso, hips] = [trunk.torso_sd, trunk.hips_sd(figure)];
            DVec3::new(torso.x.hypot(hips.x), torso.y.hypot(hips.y), torso.z.hypot(hips.z))
        };
        self.check_part(
            constraint,
            &trunk.hip_angles,
            self.pelvis_flexion,
            [self.pelvis_rotation_rad, self.pelvis_bending_rad],
            sd,
        )
    }

    fn check_neck(&self, constraint: Constraint, trunk: &Trunk, head: &DMat3) -> Option<Violation> {
        let angles = PartAngles::of_head(&trunk.torso, head);
        self.check_part(
            constraint,
            &angles,
            self.neck_flexion,
            [self.neck_rotation_rad, self.neck_bending_rad],
            || trunk.torso_sd,
        )
    }

    fn check_part(
        &self,
        constraint: Constraint,
        angles: &PartAngles,
        flexion: AngleRange,
        [rotation_rad, bending_rad]: [f64; 2],
        sd: impl Fn() -> DVec3,
    ) -> Option<Violation> {
        use Constraint as C;
        let excess = flexion.excess(angles.flexion_rad);
        let rotation_excess = angles.rotation_rad.abs() - rotation_rad;
        let bending_excess = angles.bending_rad.abs() - bending_rad;
        match constraint {
            C::PelvisFlexion | C::NeckFlexion if excess > 0.0 => {
                self.beyond(constraint, flexion.max_rad, excess, sd().z)
            }
            C::PelvisExtension | C::NeckExtension if excess < 0.0 => {
                self.beyond(constraint, -flexion.min_rad, -excess, sd().z)
            }
            C::PelvisRotation | C::NeckRotation if rotation_excess > 0.0 => {
                self.beyond(constraint, rotation_rad, rotation_excess, sd().y)
            }
            C::PelvisBending | C::NeckBending if bending_excess > 0.0 => {
                self.beyond(constraint, bending_rad, bending_excess, sd().x)
            }
            _ => None,
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::measured()
    }
}

#[cfg(test)]
mod tests;
