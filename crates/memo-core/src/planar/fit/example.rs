//! Hinges that swing, with noise; for tests.

use crate::synth::Random;
use glam::DVec2;

pub(super) fn normal(random: &mut Random) -> DVec2 {
    DVec2::from_array(random.normal_pair().map(f64::from))
}

/// First end, pivot and second end of a hinge of lengths 0.4 and 0.45 that swings in the plane while its pivot
/// moves.
pub(super) fn swinging(slope: DVec2, views: usize, sd: f64, random: &mut Random) -> [Vec<DVec2>; 3] {
    let along = slope.try_normalize().unwrap_or(DVec2::X);
    let cos_tilt = 1.0 / (1.0 + slope.length_squared()).sqrt();
    let image = |a: f64, l: f64| l * (a.cos() * cos_tilt * along + a.sin() * along.perp());
    let (start, phase) = (random.uniform(0.0, 6.3), random.uniform(0.0, 6.3));
    let mut points = [vec![], vec![], vec![]];
    for view in 0..views {
        let t = 6.3 * view as f64 / views as f64;
        let pivot = DVec2::new(5.0 + t, (3.0 * t).sin());
        let a = pivot + image(start + 0.7 * t.sin(), 0.4);
        let b = pivot + image(start + 2.5 + 0.9 * (t + phase).sin(), 0.45);
        for (points, point) in points.iter_mut().zip([a, pivot, b]) {
            points.push(point + sd * normal(random));
        }
    }
    points
}
