//! Which side is which: the fit with the sides as tracked against the fit with the sides exchanged.
//!
//! With wrong sides the outline can be the same, but then the far limbs are drawn in front of the near ones: their
//! lines inside the body, where the frames have edges, are hidden. So the right sides explain more of these lines.

use super::super::decisions::{SIDES_LOG_ODDS, SIDES_LOST, SIDES_OF_TRACKER, SIDES_OFF};
use super::seen::Seen;

/// Evidence for one choice of sides against another: logarithms of the ratios of explained inner lines and of costs,
/// and the difference of the shares of lost inner lines.
pub fn evidence(chosen: &Seen, other: &Seen) -> f64 {
    let explained = |seen: &Seen| (seen.inner - seen.inner_missed).max(1.0);
    let lost = |seen: &Seen| seen.inner_missed / seen.inner.max(1.0);
    let cost = |seen: &Seen| seen.cost.max(1e-9);
    (explained(chosen) / explained(other)).ln()
        + (cost(other) / cost(chosen)).ln()
        + SIDES_LOST * (lost(other) - lost(chosen))
}

/// Probability of the `other` choice of sides; `p_tracked` is that by the tracker. Both go by ratios of what is seen: of a
/// person of whom others hid a part, the same ratios show less, in proportion to the `visible` share. Those of the fits
/// do so, too, where neither fit finds the outline.
pub fn p_other(chosen: &Seen, other: &Seen, p_tracked: f64, visible: f64) -> f64 {
    let p = p_tracked.clamp(1e-6, 1.0 - 1e-6);
    let clear = SIDES_OFF / (SIDES_OFF + chosen.off().min(other.off()));
    let by_fit = SIDES_LOG_ODDS * clear * evidence(chosen, other);
    let by_tracker = SIDES_OF_TRACKER * ((1.0 - p) / p).ln();
    let log_odds = visible * (by_fit + by_tracker);
    1.0 / (1.0 + log_odds.exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(cost: f64, inner_missed: f64) -> Seen {
        Seen { inner: 100.0, inner_missed, cost, outer: 500.0, ..Seen::default() }
    }

    #[test]
    fn what_lies_nearer_and_loses_fewer_inner_lines_is_likelier() {
        assert!((p_other(&seen(10.0, 5.0), &seen(10.0, 5.0), 0.5, 1.0) - 0.5).abs() < 1e-12);
        let by_cost = p_other(&seen(10.0, 5.0), &seen(15.0, 5.0), 0.5, 1.0);
        let by_lines = p_other(&seen(10.0, 5.0), &seen(10.0, 15.0), 0.5, 1.0);
        let fewer = Seen { inner: 50.0, ..seen(10.0, 2.5) };
        let by_count = p_other(&seen(10.0, 5.0), &fewer, 0.5, 1.0);
        assert!([by_cost, by_lines, by_count].iter().all(|&p| p < 0.05), "{by_cost} {by_lines} {by_count}");
        for (a, b) in [(seen(10.0, 5.0), seen(12.0, 1.0)), (seen(8.0, 0.0), seen(7.0, 9.0))] {
            assert!((p_other(&a, &b, 0.5, 1.0) + p_other(&b, &a, 0.5, 1.0) - 1.0).abs() < 1e-12);
        }
        let [whole, half] =
            [1.0, 0.5].map(|visible| p_other(&seen(10.0, 5.0), &seen(15.0, 5.0), 0.2, visible));
        let log_odds = |p: f64| ((1.0 - p) / p).ln();
        assert!(
            (log_odds(half) - 0.5 * log_odds(whole)).abs() < 1e-9,
            "half of the person shows half as much"
        );
        // Where both fits miss as much more than usual as counts half, they show half as much.
        let unclear = |seen: Seen| Seen { outer_missed: 500.0 * (Seen::USUALLY_MISSED + SIDES_OFF), ..seen };
        let clear = log_odds(p_other(&seen(10.0, 5.0), &seen(15.0, 5.0), 0.5, 1.0));
        let off = log_odds(p_other(&unclear(seen(10.0, 5.0)), &unclear(seen(15.0, 5.0)), 0.5, 1.0));
        let one_off = log_odds(p_other(&seen(10.0, 5.0), &unclear(seen(15.0, 5.0)), 0.5, 1.0));
        assert!((off - 0.5 * clear).abs() < 1e-9 && (one_off - clear).abs() < 1e-9);
        // Where both fits are alike, the tracker's odds of nine to one count half: three to one.
        assert!((p_other(&seen(10.0, 5.0), &seen(10.0, 5.0), 0.1, 1.0) - 0.25).abs() < 1e-12);
        assert!(p_other(&Seen::default(), &Seen::default(), 0.5, 1.0).is_finite());
    }
}
