//! Copying a frame: the floor for everything that reads one.

use criterion::{Criterion, criterion_group, criterion_main};
use memo_core::image::Image;
use std::hint::black_box;

fn copy_frame(c: &mut Criterion) {
    let image = Image::filled(1920, 1080, 7u8);
    c.bench_function("copy a 1920x1080 frame", |b| b.iter(|| black_box(image.as_frame()).to_image()));
}

criterion_group!(benches, copy_frame);
criterion_main!(benches);
