//! Modules with some of the functions: these give the same results as those of the whole module, and everything
//! that needs a function that was left out returns an error.

use std::fmt::Write;
use std::fs;
use std::process::Command;

use lamc::backend::c::Real;
use lamc::backend::rust::Options;
use lamc::pipeline::{self, Compiled};
use lamc::program::{Interpreter, Selection};
use lamc_runtime::{Mechanism, Rk4, Rodas, State};
use lamc_tests::package::Package;
use lamc_tests::{MODULES, compile, relative_error, workspace};

use crate::c::{STRICT, compilers, successful};

const MODELS: [&str; 2] = ["triple_pendulum", "sixbar"];

/// Names of functions, and whether the module can be differentiated with them.
const SELECTIONS: [(&str, bool); 9] = [
    ("none", false),
    ("acceleration", false),
    ("projection", false),
    ("acceleration,projection", false),
    ("tangent", true),
    ("jacobian,projection", true),
    ("tangent,jacobian", true),
    ("energy,poses,points,reactions", false),
    ("all", true),
];

/// Steps, and their length, s.
const STEPS: (usize, f64) = (100, 1e-5);

/// The angle of the first joint at the start, rad: away from the singular flat state.
const FOLDED: f64 = 0.5;

/// How far motions may be apart, as a share of the largest number: projections stop at 1e-11 of the size, each
/// at another point.
const CLOSE: f64 = 1e-9;

/// Seconds that Rosenbrock's method is used for.
const IMPLICIT: f64 = 1e-3;

fn selection(names: &str) -> Selection {
    Selection::named(names.split(',')).unwrap()
}

type Moving = State<Vec<f64>, f64>;

/// The whole program, a folded state of it, and the state after the steps.
fn moved(compiled: &Compiled) -> (Interpreter, Moving, Moving) {
    let mut system = Interpreter::new(&compiled.program);
    system.set_initial(0, FOLDED);
    let start = system.assembled().unwrap();
    let (mut state, mut rk4) = (start.clone(), Rk4::new(&system));
    for _ in 0..STEPS.0 {
        rk4.step(&system, &mut state, STEPS.1).unwrap();
    }
    (system, start, state)
}

#[test]
fn rust_modules_with_any_functions_move_alike() {
    let mut package = Package::new();
    let mut expected = Vec::new();
    for model in MODELS {
        let compiled = compile(&workspace().join(format!("examples/{model}.yaml")));
        let (system, start, state) = moved(&compiled);
        let explicit = [state.q, state.u].concat();
        let (mut state, mut rodas) = (start.clone(), Rodas::new(&system));
        (rodas.relative, rodas.absolute) = (1e-9, 1e-9);
        lamc_runtime::Integrator::run(&mut rodas, &system, &mut state, IMPLICIT, |_| ()).unwrap();
        let implicit = [state.q, state.u].concat();
        for (index, (names, _)) in SELECTIONS.into_iter().enumerate() {
            let options = Options { functions: selection(names), ..Options::default() };
            let module = format!("{model}_{index}");
            package.add_with(&module, &compiled, &options);
            let (q, u) = (&start.q[..], &start.u[..]);
            package.ask(&module, "steps", &[q, u, &[STEPS.0 as f64, STEPS.1]]);
            package.ask(&module, "implicit", &[q, u, &[IMPLICIT]]);
            expected.push((explicit.clone(), implicit.clone()));
        }
    }
    let mut answers = package.answers();
    let mut next = || answers.next().expect("an answer to each question");
    let cases = MODELS.into_iter().flat_map(|model| SELECTIONS.map(|selection| (model, selection)));
    for ((model, (names, differentiates)), (explicit, implicit)) in cases.zip(&expected) {
        let found = next();
        let error = relative_error(&found, explicit);
        assert!(found.len() == explicit.len() && error <= CLOSE, "{model} {names}: {error:e}");
        let found = next();
        if differentiates {
            let error = relative_error(&found, implicit);
            assert!(found.len() == implicit.len() && error <= 1e-7, "{model} {names}: {error:e}");
        } else {
            assert!(found.is_empty(), "{model} {names} has no derivatives");
        }
    }
}

#[test]
fn c_modules_with_any_functions_move_alike() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for model in MODELS {
        let mut compiled = compile(&workspace().join(format!("examples/{model}.yaml")));
        let (_, start, state) = moved(&compiled);
        let whole = compiled.program.clone();
        for (index, (names, _)) in SELECTIONS.into_iter().enumerate() {
            compiled.program = whole.only(selection(names));
            let name = format!("{model}_{index}");
            let file = |end: &str| folder.join(format!("{name}.{end}"));
            let text = pipeline::c_source(&compiled, Real::Double, &format!("{name}.h")).unwrap();
            fs::write(file("c"), text).unwrap();
            let header = pipeline::c_header(&compiled, Real::Double);
            let has_energy = names.contains("energy") || names == "all";
            assert_eq!(header.contains("_energy("), has_energy, "{names}");
            fs::write(file("h"), header).unwrap();
            fs::write(file("main.c"), main(&name, model, &start)).unwrap();
            for compiler in compilers() {
                let mut command = Command::new(compiler);
                command.args(STRICT).args(["-O1", "-c", "-o"]).arg(file("o")).arg(file("c"));
                successful(&mut command, &format!("{compiler} {name}"));
            }
            let program = file("program");
            let mut command = Command::new("gcc");
            command.arg(file("main.c")).arg(file("c")).args(["-lm", "-o"]).arg(&program);
            successful(&mut command, &name);
            let printed = successful(&mut Command::new(&program), &name);
            let found: Vec<f64> = printed.split_whitespace().map(|x| x.parse().unwrap()).collect();
            let error = relative_error(&found, &[&state.q[..], &state.u].concat());
            assert!(error <= CLOSE, "{name} ({names}): {error:e}");
        }
    }
}

/// A program that prints q and u after the steps.
fn main(name: &str, model: &str, start: &Moving) -> String {
    let list = |numbers: &[f64]| format!("{numbers:?}").replace('[', "{ ").replace(']', " }");
    let (q, u) = (list(&start.q), list(&start.u));
    let upper = model.to_ascii_uppercase();
    let (count, dt) = STEPS;
    let mut text = String::new();
    writeln!(
        text,
        "#include \"{name}.h\"\n#include <stdio.h>\n
int main(void)
{{
    double t = 0, q[{upper}_N] = {q}, u[{upper}_N] = {u};
    {model}_params p;
    {model}_inputs in;
    {model}_params_default(&p);
    {model}_inputs_default(&in);
    for (int i = 0; i < {count}; i++)
        if ({model}_step_rk4(&t, q, u, {dt:?}, &p, &in)) return 1;
    for (int i = 0; i < {upper}_N; i++) printf(\"%.17g \", q[i]);
    for (int i = 0; i < {upper}_N; i++) printf(\"%.17g \", u[i]);
    return 0;
}}"
    )
    .unwrap();
    text
}

/// The header of a module that has everything names no functions, whatever the mechanism has nothing for.
#[test]
fn whole_modules_need_no_option() {
    for name in MODULES {
        let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
        assert_eq!(compiled.program.option(), "", "{name}");
        let Ok(some) = Selection::named(["energy", "acceleration"]) else { panic!() };
        let option = compiled.program.only(some).option();
        assert!(option.starts_with(" --functions energy,"), "{name}: {option}");
        assert!(!option.contains("poses"), "{name}: {option}");
    }
}
