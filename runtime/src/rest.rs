//! The directions along the closure at a state of rest, and how the forces along them change.
//!
//! ```text
//! J T = 0,  T^T M T = 1        K = -T^T M da/dq T
//! ```
//!
//! Because J T = 0, the change of generalised forces is enough, T^T M da = T^T d(f - M a + J^T lambda). Where the mechanism has a
//! reduction to independent speeds that can be trusted at the state, T and K follow from that ([`reduction::at_rest`]), and else from a
//! decision on the rank.

use crate::linear::dot;
use crate::linearised::Linearised;
use crate::plumbing::Balance;
use crate::workspace::split;
use crate::{Arithmetic, Change, Error, Mechanism, reduction};

/// Where [`along_closure`] writes.
pub(crate) struct AtRestMut<'a, S> {
    /// M a, NU, N m.
    pub balance: &'a mut [S],
    /// T^T, NU x NU at most: directions of q, one after the other.
    pub basis: &'a mut [S],
    /// K, d x d, in a slice that holds NU x NU.
    pub stiffness: &'a mut [S],
}

/// M a, T and K at rest at (t, q), where `rest` are zeros (NU); the number d of directions.
pub(crate) fn along_closure<Y: Mechanism>(
    system: &Y,
    (t, q, rest): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    workspace: &mut [Y::Scalar],
    mut out: AtRestMut<'_, Y::Scalar>,
) -> Result<usize, Error> {
    let state = (t, q, rest);
    if let Some(freedoms) = reduction::at_rest(system, state, workspace, &mut out)? {
        return Ok(freedoms);
    }
    let AtRestMut { balance, basis, stiffness } = out;
    let mut linear = Linearised::at(system, t, q, rest, workspace)?;
    balance.copy_from_slice(linear.acceleration);
    linear.times_mass(balance);
    let freedoms = linear.tangent_basis(basis);
    linear.forces().along(&basis[..freedoms * rest.len()], false, stiffness)?;
    Ok(freedoms)
}

/// The generalised forces f - M a + J^T lambda at a state of rest, N m, as something changes.
pub(crate) struct Forces<'a, Y: Mechanism> {
    pub system: &'a Y,
    /// The state, and a and lambda there.
    pub at: Balance<'a, Y::Scalar>,
    /// Zeros.
    pub parameters: &'a [Y::Scalar],
    /// Zeros.
    pub inputs: &'a mut [Y::Scalar],
    pub force: &'a mut [Y::Scalar],
    pub opening: &'a mut [Y::Scalar],
}

impl<'a, Y: Mechanism> Forces<'a, Y> {
    /// Those that change with speeds and inputs: a and lambda, which do not matter to these, are zeros.
    pub fn without_accelerations(
        system: &'a Y,
        (t, q, rest): (Y::Scalar, &'a [Y::Scalar], &'a [Y::Scalar]),
        mut workspace: &'a mut [Y::Scalar],
    ) -> Result<Self, Error> {
        let d = system.dimensions();
        let zeros = split(&mut workspace, d.rows + d.parameters)?;
        zeros.fill(Y::Scalar::ZERO);
        let (multipliers, parameters) = zeros.split_at(d.rows);
        let inputs = split(&mut workspace, d.inputs)?;
        inputs.fill(Y::Scalar::ZERO);
        Ok(Self {
            system,
            at: Balance { t, q, u: rest, acceleration: rest, multipliers },
            parameters,
            inputs,
            force: split(&mut workspace, d.speeds)?,
            opening: split(&mut workspace, d.rows)?,
        })
    }

    fn by(&mut self, q: &[Y::Scalar], u: &[Y::Scalar]) -> Result<&[Y::Scalar], Error> {
        self.opening.fill(Y::Scalar::ZERO);
        let Self { parameters, inputs, .. } = self;
        let change = Change { t: Y::Scalar::ZERO, q, u, parameters, inputs };
        self.system.write_tangent(self.at, change, self.force, self.opening)?;
        Ok(self.force)
    }

    /// With an input, N.
    pub fn by_input(&mut self, input: usize) -> Result<&[Y::Scalar], Error> {
        let rest = self.at.u;
        self.inputs[input] = Y::Scalar::ONE;
        self.by(rest, rest)?;
        self.inputs[input] = Y::Scalar::ZERO;
        Ok(self.force)
    }

    /// -T^T d(forces) T, d x d, as q changes along T, or u does `by_speed`.
    pub fn along(
        &mut self,
        basis: &[Y::Scalar],
        by_speed: bool,
        out: &mut [Y::Scalar],
    ) -> Result<(), Error> {
        let rest = self.at.u;
        let n = rest.len().max(1);
        let freedoms = basis.len() / n;
        for (k, direction) in basis.chunks_exact(n).enumerate() {
            let forces = match by_speed {
                true => self.by(rest, direction)?,
                false => self.by(direction, rest)?,
            };
            for (i, other) in basis.chunks_exact(n).enumerate() {
                out[i * freedoms + k] = -dot(other, forces);
            }
        }
        Ok(())
    }
}
