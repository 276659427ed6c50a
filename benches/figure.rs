//! Linking unnamed points into a figure: all rods and hinges of a window, then the exact cover.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec2;
use memo_core::model::GaitStyle;
use memo_core::planar::{FitOptions, PlanarEvidenceOptions, test_pairs, test_triples};
use memo_core::synth::{DisplayView, Random, SampledWalkOptions};
use memo_core::{Body, FigureOptions, Gait, Walker, interpret_figure, sampled_walk};
use std::hint::black_box;

/// Tracks of `points` points over a walk at 60 Hz, 1 px of noise: the walker's joints and head, then
/// points that go with the head.
fn tracks(points: usize, frames: usize) -> (Vec<Vec<DVec2>>, Vec<f64>) {
    let body = Body::from_height(1.75).expect("a plausible height");
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let motion = sampled_walk(&walker, &SampledWalkOptions { frames, ..SampledWalkOptions::default() })
        .expect("a plausible walk");
    let view = DisplayView::Orthographic { azimuth_rad: 0.6, elevation_rad: 0.0, px_per_m: 200.0 };
    let mut random = Random::new(1);
    let mut track = |k: usize| {
        let place = |frame| motion.at(frame, k.min(12)).and_then(|p| view.project(p)).unwrap_or(DVec2::NAN);
        let noisy = |frame| {
            let [du, dv] = random.normal_pair();
            place(frame) + DVec2::new(f64::from(du), f64::from(dv)) + 20.0 * k.saturating_sub(12) as f64
        };
        (0..frames).map(noisy).collect::<Vec<DVec2>>()
    };
    ((0..points).map(&mut track).collect(), motion.times_s().to_vec())
}

fn figure(c: &mut Criterion) {
    let fit = FitOptions { noise_sd: 1.0, ..FigureOptions::default().fit };
    let evidence = PlanarEvidenceOptions::default();
    let options = FigureOptions { fit, ..FigureOptions::default() };
    for points in [12, 14, 16] {
        let (tracks, times_s) = tracks(points, 60);
        c.bench_function(&format!("figure of {points} points, one window of 60 frames"), |b| {
            b.iter(|| interpret_figure(black_box(&tracks), &times_s, &options));
        });
    }
    let (all, _) = tracks(20, 120);
    // All groups of the paper's first step: 190 pairs and 3420 triples, each point of a triple as the pivot.
    let views: Vec<&[DVec2]> = all.iter().map(Vec::as_slice).collect();
    c.bench_function("all pairs and triples of 20 points, 120 views", |b| {
        b.iter(|| (test_pairs(black_box(&views), &fit, &evidence), test_triples(&views, &fit, &evidence)));
    });
    let (tracks, times_s) = tracks(40, 60);
    c.bench_function("spanning forest of 40 points, one window of 60 frames", |b| {
        b.iter(|| interpret_figure(black_box(&tracks), &times_s, &options));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = figure
}
criterion_main!(benches);
