//! The fit of a person who walks on the spot, where nothing but the outlines shows the heading.
//!
//! Outlines are almost the same in the heading mirrored at the line of sight with left and right exchanged, as they are
//! on a line across the image with left and right exchanged alone. So the person is fitted in both headings with both
//! choices of sides. The distances of the edges tell them apart, because a foot that is farther away stands higher in the image,
//! and so does what a body needs to come near these edges: in a wrong heading, steps of the same length seem unequal, and hips or
//! feet of another size. So each of the four counts by its total cost, which includes the priors, and as one of two choices of
//! sides by the inner lines, as over ground (`sides`). The fit of the whole walk then keeps the heading of the start, which is
//! nearer than one that is fitted together with body and curves.

use super::problem::{Fitted, Problem};
use super::unknowns::Unknowns;
use super::{FitError, MirroredHeading, WalkFit};
use std::f64::consts::TAU;

/// Headings that are nearer to each other are one, radians.
const SAME_HEADING_RAD: f64 = 0.2;
/// Log odds per unit of the total cost: a fifth of what it states. On 14 treadmills on which this was chosen, 20 to 39 degrees off the
/// side view or in it, the likeliest of the four is right in heading and sides; the next one in another heading costs 30 to 190
/// more, and with the other sides 9 to 300. By the ratio of the distances of the edges alone, the heading of two was wrong and the
/// sides of one.
const LOG_ODDS: f64 = 0.1;

/// One of the four fits.
struct Choice<'p, 'a> {
    problem: &'p Problem<'a>,
    is_mirrored: bool,
    is_exchanged: bool,
    fitted: Fitted,
}

impl Choice<'_, '_> {
    fn heading_rad(&self) -> f64 {
        self.problem.heading_rad(&self.fitted)
    }

    fn is_apart(&self, other: &Self) -> bool {
        turn_rad(self.heading_rad(), other.heading_rad()) > SAME_HEADING_RAD
    }
}

/// The angle between two headings, radians.
fn turn_rad(a: f64, b: f64) -> f64 {
    let turn = a - b;
    (turn - TAU * (turn / TAU).round()).abs()
}

/// Fits the person in the heading of `problem` and of `mirrored`. `p_tracked_swapped` is the probability by the tracker
/// that the sides are exchanged; without it, only the sides are tried whose outlines are those of the tracker.
pub(crate) fn fit_on_the_spot(
    problem: &Problem<'_>,
    mirrored: &Problem<'_>,
    p_tracked_swapped: Option<f64>,
) -> Result<WalkFit, FitError> {
    let choices = choices(problem, mirrored, p_tracked_swapped.is_some())?;
    let weights = weights(&choices, p_tracked_swapped.unwrap_or(0.5));
    let Some(best) = (0..choices.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b])) else {
        return Err(FitError::Undetermined);
    };
    // Fits that ended in the same heading with the same sides are one.
    let is_again = |k: usize| {
        let is_better = |&j: &usize| (weights[j], k) > (weights[k], j);
        let same = |j: usize| {
            choices[j].is_exchanged == choices[k].is_exchanged && !choices[j].is_apart(&choices[k])
        };
        (0..choices.len()).filter(is_better).any(|j| j != k && same(j))
    };
    let different: Vec<usize> = (0..choices.len()).filter(|&k| !is_again(k)).collect();
    let share = |k: usize| (weights[k] - weights[best]).exp();
    let sum: f64 = different.iter().map(|&k| share(k)).sum();
    let probability = |is: &dyn Fn(&Choice<'_, '_>) -> bool| {
        different.iter().filter(|&&k| is(&choices[k])).map(|&k| share(k)).sum::<f64>() / sum
    };
    let here = &choices[best];
    let p_swapped = probability(&|c| c.is_exchanged != here.is_exchanged);
    // Fitted with body and curves, the heading takes a part of the steps' length: of 14 drawn walks 25 to 37 degrees off the
    // side view it is up to 19 degrees off (rms 9), that of the start up to 7 (rms 4).
    let starts = [problem, mirrored].into_iter().filter(|_| p_tracked_swapped.is_some());
    let start_of = |choice: &Choice<'_, '_>| {
        let turn = |start: &Problem<'_>| turn_rad(choice.heading_rad(), start.route_heading_rad());
        starts.clone().min_by(|a, b| turn(a).total_cmp(&turn(b)))
    };
    let heading_rad = |choice: &Choice<'_, '_>| {
        start_of(choice).map_or_else(|| choice.heading_rad(), Problem::route_heading_rad)
    };
    let is_other =
        |choice: &Choice<'_, '_>| turn_rad(heading_rad(choice), heading_rad(here)) > SAME_HEADING_RAD;
    let other = different.iter().filter(|&&k| is_other(&choices[k]));
    let other = other.max_by(|&&a, &&b| weights[a].total_cmp(&weights[b]));
    let mirrored = other.map(|&k| MirroredHeading {
        heading_rad: heading_rad(&choices[k]),
        probability: probability(&is_other),
    });
    let fit = match start_of(here).and_then(|start| start.with_heading_held(&here.fitted)) {
        Some((held, fitted)) => held.checked(&fitted, p_swapped),
        None => here.problem.checked(&here.fitted, p_swapped),
    }?;
    Ok(WalkFit { mirrored, ..fit })
}

/// The fits, those in the tracker's heading first; all four, or the two whose outlines are alike.
fn choices<'p, 'a>(
    problem: &'p Problem<'a>,
    mirrored: &'p Problem<'a>,
    are_all: bool,
) -> Result<Vec<Choice<'p, 'a>>, FitError> {
    let (start, gait) = problem.best_start(0.0)?;
    let there = mirrored.started(0.5, gait.mirrored()).map(|(_, start)| start);
    let exchanged = |start: &Unknowns| are_all.then(|| start.exchanged());
    let starts = [
        (false, exchanged(&start), true),
        (true, there.as_ref().and_then(exchanged), false),
        (true, there, true),
    ];
    let fitted = problem.finished(start).ok_or(FitError::Undetermined)?;
    let mut choices = vec![Choice { problem, is_mirrored: false, is_exchanged: false, fitted }];
    for (is_mirrored, start, is_exchanged) in starts {
        let problem = if is_mirrored { mirrored } else { problem };
        let fitted = start.and_then(|start| problem.finished(start));
        choices.extend(fitted.map(|fitted| Choice { problem, is_mirrored, is_exchanged, fitted }));
    }
    Ok(choices)
}

/// Logarithms of the weights: of all by the total costs, of the sides in a heading by their evidence.
fn weights(choices: &[Choice<'_, '_>], p_tracked: f64) -> Vec<f64> {
    let all: Vec<Alternative> = choices
        .iter()
        .map(|c| Alternative {
            is_mirrored: c.is_mirrored,
            is_exchanged: c.is_exchanged,
            total_cost: c.problem.total_cost_of(&c.fitted),
        })
        .collect();
    log_weights(&all, p_tracked, |choice, other, p| {
        choices[choice].problem.p_other_sides(&choices[choice].fitted, &choices[other].fitted, p)
    })
}

/// What a fit in a heading with a choice of sides costs.
struct Alternative {
    is_mirrored: bool,
    is_exchanged: bool,
    total_cost: f64,
}

/// The same; `p_other_sides` of one fit against another of the same heading, with the tracker's probability of the other.
fn log_weights(
    all: &[Alternative],
    p_tracked: f64,
    p_other_sides: impl Fn(usize, usize, f64) -> f64,
) -> Vec<f64> {
    let of = |choice: usize| {
        let same_heading = || (0..all.len()).filter(|&k| all[k].is_mirrored == all[choice].is_mirrored);
        let partner = same_heading().find(|&k| all[k].is_exchanged != all[choice].is_exchanged);
        let p_partner = if all[choice].is_exchanged { 1.0 - p_tracked } else { p_tracked };
        let p_other = partner.map_or(0.0, |other| p_other_sides(choice, other, p_partner));
        -LOG_ODDS * all[choice].total_cost + (1.0 - p_other).max(1e-12).ln()
    };
    (0..all.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Costs count in every choice, and the evidence of the sides between the two in a heading.
    #[test]
    fn total_costs_decide_and_evidence_between_the_sides_in_a_heading() {
        let all = [(100.0, false, false), (107.0, false, true), (120.0, true, false), (125.0, true, true)]
            .map(|(total_cost, is_mirrored, is_exchanged)| Alternative {
                is_mirrored,
                is_exchanged,
                total_cost,
            });
        let weights = log_weights(&all, 0.3, |choice, _, p_other| {
            // The tracker's probability of the other sides comes in as it is.
            let expected = if all[choice].is_exchanged { 0.7 } else { 0.3 };
            assert!((p_other - expected).abs() < 1e-12);
            p_other
        });
        let of_sides = (0.7f64 / 0.3).ln();
        for (a, b, expected) in [(0, 1, 0.7 + of_sides), (2, 3, 0.5 + of_sides), (0, 2, 2.0), (1, 3, 1.8)] {
            assert!((weights[a] - weights[b] - expected).abs() < 1e-9, "{weights:?}");
        }
    }
}
