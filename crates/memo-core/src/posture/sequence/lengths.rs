//! Segment lengths of a sequence: given, or estimated from height and proportions and refined by the images.

use super::{AnchorChoice, SequenceError, SequenceOptions, Warning};
use crate::model::skeleton::{Joint, SegmentLengths, segment_name};
use crate::posture::anchor::{Anchor, AnchorOptions, AnchorSource, Ground, from_given};
use crate::posture::length::{
    LengthBasis, LengthFit, LengthFitError, LengthPrior, ScaleFrom, estimate, estimate_from_sequence,
};
use crate::posture::lift::JointRays;
use crate::posture::sequence::NeckTrack;
use crate::posture::tree::DEFAULT_LENGTH_SD_M;

/// Source of a length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LengthOrigin {
    /// Given by the caller.
    Given,
    /// Estimated, with its basis.
    Estimated(LengthBasis),
}

impl LengthOrigin {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Estimated(LengthBasis::Measured) => "measured",
            Self::Estimated(LengthBasis::Pooled) => "other_side",
            Self::Estimated(LengthBasis::Prior) => "proportions",
        }
    }
}

/// The segment lengths in use.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceLengths {
    /// The lengths.
    pub lengths: SegmentLengths,
    /// Standard deviation of each, the common scale included, metres, in the order of
    /// [`SegmentLengths::named`].
    pub sd_m: Vec<f64>,
    /// Source of each length, in that order.
    pub origin: Vec<LengthOrigin>,
    /// Source of their scale; `None` if the lengths were given.
    pub scale_from: Option<ScaleFrom>,
    /// Relative standard deviation of the scale.
    pub scale_sd: f64,
    /// Standard deviation of a segment's length for a known scale, median of the 13 segments, metres.
    pub own_sd_m: f64,
}

impl SequenceLengths {
    /// Source of the scale, as a word for tables.
    pub fn scale_name(&self) -> &'static str {
        match self.scale_from {
            None => "lengths",
            Some(ScaleFrom::BodyHeight) => "height",
            Some(ScaleFrom::Ground) => "ground",
            Some(ScaleFrom::Distance) => "distance",
            Some(ScaleFrom::Assumed) => "assumed",
        }
    }

    /// The anchor options for these lengths.
    pub(super) fn anchor_options(&self, options: &AnchorOptions) -> AnchorOptions {
        if self.scale_from.is_none() {
            return *options;
        }
        let mut own: Vec<f64> = self.lengths.named().zip(&self.sd_m).map(|((_, l), sd)| sd / l).collect();
        own.sort_by(f64::total_cmp);
        let own = (own[own.len() / 2].powi(2) - self.scale_sd.powi(2)).max(0.0).sqrt();
        AnchorOptions { scale_sd: self.scale_sd, length_sd: own.max(options.length_sd), ..*options }
    }

    fn given(lengths: SegmentLengths, scale_sd: f64) -> Self {
        let sd_m: Vec<f64> = lengths.named().map(|(_, l)| DEFAULT_LENGTH_SD_M.hypot(scale_sd * l)).collect();
        let origin = vec![LengthOrigin::Given; sd_m.len()];
        Self { lengths, sd_m, origin, scale_from: None, scale_sd, own_sd_m: DEFAULT_LENGTH_SD_M }
    }

    fn fitted(fit: &LengthFit) -> Self {
        let own = |e: &crate::posture::length::LengthEstimate| {
            (e.sd_m.powi(2) - (fit.scale_sd * e.length_m).powi(2)).max(0.0).sqrt()
        };
        let mut own_sd: Vec<f64> = fit.estimates.iter().take(13).map(own).collect();
        own_sd.sort_by(f64::total_cmp);
        Self {
            lengths: fit.lengths,
            sd_m: fit.estimates.iter().map(|e| e.sd_m).collect(),
            origin: fit.estimates.iter().map(|e| LengthOrigin::Estimated(e.basis)).collect(),
            scale_from: Some(fit.scale_from),
            scale_sd: fit.scale_sd,
            own_sd_m: own_sd[own_sd.len() / 2].max(DEFAULT_LENGTH_SD_M),
        }
    }

    /// From proportions alone. Limbs of people of the same height differ by some 8 %.
    fn of_prior(prior: &LengthPrior) -> Self {
        const SPREAD: f64 = crate::posture::length::SPREAD[0];
        let relative = SPREAD.hypot(prior.scale_sd);
        let sd_m: Vec<f64> = prior.lengths.named().map(|(_, l)| relative * l).collect();
        let mut own_sd: Vec<f64> = prior.lengths.to.0[1..].iter().map(|l| SPREAD * l).collect();
        own_sd.sort_by(f64::total_cmp);
        Self {
            lengths: prior.lengths,
            origin: vec![LengthOrigin::Estimated(LengthBasis::Prior); sd_m.len()],
            sd_m,
            scale_from: Some(prior.scale_from),
            scale_sd: prior.scale_sd,
            own_sd_m: own_sd[own_sd.len() / 2],
        }
    }
}

/// The given lengths; or lengths from the given or assumed height, refined by the sequence.
///
/// The scale of unknown lengths comes from given distances or from the ground. The ground is not used if the
/// caller chose trunk or head as the only source of the neck's distance, because then the ground is not trusted.
pub(super) fn find(
    rays: &[JointRays],
    ground: Option<&Ground>,
    options: &SequenceOptions,
    warnings: &mut Vec<Warning>,
) -> Result<SequenceLengths, SequenceError> {
    if let Some(lengths) = options.lengths {
        return Ok(SequenceLengths::given(lengths, options.anchor_options.scale_sd));
    }
    let prior = LengthPrior::from_height(options.height_m)?;
    let without_ground =
        matches!(options.anchor, AnchorChoice::Source(AnchorSource::Trunk | AnchorSource::Head));
    let ground = ground.filter(|_| !without_ground);
    let fit = match &options.anchor {
        AnchorChoice::Given { distance_m, sd_m } => {
            let anchors: Vec<Option<Anchor>> = rays
                .iter()
                .enumerate()
                .map(|(t, rays)| from_given(rays, distance_m[t.min(distance_m.len() - 1)], *sd_m).ok())
                .collect();
            estimate(rays, &anchors, ground.map(|g| g.up_in_camera), &prior, Some(ScaleFrom::Distance))
        }
        _ => {
            let from = |ground| estimate_from_sequence(rays, ground, &prior, &options.anchor_options);
            from(ground).or_else(|error| if ground.is_some() { from(None) } else { Err(error) })
        }
    };
    match fit {
        Ok(fit) => Ok(SequenceLengths::fitted(&fit)),
        Err(LengthFitError::Length(error)) => Err(error.into()),
        Err(error) => {
            warnings.push(Warning::LengthsNotSeen { reason: error.to_string() });
            Ok(SequenceLengths::of_prior(&prior))
        }
    }
}

/// Warns of segments that look longer than they can be at any position of the person.
///
/// A starting joint is at least as far from the camera as the neck less the segments between them. With the neck
/// three standard deviations nearer, and three standard deviations of noise, the segment's ray passes it at the
/// smallest possible distance. If this distance exceeds the length, no depth gives a posture.
pub(super) fn impossible(
    rays: &[JointRays],
    neck: &NeckTrack,
    lengths: &SequenceLengths,
    warnings: &mut Vec<Warning>,
) {
    let to = &lengths.lengths.to;
    for joint in Joint::ALL.into_iter().skip(1) {
        let start = joint.start().unwrap_or(Joint::Neck);
        let mut chain_m = 0.0;
        let mut link = start;
        while let Some(next) = link.start() {
            chain_m += to[link];
            link = next;
        }
        let mut seen = 0;
        let mut too_long = Vec::new();
        for (t, rays) in rays.iter().enumerate() {
            let nearest_m = neck.distance_m[t] - 3.0 * neck.sd_m[t] - chain_m;
            if nearest_m.is_nan() || !(rays.sees(start) && rays.sees(joint)) {
                continue;
            }
            seen += 1;
            let angle = rays.ray[start].angle_between(rays.ray[joint]);
            let noise = 3.0 * std::f64::consts::SQRT_2 * rays.noise_rad;
            let least_m = nearest_m.max(0.0) * (angle - noise).clamp(0.0, std::f64::consts::FRAC_PI_2).sin();
            if least_m > to[joint] {
                too_long.push(least_m);
            }
        }
        if !too_long.is_empty() {
            too_long.sort_by(f64::total_cmp);
            warnings.push(Warning::SegmentTooShort {
                segment: segment_name(joint),
                length_m: to[joint],
                seen_m: too_long[too_long.len() / 2],
                frames: too_long.len(),
                of: seen,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::*;
    use crate::model::skeleton::{JOINT_COUNT, PerJoint};
    use crate::posture::length::LengthEstimate;
    use crate::posture::sequence::NeckFrom;
    use crate::posture::sequence::example::{walk, with_lengths};

    /// A fit of segments with a scale known to 5 % and a standard deviation of 2 cm each.
    fn fit() -> LengthFit {
        let lengths = SegmentLengths::lee_chen();
        let estimate = |(segment, length_m): (String, f64)| LengthEstimate {
            segment,
            length_m,
            sd_m: 0.02f64.hypot(0.05 * length_m),
            basis: LengthBasis::Measured,
            seen_m: length_m,
        };
        LengthFit {
            estimates: lengths.named().map(estimate).collect(),
            lengths,
            sd_m: PerJoint([0.0; JOINT_COUNT]),
            scale: 1.0,
            scale_sd: 0.05,
            scale_from: ScaleFrom::Ground,
        }
    }

    #[test]
    fn the_scale_is_apart_from_what_each_length_has_of_its_own() {
        let fitted = SequenceLengths::fitted(&fit());
        assert!((fitted.own_sd_m - 0.02).abs() < 1e-12, "{}", fitted.own_sd_m);
        // The anchor options get the standard deviations of the scale and of single lengths.
        let options = AnchorOptions { scale_sd: 0.01, length_sd: 0.001, ..AnchorOptions::default() };
        let told = fitted.anchor_options(&options);
        assert_eq!(told.scale_sd, 0.05);
        let mut shares: Vec<f64> = fitted.lengths.named().map(|(_, l)| 0.02 / l).collect();
        shares.sort_by(f64::total_cmp);
        assert!((told.length_sd - shares[8]).abs() < 1e-9, "{}", told.length_sd);
        assert_eq!(fitted.anchor_options(&AnchorOptions { length_sd: 0.5, ..options }).length_sd, 0.5);
        let given = SequenceLengths::given(SegmentLengths::lee_chen(), 0.03);
        assert_eq!(given.anchor_options(&options), options);
        for ((_, length_m), sd_m) in given.lengths.named().zip(&given.sd_m) {
            assert!((sd_m * sd_m - 0.005f64.powi(2) - (0.03 * length_m).powi(2)).abs() < 1e-12);
        }
        assert_eq!(given.own_sd_m, 0.005);
    }

    /// For an adult of assumed height: 6 % for the scale and 8 % for each limb.
    #[test]
    fn proportions_alone_are_as_unsure_as_people_differ() {
        let prior = LengthPrior::from_height(None).unwrap();
        let found = SequenceLengths::of_prior(&prior);
        for ((_, length_m), sd_m) in found.lengths.named().zip(&found.sd_m) {
            assert!((sd_m / length_m - 0.1).abs() < 1e-12);
        }
        let mut lengths: Vec<f64> = prior.lengths.to.0[1..].to_vec();
        lengths.sort_by(f64::total_cmp);
        assert!((found.own_sd_m - 0.08 * lengths[6]).abs() < 1e-12);
        assert!(found.origin.iter().all(|origin| origin.name() == "proportions"));
    }

    #[test]
    fn the_scale_has_a_name_for_each_source() {
        let mut lengths = SequenceLengths::given(SegmentLengths::lee_chen(), 0.0);
        for (scale_from, name) in [
            (None, "lengths"),
            (Some(ScaleFrom::BodyHeight), "height"),
            (Some(ScaleFrom::Ground), "ground"),
            (Some(ScaleFrom::Distance), "distance"),
            (Some(ScaleFrom::Assumed), "assumed"),
        ] {
            lengths.scale_from = scale_from;
            assert_eq!(lengths.scale_name(), name);
        }
        let names = [LengthBasis::Measured, LengthBasis::Pooled, LengthBasis::Prior]
            .map(|basis| LengthOrigin::Estimated(basis).name());
        assert_eq!((names, LengthOrigin::Given.name()), (["measured", "other_side", "proportions"], "given"));
    }

    /// If no frame shows the legs, the ground gives no distance, but the trunk does.
    #[test]
    fn without_feet_on_the_ground_the_trunk_tells_the_lengths() {
        let mut walk = walk(45.0, 30, 0.5);
        for points in &mut walk.points_px {
            for joint in [Joint::RightKnee, Joint::LeftKnee, Joint::RightAnkle, Joint::LeftAnkle] {
                points[joint] = DVec2::NAN;
            }
        }
        let options = SequenceOptions { lengths: None, height_m: Some(1.61), ..with_lengths() };
        let found = walk.postures(&options).unwrap();
        let is_told = found.warnings.iter().any(|warning| matches!(warning, Warning::LengthsNotSeen { .. }));
        assert!(!is_told, "{:?}", found.warnings);
        assert_eq!(found.lengths.scale_name(), "height");
        assert!(found.lengths.origin.contains(&LengthOrigin::Estimated(LengthBasis::Measured)));
        // With trunk or head as the only source the ground is not used, even if feet are on it.
        let walk = walk_with_feet();
        for source in [AnchorSource::Trunk, AnchorSource::Head] {
            let anchor = AnchorChoice::Source(source);
            let options = SequenceOptions { lengths: None, height_m: None, anchor, ..with_lengths() };
            let found = walk.postures(&options).unwrap();
            assert_eq!(found.lengths.scale_name(), "assumed", "{source:?}");
        }
        let options = SequenceOptions { lengths: None, height_m: None, ..with_lengths() };
        assert_eq!(walk.postures(&options).unwrap().lengths.scale_name(), "ground");
    }

    fn walk_with_feet() -> crate::posture::sequence::example::Walk {
        let mut walk = walk(45.0, 30, 0.5);
        walk.head_points_px = Some((0..30).map(|t| walk.head_px(t)).collect());
        walk
    }

    /// A forearm seen at the angle that its length has at the smallest possible distance: one shoulder and one
    /// upper arm in front of the neck, which is three standard deviations nearer than found.
    #[test]
    fn a_segment_is_too_short_only_at_the_nearest_it_can_be() {
        let lengths = SequenceLengths::given(SegmentLengths::lee_chen(), 0.0);
        let to = lengths.lengths.to;
        let joint = Joint::RightWrist;
        let nearest_m = 4.0 - 3.0 * 0.1 - to[Joint::RightElbow] - to[Joint::RightShoulder];
        let (noise_rad, frames) = (0.002, 3);
        let noise = 3.0 * 2f64.sqrt() * noise_rad;
        for (factor, is_told) in [(0.99, false), (1.01, true)] {
            let angle = (factor * to[joint] / nearest_m).asin() + noise;
            let mut rays = JointRays::from_points(&PerJoint([DVec3::NAN; JOINT_COUNT]));
            rays.noise_rad = noise_rad;
            rays.ray[Joint::RightElbow] = DVec3::Z;
            rays.ray[joint] = DVec3::new(angle.sin(), 0.0, angle.cos());
            let neck = NeckTrack {
                distance_m: vec![4.0; frames],
                sd_m: vec![0.1; frames],
                from: vec![NeckFrom::Neighbours; frames],
                vague: vec![None; frames],
                conflicts: vec![],
                common_sd_m: 0.0,
                scale_sd: 0.0,
            };
            let mut warnings = Vec::new();
            impossible(&vec![rays; frames], &neck, &lengths, &mut warnings);
            assert_eq!(warnings.len(), usize::from(is_told), "{warnings:?}");
            if let Some(Warning::SegmentTooShort { segment, seen_m, frames: told, of, .. }) = warnings.first()
            {
                assert_eq!((segment.as_str(), *told, *of), ("right_elbow_to_right_wrist", frames, frames));
                assert!((seen_m - factor * to[joint]).abs() < 1e-9, "{seen_m}");
            }
        }
    }
}
