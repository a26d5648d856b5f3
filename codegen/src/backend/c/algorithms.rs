//! Selects the runtime's algorithms in C that a mechanism needs, and fills in its sizes and the
//! constants that the algorithms use.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use lamc_runtime::constants::Constant;
use lamc_templates::c;
use tera::Context;

use super::Real;
use super::body::constant;
use crate::program::{Interface, JointInfo, Program};

/// Adds the algorithms, the constants, and the mechanism's numbers to the template context.
pub fn insert(context: &mut Context, program: &Program, real: Real, constants: &[Constant]) {
    let interface = &program.interface;
    let is_float = real == Real::Float;
    context.insert("sqrt", if is_float { "sqrtf" } else { "sqrt" });
    context.insert("suffix", if is_float { "##f" } else { "" });
    context.insert("epsilon", if is_float { "FLT_EPSILON" } else { "DBL_EPSILON" });
    context.insert("size", &constant(real, interface.size));
    context.insert("full_turn", &constant(real, TAU));
    insert_joints(context, interface, real);

    let numbers = pasted(c::NUMBERS);
    let algorithms: Vec<String> = needed(interface).into_iter().map(pasted).collect();
    let named: BTreeSet<&str> = algorithms.iter().flat_map(|text| identifiers(text)).collect();
    let constants = constants.iter().filter(|constant| named.contains(constant.name));
    context.insert("constants", &super::constants(constants, real));
    context.insert("numbers", &numbers);
    context.insert("algorithms", &algorithms);
}

/// Adds the tables with one entry per joint, and the list of driven joints.
fn insert_joints(context: &mut Context, interface: &Interface, real: Real) {
    let driven: Vec<usize> = interface.driven().iter().map(|joint| joint.index()).collect();
    context.insert("driven", &driven);
    let table = |f: &dyn Fn(&JointInfo) -> f64| -> Vec<String> {
        interface.joints.iter().map(|joint| constant(real, f(joint))).collect()
    };
    let or = |limit: f64, instead: f64| if limit.is_finite() { limit } else { instead };
    context.insert("least", &table(&|joint| or(joint.limits[0], -PI)));
    context.insert("greatest", &table(&|joint| or(joint.limits[1], PI)));
    context.insert("initial_q", &table(&|joint| joint.initial_q));
    context.insert("initial_u", &table(&|joint| joint.initial_u));
    let given: Vec<u8> = interface.joints.iter().map(|joint| joint.initial_given.into()).collect();
    context.insert("given", &given);
}

/// Returns the C files that a mechanism needs, each after the files whose functions it calls.
fn needed(interface: &Interface) -> Vec<&'static str> {
    let (loops, drives) = (!interface.loops.is_empty(), !interface.driven().is_empty());
    let constrained = loops || drives;
    let mut files = vec![c::TYPES, c::LINEAR_ALGEBRA, c::CHOLESKY];
    if constrained {
        files.extend([c::PSEUDOINVERSE, c::INDEPENDENT, c::RANK, c::CLOSURE_ROWS, c::PASSAGE]);
    }
    files.push(c::ACCELERATION);
    if drives {
        files.push(c::MOTORS);
    }
    files.push(if constrained { c::PROJECTION } else { c::PROJECTION_WITHOUT_CONSTRAINTS });
    files.extend([c::RUNGE_KUTTA, c::FIXED_STEP, c::LIMITS]);
    if loops {
        files.extend([c::ASSEMBLY_STEPS, c::ASSEMBLY]);
    } else {
        files.push(c::ASSEMBLY_WITHOUT_LOOPS);
    }
    files.push(c::INITIAL);
    files
}

/// Returns a file without the `#include` line that it needs only when it is compiled separately.
fn pasted(file: &str) -> String {
    file.replace("#include \"algorithms.h\"\n", "")
}

/// Returns all identifiers in the C files from which a module is assembled: macros, functions and
/// types.
pub fn words(interface: &Interface) -> BTreeSet<&'static str> {
    let files = needed(interface).into_iter().chain([c::NUMBERS, lamc_templates::C_SOURCE]);
    let constants = lamc_runtime::constants::ALL.iter().map(|constant| constant.name);
    files.flat_map(identifiers).chain(constants).collect()
}

/// Returns the words of a text that may be identifiers.
pub fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}
