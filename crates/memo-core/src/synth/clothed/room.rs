//! The room: a wall of blocks behind the walk, a floor of tiles, and its illumination.

use crate::image::Image;
use crate::model::Camera;
use crate::synth::Random;
use glam::{DVec2, DVec3};

/// A room without people.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Room {
    /// Distance of the wall behind the origin, metres.
    wall_m: f64,
    /// Grey levels of wall and floor.
    pub(super) wall: f64,
    floor: f64,
    /// Width and height of the blocks and side of the tiles, metres.
    block_m: DVec2,
    tile_m: f64,
    /// How much darker the joints are, and the strength of the stains, grey levels.
    joint: f64,
    stain: f64,
    /// Change of light from left to right, grey levels per metre.
    slope: f64,
    /// Direction towards the light.
    pub(super) light: DVec3,
    /// Largest fraction of the light that a contact shadow removes.
    shadow: f64,
    seed: u64,
}

impl Room {
    pub(super) fn drawn(random: &mut Random) -> Self {
        let wall = random.uniform(90.0, 190.0);
        let light = DVec3::new(random.uniform(-0.5, 0.5), -0.6, random.uniform(0.5, 1.0));
        Self {
            wall_m: random.uniform(1.5, 3.0),
            wall,
            floor: wall + random.uniform(-60.0, 30.0),
            block_m: DVec2::new(random.uniform(0.35, 0.6), random.uniform(0.18, 0.3)),
            tile_m: random.uniform(0.4, 0.8),
            joint: random.uniform(5.0, 22.0),
            stain: random.uniform(4.0, 12.0),
            slope: random.uniform(-6.0, 6.0),
            light: light.normalize(),
            shadow: random.uniform(0.25, 0.6),
            seed: (random.uniform(0.0, 1.0) * 1e9) as u64,
        }
    }

    /// The empty room, 2x2 samples per pixel.
    pub(super) fn seen_by(&self, camera: &Camera) -> Image<f32> {
        let [width, height] = camera.size.map(|side| side as usize);
        let mut image = Image::filled(width, height, 0.0f32);
        for y in 0..height {
            for x in 0..width {
                let sample = |(i, j): (f64, f64)| {
                    self.level(camera, DVec2::new(x as f64 + i - 0.25, y as f64 + j - 0.25))
                };
                let sum: f64 = [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)].map(sample).iter().sum();
                image.set(x, y, (0.25 * sum) as f32);
            }
        }
        image
    }

    fn level(&self, camera: &Camera, pixel: DVec2) -> f64 {
        let (eye, ray) = (camera.position(), camera.ray_in_world(pixel));
        let to_wall = (self.wall_m - eye.y) / ray.y;
        let to_floor = -eye.z / ray.z;
        if to_floor > 0.0 && to_floor < to_wall {
            let at = (eye + to_floor * ray).truncate();
            let joints = near_line(at.x, self.tile_m, 0.012) + near_line(at.y, self.tile_m, 0.012);
            return self.floor + self.slope * at.x - self.joint * joints + self.stains(at, 1);
        }
        let hit = eye + to_wall * ray;
        let at = DVec2::new(hit.x, hit.z);
        let row = (at.y / self.block_m.y).floor();
        let shifted = at.x + 0.5 * self.block_m.x * row.rem_euclid(2.0);
        let joints = near_line(shifted, self.block_m.x, 0.014) + near_line(at.y, self.block_m.y, 0.014);
        let skirting = if at.y < 0.09 { -25.0 } else { 0.0 };
        self.wall + self.slope * at.x - self.joint * joints + self.stains(at, 2) + skirting
    }

    /// Smooth noise of three octaves.
    fn stains(&self, at: DVec2, layer: u64) -> f64 {
        let octave = |k: u64| {
            let x = at * f64::from(1u32 << k) * 1.7;
            let (low, t) = (x.floor(), x - x.floor());
            let t = t * t * (DVec2::splat(3.0) - 2.0 * t);
            let corner = |i: f64, j: f64| self.lot(low.x + i, low.y + j, layer * 8 + k);
            let below = corner(0.0, 0.0) * (1.0 - t.x) + corner(1.0, 0.0) * t.x;
            let above = corner(0.0, 1.0) * (1.0 - t.x) + corner(1.0, 1.0) * t.x;
            (below * (1.0 - t.y) + above * t.y) / f64::from(1u32 << k)
        };
        self.stain * (octave(0) + octave(1) + octave(2))
    }

    /// The random value of a lattice point, -1 to 1.
    fn lot(&self, x: f64, y: f64, layer: u64) -> f64 {
        // The finalizer of SplitMix64 (Steele, Lea and Flood 2014): a separate generator for each point would
        // be slow.
        let mut z = (x as i64 as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (y as i64 as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ (self.seed ^ layer).wrapping_mul(0x1656_67B1_9E37_79F9);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        z as f64 / u64::MAX as f64 * 2.0 - 1.0
    }

    /// Fraction of the light that nearby bodies leave at a point of the floor: 1 far from all of them.
    pub(super) fn lit(&self, floor: DVec2, bodies: &[(DVec3, f64)]) -> f64 {
        let taken: f64 = bodies
            .iter()
            .map(|(centre, radius)| {
                let reach = 1.6 * radius + 0.5 * centre.z;
                let falls_off = (-(floor - centre.truncate()).length_squared() / (2.0 * reach * reach)).exp();
                falls_off * (-centre.z / 0.25).exp()
            })
            .sum();
        1.0 - self.shadow * taken.min(1.0)
    }
}

/// 1 on the lines at multiples of a spacing, 0 farther than half a width from them.
fn near_line(x: f64, spacing: f64, width: f64) -> f64 {
    let off = (x / spacing - (x / spacing).round()).abs() * spacing;
    (1.0 - off / (0.5 * width)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_at_multiples_of_their_spacing_and_as_wide_as_asked() {
        for (x, expected) in
            [(0.0, 1.0), (0.6, 1.0), (-1.2, 1.0), (0.605, 0.5), (0.595, 0.5), (0.61, 0.0), (0.3, 0.0)]
        {
            assert!((near_line(x, 0.6, 0.02) - expected).abs() < 1e-9, "{x}");
        }
    }
}
