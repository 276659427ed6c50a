//! Body dimensions of a rendered person, limb by limb.

use crate::synth::Random;
use glam::DVec3;

/// Body dimensions of a person, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sizes {
    /// From crown to sole, standing straight.
    pub(super) height_m: f64,
    pub(super) ankle_height_m: f64,
    pub(super) shank_m: f64,
    pub(super) thigh_m: f64,
    /// From hips to shoulders.
    pub(super) trunk_m: f64,
    pub(super) neck_m: f64,
    pub(super) head_above_shoulders_m: f64,
    pub(super) upper_arm_m: f64,
    pub(super) forearm_m: f64,
    pub(super) hand_m: f64,
    pub(super) hip_half_width_m: f64,
    pub(super) shoulder_half_width_m: f64,
    pub(super) foot_length_m: f64,
    /// Factor on all radii.
    pub(super) girth: f64,
}

impl Sizes {
    /// Random dimensions for a given height.
    pub(super) fn drawn(height_m: f64, random: &mut Random) -> Self {
        let mut share =
            |mean: f64, sd: f64| mean * (1.0 + sd * f64::from(random.normal_pair()[0].clamp(-2.5, 2.5)));
        let [ankle, shank, thigh, trunk] = [0.039, 0.246, 0.245, 0.288].map(|mean| share(mean, 0.03));
        let head = share(0.182, 0.03);
        let scale = height_m / (ankle + shank + thigh + trunk + head);
        let mut long = |mean: f64| height_m * share(mean, 0.03);
        Self {
            height_m,
            ankle_height_m: scale * ankle,
            shank_m: scale * shank,
            thigh_m: scale * thigh,
            trunk_m: scale * trunk,
            neck_m: 0.25 * scale * head,
            head_above_shoulders_m: scale * head - 0.072 * height_m,
            upper_arm_m: long(0.186),
            forearm_m: long(0.146),
            hand_m: long(0.060),
            hip_half_width_m: long(0.050),
            shoulder_half_width_m: long(0.108),
            foot_length_m: long(0.152),
            girth: share(1.0, 0.06) * height_m,
        }
    }

    /// Radii of heel, ball and toe.
    pub(super) fn foot_radii_m(&self) -> [f64; 3] {
        [0.018, 0.014, 0.011].map(|radius| radius * self.height_m)
    }

    /// Heel, ball and toe relative to the ankle of a level foot: x forward, z up.
    pub(super) fn foot_m(&self) -> [DVec3; 3] {
        let [heel, ball, toe] = self.foot_radii_m();
        let back = -0.27 * self.foot_length_m;
        let at = |x: f64, radius: f64| DVec3::new(x, 0.0, radius - self.ankle_height_m);
        [
            at(back + heel, heel),
            at(back + 0.72 * self.foot_length_m, ball),
            at(back + self.foot_length_m - toe, toe),
        ]
    }
}
