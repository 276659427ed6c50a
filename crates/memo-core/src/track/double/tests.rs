use super::super::result::tests::{beside, fitted};
use super::*;
use crate::image::Image;
use crate::model::Body;

/// What the frames of a walk show of the bodies of these walks, which differ by a number of grey levels from a room of which
/// every ninth pixel flickers by as much.
fn views(of: &TrackedWalk, shown: &[&TrackedWalk], contrast: u8) -> Vec<(usize, View)> {
    let shown: Vec<Bodies<'_>> = shown.iter().map(|walk| Bodies::new(walk)).collect();
    let [width, height] = of.camera.size.map(|size| size as usize);
    let view = |frame: usize| {
        let mut mask = Mask::filled(width, height, false);
        for bodies in &shown {
            if let Some(posed) = bodies.of_frames.get(&frame) {
                paint_body(&mut mask, [0, 0], &of.camera, &posed.cylinders, 0.0, true);
            }
        }
        let mut pixels = Image::filled(width, height, [100, 100]);
        for y in 0..height {
            for (x, (pixel, &is_shown)) in pixels.row_mut(y).iter_mut().zip(mask.row(y)).enumerate() {
                let differs = is_shown || (x + 3 * y + frame).is_multiple_of(9);
                pixel[0] += if differs { contrast } else { 1 };
            }
        }
        View { corner: [0, 0], pixels, is_empty_known: true, others: Vec::new(), crown_px: None }
    };
    of.rows().iter().map(|row| (row.frame, view(row.frame))).collect()
}

#[test]
fn two_people_each_have_a_part_of_their_own() {
    let (long, short) = (beside(-0.5, 0, 30), beside(-0.3, 4, 12));
    for contrast in [6, 80] {
        let both = views(&short, &[&long, &short], contrast);
        assert_eq!(short.is_second_model(&long, &both), None, "{contrast}");
        let one = views(&short, &[&long], contrast);
        assert_eq!(short.is_second_model(&long, &one), Some(true), "{contrast}");
        assert_eq!(long.is_second_model(&short, &views(&long, &[&long], contrast)), Some(false));
    }
}

#[test]
fn a_second_model_a_little_off_is_one() {
    let (long, near) = (beside(-0.5, 0, 30), beside(-0.45, 4, 12));
    assert_eq!(near.is_second_model(&long, &views(&near, &[&long], 80)), Some(true));
    let apart = beside(1.0, 4, 12);
    assert_eq!(apart.is_second_model(&long, &views(&apart, &[&long, &apart], 80)), None);
    // A model on nobody, who stands nowhere on the other, is not a second one.
    assert_eq!(apart.is_second_model(&long, &views(&apart, &[&long], 80)), None);
}

#[test]
fn a_small_model_within_a_body_is_a_second_one() {
    let long = beside(-0.5, 0, 30);
    let mut small = fitted(beside(-0.5, 4, 18), 0.01);
    let fit = small.fit.as_mut().unwrap().as_mut().unwrap();
    fit.body = Body::from_height(0.8 * fit.body.height_m).unwrap();
    assert_eq!(small.is_second_model(&long, &views(&small, &[&long], 80)), Some(true));
}

#[test]
fn of_two_models_the_longer_one_stays_or_the_one_that_fits() {
    let (poor, good) = (|walk| fitted(walk, 0.15), |walk| fitted(walk, 0.01));
    let (long, short) = (beside(-0.5, 0, 30), beside(-0.48, 4, 18));
    let is_second = |a: &TrackedWalk, b: &TrackedWalk| a.is_second_model(b, &views(a, &[&long], 80));
    assert_eq!(is_second(&good(long.clone()), &good(short.clone())), Some(false));
    assert_eq!(is_second(&good(long.clone()), &poor(short.clone())), Some(false));
    assert_eq!(is_second(&poor(long.clone()), &poor(short.clone())), Some(false));
    assert_eq!(is_second(&poor(long.clone()), &good(short.clone())), Some(true));
    assert_eq!(is_second(&good(short.clone()), &poor(long.clone())), Some(false));
    // Of a long one that is off at last, most is not common to both.
    assert_eq!(is_second(&poor(beside(-0.5, 0, 50)), &good(short)), Some(false));
}

/// The longer walk stays where both are on the person, and where it is on nobody only in few of its frames.
#[test]
fn of_two_models_the_one_that_is_where_nobody_is_goes() {
    let (person, short) = (beside(-0.5, 0, 50), beside(-0.5, 4, 16));
    let nobody = |count: usize| beside(-0.2, 4, count);
    let is_second = |a: &TrackedWalk, b: &TrackedWalk| a.is_second_model(b, &views(a, &[&person], 80));
    assert_eq!(is_second(&short, &nobody(20)), Some(false));
    assert_eq!(is_second(&nobody(20), &short), Some(true));
    assert_eq!(is_second(&nobody(40), &short), Some(false), "for a time");
    assert_eq!(is_second(&short, &beside(-0.45, 4, 20)), Some(true), "both on the person");
}

#[test]
fn without_an_empty_scene_boxes_tell_how_far_models_lie_on_each_other() {
    let (long, short) = (beside(-0.5, 0, 30), beside(-0.45, 4, 12));
    assert_eq!(short.is_second_model(&long, &[]), Some(true));
    assert_eq!(long.is_second_model(&short, &[]), Some(false));
    let mut unknown = views(&short, &[&long, &short], 80);
    unknown.iter_mut().for_each(|(_, view)| view.is_empty_known = false);
    assert_eq!(short.is_second_model(&long, &unknown), Some(true));
    assert_eq!(beside(0.0, 4, 12).is_second_model(&long, &[]), None, "half a metre ahead");
    assert_eq!(beside(-0.45, 100, 12).is_second_model(&long, &[]), None, "later");
    assert_eq!(beside(-0.45, 24, 16).is_second_model(&long, &[]), None, "common to both are six frames");
}

/// Whatever the pictures show: a person is not in two places.
#[test]
fn of_two_walks_at_a_time_with_one_number_the_shorter_is_second() {
    let (long, short) = (beside(-0.5, 0, 30), beside(1.0, 4, 12));
    let both = views(&short, &[&long, &short], 80);
    assert_eq!(
        [short.is_second_to(&long, &both), long.is_second_to(&short, &both)],
        [Some(true), Some(false)]
    );
    assert_eq!(TrackedWalk { person: 1, ..short.clone() }.is_second_to(&long, &both), None);
    assert_eq!(beside(1.0, 100, 12).is_second_to(&long, &both), None, "later");
}

/// The first goes on as the second, which is longer: in the frames of both the first is dropped.
#[test]
fn of_two_models_in_turn_each_keeps_its_own_frames() {
    let (early, late) = (beside(-0.5, 0, 30), beside(-0.48, 20, 40));
    let [first, last] = late.first_and_last().unwrap();
    let early_end = early.first_and_last().unwrap()[1];
    assert!(first < early_end && early_end < last);
    let long = beside(-0.5, 0, 60);
    let seen = views(&early, &[&long], 80);
    assert_eq!(early.is_second_model(&late, &seen), Some(true));
    assert_eq!(late.is_second_model(&early, &views(&late, &[&long], 80)), Some(false));
    // Two people who are in the picture together, and one who goes the other way.
    let both = views(&early, &[&early, &beside(0.2, 20, 40)], 80);
    assert_eq!(early.is_second_model(&beside(0.2, 20, 40), &both), None);
    let mut back = fitted(late.clone(), 0.01);
    let fit = back.fit.as_mut().unwrap().as_mut().unwrap();
    fit.frames.iter_mut().for_each(|frame| frame.heading_rad += std::f64::consts::PI);
    assert_eq!(early.is_second_model(&back, &seen), None);

    let steps = early.steps().iter().filter(|step| step.frame < first).count();
    let mut whole = fitted(early.clone(), 0.01);
    whole.camera_turns = vec![glam::DVec3::Z; 30];
    whole.crowns_px = vec![Some(7.0); 30];
    let rest = whole.clone().outside([first, last], steps).unwrap();
    assert_eq!(rest.rows(), whole.rows()[..steps]);
    assert_eq!((rest.camera_turns.len(), rest.crowns_px.len()), (steps, steps));
    assert!(whole.clone().outside([first, last], steps + 1).is_none());
    let [_, before] = rest.first_and_last().unwrap();
    assert_eq!(whole.clone().outside([0, before], 1).unwrap().rows(), whole.rows()[steps..]);
}
