//! The filter and the smoother against explicit matrices, and their covariances against simulated motion.

use super::*;
use crate::synth::Random;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// Standard deviations of section 6 in metres and cycles: sigma_Q per image, sigma_R.
const PRINTED_ALONG: [f64; 2] = [0.3 * 0.064, 0.2];
const PRINTED_VERTICAL: [f64; 2] = [0.0, 0.1];
const PRINTED_PHASE: [f64; 2] = [0.3 * 0.04, 0.2];

fn normal(random: &mut Random) -> f64 {
    f64::from(random.normal_pair()[0])
}

/// Frame times at a mean rate, every interval up to 40 % shorter or longer.
fn uneven_times_s(rate_hz: f64, count: usize, random: &mut Random) -> Vec<f64> {
    let mut time_s = 0.0;
    let mut next = |_| {
        time_s += random.uniform(0.6, 1.4) / rate_hz;
        time_s
    };
    (0..count).map(&mut next).collect()
}

#[test]
fn printed_variances_are_reproduced_at_25_images_a_second() {
    let o = FilterOptions::default();
    let per_image = |n: &Noise| n.velocity_variance_per_s / 25.0 / 625.0;
    assert!((per_image(&o.along) * 1e4 - 3.69).abs() < 0.01, "cm²/image²");
    assert!((per_image(&o.phase) - 0.000_144).abs() < 1e-9);
    for (noise, [sigma_q, sigma_r]) in
        [(o.along, PRINTED_ALONG), (o.vertical, PRINTED_VERTICAL), (o.phase, PRINTED_PHASE)]
    {
        assert!((per_image(&noise) - sigma_q * sigma_q).abs() < 1e-12, "{noise:?}");
        assert!((noise.measurement_variance - sigma_r * sigma_r).abs() < 1e-12, "{noise:?}");
    }
}

/// Eqs. (14)-(22) with the matrices as printed. The state is (X, X', Y, Y', pose, pose'); Z is constant
/// (section 5.2).
struct Printed {
    state: SVector<f64, 6>,
    covariance: SMatrix<f64, 6, 6>,
}

impl Printed {
    fn step(&mut self, dt_s: f64, measured: Option<[f64; 3]>) {
        let (mut phi, mut q) = (SMatrix::<f64, 6, 6>::identity(), SMatrix::<f64, 6, 6>::zeros());
        let (mut h, mut r) = (SMatrix::<f64, 3, 6>::zeros(), SMatrix::<f64, 3, 3>::zeros());
        for (i, [sigma_q, sigma_r]) in
            [PRINTED_ALONG, PRINTED_VERTICAL, PRINTED_PHASE].into_iter().enumerate()
        {
            phi[(2 * i, 2 * i + 1)] = dt_s;
            // 25 independent steps of sigma_Q unit/image per second, each 25 sigma_Q unit/s.
            q[(2 * i + 1, 2 * i + 1)] = (25.0 * sigma_q).powi(2) * 25.0 * dt_s;
            h[(i, 2 * i)] = 1.0;
            r[(i, i)] = sigma_r * sigma_r;
        }
        self.state = phi * self.state;
        self.covariance = phi * self.covariance * phi.transpose() + q;
        let Some(measured) = measured else { return };
        let s = h * self.covariance * h.transpose() + r;
        let gain = self.covariance * h.transpose() * s.try_inverse().unwrap();
        self.state += gain * (SVector::from(measured) - h * self.state);
        self.covariance = (SMatrix::identity() - gain * h) * self.covariance;
    }

    fn assert_equals(&self, split: &[ConstantVelocity; 3]) {
        for (i, part) in split.iter().enumerate() {
            let (p, v) = (2 * i, 2 * i + 1);
            let off = [self.state[p] - part.position, self.state[v] - part.velocity];
            assert!(off.iter().all(|x| x.abs() < 1e-9), "coordinate {i}: off by {off:?}");
            let block = [(p, p), (p, v), (v, v)].map(|at| self.covariance[at]);
            let off = block.iter().zip(part.covariance).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "coordinate {i}: {block:?} against {:?}", part.covariance);
        }
        let coupled = self.covariance[(0, 2)].abs() + self.covariance[(1, 5)].abs();
        assert!(coupled < 1e-15, "the coordinates do not influence each other");
    }
}

#[test]
fn the_split_filter_equals_the_printed_matrices_at_uneven_times_and_several_rates() {
    let options = FilterOptions::default();
    let noise = [options.along, options.vertical, options.phase];
    for rate_hz in [12.5, 25.0, 50.0, 120.0] {
        let mut random = Random::new(rate_hz as u64);
        let mut split = [
            ConstantVelocity::new(0.3, 1.4, 0.04, 0.2),
            ConstantVelocity::new(1.2, 0.0, 0.01, 0.001),
            ConstantVelocity::new(0.7, 0.9, 0.04, 0.1),
        ];
        let mut printed = Printed { state: SVector::zeros(), covariance: SMatrix::zeros() };
        for (i, part) in split.iter().enumerate() {
            (printed.state[2 * i], printed.state[2 * i + 1]) = (part.position, part.velocity);
            printed.covariance[(2 * i, 2 * i)] = part.covariance[0];
            printed.covariance[(2 * i + 1, 2 * i + 1)] = part.covariance[2];
        }
        let mut before_s = 0.0;
        for (k, time_s) in uneven_times_s(rate_hz, 80, &mut random).into_iter().enumerate() {
            let dt_s = time_s - before_s;
            let mut near = |mean: f64, sd: f64| mean + sd * normal(&mut random);
            let measured = [near(0.3 + 1.5 * time_s, 0.2), near(1.2, 0.1), near(0.7 + 0.95 * time_s, 0.2)];
            // Every ninth frame has no measurement.
            let measured = (k % 9 != 8).then_some(measured);
            printed.step(dt_s, measured);
            for i in 0..3 {
                split[i] = split[i].predict(dt_s, &noise[i]);
                if let Some(measured) = measured {
                    split[i] = split[i].update(measured[i], &noise[i]);
                }
            }
            printed.assert_equals(&split);
            before_s = time_s;
        }
    }
}

#[test]
fn coasting_a_second_is_as_uncertain_at_every_rate() {
    let noise = FilterOptions::default().along;
    let start = ConstantVelocity::new(1.0, 1.5, 0.01, 0.1);
    for rate_hz in [12.5, 25.0, 50.0, 120.0f64] {
        let frames = rate_hz.round() as usize;
        let coasted = (0..frames).fold(start, |state, _| state.predict(1.0 / frames as f64, &noise));
        assert!((coasted.position - 2.5).abs() < 1e-9 && coasted.velocity == 1.5);
        let velocity_variance = 0.1 + (0.48f64).powi(2) * 25.0;
        assert!((coasted.covariance[2] - velocity_variance).abs() < 1e-9, "{rate_hz} Hz: {coasted:?}");
        // White acceleration gives q t³ / 3, up to the step of a frame.
        let white = 0.01 + 0.1 + 0.48f64.powi(2) * 25.0 / 3.0;
        assert!((coasted.covariance[0] / white - 1.0).abs() < 1.6 / rate_hz, "{rate_hz} Hz: {coasted:?}");
    }
}

/// The result of filtering one simulated walk: its last frame, and its innovations divided by their predicted
/// standard deviations.
struct Simulated {
    /// (estimate - truth)ᵀ P^-1 (estimate - truth) of position and velocity.
    nees: f64,
    innovations: Vec<f64>,
}

/// A coordinate whose velocity changes at random in every frame (eq. 12), measured at uneven times.
fn simulated(rate_hz: f64, noise: &Noise, random: &mut Random) -> Simulated {
    let measured_sd = noise.measurement_variance.sqrt();
    let (start_sd, start_velocity_sd) = (0.2, 0.4);
    let (mut position, mut velocity) = (start_sd * normal(random), 1.4 + start_velocity_sd * normal(random));
    let mut state =
        ConstantVelocity::new(0.0, 1.4, start_sd * start_sd, start_velocity_sd * start_velocity_sd);
    let (mut before_s, mut innovations) = (0.0, vec![]);
    for time_s in uneven_times_s(rate_hz, (2.5 * rate_hz) as usize, random) {
        let dt_s = time_s - before_s;
        position += dt_s * velocity;
        velocity += (noise.velocity_variance_per_s * dt_s).sqrt() * normal(random);
        let prior = state.predict(dt_s, noise);
        let measured = position + measured_sd * normal(random);
        let predicted_sd = (prior.covariance[0] + noise.measurement_variance).sqrt();
        innovations.push((measured - prior.position) / predicted_sd);
        state = prior.update(measured, noise);
        before_s = time_s;
    }
    let [pp, pv, vv] = state.covariance;
    let (dx, dv) = (state.position - position, state.velocity - velocity);
    let nees = (dx * dx * vv - 2.0 * dx * dv * pv + dv * dv * pp) / (pp * vv - pv * pv);
    Simulated { nees, innovations }
}

/// For a consistent filter the mean of `nees` is 2, with a standard deviation of 2 / sqrt(walks), and the
/// innovations are white with variance 1.
#[test]
fn errors_and_innovations_of_simulated_motion_are_as_large_as_the_covariance_says() {
    let noise = FilterOptions::default().along;
    for rate_hz in [12.5, 50.0, 120.0] {
        let mut random = Random::new(1994);
        let walks: Vec<Simulated> = (0..500).map(|_| simulated(rate_hz, &noise, &mut random)).collect();
        let nees = walks.iter().map(|w| w.nees).sum::<f64>() / walks.len() as f64;
        assert!((1.7..2.3).contains(&nees), "{rate_hz} Hz: squared error over covariance {nees}");
        let all = || walks.iter().flat_map(|w| &w.innovations);
        let count = all().count() as f64;
        let variance = all().map(|x| x * x).sum::<f64>() / count;
        assert!((0.97..1.03).contains(&variance), "{rate_hz} Hz: innovations' variance {variance}");
        let lagged = walks.iter().flat_map(|w| w.innovations.windows(2)).map(|w| w[0] * w[1]).sum::<f64>();
        assert!((lagged / count).abs() < 0.02, "{rate_hz} Hz: autocorrelation {}", lagged / count);
    }
}

/// Means and covariances of all states of a series given all its measurements, by conditioning one large
/// Gaussian. The unknowns u are the first state and the changes of velocity; every state is linear in them.
fn conditioned(
    start: &ConstantVelocity,
    dt_s: &[f64],
    measured: &[Option<f64>],
    noise: &Noise,
) -> Vec<ConstantVelocity> {
    let frames = measured.len();
    let unknowns = frames + 1;
    let mut states = DMatrix::<f64>::zeros(2 * frames, unknowns);
    (states[(0, 0)], states[(1, 1)]) = (1.0, 1.0);
    let mut variance = DMatrix::<f64>::zeros(unknowns, unknowns);
    variance[(0, 0)] = start.covariance[0];
    (variance[(0, 1)], variance[(1, 0)]) = (start.covariance[1], start.covariance[1]);
    variance[(1, 1)] = start.covariance[2];
    for k in 1..frames {
        for u in 0..unknowns {
            let (position, velocity) = (states[(2 * k - 2, u)], states[(2 * k - 1, u)]);
            states[(2 * k, u)] = position + dt_s[k - 1] * velocity;
            states[(2 * k + 1, u)] = velocity;
        }
        states[(2 * k + 1, k + 1)] += 1.0;
        variance[(k + 1, k + 1)] = noise.velocity_variance_per_s * dt_s[k - 1];
    }
    let mut mean = DVector::<f64>::zeros(unknowns);
    (mean[0], mean[1]) = (start.position, start.velocity);
    let seen: Vec<(usize, f64)> = measured.iter().enumerate().filter_map(|(k, z)| Some((k, (*z)?))).collect();
    let h = DMatrix::from_fn(seen.len(), unknowns, |row, u| states[(2 * seen[row].0, u)]);
    let z = DVector::from_fn(seen.len(), |row, _| seen[row].1);
    let s = &h * &variance * h.transpose()
        + DMatrix::identity(seen.len(), seen.len()) * noise.measurement_variance;
    let gain = &variance * h.transpose() * s.try_inverse().unwrap();
    let posterior_mean = &states * (&mean + &gain * (z - &h * &mean));
    let posterior = &states * (&variance - &gain * &h * &variance) * states.transpose();
    let state = |k: usize| ConstantVelocity {
        position: posterior_mean[2 * k],
        velocity: posterior_mean[2 * k + 1],
        covariance: [(2 * k, 2 * k), (2 * k, 2 * k + 1), (2 * k + 1, 2 * k + 1)].map(|at| posterior[at]),
    };
    (0..frames).map(state).collect()
}

/// The series filtered frame by frame; `start` is the state before the first measurement.
fn filtered(
    start: &ConstantVelocity,
    dt_s: &[f64],
    measured: &[Option<f64>],
    noise: &Noise,
) -> Vec<ConstantVelocity> {
    let mut state = *start;
    let step = |(k, z): (usize, &Option<f64>)| {
        if k > 0 {
            state = state.predict(dt_s[k - 1], noise);
        }
        state = z.map_or(state, |z| state.update(z, noise));
        state
    };
    measured.iter().enumerate().map(step).collect()
}

#[test]
fn the_smoother_equals_the_series_conditioned_as_a_whole() {
    let still = Noise { velocity_variance_per_s: 0.0, measurement_variance: 0.01 };
    let along = FilterOptions::default().along;
    let correlated = ConstantVelocity { position: 0.1, velocity: 1.2, covariance: [0.05, 0.03, 0.2] };
    let series = [
        ("printed", ConstantVelocity::new(0.3, 1.4, 0.04, 0.2), along),
        ("correlated start", correlated, along),
        ("no process noise", ConstantVelocity::new(0.3, 1.4, 0.04, 0.2), still),
        ("velocity known exactly", ConstantVelocity::new(1.2, 0.0, 4e-4, 0.0), still),
        ("start known exactly", ConstantVelocity::new(0.3, 1.4, 0.0, 0.2), still),
    ];
    for (name, start, noise) in series {
        for rate_hz in [12.5, 120.0] {
            let mut random = Random::new(7);
            let times_s = uneven_times_s(rate_hz, 25, &mut random);
            let dt_s: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
            let measured: Vec<Option<f64>> = times_s
                .iter()
                .enumerate()
                .map(|(k, t)| (k % 6 != 4).then(|| start.position + 1.5 * t + 0.2 * normal(&mut random)))
                .collect();
            let smoothed = smooth(&filtered(&start, &dt_s, &measured, &noise), &dt_s, &noise);
            for (k, (s, whole)) in
                smoothed.iter().zip(conditioned(&start, &dt_s, &measured, &noise)).enumerate()
            {
                let of = |c: &ConstantVelocity| {
                    [c.position, c.velocity, c.covariance[0], c.covariance[1], c.covariance[2]]
                };
                let off = of(s).iter().zip(of(&whole)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(off < 1e-8, "{name}, {rate_hz} Hz, frame {k}: {s:?} against {whole:?}");
            }
        }
    }
}

#[test]
#[should_panic(expected = "fewer times than pairs of states: 1 < 2")]
fn states_without_the_time_between_them_are_refused() {
    let noise = Noise { velocity_variance_per_s: 1.0, measurement_variance: 1.0 };
    smooth(&[ConstantVelocity::new(0.0, 0.0, 1.0, 1.0); 3], &[0.1], &noise);
}

#[test]
fn no_frames_and_one_frame_are_smoothed_to_themselves() {
    let noise = FilterOptions::default().along;
    assert!(smooth(&[], &[], &noise).is_empty());
    let one = ConstantVelocity::new(1.0, 2.0, 0.1, 0.2);
    assert_eq!(smooth(&[one], &[], &noise), [one]);
}

#[test]
fn a_standard_deviation_is_never_nan() {
    let rounded = ConstantVelocity { position: 0.0, velocity: 0.0, covariance: [-1e-18, 0.0, -1e-18] };
    assert_eq!((rounded.position_sd(), rounded.velocity_sd()), (0.0, 0.0));
    let state = ConstantVelocity::new(0.0, 0.0, 0.04, 0.09);
    assert!((state.position_sd() - 0.2).abs() < 1e-12 && (state.velocity_sd() - 0.3).abs() < 1e-12);
}

#[test]
fn less_swing_shows_the_phase_less_and_nothing_else() {
    let all = FilterOptions::default();
    let half = all.of_swing(0.5);
    assert_eq!((half.along, half.vertical), (all.along, all.vertical));
    assert!((half.phase.measurement_variance / all.phase.measurement_variance - 16.0).abs() < 1e-12);
    assert_eq!(half.phase.velocity_variance_per_s, all.phase.velocity_variance_per_s);
    assert_eq!(all.of_swing(1.0), all);
    assert!(all.of_swing(0.0).phase.measurement_variance.is_finite());
}
