//! The discrete linear Kalman filter of the walker's state (Rohr 1994, section 5.2, eqs. 12-22).
//!
//! The state is (X, X', Y, Y', Z, Z', pose, pose'), and all matrices of eqs. (19)-(22) are block diagonal, so
//! the filter splits exactly into four independent filters of position and velocity; [`ConstantVelocity`] is
//! one of them. Time is in seconds instead of the paper's images, so any frame rate and uneven time stamps
//! work.

use crate::OptionError;

/// Process and measurement noise of one coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Variance that the velocity gains per second, (unit/s)²/s.
    pub velocity_variance_per_s: f64,
    /// Variance of a measurement, unit².
    pub measurement_variance: f64,
}

/// Noise of the filtered coordinates; the defaults are the printed values at the paper's 25 images per
/// second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterOptions {
    /// Along the walking direction, metres. Printed: sigma_Q = 0.3 * 6.4 cm/image, sigma_R = 20 cm.
    pub along: Noise,
    /// Height above the level of walking, metres. Printed: sigma_Q = 0, sigma_R = 10 cm.
    pub vertical: Noise,
    /// Gait phase, cycles. Printed: sigma_Q = 0.3 * 0.04 /image, sigma_R = 0.2.
    pub phase: Noise,
}

/// Image rate of the paper's sequences, images per second.
const PAPER_RATE_HZ: f64 = 25.0;

impl Default for FilterOptions {
    fn default() -> Self {
        // A velocity step of s unit/image in every image is a step of s * 25 unit/s every 1/25 s.
        let per_s = |step_per_image: f64| (step_per_image * PAPER_RATE_HZ).powi(2) * PAPER_RATE_HZ;
        Self {
            along: Noise { velocity_variance_per_s: per_s(0.3 * 0.064), measurement_variance: 0.04 },
            vertical: Noise { velocity_variance_per_s: 0.0, measurement_variance: 0.01 },
            phase: Noise { velocity_variance_per_s: per_s(0.3 * 0.04), measurement_variance: 0.04 },
        }
    }
}

impl FilterOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        for noise in [self.along, self.vertical, self.phase] {
            OptionError::unless_at_least_0("velocity_variance_per_s", noise.velocity_variance_per_s)?;
            OptionError::unless_positive("measurement_variance", noise.measurement_variance)?;
        }
        Ok(())
    }

    /// The noise of measurements of which this share was visible: its variance grows with the inverse square.
    #[must_use]
    pub fn of_visible_share(&self, share: f64) -> Self {
        let of = |noise: Noise| Noise {
            measurement_variance: noise.measurement_variance / (share * share).max(f64::MIN_POSITIVE),
            ..noise
        };
        Self { along: of(self.along), vertical: of(self.vertical), phase: of(self.phase) }
    }

    /// The noise of somebody whose legs swing this share as far as the average's: contours that move less show the phase
    /// less well, and neighbouring frames err alike. Its variance grows with the inverse fourth power: with the inverse
    /// square, the phase of two of six drawn people with half the swing stood still.
    #[must_use]
    pub fn of_swing(&self, share: f64) -> Self {
        let measurement_variance = self.phase.measurement_variance / share.powi(4).max(f64::MIN_POSITIVE);
        Self { phase: Noise { measurement_variance, ..self.phase }, ..*self }
    }
}

/// Position and velocity of one coordinate, with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConstantVelocity {
    /// Estimated position, unit.
    pub position: f64,
    /// Estimated velocity, unit/s.
    pub velocity: f64,
    /// Covariance: variance of position, covariance, variance of velocity.
    pub covariance: [f64; 3],
}

impl ConstantVelocity {
    /// A state whose position and velocity have independent errors.
    pub fn new(position: f64, velocity: f64, position_variance: f64, velocity_variance: f64) -> Self {
        Self { position, velocity, covariance: [position_variance, 0.0, velocity_variance] }
    }

    /// Standard deviation of the position.
    pub fn position_sd(&self) -> f64 {
        self.covariance[0].max(0.0).sqrt()
    }

    /// Standard deviation of the velocity.
    pub fn velocity_sd(&self) -> f64 {
        self.covariance[2].max(0.0).sqrt()
    }

    /// The state after `dt_s` seconds. Eqs. (14), (15): p* = Phi p, P* = Phi P Phi^T + Q with Phi = (1 dt; 0
    /// 1) and Q on the velocity alone.
    #[must_use]
    pub fn predict(&self, dt_s: f64, noise: &Noise) -> Self {
        let [pp, pv, vv] = self.covariance;
        Self {
            position: self.position + dt_s * self.velocity,
            velocity: self.velocity,
            covariance: [
                pp + 2.0 * dt_s * pv + dt_s * dt_s * vv,
                pv + dt_s * vv,
                vv + noise.velocity_variance_per_s * dt_s,
            ],
        }
    }

    /// The state after a measured position. Eqs. (16)-(18) with H = (1 0): K = P* H^T (H P* H^T + R)^-1, p =
    /// p* + K (z - H p*), P = (I - K H) P*.
    #[must_use]
    pub fn update(&self, measured: f64, noise: &Noise) -> Self {
        let [pp, pv, vv] = self.covariance;
        let s = pp + noise.measurement_variance;
        let (k0, k1) = (pp / s, pv / s);
        let innovation = measured - self.position;
        Self {
            position: self.position + k0 * innovation,
            velocity: self.velocity + k1 * innovation,
            covariance: [(1.0 - k0) * pp, (1.0 - k0) * pv, vv - k1 * pv],
        }
    }
}

/// Rauch-Tung-Striebel smoothing of a filtered coordinate: the state at each frame given all frames, later
/// ones included.
///
/// `filtered[k]` is the state after frame k; `dt_s[k]` is the time from frame k to k + 1, seconds.
///
/// # Panics
///
/// If there are fewer times than pairs of successive states.
pub fn smooth(filtered: &[ConstantVelocity], dt_s: &[f64], noise: &Noise) -> Vec<ConstantVelocity> {
    let [steps, times] = [filtered.len().saturating_sub(1), dt_s.len()];
    assert!(times >= steps, "fewer times than pairs of states: {times} < {steps}");
    let mut smoothed = filtered.to_vec();
    for k in (0..filtered.len().saturating_sub(1)).rev() {
        smoothed[k] = smooth_step(&filtered[k], &smoothed[k + 1], dt_s[k], noise);
    }
    smoothed
}

/// C = P Phi^T P*^-1, p_s = p + C (p_s' - p*), P_s = P + C (P_s' - P*) C^T.
fn smooth_step(
    now: &ConstantVelocity,
    later: &ConstantVelocity,
    dt_s: f64,
    noise: &Noise,
) -> ConstantVelocity {
    let prior = now.predict(dt_s, noise);
    let [a, b, d] = prior.covariance;
    let determinant = a * d - b * b;
    if determinant <= 1e-12 * a * d {
        // Only without process noise: the state then follows from the later state alone.
        return later.predict(-dt_s, &Noise { velocity_variance_per_s: 0.0, ..*noise });
    }
    let [pp, pv, vv] = now.covariance;
    // Rows of P Phi^T: position (pp + dt pv, pv), velocity (pv + dt vv, vv).
    let gain = |x: f64, y: f64| ((x * d - y * b) / determinant, (y * a - x * b) / determinant);
    let (c00, c01) = gain(pp + dt_s * pv, pv);
    let (c10, c11) = gain(pv + dt_s * vv, vv);
    let (dx, dv) = (later.position - prior.position, later.velocity - prior.velocity);
    let [da, db, dd] = [later.covariance[0] - a, later.covariance[1] - b, later.covariance[2] - d];
    ConstantVelocity {
        position: now.position + c00 * dx + c01 * dv,
        velocity: now.velocity + c10 * dx + c11 * dv,
        covariance: [
            pp + c00 * c00 * da + 2.0 * c00 * c01 * db + c01 * c01 * dd,
            pv + c00 * c10 * da + (c00 * c11 + c01 * c10) * db + c01 * c11 * dd,
            vv + c10 * c10 * da + 2.0 * c10 * c11 * db + c11 * c11 * dd,
        ],
    }
}

#[cfg(test)]
mod tests;
