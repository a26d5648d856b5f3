//! The mechanism's functions as C.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use serde::Serialize;
use tera::Context;

use super::Real;
use super::description::fields;
use crate::backend::literal::digits;
use crate::backend::parts::Parts;
use crate::backend::statements::{Expression, SineCosine, Statement, statements};
use crate::backend::text::wrap;
use crate::program::{Function, FunctionKind, Op, Program, Slot};

/// What locals must not be called: parameters, functions and types of the template that a body
/// uses or that would be confusing.
const RESERVED: [&str; 37] = [
    "t",
    "q",
    "u",
    "p",
    "in",
    "mass",
    "forcing",
    "jacobian",
    "gamma",
    "residual",
    "poses",
    "points",
    "kinetic",
    "potential",
    "drive",
    "real",
    "sin",
    "cos",
    "tan",
    "exp",
    "tanh",
    "log",
    "pow",
    "atan2",
    "sqrt",
    "magnitude",
    "smaller",
    "larger",
    "step_of",
    "linux",
    "unix",
    "i386",
    "size",
    "acceleration",
    "positions",
    "speeds",
    "margin",
];

/// A static function: its head, the parameters that it does not read, its lines.
#[derive(Serialize)]
struct Written {
    signature: String,
    unused: Vec<&'static str>,
    lines: Vec<String>,
}

#[derive(Serialize)]
struct Cost {
    name: String,
    cost: String,
}

/// Which helper functions of the template are used by the mechanism's functions.
#[derive(Serialize)]
struct Uses {
    min: bool,
    max: bool,
    step: bool,
}

/// Adds what only the source needs.
pub fn insert(context: &mut Context, program: &Program, real: Real) {
    let interface = &program.interface;
    let functions = functions(program);
    let ops: Vec<Op> = functions
        .iter()
        .flat_map(|&(kind, ..)| &program.function_of(kind).instructions)
        .map(|instruction| instruction.op)
        .collect();
    let mut library = BTreeSet::from(["sqrt"]);
    library.extend(ops.iter().filter_map(|&op| library_function(op)));
    let suffix = real.suffix();
    let library: Vec<_> = library.iter().map(|name| format!("{name}{suffix}")).collect();
    context.insert("library", &library);
    context.insert("sqrt", &format!("sqrt{suffix}"));
    context.insert("suffix", if suffix.is_empty() { "" } else { "##f" });
    context.insert("epsilon", if real == Real::Float { "FLT_EPSILON" } else { "DBL_EPSILON" });
    let any = |wanted: fn(&Op) -> bool| ops.iter().any(wanted);
    let uses = Uses {
        min: any(|op| matches!(op, Op::Min(..))),
        max: any(|op| matches!(op, Op::Max(..))),
        step: any(|op| matches!(op, Op::Step(_))),
    };
    context.insert("uses", &uses);
    let driven: Vec<usize> = interface.driven().iter().map(|joint| joint.index()).collect();
    context.insert("constrained", &(!interface.loops.is_empty() || !driven.is_empty()));
    let offers = |wanted| functions.iter().any(|&(kind, ..)| kind == wanted);
    context.insert("solves", &offers(FunctionKind::Acceleration));
    context.insert("corrects", &offers(FunctionKind::Projection));
    let passes = !driven.is_empty();
    context.insert("into", if passes { ", real *multipliers" } else { "" });
    context.insert("none", if passes { ", 0" } else { "" });
    context.insert("driven", &driven);
    context.insert("size", &constant(real, interface.size));
    let table = |f: &dyn Fn(&crate::program::JointInfo) -> f64| -> Vec<String> {
        interface.joints.iter().map(|joint| constant(real, f(joint))).collect()
    };
    let or = |limit: f64, instead: f64| if limit.is_finite() { limit } else { instead };
    context.insert("least", &table(&|joint| or(joint.limits[0], -PI)));
    context.insert("greatest", &table(&|joint| or(joint.limits[1], PI)));
    context.insert("initial_q", &table(&|joint| joint.initial_q));
    context.insert("initial_u", &table(&|joint| joint.initial_u));
    let given: Vec<u8> = interface.joints.iter().map(|joint| joint.initial_given.into()).collect();
    context.insert("given", &given);
    let printer = Printer {
        real,
        parameters: fields(interface.parameters.iter().map(|parameter| &parameter.name)),
        inputs: fields(&interface.inputs),
    };
    let written: Vec<Written> = functions
        .iter()
        .map(|&(kind, name, given, outputs)| {
            printer.function(program, program.function_of(kind), name, given, outputs)
        })
        .collect();
    context.insert("functions", &written);
    let cost = |&(kind, ..): &Static| {
        let function = program.function_of(kind);
        Cost { name: function.kind.name(), cost: function.cost().to_string() }
    };
    context.insert("costs", &functions.iter().map(cost).collect::<Vec<_>>());
}

/// A function's kind, its name, what it is given, and its outputs with the arrays they go to.
type Static =
    (FunctionKind, &'static str, &'static [&'static str], &'static [(&'static str, &'static str)]);

const POSITION: &[&str] = &["q"];
const MOTION: &[&str] = &["t", "q", "u", "p", "in"];
const SHAPE: &[&str] = &["q", "u", "p"];
const TIME: &[&str] = &["t", "p", "in"];

/// The functions a mechanism has: those that write nothing are left out.
fn functions(program: &Program) -> Vec<Static> {
    let all: [Static; 8] = [
        (
            FunctionKind::Equations,
            "equations",
            MOTION,
            &[
                ("mass", "mass"),
                ("forcing", "forcing"),
                ("jacobian", "jacobian"),
                ("gamma", "gamma"),
            ],
        ),
        (
            FunctionKind::Closure,
            "closure",
            POSITION,
            &[("residual", "residual"), ("jacobian", "jacobian")],
        ),
        (FunctionKind::Poses, "poses_of", POSITION, &[("poses", "poses")]),
        (FunctionKind::Points, "points_of", POSITION, &[("points", "points")]),
        (
            FunctionKind::Energy,
            "energies",
            MOTION,
            &[("kinetic", "kinetic"), ("potential", "potential")],
        ),
        (FunctionKind::Drives, "drives", TIME, &[("drives", "drive")]),
        (
            FunctionKind::Acceleration,
            "acceleration_of",
            MOTION,
            &[("acceleration", "acceleration"), ("margin", "margin")],
        ),
        (
            FunctionKind::Projection,
            "projection_of",
            SHAPE,
            &[
                ("residual", "residual"),
                ("positions", "positions"),
                ("speeds", "speeds"),
                ("margin", "margin"),
            ],
        ),
    ];
    let writes =
        |kind| program.function_of(kind).outputs.iter().any(|output| !output.entries.is_empty());
    all.into_iter().filter(|&(kind, ..)| writes(kind)).collect()
}

/// The library's function behind an operation.
fn library_function(op: Op) -> Option<&'static str> {
    match op {
        Op::Sqrt(_)
        | Op::Sin(_)
        | Op::Cos(_)
        | Op::Tan(_)
        | Op::Exp(_)
        | Op::Tanh(_)
        | Op::Pow(..)
        | Op::Atan2(..) => Some(op.mnemonic()),
        Op::Ln(_) => Some("log"),
        _ => None,
    }
}

struct Printer {
    real: Real,
    parameters: Vec<String>,
    inputs: Vec<String>,
}

impl Printer {
    fn function(
        &self,
        program: &Program,
        function: &Function,
        name: &str,
        given: &'static [&'static str],
        outputs: &[(&str, &str)],
    ) -> Written {
        let model = &program.interface.name;
        let parts = Parts::whole(function);
        let stretch = statements(program, function, &parts, &RESERVED).remove(0);
        let mut parameters: Vec<String> = given
            .iter()
            .map(|&name| match name {
                "t" => "real t".to_owned(),
                "p" => format!("const {model}_params *p"),
                "in" => format!("const {model}_inputs *in"),
                array => format!("const real *{array}"),
            })
            .collect();
        let mut lines = Vec::new();
        for statement in &stretch.list {
            self.statement(&program.interface.nodes, statement, &mut lines);
        }
        for (output, place) in outputs {
            let entries = stretch.entries.iter().filter(|(name, ..)| name == output);
            for (_, index, entry) in entries {
                let value = self.expression(entry);
                wrap(&format!("    {place}[{index}] = {value};"), &mut lines);
            }
            if function.outputs.iter().any(|o| o.name == *output && !o.entries.is_empty()) {
                parameters.push(format!("real *{place}"));
            }
        }
        let reads: BTreeSet<_> = function
            .instructions
            .iter()
            .filter_map(|instruction| match instruction.op {
                Op::Load(slot) => Some(parameter_of(slot)),
                _ => None,
            })
            .collect();
        let unused = given.iter().copied().filter(|name| !reads.contains(name)).collect();
        let mut signature = Vec::new();
        wrap(&format!("{name}({})", parameters.join(", ")), &mut signature);
        Written { signature: signature.join("\n"), unused, lines }
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
                let suffix = self.real.suffix();
                let function = match *function {
                    "abs" => "magnitude".to_owned(),
                    "min" => "smaller".to_owned(),
                    "max" => "larger".to_owned(),
                    "step" => "step_of".to_owned(),
                    "ln" => format!("log{suffix}"),
                    library => format!("{library}{suffix}"),
                };
                let arguments: Vec<_> = arguments.iter().map(|x| self.expression(x)).collect();
                format!("{function}({})", arguments.join(", "))
            }
        }
    }

    fn load(&self, slot: Slot) -> String {
        match slot {
            Slot::Time => "t".to_owned(),
            Slot::Position(id) => format!("q[{}]", id.index()),
            Slot::Rate(id) => format!("u[{}]", id.index()),
            Slot::Parameter(id) => format!("p->{}", self.parameters[id.index()]),
            Slot::Input(id) => format!("in->{}", self.inputs[id.index()]),
            Slot::Acceleration(_) | Slot::Multiplier(_) | Slot::Change(_) => {
                unreachable!("no function of the C module reads {slot:?}")
            }
        }
    }
}

/// The parameter of a C function through which it reads a slot.
fn parameter_of(slot: Slot) -> &'static str {
    match slot {
        Slot::Time => "t",
        Slot::Position(_) => "q",
        Slot::Rate(_) => "u",
        Slot::Parameter(_) => "p",
        Slot::Input(_) => "in",
        Slot::Acceleration(_) | Slot::Multiplier(_) | Slot::Change(_) => "",
    }
}

/// A number of the module's type.
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
