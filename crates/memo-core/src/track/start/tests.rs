use super::super::search::tests::{camera, edges_of, walker};
use super::*;
use crate::image::Rectangle;
use glam::DVec2;

/// A similarity curve with a peak at `phase` and a lower peak half a cycle later.
fn curve(time_s: f64, phase: f64, twin: f32) -> PhaseCurve {
    let bump = |p: f64| (-0.5 * ((p - p.round()) / 0.05).powi(2)).exp() as f32;
    let scores = (0..50)
        .map(|i| f64::from(i) / 50.0)
        .map(|p| 0.1 + 0.3 * bump(p - phase) + 0.3 * twin * bump(p - phase - 0.5));
    PhaseCurve { time_s, scores: scores.collect() }
}

#[test]
fn a_planted_line_is_found_though_single_frames_lie() {
    // Every fourth frame prefers the twin.
    let curves: Vec<_> = (0..13)
        .map(|k| {
            let t = f64::from(k) * 0.04;
            curve(t, 0.3 + 0.95 * t, if k % 4 == 0 { 1.2 } else { 0.8 })
        })
        .collect();
    let lines = phase_lines(&curves, &CadenceRange::default()).unwrap();
    assert!(
        (lines.best.phase_at_start - 0.3).abs() < 0.02 && (lines.best.rate_hz - 0.95).abs() < 0.05,
        "{lines:?}"
    );
    assert!((lines.twin.phase_at_start - 0.8).abs() < 0.02 && lines.twin.similarity < lines.best.similarity);

    let estimates: Vec<_> = curves
        .iter()
        .map(|c| PhaseEstimate { time_s: c.time_s, phase: c.best_phase(), similarity: c.at(c.best_phase()) })
        .collect();
    let choice = two_line_rule(&estimates, &CadenceRange::default()).unwrap();
    assert!((choice.line.phase_at_start - 0.3).abs() < 0.02 && (choice.line.rate_hz - 0.95).abs() < 0.08);
    assert_eq!(choice.on_line.iter().filter(|on| !**on).count(), 4);
}

/// Half a cycle in 13 frames fits a walker; a constant phase fits a person who keeps one posture.
#[test]
fn one_phase_explains_who_does_not_walk() {
    let curves = |rate_hz: f64| -> Vec<PhaseCurve> {
        (0..13).map(|k| 0.04 * f64::from(k)).map(|t| curve(t, 0.3 + rate_hz * t, 0.5)).collect()
    };
    let frozen = frozen_line(&curves(0.0)).unwrap();
    assert!((frozen.phase_at_start - 0.3).abs() < 0.006 && frozen.rate_hz == 0.0, "{frozen:?}");
    assert!((frozen.similarity - 0.4).abs() < 1e-3, "the mean over frames: {frozen:?}");
    for (rate_hz, walks) in [(0.95, true), (0.0, false), (0.1, false)] {
        let curves = curves(rate_hz);
        let line = phase_lines(&curves, &CadenceRange::default()).unwrap().best;
        assert_eq!(line.similarity > frozen_line(&curves).unwrap().similarity, walks, "{rate_hz}");
    }
    assert_eq!(frozen_line(&[]), None);
}

fn estimate(time_s: f64, phase: f64, similarity: f64) -> PhaseEstimate {
    PhaseEstimate { time_s, phase: phase.rem_euclid(1.0), similarity }
}

/// Estimates on a line; those marked in `off` are half a cycle away and have their own similarity.
fn mixed(phase0: f64, rate_hz: f64, off: &[bool], [on, beside]: [f64; 2]) -> Vec<PhaseEstimate> {
    let one = |(k, off): (usize, &bool)| {
        let t = 0.04 * k as f64;
        let phase = phase0 + rate_hz * t;
        if *off { estimate(3.0 + t, phase + 0.5, beside) } else { estimate(3.0 + t, phase, on) }
    };
    off.iter().enumerate().map(one).collect()
}

#[test]
fn the_two_lines_are_found_wherever_in_the_cycle_they_start() {
    let off = [false, false, true, false, false, false, true, false, false, false, false, true];
    for step in 0..40 {
        let phase0 = f64::from(step) / 40.0;
        let choice = two_line_rule(&mixed(phase0, 0.93, &off, [0.9, 0.4]), &CadenceRange::default()).unwrap();
        assert_eq!(choice.on_line, off.map(|off| !off), "from {phase0}");
        let (apart, rate_hz) = (choice.line.phase_at_start - phase0, choice.line.rate_hz);
        assert!(
            (apart - apart.round()).abs() < 1e-9 && (rate_hz - 0.93).abs() < 1e-9,
            "from {phase0}: {choice:?}"
        );
    }
}

#[test]
fn twice_as_many_estimates_win_whatever_their_similarity() {
    let (x, o) = (true, false);
    // 8 against 4: exactly half is not higher than half.
    let half = [o, o, x, o, o, x, o, o, x, o, o, x];
    let choice = two_line_rule(&mixed(0.2, 1.0, &half, [0.3, 0.9]), &CadenceRange::default()).unwrap();
    assert!(!choice.by_similarity && choice.on_line == half.map(|off| !off), "{choice:?}");
    assert!((choice.line.phase_at_start - 0.2).abs() < 1e-6 && choice.line.similarity == 0.3);
    // 7 against 5.
    let more = [o, o, x, o, o, x, o, x, x, o, o, x];
    let choice = two_line_rule(&mixed(0.2, 1.0, &more, [0.3, 0.9]), &CadenceRange::default()).unwrap();
    assert!(choice.by_similarity && choice.on_line == more, "{choice:?}");
    assert!((choice.line.phase_at_start - 0.7).abs() < 1e-6 && choice.line.similarity == 0.9);
}

#[test]
fn of_equal_means_the_voted_line_wins() {
    // The vote puts the line at 0.1, modulo half a cycle.
    let alternating: Vec<bool> = (0..12).map(|k| k % 2 == 1).collect();
    for (phase0, on_line) in [(0.1, true), (0.6, false)] {
        let estimates = mixed(phase0, 1.0, &alternating, [0.5, 0.5]);
        let choice = two_line_rule(&estimates, &CadenceRange::default()).unwrap();
        assert!(choice.by_similarity && (choice.line.phase_at_start - 0.1).abs() < 1e-6, "{choice:?}");
        assert_eq!(choice.on_line[0], on_line);
    }
}

#[test]
fn the_chosen_line_is_the_least_squares_line_through_its_estimates() {
    // Backward, across phase 0, at a rate between the steps of the search, with scatter.
    let scatter = [0.02, -0.01, 0.005, -0.02, 0.015, 0.0, -0.005, 0.01, -0.015, 0.02, -0.01, 0.0];
    let (rate_hz, phase0) = (-0.913, 0.05);
    let off = |k: usize| k == 4 || k == 7;
    let all: Vec<_> = scatter
        .iter()
        .enumerate()
        .map(|(k, e)| {
            (0.05 * k as f64, phase0 + rate_hz * 0.05 * k as f64 + e + if off(k) { 0.5 } else { 0.0 })
        })
        .collect();
    let estimates: Vec<_> = all.iter().map(|(t, phase)| estimate(*t, *phase, 0.4)).collect();
    let rates = CadenceRange { low_hz: -1.3, high_hz: -0.65 };
    let line = two_line_rule(&estimates, &rates).unwrap().line;
    let kept: Vec<_> = all.iter().enumerate().filter(|(k, _)| !off(*k)).map(|(_, p)| *p).collect();
    let design = nalgebra::DMatrix::from_fn(kept.len(), 2, |r, c| if c == 0 { 1.0 } else { kept[r].0 });
    let phases = nalgebra::DVector::from_fn(kept.len(), |r, _| kept[r].1);
    let fitted = design.svd(true, true).solve(&phases, 1e-12).unwrap();
    assert!((line.rate_hz - fitted[1]).abs() < 1e-9, "{line:?} against {fitted:?}");
    assert!((line.phase_at_start - fitted[0].rem_euclid(1.0)).abs() < 1e-9, "{line:?}");
    assert!((line.at(0.2) - (fitted[0] + 0.2 * fitted[1]).rem_euclid(1.0)).abs() < 1e-9);
}

#[test]
fn a_backward_line_is_found_among_backward_rates_only() {
    let curves: Vec<_> = (0..13)
        .map(|k| {
            let t = 5.0 + f64::from(k) * 0.05;
            curve(t, 0.2 - 0.9 * (t - 5.0), 0.5)
        })
        .collect();
    let backward = CadenceRange { low_hz: -1.3, high_hz: -0.65 };
    let lines = phase_lines(&curves, &backward).unwrap();
    assert!((lines.best.rate_hz + 0.9).abs() < 0.03 && (lines.best.phase_at_start - 0.2).abs() < 0.02);
    assert!((lines.twin.phase_at_start - 0.7).abs() < 0.02 && lines.twin.rate_hz == lines.best.rate_hz);
    let forward = phase_lines(&curves, &CadenceRange::default()).unwrap();
    assert!(forward.best.similarity < 0.9 * lines.best.similarity, "{forward:?}");
}

#[test]
fn of_equal_lines_the_slowest_at_the_first_phase_is_best() {
    let flat: Vec<_> =
        (0..5).map(|k| PhaseCurve { time_s: 0.04 * f64::from(k), scores: vec![0.25; 50] }).collect();
    let best = phase_lines(&flat, &CadenceRange::default()).unwrap().best;
    assert_eq!((best.phase_at_start, best.rate_hz, best.similarity), (0.0, 0.65, 0.25));
    assert_eq!(flat[0].best_phase(), 0.0);
    // One frame fits every rate.
    let one = [estimate(0.0, 0.3, 0.5)];
    assert_eq!(two_line_rule(&one, &CadenceRange::default()).unwrap().line.rate_hz, 0.65);
}

#[test]
fn a_curve_is_linear_between_its_phases_and_closed() {
    let curve = PhaseCurve { time_s: 0.0, scores: vec![0.1, 0.5, 0.3, 0.2] };
    for (phase, value) in
        [(0.0, 0.1), (0.25, 0.5), (0.125, 0.3), (0.375, 0.4), (0.875, 0.15), (-0.125, 0.15), (1.5, 0.3)]
    {
        assert!((curve.at(phase) - value).abs() < 1e-7, "{phase}: {}", curve.at(phase));
    }
    assert_eq!(curve.best_phase(), 0.25);
}

/// The report of a start that found this path and beginning, certain of the direction.
pub fn report(path: Path, beginning: Beginning, direction: Direction) -> StartReport {
    let line = PhaseLine { phase_at_start: beginning.phase, rate_hz: beginning.rate_hz, similarity: 0.5 };
    let twin = PhaseLine { phase_at_start: (beginning.phase + 0.5).rem_euclid(1.0), similarity: 0.4, ..line };
    StartReport {
        path,
        beginning,
        direction,
        p_other_direction: 0.01,
        lines: TwinLines { best: line, twin },
        other_direction: PhaseLine { rate_hz: -line.rate_hz, similarity: 0.3, ..line },
        frozen: PhaseLine { rate_hz: 0.0, similarity: 0.35, ..line },
        two_line_rule: TwoLineChoice { line, on_line: Vec::new(), by_similarity: false },
        curves: Vec::new(),
        frames: Vec::new(),
    }
}

/// Five frames of a walker's contours and the course from its rectangles; `forward`, or walking backward to the
/// right.
fn planted(forward: bool, rate_hz: f64) -> (Vec<FrameEdges>, Course, Camera) {
    let (walker, camera) = (walker(), camera());
    let heading_rad = if forward { 0.0 } else { std::f64::consts::PI };
    let sign = if forward { 1.0 } else { -1.0 };
    let path = Path { origin: DVec2::ZERO, heading_rad };
    let mut course = Course {
        path: Path { heading_rad: 0.0, ..path },
        along_m: Vec::new(),
        speed_mps: 1.2,
        depth_sd_m: 0.1,
    };
    let frame = |k: usize| {
        let elapsed_s = 0.1 * k as f64;
        let x_m = -0.4 + 1.2 * elapsed_s;
        course.along_m.push(x_m);
        let hypothesis = Hypothesis {
            along_m: sign * x_m,
            height_m: walker.level_torso_height_m(),
            phase: (0.2 + sign * rate_hz * elapsed_s).rem_euclid(1.0),
        };
        let edges = edges_of(&Scene::new(&walker, &camera, &path), &hypothesis);
        let window = Rectangle { left: 0, top: 0, right: 639, bottom: 479 };
        FrameEdges::of_one_alone(10 + k, 7.0 + elapsed_s, window, edges)
    };
    let frames = (0..5).map(frame).collect();
    (frames, course, camera)
}

#[test]
fn a_start_finds_place_speed_phase_rate_and_the_way_faced() {
    for (forward, rate_hz) in [(true, 0.9), (false, 0.8)] {
        let (frames, course, camera) = planted(forward, rate_hz);
        let options = WalkOptions::default();
        let frames: Vec<&FrameEdges> = frames.iter().collect();
        let found = start(&frames, &course, &walker(), &camera, &CadenceRange::default(), &options).unwrap();
        let (direction, sign) = if forward { (Direction::Forward, 1.0) } else { (Direction::Backward, -1.0) };
        assert_eq!(found.direction, direction);
        let b = found.beginning;
        assert!((found.path.direction().x - sign).abs() < 1e-9 && b.time_s == 7.0);
        assert!((b.along_m + sign * 0.4).abs() < 0.02, "{b:?}");
        assert!((b.speed_mps - sign * 1.2).abs() < 0.08, "{b:?}");
        assert!((b.phase - 0.2).abs() < 0.02 && (b.rate_hz - sign * rate_hz).abs() < 0.05, "{b:?}");
        assert!(found.p_other_direction < 0.5 && found.contrast() > 1.3);
        assert!((found.two_line_rule.line.rate_hz - sign * rate_hz).abs() < 0.1, "{:?}", found.two_line_rule);
        let other = found.other_direction;
        let p = swap_probability(found.lines.best.similarity, other.similarity, 0.4, &options.swap);
        assert!((found.p_other_direction - p).abs() < 1e-9 && other.rate_hz * sign < 0.0);
        assert_eq!(found.frames, [10, 11, 12, 13, 14]);
        assert_eq!((found.curves.len(), found.curves[0].scores.len()), (5, 50));
    }
}

/// A glance at all frames says what the whole start says; one at some of them leaves the result as it is.
#[test]
fn a_glance_is_a_start_on_some_of_the_frames() {
    for (forward, rate_hz) in [(true, 0.9), (false, 0.8)] {
        let (frames, course, camera) = planted(forward, rate_hz);
        let (options, rates) = (WalkOptions::default(), CadenceRange::default());
        let frames: Vec<&FrameEdges> = frames.iter().collect();
        let whole = start(&frames, &course, &walker(), &camera, &rates, &options).unwrap();
        let every = |every: usize| {
            let (frames, along_m) = (0..5).step_by(every).map(|k| (frames[k], course.along_m[k])).unzip();
            (frames, Course { along_m, ..course.clone() })
        };
        for n in [1, 2, 3] {
            let (some, course_of_some): (Vec<&FrameEdges>, Course) = every(n);
            let of_some = start(&some, &course_of_some, &walker(), &camera, &rates, &options).unwrap();
            let walker = walker();
            let mut search = StartSearch::new(&frames, &course, &walker, &camera, &rates, &options);
            let glance = search.glance(n).unwrap();
            let similarity = of_some.lines.best.similarity;
            assert_eq!(glance, Glance { similarity, contrast: of_some.contrast() }, "{n}");
            // Another gait is not looked at in the direction that is out.
            let mut crouched = StartSearch::new(&frames, &course, &walker, &camera, &rates, &options);
            crouched = crouched.after(&search);
            assert_eq!(crouched.glance(n), Some(glance));
            // In all frames only the direction that some of them left is looked at.
            let copy = search.clone();
            for started in [search, copy, crouched].map(|search| search.finish().unwrap()) {
                let other_direction = of_some.other_direction;
                let (here, there) = (whole.lines.best.similarity, other_direction.similarity);
                let p_other_direction = swap_probability(here, there, 0.4, &options.swap);
                assert!((started.p_other_direction / p_other_direction - 1.0).abs() < 1e-9, "{n}");
                let p_other_direction = started.p_other_direction;
                let expected = StartReport { p_other_direction, other_direction, ..whole.clone() };
                assert_eq!(started, expected, "{n}");
            }
        }
    }
}

#[test]
fn the_contrast_is_the_best_line_over_the_mean_of_all_phases() {
    let (frames, course, camera) = planted(true, 0.9);
    let frames: Vec<&FrameEdges> = frames.iter().take(2).collect();
    let options = WalkOptions::default();
    let mut found = start(&frames, &course, &walker(), &camera, &CadenceRange::default(), &options).unwrap();
    found.curves = vec![PhaseCurve { time_s: 0.0, scores: vec![0.1, 0.3, 0.5, 0.3] }];
    found.lines.best.similarity = 0.6;
    assert!((found.contrast() - 2.0).abs() < 1e-6);
    found.curves[0].scores.fill(0.0);
    assert_eq!(found.contrast(), 0.0);
}

#[test]
fn close_counts_are_decided_by_mean_similarity() {
    let estimate = |k: i32, off: f64, similarity: f64| {
        let time_s = f64::from(k) * 0.04;
        estimate(time_s, 0.1 + time_s + off, similarity)
    };
    let mixed: Vec<_> =
        (0..12).map(|k| if k % 2 == 0 { estimate(k, 0.0, 0.4) } else { estimate(k, 0.5, 0.3) }).collect();
    let choice = two_line_rule(&mixed, &CadenceRange::default()).unwrap();
    assert!(choice.by_similarity && (choice.line.phase_at_start - 0.1).abs() < 1e-6);
    let most: Vec<_> =
        (0..12).map(|k| if k < 2 { estimate(k, 0.0, 0.9) } else { estimate(k, 0.5, 0.3) }).collect();
    let choice = two_line_rule(&most, &CadenceRange::default()).unwrap();
    assert!(!choice.by_similarity && (choice.line.phase_at_start - 0.6).abs() < 1e-6);
}

#[test]
fn no_frames_no_line() {
    assert!(phase_lines(&[], &CadenceRange::default()).is_none());
    assert!(two_line_rule(&[], &CadenceRange::default()).is_none());
}
