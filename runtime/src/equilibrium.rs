//! Equilibrium: a state of rest on the closed manifold.
//!
//! At rest the constrained acceleration a(q) at u = 0 is the generalised force along the closure,
//! measured by M. Its zero is found by following the overdamped motion dq/dtau = a(q) with
//! implicit steps that grow as a fades, the last of which are Newton's:
//!
//! ```text
//! (w + K) z = T^T M a(q),    dq = T z,    K = -T^T M da/dq T,    w' = w min(|a'| / |a|, 1/2)
//! ```
//!
//! with the columns of T along the closure
//!
//! (pseudo-transient continuation: C. T. Kelley, D. E. Keyes, "Convergence analysis of
//! pseudo-transient continuation", 1998). A step must run downhill: w + K must be positive definite,
//! and the force must do work along the step. So the motion leaves unstable equilibria and runs into stable ones; each step ends on the
//! closure. A joint that reaches a limit is held there as long
//! as the stop pushes.

use crate::free_body::extent;
use crate::linear::{add_scaled, dot, factor, max_abs, reflect, solve, tolerance};
use crate::linearised::Linearised;
use crate::projection::project_to_rounding;
use crate::rest::{AtRestMut, along_closure};
use crate::{Arithmetic, Error, Mechanism, Scalar, Stopped};

/// Steps at most.
const ITERATIONS: usize = 400;
/// Longest step ([`extent`]): longer ones jump to another branch.
const LONGEST: f64 = 0.2;

/// Steps up to this length may rely on the force alone: where the work they do is lost in rounding.
const SHORT: f64 = 1e-5;

/// Newton's steps of this length that do no better are rounding.
const NOISE: f64 = 1e-8;

/// A state of rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Equilibrium<S> {
    /// Steps taken.
    pub iterations: usize,
    /// Largest remaining generalised force along the closure, N m; a force on a free body counts with the
    /// mechanism's size as its arm.
    pub force: S,
    /// Whether the equilibrium is statically stable: the potential has a minimum there.
    pub stable: bool,
}

/// Moves `q` (NQ) along decreasing potential to an equilibrium at t (s); `q` should be nearly
/// closed. Driven joints have their prescribed angles at t. On failure `q` is unchanged.
///
/// # Errors
///
/// [`Error::NoEquilibrium`]; [`Error::NotClosed`] and [`Error::NotDriven`] where `q` is too far
/// from closed; [`Error::MassMatrix`], [`Error::NotFinite`], [`Error::Workspace`],
/// [`Error::Length`].
pub fn equilibrium<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut Y::Coordinates,
    workspace: &mut [Y::Scalar],
) -> Result<Equilibrium<Y::Scalar>, Error> {
    let mut search = Search {
        system: {
            let mut system = Stopped::new(system);
            system.still = true;
            system
        },
        t,
        q: q.clone(),
        u: system.speeds(),
        step: system.speeds(),
        force: system.speeds(),
        covector: system.speeds(),
        basis: system.matrix(),
        stiffness: system.matrix(),
        matrix: system.matrix(),
        workspace,
    };
    let found = search.run()?;
    q.clone_from(&search.q);
    Ok(found)
}

struct Search<'a, 'w, Y: Mechanism> {
    system: Stopped<&'a Y>,
    t: Y::Scalar,
    q: Y::Coordinates,
    /// Zero.
    u: Y::Speeds,
    step: Y::Speeds,
    /// Along the basis.
    force: Y::Speeds,
    /// M a, N m.
    covector: Y::Speeds,
    /// Directions along the closure, one after the other.
    basis: Y::Matrix,
    stiffness: Y::Matrix,
    matrix: Y::Matrix,
    workspace: &'w mut [Y::Scalar],
}

/// Distance of a state from equilibrium.
#[derive(Clone, Copy)]
struct Unrest<S> {
    /// a^T M a, the square of the force measured by M.
    square: S,
    /// As [`Equilibrium::force`].
    force: S,
    /// Directions along the closure.
    freedoms: usize,
}

/// A step that led downhill.
struct Accepted<S> {
    unrest: Unrest<S>,
    /// By which the weight of the next step is multiplied.
    factor: S,
}

impl<Y: Mechanism> Search<'_, '_, Y> {
    fn run(&mut self) -> Result<Equilibrium<Y::Scalar>, Error> {
        let of = Y::Scalar::from_f64;
        self.close()?;
        let mut unrest = self.evaluate()?;
        let mut weight = Y::Scalar::ZERO;
        let enough: Y::Scalar = tolerance(1e-13, 8.0);
        let mut diagonal = self.system.speeds();
        let mut rejected = false;
        let mut shortest = of(f64::INFINITY);
        for iterations in 0..ITERATIONS {
            let freedoms = unrest.freedoms;
            let stiffest = max_abs(&self.stiffness.as_ref()[..freedoms * freedoms]);
            let floor = of(1e-12) * stiffest;
            weight = if iterations == 0 { stiffest } else { weight.max(floor) };
            let newton = match self.curves_up(freedoms, floor) {
                true => self.solve(freedoms, floor, diagonal.as_mut()),
                false => of(f64::INFINITY),
            };
            let stalled = rejected && (newton <= of(NOISE) || shortest <= enough);
            let found = unrest.square == Y::Scalar::ZERO || newton <= enough || stalled;
            if freedoms == 0 || found {
                if self.release()? {
                    unrest = self.evaluate()?;
                    weight = stiffest;
                    rejected = false;
                    continue;
                }
                // Rounding errors do not prevent convergence.
                let rounding = of(64.0) * Y::Scalar::EPSILON * stiffest;
                let stable = self.curves_up(freedoms, -rounding);
                return Ok(Equilibrium { iterations, force: unrest.force, stable });
            }
            while !self.curves_up(freedoms, weight) {
                weight = weight.max(floor).max(Y::Scalar::EPSILON) * of(4.0);
            }
            let length = self.solve(freedoms, weight, diagonal.as_mut());
            shortest = length;
            match self.attempt(length, unrest)? {
                Some(accepted) => {
                    weight *= accepted.factor;
                    unrest = accepted.unrest;
                    rejected = false;
                }
                None => {
                    rejected = true;
                    weight = weight.max(of(1e-3) * stiffest) * of(8.0);
                }
            }
        }
        Err(Error::NoEquilibrium { force: unrest.force.to_f32() })
    }

    /// Takes the step if it leads downhill. If it does not, q stays.
    fn attempt(
        &mut self,
        length: Y::Scalar,
        unrest: Unrest<Y::Scalar>,
    ) -> Result<Option<Accepted<Y::Scalar>>, Error> {
        let of = Y::Scalar::from_f64;
        let before = self.q.clone();
        let force = self.covector.clone();
        let sides = self.system.sides.clone();
        let held = self.advance(length);
        let next = self.close().and_then(|()| self.evaluate());
        match next {
            Ok(next)
                if held
                    || self.work(before.as_ref(), force.as_ref()) > Y::Scalar::ZERO
                    || (length <= of(SHORT) && next.square < unrest.square) =>
            {
                let ratio = (next.square / unrest.square).sqrt();
                let factor = if held { Y::Scalar::ONE } else { ratio.max(of(0.02)).min(of(0.5)) };
                Ok(Some(Accepted { unrest: next, factor }))
            }
            _ => {
                self.q.clone_from(&before);
                self.system.sides.clone_from(&sides);
                self.evaluate()?;
                Ok(None)
            }
        }
    }

    fn close(&mut self) -> Result<(), Error> {
        let (q, u) = (self.q.as_mut(), self.u.as_mut());
        u.fill(Y::Scalar::ZERO);
        project_to_rounding(&self.system, self.t, q, u, self.workspace).map(|_| ())
    }

    /// a at rest, the basis T of the directions along the closure (T^T M T = 1), the stiffness
    /// -T^T M da/dq T and the force T^T M a.
    fn evaluate(&mut self) -> Result<Unrest<Y::Scalar>, Error> {
        let Self { system, t, q, u, basis, stiffness, covector, force, workspace, .. } = self;
        let n = u.as_ref().len();
        let out = AtRestMut {
            balance: covector.as_mut(),
            basis: basis.as_mut(),
            stiffness: stiffness.as_mut(),
        };
        let freedoms = along_closure(&*system, (*t, q.as_ref(), u.as_ref()), workspace, out)?;
        let directions = basis.as_ref()[..freedoms * n].chunks_exact(n.max(1));
        let mut square = Y::Scalar::ZERO;
        for (force, direction) in force.as_mut().iter_mut().zip(directions) {
            *force = dot(direction, covector.as_ref());
            square = force.mul_add(*force, square);
        }
        // A force times the size is a moment.
        let one = Y::Scalar::ONE;
        let force = extent(self.covector.as_ref(), system.dimensions().joints, one / system.size());
        Ok(Unrest { square, force, freedoms })
    }

    /// Returns the work of the force from a state to q, J (by the trapezoidal rule).
    fn work(&self, before: &[Y::Scalar], force: &[Y::Scalar]) -> Y::Scalar {
        let mut path = self.system.speeds();
        self.system.write_difference(before, self.q.as_ref(), path.as_mut());
        let forces = self.covector.as_ref().iter().zip(force);
        path.as_ref()
            .iter()
            .zip(forces)
            .fold(Y::Scalar::ZERO, |sum, (&moved, (&now, &then))| sum + moved * (now + then))
    }

    /// The step of this weight; its [`extent`].
    fn solve(
        &mut self,
        freedoms: usize,
        weight: Y::Scalar,
        diagonal: &mut [Y::Scalar],
    ) -> Y::Scalar {
        let n = self.u.as_ref().len();
        let diagonal = &mut diagonal[..freedoms];
        let matrix = &mut self.matrix.as_mut()[..freedoms * freedoms];
        matrix.copy_from_slice(&self.stiffness.as_ref()[..freedoms * freedoms]);
        for i in 0..freedoms {
            matrix[i * freedoms + i] += weight;
        }
        reflect(matrix, diagonal);
        let mut parts = self.force.clone();
        let parts = &mut parts.as_mut()[..freedoms];
        solve(matrix, diagonal, parts);
        let step = self.step.as_mut();
        step.fill(Y::Scalar::ZERO);
        for (k, &part) in parts.iter().enumerate() {
            add_scaled(step, part, &self.basis.as_ref()[k * n..(k + 1) * n]);
        }
        extent(step, self.system.dimensions().joints, self.system.size())
    }

    /// Takes the step, as far as limits allow; whether it ended at one.
    fn advance(&mut self, length: Y::Scalar) -> bool {
        let longest = Y::Scalar::from_f64(LONGEST);
        let mut share = if length > longest { longest / length } else { Y::Scalar::ONE };
        let mut stop = None;
        for joint in 0..self.system.dimensions().joints {
            let (q, step) = (self.q.as_ref()[joint], self.step.as_ref()[joint]);
            let [least, greatest] = self.system.system.limits(joint);
            let (limit, side) = if step < Y::Scalar::ZERO {
                (least, -Y::Scalar::ONE)
            } else {
                (greatest, Y::Scalar::ONE)
            };
            let beyond = (q + share * step - limit) * side > Y::Scalar::ZERO;
            let free = self.system.sides.as_ref()[joint] == Y::Scalar::ZERO;
            if beyond && free && !self.system.is_driven(self.t, joint) {
                share = ((limit - q) / step).max(Y::Scalar::ZERO);
                stop = Some((joint, side));
            }
        }
        self.step.as_mut().iter_mut().for_each(|step| *step = share * *step);
        self.system.advance(self.q.as_mut(), self.step.as_ref());
        if let Some((joint, side)) = stop {
            self.system.sides.as_mut()[joint] = side;
        }
        stop.is_some()
    }

    /// Lets go of the joint that pulls hardest at its stop; whether there is one.
    fn release(&mut self) -> Result<bool, Error> {
        if self.system.sides.as_ref().iter().all(|&side| side == Y::Scalar::ZERO) {
            return Ok(false);
        }
        let d = self.system.system.dimensions();
        let (q, u) = (self.q.as_ref(), self.u.as_ref());
        let linear = Linearised::at(&self.system, self.t, q, u, self.workspace)?;
        let mut torques = linear.multipliers[d.rows + d.drives..].iter();
        let mut worst = (Y::Scalar::ZERO, None);
        for (joint, &side) in self.system.sides.as_ref().iter().enumerate() {
            if side == Y::Scalar::ZERO {
                continue;
            }
            // A stop at the greatest angle pushes back.
            if let Some(&torque) = torques.next()
                && torque * side > worst.0
            {
                worst = (torque * side, Some(joint));
            }
        }
        if let Some(joint) = worst.1 {
            self.system.sides.as_mut()[joint] = Y::Scalar::ZERO;
        }
        Ok(worst.1.is_some())
    }

    /// Returns whether the potential is convex along the closure: the symmetric part of K + w is
    /// positive definite.
    fn curves_up(&mut self, freedoms: usize, weight: Y::Scalar) -> bool {
        let half = Y::Scalar::from_f64(0.5);
        let stiffness = &self.stiffness.as_ref()[..freedoms * freedoms];
        let matrix = &mut self.matrix.as_mut()[..freedoms * freedoms];
        for i in 0..freedoms {
            for k in 0..i {
                let sum = stiffness[i * freedoms + k] + stiffness[k * freedoms + i];
                matrix[i * freedoms + k] = half * sum;
            }
            matrix[i * freedoms + i] = stiffness[i * freedoms + i] + weight;
        }
        // NaN has no sign to wait for.
        !weight.is_finite() || factor(matrix, freedoms).is_ok()
    }
}
