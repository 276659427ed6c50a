//! Gait parameters against what was drawn: walkers who deviate from the average as people do, with early and
//! late left steps, before a known and before a guessed camera. `MEMO_FULL=1` counts over 40 seeds instead of 2.

use memo_core::synth::{Random, SceneOptions, SynthScene};
use memo_core::track::gait_parameters::{GaitParameter, GaitQuantity};
use memo_core::track::result::{Side, TrackedWalk};
use memo_core::track::start::Direction;
use memo_core::track::tracker::{Tracker, TrackerOptions};
use std::collections::BTreeMap;

/// A scene whose walker is not the average one.
fn scene(seed: u64, late_left: f64) -> SynthScene {
    let mut scene = SynthScene::new(SceneOptions { seed, late_left, ..SceneOptions::default() }).unwrap();
    let mut random = Random::new(1000 + seed);
    let style = &mut scene.walker.style;
    style.hip_offset = random.uniform(-0.12, 0.12);
    style.knee_offset = random.uniform(-0.12, 0.12);
    style.leg_amplitude = random.uniform(0.88, 1.12);
    style.arm_amplitude = random.uniform(0.6, 1.4);
    style.trunk_lean = random.uniform(-0.05, 0.05);
    let sizes = &mut scene.walker.body.proportions;
    sizes.shoulder_height += random.uniform(-0.02, 0.02);
    sizes.hip_height += random.uniform(-0.02, 0.02);
    scene
}

fn tracked(scene: &SynthScene, frames: impl Iterator<Item = usize>, knows_camera: bool) -> Vec<TrackedWalk> {
    let options = TrackerOptions {
        camera: knows_camera.then(|| scene.camera.clone()),
        ..TrackerOptions::for_height(scene.walker.body.height_m)
    };
    let mut tracker = Tracker::new(options).unwrap();
    for (index, frame) in frames.enumerate() {
        tracker.update(&scene.frame(frame).as_frame(), scene.time_s(index)).unwrap();
    }
    tracker.finish().unwrap();
    tracker.take_finished()
}

fn truth(scene: &SynthScene, late_left: f64, line: &GaitParameter) -> Option<f64> {
    let (stride_s, speed) = (1.0 / scene.cycle_hz, scene.speed_mps);
    let share = match line.side {
        Some(Side::Right) => 0.5 - late_left,
        Some(Side::Left) => 0.5 + late_left,
        None => 0.5,
    };
    match line.quantity {
        GaitQuantity::Cadence => Some(120.0 / stride_s),
        GaitQuantity::Speed => Some(speed),
        GaitQuantity::StrideTime => Some(stride_s),
        GaitQuantity::StrideLength => Some(speed * stride_s),
        GaitQuantity::StepTime => Some(share * stride_s),
        GaitQuantity::StepLength => Some(share * stride_s * speed),
        GaitQuantity::StepTimeSymmetry | GaitQuantity::StepLengthSymmetry => Some(-400.0 * late_left),
        GaitQuantity::Stance | GaitQuantity::DoubleSupport => None,
    }
}

#[test]
fn intervals_hold_what_was_drawn() {
    let seeds = if std::env::var_os("MEMO_FULL").is_some() { 40 } else { 2 };
    let mut counts: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    let (mut false_claims, mut symmetric, mut found, mut late) = (0, 0, 0, 0);
    for seed in 0..seeds {
        let late_left = Random::new(2000 + seed).uniform(-0.08, 0.08);
        for (late_left, knows_camera) in [(0.0, true), (0.0, false), (late_left, seed % 2 == 0)] {
            let scene = scene(seed, late_left);
            let walks = tracked(&scene, 0..scene.len(), knows_camera);
            let Some(walk) = walks.iter().max_by_key(|walk| walk.steps().len()) else { continue };
            for line in walk.gait_parameters() {
                let (Some(truth), Some([low, high])) = (truth(&scene, late_left, &line), line.interval)
                else {
                    continue;
                };
                let side = line.side.map_or(String::new(), |_| " by side".to_owned());
                let count = counts.entry(format!("{}{side}", line.quantity.name())).or_default();
                count[0] += usize::from((low..=high).contains(&truth));
                count[1] += 1;
                if line.quantity == GaitQuantity::StepTimeSymmetry {
                    let claims = low > 0.0 || high < 0.0;
                    if late_left == 0.0 {
                        symmetric += 1;
                        false_claims += usize::from(claims);
                    } else if late_left.abs() > 0.05 {
                        late += 1;
                        found += usize::from(claims && truth.signum() == line.value.unwrap().signum());
                    }
                }
            }
        }
    }
    println!(
        "asymmetries claimed of symmetric walkers: {false_claims} of {symmetric}; found: {found} of {late}"
    );
    for (name, [held, all]) in &counts {
        println!("{name:24} {held:4} of {all:4}");
        assert!(*all as f64 >= 2.0 * seeds as f64, "{name} was told {all} times only");
        assert!(*held as f64 >= 0.9 * *all as f64, "{name}: {held} of {all}");
    }
    assert!(
        20 * false_claims <= symmetric && found == late,
        "{false_claims} of {symmetric}, {found} of {late}"
    );
}

fn line(table: &[GaitParameter], quantity: GaitQuantity, side: Option<Side>) -> GaitParameter {
    *table.iter().find(|line| line.quantity == quantity && line.side == side).unwrap()
}

#[test]
fn walking_backwards_has_a_negative_speed_and_no_sides() {
    let scene =
        SynthScene::new(SceneOptions { seed: 5, empty_frames: 0, ..SceneOptions::default() }).unwrap();
    let walk = tracked(&scene, (0..scene.len()).rev(), true).remove(0);
    assert_eq!(walk.direction(), Direction::Backward);
    let table = walk.gait_parameters();
    let speed = line(&table, GaitQuantity::Speed, None);
    assert!((speed.value.unwrap() + scene.speed_mps).abs() < 0.02, "{speed:?}");
    let cadence = line(&table, GaitQuantity::Cadence, None).value.unwrap();
    assert!((cadence - 120.0 * scene.cycle_hz).abs() < 1.0, "{cadence}");
    for quantity in [GaitQuantity::StepTimeSymmetry, GaitQuantity::Stance] {
        let line = line(&table, quantity, None);
        assert_eq!((line.value, line.interval, line.n), (None, None, 0));
    }
    assert_eq!(line(&table, GaitQuantity::StepTime, Some(Side::Left)).value, None);
}

#[test]
fn what_is_not_known_is_left_open() {
    let scene = SynthScene::new(SceneOptions { seed: 2, ..SceneOptions::default() }).unwrap();
    let mut walk = tracked(&scene, 0..scene.len(), true).remove(0);
    let sure = walk.gait_parameters();
    assert!(line(&sure, GaitQuantity::StepLength, Some(Side::Right)).value.is_some());
    let stance = line(&sure, GaitQuantity::Stance, None);
    assert!(stance.value.is_some() && stance.interval.is_none() && stance.n == 0, "assumed, not measured");
    // 1. The sides may be interchanged.
    for twin in &mut walk.walk.twins {
        twin.similarity_sum = 30.0;
    }
    assert!(walk.p_swapped() > 0.4);
    let unsure = walk.gait_parameters();
    assert_eq!(line(&unsure, GaitQuantity::StepLength, Some(Side::Right)).value, None);
    assert!(line(&unsure, GaitQuantity::StepLength, None).value.is_some());
    assert_eq!(unsure.len(), sure.len());
    // 2. A handful of frames.
    for twin in &mut walk.walk.twins {
        twin.steps.truncate(6);
    }
    assert!(walk.gait_parameters().iter().all(|line| line.value.is_none() && line.n == 0));
}
