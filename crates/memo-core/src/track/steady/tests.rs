use super::*;
use crate::model::Distortion;
use proptest::prelude::*;

const SIZE: [u32; 2] = [320, 240];

fn camera() -> Camera {
    Camera::level(SIZE, 0.9, 1.0, 5.0).unwrap()
}

/// A number in [0, 1) of a place on a lattice.
fn hashed(seed: u32, x: i32, y: i32) -> f64 {
    let mut h = seed ^ (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    f64::from(h ^ (h >> 15)) / 4_294_967_296.0
}

/// A smooth random texture, grey levels about 120: lattice noise with a period of `scale` pixels.
fn texture(seed: u32, at: DVec2, scale: f64) -> f64 {
    let place = at / scale;
    let low = place.floor();
    let (t, x, y) = (place - low, low.x as i32, low.y as i32);
    let ease = t * t * (3.0 - 2.0 * t);
    let line = |y: i32| hashed(seed, x, y) * (1.0 - ease.x) + hashed(seed, x + 1, y) * ease.x;
    120.0 + 130.0 * (line(y) * (1.0 - ease.y) + line(y + 1) * ease.y - 0.5)
}

/// A wall far away, as a camera sees it that is turned from the first view and has its focal length enlarged; what covers
/// the wall is given by its place and grey value.
struct Shot<'a> {
    camera: &'a Camera,
    turned: Turned,
    zoom: f64,
    seed: u32,
    noise: f64,
}

impl Shot<'_> {
    fn of(camera: &Camera, turn_rad: [f64; 3]) -> Shot<'_> {
        Shot { camera, turned: matrix(turn_rad.into()), zoom: 0.0, seed: 1, noise: 2.0 }
    }

    /// Drawn from the wall outwards: each pixel's ray is turned back to the first view. This does not share a line with
    /// the estimate, which goes the other way.
    fn drawn(&self, tone: impl Fn(f64) -> f64, cover: impl Fn(DVec2) -> Option<f64>) -> Image<u8> {
        let mut random =
            crate::synth::Random::new(u64::from(self.seed) + 77 + (self.turned.x_axis.y * 1e6) as u64);
        let [width, height] = SIZE.map(|side| side as usize);
        let mut grey = |k: usize| {
            let pixel = DVec2::new((k % width) as f64, (k / width) as f64);
            let ideal = self.camera.undistort(pixel).unwrap();
            let ray =
                ((ideal - self.camera.centre_px) / self.camera.focal_px / (1.0 + self.zoom)).extend(1.0);
            let first = self.turned.transpose() * ray;
            let wall = first.truncate() / first.z * self.camera.focal_px + self.camera.centre_px;
            let seen = cover(pixel).unwrap_or_else(|| texture(self.seed, wall, 7.0));
            (tone(seen) + self.noise * f64::from(random.normal_pair()[0])).round().clamp(0.0, 255.0) as u8
        };
        Image::from_vec(width, height, (0..width * height).map(&mut grey).collect()).unwrap()
    }

    fn plain(&self) -> Image<u8> {
        self.drawn(|grey| grey, |_| None)
    }
}

fn steadier(camera: Option<&Camera>) -> Steadier {
    Steadier::new(SteadyOptions::default(), camera, Some(0.9))
}

fn pushed(steadier: &mut Steadier, image: &Image<u8>) -> (Steadied, CameraMotion) {
    let steadied = steadier.push(&image.as_frame()).unwrap();
    (steadied, *steadier.motions().back().unwrap())
}

/// Largest distance between where two rotations show the places of the picture, pixels.
fn apart_px(camera: &Camera, a: &Turned, b: &Turned) -> f64 {
    let pairs = moved(camera, a).zip(moved(camera, b));
    pairs.map(|((_, a), (_, b))| a.unwrap().distance(b.unwrap())).fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    /// A rotation by up to 8 px and 1.5 degrees of roll, while a third of the picture is covered by something that moves
    /// by itself and the lamp flickers.
    #[test]
    fn a_planted_rotation_is_recovered_behind_a_moving_thing(
        pan in -0.02f64..0.02, tilt in -0.02f64..0.02, roll in -0.026f64..0.026,
        gain in 0.8f64..1.2, offset in -12.0f64..12.0, bent in any::<bool>(),
    ) {
        let lens = Distortion::Brown { k1: -0.2, k2: 0.05, p1: 0.001, p2: -0.001, k3: 0.0 };
        let camera = Camera { distortion: if bent { lens } else { Distortion::None }, ..camera() };
        let covered = |left: f64| move |at: DVec2| {
            (left..left + 107.0).contains(&at.x).then(|| texture(9, at - DVec2::X * left, 5.0))
        };
        let first = Shot::of(&camera, [0.0; 3]).drawn(|grey| grey, covered(60.0));
        let second = Shot::of(&camera, [tilt, pan, roll]).drawn(|grey| gain * grey + offset, covered(72.0));
        let mut steadier = steadier(Some(&camera));
        pushed(&mut steadier, &first);
        let (_, motion) = pushed(&mut steadier, &second);
        let off_px = apart_px(&camera, &motion.turned(), &matrix(DVec3::new(tilt, pan, roll)));
        prop_assert!(off_px < 0.05, "{off_px} px, {motion:?}");
        prop_assert!((0.4..0.8).contains(&motion.support), "{motion:?}");
    }
}

/// The turned-back picture is that of the first view, and what the frame does not show is known.
#[test]
fn a_turned_frame_is_turned_back() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    let first = Shot { noise: 0.0, ..Shot::of(&camera, [0.0; 3]) }.plain();
    pushed(&mut steadier, &first);
    let turned = Shot { noise: 0.0, ..Shot::of(&camera, [0.012, -0.02, 0.015]) };
    let (Steadied::Moved { picture, unseen }, motion) = pushed(&mut steadier, &turned.plain()) else {
        panic!("left as it was")
    };
    assert_eq!(motion.state, CameraState::Turned);
    // A pixel of the turned frame is where its ray meets the picture of the first view.
    let pixel = DVec2::new(250.0, 60.0);
    let ray = ((pixel - camera.centre_px) / camera.focal_px).extend(1.0);
    let seen = turned.turned.transpose() * ray;
    let expected = seen.truncate() / seen.z * camera.focal_px + camera.centre_px;
    assert!(steadier.in_steadied(1, pixel).distance(expected) < 0.1 && pixel.distance(expected) > 3.0);
    assert_eq!([steadier.in_steadied(0, pixel), steadier.in_steadied(7, pixel)], [pixel; 2]);
    let mut square = (0.0, 0.0);
    for (k, (a, b)) in picture.pixels().iter().zip(first.pixels()).enumerate() {
        let pixel = DVec2::new((k % 320) as f64, (k / 320) as f64);
        let ray = ((pixel - camera.centre_px) / camera.focal_px).extend(1.0);
        let at = pixel_of(&camera, &turned.turned, ray).unwrap();
        let inside = at.cmpge(DVec2::splat(0.1)).all() && at.cmple(DVec2::new(318.9, 238.9)).all();
        let outside = at.cmplt(DVec2::splat(-0.1)).any() || at.cmpgt(DVec2::new(319.1, 239.1)).any();
        let is_unseen = unseen.pixels()[k];
        assert!(!(inside && is_unseen) && (!outside || is_unseen), "{pixel} {at}");
        if inside {
            square = (square.0 + f64::from(a.abs_diff(*b)).powi(2), square.1 + 1.0);
        } else if outside {
            assert_eq!(a, b, "filled from the first frame");
        }
    }
    assert!((square.0 / square.1).sqrt() < 1.0, "{square:?}");
}

#[test]
fn frames_of_a_camera_at_rest_are_left_alone() {
    let camera = camera();
    let mut steadier = steadier(None);
    for seed in 0..4 {
        let moving = |at: DVec2| {
            (at.x > 40.0 * f64::from(seed) && at.x < 40.0 * f64::from(seed) + 60.0).then_some(30.0)
        };
        let frame = Shot { noise: 4.0 + f64::from(seed), ..Shot::of(&camera, [0.0; 3]) };
        let (steadied, motion) = pushed(&mut steadier, &frame.drawn(|grey| grey, moving));
        assert_eq!(
            (steadied, motion.state, motion.turn_rad),
            (Steadied::AsGiven, CameraState::Still, DVec3::ZERO)
        );
    }
    assert!(steadier.losses().is_empty());
}

#[test]
fn without_texture_nothing_is_estimated_and_frames_are_left_alone() {
    let grey = Image::filled(320, 240, 100u8);
    let error = Template::new(&Pyramid::new(grey.as_frame(), 2), &camera()).unwrap_err();
    assert_eq!(error, SteadyError::NoTexture { points: 0, needed: 60 });
    for (width, height) in [(320, 240), (1, 1), (2, 9), (7, 300), (8, 8)] {
        let mut steadier = steadier(None);
        for level in [0u8, 100, 255] {
            let (steadied, motion) = pushed(&mut steadier, &Image::filled(width, height, level));
            assert_eq!((steadied, motion.state), (Steadied::AsGiven, CameraState::Unknown));
            assert!(motion.shift_px == [0.0; 2] && motion.turn_rad == DVec3::ZERO && motion.support.is_nan());
        }
    }
    let mut steadier = steadier(Some(&camera()));
    pushed(&mut steadier, &Shot::of(&camera(), [0.0; 3]).plain());
    let other = Image::filled(320, 200, 0u8);
    assert!(matches!(steadier.push(&other.as_frame()), Err(FrameError::SizeChanged { height: 200, .. })));
}

/// Before a plain wall all gradients are those of a person, whose motion is not that of the camera.
#[test]
fn before_a_plain_wall_a_person_is_no_camera_motion() {
    let camera = camera();
    let mut steadier = steadier(None);
    for k in 0..6 {
        let left = 60.0 + 6.0 * f64::from(k);
        let person = |at: DVec2| {
            let inside = (left..left + 90.0).contains(&at.x) && at.y > 20.0;
            Some(if inside { texture(3, at - DVec2::X * left, 5.0) } else { 120.0 })
        };
        let frame =
            Shot { noise: 5.0, seed: k as u32, ..Shot::of(&camera, [0.0; 3]) }.drawn(|grey| grey, person);
        assert!(pushed(&mut steadier, &frame).0 == Steadied::AsGiven, "{k}");
        if k == 0 {
            let error = Template::new(&Pyramid::new(frame.as_frame(), 2), &camera).unwrap_err();
            assert!(matches!(error, SteadyError::PlainPicture { share, .. } if share < 0.4), "{error}");
        }
    }
    assert!(steadier.motions().iter().all(|motion| motion.state == CameraState::Unknown));
}

/// What a codec leaves on a plain wall differs from frame to frame; that is no texture and no cut.
/// Before a wall of faint texture, many points of the first frame are those of a person, who moves on by 20 pixels.
#[test]
fn a_camera_at_rest_does_not_creep_along_with_a_person() {
    let camera = camera();
    for (width, contrast) in [(80.0, 0.4), (100.0, 0.5), (120.0, 0.5), (120.0, 0.6), (120.0, 0.8)] {
        let mut steadier = steadier(Some(&camera));
        for k in 0..40u32 {
            let left = 60.0 + 0.5 * f64::from(k);
            let person = |at: DVec2| {
                let is_person = (left..left + width).contains(&at.x) && at.y > 15.0;
                is_person.then(|| texture(9, at - DVec2::X * left, 5.0))
            };
            let wall = |at: DVec2| 120.0 + contrast * (texture(1, at, 7.0) - 120.0);
            let shot = Shot { seed: 100 + k, noise: 1.5, ..Shot::of(&camera, [0.0; 3]) };
            let picture = shot.drawn(|grey| grey, |at| person(at).or_else(|| Some(wall(at))));
            let (_, motion) = pushed(&mut steadier, &picture);
            assert!(motion.shift_px[0] < 1.5, "{width} {contrast} {k}: {motion:?}");
        }
    }
}

#[test]
fn texture_that_is_another_in_every_frame_is_no_view() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    for k in 0..40u32 {
        let faint = |at: DVec2| Some(120.0 + 0.2 * (texture(k / 5, at, 6.0) - 120.0));
        let frame = Shot { noise: 0.5, seed: k, ..Shot::of(&camera, [0.0; 3]) }.drawn(|grey| grey, faint);
        assert!(pushed(&mut steadier, &frame).0 == Steadied::AsGiven, "{k}");
    }
    assert!(steadier.losses().is_empty(), "{:?}", steadier.losses());
}

/// A black frame and a flash are no cut: the camera is unknown in them, and known again after them.
#[test]
fn a_black_frame_is_no_cut() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    let wall = Shot::of(&camera, [0.0; 3]).plain();
    pushed(&mut steadier, &wall);
    for level in [0u8, 255] {
        let (steadied, motion) = pushed(&mut steadier, &Image::filled(320, 240, level));
        assert_eq!((steadied, motion.state), (Steadied::AsGiven, CameraState::Unknown));
        assert_eq!(pushed(&mut steadier, &wall).1.state, CameraState::Still);
    }
    assert!(steadier.losses().is_empty() && steadier.take_loss().is_none());
}

/// A lamp that flickers while the rows are read brightens and darkens bands of them. A turned camera is not taken for that.
#[test]
fn bands_of_light_are_no_motion() {
    let camera = camera();
    let lit = |shot: Shot, phase: f64| {
        let mut picture = shot.plain();
        for y in 0..picture.height() {
            let gain = 1.0 + 0.45 * (y as f64 / 12.0 + phase).sin();
            picture.row_mut(y).iter_mut().for_each(|grey| *grey = (gain * f64::from(*grey)) as u8);
        }
        picture
    };
    let mut steadier = steadier(Some(&camera));
    pushed(&mut steadier, &Shot::of(&camera, [0.0; 3]).plain());
    for phase in [0.0, 2.0, 4.0] {
        let (steadied, motion) = pushed(&mut steadier, &lit(Shot::of(&camera, [0.0; 3]), phase));
        assert_eq!((steadied, motion.state), (Steadied::AsGiven, CameraState::UnevenLight), "{phase}");
    }
    let (_, motion) = pushed(&mut steadier, &lit(Shot::of(&camera, [0.0, 0.03, 0.0]), 1.0));
    assert!(matches!(motion.state, CameraState::Turned | CameraState::Unknown), "{motion:?}");
    assert!(steadier.losses().is_empty());
}

/// What is left of a view is where it was, also in a frame in which nobody knows how the camera turned.
#[test]
fn places_are_turned_back_in_an_unknown_frame_too() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    for turn in [[0.0; 3], [0.0, 0.06, 0.0]] {
        pushed(&mut steadier, &Shot::of(&camera, turn).plain());
    }
    let (steadied, motion) = pushed(&mut steadier, &Image::filled(320, 240, 0));
    assert!(matches!(steadied, Steadied::Moved { .. }) && motion.state == CameraState::Unknown);
    let pixel = DVec2::new(160.0, 120.0);
    let [known, unknown] = [1, 2].map(|frame| steadier.in_steadied(frame, pixel));
    assert!(known.distance(pixel) > 10.0 && known.distance(unknown) < 1e-9, "{known} {unknown}");
}

/// A camera that shows nothing of the first view has not stood still.
#[test]
fn behind_the_first_view_nobody_knows_how_far_a_pixel_moved() {
    let shift_px = |turn_rad: f64| displacement_px(&camera(), &matrix(DVec3::Y * turn_rad));
    assert!(shift_px(0.0).iter().all(|px| *px < 1e-9));
    assert!(shift_px(3.0).iter().all(|px| px.is_nan()) && shift_px(0.5)[0] > 100.0);
    // Nor does what turns out of sight count.
    assert!(
        (0..30).all(|k| shift_px(0.1 * f64::from(k))[0] < 900.0 || shift_px(0.1 * f64::from(k))[0].is_nan())
    );
}

#[test]
fn a_given_camera_is_one_of_frames_of_its_size() {
    let small = Image::filled(300, 240, 100u8);
    let refused = steadier(Some(&camera())).push(&small.as_frame());
    assert!(matches!(refused, Err(FrameError::SizeChanged { expected_width: 320, width: 300, .. })));
}

#[test]
fn a_tripod_that_is_kicked_is_found_again() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    pushed(&mut steadier, &Shot::of(&camera, [0.0; 3]).plain());
    for turn in [[0.03, -0.055, 0.01], [0.0, 0.0, 0.0]] {
        let motion = pushed(&mut steadier, &Shot::of(&camera, turn).plain()).1;
        let off_px = apart_px(&camera, &motion.turned(), &matrix(turn.into()));
        // Frames nearer to the first than the limit are left where they are.
        assert!(off_px < 0.06, "{off_px} {motion:?}");
    }
}

/// Pictures of one wall up to a frame, then of another one.
fn cut_at(
    steadier: &mut Steadier,
    camera: &Camera,
    at: usize,
    count: usize,
) -> Vec<(Steadied, CameraMotion)> {
    let wall = |seed: u32, k: usize| Shot { seed, ..Shot::of(camera, [0.0, 0.001 * k as f64, 0.0]) }.plain();
    (0..count).map(|k| pushed(steadier, &wall(if k < at { 1 } else { 2 }, k))).collect()
}

#[test]
fn a_cut_ends_the_view_of_a_given_camera_until_it_comes_back() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    let frames = cut_at(&mut steadier, &camera, 5, 10);
    assert_eq!(steadier.losses(), [Loss { frame: 5, reason: LossReason::Cut }]);
    assert_eq!(steadier.take_loss(), Some(Loss { frame: 5, reason: LossReason::Cut }));
    assert_eq!(steadier.take_loss(), None);
    let lost = frames.iter().position(|(_, motion)| motion.state == CameraState::Lost).unwrap();
    assert!(lost <= 8 && frames[lost..].iter().all(|(steadied, _)| *steadied == Steadied::Lost));
    let back = pushed(&mut steadier, &Shot::of(&camera, [0.0, 0.01, 0.0]).plain()).1;
    assert_eq!(back.state, CameraState::Turned);
}

#[test]
fn without_a_camera_another_shot_is_a_view_of_its_own() {
    let camera = camera();
    let mut steadier = steadier(None);
    let frames = cut_at(&mut steadier, &camera, 4, 12);
    assert_eq!(steadier.losses(), [Loss { frame: 4, reason: LossReason::Cut }]);
    let (_, last) = &frames[11];
    assert!(last.state == CameraState::Turned && last.support > 0.8, "{last:?}");
    // Against the first frame of the second shot.
    let off_px = apart_px(&camera, &last.turned(), &matrix(DVec3::new(0.0, 0.007, 0.0)));
    assert!(off_px < 0.1, "{off_px}");
}

#[test]
fn a_fast_zoom_ends_the_view_and_shaking_does_not() {
    let camera = camera();
    let run = |zoom_per_frame: f64| {
        let mut steadier = steadier(Some(&camera));
        for k in 0..30 {
            let shake = [0.006 * (0.9 * f64::from(k)).sin(), 0.008 * (1.3 * f64::from(k)).cos(), 0.0];
            let zoom = zoom_per_frame * f64::from((k - 6).max(0));
            pushed(&mut steadier, &Shot { zoom, ..Shot::of(&camera, shake) }.plain());
        }
        steadier.losses().to_vec()
    };
    assert!(run(0.0).is_empty());
    // 1.2 px per frame at the corner, 200 px from the centre; the reason may be a cut.
    let lost = run(0.006);
    assert!(lost.len() == 1 && (7..=11).contains(&lost[0].frame), "{lost:?}");
}

/// A pan beyond the first view: key frames are chained, and the way back ends at the beginning.
#[test]
fn a_pan_is_chained_over_key_frames() {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    let turns = (0..=40).map(|k| 0.03 * f64::from(if k <= 20 { k } else { 40 - k }));
    let mut worst = 0.0f64;
    for pan in turns {
        let turn = [0.1 * pan, pan, 0.05 * pan];
        let motion = pushed(&mut steadier, &Shot::of(&camera, turn).plain()).1;
        worst = worst.max(apart_px(&camera, &motion.turned(), &matrix(turn.into())));
    }
    assert!(steadier.keys.len() > 1 && steadier.losses().is_empty());
    assert!(worst < 0.5, "{worst} px");
}

/// Frames of a camera that pans before a wall of this texture, with the pan; `wall` has the frame and the place on the wall.
fn worst_of_pan(pans: impl Iterator<Item = f64>, wall: impl Fn(usize, DVec2) -> f64) -> f64 {
    let camera = camera();
    let mut steadier = steadier(Some(&camera));
    let mut worst = 0.0f64;
    for (k, pan) in pans.enumerate() {
        let turned = matrix(DVec3::Y * pan);
        let seen = |pixel: DVec2| {
            let ray = ((pixel - camera.centre_px) / camera.focal_px).extend(1.0);
            let first = turned.transpose() * ray;
            Some(wall(k, first.truncate() / first.z * camera.focal_px + camera.centre_px))
        };
        let motion = pushed(&mut steadier, &Shot::of(&camera, [0.0, pan, 0.0]).drawn(|grey| grey, seen)).1;
        assert!(motion.state != CameraState::Unknown, "{k}: {motion:?}");
        worst = worst.max(apart_px(&camera, &motion.turned(), &turned));
    }
    worst
}

/// Before fine texture, of which coarse scales show nothing, the picture of a fast pan is found where it would be if the camera
/// went on.
#[test]
fn a_fast_pan_goes_on_as_it_did() {
    let pans = (0..24).scan(0.0, |pan, k| {
        *pan += 0.0015 * f64::from(k.min(16));
        Some(*pan)
    });
    let worst = worst_of_pan(pans, |_, wall| texture(1, wall, 3.0));
    assert!(worst < 0.1, "{worst} px");
}

/// In larger pictures, what a camera shows beyond the first frame is where its rays meet the first view's camera, and known to be
/// unseen elsewhere.
#[test]
fn larger_pictures_show_what_the_camera_turned_to() {
    let lens = Distortion::Brown { k1: -0.2, k2: 0.05, p1: 0.001, p2: -0.001, k3: 0.0 };
    for distortion in [Distortion::None, lens] {
        let camera = Camera { distortion, ..camera() };
        let shot = |turn: [f64; 3]| Shot { noise: 0.0, ..Shot::of(&camera, turn) };
        let turns: Vec<[f64; 3]> =
            (0..7).map(f64::from).map(|k| [0.03 * (0.9 * k).sin(), 0.04 * k, 0.003 * k]).collect();
        let mut small = steadier(Some(&camera));
        turns.iter().for_each(|turn| drop(pushed(&mut small, &shot(*turn).plain())));
        // 1. The pictures look at the middle of the pan, and their reach is where the borders of all frames are.
        let reach = small.wider().unwrap();
        assert!((reach.turn_rad.y - 0.12).abs() < 0.01 && reach.turn_rad.x.abs() < 0.01, "{reach:?}");
        let from_first = matrix(reach.turn_rad);
        let on_pictures = |ray: DVec3| ray.truncate() / ray.z * camera.focal_px + camera.centre_px;
        let border = (0..=319).map(f64::from).flat_map(|k| {
            let y = k.min(239.0);
            [[0.0, y], [319.0, y], [k, 0.0], [k, 239.0]].map(DVec2::from_array)
        });
        let border: Vec<DVec2> = border.collect();
        let mut most = [0.0f64; 4];
        for (turn, pixel) in turns.iter().flat_map(|turn| border.iter().map(move |pixel| (turn, *pixel))) {
            let ray = ((camera.undistort(pixel).unwrap() - camera.centre_px) / camera.focal_px).extend(1.0);
            let at = on_pictures(from_first * (matrix((*turn).into()).transpose() * ray));
            let beyond = [-at.x, -at.y, at.x - 319.0, at.y - 239.0];
            most = std::array::from_fn(|side| most[side].max(beyond[side]));
        }
        let reach_px = reach.px;
        for (reach_px, most) in reach_px.into_iter().zip(most) {
            assert!((f64::from(reach_px) - most).abs() < 3.0, "{reach_px:?} {most:?}");
        }
        // 2. Each picture is the wall of the scene, as far as the frame shows it.
        let options = SteadyOptions { reach, ..SteadyOptions::default() };
        let mut wide = Steadier::new(options, Some(&camera), None);
        let corner_px = DVec2::new(f64::from(reach_px[0]), f64::from(reach_px[1]));
        for (frame, turn) in turns.into_iter().enumerate() {
            let (Steadied::Moved { picture, unseen }, _) = pushed(&mut wide, &shot(turn).plain()) else {
                panic!("left as it was")
            };
            let size = [320 + reach_px[0] + reach_px[2], 240 + reach_px[1] + reach_px[3]];
            assert_eq!([picture.width(), picture.height()], size.map(|side| side as usize));
            let (mut square, mut count) = (0.0, 0.0);
            for y in 0..picture.height() {
                for x in (0..picture.width()).filter(|x| !unseen.at(*x, y)) {
                    let plane =
                        (DVec2::new(x as f64, y as f64) - corner_px - camera.centre_px) / camera.focal_px;
                    let wall = on_pictures(from_first.transpose() * plane.extend(1.0));
                    let off = f64::from(picture.at(x, y)) - texture(1, wall, 7.0).clamp(0.0, 255.0);
                    (square, count) = (square + off * off, count + 1.0);
                }
            }
            assert!((square / count).sqrt() < 2.5, "frame {frame}: {}", (square / count).sqrt());
            assert!(count > 0.9 * 320.0 * 240.0, "frame {frame}: {count} pixels shown");
            // 3. A pixel of the frame is found in the picture, and back.
            let pixel = DVec2::new(250.0, 60.0);
            let there = wide.in_steadied(frame, pixel);
            assert!(wide.in_frame(frame, there).distance(pixel) < 1e-6, "frame {frame}");
        }
        assert_eq!(wide.wider(), None);
    }
}

/// A pan before a wall that soon looks another way, as if the sun came out: no key frame shows where the camera is, but the frame before
/// does.
#[test]
fn a_pan_goes_on_from_frame_to_frame() {
    let pans = (0..18).scan(0.0, |pan, k| {
        *pan += 0.002 * f64::from(k.min(4));
        Some(*pan)
    });
    let worst = worst_of_pan(pans, |k, wall| {
        let other = ((k as f64 - 6.0) / 6.0).clamp(0.0, 1.0);
        (1.0 - other) * texture(1, wall, 7.0) + other * texture(2, wall, 7.0)
    });
    assert!(worst < 0.5, "{worst} px");
}

/// What a seeker finds in the frames of a camera that turns so far in each step.
fn field_of(camera: &Camera, turns: impl Iterator<Item = [f64; 3]>) -> Option<FieldOfView> {
    let mut seeker = FieldSeeker::default();
    for (k, turn) in turns.enumerate() {
        let left = 60.0 + 2.0 * k as f64;
        let cover =
            |at: DVec2| (left..left + 70.0).contains(&at.x).then(|| texture(9, at - DVec2::X * left, 5.0));
        seeker.push(&Shot::of(camera, turn).drawn(|grey| grey, cover).as_frame()).unwrap();
    }
    seeker.found()
}

/// Fields of view from tele to wide, planted, while somebody covers a fifth of the picture and goes with the camera.
#[test]
fn a_pan_shows_the_field_of_view() {
    for field_rad in [0.5f64, 0.8, 1.2, 1.55] {
        let camera = Camera::level(SIZE, field_rad, 1.0, 5.0).unwrap();
        let px = |k: i32| (1..=k).map(|k| f64::from(k.min(8))).sum::<f64>();
        let turns = (0..26).map(|k| px(k) / camera.focal_px.x).map(|pan| [0.2 * pan, -pan, 0.05 * pan]);
        let found = field_of(&camera, turns).unwrap_or_else(|| panic!("{field_rad}"));
        let off = found.horizontal_rad - field_rad;
        assert!(off.abs() < 2.0 * found.sd_rad, "{field_rad}: {found:?}");
        assert!((0.003..0.02).contains(&(found.sd_rad / field_rad)), "{found:?}");
    }
}

/// Shaking, a camera at rest and one that is carried along show no field of view, nor do pictures without texture.
#[test]
fn without_a_pan_no_field_of_view_is_found() {
    let camera = camera();
    assert_eq!(field_of(&camera, (0..20).map(|_| [0.0; 3])), None);
    assert_eq!(
        field_of(&camera, (0..20).map(f64::from).map(|k| [0.01 * k.sin(), 0.01 * (2.0 * k).cos(), 0.0])),
        None
    );
    assert_eq!(field_of(&camera, std::iter::empty()), None);
    let mut seeker = FieldSeeker::default();
    for _ in 0..20 {
        seeker.push(&Image::filled(320, 240, 90).as_frame()).unwrap();
    }
    assert_eq!(seeker.found(), None);
    assert!(seeker.push(&Image::filled(320, 200, 90).as_frame()).is_err());
    // A camera that is carried sideways along a wall moves all of the picture alike, as one with a very long lens would.
    let mut seeker = FieldSeeker::default();
    for k in 0..24 {
        let pixels = (0..320 * 240)
            .map(|n| texture(1, DVec2::new(f64::from(n % 320 + 6 * k), f64::from(n / 320)), 7.0));
        let carried =
            Image::from_vec(320, 240, pixels.map(|grey| grey.clamp(0.0, 255.0) as u8).collect()).unwrap();
        seeker.push(&carried.as_frame()).unwrap();
    }
    assert_eq!(seeker.found(), None);
}

#[test]
fn one_thread_and_many_give_the_same() {
    let camera = camera();
    let frames: Vec<Image<u8>> =
        (0..3).map(|k| Shot::of(&camera, [0.004 * f64::from(k), 0.007, 0.002]).plain()).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut steadier = steadier(Some(&camera));
            frames.iter().map(|frame| pushed(&mut steadier, frame)).collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn options_outside_their_ranges_are_refused() {
    let options = SteadyOptions::default();
    assert_eq!(options.check(), Ok(()));
    for (wrong, name) in [
        (SteadyOptions { still_px: f64::NAN, ..options }, "still_px"),
        (SteadyOptions { least_support: 1.0, ..options }, "least_support"),
        (SteadyOptions { most_zoom_px: 0.0, ..options }, "most_zoom_px"),
        (SteadyOptions { reach: Reach { px: [0, 2001, 0, 0], ..options.reach }, ..options }, "reach_px"),
        (
            SteadyOptions { reach: Reach { turn_rad: DVec3::Y * 2.1, ..options.reach }, ..options },
            "reach_from_rad",
        ),
        (
            SteadyOptions { reach: Reach { turn_rad: DVec3::NAN, ..options.reach }, ..options },
            "reach_from_rad",
        ),
    ] {
        assert_eq!(wrong.check().unwrap_err().name, name);
    }
}
