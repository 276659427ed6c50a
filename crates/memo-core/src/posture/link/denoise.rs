//! Tracks of the joints in the image, with outliers left out and noise reduced, for decisions about depth.
//!
//! A depth is the small difference of two squares ([`super::super::lift`]), so noise across the rays becomes much
//! larger along them. Each image coordinate is smoothed over time before depths are computed. How far it may
//! accelerate depends on the joint and on the neck's distance, so that little noise is smoothed little.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::LinkFrame;
use crate::estimate::smooth::{Measured, smooth_track};
use crate::model::skeleton::Joint;
use crate::posture::prior::acceleration_mps2;

/// A point farther than this from the median of itself and its neighbours, in standard deviations, is an outlier.
const OUTLIER_SIGMAS: f64 = 5.0;
/// Acceleration that no joint exceeds for long, m/s²: a point may differ by that much from its neighbours.
const MOST_ACCELERATION_MPS2: f64 = 100.0;

/// The frames with their rays smoothed over time. Rays that are not seen stay so.
pub(super) fn denoised(frames: &[LinkFrame]) -> Vec<LinkFrame> {
    let tracks: Vec<Vec<(DVec3, f64)>> =
        Joint::ALL.into_par_iter().map(|joint| denoised_track(frames, joint)).collect();
    let mut clean = frames.to_vec();
    for (t, frame) in clean.iter_mut().enumerate() {
        let mut sum = (0.0, 0);
        for (joint, track) in Joint::ALL.into_iter().zip(&tracks) {
            let (ray, sd) = track[t];
            if ray.is_finite() {
                frame.rays.ray[joint] = ray;
                sum = (sum.0 + sd, sum.1 + 1);
            }
        }
        if sum.1 > 0 {
            frame.rays.noise_rad = frame.rays.noise_rad.min(sum.0 / f64::from(sum.1));
        }
        let neck = frame.rays.ray[Joint::Neck];
        if frame.neck.is_finite() && neck.is_finite() {
            frame.neck = frame.neck.length() * neck;
        }
    }
    clean
}

/// The ray of a joint in every frame and its standard deviation, radians; NaN if it is not seen.
fn denoised_track(frames: &[LinkFrame], joint: Joint) -> Vec<(DVec3, f64)> {
    let ray = |frame: &LinkFrame| frame.rays.sees(joint).then_some(frame.rays.ray[joint]);
    denoised_rays(frames, &frames.iter().map(ray).collect::<Vec<_>>(), acceleration_mps2(joint))
}

/// The rays to a point that accelerates by about `acceleration_mps2`, `None` where it is not seen, with their noise
/// reduced; and their standard deviation, radians. NaN if it is not seen.
pub(super) fn denoised_rays(
    frames: &[LinkFrame],
    rays: &[Option<DVec3>],
    acceleration_mps2: f64,
) -> Vec<(DVec3, f64)> {
    let mut clean = vec![(DVec3::NAN, f64::NAN); frames.len()];
    let seen: Vec<(usize, DVec3)> =
        rays.iter().enumerate().filter_map(|(t, ray)| Some((t, (*ray)?))).collect();
    if seen.len() < 3 || seen.iter().any(|(_, ray)| ray.z <= 0.1) {
        for (t, ray) in seen {
            clean[t] = (ray, frames[t].rays.noise_rad);
        }
        return clean;
    }
    let (at, rays): (Vec<usize>, Vec<DVec3>) = seen.into_iter().unzip();
    let points: Vec<DVec2> = rays.iter().map(|&ray| image_point(ray)).collect();
    let times_s: Vec<f64> = at.iter().map(|&t| frames[t].time_s).collect();
    let kept = kept(frames, &at, &points, &times_s);
    let depth_m = at.iter().map(|&t| frames[t].neck.z).fold(0.0, |a, b| a + b) / at.len() as f64;
    let acceleration = acceleration_mps2 / depth_m;
    let axes = [0, 1].map(|axis| {
        let measure = |(k, &t): (usize, &usize)| {
            if kept[k] {
                Measured { value: points[k][axis], sd: frames[t].rays.noise_rad }
            } else {
                Measured::NOTHING
            }
        };
        let measured: Vec<Measured> = at.iter().enumerate().map(measure).collect();
        smooth_track(&times_s, &measured, acceleration)
    });
    for (k, &t) in at.iter().enumerate() {
        let [u, v] = [axes[0][k], axes[1][k]];
        if u.value.is_finite() && v.value.is_finite() {
            clean[t] = (DVec3::new(u.value, v.value, 1.0).normalize(), u.sd);
        } else {
            clean[t] = (rays[k], frames[t].rays.noise_rad);
        }
    }
    clean
}

/// The point of a ray in the plane at unit depth.
pub(super) fn image_point(ray: DVec3) -> DVec2 {
    ray.truncate() / ray.z
}

/// Which points are not outliers: near the median of themselves and their neighbours.
fn kept(frames: &[LinkFrame], seen: &[usize], points: &[DVec2], times_s: &[f64]) -> Vec<bool> {
    (0..points.len())
        .map(|k| {
            if k == 0 || k + 1 == points.len() {
                return true;
            }
            let three = [points[k - 1], points[k], points[k + 1]];
            let median = DVec2::new(middle(three.map(|p| p.x)), middle(three.map(|p| p.y)));
            let frame = &frames[seen[k]];
            let step_s = 0.5 * (times_s[k + 1] - times_s[k - 1]);
            let curve = 0.5 * MOST_ACCELERATION_MPS2 * step_s * step_s / frame.neck.z;
            points[k].distance(median) <= OUTLIER_SIGMAS * frame.rays.noise_rad + curve
        })
        .collect()
}

/// The middle one of three values.
fn middle([a, b, c]: [f64; 3]) -> f64 {
    a.max(b).min(a.min(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::skeleton::{JOINT_COUNT, PerJoint};
    use crate::posture::lift::JointRays;
    use crate::posture::link::FrontPoints;
    use crate::synth::Random;

    /// All joints swing by 0.3 m once in a second, 5 m away.
    fn frames(count: usize, noise_rad: f64) -> (Vec<LinkFrame>, Vec<DVec3>) {
        let mut random = Random::new(4);
        let truth: Vec<DVec3> =
            (0..count).map(|t| DVec3::new(0.06 * (0.2 * t as f64).sin(), 0.02, 1.0).normalize()).collect();
        let frame = |(t, ray): (usize, &DVec3)| {
            let noisy = |_| {
                let [u, v] = random.normal_pair().map(f64::from);
                (*ray / ray.z + noise_rad * DVec3::new(u, v, 0.0)).normalize()
            };
            let rays = JointRays {
                ray: PerJoint([(); JOINT_COUNT].map(noisy)),
                weight: PerJoint([1.0; JOINT_COUNT]),
                noise_rad,
            };
            LinkFrame { time_s: t as f64 / 30.0, rays, neck: 5.0 * *ray, front: FrontPoints::UNSEEN }
        };
        (truth.iter().enumerate().map(frame).collect(), truth)
    }

    fn error_rad(frames: &[LinkFrame], truth: &[DVec3], joint: Joint) -> f64 {
        let squares = frames.iter().zip(truth).map(|(f, ray)| f.rays.ray[joint].distance_squared(*ray));
        (squares.sum::<f64>() / truth.len() as f64).sqrt()
    }

    /// Much noise is halved, little noise does not make slow motion worse, and the noise stated is smaller.
    #[test]
    fn noise_is_reduced_as_far_as_it_exceeds_the_motion() {
        for (noise_rad, most) in [(5e-3, 0.6), (2e-4, 1.05)] {
            let (frames, truth) = frames(90, noise_rad);
            let clean = denoised(&frames);
            for joint in [Joint::Pelvis, Joint::LeftElbow, Joint::RightAnkle] {
                let ratio = error_rad(&clean, &truth, joint) / error_rad(&frames, &truth, joint);
                assert!(ratio < most, "{noise_rad} {joint:?} {ratio}");
            }
            assert!(clean.iter().all(|frame| frame.rays.noise_rad <= noise_rad));
        }
    }

    #[test]
    fn outliers_are_left_out_and_what_is_not_seen_stays_so() {
        let (mut frames, truth) = frames(60, 1e-3);
        frames[20].rays.ray[Joint::LeftKnee] = DVec3::new(0.2, 0.1, 1.0).normalize();
        for frame in &mut frames[30..40] {
            frame.rays.ray[Joint::RightWrist] = DVec3::NAN;
        }
        let clean = denoised(&frames);
        assert!(clean[20].rays.ray[Joint::LeftKnee].distance(truth[20]) < 4e-3);
        for (t, frame) in clean.iter().enumerate() {
            assert_eq!(frame.rays.sees(Joint::RightWrist), !(30..40).contains(&t), "{t}");
            assert!((frame.neck.length() - frames[t].neck.length()).abs() < 1e-9);
        }
        assert_eq!(denoised(&frames[..2])[1].rays, frames[1].rays);
    }

    #[test]
    fn the_middle_of_three_is_between_the_others() {
        for order in [[1.0, 2.0, 3.0], [2.0, 1.0, 3.0], [3.0, 1.0, 2.0], [1.0, 3.0, 2.0]] {
            assert_eq!(middle(order), 2.0);
        }
    }
}
