//! Linking a sequence of 10,000 frames: a synthetic walker at 25 frames a second seen at 45 degrees from the
//! front, 3 px of noise at 480 px/m.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::{DQuat, DVec3};
use memo_core::posture::lift::JointRays;
use memo_core::posture::link::{FrontPoints, LinkFrame, LinkOptions, link};
use memo_core::reproduce::stick_walker::StickWalker;
use memo_core::synth::Random;
use memo_core::{Joint, PerJoint, SegmentLengths};
use std::hint::black_box;

const FRAMES: usize = 10_000;

fn sequence() -> (Vec<LinkFrame>, SegmentLengths, LinkOptions) {
    let walker = StickWalker::lee_chen();
    let noise_rad = 3.0 / 1920.0;
    let mut random = Random::new(4);
    // The walker's axes: x forward, y up, z to the right. Camera axes: turned, y down, 4 m away.
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
    let camera_from_walker = |v: DVec3| turn * DVec3::new(-v.z, -v.y, -v.x);
    let frames = (0..FRAMES)
        .map(|t| {
            let time_s = t as f64 / 25.0;
            let figure = walker.posed(time_s * 0.95, DVec3::ZERO);
            let at = figure.0.map(|p| camera_from_walker(p) + DVec3::new(0.0, -0.3, 4.0));
            let mut rays = JointRays::from_points(&PerJoint(at));
            for ray in &mut rays.ray.0 {
                let [a, b] = random.normal_pair().map(f64::from);
                *ray = (*ray + noise_rad * DVec3::new(a, b, 0.0)).normalize();
            }
            rays.noise_rad = noise_rad;
            LinkFrame { time_s, rays, neck: at[Joint::Neck as usize], front: FrontPoints::UNSEEN }
        })
        .collect();
    let options = LinkOptions {
        up: Some(-DVec3::Y),
        moving_direction: Some(camera_from_walker(DVec3::X)),
        ..LinkOptions::default()
    };
    (frames, *walker.lengths(), options)
}

fn linking(c: &mut Criterion) {
    let (frames, lengths, options) = sequence();
    let mut group = c.benchmark_group("link");
    group.throughput(Throughput::Elements(FRAMES as u64)).sample_size(10);
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        group.bench_function(format!("10,000 frames, {threads} threads"), |b| {
            b.iter(|| pool.install(|| link(black_box(&frames), &lengths, &options)));
        });
    }
    group.finish();
}

criterion_group!(benches, linking);
criterion_main!(benches);
