//! Derivatives of the constrained acceleration, by implicit differentiation.
//!
//! M a = f + J^T lambda and J a = -gamma hold at every state. In any direction of t, q, u,
//!
//! ```text
//! M da - J^T dlambda = d(f - M a + J^T lambda)    at constant a and lambda
//! J da               = -d(gamma + J a)
//! ```
//!
//! which has the matrix of the acceleration itself: its factors serve for all directions. The
//! right-hand sides come from [`System::write_tangent`].
//!
//! Where closure equations are redundant this is the derivative along the closure; directions that
//! open a loop are followed with the rank as it is.

use crate::acceleration::{blame, holds, not_finite, plain, weigh, write};
use crate::linear::{Spectrum, add_scaled, backward, dot, factor, forward, orthogonalise};
use crate::workspace::{check, split};
use crate::{Arithmetic, Balance, Change, Dimensions, EquationsMut, Error, System};

/// Where [`jacobian`] writes. Matrices are N x N, row-major.
#[derive(Debug)]
pub struct JacobianMut<'a, S> {
    /// a = du/dt at the state itself, N, rad/s^2.
    pub acceleration: &'a mut [S],
    /// da/dq, 1/s^2.
    pub dq: &'a mut [S],
    /// da/du, 1/s.
    pub du: &'a mut [S],
    /// da/dt, N, rad/s^3.
    pub dt: &'a mut [S],
}

/// du/dt and its derivatives by q, u and t.
///
/// # Errors
///
/// As [`acceleration`](crate::acceleration()).
pub fn jacobian<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: JacobianMut<'_, Y::Scalar>,
) -> Result<(), Error> {
    jacobian_within(system, t, q, u, plain(), workspace, out).map(|_| ())
}

/// As [`jacobian`], with this spectrum. Returns whether it keeps a direction of the closure that the
/// plain one drops.
pub(crate) fn jacobian_within<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    spectrum: Spectrum<Y::Scalar>,
    workspace: &mut [Y::Scalar],
    mut out: JacobianMut<'_, Y::Scalar>,
) -> Result<bool, Error> {
    let Dimensions { coordinates: n, drives, .. } = system.dimensions();
    if drives == 0 {
        let JacobianMut { acceleration, dq, du, dt } = &mut out;
        let slices = JacobianMut { acceleration, dq, du, dt };
        let margin = system.write_jacobian(t, q, u, slices);
        if holds(&margin) && not_finite(&[out.acceleration, out.dq, out.du, out.dt]).is_none() {
            return Ok(false);
        }
    }
    let mut linear = Linearised::at(system, t, q, u, spectrum, workspace)?;
    out.acceleration.copy_from_slice(linear.acceleration);
    linear.derivatives(out.dq, out.du, out.dt);
    let loose = linear.is_loose();
    let JacobianMut { dq, du, dt, .. } = out;
    match not_finite(&[dq, du, dt]) {
        Some(index) => Err(Error::NotFinite { joint: index % n }),
        None => Ok(loose),
    }
}

/// du/dt and its derivatives along some directions of q, u, the parameters and the inputs: N
/// numbers in `out` for du/dt itself, and N for each change, 1/s^2 per unit of it. Prescribed angles
/// stay as they are.
///
/// # Errors
///
/// As [`acceleration`](crate::acceleration()); [`Error::Length`] of an `out` of another length.
pub fn derivatives_along<'c, Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    changes: impl ExactSizeIterator<Item = Change<'c, Y::Scalar>>,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<(), Error>
where
    Y::Scalar: 'c,
{
    let n = system.dimensions().coordinates;
    let (expected, given) = (n * (1 + changes.len()), out.len());
    if expected != given {
        return Err(Error::Length { expected, given });
    }
    let mut linear = Linearised::at(system, t, q, u, plain(), workspace)?;
    let (acceleration, derivatives) = out.split_at_mut(n);
    acceleration.copy_from_slice(linear.acceleration);
    for (change, derivative) in changes.zip(derivatives.chunks_exact_mut(n.max(1))) {
        linear.along(change, derivative);
    }
    match not_finite(&[out]) {
        Some(index) => Err(Error::NotFinite { joint: index % n }),
        None => Ok(()),
    }
}

/// The equations of motion at a state, solved, with everything needed to differentiate them.
pub(crate) struct Linearised<'a, Y: System> {
    system: &'a Y,
    t: Y::Scalar,
    q: &'a [Y::Scalar],
    u: &'a [Y::Scalar],
    spectrum: Spectrum<Y::Scalar>,
    /// Factor of M.
    pub mass: &'a mut [Y::Scalar],
    /// Orthogonal rows of J L^-T; those beyond `kept` are meaningless.
    pub rows: &'a mut [Y::Scalar],
    /// What made them orthogonal, (C + D) x (C + D).
    turn: &'a mut [Y::Scalar],
    /// Orthogonal rows.
    kept: usize,
    pub acceleration: &'a mut [Y::Scalar],
    /// lambda, C, then what drives the driven joints, D, divided by the size.
    pub multipliers: &'a mut [Y::Scalar],
    rhs: &'a mut [Y::Scalar],
    turned: &'a mut [Y::Scalar],
    opening: &'a mut [Y::Scalar],
    force: &'a mut [Y::Scalar],
    zeros: &'a mut [Y::Scalar],
    direction: &'a mut [Y::Scalar],
    parameters: &'a mut [Y::Scalar],
    inputs: &'a mut [Y::Scalar],
}

impl<'a, Y: System> Linearised<'a, Y> {
    pub fn at(
        system: &'a Y,
        t: Y::Scalar,
        q: &'a [Y::Scalar],
        u: &'a [Y::Scalar],
        spectrum: Spectrum<Y::Scalar>,
        mut workspace: &'a mut [Y::Scalar],
    ) -> Result<Self, Error> {
        let dimensions = check(system, workspace, &[q.len(), u.len()])?;
        let (n, m) = (dimensions.coordinates, dimensions.rows + dimensions.drives);
        let mut linear = Self {
            system,
            t,
            q,
            u,
            spectrum,
            mass: split(&mut workspace, n * n)?,
            rows: split(&mut workspace, m * n)?,
            turn: split(&mut workspace, m * m)?,
            kept: 0,
            acceleration: split(&mut workspace, n)?,
            multipliers: split(&mut workspace, m)?,
            rhs: split(&mut workspace, m)?,
            turned: split(&mut workspace, m)?,
            opening: split(&mut workspace, m)?,
            force: split(&mut workspace, n)?,
            zeros: split(&mut workspace, n)?,
            direction: split(&mut workspace, n)?,
            parameters: split(&mut workspace, dimensions.parameters)?,
            inputs: split(&mut workspace, dimensions.inputs)?,
        };
        for zeros in [&mut *linear.zeros, linear.direction, linear.parameters, linear.inputs] {
            zeros.fill(Y::Scalar::ZERO);
        }
        linear.solve_state()?;
        Ok(linear)
    }

    fn solve_state(&mut self) -> Result<(), Error> {
        let (n, m) = (self.q.len(), self.rhs.len());
        let out = EquationsMut {
            mass: &mut *self.mass,
            forcing: &mut *self.force,
            jacobian: &mut *self.rows,
            gamma: &mut *self.opening,
        };
        write(self.system, self.t, self.q, self.u, out);
        factor(self.mass, n).map_err(|joint| blame(&[self.q, self.u], self.mass, joint))?;
        weigh(self.mass, self.rows, n);
        self.turn.fill(Y::Scalar::ZERO);
        for i in 0..m {
            self.turn[i * m + i] = Y::Scalar::ONE;
        }
        self.kept = orthogonalise(self.rows, self.turn, m, n);
        forward(self.mass, self.force);
        self.constrain();
        self.acceleration.copy_from_slice(self.force);
        // lambda = (W W^T)^+ r = Q^T (c_i / |B_i|^2)
        self.multipliers.fill(Y::Scalar::ZERO);
        for i in 0..self.kept {
            add_scaled(self.multipliers, self.turned[i], &self.turn[i * m..(i + 1) * m]);
        }
        match not_finite(&[self.q, self.u, self.acceleration]) {
            Some(joint) => Err(Error::NotFinite { joint }),
            None => Ok(()),
        }
    }

    /// Turns y = L^-1 f in `force` into the solution a of M a = f + J^T lambda, J a = -`opening`;
    /// leaves c_i / |B_i|^2 in `turned`.
    fn constrain(&mut self) {
        let (n, m) = (self.force.len(), self.rhs.len());
        let row = |rows: &[Y::Scalar], i: usize| -> Y::Scalar {
            dot(&rows[i * n..(i + 1) * n], &rows[i * n..(i + 1) * n])
        };
        let largest = (0..self.kept).fold(Y::Scalar::ZERO, |most, i| most.max(row(self.rows, i)));
        let cut = self.spectrum.cut * largest;
        // B_i and B_k are orthogonal: what one adds to the solution does not touch the other.
        for i in 0..self.kept {
            let square = row(self.rows, i);
            let wanted = -dot(&self.turn[i * m..(i + 1) * m], self.opening)
                - dot(&self.rows[i * n..(i + 1) * n], self.force);
            // Written so that NaN is kept and seen.
            self.turned[i] = if square <= cut { Y::Scalar::ZERO } else { wanted / square };
        }
        for i in 0..self.kept {
            add_scaled(self.force, self.turned[i], &self.rows[i * n..(i + 1) * n]);
        }
        backward(self.mass, self.force);
    }

    /// Whether a direction is kept that the plain spectrum drops.
    fn is_loose(&self) -> bool {
        let n = self.q.len();
        let square = |i: usize| {
            let row = &self.rows[i * n..(i + 1) * n];
            dot(row, row)
        };
        let largest = (0..self.kept).fold(Y::Scalar::ZERO, |most, i| most.max(square(i)));
        let cut = |spectrum: Spectrum<Y::Scalar>| spectrum.cut * largest;
        (0..self.kept).any(|i| square(i) > cut(self.spectrum) && square(i) <= cut(plain()))
    }

    /// Columns of da/dq and da/du, N x N, and da/dt.
    pub fn derivatives(
        &mut self,
        dq: &mut [Y::Scalar],
        du: &mut [Y::Scalar],
        dt: &mut [Y::Scalar],
    ) {
        let n = self.q.len();
        for joint in 0..n {
            self.direction[joint] = Y::Scalar::ONE;
            for (by_speed, matrix) in [(false, &mut *dq), (true, &mut *du)] {
                self.tangent(Y::Scalar::ZERO, by_speed);
                self.differentiate();
                for i in 0..n {
                    matrix[i * n + joint] = self.force[i];
                }
            }
            self.direction[joint] = Y::Scalar::ZERO;
        }
        self.tangent(Y::Scalar::ONE, false);
        let rows = self.system.dimensions().rows;
        let mut openings = self.opening[rows..].iter_mut();
        self.system.drives(self.t, |drive| {
            if let Some(opening) = openings.next() {
                *opening = -self.system.size() * drive.jerk;
            }
        });
        self.differentiate();
        dt.copy_from_slice(self.force);
    }

    /// da in the direction of an input.
    pub fn by_input(&mut self, input: usize, out: &mut [Y::Scalar]) {
        self.inputs[input] = Y::Scalar::ONE;
        self.tangent(Y::Scalar::ZERO, false);
        self.inputs[input] = Y::Scalar::ZERO;
        self.differentiate();
        out.copy_from_slice(self.force);
    }

    /// da in the direction of a change.
    fn along(&mut self, change: Change<'_, Y::Scalar>, out: &mut [Y::Scalar]) {
        let rows = self.system.dimensions().rows;
        self.opening.fill(Y::Scalar::ZERO);
        let at = Balance {
            t: self.t,
            q: self.q,
            u: self.u,
            acceleration: self.acceleration,
            multipliers: &self.multipliers[..rows],
        };
        self.system.write_tangent(at, change, self.force, &mut self.opening[..rows]);
        self.differentiate();
        out.copy_from_slice(self.force);
    }

    /// Right-hand sides in `force` and `opening` for a change of t and of q or u along
    /// `direction`.
    fn tangent(&mut self, t: Y::Scalar, by_speed: bool) {
        let rows = self.system.dimensions().rows;
        let (q, u) = match by_speed {
            true => (&*self.zeros, &*self.direction),
            false => (&*self.direction, &*self.zeros),
        };
        self.opening.fill(Y::Scalar::ZERO);
        self.system.write_tangent(
            Balance {
                t: self.t,
                q: self.q,
                u: self.u,
                acceleration: self.acceleration,
                multipliers: &self.multipliers[..rows],
            },
            Change { t, q, u, parameters: self.parameters, inputs: self.inputs },
            self.force,
            &mut self.opening[..rows],
        );
    }

    fn differentiate(&mut self) {
        forward(self.mass, self.force);
        self.constrain();
    }

    /// Only da/dq, N x N.
    pub fn by_position(&mut self, dq: &mut [Y::Scalar]) {
        let n = self.q.len();
        for joint in 0..n {
            self.direction[joint] = Y::Scalar::ONE;
            self.tangent(Y::Scalar::ZERO, false);
            self.direction[joint] = Y::Scalar::ZERO;
            self.differentiate();
            for i in 0..n {
                dq[i * n + joint] = self.force[i];
            }
        }
    }

    /// Directions of q along the constraints, orthonormal in M: N numbers each, one after the
    /// other in `basis` (N x N). Returns how many there are.
    pub fn tangent_basis(&self, basis: &mut [Y::Scalar]) -> usize {
        let n = self.q.len();
        let row = |i: usize| &self.rows[i * n..(i + 1) * n];
        let largest = (0..self.kept).fold(Y::Scalar::ZERO, |most, i| most.max(dot(row(i), row(i))));
        let cut = self.spectrum.cut * largest;
        let mut found = 0;
        let rank = (0..self.kept).filter(|&i| !(dot(row(i), row(i)) <= cut)).count();
        while found + rank < n {
            // Of the unit vectors, the one that is least in what is known, less its part there.
            let (known, free) = basis.split_at_mut(found * n);
            let left = |k: usize| {
                let taken = |v: &[Y::Scalar]| v[k] * v[k] / dot(v, v);
                let rows = (0..self.kept)
                    .filter(|&i| !(dot(row(i), row(i)) <= cut))
                    .fold(Y::Scalar::ZERO, |sum, i| sum + taken(row(i)));
                known.chunks_exact(n).fold(rows, |sum, v| sum + taken(v))
            };
            let mut best = 0;
            for k in 1..n {
                if left(k) < left(best) {
                    best = k;
                }
            }
            let vector = &mut free[..n];
            vector.fill(Y::Scalar::ZERO);
            vector[best] = Y::Scalar::ONE;
            // Twice is enough (W. Kahan).
            for _ in 0..2 {
                for i in (0..self.kept).filter(|&i| !(dot(row(i), row(i)) <= cut)) {
                    let part = dot(vector, row(i)) / dot(row(i), row(i));
                    add_scaled(vector, -part, row(i));
                }
                for other in known.chunks_exact(n) {
                    let part = dot(vector, other);
                    add_scaled(vector, -part, other);
                }
            }
            let length = dot(vector, vector).sqrt();
            for value in vector.iter_mut() {
                *value = *value / length;
            }
            found += 1;
        }
        for vector in basis[..found * n].chunks_exact_mut(n.max(1)) {
            backward(self.mass, vector);
        }
        found
    }

    /// `x = M x`.
    pub fn times_mass(&self, x: &mut [Y::Scalar]) {
        let n = x.len();
        // The factor's diagonal is inverse. L^T x, from the top; then L, from the bottom.
        for i in 0..n {
            let below =
                (i + 1..n).fold(Y::Scalar::ZERO, |sum, k| sum + self.mass[k * n + i] * x[k]);
            x[i] = x[i] / self.mass[i * n + i] + below;
        }
        for i in (0..n).rev() {
            x[i] = x[i] / self.mass[i * n + i] + dot(&self.mass[i * n..i * n + i], &x[..i]);
        }
    }
}
