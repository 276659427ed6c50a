//! Repair of exchanged left and right labels over 10,000 frames of a walking figure.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use memo_core::keypoints::{Keypoints, Level, LimbGroup};
use memo_core::synth::Random;
use memo_core::{UnswapOptions, unswap};
use std::hint::black_box;

const FRAMES: usize = 10_000;
const JOINTS: usize = 8;

/// Pairs that swing against each other at 25 fps, further out the more, with noise; a tenth exchanged.
fn walking() -> (Vec<f64>, Vec<[f64; 2]>) {
    let mut random = Random::new(3);
    let times_s: Vec<f64> = (0..FRAMES).map(|t| 0.04 * t as f64).collect();
    let mut points = Vec::with_capacity(FRAMES * JOINTS);
    for time_s in &times_s {
        let exchanged = random.uniform(0.0, 1.0) < 0.1;
        for joint in 0..JOINTS {
            let side = if (joint % 2 == 0) != exchanged { 1.0 } else { -1.0 };
            let reach_px = 10.0 + 50.0 * (joint / 2) as f64;
            let [du, dv] = random.normal_pair().map(f64::from);
            points.push([320.0 + side * reach_px * (5.7 * time_s).sin() + du, 20.0 + reach_px + dv]);
        }
    }
    (times_s, points)
}

fn legs(levels: usize) -> LimbGroup {
    let level = |l: usize| Level { name: format!("level {l}"), pairs: vec![[2 * l, 2 * l + 1]] };
    LimbGroup { name: "legs".into(), levels: (0..levels).map(level).collect() }
}

fn levels(c: &mut Criterion) {
    let mut bench = c.benchmark_group("unswap");
    bench.sample_size(10).throughput(Throughput::Elements(FRAMES as u64));
    let (times_s, points_px) = walking();
    let keypoints = Keypoints { times_s: &times_s, joints: JOINTS, points_px: &points_px, scores: None };
    for levels in [1, 2, 3, 4] {
        let group = [legs(levels)];
        bench.bench_function(BenchmarkId::new(format!("{FRAMES} frames"), format!("{levels} levels")), |b| {
            b.iter(|| unswap(black_box(&keypoints), &group, &UnswapOptions::default()));
        });
    }
}

criterion_group!(benches, levels);
criterion_main!(benches);
