//! Pictures of a display: dots of one size, shape and colour at the display's own scale, never scaled to fit.

use super::{PointLightDisplay, PointLightError};
use crate::OptionError;
use glam::DVec2;

/// Longest side of a picture, pixels.
const LONGEST_SIDE: usize = 1 << 14;

/// Coverage below half a grey level is not drawn.
const LEAST_COVERAGE: f64 = 0.5 / 255.0;

/// Shape of a dot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DotShape {
    /// A disc; its diameter is the size.
    Disc,
    /// A square; its side is the size.
    Square,
    /// A Gaussian blob; its full width at half of its maximum is the size.
    Gaussian,
}

/// How a display is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DotPicture {
    /// Width and height, pixels.
    pub size_px: [usize; 2],
    /// Pixel of the display in the middle of the picture; by default the centre of the display.
    pub centre_px: Option<DVec2>,
    /// Size of a dot, pixels.
    pub dot_px: f64,
    /// Shape of a dot.
    pub shape: DotShape,
    /// Colour of the dots, red, green, blue.
    pub colour: [u8; 3],
    /// Colour of the background.
    pub background: [u8; 3],
    /// Whether pixels at the edge of a dot are partly covered, so that dots move by less than a pixel. Otherwise a
    /// pixel is covered if its centre is. Gaussian dots are always smooth.
    pub is_smooth: bool,
}

impl Default for DotPicture {
    fn default() -> Self {
        Self {
            size_px: [640, 640],
            centre_px: None,
            dot_px: 10.0,
            shape: DotShape::Disc,
            colour: [255; 3],
            background: [0; 3],
            is_smooth: true,
        }
    }
}

impl DotPicture {
    /// Refuses what cannot be drawn.
    ///
    /// # Errors
    ///
    /// A side, a size of dots or a centre out of range.
    pub fn check(&self) -> Result<(), PointLightError> {
        for side in self.size_px {
            let is_good = (1..=LONGEST_SIDE).contains(&side);
            OptionError::unless(is_good, "size_px", "between 1 and 16384 pixels", side as f64)?;
        }
        let is_good = self.dot_px > 0.0 && self.dot_px <= 1e4;
        OptionError::unless(is_good, "dot_px", "positive and at most 10,000 pixels", self.dot_px)?;
        for along in self.centre_px.iter().flat_map(|centre| centre.to_array()) {
            OptionError::unless(along.abs() <= 1e9, "centre_px", "finite and at most 1e9", along)?;
        }
        Ok(())
    }

    /// Where a pixel of the display is in the picture.
    fn placed(&self, display: &PointLightDisplay, position_px: DVec2) -> DVec2 {
        let middle = 0.5 * (DVec2::new(self.size_px[0] as f64, self.size_px[1] as f64) - 1.0);
        position_px - self.centre_px.unwrap_or(display.centre_px) + middle
    }

    /// The share of each pixel that the dots of a frame cover, row after row, 0 to 1.
    pub fn coverage(&self, display: &PointLightDisplay, frame: usize) -> Vec<f32> {
        let [width, height] = self.size_px;
        let mut covered = vec![0.0f32; width * height];
        let reach = self.reach_px();
        for dot in (0..display.dots).filter_map(|dot| display.at(frame, dot)) {
            let place = self.placed(display, dot);
            let range = |at: f64, side: usize| {
                let [from, to] =
                    [at - reach, at + reach + 1.0].map(|x| x.ceil().clamp(0.0, side as f64) as usize);
                from..to.max(from)
            };
            for y in range(place.y, height) {
                for x in range(place.x, width) {
                    let share = self.share(DVec2::new(x as f64, y as f64) - place) as f32;
                    let pixel = &mut covered[y * width + x];
                    *pixel = pixel.max(share);
                }
            }
        }
        covered
    }

    /// Beyond this distance along each axis from the middle of a dot, no pixel is covered.
    fn reach_px(&self) -> f64 {
        match self.shape {
            DotShape::Disc | DotShape::Square => 0.5 * self.dot_px + 1.0,
            DotShape::Gaussian => self.sigma_px() * (-2.0 * LEAST_COVERAGE.ln()).sqrt(),
        }
    }

    /// Standard deviation of a Gaussian dot: its width at half maximum is 2 sqrt(2 ln 2) standard deviations.
    fn sigma_px(&self) -> f64 {
        self.dot_px / (8.0 * std::f64::consts::LN_2).sqrt()
    }

    /// The share that a dot covers of the pixel at this distance from its middle.
    fn share(&self, apart: DVec2) -> f64 {
        let half = 0.5 * self.dot_px;
        match self.shape {
            DotShape::Gaussian => {
                let share = (-0.5 * apart.length_squared() / self.sigma_px().powi(2)).exp();
                if share < LEAST_COVERAGE { 0.0 } else { share }
            }
            DotShape::Disc if self.is_smooth => disc_share(apart, half),
            DotShape::Disc => f64::from(apart.length() <= half),
            DotShape::Square if self.is_smooth => {
                let overlap = |x: f64| ((x + 0.5).min(half) - (x - 0.5).max(-half)).max(0.0);
                overlap(apart.x) * overlap(apart.y)
            }
            DotShape::Square => {
                let is_inside = |x: f64| -half <= x && x < half;
                f64::from(is_inside(apart.x) && is_inside(apart.y))
            }
        }
    }

    /// A frame, row after row, with red, green and blue of each pixel; with `alpha` the colour of the dots
    /// everywhere and how much of it (straight alpha), and no background.
    pub fn pixels(&self, display: &PointLightDisplay, frame: usize, alpha: bool) -> Vec<u8> {
        let covered = self.coverage(display, frame);
        let [r, g, b] = self.colour;
        let empty = if alpha { vec![r, g, b, 0] } else { self.background.to_vec() };
        let mut pixels = empty.repeat(covered.len());
        // Dots cover few of the pixels.
        let drawn = pixels.chunks_exact_mut(empty.len()).zip(covered).filter(|(_, share)| *share > 0.0);
        for (pixel, share) in drawn {
            if alpha {
                pixel[3] = (255.0 * share).round() as u8;
                continue;
            }
            for (value, colour) in pixel.iter_mut().zip(self.colour) {
                let ground = f32::from(*value);
                *value = (ground + (f32::from(colour) - ground) * share).round() as u8;
            }
        }
        pixels
    }
}

/// Samples of a pixel along each axis, where the edge of a disc crosses it.
const SAMPLES: usize = 8;

/// The share of a pixel within a disc, from 64 samples.
fn disc_share(apart: DVec2, radius: f64) -> f64 {
    let distance = apart.length();
    if distance >= radius + 0.75 {
        return 0.0;
    }
    if distance <= radius - 0.75 {
        return 1.0;
    }
    let offset = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
    let is_inside = |i: usize| {
        let sample = apart + DVec2::new(offset(i % SAMPLES), offset(i / SAMPLES));
        sample.length_squared() <= radius * radius
    };
    (0..SAMPLES * SAMPLES).filter(|&i| is_inside(i)).count() as f64 / (SAMPLES * SAMPLES) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::pointlight::DotSource;
    use std::f64::consts::{LN_2, PI};

    fn one_dot(at: DVec2) -> PointLightDisplay {
        PointLightDisplay {
            times_s: vec![0.0],
            dots: 1,
            points: 1,
            centre_px: DVec2::ZERO,
            period_s: None,
            positions_px: vec![at],
            sources: vec![DotSource::Joint(0)],
        }
    }

    /// Area and centroid of a drawn dot.
    fn moments(picture: &DotPicture, at: DVec2) -> (f64, DVec2) {
        let covered = picture.coverage(&one_dot(at), 0);
        let area: f64 = covered.iter().map(|&c| f64::from(c)).sum();
        let width = picture.size_px[0];
        let weighted: DVec2 = covered
            .iter()
            .enumerate()
            .map(|(i, &c)| DVec2::new((i % width) as f64, (i / width) as f64) * f64::from(c))
            .sum();
        (area, weighted / area)
    }

    #[test]
    fn dots_have_their_area_and_place_to_a_part_of_a_pixel() {
        for (shape, area_of_unit) in
            [(DotShape::Disc, PI / 4.0), (DotShape::Square, 1.0), (DotShape::Gaussian, PI / (4.0 * LN_2))]
        {
            for dot_px in [4.0, 9.5] {
                let picture = DotPicture { size_px: [81, 61], shape, dot_px, ..DotPicture::default() };
                for at in [DVec2::ZERO, DVec2::new(3.3, -7.8), DVec2::new(-5.5, 0.25)] {
                    let (area, centroid) = moments(&picture, at);
                    let wanted = area_of_unit * dot_px * dot_px;
                    assert!((area / wanted - 1.0).abs() < 0.02, "{shape:?} of {dot_px}: {area}, {wanted}");
                    assert!(
                        (centroid - at - DVec2::new(40.0, 30.0)).length() < 0.03,
                        "{shape:?}: {centroid}"
                    );
                }
            }
        }
        let hard = DotPicture { is_smooth: false, size_px: [81, 61], dot_px: 9.0, ..DotPicture::default() };
        assert!(hard.coverage(&one_dot(DVec2::new(0.3, 0.2)), 0).iter().all(|&c| c == 0.0 || c == 1.0));
    }

    #[test]
    fn dots_outside_are_cut_and_bad_pictures_are_refused() {
        let picture = DotPicture { size_px: [21, 21], ..DotPicture::default() };
        let cut = moments(&picture, DVec2::new(10.0, 0.0)).0;
        assert!((cut / moments(&picture, DVec2::ZERO).0 - 0.5).abs() < 0.07, "{cut}");
        assert!(picture.coverage(&one_dot(DVec2::new(1e5, -1e9)), 0).iter().all(|&c| c == 0.0));
        assert!(picture.coverage(&one_dot(DVec2::NAN), 0).iter().all(|&c| c == 0.0));
        for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
            assert!(DotPicture { dot_px: bad, ..picture }.check().is_err());
        }
        assert!(DotPicture { size_px: [0, 5], ..picture }.check().is_err());
        assert!(DotPicture { centre_px: Some(DVec2::NAN), ..picture }.check().is_err());
        assert!(DotPicture { centre_px: Some(DVec2::new(f64::NAN, 0.0)), ..picture }.check().is_err());
    }

    #[test]
    fn colours_are_mixed_by_coverage() {
        let picture = DotPicture {
            size_px: [15, 15],
            colour: [200, 0, 50],
            background: [100; 3],
            ..DotPicture::default()
        };
        let display = one_dot(DVec2::new(0.4, 0.1));
        let (opaque, clear) = (picture.pixels(&display, 0, false), picture.pixels(&display, 0, true));
        for (rgb, rgba) in opaque.chunks(3).zip(clear.chunks(4)) {
            assert_eq!(rgba[..3], [200, 0, 50]);
            let over = |channel: usize| {
                let share = f32::from(rgba[3]) / 255.0;
                share * f32::from(rgba[channel]) + (1.0 - share) * 100.0
            };
            assert!((0..3).all(|channel| (over(channel) - f32::from(rgb[channel])).abs() < 1.0));
        }
        assert_eq!([&opaque[..3], &opaque[3 * 112..3 * 113]], [[100; 3], [200, 0, 50]]);
    }
}
