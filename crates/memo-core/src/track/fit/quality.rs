//! How well the model fits the person.

use super::super::decisions::{
    MOST_SOLE_M, POORLY_CROWN, POORLY_MISSED, POORLY_OFF, WELL_LENGTH_SD, WELL_MISSED,
};
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
    /// The verdict.
    #[must_use]
    pub fn verdict(&self) -> FitVerdict {
        if self.missed >= POORLY_MISSED
            || self.residual_px >= POORLY_OFF * self.height_px
            || self.is_beside_the_crown()
        {
            FitVerdict::Poorly
        } else if self.missed < WELL_MISSED && self.worst_length_sd < WELL_LENGTH_SD {
            FitVerdict::Well
        } else {
            FitVerdict::InPart
        }
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
    };

    #[test]
    fn each_sign_of_a_bad_fit_lowers_the_verdict() {
        let verdict = |quality: FitQuality| quality.verdict().name();
        assert_eq!(verdict(GOOD), "well");
        assert_eq!(verdict(FitQuality { missed: 0.03, ..GOOD }), "in part");
        assert_eq!(verdict(FitQuality { worst_length_sd: 3.1, ..GOOD }), "in part");
        assert_eq!(verdict(FitQuality { missed: 0.11, ..GOOD }), "poorly");
        assert_eq!(verdict(FitQuality { residual_px: 1.5, ..GOOD }), "poorly");
        for off in [0.04, -0.04] {
            assert_eq!(verdict(FitQuality { crown_off: Some(off), ..GOOD }), "poorly");
        }
        assert_eq!(verdict(FitQuality { crown_off: None, ..GOOD }), "well");
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
