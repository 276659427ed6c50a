//! Outlier views, which are excluded if they are few.

use super::moments::grid;
use super::{Problem, Solution, View, count};
use crate::estimate::median::median;
use glam::DVec2;

/// The median of the known values; NaN if there are none.
fn known_median(values: &mut Vec<f64>) -> f64 {
    values.retain(|x| !x.is_nan());
    median(values).unwrap_or(f64::NAN)
}

impl<const K: usize> Problem<'_, K> {
    /// The fit without outliers, and the outliers; `None` if there are none, or too many.
    ///
    /// A fit to all views is kept if it shows no outlier and its residuals have the size of the noise. Otherwise
    /// it may be distorted by outliers: the search starts from the plane of the smallest median residual, and
    /// repeats excluding and fitting until nothing changes.
    pub(super) fn without_outliers(&self, needed: usize) -> Option<(Solution<K>, Vec<bool>)> {
        if self.options.max_outlier_fraction * (self.views.len() as f64) < 1.0 {
            return None;
        }
        let first = self.solve();
        let mut outliers = vec![false; self.views.len()];
        let (limit, found) = self.outliers(&first);
        if limit <= 2.0 * self.options.outlier_sd * self.noise_sq.sqrt() && found == outliers {
            return Some((first, outliers));
        }
        let mut solution = self.least_median();
        for _ in 0..8 {
            let (_, found) = self.outliers(&solution);
            if found == outliers {
                // If there are no outliers from the start, the first fit is kept.
                return if found.contains(&true) {
                    self.few(solution, outliers)
                } else {
                    Some((first, outliers))
                };
            }
            let kept: Vec<View<K>> =
                self.views.iter().zip(&found).filter(|(_, o)| !**o).map(|(v, _)| *v).collect();
            if (0..K).any(|k| count(&kept, k) <= needed) {
                return None;
            }
            outliers = found;
            solution = self.of(&kept).solve();
        }
        self.few(solution, outliers)
    }

    /// The fit and its outliers, if they are few enough.
    fn few(&self, solution: Solution<K>, outliers: Vec<bool>) -> Option<(Solution<K>, Vec<bool>)> {
        let most = self.options.max_outlier_fraction * self.views.len() as f64;
        (outliers.iter().filter(|o| **o).count() as f64 <= most).then_some((solution, outliers))
    }

    /// The limit of [`FitOptions::outlier_sd`](super::FitOptions::outlier_sd) robust standard deviations, and the
    /// views with a larger residual.
    fn outliers(&self, solution: &Solution<K>) -> (f64, Vec<bool>) {
        let residuals: Vec<[f64; K]> =
            self.views.iter().map(|v| self.residuals(v, solution).map(f64::abs)).collect();
        let spread = 1.4826 * known_median(&mut residuals.iter().flatten().copied().collect());
        let limit = self.options.outlier_sd * spread.max(self.noise_sq.sqrt()).max(1e-12 * self.size);
        (limit, residuals.iter().map(|r| r.iter().any(|r| *r > limit)).collect())
    }

    /// The plane of a grid with the smallest median of |residual|; each rod's length is the median of its own.
    fn least_median(&self) -> Solution<K> {
        let grid = grid(self.slope_limit);
        let mut values = Vec::with_capacity(K * self.views.len());
        let candidates = grid.iter().flatten().map(|&g| {
            let h = |d: DVec2| d.length_squared() + g.dot(d).powi(2);
            let c = std::array::from_fn(|k| {
                values.clear();
                values.extend(self.views.iter().map(|v| h(v[k])));
                known_median(&mut values)
            });
            let solution = Solution { g, c, cost: 0.0 };
            values.clear();
            values.extend(self.views.iter().flat_map(|v| self.residuals(v, &solution).map(f64::abs)));
            Solution { cost: known_median(&mut values), ..solution }
        });
        candidates.min_by(|a, b| a.cost.total_cmp(&b.cost)).expect("the grid is not empty")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::fit::example::{normal, swinging};
    use crate::planar::{FitOptions, fit_hinge};
    use crate::synth::Random;

    #[test]
    fn missing_views_and_outliers_do_no_harm() {
        let mut random = Random::new(6);
        let sd = 0.002;
        let mut false_alarms = 0;
        for _ in 0..100 {
            let slope = random.uniform(0.4, 1.5) * DVec2::from_angle(random.uniform(0.0, 6.3));
            let [mut a, mut o, b] = swinging(slope, 40, sd, &mut random);
            let wrong = [3, 11, 12, 29];
            for view in wrong {
                a[view] += 0.3 * DVec2::from_angle(random.uniform(0.0, 6.3)) + 0.1 * normal(&mut random);
            }
            a[7] = DVec2::NAN;
            o[20].y = f64::NAN;
            let options = FitOptions { noise_sd: sd, ..FitOptions::default() };
            let fit = fit_hinge(&a, &o, &b, &options).unwrap();
            assert!(fit.depth[7][0].is_nan() && !fit.depth[7][1].is_nan() && fit.depth[20][1].is_nan());
            // An outlier along the rod's own ellipse is not detectable, so outliers far off the ellipse are used.
            let limit = options.outlier_sd * 2.0 * sd;
            for view in wrong {
                let far = fit.residuals[view][0].abs() > 2.0 * limit;
                assert!(fit.outliers[view] || !far, "view {view}: {:?}", fit.residuals[view]);
            }
            false_alarms += (0..40).filter(|v| fit.outliers[*v] && !wrong.contains(v)).count();
            assert!((fit.lengths[0] - 0.4).abs() < 0.03, "{slope} {fit:?}");
            assert!((fit.lengths[1] - 0.45).abs() < 0.03, "{slope} {fit:?}");
            let left_out = fit.outliers.iter().filter(|o| **o).count();
            assert_eq!(fit.redundancy, 80 - 3 - 2 * left_out - 4);
        }
        assert!(false_alarms < 20, "{false_alarms}");
    }

    /// The limit is `outlier_sd` standard deviations of the residuals: 1.4826 times the median of their absolute
    /// values, which is equal for normal residuals; at least those of the stated noise.
    #[test]
    fn the_limit_of_outliers_is_in_standard_deviations() {
        let mut random = Random::new(3);
        for (sd, noise_sd) in [(0.01, 0.0), (0.01, 0.03)] {
            let [a, o, _] = swinging(0.8 * DVec2::from_angle(0.3), 4000, sd, &mut random);
            let views: Vec<View<1>> = a.iter().zip(&o).map(|(a, o)| [*a - *o]).collect();
            let options = FitOptions { noise_sd, max_outlier_fraction: 0.0, ..FitOptions::default() };
            let problem = Problem::new(&views, 0.4, &options);
            let (limit, outliers) = problem.outliers(&problem.solve());
            // The standard deviation of the difference of two points.
            let expected = 4.5 * f64::max(sd, noise_sd) * 2f64.sqrt();
            assert!((limit / expected - 1.0).abs() < 0.05, "{limit} {expected}");
            assert!(outliers.iter().filter(|o| **o).count() <= 1);
        }
    }

    /// If there are more outliers than allowed, none is excluded: the points do not fit, and the residuals show
    /// it.
    #[test]
    fn only_few_views_may_be_left_out() {
        let mut random = Random::new(5);
        for (wrong, is_found) in [(6, true), (12, false)] {
            let [mut a, o, b] = swinging(0.8 * DVec2::from_angle(0.3), 40, 0.002, &mut random);
            a.iter_mut().step_by(3).take(wrong).for_each(|p| *p += DVec2::new(0.6, 0.5));
            let options = FitOptions { noise_sd: 0.002, ..FitOptions::default() };
            let fit = fit_hinge(&a, &o, &b, &options).unwrap();
            let found = fit.outliers.iter().filter(|o| **o).count();
            assert_eq!(found, if is_found { wrong } else { 0 }, "{wrong}");
            assert_eq!(fit.residual_rms < 0.01, is_found, "{}", fit.residual_rms);
        }
    }
}
