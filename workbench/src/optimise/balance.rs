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

use lamc::pipeline::Compiled;
use lamc::program::FunctionKind;
use lamc_runtime::Mechanism as _;
use nalgebra::{DMatrix, DVector, RowDVector};

use super::design::{Along, Design};
use super::goals::OfState;
use super::number::{Number, length};
use super::ties::Ties;
use crate::execution::Jit;
use crate::rest::settle;
use crate::simulation::{Asked, describe, start};

/// A joint that is this near to a stop rests on it, rad.
const ON_STOP: f64 = 1e-9;
/// Why the design does not determine a state of rest.
pub const ISOLATED: &str = "the state of rest is not isolated";

/// A state of rest.
#[derive(Clone, Debug)]
pub struct Resting {
    /// The coordinates, rad.
    pub q: Vec<f64>,
    /// Their derivatives by the variables, NQ x K.
    pub follows: DMatrix<f64>,
    /// J of the residuals of the loops, with a row for each joint that is held.
    pub closure: Ties,
    /// The forces.
    pub balance: Balance,
    /// The joints on their stops, and those whose angle is prescribed.
    pub held: Vec<usize>,
}

/// f + J^T lambda = 0, and its derivatives at constant lambda.
#[derive(Clone, Debug)]
pub struct Balance {
    /// J as it is in the equations of motion, with a row for each joint that is held.
    pub ties: Ties,
    /// lambda, by row.
    pub multipliers: DVector<f64>,
    /// g_x, NU x K.
    pub by_design: DMatrix<f64>,
    /// g_q, NU x NU.
    pub by_state: DMatrix<f64>,
}

/// The state of rest that `lamc equilibrium` finds.
///
/// # Errors
/// There is none near the initial state, or it is not isolated; the text says so.
pub fn rest(compiled: &Compiled, design: &Design<'_>) -> Result<Resting, String> {
    let system = &design.system;
    let mut state = start(&compiled.topology, system, &Asked::of(system, &[]), |_| ())?;
    settle(system, &mut state)
        .map_err(|error| format!("no state of rest: {}", describe(&error, system.interface())))?;
    let q = state.q;
    let held = held(system, &q);
    let closure = closure(design, &q, &held)?;
    let balance = Balance::at(design, &q, &held);
    let loops = 9 * system.dimensions().loops;
    let residuals = design.closure(&q).resize_vertically(loops + held.len(), 0.0);
    let closing = -closure.along(&residuals);
    let free = &closure.free;
    let stiffness = free.transpose() * &balance.by_state * free;
    let load = free.transpose() * (&balance.by_design + &balance.by_state * &closing);
    let moved = match free.ncols() {
        0 => DMatrix::zeros(0, design.variables()),
        _ => stiffness.lu().solve(&-load).ok_or(ISOLATED)?,
    };
    let follows = closing + free * moved;
    Ok(Resting { q, follows, closure, balance, held })
}

impl Resting {
    /// An angle or a position at rest, rad or m, or the potential energy, J.
    pub fn number(&self, design: &Design<'_>, of: OfState) -> Number {
        let Self { q, follows, .. } = self;
        match of {
            OfState::Position { point, axis } => {
                let (at, moves) = design.point(point, q, follows);
                Number { value: at[axis], slope: moves.row(axis).into_owned() }
            }
            OfState::Angle(joint) => {
                Number { value: q[joint], slope: follows.row(joint).into_owned() }
            }
            OfState::Energy(_) => design.potential(q, follows),
        }
    }

    /// How lambda follows the design, ROWS x K: J^T dlambda = -(g_x + g_q dq/dx).
    fn multipliers(&self) -> DMatrix<f64> {
        let Balance { ties, by_design, by_state, .. } = &self.balance;
        -ties.multipliers(&(by_design + by_state * &self.follows))
    }

    /// The torque that holds a joint, N m; 0 for a joint that is not held.
    pub fn torque(&self, joint: usize) -> Number {
        let follows = self.multipliers();
        let Some(place) = self.held.iter().position(|held| *held == joint) else {
            return Number::constant(0.0, follows.ncols());
        };
        let row = follows.nrows() - self.held.len() + place;
        Number { value: self.balance.multipliers[row], slope: follows.row(row).into_owned() }
    }

    /// The force that a hinge transmits, N.
    pub fn force(&self, design: &Design<'_>, joint: usize) -> Number {
        let known = (self.balance.multipliers.as_slice(), &self.multipliers());
        let found = design.reactions(&self.q, &self.follows, known);
        let part = |axis: usize| {
            let number = 6 * joint + axis;
            let slope = RowDVector::from_row_slice(found.row(number));
            Number { value: found.values[number], slope }
        };
        length(&[0, 1, 2].map(part))
    }
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

/// J of the residuals of the loops, with a row for each joint that is held.
fn closure(design: &Design<'_>, q: &[f64], held: &[usize]) -> Result<Ties, String> {
    let dimensions = design.system.dimensions();
    let (n, loops) = (dimensions.speeds, 9 * dimensions.loops);
    let (mut residual, mut jacobian) = (vec![0.0; loops], vec![0.0; loops * n]);
    let written = design.system.write_closure(q, &mut residual, &mut jacobian);
    written.map_err(|error| error.to_string())?;
    Ok(Ties::new(with_held(&jacobian, n, held)))
}

/// Rows of J, one after the other, and below them a row for each joint that is held.
fn with_held(jacobian: &[f64], n: usize, held: &[usize]) -> DMatrix<f64> {
    let rows = jacobian.len() / n.max(1);
    let mut all = DMatrix::zeros(rows + held.len(), n);
    all.view_mut((0, 0), (rows, n)).copy_from(&DMatrix::from_row_slice(rows, n, jacobian));
    held.iter().enumerate().for_each(|(row, joint)| all[(rows + row, *joint)] = 1.0);
    all
}

impl Balance {
    fn at(design: &Design<'_>, q: &[f64], held: &[usize]) -> Self {
        let dimensions = design.system.dimensions();
        let (n, variables) = (dimensions.speeds, design.variables());
        let directions = variables + n;
        let mut moves = DMatrix::zeros(n, directions);
        moves.view_mut((0, variables), (n, n)).fill_with_identity();
        let found = design.evaluate(FunctionKind::Equations, q, Along::variables(&moves));
        let parts = Parts::of(design);
        let force = DMatrix::from_column_slice(n, 1, &found.values[parts.force..parts.jacobian]);
        let jacobian = &found.values[parts.jacobian..][..n * parts.rows];
        let ties = Ties::new(with_held(jacobian, n, held));
        let multipliers = ties.multipliers(&-force).column(0).into_owned();
        let all = parts.loads(&found.tangents, directions, multipliers.as_slice());
        let (by_design, by_state) = all.columns_range_pair(..variables, variables..);
        let (by_design, by_state) = (by_design.into_owned(), by_state.into_owned());
        Self { ties, multipliers, by_design, by_state }
    }
}

/// Where the parts of the equations M u' = f + J^T lambda, J u' = gamma are among their numbers.
#[derive(Clone, Copy)]
pub struct Parts {
    /// NU: M has so many rows and columns, and is the first.
    pub speeds: usize,
    /// The rows of J.
    pub rows: usize,
    /// Where f begins.
    pub force: usize,
    /// Where J begins.
    pub jacobian: usize,
}

impl Parts {
    /// Those of a design.
    pub fn of(design: &Design<'_>) -> Self {
        let dimensions = design.system.dimensions();
        let n = dimensions.speeds;
        Self { speeds: n, rows: dimensions.rows, force: n * n, jacobian: n * n + n }
    }

    /// df + dJ^T lambda, NU x K, from the derivatives of the equations along K directions.
    pub fn loads(self, tangents: &[f64], directions: usize, multipliers: &[f64]) -> DMatrix<f64> {
        let forces = &tangents[self.force * directions..][..self.speeds * directions];
        DMatrix::from_row_slice(self.speeds, directions, forces)
            + self.of_loops(tangents, directions, multipliers)
    }

    /// dJ^T lambda, NU x K; multipliers of joints that are held may follow those of the loops.
    pub fn of_loops(
        self,
        tangents: &[f64],
        directions: usize,
        multipliers: &[f64],
    ) -> DMatrix<f64> {
        DMatrix::from_fn(self.speeds, directions, |speed, direction| {
            let at = |row: usize| self.jacobian + row * self.speeds + speed;
            let loops = multipliers.iter().take(self.rows).enumerate();
            loops.map(|(row, by)| by * tangents[at(row) * directions + direction]).sum()
        })
    }
}
