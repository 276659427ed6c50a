//! The speed of a treadmill's belt from the motion of the fitted feet.
//!
//! A foot that lies flat moves with the belt. While the heel lands and while it rises, it is slower, so the speed of a
//! stance is the largest mean speed of the heel over `WINDOW` of the cycle. The same over ground, where the floor
//! stands still, is the error: see `BELT_COMMON_SHARE`. The picture shows its part across the line of sight, v cos h, so
//! an error dh of the heading h changes the speed by tan h dh.

use super::super::decisions::{BELT_COMMON_SHARE, BELT_HEADING_SD_RAD, BELT_STANCE_SHARE};
use super::contacts::Feet;
use crate::estimate::line::line_through;
use glam::DVec2;

/// Speed of the belt, backwards under a walker who walks forwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belt {
    /// Metres per second.
    pub speed_mps: f64,
    /// Its standard deviation without that of the distance from the camera, m/s.
    pub sd_mps: f64,
}

/// Part of the cycle over which the speed of a foot is measured, and how much later each part begins.
const WINDOW: f64 = 0.3;
const SHIFT: f64 = 0.025;
/// The parts begin after the foot's own initial contact and end before this phase: then the other foot has landed.
const END: f64 = 0.55;
/// Nobody who walks nearly along the line of sight is known to do so: the largest tan h.
const STEEPEST: f64 = 4.0;
/// Minimum number of frames in a part.
const LEAST_FRAMES: usize = 3;

/// The belt's speed; `None` if no stance was seen from its beginning to its end. `feet` has heel and toes of the right
/// and the left foot in each frame, metres; `sight` leads from the camera to the person.
pub fn belt(times_s: &[f64], phases: &[f64], feet: &[Feet], ahead: DVec2, sight: DVec2) -> Option<Belt> {
    let mut speeds = Vec::new();
    for side in 0..2 {
        let heel = |feet: &Feet| feet[side][0].truncate().dot(ahead);
        let places: Vec<[f64; 3]> =
            (0..times_s.len()).map(|k| [phases[k] + 0.5 * side as f64, times_s[k], heel(&feet[k])]).collect();
        let (first, last) = (places.first()?[0].ceil() as i64, places.last()?[0].floor() as i64);
        speeds.extend((first - 1..=last).filter_map(|cycle| stance_speed(&places, cycle as f64)));
    }
    let n = speeds.len() as f64;
    let speed_mps = speeds.iter().sum::<f64>() / n;
    let scatter = speeds.iter().map(|speed| (speed - speed_mps).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let of_stance = (BELT_STANCE_SHARE * speed_mps).hypot(scatter.sqrt()) / n.sqrt();
    let tan = (ahead.dot(sight) / ahead.perp_dot(sight)).abs().min(STEEPEST);
    let of_person = BELT_COMMON_SHARE.hypot(BELT_HEADING_SD_RAD * tan) * speed_mps;
    (n > 0.0).then(|| Belt { speed_mps, sd_mps: of_stance.hypot(of_person) })
}

/// The feet where they would be if the belt stood still and the walker moved on with this velocity.
pub fn move_with(feet: &mut [Feet], times_s: &[f64], velocity: DVec2) {
    for (feet, time_s) in feet.iter_mut().zip(times_s) {
        let way = (velocity * *time_s).extend(0.0);
        feet.iter_mut().flatten().for_each(|point| *point += way);
    }
}

/// The largest mean speed backwards over a part of the stance that begins at this phase; phase, time and place of
/// the sole in each frame. `None` if the frames do not show the whole stance.
fn stance_speed(places: &[[f64; 3]], strike: f64) -> Option<f64> {
    if places.first()?[0] > strike || places.last()?[0] < strike + END {
        return None;
    }
    let speed = |begin: f64| {
        let part = begin..=begin + WINDOW;
        let points: Vec<(f64, f64)> =
            places.iter().filter(|p| part.contains(&p[0])).map(|p| (p[1], p[2])).collect();
        (points.len() >= LEAST_FRAMES).then(|| -line_through(&points).0)
    };
    let count = ((END - WINDOW) / SHIFT).round() as usize;
    (0..=count).filter_map(|k| speed(strike + SHIFT * k as f64)).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::f64::consts::FRAC_PI_2;

    /// Feet that are carried back by `belt` m/s while flat, from 0.1 to 0.4 of the cycle of a second, at 0.8 of that in
    /// the rest of a stance until 0.6, and then come back.
    fn feet(time_s: f64, belt: f64) -> Feet {
        let place = |t: f64| {
            let at = t.rem_euclid(1.0);
            let flat = at.clamp(0.1, 0.4) - 0.1;
            let rest = at.min(0.6) - flat;
            let back = belt * (flat + 0.8 * rest);
            let stance = belt * (0.3 + 0.8 * 0.3);
            0.1 - back + ((at - 0.6) / 0.4).clamp(0.0, 1.0) * stance
        };
        [0.0, 0.5].map(|later| {
            let heel = DVec3::new(place(time_s + later), 0.2, 0.0);
            [heel, heel + 0.2 * DVec3::X]
        })
    }

    /// A belt that changes its speed makes stances that differ, and the mean less sure.
    #[test]
    fn stances_that_differ_make_the_speed_less_sure() {
        let times_s: Vec<f64> = (0..300).map(|k| 0.04 * f64::from(k)).collect();
        let speed_at = |cycle: f64| if (cycle as usize).is_multiple_of(2) { 0.8 } else { 1.2 };
        let all: Vec<_> = times_s
            .iter()
            .map(|&t| [feet(t, speed_at(t.floor()))[0], feet(t, speed_at((t + 0.5).floor()))[1]])
            .collect();
        let even: Vec<_> = times_s.iter().map(|&t| feet(t, 1.0)).collect();
        let [uneven, even] =
            [all, even].map(|feet| belt(&times_s, &times_s, &feet, DVec2::X, DVec2::Y).unwrap());
        // About 22 stances of 0.8 or 1.2 m/s.
        let more = (uneven.sd_mps.powi(2) - even.sd_mps.powi(2)).sqrt();
        assert!((0.03..0.06).contains(&more), "{uneven:?} {even:?}");
    }

    /// Seen from the belt, a foot that lies on it stays, and the walker moves on.
    #[test]
    fn feet_on_a_belt_stand_still_beside_it() {
        let times_s: Vec<f64> = (0..8).map(|k| 0.13 + 0.03 * f64::from(k)).collect();
        let mut all: Vec<_> = times_s.iter().map(|&t| feet(t, 1.3)).collect();
        move_with(&mut all, &times_s, 1.3 * DVec2::X);
        let heels: Vec<f64> = all.iter().map(|feet| feet[0][0].x).collect();
        assert!(heels.iter().all(|heel| (heel - heels[0]).abs() < 1e-9), "{heels:?}");
    }

    #[test]
    fn a_flat_foot_shows_the_belt() {
        let times_s: Vec<f64> = (0..100).map(|k| 0.04 * f64::from(k)).collect();
        for speed in [0.4, 1.3] {
            let all: Vec<_> = times_s.iter().map(|&t| feet(t, speed)).collect();
            // Phases that are early or late by some hundredths change nothing.
            for off in [-0.03, 0.0, 0.03] {
                let phases: Vec<f64> = times_s.iter().map(|t| t + off).collect();
                let belt = belt(&times_s, &phases, &all, DVec2::X, DVec2::Y).unwrap();
                assert!((belt.speed_mps / speed - 1.0).abs() < 0.01, "{belt:?} of {speed}");
                assert!((0.03..0.05).contains(&(belt.sd_mps / speed)), "{belt:?}");
            }
        }
    }

    /// The speed of a picture that shows v cos h, with h as wrong as its standard deviation says.
    #[test]
    fn a_wrong_heading_changes_the_speed_by_what_the_standard_deviation_says() {
        let times_s: Vec<f64> = (0..100).map(|k| 0.04 * f64::from(k)).collect();
        let all: Vec<_> = times_s.iter().map(|&t| feet(t, 1.0)).collect();
        let sd = |heading_rad: f64| {
            let sight = DVec2::from_angle(FRAC_PI_2 - heading_rad);
            belt(&times_s, &times_s, &all, DVec2::X, sight).unwrap().sd_mps
        };
        let across = sd(0.0);
        for heading_rad in [0.3_f64, -0.6, 1.0] {
            let shown = heading_rad.cos();
            let wrong = [-0.01, 0.01].map(|off| shown / (heading_rad + off * BELT_HEADING_SD_RAD).cos());
            let of_heading = 50.0 * (wrong[1] - wrong[0]).abs();
            let expected = across.hypot(of_heading);
            assert!((sd(heading_rad) / expected - 1.0).abs() < 1e-3, "{heading_rad}: {}", sd(heading_rad));
        }
        assert!(sd(1.5).is_finite() && sd(FRAC_PI_2) < 1.0);
    }

    #[test]
    fn half_a_stance_shows_no_belt() {
        let times_s: Vec<f64> = (0..12).map(|k| 0.04 * f64::from(k)).collect();
        let all: Vec<_> = times_s.iter().map(|&t| feet(t, 1.0)).collect();
        assert_eq!(belt(&times_s, &times_s, &all, DVec2::X, DVec2::Y), None);
        assert_eq!(belt(&[], &[], &[], DVec2::X, DVec2::Y), None);
    }
}
