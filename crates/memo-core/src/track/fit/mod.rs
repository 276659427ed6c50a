//! The person, measured: one fit of body, path and joint curves to all frames of a walk.
//!
//! Rohr's conclusion (section 7) proposes adaptively estimated motion curves and additional parameters for the body.
//! Tracking finds where somebody is and in which phase of an average gait. The fit starts there and asks what body
//! and what motion put the contours where the frames show them:
//!
//! 1. Unknowns start at their means over people (`unknowns`), place and phase of each frame at the tracker's.
//!    Where the tracker's phase left out a step, a line of phase takes its place (`steps`).
//! 2. Visible contours are sampled (`lines`), and the nearest edge on each sample's normal is searched
//!    (`edge_search`).
//! 3. A Gauss-Newton step moves all unknowns at once; large distances count less (Geman and McClure). Distances that
//!    count become smaller from step to step.
//! 4. The first steps are made from several gaits; the one whose contours are nearest to a few of the frames, once its
//!    curves are fitted, goes on.
//! 5. The joint curves are fitted first, then what each frame deviates from them.
//! 6. The steps after the first ones are made again with left and right exchanged, of a person whom others hide in part the
//!    first ones too, and the evidence decides (`sides`).
//! 7. Standard deviations follow from the normal equations.
//! 8. A fit that is not a good one is made again at other distances from the camera, where the likeliest is clearly likelier
//!    (`other_starts`).
//! 9. Frames in which the feet alone show the walk go on from the fitted ones (`seam`).
//!
//! The normal equations (`normal`) have the form of an arrow ([`estimate::arrow`](crate::estimate::arrow)), so the time
//! is linear in the number of frames.

pub mod belt;
pub mod contacts;
mod contrast;
pub(crate) mod edge_search;
mod headings;
mod lines;
mod normal;
pub(crate) mod of_walk;
mod other_starts;
mod problem;
mod quality;
mod route;
mod seam;
mod seen;
mod sides;
mod steps;
mod unknowns;
pub(crate) mod views;

use super::height::BodyHeight;
use super::route::Route;
use crate::OptionError;
use crate::model::{Body, Gait, GaitStyle, PosedBody, Posture, Walker};
use crate::wording::counted;
use belt::Belt;
use contacts::Contact;
use glam::DVec3;
use thiserror::Error;

pub(crate) use headings::fit_on_the_spot;
pub(crate) use problem::{FitFrame, Problem};
pub use quality::{FitQuality, FitVerdict, PartQuality};
pub(crate) use route::{fitted_route, straightened};
pub use unknowns::JOINTS;

/// Options of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Standard deviation of the stated body height, as a share of it.
    pub height_sd: f64,
    /// Standard deviation of hip and knee about the person's own curves, radians. Ankle and arms vary twice as much.
    pub frame_sd_rad: f64,
    /// A walk that lasts longer is fitted in pieces of this many frames. The frames of the current piece are kept in
    /// memory where the person is, about 0.2 MB each for a person of 400 pixels.
    pub longest: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { height_sd: 0.012, frame_sd_rad: 3f64.to_radians(), longest: 1000 }
    }
}

impl FitOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        OptionError::unless_positive("height_sd", self.height_sd)?;
        OptionError::unless_positive("frame_sd_rad", self.frame_sd_rad)?;
        let is_enough = (LEAST_FRAMES..=100_000).contains(&self.longest);
        OptionError::unless(
            is_enough,
            "frames of the longest fit",
            "between 15 and 100000",
            self.longest as f64,
        )
    }
}

/// Fewer frames do not show a walk.
pub const LEAST_FRAMES: usize = 15;

/// Why no person was measured. The tracked walk is not affected.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum FitError {
    /// The walk is too short.
    #[error("the walk has only {}, and {LEAST_FRAMES} are needed", counted(*.got, "frame"))]
    TooFewFrames {
        /// Frames given.
        got: usize,
    },
    /// The frames do not determine the unknowns.
    #[error("the frames do not show enough of the person")]
    Undetermined,
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// Another number of pictures than the walk has rows.
    #[error("a walk of {} needs a picture of each, got {}", counted(*.wanted, "row"), counted(*.got, "picture"))]
    Pictures {
        /// Pictures given.
        got: usize,
        /// Rows of the walk.
        wanted: usize,
    },
    /// A picture of another size than the frames.
    #[error("pictures must be {}x{} like the frames, got {}x{}", wanted[0], wanted[1], got[0], got[1])]
    PictureSize {
        /// Width and height given.
        got: [usize; 2],
        /// Those of the frames.
        wanted: [usize; 2],
    },
    /// The person walks towards the camera or away from it.
    #[error("seen from the front or from behind, the outline does not show the joint angles")]
    Frontal,
    /// The fit ended in a place where the contours are not those of the frames.
    #[error(
        "the model does not fit the person: {:.0} % of its outline found no edge, the rest is {:.1} % of the height off",
        100.0 * .missed,
        100.0 * .residual
    )]
    Misfit {
        /// Share of the outline without an edge.
        missed: f64,
        /// Mean distance of the other edges, as a share of the body height.
        residual: f64,
    },
}

/// Angles of one side with their standard deviations, radians; `None` where the frames do not show the limb.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measured {
    /// Hip, knee, ankle, shoulder, elbow: angle and standard deviation.
    pub angles: [Option<[f64; 2]>; JOINTS],
}

/// One frame of the fitted walk.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedFrame {
    /// Centre of the torso, metres.
    pub torso_centre: DVec3,
    /// Direction the body faces, radians about world Z.
    pub heading_rad: f64,
    /// Length along the route, metres.
    pub along_m: f64,
    /// Gait phase, cycles, not wrapped; 0 = right initial contact.
    pub phase: f64,
    /// All angles of the model, measured or not, radians.
    pub posture: Posture,
    /// The angles that were measured, right then left.
    pub measured: [Measured; 2],
    /// Standard deviations of the torso's centre along the path, across it and in height (metres), and of the phase.
    pub sd: [f64; 4],
}

/// Standard deviations of means over the frames of a walk that were fitted, of an angle over those that show the limb: the
/// errors of single frames average out, those that all frames have in common do not.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeanSd {
    /// Of the angles, right then left: hip, knee, ankle, shoulder, elbow, radians; `None` if no frame shows the limb.
    pub angles: [[Option<f64>; JOINTS]; 2],
    /// Of the torso's centre along the path, across it and in height (metres), and of the phase.
    pub place: [f64; 4],
}

/// The measured person.
#[derive(Debug, Clone, PartialEq)]
pub struct WalkFit {
    /// The person's body.
    pub body: Body,
    /// The body height that the outlines show above the ground of a calibrated camera, whatever height was given;
    /// `None` in an assumed camera.
    pub height: Option<BodyHeight>,
    /// The fitted way; lengths along it begin below the middle of the walk.
    pub route: Route,
    /// The person's curves at fifty equally spaced phases from the side's own initial contact: hip, knee, ankle,
    /// shoulder and elbow of the right side, then of the left, radians.
    pub curves: [Vec<f64>; 2 * JOINTS],
    /// One entry per frame of the walk.
    pub frames: Vec<FittedFrame>,
    /// Standard deviations of the means over the frames that were fitted.
    pub mean_sd: MeanSd,
    /// Initial contacts and toe-offs, in order of time.
    pub contacts: Vec<Contact>,
    /// Probability that left and right are exchanged.
    pub p_swapped: f64,
    /// On a treadmill, the heading that looks alike.
    pub mirrored: Option<MirroredHeading>,
    /// The belt of a treadmill; `None` over ground, or if no stance was seen as a whole.
    pub belt: Option<Belt>,
    /// How well the model fits.
    pub quality: FitQuality,
}

/// A heading in which the outlines are almost the same, mirrored at the line of sight, mostly with left and right exchanged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MirroredHeading {
    /// Direction the body would face, radians about world Z.
    pub heading_rad: f64,
    /// Probability that it is the true one.
    pub probability: f64,
}

impl WalkFit {
    /// A walker with this body and the mean of both sides' curves.
    pub(crate) fn walker(&self) -> Walker {
        let mean = |joint: usize| {
            let sides = self.curves[joint].iter().zip(&self.curves[JOINTS + joint]);
            sides.map(|(right, left)| 0.5 * (right + left)).collect::<Vec<_>>()
        };
        let [hip, knee, shoulder, elbow] = [0, 1, 3, 4].map(mean);
        let gait = Gait::from_samples([&hip, &knee, &shoulder, &elbow]);
        Walker { body: self.body, gait, style: GaitStyle::default() }
    }

    /// The body in a frame, placed in the world.
    pub fn pose(&self, frame: usize) -> PosedBody {
        let FittedFrame { torso_centre, heading_rad, posture, .. } = &self.frames[frame];
        self.body.pose(*torso_centre, *heading_rad, posture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_outside_their_ranges_are_refused() {
        assert_eq!(FitOptions::default().check(), Ok(()));
        for options in [
            FitOptions { height_sd: 0.0, ..FitOptions::default() },
            FitOptions { frame_sd_rad: f64::INFINITY, ..FitOptions::default() },
            FitOptions { longest: 14, ..FitOptions::default() },
        ] {
            assert!(options.check().is_err(), "{options:?}");
        }
    }
}
