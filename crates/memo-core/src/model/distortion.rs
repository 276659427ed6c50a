//! Lens distortion on the normalised image plane (focal length 1, origin at the principal point).
//!
//! Two models: Brown's as in OpenCV (ideal to distorted) and Tsai's single radial term (distorted to ideal;
//! R. Tsai 1987, eq. 5). Each is a polynomial in one direction and is solved by Newton's method in the other.
//!
//! Limits: a polynomial folds back beyond some radius. Points beyond it have no image; they are refused
//! instead of being drawn inside the image. Fisheye and rational models are not supported.

use glam::{DMat2, DVec2};

/// The distortion model of a lens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Distortion {
    /// No distortion: an exact perspective image.
    #[default]
    None,
    /// OpenCV's five coefficients: `x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + tangential(p1, p2)`, r = |x|.
    Brown {
        /// Coefficient of r², radial.
        k1: f64,
        /// Coefficient of r⁴, radial.
        k2: f64,
        /// Tangential coefficient, along v.
        p1: f64,
        /// Tangential coefficient, along u.
        p2: f64,
        /// Coefficient of r⁶, radial.
        k3: f64,
    },
    /// Tsai's radial term: `x = x_d (1 + kappa r_d²)`, r_d = |x_d|.
    Tsai {
        /// Tsai's kappa1 (per mm²) times the square of the focal length (mm): dimensionless.
        kappa: f64,
    },
}

/// Newton's method stops at this step: far below 1e-10 px for any focal length up to 10 000 px.
const TOLERANCE: f64 = 4e-15;
const MAX_ITERATIONS: usize = 100;

impl Distortion {
    /// The model for OpenCV's coefficients (k1, k2, p1, p2, k3); all zero gives [`Distortion::None`].
    pub fn from_opencv(coefficients: [f64; 5]) -> Self {
        let [k1, k2, p1, p2, k3] = coefficients;
        if coefficients == [0.0; 5] { Self::None } else { Self::Brown { k1, k2, p1, p2, k3 } }
    }

    /// The distorted point of the ideal point `x`, both on the normalised plane; `None` beyond the radius at
    /// which the model folds.
    pub fn distort(&self, x: DVec2) -> Option<DVec2> {
        match *self {
            Self::None => Some(x),
            Self::Brown { .. } => self.is_unfolded(x).then(|| self.brown(x)),
            Self::Tsai { kappa } => tsai_distorted_radius(x.length(), kappa).map(|scale| x * scale),
        }
    }

    /// The ideal point of the distorted point `x_d`, both on the normalised plane; `None` if there is none
    /// inside the fold.
    pub fn undistort(&self, x_d: DVec2) -> Option<DVec2> {
        match *self {
            Self::None => Some(x_d),
            Self::Brown { .. } => self.brown_inverse(x_d),
            Self::Tsai { kappa } => {
                let kappa_r_sq = kappa * x_d.length_squared();
                (1.0 + 3.0 * kappa_r_sq > 0.0).then(|| x_d * (1.0 + kappa_r_sq))
            }
        }
    }

    /// Whether all coefficients are finite.
    pub fn is_finite(&self) -> bool {
        match *self {
            Self::None => true,
            Self::Brown { k1, k2, p1, p2, k3 } => [k1, k2, p1, p2, k3].iter().all(|k| k.is_finite()),
            Self::Tsai { kappa } => kappa.is_finite(),
        }
    }

    fn coefficients(&self) -> [f64; 5] {
        match *self {
            Self::Brown { k1, k2, p1, p2, k3 } => [k1, k2, p1, p2, k3],
            _ => [0.0; 5],
        }
    }

    fn brown(&self, x: DVec2) -> DVec2 {
        let [k1, k2, p1, p2, k3] = self.coefficients();
        let s = x.length_squared();
        let radial = 1.0 + s * (k1 + s * (k2 + s * k3));
        let cross = 2.0 * x.x * x.y;
        let tangential = DVec2::new(
            p1 * cross + p2 * (s + 2.0 * x.x * x.x), //
            p1 * (s + 2.0 * x.y * x.y) + p2 * cross,
        );
        x * radial + tangential
    }

    /// Jacobian of [`Self::brown`], which is symmetric.
    fn brown_jacobian(&self, x: DVec2) -> DMat2 {
        let [k1, k2, p1, p2, k3] = self.coefficients();
        let s = x.length_squared();
        let radial = 1.0 + s * (k1 + s * (k2 + s * k3));
        let slope = 2.0 * (k1 + s * (2.0 * k2 + s * 3.0 * k3));
        let xx = radial + slope * x.x * x.x + 2.0 * p1 * x.y + 6.0 * p2 * x.x;
        let yy = radial + slope * x.y * x.y + 6.0 * p1 * x.y + 2.0 * p2 * x.x;
        let xy = slope * x.x * x.y + 2.0 * (p1 * x.x + p2 * x.y);
        DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
    }

    /// Whether the radial part r (1 + k1 r² + k2 r⁴ + k3 r⁶) increases all the way from the centre to `x`.
    ///
    /// With s = r² its slope is the cubic g(s) = 1 + 3 k1 s + 5 k2 s² + 7 k3 s³, whose minimum on [0, s] is
    /// at an end or where g' = 3 k1 + 10 k2 s + 21 k3 s² = 0.
    fn is_unfolded(&self, x: DVec2) -> bool {
        let [k1, k2, _, _, k3] = self.coefficients();
        let g = |s: f64| 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * 7.0 * k3));
        let s = x.length_squared();
        let is_met = |turn: f64| turn > 0.0 && turn < s;
        g(s) > 0.0
            && quadratic_roots(21.0 * k3, 10.0 * k2, 3.0 * k1).into_iter().all(|t| !is_met(t) || g(t) > 0.0)
    }

    /// Newton's method from the distorted point; steps that do not reduce the error are halved.
    ///
    /// With one radial term the iterates approach from one side and no step is halved.
    fn brown_inverse(&self, x_d: DVec2) -> Option<DVec2> {
        let mut x = if self.is_before_the_fold(x_d) { x_d } else { DVec2::ZERO };
        let mut error = self.brown(x) - x_d;
        for _ in 0..MAX_ITERATIONS {
            if error.length() <= TOLERANCE * (1.0 + x_d.length()) {
                return Some(x);
            }
            let jacobian = self.brown_jacobian(x);
            if jacobian.determinant().abs() < 1e-12 {
                return None;
            }
            let step = jacobian.inverse() * error;
            (x, error) = self.closer(x, step, x_d, error.length())?;
        }
        None
    }

    /// [`Self::is_unfolded`], and inside the fold where the tangential terms shift it.
    fn is_before_the_fold(&self, x: DVec2) -> bool {
        self.is_unfolded(x) && self.brown_jacobian(x).determinant() > 0.0
    }

    /// The first of x - step, x - step/2, ... that is inside the fold and whose distorted point is closer to
    /// `x_d`.
    fn closer(&self, x: DVec2, step: DVec2, x_d: DVec2, error_length: f64) -> Option<(DVec2, DVec2)> {
        (0..40).find_map(|halvings| {
            let x = x - step * 0.5_f64.powi(halvings);
            let error = self.brown(x) - x_d;
            (self.is_before_the_fold(x) && error.length() < error_length).then_some((x, error))
        })
    }
}

/// Roots of a x² + b x + c without cancellation; NaN or infinite where there is none.
fn quadratic_roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let q = -0.5 * (b + (b * b - 4.0 * a * c).sqrt().copysign(b));
    [q / a, c / q]
}

/// r_d / r where r_d (1 + kappa r_d²) = r. Newton's method on r_d, starting at r, approaches from one side.
///
/// For kappa < 0 the left side has its maximum 2/3 r_f at the fold r_f = 1 / sqrt(-3 kappa).
fn tsai_distorted_radius(r: f64, kappa: f64) -> Option<f64> {
    if kappa < 0.0 && r >= 2.0 / 3.0 / (-3.0 * kappa).sqrt() {
        return None;
    }
    if r == 0.0 {
        return Some(1.0);
    }
    // In units of r: s (1 + c s²) = 1 with s = r_d / r.
    let c = kappa * r * r;
    let mut s = 1.0;
    for _ in 0..MAX_ITERATIONS {
        let step = (s * (1.0 + c * s * s) - 1.0) / (1.0 + 3.0 * c * s * s);
        s -= step;
        if step.abs() <= TOLERANCE {
            return Some(s);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn points_beyond_the_fold_have_no_image() {
        let barrel = Distortion::from_opencv([-0.3, 0.0, 0.0, 0.0, 0.0]);
        let fold = (1.0_f64 / 0.9).sqrt();
        assert!(barrel.distort(DVec2::new(fold * 0.999, 0.0)).is_some());
        assert_eq!(barrel.distort(DVec2::new(fold * 1.001, 0.0)), None);
        assert_eq!(barrel.undistort(DVec2::new(fold * 2.0 / 3.0 * 1.001, 0.0)), None);
    }

    #[test]
    fn a_fold_followed_by_growth_is_still_a_fold() {
        // g(s) = 1 - 3 s + 1.25 s² dips below zero between s = 0.4 and 2.
        let wavy = Distortion::from_opencv([-1.0, 0.25, 0.0, 0.0, 0.0]);
        assert!(wavy.distort(DVec2::new(0.6, 0.0)).is_some());
        assert_eq!(wavy.distort(DVec2::new(0.0, 2.0)), None);
    }

    #[test]
    fn the_tsai_fold_is_where_its_slope_vanishes() {
        let lens = Distortion::Tsai { kappa: -0.2 };
        let fold = (1.0_f64 / 0.6).sqrt();
        assert!(lens.undistort(DVec2::new(fold * 0.999, 0.0)).is_some());
        assert_eq!(lens.undistort(DVec2::new(fold * 1.001, 0.0)), None);
        assert!(lens.distort(DVec2::new(fold * 2.0 / 3.0 * 0.999_999, 0.0)).is_some());
        for beyond in [1.000_001, 1.1, 2.0, 5.0] {
            assert_eq!(lens.distort(DVec2::new(fold * 2.0 / 3.0 * beyond, 0.0)), None);
        }
    }

    #[test]
    fn the_jacobian_is_the_slope() {
        let lens = Distortion::from_opencv([-0.28, 0.09, 1e-3, -2e-3, -0.01]);
        let x = DVec2::new(0.4, -0.3);
        let jacobian = lens.brown_jacobian(x);
        for axis in [DVec2::X, DVec2::Y] {
            let slope = (lens.brown(x + axis * 1e-6) - lens.brown(x - axis * 1e-6)) / 2e-6;
            assert!((jacobian * axis - slope).length() < 1e-8);
        }
    }

    #[test]
    fn a_start_beyond_the_fold_that_tangential_terms_shift_is_given_up() {
        let (k1, k2, k3) = (0.3871901297456689, -0.1434687956196204, -0.03122052206013254);
        let (p1, p2) = (0.0022347674297831213, 0.0018532744519083966);
        let lens = Distortion::from_opencv([k1, k2, p1, p2, k3]);
        let ideal = DVec2::new(-0.8569709873993293, 0.6245862876882984);
        let distorted = lens.distort(ideal).unwrap();
        assert!(lens.is_unfolded(distorted) && lens.brown_jacobian(distorted).determinant() < 0.0);
        assert!((lens.undistort(distorted).unwrap() - ideal).length() < 1e-12);
    }

    proptest! {
        #[test]
        fn brown_undoes_itself(
            k1 in -0.4..0.4_f64, k2 in -0.2..0.2_f64, k3 in -0.1..0.1_f64,
            p1 in -0.005..0.005_f64, p2 in -0.005..0.005_f64,
            x in -1.0..1.0_f64, y in -0.8..0.8_f64,
        ) {
            let lens = Distortion::from_opencv([k1, k2, p1, p2, k3]);
            let ideal = DVec2::new(x, y);
            // Near the fold the inverse behaves like a square root and loses digits.
            let is_clear = lens.brown_jacobian(ideal).determinant() > 0.05 && lens.is_unfolded(ideal * 1.1);
            prop_assume!(is_clear);
            let back = lens.undistort(lens.distort(ideal).unwrap());
            prop_assert!(back.is_some_and(|b| (b - ideal).length() < 1e-12), "{:?}", back);
        }

        #[test]
        fn the_fold_is_where_sampling_finds_it(
            k1 in -1.0..1.0_f64, k2 in -1.0..1.0_f64, k3 in -1.0..1.0_f64, reach in 0.3..2.0_f64,
        ) {
            let lens = Distortion::from_opencv([k1, k2, 0.0, 0.0, k3]);
            let radius = |r: f64| lens.brown(DVec2::new(r, 0.0)).x;
            let slope = |i: u32| {
                let r = reach * f64::from(i) / 1000.0;
                (radius(r + 1e-5) - radius(r - 1e-5)) / 2e-5
            };
            let least = (0..=1000).map(slope).fold(f64::INFINITY, f64::min);
            prop_assume!(least.abs() > 1e-3);
            prop_assert_eq!(lens.is_unfolded(DVec2::new(reach, 0.0)), least > 0.0);
        }

        #[test]
        fn tsai_undoes_itself(kappa in -0.5..2.0_f64, x in -3.0..3.0_f64, y in -3.0..3.0_f64) {
            let lens = Distortion::Tsai { kappa };
            let ideal = DVec2::new(x, y);
            let Some(distorted) = lens.distort(ideal) else {
                prop_assert!(ideal.length() * (-3.0 * kappa).sqrt() > 0.666);
                return Ok(());
            };
            let back = lens.undistort(distorted);
            prop_assert!(back.is_none_or(|b| (b - ideal).length() < 1e-12), "{:?}", back);
            prop_assert!(back.is_some() || ideal.length() * (-3.0 * kappa).sqrt() > 0.666_66);
        }

        #[test]
        fn whatever_is_undistorted_is_distorted_back(
            k1 in -0.6..0.6_f64, k2 in -0.4..0.4_f64, k3 in -0.2..0.2_f64, x in -1.5..1.5_f64, y in -1.5..1.5_f64,
        ) {
            let lens = Distortion::from_opencv([k1, k2, 0.001, -0.002, k3]);
            let distorted = DVec2::new(x, y);
            if let Some(ideal) = lens.undistort(distorted) {
                prop_assert!((lens.distort(ideal).unwrap() - distorted).length() < 1e-13);
            }
        }
    }
}
