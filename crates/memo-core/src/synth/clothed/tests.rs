use super::*;
use crate::model::{Gait, GaitStyle};

fn scene(options: ClothedOptions) -> ClothedScene {
    ClothedScene::new(options).unwrap()
}

fn of_seed(seed: u64) -> ClothedScene {
    scene(ClothedOptions { seed, ..ClothedOptions::default() })
}

/// A scene with small images, for tests that do not need large ones.
fn small(seed: u64, mover: Mover) -> ClothedScene {
    scene(ClothedOptions { seed, mover, size: [160, 120], noise_sd: Some(0.0), ..ClothedOptions::default() })
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let refused = |options| ClothedScene::new(options).unwrap_err().to_string();
    let base = ClothedOptions::default;
    assert!(refused(ClothedOptions { size: [0, 9], ..base() }).contains("0x9"));
    assert!(
        refused(ClothedOptions { rate_hz: f64::NAN, ..base() }).starts_with("rate_hz must be 1 to 10000")
    );
    assert!(refused(ClothedOptions { noise_sd: Some(-1.0), ..base() }).ends_with("got -1"));
    assert!(refused(ClothedOptions { slant_rad: Some(2.0), ..base() }).ends_with("got 2"));
    assert!(refused(ClothedOptions { turn_rad: 5.0, ..base() }).ends_with("got 5"));
    assert!(refused(ClothedOptions { late_left: Some(0.2), ..base() }).ends_with("got 0.2"));
    let pause = |at_s, lasts_s| Some(Pause { at_s, lasts_s });
    assert!(refused(ClothedOptions { pause: pause(0.7, 1.0), ..base() }).ends_with("got 0.7"));
    assert!(refused(ClothedOptions { pause: pause(2.0, -1.0), ..base() }).ends_with("got -1"));
}

#[test]
fn scenes_of_one_pixel_of_no_frames_and_beyond_the_last_frame_can_be_drawn() {
    for (size, frames) in [([1, 1], 80), ([2000, 3], 0), ([9, 9], 1)] {
        let scene = scene(ClothedOptions { size, frames, ..ClothedOptions::default() });
        assert!(scene.contacts().iter().all(|contact| contact.time_s >= 0.0));
        for frame in [0, 40, 10_000] {
            let drawn = scene.frame(frame);
            assert_eq!([drawn.width() as u32, drawn.height() as u32], size);
        }
    }
}

/// Over a pause the walk is the same, later: slower before and after, still within, at full speed elsewhere.
#[test]
fn in_a_pause_the_person_stands_and_then_walks_on() {
    let (at_s, lasts_s) = (2.0, 1.5);
    let pause = Some(Pause { at_s, lasts_s });
    let paused = scene(ClothedOptions { seed: 3, frames: 160, pause, ..ClothedOptions::default() });
    let place = |k: usize| paused.truth(k).unwrap().torso_centre.truncate();
    let speeds_mps: Vec<(f64, f64)> =
        (1..160).map(|k| (paused.time_s(k) - 0.02, 25.0 * place(k).distance(place(k - 1)))).collect();
    for (time_s, speed_mps) in &speeds_mps {
        let is_still = (at_s + 0.02..at_s + lasts_s - 0.02).contains(time_s);
        assert_eq!(*speed_mps < 1e-9, is_still, "{time_s}: {speed_mps}");
    }
    let mean = |from_s: f64, to_s: f64| {
        let there: Vec<f64> =
            speeds_mps.iter().filter(|(t, _)| (from_s..to_s).contains(t)).map(|(_, v)| *v).collect();
        there.iter().sum::<f64>() / there.len() as f64 / paused.speed_mps
    };
    let means = [mean(0.0, 1.2), mean(4.3, 6.4), mean(1.2, 2.0), mean(3.5, 4.3)];
    assert!((means[0] - 1.0).abs() < 0.1 && (means[1] - 1.0).abs() < 0.1, "{means:?}");
    assert!((means[2] - 0.5).abs() < 0.1 && (means[3] - 0.5).abs() < 0.1, "{means:?}");
    // The feet touch the floor when the person is at that place.
    let contacts = paused.contacts();
    assert!(contacts.len() >= 12 && contacts.iter().all(|contact| contact.time_s < 6.4));
    for contact in contacts.iter().filter(|contact| contact.kind == EventKind::HeelStrike) {
        let phase = paused.phase(paused.moved_s(contact.time_s));
        let own = if contact.side == Side::Right { phase } else { phase - 0.5 };
        assert!((own - own.round()).abs() < 1e-6, "{contact:?}: {phase}");
    }
}

#[test]
fn on_an_arc_the_body_turns_and_standing_feet_stay() {
    for (seed, turn_rad) in [(1, 1.0), (2, -2.0)] {
        let scene = scene(ClothedOptions { seed, turn_rad, ..ClothedOptions::default() });
        let truths: Vec<_> = (0..scene.len()).filter_map(|k| scene.truth(k)).collect();
        // The heading turns by the whole angle, and the body moves in it.
        let turned = truths[truths.len() - 1].heading_rad - truths[0].heading_rad;
        assert!((turned / turn_rad - 1.0).abs() < 0.1, "{turned} of {turn_rad}");
        let mut shares = Vec::new();
        for pair in truths.windows(2) {
            let moved = (pair[1].torso_centre - pair[0].torso_centre).truncate();
            let ahead = DVec2::from_angle(0.5 * (pair[0].heading_rad + pair[1].heading_rad));
            assert!(moved.dot(ahead) > 0.95 * moved.length(), "{moved} {ahead}");
            let stands =
                |side: fn(&ClothedTruth) -> DVec3| (side(&pair[1]) - side(&pair[0])).truncate().length();
            shares.push(stands(|t| t.right.ankle).min(stands(|t| t.left.ankle)) / moved.length());
        }
        // Of two feet, one hardly moves most of the time.
        shares.sort_by(f64::total_cmp);
        assert!(shares[shares.len() / 2] < 0.2, "{shares:?}");
        // Thighs are as long as on a straight path, to a share of the curvature.
        let straight = self::scene(ClothedOptions { seed, ..ClothedOptions::default() });
        let thigh = |scene: &ClothedScene| {
            let truth = scene.truth(20).unwrap();
            truth.right.hip.distance(truth.right.knee)
        };
        assert!((thigh(&scene) / thigh(&straight) - 1.0).abs() < 0.08);
    }
}

#[test]
fn on_a_treadmill_the_body_stays_and_standing_feet_move_with_the_belt() {
    for seed in 0..5 {
        let options = ClothedOptions { seed, mover: Mover::Treadmill, ..ClothedOptions::default() };
        let scene = scene(options);
        let ahead = DVec2::from_angle(scene.heading_rad).extend(0.0);
        let places: Vec<f64> =
            (0..scene.len()).map(|k| scene.truth(k).unwrap().torso_centre.dot(ahead)).collect();
        assert!(places.iter().all(|place| place.abs() < 0.15), "{seed}: {places:?}");
        // The heel between 0.15 and 0.3 of a cycle after its contact.
        for contact in scene.contacts().iter().filter(|c| c.kind == EventKind::HeelStrike) {
            let own = usize::from(contact.side == Side::Left);
            let heel =
                |share: f64| scene.figure(contact.time_s + share / scene.cycle_hz).feet[own][0].dot(ahead);
            let speed = (heel(0.15) - heel(0.3)) * scene.cycle_hz / 0.15;
            assert!((speed / scene.speed_mps - 1.0).abs() < 0.02, "{seed}: {speed}");
        }
    }
}

#[test]
fn a_seed_gives_the_same_pixels_in_any_order_and_seeds_differ() {
    let (a, b) = (small(0, Mover::Walker), small(0, Mover::Walker));
    let later = b.frame(20);
    assert_eq!(a.frame(5), b.frame(5));
    assert_eq!(a.frame(20), later);
    assert_ne!(a.frame(5), small(1, Mover::Walker).frame(5));
}

/// The rendered foot: heel, ball and toe minus their radii.
fn soles(scene: &ClothedScene, side: usize, cycles: f64) -> [DVec3; 3] {
    let radii = scene.sizes.foot_radii_m();
    let foot = scene.stride.figure(cycles).feet[side];
    std::array::from_fn(|part| foot[part] - DVec3::Z * radii[part])
}

#[test]
fn standing_feet_stand_on_the_floor_and_swinging_feet_clear_it() {
    for seed in 0..20 {
        let scene = of_seed(seed);
        for side in 0..2 {
            let (strike, leave) = (scene.stride.strikes[side], scene.stride.leaves[side]);
            let at = |share: f64| soles(&scene, side, strike + share * (leave - strike));
            // 1. Flat in mid-stance: the heel does not move.
            let (early, late) = (at(0.2)[0], at(0.4)[0]);
            assert!(
                (early - late).length() < 0.03,
                "seed {seed}: the heel moves by {}",
                (early - late).length()
            );
            // 2. Some point of the foot is always near the floor, and none is far below it.
            for k in 0..=20 {
                let low = at(0.05 * f64::from(k)).iter().map(|sole| sole.z).fold(f64::INFINITY, f64::min);
                assert!((-0.03..0.035).contains(&low), "seed {seed}: {low} m above the floor in stance");
            }
            // 3. It is lifted in mid-swing, and moves ahead by a stride in total.
            let swing = strike + 1.0 - 0.5 * (1.0 - (leave - strike));
            let low = soles(&scene, side, swing).iter().map(|sole| sole.z).fold(f64::INFINITY, f64::min);
            assert!(low > 0.004, "seed {seed}: {low} m above the floor in swing");
            let next = soles(&scene, side, strike + 1.0)[0] - soles(&scene, side, strike)[0];
            assert!((next - DVec3::X * scene.stride.length_m).length() < 1e-9);
        }
    }
}

#[test]
fn people_walk_as_people_do() {
    for seed in 0..20 {
        let scene = of_seed(seed);
        assert!((0.55..0.68).contains(&scene.stance[0]) && (0.55..0.68).contains(&scene.stance[1]));
        let relative = scene.stride.length_m / scene.height_m;
        assert!((0.55..0.95).contains(&relative), "seed {seed}: a stride of {relative} heights");
        // The trunk moves evenly and does not stop.
        let speeds = (1..scene.len()).map(|k| {
            let [a, b] = [k - 1, k].map(|k| scene.truth(k).unwrap().torso_centre);
            (b - a).length() * scene.options.rate_hz / scene.speed_mps
        });
        assert!(speeds.clone().all(|speed| (0.6..1.4).contains(&speed)), "seed {seed}");
        let ahead = DVec2::from_angle(scene.heading_rad);
        let [first, last] = [0, scene.len() - 1].map(|k| scene.truth(k).unwrap());
        let walked = (last.torso_centre - first.torso_centre).truncate().dot(ahead);
        let mean = walked / (last.time_s - first.time_s);
        assert!((mean / scene.speed_mps - 1.0).abs() < 0.05, "seed {seed}: {mean} m/s");
        // The steps of both sides add up to the stride.
        let (right, left) = (scene.step(Side::Right), scene.step(Side::Left));
        assert!((right.0 + left.0 - scene.stride.length_m).abs() < 1e-9);
        assert!((right.1 + left.1 - 1.0 / scene.cycle_hz).abs() < 1e-9);
    }
}

/// Root mean square deviation of hip and knee from the shipped average over both sides and all frames,
/// degrees.
fn deviation_deg(scene: &ClothedScene) -> [f64; 2] {
    let average = Gait::dense();
    let mut sums = [0.0; 2];
    for frame in 0..scene.len() {
        let truth = scene.truth(frame).unwrap();
        let posture = average.posture(truth.phase, &GaitStyle::default());
        for (drawn, average) in truth.angles.into_iter().zip([posture.right, posture.left]) {
            sums[0] += (drawn.hip - average.hip).to_degrees().powi(2);
            sums[1] += (drawn.knee - average.knee).to_degrees().powi(2);
        }
    }
    sums.map(|sum| (sum / (2 * scene.len()) as f64).sqrt())
}

#[test]
fn gaits_deviate_from_the_shipped_average_and_sides_from_each_other() {
    let mut all = [0.0; 2];
    for seed in 0..20 {
        let scene = of_seed(seed);
        let own = deviation_deg(&scene);
        all = [0, 1].map(|i| all[i] + own[i] * own[i] / 20.0);
        assert!(own[0] < 12.0 && own[1] < 16.0, "seed {seed}: {own:?} degrees");
        let apart = (scene.step(Side::Right).0 - scene.step(Side::Left).0).abs();
        assert!(apart > 1e-4 && apart < 0.15, "seed {seed}: steps differ by {apart} m");
    }
    let [hip, knee] = all.map(f64::sqrt);
    assert!((2.5..7.0).contains(&hip) && (5.0..10.0).contains(&knee), "{hip} {knee}");
}

#[test]
fn contacts_alternate_and_the_phase_passes_them() {
    for seed in 0..10 {
        let scene = of_seed(seed);
        let contacts = scene.contacts();
        let strikes: Vec<&FootContact> =
            contacts.iter().filter(|c| c.kind == EventKind::HeelStrike).collect();
        assert!(strikes.len() >= 4 && strikes.windows(2).all(|pair| pair[0].side != pair[1].side));
        for strike in strikes {
            let phase = scene.phase(strike.time_s);
            let off = phase - if strike.side == Side::Right { 0.0 } else { 0.5 };
            assert!((off - off.round()).abs() < 1e-6, "seed {seed}: {phase} at {strike:?}");
            let side = usize::from(strike.side == Side::Left);
            assert!((scene.figure(strike.time_s).feet[side][0] - strike.heel).length() < 1e-12);
        }
    }
}

#[test]
fn a_late_left_side_takes_longer_steps_in_time() {
    let later = |seed: u64, late_left: f64| {
        let scene = scene(ClothedOptions { seed, late_left: Some(late_left), ..ClothedOptions::default() });
        (scene.step(Side::Left).1 - scene.step(Side::Right).1) * scene.cycle_hz
    };
    for late_left in [-0.05, 0.05] {
        let mean = (0..10).map(|seed| later(seed, late_left)).sum::<f64>() / 10.0;
        assert!((mean - 2.0 * late_left).abs() < 0.03, "{mean} of a cycle");
    }
}

/// Pixels that differ from the empty room lie where the joints are projected.
#[test]
fn the_picture_shows_the_body_where_the_truth_has_it() {
    for mover in [Mover::Walker, Mover::Rider, Mover::Waver, Mover::Trolley] {
        let scene =
            scene(ClothedOptions { seed: 5, mover, noise_sd: Some(0.0), ..ClothedOptions::default() });
        let (frame, time_s) = (scene.frame(30), scene.time_s(30));
        let empty = super::super::scene::with_noise(scene.empty(), 0.0, Random::new(0));
        let differs = |x: i64, y: i64| {
            let (x, y) = (x.clamp(0, 639) as usize, y.clamp(0, 479) as usize);
            frame.at(x, y).abs_diff(empty.at(x, y)) > 3
        };
        let changed = frame.pixels().iter().zip(empty.pixels()).filter(|(a, b)| a.abs_diff(**b) > 3).count();
        assert!((2500..30_000).contains(&changed), "{mover:?}: {changed} pixels");
        if mover == Mover::Trolley {
            continue;
        }
        for joints in scene.figure(time_s).joints {
            for joint in joints.to_array() {
                let pixel = scene.camera.project(joint).unwrap().round();
                let near =
                    (-3..=3).any(|dy| (-3..=3).any(|dx| differs(pixel.x as i64 + dx, pixel.y as i64 + dy)));
                assert!(near, "{mover:?}: nothing is drawn at {pixel}");
            }
        }
    }
}

#[test]
fn a_rider_keeps_the_posture_and_a_waver_the_place() {
    let rider = small(2, Mover::Rider);
    let [early, late] = [0.4, 2.0].map(|time_s| rider.figure(time_s));
    let carried = late.neck - early.neck;
    assert!((carried.length() / (1.6 * rider.speed_mps) - 1.0).abs() < 0.05);
    assert!((late.joints[0].ankle - early.joints[0].ankle - carried).length() < 1e-9);
    let waver = small(2, Mover::Waver);
    let [early, late] = [0.4, 0.6].map(|time_s| waver.figure(time_s));
    assert_eq!(early.feet, late.feet);
    assert!((early.joints[0].wrist - late.joints[0].wrist).length() > 0.1);
    assert!(waver.truth(3).is_none() && rider.contacts().is_empty());
}

/// The extent of solids along a direction, metres.
fn reach(solids: &[Solid], direction: DVec3) -> [f64; 2] {
    let spheres = solids.iter().flat_map(|solid| solid.shape.ends.into_iter().zip(solid.shape.radii));
    spheres.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (centre, radius)| {
        let at = centre.dot(direction);
        [low.min(at - radius), high.max(at + radius)]
    })
}

/// Sizes divided by body height, compared with 4082 men of 1756 mm in the second survey of the US Army
/// (Gordon and others, NATICK/TR-15/007, 2014); clothes are up to 14 mm thick on either side, and people
/// differ by 6 %.
#[test]
fn the_drawn_body_has_the_sizes_of_people() {
    for seed in 0..8 {
        let scene = small(seed, Mover::Waver);
        let figure = scene.figure(0.5);
        let solids = person::solids(&figure, &scene.sizes, &scene.clothes);
        let (ahead, left) = (figure.forward, DVec3::Z.cross(figure.forward));
        let (trunk, limbs) = solids.split_at(9);
        let (head, legs) = ([trunk[0], trunk[1], trunk[2]], [&limbs[3..8], &limbs[11..16]].concat());
        let clothes = [trunk[4], trunk[5], trunk[6], trunk[7], trunk[8]];
        let is = |what: &str, solids: &[Solid], direction: DVec3, mm: f64, share: f64| {
            let [low, high] = reach(solids, direction);
            let found = 1756.0 * (high - low) / scene.height_m;
            assert!((found / mm - 1.0).abs() < share, "seed {seed}: {what} of {found} instead of {mm} mm");
        };
        is("height", &solids, DVec3::Z, 1756.0, 0.03);
        is("head's length", &head, ahead, 199.0, 0.2);
        is("head's breadth", &head, left, 154.0, 0.3);
        // 0.130 of the height (Drillis and Contini 1966).
        is("head's height", &head, DVec3::Z, 0.130 * 1756.0, 0.2);
        is("depth of trunk", &clothes, ahead, 254.0, 0.25);
        is("breadth of shoulders", &clothes, left, 416.0, 0.25);
        is("shoulders to crotch", &clothes, DVec3::Z, 593.0, 0.25);
        is("breadth of legs", &legs, left, 346.0, 0.2);
        // The chin is below and in front of the centre of the head, the hair above and behind it.
        let [skull, chin, hair] = [head[0], head[1], head[2]].map(|solid| solid.shape.ends[1]);
        let of = |point: DVec3| [(point - skull).dot(ahead), (point - skull).dot(DVec3::Z)];
        assert!(of(chin)[0] > 0.01 && of(chin)[1] < -0.05, "{:?}", of(chin));
        assert!(of(hair)[0] < -0.01 && of(hair)[1] > 0.0, "{:?}", of(hair));
        let shoulders = figure.joints[0].shoulder.midpoint(figure.joints[1].shoulder);
        let above =
            [figure.neck, figure.head].map(|point| (point - shoulders).dot(DVec3::Z) / scene.height_m);
        assert!(0.02 < above[0] && above[0] + 0.03 < above[1] && above[1] < 0.14, "{above:?}");
        // The seat is behind the hips; toes are in front of heels.
        let hips = figure.joints[0].hip.midpoint(figure.joints[1].hip);
        assert!((trunk[6].shape.ends[0] - hips).dot(ahead) < -0.02);
        for [heel, _, toe] in figure.feet {
            let foot = toe - heel;
            assert!(
                foot.dot(ahead) > 0.0 && (0.1..0.15).contains(&(foot.length() / scene.height_m)),
                "{foot}"
            );
        }
    }
}
