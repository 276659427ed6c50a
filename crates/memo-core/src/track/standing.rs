//! What stays in one place: its frames, until it walks on the spot, along the line of sight, or off.

use super::fit::views::Piece;
use super::locate::Sighting;
use super::rate::{lasting, mean_interval_s};
use super::walk::FrameEdges;
use crate::image::Rectangle;
use std::collections::BTreeMap;

/// What stays is forgotten after this many consecutive frames without it.
const MISSED_FRAMES: usize = 3;
/// What changes where the thing was in so many last frames is the thing, at the usual rate.
const RECENT_FRAMES: usize = 12;

/// Frames in which something stays in one place.
#[derive(Debug, Clone, Default)]
pub(super) struct Standing {
    pub(super) kept: Vec<(Option<Sighting>, FrameEdges)>,
    pub(super) pieces: Vec<Piece>,
    /// By frame, the rectangles of all changes, which reach down to feet that hardly move.
    pub(super) feet: BTreeMap<usize, Sighting>,
}

impl Standing {
    /// The part of the image that the thing covered so far, with this rectangle; `None` if there is none.
    pub(super) fn window(&self, rectangle: Option<&Rectangle>) -> Option<Rectangle> {
        let before = self.sightings().iter().map(|s| s.rectangle).reduce(|a, b| a.union(&b));
        match (before, rectangle) {
            (Some(before), Some(rectangle)) if before.gap(rectangle) == [0, 0] => {
                Some(before.union(rectangle))
            }
            (_, Some(rectangle)) => Some(*rectangle),
            (before, None) => before,
        }
    }

    /// These frames and the next; frames of something elsewhere, or of something that was gone or followed meanwhile, are
    /// dropped.
    pub(super) fn with(
        self,
        sighting: Option<Sighting>,
        feet: Option<Sighting>,
        edges: FrameEdges,
        piece: Option<Piece>,
    ) -> Self {
        let most_missed = self.most_missed();
        let is_there = |k: &(Option<Sighting>, FrameEdges)| k.0.is_some();
        let missed = self.kept.iter().rev().take_while(|k| !is_there(k)).count();
        let is_left = self.kept.last().is_some_and(|(_, last)| last.frame + most_missed < edges.frame);
        let is_gone = missed >= most_missed || is_left;
        let is_elsewhere = self.kept.last().is_some_and(|(_, last)| last.window.gap(&edges.window) != [0, 0]);
        let mut standing = if is_gone || is_elsewhere { Self::default() } else { self };
        standing.feet.extend(feet.map(|feet| (edges.frame, feet)));
        standing.kept.push((sighting, edges));
        standing.pieces.extend(piece);
        standing
    }

    /// How much of a rectangle is where the thing was last seen; `None` if it is elsewhere. Of somebody who comes nearer, now
    /// this and now that part changes.
    pub(super) fn overlap(&self, rectangle: &Rectangle) -> Option<f64> {
        let last = last_rectangle(&self.kept)?;
        let recent = self.kept.iter().rev().take(lasting(RECENT_FRAMES, self.every_s()));
        let seen = recent.filter_map(|(sighting, _)| Some(sighting.as_ref()?.rectangle));
        let lately = seen.fold(last, |all, one| all.union(&one));
        (lately.gap(rectangle) == [0, 0]).then(|| last.sides(0.0).overlap(&rectangle.sides(0.0)))
    }

    /// True if it was not seen in too many frames before this one.
    pub(super) fn is_gone(&self, frame: usize) -> bool {
        let seen = self.kept.iter().rev().find(|(sighting, _)| sighting.is_some());
        seen.is_none_or(|(_, edges)| edges.frame + self.most_missed() < frame)
    }

    fn most_missed(&self) -> usize {
        lasting(MISSED_FRAMES, self.every_s())
    }

    /// Mean time from frame to frame, seconds.
    pub(super) fn every_s(&self) -> f64 {
        mean_interval_s(self.kept.iter().map(|(_, edges)| edges.time_s))
    }

    /// Time from the first frame to the last, seconds.
    pub(super) fn lasts_s(&self) -> f64 {
        let ends = self.kept.first().zip(self.kept.last());
        ends.map_or(0.0, |((_, first), (_, last))| last.time_s - first.time_s)
    }

    /// Without the first frames.
    pub(super) fn later(mut self, count: usize) -> Self {
        self.kept.drain(..count.min(self.kept.len()));
        self.pieces.drain(..count.min(self.pieces.len()));
        let first = self.kept.first().map_or(usize::MAX, |(_, edges)| edges.frame);
        self.feet.retain(|frame, _| *frame >= first);
        self
    }

    /// Without the frames from this one on; nothing if they do not lead to it.
    pub(super) fn before(mut self, frame: usize) -> Self {
        self.kept.retain(|(_, edges)| edges.frame < frame);
        self.pieces.retain(|piece| piece.frame < frame);
        self.feet.retain(|seen, _| *seen < frame);
        let most_missed = self.most_missed();
        let is_left = self.kept.last().is_none_or(|(_, edges)| edges.frame + most_missed < frame);
        if is_left { Self::default() } else { self }
    }

    /// The frames of a walk with their pieces and feet, and those before and in between that the walk does not have.
    pub(super) fn followed_by(
        mut self,
        kept: &[(Option<Sighting>, FrameEdges)],
        pieces: &[Piece],
        feet: &BTreeMap<usize, Sighting>,
    ) -> Self {
        let last = kept.last().map_or(usize::MAX, |(_, edges)| edges.frame);
        let is_new = |frame: usize| frame < last && kept.iter().all(|(_, edges)| edges.frame != frame);
        self.kept.retain(|(_, edges)| is_new(edges.frame));
        self.pieces.retain(|piece| is_new(piece.frame));
        self.kept.extend_from_slice(kept);
        self.pieces.extend_from_slice(pieces);
        self.feet.extend(feet);
        self.kept.sort_by_key(|(_, edges)| edges.frame);
        self.pieces.sort_by_key(|piece| piece.frame);
        self
    }

    /// The rectangles.
    pub(super) fn sightings(&self) -> Vec<Sighting> {
        self.kept.iter().filter_map(|(sighting, _)| *sighting).collect()
    }
}

/// Where the latest of some frames show the thing.
pub(super) fn last_rectangle(kept: &[(Option<Sighting>, FrameEdges)]) -> Option<Rectangle> {
    kept.iter().rev().find_map(|(sighting, _)| Some(sighting.as_ref()?.rectangle))
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::WINDOW;
    use super::*;

    /// The frames that are kept after these, each with the thing in it or not.
    fn kept(frames: impl IntoIterator<Item = (usize, bool)>) -> Vec<usize> {
        let sighting = Sighting { time_s: 0.0, rectangle: WINDOW };
        let next = |standing: Standing, (frame, is_there): (usize, bool)| {
            let edges = FrameEdges::of_one_alone(frame, 0.04 * frame as f64, WINDOW, Vec::new());
            standing.with(is_there.then_some(sighting), None, edges, None)
        };
        let standing = frames.into_iter().fold(Standing::default(), next);
        standing.kept.iter().map(|(_, edges)| edges.frame).collect()
    }

    #[test]
    fn a_part_belongs_to_what_was_there_lately() {
        let Rectangle { left, right, .. } = WINDOW;
        let [head, legs] = [(10, 30), (120, 180)].map(|(top, bottom)| Rectangle { left, top, right, bottom });
        let frame = |standing: Standing, number: usize| {
            let rectangle = if number == 0 { head.union(&legs) } else { legs };
            let time_s = 0.04 * number as f64;
            let edges = FrameEdges::of_one_alone(number, time_s, head.union(&legs), Vec::new());
            standing.with(Some(Sighting { time_s, rectangle }), None, edges, None)
        };
        let seen = |frames: usize| (0..frames).fold(Standing::default(), frame).overlap(&head);
        assert_eq!(
            [seen(1).map(|overlap| overlap > 0.0), seen(5).map(|o| o > 0.0)],
            [Some(true), Some(false)]
        );
        assert_eq!(seen(13), None, "too long ago");
    }

    #[test]
    fn frames_from_before_a_gap_are_dropped() {
        let there = |frames: std::ops::Range<usize>| frames.map(|frame| (frame, true));
        assert_eq!(kept(there(0..3).chain(there(5..7))), [0, 1, 2, 5, 6]);
        assert_eq!(kept(there(0..3).chain(there(6..8))), [6, 7], "a walk was followed meanwhile");
        let gone = (3..6).map(|frame| (frame, false));
        assert_eq!(kept(there(0..3).chain(gone).chain(there(6..8))), [6, 7], "the thing was gone");
    }
}
