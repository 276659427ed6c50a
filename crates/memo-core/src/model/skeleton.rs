//! The stick figure: 14 joints, 17 segments (Lee and Chen 1985, section 1 and Fig. 1).
//!
//! The joints are in the paper's order, which is that of the levels of the interpretation tree. Each joint is
//! found from its starting joint, the adjacent joint closer to the neck. Torso (neck, shoulders, pelvis) and
//! hip part (pelvis, hips) are rigid, so there are four distances within them in addition to the 13 segments
//! from starting to ending joint.

use crate::estimate::median::median;
use glam::DVec3;
use thiserror::Error;

use crate::model::body::{Body, BodyError};

/// Number of joints.
pub const JOINT_COUNT: usize = 14;

/// The joints in the order of the levels of the interpretation tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Joint {
    Neck,
    RightShoulder,
    LeftShoulder,
    Pelvis,
    RightHip,
    LeftHip,
    RightElbow,
    LeftElbow,
    RightWrist,
    LeftWrist,
    RightKnee,
    LeftKnee,
    RightAnkle,
    LeftAnkle,
}

/// Side of the body, as the person's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Side {
    Right,
    Left,
}

impl Side {
    /// Both sides, right first.
    pub const BOTH: [Self; 2] = [Self::Right, Self::Left];

    /// The other side.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
        }
    }

    /// The name of the side: "right" or "left".
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Left => "left",
        }
    }

    /// The side's shoulder.
    pub fn shoulder(self) -> Joint {
        self.of(Joint::RightShoulder)
    }

    /// The side's elbow.
    pub fn elbow(self) -> Joint {
        self.of(Joint::RightElbow)
    }

    /// The side's wrist.
    pub fn wrist(self) -> Joint {
        self.of(Joint::RightWrist)
    }

    /// The side's hip.
    pub fn hip(self) -> Joint {
        self.of(Joint::RightHip)
    }

    /// The side's knee.
    pub fn knee(self) -> Joint {
        self.of(Joint::RightKnee)
    }

    /// The side's ankle.
    pub fn ankle(self) -> Joint {
        self.of(Joint::RightAnkle)
    }

    fn of(self, right: Joint) -> Joint {
        match self {
            Self::Right => right,
            Self::Left => right.mirrored(),
        }
    }
}

impl Joint {
    /// All joints in the order of the levels of the interpretation tree.
    pub const ALL: [Self; JOINT_COUNT] = [
        Self::Neck,
        Self::RightShoulder,
        Self::LeftShoulder,
        Self::Pelvis,
        Self::RightHip,
        Self::LeftHip,
        Self::RightElbow,
        Self::LeftElbow,
        Self::RightWrist,
        Self::LeftWrist,
        Self::RightKnee,
        Self::LeftKnee,
        Self::RightAnkle,
        Self::LeftAnkle,
    ];

    /// The starting joint of the segment that ends at this joint; `None` for the neck.
    pub const fn start(self) -> Option<Self> {
        Some(match self {
            Self::Neck => return None,
            Self::RightShoulder | Self::LeftShoulder | Self::Pelvis => Self::Neck,
            Self::RightHip | Self::LeftHip => Self::Pelvis,
            Self::RightElbow => Self::RightShoulder,
            Self::LeftElbow => Self::LeftShoulder,
            Self::RightWrist => Self::RightElbow,
            Self::LeftWrist => Self::LeftElbow,
            Self::RightKnee => Self::RightHip,
            Self::LeftKnee => Self::LeftHip,
            Self::RightAnkle => Self::RightKnee,
            Self::LeftAnkle => Self::LeftKnee,
        })
    }

    /// The paper's class of joints at the same distance from the neck, `'a'` to `'d'`; `None` for the neck.
    pub fn class(self) -> Option<char> {
        match self {
            Self::Neck => None,
            Self::RightShoulder | Self::LeftShoulder | Self::Pelvis => Some('a'),
            Self::RightElbow | Self::LeftElbow | Self::RightHip | Self::LeftHip => Some('b'),
            Self::RightWrist | Self::LeftWrist | Self::RightKnee | Self::LeftKnee => Some('c'),
            Self::RightAnkle | Self::LeftAnkle => Some('d'),
        }
    }

    /// The same joint of the other side; neck and pelvis map to themselves.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Neck | Self::Pelvis => self,
            Self::RightShoulder => Self::LeftShoulder,
            Self::LeftShoulder => Self::RightShoulder,
            Self::RightHip => Self::LeftHip,
            Self::LeftHip => Self::RightHip,
            Self::RightElbow => Self::LeftElbow,
            Self::LeftElbow => Self::RightElbow,
            Self::RightWrist => Self::LeftWrist,
            Self::LeftWrist => Self::RightWrist,
            Self::RightKnee => Self::LeftKnee,
            Self::LeftKnee => Self::RightKnee,
            Self::RightAnkle => Self::LeftAnkle,
            Self::LeftAnkle => Self::RightAnkle,
        }
    }

    /// The name in files and messages, such as `right_knee`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neck => "neck",
            Self::RightShoulder => "right_shoulder",
            Self::LeftShoulder => "left_shoulder",
            Self::Pelvis => "pelvis",
            Self::RightHip => "right_hip",
            Self::LeftHip => "left_hip",
            Self::RightElbow => "right_elbow",
            Self::LeftElbow => "left_elbow",
            Self::RightWrist => "right_wrist",
            Self::LeftWrist => "left_wrist",
            Self::RightKnee => "right_knee",
            Self::LeftKnee => "left_knee",
            Self::RightAnkle => "right_ankle",
            Self::LeftAnkle => "left_ankle",
        }
    }

    /// The joint with the given name; `None` for an unknown name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|joint| joint.name() == name)
    }
}

/// One value for each joint, indexed by [`Joint`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PerJoint<T>(pub [T; JOINT_COUNT]);

impl<T> std::ops::Index<Joint> for PerJoint<T> {
    type Output = T;

    fn index(&self, joint: Joint) -> &T {
        &self.0[joint as usize]
    }
}

impl<T> std::ops::IndexMut<Joint> for PerJoint<T> {
    fn index_mut(&mut self, joint: Joint) -> &mut T {
        &mut self.0[joint as usize]
    }
}

/// A stick figure: the joints in space, metres, in camera or world axes; NaN for unknown joints.
pub type StickFigure = PerJoint<DVec3>;

impl StickFigure {
    /// A figure in which all joints are unknown.
    pub const UNKNOWN: Self = Self([DVec3::NAN; JOINT_COUNT]);

    /// The vector of the segment that ends at a joint, metres; NaN for the neck.
    pub fn segment(&self, end: Joint) -> DVec3 {
        end.start().map_or(DVec3::NAN, |start| self[end] - self[start])
    }
}

/// Why segment lengths were refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LengthError {
    /// A length is not a positive number.
    #[error("the length of {segment} must be positive and finite metres, got {length_m}")]
    NotPositive {
        /// The segment.
        segment: String,
        /// Its length.
        length_m: f64,
    },
    /// A length is longer than any human segment.
    #[error("the length of {segment} is {length_m} m, more than {MAX_SEGMENT_M} m: metres are expected")]
    TooLong {
        /// The segment.
        segment: String,
        /// Its length.
        length_m: f64,
    },
    /// No figure of a sequence contains both joints of a segment.
    #[error("no frame shows both ends of {segment}: its length cannot be measured")]
    NeverSeen {
        /// The segment.
        segment: String,
    },
    /// The body height is not plausible.
    #[error(transparent)]
    Height(#[from] BodyError),
}

/// Largest accepted segment length, metres; longer lengths are probably in another unit.
pub const MAX_SEGMENT_M: f64 = 1.5;

/// The four distances within the rigid parts that are not segments of the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names say it")]
pub enum RigidDistance {
    Shoulders,
    RightShoulderPelvis,
    LeftShoulderPelvis,
    Hips,
}

impl RigidDistance {
    /// All four distances.
    pub const ALL: [Self; 4] =
        [Self::Shoulders, Self::RightShoulderPelvis, Self::LeftShoulderPelvis, Self::Hips];

    /// The two joints of the distance; the second has the higher level.
    pub fn joints(self) -> [Joint; 2] {
        match self {
            Self::Shoulders => [Joint::RightShoulder, Joint::LeftShoulder],
            Self::RightShoulderPelvis => [Joint::RightShoulder, Joint::Pelvis],
            Self::LeftShoulderPelvis => [Joint::LeftShoulder, Joint::Pelvis],
            Self::Hips => [Joint::RightHip, Joint::LeftHip],
        }
    }

    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Shoulders => "right_shoulder_to_left_shoulder",
            Self::RightShoulderPelvis => "right_shoulder_to_pelvis",
            Self::LeftShoulderPelvis => "left_shoulder_to_pelvis",
            Self::Hips => "right_hip_to_left_hip",
        }
    }
}

/// Lengths of the 17 segments, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentLengths {
    /// Length of the segment that ends at each joint; 0 at the neck.
    pub to: PerJoint<f64>,
    /// The distances within torso and hip part, in the order of [`RigidDistance::ALL`], metres.
    pub rigid: [f64; 4],
}

impl SegmentLengths {
    /// The lengths of Table A.1 of the paper.
    pub fn lee_chen() -> Self {
        Self::symmetric(0.205, 0.463, 0.30, 0.26, 0.19, 0.38, 0.37, [0.403, 0.502, 0.322])
    }

    /// Lengths from body height by the anthropometric table of [`Body`] (Drillis and Contini 1966), for
    /// joints as detectors define them: the neck is the midpoint of the shoulders, and the pelvis lies on the
    /// line from the neck to the midpoint of the hips, at [`PELVIS_ON_TRUNK`] of its length.
    ///
    /// # Errors
    ///
    /// A height outside the range of [`Body::from_height`].
    pub fn from_height(height_m: f64) -> Result<Self, LengthError> {
        let body = Body::from_height(height_m)?;
        let p = body.proportions;
        let [shoulder, hip] = [p.shoulder_half_width * height_m, p.hip_half_width * height_m];
        let neck_pelvis = PELVIS_ON_TRUNK * body.torso_length_m();
        let pelvis_hips = body.torso_length_m() - neck_pelvis;
        Ok(Self::symmetric(
            shoulder,
            neck_pelvis,
            p.upper_arm * height_m,
            p.forearm * height_m,
            pelvis_hips.hypot(hip),
            (p.hip_height - p.knee_height) * height_m,
            (p.knee_height - p.ankle_height) * height_m,
            [2.0 * shoulder, neck_pelvis.hypot(shoulder), 2.0 * hip],
        ))
    }

    /// Medians over figures with known joints, for example from motion capture.
    ///
    /// # Errors
    ///
    /// A segment that no figure contains, or an invalid median ([`SegmentLengths::validated`]).
    pub fn from_figures(figures: &[StickFigure]) -> Result<Self, LengthError> {
        let typical = |name: &str, length: &dyn Fn(&StickFigure) -> f64| {
            let mut lengths: Vec<f64> = figures.iter().map(length).filter(|l| l.is_finite()).collect();
            median(&mut lengths).ok_or_else(|| LengthError::NeverSeen { segment: name.to_owned() })
        };
        let mut lengths = Self { to: PerJoint::default(), rigid: [0.0; 4] };
        for joint in Joint::ALL.into_iter().skip(1) {
            lengths.to[joint] = typical(&segment_name(joint), &|figure| figure.segment(joint).length())?;
        }
        for distance in RigidDistance::ALL {
            let [a, b] = distance.joints();
            lengths.rigid[distance as usize] =
                typical(distance.name(), &|figure| figure[a].distance(figure[b]))?;
        }
        lengths.validated()
    }

    /// The same lengths, or an error if one is invalid.
    ///
    /// # Errors
    ///
    /// A length that is not positive, or longer than [`MAX_SEGMENT_M`].
    pub fn validated(self) -> Result<Self, LengthError> {
        for (segment, length_m) in self.named() {
            if !(length_m.is_finite() && length_m > 0.0) {
                return Err(LengthError::NotPositive { segment, length_m });
            }
            if length_m > MAX_SEGMENT_M {
                return Err(LengthError::TooLong { segment, length_m });
            }
        }
        Ok(self)
    }

    /// All 17 lengths with their names, metres.
    pub fn named(&self) -> impl Iterator<Item = (String, f64)> + '_ {
        let segments = Joint::ALL.into_iter().skip(1).map(|joint| (segment_name(joint), self.to[joint]));
        let rigid = RigidDistance::ALL.into_iter().map(|d| (d.name().to_owned(), self.rigid[d as usize]));
        segments.chain(rigid)
    }

    /// Sets the length with a name of [`SegmentLengths::named`]; returns false for an unknown name.
    pub fn set(&mut self, name: &str, length_m: f64) -> bool {
        let segment = Joint::ALL.into_iter().skip(1).find(|&joint| segment_name(joint) == name);
        let rigid = RigidDistance::ALL.into_iter().find(|distance| distance.name() == name);
        match (segment, rigid) {
            (Some(joint), _) => self.to[joint] = length_m,
            (None, Some(distance)) => self.rigid[distance as usize] = length_m,
            (None, None) => return false,
        }
        true
    }

    #[allow(clippy::too_many_arguments, reason = "one a segment")]
    fn symmetric(
        shoulder: f64,
        pelvis: f64,
        upper_arm: f64,
        forearm: f64,
        hip: f64,
        thigh: f64,
        shank: f64,
        [shoulders, shoulder_pelvis, hips]: [f64; 3],
    ) -> Self {
        let to = [
            0.0, shoulder, shoulder, pelvis, hip, hip, upper_arm, upper_arm, forearm, forearm, thigh, thigh,
            shank, shank,
        ];
        Self { to: PerJoint(to), rigid: [shoulders, shoulder_pelvis, shoulder_pelvis, hips] }
    }
}

/// Position of the pelvis joint between the heights of shoulders (0) and hips (1): in the rigid trunk of
/// Table A.1 the shoulders are 45.98 cm above it and the hips 10.09 cm below.
pub const PELVIS_ON_TRUNK: f64 = 45.98 / (45.98 + 10.09);

/// The name of the segment that ends at a joint, such as `right_hip_to_right_knee`.
pub fn segment_name(end: Joint) -> String {
    end.start().map_or_else(String::new, |start| format!("{}_to_{}", start.name(), end.name()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_joint_hangs_on_one_of_a_lower_level_and_mirrors_with_it() {
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = joint.start().unwrap();
            assert!(start < joint);
            assert_eq!(joint.mirrored().start(), Some(start.mirrored()));
            assert_eq!(joint.mirrored().mirrored(), joint);
            assert_eq!(Joint::from_name(joint.name()), Some(joint));
        }
    }

    /// A rigid trunk with the lengths of Table A.1 exists: the neck is 3.77 cm in front of the shoulder line.
    #[test]
    fn the_papers_trunk_is_rigid() {
        let lengths = SegmentLengths::lee_chen();
        let shoulder = DVec3::new(-0.0377, 0.0, 0.2015);
        let pelvis_below_shoulders = 0.4598_f64;
        assert!((shoulder.length() - lengths.to[Joint::LeftShoulder]).abs() < 2e-4);
        assert!((pelvis_below_shoulders.hypot(0.0377) - 0.463).abs() < 2e-3);
        assert!((pelvis_below_shoulders.hypot(0.2015) - lengths.rigid[1]).abs() < 2e-4);
        assert!((0.1009_f64.hypot(0.161) - lengths.to[Joint::LeftHip]).abs() < 2e-4);
    }

    #[test]
    fn lengths_are_named_and_refused_by_name() {
        let mut lengths = SegmentLengths::from_height(1.75).unwrap();
        assert_eq!(lengths.named().count(), 17);
        assert!(lengths.set("right_hip_to_right_knee", -0.4));
        assert!(!lengths.set("right_knee_to_nose", 0.4));
        let error = lengths.validated().unwrap_err();
        assert!(error.to_string().contains("right_hip_to_right_knee"), "{error}");
        assert!(SegmentLengths::from_height(175.0).unwrap_err().to_string().contains("centimetres"));
        assert!(matches!(
            SegmentLengths::from_figures(&[StickFigure::UNKNOWN]),
            Err(LengthError::NeverSeen { .. })
        ));
    }

    /// Drillis and Contini 1966 (in Winter, Biomechanics and Motor Control of Human Movement, 4th ed., fig. 4.1):
    /// thigh 0.245, shank 0.246, upper arm 0.186, forearm 0.146, hip to shoulder 0.288 of the height.
    #[test]
    fn lengths_by_height_are_those_of_the_published_table() {
        let lengths = SegmentLengths::from_height(2.0).unwrap();
        for side in Side::BOTH {
            for (end, share) in
                [(side.knee(), 0.245), (side.ankle(), 0.246), (side.elbow(), 0.186), (side.wrist(), 0.146)]
            {
                assert!((lengths.to[end] - 2.0 * share).abs() < 1e-12, "{end:?}");
            }
        }
        // The distances neck to pelvis and pelvis to the midpoint of the hips add up to the trunk.
        let half = |distance: RigidDistance| 0.5 * lengths.rigid[distance as usize];
        let hips = (lengths.to[Joint::LeftHip].powi(2) - half(RigidDistance::Hips).powi(2)).sqrt();
        assert!((lengths.to[Joint::Pelvis] + hips - 2.0 * 0.288).abs() < 1e-12);
        assert!((lengths.to[Joint::Pelvis] / hips - 45.98 / 10.09).abs() < 1e-9);
        // The neck is the midpoint of the shoulders.
        assert!((lengths.to[Joint::LeftShoulder] - half(RigidDistance::Shoulders)).abs() < 1e-12);
        let diagonal = lengths.to[Joint::Pelvis].hypot(half(RigidDistance::Shoulders));
        assert!((lengths.rigid[RigidDistance::LeftShoulderPelvis as usize] - diagonal).abs() < 1e-12);
    }

    /// For an even number of figures the mean of the two middle values; lengths longer than any segment are
    /// refused.
    #[test]
    fn lengths_of_figures_are_medians() {
        let scaled = |scale: f64| {
            let mut figure = StickFigure::UNKNOWN;
            for (i, joint) in Joint::ALL.into_iter().enumerate() {
                let i = i as f64;
                figure[joint] = 0.1 * scale * DVec3::new(i.sin(), 0.3 * i, (2.0 * i).cos());
            }
            figure
        };
        let one = scaled(1.0).segment(Joint::LeftKnee).length();
        let median = |scales: &[f64]| {
            let figures: Vec<StickFigure> = scales.iter().map(|scale| scaled(*scale)).collect();
            SegmentLengths::from_figures(&figures).unwrap().to[Joint::LeftKnee] / one
        };
        assert!((median(&[1.0, 1.2]) - 1.1).abs() < 1e-12);
        assert!((median(&[1.0, 3.0, 1.2, 1.1]) - 1.15).abs() < 1e-12);
        assert!((median(&[1.0, 3.0, 1.2]) - 1.2).abs() < 1e-12);
        let mut lengths = SegmentLengths::lee_chen();
        lengths.to[Joint::LeftKnee] = 1.6;
        assert!(matches!(lengths.validated(), Err(LengthError::TooLong { .. })));
        lengths.to[Joint::LeftKnee] = 1.4;
        assert!(lengths.validated().is_ok());
    }
}
