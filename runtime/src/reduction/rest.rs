//! Rest by independent speeds: the directions along the closure, and how the forces along them change.
//!
//! T is N with the factor of H, N^T M N = L L^T, T = N L^-T. lambda takes the rows of J that determine the dependent joints; the others
//! follow from them, and have none.

use super::blocks::at;
use super::{Motion, Reduction, beyond_solution};
use crate::linear::{dot, rows_of_mut};
use crate::plumbing::{Balance, EquationsMut};
use crate::rest::{AtRestMut, Forces};
use crate::trust::{Trust, beside};
use crate::workspace::split;
use crate::{Arithmetic, Error, Mechanism, Scalar};

/// t, q and u.
type State<'a, S> = (S, &'a [S], &'a [S]);

/// M a, T and K at rest at (t, q), where the mechanism has a reduction that can be trusted there; the number d of directions.
#[inline(always)]
pub(crate) fn at_rest<Y: Mechanism>(
    system: &Y,
    state: State<'_, Y::Scalar>,
    workspace: &mut [Y::Scalar],
    out: &mut AtRestMut<'_, Y::Scalar>,
) -> Result<Option<usize>, Error> {
    match beyond_solution(system).filter(|_| system.dimensions().drives == 0) {
        Some(reduction) => reduced(system, reduction, state, workspace, out),
        None => Ok(None),
    }
}

fn reduced<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    state: State<'_, Y::Scalar>,
    mut workspace: &mut [Y::Scalar],
    out: &mut AtRestMut<'_, Y::Scalar>,
) -> Result<Option<usize>, Error> {
    let (n, d) = (state.2.len(), reduction.independent.len());
    let AtRestMut { balance, basis, stiffness } = out;
    let basis = rows_of_mut(basis, n, 0..d)?;
    let [mut acceleration, mut reaction, mut lengths] = [(); 3].map(|()| system.speeds());
    let [acceleration, reaction, lengths] =
        [&mut acceleration, &mut reaction, &mut lengths].map(|values| values.as_mut());
    if !find_directions(system, reduction, state, workspace, [acceleration, basis])? {
        return Ok(None);
    }
    let multipliers = split(&mut workspace, system.dimensions().rows)?;
    let out = [&mut **balance, &mut *reaction, &mut *lengths];
    write_balance(system, reduction, (state, acceleration), workspace, out)?;
    let motion = Motion::eliminated(system, reduction, state, workspace)?.0;
    motion.write_multipliers(reduction, (reaction, lengths), multipliers)?;
    let mut forces = Forces::without_accelerations(system, state, workspace)?;
    forces.at = Balance { acceleration, multipliers, ..forces.at };
    forces.along(basis, false, stiffness)?;
    let is_finite = stiffness.iter().take(d * d).all(|x| x.is_finite());
    Ok(is_finite.then_some(d))
}

/// a and T; returns whether they can be trusted.
fn find_directions<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    state: State<'_, Y::Scalar>,
    workspace: &mut [Y::Scalar],
    [acceleration, basis]: [&mut [Y::Scalar]; 2],
) -> Result<bool, Error> {
    let (t, q, rest) = state;
    let (mut motion, trust) = Motion::eliminated(system, reduction, state, workspace)?;
    if trust == Trust::Doubtful || !motion.solve((system, t), false, acceleration, &mut [])? {
        return Ok(false);
    }
    let Motion { a, inertia, .. } = &mut motion;
    let room = rows_of_mut(a, 1, 0..inertia.independent())?;
    for (k, direction) in basis.chunks_exact_mut(rest.len().max(1)).enumerate() {
        inertia.direction(k, room, direction);
    }
    Ok(match trust {
        Trust::Weak(pivot) => beside(system, (q, rest), workspace)?.shows(pivot),
        _ => true,
    })
}

/// M a, c = M a - f = J^T lambda, and the lengths of the rows of J that determine the dependent joints. These are M and f of the whole
/// equations: the parts of a reduction have them from other bodies, where loops are cut.
fn write_balance<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    ((t, q, rest), acceleration): (State<'_, Y::Scalar>, &[Y::Scalar]),
    mut workspace: &mut [Y::Scalar],
    [balance, reaction, lengths]: [&mut [Y::Scalar]; 3],
) -> Result<(), Error> {
    let (n, rows) = (rest.len(), system.dimensions().rows);
    let mass = split(&mut workspace, n * n)?;
    let jacobian = split(&mut workspace, rows * n)?;
    let gamma = split(&mut workspace, rows)?;
    let equations =
        EquationsMut { mass: &mut *mass, forcing: &mut *reaction, jacobian: &mut *jacobian, gamma };
    system.write_equations(t, q, rest, equations)?;
    let of_joints = mass.chunks_exact(n.max(1));
    for ((balance, reaction), row) in balance.iter_mut().zip(reaction).zip(of_joints) {
        *balance = dot(row, acceleration);
        *reaction = *balance - *reaction;
    }
    for (length, &row) in lengths.iter_mut().zip(reduction.rows) {
        let row = jacobian.chunks_exact(n.max(1)).nth(row as usize).unwrap_or_default();
        *length = dot(row, row).sqrt();
    }
    Ok(())
}

impl<S: Scalar> Motion<'_, S> {
    /// lambda, for the force c on the joints and the lengths of rows of J.
    fn write_multipliers(
        mut self,
        reduction: Reduction<'_, S>,
        (reaction, lengths): (&[S], &[S]),
        out: &mut [S],
    ) -> Result<(), Error> {
        out.fill(S::ZERO);
        let Self { terms, inertia, .. } = &mut self;
        let shares = inertia.take_back(reaction)?;
        let rows = reduction.dependent().zip(reduction.rows).zip(lengths);
        for ((joint, &row), &length) in rows {
            let given = out.len();
            let expected = row as usize + 1;
            let place = out.get_mut(row as usize).ok_or(Error::Length { expected, given })?;
            // The parts have rows over the length of the loop.
            let own = reduction.closure.entries_of(joint.into(), terms.closure);
            *place = *at(shares, joint)? * dot(own, own).sqrt() / length;
        }
        Ok(())
    }
}
