//! Postures of a sequence of keypoints, from pixels to world coordinates: the stages of [`super`] in order.
//!
//! [`postures`] reads as numbered steps. Each stage is a module that can be called alone. The interpretation tree
//! of every frame is grown and pruned (Lee and Chen 1985, sections 2.2-3.4), and one posture per frame is chosen
//! by linking over time.
//!
//! Limits: one person; left and right as given (correct swapped labels first with [`crate::keypoints::unswap`]);
//! a camera that does not move and is calibrated against the vertical. The rules and the prior of walking are for
//! forward walking on a straight line. Weights decide which joints count as seen. All seen joints get the same
//! noise, because scores of detectors are not standard deviations.

#[cfg(test)]
mod example;
mod frame;
mod heading;
mod lengths;
mod neck;
mod options;
mod warning;
mod warning_text;

use crate::OptionError;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::anchor::{AnchorError, AnchorSource, Bending, Ground};
use super::constraint::Constraint;
use super::lift::JointRays;
use super::link::{
    Alternative, FrontPoints, LinkError, LinkFrame, LinkOptions, LinkedPath, link_with_progress,
};
use super::prior::MotionPrior;
use super::tree::{DEFAULT_LENGTH_SD_M, TreeOptions};
use super::uncertainty::{Causes, propagate};
use crate::model::angles::{hip_axes, trunk_axes};
use crate::model::camera::{Camera, CameraError};
use crate::model::skeleton::{JOINT_COUNT, Joint, LengthError, PerJoint, StickFigure};
use crate::{Progress, Stopped};

pub use frame::{FrameProblem, FrameReading, MOST_GROUPED, ReasonTotal, RepresentedGroup, reason_totals};
pub use heading::{Heading, HeadingFrom};
pub use lengths::{LengthOrigin, SequenceLengths};
pub use neck::{NeckFrom, NeckTrack, SourceConflict};
pub use options::{AnchorChoice, DEFAULT_DISTANCE_SD_M, Motion, SequenceOptions, Strength};
pub use warning::Warning;

/// Keypoints of one person over time.
#[derive(Debug, Clone, Copy)]
pub struct KeypointSequence<'a> {
    /// Times of the frames, seconds, increasing.
    pub times_s: &'a [f64],
    /// Joints of each frame, distorted pixels as in the image; NaN: missing.
    pub points_px: &'a [PerJoint<DVec2>],
    /// Weight of each joint, 0 to 1.
    pub weights: &'a [PerJoint<f64>],
    /// The six points of the head in the order of [`crate::posture::head::HeadPoint::ALL`], distorted pixels;
    /// NaN: missing.
    pub head_points_px: Option<&'a [[DVec2; 6]]>,
    /// The four points of the feet in the order of [`crate::keypoints::FOOT_POINTS`], distorted pixels; NaN:
    /// missing.
    pub foot_points_px: Option<&'a [[DVec2; 4]]>,
}

/// Why no postures were found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// There are no frames.
    #[error("there are no frames")]
    Empty,
    /// Two lists have different lengths.
    #[error("as many {what} as times ({frames}) are needed, got {got}")]
    Counts {
        /// Number of times.
        frames: usize,
        /// Name of the list.
        what: &'static str,
        /// Its length.
        got: usize,
    },
    /// The times do not increase.
    #[error(
        "times must be finite and increase: frame {frame} is at {time_s} s, the one before at {before_s} s"
    )]
    Times {
        /// Number of the frame.
        frame: usize,
        /// Its time, seconds.
        time_s: f64,
        /// Time of the frame before, seconds.
        before_s: f64,
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The moving direction has no horizontal component.
    #[error("moving_direction must be finite and not vertical, got {value}")]
    Direction {
        /// The direction given.
        value: DVec3,
    },
    /// The head is the source of the neck's distance, and there are no head points.
    #[error("the neck's distance from the head needs its six points (neck, nose, eyes, ears)")]
    NoHeadPoints,
    /// No frame gives the neck's position.
    #[error("no frame gives the neck's distance: {}{}", listed(reasons), also(warnings))]
    NoNeck {
        /// The error of each source.
        reasons: Vec<AnchorError>,
        /// Warnings up to that point.
        warnings: Vec<Warning>,
    },
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Lengths or height are not valid.
    #[error(transparent)]
    Length(#[from] LengthError),
    /// The frames cannot be linked.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Cancelled by the caller.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

fn listed<T: std::fmt::Display>(sentences: &[T]) -> String {
    sentences.iter().map(T::to_string).collect::<Vec<_>>().join("; ")
}

fn also(warnings: &[Warning]) -> String {
    if warnings.is_empty() { String::new() } else { format!("; noticed before: {}", listed(warnings)) }
}

/// Postures of a sequence. Figures are in world axes, metres, Z up.
#[derive(Debug, Clone, PartialEq)]
pub struct PostureSequence {
    /// Segment lengths and their sources.
    pub lengths: SequenceLengths,
    /// Distance of the neck in each frame.
    pub neck: NeckTrack,
    /// The moving direction.
    pub heading: Heading,
    /// The postures that each frame alone allows, or why the frame cannot be used.
    pub frames: Vec<Result<FrameReading, FrameProblem>>,
    /// One posture per frame, its figures in world axes. Its `sd_m` is along the camera's rays, relative to the
    /// starting joint.
    pub linked: LinkedPath,
    /// Constraints that the linked posture of each frame breaks. Linking considers both roots of every segment,
    /// with soft limits, and not only the postures that survive the tree of a frame.
    pub linked_breaks: Vec<Vec<Constraint>>,
    /// Standard deviation of each joint's position in `linked.figures`, metres: from noise, lengths and the
    /// neck's distance. It does not contain the error of choosing the wrong root. NaN if the joint is unknown.
    pub sd_m: Vec<PerJoint<f64>>,
    /// The motion whose rules cut postures and whose habits chose among them: that of the options, or none if these do
    /// not fit ([`Warning::RulesDropped`], [`Warning::HabitsDropped`]).
    pub rules: Motion,
    /// Reasons to doubt the results.
    pub warnings: Vec<Warning>,
}

/// Finds the postures of a sequence.
///
/// A frame without a neck position is not used and does not affect the others ([`FrameProblem`]). If a joint is
/// missing, the joints beyond it on the limb are unknown too. The result does not depend on the number of
/// threads.
///
/// # Errors
///
/// An error for lists of different lengths, times that do not increase, options out of range, and a sequence in
/// which no frame gives the neck's distance.
pub fn postures(
    sequence: &KeypointSequence,
    camera: &Camera,
    options: &SequenceOptions,
) -> Result<PostureSequence, SequenceError> {
    postures_with_progress(sequence, camera, options, &Progress::new())
}

/// [`postures`] with progress and cancellation. Every frame is counted three times: for the neck, the tree and
/// the link, and again for what is done again: the total grows.
///
/// # Errors
///
/// Those of [`postures`], and [`SequenceError::Stopped`] if the call is cancelled.
pub fn postures_with_progress(
    sequence: &KeypointSequence,
    camera: &Camera,
    options: &SequenceOptions,
    progress: &Progress,
) -> Result<PostureSequence, SequenceError> {
    // 1. Check the input; rays through the lens.
    check(sequence, options)?;
    let frame_count = sequence.times_s.len();
    progress.expect(3 * frame_count);
    let camera = camera.clone().validated()?;
    let mut warnings = Vec::new();
    let rays = rays(sequence, &camera, options, &mut warnings);
    let ground = Some(Ground::of(&camera)).filter(|ground| ground.camera_height_m > 0.0);
    // 2. Lengths of the segments.
    let lengths = lengths::find(&rays, ground.as_ref(), options, &mut warnings)?;
    let scene = neck::Scene { sequence, camera: &camera, ground, rays: &rays, lengths: &lengths, options };
    warnings.extend(warning::of_scale(&scene));
    // 3. The neck in each frame.
    let heads = neck::heads(&scene);
    let mut neck = neck::track(&scene, &heads, None, &warnings, progress)?;
    // 4. The moving direction, and the postures that every frame allows.
    let mut allowed = Allowed::find(&scene, &heads, &neck, progress)?;
    // 5. One posture per frame.
    let mut linked = link_frames(&scene, &neck, &allowed, progress)?;
    let mut linked_breaks = broken(&allowed.trees, &allowed.frames, &linked);
    warnings.extend(warning::backwards(&scene, &allowed.heading, &linked));
    // 6. If the rules or the habits of the motion do not fit, the same without them.
    let without_rules = SequenceOptions { motion: Motion::Physical, ..options.clone() };
    let mut scene = scene;
    if let Some(misfit) = warning::misfit(&scene, &allowed, &linked_breaks) {
        warnings.push(misfit);
        scene = neck::Scene { options: &without_rules, ..scene };
        progress.expect_more(2 * frame_count);
        allowed = Allowed::find(&scene, &heads, &neck, progress)?;
        linked = link_frames(&scene, &neck, &allowed, progress)?;
        linked_breaks = broken(&allowed.trees, &allowed.frames, &linked);
    }
    // 7. Who does not walk may bend. Now that it is known which way a person faces, the neck and what depends on it.
    let rules = scene.options.motion;
    if rules == Motion::Physical && scene.options.anchor.may_bend() {
        progress.expect_more(3 * frame_count);
        let bending = bending(&scene, &linked);
        if let Some(found) = neck::again(&scene, &heads, &bending, progress)? {
            neck = found;
            allowed = Allowed::find(&scene, &heads, &neck, progress)?;
            linked = link_frames(&scene, &neck, &allowed, progress)?;
            linked_breaks = broken(&allowed.trees, &allowed.frames, &linked);
        }
    }
    lengths::impossible(&rays, &neck, &lengths, &mut warnings);
    let Allowed { heading, trees, frames, warnings: noticed } = allowed;
    warnings.extend(noticed);
    // A wrong focal length scales all distances, and hardly changes a figure relative to its neck.
    let neck = if matches!(options.anchor, AnchorChoice::Given { .. }) {
        neck
    } else {
        neck.of_focal(options.focal_sd)
    };
    let sd_m = uncertainty(&scene, &neck, &linked);
    // 8. Reasons to doubt the results.
    let found = warning::Found {
        trees: &trees,
        frames: &frames,
        linked: &linked,
        linked_breaks: &linked_breaks,
        neck: &neck,
    };
    warning::judge(&scene, &found, &mut warnings);
    let linked = to_world(linked, &camera);
    Ok(PostureSequence { lengths, neck, heading, frames, linked, linked_breaks, sd_m, rules, warnings })
}

/// The postures that every frame allows, with the constraints used.
struct Allowed {
    heading: Heading,
    trees: Vec<TreeOptions>,
    frames: Vec<Result<FrameReading, FrameProblem>>,
    warnings: Vec<Warning>,
}

impl Allowed {
    fn find(
        scene: &neck::Scene,
        heads: &[Option<neck::Head>],
        neck: &NeckTrack,
        progress: &Progress,
    ) -> Result<Self, Stopped> {
        let mut warnings = Vec::new();
        let necks = neck.places(scene.rays);
        let heading = heading::find(scene, &necks, neck, heads, &mut warnings);
        let SequenceOptions { motion, strength, keep_cuts, .. } = *scene.options;
        let tree = TreeOptions { keep_cuts, ..motion.tree(strength) };
        let trees: Vec<TreeOptions> = heads
            .iter()
            .map(|head| tree.clone().with_bearings(scene.bearings(heading.direction, head.as_ref())))
            .collect();
        let read = |t: usize| {
            progress.advance(1)?;
            Ok(frame::read(scene, &trees[t], neck, necks[t], t))
        };
        let frames = (0..necks.len()).into_par_iter().map(read).collect::<Result<Vec<_>, Stopped>>()?;
        Ok(Self { heading, trees, frames, warnings })
    }
}

/// Constraints that the linked posture of each frame breaks; figures in camera axes.
fn broken(
    trees: &[TreeOptions],
    frames: &[Result<FrameReading, FrameProblem>],
    linked: &LinkedPath,
) -> Vec<Vec<Constraint>> {
    let of_frame = |t: usize| {
        let Ok(frame) = &frames[t] else { return Vec::new() };
        let view = &frame.tree.view;
        let violations = view.violations(view.nearest_path(&linked.figures[t]), &trees[t]);
        violations.iter().map(|violation| violation.constraint).collect()
    };
    (0..frames.len()).into_par_iter().map(of_frame).collect()
}

fn check(sequence: &KeypointSequence, options: &SequenceOptions) -> Result<(), SequenceError> {
    let frames = sequence.times_s.len();
    if frames == 0 {
        return Err(SequenceError::Empty);
    }
    let mut counts =
        vec![("frames of points", sequence.points_px.len()), ("frames of weights", sequence.weights.len())];
    counts.extend(sequence.head_points_px.map(|head| ("frames of head points", head.len())));
    counts.extend(sequence.foot_points_px.map(|feet| ("frames of foot points", feet.len())));
    if let AnchorChoice::Given { distance_m, .. } = &options.anchor
        && distance_m.len() != 1
    {
        counts.push(("distances (or one)", distance_m.len()));
    }
    for (what, got) in counts {
        if got != frames {
            return Err(SequenceError::Counts { frames, what, got });
        }
    }
    if frames == 1 && !sequence.times_s[0].is_finite() {
        return Err(OptionError { name: "time_s", wanted: "finite", got: sequence.times_s[0] }.into());
    }
    for (before, pair) in sequence.times_s.windows(2).enumerate() {
        let [before_s, time_s] = [pair[0], pair[1]];
        if !(time_s > before_s && before_s.is_finite() && time_s.is_finite()) {
            return Err(SequenceError::Times { frame: before + 1, time_s, before_s });
        }
    }
    options::check_options(options)?;
    if options.anchor == AnchorChoice::Source(AnchorSource::Head) && sequence.head_points_px.is_none() {
        return Err(SequenceError::NoHeadPoints);
    }
    Ok(())
}

/// Points may leave the image by this many standard deviations of the noise.
const BEYOND_SIGMAS: f64 = 3.0;
/// Share of points outside the image that gives a warning: some detectors guess joints outside the image.
const CONSIDERABLE_BEYOND: f64 = 0.05;

/// Rays of all frames. Joints are missing if their weight is below the minimum or unknown, if they are not
/// finite, or if the lens maps nothing to that point.
fn rays(
    sequence: &KeypointSequence,
    camera: &Camera,
    options: &SequenceOptions,
    warnings: &mut Vec<Warning>,
) -> Vec<JointRays> {
    let noise_rad = options.noise_px / (camera.focal_px.x * camera.focal_px.y).sqrt();
    let [mut light, mut outside, mut given, mut beyond] = [0; 4];
    let margin_px = 0.5 + BEYOND_SIGMAS * options.noise_px;
    let [lowest_px, highest_px] = [-margin_px, margin_px - 1.0].map(DVec2::splat);
    let highest_px = highest_px + DVec2::from(camera.size.map(f64::from));
    let mut rays = Vec::with_capacity(sequence.points_px.len());
    for (points_px, weight) in sequence.points_px.iter().zip(sequence.weights) {
        let mut ray = PerJoint([DVec3::NAN; JOINT_COUNT]);
        for ((ray, &pixel), &weight) in ray.0.iter_mut().zip(&points_px.0).zip(&weight.0) {
            if pixel.is_nan() {
                continue;
            }
            given += 1;
            beyond += usize::from(pixel.cmplt(lowest_px).any() || pixel.cmpgt(highest_px).any());
            // Not `weight < min_weight`: an unknown weight (NaN) counts as too small.
            if weight.is_nan() || weight < options.min_weight {
                light += 1;
            } else if let Some(seen) = pixel_ray(camera, pixel) {
                *ray = seen;
            } else {
                outside += 1;
            }
        }
        rays.push(JointRays { ray, weight: *weight, noise_rad });
    }
    let all = given;
    warnings.extend((light > 0).then_some(Warning::LightJoints {
        light,
        all,
        min_weight: options.min_weight,
    }));
    warnings.extend((outside > 0).then_some(Warning::OutsideLens { outside, all }));
    let is_considerable = beyond as f64 > CONSIDERABLE_BEYOND * all as f64;
    warnings.extend(is_considerable.then(|| {
        let seen = sequence.points_px.iter().flat_map(|points| points.0).filter(|pixel| pixel.is_finite());
        let farthest_px = seen.fold(DVec2::splat(f64::NEG_INFINITY), DVec2::max);
        Warning::OutsidePicture { beyond, all, size: camera.size, farthest_px }
    }));
    rays
}

fn link_frames(
    scene: &neck::Scene,
    neck: &NeckTrack,
    allowed: &Allowed,
    progress: &Progress,
) -> Result<LinkedPath, LinkError> {
    let Allowed { heading, frames, .. } = allowed;
    let necks = neck.places(scene.rays);
    let link_frames: Vec<LinkFrame> = (0..necks.len())
        .map(|t| LinkFrame {
            time_s: scene.sequence.times_s[t],
            rays: scene.rays[t],
            neck: if frames[t].is_ok() { necks[t] } else { DVec3::NAN },
            front: front_points(scene, t),
        })
        .collect();
    let direction = heading.direction.map(|direction| scene.camera.rotation * direction);
    let options = LinkOptions {
        prior: scene.options.motion.prior(),
        up: Some(scene.up()),
        ground: scene.ground,
        // Without a motion, people may move sideways: the prior is relative to the trunk's own direction.
        moving_direction: direction.filter(|_| scene.options.motion.needs_heading()),
        facing: direction
            .filter(|_| !scene.options.motion.needs_heading() && heading.from == HeadingFrom::Given),
        ..LinkOptions::default()
    };
    link_with_progress(&link_frames, &scene.lengths.lengths, &options, progress)
}

/// In each frame, that the person may bend, if the posture shows which way the front is.
fn bending(scene: &neck::Scene, linked: &LinkedPath) -> Vec<Option<Bending>> {
    let MotionPrior { trunk_lean: lean, balance, .. } = scene.options.motion.prior();
    let of_figure = |figure: &StickFigure| {
        let axes = [trunk_axes(figure), hip_axes(figure)].into_iter().flatten();
        let front = axes.map(|axes| axes.x_axis).sum::<DVec3>().reject_from_normalized(scene.up());
        Some(Bending { front: front.try_normalize()?, lean, balance: balance? })
    };
    linked.smoothed.iter().map(of_figure).collect()
}

/// The rays to feet and face in a frame.
fn front_points(scene: &neck::Scene, t: usize) -> FrontPoints {
    let ray = |pixel: DVec2| pixel_ray(scene.camera, pixel).unwrap_or(DVec3::NAN);
    let mut found = FrontPoints::UNSEEN;
    if let Some(feet) = scene.sequence.foot_points_px {
        let [right_toe, left_toe, right_heel, left_heel] = feet[t].map(ray);
        (found.toes, found.heels) = ([right_toe, left_toe], [right_heel, left_heel]);
    }
    if let Some(head) = scene.sequence.head_points_px {
        let [_, nose, _, _, right_ear, left_ear] = head[t].map(ray);
        (found.nose, found.ears) = (nose, [right_ear, left_ear]);
    }
    found
}

/// The ray of a distorted pixel; `None` if it is not finite or the lens maps nothing to it.
fn pixel_ray(camera: &Camera, pixel: DVec2) -> Option<DVec3> {
    let ideal_px = camera.undistort(pixel).ok().filter(|p| pixel.is_finite() && p.is_finite())?;
    Some(((ideal_px - camera.centre_px) / camera.focal_px).extend(1.0).normalize())
}

/// Standard deviations of the joints of the smoothed figures, with each frame on its own.
fn uncertainty(scene: &neck::Scene, neck: &NeckTrack, linked: &LinkedPath) -> Vec<PerJoint<f64>> {
    let lengths = scene.lengths;
    let own_sd_m = |sd_m: f64, length_m: f64| {
        (sd_m * sd_m - (lengths.scale_sd * length_m).powi(2)).max(DEFAULT_LENGTH_SD_M.powi(2)).sqrt()
    };
    let mut length_sd_m = PerJoint([0.0; JOINT_COUNT]);
    for (joint, &sd_m) in Joint::ALL.into_iter().skip(1).zip(&lengths.sd_m) {
        length_sd_m[joint] = own_sd_m(sd_m, lengths.lengths.to[joint]);
    }
    let of_frame = |t: usize| {
        let anchor_sd_m = neck.sd_m[t];
        let causes = Causes {
            anchor_sd_m,
            length_sd_m,
            scale_sd: lengths.scale_sd,
            anchor_scale_sd_m: (neck.scale_sd * neck.distance_m[t]).min(anchor_sd_m),
        };
        let found = propagate(&linked.smoothed[t], &scene.rays[t], &causes);
        found.map_or(PerJoint([f64::NAN; JOINT_COUNT]), |found| found.absolute_sd_m)
    };
    (0..linked.smoothed.len()).into_par_iter().map(of_frame).collect()
}

/// A figure of camera axes (x right, y down, z forward) in world axes (z up), metres.
pub fn figure_in_world(figure_in_camera: &StickFigure, camera: &Camera) -> StickFigure {
    let world_from_camera = camera.rotation.transpose();
    PerJoint(figure_in_camera.0.map(|point| world_from_camera * (point - camera.translation)))
}

/// A figure of world axes (z up) in camera axes (x right, y down, z forward), metres.
pub fn figure_in_camera(figure_in_world: &StickFigure, camera: &Camera) -> StickFigure {
    PerJoint(figure_in_world.0.map(|point| camera.camera_from_world(point)))
}

fn to_world(linked: LinkedPath, camera: &Camera) -> LinkedPath {
    let world = |figures: Vec<StickFigure>| figures.iter().map(|f| figure_in_world(f, camera)).collect();
    let world_from_camera = camera.rotation.transpose();
    let toe_in_world = |toe: DVec3| world_from_camera * (toe - camera.translation);
    LinkedPath {
        figures: world(linked.figures),
        smoothed: world(linked.smoothed),
        toes: linked.toes.iter().map(|toes| toes.map(toe_in_world)).collect(),
        second: linked.second.map(|second| Alternative { figures: world(second.figures), ..second }),
        ..linked
    }
}

#[cfg(test)]
mod tests;
