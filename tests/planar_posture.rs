//! What the planarity assumption gives on recorded motion beyond links: the reflection of named limbs, arms
//! that leave their planes, limbs that never reach full extension.
//!
//! Needs the recordings. `--nocapture` prints the figures.

use crate::mocap;

use glam::{DVec2, DVec3};
use memo_core::model::GaitStyle;
use memo_core::planar::{FitOptions, PlanarEvidenceOptions, Verdict, fit_hinge, hinge_evidence, joint_of};
use memo_core::synth::{DisplayView, Random, SampledWalkOptions, limbs_of};
use memo_core::{Body, FigureOptions, Gait, Walker, interpret_figure, interpret_named_figure, sampled_walk};
use mocap::JOINTS;
use mocap::stride::{LIMBS, noisy, walks};

const PX_PER_M: f64 = 200.0;
const AZIMUTHS_DEG: [f64; 8] = [15.0, 30.0, 45.0, 60.0, -15.0, -30.0, -45.0, -60.0];

fn in_px(points: &[DVec2]) -> Vec<DVec2> {
    points.iter().map(|p| *p * PX_PER_M).collect()
}

#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn named_limbs_have_the_reflection_of_the_walker() {
    let walks = walks();
    let joints: Vec<_> = JOINTS.iter().map(|name| joint_of(name)).collect();
    let mut random = Random::new(21);
    for noise_px in [0.0, 1.0] {
        // Legs, arms: right, all, and the same of margins over 5 degrees.
        let mut counts = [[0usize; 4]; 2];
        for walk in &walks {
            for azimuth in AZIMUTHS_DEG.into_iter().zip([0.0, 180.0].into_iter().cycle()).map(|(a, b)| a + b)
            {
                let seen = walk.views(0.4, 60, azimuth);
                let tracks: Vec<Vec<DVec2>> =
                    seen.image.iter().map(|t| noisy(&in_px(t), noise_px, &mut random)).collect();
                let times_s: Vec<f64> = (0..60).map(|t| t as f64 * walk.stride_s() / 60.0).collect();
                let fit = FitOptions { noise_sd: noise_px, ..FigureOptions::default().fit };
                let options = FigureOptions { fit, window_s: 100.0, ..FigureOptions::default() };
                let found = interpret_named_figure(&tracks, &joints, &times_s, &options).unwrap();
                for chain in &found.windows[0].figure.chains {
                    let (Some(margin), [a, b, c]) = (chain.reflection_margin_deg, &chain.points[..]) else {
                        continue;
                    };
                    let agreement: f64 = (0..60)
                        .map(|t| {
                            let z = |k: usize| seen.depth[k][t];
                            let d = &chain.depth[t];
                            (d[1] - d[0]) * (z(*b) - z(*a)) + (d[2] - d[1]) * (z(*c) - z(*b))
                        })
                        .sum();
                    let count = &mut counts[usize::from(*b < 6)];
                    let is_right = usize::from(agreement > 0.0);
                    count[0] += is_right;
                    count[1] += 1;
                    if margin > 5.0 {
                        count[2] += is_right;
                        count[3] += 1;
                    }
                }
            }
        }
        for (name, [right, all, sure_right, sure]) in ["legs", "arms"].into_iter().zip(counts) {
            println!(
                "{noise_px} px: {name} reflected rightly {right} of {all}; margin > 5 deg {sure_right} of {sure}"
            );
        }
        let [[right, all, sure_right, sure], arms] = counts;
        assert!(right as f64 >= 0.9 * all as f64 && sure_right as f64 >= 0.97 * sure as f64);
        assert!(arms[0] as f64 >= 0.75 * arms[1] as f64);
    }
}

/// RMS distance of three joints from their best common plane through the pivot, over the limb's length.
fn out_of_plane(frames: &[[DVec3; 12]], [a, o, b]: [usize; 3]) -> f64 {
    let mut sum = nalgebra::Matrix3::<f64>::zeros();
    let (mut length, mut count) = (0.0, 0.0);
    for f in frames {
        for v in [f[a] - f[o], f[b] - f[o]] {
            let v = nalgebra::Vector3::from(v.to_array());
            sum += v * v.transpose();
            length += v.norm();
            count += 1.0;
        }
    }
    let least = sum.symmetric_eigenvalues().iter().copied().fold(f64::INFINITY, f64::min).max(0.0);
    (least / count).sqrt() / (length / count)
}

#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn punching_arms_get_no_interpretation() {
    let (rate_hz, frames) = mocap::joints("CMU_02_05_punch");
    let (every, long) = ((rate_hz / 60.0).round() as usize, (1.2 * rate_hz) as usize);
    let mut random = Random::new(22);
    for noise_px in [0.0, 1.0] {
        let options = FitOptions { noise_sd: noise_px, ..FitOptions::default() };
        let (mut out, mut accepted, mut within, mut within_accepted) = (0, 0, 0, 0);
        for start in (0..frames.len() - long).step_by(long / 2) {
            let window: Vec<[DVec3; 12]> =
                frames[start..start + long].iter().step_by(every).copied().collect();
            if window.iter().flatten().any(|p| !p.is_finite()) {
                continue;
            }
            for limb in [LIMBS[0], LIMBS[1]] {
                let leaves = out_of_plane(&window, limb) > 0.10;
                for azimuth_deg in [0.0f64, 30.0, 60.0, 90.0, 120.0, 150.0] {
                    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
                    let image = |p: DVec3| PX_PER_M * DVec2::new(cos * p.x + sin * p.y, -p.z);
                    let [a, o, b] = limb.map(|k| {
                        let track: Vec<DVec2> = window.iter().map(|f| image(f[k])).collect();
                        noisy(&track, noise_px, &mut random)
                    });
                    let fit = fit_hinge(&a, &o, &b, &options).unwrap();
                    let evidence = hinge_evidence(&fit, noise_px, &PlanarEvidenceOptions::default());
                    let is_planar = usize::from(evidence.verdict == Verdict::Planar);
                    if leaves {
                        out += 1;
                        accepted += is_planar;
                    } else {
                        within += 1;
                        within_accepted += is_planar;
                    }
                }
            }
        }
        println!(
            "{noise_px} px: arms more than 10 % out of a plane interpreted in {accepted} of {out} windows; \
             others in {within_accepted} of {within}"
        );
        assert!(out > 50 && accepted as f64 <= 0.05 * out as f64, "{accepted} of {out}");
    }
}

/// The model walking seen from a direction, 1 px of noise: limb links found, relative errors of their
/// lengths, and the longest image of a limb over its length.
fn seen_from(azimuth_rad: f64, elevation_rad: f64, random: &mut Random) -> (usize, Vec<f64>, f64) {
    let body = Body::from_height(1.75).unwrap();
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let motion =
        sampled_walk(&walker, &SampledWalkOptions { frames: 66, ..SampledWalkOptions::default() }).unwrap();
    let view = DisplayView::Orthographic { azimuth_rad, elevation_rad, px_per_m: PX_PER_M };
    let at = |t: usize, k: usize| view.project(motion.at(t, k).unwrap()).unwrap();
    let clean: Vec<Vec<DVec2>> = (0..12).map(|k| (0..66).map(|t| at(t, k)).collect()).collect();
    let tracks: Vec<Vec<DVec2>> = clean.iter().map(|track| noisy(track, 1.0, random)).collect();
    let limbs = limbs_of(&motion.names()[..12]);
    let length = |[a, b]: [usize; 2]| PX_PER_M * motion.at(0, a).unwrap().distance(motion.at(0, b).unwrap());
    let extension = |&[a, b]: &[usize; 2]| {
        let longest = (0..66).map(|t| clean[a][t].distance(clean[b][t])).fold(0.0, f64::max);
        longest / length([a, b])
    };
    let fit = FitOptions { noise_sd: 1.0, ..FigureOptions::default().fit };
    let options = FigureOptions { fit, ..FigureOptions::default() };
    let found = interpret_figure(&tracks, motion.times_s(), &options).unwrap();
    let links: Vec<_> = found.windows[0].figure.links().filter(|l| limbs.contains(&l.points)).collect();
    let errors = links.iter().map(|l| (l.length / length(l.points) - 1.0).abs()).collect();
    (links.len(), errors, limbs.iter().map(extension).fold(0.0, f64::max))
}

#[test]
fn limbs_that_never_reach_full_extension_are_interpreted_as_well() {
    let mut random = Random::new(23);
    let (mut full, mut never, mut reached) = ((0, Vec::new()), (0, Vec::new()), 0.0f64);
    for draw in 0..5 {
        let tilt_rad = 0.85 + 0.05 * f64::from(draw);
        let (links, errors, extension) = seen_from(tilt_rad, 0.0, &mut random);
        assert!(extension > 0.98, "{extension}");
        full.0 += links;
        full.1.extend(errors);
        // The same tilt from above: no limb is ever level, so none ever lies in the image plane.
        let (links, errors, extension) = seen_from(0.1, tilt_rad, &mut random);
        reached = reached.max(extension);
        never.0 += links;
        never.1.extend(errors);
    }
    let medians = [&mut full.1, &mut never.1].map(|errors| mocap::stride::quantile(errors, 0.5));
    println!(
        "full extension: {} of 40 links, length {:.4}; never above {reached:.3}: {} of 40, {:.4} (medians)",
        full.0, medians[0], never.0, medians[1]
    );
    assert!(reached < 0.97, "{reached}");
    assert!(never.0 >= full.0 && medians[1] <= 0.02, "{medians:?}");
}
