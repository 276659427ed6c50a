//! How well the model fits the person.

use super::super::decisions::{
    LEAST_OF_SMALL_PX, MOST_MISSED, MOST_MISSED_OF_SMALL, MOST_RESIDUAL, MOST_RESIDUAL_PX, MOST_SOLE_M,
    POORLY_CROWN, POORLY_MISSED, POORLY_OFF, POORLY_SWAPPED, WELL_LENGTH_SD, WELL_MISSED,
};
use crate::model::body::{PART_COUNT, Part};

/// How well the contours of the fitted person lie on the edges of the frames.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FitQuality {
    /// Mean distance of edges from the outline, pixels.
    pub residual_px: f64,
    /// Height of the person in the middle of the walk, pixels.
    pub height_px: f64,
    /// Share of the outline on whose normal no edge was found.
    pub missed: f64,
    /// The same of the lines inside the body.
    pub missed_inside: f64,
    /// The farthest that a length of the body is from its mean over people, standard deviations.
    pub worst_length_sd: f64,
    /// Mean height of the lower sole above the ground, metres; `None` in an assumed camera, whose ground is assumed.
    pub sole_m: Option<f64>,
    /// How far the moving region reaches above the head of the model, in the median of the frames, as a share of the
    /// person's height in the image; `None` if no frame shows the person alone.
    pub crown_off: Option<f64>,
    /// Robust cost of the distances of all edges, which the fit makes least: of two fits to the same frames, the one that costs
    /// less is nearer to the edges.
    pub cost: f64,
    /// Cost of the edges of a whole outline in every frame, and of what body, height and ground are off their means over
    /// people: of two fits to the same frames at other distances from the camera, the one that costs less is likelier.
    pub total_cost: f64,
    /// The outline of each part, in the order of [`Part::ALL`]; `None` of a part that is nowhere on the outline.
    pub parts: [Option<PartQuality>; PART_COUNT],
}

/// How well the outline of one part lies on the edges of the frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartQuality {
    /// Share of the whole outline that is of this part.
    pub share: f64,
    /// Share of its outline on whose normal no edge was found.
    pub missed: f64,
    /// Mean distance of the other edges from its outline, pixels; `None` if no edge was found.
    pub residual_px: Option<f64>,
}

/// A verdict on the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FitVerdict {
    /// Angles have errors of a few degrees.
    Well,
    /// Part of the outline was not seen, or a length of the body is unusual: look at the overlay.
    InPart,
    /// The model may be in a wrong place.
    Poorly,
}

impl FitVerdict {
    /// The name in files and sentences: `well`, `in part` or `poorly`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Well => "well",
            Self::InPart => "in part",
            Self::Poorly => "poorly",
        }
    }
}

impl FitQuality {
    /// True if the fit is of something else or ended in a wrong place.
    pub(super) fn is_misfit(&self) -> bool {
        let is_near = self.residual_px <= MOST_RESIDUAL * self.height_px;
        let is_near_of_small = self.residual_px <= MOST_RESIDUAL_PX
            && self.missed <= MOST_MISSED_OF_SMALL
            && self.height_px >= LEAST_OF_SMALL_PX;
        self.missed > MOST_MISSED || !(is_near || is_near_of_small)
    }

    /// The verdict.
    #[must_use]
    pub fn verdict(&self) -> FitVerdict {
        if self.missed >= POORLY_MISSED || self.is_far() || self.is_beside_the_crown() {
            FitVerdict::Poorly
        } else if self.missed < WELL_MISSED && self.worst_length_sd < WELL_LENGTH_SD {
            FitVerdict::Well
        } else {
            FitVerdict::InPart
        }
    }

    /// The probability that the sides are exchanged, by what the fits with either sides show: a model that is beside the person
    /// shows less.
    pub(super) fn p_swapped(&self, by_fits: f64) -> f64 {
        if self.verdict() == FitVerdict::Poorly { by_fits.max(POORLY_SWAPPED) } else { by_fits }
    }

    /// Where the model is off: the parts that miss as much of their outline as makes a whole fit a poor one, or are as far
    /// from their edges and at least a pixel, and more than the outline as a whole. Those that lower the fit most come
    /// first.
    #[must_use]
    pub fn off_parts(&self) -> Vec<Part> {
        let worse = |of_part: f64, whole: f64, poor: f64| {
            if of_part >= poor.max(whole) { of_part / poor } else { 0.0 }
        };
        let off = |part: &Part| {
            let quality = self.parts[*part as usize]?;
            let missed = worse(quality.missed, self.missed, POORLY_MISSED);
            let residual = quality.residual_px.unwrap_or(0.0);
            let far = worse(residual, self.residual_px, (POORLY_OFF * self.height_px).max(1.0));
            (missed + far > 0.0).then_some((quality.share * (missed + far), *part))
        };
        let mut found: Vec<(f64, Part)> = Part::ALL.iter().filter_map(off).collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.into_iter().map(|(_, part)| part).collect()
    }

    /// True if the edges are farther from the outline than a good fit leaves them.
    #[must_use]
    pub fn is_far(&self) -> bool {
        self.residual_px >= POORLY_OFF * self.height_px
    }

    /// True if the head of the model is not where the person's is.
    #[must_use]
    pub fn is_beside_the_crown(&self) -> bool {
        self.crown_off.is_some_and(|off| off.abs() >= POORLY_CROWN)
    }

    /// True if the feet do not stand on the ground of a calibrated camera.
    #[must_use]
    pub fn is_off_ground(&self) -> bool {
        self.sole_m.is_some_and(|sole_m| sole_m.abs() > MOST_SOLE_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: FitQuality = FitQuality {
        residual_px: 0.7,
        height_px: 200.0,
        missed: 0.01,
        missed_inside: 0.05,
        worst_length_sd: 1.0,
        sole_m: Some(0.01),
        crown_off: Some(0.004),
        cost: 3000.0,
        total_cost: 150.0,
        parts: [Some(PartQuality { share: 1.0 / 14.0, missed: 0.01, residual_px: Some(0.7) }); PART_COUNT],
    };

    #[test]
    fn a_small_person_may_be_off_by_pixels_and_a_large_one_by_a_share_of_the_height() {
        for (height_px, residual_px, missed, is_misfit) in [
            (75.0, 1.4, 0.1, false),
            (75.0, 1.6, 0.1, true),
            (300.0, 3.5, 0.1, false),
            (300.0, 3.7, 0.1, true),
            (75.0, 1.4, 0.16, true),
            (49.0, 1.4, 0.1, true),
            (75.0, 0.5, 0.19, false),
            (75.0, 0.5, 0.21, true),
        ] {
            let quality = FitQuality { height_px, residual_px, missed, ..GOOD };
            assert_eq!(quality.is_misfit(), is_misfit, "{height_px} {residual_px} {missed}");
        }
    }

    #[test]
    fn each_sign_of_a_bad_fit_lowers_the_verdict() {
        let verdict = |quality: FitQuality| quality.verdict().name();
        assert_eq!(verdict(GOOD), "well");
        assert_eq!(verdict(FitQuality { missed: 0.03, ..GOOD }), "in part");
        assert_eq!(verdict(FitQuality { worst_length_sd: 3.1, ..GOOD }), "in part");
        let poor = FitQuality { missed: 0.11, ..GOOD };
        assert_eq!(verdict(poor), "poorly");
        assert_eq!([1e-3, 0.3].map(|p| poor.p_swapped(p)), [POORLY_SWAPPED, 0.3]);
        assert_eq!(GOOD.p_swapped(1e-3), 1e-3);
        assert_eq!(verdict(FitQuality { residual_px: 1.5, ..GOOD }), "poorly");
        for off in [0.04, -0.04] {
            assert_eq!(verdict(FitQuality { crown_off: Some(off), ..GOOD }), "poorly");
        }
        assert_eq!(verdict(FitQuality { crown_off: None, ..GOOD }), "well");
    }

    #[test]
    fn the_parts_that_are_off_are_named_and_the_worst_comes_first() {
        assert_eq!(GOOD.off_parts(), []);
        let with = |parts: &[(Part, f64, f64, f64)]| {
            let mut quality = GOOD;
            for &(part, share, missed, residual_px) in parts {
                let of_part = PartQuality { share, missed, residual_px: Some(residual_px) };
                quality.parts[part as usize] = Some(of_part);
            }
            quality
        };
        let (shank, foot, torso) = (Part::LeftShank, Part::LeftFoot, Part::Torso);
        // A tenth is missed of a poor fit, and of 200 pixels 0.007 are 1.4.
        let off = with(&[(shank, 0.1, 0.3, 0.7), (foot, 0.05, 0.4, 0.7), (torso, 0.2, 0.02, 1.5)]);
        assert_eq!(off.off_parts(), [shank, torso, foot]);
        assert_eq!(with(&[(foot, 0.05, 0.09, 1.3)]).off_parts(), []);
        // Of a person of whom half is not seen, a part that misses less is not what is off.
        let hidden = FitQuality { missed: 0.5, ..off };
        assert_eq!(hidden.off_parts(), [torso]);
        let unseen = FitQuality { parts: [None; PART_COUNT], ..GOOD };
        assert_eq!(unseen.off_parts(), []);
    }

    #[test]
    fn feet_are_off_the_ground_above_and_below_it() {
        assert!(!GOOD.is_off_ground() && !FitQuality { sole_m: None, ..GOOD }.is_off_ground());
        assert!(
            [0.06, -0.06].map(|sole_m| FitQuality { sole_m: Some(sole_m), ..GOOD }.is_off_ground())
                == [true; 2]
        );
    }
}
