//! The caller's memory, divided.

use crate::linear::PseudoInverse;
use crate::{Dimensions, Error, Scalar};

/// Numbers that every algorithm of this crate can work in: the mass matrix and the rotations of the
/// singular value decomposition (N x N each); the closure Jacobian, its weighted copy and the
/// transposed one (m x N each); residual and bias (m each); four vectors of N; m is the larger of C
/// and 9 L.
pub const fn workspace_len(d: Dimensions) -> usize {
    let n = d.coordinates;
    let m = closure_rows(d);
    2 * n * n + 3 * m * n + 2 * m + 4 * n
}

/// The larger of C and 9 L.
const fn closure_rows(d: Dimensions) -> usize {
    if d.rows > 9 * d.loops { d.rows } else { 9 * d.loops }
}

/// The parts of a workspace.
pub struct Parts<'a, S> {
    /// N x N.
    pub mass: &'a mut [S],
    /// m x N.
    pub jacobian: &'a mut [S],
    /// m x N.
    pub weighted: &'a mut [S],
    /// m.
    pub residual: &'a mut [S],
    /// m.
    pub rhs: &'a mut [S],
    /// N.
    pub forcing: &'a mut [S],
    /// N.
    pub y: &'a mut [S],
    /// N.
    pub trial: &'a mut [S],
    /// N.
    pub wanted: &'a mut [S],
    /// For the singular value decomposition.
    pub inverse: PseudoInverse<'a, S>,
}

/// Divides a workspace for `rows` closure rows.
pub fn split<S: Scalar>(
    workspace: &mut [S],
    d: Dimensions,
    rows: usize,
) -> Result<Parts<'_, S>, Error> {
    let n = d.coordinates;
    let mut rest = workspace;
    let mut take = |len: usize| {
        let (part, after) =
            core::mem::take(&mut rest).split_at_mut_checked(len).ok_or(Error::Workspace)?;
        rest = after;
        Ok(part)
    };
    Ok(Parts {
        mass: take(n * n)?,
        jacobian: take(rows * n)?,
        weighted: take(rows * n)?,
        residual: take(rows)?,
        rhs: take(rows)?,
        forcing: take(n)?,
        y: take(n)?,
        trial: take(n)?,
        wanted: take(n)?,
        inverse: PseudoInverse { v: take(n * n)?, transposed: take(rows * n)? },
    })
}
