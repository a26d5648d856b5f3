//! Which values a run has. They depend on the plan and the number of the run only, so that any process can compute any
//! run.
//!
//! Each quantity has its own key of ChaCha, from the seed and its name: other quantities do not change its samples.
//! Sobol's sequence has the direction numbers of Joe and Kuo (SIAM J. Sci. Comput. 30, 2635, 2008), in the order of
//! Gray's code, and a digital shift, which keeps its even distribution.

use rand_chacha::ChaCha12Rng;
use rand_chacha::rand_core::{RngCore as _, SeedableRng as _};
use sha2::{Digest as _, Sha256};
use sobol::Sobol;
use sobol::params::JoeKuoD6;
use statrs::function::erf::erfc_inv;

use super::plan::{Axis, Distribution, Plan, Sampler};

/// Binary digits of a number between 0 and 1.
const DIGITS: u32 = 52;
/// Quantities for which Sobol's sequence is defined here.
pub const MOST_SOBOL: usize = 1000;

/// Words of 32 bits that a number takes from the generator.
const WORDS: u128 = 2;
/// The streams of a generator: for numbers, for the order of a Latin hypercube, for the shift of Sobol's sequence.
const NUMBERS: u64 = 0;
const ORDER: u64 = 1;
const SHIFT: u64 = 2;

/// The values of all runs.
pub struct Design {
    axes: Vec<Axis>,
    drawn: Vec<Drawn>,
    samples: u64,
}

/// A quantity that is drawn.
struct Drawn {
    distribution: Distribution,
    generator: ChaCha12Rng,
    order: Order,
}

/// How the samples of a quantity are placed between 0 and 1.
enum Order {
    /// Anywhere.
    Random,
    /// Each in the part of this number.
    Parts(Vec<u32>),
    /// By the direction numbers of a dimension, shifted.
    Sobol { directions: Vec<u64>, shift: u64 },
}

impl Design {
    /// Prepares the values of a plan.
    pub fn new(plan: &Plan) -> Self {
        let directions = match plan.sampler {
            Sampler::Sobol => {
                Sobol::<u64>::init_direction_vals(plan.varied.len(), 64, &JoeKuoD6::standard())
            }
            Sampler::Random | Sampler::LatinHypercube => Vec::new(),
        };
        let mut directions = directions.into_iter();
        let drawn = plan.varied.iter().map(|varied| {
            let generator = generator(plan.seed, &varied.quantity.name);
            let order = match directions.next() {
                Some(directions) => {
                    Order::Sobol { directions, shift: stream(&generator, SHIFT).next_u64() }
                }
                None if plan.sampler == Sampler::LatinHypercube => {
                    Order::Parts(shuffled(plan.samples, &mut stream(&generator, ORDER)))
                }
                None => Order::Random,
            };
            Drawn { distribution: varied.distribution, generator, order }
        });
        Self { axes: plan.axes.clone(), drawn: drawn.collect(), samples: plan.samples }
    }

    /// The values of a run, SI: those of the axes, then those that are drawn.
    pub fn values(&self, run: u64) -> Vec<f64> {
        let (mut point, sample) = (run / self.samples, run % self.samples);
        let mut values: Vec<f64> = Vec::with_capacity(self.axes.len() + self.drawn.len());
        for axis in self.axes.iter().rev() {
            let count = axis.values.len() as u64;
            values.push(axis.values[(point % count) as usize]);
            point /= count;
        }
        values.reverse();
        values.extend(self.drawn.iter().map(|drawn| drawn.value(sample, self.samples)));
        values
    }
}

impl Drawn {
    fn value(&self, sample: u64, samples: u64) -> f64 {
        let number = || {
            let mut generator = stream(&self.generator, NUMBERS);
            generator.set_word_pos(WORDS * u128::from(sample));
            generator.next_u64()
        };
        let share = match &self.order {
            Order::Random => between_0_and_1(number()),
            Order::Parts(parts) => {
                let part = f64::from(parts[sample as usize]);
                (part + between_0_and_1(number())) / samples as f64
            }
            Order::Sobol { directions, shift } => {
                between_0_and_1(shift ^ sobol_point(directions, sample))
            }
        };
        self.distribution.at(share)
    }
}

impl Distribution {
    /// The value with this share of all values below it: the inverse of the cumulative distribution.
    pub fn at(self, share: f64) -> f64 {
        match self {
            Self::Uniform([low, high]) => low + share * (high - low),
            Self::LogUniform([low, high]) => low * libm::exp(share * libm::log(high / low)),
            Self::Normal([mean, deviation]) => {
                mean - deviation * std::f64::consts::SQRT_2 * erfc_inv(2.0 * share)
            }
        }
    }
}

/// A point of one dimension of Sobol's sequence, as a fraction of 2^64.
fn sobol_point(directions: &[u64], index: u64) -> u64 {
    let gray = index ^ (index >> 1);
    let digits = directions.iter().enumerate().filter(|(digit, _)| gray >> digit & 1 == 1);
    digits.fold(0, |point, (_, direction)| point ^ direction)
}

/// The middle of one of 2^52 parts, which a double holds exactly: neither 0 nor 1 occurs.
fn between_0_and_1(bits: u64) -> f64 {
    ((bits >> (u64::BITS - DIGITS)) as f64 + 0.5) / (1_u64 << DIGITS) as f64
}

/// The generator of a quantity.
fn generator(seed: u64, name: &str) -> ChaCha12Rng {
    let digest = Sha256::new().chain_update(seed.to_le_bytes()).chain_update(name).finalize();
    ChaCha12Rng::from_seed(digest.into())
}

/// One of its independent streams, from the beginning.
fn stream(generator: &ChaCha12Rng, stream: u64) -> ChaCha12Rng {
    let mut generator = generator.clone();
    generator.set_stream(stream);
    generator.set_word_pos(0);
    generator
}

/// The numbers below `count` in a random order (Fisher and Yates).
fn shuffled(count: u64, generator: &mut ChaCha12Rng) -> Vec<u32> {
    let mut numbers: Vec<u32> = (0..count as u32).collect();
    for last in (1..numbers.len()).rev() {
        // The remainder prefers small numbers by less than 2^-32.
        let other = (generator.next_u64() % (last as u64 + 1)) as usize;
        numbers.swap(last, other);
    }
    numbers
}
