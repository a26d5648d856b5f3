//! Functions as tables: their values against the interpreter, the modules that have them, and how long these are.

use lamc::backend::c::Real;
use lamc::backend::rust::Options;
use lamc::backend::tables::{Numbers, Table};
use lamc::pipeline::{Compiled, c_source, rust_module};
use lamc::program::{Form, FunctionKind, Interpreter};
use lamc_runtime::{Mechanism, acceleration, table};
use lamc_tests::modules::Workshop;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile, compile_text, relative_error, workspace};
use lamc_workbench::verify::Values;

use super::functions::{TOLERANCE, closed, samples};

/// Cells for the longest function here, a power of two.
const CELLS: usize = 1 << 14;

/// Longest module of a sheet of 6 x 6 plates, bytes.
const LONGEST_MODULE: usize = 400_000;

/// Longest C module of the same sheet, bytes: its rows are numbers.
const LONGEST_C_MODULE: usize = 1_700_000;

/// Compares all functions of a mechanism at closed angles and random numbers.
fn check(name: &str, compiled: &Compiled) {
    let mut numbers = Numbers::default();
    for sample in samples(compiled, 0.0) {
        let table = Table::of(sample.function, &mut numbers);
        assert!(table.words.cells <= CELLS, "{name}: {} cells", table.words.cells);
        let mut found: Vec<Vec<f64>> =
            sample.expected.iter().map(|output| vec![0.5; output.len()]).collect();
        let mut out: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        let given: Vec<&[f64]> = sample.arguments.iter().map(Vec::as_slice).collect();
        let bytes = table.words.bytes(CELLS);
        let evaluated = table::Table::<CELLS>::new(&bytes);
        evaluated.evaluate::<f64>(&numbers.list, &given, &mut out);
        sample.check(name, &found);
    }
}

#[test]
fn tables_of_examples_give_the_same_values() {
    for name in ["pendulum", "fourbar", "sixbar", "miura", "triple_pendulum"] {
        let path = workspace().join("examples").join(format!("{name}.yaml"));
        check(name, &compile(&path));
    }
}

#[test]
fn tables_of_sheets_give_the_same_values() {
    check("miura 4x4", &compile_text(&miura(4, 4)));
    check("yoshimura 3x3", &compile_text(&yoshimura(3, 3)));
}

/// The modules of a long sheet, compiled by rustc and a C compiler: du/dt by statements, energies by a table.
#[test]
fn modules_of_long_sheets_are_short_and_right() {
    let compiled = compile_text(&miura(6, 6));
    check("miura 6x6", &compiled);
    let program = &compiled.program;
    assert_eq!(program.form(FunctionKind::Acceleration), Form::Numbered);
    assert_eq!(program.form(FunctionKind::Projection), Form::Numbered);
    assert_eq!(program.form(FunctionKind::Energy), Form::Tables);
    let module = rust_module(&compiled, &Options::default()).unwrap();
    assert!(module.len() < LONGEST_MODULE, "{} bytes", module.len());

    let system = Interpreter::new(program);
    let q = closed(&system);
    let u = vec![0.0; q.len()];
    let mut rates = system.speeds();
    acceleration(&system, 0.0, &q, &u, &mut system.workspace(), &mut rates).unwrap();
    let energy = system.energy(0.0, &q, &u).unwrap();
    let expected: Vec<f64> = rates.into_iter().chain([energy.kinetic, energy.potential]).collect();
    let state = Values { q, u, ..Values::default() };
    let workshop = Workshop::new().unwrap();
    let states = [state];
    for answers in [workshop.rust(&compiled, &states), workshop.c(&compiled, &states)] {
        let answers = answers.unwrap();
        let found = answers[0].as_ref().unwrap();
        assert!(relative_error(found, &expected) < TOLERANCE);
    }
    let source = c_source(&compiled, Real::Double, "model.h").unwrap();
    assert!(source.len() < LONGEST_C_MODULE, "{} bytes", source.len());
}
