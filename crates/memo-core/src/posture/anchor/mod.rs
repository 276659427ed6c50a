//! The anchor: the neck's position along its ray, from which all other joints are found.
//!
//! Lee and Chen (1985, section 2.1) compute it from six points of the head. A head is small, so its depth is not
//! accurate. This module adds a given distance, the ground under the feet for a calibrated camera ([`from_ground`]),
//! the rigid trunk ([`from_trunk`]) and the extent from neck to feet ([`from_extent`]). Each source gives a standard
//! deviation. [`combine`] combines them, and [`smooth`] filters them over time.
//!
//! Distances are along the neck's unit ray from the centre of projection, not along z. All sources except a given
//! distance depend on segment lengths; only the ground and a given distance determine the scale of these lengths.
//! For [`from_ground`], the feet must be on the ground z = 0: a beam or a step under them shifts the neck.
//!
//! The posture constants ([`AnchorOptions`]) were measured on four walks of motion capture. The neck is above the
//! lower ankle by 0.963-0.982 of trunk, thigh and shank together (standard deviation within a walk 0.005-0.012),
//! and above the middle of the ankles by 0.930-0.954 (0.013-0.022). The trunk leans forward by -1 to 12 degrees.
//! The lower ankle is 6-8 cm above the ground, 0.15-0.21 of the shank; drawn people in shoes have 8-10 cm. Sitting, bending and jumping violate these
//! assumptions; once it is known which way a person faces, [`Bending`] replaces them by those for people who bend.

mod ground;
mod track;
mod trunk;

use crate::wording::counted;
use glam::DVec3;
use thiserror::Error;

use super::lift::JointRays;
use super::prior::{Balance, Lean};
use crate::model::camera::Camera;
use crate::model::skeleton::{Joint, SegmentLengths, Side};

pub use ground::{from_ground, standing_scale};
pub use track::{DepthTrack, SmoothOptions, smooth};
#[cfg(test)]
pub(super) use trunk::rigid_trunk;
pub use trunk::{TrunkAttitude, TrunkFit, from_trunk};

/// Source of an anchor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum AnchorSource {
    /// A distance given by the caller.
    Given,
    /// The feature points of the head.
    Head,
    /// Ankles above the known ground, and the chain of segments up to the neck.
    Ground,
    /// The rigid trunk.
    Trunk,
    /// The angle between neck and ankles, compared with the sum of the lengths.
    Extent,
    /// Several of these, weighted by their variances.
    Combined,
}

impl AnchorSource {
    /// All sources.
    pub const ALL: [Self; 6] =
        [Self::Given, Self::Head, Self::Ground, Self::Trunk, Self::Extent, Self::Combined];

    /// The source of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|source| source.name() == name)
    }

    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Head => "head",
            Self::Ground => "ground",
            Self::Trunk => "trunk",
            Self::Extent => "extent",
            Self::Combined => "combined",
        }
    }
}

/// One of several distances that fit a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthMode {
    /// Distance along the neck's ray, metres.
    pub distance_m: f64,
    /// Standard deviation about it, metres, including that of the lengths.
    pub sd_m: f64,
    /// Probability of this mode, 0 to 1.
    pub probability: f64,
}

/// The neck's position with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchor {
    /// Position of the neck on its ray, camera axes, metres.
    pub neck: DVec3,
    /// Its distance along the ray, metres.
    pub distance_m: f64,
    /// Standard deviation of that distance, metres, over all modes.
    pub sd_depth_m: f64,
    /// The part of `sd_depth_m` that is due to the scale of all lengths, metres. It is the same in every frame
    /// and in every source that depends on lengths.
    pub sd_scale_m: f64,
    /// Source of the anchor.
    pub source: AnchorSource,
    /// The separate distances that the frame allows, most probable first. Mirror attitudes of the trunk are in
    /// [`TrunkFit::attitudes`].
    pub modes: Vec<DepthMode>,
}

impl Anchor {
    /// An anchor of one mode on a unit ray.
    fn single(ray: DVec3, distance_m: f64, sd_m: f64, sd_scale_m: f64, source: AnchorSource) -> Self {
        let modes = vec![DepthMode { distance_m, sd_m, probability: 1.0 }];
        Self { neck: ray * distance_m, distance_m, sd_depth_m: sd_m, sd_scale_m, source, modes }
    }
}

/// Why there is no anchor.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum AnchorError {
    /// A quantity is not a positive number.
    #[error("{what} must be positive and finite, got {value}")]
    NotPositive {
        /// Its name.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The frame does not show the joints that the source needs.
    #[error("no neck from the {}: {missing} not seen", source_name.name())]
    NotSeen {
        /// The source.
        source_name: AnchorSource,
        /// The missing joints.
        missing: &'static str,
    },
    /// No distance fits the image.
    #[error("no neck from the {}: no distance{} fits", source_name.name(), between(*nearest_m, *farthest_m))]
    NothingFits {
        /// The source.
        source_name: AnchorSource,
        /// Nearest distance tried, metres.
        nearest_m: f64,
        /// Farthest distance tried, metres.
        farthest_m: f64,
    },
    /// The feet are above the neck.
    #[error("no neck from the {}: the figure is upside down in this camera, feet above the neck", source_name.name())]
    UpsideDown {
        /// The source.
        source_name: AnchorSource,
    },
    /// There is nothing to combine or to smooth.
    #[error("no anchor given")]
    Empty,
    /// Anchors on different rays cannot be combined.
    #[error("anchors lie on different rays, {angle_deg:.2} degrees apart")]
    DifferentRays {
        /// The angle between the rays, degrees.
        angle_deg: f64,
    },
    /// There are not as many anchors as times.
    #[error("{} but {}", counted(*times, "time"), counted(*anchors, "anchor"))]
    Counts {
        /// Number of times.
        times: usize,
        /// Number of anchors.
        anchors: usize,
    },
    /// The times do not increase.
    #[error("times must be finite and increase, got {before_s} s then {after_s} s at frame {frame}")]
    Times {
        /// The frame of the later time.
        frame: usize,
        /// The earlier time, seconds.
        before_s: f64,
        /// The later time, seconds.
        after_s: f64,
    },
}

/// The range of distances tried, if it is a range.
fn between(nearest_m: f64, farthest_m: f64) -> String {
    if farthest_m.is_finite() {
        format!(" between {nearest_m:.2} and {farthest_m:.2} m")
    } else {
        String::new()
    }
}

/// The ground and the vertical in camera axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Unit vector upward, camera axes.
    pub up_in_camera: DVec3,
    /// Height of the centre of projection above the ground, metres.
    pub camera_height_m: f64,
}

impl Ground {
    /// The plane z = 0 of a camera's world.
    pub fn of(camera: &Camera) -> Self {
        Self { up_in_camera: camera.rotation.z_axis, camera_height_m: camera.position().z }
    }

    /// Height of a point in camera axes, metres.
    pub fn height_m(&self, point_in_camera: DVec3) -> f64 {
        self.camera_height_m + self.up_in_camera.dot(point_in_camera)
    }
}

/// Assumptions about posture and lengths; the defaults are for standing and walking (see the head of the module).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnchorOptions {
    /// Relative standard deviation of the scale of all lengths. Default 0.02: lengths measured on the person.
    pub scale_sd: f64,
    /// Relative standard deviation of a single length for a known scale.
    pub length_sd: f64,
    /// Standard deviation of a joint relative to the rigid trunk, metres: hips and shoulders rotate relative to
    /// each other.
    pub rigidity_sd_m: f64,
    /// Standard deviation of the trunk's lean from the vertical, radians, per direction.
    pub lean_sd_rad: f64,
    /// Height of the supporting ankle above the ground, as a share of the shank.
    pub ankle_height_over_shank: f64,
    /// Its standard deviation, metres.
    pub ankle_height_sd_m: f64,
    /// Height of the higher ankle above the lower, root mean square, metres.
    pub swing_height_m: f64,
    /// Standard deviation of the horizontal distance of the neck from the middle of the ankles, per direction,
    /// metres.
    pub balance_sd_m: f64,
    /// Instead of an upright person, one who may bend. Used by [`from_ground`] and [`from_trunk`].
    pub bending: Option<Bending>,
}

/// A person who may bend, of whom it is known which way the front is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bending {
    /// Horizontal unit vector to the person's front, camera axes.
    pub front: DVec3,
    /// Lean of the trunk.
    pub lean: Lean,
    /// Balance above the feet.
    pub balance: Balance,
}

impl Default for AnchorOptions {
    fn default() -> Self {
        Self {
            scale_sd: 0.02,
            length_sd: 0.02,
            rigidity_sd_m: 0.01,
            lean_sd_rad: 7f64.to_radians(),
            ankle_height_over_shank: 0.18,
            ankle_height_sd_m: 0.02,
            swing_height_m: 0.09,
            balance_sd_m: 0.12,
            bending: None,
        }
    }
}

impl AnchorOptions {
    /// An error for values that are not positive numbers. The scale's deviation may be 0.
    fn check(&self) -> Result<(), AnchorError> {
        positive("length_sd", self.length_sd)?;
        positive("rigidity_sd_m", self.rigidity_sd_m)?;
        positive("lean_sd_rad", self.lean_sd_rad)?;
        positive("ankle_height_over_shank", self.ankle_height_over_shank)?;
        positive("ankle_height_sd_m", self.ankle_height_sd_m)?;
        positive("swing_height_m", self.swing_height_m)?;
        positive("balance_sd_m", self.balance_sd_m)?;
        if let Some(Bending { front, lean, balance }) = self.bending {
            positive("length of bending.front", front.length())?;
            positive("bending.lean.backward_sd_rad", lean.backward_sd_rad)?;
            positive("bending.lean.forward_sd_rad", lean.forward_sd_rad)?;
            positive("bending.balance.sd_m", balance.sd_m)?;
        }
        if self.scale_sd == 0.0 { Ok(()) } else { positive("scale_sd", self.scale_sd) }
    }
}

fn positive(what: &'static str, value: f64) -> Result<(), AnchorError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(AnchorError::NotPositive { what, value }) }
}

/// Checks of every source: valid lengths and noise. Returns the neck's ray.
fn neck_ray(rays: &JointRays, source_name: AnchorSource) -> Result<DVec3, AnchorError> {
    if !(rays.noise_rad >= 0.0 && rays.noise_rad.is_finite()) {
        return Err(AnchorError::NotPositive { what: "noise_rad", value: rays.noise_rad });
    }
    if !rays.sees(Joint::Neck) {
        return Err(AnchorError::NotSeen { source_name, missing: "neck" });
    }
    Ok(rays.ray[Joint::Neck])
}

fn check_lengths(lengths: &SegmentLengths) -> Result<(), AnchorError> {
    let bad = lengths.named().find(|(_, l)| !(*l > 0.0 && l.is_finite()));
    bad.map_or(Ok(()), |(_, value)| Err(AnchorError::NotPositive { what: "a segment length", value }))
}

/// Checks an upward direction and normalises it.
fn check_up(up: DVec3) -> Result<DVec3, AnchorError> {
    let length = up.length();
    positive("length of the vector upwards", length)?;
    Ok(up / length)
}

/// The anchor at a known distance along the neck's ray.
pub fn from_given(rays: &JointRays, distance_m: f64, sd_m: f64) -> Result<Anchor, AnchorError> {
    let ray = neck_ray(rays, AnchorSource::Given)?;
    positive("distance_m", distance_m)?;
    positive("sd_m", sd_m)?;
    Ok(Anchor::single(ray, distance_m, sd_m, 0.0, AnchorSource::Given))
}

/// Height of the neck above the middle of the ankles, divided by trunk, thigh and shank together: mean and
/// standard deviation over four walks and their walkers.
const RISE_OVER_MIDDLE: (f64, f64) = (0.943, 0.022);
/// The same above a single visible ankle, which may be the lower or the higher one.
const RISE_OVER_ONE: (f64, f64) = (0.95, 0.035);
/// Horizontal distance of one ankle from the neck, standard deviation, metres.
const ONE_ANKLE_OFFSET_M: f64 = 0.17;
/// Standard deviation of the tilt of the line from neck to ankles against the image plane if the vertical is not
/// known, radians.
const UNKNOWN_TILT_RAD: f64 = 0.26;

/// The anchor from the angle between neck and ankles. It has a large standard deviation and is for standing and
/// walking.
///
/// With unit rays n and f to the neck and to the middle of the ankles, rise s and a horizontal offset o of
/// mean 0:
///
/// ```text
/// k n - k_f f = s up + o     =>     k = w·(s up + o),   w = the row of the pseudo-inverse of (n, -f) for k
/// ```
///
/// `up` is the vertical in camera axes. Without it, the line from neck to feet is assumed perpendicular to the
/// viewing direction within 15 degrees.
pub fn from_extent(
    rays: &JointRays,
    lengths: &SegmentLengths,
    up: Option<DVec3>,
    options: &AnchorOptions,
) -> Result<Anchor, AnchorError> {
    let n = neck_ray(rays, AnchorSource::Extent)?;
    check_lengths(lengths)?;
    options.check()?;
    let ankles: Vec<DVec3> =
        Side::BOTH.into_iter().map(|s| rays.ray[s.ankle()]).filter(|r| r.is_finite()).collect();
    let ((ratio, ratio_sd), mut offset_sd) = match ankles.len() {
        0 => return Err(AnchorError::NotSeen { source_name: AnchorSource::Extent, missing: "both ankles" }),
        1 => (RISE_OVER_ONE, ONE_ANKLE_OFFSET_M),
        _ => (RISE_OVER_MIDDLE, options.balance_sd_m),
    };
    let f = ankles.iter().sum::<DVec3>().normalize();
    let span = standing_span_m(lengths);
    let rise = ratio * span;
    let up = match up {
        Some(up) => check_up(up)?,
        None => {
            offset_sd = offset_sd.hypot(UNKNOWN_TILT_RAD * rise);
            (n - f).try_normalize().unwrap_or(DVec3::NAN)
        }
    };
    // Pseudo-inverse of the 3x2 matrix (n, -f) of unit columns: its first row is (n - c f)/(1 - c²), c = n·f.
    let c = n.dot(f);
    let w = (n - c * f) / ((1.0 - c) * (1.0 + c));
    let distance_m = rise * w.dot(up);
    if distance_m < 0.0 {
        return Err(AnchorError::UpsideDown { source_name: AnchorSource::Extent });
    }
    positive("distance of the neck by the extent", distance_m)?;
    let across = (w.length_squared() - w.dot(up).powi(2)).max(0.0).sqrt();
    let scale = distance_m * options.scale_sd;
    let parts = [
        ratio_sd * span * w.dot(up),
        offset_sd * across,
        // The neck's point and the mean of two ankles: 1 + 1/2.
        1.5f64.sqrt() * rays.noise_rad * distance_m * w.length(),
        scale,
    ];
    let sd = parts.into_iter().fold(0.0, f64::hypot);
    Ok(Anchor::single(n, distance_m, sd, scale, AnchorSource::Extent))
}

/// Trunk (neck to hips), thigh and shank in a line, metres.
pub(super) fn standing_span_m(lengths: &SegmentLengths) -> f64 {
    let pair = |right: Joint| 0.5 * (lengths.to[right] + lengths.to[right.mirrored()]);
    lengths.to[Joint::Pelvis]
        + pelvis_to_hip_line_m(lengths)
        + pair(Joint::RightKnee)
        + pair(Joint::RightAnkle)
}

/// Distance from the pelvis joint to the middle of the hips, metres.
fn pelvis_to_hip_line_m(lengths: &SegmentLengths) -> f64 {
    let [_, _, _, hips] = lengths.rigid;
    let hip = 0.5 * (lengths.to[Joint::RightHip] + lengths.to[Joint::LeftHip]);
    (hip * hip - 0.25 * hips * hips).max(0.0).sqrt()
}

/// Two sources that disagree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// The sources.
    pub sources: [AnchorSource; 2],
    /// Their distances, metres.
    pub distances_m: [f64; 2],
    /// The difference divided by its standard deviation.
    pub sigmas: f64,
}

/// Several anchors combined.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// The anchor. Its standard deviation is increased if the sources scatter more than they state.
    pub anchor: Anchor,
    /// Pairs of sources more than [`CONFLICT_SIGMAS`] apart.
    pub conflicts: Vec<Conflict>,
}

/// Two sources conflict if they differ by more than this many standard deviations.
pub const CONFLICT_SIGMAS: f64 = 3.0;

/// The mean of several anchors of one frame, weighted by their variances.
///
/// Weights are 1/sd². The part due to the scale of the lengths (`sd_scale_m`) is common to all sources and does
/// not average out. If the sum of squared deviations χ² exceeds its degrees of freedom, the standard deviation is
/// multiplied by sqrt(χ²/(n-1)).
pub fn combine(anchors: &[Anchor]) -> Result<Combination, AnchorError> {
    let first = anchors.first().ok_or(AnchorError::Empty)?;
    let ray = first.neck.normalize();
    for anchor in anchors {
        positive("distance_m", anchor.distance_m)?;
        positive("sd_depth_m", anchor.sd_depth_m)?;
        let angle_deg = ray.angle_between(anchor.neck).to_degrees();
        if angle_deg.is_nan() || angle_deg >= 0.01 {
            return Err(AnchorError::DifferentRays { angle_deg });
        }
    }
    if anchors.len() == 1 {
        return Ok(Combination { anchor: first.clone(), conflicts: Vec::new() });
    }
    let weight = |a: &Anchor| a.sd_depth_m.powi(-2);
    let total: f64 = anchors.iter().map(weight).sum();
    let mean =
        |value: &dyn Fn(&Anchor) -> f64| anchors.iter().map(|a| weight(a) * value(a)).sum::<f64>() / total;
    let distance_m = mean(&|a| a.distance_m);
    let sd_scale_m = mean(&|a| a.sd_scale_m);
    let own = |a: &Anchor| (a.sd_depth_m.powi(2) - a.sd_scale_m.powi(2)).max(0.0);
    let own_sq: f64 = anchors.iter().map(|a| (weight(a) / total).powi(2) * own(a)).sum();
    let chi_sq: f64 = anchors.iter().map(|a| weight(a) * (a.distance_m - distance_m).powi(2)).sum();
    let widen = (chi_sq / (anchors.len() - 1) as f64).max(1.0).sqrt();
    let sd = widen * own_sq.sqrt().hypot(sd_scale_m);
    let anchor = Anchor::single(ray, distance_m, sd, sd_scale_m, AnchorSource::Combined);
    Ok(Combination { anchor, conflicts: conflicts(anchors) })
}

fn conflicts(anchors: &[Anchor]) -> Vec<Conflict> {
    let pairs = anchors.iter().enumerate().flat_map(|(i, a)| anchors[i + 1..].iter().map(move |b| (a, b)));
    let conflict = |(a, b): (&Anchor, &Anchor)| {
        // The common scale shifts both by the same factor.
        let own = |x: &Anchor| (x.sd_depth_m.powi(2) - x.sd_scale_m.powi(2)).max(0.0);
        let sd = (own(a) + own(b) + (a.sd_scale_m - b.sd_scale_m).powi(2)).sqrt();
        let sigmas = (a.distance_m - b.distance_m).abs() / sd;
        let distances_m = [a.distance_m, b.distance_m];
        Conflict { sources: [a.source, b.source], distances_m, sigmas }
    };
    pairs.map(conflict).filter(|c| c.sigmas > CONFLICT_SIGMAS).collect()
}

/// Nodes and weights of the Gauss-Hermite rule of three points for a standard normal variable.
const NORMAL_NODES: [(f64, f64); 3] =
    [(-1.732_050_807_568_877_2, 1.0 / 6.0), (0.0, 2.0 / 3.0), (1.732_050_807_568_877_2, 1.0 / 6.0)];

/// The anchor of a probability over distances: mean, standard deviation and modes. Modes are separated at valleys
/// below half of the lower peak.
fn anchor_of_density(
    ray: DVec3,
    distances: &[f64],
    density: &[f64],
    sd_scale_m: f64,
    source: AnchorSource,
) -> Option<Anchor> {
    let (distance_m, sd_depth_m, total) = moments(distances, density)?;
    let bounds = parted(density);
    let mut modes: Vec<DepthMode> = bounds
        .windows(2)
        .filter_map(|w| {
            let (mean, sd_m, mass) = moments(&distances[w[0]..w[1]], &density[w[0]..w[1]])?;
            Some(DepthMode { distance_m: mean, sd_m, probability: mass / total })
        })
        .filter(|mode| mode.probability > 0.02)
        .collect();
    modes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Some(Anchor { neck: ray * distance_m, distance_m, sd_depth_m, sd_scale_m, source, modes })
}

fn moments(distances: &[f64], density: &[f64]) -> Option<(f64, f64, f64)> {
    let total: f64 = density.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let mean = distances.iter().zip(density).map(|(x, p)| x * p).sum::<f64>() / total;
    let variance = distances.iter().zip(density).map(|(x, p)| (x - mean).powi(2) * p).sum::<f64>() / total;
    Some((mean, variance.sqrt(), total))
}

/// The limits of the separate peaks of a density: both ends and the deepest points of the valleys between them.
fn parted(density: &[f64]) -> Vec<usize> {
    let mut bounds = vec![0];
    let (mut summit, mut valley, mut at) = (0.0_f64, f64::INFINITY, 0);
    for (i, &p) in density.iter().enumerate() {
        if p < valley {
            (valley, at) = (p, i);
        }
        if p > 2.0 * valley && summit > 2.0 * valley {
            bounds.push(at);
            (summit, valley) = (p, p);
        } else if p > summit {
            (summit, valley) = (p, p);
        }
    }
    bounds.push(density.len());
    bounds
}

#[cfg(test)]
mod tests;
