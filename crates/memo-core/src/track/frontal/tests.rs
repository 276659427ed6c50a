use super::super::decisions::HINDSIGHT_GAIN;
use super::super::search::tests::{camera, walker};
use super::super::walk::FrameEdges;
use super::reach::LEAD;
use super::*;
use crate::image::Rectangle;
use crate::model::body::Part;
use crate::track::locate::MASK_MARGIN_PX;
use glam::DVec3;

const FRAME_S: f64 = 0.04;
const STEP_S: f64 = 0.5;
pub const SPEED_MPS: f64 = 1.2;
/// The middle of the picture, and where the walk is half-way through it.
pub const MIDDLE: DVec2 = DVec2::new(0.0, 0.0);

/// A frame in which the lowest changes are at a point of the ground.
fn frame(k: usize, place: DVec2) -> (Option<Sighting>, FrameEdges) {
    let sole = camera().project(place.extend(0.0)).unwrap();
    let [column, bottom] = [sole.x.round() as usize, (sole.y + MASK_MARGIN_PX).round() as usize];
    let rectangle = Rectangle { left: column - 30, right: column + 30, top: bottom - 200, bottom };
    let (window, time_s) = (rectangle, FRAME_S * k as f64);
    let edges = FrameEdges::of_one_alone(k, time_s, window, vec![]);
    (Some(Sighting { time_s, rectangle }), edges)
}

pub fn standing(count: usize, foot: impl Fn(f64) -> DVec2) -> Standing {
    let kept = (0..count).map(|k| frame(k, foot(FRAME_S * k as f64))).collect();
    Standing { kept, ..Standing::default() }
}

/// Towards the camera, which looks along the y axis.
pub fn towards() -> DVec2 {
    (camera().position().truncate() - MIDDLE).normalize()
}

/// The nearer foot of a model that walks evenly, seen `LEAD` too early: the right heel strikes at 0, the left one a step
/// later. The picture is rendered and seen elsewhere, in the clothed walks.
pub fn feet_of_steps(time_s: f64) -> DVec2 {
    let walker = walker();
    let phase = 0.5 * time_s / STEP_S + LEAD[0];
    let along_m = SPEED_MPS * time_s - 1.2;
    let height_m = walker.level_torso_height_m() + walker.gait.vertical_m(phase);
    let torso = (MIDDLE + towards() * along_m).extend(height_m);
    let posed = walker.pose(torso, towards().to_angle(), phase);
    let pixels = [posed.right.ankle, posed.left.ankle]
        .map(|ankle| camera().project_ideal(ankle - 0.055 * DVec3::Z).unwrap());
    let lower = if pixels[0].y > pixels[1].y { pixels[0] } else { pixels[1] };
    camera().ground_point(lower).unwrap().truncate()
}

/// The same, but of a foot that has stood for 0.1 to 0.3 s nothing is seen: then it is the sole of the foot that swings.
fn moving_feet(time_s: f64) -> DVec2 {
    if !(0.1..0.3).contains(&time_s.rem_euclid(STEP_S)) {
        return feet_of_steps(time_s);
    }
    let walker = walker();
    let phase = 0.5 * time_s / STEP_S + LEAD[0];
    let height_m = walker.level_torso_height_m() + walker.gait.vertical_m(phase);
    let torso = (MIDDLE + towards() * (SPEED_MPS * time_s - 1.2)).extend(height_m);
    let posed = walker.pose(torso, towards().to_angle(), phase);
    let lowest = [posed.right, posed.left].map(|side| side.ankle - 0.055 * DVec3::Z);
    let feet = [Part::RightFoot, Part::LeftFoot].map(|foot| &posed.cylinders[foot as usize]);
    let swings = usize::from(lowest[1].z > lowest[0].z);
    let axis = feet[swings].world_from_cylinder.matrix3.z_axis;
    let middle = 0.5 * (lowest[swings] + feet[swings].centre() + feet[swings].half_length * axis);
    let on_ground = camera().ground_point(camera().project_ideal(middle).unwrap()).unwrap();
    // On the line below the torso, as rectangles are.
    MIDDLE + towards() * (on_ground.truncate() - MIDDLE).dot(towards())
}

/// The same rectangle by both kinds of changes.
fn lowest(sighting: Option<Sighting>) -> Lowest {
    Lowest { firm: sighting, all: sighting }
}

fn begun(standing: &Standing) -> Option<Frontal> {
    Frontal::begin(standing, &camera(), &walker(), &CadenceRange::default())
}

#[test]
fn steps_towards_the_camera_show_path_speed_and_cadence() {
    let frontal = begun(&standing(66, feet_of_steps)).unwrap();
    let beginning = frontal.beginning();
    assert!(frontal.route.at(0.0).direction().dot(towards()) > 0.998, "{:?}", frontal.route);
    assert!((beginning.speed_mps - SPEED_MPS).abs() < 0.06, "{beginning:?}");
    assert!((beginning.rate_hz - 0.5 / STEP_S).abs() < 0.03, "{beginning:?}");
    for pace in &frontal.paces {
        let off = 2.0 * pace.phase - pace.time_s / STEP_S;
        assert!((off - off.round()).abs() < 0.06, "{}: {off}", pace.time_s);
        assert!(
            (pace.along_m - frontal.route.at(0.0).along(MIDDLE) + 1.2 - SPEED_MPS * pace.time_s).abs() < 0.05
        );
    }
}

/// The foot that swings behind the one that stands is part of the rhythm, and no outlier.
#[test]
fn feet_that_are_seen_only_while_they_move_show_steps_as_well() {
    let standing = standing(66, moving_feet);
    let sightings = standing.sightings();
    let gain = |by_all: bool| {
        Frontal::on_line(&sightings, by_all, &camera(), &walker(), &CadenceRange::default()).unwrap().0
    };
    assert!(gain(false) > gain(true) + 1.0, "{} {}", gain(false), gain(true));
    let frontal = begun(&standing).unwrap();
    let start_m = frontal.route.at(0.0).along(MIDDLE) - 1.2;
    for pace in &frontal.paces {
        let off = 2.0 * pace.phase - pace.time_s / STEP_S;
        assert!((off - off.round()).abs() < 0.1, "{}: {off}", pace.time_s);
        let off_m = pace.along_m - start_m - SPEED_MPS * pace.time_s;
        assert!(off_m.abs() < 0.1, "{}: {off_m}", pace.time_s);
    }
}

#[test]
fn even_motion_and_noise_about_it_start_nobody() {
    let even = |t: f64| MIDDLE + towards() * (SPEED_MPS * t - 1.2);
    assert!(begun(&standing(66, even)).is_none());
    // Rocking at the rate of steps, but by much less than legs reach, and noise.
    let rocking = |t: f64| even(t) + towards() * 0.04 * (t / STEP_S * std::f64::consts::TAU).sin();
    assert!(begun(&standing(66, rocking)).is_none());
    let noisy = |t: f64| even(t) + towards() * 0.3 * ((t * 1e4).sin() * 43_758.5).fract();
    assert!(begun(&standing(66, noisy)).is_none());
    // What stays, and what cannot be seen on the ground.
    assert!(begun(&standing(66, |_| MIDDLE)).is_none());
    assert!(begun(&Standing::default()).is_none());
}

#[test]
fn a_path_far_beside_the_line_of_sight_starts_nobody() {
    let turned = |deg: f64| {
        let turn = DVec2::from_angle(deg.to_radians());
        standing(66, move |t| MIDDLE + turn.rotate(feet_of_steps(t) - MIDDLE))
    };
    assert!(begun(&turned(20.0)).is_some() && begun(&turned(-20.0)).is_some());
    assert!(begun(&turned(45.0)).is_none() && begun(&turned(-45.0)).is_none());
}

#[test]
fn frames_without_feet_lead_on_and_further_frames_are_solved() {
    let mut frontal = begun(&standing(66, feet_of_steps)).unwrap();
    let (seen, speed_mps) = (frontal.seen(), frontal.beginning().speed_mps);
    assert_eq!(seen, 66);
    for k in 66..76 {
        frontal.push(FRAME_S * k as f64, &Lowest::default());
    }
    assert_eq!((frontal.seen(), frontal.paces.len()), (66, 76));
    let led = frontal.paces[75].along_m - frontal.paces[65].along_m;
    assert!((led - speed_mps * 10.0 * FRAME_S).abs() < 0.05, "{led}");
    for k in 76..90 {
        let sighting = frame(k, feet_of_steps(FRAME_S * k as f64)).0;
        frontal.push(FRAME_S * k as f64, &lowest(sighting));
        assert!(frontal.solve(frontal.paces.len() - 60).is_some());
    }
    let last = frontal.paces[89];
    let true_m = SPEED_MPS * last.time_s - 1.2;
    let place = frontal.route.at(0.0).point(last.along_m, 0.0).truncate();
    assert!((place.dot(towards()) - true_m).abs() < 0.2, "{place}, {true_m}");
    // Held frames stay where they are.
    let before = frontal.paces[40];
    frontal.solve(40);
    assert!((frontal.paces[40].along_m - before.along_m).abs() < 1e-3);
}

#[test]
fn the_path_is_that_of_all_feet_in_the_end() {
    // At first somebody drifts sideways.
    let across = |t: f64| 0.16 * (2.0 - t).max(0.0) * towards().perp();
    let place = |t: f64| feet_of_steps(t) + across(t);
    let mut frontal = begun(&standing(50, place)).unwrap();
    for k in 50..130 {
        frontal.push(FRAME_S * k as f64, &lowest(frame(k, place(FRAME_S * k as f64)).0));
    }
    let off_deg =
        |frontal: &Frontal| towards().angle_to(frontal.route.at(0.0).direction()).to_degrees().abs();
    assert!(off_deg(&frontal) > 7.0, "{}", off_deg(&frontal));
    let (renewed, variances) = frontal.on_path_of_all().unwrap();
    assert!(off_deg(&renewed) < 3.0, "{}", off_deg(&renewed));
    assert_eq!((renewed.paces.len(), variances.len()), (130, 130));
    for pace in &renewed.paces {
        let body = MIDDLE + towards() * (SPEED_MPS * pace.time_s - 1.2);
        let off = renewed.route.at(0.0).point(pace.along_m, 0.0).truncate() - body;
        let most_m = 0.1 + across(pace.time_s).length();
        assert!(off.length() < most_m, "{}: {off} m", pace.time_s);
    }
    assert!(variances.iter().flatten().all(|variance| *variance > 0.0 && *variance < 0.01));
}

/// A frame's own measurement lies where the body is; feet that are far off move neither place nor phase.
#[test]
fn feet_measure_the_place_of_the_body_and_outliers_move_nothing() {
    let spoilt = |t: f64| {
        let is_off = (t / FRAME_S).round() as usize % 5 == 2;
        feet_of_steps(t) - if is_off { 1.2 * towards() } else { DVec2::ZERO }
    };
    let mut frontal = begun(&standing(66, feet_of_steps)).unwrap();
    for k in 66..130 {
        frontal.push(FRAME_S * k as f64, &lowest(frame(k, spoilt(FRAME_S * k as f64)).0));
    }
    frontal.solve(0).unwrap();
    let still = ConstantVelocity::new(0.0, 0.0, 1.0, 1.0);
    let before = State { along: still, height: still, phase: still };
    let start_m = frontal.route.at(0.0).along(MIDDLE) - 1.2;
    for k in 0..130 {
        let pace = frontal.paces[k];
        let true_m = start_m + SPEED_MPS * pace.time_s;
        assert!((pace.along_m - true_m).abs() < 0.08, "{k}: {} of {true_m}", pace.along_m);
        let state = frontal.state(k, 0, [0.01, 0.01], &before);
        let measured_m = frontal.measured(k, &state).unwrap().along_m;
        let expected_m = if k >= 66 && k % 5 == 2 { true_m - 1.2 } else { true_m };
        assert!((measured_m - expected_m).abs() < 0.1, "{k}: {measured_m} of {expected_m}");
    }
}

/// Feet whose errors are alike in neighbouring frames: places are off by about as much as is stated.
#[test]
fn the_stated_variance_is_that_of_errors_that_last_for_frames() {
    let (mut sum, mut count) = (0.0, 0.0);
    for draw in 0..12u64 {
        let mut random = crate::synth::Random::new(draw);
        let blocks: Vec<f64> = (0..40).map(|_| REACH_SD_M * f64::from(random.normal_pair()[0])).collect();
        let place = |t: f64| {
            let block = (t / FRAME_S / LIKE_FRAMES).round() as usize;
            feet_of_steps(t) + blocks[block] * towards()
        };
        let Some(mut frontal) = begun(&standing(66, place)) else { continue };
        for k in 66..110 {
            frontal.push(FRAME_S * k as f64, &lowest(frame(k, place(FRAME_S * k as f64)).0));
        }
        let variances = frontal.solve(0).unwrap();
        let start_m = frontal.route.at(0.0).along(MIDDLE) - 1.2;
        for k in (10..100).step_by(10) {
            let off_m = frontal.paces[k].along_m - start_m - SPEED_MPS * frontal.paces[k].time_s;
            (sum, count) = (sum + off_m * off_m / variances[k][0], count + 1.0);
        }
    }
    let z = f64::sqrt(sum / count);
    println!("errors over stated deviations: {z:.2} of {count}");
    assert!(count >= 72.0 && (0.4..1.0).contains(&z), "{z} of {count}");
}

/// A way that comes towards the camera and turns across the picture: a straight line, a quarter of a circle, a line.
fn corner() -> Route {
    const RADIUS_M: f64 = 1.5;
    let turn_m = RADIUS_M * std::f64::consts::FRAC_PI_2;
    let point = |k: i32| {
        let along_m = 0.02 * f64::from(k);
        let on_turn_m = along_m.clamp(3.0, 3.0 + turn_m) - 3.0;
        let angle = on_turn_m / RADIUS_M;
        let before = DVec2::new(0.0, -along_m.min(3.0));
        let turned = RADIUS_M * DVec2::new(1.0 - angle.cos(), -angle.sin());
        let after = DVec2::new((along_m - 3.0 - turn_m).max(0.0), 0.0);
        DVec2::new(-0.3, 2.5) + before + turned + after
    };
    Route::through(&(0..=400).map(point).collect::<Vec<_>>(), 0.0).unwrap()
}

/// The lower foot of somebody on a route, where the row of its sole meets the ground below the trunk.
fn feet_on(route: &Route, along_m: f64, phase: f64) -> DVec2 {
    let walker = walker();
    let path = route.at(along_m);
    let torso = path.point(along_m, walker.level_torso_height_m() + walker.gait.vertical_m(phase));
    let posed = walker.pose(torso, path.heading_rad, phase);
    let rows = [posed.right, posed.left]
        .map(|side| camera().project_ideal(side.ankle - 0.055 * DVec3::Z).unwrap().y);
    let pixel = DVec2::new(camera().project_ideal(torso).unwrap().x, rows[0].max(rows[1]));
    camera().ground_point(pixel).unwrap().truncate()
}

/// Feet lead along the line of sight, contours beyond; both in the same cycle, and where the feet alone are seen too.
#[test]
fn feet_and_contours_show_one_way_around_a_corner() {
    let route = corner();
    let along = |k: usize| SPEED_MPS * FRAME_S * k as f64;
    let cycle = |k: usize| 0.5 * FRAME_S * k as f64 / STEP_S;
    let mut frontal = Frontal::on_route(&route, &walker(), &camera());
    let mut turned = 0;
    for k in 0..130 {
        let seen = frame(k, feet_on(&route, along(k), cycle(k) + LEAD[0])).0;
        let feet = frontal.feet_of(&lowest(seen), along(k));
        // Places and phases start off by a little, and contours are far off where they do not count.
        let is_across = !frontal.is_along(along(k));
        turned += usize::from(is_across);
        let off = if is_across { 0.0 } else { 0.2 };
        let contours = Some([along(k) + off, cycle(k) + off]);
        let (along_m, phase) = (along(k) + 0.1, cycle(k) + 0.05);
        frontal.paces.push(Pace { time_s: FRAME_S * k as f64, feet, contours, along_m, phase });
    }
    assert!((30..100).contains(&turned), "{turned}");
    let variances = frontal.solve(0).unwrap();
    assert_eq!(variances.len(), 130);
    for (k, pace) in frontal.paces.iter().enumerate() {
        assert!((pace.along_m - along(k)).abs() < 0.08, "{k}: {} {}", pace.along_m, along(k));
        assert!((pace.phase - cycle(k)).abs() < 0.04, "{k}: {} {}", pace.phase, cycle(k));
    }
}

#[test]
fn frames_before_a_walk_go_on_with_its_steps_backwards_and_even_motion_does_not() {
    let route = corner();
    let along = |k: usize| SPEED_MPS * FRAME_S * k as f64;
    let cycle = |k: usize| 0.5 * FRAME_S * k as f64 / STEP_S;
    let gain = |is_walking: bool| {
        let mut frontal = Frontal::on_route(&route, &walker(), &camera());
        for k in 50..110 {
            let contours = Some([along(k), cycle(k)]);
            let (along_m, phase) = (along(k), cycle(k));
            frontal.paces.push(Pace { time_s: FRAME_S * k as f64, feet: None, contours, along_m, phase });
        }
        for k in (0..50).rev() {
            let place = match is_walking {
                true => feet_on(&route, along(k), cycle(k) + LEAD[0]),
                false => route.place(along(k) + 0.3),
            };
            frontal.precede(FRAME_S * k as f64, &lowest(frame(k, place).0), route.place(along(k)));
            frontal.solve(0).unwrap();
        }
        if is_walking {
            for (k, pace) in frontal.paces.iter().enumerate() {
                assert!((pace.along_m - along(k)).abs() < 0.1, "{k}: {} {}", pace.along_m, along(k));
                assert!((pace.phase - cycle(k)).abs() < 0.06, "{k}: {} {}", pace.phase, cycle(k));
            }
            assert!((frontal.speed_mps(0..50) - SPEED_MPS).abs() < 0.1);
        }
        frontal.gain(0..50).unwrap()
    };
    let gains = [true, false].map(gain);
    assert!(gains[0] > 2.0 * HINDSIGHT_GAIN && gains[1] < 0.0, "{gains:?}");
}

#[test]
fn places_on_another_route_are_where_they_were() {
    let route = corner();
    let mut frontal = Frontal::on_route(&route, &walker(), &camera());
    for k in 0..60 {
        let (along_m, phase) = (0.1 * f64::from(k), 0.05 * f64::from(k));
        let contours = Some([along_m, phase]);
        frontal.paces.push(Pace { time_s: f64::from(k), feet: None, contours, along_m, phase });
    }
    let start = route.place(1.0);
    let moved = frontal.moved_to(&route.moved(start, 1.0, 0.0, 0.0));
    for (a, b) in frontal.paces.iter().zip(&moved.paces) {
        assert!(route.place(a.along_m).distance(moved.route.place(b.along_m)) < 0.01);
        assert!((b.contours.unwrap()[0] - b.along_m).abs() < 1e-9 && a.phase == b.phase);
    }
}
