//! M N without M: by one sweep out and back over the tree.
//!
//! With the hinge s_i of joint i as a velocity, and the momentum F_i of all that moves with it at unit speed, both about
//! the origin of the base frame, M_ij = s_j . F_i for every joint j on the way to the ground (R. Featherstone, "Rigid
//! Body Dynamics Algorithms", 2008, 6.2). So row i of M N needs two sums, of which one grows on the way out and the
//! other on the way back:
//!
//! ```text
//! V_i = V_parent + s_i N_i        P_i = sum_beyond F_j N_j        (M N)_i = F_i . V_i + s_i . P_i + rotor_i N_i
//! ```
//!
//! That is 24 products for each joint and independent speed, however deep the tree is.

use super::inertia::{Block, LANES, sum_of};
use super::{Branch, Terms};
use crate::linear::{rows_of, rows_of_mut};
use crate::{Error, Scalar};

/// Numbers of a velocity or a momentum: three of a turn and three of a displacement.
pub(super) const PARTS: usize = 6;

/// V and P of the joints on the way from the ground to the present one.
pub(super) struct Sums<'a, S> {
    /// Blocks of a row.
    count: usize,
    /// V by depth.
    outward: &'a mut [[Block<S>; PARTS]],
    /// P by depth.
    inward: &'a mut [[Block<S>; PARTS]],
}

impl<'a, S: Scalar> Sums<'a, S> {
    /// In this room.
    pub fn of(count: usize, outward: &'a mut [Block<S>], inward: &'a mut [Block<S>]) -> Self {
        Self { count, outward: outward.as_chunks_mut().0, inward: inward.as_chunks_mut().0 }
    }

    /// Writes M N, `products`, for N; a joint that moves no mass is not `active`, and has zeros.
    pub fn sweep(
        &mut self,
        branches: &[Branch],
        terms: &Terms<'_, S>,
        null_space: &[Block<S>],
        products: &mut [Block<S>],
        active: &mut [S],
    ) -> Result<(), Error> {
        for ((index, branch), active) in branches.iter().enumerate().zip(active) {
            let next = branches.get(index + 1).map_or(0, |next| next.depth);
            let joint = Joint::of(terms, index);
            let (row, product) = (index..index + 1, index..index + 1);
            if next <= branch.depth && joint.is_idle() {
                *active = S::ZERO;
                rows_of_mut(products, self.count, product)?.fill([S::ZERO; LANES]);
            } else {
                *active = S::ONE;
                self.enter(branch.depth, &joint, rows_of(null_space, self.count, row.clone())?)?;
                if next > branch.depth {
                    continue;
                }
                let product = rows_of_mut(products, self.count, product)?;
                self.leave(branch.depth, &joint, rows_of(null_space, self.count, row)?, product)?;
            }
            // Those before it that nothing follows end here, too.
            let mut last = index;
            for depth in (next..branch.depth).rev() {
                let before = branches.get(..last).unwrap_or_default();
                let parent = before.iter().rposition(|branch| branch.depth == depth);
                last = parent.unwrap_or(0);
                let row = rows_of(null_space, self.count, last..last + 1)?;
                let product = rows_of_mut(products, self.count, last..last + 1)?;
                self.leave(depth, &Joint::of(terms, last), row, product)?;
            }
        }
        Ok(())
    }

    /// V of a joint; its P begins with nothing.
    fn enter(&mut self, depth: u16, joint: &Joint<S>, row: &[Block<S>]) -> Result<(), Error> {
        let depth = usize::from(depth);
        rows_of_mut(self.inward, self.count, depth..depth + 1)?.fill([[S::ZERO; LANES]; PARTS]);
        let Some(above) = depth.checked_sub(1) else {
            for (sum, n) in rows_of_mut(self.outward, self.count, 0..1)?.iter_mut().zip(row) {
                *sum = joint.axis.map(|s| n.map(|n| s * n));
            }
            return Ok(());
        };
        let (above, own) = pair(self.outward, self.count, above)?;
        for ((sum, above), n) in own.iter_mut().zip(above).zip(row) {
            for ((sum, above), s) in sum.iter_mut().zip(above).zip(joint.axis) {
                *sum = sum_of(s, n, above);
            }
        }
        Ok(())
    }

    /// (M N)_i of a joint whose P is complete, and what it adds to the P before it.
    fn leave(
        &mut self,
        depth: u16,
        joint: &Joint<S>,
        row: &[Block<S>],
        product: &mut [Block<S>],
    ) -> Result<(), Error> {
        let (count, depth) = (self.count, usize::from(depth));
        let outward = rows_of(self.outward, count, depth..depth + 1)?;
        let own = rows_of(self.inward, count, depth..depth + 1)?;
        for (((product, n), v), p) in product.iter_mut().zip(row).zip(outward).zip(own) {
            let mut sum = n.map(|n| joint.rotor * n);
            for ((f, v), (s, p)) in joint.momentum.iter().zip(v).zip(joint.axis.iter().zip(p)) {
                sum = sum_of(*s, p, &sum_of(*f, v, &sum));
            }
            *product = sum;
        }
        let Some(above) = depth.checked_sub(1) else { return Ok(()) };
        let (above, own) = pair(self.inward, count, above)?;
        for ((above, own), n) in above.iter_mut().zip(own).zip(row) {
            for ((above, own), f) in above.iter_mut().zip(own).zip(joint.momentum) {
                let sum = sum_of(f, n, own);
                *above = core::array::from_fn(|lane| above[lane] + sum[lane]);
            }
        }
        Ok(())
    }
}

/// What the mechanism writes about a joint.
struct Joint<S> {
    axis: [S; PARTS],
    momentum: [S; PARTS],
    rotor: S,
}

impl<S: Scalar> Joint<S> {
    fn of(terms: &Terms<'_, S>, index: usize) -> Self {
        let nothing = [S::ZERO; PARTS];
        Self {
            axis: terms.axes.as_chunks().0.get(index).copied().unwrap_or(nothing),
            momentum: terms.momenta.as_chunks().0.get(index).copied().unwrap_or(nothing),
            rotor: terms.rotors.get(index).copied().unwrap_or(S::ZERO),
        }
    }

    /// Whether nothing that has mass moves with it.
    fn is_idle(&self) -> bool {
        self.rotor == S::ZERO && self.momentum == [S::ZERO; PARTS]
    }
}

/// The sums of a depth, and those of the next.
fn pair<T>(rows: &mut [T], count: usize, above: usize) -> Result<(&mut [T], &mut [T]), Error> {
    let pair = rows_of_mut(rows, count, above..above + 2)?;
    let given = pair.len();
    pair.split_at_mut_checked(count).ok_or(Error::Length { expected: count, given })
}
