//! The brightness of the whole picture, kept steady: under a flickering lamp or with a shutter that beats with it, every
//! frame differs from its neighbours everywhere.
//!
//! A frame whose brightness differs from that of the frame before by as many grey levels as change detection would mark is
//! mapped to it ([`estimate_gain`]), if the map explains the difference: it at least halves the median difference of the
//! pixels. From then on, every frame is mapped to the one before, so all have the brightness before the first such change.
//! Frames of a steady light are left as they are.
//!
//! Limits: those of the map; what is clipped in a bright frame stays unknown; a change slower than that, frame by frame,
//! is left as it is.

use super::frame::{Frame, FrameError, Image};
use super::gain::{Gain, estimate_gain, quartile_gain, sampled_pairs};

/// What was found of the light.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LightReport {
    /// Frames whose brightness differed so much that they were mapped.
    pub frames: usize,
    /// Largest difference, as a share of the brightness of the other frames.
    pub largest: f64,
}

/// Keeps the light of a stream of frames steady.
#[derive(Debug, Clone, Default)]
pub struct SteadyLight {
    last: Option<Image<u8>>,
    flickers: bool,
    report: LightReport,
}

impl SteadyLight {
    /// Takes the next frame; returns it with the brightness of those before, `None` to use it as it is. `least` is the
    /// smallest difference that matters, grey levels.
    ///
    /// # Errors
    ///
    /// The frame differs in size from the one before.
    pub fn push(&mut self, frame: &Frame<'_>, least: f64) -> Result<Option<Image<u8>>, FrameError> {
        let mapped = match &self.last {
            Some(last) => Self::mapped(&last.as_frame(), frame, least, self.flickers)?,
            None => None,
        };
        self.flickers = mapped.is_some();
        if let Some((gain, bright)) = mapped {
            let (off, steady) = ((gain.map(bright) - bright).abs(), gain.map(bright).max(1.0));
            if off >= least {
                self.report.frames += 1;
                self.report.largest = self.report.largest.max(off / steady);
            }
        }
        let image = mapped.map(|(gain, _)| gain.apply(frame));
        self.last = Some(image.clone().unwrap_or_else(|| frame.to_image()));
        Ok(image)
    }

    /// Forgets the frames so far, because another view begins.
    pub fn begin_view(&mut self) {
        (self.last, self.flickers) = (None, false);
    }

    /// What was found so far.
    pub fn report(&self) -> LightReport {
        self.report
    }

    /// The map to the frame before, and a grey value of the brighter parts; `None` if the frame is used as it is.
    fn mapped(
        last: &Frame<'_>,
        frame: &Frame<'_>,
        least: f64,
        flickers: bool,
    ) -> Result<Option<(Gain, f64)>, FrameError> {
        last.check_same_size(frame)?;
        let pairs = sampled_pairs(last, frame);
        if pairs.is_empty() {
            return Ok(None);
        }
        let mut greys: Vec<f64> = pairs.iter().map(|pair| pair.1).collect();
        let at = 3 * (greys.len() - 1) / 4;
        let bright = *greys.select_nth_unstable_by(at, f64::total_cmp).1;
        let differs = |gain: &Gain| (gain.map(bright) - bright).abs() >= least;
        // The quartiles are a quick look; of a steady light they agree.
        if !flickers && !differs(&quartile_gain(&pairs)) {
            return Ok(None);
        }
        let gain = estimate_gain(last, frame)?;
        let difference = |gain: &Gain| {
            let mut off: Vec<f64> = pairs.iter().map(|(a, b)| (a - gain.map(*b)).abs()).collect();
            let at = off.len() / 2;
            *off.select_nth_unstable_by(at, f64::total_cmp).1
        };
        let explains = 2.0 * difference(&gain) <= difference(&Gain::IDENTITY);
        let is_used = if differs(&gain) { explains } else { flickers };
        Ok(is_used.then_some((gain, bright)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;
    use proptest::prelude::*;

    const LEAST: f64 = 4.0;

    /// A textured wall with noise, of a lamp of this brightness, before which something moves.
    fn lit(random: &mut Random, k: usize, brightness: f64) -> Image<u8> {
        let mut image = Image::filled(160, 120, 0u8);
        for y in 0..120 {
            for x in 0..160 {
                let moving = (10 + 2 * k..40 + 2 * k).contains(&x) && (30..110).contains(&y);
                let wall = 90.0 + 40.0 * ((x / 8 + y / 8) % 2) as f64 + 0.2 * x as f64;
                let grey = brightness * if moving { 60.0 } else { wall } + f64::from(random.normal_pair()[0]);
                image.row_mut(y)[x] = grey.round().clamp(0.0, 255.0) as u8;
            }
        }
        image
    }

    #[test]
    fn a_copy_goes_on_as_the_light_would() {
        let mut random = Random::new(3);
        let frames = [1.0, 1.3, 1.0].map(|brightness| lit(&mut random, 0, brightness));
        let mut light = SteadyLight::default();
        light.push(&frames[0].as_frame(), LEAST).unwrap();
        let mut copy = light.clone();
        for frame in &frames[1..] {
            let [one, other] = [&mut light, &mut copy].map(|light| light.push(&frame.as_frame(), LEAST));
            assert_eq!(one, other);
        }
        assert_eq!((light.report(), light.report().frames), (copy.report(), 1));
    }

    fn mean(image: &Image<u8>) -> f64 {
        image.pixels().iter().map(|grey| f64::from(*grey)).sum::<f64>() / image.pixels().len() as f64
    }

    proptest! {
        #[test]
        fn a_flickering_lamp_is_made_steady(
            seed in any::<u64>(), brightness in proptest::collection::vec(0.65f64..1.25, 2..12)
        ) {
            let (mut random, mut light) = (Random::new(seed), SteadyLight::default());
            let mut last = lit(&mut random, 0, 1.0);
            light.push(&last.as_frame(), LEAST).unwrap();
            for (k, brightness) in brightness.iter().enumerate() {
                let frame = lit(&mut random, k + 1, *brightness);
                let image = light.push(&frame.as_frame(), LEAST).unwrap().unwrap_or(frame);
                prop_assert!((mean(&image) - mean(&last)).abs() < LEAST, "{} {}", mean(&image), mean(&last));
                last = image;
            }
        }
    }

    #[test]
    fn frames_keep_the_brightness_before_the_first_jump() {
        let (mut random, mut light) = (Random::new(5), SteadyLight::default());
        let steady = mean(&lit(&mut random, 0, 1.0));
        for k in 0..50 {
            let frame = lit(&mut random, k % 50, [1.0, 1.3, 0.7, 1.01][k % 4]);
            let image = light.push(&frame.as_frame(), LEAST).unwrap().unwrap_or(frame);
            assert!((mean(&image) - steady).abs() < LEAST, "{k}: {} {steady}", mean(&image));
        }
        let LightReport { frames, largest } = light.report();
        assert!(frames == 25 && (largest - 0.3).abs() < 0.03, "{frames} {largest}");
    }

    #[test]
    fn frames_of_a_steady_light_are_left_as_they_are() {
        let (mut random, mut light) = (Random::new(3), SteadyLight::default());
        for k in 0..40 {
            let drift = 1.0 + 0.005 * k as f64;
            assert!(light.push(&lit(&mut random, k, drift).as_frame(), LEAST).unwrap().is_none());
        }
        assert_eq!(light.report(), LightReport::default());
    }

    #[test]
    fn another_picture_is_no_other_light() {
        let (mut random, mut light) = (Random::new(3), SteadyLight::default());
        light.push(&lit(&mut random, 0, 1.0).as_frame(), LEAST).unwrap();
        let mut other = Image::filled(160, 120, 0u8);
        other.pixels_mut().iter_mut().for_each(|grey| *grey = random.uniform(20.0, 235.0) as u8);
        assert!(light.push(&other.as_frame(), LEAST).unwrap().is_none());
        light.begin_view();
        assert!(light.push(&lit(&mut random, 0, 1.3).as_frame(), LEAST).unwrap().is_none());
        let small = Image::filled(20, 20, 100u8);
        assert!(light.push(&small.as_frame(), LEAST).is_err());
    }
}
