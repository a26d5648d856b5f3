//! The equations of motion at a state, solved, and how the solution changes with t, q, u, parameters and
//! inputs: see [`jacobian`](crate::jacobian()).

use crate::acceleration::{blame, not_finite, write};
use crate::decomposition::Decomposition;
use crate::linear::{add_scaled, backward, dot, factor, forward, normalise, times_lower};
use crate::plumbing::{Balance, Drive, EquationsMut};
use crate::rank::{Fading, Gap};
use crate::rest::Forces;
use crate::workspace::{check, split};
use crate::{Arithmetic, Change, Error, Mechanism};

/// The equations of motion at a state with what is needed to differentiate their solution.
pub(crate) struct Linearised<'a, Y: Mechanism> {
    system: &'a Y,
    t: Y::Scalar,
    q: &'a [Y::Scalar],
    u: &'a [Y::Scalar],
    /// Factor of M.
    pub mass: &'a mut [Y::Scalar],
    /// Orthonormal rows that span those of J L^-T; those beyond `rank` are meaningless.
    rows: &'a mut [Y::Scalar],
    /// The matrix that transforms the rows of J L^-T into them, (C + D) x (C + D).
    turn: &'a mut [Y::Scalar],
    /// Independent rows.
    rank: usize,
    /// Whether a direction of the closure is weak.
    pub is_weak: bool,
    /// Whether it is so weak that derivatives are no longer accurate.
    pub is_rough: bool,
    pub acceleration: &'a mut [Y::Scalar],
    /// lambda, C, then what drives the driven joints, D, divided by the size.
    pub multipliers: &'a mut [Y::Scalar],
    rhs: &'a mut [Y::Scalar],
    turned: &'a mut [Y::Scalar],
    opening: &'a mut [Y::Scalar],
    force: &'a mut [Y::Scalar],
    parameters: &'a mut [Y::Scalar],
    inputs: &'a mut [Y::Scalar],
}

impl<'a, Y: Mechanism> Linearised<'a, Y> {
    pub fn at(
        system: &'a Y,
        t: Y::Scalar,
        q: &'a [Y::Scalar],
        u: &'a [Y::Scalar],
        mut workspace: &'a mut [Y::Scalar],
    ) -> Result<Self, Error> {
        let dimensions = check(system, workspace, &[q.len()], &[u.len()])?;
        let gap = Gap::at(system, q, workspace)?;
        let (n, m) = (dimensions.speeds, dimensions.rows + dimensions.drives);
        let mut linear = Self {
            system,
            t,
            q,
            u,
            mass: split(&mut workspace, n * n)?,
            rows: split(&mut workspace, m * n)?,
            turn: split(&mut workspace, m * m)?,
            rank: 0,
            is_weak: false,
            is_rough: false,
            acceleration: split(&mut workspace, n)?,
            multipliers: split(&mut workspace, m)?,
            rhs: split(&mut workspace, m)?,
            turned: split(&mut workspace, m)?,
            opening: split(&mut workspace, m)?,
            force: split(&mut workspace, n)?,
            parameters: split(&mut workspace, dimensions.parameters)?,
            inputs: split(&mut workspace, dimensions.inputs)?,
        };
        linear.parameters.fill(Y::Scalar::ZERO);
        linear.inputs.fill(Y::Scalar::ZERO);
        linear.solve_state(gap)?;
        Ok(linear)
    }

    fn solve_state(&mut self, gap: Gap<Y::Scalar>) -> Result<(), Error> {
        let (n, m) = (self.u.len(), self.rhs.len());
        let out = EquationsMut {
            mass: &mut *self.mass,
            forcing: &mut *self.force,
            jacobian: &mut *self.rows,
            gamma: &mut *self.opening,
        };
        write(self.system, self.t, self.q, self.u, out)?;
        factor(self.mass, n).map_err(|joint| blame(&[self.q, self.u], self.mass, joint))?;
        self.turn.fill(Y::Scalar::ZERO);
        for i in 0..m {
            self.turn[i * m + i] = Y::Scalar::ONE;
        }
        if m > 0 {
            let decomposition = Decomposition::of(self.system);
            let kept = decomposition.independent_units(self.rows, self.turn, [m, n], gap)?;
            let k = kept.rank;
            let (rows, turn) = (&mut self.rows[..k * n], &mut self.turn[..k * m]);
            decomposition.weigh(self.mass, rows, n);
            decomposition.orthogonalise(rows, turn, [k, n])?;
            normalise(rows, turn, n);
            let fading = Fading::of_rounding();
            self.rank = k;
            self.is_weak = gap.is_below(fading.weak, &kept);
            self.is_rough = gap.is_below(fading.rough, &kept);
        }
        forward(self.mass, self.force);
        self.constrain();
        self.acceleration.copy_from_slice(self.force);
        // lambda = Q^T c_i
        self.multipliers.fill(Y::Scalar::ZERO);
        for i in 0..self.rank {
            add_scaled(self.multipliers, self.turned[i], &self.turn[i * m..(i + 1) * m]);
        }
        match not_finite(&[self.q, self.u, self.acceleration]) {
            Some(joint) => Err(Error::NotFinite { joint }),
            None => Ok(()),
        }
    }

    /// Turns y = L^-1 f in `force` into the solution a of M a = f + J^T lambda, J a = -`opening`;
    /// leaves c_i in `turned`.
    fn constrain(&mut self) {
        let (n, m) = (self.force.len(), self.rhs.len());
        // B_i and B_k are orthogonal: what one adds to the solution does not touch the other.
        for (i, row) in self.rows.chunks_exact(n).take(self.rank).enumerate() {
            self.turned[i] =
                -dot(&self.turn[i * m..(i + 1) * m], self.opening) - dot(row, self.force);
        }
        for (row, &share) in self.rows.chunks_exact(n).take(self.rank).zip(&*self.turned) {
            add_scaled(self.force, share, row);
        }
        backward(self.mass, self.force);
    }

    /// Columns of da/dq and da/du, N x N, and da/dt.
    pub fn derivatives(
        &mut self,
        dq: &mut [Y::Scalar],
        du: &mut [Y::Scalar],
        dt: &mut [Y::Scalar],
    ) -> Result<(), Error> {
        let (zeros, mut unit) = (self.system.speeds(), self.system.speeds());
        let (zeros, unit) = (zeros.as_ref(), unit.as_mut());
        for joint in 0..zeros.len() {
            unit[joint] = Y::Scalar::ONE;
            self.column(unit, zeros, dq, joint)?;
            self.column(zeros, unit, du, joint)?;
            unit[joint] = Y::Scalar::ZERO;
        }
        self.by_time(zeros, zeros, dt)
    }

    /// As [`derivatives`](Self::derivatives), of the acceleration at the closed state that is
    /// nearest: a change of q or u counts as far as it goes along the closure, and u follows q,
    ///
    /// ```text
    /// J dq = 0        J du = -(dJ/dq dq) u
    /// ```
    ///
    /// At open states, the acceleration changes without bounds as a direction fades.
    pub fn derivatives_along_closure(
        &mut self,
        dq: &mut [Y::Scalar],
        du: &mut [Y::Scalar],
        dt: &mut [Y::Scalar],
    ) -> Result<(), Error> {
        let (zeros, mut along, mut turn) =
            (self.system.speeds(), self.system.speeds(), self.system.speeds());
        let (zeros, along, turn) = (zeros.as_ref(), along.as_mut(), turn.as_mut());
        for joint in 0..zeros.len() {
            along.fill(Y::Scalar::ZERO);
            along[joint] = Y::Scalar::ONE;
            self.leave_closure_out(along);
            self.follow(along, turn, |_| Y::Scalar::ZERO)?;
            self.column(along, turn, dq, joint)?;
            self.column(zeros, along, du, joint)?;
        }
        // Driven joints take the others with them.
        self.opening.fill(Y::Scalar::ZERO);
        self.prescribe(|drive| drive.speed);
        self.force.fill(Y::Scalar::ZERO);
        self.constrain();
        along.copy_from_slice(self.force);
        self.follow(along, turn, |drive| drive.acceleration)?;
        self.by_time(along, turn, dt)
    }

    /// The part of x along the closure, orthogonal in M to the rest.
    fn leave_closure_out(&self, x: &mut [Y::Scalar]) {
        let n = x.len();
        self.times_upper(x);
        for row in self.rows.chunks_exact(n).take(self.rank) {
            let share = -dot(x, row);
            add_scaled(x, share, row);
        }
        backward(self.mass, x);
    }

    /// How u changes as q changes along the closure, where a driven joint's speed changes by `rate`.
    fn follow(
        &mut self,
        along: &[Y::Scalar],
        turn: &mut [Y::Scalar],
        rate: impl Fn(Drive<Y::Scalar>) -> Y::Scalar,
    ) -> Result<(), Error> {
        let zeros = self.system.speeds();
        let rows = self.system.dimensions().rows;
        self.opening.fill(Y::Scalar::ZERO);
        // At rest gamma stays zero: with u in the place of du/dt, what changes of gamma + J du/dt is
        // (dJ/dq dq) u.
        let at = Balance {
            t: self.t,
            q: self.q,
            u: zeros.as_ref(),
            acceleration: self.u,
            multipliers: &self.multipliers[..rows],
        };
        let change = Change {
            q: along,
            u: zeros.as_ref(),
            parameters: self.parameters,
            inputs: self.inputs,
            ..Change::default()
        };
        self.system.write_tangent(at, change, self.force, &mut self.opening[..rows])?;
        self.prescribe(rate);
        self.force.fill(Y::Scalar::ZERO);
        self.constrain();
        turn.copy_from_slice(self.force);
        Ok(())
    }

    /// Column `joint` of a matrix becomes da for changes of q and u.
    fn column(
        &mut self,
        q: &[Y::Scalar],
        u: &[Y::Scalar],
        matrix: &mut [Y::Scalar],
        joint: usize,
    ) -> Result<(), Error> {
        let n = q.len();
        self.tangent(Y::Scalar::ZERO, q, u)?;
        self.differentiate();
        for (row, &value) in matrix.chunks_exact_mut(n).zip(&*self.force) {
            row[joint] = value;
        }
        Ok(())
    }

    /// da as time goes on and q and u change by this much per second.
    fn by_time(
        &mut self,
        q: &[Y::Scalar],
        u: &[Y::Scalar],
        out: &mut [Y::Scalar],
    ) -> Result<(), Error> {
        self.tangent(Y::Scalar::ONE, q, u)?;
        self.prescribe(|drive| drive.jerk);
        self.differentiate();
        out.copy_from_slice(self.force);
        Ok(())
    }

    /// Sets what driven joints follow, in the right-hand sides of J x = -`opening`.
    fn prescribe(&mut self, rate: impl Fn(Drive<Y::Scalar>) -> Y::Scalar) {
        let rows = self.system.dimensions().rows;
        let mut openings = self.opening[rows..].iter_mut();
        self.system.drives(self.t, |drive| {
            if let Some(opening) = openings.next() {
                *opening = -self.system.size() * rate(drive);
            }
        });
    }

    /// da in the direction of a change.
    pub fn along(
        &mut self,
        change: Change<'_, Y::Scalar>,
        out: &mut [Y::Scalar],
    ) -> Result<(), Error> {
        let rows = self.system.dimensions().rows;
        self.opening.fill(Y::Scalar::ZERO);
        let at = Balance {
            t: self.t,
            q: self.q,
            u: self.u,
            acceleration: self.acceleration,
            multipliers: &self.multipliers[..rows],
        };
        self.system.write_tangent(at, change, self.force, &mut self.opening[..rows])?;
        self.differentiate();
        out.copy_from_slice(self.force);
        Ok(())
    }

    /// Right-hand sides in `force` and `opening` for a change of t, q and u.
    fn tangent(&mut self, t: Y::Scalar, q: &[Y::Scalar], u: &[Y::Scalar]) -> Result<(), Error> {
        let rows = self.system.dimensions().rows;
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
        )
    }

    fn differentiate(&mut self) {
        forward(self.mass, self.force);
        self.constrain();
    }

    /// The generalised forces with a and lambda of the state.
    pub fn forces(&mut self) -> Forces<'_, Y> {
        let rows = self.system.dimensions().rows;
        let Self { system, t, q, u, .. } = *self;
        let multipliers = &self.multipliers[..rows];
        Forces {
            system,
            at: Balance { t, q, u, acceleration: self.acceleration, multipliers },
            parameters: self.parameters,
            inputs: self.inputs,
            force: self.force,
            opening: &mut self.opening[..rows],
        }
    }

    /// Directions of q along the constraints, orthonormal in M: N numbers each, one after the
    /// other in `basis` (N x N). Returns how many there are.
    pub fn tangent_basis(&mut self, basis: &mut [Y::Scalar]) -> usize {
        let n = self.u.len();
        let rows = &self.rows[..self.rank * n];
        // The part of each unit vector that lies in the known basis, squared.
        let taken = &mut *self.force;
        taken.fill(Y::Scalar::ZERO);
        let take = |taken: &mut [Y::Scalar], v: &[Y::Scalar]| {
            taken.iter_mut().zip(v).for_each(|(taken, &x)| *taken += x * x);
        };
        rows.chunks_exact(n.max(1)).for_each(|row| take(taken, row));
        let mut found = 0;
        while found + self.rank < n {
            // The next vector is the unit vector with the smallest part in the known basis, minus
            // that part.
            let (known, free) = basis.split_at_mut(found * n);
            let mut best = 0;
            for k in 1..n {
                if taken[k] < taken[best] {
                    best = k;
                }
            }
            let vector = &mut free[..n];
            vector.fill(Y::Scalar::ZERO);
            vector[best] = Y::Scalar::ONE;
            // Twice is enough (W. Kahan).
            for _ in 0..2 {
                for other in rows.chunks_exact(n).chain(known.chunks_exact(n)) {
                    let part = dot(vector, other);
                    add_scaled(vector, -part, other);
                }
            }
            let length = dot(vector, vector).sqrt();
            for value in vector.iter_mut() {
                *value = *value / length;
            }
            take(taken, vector);
            found += 1;
        }
        for vector in basis[..found * n].chunks_exact_mut(n.max(1)) {
            backward(self.mass, vector);
        }
        found
    }

    /// `x = L^T x`. The factor's diagonal is inverse.
    fn times_upper(&self, x: &mut [Y::Scalar]) {
        let n = x.len();
        for i in 0..n {
            let below =
                (i + 1..n).fold(Y::Scalar::ZERO, |sum, k| sum + self.mass[k * n + i] * x[k]);
            x[i] = x[i] / self.mass[i * n + i] + below;
        }
    }

    /// `x = M x`.
    pub fn times_mass(&self, x: &mut [Y::Scalar]) {
        self.times_upper(x);
        times_lower(self.mass, x);
    }
}
