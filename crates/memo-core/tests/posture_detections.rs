//! Postures from real detections of a man balancing on a beam, seen by two cameras, against joints triangulated
//! from four cameras. He does not walk: physical constraints alone.
//!
//! `cargo test --release -p memo-core --test posture_detections -- --nocapture` prints the table.

mod recorded;

use glam::{DVec2, DVec3};
use memo_core::model::Camera;
use memo_core::posture::anchor::AnchorSource;
use memo_core::posture::detector::{Detector, Layout};
use memo_core::posture::sequence::{
    AnchorChoice, KeypointSequence, Motion, PostureSequence, SequenceOptions, postures,
};
use memo_core::posture::skeleton::{Joint, PerJoint, SegmentLengths, StickFigure};

use recorded::{keypoints, shared, triangulated};

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

fn recording(name: &str) -> Option<Recording> {
    let folder = shared("keypoints/pose2sim_balancing")?;
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
    Some(found)
}

impl Recording {
    fn postures(&self, options: &SequenceOptions) -> PostureSequence {
        let sequence = KeypointSequence {
            times_s: &self.times_s,
            points_px: &self.points_px,
            weights: &self.weights,
            head_points_px: Some(&self.head_px),
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

#[test]
fn explore() {
    for name in ["cam_02", "cam_04"] {
        let Some(recording) = recording(name) else { return };
        let true_lengths = SegmentLengths::from_figures(&recording.truth).unwrap();
        for (label, lengths, height_m) in
            [("given", Some(true_lengths), None), ("height", None, Some(1.72)), ("none", None, None)]
        {
            for (choice, anchor) in [
                ("ground", AnchorChoice::Source(AnchorSource::Ground)),
                ("trunk", AnchorChoice::Source(AnchorSource::Trunk)),
                ("extent", AnchorChoice::Source(AnchorSource::Extent)),
                ("combined", AnchorChoice::Source(AnchorSource::Combined)),
                ("head", AnchorChoice::Source(AnchorSource::Head)),
            ] {
                let options = SequenceOptions {
                    lengths,
                    height_m,
                    noise_px: 6.0,
                    motion: Motion::Physical,
                    anchor,
                    ..SequenceOptions::default()
                };
                let start = std::time::Instant::now();
                let found = recording.postures(&options);
                let s = start.elapsed().as_secs_f64();
                let flat: Vec<StickFigure> = (0..found.frames.len())
                    .map(|t| recording.flat(t, found.linked.figures[t][Joint::Neck]))
                    .collect();
                let [raw, aligned] = medians_cm(&found.linked.figures, &recording.truth);
                let [sraw, saligned] = medians_cm(&found.linked.smoothed, &recording.truth);
                let [fraw, faligned] = medians_cm(&flat, &recording.truth);
                let true_d: f64 = recording
                    .truth
                    .iter()
                    .map(|f| recording.camera.camera_from_world(f[Joint::Neck]).length())
                    .sum::<f64>()
                    / 100.0;
                let d: f64 = found.neck.distance_m.iter().sum::<f64>() / found.frames.len() as f64;
                let empty = found.frames.iter().flatten().filter(|f| f.survivors() == 0).count();
                let mut surv: Vec<usize> = found.frames.iter().flatten().map(|f| f.survivors()).collect();
                surv.sort();
                println!(
                    "{name} {label:6} {choice:8} raw {raw:5.1} al {aligned:5.1} smoothed {sraw:5.1} {saligned:5.1} flat {fraw:5.1} {faligned:5.1} cm; neck {d:.2} (true {true_d:.2}) sd {:.2}; thigh {:.3} (true {:.3}) empty {empty} median {} max {} time {s:.2}",
                    found.neck.sd_m[50],
                    found.lengths.lengths.to[Joint::RightKnee],
                    true_lengths.to[Joint::RightKnee],
                    surv[surv.len() / 2],
                    surv[surv.len() - 1]
                );
                if choice == "combined" {
                    for w in &found.warnings {
                        println!("    {w}");
                    }
                    for r in memo_core::posture::sequence::reason_totals(&found.frames).iter().take(6) {
                        println!("   -- {} {} {}", r.constraint.description(), r.branches, r.frames);
                    }
                }
            }
        }
    }
}

#[test]
fn oracle() {
    use memo_core::posture::lift::{JointRays, roots};
    for name in ["cam_02", "cam_04"] {
        let Some(recording) = recording(name) else { return };
        let true_lengths = SegmentLengths::from_figures(&recording.truth).unwrap();
        println!("{name} focal {:?} pos {:?}", recording.camera.focal_px, recording.camera.position());
        println!("scores {:?}", recording.weights[50].0);
        println!("head px {:?}", recording.head_px[50]);
        let t0 = &recording.truth[50];
        println!("true px {:?}", t0.0.map(|p| recording.camera.project(p).unwrap().round()));
        println!("det  px {:?}", recording.points_px[50].0.map(|p| p.round()));
        println!("true cam {:?}", t0.0.map(|p| (recording.camera.camera_from_world(p) * 100.0).round()));
        for noise in [3.0, 6.0, 8.0, 12.0] {
            let d: Vec<f64> = recording
                .truth
                .iter()
                .map(|f| recording.camera.camera_from_world(f[Joint::Neck]).length())
                .collect();
            let options = SequenceOptions {
                lengths: Some(true_lengths),
                noise_px: noise,
                motion: Motion::Physical,
                anchor: AnchorChoice::Given { distance_m: d.clone(), sd_m: 0.05 },
                ..SequenceOptions::default()
            };
            let found = recording.postures(&options);
            let mut oracle = vec![];
            for t in 0..100 {
                let rays = JointRays::from_pixels(
                    &recording.camera,
                    &recording.points_px[t],
                    &PerJoint([1.0; 14]),
                    noise,
                )
                .unwrap();
                let tc =
                    memo_core::posture::sequence::figure_in_camera(&recording.truth[t], &recording.camera);
                let mut leaf = StickFigure::UNKNOWN;
                leaf[Joint::Neck] = rays.ray[Joint::Neck] * d[t];
                for joint in Joint::ALL.into_iter().skip(1) {
                    let start = leaf[joint.start().unwrap()];
                    let r = roots(start, rays.ray[joint], true_lengths.to[joint], 0.0, 0.0);
                    let v = tc.segment(joint);
                    leaf[joint] = if (r.near - start).distance(v) <= (r.far - start).distance(v) {
                        r.near
                    } else {
                        r.far
                    };
                }
                oracle.push(memo_core::posture::sequence::figure_in_world(&leaf, &recording.camera));
            }
            let flat: Vec<StickFigure> =
                (0..100).map(|t| recording.flat(t, found.linked.figures[t][Joint::Neck])).collect();
            println!("{:?}", found.heading);
            println!(
                "{name} noise {noise} oracle {:.1?} linked {:.1?} smoothed {:.1?} flat {:.1?}",
                medians_cm(&oracle, &recording.truth),
                medians_cm(&found.linked.figures, &recording.truth),
                medians_cm(&found.linked.smoothed, &recording.truth),
                medians_cm(&flat, &recording.truth)
            );
            if noise == 6.0 {
                use std::collections::BTreeMap;
                let mut counts: [BTreeMap<String, usize>; 2] = Default::default();
                for t in 0..100 {
                    let Ok(fr) = &found.frames[t] else { continue };
                    let opts = memo_core::posture::tree::TreeOptions::physical();
                    for (k, f) in [&oracle[t], &found.linked.figures[t]].into_iter().enumerate() {
                        let c = memo_core::posture::sequence::figure_in_camera(f, &recording.camera);
                        let v = fr.tree.view.violations(fr.tree.view.nearest_path(&c), &opts);
                        if v.is_empty() {
                            *counts[k].entry("(none)".into()).or_default() += 1;
                        }
                        for x in v {
                            *counts[k].entry(x.constraint.name()).or_default() += 1;
                        }
                    }
                }
                println!("oracle breaks {:?}", counts[0]);
                println!("linked breaks {:?}", counts[1]);
                println!("empty {}", found.frames.iter().flatten().filter(|f| f.survivors() == 0).count());
            }
            println!("{:?}", found.linked.second.map(|s| (s.joints, s.from, s.to, s.margin)));
            if noise == 6.0 {
                for j in Joint::ALL {
                    let e = |f: &Vec<StickFigure>| {
                        let mut v: Vec<f64> = (0..100)
                            .map(|t| 100.0 * (f[t][j] - recording.truth[t][j]).length())
                            .filter(|e| e.is_finite())
                            .collect();
                        v.sort_by(f64::total_cmp);
                        v[v.len() / 2]
                    };
                    println!(
                        "  {:15} oracle {:.1} linked {:.1} flat {:.1}",
                        j.name(),
                        e(&oracle),
                        e(&found.linked.figures),
                        e(&flat)
                    );
                }
            }
        }
    }
}
