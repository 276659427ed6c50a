//! The measured person of a walk.

use crate::result::result;
use memo_core::Body;
use memo_core::model::Part;
use memo_core::track::fit::{self, MeanSd, PartQuality};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use std::collections::BTreeMap;

result! {
    /// The measured person of a walk: how well the model fits, and the person's own body and curves.
    WalkFit |py, fit: &fit::WalkFit, mean_sd: &MeanSd| {
        /// Mean distance of the edges from the outline of the model, pixels.
        residual_px: f64 = fit.quality.residual_px,
        /// Height of the person in the middle of the walk, pixels.
        height_px: f64 = fit.quality.height_px,
        /// Share of the outline without an edge in the frames.
        missed: f64 = fit.quality.missed,
        /// The same of the lines inside the body.
        missed_inside: f64 = fit.quality.missed_inside,
        /// The farthest that a length of the body is from its mean over people, standard deviations.
        worst_length_sd: f64 = fit.quality.worst_length_sd,
        /// Mean height of the lower sole above the ground, metres; None in an assumed camera.
        sole_m: Option<f64> = fit.quality.sole_m,
        /// How far the moving region reaches above the model's head, in the median of the frames, as a share of
        /// the person's height in the image; None if no frame shows the person alone.
        crown_off: Option<f64> = fit.quality.crown_off,
        /// Whether the edges are too far from the outline for a good fit, as a share of the person's height.
        is_far: bool = fit.quality.is_far(),
        /// Whether the head of the model is not where the person's is.
        is_beside_the_crown: bool = fit.quality.is_beside_the_crown(),
        /// Whether the feet do not stand on the ground of a calibrated camera.
        is_off_ground: bool = fit.quality.is_off_ground(),
        /// How well the model fits: "well", "in part" (look at the overlay) or "poorly".
        verdict: String = fit.quality.verdict().name().to_owned(),
        /// Share of the outline of each part without an edge: `right shank`, `head` ...; only parts on the outline.
        part_missed: BTreeMap<String, f64> = of_parts(fit, |part| Some(part.missed)),
        /// Mean distance of the other edges from the outline of each part, pixels.
        part_residual_px: BTreeMap<String, f64> = of_parts(fit, |part| part.residual_px),
        /// The parts that miss more of their outline than a good fit does, or are farther from the edges; the worst first.
        off_parts: Vec<String> = fit.quality.off_parts().into_iter().map(|part| part.name().to_owned()).collect::<Vec<_>>(),
        /// Lengths of the body, metres: ankle_height, shank, thigh, torso, stature, upper_arm, forearm.
        lengths_m: BTreeMap<String, f64> = lengths_m(&fit.body),
        /// Standard deviations of the means over the frames of the walk: of the measured angles (`right_hip_deg` ...), of the
        /// torso's centre (`along_m`, `across_m` and `height_m`, of the path) and of the phase (`phase`, cycles).
        mean_sd: BTreeMap<String, f64> = of_means(mean_sd),
        /// The person's curves at fifty equally spaced phases from initial contact, (2, 5, 50) degrees: right and
        /// left; hip, knee, ankle, shoulder, elbow. NaN where a joint was not measured.
        curves_deg: Py<PyArrayDyn<f64>> = curves_deg(py, fit)?,
    }
    |fit| format!("outline within {:.2} px, {:.1} % missed", fit.residual_px, 100.0 * fit.missed)
}

/// A number of each part by its name, without those that have none.
fn of_parts(fit: &fit::WalkFit, of: impl Fn(&PartQuality) -> Option<f64>) -> BTreeMap<String, f64> {
    let known = Part::ALL.iter().zip(&fit.quality.parts);
    known.filter_map(|(part, quality)| Some((part.name().to_owned(), of(quality.as_ref()?)?))).collect()
}

/// The standard deviations by the names of what they are of.
fn of_means(sd: &MeanSd) -> BTreeMap<String, f64> {
    let joints = ["right", "left"].into_iter().zip(&sd.angles).flat_map(|(side, angles)| {
        let named = ["hip", "knee", "ankle", "shoulder", "elbow"].into_iter().zip(angles);
        named.filter_map(move |(joint, sd)| Some((format!("{side}_{joint}_deg"), (*sd)?.to_degrees())))
    });
    let place = ["along_m", "across_m", "height_m", "phase"].map(str::to_owned).into_iter().zip(sd.place);
    joints.chain(place).collect()
}

/// Lengths between the joints, metres.
fn lengths_m(body: &Body) -> BTreeMap<String, f64> {
    let p = &body.proportions;
    let lengths = [
        ("ankle_height", p.ankle_height),
        ("shank", p.knee_height - p.ankle_height),
        ("thigh", p.hip_height - p.knee_height),
        ("torso", p.shoulder_height - p.hip_height),
        ("stature", p.crown_height),
        ("upper_arm", p.upper_arm),
        ("forearm", p.forearm),
    ];
    lengths.into_iter().map(|(name, share)| (name.to_owned(), share * body.height_m)).collect()
}

fn curves_deg(py: Python<'_>, fit: &fit::WalkFit) -> PyResult<Py<PyArrayDyn<f64>>> {
    let seen = |n: usize| fit.frames.iter().any(|f| f.measured[n / 5].angles[n % 5].is_some());
    let curve = |(n, c): (usize, &Vec<f64>)| {
        let is_seen = seen(n);
        c.iter().map(move |x| if is_seen { x.to_degrees() } else { f64::NAN }).collect::<Vec<_>>()
    };
    let values: Vec<f64> = fit.curves.iter().enumerate().flat_map(curve).collect();
    let samples = values.len() / 10;
    Ok(PyArray1::from_vec(py, values).reshape([2, 5, samples])?.to_dyn().clone().unbind())
}
