//! The anchor from the ground under the feet and the chain of segments up to the neck.
//!
//! The camera's position relative to the ground is known. For every distance of the neck on a grid, the chain is
//! followed down: pelvis, hips, knees, ankles, with both roots of eq. (7) at each segment. Each chain is compared
//! with what is known: the trunk is upright, one ankle (the supporting one) is at its height above the ground,
//! the other is not below it, and the neck is above the middle between the ankles. The sum over all chains is the
//! probability of the distance; either ankle may be the supporting one.
//! With [`super::Bending`] the trunk leans mostly forwards, and the body's centre is above the ankles, not the neck.
//!
//! Errors along the rays are propagated down the chain as variances. Roots that do not exist cost the square of
//! their gap relative to noise and lengths. The bending direction of the knees is not used. Feet in the air, or
//! on something that is not the ground, are not detected in one frame; compare with the other sources
//! ([`super::combine`]).

use crate::estimate::median::median;
use glam::DVec3;

use super::{
    Anchor, AnchorError, AnchorOptions, AnchorSource, Bending, Ground, NORMAL_NODES, anchor_of_density,
    check_lengths, check_up, from_extent, neck_ray, pelvis_to_hip_line_m, positive, standing_span_m,
};
use crate::model::skeleton::{Joint, SegmentLengths, Side};
use crate::posture::lift::{JointRays, RootKind, roots};

/// Number of distances tried, evenly spaced in their logarithm, in steps of 0.6 %.
const GRID: usize = 240;
/// Range of distances tried: this factor below and above the distance of the extent.
const RANGE: f64 = 2.0;
/// Chains much less probable than the best one of their distance are dropped: -2 ln of the ratio.
const NEGLIGIBLE: f64 = 40.0;

/// The anchor from the ground under the feet.
///
/// `ground` is the plane on which the person is ([`Ground::of`] for a calibrated camera). Neck, pelvis, and hip,
/// knee and ankle of at least one side must be seen.
pub fn from_ground(
    rays: &JointRays,
    lengths: &SegmentLengths,
    ground: &Ground,
    options: &AnchorOptions,
) -> Result<Anchor, AnchorError> {
    let source_name = AnchorSource::Ground;
    let ray = neck_ray(rays, source_name)?;
    check_lengths(lengths)?;
    options.check()?;
    positive("camera_height_m", ground.camera_height_m)?;
    let ground = Ground { up_in_camera: check_up(ground.up_in_camera)?, ..*ground };
    if !rays.sees(Joint::Pelvis) {
        return Err(AnchorError::NotSeen { source_name, missing: "pelvis" });
    }
    let sees_leg = |side: Side| [side.hip(), side.knee(), side.ankle()].iter().all(|&j| rays.sees(j));
    let legs: Vec<Side> = Side::BOTH.into_iter().filter(|&side| sees_leg(side)).collect();
    if legs.is_empty() {
        return Err(AnchorError::NotSeen { source_name, missing: "hip, knee and ankle of one side" });
    }
    let rough = from_extent(rays, lengths, Some(ground.up_in_camera), options)?.distance_m;
    let distances: Vec<f64> =
        (0..GRID).map(|i| rough * RANGE.powf(2.0 * i as f64 / (GRID - 1) as f64 - 1.0)).collect();

    let at_scale = |scale: f64| -> (Vec<f64>, Option<f64>) {
        let lengths = scaled(lengths, scale);
        let scene = Scene { rays, lengths: &lengths, ground: &ground, options, legs: &legs };
        // Steps of the grid grow with the distance, hence ln k.
        let log: Vec<f64> = distances.iter().map(|&k| scene.log_density(k * ray) + k.ln()).collect();
        let best = log.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let density: Vec<f64> = log.iter().map(|l| (l - best).exp()).collect();
        let total: f64 = density.iter().sum();
        let mean = distances.iter().zip(&density).map(|(k, p)| k * p).sum::<f64>() / total;
        (density.iter().map(|p| p / total).collect(), best.is_finite().then_some(mean))
    };
    let mut density = vec![0.0; GRID];
    let mut means = [0.0; 3];
    for (slot, (node, weight)) in means.iter_mut().zip(NORMAL_NODES) {
        let (part, mean) = at_scale(1.0 + node * options.scale_sd);
        let nearest_m = distances[0];
        let farthest_m = distances[GRID - 1];
        *slot = mean.ok_or(AnchorError::NothingFits { source_name, nearest_m, farthest_m })?;
        density.iter_mut().zip(part).for_each(|(sum, p)| *sum += weight * p);
    }
    let sd_scale_m = 0.5 * (means[2] - means[0]).abs() / NORMAL_NODES[2].0;
    anchor_of_density(ray, &distances, &density, sd_scale_m, source_name).ok_or(AnchorError::NothingFits {
        source_name,
        nearest_m: distances[0],
        farthest_m: distances[GRID - 1],
    })
}

/// Height of the neck above the lower ankle, divided by trunk, thigh and shank together, of people who walk: mean, and
/// standard deviation over people (see the head of [`super`]).
const RISE_OVER_LOWER: (f64, f64) = (0.972, 0.012);
/// Standard deviation of the depth of the neck against the supporting ankle, mean of a sequence, metres.
const ABOVE_FEET_SD_M: f64 = 0.06;
/// A sequence tells the scale from this many frames on.
const FEWEST_FRAMES: usize = 5;

/// The scale of a standing or walking person's lengths, relative to `lengths`, with its standard deviation, from where the
/// feet and the neck are seen; `None` without feet on the ground in front of the camera.
///
/// Of a person at the depth d, the supporting ankle is seen at its height a above the ground, and the neck at the height
/// z above it: d = (h - a) / tan(angle of the ankle's ray below the horizon) for a camera at height h. Neither depends on
/// the lengths. The median over the frames counts; an error of a changes the rise z - a by the factor 1 / (h - a). What scatters
/// from frame to frame, of who bends or jumps, is part of the standard deviation.
pub fn standing_scale(
    rays: &[JointRays],
    lengths: &SegmentLengths,
    ground: &Ground,
    options: &AnchorOptions,
) -> Option<(f64, f64)> {
    let up = ground.up_in_camera;
    let ankle_m = options.ankle_height_over_shank
        * 0.5
        * (lengths.to[Joint::RightAnkle] + lengths.to[Joint::LeftAnkle]);
    let below_m = ground.camera_height_m - ankle_m;
    let flat = |v: DVec3| v - v.dot(up) * up;
    let rise_and_depth_m = |rays: &JointRays| {
        let neck = rays.sees(Joint::Neck).then(|| rays.ray[Joint::Neck])?;
        let ahead = flat(neck).try_normalize()?;
        let on_ground = |side: Side| {
            let ray = rays.sees(side.ankle()).then(|| rays.ray[side.ankle()])?;
            (ray.dot(up) < 0.0).then(|| below_m / -ray.dot(up) * ray.dot(ahead))
        };
        // An ankle above its height on the ground seems farther away.
        let depth_m = Side::BOTH.into_iter().filter_map(on_ground).min_by(f64::total_cmp)?;
        Some([below_m + depth_m * neck.dot(up) / neck.dot(ahead), depth_m])
    };
    let found: Vec<[f64; 2]> = rays.iter().filter_map(rise_and_depth_m).collect();
    if below_m <= 0.0 || found.len() < FEWEST_FRAMES {
        return None;
    }
    let median_of = |of: &dyn Fn(&[f64; 2]) -> f64| median(&mut found.iter().map(of).collect::<Vec<_>>());
    let (rise_m, depth_m) = (median_of(&|pair| pair[0])?, median_of(&|pair| pair[1])?);
    // Of who walks, the rise stays the same within 2 %.
    let scatter_m = 1.4826 * median_of(&|pair| (pair[0] - rise_m).abs())?;
    let (ratio, ratio_sd) = RISE_OVER_LOWER;
    let scale = rise_m / (ratio * standing_span_m(lengths));
    let of_depth = (rise_m - below_m) / rise_m * ABOVE_FEET_SD_M / depth_m;
    let relative_sd = (ratio_sd / ratio)
        .hypot(options.ankle_height_sd_m / below_m)
        .hypot(of_depth)
        .hypot(scatter_m / rise_m);
    (scale > 0.0).then_some((scale, scale * relative_sd))
}

fn scaled(lengths: &SegmentLengths, scale: f64) -> SegmentLengths {
    let mut scaled = *lengths;
    scaled.to.0.iter_mut().for_each(|l| *l *= scale);
    scaled.rigid.iter_mut().for_each(|l| *l *= scale);
    scaled
}

/// A position on a ray with its variance along the ray and its cost so far (-2 ln of its probability).
#[derive(Debug, Clone, Copy)]
struct Link {
    point: DVec3,
    variance: f64,
    cost: f64,
}

struct Scene<'a> {
    rays: &'a JointRays,
    lengths: &'a SegmentLengths,
    ground: &'a Ground,
    options: &'a AnchorOptions,
    legs: &'a [Side],
}

impl Scene<'_> {
    /// ln of the probability of the neck at a position, up to a constant.
    fn log_density(&self, neck: DVec3) -> f64 {
        let start = Link { point: neck, variance: 0.0, cost: 0.0 };
        let mut chains = Vec::with_capacity(256);
        for pelvis in self.next(start, Joint::Pelvis, self.lengths.to[Joint::Pelvis]) {
            let pelvis = self.upright(neck, pelvis);
            let trunk = self.lengths.to[Joint::Pelvis];
            let down = (pelvis.point - neck).normalize_or_zero();
            let middle = neck + down * (trunk + pelvis_to_hip_line_m(self.lengths));
            for right_is_near in [true, false] {
                let ankles: Vec<Vec<Link>> = self
                    .legs
                    .iter()
                    .map(|&side| self.ankles(Link { point: middle, ..pelvis }, side, right_is_near))
                    .collect();
                self.close(self.above_ankles(neck, middle), pelvis.cost, &ankles, &mut chains);
            }
        }
        let best = chains.iter().copied().fold(f64::INFINITY, f64::min);
        let sum: f64 =
            chains.iter().filter(|&&c| c < best + NEGLIGIBLE).map(|c| (-0.5 * (c - best)).exp()).sum();
        sum.ln() - 0.5 * best
    }

    /// The two positions of the joint at the end of a segment, nearer one first.
    fn next(&self, from: Link, to: Joint, length_m: f64) -> [Link; 2] {
        let noise_rad = self.noise_rad(from.point, length_m);
        let roots = roots(from.point, self.rays.ray[to], length_m, noise_rad, 0.0);
        let e = noise_rad * std::f64::consts::SQRT_2 * from.point.length();
        let gap = match roots.kind {
            RootKind::None { gap_m } => gap_m / e,
            _ => 0.0,
        };
        let variance = from.variance + roots.sd_m * roots.sd_m;
        [roots.near, roots.far].map(|point| Link { point, variance, cost: from.cost + gap * gap })
    }

    /// The noise of an image point with that of a length, as an angle at one end.
    fn noise_rad(&self, at: DVec3, length_m: f64) -> f64 {
        let own = self.options.length_sd * length_m / (std::f64::consts::SQRT_2 * at.length());
        self.rays.noise_rad.hypot(own)
    }

    /// The place whose vertical goes through the ankles, given the middle of the hips.
    fn above_ankles(&self, neck: DVec3, hips: DVec3) -> DVec3 {
        self.options.bending.map_or(neck, |b| b.balance.above_ankles(neck, hips, b.front))
    }

    /// Combines the pelvis with the position on its ray at which the trunk has its usual lean.
    fn upright(&self, neck: DVec3, pelvis: Link) -> Link {
        let ray = self.rays.ray[Joint::Pelvis];
        let up = self.ground.up_in_camera;
        let length = self.lengths.to[Joint::Pelvis];
        // The point of the ray with the smallest horizontal distance from where the pelvis usually is.
        let flat = |v: DVec3| v - v.dot(up) * up;
        let (ray_flat, neck_flat) = (flat(ray), flat(neck));
        if ray_flat.length_squared() < 1e-6 {
            return pelvis;
        }
        let (usual, sd_rad) = match self.options.bending {
            None => (neck_flat, self.options.lean_sd_rad),
            Some(Bending { front, lean, .. }) => {
                let spine = neck - pelvis.point;
                let lean_rad = spine.dot(front).atan2(spine.dot(up));
                (neck_flat - lean.mean_rad * length * front, lean.sd_rad(lean_rad))
            }
        };
        let k = usual.dot(ray_flat) / ray_flat.length_squared();
        let expected = (sd_rad * length).powi(2) / ray_flat.length_squared();
        let found = pelvis.point.dot(ray);
        let sum = expected + pelvis.variance;
        let k_mean = (found * expected + k * pelvis.variance) / sum;
        Link {
            point: ray * k_mean,
            variance: expected * pelvis.variance / sum,
            cost: pelvis.cost + (found - k).powi(2) / sum + sum.ln(),
        }
    }

    /// The four positions of an ankle below one middle of the hips.
    fn ankles(&self, middle: Link, side: Side, right_is_near: bool) -> Vec<Link> {
        let [_, _, _, hips] = self.lengths.rigid;
        let free = Link { cost: 0.0, ..middle };
        let hip =
            self.next(free, side.hip(), 0.5 * hips)[usize::from((side == Side::Right) != right_is_near)];
        let knees = self.next(hip, side.knee(), self.lengths.to[side.knee()]);
        knees
            .into_iter()
            .flat_map(|knee| self.next(knee, side.ankle(), self.lengths.to[side.ankle()]))
            .collect()
    }

    /// Costs of all ways in which one trunk's chains end on the ground.
    fn close(&self, above: DVec3, cost: f64, ankles: &[Vec<Link>], chains: &mut Vec<f64>) {
        let roles = |a: &Link| (a.cost + self.support(a), a.cost + self.swing(a));
        if let [right, left] = ankles {
            let left: Vec<_> = left.iter().map(|l| (l, roles(l))).collect();
            for r in right {
                let (r_support, r_swing) = roles(r);
                for (l, (l_support, l_swing)) in &left {
                    let balance =
                        self.balance(above, 0.5 * (r.point + l.point), 0.25 * (r.variance + l.variance));
                    chains.push(cost + balance + r_support + l_swing);
                    chains.push(cost + balance + r_swing + l_support);
                }
            }
        } else if let [one] = ankles {
            for a in one {
                let (support, swing) = roles(a);
                let balance = self.balance(above, a.point, a.variance);
                chains.push(cost + balance + support);
                chains.push(cost + balance + swing);
            }
        }
    }

    /// Height of an ankle above that of a supporting one, and the variance of its height by the chain.
    fn above(&self, ankle: &Link) -> (f64, f64) {
        let shank = 0.5 * (self.lengths.to[Joint::RightAnkle] + self.lengths.to[Joint::LeftAnkle]);
        let height = self.ground.height_m(ankle.point) - self.options.ankle_height_over_shank * shank;
        let slope = ankle.point.normalize_or_zero().dot(self.ground.up_in_camera);
        let noise_m = self.rays.noise_rad * ankle.point.length();
        (height, slope * slope * ankle.variance + noise_m * noise_m)
    }

    fn support(&self, ankle: &Link) -> f64 {
        let (above, variance) = self.above(ankle);
        let total = variance + self.options.ankle_height_sd_m.powi(2);
        above * above / total + total.ln()
    }

    fn swing(&self, ankle: &Link) -> f64 {
        let (above, variance) = self.above(ankle);
        let own = if above > 0.0 { self.options.swing_height_m } else { self.options.ankle_height_sd_m };
        let width = self.options.swing_height_m.powi(2) + variance;
        above * above / (own * own + variance) + width.ln()
    }

    /// Cost of ankles with this middle below a place of the body.
    fn balance(&self, above: DVec3, middle: DVec3, variance: f64) -> f64 {
        let sd_m = self.options.bending.map_or(self.options.balance_sd_m, |b| b.balance.sd_m);
        let offset = middle - above;
        let up = self.ground.up_in_camera;
        let flat = offset - offset.dot(up) * up;
        // The variance of the chain is only along the ray.
        let ray = middle.normalize_or_zero();
        let along = (ray - ray.dot(up) * up).normalize_or_zero();
        let (depth, total) = (flat.dot(along), sd_m.powi(2) + variance);
        let side = (flat.length_squared() - depth * depth).max(0.0) / sd_m.powi(2);
        depth * depth / total + total.ln() + side
    }
}

#[cfg(test)]
mod tests {
    use super::super::trunk::{from_trunk, rigid_trunk};
    use super::*;
    use crate::model::skeleton::{JOINT_COUNT, PerJoint, StickFigure};
    use crate::posture::example::bent;
    use crate::posture::prior::MotionPrior;

    /// A person upright 4 m in front of a level camera at 1.2 m, facing obliquely, with one foot lifted.
    fn standing(lengths: &SegmentLengths, lifted: Side) -> StickFigure {
        let trunk = rigid_trunk(lengths);
        let turn = glam::DMat3::from_rotation_y(0.5);
        let mut figure = PerJoint([DVec3::NAN; JOINT_COUNT]);
        for joint in Joint::ALL {
            figure[joint] = turn * trunk[joint];
        }
        for side in Side::BOTH {
            let (thigh, shank) = if side == lifted { (0.5, -0.4) } else { (0.0, 0.0) };
            let hang = |angle: f64| turn * DVec3::new(f64::sin(angle), f64::cos(angle), 0.0);
            figure[side.knee()] = figure[side.hip()] + hang(thigh) * lengths.to[side.knee()];
            figure[side.ankle()] = figure[side.knee()] + hang(shank) * lengths.to[side.ankle()];
        }
        let sole = 0.18 * lengths.to[Joint::RightAnkle];
        let lowest = figure[lifted.other().ankle()].y;
        PerJoint(figure.0.map(|p| p + DVec3::new(0.1, 1.2 - sole - lowest, 4.0)))
    }

    const GROUND: Ground = Ground { up_in_camera: DVec3::NEG_Y, camera_height_m: 1.2 };

    fn rays(figure: &StickFigure) -> JointRays {
        JointRays { noise_rad: 2e-3, ..JointRays::from_points(figure) }
    }

    /// Told which way the person faces, the neck of one who bends is where it is; taken as upright, it is too far away.
    #[test]
    fn who_bends_towards_the_camera_has_the_neck_in_front_of_the_feet() {
        let lengths = SegmentLengths::from_height(1.75).unwrap();
        let MotionPrior { trunk_lean: lean, balance, .. } = MotionPrior::any();
        let bending = balance.map(|balance| Bending { front: DVec3::NEG_Z, lean, balance });
        for lean_deg in [25.0_f64, 40.0, 55.0] {
            let figure = bent(&lengths, lean_deg.to_radians());
            let off_m = |bending| {
                let options = AnchorOptions { bending, ..AnchorOptions::default() };
                let found = from_ground(&rays(&figure), &lengths, &GROUND, &options).unwrap();
                found.distance_m - figure[Joint::Neck].length()
            };
            let [upright, told] = [None, bending].map(off_m);
            assert!(told.abs() < 0.06, "{lean_deg} degrees: {told} m");
            assert!(upright > told.abs() + 0.08, "{lean_deg} degrees: {upright} m if upright, {told} m");
            let by_trunk = |bending| {
                let options = AnchorOptions { bending, ..AnchorOptions::default() };
                let up = Some(GROUND.up_in_camera);
                let found = from_trunk(&rays(&figure), &lengths, up, &options).unwrap().anchor;
                (found.distance_m - figure[Joint::Neck].length()).abs()
            };
            let [upright, told] = [None, bending].map(by_trunk);
            assert!(
                told < 0.6 * upright,
                "{lean_deg} degrees: {told} m by the trunk, {upright} m if upright"
            );
        }
    }

    /// A person is as large as the feet on the ground and the neck say, whatever lengths are assumed.
    #[test]
    fn feet_and_neck_tell_the_scale_of_who_stands() {
        let assumed = SegmentLengths::from_height(1.75).unwrap();
        let options = AnchorOptions::default();
        for true_scale in [0.93, 1.0, 1.05] {
            // At the ankle's height of the assumed lengths, which the scale does not change.
            let lift_m = 0.18 * assumed.to[Joint::RightAnkle] * (true_scale - 1.0);
            let figure = standing(&scaled(&assumed, true_scale), Side::Left);
            let seen = |away_m: f64| rays(&PerJoint(figure.0.map(|p| p + DVec3::new(0.0, lift_m, away_m))));
            let frames: Vec<JointRays> = (0..5).map(|k| seen(0.3 * f64::from(k))).collect();
            let (scale, sd) = standing_scale(&frames, &assumed, &GROUND, &options).unwrap();
            let rise_m = figure[Joint::RightAnkle].y - figure[Joint::Neck].y;
            let expected = rise_m / (0.972 * standing_span_m(&assumed));
            assert!((scale / expected - 1.0).abs() < 0.005, "{true_scale}: {scale} {expected}");
            // 2 cm of 1.13 m, the posture, and a neck 6 cm in front of the feet or behind them.
            assert!((0.020..0.024).contains(&(sd / scale)), "{sd}");
            assert_eq!(standing_scale(&frames[1..], &assumed, &GROUND, &options), None, "four frames");
        }
        let figure = standing(&assumed, Side::Left);
        let crouched = PerJoint(figure.0.map(|p| DVec3::new(p.x, 1.2 - 0.9 * (1.2 - p.y), p.z)));
        let frames = [&figure, &crouched, &figure, &crouched, &figure].map(rays);
        let (_, sd) = standing_scale(&frames, &assumed, &GROUND, &options).unwrap();
        assert!(sd < 0.03, "two of five are outliers");
        let bowed = PerJoint(figure.0.map(|p| DVec3::new(p.x, 1.2 - 0.8 * (1.2 - p.y), p.z)));
        let frames = [&figure, &crouched, &bowed, &crouched, &figure].map(rays);
        let (_, sd) = standing_scale(&frames, &assumed, &GROUND, &options).unwrap();
        assert!((0.1..0.2).contains(&sd), "{sd}");
        let frames = [rays(&figure); 5];
        let lying = Ground { camera_height_m: 0.05, ..GROUND };
        assert_eq!(standing_scale(&frames, &assumed, &lying, &options), None, "a camera below the ankles");
        let above = Ground { up_in_camera: DVec3::Y, ..GROUND };
        assert_eq!(standing_scale(&frames, &assumed, &above, &options), None, "feet above the horizon");
    }

    /// Right and left swapped and the image mirrored: the same distance, whichever foot supports.
    #[test]
    fn either_foot_may_stand() {
        let lengths = SegmentLengths::from_height(1.75).unwrap();
        let options = AnchorOptions::default();
        for lifted in Side::BOTH {
            let figure = standing(&lengths, lifted);
            let mirror = |p: DVec3| DVec3::new(-p.x, p.y, p.z);
            let mirrored = PerJoint(Joint::ALL.map(|joint| mirror(figure[joint.mirrored()])));
            let [a, b] =
                [figure, mirrored].map(|f| from_ground(&rays(&f), &lengths, &GROUND, &options).unwrap());
            assert!((a.distance_m - b.distance_m).abs() < 1e-9, "{a:?} {b:?}");
            assert!((a.sd_depth_m - b.sd_depth_m).abs() < 1e-9);
            assert!((a.distance_m - figure[Joint::Neck].length()).abs() < 2.0 * a.sd_depth_m);
        }
    }

    /// The mean over all distances by another quadrature, evenly spaced and much finer.
    #[test]
    fn distances_weigh_by_their_density() {
        let lengths = SegmentLengths::from_height(1.75).unwrap();
        let options = AnchorOptions { scale_sd: 0.0, ankle_height_sd_m: 0.1, ..AnchorOptions::default() };
        let figure = standing(&lengths, Side::Left);
        let rays = JointRays { noise_rad: 2e-2, ..JointRays::from_points(&figure) };
        let found = from_ground(&rays, &lengths, &GROUND, &options).unwrap();
        let legs = Side::BOTH;
        let scene = Scene { rays: &rays, lengths: &lengths, ground: &GROUND, options: &options, legs: &legs };
        let ray = rays.ray[Joint::Neck];
        let rough = from_extent(&rays, &lengths, Some(GROUND.up_in_camera), &options).unwrap().distance_m;
        let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
        for i in 0..4000 {
            let k = rough * (0.5 + 1.5 * (f64::from(i) + 0.5) / 4000.0);
            let p = scene.log_density(k * ray).exp();
            (total, first, second) = (total + p, first + p * k, second + p * k * k);
        }
        let mean = first / total;
        let sd = (second / total - mean * mean).sqrt();
        assert!(sd > 0.05 * mean, "wide enough for the spacing to matter: {sd}");
        assert!((found.distance_m / mean - 1.0).abs() < 2e-3, "{} {mean}", found.distance_m);
        assert!((found.sd_depth_m / sd - 1.0).abs() < 0.02, "{} {sd}", found.sd_depth_m);
    }

    /// The part of the deviation that is due to the scale is the effect of longer and shorter lengths.
    #[test]
    fn the_scale_s_part_is_what_scaled_lengths_do() {
        let lengths = SegmentLengths::from_height(1.75).unwrap();
        let figure = standing(&lengths, Side::Left);
        let at = |scale: f64| {
            let options = AnchorOptions { scale_sd: 0.0, ..AnchorOptions::default() };
            from_ground(&rays(&figure), &scaled(&lengths, scale), &GROUND, &options).unwrap().distance_m
        };
        let options = AnchorOptions { scale_sd: 0.02, ..AnchorOptions::default() };
        let found = from_ground(&rays(&figure), &lengths, &GROUND, &options).unwrap();
        let expected = 0.5 * (at(1.02) - at(0.98)).abs();
        assert!(expected > 0.005, "{expected}");
        assert!((found.sd_scale_m / expected - 1.0).abs() < 0.15, "{} {expected}", found.sd_scale_m);
    }

    fn scene_of<'a>(
        rays: &'a JointRays,
        lengths: &'a SegmentLengths,
        options: &'a AnchorOptions,
    ) -> Scene<'a> {
        Scene { rays, lengths, ground: &GROUND, options, legs: &Side::BOTH }
    }

    /// The measured pelvis and the pelvis below the neck are two normal densities: their product, at its mean.
    #[test]
    fn an_upright_trunk_and_its_image_are_put_together() {
        let lengths = SegmentLengths::from_height(1.75).unwrap();
        let options = AnchorOptions::default();
        let (neck, pelvis) = (DVec3::new(0.0, -0.2, 4.0), DVec3::new(0.02, 0.25, 4.2));
        let mut rays = JointRays::from_points(&StickFigure::UNKNOWN);
        let ray = pelvis.normalize();
        rays.ray[Joint::Pelvis] = ray;
        let scene = scene_of(&rays, &lengths, &options);
        for variance in [0.01, 0.2] {
            let both = scene.upright(neck, Link { point: pelvis, variance, cost: 0.0 });
            // The trunk's horizontal offset from the neck is smallest at the nearest point of the ray.
            let flat = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
            let level = flat(ray).length_squared();
            let mean = flat(neck).dot(flat(ray)) / level;
            let usual = (options.lean_sd_rad * lengths.to[Joint::Pelvis]).powi(2) / level;
            let [w, v] = [1.0 / variance, 1.0 / usual];
            assert!((both.variance - 1.0 / (w + v)).abs() < 1e-12);
            let expected = (w * pelvis.length() + v * mean) / (w + v);
            assert!((both.point.dot(ray) - expected).abs() < 1e-9, "{variance}");
            let sum: f64 = variance + usual;
            assert!((both.cost - (pelvis.length() - mean).powi(2) / sum - sum.ln()).abs() < 1e-9);
        }
    }

    /// The height of a supporting ankle is a density over heights, for any noise. A lifted foot may be high, but
    /// not below the ground.
    #[test]
    fn the_height_of_a_foot_is_a_density() {
        let lengths = SegmentLengths::from_height(1.75).unwrap();
        let options = AnchorOptions::default();
        let rays = JointRays { noise_rad: 1e-3, ..JointRays::from_points(&StickFigure::UNKNOWN) };
        let scene = scene_of(&rays, &lengths, &options);
        let stands_m = 0.18 * lengths.to[Joint::LeftAnkle];
        let at = |height_m: f64, variance: f64| {
            let point = DVec3::new(0.0, 1.2 - stands_m - height_m, 4.0);
            Link { point, variance, cost: 0.0 }
        };
        for variance in [0.0, 0.2, 1.0] {
            // The slope of the ray converts depth to height: the densities of all heights must integrate to one.
            let mass: f64 = (-4000..4000)
                .map(|i| (-0.5 * scene.support(&at(f64::from(i) * 1e-3, variance))).exp() * 1e-3)
                .sum();
            assert!((mass / std::f64::consts::TAU.sqrt() - 1.0).abs() < 0.15, "{variance}: {mass}");
        }
        let [above, below] = [0.05, -0.05].map(|height_m| scene.swing(&at(height_m, 0.0)));
        assert!(below > above + 3.0, "{above} {below}");
        let [own, noise] = [options.swing_height_m, 1e-3 * 4.0f64];
        let lift = scene.swing(&at(0.2, 0.0)) - scene.swing(&at(1e-9, 0.0));
        assert!((lift / (0.04 / (own * own + noise * noise)) - 1.0).abs() < 0.01, "{lift}");
    }
}
