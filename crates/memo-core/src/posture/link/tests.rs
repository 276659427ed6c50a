use super::*;
use crate::posture::prior::{Balance, SegmentPrior, Soft};
use crate::reproduce::stick_walker::StickWalker;
use glam::DQuat;

const FRAMES: usize = 60;

/// The truth in camera axes, 4 m away, and its sequence at 25 frames per second.
pub(super) fn sequence(yaw_rad: f64) -> (Vec<StickFigure>, Vec<LinkFrame>, SegmentLengths, LinkOptions) {
    let walker = StickWalker::lee_chen();
    let turn = DQuat::from_rotation_y(yaw_rad);
    let camera_from_walker = |v: DVec3| turn * DVec3::new(-v.z, -v.y, -v.x);
    let truth: Vec<StickFigure> = (0..FRAMES)
        .map(|t| walker.posed(t as f64 / 25.0, DVec3::ZERO))
        .map(|figure| PerJoint(figure.0.map(|p| camera_from_walker(p) + DVec3::new(0.0, -0.3, 4.0))))
        .collect();
    let frames = truth
        .iter()
        .enumerate()
        .map(|(t, figure)| LinkFrame {
            time_s: t as f64 / 25.0,
            rays: JointRays::from_points(figure),
            neck: figure[Joint::Neck],
            front: FrontPoints::UNSEEN,
        })
        .collect();
    let options = LinkOptions {
        up: Some(-DVec3::Y),
        moving_direction: Some(camera_from_walker(DVec3::X)),
        ..LinkOptions::default()
    };
    (truth, frames, *walker.lengths(), options)
}

/// Share of joints within 10 cm of the truth.
fn share(figures: &[StickFigure], truth: &[StickFigure]) -> f64 {
    let near = |(a, b): (&StickFigure, &StickFigure)| {
        Joint::ALL.iter().filter(|&&joint| a[joint].distance(b[joint]) < 0.10).count()
    };
    figures.iter().zip(truth).map(near).sum::<usize>() as f64 / (figures.len() * JOINT_COUNT) as f64
}

#[test]
fn a_walk_is_found_from_all_sides() {
    for yaw_deg in [0.0, 30.0, 60.0, 90.0, 135.0, 180.0_f64] {
        let (truth, frames, lengths, options) = sequence(yaw_deg.to_radians());
        let path = link(&frames, &lengths, &options).unwrap();
        let near = share(&path.smoothed, &truth);
        assert!(near >= 0.99, "{yaw_deg} deg: {near}");
        // Without noise, joints stay close to their rays.
        for (figure, frame) in path.smoothed.iter().zip(&frames) {
            for joint in Joint::ALL {
                assert!(figure[joint].cross(frame.rays.ray[joint]).length() < 0.02, "{yaw_deg} {joint:?}");
            }
        }
    }
}

#[test]
fn the_second_reading_is_another_and_keeps_lengths() {
    let (_, frames, lengths, options) = sequence(std::f64::consts::FRAC_PI_4);
    let path = link(&frames, &lengths, &options).unwrap();
    let second = path.second.unwrap();
    assert!(second.margin > 0.0 && second.to - second.from == second.figures.len());
    let least = path.margin.iter().copied().fold(f64::INFINITY, f64::min);
    assert_eq!(second.margin, least);
    let apart = second.figures.iter().zip(&path.figures[second.from..]).map(|(other, best)| {
        Joint::ALL.iter().map(|&joint| other[joint].distance(best[joint])).fold(0.0, f64::max)
    });
    assert!(apart.fold(0.0, f64::max) > 0.10);
    for figure in &second.figures {
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = joint.start().unwrap();
            assert!((figure[joint].distance(figure[start]) - lengths.to[joint]).abs() < 1e-6);
        }
    }
}

#[test]
fn what_is_mirrored_in_the_second_reading_is_the_least_sure() {
    let (_, frames, lengths, options) = sequence(std::f64::consts::FRAC_PI_4);
    let path = link(&frames, &lengths, &options).unwrap();
    let second = path.second.clone().unwrap();
    assert!(path.mirror_margin[second.from][second.joints[0]] <= second.margin);
    let odds = options.prior.mirrored;
    for (t, frame) in frames.iter().enumerate() {
        for joint in Joint::ALL.into_iter().skip(1) {
            let margin = path.mirror_margin[t][joint];
            let expected = match joint.class() {
                _ if matches!(joint, Joint::RightHip | Joint::LeftHip) => 1.0 / (1.0 + margin.exp()),
                Some('b' | 'c' | 'd') => {
                    odds.probability(path.smoothed[t].segment(joint).dot(frame.rays.ray[joint]), margin)
                }
                _ => 1.0 / (1.0 + margin.exp()),
            };
            // The rays of the links are those of the frames smoothed over time.
            assert!((path.probability_mirrored(t, joint) - expected).abs() < 0.02, "{t} {joint:?}");
        }
    }
    assert_eq!(path.probability_mirrored(0, Joint::Neck), 0.0);
}

#[test]
fn unseen_joints_and_frames_cost_only_themselves() {
    let (truth, mut frames, lengths, options) = sequence(0.8);
    for frame in &mut frames[20..40] {
        frame.rays.ray[Joint::RightElbow] = DVec3::NAN;
    }
    frames[50].neck = DVec3::NAN;
    let path = link(&frames, &lengths, &options).unwrap();
    for t in 0..FRAMES {
        let below = (20..40).contains(&t);
        for joint in Joint::ALL {
            let arm = matches!(joint, Joint::RightElbow | Joint::RightWrist);
            let known = t != 50 && !(below && arm);
            assert_eq!(path.figures[t][joint].is_finite(), known, "frame {t} {joint:?}");
        }
    }
    assert!(path.margin[50].is_nan());
    let whole: Vec<usize> = (0..20).chain(40..50).chain(51..FRAMES).collect();
    let pick = |figures: &[StickFigure]| whole.iter().map(|&t| figures[t]).collect::<Vec<_>>();
    assert!(share(&pick(&path.smoothed), &pick(&truth)) >= 0.97);
}

#[test]
fn short_sequences_are_answered() {
    let (_, frames, lengths, options) = sequence(0.8);
    for n in 0..4 {
        let path = link(&frames[..n], &lengths, &options).unwrap();
        assert_eq!(path.figures.len(), n);
        assert!(path.figures.iter().all(|figure| figure.0.iter().all(|p| p.is_finite())));
    }
    let mut blind = frames;
    blind.iter_mut().for_each(|frame| frame.neck = DVec3::NAN);
    let path = link(&blind, &lengths, &options).unwrap();
    assert!(path.second.is_none() && path.figures.iter().all(|figure| figure[Joint::Neck].is_nan()));
}

#[test]
fn wrong_input_is_named() {
    let (_, frames, lengths, options) = sequence(0.8);
    let with = |change: &dyn Fn(&mut LinkFrame)| {
        let mut frames = frames.clone();
        change(&mut frames[7]);
        link(&frames, &lengths, &options)
    };
    let behind = with(&|frame| frame.neck.z = -1.0);
    assert!(matches!(behind, Err(LinkError::Neck { frame: 7, .. })));
    assert!(matches!(with(&|frame| frame.neck.x = f64::INFINITY), Err(LinkError::Neck { frame: 7, .. })));
    assert!(matches!(with(&|frame| frame.time_s = 0.2), Err(LinkError::Times { frame: 7, .. })));
    assert!(matches!(with(&|frame| frame.time_s = f64::NAN), Err(LinkError::Times { .. })));
    let level = LinkOptions { up: Some(DVec3::ZERO), ..options.clone() };
    let found = link(&frames, &lengths, &level);
    assert!(matches!(found, Err(LinkError::Direction { parameter: "up", .. })));
    let mut short = lengths;
    short.to[Joint::LeftKnee] = -0.4;
    assert!(matches!(link(&frames, &short, &options), Err(LinkError::Lengths(_))));
}

/// No habits: only limits of the joints, inertia, and perhaps balance.
fn without_habits(balance: Option<Balance>) -> MotionPrior {
    let any = MotionPrior::any();
    let segments =
        any.segments.map(|segment| SegmentPrior { swing: Soft::FREE, outward: Soft::FREE, ..segment });
    MotionPrior { segments, balance, ..any }
}

/// A walker seen from the front, whose feet are below the middle of the body on the average: with balance more legs
/// are right than without it, or with one half a metre in front of the feet.
#[test]
fn a_body_is_above_its_feet() {
    let found = |balance: Option<Balance>| {
        let of_yaw = |yaw_deg: f64| {
            let (truth, frames, lengths, options) = sequence(yaw_deg.to_radians());
            let options = LinkOptions { prior: without_habits(balance), moving_direction: None, ..options };
            share(&link(&frames, &lengths, &options).unwrap().smoothed, &truth) / 5.0
        };
        [150.0, 165.0, 180.0, 195.0, 210.0].map(of_yaw).iter().sum::<f64>()
    };
    let [without, balanced, leaning] = [None, Some(0.0), Some(0.5)]
        .map(|ahead_m| found(ahead_m.map(|ahead_m| Balance { ahead_m, sd_m: 0.1 })));
    assert!(balanced > without + 0.02, "{without} without balance, {balanced} with");
    assert!(leaning < balanced - 0.02, "{balanced} above the feet, {leaning} elsewhere");
}

/// Twice the cost of a body whose centre is not above its feet: by the nearer foot, with its uncertainty.
#[test]
fn a_body_may_be_above_either_foot_or_between_them() {
    let (_, frames, lengths, options) = sequence(0.3);
    let balance = Some(Balance { ahead_m: 0.07, sd_m: 0.06 });
    let cost = |feet: [(f64, f64); 2], balance: Option<Balance>| {
        let options = LinkOptions { prior: without_habits(balance), ..options.clone() };
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        problem.balance_cost(feet.map(|(value, sd)| Measured { value, sd }))
    };
    for (right_m, left_m) in [(0.2, -0.1), (-0.3, 0.3), (0.0, 0.5), (f64::NAN, 0.4), (0.4, f64::NAN)] {
        assert_eq!(cost([(right_m, 0.0), (left_m, 0.0)], balance), 0.0, "{right_m} {left_m}");
    }
    // 6 cm and 8 cm are 10 cm.
    for feet in [[(0.2, 0.08), (0.5, 9.0)], [(-0.5, 9.0), (-0.2, 0.08)]] {
        assert!((cost(feet, balance) - heavy_tailed(2.0)).abs() < 1e-12, "{feet:?}");
        assert_eq!(cost(feet, None), 0.0);
    }
}

/// No prior of the motion: seen from above, many mirrored legs would leave the ground.
#[test]
fn somebody_stands_on_the_ground() {
    let mut shares = [0.0; 2];
    for yaw_deg in [150.0, 165.0, 180.0, 195.0, 210.0_f64] {
        let (mut truth, mut frames, lengths, options) = sequence(yaw_deg.to_radians());
        for (figure, frame) in truth.iter_mut().zip(&mut frames) {
            figure.0.iter_mut().for_each(|p| p.y += 2.0);
            frame.rays = JointRays::from_points(figure);
            frame.neck = figure[Joint::Neck];
        }
        let feet = truth.iter().map(|figure| figure[Joint::RightAnkle].y.max(figure[Joint::LeftAnkle].y));
        let ground_y = feet.fold(f64::NEG_INFINITY, f64::max) + 0.17 * lengths.to[Joint::RightAnkle];
        let anything = LinkOptions { prior: without_habits(None), ..options };
        let ground = Ground { up_in_camera: -DVec3::Y, camera_height_m: ground_y };
        for (share_sum, ground) in shares.iter_mut().zip([None, Some(ground)]) {
            let path = link(&frames, &lengths, &LinkOptions { ground, ..anything.clone() }).unwrap();
            *share_sum += share(&path.smoothed, &truth) / 5.0;
        }
    }
    let [floating, standing] = shares;
    assert!(standing > floating + 0.02, "{floating} without ground, {standing} with");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (_, mut frames, lengths, options) = sequence(0.3);
    for frame in &mut frames {
        frame.front.toes[0] = (frame.rays.ray[Joint::RightAnkle] + 0.03 * DVec3::X).normalize();
    }
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| link(&frames, &lengths, &options).unwrap())
    });
    assert!(one.toes.iter().all(|[right, left]| right.is_finite() && left.is_nan()));
    // Toes that are not seen are NaN, which equals nothing.
    assert_eq!(format!("{one:?}"), format!("{two:?}"));
}

/// A problem of frames without joints, at these times.
fn timed(times_s: &[f64]) -> Vec<LinkFrame> {
    let rays = JointRays::from_points(&StickFigure::UNKNOWN);
    let neck = DVec3::new(0.0, 0.0, 4.0);
    times_s.iter().map(|&time_s| LinkFrame { time_s, rays, neck, front: FrontPoints::UNSEEN }).collect()
}

/// A ray missing for a short time is interpolated linearly in time; one missing for longer stays missing.
#[test]
fn short_gaps_are_bridged_evenly_in_time() {
    let mut frames = timed(&[0.0, 0.02, 0.10, 0.14, 0.25, 0.29]);
    let along = |x: f64| DVec3::new(x, 0.0, 1.0).normalize();
    for (t, x) in [(0, 0.0), (2, 0.01), (5, 0.03)] {
        frames[t].rays.ray[Joint::LeftKnee] = along(x);
    }
    let bridged = bridge(&frames, 0.12);
    // A fifth of the time between frames 0 and 2; the 0.19 s up to frame 5 are too long.
    assert!((bridged[1].rays.ray[Joint::LeftKnee] - along(0.002)).length() < 1e-6);
    assert!(bridged[3].rays.ray[Joint::LeftKnee].is_nan() && bridged[4].rays.ray[Joint::LeftKnee].is_nan());
    let longer = bridge(&frames, 0.2);
    assert!((longer[3].rays.ray[Joint::LeftKnee] - along(0.01 + 0.02 * 4.0 / 19.0)).length() < 1e-5);
    assert!(bridged[1].rays.ray[Joint::RightKnee].is_nan());
}

fn problem_of<'a>(
    frames: &'a [LinkFrame],
    lengths: &'a SegmentLengths,
    options: &'a LinkOptions,
) -> Problem<'a> {
    Problem { frames, lengths, options }
}

/// The deviation of an extent consists of the image noise, the length's deviation, and the starting joint's
/// position as far as that is across the ray.
#[test]
fn extents_are_as_unsure_as_image_length_and_start() {
    let lengths = SegmentLengths::lee_chen();
    let (start, ray) = (DVec3::new(0.1, 0.0, 4.0), DVec3::new(0.08, 0.02, 1.0).normalize());
    let end = Joint::LeftElbow;
    let across = start.cross(ray).length();
    let half = (lengths.to[end].powi(2) - across * across).sqrt();
    let mut options = LinkOptions::default();
    options.prior.segments[0].length_sd = 0.0;
    let mut frames = timed(&[0.0]);
    frames[0].rays.ray[end] = ray;
    let sd = |frames: &[LinkFrame], options: &LinkOptions, start_sd_m: f64| {
        problem_of(frames, &lengths, options).roots(0, start, start_sd_m, end).sd_m
    };
    assert_eq!(sd(&frames, &options, 0.0), 0.0);
    let sine = start.normalize().cross(ray).length();
    assert!((sd(&frames, &options, 0.2) - extent_sd(half, across, 0.2 * sine)).abs() < 1e-12);
    options.prior.segments[0].length_sd = 0.03;
    let length_m = 0.03 * lengths.to[end];
    assert!((sd(&frames, &options, 0.0) - extent_sd(half, across, length_m)).abs() < 1e-12);
    frames[0].rays.noise_rad = 0.002;
    let all_m = length_m.hypot(0.2 * sine).hypot(2f64.sqrt() * 0.002 * start.length());
    assert!((sd(&frames, &options, 0.2) - extent_sd(half, across, all_m)).abs() < 1e-12);
}

/// Extents of constant acceleration at unequal intervals cost half the squared acceleration in its deviations.
#[test]
fn a_change_of_velocity_costs_the_square_of_its_acceleration() {
    let lengths = SegmentLengths::lee_chen();
    let options = LinkOptions::default();
    let times_s = [0.0, 0.04, 0.14];
    let frames = timed(&times_s);
    let problem = problem_of(&frames, &lengths, &options);
    let at = |acceleration: f64, sds: [f64; 3]| {
        [0, 1, 2].map(|t| {
            let time_s: f64 = times_s[t];
            Measured { value: 0.3 - time_s + 0.5 * acceleration * time_s * time_s, sd: sds[t] }
        })
    };
    let cost = |acceleration, sds| problem.acceleration_cost(2, at(acceleration, sds), 2.0);
    assert!(cost(0.0, [0.0; 3]).abs() < 1e-12);
    assert!((cost(4.0, [0.0; 3]) - 2.0).abs() < 1e-9);
    assert!((cost(-6.0, [0.0; 3]) - 4.5).abs() < 1e-9);
    // The change of velocity of 4 m/s² over 0.07 s, and noise of one extent over the steps beside it.
    let (change, own) = (4.0 * 0.07, 2.0 * 0.07);
    for (t, per_sd) in [(0, 25.0), (1, 25.0 + 10.0), (2, 10.0)] {
        let mut sds = [0.0; 3];
        sds[t] = 0.01;
        let noise: f64 = 0.01 * per_sd;
        let expected = 0.5 * change * change / (own * own + noise * noise);
        assert!((cost(4.0, sds) - expected).abs() < 1e-9, "{t}");
    }
    assert_eq!(problem.acceleration_cost(2, [Measured::NOTHING; 3], 2.0), 0.0);
}

/// Frames 80 ms apart have full weight, closer ones less; the first and the last by their one neighbour.
#[test]
fn frames_count_by_the_time_between_them() {
    let (lengths, options) = (SegmentLengths::lee_chen(), LinkOptions::default());
    let frames = timed(&[0.0, 0.02, 0.08, 0.30, 0.40]);
    let problem = problem_of(&frames, &lengths, &options);
    let expected = [0.25, 0.5, 1.0, 1.0, 1.0];
    for (t, expected) in expected.into_iter().enumerate() {
        assert!((problem.weight(t) - expected).abs() < 1e-12, "{t} {}", problem.weight(t));
    }
    assert_eq!(problem_of(&frames[..1], &lengths, &options).weight(0), 1.0);
}

/// At least one ankle is at ground level; a single known ankle may be above it, and not below.
#[test]
fn the_lower_ankle_stands_on_the_ground() {
    let (lengths, frames) = (SegmentLengths::lee_chen(), timed(&[0.0]));
    let ground = Ground { up_in_camera: -DVec3::Y, camera_height_m: 1.2 };
    let options = LinkOptions { ground: Some(ground), ..LinkOptions::default() };
    let problem = problem_of(&frames, &lengths, &options);
    let sd = options.prior.support_sd_m;
    assert!((problem.support_cost([0.3, 2.0 * sd]) - 4.0).abs() < 1e-12);
    assert!((problem.support_cost([-2.0 * sd, 0.3]) - 4.0).abs() < 1e-12);
    assert_eq!(problem.support_cost([f64::NAN, 2.0 * sd]), 0.0);
    assert!((problem.support_cost([-2.0 * sd, f64::NAN]) - 4.0).abs() < 1e-12);
    assert_eq!(problem.support_cost([f64::NAN; 2]), 0.0);
    // The ankle of a supporting foot is 0.18 of the shank above the ground.
    let standing = 0.18 * lengths.to[Joint::LeftAnkle];
    let point = DVec3::new(0.5, 1.2 - standing - 0.25, 3.0);
    assert!((problem.lift_m(Joint::LeftAnkle, point) - 0.25).abs() < 1e-12);
    let nowhere = LinkOptions::default();
    assert!(problem_of(&frames, &lengths, &nowhere).lift_m(Joint::LeftAnkle, point).is_nan());
}

/// Probability of a mirrored reading from its odds: the margin divided by the overconfidence of the prior.
#[test]
fn probabilities_are_those_of_the_margins() {
    let alternative = |margin: f64| Alternative { joints: vec![], from: 0, to: 0, figures: vec![], margin };
    assert_eq!(alternative(0.0).probability(), 0.5);
    assert!((alternative(9f64.ln()).probability() - 0.1).abs() < 1e-12);
    let (_, frames, lengths, options) = sequence(std::f64::consts::FRAC_PI_4);
    let path = link(&frames, &lengths, &options).unwrap();
    let mut sure = options.clone();
    sure.prior.overconfidence = 1.0;
    let surer = link(&frames, &lengths, &sure).unwrap();
    assert_eq!(options.prior.overconfidence, 2.0);
    for (a, b) in path.margin.iter().zip(&surer.margin) {
        assert!((2.0 * a - b).abs() < 1e-9 || (a.is_infinite() && b.is_infinite()));
    }
    assert!((2.0 * path.second.unwrap().margin - surer.second.unwrap().margin).abs() < 1e-9);
}

/// From any view, also without a direction, the cheaper of a trunk and its flipped trunk is chosen.
#[test]
fn the_cheaper_body_is_chosen_limbs_and_all() {
    for yaw_deg in [0.0, 20.0, 160.0, 180.0_f64] {
        let (_, frames, lengths, options) = sequence(yaw_deg.to_radians());
        let options = LinkOptions { prior: MotionPrior::any(), moving_direction: None, ..options };
        let problem = problem_of(&frames, &lengths, &options);
        let trunks = Trunk::link(&problem);
        let costs: Vec<f64> =
            trunks.iter().map(|trunk| trunk.delta + Limbs::link(&problem, trunk).cost).collect();
        let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
        let best = costs.iter().position(|cost| *cost == least).unwrap();
        let path = link(&frames, &lengths, &options).unwrap();
        for (figure, chosen) in path.smoothed.iter().zip(&trunks[best].smoothed) {
            for joint in [Joint::RightShoulder, Joint::LeftShoulder, Joint::Pelvis, Joint::RightHip] {
                assert!(figure[joint].distance(chosen[joint]) < 0.05, "{yaw_deg} {joint:?} {costs:?}");
            }
        }
        println!("{yaw_deg}: {costs:?}");
    }
}
