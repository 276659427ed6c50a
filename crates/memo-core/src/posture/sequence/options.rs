//! Options of [`super::postures`]: the motion, the strength of its limits, the source of the neck's distance, and
//! their ranges.

use crate::OptionError;
use glam::DVec3;

use super::SequenceError;
use crate::model::skeleton::SegmentLengths;
use crate::posture::anchor::{AnchorOptions, AnchorSource, SmoothOptions};
use crate::posture::group::DEFAULT_GROUP_M;
use crate::posture::prior::MotionPrior;
use crate::posture::rules::MotionModel;
use crate::posture::tree::TreeOptions;

/// Motion model: rules beyond the limits of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Motion {
    /// No rules: any person, any motion.
    Physical,
    /// Rules 1 to 5: forward walking on a straight line.
    Walking,
    /// Only rules 1 and 2: arms and legs swing in opposition.
    WalkingGeneral,
}

impl Motion {
    /// All motions.
    pub const ALL: [Self; 3] = [Self::Physical, Self::Walking, Self::WalkingGeneral];

    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Physical => "physical",
            Self::Walking => "walking",
            Self::WalkingGeneral => "walking_general",
        }
    }

    /// The motion of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|motion| motion.name() == name)
    }

    /// The constraints of the tree.
    pub fn tree(self, strength: Strength) -> TreeOptions {
        let is_paper = strength == Strength::Paper;
        let options = if is_paper { TreeOptions::physical_paper() } else { TreeOptions::physical() };
        match (self, is_paper) {
            (Self::Physical, _) => options,
            (Self::Walking, false) => options.with_motion(MotionModel::walking()),
            (Self::Walking, true) => options.with_motion(MotionModel::walking_paper()),
            (Self::WalkingGeneral, false) => options.with_motion(MotionModel::walking_general()),
            (Self::WalkingGeneral, true) => options.with_motion(MotionModel::walking_general_paper()),
        }
    }

    /// True if its rules or its prior are relative to the moving direction.
    pub(super) fn needs_heading(self) -> bool {
        matches!(self, Self::Walking | Self::WalkingGeneral)
    }

    /// Word for a person in this motion.
    pub(super) fn noun(self) -> &'static str {
        match self {
            Self::Physical => "a person",
            Self::Walking | Self::WalkingGeneral => "walking",
        }
    }

    /// The prior of the motion.
    pub(super) fn prior(self) -> MotionPrior {
        match self {
            Self::Walking | Self::WalkingGeneral => MotionPrior::walking(),
            Self::Physical => MotionPrior::any(),
        }
    }
}

/// Strength of the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Strength {
    /// Limits that real people keep in noisy data.
    Measured,
    /// Limits as printed by Lee and Chen.
    Paper,
}

impl Strength {
    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Paper => "paper",
        }
    }

    /// The strength of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Measured, Self::Paper].into_iter().find(|strength| strength.name() == name)
    }
}

/// Source of the neck's distance.
#[derive(Debug, Clone, PartialEq)]
pub enum AnchorChoice {
    /// Ground, trunk and extent combined, as far as a frame allows each; the head if it allows none. Of people who
    /// do not walk, and thus may bend, the extent is used only where ground and trunk give nothing.
    Auto,
    /// One source: ground, trunk, extent or head. `Combined` is `Auto` without the head.
    Source(AnchorSource),
    /// Known distances along the neck's ray: one for all frames or one per frame (NaN: unknown).
    Given {
        /// Distances, metres.
        distance_m: Vec<f64>,
        /// Their standard deviation, metres.
        sd_m: f64,
    },
}

impl AnchorChoice {
    /// The name in files and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Source(source) => source.name(),
            Self::Given { .. } => "given",
        }
    }

    /// True if the distance depends on whether the person may bend.
    pub(super) fn may_bend(&self) -> bool {
        use AnchorSource::{Combined, Ground, Trunk};
        matches!(self, Self::Auto | Self::Source(Ground | Trunk | Combined))
    }
}

/// Default standard deviation of a given distance, metres: a tape measure to where the person stands.
pub const DEFAULT_DISTANCE_SD_M: f64 = 0.05;

/// Accepted distances, metres: nearer, the lens touches the person; farther, a person is not resolved.
const DISTANCES_M: std::ops::RangeInclusive<f64> = 0.1..=1000.0;

/// Options of [`super::postures`].
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceOptions {
    /// Segment lengths, if measured; otherwise they are estimated from `height_m` and the sequence.
    pub lengths: Option<SegmentLengths>,
    /// Body height, metres, if known. Without lengths and height the scale comes from the ground.
    pub height_m: Option<f64>,
    /// Standard deviation of a pixel coordinate. Default 2: good detections of a person some 500 px tall. If a
    /// detector differs from the joints by 8 px, use 8.
    pub noise_px: f64,
    /// Motion model. Default: walking, for which the paper gives its rules.
    pub motion: Motion,
    /// Strength of the limits. Default: measured, because the printed limits reject most true frames of walking.
    pub strength: Strength,
    /// Source of the neck's distance.
    pub anchor: AnchorChoice,
    /// Relative standard deviation of the camera's focal length, 0 if it is calibrated. All distances that are not
    /// given are proportional to it. Of [`Camera::assumed`](crate::Camera::assumed):
    /// [`ASSUMED_FOCAL_SD`](crate::model::ASSUMED_FOCAL_SD).
    pub focal_sd: f64,
    /// The moving direction in world axes, if known; its vertical component is not used.
    pub moving_direction: Option<DVec3>,
    /// Joints with a lower weight count as missing. Default 0.2: detections with a lower score are mostly
    /// guesses.
    pub min_weight: f64,
    /// Minimum displacement on the ground from which the moving direction is taken, metres. Default 0.5: a step
    /// is longer, and swaying on the spot is shorter.
    pub min_travel_m: f64,
    /// Surviving postures whose joints all agree within this distance are one group, metres.
    pub group_m: f64,
    /// Maximum number of groups per frame, largest first. Default 64: more cannot be distinguished by eye.
    pub max_groups: usize,
    /// True to keep every cut branch of every frame, for [`FrameReading::cut_figures`](super::FrameReading::cut_figures).
    pub keep_cuts: bool,
    /// Assumptions of the sources of the neck's distance, see [`AnchorOptions`].
    pub anchor_options: AnchorOptions,
    /// Options of smoothing the distances.
    pub smooth_options: SmoothOptions,
}

impl Default for SequenceOptions {
    fn default() -> Self {
        Self {
            lengths: None,
            height_m: None,
            noise_px: 2.0,
            motion: Motion::Walking,
            strength: Strength::Measured,
            anchor: AnchorChoice::Auto,
            focal_sd: 0.0,
            moving_direction: None,
            min_weight: 0.2,
            min_travel_m: 0.5,
            group_m: DEFAULT_GROUP_M,
            max_groups: 64,
            keep_cuts: false,
            anchor_options: AnchorOptions::default(),
            smooth_options: SmoothOptions::default(),
        }
    }
}

/// An error for the first option that is out of range.
pub(super) fn check_options(options: &SequenceOptions) -> Result<(), SequenceError> {
    let at_least_0 = [
        ("noise_px", options.noise_px),
        ("focal_sd", options.focal_sd),
        ("min_weight", options.min_weight),
        ("min_travel_m", options.min_travel_m),
        ("group_m", options.group_m),
    ];
    for (name, value) in at_least_0 {
        OptionError::unless_at_least_0(name, value)?;
    }
    if let AnchorChoice::Given { distance_m, sd_m } = &options.anchor {
        if let Some(&value) = distance_m.iter().find(|d| !(d.is_nan() || DISTANCES_M.contains(d))) {
            let wanted = "a distance of 0.1 to 1000 m (NaN: unknown)";
            return Err(OptionError { name: "distance_m", wanted, got: value }.into());
        }
        let is_good = *sd_m > 0.0 && sd_m <= DISTANCES_M.end();
        OptionError::unless(is_good, "distance_sd_m", "positive and at most 1000 m", *sd_m)?;
    }
    if let Some(lengths) = options.lengths {
        lengths.validated()?;
    }
    if let Some(height_m) = options.height_m {
        SegmentLengths::from_height(height_m)?;
    }
    if let Some(value) = options.moving_direction
        && !(value.is_finite() && value.truncate().try_normalize().is_some())
    {
        return Err(SequenceError::Direction { value });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::rules::Rule;

    #[test]
    fn every_motion_has_its_rules_at_both_strengths() {
        for (motion, rules, measured, paper) in [
            (Motion::Physical, 0, None, None),
            (Motion::Walking, 9, Some(MotionModel::walking()), Some(MotionModel::walking_paper())),
            (
                Motion::WalkingGeneral,
                3,
                Some(MotionModel::walking_general()),
                Some(MotionModel::walking_general_paper()),
            ),
        ] {
            let [free, strict] = [Strength::Measured, Strength::Paper].map(|strength| motion.tree(strength));
            assert_eq!((&free.motion, &strict.motion), (&measured, &paper), "{motion:?}");
            let applying =
                |model: &MotionModel| Rule::ALL.iter().filter(|r| model.tolerance(**r).is_some()).count();
            assert_eq!(measured.as_ref().map_or(0, applying), rules);
            assert_eq!(free.limits.unwrap().noise_factor > 0.0, strict.limits.unwrap().noise_factor == 0.0);
            assert_eq!(Motion::from_name(motion.name()), Some(motion));
        }
        for strength in [Strength::Measured, Strength::Paper] {
            assert_eq!(Strength::from_name(strength.name()), Some(strength));
        }
    }

    /// Arbitrary motion has no direction; only walking has a prior.
    #[test]
    fn walking_has_a_direction_and_its_habits() {
        let with_direction = Motion::ALL.into_iter().filter(|motion| motion.needs_heading());
        assert_eq!(with_direction.collect::<Vec<_>>(), [Motion::Walking, Motion::WalkingGeneral]);
        let walkers = Motion::ALL.into_iter().filter(|motion| motion.prior() == MotionPrior::walking());
        assert_eq!(walkers.collect::<Vec<_>>(), [Motion::Walking, Motion::WalkingGeneral]);
    }

    #[test]
    fn options_out_of_range_are_refused_by_name() {
        let refused = |change: &dyn Fn(&mut SequenceOptions)| {
            let mut options = SequenceOptions::default();
            change(&mut options);
            check_options(&options).err().map(|error| error.to_string())
        };
        assert_eq!(refused(&|_| {}), None);
        for value in [-0.1, f64::INFINITY, f64::NAN] {
            let said = [
                refused(&|o| o.noise_px = value),
                refused(&|o| o.focal_sd = value),
                refused(&|o| o.min_weight = value),
                refused(&|o| o.min_travel_m = value),
                refused(&|o| o.group_m = value),
            ];
            for (name, said) in
                ["noise_px", "focal_sd", "min_weight", "min_travel_m", "group_m"].iter().zip(said)
            {
                let said = said.unwrap();
                assert!(said.starts_with(&format!("{name} must be finite and not negative")), "{said}");
            }
        }
        let given = |distance_m: f64, sd_m: f64| {
            let anchor = AnchorChoice::Given { distance_m: vec![4.0, distance_m], sd_m };
            refused(&move |o| o.anchor = anchor.clone())
        };
        assert_eq!([given(f64::NAN, 0.1), given(0.1, 0.1), given(1000.0, 1000.0)], [None, None, None]);
        for (distance_m, sd_m) in [(0.09, 0.1), (1001.0, 0.1), (4.0, 0.0), (4.0, 1001.0), (4.0, f64::NAN)] {
            assert!(given(distance_m, sd_m).unwrap().contains("must be"), "{distance_m} {sd_m}");
        }
        assert!(refused(&|o| o.height_m = Some(17.0)).unwrap().contains("17"));
        let mut lengths = SegmentLengths::lee_chen();
        lengths.rigid[2] = f64::NAN;
        assert!(refused(&|o| o.lengths = Some(lengths)).unwrap().contains("NaN"));
        assert!(refused(&|o| o.moving_direction = Some(DVec3::Z)).unwrap().contains("not vertical"));
        assert_eq!(refused(&|o| o.moving_direction = Some(DVec3::new(0.1, 0.0, 9.0))), None);
        assert_eq!(SequenceOptions::default().min_weight, 0.2);
    }
}
