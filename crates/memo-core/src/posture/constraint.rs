//! Constraints on postures: names, and a message for each violation (Lee and Chen 1985, sections 3.2 and 3.3).
//!
//! A constraint belongs to the level of the last joint it needs. It is evaluated at that level and cuts there.

use std::fmt;

use crate::model::skeleton::{Joint, RigidDistance, Side};

/// One constraint of one joint, pair of joints or limb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Constraint {
    /// A distance within torso or hip part (3.2 B).
    Rigid(RigidDistance),
    /// Head bent forward against the torso (Table 1).
    NeckFlexion,
    /// Head bent back.
    NeckExtension,
    /// Head turned to either side.
    NeckRotation,
    /// Head bent to either side.
    NeckBending,
    /// Torso bent forward over the hips.
    PelvisFlexion,
    /// Torso bent back over the hips.
    PelvisExtension,
    /// Hips turned against the torso, to either side.
    PelvisRotation,
    /// Hips bent against the torso, to either side.
    PelvisBending,
    /// Upper arm swung forward.
    ShoulderFlexion(Side),
    /// Upper arm swung back.
    ShoulderExtension(Side),
    /// Upper arm raised sideways.
    ShoulderAbduction(Side),
    /// Upper arm drawn across the body.
    ShoulderAdduction(Side),
    /// Forearm bent against the upper arm.
    ElbowFlexion(Side),
    /// Forearm bent the wrong way.
    ElbowExtension(Side),
    /// Thigh swung forward; with the range of a bent knee.
    HipFlexion(Side),
    /// Thigh swung back.
    HipExtension(Side),
    /// Thigh spread sideways.
    HipAbduction(Side),
    /// Thigh drawn across the other.
    HipAdduction(Side),
    /// Thigh swung forward with a straight knee, whose range is smaller.
    HipFlexionStraight(Side),
    /// Shank bent against the thigh.
    KneeFlexion(Side),
    /// Shank bent the wrong way.
    KneeExtension(Side),
    /// Upper arm within the torso (3.2 C).
    UpperArmTorso(Side),
    /// Forearm through the torso.
    ForearmTorso(Side),
    /// Shoulder joint and upper arm to opposite sides of the body plane (rule 3).
    ShoulderElbow(Side),
    /// Upper arm and forearm to opposite sides of the body plane (rule 3, other reading).
    ElbowWrist(Side),
    /// Hip joint and thigh to opposite sides of the body plane (rule 3).
    HipKnee(Side),
    /// Thigh and shank to opposite sides of the body plane (rule 3, other reading).
    KneeAnkle(Side),
    /// Upper arm out of the vertical plane of the moving direction (rule 4).
    UpperArmPlane(Side),
    /// Forearm out of that plane.
    ForearmPlane(Side),
    /// Thigh out of that plane.
    ThighPlane(Side),
    /// Shank out of that plane.
    ShankPlane(Side),
    /// Both arms in front of or behind the torso (rule 1).
    ArmsOpposed,
    /// Both legs in front of or behind the torso (rule 1).
    LegsOpposed,
    /// Thigh through thigh.
    ThighThigh,
    /// Shank of a side through the thigh of the other.
    ShankThigh(Side),
    /// Shank through shank.
    ShankShank,
    /// Both knees flexed (rule 5).
    OneKneeFlexed,
    /// One knee flexed and the other leg not upright (rule 5).
    OtherLegUpright,
    /// Arm and leg of one side both swung forward or both back (rule 2).
    ArmOpposesLeg(Side),
    /// An arm through a thigh.
    ArmThigh {
        /// Side of the arm.
        arm: Side,
        /// Side of the thigh.
        leg: Side,
    },
    /// An arm through a shank.
    ArmShank {
        /// Side of the arm.
        arm: Side,
        /// Side of the shank.
        leg: Side,
    },
}

/// Number of constraints.
pub const CONSTRAINT_COUNT: usize = 76;

/// Kind of a constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConstraintKind {
    /// A joint angle (Table 1).
    Angle,
    /// A distance within a rigid part.
    Distance,
    /// A collision of two body parts.
    Collision,
    /// A rule of a motion model.
    Rule,
}

impl ConstraintKind {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle",
            Self::Distance => "distance",
            Self::Collision => "collision",
            Self::Rule => "rule",
        }
    }
}

use Constraint as C;
use Side::{Left, Right};

impl Constraint {
    /// All constraints, in the order in which those of one level are evaluated: of the trunk, of one limb, of
    /// both arms or legs, of an arm and a leg.
    pub const ALL: [Self; CONSTRAINT_COUNT] = [
        C::Rigid(RigidDistance::Shoulders),
        C::Rigid(RigidDistance::RightShoulderPelvis),
        C::Rigid(RigidDistance::LeftShoulderPelvis),
        C::Rigid(RigidDistance::Hips),
        C::NeckFlexion,
        C::NeckExtension,
        C::NeckRotation,
        C::NeckBending,
        C::PelvisFlexion,
        C::PelvisExtension,
        C::PelvisRotation,
        C::PelvisBending,
        C::ShoulderFlexion(Right),
        C::ShoulderFlexion(Left),
        C::ShoulderExtension(Right),
        C::ShoulderExtension(Left),
        C::ShoulderAbduction(Right),
        C::ShoulderAbduction(Left),
        C::ShoulderAdduction(Right),
        C::ShoulderAdduction(Left),
        C::ElbowFlexion(Right),
        C::ElbowFlexion(Left),
        C::ElbowExtension(Right),
        C::ElbowExtension(Left),
        C::HipFlexion(Right),
        C::HipFlexion(Left),
        C::HipExtension(Right),
        C::HipExtension(Left),
        C::HipAbduction(Right),
        C::HipAbduction(Left),
        C::HipAdduction(Right),
        C::HipAdduction(Left),
        C::KneeFlexion(Right),
        C::KneeFlexion(Left),
        C::KneeExtension(Right),
        C::KneeExtension(Left),
        C::HipFlexionStraight(Right),
        C::HipFlexionStraight(Left),
        C::UpperArmTorso(Right),
        C::UpperArmTorso(Left),
        C::ForearmTorso(Right),
        C::ForearmTorso(Left),
        C::ShoulderElbow(Right),
        C::ShoulderElbow(Left),
        C::ElbowWrist(Right),
        C::ElbowWrist(Left),
        C::HipKnee(Right),
        C::HipKnee(Left),
        C::KneeAnkle(Right),
        C::KneeAnkle(Left),
        C::UpperArmPlane(Right),
        C::UpperArmPlane(Left),
        C::ForearmPlane(Right),
        C::ForearmPlane(Left),
        C::ThighPlane(Right),
        C::ThighPlane(Left),
        C::ShankPlane(Right),
        C::ShankPlane(Left),
        C::ArmsOpposed,
        C::LegsOpposed,
        C::ThighThigh,
        C::ShankThigh(Right),
        C::ShankThigh(Left),
        C::ShankShank,
        C::OneKneeFlexed,
        C::OtherLegUpright,
        C::ArmOpposesLeg(Right),
        C::ArmThigh { arm: Right, leg: Right },
        C::ArmShank { arm: Right, leg: Right },
        C::ArmThigh { arm: Left, leg: Right },
        C::ArmShank { arm: Left, leg: Right },
        C::ArmThigh { arm: Right, leg: Left },
        C::ArmShank { arm: Right, leg: Left },
        C::ArmOpposesLeg(Left),
        C::ArmThigh { arm: Left, leg: Left },
        C::ArmShank { arm: Left, leg: Left },
    ];

    /// Kind of the constraint.
    pub fn kind(self) -> ConstraintKind {
        match self {
            C::Rigid(_) => ConstraintKind::Distance,
            C::UpperArmTorso(_) | C::ForearmTorso(_) => ConstraintKind::Collision,
            C::ThighThigh | C::ShankThigh(_) | C::ShankShank => ConstraintKind::Collision,
            C::ArmThigh { .. } | C::ArmShank { .. } => ConstraintKind::Collision,
            C::ShoulderElbow(_) | C::ElbowWrist(_) | C::HipKnee(_) | C::KneeAnkle(_) => ConstraintKind::Rule,
            C::UpperArmPlane(_) | C::ForearmPlane(_) | C::ThighPlane(_) | C::ShankPlane(_) => {
                ConstraintKind::Rule
            }
            C::ArmsOpposed | C::LegsOpposed | C::ArmOpposesLeg(_) => ConstraintKind::Rule,
            C::OneKneeFlexed | C::OtherLegUpright => ConstraintKind::Rule,
            _ => ConstraintKind::Angle,
        }
    }

    /// The joints it needs. For limbs, shoulders, pelvis and hips are not listed: limb joints cannot be known
    /// without them.
    pub(crate) fn joints(self) -> JointSet {
        use Joint::{LeftHip, LeftShoulder, Neck, Pelvis, RightHip, RightShoulder};
        let torso = JointSet::of(&[Neck, RightShoulder, LeftShoulder, Pelvis]);
        let hips = JointSet::of(&[Pelvis, RightHip, LeftHip]);
        let limb = |joints: &[Joint]| torso.with(JointSet::of(joints));
        match self {
            C::Rigid(distance) => JointSet::of(&distance.joints()),
            C::NeckFlexion | C::NeckExtension | C::NeckRotation | C::NeckBending => torso,
            C::PelvisFlexion | C::PelvisExtension | C::PelvisRotation | C::PelvisBending => torso.with(hips),
            C::ShoulderFlexion(s) | C::ShoulderExtension(s) => limb(&[s.elbow()]),
            C::ShoulderAbduction(s) | C::ShoulderAdduction(s) => limb(&[s.elbow()]),
            C::ShoulderElbow(s) | C::UpperArmPlane(s) => limb(&[s.elbow()]),
            C::ElbowFlexion(s) | C::ElbowExtension(s) | C::ElbowWrist(s) => limb(&[s.elbow(), s.wrist()]),
            C::ForearmPlane(s) => limb(&[s.elbow(), s.wrist()]),
            C::HipFlexion(s) | C::HipExtension(s) | C::HipAbduction(s) | C::HipAdduction(s) => {
                limb(&[s.hip(), s.knee()])
            }
            C::HipKnee(s) | C::ThighPlane(s) => limb(&[s.hip(), s.knee()]),
            C::HipFlexionStraight(s) | C::KneeFlexion(s) | C::KneeExtension(s) => {
                limb(&[s.hip(), s.knee(), s.ankle()])
            }
            C::KneeAnkle(s) | C::ShankPlane(s) => limb(&[s.hip(), s.knee(), s.ankle()]),
            C::UpperArmTorso(s) => limb(&[s.elbow()]).with(hips),
            C::ForearmTorso(s) => limb(&[s.elbow(), s.wrist()]).with(hips),
            C::ArmsOpposed => limb(&[Right.elbow(), Left.elbow()]),
            C::LegsOpposed => limb(&[Right.knee(), Left.knee()]).with(hips),
            C::ThighThigh => JointSet::of(&[Right.knee(), Left.knee()]).with(hips),
            C::ShankThigh(s) => JointSet::of(&[s.knee(), s.ankle(), s.other().knee()]).with(hips),
            C::ShankShank => {
                JointSet::of(&[Right.knee(), Right.ankle(), Left.knee(), Left.ankle()]).with(hips)
            }
            C::OneKneeFlexed | C::OtherLegUpright => {
                limb(&[Right.knee(), Right.ankle(), Left.knee(), Left.ankle()]).with(hips)
            }
            C::ArmOpposesLeg(s) => limb(&[s.elbow(), s.hip(), s.knee()]),
            C::ArmThigh { arm, leg } => {
                JointSet::of(&[arm.shoulder(), arm.elbow(), arm.wrist(), leg.hip(), leg.knee()])
            }
            C::ArmShank { arm, leg } => {
                JointSet::of(&[arm.shoulder(), arm.elbow(), arm.wrist(), leg.knee(), leg.ankle()])
            }
        }
    }

    /// The last of the joints it needs: the level at which it is evaluated.
    pub fn level(self) -> Joint {
        self.joints().last()
    }

    /// The name in tables, such as `left_knee_extension`.
    pub fn name(self) -> String {
        let of = |side: Side, what: &str| format!("{}_{what}", side.name());
        match self {
            C::Rigid(distance) => distance.name().to_owned(),
            C::NeckFlexion => "neck_flexion".to_owned(),
            C::NeckExtension => "neck_extension".to_owned(),
            C::NeckRotation => "neck_rotation".to_owned(),
            C::NeckBending => "neck_bending".to_owned(),
            C::PelvisFlexion => "pelvis_flexion".to_owned(),
            C::PelvisExtension => "pelvis_extension".to_owned(),
            C::PelvisRotation => "pelvis_rotation".to_owned(),
            C::PelvisBending => "pelvis_bending".to_owned(),
            C::ShoulderFlexion(s) => of(s, "shoulder_flexion"),
            C::ShoulderExtension(s) => of(s, "shoulder_extension"),
            C::ShoulderAbduction(s) => of(s, "shoulder_abduction"),
            C::ShoulderAdduction(s) => of(s, "shoulder_adduction"),
            C::ElbowFlexion(s) => of(s, "elbow_flexion"),
            C::ElbowExtension(s) => of(s, "elbow_extension"),
            C::HipFlexion(s) => of(s, "hip_flexion"),
            C::HipExtension(s) => of(s, "hip_extension"),
            C::HipAbduction(s) => of(s, "hip_abduction"),
            C::HipAdduction(s) => of(s, "hip_adduction"),
            C::HipFlexionStraight(s) => of(s, "hip_flexion_with_straight_knee"),
            C::KneeFlexion(s) => of(s, "knee_flexion"),
            C::KneeExtension(s) => of(s, "knee_extension"),
            C::UpperArmTorso(s) => of(s, "upper_arm_in_torso"),
            C::ForearmTorso(s) => of(s, "forearm_in_torso"),
            C::ShoulderElbow(s) => of(s, "shoulder_against_elbow"),
            C::ElbowWrist(s) => of(s, "upper_arm_against_forearm"),
            C::HipKnee(s) => of(s, "hip_against_knee"),
            C::KneeAnkle(s) => of(s, "thigh_against_shank"),
            C::UpperArmPlane(s) => of(s, "upper_arm_out_of_plane"),
            C::ForearmPlane(s) => of(s, "forearm_out_of_plane"),
            C::ThighPlane(s) => of(s, "thigh_out_of_plane"),
            C::ShankPlane(s) => of(s, "shank_out_of_plane"),
            C::ArmsOpposed => "arms_on_one_side".to_owned(),
            C::LegsOpposed => "legs_on_one_side".to_owned(),
            C::ThighThigh => "thigh_in_thigh".to_owned(),
            C::ShankThigh(s) => of(s, "shank_in_other_thigh"),
            C::ShankShank => "shank_in_shank".to_owned(),
            C::OneKneeFlexed => "both_knees_flexed".to_owned(),
            C::OtherLegUpright => "other_leg_not_upright".to_owned(),
            C::ArmOpposesLeg(s) => of(s, "arm_with_leg"),
            C::ArmThigh { arm, leg } => format!("{}_arm_in_{}_thigh", arm.name(), leg.name()),
            C::ArmShank { arm, leg } => format!("{}_arm_in_{}_shank", arm.name(), leg.name()),
        }
    }

    /// The constraint of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|constraint| constraint.name() == name)
    }

    /// A description of the violation, one sentence without numbers.
    pub fn description(self) -> String {
        let sentence = self.sentence();
        let what = sentence.trim_end_matches(" by").trim_end_matches(": clearance");
        match self.kind() {
            ConstraintKind::Distance => {
                format!("{} is not that of the rigid body", what.trim_end_matches(" wrong"))
            }
            ConstraintKind::Angle => format!("{what} farther than a body can"),
            ConstraintKind::Collision => what.to_owned(),
            ConstraintKind::Rule => format!("{what} more than the rules of the motion allow"),
        }
    }

    /// The measured quantity, as the start of a sentence that ends with the value.
    fn sentence(self) -> String {
        match self {
            C::Rigid(d) => {
                let [a, b] = d.joints().map(|joint| joint.name().replace('_', " "));
                format!("distance from {a} to {b} wrong by")
            }
            C::NeckFlexion => "head bent forward by".to_owned(),
            C::NeckExtension => "head bent back by".to_owned(),
            C::NeckRotation => "head turned by".to_owned(),
            C::NeckBending => "head bent sideways by".to_owned(),
            C::PelvisFlexion => "torso bent forward over the hips by".to_owned(),
            C::PelvisExtension => "torso bent back over the hips by".to_owned(),
            C::PelvisRotation => "hips turned against the torso by".to_owned(),
            C::PelvisBending => "hips bent sideways against the torso by".to_owned(),
            C::ShoulderFlexion(s) => format!("{} shoulder flexed by", s.name()),
            C::ShoulderExtension(s) => format!("{} shoulder extended by", s.name()),
            C::ShoulderAbduction(s) => format!("{} shoulder abducted by", s.name()),
            C::ShoulderAdduction(s) => format!("{} shoulder adducted by", s.name()),
            C::ElbowFlexion(s) => format!("{} elbow flexed by", s.name()),
            C::ElbowExtension(s) => format!("{} elbow extended by", s.name()),
            C::HipFlexion(s) => format!("{} hip flexed by", s.name()),
            C::HipFlexionStraight(s) => format!("{} hip flexed with a straight knee by", s.name()),
            C::HipExtension(s) => format!("{} hip extended by", s.name()),
            C::HipAbduction(s) => format!("{} hip abducted by", s.name()),
            C::HipAdduction(s) => format!("{} hip adducted by", s.name()),
            C::KneeFlexion(s) => format!("{} knee flexed by", s.name()),
            C::KneeExtension(s) => format!("{} knee extended by", s.name()),
            C::UpperArmTorso(s) => {
                format!("{} upper arm too near to or within the torso: clearance", s.name())
            }
            C::ForearmTorso(s) => format!("{} forearm too near to or within the torso: clearance", s.name()),
            C::ShoulderElbow(s) => format!("{} upper arm swings against its shoulder by", s.name()),
            C::ElbowWrist(s) => format!("{} upper arm and forearm swing apart by", s.name()),
            C::HipKnee(s) => format!("{} thigh swings against its hip by", s.name()),
            C::KneeAnkle(s) => format!("{} thigh and shank swing apart by", s.name()),
            C::UpperArmPlane(s) => format!("{} upper arm leaves the moving plane by", s.name()),
            C::ForearmPlane(s) => format!("{} forearm leaves the moving plane by", s.name()),
            C::ThighPlane(s) => format!("{} thigh leaves the moving plane by", s.name()),
            C::ShankPlane(s) => format!("{} shank leaves the moving plane by", s.name()),
            C::ArmsOpposed => "both arms swing to one side by".to_owned(),
            C::LegsOpposed => "both legs swing to one side by".to_owned(),
            C::ThighThigh => "thighs too near to each other: clearance".to_owned(),
            C::ShankThigh(s) => {
                format!("{} shank too near to the {} thigh: clearance", s.name(), s.other().name())
            }
            C::ShankShank => "shanks too near to each other: clearance".to_owned(),
            C::OneKneeFlexed => "both knees flexed by".to_owned(),
            C::OtherLegUpright => "one knee flexed and the other leg leans by".to_owned(),
            C::ArmOpposesLeg(s) => format!("{} arm and leg swing to one side by", s.name()),
            C::ArmThigh { arm, leg } => {
                format!("{} arm too near to the {} thigh: clearance", arm.name(), leg.name())
            }
            C::ArmShank { arm, leg } => {
                format!("{} arm too near to the {} shank: clearance", arm.name(), leg.name())
            }
        }
    }
}

/// A set of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct JointSet(pub u16);

impl JointSet {
    pub fn of(joints: &[Joint]) -> Self {
        Self(joints.iter().fold(0, |bits, &joint| bits | 1 << joint as u16))
    }

    pub fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub fn contains(self, other: Self) -> bool {
        other.0 & !self.0 == 0
    }

    /// The joints, by level.
    pub fn iter(self) -> impl Iterator<Item = Joint> {
        Joint::ALL.into_iter().filter(move |&joint| self.0 >> joint as u16 & 1 == 1)
    }

    /// The joint of the highest level; the neck for the empty set.
    pub fn last(self) -> Joint {
        Joint::ALL[(15 - self.0.max(1).leading_zeros()) as usize]
    }
}

/// Unit of a violation's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// Angles.
    Radians,
    /// Lengths.
    Metres,
}

/// A constraint that a posture breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Which.
    pub constraint: Constraint,
    /// The level at which it cut the branch.
    pub joint: Joint,
    /// The measured value; a clearance is negative inside a body part.
    pub value: f64,
    /// The largest allowed value, all margins included; for a clearance the smallest.
    pub limit: f64,
    /// Amount by which the limit is exceeded, never negative.
    pub excess: f64,
    /// Unit of value, limit and excess.
    pub unit: Unit,
}

impl Violation {
    pub(crate) fn over(constraint: Constraint, value: f64, limit: f64, unit: Unit) -> Option<Self> {
        let excess = value - limit;
        (excess > 0.0).then(|| Self { constraint, joint: constraint.level(), value, limit, excess, unit })
    }

    pub(crate) fn under(constraint: Constraint, value: f64, limit: f64) -> Option<Self> {
        let excess = limit - value;
        let joint = constraint.level();
        (excess > 0.0).then_some(Self { constraint, joint, value, limit, excess, unit: Unit::Metres })
    }

    /// The excess divided by an excess that is serious: 10 degrees or 2 cm.
    pub fn severity(&self) -> f64 {
        match self.unit {
            Unit::Radians => self.excess / 10f64.to_radians(),
            Unit::Metres => self.excess / 0.02,
        }
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) = match self.unit {
            Unit::Radians => (1f64.to_radians().recip(), "deg"),
            Unit::Metres => (100.0, "cm"),
        };
        let [value, limit] = [self.value, self.limit].map(|v| v * scale);
        let most = if self.constraint.kind() == ConstraintKind::Collision { "least" } else { "most" };
        // Enough digits to distinguish value and limit.
        let digits = if (value - limit).abs() >= 1.0 { 0 } else { 2 };
        write!(
            f,
            "{} {value:.digits$} {unit}, at {most} {limit:.digits$} {unit} allowed",
            self.constraint.sentence()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn names_are_unique_and_found_again() {
        let names: HashSet<String> = C::ALL.into_iter().map(C::name).collect();
        assert_eq!(names.len(), CONSTRAINT_COUNT);
        for constraint in C::ALL {
            assert_eq!(C::from_name(&constraint.name()), Some(constraint));
            assert!(constraint.name().chars().all(|c| c == '_' || c.is_ascii_lowercase()));
        }
    }

    #[test]
    fn constraints_cut_where_their_joints_are_complete() {
        assert_eq!(C::Rigid(RigidDistance::Shoulders).level(), Joint::LeftShoulder);
        assert_eq!(C::KneeExtension(Right).level(), Joint::RightAnkle);
        assert_eq!(C::ShankThigh(Right).level(), Joint::RightAnkle);
        assert_eq!(C::ArmOpposesLeg(Left).level(), Joint::LeftKnee);
        assert_eq!(C::NeckRotation.level(), Joint::Pelvis);
    }

    #[test]
    fn violations_are_plain_sentences() {
        let [value, limit] = [12f64, 10.0].map(f64::to_radians);
        let violation = Violation::over(C::KneeExtension(Left), value, limit, Unit::Radians).unwrap();
        assert_eq!(violation.to_string(), "left knee extended by 12 deg, at most 10 deg allowed");
        let violation = Violation::under(C::ForearmTorso(Right), -0.04, 0.0).unwrap();
        assert_eq!(
            violation.to_string(),
            "right forearm too near to or within the torso: clearance -4 cm, at least 0 cm allowed"
        );
    }
}
