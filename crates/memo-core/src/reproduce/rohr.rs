//! The numbers and equations of Rohr (1994), checked with the code that tracks: the printed constants of section
//! 6, and the difference of the two sides of each equation when both are computed.
//!
//! The two sides are computed in different ways: one as printed, with explicit matrices, the other with the code
//! of the tracker. Results depend only on the seed. The paper's results on its image sequences are not
//! reproduced: the sequences are not public.

use crate::estimate::kalman::{ConstantVelocity, FilterOptions, Noise};
use crate::image::{Frame, fit_norms};
use crate::model::body::PART_COUNT;
use crate::model::spline::PeriodicCubic;
use crate::model::{Camera, Gait, GaitStyle, Midpoints, PositionOptions, position_from_rectangle};
use crate::synth::Random;
use crate::track::options::TrackerOptions;
use crate::track::score::{EdgeLine, ModelLine, SimilarityOptions, similarity};
use crate::track::search::{Grid, Hypothesis};
use glam::{DAffine3, DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, DVector, Matrix4, SMatrix, SVector, Vector4};

/// Frame rate of the paper's sequences, images per second.
const RATE_HZ: f64 = 25.0;
/// Duration of a walking cycle in section 6, seconds.
const CYCLE_S: f64 = 1.0;
/// Distance covered in a cycle in section 6, metres.
const STRIDE_M: f64 = 1.6;
/// Relative deviation from the average velocities in section 6.
const DEVIATION: f64 = 0.3;

/// The constants of the paper as used by the code, by name; lengths in cm and times in images, as printed.
pub fn numbers() -> Vec<(&'static str, f64)> {
    let filter = FilterOptions::default();
    let per_image = |noise: &Noise| noise.velocity_variance_per_s / RATE_HZ.powi(3);
    let around = Hypothesis { along_m: 0.0, height_m: 1.0, phase: 0.5 };
    let (printed, whole) = (Grid::printed(&around), Grid::whole_cycle(0.0, 1.0));
    let span = |axis: &crate::track::search::Axis| axis.step * (axis.count - 1) as f64;
    vec![
        ("parts", PART_COUNT as f64),
        ("arm_and_leg_parts", (2..PART_COUNT as u8).len() as f64),
        ("window_px", 25.0),
        ("fit_parameters", window_basis().ncols() as f64),
        ("rank", window_projection().rank(1e-9) as f64),
        ("x_per_image_cm", 100.0 * STRIDE_M / CYCLE_S / RATE_HZ),
        ("pose_per_image", 1.0 / CYCLE_S / RATE_HZ),
        ("sigma_q_x_sq", 1e4 * per_image(&filter.along)),
        ("sigma_q_x_sq_from_text", (DEVIATION * 100.0 * STRIDE_M / CYCLE_S / RATE_HZ).powi(2)),
        ("sigma_q_y_sq", 1e4 * per_image(&filter.vertical)),
        ("sigma_q_pose_sq", per_image(&filter.phase)),
        ("sigma_r_x_sq", 1e4 * filter.along.measurement_variance),
        ("sigma_r_y_sq", 1e4 * filter.vertical.measurement_variance),
        ("sigma_r_pose_sq", filter.phase.measurement_variance),
        ("interval_x_cm", 100.0 * span(&printed.along)),
        ("interval_y_cm", 100.0 * span(&printed.height)),
        ("interval_pose", span(&printed.phase)),
        ("interval_pose_start", whole.phase.step * whole.phase.count as f64),
        ("n_x", printed.along.count as f64),
        ("n_y", printed.height.count as f64),
        ("n_pose", printed.phase.count as f64),
        ("hypotheses", printed.len() as f64),
        ("hypotheses_start", whole.len() as f64),
        ("start_images", TrackerOptions::for_height(1.75).start_frames as f64),
        ("start_cycles", TrackerOptions::for_height(1.75).start_frames as f64 / RATE_HZ / CYCLE_S),
    ]
}

/// For each equation the largest difference of its two sides over random problems.
pub fn deviations(seed: u64) -> Vec<(&'static str, f64)> {
    let mut random = Random::new(seed);
    let [inverse, product] = transforms(&mut random);
    let [system, position_m] = positions(&mut random);
    let [gaussian, matrix_form, scaling, perfect] = similarities(&mut random);
    let [ours_scaled, lowe_scaled] = scale_of_measures();
    let [samples, symmetry] = gait();
    vec![
        ("inverse", inverse),
        ("product", product),
        ("eq_1", change_test(&mut random)),
        ("eq_6", system),
        ("eq_6_position_m", position_m),
        ("eq_7", gaussian),
        ("eq_8", matrix_form),
        ("eq_8_scale", scaling),
        ("eq_9_scaled_twice", ours_scaled),
        ("eq_10_scaled_twice", lowe_scaled),
        ("eq_11_perfect", perfect),
        ("eqs_12_22", filters()),
        ("spline_samples_deg", samples),
        ("left_half_cycle_later_deg", symmetry),
    ]
}

/// Section 3.1: A^-1 as printed times A against I; A_i A_{i+1} as printed against the matrix product.
fn transforms(random: &mut Random) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for _ in 0..100 {
        let [a, b] = [0; 2].map(|_| {
            let axis = drawn(random, 1.0).normalize_or(DVec3::X);
            DAffine3 {
                matrix3: DMat3::from_axis_angle(axis, random.uniform(-3.0, 3.0)),
                translation: drawn(random, 2.0),
            }
        });
        let printed = |r: DMat3, t: DVec3| homogeneous(&DAffine3 { matrix3: r, translation: t });
        let inverse = printed(a.matrix3.transpose(), -(a.matrix3.transpose() * a.translation));
        worst[0] = worst[0].max((inverse * homogeneous(&a) - Matrix4::identity()).amax());
        let product = printed(a.matrix3 * b.matrix3, a.matrix3 * b.translation + a.translation);
        worst[1] = worst[1].max((product - homogeneous(&(a * b))).amax());
    }
    worst
}

fn homogeneous(a: &DAffine3) -> Matrix4<f64> {
    let column = |v: DVec3, w: f64| Vector4::new(v.x, v.y, v.z, w);
    let m = a.matrix3;
    let columns =
        [column(m.x_axis, 0.0), column(m.y_axis, 0.0), column(m.z_axis, 0.0), column(a.translation, 1.0)];
    Matrix4::from_columns(&columns)
}

fn drawn(random: &mut Random, reach: f64) -> DVec3 {
    DVec3::from_array([0; 3].map(|_| random.uniform(-reach, reach)))
}

/// X: (1, x, y, x^2, xy, y^2) over the 5x5 window.
fn window_basis() -> DMatrix<f64> {
    DMatrix::from_fn(25, 6, |pixel, term| {
        let (x, y) = ((pixel % 5) as f64 - 2.0, (pixel / 5) as f64 - 2.0);
        [1.0, x, y, x * x, x * y, y * y][term]
    })
}

/// X X*, X* = (X^T X)^-1 X^T.
fn window_projection() -> DMatrix<f64> {
    let x = window_basis();
    let inverse = (x.transpose() * &x).try_inverse().expect("the six functions are independent");
    &x * inverse * x.transpose()
}

/// Eq. (1): 1/sqrt(n) |X beta_k - X beta_j| with two fits, compared with the value of the change detection.
fn change_test(random: &mut Random) -> f64 {
    let projection = window_projection();
    let mut worst = 0.0f64;
    for _ in 0..100 {
        let [a, b] = [0; 2].map(|_| (0..25).map(|_| random.uniform(0.0, 256.0) as u8).collect::<Vec<u8>>());
        let fit =
            |pixels: &[u8]| &projection * DVector::from_iterator(25, pixels.iter().map(|p| f64::from(*p)));
        let printed = (fit(&a) - fit(&b)).norm() / 5.0;
        let frame = |pixels| Frame::new(pixels, 5, 5, 5).expect("25 pixels are a frame of 5 by 5");
        let norms = fit_norms(&frame(&a), &frame(&b)).expect("both frames are 5 by 5");
        worst = worst.max((f64::from(norms.at(2, 2)) - printed).abs() / printed);
    }
    worst
}

/// Eq. (6): T* X* + b* divided by its largest term, for people in front of random cameras, and the error of the
/// solved position, metres. The paper's Y is the world's Z here.
fn positions(random: &mut Random) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for _ in 0..100 {
        let (tilt_rad, height_m) = (random.uniform(-0.3, 0.1), random.uniform(1.5, 1.95));
        let camera = Camera::level([640, 480], 0.9, random.uniform(0.8, 3.0), random.uniform(5.0, 13.0))
            .expect("the camera is valid");
        let position = camera.position();
        let rotation = DMat3::from_rotation_x(tilt_rad) * camera.rotation;
        let camera = Camera { rotation, translation: -(rotation * position), ..camera };
        let sole = DVec3::new(random.uniform(-1.0, 1.0), random.uniform(-1.0, 3.0), 0.0);
        let crown = sole + DVec3::Z * height_m;
        let (Some(u), Some(o)) = (camera.project_ideal(sole), camera.project_ideal(crown)) else { continue };
        let t = camera.matrix();
        #[rustfmt::skip]
        let system = SMatrix::<f64, 6, 5>::new(
            t[(0, 0)], t[(0, 1)], t[(0, 2)], -u.x, 0.0,
            t[(1, 0)], t[(1, 1)], t[(1, 2)], -u.y, 0.0,
            t[(2, 0)], t[(2, 1)], t[(2, 2)], -1.0, 0.0,
            0.0, 0.0, 0.0, u.x, -o.x,
            0.0, 0.0, 0.0, u.y, -o.y,
            0.0, 0.0, 0.0, 1.0, -1.0,
        );
        let depth = |p: DVec3| camera.camera_from_world(p).z;
        let unknown = SVector::<f64, 5>::new(sole.x, sole.y, sole.z, depth(sole), depth(crown));
        let constant = SVector::<f64, 6>::new(
            t[(0, 3)],
            t[(1, 3)],
            t[(2, 3)],
            height_m * t[(0, 2)],
            height_m * t[(1, 2)],
            height_m * t[(2, 2)],
        );
        worst[0] = worst[0].max((system * unknown + constant).amax() / constant.amax());
        let midpoints = Midpoints { bottom_px: u, top_px: o };
        let found = position_from_rectangle(&camera, &midpoints, height_m, &PositionOptions::default());
        worst[1] = worst[1].max(found.map_or(f64::INFINITY, |found| found.point_in_world.distance(sole)));
    }
    worst
}

/// For single lines and edges inside their windows: s_i of eq. (7) compared with the score's, and eq. (8) with
/// eq. (7), both divided by l; the change of the exponent if everything is three times as large; |1 - s(p)| of
/// eq. (11) for lines that are edges.
fn similarities(random: &mut Random) -> [f64; 4] {
    let options = SimilarityOptions::default();
    let [c_l, c_d, c_r, sigma_phi] =
        [options.c_l, options.c_d, options.c_r, options.sigma_phi_rad].map(f64::from);
    let mut worst = [0.0f64; 4];
    for _ in 0..200 {
        let model = random.uniform(20.0, 80.0);
        // An edge inside the window is not clipped: l, d and the angle follow from its ends.
        let reach = 0.8 * c_r * model;
        let (left, right) = (random.uniform(0.0, 0.3 * model), random.uniform(0.6 * model, model));
        let middle = random.uniform(-0.5 * reach, 0.5 * reach);
        let slope = random.uniform(-0.1, 0.1) * reach / model;
        let half = 0.5 * slope * (right - left);
        let (l, d, angle) = (right - left, middle.abs(), slope.atan().abs());
        let k = SVector::<f64, 3>::new(model - l, d, angle);
        let exponent = |k: &SVector<f64, 3>, model: f64| {
            let sigma = [c_l * model, c_d * c_r * model, sigma_phi];
            (0..3).map(|i| (k[i] / sigma[i]).powi(2)).sum::<f64>()
        };
        let eq_7 = l * (-0.5 * exponent(&k, model)).exp();
        let sigma = SMatrix::<f64, 3, 3>::from_diagonal(&SVector::<f64, 3>::new(
            (c_l * model).powi(2),
            (c_d * c_r * model).powi(2),
            sigma_phi * sigma_phi,
        ));
        let inverse = sigma.try_inverse().expect("the sigmas are positive");
        let eq_8 = l * (-0.5 * (k.transpose() * inverse * k)[0]).exp();
        let scaled = SVector::<f64, 3>::new(3.0 * k[0], 3.0 * k[1], k[2]);
        let line = ModelLine { part: 0, start: [0.0, 0.0], end: [model as f32, 0.0] };
        let ends = [[left, middle - half], [right, middle + half]].map(|p| p.map(|v| v as f32));
        let edge = EdgeLine { start: ends[0], end: ends[1], gradient: 20.0, velocity: 0.0 };
        let found = similarity(&[line], &[edge], &options);
        let ours = found.matches.first().map_or(f64::NAN, |m| f64::from(m.similarity_px));
        let itself = EdgeLine { start: line.start, end: line.end, ..edge };
        let perfect = similarity(&[line], &[itself], &options);
        let off = [
            (ours - eq_7).abs() / l,
            (eq_8 - eq_7).abs() / l,
            (exponent(&scaled, 3.0 * model) - exponent(&k, model)).abs(),
            (1.0 - f64::from(perfect.value)).abs(),
        ];
        for (worst, off) in worst.iter_mut().zip(off) {
            *worst = if off.is_nan() { f64::INFINITY } else { worst.max(off) };
        }
    }
    worst
}

/// Growth of eqs. (9) and (10) if everything is twice as large.
fn scale_of_measures() -> [f64; 2] {
    let eq_9 = |l: f64, l_m: f64, d: f64, angle: f64| l * l_m * l_m / ((l_m - l) * d * angle);
    let eq_10 = |l_gw: f64, l_m: f64, d: f64, angle: f64| l_gw * l_gw / ((l_m - l_gw) * d * angle);
    let (l, l_m, d, angle) = (30.0, 40.0, 2.0, 0.1);
    [
        eq_9(2.0 * l, 2.0 * l_m, 2.0 * d, angle) / eq_9(l, l_m, d, angle),
        eq_10(2.0 * l, 2.0 * l_m, 2.0 * d, angle) / eq_10(l, l_m, d, angle),
    ]
}

/// The filter as printed, eight states and dense matrices, compared with the four small filters of the tracker;
/// fifty images.
fn filters() -> f64 {
    let o = FilterOptions::default();
    let noises = [o.along, o.vertical, o.along, o.phase];
    let mut states = [ConstantVelocity::new(0.0, 1.6, 0.04, 0.2); 4];
    let mut p = SVector::<f64, 8>::zeros();
    let mut cov = SMatrix::<f64, 8, 8>::zeros();
    for i in 0..4 {
        p[2 * i + 1] = 1.6;
        cov[(2 * i, 2 * i)] = 0.04;
        cov[(2 * i + 1, 2 * i + 1)] = 0.2;
    }
    let mut worst = 0.0f64;
    for step in 0..50 {
        let z = SVector::<f64, 4>::from_fn(|i, _| {
            0.06 * f64::from(step) + 0.1 * f64::from((step * 7 + i as i32 * 3) % 5)
        });
        (p, cov) = dense_step(&p, &cov, &z, 1.0 / RATE_HZ, &noises);
        for i in 0..4 {
            states[i] = states[i].predict(1.0 / RATE_HZ, &noises[i]).update(z[i], &noises[i]);
            let [pp, pv, vv] = states[i].covariance;
            let dense = [
                p[2 * i],
                p[2 * i + 1],
                cov[(2 * i, 2 * i)],
                cov[(2 * i, 2 * i + 1)],
                cov[(2 * i + 1, 2 * i + 1)],
            ];
            let small = [states[i].position, states[i].velocity, pp, pv, vv];
            worst = dense.iter().zip(small).fold(worst, |worst, (a, b)| worst.max((a - b).abs()));
        }
    }
    worst
}

/// Eqs. (14)-(18) with the matrices of (19)-(22).
fn dense_step(
    p: &SVector<f64, 8>,
    cov: &SMatrix<f64, 8, 8>,
    z: &SVector<f64, 4>,
    dt: f64,
    noises: &[Noise; 4],
) -> (SVector<f64, 8>, SMatrix<f64, 8, 8>) {
    let mut phi = SMatrix::<f64, 8, 8>::identity();
    let mut q = SMatrix::<f64, 8, 8>::zeros();
    let mut h = SMatrix::<f64, 4, 8>::zeros();
    let mut r = SMatrix::<f64, 4, 4>::zeros();
    for i in 0..4 {
        phi[(2 * i, 2 * i + 1)] = dt;
        q[(2 * i + 1, 2 * i + 1)] = noises[i].velocity_variance_per_s * dt;
        h[(i, 2 * i)] = 1.0;
        r[(i, i)] = noises[i].measurement_variance;
    }
    let prior = phi * p;
    let prior_cov = phi * cov * phi.transpose() + q;
    let innovation_cov = h * prior_cov * h.transpose() + r;
    let k = prior_cov * h.transpose() * innovation_cov.try_inverse().expect("R is positive");
    (prior + k * (z - h * prior), (SMatrix::identity() - k * h) * prior_cov)
}

/// The largest difference between a sine and a spline through ten of its samples, degrees for an amplitude of 60;
/// the difference between the left side and the right side half a cycle before, degrees.
fn gait() -> [f64; 2] {
    let samples: Vec<f64> = (0..10).map(|i| 60.0 * (0.6 * f64::from(i)).sin()).collect();
    let spline = PeriodicCubic::spline(&samples);
    let missed =
        (0..10).map(|i| (spline.at(f64::from(i) / 10.0) - samples[i as usize]).abs()).fold(0.0, f64::max);
    let (gait, style) = (Gait::sampled_10(), GaitStyle::default());
    let differs = |phase: f64| {
        let (left, right) = (gait.posture(phase, &style).left, gait.posture(phase + 0.5, &style).right);
        let pairs = [
            (left.hip, right.hip),
            (left.knee, right.knee),
            (left.shoulder, right.shoulder),
            (left.elbow, right.elbow),
        ];
        pairs.iter().fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs().to_degrees()))
    };
    [missed, (0..100).map(|i| differs(f64::from(i) / 100.0)).fold(0.0, f64::max)]
}

/// The search window of a model contour (Fig. 17): its four corners. It has the contour's length and twice c_r of
/// it.
pub fn search_window(start: DVec2, end: DVec2, c_r: f64) -> [DVec2; 4] {
    let across = c_r * (end - start).perp();
    [start - across, end - across, end + across, start + across]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(list: &[(&'static str, f64)], name: &str) -> f64 {
        list.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name}")).1
    }

    #[test]
    fn both_sides_of_every_equation_agree() {
        let found = deviations(1);
        for (name, deviation) in &found {
            let bound = match *name {
                "eq_1" | "eq_7" | "eq_11_perfect" => 3e-6, // f32
                "eq_9_scaled_twice" | "eq_10_scaled_twice" => continue,
                _ => 1e-9,
            };
            assert!(*deviation < bound, "{name}: {deviation}");
        }
        assert_eq!(of(&found, "eq_9_scaled_twice"), 2.0);
        assert_eq!(of(&found, "eq_10_scaled_twice"), 1.0);
    }

    #[test]
    fn the_constants_are_those_printed() {
        let n = numbers();
        for (name, printed, half_digit) in [
            ("x_per_image_cm", 6.4, 0.05),
            ("pose_per_image", 0.04, 0.005),
            ("sigma_q_x_sq", 3.69, 0.005),
            ("sigma_q_pose_sq", 0.000_144, 5e-7),
            ("sigma_r_x_sq", 400.0, 0.5),
            ("sigma_r_y_sq", 100.0, 0.5),
            ("interval_x_cm", 40.0, 0.01),
            ("interval_pose_start", 1.0, 1e-9),
        ] {
            assert!((of(&n, name) - printed).abs() < half_digit, "{name}: {}", of(&n, name));
        }
        assert_eq!(of(&n, "hypotheses"), 21.0 * 11.0 * 21.0);
        assert_eq!(of(&n, "rank"), 6.0);
    }

    #[test]
    fn a_window_is_as_long_as_its_contour_and_twice_c_r_as_wide() {
        let corners = search_window(DVec2::new(1.0, 2.0), DVec2::new(4.0, 6.0), 0.25);
        assert!((corners[0].distance(corners[1]) - 5.0).abs() < 1e-12);
        assert!((corners[0].distance(corners[3]) - 2.5).abs() < 1e-12);
        assert!((corners[0].midpoint(corners[3]) - DVec2::new(1.0, 2.0)).length() < 1e-12);
    }
}
