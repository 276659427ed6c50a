//! The model walking, as tracks with their truth; for tests.

use super::Figure;
use crate::model::{Body, Gait, GaitStyle, Walker};
use crate::sampled_walk;
use crate::synth::{DisplayView, Random, SampledWalkOptions, limbs_of};
use glam::{DVec2, DVec3};

/// The body model walking for `frames` frames at 60 Hz, rotated about its pelvis by `turn(time)`, seen 35 degrees
/// from the side at 200 px/m: tracks and true depths (T x 12) of the 12 joints.
pub(super) fn walker(
    frames: usize,
    turn: impl Fn(f64) -> f64,
    noise_px: f64,
) -> (Vec<Vec<DVec2>>, Vec<f64>, Vec<f64>) {
    let body = Body::from_height(1.75).unwrap();
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let motion =
        sampled_walk(&walker, &SampledWalkOptions { frames, ..SampledWalkOptions::default() }).unwrap();
    let (azimuth_rad, px_per_m) = (0.6f64, 200.0);
    let view = DisplayView::Orthographic { azimuth_rad, elevation_rad: 0.0, px_per_m };
    let away = DVec3::new(-azimuth_rad.sin(), azimuth_rad.cos(), 0.0);
    let (path, times_s) = (motion.pelvis_path(), motion.times_s().to_vec());
    let mut random = Random::new(9);
    let mut tracks = vec![Vec::new(); 12];
    let mut depth = Vec::new();
    for t in 0..frames {
        let turned = glam::DMat3::from_rotation_z(turn(times_s[t]));
        for (k, track) in tracks.iter_mut().enumerate() {
            let p = turned * (motion.at(t, k).unwrap() - path[t]) + path[t];
            let [du, dv] = random.normal_pair().map(|n| f64::from(n) * noise_px);
            track.push(view.project(p).unwrap() + DVec2::new(du, dv));
            depth.push(away.dot(p) * px_per_m);
        }
    }
    (tracks, times_s, depth)
}

pub(super) fn limbs() -> Vec<[usize; 2]> {
    limbs_of(&crate::synth::motion::WALKER_NAMES.map(String::from))
}

pub(super) fn sorted_links(figure: &Figure) -> Vec<[usize; 2]> {
    let mut links: Vec<[usize; 2]> = figure.links().map(|l| l.points).collect();
    links.sort_unstable();
    links
}
