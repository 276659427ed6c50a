//! Change detection, background and region clean-up of one frame, one thread.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use memo_core::image::{
    Background, BackgroundOptions, ChangeOptions, CleanOptions, GroupOptions, clean, dilate, fill_holes,
    group_regions, pair_changes, regions,
};
use memo_core::{Image, Mask};
use std::hint::black_box;

const SIZES: [(usize, usize); 2] = [(640, 480), (1920, 1080)];

/// A noisy frame with a bright upright rectangle a fifth as wide as high; its left edge is given.
fn frame(width: usize, height: usize, left: usize, seed: u32) -> Image<u8> {
    let mut state = seed;
    let mut image = Image::filled(width, height, 0u8);
    for y in 0..height {
        for (x, grey) in image.row_mut(y).iter_mut().enumerate() {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            let inside = (left..left + height / 10).contains(&x) && (height / 4..3 * height / 4).contains(&y);
            *grey = if inside { 180 } else { 90 } + (state >> 30) as u8;
        }
    }
    image
}

fn changes(c: &mut Criterion) {
    let mut group = c.benchmark_group("pair_changes");
    for (width, height) in SIZES {
        let (a, b) = (frame(width, height, width / 3, 1), frame(width, height, width / 3 + height / 60, 2));
        group.throughput(Throughput::Elements((width * height) as u64));
        for (name, threshold, compensate_gain) in
            [("fixed T", Some(4.0), false), ("T from noise", None, false), ("gain", None, true)]
        {
            let options = ChangeOptions { threshold, compensate_gain, ..ChangeOptions::default() };
            let id = BenchmarkId::new(name, format!("{width}x{height}"));
            group.bench_function(id, |bench| {
                bench.iter(|| pair_changes(&black_box(&a).as_frame(), &b.as_frame(), &options));
            });
        }
    }
    group.finish();
}

fn background(c: &mut Criterion) {
    let mut group = c.benchmark_group("background");
    for (width, height) in SIZES {
        let size = format!("{width}x{height}");
        let (a, b) = (frame(width, height, width / 3, 1), frame(width, height, width / 2, 2));
        let mut background = Background::new(&a.as_frame(), BackgroundOptions::default()).expect("valid");
        let mask = background.foreground(&b.as_frame()).expect("same size");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(BenchmarkId::new("update", &size), |bench| {
            bench.iter(|| background.update(&black_box(&b).as_frame(), Some(&mask)));
        });
        group.bench_function(BenchmarkId::new("foreground", &size), |bench| {
            bench.iter(|| background.foreground(&black_box(&b).as_frame()));
        });
        group.bench_function(BenchmarkId::new("silhouette", &size), |bench| {
            bench.iter(|| background.silhouette(&black_box(&b).as_frame(), &mask, 20.0));
        });
    }
    group.finish();
}

fn region_steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("regions");
    for (width, height) in SIZES {
        let size = format!("{width}x{height}");
        let (a, b) = (frame(width, height, width / 3, 1), frame(width, height, width / 3 + height / 60, 2));
        let mask: Mask =
            pair_changes(&a.as_frame(), &b.as_frame(), &ChangeOptions::default()).expect("same size");
        let cleaned = clean(&mask, &CleanOptions::default()).expect("default thresholds");
        group.throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(BenchmarkId::new("clean", &size), |bench| {
            bench.iter(|| clean(black_box(&mask), &CleanOptions::default()));
        });
        group.bench_function(BenchmarkId::new("fill_holes", &size), |bench| {
            bench.iter(|| fill_holes(black_box(&cleaned)));
        });
        group.bench_function(BenchmarkId::new("dilate by 5 px", &size), |bench| {
            bench.iter(|| dilate(black_box(&cleaned), 5.0));
        });
        group.bench_function(BenchmarkId::new("regions and groups", &size), |bench| {
            bench.iter(|| group_regions(&regions(black_box(&cleaned), 1), &GroupOptions::default()));
        });
    }
    group.finish();
}

criterion_group!(benches, changes, background, region_steps);
criterion_main!(benches);
