//! The derivatives of F = (u, a(t, q, u)) for a step of an implicit integrator, and the system of equations of a stage.
//!
//! ```text
//! W k = r,    W = 1 / ahead - dF/dy,    ahead = h gamma
//! (1 / ahead - da/du - ahead da/dq) k_u = r_u + ahead da/dq r_q,    k_q = ahead (r_q + k_u)
//! ```
//!
//! Of a mechanism of few freedoms d, whose own elimination finds the speeds along the closure that are nearest in the
//! metric of M, P v, the stages take a at the nearest closed state. It changes along the closure only. With an orthonormal basis T of
//! that, P = T T^T P, and
//!
//! ```text
//! da/dq = Q T^T P,    da/du = U T^T P,    G = U + ahead Q
//! k_u = ahead (r + G z),    (1 / ahead - T^T P G) z = T^T P r,    r = r_u + ahead Q T^T P r_q
//! ```
//!
//! so that a matrix of d x d is factored instead of N x N, and Q and U have d columns. These are central differences of what
//! the stages evaluate. Driven joints and those held at stops are conditions as the rows of J are: P v lets them stand still.

use core::fmt;

use super::{Stabilisation, accelerate_beside};
use crate::constants::{ORTHOGONAL_PASSES, Tolerance};
use crate::jacobian::{Differentiated, differentiate};
use crate::linear::{add_scaled, copy, dot, max_abs, reflect, set_scaled, solve};
use crate::noise::noise;
use crate::plumbing::Dimensions;
use crate::projection::{AlongClosure, is_in_code};
use crate::rank::Fading;
use crate::trust::Trust;
use crate::{
    Arithmetic, Error, JacobianMut, Mechanism, Scalar, StateOf, acceleration,
    acceleration_in_motion,
};

/// Half the distance of two states whose difference gives a derivative, rad, and rad/s for each rad/s: about the third root of
/// rounding, where what it takes is as much as what the difference leaves out.
const BESIDE: Tolerance = Tolerance { constant: 6e-6, epsilons: 4e4 };
/// The same in time, as a share of a step.
const SHARE_OF_STEP: f64 = 1e-3;
/// Joints for each freedom from which derivatives are taken along the closure, where the runtime eliminates it: so few columns cost less
/// than a dense matrix. Of Yoshimura's pattern, 6 x 6 pairs of triangles have 4.6, 8 x 8 have 6.1.
const JOINTS_OF_FREEDOM: usize = 5;
/// The same where straight-line code projects: in the metric of whole bodies, while dense derivatives have that of M. With fewer, a dense
/// matrix would not have the room.
const JOINTS_OF_FREEDOM_IN_CODE: usize = 3;

/// Where the acceleration of a stage is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// At its state.
    Given,
    /// Next to a singular state at the nearest closed state.
    ClosedIfWeak,
    /// At the nearest closed state.
    Closed,
}

impl Place {
    /// du/dt at a state of a stage, or beside it.
    pub fn accelerate<Y: Mechanism>(
        self,
        system: &Y,
        state: &StateOf<Y>,
        workspace: &mut Y::Workspace,
        out: &mut Y::Speeds,
    ) -> Result<(), Error> {
        let StateOf::<Y> { t, q, u } = state;
        match self {
            Self::Closed => accelerate_beside(system, (*t, q, u), workspace.as_mut(), out.as_mut()),
            Self::ClosedIfWeak => {
                let none = Y::Scalar::ZERO;
                Stabilisation::Projection.accelerate(system, none, (*t, q, u), workspace, out)
            }
            Self::Given => {
                let (q, u, out) = (q.as_ref(), u.as_ref(), out.as_mut());
                acceleration(system, *t, q, u, workspace.as_mut(), out).map(|_| ())
            }
        }
    }
}

fn joints_of_freedom<Y: Mechanism>(system: &Y) -> usize {
    if is_in_code(system) { JOINTS_OF_FREEDOM_IN_CODE } else { JOINTS_OF_FREEDOM }
}

/// Derivatives at a state, and the matrix of a step.
#[derive(Clone)]
pub(super) struct Derivatives<Y: Mechanism> {
    /// da/dq, by rows; or the columns of Q.
    by_position: Y::Matrix,
    /// da/du; or the columns of U.
    by_speed: Y::Matrix,
    /// da/dt.
    pub by_time: Y::Speeds,
    /// a.
    pub acceleration: Y::Speeds,
    /// W of k_u, factored; or the columns of T, T^T P Q and T^T P U by columns, and the same of z.
    matrix: Y::Matrix,
    diagonal: Y::Speeds,
    pub place: Place,
    /// d, where the derivatives are along the closure.
    freedoms: Option<usize>,
}

impl<Y: Mechanism> fmt::Debug for Derivatives<Y> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, freedoms, .. } = self;
        f.debug_struct("Derivatives")
            .field("place", place)
            .field("freedoms", freedoms)
            .finish_non_exhaustive()
    }
}

impl<Y: Mechanism> Derivatives<Y> {
    pub fn new(system: &Y) -> Self {
        Self {
            by_position: system.matrix(),
            by_speed: system.matrix(),
            by_time: system.speeds(),
            acceleration: system.speeds(),
            matrix: system.matrix(),
            diagonal: system.speeds(),
            place: Place::Given,
            freedoms: None,
        }
    }

    /// The derivatives at a closed state, for a step of about this length (s); returns whether rounding has taken their digits.
    pub fn at(
        &mut self,
        system: &Y,
        state: &StateOf<Y>,
        step: Y::Scalar,
        workspace: &mut Y::Workspace,
    ) -> Result<bool, Error> {
        let Dimensions { speeds: n, drives, rows, rank, .. } = system.dimensions();
        self.freedoms = None;
        // Of driven joints, some may follow from others.
        let least = n.saturating_sub(rank + drives);
        if n > rank
            && least * joints_of_freedom(system) <= n
            && let Some((d, is_rough)) = self.along_closure(system, state, workspace)?
        {
            self.by_time(system, state, step, workspace)?;
            self.freedoms = Some(d);
            self.place = Place::Closed;
            return Ok(is_rough);
        }
        let out = JacobianMut {
            acceleration: self.acceleration.as_mut(),
            dq: self.by_position.as_mut(),
            du: self.by_speed.as_mut(),
            dt: self.by_time.as_mut(),
        };
        let (q, u) = (state.q.as_ref(), state.u.as_ref());
        let found = differentiate(system, state.t, q, u, true, workspace.as_mut(), out)?;
        self.place = match found {
            Differentiated::Given => Place::Given,
            _ if rank < rows => Place::Closed,
            _ => Place::ClosedIfWeak,
        };
        Ok(found == Differentiated::Rough)
    }

    /// a, its derivatives along the closure, and T; returns the number of freedoms, and whether rounding has taken digits. Nothing where
    /// elimination cannot be trusted, or leaves too many freedoms.
    fn along_closure(
        &mut self,
        system: &Y,
        state: &StateOf<Y>,
        workspace: &mut Y::Workspace,
    ) -> Result<Option<(usize, bool)>, Error> {
        let n = system.dimensions().speeds;
        let (t, q, u) = (state.t, state.q.as_ref(), state.u.as_ref());
        let Some((d, is_rough)) = self.basis(system, state, workspace)? else { return Ok(None) };
        acceleration_in_motion(system, t, q, u, workspace.as_mut(), self.acceleration.as_mut())?;
        let (basis, products) = self.matrix.as_mut().split_at_mut(d * n);
        let mut direction = system.speeds();
        for (k, v) in basis.chunks_exact(n).enumerate() {
            copy(direction.as_mut(), v)?;
            let column = k * n..(k + 1) * n;
            let by_position = &mut self.by_position.as_mut()[column.clone()];
            let by_speed = &mut self.by_speed.as_mut()[column];
            differences(system, state, &direction, workspace, [by_position, by_speed])?;
        }
        let mut along = AlongClosure::of(system, workspace.as_mut())?;
        let columns = [self.by_position.as_ref(), self.by_speed.as_ref()];
        let columns = columns.into_iter().flat_map(|matrix| matrix.chunks_exact(n).take(d));
        for (column, product) in columns.zip(products.chunks_exact_mut(d.max(1))) {
            let v = direction.as_mut();
            copy(v, column)?;
            if along.nearest(system, (t, q, v))? == Trust::Doubtful {
                return Ok(None);
            }
            for (product, basis) in product.iter_mut().zip(basis.chunks_exact(n)) {
                *product = dot(basis, v);
            }
        }
        Ok(Some((d, is_rough)))
    }

    /// T; returns as [`along_closure`](Self::along_closure) does.
    fn basis(
        &mut self,
        system: &Y,
        state: &StateOf<Y>,
        workspace: &mut Y::Workspace,
    ) -> Result<Option<(usize, bool)>, Error> {
        let Dimensions { speeds: n, rank, .. } = system.dimensions();
        let rough = Fading::of_rounding().rough;
        let mut along = AlongClosure::of(system, workspace.as_mut())?;
        let mut direction = system.speeds();
        let (mut d, mut k, mut is_rough) = (n - rank, 0, false);
        while k < d {
            let v = direction.as_mut();
            v.iter_mut().enumerate().for_each(|(joint, v)| *v = noise(k, joint));
            let trust = along.nearest(system, (state.t, state.q.as_ref(), v))?;
            is_rough |= matches!(trust, Trust::Weak(pivot) if pivot < rough);
            d = n - along.conditions(system);
            if trust == Trust::Doubtful || d * joints_of_freedom(system) > n {
                return Ok(None);
            }
            let (basis, rest) = self.matrix.as_mut().split_at_mut(k * n);
            if d > 0 && !orthonormalise(basis, v) {
                return Ok(None);
            }
            copy(&mut rest[..n], v)?;
            k += 1;
        }
        Ok(Some((d, is_rough)))
    }

    /// da/dt, by differences.
    fn by_time(
        &mut self,
        system: &Y,
        state: &StateOf<Y>,
        step: Y::Scalar,
        workspace: &mut Y::Workspace,
    ) -> Result<(), Error> {
        let half = Y::Scalar::from_f64(SHARE_OF_STEP) * step;
        let (out, mut at) = (self.by_time.as_mut(), system.speeds());
        out.fill(Y::Scalar::ZERO);
        let [before, after] = [state.t - half, state.t + half];
        for (sign, t) in [(-Y::Scalar::ONE, before), (Y::Scalar::ONE, after)] {
            // Driven joints are elsewhere then.
            accelerate_beside(system, (t, &state.q, &state.u), workspace.as_mut(), at.as_mut())?;
            add_scaled(out, sign / (after - before), at.as_ref());
        }
        Ok(())
    }

    /// Factors W of a step; returns whether it is regular.
    pub fn factor(&mut self, ahead: Y::Scalar) -> bool {
        let Self { by_position, by_speed, matrix, diagonal, freedoms, .. } = self;
        let (matrix, diagonal) = (matrix.as_mut(), diagonal.as_mut());
        let n = diagonal.len();
        let (by_position, by_speed, matrix, diagonal) = match *freedoms {
            None => (by_position.as_ref(), by_speed.as_ref(), matrix, diagonal),
            Some(d) => {
                let (by_position, rest) = matrix[d * n..].split_at_mut(d * d);
                let (by_speed, matrix) = rest.split_at_mut(d * d);
                (&*by_position, &*by_speed, &mut matrix[..d * d], &mut diagonal[..d])
            }
        };
        let n = diagonal.len();
        for (i, entry) in matrix.iter_mut().enumerate() {
            let (row, column) = (i / n, i % n);
            // Products are by columns.
            let from = if freedoms.is_some() { column * n + row } else { i };
            *entry = -by_speed[from] - ahead * by_position[from];
            if row == column {
                *entry += Y::Scalar::ONE / ahead;
            }
        }
        reflect(matrix, diagonal)
    }

    /// The right-hand sides of a stage, r, become its solution, at (t, q); N numbers of `room` are lost. Derivatives that were taken further
    /// along the motion may know the closure where (t, q) does not: then r is not projected, which the error of the step shows.
    pub fn solve(
        &self,
        (system, t, q): (&Y, Y::Scalar, &[Y::Scalar]),
        ahead: Y::Scalar,
        [position, speed]: [&mut [Y::Scalar]; 2],
        room: &mut [Y::Scalar],
        workspace: &mut Y::Workspace,
    ) -> Result<(), Error> {
        let n = speed.len();
        let (matrix, diagonal) = (self.matrix.as_ref(), self.diagonal.as_ref());
        let by_position = self.by_position.as_ref().chunks_exact(n.max(1));
        if let Some(d) = self.freedoms {
            let by_speed = self.by_speed.as_ref().chunks_exact(n.max(1));
            let (basis, rest) = matrix.split_at(d * n);
            let mut z = system.speeds();
            let z = &mut z.as_mut()[..d];
            let mut along = AlongClosure::of(system, workspace.as_mut())?;
            let mut coordinates = |x: &[Y::Scalar], z: &mut [Y::Scalar]| {
                copy(room, x)?;
                along.nearest(system, (t, q, &mut *room))?;
                z.iter_mut().zip(basis.chunks_exact(n)).for_each(|(z, row)| *z = dot(row, room));
                Ok::<_, Error>(())
            };
            coordinates(position, z)?;
            for (column, &z) in by_position.clone().zip(&*z) {
                add_scaled(speed, ahead * z, column);
            }
            coordinates(speed, z)?;
            solve(&rest[2 * d * d..3 * d * d], &diagonal[..d], z);
            for ((by_position, by_speed), &z) in by_position.zip(by_speed).zip(&*z) {
                add_scaled(speed, ahead * z, by_position);
                add_scaled(speed, z, by_speed);
            }
            speed.iter_mut().for_each(|speed| *speed *= ahead);
        } else {
            for (value, row) in speed.iter_mut().zip(by_position) {
                *value += ahead * dot(row, position);
            }
            solve(matrix, diagonal, speed);
        }
        for (position, &speed) in position.iter_mut().zip(&*speed) {
            *position = ahead * (*position + speed);
        }
        Ok(())
    }
}

/// Takes from v what lies along the vectors of an orthonormal basis, and makes it as long as they are; returns whether half of its digits
/// are left.
fn orthonormalise<S: Scalar>(basis: &[S], v: &mut [S]) -> bool {
    let given = dot(v, v).sqrt();
    for _ in 0..ORTHOGONAL_PASSES {
        for other in basis.chunks_exact(v.len().max(1)) {
            let share = dot(v, other);
            add_scaled(v, -share, other);
        }
    }
    let length = dot(v, v).sqrt();
    v.iter_mut().for_each(|v| *v = *v / length);
    length > given * S::EPSILON.sqrt()
}

/// Differences of the acceleration at the nearest closed state: as q moves along a direction on the closure, and as u does.
fn differences<Y: Mechanism>(
    system: &Y,
    state: &StateOf<Y>,
    direction: &Y::Speeds,
    workspace: &mut Y::Workspace,
    [by_position, by_speed]: [&mut [Y::Scalar]; 2],
) -> Result<(), Error> {
    let mut out = system.speeds();
    let half = BESIDE.of::<Y::Scalar>() / max_abs(direction.as_ref());
    let of_speed = half * (Y::Scalar::ONE + max_abs(state.u.as_ref()));
    by_position.fill(Y::Scalar::ZERO);
    by_speed.fill(Y::Scalar::ZERO);
    for sign in [-Y::Scalar::ONE, Y::Scalar::ONE] {
        let (mut q, mut step) = (state.q.clone(), system.speeds());
        set_scaled(step.as_mut(), sign * half, direction.as_ref());
        system.advance(q.as_mut(), step.as_ref());
        accelerate_beside(system, (state.t, &q, &state.u), workspace.as_mut(), out.as_mut())?;
        add_scaled(by_position, sign / (half + half), out.as_ref());

        let mut u = state.u.clone();
        add_scaled(u.as_mut(), sign * of_speed, direction.as_ref());
        let (q, u) = (state.q.as_ref(), u.as_ref());
        acceleration_in_motion(system, state.t, q, u, workspace.as_mut(), out.as_mut())?;
        add_scaled(by_speed, sign / (of_speed + of_speed), out.as_ref());
    }
    Ok(())
}
