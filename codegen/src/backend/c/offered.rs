//! The functions of the program that a C module offers directly to its users. The comment, the
//! declaration and the definition of each come from the table of signatures.

use serde::Serialize;

use super::body::{self, static_name};
use crate::backend::text::wrap;
use crate::program::{Argument, Array, FunctionKind, Interface, Program, Shape, Size};

/// The functions of the program that the C interface offers directly.
pub const OFFERED: [FunctionKind; 10] = [
    FunctionKind::Equations,
    FunctionKind::Closure,
    FunctionKind::Poses,
    FunctionKind::Points,
    FunctionKind::Energy,
    FunctionKind::Contacts,
    FunctionKind::Momentum,
    FunctionKind::Control,
    FunctionKind::Jacobian,
    FunctionKind::JacobianParams,
];

/// A function that the C interface offers directly.
#[derive(Serialize)]
pub struct Offered {
    /// Comment: what the function computes, with the unit of each output.
    comment: String,
    /// Head of the function, with this module's number type.
    head: String,
    /// Call of the static function that computes the outputs.
    call: String,
}

/// Returns the functions that write something, with `number` as the number type.
pub fn offered(program: &Program, number: &str) -> Vec<Offered> {
    let selection = program.selection();
    let kinds = OFFERED.into_iter().filter(|&kind| selection.contains(kind));
    kinds.filter_map(|kind| of(program, kind, number)).collect()
}

fn of(program: &Program, kind: FunctionKind, number: &str) -> Option<Offered> {
    let (interface, signature) = (&program.interface, kind.signature());
    let outputs: Vec<&Array> = signature.written(interface).collect();
    if outputs.is_empty() {
        return None;
    }
    let model = &interface.name;
    let input = |argument: &Argument| match argument {
        Argument::Parameters => format!("const {model}_params *{}", argument.name()),
        Argument::Inputs => format!("const {model}_inputs *{}", argument.name()),
        _ if argument.array().shape == Shape::SCALAR => format!("{number} {}", argument.name()),
        _ => format!("const {number} {}", dimensioned(interface, &argument.array())),
    };
    let output = |output: &&Array| match output.shape {
        Shape::SCALAR => format!("{number} *{}", output.name),
        _ => format!("{number} {}", dimensioned(interface, output)),
    };
    let given = body::offered(program, kind);
    let inputs = given.iter();
    let parameters: Vec<_> = inputs.clone().map(input).chain(outputs.iter().map(output)).collect();
    let first = |output: &&Array| match output.shape {
        Shape(_, Size::Fixed(1)) => output.name.to_owned(),
        _ => format!("&{}[0][0]", output.name),
    };
    // The closure of a drawing without parameters reads none.
    let unread = kind == FunctionKind::Closure && !given.contains(&Argument::Parameters);
    let unread = unread.then(|| "0".to_owned());
    let arguments = inputs.map(|input| input.name().to_owned()).chain(unread);
    let arguments: Vec<_> = arguments.chain(outputs.iter().map(first)).collect();
    let meaning = |output: &&Array| format!("{} ({}): {}", output.name, output.unit, output.doc);
    let meanings: Vec<_> = outputs.iter().map(meaning).collect();
    let (mut comment, mut head) = (Vec::new(), Vec::new());
    wrap(&format!("/* {}. {}. */", signature.doc, meanings.join("; ")), &mut comment);
    let name = signature.name;
    wrap(&format!("void {model}_{name}({})", parameters.join(", ")), &mut head);
    Some(Offered {
        comment: comment.join("\n").replace("\n    ", "\n * "),
        head: head.join("\n"),
        call: format!("{}({})", static_name(kind), arguments.join(", ")),
    })
}

/// Returns a name with its rows, and with its columns if it has more than one: `mass[6][6]`.
fn dimensioned(interface: &Interface, array: &Array) -> String {
    let [rows, columns] = array.shape.of(interface);
    match array.shape {
        Shape(_, Size::Fixed(1)) => format!("{}[{rows}]", array.name),
        _ => format!("{}[{rows}][{columns}]", array.name),
    }
}
