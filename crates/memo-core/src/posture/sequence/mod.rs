//! Postures of a sequence of keypoints, from pixels to the world: the stages of [`super`] in order.
//!
//! [`postures`] reads as numbered steps; each stage is a module of its own and can be called without this one.
//! The interpretation tree of every frame is grown and pruned (Lee and Chen 1985, sections 2.2-3.4), and one
//! posture a frame is chosen by linking over time.
//!
//! The limits: one person; left and right as given (repair them before, [`super::unswap`]); a
//! camera that stands still, calibrated against the vertical. Rules and the prior of walking are of
//! straight-line walking forwards. Weights say which joints count as seen; all that are seen get the same
//! noise, for scores of detectors are no standard deviations.

mod frame;
mod heading;
mod lengths;
mod neck;
mod options;
mod warning;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::anchor::{AnchorError, AnchorSource, Ground};
use super::constraint::Constraint;
use super::lift::JointRays;
use super::link::{Alternative, LinkError, LinkFrame, LinkOptions, LinkedPath, link_with_progress};
use super::skeleton::{JOINT_COUNT, Joint, LengthError, PerJoint, StickFigure};
use super::tree::{DEFAULT_LENGTH_SD_M, TreeOptions};
use super::uncertainty::{Causes, propagate};
use crate::model::camera::{Camera, CameraError};
use crate::progress::{Progress, Stopped};

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
    /// Joints of each frame, pixels as the lens shows them; NaN: missing.
    pub points_px: &'a [PerJoint<DVec2>],
    /// Weight of each joint, 0 to 1.
    pub weights: &'a [PerJoint<f64>],
    /// The six points of the head in the order of [`super::head::HeadPoint::ALL`], pixels; NaN: missing.
    pub head_points_px: Option<&'a [[DVec2; 6]]>,
}

/// Why there are no postures.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SequenceError {
    /// No frames.
    #[error("there are no frames")]
    Empty,
    /// Lists do not go together.
    #[error("as many {what} as times ({frames}) are needed, got {got}")]
    Counts {
        /// Number of times.
        frames: usize,
        /// Which list.
        what: &'static str,
        /// Its length.
        got: usize,
    },
    /// A time does not follow the one before.
    #[error(
        "times must be finite and increase: frame {frame} is at {time_s} s, the one before at {before_s} s"
    )]
    Times {
        /// The frame.
        frame: usize,
        /// Its time.
        time_s: f64,
        /// The time before.
        before_s: f64,
    },
    /// A number is not usable.
    #[error("{name} must be {wanted}, got {value}")]
    Quantity {
        /// Its name.
        name: &'static str,
        /// What is wanted.
        wanted: &'static str,
        /// Its value.
        value: f64,
    },
    /// The moving direction has no level part.
    #[error("moving_direction must be finite and not vertical, got {value}")]
    Direction {
        /// The vector.
        value: DVec3,
    },
    /// The head was asked for and there are no head points.
    #[error("the neck's distance from the head needs its six points (neck, nose, eyes, ears)")]
    NoHeadPoints,
    /// No frame gives the neck's place.
    #[error("no frame gives the neck's distance: {}{}", listed(reasons), also(warnings))]
    NoNeck {
        /// Why not, each source for itself.
        reasons: Vec<AnchorError>,
        /// What had been noticed before.
        warnings: Vec<Warning>,
    },
    /// The camera is not usable.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Lengths or height are not usable.
    #[error(transparent)]
    Length(#[from] LengthError),
    /// The frames cannot be linked.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Somebody wished it to end.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

fn listed<T: std::fmt::Display>(sentences: &[T]) -> String {
    sentences.iter().map(T::to_string).collect::<Vec<_>>().join("; ")
}

fn also(warnings: &[Warning]) -> String {
    if warnings.is_empty() { String::new() } else { format!("; noticed before: {}", listed(warnings)) }
}

/// What was found in a sequence. Figures are in world axes, metres, Z up.
#[derive(Debug, Clone, PartialEq)]
pub struct PostureSequence {
    /// Lengths of the segments and what they rest on.
    pub lengths: SequenceLengths,
    /// Distance of the neck in each frame.
    pub neck: NeckTrack,
    /// The moving direction.
    pub heading: Heading,
    /// What each frame alone allows, or why it says nothing.
    pub frames: Vec<Result<FrameReading, FrameProblem>>,
    /// One posture a frame, its figures in world axes; its `sd_m` is along the camera's rays and against the
    /// starting joint.
    pub linked: LinkedPath,
    /// Constraints that the linked posture of each frame breaks. Linking takes both roots of every segment
    /// with limits that may be passed at a price, not the survivors of a frame alone.
    pub linked_breaks: Vec<Vec<Constraint>>,
    /// Standard deviation of each joint's place in `linked.figures`, metres: noise, lengths and the neck's
    /// distance. That a root is the wrong one is not in it. NaN where the joint is unknown.
    pub sd_m: Vec<PerJoint<f64>>,
    /// What a reader should know before trusting the rest.
    pub warnings: Vec<Warning>,
}

/// Finds the postures of a sequence.
///
/// A frame without a neck says nothing and takes nothing from the others ([`FrameProblem`]); a missing joint
/// leaves what hangs on it unknown. The number of threads changes nothing.
///
/// # Errors
///
/// Lists of different lengths, times that do not increase, options out of range, and a sequence in which no
/// frame gives the neck's distance.
pub fn postures(
    sequence: &KeypointSequence,
    camera: &Camera,
    options: &SequenceOptions,
) -> Result<PostureSequence, SequenceError> {
    postures_with_progress(sequence, camera, options, &Progress::new())
}

/// [`postures`], counting frames in `progress`: once for the neck, once for the tree, once for the link.
///
/// # Errors
///
/// Those of [`postures`], and [`SequenceError::Stopped`].
pub fn postures_with_progress(
    sequence: &KeypointSequence,
    camera: &Camera,
    options: &SequenceOptions,
    progress: &Progress,
) -> Result<PostureSequence, SequenceError> {
    // 1. Check what came; rays through the lens.
    check(sequence, options)?;
    progress.expect(3 * sequence.times_s.len());
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
    let neck = neck::track(&scene, &heads, &warnings, progress)?;
    let necks = neck.places(&rays);
    lengths::impossible(&rays, &neck, &lengths, &mut warnings);
    // 4. The moving direction.
    let heading = heading::find(&scene, &necks, &neck, &heads, &mut warnings);
    // 5. What every frame allows.
    let tree = options.motion.tree(options.strength);
    let trees: Vec<TreeOptions> = heads
        .iter()
        .map(|head| tree.clone().with_bearings(scene.bearings(&heading, head.as_ref())))
        .collect();
    let read = |t: usize| {
        progress.advance(1)?;
        Ok(frame::read(&scene, &trees[t], &neck, necks[t], t))
    };
    let frames = (0..rays.len()).into_par_iter().map(read).collect::<Result<Vec<_>, Stopped>>()?;
    // 6. One of them a frame.
    let linked = link_frames(&scene, &heading, &necks, &frames, progress)?;
    let sd_m = uncertainty(&scene, &neck, &linked);
    // 7. What casts doubt on it.
    let linked_breaks = broken(&trees, &frames, &linked);
    let found = warning::Found {
        trees: &trees,
        frames: &frames,
        linked: &linked,
        linked_breaks: &linked_breaks,
        neck: &neck,
        heading: &heading,
    };
    warning::judge(&scene, &found, &mut warnings);
    let linked = to_world(linked, &camera);
    Ok(PostureSequence { lengths, neck, heading, frames, linked, linked_breaks, sd_m, warnings })
}

/// What the linked posture of each frame breaks; figures in camera axes.
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
        return Err(SequenceError::Quantity { name: "time_s", wanted: "finite", value: sequence.times_s[0] });
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

/// Noise moves a point at the picture's edge so many of its standard deviations beyond.
const BEYOND_SIGMAS: f64 = 3.0;
/// Share of points outside the picture that is worth a warning: some detectors guess joints that the edge cuts off.
const CONSIDERABLE_BEYOND: f64 = 0.05;

/// Rays of all frames. Joints of little or no weight, at infinity or where no lens images anything are
/// missing.
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
            // Not `weight < min_weight`: an unknown weight (NaN) is none.
            if weight.is_nan() || weight < options.min_weight {
                light += 1;
            } else if let Some(ideal_px) =
                camera.undistort(pixel).ok().filter(|p| pixel.is_finite() && p.is_finite())
            {
                *ray = ((ideal_px - camera.centre_px) / camera.focal_px).extend(1.0).normalize();
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
    heading: &Heading,
    necks: &[DVec3],
    frames: &[Result<FrameReading, FrameProblem>],
    progress: &Progress,
) -> Result<LinkedPath, LinkError> {
    let link_frames: Vec<LinkFrame> = (0..necks.len())
        .map(|t| LinkFrame {
            time_s: scene.sequence.times_s[t],
            rays: scene.rays[t],
            neck: if frames[t].is_ok() { necks[t] } else { DVec3::NAN },
        })
        .collect();
    let options = LinkOptions {
        prior: scene.options.motion.prior(),
        up: Some(scene.up()),
        ground: scene.ground,
        // Anybody may move sideways: the prior of any motion is against the trunk's own direction.
        moving_direction: heading
            .direction
            .filter(|_| scene.options.motion.needs_heading())
            .map(|direction| scene.camera.rotation * direction),
        ..LinkOptions::default()
    };
    link_with_progress(&link_frames, &scene.lengths.lengths, &options, progress)
}

/// Standard deviations of the joints of the smoothed figures, as if each frame stood alone.
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

/// A figure of camera axes (x right, y down, z forward) in those of the world (z up), metres.
pub fn figure_in_world(figure_in_camera: &StickFigure, camera: &Camera) -> StickFigure {
    let world_from_camera = camera.rotation.transpose();
    PerJoint(figure_in_camera.0.map(|point| world_from_camera * (point - camera.translation)))
}

/// A figure of world axes (z up) in those of the camera (x right, y down, z forward), metres.
pub fn figure_in_camera(figure_in_world: &StickFigure, camera: &Camera) -> StickFigure {
    PerJoint(figure_in_world.0.map(|point| camera.camera_from_world(point)))
}

fn to_world(linked: LinkedPath, camera: &Camera) -> LinkedPath {
    let world = |figures: Vec<StickFigure>| figures.iter().map(|f| figure_in_world(f, camera)).collect();
    LinkedPath {
        figures: world(linked.figures),
        smoothed: world(linked.smoothed),
        second: linked.second.map(|second| Alternative { figures: world(second.figures), ..second }),
        ..linked
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::constraint::ConstraintKind;
    use crate::posture::skeleton::SegmentLengths;
    use crate::synth::Random;
    use crate::synth::stick_walker::{StickWalker, world_from_head};
    use proptest::prelude::*;

    const RATE_HZ: f64 = 25.0;

    /// Keypoints of a known walk.
    struct Walk {
        camera: Camera,
        times_s: Vec<f64>,
        points_px: Vec<PerJoint<DVec2>>,
        weights: Vec<PerJoint<f64>>,
        truth: Vec<StickFigure>,
    }

    impl Walk {
        fn sequence(&self) -> KeypointSequence<'_> {
            let Self { times_s, points_px, weights, .. } = self;
            KeypointSequence { times_s, points_px, weights, head_points_px: None }
        }

        fn postures(&self, options: &SequenceOptions) -> Result<PostureSequence, SequenceError> {
            postures(&self.sequence(), &self.camera, options)
        }
    }

    /// The walker of the paper at 1.2 m/s past a level camera, `azimuth_deg` off the direction towards it.
    fn walk(azimuth_deg: f64, frames: usize, noise_px: f64) -> Walk {
        let camera = Camera::level([1920, 1920], 0.9273, 1.2, 5.0).unwrap();
        let walker = StickWalker::lee_chen();
        let mut random = Random::new(5);
        let forward = glam::DMat3::from_rotation_z((azimuth_deg - 90.0).to_radians()) * DVec3::X;
        let turn = glam::DMat3::from_rotation_z(forward.y.atan2(forward.x));
        let posed = |t: usize| {
            let figure = walker.posed(t as f64 / RATE_HZ, DVec3::ZERO);
            PerJoint(figure.0.map(world_from_head))
        };
        let lowest = |figure: &StickFigure| figure[Joint::RightAnkle].z.min(figure[Joint::LeftAnkle].z);
        let figures: Vec<StickFigure> = (0..frames).map(posed).collect();
        let low = figures.iter().map(lowest).fold(f64::INFINITY, f64::min);
        let height = 0.17 * walker.lengths().to[Joint::RightAnkle] - low;
        let mut found = Walk { camera, times_s: vec![], points_px: vec![], weights: vec![], truth: vec![] };
        for (t, figure) in figures.iter().enumerate() {
            let way_m = 1.2 * (t as f64 - 0.5 * frames as f64) / RATE_HZ;
            let figure = PerJoint(figure.0.map(|p| turn * p + way_m * forward + height * DVec3::Z));
            let pixel = |p: DVec3| {
                let [a, b] = random.normal_pair().map(f64::from);
                found.camera.project(p).unwrap() + noise_px * DVec2::new(a, b)
            };
            found.points_px.push(PerJoint(figure.0.map(pixel)));
            found.times_s.push(t as f64 / RATE_HZ);
            found.weights.push(PerJoint([1.0; JOINT_COUNT]));
            found.truth.push(figure);
        }
        found
    }

    fn with_lengths() -> SequenceOptions {
        SequenceOptions {
            lengths: Some(SegmentLengths::lee_chen()),
            noise_px: 1.0,
            ..SequenceOptions::default()
        }
    }

    /// Median and 90 % quantile of the distances from the truth, necks on each other, cm.
    fn errors_cm(found: &[StickFigure], truth: &[StickFigure]) -> [f64; 2] {
        let mut errors: Vec<f64> = found
            .iter()
            .zip(truth)
            .flat_map(|(found, truth)| {
                let shift = truth[Joint::Neck] - found[Joint::Neck];
                Joint::ALL.map(|joint| 100.0 * (found[joint] + shift).distance(truth[joint]))
            })
            .filter(|error| error.is_finite())
            .collect();
        errors.sort_by(f64::total_cmp);
        [0.5, 0.9].map(|q| errors[(q * (errors.len() - 1) as f64) as usize])
    }

    #[test]
    fn a_walk_is_recovered_in_the_world() {
        for azimuth_deg in [45.0, 90.0] {
            let walk = walk(azimuth_deg, 40, 1.0);
            let found = walk.postures(&with_lengths()).unwrap();
            let [median, worst] = errors_cm(&found.linked.smoothed, &walk.truth);
            println!("{azimuth_deg} deg: {median:.1} cm, 90 % {worst:.1} cm; {:?}", found.heading);
            for warning in &found.warnings {
                println!("{warning}");
            }
            assert!(median < 4.0 && worst < 12.0, "{azimuth_deg} deg: {median:.1} cm, 90 % {worst:.1} cm");
            let off =
                |t: &usize| (found.linked.figures[*t][Joint::Neck] - walk.truth[*t][Joint::Neck]).length();
            let inside = (0..40).filter(|t| off(t) < 3.0 * found.neck.sd_m[*t]).count();
            assert!(inside >= 36, "{inside} necks within 3 standard deviations");
            let forward = walk.truth[39][Joint::Neck] - walk.truth[0][Joint::Neck];
            let heading = found.heading.direction.unwrap();
            assert_eq!(found.heading.from, HeadingFrom::Travel);
            assert!(heading.angle_between(forward).to_degrees() < 10.0, "{heading} for {forward}");
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        }
    }

    /// Survivors by count, reasons by the constraint's kind: rules cut only where they are asked for.
    #[test]
    fn rules_cut_what_bodies_allow() {
        let walk = walk(45.0, 10, 1.0);
        let physical =
            walk.postures(&SequenceOptions { motion: Motion::Physical, ..with_lengths() }).unwrap();
        let walking = walk.postures(&with_lengths()).unwrap();
        for (physical, walking) in physical.frames.iter().zip(&walking.frames) {
            let [physical, walking] = [physical, walking].map(|frame| frame.as_ref().unwrap());
            assert!(walking.survivors() <= physical.survivors() && walking.survivors() > 0);
            assert!(
                walking.groups.len() <= 64 && walking.groups[0].size >= walking.groups.last().unwrap().size
            );
        }
        let has_rule = |found: &PostureSequence| {
            reason_totals(&found.frames).iter().any(|total| total.constraint.kind() == ConstraintKind::Rule)
        };
        assert!(!has_rule(&physical) && has_rule(&walking));
        let few = walk.postures(&SequenceOptions { max_groups: 2, ..with_lengths() }).unwrap();
        for (few, all) in few.frames.iter().flatten().zip(walking.frames.iter().flatten()) {
            assert!(few.group_count == all.group_count && all.group_count.is_some_and(|count| count > 2));
            assert_eq!(few.groups[..], all.groups[..2]);
            let members: usize = all.groups.iter().map(|group| group.size).sum();
            assert!(members == all.survivors() || all.group_count > Some(64));
        }
    }

    #[test]
    fn missing_joints_cost_what_hangs_on_them() {
        let mut walk = walk(45.0, 20, 0.5);
        walk.points_px[7][Joint::RightKnee] = DVec2::NAN;
        walk.weights[8][Joint::LeftElbow] = 0.0;
        walk.points_px[9][Joint::Neck] = DVec2::NAN;
        walk.points_px[10] = PerJoint([DVec2::NAN; JOINT_COUNT]);
        walk.points_px[11][Joint::LeftWrist] = DVec2::INFINITY;
        let found = walk.postures(&with_lengths()).unwrap();
        let unknown = |t: usize| -> Vec<Joint> {
            let figure = &found.linked.figures[t];
            Joint::ALL.into_iter().filter(|&joint| figure[joint].is_nan()).collect()
        };
        assert_eq!(unknown(7), [Joint::RightKnee, Joint::RightAnkle]);
        assert_eq!(unknown(8), [Joint::LeftElbow, Joint::LeftWrist]);
        assert_eq!(unknown(11), [Joint::LeftWrist]);
        assert_eq!(found.frames[9], Err(FrameProblem::NeckNotSeen));
        assert_eq!(found.frames[10], Err(FrameProblem::NeckNotSeen));
        assert_eq!([unknown(9).len(), unknown(10).len()], [JOINT_COUNT; 2]);
        assert!((0..20).filter(|t| ![7, 8, 9, 10, 11].contains(t)).all(|t| unknown(t).is_empty()));
        let counts = &found.frames[7].as_ref().unwrap().tree.counts;
        assert_eq!(counts[Joint::RightKnee].reached, counts[Joint::LeftWrist].reached);
        let open = &found.frames[7].as_ref().unwrap().tree.open;
        assert!(open.iter().all(|constraint| constraint.name().contains("right")
            || constraint.kind() == ConstraintKind::Rule
            || constraint.kind() == ConstraintKind::Collision));
        assert!(found.warnings.contains(&Warning::LightJoints {
            light: 1,
            all: 20 * 14 - 16,
            min_weight: 0.2
        }));
        assert!(found.warnings.iter().any(|w| matches!(w, Warning::OutsideLens { outside: 1, .. })));
        assert!(found.warnings.iter().any(|w| matches!(w, Warning::SilentFrames { silent: 2, of: 20, .. })));
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_its_values() {
        let good = walk(45.0, 6, 0.5);
        let refused = |change: &dyn Fn(&mut Walk, &mut SequenceOptions)| {
            let mut walk = walk(45.0, 6, 0.5);
            let mut options = with_lengths();
            change(&mut walk, &mut options);
            walk.postures(&options).unwrap_err().to_string()
        };
        assert!(good.postures(&with_lengths()).is_ok());
        assert_eq!(refused(&|walk, _| walk.times_s.clear()), "there are no frames");
        assert_eq!(
            refused(&|walk, _| walk.points_px.truncate(3)),
            "as many frames of points as times (6) are needed, got 3"
        );
        assert_eq!(
            refused(&|walk, _| walk.times_s[3] = walk.times_s[2]),
            "times must be finite and increase: frame 3 is at 0.08 s, the one before at 0.08 s"
        );
        assert!(refused(&|walk, _| walk.times_s[2] = f64::NAN).starts_with("times must be finite"));
        assert_eq!(
            refused(&|_, o| o.noise_px = f64::NAN),
            "noise_px must be finite and not negative, got NaN"
        );
        assert!(refused(&|_, o| o.lengths.as_mut().unwrap().to[Joint::Pelvis] = 0.0).contains("got 0"));
        assert!(refused(&|_, o| (o.lengths, o.height_m) = (None, Some(17.0))).contains("17"));
        assert!(refused(&|_, o| o.moving_direction = Some(DVec3::Z)).contains("vertical"));
        assert!(refused(&|_, o| o.anchor = AnchorChoice::Source(AnchorSource::Head)).contains("six points"));
        assert!(
            refused(&|_, o| o.anchor = AnchorChoice::Given { distance_m: vec![4.0, 5.0], sd_m: 0.1 })
                .contains("as many distances (or one) as times (6) are needed, got 2")
        );
        assert!(
            refused(&|_, o| o.anchor = AnchorChoice::Given { distance_m: vec![-4.0], sd_m: 0.1 })
                .contains("-4")
        );
        assert!(
            refused(&|_, o| o.anchor = AnchorChoice::Given { distance_m: vec![4.0], sd_m: 0.0 })
                .contains("sd")
        );
        for (distance_m, sd_m) in [(1e300, 0.1), (1e-300, 0.1), (4.0, -5.0), (4.0, 1e300)] {
            let given = AnchorChoice::Given { distance_m: vec![distance_m], sd_m };
            assert!(refused(&|_, o| o.anchor = given.clone()).starts_with("distance_"));
        }
        let nothing = |walk: &mut Walk| walk.points_px.fill(PerJoint([DVec2::NAN; JOINT_COUNT]));
        assert!(refused(&|walk, _| nothing(walk)).contains("no frame gives the neck's distance"));
        assert!(refused(&|walk, o| (nothing(walk), o.lengths = None).1).contains("no frame gives"));
        assert!(refused(&|walk, _| walk.camera.focal_px.x = 0.0).contains("focal"));
    }

    #[test]
    fn frames_that_say_nothing_say_why() {
        let mut walk = walk(45.0, 6, 0.5);
        for joint in Joint::ALL.into_iter().skip(1) {
            walk.points_px[2][joint] = DVec2::NAN;
        }
        let found = walk.postures(&with_lengths()).unwrap();
        assert_eq!(found.frames[2], Err(FrameProblem::NeckAlone));
        let anchor = AnchorChoice::Given { distance_m: vec![4.0, 4.0, 4.0, 4.0, 0.5, f64::NAN], sd_m: 1.0 };
        let found = walk.postures(&SequenceOptions { anchor, ..with_lengths() }).unwrap();
        assert_eq!(found.frames[4], Err(FrameProblem::VagueDistance { distance_m: 0.5, sd_m: 1.0 }));
        assert_eq!(found.frames[5], Err(FrameProblem::NoDistance));
        assert!(found.neck.distance_m[4].is_nan() && found.neck.from[4] == NeckFrom::Nothing);
        assert!(found.linked.figures[4].0.iter().all(|point| point.is_nan()) && found.frames[3].is_ok());
    }

    #[test]
    fn no_neck_has_a_reason_from_every_source() {
        let mut walk = walk(45.0, 6, 0.5);
        for points_px in &mut walk.points_px {
            points_px[Joint::Pelvis] = DVec2::NAN;
            points_px[Joint::RightHip] = DVec2::NAN;
            points_px[Joint::LeftHip] = DVec2::NAN;
            points_px[Joint::RightAnkle] = DVec2::NAN;
            points_px[Joint::LeftAnkle] = DVec2::NAN;
        }
        walk.weights[0][Joint::LeftWrist] = 0.1;
        let error = walk.postures(&with_lengths()).unwrap_err();
        let SequenceError::NoNeck { reasons, warnings } = &error else { panic!("{error}") };
        assert_eq!(reasons.len(), 4, "{error}");
        assert!(matches!(warnings[..], [Warning::LightJoints { light: 1, .. }]), "{error}");
        for source in ["ground", "trunk", "extent", "head"] {
            assert!(error.to_string().contains(&format!("no neck from the {source}")), "{error}");
        }
        assert!(error.to_string().contains("noticed before: 1 of"), "{error}");
    }

    #[test]
    fn a_picture_of_another_size_is_noticed() {
        let beyond = |scale: f64| {
            let mut walk = walk(45.0, 6, 0.5);
            walk.points_px.iter_mut().flat_map(|points| &mut points.0).for_each(|pixel| *pixel *= scale);
            let inside = 0.0..=1920.0;
            let pixels = walk.points_px.iter().flat_map(|points| points.0);
            let outside = pixels.filter(|p| !(inside.contains(&p.x) && inside.contains(&p.y))).count();
            let warnings = walk.postures(&with_lengths()).unwrap().warnings;
            let told = warnings.into_iter().find_map(|warning| match warning {
                Warning::OutsidePicture { beyond, all: 84, size: [1920, 1920], .. } => Some(beyond),
                _ => None,
            });
            (outside, told)
        };
        assert_eq!(beyond(1.0), (0, None));
        let (outside, told) = beyond(2.0);
        assert!(told.is_some_and(|told| told.abs_diff(outside) <= 2 && told > 20), "{told:?}, {outside}");
    }

    #[test]
    fn a_segment_longer_than_can_be_is_reported() {
        let walk = walk(90.0, 20, 0.5);
        let mut lengths = SegmentLengths::lee_chen();
        lengths.to[Joint::RightAnkle] *= 0.5;
        let options = SequenceOptions { lengths: Some(lengths), motion: Motion::Physical, ..with_lengths() };
        let necks = walk.truth.iter().map(|f| walk.camera.camera_from_world(f[Joint::Neck]).length());
        let anchor = AnchorChoice::Given { distance_m: necks.collect(), sd_m: 0.05 };
        let found = walk.postures(&SequenceOptions { anchor, ..options.clone() }).unwrap();
        let is_short = |warning: &Warning| match warning {
            Warning::SegmentTooShort { segment, frames, .. } => {
                segment == "right_knee_to_right_ankle" && *frames == 20
            }
            _ => false,
        };
        assert!(found.warnings.iter().any(is_short), "{:?}", found.warnings);
        let gaps: Vec<f64> = found.linked.gap_m.iter().map(|gap| gap[Joint::RightAnkle]).collect();
        assert!(gaps.iter().all(|gap| *gap > 0.05), "{gaps:?}");
        // Without a distance the ground takes the short leg for a nearer one, against the trunk.
        let found = walk.postures(&options).unwrap();
        let is_conflict = |c: &SourceConflict| c.sources == [AnchorSource::Ground, AnchorSource::Trunk];
        assert!(found.neck.conflicts.iter().any(is_conflict), "{:?}", found.neck.conflicts);
        assert!(
            found.warnings.iter().any(|warning| matches!(warning, Warning::Conflict(c) if is_conflict(c)))
        );
    }

    #[test]
    fn threads_change_nothing() {
        let walk = walk(45.0, 12, 2.0);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            format!("{:?}", pool.install(|| walk.postures(&with_lengths()).unwrap()))
        };
        assert!(with(1) == with(2));
    }

    #[test]
    fn figures_go_to_the_camera_and_back() {
        let walk = walk(30.0, 1, 0.0);
        let camera_figure = figure_in_camera(&walk.truth[0], &walk.camera);
        let again = figure_in_world(&camera_figure, &walk.camera);
        for joint in Joint::ALL {
            assert!(camera_figure[joint].z > 0.0 && again[joint].distance(walk.truth[0][joint]) < 1e-12);
        }
    }

    fn any_pixel() -> impl Strategy<Value = f64> {
        prop_oneof![
            8 => 0.0..1920.0,
            1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e9]),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Whatever the points: an answer of the right size, or an error.
        #[test]
        fn no_points_break_it(
            pixels in prop::collection::vec((any_pixel(), any_pixel()), 3 * JOINT_COUNT),
            weights in prop::collection::vec(prop_oneof![4 => 0.0..1.0, 1 => Just(f64::NAN)], 3 * JOINT_COUNT),
            motion in prop::sample::select(Motion::ALL.to_vec()),
            known in any::<bool>(),
            noise_px in 0.0..20.0,
        ) {
            let mut walk = walk(45.0, 3, 0.0);
            for (i, &(u, v)) in pixels.iter().enumerate() {
                walk.points_px[i / JOINT_COUNT].0[i % JOINT_COUNT] = DVec2::new(u, v);
                walk.weights[i / JOINT_COUNT].0[i % JOINT_COUNT] = weights[i];
            }
            let lengths = known.then(SegmentLengths::lee_chen);
            let options = SequenceOptions { lengths, motion, noise_px, ..SequenceOptions::default() };
            if let Ok(found) = walk.postures(&options) {
                prop_assert_eq!(found.frames.len(), 3);
                prop_assert_eq!(found.linked.figures.len(), 3);
                prop_assert!(found.warnings.iter().all(|warning| !warning.to_string().is_empty()));
            }
        }
    }
}
