//! The steps of an assembly: closing the loops, and sliding along the closure.

use super::Search;
use crate::constants::{
    CLOSING_STEPS, CLOSING_TRIALS, DAMPING_DECREASE, DAMPING_INCREASE, DAMPING_RESTART,
    FIRST_DAMPING, LEAST_DAMPING, LONGEST_SLIDE, LONGEST_STEP, SHORTEST_SLIDE, SINGULAR_INCREASE,
    SLIDING_DAMPING, SLIDING_DECREASE, SLIDING_STEPS, SLIDING_TRIALS, SLOW_RATIO, SLOW_STEPS,
};
use crate::linear::{add_scaled, backward, dot, factor, forward, max_abs, set_scaled};
use crate::rank::closed;
use crate::{Arithmetic, Mechanism, Scalar};

impl<Y: Mechanism> Search<'_, Y> {
    /// Levenberg-Marquardt from q. Leaves residual and Jacobian at the final q.
    pub(super) fn close(&mut self, q: &mut [Y::Scalar], held: &dyn Fn(usize) -> bool) -> bool {
        let enough = closed(self.system);
        let scale = self.system.size();
        let mut damping = Y::Scalar::from_f64(FIRST_DAMPING);
        let mut slow = 0;
        let mut size = self.evaluate(q);
        for _ in 0..CLOSING_STEPS {
            if size <= enough {
                return true;
            }
            self.iterations += 1;
            let square = dot(self.residual, self.residual);
            self.linearise(q, held);
            let share = (size / scale).min(Y::Scalar::ONE);
            let mut accepted = false;
            for _ in 0..CLOSING_TRIALS {
                self.solve(damping * share);
                self.try_step(q);
                let next = max_abs(self.residual);
                let ratio = dot(self.residual, self.residual) / square;
                if ratio < Y::Scalar::ONE {
                    q.copy_from_slice(self.trial);
                    size = next;
                    accepted = true;
                    slow = if ratio > Y::Scalar::from_f64(SLOW_RATIO) { slow + 1 } else { 0 };
                    damping *= Y::Scalar::from_f64(DAMPING_DECREASE);
                    break;
                }
                damping = damping.max(Y::Scalar::from_f64(DAMPING_RESTART))
                    * Y::Scalar::from_f64(DAMPING_INCREASE);
            }
            if !accepted || slow > SLOW_STEPS {
                break;
            }
        }
        self.evaluate(q) <= enough
    }

    /// Evaluates at `trial`, one step (shortened to the longest allowed) from q.
    fn try_step(&mut self, q: &[Y::Scalar]) {
        let longest = Y::Scalar::from_f64(LONGEST_STEP);
        let length = max_abs(self.step);
        let factor = if length > longest { longest / length } else { Y::Scalar::ONE };
        self.set_trial(q, factor);
        let trial = core::mem::take(&mut self.trial);
        self.evaluate(trial);
        self.trial = trial;
    }

    /// `trial` lies so many steps from q, within the limits.
    fn set_trial(&mut self, q: &[Y::Scalar], factor: Y::Scalar) {
        set_scaled(self.across, factor, self.step);
        self.trial.copy_from_slice(q);
        self.system.advance(self.trial, self.across);
        for joint in 0..self.lower.len() {
            self.trial[joint] = self.clamped(joint, self.trial[joint]);
        }
    }

    /// J^T J and -J^T r of the joints that are free to go downhill.
    fn linearise(&mut self, q: &[Y::Scalar], held: &dyn Fn(usize) -> bool) {
        let n = self.system.dimensions().speeds;
        self.rhs.fill(Y::Scalar::ZERO);
        for (row, &r) in self.jacobian.chunks_exact(n.max(1)).zip(&*self.residual) {
            add_scaled(self.rhs, -r, row);
        }
        for direction in 0..n {
            let stopped = self.is_at_limit(q, direction, self.rhs[direction]);
            let fixed = stopped || held(direction);
            self.free[direction] = if fixed { Y::Scalar::ZERO } else { Y::Scalar::ONE };
        }
        self.square();
    }

    /// Whether a direction of u is that of a joint at a limit which a move this way would leave.
    fn is_at_limit(&self, q: &[Y::Scalar], direction: usize, way: Y::Scalar) -> bool {
        let (zero, joint) = (Y::Scalar::ZERO, direction);
        joint < self.lower.len()
            && ((q[joint] <= self.lower[joint] && way < zero)
                || (q[joint] >= self.upper[joint] && way > zero))
    }

    /// J^T J, lower triangle, where both directions are free.
    fn square(&mut self) {
        let n = self.system.dimensions().speeds;
        self.normal.fill(Y::Scalar::ZERO);
        for row in self.jacobian.chunks_exact(n.max(1)) {
            for i in 0..n {
                let value = row[i] * self.free[i];
                if value != Y::Scalar::ZERO {
                    add_scaled(&mut self.normal[i * n..=i * n + i], value, &row[..=i]);
                }
            }
        }
        for i in 0..n {
            for k in 0..i {
                self.normal[i * n + k] *= self.free[k];
            }
        }
    }

    /// The step of (J^T J + mu) step = rhs; mu as a share of the largest entry of J^T J.
    fn solve(&mut self, damping: Y::Scalar) {
        let n = self.system.dimensions().speeds;
        let largest = (0..n).fold(Y::Scalar::ZERO, |most, i| most.max(self.normal[i * n + i]));
        let mut damping = damping.max(LEAST_DAMPING.of());
        loop {
            self.factor.copy_from_slice(self.normal);
            for i in 0..n {
                let fixed = self.free[i] == Y::Scalar::ZERO;
                self.factor[i * n + i] += damping * largest;
                if fixed {
                    self.factor[i * n + i] = Y::Scalar::ONE;
                }
            }
            if factor(self.factor, n).is_ok() || !damping.is_finite() {
                break;
            }
            damping *= Y::Scalar::from_f64(SINGULAR_INCREASE);
            if !(largest > Y::Scalar::ZERO) {
                self.step.fill(Y::Scalar::ZERO);
                return;
            }
        }
        self.substitute();
    }

    /// The step of another right-hand side.
    fn substitute(&mut self) {
        for ((step, &rhs), &free) in self.step.iter_mut().zip(&*self.rhs).zip(&*self.free) {
            *step = rhs * free;
        }
        forward(self.factor, self.step);
        backward(self.factor, self.step);
    }

    /// Moves a closed q along the closure as near to the guess as it gets.
    pub(super) fn slide(
        &mut self,
        q: &mut [Y::Scalar],
        candidate: &mut [Y::Scalar],
        held: &dyn Fn(usize) -> bool,
        arrived: Y::Scalar,
    ) {
        for slid in 0..SLIDING_STEPS {
            self.tangent(q, held);
            if max_abs(self.step) <= arrived {
                return;
            }
            let distance = self.distance(q);
            let mut factor = if slid == 0 { Y::Scalar::ONE } else { self.length(q) };
            self.last_q.copy_from_slice(q);
            self.last_step.copy_from_slice(self.step);
            let mut accepted = false;
            for _ in 0..SLIDING_TRIALS {
                self.set_trial(q, factor);
                candidate.copy_from_slice(self.trial);
                if self.close(candidate, held) && self.distance(candidate) < distance {
                    q.copy_from_slice(candidate);
                    accepted = true;
                    break;
                }
                factor *= Y::Scalar::from_f64(SLIDING_DECREASE);
                // `close` used what the direction was stored in.
                self.evaluate(q);
                self.tangent(q, held);
            }
            if !accepted {
                return;
            }
        }
    }

    /// How far to go along the step: by what the last one made of the one before (J. Barzilai,
    /// J. Borwein, "Two-point step size gradient methods", 1988), where steps alone converge as
    /// slowly as the closure is curved.
    fn length(&mut self, q: &[Y::Scalar]) -> Y::Scalar {
        let of = Y::Scalar::from_f64;
        let (mut square, mut product) = (Y::Scalar::ZERO, Y::Scalar::ZERO);
        self.system.write_difference(self.last_q, q, self.across);
        for (direction, &moved) in self.across.iter().enumerate() {
            square += moved * moved;
            product += moved * (self.last_step[direction] - self.step[direction]);
        }
        if product > Y::Scalar::ZERO {
            (square / product).max(of(SHORTEST_SLIDE)).min(of(LONGEST_SLIDE))
        } else {
            Y::Scalar::ONE
        }
    }

    /// Square of the distance from the guess, rad^2.
    pub(super) fn distance(&mut self, q: &[Y::Scalar]) -> Y::Scalar {
        self.system.write_difference(self.guess, q, self.across);
        dot(self.across, self.across)
    }

    /// The step towards the guess that keeps q closed to first order: g - q less its part
    /// J^+ (r + J (g - q)) across the closure.
    fn tangent(&mut self, q: &[Y::Scalar], held: &dyn Fn(usize) -> bool) {
        let n = self.system.dimensions().speeds;
        for direction in 0..n {
            let fixed = held(direction);
            self.free[direction] = if fixed { Y::Scalar::ZERO } else { Y::Scalar::ONE };
        }
        // Each pass holds the joints that would leave their limits; few ever do.
        for _ in 0..=n {
            self.system.write_difference(q, self.guess, self.across);
            for (across, &free) in self.across.iter_mut().zip(&*self.free) {
                *across = free * *across;
            }
            self.square();
            // The second projection removes the residual that damping left.
            for pass in 0..2 {
                self.rhs.fill(Y::Scalar::ZERO);
                for (row, &r) in self.jacobian.chunks_exact(n.max(1)).zip(&*self.residual) {
                    let open = r + dot(row, self.across);
                    add_scaled(self.rhs, -open, row);
                }
                if pass == 0 {
                    self.solve(SLIDING_DAMPING.of());
                } else {
                    self.substitute();
                }
                add_scaled(self.across, Y::Scalar::ONE, self.step);
            }
            self.step.copy_from_slice(self.across);
            let mut leaves = false;
            for direction in 0..n {
                if self.is_at_limit(q, direction, self.step[direction]) {
                    self.free[direction] = Y::Scalar::ZERO;
                    leaves = true;
                }
            }
            if !leaves {
                break;
            }
        }
    }
}
