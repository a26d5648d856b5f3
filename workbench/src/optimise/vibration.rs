//! The small motions about the state of rest of a design, and how they follow the design.
//!
//! Along the directions N that keep the loops closed, q = q0 + N z, and
//!
//! ```text
//! M z'' + C z' + K z = 0:    M = N^T M_q N,   C = -N^T f_u N,   K = -N^T g_q N,   g = f + J^T lambda.
//! ```
//!
//! With the design, q0 moves as the state of rest does, and N and lambda so that J N = 0 and g = 0 remain:
//!
//! ```text
//! J dN = -dJ N,   J^T dlambda = -(df + dJ^T lambda).
//! ```
//!
//! What is added to dN along N turns the basis, and neither a frequency nor a stiffness depends on the basis. For an eigenvalue
//! s with (s^2 M + s C + K) v = 0 and w^* (s^2 M + s C + K) = 0 (P. Lancaster, "On eigenvalues of matrices dependent on a
//! parameter", Numerische Mathematik 6, 1964),
//!
//! ```text
//! ds = -w^* (s^2 dM + s dC + dK) v / w^* (2 s M + C) v.
//! ```

use std::f64::consts::TAU;

use lamc::arithmetic::largest;
use lamc::pipeline::Compiled;
use lamc::program::FunctionKind;
use lamc_runtime::Mechanism as _;
use nalgebra::{Complex, DMatrix, DVector, RowDVector};

use super::balance::{ISOLATED, Parts, Resting};
use super::design::{Along, Design};
use super::number::Number;
use super::tangent::Outputs;
use crate::rest::Rest;
use crate::simulation::{Asked, describe, start};

/// A point moves along an axis if it does by more than this share of the mechanism's size, per radian.
const MOVES: f64 = 1e-12;
/// Where w^* (2 s M + C) v, of unit w and v and over |s M|, is below this, two modes coincide.
const DOUBLE: f64 = 1e-7;

/// Steps of inverse iteration: each shrinks other vectors by the ratio of their eigenvalues to rounding.
const INVERSE: usize = 3;
/// Steps of Newton's method for an eigenvalue that is known to some digits.
const STEPS: usize = 3;
/// What is left of a matrix times its null vector, over the size of its parts.
const SINGULAR: f64 = 1e-9;

/// M, C and K, or their derivatives by a variable, with N or dN.
struct Small {
    mass: DMatrix<f64>,
    damping: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    basis: DMatrix<f64>,
}

/// The natural frequency of a mode about the state of rest, Hz.
///
/// # Errors
/// There are fewer modes, or this one and another one coincide, so that it has no derivatives.
pub fn frequency(
    compiled: &Compiled,
    design: &Design<'_>,
    resting: &Resting,
    mode: usize,
) -> Result<Number, String> {
    let system = &design.system;
    let mut state = start(&compiled.topology, system, &Asked::of(system, &[]), |_| ())?;
    state.q.copy_from_slice(&resting.q);
    let rest = Rest::new(&compiled.topology.mechanism, system.clone(), state)
        .map_err(|error| format!("no state of rest: {}", describe(&error, system.interface())))?;
    let found = rest.motions.modes.get(mode).map(|mode| mode.eigenvalue);
    let [real, imaginary] =
        found.ok_or_else(|| format!("the state of rest has no mode {}", mode + 1))?;
    let (small, changes) = small(design, resting);
    let Simple { s, left, right, divisor } = simple(&small, Complex::new(real, imaginary))
        .ok_or_else(|| format!("mode {} was not found, or coincides with another one", mode + 1))?;
    let slope = changes.iter().map(|change| {
        let ds = -left.dotc(&(change.sum(s) * &right)) / divisor;
        (s.conj() * ds).re / s.norm() / TAU
    });
    let slope = RowDVector::from_iterator(changes.len(), slope);
    Ok(Number { value: s.norm() / TAU, slope })
}

/// An eigenvalue that is no other one's, with its vectors.
struct Simple {
    s: Complex<f64>,
    left: DVector<Complex<f64>>,
    right: DVector<Complex<f64>>,
    /// w^* (2 s M + C) v.
    divisor: Complex<f64>,
}

/// The eigenvalue near s: what is left of it after each step is of second order in the vectors.
fn simple(small: &Small, mut s: Complex<f64>) -> Option<Simple> {
    let mut found = None;
    for _ in 0..STEPS {
        let (at_s, size) = (small.sum(s), small.size(s));
        let (left, right) = (null_vector(&at_s.adjoint(), size)?, null_vector(&at_s, size)?);
        let by_s = small.mass.map(Complex::from) * s.scale(2.0) + small.damping.map(Complex::from);
        let divisor = left.dotc(&(by_s * &right));
        if divisor.norm() <= DOUBLE * s.norm() * small.mass.norm() {
            return None;
        }
        s -= left.dotc(&(&at_s * &right)) / divisor;
        found = Some(Simple { s, left, right, divisor });
    }
    found.filter(|it| (small.sum(s) * &it.right).norm() <= SINGULAR * small.size(s))
}

impl Small {
    /// s^2 M + s C + K.
    fn sum(&self, s: Complex<f64>) -> DMatrix<Complex<f64>> {
        let [mass, damping, stiffness] =
            [&self.mass, &self.damping, &self.stiffness].map(|it| it.map(Complex::from));
        mass * (s * s) + damping * s + stiffness
    }

    /// The size of the parts of this sum, by which its rounding is measured.
    fn size(&self, s: Complex<f64>) -> f64 {
        self.mass.norm() * s.norm_sqr() + self.damping.norm() * s.norm() + self.stiffness.norm()
    }
}

/// The unit vector v for which P v is least, by inverse iteration; `size` is that of the parts of P. (Singular vectors of complex
/// matrices of nalgebra 0.34 are wrong in the fourth digit.)
fn null_vector(matrix: &DMatrix<Complex<f64>>, size: f64) -> Option<DVector<Complex<f64>>> {
    let n = matrix.nrows();
    // The matrix is singular up to rounding; that moves the vector by as little.
    let lu = (matrix + DMatrix::identity(n, n).scale(f64::EPSILON * size)).lu();
    let mut vector = DVector::from_fn(n, |row, _| Complex::from(1.0 / (row as f64 + 1.0)));
    for _ in 0..INVERSE {
        vector = lu.solve(&vector)?.normalize();
    }
    Some(vector)
}

/// The stiffness of a point along an axis about the state of rest, N/m: a small force along it over how far the point
/// moves along it,
///
/// ```text
/// 1/k = p K^-1 p^T,   p = (dz/dq) N.
/// ```
///
/// # Errors
/// The point cannot move along the axis, or the state of rest is not isolated.
pub fn stiffness(
    design: &Design<'_>,
    resting: &Resting,
    (point, axis): (usize, usize),
) -> Result<Number, String> {
    let (small, changes) = small(design, resting);
    let n = small.basis.nrows();
    let identity = DMatrix::identity(n, n);
    let by_state = design.point_along(point, &resting.q, &identity).1.row(axis).into_owned();
    let moves = &by_state * &small.basis;
    // Of a radian the point moves by so much, at most, that it is more than rounding.
    if largest(&moves) <= MOVES * design.system.size() {
        return Err(format!("the point cannot move along {}", ["x", "y", "z"][axis]));
    }
    let solve = |stiffness: DMatrix<f64>| stiffness.lu().solve(&moves.transpose()).ok_or(ISOLATED);
    let (yields, pushes) = (solve(small.stiffness.clone())?, solve(small.stiffness.transpose())?);
    let compliance = moves.dot(&yields.transpose());
    let slope = changes.iter().enumerate().map(|(variable, change)| {
        let column = resting.follows.column(variable);
        let along = Along::state(&small.basis, None);
        let [_, turned] =
            design.change(FunctionKind::Points, &resting.q, along, (variable, column));
        let turned = RowDVector::from_row_slice(turned.row(3 * point + axis));
        let moved = turned + &by_state * &change.basis;
        let softer = (&moved * (&yields + &pushes))[(0, 0)]
            - (pushes.transpose() * &change.stiffness * &yields)[(0, 0)];
        -softer / (compliance * compliance)
    });
    let slope = RowDVector::from_iterator(changes.len(), slope);
    Ok(Number { value: compliance.recip(), slope })
}

/// The matrices, and their derivatives by each variable.
fn small(design: &Design<'_>, resting: &Resting) -> (Small, Vec<Small>) {
    let Resting { q, follows, closure, balance, .. } = resting;
    let (free, n) = (&closure.free, closure.free.nrows());
    let (still, speeds) = (DMatrix::zeros(n, n), DMatrix::identity(n, n));
    let along = Along::state(&still, Some(&speeds));
    let found = design.evaluate(FunctionKind::Equations, q, along);
    let force = Parts::of(design).force;
    let mass = DMatrix::from_row_slice(n, n, &found.values[..n * n]);
    let rates = DMatrix::from_row_slice(n, n, &found.tangents[force * n..][..n * n]);
    let small = Small {
        mass: projected(free, &mass, free),
        damping: -projected(free, &rates, free),
        stiffness: -projected(free, &balance.by_state, free),
        basis: free.clone(),
    };
    let loops = design.evaluate(FunctionKind::Closure, q, Along::variables(follows));
    let changes = (0..design.variables()).map(|variable| {
        let turn = turn(&loops, resting, variable);
        change(design, resting, [&mass, &rates], turn, variable)
    });
    (small, changes.collect())
}

fn projected(left: &DMatrix<f64>, matrix: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    left.tr_mul(matrix) * right
}

/// dN, from the derivatives of the closure by the variables.
fn turn(loops: &Outputs, Resting { closure, held, .. }: &Resting, variable: usize) -> DMatrix<f64> {
    let n = closure.free.nrows();
    // The residuals come first, then J; the rows of what is held do not change.
    let residuals = loops.values.len() / (n + 1);
    let jacobian = DMatrix::from_fn(residuals + held.len(), n, |row, speed| match row {
        row if row < residuals => loops.row(residuals + row * n + speed)[variable],
        _ => 0.0,
    });
    -closure.along(&(jacobian * &closure.free))
}

/// The derivatives of the matrices by a variable, with dN; and with M_q and f_u.
fn change(
    design: &Design<'_>,
    Resting { q, follows, closure, balance, .. }: &Resting,
    [mass, rates]: [&DMatrix<f64>; 2],
    turn: DMatrix<f64>,
    variable: usize,
) -> Small {
    let (parts, free) = (Parts::of(design), &closure.free);
    let (n, d) = free.shape();
    // Along N by the coordinates, then by the speeds.
    let coordinates = free.clone().resize_horizontally(2 * d, 0.0);
    let mut speeds = DMatrix::zeros(n, 2 * d);
    speeds.columns_mut(d, d).copy_from(free);
    let along = Along::state(&coordinates, Some(&speeds));
    let by = (variable, follows.column(variable));
    let [first, change] = design.change(FunctionKind::Equations, q, along, by);
    let multipliers = balance.multipliers.as_slice();
    let turned = balance.ties.multipliers(&-parts.loads(&change.values, 1, multipliers));
    let forces = parts.loads(&change.tangents, 2 * d, multipliers)
        + parts.of_loops(&first.tangents, 2 * d, turned.as_slice());
    let by_turn =
        |matrix: &DMatrix<f64>| projected(&turn, matrix, free) + projected(free, matrix, &turn);
    let change_of_mass = DMatrix::from_row_slice(n, n, &change.values[..n * n]);
    Small {
        mass: projected(free, &change_of_mass, free) + by_turn(mass),
        damping: -free.tr_mul(&forces.columns(d, d)) - by_turn(rates),
        stiffness: -free.tr_mul(&forces.columns(0, d)) - by_turn(&balance.by_state),
        basis: turn,
    }
}
