//! Where the picture shows an edge near a line of the model.
//!
//! An outer line separates the body from the background: there the difference from the background falls outwards
//! and the picture itself has a step. Shadows, reflections and edges of the room that the body covers have only one
//! of the two, so the geometric mean of both is searched. An inner line separates parts of the body: a step of grey
//! of either sign, and so is an outer line where the empty scene was never seen. No threshold decides;
//! the strongest step counts, the less the farther it is from the line.

use crate::image::Image;
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
    /// What an edge counts by its place from one end to the other, a pixel apart: one at the line, e^-2 at the ends.
    near: Vec<f32>,
}

impl Reach {
    /// Edges within `reach_px` pixels.
    pub fn new(reach_px: f64) -> Self {
        let near = |offset: i32| (-0.5 * (2.0 * f64::from(offset) / reach_px).powi(2)).exp() as f32;
        let most = reach_px.ceil() as i32;
        Self { near: (-most..=most).map(near).collect() }
    }
}

/// A step is the difference between the means of this many samples on either side, one pixel apart.
const SAMPLES: usize = 2;

const _: () = assert!(SAMPLES == 2, "the sums of a search are written out");
/// More than the rounding of a [`FixedPoint`].
const ROUNDING_PX: f64 = 1e-6;

/// Working memory of a search.
#[derive(Debug, Default)]
pub struct Profile {
    grey: Vec<f32>,
    /// Absolute difference from the empty scene.
    unlike: Vec<f32>,
    steps: Vec<f32>,
}

impl View {
    /// The strongest and nearest edge within reach of a point, along a unit normal that points outwards; `None`
    /// if the normal leaves the piece.
    pub fn search(
        &self,
        point: DVec2,
        normal: DVec2,
        reach: &Reach,
        border: Border,
        profile: &mut Profile,
    ) -> Option<FoundEdge> {
        let near = &reach.near[..];
        let middle = near.len() / 2;
        let background = self.background.as_ref().filter(|_| border == Border::Outer);
        // 1. The samples along the normal. They are inside if the first and the last are.
        let corner = DVec2::new(self.corner[0] as f64, self.corner[1] as f64);
        let most = (middle + SAMPLES) as f64;
        let ends = [-most, most].map(|offset| point + normal * offset - corner);
        let last = DVec2::new(self.grey.width() as f64, self.grey.height() as f64) - 1.0 - ROUNDING_PX;
        let is_inside = |end: &DVec2| end.cmpge(DVec2::splat(ROUNDING_PX)).all() && end.cmple(last).all();
        if !ends.iter().all(is_inside) {
            return None;
        }
        let places = FixedPoint::line(ends[0], normal);
        let (width, grey) = (self.grey.width(), self.grey.pixels());
        let count = near.len() + 2 * SAMPLES;
        profile.grey.resize(count, 0.0);
        match background {
            None => profile.grey.iter_mut().zip(places).for_each(|(at, place)| *at = place.of(grey, width)),
            Some(behind) => {
                debug_assert_eq!(behind.width(), width);
                let behind = &behind.pixels()[..grey.len()];
                profile.unlike.resize(count, 0.0);
                let profile = profile.grey.iter_mut().zip(&mut profile.unlike);
                for ((at, unlike), place) in profile.zip(places) {
                    *at = place.of(grey, width);
                    *unlike = (*at - place.of(behind, width)).abs();
                }
            }
        }
        // 2. The step at each of them.
        let fall = |w: &[f32]| (w[0] + w[1] - w[3] - w[4]) / SAMPLES as f32;
        let of_grey = profile.grey.windows(2 * SAMPLES + 1).map(fall);
        profile.steps.clear();
        if background.is_some() {
            let of_unlike = profile.unlike.windows(2 * SAMPLES + 1).map(fall);
            let both = of_grey.zip(of_unlike).map(|(grey, unlike)| (unlike.max(0.0) * grey.abs()).sqrt());
            profile.steps.extend(both);
        } else {
            profile.steps.extend(of_grey.map(f32::abs));
        }
        // 3. The strongest, the less the farther it is.
        let steps = &profile.steps[..];
        let mut best = (0.0, middle);
        for (n, (step, near)) in steps.iter().zip(near).enumerate() {
            if step * near > best.0 {
                best = (step * near, n);
            }
        }
        // 4. The vertex of the parabola through three steps.
        let n = best.1;
        let mut offset_px = n as f64 - middle as f64;
        if 0 < n && n + 1 < steps.len() {
            let [before, at, after] = [n - 1, n, n + 1].map(|n| f64::from(steps[n]));
            let bend = before - 2.0 * at + after;
            if bend < 0.0 {
                offset_px += (0.5 * (before - after) / bend).clamp(-0.5, 0.5);
            }
        }
        Some(FoundEdge { offset_px, strength: if best.0 > 0.0 { f64::from(steps[n]) } else { 0.0 } })
    }
}

/// A place between pixels, column and row in units of 2^-32 pixels: integers are faster to move and to split than
/// floating-point numbers.
#[derive(Clone, Copy)]
struct FixedPoint([i64; 2]);

impl FixedPoint {
    /// The places from the first on, one step apart.
    #[inline(always)]
    fn line(first: DVec2, step: DVec2) -> impl Iterator<Item = Self> {
        let fixed = |v: DVec2| [v.x, v.y].map(|x| (x * (1i64 << 32) as f64) as i64);
        let (first, step) = (fixed(first), fixed(step));
        (0..).map(move |n| Self([first[0] + n * step[0], first[1] + n * step[1]]))
    }

    /// The grey value there, linear along both axes, of an image whose rows have `width` pixels.
    #[inline(always)]
    fn of(self, pixels: &[u8], width: usize) -> f32 {
        let [x, y] = self.0.map(|x| (x >> 32) as usize);
        let [right, down] = self.0.map(|x| (x as u32 >> 8) as f32 / (1 << 24) as f32);
        let pair = |at: usize| {
            let pixels = &pixels[at..at + 2];
            [f32::from(pixels[0]), f32::from(pixels[1])]
        };
        let at = y * width + x;
        let ([a, b], [c, d]) = (pair(at), pair(at + width));
        let (above, below) = (a + right * (b - a), c + right * (d - c));
        above + down * (below - above)
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
        view.search(DVec2::new(100.0 + x, 70.2), DVec2::X, &Reach::new(8.0), border, &mut Profile::default())
            .unwrap()
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
            &mut Profile::default(),
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
    fn places_between_pixels_are_read_as_in_floating_point() {
        let mut image = Image::filled(7, 5, 0u8);
        for y in 0..5 {
            (0..7).for_each(|x| image.row_mut(y)[x] = ((31 * x + 57 * y) % 256) as u8);
        }
        let (first, step) = (DVec2::new(0.3, 3.9), DVec2::new(0.41, -0.29));
        for (n, place) in FixedPoint::line(first, step).take(14).enumerate() {
            let wanted = image.as_frame().between(first + step * n as f64).unwrap();
            let read = place.of(image.pixels(), image.width());
            assert!((f64::from(read) - wanted).abs() < 1e-4, "{n}: {read} against {wanted}");
        }
    }

    #[test]
    fn outside_the_piece_nothing_is_searched() {
        let view = view(100);
        for x in [104.0, 156.0, 90.0, f64::NAN] {
            assert!(
                view.search(
                    DVec2::new(x, 70.0),
                    DVec2::X,
                    &Reach::new(8.0),
                    Border::Inner,
                    &mut Profile::default()
                )
                .is_none()
            );
        }
    }
}
