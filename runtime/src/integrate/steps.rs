//! Control of the step from an estimate of its error: the PI controller of K. Gustafsson as
//! Hairer and Wanner use it ("Solving Ordinary Differential Equations II", IV.2).

use super::fixed::is_forward;
use crate::{Error, Scalar};

/// Step-size control of an adaptive integrator.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps<S> {
    /// Step to try next, s; 0 until one is known.
    pub next: S,
    /// Error of the last accepted step.
    last_error: S,
    /// The error grows as the step to this power.
    order: f64,
}

impl<S: Scalar> Steps<S> {
    pub fn new(order: f64) -> Self {
        Self { next: S::ZERO, last_error: S::from_f64(1e-4), order }
    }

    /// Tries steps from `t` until one is accepted; `attempt` takes a step's length and returns its
    /// error in units of what is allowed. Returns whether the step ended at `t_end`.
    pub fn accept(
        &mut self,
        [t, t_end]: [S; 2],
        [shortest, longest]: [S; 2],
        mut attempt: impl FnMut(S) -> Result<S, Error>,
    ) -> Result<bool, Error> {
        if !is_forward(t_end - t) {
            return Err(Error::Time);
        }
        let of = S::from_f64;
        let least = shortest.max(of(4.0) * S::EPSILON * t.abs().max(t_end.abs()));
        // A first guess may be too careful for the digits there are.
        self.next = self.next.max(least + least);
        let mut rejected = false;
        loop {
            let wanted = self.next.min(longest);
            let left = t_end - t;
            // A remainder a little longer than the step is taken whole, or it would leave a tiny
            // step for the end.
            let ends = wanted * of(1.01) >= left;
            let step = if ends { left.min(longest) } else { wanted };
            let ends = ends && step == left;
            if !(step > least) && !ends {
                return Err(Error::StepTooSmall { t: t.to_f32() });
            }
            match attempt(step) {
                Ok(error) if error <= S::ONE => {
                    let next = step * self.growth(error, rejected);
                    // A step cut short by the end says nothing against the longer one.
                    self.next = if ends && !rejected { next.max(wanted) } else { next };
                    self.last_error = error.max(of(1e-4));
                    return Ok(ends);
                }
                Ok(error) if error.is_finite() => {
                    let factor = of(0.9) * error.pow(of(-1.0 / self.order));
                    self.next = step * factor.max(of(0.2)).min(of(0.9));
                }
                // Values that are not finite, or a projection that leads nowhere.
                _ => self.next = step * of(0.5),
            }
            if !(self.next > least) {
                return Err(Error::StepTooSmall { t: t.to_f32() });
            }
            rejected = true;
        }
    }

    /// Returns the factor for the length of the next step.
    fn growth(&self, error: S, rejected: bool) -> S {
        let of = S::from_f64;
        let most = if rejected { S::ONE } else { of(10.0) };
        if error == S::ZERO {
            return most;
        }
        let now = error.pow(of(-0.85 / self.order));
        let before = self.last_error.pow(of(0.2 / self.order));
        (of(0.9) * now * before).max(of(0.2)).min(most)
    }
}

/// A first step by the sizes of state and derivative; the controller takes it from there.
pub(super) fn first_step<S: Scalar>(parts: [(&[S], &[S]); 2], [relative, absolute]: [S; 2]) -> S {
    let of = S::from_f64;
    let (mut size, mut rate) = (S::ZERO, S::ZERO);
    for (values, rates) in parts {
        for (&value, &derivative) in values.iter().zip(rates) {
            let allowed = absolute + relative * value.abs();
            size = size.max(value.abs() / allowed);
            rate = rate.max(derivative.abs() / allowed);
        }
    }
    let small = of(1e-5);
    if size > small && rate > small { of(0.01) * size / rate } else { of(1e-6) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANY: [f64; 2] = [0.0, f64::INFINITY];

    fn steps(next: f64) -> Steps<f64> {
        Steps { next, ..Steps::new(5.0) }
    }

    /// The lengths that are tried from 0 to 1 with these errors, and whether the last one ended there.
    fn tried(
        steps: &mut Steps<f64>,
        limits: [f64; 2],
        errors: &[f64],
    ) -> (Vec<f64>, Result<bool, Error>) {
        let (mut lengths, mut errors) = (Vec::new(), errors.iter());
        let ends = steps.accept([0.0, 1.0], limits, |step| {
            lengths.push(step);
            Ok(*errors.next().unwrap())
        });
        (lengths, ends)
    }

    #[test]
    fn only_a_remainder_of_a_hundredth_is_taken_whole() {
        for (next, expected, ends) in
            [(0.1, 0.1, false), (0.98, 0.98, false), (0.995, 1.0, true), (3.0, 1.0, true)]
        {
            assert_eq!(tried(&mut steps(next), ANY, &[0.5]), (vec![expected], Ok(ends)));
        }
        assert_eq!(tried(&mut steps(0.995), [0.0, 0.2], &[0.5]), (vec![0.2], Ok(false)));
    }

    #[test]
    fn a_step_shrinks_with_the_root_of_its_error() {
        // 32 is 2 to the power of the order.
        let (lengths, ends) = tried(&mut steps(0.1), ANY, &[32.0, f64::NAN, 1e9, 1.0]);
        let expected = [0.1, 0.1 * 0.45, 0.1 * 0.45 / 2.0, 0.1 * 0.45 / 2.0 * 0.2];
        assert_eq!(ends, Ok(false));
        assert_eq!(lengths.len(), 4);
        for (found, expected) in lengths.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-14, "{lengths:?}");
        }
        let too_small = tried(&mut steps(0.1), [0.04, 1.0], &[32.0, 32.0]);
        assert!(matches!(too_small, (_, Err(Error::StepTooSmall { .. }))), "{too_small:?}");
    }

    #[test]
    fn the_end_does_not_shorten_the_next_step() {
        let mut steps = steps(3.0);
        assert_eq!(tried(&mut steps, ANY, &[0.9]).1, Ok(true));
        assert!(steps.next >= 3.0, "{}", steps.next);
        // A step that was tried again says how long the next one may be.
        let mut steps = Steps { next: 3.0, ..steps };
        assert_eq!(tried(&mut steps, ANY, &[32.0, 0.9]).1, Ok(false));
        assert!(steps.next < 0.5, "{}", steps.next);
    }
}
