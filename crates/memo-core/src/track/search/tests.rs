use super::super::score::{Measure, similarity};
use super::*;
use crate::image::Rectangle;
use crate::model::{Body, Gait, GaitStyle};

pub fn walker() -> Walker {
    Walker { body: Body::from_height(1.75).unwrap(), gait: Gait::dense(), style: GaitStyle::default() }
}

pub fn camera() -> Camera {
    Camera::level([640, 480], 0.9, 1.1, 6.0).unwrap()
}

/// The rectangle of the changes of a person at this place of a path.
pub fn rectangle_of(walker: &Walker, camera: &Camera, path: &Path, along_m: f64) -> Rectangle {
    let [sole, crown] =
        [0.0, walker.level_crown_height_m()].map(|z| camera.project(path.point(along_m, z)).unwrap());
    Rectangle {
        left: (sole.x - 40.0).round() as usize,
        right: (sole.x + 40.0).round() as usize,
        top: (crown.y - 2.0).round() as usize,
        bottom: sole.y.round() as usize,
    }
}

/// The edges of the image that a hypothesis would show.
pub fn edges_of(scene: &Scene<'_>, truth: &Hypothesis) -> Vec<EdgeLine> {
    let edge = |l: ModelLine| EdgeLine { start: l.start, end: l.end, gradient: 20.0, velocity: 0.0 };
    scene.lines(truth).into_iter().map(edge).collect()
}

#[test]
fn the_printed_grid_has_4851_hypotheses() {
    let grid = Grid::printed(&Hypothesis { along_m: 0.0, height_m: 1.2, phase: 0.4 });
    assert_eq!((grid.along.count, grid.height.count, grid.phase.count), (21, 11, 21));
    assert_eq!(grid.len(), 4851);
    assert!((grid.along.at(0) + 0.2).abs() < 1e-12 && (grid.phase.at(20) - 0.6).abs() < 1e-12);
    assert_eq!(Grid::whole_cycle(0.0, 1.2).phase.count, 50);
    assert!(Grid::whole_cycle(0.0, 1.2).phase.at(0).abs() < 1e-12);
}

/// Scores of a grid from a formula.
fn scored(grid: Grid, score: impl Fn(&[f64; 3]) -> f64) -> SearchResult {
    let mut scores = Vec::new();
    for p in 0..grid.phase.count {
        for a in 0..grid.along.count {
            for h in 0..grid.height.count {
                scores.push(score(&[grid.along.at(a), grid.height.at(h), grid.phase.at(p)]) as f32);
            }
        }
    }
    let best_index = arg_max(&scores);
    SearchResult { grid, scores, best_index }
}

/// A grid whose axes all differ.
fn uneven_grid() -> Grid {
    Grid {
        along: Axis { centre: -0.3, step: 0.02, count: 9 },
        height: Axis { centre: 1.1, step: 0.01, count: 5 },
        phase: Axis { centre: 0.42, step: 0.04, count: 7 },
    }
}

#[test]
fn the_vertex_of_a_planted_paraboloid_is_found_between_the_grid_points() {
    // Vertices on either side of a grid point, along every axis.
    for signs in [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]] {
        let truth = [-0.26 + signs[0] * 0.008, 1.1 + signs[1] * 0.003, 0.46 + signs[2] * 0.013];
        let found = scored(uneven_grid(), |at| {
            let [x, y, z] = [at[0] - truth[0], at[1] - truth[1], at[2] - truth[2]];
            0.9 - 40.0 * x * x - 300.0 * y * y - 20.0 * z * z
        });
        let best = found.refined();
        let off = [best.along_m - truth[0], best.height_m - truth[1], best.phase - truth[2]];
        assert!(off.iter().all(|x| x.abs() < 1e-4), "{signs:?}: off by {off:?}");
        let nearest = found.best();
        assert!((nearest.along_m + 0.26).abs() < 1e-9 && (nearest.height_m - 1.1).abs() < 1e-9);
        assert!((nearest.phase - 0.46).abs() < 1e-9);
    }
}

#[test]
fn at_the_ends_of_an_axis_nothing_is_moved() {
    let grid = uneven_grid();
    for sign in [-1.0, 1.0] {
        let found = scored(grid, |at| sign * (at[0] + 2.0 * at[1] + at[2]));
        let end = |axis: &Axis| axis.at(if sign < 0.0 { 0 } else { axis.count - 1 });
        let best = found.refined();
        assert_eq!((best.along_m, best.height_m), (end(&grid.along), end(&grid.height)));
        assert_eq!(best.phase, end(&grid.phase));
    }
    let point = Axis { centre: 0.7, step: 0.02, count: 1 };
    assert_eq!(point.refined(0, |_| 0.5), 0.7);
}

#[test]
fn a_flat_top_stays_where_it_is_and_of_equals_the_first_is_best() {
    let found = scored(uneven_grid(), |_| 0.25);
    assert_eq!((found.best_index, found.best_score()), (0, 0.25));
    assert_eq!(arg_max(&[0.1, 0.5, 0.2, 0.5]), 1);
    let axis = Axis { centre: 0.0, step: 0.1, count: 5 };
    assert_eq!(axis.refined(2, |_| 0.4), 0.0);
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    let scene = Scene::new(&walker, &camera, &path);
    let empty = search(&[], &scene, &uneven_grid(), &SimilarityOptions::default(), HiddenLines::default());
    assert_eq!((empty.best_index, empty.best_score()), (0, 0.0));
}

#[test]
fn phases_are_wrapped_and_the_curve_has_the_best_of_each_phase() {
    let grid = Grid { phase: Axis { centre: 0.01, step: 0.04, count: 5 }, ..uneven_grid() };
    let truth = |phase: f64| -0.3 + 0.5 * phase;
    let found = scored(grid, |at| {
        let (off, turned) = (at[0] - truth(at[2]), at[2] + 0.033);
        0.9 - 40.0 * off * off - 3.0 * turned * turned - (at[1] - 1.1).abs()
    });
    assert!((0.95..1.0).contains(&found.refined().phase), "{:?}", found.refined());
    let phases = [0.93, 0.97, 0.01, 0.05, 0.09];
    let curve = found.curve();
    assert_eq!(curve.len(), phases.len());
    for (p, ((best, score), phase)) in curve.iter().zip(phases).enumerate() {
        assert!((best.phase - phase).abs() < 1e-9 && (best.height_m - 1.1).abs() < 1e-9, "{best:?}");
        assert!((best.along_m - truth(grid.phase.at(p))).abs() <= 0.0101, "{best:?}");
        let slice = &found.scores[p * 45..(p + 1) * 45];
        assert!(slice.contains(score) && slice.iter().all(|s| s <= score));
    }
}

#[test]
fn an_axis_reaches_its_half_width_to_the_nearest_step() {
    for (half_width, step, count) in [(0.3, 0.1, 7), (0.2, 0.02, 21), (0.06, 0.02, 7), (0.071, 0.02, 9)] {
        let axis = Axis::around(1.5, half_width, step);
        assert_eq!(axis.count, count);
        let reach = 0.5 * (count as f64 - 1.0) * step;
        assert!((axis.at(0) - 1.5 + reach).abs() < 1e-12 && (axis.at(count - 1) - 1.5 - reach).abs() < 1e-12);
    }
}

#[test]
fn a_pose_leads_back_to_its_hypothesis() {
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::new(0.4, -0.7), heading_rad: 2.3 };
    let scene = Scene::new(&walker, &camera, &path);
    for phase in [0.0, 0.13, 0.4, 0.77] {
        let truth = Hypothesis { along_m: 0.6, height_m: 1.21, phase };
        let found = scene.hypothesis_at(scene.pose(&truth).torso_centre, phase);
        assert!((found.along_m - 0.6).abs() < 1e-12 && (found.height_m - 1.21).abs() < 1e-12, "{found:?}");
    }
    let across = path.point(0.6, 0.0).truncate() + 0.8 * path.direction().perp();
    assert!((path.along(across) - 0.6).abs() < 1e-12);
}

/// More points than one block has lanes, in several tiles, the last of which is shorter.
#[test]
fn every_point_is_compared_as_its_searched_lines() {
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::new(0.1, 0.2), heading_rad: 0.2 };
    let scene = Scene::new(&walker, &camera, &path);
    let truth = Hypothesis { along_m: 0.1, height_m: walker.level_torso_height_m(), phase: 0.41 };
    let edges = edges_of(&scene, &truth);
    let phase = Axis { centre: 0.43, step: 0.02, count: 1 };
    let height = Axis::around(truth.height_m - 0.03, 0.2, 0.01);
    let grid = Grid { along: Axis::around(0.12, 0.18, 0.02), height, phase };
    let options = SimilarityOptions::default();
    let found = search(&edges, &scene, &grid, &options, HiddenLines::PerTile);
    assert_eq!(found.scores.len(), 19 * 41);
    for (index, score) in found.scores.iter().enumerate() {
        let lines = scene.searched_lines(&grid.hypothesis(index), &grid, HiddenLines::PerTile);
        let plain = similarity(&lines, &edges, &options).value;
        assert!((plain - score).abs() < 1e-4, "point {index}: {plain} against {score}");
    }
    assert!((found.best().height_m - truth.height_m).abs() < 0.011);
}

#[test]
fn a_planted_walker_is_found_in_both_directions() {
    let (walker, camera) = (walker(), camera());
    let height_m = walker.level_torso_height_m();
    for heading_rad in [0.0, std::f64::consts::PI] {
        let path = Path { origin: DVec2::ZERO, heading_rad };
        let scene = Scene::new(&walker, &camera, &path);
        for (i, phase) in [0.13, 0.37, 0.62, 0.88].into_iter().enumerate() {
            let truth = Hypothesis { along_m: 0.3 * i as f64 - 0.5, height_m, phase };
            let edges = edges_of(&scene, &truth);
            let around =
                Hypothesis { along_m: truth.along_m + 0.04, height_m: height_m - 0.02, phase: phase + 0.04 };
            let found = search(
                &edges,
                &scene,
                &Grid::printed(&around),
                &SimilarityOptions::default(),
                HiddenLines::default(),
            );
            let best = found.refined();
            assert!((best.along_m - truth.along_m).abs() < 0.012, "{best:?} against {truth:?}");
            assert!((best.height_m - height_m).abs() < 0.012, "{best:?} against {truth:?}");
            assert!((best.phase - phase).abs() < 0.012, "{best:?} against {truth:?}");
            assert!(found.best_score() > 0.98, "{}", found.best_score());
        }
    }
}

#[test]
fn sharing_visibility_in_a_tile_changes_little_and_threads_change_nothing() {
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::new(0.2, 0.1), heading_rad: 0.3 };
    let scene = Scene::new(&walker, &camera, &path);
    let truth = Hypothesis { along_m: 0.1, height_m: walker.level_torso_height_m(), phase: 0.41 };
    let edges = edges_of(&scene, &Hypothesis { phase: 0.45, ..truth });
    let grid = Grid::printed(&truth);
    let options = SimilarityOptions::default();
    let shared = search(&edges, &scene, &grid, &options, HiddenLines::PerTile);
    let exact = search(&edges, &scene, &grid, &options, HiddenLines::PerHypothesis);
    assert_eq!(shared.best_index, exact.best_index);
    let worst = shared.scores.iter().zip(&exact.scores).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst < 0.02, "largest change of a score: {worst}");
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let again = pool.install(|| search(&edges, &scene, &grid, &options, HiddenLines::PerTile));
        assert!(again.scores.iter().zip(&shared.scores).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn fast_scores_equal_the_plain_similarity() {
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    let scene = Scene::new(&walker, &camera, &path);
    let truth = Hypothesis { along_m: 0.0, height_m: walker.level_torso_height_m(), phase: 0.2 };
    let mut edges = edges_of(&scene, &truth);
    for (i, edge) in edges.iter_mut().enumerate() {
        (edge.gradient, edge.velocity) = ((7 * i % 50) as f32, (5 * i % 8) as f32);
    }
    let small = |v: f64, step: f64| Axis::around(v, 2.0 * step, step);
    let grid =
        Grid { along: small(0.05, 0.02), height: small(truth.height_m, 0.02), phase: small(0.25, 0.02) };
    let rohr = SimilarityOptions::default();
    let mut weighted = SimilarityOptions {
        full_gradient: Some(40.0),
        full_velocity: Some(6.0),
        sigma_phi_rad: 0.7,
        c_l: 0.5,
        c_d: 0.8,
        c_r: 0.4,
        ..rohr
    };
    weighted.part_weights[3] = 0.2;
    let lowe = SimilarityOptions { measure: Measure::Lowe, ..rohr };
    for options in [rohr, weighted, lowe] {
        let found = search(&edges, &scene, &grid, &options, HiddenLines::PerHypothesis);
        for (index, score) in found.scores.iter().enumerate() {
            let plain = similarity(&scene.lines(&grid.hypothesis(index)), &edges, &options);
            assert!((plain.value - score).abs() < 1e-4, "{} against {score}, {options:?}", plain.value);
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.4 };
    let scene = Scene::new(&walker, &camera, &path);
    let truth = Hypothesis { along_m: 0.2, height_m: walker.level_torso_height_m(), phase: 0.3 };
    let (edges, options) = (edges_of(&scene, &truth), SimilarityOptions::default());
    let visible = scene.visible(&Hypothesis { phase: 0.35, ..truth }, &LINES_ONLY);
    let on = |arch: pulp::Arch| {
        arch.dispatch(Moved {
            scorer: &LaneScorer::new(&edges, &options),
            projection: &Projection::new(&camera, DVec3::ZERO, path.direction()),
            visible: &visible,
            moved_m: [0.01, 0.02].map(|step| std::array::from_fn(|i| step * i as f32 - 0.08)),
            near: &mut Vec::new(),
        })
    };
    let (best, plain) = (on(pulp::Arch::new()), on(pulp::Arch::Scalar));
    assert!(best[8] > 0.1 && best.map(f32::to_bits) == plain.map(f32::to_bits));
}

/// A planted walker whose edges are broken, moved and incomplete, before a wall of other edges.
fn cluttered(scene: &Scene<'_>, truth: &Hypothesis, seed: u64) -> Vec<EdgeLine> {
    let mut state = seed;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut edges = Vec::new();
    for edge in edges_of(scene, truth) {
        let mut moved = |p: [f32; 2]| p.map(|x| x + 4.0 * (random() - 0.5));
        let (start, end) = (moved(edge.start), moved(edge.end));
        if random() < 0.8 {
            edges.push(EdgeLine { start, end, ..edge });
        }
    }
    for _ in 0..40 {
        let (x, y) = (200.0 + 240.0 * random(), 120.0 + 300.0 * random());
        let (turn, length) = (std::f32::consts::PI * random(), 10.0 + 40.0 * random());
        let end = [x + length * turn.cos(), y + length * turn.sin()];
        edges.push(EdgeLine { start: [x, y], end, gradient: 20.0, velocity: 0.0 });
    }
    edges
}

#[test]
fn the_highest_point_is_found_without_the_whole_grid() {
    let (walker, camera) = (walker(), camera());
    let height_m = walker.level_torso_height_m();
    let options = SimilarityOptions::default();
    let (mut same_phases, mut phases, mut looked, mut all) = (0, 0, 0, 0);
    for seed in 0..12 {
        let path = Path { origin: DVec2::ZERO, heading_rad: 0.1 * seed as f64 };
        let scene = Scene::new(&walker, &camera, &path);
        let truth = Hypothesis { along_m: 0.05 * seed as f64 - 0.3, height_m, phase: 0.083 * seed as f64 };
        let edges = cluttered(&scene, &truth, seed);
        let off = Hypothesis {
            along_m: truth.along_m + 0.07,
            height_m: height_m - 0.03,
            phase: truth.phase - 0.09,
        };
        let grid = Grid::printed(&off);
        let whole = search(&edges, &scene, &grid, &options, HiddenLines::default());
        let peak = search_peak(&edges, &scene, &grid, &options, HiddenLines::default());
        assert_eq!((peak.best_index, peak.refined()), (whole.best_index, whole.refined()), "seed {seed}");
        let scored = || peak.scores.iter().zip(&whole.scores).filter(|(a, _)| **a > f32::NEG_INFINITY);
        assert!(scored().all(|(a, b)| a.to_bits() == b.to_bits()));
        looked += scored().count();
        all += grid.len();

        let cycle = Grid::whole_cycle(off.along_m, height_m);
        let whole = search(&edges, &scene, &cycle, &options, HiddenLines::default()).curve();
        let each = search_each_phase(&edges, &scene, &cycle, &options, HiddenLines::default()).curve();
        for (each, whole) in each.iter().zip(&whole) {
            assert!(each.1 <= whole.1 && each.1 > whole.1 - 0.02, "seed {seed}: {each:?} against {whole:?}");
            same_phases += usize::from(each == whole);
        }
        phases += whole.len();
    }
    assert!(2 * looked < all, "{looked} of {all} hypotheses");
    assert!(same_phases as f64 > 0.95 * phases as f64, "{same_phases} of {phases} phases");
}

#[test]
fn a_grid_of_one_column_or_of_even_numbers_is_searched_to_its_ends() {
    let (walker, camera) = (walker(), camera());
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    let scene = Scene::new(&walker, &camera, &path);
    let truth = Hypothesis { along_m: 0.0, height_m: walker.level_torso_height_m(), phase: 0.2 };
    let (edges, options) = (edges_of(&scene, &truth), SimilarityOptions::default());
    let axis = |centre: f64, count: usize| Axis { centre, step: 0.02, count };
    for (alongs, phases) in [(1, 1), (1, 4), (4, 1), (2, 2), (4, 6)] {
        let height = axis(truth.height_m, 3);
        // The truth is in the last column of either axis.
        let last = |at: f64, count: usize| axis(at - 0.01 * (count as f64 - 1.0), count);
        let grid = Grid { along: last(0.0, alongs), height, phase: last(0.2, phases) };
        for find in [search, search_peak, search_each_phase] {
            let found = find(&edges, &scene, &grid, &options, HiddenLines::default());
            assert_eq!(found.best_index, grid.len() - 2, "{alongs} x {phases}");
        }
    }
}

/// The lower of two peaks is at a column that is looked at first, the higher one between such columns.
#[test]
fn the_higher_of_two_peaks_is_found() {
    let (walker, camera) = (walker(), camera());
    let height_m = walker.level_torso_height_m();
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    let scene = Scene::new(&walker, &camera, &path);
    let grid = Grid::printed(&Hypothesis { along_m: 0.0, height_m, phase: 0.3 });
    let at = |phase: usize, along: usize| Hypothesis {
        along_m: grid.along.at(along),
        height_m,
        phase: grid.phase.at(phase),
    };
    let options = SimilarityOptions::default();
    for (high, low) in [([5, 3], [16, 16]), ([15, 17], [4, 4]), ([17, 5], [2, 16])] {
        let mut edges = edges_of(&scene, &at(low[0], low[1]));
        let shortened = |edge: &EdgeLine| {
            let [x, y] = [0, 1].map(|k| edge.start[k] + 0.85 * (edge.end[k] - edge.start[k]));
            EdgeLine { end: [x, y], ..*edge }
        };
        edges = edges.iter().map(shortened).collect();
        edges.extend(edges_of(&scene, &at(high[0], high[1])));
        let whole = search(&edges, &scene, &grid, &options, HiddenLines::default());
        let found = search_peak(&edges, &scene, &grid, &options, HiddenLines::default());
        assert_eq!(whole.grid.split(whole.best_index).0, high[0], "planted");
        assert_eq!(found.best_index, whole.best_index, "{high:?}");
    }
}
