//! The equations of motion along the closure, linear about a state of rest.
//!
//! With the columns of T spanning the directions along the closure, T^T M T = 1, and q = q0 + T z,
//!
//! ```text
//! d2z/dt2 = -K z - D dz/dt + B i,    K = -T^T M da/dq T,  D = -T^T M da/du T,  B = T^T M da/di
//! ```
//!
//! so that A = [0 1; -K -D]. At rest T changes only to second order, and the reaction of the
//! closure does no work along it.

use crate::acceleration::not_finite;
use crate::linear::dot;
use crate::rest::{AtRestMut, Forces, along_closure};
use crate::{Error, Mechanism};

/// Where [`linearize`] writes: the leading parts of slices that hold NU x NU, with d freedoms.
#[derive(Debug)]
pub struct LinearizationMut<'a, S> {
    /// T^T, d x NU: directions of q, one after the other, 1/(kg^(1/2) m).
    pub basis: &'a mut [S],
    /// K, d x d, 1/s^2.
    pub stiffness: &'a mut [S],
    /// D, d x d, 1/s.
    pub damping: &'a mut [S],
    /// B, d x inputs, in a slice that holds NU x inputs.
    pub inputs: &'a mut [S],
}

/// K, D and B about the state of rest at q (rad) and t (s). Returns the number of freedoms d.
///
/// # Errors
///
/// As [`acceleration`](crate::acceleration()).
pub fn linearize<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    mut out: LinearizationMut<'_, Y::Scalar>,
) -> Result<usize, Error> {
    let dimensions = system.dimensions();
    let n = dimensions.speeds;
    for slice in [&*out.basis, out.stiffness, out.damping] {
        if slice.len() != n * n {
            return Err(Error::Length { expected: n * n, given: slice.len() });
        }
    }
    if out.inputs.len() != n * dimensions.inputs {
        let expected = n * dimensions.inputs;
        return Err(Error::Length { expected, given: out.inputs.len() });
    }
    let rest = system.speeds();
    let mut balance = system.speeds();
    let LinearizationMut { basis, stiffness, .. } = &mut out;
    let at_rest = AtRestMut { balance: balance.as_mut(), basis, stiffness };
    let state = (t, q, rest.as_ref());
    let freedoms = along_closure(system, state, workspace, at_rest)?;
    let directions = &out.basis[..freedoms * n];
    let mut forces = Forces::without_accelerations(system, state, workspace)?;
    forces.along(directions, true, out.damping)?;
    for input in 0..dimensions.inputs {
        let forces = forces.by_input(input)?;
        for (k, direction) in directions.chunks_exact(n.max(1)).enumerate() {
            out.inputs[k * dimensions.inputs + input] = dot(direction, forces);
        }
    }
    let square = freedoms * freedoms;
    let [stiffness, damping] = [&out.stiffness[..square], &out.damping[..square]];
    let inputs = &out.inputs[..freedoms * dimensions.inputs];
    match not_finite(&[&out.basis[..freedoms * n], stiffness, damping, inputs]) {
        Some(index) => Err(Error::NotFinite { joint: index % n }),
        None => Ok(freedoms),
    }
}
