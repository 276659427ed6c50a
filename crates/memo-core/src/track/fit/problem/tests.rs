use super::super::lines::{Sample, SurfacePoint};
use super::super::unknowns::{
    ALONG, CROWN, FRAME_ANGLES, HEIGHT, JOINTS, SHANK, THIGH, THIGH_OVER_SHANK, WHOLE, WHOLE_GROUND, angles,
    excess,
};
use super::cost::{importance, is_sole, robust};
use super::outcome::{Form, arms_seen};
use super::*;
use crate::estimate::arrow::Arrow;
use crate::image::Image;
use crate::model::Body;
use crate::model::body::Part;
use crate::synth::scene::{SceneOptions, SynthScene, Truth};
use crate::track::fit::{FitQuality, PartQuality};
use crate::track::search::tests::{camera, walker};
use glam::DVec3;
use nalgebra::DVector;

#[test]
fn a_short_walk_and_an_empty_picture_are_no_person() {
    let (camera, walker, options) = (camera(), walker(), FitOptions::default());
    let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
    let grey = Image::filled(640, 480, 90u8);
    let frame = |k: usize| FitFrame {
        time_s: 0.04 * k as f64,
        view: View {
            corner: [0, 0],
            pixels: View::paired(&grey, |y| grey.row(y)),
            is_empty_known: true,
            others: Vec::new(),
            crown_px: None,
        },
        visible: 1.0,
        start: Hypothesis { along_m: 0.05 * k as f64, height_m: 0.9, phase: 0.04 * k as f64 },
    };
    let fit = |count: usize| {
        let frames: Vec<FitFrame> = (0..count).map(frame).collect();
        let route = path.into();
        let problem = Problem::new(&camera, &walker, &route, &frames, &options);
        problem.fit(problem.glance(0.0)?.gait, Some(0.1))
    };
    assert_eq!(fit(14), Err(FitError::TooFewFrames { got: 14 }));
    assert_eq!(fit(15), Err(FitError::Undetermined));
}

#[test]
fn far_edges_cost_at_most_one_and_weigh_as_their_cost_rises() {
    for x in [0.0, 0.3, 1.0, 2.5, 8.0f64] {
        let [cost, weight] = robust(x);
        let rise = (robust(x + 1e-6)[0] - robust(x - 1e-6)[0]) / 2e-6;
        assert!((rise - 2.0 * x * weight).abs() < 1e-8, "{x}");
        assert!(cost < 1.0);
    }
}

fn scene(frames: usize) -> SceneOptions {
    SceneOptions { seed: 3, frames, empty_frames: 4, noise_sd: 1.0, ..SceneOptions::default() }
}

/// A walker drawn by the model, and the frames in which the fit finds it at the true places and phases.
pub struct Drawn {
    pub camera: Camera,
    pub walker: Walker,
    pub route: Route,
    pub frames: Vec<FitFrame>,
}

fn drawn() -> Drawn {
    drawn_for(24)
}

pub fn drawn_for(frames: usize) -> Drawn {
    let scene = SynthScene::new(scene(frames)).unwrap();
    let background = scene.frame(0);
    let frame = |truth: Truth| {
        let half_torso_m = 0.5 * scene.walker.body.torso_length_m();
        let height_m = truth.posed.torso_centre.z - half_torso_m;
        FitFrame {
            time_s: truth.time_s,
            view: View {
                corner: [0, 0],
                pixels: View::paired(&scene.frame(truth.frame), |y| background.row(y)),
                is_empty_known: true,
                others: Vec::new(),
                crown_px: None,
            },
            visible: 1.0,
            start: Hypothesis { height_m, ..truth.hypothesis },
        }
    };
    let mut frames: Vec<FitFrame> = (0..scene.len()).filter_map(|k| scene.truth(k)).map(frame).collect();
    for k in 1..frames.len() {
        let step = (frames[k].start.phase - frames[k - 1].start.phase).rem_euclid(1.0);
        frames[k].start.phase = frames[k - 1].start.phase + step;
    }
    Drawn { camera: scene.camera, walker: scene.walker, route: scene.path.into(), frames }
}

/// Frames enough for a step of either leg.
pub const TWO_STEPS: usize = 44;

/// The frames of somebody with the mean joint curves of people, but for a knee, of the side 0 or 1, whose flexion is smaller
/// by a share.
fn with_a_stiff_knee(side: usize, share: f64) -> Drawn {
    drawn_otherwise(|gait, whole| flatten(gait, whole, 1, side, share))
}

/// The frames of somebody with the mean joint curves of people, but for some unknowns of the whole.
fn drawn_otherwise(change: impl Fn(&Gait, &mut [f64])) -> Drawn {
    let mut drawn = drawn_for(TWO_STEPS);
    let scene = SynthScene::new(scene(TWO_STEPS)).unwrap();
    let background = scene.frame(0);
    let options = FitOptions::default();
    let pictures: Vec<Image<u8>> = {
        let problem = Problem::new(&drawn.camera, &drawn.walker, &drawn.route, &drawn.frames, &options);
        let mut unknowns = problem.start(0.0);
        change(&drawn.walker.gait, &mut unknowns.whole);
        let shown = (0..scene.len()).filter(|&k| scene.truth(k).is_some()).enumerate();
        shown.map(|(n, k)| scene.frame_of(k, Some(&problem.figure(&unknowns, n).posed))).collect()
    };
    for (frame, picture) in drawn.frames.iter_mut().zip(&pictures) {
        frame.view.pixels = View::paired(picture, |y| background.row(y));
    }
    drawn
}

/// The fit starts from the average gait or from a stiff knee of the right side, and finds how the knee moves.
#[test]
fn a_stiff_knee_is_measured() {
    for (side, share) in [(0, 0.0), (0, 0.7), (1, 0.5), (1, 0.7)] {
        let Drawn { camera, walker, route, frames } = with_a_stiff_knee(side, share);
        let options = FitOptions::default();
        let problem = Problem::new(&camera, &walker, &route, &frames, &options);
        let (start, gait) = problem.best_start(0.0).unwrap();
        let is_stiff = gait == StartGait::StiffKnee(side);
        assert!(gait == StartGait::Average || share > 0.0 && is_stiff, "{side} {share}: {gait:?}");
        let fitted = problem.finished(start).unwrap().unknowns;
        let mut drawn = problem.start(0.0);
        flatten(&walker.gait, &mut drawn.whole, 1, side, share);
        let knees = |unknowns: &Unknowns, k: usize| {
            let posture = posture(&walker.gait, &unknowns.whole, &unknowns.frames[k]);
            [posture.right.knee, posture.left.knee]
        };
        let off =
            |k: usize| knees(&fitted, k).into_iter().zip(knees(&drawn, k)).map(|(a, b)| (a - b).powi(2));
        let squares: f64 = (0..frames.len()).flat_map(off).sum();
        let rms_deg = (squares / (2 * frames.len()) as f64).sqrt().to_degrees();
        assert!(rms_deg < 1.5, "{side} {share}: {rms_deg}");
    }
}

/// The forms of which standard deviations are stated are how the means over all frames change with the unknowns.
#[test]
fn means_change_as_their_forms_say() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let start = problem.start(0.0);
    let count = frames.len();
    // The means over the frames of ten angles, of the place of the torso along the path and in height, and of the phase.
    let means = |unknowns: &Unknowns| {
        let mut sums = [0.0; 13];
        for (k, frame) in unknowns.frames.iter().enumerate() {
            let torso = problem.figure(unknowns, k).posed.torso_centre;
            let angles = angles(&walker.gait, &unknowns.whole, frame);
            let place = [route.along(torso.truncate(), frame[FRAME_ALONG]), torso.z, frame[FRAME_PHASE]];
            sums.iter_mut().zip(angles.into_iter().chain(place)).for_each(|(sum, x)| *sum += x);
        }
        sums.map(|sum| sum / count as f64)
    };
    let angle_forms: Vec<_> = (0..count).map(|k| problem.angle_forms(&start, k)).collect();
    let place_forms: Vec<_> = (0..count).map(|k| problem.place_forms(&start, k)).collect();
    let of_angles = (0..2 * JOINTS).map(|at| Form::mean(angle_forms.iter().map(|forms| &forms[at])));
    let of_place = [0, 2, 3].map(|at| Form::mean(place_forms.iter().map(|forms| &forms[at])));
    let forms: Vec<Form> = of_angles.chain(of_place).map(Option::unwrap).collect();
    // Every unknown of the joints, the place and the phase is moved by another small amount.
    let moved = |sign: f64| {
        let mut unknowns = start.clone();
        let steps = (0..).map(|n| sign * 1e-5 * f64::from(n % 7 - 3));
        unknowns.whole.iter_mut().zip(steps.clone()).for_each(|(x, step)| *x += step);
        unknowns.frames.iter_mut().flatten().zip(steps).for_each(|(x, step)| *x += step);
        unknowns
    };
    let ends = [moved(1.0), moved(-1.0)];
    let step = |of: fn(&Unknowns) -> Vec<f64>, at: usize| of(&ends[0])[at] - of(&ends[1])[at];
    let [after, before] = ends.each_ref().map(means);
    for (n, form) in forms.iter().enumerate() {
        let whole = form.whole.iter().map(|&(at, a)| a * step(|u| u.whole.clone(), at));
        let frames = form.frames.iter().map(|&(at, a)| a * step(|u| u.frames.concat(), at));
        let said: f64 = whole.chain(frames).sum();
        // A torso that sways to the side of a turned path is not said to be farther along it.
        let near = if n == 2 * JOINTS { 2e-7 } else { 1e-9 };
        assert!((after[n] - before[n] - said).abs() < near, "{n}: {} and {said}", after[n] - before[n]);
    }
    assert!(Form::mean([].iter()).is_none());
}

/// The standard deviation of the mean of an angle of a leg is smaller than those of single frames.
#[test]
fn means_are_stated_narrower_than_frames() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let fit = problem.fit(problem.glance(0.0).unwrap().gait, Some(0.1)).unwrap();
    for (side, of_side) in fit.mean_sd.angles.iter().enumerate() {
        for (joint, of_joint) in of_side.iter().enumerate() {
            let stated: Vec<f64> =
                fit.frames.iter().filter_map(|f| Some(f.measured[side].angles[joint]?[1])).collect();
            assert_eq!(of_joint.is_some(), !stated.is_empty(), "{side} {joint}");
            let least = stated.iter().copied().fold(f64::INFINITY, f64::min);
            assert!(joint > 1 || of_joint.unwrap() < least, "{side} {joint}: {of_joint:?} and {least}");
        }
    }
}

/// What the contours say about the place along the path when the model stands beside the person.
#[test]
fn edges_count_the_less_the_farther_they_are() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let mut unknowns = problem.start(0.0);
    unknowns.whole.fill(0.0);
    let width = problem.last_start_width(&unknowns).unwrap();
    let px_m = problem.height_px(&unknowns).unwrap() / walker.body.height_m;
    let mut said = |scales: f64| {
        unknowns.frames[10][FRAME_ALONG] += scales * width.scale_px / px_m;
        let (_, normal, ..) = problem.figure_terms(&unknowns, 10, &width, &mut Room::default());
        unknowns.frames[10][FRAME_ALONG] -= scales * width.scale_px / px_m;
        normal[(ALONG, ALONG)]
    };
    let [at, one, two] = [0.0, 1.0, 2.0].map(&mut said);
    assert!(one < 0.6 * at && two < 0.3 * at, "{at} {one} {two}");
}

/// Changes that end farther from the head than hair makes of it draw the head there.
#[test]
fn the_crown_of_the_changes_draws_the_head_to_it() {
    let Drawn { camera, walker, route, mut frames } = drawn();
    let options = FitOptions::default();
    let mut said = |off: Option<f64>| {
        let at = |frames: &[FitFrame], crown_px: f64| {
            let problem = Problem::new(&camera, &walker, &route, frames, &options);
            let mut unknowns = problem.start(0.0);
            unknowns.whole.fill(0.0);
            let width = problem.last_start_width(&unknowns).unwrap();
            let (figure, _, right, _) = problem.figure_terms(&unknowns, 10, &width, &mut Room::default());
            let (top, _) = problem.crown(&figure, crown_px).unwrap();
            (right[HEIGHT], camera.project(top.world).unwrap().y, width.height_px)
        };
        frames[10].view.crown_px = None;
        let (_, row, height_px) = at(&frames, 0.0);
        frames[10].view.crown_px = off.map(|off| row - off * height_px);
        at(&frames, 0.0).0
    };
    let alone = said(None);
    for off in [-0.01, 0.0, 0.01] {
        assert_eq!(said(Some(off)), alone, "{off}");
    }
    let [below, above, farther] = [-0.05, 0.05, 0.1].map(|off| said(Some(off)) - alone);
    assert!(below < 0.0 && above > 0.0 && farther > 2.0 * above, "{below} {above} {farther}");
}

/// A step may throw the person in front of the lens, where contours are as long as one likes.
#[test]
fn a_body_close_to_the_camera_has_no_more_samples_than_the_picture_has_room_for() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let mut unknowns = problem.start(0.0);
    let width = problem.last_start_width(&unknowns).unwrap();
    let ahead = DVec2::from_angle(problem.route_heading_rad());
    let to_eye = (camera.position() - problem.figure(&unknowns, 10).pelvis).truncate();
    unknowns.frames[10][FRAME_ALONG] += to_eye.dot(ahead);
    // Both sides of each part, from end to end of the picture.
    let [columns, rows] = camera.size.map(f64::from);
    let most = 2.0 * 14.0 * columns.hypot(rows) / width.spacing_px();
    let mut work = Workspace::default();
    for mm in -400..400 {
        unknowns.whole[WHOLE_ACROSS] = to_eye.dot(ahead.perp()) + 0.001 * f64::from(mm);
        let figure = problem.figure(&unknowns, 10);
        samples(&figure, &[], &camera, &unknowns.whole, width.spacing_px(), &mut work);
        assert!(work.samples.len() as f64 <= most, "{mm} mm: {}", work.samples.len());
    }
}

/// A place that no contour shows is where the places before and after say.
#[test]
fn places_and_phases_change_their_speed_little_from_frame_to_frame() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let mut unknowns = problem.start(0.0);
    let smooth = unknowns.frames[7];
    for (unknown, off) in [(FRAME_ALONG, 0.1), (FRAME_HEIGHT, -0.05), (FRAME_PHASE, 0.1)] {
        unknowns.frames[7][unknown] += off;
        let mut arrow = Arrow::new(frames.len(), FRAME_ANGLES, WHOLE);
        problem.add_priors(&unknowns, FRAME_ANGLES, &mut arrow);
        // All other frames are known to a millimetre or a thousandth of a cycle.
        for k in (0..frames.len()).filter(|&k| k != 7) {
            (0..FRAME_ANGLES).for_each(|n| arrow.add_row(&[(arrow.index(k, n), 1.0)], 0.0, 1e6));
        }
        (0..FRAME_ANGLES).for_each(|n| arrow.add_row(&[(arrow.index(7, n), 1.0)], 0.0, 1e-3));
        let step = arrow.solve().unwrap().frames[7 * FRAME_ANGLES + unknown];
        assert!((step + off).abs() < 0.05 * off.abs(), "{unknown}: {step} instead of {}", -off);
        unknowns.frames[7] = smooth;
    }
}

/// Where the edges show nothing, legs are long or short as a whole.
#[test]
fn thigh_and_shank_differ_less_than_legs() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let [thigh, of_shank] = [THIGH, SHANK].map(|at| problem.priors[at].sd);
    let terms = problem.size_terms(&[(THIGH, 1.0), (SHANK, -1.0)]);
    // Student's t of four degrees of freedom holds those of unusual legs less.
    for (off_sd, weight) in [(0.0, 5.0 / 4.0), (2.0, 5.0 / 8.0), (6.0, 5.0 / 40.0)] {
        let mut start = problem.start(0.0);
        start.whole[CROWN] -= excess(&start.whole);
        start.whole[THIGH] += 0.5 * off_sd * THIGH_OVER_SHANK.sd;
        start.whole[SHANK] -= 0.5 * off_sd * THIGH_OVER_SHANK.sd;
        let mut arrow = Arrow::new(frames.len(), FRAME, WHOLE);
        problem.add_priors(&start, FRAME, &mut arrow);
        for frame in 0..frames.len() {
            (0..FRAME_ANGLES)
                .for_each(|unknown| arrow.add_row(&[(arrow.index(frame, unknown), 1.0)], 0.0, 1.0));
        }
        let sd = arrow.solve().unwrap().covariance().variance(&terms, &[]).sqrt();
        let of_legs = weight * THIGH_OVER_SHANK.sd.powi(-2);
        let expected = (thigh.hypot(of_shank).powi(-2) + of_legs).recip().sqrt();
        assert!((sd - expected).abs() < 1e-9, "{off_sd}: {sd} {expected}");
    }
    // The mean is that of the average walker.
    assert!((problem.priors[THIGH].mean - problem.priors[SHANK].mean - THIGH_OVER_SHANK.mean).abs() < 1e-12);
}

/// A sample of the upright side of a part.
fn sample(part: Part, is_outer: bool) -> Sample {
    let point = SurfacePoint { part, world: DVec3::ZERO, radius: DVec3::Y, z: 0.0, taper: 0.0 };
    Sample { point, point_px: DVec2::ZERO, normal: DVec2::X, is_outer }
}

#[test]
fn contours_inside_the_body_and_of_shoes_count_less_than_the_outline() {
    let of = |part, is_outer| importance(&sample(part, is_outer));
    assert_eq!(of(Part::RightShank, true), 1.0);
    assert_eq!(of(Part::RightShank, false), 0.25);
    assert_eq!(of(Part::Torso, false), 0.25);
    assert_eq!(of(Part::LeftFoot, true), 0.5);
    assert_eq!(of(Part::LeftForearm, true), 0.3);
    let mut top = sample(Part::LeftThigh, true);
    top.point.z = 0.9;
    assert_eq!([importance(&top), of(Part::LeftThigh, true)], [0.3, 1.0]);
}

#[test]
fn an_arm_that_the_model_misses_was_not_measured() {
    let missing = |part: Part, missed: f64| {
        let mut quality = FitQuality::default();
        quality.parts[part as usize] = Some(PartQuality { share: 0.05, missed, residual_px: Some(1.5) });
        arms_seen(&quality)
    };
    let all = [[true; JOINTS]; 2];
    assert_eq!(missing(Part::RightForearm, 0.05), all);
    assert_eq!(missing(Part::LeftHand, 0.9), all);
    assert_eq!(missing(Part::RightForearm, 0.38), [[true, true, true, true, false], all[1]]);
    assert_eq!(missing(Part::LeftUpperArm, 0.26), [all[0], [true, true, true, false, false]]);
}

/// Not the instep, the toes, the inner lines of a foot and the lower borders of other parts.
#[test]
fn the_lower_border_of_a_foot_is_a_sole() {
    let below = DVec2::new(0.3, 0.9).normalize();
    let of = |normal, part, is_outer| is_sole(&Sample { normal, ..sample(part, is_outer) });
    for foot in [Part::LeftFoot, Part::RightFoot] {
        assert!(of(below, foot, true));
        assert!(!of(-below, foot, true) && !of(DVec2::X, foot, true) && !of(below, foot, false));
    }
    assert!(!of(below, Part::RightShank, true));
}

/// What soles say of the height of the person: in the last steps a tenth, and in the cost all of it.
#[test]
fn soles_move_the_person_less_in_the_last_steps() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let problem = Problem::new(&camera, &walker, &route, &frames, &options);
    let mut unknowns = problem.start(0.0);
    unknowns.whole.fill(0.0);
    let height_px = problem.height_px(&unknowns).unwrap();
    let said = |width: &Width| {
        let (_, normal, _, seen) = problem.figure_terms(&unknowns, 10, width, &mut Room::default());
        (normal[(HEIGHT, HEIGHT)], seen.cost)
    };
    let of_step = |n: usize, sole: Option<f64>| {
        let width = problem.width(n, height_px);
        said(&Width { sole: sole.unwrap_or(width.sole), ..width })
    };
    for (n, counts) in [(0, 1.0), (FRAMES_STEP - 1, 1.0), (FRAMES_STEP, SOLE), (11, SOLE)] {
        let (now, cost) = of_step(n, None);
        let ((with, _), (without, _)) = (of_step(n, Some(1.0)), of_step(n, Some(0.0)));
        assert!(with > 1.01 * without, "{n}: soles say nothing, {with} {without}");
        assert!((now - without - counts * (with - without)).abs() < 1e-6 * with, "{n}: {now}");
        assert_eq!(cost, of_step(n, Some(0.0)).1, "{n}");
    }
    // The height of a person of any height comes from the soles.
    let problem = problem.of_any_height();
    assert!((0..12).all(|n| problem.width(n, height_px).sole == 1.0));
}

/// Of a person of whom half is hidden, the same outlines are half of the evidence.
#[test]
fn the_sides_of_who_is_hidden_in_part_are_less_certain() {
    let Drawn { camera, walker, route, mut frames } = drawn();
    let options = FitOptions::default();
    let fitted = |cost: f64| {
        let mut arrow = Arrow::new(1, 1, 1);
        arrow.add_row(&[(0, 1.0)], 0.0, 1.0);
        arrow.add_whole_row(&[(0, 1.0)], 0.0, 1.0);
        Fitted {
            unknowns: Unknowns { whole: vec![0.0; WHOLE], frames: Vec::new() },
            seen: Seen { cost, inner: 100.0, outer: 500.0, ..Seen::default() },
            solution: arrow.solve().unwrap(),
            height_px: 300.0,
        }
    };
    let mut log_odds = || {
        let problem = Problem::new(&camera, &walker, &route, &frames, &options);
        let p = problem.p_other_sides(&fitted(10.0), &fitted(12.0), 0.5);
        frames.iter_mut().step_by(2).for_each(|frame| frame.visible = 0.0);
        ((1.0 - p) / p).ln()
    };
    let [whole, half] = [log_odds(), log_odds()];
    assert!(whole > 0.5 && (half - 0.5 * whole).abs() < 1e-9, "{whole} {half}");
}

/// From a start that faces 0.15 radians to the side, a fit turns back; the same with its heading held does not.
/// Of a wholly visible person, the first steps reach the trunk from the mean.
#[test]
fn the_trunk_of_who_is_hidden_in_part_may_lean_more_than_others() {
    for (lean_rad, is_forward) in [(-0.2, false), (0.26, true)] {
        let mut drawn = drawn_otherwise(|_, whole| whole[WHOLE_LEAN] = lean_rad);
        let options = FitOptions::default();
        let gait = |frames: &[FitFrame]| {
            let problem = Problem::new(&drawn.camera, &drawn.walker, &drawn.route, frames, &options);
            problem.glance(0.0).unwrap().gait
        };
        assert_eq!(gait(&drawn.frames), StartGait::Average);
        drawn.frames.iter_mut().for_each(|frame| frame.visible = 0.7);
        assert_eq!(gait(&drawn.frames), StartGait::Leaning { is_forward });
    }
}

#[test]
fn a_heading_that_is_held_is_that_of_the_route() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let true_path = route.at(0.0);
    let beside = Path { heading_rad: true_path.heading_rad + 0.15, ..true_path };
    let route = Route::from(beside);
    let problem = Problem::new(&camera, &walker, &route, &frames, &options).on_treadmill();
    let (start, _) = problem.best_start(0.0).unwrap();
    let free = problem.finished(start).unwrap();
    let (held, fitted) = problem.with_heading_held(&free).unwrap();
    let off_rad =
        [problem.heading_rad(&free), held.heading_rad(&fitted)].map(|h| h - problem.route_heading_rad());
    assert!(off_rad[0] < -0.05, "{off_rad:?}");
    assert!(off_rad[1].abs() < 1e-4, "{off_rad:?}");
    assert!(held.quality(&fitted).cost > problem.quality(&free).cost, "it fits less well");
}

/// The picture shows how tall somebody is, whatever height the fit starts from.
#[test]
fn the_measured_height_does_not_depend_on_the_given_one() {
    let seen_m = |share: f64| {
        let Drawn { camera, mut walker, route, frames } = drawn_for(TWO_STEPS);
        let true_m = walker.body.height_m;
        walker.body.height_m *= share;
        let options = FitOptions::default();
        let problem = Problem::new(&camera, &walker, &route, &frames, &options).of_any_height();
        let fit = problem.fit(StartGait::Average, None).unwrap();
        (fit.height.unwrap().height_m, true_m)
    };
    let (from_the_true, true_m) = seen_m(1.0);
    assert!((from_the_true / true_m - 1.0).abs() < 0.03, "{from_the_true} of {true_m}");
    for share in [0.9, 0.95, 1.05] {
        let (height_m, _) = seen_m(share);
        assert!((height_m / from_the_true - 1.0).abs() < 0.005, "{share}: {height_m} for {from_the_true}");
    }
}

/// Lengths of somebody of another height are those of the mean person, enlarged.
#[test]
fn the_limbs_of_a_taller_person_are_longer() {
    let Drawn { camera, walker, route, frames } = drawn();
    let options = FitOptions::default();
    let mut problem = Problem::new(&camera, &walker, &route, &frames, &options);
    problem.excess = Prior { mean: 0.1, sd: 1e-6 };
    let start = problem.start(0.0);
    let mut arrow = Arrow::new(frames.len(), FRAME, WHOLE);
    problem.add_priors(&start, FRAME, &mut arrow);
    for frame in 0..frames.len() {
        (0..FRAME_ANGLES).for_each(|unknown| arrow.add_row(&[(arrow.index(frame, unknown), 1.0)], 0.0, 1.0));
    }
    let solution = arrow.solve().unwrap();
    let body = body(&walker.body, (&solution.whole + DVector::from_vec(start.whole.clone())).as_slice());
    let mean = super::super::unknowns::body(&walker.body, &start.whole);
    let lengths = |body: &Body| {
        let p = body.proportions;
        [
            p.hip_height - p.knee_height,
            p.knee_height - p.ankle_height,
            p.upper_arm,
            p.foot,
            p.shoulder_half_width,
        ]
    };
    for (n, (taller, mean)) in lengths(&body).into_iter().zip(lengths(&mean)).enumerate() {
        assert!((taller / mean - 1.1).abs() < 0.005, "{n}: {taller} {mean}");
    }
}

/// Of a person whose height is known, the ground is found where the picture has it and not where the model of the camera does.
#[test]
fn the_ground_may_be_elsewhere_than_in_the_model_of_the_camera() {
    let Drawn { camera, walker, route, frames } = drawn_for(TWO_STEPS);
    let options = FitOptions { height_sd: 1e-3, ..FitOptions::default() };
    let ground_m = |raised_m: f64| {
        let translation = camera.translation - camera.rotation * (raised_m * DVec3::Z);
        let camera = Camera { translation, ..camera.clone() };
        let problem = Problem::new(&camera, &walker, &route, &frames, &options);
        let (start, _) = problem.best_start(0.0).unwrap();
        problem.finished(start).unwrap().unknowns.whole[WHOLE_GROUND]
    };
    let rises_m = ground_m(0.02) - ground_m(0.0);
    assert!((0.01..0.02).contains(&rises_m), "{rises_m}");
}
