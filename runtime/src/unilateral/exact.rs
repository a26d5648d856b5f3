//! Products of y with rows, made exact one after the other, and the impulses that this takes.
//!
//! An impulse P changes y along b P, and what it is to change is a y; both rows are the same unless a point slides, where
//! b is the direction of normal force and friction together. With A B^T = L D U, without square roots,
//!
//! ```text
//! a'_k = a_k - sum_j<k (a_k b'_j) / d_j a'_j        b'_k = b_k - sum_j<k c_kj b'_j,  c_kj = (a'_j b_k) / d_j
//! y += b'_k x_k,  x_k = (wanted - a_k y) / d_k,     d_k = a'_k b'_k
//! sum_k b'_k x_k = B^T P                            P_k = x_k - sum_i>k c_ik P_i
//! ```

use crate::linear::{add_scaled, dot};
use crate::scalar::whole;
use crate::workspace::split;
use crate::{Error, Scalar};

/// A row of which less than this share is independent of those before is left as it is.
const INDEPENDENT: f64 = 1e-4;

/// How many numbers [`Exact`] needs beside two matrices.
pub(super) const fn exact_len(n: usize) -> usize {
    n * n + 3 * n
}

/// The rows so far, and by how much they moved y.
pub(super) struct Exact<'a, S> {
    /// a', N x N.
    wanted: &'a mut [S],
    /// b', N x N.
    moves: &'a mut [S],
    /// c, N x N.
    parts: &'a mut [S],
    /// d, N.
    pivots: &'a mut [S],
    /// x, N; then P.
    amounts: &'a mut [S],
    /// y, N.
    pub y: &'a mut [S],
    count: usize,
    little: Option<S>,
}

impl<'a, S: Scalar> Exact<'a, S> {
    /// Takes [`exact_len`] numbers off a workspace, and two matrices N x N.
    pub fn new(
        n: usize,
        storage: &mut &'a mut [S],
        [moves, parts]: [&'a mut [S]; 2],
    ) -> Result<Self, Error> {
        Ok(Self {
            wanted: split(storage, n * n)?,
            moves,
            parts,
            pivots: split(storage, n)?,
            amounts: split(storage, n)?,
            y: split(storage, n)?,
            count: 0,
            little: None,
        })
    }

    /// From a y on, without rows. With `little`, no row changes the square of y by more.
    pub fn begin(&mut self, y: &[S], little: Option<S>) {
        self.y.iter_mut().zip(y).for_each(|(own, &y)| *own = y);
        (self.count, self.little) = (0, little);
    }

    /// Gives y this product with a row by moving it along the row, and by shares of two others; products of the rows
    /// before stay. Returns the place of the row, from 1 on; 0 if it depends on those before.
    pub fn hold(&mut self, row: &[S], others: [(S, &[S]); 2], value: S) -> S {
        let (n, count) = (row.len(), self.count);
        let place = count * n..(count + 1) * n;
        let (Some((all_wanted, wanted)), Some((all_moves, moves)), Some(parts)) = (
            split_row(self.wanted, count, n),
            split_row(self.moves, count, n),
            self.parts.get_mut(place),
        ) else {
            return S::ZERO;
        };
        for (to, &from) in wanted.iter_mut().zip(row) {
            *to = from;
        }
        for (to, &from) in moves.iter_mut().zip(row) {
            *to = from;
        }
        for (share, other) in others {
            add_scaled(moves, share, other);
        }
        let (size, least) = (dot(row, row) * dot(moves, moves), S::from_f64(INDEPENDENT));
        let before = all_wanted.chunks_exact(n).zip(all_moves.chunks_exact(n)).zip(&*self.pivots);
        for (((a, b), &pivot), part) in before.zip(parts) {
            *part = dot(a, moves) / pivot;
            add_scaled(moves, -*part, b);
            add_scaled(wanted, -dot(wanted, b) / pivot, a);
        }
        let pivot = dot(wanted, moves);
        let missing = value - dot(row, self.y);
        let too_much = self.little.is_some_and(|little| !(missing * missing <= little * pivot));
        // Written so that NaN is refused.
        if !(pivot > S::ZERO && pivot * pivot > least * least * least * least * size) || too_much {
            return S::ZERO;
        }
        let amount = missing / pivot;
        add_scaled(self.y, amount, moves);
        if let Some((own, x)) = self.pivots.get_mut(count).zip(self.amounts.get_mut(count)) {
            (*own, *x) = (pivot, amount);
        }
        self.count += 1;
        whole(self.count as u64)
    }

    /// The amounts become impulses: from the last one back, which stands for parts of those before it.
    pub fn impulses(&mut self) {
        let n = self.amounts.len();
        let rows = self.parts.chunks_exact(n.max(1)).enumerate().take(self.count);
        for (k, parts) in rows.rev() {
            if let (Some((before, rest)), Some(parts)) =
                (self.amounts.split_at_mut_checked(k), parts.get(..k))
                && let Some(&amount) = rest.first()
            {
                add_scaled(before, -amount, parts);
            }
        }
    }

    /// The impulse of the row at a place; zero without one.
    pub fn impulse(&self, place: S) -> S {
        let mut amounts = (1..=self.count).zip(&*self.amounts);
        let found = amounts.find(|(k, _)| whole::<S>(*k as u64) == place);
        found.map_or(S::ZERO, |(_, &amount)| amount)
    }
}

/// The rows before one, and that one.
fn split_row<S>(rows: &mut [S], index: usize, n: usize) -> Option<(&[S], &mut [S])> {
    let (before, rest) = rows.split_at_mut_checked(index * n)?;
    Some((before, rest.get_mut(..n)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows in a plane, of which the second leaves the first by a share: y and the impulses by hand.
    #[test]
    fn a_row_counts_from_a_ten_thousandth_on() {
        for (share, counts) in [(1.0, true), (1e-3, true), (2e-4, true), (1e-5, false)] {
            let mut storage = [0.0; exact_len(2)];
            let (mut moves, mut parts) = ([0.0; 4], [0.0; 4]);
            let mut rest = &mut storage[..];
            let mut exact = Exact::new(2, &mut rest, [&mut moves, &mut parts]).unwrap();
            exact.begin(&[0.0, 0.0], None);
            let rows = [[1.0, 0.0], [1.0, share]];
            let [place, last_place] = [(0, 1.0), (1, 2.0)].map(|(index, value): (usize, f64)| {
                let row: &[f64] = &rows[index];
                exact.hold(row, [(0.0, row); 2], value)
            });
            assert_eq!(place, 1.0);
            exact.impulses();
            if !counts {
                assert_eq!((last_place, &*exact.y), (0.0, &[1.0, 0.0][..]));
                continue;
            }
            let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-9;
            let last = 1.0 / (share * share);
            assert_eq!((last_place, exact.y[0]), (2.0, 1.0));
            assert!(near(exact.y[1], 1.0 / share), "{share}: {:?}", exact.y);
            assert!(near(exact.impulse(2.0), last), "{share}: {}", exact.impulse(2.0));
            let first = exact.impulse(1.0);
            assert!((first - (1.0 - last)).abs() < 1e-9 * last, "{share}: {first}");
        }
    }
}
