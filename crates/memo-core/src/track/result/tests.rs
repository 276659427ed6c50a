use super::super::search::Path;
use super::super::search::tests::{camera, walker};
use super::super::start::tests::report;
use super::super::walk::tests::step_in;
use super::super::walk::{Beginning, Look, State};
use super::*;
use crate::calibrate::tilt_of_lines;
use crate::estimate::kalman::FilterOptions;
use crate::synth::Random;
use crate::track::fit::{FitQuality, MeanSd};
use glam::DVec2;

/// A walk at 1.2 m/s and 0.9 Hz along a path, one hypothesis per frame; for frames without one the filter only
/// predicts. The measured phase is wrapped, the state's is not.
fn followed(path: Path, frames: &[(f64, Option<Hypothesis>)], options: WalkOptions) -> TrackedWalk {
    let (first_s, first) = (frames[0].0, frames[0].1.expect("a walk begins where something is seen"));
    let beginning = Beginning {
        time_s: first_s,
        along_m: first.along_m,
        phase: first.phase,
        speed_mps: 1.2,
        rate_hz: 0.9,
    };
    let mut state = State {
        along: ConstantVelocity::new(first.along_m, 1.2, 0.04, 0.13),
        height: ConstantVelocity::new(first.height_m, 0.0, 4e-4, 0.0),
        phase: ConstantVelocity::new(first.phase, 0.9, 0.04, 0.07),
    };
    let (mut before_s, filter) = (first_s, options.filter);
    let step = |(frame, (time_s, seen)): (usize, &(f64, Option<Hypothesis>))| {
        state = state.predict(time_s - before_s, &filter);
        before_s = *time_s;
        if let Some(h) = seen {
            let turns = (state.phase.position - h.phase).round();
            state = State {
                along: state.along.update(h.along_m, &filter.along),
                height: state.height.update(h.height_m, &filter.vertical),
                phase: state.phase.update(h.phase + turns, &filter.phase),
            };
        }
        let measured = seen.map(|h| Hypothesis { phase: h.phase.rem_euclid(1.0), ..h });
        let similarity = if seen.is_some() { 0.5 } else { 0.0 };
        let as_filtered = step_in(5 + 2 * frame, *time_s, state);
        Step { measured, similarity, look: Look { path, ..as_filtered.look }, ..as_filtered }
    };
    let steps: Vec<Step> = frames.iter().enumerate().map(step).collect();
    let mut walk = Walk::new(walker(), path, beginning);
    walk.twins[0].similarity_sum = 5.0;
    walk.twins[0].steps = steps;
    tracked(walk, report(path, beginning, Direction::Forward), options)
}

/// A walk across the picture with a given height, no fit, and a distance known exactly.
pub fn tracked(walk: Walk, start: StartReport, options: WalkOptions) -> TrackedWalk {
    TrackedWalk {
        person: 0,
        frame_camera: None,
        camera_turns: Vec::new(),
        average: walk.walker.clone(),
        walk,
        camera: camera(),
        tilt: None,
        is_on_treadmill: false,
        is_frontal: false,
        crowns_px: Vec::new(),
        unexplained: None,
        height: BodyHeight::given(1.75),
        depth_sd_m: 0.0,
        shown_height_m: None,
        start,
        fit: None,
        options,
    }
}

const ACROSS: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };

/// The true state of the walker, who is in the middle of the image after one second.
fn truth(time_s: f64) -> Hypothesis {
    Hypothesis { along_m: 1.2 * (time_s - 1.0), height_m: 1.15, phase: 0.3 + 0.9 * time_s }
}

/// Times with gaps, 0.03 to 0.08 s.
fn uneven_s(count: usize) -> Vec<f64> {
    let mut time_s = 0.0;
    let next = |k: usize| {
        time_s += [0.04, 0.03, 0.08, 0.05][k % 4];
        time_s
    };
    (0..count).map(next).collect()
}

/// The truth measured with `scatter` times the filter's standard deviations; some frames have no measurement.
fn scattered(scatter: f64, count: usize, filter: &FilterOptions) -> Vec<(f64, Option<Hypothesis>)> {
    let mut random = Random::new(11);
    let mut normal = |variance: f64| scatter * variance.sqrt() * f64::from(random.normal_pair()[0]);
    let measure = |(k, time_s): (usize, f64)| {
        let h = truth(time_s);
        let seen = Hypothesis {
            along_m: h.along_m + normal(filter.along.measurement_variance),
            height_m: h.height_m + normal(filter.vertical.measurement_variance),
            phase: h.phase + normal(filter.phase.measurement_variance),
        };
        // The first is exact, so that the filter's start does not depend on the scatter.
        (time_s, if k == 0 { Some(h) } else { (k % 7 != 5).then_some(seen) })
    };
    uneven_s(count).into_iter().enumerate().map(measure).collect()
}

fn exact(times_s: &[f64]) -> Vec<(f64, Option<Hypothesis>)> {
    times_s.iter().map(|t| (*t, Some(truth(*t)))).collect()
}

#[test]
fn rows_are_the_smoothed_states_of_every_frame() {
    let options = WalkOptions::default();
    let frames = scattered(0.3, 30, &options.filter);
    let walk = followed(ACROSS, &frames, options);
    let dt_s: Vec<f64> = frames.windows(2).map(|w| w[1].0 - w[0].0).collect();
    let smoothed = |of: fn(&State) -> ConstantVelocity, noise: &Noise| {
        smooth(&walk.steps().iter().map(|s| of(&s.state)).collect::<Vec<_>>(), &dt_s, noise)
    };
    let along = smoothed(|s| s.along, &options.filter.along);
    let height = smoothed(|s| s.height, &options.filter.vertical);
    let phase = smoothed(|s| s.phase, &options.filter.phase);
    let rows = walk.rows();
    assert_eq!(rows.len(), 30);
    for (k, row) in rows.iter().enumerate() {
        assert!((row.hypothesis.along_m - along[k].position).abs() < 1e-12, "frame {k}");
        assert!((row.speed_mps - along[k].velocity).abs() < 1e-12, "frame {k}");
        assert!((row.hypothesis.height_m - height[k].position).abs() < 1e-12, "frame {k}");
        assert!((row.phase - phase[k].position.rem_euclid(1.0)).abs() < 1e-12, "frame {k}");
        assert_eq!((row.frame, row.time_s, row.heading_rad), (5 + 2 * k, frames[k].0, 0.0));
        assert_eq!(row.similarity, if frames[k].1.is_some() { 0.5 } else { 0.0 });
        assert!(row.hypothesis.phase == row.phase && row.p_swapped == walk.p_swapped());
        let posed = walk.scene(row.hypothesis.along_m).pose(&row.hypothesis);
        assert_eq!((row.torso_centre, row.right, row.left), (posed.torso_centre, posed.right, posed.left));
    }
}

#[test]
fn standard_deviations_grow_with_the_scatter_about_the_predictions() {
    let options = WalkOptions::default();
    let common = [0.015, 0.0, 0.02, 0.015];
    let own_sq = |scatter: f64| -> Vec<[f64; 4]> {
        let walk = followed(ACROSS, &scattered(scatter, 40, &options.filter), options);
        let own = |row: &Row| std::array::from_fn(|i| row.sd[i].powi(2) - f64::powi(common[i], 2));
        walk.rows().iter().map(own).collect()
    };
    for (once, twice) in own_sq(0.2).iter().zip(own_sq(0.4)) {
        for i in [0, 2, 3] {
            assert!(once[i] > 1e-8 && (twice[i] / once[i] - 4.0).abs() < 1e-6, "{i}: {once:?}, {twice:?}");
        }
    }
}

/// If the filter's noise is that of the measurements, the standard deviations stay as smoothed, although the
/// state is far less certain than a measurement and some frames have no measurement.
#[test]
fn a_filter_that_fits_keeps_its_standard_deviations() {
    let mut options = WalkOptions::default();
    options.filter.along = Noise { velocity_variance_per_s: 40.0, measurement_variance: 1e-4 };
    options.filter.vertical = Noise { velocity_variance_per_s: 0.0, measurement_variance: 0.01 };
    let (mut random, mut frames, mut along, mut velocity) = (Random::new(3), vec![], -1.2, 1.2);
    for k in 0..500 {
        let time_s = 0.04 * f64::from(k);
        let [kick, off, up] =
            [40.0 * 0.04, 1e-4, 0.01f64].map(|v| v.sqrt() * f64::from(random.normal_pair()[0]));
        if k > 0 {
            (along, velocity) = (along + 0.04 * velocity, velocity + kick);
        }
        let seen = Hypothesis { along_m: along + off, height_m: 1.15 + up, ..truth(time_s) };
        frames.push((time_s, (k == 0 || k % 2 == 1).then_some(seen)));
    }
    let walk = followed(ACROSS, &frames, options);
    let filtered: Vec<_> = walk.steps().iter().map(|s| s.state.along).collect();
    let smoothed = smooth(&filtered, &[0.04; 499], &options.filter.along);
    for (row, state) in walk.rows().iter().zip(smoothed).step_by(50) {
        let scale = (row.sd[0].powi(2) - 0.015f64.powi(2)).sqrt() / state.position_sd();
        assert!((0.9..1.1).contains(&scale), "{scale}");
    }
}

#[test]
fn a_perfect_fit_leaves_the_errors_common_to_all_frames() {
    let walk = followed(ACROSS, &exact(&uneven_s(20)), WalkOptions::default());
    for row in walk.rows() {
        let off = [row.sd[0] - 0.015, row.sd[1], row.sd[2] - 0.02, row.sd[3] - 0.015];
        assert!(off.iter().all(|x| x.abs() < 1e-6), "{row:?}");
    }
    // One frame has no prediction to be compared with: 0.04 / 2 m² after its measurement.
    let alone = followed(ACROSS, &exact(&[0.0]), WalkOptions::default()).rows();
    assert!((alone[0].sd[0] - 0.02f64.sqrt().hypot(0.015)).abs() < 1e-9, "{alone:?}");
}

#[test]
fn an_uncertain_distance_shows_across_the_path_and_far_from_the_camera_along_it() {
    // The camera is at (0, -6): the path crosses its axis at along 0, 6 m away.
    let mut walk = followed(ACROSS, &exact(&[0.0, 0.5, 1.0, 2.0]), WalkOptions::default());
    walk.depth_sd_m = 0.3;
    for row in walk.rows() {
        let along = (0.3 / 6.0 * row.hypothesis.along_m).hypot(0.015);
        assert!((row.sd[0] - along).abs() < 1e-6 && (row.sd[1] - 0.3).abs() < 1e-9, "{row:?}");
    }
    // Rotated by 30 degrees about (0, 0): 6 cos 30 away, nearest at 6 sin 30 behind the origin.
    let turned = Path { heading_rad: 30f64.to_radians(), ..ACROSS };
    let mut walk = followed(turned, &exact(&[0.0, 0.5, 1.0, 2.0]), WalkOptions::default());
    walk.depth_sd_m = 0.3;
    let (sine, cosine) = 30f64.to_radians().sin_cos();
    for row in walk.rows() {
        let along = (0.3 / (6.0 * cosine) * (row.hypothesis.along_m + 6.0 * sine)).hypot(0.015);
        let wanted = [(cosine * along).hypot(sine * 0.3), (sine * along).hypot(cosine * 0.3)];
        assert!((row.sd[0] - wanted[0]).abs() < 1e-6 && (row.sd[1] - wanted[1]).abs() < 1e-6, "{row:?}");
    }
}

#[test]
fn events_are_where_the_phase_passes_their_marks() {
    let times_s = uneven_s(50);
    let walk = followed(ACROSS, &exact(&times_s), WalkOptions::default());
    // The left foot is half a cycle later. When feet leave the ground, the phase does not show.
    let marks = [(0.0, EventKind::HeelStrike, Side::Right), (0.5, EventKind::HeelStrike, Side::Left)];
    let mut expected = Vec::new();
    for (mark, kind, side) in marks {
        for turn in 0..4 {
            let time_s = (f64::from(turn) + mark - 0.3) / 0.9;
            if (times_s[0]..times_s[49]).contains(&time_s) {
                expected.push((time_s, kind, side));
            }
        }
    }
    expected.sort_by(|a, b| a.0.total_cmp(&b.0));
    let events = walk.events();
    assert_eq!(events.len(), expected.len(), "{events:?}");
    for (event, (time_s, kind, side)) in events.iter().zip(expected) {
        assert!((event.time_s - time_s).abs() < 1e-6, "{event:?} at {time_s}");
        assert_eq!((event.kind, event.side), (kind, side));
        // Only every second frame has a number.
        let after = times_s.partition_point(|t| *t <= time_s);
        let share = (time_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1]);
        assert!((event.frame - (5.0 + 2.0 * (after as f64 - 1.0 + share))).abs() < 1e-5, "{event:?}");
    }
}

#[test]
fn walking_backwards_has_no_events_and_a_negative_speed() {
    let times_s: Vec<f64> = (0..40).map(|k| 0.04 * f64::from(k)).collect();
    let back = |t: &f64| {
        let h = truth(*t);
        (*t, Some(Hypothesis { along_m: -h.along_m, phase: 3.0 - h.phase, ..h }))
    };
    let mut walk = followed(ACROSS, &times_s.iter().map(back).collect::<Vec<_>>(), WalkOptions::default());
    assert!(!walk.events().is_empty());
    walk.start.direction = Direction::Backward;
    assert!(walk.events().is_empty() && walk.direction() == Direction::Backward);
    assert!(walk.rows().iter().skip(10).all(|row| row.speed_mps < -0.5));
}

#[test]
fn a_mark_is_passed_once_forwards_backwards_and_through_the_turn() {
    let row = followed(ACROSS, &exact(&[0.0]), WalkOptions::default()).rows()[0];
    let at = |phase: f64| Row { phase, ..row };
    let passed = |from: f64, to: f64, mark: f64| crossing(&at(from), &at(to), mark);
    for (from, to, mark, share) in [
        (0.4375, 0.5625, 0.5, 0.5),
        (0.5625, 0.4375, 0.5, 0.5),
        (0.96875, 0.09375, 0.0, 0.25),
        (0.09375, 0.96875, 0.0, 0.75),
        (0.96875, 0.09375, 0.0625, 0.75),
    ] {
        let found = passed(from, to, mark).expect("passed");
        assert!((found - share).abs() < 1e-12, "{from} to {to}: {found}");
    }
    // A crossing exactly at a row belongs to the interval after it.
    assert_eq!((passed(0.5, 0.5625, 0.5), passed(0.4375, 0.5, 0.5)), (Some(0.0), None));
    assert_eq!((passed(0.4375, 0.5625, 0.0), passed(0.4375, 0.4375, 0.5)), (None, None));
    assert_eq!((passed(0.5, 0.5, 0.5), passed(0.25, 0.375, 0.5)), (None, None));
}

#[test]
fn rows_are_of_the_better_twin() {
    let mut walk = followed(ACROSS, &exact(&[0.0, 0.1, 0.2]), WalkOptions::default());
    walk.walk.twins[1] = walk.walk.twins[0].clone();
    walk.walk.twins[1].steps.iter_mut().for_each(|step| step.frame += 100);
    walk.walk.twins[1].similarity_sum = 6.0;
    assert_eq!(walk.rows()[0].frame, 105);
    assert_eq!(walk.steps()[2].frame, 109);
    assert!(walk.p_swapped() < 0.5);
}

#[test]
fn an_assumed_height_widens_places_in_proportion_to_their_distance() {
    let frames: Vec<_> = uneven_s(20).into_iter().map(|time_s| (time_s, Some(truth(time_s)))).collect();
    let mut walk = followed(ACROSS, &frames, WalkOptions::default());
    let known = walk.rows();
    walk.height = BodyHeight::POPULATION;
    for (known, assumed) in known.iter().zip(walk.rows()) {
        let scale_sd = 0.1 / 1.7;
        let expected = known.sd[2].hypot(scale_sd * assumed.torso_centre.z);
        assert!((assumed.sd[2] - expected).abs() < 1e-12, "{assumed:?}");
        assert_eq!(known.torso_centre, assumed.torso_centre);
    }
}

/// A focal length that is 18 % longer puts everybody 18 % farther from the camera, and the origin too.
#[test]
fn an_assumed_camera_widens_places_by_their_depth_behind_the_first() {
    let frames: Vec<_> = uneven_s(20).into_iter().map(|time_s| (time_s, Some(truth(time_s)))).collect();
    for heading_rad in [0.0, 0.5, -1.1] {
        let path = Path { heading_rad, ..ACROSS };
        let mut walk = followed(path, &frames, WalkOptions::default());
        let known = walk.rows();
        walk.tilt = Some(tilt_of_lines(&[], [640, 480], 500.0));
        let eye = walk.camera.position();
        let view = (walk.camera.rotation.transpose() * DVec3::Z).truncate().normalize();
        for (known, assumed) in known.iter().zip(walk.rows()) {
            let depth_m = |place: DVec2| (place - eye.truncate()).dot(view);
            let place = known.torso_centre.truncate();
            let moved = (1.18 - 1.0) * (depth_m(place) - depth_m(DVec2::ZERO)) * view;
            for axis in 0..2 {
                let expected = known.sd[axis].hypot(moved[axis]);
                assert!((assumed.sd[axis] - expected).abs() < 1e-9, "{heading_rad}: {assumed:?}");
            }
            assert_eq!(known.sd[2..], assumed.sd[2..]);
        }
        let walk = fitted(walk, 0.0);
        let [along, across, ..] = walk.mean_sd().unwrap().place;
        let mean = walk.rows().iter().map(|row| row.torso_centre.truncate()).sum::<DVec2>() / 20.0;
        let moved = 0.18 * mean.dot(view);
        let [other_along, other_across, ..] = TrackedWalk { tilt: None, ..walk }.mean_sd().unwrap().place;
        let added_sq = along.powi(2) - other_along.powi(2) + across.powi(2) - other_across.powi(2);
        assert!((added_sq - moved.powi(2)).abs() < 1e-9, "{heading_rad}: {added_sq} {moved}");
    }
}

/// A walk that begins so far ahead of others, after so many frames.
pub fn beside(ahead_m: f64, first: usize, count: usize) -> TrackedWalk {
    let at =
        |k: usize| Hypothesis { along_m: ahead_m + 0.048 * k as f64, height_m: 1.2, phase: 0.036 * k as f64 };
    let frames: Vec<_> = (first..first + count).map(|k| (0.04 * k as f64, Some(at(k)))).collect();
    let mut walk = followed(ACROSS, &frames, WalkOptions::default());
    walk.walk.twins.iter_mut().flat_map(|twin| &mut twin.steps).for_each(|step| step.frame += 2 * first);
    walk
}

/// The same with a fit, of which this share of the outline found no edge.
pub fn fitted(walk: TrackedWalk, missed: f64) -> TrackedWalk {
    let frame = |row: &Row| FittedFrame {
        torso_centre: row.torso_centre,
        heading_rad: row.heading_rad,
        along_m: 0.0,
        phase: row.phase,
        posture: row.posture,
        measured: Default::default(),
        sd: [0.01; 4],
    };
    let fit = WalkFit {
        body: walk.walk.walker.body,
        height: None,
        route: walk.walk.route.clone(),
        curves: std::array::from_fn(|_| vec![0.0; 50]),
        mean_sd: MeanSd::default(),
        frames: walk.rows().iter().map(frame).collect(),
        contacts: Vec::new(),
        p_swapped: 0.0,
        mirrored: None,
        belt: None,
        quality: FitQuality {
            residual_px: 0.5,
            height_px: 200.0,
            missed,
            missed_inside: missed,
            worst_length_sd: 1.0,
            sole_m: None,
            crown_off: None,
            total_cost: 150.0,
            cost: 3000.0,
            parts: [None; 14],
        },
    };
    TrackedWalk { fit: Some(Ok(fit)), ..walk }
}

/// The twins' similarities tell the sides of a model that is on the person only.
#[test]
fn a_model_that_does_not_fit_leaves_the_sides_open() {
    let walk = |fit: Option<FitError>| {
        let walk = followed(ACROSS, &exact(&uneven_s(40)), WalkOptions::default());
        TrackedWalk { fit: fit.map(Err), ..walk }
    };
    let [unfitted, short] = [None, Some(FitError::TooFewFrames { got: 3 })].map(|fit| walk(fit).p_swapped());
    assert!(unfitted < 0.49 && short == unfitted, "{unfitted} {short}");
    let off = walk(Some(FitError::Misfit { missed: 0.43, residual: 0.014 }));
    assert_eq!(off.p_swapped(), 0.5);
    assert!(off.rows().iter().all(|row| row.p_swapped == 0.5));
}
