//! Prints the mechanism's functions as C.

use crate::program::{
    Argument, Function, FunctionKind, Interface, Op, Parts, Program, Quantity, Shape, Slot,
};
use std::collections::BTreeSet;

use lamc_runtime::plumbing::may_be_reduced;
use serde::Serialize;
use tera::Context;

use super::Real;
use super::algorithms::{identifiers, library as library_of_algorithms, words};
use super::description::{MACROS, fields};
use super::tables::Tables;
use crate::backend::constants::{self, Constant, Constants};
use crate::backend::identifiers::reserved;
use crate::backend::literal::digits;
use crate::backend::statements::{Expression, SineCosine, Statement, statements};
use crate::backend::text::wrap;

/// Mnemonic of each operation that is a function call in C, and the name of that function without the
/// suffix that it has for `float`.
const CALLS: [(&str, &str); 13] = [
    ("sqrt", "sqrt"),
    ("sin", "sin"),
    ("cos", "cos"),
    ("tan", "tan"),
    ("exp", "exp"),
    ("tanh", "tanh"),
    ("ln", "log"),
    ("pow", "pow"),
    ("atan2", "atan2"),
    ("abs", "magnitude"),
    ("min", "smaller"),
    ("max", "larger"),
    ("step", "step_of"),
];

/// Functions of [`CALLS`] that the module defines itself.
const OWN: [&str; 4] = ["magnitude", "smaller", "larger", "step_of"];

/// Returns the names that function bodies use besides their arguments: types, functions, and names that
/// some compilers define as macros unless they are told to follow the standard.
pub fn helpers() -> impl Iterator<Item = &'static str> {
    CALLS.into_iter().map(|(_, name)| name).chain(["real"]).chain(MACROS)
}

/// A static function: its signature, the parameters that it does not read, and its lines.
#[derive(Serialize)]
struct Written {
    signature: String,
    unused: Vec<&'static str>,
    lines: Vec<String>,
}

#[derive(Serialize)]
struct Cost {
    name: &'static str,
    cost: String,
}

/// A macro that tells the algorithms which functions the mechanism offers and which operations it uses.
#[derive(Serialize)]
struct Switch {
    name: &'static str,
    value: u8,
}

impl Switch {
    fn new(name: &'static str, is_on: bool) -> Self {
        Self { name, value: is_on.into() }
    }
}

/// The constants of one group.
#[derive(Serialize)]
struct Group {
    heading: String,
    lines: Vec<String>,
}

/// Adds the mechanism's constants and functions, the costs of the functions, and the library functions
/// and macros that they use. `header` is the text of the module's header.
pub fn insert(context: &mut Context, program: &Program, real: Real, header: &str) {
    let functions = functions(program);
    let ops: Vec<Op> = functions
        .iter()
        .flat_map(|function| &function.instructions)
        .map(|instruction| instruction.op)
        .collect();
    let mut library: BTreeSet<_> = library_of_algorithms(&program.interface).collect();
    library.extend(ops.iter().filter_map(|&op| library_function(op)));
    let is_table = |function: &&Function| program.is_table_in_c(function.kind);
    let turns = ["sin", "cos"];
    if functions.iter().any(is_table) && turns.iter().any(|name| library.contains(name)) {
        // A table computes both.
        library.extend(turns);
    }
    let suffix = real.suffix();
    let library: Vec<_> = library.iter().map(|name| format!("{name}{suffix}")).collect();
    context.insert("library", &library);
    let uses = |wanted: fn(&Op) -> bool| ops.iter().any(wanted);
    let offers = |wanted| functions.iter().any(|function| function.kind == wanted);
    let Interface { loops, free, .. } = &program.interface;
    let switches = [
        Switch::new("ACCELERATION_IS_DIRECT", offers(FunctionKind::Acceleration)),
        Switch::new("PROJECTION_IS_DIRECT", offers(FunctionKind::Projection)),
        Switch::new("IS_REDUCED", program.reduction().is_some()),
        Switch::new("MAY_BE_REDUCED", may_be_reduced(loops.len(), !free.is_empty())),
        Switch::new("USES_MINIMUM", uses(|op| matches!(op, Op::Min(..)))),
        Switch::new("USES_MAXIMUM", uses(|op| matches!(op, Op::Max(..)))),
        Switch::new("USES_STEP", uses(|op| matches!(op, Op::Step(_)))),
    ];
    context.insert("switches", &switches);
    let words = words(program);
    let reserved = words.iter().map(String::as_str).chain(identifiers(header));
    let reserved: Vec<String> = reserved.map(str::to_ascii_lowercase).collect();
    let reserved: Vec<&str> = reserved.iter().map(String::as_str).collect();
    let named = functions.iter().copied().filter(|function| !is_table(function));
    let constants = Constants::of(program, named, &reserved);
    context.insert("legend", &legend(&constants));
    context.insert("model_constants", &groups(program, &constants, real));
    let printer = Printer {
        real,
        constants,
        parameters: fields(program.interface.parameters.iter().map(|parameter| &parameter.name)),
        inputs: fields(&program.interface.inputs),
    };
    let mut tables = Tables::default();
    let write = |function: &&Function| match is_table(function) {
        true => printer.table(program, function, &mut tables),
        false => printer.function(program, function),
    };
    let written: Vec<Written> = functions.iter().map(write).collect();
    context.insert("functions", &written);
    tables.finish(real);
    context.insert("tables", &tables);
    let cost = |function: &&Function| Cost {
        name: function.kind.name(),
        cost: function.cost().to_string(),
    };
    context.insert("costs", &functions.iter().map(cost).collect::<Vec<_>>());
}

/// The functions that the algorithms of a C module call.
const KINDS: [FunctionKind; 16] = [
    FunctionKind::Drawing,
    FunctionKind::Equations,
    FunctionKind::Closure,
    FunctionKind::Poses,
    FunctionKind::Points,
    FunctionKind::Energy,
    FunctionKind::Drives,
    FunctionKind::Contacts,
    FunctionKind::Momentum,
    FunctionKind::Control,
    FunctionKind::Acceleration,
    FunctionKind::Projection,
    FunctionKind::Reduction,
    FunctionKind::ProjectionReduction,
    FunctionKind::Jacobian,
    FunctionKind::JacobianParams,
];

/// Returns the functions that a mechanism has, without those that write nothing.
fn functions(program: &Program) -> Vec<&Function> {
    let writes =
        |function: &&Function| function.outputs.iter().any(|output| !output.entries.is_empty());
    KINDS.into_iter().map(|kind| program.function_of(kind)).filter(writes).collect()
}

/// Returns the name of a static function. No public function can have the same name, whatever the model
/// is called.
pub fn static_name(kind: FunctionKind) -> String {
    format!("{}_of", kind.name())
}

/// Returns the function of the C library that computes an operation.
fn library_function(op: Op) -> Option<&'static str> {
    let (_, name) = CALLS.into_iter().find(|(mnemonic, _)| *mnemonic == op.mnemonic())?;
    (!OWN.contains(&name)).then_some(name)
}

struct Printer {
    real: Real,
    constants: Constants,
    parameters: Vec<String>,
    inputs: Vec<String>,
}

impl Printer {
    /// A function as statements.
    fn function(&self, program: &Program, function: &Function) -> Written {
        let parts = Parts::whole(function);
        let reserved = reserved(function.kind.signature(), helpers());
        let stretch = statements(program, &self.constants, function, &parts, &reserved).remove(0);
        let mut lines = Vec::new();
        for statement in &stretch.list {
            self.statement(&program.interface.nodes, statement, &mut lines);
        }
        for (output, index, entry) in &stretch.entries {
            let value = self.expression(entry);
            wrap(&format!("    {output}[{index}] = {value};"), &mut lines);
        }
        let reads: BTreeSet<_> = function
            .instructions
            .iter()
            .filter_map(|instruction| match instruction.op {
                Op::Load(slot) => Some(slot.place().0),
                _ => None,
            })
            .collect();
        let inputs = given(program, function.kind);
        let reads_numbers = reads.contains(&Argument::Drawing);
        let is_read = |argument: &Argument| {
            reads.contains(argument) || (*argument == Argument::Parameters && reads_numbers)
        };
        let unused = inputs.into_iter().filter(|argument| !is_read(argument));
        let unused = unused.map(|argument| argument.name()).collect();
        Written { signature: head(program, function), unused, lines }
    }

    /// A function as a table.
    fn table(&self, program: &Program, function: &Function, tables: &mut Tables) -> Written {
        let fields = [&*self.parameters, &*self.inputs];
        let mut lines = Vec::new();
        for statement in tables.add(function, &program.interface, fields) {
            wrap(&format!("    {statement}"), &mut lines);
        }
        let read = offered(program, function.kind);
        let is_unread = |argument: &&Argument| match argument {
            Argument::Parameters => self.parameters.is_empty() && program.interface.drawn == 0,
            Argument::Inputs => self.inputs.is_empty(),
            _ => false,
        };
        let is_unused = |argument: &&Argument| is_unread(argument) || !read.contains(argument);
        let inputs = given(program, function.kind);
        let unused = inputs.iter().filter(is_unused);
        let unused = unused.map(|argument| argument.name()).collect();
        Written { signature: head(program, function), unused, lines }
    }

    fn statement(&self, nodes: &[String], statement: &Statement, lines: &mut Vec<String>) {
        let suffix = self.real.suffix();
        match statement {
            Statement::Section(section) => {
                let heading = section.heading(nodes);
                lines.push(format!("    /* {heading} */"));
            }
            Statement::Let { name, value } => {
                wrap(&format!("    const real {name} = {};", self.expression(value)), lines);
            }
            Statement::SineCosine(pairs) => {
                for SineCosine { sine, cosine, angle } in pairs {
                    let angle = self.expression(angle);
                    for (name, function) in [(sine, "sin"), (cosine, "cos")] {
                        if let Some(name) = name {
                            let value = format!("{function}{suffix}({angle})");
                            wrap(&format!("    const real {name} = {value};"), lines);
                        }
                    }
                }
            }
        }
    }

    fn expression(&self, expression: &Expression) -> String {
        match expression {
            Expression::Constant(number) => constant(self.real, *number),
            Expression::Number { name, negative: false } => name.clone(),
            Expression::Number { name, negative: true } => format!("-{name}"),
            Expression::Load(slot) => self.load(*slot),
            Expression::Name(name) => name.clone(),
            Expression::Parenthesised(x) => format!("({})", self.expression(x)),
            Expression::Negated(x) => match self.expression(x) {
                negative if negative.starts_with('-') => format!("-({negative})"),
                operand => format!("-{operand}"),
            },
            Expression::Infix(x, operator, y) => {
                let (x, y) = (self.expression(x), self.expression(y));
                format!("{x} {} {y}", operator.symbol())
            }
            Expression::Call(function, arguments) => {
                let arguments: Vec<_> = arguments.iter().map(|x| self.expression(x)).collect();
                let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
                call(self.real, function, &arguments)
            }
        }
    }

    fn load(&self, slot: Slot) -> String {
        let (argument, index) = slot.place();
        let name = argument.name();
        match argument {
            Argument::Parameters => format!("{name}->{}", self.parameters[index]),
            Argument::Inputs => format!("{name}->{}", self.inputs[index]),
            Argument::Drawing => format!("{}->{name}[{index}]", Argument::Parameters.name()),
            _ if argument.array().shape == Shape::SCALAR => name.to_owned(),
            _ => format!("{name}[{index}]"),
        }
    }
}

/// Returns what a static function is given: the closure gets the parameters in all modules, so that the algorithms
/// call it in the same way.
fn given(program: &Program, kind: FunctionKind) -> Vec<Argument> {
    let mut given = offered(program, kind);
    if kind == FunctionKind::Closure && !given.contains(&Argument::Parameters) {
        given.push(Argument::Parameters);
    }
    given
}

/// Returns what a public function is given. The numbers of the drawing are in the parameters.
pub fn offered(program: &Program, kind: FunctionKind) -> Vec<Argument> {
    let of_drawing = |argument| match argument {
        Argument::Drawing => Argument::Parameters,
        other => other,
    };
    let mut given: Vec<Argument> = Vec::new();
    for argument in kind.inputs(&program.interface).map(of_drawing) {
        if !given.contains(&argument) {
            given.push(argument);
        }
    }
    given
}

/// Returns the name and the parameters of the static function that computes a function.
fn head(program: &Program, function: &Function) -> String {
    let model = &program.interface.name;
    let parameter = |argument: &Argument| match argument {
        Argument::Parameters => format!("const {model}_params *{}", argument.name()),
        Argument::Inputs => format!("const {model}_inputs *{}", argument.name()),
        _ if argument.array().shape == Shape::SCALAR => format!("real {}", argument.name()),
        _ => format!("const real *{}", argument.name()),
    };
    let inputs = given(program, function.kind);
    let mut parameters: Vec<String> = inputs.iter().map(parameter).collect();
    let written = function.outputs.iter().filter(|output| !output.entries.is_empty());
    parameters.extend(written.map(|output| format!("real *{}", output.name)));
    let mut lines = Vec::new();
    wrap(&format!("{}({})", static_name(function.kind), parameters.join(", ")), &mut lines);
    lines.join("\n")
}

/// Returns the call of the function for an operation.
///
/// # Panics
/// If no function computes an operation of this mnemonic.
pub fn call(real: Real, mnemonic: &str, arguments: &[&str]) -> String {
    let (_, name) = CALLS
        .into_iter()
        .find(|(known, _)| *known == mnemonic)
        .unwrap_or_else(|| unreachable!("C has no name for {mnemonic}"));
    let suffix = if OWN.contains(&name) { "" } else { real.suffix() };
    format!("{name}{suffix}({})", arguments.join(", "))
}

/// Returns the comment lines that explain the prefixes of the constants' names.
fn legend(constants: &Constants) -> Vec<String> {
    let entry = |Quantity { name, meaning }: &Quantity| {
        format!("{}_..: {meaning}", name.to_ascii_uppercase())
    };
    constants.legend().iter().map(entry).collect()
}

/// Returns the table of constants, by group.
fn groups(program: &Program, constants: &Constants, real: Real) -> Vec<Group> {
    let line = |Constant { name, value, .. }: &Constant| {
        format!("static const real {name} = {};", constant(real, *value))
    };
    let group = |group: constants::Group<'_>| Group {
        heading: group.heading(&program.interface.nodes),
        lines: group.constants.iter().map(line).collect(),
    };
    constants.groups().map(group).collect()
}

/// Returns a number as a literal of the module's number type.
pub fn constant(real: Real, number: f64) -> String {
    let suffix = real.suffix();
    let sign = if number.is_sign_negative() { "-" } else { "" };
    let magnitude = match real {
        _ if number.is_nan() => return format!("(0.0{suffix} / 0.0{suffix})"),
        _ if number.is_infinite() => return format!("({sign}1.0{suffix} / 0.0{suffix})"),
        Real::Double => digits(number.abs()),
        Real::Float => digits(number.abs() as f32),
    };
    format!("{sign}{magnitude}{suffix}")
}
