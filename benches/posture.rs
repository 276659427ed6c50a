//! The interpretation tree of one frame, one thread: a synthetic walker from the front, at 45 degrees and from
//! the side, without noise and at 3 px; leaves in the title.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{DQuat, DVec3};
use memo_core::posture::Bearings;
use memo_core::posture::group::{DEFAULT_GROUP_M, group};
use memo_core::posture::lift::JointRays;
use memo_core::posture::rules::MotionModel;
use memo_core::posture::tree::{TreeOptions, View};
use memo_core::synth::Random;
use memo_core::{Joint, SegmentLengths, StickFigure};
use std::hint::black_box;

/// A walker in mid-step, camera axes, 4 m away, turned by an angle from facing the camera.
fn walker(lengths: &SegmentLengths, turned_deg: f64) -> (StickFigure, DVec3) {
    let facing = DQuat::from_rotation_y(turned_deg.to_radians());
    // Swing of each segment forward, degrees; forward is -z, towards the camera.
    let swung = |deg: f64| DVec3::new(0.0, deg.to_radians().cos(), -deg.to_radians().sin());
    let direction = |joint: Joint| match joint {
        Joint::RightShoulder => DVec3::new(-0.2015, 0.0, 0.0377).normalize(),
        Joint::LeftShoulder => DVec3::new(0.2015, 0.0, 0.0377).normalize(),
        Joint::RightHip => DVec3::new(-0.161, 0.1009, 0.0).normalize(),
        Joint::LeftHip => DVec3::new(0.161, 0.1009, 0.0).normalize(),
        Joint::RightElbow => swung(-20.0),
        Joint::RightWrist => swung(5.0),
        Joint::LeftElbow => swung(15.0),
        Joint::LeftWrist => swung(40.0),
        Joint::RightKnee => swung(25.0),
        Joint::RightAnkle => swung(12.0),
        Joint::LeftKnee => swung(-12.0),
        Joint::LeftAnkle => swung(-35.0),
        _ => DVec3::Y,
    };
    let mut figure = StickFigure::UNKNOWN;
    figure[Joint::Neck] = DVec3::new(0.0, -0.25, 4.0);
    for joint in Joint::ALL.into_iter().skip(1) {
        let start = joint.start().expect("all but the neck hang on a joint");
        figure[joint] = figure[start] + lengths.to[joint] * (facing * direction(joint));
    }
    (figure, facing * -DVec3::Z)
}

fn view(turned_deg: f64, noise_px: f64) -> (View, TreeOptions) {
    let lengths = SegmentLengths::lee_chen();
    let (figure, heading) = walker(&lengths, turned_deg);
    let noise_rad = noise_px / 1920.0;
    let mut random = Random::new(1);
    let mut rays = JointRays::from_points(&figure);
    for ray in &mut rays.ray.0 {
        let [a, b] = random.normal_pair().map(f64::from);
        *ray = (*ray + noise_rad * DVec3::new(a, b, 0.0)).normalize();
    }
    rays.noise_rad = noise_rad;
    let bearings = Bearings { up: Some(-DVec3::Y), heading: Some(heading), head: None };
    let options = TreeOptions::physical().with_motion(MotionModel::walking()).with_bearings(bearings);
    (View::new(rays, figure[Joint::Neck], lengths), options)
}

fn tree(c: &mut Criterion) {
    let mut bench_group = c.benchmark_group("interpretation tree");
    for (name, turned_deg) in [("front", 0.0), ("45 deg", 45.0), ("side", 90.0)] {
        for noise_px in [0.0, 3.0] {
            let (view, walking) = view(turned_deg, noise_px);
            let physical = TreeOptions { motion: None, ..walking.clone() };
            for (what, options) in [("physical", physical), ("walking", walking)] {
                let found = view.interpret(&options).expect("a proper view");
                let title = format!("{name} {noise_px} px, {} leaves", found.survivors.len());
                bench_group.bench_function(BenchmarkId::new(what, title), |bench| {
                    bench.iter(|| black_box(&view).interpret(&options));
                });
            }
        }
    }
    bench_group.finish();
}

fn grouping(c: &mut Criterion) {
    let (view, options) = view(0.0, 0.0);
    let figures = view.interpret(&options).expect("a proper view").figures();
    c.bench_function(&format!("group {} postures", figures.len()), |bench| {
        bench.iter(|| group(black_box(&figures), DEFAULT_GROUP_M));
    });
}

criterion_group!(benches, tree, grouping);
criterion_main!(benches);
