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

/// Operations of all functions of a module of several loops above which its functions are tables. rustc 1.95 needs 19 s for
/// straight-line code of 68,000, a sheet of 6 x 6 plates.
const LONG: usize = 40_000;

/// Operations of the acceleration above which it is written as loops. Measured: see decision 81.
const LONG_ACCELERATION: usize = 45_000;

/// Operations of the projection above which it is written as loops. A step calls it once for several accelerations, and its code
/// displaces theirs from the cache: see decision 81.
const LONG_PROJECTION: usize = 28_000;

impl Program {
    /// Whether C has a table for a function. It has no loops, and statements up to the same length for accelerations and projections.
    pub fn is_table_in_c(&self, kind: FunctionKind) -> bool {
        match self.form(kind) {
            Form::StraightLine | Form::Numbered => false,
            Form::Loops => self.function_of(kind).cost().total() > LONG_ACCELERATION,
            Form::Tables => true,
        }
    }

    /// Returns the form of a function. Mechanisms of at most one loop have straight-line code whatever their length.
    pub fn form(&self, kind: FunctionKind) -> Form {
        let operations = |function: &Function| function.cost().total();
        let all: usize = self.functions.iter().map(operations).sum();
        if self.interface.loops.len() < 2 || all <= LONG {
            return Form::StraightLine;
        }
        let most = match kind {
            FunctionKind::Acceleration => LONG_ACCELERATION,
            FunctionKind::Projection => LONG_PROJECTION,
            // Beside an acceleration of its own, a program needs them at stops and next to singular states only.
            FunctionKind::Reduction if !self.solves() => LONG_ACCELERATION,
            FunctionKind::ProjectionReduction if !self.solves() => LONG_PROJECTION,
            _ => return Form::Tables,
        };
        if operations(self.function_of(kind)) <= most { Form::Numbered } else { Form::Loops }
    }
}
