//! The whole tracker on frames of a person in clothes, the drawing of such a frame, and the fit of the person alone.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use memo_core::synth::ClothedOptions;
use memo_core::track::fit::FitOptions;
use memo_core::{ClothedScene, Image, TrackedWalk, Tracker, TrackerOptions};
use std::hint::black_box;

fn track(c: &mut Criterion) {
    let mut group = c.benchmark_group("a person in clothes");
    group.sample_size(10);
    for size in [[640, 480], [1280, 720]] {
        let options = ClothedOptions { size, frames: 60, ..ClothedOptions::default() };
        let scene = ClothedScene::new(options).unwrap();
        let frames: Vec<Image<u8>> = (0..scene.len()).map(|frame| scene.frame(frame)).collect();
        group.throughput(Throughput::Elements(frames.len() as u64));
        group.bench_function(format!("60 frames of {}x{} tracked", size[0], size[1]), |b| {
            b.iter(|| black_box(tracked(&scene, &frames)));
        });
        group.throughput(Throughput::Elements(1));
        group.bench_function(format!("a frame of {}x{} drawn", size[0], size[1]), |b| {
            b.iter(|| black_box(scene.frame(30)));
        });
    }
    group.finish();
}

/// With the times per frame, the fit of a walk of another length is as many times as long.
fn fit(c: &mut Criterion) {
    let mut group = c.benchmark_group("the person of a walk, fitted");
    group.sample_size(10);
    for (size, count) in [([640, 480], 60), ([640, 480], 100), ([1280, 720], 100)] {
        let options = ClothedOptions { size, frames: count, ..ClothedOptions::default() };
        let scene = ClothedScene::new(options).unwrap();
        let frames: Vec<Image<u8>> = (0..scene.len()).map(|frame| scene.frame(frame)).collect();
        let walk = &tracked(&scene, &frames)[0];
        let pictures: Vec<Image<u8>> = walk.rows().iter().map(|row| frames[row.frame].clone()).collect();
        group.throughput(Throughput::Elements(pictures.len() as u64));
        group.bench_function(format!("{} frames of {}x{}", pictures.len(), size[0], size[1]), |b| {
            b.iter(|| black_box(walk.fit(&pictures, None, &FitOptions::default()).unwrap()));
        });
    }
    group.finish();
}

fn tracked(scene: &ClothedScene, frames: &[Image<u8>]) -> Vec<TrackedWalk> {
    let camera = Some(scene.camera.clone());
    let options = TrackerOptions { camera, ..TrackerOptions::for_height(scene.height_m) };
    let mut tracker = Tracker::new(options).unwrap();
    for (index, frame) in frames.iter().enumerate() {
        tracker.update(&frame.as_frame(), scene.time_s(index)).unwrap();
    }
    tracker.finish().unwrap();
    tracker.take_finished()
}

criterion_group!(benches, track, fit);
criterion_main!(benches);
