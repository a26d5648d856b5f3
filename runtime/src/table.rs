//! Functions of long mechanisms as tables: a loop over the rows of a table computes the same as straight-line
//! code that would outgrow the caches of the processor, in a hundredth of its text.
//!
//! Nearly all of a table are sums of one to four products, cells\[d\] = cells\[c\] + cells\[a\] cells\[b\] + ...: what is only
//! added multiplies by 1, what is subtracted by -1, a product alone is added to -0, so that the loops never branch and every result has the
//! bits of the operations themselves. Sums of equal length follow each other. What is left, such as quotients, has runs of its
//! own.
//!
//! The compiler writes the tables of a module as one text. The macro [`tables`](crate::tables) reads it while the module is
//! compiled, so that a program holds words of four bytes.
//!
//! ```text
//! words = run*
//! run   = a word (kind + 2^8 number of words that follow), then these
//! ```

use crate::Arithmetic;
use lamc_tables::kind::{self, FIELD};

/// Angles whose sines are computed together.
const ANGLES: usize = 8;

/// A function of a mechanism as a table. `CELLS` is a power of two, not less than the cells it needs.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a, const CELLS: usize> {
    words: &'a [[u8; 4]],
}

impl<'a, const CELLS: usize> Table<'a, CELLS> {
    /// The table of words, each as bytes, the least significant first. Bytes beyond the last whole word are ignored.
    #[must_use]
    pub const fn new(words: &'a [u8]) -> Self {
        Self { words: words.as_chunks().0 }
    }

    /// Evaluates the function: entries of the outputs that no word writes are zero.
    pub fn evaluate<S: Arithmetic>(
        &self,
        numbers: &[f64],
        arguments: &[&[S]],
        outputs: &mut [&mut [S]],
    ) {
        const { assert!(CELLS.is_power_of_two() && CELLS > 1) };
        let cells = &mut Cells([S::ZERO; CELLS]);
        outputs.iter_mut().for_each(|output| output.fill(S::ZERO));
        let mut left = self.words;
        while let [header, rest @ ..] = left {
            let header = u32::from_le_bytes(*header);
            let (kind, count) = ((header & 0xff) as usize, (header >> 8) as usize);
            let (run, rest) = rest.split_at(count);
            match kind {
                kind::PRODUCTS => cells.products::<1>(run),
                TWO_PRODUCTS => cells.products::<2>(run),
                THREE_PRODUCTS => cells.products::<3>(run),
                FOUR_PRODUCTS => cells.products::<4>(run),
                kind::NUMBER => {
                    for [number, d] in run.iter().map(fields) {
                        cells.put(d, S::from_f64(numbers[number]));
                    }
                }
                kind::ARGUMENT => cells.map(run, |_, a, b| arguments[a][b]),
                kind::SINE_COSINE => cells.sines(run),
                kind::DIV => cells.of_two(run, |x, y| x / y),
                kind::MIN => cells.of_two(run, S::min),
                kind::MAX => cells.of_two(run, S::max),
                kind::POW => cells.of_two(run, S::pow),
                kind::ATAN2 => cells.of_two(run, S::atan2),
                kind::SQRT => cells.of_two(run, |x, _| x.sqrt()),
                kind::TAN => cells.of_two(run, |x, _| x.tan()),
                kind::EXP => cells.of_two(run, |x, _| x.exp()),
                kind::ABS => cells.of_two(run, |x, _| x.abs()),
                kind::TANH => cells.of_two(run, |x, _| x.tanh()),
                kind::LN => cells.of_two(run, |x, _| x.ln()),
                kind::STEP => cells.of_two(run, |x, _| x.step()),
                _ => {
                    let output = &mut outputs[kind - kind::OUTPUT];
                    for [value, index] in pairs(run) {
                        output[u32::from_le_bytes(*index) as usize] = cells.get(fields(value)[0]);
                    }
                }
            }
            left = rest;
        }
    }
}

const TWO_PRODUCTS: usize = kind::PRODUCTS + 1;
const THREE_PRODUCTS: usize = kind::PRODUCTS + 2;
const FOUR_PRODUCTS: usize = kind::PRODUCTS + 3;

/// The fields of a word that is not of a sum of products.
fn fields(word: &[u8; 4]) -> [usize; 2] {
    let word = u32::from_le_bytes(*word);
    [(word & ((1 << FIELD) - 1)) as usize, (word >> FIELD) as usize]
}

fn pairs(run: &[[u8; 4]]) -> impl Iterator<Item = &[[u8; 4]; 2]> {
    run.as_chunks().0.iter()
}

/// Values of a function in the making. Masks instead of checks keep the loops short.
struct Cells<S, const CELLS: usize>([S; CELLS]);

impl<S: Arithmetic, const CELLS: usize> Cells<S, CELLS> {
    const MASK: usize = CELLS - 1;

    fn get(&self, field: usize) -> S {
        self.0[field & Self::MASK]
    }

    fn put(&mut self, field: usize, value: S) {
        self.0[field & Self::MASK] = value;
    }

    /// Sums of N products.
    #[inline]
    fn products<const N: usize>(&mut self, run: &[[u8; 4]]) {
        let fields = |word: &[u8; 4]| {
            let word = u32::from_le_bytes(*word);
            // No bits are above the second field, so that it is below CELLS.
            [word as usize & Self::MASK, (word >> kind::shift(CELLS)) as usize]
        };
        for sum in run.chunks_exact(N + 1) {
            let [c, d] = fields(&sum[0]);
            let mut value = self.0[c];
            for word in &sum[1..] {
                let [a, b] = fields(word);
                value = self.0[a].mul_add(self.0[b], value);
            }
            self.0[d] = value;
        }
    }

    /// Results of two fields.
    fn map(&mut self, run: &[[u8; 4]], f: impl Fn(&Self, usize, usize) -> S) {
        for [word, place] in pairs(run) {
            let [a, b] = fields(word);
            let value = f(self, a, b);
            self.put(fields(place)[0], value);
        }
    }

    /// Results of two cells.
    fn of_two(&mut self, run: &[[u8; 4]], f: impl Fn(S, S) -> S) {
        self.map(run, |cells, a, b| f(cells.get(a), cells.get(b)));
    }

    fn sines(&mut self, run: &[[u8; 4]]) {
        for run in run.chunks(2 * ANGLES) {
            let angle =
                |k: usize| pairs(run).nth(k).map_or(S::ZERO, |[at, _]| self.get(fields(at)[0]));
            let found = S::sin_cos_all::<ANGLES>(core::array::from_fn(angle));
            for ([first, second], (sine, cosine)) in pairs(run).zip(found) {
                self.put(fields(first)[1], sine);
                self.put(fields(second)[0], cosine);
            }
        }
    }
}
