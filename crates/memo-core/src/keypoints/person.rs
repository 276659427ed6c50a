//! Selects the person to follow among all people detected in each frame.
//!
//! Following starts at the most prominent person of the whole sequence, the one with the largest product of
//! size and mean score; from there the nearest person is followed from frame to frame, forwards and
//! backwards. Size is the diagonal of the bounding box of the points; distance is the median distance over
//! the points visible in both frames. A frame in which nobody is near enough has no person.
//!
//! Limits: no motion is predicted, so two people who come closer to each other than the person moves between
//! two frames may be confused.

use super::layouts::size_px;
use crate::wording::counted;
use glam::DVec2;
use thiserror::Error;

/// Largest distance of the nearest person from where the person was last seen, as a fraction of their size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowOptions {
    /// Largest distance between consecutive frames. Default 0.3: a walker at 7 frames per second covers 0.12
    /// body heights between two frames; the rest is a margin for detectors that jump.
    pub reach: f64,
    /// Increase for every frame in which nobody was near enough. Default 0.1.
    pub reach_per_frame: f64,
    /// Upper bound, however long the person was lost. Default 1.
    pub farthest: f64,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self { reach: 0.3, reach_per_frame: 0.1, farthest: 1.0 }
    }
}

/// Why people were refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FollowError {
    /// The lengths of the lists are inconsistent.
    #[error(
        "points and scores of {} with {} each: {} wanted, got {points} and {scores}",
        if *people == 1 { "1 person".to_owned() } else { format!("{people} people") },
        counted(*joints, "point"),
        people.saturating_mul(*joints)
    )]
    Count {
        /// Number of people, with one frame number each.
        people: usize,
        /// Number of points per person.
        joints: usize,
        /// Number of points given.
        points: usize,
        /// Number of scores given.
        scores: usize,
    },
    /// The frame numbers are not in order.
    #[error("frame {after} follows frame {before}: people must be in the order of their frames")]
    Order {
        /// The earlier entry.
        before: i64,
        /// The following entry.
        after: i64,
    },
}

/// One detected person.
struct Person<'a> {
    frame: i64,
    points_px: &'a [DVec2],
    size_px: f64,
    prominence: f64,
}

/// Marks the followed person among all people. `frames[i]` is the frame of person i, in ascending order; each
/// person has `joint_count` points (NaN where missing) and scores. At most one person per frame is marked; if
/// no frame contains two people, all are marked.
///
/// # Errors
///
/// The lengths of the lists are inconsistent, or the frame numbers are not in order.
pub fn follow_person(
    frames: &[i64],
    joint_count: usize,
    points_px: &[DVec2],
    scores: &[f64],
    options: &FollowOptions,
) -> Result<Vec<bool>, FollowError> {
    let expected = frames.len().checked_mul(joint_count);
    if expected != Some(points_px.len()) || expected != Some(scores.len()) {
        let (points, scores) = (points_px.len(), scores.len());
        return Err(FollowError::Count { people: frames.len(), joints: joint_count, points, scores });
    }
    if let Some(pair) = frames.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(FollowError::Order { before: pair[0], after: pair[1] });
    }
    let alone = frames.windows(2).all(|pair| pair[0] != pair[1]);
    if alone || joint_count == 0 {
        return Ok(vec![alone; frames.len()]);
    }
    let people: Vec<Person> = (0..frames.len())
        .map(|i| {
            let range = i * joint_count..(i + 1) * joint_count;
            Person::new(frames[i], &points_px[range.clone()], &scores[range])
        })
        .collect();
    let by_prominence =
        |&a: &usize, &b: &usize| people[a].prominence.total_cmp(&people[b].prominence).then(b.cmp(&a));
    let mut chosen = vec![false; people.len()];
    if let Some(anchor) = (0..people.len()).max_by(by_prominence) {
        chosen[anchor] = true;
        follow(&people, anchor, (anchor + 1..people.len()).collect(), options, &mut chosen);
        follow(&people, anchor, (0..anchor).rev().collect(), options, &mut chosen);
    }
    Ok(chosen)
}

/// Follows from `anchor` through the people of `order`, frame by frame.
fn follow(people: &[Person], anchor: usize, order: Vec<usize>, options: &FollowOptions, chosen: &mut [bool]) {
    let mut last = anchor;
    for same_frame in order.chunk_by(|&a, &b| people[a].frame == people[b].frame) {
        let frame = people[same_frame[0]].frame;
        if frame == people[anchor].frame {
            continue;
        }
        let lost = frame.abs_diff(people[last].frame).saturating_sub(1) as f64;
        let reach = (options.reach + options.reach_per_frame * lost).min(options.farthest);
        let near = same_frame.iter().filter_map(|&i| {
            let distance = people[i].distance_px(&people[last])?;
            (distance <= reach * people[i].size_px.max(people[last].size_px)).then_some((distance, i))
        });
        if let Some((_, nearest)) = near.min_by(|a, b| a.0.total_cmp(&b.0)) {
            chosen[nearest] = true;
            last = nearest;
        }
    }
}

impl<'a> Person<'a> {
    fn new(frame: i64, points_px: &'a [DVec2], scores: &[f64]) -> Self {
        let seen = || points_px.iter().zip(scores).filter(|(point, _)| point.is_finite());
        let count = seen().count();
        let size_px = size_px(points_px);
        let total: f64 = seen().map(|(_, score)| if score.is_finite() { score.max(0.0) } else { 0.0 }).sum();
        let prominence = size_px * total / count.max(1) as f64;
        // Implausibly large coordinates overflow; such a person must not be the most prominent.
        Self { frame, points_px, size_px, prominence: if prominence.is_finite() { prominence } else { 0.0 } }
    }

    /// Median distance over the points visible in both; `None` if there is no such point.
    fn distance_px(&self, other: &Self) -> Option<f64> {
        let pairs = self.points_px.iter().zip(other.points_px);
        let mut distances: Vec<f64> =
            pairs.map(|(a, b)| a.distance(*b)).filter(|distance| distance.is_finite()).collect();
        distances.sort_by(f64::total_cmp);
        distances.get(distances.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::random::Random;

    /// A person of five points at `x`, `size` high.
    fn person(x: f64, size: f64, random: &mut Random) -> Vec<DVec2> {
        let point = |k: usize, jitter: DVec2| DVec2::new(x, size * k as f64 / 4.0) + jitter;
        (0..5).map(|k| point(k, DVec2::from(random.normal_pair().map(f64::from)))).collect()
    }

    /// Two people who cross (in random order within a frame) and a false detection in the first frame;
    /// returns who is marked.
    fn followed(first_gap: std::ops::Range<usize>) -> Vec<Option<char>> {
        let mut random = Random::new(11);
        let (mut frames, mut points, mut scores, mut who) = (vec![], vec![], vec![], vec![]);
        for t in 0..60_usize {
            let walker = (100.0 + 8.0 * t as f64, 200.0, 0.9, 'w');
            let other = (700.0 - 3.0 * t as f64, 120.0, 0.8, 'o');
            let ghost = (30.0, 60.0, 0.3, 'g');
            let mut present = vec![other];
            present.extend((!first_gap.contains(&t)).then_some(walker));
            present.extend((t == 0).then_some(ghost));
            if random.uniform(0.0, 1.0) < 0.5 {
                present.reverse();
            }
            for (x, size, score, name) in present {
                frames.push(t as i64);
                points.extend(person(x, size, &mut random));
                scores.extend([score; 5]);
                who.push(name);
            }
        }
        let chosen = follow_person(&frames, 5, &points, &scores, &FollowOptions::default()).unwrap();
        (0..60)
            .map(|t| {
                let marked: Vec<usize> = (0..frames.len()).filter(|&i| frames[i] == t && chosen[i]).collect();
                assert!(marked.len() <= 1);
                marked.first().map(|&i| who[i])
            })
            .collect()
    }

    #[test]
    fn the_largest_person_is_followed_past_others_and_ghosts() {
        assert_eq!(followed(0..0), vec![Some('w'); 60]);
    }

    #[test]
    fn a_person_out_of_sight_leaves_a_gap_and_nobody_takes_their_place() {
        let found = followed(20..26);
        for (t, name) in found.into_iter().enumerate() {
            assert_eq!(name, (!(20..26).contains(&t)).then_some('w'), "frame {t}");
        }
    }

    /// People of three points, two of them at the top: frame, position, size, score. Returns who is followed.
    fn of_three_points(people: &[(i64, f64, f64, f64)]) -> Vec<bool> {
        let frames: Vec<i64> = people.iter().map(|p| p.0).collect();
        let points: Vec<DVec2> =
            people.iter().flat_map(|p| [0.0, 1.0, p.2].map(|y| DVec2::new(p.1, y))).collect();
        let scores: Vec<f64> = people.iter().flat_map(|p| [p.3; 3]).collect();
        follow_person(&frames, 3, &points, &scores, &FollowOptions::default()).unwrap()
    }

    /// The reach is three tenths of the larger of both sizes to the next frame, a tenth more for every frame
    /// between, and at most one size.
    #[test]
    fn the_nearest_person_is_followed_within_reach() {
        for (frame, size, reach_px) in
            [(1, 100.0, 30.0), (1, 50.0, 30.0), (2, 100.0, 40.0), (4, 100.0, 60.0), (100, 100.0, 100.0)]
        {
            for beyond in [-1.0, 1.0] {
                // A second person far away makes a choice necessary.
                let people =
                    [(0, 0.0, 100.0, 0.9), (0, 5000.0, 10.0, 0.1), (frame, reach_px + beyond, size, 0.9)];
                assert_eq!(of_three_points(&people), [true, false, beyond < 0.0], "{frame} {size} {beyond}");
            }
        }
    }

    /// The most prominent person has the largest product of size and mean score, not of size and points.
    #[test]
    fn many_doubtful_points_are_not_prominent() {
        let sure = [DVec2::ZERO, DVec2::new(0.0, 100.0), DVec2::NAN, DVec2::NAN, DVec2::NAN];
        let doubtful: Vec<DVec2> = (0..5).map(|k| DVec2::new(900.0, 25.0 * f64::from(k))).collect();
        let points = [sure.to_vec(), doubtful].concat();
        let scores = [[0.9; 5], [0.4; 5]].concat();
        let chosen = follow_person(&[0, 0], 5, &points, &scores, &FollowOptions::default()).unwrap();
        assert_eq!(chosen, [true, false]);
    }

    #[test]
    fn people_alone_in_their_frames_need_no_choice() {
        let points = [DVec2::ZERO, DVec2::new(1e6, 0.0), DVec2::NAN];
        let all = follow_person(&[0, 5, 6], 1, &points, &[1.0; 3], &FollowOptions::default());
        assert_eq!(all, Ok(vec![true; 3]));
    }

    #[test]
    fn broken_points_are_no_person_and_broken_lists_are_refused() {
        let options = FollowOptions::default();
        let points = [DVec2::NAN, DVec2::NAN, DVec2::splat(f64::MAX), DVec2::splat(-f64::MAX)];
        let chosen =
            follow_person(&[0, 0], 2, &points, &[f64::NAN, 1.0, 1.0, f64::INFINITY], &options).unwrap();
        assert_eq!(chosen.iter().filter(|&&chosen| chosen).count(), 1);
        assert_eq!(follow_person(&[0, 0], 0, &[], &[], &options), Ok(vec![false; 2]));
        assert_eq!(follow_person(&[], 3, &[], &[], &options), Ok(vec![]));
        let message = follow_person(&[0, 1], 2, &points[..3], &[1.0; 4], &options).unwrap_err().to_string();
        assert_eq!(message, "points and scores of 2 people with 2 points each: 4 wanted, got 3 and 4");
        let message = follow_person(&[4, 1], 2, &points, &[1.0; 4], &options).unwrap_err().to_string();
        assert!(message.starts_with("frame 1 follows frame 4"), "{message}");
    }
}
