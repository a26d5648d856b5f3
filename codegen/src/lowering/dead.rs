//! Dead code: what no output needs is dropped.
//!
//! Postcondition: every instruction is needed by an output.

use crate::program::Function;

/// Drops the instructions no output needs.
pub fn dead(mut function: Function) -> Function {
    function.forget_unused();
    function
}
