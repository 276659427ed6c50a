//! The anchor from the trunk as a rigid body: neck, shoulders, pelvis and hips of known lengths.
//!
//! Least squares over attitude and position by Levenberg-Marquardt on the distances of the points from their
//! rays, from several starting attitudes. A nearly flat body seen from afar has mirror attitudes that fit almost
//! equally; all are returned with their probabilities (their distances are nearly equal). Without the vertical, a
//! leaning trunk and a more distant one look the same, and the standard deviation contains this.
//!
//! In walking, shoulders and hips rotate relative to each other by up to 16 degrees. This is part of the noise
//! (`rigidity_sd_m`), not of the model.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix6, Vector6};

use super::{
    Anchor, AnchorError, AnchorOptions, AnchorSource, DepthMode, check_lengths, check_up, neck_ray,
    pelvis_to_hip_line_m,
};
use crate::estimate::least_squares::Damping;
use crate::model::skeleton::{Joint, PerJoint, SegmentLengths};
use crate::posture::lift::JointRays;

/// One attitude of the trunk that fits the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrunkAttitude {
    /// Columns: the trunk's axes in camera axes, x forward, y down, z from right to left.
    pub camera_from_trunk: DMat3,
    /// Distance of the neck along its ray, metres, and its standard deviation in this attitude.
    pub depth: DepthMode,
    /// Sum of squared residuals divided by their variances, including the prior.
    pub chi_sq: f64,
}

/// The anchor with all attitudes.
#[derive(Debug, Clone, PartialEq)]
pub struct TrunkFit {
    /// The anchor over all attitudes.
    pub anchor: Anchor,
    /// The attitudes, most probable first, including the mirror pair.
    pub attitudes: Vec<TrunkAttitude>,
}

/// The trunk's joints in its own axes (x forward, y down, z left), relative to the neck, metres.
///
/// The shoulder line is behind the neck by the remainder of the distance neck-shoulder after half the width. The
/// trunk's plane contains shoulders and pelvis, and the hips are in its extension. Both sides have the mean
/// length.
pub fn rigid_trunk(lengths: &SegmentLengths) -> PerJoint<DVec3> {
    let [shoulders, right_pelvis, left_pelvis, hips] = lengths.rigid;
    let neck_shoulder = 0.5 * (lengths.to[Joint::RightShoulder] + lengths.to[Joint::LeftShoulder]);
    let shoulder_pelvis = 0.5 * (right_pelvis + left_pelvis);
    let leg = |hypotenuse: f64, side: f64| (hypotenuse * hypotenuse - side * side).max(0.0).sqrt();
    let behind = leg(neck_shoulder, 0.5 * shoulders);
    let below = leg(shoulder_pelvis, 0.5 * shoulders);
    let neck_pelvis = lengths.to[Joint::Pelvis];
    // The triangle of neck, middle of the shoulders and pelvis, with y from neck to pelvis.
    let y = ((behind * behind - below * below) / neck_pelvis + neck_pelvis) / 2.0;
    let y = y.clamp(-behind, behind);
    let middle = DVec3::new(-leg(behind, y), y, 0.0);
    let pelvis = DVec3::Y * neck_pelvis;
    let down = (pelvis - middle).try_normalize().unwrap_or(DVec3::Y);
    let hip_middle = pelvis + down * pelvis_to_hip_line_m(lengths);
    let mut trunk = PerJoint([DVec3::NAN; 14]);
    trunk[Joint::Neck] = DVec3::ZERO;
    trunk[Joint::Pelvis] = pelvis;
    for (right, centre, half) in
        [(Joint::RightShoulder, middle, 0.5 * shoulders), (Joint::RightHip, hip_middle, 0.5 * hips)]
    {
        trunk[right] = centre - DVec3::Z * half;
        trunk[right.mirrored()] = centre + DVec3::Z * half;
    }
    trunk
}

/// The joints of the trunk, each with its deviation from the rigid body divided by `rigidity_sd_m`.
const TRUNK_JOINTS: [(Joint, f64); 6] = [
    (Joint::Neck, 0.5),
    (Joint::RightShoulder, 1.2),
    (Joint::LeftShoulder, 1.2),
    (Joint::Pelvis, 0.7),
    (Joint::RightHip, 1.2),
    (Joint::LeftHip, 1.2),
];

/// Number of starting attitudes about the vertical.
const FACINGS: usize = 8;
const ITERATIONS: usize = 40;
/// Attitudes closer than this to a better one are the same, radians.
const SAME_RAD: f64 = 0.14;
/// Attitudes are dropped if their χ² exceeds the smallest by more than this.
const WORSE_CHI_SQ: f64 = 16.0;

/// The anchor from the rigid trunk.
///
/// `up` is the vertical in camera axes, if known: then the trunk is upright within `lean_sd_rad`. The neck, the
/// pelvis or a hip, and four of the six joints must be seen.
pub fn from_trunk(
    rays: &JointRays,
    lengths: &SegmentLengths,
    up: Option<DVec3>,
    options: &AnchorOptions,
) -> Result<TrunkFit, AnchorError> {
    let source_name = AnchorSource::Trunk;
    let ray = neck_ray(rays, source_name)?;
    check_lengths(lengths)?;
    options.check()?;
    let up = up.map(check_up).transpose()?;
    let low = [Joint::Pelvis, Joint::RightHip, Joint::LeftHip].into_iter().find(|&j| rays.sees(j));
    let Some(low) = low else {
        return Err(AnchorError::NotSeen { source_name, missing: "pelvis and hips" });
    };
    if TRUNK_JOINTS.iter().filter(|(j, _)| rays.sees(*j)).count() < 4 {
        return Err(AnchorError::NotSeen { source_name, missing: "four of neck, shoulders, pelvis, hips" });
    }
    let trunk = rigid_trunk(lengths);
    let angle = ray.angle_between(rays.ray[low]).max(1e-4);
    let rough = trunk[low].length() / angle;
    let problem = Problem { rays, trunk: &trunk, up, options, rough_m: rough };
    let mut fits: Vec<Fit> = starts(up, ray, rays.ray[low], rough)
        .into_iter()
        .filter_map(|rotation| problem.refine(rotation, ray * rough))
        .collect();
    fits.sort_by(|a, b| a.chi_sq.total_cmp(&b.chi_sq));
    let mut kept: Vec<Fit> = Vec::new();
    for fit in fits {
        let best = kept.first().map_or(fit.chi_sq, |f| f.chi_sq);
        if fit.chi_sq <= best + WORSE_CHI_SQ
            && kept.iter().all(|k| turn(&k.rotation, &fit.rotation) > SAME_RAD)
        {
            kept.push(fit);
        }
    }
    summary(ray, &kept, options.scale_sd).ok_or(AnchorError::NothingFits {
        source_name,
        nearest_m: 0.0,
        farthest_m: f64::INFINITY,
    })
}

/// Starting attitudes: y down, all facing directions; without the vertical also leaning towards and away.
fn starts(up: Option<DVec3>, neck: DVec3, low: DVec3, rough_m: f64) -> Vec<DMat3> {
    let down = up.map_or_else(|| ((low - neck) * rough_m).normalize_or(DVec3::Y), |up| -up);
    let across = down.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
    let upright = DMat3::from_cols(across, down, across.cross(down));
    let leans: &[f64] = if up.is_some() { &[0.0] } else { &[-0.4, 0.0, 0.4] };
    let mut starts = Vec::with_capacity(leans.len() * FACINGS);
    for &lean in leans {
        for i in 0..FACINGS {
            let facing = std::f64::consts::TAU * (i as f64 + 0.5) / FACINGS as f64;
            starts.push(DMat3::from_axis_angle(across, lean) * upright * DMat3::from_rotation_y(facing));
        }
    }
    starts
}

/// The angle of the rotation from one attitude to another.
fn turn(a: &DMat3, b: &DMat3) -> f64 {
    let c = a.transpose() * *b;
    (0.5 * (c.x_axis.x + c.y_axis.y + c.z_axis.z - 1.0)).clamp(-1.0, 1.0).acos()
}

struct Fit {
    rotation: DMat3,
    distance_m: f64,
    variance: f64,
    chi_sq: f64,
    /// ln of the square root of the covariance's determinant.
    log_volume: f64,
}

struct Problem<'a> {
    rays: &'a JointRays,
    trunk: &'a PerJoint<DVec3>,
    up: Option<DVec3>,
    options: &'a AnchorOptions,
    rough_m: f64,
}

impl Problem<'_> {
    /// Levenberg-Marquardt over a rotation ω about the neck (R <- exp(ω) R) and its position t.
    fn refine(&self, mut rotation: DMat3, mut neck: DVec3) -> Option<Fit> {
        let (mut normal, mut gradient, mut chi_sq) = self.linearised(&rotation, neck);
        let mut damping = Damping::start(0.0);
        for _ in 0..ITERATIONS {
            let lead = |step: &Vector6<f64>| {
                let omega = DVec3::new(step[0], step[1], step[2]);
                let turned = omega
                    .try_normalize()
                    .map_or(rotation, |axis| DMat3::from_axis_angle(axis, omega.length()) * rotation);
                let moved = neck + DVec3::new(step[3], step[4], step[5]);
                let linearised = self.linearised(&turned, moved);
                (linearised.2 <= chi_sq).then_some((turned, moved, linearised))
            };
            let Some((turned, moved, linearised)) = damping.descend(&normal, &gradient, lead) else { break };
            let gain = chi_sq - linearised.2;
            (rotation, neck) = (turned, moved);
            (normal, gradient, chi_sq) = linearised;
            if gain < 1e-9 {
                break;
            }
        }
        let ray = self.rays.ray[Joint::Neck];
        let covariance = normal.cholesky()?.inverse();
        let along = |i: usize, j: usize| covariance[(3 + i, 3 + j)] * ray[i] * ray[j];
        let variance: f64 = (0..3).flat_map(|i| (0..3).map(move |j| along(i, j))).sum();
        let distance_m = neck.dot(ray);
        let sound = distance_m > 0.0 && variance > 0.0 && variance.is_finite() && chi_sq.is_finite();
        let log_volume = 0.5 * covariance.determinant().max(1e-300).ln();
        sound.then_some(Fit { rotation, distance_m, variance, chi_sq, log_volume })
    }

    /// JᵀJ, Jᵀr and rᵀr of the residuals: the points' distances from their rays in two directions, and the lean.
    fn linearised(&self, rotation: &DMat3, neck: DVec3) -> (Matrix6<f64>, Vector6<f64>, f64) {
        let mut normal = Matrix6::zeros();
        let mut gradient = Vector6::zeros();
        let mut chi_sq = 0.0;
        let mut add = |residual: f64, turn: DVec3, shift: DVec3| {
            let row = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            normal += row * row.transpose();
            gradient += row * residual;
            chi_sq += residual * residual;
        };
        for (joint, stray) in TRUNK_JOINTS {
            if !self.rays.sees(joint) {
                continue;
            }
            let arm = *rotation * self.trunk[joint];
            let point = neck + arm;
            let ray = self.rays.ray[joint];
            let sd = (stray * self.options.rigidity_sd_m).hypot(self.rays.noise_rad * self.rough_m);
            let (e1, e2) = ray.any_orthonormal_pair();
            for e in [e1 / sd, e2 / sd] {
                // d(e·(ω × arm)) = ω·(arm × e)
                add(e.dot(point), arm.cross(e), e);
            }
        }
        if let Some(up) = self.up {
            let down = rotation.y_axis;
            let (e1, e2) = up.any_orthonormal_pair();
            let spread = |b: super::Bending| 0.5 * (b.lean.backward_sd_rad + b.lean.forward_sd_rad);
            let sd_rad = self.options.bending.map_or(self.options.lean_sd_rad, spread);
            for e in [e1, e2].map(|e| e / sd_rad) {
                add(e.dot(down), down.cross(e), DVec3::ZERO);
            }
        } else {
            // The trunk is seen from afar, not from below: a weak prior on the rotation keeps the system
            // definite.
            (0..3).for_each(|i| normal[(i, i)] += 1e-3);
        }
        (normal, gradient, chi_sq)
    }
}

/// All attitudes as one anchor; probabilities are exp(-χ²/2) times the volume of the covariance.
fn summary(ray: DVec3, fits: &[Fit], scale_sd: f64) -> Option<TrunkFit> {
    let best = fits.first()?;
    let weights: Vec<f64> = fits
        .iter()
        .map(|f| (0.5 * (best.chi_sq - f.chi_sq) + f.log_volume - best.log_volume).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    let mut attitudes: Vec<TrunkAttitude> = fits
        .iter()
        .zip(&weights)
        .map(|(fit, weight)| TrunkAttitude {
            camera_from_trunk: fit.rotation,
            depth: DepthMode {
                distance_m: fit.distance_m,
                sd_m: fit.variance.sqrt().hypot(scale_sd * fit.distance_m),
                probability: weight / total,
            },
            chi_sq: fit.chi_sq,
        })
        .collect();
    attitudes.sort_by(|a, b| b.depth.probability.total_cmp(&a.depth.probability));
    let mean = |value: &dyn Fn(&DepthMode) -> f64| {
        attitudes.iter().map(|a| a.depth.probability * value(&a.depth)).sum::<f64>()
    };
    let distance_m = mean(&|d| d.distance_m);
    let sd_depth_m = mean(&|d| d.sd_m.powi(2) + (d.distance_m - distance_m).powi(2)).sqrt();
    if !(distance_m > 0.0 && sd_depth_m.is_finite()) {
        return None;
    }
    let anchor = Anchor {
        neck: ray * distance_m,
        distance_m,
        sd_depth_m,
        sd_scale_m: scale_sd * distance_m,
        source: AnchorSource::Trunk,
        modes: attitudes.iter().map(|a| a.depth).collect(),
    };
    Some(TrunkFit { anchor, attitudes })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::skeleton::{JOINT_COUNT, RigidDistance, Side, StickFigure};

    /// All lengths of Table A.1 between the points of the rigid trunk; the neck is in front of the shoulders.
    #[test]
    fn the_rigid_trunk_has_the_paper_s_lengths() {
        let lengths = SegmentLengths::lee_chen();
        let trunk = rigid_trunk(&lengths);
        for joint in
            [Joint::RightShoulder, Joint::LeftShoulder, Joint::Pelvis, Joint::RightHip, Joint::LeftHip]
        {
            let length = trunk.segment(joint).length();
            assert!((length - lengths.to[joint]).abs() < 1e-9, "{joint:?} {length}");
        }
        for distance in RigidDistance::ALL {
            let [a, b] = distance.joints();
            let length = trunk[a].distance(trunk[b]);
            assert!((length - lengths.rigid[distance as usize]).abs() < 1e-9, "{distance:?} {length}");
        }
        let middle = trunk[Joint::RightShoulder].midpoint(trunk[Joint::LeftShoulder]);
        assert!((middle.length() - 0.0377).abs() < 1e-4 && middle.x < -0.037, "{middle}");
        assert_eq!(trunk[Joint::Neck], DVec3::ZERO);
        for side in Side::BOTH {
            assert_eq!(trunk[side.shoulder()].z > 0.0, side == Side::Left);
            assert_eq!(trunk[side.hip()].z > 0.0, side == Side::Left);
        }
    }

    fn fit(distance_m: f64, variance: f64, chi_sq: f64, log_volume: f64) -> Fit {
        Fit { rotation: DMat3::IDENTITY, distance_m, variance, chi_sq, log_volume }
    }

    /// Two attitudes: their odds follow from χ² and volume, the deviation from within and between them.
    #[test]
    fn attitudes_are_put_together_by_their_probabilities() {
        // χ² larger by 2 ln 2, a volume larger by half: odds of 4 to 3.
        let second = fit(4.4, 0.09, 1.0 + 2.0 * 2f64.ln(), 1.5f64.ln());
        let found = summary(DVec3::Z, &[fit(4.0, 0.04, 1.0, 0.0), second], 0.01).unwrap();
        let [p, q] = [4.0 / 7.0, 3.0 / 7.0];
        assert!((found.attitudes[0].depth.probability - p).abs() < 1e-12);
        let mean = 4.0 * p + 4.4 * q;
        assert!((found.anchor.distance_m - mean).abs() < 1e-12);
        // With one per cent of each distance for the scale of the lengths.
        let within = p * (0.04 + 0.04f64.powi(2)) + q * (0.09 + 0.044f64.powi(2));
        let between = p * (4.0 - mean).powi(2) + q * (4.4 - mean).powi(2);
        assert!((found.anchor.sd_depth_m.powi(2) - within - between).abs() < 1e-12);
        assert!((found.anchor.sd_scale_m - 0.01 * mean).abs() < 1e-12);
        assert!((found.attitudes[0].depth.sd_m.powi(2) - 0.04 - 0.0016).abs() < 1e-12);
    }

    fn problem<'a>(
        rays: &'a JointRays,
        trunk: &'a PerJoint<DVec3>,
        up: Option<DVec3>,
        options: &'a AnchorOptions,
    ) -> Problem<'a> {
        Problem { rays, trunk, up, options, rough_m: 4.0 }
    }

    /// A trunk that leans by 7 degrees to any side deviates by one standard deviation.
    #[test]
    fn a_leaning_trunk_costs_its_lean() {
        let options = AnchorOptions::default();
        let trunk = rigid_trunk(&SegmentLengths::lee_chen());
        let rays = JointRays::from_points(&StickFigure::UNKNOWN);
        let problem = problem(&rays, &trunk, Some(-DVec3::Y), &options);
        for axis in [DVec3::X, DVec3::Z, DVec3::new(1.0, 0.0, 1.0)] {
            let leaning = DMat3::from_axis_angle(axis.normalize(), 7f64.to_radians());
            let (_, _, chi_sq) = problem.linearised(&leaning, DVec3::new(0.0, 0.0, 4.0));
            assert!((chi_sq - 1.0).abs() < 0.01, "{axis} {chi_sq}");
        }
        let upright = problem.linearised(&DMat3::from_rotation_y(1.0), DVec3::new(0.0, 0.0, 4.0));
        assert!(upright.2 < 1e-12);
    }

    /// The pelvis is 2 cm from its ray; the deviations are 0.7 times 1 cm of the body, and image noise at 4 m.
    #[test]
    fn a_point_off_its_ray_costs_its_distance() {
        let options = AnchorOptions::default();
        let trunk = rigid_trunk(&SegmentLengths::lee_chen());
        let mut rays = JointRays::from_points(&PerJoint([DVec3::NAN; JOINT_COUNT]));
        let neck = DVec3::new(0.0, 0.0, 4.0);
        rays.ray[Joint::Pelvis] = (neck + trunk[Joint::Pelvis]).normalize();
        for noise_rad in [0.0, 0.002, 0.01] {
            rays.noise_rad = noise_rad;
            let problem = problem(&rays, &trunk, None, &options);
            let (_, _, chi_sq) = problem.linearised(&DMat3::IDENTITY, neck + 0.02 * DVec3::X);
            let sd = 0.007f64.hypot(noise_rad * 4.0);
            assert!((chi_sq - (0.02 / sd).powi(2)).abs() < 1e-9 * chi_sq, "{noise_rad} {chi_sq}");
        }
    }
}
