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

use super::inertia::{Block, LANES, at, at_mut, sum_of};
use super::{Branch, Terms};
use crate::{Error, Scalar};

/// Numbers of a velocity or a momentum: three of a turn and three of a displacement.
pub(super) const PARTS: usize = 6;

/// A velocity or a momentum for each of some speeds.
type Parts<S> = [Block<S>; PARTS];

/// V and P of the joints on the way from the ground to the present one.
pub(super) struct Sums<'a, S> {
    /// V by depth.
    outward: &'a mut [Parts<S>],
    /// P by depth.
    inward: &'a mut [Parts<S>],
}

impl<'a, S: Scalar> Sums<'a, S> {
    /// In this room.
    pub fn of(outward: &'a mut [Block<S>], inward: &'a mut [Block<S>]) -> Self {
        Self { outward: outward.as_chunks_mut().0, inward: inward.as_chunks_mut().0 }
    }

    /// Writes M N, `products`, for N of a block of speeds; a joint that moves no mass is not `active`, and has zeros.
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
            let joint = Joint::of(terms, index)?;
            if next <= branch.depth && joint.is_idle() {
                *active = S::ZERO;
                *at_mut(products, index)? = [S::ZERO; LANES];
            } else {
                *active = S::ONE;
                self.enter(branch.depth, &joint, at(null_space, index)?)?;
                if next > branch.depth {
                    continue;
                }
                *at_mut(products, index)? =
                    self.leave(branch.depth, &joint, at(null_space, index)?)?;
            }
            // Those before it that nothing follows end here, too.
            let mut last = index;
            for depth in (next..branch.depth).rev() {
                let before = branches.get(..last).unwrap_or_default();
                let parent = before.iter().rposition(|branch| branch.depth == depth);
                last = parent.unwrap_or(0);
                *at_mut(products, last)? =
                    self.leave(depth, &Joint::of(terms, last)?, at(null_space, last)?)?;
            }
        }
        Ok(())
    }

    /// V of a joint; its P begins with nothing.
    #[inline]
    fn enter(&mut self, depth: u16, joint: &Joint<'_, S>, n: &Block<S>) -> Result<(), Error> {
        let depth = usize::from(depth);
        let above = depth.checked_sub(1).and_then(|above| self.outward.get(above));
        let own = match above {
            Some(above) => core::array::from_fn(|part| sum_of(joint.axis[part], n, &above[part])),
            None => joint.axis.map(|s| n.map(|n| s * n)),
        };
        *parts(self.outward, depth)? = own;
        *parts(self.inward, depth)? = [[S::ZERO; LANES]; PARTS];
        Ok(())
    }

    /// (M N)_i of a joint whose P is complete; what it adds to the P before it is added.
    #[inline]
    fn leave(&mut self, depth: u16, joint: &Joint<'_, S>, n: &Block<S>) -> Result<Block<S>, Error> {
        let depth = usize::from(depth);
        let (v, p) = (parts(self.outward, depth)?, *parts(self.inward, depth)?);
        let mut product = n.map(|n| joint.rotor * n);
        for ((f, v), (s, p)) in joint.momentum.iter().zip(v).zip(joint.axis.iter().zip(&p)) {
            product = sum_of(*s, p, &sum_of(*f, v, &product));
        }
        if let Some(above) = depth.checked_sub(1) {
            let above = parts(self.inward, above)?;
            for ((above, own), f) in above.iter_mut().zip(&p).zip(joint.momentum) {
                let sum = sum_of(*f, n, own);
                *above = core::array::from_fn(|lane| above[lane] + sum[lane]);
            }
        }
        Ok(product)
    }
}

/// What the mechanism writes about a joint.
struct Joint<'a, S> {
    axis: &'a [S; PARTS],
    momentum: &'a [S; PARTS],
    rotor: S,
}

impl<'a, S: Scalar> Joint<'a, S> {
    fn of(terms: &'a Terms<'_, S>, index: usize) -> Result<Self, Error> {
        let parts = (terms.axes.as_chunks().0.get(index), terms.momenta.as_chunks().0.get(index));
        match (parts, terms.rotors.get(index)) {
            ((Some(axis), Some(momentum)), Some(&rotor)) => Ok(Self { axis, momentum, rotor }),
            _ => Err(Error::Length { expected: index + 1, given: terms.rotors.len() }),
        }
    }

    /// Whether nothing that has mass moves with it.
    fn is_idle(&self) -> bool {
        self.rotor == S::ZERO && *self.momentum == [S::ZERO; PARTS]
    }
}

/// The sums of a depth.
#[inline(always)]
fn parts<S>(sums: &mut [Parts<S>], depth: usize) -> Result<&mut Parts<S>, Error> {
    let given = sums.len();
    sums.get_mut(depth).ok_or(Error::Length { expected: depth + 1, given })
}
