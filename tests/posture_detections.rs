//! Postures from real detections of a man balancing on a beam, seen by two cameras, against joints triangulated
//! from four cameras. He does not walk: physical constraints alone.
//!
//! `cargo test --release -p memo-tests posture_detections -- --nocapture` prints the table,
//! with `MEMO_FULL=1` with estimated lengths as well.

use crate::recorded;

use glam::{DVec2, DVec3};
use memo_core::posture::anchor::AnchorSource;
use memo_core::posture::{AnchorChoice, Motion, Warning};
use memo_core::{
    Camera, Detector, Joint, KeypointSequence, Layout, PerJoint, PostureSequence, SegmentLengths,
    SequenceOptions, StickFigure, postures,
};

use crate::recordings;
use recorded::{keypoints, triangulated};

/// Known lengths of the segments, and with `MEMO_FULL=1` estimated ones, of which only a table is printed.
fn kinds_of_lengths() -> usize {
    if std::env::var_os("MEMO_FULL").is_some() { 2 } else { 1 }
}

/// The frame rate of the recording.
const RATE_HZ: f64 = 60.0;

/// The recording as one camera sees it.
struct Recording {
    camera: Camera,
    times_s: Vec<f64>,
    points_px: Vec<PerJoint<DVec2>>,
    weights: Vec<PerJoint<f64>>,
    head_px: Vec<[DVec2; 6]>,
    truth: Vec<StickFigure>,
}

fn recording(name: &str) -> Recording {
    let folder = recordings::path("keypoints/pose2sim_balancing");
    let read = |path: &str| std::fs::read_to_string(folder.join(path)).unwrap();
    let truth = triangulated(&read("S00_P00_T01_BalancingTrial_0-100_filt_butterworth.trc"));
    let camera = Camera::from_toml_str(&read("Calib_qualisys.toml"), Some(name)).unwrap();
    let short = name.replace('_', "");
    let detector = Detector::from_layout(Layout::by_name("body25b").unwrap());
    let mut found = Recording {
        camera,
        times_s: (0..truth.len()).map(|t| t as f64 / RATE_HZ).collect(),
        points_px: vec![],
        weights: vec![],
        head_px: vec![],
        truth,
    };
    for t in 0..found.times_s.len() {
        let seen = keypoints(&read(&format!("{short}_json/{short}.{t:04}.json")));
        // What is not detected is written as (0, 0) with score 0.
        let points: Vec<DVec2> = seen
            .iter()
            .map(|&[u, v, score]| if score > 0.0 { DVec2::new(u, v) } else { DVec2::NAN })
            .collect();
        let scores: Vec<f64> = seen.iter().map(|[.., score]| *score).collect();
        let joints = detector.stick_joints(&points, &scores).unwrap();
        found.points_px.push(PerJoint(joints.points_px));
        found.weights.push(PerJoint(joints.weights));
        found.head_px.push(detector.head_points(&points, &scores).unwrap().points_px);
    }
    found
}

impl Recording {
    fn postures(&self, options: &SequenceOptions) -> PostureSequence {
        let sequence = KeypointSequence {
            times_s: &self.times_s,
            points_px: &self.points_px,
            weights: &self.weights,
            head_points_px: Some(&self.head_px),
            foot_points_px: None,
        };
        postures(&sequence, &self.camera, options).unwrap()
    }

    /// Every joint on its ray as far before the camera as the neck.
    fn flat(&self, t: usize, neck: DVec3) -> StickFigure {
        let depth_m = self.camera.camera_from_world(neck).z;
        let place = |pixel: DVec2| match self.camera.undistort(pixel) {
            Ok(ideal_px) => {
                let ray = ((ideal_px - self.camera.centre_px) / self.camera.focal_px).extend(1.0);
                self.camera.rotation.transpose() * (ray * depth_m - self.camera.translation)
            }
            Err(_) => DVec3::NAN,
        };
        PerJoint(self.points_px[t].0.map(place))
    }
}

/// Median distances of the joints from the truth, cm: as found, and with the necks on each other.
fn medians_cm(found: &[StickFigure], truth: &[StickFigure]) -> [f64; 2] {
    let (mut raw, mut aligned) = (vec![], vec![]);
    for (found, truth) in found.iter().zip(truth) {
        let shift = truth[Joint::Neck] - found[Joint::Neck];
        for joint in Joint::ALL.into_iter().filter(|&joint| found[joint].is_finite()) {
            raw.push(100.0 * found[joint].distance(truth[joint]));
            aligned.push(100.0 * (found[joint] + shift).distance(truth[joint]));
        }
    }
    [raw, aligned].map(|mut errors| {
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    })
}

const CHOICES: [AnchorSource; 5] = [
    AnchorSource::Ground,
    AnchorSource::Trunk,
    AnchorSource::Extent,
    AnchorSource::Combined,
    AnchorSource::Head,
];

/// What detectors that disagree with the triangulated joints by 8-9 px need.
fn physical(lengths: Option<SegmentLengths>, anchor: AnchorChoice) -> SequenceOptions {
    let motion = Motion::Physical;
    SequenceOptions { lengths, noise_px: 6.0, motion, anchor, ..SequenceOptions::default() }
}

/// He leans and bends on a beam that is not the ground, so no source is exact; with lengths known, trunk and
/// all sources together must place the joints better than all at the neck's depth, over both cameras.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn postures_are_nearer_than_a_flat_figure() {
    let mut sums = [[0.0; 3]; 2];
    for name in ["cam_02", "cam_04"] {
        let recording = recording(name);
        let lengths = SegmentLengths::from_figures(&recording.truth).unwrap();
        let of_both = [("known lengths", Some(lengths)), ("estimated", None)];
        for (label, lengths) in of_both.into_iter().take(kinds_of_lengths()) {
            for source in CHOICES {
                let found = recording.postures(&physical(lengths, AnchorChoice::Source(source)));
                let necks = found.linked.figures.iter().map(|figure| figure[Joint::Neck]);
                let flat: Vec<StickFigure> = necks.enumerate().map(|(t, n)| recording.flat(t, n)).collect();
                let figures = medians_cm(&found.linked.figures, &recording.truth);
                let smoothed = medians_cm(&found.linked.smoothed, &recording.truth);
                let flat = medians_cm(&flat, &recording.truth);
                println!(
                    "{name} {label:13} {:8} linked {:5.1} smoothed {:5.1} flat {:5.1} cm; necks on each other \
                     {:5.1} {:5.1} {:5.1} cm",
                    source.name(),
                    figures[0],
                    smoothed[0],
                    flat[0],
                    figures[1],
                    smoothed[1],
                    flat[1]
                );
                assert_eq!(found.frames.iter().filter(|frame| frame.is_ok()).count(), 100);
                let of_sum = match source {
                    AnchorSource::Trunk => 0,
                    AnchorSource::Combined => 1,
                    _ => continue,
                };
                if label == "known lengths" {
                    for (sum, value) in sums[of_sum].iter_mut().zip([figures[0], smoothed[0], flat[0]]) {
                        *sum += 0.5 * value;
                    }
                }
            }
        }
    }
    println!("mean of the cameras, known lengths: trunk and combined, linked, smoothed, flat: {sums:.1?} cm");
    assert!(sums.iter().all(|[linked, smoothed, flat]| linked < flat && smoothed < flat), "{sums:?}");
}

/// The distance of the neck given: what is left is the posture alone.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn with_the_neck_known_joints_are_nearer_than_flat() {
    for (name, most_of_flat) in [("cam_02", 0.9), ("cam_04", 0.95)] {
        let recording = recording(name);
        let lengths = SegmentLengths::from_figures(&recording.truth).unwrap();
        let neck = |f: &StickFigure| recording.camera.camera_from_world(f[Joint::Neck]).length();
        let distance_m = recording.truth.iter().map(neck).collect();
        let found =
            recording.postures(&physical(Some(lengths), AnchorChoice::Given { distance_m, sd_m: 0.05 }));
        let flat: Vec<StickFigure> =
            (0..100).map(|t| recording.flat(t, found.linked.figures[t][Joint::Neck])).collect();
        let [linked, flat] =
            [&found.linked.figures, &flat].map(|figures| medians_cm(figures, &recording.truth)[0]);
        println!("{name}, neck known: linked {linked:.1}, flat {flat:.1} cm");
        assert!(linked < most_of_flat * flat, "{name}: {linked:.1} cm, flat {flat:.1} cm");
    }
}

fn is_against_rules(warning: &Warning) -> bool {
    use Warning::{AgainstRules, HabitsDropped, RulesDropped};
    matches!(warning, AgainstRules { .. } | HabitsDropped { .. } | RulesDropped { .. })
}

/// What the rules of walking say of a man who balances: they are dropped.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn rules_of_walking_on_a_man_who_balances() {
    for name in ["cam_02", "cam_04"] {
        let recording = recording(name);
        let lengths = SegmentLengths::from_figures(&recording.truth).unwrap();
        let options =
            SequenceOptions { motion: Motion::Walking, ..physical(Some(lengths), AnchorChoice::Auto) };
        let found = recording.postures(&options);
        let empty = found.frames.iter().flatten().filter(|frame| frame.survivors() == 0).count();
        println!("{name}: rules of walking leave nothing in {empty} of 100 frames, {:?}", found.heading);
        found.warnings.iter().for_each(|warning| println!("  {warning}"));
        assert_eq!(found.rules, Motion::Physical, "{:?}", found.warnings);
        assert!(found.warnings.iter().any(is_against_rules), "{:?}", found.warnings);
    }
}

/// Four walks of motion capture, three views at 1 px, the neck by all sources: rules of walking leave postures,
/// and no warning says that this is no walk.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn real_walks_look_like_walking() {
    let walks = recorded::walks();
    let mut rejected = [0; 2];
    for azimuth_deg in [0.0, 45.0, 90.0] {
        for walk in &walks {
            let middle = walk.figures[walk.figures.len() / 2][Joint::Pelvis];
            let camera = recorded::camera(middle, walk.forward, azimuth_deg, 6.0);
            let mut random = memo_core::synth::Random::new(3);
            let pixel = |p: DVec3, noise: [f32; 2]| {
                let [a, b] = noise.map(f64::from);
                camera.project(p).unwrap_or(DVec2::NAN) + DVec2::new(a, b)
            };
            let points_px: Vec<PerJoint<DVec2>> = walk
                .figures
                .iter()
                .map(|figure| PerJoint(figure.0.map(|p| pixel(p, random.normal_pair()))))
                .collect();
            let times_s: Vec<f64> = (0..points_px.len()).map(|t| t as f64 / walk.rate_hz).collect();
            let weights = vec![PerJoint([1.0; 14]); times_s.len()];
            let recording = Recording {
                camera,
                times_s,
                points_px,
                weights,
                head_px: vec![],
                truth: walk.figures.clone(),
            };
            let sequence = KeypointSequence {
                times_s: &recording.times_s,
                points_px: &recording.points_px,
                weights: &recording.weights,
                head_points_px: None,
                foot_points_px: None,
            };
            let of_both = [("known", Some(walk.lengths)), ("estimated", None)];
            for (label, lengths) in of_both.into_iter().take(kinds_of_lengths()) {
                let options = SequenceOptions { lengths, noise_px: 1.0, ..SequenceOptions::default() };
                let found = postures(&sequence, &recording.camera, &options).unwrap();
                let empty = found.frames.iter().flatten().filter(|frame| frame.survivors() == 0).count();
                let [raw, aligned] = medians_cm(&found.linked.smoothed, &recording.truth);
                println!(
                    "{azimuth_deg:2} deg {} {label:9}: {raw:.1} cm, necks on each other {aligned:.1} cm, \
                     nothing left in {empty} of {} frames, {}",
                    walk.name,
                    found.frames.len(),
                    found.heading.from.name()
                );
                found.warnings.iter().for_each(|warning| println!("    {warning}"));
                if label == "known" {
                    rejected[0] += usize::from(found.warnings.iter().any(is_against_rules));
                    rejected[1] += 1;
                }
            }
        }
    }
    println!("said not to look like walking, lengths known: {} of {} walks", rejected[0], rejected[1]);
    assert!(rejected[0] == 0, "{rejected:?}");
}
