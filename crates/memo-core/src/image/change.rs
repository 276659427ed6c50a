//! Change detection: which pixels differ between consecutive frames of a static camera.
//!
//! Source: Rohr 1994, section 4.1, eq. (1). A bivariate polynomial of second order, g = X beta, is fitted to
//! the n = 25 grey values of a 5x5 window, and the fits of two frames are compared. With X* the generalised
//! inverse of X, a pixel of frame k has changed when
//!
//! ```text
//! N_kj = 1/sqrt(n) |X X* (g_k - g_j)|  >  T            (1)
//! ```
//!
//! holds for j = k - 1 or j = k + 1. The fit is linear, so one fit of the difference d = g_k - g_j serves
//! both frames of a pair. `fit` computes N^2 of a window exactly, in integers.
//!
//! A pixel less than two pixels from the border of the frame has no window of its own and takes the result of
//! the nearest whole window. The statistics of the test, and its false rate, are therefore the same
//! everywhere; with replicated grey values they would not be. A frame with a side of less than 5 pixels has
//! no window and no changes.
//!
//! Limits: the test cannot distinguish an object from its shadow or reflection. It detects nothing where a
//! moving object has no contrast or stands still. It marks the pixels the object covers in either
//! neighbouring frame as well as those it covers in the current frame.

use super::fit::{BORDER, NORM_SCALE, WINDOW, for_each_window, window_norm};
use super::frame::{Frame, FrameError, Image, Mask};
use super::gain::estimate_gain;
use crate::OptionError;
use thiserror::Error;

/// How far beyond the visible edge of a moving object eq. (1) marks pixels, in pixels: a window reaches the
/// edge from two pixels away.
///
/// Measured at T = 4 on upright rectangles and discs at random subpixel positions, across the direction of
/// motion, from the true edge to the outer side of the outermost marked pixel: 1.9 px at a contrast of 20
/// grey levels, 2.3 at 50, 2.4 at 100; 1.8, 2.4 and 2.9 with edges blurred by 0.7 px. The subpixel position
/// adds a standard deviation of 0.3 px. Below a contrast of 10 the reach falls to 1 px and less.
pub const CHANGE_REACH_PX: f64 = 2.3;

/// Median of the chi-square distribution with six degrees of freedom.
const CHI_SQ_6_MEDIAN: f64 = 5.348_120_627;

/// Why two frames were not compared.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ChangeError {
    /// The frames differ in size.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Options for comparing two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangeOptions {
    /// The threshold T of eq. (1) in grey levels, 0 to 255; values outside are clamped. `None` (default): T
    /// follows the noise of the pair. A fixed threshold fails when the noise comes near it: at a noise
    /// standard deviation of 6 grey levels, noise alone reaches T = 4.
    pub threshold: Option<f64>,
    /// Fraction of unchanged pixels that may pass the test under Gaussian noise, used with `threshold: None`.
    /// The default 1e-6 leaves about two false pixels in a 1080p frame; cleaning the regions removes them.
    pub false_rate: f64,
    /// Lower bound of T in grey levels when T follows the noise. At the default 4, eq. (1) covers 99.9 % of a
    /// walker's joints in clean footage (at 8: 95-98 %), and 4 is above the residual that video codecs leave.
    /// The noise estimate does not include that residual, because skipped blocks are exactly equal.
    /// Reflections on a polished floor pass 4 and lengthen the region downwards; 8 to 12 removes most of
    /// them.
    pub min_threshold: f64,
    /// Removes a common change of brightness and contrast before the comparison. Off by default: it costs one
    /// pass over the frame, and a camera with fixed exposure, which eq. (1) assumes, does not need it.
    pub compensate_gain: bool,
}

impl Default for ChangeOptions {
    fn default() -> Self {
        Self { threshold: None, false_rate: 1e-6, min_threshold: 4.0, compensate_gain: false }
    }
}

impl ChangeOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let threshold = self.threshold.unwrap_or(0.0);
        OptionError::unless(!threshold.is_nan(), "threshold", "a number of grey levels", threshold)?;
        let is_rate = self.false_rate > 0.0 && self.false_rate < 1.0;
        OptionError::unless(is_rate, "false_rate", "between 0 and 1", self.false_rate)?;
        OptionError::unless_at_least_0("min_threshold", self.min_threshold)
    }
}

/// The pixels where eq. (1) holds between two frames. The result is symmetric in `a` and `b` unless the gain
/// is compensated.
///
/// # Errors
///
/// The frames differ in size, or an option is outside its range.
pub fn pair_changes(a: &Frame, b: &Frame, options: &ChangeOptions) -> Result<Mask, ChangeError> {
    options.check()?;
    Ok(changes_between(a, b, options)?)
}

/// [`pair_changes`] by options that were checked.
pub(super) fn changes_between(a: &Frame, b: &Frame, options: &ChangeOptions) -> Result<Mask, FrameError> {
    a.check_same_size(b)?;
    if !options.compensate_gain {
        return Ok(changes_over(a, b, threshold_of(a, b, options)?));
    }
    let matched = estimate_gain(a, b)?.apply(b);
    let matched = matched.as_frame();
    Ok(changes_over(a, &matched, threshold_of(a, &matched, options)?))
}

/// The left side of eq. (1), N in grey levels, for every pixel.
///
/// # Errors
///
/// The frames differ in size.
pub fn fit_norms(a: &Frame, b: &Frame) -> Result<Image<f32>, FrameError> {
    a.check_same_size(b)?;
    let mut norms = Image::filled(a.width(), a.height(), 0f32);
    let scale = 1.0 / NORM_SCALE as f32;
    let value = move |norm_sq: i32| (norm_sq as f32 * scale).sqrt();
    for_each_window(a, b, &mut norms, value);
    extend_to_border(&mut norms);
    Ok(norms)
}

/// The threshold T that eq. (1) uses for this pair, in grey levels, without gain compensation.
///
/// # Errors
///
/// The frames differ in size, or an option is outside its range.
pub fn pair_threshold(a: &Frame, b: &Frame, options: &ChangeOptions) -> Result<f64, ChangeError> {
    options.check()?;
    Ok(threshold_of(a, b, options)?)
}

fn threshold_of(a: &Frame, b: &Frame, options: &ChangeOptions) -> Result<f64, FrameError> {
    a.check_same_size(b)?;
    match options.threshold {
        Some(threshold) => Ok(threshold),
        None => Ok(threshold_for_noise(noise_sd(a, b)?, options.false_rate).max(options.min_threshold)),
    }
}

/// Standard deviation of the grey-value noise of one frame, from a pair of frames. More than half of the
/// pixels must be unchanged.
///
/// Under Gaussian noise of standard deviation s, n N^2 / (2 s^2) follows chi-square with six degrees of
/// freedom. The median of N^2 over about 2000 windows on a grid is set equal to the median of that
/// distribution. Sums over 25 pixels also measure noise below one grey level, where the median absolute
/// difference of single pixels is 0. Moving pixels bias the estimate upwards: 9 % when a fifth of the frame
/// moves. Footage whose codec repeats more than half of the blocks gives 0.
///
/// # Errors
///
/// The frames differ in size.
pub fn noise_sd(a: &Frame, b: &Frame) -> Result<f64, FrameError> {
    a.check_same_size(b)?;
    let mut norms = sampled_norms(a, b);
    if norms.is_empty() {
        return Ok(0.0);
    }
    let middle = norms.len() / 2;
    let median = f64::from(*norms.select_nth_unstable(middle).1) / NORM_SCALE;
    let n = (WINDOW * WINDOW) as f64;
    Ok((n * median / (2.0 * CHI_SQ_6_MEDIAN)).sqrt())
}

/// The T that Gaussian noise of standard deviation `noise_sd` exceeds with probability `false_rate` (1e-12 to
/// 0.5) at a pixel.
///
/// T = s sqrt(2 q / 25), q the upper quantile of chi-square with six degrees of freedom; 1.75 s at 1e-6.
pub fn threshold_for_noise(noise_sd: f64, false_rate: f64) -> f64 {
    let n = (WINDOW * WINDOW) as f64;
    noise_sd * (2.0 * chi_sq_6_upper_quantile(false_rate.clamp(1e-12, 0.5)) / n).sqrt()
}

/// The x with P(chi-square_6 > x) = exp(-x/2) (1 + x/2 + x^2/8) = p, by Newton's method on the logarithm,
/// which is concave.
fn chi_sq_6_upper_quantile(p: f64) -> f64 {
    let mut x = CHI_SQ_6_MEDIAN;
    for _ in 0..20 {
        let polynomial = 1.0 + x / 2.0 + x * x / 8.0;
        let log_tail = polynomial.ln() - x / 2.0;
        let slope = -x * x / 16.0 / polynomial;
        x -= (log_tail - p.ln()) / slope;
    }
    x
}

/// 17500 N^2 of about 2048 windows on a square grid.
fn sampled_norms(a: &Frame, b: &Frame) -> Vec<i32> {
    let step = ((a.width() * a.height()) as f64 / 2048.0).sqrt().max(1.0) as usize;
    let centres = |side: usize| (BORDER..side.saturating_sub(BORDER)).step_by(step);
    let mut norms = Vec::with_capacity(4096);
    for y in centres(a.height()) {
        norms.extend(centres(a.width()).map(|x| window_norm(a, b, x, y)));
    }
    norms
}

/// Marks the pixels with N > `threshold`. The frames have the same size.
fn changes_over(a: &Frame, b: &Frame, threshold: f64) -> Mask {
    let mut mask = Image::filled(a.width(), a.height(), false);
    // An integer exceeds a real number exactly when it exceeds the floor of that number.
    let limit = (NORM_SCALE * threshold.clamp(0.0, 255.0).powi(2)).floor() as i32;
    for_each_window(a, b, &mut mask, move |norm_sq| norm_sq > limit);
    extend_to_border(&mut mask);
    mask
}

/// Gives every pixel without a window the value of the nearest window.
fn extend_to_border<T: Copy>(image: &mut Image<T>) {
    let (width, height) = (image.width(), image.height());
    if width < WINDOW || height < WINDOW {
        return;
    }
    for y in BORDER..height - BORDER {
        let row = image.row_mut(y);
        let (first, last) = (row[BORDER], row[width - 1 - BORDER]);
        row[..BORDER].fill(first);
        row[width - BORDER..].fill(last);
    }
    for y in 0..BORDER {
        let pixels = image.pixels_mut();
        pixels.copy_within(BORDER * width..(BORDER + 1) * width, y * width);
        let last = (height - 1 - BORDER) * width;
        pixels.copy_within(last..last + width, (height - 1 - y) * width);
    }
}

/// Eq. (1) over a stream of frames: a pixel of frame k has changed if it changed against frame k - 1 or k +
/// 1.
///
/// Each pair is fitted once and serves both of its frames. The mask of a frame is available when the next
/// frame has arrived. The first and the last frame have one neighbour only.
#[derive(Debug, Clone)]
pub struct ChangeDetector {
    options: ChangeOptions,
    previous: Option<Image<u8>>,
    previous_pair: Option<Mask>,
}

impl ChangeDetector {
    /// A detector before its first frame.
    ///
    /// # Errors
    ///
    /// An option is outside its range.
    pub fn new(options: ChangeOptions) -> Result<Self, OptionError> {
        options.check()?;
        Ok(Self { options, previous: None, previous_pair: None })
    }

    /// Takes the next frame and returns the mask of the previous one, `None` for the first frame. A frame of
    /// another size is an error and does not change the detector.
    pub fn push(&mut self, frame: &Frame) -> Result<Option<Mask>, FrameError> {
        let Some(previous) = &self.previous else {
            self.previous = Some(frame.to_image());
            return Ok(None);
        };
        let pair = changes_between(&previous.as_frame(), frame, &self.options)?;
        let mut mask = pair.clone();
        if let Some(before) = &self.previous_pair {
            unite(&mut mask, before);
        }
        self.previous = Some(frame.to_image());
        self.previous_pair = Some(pair);
        Ok(Some(mask))
    }

    /// The mask of the last frame, from its only pair; `None` after fewer than two frames.
    pub fn finish(self) -> Option<Mask> {
        self.previous_pair
    }
}

/// Adds the pixels of another mask of the same size.
pub(crate) fn unite(mask: &mut Mask, other: &Mask) {
    for (pixel, &other) in mask.pixels_mut().iter_mut().zip(other.pixels()) {
        *pixel |= other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    /// N^2 of every whole window, row by row, by the pseudo-inverse as eq. (1) is printed.
    fn pseudo_inverse_norms_sq(a: &Frame, b: &Frame) -> Vec<f64> {
        let design = DMatrix::from_fn(25, 6, |row, column| {
            let (x, y) = ((row % 5) as f64 - 2.0, (row / 5) as f64 - 2.0);
            [1.0, x, y, x * x, x * y, y * y][column]
        });
        let projection = &design * design.clone().pseudo_inverse(1e-12).unwrap();
        let norm_sq = |x: usize, y: usize| {
            let grey = |f: &Frame| DVector::from_fn(25, |i, _| f64::from(f.at(x + i % 5 - 2, y + i / 5 - 2)));
            (&projection * (grey(a) - grey(b))).norm_squared() / 25.0
        };
        (2..a.height() - 2)
            .flat_map(|y| (2..a.width() - 2).map(move |x| (x, y)))
            .map(|(x, y)| norm_sq(x, y))
            .collect()
    }

    fn image(width: usize, height: usize, mut value: impl FnMut(usize, usize) -> u8) -> Image<u8> {
        let pixels = (0..width * height).map(|i| value(i % width, i / width)).collect();
        Image::from_vec(width, height, pixels).unwrap()
    }

    fn fixed(threshold: f64) -> ChangeOptions {
        ChangeOptions { threshold: Some(threshold), ..ChangeOptions::default() }
    }

    fn grey_values(count: usize) -> impl Strategy<Value = Vec<u8>> {
        let extremes = proptest::collection::vec(prop_oneof![Just(0u8), Just(255u8)], count);
        prop_oneof![proptest::collection::vec(any::<u8>(), count), extremes]
    }

    fn frame_pair() -> impl Strategy<Value = (Image<u8>, Image<u8>)> {
        (5usize..40, 5usize..12).prop_flat_map(|(w, h)| {
            let frame = move || grey_values(w * h).prop_map(move |data| Image::from_vec(w, h, data).unwrap());
            (frame(), frame())
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn integer_sums_equal_the_pseudo_inverse((a, b) in frame_pair(), threshold in 0.0f64..255.0) {
            let (a, b) = (a.as_frame(), b.as_frame());
            let mask = pair_changes(&a, &b, &fixed(threshold)).unwrap();
            let norms = fit_norms(&a, &b).unwrap();
            let inner_width = a.width() - 4;
            for (i, expected) in pseudo_inverse_norms_sq(&a, &b).into_iter().enumerate() {
                let (x, y) = (i % inner_width + 2, i / inner_width + 2);
                let exact = window_norm(&a, &b, x, y);
                prop_assert!((f64::from(exact) - NORM_SCALE * expected).abs() < 0.5);
                prop_assert_eq!(mask.at(x, y), f64::from(exact) > NORM_SCALE * threshold * threshold);
                prop_assert!((f64::from(norms.at(x, y)) - expected.sqrt()).abs() < 1e-4);
            }
        }

        #[test]
        fn border_pixels_take_the_nearest_window((a, b) in frame_pair(), threshold in 0.0f64..120.0) {
            let mask = pair_changes(&a.as_frame(), &b.as_frame(), &fixed(threshold)).unwrap();
            let (w, h) = (mask.width(), mask.height());
            for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
                prop_assert_eq!(mask.at(x, y), mask.at(x.clamp(2, w - 3), y.clamp(2, h - 3)));
            }
        }

        #[test]
        fn planted_noise_is_recovered(sd in 0.4f64..20.0, seed in any::<u64>()) {
            let mut noise = gaussian(seed, sd);
            let a = image(160, 120, |_, _| (128.0 + noise()).round() as u8);
            let b = image(160, 120, |_, _| (128.0 + noise()).round() as u8);
            let found = noise_sd(&a.as_frame(), &b.as_frame()).unwrap();
            let expected = rounded_sd(sd);
            prop_assert!((found / expected - 1.0).abs() < 0.06, "{found} for {expected}");
        }
    }

    /// Standard deviation of Gaussian numbers about a whole number after rounding to whole numbers: about
    /// sqrt(sd² + 1/12) for sd >= 0.5, less below (7 % less at 0.4), where most round to the mean itself.
    ///
    /// sum k² P(k - 1/2 < x < k + 1/2), each probability by Simpson's rule.
    fn rounded_sd(sd: f64) -> f64 {
        let density = |x: f64| (-0.5 * (x / sd).powi(2)).exp() / (sd * std::f64::consts::TAU.sqrt());
        let probability = |k: f64| {
            let ordinates = (0..=32).map(|i| {
                let weight = if i == 0 || i == 32 { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
                weight * density(k - 0.5 + f64::from(i) / 32.0)
            });
            ordinates.sum::<f64>() / 96.0
        };
        (1..=127).map(|k| 2.0 * f64::from(k * k) * probability(f64::from(k))).sum::<f64>().sqrt()
    }

    /// Gaussian numbers from a linear congruential generator by the Box-Muller transform.
    fn gaussian(seed: u64, sd: f64) -> impl FnMut() -> f64 {
        let mut state = seed;
        let mut uniform = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((state >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        move || sd * (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    }

    #[test]
    fn a_uniform_step_is_its_own_norm() {
        let (a, b) = (Image::filled(9, 7, 100u8), Image::filled(9, 7, 110u8));
        let (a, b) = (a.as_frame(), b.as_frame());
        assert!(pair_changes(&a, &b, &fixed(9.999)).unwrap().pixels().iter().all(|&changed| changed));
        assert!(!pair_changes(&a, &b, &fixed(10.0)).unwrap().pixels().iter().any(|&changed| changed));
    }

    #[test]
    fn the_largest_difference_does_not_overflow() {
        let (a, b) = (Image::filled(6, 6, 255u8), Image::filled(6, 6, 0u8));
        assert_eq!(window_norm(&a.as_frame(), &b.as_frame(), 2, 2), 17500 * 255 * 255);
        assert!(pair_changes(&a.as_frame(), &b.as_frame(), &fixed(254.9)).unwrap().at(3, 3));
    }

    #[test]
    fn quantiles_agree_with_tables() {
        for (p, expected) in [(0.05, 12.5916), (0.01, 16.8119), (0.001, 22.4577), (1e-6, 38.2583)] {
            assert!((chi_sq_6_upper_quantile(p) - expected).abs() < 1e-3, "{p}");
        }
        assert!((threshold_for_noise(1.0, 1e-6) - 1.7495).abs() < 1e-3);
    }

    #[test]
    fn noise_passes_at_the_stated_rate() {
        let mut noise = gaussian(3, 8.0);
        let a = image(600, 500, |_, _| (128.0 + noise()).round() as u8);
        let b = image(600, 500, |_, _| (128.0 + noise()).round() as u8);
        let options = ChangeOptions { false_rate: 0.01, ..ChangeOptions::default() };
        let mask = pair_changes(&a.as_frame(), &b.as_frame(), &options).unwrap();
        let rate = mask.pixels().iter().filter(|&&changed| changed).count() as f64 / 300_000.0;
        assert!((0.008..0.012).contains(&rate), "{rate}");
    }

    #[test]
    fn footage_that_repeats_itself_has_the_lowest_threshold() {
        let frame = image(64, 48, |x, y| (x * 3 + y) as u8);
        let (a, options) = (frame.as_frame(), ChangeOptions::default());
        assert_eq!(noise_sd(&a, &a), Ok(0.0));
        assert_eq!(pair_threshold(&a, &a, &options), Ok(options.min_threshold));
    }

    #[test]
    fn frames_too_small_for_a_window_have_no_changes() {
        let (a, b) = (Image::filled(4, 9, 0u8), Image::filled(4, 9, 255u8));
        let mask = pair_changes(&a.as_frame(), &b.as_frame(), &ChangeOptions::default()).unwrap();
        assert!(!mask.pixels().iter().any(|&changed| changed));
    }

    #[test]
    fn frames_of_unequal_size_are_refused() {
        let (a, b) = (Image::filled(9, 9, 0u8), Image::filled(9, 8, 0u8));
        let error = pair_changes(&a.as_frame(), &b.as_frame(), &ChangeOptions::default()).unwrap_err();
        let ChangeError::Frame(error) = error else { panic!("{error}") };
        assert!(matches!(error, FrameError::SizeChanged { height: 8, expected_height: 9, .. }));
        assert_eq!(noise_sd(&a.as_frame(), &b.as_frame()), Err(error.clone()));
        assert_eq!(fit_norms(&a.as_frame(), &b.as_frame()), Err(error));
    }

    #[test]
    fn options_outside_their_ranges_are_refused() {
        let frame = Image::filled(9, 9, 0u8);
        let frame = frame.as_frame();
        let usual = ChangeOptions::default();
        for (name, options) in [
            ("threshold", fixed(f64::NAN)),
            ("false_rate", ChangeOptions { false_rate: 0.0, ..usual }),
            ("min_threshold", ChangeOptions { min_threshold: -1.0, ..usual }),
        ] {
            let refused =
                |error: ChangeError| matches!(error, ChangeError::Option(error) if error.name == name);
            assert!(pair_changes(&frame, &frame, &options).is_err_and(refused), "{name}");
            assert!(pair_threshold(&frame, &frame, &options).is_err_and(refused), "{name}");
            assert!(ChangeDetector::new(options).is_err_and(|error| error.name == name), "{name}");
        }
    }

    #[test]
    fn each_frame_is_compared_with_both_neighbours() {
        let at = |left: usize| image(40, 9, move |x, _| if (left..left + 3).contains(&x) { 200 } else { 50 });
        let frames = [at(5), at(15), at(25), at(25)];
        let options = ChangeOptions::default();
        let mut detector = ChangeDetector::new(options).unwrap();
        let mut masks: Vec<_> =
            frames.iter().filter_map(|frame| detector.push(&frame.as_frame()).unwrap()).collect();
        masks.extend(detector.finish());
        let pair =
            |i: usize| pair_changes(&frames[i].as_frame(), &frames[i + 1].as_frame(), &options).unwrap();
        let mut middle = pair(0);
        unite(&mut middle, &pair(1));
        assert_eq!(masks, [pair(0), middle, pair(1), pair(2)]);
        assert!(masks[1].at(6, 4) && masks[1].at(16, 4) && masks[1].at(26, 4));
        assert!(!masks[3].pixels().contains(&true));
    }

    /// With noise, the default threshold is that of one window in a million: sd times the square root of
    /// twice the quantile of chi-square with 6 degrees of freedom over 25 pixels (38.258336, scipy 1.17.1
    /// chi2.isf(1e-6, 6)).
    #[test]
    fn the_default_threshold_is_that_of_one_window_in_a_million() {
        let mut random = crate::synth::Random::new(6);
        let mut noisy = || {
            let grey = |normal: f32| (128.0 + 12.0 * normal).round().clamp(0.0, 255.0) as u8;
            let pixels = (0..160 * 120).map(|_| grey(random.normal_pair()[0]));
            Image::from_vec(160, 120, pixels.collect()).unwrap()
        };
        let (a, b) = (noisy(), noisy());
        let (a, b) = (a.as_frame(), b.as_frame());
        let sd = noise_sd(&a, &b).unwrap();
        assert!((sd / 12.0 - 1.0).abs() < 0.06, "{sd}");
        let found = pair_threshold(&a, &b, &ChangeOptions::default()).unwrap();
        assert!((found / (sd * (2.0 * 38.258336f64 / 25.0).sqrt()) - 1.0).abs() < 1e-6, "{found} {sd}");
    }

    /// Without noise the default threshold is 4 grey levels; a given threshold holds, however low.
    #[test]
    fn still_footage_has_a_least_threshold() {
        let changed = |by: u8, options: &ChangeOptions| {
            let before = Image::filled(40, 40, 100u8);
            let mut after = before.clone();
            (15..25).for_each(|y| after.row_mut(y)[15..25].fill(100 + by));
            pair_changes(&before.as_frame(), &after.as_frame(), options).unwrap().at(20, 20)
        };
        let default = ChangeOptions::default();
        assert_eq!([4, 5].map(|by| changed(by, &default)), [false, true]);
        let given = ChangeOptions { threshold: Some(1.5), ..default };
        assert_eq!([1, 2].map(|by| changed(by, &given)), [false, true]);
    }
}
