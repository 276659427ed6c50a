//! Whether steps and their rate go together: the walk ratio.
//!
//! The walk ratio is step length over cadence. A person keeps it over a wide range of speeds (Sekiya and Nagasaki,
//! Gait Posture 7:225, 1998), down to about 1 m/s; slower, it increases (J Phys Ther Sci 29:722, 2017). 8,429 Japanese
//! adults took steps of 0.656 ± 0.054 m at 118.9 ± 6.8 per minute in daily life, a ratio of 0.0055 (Geriatr Gerontol
//! Int 20:664, 2020). In walks of similar dynamics, step length grows as the height and cadence falls as its root, so
//! the ratio is compared at one height.
//!
//! A wrong frame rate multiplies the cadence and leaves the step length as it is, so it divides the ratio.

use super::gait_parameters::GaitQuantity;
use super::height::POPULATION_HEIGHT_M;
use super::result::TrackedWalk;
use super::walk::Walk;

/// Limits of the walk ratio of a person 1.70 m tall, m per step per minute. 28 drawn walks of six people at 0.9 to
/// 1.5 m/s, among them crouched, limping and brisk ones, and a filmed one have 0.0048 to 0.0074.
const USUAL: [f64; 2] = [0.0040, 0.0095];

/// The most usual walk ratio of that person, and the standard deviation of its logarithm over walks. Chosen: those 28 walks are within
/// 1.5 standard deviations.
const MEAN: f64 = 0.0060;
const LOG_SD: f64 = 0.15;
/// Farther than this many standard deviations, ratios are alike: people also walk slowly, and frame rates are wrong.
const FARTHEST_SD: f64 = 3.0;

/// Step length over cadence, with the limits for a person of this height, m per step per minute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkRatio {
    /// Step length over cadence.
    pub value: f64,
    /// Smallest and largest usual value.
    pub usual: [f64; 2],
}

impl WalkRatio {
    /// True if people walk so.
    #[must_use]
    pub fn is_usual(&self) -> bool {
        (self.usual[0]..=self.usual[1]).contains(&self.value)
    }

    /// How unusual it is: minus twice the logarithm of its probability over walks, 0 of the most usual one.
    pub(super) fn cost(&self) -> f64 {
        let off_sd = (self.value / self.usual[0] * USUAL[0] / MEAN).ln() / LOG_SD;
        off_sd.abs().min(FARTHEST_SD).powi(2)
    }

    /// The ratio of a step length, metres, and a cadence, steps per minute, in a person of this height, metres.
    #[must_use]
    pub fn new(step_m: f64, steps_per_min: f64, height_m: f64) -> Self {
        let scale = (height_m / POPULATION_HEIGHT_M).powf(1.5);
        Self { value: step_m / steps_per_min, usual: USUAL.map(|limit| limit * scale) }
    }
}

impl Walk {
    /// The walk ratio of what was followed so far, of a person of this height, metres; `None` of a single frame.
    pub(super) fn ratio(&self, height_m: f64) -> Option<WalkRatio> {
        let steps = self.steps();
        let (first, last) = (steps.first()?, steps.last()?);
        let elapsed_s = last.time_s - first.time_s;
        let covered_m = (last.state.along.position - first.state.along.position).abs();
        let cycles = (last.state.phase.position - first.state.phase.position).abs();
        (elapsed_s > 0.0)
            .then(|| WalkRatio::new(0.5 * covered_m / cycles, 120.0 * cycles / elapsed_s, height_m))
    }

    /// True if the other walk, of the same frames, has a walk ratio that people have, and this one has not: then its phase
    /// went wrong. At a wrong frame rate or on a treadmill, neither has. The limits are those of walking forwards.
    pub(super) fn is_less_usual_than(&self, other: &Self, height_m: f64) -> bool {
        let is_usual = |walk: &Self| walk.ratio(height_m).is_none_or(|ratio| ratio.is_usual());
        is_usual(other) && !is_usual(self)
    }
}

impl TrackedWalk {
    /// The walk ratio; `None` for backward walking, which has another, and for a walk without gait parameters.
    pub fn walk_ratio(&self) -> Option<WalkRatio> {
        if self.direction() == super::start::Direction::Backward {
            return None;
        }
        let table = self.gait_parameters();
        let of = |quantity| table.iter().find(|p| p.quantity == quantity && p.side.is_none())?.value;
        let (step_m, cadence) = (of(GaitQuantity::StepLength)?, of(GaitQuantity::Cadence)?);
        Some(WalkRatio::new(step_m, cadence, self.height.height_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_frame_rate_leaves_the_usual_ratios() {
        // Adults at their own speed (Geriatr Gerontol Int 20:664), and Murray's men: 0.78 m at 112 per minute.
        for (step_m, cadence, height_m) in [(0.656, 118.9, 1.65), (0.78, 112.0, 1.76)] {
            assert!(WalkRatio::new(step_m, cadence, height_m).is_usual());
            for factor in [0.5, 2.0] {
                assert!(!WalkRatio::new(step_m, factor * cadence, height_m).is_usual(), "{step_m} {factor}");
            }
        }
    }

    #[test]
    fn usual_ratios_cost_least_and_impossible_ones_no_more_than_unusual_ones() {
        let cost = |steps_per_min: f64| WalkRatio::new(0.66, steps_per_min, 1.7).cost();
        assert!(cost(110.0) < 1e-6 && cost(100.0) < cost(90.0) && cost(120.0) < cost(135.0));
        assert_eq!([40.0, 20.0, 300.0].map(cost), [9.0; 3]);
    }

    #[test]
    fn similar_walks_of_people_of_different_height_are_as_usual() {
        let tall = WalkRatio::new(0.7, 115.0, 1.7);
        let small = WalkRatio::new(0.35, 115.0 * 2f64.sqrt(), 0.85);
        assert!((tall.value / tall.usual[0] - small.value / small.usual[0]).abs() < 1e-12);
    }
}
