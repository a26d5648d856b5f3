//! The steps of an assembly: closing the loops, and sliding along the closure.

use super::Search;
use crate::constants::{
    CLOSING_STEPS, CLOSING_TRIALS, DAMPING_DECREASE, DAMPING_INCREASE, DAMPING_RESTART,
    FIRST_DAMPING, LEAST_DAMPING, LONGEST_SLIDE, LONGEST_STEP, SHORTEST_SLIDE, SINGULAR_INCREASE,
    SLIDING_DAMPING, SLIDING_DECREASE, SLIDING_STEPS, SLIDING_TRIALS, SLOW_RATIO, SLOW_STEPS,
};
use crate::linear::{add_scaled, backward, dot, factor, forward, max_abs};
use crate::rank::closed;
use crate::{Arithmetic, Scalar, System};

impl<Y: System> Search<'_, Y> {
    /// Levenberg-Marquardt from q. Leaves residual and Jacobian at the final q.
    pub(super) fn close(&mut self, q: &mut [Y::Scalar], held: &[bool]) -> bool {
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
        for joint in 0..q.len() {
            self.trial[joint] = self.clamped(joint, q[joint] + factor * self.step[joint]);
        }
        self.system.write_closure(self.trial, self.residual, self.jacobian);
    }

    /// J^T J and -J^T r of the joints that are free to go downhill.
    fn linearise(&mut self, q: &[Y::Scalar], held: &[bool]) {
        let n = q.len();
        self.rhs.fill(Y::Scalar::ZERO);
        for (row, &r) in self.jacobian.chunks_exact(n.max(1)).zip(&*self.residual) {
            add_scaled(self.rhs, -r, row);
        }
        for joint in 0..n {
            let downhill = self.rhs[joint];
            let zero = Y::Scalar::ZERO;
            let stopped = (q[joint] <= self.lower[joint] && downhill < zero)
                || (q[joint] >= self.upper[joint] && downhill > zero);
            let fixed = stopped || held.get(joint) == Some(&true);
            self.free[joint] = if fixed { zero } else { Y::Scalar::ONE };
        }
        self.square(n);
    }

    /// J^T J, lower triangle, where both joints are free.
    fn square(&mut self, n: usize) {
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
        let n = self.step.len();
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
        held: &[bool],
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
                for joint in 0..q.len() {
                    let shift = factor * self.step[joint];
                    candidate[joint] = self.clamped(joint, q[joint] + shift);
                }
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
    fn length(&self, q: &[Y::Scalar]) -> Y::Scalar {
        let of = Y::Scalar::from_f64;
        let (mut square, mut product) = (Y::Scalar::ZERO, Y::Scalar::ZERO);
        for joint in 0..q.len() {
            let moved = q[joint] - self.last_q[joint];
            square += moved * moved;
            product += moved * (self.last_step[joint] - self.step[joint]);
        }
        if product > Y::Scalar::ZERO {
            (square / product).max(of(SHORTEST_SLIDE)).min(of(LONGEST_SLIDE))
        } else {
            Y::Scalar::ONE
        }
    }

    /// Square of the distance from the guess, rad^2.
    pub(super) fn distance(&self, q: &[Y::Scalar]) -> Y::Scalar {
        q.iter()
            .zip(&*self.guess)
            .fold(Y::Scalar::ZERO, |sum, (&q, &guess)| sum + (q - guess) * (q - guess))
    }

    /// The step towards the guess that keeps q closed to first order: g - q less its part
    /// J^+ (r + J (g - q)) across the closure.
    fn tangent(&mut self, q: &[Y::Scalar], held: &[bool]) {
        let n = q.len();
        for joint in 0..n {
            let fixed = held.get(joint) == Some(&true);
            self.free[joint] = if fixed { Y::Scalar::ZERO } else { Y::Scalar::ONE };
        }
        // Each pass holds the joints that would leave their limits; few ever do.
        for _ in 0..=n {
            for joint in 0..n {
                self.trial[joint] = self.free[joint] * (self.guess[joint] - q[joint]);
            }
            self.square(n);
            // The second time takes away what damping left across the closure.
            for pass in 0..2 {
                self.rhs.fill(Y::Scalar::ZERO);
                for (row, &r) in self.jacobian.chunks_exact(n.max(1)).zip(&*self.residual) {
                    let across = r + dot(row, self.trial);
                    add_scaled(self.rhs, -across, row);
                }
                if pass == 0 {
                    self.solve(SLIDING_DAMPING.of());
                } else {
                    self.substitute();
                }
                add_scaled(self.trial, Y::Scalar::ONE, self.step);
            }
            self.step.copy_from_slice(self.trial);
            let mut leaves = false;
            for joint in 0..n {
                let step = self.step[joint];
                if (q[joint] <= self.lower[joint] && step < Y::Scalar::ZERO)
                    || (q[joint] >= self.upper[joint] && step > Y::Scalar::ZERO)
                {
                    self.free[joint] = Y::Scalar::ZERO;
                    leaves = true;
                }
            }
            if !leaves {
                break;
            }
        }
    }
}
