//! The paper's grid searches against the edges of one frame, hidden-line removal included: 4851 hypotheses
//! while tracking, 11550 over the whole cycle at the start.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use memo_core::model::GaitStyle;
use memo_core::track::score::{EdgeLine, SimilarityOptions};
use memo_core::track::search::{
    Grid, HiddenLines, Hypothesis, Path, Scene, SearchResult, search, search_each_phase, search_peak,
};
use memo_core::{Body, Camera, Gait, Walker};
use std::hint::black_box;

/// The walker's own contours, broken in two, plus clutter: about as many edges as a real frame's region
/// holds.
fn edges(scene: &Scene<'_>, truth: &Hypothesis) -> Vec<EdgeLine> {
    let edge = |start: [f32; 2], end: [f32; 2]| EdgeLine { start, end, gradient: 20.0, velocity: 0.0 };
    let mut edges = Vec::new();
    for line in scene.lines(truth) {
        let at = |t: f32| [0, 1].map(|i| line.start[i] + t * (line.end[i] - line.start[i]));
        edges.extend([edge(at(0.0), at(0.45)), edge(at(0.5), at(1.0))]);
    }
    for i in 0..40u32 {
        let x = 250.0 + ((i * 37) % 140) as f32;
        let y = 150.0 + ((i * 61) % 230) as f32;
        let angle = i as f32 * 0.7;
        edges.push(edge([x, y], [x + 14.0 * angle.cos(), y + 14.0 * angle.sin()]));
    }
    edges
}

fn grid_search(c: &mut Criterion) {
    let walker =
        Walker { body: Body::from_height(1.75).unwrap(), gait: Gait::dense(), style: GaitStyle::default() };
    let camera = Camera::level([640, 480], 0.9, 1.1, 6.0).unwrap();
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    let scene = Scene::new(&walker, &camera, &path);
    let truth = Hypothesis { along_m: 0.0, height_m: walker.level_torso_height_m(), phase: 0.2 };
    let edges = edges(&scene, &truth);
    let options = SimilarityOptions::default();
    let mut group = c.benchmark_group(format!("{} edges, 640x480", edges.len()));
    group.sample_size(30);
    let tracking = Grid::printed(&truth);
    let whole_cycle = Grid::whole_cycle(truth.along_m, truth.height_m);
    let (per_tile, per_hypothesis) = (HiddenLines::PerTile, HiddenLines::PerHypothesis);
    type Search = fn(&[EdgeLine], &Scene<'_>, &Grid, &SimilarityOptions, HiddenLines) -> SearchResult;
    let searches: [(&str, Search, Grid, HiddenLines); 5] = [
        ("tracking, hidden lines per tile", search, tracking, per_tile),
        ("tracking, hidden lines per hypothesis", search, tracking, per_hypothesis),
        ("tracking, highest point", search_peak, tracking, per_tile),
        ("whole cycle, hidden lines per tile", search, whole_cycle, per_tile),
        ("whole cycle, highest point of each phase", search_each_phase, whole_cycle, per_tile),
    ];
    for (name, search, grid, hidden_lines) in searches {
        group.throughput(Throughput::Elements(grid.len() as u64));
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            group.bench_function(format!("{name}, {threads} threads"), |b| {
                b.iter(|| pool.install(|| search(black_box(&edges), &scene, &grid, &options, hidden_lines)));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, grid_search);
criterion_main!(benches);
