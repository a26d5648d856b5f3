//! The verifier: the invariants that every function must satisfy between passes.

use super::ir::{Function, Interface, Op, Program, Slot, Value};
use super::signature::{FunctionKind, Role};

/// A broken invariant of a program: a bug in a pass, never a user's mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VerifyError {
    /// An instruction uses a value that is not defined before it.
    #[error("{0:?}: {1:?} uses a value that does not precede it")]
    Order(FunctionKind, Value),
    /// An instruction reads a slot that does not exist, or that is no argument of its function.
    #[error("{0:?}: {1:?} reads {2:?}")]
    Slot(FunctionKind, Value, Slot),
    /// The outputs are not those of the function's signature.
    #[error("{0:?}: the outputs are not those of the signature")]
    Outputs(FunctionKind),
    /// An output does not have the shape that the signature gives it.
    #[error("{0:?}: output {1} does not have the shape of the signature")]
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
    let signature = kind.signature();
    if function.outputs.is_empty() && signature.role != Role::Required {
        return Ok(());
    }
    let names = function.outputs.iter().map(|output| output.name);
    if !names.eq(signature.outputs.iter().map(|output| output.name)) {
        return Err(VerifyError::Outputs(kind));
    }
    for (output, expected) in function.outputs.iter().zip(signature.outputs) {
        let [rows, columns] = expected.shape.of(interface);
        let shape = (output.rows, output.columns, output.entries.len());
        if shape != (rows, columns, rows * columns) {
            return Err(VerifyError::Shape(kind, output.name));
        }
        if output.entries.iter().any(|entry| entry.index() >= function.instructions.len()) {
            return Err(VerifyError::Output(kind, output.name));
        }
    }
    Ok(())
}

/// Returns whether a slot exists and is an argument of functions of this kind.
fn readable(interface: &Interface, kind: FunctionKind, slot: Slot) -> bool {
    let (argument, index) = slot.place();
    kind.signature().inputs.contains(&argument) && index < argument.array().shape.length(interface)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kane::{Phase, Section};
    use crate::program::{Instruction, JointInfo, Moving, Output, SIGNATURES};
    use crate::source::JointId;

    /// Two joints, one loop with three closure rows.
    fn interface() -> Interface {
        Interface {
            joints: vec![JointInfo::default(); 2],
            loops: vec![String::new()],
            rows: 3,
            ..Interface::default()
        }
    }

    /// A function that writes zeros and reads `slot`.
    fn reading(interface: &Interface, kind: FunctionKind, slot: Slot) -> Function {
        let instruction =
            |op| Instruction { op, section: Section::mechanism(Phase::Output), name: None };
        let output = |output: &crate::program::Array| {
            let [rows, columns] = output.shape.of(interface);
            Output { name: output.name, rows, columns, entries: vec![Value(0); rows * columns] }
        };
        Function {
            kind,
            instructions: [Op::Const(0.0), Op::Load(slot)].map(instruction).into(),
            outputs: kind.signature().outputs.iter().map(output).collect(),
        }
    }

    #[test]
    fn a_function_reads_what_its_signature_gives_it_and_what_there_is() {
        let interface = interface();
        let check = |kind, slot| function(&interface, &reading(&interface, kind, slot));
        for kind in FunctionKind::ALL {
            for (slot, argument) in [
                (Slot::Time, "t"),
                (Slot::Position(JointId(1)), "q"),
                (Slot::Rate(JointId(1)), "u"),
                (Slot::Multiplier(2), "lambda"),
                (Slot::Change(Moving::Time), "dt"),
            ] {
                let given = kind.signature().inputs.iter().any(|input| input.name() == argument);
                let expected =
                    if given { Ok(()) } else { Err(VerifyError::Slot(kind, Value(1), slot)) };
                assert_eq!(check(kind, slot), expected, "{kind:?} {slot:?}");
            }
        }
        for slot in [Slot::Position(JointId(2)), Slot::Multiplier(3)] {
            let kind = FunctionKind::Reactions;
            assert_eq!(check(kind, slot), Err(VerifyError::Slot(kind, Value(1), slot)));
        }
    }

    #[test]
    fn outputs_are_those_of_the_signature() {
        let interface = interface();
        for signature in &SIGNATURES {
            let kind = signature.kind;
            let slot =
                if kind == FunctionKind::Drives { Slot::Time } else { Slot::Position(JointId(0)) };
            let right = reading(&interface, kind, slot);
            assert_eq!(function(&interface, &right), Ok(()));
            let none = Function { outputs: Vec::new(), ..right.clone() };
            assert_eq!(function(&interface, &none).is_ok(), signature.role != Role::Required);
            let mut more = right.clone();
            more.outputs.push(right.outputs[0].clone());
            assert_eq!(function(&interface, &more), Err(VerifyError::Outputs(kind)));
            let mut renamed = right.clone();
            renamed.outputs[0].name = "another";
            assert_eq!(function(&interface, &renamed), Err(VerifyError::Outputs(kind)));
            let name = right.outputs[0].name;
            let mut longer = right.clone();
            longer.outputs[0].entries.push(Value(0));
            assert_eq!(function(&interface, &longer), Err(VerifyError::Shape(kind, name)));
            let mut wider = right.clone();
            wider.outputs[0].columns += 1;
            assert_eq!(function(&interface, &wider), Err(VerifyError::Shape(kind, name)));
            let mut undefined = right;
            if let Some(entry) = undefined.outputs[0].entries.first_mut() {
                *entry = Value(2);
                assert_eq!(function(&interface, &undefined), Err(VerifyError::Output(kind, name)));
            }
        }
    }
}
