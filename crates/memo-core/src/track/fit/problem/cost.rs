//! What a fit costs: the weights of edges and priors.

use super::{Fitted, Problem};
use crate::track::fit::lines::{Sample, row_of};
use crate::track::fit::seen::Seen;
use crate::track::fit::unknowns::{Prior, Unknowns, WHOLE_GROUND, excess};

impl Problem<'_> {
    /// By what starts are compared: the cost of all edges. Where others hide a part, a model could lower it by hiding behind them.
    pub(super) fn cost(&self, seen: &Seen) -> f64 {
        if self.is_hidden() { seen.mean_cost() } else { seen.cost }
    }

    /// Cost of the edges of a whole outline in every frame, and minus twice the logarithm of the prior probability of body,
    /// height and ground. A model that hides has fewer edges, so they count by their mean.
    pub(super) fn total_cost(&self, unknowns: &Unknowns, seen: &Seen) -> f64 {
        let of_edges = OUTLINE_COST * self.visible_share * self.frames.len() as f64 * seen.mean_cost();
        let whole = &unknowns.whole;
        let off = |n: usize, prior: &Prior| (self.of_its_size(whole, n) - prior.mean) / prior.sd;
        let of_body: f64 = self.priors.iter().enumerate().map(|(n, prior)| off(n, prior).powi(2)).sum();
        let of_height = ((excess(whole) - self.excess.mean) / self.excess.sd).powi(2);
        let above_m = |k: usize| self.figure(unknowns, k).lowest_point().world.z - whole[WHOLE_GROUND];
        let of_ground: f64 =
            (0..self.frames.len()).map(|k| self.ground_precision() * above_m(k).powi(2)).sum();
        of_edges + of_body + of_height + of_ground
    }

    /// The same of a fit.
    pub(in super::super) fn total_cost_of(&self, fitted: &Fitted) -> f64 {
        self.total_cost(&fitted.unknowns, &fitted.seen)
    }

    /// Weight of the height of the lower sole in one frame: its error is common to about ten independent frames.
    pub(super) fn ground_precision(&self) -> f64 {
        self.ground_sd_m.powi(-2) / (self.frames.len() as f64 / GROUND_FRAMES).max(1.0)
    }
}

/// An outline counts fully, a foot half, because shoes have edges of their own, and so do clothes inside the body.
/// The top of the thigh belongs to buttock and pelvis as much.
pub(super) fn importance(sample: &Sample) -> f64 {
    let row = row_of(sample.point.part);
    let of_border = match (sample.is_outer, row) {
        (true, 7) => 0.5,
        (true, _) => 1.0,
        (false, _) => 0.25,
    };
    let is_top_of_thigh = row == 5 && sample.point.z > 1.0 - 2.0 * 0.28;
    let of_limb = if (2..=4).contains(&row) { 0.3 } else { 1.0 };
    of_limb * if is_top_of_thigh { 0.3 * of_border } else { of_border }
}

/// What the edge of a sole counts in the last steps: below it lies the shadow of the shoe, whose edges are as strong. The first steps
/// need it to find the ground, and which of two fits is nearer, it tells like the rest of the foot.
///
/// Of 35 clips of four drawn people in clothes that hardly differ from the background, the distance from the camera was 22 cm off
/// (mean) where it counted fully in all steps, and 18 cm with a tenth in the last ones; of 28 clips, most in other clothes, 3 cm with
/// both. With a quarter or a tenth in all steps it was 18 and 16 cm, but one of two recorded walks in such clothes came out 28 cm too
/// far away with a quarter, and the other 6 degrees apart in pictures with less contrast with a tenth.
///
/// With a hundredth in the last steps, distances of 82 clips are 6.4 cm off (root mean square) instead of 7.1, but two of the walkers
/// of `demo_scene` whose boxes are given come out more than 5 cm off across the path. The shadow is what is left: nine clips are 7 cm
/// too near (mean), and drawn again without it 0 to 6 cm off.
pub(super) const SOLE: f64 = 0.1;

/// What one whole outline costs in the [total cost](FitQuality::total_cost) if none of its edges is near the line. A sample of it
/// has a tenth of the weight that it has in a step, because what the model lacks is common to neighbouring samples and frames:
/// with the full weight, four of 14 drawn walks in clothes that hardly differ from the background are moved 14 to 47 cm too
/// far, with legs that are too short.
const OUTLINE_COST: f64 = 7.0;

/// True at the lower border of a foot.
pub(super) fn is_sole(sample: &Sample) -> bool {
    sample.is_outer && row_of(sample.point.part) == 7 && sample.normal.y > 0.0
}

/// The cost of an edge at a distance x, x² / (1 + x²), and the weight with which least squares lower it,
/// 1 / (1 + x²)² (Geman and McClure, Bull Int Stat Inst 52:5, 1987).
pub(super) fn robust(distance: f64) -> [f64; 2] {
    let near = 1.0 / (1.0 + distance * distance);
    [1.0 - near, near * near]
}

/// The weight with which least squares lower the negative logarithm of Student's t of four degrees of freedom, of a distance in
/// standard deviations. With it, people may be far from the mean whose skeletons nobody has measured.
pub(super) fn student(distance: f64) -> f64 {
    const FREEDOM: f64 = 4.0;
    (FREEDOM + 1.0) / (FREEDOM + distance * distance)
}

/// A step of this many grey levels counts half as much as a large one.
pub(super) const CLEAR_STEP: f64 = 15.0;

/// Number of independent standing feet in a walk.
const GROUND_FRAMES: f64 = 10.0;
