//! Where the neck is, from each source, against motion capture and against triangulated joints.

use crate::recorded;

use memo_core::posture::anchor::{
    Anchor, AnchorOptions, Ground, SmoothOptions, combine, from_extent, from_ground, from_trunk, smooth,
};
use memo_core::posture::lift::JointRays;
use memo_core::synth::Random;
use memo_core::{Camera, Joint, PerJoint, SegmentLengths, StickFigure};

use crate::recordings;
use recorded::{camera, detected, triangulated, view, walks};

/// Errors of one source with what it stated.
#[derive(Default)]
struct Errors(Vec<(f64, f64)>);

impl Errors {
    fn add(&mut self, anchor: &Anchor, truth: f64) {
        self.0.push((anchor.distance_m - truth, anchor.sd_depth_m));
    }
    /// What is left without the mean, the error common to all.
    fn about_mean(&self) -> Vec<(f64, f64)> {
        let mean = self.mean();
        self.0.iter().map(|(e, s)| (e - mean, *s)).collect()
    }
    fn rms(&self) -> f64 {
        (self.0.iter().map(|(e, _)| e * e).sum::<f64>() / self.0.len() as f64).sqrt()
    }
    fn mean(&self) -> f64 {
        self.0.iter().map(|(e, _)| e).sum::<f64>() / self.0.len() as f64
    }
    fn stated(&self) -> f64 {
        (self.0.iter().map(|(_, s)| s * s).sum::<f64>() / self.0.len() as f64).sqrt()
    }
    fn within(&self, sigmas: f64) -> f64 {
        let inside = self.0.iter().filter(|(e, s)| e.abs() <= sigmas * s).count();
        inside as f64 / self.0.len() as f64
    }
    fn line(&self) -> String {
        format!(
            "rms {:5.1} mean {:5.1} stated {:5.1} cm, in 1 sd {:3.0} %, in 2 sd {:3.0} %, in 3 sd {:4.1} %",
            100.0 * self.rms(),
            100.0 * self.mean(),
            100.0 * self.stated(),
            100.0 * self.within(1.0),
            100.0 * self.within(2.0),
            100.0 * self.within(3.0)
        )
    }
}

fn anchors(rays: &JointRays, lengths: &SegmentLengths, camera: &Camera) -> [Anchor; 4] {
    let (options, ground) = (AnchorOptions::default(), Ground::of(camera));
    let up = Some(ground.up_in_camera);
    let ground = from_ground(rays, lengths, &ground, &options).unwrap();
    let trunk = from_trunk(rays, lengths, up, &options).unwrap().anchor;
    let extent = from_extent(rays, lengths, up, &options).unwrap();
    let all = combine(&[ground.clone(), trunk.clone(), extent.clone()]).unwrap().anchor;
    [ground, trunk, extent, all]
}

const SOURCES: [&str; 4] = ["ground", "trunk", "extent", "combined"];

/// Lengths with the errors that the options assume: all by one factor, and each by its own.
fn mismeasured(lengths: &SegmentLengths, random: &mut Random) -> SegmentLengths {
    let options = AnchorOptions::default();
    let mut normal = || f64::from(random.normal_pair()[0]);
    let scale = 1.0 + options.scale_sd * normal();
    let mut lengths = *lengths;
    let all = lengths.to.0.iter_mut().skip(1).chain(&mut lengths.rigid);
    all.for_each(|l| *l *= scale * (1.0 + options.length_sd * normal()));
    lengths
}

/// The stated standard deviations against the errors, with lengths as inexact as assumed. A walker's habits
/// are errors common to all frames of the walk, so the shares are coarse.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn the_neck_is_where_its_standard_deviation_says() {
    let walks = walks();
    let mut pooled: [Errors; 4] = Default::default();
    for (view_name, azimuth) in [("front", 0.0), ("45", 45.0), ("side", 90.0)] {
        for noise_px in [0.0, 1.0, 3.0] {
            let mut errors: [Errors; 4] = Default::default();
            for (w, walk) in walks.iter().enumerate() {
                let mut random = Random::new(17 + w as u64);
                for figure in walk.figures.iter().step_by(6) {
                    let camera = camera(figure[Joint::Pelvis], walk.forward, azimuth, 4.0);
                    let (rays, truth) = view(&camera, figure, noise_px, &mut random);
                    let lengths = mismeasured(&walk.lengths, &mut random);
                    for (s, anchor) in anchors(&rays, &lengths, &camera).iter().enumerate() {
                        errors[s].add(anchor, truth);
                        pooled[s].add(anchor, truth);
                    }
                }
            }
            for (name, errors) in SOURCES.iter().zip(&errors) {
                println!("{view_name:5} {noise_px} px {name:8} {}", errors.line());
            }
        }
    }
    for (name, errors) in SOURCES.iter().zip(&pooled) {
        println!("all views      {name:8} {}", errors.line());
        assert!((0.6..=0.9).contains(&errors.within(1.0)), "{name}: {}", errors.line());
        assert!(errors.within(2.0) >= 0.9 && errors.within(3.0) >= 0.98, "{name}: {}", errors.line());
    }
    assert!(pooled[3].rms() <= pooled.iter().map(Errors::rms).fold(f64::INFINITY, f64::min) * 1.1);
}

/// Frames whose anchor is put 1.5 m off.
const PLANTED: [usize; 3] = [10, 26, 43];

/// A camera that stands still, every fourth frame missing and three frames far off.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn a_smoothed_walk_is_nearer_than_its_frames() {
    let walks = walks();
    let (mut frames, mut tracks) = (Errors::default(), Errors::default());
    let (mut frames_about, mut tracks_about) = (Errors::default(), Errors::default());
    for (w, walk) in walks.iter().enumerate() {
        for azimuth in [0.0, 45.0, 90.0] {
            let middle = walk.figures[walk.figures.len() / 2][Joint::Pelvis];
            let camera = camera(middle, walk.forward, azimuth, 6.0);
            let mut random = Random::new(40 + w as u64);
            let lengths = mismeasured(&walk.lengths, &mut random);
            let mut truths = Vec::new();
            let mut found = Vec::new();
            for (i, figure) in walk.figures.iter().enumerate() {
                let (rays, truth) = view(&camera, figure, 1.0, &mut random);
                truths.push(truth);
                let [.., mut anchor] = anchors(&rays, &lengths, &camera);
                if PLANTED.contains(&i) {
                    anchor.distance_m += 1.5;
                }
                found.push((i % 4 != 1).then_some(anchor));
            }
            let times_s: Vec<f64> = (0..truths.len()).map(|i| i as f64 / walk.rate_hz).collect();
            let track = smooth(&times_s, &found, &SmoothOptions::default()).unwrap();
            let (mut of_frames, mut of_track) = (Errors::default(), Errors::default());
            for (i, truth) in truths.iter().enumerate() {
                of_track.0.push((track.distance_m[i] - truth, track.sd_m[i]));
                if let Some(anchor) = &found[i]
                    && !PLANTED.contains(&i)
                {
                    of_frames.add(anchor, *truth);
                }
            }
            frames_about.0.extend(of_frames.about_mean());
            tracks_about.0.extend(of_track.about_mean());
            frames.0.extend(of_frames.0);
            tracks.0.extend(of_track.0);
            let outliers = track.outliers(5.0);
            assert_eq!(outliers, PLANTED, "{} at {azimuth}", walk.name);
        }
    }
    println!("fixed camera, 1 px: frames {}", frames.line());
    println!("fixed camera, 1 px: tracks {}", tracks.line());
    let scatter_m = [frames_about.rms(), tracks_about.rms()];
    println!("about the mean of each walk, m: frames {:.3}, tracks {:.3}", scatter_m[0], scatter_m[1]);
    assert!(tracks.rms() < frames.rms() && scatter_m[1] < 0.65 * scatter_m[0]);
    assert!((0.6..=0.97).contains(&tracks.within(1.0)) && tracks.within(3.0) >= 0.98, "{}", tracks.line());
}

/// Real detections of a man balancing on a beam. His posture is not that of walking and the beam is not the
/// ground, so ground and extent are printed for comparison and only the trunk is held to what it states.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn the_sources_against_triangulated_joints() {
    let folder = recordings::path("keypoints/pose2sim_balancing");
    let read = |path: &str| std::fs::read_to_string(folder.join(path)).unwrap();
    let truth = triangulated(&read("S00_P00_T01_BalancingTrial_0-100_filt_butterworth.trc"));
    let lengths = SegmentLengths::from_figures(&truth).unwrap();
    let calibration = read("Calib_qualisys.toml");
    let lowest = |f: &StickFigure| f[Joint::RightAnkle].z.min(f[Joint::LeftAnkle].z);
    let mut ankles: Vec<f64> = truth.iter().map(lowest).collect();
    ankles.sort_by(f64::total_cmp);
    println!("lower ankle {:.3} m above z = 0 (median)", ankles[ankles.len() / 2]);
    let expected = AnchorOptions::default().ankle_height_over_shank * lengths.to[Joint::RightAnkle];
    let beam_m = ankles[ankles.len() / 2] - expected;
    println!("beam taken as {beam_m:.3} m");
    for name in ["cam_02", "cam_04"] {
        let camera = Camera::from_toml_str(&calibration, Some(name)).unwrap();
        let mut errors: [Errors; 4] = Default::default();
        for (i, figure) in truth.iter().enumerate().step_by(3) {
            let folder = name.replace('_', "");
            let pixels = detected(&read(&format!("{folder}_json/{folder}.{i:04}.json")));
            let rays = JointRays::from_pixels(&camera, &pixels, &PerJoint([1.0; 14]), 6.0).unwrap();
            let distance_m = camera.camera_from_world(figure[Joint::Neck]).length();
            let options = AnchorOptions::default();
            let floor = Ground::of(&camera);
            let beam = Ground { camera_height_m: floor.camera_height_m - beam_m, ..floor };
            let up = Some(floor.up_in_camera);
            let found = [
                from_ground(&rays, &lengths, &floor, &options),
                from_ground(&rays, &lengths, &beam, &options),
                from_trunk(&rays, &lengths, up, &options).map(|fit| fit.anchor),
                from_extent(&rays, &lengths, up, &options),
            ];
            for (errors, anchor) in errors.iter_mut().zip(found) {
                if let Ok(anchor) = anchor {
                    errors.add(&anchor, distance_m);
                }
            }
        }
        for (label, errors) in ["floor", "beam", "trunk", "extent"].iter().zip(&errors) {
            println!("{name} {label:7} {} frames: {}", errors.0.len(), errors.line());
        }
        assert!(errors[2].0.len() > 20 && errors[2].within(2.0) >= 0.9, "{}", errors[2].line());
    }
}
