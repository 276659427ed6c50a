//! Segment lengths from a sequence against motion capture and against triangulated joints.

use crate::recorded;

use glam::DVec3;
use memo_core::posture::anchor::{AnchorOptions, Ground};
use memo_core::posture::length::{LengthBasis, LengthFit, LengthPrior, ScaleFrom, estimate_from_sequence};
use memo_core::posture::lift::JointRays;
use memo_core::synth::Random;
use memo_core::{Camera, Joint, PerJoint, SegmentLengths};

use crate::recordings;
use recorded::{Walk, camera, detected, triangulated, view, walks};

/// One of each kind of segment.
const KINDS: [&str; 10] = [
    "neck_to_right_shoulder",
    "neck_to_pelvis",
    "pelvis_to_right_hip",
    "right_shoulder_to_right_elbow",
    "right_elbow_to_right_wrist",
    "right_hip_to_right_knee",
    "right_knee_to_right_ankle",
    "right_shoulder_to_left_shoulder",
    "right_shoulder_to_pelvis",
    "right_hip_to_left_hip",
];

/// Both sides' mean length of a kind.
fn length_of(lengths: &SegmentLengths, kind: &str) -> f64 {
    let mirrored = kind.replace("right", "left");
    let found: Vec<f64> =
        lengths.named().filter(|(name, _)| name == kind || *name == mirrored).map(|(_, l)| l).collect();
    found.iter().sum::<f64>() / found.len() as f64
}

/// Body height by the height of the shoulders, whose share Drillis and Contini give.
fn height_m(walk: &Walk) -> f64 {
    let shoulder = |f: &memo_core::StickFigure| 0.5 * (f[Joint::RightShoulder].z + f[Joint::LeftShoulder].z);
    walk.figures.iter().map(shoulder).sum::<f64>() / walk.figures.len() as f64 / 0.818
}

fn seen(walk: &Walk, azimuth_deg: f64, noise_px: f64) -> (Vec<JointRays>, Ground) {
    let mut random = Random::new(3);
    let middle: DVec3 = walk.figures[walk.figures.len() / 2][Joint::Pelvis];
    let ground = Ground::of(&camera(middle, walk.forward, azimuth_deg, 4.0));
    let frames = walk.figures.iter().map(|figure| {
        let camera = camera(figure[Joint::Pelvis], walk.forward, azimuth_deg, 4.0);
        view(&camera, figure, noise_px, &mut random).0
    });
    (frames.collect(), ground)
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

#[derive(Default)]
struct Table {
    prior: [Vec<f64>; 10],
    fitted: [Vec<f64>; 10],
    sigmas: Vec<f64>,
}

impl Table {
    fn add(&mut self, truth: &SegmentLengths, prior: &SegmentLengths, fit: &LengthFit) {
        for (k, kind) in KINDS.iter().enumerate() {
            let truth = length_of(truth, kind);
            self.prior[k].push(length_of(prior, kind) / truth - 1.0);
            self.fitted[k].push(length_of(&fit.lengths, kind) / truth - 1.0);
            let estimate = fit.estimates.iter().find(|e| e.segment == *kind).unwrap();
            self.sigmas.push((estimate.length_m - truth) / estimate.sd_m);
        }
    }

    fn print(&self, title: &str) {
        let line = |errors: &[Vec<f64>; 10]| {
            errors.iter().map(|e| format!("{:6.1}", 100.0 * rms(e))).collect::<String>()
        };
        println!("{title}: prior {}", line(&self.prior));
        println!("{title}: found {}", line(&self.fitted));
        let mean: Vec<String> = self
            .fitted
            .iter()
            .map(|e| format!("{:6.1}", 100.0 * e.iter().sum::<f64>() / e.len() as f64))
            .collect();
        println!("{title}: mean  {}", mean.concat());
    }

    /// Root mean square over limbs and trunk: what the posture depends on most.
    fn limbs(errors: &[Vec<f64>; 10]) -> f64 {
        rms(&[1, 3, 5, 6].map(|k| errors[k].clone()).concat())
    }
}

/// Relative errors in %, root mean square over four walkers of known height, on the ground.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn lengths_from_a_walk_are_better_than_proportions() {
    let walks = walks();
    println!("columns: {}", KINDS.join(" "));
    let mut all = Table::default();
    for (name, azimuth) in [("front", 0.0), ("45", 45.0), ("side", 90.0)] {
        for noise_px in [0.0, 3.0] {
            let mut table = Table::default();
            for walk in &walks {
                let (rays, ground) = seen(walk, azimuth, noise_px);
                let prior = LengthPrior::from_height(Some(height_m(walk))).unwrap();
                let options = AnchorOptions::default();
                let fit = estimate_from_sequence(&rays, Some(&ground), &prior, &options).unwrap();
                table.add(&walk.lengths, &prior.lengths, &fit);
                all.add(&walk.lengths, &prior.lengths, &fit);
            }
            table.print(&format!("{name:5} {noise_px} px"));
            let (prior, fitted) = (Table::limbs(&table.prior), Table::limbs(&table.fitted));
            println!(
                "{name:5} {noise_px} px: limbs and trunk {:.1} -> {:.1} %",
                100.0 * prior,
                100.0 * fitted
            );
            assert!(fitted < prior, "{name} {noise_px}");
        }
    }
    all.print("all");
    let inside =
        |most: f64| all.sigmas.iter().filter(|s| s.abs() < most).count() as f64 / all.sigmas.len() as f64;
    println!("in 1 sd {:.2}, 2 sd {:.2}, 3 sd {:.2}", inside(1.0), inside(2.0), inside(3.0));
    assert!(Table::limbs(&all.fitted) < 0.4 * Table::limbs(&all.prior));
    assert!((0.55..=0.9).contains(&inside(1.0)) && inside(2.0) > 0.85);
}

/// Without height the scale comes from the ground; without ground from nothing, and both are said.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn the_scale_is_told_from_where_it_is() {
    let walks = walks();
    let mut ratios = Vec::new();
    for walk in &walks {
        let (rays, ground) = seen(walk, 45.0, 1.0);
        let options = AnchorOptions::default();
        let prior = LengthPrior::from_height(None).unwrap();
        let fit = estimate_from_sequence(&rays, Some(&ground), &prior, &options).unwrap();
        let leg =
            |l: &SegmentLengths| length_of(l, KINDS[5]) + length_of(l, KINDS[6]) + length_of(l, KINDS[1]);
        let (truth, found, assumed) = (leg(&walk.lengths), leg(&fit.lengths), leg(&prior.lengths));
        println!(
            "{}: trunk + leg {truth:.3} m, with the ground {found:.3}, assumed {assumed:.3}; scale {:.3} sd {:.3} from {:?}",
            walk.name, fit.scale, fit.scale_sd, fit.scale_from
        );
        assert_eq!(fit.scale_from, ScaleFrom::Ground);
        ratios.push((found / truth - 1.0, assumed / truth - 1.0));
        let blind = estimate_from_sequence(&rays, None, &prior, &options).unwrap();
        assert_eq!(blind.scale_from, ScaleFrom::Assumed);
        assert_eq!(blind.scale_sd, prior.scale_sd);
    }
    let (found, assumed): (Vec<f64>, Vec<f64>) = ratios.into_iter().unzip();
    println!("relative errors of trunk + leg: ground {:.3}, assumed {:.3}", rms(&found), rms(&assumed));
    assert!(rms(&found) < 0.6 * rms(&assumed));
}

/// A man on a beam: the height of the beam is given, for the ground must be what he stands on.
#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn lengths_of_the_man_on_the_beam() {
    let folder = recordings::path("keypoints/pose2sim_balancing");
    let read = |path: &str| std::fs::read_to_string(folder.join(path)).unwrap();
    let truth = triangulated(&read("S00_P00_T01_BalancingTrial_0-100_filt_butterworth.trc"));
    let truth = SegmentLengths::from_figures(&truth).unwrap();
    let calibration = read("Calib_qualisys.toml");
    println!("columns: {}", KINDS.join(" "));
    for name in ["cam_02", "cam_04"] {
        let camera = Camera::from_toml_str(&calibration, Some(name)).unwrap();
        let file = name.replace('_', "");
        let rays: Vec<JointRays> = (0..100)
            .step_by(3)
            .map(|i| {
                let pixels = detected(&read(&format!("{file}_json/{file}.{i:04}.json")));
                JointRays::from_pixels(&camera, &pixels, &PerJoint([1.0; 14]), 6.0).unwrap()
            })
            .collect();
        let floor = Ground::of(&camera);
        let beam = Ground { camera_height_m: floor.camera_height_m - 0.076, ..floor };
        let prior = LengthPrior::from_height(None).unwrap();
        let fit = estimate_from_sequence(&rays, Some(&beam), &prior, &AnchorOptions::default()).unwrap();
        let mut table = Table::default();
        table.add(&truth, &prior.lengths, &fit);
        table.print(name);
        println!("{name}: scale {:.3} sd {:.3} from {:?}", fit.scale, fit.scale_sd, fit.scale_from);
        let bases: Vec<LengthBasis> = fit.estimates.iter().map(|e| e.basis).collect();
        println!("{name}: {bases:?}");
        let inside = table.sigmas.iter().filter(|s| s.abs() < 2.0).count();
        assert!(inside >= 8, "{:?}", table.sigmas);
    }
}
