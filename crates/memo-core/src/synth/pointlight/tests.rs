use super::super::motion::{SampledWalkOptions, sampled_walk};
use super::figure::Extent;
use super::*;
use crate::model::Camera;
use crate::model::{Body, Gait, GaitStyle, Walker};
use glam::DVec3;

/// One whole cycle of the model walking along X.
fn cycle() -> PointMotion {
    let body = Body::from_height(1.75).unwrap();
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let cycle_s = SampledWalkOptions::default().cycle_s(&walker);
    sampled_walk(&walker, &SampledWalkOptions { rate_hz: 60.0 / cycle_s, ..SampledWalkOptions::default() })
        .unwrap()
}

fn display(options: PointLightOptions) -> PointLightDisplay {
    point_light_display(&cycle(), &options).unwrap()
}

fn trajectory(display: &PointLightDisplay, dot: usize) -> Vec<DVec2> {
    display.positions_px.iter().skip(dot).step_by(display.dots).copied().collect()
}

#[test]
fn views_have_the_documented_axes() {
    let view = |azimuth_rad, elevation_rad| DisplayView::Orthographic {
        azimuth_rad,
        elevation_rad,
        px_per_m: 100.0,
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    for (view, x, y, z) in [
        (view(0.0, 0.0), [100.0, 0.0], [0.0, 0.0], [0.0, -100.0]),
        (view(quarter, 0.0), [0.0, 0.0], [100.0, 0.0], [0.0, -100.0]),
        (view(0.0, quarter), [100.0, 0.0], [0.0, -100.0], [0.0, 0.0]),
    ] {
        for (axis, wanted) in [(DVec3::X, x), (DVec3::Y, y), (DVec3::Z, z)] {
            assert!((view.project(axis).unwrap() - DVec2::from(wanted)).length() < 1e-9);
        }
    }
    // A camera far away agrees with the parallel projection.
    let camera = Camera::level([640, 480], 0.02, 1.0, 60.0).unwrap();
    let (middle, scale) = (camera.centre_px, camera.focal_px.x / 60.0);
    let point = DVec3::new(0.4, 0.2, 1.3);
    let parallel = DisplayView::Orthographic { azimuth_rad: 0.0, elevation_rad: 0.0, px_per_m: scale };
    let wanted = parallel.project(point).unwrap() - parallel.project(DVec3::Z).unwrap();
    let seen = DisplayView::Perspective(Box::new(camera)).project(point).unwrap() - middle;
    assert!((seen - wanted).length() < 0.005 * wanted.length(), "{seen} {wanted}");
}

#[test]
fn the_treadmill_keeps_the_bob_and_the_fixed_pelvis_does_not() {
    let at = |locomotion| display(PointLightOptions { locomotion, ..PointLightOptions::default() });
    let spread = |d: &PointLightDisplay, k| {
        let e = Extent::of(trajectory(d, k).into_iter());
        e.high - e.low
    };
    let hip = 6;
    let translating = spread(&at(Locomotion::Translating), hip);
    assert!(
        (translating.x - 200.0 * 1.3 * 59.0 / 60.0 * SampledWalkOptions::default().cycle_s(&walker())).abs()
            < 1.0
    );
    let treadmill = spread(&at(Locomotion::Treadmill), hip);
    assert!(treadmill.x < 1.0 && treadmill.y > 2.0, "{treadmill}");
    assert!(spread(&at(Locomotion::PelvisFixed), hip).length() < 1e-9);
}

fn walker() -> Walker {
    let body = Body::from_height(1.75).unwrap();
    Walker { body, gait: Gait::dense(), style: GaitStyle::default() }
}

#[test]
fn inversion_flips_up_and_down_only_and_mirroring_left_and_right_only() {
    let upright = display(PointLightOptions::default());
    let inverted = display(PointLightOptions { is_inverted: true, ..PointLightOptions::default() });
    let mirrored = display(PointLightOptions { is_mirrored: true, ..PointLightOptions::default() });
    let sums = |d: &PointLightDisplay| {
        let pairs = upright.positions_px.iter().zip(&d.positions_px);
        pairs.map(|(a, b)| (*a - *b, *a + *b)).collect::<Vec<_>>()
    };
    for (difference, sum) in sums(&inverted) {
        assert!(difference.x.abs() < 1e-9 && (sum.y - sums(&inverted)[0].1.y).abs() < 1e-9);
    }
    for (difference, sum) in sums(&mirrored) {
        assert!(difference.y.abs() < 1e-9 && (sum.x - sums(&mirrored)[0].1.x).abs() < 1e-9);
    }
    let reversed = display(PointLightOptions { is_reversed: true, ..PointLightOptions::default() });
    let (forth, mut back) = (trajectory(&upright, 2), trajectory(&reversed, 2));
    back.reverse();
    assert!(forth.iter().zip(&back).all(|(a, b)| (*a - *b).length() < 1e-9));
}

#[test]
fn scrambled_positions_keep_every_local_motion_and_stay_in_the_figure() {
    let upright = display(PointLightOptions::default());
    let scrambled = display(PointLightOptions {
        scrambles_position: Some(PositionScramble::default()),
        ..PointLightOptions::default()
    });
    let figure = Extent::of(upright.positions_px.iter().copied());
    let mut moved = 0;
    for k in 0..13 {
        let (before, after) = (trajectory(&upright, k), trajectory(&scrambled, k));
        let shift = after[0] - before[0];
        assert!(before.iter().zip(&after).all(|(a, b)| (*b - *a - shift).length() < 1e-9));
        moved += usize::from(shift.length() > 10.0);
    }
    assert!(moved > 9, "{moved} of 13 dots moved");
    let after = Extent::of(scrambled.positions_px.iter().copied());
    assert!(after.low.cmpge(figure.low - 2.0).all() && after.high.cmple(figure.high + 2.0).all());
}

#[test]
fn phase_scrambling_shifts_whole_cycles_without_a_jump_and_keeps_the_mean_places() {
    let options = PointLightOptions { locomotion: Locomotion::PelvisFixed, ..PointLightOptions::default() };
    let upright = display(options.clone());
    let scramble = Some(PhaseScramble::Periodic);
    let shifted = display(PointLightOptions { scrambles_phase: scramble, ..options });
    let mut shifts = Vec::new();
    for k in 0..13 {
        let (before, after) = (trajectory(&upright, k), trajectory(&shifted, k));
        let equal = |s: usize| (0..60).all(|t| (before[(t + s) % 60] - after[t]).length() < 1e-9);
        shifts.extend((0..60).find(|&s| equal(s)));
    }
    assert_eq!(shifts.len(), 13, "every trajectory is a rotation of its own: {shifts:?}");
    shifts.sort_unstable();
    shifts.dedup();
    assert!(shifts.len() > 7);
    // With a translating walker the forward motion is not shifted, so steps stay small at the seam.
    let walking = display(PointLightOptions {
        locomotion: Locomotion::Translating,
        scrambles_phase: scramble,
        ..PointLightOptions::default()
    });
    for k in 0..13 {
        let steps = trajectory(&walking, k).windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f64::max);
        assert!(steps < 20.0, "dot {k} jumps {steps} px");
    }
    let shortened = Some(PhaseScramble::Shortened { max_shift_s: 0.3 });
    let shorter = display(PointLightOptions { scrambles_phase: shortened, ..PointLightOptions::default() });
    assert!(shorter.times_s.len() < 60 && shorter.times_s.len() > 35);
}

#[test]
fn dots_on_joints_live_their_frames_and_never_share_a_joint() {
    let life = LimitedLife { dots: 6, frames: 3, sites: LifeSites::Joints, synchronous: false };
    let shown = display(PointLightOptions { limited_life: Some(life), ..PointLightOptions::default() });
    let all = display(PointLightOptions::default());
    let joint = |t: usize, dot: usize| match shown.sources[t * 6 + dot] {
        DotSource::Joint(k) => k,
        other => panic!("{other:?}"),
    };
    let mut jumps_a_frame = Vec::new();
    for t in 0..60 {
        let mut taken: Vec<usize> = (0..6).map(|dot| joint(t, dot)).collect();
        for (dot, &k) in taken.iter().enumerate() {
            assert_eq!(shown.at(t, dot), all.at(t, k));
        }
        taken.sort_unstable();
        taken.dedup();
        assert_eq!(taken.len(), 6, "two dots on one joint");
        if t > 0 {
            jumps_a_frame.push((0..6).filter(|&dot| joint(t, dot) != joint(t - 1, dot)).count());
        }
    }
    for dot in 0..6 {
        let jumps: Vec<usize> = (1..60).filter(|&t| joint(t, dot) != joint(t - 1, dot)).collect();
        assert!(jumps.windows(2).all(|w| w[1] - w[0] == 3), "a lifetime other than 3 frames");
    }
    assert_eq!(jumps_a_frame[..3].iter().sum::<usize>(), 6, "every dot jumps once in three frames");
}

#[test]
fn dots_on_limbs_lie_on_them_all_along() {
    let life = LimitedLife { frames: 4, synchronous: true, ..LimitedLife::default() };
    let shown = display(PointLightOptions { limited_life: Some(life), ..PointLightOptions::default() });
    let all = display(PointLightOptions::default());
    for t in 0..60 {
        for dot in 0..8 {
            let DotSource::Limb([a, b], fraction) = shown.sources[t * 8 + dot] else { panic!() };
            assert!((0.0..1.0).contains(&fraction) && b == a + 1);
            let (p, a, b) = (shown.at(t, dot).unwrap(), all.at(t, a).unwrap(), all.at(t, b).unwrap());
            assert!((p.distance(a) + p.distance(b) - a.distance(b)).abs() < 1e-9);
            let has_jumped = t > 0 && shown.sources[t * 8 + dot] != shown.sources[(t - 1) * 8 + dot];
            assert_eq!(has_jumped, t > 0 && t % 4 == 0);
        }
    }
}

#[test]
fn noise_dots_copy_local_motions_or_drift_or_flicker() {
    let with = |kind| {
        let noise_dots = Some(NoiseDots { count: 26, kind, area_scale: 2.0 });
        display(PointLightOptions { noise_dots, ..PointLightOptions::default() })
    };
    let masked = with(NoiseKind::ScrambledWalker);
    assert_eq!(masked.dots, 39);
    for dot in 13..39 {
        let DotSource::Noise(Some(k)) = masked.sources[dot] else { panic!() };
        let (copy, original) = (trajectory(&masked, dot), trajectory(&masked, k));
        assert!((1..60).all(|t| (copy[t] - copy[0] - original[t] + original[0]).length() < 1e-9));
    }
    let drifting = with(NoiseKind::Linear { speed_px_s: 60.0 });
    let step = trajectory(&drifting, 20).windows(2).map(|w| w[0].distance(w[1])).fold(f64::MAX, f64::min);
    let interval_s = drifting.times_s[1];
    assert!((step - 60.0 * interval_s).abs() < 1e-9);
    let flicker = trajectory(&with(NoiseKind::Flicker), 20);
    assert!(flicker.windows(2).all(|w| w[0] != w[1]));
}

#[test]
fn seeds_repeat_and_options_do_not_disturb_each_other() {
    let options = PointLightOptions {
        seed: 3,
        scrambles_position: Some(PositionScramble::default()),
        noise_dots: Some(NoiseDots::default()),
        noise_sd_px: 1.0,
        ..PointLightOptions::default()
    };
    assert_eq!(display(options.clone()), display(options.clone()));
    assert_ne!(display(options.clone()), display(PointLightOptions { seed: 4, ..options.clone() }));
    let (noisy, clean) =
        (display(options.clone()), display(PointLightOptions { noise_sd_px: 0.0, ..options }));
    let differences: Vec<f64> =
        noisy.positions_px.iter().zip(&clean.positions_px).flat_map(|(a, b)| (*a - *b).to_array()).collect();
    let sd = (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64).sqrt();
    assert!((sd - 1.0).abs() < 0.05, "{sd}");
}

#[test]
fn unknown_points_are_unseen_dots() {
    let mut positions = cycle().positions().to_vec();
    positions[2] = DVec3::NAN;
    let motion = PointMotion::new(positions, cycle().names().to_vec(), cycle().times_s().to_vec()).unwrap();
    let noise_dots = Some(NoiseDots::default());
    let options = PointLightOptions {
        scrambles_position: Some(PositionScramble::default()),
        noise_dots,
        ..PointLightOptions::default()
    };
    let shown = point_light_display(&motion, &options).unwrap();
    assert!(shown.at(0, 2).is_none() && shown.at(1, 2).is_some() && shown.at(0, 3).is_some());
    let nothing = motion.map(|_, _, _| DVec3::NAN);
    assert_eq!(point_light_display(&nothing, &options), Err(PointLightError::NothingSeen));
    let behind = DisplayView::Perspective(Box::new(Camera::level([64, 48], 1.0, 1.0, 5.0).unwrap()));
    let away = motion.map(|_, _, p| p - DVec3::Y * 20.0);
    let options = PointLightOptions { view: behind, ..options };
    assert_eq!(point_light_display(&away, &options), Err(PointLightError::NothingSeen));
}

#[test]
fn bad_options_are_refused_with_their_values() {
    let refused =
        |options: PointLightOptions| point_light_display(&cycle(), &options).unwrap_err().to_string();
    let fresh = PointLightOptions::default;
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(refused(PointLightOptions { noise_sd_px: bad, ..fresh() }).contains("noise_sd_px"));
        let view = DisplayView::Orthographic { azimuth_rad: 0.0, elevation_rad: 0.0, px_per_m: bad };
        assert!(refused(PointLightOptions { view, ..fresh() }).contains("pixels per metre"));
        let noise_dots = Some(NoiseDots { area_scale: bad, ..NoiseDots::default() });
        assert!(refused(PointLightOptions { noise_dots, ..fresh() }).contains("area_scale"));
        let scrambles_phase = Some(PhaseScramble::Periodic);
        refused(PointLightOptions { scrambles_phase, period_s: Some(bad), ..fresh() });
        let scramble = PositionScramble { limit_px: Some(bad), ..PositionScramble::default() };
        let said = refused(PointLightOptions { scrambles_position: Some(scramble), ..fresh() });
        assert!(said.contains("scramble_limit_px"));
        let repeated = CycleOptions { tempo: bad, cycles: 1 };
        assert!(refused(PointLightOptions { cycles: Some(repeated), ..fresh() }).contains("tempo"));
    }
    assert!(refused(PointLightOptions { period_s: Some(1.0), ..fresh() }).contains("only with cycles"));
    assert!(refused(PointLightOptions { cycle_start_s: Some(0.0), ..fresh() }).contains("only with cycles"));
    for bad in [f64::NAN, -1.0, 1.0] {
        let cycles = Some(CycleOptions::default());
        assert!(
            refused(PointLightOptions { cycles, cycle_start_s: Some(bad), ..fresh() })
                .contains("cycle_start_s")
        );
    }
    let none = CycleOptions { cycles: 0, tempo: 1.0 };
    assert!(refused(PointLightOptions { cycles: Some(none), ..fresh() }).contains("cycles"));
    let endless = CycleOptions { cycles: usize::MAX, tempo: 1.0 };
    assert!(refused(PointLightOptions { cycles: Some(endless), ..fresh() }).contains("too many"));
    let scrambles_phase = Some(PhaseScramble::Shortened { max_shift_s: 1e9 });
    assert!(refused(PointLightOptions { scrambles_phase, ..fresh() }).contains("longer motion"));
    let life = LimitedLife { dots: 13, sites: LifeSites::Joints, ..LimitedLife::default() };
    assert!(refused(PointLightOptions { limited_life: Some(life), ..fresh() }).contains("nowhere to jump"));
    let life = LimitedLife { sites: LifeSites::Limbs(vec![[0, 99]]), ..LimitedLife::default() };
    assert!(refused(PointLightOptions { limited_life: Some(life), ..fresh() }).contains("99"));
    let noise_dots = Some(NoiseDots { count: usize::MAX, ..NoiseDots::default() });
    assert!(refused(PointLightOptions { noise_dots, ..fresh() }).contains("too many"));
    let one = PointMotion::new(vec![DVec3::ZERO], vec!["dot".into()], vec![0.0]).unwrap();
    let fixed = PointLightOptions { locomotion: Locomotion::PelvisFixed, ..fresh() };
    assert_eq!(
        point_light_display(&one, &fixed).unwrap_err().to_string(),
        "locomotion \"pelvis\" needs a right and a left hip: names such as RHP and LHP wanted, got dot"
    );
    let everything = PointLightOptions {
        scrambles_position: Some(PositionScramble::default()),
        is_inverted: true,
        is_reversed: true,
        scrambles_phase: Some(PhaseScramble::Periodic),
        noise_dots: Some(NoiseDots { kind: NoiseKind::Linear { speed_px_s: 9.0 }, ..NoiseDots::default() }),
        ..fresh()
    };
    assert_eq!(point_light_display(&one, &everything).unwrap().dots, 41);
}

/// A recording of 2.6 cycles that does not repeat itself exactly: it drifts, sways and becomes faster.
fn recording() -> PointMotion {
    let options = SampledWalkOptions { frames: 170, ..SampledWalkOptions::default() };
    let walk = sampled_walk(&walker(), &options).unwrap();
    walk.map(|t, k, p| {
        let t = t as f64;
        p + DVec3::new(3e-7 * t * t, 0.02 * (0.031 * t).sin(), 4e-5 * t * (k % 3) as f64)
    })
}

#[test]
fn a_cycle_repeats_without_a_jump_and_keeps_its_period() {
    let cycle_s = SampledWalkOptions::default().cycle_s(&walker());
    let repeated = CycleOptions { cycles: 3, tempo: 1.0 };
    for locomotion in [Locomotion::Treadmill, Locomotion::PelvisFixed, Locomotion::Translating] {
        let options =
            PointLightOptions { cycles: Some(repeated), locomotion, ..PointLightOptions::default() };
        let shown = point_light_display(&recording(), &options).unwrap();
        let period_s = shown.period_s.unwrap();
        assert!((period_s - cycle_s).abs() < 0.02, "{period_s} instead of {cycle_s}");
        let frames = (period_s * 60.0).round() as usize;
        assert_eq!(shown.times_s.len(), 3 * frames);
        let advance = if locomotion == Locomotion::Translating { 1.3 * 200.0 * period_s } else { 0.0 };
        for k in 0..13 {
            let path = trajectory(&shown, k);
            let jump = path[frames] - path[0] - DVec2::X * advance;
            assert!(jump.length() < 0.02 * advance + 1e-9, "{locomotion:?}, dot {k}: {jump}");
            let bends: Vec<f64> = path.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).length()).collect();
            let largest = |from: usize, to: usize| bends[from..to].iter().copied().fold(0.0, f64::max);
            let (at_seam, within) = (largest(frames - 2, frames + 1), largest(0, frames - 2));
            assert!(at_seam <= 1.5 * within, "{locomotion:?}, dot {k}: {at_seam} after {within} px");
        }
    }
}

#[test]
fn actors_keep_their_timing_in_a_common_cycle() {
    let one = recording();
    let late = |frames: usize| {
        let at = |t: usize| one.positions()[t * 13..(t + 1) * 13].to_vec();
        let positions = (0..140).flat_map(|t| at(t + frames)).collect();
        PointMotion::new(positions, one.names().to_vec(), one.times_s()[..140].to_vec()).unwrap()
    };
    let (first, second) = (late(0), late(20));
    let cut = common_cycle(&[first.clone(), second.clone()], None).unwrap();
    let cycle_s = SampledWalkOptions::default().cycle_s(&walker());
    assert!((cut.period_s - cycle_s).abs() < 0.02, "{cut:?}");
    let options = PointLightOptions {
        cycles: Some(CycleOptions::default()),
        period_s: Some(cut.period_s),
        cycle_start_s: Some(cut.start_s),
        ..PointLightOptions::default()
    };
    let [shown, other] = [&first, &second].map(|motion| point_light_display(motion, &options).unwrap());
    let frames = shown.times_s.len();
    let apart = |shift: usize| -> f64 {
        let moved =
            |d: &PointLightDisplay, t: usize| d.at(t % frames, 8).unwrap() - d.at(t % frames, 6).unwrap();
        (0..frames).map(|t| (moved(&shown, t + shift) - moved(&other, t)).length_squared()).sum()
    };
    let best = (0..frames).min_by(|a, b| apart(*a).total_cmp(&apart(*b))).unwrap();
    assert!((19..=21).contains(&best), "{best} frames of {frames}");
    assert_eq!(common_cycle(&[], None), Err(PointLightError::NoActor));
    assert!(matches!(
        common_cycle(&[first, recording()], None),
        Err(PointLightError::Clocks { actor: 1, .. })
    ));
}

#[test]
fn a_tempo_changes_the_period_and_not_the_trajectory() {
    let at = |tempo| {
        let cycles = Some(CycleOptions { cycles: 1, tempo });
        point_light_display(&recording(), &PointLightOptions { cycles, ..PointLightOptions::default() })
            .unwrap()
    };
    let (usual, slow) = (at(1.0), at(0.5));
    assert!((slow.period_s.unwrap() - 2.0 * usual.period_s.unwrap()).abs() < 0.02);
    let places = |d: &PointLightDisplay, k| Extent::of(trajectory(d, k).into_iter());
    for k in 0..13 {
        let (a, b) = (places(&usual, k), places(&slow, k));
        assert!((a.low - b.low).length() < 1.0 && (a.high - b.high).length() < 1.0, "{a:?} {b:?}");
    }
}

#[test]
fn what_does_not_repeat_itself_has_no_period() {
    let mut random = Random::new(1);
    let wander = cycle().map(|_, _, p| p);
    let mut place = DVec3::ZERO;
    let positions = wander.positions().iter().map(|_| {
        place += DVec3::new(random.uniform(-1.0, 1.0), 0.0, random.uniform(-1.0, 1.0)) * 0.02;
        place
    });
    let motion =
        PointMotion::new(positions.collect(), wander.names().to_vec(), wander.times_s().to_vec()).unwrap();
    let cycles = Some(CycleOptions::default());
    let options = PointLightOptions { cycles, ..PointLightOptions::default() };
    let refused = point_light_display(&motion, &options).unwrap_err();
    assert!(matches!(refused, PointLightError::NoPeriod { .. }), "{refused}");
    assert!(point_light_display(&motion, &PointLightOptions { period_s: Some(0.5), ..options }).is_ok());
}

#[test]
fn scrambling_keeps_to_its_axis_and_its_limit() {
    let upright = display(PointLightOptions::default());
    for (axes, limit_px) in [
        (ScrambleAxes::Horizontal, None),
        (ScrambleAxes::Vertical, None),
        (ScrambleAxes::Both, Some(15.0)),
        (ScrambleAxes::Vertical, Some(15.0)),
    ] {
        let scrambles_position = Some(PositionScramble { axes, limit_px });
        let scrambled = display(PointLightOptions { scrambles_position, ..PointLightOptions::default() });
        let shifts: Vec<DVec2> =
            (0..13).map(|k| trajectory(&scrambled, k)[0] - trajectory(&upright, k)[0]).collect();
        let most = shifts.iter().fold(DVec2::ZERO, |most, shift| most.max(shift.abs()));
        assert_eq!(most.x > 1e-9, axes != ScrambleAxes::Vertical, "{most}");
        assert_eq!(most.y > 1e-9, axes != ScrambleAxes::Horizontal, "{most}");
        assert!(most.max_element() < limit_px.unwrap_or(400.0) + 1e-9 && most.max_element() > 10.0, "{most}");
    }
}

#[test]
fn controls_have_the_centre_of_their_walker() {
    let upright = display(PointLightOptions::default());
    let middle = Extent::of(upright.positions_px.iter().copied()).middle();
    assert!((upright.centre_px - middle).length() < 1e-9);
    for control in [
        PointLightOptions { is_inverted: true, is_mirrored: true, ..PointLightOptions::default() },
        PointLightOptions {
            scrambles_position: Some(PositionScramble::default()),
            ..PointLightOptions::default()
        },
        PointLightOptions { scrambles_phase: Some(PhaseScramble::Periodic), ..PointLightOptions::default() },
        PointLightOptions { noise_dots: Some(NoiseDots::default()), ..PointLightOptions::default() },
    ] {
        assert!((display(control).centre_px - middle).length() < 1e-9);
    }
}

#[test]
fn actors_keep_their_dots_and_what_they_show() {
    let (one, other) = (
        display(PointLightOptions::default()),
        display(PointLightOptions { noise_dots: Some(NoiseDots::default()), ..PointLightOptions::default() }),
    );
    let offsets = [DVec2::new(-90.0, 0.0), DVec2::new(90.0, 5.0)];
    let both = displays_together(&[one.clone(), other.clone()], &offsets).unwrap();
    assert_eq!([both.dots, both.points], [13 + 53, 26]);
    for t in [0, 31, 59] {
        assert_eq!(both.at(t, 4), one.at(t, 4).map(|p| p + offsets[0]));
        assert_eq!(both.at(t, 13 + 40), other.at(t, 40).map(|p| p + offsets[1]));
        assert_eq!(both.sources[t * both.dots + 15], DotSource::Joint(13 + 2));
    }
    let refused = |displays: &[PointLightDisplay], offsets: &[DVec2]| {
        displays_together(displays, offsets).unwrap_err().to_string()
    };
    assert!(refused(&[], &[]).contains("0 displays"));
    assert!(refused(std::slice::from_ref(&one), &[]).contains("1 display and 0 offsets"));
    assert!(refused(std::slice::from_ref(&one), &[DVec2::NAN]).contains("offsets_px"));
    let shorter = Some(PhaseScramble::Shortened { max_shift_s: 0.3 });
    let shorter = display(PointLightOptions { scrambles_phase: shorter, ..PointLightOptions::default() });
    assert!(refused(&[one, shorter], &offsets).contains("actor 1"));
}
