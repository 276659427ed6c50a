//! Uncertainty of the joints of a chosen figure: noise propagated from the neck down the limbs.
//!
//! Each joint is placed by eq. (7) of Lee and Chen (1985) from its starting joint, so its error consists of the
//! neck's distance, the noise of all image points between neck and joint, and the errors of their segments'
//! lengths. To first order this is a linear map from these independent causes to the joints, whose rows give the
//! covariance. The choice between the two roots is assumed right: the error of a wrong root is not included.

use glam::DVec3;
use nalgebra::{DMatrix, Matrix3};
use thiserror::Error;

use super::lift::JointRays;
use crate::model::skeleton::{JOINT_COUNT, Joint, PerJoint, StickFigure};

/// Standard deviations of the causes of uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Causes {
    /// Standard deviation of the neck's distance along its ray, metres.
    pub anchor_sd_m: f64,
    /// Standard deviation of each segment's length for a known scale, metres, by ending joint; that of the neck
    /// is not used.
    pub length_sd_m: PerJoint<f64>,
    /// Relative standard deviation of the scale of all lengths. If the neck's distance was estimated with these
    /// lengths, its part `anchor_scale_sd_m` varies together with the scale.
    pub scale_sd: f64,
    /// The part of `anchor_sd_m` that is due to the scale of the lengths, metres (`sd_scale_m` of an anchor).
    pub anchor_scale_sd_m: f64,
}

/// Why no uncertainty was computed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum UncertaintyError {
    /// A standard deviation is negative or not finite.
    #[error("{what} must not be negative and must be finite, got {value}")]
    Negative {
        /// Its name.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A part exceeds the whole.
    #[error(
        "the part of the anchor's deviation due to the scale, {part_m} m, exceeds the whole, {whole_m} m"
    )]
    PartExceedsWhole {
        /// The part, metres.
        part_m: f64,
        /// The whole, metres.
        whole_m: f64,
    },
    /// The figure has no neck in front of the camera.
    #[error("the neck is unknown or at the camera: {neck}")]
    NoNeck {
        /// Position of the neck, metres.
        neck: DVec3,
    },
}

/// The covariance of all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureUncertainty {
    /// Rows: x, y, z of each joint in turn; columns: independent causes, each scaled by its standard deviation.
    effects: DMatrix<f64>,
    /// Standard deviation of each joint's position, camera axes: square root of the covariance's trace, metres;
    /// NaN if the joint or a joint of its chain is not known.
    pub absolute_sd_m: PerJoint<f64>,
    /// The same for the position relative to the neck.
    pub relative_sd_m: PerJoint<f64>,
    /// Standard deviation along the joint's ray, metres.
    pub along_ray_sd_m: PerJoint<f64>,
}

impl FigureUncertainty {
    /// Covariance of a joint's position in camera axes, m².
    pub fn covariance(&self, joint: Joint) -> Matrix3<f64> {
        let rows = self.effects.rows(3 * joint as usize, 3);
        (rows * rows.transpose()).fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// Covariance of the position relative to another joint, m².
    pub fn relative_covariance(&self, joint: Joint, to: Joint) -> Matrix3<f64> {
        let rows = self.effects.rows(3 * joint as usize, 3) - self.effects.rows(3 * to as usize, 3);
        (&rows * rows.transpose()).fixed_view::<3, 3>(0, 0).into_owned()
    }
}

/// Columns: scale, the rest of the neck's distance, two image directions per joint, one length per segment.
const CAUSES: usize = 2 + 2 * JOINT_COUNT + JOINT_COUNT;

/// Propagates noise from the neck to every joint of a figure in camera axes.
///
/// For a segment x_e - x_s = w + h r with x_e = k r and w across the ray, differentiation of w² + h² = l² gives
///
/// ```text
/// dk = r·dx_s + q / h,   q = l dl + w·dx_s - k w·dr,      dx_e = r dk + k dr
/// ```
///
/// If the extent h along the ray is 0, the root is not linear in q. So h is replaced by s / (sqrt(h² + 2 s) - h),
/// where s is the standard deviation of q: the result is the change for one standard deviation. `rays` is used
/// only for its noise; the directions of the rays are those of the figure's joints.
pub fn propagate(
    figure: &StickFigure,
    rays: &JointRays,
    causes: &Causes,
) -> Result<FigureUncertainty, UncertaintyError> {
    check(rays.noise_rad, causes)?;
    let neck = figure[Joint::Neck];
    if !(neck.is_finite() && neck.length() > 1e-6) {
        return Err(UncertaintyError::NoNeck { neck });
    }
    let mut effects = DMatrix::from_element(3 * JOINT_COUNT, CAUSES, f64::NAN);
    for joint in Joint::ALL {
        let row = joint_effects(figure, joint, rays.noise_rad, causes, &effects);
        for (cause, effect) in row.iter().enumerate() {
            (0..3).for_each(|axis| effects[(3 * joint as usize + axis, cause)] = effect[axis]);
        }
    }
    let mut found = FigureUncertainty {
        effects,
        absolute_sd_m: PerJoint([f64::NAN; JOINT_COUNT]),
        relative_sd_m: PerJoint([f64::NAN; JOINT_COUNT]),
        along_ray_sd_m: PerJoint([f64::NAN; JOINT_COUNT]),
    };
    for joint in Joint::ALL {
        let covariance = found.covariance(joint);
        let ray = figure[joint].normalize();
        let ray = nalgebra::Vector3::new(ray.x, ray.y, ray.z);
        found.absolute_sd_m[joint] = covariance.trace().sqrt();
        found.relative_sd_m[joint] = found.relative_covariance(joint, Joint::Neck).trace().sqrt();
        found.along_ray_sd_m[joint] = ray.dot(&(covariance * ray)).max(0.0).sqrt();
    }
    Ok(found)
}

fn check(noise_rad: f64, causes: &Causes) -> Result<(), UncertaintyError> {
    let named = [
        ("noise_rad", noise_rad),
        ("anchor_sd_m", causes.anchor_sd_m),
        ("scale_sd", causes.scale_sd),
        ("anchor_scale_sd_m", causes.anchor_scale_sd_m),
    ];
    let lengths = Joint::ALL.into_iter().skip(1).map(|j| ("length_sd_m", causes.length_sd_m[j]));
    for (what, value) in named.into_iter().chain(lengths) {
        if !(value >= 0.0 && value.is_finite()) {
            return Err(UncertaintyError::Negative { what, value });
        }
    }
    let (part_m, whole_m) = (causes.anchor_scale_sd_m, causes.anchor_sd_m);
    if part_m > whole_m { Err(UncertaintyError::PartExceedsWhole { part_m, whole_m }) } else { Ok(()) }
}

/// Effect of one standard deviation of each cause on a joint; NaN if the chain is broken.
fn joint_effects(
    figure: &StickFigure,
    joint: Joint,
    noise_rad: f64,
    causes: &Causes,
    effects: &DMatrix<f64>,
) -> [DVec3; CAUSES] {
    let place = figure[joint];
    let (k, r) = (place.length(), place.normalize());
    // k dr for the two image directions of this joint.
    let (e1, e2) = r.any_orthonormal_pair();
    let own = 2 + 2 * joint as usize;
    let mut across = [DVec3::ZERO; CAUSES];
    across[own] = k * noise_rad * e1;
    across[own + 1] = k * noise_rad * e2;
    let Some(start) = joint.start() else {
        across[0] = causes.anchor_scale_sd_m * r;
        across[1] = (causes.anchor_sd_m.powi(2) - causes.anchor_scale_sd_m.powi(2)).max(0.0).sqrt() * r;
        return across;
    };
    let v = place - figure[start];
    let (length, h) = (v.length(), v.dot(r));
    let w = v - h * r;
    let of_start =
        |c: usize| DVec3::from_array([0, 1, 2].map(|axis| effects[(3 * start as usize + axis, c)]));
    let mut q: [f64; CAUSES] = std::array::from_fn(|c| w.dot(of_start(c)) - w.dot(across[c]));
    q[0] += length * length * causes.scale_sd;
    q[2 + 2 * JOINT_COUNT + joint as usize] += length * causes.length_sd_m[joint];
    let s = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    // s / (sqrt(h² + 2 s) - h) without cancellation: half the sum of square root and h.
    let effective = 0.5 * ((h * h + 2.0 * s).sqrt() + h.abs());
    let inverse = if effective > 0.0 { 1.0f64.copysign(h) / effective } else { 0.0 };
    std::array::from_fn(|c| across[c] + r * (r.dot(of_start(c)) + q[c] * inverse))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::skeleton::PerJoint;
    use crate::posture::lift::roots;
    use crate::synth::Random;

    /// A figure 4 m away whose segments all have some extent along their rays.
    fn figure() -> StickFigure {
        let mut figure = StickFigure::UNKNOWN;
        let steps = [
            DVec3::new(0.1, -0.3, 4.0),
            DVec3::new(-0.16, 0.02, -0.1),
            DVec3::new(0.16, 0.02, 0.1),
            DVec3::new(0.02, 0.45, 0.12),
            DVec3::new(-0.1, 0.1, -0.08),
            DVec3::new(0.1, 0.1, 0.08),
            DVec3::new(-0.02, 0.25, 0.15),
            DVec3::new(0.03, 0.26, -0.12),
            DVec3::new(-0.05, 0.18, -0.17),
            DVec3::new(0.02, 0.2, -0.14),
            DVec3::new(0.0, 0.36, -0.2),
            DVec3::new(0.02, 0.38, 0.15),
            DVec3::new(0.0, 0.35, 0.2),
            DVec3::new(-0.02, 0.34, 0.22),
        ];
        for (joint, step) in Joint::ALL.into_iter().zip(steps) {
            figure[joint] = step + joint.start().map_or(DVec3::ZERO, |start| figure[start]);
        }
        figure
    }

    fn normal(random: &mut Random) -> f64 {
        f64::from(random.normal_pair()[0])
    }

    /// The figure computed again by eq. (7) from disturbed causes, on the same side of every root.
    fn disturbed(truth: &StickFigure, noise_rad: f64, causes: &Causes, random: &mut Random) -> StickFigure {
        let scale = normal(random);
        let own = (causes.anchor_sd_m.powi(2) - causes.anchor_scale_sd_m.powi(2)).sqrt();
        let mut figure = StickFigure::UNKNOWN;
        for joint in Joint::ALL {
            let p = truth[joint];
            let shake = DVec3::new(normal(random), normal(random), normal(random));
            let ray = (p.normalize() + noise_rad * shake).normalize();
            let Some(start) = joint.start() else {
                figure[joint] = ray * (p.length() + causes.anchor_scale_sd_m * scale + own * normal(random));
                continue;
            };
            let v = p - truth[start];
            let length =
                v.length() * (1.0 + causes.scale_sd * scale) + causes.length_sd_m[joint] * normal(random);
            let found = roots(figure[start], ray, length, 0.0, 0.0);
            figure[joint] = if v.dot(p) > 0.0 { found.far } else { found.near };
        }
        figure
    }

    /// Measured divided by stated standard deviations, absolute and relative to the neck, of every joint.
    fn ratios(truth: &StickFigure, noise_rad: f64, causes: &Causes) -> Vec<(Joint, f64, f64)> {
        let rays = JointRays { noise_rad, ..JointRays::from_points(truth) };
        let stated = propagate(truth, &rays, causes).unwrap();
        let mut random = Random::new(5);
        let draws: Vec<StickFigure> =
            (0..4000).map(|_| disturbed(truth, noise_rad, causes, &mut random)).collect();
        let spread = |place: &dyn Fn(&StickFigure) -> DVec3| {
            let mean = draws.iter().map(place).sum::<DVec3>() / draws.len() as f64;
            let sum: f64 = draws.iter().map(|d| (place(d) - mean).length_squared()).sum();
            (sum / draws.len() as f64).sqrt()
        };
        let ratio = |joint: Joint| {
            let absolute = spread(&|f| f[joint]) / stated.absolute_sd_m[joint];
            let relative = spread(&|f| f[joint] - f[Joint::Neck]) / stated.relative_sd_m[joint];
            (joint, absolute, relative)
        };
        Joint::ALL.into_iter().map(ratio).collect()
    }

    fn causes() -> Causes {
        Causes {
            anchor_sd_m: 0.1,
            length_sd_m: PerJoint([0.002; JOINT_COUNT]),
            scale_sd: 0.01,
            anchor_scale_sd_m: 0.04,
        }
    }

    #[test]
    fn stated_deviations_are_those_of_a_monte_carlo() {
        let small = Causes {
            anchor_sd_m: 0.01,
            length_sd_m: PerJoint([0.0005; JOINT_COUNT]),
            scale_sd: 0.001,
            anchor_scale_sd_m: 0.004,
        };
        for (joint, absolute, relative) in ratios(&figure(), 1e-4, &small) {
            println!("small {:15} {absolute:.3} {relative:.3}", joint.name());
            assert!((absolute - 1.0).abs() < 0.08, "{joint:?}: absolute {absolute}");
            assert!(joint == Joint::Neck || (relative - 1.0).abs() < 0.08, "{joint:?}: relative {relative}");
        }
        for (joint, absolute, relative) in ratios(&figure(), 5e-4, &causes()) {
            println!("1 px  {:15} {absolute:.3} {relative:.3}", joint.name());
            assert!((0.7..1.4).contains(&absolute), "{joint:?}: absolute {absolute}");
            assert!(joint == Joint::Neck || (0.7..1.4).contains(&relative), "{joint:?}: relative {relative}");
        }
    }

    /// Seen perpendicular to the viewing direction, the roots are equal: the first order would be infinite.
    #[test]
    fn where_roots_meet_the_deviation_stays_finite_and_of_the_right_size() {
        let mut square = figure();
        let direction = square[Joint::RightHip].normalize();
        let (across, _) = direction.any_orthonormal_pair();
        // Perpendicular to the ray of its own end.
        square[Joint::RightKnee] = square[Joint::RightHip] + 0.4 * across;
        let end = square[Joint::RightKnee].normalize();
        let v = square[Joint::RightKnee] - square[Joint::RightHip];
        square[Joint::RightKnee] -= v.dot(end) * end;
        square[Joint::RightAnkle] = square[Joint::RightKnee] + DVec3::new(0.0, 0.35, 0.2);
        let all = ratios(&square, 5e-4, &causes());
        for (joint, absolute, relative) in all {
            if [Joint::RightKnee, Joint::RightAnkle].contains(&joint) {
                println!("square {:15} {absolute:.3} {relative:.3}", joint.name());
                assert!((0.4..1.6).contains(&absolute), "{joint:?}: absolute {absolute}");
                assert!((0.4..1.6).contains(&relative), "{joint:?}: relative {relative}");
            }
        }
    }

    #[test]
    fn the_anchors_error_moves_the_figure_along_and_turns_it_little() {
        let truth = figure();
        let rays = JointRays::from_points(&truth);
        let only = Causes {
            length_sd_m: PerJoint([0.0; JOINT_COUNT]),
            scale_sd: 0.0,
            anchor_scale_sd_m: 0.0,
            ..causes()
        };
        let found = propagate(&truth, &rays, &only).unwrap();
        for joint in Joint::ALL {
            let (absolute, relative) = (found.absolute_sd_m[joint], found.relative_sd_m[joint]);
            println!("anchor {:15} {absolute:.3} {relative:.3}", joint.name());
            assert!((absolute - 0.1).abs() < 0.06 && relative < 0.06, "{joint:?}: {absolute} {relative}");
        }
        // If lengths and distance are wrong by the same factor, the figure is a scaled copy of itself.
        let distance = truth[Joint::Neck].length();
        let scale = Causes {
            anchor_sd_m: 0.01 * distance,
            anchor_scale_sd_m: 0.01 * distance,
            scale_sd: 0.01,
            ..only
        };
        let found = propagate(&truth, &rays, &scale).unwrap();
        for joint in Joint::ALL {
            let expected = 0.01 * truth[joint].length();
            assert!((found.absolute_sd_m[joint] / expected - 1.0).abs() < 0.03, "{joint:?}");
        }
    }

    #[test]
    fn what_is_unknown_stays_unknown_and_nonsense_is_refused() {
        let mut truth = figure();
        truth[Joint::RightKnee] = DVec3::NAN;
        let rays = JointRays::from_points(&figure());
        let found = propagate(&truth, &rays, &causes()).unwrap();
        assert!(
            found.absolute_sd_m[Joint::RightKnee].is_nan() && found.absolute_sd_m[Joint::RightAnkle].is_nan()
        );
        assert!(found.absolute_sd_m[Joint::LeftAnkle].is_finite());
        assert!(propagate(&StickFigure::UNKNOWN, &rays, &causes()).is_err());
        let error = propagate(&figure(), &rays, &Causes { anchor_sd_m: -1.0, ..causes() }).unwrap_err();
        assert!(error.to_string().contains("anchor_sd_m") && error.to_string().contains("-1"), "{error}");
        let error = propagate(&figure(), &rays, &Causes { anchor_scale_sd_m: 0.2, ..causes() }).unwrap_err();
        assert!(matches!(error, UncertaintyError::PartExceedsWhole { .. }));
    }

    /// Across its ray, a joint's error is the noise of its own image point only; along it, all other causes.
    #[test]
    fn deviations_along_the_rays_are_those_of_a_monte_carlo() {
        let truth = figure();
        let causes = Causes {
            anchor_sd_m: 0.05,
            length_sd_m: PerJoint([0.004; JOINT_COUNT]),
            scale_sd: 0.01,
            anchor_scale_sd_m: 0.03,
        };
        let noise_rad = 8e-4;
        let rays = JointRays { noise_rad, ..JointRays::from_points(&truth) };
        let stated = propagate(&truth, &rays, &causes).unwrap();
        let mut random = Random::new(9);
        let draws: Vec<StickFigure> =
            (0..4000).map(|_| disturbed(&truth, noise_rad, &causes, &mut random)).collect();
        for joint in Joint::ALL {
            let ray = truth[joint].normalize();
            let spread = |along: DVec3| {
                let square = |f: &StickFigure| (f[joint] - truth[joint]).dot(along).powi(2);
                (draws.iter().map(square).sum::<f64>() / draws.len() as f64).sqrt()
            };
            let along = spread(ray) / stated.along_ray_sd_m[joint];
            assert!((along - 1.0).abs() < 0.1, "{joint:?} {along}");
            for across in [ray.any_orthonormal_pair().0, ray.any_orthonormal_pair().1] {
                let ratio = spread(across) / (noise_rad * truth[joint].length());
                assert!((ratio - 1.0).abs() < 0.05, "{joint:?} {ratio}");
                let of_covariance = nalgebra::Vector3::from(across.to_array());
                let stated = of_covariance.dot(&(stated.covariance(joint) * of_covariance)).sqrt();
                assert!((stated / (noise_rad * truth[joint].length()) - 1.0).abs() < 1e-9, "{joint:?}");
            }
        }
    }
}
