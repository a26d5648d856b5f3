//! Functions of long mechanisms as loops over records: what the kernels of a generated module are made of.
//!
//! The values that kernels hand to each other are in [`Cells`]. A record of a kernel says where its values are: each is at some
//! distance from a column of the record.

use crate::Arithmetic;

/// Angles whose sines are computed together.
const ANGLES: usize = 8;

/// The number of a cell: `u16`, or `u32` where there are more.
pub trait Place: Copy {
    /// The number.
    fn index(self) -> usize;
}

impl Place for u16 {
    #[inline]
    fn index(self) -> usize {
        usize::from(self)
    }
}

impl Place for u32 {
    #[inline]
    fn index(self) -> usize {
        self as usize
    }
}

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
    /// The value of a cell.
    #[inline]
    pub fn get(&self, cell: usize) -> S {
        let [value] = self.window(cell);
        value
    }

    /// The values of several cells that follow one another. There is one check for all of them.
    #[inline]
    pub fn window<const K: usize>(&self, first: usize) -> [S; K] {
        window(&self.0, first).copied().unwrap_or([S::ZERO; K])
    }

    /// Puts a value into a cell.
    #[inline]
    pub fn put(&mut self, cell: usize, value: S) {
        if let Some(cell) = self.0.get_mut(cell) {
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
    pub fn give(&self, output: &mut [S], entries: &[[impl Place; 2]]) {
        output.fill(S::ZERO);
        for &[index, cell] in entries {
            if let Some(entry) = output.get_mut(index.index()) {
                *entry = self.get(cell.index());
            }
        }
    }

    /// Puts sine and cosine of angles: `angle` and `sine` are a column and a distance each, the cosine follows the sine.
    #[inline]
    pub fn sines<P: Place, const C: usize>(
        &mut self,
        records: &[[P; C]],
        angle: [usize; 2],
        sine: [usize; 2],
    ) {
        for records in records.chunks(ANGLES) {
            let of = |k: usize| {
                records.get(k).map_or(S::ZERO, |record| self.get(record[angle[0]].index() + angle[1]))
            };
            let found = S::sin_cos_all::<ANGLES>(core::array::from_fn(of));
            for (record, (of_sine, of_cosine)) in records.iter().zip(found) {
                let cell = record[sine[0]].index() + sine[1];
                self.put(cell, of_sine);
                self.put(cell + 1, of_cosine);
            }
        }
    }
}

/// Several entries of a list that follow one another, if it has so many.
#[inline]
pub fn window<T, const K: usize>(list: &[T], first: usize) -> Option<&[T; K]> {
    list.get(first..)?.first_chunk()
}

/// The records of a run.
#[inline]
pub fn run<T, P: Place>(records: &[T], first: P, count: P) -> &[T] {
    let first = first.index();
    records.get(first..first + count.index()).unwrap_or_default()
}
