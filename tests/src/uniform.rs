//! Random numbers for tests: the same every time, on every machine. The one generator of all tests; crates
//! below this one include the file by its path.

use std::f64::consts::TAU;

/// Uniform numbers (xorshift64*; Vigna, An experimental exploration of Marsaglia's xorshift
/// generators, 2016).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A sequence of its own for every seed.
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        (0..8).for_each(|_| _ = random.bits());
        random
    }

    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// In `low .. high`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1_u64 << 53) as f64)
    }

    /// In `0 .. count`.
    pub fn below(&mut self, count: usize) -> usize {
        ((self.bits() >> 32) as usize * count) >> 32
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.range(0.0, 1.0) < probability
    }

    /// Normally distributed with mean 0 and standard deviation 1 (G. E. P. Box and M. E. Muller, 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.range(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
        radius * (TAU * self.range(0.0, 1.0)).cos()
    }

    /// Normally distributed numbers with mean 0 and standard deviation `sigma`.
    pub fn normals(&mut self, count: usize, sigma: f64) -> Vec<f64> {
        (0..count).map(|_| sigma * self.normal()).collect()
    }
}
