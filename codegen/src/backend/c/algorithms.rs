//! Selects the runtime's algorithms in C that a mechanism needs, and fills in its sizes and the
//! constants that the algorithms use.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use lamc_runtime::constants::Constant;
use lamc_runtime::plumbing::ROWS;
use lamc_templates::c;
use serde::Serialize;
use tera::Context;

use super::Real;
use super::body::constant;
use crate::program::{FreeBodyInfo, Interface, JointInfo, Program, ReductionInfo, SparseRows};
use crate::source::free::SPEEDS;

/// Adds the algorithms, the constants, and the mechanism's numbers to the template context.
pub fn insert(context: &mut Context, program: &Program, real: Real, constants: &[Constant]) {
    let interface = &program.interface;
    let is_float = real == Real::Float;
    context.insert("sqrt", if is_float { "sqrtf" } else { "sqrt" });
    let turns = turns(interface).into_iter();
    let turns = turns.map(|[name, function, arguments]| {
        format!("{name}({arguments}) {function}{}({arguments})", real.suffix())
    });
    context.insert("turns", &turns.collect::<Vec<_>>());
    context.insert("suffix", if is_float { "##f" } else { "" });
    context.insert("epsilon", if is_float { "FLT_EPSILON" } else { "DBL_EPSILON" });
    context.insert("size", &constant(real, interface.size));
    context.insert("full_turn", &constant(real, TAU));
    insert_state(context, interface, real);
    context.insert("reduction", &program.reduction().map(Pattern::of));

    let pasted = |file| pasted(file, interface);
    let numbers = pasted(c::NUMBERS);
    let algorithms: Vec<String> = needed(program).into_iter().map(pasted).collect();
    let named: BTreeSet<&str> = algorithms.iter().flat_map(|text| identifiers(text)).collect();
    let constants = constants.iter().filter(|constant| named.contains(constant.name));
    context.insert("constants", &super::constants(constants, real));
    context.insert("numbers", &numbers);
    context.insert("algorithms", &algorithms);
}

/// A reduction to independent speeds, as arrays.
#[derive(Serialize)]
struct Pattern<'a> {
    depth: usize,
    branch_joints: Vec<u16>,
    branch_depths: Vec<u16>,
    independent_branches: &'a [u16],
    dependent: usize,
    rows_of_step: usize,
    steps: Vec<[u16; ROWS]>,
    places: Vec<u16>,
    closure: &'a SparseRows,
    lower: &'a SparseRows,
    upper: &'a SparseRows,
}

impl<'a> Pattern<'a> {
    fn of(reduction: &'a ReductionInfo) -> Self {
        let (branch_joints, branch_depths) = reduction.branches.iter().copied().unzip();
        Self {
            depth: reduction.depth(),
            branch_joints,
            branch_depths,
            independent_branches: &reduction.independent,
            dependent: reduction.dependent().count(),
            rows_of_step: ROWS,
            steps: reduction.padded_steps(),
            places: reduction.places(),
            closure: &reduction.closure,
            lower: &reduction.lower,
            upper: &reduction.upper,
        }
    }
}

/// Adds the initial state, the limits of the joints, and the list of driven joints.
fn insert_state(context: &mut Context, interface: &Interface, real: Real) {
    let driven: Vec<usize> = interface.driven().iter().map(|joint| joint.index()).collect();
    context.insert("driven", &driven);
    let (joints, free) = (&interface.joints, &interface.free);
    let table = |of_joints: &dyn Fn(&JointInfo) -> f64,
                 of_free: &dyn Fn(&FreeBodyInfo) -> Vec<f64>| {
        let numbers = joints.iter().map(of_joints).chain(free.iter().flat_map(of_free));
        numbers.map(|number| constant(real, number)).collect::<Vec<_>>()
    };
    let or = |limit: f64, instead: f64| if limit.is_finite() { limit } else { instead };
    let unlimited = |sign: f64| move |_: &FreeBodyInfo| vec![sign * f64::INFINITY; SPEEDS];
    context.insert("least", &table(&|joint| or(joint.limits[0], -PI), &unlimited(-1.0)));
    context.insert("greatest", &table(&|joint| or(joint.limits[1], PI), &unlimited(1.0)));
    context.insert("initial_q", &table(&|joint| joint.initial_q, &|body| body.q.into()));
    context.insert("initial_u", &table(&|joint| joint.initial_u, &|body| body.u.into()));
    let mut given: Vec<u8> = joints.iter().map(|joint| joint.initial_given.into()).collect();
    // C has no arrays without entries.
    given.resize(given.len().max(1), 0);
    context.insert("given", &given);
}

/// Returns the names by which the algorithms call the functions of the library for rotations, these functions
/// without the suffix for `float`, and their arguments.
fn turns(interface: &Interface) -> Vec<[&'static str; 3]> {
    let (free, loops) = (!interface.free.is_empty(), !interface.loops.is_empty());
    let mut turns = Vec::new();
    if free && (loops || !interface.driven().is_empty()) {
        turns.extend([["sine", "sin", "x"], ["cosine", "cos", "x"]]);
    }
    if free && loops {
        turns.push(["angle_of", "atan2", "y, x"]);
    }
    turns
}

/// Returns the functions of the library that the algorithms call, without the suffix for `float`.
pub fn library(interface: &Interface) -> impl Iterator<Item = &'static str> {
    ["sqrt"].into_iter().chain(turns(interface).into_iter().map(|[_, function, _]| function))
}

/// Returns the C files that a mechanism needs, each after the files whose functions it calls.
fn needed(program: &Program) -> Vec<&'static str> {
    let interface = &program.interface;
    let (loops, drives) = (!interface.loops.is_empty(), !interface.driven().is_empty());
    let constrained = loops || drives;
    let mut files = vec![c::TYPES, c::LINEAR_ALGEBRA, c::CHOLESKY];
    if !interface.free.is_empty() {
        files.push(c::FREE_BODIES);
    }
    if constrained {
        files.extend([c::PSEUDOINVERSE, c::INDEPENDENT, c::RANK, c::CLOSURE_ROWS, c::PASSAGE]);
    }
    if program.reduction().is_some() {
        files.extend([c::ELIMINATION, c::REDUCTION]);
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

/// Returns a file as it stands in the module: without the `#include` line that it needs only when it is compiled
/// separately, and without free bodies where there are none.
fn pasted(file: &str, interface: &Interface) -> String {
    let file = file.replace("#include \"algorithms.h\"\n", "");
    if interface.free.is_empty() { without_free(&file) } else { file }
}

/// Returns a file for mechanisms without free bodies: their joints, coordinates and speeds have one number. Of the
/// lines behind `#if FREE_COUNT > 0` only those behind its `#else` stay. No other conditions stand in between.
fn without_free(file: &str) -> String {
    let mut text = String::new();
    let (mut is_inside, mut is_left_out) = (false, false);
    for line in file.lines() {
        match line {
            "#if FREE_COUNT > 0" => (is_inside, is_left_out) = (true, true),
            "#else" if is_inside => is_left_out = false,
            "#endif" if is_inside => (is_inside, is_left_out) = (false, false),
            _ if is_left_out => {}
            _ => {
                text.push_str(line);
                text.push('\n');
            }
        }
    }
    let is_end = |c: char| !c.is_ascii_alphanumeric() && c != '_';
    let renamed = |piece: &str| match piece.trim_end_matches(is_end) {
        size @ ("SPEEDS" | "JOINTS") => piece.replace(size, "COORDINATES"),
        _ => piece.to_owned(),
    };
    text.split_inclusive(is_end).map(renamed).collect()
}

/// Returns all identifiers in the C files from which a module is assembled: macros, functions and
/// types.
pub fn words(program: &Program) -> BTreeSet<String> {
    let interface = &program.interface;
    let files = needed(program).into_iter().chain([c::NUMBERS, lamc_templates::C_SOURCE]);
    let texts: Vec<String> = files.map(|file| pasted(file, interface)).collect();
    let constants = lamc_runtime::constants::ALL.iter().map(|constant| constant.name);
    let words = texts.iter().flat_map(|text| identifiers(text)).chain(constants);
    words.map(str::to_owned).collect()
}

/// Returns the words of a text that may be identifiers.
pub fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}
