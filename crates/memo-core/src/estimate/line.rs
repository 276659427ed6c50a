//! Straight lines through points.

/// Least-squares line y = level + slope x, as (slope, level); the slope is 0 where x does not vary.
pub(crate) fn line_through(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len().max(1) as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (sxx, sxy) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), p| (a + (p.0 - mx) * (p.0 - mx), b + (p.0 - mx) * (p.1 - my)));
    let slope = if sxx > 1e-12 { sxy / sxx } else { 0.0 };
    (slope, my - slope * mx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_points_has_their_slope_and_level_at_zero() {
        let (slope, level) = line_through(&[(2.0, 1.0), (4.0, 0.0), (6.0, -1.0)]);
        assert!((slope + 0.5).abs() < 1e-12 && (level - 2.0).abs() < 1e-12);
        assert_eq!(line_through(&[(3.0, 1.0), (3.0, 2.0)]), (0.0, 1.5));
        assert_eq!(line_through(&[]), (0.0, 0.0));
    }
}
