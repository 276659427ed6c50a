//! Evidence that a linkage as a whole is that of a body, and not the cheapest one of dots that do not belong together.
//!
//! Dots of a scattered figure, or of several people, have a cheapest linkage too. Compared with a body's, its chains
//! leave their planes farther, the planes have different directions, some of its links are too long for limbs, its groups
//! touch less often, more of its dots are rods or alone, and other linkages are nearly as cheap. The sum
//!
//! ```text
//! E = a + b n - c n σ / s - d Σ r / s - e Σ max(0, l / s - 1.2) - f Σ ln(1 + F) - g Σ |P - median P|
//!       - h loose groups - i rods - j points alone + k Σ ln p
//! ```
//!
//! with n points, noise σ, size s, residuals r beyond the noise and statistics F of the chains
//! ([`crate::planar::PlanarEvidence`]), their planes P = g g' / (1 + |g|^2) of slopes g, which mirroring does not change,
//! lengths l and confidences p of the links, and groups without contact, is the log
//! odds of a body against other dots where both are as frequent. The factors are those of a logistic regression on
//! displays of walkers from all sides against displays of their dots at random places and of dots of several walkers at
//! one body's places. `tests/score_links.py` measures the rates on these and on other people.

use super::FigureOptions;
use super::linkage::{Chain, Figure};
use crate::estimate::median::median;
use crate::planar::{FalseTargetRate, Undecided, Verdict};
use glam::DVec3;

/// Factors of E, nats, in the order above.
const CONSTANT: f64 = 0.88;
const PER_POINT: f64 = 1.063;
const PER_NOISE: f64 = -4.1;
const PER_RESIDUAL: f64 = -25.0;
const PER_EXCESS: f64 = -1.9;
const PER_STATISTIC: f64 = -1.06;
const PER_PLANE: f64 = -2.8;
const PER_LOOSE_GROUP: f64 = -0.9;
const PER_ROD: f64 = -1.3;
const PER_POINT_ALONE: f64 = -1.8;
const PER_CONFIDENCE: f64 = 1.0;
/// Thighs and shanks are shorter than this share of the size.
const LONGEST_LIMB: f64 = 1.2;
/// A chain's ln(1 + F) counts at most this, and this if its plane is seen edge-on, in which any motion fits; a confidence
/// counts at least this.
const MOST_STATISTIC: f64 = 3.0;
const LEAST_CONFIDENCE: f64 = 0.02;
/// E that displays of other dots exceed at a rate of 1 and 5 %.
const LEAST: [f64; 2] = [2.0, 0.0];

/// Evidence for a figure as a whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FigureEvidence {
    /// E, nats: the log odds of a body against dots that do not belong together.
    pub nats: f64,
    /// Smallest E that counts as a body.
    pub least_nats: f64,
    /// Rate at which dots that do not belong together exceed it.
    pub rate: FalseTargetRate,
}

impl FigureEvidence {
    /// The evidence for a cover of `points` points.
    pub(super) fn of(figure: &Figure, points: usize, options: &FigureOptions) -> Self {
        let (size, noise_sd) = (figure.size, options.fit.noise_sd);
        let residual = |rms: f64| (rms * rms - 2.0 * noise_sd * noise_sd).max(0.0).sqrt();
        let residuals: f64 = figure.chains.iter().map(|chain| residual(chain.residual_rms)).sum();
        let statistic = |chain: &Chain| match chain.evidence.verdict {
            Verdict::Undecided(Undecided::EdgeOn) => MOST_STATISTIC,
            _ => chain.evidence.statistic.ln_1p().min(MOST_STATISTIC),
        };
        let statistics: f64 = figure.chains.iter().map(statistic).sum();
        let excess = |length: f64| (length / size - LONGEST_LIMB).max(0.0);
        let excesses: f64 = figure.links().map(|link| excess(link.length)).sum();
        let groups = figure.chains.len() + figure.alone.len();
        // Contacts are a forest: every one joins two parts.
        let loose = groups.saturating_sub(1 + figure.joints.len());
        let rods = figure.chains.iter().filter(|chain| chain.links.len() == 1).count();
        let confidences: f64 = figure.links().map(|link| link.confidence.max(LEAST_CONFIDENCE).ln()).sum();
        let points = points as f64;
        let nats = CONSTANT
            + points * (PER_POINT + PER_NOISE * noise_sd / size)
            + PER_RESIDUAL * residuals / size
            + PER_EXCESS * excesses
            + PER_STATISTIC * statistics
            + PER_PLANE * apart(&figure.chains)
            + PER_LOOSE_GROUP * loose as f64
            + PER_ROD * rods as f64
            + PER_POINT_ALONE * figure.alone.len() as f64
            + PER_CONFIDENCE * confidences;
        let rate = options.evidence.rate;
        let least_nats = match rate {
            FalseTargetRate::OnePercent => LEAST[0],
            FalseTargetRate::FivePercent => LEAST[1],
        };
        Self { nats, least_nats, rate }
    }

    /// Whether the figure counts as that of a body.
    pub fn is_body(&self) -> bool {
        self.nats >= self.least_nats
    }
}

/// Sum of the distances of the chains' planes, as symmetric tensors, from their median.
fn apart(chains: &[Chain]) -> f64 {
    let tensor = |chain: &Chain| {
        let (p, q) = (chain.plane.p, chain.plane.q);
        DVec3::new(p * p, q * q, std::f64::consts::SQRT_2 * p * q) / (1.0 + p * p + q * q)
    };
    let tensors: Vec<DVec3> = chains.iter().map(tensor).collect();
    let middle = [0, 1, 2].map(|axis| {
        let mut values: Vec<f64> = tensors.iter().map(|tensor| tensor[axis]).collect();
        median(&mut values).unwrap_or(0.0)
    });
    tensors.iter().map(|tensor| tensor.distance(DVec3::from_array(middle))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::figure::example::walker;
    use crate::planar::figure::{FigureOptions, FigureWindow, Status, interpret_figure};
    use crate::planar::{FitOptions, PlanarEvidenceOptions};
    use crate::synth::Random;
    use glam::DVec2;

    fn options(noise_sd: f64, rate: FalseTargetRate) -> FigureOptions {
        FigureOptions {
            fit: FitOptions { noise_sd, ..FigureOptions::default().fit },
            evidence: PlanarEvidenceOptions { rate, ..PlanarEvidenceOptions::default() },
            ..FigureOptions::default()
        }
    }

    fn window(tracks: &[Vec<DVec2>], times_s: &[f64], noise_sd: f64, rate: FalseTargetRate) -> FigureWindow {
        interpret_figure(tracks, times_s, &options(noise_sd, rate)).unwrap().windows.remove(0)
    }

    /// The model is a body, with noise too; its dots at other places are none.
    #[test]
    fn a_walker_is_a_body_and_its_scattered_dots_are_none() {
        let mut random = Random::new(17);
        for noise_px in [0.2, 1.0] {
            let (tracks, times_s, _) = walker(66, |_| 0.0, noise_px);
            let found = window(&tracks, &times_s, noise_px, FalseTargetRate::OnePercent);
            assert_eq!(found.status, Status::Interpreted);
            assert!(found.evidence.unwrap().nats > 4.0, "{:?}", found.evidence);
            let mut bodies = 0;
            for _ in 0..20 {
                let mut elsewhere = |track: &Vec<DVec2>| -> Vec<DVec2> {
                    let by = DVec2::new(random.uniform(-80.0, 80.0), random.uniform(-130.0, 130.0));
                    track.iter().map(|p| *p + by).collect()
                };
                let scattered: Vec<Vec<DVec2>> = tracks.iter().map(&mut elsewhere).collect();
                let found = window(&scattered, &times_s, noise_px, FalseTargetRate::OnePercent);
                bodies += usize::from(found.status == Status::Interpreted);
            }
            assert!(bodies <= 1, "{bodies} of 20 at {noise_px} px");
        }
    }

    /// Every term of E, written out anew; and both limits.
    #[test]
    fn the_evidence_is_the_sum_of_its_terms() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 1.0);
        let figure = window(&tracks[..11], &times_s, 1.0, FalseTargetRate::OnePercent).figure;
        let of = |figure: &Figure, noise_sd: f64, rate: FalseTargetRate| {
            FigureEvidence::of(figure, 11, &options(noise_sd, rate))
        };
        let own = of(&figure, 0.5, FalseTargetRate::OnePercent);
        let mut expected = 0.88 + 1.063 * 11.0 - 4.1 * 11.0 * 0.5 / figure.size;
        for chain in &figure.chains {
            expected -= 25.0 * (chain.residual_rms.powi(2) - 0.5).sqrt() / figure.size;
            expected -= 1.06 * (1.0 + chain.evidence.statistic).ln();
            expected += chain.links.iter().map(|link| link.confidence.ln()).sum::<f64>();
            expected -= if chain.links.len() == 1 { 1.3 } else { 0.0 };
        }
        expected -= 1.8 * figure.alone.len() as f64;
        // Planes as tensors g g' / (1 + |g|^2), two of whose entries are the same.
        let planes: Vec<[f64; 4]> = figure
            .chains
            .iter()
            .map(|chain| {
                let (p, q) = (chain.plane.p, chain.plane.q);
                [p * p, p * q, p * q, q * q].map(|entry| entry / (1.0 + p * p + q * q))
            })
            .collect();
        let middle: [f64; 4] = std::array::from_fn(|k| {
            let mut entries: Vec<f64> = planes.iter().map(|plane| plane[k]).collect();
            entries.sort_by(f64::total_cmp);
            0.5 * (entries[(entries.len() - 1) / 2] + entries[entries.len() / 2])
        });
        for plane in &planes {
            expected -= 2.8 * (0..4).map(|k| (plane[k] - middle[k]).powi(2)).sum::<f64>().sqrt();
        }
        let groups = figure.chains.len() + figure.alone.len();
        assert_eq!(figure.joints.len(), groups - 1, "all groups touch");
        assert!((own.nats - expected).abs() < 1e-9, "{own:?} {expected}");
        assert_eq!((own.least_nats, own.rate), (2.0, FalseTargetRate::OnePercent));
        assert_eq!(of(&figure, 0.5, FalseTargetRate::FivePercent).least_nats, 0.0);
        // A contact less, residuals below the noise, and statistics and confidences at their ends.
        let mut other = figure.clone();
        other.joints.pop();
        assert!((own.nats - of(&other, 0.5, FalseTargetRate::OnePercent).nats - 0.9).abs() < 1e-9);
        other.chains[0].links[0].length = 2.0 * figure.size;
        let long = of(&other, 0.5, FalseTargetRate::OnePercent);
        assert!((own.nats - long.nats - 0.9 - 1.9 * 0.8).abs() < 1e-9);
        let quiet = of(&figure, 100.0, FalseTargetRate::OnePercent).nats;
        let without = {
            let mut other = figure.clone();
            other.chains.iter_mut().for_each(|chain| chain.residual_rms = 0.0);
            of(&other, 100.0, FalseTargetRate::OnePercent).nats
        };
        assert_eq!(quiet, without);
        let mut worst = figure.clone();
        worst.chains[0].evidence.statistic = f64::INFINITY;
        worst.chains[0].links[0].confidence = 0.0;
        let first = &figure.chains[0];
        let lost =
            1.06 * (3.0 - (1.0 + first.evidence.statistic).ln()) + (first.links[0].confidence / 0.02).ln();
        let found = of(&worst, 0.5, FalseTargetRate::OnePercent);
        assert!((own.nats - found.nats - lost).abs() < 1e-9);
        // A plane seen edge-on is no evidence, and the mirror image of a plane is the same.
        let mut steep = figure.clone();
        steep.chains[0].evidence.verdict = Verdict::Undecided(Undecided::EdgeOn);
        steep.chains[1].plane = steep.chains[1].plane.mirror();
        let found = of(&steep, 0.5, FalseTargetRate::OnePercent);
        let lost = 1.06 * (3.0 - (1.0 + first.evidence.statistic).ln());
        assert!((own.nats - found.nats - lost).abs() < 1e-9);
        let edge = FigureEvidence { nats: 2.0, ..own };
        assert!(edge.is_body() && !FigureEvidence { nats: 1.999, ..own }.is_body());
    }
}
