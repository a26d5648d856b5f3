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

use crate::linear::dot;
use crate::linearised::Linearised;
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
    out: LinearizationMut<'_, Y::Scalar>,
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
    let mut linear = Linearised::at(system, t, q, rest.as_ref(), workspace)?;
    let freedoms = linear.tangent_basis(out.basis);
    let mut image = system.speeds();
    let image = image.as_mut();
    let (mut by_position, mut by_speed) = (system.matrix(), system.matrix());
    let mut by_time = system.speeds();
    linear.derivatives(by_position.as_mut(), by_speed.as_mut(), by_time.as_mut())?;
    for (matrix, reduced) in [(by_position, out.stiffness), (by_speed, out.damping)] {
        linear.reduce(matrix.as_ref(), &out.basis[..freedoms * n], image, reduced);
    }
    for input in 0..dimensions.inputs {
        linear.by_input(input, image)?;
        linear.times_mass(image);
        for k in 0..freedoms {
            out.inputs[k * dimensions.inputs + input] = dot(&out.basis[k * n..(k + 1) * n], image);
        }
    }
    Ok(freedoms)
}

impl<Y: Mechanism> Linearised<'_, Y> {
    /// -T^T M A T, d x d, of an N x N matrix A; `image` holds N.
    pub fn reduce(
        &self,
        matrix: &[Y::Scalar],
        basis: &[Y::Scalar],
        image: &mut [Y::Scalar],
        out: &mut [Y::Scalar],
    ) {
        let n = image.len().max(1);
        let freedoms = basis.len() / n;
        for (i, direction) in basis.chunks_exact(n).enumerate() {
            for (value, row) in image.iter_mut().zip(matrix.chunks_exact(n)) {
                *value = -dot(row, direction);
            }
            self.times_mass(image);
            for (k, other) in basis.chunks_exact(n).enumerate() {
                out[k * freedoms + i] = dot(other, image);
            }
        }
    }
}
