//! Change detection, background and region clean-up of one frame, one thread.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use memo_core::image::{ChangeOptions, Image, pair_changes};
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

criterion_group!(benches, changes);
criterion_main!(benches);
