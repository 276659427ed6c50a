//! Segment lengths estimated from a sequence of one view, for people who were not measured.
//!
//! A segment is never seen longer than it is. With an approximate distance of the neck, the largest extents in
//! the images of a sequence are close to its length if it is once perpendicular to the viewing direction. Left
//! and right are assumed equal. These extents are combined with the proportions of the body (Drillis and Contini
//! 1966, by [`SegmentLengths::from_height`]) as a prior.
//!
//! Drillis and Contini give means only. The spreads of [`SPREAD`] are those of four motion-captured walkers about
//! these means; with four people they are rough. Segments that are never perpendicular to the viewing direction
//! (widths from the side, forearms from the front) keep the prior, and the result states this. The overall scale
//! is not visible in one view: it comes from body height, from the ground or a given distance, or is assumed
//! ([`ScaleFrom`]).

use crate::OptionError;
use crate::estimate::median::median;
use crate::wording::counted;
use glam::DVec3;
use thiserror::Error;

use super::anchor::{
    Anchor, AnchorError, AnchorOptions, Ground, from_ground, from_trunk, standing_scale, standing_span_m,
};
use super::lift::JointRays;
use crate::model::skeleton::{Joint, LengthError, PerJoint, RigidDistance, SegmentLengths};

/// Basis of a length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LengthBasis {
    /// The segment's own extents in the images, pooled with those of the other side.
    Measured,
    /// The extents of the other side alone.
    Pooled,
    /// The proportions of the body: the segment was not seen, or never perpendicular to the viewing direction.
    Prior,
}

/// Source of the scale of all lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ScaleFrom {
    /// The given body height.
    BodyHeight,
    /// The person's distance, from the feet on the ground.
    Ground,
    /// The given distance of the person.
    Distance,
    /// None: an adult of mean height is assumed.
    Assumed,
}

/// Prior of the lengths, before any image is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthPrior {
    /// The lengths.
    pub lengths: SegmentLengths,
    /// Relative standard deviation of their common scale.
    pub scale_sd: f64,
    /// Source of the scale.
    pub scale_from: ScaleFrom,
}

/// Assumed height of an adult, metres: between the means of women and men in most populations.
pub const ASSUMED_HEIGHT_M: f64 = 1.70;
/// Relative standard deviation of adult height over both sexes.
const ASSUMED_HEIGHT_SD: f64 = 0.06;
/// Relative standard deviation of the scale of a body of known height: between joint centres, from neck to ankle, men have
/// 79 % of their height and women 75 % (de Leva, J Biomech 29:1223, 1996).
const KNOWN_HEIGHT_SD: f64 = 0.03;

impl LengthPrior {
    /// The prior for a person of known height, or for an adult of [`ASSUMED_HEIGHT_M`].
    pub fn from_height(height_m: Option<f64>) -> Result<Self, LengthError> {
        let lengths = SegmentLengths::from_height(height_m.unwrap_or(ASSUMED_HEIGHT_M))?;
        Ok(match height_m {
            Some(_) => Self { lengths, scale_sd: KNOWN_HEIGHT_SD, scale_from: ScaleFrom::BodyHeight },
            None => Self { lengths, scale_sd: ASSUMED_HEIGHT_SD, scale_from: ScaleFrom::Assumed },
        })
    }
}

/// One length with its uncertainty and basis.
#[derive(Debug, Clone, PartialEq)]
pub struct LengthEstimate {
    /// The name, as in [`SegmentLengths::named`].
    pub segment: String,
    /// The length, metres.
    pub length_m: f64,
    /// Its standard deviation, metres, including that of the common scale.
    pub sd_m: f64,
    /// The basis of the length.
    pub basis: LengthBasis,
    /// The largest extent seen (80 % quantile, less the noise, both sides), metres; NaN if not seen.
    pub seen_m: f64,
}

/// Lengths estimated from a sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct LengthFit {
    /// The lengths.
    pub lengths: SegmentLengths,
    /// Each with its standard deviation and basis, in the order of [`SegmentLengths::named`].
    pub estimates: Vec<LengthEstimate>,
    /// Standard deviations of the 13 segments, metres, by ending joint; 0 at the neck.
    pub sd_m: PerJoint<f64>,
    /// The scale relative to the prior's lengths.
    pub scale: f64,
    /// Its relative standard deviation.
    pub scale_sd: f64,
    /// Source of the scale.
    pub scale_from: ScaleFrom,
}

impl LengthFit {
    /// Scales all lengths so that neck to sole is `scale` times that of the prior, with the standard deviation
    /// `scale_sd`.
    ///
    /// The height of a person on the ground and the distance that it implies determine each other: extents at a
    /// distance that is too large are too large, and longer legs put the neck farther away. With a known height
    /// extents give the proportions only.
    fn keep_height_of(&mut self, prior: &LengthPrior, (scale, scale_sd): (f64, f64)) {
        let factor = scale * standing_span_m(&prior.lengths) / standing_span_m(&self.lengths);
        self.lengths.to.0.iter_mut().chain(&mut self.lengths.rigid).for_each(|length_m| *length_m *= factor);
        self.scale *= factor;
        for estimate in &mut self.estimates {
            let own_sq = estimate.sd_m.powi(2) - (self.scale_sd * estimate.length_m).powi(2);
            estimate.length_m *= factor;
            estimate.sd_m = own_sq.max(0.0).sqrt().hypot(scale_sd * estimate.length_m);
        }
        for (joint, length_m) in Joint::ALL.into_iter().zip(self.lengths.to.0).skip(1) {
            let own_sq = self.sd_m[joint].powi(2) - (self.scale_sd * length_m / factor).powi(2);
            self.sd_m[joint] = own_sq.max(0.0).sqrt().hypot(scale_sd * length_m);
        }
        (self.scale_sd, self.scale_from) = (scale_sd, prior.scale_from);
    }
}

/// Scale and standard deviation of a body of known height, from the scale at which feet and neck are `seen`.
///
/// People of one height differ in their proportions, some of them much: the prior is Student's distribution with three
/// degrees of freedom about 1, so that a scale far from 1 is that which is seen.
fn scale_of_height(prior_sd: f64, seen: Option<(f64, f64)>) -> (f64, f64) {
    let Some((seen, seen_sd)) = seen else { return (1.0, prior_sd) };
    let weight = |scale: f64| {
        let (off, own) = ((scale - 1.0) / prior_sd, (scale - seen) / seen_sd);
        (-2.0 * (off * off / 3.0).ln_1p() - 0.5 * own * own).exp()
    };
    let nodes = (0..=200).map(|k| seen + 0.05 * seen_sd * f64::from(k - 100));
    let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
    for scale in nodes {
        let p = weight(scale);
        (total, first, second) = (total + p, first + p * scale, second + p * scale * scale);
    }
    let mean = first / total;
    if total > 0.0 { (mean, (second / total - mean * mean).max(0.0).sqrt()) } else { (1.0, prior_sd) }
}

/// Why no lengths were estimated.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LengthFitError {
    /// Too few frames have an anchor.
    #[error("lengths need at least {MIN_FRAMES} frames with a known distance of the neck, got {frames}")]
    TooFewFrames {
        /// Number of frames with an anchor.
        frames: usize,
    },
    /// There are not as many anchors as frames.
    #[error("{} but {}", counted(*frames, "frame"), counted(*anchors, "anchor"))]
    Counts {
        /// Number of frames.
        frames: usize,
        /// Number of anchors.
        anchors: usize,
    },
    /// No frame gave an anchor; the error of the last one.
    #[error("no frame gives the neck's distance: {0}")]
    NoAnchor(#[from] AnchorError),
    /// The prior's or the resulting lengths are not valid.
    #[error(transparent)]
    Length(#[from] LengthError),
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Minimum number of frames.
pub const MIN_FRAMES: usize = 5;
/// If a sequence is longer, this many evenly spaced frames are used to find distances.
const MOST_FRAMES: usize = 32;
/// Number of rounds of lengths and anchors.
const ROUNDS: usize = 3;

/// A group of segments of equal length, with its prior.
struct Group {
    pairs: &'static [[Joint; 2]],
    /// Relative standard deviation between persons of the same height.
    spread: f64,
    /// Probability that the segment is never perpendicular to the viewing direction in a sequence.
    hidden: f64,
    /// True if the scale of the body may be estimated from it.
    tells_scale: bool,
}

/// Relative spread between people of the same height: of limbs, of trunk and forearm, and of widths.
///
/// Root mean square deviations of four walkers from the means of Drillis and Contini: thigh 5 %, shank 12 %,
/// upper arm 7 %; forearm 23 % (two walkers have hinges instead of wrists) and neck to pelvis 24 % (the pelvis
/// joint is a convention); width of the shoulders 21 %, of the hips 24 %.
pub const SPREAD: [f64; 3] = [0.08, 0.20, 0.22];

const GROUPS: [Group; 10] = {
    use Joint::*;
    const fn group(pairs: &'static [[Joint; 2]], spread: f64, hidden: f64, tells_scale: bool) -> Group {
        Group { pairs, spread, hidden, tells_scale }
    }
    [
        group(&[[Neck, RightShoulder], [Neck, LeftShoulder]], SPREAD[2], 0.5, false),
        group(&[[Neck, Pelvis]], SPREAD[1], 0.1, false),
        group(&[[Pelvis, RightHip], [Pelvis, LeftHip]], SPREAD[2], 0.5, false),
        group(&[[RightShoulder, RightElbow], [LeftShoulder, LeftElbow]], SPREAD[0], 0.1, true),
        group(&[[RightElbow, RightWrist], [LeftElbow, LeftWrist]], SPREAD[1], 0.4, false),
        group(&[[RightHip, RightKnee], [LeftHip, LeftKnee]], SPREAD[0], 0.05, true),
        group(&[[RightKnee, RightAnkle], [LeftKnee, LeftAnkle]], SPREAD[0], 0.05, true),
        group(&[[RightShoulder, LeftShoulder]], SPREAD[2], 0.5, false),
        group(&[[RightShoulder, Pelvis], [LeftShoulder, Pelvis]], SPREAD[1], 0.3, false),
        group(&[[RightHip, LeftHip]], SPREAD[2], 0.5, false),
    ]
};

/// Mean foreshortening of a segment in its best views: tilts of up to 10 degrees.
const SHORTENING: f64 = 0.01;
/// Relative standard deviation of an extent, due to the depth of the segment, a few centimetres from the neck's.
const DEPTH_SD: f64 = 0.03;

/// Segment lengths from rays and distances of the neck.
///
/// `up` is the vertical in camera axes, if known. Joints are then assumed to lie in the vertical plane through
/// the neck that is perpendicular to the viewing direction; without `up`, in the plane perpendicular to the
/// neck's ray. `scale_in_anchors` is the source of the scale of anchors that do not depend on the prior's lengths
/// alone (ground or given distance; `None`: trunk).
pub fn estimate(
    rays: &[JointRays],
    anchors: &[Option<Anchor>],
    up: Option<DVec3>,
    prior: &LengthPrior,
    scale_in_anchors: Option<ScaleFrom>,
) -> Result<LengthFit, LengthFitError> {
    if rays.len() != anchors.len() {
        return Err(LengthFitError::Counts { frames: rays.len(), anchors: anchors.len() });
    }
    OptionError::unless_positive("the prior's scale_sd", prior.scale_sd)?;
    prior.lengths.validated()?;
    let frames: Vec<(&JointRays, &Anchor)> =
        rays.iter().zip(anchors).filter_map(|(r, a)| Some((r, a.as_ref()?))).collect();
    if frames.len() < MIN_FRAMES {
        return Err(LengthFitError::TooFewFrames { frames: frames.len() });
    }
    let scatter = frame_scatter(&frames);
    let seen: Vec<Vec<f64>> = GROUPS
        .iter()
        .map(|group| group.pairs.iter().map(|&pair| envelope(&frames, pair, up, scatter)).collect())
        .collect();
    let pooled: Vec<f64> = seen.iter().map(|sides| mean_of_seen(sides)).collect();
    let (scale, scale_sd) = match scale_in_anchors {
        Some(_) => scale_seen(&pooled, prior, relative_sd(&frames)),
        None => (1.0, prior.scale_sd),
    };
    let mut fit = LengthFit {
        lengths: prior.lengths,
        estimates: Vec::new(),
        sd_m: PerJoint::default(),
        scale,
        scale_sd,
        scale_from: scale_in_anchors.filter(|_| scale_sd < 0.8 * prior.scale_sd).unwrap_or(prior.scale_from),
    };
    for ((group, sides), pooled) in GROUPS.iter().zip(&seen).zip(&pooled) {
        let expected = scale * length_of(&prior.lengths, group.pairs[0]);
        let (length_m, own_sd) = posterior(expected, group, *pooled, scale_sd);
        let basis_of_pair = own_sd < 0.8 * group.spread * expected;
        for (&pair, seen_m) in group.pairs.iter().zip(sides) {
            let basis = match (basis_of_pair, seen_m.is_finite()) {
                (false, _) => LengthBasis::Prior,
                (true, true) => LengthBasis::Measured,
                (true, false) => LengthBasis::Pooled,
            };
            let sd_m = own_sd.hypot(scale_sd * length_m);
            set(
                &mut fit,
                pair,
                LengthEstimate { segment: String::new(), length_m, sd_m, basis, seen_m: *pooled },
            );
        }
    }
    let order: Vec<String> = fit.lengths.named().map(|(name, _)| name).collect();
    let place = |e: &LengthEstimate| order.iter().position(|name| *name == e.segment);
    fit.estimates.sort_by_key(place);
    fit.lengths = fit.lengths.validated()?;
    Ok(fit)
}

/// Estimates lengths and distances of the neck in turn, in a few rounds, because each depends on the other.
///
/// With the ground, anchors come from the feet on it and determine the scale. Without it, they come from the
/// trunk, and the scale is the prior's. Returns the lengths; compute anchors again with them and their
/// `scale_sd`.
pub fn estimate_from_sequence(
    rays: &[JointRays],
    ground: Option<&Ground>,
    prior: &LengthPrior,
    options: &AnchorOptions,
) -> Result<LengthFit, LengthFitError> {
    let step = rays.len().div_ceil(MOST_FRAMES).max(1);
    let rays: Vec<JointRays> = rays.iter().step_by(step).copied().collect();
    let up = ground.map(|g| g.up_in_camera);
    let mut lengths = prior.lengths;
    let mut options = AnchorOptions { scale_sd: prior.scale_sd, ..*options };
    let seen = ground.and_then(|ground| standing_scale(&rays, &prior.lengths, ground, &options));
    let scale = scale_of_height(prior.scale_sd, seen);
    let mut fit = None;
    for _ in 0..ROUNDS {
        let mut error = AnchorError::Empty;
        let anchors: Vec<Option<Anchor>> = rays
            .iter()
            .map(|rays| {
                let anchor = match ground {
                    Some(ground) => from_ground(rays, &lengths, ground, &options),
                    None => from_trunk(rays, &lengths, None, &options).map(|fit| fit.anchor),
                };
                anchor.map_err(|e| error = e).ok()
            })
            .collect();
        if anchors.iter().all(Option::is_none) {
            return Err(error.into());
        }
        let mut found = estimate(&rays, &anchors, up, prior, ground.map(|_| ScaleFrom::Ground))?;
        if ground.is_some() && prior.scale_from == ScaleFrom::BodyHeight {
            found.keep_height_of(prior, scale);
        }
        lengths = found.lengths;
        options.scale_sd = found.scale_sd;
        fit = Some(found);
    }
    fit.ok_or(LengthFitError::TooFewFrames { frames: rays.len() })
}

/// The largest extent of a segment over the frames: the 80 % quantile without the contribution of noise. NaN if
/// seen in fewer than [`MIN_FRAMES`].
///
/// Extents accumulate at their upper end, so the spread is taken only above the median: with u = (q80 - q50)/0.84
/// and the noise e of an extent, q50 + 0.84 sqrt(u² - e²). `scatter` is the relative scatter of the distances
/// from frame to frame.
fn envelope(frames: &[(&JointRays, &Anchor)], [a, b]: [Joint; 2], up: Option<DVec3>, scatter: f64) -> f64 {
    let mut noise_sq = 0.0;
    let mut extents: Vec<f64> = Vec::with_capacity(frames.len());
    for (rays, anchor) in frames {
        if !(rays.sees(a) && rays.sees(b)) {
            continue;
        }
        let neck_ray = anchor.neck.normalize();
        let across = up.map(|up| neck_ray - neck_ray.dot(up) * up).and_then(DVec3::try_normalize);
        let normal = across.unwrap_or(neck_ray);
        let depth = normal.dot(anchor.neck);
        let on_plane = |joint: Joint| rays.ray[joint] * (depth / normal.dot(rays.ray[joint]));
        let extent = on_plane(a).distance(on_plane(b));
        if extent.is_finite() {
            extents.push(extent);
            noise_sq += 2.0 * (rays.noise_rad * anchor.distance_m).powi(2) + (scatter * extent).powi(2);
        }
    }
    if extents.len() < MIN_FRAMES {
        return f64::NAN;
    }
    let count = extents.len() as f64;
    noise_sq /= count;
    extents.sort_by(f64::total_cmp);
    let quantile = |q: f64| extents[((count - 1.0) * q).round() as usize];
    let (middle, high) = (quantile(0.5), quantile(0.8));
    let spread = (high - middle) / 0.84;
    middle + 0.84 * (spread * spread - noise_sq).max(0.0).sqrt()
}

/// Relative standard deviation of the distances from frame to frame, without the steady motion.
fn frame_scatter(frames: &[(&JointRays, &Anchor)]) -> f64 {
    let steps: Vec<f64> = frames.windows(2).map(|w| (w[1].1.distance_m / w[0].1.distance_m).ln()).collect();
    let drift = median(&mut steps.clone()).unwrap_or(0.0);
    let mut off: Vec<f64> = steps.iter().map(|s| (s - drift).abs()).collect();
    median(&mut off).unwrap_or(0.0) * 1.4826 / std::f64::consts::SQRT_2
}

fn mean_of_seen(sides: &[f64]) -> f64 {
    let seen: Vec<f64> = sides.iter().copied().filter(|s| s.is_finite()).collect();
    seen.iter().sum::<f64>() / seen.len() as f64
}

/// Relative standard deviation of the distances, assumed common to all frames.
fn relative_sd(frames: &[(&JointRays, &Anchor)]) -> f64 {
    frames.iter().map(|(_, a)| a.sd_depth_m / a.distance_m).sum::<f64>() / frames.len() as f64
}

/// The scale from the prior and from segments that become perpendicular to the viewing direction.
fn scale_seen(pooled: &[f64], prior: &LengthPrior, distance_sd: f64) -> (f64, f64) {
    let ratios: Vec<(f64, f64)> = GROUPS
        .iter()
        .zip(pooled)
        .filter(|(group, seen)| group.tells_scale && seen.is_finite())
        .map(|(group, seen)| {
            let ratio = seen / (1.0 - SHORTENING) / length_of(&prior.lengths, group.pairs[0]);
            (ratio, (group.spread.powi(2) + DEPTH_SD * DEPTH_SD).recip())
        })
        .collect();
    let weight: f64 = ratios.iter().map(|r| r.1).sum();
    if weight <= 0.0 {
        return (1.0, prior.scale_sd);
    }
    let mean = ratios.iter().map(|r| r.0 * r.1).sum::<f64>() / weight;
    let measured = (1.0 / weight + distance_sd * distance_sd).recip();
    let known = prior.scale_sd.powi(-2);
    ((mean * measured + known) / (measured + known), (measured + known).sqrt().recip())
}

const GRID: usize = 400;

/// Mean and standard deviation of a length with this expected value and spread whose largest extent was `seen`.
///
/// The extent is the length times c, with the relative error [`DEPTH_SD`]. If the segment is once perpendicular
/// to the viewing direction, c = 1 - x with x exponential of mean [`SHORTENING`]; if it never is, c is uniform
/// below 1.
fn posterior(expected: f64, group: &Group, seen: f64, scale_sd: f64) -> (f64, f64) {
    let spread = group.spread.hypot(scale_sd);
    if !seen.is_finite() {
        return (expected, group.spread * expected);
    }
    let range = (expected * (1.0 - 4.0 * spread)).max(0.05 * expected)..expected * (1.0 + 4.0 * spread);
    let at = |i: usize| range.start + (range.end - range.start) * i as f64 / (GRID - 1) as f64;
    let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
    for length in (0..GRID).map(at) {
        let deviation = (length - expected) / (spread * expected);
        let p = (-0.5 * deviation * deviation).exp() * likelihood(seen / length, group.hidden) / length;
        total += p;
        first += p * length;
        second += p * length * length;
    }
    if total <= 0.0 {
        return (expected, group.spread * expected);
    }
    let mean = first / total;
    (mean, (second / total - mean * mean).max(0.0).sqrt())
}

/// Density of extent over length: a normal density of [`DEPTH_SD`] convolved with the foreshortening in six
/// steps.
fn likelihood(ratio: f64, hidden: f64) -> f64 {
    let normal = |x: f64| (-0.5 * (x / DEPTH_SD).powi(2)).exp() / DEPTH_SD / std::f64::consts::TAU.sqrt();
    // Quantiles of an exponential distribution at (i + 1/2)/6.
    let across: f64 =
        (0..6).map(|i| normal(ratio - 1.0 - SHORTENING * (1.0 - (f64::from(i) + 0.5) / 6.0).ln())).sum();
    let hidden_density = 1.0 / (1.0 + ((ratio - 1.0) / (0.6 * DEPTH_SD)).exp());
    (1.0 - hidden) * across / 6.0 + hidden * hidden_density
}

fn rigid_of([a, b]: [Joint; 2]) -> Option<RigidDistance> {
    RigidDistance::ALL.into_iter().find(|d| d.joints() == [a, b])
}

fn length_of(lengths: &SegmentLengths, pair: [Joint; 2]) -> f64 {
    rigid_of(pair).map_or(lengths.to[pair[1]], |d| lengths.rigid[d as usize])
}

fn set(fit: &mut LengthFit, pair: [Joint; 2], mut estimate: LengthEstimate) {
    match rigid_of(pair) {
        Some(distance) => {
            fit.lengths.rigid[distance as usize] = estimate.length_m;
            estimate.segment = distance.name().to_owned();
        }
        None => {
            fit.lengths.to[pair[1]] = estimate.length_m;
            fit.sd_m[pair[1]] = estimate.sd_m;
            estimate.segment = crate::model::skeleton::segment_name(pair[1]);
        }
    }
    fit.estimates.push(estimate);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_segment_belongs_to_one_group() {
        let lengths = SegmentLengths::lee_chen();
        let count: usize = GROUPS.iter().map(|g| g.pairs.len()).sum();
        assert_eq!(count, lengths.named().count());
        for group in &GROUPS {
            for &pair in group.pairs {
                assert!(rigid_of(pair).is_some() || pair[1].start() == Some(pair[0]), "{pair:?}");
                assert_eq!(length_of(&lengths, pair), length_of(&lengths, group.pairs[0]));
            }
        }
    }

    #[test]
    fn a_length_seen_across_is_taken_and_one_hidden_is_not() {
        let thigh = &GROUPS[5];
        let (length, sd) = posterior(0.40, thigh, 0.43, 0.02);
        assert!((length - 0.434).abs() < 0.008 && sd < 0.015, "{length} {sd}");
        let width = &GROUPS[7];
        let (length, sd) = posterior(0.38, width, 0.10, 0.02);
        assert!((length - 0.38).abs() < 0.04 && sd > 0.05, "{length} {sd}");
        // Nothing is shorter than its extent in the image.
        let (length, _) = posterior(0.38, width, 0.45, 0.02);
        assert!(length > 0.44, "{length}");
    }

    #[test]
    fn too_little_is_refused() {
        let prior = LengthPrior::from_height(Some(1.75)).unwrap();
        assert_eq!(estimate(&[], &[], None, &prior, None), Err(LengthFitError::TooFewFrames { frames: 0 }));
        let options = AnchorOptions::default();
        assert!(matches!(
            estimate_from_sequence(&[], None, &prior, &options),
            Err(LengthFitError::NoAnchor(AnchorError::Empty))
        ));
        assert!(LengthPrior::from_height(Some(175.0)).is_err());
    }

    /// A segment perpendicular to the viewing direction in front of a person 5 m away, with this extent in each
    /// frame.
    fn seen(extents: &[f64], noise_rad: f64, pitch_rad: f64, lean_rad: f64) -> (Vec<JointRays>, Vec<Anchor>) {
        use crate::posture::anchor::from_given;
        let frame = |extent: &f64| {
            // Camera axes rotated about x: for a camera that looks down, the vertical is tilted.
            let turn = glam::DMat3::from_rotation_x(pitch_rad);
            let neck = turn * DVec3::new(0.0, -0.4, 5.0);
            let along = turn * DVec3::new(lean_rad.sin(), lean_rad.cos(), 0.0);
            let knee = neck + turn * DVec3::new(0.1, 0.9, 0.0);
            let mut rays = JointRays::from_points(&PerJoint([DVec3::NAN; 14]));
            rays.noise_rad = noise_rad;
            rays.ray[Joint::Neck] = neck.normalize();
            rays.ray[Joint::RightKnee] = knee.normalize();
            rays.ray[Joint::RightAnkle] = (knee + *extent * along).normalize();
            let anchor = from_given(&rays, neck.length(), 0.1).unwrap();
            (rays, anchor)
        };
        extents.iter().map(frame).unzip()
    }

    /// The largest of extents that have a spread of 3 cm and noise of 3 cm: 0.84 of the spread above the median.
    /// Near 1, the prior counts as a normal one does; far from it, what is seen.
    #[test]
    fn unusual_proportions_are_taken_as_they_are_seen() {
        assert_eq!(scale_of_height(0.02, None), (1.0, 0.02));
        let (near, near_sd) = scale_of_height(0.02, Some((1.01, 0.02)));
        assert!((1.004..1.007).contains(&near) && (0.011..0.016).contains(&near_sd), "{near} {near_sd}");
        for far in [0.85, 1.15] {
            let (scale, sd) = scale_of_height(0.02, Some((far, 0.02)));
            assert!((scale - far).abs() < 0.014 && (0.018..0.022).contains(&sd), "{scale} {sd}");
        }
        let (vague, vague_sd) = scale_of_height(0.02, Some((1.2, 0.5)));
        assert!((vague - 1.0).abs() < 0.02 && vague_sd < 0.05, "{vague} {vague_sd}");
    }

    #[test]
    fn noise_does_not_lengthen_a_segment() {
        use crate::synth::Random;
        let mut random = Random::new(3);
        let mut normal = || f64::from(random.normal_pair()[0]);
        let extents: Vec<f64> = (0..4000).map(|_| 0.4 + 0.03 * normal() + 0.03 * normal()).collect();
        let pair = [Joint::RightKnee, Joint::RightAnkle];
        let of = |noise_rad: f64, scatter: f64| {
            let (rays, anchors) = seen(&extents, noise_rad, 0.0, 0.0);
            let frames: Vec<(&JointRays, &Anchor)> = rays.iter().zip(&anchors).collect();
            envelope(&frames, pair, Some(DVec3::NEG_Y), scatter)
        };
        // Noise of two points: sqrt 2 times 5.016 m times the angle is 3 cm.
        let noise_rad = 0.03 / 2f64.sqrt() / DVec3::new(0.0, -0.4, 5.0).length();
        let quiet = of(0.0, 0.0);
        assert!((quiet - 0.4 - 0.84 * 0.03 * 2f64.sqrt()).abs() < 0.004, "{quiet}");
        let noisy = of(noise_rad, 0.0);
        assert!((noisy - 0.4 - 0.84 * 0.03).abs() < 0.004, "{noisy}");
        // Distances that scatter by 7.5 % give 3 cm of 40 cm too.
        let scattered = of(0.0, 0.075);
        assert!((scattered - 0.4 - 0.84 * 0.03).abs() < 0.004, "{scattered}");
        assert!(envelope(&[], pair, None, 0.0).is_nan());
    }

    /// If the vertical is known, joints in the vertical plane through the neck are seen at full length.
    #[test]
    fn a_camera_that_looks_down_sees_upright_segments_in_full() {
        for (pitch_rad, lean_rad) in [(0.5f64, 0.0), (0.5, 0.7), (-0.3, 0.4)] {
            let (rays, anchors) = seen(&[0.4; 8], 0.0, pitch_rad, lean_rad);
            let frames: Vec<(&JointRays, &Anchor)> = rays.iter().zip(&anchors).collect();
            let up = glam::DMat3::from_rotation_x(pitch_rad) * DVec3::NEG_Y;
            let extent = envelope(&frames, [Joint::RightKnee, Joint::RightAnkle], Some(up), 0.0);
            assert!((extent - 0.4).abs() < 1e-9, "{pitch_rad} {extent}");
        }
    }

    /// Distances that scatter by 3 % from frame to frame about a steady approach.
    #[test]
    fn scatter_from_frame_to_frame_is_told_from_the_walk() {
        use crate::posture::anchor::from_given;
        use crate::synth::Random;
        let mut random = Random::new(5);
        let (rays, _) = seen(&[0.4; 2000], 0.0, 0.0, 0.0);
        let anchors: Vec<Anchor> = (0..2000)
            .map(|t| {
                let noise = 1.0 + 0.03 * f64::from(random.normal_pair()[0]);
                from_given(&rays[t], 9.0 * 0.9995f64.powi(t as i32) * noise, 0.1).unwrap()
            })
            .collect();
        let frames: Vec<(&JointRays, &Anchor)> = rays.iter().zip(&anchors).collect();
        let scatter = frame_scatter(&frames);
        assert!((scatter / 0.03 - 1.0).abs() < 0.08, "{scatter}");
        assert!((relative_sd(&frames[..1]) - 0.1 / anchors[0].distance_m).abs() < 1e-12);
    }

    /// Three limbs with 8 % spread and 3 % depth error each, seen a tenth longer than expected, with one per cent
    /// foreshortening as in the best views; distances known to 2 %; the height assumed to 6 %.
    #[test]
    fn the_scale_is_that_of_the_limbs_and_of_the_prior() {
        let prior = LengthPrior::from_height(None).unwrap();
        assert_eq!((prior.scale_sd, LengthPrior::from_height(Some(1.7)).unwrap().scale_sd), (0.06, 0.03));
        let pooled: Vec<f64> =
            GROUPS.iter().map(|g| 1.1 * 0.99 * length_of(&prior.lengths, g.pairs[0])).collect();
        let (scale, sd) = scale_seen(&pooled, &prior, 0.02);
        let each = 1.0 / (0.08f64.powi(2) + 0.03f64.powi(2));
        let measured = 1.0 / (1.0 / (3.0 * each) + 0.02f64.powi(2));
        let known = 1.0 / 0.06f64.powi(2);
        assert!((sd - (measured + known).sqrt().recip()).abs() < 1e-12, "{sd}");
        assert!((scale - (1.1 * measured + known) / (measured + known)).abs() < 1e-9, "{scale}");
        assert_eq!(scale_seen(&[f64::NAN; 10], &prior, 0.02), (1.0, 0.06));
        // Widths and forearms vary too much between people to determine the scale.
        let telling: Vec<usize> = (0..10).filter(|&i| GROUPS[i].tells_scale).collect();
        assert_eq!(telling, [3, 5, 6]);
    }

    /// A shank seen in 20 frames on one side only: measured on that side, pooled on the other; the rest by
    /// proportion.
    #[test]
    fn lengths_say_what_they_rest_on() {
        let prior = LengthPrior::from_height(Some(1.75)).unwrap();
        let shank = length_of(&prior.lengths, [Joint::RightKnee, Joint::RightAnkle]);
        let (rays, anchors) = seen(&[1.05 * shank; 20], 0.0, 0.0, 0.0);
        let anchors: Vec<Option<Anchor>> = anchors.into_iter().map(Some).collect();
        let up = Some(DVec3::NEG_Y);
        let fit = estimate(&rays, &anchors, up, &prior, None).unwrap();
        let of = |name: &str| fit.estimates.iter().find(|e| e.segment == name).unwrap();
        let [right, left] = ["right_knee_to_right_ankle", "left_knee_to_left_ankle"].map(of);
        assert_eq!((right.basis, left.basis), (LengthBasis::Measured, LengthBasis::Pooled));
        assert_eq!(right.length_m, left.length_m);
        assert!((right.length_m / shank - 1.05).abs() < 0.03, "{}", right.length_m);
        let thigh = of("right_hip_to_right_knee");
        assert_eq!(thigh.basis, LengthBasis::Prior);
        // From the 8 % between people and the 3 % for a known height.
        let expected = thigh.length_m * 0.08f64.hypot(0.03);
        assert!((thigh.sd_m - expected).abs() < 1e-9, "{}", thigh.sd_m);
        assert!(right.sd_m > 0.02 * right.length_m && right.sd_m < 0.065 * right.length_m, "{}", right.sd_m);
        assert_eq!((fit.scale, fit.scale_sd, fit.scale_from), (1.0, 0.03, ScaleFrom::BodyHeight));
        assert_eq!(fit.sd_m[Joint::RightAnkle], right.sd_m);
        // A scale that is no more certain than the prior is the prior's, whatever its source would be.
        let again = estimate(&rays, &anchors, up, &prior, Some(ScaleFrom::Ground)).unwrap();
        assert_eq!(again.scale_from, ScaleFrom::BodyHeight);
        let assumed = LengthPrior::from_height(None).unwrap();
        let again =
            estimate(&rays, &anchors, up, &LengthPrior { scale_sd: 0.3, ..assumed }, Some(ScaleFrom::Ground));
        assert_eq!(again.unwrap().scale_from, ScaleFrom::Ground);
    }

    /// Compares the posterior of a length with one sampled from the same model: the spread over people, then the
    /// angle of the segment to the viewing direction, its depth relative to the neck, or never perpendicular.
    #[test]
    fn a_posterior_is_that_of_drawn_people() {
        use crate::synth::Random;
        let mut random = Random::new(12);
        let group = &GROUPS[4];
        let (expected, seen_m) = (0.26, 0.25);
        let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
        for _ in 0..400_000 {
            let [a, b] = random.normal_pair().map(f64::from);
            let length = expected * (1.0 + group.spread * a);
            let is_hidden = random.uniform(0.0, 1.0) < group.hidden;
            let tilt = -SHORTENING * -random.uniform(1e-9, 1.0).ln();
            let ratio = if is_hidden { random.uniform(0.0, 1.0) } else { 1.0 + tilt } + DEPTH_SD * b;
            if length > 0.0 && (ratio * length - seen_m).abs() < 0.002 {
                (total, first, second) = (total + 1.0, first + length, second + length * length);
            }
        }
        let (mean, sd) = posterior(expected, group, seen_m, 0.0);
        let drawn = first / total;
        let drawn_sd = f64::sqrt(second / total - drawn * drawn);
        assert!((mean - drawn).abs() < 0.003, "{mean} {drawn}");
        assert!((sd / drawn_sd - 1.0).abs() < 0.1, "{sd} {drawn_sd}");
    }
}
