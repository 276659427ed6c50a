//! Probability that right and left are swapped, from the similarities of the two half-cycle twins.

use crate::OptionError;

/// Model of the margin between the twins, from a handful of real and motion-captured walks. A probability far
/// from 1/2 means that the sides are known; its value is not a counted error rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwapModel {
    /// Mean mu of the margin (S_right - S_wrong) / S_right of the summed similarity. Measured medians: 0.13 to
    /// 0.17.
    pub margin: f64,
    /// Standard deviation of the margin over independent glimpses of one walk: wrong windows of 0.4 s had margins
    /// up to 0.07.
    pub glimpse_sd: f64,
    /// Standard deviation over people, which does not decrease with time: arms or legs that differ from the
    /// average.
    pub person_sd: f64,
    /// Duration of a glimpse, seconds: frames closer than this are not independent.
    pub glimpse_s: f64,
}

impl Default for SwapModel {
    fn default() -> Self {
        Self { margin: 0.13, glimpse_sd: 0.16, person_sd: 0.05, glimpse_s: 0.2 }
    }
}

impl SwapModel {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        OptionError::unless_at_least_0("margin", self.margin)?;
        OptionError::unless_positive("glimpse_sd", self.glimpse_sd)?;
        OptionError::unless_at_least_0("person_sd", self.person_sd)?;
        OptionError::unless_positive("glimpse_s", self.glimpse_s)
    }
}

/// Probability that the twin with the summed similarity `other` is the true one, and not the twin with `chosen`.
///
/// The margin m = (chosen - other) / max is normal about ±mu with variance v = person² + glimpse² / n, where n is
/// the number of independent glimpses in `duration_s`, in which the person was wholly visible; then log odds = 2 mu m / v.
pub fn swap_probability(chosen: f64, other: f64, duration_s: f64, model: &SwapModel) -> f64 {
    1.0 / (1.0 + log_odds(chosen, other, duration_s, model).exp())
}

/// The log odds of the hypothesis with the summed similarity `chosen` against the one with `other`.
pub(super) fn log_odds(chosen: f64, other: f64, duration_s: f64, model: &SwapModel) -> f64 {
    let top = chosen.max(other);
    if top <= 0.0 {
        return 0.0;
    }
    let glimpses = (duration_s / model.glimpse_s).max(1.0);
    let variance = model.person_sd.powi(2) + model.glimpse_sd.powi(2) / glimpses;
    2.0 * model.margin * (chosen - other) / top / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The log odds by Bayes' rule from the two normal densities of the margin.
    #[test]
    fn the_swap_probability_is_bayes_rule_on_the_margin() {
        let model = SwapModel { margin: 0.11, glimpse_sd: 0.2, person_sd: 0.06, glimpse_s: 0.25 };
        for (chosen, other, duration_s, glimpses) in
            [(8.0, 7.0, 1.5, 6.0f64), (3.0, 3.6, 0.1, 1.0), (20.0, 19.0, 40.0, 160.0), (5.0, 4.0, 0.0, 1.0)]
        {
            let margin = (chosen - other) / f64::max(chosen, other);
            let variance = 0.06f64.powi(2) + 0.2f64.powi(2) / glimpses;
            let density = |mean: f64| (-0.5 * (margin - mean).powi(2) / variance).exp();
            let expected = density(-0.11) / (density(0.11) + density(-0.11));
            let found = swap_probability(chosen, other, duration_s, &model);
            assert!((found - expected).abs() < 1e-12, "{found} against {expected}");
        }
    }

    #[test]
    fn the_swap_probability_is_symmetric_and_needs_time_and_margin() {
        let m = SwapModel::default();
        assert!((swap_probability(0.2, 0.2, 1.0, &m) - 0.5).abs() < 1e-12);
        let p = swap_probability(0.20, 0.17, 0.5, &m);
        assert!((p + swap_probability(0.17, 0.20, 0.5, &m) - 1.0).abs() < 1e-12);
        assert!(swap_probability(0.20, 0.17, 2.0, &m) < p && p < 0.2);
        assert!(swap_probability(0.20, 0.196, 100.0, &m) > 0.1, "a small margin never becomes certainty");
        assert_eq!(swap_probability(0.0, 0.0, 1.0, &m), 0.5);
    }
}
