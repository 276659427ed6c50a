//! The fit of a person who walks on the spot, where nothing but the outlines shows the heading.
//!
//! Outlines are almost the same in the heading mirrored at the line of sight with left and right exchanged, as they are
//! on a line across the image with left and right exchanged alone. So the person is fitted in both headings with both
//! choices of sides. The distances of the edges decide between the headings: a foot that is farther away stands higher
//! in the image. The inner lines decide between the sides in each heading, as over ground (`sides`).

use super::problem::{Fitted, Problem};
use super::seen::Seen;
use super::{FitError, LEAST_FRAMES, MirroredHeading, WalkFit};
use std::f64::consts::TAU;

/// Headings that are nearer to each other are one, radians.
const SAME_HEADING_RAD: f64 = 0.2;
/// Log odds of a heading per unit of the logarithm of the ratio of costs.
const LOG_ODDS: f64 = 8.0;

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
        let turn = self.heading_rad() - other.heading_rad();
        (turn - TAU * (turn / TAU).round()).abs() > SAME_HEADING_RAD
    }
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
    let other = different.iter().filter(|&&k| choices[k].is_apart(here));
    let other = other.max_by(|&&a, &&b| weights[a].total_cmp(&weights[b]));
    let mirrored = other.map(|&k| MirroredHeading {
        heading_rad: choices[k].heading_rad(),
        probability: probability(&|c| c.is_apart(here)),
    });
    let fit = here.problem.checked(&here.fitted, p_swapped)?;
    Ok(WalkFit { mirrored, ..fit })
}

/// The fits, those in the tracker's heading first; all four, or the two whose outlines are alike.
fn choices<'p, 'a>(
    problem: &'p Problem<'a>,
    mirrored: &'p Problem<'a>,
    are_all: bool,
) -> Result<Vec<Choice<'p, 'a>>, FitError> {
    if problem.frame_count() < LEAST_FRAMES {
        return Err(FitError::TooFewFrames { got: problem.frame_count() });
    }
    let (start, gait) = problem.best_start(0.0).ok_or(FitError::Undetermined)?;
    let fitted = problem.finished(start).ok_or(FitError::Undetermined)?;
    let mut choices = vec![Choice { problem, is_mirrored: false, is_exchanged: false, fitted }];
    let others = [(true, true), (false, true), (true, false)];
    for (is_mirrored, is_exchanged) in others.into_iter().take(if are_all { 3 } else { 1 }) {
        let problem = if is_mirrored { mirrored } else { problem };
        let (phase, gait) = if is_exchanged { (0.5, gait.mirrored()) } else { (0.0, gait) };
        let fitted = problem.started(phase, gait).and_then(|(_, start)| problem.finished(start));
        choices.extend(fitted.map(|fitted| Choice { problem, is_mirrored, is_exchanged, fitted }));
    }
    Ok(choices)
}

/// Logarithms of the weights: of the heading by the costs, of the sides in it by their evidence.
fn weights(choices: &[Choice<'_, '_>], p_tracked: f64) -> Vec<f64> {
    let cost = |seen: &Seen| (seen.cost + seen.outer_missed).max(1e-9);
    let of = |choice: &Choice<'_, '_>| {
        let same_heading = || choices.iter().filter(|c| c.is_mirrored == choice.is_mirrored);
        let least = same_heading().map(|c| cost(&c.fitted.seen)).fold(f64::INFINITY, f64::min);
        let partner = same_heading().find(|c| c.is_exchanged != choice.is_exchanged);
        let p_partner = if choice.is_exchanged { 1.0 - p_tracked } else { p_tracked };
        let p_other = partner
            .map_or(0.0, |other| choice.problem.p_other_sides(&choice.fitted, &other.fitted, p_partner));
        -LOG_ODDS * least.ln() + (1.0 - p_other).max(1e-12).ln()
    };
    choices.iter().map(of).collect()
}
