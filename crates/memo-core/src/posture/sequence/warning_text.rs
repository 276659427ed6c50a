//! The sentences of the warnings.

use super::warning::Warning;
use super::{Motion, Strength};
use crate::wording::counted;
use glam::DVec2;
use std::fmt;

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LightJoints { light, all, min_weight } => {
                let all = counted(*all, "point");
                write!(f, "{light} of {all} taken as missing, for weights below {min_weight}")
            }
            Self::OutsideLens { outside, all } => {
                let all = counted(*all, "point");
                write!(f, "{outside} of {all} outside what this lens shows, taken as missing")
            }
            Self::OutsidePicture { beyond, all, size, farthest_px } => {
                outside_picture(f, &share_of(*beyond, *all, "point"), *size, *farthest_px)
            }
            Self::NoGround { camera_height_m: m } => {
                write!(
                    f,
                    "the camera is at a height of {m:.2} m, not above the ground: the ground tells nothing"
                )
            }
            Self::LengthsNotSeen { reason } => {
                write!(f, "lengths are those of average proportions, not of this person: {reason}")
            }
            Self::ScaleAssumed { scale_sd } => scale_assumed(f, 100.0 * scale_sd),
            Self::SegmentTooShort { segment, length_m, seen_m, frames, of } => {
                write!(
                    f,
                    "{segment} is taken as {length_m:.3} m, but in {frames} of {} ",
                    counted(*of, "frame")
                )?;
                write!(f, "it looks at least {seen_m:.3} m long: a wrong length or wrong points")
            }
            Self::Conflict(conflict) => conflict.fmt(f),
            Self::NoTravel { travelled_m, from } => no_travel(f, *travelled_m, from.name()),
            Self::Turns { turn_deg } => {
                write!(f, "the way turns by {turn_deg:.0} degrees; the rules are of straight walking")
            }
            Self::Backwards { frames, of } => backwards(f, *frames, &counted(*of, "frame")),
            Self::SilentFrames { silent, of, reason } => {
                let of = counted(*of, "frame");
                write!(f, "no posture from {silent} of {of}; in the first of them {reason}")
            }
            Self::WithoutRoot { share, usual } => without_root(f, 100.0 * share, 100.0 * usual),
            Self::Noisy { seen_px, stated_px } => {
                write!(f, "points jump from frame to frame as by a noise of {seen_px:.1} px, ")?;
                write!(f, "but noise_px is {stated_px:.1}")
            }
            Self::NothingPossible { frames, of } => {
                let share = share_of(*frames, *of, "frame");
                write!(f, "in {share} no posture is possible for a body: look at the violations")
            }
            Self::LinkedBreaks { frames, of } => {
                let share = share_of(*frames, *of, "frame");
                write!(f, "in {share} the linked posture breaks a limit of bodies")
            }
            Self::HabitsDropped { motion, frames, of } => write!(
                f,
                "as {}, the person would break a limit of the body, or swing the segments of a limb against each \
                 other, in {frames} of {}: neither the rules nor the \
                 habits of {} were used, as with \"physical\"",
                motion.noun(),
                counted(*of, "frame"),
                motion.name().replace('_', "-"),
            ),
            Self::RulesDropped { motion, frames, of } => write!(
                f,
                "the rules of {0} leave no posture in {frames} of {1}: neither the rules nor the habits of {0} were \
                 used, as with \"physical\"",
                motion.name().replace('_', "-"),
                counted(*of, "frame"),
            ),
            Self::AgainstRules { motion, strength, frames, of, linked } => {
                let none_left = format!("{frames} of {}", counted(*of, "frame"));
                against_rules(f, *motion, *strength, &none_left, 100.0 * linked)
            }
        }
    }
}

/// Such as "3 of 12 frames (25 %)".
fn share_of(part: usize, of: usize, noun: &str) -> String {
    format!("{part} of {} ({:.0} %)", counted(of, noun), 100.0 * part as f64 / of.max(1) as f64)
}

fn outside_picture(
    f: &mut fmt::Formatter<'_>,
    share: &str,
    [width, height]: [u32; 2],
    farthest_px: DVec2,
) -> fmt::Result {
    write!(
        f,
        "{share} outside the camera's picture of {width}x{height} pixels (up to {:.0}, {:.0}): the calibration \
         may be of another picture size",
        farthest_px.x, farthest_px.y
    )
}

fn scale_assumed(f: &mut fmt::Formatter<'_>, percent: f64) -> fmt::Result {
    write!(
        f,
        "neither lengths, height nor distance are known: all sizes and distances may be wrong by {percent:.0} % \
         together"
    )
}

fn no_travel(f: &mut fmt::Formatter<'_>, travelled_m: f64, from: &str) -> fmt::Result {
    if travelled_m.is_nan() {
        f.write_str(
            "one frame, or none, has a place over the ground, so there is no way to take the moving ",
        )?;
        return write!(f, "direction from: that of the {from} stands for it");
    }
    write!(
        f,
        "the person begins and ends {travelled_m:.2} m apart, too little for a moving direction: that of the \
         {from} stands for it"
    )
}

fn backwards(f: &mut fmt::Formatter<'_>, frames: usize, of: &str) -> fmt::Result {
    write!(
        f,
        "in {frames} of {of} the trunk faces against the way: the person walks backwards, or right and left are \
         exchanged in all frames"
    )
}

fn without_root(f: &mut fmt::Formatter<'_>, percent: f64, usual: f64) -> fmt::Result {
    write!(
        f,
        "{percent:.0} % of the segments look longer than they are (no real root; {usual:.0} % at most by noise): \
         points noisier than stated, wrong lengths or a wrong distance"
    )
}

fn against_rules(
    f: &mut fmt::Formatter<'_>,
    motion: Motion,
    strength: Strength,
    none_left: &str,
    linked_percent: f64,
) -> fmt::Result {
    let (rules, strength, noun) = (motion.name(), strength.name(), motion.noun());
    write!(
        f,
        "the rules of {rules} ({strength}) leave no posture in {none_left} and {linked_percent:.0} % of the linked \
         postures break one: this does not look like {noun}"
    )
}
