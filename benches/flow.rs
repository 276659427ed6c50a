//! Velocity field of regions of several sizes in a textured scene that moves by a few pixels.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use memo_core::image::{FlowOptions, velocity_field};
use memo_core::{Image, Mask};
use std::hint::black_box;

/// A texture of a few waves with noise, moved to the right.
fn scene(width: usize, height: usize, shift_px: f32) -> Image<u8> {
    let mut noise = 12345u32;
    let grey = |p: usize| {
        let (x, y) = ((p % width) as f32 - shift_px, (p / width) as f32);
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let waves = (1..6).map(|i| {
            let (sin, cos) = (1.3 * i as f32).sin_cos();
            15.0 * ((x * cos + y * sin) * 0.06 * i as f32).sin()
        });
        (128.0 + waves.sum::<f32>() + (noise >> 29) as f32) as u8
    };
    Image::from_vec(width, height, (0..width * height).map(grey).collect()).expect("the sides are positive")
}

/// An upright ellipse, 2.5 times as high as wide.
fn ellipse(width: usize, height: usize, half_width_px: f32) -> Mask {
    let inside = |p: usize| {
        let x = ((p % width) as f32 - 0.5 * width as f32) / half_width_px;
        let y = ((p / width) as f32 - 0.5 * height as f32) / (2.5 * half_width_px);
        x * x + y * y < 1.0
    };
    Mask::from_vec(width, height, (0..width * height).map(inside).collect()).expect("the sides are positive")
}

fn regions(c: &mut Criterion) {
    let mut group = c.benchmark_group("velocity field");
    group.sample_size(20);
    for (width, height, half_width_px) in [(320, 240, 20.0), (640, 480, 50.5), (1280, 720, 100.0)] {
        let (first, second) = (scene(width, height, 0.0), scene(width, height, 5.3));
        let region = ellipse(width, height, half_width_px);
        let count = region.pixels().iter().filter(|&&inside| inside).count();
        group.bench_function(BenchmarkId::new(format!("{width}x{height}"), format!("{count} px")), |b| {
            let options = FlowOptions::default();
            b.iter(|| velocity_field(black_box(&first.as_frame()), &second.as_frame(), &region, &options));
        });
    }
}

criterion_group!(benches, regions);
criterion_main!(benches);
