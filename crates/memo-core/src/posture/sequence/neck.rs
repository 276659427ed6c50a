//! Distance of the neck in every frame, from the chosen sources, filtered over time.

use crate::wording::counted;
use std::collections::BTreeMap;
use std::fmt;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::lengths::SequenceLengths;
use super::{AnchorChoice, KeypointSequence, SequenceError, SequenceOptions, Warning};
use crate::estimate::median::median;
use crate::model::camera::Camera;
use crate::model::resection::{Resection, ResectionOptions, resect_in_image};
use crate::model::skeleton::{Joint, SegmentLengths};
use crate::posture::anchor::{
    Anchor, AnchorError, AnchorOptions, AnchorSource, Bending, Conflict, DepthMode, Ground, SmoothOptions,
    combine, from_extent, from_given, from_ground, from_trunk, smooth,
};
use crate::posture::head::{HeadModel, LEE_CHEN_BODY_HEIGHT_M};
use crate::posture::lift::JointRays;
use crate::posture::placed::Bearings;
use crate::{Progress, Stopped};

/// Input of all stages.
pub(super) struct Scene<'a> {
    pub sequence: &'a KeypointSequence<'a>,
    pub camera: &'a Camera,
    /// `None` if the camera is not above the ground.
    pub ground: Option<Ground>,
    pub rays: &'a [JointRays],
    pub lengths: &'a SequenceLengths,
    pub options: &'a SequenceOptions,
}

impl Scene<'_> {
    /// The world's upward direction in camera axes.
    pub fn up(&self) -> DVec3 {
        self.camera.rotation.z_axis
    }

    /// Vertical, moving direction (given in world axes) and head of a frame, in camera axes.
    pub fn bearings(&self, moving_direction: Option<DVec3>, head: Option<&Head>) -> Bearings {
        Bearings {
            up: Some(self.up()),
            heading: moving_direction.map(|direction| self.camera.rotation * direction),
            head: head.and_then(|head| head.axes),
        }
    }
}

/// Source of the distance of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NeckFrom {
    /// The frame's own image, by this source, and the neighbouring frames.
    Source(AnchorSource),
    /// Only the neighbouring frames: the image gives none, or was not evaluated, as in most frames of long
    /// sequences.
    Neighbours,
    /// No distance.
    Nothing,
}

impl NeckFrom {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Source(source) => source.name(),
            Self::Neighbours => "neighbours",
            Self::Nothing => "none",
        }
    }
}

/// Two sources that disagree in some frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SourceConflict {
    /// The sources.
    pub sources: [AnchorSource; 2],
    /// Number of frames in which they disagree.
    pub frames: usize,
    /// Number of frames with several sources.
    pub of: usize,
    /// Medians of their distances in these frames, metres.
    pub distances_m: [f64; 2],
    /// Median of the difference divided by its standard deviation.
    pub sigmas: f64,
}

impl fmt::Display for SourceConflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [(a, a_m), (b, b_m)] = [0, 1].map(|i| (self.sources[i].name(), self.distances_m[i]));
        write!(
            f,
            "the neck's distance is {a_m:.2} m by the {a} but {b_m:.2} m by the {b} ({:.1} standard deviations, \
             {} of {})",
            self.sigmas,
            self.frames,
            counted(self.of, "frame")
        )
    }
}

/// The neck's distance over the sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct NeckTrack {
    /// Distance along the neck's ray, metres; NaN if it is not known.
    pub distance_m: Vec<f64>,
    /// Its standard deviation, metres.
    pub sd_m: Vec<f64>,
    /// Source of each distance.
    pub from: Vec<NeckFrom>,
    /// Distances that are too uncertain to use, with standard deviation, metres: the deviation exceeds the
    /// distance.
    pub vague: Vec<Option<[f64; 2]>>,
    /// Sources that disagree.
    pub conflicts: Vec<SourceConflict>,
    /// The part of `sd_m` common to all frames, metres.
    pub common_sd_m: f64,
    /// The part of `sd_m` that is due to the scale of the lengths, relative to the distance.
    pub scale_sd: f64,
}

impl NeckTrack {
    /// The same distances in a camera whose focal length has a relative standard deviation.
    pub(super) fn of_focal(mut self, focal_sd: f64) -> Self {
        for (sd_m, distance_m) in self.sd_m.iter_mut().zip(&self.distance_m) {
            *sd_m = sd_m.hypot(focal_sd * distance_m);
        }
        let known_m: Vec<f64> =
            self.distance_m.iter().copied().filter(|distance_m| distance_m.is_finite()).collect();
        let mean_m = known_m.iter().sum::<f64>() / known_m.len().max(1) as f64;
        self.common_sd_m = self.common_sd_m.hypot(focal_sd * mean_m);
        self
    }

    /// Position of the neck in each frame, camera axes, metres; NaN if it is not seen or its distance is not
    /// known.
    pub fn places(&self, rays: &[JointRays]) -> Vec<DVec3> {
        let place = |(rays, &distance_m): (&JointRays, &f64)| match distance_m > 0.0 {
            true => rays.ray[Joint::Neck] * distance_m,
            false => DVec3::NAN,
        };
        rays.iter().zip(&self.distance_m).map(place).collect()
    }

    /// Removes distances that are smaller than their standard deviation.
    fn without_vague(mut self) -> Self {
        for t in 0..self.distance_m.len() {
            let found = [self.distance_m[t], self.sd_m[t]];
            if found[1] > found[0] {
                [self.distance_m[t], self.sd_m[t]] = [f64::NAN; 2];
                self.from[t] = NeckFrom::Nothing;
                self.vague[t] = Some(found);
            }
        }
        self
    }
}

/// The head of one frame.
#[derive(Debug, Clone)]
pub(super) struct Head {
    /// The neck's distance, metres, and its standard deviation.
    distance_m: f64,
    sd_m: f64,
    /// Axes x forward, y down, z left in camera axes, if the facing direction is certain enough.
    pub axes: Option<DMat3>,
}

/// Relative standard deviation of the size of the head between people of the same height, including where a
/// detector puts nose, eyes and ears.
const HEAD_SIZE_SD: f64 = 0.05;
/// A facing direction with a larger standard deviation is not used, radians: 10 degrees, with limits of 40 to 70.
const FACING_SD_RAD: f64 = 0.175;

/// The heads of the frames that show one.
pub(super) fn heads(scene: &Scene) -> Vec<Option<Head>> {
    let frames = scene.sequence.times_s.len();
    let Some(points_px) = scene.sequence.head_points_px else { return vec![None; frames] };
    let height_m = scene.options.height_m.unwrap_or_else(|| height_m(&scene.lengths.lengths));
    let Ok(model) = HeadModel::lee_chen_for_height(height_m) else { return vec![None; frames] };
    let noise_px = scene.options.noise_px;
    let options =
        ResectionOptions { image_sd: (noise_px > 0.0).then_some(noise_px), ..ResectionOptions::default() };
    let head = |points_px: &[glam::DVec2; 6]| {
        let seen: Vec<usize> = (0..6).filter(|&i| points_px[i].is_finite()).collect();
        let points: Vec<DVec3> = seen.iter().map(|&i| model.points_m[i]).collect();
        let pixels: Vec<_> = seen.iter().map(|&i| points_px[i]).collect();
        let found = resect_in_image(scene.camera, &points, &pixels, &options).ok()?;
        Some(head_of(&found, &model))
    };
    points_px.par_iter().map(head).collect()
}

/// The body height that has these segment lengths by the proportions of Table A.1.
fn height_m(lengths: &SegmentLengths) -> f64 {
    let legs = |l: &SegmentLengths| l.to[Joint::RightKnee] + l.to[Joint::RightAnkle];
    LEE_CHEN_BODY_HEIGHT_M * legs(lengths) / legs(&SegmentLengths::lee_chen())
}

/// The neck over all poses, weighted by their probabilities; the facing direction only if there is one pose.
fn head_of(found: &Resection, model: &HeadModel) -> Head {
    let mut total = 0.0;
    let mut sums = [0.0; 2];
    for pose in &found.poses {
        let neck = pose.point_in_camera(model.points_m[0]);
        let distance_m = neck.position.length();
        let ray = neck.position / distance_m;
        let variance = ray.dot(neck.covariance * ray);
        total += pose.probability;
        sums[0] += pose.probability * distance_m;
        sums[1] += pose.probability * (variance + distance_m * distance_m);
    }
    let distance_m = sums[0] / total;
    let sd_m = (sums[1] / total - distance_m * distance_m).max(0.0).sqrt();
    let best = found.best();
    let is_certain = !found.is_ambiguous() && best.facing().sd_rad() < FACING_SD_RAD;
    let [x, y, z] = [best.rotation.x_axis, -best.rotation.y_axis, -best.rotation.z_axis];
    Head { distance_m, sd_m, axes: is_certain.then(|| DMat3::from_cols(x, y, z)) }
}

/// The neck's distance from one frame.
struct FrameAnchor {
    /// The anchor, or the error of each source that was evaluated.
    anchor: Result<Anchor, Vec<AnchorError>>,
    conflicts: Vec<Conflict>,
    /// True if several sources were combined.
    is_combined: bool,
}

/// A person who bends accelerates the neck more than a walker: increase of its velocity's variance, (m/s)²/s. Values
/// of 1 and 3 give the same on ten motions.
const BENDING_VELOCITY_VARIANCE_PER_S: f64 = 1.0;

/// The neck's distance over the sequence. If no frame gives it, the error contains the reasons and `warnings`. With
/// `bending`, people may bend in the frames in which it is known which way they face.
pub(super) fn track(
    scene: &Scene,
    heads: &[Option<Head>],
    bending: Option<&[Option<Bending>]>,
    warnings: &[Warning],
    progress: &Progress,
) -> Result<NeckTrack, SequenceError> {
    let found = match &scene.options.anchor {
        AnchorChoice::Given { distance_m, sd_m } => {
            progress.advance(scene.rays.len())?;
            given(scene.rays, distance_m, *sd_m)
        }
        _ => {
            let asked = asked(scene.sequence.times_s);
            let found = anchors(scene, heads, bending, &asked, progress)?;
            let mut options = scene.options.smooth_options;
            if bending.is_some() {
                options.velocity_variance_per_s =
                    options.velocity_variance_per_s.max(BENDING_VELOCITY_VARIANCE_PER_S);
            }
            over_time(scene, &asked, found, &options)
        }
    };
    let no_neck = |reasons| SequenceError::NoNeck { reasons, warnings: warnings.to_vec() };
    found.map_err(no_neck).map(NeckTrack::without_vague)
}

/// [`track`] for a person who may bend; `None` if no frame gives a distance.
pub(super) fn again(
    scene: &Scene,
    heads: &[Option<Head>],
    bending: &[Option<Bending>],
    progress: &Progress,
) -> Result<Option<NeckTrack>, SequenceError> {
    match track(scene, heads, Some(bending), &[], progress) {
        Err(SequenceError::NoNeck { .. }) => Ok(None),
        found => found.map(Some),
    }
}

/// Anchors from the images, each frame alone.
fn anchors(
    scene: &Scene,
    heads: &[Option<Head>],
    bending: Option<&[Option<Bending>]>,
    asked: &[usize],
    progress: &Progress,
) -> Result<Vec<FrameAnchor>, Stopped> {
    let options = scene.lengths.anchor_options(&scene.options.anchor_options);
    let anchor = |(place, &t): (usize, &usize)| {
        let next = asked.get(place + 1).copied().unwrap_or(scene.rays.len());
        progress.advance(next - if place == 0 { 0 } else { t })?;
        let options = AnchorOptions { bending: bending.and_then(|bending| bending[t]), ..options };
        Ok(frame_anchor(scene, &options, &scene.rays[t], heads[t].as_ref()))
    };
    asked.par_iter().enumerate().map(anchor).collect()
}

/// Filters all frames together.
fn over_time(
    scene: &Scene,
    asked: &[usize],
    found: Vec<FrameAnchor>,
    options: &SmoothOptions,
) -> Result<NeckTrack, Vec<AnchorError>> {
    let times_s = scene.sequence.times_s;
    let conflicts = conflicts(&found);
    let mut errors = Vec::new();
    let anchors: Vec<Option<Anchor>> = found
        .into_iter()
        .map(|f| f.anchor.map_err(|mut of_frame| errors.append(&mut of_frame)).ok())
        .collect();
    if anchors.iter().all(Option::is_none) {
        return Err(told_once(errors));
    }
    let asked_s: Vec<f64> = asked.iter().map(|&t| times_s[t]).collect();
    let track = smooth(&asked_s, &anchors, options).map_err(|error| vec![error])?;
    let mut from = vec![NeckFrom::Neighbours; times_s.len()];
    for (&t, anchor) in asked.iter().zip(&anchors) {
        from[t] = anchor.as_ref().map_or(NeckFrom::Neighbours, |anchor| NeckFrom::Source(anchor.source));
    }
    let mut of_scale: Vec<f64> = anchors.iter().flatten().map(|a| a.sd_scale_m / a.distance_m).collect();
    of_scale.sort_by(f64::total_cmp);
    Ok(NeckTrack {
        from,
        vague: vec![None; times_s.len()],
        distance_m: interpolated(times_s, &asked_s, &track.distance_m),
        sd_m: interpolated(times_s, &asked_s, &track.sd_m),
        conflicts,
        common_sd_m: track.common_sd_m,
        scale_sd: of_scale[of_scale.len() / 2],
    })
}

/// Every frame is evaluated up to this number; longer sequences have one evaluation per [`ANCHOR_INTERVAL_S`].
const ALL_ASKED: usize = 500;
/// Postures, and with them the errors of the sources, are similar within a fraction of a step, seconds.
const ANCHOR_INTERVAL_S: f64 = 0.2;

/// Frames whose images are evaluated for the neck's distance, ascending, including the first and the last.
fn asked(times_s: &[f64]) -> Vec<usize> {
    if times_s.len() <= ALL_ASKED {
        return (0..times_s.len()).collect();
    }
    let mut asked = vec![0];
    let mut last_s = times_s[0];
    for (t, &time_s) in times_s.iter().enumerate() {
        if time_s - last_s >= ANCHOR_INTERVAL_S - 1e-9 || t + 1 == times_s.len() {
            asked.push(t);
            last_s = time_s;
        }
    }
    asked
}

/// Linear interpolation from some times to all. Times ascend; the first and the last are known.
fn interpolated(times_s: &[f64], known_s: &[f64], known: &[f64]) -> Vec<f64> {
    let at = |&time_s: &f64| {
        let after = known_s.partition_point(|&s| s < time_s).min(known_s.len() - 1);
        let before = after.saturating_sub(usize::from(known_s[after] > time_s));
        let span_s = known_s[after] - known_s[before];
        let share = if span_s > 0.0 { (time_s - known_s[before]) / span_s } else { 0.0 };
        known[before] + share * (known[after] - known[before])
    };
    times_s.iter().map(at).collect()
}

/// Each distinct error once, in order of first occurrence.
fn told_once(errors: Vec<AnchorError>) -> Vec<AnchorError> {
    let mut once: Vec<AnchorError> = Vec::new();
    for error in errors {
        use AnchorError::{NotPositive, NothingFits};
        let is_told = |told: &AnchorError| match (told, &error) {
            (NothingFits { source_name: a, .. }, NothingFits { source_name: b, .. }) => a == b,
            (NotPositive { what: a, .. }, NotPositive { what: b, .. }) => a == b,
            (told, error) => told == error,
        };
        if !once.iter().any(is_told) {
            once.push(error);
        }
    }
    once
}

/// Given distances are used unchanged.
fn given(rays: &[JointRays], distance_m: &[f64], sd_m: f64) -> Result<NeckTrack, Vec<AnchorError>> {
    let distance = |t: usize| distance_m[t.min(distance_m.len() - 1)];
    let mut errors = Vec::new();
    let known: Vec<Option<f64>> = rays
        .iter()
        .enumerate()
        .map(|(t, rays)| from_given(rays, distance(t), sd_m).map_err(|e| errors.push(e)).ok())
        .map(|anchor| anchor.map(|anchor| anchor.distance_m))
        .collect();
    if known.iter().all(Option::is_none) {
        return Err(told_once(errors));
    }
    let source = NeckFrom::Source(AnchorSource::Given);
    Ok(NeckTrack {
        vague: vec![None; rays.len()],
        distance_m: known.iter().map(|d| d.unwrap_or(f64::NAN)).collect(),
        sd_m: known.iter().map(|d| d.map_or(f64::NAN, |_| sd_m)).collect(),
        from: known.iter().map(|d| d.map_or(NeckFrom::Nothing, |_| source)).collect(),
        conflicts: Vec::new(),
        common_sd_m: sd_m,
        scale_sd: 0.0,
    })
}

/// The anchor of one frame: from the chosen source, or combined from the sources that the frame allows.
fn frame_anchor(
    scene: &Scene,
    options: &AnchorOptions,
    rays: &JointRays,
    head: Option<&Head>,
) -> FrameAnchor {
    use AnchorSource::{Combined, Extent, Given, Trunk};
    let lengths = &scene.lengths.lengths;
    let up = Some(scene.up());
    let by = |source: AnchorSource| match source {
        AnchorSource::Ground => match &scene.ground {
            Some(ground) => from_ground(rays, lengths, ground, options),
            None => Err(AnchorError::NotSeen { source_name: source, missing: "ground below the camera" }),
        },
        Trunk => from_trunk(rays, lengths, up, options).map(|fit| fit.anchor),
        AnchorSource::Head => from_head(rays, head),
        Extent | Combined | Given => from_extent(rays, lengths, up, options),
    };
    // Who bends is not as high as the extent assumes: it is used only if there is nothing better.
    let (all, rest) = match options.bending {
        None => (vec![AnchorSource::Ground, Trunk, Extent], vec![]),
        Some(_) => (vec![AnchorSource::Ground, Trunk], vec![Extent]),
    };
    let (asked, or_else) = match scene.options.anchor {
        AnchorChoice::Source(source) if ![Combined, Given].contains(&source) => (vec![source], vec![]),
        AnchorChoice::Source(_) => (all, rest),
        _ => (all, [rest, vec![AnchorSource::Head]].concat()),
    };
    let mut errors = Vec::new();
    let mut ask = |source| by(source).map_err(|error| errors.push(error)).ok();
    let mut found: Vec<Anchor> = asked.into_iter().filter_map(&mut ask).collect();
    if found.is_empty() {
        found.extend(or_else.into_iter().find_map(ask));
    }
    if found.is_empty() {
        return FrameAnchor { anchor: Err(errors), conflicts: Vec::new(), is_combined: false };
    }
    let is_combined = found.len() > 1;
    match combine(&found) {
        Ok(combination) => {
            FrameAnchor { anchor: Ok(combination.anchor), conflicts: combination.conflicts, is_combined }
        }
        Err(error) => FrameAnchor { anchor: Err(vec![error]), conflicts: Vec::new(), is_combined },
    }
}

fn from_head(rays: &JointRays, head: Option<&Head>) -> Result<Anchor, AnchorError> {
    let source_name = AnchorSource::Head;
    let Some(head) = head else {
        return Err(AnchorError::NotSeen { source_name, missing: "four of the six points of the head" });
    };
    if !rays.sees(Joint::Neck) {
        return Err(AnchorError::NotSeen { source_name, missing: "neck" });
    }
    let distance_m = head.distance_m;
    let sd_scale_m = HEAD_SIZE_SD * distance_m;
    let sd_depth_m = head.sd_m.hypot(sd_scale_m);
    if !(sd_depth_m.is_finite() && distance_m > 0.0) {
        return Err(AnchorError::NotPositive { what: "distance of the neck by the head", value: distance_m });
    }
    Ok(Anchor {
        neck: rays.ray[Joint::Neck] * distance_m,
        distance_m,
        sd_depth_m,
        sd_scale_m,
        source: source_name,
        modes: vec![DepthMode { distance_m, sd_m: sd_depth_m, probability: 1.0 }],
    })
}

/// Conflicts of all frames, by pairs of sources.
fn conflicts(found: &[FrameAnchor]) -> Vec<SourceConflict> {
    let of = found.iter().filter(|frame| frame.is_combined).count();
    let mut pairs: BTreeMap<[AnchorSource; 2], Vec<&Conflict>> = BTreeMap::new();
    for conflict in found.iter().flat_map(|frame| &frame.conflicts) {
        pairs.entry(conflict.sources).or_default().push(conflict);
    }
    let median = |mut values: Vec<f64>| median(&mut values).unwrap_or(f64::NAN);
    let pair = |(sources, list): ([AnchorSource; 2], Vec<&Conflict>)| SourceConflict {
        sources,
        frames: list.len(),
        of,
        distances_m: [0, 1].map(|i| median(list.iter().map(|c| c.distances_m[i]).collect())),
        sigmas: median(list.iter().map(|c| c.sigmas).collect()),
    };
    pairs.into_iter().map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::Camera;
    use crate::posture::prior::MotionPrior;
    use crate::posture::sequence::example::{walk, with_lengths};

    #[test]
    fn long_sequences_are_asked_now_and_then() {
        let times_s: Vec<f64> = (0..1001).map(|t| f64::from(t) / 50.0).collect();
        let asked = asked(&times_s);
        assert_eq!(asked.len(), 101);
        assert_eq!([asked[0], asked[1], asked[100]], [0, 10, 1000]);
        let known_s: Vec<f64> = asked.iter().map(|&t| times_s[t]).collect();
        let line: Vec<f64> = known_s.iter().map(|s| 3.0 + 2.0 * s).collect();
        let all = interpolated(&times_s, &known_s, &line);
        assert!(all.iter().zip(&times_s).all(|(value, s)| (value - 3.0 - 2.0 * s).abs() < 1e-9));
        assert_eq!(super::asked(&times_s[..500]).len(), 500);
    }

    /// If lengths are a tenth longer than the paper's, the height is a tenth larger.
    #[test]
    fn taller_legs_are_of_taller_people() {
        let mut lengths = SegmentLengths::lee_chen();
        lengths.to.0.iter_mut().for_each(|length| *length *= 1.1);
        assert!((height_m(&lengths) - 1.1 * 1.608).abs() < 1e-12);
    }

    /// A head seen without noise: position of the neck and facing direction, both certain.
    #[test]
    fn a_head_has_the_neck_and_the_facing_that_it_was_drawn_with() {
        let mut walk = walk(60.0, 3, 0.0);
        walk.head_points_px = Some((0..3).map(|t| walk.head_px(t)).collect());
        let options = SequenceOptions { height_m: Some(LEE_CHEN_BODY_HEIGHT_M), ..with_lengths() };
        let found = walk.postures(&options).unwrap();
        let rays = found.frames.iter().map(|frame| frame.as_ref().unwrap().tree.view.rays);
        let rays: Vec<JointRays> = rays.collect();
        let (sequence, lengths) = (walk.sequence(), &found.lengths);
        let ground = Some(Ground::of(&walk.camera));
        let scene = Scene {
            sequence: &sequence,
            camera: &walk.camera,
            ground,
            rays: &rays,
            lengths,
            options: &options,
        };
        for (t, head) in heads(&scene).into_iter().enumerate() {
            let head = head.unwrap();
            let truth_m = walk.camera.camera_from_world(walk.truth[t][Joint::Neck]).length();
            assert!((head.distance_m - truth_m).abs() < 1e-6, "{} {truth_m}", head.distance_m);
            // A head of 20 cm at 5 m: some centimetres per pixel.
            assert!((0.01..0.5).contains(&head.sd_m), "{}", head.sd_m);
            let axes = head.axes.unwrap();
            let expected = [walk.forward, DVec3::NEG_Z, DVec3::Z.cross(walk.forward)];
            for (axis, expected) in [axes.x_axis, axes.y_axis, axes.z_axis].into_iter().zip(expected) {
                assert!((axis - walk.camera.rotation * expected).length() < 1e-6, "{axis} {expected}");
            }
            // Bearings for the rules: the vertical, the direction and the face.
            let bearings = scene.bearings(Some(walk.forward), Some(&head));
            assert_eq!(bearings.up, Some(walk.camera.rotation * DVec3::Z));
            assert_eq!(bearings.heading, Some(walk.camera.rotation * walk.forward));
            assert_eq!(bearings.head, head.axes);
        }
    }

    /// Two poses of a head 4 and 5 m away, one three times as probable: mean, and variance between and within.
    #[test]
    fn several_poses_of_a_head_are_one_distance_with_their_spread() {
        let camera = Camera::level([1280, 720], 1.0, 1.2, 4.0).unwrap();
        let model = HeadModel::lee_chen();
        let turn = DMat3::from_cols(DVec3::NEG_Z, DVec3::NEG_Y, DVec3::NEG_X);
        let at = |distance_m: f64| DVec3::Z * distance_m - turn * model.points_m[0];
        let pixels: Vec<glam::DVec2> = model
            .points_m
            .iter()
            .map(|point| turn * *point + at(4.0))
            .map(|q| q.truncate() / q.z * camera.focal_px + camera.centre_px)
            .collect();
        let options = ResectionOptions { image_sd: Some(0.2), ..ResectionOptions::default() };
        let found = resect_in_image(&camera, &model.points_m, &pixels, &options).unwrap();
        let neck = found.best().point_in_camera(model.points_m[0]);
        let variance = DVec3::Z.dot(neck.covariance * DVec3::Z);
        let one = head_of(&Resection { poses: vec![found.best().clone()], minima: 1 }, &model);
        assert!((one.distance_m - 4.0).abs() < 1e-6 && (one.sd_m.powi(2) / variance - 1.0).abs() < 1e-6);
        assert!(one.axes.is_some());
        let [mut near, mut far] = [found.best().clone(), found.best().clone()];
        (near.probability, far.probability) = (0.75, 0.25);
        far.translation.z += 1.0;
        let two = head_of(&Resection { poses: vec![near, far], minima: 2 }, &model);
        assert!((two.distance_m - 4.25).abs() < 1e-6);
        // A distance with two values 1 m apart and odds of three to one: variance 3/16.
        assert!((two.sd_m.powi(2) - variance - 3.0 / 16.0).abs() < 1e-6, "{}", two.sd_m);
        assert!(two.axes.is_none(), "an ambiguous face decides nothing");
    }

    /// A facing direction whose noise exceeds 10 degrees is not used either.
    #[test]
    fn a_face_seen_badly_decides_nothing() {
        let mut walk = walk(60.0, 2, 0.0);
        walk.head_points_px = Some((0..2).map(|t| walk.head_px(t)).collect());
        let faces = |noise_px: f64| {
            let options = SequenceOptions { noise_px, min_travel_m: 9.0, ..with_lengths() };
            walk.postures(&options).unwrap().heading.from.name()
        };
        assert_eq!([faces(0.5), faces(12.0)], ["head", "trunk"]);
    }

    #[test]
    fn the_head_s_distance_is_as_unsure_as_its_size() {
        let mut rays = JointRays::from_points(&crate::model::skeleton::StickFigure::UNKNOWN);
        let head = Head { distance_m: 4.0, sd_m: 0.15, axes: None };
        assert!(matches!(from_head(&rays, Some(&head)), Err(AnchorError::NotSeen { missing: "neck", .. })));
        rays.ray[Joint::Neck] = DVec3::new(0.6, 0.0, 0.8);
        let anchor = from_head(&rays, Some(&head)).unwrap();
        // 5 % of 4 m beside 15 cm.
        assert!((anchor.sd_scale_m - 0.2).abs() < 1e-12 && (anchor.sd_depth_m - 0.25).abs() < 1e-12);
        assert!((anchor.neck - DVec3::new(2.4, 0.0, 3.2)).length() < 1e-12);
        assert!(matches!(from_head(&rays, None), Err(AnchorError::NotSeen { .. })));
    }

    /// Ground, trunk and extent are combined as far as they are seen; the head alone is used if it was not
    /// excluded.
    #[test]
    fn sources_are_asked_as_chosen() {
        let walk = walk(60.0, 1, 0.5);
        let found = walk.postures(&with_lengths()).unwrap();
        let rays = [found.frames[0].as_ref().unwrap().tree.view.rays];
        let (sequence, lengths) = (walk.sequence(), &found.lengths);
        let ground = Ground::of(&walk.camera);
        let head = Head { distance_m: 9.0, sd_m: 0.1, axes: None };
        let ask = |anchor: AnchorChoice, rays: &[JointRays]| {
            let options = SequenceOptions { anchor, ..with_lengths() };
            let scene = Scene {
                sequence: &sequence,
                camera: &walk.camera,
                ground: Some(ground),
                rays,
                lengths,
                options: &options,
            };
            let anchor_options = lengths.anchor_options(&options.anchor_options);
            frame_anchor(&scene, &anchor_options, &rays[0], Some(&head))
        };
        let options = AnchorOptions::default();
        let up = Some(walk.camera.rotation * DVec3::Z);
        let table = SegmentLengths::lee_chen();
        let by_ground = from_ground(&rays[0], &table, &ground, &options).unwrap();
        let by_trunk = from_trunk(&rays[0], &table, up, &options).unwrap().anchor;
        let by_extent = from_extent(&rays[0], &table, up, &options).unwrap();
        let all = combine(&[by_ground.clone(), by_trunk.clone(), by_extent.clone()]).unwrap().anchor;
        for choice in [AnchorChoice::Auto, AnchorChoice::Source(AnchorSource::Combined)] {
            let found = ask(choice, &rays);
            assert!(found.is_combined && found.anchor == Ok(all.clone()));
        }
        for single in [by_ground, by_trunk, by_extent] {
            let found = ask(AnchorChoice::Source(single.source), &rays);
            assert!(!found.is_combined && found.anchor == Ok(single));
        }
        // Only the neck is seen: the head is the only source.
        let mut neck_alone = JointRays::from_points(&crate::model::skeleton::StickFigure::UNKNOWN);
        neck_alone.ray[Joint::Neck] = rays[0].ray[Joint::Neck];
        let auto = ask(AnchorChoice::Auto, &[neck_alone]).anchor.unwrap();
        assert_eq!((auto.source, auto.distance_m), (AnchorSource::Head, 9.0));
        let combined = ask(AnchorChoice::Source(AnchorSource::Combined), &[neck_alone]).anchor;
        assert_eq!(combined.unwrap_err().len(), 3);
    }

    /// Of who may bend, the extent is not used beside ground and trunk, but where only neck and feet are seen.
    #[test]
    fn who_may_bend_need_not_be_as_high_as_the_extent_assumes() {
        let walk = walk(60.0, 1, 0.0);
        let found = walk.postures(&with_lengths()).unwrap();
        let lengths = &found.lengths;
        let options = with_lengths();
        let mut rays = [found.frames[0].as_ref().unwrap().tree.view.rays];
        let ground = Ground::of(&walk.camera);
        let MotionPrior { trunk_lean: lean, balance, .. } = MotionPrior::any();
        let front = walk.camera.rotation * walk.forward;
        let bending = balance.map(|balance| Bending { front, lean, balance });
        let told = AnchorOptions { bending, ..lengths.anchor_options(&options.anchor_options) };
        let ask = |rays: &[JointRays; 1]| {
            let (sequence, camera) = (&walk.sequence(), &walk.camera);
            let scene = Scene { sequence, camera, ground: Some(ground), rays, lengths, options: &options };
            frame_anchor(&scene, &told, &rays[0], None).anchor.unwrap()
        };
        let up = Some(walk.camera.rotation * DVec3::Z);
        let by_ground = from_ground(&rays[0], &lengths.lengths, &ground, &told).unwrap();
        let by_trunk = from_trunk(&rays[0], &lengths.lengths, up, &told).unwrap().anchor;
        assert_eq!(ask(&rays), combine(&[by_ground, by_trunk]).unwrap().anchor);
        for joint in Joint::ALL {
            if ![Joint::Neck, Joint::RightAnkle, Joint::LeftAnkle].contains(&joint) {
                rays[0].ray[joint] = DVec3::NAN;
            }
        }
        assert_eq!(ask(&rays).source, AnchorSource::Extent);
    }

    /// Conflicts are counted among the frames with several sources, with the medians of their distances.
    #[test]
    fn conflicts_are_counted_by_pairs_of_sources() {
        let conflict = |a_m: f64, b_m: f64, sigmas: f64| Conflict {
            sources: [AnchorSource::Ground, AnchorSource::Trunk],
            distances_m: [a_m, b_m],
            sigmas,
        };
        let frame = |conflicts: Vec<Conflict>, is_combined: bool| FrameAnchor {
            anchor: Err(vec![]),
            conflicts,
            is_combined,
        };
        let frames = [
            frame(vec![conflict(4.0, 5.0, 3.5)], true),
            frame(vec![], true),
            frame(vec![conflict(4.4, 5.2, 3.1)], true),
            frame(vec![conflict(4.2, 5.9, 9.0)], true),
            frame(vec![], false),
        ];
        let expected = SourceConflict {
            sources: [AnchorSource::Ground, AnchorSource::Trunk],
            frames: 3,
            of: 4,
            distances_m: [4.2, 5.2],
            sigmas: 3.5,
        };
        assert_eq!(conflicts(&frames), [expected]);
    }

    /// An error common to all sources stays in the track: here at least the scale of the lengths.
    #[test]
    fn what_all_frames_share_does_not_average_out() {
        let walk = walk(60.0, 30, 0.3);
        let found = walk.postures(&with_lengths()).unwrap();
        let mean_m = found.neck.distance_m.iter().sum::<f64>() / 30.0;
        assert!(found.neck.common_sd_m > 0.5 * found.neck.scale_sd * mean_m, "{:?}", found.neck.common_sd_m);
        assert!(found.neck.sd_m.iter().all(|sd| *sd >= found.neck.common_sd_m));
        // A distance smaller than its standard deviation is not used.
        let vague = NeckTrack { sd_m: vec![9.0; 30], ..found.neck.clone() }.without_vague();
        assert!(vague.distance_m.iter().all(|d| d.is_nan()) && vague.vague.iter().all(Option::is_some));
    }

    /// The error of an assumed focal length is a share of every distance, and common to all.
    #[test]
    fn an_assumed_focal_length_makes_distances_less_sure() {
        let walk = walk(60.0, 12, 0.3);
        let [known, assumed] = [0.0, 0.2]
            .map(|focal_sd| walk.postures(&SequenceOptions { focal_sd, ..with_lengths() }).unwrap());
        // Toes that are not seen are NaN, which equals nothing.
        assert_eq!(
            format!("{:?}", known.linked),
            format!("{:?}", assumed.linked),
            "the figures are the same"
        );
        for t in 0..12 {
            let distance_m = known.neck.distance_m[t];
            let expected_m = known.neck.sd_m[t].hypot(0.2 * distance_m);
            assert!((assumed.neck.sd_m[t] - expected_m).abs() < 1e-12);
            assert!(assumed.sd_m[t][Joint::Neck] > 0.19 * distance_m);
        }
        assert!(assumed.neck.common_sd_m > 0.19 * known.neck.distance_m[0]);
        let anchor = AnchorChoice::Given { distance_m: vec![4.0], sd_m: 0.05 };
        let given = walk.postures(&SequenceOptions { focal_sd: 0.2, anchor, ..with_lengths() }).unwrap();
        assert!(given.neck.sd_m.iter().all(|sd_m| (sd_m - 0.05).abs() < 1e-12));
    }
}
