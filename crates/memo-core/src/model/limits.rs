//! Limits of the body: angles at the joints (Lee and Chen 1985, Table 1) and distances within its rigid parts
//! (section 3.2 A and B), with the tolerances that real people keep.
//!
//! An angle can be measured in two ways. [`AngleReading::Literal`] is the paper's: the angle of the limb's
//! projection, and the sign of w_z at elbow and knee. It is undefined where a projection vanishes: the
//! flexion of an arm held out sideways, the abduction of an arm held forward, the sign of an elbow whose
//! upper arm lies along z. [`AngleReading::Turn`] is the angle by which a segment would have to turn to come
//! into the range. It is the same for limbs that swing forward and back and approaches zero where the paper's
//! angle becomes undefined:
//!
//! ```text
//! flexion, extension    asin(ρ sin ε), ε the excess of θ, ρ the length of the projection of u on xy (ε < 90°)
//! abduction             asin(u·outward), the angle out of the sagittal plane, instead of φ
//! elbow, knee           asin(∓w_z), the angle by which v leaves the half-space bounded by u and z
//! ```
//!
//! Limits of the measured variant grow with the noise propagated from the image and from the lengths, by
//! `noise_factor` standard deviations. Ranges are circular: if an angle is outside, the nearer of the two
//! bounds counts.

use std::f64::consts::TAU;

/// A range of a signed angle; flexion and abduction are positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleRange {
    /// Smallest angle, radians: minus the largest extension or adduction.
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

    /// The excess of an angle over the range, radians: positive above it, negative below it, 0 within. The
    /// nearer bound counts.
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
    /// The paper's angle.
    Literal,
    /// The angle by which the segment would have to turn to come into the range.
    Turn,
}

/// Limits of the joint angles and of the distances within the rigid parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// How angles are measured.
    pub reading: AngleReading,
    /// Flexion and extension of the upper arm.
    pub shoulder_swing: AngleRange,
    /// Abduction and adduction of the upper arm.
    pub shoulder_abduction: AngleRange,
    /// Flexion and extension of the thigh with a bent knee.
    pub hip_swing: AngleRange,
    /// Flexion of the thigh with a straight knee, radians.
    pub hip_flexion_straight_rad: f64,
    /// Knee flexion below which the knee counts as straight, radians.
    pub straight_knee_rad: f64,
    /// Abduction and adduction of the thigh.
    pub hip_abduction: AngleRange,
    /// Flexion and extension of the elbow.
    pub elbow: AngleRange,
    /// Flexion and extension of the knee.
    pub knee: AngleRange,
    /// Flexion and extension of the torso relative to the hips.
    pub pelvis_flexion: AngleRange,
    /// Rotation of the hips relative to the torso, to either side, radians.
    pub pelvis_rotation_rad: f64,
    /// Bending of the hips relative to the torso, to either side, radians.
    pub pelvis_bending_rad: f64,
    /// Flexion and extension of the head.
    pub neck_flexion: AngleRange,
    /// Rotation of the head to either side, radians.
    pub neck_rotation_rad: f64,
    /// Bending of the head to either side, radians.
    pub neck_bending_rad: f64,
    /// Tolerance of the distances between the shoulders and between the hips, metres.
    pub distance_m: f64,
    /// Tolerance of the distances from the shoulders to the pelvis, metres: spine and shoulder girdle are not
    /// rigid.
    pub shoulder_pelvis_m: f64,
    /// Number of standard deviations of the propagated noise by which every limit grows.
    pub noise_factor: f64,
}

impl Limits {
    /// Table 1 as printed, and 2 cm for the rigid distances, independent of the noise.
    ///
    /// The range 0-120 of the hip holds "when flexion at knee is allowed": here from 10 degrees of knee
    /// flexion on. The sign of the knee is opposite to that of the elbow.
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
    /// Table 1 is widened by 5 degrees, knee flexion by 10, and shoulder extension by 10, because the arms of
    /// a jumper swing back by 56. The knee may be extended by 8, because real walkers reach 6.3. These
    /// values, the noise factor and the uncertainty of the lengths were chosen on four walks, seen from the
    /// front, at 45 degrees and from the side, without noise and with 3 px at 480 px/m. The tolerance from
    /// shoulders to pelvis was chosen on a jump and a bout of punching: their true distances change by up to
    /// 4 cm, their trunks shorten by as much, and the wrong trunk length then magnifies the error along the
    /// ray. No motion other than these six was examined.
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
}
