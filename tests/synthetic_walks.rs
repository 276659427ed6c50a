//! The whole tracker on walkers drawn from its own model, noise of 5 grey levels, both directions: what the method
//! reaches where the model is right. People who differ from it are in `clothed_walks`.

use glam::{DVec2, DVec3};
use memo_core::synth::SceneOptions;
use memo_core::track::left_out::Reason;
use memo_core::track::start::Direction;
use memo_core::track::{EventKind, GaitChoice};
use memo_core::{Side, SynthScene, TrackError, TrackedWalk, Tracker, TrackerOptions};
use std::sync::LazyLock;

fn options_for(scene: &SynthScene) -> TrackerOptions {
    TrackerOptions {
        camera: Some(scene.camera.clone()),
        ..TrackerOptions::for_height(scene.walker.body.height_m)
    }
}

/// Tracks the given frames of a scene in the given order, shown at the scene's rate.
fn tracked_with(
    scene: &SynthScene,
    frames: impl Iterator<Item = usize>,
    options: TrackerOptions,
) -> Vec<TrackedWalk> {
    let mut tracker = Tracker::new(options).unwrap();
    for (index, frame) in frames.enumerate() {
        tracker.update(&scene.frame(frame).as_frame(), scene.time_s(index)).unwrap();
    }
    tracker.finish().unwrap();
    tracker.take_finished()
}

fn tracked(scene: &SynthScene) -> Vec<TrackedWalk> {
    tracked_with(scene, 0..scene.len(), options_for(scene))
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

/// Walkers to the left and to the right, drawn and tracked once for all tests. Their upper arms are shorter than the model's by what
/// people's are between the centres of joints (de Leva, J Biomech 29:1223, 1996): the fit expects that, and would seek the shoulders
/// three centimetres too low.
static FOLLOWED: LazyLock<Vec<(SynthScene, Vec<TrackedWalk>)>> = LazyLock::new(|| {
    let of = |seed| {
        let options = SceneOptions { seed, leftward: Some(seed % 2 == 0), ..SceneOptions::default() };
        let mut scene = SynthScene::new(options).unwrap();
        scene.walker.body.proportions.upper_arm -= 0.02;
        let walks = tracked(&scene);
        (scene, walks)
    };
    (0..if is_full() { 20 } else { 2 }).map(of).collect()
});

fn is_full() -> bool {
    std::env::var_os("MEMO_FULL").is_some()
}

#[test]
fn the_model_itself_is_tracked_to_two_centimetres_in_both_directions() {
    let mut worst = [0.0f64; 3];
    let mut all = [0.0f64; 3];
    for (seed, (scene, walks)) in FOLLOWED.iter().enumerate() {
        assert_eq!(walks.len(), 1, "seed {seed}: {} walks", walks.len());
        let walk = &walks[0];
        assert_eq!(walk.direction(), Direction::Forward, "seed {seed}");
        assert!(walk.rows().len() >= 70, "seed {seed}: {} rows", walk.rows().len());
        assert!(walk.p_swapped() < 0.2, "seed {seed}: p_swapped {}", walk.p_swapped());
        let errors = errors(scene, walk);
        println!("seed {seed}: along {:.4} m, height {:.4} m, phase {:.4}", errors[0], errors[1], errors[2]);
        assert!(errors[2] < 0.1, "seed {seed}: half a cycle off? {errors:?}");
        for i in 0..3 {
            worst[i] = worst[i].max(errors[i]);
            all[i] += errors[i] * errors[i] / FOLLOWED.len() as f64;
        }
    }
    let rms = all.map(f64::sqrt);
    println!(
        "over all seeds: along {:.4} m, height {:.4} m, phase {:.4}; worst {worst:.4?}",
        rms[0], rms[1], rms[2]
    );
    // The fit expects people, whose joints lie a centimetre or two elsewhere than the model's own.
    assert!(rms[0] <= 0.02 && rms[1] <= 0.02 && rms[2] <= 0.01, "{rms:?}");
}

#[test]
fn the_angles_of_the_average_and_of_a_planted_deviation_are_measured() {
    let mut scene = SynthScene::new(SceneOptions { seed: 5, ..SceneOptions::default() }).unwrap();
    scene.walker.style.hip_offset = f64::to_radians(-10.0);
    scene.walker.style.knee_offset = f64::to_radians(-8.0);
    let planted = (scene.clone(), tracked(&scene));
    for (scene, walks) in FOLLOWED.iter().chain([&planted]) {
        let fit = walks[0].fitted().expect("80 frames suffice for a fit");
        assert!(fit.quality.missed < 0.1, "{:?}", fit.quality);
        let rms = angle_errors(scene, &walks[0]);
        assert!(rms[0] < 2.0 && rms[1] < 3.0, "{rms:?} degrees off");
    }
}

/// Root mean squares over all rows of hip and knee against the angles between the joints drawn, degrees.
fn angle_errors(scene: &SynthScene, walk: &TrackedWalk) -> [f64; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for row in walk.rows() {
        let truth = scene.truth(row.frame).expect("the walker is there").posed;
        for (joints, angles) in [(truth.right, row.posture.right), (truth.left, row.posture.left)] {
            let ahead = DVec2::from_angle(row.heading_rad).extend(0.0);
            let elevation = |from: DVec3, to: DVec3| (to - from).dot(ahead).atan2(from.z - to.z);
            let (thigh, shank) = (elevation(joints.hip, joints.knee), elevation(joints.knee, joints.ankle));
            errors[0].push((angles.hip - thigh).to_degrees());
            errors[1].push((angles.knee - (thigh - shank)).to_degrees());
        }
    }
    errors.map(|e| (e.iter().map(|x| x * x).sum::<f64>() / e.len() as f64).sqrt())
}

#[test]
fn heel_strikes_fall_where_the_true_phase_passes() {
    for (scene, walks) in FOLLOWED.iter() {
        let is_strike = |kind: EventKind| kind == EventKind::HeelStrike;
        let strikes: Vec<_> = walks[0].events().into_iter().filter(|event| is_strike(event.kind)).collect();
        assert!(strikes.len() >= 3, "{strikes:?}");
        for strike in &strikes {
            let phase = scene.truth(strike.frame.round() as usize).unwrap().hypothesis.phase;
            let mark = if strike.side == Side::Right { 0.0 } else { 0.5 };
            let off = phase - mark - (phase - mark).round();
            assert!(off.abs() < 0.04, "{strike:?}: true phase {phase}");
        }
        assert!(strikes.windows(2).all(|pair| pair[0].side != pair[1].side), "sides alternate");
    }
}

#[test]
fn a_path_20_degrees_off_the_image_plane_is_found() {
    let mut scene =
        SynthScene::new(SceneOptions { seed: 2, leftward: Some(false), ..SceneOptions::default() }).unwrap();
    scene.path.heading_rad = 20f64.to_radians();
    let walk = &tracked(&scene)[0];
    let off = walk.rows()[30].heading_rad - scene.path.heading_rad;
    assert!(off.abs() < 5f64.to_radians(), "heading off by {} degrees", off.to_degrees());
    assert!(errors(&scene, walk)[2] < 0.03);
}

/// At 100 frames per second hardly anything moves from frame to frame, and a dozen frames show a tenth of a step.
#[test]
fn a_walk_is_tracked_as_well_at_a_high_frame_rate() {
    let of_rate = |rate_hz: f64| {
        let [frames, empty_frames] = [65.0, 4.0].map(|count| (count * rate_hz / 25.0) as usize);
        let leftward = Some(false);
        let options =
            SceneOptions { seed: 4, rate_hz, frames, empty_frames, leftward, ..SceneOptions::default() };
        let mut scene = SynthScene::new(options).unwrap();
        scene.path.heading_rad = -20f64.to_radians();
        let walks = tracked(&scene);
        assert_eq!(walks.len(), 1, "{rate_hz}");
        let shown = (0..scene.len()).filter(|k| scene.truth(*k).is_some()).count();
        let rows = walks[0].rows().len();
        assert!(rows as f64 > 0.95 * shown as f64, "{rate_hz}: {rows} of {shown} rows");
        errors(&scene, &walks[0])
    };
    let [usual, fast] = [25.0, 100.0].map(of_rate);
    assert!((0..3).all(|k| fast[k] < usual[k] + 0.01), "{fast:?} instead of {usual:?}");
}

#[test]
fn ten_samples_and_velocity_weights_track_as_well() {
    // Without the fit, which has curves of its own.
    let scene = SynthScene::new(SceneOptions { seed: 1, ..SceneOptions::default() }).unwrap();
    let options = TrackerOptions { gait: GaitChoice::Sampled10, fit: None, ..options_for(&scene) };
    let walks = tracked_with(&scene, 0..scene.len(), options);
    assert!(errors(&scene, &walks[0])[2] < 0.06);
    let mut options = TrackerOptions { fit: None, ..options_for(&scene) };
    options.evidence.flow = Some(memo_core::image::FlowOptions::default());
    options.walk.similarity.full_velocity = Some(2.0);
    let walks = tracked_with(&scene, 0..scene.len(), options);
    assert!(errors(&scene, &walks[0])[2] < 0.02);
}

#[test]
fn an_empty_scene_has_nobody_and_misuse_is_refused() {
    let scene =
        SynthScene::new(SceneOptions { frames: 20, empty_frames: 20, ..SceneOptions::default() }).unwrap();
    assert!(tracked(&scene).is_empty());
    let mut tracker = Tracker::new(options_for(&scene)).unwrap();
    let frame = scene.frame(0);
    tracker.update(&frame.as_frame(), 0.0).unwrap();
    assert!(
        matches!(tracker.update(&frame.as_frame(), 0.0), Err(TrackError::Evidence(_))),
        "times must increase"
    );
    let small = memo_core::Image::filled(32, 32, 0u8);
    assert!(matches!(tracker.update(&small.as_frame(), 1.0), Err(TrackError::CameraSize { .. })));
    tracker.finish().unwrap();
    assert!(matches!(tracker.update(&frame.as_frame(), 2.0), Err(TrackError::Finished)));
    let narrow = TrackerOptions { field_of_view_rad: Some(f64::NAN), ..options_for(&scene) };
    assert!(matches!(Tracker::new(narrow), Err(TrackError::Option { .. })));
    assert!(Tracker::new(TrackerOptions::for_height(0.0)).is_err());
}

#[test]
fn a_high_camera_does_not_make_a_straight_path_slant() {
    for seed in [2, 9, 14].into_iter().take(if is_full() { 3 } else { 1 }) {
        let mut scene = SynthScene::new(SceneOptions { seed, ..SceneOptions::default() }).unwrap();
        scene.camera = memo_core::Camera::level([640, 480], 0.9, 2.0, 7.0).unwrap();
        let walk = &tracked(&scene)[0];
        let off = walk.rows()[30].heading_rad - scene.path.heading_rad;
        assert!(off.sin().abs() < 0.01, "seed {seed}: heading off by {off}");
        assert!(errors(&scene, walk)[2] < 0.02, "seed {seed}");
    }
}

#[test]
fn a_sliding_box_is_not_a_walker_and_cut_off_feet_are_not_fully_visible() {
    let scene = SynthScene::new(SceneOptions { seed: 2, ..SceneOptions::default() }).unwrap();
    let mut slid = Tracker::new(options_for(&scene)).unwrap();
    let mut cropped = Tracker::new(TrackerOptions::for_height(scene.walker.body.height_m)).unwrap();
    for k in 0..50 {
        let mut frame = scene.frame(k % 4);
        for y in 180..380 {
            // Of a plain box only the sides would change.
            let across = frame.row_mut(y)[60 + 5 * k..130 + 5 * k].iter_mut();
            across.enumerate().for_each(|(x, pixel)| *pixel = 40 + (x * 37 % 90) as u8);
        }
        slid.update(&frame.as_frame(), scene.time_s(k)).unwrap();

        let walked = scene.frame(k);
        let sole = scene
            .truth(scene.len() - 1)
            .map_or(0.0, |t| scene.camera.project(t.posed.right.ankle).unwrap().y);
        let rows = sole as usize - 20;
        let view = memo_core::Frame::new(walked.pixels(), 640, rows, 640).unwrap();
        cropped.update(&view, scene.time_s(k)).unwrap();
    }
    for tracker in [&mut slid, &mut cropped] {
        tracker.finish().unwrap();
        assert!(tracker.take_finished().is_empty());
        assert!(tracker.seek_report().refused_starts > 0);
    }
    let reasons = |tracker: &Tracker| tracker.left_out().iter().map(|left| left.reason).collect::<Vec<_>>();
    assert_eq!(reasons(&slid), [Reason::NotWalking]);
    let slid = slid.left_out().remove(0);
    assert!(slid.first().frame <= 2 && slid.last().frame >= 47, "{slid:?}");
    for shot in &slid.shots {
        let middle = (shot.rectangle.left + shot.rectangle.right) / 2;
        let own = 60 + 5 * shot.frame..130 + 5 * shot.frame;
        assert!(own.contains(&middle), "{shot:?}");
    }
    assert_eq!(reasons(&cropped), [Reason::CutOff]);
}
