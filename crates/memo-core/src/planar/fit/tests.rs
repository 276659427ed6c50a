use super::example::{normal, swinging};
use super::*;
use crate::planar::{fit_hinge, fit_rod, hinge_from_two_views, rod_from_three_views};
use crate::synth::Random;

#[test]
fn bad_input_is_refused_with_its_values() {
    let mut random = Random::new(1);
    let [a, o, b] = swinging(DVec2::X, 10, 0.0, &mut random);
    let options = FitOptions::default();
    let hinge = |a: &[DVec2], o: &[DVec2], b: &[DVec2]| fit_hinge(a, o, b, &options).map(|_| ());
    assert_eq!(hinge(&a[1..], &o, &b), Err(FitError::Lengths { pivot: 10, end: 9 }));
    assert_eq!(hinge(&a[..1], &o[..1], &b[..1]), Err(FitError::TooFewViews { found: 1, needed: 2 }));
    assert_eq!(hinge(&[], &[], &[]), Err(FitError::TooFewViews { found: 0, needed: 2 }));
    assert_eq!(hinge(&a, &[DVec2::NAN; 10], &b), Err(FitError::TooFewViews { found: 0, needed: 2 }));
    assert!(matches!(hinge(&o, &o, &b), Err(FitError::NoMotion { motion: 0.0 })));
    let carried: Vec<DVec2> = o.iter().map(|p| *p + DVec2::new(0.25, -0.5)).collect();
    assert!(matches!(hinge(&a, &o, &carried), Err(FitError::NoMotion { .. })));
    let mut infinite = a.clone();
    infinite[3].y = f64::INFINITY;
    assert_eq!(hinge(&infinite, &o, &b), Err(FitError::Infinite { view: 3 }));
    let huge: Vec<DVec2> = a.iter().map(|p| *p * 1e200).collect();
    assert!(matches!(hinge(&huge, &o, &b), Err(FitError::Size { .. })));
    for bad in [
        FitOptions { noise_sd: -1.0, ..options },
        FitOptions { noise_sd: f64::NAN, ..options },
        FitOptions { noise_sd: f64::INFINITY, ..options },
        FitOptions { max_tilt_deg: 90.0, ..options },
        FitOptions { outlier_sd: 0.0, ..options },
        FitOptions { max_outlier_fraction: 0.7, ..options },
    ] {
        assert!(matches!(fit_rod(&o, &a, &bad), Err(FitError::Option(_))), "{bad:?}");
    }
}

#[test]
fn the_fewest_views_give_the_closed_forms() {
    let mut random = Random::new(2);
    for _ in 0..300 {
        let slope = random.uniform(0.3, 2.0) * DVec2::from_angle(random.uniform(0.0, 6.3));
        let [a, o, b] = swinging(slope, 3, 0.0, &mut random);
        let d = |end: &[DVec2], i: usize| end[i] - o[i];
        if let Ok(rod) = rod_from_three_views(&[d(&a, 0), d(&a, 1), d(&a, 2)])
            && rod.condition < 1e4
        {
            let fit = fit_rod(&o, &a, &FitOptions::default()).unwrap();
            assert!(fit.plane.angle_up_to_mirror_rad(&rod.plane) < 1e-6, "{fit:?} {rod:?}");
            assert!((fit.length - rod.length).abs() < 1e-6 && fit.redundancy == 0);
        }
        if let Ok(hinge) = hinge_from_two_views(&[d(&a, 0), d(&a, 1)], &[d(&b, 0), d(&b, 1)])
            && hinge.condition < 1e4
        {
            let fit = fit_hinge(&a[..2], &o[..2], &b[..2], &FitOptions::default()).unwrap();
            assert!(fit.plane.angle_up_to_mirror_rad(&hinge.plane) < 1e-6, "{fit:?} {hinge:?}");
            assert_eq!(fit.redundancy, 0);
        }
    }
}

/// An independent cost: residuals by a numerical gradient, noise of the three points propagated.
fn independent_cost(points: &[Vec<DVec2>; 3], sd: f64, g: DVec2, c: [f64; 2]) -> f64 {
    let h = |end: DVec2, o: DVec2| (end - o).length_squared() + g.dot(end - o).powi(2);
    let cost = |i: usize| {
        let at = |k: usize, step: DVec2, j: usize| points[k][i] + if k == j { step } else { DVec2::ZERO };
        let errors = |step: DVec2, j: usize| {
            let o = at(1, step, j);
            nalgebra::Vector2::new(h(at(0, step, j), o) - c[0], h(at(2, step, j), o) - c[1])
        };
        let mut covariance = nalgebra::Matrix2::zeros();
        for j in 0..3 {
            for axis in [DVec2::X, DVec2::Y] {
                let by = (errors(1e-5 * axis, j) - errors(-1e-5 * axis, j)) / 2e-5;
                covariance += sd * sd * by * by.transpose();
            }
        }
        let e = errors(DVec2::ZERO, 0);
        (e.transpose() * covariance.try_inverse().unwrap() * e)[0]
    };
    (0..points[0].len()).map(cost).sum()
}

#[test]
fn no_plane_on_a_grid_is_better_than_the_fit() {
    let mut random = Random::new(4);
    let sd = 0.003;
    let mut missed = 0;
    for draw in 0..60 {
        let slope = random.uniform(0.0, 4.0) * DVec2::from_angle(random.uniform(0.0, 6.3));
        let mut points = swinging(slope, 16, sd, &mut random);
        if draw % 2 == 0 {
            // Not planar: the cost has several minima.
            points[2].iter_mut().for_each(|p| *p += 0.06 * normal(&mut random));
        }
        let options = FitOptions { noise_sd: sd, max_outlier_fraction: 0.0, ..FitOptions::default() };
        let fit = fit_hinge(&points[0], &points[1], &points[2], &options).unwrap();
        // c of the fit: squared lengths plus the contribution of noise, which the lengths do not contain.
        let c_of = |g: DVec2| {
            let share = 2.0 * sd * sd * (2.0 + g.length_squared());
            [0, 1].map(|k| fit.lengths[k].powi(2) + share)
        };
        let found = independent_cost(&points, sd, fit.plane.slope(), c_of(fit.plane.slope()));
        let mut best = f64::INFINITY;
        for i in 0..24 {
            for j in 1..20 {
                let g = (1.39 * j as f64 / 19.0).tan() * DVec2::from_angle(0.1309 * i as f64);
                // The best c for a slope: mean of h, then two steps of weights.
                let h = |k: usize, i: usize| {
                    let d = points[k][i] - points[1][i];
                    d.length_squared() + g.dot(d).powi(2)
                };
                let mean = |k: usize| {
                    let w = |i: usize| {
                        let d = points[k][i] - points[1][i];
                        1.0 / (d + g.dot(d) * g).length_squared().max(sd * sd)
                    };
                    let weight: f64 = (0..16).map(w).sum();
                    (0..16).map(|i| w(i) * h(k, i)).sum::<f64>() / weight
                };
                let other = independent_cost(&points, sd, g, [mean(0), mean(2)]);
                best = best.min(other);
            }
        }
        // For motion that is not planar, a second minimum that is hardly worse is allowed: 10 % of the residual.
        let allowed = if draw % 2 == 0 { 1.21 * best } else { best + 1.0 };
        missed += usize::from(found > allowed);
    }
    assert_eq!(missed, 0);
}

#[test]
fn covariance_tells_the_spread() {
    let mut random = Random::new(5);
    let sd = 0.004;
    let mut squares = [0.0; 4];
    let (mut residual, mut depth, mut depth_of_rod) = (0.0, 0.0, 0.0);
    let draws = 400;
    for _ in 0..draws {
        let slope = random.uniform(0.5, 1.5) * DVec2::from_angle(random.uniform(-1.4, 1.4));
        let [a, o, b] = swinging(slope, 40, sd, &mut random);
        let options = FitOptions { noise_sd: sd, ..FitOptions::default() };
        let fit = fit_hinge(&a, &o, &b, &options).unwrap();
        let sign = if fit.plane.slope().dot(slope) < 0.0 { -1.0 } else { 1.0 };
        let errors = [
            sign * fit.plane.p - slope.x,
            sign * fit.plane.q - slope.y,
            fit.lengths[0] - 0.4,
            fit.lengths[1] - 0.45,
        ];
        for (i, (square, error)) in squares.iter_mut().zip(errors).enumerate() {
            *square += error * error / fit.covariance[(i, i)] / draws as f64;
        }
        let image = b[0] - o[0];
        let error = (sign * fit.plane.slope() - slope).dot(image);
        depth += (error / fit.depth_sd(image, 0.0)).powi(2) / draws as f64;
        assert!(fit.depth_sd(image, sd) > fit.depth_sd(image, 0.0));
        let rod = fit_rod(&o, &b, &options).unwrap();
        let sign = if rod.plane.slope().dot(slope) < 0.0 { -1.0 } else { 1.0 };
        let error = (sign * rod.plane.slope() - slope).dot(image);
        depth_of_rod += (error / rod.depth_sd(image, 0.0)).powi(2) / draws as f64;
        residual += fit.residual_rms * fit.residual_rms / (2.0 * sd * sd) / draws as f64;
    }
    println!("normalised variances of p, q, lengths: {squares:?}; of residuals {residual}");
    assert!(squares.iter().all(|s| (0.75..1.3).contains(s)), "{squares:?}");
    println!("of depths of a hinge {depth}, of a rod {depth_of_rod}");
    assert!((0.75..1.3).contains(&depth), "{depth}");
    assert!((0.75..1.3).contains(&depth_of_rod), "{depth_of_rod}");
    // 80 residuals, 4 unknowns, correlated by half at most.
    assert!((0.88..1.0).contains(&residual), "{residual}");
}

#[test]
fn a_plane_parallel_to_the_image_keeps_its_lengths() {
    let mut random = Random::new(7);
    let [a, o, b] = swinging(DVec2::ZERO, 40, 0.003, &mut random);
    let fit = fit_hinge(&a, &o, &b, &FitOptions { noise_sd: 0.003, ..FitOptions::default() }).unwrap();
    assert!((fit.lengths[0] - 0.4).abs() < 0.01 && (fit.lengths[1] - 0.45).abs() < 0.01, "{fit:?}");
    assert!(fit.plane.tilt_rad() < 0.25, "{:?}", fit.plane);
    assert!(fit.covariance.iter().all(|x| !x.is_nan()));
}

/// Noise lengthens rods, by that of both points and of their depths: in the true plane this is removed
/// completely.
#[test]
fn lengths_are_without_the_noise_s_share() {
    let mut random = Random::new(21);
    let (sd, draws) = (0.03, 300);
    let slope = 1.2 * DVec2::from_angle(0.7);
    let options = FitOptions { noise_sd: sd, max_outlier_fraction: 0.0, ..FitOptions::default() };
    let mut mean = [0.0; 2];
    for _ in 0..draws {
        let [a, o, b] = swinging(slope, 60, sd, &mut random);
        let views: Vec<View<2>> = (0..60).map(|i: usize| [a[i] - o[i], b[i] - o[i]]).collect();
        let problem = Problem::new(&views, 0.45, &options);
        let h = |d: DVec2| d.length_squared() + slope.dot(d).powi(2);
        let c = [0, 1].map(|k| views.iter().map(|v| h(v[k])).sum::<f64>() / 60.0);
        let fit = problem.report(Solution { g: slope, c, cost: 0.0 }, vec![false; 60], [1.0; 2]);
        (0..2).for_each(|k| mean[k] += fit.lengths[k] / f64::from(draws));
    }
    // With the contribution of noise they would be 7 mm longer.
    assert!((mean[0] - 0.4).abs() < 0.001 && (mean[1] - 0.45).abs() < 0.001, "{mean:?}");
}

/// With stated noise, the covariance for exact points is the spread of fits to noisy ones; without, it is that of
/// the residuals.
#[test]
fn covariance_has_the_stated_noise_or_that_of_the_residuals() {
    let slope = 0.9 * DVec2::from_angle(0.4);
    let sd = 0.01;
    let mut random = Random::new(23);
    let exact = swinging(slope, 40, 0.0, &mut random);
    let options = FitOptions { noise_sd: sd, max_outlier_fraction: 0.0, ..FitOptions::default() };
    let stated = fit_hinge(&exact[0], &exact[1], &exact[2], &options).unwrap();
    let unstated = FitOptions { noise_sd: 0.0, ..options };
    let mut square = [0.0; 4];
    let (mut of_residuals, draws) = ([0.0; 4], 400);
    for _ in 0..draws {
        let noisy = exact
            .each_ref()
            .map(|points| -> Vec<DVec2> { points.iter().map(|p| *p + sd * normal(&mut random)).collect() });
        let fit = fit_hinge(&noisy[0], &noisy[1], &noisy[2], &unstated).unwrap();
        let sign = fit.plane.slope().dot(slope).signum();
        let found = [sign * fit.plane.p, sign * fit.plane.q, fit.lengths[0], fit.lengths[1]];
        let truth = [stated.plane.p, stated.plane.q, stated.lengths[0], stated.lengths[1]];
        let flip = stated.plane.slope().dot(slope).signum();
        for i in 0..4 {
            let truth = if i < 2 { flip * truth[i] } else { truth[i] };
            square[i] += (found[i] - truth).powi(2) / f64::from(draws);
            of_residuals[i] += fit.covariance[(i, i)] / f64::from(draws);
        }
    }
    for i in 0..2 {
        let by_stated = (stated.covariance[(i, i)] / square[i]).sqrt();
        assert!((0.85..1.18).contains(&by_stated), "{i}: {by_stated}");
        let by_residuals = (of_residuals[i] / square[i]).sqrt();
        assert!((0.8..1.25).contains(&by_residuals), "{i}: {by_residuals}");
    }
    for (k, length) in stated.lengths.iter().enumerate() {
        let by_stated = (stated.covariance[(2 + k, 2 + k)] / square[2 + k]).sqrt();
        assert!((0.7..1.3).contains(&by_stated), "{k}: {by_stated} of {length}");
    }
}

/// Excluded views do not enter the covariance: it is that of the others alone.
#[test]
fn outliers_say_nothing_about_how_sure_a_fit_is() {
    let mut random = Random::new(27);
    let sd = 0.002;
    let [mut a, o, b] = swinging(0.9 * DVec2::from_angle(1.1), 40, sd, &mut random);
    let wrong = [4, 17, 18, 30];
    wrong.iter().for_each(|&view| a[view] += DVec2::new(1.2, -0.9));
    let options = FitOptions { noise_sd: sd, ..FitOptions::default() };
    let fit = fit_hinge(&a, &o, &b, &options).unwrap();
    let outliers: Vec<usize> = (0..40).filter(|&view| fit.outliers[view]).collect();
    assert_eq!(outliers, wrong);
    let kept = |points: &[DVec2]| -> Vec<DVec2> {
        (0..40).filter(|view| !wrong.contains(view)).map(|view| points[view]).collect()
    };
    let without = FitOptions { max_outlier_fraction: 0.0, ..options };
    let alone = fit_hinge(&kept(&a), &kept(&o), &kept(&b), &without).unwrap();
    for i in 0..4 {
        let ratio = fit.covariance[(i, i)] / alone.covariance[(i, i)];
        assert!((ratio - 1.0).abs() < 1e-3, "{i} {ratio}");
    }
    assert_eq!(fit.redundancy, alone.redundancy);
}
