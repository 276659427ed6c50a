//! Follows everyone through the lists of people that a detector gives for each frame, in any order.
//!
//! 1. Of two detections at almost the same place, only the more prominent counts: detectors find one person twice.
//! 2. Everybody followed is expected where their velocity takes them.
//! 3. Expectations and detections are paired so that the sum of their costs, and of 1 for everybody not found, is
//!    smallest. A pair costs Σ min((distance / reach)², 1) over the points known of both, divided by the number of all
//!    points, and is possible if the median distance is within the reach.
//! 4. Whoever is left is somebody new; whoever is not found is expected within a growing distance.
//!
//! The reach is a share of the size, the diagonal of the bounding box of the points. Where exchanging two people costs
//! hardly more, they may be exchanged: a doubt.
//!
//! Limits: people are known by their places alone. Who leaves the picture and comes back is somebody new, and two who
//! meet, stop and part may be exchanged.

use super::layouts::size_px;
use crate::estimate::assignment::assignment;
use crate::wording::counted;
use glam::DVec2;
use thiserror::Error;

/// How people are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowOptions {
    /// Largest distance from where somebody is expected in the next frame, as a share of their size. Default 0.3: a
    /// walker at 7 frames per second covers 0.12 body heights between two frames; the rest is a margin for detectors
    /// that jump.
    pub reach: f64,
    /// Increase for every frame in which the person was not found. Default 0.1.
    pub reach_per_frame: f64,
    /// Upper bound, however long the person was not found. Default 1.
    pub farthest: f64,
    /// Who is not found in this many frames is somebody new afterwards. Default 300: ten seconds at 30 frames per second.
    pub longest_gap: u64,
    /// Detections that are nearer to each other than this share of their size are one person. Default 0.05.
    pub same: f64,
    /// Standard deviation of the distance from where somebody is expected, as a share of the reach, with which the
    /// probability of an exchange is computed. Default 0.18, chosen on drawn crowds.
    pub sd: f64,
    /// An exchange of at least this probability is a doubt. Default 0.1.
    pub doubt: f64,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self {
            reach: 0.3,
            reach_per_frame: 0.1,
            farthest: 1.0,
            longest_gap: 300,
            same: 0.05,
            sd: 0.18,
            doubt: 0.1,
        }
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

/// Everyone in a sequence of detections.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Followed {
    /// For each detection the number of its person; `None` if it is another detection of somebody. People are numbered
    /// from the most prominent on, by the sum over their detections of size times mean score.
    pub person: Vec<Option<usize>>,
    /// Number of people.
    pub count: usize,
    /// Where two people may be exchanged, in the order of frames.
    pub doubts: Vec<Doubt>,
}

/// Two people who may be exchanged from a frame on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// The numbers of both, ascending.
    pub people: [usize; 2],
    /// The frame of the greatest probability.
    pub frame: i64,
    /// Probability that they are exchanged there.
    pub probability: f64,
}

/// Who was not found for longer is expected to have stopped.
const LONGEST_COASTING: f64 = 15.0;
/// Weight of the newest displacement in the velocity.
const NEWEST: f64 = 0.3;
/// Doubts about the same two people within this many frames are one.
const ONE_MEETING: i64 = 30;

/// Follows everyone. `frames[i]` is the frame of detection i, in ascending order; each detection has `joint_count` points
/// (NaN where missing) and scores.
///
/// # Errors
///
/// The lengths of the lists are inconsistent, or the frame numbers are not in order.
pub fn follow_everyone(
    frames: &[i64],
    joint_count: usize,
    points_px: &[DVec2],
    scores: &[f64],
    options: &FollowOptions,
) -> Result<Followed, FollowError> {
    let expected = frames.len().checked_mul(joint_count);
    if expected != Some(points_px.len()) || expected != Some(scores.len()) {
        let (points, scores) = (points_px.len(), scores.len());
        return Err(FollowError::Count { people: frames.len(), joints: joint_count, points, scores });
    }
    if let Some(pair) = frames.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(FollowError::Order { before: pair[0], after: pair[1] });
    }
    let detections: Vec<Detection> = (0..frames.len())
        .map(|i| {
            let range = i * joint_count..(i + 1) * joint_count;
            Detection::new(frames[i], &points_px[range.clone()], &scores[range])
        })
        .collect();
    // Whoever is alone in every frame is one person, wherever they are.
    if frames.windows(2).all(|pair| pair[0] != pair[1]) {
        let count = usize::from(!frames.is_empty());
        return Ok(Followed { person: vec![Some(0); frames.len()], count, doubts: Vec::new() });
    }
    let mut crowd = Crowd { options, detections: &detections, people: Vec::new(), doubts: Vec::new() };
    let all: Vec<usize> = (0..detections.len()).collect();
    for same_frame in all.chunk_by(|&a, &b| detections[a].frame == detections[b].frame) {
        crowd.add_frame(&crowd.alone(same_frame));
    }
    Ok(crowd.numbered())
}

/// One detected person.
struct Detection<'a> {
    frame: i64,
    points_px: &'a [DVec2],
    size_px: f64,
    prominence: f64,
}

/// A person who is followed.
struct Person {
    /// Their detections.
    seen: Vec<usize>,
    /// Frame of the last one.
    frame: i64,
    /// Where the points were in it; points that it does not show, where they were last, moved on with the velocity.
    points_px: Vec<DVec2>,
    size_px: f64,
    /// Pixels per frame.
    velocity_px: DVec2,
}

struct Crowd<'a> {
    options: &'a FollowOptions,
    detections: &'a [Detection<'a>],
    people: Vec<Person>,
    doubts: Vec<Doubt>,
}

impl Crowd<'_> {
    /// Step 1, the detections of a frame, each of somebody else.
    fn alone(&self, same_frame: &[usize]) -> Vec<usize> {
        let mut by_prominence = same_frame.to_vec();
        by_prominence.sort_by(|&a, &b| {
            self.detections[b].prominence.total_cmp(&self.detections[a].prominence).then(a.cmp(&b))
        });
        let mut alone: Vec<usize> = Vec::with_capacity(same_frame.len());
        for i in by_prominence {
            let own = &self.detections[i];
            let is_other = |&other: &usize| {
                let other = &self.detections[other];
                let distance_px = middle(own.distances_px(other.points_px, DVec2::ZERO));
                let same_px = self.options.same * own.size_px.max(other.size_px);
                distance_px.is_none_or(|distance_px| distance_px > same_px)
            };
            if alone.iter().all(is_other) {
                alone.push(i);
            }
        }
        alone.sort_unstable();
        alone
    }

    /// Steps 2 to 4.
    fn add_frame(&mut self, detections: &[usize]) {
        let frame = self.detections[detections[0]].frame;
        // Only people whom somebody in this frame can be: false detections make many who are never seen again.
        let costs: Vec<(usize, Vec<f64>)> = (0..self.people.len())
            .filter(|&person| frame.abs_diff(self.people[person].frame) <= self.options.longest_gap)
            .map(|person| {
                let cost = |&i: &usize| self.cost(&self.people[person], i).unwrap_or(f64::INFINITY);
                (person, detections.iter().map(cost).collect())
            })
            .filter(|(_, costs): &(usize, Vec<f64>)| costs.iter().any(|cost| cost.is_finite()))
            .collect();
        let found = assignment(costs.len(), detections.len(), 1.0, |row, column| costs[row].1[column]);
        let pairs: Vec<(usize, usize)> = costs
            .iter()
            .zip(&found)
            .filter_map(|((person, _), column)| Some((*person, detections[(*column)?])))
            .collect();
        self.note_doubts(&pairs);
        for &(person, detection) in &pairs {
            self.found(person, detection);
        }
        let new = |&i: &usize| {
            let Detection { frame, points_px, size_px, .. } = self.detections[i];
            let points_px = points_px.to_vec();
            Person { seen: vec![i], frame, points_px, size_px, velocity_px: DVec2::ZERO }
        };
        let is_free = |i: &&usize| pairs.iter().all(|pair| pair.1 != **i);
        self.people.extend(detections.iter().filter(is_free).map(new));
    }

    /// What it costs that a detection is this person, at most 1; `None` if most points are beyond the reach.
    fn cost(&self, person: &Person, detection: usize) -> Option<f64> {
        let own = &self.detections[detection];
        let frames = own.frame.abs_diff(person.frame) as f64;
        let FollowOptions { reach, reach_per_frame, farthest, .. } = self.options;
        let reach = (reach + reach_per_frame * (frames - 1.0)).min(*farthest);
        let reach_px = reach * own.size_px.max(person.size_px);
        let coasted_px = person.coasted_px(frames);
        let distances = own.distances_px(&person.points_px, coasted_px);
        if middle(distances.clone())? > reach_px {
            return None;
        }
        let squares = distances
            .filter(|px| px.is_finite())
            .map(|px| if px > 0.0 { (px / reach_px).powi(2) } else { 0.0 });
        Some(squares.map(|square| square.min(1.0)).sum::<f64>() / own.points_px.len() as f64)
    }

    /// Notes the pairs of people whose exchange is nearly as probable.
    fn note_doubts(&mut self, pairs: &[(usize, usize)]) {
        let cost = |person: usize, detection: usize| self.cost(&self.people[person], detection);
        let mut doubts = Vec::new();
        for (k, &(a, of_a)) in pairs.iter().enumerate() {
            for &(b, of_b) in &pairs[..k] {
                let exchanged = cost(a, of_b).zip(cost(b, of_a)).map(|(one, other)| one + other);
                let own = cost(a, of_a).zip(cost(b, of_b)).map(|(one, other)| one + other);
                let Some((exchanged, own)) = exchanged.zip(own) else { continue };
                // ln of the ratio of the densities of two distances in the plane.
                let log_odds = 0.5 * (exchanged - own) / self.options.sd.powi(2);
                let probability = 1.0 / (1.0 + log_odds.exp());
                if probability >= self.options.doubt {
                    let frame = self.detections[of_a].frame;
                    doubts.push(Doubt { people: [b.min(a), b.max(a)], frame, probability });
                }
            }
        }
        for doubt in doubts {
            let is_same =
                |other: &&mut Doubt| other.people == doubt.people && doubt.frame - other.frame <= ONE_MEETING;
            match self.doubts.iter_mut().rev().find(is_same) {
                Some(before) if before.probability >= doubt.probability => {}
                Some(before) => *before = doubt,
                None => self.doubts.push(doubt),
            }
        }
    }

    fn found(&mut self, person: usize, detection: usize) {
        let (person, own) = (&mut self.people[person], &self.detections[detection]);
        let frames = own.frame.abs_diff(person.frame) as f64;
        if let Some(moved_px) = own.displacement_px(&person.points_px) {
            let weight = if person.seen.len() == 1 { 1.0 } else { NEWEST };
            person.velocity_px = person.velocity_px.lerp(moved_px / frames.max(1.0), weight);
        }
        let coasted_px = person.coasted_px(frames);
        for (point, seen) in person.points_px.iter_mut().zip(own.points_px) {
            *point = if seen.is_finite() { *seen } else { *point + coasted_px };
        }
        (person.frame, person.size_px) = (own.frame, own.size_px);
        person.seen.push(detection);
    }

    /// The people, the most prominent first.
    fn numbered(mut self) -> Followed {
        let prominence =
            |person: &Person| -> f64 { person.seen.iter().map(|&i| self.detections[i].prominence).sum() };
        let mut order: Vec<usize> = (0..self.people.len()).collect();
        order.sort_by(|&a, &b| {
            prominence(&self.people[b]).total_cmp(&prominence(&self.people[a])).then(a.cmp(&b))
        });
        let mut numbers = vec![0; order.len()];
        order.iter().enumerate().for_each(|(number, &person)| numbers[person] = number);
        let mut person = vec![None; self.detections.len()];
        for (own, number) in self.people.iter().zip(&numbers) {
            own.seen.iter().for_each(|&i| person[i] = Some(*number));
        }
        for doubt in &mut self.doubts {
            doubt.people = doubt.people.map(|person| numbers[person]);
            doubt.people.sort_unstable();
        }
        Followed { person, count: numbers.len(), doubts: self.doubts }
    }
}

impl Person {
    /// How far the person is expected to have moved after some frames.
    fn coasted_px(&self, frames: f64) -> DVec2 {
        frames.min(LONGEST_COASTING) * self.velocity_px
    }
}

impl<'a> Detection<'a> {
    fn new(frame: i64, points_px: &'a [DVec2], scores: &[f64]) -> Self {
        let seen = || points_px.iter().zip(scores).filter(|(point, _)| point.is_finite());
        let count = seen().count();
        let size_px = size_px(points_px);
        let total: f64 = seen().map(|(_, score)| if score.is_finite() { score.max(0.0) } else { 0.0 }).sum();
        let prominence = size_px * total / count.max(1) as f64;
        // Implausibly large coordinates overflow; such a person must not be the most prominent.
        Self { frame, points_px, size_px, prominence: if prominence.is_finite() { prominence } else { 0.0 } }
    }

    /// Distances from the points of a person, who have moved; NaN where a point is not known of both.
    fn distances_px(&self, others_px: &[DVec2], moved_px: DVec2) -> impl Iterator<Item = f64> + Clone {
        self.points_px.iter().zip(others_px).map(move |(a, b)| a.distance(*b + moved_px))
    }

    /// Median displacement from other points.
    fn displacement_px(&self, others_px: &[DVec2]) -> Option<DVec2> {
        let moved = || self.points_px.iter().zip(others_px).map(|(a, b)| *a - *b);
        let moved_px = DVec2::new(middle(moved().map(|by| by.x))?, middle(moved().map(|by| by.y))?);
        moved_px.is_finite().then_some(moved_px)
    }
}

/// The upper median of the finite numbers.
fn middle(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    let mut finite: Vec<f64> = numbers.filter(|number| number.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite.get(finite.len() / 2).copied()
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

    /// Two people who cross (in random order within a frame) and a false detection in the first frame; the names of the
    /// detections of each person, by number.
    fn followed(gap: std::ops::Range<usize>) -> (Vec<Vec<(usize, char)>>, Vec<Doubt>) {
        let mut random = Random::new(11);
        let (mut frames, mut points, mut scores, mut who) = (vec![], vec![], vec![], vec![]);
        for t in 0..60_usize {
            let walker = (100.0 + 8.0 * t as f64, 200.0, 0.9, 'w');
            let other = (700.0 - 3.0 * t as f64, 120.0, 0.8, 'o');
            let ghost = (30.0, 60.0, 0.3, 'g');
            let mut present = vec![other];
            present.extend((!gap.contains(&t)).then_some(walker));
            present.extend((t == 0).then_some(ghost));
            if random.uniform(0.0, 1.0) < 0.5 {
                present.reverse();
            }
            for (x, size, score, name) in present {
                frames.push(t as i64);
                points.extend(person(x, size, &mut random));
                scores.extend([score; 5]);
                who.push((t, name));
            }
        }
        let found = follow_everyone(&frames, 5, &points, &scores, &FollowOptions::default()).unwrap();
        let of = |number: usize| {
            let own = found.person.iter().zip(&who).filter(|(person, _)| **person == Some(number));
            own.map(|(_, who)| *who).collect()
        };
        ((0..found.count).map(of).collect(), found.doubts)
    }

    #[test]
    fn everyone_is_followed_past_others_and_ghosts_the_most_prominent_first() {
        let (people, doubts) = followed(0..0);
        let all = |name: char| (0..60).map(|t| (t, name)).collect::<Vec<_>>();
        assert_eq!(people, [all('w'), all('o'), vec![(0, 'g')]]);
        assert_eq!(doubts, [], "people of 200 and of 120 pixels are not exchanged");
    }

    #[test]
    fn a_person_out_of_sight_leaves_a_gap_and_nobody_takes_their_place() {
        // They cross in frame 54: behind the other, too.
        for gap in [20..32, 50..58] {
            let (people, _) = followed(gap.clone());
            assert_eq!(people[0], (0..60).filter(|t| !gap.contains(t)).map(|t| (t, 'w')).collect::<Vec<_>>());
            assert_eq!(people[1].len(), 60);
        }
    }

    /// People of three points, two of them at the top: frame, position, size, score. Returns their numbers.
    fn of_three_points(people: &[(i64, f64, f64, f64)]) -> Followed {
        let frames: Vec<i64> = people.iter().map(|p| p.0).collect();
        let points: Vec<DVec2> =
            people.iter().flat_map(|p| [0.0, 1.0, p.2].map(|y| DVec2::new(p.1, y))).collect();
        let scores: Vec<f64> = people.iter().flat_map(|p| [p.3; 3]).collect();
        follow_everyone(&frames, 3, &points, &scores, &FollowOptions::default()).unwrap()
    }

    /// The reach is three tenths of the larger of both sizes to the next frame, a tenth more for every frame
    /// between, and at most one size.
    #[test]
    fn somebody_is_found_within_reach() {
        for (frame, size, reach_px) in
            [(1, 100.0, 30.0), (1, 50.0, 30.0), (2, 100.0, 40.0), (4, 100.0, 60.0), (300, 100.0, 100.0)]
        {
            for beyond in [-1.0, 1.0] {
                // A second person far away makes a choice necessary.
                let people =
                    [(0, 0.0, 100.0, 0.9), (0, 5000.0, 10.0, 0.1), (frame, reach_px + beyond, size, 0.9)];
                let found = of_three_points(&people);
                assert_eq!(found.count, 2 + usize::from(beyond > 0.0), "{frame} {size} {beyond}");
            }
        }
    }

    #[test]
    fn who_is_away_for_long_comes_back_as_somebody_new() {
        let after =
            |frame| of_three_points(&[(0, 0.0, 100.0, 0.9), (0, 500.0, 90.0, 0.9), (frame, 0.0, 100.0, 0.9)]);
        assert_eq!([300, 301].map(|frame| after(frame).count), [2, 3]);
    }

    /// Greedy pairs would give the nearer detection to the wrong person.
    #[test]
    fn pairs_are_chosen_together() {
        let found = of_three_points(&[
            (0, 0.0, 100.0, 0.9),
            (0, 10.0, 100.0, 0.8),
            (1, 16.0, 100.0, 0.9),
            (1, 6.0, 100.0, 0.9),
        ]);
        assert_eq!(found.person, [Some(0), Some(1), Some(1), Some(0)]);
        assert_eq!(found.doubts, []);
    }

    #[test]
    fn two_who_are_hardly_apart_may_be_exchanged() {
        let people = [(0, 0.0), (0, 7.0), (1, 1.0), (1, 6.5)].map(|(frame, x)| (frame, x, 100.0, 0.9));
        // 0.01² and 0.005² against 0.065² and 0.06², of a reach of 0.3, with a standard deviation of 0.18 of it.
        let log_odds = 0.5 * (0.065f64.powi(2) + 0.06f64.powi(2) - 0.000125) / (0.3f64 * 0.18).powi(2);
        let [doubt] = of_three_points(&people).doubts[..] else { panic!("wanted a doubt") };
        assert_eq!((doubt.people, doubt.frame), ([0, 1], 1));
        assert!((doubt.probability - 1.0 / (1.0 + log_odds.exp())).abs() < 1e-9, "{doubt:?}");
    }

    #[test]
    fn a_second_detection_of_somebody_is_nobody() {
        let mut people = Vec::new();
        for t in 0..20 {
            people.push((t, 5.0 * t as f64, 100.0, 0.9));
            people.push((t, 5.0 * t as f64 + 3.0, 100.0, 0.5));
        }
        let found = of_three_points(&people);
        assert_eq!(found.count, 1);
        for (k, person) in found.person.iter().enumerate() {
            assert_eq!(*person, (k % 2 == 0).then_some(0), "{k}");
        }
    }

    /// The most prominent person has the largest product of size and mean score, not of size and points.
    #[test]
    fn many_doubtful_points_are_not_prominent() {
        let sure = [DVec2::ZERO, DVec2::new(0.0, 100.0), DVec2::NAN, DVec2::NAN, DVec2::NAN];
        let doubtful: Vec<DVec2> = (0..5).map(|k| DVec2::new(900.0, 25.0 * f64::from(k))).collect();
        let points = [doubtful, sure.to_vec()].concat();
        let scores = [[0.4; 5], [0.9; 5]].concat();
        let found = follow_everyone(&[0, 0], 5, &points, &scores, &FollowOptions::default()).unwrap();
        assert_eq!(found.person, [Some(1), Some(0)]);
    }

    #[test]
    fn people_alone_in_their_frames_are_one_person() {
        let points = [DVec2::ZERO, DVec2::new(1e6, 0.0), DVec2::NAN];
        let all = follow_everyone(&[0, 5, 6], 1, &points, &[1.0; 3], &FollowOptions::default()).unwrap();
        assert_eq!((all.person, all.count), (vec![Some(0); 3], 1));
    }

    #[test]
    fn broken_points_are_no_person_and_broken_lists_are_refused() {
        let options = FollowOptions::default();
        let points = [DVec2::NAN, DVec2::NAN, DVec2::splat(f64::MAX), DVec2::splat(-f64::MAX)];
        let found =
            follow_everyone(&[0, 0], 2, &points, &[f64::NAN, 1.0, 1.0, f64::INFINITY], &options).unwrap();
        assert_eq!(found.count, 2);
        let found = follow_everyone(&[0, 0], 0, &[], &[], &options).unwrap();
        assert_eq!(found.person.len(), 2);
        assert_eq!(follow_everyone(&[], 3, &[], &[], &options), Ok(Followed::default()));
        let message = follow_everyone(&[0, 1], 2, &points[..3], &[1.0; 4], &options).unwrap_err().to_string();
        assert_eq!(message, "points and scores of 2 people with 2 points each: 4 wanted, got 3 and 4");
        let message = follow_everyone(&[4, 1], 2, &points, &[1.0; 4], &options).unwrap_err().to_string();
        assert!(message.starts_with("frame 1 follows frame 4"), "{message}");
    }
}
