//! The whole tracker on frames of a person in clothes, and the drawing of such a frame.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use memo_core::synth::ClothedOptions;
use memo_core::{ClothedScene, Image, Tracker, TrackerOptions};
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
            b.iter(|| {
                let camera = Some(scene.camera.clone());
                let options = TrackerOptions { camera, ..TrackerOptions::for_height(scene.height_m) };
                let mut tracker = Tracker::new(options).unwrap();
                for (index, frame) in frames.iter().enumerate() {
                    tracker.update(&frame.as_frame(), scene.time_s(index)).unwrap();
                }
                tracker.finish().unwrap();
                black_box(tracker.take_finished())
            });
        });
        group.throughput(Throughput::Elements(1));
        group.bench_function(format!("a frame of {}x{} drawn", size[0], size[1]), |b| {
            b.iter(|| black_box(scene.frame(30)));
        });
    }
    group.finish();
}

criterion_group!(benches, track);
criterion_main!(benches);
