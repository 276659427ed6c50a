//! The whole tracker on people in clothes, whose body, gait and picture share nothing with the model: finding,
//! sides, events, places, angles, intervals, and what does not walk.
//!
//! The bounds are floors under what was measured on other seeds, not aims; `--nocapture` prints the figures, and
//! `MEMO_FULL=1` draws eight times as many.

use glam::DVec2;
use memo_core::synth::{ClothedOptions, FootContact, Mover, Pause};
use memo_core::track::fit::{FitError, FitOptions, MirroredHeading, WalkFit};
use memo_core::track::start::Direction;
use memo_core::track::{EventKind, Row};
use memo_core::{
    ClothedScene, GaitParameter, GaitQuantity, Image, Side, TrackedWalk, Tracker, TrackerOptions,
};
use std::sync::LazyLock;

/// Above this probability of interchanged sides a walk claims nothing by side.
const OPEN: f64 = 0.2;

fn many(few: u64) -> u64 {
    if std::env::var_os("MEMO_FULL").is_some() { 8 * few } else { few }
}

fn scene(options: ClothedOptions) -> ClothedScene {
    ClothedScene::new(options).unwrap()
}

/// Tracks frames in the given order, shown at the scene's rate.
fn tracked(
    scene: &ClothedScene,
    frames: impl Iterator<Item = usize>,
    knows_camera: bool,
) -> Vec<TrackedWalk> {
    let camera = knows_camera.then(|| scene.camera.clone());
    let mut tracker =
        Tracker::new(TrackerOptions { camera, ..TrackerOptions::for_height(scene.height_m) }).unwrap();
    for (index, frame) in frames.enumerate() {
        tracker.update(&scene.frame(frame).as_frame(), scene.time_s(index)).unwrap();
    }
    tracker.finish().unwrap();
    tracker.take_finished()
}

/// Somebody who walked, and what was found of it.
struct Followed {
    seed: u64,
    scene: ClothedScene,
    walks: Vec<TrackedWalk>,
}

/// People with the camera given, drawn and tracked once for all tests.
static FOLLOWED: LazyLock<Vec<Followed>> = LazyLock::new(|| {
    let of = |seed| {
        let scene = scene(ClothedOptions { seed, ..ClothedOptions::default() });
        let walks = tracked(&scene, 0..scene.len(), true);
        Followed { seed, scene, walks }
    };
    (0..many(6)).map(of).collect()
});

/// Difference of two phases, -0.5 to 0.5.
fn phase_off(tracked: f64, truth: f64) -> f64 {
    let off = tracked - truth;
    off - off.round()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / count).sqrt()
}

impl Followed {
    fn rows(&self) -> Vec<Row> {
        self.walks[0].rows()
    }

    /// Errors of every row: along the path, across it, in height (metres) and in phase.
    fn errors(&self) -> Vec<[f64; 4]> {
        let of = |row: &Row| {
            let truth = self.scene.truth(row.frame).unwrap();
            let ahead = glam::DVec2::from_angle(truth.heading_rad);
            let off = row.torso_centre - truth.torso_centre;
            let level = off.truncate();
            [level.dot(ahead), level.dot(ahead.perp()), off.z, phase_off(row.phase, truth.phase)]
        };
        self.rows().iter().map(of).collect()
    }

    /// Errors of hip and knee of both sides, degrees.
    fn angle_errors(&self) -> [Vec<f64>; 2] {
        let mut errors = [Vec::new(), Vec::new()];
        for row in self.rows() {
            let truth = self.scene.truth(row.frame).unwrap();
            for (found, drawn) in [row.posture.right, row.posture.left].into_iter().zip(truth.angles) {
                errors[0].push((found.hip - drawn.hip).to_degrees());
                errors[1].push((found.knee - drawn.knee).to_degrees());
            }
        }
        errors
    }

    /// By how much each contact was found late, seconds; `None` for those that were not found within 0.15 s.
    fn late_s(&self) -> Vec<(FootContact, Option<f64>)> {
        let events = self.walks[0].events();
        let of = |contact: FootContact| {
            let late = events
                .iter()
                .filter(|event| event.kind == contact.kind && event.side == contact.side)
                .map(|event| event.time_s - contact.time_s)
                .min_by(|a, b| a.abs().total_cmp(&b.abs()));
            (contact, late.filter(|late| late.abs() < 0.15))
        };
        self.scene.contacts().into_iter().map(of).collect()
    }
}

#[test]
fn everybody_is_followed_and_the_sides_are_right() {
    let mut broken = 0;
    for person in FOLLOWED.iter() {
        let seed = person.seed;
        let frames: usize = person.walks.iter().map(|walk| walk.steps().len()).sum();
        assert!(frames >= 72, "seed {seed}: {frames} of {} frames", person.scene.len());
        broken += usize::from(person.walks.len() > 1);
        let walk = &person.walks[0];
        assert_eq!(walk.direction(), Direction::Forward, "seed {seed}");
        let phase = median(person.errors().iter().map(|e| e[3].abs()).collect());
        let swapped = phase > 0.25;
        println!(
            "seed {seed}: {} walks, phase {phase:.3}, p_swapped {:.3}",
            person.walks.len(),
            walk.p_swapped()
        );
        assert!(!swapped || walk.p_swapped() > OPEN, "seed {seed}: wrong sides, p {}", walk.p_swapped());
        assert!(swapped || phase < 0.06, "seed {seed}: phase off by {phase}");
    }
    let open = FOLLOWED.iter().filter(|person| person.walks[0].p_swapped() > OPEN).count();
    println!("{broken} of {} in two pieces, sides left open for {open}", FOLLOWED.len());
    assert!(20 * broken <= FOLLOWED.len(), "{broken} of {} in two pieces", FOLLOWED.len());
    assert!(5 * open <= FOLLOWED.len(), "{open} of {} sides left open", FOLLOWED.len());
}

#[test]
fn places_are_near_the_truth_and_their_deviations_neither_boast_nor_fear() {
    let errors: Vec<[f64; 4]> = FOLLOWED.iter().flat_map(Followed::errors).collect();
    let [along, across, height, phase] = [0, 1, 2, 3].map(|i| rms(errors.iter().map(|e| e[i])));
    println!("torso: along {along:.3} m, across {across:.3} m, height {height:.3} m; phase {phase:.3}");
    assert!(along < 0.05 && across < 0.15 && height < 0.04 && phase < 0.05);
    // Of each coordinate, the root mean square of error over standard deviation.
    let shares: Vec<[f64; 4]> = FOLLOWED
        .iter()
        .flat_map(|person| person.rows().into_iter().zip(person.errors()).collect::<Vec<_>>())
        .map(|(row, error)| {
            let [x, y, z, phase] = row.sd;
            // Most paths are nearly along x, none deviates by more than seven degrees.
            [error[0] / x, error[1] / y, error[2] / z, error[3] / phase]
        })
        .collect();
    let [along, across, height, phase] = [0, 1, 2, 3].map(|i| rms(shares.iter().map(|s| s[i])));
    println!(
        "in standard deviations: along {along:.2}, across {across:.2}, height {height:.2}, phase {phase:.2}"
    );
    for share in [along, across, height, phase] {
        assert!((0.3..3.0).contains(&share), "{share}");
    }
}

#[test]
fn hips_and_knees_are_as_near_as_the_average_gait_allows() {
    let [hip, knee] =
        [0, 1].map(|i| rms(FOLLOWED.iter().flat_map(|person| person.angle_errors()[i].clone())));
    println!("hip {hip:.1}, knee {knee:.1} degrees");
    assert!(hip < 5.0 && knee < 8.5, "{hip} {knee}");
}

#[test]
fn contacts_are_found_within_a_frame_or_two() {
    for (kind, most_s) in [(EventKind::HeelStrike, 0.035), (EventKind::ToeOff, 0.035)] {
        let sure = FOLLOWED.iter().filter(|person| person.walks[0].p_swapped() <= OPEN);
        let all: Vec<(FootContact, Option<f64>)> =
            sure.flat_map(Followed::late_s).filter(|(contact, _)| contact.kind == kind).collect();
        let late: Vec<f64> = all.iter().filter_map(|(_, late)| *late).collect();
        let mean = late.iter().sum::<f64>() / late.len() as f64;
        let spread = rms(late.iter().map(|late| late - mean));
        println!(
            "{}: {} of {}, {:+.0} ms, sd {:.0} ms",
            kind.name(),
            late.len(),
            all.len(),
            1e3 * mean,
            1e3 * spread
        );
        assert!(10 * late.len() >= 9 * all.len(), "{} of {}", late.len(), all.len());
        assert!(mean.abs() < most_s && spread < 0.035, "{kind:?}: {mean} +- {spread}");
    }
}

/// What is true of a parameter.
fn truth(scene: &ClothedScene, line: &GaitParameter) -> Option<f64> {
    let stride_s = 1.0 / scene.cycle_hz;
    let step = |side| scene.step(side);
    let ((right_m, right_s), (left_m, left_s)) = (step(Side::Right), step(Side::Left));
    let difference = |right: f64, left: f64| 200.0 * (right - left) / (right + left);
    let of_side = |side: Side| 100.0 * scene.stance[usize::from(side == Side::Left)];
    let both = 0.5 * (of_side(Side::Right) + of_side(Side::Left));
    let stance = line.side.map_or(both, of_side);
    Some(match line.quantity {
        GaitQuantity::Cadence => 120.0 * scene.cycle_hz,
        GaitQuantity::Speed => scene.speed_mps,
        GaitQuantity::StrideTime => stride_s,
        GaitQuantity::StrideLength => scene.speed_mps * stride_s,
        GaitQuantity::StepTime => line.side.map_or(0.5 * stride_s, |side| step(side).1),
        GaitQuantity::StepLength => line.side.map_or(0.5 * scene.speed_mps * stride_s, |side| step(side).0),
        GaitQuantity::StepTimeSymmetry => difference(right_s, left_s),
        GaitQuantity::StepLengthSymmetry => difference(right_m, left_m),
        GaitQuantity::Stance => stance,
        GaitQuantity::Swing => 100.0 - stance,
        GaitQuantity::DoubleSupport => 2.0 * stance - 100.0,
        GaitQuantity::SingleSupport => match line.side {
            Some(side) => 100.0 - of_side(side.other()),
            None => 200.0 - 2.0 * both,
        },
        GaitQuantity::HipRange | GaitQuantity::KneeRange | GaitQuantity::KneePeak => return None,
    })
}

#[test]
fn intervals_of_parameters_hold_most_of_the_time_and_are_not_endless() {
    let (mut held, mut all) = (0, 0);
    let mut half = Vec::new();
    for person in FOLLOWED.iter() {
        for line in person.walks[0].gait_parameters() {
            let (Some(truth), Some([low, high])) = (truth(&person.scene, &line), line.interval) else {
                continue;
            };
            all += 1;
            held += usize::from((low..=high).contains(&truth));
            if matches!(line.quantity, GaitQuantity::Speed | GaitQuantity::Cadence) {
                half.push(0.5 * (high - low) / truth);
            }
        }
    }
    let half = median(half);
    println!("{held} of {all} held; half widths of speed and cadence {:.1} %", 100.0 * half);
    assert!(all >= 11 * FOLLOWED.len() && 100 * held >= 85 * all, "{held} of {all}");
    assert!(half < 0.08, "{half}");
}

#[test]
fn without_a_camera_speed_and_cadence_are_nearly_as_good() {
    for seed in 0..many(1) {
        let scene = scene(ClothedOptions { seed, ..ClothedOptions::default() });
        let walk = &tracked(&scene, 0..scene.len(), false)[0];
        for line in walk.gait_parameters() {
            if matches!(line.quantity, GaitQuantity::Speed | GaitQuantity::Cadence) {
                let (value, truth) = (line.value.unwrap(), truth(&scene, &line).unwrap());
                assert!((value / truth - 1.0).abs() < 0.12, "seed {seed}: {line:?} of {truth}");
            }
        }
    }
}

#[test]
fn a_film_played_backwards_shows_somebody_walking_backwards() {
    for seed in 0..many(1) {
        let scene = scene(ClothedOptions { seed, ..ClothedOptions::default() });
        let walks = tracked(&scene, (0..scene.len()).rev(), true);
        let longest = walks.iter().max_by_key(|walk| walk.steps().len()).expect("somebody walks");
        assert_eq!(longest.direction(), Direction::Backward, "seed {seed}");
        assert!(longest.steps().len() >= 60 && longest.events().is_empty(), "seed {seed}");
    }
}

#[test]
fn what_is_carried_stands_or_rolls_is_no_walk() {
    let (mut shown, mut taken) = (0, Vec::new());
    for mover in [Mover::Rider, Mover::Waver, Mover::Trolley] {
        for seed in 0..many(1) {
            let scene = scene(ClothedOptions { seed, mover, frames: 50, ..ClothedOptions::default() });
            let walks = tracked(&scene, 0..scene.len(), true);
            shown += 1;
            taken.extend(walks.iter().map(|walk| (mover, seed, walk.steps().len())));
        }
    }
    println!("{} of {shown} taken for walks: {taken:?}", taken.len());
    assert!(40 * taken.len() <= shown, "{taken:?}");
}

/// Two people who cross, the second 0.9 m farther away.
fn crossing(seeds: [u64; 2]) -> (ClothedScene, [ClothedScene; 2]) {
    let one = |seed, leftward| {
        let (leftward, slant_rad) = (Some(leftward), Some(0.0));
        scene(ClothedOptions { seed, leftward, slant_rad, ..ClothedOptions::default() })
    };
    let [near, far] = [one(seeds[0], false), one(seeds[1], true)];
    (near.clone().joined_by(far.clone(), DVec2::new(0.0, BEHIND_M)), [near, far])
}

const BEHIND_M: f64 = 0.9;

#[test]
fn two_people_who_cross_are_followed_through_it_and_never_exchanged() {
    for seeds in [[3, 4], [5, 2]].into_iter().take(many(1) as usize) {
        let (both, each) = crossing(seeds);
        let options = TrackerOptions { camera: Some(both.camera.clone()), ..TrackerOptions::default() };
        let mut tracker = Tracker::new(options).unwrap();
        for frame in 0..both.len() {
            tracker.update(&both.frame(frame).as_frame(), both.time_s(frame)).unwrap();
        }
        tracker.finish().unwrap();
        let walks = tracker.take_finished();
        let people: Vec<usize> = walks.iter().map(|walk| walk.person).collect();
        assert_eq!(people.len(), 2, "{seeds:?}: {people:?}");
        assert_ne!(people[0], people[1], "{seeds:?}");
        for walk in &walks {
            let rows = walk.rows();
            let is_near = rows[0].heading_rad.cos() > 0.0;
            let (scene, shift_m) = if is_near { (&each[0], 0.0) } else { (&each[1], BEHIND_M) };
            assert!(rows.len() > 60, "{seeds:?}: {} frames", rows.len());
            let off = |row: &Row| {
                let truth = scene.truth(row.frame).unwrap();
                let off_m = row.torso_centre.truncate() - truth.torso_centre.truncate();
                [off_m.x, off_m.y - shift_m, phase_off(row.phase, truth.phase)]
            };
            let offs: Vec<[f64; 3]> = rows.iter().map(off).collect();
            let [along, across] = [0, 1].map(|k| rms(offs.iter().map(|off| off[k])));
            let phase = median(offs.iter().map(|off| off[2].abs()).collect());
            println!("{seeds:?} near {is_near}: along {along:.3}, across {across:.3} m, phase {phase:.3}");
            assert!(along < 0.08 && across < 0.25, "{seeds:?}: {along}, {across}");
            assert!(phase < 0.05 || walk.p_swapped() > OPEN, "{seeds:?}: {phase}, {}", walk.p_swapped());
        }
    }
}

/// Whoever was followed in a scene, and the number of frames of each walk.
fn followed(options: ClothedOptions) -> (Followed, Vec<usize>) {
    let (seed, scene) = (options.seed, scene(options));
    let walks = tracked(&scene, 0..scene.len(), true);
    let frames = walks.iter().map(|walk| walk.steps().len()).collect();
    (Followed { seed, scene, walks }, frames)
}

/// Somebody who stands still for three seconds in the middle of the picture.
#[test]
fn who_stops_and_goes_on_is_one_person_with_two_walks() {
    let (mut one, mut all) = (0, 0);
    for seed in 0..many(2) {
        let pause = Some(Pause { at_s: 2.6, lasts_s: 3.0 });
        let scene = scene(ClothedOptions { seed, frames: 200, pause, ..ClothedOptions::default() });
        let walks = tracked(&scene, 0..scene.len(), true);
        let people: Vec<usize> = walks.iter().map(|walk| walk.person).collect();
        let frames: Vec<[usize; 2]> = walks
            .iter()
            .map(|walk| [walk.rows()[0].frame, walk.rows()[walk.rows().len() - 1].frame])
            .collect();
        println!("seed {seed}: people {people:?}, frames {frames:?}");
        (one, all) = (one + usize::from(people == [0, 0]), all + 1);
        // Nobody is made up in the pause, and the walk is followed on both sides of it.
        assert!(frames[0][1] < 80 && frames[1..].iter().all(|frames| frames[0] > 135), "{frames:?}");
        for walk in &walks {
            let along = |row: &Row| {
                (row.torso_centre - scene.truth(row.frame).unwrap().torso_centre).truncate().length()
            };
            let off_m = rms(walk.rows().iter().map(along));
            assert!(off_m < 0.15, "seed {seed}: {off_m} m");
        }
    }
    assert!(10 * one >= 9 * all, "{one} of {all}");
}

/// Someone who turns is followed along a curve, with the heading of every frame.
#[test]
fn a_walk_that_turns_is_followed_round_its_curve() {
    for (seed, turn_rad) in [(8, -1.4), (3, 1.1)].into_iter().take(many(1) as usize) {
        let options = ClothedOptions {
            frames: 90,
            slant_rad: Some(-0.3 * turn_rad),
            leftward: Some(false),
            turn_rad,
            seed,
            ..ClothedOptions::default()
        };
        let (followed, frames) = followed(options);
        let off = |row: &Row| {
            let off = row.heading_rad - followed.scene.truth(row.frame).unwrap().heading_rad;
            off.sin().atan2(off.cos()).to_degrees().abs()
        };
        let mut heading_deg: Vec<f64> = followed.rows().iter().map(off).collect();
        heading_deg.sort_by(f64::total_cmp);
        let of = |share: f64| heading_deg[(share * (heading_deg.len() - 1) as f64) as usize];
        let errors = followed.errors();
        let along = rms(errors.iter().map(|e| e[0]));
        let phase = median(errors.iter().map(|e| e[3].abs()).collect());
        println!(
            "seed {seed}: {frames:?} frames, heading {:.1} {:.1}, along {along:.3}, {phase:.3}",
            of(0.5),
            of(0.95)
        );
        assert!(frames.len() == 1 && frames[0] >= 72, "seed {seed}: {frames:?}");
        assert!(!followed.walks[0].route().is_straight());
        assert!(of(0.5) < 8.0 && of(0.95) < 15.0, "seed {seed}: {}, {}", of(0.5), of(0.95));
        assert!(along < 0.1 && phase < 0.03, "seed {seed}: {along}, {phase}");
    }
}

/// Someone who walks on the spot is followed from the first frame to the last, with lengths and speed on the belt.
#[test]
fn a_walk_on_a_treadmill_is_recognised_and_has_its_belt_s_speed() {
    // Obliquely, and across the image.
    for (seed, slant_rad) in [(4, Some(0.35)), (1, None)].into_iter().take(many(1) as usize) {
        let options = ClothedOptions {
            frames: 55,
            slant_rad,
            mover: Mover::Treadmill,
            seed,
            ..ClothedOptions::default()
        };
        let scene = scene(options);
        let walks = tracked(&scene, 0..scene.len(), true);
        assert_eq!(walks.iter().map(|w| w.steps().len()).collect::<Vec<_>>(), [55], "seed {seed}");
        let treadmill = walks[0].treadmill().expect("on a treadmill");
        let [belt, sd] = [treadmill.belt.speed_mps, treadmill.belt.sd_mps];
        let turn = (walks[0].rows()[0].heading_rad - scene.heading_rad).to_degrees();
        let heading_deg = turn - 360.0 * (turn / 360.0).round();
        let followed = Followed { seed, scene, walks };
        let phase = median(followed.errors().iter().map(|e| e[3].abs()).collect());
        println!(
            "seed {seed}: belt {belt:.3} of {:.3}, heading off {heading_deg:.1}, phase {phase:.3}",
            followed.scene.speed_mps
        );
        assert!((belt / followed.scene.speed_mps - 1.0).abs() < 0.05 && (0.01..0.08).contains(&(sd / belt)));
        assert!(heading_deg.abs() < 10.0 && phase < 0.03, "seed {seed}: {heading_deg}, {phase}");
        // The phase says that the sides are right; they may be open.
        let (p_swapped, mirrored) = (followed.walks[0].p_swapped(), treadmill.mirrored);
        println!("P(left and right swapped) {p_swapped:.3}, {mirrored:?}");
        assert!(p_swapped < 0.5 && mirrored.is_none_or(|m| m.probability < OPEN));
        let apart = |other_rad: f64| (other_rad - followed.rows()[0].heading_rad).cos() < 0.99;
        assert!(
            mirrored.is_none_or(|m| apart(m.heading_rad)),
            "the other heading is another one: {mirrored:?}"
        );
        let table = followed.walks[0].gait_parameters();
        let of = |wanted| table.iter().find(|p| p.quantity == wanted && p.side.is_none()).unwrap();
        let [right_m, left_m] = [Side::Right, Side::Left].map(|side| followed.scene.step(side).0);
        for (quantity, truth) in [
            (GaitQuantity::Speed, followed.scene.speed_mps),
            (GaitQuantity::StepLength, 0.5 * (right_m + left_m)),
        ] {
            let [low, high] = of(quantity).interval.unwrap();
            assert!(
                low < truth && truth < high && high - low < 0.3 * truth,
                "{quantity:?}: {low}..{high}, {truth}"
            );
        }
        // The length of each step depends on the heading. While the heading is open, no value is given by side.
        for (probability, is_told) in [(0.19, true), (0.21, false)] {
            let mut walk = followed.walks[0].clone();
            let Some(Ok(fit)) = &mut walk.fit else { panic!("{:?}", walk.fit) };
            fit.mirrored = Some(MirroredHeading { heading_rad: 0.0, probability });
            fit.p_swapped = 0.0;
            for quantity in [GaitQuantity::StepTime, GaitQuantity::KneeRange] {
                let table = walk.gait_parameters();
                let mut sides = table.iter().filter(|p| p.quantity == quantity && p.side.is_some());
                assert!(sides.all(|p| p.value.is_some() == is_told), "{quantity:?} at {probability}");
            }
        }
    }
}

/// The same clip with the treadmill excluded holds no walk.
#[test]
fn a_treadmill_can_be_excluded() {
    let scene =
        scene(ClothedOptions { seed: 1, frames: 45, mover: Mover::Treadmill, ..ClothedOptions::default() });
    let options = TrackerOptions {
        camera: Some(scene.camera.clone()),
        treadmill: Some(false),
        fit: None,
        ..TrackerOptions::for_height(scene.height_m)
    };
    let mut tracker = Tracker::new(options).unwrap();
    for k in 0..scene.len() {
        tracker.update(&scene.frame(k).as_frame(), scene.time_s(k)).unwrap();
    }
    tracker.finish().unwrap();
    assert!(tracker.take_finished().iter().all(|walk| walk.treadmill().is_none()));
}

/// Someone who walks away from the camera is followed by the feet, and left and right stay open.
#[test]
fn a_walk_along_the_line_of_sight_is_followed_by_its_feet() {
    let seed = 3;
    let options = ClothedOptions {
        frames: 90,
        slant_rad: Some(1.48),
        leftward: Some(false),
        seed,
        ..ClothedOptions::default()
    };
    let (followed, frames) = followed(options);
    let errors = followed.errors();
    let along = rms(errors.iter().map(|e| e[0]));
    let wrapped = |e: f64| (2.0 * e - (2.0 * e).round()).abs() / 2.0;
    let phase = median(errors.iter().map(|e| wrapped(e[3])).collect());
    println!("seed {seed}: {frames:?} frames, along {along:.3}, phase {phase:.3}");
    assert!(frames.len() == 1 && frames[0] >= 72, "seed {seed}: {frames:?}");
    let walk = &followed.walks[0];
    assert!(walk.is_frontal && walk.p_swapped() == 0.5);
    assert!(matches!(walk.fit, Some(Err(FitError::Frontal))));
    // Shadows and shoes move all places: the stated deviation says so.
    let row = &followed.rows()[frames[0] / 2];
    let stated = row.sd[0].hypot(row.sd[1]);
    assert!(along < 0.3 && along < 2.0 * stated, "seed {seed}: {along}, stated {stated}");
    assert!(phase < 0.1 && row.sd[3] > 0.03, "seed {seed}: {phase}");
}

#[test]
fn a_walk_is_fitted_again_to_pictures_of_ones_own() {
    let one = &FOLLOWED[0];
    let walk = &one.walks[0];
    let options = FitOptions::default();
    let frames: Vec<_> = walk.rows().iter().map(|row| one.scene.frame(row.frame)).collect();
    let first = walk.fit.as_ref().unwrap().as_ref().unwrap();
    // 1. The same frames give the same person, and the stiffer the fit, the nearer to its curves.
    let again = walk.fit(&frames, None, &options).unwrap();
    let stiff = walk.fit(&frames, None, &FitOptions { frame_sd_rad: 1e-4, ..options }).unwrap();
    let knees = |fit: &WalkFit| fit.frames.iter().map(|f| f.posture.right.knee).collect::<Vec<_>>();
    let apart =
        |a: &WalkFit, b: &WalkFit| rms(knees(a).iter().zip(knees(b)).map(|(a, b)| a - b)).to_degrees();
    assert!(apart(first, &again) < 0.3, "{}", apart(first, &again));
    let off_curve = |fit: &WalkFit| {
        let curve = &fit.curves[1];
        let knee = |phase: f64| {
            let at = phase.rem_euclid(1.0) * curve.len() as f64;
            let [from, to] = [0, 1].map(|next| curve[(at as usize + next) % curve.len()]);
            from + at.fract() * (to - from)
        };
        rms(fit.frames.iter().map(|f| f.posture.right.knee - knee(f.phase))).to_degrees()
    };
    let loose = walk.fit(&frames, None, &FitOptions { frame_sd_rad: 0.3, ..options }).unwrap();
    let [stiff, usual, loose] = [&stiff, &again, &loose].map(off_curve);
    // Between the samples of the curve, straight lines are a tenth of a degree off.
    assert!(stiff < 0.12 && stiff < usual && loose > 3.0 * stiff, "{stiff} {usual} {loose}");
    // 2. What are no pictures of the walk is refused.
    let few = walk.fit(&frames[1..], None, &options);
    assert_eq!(few.unwrap_err(), FitError::Pictures { got: frames.len() - 1, wanted: frames.len() });
    let small = Image::filled(3, 2, 0);
    let wanted = [frames[0].width(), frames[0].height()];
    let empty = walk.fit(&frames, Some(&small), &options);
    assert_eq!(empty.unwrap_err(), FitError::PictureSize { got: [3, 2], wanted });
    let wrong = walk.fit(&frames, None, &FitOptions { height_sd: -1.0, ..options });
    assert!(matches!(wrong.unwrap_err(), FitError::Option(_)));
}
