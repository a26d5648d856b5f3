//! The state of rest of a design, and how it follows the design.
//!
//! At rest f(q, x) + J(q, x)^T lambda = 0 and r(q, x) = 0. With the directions N that keep the loops closed, J N = 0, and
//! g = f + J^T lambda at constant lambda, the state follows as (A. Griewank and A. Walther, 2008, 15.1)
//!
//! ```text
//! dq/dx = d + N y,   J d = -r_x,   (N^T g_q N) y = -N^T (g_x + g_q d).
//! ```
//!
//! Joints on their stops, and those whose angle is prescribed, stay where they are: for each there is one more row in J.

use lamc::arithmetic::largest;
use lamc::pipeline::Compiled;
use lamc::program::FunctionKind;
use lamc_runtime::Mechanism as _;
use nalgebra::{DMatrix, DVector};

use super::design::{Along, Design};
use crate::execution::Jit;
use crate::rest::{Rest, settle};
use crate::simulation::{Asked, describe, start};

/// A joint that is this near to a stop rests on it, rad.
const ON_STOP: f64 = 1e-9;
/// Eigenvalues of J^T J below this share of the largest are rounding errors: singular values below 1e-6 of the largest.
const SINGULAR: f64 = 1e-12;
const ISOLATED: &str = "the state of rest is not isolated";

/// A state of rest.
#[derive(Clone, Debug)]
pub struct Resting {
    /// The coordinates, rad.
    pub q: Vec<f64>,
    /// Their derivatives by the variables, NQ x K.
    pub follows: DMatrix<f64>,
}

/// The state of rest that `lamc equilibrium` finds.
///
/// # Errors
/// There is none near the initial state, or it is not isolated; the text says so.
pub fn rest(compiled: &Compiled, design: &Design<'_>) -> Result<Resting, String> {
    let q = settled(compiled, &design.system)?;
    let follows = follows(design, &q)?;
    Ok(Resting { q, follows })
}

/// The coordinates at rest.
fn settled(compiled: &Compiled, system: &Jit) -> Result<Vec<f64>, String> {
    let asked = Asked::of(system, &[]);
    let mut state = start(&compiled.topology, system, &asked, |_| ())?;
    settle(system, &mut state)
        .map_err(|error| format!("no state of rest: {}", describe(&error, system.interface())))?;
    Ok(state.q)
}

/// The stiffness of a point along an axis about the state of rest, N/m: a small force along it over how far the point
/// moves along it,
///
/// ```text
/// 1/k = p_z (-N^T g_q N)^-1 p_z^T,   p_z = dp/dq N.
/// ```
///
/// # Errors
/// As [`rest`]; or the point cannot move along the axis.
pub fn stiffness(
    compiled: &Compiled,
    design: &Design<'_>,
    (point, axis): (usize, usize),
) -> Result<f64, String> {
    let q = settled(compiled, &design.system)?;
    let Tangent { free, by_state, .. } = Tangent::at(design, &q)?;
    let none = || format!("the point cannot move along {}", ["x", "y", "z"][axis]);
    if free.is_empty() {
        return Err(none());
    }
    let moves = free.column_iter().map(|direction| {
        let direction = DMatrix::from_column_slice(direction.len(), 1, direction.as_slice());
        design.point_along(point, &q, &direction).1[axis]
    });
    let moves = DVector::from_iterator(free.ncols(), moves);
    let stiffness = -(free.transpose() * by_state * &free);
    let yields = stiffness.lu().solve(&moves).ok_or(ISOLATED)?;
    let compliance = moves.dot(&yields);
    // Of a radian the point moves by so much, at most, that it is more than rounding.
    let is_held = moves.amax() <= SINGULAR * design.system.size();
    if is_held { Err(none()) } else { Ok(1.0 / compliance) }
}

/// The natural frequency of a mode about the state of rest, Hz.
///
/// # Errors
/// As [`rest`]; or there are fewer modes.
pub fn frequency(compiled: &Compiled, system: &Jit, mode: usize) -> Result<f64, String> {
    let asked = Asked::of(system, &[]);
    let state = start(&compiled.topology, system, &asked, |_| ())?;
    let rest = Rest::new(&compiled.topology.mechanism, system.clone(), state)
        .map_err(|error| format!("no state of rest: {}", describe(&error, system.interface())))?;
    let found = rest.motions.modes.get(mode).map(|mode| mode.frequency);
    found.ok_or_else(|| format!("the state of rest has no mode {}", mode + 1))
}

/// The directions and the derivatives of the forces at a state of rest.
struct Tangent {
    /// d, by variable.
    closing: DMatrix<f64>,
    /// N.
    free: DMatrix<f64>,
    /// g_x.
    by_design: DMatrix<f64>,
    /// g_q.
    by_state: DMatrix<f64>,
}

impl Tangent {
    fn at(design: &Design<'_>, q: &[f64]) -> Result<Self, String> {
        let system = &design.system;
        let dimensions = system.dimensions();
        let (n, variables) = (dimensions.speeds, design.variables());
        let held = held(system, q);
        // The closure, and a row for each joint that is held.
        let loops = 9 * dimensions.loops;
        let (mut residual, mut jacobian) = (vec![0.0; loops], vec![0.0; loops * n]);
        system.write_closure(q, &mut residual, &mut jacobian).map_err(|error| error.to_string())?;
        let mut rows = DMatrix::zeros(loops + held.len(), n);
        rows.view_mut((0, 0), (loops, n)).copy_from(&DMatrix::from_row_slice(loops, n, &jacobian));
        held.iter().enumerate().for_each(|(row, joint)| rows[(loops + row, *joint)] = 1.0);
        let mut by_design = DMatrix::zeros(loops + held.len(), variables);
        by_design.view_mut((0, 0), (loops, variables)).copy_from(&design.closure(q));
        let (closing, free) = split(&rows, &by_design);
        let (by_design, by_state) = imbalance(design, q, &held);
        Ok(Self { closing, free, by_design, by_state })
    }
}

/// The derivatives of the coordinates at rest by the variables.
fn follows(design: &Design<'_>, q: &[f64]) -> Result<DMatrix<f64>, String> {
    let Tangent { closing, free, by_design, by_state } = Tangent::at(design, q)?;
    let stiffness = free.transpose() * &by_state * &free;
    let load = free.transpose() * (by_design + by_state * &closing);
    let moved = match free.ncols() {
        0 => DMatrix::zeros(0, design.variables()),
        _ => stiffness.lu().solve(&-load).ok_or(ISOLATED)?,
    };
    Ok(closing + free * moved)
}

/// The joints on their stops, and those whose angle is prescribed.
fn held(system: &Jit, q: &[f64]) -> Vec<usize> {
    let joints = system.interface().joints.iter().enumerate();
    let is_held = |(joint, driven): (usize, bool)| {
        let [lower, upper] = system.limits(joint);
        driven || q[joint] <= lower + ON_STOP || q[joint] >= upper - ON_STOP
    };
    let held = joints.map(|(joint, info)| (joint, info.driven)).filter(|it| is_held(*it));
    held.map(|(joint, _)| joint).collect()
}

/// d of J d = -r_x with the smallest length, and a basis of the directions with J N = 0.
fn split(rows: &DMatrix<f64>, by_design: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let n = rows.ncols();
    let eigen = (rows.transpose() * rows).symmetric_eigen();
    let largest = largest(&eigen.eigenvalues);
    let is_free = |index: &usize| eigen.eigenvalues[*index] <= SINGULAR * largest;
    let (free, across): (Vec<usize>, Vec<usize>) = (0..n).partition(is_free);
    let load = rows.transpose() * by_design;
    let mut closing = DMatrix::zeros(n, by_design.ncols());
    for index in across {
        let direction = eigen.eigenvectors.column(index);
        closing -= direction * (direction.transpose() * &load) / eigen.eigenvalues[index];
    }
    (closing, eigen.eigenvectors.select_columns(&free))
}

/// The derivatives of f + J^T lambda by the variables and by q.
fn imbalance(design: &Design<'_>, q: &[f64], held: &[usize]) -> (DMatrix<f64>, DMatrix<f64>) {
    let dimensions = design.system.dimensions();
    let (n, rows, variables) = (dimensions.speeds, dimensions.rows, design.variables());
    let directions = variables + n;
    let mut moves = DMatrix::zeros(n, directions);
    moves.view_mut((0, variables), (n, n)).fill_with_identity();
    let along = Along { directions, varies: true, follows: Some(&moves) };
    let found = design.evaluate(FunctionKind::Equations, q, along);
    // M, f, J, gamma: as in the signature.
    let (force, jacobian) = (n * n, n * n + n);
    let forces = DVector::from_column_slice(&found.values[force..jacobian]);
    // J^T with a column for each joint that is held.
    let mut transposed = DMatrix::zeros(n, rows + held.len());
    for row in 0..rows {
        (0..n)
            .for_each(|joint| transposed[(joint, row)] = found.values[jacobian + row * n + joint]);
    }
    held.iter().enumerate().for_each(|(column, joint)| transposed[(*joint, rows + column)] = 1.0);
    let singular = SINGULAR.sqrt() * largest(&transposed);
    let multipliers = match transposed.is_empty() {
        true => DVector::zeros(0),
        false => transposed
            .svd(true, true)
            .solve(&-forces, singular)
            .unwrap_or_else(|_| DVector::zeros(rows)),
    };
    let mut all = DMatrix::zeros(n, directions);
    for joint in 0..n {
        let mut sum = DVector::from_column_slice(found.row(force + joint)).transpose();
        for row in 0..rows {
            let change = found.row(jacobian + row * n + joint).iter();
            sum.iter_mut().zip(change).for_each(|(sum, change)| *sum += multipliers[row] * change);
        }
        all.set_row(joint, &sum);
    }
    (all.columns(0, variables).into_owned(), all.columns(variables, n).into_owned())
}
