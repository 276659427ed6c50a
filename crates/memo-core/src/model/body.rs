//! The body: 14 elliptic cylinders in a hierarchy of rigid transforms (Rohr 1994, section 3.1).
//!
//! Lengths are fractions of body height after Drillis and Contini 1966 (as printed in Winter, *Biomechanics
//! and Motor Control of Human Movement*). Rohr measured the thickness of the parts on a clothed person and
//! does not print it. [`Proportions::default`] holds thicknesses chosen here for a person of average build in
//! light clothing.
//!
//! Limits: limbs swing in planes parallel to the walking direction; hands are rigid continuations of the
//! forearms.

use super::cylinder::EllipticCylinder;
use super::gait::{Gait, GaitStyle, Posture};
use glam::{DAffine3, DMat3, DVec2, DVec3};
use thiserror::Error;

/// Number of parts.
pub const PART_COUNT: usize = 14;

/// Why no body was made.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The body height in metres is not plausible for a human.
    #[error("body height must lie between 0.4 and 2.6 metres, got {height_m}{}", centimetre_hint(*.height_m))]
    Height {
        /// The height given, metres.
        height_m: f64,
    },
}

fn centimetre_hint(height_m: f64) -> &'static str {
    if (40.0..=260.0).contains(&height_m) { " (that looks like centimetres)" } else { "" }
}

/// The 14 parts, in the order of every slice of posed cylinders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Part {
    Head,
    Torso,
    RightUpperArm,
    RightForearm,
    RightHand,
    LeftUpperArm,
    LeftForearm,
    LeftHand,
    RightThigh,
    RightShank,
    RightFoot,
    LeftThigh,
    LeftShank,
    LeftFoot,
}

impl Part {
    /// All parts in order.
    pub const ALL: [Self; PART_COUNT] = [
        Self::Head,
        Self::Torso,
        Self::RightUpperArm,
        Self::RightForearm,
        Self::RightHand,
        Self::LeftUpperArm,
        Self::LeftForearm,
        Self::LeftHand,
        Self::RightThigh,
        Self::RightShank,
        Self::RightFoot,
        Self::LeftThigh,
        Self::LeftShank,
        Self::LeftFoot,
    ];

    /// The name in files and sentences, such as `right shank`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Torso => "torso",
            Self::RightUpperArm => "right upper arm",
            Self::RightForearm => "right forearm",
            Self::RightHand => "right hand",
            Self::LeftUpperArm => "left upper arm",
            Self::LeftForearm => "left forearm",
            Self::LeftHand => "left hand",
            Self::RightThigh => "right thigh",
            Self::RightShank => "right shank",
            Self::RightFoot => "right foot",
            Self::LeftThigh => "left thigh",
            Self::LeftShank => "left shank",
            Self::LeftFoot => "left foot",
        }
    }

    /// Whether the part belongs to an arm.
    pub fn is_arm(self) -> bool {
        (2..8).contains(&(self as u8))
    }

    /// Whether the part belongs to a leg.
    pub fn is_leg(self) -> bool {
        self as u8 >= 8
    }
}

/// Sizes as fractions of body height. Lengths and widths: Drillis and Contini 1966.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proportions {
    /// Height of the crown: 1 unless the stated body height is off.
    pub crown_height: f64,
    /// Height of the chin, the lower end of the head.
    pub chin_height: f64,
    /// Height of the shoulder joints.
    pub shoulder_height: f64,
    /// Height of the hip joints.
    pub hip_height: f64,
    /// Height of the knee joints.
    pub knee_height: f64,
    /// Height of the ankle joints.
    pub ankle_height: f64,
    /// Shoulder to elbow.
    pub upper_arm: f64,
    /// Elbow to wrist.
    pub forearm: f64,
    /// Wrist to finger tips; the hand swings loosely curled, so this is less than the length of a straight
    /// hand.
    pub hand: f64,
    /// Distance of the head's axis in front of the trunk's.
    pub head_forward: f64,
    /// Heel to toe.
    pub foot: f64,
    /// Distance of the heel behind the ankle.
    pub heel: f64,
    /// Distance of a shoulder joint from the sagittal plane.
    pub shoulder_half_width: f64,
    /// Distance of a hip joint from the sagittal plane.
    pub hip_half_width: f64,
    /// Semi-axes (front to back, side to side) of head, torso, upper arm, forearm, hand, thigh and shank, and
    /// of the foot (up and down, side to side).
    pub semi_axes: [(f64, f64); 8],
}

impl Default for Proportions {
    fn default() -> Self {
        Self {
            crown_height: 1.0,
            chin_height: 0.870,
            shoulder_height: 0.818,
            hip_height: 0.530,
            knee_height: 0.285,
            ankle_height: 0.039,
            upper_arm: 0.186,
            forearm: 0.146,
            hand: 0.070,
            head_forward: 0.0,
            foot: 0.152,
            heel: 0.035,
            shoulder_half_width: 0.110,
            hip_half_width: 0.050,
            semi_axes: [
                (0.054, 0.044),
                (0.066, 0.095),
                (0.027, 0.027),
                (0.022, 0.022),
                (0.022, 0.012),
                (0.044, 0.044),
                (0.030, 0.030),
                (0.020, 0.026),
            ],
        }
    }
}

impl Proportions {
    /// Number of values of [`Proportions::to_array`].
    pub const COUNT: usize = 30;

    /// All values in the order of the fields.
    pub fn to_array(&self) -> [f64; Self::COUNT] {
        let lengths = [
            self.crown_height,
            self.chin_height,
            self.shoulder_height,
            self.hip_height,
            self.knee_height,
            self.ankle_height,
            self.upper_arm,
            self.forearm,
            self.hand,
            self.head_forward,
            self.foot,
            self.heel,
            self.shoulder_half_width,
            self.hip_half_width,
        ];
        let axes = self.semi_axes.iter().flat_map(|&(a, b)| [a, b]);
        let mut all = lengths.into_iter().chain(axes);
        std::array::from_fn(|_| all.next().unwrap_or(0.0))
    }

    /// The proportions of these values.
    pub fn from_array(values: &[f64; Self::COUNT]) -> Self {
        Self {
            crown_height: values[0],
            chin_height: values[1],
            shoulder_height: values[2],
            hip_height: values[3],
            knee_height: values[4],
            ankle_height: values[5],
            upper_arm: values[6],
            forearm: values[7],
            hand: values[8],
            head_forward: values[9],
            foot: values[10],
            heel: values[11],
            shoulder_half_width: values[12],
            hip_half_width: values[13],
            semi_axes: std::array::from_fn(|n| (values[14 + 2 * n], values[15 + 2 * n])),
        }
    }
}

/// Limb joints of one side in the world, metres.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[allow(missing_docs, reason = "the names say it")]
pub struct SideJoints {
    pub shoulder: DVec3,
    pub elbow: DVec3,
    pub wrist: DVec3,
    pub hip: DVec3,
    pub knee: DVec3,
    pub ankle: DVec3,
}

impl SideJoints {
    /// Names of the joints in the order of [`SideJoints::to_array`].
    pub const NAMES: [&'static str; 6] = ["shoulder", "elbow", "wrist", "hip", "knee", "ankle"];

    /// The joints in the order of [`SideJoints::NAMES`].
    pub fn to_array(self) -> [DVec3; 6] {
        [self.shoulder, self.elbow, self.wrist, self.hip, self.knee, self.ankle]
    }
}

/// A body in a posture, placed in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedBody {
    /// The 14 parts in the order of [`Part::ALL`].
    pub cylinders: [EllipticCylinder; PART_COUNT],
    /// Joints of the right side.
    pub right: SideJoints,
    /// Joints of the left side.
    pub left: SideJoints,
    /// Centre of the torso in the world, metres.
    pub torso_centre: DVec3,
}

/// A body of a given height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Body height from crown to sole, metres.
    pub height_m: f64,
    /// Sizes as fractions of the body height.
    pub proportions: Proportions,
}

impl Body {
    /// A body with the default proportions.
    ///
    /// # Errors
    ///
    /// A height outside 0.4 to 2.6 m.
    pub fn from_height(height_m: f64) -> Result<Self, BodyError> {
        if !(0.4..=2.6).contains(&height_m) {
            return Err(BodyError::Height { height_m });
        }
        Ok(Self { height_m, proportions: Proportions::default() })
    }

    /// Distance from hip to shoulder, metres.
    pub fn torso_length_m(&self) -> f64 {
        (self.proportions.shoulder_height - self.proportions.hip_height) * self.height_m
    }

    /// Poses the body from the torso centre (world, metres), the heading (radians) and all joint angles.
    ///
    /// Every transform is `parent_from_child`; the chain is world, torso, upper limb, lower limb, hand or
    /// foot.
    pub fn pose(&self, torso_centre: DVec3, heading_rad: f64, posture: &Posture) -> PosedBody {
        let world_from_body =
            DAffine3::from_mat3_translation(DMat3::from_rotation_z(heading_rad), torso_centre);
        let world_from_torso = world_from_body * DAffine3::from_rotation_y(posture.trunk_lean);
        let mut cylinders = [self.torso(world_from_torso); PART_COUNT];
        cylinders[Part::Head as usize] = self.head(world_from_torso);
        let right = self.side(world_from_torso, -1.0, posture, &mut cylinders);
        let left = self.side(world_from_torso, 1.0, posture, &mut cylinders);
        PosedBody { cylinders, right, left, torso_centre }
    }

    fn torso(&self, world_from_torso: DAffine3) -> EllipticCylinder {
        self.cylinder(1, world_from_torso, 0.5 * self.torso_length_m())
    }

    fn head(&self, world_from_torso: DAffine3) -> EllipticCylinder {
        let p = &self.proportions;
        let half_length = 0.5 * (p.crown_height - p.chin_height) * self.height_m;
        let centre =
            (p.chin_height - p.shoulder_height) * self.height_m + 0.5 * self.torso_length_m() + half_length;
        let centre = DVec3::new(p.head_forward * self.height_m, 0.0, centre);
        self.cylinder(0, world_from_torso * DAffine3::from_translation(centre), half_length)
    }

    /// The six limb parts and the joints of one side; `side` is +1 left, -1 right. Thigh angles are relative
    /// to the vertical, so the lean of the trunk is subtracted at the hip.
    fn side(
        &self,
        world_from_torso: DAffine3,
        side: f64,
        posture: &Posture,
        cylinders: &mut [EllipticCylinder; PART_COUNT],
    ) -> SideJoints {
        let (p, h) = (&self.proportions, self.height_m);
        let angles = if side > 0.0 { &posture.left } else { &posture.right };
        let half_torso = 0.5 * self.torso_length_m();
        let at = |lateral: f64, z: f64| DAffine3::from_translation(DVec3::new(0.0, side * lateral * h, z));
        let flexed = |angle: f64| DAffine3::from_rotation_y(-angle);

        let shoulder = world_from_torso * at(p.shoulder_half_width, half_torso) * flexed(angles.shoulder);
        let elbow = shoulder * up(-p.upper_arm * h) * flexed(angles.elbow);
        let wrist = elbow * up(-p.forearm * h);
        let (across, back) = posture.pelvis_rotation.sin_cos();
        let (across, back) = (back * side * p.hip_half_width * h, -across * side * p.hip_half_width * h);
        let tilted = |tilt: f64| DAffine3::from_rotation_x(side * tilt);
        let level_at_hip = world_from_torso
            * DAffine3::from_translation(DVec3::new(back, across, -half_torso))
            * flexed(posture.trunk_lean);
        let hip = level_at_hip * tilted(angles.thigh_tilt) * flexed(angles.hip);
        let mut knee = level_at_hip * tilted(angles.shank_tilt) * flexed(angles.hip - angles.knee);
        knee.translation = hip.transform_point3(DVec3::NEG_Z * (p.hip_height - p.knee_height) * h);
        let ankle = knee * up(-(p.knee_height - p.ankle_height) * h) * flexed(angles.ankle);

        let first_arm = if side > 0.0 { Part::LeftUpperArm } else { Part::RightUpperArm } as usize;
        let first_leg = if side > 0.0 { Part::LeftThigh } else { Part::RightThigh } as usize;
        cylinders[first_arm] = self.hanging(2, shoulder, p.upper_arm * h);
        cylinders[first_arm + 1] = self.hanging(3, elbow, p.forearm * h);
        cylinders[first_arm + 2] = self.hanging(4, wrist, p.hand * h);
        cylinders[first_leg] = self.hanging(5, hip, (p.hip_height - p.knee_height) * h);
        cylinders[first_leg + 1] = self.hanging(6, knee, (p.knee_height - p.ankle_height) * h);
        cylinders[first_leg + 2] = self.foot(ankle);
        let [shoulder, elbow, wrist, hip, knee, ankle] =
            [shoulder, elbow, wrist, hip, knee, ankle].map(|joint| joint.translation);
        SideJoints { shoulder, elbow, wrist, hip, knee, ankle }
    }

    /// A limb part hanging `length` below its joint.
    fn hanging(&self, row: usize, world_from_joint: DAffine3, length: f64) -> EllipticCylinder {
        self.cylinder(row, world_from_joint * up(-0.5 * length), 0.5 * length)
    }

    /// The foot points forward, at a right angle to the shank unless the ankle is bent; its sole is as far below the ankle as the
    /// proportions specify.
    fn foot(&self, world_from_ankle: DAffine3) -> EllipticCylinder {
        let (p, h) = (&self.proportions, self.height_m);
        let axis_below_ankle = p.ankle_height - p.semi_axes[7].0;
        let centre = DVec3::new(0.5 * p.foot - p.heel, 0.0, -axis_below_ankle) * h;
        let ankle_from_foot =
            DAffine3::from_translation(centre) * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
        self.cylinder(7, world_from_ankle * ankle_from_foot, 0.5 * p.foot * h)
    }

    fn cylinder(&self, row: usize, world_from_cylinder: DAffine3, half_length: f64) -> EllipticCylinder {
        let (a, b) = self.proportions.semi_axes[row];
        EllipticCylinder { world_from_cylinder, semi_axes: DVec2::new(a, b) * self.height_m, half_length }
    }
}

fn up(z: f64) -> DAffine3 {
    DAffine3::from_translation(DVec3::new(0.0, 0.0, z))
}

/// A body with a gait: together with a position and a phase it gives a posed body.
#[derive(Debug, Clone, PartialEq)]
pub struct Walker {
    /// The body.
    pub body: Body,
    /// The average joint curves.
    pub gait: Gait,
    /// The person's deviation from the average curves.
    pub style: GaitStyle,
}

impl Walker {
    /// The body in its posture at `phase` (cycles). `torso_centre` is the mean (level) position, metres; the
    /// vertical displacement of the gait is added to it.
    pub fn pose(&self, torso_centre: DVec3, heading_rad: f64, phase: f64) -> PosedBody {
        let centre = torso_centre + DVec3::Z * self.gait.vertical_m(phase);
        self.body.pose(centre, heading_rad, &self.gait.posture(phase, &self.style))
    }

    /// Mean height of the torso centre over a cycle in which the lower ankle is always at its standing
    /// height, metres.
    ///
    /// The ankle is used and not the sole, because the foot of the model does not bend: its toe would go
    /// below the ground at push-off.
    pub fn level_torso_height_m(&self) -> f64 {
        let n = 40;
        (0..n).map(|i| self.torso_height_m(f64::from(i) / f64::from(n))).sum::<f64>() / f64::from(n)
    }

    /// Mean height of the crown while walking, metres: bent legs lower it by some centimetres below the body
    /// height.
    pub fn level_crown_height_m(&self) -> f64 {
        let p = &self.body.proportions;
        let standing_torso = 0.5 * (p.shoulder_height + p.hip_height) * self.body.height_m;
        self.body.height_m - (standing_torso - self.level_torso_height_m())
    }

    fn torso_height_m(&self, phase: f64) -> f64 {
        let posed = self.body.pose(DVec3::ZERO, 0.0, &self.gait.posture(phase, &self.style));
        self.body.proportions.ankle_height * self.body.height_m - posed.right.ankle.z.min(posed.left.ankle.z)
    }
}

#[cfg(test)]
mod tests;
