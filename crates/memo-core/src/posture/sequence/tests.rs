use super::example::{Walk, walk, with_lengths};
use super::*;
use crate::model::skeleton::SegmentLengths;
use crate::posture::constraint::ConstraintKind;
use crate::posture::example::bent;
use proptest::prelude::*;

/// Median and 90 % quantile of the distances from the truth, with necks aligned, cm.
fn errors_cm(found: &[StickFigure], truth: &[StickFigure]) -> [f64; 2] {
    let mut errors: Vec<f64> = found
        .iter()
        .zip(truth)
        .flat_map(|(found, truth)| {
            let shift = truth[Joint::Neck] - found[Joint::Neck];
            Joint::ALL.map(|joint| 100.0 * (found[joint] + shift).distance(truth[joint]))
        })
        .filter(|error| error.is_finite())
        .collect();
    errors.sort_by(f64::total_cmp);
    [0.5, 0.9].map(|q| errors[(q * (errors.len() - 1) as f64) as usize])
}

#[test]
fn a_walk_is_recovered_in_the_world() {
    for azimuth_deg in [45.0, 90.0] {
        let walk = walk(azimuth_deg, 40, 1.0);
        let found = walk.postures(&with_lengths()).unwrap();
        let [median, worst] = errors_cm(&found.linked.smoothed, &walk.truth);
        println!("{azimuth_deg} deg: {median:.1} cm, 90 % {worst:.1} cm; {:?}", found.heading);
        for warning in &found.warnings {
            println!("{warning}");
        }
        assert!(median < 4.0 && worst < 12.0, "{azimuth_deg} deg: {median:.1} cm, 90 % {worst:.1} cm");
        let off = |t: &usize| (found.linked.figures[*t][Joint::Neck] - walk.truth[*t][Joint::Neck]).length();
        let inside = (0..40).filter(|t| off(t) < 3.0 * found.neck.sd_m[*t]).count();
        assert!(inside >= 36, "{inside} necks within 3 standard deviations");
        let forward = walk.truth[39][Joint::Neck] - walk.truth[0][Joint::Neck];
        let heading = found.heading.direction.unwrap();
        assert_eq!(found.heading.from, HeadingFrom::Travel);
        assert!(heading.angle_between(forward).to_degrees() < 10.0, "{heading} for {forward}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }
}

/// Survivors by count, reasons by the constraint's kind: rules cut only if requested.
#[test]
fn rules_cut_what_bodies_allow() {
    let walk = walk(45.0, 10, 1.0);
    let physical = walk.postures(&SequenceOptions { motion: Motion::Physical, ..with_lengths() }).unwrap();
    let walking = walk.postures(&with_lengths()).unwrap();
    for (physical, walking) in physical.frames.iter().zip(&walking.frames) {
        let [physical, walking] = [physical, walking].map(|frame| frame.as_ref().unwrap());
        assert!(walking.survivors() <= physical.survivors() && walking.survivors() > 0);
        assert!(walking.groups.len() <= 64 && walking.groups[0].size >= walking.groups.last().unwrap().size);
    }
    let has_rule = |found: &PostureSequence| {
        reason_totals(&found.frames).iter().any(|total| total.constraint.kind() == ConstraintKind::Rule)
    };
    assert!(!has_rule(&physical) && has_rule(&walking));
    let few = walk.postures(&SequenceOptions { max_groups: 2, ..with_lengths() }).unwrap();
    for (few, all) in few.frames.iter().flatten().zip(walking.frames.iter().flatten()) {
        assert!(few.group_count == all.group_count && all.group_count.is_some_and(|count| count > 2));
        assert_eq!(few.groups[..], all.groups[..2]);
        let members: usize = all.groups.iter().map(|group| group.size).sum();
        assert!(members == all.survivors() || all.group_count > Some(64));
    }
}

#[test]
fn missing_joints_cost_what_hangs_on_them() {
    let mut walk = walk(45.0, 20, 0.5);
    walk.points_px[7][Joint::RightKnee] = DVec2::NAN;
    walk.weights[8][Joint::LeftElbow] = 0.0;
    walk.points_px[9][Joint::Neck] = DVec2::NAN;
    walk.points_px[10] = PerJoint([DVec2::NAN; JOINT_COUNT]);
    walk.points_px[11][Joint::LeftWrist] = DVec2::INFINITY;
    let found = walk.postures(&with_lengths()).unwrap();
    let unknown = |t: usize| -> Vec<Joint> {
        let figure = &found.linked.figures[t];
        Joint::ALL.into_iter().filter(|&joint| figure[joint].is_nan()).collect()
    };
    assert_eq!(unknown(7), [Joint::RightKnee, Joint::RightAnkle]);
    assert_eq!(unknown(8), [Joint::LeftElbow, Joint::LeftWrist]);
    assert_eq!(unknown(11), [Joint::LeftWrist]);
    assert_eq!(found.frames[9], Err(FrameProblem::NeckNotSeen));
    assert_eq!(found.frames[10], Err(FrameProblem::NeckNotSeen));
    assert_eq!([unknown(9).len(), unknown(10).len()], [JOINT_COUNT; 2]);
    assert!((0..20).filter(|t| ![7, 8, 9, 10, 11].contains(t)).all(|t| unknown(t).is_empty()));
    let counts = &found.frames[7].as_ref().unwrap().tree.counts;
    assert_eq!(counts[Joint::RightKnee].reached, counts[Joint::LeftWrist].reached);
    let open = &found.frames[7].as_ref().unwrap().tree.open;
    assert!(open.iter().all(|constraint| constraint.name().contains("right")
        || constraint.kind() == ConstraintKind::Rule
        || constraint.kind() == ConstraintKind::Collision));
    assert!(found.warnings.contains(&Warning::LightJoints { light: 1, all: 20 * 14 - 16, min_weight: 0.2 }));
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::OutsideLens { outside: 1, .. })));
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::SilentFrames { silent: 2, of: 20, .. })));
}

#[test]
fn what_makes_no_sense_is_refused_with_its_values() {
    let good = walk(45.0, 6, 0.5);
    let refused = |change: &dyn Fn(&mut Walk, &mut SequenceOptions)| {
        let mut walk = walk(45.0, 6, 0.5);
        let mut options = with_lengths();
        change(&mut walk, &mut options);
        walk.postures(&options).unwrap_err().to_string()
    };
    assert!(good.postures(&with_lengths()).is_ok());
    assert_eq!(refused(&|walk, _| walk.times_s.clear()), "there are no frames");
    assert_eq!(
        refused(&|walk, _| walk.points_px.truncate(3)),
        "as many frames of points as times (6) are needed, got 3"
    );
    assert_eq!(
        refused(&|walk, _| walk.times_s[3] = walk.times_s[2]),
        "times must be finite and increase: frame 3 is at 0.08 s, the one before at 0.08 s"
    );
    assert!(refused(&|walk, _| walk.times_s[2] = f64::NAN).starts_with("times must be finite"));
    assert_eq!(refused(&|_, o| o.noise_px = f64::NAN), "noise_px must be finite and not negative, got NaN");
    assert!(refused(&|_, o| o.lengths.as_mut().unwrap().to[Joint::Pelvis] = 0.0).contains("got 0"));
    assert!(refused(&|_, o| (o.lengths, o.height_m) = (None, Some(17.0))).contains("17"));
    assert!(refused(&|_, o| o.moving_direction = Some(DVec3::Z)).contains("vertical"));
    assert!(refused(&|_, o| o.anchor = AnchorChoice::Source(AnchorSource::Head)).contains("six points"));
    assert!(
        refused(&|_, o| o.anchor = AnchorChoice::Given { distance_m: vec![4.0, 5.0], sd_m: 0.1 })
            .contains("as many distances (or one) as times (6) are needed, got 2")
    );
    assert!(
        refused(&|_, o| o.anchor = AnchorChoice::Given { distance_m: vec![-4.0], sd_m: 0.1 }).contains("-4")
    );
    assert!(
        refused(&|_, o| o.anchor = AnchorChoice::Given { distance_m: vec![4.0], sd_m: 0.0 }).contains("sd")
    );
    for (distance_m, sd_m) in [(1e300, 0.1), (1e-300, 0.1), (4.0, -5.0), (4.0, 1e300)] {
        let given = AnchorChoice::Given { distance_m: vec![distance_m], sd_m };
        assert!(refused(&|_, o| o.anchor = given.clone()).starts_with("distance_"));
    }
    let nothing = |walk: &mut Walk| walk.points_px.fill(PerJoint([DVec2::NAN; JOINT_COUNT]));
    assert!(refused(&|walk, _| nothing(walk)).contains("no frame gives the neck's distance"));
    assert!(refused(&|walk, o| (nothing(walk), o.lengths = None).1).contains("no frame gives"));
    assert!(refused(&|walk, _| walk.camera.focal_px.x = 0.0).contains("focal"));
}

#[test]
fn frames_that_say_nothing_say_why() {
    let mut walk = walk(45.0, 6, 0.5);
    for joint in Joint::ALL.into_iter().skip(1) {
        walk.points_px[2][joint] = DVec2::NAN;
    }
    let found = walk.postures(&with_lengths()).unwrap();
    assert_eq!(found.frames[2], Err(FrameProblem::NeckAlone));
    let anchor = AnchorChoice::Given { distance_m: vec![4.0, 4.0, 4.0, 4.0, 0.5, f64::NAN], sd_m: 1.0 };
    let found = walk.postures(&SequenceOptions { anchor, ..with_lengths() }).unwrap();
    assert_eq!(found.frames[4], Err(FrameProblem::VagueDistance { distance_m: 0.5, sd_m: 1.0 }));
    assert_eq!(found.frames[5], Err(FrameProblem::NoDistance));
    assert!(found.neck.distance_m[4].is_nan() && found.neck.from[4] == NeckFrom::Nothing);
    assert!(found.linked.figures[4].0.iter().all(|point| point.is_nan()) && found.frames[3].is_ok());
}

#[test]
fn no_neck_has_a_reason_from_every_source() {
    let mut walk = walk(45.0, 6, 0.5);
    for points_px in &mut walk.points_px {
        points_px[Joint::Pelvis] = DVec2::NAN;
        points_px[Joint::RightHip] = DVec2::NAN;
        points_px[Joint::LeftHip] = DVec2::NAN;
        points_px[Joint::RightAnkle] = DVec2::NAN;
        points_px[Joint::LeftAnkle] = DVec2::NAN;
    }
    walk.weights[0][Joint::LeftWrist] = 0.1;
    let error = walk.postures(&with_lengths()).unwrap_err();
    let SequenceError::NoNeck { reasons, warnings } = &error else { panic!("{error}") };
    assert_eq!(reasons.len(), 4, "{error}");
    assert!(matches!(warnings[..], [Warning::LightJoints { light: 1, .. }]), "{error}");
    for source in ["ground", "trunk", "extent", "head"] {
        assert!(error.to_string().contains(&format!("no neck from the {source}")), "{error}");
    }
    assert!(error.to_string().contains("noticed before: 1 of"), "{error}");
}

#[test]
fn a_picture_of_another_size_is_noticed() {
    let beyond = |scale: f64| {
        let mut walk = walk(45.0, 6, 0.5);
        walk.points_px.iter_mut().flat_map(|points| &mut points.0).for_each(|pixel| *pixel *= scale);
        let inside = 0.0..=1920.0;
        let pixels = walk.points_px.iter().flat_map(|points| points.0);
        let outside = pixels.filter(|p| !(inside.contains(&p.x) && inside.contains(&p.y))).count();
        let warnings = walk.postures(&with_lengths()).unwrap().warnings;
        let told = warnings.into_iter().find_map(|warning| match warning {
            Warning::OutsidePicture { beyond, all: 84, size: [1920, 1920], .. } => Some(beyond),
            _ => None,
        });
        (outside, told)
    };
    assert_eq!(beyond(1.0), (0, None));
    let (outside, told) = beyond(2.0);
    assert!(told.is_some_and(|told| told.abs_diff(outside) <= 2 && told > 20), "{told:?}, {outside}");
}

#[test]
fn a_segment_longer_than_can_be_is_reported() {
    let walk = walk(90.0, 20, 0.5);
    let mut lengths = SegmentLengths::lee_chen();
    lengths.to[Joint::RightAnkle] *= 0.5;
    let options = SequenceOptions { lengths: Some(lengths), motion: Motion::Physical, ..with_lengths() };
    let necks = walk.truth.iter().map(|f| walk.camera.camera_from_world(f[Joint::Neck]).length());
    let anchor = AnchorChoice::Given { distance_m: necks.collect(), sd_m: 0.05 };
    let found = walk.postures(&SequenceOptions { anchor, ..options.clone() }).unwrap();
    let is_short = |warning: &Warning| match warning {
        Warning::SegmentTooShort { segment, frames, .. } => {
            segment == "right_knee_to_right_ankle" && *frames == 20
        }
        _ => false,
    };
    assert!(found.warnings.iter().any(is_short), "{:?}", found.warnings);
    let gaps: Vec<f64> = found.linked.gap_m.iter().map(|gap| gap[Joint::RightAnkle]).collect();
    assert!(gaps.iter().all(|gap| *gap > 0.05), "{gaps:?}");
    // Without a distance the ground takes the short leg for a nearer one, unlike the trunk.
    let found = walk.postures(&options).unwrap();
    let is_conflict = |c: &SourceConflict| c.sources == [AnchorSource::Ground, AnchorSource::Trunk];
    assert!(found.neck.conflicts.iter().any(is_conflict), "{:?}", found.neck.conflicts);
    assert!(found.warnings.iter().any(|warning| matches!(warning, Warning::Conflict(c) if is_conflict(c))));
}

#[test]
fn threads_change_nothing() {
    let walk = walk(45.0, 12, 2.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        format!("{:?}", pool.install(|| walk.postures(&with_lengths()).unwrap()))
    };
    assert!(with(1) == with(2));
}

#[test]
fn figures_go_to_the_camera_and_back() {
    let walk = walk(30.0, 1, 0.0);
    let camera_figure = figure_in_camera(&walk.truth[0], &walk.camera);
    let again = figure_in_world(&camera_figure, &walk.camera);
    for joint in Joint::ALL {
        assert!(camera_figure[joint].z > 0.0 && again[joint].distance(walk.truth[0][joint]) < 1e-12);
    }
}

fn any_pixel() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => 0.0..1920.0,
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 1e300, -1e9]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// For any points: a result of the right size, or an error.
    #[test]
    fn no_points_break_it(
        pixels in prop::collection::vec((any_pixel(), any_pixel()), 3 * JOINT_COUNT),
        weights in prop::collection::vec(prop_oneof![4 => 0.0..1.0, 1 => Just(f64::NAN)], 3 * JOINT_COUNT),
        motion in prop::sample::select(Motion::ALL.to_vec()),
        known in any::<bool>(),
        noise_px in 0.0..20.0,
    ) {
        let mut walk = walk(45.0, 3, 0.0);
        for (i, &(u, v)) in pixels.iter().enumerate() {
            walk.points_px[i / JOINT_COUNT].0[i % JOINT_COUNT] = DVec2::new(u, v);
            walk.weights[i / JOINT_COUNT].0[i % JOINT_COUNT] = weights[i];
        }
        let lengths = known.then(SegmentLengths::lee_chen);
        let options = SequenceOptions { lengths, motion, noise_px, ..SequenceOptions::default() };
        if let Ok(found) = walk.postures(&options) {
            prop_assert_eq!(found.frames.len(), 3);
            prop_assert_eq!(found.linked.figures.len(), 3);
            prop_assert!(found.warnings.iter().all(|warning| !warning.to_string().is_empty()));
        }
    }
}

/// Rays and their noise: without weight there is no point, and a pixel divided by the mean focal length is an
/// angle.
#[test]
fn points_of_unknown_weight_are_missing() {
    let mut walk = walk(45.0, 8, 0.5);
    walk.weights[3][Joint::LeftWrist] = f64::NAN;
    walk.camera.focal_px.y *= 1.21;
    let found = walk.postures(&SequenceOptions { noise_px: 2.2, ..with_lengths() }).unwrap();
    assert!(found.linked.figures[3][Joint::LeftWrist].is_nan());
    assert!(found.linked.figures[3][Joint::LeftElbow].is_finite());
    let rays = &found.frames[0].as_ref().unwrap().tree.view.rays;
    assert!((rays.noise_rad - 2.0 / walk.camera.focal_px.x).abs() < 1e-12, "{}", rays.noise_rad);
}

/// A frame that cannot be used is not linked, though its neck is known.
#[test]
fn the_neck_alone_is_no_posture() {
    let mut walk = walk(45.0, 8, 0.5);
    for joint in [Joint::RightShoulder, Joint::LeftShoulder, Joint::Pelvis] {
        walk.points_px[4][joint] = DVec2::NAN;
    }
    let found = walk.postures(&with_lengths()).unwrap();
    assert_eq!(found.frames[4], Err(FrameProblem::NeckAlone));
    assert!(found.neck.distance_m[4].is_finite());
    assert!(found.linked.figures[4][Joint::Neck].is_nan());
}

/// The chosen postures are those of [`link`](crate::posture::link::link) with ground, vertical and direction.
#[test]
fn frames_are_linked_on_the_ground_and_in_the_moving_direction() {
    use crate::posture::link::{FrontPoints, link};
    let walk = walk(60.0, 16, 1.0);
    for motion in [Motion::Walking, Motion::Physical] {
        let found = walk.postures(&SequenceOptions { motion, ..with_lengths() }).unwrap();
        let rays: Vec<JointRays> =
            found.frames.iter().map(|frame| frame.as_ref().unwrap().tree.view.rays).collect();
        let frames: Vec<LinkFrame> = (0..16)
            .map(|t| LinkFrame {
                time_s: walk.times_s[t],
                rays: rays[t],
                neck: rays[t].ray[Joint::Neck] * found.neck.distance_m[t],
                front: FrontPoints::UNSEEN,
            })
            .collect();
        let heading = walk.camera.rotation * found.heading.direction.unwrap();
        let options = LinkOptions {
            prior: motion.prior(),
            up: Some(walk.camera.rotation * DVec3::Z),
            ground: Some(Ground::of(&walk.camera)),
            moving_direction: (motion == Motion::Walking).then_some(heading),
            ..LinkOptions::default()
        };
        let linked = link(&frames, &SegmentLengths::lee_chen(), &options).unwrap();
        for t in 0..16 {
            let in_camera = figure_in_camera(&found.linked.figures[t], &walk.camera);
            for joint in Joint::ALL {
                assert!(
                    in_camera[joint].distance(linked.figures[t][joint]) < 1e-9,
                    "{motion:?} {t} {joint:?}"
                );
            }
        }
        // The other reading is in world axes too: it differs in its mirrored joints and in the joints beyond
        // them.
        let second = found.linked.second.unwrap();
        let hangs = |joint: Joint| {
            std::iter::successors(Some(joint), |joint| joint.start())
                .any(|joint| second.joints.contains(&joint))
        };
        for (figure, t) in second.figures.iter().zip(second.from..) {
            for joint in Joint::ALL.into_iter().filter(|&joint| !hangs(joint)) {
                assert!(figure[joint].distance(found.linked.figures[t][joint]) < 1e-9);
            }
        }
    }
}

/// The stated deviations are those of noise, 5 mm per segment and the scale of the lengths that is in the neck's
/// distance, propagated down the limbs.
#[test]
fn deviations_are_those_of_their_causes() {
    let walk = walk(60.0, 10, 1.0);
    let found = walk.postures(&with_lengths()).unwrap();
    let scale_sd = SequenceOptions::default().anchor_options.scale_sd;
    assert!(scale_sd > 0.0 && found.neck.scale_sd > 0.0);
    for t in 0..10 {
        let causes = Causes {
            anchor_sd_m: found.neck.sd_m[t],
            length_sd_m: PerJoint([DEFAULT_LENGTH_SD_M; JOINT_COUNT]),
            scale_sd,
            anchor_scale_sd_m: found.neck.scale_sd * found.neck.distance_m[t],
        };
        let rays = found.frames[t].as_ref().unwrap().tree.view.rays;
        let figure = figure_in_camera(&found.linked.smoothed[t], &walk.camera);
        let stated = propagate(&figure, &rays, &causes).unwrap();
        for joint in Joint::ALL {
            let ratio = found.sd_m[t][joint] / stated.absolute_sd_m[joint];
            assert!((ratio - 1.0).abs() < 1e-6, "{t} {joint:?} {ratio}");
        }
    }
}

/// Walkers whose left arm and leg go with the right ones: no walk, and no posture that walking forbids in every frame.
fn hopping(azimuth_deg: f64, frames: usize) -> Walk {
    let mut walk = walk(azimuth_deg, frames, 0.5);
    let joined = [
        (Joint::LeftHip, Joint::RightHip, [Joint::LeftKnee, Joint::LeftAnkle]),
        (Joint::LeftShoulder, Joint::RightShoulder, [Joint::LeftElbow, Joint::LeftWrist]),
    ];
    for (figure, points_px) in walk.truth.iter_mut().zip(&mut walk.points_px) {
        for (left, right, ends) in joined {
            for end in ends {
                figure[end] = figure[end.mirrored()] + figure[left] - figure[right];
                points_px[end] = walk.camera.project(figure[end]).unwrap();
            }
        }
    }
    walk
}

/// The largest distance of a joint of the nearest survivor from where it is, the worst frame, metres.
fn nearest_survivor_m(found: &PostureSequence, walk: &Walk) -> f64 {
    let of_frame = |(frame, truth): (&Result<FrameReading, FrameProblem>, &StickFigure)| {
        let survivors = frame.as_ref().unwrap().survivor_figures(&walk.camera);
        let off = |figure: &StickFigure| {
            Joint::ALL.iter().map(|&j| figure[j].distance(truth[j])).fold(0.0, f64::max)
        };
        survivors.iter().map(off).fold(f64::INFINITY, f64::min)
    };
    found.frames.iter().zip(&walk.truth).map(of_frame).fold(0.0, f64::max)
}

#[test]
fn rules_that_do_not_fit_the_motion_are_dropped() {
    let walk = hopping(90.0, 40);
    let found = walk.postures(&with_lengths()).unwrap();
    assert_eq!(found.rules, Motion::Physical);
    assert!(nearest_survivor_m(&found, &walk) < 0.15, "the true posture survives");
    // With the neck at the same distance, what is left is what bodies allow.
    let survivors = |motion| {
        let anchor = AnchorChoice::Source(AnchorSource::Extent);
        let found = walk.postures(&SequenceOptions { motion, anchor, ..with_lengths() }).unwrap();
        assert_eq!(found.rules, Motion::Physical);
        found.frames.iter().flatten().map(FrameReading::survivors).collect::<Vec<_>>()
    };
    assert_eq!(survivors(Motion::Walking), survivors(Motion::Physical));
    // The printed rules are kept, as they were asked for; and so are rules that fit.
    let printed = walk.postures(&SequenceOptions { strength: Strength::Paper, ..with_lengths() }).unwrap();
    assert_eq!(printed.rules, Motion::Walking);
    let fitting = super::example::walk(60.0, 30, 0.5).postures(&with_lengths()).unwrap();
    assert_eq!((fitting.rules, fitting.warnings), (Motion::Walking, vec![]));
}

/// A person who faces the camera and bends forwards by 55 degrees within a second and up again.
#[test]
fn who_bends_is_found_bent() {
    let mut bow = walk(0.0, 50, 0.0);
    let mut random = crate::synth::Random::new(11);
    let lengths = SegmentLengths::lee_chen();
    let leans =
        (0..50).map(|t| 55f64.to_radians() * (std::f64::consts::PI * f64::from(t) / 49.0).sin().powi(2));
    let leans: Vec<f64> = leans.collect();
    for (t, &lean) in leans.iter().enumerate() {
        bow.truth[t] = figure_in_world(&bent(&lengths, lean), &bow.camera);
        bow.points_px[t] = PerJoint(bow.truth[t].0.map(|p| {
            let [a, b] = random.normal_pair().map(f64::from);
            bow.camera.project(p).unwrap() + 0.5 * DVec2::new(a, b)
        }));
    }
    let found = bow.postures(&SequenceOptions { motion: Motion::Physical, ..with_lengths() }).unwrap();
    let away = bow.camera.rotation.transpose() * DVec3::Z;
    let spine = |figure: &StickFigure| figure[Joint::Neck] - figure[Joint::Pelvis];
    for (t, figure) in found.linked.smoothed.iter().enumerate() {
        let off_m = figure[Joint::Neck].distance(bow.truth[t][Joint::Neck]);
        // Taken as upright throughout, the neck would be up to 4.1 cm off.
        assert!(off_m < 0.032, "frame {t}: {off_m} m");
        let [got, true_lean] = [figure, &bow.truth[t]].map(|f| (-spine(f).dot(away)).atan2(spine(f).z));
        if leans[t] > 0.35 {
            assert!((got - true_lean).abs() < 0.2, "frame {t}: {got} of {true_lean} rad");
        }
    }
    assert_eq!(found.rules, Motion::Physical);
}
