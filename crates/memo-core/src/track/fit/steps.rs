//! Whether the tracker's phase counts the steps of the person, and the line of phase that does.
//!
//! Of people whose legs hardly differ from what is behind them, the tracker's phase may stand still for a step, and a fit that
//! starts there has the legs the wrong way round from then on. People walk evenly and with steps that go with their
//! cadence ([`plausible`](super::super::plausible)), so what is known of such a walk, its speed, leaves few lines of phase.
//! The contours decide between them and the tracker's phase.

use super::of_walk::Tracked;
use super::problem::StartGait;
use super::{FitFrame, FitOptions, LEAST_FRAMES};
use crate::estimate::line::line_through;
use crate::track::plausible::WalkRatio;
use crate::track::route::Route;

/// Phases whose standard deviation about a line is larger do not count steps, cycles, and those of an unusual walk ratio if it is
/// larger than the second. Chosen on 61 drawn walks. Where steps are counted, it is 0.050 at most, and 0.006 where the ratio of a
/// short walk was unusual. Where a step was left out, it is 0.10 to 0.13 over three seconds, and 0.04 to 0.06 with an unusual ratio
/// over one and a half.
const UNEVEN: f64 = 0.08;
const UNEVEN_OF_UNUSUAL: f64 = 0.025;
/// A line is taken if a few of the frames and its walk ratio cost less than this factor of what they cost with the tracker's phases.
/// Where steps were left out, that is 0.70 to 0.85; of one walk whose steps are counted 0.85 too, so phases are doubted first.
const LIKELIER: f64 = 0.9;
/// Neighbouring lines are apart by so many cycles, at the middle of the walk and from its first frame to its last. The half of a cycle
/// remains open: it is what exchanges the sides.
const APART_IN_MIDDLE: f64 = 0.125;
const APART_OVER_WALK: f64 = 0.25;
/// The phase of a longer walk is no line, seconds.
const LONGEST_S: f64 = 6.0;

impl Tracked<'_> {
    /// Puts the phases of the frames on the likeliest line if the tracker's phases are odd and those of the line clearly
    /// likelier. Returns whether it did.
    pub(super) fn count_steps_again(
        &self,
        route: &Route,
        frames: &mut [FitFrame],
        options: &FitOptions,
    ) -> bool {
        // 1. Whose phase is odd, of those who walk forwards.
        let phases: Vec<(f64, f64)> = frames.iter().map(|f| (f.time_s, f.start.phase)).collect();
        let Some(((first_s, _), (last_s, _))) = phases.first().zip(phases.last()) else { return false };
        let lasts_s = last_s - first_s;
        let (rate_hz, _) = line_through(&phases);
        let Some(ratio) = self.walk.ratio(self.height.height_m) else { return false };
        let is_odd = unevenness(&phases) > if ratio.is_usual() { UNEVEN } else { UNEVEN_OF_UNUSUAL };
        if !is_odd || rate_hz <= 0.0 || frames.len() < LEAST_FRAMES || lasts_s > LONGEST_S {
            return false;
        }
        // 2. The lines at cadences that go with the speed.
        let places: Vec<(f64, f64)> = frames.iter().map(|f| (f.time_s, f.start.along_m)).collect();
        let (speed_mps, _) = line_through(&places);
        let rates_hz = rates_hz(&ratio, speed_mps.abs(), lasts_s);
        let height_m = self.height.height_m;
        let of_rate =
            |rate_hz: f64| WalkRatio::new(0.5 * speed_mps.abs() / rate_hz, 120.0 * rate_hz, height_m).cost();
        let offsets = (0..(0.5 / APART_IN_MIDDLE) as usize).map(|k| k as f64 * APART_IN_MIDDLE);
        let middle_s = 0.5 * (first_s + last_s);
        let put = |frames: &mut [FitFrame], [rate_hz, offset]: [f64; 2]| {
            frames.iter_mut().for_each(|f| f.start.phase = offset + rate_hz * (f.time_s - middle_s));
        };
        // 3. What a few of the frames say, and how usual the steps would be.
        let tracked = self.problem(route, frames, options).glance(0.0);
        let mut best: Option<(f64, [f64; 2])> = None;
        for line in offsets.flat_map(|offset| rates_hz.iter().map(move |&rate_hz| [rate_hz, offset])) {
            put(frames, line);
            let few_cost = self.problem(route, frames, options).few_cost(StartGait::Average);
            let cost = few_cost.map(|cost| cost + of_rate(line[0]));
            if let Some(cost) = cost.filter(|cost| best.is_none_or(|(least, _)| *cost < least)) {
                best = Some((cost, line));
            }
        }
        let is_likelier =
            |cost: f64| tracked.is_ok_and(|tracked| cost < LIKELIER * (tracked.total_cost + ratio.cost()));
        match best.filter(|(cost, _)| is_likelier(*cost)) {
            Some((_, line)) => {
                put(frames, line);
                true
            }
            None => {
                frames.iter_mut().zip(&phases).for_each(|(f, (_, phase))| f.start.phase = *phase);
                false
            }
        }
    }
}

/// Standard deviation of phases about the line through them, cycles.
fn unevenness(phases: &[(f64, f64)]) -> f64 {
    let (rate_hz, at_0) = line_through(phases);
    let squares = phases.iter().map(|(time_s, phase)| (phase - at_0 - rate_hz * time_s).powi(2));
    (squares.sum::<f64>() / phases.len() as f64).sqrt()
}

/// Cadences of usual walk ratios at a speed, in gait cycles per second, so dense that neighbours hardly part over the walk. With step
/// length s and cadence c the ratio is s / c, and the speed s c.
fn rates_hz(ratio: &WalkRatio, speed_mps: f64, lasts_s: f64) -> Vec<f64> {
    let [most_hz, least_hz] = ratio.usual.map(|usual| 0.5 * (speed_mps / (60.0 * usual)).sqrt());
    let count = ((most_hz - least_hz) * lasts_s / APART_OVER_WALK).ceil().max(1.0) as usize;
    (0..=count).map(|n| least_hz + (most_hz - least_hz) * n as f64 / count as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_on_a_line_are_even_and_a_step_left_out_is_not() {
        let line = |k: usize| (0.04 * k as f64, 0.2 + 0.9 * 0.04 * k as f64);
        let even: Vec<(f64, f64)> = (0..80).map(line).collect();
        assert!(unevenness(&even) < 1e-12);
        let left_out = |(k, (time_s, phase)): (usize, &(f64, f64))| {
            (*time_s, phase - if k < 40 { 0.0 } else { (0.9 * 0.04 * (k - 40) as f64).min(0.5) })
        };
        let stands: Vec<(f64, f64)> = even.iter().enumerate().map(left_out).collect();
        assert!(unevenness(&stands) > UNEVEN);
    }

    #[test]
    fn cadences_are_those_of_usual_steps_at_the_speed() {
        let ratio = WalkRatio::new(0.7, 110.0, 1.7);
        let rates = rates_hz(&ratio, 1.3, 3.0);
        for (rate_hz, usual) in [(rates[0], ratio.usual[1]), (rates[rates.len() - 1], ratio.usual[0])] {
            let steps_per_min = 120.0 * rate_hz;
            assert!((1.3 * 60.0 / steps_per_min / steps_per_min - usual).abs() < 1e-12);
        }
        // The true one, of 111 steps per minute, is nowhere far from one of them at the ends of the walk.
        assert!(rates.iter().any(|rate_hz| (rate_hz - 0.925).abs() * 1.5 <= 0.5 * APART_OVER_WALK));
        assert!(rates.windows(2).all(|pair| (pair[1] - pair[0]) * 3.0 <= APART_OVER_WALK + 1e-12));
    }
}
