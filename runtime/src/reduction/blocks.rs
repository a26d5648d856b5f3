//! Matrices of the independent speeds in blocks: what belongs to a branch is an array of a fixed length, of whose steps the compiler
//! makes vector instructions.

use super::Reduction;
use crate::{Error, Scalar};

/// Numbers of a block where few speeds are independent.
pub(super) const NARROW: usize = 8;

/// Numbers of other blocks: the more, the less waits for what a step reads.
pub(super) const WIDE: usize = 16;

/// Bytes of a line of the cache: blocks that begin with one are read and written faster.
pub(super) const LINE: usize = 64;

/// Numbers to the next line at most.
pub(super) const MOST_TO_LINE: usize = LINE / size_of::<f32>() - 1;

/// Numbers of a block of `d` independent speeds, and p.
pub(super) const fn width(d: usize) -> usize {
    if d < NARROW { NARROW } else { WIDE }
}

/// `d`, one for p, and what is missing in the last block.
pub(super) const fn padded(d: usize) -> usize {
    (d + 1).next_multiple_of(width(d))
}

/// Numbers of neighbouring independent speeds.
pub(super) type Block<S, const W: usize> = [S; W];

/// The blocks of a matrix by block and branch.
pub(super) fn blocks<S, const W: usize>(
    matrix: &[S],
    branches: usize,
) -> impl Iterator<Item = &[Block<S, W>]> {
    matrix.as_chunks().0.chunks_exact(branches.max(1))
}

/// As [`blocks`], to write to.
pub(super) fn blocks_mut<S, const W: usize>(
    matrix: &mut [S],
    branches: usize,
) -> impl Iterator<Item = &mut [Block<S, W>]> {
    matrix.as_chunks_mut().0.chunks_exact_mut(branches.max(1))
}

/// What belongs to a branch.
#[inline(always)]
pub(super) fn at<T>(of_branches: &[T], branch: u16) -> Result<&T, Error> {
    let (branch, given) = (usize::from(branch), of_branches.len());
    of_branches.get(branch).ok_or(Error::Length { expected: branch + 1, given })
}

/// As [`at`], to write to.
#[inline(always)]
pub(super) fn at_mut<T>(of_branches: &mut [T], branch: u16) -> Result<&mut T, Error> {
    let (branch, given) = (usize::from(branch), of_branches.len());
    of_branches.get_mut(branch).ok_or(Error::Length { expected: branch + 1, given })
}

/// `sum + factor x`.
#[inline(always)]
pub(super) fn sum_of<S: Scalar, const W: usize>(
    factor: S,
    x: &Block<S, W>,
    sum: &Block<S, W>,
) -> Block<S, W> {
    let mut sum = *sum;
    for (sum, &x) in sum.iter_mut().zip(x) {
        *sum = factor.mul_add(x, *sum);
    }
    sum
}

/// The magnitude of the largest entry of each column.
pub(super) fn largest_entries<S: Scalar, const W: usize>(rows: &[Block<S, W>]) -> Block<S, W> {
    let mut largest = [S::ZERO; W];
    for row in rows {
        largest = core::array::from_fn(|lane| largest[lane].max(row[lane].abs()));
    }
    largest
}

/// The sum of the numbers of a block.
pub(super) fn total<S: Scalar>(block: &[S]) -> S {
    let mut sums = [S::ZERO; NARROW];
    for part in block.as_chunks::<NARROW>().0 {
        sums = core::array::from_fn(|lane| sums[lane] + part[lane]);
    }
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (b + f)) + ((c + g) + (d + h))
}

/// A (d x d) becomes A + A^T on and below the diagonal.
pub(super) fn mirror<S: Scalar>(a: &mut [S], d: usize) -> Result<(), Error> {
    let (expected, given) = (d * d, a.len());
    for i in 0..d {
        let split = a.split_at_mut_checked(i * d);
        let (above, rest) = split.ok_or(Error::Length { expected, given })?;
        let (own, diagonal) =
            rest.split_at_mut_checked(i).ok_or(Error::Length { expected, given })?;
        for (row, entry) in above.chunks_exact(d).zip(own) {
            if let Some(&mirrored) = row.get(i) {
                *entry += mirrored;
            }
        }
        if let Some(entry) = diagonal.first_mut() {
            *entry += *entry;
        }
    }
    Ok(())
}

/// Rows of a tile of [`products`]: its sums stay in the registers of a processor.
const TILE: usize = 4;

/// N^T B, for N of d columns and B by branch, and the same of what follows the last column of N.
// In a crate that is one unit of compilation, LLVM would inline it and then take its vectors apart.
#[inline(never)]
pub(super) fn products<S: Scalar, const W: usize>(
    reduction: &Reduction<'_, S>,
    d: usize,
    n: &[Block<S, W>],
    b: &[Block<S, W>],
) -> Result<[Block<S, W>; W], Error> {
    let mut products = [[S::ZERO; W]; W];
    for (sums, &branch) in products.iter_mut().zip(reduction.independent) {
        *sums = *at(b, branch)?;
    }
    let tiles = products.as_chunks_mut::<TILE>().0.iter_mut().take((d + 1).div_ceil(TILE));
    for (tile, sums) in tiles.enumerate() {
        let mut found = *sums;
        for &branch in reduction.steps.as_flattened() {
            if let Some((n, b)) = n.get(usize::from(branch)).zip(b.get(usize::from(branch))) {
                for (sum, &factor) in found.iter_mut().zip(n.iter().skip(TILE * tile)) {
                    *sum = sum_of(factor, b, sum);
                }
            }
        }
        *sums = found;
    }
    Ok(products)
}

/// N^T x, for x by branch.
pub(super) fn reduce<S: Scalar, const W: usize>(null_space: &[S], x: &[S], out: &mut [S]) {
    for (out, rows) in out.chunks_mut(W).zip(blocks::<S, W>(null_space, x.len())) {
        let sum = x.iter().zip(rows).fold([S::ZERO; W], |sum, (&x, row)| sum_of(x, row, &sum));
        for (out, sum) in out.iter_mut().zip(sum) {
            *out = sum;
        }
    }
}
