//! The header comment: where the module comes from and what it contains.

use serde::Serialize;
use tera::{Context, Tera};

use super::{Options, ScalarChoice};
use crate::backend::text::{comment, cuts, joints};
use crate::program::{Function, FunctionKind, Program};

#[derive(Serialize)]
struct Cost {
    name: &'static str,
    cost: String,
}

/// Returns the header comment of a program's module.
pub fn header(program: &Program, options: &Options) -> String {
    let interface = &program.interface;
    let mut context = Context::new();
    context.insert("version", env!("CARGO_PKG_VERSION"));
    context.insert("rust_version", env!("CARGO_PKG_RUST_VERSION"));
    context.insert("name", &interface.name);
    context.insert("source_name", &comment(&interface.source_name));
    context.insert("source_hash", &interface.source_hash);
    let flags = match options.scalar {
        ScalarChoice::Generic => "",
        ScalarChoice::F64 => " --scalar f64",
        ScalarChoice::F32 => " --scalar f32",
    };
    let exports = if options.extern_c { " --extern-c" } else { "" };
    let functions = options.functions.option();
    context.insert("flags", &format!("{flags}{exports}{functions}{}", cuts(interface)));
    context.insert("joints", &joints(interface));
    context.insert("mobility", &interface.mobility);
    context.insert("loops", &interface.loops);
    let cost = |f: &Function| Cost { name: f.kind.name(), cost: f.cost().to_string() };
    // Only mechanisms with contacts have gaps, only those with controllers have control, only some drawings have
    // parameters, and only some accelerations a reduction.
    let is_rare = |kind| {
        matches!(
            kind,
            FunctionKind::Gaps
                | FunctionKind::Control
                | FunctionKind::Drawing
                | FunctionKind::Reduction
                | FunctionKind::ProjectionReduction
        )
    };
    let is_written = |f: &&Function| {
        options.functions.contains(f.kind) && !(is_rare(f.kind) && f.outputs.is_empty())
    };
    let written = program.functions.iter().filter(is_written);
    context.insert("costs", &written.map(cost).collect::<Vec<_>>());
    match Tera::one_off(lamc_templates::RUST_HEADER, &context, false) {
        Ok(header) => header,
        Err(error) => unreachable!("the header's template is at fault: {error}"),
    }
}
