//! How much a person differs from the empty scene, by kind of body part.
//!
//! Beside a person the picture differs too: noise, shadows, reflections. Which difference belongs to the body depends on clothes,
//! room and camera, so it is measured where the tracker found the person: a little inside of the outline and a little
//! outside of it.

use super::edge_search::View;
use super::lines::{KINDS, Sample, row_of};

/// Where it is measured, inside and outside of the outline: shares of the person's height.
const INSIDE: f64 = 0.02;
const OUTSIDE: f64 = 0.03;
/// The difference that belongs to the body is this share of the geometric mean of that inside and that outside: the average person
/// lies a little beside the real one, so some of what is measured outside is body. The margin is thin: of 12 walks in clothes that
/// hardly differ from the background, with 0.8 one was lost (hip and knee 10 and 11 degrees off), and the others were as with 0.6.
const SHARE: f64 = 0.6;
/// Less than a grey level is rounding.
const LEAST: f64 = 1.0;
/// A kind of part of which less is seen has no level.
const LEAST_SAMPLES: f64 = 10.0;

/// Differences inside and outside of outlines, by kind of part.
#[derive(Debug, Default)]
pub struct Contrast {
    /// Samples, and sums of the logarithms of 1 + difference, inside and outside.
    sums: [[f64; 3]; KINDS],
}

impl Contrast {
    /// Adds what the picture shows about a point of an outline.
    pub fn add(&mut self, sample: &Sample, view: &View, height_px: f64) {
        let unlike = |share: f64| view.unlike_at(sample.point_px + share * height_px * sample.normal);
        if let (true, Some(inside), Some(outside)) = (sample.is_outer, unlike(-INSIDE), unlike(OUTSIDE)) {
            let [count, inside_log, outside_log] = &mut self.sums[row_of(sample.point.part)];
            *count += 1.0;
            *inside_log += inside.ln_1p();
            *outside_log += outside.ln_1p();
        }
    }

    /// The difference from which on a pixel belongs to the body, grey levels; infinite where it was not seen.
    pub fn body_levels(&self) -> [f32; KINDS] {
        self.sums.map(|[count, inside_log, outside_log]| {
            if count < LEAST_SAMPLES {
                return f32::INFINITY;
            }
            (SHARE * (0.5 * (inside_log + outside_log) / count).exp_m1().max(LEAST)) as f32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::lines::SurfacePoint;
    use super::*;
    use crate::image::Image;
    use crate::model::body::Part;
    use glam::{DVec2, DVec3};

    /// Left of column 50 the frame differs by `inside` from an empty scene of 100, right of it by `outside`.
    fn view(inside: u8, outside: u8) -> View {
        let mut pixels = Image::filled(100, 20, [100 - outside, 100]);
        (0..20).for_each(|y| pixels.row_mut(y)[..50].fill([100 + inside, 100]));
        View { corner: [0, 0], pixels, is_empty_known: true, others: Vec::new(), crown_px: None }
    }

    fn sample(part: Part, is_outer: bool) -> Sample {
        let point = SurfacePoint { part, world: DVec3::ZERO, radius: DVec3::X, z: 0.0, taper: 0.0 };
        Sample { point, point_px: DVec2::new(49.5, 10.0), normal: DVec2::X, is_outer }
    }

    #[test]
    fn the_body_begins_between_the_differences_inside_and_outside() {
        let (mut contrast, of_shank) = (Contrast::default(), row_of(Part::LeftShank));
        for (inside, outside) in [(80, 4), (80, 4), (20, 4), (20, 4)] {
            (0..3).for_each(|_| {
                contrast.add(&sample(Part::LeftShank, true), &view(inside, outside), 200.0);
            });
        }
        let levels = contrast.body_levels();
        // Geometric means of 1 + difference: (81 * 21)^(1/2) inside, 5 outside.
        let expected = 0.6 * (((81.0 * 21.0f64).sqrt() * 5.0).sqrt() - 1.0);
        assert!((f64::from(levels[of_shank]) - expected).abs() < 1e-3, "{levels:?}");
        assert!(levels.iter().enumerate().all(|(kind, level)| kind == of_shank || level.is_infinite()));
    }

    #[test]
    fn lines_inside_the_body_and_points_outside_of_the_picture_say_nothing() {
        let mut contrast = Contrast::default();
        for _ in 0..20 {
            contrast.add(&sample(Part::Torso, false), &view(50, 2), 200.0);
            contrast.add(&sample(Part::Torso, true), &view(50, 2), 5000.0);
        }
        assert!(contrast.body_levels().iter().all(|level| level.is_infinite()));
        // Without any difference, less than a grey level is rounding.
        (0..20).for_each(|_| contrast.add(&sample(Part::Torso, true), &view(0, 0), 200.0));
        assert_eq!(contrast.body_levels()[row_of(Part::Torso)], 0.6);
    }
}
