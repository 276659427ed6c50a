//! Reproducible random numbers: the same seed gives the same numbers on every machine.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Random(Xoshiro256PlusPlus);

impl Random {
    /// The stream of random numbers for a seed.
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + unit * (high - low)
    }

    /// Two independent standard normal numbers (Box and Muller).
    pub fn normal_pair(&mut self) -> [f32; 2] {
        let bits = self.0.next_u64();
        let unit = |bits: u32| (bits >> 8) as f32 / (1u32 << 24) as f32;
        let radius = (-2.0 * (1.0 - unit(bits as u32)).ln()).sqrt();
        let (sine, cosine) = (std::f32::consts::TAU * unit((bits >> 32) as u32)).sin_cos();
        [radius * cosine, radius * sine]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_have_the_moments_of_normals_and_seeds_repeat() {
        let mut random = Random::new(7);
        let draws: Vec<f64> = (0..50_000).flat_map(|_| random.normal_pair()).map(f64::from).collect();
        let moment = |k: i32| draws.iter().map(|x| x.powi(k)).sum::<f64>() / draws.len() as f64;
        assert!(moment(1).abs() < 0.01 && (moment(2) - 1.0).abs() < 0.02 && (moment(4) - 3.0).abs() < 0.15);
        assert_eq!(Random::new(7).normal_pair(), Random::new(7).normal_pair());
        assert_ne!(Random::new(7).normal_pair(), Random::new(8).normal_pair());
    }
}
