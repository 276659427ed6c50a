use super::*;
use proptest::prelude::*;

const START_FRAMES: usize = 13;

fn boxed(left: usize, top: usize, width: usize, height: usize) -> Rectangle {
    Rectangle { left, top, right: left + width - 1, bottom: top + height - 1 }
}

/// A person of 200 px who walks by 4 px a frame.
fn walking(frame: usize) -> Rectangle {
    boxed(20 + 4 * frame, 100, 60, 200)
}

fn shot(frame: usize, rectangle: Rectangle) -> Shot {
    Shot { frame, time_s: 0.04 * frame as f64, rectangle }
}

fn seen(rectangle: Rectangle) -> Noticed {
    Noticed { rectangle, hindrance: None, beside: false }
}

fn hindered(rectangle: Rectangle, hindrance: Hindrance) -> Noticed {
    Noticed { hindrance: Some(hindrance), ..seen(rectangle) }
}

/// Those who are left out of frames with these regions.
fn left_out_of(frames: usize, regions: impl Fn(usize) -> Vec<Noticed>) -> Vec<LeftOut> {
    left_out_beside(frames, regions, None)
}

fn left_out_beside(
    frames: usize,
    regions: impl Fn(usize) -> Vec<Noticed>,
    walk_boxes: Option<WalkBoxes>,
) -> Vec<LeftOut> {
    let mut unfollowed = Unfollowed::default();
    for frame in 0..frames {
        unfollowed.notice(frame, 0.04 * frame as f64, &regions(frame));
    }
    walk_boxes.into_iter().for_each(|walk_boxes| unfollowed.followed(walk_boxes));
    unfollowed.finish(START_FRAMES);
    unfollowed.left_out()
}

/// The walk of [`walking`] in these frames, which started in its thirteenth.
fn walk_boxes(frames: std::ops::Range<usize>) -> WalkBoxes {
    let started = frames.start + START_FRAMES - 1;
    WalkBoxes::new(frames.map(|frame| shot(frame, walking(frame))), Some(started)).unwrap()
}

fn reasons(left_out: &[LeftOut]) -> Vec<&'static str> {
    left_out.iter().map(|left| left.reason.name()).collect()
}

#[test]
fn one_thing_is_one_entry_over_gaps_up_to_a_second() {
    for (gap, entries) in [(0, 1), (3, 1), (20, 1), (40, 2)] {
        let there = |frame: usize| !(30..30 + gap).contains(&frame);
        let found = left_out_of(90, |frame| {
            if there(frame) { vec![hindered(walking(frame), Hindrance::CutOff)] } else { vec![] }
        });
        assert_eq!(found.len(), entries, "{gap} frames");
        assert_eq!((found[0].first().frame, found.last().unwrap().last().frame), (0, 89));
        assert_eq!(found.iter().map(|left| left.frames).sum::<usize>(), 90 - gap);
        assert!(found.iter().all(|left| left.reason == Reason::CutOff && left.shots.len() == MOST_SHOWN));
    }
}

#[test]
fn what_hinders_most_is_the_reason() {
    let of = |hindrance: Hindrance, rectangle: fn(usize) -> Rectangle| {
        reasons(&left_out_of(50, |frame| vec![hindered(rectangle(frame), hindrance)]))
    };
    assert_eq!(of(Hindrance::CutOff, walking), ["cut off"]);
    assert_eq!(of(Hindrance::Crowded, walking), ["too many"]);
    assert_eq!(of(Hindrance::WrongSize, walking), ["wrong size"]);
    assert_eq!(of(Hindrance::Small, |frame| boxed(2 * frame, 100, 8, 22)), ["too small"]);
    let brief = left_out_of(50, |frame| {
        let hindrance = (frame % 12 == 0).then_some(Hindrance::CutOff);
        vec![Noticed { hindrance, ..seen(walking(frame)) }]
    });
    assert_eq!(brief[0].reason, Reason::TooBrief { frames: 11 });
}

#[test]
fn what_is_brief_or_does_not_move_is_nobody() {
    let cut_off = |rectangle: Rectangle| vec![hindered(rectangle, Hindrance::CutOff)];
    let brief = |frames: usize| {
        left_out_of(60, |frame| if frame < frames { cut_off(boxed(20 * frame, 9, 60, 200)) } else { vec![] })
    };
    assert_eq!([LEAST_FRAMES - 1, LEAST_FRAMES].map(|frames| brief(frames).len()), [0, 1]);
    assert!(left_out_of(60, |_| cut_off(walking(0))).is_empty(), "it stays");
    let arm = |frame: usize| boxed(100 + 3 * (frame % 5), 100, 9, 40);
    assert!(left_out_of(60, |frame| vec![hindered(arm(frame), Hindrance::WrongSize)]).is_empty());
    let part = |frame: usize| boxed(3 * frame, 100, 8, 20);
    let small = |beside: bool| {
        left_out_of(60, |frame| vec![Noticed { beside, ..hindered(part(frame), Hindrance::Small) }]).len()
    };
    assert_eq!([small(false), small(true)], [1, 0], "beside somebody it may be a part of that person");
    let tape = |frame: usize| boxed(3 * frame, 100, 40, 8);
    assert!(left_out_of(60, |frame| vec![hindered(tape(frame), Hindrance::Small)]).is_empty());
}

#[test]
fn who_is_refused_is_left_out_with_the_commonest_reason() {
    let mut unfollowed = Unfollowed::default();
    for frame in 0..40 {
        unfollowed.notice(frame, 0.04 * frame as f64, &[seen(walking(0))]);
        let speed_mps = if frame % 8 == 0 { 0.05 } else { 0.15 };
        let reason = if frame == 20 { Reason::WrongSize } else { Reason::TooSlow { speed_mps } };
        if frame >= 12 && frame.is_multiple_of(4) {
            unfollowed.refuse(frame, &walking(0), reason);
        }
    }
    unfollowed.refuse(39, &walking(30), Reason::NotWalking);
    unfollowed.finish(START_FRAMES);
    assert_eq!(unfollowed.count(), 1);
    let Reason::TooSlow { speed_mps } = unfollowed.left_out()[0].reason else { panic!() };
    // In frames 12, 16, 24, 28, 32 and 36.
    assert!((speed_mps - 0.1).abs() < 1e-9, "{speed_mps}");
}

#[test]
fn what_does_not_walk_may_be_too_wide_too_small_or_beside_somebody() {
    let of = |width: usize, height: usize, beside: bool| {
        let mut unfollowed = Unfollowed::default();
        for frame in 0..30 {
            let rectangle = boxed(2 * frame, 100, width, height);
            unfollowed.notice(frame, 0.04 * frame as f64, &[Noticed { beside, ..seen(rectangle) }]);
            unfollowed.refuse(frame, &rectangle, Reason::NotWalking);
        }
        unfollowed.finish(START_FRAMES);
        unfollowed.left_out()[0].reason.name()
    };
    assert_eq!(of(60, 200, false), "not walking");
    assert_eq!(of(160, 200, false), "too wide");
    assert_eq!(of(60, 200, true), "beside somebody");
    assert_eq!([of(9, 29, false), of(9, 30, false)], ["too small", "not walking"]);
}

#[test]
fn what_belongs_to_somebody_who_is_followed_is_not_left_out() {
    let walk = || Some(walk_boxes(30..60));
    let cut_off = |frame: usize| vec![hindered(walking(frame), Hindrance::CutOff)];
    let within = |frames: std::ops::Range<usize>| {
        let there = |frame: usize| if frames.contains(&frame) { cut_off(frame) } else { vec![] };
        left_out_beside(90, there, walk()).len()
    };
    assert_eq!(within(0..43), 0, "before the start, and the candidate of it");
    assert_eq!(within(60..90), 0, "after the end");
    assert_eq!(within(0..4), 0, "too brief");
    let shadow = |frame: usize| vec![hindered(boxed(25 + 4 * frame, 260, 90, 44), Hindrance::WrongSize)];
    assert!(left_out_beside(90, shadow, walk()).is_empty());
    assert_eq!(left_out_beside(90, shadow, None).len(), 1);
    let far = |frame: usize| vec![hindered(boxed(500 - 4 * frame, 100, 60, 200), Hindrance::CutOff)];
    assert_eq!(left_out_beside(90, far, walk()).len(), 1, "who walks the other way is somebody else");
    // The arm ahead of somebody who leaves the image, against the border.
    let leaving = |frame: usize| match frame {
        70..80 => vec![hindered(boxed(60 + 4 * frame, 110, 20, 180), Hindrance::CutOff)],
        _ => vec![],
    };
    assert!(left_out_beside(90, leaving, Some(walk_boxes(0..90))).is_empty());
    assert_eq!(left_out_beside(90, leaving, None).len(), 1);
    let beside = |frame: usize| vec![Noticed { beside: true, ..seen(boxed(50 + 4 * frame, 105, 40, 190)) }];
    let all_along = Some(walk_boxes(0..90));
    let found = left_out_beside(90, |frame| if frame >= 13 { beside(frame) } else { vec![] }, all_along);
    assert_eq!(reasons(&found), ["beside somebody"], "as tall as the one who is followed");
}

#[test]
fn a_walk_that_was_none_is_left_out_with_what_was_seen_before_it() {
    let mut unfollowed = Unfollowed::default();
    for frame in 0..30 {
        unfollowed.notice(frame, 0.04 * frame as f64, &[hindered(walking(frame), Hindrance::CutOff)]);
    }
    unfollowed.withdrawn(walk_boxes(18..60), Reason::NotWalking);
    unfollowed.finish(START_FRAMES);
    let found = unfollowed.left_out();
    assert_eq!(reasons(&found), ["not walking"]);
    assert_eq!((found[0].first().frame, found[0].last().frame), (0, 59));
}

/// The model of somebody may be withdrawn in a frame in which the region is noticed again.
#[test]
fn what_is_seen_again_in_the_frame_in_which_its_walk_ended_is_one_thing() {
    let mut unfollowed = Unfollowed::default();
    unfollowed.withdrawn(walk_boxes(0..30), Reason::Beside);
    for frame in 29..60 {
        unfollowed.notice(frame, 0.04 * frame as f64, &[seen(walking(frame))]);
    }
    unfollowed.finish(START_FRAMES);
    let left_out = unfollowed.left_out();
    let frames = |left: &LeftOut| [left.shots[0].frame, left.shots[left.shots.len() - 1].frame];
    assert_eq!(left_out.iter().map(frames).collect::<Vec<_>>(), [[0, 59]]);
}

#[test]
fn a_thing_waits_for_the_end_of_the_walks_of_its_time() {
    let mut unfollowed = Unfollowed::default();
    for frame in 0..80 {
        let there = if frame < 20 { vec![hindered(walking(frame), Hindrance::CutOff)] } else { vec![] };
        unfollowed.notice(frame, 0.04 * frame as f64, &there);
        unfollowed.settle(0.8, START_FRAMES);
    }
    assert_eq!(unfollowed.count(), 0, "a walk that began in frame 20 goes on");
    unfollowed.followed(walk_boxes(20..80));
    unfollowed.settle(f64::INFINITY, START_FRAMES);
    assert_eq!((unfollowed.count(), unfollowed.walks.len()), (0, 0));
}

#[test]
fn the_box_of_a_walk_is_where_the_person_was_and_shortly_before_and_after() {
    let walk_boxes = walk_boxes(25..75);
    for frame in [1usize, 10, 25, 40, 74, 90, 99] {
        let at = walk_boxes.at(0.04 * frame as f64).unwrap();
        let true_box = walking(frame).sides(0.0);
        assert!(
            (at.left - true_box.left).abs() < 1e-6 && (at.right - true_box.right).abs() < 1e-6,
            "{frame}"
        );
    }
    assert!(walk_boxes.at(-0.1).is_none() && walk_boxes.at(0.04 * 101.0).is_none());
}

#[test]
fn memory_is_bounded() {
    let mut unfollowed = Unfollowed::default();
    // For each third of a second, twenty things that cross the picture and one that never goes.
    for frame in 0..3000usize {
        let lane = |k: usize| boxed(6 * (frame % 60) + 3, 45 * k, 20, 40);
        let mut all: Vec<Noticed> = (0..20).map(|k| hindered(lane(k), Hindrance::CutOff)).collect();
        all.push(seen(boxed(600, 10, 30, 80)));
        let shown = if frame % 60 < 30 { &all[..] } else { &all[20..] };
        unfollowed.notice(frame, 0.04 * frame as f64, shown);
        unfollowed.settle(if frame < 2000 { 0.0 } else { f64::INFINITY }, START_FRAMES);
        if frame % 10 == 0 {
            unfollowed.followed(walk_boxes(frame..frame + 20));
        }
        assert!(unfollowed.open.len() <= MOST_THINGS && unfollowed.closed.len() <= MOST_CLOSED);
        assert!(unfollowed.walks.len() <= MOST_WALKS && unfollowed.left_out.len() <= MOST_LEFT_OUT);
        assert!(unfollowed.open.iter().all(|thing| thing.shots.kept.len() <= MOST_SHOTS));
    }
    unfollowed.finish(START_FRAMES);
    assert!(unfollowed.count() > MOST_LEFT_OUT, "all are counted: {}", unfollowed.count());
}

proptest! {
    /// Things that never touch each other have one entry each, from the first to the last frame.
    #[test]
    fn planted_things_are_found_once_each(
        planted in proptest::collection::vec((0usize..40, 20usize..60, 1usize..6, any::<bool>()), 1..7)
    ) {
        let rectangle = |k: usize, frame: usize| {
            let (first, _, speed, leftward) = planted[k];
            let moved = speed * (frame - first);
            boxed(if leftward { 700 - moved } else { 50 + moved }, 60 * k, 16, 50)
        };
        let found = left_out_of(120, |frame| {
            let there = |k: &usize| (planted[*k].0..planted[*k].0 + planted[*k].1).contains(&frame);
            let ks = (0..planted.len()).filter(there);
            ks.map(|k| hindered(rectangle(k, frame), Hindrance::CutOff)).collect()
        });
        prop_assert_eq!(found.len(), planted.len());
        for (k, (first, frames, ..)) in planted.iter().enumerate() {
            let own: Vec<_> = found.iter().filter(|left| left.first().rectangle.top == 60 * k).collect();
            prop_assert_eq!(own.len(), 1);
            prop_assert_eq!((own[0].first().frame, own[0].frames), (*first, *frames));
            prop_assert_eq!(own[0].last().rectangle, rectangle(k, first + frames - 1));
        }
    }
}
