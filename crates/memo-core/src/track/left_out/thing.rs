//! A thing that moves, from frame to frame: where it was, what hinders a start on it, and whose it is.
//!
//! The constants say what is reported, not who is followed. They are chosen; how far they may be changed was not measured.

use super::super::decisions::EXPLAINED;
use super::super::locate::same_person;
use super::{GAP_S, LEAST_FRAMES, LeftOut, MOST_SHOTS, MOST_SHOWN, Reason, Shot};
use crate::estimate::median::median;
use crate::image::{Rectangle, Sides};
use glam::DVec2;
use std::mem::discriminant;

/// Rectangles kept of a walk, evenly over its time.
const MOST_STEPS: usize = 1024;
/// Below this height no limb is visible, pixels: as for [`GroupOptions::min_area`](crate::image::GroupOptions::min_area).
pub const SMALLEST_PX: f64 = 30.0;
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

/// What hinders a start in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hindrance {
    Small,
    CutOff,
    WrongSize,
    Crowded,
}

const HINDRANCES: [Hindrance; 4] =
    [Hindrance::CutOff, Hindrance::Small, Hindrance::WrongSize, Hindrance::Crowded];

/// A region that moves.
#[derive(Debug, Clone, Copy)]
pub struct Noticed {
    pub rectangle: Rectangle,
    pub hindrance: Option<Hindrance>,
    /// Whether somebody who is followed is beside it.
    pub beside: bool,
}

/// Rectangles over time, thinned evenly.
#[derive(Debug, Clone)]
pub struct Shots {
    pub kept: Vec<Shot>,
    pub last: Shot,
    pub seen: usize,
    every: usize,
    most: usize,
}

impl Shots {
    pub fn new(first: Shot, most: usize) -> Self {
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

    pub fn first(&self) -> &Shot {
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
        Self::thinned([self.all(), other.all()].concat(), self.most)
    }

    /// At most so many of these, of which there is one at least.
    fn thinned(mut all: Vec<Shot>, most: usize) -> Self {
        all.sort_by_key(|shot| shot.frame);
        all.dedup_by_key(|shot| shot.frame);
        let mut thinned = Self::new(all[0], most);
        all[1..].iter().for_each(|shot| thinned.push(*shot));
        thinned
    }
}

/// Where somebody was in the frames of a walk.
#[derive(Debug, Clone)]
pub struct WalkBoxes {
    pub shots: Shots,
    /// The first frame in which somebody else can be told from the person: until the walk is started, after its first
    /// frames, its regions are those of a candidate, and until its path is settled, they are what the average walker leaves.
    told_apart: usize,
}

impl WalkBoxes {
    /// From the frames in order, of a walk whose person is known after a frame, if at all; `None` without any.
    pub fn new(mut shots: impl Iterator<Item = Shot>, known: Option<usize>) -> Option<Self> {
        let mut walk_boxes = Shots::new(shots.next()?, MOST_STEPS);
        shots.for_each(|shot| walk_boxes.push(shot));
        let told_apart = known.map_or(usize::MAX, |frame| frame + 1);
        Some(Self { shots: walk_boxes, told_apart })
    }

    /// The box at a time, extrapolated for up to [`GAP_S`].
    pub fn at(&self, time_s: f64) -> Option<Sides> {
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
pub struct Thing {
    pub shots: Shots,
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
    pub fn new(shots: Shots) -> Self {
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

    /// What was followed in a walk that was none.
    pub fn of_walk(walk_boxes: &WalkBoxes) -> Self {
        let shots =
            Shots { seen: walk_boxes.shots.seen, ..Shots::thinned(walk_boxes.shots.all(), MOST_SHOTS) };
        Self::new(shots)
    }

    fn expected(&self, time_s: f64) -> Sides {
        let last = &self.shots.last;
        shifted(&last.rectangle.sides(0.0), (time_s - last.time_s) * self.velocity_px)
    }

    /// How well a rectangle may be the next one; `None` if it is something else.
    pub fn likeness(&self, shot: &Shot) -> Option<f64> {
        let (expected, found) = (self.expected(shot.time_s), shot.rectangle.sides(0.0));
        let [overlap, shared] = [expected.overlap(&found), expected.overlap_of_smaller(&found)];
        let taller = (expected.bottom - expected.top) / (found.bottom - found.top);
        let is_alike = taller.max(taller.recip()) <= MOST_TALLER;
        (is_alike && (overlap >= LEAST_OVERLAP || shared >= LEAST_SHARED)).then_some(overlap)
    }

    pub fn add(&mut self, shot: Shot) {
        let last = self.shots.last;
        let moved = middle(&shot.rectangle) - middle(&last.rectangle);
        let elapsed_s = shot.time_s - last.time_s;
        // Whose model is withdrawn in a frame may be seen again in the same one.
        if elapsed_s > 0.0 {
            self.velocity_px = self.velocity_px.lerp(moved / elapsed_s, NEW_VELOCITY);
        }
        self.shots.push(shot);
    }

    /// Counts a frame, before its rectangle is added: a candidate begins anew where the rectangle jumps.
    pub fn count(&mut self, noticed: &Noticed) {
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

    pub fn refuse(&mut self, reason: Reason) {
        match self.refused.iter_mut().find(|known| discriminant(&known.1) == discriminant(&reason)) {
            Some((times, known)) => (*times, *known) = (*times + 1, known.with_another(&reason, *times)),
            None => self.refused.push((1, reason)),
        }
    }

    /// Takes in another thing that turned out to be the same.
    pub fn join(&mut self, other: &Self) {
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
    pub fn belongs_to(&self, walk_boxes: &WalkBoxes) -> bool {
        let (mut within, mut apart, mut tall) = (0, 0, 0);
        for shot in self.shots.all() {
            let Some(own) = walk_boxes.at(shot.time_s) else { continue };
            let margin = EXPLAINED * (own.bottom - own.top);
            let at = middle(&shot.rectangle);
            let is_within = (own.left - margin..=own.right + margin).contains(&at.x)
                && (own.top - margin..=own.bottom + margin).contains(&at.y);
            *(if is_within { &mut within } else { &mut apart }) += 1;
            let is_tall = shot.rectangle.height() as f64 >= AS_TALL * (own.bottom - own.top);
            let is_followed = (walk_boxes.told_apart..=walk_boxes.shots.last.frame).contains(&shot.frame);
            tall += usize::from(is_within && is_tall && is_followed);
        }
        // Of somebody who leaves the image, the part at its border is as tall.
        let is_cut_off = 2 * self.hindered[0] > self.shots.seen;
        let is_beside = 2 * tall > self.shots.all().len() && !is_cut_off;
        within > apart && !is_beside
    }

    /// True for what moves along, or could have started and did not. What is too small counts if it is upright, as a person
    /// far away is, and beside nobody who is followed, of whom it may be a part.
    pub fn is_notable(&self, start_frames: usize) -> bool {
        if self.shots.seen < LEAST_FRAMES {
            return false;
        }
        let all = self.shots.all();
        let [cut, small, wrong, crowded] = self.hindered;
        let [width_px, height_px] = [usual(&all, |r| r.width()), usual(&all, |r| r.height())];
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
        let height_px = usual(&self.shots.all(), |r| r.height());
        let small = Reason::TooSmall { height_px };
        let is_wide = usual(&self.shots.all(), |r| r.width()) > WIDE * height_px;
        let refused = self.refused.iter().max_by_key(|(times, _)| *times).map(|(_, reason)| *reason);
        let fits_no_walk = matches!(refused, Some(Reason::NotWalking | Reason::OtherHeight { .. }));
        match refused {
            Some(Reason::TooSlow { .. }) if height_px < SMALLEST_PX => return small,
            Some(_) if fits_no_walk && height_px < SMALLEST_PX => return small,
            Some(_) if fits_no_walk && is_wide => return Reason::TooWide,
            Some(_) if fits_no_walk && 2 * self.beside > self.shots.seen => return Reason::Beside,
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

    pub fn left_out(&self) -> LeftOut {
        let all = self.shots.all();
        let shown = all.len().min(MOST_SHOWN);
        let at = |k: usize| all[k * (all.len() - 1) / (shown - 1).max(1)];
        LeftOut { frames: self.shots.seen, shots: (0..shown).map(at).collect(), reason: self.reason() }
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

/// The median of a side over the rectangles, of which there is one at least, pixels.
fn usual(shots: &[Shot], of: fn(&Rectangle) -> usize) -> f64 {
    let mut values: Vec<f64> = shots.iter().map(|shot| of(&shot.rectangle) as f64).collect();
    median(&mut values).unwrap_or(f64::NAN)
}
