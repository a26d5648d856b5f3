//! What M does, without M: by sweeps over the tree.
//!
//! With the hinge s_i of joint i as a velocity, and the momentum F_i of all that moves with it at unit speed, both about
//! the origin of the base frame, M_ij = s_j . F_i for every joint j on the way to the ground (R. Featherstone, "Rigid
//! Body Dynamics Algorithms", 2008, 6.2). Each entry off the diagonal stands twice in M, so that one sweep out is enough
//! for x^T M y + y^T M x, and half the diagonal belongs to it:
//!
//! ```text
//! M = G + G^T        (G x)_i = F_i . V_parent + (F_i . s_i + rotor_i) x_i / 2        V_i = V_parent + s_i x_i
//! ```
//!
//! That is 13 products for each joint and x, however deep the tree is. M x itself needs a sweep back, too:
//!
//! ```text
//! (M x)_i = F_i . V_i + s_i . P_i + rotor_i x_i        P_i = sum_beyond F_j x_j
//! ```

use super::blocks::{Block, sum_of};
use super::{Branch, Terms};
use crate::workspace::split;
use crate::{Error, Scalar};

/// Numbers of a velocity or a momentum: three of a turn and three of a displacement.
pub(super) const PARTS: usize = 6;

/// A velocity or a momentum.
type Parts<T> = [T; PARTS];

/// V and P of the joints on the way from the ground to the present one.
pub(super) struct Sweep<'a, S> {
    /// V for each of some x, by depth.
    velocities: &'a mut [S],
    /// V of one x, by depth.
    velocity: &'a mut [Parts<S>],
    /// P of one x, by depth of the joints beyond.
    beyond: &'a mut [Parts<S>],
}

/// Numbers that [`Sweep`] needs; `depth` is the greatest number of joints on the way from the ground.
pub(super) const fn sweep_len(depth: usize, width: usize) -> usize {
    PARTS * (width * depth + depth + depth + 1)
}

impl<'a, S: Scalar> Sweep<'a, S> {
    /// Room for it.
    pub fn of(depth: usize, width: usize, workspace: &mut &'a mut [S]) -> Result<Self, Error> {
        Ok(Self {
            velocities: split(workspace, PARTS * width * depth)?,
            velocity: split(workspace, PARTS * depth)?.as_chunks_mut().0,
            beyond: split(workspace, PARTS * (depth + 1))?.as_chunks_mut().0,
        })
    }

    /// Writes G x for each of some x, all by branch.
    // Not inlined, as `products`.
    #[inline(never)]
    pub fn half<const W: usize>(
        &mut self,
        branches: &[Branch],
        terms: &Terms<'_, S>,
        x: &[Block<S, W>],
        out: &mut [Block<S, W>],
    ) -> Result<(), Error> {
        let half = S::from_f64(0.5);
        let none = [[S::ZERO; W]; PARTS];
        let velocities: &mut [Parts<Block<S, W>>] =
            self.velocities.as_chunks_mut().0.as_chunks_mut().0;
        let mut next = branches.iter().skip(1);
        for (((branch, joint), x), out) in branches.iter().zip(joints(terms)).zip(x).zip(out) {
            let is_last = next.next().is_none_or(|next| next.depth <= branch.depth);
            if is_last && joint.momentum.iter().all(|&part| part == S::ZERO) {
                // Nothing moves with a hinge that closes a loop.
                *out = x.map(|x| half * joint.rotor * x);
                continue;
            }
            let (above, own) = split_at(velocities, branch.depth.into())?;
            let above = above.last().unwrap_or(&none);
            let own_share = half * (product(joint.momentum, joint.axis) + joint.rotor);
            let mut sum = x.map(|x| own_share * x);
            for (&f, above) in joint.momentum.iter().zip(above) {
                sum = sum_of(f, above, &sum);
            }
            *out = sum;
            if !is_last {
                for ((&s, above), own) in joint.axis.iter().zip(above).zip(own) {
                    *own = sum_of(s, x, above);
                }
            }
        }
        Ok(())
    }

    /// Writes M x by branch.
    pub fn whole(
        &mut self,
        branches: &[Branch],
        terms: &Terms<'_, S>,
        x: &[S],
        out: &mut [S],
    ) -> Result<(), Error> {
        let joints_out = branches.iter().zip(joints(terms)).zip(x);
        for (((branch, joint), &x), out) in joints_out.zip(&mut *out) {
            let (above, own) = split_at(self.velocity, branch.depth.into())?;
            let above = above.last().copied().unwrap_or([S::ZERO; PARTS]);
            *own = sum_of(x, joint.axis, &above);
            *out = joint.rotor.mul_add(x, product(joint.momentum, own));
        }
        self.beyond.fill([S::ZERO; PARTS]);
        let joints_back = branches.iter().zip(joints(terms)).zip(x);
        for (((branch, joint), &x), out) in joints_back.zip(out).rev() {
            let (here, beyond) = split_at(self.beyond, usize::from(branch.depth) + 1)?;
            let own = core::mem::replace(beyond, [S::ZERO; PARTS]);
            *out += product(joint.axis, &own);
            if let Some(here) = here.last_mut() {
                let sum = sum_of(x, joint.momentum, &own);
                *here = core::array::from_fn(|part| here[part] + sum[part]);
            }
        }
        Ok(())
    }
}

/// What the mechanism writes about a joint.
struct Joint<'a, S> {
    axis: &'a Parts<S>,
    momentum: &'a Parts<S>,
    rotor: S,
}

/// The joints in the order of the branches.
fn joints<'a, S: Scalar>(
    terms: &'a Terms<'_, S>,
) -> impl DoubleEndedIterator<Item = Joint<'a, S>> + ExactSizeIterator {
    let (axes, momenta) = (terms.axes.as_chunks().0, terms.momenta.as_chunks().0);
    let parts = axes.iter().zip(momenta).zip(&*terms.rotors);
    parts.map(|((axis, momentum), &rotor)| Joint { axis, momentum, rotor })
}

/// The scalar product, of turns and of displacements at the same time.
#[inline(always)]
fn product<S: Scalar>(a: &Parts<S>, b: &Parts<S>) -> S {
    let of_turns = a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]));
    a[5].mul_add(b[5], a[4].mul_add(b[4], a[3] * b[3])) + of_turns
}

/// What comes before a depth, and what is there.
#[inline(always)]
fn split_at<T>(sums: &mut [T], depth: usize) -> Result<(&mut [T], &mut T), Error> {
    let given = sums.len();
    let split = sums.split_at_mut_checked(depth);
    split
        .and_then(|(before, from)| Some((before, from.first_mut()?)))
        .ok_or(Error::Length { expected: depth + 1, given })
}
