//! Where the picture shows an edge near a line of the model.
//!
//! An outer line separates the body from the background: there the difference from the background falls outwards
//! and the picture itself has a step. Shadows, reflections and edges of the room that the body covers have only one
//! of the two, so the geometric mean of both is searched. An inner line separates parts of the body: a step of grey
//! of either sign, and so is an outer line where the empty scene was never seen. No threshold decides;
//! the strongest step counts, the less the farther it is from the line.
//!
//! Beyond an outline the scene is as empty as elsewhere. Inside the body it may look like the background along a whole limb,
//! of which one side is lit and the other is not: there the difference falls too, and rises again beyond. So steps count
//! less the more the picture differs from the empty scene a little farther out. In clothes that hardly differ from the background this
//! decides between the sides of a limb and the lines on it.

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
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Border {
    /// Between body and background.
    Outer {
        /// A step is chosen as if it were half as high where the picture beyond it differs by this from the empty scene, grey
        /// levels.
        body_level: f32,
    },
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
    /// Pixels from an edge to where the background is beyond it.
    beyond: usize,
}

impl Reach {
    /// Edges within `reach_px` pixels, with the background `beyond_px` pixels outside of them.
    pub fn new(reach_px: f64, beyond_px: f64) -> Self {
        let near = |offset: i32| (-0.5 * (2.0 * f64::from(offset) / reach_px).powi(2)).exp() as f32;
        let most = reach_px.ceil() as i32;
        Self {
            near: (-most..=most).map(near).collect(),
            beyond: (beyond_px.round() as usize).max(SAMPLES + 1),
        }
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
    /// The same as they are chosen.
    chosen_by: Vec<f32>,
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

    /// The difference from the empty scene in the pixel of a point, grey levels; `None` outside of the piece, or if the empty
    /// scene was never seen.
    pub fn unlike_at(&self, point: DVec2) -> Option<f64> {
        let at = (point - DVec2::new(self.corner[0] as f64, self.corner[1] as f64)).round();
        let size = DVec2::new(self.pixels.width() as f64, self.pixels.height() as f64);
        let is_shown = self.is_empty_known && at.cmpge(DVec2::ZERO).all() && at.cmplt(size).all();
        let [seen, behind] = is_shown.then(|| self.pixels.row(at.y as usize)[at.x as usize])?;
        Some(f64::from(seen.abs_diff(behind)))
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
        // 1. The samples along the normal. They are inside if the first and the last are; what is beyond an outline may be outside.
        let corner = DVec2::new(self.corner[0] as f64, self.corner[1] as f64);
        let last = DVec2::new(self.pixels.width() as f64, self.pixels.height() as f64) - 1.0 - ROUNDING_PX;
        let at = |offset: usize| point + normal * (offset as f64 - (middle + SAMPLES) as f64) - corner;
        let is_inside = |offset: usize| {
            let at = at(offset);
            at.cmpge(DVec2::splat(ROUNDING_PX)).all() && at.cmple(last).all()
        };
        let count = near.len() + 2 * SAMPLES;
        if !is_inside(0) || !is_inside(count - 1) {
            return None;
        }
        let outline = match border {
            Border::Outer { body_level } if self.is_empty_known => Some(body_level),
            _ => None,
        };
        let wanted = count + outline.map_or(0, |_| reach.beyond - SAMPLES);
        let read = (count..=wanted).rev().find(|read| is_inside(read - 1)).unwrap_or(count);
        profile.read(&self.pixels, at(0), normal, read);
        // 2. The step at each of them.
        let Profile { grey, unlike, steps, chosen_by, .. } = profile;
        let fall = |w: &[f32]| (w[0] + w[1] - w[3] - w[4]) / SAMPLES as f32;
        let of_grey = grey[..count].windows(2 * SAMPLES + 1).map(|w| fall(w).abs());
        steps.clear();
        chosen_by.clear();
        if let Some(body_level) = outline {
            let both = of_grey.zip(unlike[..count].windows(2 * SAMPLES + 1));
            steps.extend(both.map(|(grey, w)| (fall(w).max(0.0) * grey).sqrt()));
            // Beyond an outline is the empty scene.
            chosen_by.extend(steps.iter().enumerate().map(|(n, step)| {
                let far = (n + SAMPLES + reach.beyond).min(read - 1);
                let unlike_beyond = 0.5 * (unlike[far - 1] + unlike[far]) / body_level;
                step / (1.0 + unlike_beyond * unlike_beyond)
            }));
        } else {
            steps.extend(of_grey);
            chosen_by.extend_from_slice(steps);
        }
        // 3. The strongest, the less the farther it is.
        let mut best = (0.0, middle);
        for (n, (step, near)) in chosen_by.iter().zip(near).enumerate() {
            if step * near > best.0 {
                best = (step * near, n);
            }
        }
        // 4. The vertex of the parabola through three steps.
        let n = best.1;
        let mut offset_px = n as f64 - middle as f64;
        if 0 < n && n + 1 < steps.len() {
            let [before, at, after] = [n - 1, n, n + 1].map(|n| f64::from(chosen_by[n]));
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

    const OUTER: Border = Border::Outer { body_level: 10.0 };

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
        view.search(
            DVec2::new(100.0 + x, 70.2),
            DVec2::X,
            &Reach::new(8.0, 5.0),
            border,
            &mut Profile::default(),
        )
        .unwrap()
    }

    #[test]
    fn a_step_is_found_between_pixels() {
        for x in [28.0, 30.5, 33.2] {
            for border in [OUTER, Border::Inner] {
                let edge = found(&view(100), x, border);
                assert!((x + edge.offset_px - 30.5).abs() < 0.3, "{border:?}: {edge:?} from {x}");
                // Between pixels the step is blurred.
                assert!((85.0..=100.001).contains(&edge.strength), "{edge:?}");
            }
        }
    }

    #[test]
    fn an_edge_of_the_room_is_no_outline_of_the_body() {
        let empty = found(&view(100), 44.0, OUTER);
        assert_eq!(empty.strength, 0.0, "the room looks as it always does");
        assert!(found(&view(100), 44.0, Border::Inner).strength > 50.0);
        // Where the body is inside, the difference falls inwards.
        let inwards = view(100).search(
            DVec2::new(130.0, 70.0),
            -DVec2::X,
            &Reach::new(8.0, 5.0),
            OUTER,
            &mut Profile::default(),
        );
        assert_eq!(inwards.unwrap().strength, 0.0);
    }

    #[test]
    fn where_the_empty_scene_was_never_seen_every_step_may_be_an_outline() {
        let alone = View { is_empty_known: false, ..view(100) };
        for x in [28.0, 33.2] {
            let edge = found(&alone, x, OUTER);
            assert!((x + edge.offset_px - 30.5).abs() < 0.3, "{edge:?} from {x}");
        }
        assert!(found(&alone, 44.0, OUTER).strength > 50.0, "an edge of the room, too");
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

    /// A limb before a grey wall, lit from the left, differs by 40 up to column 30.5 and by 8 up to column 38.5.
    fn half_lit() -> View {
        let mut pixels = Image::filled(60, 40, [100, 100]);
        for y in 0..40 {
            pixels.row_mut(y)[15..31].fill([140, 100]);
            pixels.row_mut(y)[31..39].fill([108, 100]);
        }
        View { pixels, ..view(100) }
    }

    #[test]
    fn beyond_an_outline_is_the_empty_scene() {
        let view = half_lit();
        let found = |body_level: f32, beyond_px: f64| {
            let reach = Reach::new(12.0, beyond_px);
            let at = DVec2::new(137.5, 70.2);
            view.search(at, DVec2::X, &reach, Border::Outer { body_level }, &mut Profile::default()).unwrap()
        };
        // By its height, the step on the limb would count more than its outline.
        for (body_level, at) in [(f32::INFINITY, 30.5), (5.0, 38.5)] {
            let edge = found(body_level, 5.0);
            assert!((37.5 + edge.offset_px - at).abs() < 0.5, "{body_level}: {edge:?}");
        }
        // What an edge counts is its own height.
        assert!((7.0..=8.001).contains(&found(5.0, 5.0).strength));
        // Beyond the limb as well is no longer beyond the step.
        assert!((37.5 + found(5.0, 12.0).offset_px - 30.5).abs() < 0.5);
    }

    #[test]
    fn an_outline_at_the_end_of_the_piece_is_searched_too() {
        let view = half_lit();
        let reach = Reach::new(6.0, 30.0);
        let found = |x: f64| {
            view.search(DVec2::new(100.0 + x, 70.2), DVec2::X, &reach, OUTER, &mut Profile::default())
        };
        let edge = found(38.0).unwrap();
        assert!((38.0 + edge.offset_px - 38.5).abs() < 0.3, "{edge:?}");
        assert!(found(50.9).is_some() && found(51.1).is_none());
    }

    #[test]
    fn the_difference_at_a_point_is_that_of_its_pixel() {
        let view = half_lit();
        let at = |x: f64, y: f64| view.unlike_at(DVec2::new(100.0 + x, 50.0 + y));
        assert_eq!([at(30.4, 0.0), at(30.6, 39.4), at(39.0, 3.0)], [Some(40.0), Some(8.0), Some(0.0)]);
        assert!(
            [(-0.6, 3.0), (60.0, 3.0), (3.0, 40.0), (f64::NAN, 3.0)].iter().all(|&(x, y)| at(x, y).is_none())
        );
        let alone = View { is_empty_known: false, ..view };
        assert_eq!(alone.unlike_at(DVec2::new(130.4, 50.0)), None);
    }

    #[test]
    fn outside_the_piece_nothing_is_searched() {
        let view = view(100);
        for x in [104.0, 156.0, 90.0, f64::NAN] {
            assert!(
                view.search(
                    DVec2::new(x, 70.0),
                    DVec2::X,
                    &Reach::new(8.0, 5.0),
                    Border::Inner,
                    &mut Profile::default()
                )
                .is_none()
            );
        }
    }
}
