//! The steps of an assembly: closing the loops, and sliding along the closure.

use super::{Search, clamp, limits};
use crate::constants::{
    CLOSING_STEPS, CLOSING_TRIALS, DAMPING_DECREASE, DAMPING_INCREASE, DAMPING_RESTART,
    FIRST_DAMPING, LEAST_DAMPING, LONGEST_SLIDE, LONGEST_STEP, SHORTEST_SLIDE, SINGULAR_INCREASE,
    SLIDING_DAMPING, SLIDING_DECREASE, SLIDING_EXCESS, SLIDING_STEPS, SLIDING_TRIALS, SLOW_RATIO,
    SLOW_STEPS,
};
use crate::linear::{
    add_scaled, backward, copy, diagonal, dot, factor, forward, leading_zeros, max_abs, set_scaled,
};
use crate::rank::closed;
use crate::{Arithmetic, Error, Mechanism, Scalar};

impl<Y: Mechanism> Search<'_, Y> {
    /// Levenberg-Marquardt from q. Leaves residual and Jacobian at the final q.
    pub(super) fn close(
        &mut self,
        q: &mut [Y::Scalar],
        held: &dyn Fn(usize) -> bool,
    ) -> Result<bool, Error> {
        let enough = closed(self.system);
        let scale = self.system.size();
        let mut damping = Y::Scalar::from_f64(FIRST_DAMPING);
        let mut slow = 0;
        let mut size = self.evaluate(q)?;
        for _ in 0..CLOSING_STEPS {
            if size <= enough {
                return Ok(true);
            }
            self.iterations += 1;
            let square = dot(self.residual, self.residual);
            self.linearise(q, held);
            let share = (size / scale).min(Y::Scalar::ONE);
            let mut accepted = false;
            for _ in 0..CLOSING_TRIALS {
                self.solve(damping * share)?;
                self.try_step(q)?;
                let next = max_abs(self.residual);
                let ratio = dot(self.residual, self.residual) / square;
                if ratio < Y::Scalar::ONE {
                    copy(q, self.trial)?;
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
        Ok(self.evaluate(q)? <= enough)
    }

    /// Evaluates at `trial`, one step (shortened to the longest allowed) from q.
    fn try_step(&mut self, q: &[Y::Scalar]) -> Result<(), Error> {
        let longest = Y::Scalar::from_f64(LONGEST_STEP);
        let length = max_abs(self.step);
        let factor = if length > longest { longest / length } else { Y::Scalar::ONE };
        self.set_trial(q, factor)?;
        self.system.write_closure(self.trial, self.residual, self.jacobian)
    }

    /// `trial` lies so many steps from q, within the limits.
    fn set_trial(&mut self, q: &[Y::Scalar], factor: Y::Scalar) -> Result<(), Error> {
        set_scaled(self.across, factor, self.step);
        copy(self.trial, q)?;
        self.system.advance(self.trial, self.across);
        clamp(self.trial, limits(self.lower, self.upper));
        Ok(())
    }

    /// J^T J and -J^T r of the joints that are free to go downhill.
    fn linearise(&mut self, q: &[Y::Scalar], held: &dyn Fn(usize) -> bool) {
        let n = self.system.dimensions().speeds;
        self.rhs.fill(Y::Scalar::ZERO);
        for (row, &r) in self.jacobian.chunks_exact(n.max(1)).zip(&*self.residual) {
            add_scaled(self.rhs, -r, row);
        }
        for (direction, (free, &way)) in self.free.iter_mut().zip(&*self.rhs).enumerate() {
            let fixed = stops(direction, way, q, [self.lower, self.upper]) || held(direction);
            *free = if fixed { Y::Scalar::ZERO } else { Y::Scalar::ONE };
        }
        self.square();
    }

    /// J^T J, lower triangle, where both directions are free.
    fn square(&mut self) {
        let n = self.system.dimensions().speeds;
        self.normal.fill(Y::Scalar::ZERO);
        for row in self.jacobian.chunks_exact(n.max(1)) {
            let first = leading_zeros(row);
            let lines = self.normal.chunks_exact_mut(n.max(1)).zip(row).zip(&*self.free);
            for (i, ((line, &entry), &free)) in lines.enumerate().skip(first) {
                let value = entry * free;
                if value != Y::Scalar::ZERO {
                    for (sum, &entry) in line.iter_mut().zip(row).take(i + 1).skip(first) {
                        *sum += value * entry;
                    }
                }
            }
        }
        for (i, line) in self.normal.chunks_exact_mut(n.max(1)).enumerate() {
            line.iter_mut().zip(&*self.free).take(i).for_each(|(entry, &free)| *entry *= free);
        }
    }

    /// The step of (J^T J + mu) step = rhs; mu as a share of the largest entry of J^T J.
    fn solve(&mut self, damping: Y::Scalar) -> Result<(), Error> {
        let n = self.system.dimensions().speeds;
        let largest =
            diagonal(self.normal, n).fold(Y::Scalar::ZERO, |most, &entry| most.max(entry));
        let mut damping = damping.max(LEAST_DAMPING.of());
        loop {
            copy(self.factor, self.normal)?;
            for (entry, &free) in diagonal_mut(self.factor, n).zip(&*self.free) {
                *entry += damping * largest;
                if free == Y::Scalar::ZERO {
                    *entry = Y::Scalar::ONE;
                }
            }
            if factor(self.factor, n).is_ok() || !damping.is_finite() {
                break;
            }
            damping *= Y::Scalar::from_f64(SINGULAR_INCREASE);
            if !(largest > Y::Scalar::ZERO) {
                self.step.fill(Y::Scalar::ZERO);
                return Ok(());
            }
        }
        self.substitute();
        Ok(())
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
    ) -> Result<(), Error> {
        for slid in 0..SLIDING_STEPS {
            self.tangent(q, Y::Scalar::ONE, held)?;
            if max_abs(self.step) <= arrived {
                return Ok(());
            }
            let distance = self.distance(q);
            let mut factor = if slid == 0 { Y::Scalar::ONE } else { self.length(q) };
            copy(self.last_q, q)?;
            copy(self.last_step, self.step)?;
            let mut accepted = false;
            for _ in 0..SLIDING_TRIALS {
                self.set_trial(q, factor)?;
                copy(candidate, self.trial)?;
                if self.close(candidate, held)? && self.distance(candidate) < distance {
                    copy(q, candidate)?;
                    accepted = true;
                    break;
                }
                factor *= Y::Scalar::from_f64(SLIDING_DECREASE);
                // `close` used what the direction was stored in.
                self.evaluate(q)?;
                self.tangent(q, factor, held)?;
            }
            if !accepted {
                return Ok(());
            }
        }
        Ok(())
    }

    /// How far to go along the step: by what the last one made of the one before (J. Barzilai,
    /// J. Borwein, "Two-point step size gradient methods", 1988), where steps alone converge as
    /// slowly as the closure is curved.
    fn length(&mut self, q: &[Y::Scalar]) -> Y::Scalar {
        let of = Y::Scalar::from_f64;
        let (mut square, mut product) = (Y::Scalar::ZERO, Y::Scalar::ZERO);
        self.system.write_difference(self.last_q, q, self.across);
        for ((&moved, &last), &step) in self.across.iter().zip(&*self.last_step).zip(&*self.step) {
            square += moved * moved;
            product += moved * (last - step);
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
    /// J^+ (r + J (g - q)) across the closure. A `share` of it ends within the limits.
    fn tangent(
        &mut self,
        q: &[Y::Scalar],
        share: Y::Scalar,
        held: &dyn Fn(usize) -> bool,
    ) -> Result<(), Error> {
        let n = self.system.dimensions().speeds;
        for (direction, free) in self.free.iter_mut().enumerate() {
            *free = if held(direction) { Y::Scalar::ZERO } else { Y::Scalar::ONE };
        }
        // Each pass leads further joints to their limits. Later ones are less particular, so that there are few.
        let mut nearly = Y::Scalar::ONE;
        for _ in 0..=n {
            self.system.write_difference(q, self.guess, self.across);
            let places = self.across.iter_mut().zip(&*self.step).zip(&*self.free).enumerate();
            for (direction, ((across, &way), &free)) in places {
                if free == Y::Scalar::ZERO {
                    let limits = [&*self.lower, &*self.upper];
                    *across = match held(direction) {
                        true => Y::Scalar::ZERO,
                        false => bounded(direction, way, share, q, limits),
                    };
                }
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
                    self.solve(SLIDING_DAMPING.of())?;
                } else {
                    self.substitute();
                }
                add_scaled(self.across, Y::Scalar::ONE, self.step);
            }
            copy(self.step, self.across)?;
            nearly *= Y::Scalar::from_f64(SLIDING_EXCESS);
            if !self.stop_furthest(q, share, nearly) {
                break;
            }
        }
        Ok(())
    }

    /// Joints that a `share` of the step leads out of their limits are not free, if they are `nearly` as far out as the furthest: the
    /// other ones may stay within theirs then. Returns whether there are some.
    fn stop_furthest(&mut self, q: &[Y::Scalar], share: Y::Scalar, nearly: Y::Scalar) -> bool {
        let Self { step, free, lower, upper, .. } = self;
        let out = |direction: usize, way: Y::Scalar| {
            (way - bounded(direction, way, share, q, [lower, upper])).abs()
        };
        let moves = || step.iter().copied().enumerate();
        let mut furthest = Y::Scalar::ZERO;
        for ((direction, way), &free) in moves().zip(&**free) {
            furthest = furthest.max(free * out(direction, way));
        }
        if !(furthest > Y::Scalar::ZERO) {
            return false;
        }
        for ((direction, way), free) in moves().zip(&mut **free) {
            if out(direction, way) >= nearly * furthest {
                *free = Y::Scalar::ZERO;
            }
        }
        true
    }
}

/// A move along a direction of u of which a `share` leads no further than to the limit of its joint. Directions beyond those of the
/// joints have no limits.
fn bounded<S: Scalar>(direction: usize, way: S, share: S, q: &[S], [lower, upper]: [&[S]; 2]) -> S {
    let place = (q.get(direction), lower.get(direction), upper.get(direction));
    let (Some(&angle), Some(&lower), Some(&upper)) = place else { return way };
    let end = angle + share * way;
    if end < lower {
        (lower - angle) / share
    } else if end > upper {
        (upper - angle) / share
    } else {
        way
    }
}

/// Whether a direction of u is that of a joint at a limit which a move this way would leave. Directions beyond
/// those of the joints have no limits.
fn stops<S: Scalar>(direction: usize, way: S, q: &[S], [lower, upper]: [&[S]; 2]) -> bool {
    let place = (q.get(direction), lower.get(direction), upper.get(direction));
    let (Some(angle), Some(lower), Some(upper)) = place else { return false };
    (angle <= lower && way < S::ZERO) || (angle >= upper && way > S::ZERO)
}

/// The diagonal of a matrix (n x n), to write to.
fn diagonal_mut<S>(matrix: &mut [S], n: usize) -> impl Iterator<Item = &mut S> {
    matrix.chunks_exact_mut(n.max(1)).enumerate().filter_map(|(i, row)| row.get_mut(i))
}
