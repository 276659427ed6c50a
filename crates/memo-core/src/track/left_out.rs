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
//! for the end of a walk, each with [`MOST_SHOTS`] rectangles; [`MOST_TRAILS`] walks are remembered while things of
//! their time are undecided; of those who were left out, the [`MOST_LEFT_OUT`] that were seen longest are kept, and all are
//! counted.

use super::candidate::same_person;
use super::decisions::EXPLAINED;
use super::locate::LocateError;
use crate::image::{Rectangle, Sides};
use glam::DVec2;
use std::mem::discriminant;

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
pub const MOST_TRAILS: usize = 128;
/// Those who were left out that are kept, the ones that were seen longest.
pub const MOST_LEFT_OUT: usize = 100;
/// Rectangles kept of a walk, evenly over its time.
const MOST_STEPS: usize = 1024;
/// Rectangles in the result.
const MOST_SHOWN: usize = 16;
/// Below this height no limb is visible, pixels: as for [`GroupOptions::min_area`](crate::image::GroupOptions::min_area).
pub(super) const SMALLEST_PX: f64 = 30.0;
/// A region is the next one of a thing if they overlap by this, intersection over union,
const LEAST_OVERLAP: f64 = 0.15;
/// or if this share of the smaller one is in the other,
const LEAST_SHARED: f64 = 0.5;
/// and one is at most so many times as high as the other: what a limb alone shows is something else.
const MOST_TALLER: f64 = 2.0;
/// Share of a new velocity in the mean.
const NEW_VELOCITY: f64 = 0.2;
/// What moves by less than this share of its width, from the first to the last third of its time, stays where it is; of
/// what is too small or of the wrong size, by less than this share of its longer side: a part of somebody who stands.
const MOVED_SIZES: f64 = 0.5;
/// A region this many times as wide as it is high is wider than one person: as for
/// [`GroupOptions::max_aspect`](crate::image::GroupOptions::max_aspect).
const WIDE: f64 = 0.75;
/// What is lower than this share of a followed person in whose box it is belongs to that person: a shadow, an arm, a bag.
const AS_TALL: f64 = 0.7;

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
            Self::TooWide => "too wide",
            Self::TooSlow { .. } => "too slow",
            Self::TooFast { .. } => "too fast",
            Self::NotWalking => "not walking",
            Self::TooBrief { .. } => "too brief",
            Self::Beside => "beside somebody",
            Self::Crowded => "too many",
            Self::OverGround { .. } => "over ground",
        }
    }

    /// Its figure: pixels, m/s or frames; `None` for a reason without one.
    #[must_use]
    pub fn value(&self) -> Option<f64> {
        match *self {
            Self::TooSmall { height_px } => Some(height_px),
            Self::TooSlow { speed_mps } | Self::TooFast { speed_mps } | Self::OverGround { speed_mps } => {
                Some(speed_mps)
            }
            Self::TooBrief { frames } => Some(frames as f64),
            _ => None,
        }
    }
}

impl Reason {
    /// The same reason once more, with the mean speed of all times.
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
    /// Where the thing was, in the view of the first frame, pixels.
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

/// What hinders a start in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Hindrance {
    Small,
    CutOff,
    WrongSize,
    Crowded,
}

const HINDRANCES: [Hindrance; 4] =
    [Hindrance::CutOff, Hindrance::Small, Hindrance::WrongSize, Hindrance::Crowded];

/// A region that moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noticed {
    pub rectangle: Rectangle,
    pub hindrance: Option<Hindrance>,
    /// Whether somebody who is followed is beside it.
    pub beside: bool,
}

/// Rectangles over time, thinned evenly.
#[derive(Debug, Clone)]
struct Shots {
    kept: Vec<Shot>,
    last: Shot,
    seen: usize,
    every: usize,
    most: usize,
}

impl Shots {
    fn new(first: Shot, most: usize) -> Self {
        let mut new = Self { kept: Vec::new(), last: first, seen: 0, every: 1, most };
        new.push(first);
        new
    }

    fn push(&mut self, shot: Shot) {
        if self.seen.is_multiple_of(self.every) {
            self.kept.push(shot);
        }
        (self.last, self.seen) = (shot, self.seen + 1);
        if self.kept.len() > self.most {
            self.kept = self.kept.iter().step_by(2).copied().collect();
            self.every *= 2;
        }
    }

    fn first(&self) -> &Shot {
        &self.kept[0]
    }

    /// Evenly over time, the first and the last among them.
    fn all(&self) -> Vec<Shot> {
        let mut all = self.kept.clone();
        all.extend((all.last() != Some(&self.last)).then_some(self.last));
        all
    }

    /// The same as one that took in these too.
    fn joined(&self, other: &Self) -> Self {
        let mut all = [self.all(), other.all()].concat();
        all.sort_by_key(|shot| shot.frame);
        all.dedup_by_key(|shot| shot.frame);
        let mut joined = Self::new(all[0], self.most);
        all[1..].iter().for_each(|shot| joined.push(*shot));
        joined
    }
}

/// Where somebody was in the frames of a walk.
#[derive(Debug, Clone)]
pub(super) struct Trail {
    shots: Shots,
    /// The frame in which the walk was started, after its first ones: until then, its regions were those of a candidate.
    started: usize,
}

impl Trail {
    /// From the frames in order; `None` without any.
    pub fn new(mut shots: impl Iterator<Item = Shot>, started: usize) -> Option<Self> {
        let mut trail = Shots::new(shots.next()?, MOST_STEPS);
        shots.for_each(|shot| trail.push(shot));
        Some(Self { shots: trail, started })
    }

    /// The box at a time, extrapolated for up to [`GAP_S`].
    fn at(&self, time_s: f64) -> Option<Sides> {
        let (first, last) = (self.shots.first().time_s, self.shots.last.time_s);
        if time_s < first - GAP_S || time_s > last + GAP_S {
            return None;
        }
        let kept = &self.shots.kept;
        let next = kept.partition_point(|shot| shot.time_s <= time_s);
        let pair = match next {
            0 => [&kept[0], &kept[(kept.len() - 1).min(4)]],
            _ if next == kept.len() && time_s > last => {
                [&kept[kept.len().saturating_sub(5)], &self.shots.last]
            }
            _ if next == kept.len() => [&kept[next - 1], &self.shots.last],
            _ => [&kept[next - 1], &kept[next]],
        };
        let [a, b] = pair.map(|shot| (shot.time_s, shot.rectangle.sides(0.0)));
        let share = if b.0 > a.0 { (time_s - a.0) / (b.0 - a.0) } else { 0.0 };
        let between = |of: fn(&Sides) -> f64| of(&a.1) + share * (of(&b.1) - of(&a.1));
        if (0.0..=1.0).contains(&share) {
            let [left, top] = [between(|s| s.left), between(|s| s.top)];
            return Some(Sides { left, top, right: between(|s| s.right), bottom: between(|s| s.bottom) });
        }
        // Outside its time the box keeps its size: arms and legs swing.
        let near = if share < 0.0 { a.1 } else { b.1 };
        let moved = DVec2::new(
            0.5 * (between(|s| s.left) + between(|s| s.right) - near.left - near.right),
            0.5 * (between(|s| s.top) + between(|s| s.bottom) - near.top - near.bottom),
        );
        Some(shifted(&near, moved))
    }
}

/// Something that moves, from frame to frame.
#[derive(Debug, Clone)]
struct Thing {
    shots: Shots,
    velocity_px: DVec2,
    hindered: [usize; HINDRANCES.len()],
    beside: usize,
    /// Unhindered frames in a row up to the last one, and the most so far.
    in_a_row: usize,
    most_in_a_row: usize,
    /// Refused starts by reason, with the mean speed.
    refused: Vec<(usize, Reason)>,
}

impl Thing {
    fn new(shots: Shots) -> Self {
        Self {
            shots,
            velocity_px: DVec2::ZERO,
            hindered: [0; HINDRANCES.len()],
            beside: 0,
            in_a_row: 0,
            most_in_a_row: 0,
            refused: Vec::new(),
        }
    }

    fn expected(&self, time_s: f64) -> Sides {
        let last = &self.shots.last;
        shifted(&last.rectangle.sides(0.0), (time_s - last.time_s) * self.velocity_px)
    }

    /// How well a rectangle may be the next one; `None` if it is something else.
    fn likeness(&self, shot: &Shot) -> Option<f64> {
        let (expected, found) = (self.expected(shot.time_s), shot.rectangle.sides(0.0));
        let [overlap, shared] = [expected.overlap(&found), shared(&expected, &found)];
        let taller = (expected.bottom - expected.top) / (found.bottom - found.top);
        let is_alike = taller.max(taller.recip()) <= MOST_TALLER;
        (is_alike && (overlap >= LEAST_OVERLAP || shared >= LEAST_SHARED)).then_some(overlap)
    }

    fn add(&mut self, shot: Shot) {
        let last = self.shots.last;
        let moved = middle(&shot.rectangle) - middle(&last.rectangle);
        let elapsed_s = shot.time_s - last.time_s;
        self.velocity_px = self.velocity_px.lerp(moved / elapsed_s, NEW_VELOCITY);
        self.shots.push(shot);
    }

    /// Counts a frame, before its rectangle is added: a candidate begins anew where the rectangle jumps.
    fn count(&mut self, noticed: &Noticed) {
        if !same_person(&self.shots.last.rectangle, &noticed.rectangle) {
            self.in_a_row = 0;
        }
        self.beside += usize::from(noticed.beside);
        match noticed.hindrance {
            Some(hindrance) => {
                self.in_a_row = 0;
                let index = HINDRANCES.iter().position(|known| *known == hindrance);
                self.hindered[index.expect("all are listed")] += 1;
            }
            None => self.in_a_row += 1,
        }
        self.most_in_a_row = self.most_in_a_row.max(self.in_a_row);
    }

    fn refuse(&mut self, reason: Reason) {
        match self.refused.iter_mut().find(|known| discriminant(&known.1) == discriminant(&reason)) {
            Some((times, known)) => (*times, *known) = (*times + 1, known.with_another(&reason, *times)),
            None => self.refused.push((1, reason)),
        }
    }

    /// Takes in another thing that turned out to be the same.
    fn join(&mut self, other: &Self) {
        let seen = self.shots.seen.max(other.shots.seen);
        self.shots = self.shots.joined(&other.shots);
        self.shots.seen = seen.max(self.shots.seen);
        self.beside += other.beside;
        self.most_in_a_row = self.most_in_a_row.max(other.most_in_a_row);
        self.hindered.iter_mut().zip(other.hindered).for_each(|(own, more)| *own += more);
        for (times, reason) in &other.refused {
            (0..*times).for_each(|_| self.refuse(*reason));
        }
    }

    /// True if it belongs to somebody: while both are there, and shortly before and after, it is mostly in that person's
    /// box; as tall a region that is there all the time is somebody else, beside or behind.
    fn belongs_to(&self, trail: &Trail) -> bool {
        let (mut within, mut apart, mut tall) = (0, 0, 0);
        for shot in self.shots.all() {
            let Some(own) = trail.at(shot.time_s) else { continue };
            let margin = EXPLAINED * (own.bottom - own.top);
            let at = middle(&shot.rectangle);
            let is_within = (own.left - margin..=own.right + margin).contains(&at.x)
                && (own.top - margin..=own.bottom + margin).contains(&at.y);
            *(if is_within { &mut within } else { &mut apart }) += 1;
            let is_tall = shot.rectangle.height() as f64 >= AS_TALL * (own.bottom - own.top);
            let is_followed = (trail.started + 1..=trail.shots.last.frame).contains(&shot.frame);
            tall += usize::from(is_within && is_tall && is_followed);
        }
        // Of somebody who leaves the image, the part at its border is as tall.
        let is_cut_off = 2 * self.hindered[0] > self.shots.seen;
        let is_beside = 2 * tall > self.shots.all().len() && !is_cut_off;
        within > apart && !is_beside
    }

    /// True for what moves along, or could have started and did not. What is too small counts if it is upright, as a person
    /// far away is, and beside nobody who is followed, of whom it may be a part.
    fn is_notable(&self, start_frames: usize) -> bool {
        if self.shots.seen < LEAST_FRAMES {
            return false;
        }
        let all = self.shots.all();
        let [cut, small, wrong, crowded] = self.hindered;
        let [width_px, height_px] = [median(&all, |r| r.width()), median(&all, |r| r.height())];
        let is_beside = 2 * self.beside > self.shots.seen;
        if 2 * small > self.shots.seen && (height_px < width_px || is_beside) {
            return false;
        }
        let is_part = 2 * (small + wrong) > self.shots.seen;
        let size_px = if is_part { width_px.max(height_px) } else { width_px };
        let moved = moved_px(&all, 2 * cut > self.shots.seen) >= MOVED_SIZES * size_px;
        let is_odd = 2 * (small + wrong + crowded) > self.shots.seen;
        if is_odd { moved && self.shots.seen >= start_frames } else { moved || !self.refused.is_empty() }
    }

    fn reason(&self) -> Reason {
        let height_px = median(&self.shots.all(), |r| r.height());
        let small = Reason::TooSmall { height_px };
        let is_wide = median(&self.shots.all(), |r| r.width()) > WIDE * height_px;
        let refused = self.refused.iter().max_by_key(|(times, _)| *times).map(|(_, reason)| *reason);
        match refused {
            Some(Reason::NotWalking | Reason::TooSlow { .. }) if height_px < SMALLEST_PX => return small,
            Some(Reason::NotWalking) if is_wide => return Reason::TooWide,
            Some(Reason::NotWalking) if 2 * self.beside > self.shots.seen => return Reason::Beside,
            Some(reason) => return reason,
            None => {}
        }
        let (index, most) =
            (0..HINDRANCES.len()).map(|k| (k, self.hindered[k])).rev().max_by_key(|h| h.1).expect("some");
        let hindered: usize = self.hindered.iter().sum();
        if 2 * hindered > self.shots.seen && most > 0 {
            return match HINDRANCES[index] {
                Hindrance::CutOff => Reason::CutOff,
                Hindrance::Small => small,
                Hindrance::WrongSize => Reason::WrongSize,
                Hindrance::Crowded => Reason::Crowded,
            };
        }
        if 2 * self.beside > self.shots.seen {
            return Reason::Beside;
        }
        Reason::TooBrief { frames: self.most_in_a_row }
    }

    fn left_out(&self) -> LeftOut {
        let all = self.shots.all();
        let shown = all.len().min(MOST_SHOWN);
        let at = |k: usize| all[k * (all.len() - 1) / (shown - 1).max(1)];
        LeftOut { frames: self.shots.seen, shots: (0..shown).map(at).collect(), reason: self.reason() }
    }
}

/// Everything that moves and is not followed.
#[derive(Debug, Default)]
pub(super) struct Unfollowed {
    open: Vec<Thing>,
    closed: Vec<Thing>,
    trails: Vec<Trail>,
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
    pub fn followed(&mut self, trail: Trail) {
        self.trails.push(trail);
        let excess = self.trails.len().saturating_sub(MOST_TRAILS);
        self.trails.drain(..excess);
    }

    /// Notes a walk that was none after all.
    pub fn withdrawn(&mut self, trail: Trail, reason: Reason) {
        let mut own = self.open.extract_if(.., |thing| thing.belongs_to(&trail)).collect::<Vec<_>>();
        own.extend(self.closed.extract_if(.., |thing| thing.belongs_to(&trail)));
        let mut thing = Thing::new(Shots { most: MOST_SHOTS, ..trail.shots });
        own.iter().for_each(|other| thing.join(other));
        thing.refuse(reason);
        self.open.push(thing);
    }

    /// Decides on the things that are gone and whose walks have ended: `since_s` is when the first walk that goes on
    /// began, infinity if none does.
    pub fn settle(&mut self, since_s: f64, start_frames: usize) {
        let trails = &self.trails;
        let decided = self.closed.extract_if(.., |thing| thing.shots.last.time_s + GAP_S < since_s);
        let left = decided.filter(|thing| {
            thing.is_notable(start_frames) && !trails.iter().any(|trail| thing.belongs_to(trail))
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
        self.trails.retain(|trail| trail.shots.last.time_s + 2.0 * GAP_S >= first_s.min(since_s));
    }

    /// Ends the stream or the view, after the walks.
    pub fn finish(&mut self, start_frames: usize) {
        self.closed.append(&mut self.open);
        self.settle(f64::INFINITY, start_frames);
        self.trails.clear();
    }
}

fn forget_least(things: &mut Vec<Thing>, most: usize) {
    while things.len() > most {
        let least = (0..things.len()).min_by_key(|&k| things[k].shots.seen);
        least.into_iter().for_each(|k| drop(things.remove(k)));
    }
}

fn middle(r: &Rectangle) -> DVec2 {
    0.5 * DVec2::new((r.left + r.right) as f64, (r.top + r.bottom) as f64)
}

fn shifted(sides: &Sides, by: DVec2) -> Sides {
    Sides {
        left: sides.left + by.x,
        right: sides.right + by.x,
        top: sides.top + by.y,
        bottom: sides.bottom + by.y,
    }
}

/// Share of the smaller one that is in the other.
fn shared(a: &Sides, b: &Sides) -> f64 {
    let common = |low: f64, high: f64| (high - low).max(0.0);
    let [width, height] =
        [common(a.left.max(b.left), a.right.min(b.right)), common(a.top.max(b.top), a.bottom.min(b.bottom))];
    let area = |s: &Sides| (s.right - s.left) * (s.bottom - s.top);
    width * height / area(a).min(area(b))
}

/// How far something moved from the first to the last third of its time, pixels: both sides of its box, or its upper and its
/// lower side. A box that only grows has not moved, but at the border that cuts it off, one side stays.
fn moved_px(shots: &[Shot], is_cut: bool) -> f64 {
    let third = shots.len().div_ceil(3);
    let thirds = [&shots[..third], &shots[shots.len() - third..]];
    let by = |of: fn(&Rectangle) -> usize| {
        let mean = |shots: &[Shot]| shots.iter().map(|s| of(&s.rectangle) as f64).sum::<f64>() / third as f64;
        mean(thirds[1]) - mean(thirds[0])
    };
    let [left, right, top, bottom] = [by(|r| r.left), by(|r| r.right), by(|r| r.top), by(|r| r.bottom)];
    if is_cut {
        return 0.5 * (left + right).hypot(top + bottom);
    }
    let both = |a: f64, b: f64| if a * b > 0.0 { a.abs().min(b.abs()) } else { 0.0 };
    both(left, right).hypot(both(top, bottom))
}

fn median(shots: &[Shot], of: fn(&Rectangle) -> usize) -> f64 {
    let mut values: Vec<usize> = shots.iter().map(|shot| of(&shot.rectangle)).collect();
    values.sort_unstable();
    values[values.len() / 2] as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const START_FRAMES: usize = 13;

    fn boxed(left: usize, top: usize, width: usize, height: usize) -> Rectangle {
        Rectangle { left, top, right: left + width - 1, bottom: top + height - 1 }
    }

    /// A person of 200 px who walks by 4 px a frame.
    fn walking(frame: usize) -> Rectangle {
        boxed(20 + 4 * frame, 100, 60, 200)
    }

    fn shot(frame: usize, rectangle: Rectangle) -> Shot {
        Shot { frame, time_s: 0.04 * frame as f64, rectangle }
    }

    fn seen(rectangle: Rectangle) -> Noticed {
        Noticed { rectangle, hindrance: None, beside: false }
    }

    fn hindered(rectangle: Rectangle, hindrance: Hindrance) -> Noticed {
        Noticed { hindrance: Some(hindrance), ..seen(rectangle) }
    }

    /// Those who are left out of frames with these regions.
    fn left_out_of(frames: usize, regions: impl Fn(usize) -> Vec<Noticed>) -> Vec<LeftOut> {
        left_out_beside(frames, regions, None)
    }

    fn left_out_beside(
        frames: usize,
        regions: impl Fn(usize) -> Vec<Noticed>,
        trail: Option<Trail>,
    ) -> Vec<LeftOut> {
        let mut unfollowed = Unfollowed::default();
        for frame in 0..frames {
            unfollowed.notice(frame, 0.04 * frame as f64, &regions(frame));
        }
        trail.into_iter().for_each(|trail| unfollowed.followed(trail));
        unfollowed.finish(START_FRAMES);
        unfollowed.left_out()
    }

    /// The walk of [`walking`] in these frames, which started in its thirteenth.
    fn trail(frames: std::ops::Range<usize>) -> Trail {
        let started = frames.start + START_FRAMES - 1;
        Trail::new(frames.map(|frame| shot(frame, walking(frame))), started).unwrap()
    }

    fn reasons(left_out: &[LeftOut]) -> Vec<&'static str> {
        left_out.iter().map(|left| left.reason.name()).collect()
    }

    #[test]
    fn one_thing_is_one_entry_over_gaps_up_to_a_second() {
        for (gap, entries) in [(0, 1), (3, 1), (20, 1), (40, 2)] {
            let there = |frame: usize| !(30..30 + gap).contains(&frame);
            let found = left_out_of(90, |frame| {
                if there(frame) { vec![hindered(walking(frame), Hindrance::CutOff)] } else { vec![] }
            });
            assert_eq!(found.len(), entries, "{gap} frames");
            assert_eq!((found[0].first().frame, found.last().unwrap().last().frame), (0, 89));
            assert_eq!(found.iter().map(|left| left.frames).sum::<usize>(), 90 - gap);
            assert!(found.iter().all(|left| left.reason == Reason::CutOff && left.shots.len() == MOST_SHOWN));
        }
    }

    #[test]
    fn what_hinders_most_is_the_reason() {
        let of = |hindrance: Hindrance, rectangle: fn(usize) -> Rectangle| {
            reasons(&left_out_of(50, |frame| vec![hindered(rectangle(frame), hindrance)]))
        };
        assert_eq!(of(Hindrance::CutOff, walking), ["cut off"]);
        assert_eq!(of(Hindrance::Crowded, walking), ["too many"]);
        assert_eq!(of(Hindrance::WrongSize, walking), ["wrong size"]);
        assert_eq!(of(Hindrance::Small, |frame| boxed(2 * frame, 100, 8, 22)), ["too small"]);
        let brief = left_out_of(50, |frame| {
            let hindrance = (frame % 12 == 0).then_some(Hindrance::CutOff);
            vec![Noticed { hindrance, ..seen(walking(frame)) }]
        });
        assert_eq!(brief[0].reason, Reason::TooBrief { frames: 11 });
    }

    #[test]
    fn what_is_brief_or_does_not_move_is_nobody() {
        let cut_off = |rectangle: Rectangle| vec![hindered(rectangle, Hindrance::CutOff)];
        let brief = |frames: usize| {
            left_out_of(
                60,
                |frame| if frame < frames { cut_off(boxed(20 * frame, 9, 60, 200)) } else { vec![] },
            )
        };
        assert_eq!([LEAST_FRAMES - 1, LEAST_FRAMES].map(|frames| brief(frames).len()), [0, 1]);
        assert!(left_out_of(60, |_| cut_off(walking(0))).is_empty(), "it stays");
        let arm = |frame: usize| boxed(100 + 3 * (frame % 5), 100, 9, 40);
        assert!(left_out_of(60, |frame| vec![hindered(arm(frame), Hindrance::WrongSize)]).is_empty());
        let part = |frame: usize| boxed(3 * frame, 100, 8, 20);
        let small = |beside: bool| {
            left_out_of(60, |frame| vec![Noticed { beside, ..hindered(part(frame), Hindrance::Small) }]).len()
        };
        assert_eq!([small(false), small(true)], [1, 0], "beside somebody it may be a part of that person");
        let tape = |frame: usize| boxed(3 * frame, 100, 40, 8);
        assert!(left_out_of(60, |frame| vec![hindered(tape(frame), Hindrance::Small)]).is_empty());
    }

    #[test]
    fn who_is_refused_is_left_out_with_the_commonest_reason() {
        let mut unfollowed = Unfollowed::default();
        for frame in 0..40 {
            unfollowed.notice(frame, 0.04 * frame as f64, &[seen(walking(0))]);
            let speed_mps = if frame % 8 == 0 { 0.05 } else { 0.15 };
            let reason = if frame == 20 { Reason::WrongSize } else { Reason::TooSlow { speed_mps } };
            if frame >= 12 && frame.is_multiple_of(4) {
                unfollowed.refuse(frame, &walking(0), reason);
            }
        }
        unfollowed.refuse(39, &walking(30), Reason::NotWalking);
        unfollowed.finish(START_FRAMES);
        assert_eq!(unfollowed.count(), 1);
        let Reason::TooSlow { speed_mps } = unfollowed.left_out()[0].reason else { panic!() };
        // In frames 12, 16, 24, 28, 32 and 36.
        assert!((speed_mps - 0.1).abs() < 1e-9, "{speed_mps}");
    }

    #[test]
    fn what_does_not_walk_may_be_too_wide_too_small_or_beside_somebody() {
        let of = |width: usize, height: usize, beside: bool| {
            let mut unfollowed = Unfollowed::default();
            for frame in 0..30 {
                let rectangle = boxed(2 * frame, 100, width, height);
                unfollowed.notice(frame, 0.04 * frame as f64, &[Noticed { beside, ..seen(rectangle) }]);
                unfollowed.refuse(frame, &rectangle, Reason::NotWalking);
            }
            unfollowed.finish(START_FRAMES);
            unfollowed.left_out()[0].reason.name()
        };
        assert_eq!(of(60, 200, false), "not walking");
        assert_eq!(of(160, 200, false), "too wide");
        assert_eq!(of(60, 200, true), "beside somebody");
        assert_eq!([of(9, 29, false), of(9, 30, false)], ["too small", "not walking"]);
    }

    #[test]
    fn what_belongs_to_somebody_who_is_followed_is_not_left_out() {
        let walk = || Some(trail(30..60));
        let cut_off = |frame: usize| vec![hindered(walking(frame), Hindrance::CutOff)];
        let within = |frames: std::ops::Range<usize>| {
            let there = |frame: usize| if frames.contains(&frame) { cut_off(frame) } else { vec![] };
            left_out_beside(90, there, walk()).len()
        };
        assert_eq!(within(0..43), 0, "before the start, and the candidate of it");
        assert_eq!(within(60..90), 0, "after the end");
        assert_eq!(within(0..4), 0, "too brief");
        let shadow = |frame: usize| vec![hindered(boxed(25 + 4 * frame, 260, 90, 44), Hindrance::WrongSize)];
        assert!(left_out_beside(90, shadow, walk()).is_empty());
        assert_eq!(left_out_beside(90, shadow, None).len(), 1);
        let far = |frame: usize| vec![hindered(boxed(500 - 4 * frame, 100, 60, 200), Hindrance::CutOff)];
        assert_eq!(left_out_beside(90, far, walk()).len(), 1, "who walks the other way is somebody else");
        // The arm ahead of somebody who leaves the image, against the border.
        let leaving = |frame: usize| match frame {
            70..80 => vec![hindered(boxed(60 + 4 * frame, 110, 20, 180), Hindrance::CutOff)],
            _ => vec![],
        };
        assert!(left_out_beside(90, leaving, Some(trail(0..90))).is_empty());
        assert_eq!(left_out_beside(90, leaving, None).len(), 1);
        let beside =
            |frame: usize| vec![Noticed { beside: true, ..seen(boxed(50 + 4 * frame, 105, 40, 190)) }];
        let all_along = Some(trail(0..90));
        let found = left_out_beside(90, |frame| if frame >= 13 { beside(frame) } else { vec![] }, all_along);
        assert_eq!(reasons(&found), ["beside somebody"], "as tall as the one who is followed");
    }

    #[test]
    fn a_walk_that_was_none_is_left_out_with_what_was_seen_before_it() {
        let mut unfollowed = Unfollowed::default();
        for frame in 0..30 {
            unfollowed.notice(frame, 0.04 * frame as f64, &[hindered(walking(frame), Hindrance::CutOff)]);
        }
        unfollowed.withdrawn(trail(18..60), Reason::NotWalking);
        unfollowed.finish(START_FRAMES);
        let found = unfollowed.left_out();
        assert_eq!(reasons(&found), ["not walking"]);
        assert_eq!((found[0].first().frame, found[0].last().frame), (0, 59));
    }

    #[test]
    fn a_thing_waits_for_the_end_of_the_walks_of_its_time() {
        let mut unfollowed = Unfollowed::default();
        for frame in 0..80 {
            let there = if frame < 20 { vec![hindered(walking(frame), Hindrance::CutOff)] } else { vec![] };
            unfollowed.notice(frame, 0.04 * frame as f64, &there);
            unfollowed.settle(0.8, START_FRAMES);
        }
        assert_eq!(unfollowed.count(), 0, "a walk that began in frame 20 goes on");
        unfollowed.followed(trail(20..80));
        unfollowed.settle(f64::INFINITY, START_FRAMES);
        assert_eq!((unfollowed.count(), unfollowed.trails.len()), (0, 0));
    }

    #[test]
    fn a_trail_is_where_the_person_was_and_shortly_before_and_after() {
        let trail = trail(25..75);
        for frame in [1usize, 10, 25, 40, 74, 90, 99] {
            let at = trail.at(0.04 * frame as f64).unwrap();
            let true_box = walking(frame).sides(0.0);
            assert!(
                (at.left - true_box.left).abs() < 1e-6 && (at.right - true_box.right).abs() < 1e-6,
                "{frame}"
            );
        }
        assert!(trail.at(-0.1).is_none() && trail.at(0.04 * 101.0).is_none());
    }

    #[test]
    fn memory_is_bounded() {
        let mut unfollowed = Unfollowed::default();
        // For each third of a second, twenty things that cross the picture and one that never goes.
        for frame in 0..3000usize {
            let lane = |k: usize| boxed(6 * (frame % 60) + 3, 45 * k, 20, 40);
            let mut all: Vec<Noticed> = (0..20).map(|k| hindered(lane(k), Hindrance::CutOff)).collect();
            all.push(seen(boxed(600, 10, 30, 80)));
            let shown = if frame % 60 < 30 { &all[..] } else { &all[20..] };
            unfollowed.notice(frame, 0.04 * frame as f64, shown);
            unfollowed.settle(if frame < 2000 { 0.0 } else { f64::INFINITY }, START_FRAMES);
            if frame % 10 == 0 {
                unfollowed.followed(trail(frame..frame + 20));
            }
            assert!(unfollowed.open.len() <= MOST_THINGS && unfollowed.closed.len() <= MOST_CLOSED);
            assert!(unfollowed.trails.len() <= MOST_TRAILS && unfollowed.left_out.len() <= MOST_LEFT_OUT);
            assert!(unfollowed.open.iter().all(|thing| thing.shots.kept.len() <= MOST_SHOTS));
        }
        unfollowed.finish(START_FRAMES);
        assert!(unfollowed.count() > MOST_LEFT_OUT, "all are counted: {}", unfollowed.count());
    }

    proptest! {
        /// Things on lanes of their own are told apart: one entry each, from its first to its last frame.
        #[test]
        fn planted_things_are_found_once_each(
            planted in proptest::collection::vec((0usize..40, 20usize..60, 1usize..6, any::<bool>()), 1..7)
        ) {
            let rectangle = |k: usize, frame: usize| {
                let (first, _, speed, leftward) = planted[k];
                let moved = speed * (frame - first);
                boxed(if leftward { 700 - moved } else { 50 + moved }, 60 * k, 16, 50)
            };
            let found = left_out_of(120, |frame| {
                let there = |k: &usize| (planted[*k].0..planted[*k].0 + planted[*k].1).contains(&frame);
                let ks = (0..planted.len()).filter(there);
                ks.map(|k| hindered(rectangle(k, frame), Hindrance::CutOff)).collect()
            });
            prop_assert_eq!(found.len(), planted.len());
            for (k, (first, frames, ..)) in planted.iter().enumerate() {
                let own: Vec<_> = found.iter().filter(|left| left.first().rectangle.top == 60 * k).collect();
                prop_assert_eq!(own.len(), 1);
                prop_assert_eq!((own[0].first().frame, own[0].frames), (*first, *frames));
                prop_assert_eq!(own[0].last().rectangle, rectangle(k, first + frames - 1));
            }
        }
    }
}
