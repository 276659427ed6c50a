//! Gait parameters against what was drawn: a population of walkers who deviate from the average as people are
//! said to by the head of `track::gait_parameters`. `MEMO_FULL=1` counts over 120 walkers instead of 4, and
//! intervals that hardly ever miss are too wide.
//!
//! Drawn of each: how much the steps vary, the reach of the feet, when heels strike, the height given, the field of
//! view of a camera that is not told; and style and proportions, with knees bent by 0.08 rad more or less and shanks
//! tilted by 0.03, strides 7 % longer or shorter, joints 1.2 % of the height higher or lower (chosen: the offsets
//! `track::person` reckons with are larger, but the model's foot does not bend and would leave the ground).

use memo_core::synth::{Random, SceneOptions, Uneven};
use memo_core::track::start::Direction;
use memo_core::{GaitParameter, GaitQuantity, Side, SynthScene, TrackedWalk, Tracker, TrackerOptions};
use std::collections::BTreeMap;

fn normal(random: &mut Random, sd: f64) -> f64 {
    sd * f64::from(random.normal_pair()[0])
}

/// One of the population, with what is true of it.
struct Drawn {
    scene: SynthScene,
    late_left: f64,
    /// When the heels strike, in cycles after the pictures show the average gait's strike.
    strike: [f64; 2],
    right_reach_m: f64,
    /// The height as somebody measured it.
    given_height_m: f64,
    knows_camera: bool,
}

impl Drawn {
    /// Every second walker is before a guessed camera, every third walks aslant, every fourth strikes late or
    /// early on the left.
    fn new(seed: u64) -> Self {
        let mut random = Random::new(3000 + seed);
        let late_left = if seed % 4 == 3 { random.uniform(-0.08, 0.08) } else { 0.0 };
        let slant_rad = if seed % 3 == 1 { random.uniform(-0.45, 0.45) } else { 0.0 };
        Self::of(seed, late_left, slant_rad)
    }

    fn limping(seed: u64, late_left: f64) -> Self {
        Self::of(500 + seed, late_left, 0.0)
    }

    fn of(seed: u64, late_left: f64, slant_rad: f64) -> Self {
        let mut random = Random::new(1000 + seed);
        let knows_camera = seed.is_multiple_of(2);
        let field_of_view_rad = if knows_camera { 0.9 } else { random.uniform(45.0, 75.0).to_radians() };
        let right_reach_m = normal(&mut random, 0.012);
        let step_sd = (0.03 * (1.0 + normal(&mut random, 0.33))).max(0.005);
        let uneven = Uneven { step_time_sd: step_sd, step_length_sd: step_sd, right_reach_m };
        let options =
            SceneOptions { seed, late_left, slant_rad, field_of_view_rad, uneven, ..SceneOptions::default() };
        let scene = SynthScene::new(options).unwrap();
        let mut walker = scene.walker.clone();
        let style = &mut walker.style;
        style.knee_offset = normal(&mut random, 0.08);
        style.hip_offset = style.knee_offset + normal(&mut random, 0.03);
        style.leg_amplitude = 1.0 + normal(&mut random, 0.07);
        style.arm_amplitude = random.uniform(0.6, 1.4);
        style.trunk_lean = normal(&mut random, 0.03);
        let sizes = &mut walker.body.proportions;
        sizes.shoulder_height += normal(&mut random, 0.012);
        sizes.hip_height += normal(&mut random, 0.012);
        let given_height_m = walker.body.height_m + normal(&mut random, 0.02);
        let strike = [normal(&mut random, 0.008), normal(&mut random, 0.008)];
        let scene = scene.with_walker(walker).unwrap();
        Self { scene, late_left, strike, right_reach_m, given_height_m, knows_camera }
    }

    fn walk(&self) -> Option<TrackedWalk> {
        let scene = &self.scene;
        let walks = tracked(scene, 0..scene.len(), self.given_height_m, self.knows_camera);
        walks.into_iter().max_by_key(|walk| walk.steps().len())
    }

    /// What is true of the walker, not of the few steps that were drawn.
    fn truth(&self, line: &GaitParameter) -> Option<f64> {
        let (stride_s, speed) = (1.0 / self.scene.cycle_hz, self.scene.speed_mps);
        let late_right = self.strike[0] - self.strike[1] - self.late_left;
        let sign = match line.side {
            Some(Side::Right) => 1.0,
            Some(Side::Left) => -1.0,
            None => 0.0,
        };
        let step_s = |sign: f64| (0.5 + sign * late_right) * stride_s;
        let step_m = |sign: f64| speed * step_s(sign) + sign * self.right_reach_m;
        match line.quantity {
            GaitQuantity::Cadence => Some(120.0 / stride_s),
            GaitQuantity::Speed => Some(speed),
            GaitQuantity::StrideTime => Some(stride_s),
            GaitQuantity::StrideLength => Some(speed * stride_s),
            GaitQuantity::StepTime => Some(step_s(sign)),
            GaitQuantity::StepLength => Some(step_m(sign)),
            GaitQuantity::StepTimeSymmetry => Some(200.0 * (step_s(1.0) - step_s(-1.0)) / stride_s),
            GaitQuantity::StepLengthSymmetry => {
                Some(200.0 * (step_m(1.0) - step_m(-1.0)) / (speed * stride_s))
            }
            _ => None,
        }
    }
}

fn tracked(
    scene: &SynthScene,
    frames: impl Iterator<Item = usize>,
    height_m: f64,
    knows_camera: bool,
) -> Vec<TrackedWalk> {
    let options = TrackerOptions {
        camera: knows_camera.then(|| scene.camera.clone()),
        ..TrackerOptions::for_height(height_m)
    };
    let mut tracker = Tracker::new(options).unwrap();
    for (index, frame) in frames.enumerate() {
        tracker.update(&scene.frame(frame).as_frame(), scene.time_s(index)).unwrap();
    }
    tracker.finish().unwrap();
    tracker.take_finished()
}

/// How often a parameter's intervals hold what is true, and how wide they are.
#[derive(Default)]
struct Count {
    held: usize,
    all: usize,
    /// Half widths: per cent of the value, of symmetries in their own unit.
    half_sum: f64,
}

#[test]
fn intervals_hold_what_was_drawn() {
    let is_full = std::env::var_os("MEMO_FULL").is_some();
    let mut counts: BTreeMap<String, Count> = BTreeMap::new();
    let seeds = if is_full { 120 } else { 4 };
    for drawn in (0..seeds).map(Drawn::new) {
        let Some(walk) = drawn.walk() else { continue };
        for line in walk.gait_parameters() {
            let (Some(truth), Some([low, high])) = (drawn.truth(&line), line.interval) else { continue };
            let side = line.side.map_or("", |_| " by side");
            let count = counts.entry(format!("{}{side}", line.quantity.name())).or_default();
            let per_cent = if line.quantity.unit() == "%" { 1.0 } else { 100.0 / truth };
            count.held += usize::from((low..=high).contains(&truth));
            count.all += 1;
            count.half_sum += 0.5 * (high - low) * per_cent;
        }
    }
    let (mut held, mut all) = (0, 0);
    for (name, count) in &counts {
        let share = count.held as f64 / count.all as f64;
        let half = count.half_sum / count.all as f64;
        println!("{name:22} {:4} of {:4} {:5.1} %, ±{half:.1} %", count.held, count.all, 100.0 * share);
        assert!(count.all as f64 >= 0.9 * seeds as f64, "{name} was told {} times only", count.all);
        assert!(!is_full || share >= 0.9, "{name}: {} of {}", count.held, count.all);
        (held, all) = (held + count.held, all + count.all);
    }
    assert!(10 * held >= 8 * all && (!is_full || 100 * held <= 98 * all), "{held} of {all}");
}

/// 20 % of the step time between the sides, as in a marked limp.
#[test]
fn a_limp_is_told_with_its_side() {
    let seeds: u64 = if std::env::var_os("MEMO_FULL").is_some() { 40 } else { 1 };
    let (mut signs, mut told) = (0, 0);
    for seed in 0..seeds {
        let late_left = if seed.is_multiple_of(2) { 0.08 } else { -0.08 };
        let drawn = Drawn::limping(seed, late_left);
        let table = drawn.walk().expect("somebody walks").gait_parameters();
        let symmetry = line(&table, GaitQuantity::StepTimeSymmetry, None);
        let (value, [low, high]) = (symmetry.value.unwrap(), symmetry.interval.unwrap());
        signs += usize::from(value * late_left < 0.0);
        told += usize::from(if late_left > 0.0 { high < 0.0 } else { low > 0.0 });
    }
    println!("right sign {signs} of {seeds}, told to be asymmetric {told}");
    assert!(signs == seeds as usize && 10 * told >= 8 * seeds as usize, "{signs}, {told} of {seeds}");
}

fn line(table: &[GaitParameter], quantity: GaitQuantity, side: Option<Side>) -> GaitParameter {
    *table.iter().find(|line| line.quantity == quantity && line.side == side).unwrap()
}

#[test]
fn walking_backwards_has_a_negative_speed_and_no_sides() {
    let scene =
        SynthScene::new(SceneOptions { seed: 5, empty_frames: 0, ..SceneOptions::default() }).unwrap();
    let walk = tracked(&scene, (0..scene.len()).rev(), scene.walker.body.height_m, true).remove(0);
    assert_eq!(walk.direction(), Direction::Backward);
    assert!(walk.start.p_other_direction < 0.1, "{}", walk.start.p_other_direction);
    assert!(walk.rows().iter().all(|row| row.speed_mps < 0.0));
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
    let mut walk = tracked(&scene, 0..scene.len(), scene.walker.body.height_m, true).remove(0);
    let sure = walk.gait_parameters();
    assert!(line(&sure, GaitQuantity::StepLength, Some(Side::Right)).value.is_some());
    let stance = line(&sure, GaitQuantity::Stance, None);
    assert!(stance.value.is_some_and(|value| (50.0..75.0).contains(&value)) && stance.n >= 2, "{stance:?}");
    // Each side has its own: both together are their mean, and one foot stands alone while the other swings.
    let of = |quantity, side| line(&sure, quantity, Some(side)).value.unwrap();
    let [right, left] = [Side::Right, Side::Left].map(|side| of(GaitQuantity::Stance, side));
    let [n_right, n_left] =
        [Side::Right, Side::Left].map(|side| line(&sure, GaitQuantity::Stance, Some(side)).n);
    assert_eq!(n_right + n_left, stance.n);
    assert!((0.5 * (right + left) - stance.value.unwrap()).abs() < 1e-9, "{right} {left} {stance:?}");
    assert!((of(GaitQuantity::SingleSupport, Side::Right) - (100.0 - left)).abs() < 1e-9);
    assert!((of(GaitQuantity::Swing, Side::Left) - (100.0 - left)).abs() < 1e-9);
    // 1. The sides may be interchanged.
    walk.fit.as_mut().unwrap().as_mut().unwrap().p_swapped = 0.45;
    assert!(walk.p_swapped() > 0.4);
    let unsure = walk.gait_parameters();
    for quantity in [GaitQuantity::StepLength, GaitQuantity::Stance, GaitQuantity::SingleSupport] {
        assert_eq!(line(&unsure, quantity, Some(Side::Right)).value, None);
    }
    assert!(line(&unsure, GaitQuantity::StepLength, None).value.is_some());
    assert_eq!(unsure.len(), sure.len());
    // 2. Without a fit, and a handful of frames.
    walk.fit = None;
    assert_eq!(line(&walk.gait_parameters(), GaitQuantity::Stance, None).value, None);
    for twin in &mut walk.walk.twins {
        twin.steps.truncate(6);
    }
    assert!(walk.gait_parameters().iter().all(|line| line.value.is_none() && line.n == 0));
}
