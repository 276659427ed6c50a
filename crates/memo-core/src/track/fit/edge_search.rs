//! Where the picture shows an edge near a line of the model.
//!
//! An outer line separates the body from the background: there the difference from the background falls outwards
//! and the picture itself has a step. Shadows, reflections and edges of the room that the body covers have only one
//! of the two, so the geometric mean of both is searched. An inner line separates parts of the body: a step of grey
//! of either sign, and so is an outer line where the empty scene was never seen. No threshold decides;
//! the strongest step counts, the less the farther it is from the line.

use crate::image::Image;
use crate::image::frame::Between;
use crate::model::EllipticCylinder;
use glam::DVec2;

/// A piece of a frame and of the empty scene behind it.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Column and row of its first pixel in the image.
    pub corner: [usize; 2],
    /// The frame's grey values.
    pub grey: Image<u8>,
    /// Those of the empty scene, of the same size; `None` if it was never seen.
    pub background: Option<Image<u8>>,
    /// The bodies of other people near it.
    pub others: Vec<EllipticCylinder>,
    /// Row of the crown by the changes, pixels; `None` where they do not show the person alone.
    pub crown_px: Option<f64>,
}

/// What kind of line is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Border {
    /// Between body and background.
    Outer,
    /// Between parts of the body.
    Inner,
}

/// An edge found on the normal of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundEdge {
    /// Distance from the line, outwards positive, pixels.
    pub offset_px: f64,
    /// Height of the step, grey levels; 0 if there is none.
    pub strength: f64,
}

/// How far edges are searched on both sides of a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    /// What an edge counts by its distance in pixels: one at the line, e^-2 at the end.
    near: Vec<f64>,
}

impl Reach {
    /// Edges within `reach_px` pixels.
    pub fn new(reach_px: f64) -> Self {
        let near = |offset: i64| (-0.5 * (2.0 * offset as f64 / reach_px).powi(2)).exp();
        Self { near: (0..=reach_px.ceil() as i64).map(near).collect() }
    }
}

/// A step is the difference between the means of this many samples on either side, one pixel apart.
const SAMPLES: usize = 2;

impl View {
    /// The strongest and nearest edge within reach of a point, along a unit normal that points outwards; `None`
    /// if the normal leaves the piece.
    pub fn search(
        &self,
        point: DVec2,
        normal: DVec2,
        reach: &Reach,
        border: Border,
        samples: &mut Vec<[f64; 2]>,
    ) -> Option<FoundEdge> {
        let (near, reach) = (&reach.near, reach.near.len() as i64 - 1);
        let margin = SAMPLES as i64;
        let is_empty_seen = self.background.is_some();
        let corner = DVec2::new(self.corner[0] as f64, self.corner[1] as f64);
        samples.clear();
        for offset in -reach - margin..=reach + margin {
            samples.push(self.sample(point + normal * offset as f64 - corner)?);
        }
        let step = |offset: i64| {
            let at = (offset + reach + margin) as usize;
            let fall = |of: usize| {
                let inside: f64 = samples[at - SAMPLES..at].iter().map(|s| s[of]).sum();
                let outside: f64 = samples[at + 1..=at + SAMPLES].iter().map(|s| s[of]).sum();
                (inside - outside) / SAMPLES as f64
            };
            match border {
                Border::Outer if is_empty_seen => (fall(1).max(0.0) * fall(0).abs()).sqrt(),
                _ => fall(0).abs(),
            }
        };
        let mut best = (0.0, 0);
        for offset in -reach..=reach {
            let value = step(offset) * near[offset.unsigned_abs() as usize];
            if value > best.0 {
                best = (value, offset);
            }
        }
        let offset = best.1;
        let mut offset_px = offset as f64;
        if -reach < offset && offset < reach {
            // The vertex of the parabola through three steps.
            let (before, at, after) = (step(offset - 1), step(offset), step(offset + 1));
            let bend = before - 2.0 * at + after;
            if bend < 0.0 {
                offset_px += (0.5 * (before - after) / bend).clamp(-0.5, 0.5);
            }
        }
        Some(FoundEdge { offset_px, strength: if best.0 > 0.0 { step(offset) } else { 0.0 } })
    }

    /// Grey value, and absolute difference from the background, between pixels; `None` outside the piece.
    #[inline]
    fn sample(&self, p: DVec2) -> Option<[f64; 2]> {
        let width = self.grey.width();
        let place = Between::new(p, [width, self.grey.height()], width)?;
        let grey = place.of(self.grey.pixels());
        Some([grey, self.background.as_ref().map_or(0.0, |behind| (grey - place.of(behind.pixels())).abs())])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey 200 left of column 30.5, 100 right of it, before an empty scene of `behind`, of which columns 40 to 44
    /// have a stripe that the frame shows too.
    fn view(behind: u8) -> View {
        let mut grey = Image::filled(60, 40, 100u8);
        let mut background = Image::filled(60, 40, behind);
        for y in 0..40 {
            grey.row_mut(y)[..31].fill(200);
            grey.row_mut(y)[40..45].fill(20);
            background.row_mut(y)[40..45].fill(20);
        }
        View { corner: [100, 50], grey, background: Some(background), others: Vec::new(), crown_px: None }
    }

    fn found(view: &View, x: f64, border: Border) -> FoundEdge {
        view.search(DVec2::new(100.0 + x, 70.2), DVec2::X, &Reach::new(8.0), border, &mut Vec::new()).unwrap()
    }

    #[test]
    fn a_step_is_found_between_pixels() {
        for x in [28.0, 30.5, 33.2] {
            for border in [Border::Outer, Border::Inner] {
                let edge = found(&view(100), x, border);
                assert!((x + edge.offset_px - 30.5).abs() < 0.3, "{border:?}: {edge:?} from {x}");
                // Between pixels the step is blurred.
                assert!((85.0..=100.001).contains(&edge.strength), "{edge:?}");
            }
        }
    }

    #[test]
    fn an_edge_of_the_room_is_no_outline_of_the_body() {
        let empty = found(&view(100), 44.0, Border::Outer);
        assert_eq!(empty.strength, 0.0, "the room looks as it always does");
        assert!(found(&view(100), 44.0, Border::Inner).strength > 50.0);
        // Where the body is inside, the difference falls inwards.
        let inwards = view(100).search(
            DVec2::new(130.0, 70.0),
            -DVec2::X,
            &Reach::new(8.0),
            Border::Outer,
            &mut Vec::new(),
        );
        assert_eq!(inwards.unwrap().strength, 0.0);
    }

    #[test]
    fn where_the_empty_scene_was_never_seen_every_step_may_be_an_outline() {
        let alone = View { background: None, ..view(100) };
        for x in [28.0, 33.2] {
            let edge = found(&alone, x, Border::Outer);
            assert!((x + edge.offset_px - 30.5).abs() < 0.3, "{edge:?} from {x}");
        }
        assert!(found(&alone, 44.0, Border::Outer).strength > 50.0, "an edge of the room, too");
    }

    #[test]
    fn outside_the_piece_nothing_is_searched() {
        let view = view(100);
        for x in [104.0, 156.0, 90.0, f64::NAN] {
            assert!(
                view.search(DVec2::new(x, 70.0), DVec2::X, &Reach::new(8.0), Border::Inner, &mut Vec::new())
                    .is_none()
            );
        }
    }
}
