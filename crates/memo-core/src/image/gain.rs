//! A common change of brightness and contrast between two frames, such as automatic exposure causes.
//!
//! Model: a = scale * b + offset at unchanged, unsaturated pixels. Both frames have the same noise, so the
//! line is fitted by total least squares to about 4000 pixels on a grid. Pixels whose residual exceeds 2.5
//! robust standard deviations (moving objects) are excluded and the fit is repeated. The initial line matches
//! the quartiles of the two frames, which moving objects hardly change.
//!
//! Limits: a change that varies over the frame (a lamp, the edge of a cloud's shadow) and a nonlinear tone
//! curve are not modelled.

use super::frame::{Frame, FrameError, Image};

/// Grey values closer than this to 0 or 255 may be clipped and are not used.
const CLIPPED: u8 = 4;
/// Maximum number of trimming rounds; five are usual.
const MAX_ROUNDS: usize = 12;

/// The linear map from the grey values of one frame to those of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Contrast factor.
    pub scale: f64,
    /// Grey levels added after scaling.
    pub offset: f64,
}

impl Gain {
    /// The map that changes nothing.
    pub const IDENTITY: Gain = Gain { scale: 1.0, offset: 0.0 };

    /// The frame with every grey value mapped, rounded and clipped to 0..=255.
    pub fn apply(&self, frame: &Frame) -> Image<u8> {
        let table: [u8; 256] = std::array::from_fn(|grey| self.map(grey as f64).round() as u8);
        let mut image = frame.to_image();
        if table.iter().enumerate().any(|(grey, &mapped)| grey != usize::from(mapped)) {
            for grey in image.pixels_mut() {
                *grey = table[usize::from(*grey)];
            }
        }
        image
    }

    pub(super) fn map(&self, grey: f64) -> f64 {
        self.scale * grey + self.offset
    }
}

/// The map a = scale * b + offset of the unchanged pixels; more than half of the pixels must be unchanged.
///
/// With too little contrast to determine a scale, the result is scale 1 and the median difference; without
/// usable pixels it is the identity.
///
/// # Errors
///
/// The frames differ in size.
pub fn estimate_gain(a: &Frame, b: &Frame) -> Result<Gain, FrameError> {
    a.check_same_size(b)?;
    let pairs = sampled_pairs(a, b);
    if pairs.is_empty() {
        return Ok(Gain::IDENTITY);
    }
    let mut gain = quartile_gain(&pairs);
    let mut kept = 0;
    for _ in 0..MAX_ROUNDS {
        let inliers = inliers(&pairs, gain);
        if inliers.len() == kept {
            break;
        }
        kept = inliers.len();
        gain = total_least_squares(&inliers).unwrap_or_else(|| offset_only(&pairs));
    }
    Ok(gain)
}

/// Unclipped grey values (a, b) on a grid of about 4096 pixels.
pub(super) fn sampled_pairs(a: &Frame, b: &Frame) -> Vec<(f64, f64)> {
    let step = ((a.width() * a.height()) as f64 / 4096.0).sqrt().max(1.0) as usize;
    let usable = |grey: u8| (CLIPPED..=255 - CLIPPED).contains(&grey);
    let mut pairs = Vec::with_capacity(8192);
    for y in (0..a.height()).step_by(step) {
        let row = a.row(y).iter().zip(b.row(y)).step_by(step);
        pairs.extend(
            row.filter(|(a, b)| usable(**a) && usable(**b)).map(|(&a, &b)| (f64::from(a), f64::from(b))),
        );
    }
    pairs
}

/// The line through the quartiles of both grey-value distributions.
pub(super) fn quartile_gain(pairs: &[(f64, f64)]) -> Gain {
    let mut of_a: Vec<f64> = pairs.iter().map(|pair| pair.0).collect();
    let mut of_b: Vec<f64> = pairs.iter().map(|pair| pair.1).collect();
    let [a1, a2, a3] = quartiles(&mut of_a);
    let [b1, b2, b3] = quartiles(&mut of_b);
    let scale = if b3 - b1 < 2.0 || a3 - a1 < 2.0 { 1.0 } else { (a3 - a1) / (b3 - b1) };
    Gain { scale, offset: a2 - scale * b2 }
}

fn quartiles(values: &mut [f64]) -> [f64; 3] {
    values.sort_unstable_by(f64::total_cmp);
    [1, 2, 3].map(|i| values[i * (values.len() - 1) / 4])
}

/// The pairs within 2.5 robust standard deviations of the line, but not less than one grey level.
fn inliers(pairs: &[(f64, f64)], gain: Gain) -> Vec<(f64, f64)> {
    let residual = |&(a, b): &(f64, f64)| (a - gain.map(b)).abs();
    let mut sizes: Vec<f64> = pairs.iter().map(residual).collect();
    let [_, median, _] = quartiles(&mut sizes);
    let limit = (2.5 * 1.4826 * median).max(1.0);
    pairs.iter().copied().filter(|pair| residual(pair) <= limit).collect()
}

/// The line with the smallest sum of squared perpendicular distances; `None` when the grey values hardly vary
/// or are not correlated.
fn total_least_squares(pairs: &[(f64, f64)]) -> Option<Gain> {
    let n = pairs.len() as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>() / n;
    let (mean_a, mean_b) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    for &(a, b) in pairs {
        let (a, b) = (a - mean_a, b - mean_b);
        (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
    }
    // With a correlation below 0.9 or a standard deviation under two grey levels, noise would determine the
    // slope.
    if bb < 4.0 * n || ab <= 0.0 || ab * ab < 0.81 * aa * bb {
        return None;
    }
    let difference = aa - bb;
    let scale = (difference + (difference * difference + 4.0 * ab * ab).sqrt()) / (2.0 * ab);
    Some(Gain { scale, offset: mean_a - scale * mean_b })
}

fn offset_only(pairs: &[(f64, f64)]) -> Gain {
    let mut differences: Vec<f64> = pairs.iter().map(|(a, b)| a - b).collect();
    Gain { scale: 1.0, offset: quartiles(&mut differences)[1] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ChangeOptions, pair_changes};
    use proptest::prelude::*;

    /// A smooth scene with a dark rectangle whose left edge is given; `tone` maps scene values to grey
    /// values.
    fn scene(left: usize, tone: impl Fn(f64) -> f64) -> Image<u8> {
        let grey = |x: usize, y: usize| {
            if (left..left + 40).contains(&x) && y > 30 {
                return 30.0;
            }
            110.0 + 45.0 * (x as f64 / 17.0).sin() * (y as f64 / 11.0).cos()
        };
        let pixels = (0..160 * 120).map(|i| tone(grey(i % 160, i / 160)).round() as u8).collect();
        Image::from_vec(160, 120, pixels).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn planted_gain_is_recovered_with_a_moving_object(scale in 0.75f64..1.3, offset in -15.0f64..15.0) {
            let (a, b) = (scene(30, |grey| scale * grey + offset), scene(70, |grey| grey));
            let gain = estimate_gain(&a.as_frame(), &b.as_frame()).unwrap();
            prop_assert!((gain.scale - scale).abs() < 0.01, "{gain:?}");
            prop_assert!((gain.map(110.0) - (scale * 110.0 + offset)).abs() < 0.3, "{gain:?}");
        }
    }

    #[test]
    fn a_drift_of_exposure_is_no_change_once_compensated() {
        let (a, b) = (scene(30, |grey| grey), scene(36, |grey| 1.1 * grey - 3.0));
        let marked = |compensate_gain| {
            let options = ChangeOptions { threshold: Some(4.0), compensate_gain, ..ChangeOptions::default() };
            let mask = pair_changes(&a.as_frame(), &b.as_frame(), &options).unwrap();
            mask.pixels().iter().filter(|&&changed| changed).count()
        };
        assert!(marked(false) > 10_000);
        assert!((2 * 6 * 89..2 * 12 * 93).contains(&marked(true)), "{}", marked(true));
    }

    #[test]
    fn a_flat_frame_fixes_the_offset_only() {
        let (a, b) = (Image::filled(32, 32, 90u8), Image::filled(32, 32, 80u8));
        assert_eq!(estimate_gain(&a.as_frame(), &b.as_frame()).unwrap(), Gain { scale: 1.0, offset: 10.0 });
        let black = Image::filled(32, 32, 0u8);
        assert_eq!(estimate_gain(&a.as_frame(), &black.as_frame()).unwrap(), Gain::IDENTITY);
    }

    #[test]
    fn mapping_rounds_and_clips() {
        let image = Image::from_vec(3, 1, vec![0, 100, 250]).unwrap();
        let gain = Gain { scale: 1.1, offset: -2.6 };
        assert_eq!(gain.apply(&image.as_frame()).pixels(), [0, 107, 255]);
    }

    /// Inliers are within two and a half standard deviations of 1.4826 medians each: 98.8 % of normal
    /// residuals.
    #[test]
    fn inliers_are_most_of_what_is_normal() {
        let mut random = crate::synth::Random::new(2);
        let pairs: Vec<(f64, f64)> = (0..20_000)
            .map(|i| {
                let b = f64::from(i % 200) + 20.0;
                (0.9 * b + 5.0 + 6.0 * f64::from(random.normal_pair()[0]), b)
            })
            .collect();
        let share = inliers(&pairs, Gain { scale: 0.9, offset: 5.0 }).len() as f64 / 20_000.0;
        // Two-sided 2.5 standard deviations of a normal distribution: 0.98758.
        assert!((share - 0.98758).abs() < 0.004, "{share}");
    }

    #[test]
    fn quartiles_give_an_exact_gain_away() {
        let pairs: Vec<(f64, f64)> = (0..101).map(|i| (0.8 * f64::from(i) + 10.0, f64::from(i))).collect();
        let found = quartile_gain(&pairs);
        assert!((found.scale - 0.8).abs() < 1e-12 && (found.offset - 10.0).abs() < 1e-12, "{found:?}");
    }

    /// A scale is estimated from frames whose correlation is at least 0.9; other frames give an offset alone.
    #[test]
    fn frames_that_hardly_go_together_have_no_scale() {
        let mut random = crate::synth::Random::new(4);
        for (noise, has_scale) in [(0.3, true), (0.6, false)] {
            let pairs: Vec<(f64, f64)> = (0..5000)
                .map(|_| {
                    let [a, b] = random.normal_pair().map(f64::from);
                    (100.0 + 20.0 * (a + noise * b), 90.0 + 20.0 * a)
                })
                .collect();
            // Correlations 0.958 and 0.857.
            assert_eq!(total_least_squares(&pairs).is_some(), has_scale, "{noise}");
        }
    }

    #[test]
    fn greys_are_rounded_to_the_nearest() {
        let frame = Image::from_vec(3, 1, vec![100u8, 101, 103]).unwrap();
        let halved = Gain { scale: 0.5, offset: 0.2 }.apply(&frame.as_frame());
        assert_eq!(halved.pixels(), [50, 51, 52]);
    }
}
