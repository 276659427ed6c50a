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
    /// Grey values of the frame and of the empty scene, side by side because they are read together.
    pub pixels: Image<[u8; 2]>,
    /// False if the empty scene was never seen.
    pub is_empty_known: bool,
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
    /// The four pixels about each sample, two in a row, and where it lies between them.
    pixels: [Vec<u32>; 2],
    between: [Vec<u32>; 2],
    grey: Vec<f32>,
    /// Absolute difference from the empty scene.
    unlike: Vec<f32>,
    steps: Vec<f32>,
}

impl View {
    /// The grey values of a piece beside those of the empty scene, of which the same part of a row is given.
    pub fn paired<'a>(grey: &Image<u8>, empty_row: impl Fn(usize) -> &'a [u8]) -> Image<[u8; 2]> {
        let mut pixels = Image::filled(grey.width(), grey.height(), [0; 2]);
        for y in 0..grey.height() {
            let both = grey.row(y).iter().zip(empty_row(y));
            pixels.row_mut(y).iter_mut().zip(both).for_each(|(pair, (&grey, &empty))| *pair = [grey, empty]);
        }
        pixels
    }

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
        // 1. The samples along the normal. They are inside if the first and the last are.
        let corner = DVec2::new(self.corner[0] as f64, self.corner[1] as f64);
        let most = (middle + SAMPLES) as f64;
        let ends = [-most, most].map(|offset| point + normal * offset - corner);
        let last = DVec2::new(self.pixels.width() as f64, self.pixels.height() as f64) - 1.0 - ROUNDING_PX;
        let is_inside = |end: &DVec2| end.cmpge(DVec2::splat(ROUNDING_PX)).all() && end.cmple(last).all();
        if !ends.iter().all(is_inside) {
            return None;
        }
        profile.read(&self.pixels, ends[0], normal, near.len() + 2 * SAMPLES);
        // 2. The step at each of them.
        let (grey, unlike) = (&profile.grey[..], &profile.unlike[..]);
        let fall = |w: &[f32]| (w[0] + w[1] - w[3] - w[4]) / SAMPLES as f32;
        let of_grey = grey.windows(2 * SAMPLES + 1).map(|w| fall(w).abs());
        profile.steps.resize(near.len(), 0.0);
        let steps = &mut profile.steps[..];
        if self.is_empty_known && border == Border::Outer {
            let both = of_grey.zip(unlike.windows(2 * SAMPLES + 1));
            steps.iter_mut().zip(both).for_each(|(step, (grey, w))| *step = (fall(w).max(0.0) * grey).sqrt());
        } else {
            steps.iter_mut().zip(of_grey).for_each(|(step, grey)| *step = grey);
        }
        // 3. The strongest, the less the farther it is.
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

impl Profile {
    /// The samples from a point inside the pixels on, one step apart. Loads come before arithmetic, which the compiler
    /// vectorises without them.
    fn read(&mut self, pixels: &Image<[u8; 2]>, first: DVec2, step: DVec2, count: usize) {
        self.pixels.iter_mut().chain(&mut self.between).for_each(|words| words.resize(count, 0));
        [&mut self.grey, &mut self.unlike].into_iter().for_each(|samples| samples.resize(count, 0.0));
        let (width, pixels) = (pixels.width(), pixels.pixels());
        let [above, below] = self.pixels.each_mut().map(|words| &mut words[..count]);
        let [right, down] = self.between.each_mut().map(|words| &mut words[..count]);
        // Columns and rows in units of 2^-32 pixels: integers are faster to move and to split than floating-point numbers.
        let fixed = |v: DVec2| [v.x, v.y].map(|x| (x * (1i64 << 32) as f64) as i64);
        let ([x0, y0], [dx, dy]) = (fixed(first), fixed(step));
        let pair = |at: usize| {
            let pixels = &pixels[at..at + 2];
            let ([a, b], [c, d]) = (pixels[0], pixels[1]);
            u32::from_le_bytes([a, b, c, d])
        };
        for n in 0..count {
            let (x, y) = (x0 + n as i64 * dx, y0 + n as i64 * dy);
            let at = (y >> 32) as usize * width + (x >> 32) as usize;
            (above[n], below[n]) = (pair(at), pair(at + width));
            (right[n], down[n]) = (x as u32, y as u32);
        }
        // Linear along both axes.
        let (grey, unlike) = (&mut self.grey[..count], &mut self.unlike[..count]);
        for n in 0..count {
            let share = |word: u32| (word >> 8) as i32 as f32 / (1 << 24) as f32;
            let byte = |word: u32, n: u32| (word >> (8 * n) & 0xff) as i32 as f32;
            let (right, down) = (share(right[n]), share(down[n]));
            let value = |of: u32| {
                let across = |word: u32| {
                    let (left, after) = (byte(word, of), byte(word, of + 2));
                    left + right * (after - left)
                };
                let (above, below) = (across(above[n]), across(below[n]));
                above + down * (below - above)
            };
            let (seen, behind) = (value(0), value(1));
            grey[n] = seen;
            unlike[n] = (seen - behind).abs();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey 200 left of column 30.5, 100 right of it, before an empty scene of `behind`, of which columns 40 to 44
    /// have a stripe that the frame shows too.
    fn view(behind: u8) -> View {
        let mut pixels = Image::filled(60, 40, [100, behind]);
        for y in 0..40 {
            pixels.row_mut(y)[..31].fill([200, behind]);
            pixels.row_mut(y)[40..45].fill([20, 20]);
        }
        View { corner: [100, 50], pixels, is_empty_known: true, others: Vec::new(), crown_px: None }
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
        let alone = View { is_empty_known: false, ..view(100) };
        for x in [28.0, 33.2] {
            let edge = found(&alone, x, Border::Outer);
            assert!((x + edge.offset_px - 30.5).abs() < 0.3, "{edge:?} from {x}");
        }
        assert!(found(&alone, 44.0, Border::Outer).strength > 50.0, "an edge of the room, too");
    }

    #[test]
    fn places_between_pixels_are_read_as_in_floating_point() {
        let mut pixels = Image::filled(7, 5, [0u8; 2]);
        for y in 0..5 {
            (0..7).for_each(|x| pixels.row_mut(y)[x] = [31, 83].map(|k| ((k * x + 57 * y) % 256) as u8));
        }
        let [grey, empty] = [0, 1].map(|k| {
            let mut image = Image::filled(7, 5, 0u8);
            (0..5).for_each(|y| (0..7).for_each(|x| image.row_mut(y)[x] = pixels.row(y)[x][k]));
            image
        });
        let (first, step) = (DVec2::new(0.3, 3.9), DVec2::new(0.41, -0.29));
        let mut profile = Profile::default();
        profile.read(&pixels, first, step, 14);
        for n in 0..14 {
            let [seen, behind] =
                [&grey, &empty].map(|image| image.as_frame().between(first + step * n as f64).unwrap());
            let (read, unlike) = (f64::from(profile.grey[n]), f64::from(profile.unlike[n]));
            assert!((read - seen).abs() < 1e-4, "{n}: {read} against {seen}");
            assert!((unlike - (seen - behind).abs()).abs() < 1e-4, "{n}: {unlike} against {seen}, {behind}");
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
