//! What a body can do: angles at the joints (Lee and Chen 1985, Table 1) and distances within its rigid parts
//! (section 3.2 A and B), with the tolerances that people keep.
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

use std::f64::consts::TAU;

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
}
