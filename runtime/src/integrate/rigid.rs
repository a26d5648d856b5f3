//! Rigid contacts and stops at fixed steps: time stepping on velocities, of order 1.
//!
//! ```text
//! M (u+ - u) = h f + J^T Lambda + G^T P            f without the compliant law of the contacts
//! J u+ = J u - h gamma                             loops
//! 0 <= P_n,  gap / h + G_n u+ >= 0                 one of them an equality, for every point and every limit
//! |P_t| <= mu P_n, against G_t u+                  Coulomb's friction
//! q+ = q + h u+
//! ```
//!
//! An impulse is the same thing as a force over a step, so that impacts, rest, sliding and sticking need no events and
//! no regularisation. This is the scheme of D. E. Stewart and J. C. Trinkle, "An implicit time-stepping scheme for rigid
//! body dynamics with inelastic collisions and Coulomb friction", 1996, with the round cone of friction instead of a
//! pyramid, in the form of M. Anitescu and F. A. Potra, "Formulating dynamic multi-rigid-body contact problems with
//! friction as solvable linear complementarity problems", 1997, which asks for velocities. For impulses as measures see
//! J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988, and M. Jean, "The non-smooth
//! contact dynamics method", 1999.
//!
//! Loops are solved for directly, whatever their rank, as for accelerations; the one-sided constraints are then solved in
//! what the loops leave free ([`unilateral`](crate::unilateral)). The step bends away from constraints that are not
//! linear in q by O(h^2): loops are projected as after every step, and what overlaps is separated by the next step, by
//! the least displacement weighted with M.

use super::{Stabilisation, fixed};
use crate::acceleration::{blame, not_finite, write};
use crate::closure_rows::Rows;
use crate::decomposition::Decomposition;
use crate::linear::{
    add_scaled, backward, copy, dot, factor, forward, rows_of, set_scaled, times_upper,
};
use crate::plumbing::{Dimensions, EquationsMut};
use crate::rank::Gap;
use crate::unilateral::{Unilateral, unilateral_len};
use crate::workspace::split;
use crate::{Arithmetic, Error, Mechanism, StateOf};

/// Rigid contacts and joint limits at fixed steps: one evaluation of the equations per step, and no limit of the step by
/// the stiffness of a contact.
///
/// Hinge springs and dampers are explicit: steps must be shorter than 2 over the fastest angular frequency, and 2 over
/// the fastest rate of damping.
#[derive(Clone, Debug)]
pub struct Rigid<Y: Mechanism> {
    /// Share of its speed with which a point leaves a plane, and a joint a stop, 0 to 1.
    pub restitution: Y::Scalar,
    /// What would leave more slowly stays, m/s or rad/s.
    pub threshold: Y::Scalar,
    /// Steps so far whose impulses do not fulfil all conditions: Coulomb's law may have no solution there, or none that
    /// the method finds.
    pub unsolved: usize,
    workspace: Y::Workspace,
    storage: Y::Workspace,
    matrices: [Y::Matrix; 2],
    step: Y::Speeds,
}

impl<Y: Mechanism> Rigid<Y> {
    /// With storage for the system; without restitution.
    pub fn new(system: &Y) -> Self {
        Self {
            restitution: Y::Scalar::ZERO,
            threshold: Y::Scalar::from_f64(1e-3),
            unsolved: 0,
            workspace: system.workspace(),
            storage: system.workspace(),
            matrices: [system.matrix(), system.matrix()],
            step: system.speeds(),
        }
    }

    /// Advances by `dt` (s). A step that leads to values that are not finite is repeated in up to
    /// [`STEP_PIECES`](crate::constants::STEP_PIECES) equal pieces, which bounds the time that a step takes.
    ///
    /// # Errors
    ///
    /// Of [`acceleration`](crate::acceleration()) and [`project`](crate::project); [`Error::LeftOut`] of a module with
    /// contacts that was written without the function `gaps` or `contacts`; the state is then unchanged.
    /// [`Error::Time`] for a step that is not a positive, finite number.
    pub fn step(&mut self, system: &Y, state: &mut StateOf<Y>, dt: Y::Scalar) -> Result<(), Error> {
        fixed::step::<Y>(state, dt, |state, dt| self.attempt(system, state, dt))
    }

    /// Advances to `t_end` (s) in equal steps of at most `dt` (s), and shows the state after each.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step); the state is then the last good one.
    pub fn run(
        &mut self,
        system: &Y,
        state: &mut StateOf<Y>,
        t_end: Y::Scalar,
        dt: Y::Scalar,
        observe: impl FnMut(&StateOf<Y>),
    ) -> Result<(), Error> {
        fixed::run::<Y>(state, t_end, dt, |state, dt| self.step(system, state, dt), observe)
    }

    /// The mean force of the last step on the body of each contact point, in the base frame, N; in the order of
    /// [`contacts`](Mechanism::write_contacts).
    pub fn forces(&self, system: &Y) -> &[[Y::Scalar; 3]] {
        Unilateral::forces(system.dimensions(), self.storage.as_ref()).0
    }

    /// The mean torque of the last step of the stop of each joint, N m: positive at the least angle.
    pub fn torques(&self, system: &Y) -> &[Y::Scalar] {
        Unilateral::forces(system.dimensions(), self.storage.as_ref()).1
    }

    fn attempt(&mut self, system: &Y, state: &mut StateOf<Y>, dt: Y::Scalar) -> Result<(), Error> {
        self.speeds(system, state, dt)?;
        system.advance(state.q.as_mut(), self.step.as_ref());
        state.t += dt;
        let (q, u, workspace) = (&mut state.q, &mut state.u, &mut self.workspace);
        match not_finite(&[q.as_ref(), u.as_ref()]) {
            Some(joint) => Err(Error::NotFinite { joint }),
            None => Stabilisation::Projection.project(system, state.t, q, u, workspace),
        }
    }

    /// u at the end of a step, and the step of q.
    fn speeds(&mut self, system: &Y, state: &mut StateOf<Y>, dt: Y::Scalar) -> Result<(), Error> {
        let d = system.dimensions();
        let (n, c) = (d.speeds, d.rows + d.drives);
        let (q, u) = (state.q.as_ref(), state.u.as_mut());
        let mut workspace = self.workspace.as_mut();
        let gap = Gap::at(system, q, workspace)?;
        let mut storage = self.storage.as_mut();
        let mut unilateral = Unilateral::new(
            d,
            split(&mut storage, unilateral_len(d))?,
            self.matrices.each_mut().map(AsMut::as_mut),
        )?;
        let (before, moved) = (split(&mut storage, n)?, split(&mut storage, n)?);

        let mass = split(&mut workspace, n * n)?;
        let jacobian = split(&mut workspace, c * n)?;
        let gamma = split(&mut workspace, c)?;
        let y = self.step.as_mut();
        write(system, state.t, q, u, EquationsMut { mass, forcing: y, jacobian, gamma })?;
        unilateral.read(system, (state.t, q, u), y)?;
        factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
        // y = L^T u + h L^-1 f.
        forward(mass, y);
        copy(before, u)?;
        times_upper(mass, before);
        y.iter_mut().zip(&*before).for_each(|(y, &before)| *y = before + dt * *y);

        set_rates(system, d, (state.t + dt, u), dt, jacobian, gamma);
        let weighted = split(&mut workspace, c * n)?;
        let scratch = split(&mut workspace, c * n)?;
        let (rhs, push) = (split(&mut workspace, c)?, split(&mut workspace, n)?);
        let mut held = 0;
        if c > 0 {
            let (mass, jacobian, gamma) = (&*mass, &*jacobian, &*gamma);
            let mut rows =
                Rows { mass, jacobian, gamma, weighted: &mut *weighted, scratch, rhs, push };
            held = rows.general(Decomposition::of(system), gap, y)?.0.rank;
        }
        unilateral.weigh(mass, rows_of(weighted, n, 0..held)?);

        let overlaps = unilateral.overlaps(system.size());
        if overlaps {
            unilateral.separate(moved);
            backward(mass, moved);
        }
        let mut is_found = unilateral.meet(y, dt);
        copy(u, y)?;
        if self.restitution > Y::Scalar::ZERO {
            is_found &= unilateral.rebound(u, before, [self.restitution, self.threshold], dt);
        }
        self.unsolved += usize::from(!is_found);
        backward(mass, u);
        backward(mass, y);
        copy(before, y)?;
        set_scaled(y, dt, before);
        if overlaps {
            add_scaled(y, Y::Scalar::ONE, moved);
        }
        Ok(())
    }
}

/// gamma becomes what makes J u+ = -gamma the closure at the end of the step: h gamma - J u, and the prescribed
/// speeds of driven joints at that time.
fn set_rates<Y: Mechanism>(
    system: &Y,
    d: Dimensions,
    (t, u): (Y::Scalar, &[Y::Scalar]),
    dt: Y::Scalar,
    jacobian: &[Y::Scalar],
    gamma: &mut [Y::Scalar],
) {
    for (gamma, row) in gamma.iter_mut().zip(jacobian.chunks_exact(d.speeds.max(1))) {
        *gamma = dt * *gamma - dot(row, u);
    }
    let mut driven = gamma.iter_mut().skip(d.rows);
    let size = system.size();
    system.drives(t, |drive| {
        if let Some(gamma) = driven.next() {
            *gamma = -size * drive.speed;
        }
    });
}
