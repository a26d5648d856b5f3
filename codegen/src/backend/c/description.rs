//! What the header and the source contain about a mechanism besides its functions.

use lamc_runtime::constants::STEP_PIECES;
use serde::Serialize;
use tera::Context;

use super::Real;
use super::body::constant;
use crate::backend::identifiers::Names;
use crate::backend::text::{comment, cuts, joints};
use crate::program::{ControllerInfo, Interface, Program};
use crate::source::free::{COORDINATES, SPEEDS};

/// A status code that functions return.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Status {
    /// Name, without the module's prefix.
    pub name: &'static str,
    /// Number, the same as `lamc_runtime::Error::code` returns.
    pub number: i32,
    /// Meaning of the code.
    pub what: &'static str,
}

/// All status codes, in the order of their numbers.
pub const STATUS: [Status; 6] = [
    Status { name: "OK", number: 0, what: "done" },
    Status { name: "MASS_MATRIX", number: 1, what: "the mass matrix is not positive definite" },
    Status { name: "NOT_FINITE", number: 2, what: "a value is infinite or not a number" },
    Status { name: "NOT_CLOSED", number: 3, what: "a loop cannot be closed" },
    Status { name: "NOT_DRIVEN", number: 4, what: "a driven joint cannot be where it should" },
    Status { name: "TIME", number: 5, what: "a time or a step is no usable number" },
];

#[derive(Serialize)]
struct Field {
    name: String,
    doc: String,
    value: String,
}

/// A free body, with the first and the last of its places in q and u.
#[derive(Serialize)]
struct FreeBody<'a> {
    name: &'a str,
    q: usize,
    last_q: usize,
    u: usize,
    last_u: usize,
}

/// Returns the free bodies, in the order of q and u.
fn free_bodies(interface: &Interface) -> Vec<FreeBody<'_>> {
    let body = |(index, name)| {
        let joints = interface.joints.len();
        let (q, u) = (joints + COORDINATES * index, joints + SPEEDS * index);
        FreeBody { name, q, last_q: q + COORDINATES - 1, u, last_u: u + SPEEDS - 1 }
    };
    interface.free.iter().map(|body| body.name.as_str()).enumerate().map(body).collect()
}

/// Named indices into one kind of array, for example the joints.
#[derive(Serialize)]
struct Indices {
    what: &'static str,
    prefix: &'static str,
    names: Vec<String>,
}

/// Names that are macros of the C library, or of compilers that are not told to follow the standard.
pub const MACROS: [&str; 4] = ["linux", "unix", "i386", "errno"];

/// Returns the names of the struct fields for parameters or inputs.
pub fn fields<'a>(names: impl IntoIterator<Item = &'a String>) -> Vec<String> {
    let mut given = Names::reserving(&MACROS);
    names.into_iter().map(|name| given.give(name)).collect()
}

/// Returns the lengths of arrays by the names that the templates give them.
fn counts(interface: &Interface) -> [(&'static str, usize); 7] {
    [
        ("coordinates", interface.coordinates()),
        ("speeds", interface.speeds()),
        // C has no arrays without entries.
        ("pins", interface.joints.len().max(1)),
        ("rows", interface.rows),
        ("residuals", 9 * interface.loops.len()),
        ("drives", interface.driven().len()),
        ("drawn", interface.drawn),
    ]
}

/// A controller as macros.
#[derive(Serialize)]
struct Controller {
    name: String,
    /// Suffix of the macro, value and meaning.
    numbers: Vec<(&'static str, String, &'static str)>,
}

/// Returns the times and the modulation of the controllers.
fn controllers(interface: &Interface, real: Real) -> Vec<Controller> {
    let names: Vec<&String> = interface.controllers.iter().map(|it| &it.name).collect();
    let described = interface.controllers.iter().zip(upper(&names)).map(|(controller, name)| {
        let mut numbers = vec![
            ("SAMPLE", controller.sample, "time between samples, s"),
            ("DELAY", controller.delay, "time from a sample until its commands act, s"),
        ];
        if let Some(pwm) = &controller.pwm {
            numbers.extend([
                ("PWM_PERIOD", pwm.period, "period of the modulation, s"),
                ("PWM_LOWER", pwm.levels[0], "lower level of the inputs"),
                ("PWM_UPPER", pwm.levels[1], "upper level of the inputs"),
                ("PWM_LEAST", pwm.duty[0], "least share of a period at the upper level"),
                ("PWM_GREATEST", pwm.duty[1], "greatest share of a period at the upper level"),
            ]);
        }
        let number = |(suffix, value, what)| (suffix, constant(real, value), what);
        Controller { name, numbers: numbers.into_iter().map(number).collect() }
    });
    described.collect()
}

/// Returns the names of what controllers remember.
fn remembered(interface: &Interface) -> Vec<String> {
    let of = |controller: &ControllerInfo| {
        let names = controller.memory.iter().map(|(name, _)| format!("{}.{name}", controller.name));
        names.collect::<Vec<_>>()
    };
    interface.controllers.iter().flat_map(of).collect()
}

/// Returns the names of what arrays hold, one kind after the other.
fn indices(interface: &Interface) -> Vec<Indices> {
    let bodies = interface.bodies.iter().map(|body| &body.name).collect();
    let joint_names = interface.joints.iter().map(|joint| &joint.name).collect();
    let commands: Vec<&String> =
        interface.commands().map(|id| &interface.inputs[id.index()]).collect();
    let memory: Vec<String> = remembered(interface);
    [
        ("Joints, in the order of q and u.", "JOINT", joint_names),
        ("Bodies, in the order of the poses.", "BODY", bodies),
        ("Points, in their order.", "POINT", interface.points.iter().collect()),
        ("Contact points, in their order.", "CONTACT", interface.contacts.iter().collect()),
        (
            "What controllers remember, in the order of their memory.",
            "MEMORY",
            memory.iter().collect(),
        ),
        ("Inputs that controllers drive, in the order of their commands.", "COMMAND", commands),
    ]
    .into_iter()
    .filter(|(_, _, names)| !names.is_empty())
    .map(|(what, prefix, names)| Indices { what, prefix, names: upper(&names) })
    .collect()
}

/// Returns the values that the templates of the header and of the source have in common.
pub fn of(program: &Program, real: Real) -> Context {
    let interface = &program.interface;
    let mut context = Context::new();
    context.insert("version", env!("CARGO_PKG_VERSION"));
    context.insert("name", &interface.name);
    context.insert("upper", &interface.name.to_ascii_uppercase());
    context.insert("source_name", &comment(&interface.source_name));
    context.insert("source_hash", &interface.source_hash);
    let scalar = if real == Real::Float { " --scalar f32" } else { "" };
    let functions = program.option();
    let name = &interface.name;
    let flags = format!("{scalar}{functions} --c {name}.c --header {name}.h{}", cuts(interface));
    context.insert("flags", &flags);
    context.insert("joints", &joints(interface));
    context.insert("mobility", &interface.mobility);
    context.insert("loops", &interface.loops);
    counts(interface).into_iter().for_each(|(name, count)| context.insert(name, &count));
    context.insert("free_bodies", &free_bodies(interface));
    let bodies: Vec<&String> = interface.bodies.iter().map(|body| &body.name).collect();
    context.insert("bodies", &bodies);
    context.insert("points", &interface.points);
    context.insert("contacts", &interface.contacts);
    context.insert("codes", &STATUS);
    context.insert("pieces", &STEP_PIECES);
    context.insert("attempts", &(2 * STEP_PIECES - 1));
    context.insert("indices", &indices(interface));
    let initial: Vec<_> = interface.memory().map(|(_, value)| constant(real, *value)).collect();
    context.insert("memory", &initial);
    context.insert("controllers", &controllers(interface, real));
    let names = fields(interface.parameters.iter().map(|parameter| &parameter.name));
    let parameters = names.into_iter().zip(&interface.parameters).map(|(name, parameter)| Field {
        name,
        doc: comment(&format!("{} Default: {:?}.", parameter.doc, parameter.value)),
        value: constant(real, parameter.value),
    });
    context.insert("parameters", &parameters.collect::<Vec<_>>());
    let inputs = fields(&interface.inputs).into_iter().map(|name| Field {
        name,
        doc: String::new(),
        value: String::new(),
    });
    context.insert("inputs", &inputs.collect::<Vec<_>>());
    context.insert("real", real.name());
    context.insert("bytes", &real.bytes());
    context.insert("stack", &megabytes_of_stack(interface, real));
    context
}

/// The dense matrices that assemblies and steps next to singular states have on the stack, MB, if that is more than one: M, its factor,
/// the rows of the closure with two copies, and the Jacobian of the residuals.
fn megabytes_of_stack(interface: &Interface, real: Real) -> Option<usize> {
    let (n, loops) = (interface.speeds(), interface.loops.len());
    let numbers = n * (2 * n + 3 * interface.rows + 9 * loops);
    Some(numbers * real.bytes() / 1_000_000).filter(|&megabytes| megabytes > 0)
}

/// Returns the names in upper case, with underscores for dots. Names that differ only in case are numbered.
fn upper(names: &[&String]) -> Vec<String> {
    let mut given = Names::default();
    names.iter().map(|name| given.give(&name.replace('.', "_")).to_ascii_uppercase()).collect()
}
