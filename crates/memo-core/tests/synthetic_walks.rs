//! The whole tracker on synthetic sequences with ground truth: 20 seeds, noise sigma 5, both directions.

use memo_core::synth::{SceneOptions, SynthScene};
use memo_core::track::result::TrackedWalk;
use memo_core::track::start::Direction;
use memo_core::track::tracker::{Tracker, TrackerOptions};

fn tracked(scene: &SynthScene) -> Vec<TrackedWalk> {
    let mut options = TrackerOptions::for_height(scene.walker.body.height_m);
    options.camera = Some(scene.camera.clone());
    let mut tracker = Tracker::new(options).unwrap();
    for frame in 0..scene.len() {
        tracker.update(&scene.frame(frame).as_frame(), scene.time_s(frame)).unwrap();
    }
    tracker.finish().unwrap();
    tracker.take_finished()
}

/// Root mean squares of position along the path, height (metres) and phase over all rows.
fn errors(scene: &SynthScene, walk: &TrackedWalk) -> [f64; 3] {
    let rows = walk.rows();
    let mut sums = [0.0; 3];
    for row in &rows {
        let truth = scene.truth(row.frame).expect("rows only where the walker is");
        let off = row.torso_centre - truth.posed.torso_centre;
        let phase = row.phase - truth.hypothesis.phase;
        let phase = phase - phase.round();
        for (sum, error) in sums.iter_mut().zip([off.truncate().dot(scene.path.direction()), off.z, phase]) {
            *sum += error * error / rows.len() as f64;
        }
    }
    sums.map(f64::sqrt)
}

#[test]
fn twenty_seeds_in_both_directions() {
    let mut worst = [0.0f64; 3];
    let mut all = [0.0f64; 3];
    for seed in 0..20 {
        let scene =
            SynthScene::new(SceneOptions { seed, leftward: Some(seed % 2 == 0), ..SceneOptions::default() });
        let walks = tracked(&scene);
        assert_eq!(walks.len(), 1, "seed {seed}: {} walks", walks.len());
        let walk = &walks[0];
        assert_eq!(walk.direction(), Direction::Forward, "seed {seed}");
        assert!(walk.rows().len() >= 70, "seed {seed}: {} rows", walk.rows().len());
        assert!(walk.p_swapped() < 0.2, "seed {seed}: p_swapped {}", walk.p_swapped());
        let errors = errors(&scene, walk);
        println!("seed {seed}: along {:.4} m, height {:.4} m, phase {:.4}", errors[0], errors[1], errors[2]);
        assert!(errors[2] < 0.1, "seed {seed}: half a cycle off? {errors:?}");
        for i in 0..3 {
            worst[i] = worst[i].max(errors[i]);
            all[i] += errors[i] * errors[i] / 20.0;
        }
    }
    let rms = all.map(f64::sqrt);
    println!(
        "over all seeds: along {:.4} m, height {:.4} m, phase {:.4}; worst {worst:.4?}",
        rms[0], rms[1], rms[2]
    );
    assert!(rms[0] <= 0.01 && rms[1] <= 0.01 && rms[2] <= 0.01, "{rms:?}");
}
