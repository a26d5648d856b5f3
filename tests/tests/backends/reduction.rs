//! Solutions by independent speeds in loops of the runtime: Rust and C against the interpreter, where the runtime is the
//! same and where it is not.

use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline::{Compiled, rust_module};
use lamc::program::{FunctionKind, Interpreter};
use lamc_runtime::{Mechanism, acceleration, assemble, project};
use lamc_tests::modules::Workshop;
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile_text, relative_error};
use lamc_workbench::verify::Values;

/// How far accelerations may differ, as a share of the largest: products are rounded together with sums on some
/// processors, and C adds in another order.
const TOLERANCE: f64 = 1e-11;

/// The accelerations and energies of modules at closed states near the start.
fn check(name: &str, compiled: &Compiled) {
    let program = &compiled.program;
    let reduction = program.reduction().unwrap_or_else(|| panic!("{name} has no reduction"));
    assert!(program.function_of(FunctionKind::Acceleration).outputs.is_empty(), "{name}");
    println!(
        "{name}: {} joints, {} independent",
        reduction.branches.len(),
        reduction.independent.len()
    );
    let system = Interpreter::new(program);
    let mut workspace = system.workspace();
    let mut random = Random::new(17);
    let (mut states, mut expected) = (Vec::new(), Vec::new());
    for share in [1.0, 0.8, 1.1] {
        let mut q: Vec<f64> = system.initial().q.iter().map(|q| share * q).collect();
        let mut u: Vec<f64> = q.iter().map(|_| random.range(-2.0, 2.0)).collect();
        let mut pinned = vec![false; q.len()];
        system.drives(0.0, |drive| {
            q[drive.joint] = drive.position;
            pinned[drive.joint] = true;
        });
        assemble(&system, 0.0, &mut q, &pinned, &mut workspace).unwrap();
        project(&system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
        let mut rates = system.speeds();
        acceleration(&system, 0.0, &q, &u, &mut workspace, &mut rates).unwrap();
        let energy = system.energy(0.0, &q, &u).unwrap();
        rates.extend([energy.kinetic, energy.potential]);
        expected.push(rates);
        states.push(Values { q, u, ..Values::default() });
    }
    let workshop = Workshop::new().unwrap();
    let [rust, c] = [workshop.rust(compiled, &states), workshop.c(compiled, &states)];
    for (language, answers) in [("Rust", rust), ("C", c)] {
        for (answer, expected) in answers.unwrap().iter().zip(&expected) {
            let found = answer.as_ref().unwrap();
            let error = relative_error(found, expected);
            assert!(error < TOLERANCE, "{name} in {language}: {error:e}");
        }
    }
}

/// A sheet whose first joint is driven.
fn driven(text: &str) -> Compiled {
    compile_text(&text.replacen("stiffness:", "drive: 0.8 + 0.3*sin(2*t), stiffness:", 1))
}

#[test]
fn modules_of_many_speeds_agree_with_the_interpreter() {
    check("yoshimura 3x8", &compile_text(&yoshimura(3, 8)));
}

#[test]
fn modules_of_driven_loops_agree_with_the_interpreter() {
    check("miura 4x4", &driven(&miura(4, 4)));
    check("yoshimura 3x3", &driven(&yoshimura(3, 3)));
}

/// What a module leaves out, it leaves out whole: without its acceleration it has nothing of the reduction.
#[test]
fn a_module_without_acceleration_has_no_reduction() {
    let compiled = driven(&miura(3, 3));
    let module = |functions: &str| {
        let functions = lamc::program::Selection::named(functions.split(',')).unwrap();
        let options = Options { scalar: ScalarChoice::F64, functions, ..Options::default() };
        rust_module(&compiled, &options).unwrap()
    };
    assert!(module("acceleration").contains("ReductionParts<f64> for"));
    assert!(!module("projection,energy").contains("ReductionParts"));
}
