use super::super::fit::FitError;
use super::super::result;
use super::super::search::tests::walker;
use super::super::search::{Hypothesis, Path};
use super::super::start::tests::report;
use super::super::walk::tests::step_in;
use super::super::walk::{Beginning, Look, State, Walk, WalkOptions};
use super::*;
use crate::calibrate::tilt_of_lines;
use crate::estimate::kalman::ConstantVelocity;
use crate::synth::Random;
use glam::DVec2;
use std::collections::BTreeMap;

#[test]
fn the_quantile_of_student_s_t_is_that_of_the_tables() {
    for (freedom, table) in
        [(3.0, 3.182), (4.0, 2.776), (5.0, 2.571), (8.0, 2.306), (12.0, 2.179), (30.0, 2.042), (1e9, 1.960)]
    {
        assert!((student_quantile(freedom) - table).abs() < 0.004, "{freedom}");
    }
}

fn steps(times: [&[f64]; 2]) -> Vec<StepTaken> {
    let step =
        |side, time_s: &f64| StepTaken { side, time_s: *time_s, length_m: 1.3 * time_s, variance_s2: 0.0 };
    let [right, left] = times;
    let right = right.iter().map(|t| step(Side::Right, t));
    right.chain(left.iter().map(|t| step(Side::Left, t))).collect()
}

#[test]
fn sides_have_their_means_and_the_index_is_theirs() {
    let spread = Spread { prior_variance: 1e-4, side_sd: 0.008, scale_sd: 0.0 };
    let by = BySide::of(&steps([&[0.60, 0.62], &[0.50, 0.52, 0.54]]), |s| s.time_s, &spread);
    let [right, left] = by.mean.map(Option::unwrap);
    assert!((right.value - 0.61).abs() < 1e-12 && right.n == 2);
    assert!((left.value - 0.52).abs() < 1e-12 && left.n == 3);
    assert!(left.half < right.half);
    let symmetry = by.symmetry.unwrap();
    assert!((symmetry.value - 100.0 * 0.09 / 0.565).abs() < 1e-9 && symmetry.n == 5);
    // 4 prior steps and 3 degrees of freedom: s² = (4e-4 + 0.0002 + 0.0008) / 7.
    let scatter = student_quantile(7.0) * (0.0014 / 7.0 * (0.5 + 1.0 / 3.0f64)).sqrt();
    let wanted = 100.0 / 0.565 * scatter.hypot(Z * 8f64.sqrt() * 0.008);
    assert!((symmetry.half - wanted).abs() < 1e-9);
}

/// Contacts of simulated people: steps of 0.55 s vary by 3 %, each contact is off by 12 ms, and all of the right
/// side are late, relative to those of the left, by a number of its own for each person.
#[test]
fn intervals_of_fitted_steps_hold_the_truth_as_often_as_they_say() {
    let mut random = Random::new(5);
    let mut normal = |sd: f64| sd * f64::from(random.normal_pair()[0]);
    let (mut held, mut half_sum, mut error_sum_sq) = ([0; 3], [0.0; 3], [0.0; 3]);
    for _ in 0..2000 {
        let (late_right, uneven_s) = (normal(CONTACT_SIDE_SD_S), normal(0.03));
        let truth_s = [0.55 + uneven_s, 0.55 - uneven_s];
        let (mut time_s, mut strikes) = (0.0, Vec::new());
        for index in 0..7 {
            let right = index % 2 == 0;
            let side = if right { Side::Right } else { Side::Left };
            time_s += truth_s[usize::from(!right)] * (1.0 + normal(NATURAL_SHARE));
            let found_s = time_s + normal(CONTACT_SD_S) + if right { late_right } else { 0.0 };
            strikes.push(Contact { kind: EventKind::HeelStrike, side, time_s: found_s });
        }
        let strikes = fitted_strikes(&strikes, 1.0 / 1.1);
        let taken: Vec<StepTaken> = strikes
            .windows(2)
            .map(|pair| StepTaken {
                side: pair[1].side,
                time_s: pair[1].time_s - pair[0].time_s,
                length_m: 0.7,
                variance_s2: pair[0].variance_s2 + pair[1].variance_s2,
            })
            .collect();
        let prior_variance = 2.0 * CONTACT_SD_S.powi(2) + (NATURAL_SHARE * 0.55).powi(2);
        let spread = Spread { prior_variance, side_sd: contact_shift_sd_s(), scale_sd: 0.0 };
        let by = BySide::of(&taken, |s| s.time_s, &spread);
        let [right, left] = by.mean.map(Option::unwrap);
        let percent = 200.0 * (truth_s[0] - truth_s[1]) / 1.1;
        let found = [(right, truth_s[0]), (left, truth_s[1]), (by.symmetry.unwrap(), percent)];
        for (k, (estimate, truth)) in found.into_iter().enumerate() {
            held[k] += usize::from((estimate.value - truth).abs() <= estimate.half);
            half_sum[k] += estimate.half;
            error_sum_sq[k] += (estimate.value - truth).powi(2);
        }
    }
    for k in 0..3 {
        let width = half_sum[k] / 2000.0 / (Z * (error_sum_sq[k] / 2000.0).sqrt());
        assert!((1860..=1970).contains(&held[k]), "{k}: {}", held[k]);
        assert!((0.92..1.2).contains(&width), "{k}: {width}");
    }
}

#[test]
fn one_side_alone_has_a_mean_and_no_symmetry() {
    let spread = Spread { prior_variance: 1e-4, side_sd: 0.008, scale_sd: 0.02 };
    let by = BySide::of(&steps([&[0.6], &[]]), |s| s.length_m, &spread);
    assert!(by.mean[0].is_some() && by.mean[1].is_none() && by.symmetry.is_none());
    assert!(BySide::of(&[], |s| s.time_s, &spread).mean.iter().all(Option::is_none));
}

#[test]
fn the_interval_of_a_slope_shrinks_with_duration_and_steps() {
    let points = |n: usize| -> Vec<(f64, f64)> {
        (0..n)
            .map(|k| (0.04 * k as f64, 0.9 * 0.04 * k as f64 + if k % 2 == 0 { 0.01 } else { -0.01 }))
            .collect()
    };
    let (short, long) = (half_slope(&points(50), 3.5), half_slope(&points(100), 7.0));
    assert!((short / long - 2.0 * 2f64.sqrt()).abs() < 0.15, "{short} {long}");
}

/// Measurements of a frame: time, position along the path, phase.
type Measured = (f64, f64, f64);

/// Measurements as the tracker keeps them: filtered, with measured phases wrapped to the cycle.
fn tracked(measured: &[Measured], path: Path, direction: Direction) -> TrackedWalk {
    let (options, (first_s, along_m, phase)) = (WalkOptions::default(), measured[0]);
    let (last_s, last_m, last_phase) = measured[measured.len() - 1];
    let elapsed_s = last_s - first_s;
    let beginning = Beginning {
        time_s: first_s,
        along_m,
        phase,
        speed_mps: (last_m - along_m) / elapsed_s,
        rate_hz: (last_phase - phase) / elapsed_s,
    };
    let mut state = State {
        along: ConstantVelocity::new(along_m, beginning.speed_mps, 0.04, 0.13),
        height: ConstantVelocity::new(1.15, 0.0, 4e-4, 0.0),
        phase: ConstantVelocity::new(phase, beginning.rate_hz, 0.04, 0.07),
    };
    let mut before_s = first_s;
    let step = |(frame, &(time_s, along_m, phase)): (usize, &Measured)| {
        state = state.predict(time_s - before_s, &options.filter);
        before_s = time_s;
        state.along = state.along.update(along_m, &options.filter.along);
        state.phase = state.phase.update(phase, &options.filter.phase);
        let hypothesis = Hypothesis { along_m, height_m: 1.15, phase: phase.rem_euclid(1.0) };
        let as_filtered = step_in(frame, time_s, state);
        let look = Look { best: hypothesis, path, ..as_filtered.look };
        Step { measured: Some(hypothesis), look, ..as_filtered }
    };
    let mut walk = Walk::new(walker(), path, beginning);
    walk.twins[0].steps = measured.iter().enumerate().map(step).collect();
    walk.twins[0].similarity_sum = 0.5 * measured.len() as f64;
    TrackedWalk {
        depth_sd_m: 0.1,
        ..result::tests::tracked(walk, report(path, beginning, direction), options)
    }
}

const ACROSS: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };

/// A person who deviates from the average as stated in the head of the module, with simulated measurements.
/// Nothing here is computed by the code under test.
struct Simulated {
    walk: TrackedWalk,
    speed_mps: f64,
    stride_s: f64,
    /// Duration of the right step beyond half a stride, cycles.
    late_right: f64,
    /// Length of the right step beyond that duration times speed, metres.
    right_reach_m: f64,
}

impl Simulated {
    /// `slant_rad` makes the path oblique for a camera with assumed focal length.
    fn new(random: &mut Random, slant_rad: Option<f64>) -> Self {
        let mut normal = |sd: f64| sd * f64::from(random.normal_pair()[0]);
        let (speed_mps, stride_s) = (1.25 + normal(0.1), 1.05 + normal(0.06));
        // 1. People: step variability of 3 %, which itself varies by a third; strikes; reach; the body height
        //    given.
        let varies = (0.03 * (1.0 + normal(0.33))).max(0.005);
        let shown_late = normal(0.01);
        let strikes_late = normal(0.008) - normal(0.008);
        let right_reach_m = 1.35 * normal(0.012);
        let focal = 0.18 * slant_rad.unwrap_or(0.0).sin().powi(2);
        let distance_m = 6.0 * slant_rad.unwrap_or(0.0).cos();
        let scale = 1.0 + normal(0.1 / distance_m) + normal(0.015) + normal(focal);
        // 2. Steps: a right step ends at an even half cycle. Longer steps take longer.
        let (mut knots, mut ends_right) = (vec![(0.0, -1.6, 0.0)], false);
        for k in 1..=9 {
            let (time_s, place_m, _) = knots[knots.len() - 1];
            let share = if ends_right { 0.5 + shown_late } else { 0.5 - shown_late };
            let (longer, own) = (normal(1.0), normal(1.0));
            let duration_s = share * stride_s * (1.0 + varies * longer);
            let alike = 0.5 * longer + 0.75f64.sqrt() * own;
            let way_m = share * stride_s * speed_mps * (1.0 + varies * alike);
            knots.push((time_s + duration_s, place_m + way_m, 0.5 * f64::from(k)));
            ends_right = !ends_right;
        }
        // 3. Frames: noise correlated by a third between neighbours, and a deviation that repeats in every step.
        let (wave_phase, wave_m, turn) = (normal(0.006), normal(0.01), normal(3.0));
        let (mut off_phase, mut off_m) = (normal(0.008), normal(0.015));
        let mut measured = Vec::new();
        let mut time_s = 0.3 * stride_s;
        let end_s = time_s + 3.4;
        while time_s < end_s {
            let next = knots.partition_point(|knot| knot.0 <= time_s).min(knots.len() - 1);
            let ((t0, p0, c0), (t1, p1, c1)) = (knots[next - 1], knots[next]);
            let t = (time_s - t0) / (t1 - t0);
            let (place_m, cycles) = (p0 + t * (p1 - p0), c0 + t * (c1 - c0));
            off_phase = off_phase / 3.0 + normal(0.008 * (8.0f64 / 9.0).sqrt());
            off_m = off_m / 3.0 + normal(0.015 * (8.0f64 / 9.0).sqrt());
            let wave = (2.0 * std::f64::consts::TAU * cycles + turn).sin();
            measured.push((
                time_s,
                scale * place_m + off_m + wave_m * wave,
                cycles + off_phase + wave_phase * wave,
            ));
            time_s += 0.04;
        }
        let path = Path { heading_rad: slant_rad.unwrap_or(0.0), ..ACROSS };
        let mut walk = tracked(&measured, path, Direction::Forward);
        walk.tilt = slant_rad.map(|_| tilt_of_lines(&[], [640, 480], 500.0));
        Self { walk, speed_mps, stride_s, late_right: shown_late + strikes_late, right_reach_m }
    }

    /// The true value of the person, not of the observed steps.
    fn truth(&self, line: &GaitParameter) -> Option<f64> {
        let sign = match line.side {
            Some(Side::Right) => 1.0,
            Some(Side::Left) => -1.0,
            None => 0.0,
        };
        let (stride_s, stride_m) = (self.stride_s, self.stride_s * self.speed_mps);
        let step_s = |sign: f64| (0.5 + sign * self.late_right) * stride_s;
        let step_m = |sign: f64| self.speed_mps * step_s(sign) + sign * self.right_reach_m;
        Some(match line.quantity {
            GaitQuantity::Cadence => 120.0 / stride_s,
            GaitQuantity::Speed => self.speed_mps,
            GaitQuantity::StrideTime => stride_s,
            GaitQuantity::StrideLength => stride_m,
            GaitQuantity::StepTime => step_s(sign),
            GaitQuantity::StepLength => step_m(sign),
            GaitQuantity::StepTimeSymmetry => 200.0 * (step_s(1.0) - step_s(-1.0)) / stride_s,
            GaitQuantity::StepLengthSymmetry => 200.0 * (step_m(1.0) - step_m(-1.0)) / stride_m,
            _ => return None,
        })
    }
}

/// Coverage of the intervals of a parameter: errors and half widths in per cent of the truth; for symmetries in
/// their own unit.
#[derive(Default)]
struct Tally {
    held: usize,
    all: usize,
    half_sum: f64,
    error_sum_sq: f64,
}

fn tallied(people: &[Simulated]) -> BTreeMap<String, Tally> {
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    for person in people {
        for line in person.walk.gait_parameters() {
            let Some(truth) = person.truth(&line) else { continue };
            let side = line.side.map_or("", |side| if side == Side::Right { " right" } else { " left" });
            let tally = tallies.entry(format!("{}{side}", line.quantity.name())).or_default();
            let (Some(value), Some([low, high])) = (line.value, line.interval) else { continue };
            let per_cent = if line.quantity.unit() == "%" { 1.0 } else { 100.0 / truth };
            tally.held += usize::from(low <= truth && truth <= high);
            tally.all += 1;
            tally.half_sum += 0.5 * (high - low) * per_cent;
            tally.error_sum_sq += ((value - truth) * per_cent).powi(2);
        }
    }
    tallies
}

/// Checks that the intervals contain the truth about as often as stated, and that their width fits the errors: an
/// infinite interval always contains it.
fn assert_calibrated(
    people: &[Simulated],
    held: [f64; 2],
    width: [f64; 2],
    is_checked: impl Fn(&str) -> bool,
) {
    for (name, tally) in tallied(people).iter().filter(|(name, _)| is_checked(name)) {
        let n = tally.all as f64;
        assert!(n >= 0.99 * people.len() as f64, "{name} has {n} values only");
        let (share, half) = (tally.held as f64 / n, tally.half_sum / n);
        assert!(held[0] <= share && share <= held[1], "{name} holds the truth in {:.1} %", 100.0 * share);
        let needed = 1.96 * (tally.error_sum_sq / n).sqrt();
        assert!(
            (width[0]..width[1]).contains(&(half / needed)),
            "{name}: +-{half:.2} %, needed {needed:.2} %"
        );
    }
}

/// For 1,000 people the standard deviation is 0.7 % for a share of 95 % and 2.2 % for the size of the errors.
#[test]
fn intervals_hold_the_truth_of_simulated_people_as_often_as_they_say() {
    let mut random = Random::new(2);
    let people: Vec<Simulated> = (0..1000).map(|_| Simulated::new(&mut random, None)).collect();
    assert_calibrated(&people, [0.93, 0.98], [0.92, 1.15], |_| true);
    // Steps vary by 3 %, the slope over 2 * 3.4 / 1.05 of them by 1.3 %; the scale by 0.1 m of 6 and 1.5 %.
    let half = |name: &str| tallied(&people)[name].half_sum / 1000.0;
    let steps = 1.96 * 3.0 * (1.2 / 6.5f64).sqrt();
    assert!((half("cadence") / steps - 1.0).abs() < 0.05, "{}", half("cadence"));
    let speed = steps.hypot(1.96 * (100.0 * 0.1 / 6.0f64).hypot(1.5));
    assert!((half("speed") / speed - 1.0).abs() < 0.05, "{}", half("speed"));
}

#[test]
fn before_a_guessed_camera_lengths_along_the_view_hold_the_focal_length_too() {
    let mut random = Random::new(2);
    let person = |k: usize| Simulated::new(&mut random, Some(if k.is_multiple_of(2) { 0.45 } else { -0.45 }));
    let people: Vec<Simulated> = (0..500).map(person).collect();
    let is_length = |name: &str| name == "speed" || name.contains("length");
    assert_calibrated(&people, [0.92, 0.985], [0.9, 1.2], is_length);
}

/// Exact measurements of 1.2 m/s and 0.9 Hz from phase 0.1, for this number of cycles. The left heel strikes late
/// by this part of a cycle, and the phase is smooth.
fn exact(cycles: f64, late_left: f64) -> Vec<Measured> {
    let frames = (cycles / 0.9 / 0.04).round() as usize;
    let turn = |cycles: f64| (std::f64::consts::TAU * cycles).cos();
    let at = |k: usize| {
        let time_s = 0.04 * k as f64;
        let walked = 0.1 + 0.9 * time_s;
        // 1/2 at walked = 1/2 + late_left.
        let phase = walked + late_left / (1.0 + turn(late_left)) * (turn(walked) - 1.0);
        (time_s, 1.2 * time_s - 1.8, phase)
    };
    (0..=frames).map(at).collect()
}

fn line(walk: &TrackedWalk, quantity: GaitQuantity, side: Option<Side>) -> GaitParameter {
    let table = walk.gait_parameters();
    *table.iter().find(|line| line.quantity == quantity && line.side == side).unwrap()
}

fn half(line: &GaitParameter) -> f64 {
    let [low, high] = line.interval.unwrap();
    assert!((0.5 * (low + high) - line.value.unwrap()).abs() < 1e-9, "the value is in the middle");
    0.5 * (high - low)
}

#[test]
fn an_exact_walk_has_its_values_and_the_intervals_of_what_is_known_beforehand() {
    let walk = tracked(&exact(3.05, 0.0), ACROSS, Direction::Forward);
    // 6 steps; relative: the steps' 3 % over 6.1 of them, and 0.1 m of 6 and 1.5 % of the scale.
    let steps = 1.959_964 * 0.03 * (1.2 / 6.1f64).sqrt();
    let lengths = steps.hypot(1.959_964 * (0.1 / 6.0f64).hypot(0.015));
    for (quantity, value, relative) in [
        (GaitQuantity::Cadence, 108.0, steps),
        (GaitQuantity::StrideTime, 1.0 / 0.9, steps),
        (GaitQuantity::StepTime, 0.5 / 0.9, steps),
        (GaitQuantity::Speed, 1.2, lengths),
        (GaitQuantity::StrideLength, 1.2 / 0.9, lengths),
        (GaitQuantity::StepLength, 0.6 / 0.9, lengths),
    ] {
        let found = line(&walk, quantity, None);
        assert!((found.value.unwrap() / value - 1.0).abs() < 1e-6 && found.n == 6, "{found:?}");
        assert!((half(&found) / value / relative - 1.0).abs() < 0.01, "{found:?}, wanted {relative}");
    }
    for side in [Side::Right, Side::Left] {
        assert!((line(&walk, GaitQuantity::StepTime, Some(side)).value.unwrap() - 0.5 / 0.9).abs() < 1e-6);
        assert!((line(&walk, GaitQuantity::StepLength, Some(side)).value.unwrap() - 0.6 / 0.9).abs() < 1e-3);
    }
    // Without a fit, these are those of the average gait and not of the person.
    assert_eq!(line(&walk, GaitQuantity::Stance, None).value, None);
    assert_eq!(line(&walk, GaitQuantity::KneeRange, Some(Side::Right)).value, None);
}

#[test]
fn a_late_left_heel_makes_the_left_step_long_and_the_right_one_short() {
    let walk = tracked(&exact(4.0, 0.04), ACROSS, Direction::Forward);
    let value = |quantity, side| line(&walk, quantity, side).value.unwrap();
    assert!((value(GaitQuantity::StepTime, Some(Side::Left)) - 0.54 / 0.9).abs() < 0.004);
    assert!((value(GaitQuantity::StepTime, Some(Side::Right)) - 0.46 / 0.9).abs() < 0.004);
    assert!((value(GaitQuantity::StepLength, Some(Side::Left)) - 1.2 * 0.54 / 0.9).abs() < 0.005);
    assert!((value(GaitQuantity::StepTimeSymmetry, None) + 16.0).abs() < 1.2);
    assert!((value(GaitQuantity::StepLengthSymmetry, None) + 16.0).abs() < 1.2);
}

#[test]
fn the_stride_s_interval_holds_the_scatter_of_phase_and_place() {
    let mut measured = exact(3.05, 0.0);
    for (k, frame) in measured.iter_mut().enumerate() {
        frame.2 += if k % 2 == 0 { 0.06 } else { -0.06 };
    }
    let walk = tracked(&measured, ACROSS, Direction::Forward);
    let relative = |quantity| {
        let found = line(&walk, quantity, None);
        half(&found) / found.value.unwrap()
    };
    // The phase scatters by 0.06: sqrt(12 / 6.1) of it over 3.05 cycles.
    let rate = 1.959_964 * 0.06 * (12.0 / 6.1f64).sqrt() / 3.05;
    assert!((relative(GaitQuantity::Cadence) / rate - 1.0).abs() < 0.03);
    let scale = 1.959_964 * (0.1 / 6.0f64).hypot(0.015);
    assert!((relative(GaitQuantity::StrideLength) / rate.hypot(scale) - 1.0).abs() < 0.03);
    let steps = 1.959_964 * 0.03 * (1.2 / 6.1f64).sqrt();
    assert!((relative(GaitQuantity::Speed) / steps.hypot(scale) - 1.0).abs() < 0.03);
}

/// If position is exactly speed times time, lengths scatter as times do, multiplied by the speed.
#[test]
fn lengths_of_steps_scatter_as_their_times_do() {
    let mut random = Random::new(5);
    let speed_mps = 2.4;
    let frame = |(time_s, _, phase): (f64, f64, f64)| {
        (time_s, speed_mps * time_s, phase + 0.03 * f64::from(random.normal_pair()[0]))
    };
    let measured: Vec<Measured> = exact(4.0, 0.0).into_iter().map(frame).collect();
    let walk = tracked(&measured, ACROSS, Direction::Forward);
    let (strike_s, reach_m) = (0.008 / 0.9, 1.35 * 0.012 / 2f64.sqrt());
    for side in [Side::Right, Side::Left] {
        let (time, length) = (
            line(&walk, GaitQuantity::StepTime, Some(side)),
            line(&walk, GaitQuantity::StepLength, Some(side)),
        );
        let scale_m = (0.1 / 6.0f64).hypot(0.015) * length.value.unwrap();
        let common_s = 1.959_964 * 2f64.sqrt() * strike_s;
        let common_m = 1.959_964 * (2f64.sqrt() * (strike_s * speed_mps).hypot(reach_m)).hypot(scale_m);
        let scatter_s = (half(&time).powi(2) - common_s.powi(2)).sqrt();
        let scatter_m = (half(&length).powi(2) - common_m.powi(2)).sqrt();
        assert!((scatter_m / scatter_s / speed_mps - 1.0).abs() < 0.03, "{scatter_m} and {scatter_s}");
    }
}

#[test]
fn a_few_frames_or_half_a_step_have_no_parameters() {
    let told = |measured: &[Measured]| {
        line(&tracked(measured, ACROSS, Direction::Forward), GaitQuantity::Cadence, None).value
    };
    assert!(told(&exact(0.48, 0.0)).is_none() && told(&exact(0.54, 0.0)).is_some());
    let every = |n: usize| exact(2.0, 0.0).into_iter().step_by(56 / n).take(n).collect::<Vec<_>>();
    assert!(told(&every(7)).is_none() && told(&every(8)).is_some());
}

#[test]
fn sides_are_told_where_side_and_direction_are_likely() {
    let sided = |change: &dyn Fn(&mut TrackedWalk)| {
        let mut walk = tracked(&exact(3.05, 0.0), ACROSS, Direction::Forward);
        change(&mut walk);
        assert!(line(&walk, GaitQuantity::StepTime, None).value.is_some());
        line(&walk, GaitQuantity::StepTime, Some(Side::Right)).value.is_some()
    };
    assert!(!sided(&|walk| walk.fit = Some(Err(FitError::Undetermined))));
    assert!(sided(&|walk| walk.start.p_other_direction = 0.19));
    assert!(!sided(&|walk| walk.start.p_other_direction = 0.21));
    // p = 1 / (1 + exp(9.25 m)) for a margin m of one glimpse.
    let margin = |walk: &mut TrackedWalk, m: f64| {
        let sum = walk.walk.twins[0].similarity_sum;
        walk.walk.twins[1].similarity_sum = (1.0 - m) * sum;
    };
    assert!(sided(&|walk| margin(walk, 0.16)) && !sided(&|walk| margin(walk, 0.14)));
}

#[test]
fn walking_backwards_has_a_cadence_and_a_negative_speed_but_no_sides_and_no_stance() {
    let back = |(time_s, along_m, phase): Measured| (time_s, -along_m, 5.0 - phase);
    let measured: Vec<Measured> = exact(3.05, 0.0).into_iter().map(back).collect();
    let walk = tracked(&measured, ACROSS, Direction::Backward);
    let value = |quantity, side| line(&walk, quantity, side).value;
    assert!((value(GaitQuantity::Cadence, None).unwrap() - 108.0).abs() < 1e-3);
    assert!((value(GaitQuantity::Speed, None).unwrap() + 1.2).abs() < 1e-6);
    assert!((value(GaitQuantity::StrideLength, None).unwrap() - 1.2 / 0.9).abs() < 1e-6);
    assert!(half(&line(&walk, GaitQuantity::Speed, None)) > 0.0);
    for quantity in [GaitQuantity::Stance, GaitQuantity::StepTimeSymmetry] {
        assert_eq!(value(quantity, None), None);
    }
    assert_eq!(value(GaitQuantity::StepTime, Some(Side::Left)), None);
}

#[test]
fn a_strike_is_the_median_of_the_frames_near_it() {
    let walk = tracked(&exact(2.05, 0.0), ACROSS, Direction::Forward);
    let found = strikes(walk.steps(), 0.9);
    // Phases 0.1 to 2.15: the strikes 1/2, 1, 3/2 and 2.
    let expected = [(Side::Left, 1), (Side::Right, 2), (Side::Left, 3), (Side::Right, 4)];
    assert_eq!(found.iter().map(|s| (s.side, s.index)).collect::<Vec<_>>(), expected);
    for strike in &found {
        let time_s = (0.5 * strike.index as f64 - 0.1) / 0.9;
        assert!((strike.time_s - time_s).abs() < 1e-9 && strike.variance_s2 < 1e-15, "{strike:?}");
    }
    // Two of three frames give the same time; the third differs by 0.03 cycles.
    let mut measured = exact(2.05, 0.0);
    for (k, frame) in measured.iter_mut().enumerate() {
        frame.2 += if k % 3 == 0 { 0.03 } else { 0.0 };
    }
    let shifted = strikes(tracked(&measured, ACROSS, Direction::Forward).steps(), 0.9);
    let strike = shifted.iter().find(|s| s.index == 2).unwrap();
    assert!((strike.time_s - 1.0).abs() < 1e-9, "{strike:?}");
    // Frames within 0.125 cycles, 0.139 s, of a line that is 0.01 higher; two count as one.
    let near: Vec<usize> =
        (0..measured.len()).filter(|k| (0.9 * 0.04 * *k as f64 + 0.11 - 1.0).abs() < 0.125).collect();
    let off = near.iter().filter(|k| *k % 3 == 0).count() as f64;
    let n = near.len() as f64;
    let variance = off * (0.03f64 / 0.9).powi(2) / (n - 1.0) / (n / 2.0);
    assert!((strike.variance_s2 / variance - 1.0).abs() < 0.02, "{strike:?} against {variance}");
}

#[test]
fn a_step_leads_from_one_strike_to_the_next_and_is_named_after_it() {
    let walk = tracked(&exact(3.05, 0.0), ACROSS, Direction::Forward);
    let strike = |index: i64, side, time_s, variance_s2| Strike { side, index, time_s, variance_s2 };
    let taken = steps_between(
        &[
            strike(1, Side::Left, 0.45, 1e-4),
            strike(2, Side::Right, 1.01, 3e-4),
            strike(4, Side::Right, 2.1, 2e-4),
            strike(5, Side::Left, 2.7, 5e-4),
        ],
        &walk.rows(),
        0.0,
    );
    let found: Vec<_> = taken.iter().map(|s| (s.side, s.time_s, s.length_m, s.variance_s2)).collect();
    assert_eq!(found.len(), 2, "not over a strike that was not seen: {found:?}");
    for ((side, time_s, length_m, variance_s2), (wanted, wanted_s, wanted_s2)) in
        found.into_iter().zip([(Side::Right, 0.56, 4e-4), (Side::Left, 0.6, 7e-4)])
    {
        assert!(
            side == wanted && (time_s - wanted_s).abs() < 1e-12 && (variance_s2 - wanted_s2).abs() < 1e-12
        );
        assert!((length_m - 1.2 * wanted_s).abs() < 1e-4, "{length_m}");
    }
}

/// Without a fit of the person the belt has the speed of the average gait, known to 15 %.
#[test]
fn on_a_treadmill_lengths_are_those_on_the_belt() {
    let still: Vec<Measured> = exact(3.05, 0.0).into_iter().map(|(t, _, phase)| (t, 0.3, phase)).collect();
    let walk = TrackedWalk { is_on_treadmill: true, ..tracked(&still, ACROSS, Direction::Forward) };
    let belt = walk.treadmill().unwrap().belt;
    // Strides of 0.6 to 1.05 heights, as people take.
    assert!((0.6..1.05).contains(&(belt.speed_mps / 0.9 / 1.75)), "{belt:?}");
    let table = walk.gait_parameters();
    let of = |quantity, side| table.iter().find(|p| p.quantity == quantity && p.side == side).unwrap();
    let speed = of(GaitQuantity::Speed, None);
    assert!((speed.value.unwrap() - belt.speed_mps).abs() < 1e-9);
    let [low, high] = speed.interval.unwrap();
    assert!((high - low) / 2.0 > Z * 0.15 * belt.speed_mps && (high - low) / 2.0 < Z * 0.17 * belt.speed_mps);
    let stride = of(GaitQuantity::StrideLength, None).value.unwrap();
    assert!((stride - belt.speed_mps / 0.9).abs() < 1e-3, "{stride}");
    assert!(walk.rows().iter().all(|row| (row.speed_mps - belt.speed_mps).abs() < 0.05));
    let over_ground = TrackedWalk { is_on_treadmill: false, ..walk };
    assert_eq!((over_ground.treadmill(), over_ground.belt().speed_mps), (None, 0.0));
}

/// For independent points the standard deviation of the slope is sd / sqrt(sum (t - mean)²).
#[test]
fn with_as_many_steps_as_points_the_interval_of_a_slope_is_that_of_the_textbook() {
    let points: Vec<(f64, f64)> = (0..200)
        .map(|k| (0.04 * k as f64, 0.9 * 0.04 * k as f64 + [0.01, -0.02, 0.005, 0.015, -0.01][k % 5]))
        .collect();
    let (slope, level) = line_through(&points);
    let mean = points.iter().map(|p| p.0).sum::<f64>() / 200.0;
    let spread: f64 = points.iter().map(|p| (p.0 - mean).powi(2)).sum();
    let sum_sq: f64 = points.iter().map(|p| (p.1 - level - slope * p.0).powi(2)).sum();
    let textbook = 1.959_964 * (sum_sq / 198.0 / spread).sqrt();
    assert!((half_slope(&points, 200.0) / textbook - 1.0).abs() < 0.02);
}

#[test]
fn the_scale_is_uncertain_by_distance_posture_and_along_the_view_by_a_guessed_focal_length() {
    let scale_sd = |slant_rad: f64, camera_is_guessed: bool| {
        let path = Path { heading_rad: slant_rad, ..ACROSS };
        let mut walk = tracked(&exact(1.0, 0.0), path, Direction::Forward);
        walk.tilt = camera_is_guessed.then(|| tilt_of_lines(&[], [640, 480], 500.0));
        walk.scale_sd()
    };
    // The camera is 6 m in front of the origin and looks along y.
    for slant_rad in [0.0, 0.3, -0.5f64] {
        let known = (0.1 / (6.0 * slant_rad.cos())).hypot(0.015);
        assert!((scale_sd(slant_rad, false) - known).abs() < 1e-12);
        let guessed = known.hypot(0.18 * slant_rad.sin().powi(2));
        assert!((scale_sd(slant_rad, true) - guessed).abs() < 1e-12);
    }
}

/// Of somebody who turned, so that the feet show the middle of the walk and contours its ends.
#[test]
fn the_scale_of_a_path_past_the_camera_is_that_of_rows_on_the_ground() {
    let mut walk = tracked(&exact(1.0, 0.0), Path { heading_rad: -1.5, ..ACROSS }, Direction::Forward);
    let middle = walk.steps().len() / 2;
    let place = walk.route().place(walk.steps()[middle].state.along.position);
    walk.walk.twins[0].steps[middle].by_feet = true;
    let range_m = place.distance(walk.camera.position().truncate());
    assert!((walk.scale_sd() - (0.2 / range_m).hypot(0.015)).abs() < 1e-12);
}
