//! Rules of motion beyond the limits of the body, each with a tolerance, and motion models made of rules (Lee and
//! Chen 1985, section 3.3).
//!
//! Rules compare swings: the angle of a segment from the trunk's y in its sagittal plane, forward positive. An
//! elbow or a knee that swings less than the tolerance is "too close to the torso" for rules 1 and 2. Rule 3 has
//! two readings: the joint against the plane of the body (section 4.2 of the paper), or the upper against the
//! lower segment; both are implemented. A walker's thigh swings forward while the shank is behind it, so the
//! second reading does not hold for legs. Shoulders are behind any plane through the neck, so the first does not
//! hold for arms. The rules are for straight-line walking: people who turn or stand break them.
//!
//! Tolerances of the measured strength were chosen on four walks of motion capture (two Plug-in-Gait, two CMU).
//! They are the smallest multiples of 5 degrees at which no more than about one true frame in a hundred is cut.
//! The noise factor was chosen on the same walks in three views at 3 px.

use glam::DVec3;

use super::constraint::{Constraint, Unit, Violation};
use super::placed::{Placed, PlacedFigure, Trunk};
use crate::model::skeleton::{Joint, Side};

/// A rule.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Rule {
    /// Rule 1: the arms do not swing to one side by more than the angle.
    ArmsOpposed,
    /// Rule 1: the legs do not swing to one side by more than the angle.
    LegsOpposed,
    /// Rule 2: the arm and the leg of a side do not swing to one side by more than the angle.
    ArmOpposesLeg,
    /// Rule 3, joint against the body plane: a shoulder off it by more than the distance and an upper arm by
    /// more than the angle are on the same side of it.
    ShoulderElbow,
    /// Rule 3, upper against lower segment: upper arm and forearm do not swing to opposite sides, both by more
    /// than the angle.
    ElbowWrist,
    /// Rule 3, joint against the body plane: hip and thigh.
    HipKnee,
    /// Rule 3, upper against lower segment: thigh and shank.
    KneeAnkle,
    /// Rule 4: upper arm and forearm leave the vertical plane of the moving direction by at most the angle.
    ArmPlane,
    /// Rule 4: thigh and shank likewise.
    LegPlane,
    /// Rule 5: at most one knee is flexed by more than the angle.
    OneKneeFlexed,
    /// Rule 5: while one knee is flexed (by [`MotionModel::knee_flexed_rad`]), the other leg, from hip to
    /// ankle, leans from the vertical by at most the angle.
    OtherLegUpright,
}

/// Number of rules.
pub const RULE_COUNT: usize = 11;

impl Rule {
    /// All rules.
    pub const ALL: [Self; RULE_COUNT] = [
        Self::ArmsOpposed,
        Self::LegsOpposed,
        Self::ArmOpposesLeg,
        Self::ShoulderElbow,
        Self::ElbowWrist,
        Self::HipKnee,
        Self::KneeAnkle,
        Self::ArmPlane,
        Self::LegPlane,
        Self::OneKneeFlexed,
        Self::OtherLegUpright,
    ];

    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::ArmsOpposed => "arms_opposed",
            Self::LegsOpposed => "legs_opposed",
            Self::ArmOpposesLeg => "arm_opposes_leg",
            Self::ShoulderElbow => "shoulder_with_elbow",
            Self::ElbowWrist => "upper_arm_with_forearm",
            Self::HipKnee => "hip_with_knee",
            Self::KneeAnkle => "thigh_with_shank",
            Self::ArmPlane => "arms_in_moving_plane",
            Self::LegPlane => "legs_in_moving_plane",
            Self::OneKneeFlexed => "one_knee_flexed",
            Self::OtherLegUpright => "other_leg_upright",
        }
    }

    /// The rule of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rule| rule.name() == name)
    }

    /// The number in the paper.
    pub fn number(self) -> u8 {
        match self {
            Self::ArmsOpposed | Self::LegsOpposed => 1,
            Self::ArmOpposesLeg => 2,
            Self::ShoulderElbow | Self::ElbowWrist | Self::HipKnee | Self::KneeAnkle => 3,
            Self::ArmPlane | Self::LegPlane => 4,
            Self::OneKneeFlexed | Self::OtherLegUpright => 5,
        }
    }

    /// The rule that a constraint belongs to.
    pub fn of(constraint: Constraint) -> Option<Self> {
        use Constraint as C;
        Some(match constraint {
            C::ArmsOpposed => Self::ArmsOpposed,
            C::LegsOpposed => Self::LegsOpposed,
            C::ArmOpposesLeg(_) => Self::ArmOpposesLeg,
            C::ShoulderElbow(_) => Self::ShoulderElbow,
            C::ElbowWrist(_) => Self::ElbowWrist,
            C::HipKnee(_) => Self::HipKnee,
            C::KneeAnkle(_) => Self::KneeAnkle,
            C::UpperArmPlane(_) | C::ForearmPlane(_) => Self::ArmPlane,
            C::ThighPlane(_) | C::ShankPlane(_) => Self::LegPlane,
            C::OneKneeFlexed => Self::OneKneeFlexed,
            C::OtherLegUpright => Self::OtherLegUpright,
            _ => return None,
        })
    }
}

/// Tolerance of a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Angle, radians.
    pub angle_rad: f64,
    /// Distance, metres; only for [`Rule::ShoulderElbow`] and [`Rule::HipKnee`].
    pub distance_m: f64,
}

impl Tolerance {
    /// A tolerance for an angle in degrees.
    pub fn from_deg(angle_deg: f64) -> Self {
        Self { angle_rad: angle_deg.to_radians(), distance_m: 0.0 }
    }

    /// The same with a distance of the joint from the body plane.
    #[must_use]
    pub fn with_distance_m(self, distance_m: f64) -> Self {
        Self { distance_m, ..self }
    }
}

/// A motion model: a set of rules with tolerances.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionModel {
    /// Tolerance of each rule in the order of [`Rule::ALL`]; `None` for rules that do not apply.
    pub tolerances: [Option<Tolerance>; RULE_COUNT],
    /// A knee counts as flexed for [`Rule::OtherLegUpright`] above this angle, radians.
    pub knee_flexed_rad: f64,
    /// Every angle tolerance is increased by this many standard deviations of the propagated noise.
    pub noise_factor: f64,
}

impl MotionModel {
    /// A model without rules.
    pub fn without_rules() -> Self {
        Self { tolerances: [None; RULE_COUNT], knee_flexed_rad: 40f64.to_radians(), noise_factor: 1.0 }
    }

    /// Rules 1 to 5 with tolerances that true walking keeps.
    pub fn walking() -> Self {
        Self::walking_general()
            .with(Rule::HipKnee, Tolerance::from_deg(10.0).with_distance_m(0.03))
            .with(Rule::ElbowWrist, Tolerance::from_deg(30.0))
            .with(Rule::ArmPlane, Tolerance::from_deg(30.0))
            .with(Rule::LegPlane, Tolerance::from_deg(20.0))
            .with(Rule::OneKneeFlexed, Tolerance::from_deg(40.0))
            .with(Rule::OtherLegUpright, Tolerance::from_deg(20.0))
    }

    /// Only rules 1 and 2, with tolerances that true walking keeps.
    pub fn walking_general() -> Self {
        Self::without_rules()
            .with(Rule::ArmsOpposed, Tolerance::from_deg(15.0))
            .with(Rule::LegsOpposed, Tolerance::from_deg(20.0))
            .with(Rule::ArmOpposesLeg, Tolerance::from_deg(15.0))
    }

    /// Rules 1 to 5 with the tight tolerances of the paper's examples; true walking breaks them in nine frames of
    /// ten.
    pub fn walking_paper() -> Self {
        let joint = Tolerance::from_deg(5.0).with_distance_m(0.01);
        let model = Self::walking_general_paper()
            .with(Rule::ShoulderElbow, joint)
            .with(Rule::HipKnee, joint)
            .with(Rule::ArmPlane, Tolerance::from_deg(15.0))
            .with(Rule::LegPlane, Tolerance::from_deg(15.0))
            .with(Rule::OneKneeFlexed, Tolerance::from_deg(15.0))
            .with(Rule::OtherLegUpright, Tolerance::from_deg(20.0));
        Self { knee_flexed_rad: 15f64.to_radians(), ..model }
    }

    /// Rules 1 and 2 with the dead zone of 10 degrees that reproduces the paper's tables.
    pub fn walking_general_paper() -> Self {
        let model = [Rule::ArmsOpposed, Rule::LegsOpposed, Rule::ArmOpposesLeg]
            .into_iter()
            .fold(Self::without_rules(), |model, rule| model.with(rule, Tolerance::from_deg(10.0)));
        Self { noise_factor: 0.0, ..model }
    }

    /// The same model with another rule.
    #[must_use]
    pub fn with(mut self, rule: Rule, tolerance: Tolerance) -> Self {
        self.tolerances[rule as usize] = Some(tolerance);
        self
    }

    /// The tolerance of a rule; `None` if it does not apply.
    pub fn tolerance(&self, rule: Rule) -> Option<Tolerance> {
        self.tolerances[rule as usize]
    }

    /// Checks one constraint; `None` if it holds, does not apply or is not a rule.
    pub(crate) fn check(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        trunk: &Trunk,
    ) -> Option<Violation> {
        use Constraint as C;
        let tolerance = self.tolerance(Rule::of(constraint)?)?;
        let angle = tolerance.angle_rad;
        match constraint {
            C::ArmsOpposed => {
                self.same_side(constraint, angle, figure, trunk, Side::Right.elbow(), Side::Left.elbow())
            }
            C::LegsOpposed => {
                self.same_side(constraint, angle, figure, trunk, Side::Right.knee(), Side::Left.knee())
            }
            C::ArmOpposesLeg(s) => self.same_side(constraint, angle, figure, trunk, s.elbow(), s.knee()),
            C::ShoulderElbow(s) => self.joint_against_limb(constraint, tolerance, figure, trunk, s.elbow()),
            C::HipKnee(s) => self.joint_against_limb(constraint, tolerance, figure, trunk, s.knee()),
            C::ElbowWrist(s) => self.apart(constraint, angle, figure, trunk, [s.elbow(), s.wrist()]),
            C::KneeAnkle(s) => self.apart(constraint, angle, figure, trunk, [s.knee(), s.ankle()]),
            C::UpperArmPlane(s) => self.out_of_plane(constraint, angle, figure[s.elbow()], trunk),
            C::ForearmPlane(s) => self.out_of_plane(constraint, angle, figure[s.wrist()], trunk),
            C::ThighPlane(s) => self.out_of_plane(constraint, angle, figure[s.knee()], trunk),
            C::ShankPlane(s) => self.out_of_plane(constraint, angle, figure[s.ankle()], trunk),
            C::OneKneeFlexed => {
                let right = self.sure_flexion(figure, trunk, Side::Right, angle);
                if right <= angle {
                    return None;
                }
                let left = self.sure_flexion(figure, trunk, Side::Left, angle);
                self.over(constraint, right.min(left), angle)
            }
            C::OtherLegUpright => self.other_leg(constraint, angle, figure, trunk),
            _ => None,
        }
    }

    fn over(&self, constraint: Constraint, value: f64, limit: f64) -> Option<Violation> {
        Violation::over(constraint, value, limit, Unit::Radians)
    }

    /// An angle moved towards 0 by its noise.
    fn sure(&self, angle: f64, sd: f64) -> f64 {
        if self.noise_factor == 0.0 {
            return angle;
        }
        angle.signum() * (angle.abs() - self.noise_factor * sd).max(0.0)
    }

    fn sure_swing(&self, limb: &Placed, trunk: &Trunk) -> f64 {
        let axes = &trunk.torso;
        let towards = axes.z_axis.cross(limb.unit).normalize_or_zero();
        self.sure(trunk.swing_rad(limb), limb.direction_sd(towards).hypot(trunk.torso_sd.z))
    }

    /// The flexion of a knee, moved towards 0 by its noise. It is not moved if it does not exceed a tolerance
    /// anyway.
    fn sure_flexion(&self, figure: &PlacedFigure, trunk: &Trunk, side: Side, tolerance: f64) -> f64 {
        let [thigh, shank] = [figure[side.knee()], figure[side.ankle()]];
        let flexion = trunk.knee_rad(thigh, shank);
        if flexion <= tolerance {
            return flexion;
        }
        self.sure(flexion, thigh.worst_direction_sd().hypot(shank.worst_direction_sd()))
    }

    /// Rules 1 and 2: the smaller of two swings to one side.
    fn same_side(
        &self,
        constraint: Constraint,
        tolerance: f64,
        figure: &PlacedFigure,
        trunk: &Trunk,
        a: Joint,
        b: Joint,
    ) -> Option<Violation> {
        let limbs = [a, b].map(|joint| figure[joint]);
        let [a, b] = limbs.map(|limb| trunk.swing_rad(limb));
        if a * b <= 0.0 || a.abs().min(b.abs()) <= tolerance {
            return None;
        }
        let [a, b] = limbs.map(|limb| self.sure_swing(limb, trunk));
        self.over(constraint, a.abs().min(b.abs()), tolerance)
    }

    /// Rule 3, upper against lower segment: the smaller of two swings to opposite sides.
    fn apart(
        &self,
        constraint: Constraint,
        tolerance: f64,
        figure: &PlacedFigure,
        trunk: &Trunk,
        joints: [Joint; 2],
    ) -> Option<Violation> {
        let limbs = joints.map(|joint| figure[joint]);
        let [a, b] = limbs.map(|limb| trunk.swing_rad(limb));
        if a * b >= 0.0 || a.abs().min(b.abs()) <= tolerance {
            return None;
        }
        let [a, b] = limbs.map(|limb| self.sure_swing(limb, trunk));
        self.over(constraint, a.abs().min(b.abs()), tolerance)
    }

    /// Rule 3, joint against the plane through neck and pelvis: the limb's swing against its joint's.
    fn joint_against_limb(
        &self,
        constraint: Constraint,
        tolerance: Tolerance,
        figure: &PlacedFigure,
        trunk: &Trunk,
        end: Joint,
    ) -> Option<Violation> {
        let limb = figure[end];
        let start = figure[end.start()?];
        let normal = trunk.body_normal;
        let ahead = (start.unit * start.length_m).dot(normal);
        if ahead.abs() <= tolerance.distance_m {
            return None;
        }
        let slack = if self.noise_factor > 0.0 { self.noise_factor * start.along(normal) } else { 0.0 };
        if ahead.abs() <= tolerance.distance_m + slack {
            return None;
        }
        let down = trunk.torso.y_axis;
        let swing = normal.dot(limb.unit).atan2(down.dot(limb.unit));
        let sd = limb.direction_sd(normal).hypot(trunk.torso_sd.z);
        let swing = self.sure(swing, sd);
        if swing * ahead >= 0.0 {
            return None;
        }
        self.over(constraint, swing.abs(), tolerance.angle_rad)
    }

    /// Rule 4.
    fn out_of_plane(
        &self,
        constraint: Constraint,
        tolerance: f64,
        limb: &Placed,
        trunk: &Trunk,
    ) -> Option<Violation> {
        let out = limb.unit.dot(trunk.lateral).clamp(-1.0, 1.0).asin();
        if out.abs() <= tolerance {
            return None;
        }
        let sd = limb.direction_sd(trunk.lateral).hypot(trunk.lateral_sd);
        self.over(constraint, self.sure(out, sd).abs(), tolerance)
    }

    /// Rule 5: the lean of the leg that is not flexed.
    fn other_leg(
        &self,
        constraint: Constraint,
        tolerance: f64,
        figure: &PlacedFigure,
        trunk: &Trunk,
    ) -> Option<Violation> {
        let flexed = self.knee_flexed_rad;
        let [right, left] = Side::BOTH.map(|side| self.sure_flexion(figure, trunk, side, flexed));
        let other = match (right > flexed, left > flexed) {
            (true, false) => Side::Left,
            (false, true) => Side::Right,
            _ => return None,
        };
        self.upright(constraint, tolerance, figure, trunk, other)
    }

    fn upright(
        &self,
        constraint: Constraint,
        tolerance: f64,
        figure: &PlacedFigure,
        trunk: &Trunk,
        side: Side,
    ) -> Option<Violation> {
        let leg: DVec3 = figure[side.ankle()].point - figure[side.hip()].point;
        let lean = leg.normalize_or_zero().dot(-trunk.up).clamp(-1.0, 1.0).acos();
        let [thigh, shank] = [figure[side.knee()], figure[side.ankle()]];
        let sd = thigh.sd_m.hypot(shank.sd_m) / leg.length();
        self.over(constraint, self.sure(lean, sd), tolerance)
    }
}

#[cfg(test)]
mod tests;
