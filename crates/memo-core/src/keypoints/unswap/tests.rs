use super::*;
use crate::synth::Random;

/// One pair swinging in opposite phase; joint 0 is left, joint 1 is right.
fn swing(times_s: &[f64], scale_px: f64) -> Vec<[f64; 2]> {
    let pair = |t: &f64| {
        let reach = scale_px * (6.0 * t).sin();
        [[40.0 * scale_px + reach, 0.3 * scale_px], [40.0 * scale_px - reach, 0.0]]
    };
    times_s.iter().flat_map(pair).collect()
}

fn times(n: usize) -> Vec<f64> {
    (0..n).map(|t| 0.04 * t as f64).collect()
}

fn one_pair() -> [LimbGroup; 1] {
    let levels = vec![Level { name: "ankle".into(), pairs: vec![[0, 1]] }];
    [LimbGroup { name: "legs".into(), levels }]
}

fn solve(times_s: &[f64], points_px: &[[f64; 2]], scores: Option<&[f64]>) -> Unswapped {
    let keypoints = Keypoints { times_s, joints: 2, points_px, scores };
    unswap(&keypoints, &one_pair(), &UnswapOptions::default()).unwrap()
}

proptest::proptest! {
    #[test]
    fn planted_exchanges_are_undone_at_any_scale_and_with_uneven_times(
        seed in 0u64..1000, scale_px in 1e-3..1e4f64, share in 0.0..0.35f64,
    ) {
        let mut random = Random::new(seed);
        let mut time_s = random.uniform(-1e6, 1e6);
        let times_s: Vec<f64> = (0..80).map(|_| { time_s += random.uniform(0.03, 0.05); time_s }).collect();
        let start_s = times_s[0];
        let truth = swing(&times_s.iter().map(|t| t - start_s).collect::<Vec<_>>(), scale_px);
        let mut seen = truth.clone();
        let mut scores = vec![0.9; 160];
        let mut exchanged = 0;
        for t in 0..80 {
            scores[2 * t] = 0.8;
            if random.uniform(0.0, 1.0) < share {
                exchanged += 1;
                seen.swap(2 * t, 2 * t + 1);
                scores.swap(2 * t, 2 * t + 1);
            }
        }
        // The assignment of most frames counts as correct.
        proptest::prop_assume!(exchanged < 40);
        let found = solve(&times_s, &seen, Some(&scores));
        proptest::prop_assert_eq!(&found.points_px, &truth);
        proptest::prop_assert!(found.scores.unwrap().chunks(2).all(|s| s == [0.8, 0.9]));
    }

    #[test]
    fn whatever_comes_only_partners_are_exchanged(
        points in proptest::collection::vec(
            proptest::array::uniform2(proptest::prop_oneof![
                4 => -1e7..1e7f64, 1 => proptest::strategy::Just(f64::NAN), 1 => proptest::strategy::Just(0.0),
            ]),
            0..40,
        ),
    ) {
        let points = &points[..points.len() / 2 * 2];
        let found = solve(&times(points.len() / 2), points, None);
        for (t, (before, after)) in points.chunks(2).zip(found.points_px.chunks(2)).enumerate() {
            let same = |a: [f64; 2], b: [f64; 2]| a.map(f64::to_bits) == b.map(f64::to_bits);
            let verdict = &found.groups[0].verdicts[t];
            let [l, r] = if verdict.level_flipped[0] { [1, 0] } else { [0, 1] };
            proptest::prop_assert!(same(before[0], after[l]) && same(before[1], after[r]));
            proptest::prop_assert!((0.0..=1.0).contains(&verdict.probability));
        }
    }
}

#[test]
fn a_level_seen_on_one_side_goes_with_its_group() {
    let times_s = times(50);
    let two = |points: Vec<[f64; 2]>| -> Vec<[f64; 2]> {
        points.chunks(2).flat_map(|p| [p[0], p[1], [p[0][0], 90.0], [f64::NAN; 2]]).collect()
    };
    let truth = two(swing(&times_s, 50.0));
    let mut seen = truth.clone();
    seen[4 * 20..4 * 21].copy_from_slice(&[1, 0, 3, 2].map(|j| truth[80 + j]));
    let levels = [("knee", [0, 1]), ("ankle", [2, 3])]
        .map(|(name, pair)| Level { name: name.into(), pairs: vec![pair] });
    let group = [LimbGroup { name: "legs".into(), levels: levels.into() }];
    let keypoints = Keypoints { times_s: &times_s, joints: 4, points_px: &seen, scores: None };
    let found = unswap(&keypoints, &group, &UnswapOptions::default()).unwrap();
    assert_eq!(found.points_px[82], truth[82]);
    assert!(found.points_px[83][0].is_nan());
    let flipped: Vec<usize> = (0..50).filter(|&t| found.groups[0].verdicts[t].flipped).collect();
    assert_eq!(flipped, [20]);
    assert!(
        found.groups[0].verdicts[20].describe(&group[0]).starts_with("flipped: continuity of knee, gain")
    );
}

#[test]
fn half_the_frames_either_way_is_no_majority() {
    let times_s = times(60);
    let mut seen = swing(&times_s, 50.0);
    seen[..60].chunks_mut(2).for_each(|pair| pair.swap(0, 1));
    let found = solve(&times_s, &seen, None);
    let group = &found.groups[0];
    assert!((group.global_probability - 0.5).abs() < 0.1, "{}", group.global_probability);
    assert!(group.verdicts.iter().all(|v| !v.decided));
    let flips = group.verdicts.windows(2).filter(|v| v[0].flipped != v[1].flipped).count();
    assert_eq!(flips, 1);
}

#[test]
fn nothing_seen_and_coinciding_joints_are_named() {
    let times_s = times(30);
    let found = solve(&times_s, &[[f64::NAN; 2]; 60], None);
    assert!(found.groups[0].verdicts.iter().all(|v| v.reason == Reason::NothingSeen));
    let mut random = Random::new(1);
    let same: Vec<[f64; 2]> = (0..60).map(|_| random.normal_pair().map(f64::from)).collect();
    let found = solve(&times_s, &same, None);
    let verdicts = &found.groups[0].verdicts;
    let named = verdicts.iter().filter(|v| matches!(v.reason, Reason::Coincide { .. })).count();
    assert!(named > 20, "{named}");
}

#[test]
fn bad_input_is_refused_with_its_values() {
    let points = swing(&times(4), 1.0);
    let options = UnswapOptions::default();
    let given = |times_s: &[f64], points_px: &[[f64; 2]], scores: Option<&[f64]>| {
        let keypoints = Keypoints { times_s, joints: 2, points_px, scores };
        unswap(&keypoints, &one_pair(), &options).unwrap_err().to_string()
    };
    assert!(given(&times(5), &points, None).contains("5 frames x 2 joints = 10 points, got 8"));
    assert!(given(&[0.0, 0.1, 0.1, 0.2], &points, None).contains("at frame 2"));
    assert!(given(&[f64::NAN, 0.1, 0.2, 0.3], &points, None).contains("NaN s at frame 0"));
    assert!(given(&times(4), &points, Some(&[1.0; 7])).contains("8 points, got 7"));
    let mut scores = [1.0; 8];
    scores[5] = 1.5;
    assert!(given(&times(4), &points, Some(&scores)).contains("got 1.5 at frame 2, joint 1"));
    let mut far = points.clone();
    far[3] = [f64::INFINITY, 0.0];
    assert!(given(&times(4), &far, None).contains("got (inf, 0) at frame 1, joint 1"));
    let keypoints = Keypoints { times_s: &times(4), joints: 2, points_px: &points, scores: None };
    let with = |pairs: Vec<[usize; 2]>| {
        let levels = vec![Level { name: "knee".into(), pairs }];
        let group = LimbGroup { name: "legs".into(), levels };
        unswap(&keypoints, &[group], &options).unwrap_err().to_string()
    };
    assert!(with(vec![[0, 2]]).contains("got 2 in group \"legs\""));
    assert!(with(vec![[0, 0]]).contains("got 0 a second time"));
    assert!(with(vec![]).contains("got none in level \"knee\""));
}

#[test]
fn no_frames_give_no_verdicts() {
    assert!(solve(&[], &[], None).groups[0].verdicts.is_empty());
}

/// Knee and ankle of a walker of 100 px; the two joints of each pair swing in opposite phase. The labels of
/// some frames are swapped: a mask of levels for each frame.
fn two_levels(times_s: &[f64], exchanged: impl Fn(usize) -> usize) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    for (t, time_s) in times_s.iter().enumerate() {
        for level in 0..2 {
            let reach = [14.0, 35.0][level] * (6.0 * time_s - 0.5 * level as f64).sin();
            let mut pair = [[100.0 + reach, 50.0 * level as f64], [100.0 - reach, 50.0 * level as f64 + 2.0]];
            if exchanged(t) >> level & 1 == 1 {
                pair.swap(0, 1);
            }
            points.extend(pair);
        }
    }
    points
}

fn legs() -> [LimbGroup; 1] {
    let levels = [("knee", [0, 1]), ("ankle", [2, 3])]
        .map(|(name, pair)| Level { name: name.into(), pairs: vec![pair] });
    [LimbGroup { name: "legs".into(), levels: levels.into() }]
}

fn solve_legs(times_s: &[f64], points_px: &[[f64; 2]], options: &UnswapOptions) -> GroupResult {
    let keypoints = Keypoints { times_s, joints: 4, points_px, scores: None };
    unswap(&keypoints, &legs(), options).unwrap().groups.remove(0)
}

/// If k of n frames were swapped, the odds that the majority is correct are exp(p (n - 2 k)) for p nats per
/// frame; half of a frame's levels count half.
#[test]
fn the_global_probability_counts_the_frames_by_the_prior() {
    let times_s = times(60);
    for as_is_nats in [0.02, 0.1, 0.4] {
        let options = UnswapOptions { as_is_nats, ..UnswapOptions::default() };
        for (mask, share) in [(3, 1.0), (2, 0.5)] {
            let points = two_levels(&times_s, |t| if (20..35).contains(&t) { mask } else { 0 });
            let found = solve_legs(&times_s, &points, &options);
            let flipped = found.verdicts.iter().map(|v| v.level_flipped.iter().filter(|f| **f).count());
            assert_eq!(flipped.sum::<usize>(), 15 * mask.count_ones() as usize);
            let odds: f64 = (as_is_nats * (60.0 - 2.0 * 15.0 * share)).exp();
            assert!((found.global_probability - odds / (1.0 + odds)).abs() < 1e-9, "{as_is_nats} {mask}");
        }
    }
}

/// The prior of the labels decides which of two halves was swapped, unless it is zero.
#[test]
fn labels_as_they_came_are_believed_by_their_prior() {
    let times_s = times(60);
    let points = two_levels(&times_s, |t| if t < 24 { 3 } else { 0 });
    for (as_is_nats, is_sure) in [(0.0, false), (0.05, false), (0.3, true)] {
        let found = solve_legs(&times_s, &points, &UnswapOptions { as_is_nats, ..UnswapOptions::default() });
        // 36 frames against 24: a surplus of 12 frames.
        let odds: f64 = (12.0 * as_is_nats).exp();
        for (t, verdict) in found.verdicts.iter().enumerate() {
            let right = if t < 24 { verdict.probability } else { 1.0 - verdict.probability };
            assert!((right - odds / (1.0 + odds)).abs() < 0.02, "{as_is_nats} frame {t}: {right}");
            assert_eq!(verdict.decided, is_sure);
            assert!(is_sure || verdict.reason == Reason::GlobalLabel, "{:?}", verdict.reason);
        }
        let run = &found.runs[0];
        assert!((found.runs.len(), run.start, run.end) == (1, 0, 60) && run.gap_before_s == 0.0);
        let mean = found.verdicts.iter().map(|v| if v.flipped { v.probability } else { 1.0 - v.probability });
        assert!((run.probability - mean.sum::<f64>() / 60.0).abs() < 1e-9);
    }
}

/// The caller sets the probability from which on a frame is decided.
#[test]
fn a_frame_is_decided_from_the_probability_asked_for() {
    let times_s = times(60);
    let points = two_levels(&times_s, |t| if t < 24 { 3 } else { 0 });
    for (decided_at, is_decided) in [(0.6, true), (0.9, true), (0.95, false), (0.99, false)] {
        // A surplus of 12 frames at 0.2 nats: probability 0.917.
        let options = UnswapOptions { decided_at, ..UnswapOptions::default() };
        let found = solve_legs(&times_s, &points, &options);
        assert!(found.verdicts.iter().all(|v| v.decided == is_decided), "{decided_at}");
    }
}

/// Knees and ankles swapped independently: found level by level, unless the prior cost is too high.
#[test]
fn levels_exchanged_alone_are_found_at_a_price() {
    let times_s = times(60);
    let points = two_levels(&times_s, |t| [0, 2, 0, 1, 3][t / 12]);
    let found = solve_legs(&times_s, &points, &UnswapOptions::default());
    for (t, verdict) in found.verdicts.iter().enumerate() {
        let mask = [0, 2, 0, 1, 3][t / 12];
        assert_eq!(verdict.level_flipped, [mask & 1 == 1, mask & 2 == 2], "frame {t}");
        assert_eq!(verdict.partial, mask == 1 || mask == 2, "frame {t}");
        for (level, probability) in verdict.level_probability.iter().enumerate() {
            assert_eq!(*probability > 0.5, mask >> level & 1 == 1, "frame {t} level {level}: {probability}");
        }
    }
    for dear in [
        UnswapOptions { partial_begin_nats: 90.0, ..UnswapOptions::default() },
        UnswapOptions { partial_stay_nats: 90.0, ..UnswapOptions::default() },
    ] {
        let found = solve_legs(&times_s, &points, &dear);
        // The start is paid once, the continuation in every further frame: both exceed the gain of the
        // motion.
        let partial = found.verdicts.iter().filter(|v| v.partial).count();
        assert!(partial <= 4, "{partial} {dear:?}");
    }
}

/// Where the legs may have crossed unobserved, the two sides of the gap have separate labels.
#[test]
fn a_gap_in_which_legs_may_have_crossed_parts_the_runs() {
    let mut times_s = times(80);
    for time_s in &mut times_s[40..] {
        *time_s += 1.3;
    }
    let points = two_levels(&times_s, |_| 0);
    let found =
        solve_legs(&times_s, &points, &UnswapOptions { decided_at: 0.9999, ..UnswapOptions::default() });
    assert_eq!(found.runs.iter().map(|run| (run.start, run.end)).collect::<Vec<_>>(), [(0, 40), (40, 80)]);
    assert!((found.runs[1].gap_before_s - 1.34).abs() < 1e-9);
    let undecided: Vec<&Reason> = found.verdicts.iter().filter(|v| !v.decided).map(|v| &v.reason).collect();
    assert!(!undecided.is_empty());
    for reason in undecided {
        assert!(
            matches!(reason, Reason::UnseenCrossing { gap_s } if (gap_s - 1.34).abs() < 1e-9),
            "{reason:?}"
        );
    }
}

/// Both joints of the pair coincide for a long time: no gap, but the motion does not determine the labels.
#[test]
fn a_stretch_that_fits_both_labels_is_unclear() {
    let times_s = times(90);
    let mut random = Random::new(3);
    let reach = |t: usize| if (30..60).contains(&t) { 0.0 } else { 30.0 };
    let points: Vec<[f64; 2]> = (0..90)
        .flat_map(|t| {
            let [[a, b], [c, d]] = [(); 2].map(|()| random.normal_pair().map(|n| 0.3 * f64::from(n)));
            [[100.0 + reach(t) + a, b], [100.0 - reach(t) + c, d]]
        })
        .collect();
    let keypoints = Keypoints { times_s: &times_s, joints: 2, points_px: &points, scores: None };
    let options = UnswapOptions { decided_at: 0.9999, ..UnswapOptions::default() };
    let found = unswap(&keypoints, &one_pair(), &options).unwrap().groups.remove(0);
    assert!(found.runs.len() > 1, "{:?}", found.runs);
    let reasons: Vec<&Reason> = found.verdicts.iter().filter(|v| !v.decided).map(|v| &v.reason).collect();
    assert!(reasons.iter().any(|reason| **reason == Reason::Unclear), "{reasons:?}");
    assert!(!reasons.iter().any(|reason| matches!(reason, Reason::UnseenCrossing { .. })));
}

/// The gain of a level is the cost that swapping it in that frame alone would add to all its motion.
#[test]
fn gains_are_what_a_single_exchange_costs() {
    let times_s = times(40);
    let points = two_levels(&times_s, |t| if t == 17 { 3 } else { 0 });
    let groups = legs();
    let keypoints = Keypoints { times_s: &times_s, joints: 4, points_px: &points, scores: None };
    let limb = Limb::new(&keypoints, &groups[0]);
    let solution = limb.solution(&UnswapOptions::default());
    let gains = limb.gains(&solution);
    let total = |flipped: Option<(usize, usize)>| -> f64 {
        let bit = |k: usize, level: usize| {
            let own = solution.path[k] >> level & 1;
            if flipped == Some((k, level)) { own ^ 1 } else { own }
        };
        (2..40)
            .flat_map(|k| (0..2).map(move |level| (k, level)))
            .map(|(k, level)| {
                let turns = [bit(k - 2, level) ^ bit(k - 1, level), bit(k - 1, level) ^ bit(k, level)];
                solution.costs[k][level][2 * turns[0] + turns[1]]
            })
            .sum()
    };
    for (k, gains) in gains.iter().enumerate() {
        for (level, gain) in gains.iter().enumerate() {
            assert!((total(Some((k, level))) - total(None) - gain).abs() < 1e-9, "frame {k} level {level}");
        }
    }
    assert_eq!(solution.path.iter().enumerate().filter(|(_, bits)| **bits != 0).count(), 1);
}

/// A pair has the harmonic mean of its scores as weight, and a side that is not visible removes the pair.
#[test]
fn a_pair_weighs_as_its_two_scores_together() {
    let points = [[0.0, 1.0], [4.0, 5.0], [f64::NAN, 0.0]];
    let scores = [0.5, 1.0, 1.0];
    let keypoints = Keypoints { times_s: &[0.0], joints: 3, points_px: &points, scores: Some(&scores) };
    let found = sample(&keypoints, 0, 0, 1).unwrap();
    assert_eq!((found.difference, found.mean), (DVec2::splat(4.0), DVec2::new(2.0, 3.0)));
    assert!((found.weight - 2.0 / 3.0).abs() < 1e-12);
    assert!(sample(&keypoints, 0, 0, 2).is_none());
}

/// Where the ankles are exchanged alone, the knees, which nearly coincide, are not exchanged with them.
#[test]
fn a_level_that_is_rather_right_is_not_exchanged_with_another() {
    let times_s = times(60);
    let points = two_levels(&times_s, |t| if (20..26).contains(&t) { 2 } else { 0 });
    let mut random = Random::new(4);
    for _ in 0..20 {
        let noisy: Vec<[f64; 2]> =
            points.iter().map(|p| p.map(|x| x + 4.0 * f64::from(random.normal_pair()[0]))).collect();
        let found = solve_legs(&times_s, &noisy, &UnswapOptions::default());
        for (t, verdict) in found.verdicts.iter().enumerate() {
            for level in 0..2 {
                let [flipped, p] =
                    [f64::from(u8::from(verdict.level_flipped[level])), verdict.level_probability[level]];
                assert!(!verdict.decided || flipped == 0.0 || p >= 0.5, "frame {t} level {level}: {p}");
                let right = if flipped == 1.0 { p } else { 1.0 - p };
                assert_eq!(
                    verdict.level_decided[level],
                    verdict.decided && right >= 0.9,
                    "frame {t} level {level}: {p}"
                );
            }
        }
    }
}
