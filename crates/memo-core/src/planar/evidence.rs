//! Evidence of planar motion: a statistic of a fit with a stated false-target rate.
//!
//! Hoffman and Flinchbaugh 1982 take any interpretation of the minimum number of views as evidence, but a third
//! of unrelated points has one. Here the residual of many views is compared with noise and motion:
//!
//! ```text
//! F = residual^2 N / (N - u) / (2 noise^2 + (r0 m)^2)
//! ```
//!
//! with N residuals, u unknowns, m the RMS motion in space of the rod that moves least, and r0 the departure of
//! real limbs from their plane, relative to that motion. A tolerance relative to the length would accept every point
//! that hardly moves; one relative to the motion in the image would refuse limbs that swing along the line of sight.
//!
//! The rates are for **unrelated** motions: joints of different walkers, one stride, 8 to 60 views. Points of one
//! body are related, and some false triples of one body are nearly planar hinges (see `tests/planar_rates.rs` for
//! both rates). Which of several readings of a body is right has to be decided for the whole figure.

use super::{FitError, FitOptions, HingeFit, RodFit, fit_hinge};
use glam::DVec2;

/// Rate at which unrelated points are accepted as planar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FalseTargetRate {
    /// 1 in 100.
    OnePercent,
    /// 1 in 20.
    FivePercent,
}

impl FalseTargetRate {
    /// The rate as a fraction.
    pub fn fraction(self) -> f64 {
        match self {
            Self::OnePercent => 0.01,
            Self::FivePercent => 0.05,
        }
    }
}

/// Options of the verdicts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarEvidenceOptions {
    /// False-target rate that is accepted.
    pub rate: FalseTargetRate,
    /// Minimum motion, in the unit of the points; below it the verdict is undecided. Default 0: if the noise is
    /// known, the minimum by noise and length is enough.
    pub least_motion: f64,
}

impl Default for PlanarEvidenceOptions {
    fn default() -> Self {
        Self { rate: FalseTargetRate::OnePercent, least_motion: 0.0 }
    }
}

/// Verdict on planar motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Planar, at the requested false-target rate.
    Planar,
    /// Farther from planar than real limbs are.
    NotPlanar,
    /// The views are not sufficient for a verdict.
    Undecided(Undecided),
    /// There are as many unknowns as equations: an interpretation always exists and is not evidence.
    Unfalsifiable,
}

/// Why the views are not sufficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Undecided {
    /// A rod hardly moves in the image: without motion everything is planar.
    LittleMotion,
    /// The best plane is at the tilt limit: seen edge-on, any motion along a line is planar.
    EdgeOn,
    /// Too few views for the false-target rate to hold.
    FewViews,
}

/// A verdict with the numbers it is based on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarEvidence {
    /// The verdict.
    pub verdict: Verdict,
    /// F; infinite without redundancy.
    pub statistic: f64,
    /// Largest F that counts as planar.
    pub threshold: f64,
    /// RMS motion of the least moving rod, in the unit of the points.
    pub motion: f64,
    /// Minimum motion for a verdict.
    pub least_motion: f64,
    /// The false-target rate requested.
    pub rate: FalseTargetRate,
}

/// r0, minimum motion and thresholds of one kind of group.
struct Calibration {
    /// r0: departure of limbs from their plane, relative to the motion.
    departure: f64,
    /// Minimum motion divided by the noise's standard deviation. Points at rest have 2.
    motion_by_noise: f64,
    /// Minimum motion divided by the length of the shortest rod.
    motion_by_length: f64,
    /// Minimum redundancy for which the rates hold.
    redundancy: usize,
    /// Threshold of F up to 26 redundant equations and from 116 on, linear in between: with fewer views more
    /// unrelated points pass by chance.
    one_percent: [f64; 2],
    five_percent: f64,
}

/// From strides of pairs of walkers and 0 to 2 px of noise at 200 px/m, 1000 samples for each number of views and
/// noise (`tests/planar_rates.rs`): 0.1 to 1 % (0.4 to 3.2 %) of unrelated triples pass, most at 2 px; of points scattered
/// anew in every view up to 5 % at the rate of 5 %. True hinges pass in 75 to 87 % (87 to 95 %) at 0 and 1 px or 60 views,
/// in 63 % (85 %) of 15 views at 2 px.
const HINGE: Calibration = Calibration {
    departure: 0.09,
    motion_by_noise: 2.5,
    motion_by_length: 0.05,
    redundancy: 12,
    one_percent: [0.97, 1.07],
    five_percent: 1.3,
};

/// A rod is weaker evidence than a hinge: it must move more and fit better.
const ROD: Calibration = Calibration {
    departure: 0.06,
    motion_by_noise: 4.0,
    motion_by_length: 0.15,
    redundancy: 12,
    one_percent: [0.55, 0.55],
    five_percent: 1.15,
};

/// Evidence of a hinge; `noise_sd` is that given to the fit.
pub fn hinge_evidence(fit: &HingeFit, noise_sd: f64, options: &PlanarEvidenceOptions) -> PlanarEvidence {
    let group = Group {
        residual_rms: fit.residual_rms,
        unknowns: 4,
        redundancy: fit.redundancy,
        motion: fit.motion[0].min(fit.motion[1]),
        motion_in_space: fit.motion_in_space[0].min(fit.motion_in_space[1]),
        length: fit.lengths[0].min(fit.lengths[1]),
        at_tilt_limit: fit.at_tilt_limit,
    };
    judge(&group, &HINGE, noise_sd, options)
}

/// Evidence of a rod; `noise_sd` is that given to the fit.
pub fn rod_evidence(fit: &RodFit, noise_sd: f64, options: &PlanarEvidenceOptions) -> PlanarEvidence {
    let group = Group {
        residual_rms: fit.residual_rms,
        unknowns: 3,
        redundancy: fit.redundancy,
        motion: fit.motion,
        motion_in_space: fit.motion_in_space,
        length: fit.length,
        at_tilt_limit: fit.at_tilt_limit,
    };
    judge(&group, &ROD, noise_sd, options)
}

/// Three points with each one tried as the pivot.
#[derive(Debug, Clone, PartialEq)]
pub struct Linkage {
    /// Fit with point i as the pivot and the two others, in order, as ends.
    pub fits: [HingeFit; 3],
    /// Evidence for each role.
    pub evidence: [PlanarEvidence; 3],
    /// The pivot, if exactly one role is planar; then the two other points are not linked.
    pub pivot: Option<usize>,
}

/// Finds which of three points is the joint of the other two ("Linking the feature points" in the paper): the one
/// role that is planar gives the links.
///
/// # Errors
/// Those of [`fit_hinge`].
pub fn link_three(
    points: [&[DVec2]; 3],
    options: &FitOptions,
    evidence: &PlanarEvidenceOptions,
) -> Result<Linkage, FitError> {
    let [a, b, c] = points;
    let fits = [fit_hinge(b, a, c, options)?, fit_hinge(a, b, c, options)?, fit_hinge(a, c, b, options)?];
    let evidence = [0, 1, 2].map(|i| hinge_evidence(&fits[i], options.noise_sd, evidence));
    let is_planar = |i: &usize| evidence[*i].verdict == Verdict::Planar;
    let mut planar = (0..3).filter(is_planar);
    let pivot = planar.next().filter(|_| planar.next().is_none());
    Ok(Linkage { fits, evidence, pivot })
}

/// Values of a fit that a verdict needs.
struct Group {
    residual_rms: f64,
    unknowns: usize,
    redundancy: usize,
    motion: f64,
    motion_in_space: f64,
    length: f64,
    at_tilt_limit: bool,
}

fn judge(
    group: &Group,
    calibration: &Calibration,
    noise_sd: f64,
    options: &PlanarEvidenceOptions,
) -> PlanarEvidence {
    let least_motion = options
        .least_motion
        .max(calibration.motion_by_noise * noise_sd)
        .max(calibration.motion_by_length * group.length);
    let threshold = match options.rate {
        FalseTargetRate::OnePercent => {
            let [few, many] = calibration.one_percent;
            few + (many - few) * ((group.redundancy as f64 - 26.0) / 90.0).clamp(0.0, 1.0)
        }
        FalseTargetRate::FivePercent => calibration.five_percent,
    };
    let redundancy = group.redundancy as f64;
    let residual_sq =
        group.residual_rms * group.residual_rms * (redundancy + group.unknowns as f64) / redundancy;
    let tolerance_sq = 2.0 * noise_sd * noise_sd + (calibration.departure * group.motion_in_space).powi(2);
    let statistic = if group.redundancy == 0 { f64::INFINITY } else { residual_sq / tolerance_sq };
    let verdict = if group.redundancy == 0 {
        Verdict::Unfalsifiable
    } else if group.motion < least_motion {
        Verdict::Undecided(Undecided::LittleMotion)
    } else if statistic.is_nan() || statistic > threshold {
        Verdict::NotPlanar
    } else if group.at_tilt_limit {
        Verdict::Undecided(Undecided::EdgeOn)
    } else if group.redundancy < calibration.redundancy {
        Verdict::Undecided(Undecided::FewViews)
    } else {
        Verdict::Planar
    };
    PlanarEvidence { verdict, statistic, threshold, motion: group.motion, least_motion, rate: options.rate }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    fn verdict(points: [&[DVec2]; 3], noise_sd: f64) -> Verdict {
        let options = FitOptions { noise_sd, ..FitOptions::default() };
        let fit = fit_hinge(points[0], points[1], points[2], &options).unwrap();
        hinge_evidence(&fit, noise_sd, &PlanarEvidenceOptions::default()).verdict
    }

    /// The image of a leg that swings in an oblique plane.
    fn leg(views: usize, swing: f64) -> [Vec<DVec2>; 3] {
        let mut points = [vec![], vec![], vec![]];
        for view in 0..views {
            let t = 6.2 * view as f64 / views as f64;
            let image = |angle: f64| DVec2::new(0.8 * angle.sin(), angle.cos());
            let knee = 0.45 * image(swing * t.cos());
            let ankle = knee + 0.42 * image(swing * t.cos() - swing * (1.0 + (t + 0.8).sin()));
            for (points, point) in points.iter_mut().zip([DVec2::ZERO, knee, ankle]) {
                points.push(point);
            }
        }
        points
    }

    #[test]
    fn every_verdict_has_its_case() {
        let [hip, knee, ankle] = leg(30, 0.4);
        assert_eq!(verdict([&hip, &knee, &ankle], 0.002), Verdict::Planar);
        assert_eq!(verdict([&hip, &ankle, &knee], 0.002), Verdict::NotPlanar);
        assert_eq!(verdict([&hip[..2], &knee[..2], &ankle[..2]], 0.002), Verdict::Unfalsifiable);
        let [hip, knee, ankle] = leg(5, 0.4);
        assert_eq!(verdict([&hip, &knee, &ankle], 0.002), Verdict::Undecided(Undecided::FewViews));
        let [hip, knee, ankle] = leg(30, 0.005);
        assert_eq!(verdict([&hip, &knee, &ankle], 0.002), Verdict::Undecided(Undecided::LittleMotion));
    }

    #[test]
    fn resting_points_are_undecided_whatever_the_noise_does() {
        let mut random = Random::new(9);
        for _ in 0..200 {
            let mut rest = |p: DVec2| -> Vec<DVec2> {
                (0..30).map(|_| p + 0.005 * DVec2::from_array(random.normal_pair().map(f64::from))).collect()
            };
            let points = [rest(DVec2::ZERO), rest(DVec2::new(0.1, 0.4)), rest(DVec2::new(0.1, 0.8))];
            let found = verdict([&points[0], &points[1], &points[2]], 0.005);
            assert_eq!(found, Verdict::Undecided(Undecided::LittleMotion));
        }
    }

    /// A hinge of rods 0.5 and 0.8 long that move by 0.3 and 0.4, seen with little noise.
    fn hinge(residual_rms: f64, redundancy: usize) -> HingeFit {
        let [hip, knee, ankle] = leg(30, 0.4);
        let fit = fit_hinge(&hip, &knee, &ankle, &FitOptions::default()).unwrap();
        HingeFit {
            residual_rms,
            redundancy,
            lengths: [0.8, 0.5],
            motion: [0.2, 0.35],
            motion_in_space: [0.3, 0.4],
            at_tilt_limit: false,
            ..fit
        }
    }

    /// A rod 0.5 long that moves by 0.3.
    fn rod(residual_rms: f64, redundancy: usize) -> RodFit {
        let [hip, knee, _] = leg(30, 0.4);
        let fit = crate::planar::fit_rod(&hip, &knee, &FitOptions::default()).unwrap();
        RodFit {
            residual_rms,
            redundancy,
            length: 0.5,
            motion: 0.2,
            motion_in_space: 0.3,
            at_tilt_limit: false,
            ..fit
        }
    }

    const FIVE: PlanarEvidenceOptions =
        PlanarEvidenceOptions { rate: FalseTargetRate::FivePercent, least_motion: 0.0 };

    /// The statistic of the module head, and the thresholds at which the rates were measured.
    #[test]
    fn statistic_and_thresholds_are_the_calibrated_ones() {
        let (one, noise_sd) = (PlanarEvidenceOptions::default(), 0.004f64);
        for (redundancy, hinge_limit) in [(12, 0.97), (26, 0.97), (71, 1.02), (116, 1.07), (300, 1.07)] {
            let n = redundancy as f64;
            // u = 4 unknowns; r0 m is 0.09 times the motion of the rod that moves least.
            let of_hinge = hinge_evidence(&hinge(0.02, redundancy), noise_sd, &one);
            let expected =
                0.02f64.powi(2) * (n + 4.0) / n / (2.0 * noise_sd.powi(2) + (0.09 * 0.3f64).powi(2));
            assert!((of_hinge.statistic / expected - 1.0).abs() < 1e-12, "{of_hinge:?}");
            assert!((of_hinge.threshold - hinge_limit).abs() < 1e-12, "{of_hinge:?}");
            assert_eq!(hinge_evidence(&hinge(0.02, redundancy), noise_sd, &FIVE).threshold, 1.3);
            // u = 3, r0 = 0.06.
            let of_rod = rod_evidence(&rod(0.02, redundancy), noise_sd, &one);
            let expected =
                0.02f64.powi(2) * (n + 3.0) / n / (2.0 * noise_sd.powi(2) + (0.06 * 0.3f64).powi(2));
            assert!((of_rod.statistic / expected - 1.0).abs() < 1e-12, "{of_rod:?}");
            assert_eq!(of_rod.threshold, 0.55);
            assert_eq!(rod_evidence(&rod(0.02, redundancy), noise_sd, &FIVE).threshold, 1.15);
        }
        assert_eq!(
            [FalseTargetRate::OnePercent, FalseTargetRate::FivePercent].map(|r| r.fraction()),
            [0.01, 0.05]
        );
    }

    /// Just within and just beyond each threshold.
    #[test]
    fn a_residual_beyond_the_threshold_is_not_planar() {
        let residual = |f: f64, departure: f64, unknowns: f64| {
            (f * (departure * 0.3).powi(2) * 40.0 / (40.0 + unknowns)).sqrt()
        };
        for (options, of_hinge, of_rod) in
            [(PlanarEvidenceOptions::default(), 0.97 + 0.1 * 14.0 / 90.0, 0.55), (FIVE, 1.3, 1.15)]
        {
            for (share, verdict) in [(0.99, Verdict::Planar), (1.01, Verdict::NotPlanar)] {
                let fit = hinge(residual(share * of_hinge, 0.09, 4.0), 40);
                assert_eq!(hinge_evidence(&fit, 0.0, &options).verdict, verdict);
                let fit = rod(residual(share * of_rod, 0.06, 3.0), 40);
                assert_eq!(rod_evidence(&fit, 0.0, &options).verdict, verdict);
            }
        }
    }

    /// Minimum motion: 2.5 (a rod: 4) standard deviations of the noise, 5 % (15 %) of the shortest rod, or as
    /// requested.
    #[test]
    fn motion_must_be_more_than_noise_and_a_share_of_the_length() {
        let one = PlanarEvidenceOptions::default();
        for (noise_sd, asked, of_hinge, of_rod) in
            [(0.1, 0.0, 0.25, 0.4), (0.0, 0.0, 0.025, 0.075), (0.001, 0.28, 0.28, 0.28)]
        {
            let options = PlanarEvidenceOptions { least_motion: asked, ..one };
            let [found_hinge, found_rod] = [
                hinge_evidence(&hinge(0.0, 40), noise_sd, &options),
                rod_evidence(&rod(0.0, 40), noise_sd, &options),
            ];
            assert!((found_hinge.least_motion - of_hinge).abs() < 1e-12, "{found_hinge:?}");
            assert!((found_rod.least_motion - of_rod).abs() < 1e-12, "{found_rod:?}");
            assert_eq!((found_hinge.motion, found_rod.motion), (0.2, 0.2));
            let little = Verdict::Undecided(Undecided::LittleMotion);
            assert_eq!(found_hinge.verdict == little, of_hinge > 0.2);
            assert_eq!(found_rod.verdict == little, of_rod > 0.2);
        }
    }

    /// Good fits without a verdict: at the tilt limit, or with fewer views than the rates require.
    #[test]
    fn edge_on_and_few_views_are_undecided() {
        let one = PlanarEvidenceOptions::default();
        let edge_on = Verdict::Undecided(Undecided::EdgeOn);
        let steep = HingeFit { at_tilt_limit: true, ..hinge(0.001, 40) };
        assert_eq!(hinge_evidence(&steep, 0.0, &one).verdict, edge_on);
        let steep = RodFit { at_tilt_limit: true, ..rod(0.001, 40) };
        assert_eq!(rod_evidence(&steep, 0.0, &one).verdict, edge_on);
        // A bad fit is not planar, however steep.
        let bad = RodFit { residual_rms: 0.2, ..steep };
        assert_eq!(rod_evidence(&bad, 0.0, &one).verdict, Verdict::NotPlanar);
        for (redundancy, verdict) in [
            (0, Verdict::Unfalsifiable),
            (11, Verdict::Undecided(Undecided::FewViews)),
            (12, Verdict::Planar),
        ] {
            assert_eq!(hinge_evidence(&hinge(0.001, redundancy), 0.0, &one).verdict, verdict);
            assert_eq!(rod_evidence(&rod(0.001, redundancy), 0.0, &one).verdict, verdict);
        }
    }

    /// The pivot is the only one of three points that gives a hinge.
    #[test]
    fn the_pivot_is_the_only_one_that_fits() {
        let [hip, knee, ankle] = leg(30, 0.4);
        let (fit, one) =
            (FitOptions { noise_sd: 0.002, ..FitOptions::default() }, PlanarEvidenceOptions::default());
        for (order, pivot) in
            [([&hip, &knee, &ankle], 1), ([&knee, &hip, &ankle], 0), ([&ankle, &hip, &knee], 2)]
        {
            let found = link_three(order.map(|p| &p[..]), &fit, &one).unwrap();
            assert_eq!(found.pivot, Some(pivot));
        }
        // In a rigid triangle that turns in its plane every corner fits, and none is the pivot.
        let corner = |phase: f64| -> Vec<DVec2> {
            (0..30)
                .map(|i| {
                    let angle = phase + 0.2 * f64::from(i);
                    DVec2::new(0.5 * angle.cos(), angle.sin())
                })
                .collect()
        };
        let [a, b, c] = [0.0, 1.9, 4.0].map(corner);
        assert_eq!(link_three([&a, &b, &c], &fit, &one).unwrap().pivot, None);
    }
}
