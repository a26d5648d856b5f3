//! The verifier: what every function must satisfy between passes.

use super::ir::{Function, FunctionKind, Interface, Moving, Op, Program, Slot, Value};

/// A broken invariant of a program: a bug in a pass, never a user's mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VerifyError {
    /// An instruction uses a value that is not defined before it.
    #[error("{0:?}: {1:?} uses a value that does not precede it")]
    Order(FunctionKind, Value),
    /// An instruction reads what its function is not given, or what does not exist.
    #[error("{0:?}: {1:?} reads {2:?}")]
    Slot(FunctionKind, Value, Slot),
    /// An output's entries do not fill its shape.
    #[error("{0:?}: output {1} has the wrong number of entries")]
    Shape(FunctionKind, &'static str),
    /// An output refers to no instruction.
    #[error("{0:?}: output {1} refers to no instruction")]
    Output(FunctionKind, &'static str),
    /// The functions are not one of each kind, in order.
    #[error("the functions are not one of each kind in order")]
    Functions,
}

/// Checks a whole program.
///
/// # Errors
/// The first broken invariant.
pub fn verify(program: &Program) -> Result<(), VerifyError> {
    if !program.functions.iter().map(|f| f.kind).eq(FunctionKind::ALL) {
        return Err(VerifyError::Functions);
    }
    program.functions.iter().try_for_each(|f| function(&program.interface, f))
}

/// Checks one function.
pub(super) fn function(interface: &Interface, function: &Function) -> Result<(), VerifyError> {
    let kind = function.kind;
    for (index, instruction) in function.instructions.iter().enumerate() {
        let value = Value(index);
        if instruction.op.operands().any(|operand| operand >= value) {
            return Err(VerifyError::Order(kind, value));
        }
        if let Op::Load(slot) = instruction.op
            && !readable(interface, kind, slot)
        {
            return Err(VerifyError::Slot(kind, value, slot));
        }
    }
    for output in &function.outputs {
        if output.entries.len() != output.rows * output.columns {
            return Err(VerifyError::Shape(kind, output.name));
        }
        if output.entries.iter().any(|entry| entry.index() >= function.instructions.len()) {
            return Err(VerifyError::Output(kind, output.name));
        }
    }
    Ok(())
}

/// Whether a function of this kind is given this slot, and the slot exists.
fn readable(interface: &Interface, kind: FunctionKind, slot: Slot) -> bool {
    use FunctionKind::{
        Acceleration, Drives, Energy, Equations, Jacobian, Projection, Reactions, Tangent,
    };
    let balanced = matches!(kind, Reactions | Tangent);
    let moves =
        balanced || matches!(kind, Equations | Energy | Acceleration | Projection | Jacobian);
    let timed = moves || kind == Drives;
    let joint = |id: crate::source::JointId| id.index() < interface.joints.len();
    let parameter = |id: crate::source::ParameterId| id.index() < interface.parameters.len();
    let input = |id: crate::source::InputId| id.index() < interface.inputs.len();
    match slot {
        Slot::Time => timed,
        Slot::Position(id) => kind != Drives && joint(id),
        Slot::Rate(id) => moves && joint(id),
        Slot::Parameter(id) => timed && parameter(id),
        Slot::Input(id) => timed && input(id),
        Slot::Acceleration(id) => balanced && joint(id),
        Slot::Multiplier(row) => balanced && row < interface.rows,
        Slot::Change(moving) => {
            kind == Tangent
                && match moving {
                    Moving::Time => true,
                    Moving::Position(id) | Moving::Rate(id) => joint(id),
                    Moving::Parameter(id) => parameter(id),
                    Moving::Input(id) => input(id),
                }
        }
    }
}
