//! Smoothing of one quantity over time from the frames before and after: a constant-velocity Kalman filter
//! and the backward pass of Rauch, Tung and Striebel. Uneven times and missing values are allowed.

use crate::estimate::kalman::{ConstantVelocity, Noise, smooth};

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The value; NaN where nothing was measured.
    pub value: f64,
    /// Its standard deviation, in the value's unit.
    pub sd: f64,
}

impl Measured {
    /// A missing measurement.
    pub const NOTHING: Self = Self { value: f64::NAN, sd: f64::NAN };

    /// The fusion of two measurements of one quantity.
    #[must_use]
    pub fn fused(self, other: Self) -> Self {
        let weight = |m: Self| if m.value.is_finite() { 1.0 / (m.sd * m.sd).max(1e-12) } else { 0.0 };
        let [a, b] = [weight(self), weight(other)];
        if a == 0.0 || b == 0.0 {
            return if a == 0.0 { other } else { self };
        }
        Self { value: (a * self.value + b * other.value) / (a + b), sd: (a + b).sqrt().recip() }
    }
}

/// The difference between a measurement and its prediction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measurement minus prediction, in the unit of the value.
    pub value: f64,
    /// Variance of the difference, unit².
    pub variance: f64,
}

/// Duration of an acceleration, seconds: the velocity variance grows by acceleration² times this per second.
const ACCELERATION_LASTS_S: f64 = 0.1;

/// Standard deviation of the velocity before the first measurement, units per second.
const FIRST_VELOCITY_SD: f64 = 2.0;

/// Smallest standard deviation of a measurement: no model is exact.
const LEAST_SD: f64 = 1e-4;

fn noise(acceleration_sd: f64, measurement_sd: f64) -> Noise {
    Noise {
        velocity_variance_per_s: acceleration_sd * acceleration_sd * ACCELERATION_LASTS_S,
        measurement_variance: measurement_sd * measurement_sd,
    }
}

/// One step of the filter: predicts over `step_s` seconds and applies a measurement.
///
/// `filter` is `None` before the first measurement. The second value is the innovation, if there are a
/// prediction and a measurement.
pub fn filter_step(
    filter: Option<ConstantVelocity>,
    step_s: f64,
    measured: Measured,
    acceleration_sd: f64,
) -> (Option<ConstantVelocity>, Option<Innovation>) {
    let seen = measured.value.is_finite();
    let sd = measured.sd.max(LEAST_SD);
    let noise = noise(acceleration_sd, sd);
    match filter.map(|state| state.predict(step_s, &noise)) {
        None if seen => {
            let start =
                ConstantVelocity::new(measured.value, 0.0, sd * sd, FIRST_VELOCITY_SD * FIRST_VELOCITY_SD);
            (Some(start), None)
        }
        Some(state) if seen => {
            let innovation = Innovation {
                value: measured.value - state.position,
                variance: state.covariance[0].max(0.0) + sd * sd,
            };
            (Some(state.update(measured.value, &noise)), Some(innovation))
        }
        waiting => (waiting, None),
    }
}

/// Smooths a track. `acceleration_sd` in units/s². Between and after measurements the value is the expected
/// motion, with growing uncertainty; before the first measurement it is NaN.
///
/// # Panics
///
/// If there are fewer times than measurements.
pub fn smooth_track(times_s: &[f64], measured: &[Measured], acceleration_sd: f64) -> Vec<Measured> {
    let [times, count] = [times_s.len(), measured.len()];
    assert!(times >= count, "fewer times than measurements: {times} < {count}");
    let first = measured.iter().position(|m| m.value.is_finite()).unwrap_or(measured.len());
    let steps: Vec<f64> = times_s[first..].windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut filter = None;
    let mut filtered = Vec::with_capacity(measured.len() - first);
    for (k, m) in measured[first..].iter().enumerate() {
        let step_s = if k == 0 { 0.0 } else { steps[k - 1] };
        filter = filter_step(filter, step_s, *m, acceleration_sd).0;
        filtered.extend(filter);
    }
    let smoothed = smooth(&filtered, &steps, &noise(acceleration_sd, LEAST_SD));
    let known = smoothed.iter().map(|state| Measured { value: state.position, sd: state.position_sd() });
    std::iter::repeat_n(Measured::NOTHING, first).chain(known).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::Random;

    #[test]
    fn smoothing_halves_the_noise_of_a_swing_and_states_what_is_left() {
        let mut random = Random::new(11);
        let times_s: Vec<f64> = (0..400).map(|t| f64::from(t) * 0.05 + random.uniform(0.0, 0.01)).collect();
        let truth = |time_s: f64| 0.15 * (std::f64::consts::TAU * time_s).sin();
        let measured: Vec<Measured> = times_s
            .iter()
            .enumerate()
            .map(|(t, &time_s)| {
                let noise = 0.03 * f64::from(random.normal_pair()[0]);
                if t % 7 == 3 {
                    Measured::NOTHING
                } else {
                    Measured { value: truth(time_s) + noise, sd: 0.03 }
                }
            })
            .collect();
        let smoothed = smooth_track(&times_s, &measured, 4.0);
        let errors: Vec<f64> = smoothed.iter().zip(&times_s).map(|(s, &t)| s.value - truth(t)).collect();
        let rms = (errors.iter().map(|e| e * e).sum::<f64>() / 400.0).sqrt();
        let stated = smoothed.iter().map(|s| s.sd).sum::<f64>() / 400.0;
        assert!(rms < 0.018, "{rms}");
        assert!((rms / stated - 1.0).abs() < 0.25, "measured {rms}, stated {stated}");
    }

    #[test]
    #[should_panic(expected = "fewer times than measurements: 2 < 3")]
    fn measurements_without_a_time_are_refused() {
        smooth_track(&[0.0, 0.1], &[Measured::NOTHING; 3], 1.0);
    }

    #[test]
    fn nothing_is_known_before_the_first_measurement() {
        let one = Measured { value: 2.0, sd: 0.1 };
        let smoothed = smooth_track(&[0.0, 0.1, 0.2], &[Measured::NOTHING, one, Measured::NOTHING], 1.0);
        assert!(smoothed[0].value.is_nan());
        assert_eq!(smoothed[1].value, 2.0);
        assert!(smoothed[2].sd > smoothed[1].sd);
        assert!(smooth_track(&[0.0], &[Measured::NOTHING], 1.0)[0].value.is_nan());
        assert!(smooth_track(&[], &[], 1.0).is_empty());
    }

    /// Fusion of two measurements 10 ± 1 and 14 ± 2: weights 1 and 1/4.
    #[test]
    fn measurements_fuse_by_their_variances() {
        let [a, b] = [(10.0, 1.0), (14.0, 2.0)].map(|(value, sd)| Measured { value, sd });
        for fused in [a.fused(b), b.fused(a)] {
            assert!((fused.value - 10.8).abs() < 1e-12, "{fused:?}");
            assert!((fused.sd - 0.8f64.sqrt()).abs() < 1e-12, "{fused:?}");
        }
        assert_eq!(a.fused(Measured::NOTHING), a);
        assert_eq!(Measured::NOTHING.fused(a), a);
    }

    /// From 2 ± 0.1, at rest ± 2 per second: the variance of the velocity grows by 3² times 0.1 s per second,
    /// and affects the position from the next step on.
    #[test]
    fn an_innovation_is_as_unsure_as_prediction_and_measurement() {
        let first = Measured { value: 2.0, sd: 0.1 };
        let (filter, none) = filter_step(None, 0.0, first, 3.0);
        assert_eq!(none, None);
        let next = Measured { value: 5.0, sd: 0.5 };
        let innovation = filter_step(filter, 1.0, next, 3.0).1.unwrap();
        assert!((innovation.value - 3.0).abs() < 1e-12);
        assert!((innovation.variance - (0.01 + 4.0 + 0.25)).abs() < 1e-9, "{innovation:?}");
        let (waiting, nothing) = filter_step(filter, 1.0, Measured::NOTHING, 3.0);
        assert_eq!(nothing, None);
        let innovation = filter_step(waiting, 1.0, next, 3.0).1.unwrap();
        assert!((innovation.variance - (0.01 + 4.0 * 4.0 + 0.9 + 0.25)).abs() < 1e-9, "{innovation:?}");
        // No measurement counts as more accurate than a tenth of a millimetre.
        let (sharp, _) = filter_step(None, 0.0, Measured { value: 2.0, sd: 0.0 }, 3.0);
        assert!(sharp.unwrap().position_sd() >= 1e-4);
    }
}
