//! The form in which a backend writes a function: straight-line code, tables or loops.
//!
//! Straight-line code is faster as long as it does not outgrow the caches, and readable; its text takes some 100 bytes
//! per operation, which neither a reader nor rustc gets through where there are tens of thousands. See decisions 51 and 81.

use super::ir::{Function, Program};
use super::signature::FunctionKind;

/// How a backend writes a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// A statement for each value, named for what it is.
    StraightLine,
    /// A statement for each value, numbered: as fast, in a sixth of the text.
    Numbered,
    /// A loop over the rows of a table.
    Tables,
    /// A loop for each shape of its sections: as fast as straight-line code that does not outgrow the caches. In C a table.
    Loops,
}

impl Form {
    /// Whether C has a table for a function of this form.
    pub fn is_table_in_c(self) -> bool {
        matches!(self, Self::Tables | Self::Loops)
    }
}

/// Operations of all functions of a module of several loops above which its functions are tables. rustc 1.95 needs 19 s for
/// straight-line code of 68,000, a sheet of 6 x 6 plates.
const LONG: usize = 40_000;

/// Operations of the acceleration and of the projection, which every step calls, above which each is written as loops.
/// Measured: see decision 81.
const LONG_SOLUTION: usize = 45_000;

impl Program {
    /// Returns the form of a function. Mechanisms of at most one loop have straight-line code whatever their length.
    pub fn form(&self, kind: FunctionKind) -> Form {
        let operations = |function: &Function| function.cost().total();
        let all: usize = self.functions.iter().map(operations).sum();
        if self.interface.loops.len() < 2 || all <= LONG {
            return Form::StraightLine;
        }
        let is_of_step = match kind {
            FunctionKind::Acceleration | FunctionKind::Projection => true,
            // Beside an acceleration of its own, a program needs them for stops alone.
            FunctionKind::Reduction | FunctionKind::ProjectionReduction => !self.solves(),
            _ => false,
        };
        match (is_of_step, operations(self.function_of(kind)) <= LONG_SOLUTION) {
            (true, true) => Form::Numbered,
            (true, false) => Form::Loops,
            _ => Form::Tables,
        }
    }
}
