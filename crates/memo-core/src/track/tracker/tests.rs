//! Decisions of the tracker, on moving boxes and on walks put into it; no frame is drawn.

use super::super::active::tests::active;
use super::super::candidate::tests::{seen_along, seen_walking};
use super::super::crowd::{body_box, clear_explained};
use super::super::frontal::tests::{MIDDLE, SPEED_MPS, feet_of_steps, standing, towards};
use super::super::height::BodyHeight;
use super::super::people::Sign;
use super::super::search::tests::{camera, rectangle_of, walker};
use super::super::search::{Hypothesis, Path, Scene};
use super::super::start::Direction;
use super::super::start::tests::report;
use super::super::walk::tests::step_in;
use super::super::walk::{Beginning, State, Step};
use super::*;
use crate::calibrate::tilt_of_lines;
use crate::estimate::kalman::ConstantVelocity;
use crate::image::flow::FlowOptions;
use crate::image::{BackgroundOptions, CleanOptions, Image};
use crate::model::body::PART_COUNT;
use crate::track::fit::FitOptions;
use crate::track::steady::LossReason;
use glam::DVec2;

const SIZE: [usize; 2] = [640, 480];

fn options() -> TrackerOptions {
    TrackerOptions { camera: Some(camera()), fit: None, ..TrackerOptions::for_height(1.75) }
}

fn tracker() -> Tracker {
    Tracker::new(options()).unwrap()
}

/// An upright box with its lower left corner at this position.
fn boxed(left: usize, bottom: usize, width: usize, height: usize) -> Rectangle {
    Rectangle { left, top: bottom + 1 - height, right: left + width - 1, bottom }
}

/// Evidence of a frame without edges in which these boxes move.
fn evidence(frame: usize, boxes: &[Rectangle]) -> Evidence {
    let mut mask = Image::filled(SIZE[0], SIZE[1], false);
    for r in boxes {
        (r.top..=r.bottom).for_each(|y| mask.row_mut(y)[r.left..=r.right].fill(true));
    }
    Evidence {
        frame,
        time_s: 0.04 * frame as f64,
        grey: Image::filled(SIZE[0], SIZE[1], 100),
        firm_mask: mask.clone(),
        mask,
        velocity: None,
        unseen: None,
    }
}

/// A box that could be a person of 200 px.
fn person(left: usize) -> Rectangle {
    boxed(left, 399, 80, 200)
}

/// The contours of the latest 13 frames show nobody who walks; those of 40 do, obliquely.
#[test]
fn who_is_refused_on_13_frames_starts_on_40() {
    let path = Path { heading_rad: 0.8, origin: DVec2::ZERO };
    let mut seen = seen_along(&path, &walker(), 1.2, 40, 0.04);
    seen[27..].iter_mut().for_each(|seen| seen.edges.edges.clear());
    for (first, count) in [(1, 0), (0, 1)] {
        let mut tracker = tracker();
        let seen = seen[first..].to_vec();
        tracker.candidates = vec![Candidate { seen, refusals: 1, ..Candidate::default() }];
        tracker.start(&evidence(39, &[]));
        assert_eq!(tracker.people.len(), count);
        for active in &tracker.people {
            let off_rad = active.start.path.heading_rad - path.heading_rad;
            assert!(off_rad.abs() < 0.15 && active.kept.len() == 40, "{off_rad}");
        }
    }
}

/// The number of sightings kept after frames with a person (true) and without.
fn kept_after(frames: &[bool]) -> usize {
    let mut tracker = tracker();
    for (k, is_there) in frames.iter().enumerate() {
        let boxes: &[Rectangle] = if *is_there { &[person(100 + k)] } else { &[] };
        tracker.advance(&evidence(k, boxes)).unwrap();
    }
    tracker.candidates.first().map_or(0, |candidate| candidate.seen.len())
}

#[test]
fn a_candidate_may_be_missed_in_three_frames_in_a_row_and_no_more() {
    let (x, o) = (true, false);
    assert_eq!(kept_after(&[x, x, x, x]), 4);
    assert_eq!(kept_after(&[x, x, o, o, o, x]), 3);
    assert_eq!(kept_after(&[x, x, o, o, o, o, x]), 1);
    assert_eq!(kept_after(&[x, o, o, o, x, o, o, o, x]), 3, "counted anew after each sighting");
}

#[test]
fn another_person_s_rectangle_begins_anew() {
    let kept = |second: Rectangle| {
        let mut tracker = tracker();
        for (k, rectangle) in [person(100), second].into_iter().enumerate() {
            tracker.advance(&evidence(k, &[rectangle])).unwrap();
        }
        tracker.candidates.iter().map(|c| c.seen.len()).max().unwrap_or(0)
    };
    assert_eq!(kept(person(179)), 2, "they overlap");
    assert_eq!(kept(person(300)), 1, "somewhere else");
    assert_eq!(kept(boxed(100, 399, 50, 100)), 1, "half as high");
}

#[test]
fn sides_and_top_cut_a_person_off_and_the_bottom_does_not() {
    let inside = Rectangle { left: 2, top: 2, right: 637, bottom: 479 };
    assert!(!touches_border(&inside, 640));
    for cut in
        [Rectangle { left: 1, ..inside }, Rectangle { top: 1, ..inside }, Rectangle { right: 638, ..inside }]
    {
        assert!(touches_border(&cut, 640), "{cut:?}");
    }
}

#[test]
fn a_grown_rectangle_stays_inside_the_picture() {
    let evidence = evidence(0, &[]);
    let r = Rectangle { left: 30, top: 40, right: 300, bottom: 400 };
    assert_eq!(grown(&r, &evidence, 16.0), Rectangle { left: 14, top: 24, right: 316, bottom: 416 });
    let r = Rectangle { left: 3, top: 4, right: 630, bottom: 475 };
    assert_eq!(grown(&r, &evidence, 16.0), Rectangle { left: 0, top: 0, right: 639, bottom: 479 });
}

/// A change of the options, and the name of the one that it makes senseless.
type Wrong = (fn(&mut TrackerOptions), &'static str);

/// A change to each option that makes it senseless, and the option's name.
fn every_wrong_option() -> Vec<Wrong> {
    vec![
        (|o| o.walk.similarity.c_l = 0.0, "c_l"),
        (|o| o.walk.similarity.c_d = -1.0, "c_d"),
        (|o| o.walk.similarity.c_r = f32::NAN, "c_r"),
        (|o| o.walk.similarity.sigma_phi_rad = f32::INFINITY, "sigma_phi_rad"),
        (|o| o.walk.similarity.full_gradient = Some(0.0), "full_gradient"),
        (|o| o.walk.similarity.full_velocity = Some(f32::NAN), "full_velocity"),
        (|o| o.walk.similarity.part_weights[3] = -0.1, "part_weights"),
        (|o| o.walk.similarity.part_weights = [0.0; PART_COUNT], "part_weights"),
        (|o| o.walk.filter.along.measurement_variance = 0.0, "measurement_variance"),
        (|o| o.walk.filter.phase.velocity_variance_per_s = f64::NAN, "velocity_variance_per_s"),
        (|o| o.walk.swap.margin = -0.1, "margin"),
        (|o| o.walk.swap.glimpse_sd = 0.0, "glimpse_sd"),
        (|o| o.walk.swap.person_sd = f64::NAN, "person_sd"),
        (|o| o.walk.swap.glimpse_s = 0.0, "glimpse_s"),
        (|o| o.cadence.low_hz = 0.0, "low_hz"),
        (|o| o.cadence.high_hz = 0.1, "high_hz"),
        (|o| o.fit = Some(FitOptions { longest: 3, ..Default::default() }), "frames of the longest fit"),
        (|o| o.fit = Some(FitOptions { frame_sd_rad: 0.0, ..Default::default() }), "frame_sd_rad"),
        (|o| o.fit = Some(FitOptions { height_sd: f64::NAN, ..Default::default() }), "height_sd"),
        (|o| o.evidence.change.threshold = Some(f64::NAN), "threshold"),
        (|o| o.evidence.change.false_rate = 1.0, "false_rate"),
        (|o| o.evidence.change.min_threshold = -1.0, "min_threshold"),
        (|o| o.evidence.rectangle_threshold = f64::INFINITY, "rectangle_threshold"),
        (|o| o.evidence.clean = CleanOptions { few: 5, many: 5 }, "few"),
        (|o| o.evidence.background = Some(BackgroundOptions { rate: 0.0, ..Default::default() }), "rate"),
        (|o| o.evidence.flow = Some(FlowOptions { levels: 0, ..Default::default() }), "levels"),
        (|o| o.evidence.group.gap_x = -0.1, "gap_x"),
        (|o| o.evidence.group.max_aspect = 0.0, "max_aspect"),
        (|o| o.evidence.edge.sigma_px = 0.1, "sigma_px"),
        (|o| o.evidence.edge.high = 1.0, "high"),
        (|o| o.evidence.line.max_deviation_px = 0.0, "max_deviation_px"),
        (|o| o.evidence.line.min_length_px = f64::NAN, "min_length_px"),
    ]
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut TrackerOptions)| {
        let mut options = options();
        change(&mut options);
        match Tracker::new(options) {
            Err(TrackError::Option(error)) => Some(error.name),
            _ => None,
        }
    };
    assert_eq!(refused(|o| o.start_frames = 4), Some("start_frames"));
    assert_eq!(refused(|o| o.start_frames = 101), Some("start_frames"));
    assert_eq!(refused(|o| o.path_frames = 14), Some("path_frames"));
    assert_eq!(refused(|o| o.path_frames = 1001), Some("path_frames"));
    assert_eq!(refused(|o| o.field_of_view_rad = Some(4f64.to_radians())), Some("field of view"));
    assert_eq!(refused(|o| o.field_of_view_rad = Some(171f64.to_radians())), Some("field of view"));
    assert_eq!(refused(|o| (o.start_frames, o.field_of_view_rad) = (5, Some(0.1))), None);
    for (change, name) in every_wrong_option() {
        assert_eq!(refused(change), Some(name));
    }
    assert_eq!(refused(|o| o.start_frames = 100), None);
}

/// At 100 frames per second three times as many frames last as long as at 30.
#[test]
fn numbers_of_frames_are_those_of_the_frame_rate() {
    for (every_s, start_frames, path_frames) in [(0.04, 13, 40), (0.01, 43, 133)] {
        let given = TrackerOptions { start_frames: 13, path_frames: 40, ..options() };
        let mut tracker = Tracker::new(given.clone()).unwrap();
        let frame = Image::filled(SIZE[0], SIZE[1], 100u8);
        for k in 0..20 {
            tracker.update(&frame.as_frame(), every_s * f64::from(k)).unwrap();
        }
        assert_eq!((tracker.options.start_frames, tracker.options.path_frames), (start_frames, path_frames));
        assert_eq!(tracker.seek_report().start_frames, start_frames);
        assert_eq!(tracker.options(), &given);
    }
}

/// However many frames wait for a later one, each has its own boxes, and none stay.
#[test]
fn boxes_are_those_of_their_frames_at_any_frame_rate() {
    for (every_s, waiting) in [(0.04, 1), (0.01, 3), (0.0001, 16)] {
        let mut tracker = tracker();
        let frame = Image::filled(SIZE[0], SIZE[1], 100u8);
        for k in 0..40 {
            let boxes = [boxed(300, 400, 60, 180)];
            tracker.update_with_boxes(&frame.as_frame(), every_s * f64::from(k), &boxes).unwrap();
        }
        // Nothing changes, so only a box can be a candidate.
        assert_eq!(tracker.seek_report().frames_with_candidate, 40 - waiting, "{every_s}");
        assert!(tracker.boxes.len() <= MOST_WAITING + 1);
    }
}

#[test]
fn frames_of_another_size_than_the_camera_s_are_refused() {
    let small = Image::filled(320, 240, 100u8);
    let refused = tracker().update(&small.as_frame(), 0.0);
    let expected = TrackError::CameraSize { camera_width: 640, camera_height: 480, width: 320, height: 240 };
    assert_eq!(refused, Err(expected));
    let mut guessing = Tracker::new(TrackerOptions { camera: None, ..options() }).unwrap();
    assert_eq!(guessing.update(&small.as_frame(), 0.0), Ok(()));
}

#[test]
fn the_report_counts_frames_candidates_borders_and_refused_starts() {
    let mut tracker = tracker();
    // A person who leaves to the right, then something too small: no start.
    let frames = [&[][..], &[person(560)], &[person(400)], &[boxed(300, 300, 8, 9)]];
    for (k, boxes) in frames.into_iter().enumerate() {
        tracker.advance(&evidence(k, boxes)).unwrap();
    }
    let counts = tracker.seek_report();
    assert_eq!((counts.frames_with_candidate, counts.frames_cut_off, counts.refused_starts), (2, 1, 0));
    tracker.candidates.clear();
    (10..23).for_each(|k| tracker.advance(&evidence(k, &[person(400)])).unwrap());
    assert_eq!(tracker.seek_report().refused_starts, 1);
    let seen = tracker.candidates.iter().map(|c| (c.seen.len(), c.least)).max();
    assert_eq!(seen, Some((13, 13 + 4)), "another start after a third as many frames");
    let frame = Image::filled(SIZE[0], SIZE[1], 100u8);
    (0..3).for_each(|k| tracker.update(&frame.as_frame(), f64::from(k)).unwrap());
    assert_eq!(tracker.seek_report().frames, 3);
}

#[test]
fn sightings_do_not_pile_up_while_nobody_starts() {
    let mut tracker = tracker();
    for k in 0..120 {
        tracker.advance(&evidence(k, &[person(400)])).unwrap();
        let most = options().path_frames + options().start_frames / 3;
        assert!(tracker.candidates.iter().all(|c| c.seen.len() < most));
    }
    assert!(tracker.people.is_empty() && tracker.seek_report().refused_starts > 20);
}

#[test]
fn up_to_eight_regions_are_sought_at_a_time_the_largest_first() {
    let mut tracker = tracker();
    let boxes: [Rectangle; 9] = std::array::from_fn(|k| boxed(10 + 70 * k, 399, 50, 250 - 10 * k));
    tracker.advance(&evidence(0, &boxes)).unwrap();
    let sought: Vec<Rectangle> = tracker.candidates.iter().map(|c| c.seen[0].sighting.rectangle).collect();
    assert_eq!(sought, boxes[..8]);
}

/// Two people whose feet touch are one thing at first, and then two; what was seen of the one thing is forgotten. A frame in
/// which their trunks touch too begins anew.
#[test]
fn people_side_by_side_are_sought_apart_after_some_frames() {
    let [left, right, feet, arms] = [
        boxed(200, 399, 40, 220),
        boxed(300, 399, 40, 200),
        boxed(200, 399, 140, 15),
        boxed(200, 280, 140, 20),
    ];
    let sought = |frames: usize, is_arm_in_arm: &dyn Fn(usize) -> bool| {
        let mut tracker = tracker();
        for k in 0..frames {
            let boxes =
                if is_arm_in_arm(k) { vec![left, right, feet, arms] } else { vec![left, right, feet] };
            tracker.advance(&evidence(k, &boxes)).unwrap();
        }
        let of = |c: &Candidate| (c.seen.len(), c.last_rectangle().unwrap().width());
        tracker.candidates.iter().map(of).collect::<Vec<_>>()
    };
    assert_eq!(sought(3, &|_| false), [(3, 140)]);
    assert_eq!(sought(4, &|_| false), [(1, 70), (1, 70)]);
    assert_eq!(sought(6, &|_| false), [(3, 70), (3, 70)]);
    assert_eq!(sought(6, &|k| k == 2), [(6, 140)]);
}

const PATH: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
const BEGINNING: Beginning =
    Beginning { time_s: 0.0, along_m: 0.0, phase: 0.2, speed_mps: 1.2, rate_hz: 0.9 };

/// A step of a good walk, at x metres along the path.
fn step(frame: usize, along_m: f64, speed_mps: f64) -> Step {
    let time_s = 0.04 * frame as f64;
    let height_m = walker().level_torso_height_m();
    let state = State {
        along: ConstantVelocity::new(along_m, speed_mps, 1e-4, 1e-3),
        height: ConstantVelocity::new(height_m, 0.0, 1e-4, 0.0),
        phase: ConstantVelocity::new(0.2 + 0.9 * time_s, 0.9, 1e-4, 1e-3),
    };
    step_in(frame, time_s, state)
}

/// A tracker that has followed a person through `count` frames; the person is now at x metres.
fn following(count: usize, along_m: f64, speed_mps: f64) -> Tracker {
    let mut tracker = tracker();
    let steps = (0..count).map(|k| step(k, along_m - 0.04 * speed_mps * (count - 1 - k) as f64, speed_mps));
    let mut followed = active(steps.collect());
    followed.walk.beginning = BEGINNING;
    tracker.people.push(Active {
        start: report(PATH, BEGINNING, Direction::Forward),
        settled: true,
        ..followed
    });
    tracker.identities.appear(&tracker.people[0].sign_at(0).unwrap());
    tracker
}

#[test]
fn a_long_walk_is_handed_out_and_followed_on_as_a_new_one() {
    for (longest, handed_out) in [(30, 1), (31, 0)] {
        let mut tracker = following(29, 0.0, 1.2);
        tracker.longest_walk = longest;
        tracker.advance(&evidence(29, &[person(280)])).unwrap();
        let walks = tracker.take_finished();
        assert_eq!((walks.len(), tracker.people.is_empty()), (handed_out, handed_out == 1));
        assert!(tracker.take_finished().is_empty(), "handed out once");
        if handed_out == 1 {
            assert_eq!(walks[0].rows().len(), 30);
            (30..33).for_each(|k| tracker.advance(&evidence(k, &[person(280)])).unwrap());
            let sought = tracker.candidates.iter().map(|c| c.seen.len()).max();
            assert_eq!(sought, Some(4), "sought again from the same frame on");
        }
    }
    assert_eq!(tracker().longest_walk, LONGEST_WALK);
    assert_eq!(LONGEST_WALK, 20_000);
}

/// A tracker that has followed a person for 60 frames; in the last 15 the person stood still.
fn following_to_a_stop() -> Tracker {
    let mut tracker = following(60, 0.0, 1.2);
    for twin in &mut tracker.people.first_mut().unwrap().walk.twins {
        let stop = twin.steps[44].state;
        twin.steps[45..].iter_mut().for_each(|step| step.state = stop);
    }
    tracker
}

#[test]
fn who_stands_still_is_let_go_once_the_path_is_known() {
    for turned in [true, false] {
        let mut tracker = following_to_a_stop();
        tracker.people.first_mut().unwrap().settled = turned;
        tracker.advance(&evidence(60, &[])).unwrap();
        assert_eq!(tracker.people.is_empty(), turned);
        (61..135).for_each(|k| tracker.advance(&evidence(k, &[])).unwrap());
        assert!(tracker.take_finished().is_empty(), "somebody may start there");
        tracker.advance(&evidence(136, &[])).unwrap();
        assert_eq!(tracker.take_finished().len(), usize::from(turned));
        assert_eq!(tracker.seek_report().refused_starts, 0);
    }
    let mut walks_on = following(40, 0.0, 1.2);
    walks_on.advance(&evidence(40, &[])).unwrap();
    assert!(!walks_on.people.is_empty());
}

#[test]
fn who_never_got_on_is_refused_at_the_end() {
    for speed_mps in [0.0, -1.2, 4.0] {
        let mut tracker = following(40, 0.0, speed_mps);
        tracker.finish().unwrap();
        assert!(tracker.take_finished().is_empty(), "{speed_mps}");
        assert_eq!(tracker.seek_report().refused_starts, 1);
    }
}

#[test]
fn frames_are_kept_until_there_are_enough_for_the_path() {
    let mut tracker = following(20, -0.5, 1.2);
    tracker.options.path_frames = 3;
    tracker.people.first_mut().unwrap().settled = false;
    tracker.people.first_mut().unwrap().known_frame = Some(12);
    for (k, (kept, turned)) in [(1, false), (2, false), (3, true), (4, true)].into_iter().enumerate() {
        tracker.advance(&evidence(20 + k, &[])).unwrap();
        let active = tracker.people.first().unwrap();
        assert_eq!((active.kept.len(), active.settled), (kept, turned), "frame {k}");
        // From there on the person is followed, of whom the average left parts unexplained.
        assert_eq!(active.known_frame, Some(if turned { 22 } else { 12 }), "frame {k}");
    }
}

/// The share of the body's box outside the image, horizontally and vertically, at x metres with the torso at z.
fn outside(along_m: f64, height_m: f64) -> [f64; 2] {
    let (walker, camera) = (walker(), camera());
    let scene = Scene::new(&walker, &camera, &PATH);
    let posed = scene.pose(&Hypothesis { along_m, height_m, phase: 0.2 + 0.9 * 0.04 });
    let ends = posed.cylinders.iter().flat_map(|c| {
        [-1.0, 1.0].map(|s| c.centre() + s * c.half_length * c.world_from_cylinder.matrix3.z_axis)
    });
    let pixels: Vec<DVec2> = ends.map(|p| camera.project(p).unwrap()).collect();
    let share = |of: fn(&DVec2) -> f64, size: usize| {
        let low = pixels.iter().map(of).fold(f64::INFINITY, f64::min);
        let high = pixels.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        let shown = high.min(size as f64 - 1.0) - low.max(0.0);
        1.0 - shown / (high - low)
    };
    [share(|p| p.x, SIZE[0]), share(|p| p.y, SIZE[1])]
}

#[test]
fn a_walk_ends_where_four_tenths_of_the_body_are_outside() {
    let height_m = walker().level_torso_height_m();
    let follows = |along_m: f64, height_m: f64| {
        let mut tracker = following(1, along_m, 0.0);
        let active = tracker.people.first_mut().unwrap();
        active.walk.twins[0].steps[0].state.height.position = height_m;
        tracker.predicted(&tracker.people[0], &evidence(1, &[])).is_some()
    };
    // Horizontally at both sides, and at the top.
    let right = (0..400).map(|k| 0.01 * f64::from(k)).map(|x| ((x, height_m), outside(x, height_m)[0]));
    let left = (0..400).map(|k| -0.01 * f64::from(k)).map(|x| ((x, height_m), outside(x, height_m)[0]));
    let up = (0..400).map(|k| height_m + 0.01 * f64::from(k)).map(|z| ((0.0, z), outside(0.0, z)[1]));
    let ways: [Vec<((f64, f64), f64)>; 3] = [right.collect(), left.collect(), up.collect()];
    for way in &ways {
        let at = |share: f64| way.iter().find(|(_, outside)| *outside >= share).unwrap().0;
        for (share, stays) in [(0.0, true), (0.15, true), (0.35, true), (0.43, false), (0.6, false)] {
            let (along_m, height_m) = at(share);
            assert_eq!(follows(along_m, height_m), stays, "{share} outside at {along_m}, {height_m}");
        }
    }
}

#[test]
fn who_left_is_handed_out_and_the_same_frame_is_searched_for_the_next() {
    let mut tracker = following(20, 4.0, 1.2);
    tracker.advance(&evidence(20, &[person(100)])).unwrap();
    assert_eq!((tracker.take_finished().len(), tracker.candidates[0].seen.len()), (1, 1));
}

#[test]
fn the_window_is_the_body_s_box_with_a_margin_that_grows_with_the_uncertainty() {
    let (walker, camera) = (walker(), camera());
    let scene = Scene::new(&walker, &camera, &PATH);
    let window = |position_variance: f64| {
        let mut tracker = following(1, 0.0, 0.0);
        let state = &mut tracker.people.first_mut().unwrap().walk.twins[0].steps[0].state;
        state.along.covariance = [position_variance, 0.0, 0.0];
        state.height.covariance = [position_variance, 0.0, 0.0];
        tracker.predicted(&tracker.people[0], &evidence(0, &[])).unwrap().window
    };
    let posed = scene.pose(&step(0, 0.0, 0.0).state.hypothesis());
    let joints = posed.right.to_array().into_iter().chain(posed.left.to_array());
    let pixels: Vec<DVec2> = joints.map(|p| camera.project(p).unwrap()).collect();
    let (sure, unsure, lost) = (window(0.0), window(0.0025), window(4.0));
    for p in &pixels {
        assert!(sure.left as f64 <= p.x - 15.0 && sure.right as f64 >= p.x + 15.0, "{sure:?}, {p}");
        assert!(sure.top as f64 <= p.y - 15.0 && sure.bottom as f64 >= p.y + 15.0, "{sure:?}, {p}");
    }
    let lowest = pixels.iter().map(|p| p.y).fold(0.0, f64::max);
    assert!((sure.bottom as f64) < lowest + 60.0, "no more than a foot and the margin below the ankle");
    // At a distance of 6 m, 5 cm are some 5.5 pixels; beyond 20 cm along and 10 cm in height the margin is
    // constant.
    let focal_px = camera.focal_px.x;
    let near =
        |grown: usize, m: f64| (grown as f64 - m * focal_px / 6.0).abs() < 2.5 + 0.05 * m * focal_px / 6.0;
    assert!(near(sure.left - unsure.left, 0.05) && near(unsure.right - sure.right, 0.05), "{unsure:?}");
    assert!(near(sure.top - unsure.top, 0.05) && near(unsure.bottom - sure.bottom, 0.05), "{unsure:?}");
    assert!(near(sure.left - lost.left, 0.2) && near(sure.top - lost.top, 0.1), "{lost:?}");
}

#[test]
fn what_is_handed_out_is_trimmed_and_knows_its_camera() {
    let mut tracker = following(30, 0.0, 1.2);
    let steps = &mut tracker.people.first_mut().unwrap().walk.twins[0].steps;
    steps[..2].iter_mut().for_each(|step| step.similarity = 0.0);
    tracker.finish().unwrap();
    let walk = tracker.take_finished().remove(0);
    assert_eq!((walk.steps().len(), walk.steps()[0].frame), (28, 2));
    assert!(walk.tilt.is_none() && walk.camera == camera() && walk.fit.is_none());
    assert_eq!((walk.depth_sd_m, walk.options), (0.1, options().walk));
    let mut guessed = following(30, 0.0, 1.2);
    let tilt = tilt_of_lines(&[], [640, 480], 500.0);
    guessed.people[0].tilt = Some(tilt);
    guessed.finish().unwrap();
    assert_eq!(guessed.take_finished()[0].tilt, Some(tilt));
    let frame = Image::filled(SIZE[0], SIZE[1], 100u8);
    assert_eq!(tracker.update(&frame.as_frame(), 9.0), Err(TrackError::Finished));
}

#[test]
fn the_current_estimate_is_the_last_step_of_the_better_twin() {
    assert_eq!(tracker().current(), None);
    let tracker = following(60, 0.4, 1.2);
    let now = tracker.current().unwrap();
    assert_eq!((now.frame, now.heading_rad, now.speed_mps), (59, 0.0, 1.2));
    assert!((now.time_s - 2.36).abs() < 1e-12);
    // 0.2 + 0.9 * 2.36 = 2.324 cycles.
    assert!((now.phase - 0.324).abs() < 1e-9 && (now.torso_centre.x - 0.4).abs() < 1e-9, "{now:?}");
    assert!(
        now.torso_centre.y.abs() < 1e-9
            && (now.torso_centre.z - walker().level_torso_height_m()).abs() < 0.05
    );
    assert!(now.p_swapped < 0.01);
}

/// Two people of 1.75 m who walk at this distance behind each other across the image.
fn following_two(gap_m: f64) -> Tracker {
    let mut tracker = following(40, 0.0, 1.2);
    let behind = Path { origin: DVec2::new(0.0, gap_m), ..PATH };
    let mut second = following(40, 0.0, 1.2).people.remove(0);
    second.walk.route = behind.into();
    second.person = tracker.identities.appear(&second.sign_at(0).unwrap());
    tracker.people.push(second);
    tracker
}

#[test]
fn who_stands_in_front_hides_who_is_behind() {
    let mut tracker = following_two(0.8);
    tracker.people.swap(0, 1);
    tracker.advance(&evidence(40, &[])).unwrap();
    let visible: Vec<f32> = tracker.people.iter().map(|active| active.walk.last().unwrap().visible).collect();
    assert_eq!((tracker.people[0].person, visible[0]), (0, 1.0), "near to far");
    assert!((0.02..0.4).contains(&visible[1]), "{visible:?}");
}

/// Whether the two are given a moving region as their rectangle, the second one started `near` the first and `settled`.
fn given_region(region: Rectangle, near: bool, settled: bool) -> [bool; 2] {
    let mut tracker = following_two(0.8);
    let second = tracker.people.remove(1);
    tracker.people.push(Active { started_near: near, settled, ..second });
    tracker.advance(&evidence(40, &[region])).unwrap();
    [0, 1].map(|person| {
        let active = tracker.people.iter().find(|active| active.person == person).unwrap();
        active.kept.last().is_some_and(|(sighting, _)| sighting.is_some())
    })
}

/// What was left over from somebody who turned may start a walk within the region of that person.
#[test]
fn a_region_of_one_person_stays_that_person_s_while_somebody_else_only_just_started_in_it() {
    let own = rectangle_of(&walker(), &camera(), &PATH, 0.05);
    assert_eq!(given_region(own, true, false), [true, false]);
    assert_eq!(given_region(own, true, true), [false, false], "of either");
    assert_eq!(given_region(own, false, false), [false, false], "both came on their own");
    let wide = Rectangle { right: own.right + 60, ..own };
    let low = Rectangle { top: own.top + own.height() / 4, ..own };
    for others in [wide, low] {
        assert_eq!(given_region(others, true, false), [false, false], "{others:?}");
    }
}

#[test]
fn everybody_is_told_in_order_of_appearance() {
    let mut tracker = following_two(0.8);
    tracker.people.swap(0, 1);
    let people: Vec<usize> = tracker.people().iter().map(|now| now.person).collect();
    assert_eq!(people, [0, 1]);
    assert_eq!(tracker.current().unwrap().person, 0);
}

#[test]
fn nobody_is_started_on_the_changes_of_somebody_who_is_followed() {
    let mut tracker = following(40, 0.0, 1.2);
    let expected = tracker.predicted(&tracker.people[0], &evidence(40, &[])).unwrap();
    // All of the body changes.
    let mut around = Image::filled(SIZE[0], SIZE[1], true);
    clear_explained(&mut around, &camera(), &expected.body, 0.0);
    let body_and = |frame: usize, boxes: &[Rectangle]| {
        let mut seen = evidence(frame, boxes);
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))) {
            if !around.at(x, y) {
                seen.mask.set(x, y, true);
                seen.firm_mask.set(x, y, true);
            }
        }
        seen
    };
    let mut nobody = following(40, 0.0, 1.2);
    nobody.people.clear();
    nobody.advance(&body_and(40, &[])).unwrap();
    assert_eq!(nobody.candidates.len(), 1, "it could be a person");
    tracker.advance(&body_and(40, &[])).unwrap();
    assert!(tracker.candidates.is_empty(), "{:?}", tracker.candidates);
    tracker.advance(&body_and(41, &[person(20)])).unwrap();
    let sought: Vec<Rectangle> = tracker.candidates.iter().map(|c| c.seen[0].sighting.rectangle).collect();
    assert_eq!(sought, [person(20)]);
}

/// The places of the candidates' last sightings after two frames in which these boxes were given, and a region moved
/// somewhere else.
fn sought_in(mut tracker: Tracker, first_frame: usize, given: [&[Rectangle]; 2]) -> Vec<Rectangle> {
    for (k, boxes) in given.into_iter().enumerate() {
        tracker.boxes.insert(first_frame + k, boxes.to_vec());
        tracker.advance(&evidence(first_frame + k, &[boxed(500, 399, 80, 200)])).unwrap();
    }
    assert!(tracker.boxes.is_empty(), "boxes of frames that are done");
    tracker.candidates.iter().map(|c| c.seen.last().unwrap().sighting.rectangle).collect()
}

#[test]
fn given_boxes_are_sought_instead_of_what_moves() {
    let boxes = [person(100), person(150), person(200), person(250)];
    let moved = boxes.map(|r| Rectangle { left: r.left + 4, right: r.right + 4, ..r });
    // Changes would reach 2 pixels above the crown.
    let sought = moved.map(|r| Rectangle { top: r.top - 2, ..r });
    assert_eq!(
        sought_in(tracker(), 0, [&boxes, &moved]),
        sought,
        "each goes on with the box nearest to its own"
    );
    assert!(sought_in(tracker(), 0, [&[], &[]]).is_empty());
}

#[test]
fn somebody_who_is_followed_has_the_box_that_overlaps_the_body_most() {
    let followed = following(30, 0.0, 1.2);
    let body = body_box(&followed.people[0].camera, &followed.people[0].body().unwrap()).unwrap();
    let [left, top, right, bottom] =
        [body.left, body.top, body.right, body.bottom].map(|side| side.round() as usize);
    let own = Rectangle { left, top, right, bottom };
    let beside = |by: usize| Rectangle { left: own.left + by, right: own.right + by, ..own };
    let half = (own.width() as f64 * 0.5) as usize;
    assert_eq!(followed.unclaimed(vec![beside(half), own]), [beside(half)], "one box for one person");
    assert_eq!(followed.unclaimed(vec![beside(half)]), [], "it overlaps by a third");
    assert_eq!(followed.unclaimed(vec![beside(2 * half)]), [beside(2 * half)]);
}

#[test]
fn boxes_belong_to_their_frame_whatever_was_refused_before() {
    let frame = Image::filled(SIZE[0], SIZE[1], 100);
    let mut tracker = tracker();
    let outside = Rectangle { right: 640, ..person(600) };
    let refused = tracker.update_with_boxes(&frame.as_frame(), 0.0, &[person(100), outside]);
    assert_eq!(refused, Err(TrackError::Box { given: outside, width: 640, height: 480 }));
    tracker.update_with_boxes(&frame.as_frame(), 0.0, &[person(100)]).unwrap();
    let late = tracker.update_with_boxes(&frame.as_frame(), 0.0, &[person(300)]);
    assert!(matches!(late, Err(TrackError::Evidence(EvidenceError::TimeOrder { .. }))));
    tracker.update_with_boxes(&frame.as_frame(), 0.04, &[person(104)]).unwrap();
    tracker.update(&frame.as_frame(), 0.08).unwrap();
    let seen: Vec<usize> =
        tracker.candidates[0].seen.iter().map(|seen| seen.sighting.rectangle.left).collect();
    assert_eq!((tracker.candidates.len(), seen), (1, vec![100, 104]));
}

#[test]
fn heights_are_those_of_people_in_order_of_appearance() {
    let mut options = TrackerOptions::for_height(1.8);
    assert_eq!([0, 1, 2].map(|person| options.height_of(person)), [Some(1.8); 3]);
    options.further_heights_m = vec![1.6];
    assert_eq!([0, 1, 2].map(|person| options.height_of(person)), [Some(1.8), Some(1.6), None]);
    options.further_heights_m.push(18.0);
    let refused = Tracker::new(options).unwrap_err();
    assert!(matches!(refused, TrackError::Body(_)) && refused.to_string().contains("18"), "{refused}");
}

/// Somebody 1.75 m tall is seen.
#[test]
fn of_the_given_heights_a_person_has_the_one_that_a_given_camera_shows_clearly() {
    let heights = |given_m: [f64; 3], camera: Option<Camera>| {
        let further_heights_m = given_m[1..].to_vec();
        let options = TrackerOptions { camera, further_heights_m, ..TrackerOptions::for_height(given_m[0]) };
        let mut tracker = Tracker::new(options).unwrap();
        tracker.order_heights(&Candidate { seen: seen_walking(1.3), ..Candidate::default() });
        [0, 1, 2].map(|person| tracker.given_height(person).unwrap())
    };
    assert_eq!(heights([1.5, 1.95, 1.75], Some(camera())), [1.75, 1.5, 1.95]);
    assert_eq!(heights([1.5, 1.75, 1.95], Some(camera())), [1.75, 1.5, 1.95]);
    for given_m in [[1.74, 1.76, 1.95], [1.75, 1.5, 1.95]] {
        assert_eq!(heights(given_m, Some(camera())), given_m, "in order of appearance");
    }
    assert_eq!(heights([1.5, 1.95, 1.75], None), [1.5, 1.95, 1.75], "no camera shows it");
}

/// Two given heights, and the frames of somebody who walks.
fn sought_with_heights() -> Tracker {
    let options = TrackerOptions { start_frames: 5, further_heights_m: vec![1.6], ..options() };
    let candidate = Candidate { seen: seen_walking(1.3), ..Candidate::default() };
    Tracker { candidates: vec![candidate], ..Tracker::new(options).unwrap() }
}

fn numbers_and_heights(tracker: &Tracker) -> Vec<(usize, BodyHeight)> {
    tracker.people.iter().map(|active| (active.person, active.height)).collect()
}

#[test]
fn a_walk_that_the_end_of_a_view_cuts_short_uses_up_no_number_and_no_height() {
    for (frame, count) in [(20, 1), (10, 0)] {
        let mut tracker = following(20, 0.0, 1.2);
        tracker.end_view(&Loss { frame, reason: LossReason::Cut });
        assert!(tracker.people.is_empty());
        assert_eq!(tracker.identities.count(), count, "cut in frame {frame}");
    }
}

/// A walk that left its person is taken back when the person is found again, but the number stays.
#[test]
fn who_is_found_again_keeps_the_number_if_the_walk_before_was_none() {
    let mut tracker = following(40, 0.0, 0.0);
    let mut old = tracker.people.remove(0);
    let new = old.clone();
    for twin in &mut old.walk.twins {
        twin.steps.iter_mut().for_each(|step| step.state.along.velocity = 1.2);
        twin.steps.iter_mut().for_each(|step| step.time_s -= 1.6);
    }
    let last = &new.walk.twins[0].steps[0];
    let meant = old.sign_at(39).unwrap();
    assert!(meant.time_s < last.time_s && !old.is_walk());
    tracker.fading.push((meant.time_s, old));
    assert_eq!(tracker.identified(&new), 0);
    assert!(tracker.take_finished().is_empty() && tracker.seek_report().refused_starts == 1);
    let stranger = Sign { place_m: DVec2::new(9.0, 9.0), ..new.sign_at(0).unwrap() };
    assert_eq!(tracker.identities.appear(&stranger), 1);
}

/// A start on a curve goes across the picture at first; the settled path shows whose walk it is.
#[test]
fn whose_walk_it_is_is_asked_again_on_the_settled_path() {
    for (turned_deg, height_m, number) in [(30.0, None, 0), (100.0, None, 1), (30.0, Some(1.6), 1)] {
        let mut tracker = following(40, 0.0, 1.2);
        tracker.options.further_heights_m = height_m.into_iter().collect();
        let old = tracker.people.remove(0);
        let end = old.sign_at(39).unwrap();
        tracker.identities.end(0, end);
        let mut new = old.clone();
        let later_s = 0.4;
        for twin in &mut new.walk.twins {
            twin.steps
                .iter_mut()
                .for_each(|step| step.time_s += end.time_s - old.steps()[0].time_s + later_s);
        }
        let at = |turned_deg: f64| {
            let path =
                Path { origin: end.place_m, heading_rad: PATH.heading_rad + f64::to_radians(turned_deg) };
            let first_m = old.steps()[0].state.along.position;
            Path { origin: path.origin - path.direction() * (first_m - 1.2 * later_s), ..path }
        };
        new.walk.route = at(90.0).into();
        new.person = tracker.identified(&new);
        assert_eq!(new.person, 1);
        new.walk.route = at(turned_deg).into();
        tracker.identify_again(&mut new);
        assert_eq!(
            (new.person, tracker.identities.count()),
            (number, number + 1),
            "{turned_deg} {height_m:?}"
        );
    }
}

#[test]
fn heights_change_places_only_for_who_is_new() {
    let order = |is_back: bool| {
        let options = TrackerOptions { start_frames: 5, further_heights_m: vec![1.5, 1.76], ..options() };
        let candidate = || Candidate { seen: seen_walking(1.3), ..Candidate::default() };
        let mut tracker = Tracker { candidates: vec![candidate()], ..Tracker::new(options).unwrap() };
        tracker.start(&evidence(5, &[]));
        let first = tracker.people.remove(0);
        let start = first.sign_at(0).unwrap();
        if is_back {
            tracker.identities.end(0, start);
        }
        tracker.candidates.push(candidate());
        tracker.start(&evidence(6, &[]));
        assert_eq!(tracker.people[0].person, usize::from(!is_back));
        tracker.order_of_heights.clone()
    };
    assert_eq!(order(true), [0, 1, 2], "the next one is still to come");
    assert_eq!(order(false), [0, 2, 1], "of 1.50 and 1.76 m the second is seen");
}

/// Two models of one person, of which the first was taken when the second was still followed.
#[test]
fn a_second_model_of_somebody_whose_walk_was_taken_is_withdrawn() {
    let walks = |are_taken_early: bool| {
        let mut tracker = following_two(0.0);
        tracker.people[1].started_near = false;
        let first = tracker.people.remove(0);
        tracker.end_walk(first);
        let mut count = if are_taken_early { tracker.take_finished().len() } else { 0 };
        tracker.finish().unwrap();
        count += tracker.take_finished().len();
        count
    };
    assert_eq!([true, false].map(walks), [1, 1]);
}

/// One model loses the person, on whom another one was started, and either is the longer one.
#[test]
fn two_models_of_one_person_in_turn_have_one_number() {
    for (end, start) in [(27, 14), (26, 13)] {
        let mut tracker = following_two(0.0);
        tracker.people[0].drop_from(end);
        tracker.people[1].walk.keep(start..40);
        tracker.people[1].started_near = false;
        tracker.finish().unwrap();
        let walks = tracker.take_finished();
        assert_eq!(walks.iter().map(|walk| walk.person).collect::<Vec<_>>(), [0, 0]);
        let mut frames: Vec<usize> =
            walks.iter().flat_map(|walk| walk.steps().iter().map(|step| step.frame)).collect();
        frames.sort_unstable();
        assert_eq!(frames, (0..40).collect::<Vec<_>>());
        assert_eq!(tracker.identities.count(), 1);
    }
}

/// Of two walks at a time that have one number, the longer one stays.
#[test]
fn nobody_is_in_two_places() {
    let mut tracker = following_two(3.0);
    tracker.people[0].drop_from(14);
    tracker.people[1].started_near = false;
    tracker.people[1].person = 0;
    tracker.identities.pass_on(1, 0);
    tracker.finish().unwrap();
    let walks = tracker.take_finished();
    let frames: Vec<usize> =
        walks.iter().flat_map(|walk| walk.steps().iter().map(|step| step.frame)).collect();
    assert_eq!((walks.len(), frames, tracker.identities.count()), (1, (0..40).collect(), 1));
    assert!((walks[0].rows()[0].torso_centre.y - 3.0).abs() < 0.1);
}

/// The other one is followed with all contours again before they are lost to nobody.
#[test]
fn who_never_has_legs_is_not_followed_for_long() {
    let people = |share: f64, started_near: bool| {
        let mut tracker = following_two(0.8);
        tracker.people[1].started_near = started_near;
        tracker.people[1].of_its_own = vec![share; 9];
        tracker.advance(&evidence(40, &[])).unwrap();
        tracker.people.iter().map(|active| active.person).collect::<Vec<_>>()
    };
    assert_eq!(people(0.0, true), [0]);
    assert_eq!([people(0.5, true).len(), people(0.0, false).len()], [2, 2]);
}

/// What is left over from one person can look like a second one.
#[test]
fn who_was_started_beside_somebody_and_has_no_legs_is_withdrawn() {
    let people = |share: f64| {
        let mut tracker = following_two(0.8);
        tracker.people[1].of_its_own = vec![share; 9];
        tracker.finish().unwrap();
        tracker.take_finished().iter().map(|walk| walk.person).collect::<Vec<_>>()
    };
    assert_eq!(people(0.5), [0, 1]);
    assert_eq!(people(0.0), [0]);
    // Changes everywhere are also at the legs of who was started beside the other; of who was not, none are noted.
    let mut tracker = following_two(0.8);
    tracker.people[1].started_near = true;
    let mut seen = evidence(40, &[]);
    let noted = |tracker: &mut Tracker, seen: &Evidence| {
        tracker.advance(seen).unwrap();
        [0, 1].map(|person| {
            let active = tracker.people.iter().find(|active| active.person == person).unwrap();
            (active.of_its_own.len(), active.of_its_own.last().copied())
        })
    };
    assert_eq!(noted(&mut tracker, &seen), [(0, None), (1, Some(0.0))]);
    seen.firm_mask = Image::filled(SIZE[0], SIZE[1], true);
    seen.frame = 41;
    let [front, behind] = noted(&mut tracker, &seen);
    assert!(front == (0, None) && behind.1 > Some(0.5), "{behind:?}");
}

#[test]
fn who_is_back_has_the_height_of_before() {
    let [first, second] = [(0, BodyHeight::given(1.75)), (1, BodyHeight::given(1.6))];
    let mut tracker = sought_with_heights();
    tracker.start(&evidence(5, &[]));
    assert_eq!(numbers_and_heights(&tracker), [first]);
    let ended = tracker.people.remove(0).sign_at(0).unwrap();
    for (time_s, expected) in [(ended.time_s, first), (ended.time_s - 9.0, second)] {
        let mut tracker = Tracker { identities: Identities::default(), ..sought_with_heights() };
        tracker.identities.appear(&ended);
        tracker.identities.end(0, Sign { time_s, ..ended });
        tracker.start(&evidence(5, &[]));
        assert_eq!(numbers_and_heights(&tracker), [expected], "ended at {time_s} s");
    }
}

#[test]
fn of_two_who_start_at_once_the_candidate_of_longer_standing_is_first() {
    let mut tracker = sought_with_heights();
    let mut later = seen_walking(1.3);
    for seen in &mut later {
        let moved = &mut seen.sighting.rectangle;
        (moved.left, moved.right) = (moved.left + 150, moved.right + 150);
        seen.edges.edges.iter_mut().for_each(|edge| {
            edge.start[0] += 150.0;
            edge.end[0] += 150.0;
        });
    }
    tracker.candidates.push(Candidate { seen: later, ..Candidate::default() });
    tracker.start(&evidence(5, &[]));
    let places: Vec<f64> = tracker.people.iter().map(|active| active.sign_at(0).unwrap().place_m.x).collect();
    assert!(places.len() == 2 && places[0] + 1.0 < places[1], "{places:?}");
    assert_eq!(tracker.people[0].height, BodyHeight::given(1.75));
    assert_eq!(tracker.people[1].height, BodyHeight::given(1.6));
}

/// Who began as somebody who walks slowly is the same person on the spot.
#[test]
fn who_begins_again_on_the_spot_keeps_the_height() {
    let tracker = sought_with_heights();
    let sighting = |k: u32| {
        let rectangle = rectangle_of(&walker(), &camera(), &PATH, 0.01 * f64::from(k % 3));
        Sighting { time_s: 0.04 * f64::from(k), rectangle }
    };
    let sightings: Vec<Sighting> = (0..40).map(sighting).collect();
    for (who, height_m) in [(0, 1.75), (1, 1.6)] {
        let spot = tracker.spot(&sightings, [SIZE[0] as u32, SIZE[1] as u32], who).unwrap();
        assert_eq!(spot.height, BodyHeight::given(height_m));
    }
}

/// What was begun across the picture, as arms and shadows may look, while its feet go along the line of sight or across it; where
/// others reach into its region, the lowest rows may be theirs.
#[test]
fn a_walk_whose_feet_go_along_the_line_of_sight_begins_again_there() {
    let across = |time_s: f64| MIDDLE + towards().perp() * (SPEED_MPS * time_s - 1.2);
    let beside = |from: usize| {
        let mut seen = standing(66, feet_of_steps);
        seen.kept[from..].iter_mut().for_each(|(_, edges)| edges.shared = true);
        seen
    };
    let alone = standing(66, feet_of_steps);
    for (seen, is_along) in
        [(alone, true), (beside(56), true), (beside(50), false), (standing(66, across), false)]
    {
        let tracker = tracker();
        let steps = (0..66).map(|k| step(k, 0.05 * k as f64, 1.2)).collect();
        // The first frames are those from before the walk.
        let (kept, feet) = (seen.kept[20..].to_vec(), seen.feet.clone());
        let earlier = seen.before(20);
        let walk = Active { kept, feet, earlier, person: 3, known_frame: Some(12), ..active(steps) };
        let begun = tracker.begun_otherwise(walk);
        assert_eq!((begun.person, begun.known_frame), (3, Some(12)));
        assert_eq!(begun.is_frontal(), is_along);
        if is_along {
            assert_eq!(begun.kept.len(), 66);
            assert!(begun.walk.route.at(0.0).direction().dot(towards()) > 0.99, "{:?}", begun.walk.route);
        }
    }
}
