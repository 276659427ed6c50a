//! Who moves but is not followed, and why.
//!
//! Every region that moves and that nobody explains who is followed belongs to a moving thing, which the frames show one
//! after another: the region that overlaps its place most, by its velocity, in each frame. What hinders a start in a
//! frame (the border cuts the region off, it is too small, ...) and why starts were refused is counted.
//!
//! When a thing has gone, it may still belong to somebody who is followed: before the walk starts, after it ends, or as a
//! shadow. That is known when the walks of its time have ended. What remains, moved or could have started, and was seen
//! for [`LEAST_FRAMES`] frames, is left out ([`LeftOut`]).
//!
//! Limits: several people who move as one region are one thing; somebody who is hidden for longer than [`GAP_S`] is two.
//!
//! Memory does not grow with the length of the stream: at most [`MOST_THINGS`] things are open and [`MOST_CLOSED`] wait
//! for the end of a walk, each with [`MOST_SHOTS`] rectangles; [`MOST_WALKS`] walks are remembered while things of
//! their time are undecided; of those who were left out, the [`MOST_LEFT_OUT`] that were seen longest are kept, and all are
//! counted.

mod thing;

use super::locate::LocateError;
use crate::image::Rectangle;
pub(super) use thing::{Hindrance, Noticed, SMALLEST_PX, WalkBoxes};
use thing::{Shots, Thing};

/// A thing is given up after this time without it; somebody starts or ends a walk this near to it, seconds.
pub const GAP_S: f64 = 1.0;
/// Nobody is left out who was seen in fewer frames. Half of what a start needs: somebody beside a followed person starts
/// with as many.
pub const LEAST_FRAMES: usize = 7;
/// Things that are followed from frame to frame at a time; the one seen least is forgotten.
pub const MOST_THINGS: usize = 64;
/// Things that wait for the end of a walk; the one seen least is forgotten.
pub const MOST_CLOSED: usize = 256;
/// Rectangles kept of a thing, evenly over its time.
pub const MOST_SHOTS: usize = 64;
/// Walks remembered for things that are undecided.
pub const MOST_WALKS: usize = 128;
/// Those who were left out that are kept, the ones that were seen longest.
pub const MOST_LEFT_OUT: usize = 100;
/// Rectangles in the result.
const MOST_SHOWN: usize = 16;
/// Why somebody was not followed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// The image border cut the region off.
    CutOff,
    /// The region was too small to see limbs.
    TooSmall {
        /// Its height, pixels.
        height_px: f64,
    },
    /// The region cannot enclose one person of this height who stands on the ground before this camera.
    WrongSize,
    /// It fits no walk of a person of the given height, and its rectangles show another height.
    OtherHeight {
        /// That height, metres.
        shown_m: f64,
    },
    /// The region was wider than one person: several people who moved as one region, or a thing.
    TooWide,
    /// It moved more slowly than people walk, or stayed where it is.
    TooSlow {
        /// Its speed, m/s.
        speed_mps: f64,
    },
    /// It moved faster than people walk.
    TooFast {
        /// Its speed, m/s.
        speed_mps: f64,
    },
    /// No walk fits its contours, or it took no steps that legs of this height take.
    NotWalking,
    /// It was wholly visible, as one region, in fewer frames in a row than a start needs.
    TooBrief {
        /// Most frames in a row.
        frames: usize,
    },
    /// It could not be told from somebody who was followed beside it or in front of it.
    Beside,
    /// Larger regions moved at the same time, as many as are looked at.
    Crowded,
    /// Its frames are too far apart for steps to be followed, or their times are not in seconds.
    FramesApart {
        /// Mean time from frame to frame, seconds.
        apart_s: f64,
    },
    /// It moved over the ground, and a walk on a treadmill was asked for.
    OverGround {
        /// At this speed, m/s.
        speed_mps: f64,
    },
}

impl Reason {
    /// The name in files.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::CutOff => "cut off",
            Self::TooSmall { .. } => "too small",
            Self::WrongSize => "wrong size",
            Self::OtherHeight { .. } => "other height",
            Self::TooWide => "too wide",
            Self::TooSlow { .. } => "too slow",
            Self::TooFast { .. } => "too fast",
            Self::NotWalking => "not walking",
            Self::TooBrief { .. } => "too brief",
            Self::Beside => "beside somebody",
            Self::Crowded => "too many",
            Self::FramesApart { .. } => "frames too far apart",
            Self::OverGround { .. } => "over ground",
        }
    }

    /// Its figure: pixels, metres, m/s, seconds or frames; `None` for a reason without one.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        match *self {
            Self::TooSmall { height_px } => Some(height_px),
            Self::TooSlow { speed_mps } | Self::TooFast { speed_mps } | Self::OverGround { speed_mps } => {
                Some(speed_mps)
            }
            Self::OtherHeight { shown_m } => Some(shown_m),
            Self::FramesApart { apart_s } => Some(apart_s),
            Self::TooBrief { frames } => Some(frames as f64),
            _ => None,
        }
    }
}

impl Reason {
    /// The same reason once more, with the mean figure of all times.
    fn with_another(&self, other: &Self, times: usize) -> Self {
        let mean = |a: f64, b: f64| (times as f64 * a + b) / (times + 1) as f64;
        match (*self, *other) {
            (Self::TooSlow { speed_mps: a }, Self::TooSlow { speed_mps: b }) => {
                Self::TooSlow { speed_mps: mean(a, b) }
            }
            (Self::TooFast { speed_mps: a }, Self::TooFast { speed_mps: b }) => {
                Self::TooFast { speed_mps: mean(a, b) }
            }
            (Self::OverGround { speed_mps: a }, Self::OverGround { speed_mps: b }) => {
                Self::OverGround { speed_mps: mean(a, b) }
            }
            (Self::OtherHeight { shown_m: a }, Self::OtherHeight { shown_m: b }) => {
                Self::OtherHeight { shown_m: mean(a, b) }
            }
            _ => *other,
        }
    }
}

impl From<LocateError> for Reason {
    fn from(_: LocateError) -> Self {
        Self::WrongSize
    }
}

/// A rectangle in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shot {
    /// Number of the frame.
    pub frame: usize,
    /// Its time, seconds.
    pub time_s: f64,
    /// Where the thing was, pixels: of the frame in what a tracker returns, of the steadied picture before.
    pub rectangle: Rectangle,
}

/// Somebody or something that moved and was not followed.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Frames in which it was seen.
    pub frames: usize,
    /// Where it was, from its first to its last frame, 16 at most.
    pub shots: Vec<Shot>,
    /// Why it was not followed.
    pub reason: Reason,
}

impl LeftOut {
    /// The first frame.
    #[must_use]
    pub fn first(&self) -> &Shot {
        &self.shots[0]
    }

    /// The last frame.
    #[must_use]
    pub fn last(&self) -> &Shot {
        &self.shots[self.shots.len() - 1]
    }
}

/// Everything that moves and is not followed.
#[derive(Debug, Default)]
pub(super) struct Unfollowed {
    open: Vec<Thing>,
    closed: Vec<Thing>,
    walks: Vec<WalkBoxes>,
    left_out: Vec<LeftOut>,
    count: usize,
}

impl Unfollowed {
    /// Those who were left out, in order of their first frames.
    pub fn left_out(&self) -> Vec<LeftOut> {
        let mut all = self.left_out.clone();
        all.sort_by_key(|left| (left.first().frame, left.last().frame));
        all
    }

    /// How many were left out.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds the regions of a frame.
    pub fn notice(&mut self, frame: usize, time_s: f64, regions: &[Noticed]) {
        let shot = |noticed: &Noticed| Shot { frame, time_s, rectangle: noticed.rectangle };
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (n, noticed) in regions.iter().enumerate() {
            let like = |(k, thing): (usize, &Thing)| Some((thing.likeness(&shot(noticed))?, k, n));
            pairs.extend(self.open.iter().enumerate().filter_map(like));
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (mut taken, mut known) = (vec![false; self.open.len()], vec![false; regions.len()]);
        for (_, k, n) in pairs {
            if !taken[k] && !known[n] {
                (taken[k], known[n]) = (true, true);
                self.open[k].count(&regions[n]);
                self.open[k].add(shot(&regions[n]));
            }
        }
        for (noticed, _) in regions.iter().zip(known).filter(|(_, known)| !known) {
            let mut thing = Thing::new(Shots::new(shot(noticed), MOST_SHOTS));
            thing.count(noticed);
            self.open.push(thing);
        }
        let gone = self.open.extract_if(.., |thing| time_s - thing.shots.last.time_s > GAP_S);
        self.closed.extend(gone.filter(|thing| thing.shots.seen >= LEAST_FRAMES));
        forget_least(&mut self.open, MOST_THINGS);
        forget_least(&mut self.closed, MOST_CLOSED);
    }

    /// Notes why a start on the region of this frame was refused.
    pub fn refuse(&mut self, frame: usize, rectangle: &Rectangle, reason: Reason) {
        let is_it = |thing: &&mut Thing| {
            let last = &thing.shots.last;
            last.frame == frame && last.rectangle == *rectangle
        };
        self.open.iter_mut().find(is_it).into_iter().for_each(|thing| thing.refuse(reason));
    }

    /// Notes a walk: what belongs to it is not left out.
    pub fn followed(&mut self, walk_boxes: WalkBoxes) {
        self.walks.push(walk_boxes);
        let excess = self.walks.len().saturating_sub(MOST_WALKS);
        self.walks.drain(..excess);
    }

    /// Notes a walk that was none after all.
    pub fn withdrawn(&mut self, walk_boxes: WalkBoxes, reason: Reason) {
        let mut own = self.open.extract_if(.., |thing| thing.belongs_to(&walk_boxes)).collect::<Vec<_>>();
        own.extend(self.closed.extract_if(.., |thing| thing.belongs_to(&walk_boxes)));
        let mut thing = Thing::of_walk(&walk_boxes);
        own.iter().for_each(|other| thing.join(other));
        thing.refuse(reason);
        self.open.push(thing);
    }

    /// Decides on the things that are gone and whose walks have ended: `since_s` is when the first walk that goes on
    /// began, infinity if none does.
    pub fn settle(&mut self, since_s: f64, start_frames: usize) {
        let walks = &self.walks;
        let decided = self.closed.extract_if(.., |thing| thing.shots.last.time_s + GAP_S < since_s);
        let left = decided.filter(|thing| {
            thing.is_notable(start_frames) && !walks.iter().any(|walk_boxes| thing.belongs_to(walk_boxes))
        });
        let left: Vec<LeftOut> = left.map(|thing| thing.left_out()).collect();
        self.count += left.len();
        self.left_out.extend(left);
        while self.left_out.len() > MOST_LEFT_OUT {
            let least = (0..self.left_out.len()).min_by_key(|&k| self.left_out[k].frames);
            least.into_iter().for_each(|k| drop(self.left_out.remove(k)));
        }
        let things = self.open.iter().chain(&self.closed);
        let first_s = things.map(|thing| thing.shots.first().time_s).fold(f64::INFINITY, f64::min);
        self.walks.retain(|walk_boxes| walk_boxes.shots.last.time_s + 2.0 * GAP_S >= first_s.min(since_s));
    }

    /// Ends the stream or the view, after the walks.
    pub fn finish(&mut self, start_frames: usize) {
        self.closed.append(&mut self.open);
        self.settle(f64::INFINITY, start_frames);
        self.walks.clear();
    }
}

fn forget_least(things: &mut Vec<Thing>, most: usize) {
    while things.len() > most {
        let least = (0..things.len()).min_by_key(|&k| things[k].shots.seen);
        least.into_iter().for_each(|k| drop(things.remove(k)));
    }
}

#[cfg(test)]
mod tests;
