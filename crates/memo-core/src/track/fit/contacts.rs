//! Initial contacts and toe-offs from the motion of the fitted feet.
//!
//! In stance a foot stands still, in swing it is faster than the body. Contact is a little after the time at which the heel's
//! speed along the path first falls below a share of the walking speed after a swing, toe-off the time at which the speed of the
//! tip of the toes last rises above one before a swing. Both are searched near the phases at which they happen in everybody,
//! and interpolated between times.

use crate::model::skeleton::Side;
use crate::track::event::EventKind;
use glam::{DVec2, DVec3};

/// An initial contact or toe-off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Time, seconds.
    pub time_s: f64,
    /// Initial contact or toe-off.
    pub kind: EventKind,
    /// Which foot.
    pub side: Side,
}

/// Heel and toes of the right and the left foot, metres.
pub type Feet = [[DVec3; 2]; 2];

/// The shares of the walking speed that separate stance from swing, of the heel at contact and of the toes at toe-off.
/// Over 80 drawn walks of six people, the mean times of people are 8 to 10 ms from their median (root mean square) with 0.28 to 0.5
/// of the heel, and 12 with 0.2; the sides of a person differ by 11 ms with 0.28, 9 with 0.4, 7 with 0.5 and 19 with 0.2.
const HEEL_SHARE: f64 = 0.4;
const TOE_SHARE: f64 = 0.4;
/// The initial contact is this much later, seconds: the median over nine drawn people, of seven of whom the fitted heel slows 26 to
/// 38 ms before the true contact, of CMU12 53 and of one slow walker 65. In two videos of real people, whose contacts were marked
/// by eye, it slows 1 and 10 ms after the contact, so contacts are 34 and 43 ms late there.
const CONTACT_LATER_S: f64 = 0.033;
/// Contacts lie this near to phase 0 of the side, toe-offs to the end of stance, cycles.
const NEAR: f64 = 0.2;
const TOE_OFF_PHASE: f64 = 0.61;

/// The feet are followed in steps of this time between frames, seconds, but in no more than so many.
const STEP_S: f64 = 0.005;
const MOST_STEPS: f64 = 50.0;

/// What varies with time, at the times of frames and in steps between them: on a cubic from frame to frame, with the slopes of the
/// parabolas through a frame and its neighbours. Between frames of 25 Hz alone, contacts of a stride that was repeated six times were
/// 40 ms apart in the same cycle, in these steps 2 ms.
pub fn between<const N: usize>(times_s: &[f64], frames: &[[f64; N]]) -> (Vec<f64>, Vec<[f64; N]>) {
    let (Some(first), Some(first_s)) = (frames.first(), times_s.first()) else { return Default::default() };
    let elapsed_s = |k: usize| times_s[k + 1] - times_s[k];
    let last = frames.len() - 1;
    let rate = |k: usize, n: usize| (frames[k + 1][n] - frames[k][n]) / elapsed_s(k);
    let slope = |k: usize, n: usize| {
        if k == 0 || k == last {
            return rate(k.min(last - 1), n);
        }
        let [before_s, after_s] = [elapsed_s(k - 1), elapsed_s(k)];
        (after_s * rate(k - 1, n) + before_s * rate(k, n)) / (before_s + after_s)
    };
    let (mut all_s, mut all) = (vec![*first_s], vec![*first]);
    for k in 0..last {
        let count = (elapsed_s(k) / STEP_S).ceil().clamp(1.0, MOST_STEPS);
        for t in (1..=count as usize).map(|m| m as f64 / count) {
            all_s.push(times_s[k] + t * elapsed_s(k));
            all.push(std::array::from_fn(|n| {
                let [from, to] = [frames[k][n], frames[k + 1][n]];
                let [leaves, arrives] = [k, k + 1].map(|end| slope(end, n) * elapsed_s(k) - (to - from));
                let [left, leads] = [1.0 - t, t];
                left * from + leads * to + left * leads * (left * leaves - leads * arrives)
            }));
        }
    }
    (all_s, all)
}

/// The contacts of a walk, none of a backward one. `feet` has heel and toes of the right and the left foot at each
/// time, metres; `ahead` is the direction of walking.
pub fn contacts(times_s: &[f64], phases: &[f64], feet: &[Feet], ahead: &[DVec2]) -> Vec<Contact> {
    let count = times_s.len();
    if count < 3 || phases[count - 1] <= phases[0] {
        return Vec::new();
    }
    // How far a point moves along the way from time k to the next.
    let moved = |k: usize, side: usize, point: usize| {
        let [from, to] = [k, k + 1].map(|k| feet[k][side][point].truncate());
        (to - from).dot((ahead[k] + ahead[k + 1]).normalize_or(ahead[k]))
    };
    let elapsed_s = times_s[count - 1] - times_s[0];
    let walking_m: f64 = (0..count - 1).map(|k| 0.5 * (moved(k, 0, 0) + moved(k, 1, 0))).sum();
    let walking_mps = walking_m / elapsed_s;
    let mut contacts = Vec::new();
    for (side, name) in [Side::Right, Side::Left].into_iter().enumerate() {
        let later = 0.5 * side as f64;
        for (kind, point, at, share, later_s) in [
            (EventKind::HeelStrike, 0, 0.0, HEEL_SHARE, CONTACT_LATER_S),
            (EventKind::ToeOff, 1, TOE_OFF_PHASE, TOE_SHARE, 0.0),
        ] {
            // Speeds over the walking speed, each between two times.
            let speed = |k: usize| moved(k, side, point) / (times_s[k + 1] - times_s[k]) / walking_mps;
            let speeds: Vec<f64> = (0..count - 1).map(speed).collect();
            let half =
                |k: usize| [0.5 * (times_s[k] + times_s[k + 1]), 0.5 * (phases[k] + phases[k + 1]) + later];
            let mut found: Vec<(i64, f64, f64)> = Vec::new();
            for (fast, slow) in ends_of_swing(&speeds, share, kind == EventKind::ToeOff) {
                let t = (speeds[fast] - share) / (speeds[fast] - speeds[slow]);
                let ([t0, p0], [t1, p1]) = (half(fast), half(slow));
                let off = p0 + t * (p1 - p0) - at;
                let cycle = off.round();
                if (off - cycle).abs() <= NEAR {
                    found.push((cycle as i64, (off - cycle).abs(), t0 + t * (t1 - t0)));
                }
            }
            // Of several swings in one cycle, the one nearest to the usual phase.
            found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            found.dedup_by_key(|f| f.0);
            let seen =
                found.into_iter().map(|(_, _, time_s)| time_s + later_s).filter(|&t| t <= times_s[count - 1]);
            contacts.extend(seen.map(|time_s| Contact { time_s, kind, side: name }));
        }
    }
    contacts.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    contacts
}

/// Where swing ends, or, backwards in time, where it begins: neighbouring speeds, one at least `share` of the walking speed,
/// the next one less, the first such after the foot was faster than the body. In stance a foot may be a little slower and
/// faster again. What the walk begins with counts as swing.
fn ends_of_swing(speeds: &[f64], share: f64, backwards: bool) -> Vec<(usize, usize)> {
    let (mut is_swing, mut ends) = (true, Vec::new());
    let last = speeds.len() - 1;
    let at = |n: usize| if backwards { last - n } else { n };
    for n in 0..last {
        let (before, after) = (at(n), at(n + 1));
        is_swing |= speeds[before] >= 1.0;
        if is_swing && speeds[before] >= share && speeds[after] < share {
            ends.push((before, after));
            is_swing = false;
        }
    }
    ends
}

/// The mean phase of the initial contacts of both sides, each against its own heel strike, cycles; 0 without one.
pub fn mean_phase(contacts: &[Contact], times_s: &[f64], phases: &[f64]) -> f64 {
    let strikes = contacts.iter().filter(|c| c.kind == EventKind::HeelStrike);
    let off = |c: &Contact| {
        let after = times_s.partition_point(|&t| t < c.time_s).clamp(1, times_s.len() - 1);
        let t = (c.time_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1]);
        let phase = phases[after - 1] + t * (phases[after] - phases[after - 1]);
        let later = if c.side == Side::Left { 0.5 } else { 0.0 };
        phase + later - (phase + later).round()
    };
    let side_mean = |side: Side| {
        let offs: Vec<f64> = strikes.clone().filter(|c| c.side == side).map(off).collect();
        (!offs.is_empty()).then(|| offs.iter().sum::<f64>() / offs.len() as f64)
    };
    let means: Vec<f64> = [Side::Right, Side::Left].into_iter().filter_map(side_mean).collect();
    means.iter().sum::<f64>() / means.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Feet that stand for 0.6 of each cycle of a second and move by the stride of 1.2 m in the rest, at a steady
    /// speed; the toes leave later than the heel by 0.02 s.
    fn feet(time_s: f64) -> Feet {
        let place = |t: f64| {
            let (cycle, at) = (t.floor(), t - t.floor());
            1.2 * (cycle + ((at - 0.6) / 0.4).clamp(0.0, 1.0))
        };
        [0.0, 0.5].map(|later| {
            let [heel, toes] = [0.0, 0.02].map(|late| {
                let t = time_s + later;
                let end = if (t - t.floor()) > 0.8 { 0.0 } else { late };
                place(t - end) - 1.2 * later
            });
            [DVec3::X * heel, DVec3::X * toes]
        })
    }

    #[test]
    fn contacts_are_where_the_feet_begin_and_end_to_stand() {
        let times_s: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k) + 0.003).collect();
        let phases: Vec<f64> = times_s.iter().map(|t| t + 0.03).collect();
        let all: Vec<_> = times_s.iter().map(|&t| feet(t)).collect();
        let ahead = vec![DVec2::X; times_s.len()];
        let found = contacts(&times_s, &phases, &all, &ahead);
        for (kind, side, expected) in [
            (EventKind::HeelStrike, Side::Right, vec![1.0, 2.0]),
            (EventKind::HeelStrike, Side::Left, vec![0.5, 1.5, 2.5]),
            (EventKind::ToeOff, Side::Right, vec![0.62, 1.62, 2.62]),
            (EventKind::ToeOff, Side::Left, vec![0.12, 1.12, 2.12]),
        ] {
            let later_s = if kind == EventKind::HeelStrike { CONTACT_LATER_S } else { 0.0 };
            let times: Vec<f64> =
                found.iter().filter(|c| (c.kind, c.side) == (kind, side)).map(|c| c.time_s).collect();
            assert_eq!(times.len(), expected.len(), "{kind:?} {side:?}: {times:?}");
            times
                .iter()
                .zip(expected)
                .for_each(|(t, e)| assert!((t - e - later_s).abs() < 0.01, "{kind:?} {side:?}: {t} {e}"));
        }
        // The phases are ahead by 0.03; heels stop at 0 and 0.5 of a cycle of a second.
        assert!((mean_phase(&found, &times_s, &phases) - 0.03 - CONTACT_LATER_S).abs() < 0.01);
        assert_eq!(mean_phase(&[], &times_s, &phases), 0.0);
        assert!(contacts(&times_s[..2], &phases[..2], &all[..2], &ahead).is_empty());
        let backwards: Vec<f64> = phases.iter().map(|p| -p).collect();
        assert!(contacts(&times_s, &backwards, &all, &ahead).is_empty());
    }

    /// Feet that go on at a part of the walking speed after they have stood do not stand again.
    #[test]
    fn a_foot_that_creeps_in_stance_has_one_contact_and_one_toe_off() {
        let speeds = [0.0, 0.5, 0.3, 0.7, 3.0, 1.2, 0.45, 0.3, 0.6, 0.2, 0.0, 0.5, 0.1, 0.0, 0.6, 2.0];
        // What a walk begins or ends with counts as swing, as far as it can be seen.
        assert_eq!(ends_of_swing(&speeds, 0.4, false), [(1, 2), (6, 7)]);
        assert_eq!(ends_of_swing(&speeds, 0.4, true), [(14, 13), (3, 2)]);
        assert!(ends_of_swing(&[0.0, 0.1, 0.2], 0.4, false).is_empty());
    }

    /// A parabola is met wherever the frames are, and frames themselves always.
    #[test]
    fn between_frames_is_what_leads_from_one_to_the_next() {
        let times_s = [0.0, 0.04, 0.05, 0.13, 0.17];
        let place = |t: f64| [3.0 - t + 40.0 * t * t, -2.0 * t];
        let (all_s, all) = between(&times_s, &times_s.map(place));
        assert!(
            all_s.windows(2).all(|pair| (1e-6..=STEP_S + 1e-9).contains(&(pair[1] - pair[0]))),
            "{all_s:?}"
        );
        for (t, found) in all_s.iter().zip(&all) {
            // At the ends, the slope is that of the chord.
            let is_inside = (0.04..=0.13).contains(t);
            let expected = place(*t);
            let near = |n: usize| (found[n] - expected[n]).abs() < if is_inside { 1e-12 } else { 0.012 };
            assert!(near(0) && near(1), "{t}: {found:?}, not {expected:?}");
        }
        let at_frames =
            times_s.map(|t| all_s.iter().zip(&all).find(|(at, _)| (*at - t).abs() < 1e-12).unwrap().1);
        assert!(at_frames.iter().zip(times_s.map(place)).all(|(a, b)| (a[0] - b[0]).abs() < 1e-12));
        // A pause of a minute does not cost a minute.
        assert_eq!(between(&[0.0, 60.0], &[[0.0], [1.0]]).0.len(), 51);
        assert_eq!(between(&[2.0], &[[1.0]]), (vec![2.0], vec![[1.0]]));
        assert_eq!(between::<1>(&[], &[]), Default::default());
    }

    /// A foot that slips after it has landed is slow twice; the landing is the contact.
    #[test]
    fn a_slip_is_no_contact() {
        let times_s: Vec<f64> = (0..150).map(|k| 0.02 * f64::from(k) + 0.003).collect();
        let slipping = |t: f64| {
            let mut feet = feet(t);
            let slip_m = 0.03 * ((t.fract() - 0.1) / 0.04).clamp(0.0, 1.0);
            feet[0].iter_mut().for_each(|point| point.x += slip_m);
            feet
        };
        let all: Vec<_> = times_s.iter().map(|&t| slipping(t)).collect();
        let found = contacts(&times_s, &times_s, &all, &vec![DVec2::X; times_s.len()]);
        let strikes = found.iter().filter(|c| (c.kind, c.side) == (EventKind::HeelStrike, Side::Right));
        let times: Vec<f64> = strikes.map(|contact| contact.time_s).collect();
        // Before the first frame nobody knows whether the foot moved.
        let landed = times.iter().filter(|t| **t > 0.5).zip([1.0, 2.0]);
        assert_eq!(landed.clone().count(), 2, "{times:?}");
        landed.for_each(|(t, stops)| assert!((t - stops - CONTACT_LATER_S).abs() < 0.01, "{times:?}"));
    }
}
