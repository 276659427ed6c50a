//! The first two steps of the interpretation scheme: all groups of two and three points are tested.
//!
//! Hoffman and Flinchbaugh 1982, section 6: "(1) divide the image into groups of two or three elements each, (2)
//! test each group for pairwise-rigid planar motion, (3) combine the results". Step (3) is
//! [`interpret_figure`](super::interpret_figure).

use super::{
    FitError, FitOptions, HingeFit, PlanarEvidence, PlanarEvidenceOptions, RodFit, fit_hinge, fit_rod,
    hinge_evidence, rod_evidence,
};
use glam::DVec2;
use rayon::prelude::*;

/// Two points fitted as a rod.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The points, the lower index first; it is the pivot of the fit.
    pub points: [usize; 2],
    /// The fit and its evidence, or why there is none.
    pub tested: Result<(RodFit, PlanarEvidence), FitError>,
}

/// Three points fitted as a hinge.
#[derive(Debug, Clone, PartialEq)]
pub struct Triple {
    /// End, pivot, end; the lower end first.
    pub points: [usize; 3],
    /// The fit and its evidence, or why there is none.
    pub tested: Result<(HingeFit, PlanarEvidence), FitError>,
}

/// Tests all K (K - 1) / 2 pairs of K tracks, in order.
pub fn test_pairs(tracks: &[&[DVec2]], fit: &FitOptions, evidence: &PlanarEvidenceOptions) -> Vec<Pair> {
    let count = tracks.len();
    let pairs: Vec<[usize; 2]> = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j])).collect();
    let tested = |[i, j]: [usize; 2]| {
        let rod = fit_rod(tracks[i], tracks[j], fit)?;
        let says = rod_evidence(&rod, fit.noise_sd, evidence);
        Ok((rod, says))
    };
    pairs.into_par_iter().map(|points| Pair { points, tested: tested(points) }).collect()
}

/// Tests all triples of K tracks with every point as the pivot, K (K - 1) (K - 2) / 2 hinges, ordered by pivot.
pub fn test_triples(tracks: &[&[DVec2]], fit: &FitOptions, evidence: &PlanarEvidenceOptions) -> Vec<Triple> {
    let count = tracks.len();
    let ends = |pivot: usize| {
        let others = move || (0..count).filter(move |&i| i != pivot);
        others().flat_map(move |i| others().filter(move |&j| j > i).map(move |j| [i, pivot, j]))
    };
    let triples: Vec<[usize; 3]> = (0..count).flat_map(ends).collect();
    let tested = |[i, pivot, j]: [usize; 3]| {
        let hinge = fit_hinge(tracks[i], tracks[pivot], tracks[j], fit)?;
        let says = hinge_evidence(&hinge, fit.noise_sd, evidence);
        Ok((hinge, says))
    };
    triples.into_par_iter().map(|points| Triple { points, tested: tested(points) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::Verdict;

    /// The image of a leg that swings in a plane; then a point that is never seen.
    fn points() -> Vec<Vec<DVec2>> {
        let at = |view: usize| {
            let t = 0.2 * f64::from(view as u32);
            let image = |angle: f64| DVec2::new(0.8 * angle.sin(), angle.cos());
            let knee = 0.45 * image(0.4 * t.cos());
            [
                DVec2::ZERO,
                knee,
                knee + 0.42 * image(0.4 * t.cos() - 0.4 * (1.0 + (t + 0.8).sin())),
                DVec2::NAN,
            ]
        };
        (0..4).map(|k| (0..30).map(|view| at(view)[k]).collect()).collect()
    }

    #[test]
    fn every_group_is_answered_and_the_knee_is_the_pivot() {
        let tracks = points();
        let tracks: Vec<&[DVec2]> = tracks.iter().map(Vec::as_slice).collect();
        let (fit, evidence) = (FitOptions::default(), PlanarEvidenceOptions::default());
        let (pairs, triples) = (test_pairs(&tracks, &fit, &evidence), test_triples(&tracks, &fit, &evidence));
        assert_eq!((pairs.len(), triples.len()), (6, 12));
        for triple in &triples {
            match &triple.tested {
                Ok((_, says)) => {
                    assert!(!triple.points.contains(&3));
                    assert_eq!(says.verdict == Verdict::Planar, triple.points == [0, 1, 2], "{triple:?}");
                }
                Err(error) => {
                    assert!(triple.points.contains(&3) && matches!(error, FitError::TooFewViews { .. }));
                }
            }
        }
        let planar =
            |pair: &&Pair| pair.tested.as_ref().is_ok_and(|(_, says)| says.verdict == Verdict::Planar);
        let links: Vec<[usize; 2]> = pairs.iter().filter(planar).map(|pair| pair.points).collect();
        assert!(!links.contains(&[0, 2]), "no link from hip to ankle: {links:?}");
    }
}
