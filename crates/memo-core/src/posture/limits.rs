//! What a body can do: angles at the joints (Lee and Chen 1985, Table 1) and distances within its rigid parts
//! (section 3.2 A and B).
//!
//! Two readings of an angle. [`AngleReading::Literal`] is the paper's: the angle of the limb's projection, the
//! sign of w_z at elbow and knee. It says nothing where a projection vanishes: the flexion of an arm held out
//! sideways, the abduction of one held forward, the sense of an elbow whose upper arm lies along z.
//! [`AngleReading::Turn`] asks by how much a segment would have to turn to come into the range, which is the
//! same for limbs that swing forward and back and goes to zero where the paper's angle loses its meaning:
//!
//! ```text
//! flexion, extension    asin(ρ sin ε), ε the excess of θ, ρ the length of the projection of u on xy (ε < 90°)
//! abduction             asin(u·outward), the angle out of the sagittal plane, instead of φ
//! elbow, knee           asin(∓w_z), the angle by which v leaves the half-space bounded by u and z
//! ```
//!
//! Limits of the measured strength grow with the noise propagated from the image and from the lengths, by
//! `noise_factor` standard deviations. Ranges are circular: of the two bounds that an angle passes, the nearer
//! one counts.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat3, DVec3};

use super::angles::{PartAngles, abduction_rad, elbow_rad, knee_rad};
use super::constraint::{Constraint, Unit, Violation};
use super::placed::{Placed, PlacedFigure, Trunk};
use super::skeleton::{RigidDistance, SegmentLengths, Side};

/// A range of a signed angle: flexion and abduction positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleRange {
    /// Least angle, radians: minus the extension or adduction allowed.
    pub min_rad: f64,
    /// Largest angle, radians.
    pub max_rad: f64,
}

impl AngleRange {
    /// A range in degrees.
    pub fn from_deg(min_deg: f64, max_deg: f64) -> Self {
        Self { min_rad: min_deg.to_radians(), max_rad: max_deg.to_radians() }
    }

    fn widened(self, by_rad: f64) -> Self {
        Self { min_rad: self.min_rad - by_rad, max_rad: self.max_rad + by_rad }
    }

    /// By how much an angle is above the range; negative: below it; 0 within. The nearer bound counts.
    pub fn excess(&self, angle: f64) -> f64 {
        let width = self.max_rad - self.min_rad;
        let offset = (angle - self.min_rad).rem_euclid(TAU);
        if offset <= width {
            return 0.0;
        }
        let [above, below] = [offset - width, TAU - offset];
        if above <= below { above } else { -below }
    }
}

/// How an angle is measured against its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AngleReading {
    /// As the paper writes it.
    Literal,
    /// By how much the segment would have to turn to come into the range.
    Turn,
}

/// Limits of the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// How angles are measured.
    pub reading: AngleReading,
    /// Flexion and extension of the upper arm.
    pub shoulder_swing: AngleRange,
    /// Abduction and adduction of the upper arm.
    pub shoulder_abduction: AngleRange,
    /// Flexion and extension of the thigh, the knee being bent.
    pub hip_swing: AngleRange,
    /// Flexion of the thigh with a straight knee, radians.
    pub hip_flexion_straight_rad: f64,
    /// A knee flexed by less is straight, radians.
    pub straight_knee_rad: f64,
    /// Abduction and adduction of the thigh.
    pub hip_abduction: AngleRange,
    /// Flexion and extension of the elbow.
    pub elbow: AngleRange,
    /// Flexion and extension of the knee.
    pub knee: AngleRange,
    /// Flexion and extension of the torso over the hips.
    pub pelvis_flexion: AngleRange,
    /// Rotation of the hips against the torso to either side, radians.
    pub pelvis_rotation_rad: f64,
    /// Bending of the hips against the torso to either side, radians.
    pub pelvis_bending_rad: f64,
    /// Flexion and extension of the head.
    pub neck_flexion: AngleRange,
    /// Rotation of the head to either side, radians.
    pub neck_rotation_rad: f64,
    /// Bending of the head to either side, radians.
    pub neck_bending_rad: f64,
    /// Deviation of the distances between shoulders and between hips, metres.
    pub distance_m: f64,
    /// Deviation of the distances from shoulders to pelvis, metres: spine and shoulder girdle are not rigid.
    pub shoulder_pelvis_m: f64,
    /// Every limit grows by this many standard deviations of the propagated noise.
    pub noise_factor: f64,
}

impl Limits {
    /// Table 1 as printed and 2 cm for the rigid distances, whatever the noise.
    ///
    /// The range 0-120 of the hip holds "when flexion at knee is allowed": here from 10 degrees of flexion on.
    /// The knee is read with the sign opposite to the elbow's.
    pub fn paper() -> Self {
        let deg = |angle: f64| angle.to_radians();
        Self {
            reading: AngleReading::Literal,
            shoulder_swing: AngleRange::from_deg(-50.0, 180.0),
            shoulder_abduction: AngleRange::from_deg(-50.0, 180.0),
            hip_swing: AngleRange::from_deg(-40.0, 120.0),
            hip_flexion_straight_rad: deg(90.0),
            straight_knee_rad: deg(10.0),
            hip_abduction: AngleRange::from_deg(-30.0, 45.0),
            elbow: AngleRange::from_deg(0.0, 160.0),
            knee: AngleRange::from_deg(0.0, 130.0),
            pelvis_flexion: AngleRange::from_deg(-30.0, 75.0),
            pelvis_rotation_rad: deg(30.0),
            pelvis_bending_rad: deg(35.0),
            neck_flexion: AngleRange::from_deg(-55.0, 45.0),
            neck_rotation_rad: deg(70.0),
            neck_bending_rad: deg(40.0),
            distance_m: 0.02,
            shoulder_pelvis_m: 0.02,
            noise_factor: 0.0,
        }
    }

    /// Limits that real people keep.
    ///
    /// Table 1 widened by 5 degrees (knee flexion by 10; shoulder extension by 10, for a jumper's arms swing
    /// back by 56); the knee may be extended by 8, for true walkers reach 6.3. Chosen on four walks, seen
    /// from the front, at 45 degrees and from the side, without noise and at 3 px of 480 px/m, as were the
    /// noise factor and the uncertainty of the lengths. The tolerance from shoulders to pelvis was chosen on
    /// a jump and a bout of punching, whose true distances change by up to 4 cm and whose trunks shorten by as
    /// much, which the wrong length of the trunk then magnifies along the ray. No motion but these six was
    /// looked at.
    pub fn measured() -> Self {
        let paper = Self::paper();
        let deg = |angle: f64| angle.to_radians();
        Self {
            reading: AngleReading::Turn,
            shoulder_swing: AngleRange::from_deg(-60.0, 185.0),
            shoulder_abduction: paper.shoulder_abduction.widened(deg(5.0)),
            hip_swing: paper.hip_swing.widened(deg(5.0)),
            hip_flexion_straight_rad: paper.hip_flexion_straight_rad + deg(5.0),
            hip_abduction: paper.hip_abduction.widened(deg(5.0)),
            elbow: AngleRange::from_deg(-5.0, 165.0),
            knee: AngleRange::from_deg(-8.0, 140.0),
            pelvis_flexion: paper.pelvis_flexion.widened(deg(5.0)),
            pelvis_rotation_rad: paper.pelvis_rotation_rad + deg(5.0),
            pelvis_bending_rad: paper.pelvis_bending_rad + deg(5.0),
            neck_flexion: paper.neck_flexion.widened(deg(5.0)),
            neck_rotation_rad: paper.neck_rotation_rad + deg(5.0),
            neck_bending_rad: paper.neck_bending_rad + deg(5.0),
            distance_m: 0.02,
            shoulder_pelvis_m: 0.10,
            noise_factor: 1.5,
            ..paper
        }
    }

    /// Checks one constraint of angle or distance; None where it holds or is none of these.
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

    /// Passing a bound from within; the bound and the excess as angles, the margin in standard deviations.
    fn beyond(&self, constraint: Constraint, bound: f64, excess: f64, sd: f64) -> Option<Violation> {
        let margin = if self.noise_factor == 0.0 { 0.0 } else { self.noise_factor * sd };
        Violation::over(constraint, bound + excess, bound + margin, Unit::Radians)
    }

    /// The tolerance grows by the noise along the distance and by the lengthening that noise across it makes.
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

    /// The excess of a projected angle as a turn of the limb, whose component along the axis of projection
    /// is given.
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

    /// `sense` is 1 where flexion has w_z >= 0 (elbow), -1 where it has w_z <= 0 (knee).
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
