//! Functions of long mechanisms as loops over records: what the kernels of a generated module are made of.
//!
//! The values that kernels hand to each other are in [`Cells`]. A record of a kernel says where its values are: each is at some
//! distance from a column of the record, which is the number of a cell.

use crate::Arithmetic;

/// Angles whose sines are computed together.
const ANGLES: usize = 8;

/// Digits of a number in the text of records.
const DIGITS: usize = 3;

/// Values of a function in the making.
#[derive(Debug)]
pub struct Cells<S, const N: usize>([S; N]);

impl<S: Arithmetic, const N: usize> Default for Cells<S, N> {
    #[inline]
    fn default() -> Self {
        Self([S::ZERO; N])
    }
}

impl<S: Arithmetic, const N: usize> Cells<S, N> {
    /// The values of the first K cells from a column on. There is one check for all of them.
    #[inline]
    pub fn get<const K: usize>(&self, column: u16) -> [S; K] {
        entries(&self.0, column).copied().unwrap_or([S::ZERO; K])
    }

    /// Puts a value at a distance from a column.
    #[inline]
    pub fn put(&mut self, column: u16, distance: usize, value: S) {
        if let Some(cell) = self.0.get_mut(usize::from(column) + distance) {
            *cell = value;
        }
    }

    /// Takes an argument into the cells from `first` on.
    #[inline]
    pub fn take(&mut self, first: usize, argument: &[S]) {
        for (cell, &value) in self.0.iter_mut().skip(first).zip(argument) {
            *cell = value;
        }
    }

    /// Writes the entries of an output that are not zero: each is an index and a cell.
    #[inline]
    pub fn give(&self, output: &mut [S], entries: &[[u16; 2]]) {
        output.fill(S::ZERO);
        for &[index, cell] in entries {
            if let Some(entry) = output.get_mut(usize::from(index)) {
                [*entry] = self.get(cell);
            }
        }
    }

    /// Puts sine and cosine of angles: each record has the cells of an angle and of its sine, which the cosine follows.
    #[inline]
    pub fn sines(&mut self, records: &[[u16; 2]]) {
        for records in records.chunks(ANGLES) {
            let of = |k: usize| records.get(k).map_or([S::ZERO], |&[angle, _]| self.get(angle))[0];
            let found = S::sin_cos_all::<ANGLES>(core::array::from_fn(of));
            for (&[_, place], (sine, cosine)) in records.iter().zip(found) {
                self.put(place, 0, sine);
                self.put(place, 1, cosine);
            }
        }
    }
}

/// Entries of a list from a place on, if it has so many.
#[inline]
pub fn entries<T, const K: usize>(list: &[T], first: u16) -> Option<&[T; K]> {
    list.get(usize::from(first)..)?.first_chunk()
}

/// The records of a run.
#[inline]
pub fn run<T>(records: &[T], first: u16, count: u16) -> &[T] {
    let first = usize::from(first);
    records.get(first..first + usize::from(count)).unwrap_or_default()
}

/// Reads records from their text.
#[must_use]
pub const fn records<const C: usize, const N: usize>(text: &str) -> [[u16; C]; N] {
    let mut records = [[0; C]; N];
    let mut place = 0;
    while place < C * N {
        records[place / C][place % C] = number(text, place) as u16;
        place += 1;
    }
    records
}

/// Reads numbers of a list from the text of their places.
#[must_use]
pub const fn numbers<const N: usize>(list: &[f64], text: &str) -> [f64; N] {
    let mut numbers = [0.0; N];
    let mut place = 0;
    while place < N {
        numbers[place] = list[number(text, place)];
        place += 1;
    }
    numbers
}

/// A number of a text: digits of base 92, the last one first, are printable characters of ASCII without blank, `"` and `\`.
const fn number(text: &str, place: usize) -> usize {
    let text = text.as_bytes();
    let (mut value, mut digit) = (0, DIGITS);
    while digit > 0 {
        digit -= 1;
        let byte = text[DIGITS * place + digit];
        let skipped = (byte > b'"') as usize + (byte > b'\\') as usize;
        value = 92 * value + (byte - b'!') as usize - skipped;
    }
    value
}
