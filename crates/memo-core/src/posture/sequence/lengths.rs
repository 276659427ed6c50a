//! Lengths of a sequence: given, or by height and proportions refined by what is seen.

use super::{AnchorChoice, SequenceError, SequenceOptions, Warning};
use crate::posture::anchor::{Anchor, AnchorOptions, AnchorSource, Ground, from_given};
use crate::posture::length::{
    LengthBasis, LengthFit, LengthFitError, LengthPrior, ScaleFrom, estimate, estimate_from_sequence,
};
use crate::posture::lift::JointRays;
use crate::posture::sequence::NeckTrack;
use crate::posture::skeleton::{Joint, SegmentLengths, segment_name};
use crate::posture::tree::DEFAULT_LENGTH_SD_M;

/// What a length rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LengthOrigin {
    /// It was given.
    Given,
    /// It was estimated.
    Estimated(LengthBasis),
}

impl LengthOrigin {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Estimated(LengthBasis::Measured) => "measured",
            Self::Estimated(LengthBasis::Pooled) => "other_side",
            Self::Estimated(LengthBasis::Prior) => "proportions",
        }
    }
}

/// The lengths that were used.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceLengths {
    /// The lengths.
    pub lengths: SegmentLengths,
    /// Standard deviation of each, the common scale included, metres, in the order of
    /// [`SegmentLengths::named`].
    pub sd_m: Vec<f64>,
    /// What each rests on, in that order.
    pub origin: Vec<LengthOrigin>,
    /// Where their scale comes from; none where they were given.
    pub scale_from: Option<ScaleFrom>,
    /// Relative standard deviation of the scale.
    pub scale_sd: f64,
    /// Standard deviation of a segment's length about the scale, median of the 13 segments, metres.
    pub own_sd_m: f64,
}

impl SequenceLengths {
    /// Where the scale comes from, in a word.
    pub fn scale_name(&self) -> &'static str {
        match self.scale_from {
            None => "lengths",
            Some(ScaleFrom::BodyHeight) => "height",
            Some(ScaleFrom::Ground) => "ground",
            Some(ScaleFrom::Distance) => "distance",
            Some(ScaleFrom::Assumed) => "assumed",
        }
    }

    /// What the sources of the neck's distance have to know of these lengths.
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

    /// Proportions alone. Limbs of people of one height differ by some 8 %.
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

/// Lengths given; or from the height, or an assumed one, refined by the sequence.
///
/// Given distances tell the scale of unknown lengths, and so does the ground, unless the neck is to be found
/// from trunk or head alone: who asks for these does not trust the ground.
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

/// Reports segments that look longer than they are wherever the person stands.
///
/// A starting joint is at least as far from the camera as the neck less the segments between them, so with
/// the neck three standard deviations nearer and three of noise the segment's ray passes it at the least
/// distance that can be; where that exceeds the length, no depth has a posture.
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
