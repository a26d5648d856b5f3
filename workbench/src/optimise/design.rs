//! A mechanism at values of the parameters that vary, with derivatives by them.
//!
//! The variables x are shares of the ranges, from 0 to 1: p = low + x (high - low).

use lamc::program::{FunctionKind, Program, Slot};
use nalgebra::{DMatrix, DVectorView, RowDVector};

use super::goals::Variable;
use super::number::Number;
use super::tangent::{Outputs, bent, outputs};
use crate::execution::Jit;

/// A mechanism at values of the variables.
pub struct Design<'c> {
    program: &'c Program,
    /// The mechanism with these parameters.
    pub system: Jit,
    /// Of each variable, the parameter and the width of its range.
    widths: Vec<(usize, f64)>,
    /// The numbers that follow from the parameters alone.
    drawing: Outputs,
}

/// Along what a function is differentiated.
#[derive(Clone, Copy)]
pub struct Along<'a> {
    /// How many directions there are.
    pub directions: usize,
    /// Whether the first directions are those of the variables.
    pub varies: bool,
    /// How q changes: a row for each coordinate, a column for each direction. `None`: not.
    pub follows: Option<&'a DMatrix<f64>>,
    /// How u changes. `None`: not.
    pub speeds: Option<&'a DMatrix<f64>>,
}

impl<'a> Along<'a> {
    /// The directions of the variables, with which q changes as `follows` says.
    pub fn variables(follows: &'a DMatrix<f64>) -> Self {
        Self { directions: follows.ncols(), varies: true, follows: Some(follows), speeds: None }
    }

    /// Changes of the state at constant parameters.
    pub fn state(q: &'a DMatrix<f64>, u: Option<&'a DMatrix<f64>>) -> Self {
        Self { directions: q.ncols(), varies: false, follows: Some(q), speeds: u }
    }

    /// The change of a slot that is part of the state.
    fn of_state(&self, slot: Slot, row: &mut [f64]) {
        let (rows, index) = match slot {
            Slot::Position(id) => (self.follows, id.index()),
            Slot::Rate(id) => (self.speeds, id.index()),
            _ => return,
        };
        let changes = rows.iter().flat_map(|rows| rows.row(index).into_iter());
        row.iter_mut().zip(changes).for_each(|(to, by)| *to = *by);
    }
}

/// The values of all parameters at shares of the ranges, SI.
pub fn parameters(system: &Jit, variables: &[Variable], x: &[f64]) -> Vec<f64> {
    let mut values = system.parameters().to_vec();
    for (Variable { parameter, bounds: [low, high], .. }, share) in variables.iter().zip(x) {
        values[*parameter] = low + share * (high - low);
    }
    values
}

impl<'c> Design<'c> {
    /// The mechanism at shares of the ranges. `system` has the parameters that do not vary.
    pub fn new(program: &'c Program, system: &Jit, variables: &[Variable], x: &[f64]) -> Self {
        let mut system = system.clone();
        let values = parameters(&system, variables, x);
        for variable in variables {
            // The variables are parameters of the program.
            let set = system.set_parameter(&variable.name, values[variable.parameter]);
            debug_assert_eq!(set, Ok(()));
        }
        let widths = variables.iter().map(|it| (it.parameter, it.bounds[1] - it.bounds[0]));
        let mut design =
            Self { program, system, widths: widths.collect(), drawing: Outputs::default() };
        design.drawing = design.evaluate(FunctionKind::Drawing, &[], design.fixed());
        design
    }

    /// Of each variable, the parameter and the width of its range.
    pub fn widths(&self) -> &[(usize, f64)] {
        &self.widths
    }

    /// The number of variables.
    pub fn variables(&self) -> usize {
        self.widths.len()
    }

    /// A function at a state of rest, with derivatives along directions.
    pub fn evaluate(&self, kind: FunctionKind, q: &[f64], along: Along<'_>) -> Outputs {
        let function = self.program.function_of(kind);
        let seed = |slot, row: &mut [f64]| self.seed(along, slot, row);
        outputs(function, along.directions, |slot| self.load(slot, q), seed)
    }

    /// The derivatives of a slot along directions.
    fn seed(&self, along: Along<'_>, slot: Slot, row: &mut [f64]) {
        match slot {
            Slot::Parameter(id) if along.varies => {
                let varied = self.widths.iter().zip(row);
                let own = varied.filter(|((parameter, _), _)| *parameter == id.index());
                own.for_each(|((_, width), entry)| *entry = *width);
            }
            Slot::Drawn(place) if along.varies => {
                let known = self.drawing.row(place);
                row[..known.len()].copy_from_slice(known);
            }
            slot => along.of_state(slot, row),
        }
    }

    /// A function at a state of rest with derivatives along changes of the state, and how all of them change with a variable with
    /// which q changes by `moves`, NQ x 1.
    pub fn change(
        &self,
        kind: FunctionKind,
        q: &[f64],
        along: Along<'_>,
        (variable, moves): (usize, DVectorView<'_, f64>),
    ) -> [Outputs; 2] {
        let (parameter, width) = self.widths[variable];
        let turn = |slot: Slot| match slot {
            Slot::Parameter(id) if id.index() == parameter => width,
            Slot::Drawn(place) => self.drawing.row(place)[variable],
            Slot::Position(id) => moves[id.index()],
            _ => 0.0,
        };
        let function = self.program.function_of(kind);
        let seed = |slot, row: &mut [f64]| along.of_state(slot, row);
        bent(function, along.directions, |slot| self.load(slot, q), seed, turn)
    }

    /// The value of a slot at a state of rest.
    fn load(&self, slot: Slot, q: &[f64]) -> f64 {
        match slot {
            Slot::Parameter(id) => self.system.parameters()[id.index()],
            Slot::Input(id) => self.system.inputs()[id.index()],
            Slot::Position(id) => q[id.index()],
            Slot::Drawn(place) => self.drawing.values[place],
            // t = 0, at rest.
            _ => 0.0,
        }
    }

    /// The directions of the variables at constant q.
    fn fixed(&self) -> Along<'static> {
        Along { directions: self.variables(), varies: true, follows: None, speeds: None }
    }

    /// The derivatives of the closure residuals by the variables at constant q, 9 L x K, m.
    pub fn closure(&self, q: &[f64]) -> DMatrix<f64> {
        let directions = self.variables();
        let found = self.evaluate(FunctionKind::Closure, q, self.fixed());
        let rows = self.program.function_of(FunctionKind::Closure).outputs.first();
        let rows = rows.map_or(0, |residual| residual.entries.len());
        DMatrix::from_row_slice(rows, directions, &found.tangents[..rows * directions])
    }

    /// A point (m), and its derivatives by the variables, with which q changes as `follows` says, 3 x K.
    pub fn point(
        &self,
        point: usize,
        q: &[f64],
        follows: &DMatrix<f64>,
    ) -> ([f64; 3], DMatrix<f64>) {
        self.moved(point, q, Along::variables(follows))
    }

    /// A point (m), and its derivatives along changes of q at constant parameters, 3 x K.
    pub fn point_along(
        &self,
        point: usize,
        q: &[f64],
        dq: &DMatrix<f64>,
    ) -> ([f64; 3], DMatrix<f64>) {
        self.moved(point, q, Along::state(dq, None))
    }

    /// The potential energy at rest, with which q changes as `follows` says, J.
    pub fn potential(&self, q: &[f64], follows: &DMatrix<f64>) -> Number {
        let found = self.evaluate(FunctionKind::Energy, q, Along::variables(follows));
        // The kinetic energy is the first.
        Number { value: found.values[1], slope: RowDVector::from_row_slice(found.row(1)) }
    }

    /// The forces and moments of all hinges at rest, 6 x JOINTS; with the multipliers of the closure and their derivatives by the
    /// variables.
    pub fn reactions(
        &self,
        q: &[f64],
        follows: &DMatrix<f64>,
        (multipliers, changes): (&[f64], &DMatrix<f64>),
    ) -> Outputs {
        let along = Along::variables(follows);
        let load = |slot: Slot| match slot {
            Slot::Multiplier(row) => multipliers[row],
            slot => self.load(slot, q),
        };
        let seed = |slot: Slot, row: &mut [f64]| match slot {
            Slot::Multiplier(index) => {
                row.iter_mut().zip(changes.row(index).iter()).for_each(|(to, by)| *to = *by);
            }
            slot => self.seed(along, slot, row),
        };
        let function = self.program.function_of(FunctionKind::Reactions);
        outputs(function, along.directions, load, seed)
    }

    fn moved(&self, point: usize, q: &[f64], along: Along<'_>) -> ([f64; 3], DMatrix<f64>) {
        let directions = along.directions;
        let found = self.evaluate(FunctionKind::Points, q, along);
        let at = std::array::from_fn(|axis| found.values[3 * point + axis]);
        let rows = &found.tangents[3 * point * directions..][..3 * directions];
        (at, DMatrix::from_row_slice(3, directions, rows))
    }
}
