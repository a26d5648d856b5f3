//! The verifier: the invariants that every function must satisfy between passes.

use super::ir::{Function, Interface, Op, Program, Slot, Value};
use super::section::Subject;
use super::signature::{FunctionKind, Role};
use crate::source::{is_identifier, is_keyword};

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
    /// An instruction or a fact belongs to a body or loop that does not exist.
    #[error("{0:?} does not exist")]
    Subject(Subject),
    /// The interface contradicts itself.
    #[error("there are more {0} than possible")]
    Count(&'static str),
    /// A name is no identifier, or a comment has several lines.
    #[error("{0} cannot be written in generated code")]
    Text(&'static str),
}

/// Checks a whole program.
///
/// # Errors
/// The first broken invariant.
pub fn verify(program: &Program) -> Result<(), VerifyError> {
    let Program { interface, facts, functions } = program;
    if !functions.iter().map(|f| f.kind).eq(FunctionKind::ALL) {
        return Err(VerifyError::Functions);
    }
    counts(interface)?;
    texts(program)?;
    facts.iter().try_for_each(|fact| exists(interface, fact.subject))?;
    functions.iter().try_for_each(|f| verify_function(interface, f))
}

/// Checks the numbers that are not the lengths of lists.
fn counts(interface: &Interface) -> Result<(), VerifyError> {
    let residuals = 9 * interface.loops.len();
    let counts = [
        ("closure rows", interface.rows, residuals),
        ("independent equations", interface.rank, residuals),
        ("degrees of freedom", interface.mobility, interface.speeds()),
    ];
    match counts.into_iter().find(|(_, count, most)| count > most) {
        Some((what, ..)) => Err(VerifyError::Count(what)),
        None => Ok(()),
    }
}

/// Checks names, which become identifiers of generated code, and texts, which become comments of one line.
fn texts(program: &Program) -> Result<(), VerifyError> {
    let Program { interface, facts, functions } = program;
    let Interface {
        joints, free, bodies, nodes, points, contacts, parameters, inputs, cuts, ..
    } = interface;
    let is_name = |name: &str| is_identifier(name) && !is_keyword(name);
    // What `tunable` makes a parameter is called `stiffness.left`.
    let is_path = |name: &str| name.split('.').all(is_name);
    let is_line = |text: &str| !text.contains(char::is_control);
    let lines = |texts: &[String]| texts.iter().all(|text| is_line(text));
    let mut instructions = functions.iter().flat_map(|function| &function.instructions);
    let quantities = facts.iter().filter_map(|fact| fact.quantity.as_ref());
    let is_hash = |text: &str| text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let checks = [
        ("the name of the model", is_name(&interface.name)),
        ("the name of a joint", joints.iter().all(|joint| is_name(&joint.name))),
        ("the name of a body", bodies.iter().all(|body| is_name(&body.name))),
        ("the name of a body", free.iter().all(|body| is_name(&body.name))),
        ("the name of a body", joints.iter().flat_map(|j| &j.bodies).all(|name| is_line(name))),
        ("the name of a node", nodes.iter().all(|name| is_identifier(name))),
        ("the name of a point", points.iter().all(|name| is_name(name))),
        ("the name of a contact point", contacts.iter().all(|name| is_path(name))),
        ("the name of a parameter", parameters.iter().all(|it| is_path(&it.name))),
        ("the name of an input", inputs.iter().all(|name| is_name(name))),
        ("the name of a cut joint", cuts.iter().all(|name| is_identifier(name))),
        ("the name of a value", instructions.all(|i| i.name.as_deref().is_none_or(is_identifier))),
        ("the name of a fact", facts.iter().all(|fact| is_identifier(&fact.name))),
        (
            "a quantity",
            quantities.clone().all(|it| {
                // Without a name, the number has that of what it belongs to.
                (it.name.is_empty() || is_identifier(&it.name)) && is_line(&it.meaning)
            }),
        ),
        ("the hash of the input", is_hash(&interface.source_hash)),
        ("the text of a parameter", parameters.iter().all(|it| is_line(&it.doc))),
        ("the text of a loop", lines(&interface.loops)),
    ];
    match checks.into_iter().find(|(_, is_right)| !is_right) {
        Some((what, _)) => Err(VerifyError::Text(what)),
        None => Ok(()),
    }
}

/// Checks that a body or loop exists.
fn exists(interface: &Interface, subject: Subject) -> Result<(), VerifyError> {
    let exists = match subject {
        Subject::Mechanism => true,
        Subject::Body(node) => node.index() < interface.nodes.len(),
        Subject::Loop(id) => id.index() < interface.loops.len(),
    };
    if exists { Ok(()) } else { Err(VerifyError::Subject(subject)) }
}

/// Checks one function.
///
/// # Errors
/// The first rule that does not hold.
pub fn verify_function(interface: &Interface, function: &Function) -> Result<(), VerifyError> {
    let kind = function.kind;
    for (index, instruction) in function.instructions.iter().enumerate() {
        let value = Value(index);
        if instruction.op.operands().any(|operand| operand >= value) {
            return Err(VerifyError::Order(kind, value));
        }
        exists(interface, instruction.section.subject)?;
        if let Op::Load(slot) = instruction.op
            && !readable(interface, kind, slot)
        {
            return Err(VerifyError::Slot(kind, value, slot));
        }
    }
    let signature = kind.signature();
    // The other functions read what `drawing` computes.
    let needed =
        signature.role == Role::Required || (kind == FunctionKind::Drawing && interface.drawn > 0);
    if function.outputs.is_empty() && !needed {
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
    let mut inputs = kind.inputs(interface);
    inputs.any(|it| it == argument) && index < argument.array().shape.length(interface)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::{Instruction, JointInfo, Moving, Output, ParameterInfo, SIGNATURES};
    use crate::program::{Phase, Section};
    use crate::source::{CoordinateId, ParameterId, SpeedId};

    /// Two joints, one loop with three closure rows.
    fn interface() -> Interface {
        Interface {
            joints: vec![JointInfo::default(); 2],
            loops: vec![String::new()],
            parameters: vec![ParameterInfo { name: String::new(), value: 0.0, doc: String::new() }],
            drawn: 1,
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
        let check = |kind, slot| verify_function(&interface, &reading(&interface, kind, slot));
        for kind in FunctionKind::ALL {
            for (slot, argument) in [
                (Slot::Time, "t"),
                (Slot::Position(CoordinateId(1)), "q"),
                (Slot::Rate(SpeedId(1)), "u"),
                (Slot::Multiplier(2), "lambda"),
                (Slot::Change(Moving::Time), "dt"),
            ] {
                let given = kind.signature().inputs.iter().any(|input| input.name() == argument);
                let expected =
                    if given { Ok(()) } else { Err(VerifyError::Slot(kind, Value(1), slot)) };
                assert_eq!(check(kind, slot), expected, "{kind:?} {slot:?}");
            }
        }
        for slot in [Slot::Position(CoordinateId(2)), Slot::Multiplier(3)] {
            let kind = FunctionKind::Reactions;
            assert_eq!(check(kind, slot), Err(VerifyError::Slot(kind, Value(1), slot)));
        }
    }

    #[test]
    fn outputs_are_those_of_the_signature() {
        let interface = interface();
        for signature in &SIGNATURES {
            let kind = signature.kind;
            let slot = match kind {
                FunctionKind::Drives => Slot::Time,
                FunctionKind::Drawing => Slot::Parameter(ParameterId(0)),
                _ => Slot::Position(CoordinateId(0)),
            };
            let right = reading(&interface, kind, slot);
            assert_eq!(verify_function(&interface, &right), Ok(()));
            let none = Function { outputs: Vec::new(), ..right.clone() };
            let optional = signature.role != Role::Required && kind != FunctionKind::Drawing;
            assert_eq!(verify_function(&interface, &none).is_ok(), optional);
            let fixed = Interface { drawn: 0, ..interface.clone() };
            let optional = signature.role != Role::Required;
            assert_eq!(verify_function(&fixed, &none).is_ok(), optional);
            let mut more = right.clone();
            more.outputs.push(right.outputs[0].clone());
            assert_eq!(verify_function(&interface, &more), Err(VerifyError::Outputs(kind)));
            let mut renamed = right.clone();
            renamed.outputs[0].name = "another";
            assert_eq!(verify_function(&interface, &renamed), Err(VerifyError::Outputs(kind)));
            let name = right.outputs[0].name;
            let mut longer = right.clone();
            longer.outputs[0].entries.push(Value(0));
            assert_eq!(verify_function(&interface, &longer), Err(VerifyError::Shape(kind, name)));
            let mut wider = right.clone();
            wider.outputs[0].columns += 1;
            assert_eq!(verify_function(&interface, &wider), Err(VerifyError::Shape(kind, name)));
            let mut undefined = right;
            if let Some(entry) = undefined.outputs[0].entries.first_mut() {
                *entry = Value(2);
                assert_eq!(
                    verify_function(&interface, &undefined),
                    Err(VerifyError::Output(kind, name))
                );
            }
        }
    }
}
