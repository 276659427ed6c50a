//! The pictures that a fit needs: the frames around the person, and the empty scene.
//!
//! The empty scene is the median of frames spread evenly over the stream, where the person is not. Memory does not
//! grow with the stream: when there are too many frames, every second one is dropped.

use super::edge_search::View;
use crate::image::{Image, Mask, Rectangle};
use crate::model::EllipticCylinder;
use crate::track::locate::Sighting;
use rayon::prelude::*;
use std::ops::Range;

/// The empty scene is the median of half this many frames to this many.
const MOST_FRAMES: usize = 32;
/// Without the person the median needs this many frames.
const LEAST_EMPTY: usize = 5;

/// Frames spread evenly over a stream.
#[derive(Debug, Clone, Default)]
pub struct Backdrop {
    frames: Vec<Kept>,
    /// Only frames with a multiple of this number are kept.
    every: usize,
}

/// A frame of the stream and where people are in it.
#[derive(Debug, Clone)]
struct Kept {
    frame: usize,
    image: Image<u8>,
    /// The columns of each row that the frame shows, all if empty.
    shown: Vec<Range<usize>>,
    people: Vec<Rectangle>,
}

/// Part of a frame around the person.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Number of the frame.
    pub frame: usize,
    /// Where the person is.
    pub window: Rectangle,
    /// The part of the image that was kept.
    pub kept: Rectangle,
    /// Its grey values.
    pub grey: Image<u8>,
    /// The bodies of other people near it.
    pub others: Vec<EllipticCylinder>,
    /// Row of the crown by the changes, pixels; `None` where they do not show the person alone.
    pub crown_px: Option<f64>,
}

impl Piece {
    /// The part of a frame within a margin about a window.
    pub fn new(frame: usize, image: &Image<u8>, window: Rectangle, others: Vec<EllipticCylinder>) -> Self {
        let margin = (window.height() as f64 * MARGIN).ceil() as usize;
        let kept = Rectangle {
            left: window.left.saturating_sub(margin),
            top: window.top.saturating_sub(margin),
            right: (window.right + margin).min(image.width() - 1),
            bottom: (window.bottom + margin).min(image.height() - 1),
        };
        Self { frame, window, kept, grey: cut(image, &kept), others, crown_px: None }
    }

    /// The same with the row of the crown.
    pub fn with_crown(self, sighting: Option<&Sighting>) -> Self {
        Self { crown_px: sighting.map(Sighting::crown_px), ..self }
    }

    /// The piece before an empty scene that is as large as the frames.
    pub fn before(self, empty: &Image<u8>) -> View {
        let kept = self.kept;
        View {
            corner: [kept.left, kept.top],
            pixels: View::paired(&self.grey, |y| &empty.row(kept.top + y)[kept.left..=kept.right]),
            is_empty_known: true,
            others: self.others,
            crown_px: self.crown_px,
        }
    }
}

/// Margin about the window of the person, as a share of its height: edges are searched beyond the outline.
const MARGIN: f64 = 0.12;

fn cut(image: &Image<u8>, part: &Rectangle) -> Image<u8> {
    let mut out = Image::filled(part.width(), part.height(), 0);
    for y in 0..part.height() {
        out.row_mut(y).copy_from_slice(&image.row(part.top + y)[part.left..=part.right]);
    }
    out
}

impl Backdrop {
    /// Adds the next frame of the stream, with the pixels that it does not show.
    pub fn push(&mut self, frame: usize, image: &Image<u8>, unseen: Option<&Mask>) {
        let every = self.every.max(1);
        if !frame.is_multiple_of(every) {
            return;
        }
        let shown = unseen.map_or_else(Vec::new, shown_columns);
        self.frames.push(Kept { frame, image: image.clone(), shown, people: Vec::new() });
        if self.frames.len() > MOST_FRAMES {
            self.every = 2 * every;
            self.frames.retain(|kept| kept.frame.is_multiple_of(2 * every));
        }
    }

    /// Notes that somebody is in this part of a frame, which therefore does not show the empty scene.
    pub fn occupy(&mut self, frame: usize, window: Rectangle) {
        if let Some(kept) = self.frames.iter_mut().rev().find(|kept| kept.frame == frame) {
            kept.people.push(window);
        }
    }

    /// The pieces with the empty scene behind them.
    pub fn views<'a>(&self, pieces: impl Iterator<Item = &'a Piece>) -> Vec<View> {
        self.views_before(pieces, LEAST_EMPTY)
    }

    /// The same of somebody who never leaves a place: the empty scene is that of other frames in which nobody is there, and
    /// unknown if there are none. The head hardly moves, so changes do not show the crown.
    pub fn views_on_the_spot<'a>(&self, pieces: impl Iterator<Item = &'a Piece>) -> Vec<View> {
        let pieces: Vec<&Piece> = pieces.collect();
        let is_walk = |frame: usize| pieces.iter().any(|piece| piece.frame == frame);
        let place = pieces.iter().map(|piece| piece.kept).reduce(|a, b| a.union(&b));
        let is_free = |window: &Rectangle| place.is_none_or(|place| place.gap(window) != [0, 0]);
        if self.frames.iter().any(|kept| !is_walk(kept.frame) && kept.people.iter().all(is_free)) {
            let views = self.views_before(pieces.into_iter(), 1);
            return views.into_iter().map(|view| View { crown_px: None, ..view }).collect();
        }
        let alone = |p: &Piece| View {
            corner: [p.kept.left, p.kept.top],
            pixels: View::paired(&p.grey, |y| p.grey.row(y)),
            is_empty_known: false,
            others: p.others.clone(),
            crown_px: None,
        };
        pieces.into_iter().map(alone).collect()
    }

    fn views_before<'a>(&self, pieces: impl Iterator<Item = &'a Piece>, least: usize) -> Vec<View> {
        let pieces: Vec<&Piece> = pieces.collect();
        let Some(whole) = pieces.iter().map(|p| p.kept).reduce(|a, b| a.union(&b)) else { return Vec::new() };
        let rows: Vec<Vec<u8>> =
            (whole.top..=whole.bottom).into_par_iter().map(|y| self.empty_row(y, &whole, least)).collect();
        let behind = |piece: &Piece| {
            let kept = piece.kept;
            let columns = kept.left - whole.left..=kept.right - whole.left;
            let empty_row = |y: usize| &rows[kept.top - whole.top + y][columns.clone()];
            View {
                corner: [kept.left, kept.top],
                pixels: View::paired(&piece.grey, empty_row),
                is_empty_known: true,
                others: piece.others.clone(),
                crown_px: piece.crown_px,
            }
        };
        pieces.into_iter().map(behind).collect()
    }

    /// One row of the empty scene: the median of the frames in which people are elsewhere, or of all frames where
    /// these are too few.
    fn empty_row(&self, y: usize, whole: &Rectangle, least: usize) -> Vec<u8> {
        let rows: Vec<Part<'_>> = self.frames.iter().map(|kept| shown_part(kept, y, whole)).collect();
        let with_people = rows.iter().zip(&self.frames);
        let free: Vec<Part<'_>> =
            with_people.flat_map(|(row, kept)| free_parts(*row, y, whole.left, &kept.people)).collect();
        let (mut empty, counts) = medians(&free, whole.width());
        if counts.iter().any(|&count| usize::from(count) < least) {
            let of_all = medians(&rows, whole.width()).0;
            let few = empty.iter_mut().zip(&counts).zip(of_all);
            few.filter(|((_, count), _)| usize::from(**count) < least)
                .for_each(|((empty, _), all)| *empty = all);
        }
        empty
    }
}

/// Some columns of a row, from the first of them on.
type Part<'a> = (usize, &'a [u8]);

/// The columns of each row that a frame shows. A turned picture is convex, so they are next to each other.
fn shown_columns(unseen: &Mask) -> Vec<Range<usize>> {
    let columns = |y: usize| {
        let row = unseen.row(y);
        let first = row.iter().position(|unseen| !unseen).unwrap_or(row.len());
        first..row.iter().rposition(|unseen| !unseen).map_or(first, |last| last + 1)
    };
    (0..unseen.height()).map(columns).collect()
}

/// What a frame shows of a row within the columns of a rectangle.
fn shown_part<'a>(kept: &'a Kept, y: usize, whole: &Rectangle) -> Part<'a> {
    let row = kept.image.row(y);
    let shown = kept.shown.get(y).cloned().unwrap_or(0..row.len());
    let within = |x: usize| x.clamp(whole.left, whole.right + 1);
    let (from, to) = (within(shown.start), within(shown.end));
    (from - whole.left, &row[from..to])
}

/// The parts of some columns of a row in which nobody is; the first column of the whole row is `left`.
fn free_parts<'a>(row: Part<'a>, y: usize, left: usize, people: &[Rectangle]) -> Vec<Part<'a>> {
    let mut parts = vec![row];
    for window in people.iter().filter(|w| (w.top..=w.bottom).contains(&y)) {
        let [from, to] = [window.left, window.right + 1].map(|x| x.saturating_sub(left));
        let beside = |(start, columns): Part<'a>| {
            let end = start + columns.len();
            let at = |x: usize| x.clamp(start, end) - start;
            [(start, &columns[..at(from)]), (start + at(to), &columns[at(to)..])]
        };
        parts = parts.into_iter().flat_map(beside).filter(|(_, columns)| !columns.is_empty()).collect();
    }
    parts
}

/// The upper median of each column, 0 of one without values, and how many values it has, at most [`MOST_FRAMES`]. Bit by
/// bit: the largest value such that at most n / 2 of the n values are smaller.
fn medians(parts: &[Part<'_>], width: usize) -> (Vec<u8>, Vec<u8>) {
    let [mut median, mut below, mut counts] = std::array::from_fn(|_| vec![0u8; width]);
    for (start, columns) in parts {
        counts[*start..start + columns.len()].iter_mut().for_each(|count| *count += 1);
    }
    for bit in (0..8).rev() {
        below.fill(0);
        for (start, columns) in parts {
            let places = *start..start + columns.len();
            let known = &median[places.clone()];
            for ((below, &grey), &known) in below[places].iter_mut().zip(*columns).zip(known) {
                *below += u8::from(grey < known | 1 << bit);
            }
        }
        for ((known, &below), &count) in median.iter_mut().zip(&below).zip(&counts) {
            *known |= u8::from(count > 0 && below <= count / 2) << bit;
        }
    }
    (median, counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall of stripes, and a bright box of 20 columns that moves by 3 columns a frame from column 10.
    fn frame(k: usize) -> Image<u8> {
        let mut image = Image::filled(200, 60, 0u8);
        for y in 0..60 {
            image.row_mut(y).iter_mut().enumerate().for_each(|(x, v)| *v = (40 + 10 * (x / 8 % 3)) as u8);
            if (10..50).contains(&y) {
                image.row_mut(y)[10 + 3 * k..30 + 3 * k].fill(250);
            }
        }
        image
    }

    fn window(k: usize) -> Rectangle {
        Rectangle { left: 10 + 3 * k, top: 10, right: 29 + 3 * k, bottom: 49 }
    }

    #[test]
    fn a_view_has_the_crown_of_its_sighting() {
        let sighting = Sighting { time_s: 0.0, rectangle: window(3) };
        let piece = Piece::new(3, &frame(3), window(3), Vec::new());
        let seen = piece.clone().with_crown(Some(&sighting));
        for frames in [0, 4] {
            let mut backdrop = Backdrop::default();
            (0..frames).for_each(|k| backdrop.push(k, &frame(k), None));
            assert_eq!(backdrop.views([&seen].into_iter())[0].crown_px, Some(12.0));
            assert_eq!(backdrop.views_on_the_spot([&seen].into_iter())[0].crown_px, None);
        }
        assert_eq!(piece.clone().with_crown(None).before(&frame(0)).crown_px, None);
        assert_eq!(piece.with_crown(Some(&sighting)).before(&frame(0)).crown_px, Some(12.0));
    }

    #[test]
    fn behind_the_person_is_the_empty_scene() {
        for frames in [8, 50] {
            let mut backdrop = Backdrop::default();
            for k in 0..frames {
                backdrop.push(k, &frame(k), None);
                backdrop.occupy(k, window(k));
            }
            let pieces: Vec<Piece> =
                (0..frames).map(|k| Piece::new(k, &frame(k), window(k), Vec::new())).collect();
            let views = backdrop.views(pieces.iter());
            assert_eq!(views.len(), frames);
            let mut wrong = 0;
            for (view, piece) in views.iter().zip(&pieces) {
                assert_eq!((view.corner, view.is_empty_known), ([piece.kept.left, piece.kept.top], true));
                assert!(
                    view.pixels.pixels().iter().zip(piece.grey.pixels()).all(|(pair, grey)| pair[0] == *grey)
                );
                for y in 0..view.pixels.height() {
                    let expected = |x: usize| (40 + 10 * ((x + piece.kept.left) / 8 % 3)) as u8;
                    let row = view.pixels.row(y).iter().enumerate();
                    wrong += row.filter(|(x, pair)| pair[1] != expected(*x)).count();
                }
            }
            // In eight frames the box hardly leaves its place: columns that it always covers stay unknown.
            assert!(if frames == 50 { wrong == 0 } else { wrong > 0 }, "{frames}: {wrong}");
        }
    }

    /// Each pixel is the middle one of the sorted values of the frames without people there, or else of all.
    #[test]
    fn the_empty_scene_is_the_median_of_what_was_seen() {
        let value = |n: usize| ((7919 * n + 104_729) % 6_151 % 256) as u8;
        let image = |k: usize| {
            let pixels = (0..40 * 6).map(|n| value(n + 977 * k)).collect();
            Image::from_vec(40, 6, pixels).unwrap()
        };
        let of = |left, right, top| Rectangle { left, right, top, bottom: 4 };
        let people = |k: usize| match k % 3 {
            0 => vec![of(0, 9 + k, 0), of(5 + k, 30, 2)],
            1 => vec![of(3 * k, 3 * k + 9, 1), of(36, 39, 0)],
            _ => Vec::new(),
        };
        let whole = Rectangle { left: 3, right: 38, top: 0, bottom: 5 };
        for frames in [0, 1, 2, 9] {
            let mut backdrop = Backdrop::default();
            for k in 0..frames {
                backdrop.push(k, &image(k), None);
                people(k).into_iter().for_each(|window| backdrop.occupy(k, window));
            }
            for (y, least) in (0..6).flat_map(|y| [(y, 1), (y, 5)]) {
                let row = backdrop.empty_row(y, &whole, least);
                for x in whole.left..=whole.right {
                    let is_in =
                        |w: &Rectangle| (w.left..=w.right).contains(&x) && (w.top..=w.bottom).contains(&y);
                    let free = (0..frames).filter(|&k| !people(k).iter().any(is_in));
                    let mut values: Vec<u8> = free.map(|k| image(k).row(y)[x]).collect();
                    if values.len() < least {
                        values = (0..frames).map(|k| image(k).row(y)[x]).collect();
                    }
                    values.sort_unstable();
                    let wanted = values.get(values.len() / 2).copied().unwrap_or(0);
                    assert_eq!(row[x - whole.left], wanted, "{frames} frames, {x} {y}, {least}");
                }
            }
        }
    }

    /// A frame that does not show a pixel has no say there.
    #[test]
    fn the_empty_scene_is_that_of_the_frames_that_show_it() {
        let mut backdrop = Backdrop::default();
        for k in 0..9 {
            let mut unseen = Image::filled(200, 60, false);
            (0..60).for_each(|y| unseen.row_mut(y)[20 * k + 40..].fill(true));
            let mut seen = frame(k);
            (0..60).for_each(|y| seen.row_mut(y)[20 * k + 40..].fill(7));
            backdrop.push(k, &seen, Some(&unseen));
            backdrop.occupy(k, window(k));
        }
        let whole = Rectangle { left: 0, right: 199, top: 0, bottom: 59 };
        let row = backdrop.empty_row(30, &whole, 1);
        assert!((0..200).all(|x| usize::from(row[x]) == 40 + 10 * (x / 8 % 3)), "{row:?}");
    }

    #[test]
    fn behind_somebody_who_stays_is_what_was_seen_before_or_nothing() {
        let mut backdrop = Backdrop::default();
        (0..8).for_each(|k| backdrop.push(k, &frame(k), None));
        let place = window(2).union(&window(7));
        (2..8).for_each(|k| backdrop.occupy(k, place));
        let walk: Vec<Piece> = (2..8).map(|k| Piece::new(k, &frame(k), place, Vec::new())).collect();
        let views = backdrop.views_on_the_spot(walk.iter());
        assert!(views.iter().all(|view| view.is_empty_known));
        // The two frames before the walk show the box farther left; right of it the scene is empty.
        let View { pixels, corner, .. } = &views[0];
        let grey = |x: usize| (40 + 10 * (x / 8 % 3)) as u8;
        assert!((40..50).all(|x| pixels.row(20 - corner[1])[x - corner[0]][1] == grey(x)));
        let mut always = Backdrop::default();
        (2..8).for_each(|k| always.push(k, &frame(k), None));
        let views = always.views_on_the_spot(walk.iter());
        assert!(views.len() == 6 && views.iter().all(|view| !view.is_empty_known));
        // Nor do frames of an earlier walk in the same place show the scene behind it.
        let mut earlier = Backdrop::default();
        (0..8).for_each(|k| earlier.push(k, &frame(k), None));
        (0..8).for_each(|k| earlier.occupy(k, place));
        assert!(earlier.views_on_the_spot(walk.iter()).iter().all(|view| !view.is_empty_known));
        assert!(
            views[3].pixels.pixels().iter().zip(walk[3].grey.pixels()).all(|(pair, grey)| pair[0] == *grey)
        );
    }

    #[test]
    fn frames_of_a_long_stream_are_thinned_evenly() {
        let mut backdrop = Backdrop::default();
        (0..1000).for_each(|k| backdrop.push(k, &Image::filled(2, 2, 0), None));
        let kept: Vec<usize> = backdrop.frames.iter().map(|f| f.frame).collect();
        assert!((MOST_FRAMES / 2..=MOST_FRAMES).contains(&kept.len()), "{}", kept.len());
        assert!(kept.windows(2).all(|w| w[1] - w[0] == backdrop.every), "{kept:?}");
        assert!(*kept.last().unwrap() + backdrop.every >= 1000 && kept[0] == 0);
    }

    #[test]
    fn pieces_stay_within_the_image() {
        let piece =
            Piece::new(3, &frame(0), Rectangle { left: 0, top: 2, right: 199, bottom: 59 }, Vec::new());
        assert_eq!((piece.kept.left, piece.kept.top, piece.kept.right, piece.kept.bottom), (0, 0, 199, 59));
        assert!(Backdrop::default().views([].iter()).is_empty());
    }
}
