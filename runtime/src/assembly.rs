//! Assembly: from a rough guess, also a flat sheet with one joint nudged, to a closed configuration.
//!
//! Levenberg-Marquardt on the nine residuals of every loop, within the joint limits (half a turn
//! where there are none), then along the closed configurations back towards the guess:
//!
//! ```text
//! q <- q - J^+ r + (1 - J^+ J)(q_guess - q)
//! ```

use core::f64::consts::PI;

use crate::linear::dot;
use crate::projection::{closed, largest};
use crate::workspace::{Parts, split};
use crate::{Error, Scalar, System};

/// Steps of one descent.
const STEPS: usize = 60;
/// Steps back towards the guess.
const RETURN_STEPS: usize = 20;
/// Starts: the guess, then the guess with growing deterministic perturbations.
const STARTS: u32 = 24;
/// Longest step of one joint, rad.
const LONGEST_STEP: f64 = 0.5;
/// Squared singular values below this fraction of the largest count as zero on the way back.
const RANK: f64 = 1e-9;

/// How an assembly ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assembly<S> {
    /// Starts it took: 1 when the guess itself led to a closed configuration.
    pub starts: u32,
    /// Largest closure residual left, m.
    pub residual: S,
}

/// Moves q from a guess to the nearest closed configuration it finds. Joints with `pinned` set stay
/// where they are (missing entries: not pinned).
///
/// # Errors
/// [`Error::NotClosed`] with the loop that stays open widest; q is then the guess again.
pub fn assemble<M: System>(
    system: &M,
    q: &mut [M::Scalar],
    pinned: &[bool],
    workspace: &mut [M::Scalar],
) -> Result<Assembly<M::Scalar>, Error> {
    let d = system.dimensions();
    if q.len() != d.coordinates {
        return Err(Error::Workspace);
    }
    if d.loops == 0 {
        return Ok(Assembly { starts: 1, residual: M::Scalar::ZERO });
    }
    let mut guess = system.vector();
    let guess = guess.as_mut();
    for (joint, (guess, q)) in guess.iter_mut().zip(q.iter_mut()).enumerate() {
        *q = q.max(range(system, joint)[0]).min(range(system, joint)[1]);
        *guess = *q;
    }
    let mut noise = Noise(1);
    let mut widest = Error::Workspace;
    for start in 0..STARTS {
        let spread = 0.1 * f64::from(start);
        for (joint, (q, guess)) in q.iter_mut().zip(guess.iter()).enumerate() {
            let free = !pinned.get(joint).copied().unwrap_or(false);
            let nudge = if free { spread * noise.next() } else { 0.0 };
            *q = clamp(system, joint, *guess + M::Scalar::from_f64(nudge));
        }
        match descend(system, q, pinned, workspace) {
            Ok(residual) => {
                let residual = approach(system, q, guess, pinned, workspace)?.unwrap_or(residual);
                return Ok(Assembly { starts: start + 1, residual });
            }
            Err(error) if start == 0 => widest = error,
            Err(_) => {}
        }
    }
    q.copy_from_slice(guess);
    Err(widest)
}

/// Least and greatest angle allowed: the limits, or half a turn.
fn range<M: System>(system: &M, joint: usize) -> [M::Scalar; 2] {
    let [least, greatest] = system.limits(joint);
    let half_turn = M::Scalar::from_f64(PI);
    [
        if least.is_finite() { least } else { -half_turn },
        if greatest.is_finite() { greatest } else { half_turn },
    ]
}

fn clamp<M: System>(system: &M, joint: usize, angle: M::Scalar) -> M::Scalar {
    let [least, greatest] = range(system, joint);
    angle.max(least).min(greatest)
}

/// Levenberg-Marquardt; the residual left when closed, m.
fn descend<M: System>(
    system: &M,
    q: &mut [M::Scalar],
    pinned: &[bool],
    workspace: &mut [M::Scalar],
) -> Result<M::Scalar, Error> {
    let d = system.dimensions();
    let n = d.coordinates;
    let Parts { jacobian, weighted, residual, y, trial, mut inverse, .. } =
        split(workspace, d, 9 * d.loops)?;
    let least_damping = M::Scalar::EPSILON * M::Scalar::EPSILON;
    let mut damping = M::Scalar::from_f64(1e-3);
    system.write_closure(q, residual, jacobian);
    let mut square = dot(residual, residual);
    for _ in 0..STEPS {
        if largest(residual) <= closed(system) || damping > M::Scalar::from_f64(1e6) {
            break;
        }
        weighted.copy_from_slice(jacobian);
        hold(weighted, n, |joint| is_pinned(pinned, joint));
        inverse.solve(weighted, residual, y, least_damping, damping);
        let step = shorten(y);
        for (joint, trial) in trial.iter_mut().enumerate() {
            *trial = clamp(system, joint, q[joint] - step * y[joint]);
        }
        system.write_closure(trial, residual, jacobian);
        let now = dot(residual, residual);
        if now < square {
            q.copy_from_slice(trial);
            square = now;
            damping *= M::Scalar::from_f64(0.1);
            damping = if damping < least_damping { least_damping } else { damping };
        } else {
            damping *= M::Scalar::from_f64(10.0);
            system.write_closure(q, residual, jacobian);
        }
    }
    let open = largest(residual);
    let good_enough = closed(system) * M::Scalar::from_f64(10.0);
    if open <= good_enough {
        return Ok(open);
    }
    Err(not_closed(system, q, residual))
}

/// Slides along the closed configurations towards the guess; `None` when that gains nothing.
fn approach<M: System>(
    system: &M,
    q: &mut [M::Scalar],
    guess: &[M::Scalar],
    pinned: &[bool],
    workspace: &mut [M::Scalar],
) -> Result<Option<M::Scalar>, Error> {
    let d = system.dimensions();
    let n = d.coordinates;
    let mut candidate = system.vector();
    let candidate = candidate.as_mut();
    candidate.copy_from_slice(q);
    for _ in 0..RETURN_STEPS {
        let Parts { jacobian, weighted, residual, rhs, y, trial, wanted, mut inverse, .. } =
            split(workspace, d, 9 * d.loops)?;
        system.write_closure(candidate, residual, jacobian);
        for (joint, wanted) in wanted.iter_mut().enumerate() {
            let free = !is_pinned(pinned, joint);
            *wanted = if free { guess[joint] - candidate[joint] } else { M::Scalar::ZERO };
        }
        weighted.copy_from_slice(jacobian);
        hold(weighted, n, |joint| is_pinned(pinned, joint));
        for ((rhs, row), r) in rhs.iter_mut().zip(weighted.chunks_exact(n)).zip(residual.iter()) {
            *rhs = *r + dot(row, wanted);
        }
        let rank = M::Scalar::from_f64(RANK);
        inverse.solve(weighted, rhs, y, rank, M::Scalar::ZERO);
        for (y, wanted) in y.iter_mut().zip(wanted.iter()) {
            *y = *wanted - *y;
        }
        let step = shorten(y);
        for (joint, trial) in trial.iter_mut().enumerate() {
            *trial = clamp(system, joint, candidate[joint] + step * y[joint]);
        }
        candidate.copy_from_slice(trial);
        if largest(y) < M::Scalar::from_f64(1e-6) {
            break;
        }
    }
    let closed = descend(system, candidate, pinned, workspace);
    let distance = |x: &[M::Scalar]| {
        let square = |(a, b): (&M::Scalar, &M::Scalar)| (*a - *b) * (*a - *b);
        x.iter().zip(guess).map(square).fold(M::Scalar::ZERO, |sum, x| sum + x)
    };
    match closed {
        Ok(residual) if distance(candidate) < distance(q) => {
            q.copy_from_slice(candidate);
            Ok(Some(residual))
        }
        _ => Ok(None),
    }
}

fn is_pinned(pinned: &[bool], joint: usize) -> bool {
    pinned.get(joint).copied().unwrap_or(false)
}

/// Takes the columns of held joints out of a Jacobian.
fn hold<S: Scalar>(jacobian: &mut [S], n: usize, held: impl Fn(usize) -> bool) {
    for row in jacobian.chunks_exact_mut(n) {
        for (joint, entry) in row.iter_mut().enumerate() {
            if held(joint) {
                *entry = S::ZERO;
            }
        }
    }
}

/// The factor that keeps every joint's step within [`LONGEST_STEP`].
fn shorten<S: Scalar>(step: &[S]) -> S {
    let longest = S::from_f64(LONGEST_STEP);
    let most = largest(step);
    if most > longest { longest / most } else { S::ONE }
}

fn not_closed<M: System>(system: &M, q: &[M::Scalar], residual: &[M::Scalar]) -> Error {
    let mut widest = (0, M::Scalar::ZERO);
    for (index, residual) in residual.chunks(9).enumerate() {
        let open = largest(residual);
        if open > widest.1 {
            widest = (index, open);
        }
    }
    let at_limit = |joint: &usize| {
        let [least, greatest] = range(system, *joint);
        q[*joint] <= least || q[*joint] >= greatest
    };
    let joint = (0..q.len()).find(at_limit);
    Error::NotClosed { loop_index: widest.0, residual: widest.1.to_f64(), joint }
}

/// Uniform numbers in -1 .. 1, the same every time (Numerical Recipes' linear congruence).
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0) / f64::from(u32::MAX) * 2.0 - 1.0
    }
}
