//! The steps of an assembly: closing the loops, and sliding along the closure.

use super::Search;
use crate::acceleration::plain;
use crate::linear::{Spectrum, add_scaled, combine, dot, max_abs, orthogonalise, tolerance};
use crate::projection::closed;
use crate::{Scalar, System};

/// Steps to close.
const CLOSING: usize = 80;
/// Steps along the closure.
const SLIDING: usize = 60;
/// Longest step of a joint, rad: longer ones jump to another branch.
const LONGEST: f64 = 0.5;

impl<Y: System> Search<'_, Y> {
    /// Levenberg-Marquardt from q. Leaves residual and Jacobian at the final q.
    pub(super) fn close(&mut self, q: &mut [Y::Scalar], held: &[bool]) -> bool {
        let enough = closed(self.system);
        let scale = self.system.size();
        let mut damping = Y::Scalar::from_f64(1e-2);
        let mut slow = 0;
        let mut size = self.evaluate(q);
        for _ in 0..CLOSING {
            if size <= enough {
                return true;
            }
            self.iterations += 1;
            let square = dot(self.residual, self.residual);
            let k = self.linearise(q, held);
            let mut accepted = false;
            for _ in 0..10 {
                let share = (size / scale).min(Y::Scalar::ONE);
                let spectrum = Spectrum { cut: tolerance(1e-14, 1e-2), damping: damping * share };
                combine(self.rows, &self.rhs[..k], spectrum, 1, self.step);
                self.try_step(q);
                let next = max_abs(self.residual);
                let ratio = dot(self.residual, self.residual) / square;
                if ratio < Y::Scalar::ONE {
                    q.copy_from_slice(self.trial);
                    size = next;
                    accepted = true;
                    slow = if ratio > Y::Scalar::from_f64(0.9) { slow + 1 } else { 0 };
                    damping *= Y::Scalar::from_f64(0.2);
                    break;
                }
                damping = damping.max(Y::Scalar::from_f64(1e-6)) * Y::Scalar::from_f64(8.0);
            }
            if !accepted || slow > 12 {
                break;
            }
        }
        self.evaluate(q) <= enough
    }

    /// Evaluates at `trial`, one step (shortened to the longest allowed) from q.
    fn try_step(&mut self, q: &[Y::Scalar]) {
        let longest = Y::Scalar::from_f64(LONGEST);
        let length = max_abs(self.step);
        let factor = if length > longest { longest / length } else { Y::Scalar::ONE };
        for joint in 0..q.len() {
            self.trial[joint] = self.clamped(joint, q[joint] + factor * self.step[joint]);
        }
        self.system.write_closure(self.trial, self.residual, self.jacobian);
    }

    /// Orthogonal rows of J step = -r in the joints that are free to go downhill.
    fn linearise(&mut self, q: &[Y::Scalar], held: &[bool]) -> usize {
        let n = q.len();
        for joint in 0..n {
            let gradient = self
                .residual
                .iter()
                .enumerate()
                .fold(Y::Scalar::ZERO, |sum, (i, &r)| sum + self.jacobian[i * n + joint] * r);
            let zero = Y::Scalar::ZERO;
            let stopped = (q[joint] <= self.lower[joint] && gradient > zero)
                || (q[joint] >= self.upper[joint] && gradient < zero);
            let fixed = stopped || held.get(joint) == Some(&true);
            self.free[joint] = if fixed { zero } else { Y::Scalar::ONE };
        }
        for (rhs, &r) in self.rhs.iter_mut().zip(&*self.residual) {
            *rhs = -r;
        }
        self.orthogonalise(n)
    }

    /// Orthogonal rows of J, without the columns of joints that are not free.
    fn orthogonalise(&mut self, n: usize) -> usize {
        for (row, from) in
            self.rows.chunks_exact_mut(n.max(1)).zip(self.jacobian.chunks_exact(n.max(1)))
        {
            for ((row, &from), &free) in row.iter_mut().zip(from).zip(&*self.free) {
                *row = from * free;
            }
        }
        orthogonalise(self.rows, self.rhs, self.residual.len(), n)
    }

    /// Moves a closed q along the closure as near to the guess as it gets.
    pub(super) fn slide(
        &mut self,
        q: &mut [Y::Scalar],
        candidate: &mut [Y::Scalar],
        held: &[bool],
    ) {
        for _ in 0..SLIDING {
            self.tangent(q, held);
            if max_abs(self.step) <= tolerance(1e-6, 32.0) {
                return;
            }
            let distance = self.distance(q);
            let mut factor = Y::Scalar::ONE;
            let mut accepted = false;
            for _ in 0..6 {
                for joint in 0..q.len() {
                    let shift = factor * self.step[joint];
                    candidate[joint] = self.clamped(joint, q[joint] + shift);
                }
                if self.close(candidate, held) && self.distance(candidate) < distance {
                    q.copy_from_slice(candidate);
                    accepted = true;
                    break;
                }
                factor *= Y::Scalar::from_f64(0.3);
                // `close` used what the direction was stored in.
                self.evaluate(q);
                self.tangent(q, held);
            }
            if !accepted {
                return;
            }
        }
    }

    /// Square of the distance from the guess, rad^2.
    pub(super) fn distance(&self, q: &[Y::Scalar]) -> Y::Scalar {
        q.iter()
            .zip(&*self.guess)
            .fold(Y::Scalar::ZERO, |sum, (&q, &guess)| sum + (q - guess) * (q - guess))
    }

    /// The step towards the guess that keeps q closed to first order.
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
            for (i, rhs) in self.rhs.iter_mut().enumerate() {
                *rhs = -self.residual[i] - dot(&self.jacobian[i * n..(i + 1) * n], self.trial);
            }
            let k = self.orthogonalise(n);
            combine(self.rows, &self.rhs[..k], plain(), 1, self.step);
            add_scaled(self.step, Y::Scalar::ONE, self.trial);
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
