//! Functions of long mechanisms as tables: a loop over the rows of a table computes the same as straight-line
//! code that would outgrow the caches of the processor, in a hundredth of its text.
//!
//! Nearly every row is a product and a sum, cells\[d\] = cells\[a\] cells\[b\] + cells\[c\]: a sum multiplies by 1, a
//! difference by -1, a product adds -0, so that the loop never branches and every result has the bits of the
//! operation itself. What is left, such as quotients, has runs of rows of its own.
//!
//! The compiler writes the tables of a module as one text. The macro [`tables`](crate::tables) reads it while the module is
//! compiled, so that a program holds words of eight bytes.
//!
//! ```text
//! words = run*
//! run   = a word (kind + 2^8 number of words that follow), then these
//! ```

use crate::Arithmetic;
use lamc_tables::kind::{self, FIELD as CELL};

/// Angles whose sines are computed together.
const ANGLES: usize = 8;

/// A function of a mechanism as a table.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    words: &'a [[u8; 8]],
}

impl<'a> Table<'a> {
    /// The table of words, each as bytes, the least significant first. Bytes beyond the last whole word are ignored.
    #[must_use]
    pub const fn new(words: &'a [u8]) -> Self {
        Self { words: words.as_chunks().0 }
    }

    /// Evaluates the function: entries of the outputs that no row writes are zero. `CELLS` is a power of two, not
    /// less than the table's cells.
    pub fn evaluate<S: Arithmetic, const CELLS: usize>(
        &self,
        numbers: &[f64],
        arguments: &[&[S]],
        outputs: &mut [&mut [S]],
    ) {
        const { assert!(CELLS.is_power_of_two()) };
        let cells = &mut Cells([S::ZERO; CELLS]);
        outputs.iter_mut().for_each(|output| output.fill(S::ZERO));
        let mut left = self.words;
        while let [header, rest @ ..] = left {
            let header = u64::from_le_bytes(*header);
            let (kind, count) = ((header & 0xff) as usize, (header >> 8) as usize);
            let (rows, rest) = rest.split_at(count);
            match kind {
                kind::NUMBER => cells.set(rows, |a, _| S::from_f64(numbers[a])),
                kind::ARGUMENT => cells.set(rows, |a, b| arguments[a][b]),
                kind::SINE_COSINE => cells.sines(rows),
                kind::MUL_ADD => cells.products(rows),
                kind::DIV => cells.map(rows, |x, y| x / y),
                kind::MIN => cells.map(rows, S::min),
                kind::MAX => cells.map(rows, S::max),
                kind::POW => cells.map(rows, S::pow),
                kind::ATAN2 => cells.map(rows, S::atan2),
                kind::SQRT => cells.map(rows, |x, _| x.sqrt()),
                kind::TAN => cells.map(rows, |x, _| x.tan()),
                kind::EXP => cells.map(rows, |x, _| x.exp()),
                kind::ABS => cells.map(rows, |x, _| x.abs()),
                kind::TANH => cells.map(rows, |x, _| x.tanh()),
                kind::LN => cells.map(rows, |x, _| x.ln()),
                kind::STEP => cells.map(rows, |x, _| x.step()),
                _ => {
                    let output = &mut outputs[kind - kind::OUTPUT];
                    for row in words(rows) {
                        output[(row >> CELL) as usize] = cells.get(row);
                    }
                }
            }
            left = rest;
        }
    }
}

fn words(rows: &[[u8; 8]]) -> impl Iterator<Item = u64> {
    rows.iter().map(|&row| u64::from_le_bytes(row))
}

/// Values of a function in the making. Masks instead of checks keep the loops short.
struct Cells<S, const CELLS: usize>([S; CELLS]);

impl<S: Arithmetic, const CELLS: usize> Cells<S, CELLS> {
    const MASK: usize = CELLS - 1;

    fn get(&self, field: u64) -> S {
        self.0[field as usize & Self::MASK]
    }

    fn put(&mut self, row: u64, value: S) {
        self.0[(row >> (3 * CELL)) as usize & Self::MASK] = value;
    }

    fn products(&mut self, rows: &[[u8; 8]]) {
        for row in words(rows) {
            let [a, b, c] = [row, row >> CELL, row >> (2 * CELL)].map(|field| self.get(field));
            self.put(row, a.mul_add(b, c));
        }
    }

    fn map(&mut self, rows: &[[u8; 8]], f: impl Fn(S, S) -> S) {
        for row in words(rows) {
            self.put(row, f(self.get(row), self.get(row >> CELL)));
        }
    }

    /// Fields that are no cells.
    fn set(&mut self, rows: &[[u8; 8]], f: impl Fn(usize, usize) -> S) {
        const FIELD: u64 = (1 << CELL) - 1;
        for row in words(rows) {
            self.put(row, f((row & FIELD) as usize, (row >> CELL & FIELD) as usize));
        }
    }

    fn sines(&mut self, rows: &[[u8; 8]]) {
        for rows in rows.chunks(2 * ANGLES) {
            let angle = |k: usize| words(rows).nth(2 * k).map_or(S::ZERO, |row| self.get(row));
            let found = S::sin_cos_all::<ANGLES>(core::array::from_fn(angle));
            for (pair, (sine, cosine)) in rows.chunks_exact(2).zip(found) {
                self.put(u64::from_le_bytes(pair[0]), sine);
                self.put(u64::from_le_bytes(pair[1]), cosine);
            }
        }
    }
}
