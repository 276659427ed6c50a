//! Planar motion: closed forms of the fewest views, and fits to a stride of views.
//!
//! The floor of the closed forms is copying their 11 doubles (6 coordinates in; slope, length and two depths
//! out).

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use memo_core::planar::{
    FitOptions, Rod, RodRefusal, fit_hinge, fit_rod, hinge_depths, hinge_from_two_views, rod_by_paper,
    rod_depths, rod_from_ellipse, rod_from_three_views,
};
use memo_core::synth::Random;
use std::hint::black_box;

const PROBLEMS: usize = 10_000;

/// End points of a rod in a plane of a random slope, at three angles.
fn rods() -> Vec<[DVec2; 3]> {
    let mut random = Random::new(1);
    let mut rod = || {
        let tilt = random.uniform(0.2, 1.2);
        let along = DVec2::from_angle(random.uniform(0.0, 6.3));
        let start = random.uniform(0.0, 6.3);
        [0.0, 0.7, 1.2].map(|step: f64| {
            let angle = start + step;
            0.4 * (angle.cos() * tilt.cos() * along + angle.sin() * along.perp())
        })
    };
    (0..PROBLEMS).map(|_| rod()).collect()
}

fn closed_forms(c: &mut Criterion) {
    let problems = rods();
    let mut group = c.benchmark_group("planar closed forms");
    group.sample_size(20).throughput(Throughput::Elements(PROBLEMS as u64));
    let mut copies = vec![[0.0f64; 11]; PROBLEMS];
    group.bench_function("floor: copy 11 doubles", |b| {
        b.iter(|| {
            for (copy, rod) in copies.iter_mut().zip(black_box(&problems)) {
                let [a, b, c] = rod;
                *copy = [a.x, a.y, b.x, b.y, c.x, c.y, a.x, a.y, b.x, b.y, c.x];
            }
            black_box(&mut copies);
        });
    });
    let arrays: Vec<[[f64; 2]; 3]> = problems.iter().map(|d| d.map(|d| d.to_array())).collect();
    let hinges: Vec<[[f64; 2]; 4]> =
        problems.iter().map(|[a, b, c]| [*a, *b, *c, 1.3 * *a + 0.2 * *c].map(|d| d.to_array())).collect();
    let mut depths = vec![[0.0f64; 3]; PROBLEMS];
    group.bench_function("rods, bare depths", |b| {
        b.iter(|| rod_depths(black_box(&arrays), black_box(&mut depths)));
    });
    let mut hinge_rows = vec![[0.0f64; 4]; PROBLEMS];
    group.bench_function("hinges, bare depths", |b| {
        b.iter(|| hinge_depths(black_box(&hinges), black_box(&mut hinge_rows)));
    });
    type Solve = fn(&[DVec2; 3]) -> Result<Rod, RodRefusal>;
    let solvers: [(&str, Solve); 3] = [
        ("rod, three views", rod_from_three_views),
        ("rod, as printed", rod_by_paper),
        ("rod, ellipse", rod_from_ellipse),
    ];
    for (name, solve) in solvers {
        group.bench_function(name, |b| {
            b.iter(|| {
                let depth = |rod: &[DVec2; 3]| solve(rod).map_or(0.0, |rod| rod.depth[0]);
                black_box(&problems).iter().map(depth).sum::<f64>()
            });
        });
    }
    group.bench_function("hinge, two views", |b| {
        b.iter(|| {
            let hinge = |pair: &[[DVec2; 3]]| {
                hinge_from_two_views(&[pair[0][0], pair[0][1]], &[pair[0][2], pair[1][0]])
                    .map_or(0.0, |hinge| hinge.lengths[0])
            };
            black_box(&problems).windows(2).map(hinge).sum::<f64>()
        });
    });
    group.finish();
}

/// A leg that swings, with 1 px of noise at 200 px/m; `off` metres of wobble out of its plane.
fn leg(views: usize, off: f64) -> [Vec<DVec2>; 3] {
    let mut random = Random::new(2);
    let mut points = [Vec::new(), Vec::new(), Vec::new()];
    for view in 0..views {
        let t = std::f64::consts::TAU * view as f64 / views as f64;
        let swing = |angle: f64| DVec2::new(0.8 * angle.sin() + off * (3.0 * angle).cos(), angle.cos());
        let knee = 0.45 * swing(0.4 * t.cos());
        let ankle = knee + 0.42 * swing(0.4 * t.cos() - 0.5 - 0.45 * (t + 0.8).sin());
        for (points, point) in points.iter_mut().zip([DVec2::ZERO, knee, ankle]) {
            points.push(point + 0.005 * DVec2::from_array(random.normal_pair().map(f64::from)));
        }
    }
    points
}

fn fits(c: &mut Criterion) {
    let mut group = c.benchmark_group("planar fits");
    group.sample_size(20);
    let options = FitOptions { noise_sd: 0.005, ..FitOptions::default() };
    let keep_all = FitOptions { max_outlier_fraction: 0.0, ..options };
    for views in [15, 60, 240] {
        let [hip, knee, ankle] = leg(views, 0.0);
        group.bench_function(BenchmarkId::new("hinge", views), |b| {
            b.iter(|| fit_hinge(black_box(&hip), &knee, &ankle, &keep_all));
        });
        group.bench_function(BenchmarkId::new("rod", views), |b| {
            b.iter(|| fit_rod(black_box(&knee), &ankle, &keep_all));
        });
        let [hip, knee, ankle] = leg(views, 0.3);
        group.bench_function(BenchmarkId::new("hinge off its plane", views), |b| {
            b.iter(|| fit_hinge(black_box(&hip), &knee, &ankle, &keep_all));
        });
        group.bench_function(BenchmarkId::new("hinge off its plane, outliers sought", views), |b| {
            b.iter(|| fit_hinge(black_box(&hip), &knee, &ankle, &options));
        });
    }
    group.finish();
}

criterion_group!(benches, closed_forms, fits);
criterion_main!(benches);
