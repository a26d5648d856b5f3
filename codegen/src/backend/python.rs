//! The Python backend: a module that calls the C module through NumPy and ctypes. Loops over rows run
//! in C.

use serde::Serialize;
use tera::{Context, Tera};

use super::c::{Real, STATUS};
use super::identifiers::type_name;
use super::text::comment;
use crate::program::Program;

#[derive(Serialize)]
struct Value {
    name: String,
    value: String,
    doc: String,
}

/// Returns the Python module that compiles and calls the C source and header with these names in its
/// own folder.
pub fn write(program: &Program, real: Real, source_name: &str, header_name: &str) -> String {
    let interface = &program.interface;
    let mut context = Context::new();
    context.insert("version", env!("CARGO_PKG_VERSION"));
    context.insert("source_name", &comment(&interface.source_name));
    context.insert("name", &interface.name);
    context.insert("upper", &interface.name.to_ascii_uppercase());
    context.insert("class", &type_name(&interface.name));
    context.insert("c_file", &quoted(source_name));
    context.insert("header_file", &quoted(header_name));
    context.insert("real", real.name());
    let dtype = match real {
        Real::Double => "float64",
        Real::Float => "float32",
    };
    context.insert("dtype", dtype);
    counts(program).iter().for_each(|(name, count)| context.insert(*name, count));
    let free: Vec<&String> = interface.free.iter().map(|body| &body.name).collect();
    context.insert("free_bodies", &free);
    // The lengths of q and u and the number of joints, as Python and C know them; what they are without free bodies.
    let [nq, nu, joints, pins] = match free.is_empty() {
        true => ["N", "N", "N", "self.N"],
        false => ["NQ", "NU", "JOINTS", "len(self.JOINTS)"],
    };
    context.insert("nq", nq);
    context.insert("nu", nu);
    context.insert("nj", joints);
    context.insert("pins", pins);
    // Where q and u differ in length, the documentation says both.
    let shape =
        |lead: &str| if free.is_empty() { String::new() } else { format!(" ({lead}..., NQ)") };
    context.insert("shape_of_q", &shape(""));
    context.insert("shape_of_qs", &shape("S, "));
    let joints: Vec<&String> = interface.joints.iter().map(|joint| &joint.name).collect();
    context.insert("joints", &joints);
    let bodies: Vec<&String> = interface.bodies.iter().map(|body| &body.name).collect();
    context.insert("bodies", &bodies);
    context.insert("points", &interface.points);
    context.insert("contacts", &interface.contacts);
    let parameters = interface.parameters.iter().map(|parameter| Value {
        name: parameter.name.clone(),
        value: format!("{:?}", parameter.value),
        doc: comment(&parameter.doc),
    });
    let parameters: Vec<Value> = parameters.collect();
    let example =
        parameters.first().map(|parameter| format!("{}={}", parameter.name, parameter.value));
    context.insert("example", &example.unwrap_or_default());
    context.insert("parameters", &parameters);
    context.insert("inputs", &interface.inputs);
    context.insert("codes", &STATUS);
    match Tera::one_off(lamc_templates::PYTHON, &context, false) {
        Ok(text) => text,
        Err(error) => unreachable!("the template is at fault: {error:?}"),
    }
}

/// Returns the counts that the template knows, by name.
fn counts(program: &Program) -> [(&'static str, usize); 6] {
    let interface = &program.interface;
    [
        ("coordinates", interface.coordinates()),
        ("speeds", interface.speeds()),
        ("rows", interface.rows),
        ("loops", interface.loops.len()),
        ("drives", interface.driven().len()),
        ("drawn", interface.drawn),
    ]
}

/// Returns a string literal. Python accepts the JSON notation for the strings that occur here.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
