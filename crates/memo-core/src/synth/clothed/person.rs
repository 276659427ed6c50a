//! Sizes and clothes of a rendered person, and the solids that represent them.
//!
//! Mean lengths are those of Drillis and Contini 1966 (in Winter, *Biomechanics and Motor Control of Human
//! Movement*, fig. 4.1); the lengths of each person differ from them by 3 %. Girths are chosen; clothes are
//! random.

use super::round_cone::RoundCone;
use super::sizes::Sizes;
use super::stride::Figure;
use crate::synth::Random;
use glam::DVec3;

/// The material of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cloth {
    /// Grey level in full light.
    pub(super) grey: f64,
    /// Stripes across the solid: the fraction by which they are darker, and their number.
    pub(super) stripes: (f64, f64),
}

/// A solid with its material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Solid {
    pub(super) shape: RoundCone,
    pub(super) cloth: Cloth,
}

impl Solid {
    pub(super) fn moved(self, by_m: DVec3) -> Self {
        let ends = self.shape.ends.map(|end| end + by_m);
        Self { shape: RoundCone { ends, ..self.shape }, ..self }
    }
}

/// A person's clothes and skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clothes {
    skin: Cloth,
    hair: Cloth,
    shirt: Cloth,
    trousers: Cloth,
    shoes: Cloth,
    long_sleeves: bool,
    long_trousers: bool,
    /// Thickness of the cloth, metres.
    loose_m: f64,
}

impl Clothes {
    /// Random clothes in front of a wall of a given grey level: shirt and trousers differ from it and from
    /// each other.
    pub(super) fn drawn(wall: f64, random: &mut Random) -> Self {
        let plain = |grey: f64| Cloth { grey, stripes: (0.0, 0.0) };
        let skin = random.uniform(110.0, 215.0);
        let mut unlike = |others: &[f64]| loop {
            let grey = random.uniform(25.0, 235.0);
            if others.iter().all(|other| (grey - other).abs() > 35.0) {
                return grey;
            }
        };
        let shirt = unlike(&[wall]);
        let trousers = unlike(&[wall, shirt]);
        let striped = random.uniform(0.0, 1.0) < 0.4;
        let stripes = if striped { (random.uniform(0.1, 0.3), random.uniform(3.0, 9.0)) } else { (0.0, 0.0) };
        Self {
            skin: plain(skin),
            hair: plain(random.uniform(20.0, 120.0)),
            shirt: Cloth { grey: shirt, stripes },
            trousers: plain(trousers),
            shoes: plain(random.uniform(15.0, 60.0)),
            long_sleeves: random.uniform(0.0, 1.0) < 0.6,
            long_trousers: random.uniform(0.0, 1.0) < 0.85,
            loose_m: random.uniform(0.002, 0.014),
        }
    }
}

impl Clothes {
    /// The covering of a trolley in the same colours, and its wheels.
    pub(super) fn of_a_trolley(&self) -> [Cloth; 2] {
        [self.shirt, self.shoes]
    }
}

/// The solids of a figure.
pub(super) fn solids(figure: &Figure, sizes: &Sizes, clothes: &Clothes) -> Vec<Solid> {
    let mut solids = trunk_and_head(figure, sizes, clothes);
    for side in 0..2 {
        solids.extend(arm(figure, side, sizes, clothes));
        solids.extend(leg(figure, side, sizes, clothes));
    }
    solids
}

fn trunk_and_head(figure: &Figure, sizes: &Sizes, clothes: &Clothes) -> Vec<Solid> {
    let g = sizes.girth;
    let forward = figure.forward;
    let [right, left] = figure.joints;
    let (shoulders, hips) = (right.shoulder.midpoint(left.shoulder), right.hip.midpoint(left.hip));
    let up = (shoulders - hips).normalize();
    let ahead = |point: DVec3, by: f64, above: f64| point + by * g * forward + above * g * up;
    let loose = clothes.loose_m;
    let solid = |cloth, shape| Solid { shape, cloth };
    let mut solids = vec![
        solid(clothes.skin, RoundCone::ball(ahead(figure.head, 0.0, 0.018), 0.052 * g)),
        solid(
            clothes.skin,
            RoundCone::new(figure.head, ahead(figure.head, 0.018, -0.032), 0.046 * g, 0.030 * g),
        ),
        solid(clothes.hair, RoundCone::ball(ahead(figure.head, -0.014, 0.024), 0.0525 * g)),
        solid(clothes.skin, RoundCone::new(figure.neck, figure.head, 0.034 * g, 0.030 * g)),
        solid(
            clothes.shirt,
            RoundCone::new(
                ahead(shoulders, 0.004, -0.055),
                ahead(hips, 0.0, 0.03),
                0.066 * g + loose,
                0.064 * g + loose,
            ),
        ),
        solid(clothes.trousers, RoundCone::new(right.hip, left.hip, 0.054 * g + loose, 0.054 * g + loose)),
        solid(clothes.trousers, RoundCone::ball(ahead(hips, -0.022, -0.005), 0.060 * g)),
    ];
    for (joints, other) in [(right, left), (left, right)] {
        let shoulder = joints.shoulder.lerp(other.shoulder, 0.16);
        let waist = joints.hip.lerp(other.hip, 0.05) + 0.05 * g * up;
        let shape = RoundCone::new(shoulder, waist, 0.040 * g + loose, 0.052 * g + loose);
        solids.push(solid(clothes.shirt, shape));
    }
    solids
}

fn arm(figure: &Figure, side: usize, sizes: &Sizes, clothes: &Clothes) -> [Solid; 3] {
    let (g, joints) = (sizes.girth, figure.joints[side]);
    let sleeve = if clothes.long_sleeves { clothes.shirt } else { clothes.skin };
    let loose = clothes.loose_m;
    let forearm = if clothes.long_sleeves { loose } else { 0.0 };
    [
        Solid {
            shape: RoundCone::new(joints.shoulder, joints.elbow, 0.030 * g + loose, 0.024 * g + loose),
            cloth: clothes.shirt,
        },
        Solid {
            shape: RoundCone::new(joints.elbow, joints.wrist, 0.024 * g + forearm, 0.016 * g + forearm),
            cloth: sleeve,
        },
        Solid {
            shape: RoundCone::new(joints.wrist, figure.hands[side], 0.017 * g, 0.016 * g),
            cloth: clothes.skin,
        },
    ]
}

fn leg(figure: &Figure, side: usize, sizes: &Sizes, clothes: &Clothes) -> [Solid; 5] {
    let (g, joints) = (sizes.girth, figure.joints[side]);
    let [heel, ball, toe] = figure.feet[side];
    let [heel_r, ball_r, toe_r] = sizes.foot_radii_m();
    let shank = if clothes.long_trousers { clothes.trousers } else { clothes.skin };
    let loose = clothes.loose_m;
    let low = if clothes.long_trousers { loose } else { 0.0 };
    let calf = joints.knee.lerp(joints.ankle, 0.28) - 0.009 * g * figure.forward;
    [
        Solid {
            shape: RoundCone::new(joints.hip, joints.knee, 0.052 * g + loose, 0.034 * g + loose),
            cloth: clothes.trousers,
        },
        Solid {
            shape: RoundCone::new(joints.knee, joints.ankle, 0.032 * g + low, 0.020 * g + 1.5 * low),
            cloth: shank,
        },
        Solid { shape: RoundCone::ball(calf, 0.033 * g + low), cloth: shank },
        Solid { shape: RoundCone::new(heel, ball, heel_r, ball_r), cloth: clothes.shoes },
        Solid { shape: RoundCone::new(ball, toe, ball_r, toe_r), cloth: clothes.shoes },
    ]
}
