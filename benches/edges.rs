//! Edges and straight segments of a frame, whole and restricted to the size of a person.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use memo_core::Image;
use memo_core::image::{
    EdgeDomain, EdgeOptions, LineOptions, Window, edge_chains, edge_segments, segments_from_chains,
};
use std::hint::black_box;

/// Overlapping bright and dark bars of all directions with noise: about as many edge points as a street
/// scene.
fn scene(width: usize, height: usize) -> Image<u8> {
    let mut noise = 12345u32;
    let grey = |p: usize| {
        let (x, y) = ((p % width) as f32, (p / width) as f32);
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let bars = (0..5).map(|i| {
            let (sin, cos) = (0.7 * i as f32).sin_cos();
            30.0 * ((x * cos + y * sin) * (0.05 + 0.015 * i as f32)).sin().signum()
        });
        (128.0 + 0.6 * bars.sum::<f32>() + (noise >> 28) as f32) as u8
    };
    Image::from_vec(width, height, (0..width * height).map(grey).collect()).expect("the sides are positive")
}

fn whole_frames(c: &mut Criterion) {
    let mut group = c.benchmark_group("edges");
    for (width, height) in [(320, 240), (768, 576), (1920, 1080)] {
        let image = scene(width, height);
        let (frame, options, domain) = (image.as_frame(), EdgeOptions::default(), EdgeDomain::default());
        let size = format!("{width}x{height}");
        group.bench_function(BenchmarkId::new("chains", &size), |b| {
            b.iter(|| edge_chains(black_box(&frame), &domain, &options));
        });
        let chains = edge_chains(&frame, &domain, &options).expect("the options are valid");
        group.bench_function(BenchmarkId::new("segments from chains", &size), |b| {
            b.iter(|| segments_from_chains(black_box(&chains), &LineOptions::default()));
        });
    }
}

fn person_window(c: &mut Criterion) {
    let image = scene(1920, 1080);
    let window = Window { x: 900, y: 300, width: 150, height: 300 };
    let domain = EdgeDomain { mask: None, window: Some(window) };
    c.bench_function("edge segments in 150x300 of 1920x1080", |b| {
        let (edges, lines) = (EdgeOptions::default(), LineOptions::default());
        b.iter(|| edge_segments(black_box(&image.as_frame()), &domain, &edges, &lines));
    });
}

criterion_group!(benches, whole_frames, person_window);
criterion_main!(benches);
