//! Euler angles of rotations about three different coordinate axes, as the channels of motion files hold them.
//!
//! With R = R_i(a) R_j(b) R_k(c), and e = 1 if i, j, k are in cyclic order, else -1, the product of the three
//! matrices has
//!
//! ```text
//! R_ik = e sin b
//! R_jk = -e sin a cos b      R_kk = cos a cos b
//! R_ij = -e cos b sin c      R_ii = cos b cos c
//! ```
//!
//! so that sin b = e R_ik, tan a = -e R_jk / R_kk and tan c = -e R_ij / R_ii, with b from -90 to 90 degrees. At
//! b = ±90 degrees only the sum or the difference of a and c has an effect: c = 0 is chosen, and then
//! tan a = e R_kj / R_jj.

use glam::DMat3;

/// From this |sin b| on, a and c cannot be told apart.
const LOCKED: f64 = 1.0 - 1e-12;

/// Three different axes in the order of the factors R_i R_j R_k.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EulerOrder([usize; 3]);

impl EulerOrder {
    /// The order of a name such as `YXZ`; `None` unless each axis occurs once.
    pub fn from_name(name: &str) -> Option<Self> {
        let axes: Vec<usize> = name.chars().map(|axis| "XYZ".find(axis)).collect::<Option<_>>()?;
        let axes: [usize; 3] = axes.try_into().ok()?;
        (0..3).all(|axis| axes.contains(&axis)).then_some(Self(axes))
    }
}

/// The angles a, b, c of a rotation, radians; a and c from -π to π, NaN for a matrix with NaN.
pub fn euler_angles(rotation: &DMat3, order: EulerOrder) -> [f64; 3] {
    let EulerOrder([i, j, k]) = order;
    let r = |row: usize, column: usize| rotation.col(column)[row];
    let e = if (j + 3 - i) % 3 == 1 { 1.0 } else { -1.0 };
    let sine = (e * r(i, k)).clamp(-1.0, 1.0);
    if sine.abs() > LOCKED {
        return [(e * r(k, j)).atan2(r(j, j)), sine.asin(), 0.0];
    }
    [(-e * r(j, k)).atan2(r(k, k)), sine.asin(), (-e * r(i, j)).atan2(r(i, i))]
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 6] = ["XYZ", "YZX", "ZXY", "XZY", "ZYX", "YXZ"];

    fn order(name: &str) -> EulerOrder {
        EulerOrder::from_name(name).unwrap()
    }

    /// The product of the three rotations, each about its own axis.
    fn product(name: &str, angles: [f64; 3]) -> DMat3 {
        let about = |(axis, angle): (char, f64)| match axis {
            'X' => DMat3::from_rotation_x(angle),
            'Y' => DMat3::from_rotation_y(angle),
            _ => DMat3::from_rotation_z(angle),
        };
        name.chars().zip(angles).map(about).product()
    }

    #[test]
    fn angles_of_a_product_of_rotations_are_found_again() {
        for name in NAMES {
            for n in 0..500 {
                let share = |step: f64| 2.0 * (f64::from(n) * step).fract() - 1.0;
                let angles = [3.1 * share(0.618), 1.5 * share(0.755), 3.1 * share(0.570)];
                let found = euler_angles(&product(name, angles), order(name));
                for (found, angle) in found.into_iter().zip(angles) {
                    assert!((found - angle).abs() < 1e-9, "{name} {angles:?}");
                }
            }
        }
    }

    /// There the angles are not unique, but the rotation is.
    #[test]
    fn a_locked_rotation_is_found_again() {
        for (name, right) in NAMES.into_iter().flat_map(|name| [(name, 0.5), (name, -0.5)]) {
            let rotation = product(name, [0.7, right * std::f64::consts::PI, -1.9]);
            let found = euler_angles(&rotation, order(name));
            assert_eq!(found[2], 0.0);
            assert!(product(name, found).abs_diff_eq(rotation, 1e-9), "{name} {found:?}");
        }
    }

    #[test]
    fn unknown_rotations_have_unknown_angles() {
        assert!(euler_angles(&DMat3::NAN, order("XYZ")).iter().all(|angle| angle.is_nan()));
    }

    #[test]
    fn an_order_has_each_axis_once() {
        for name in ["", "XY", "XYX", "xyz", "XYZX", "XYW"] {
            assert_eq!(EulerOrder::from_name(name), None, "{name}");
        }
    }
}
