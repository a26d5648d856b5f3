//! Functions as tables: their values against the interpreter, the modules that have them, and how long these are.

use lamc::backend::c::Real;
use lamc::backend::rust::Options;
use lamc::backend::tables::{Numbers, Table};
use lamc::pipeline::{Compiled, c_source, rust_module};
use lamc::program::{Argument, Engine, Form, FunctionKind, Interpretation, Interpreter, Slot};
use lamc_runtime::{Mechanism, acceleration, assemble, table};
use lamc_tests::compare::{keep_largest, largest};
use lamc_tests::modules::Workshop;
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile, compile_text, relative_error, workspace};
use lamc_workbench::verify::Values;

/// Cells for the longest function here, a power of two.
const CELLS: usize = 1 << 14;

/// How far values may differ, as a share of the largest of an output: products are rounded together with sums
/// on some processors.
const TOLERANCE: f64 = 1e-12;

/// Longest module of a sheet of 6 x 6 plates, bytes.
const LONGEST_MODULE: usize = 400_000;

/// Longest C module of the same sheet, bytes: its rows are numbers.
const LONGEST_C_MODULE: usize = 1_700_000;

/// Closed angles near those of the start.
fn closed(system: &Interpreter) -> Vec<f64> {
    let mut q = system.initial().q;
    let pinned = vec![false; q.len()];
    assemble(system, 0.0, &mut q, &pinned, &mut system.workspace()).unwrap();
    q
}

/// Compares all functions of a mechanism at closed angles and random numbers.
fn check(name: &str, compiled: &Compiled) {
    let program = &compiled.program;
    let (system, engine) = (Interpreter::new(program), Interpretation::new(program));
    let mut random = Random::new(7);
    let mut argument = |argument: Argument| match argument {
        Argument::Positions => closed(&system),
        Argument::Parameters => system.parameters().to_vec(),
        argument => {
            let length = argument.array().shape.length(&program.interface);
            (0..length).map(|_| random.range(-1.0, 1.0)).collect()
        }
    };
    let mut numbers = Numbers::default();
    for function in program.functions.iter().filter(|function| !function.outputs.is_empty()) {
        let signature = function.kind.signature();
        let table = Table::of(function, &mut numbers);
        assert!(table.words.cells <= CELLS, "{name}: {} cells", table.words.cells);
        let arguments: Vec<Vec<f64>> = signature.inputs.iter().map(|&x| argument(x)).collect();
        let nothing = || signature.lengths(&program.interface).map(|length| vec![0.5; length]);
        let (mut expected, mut found): (Vec<_>, Vec<_>) =
            (nothing().collect(), nothing().collect());
        let load = |slot: Slot| {
            let (argument, index) = slot.place();
            let place = signature.inputs.iter().position(|&input| input == argument).unwrap();
            arguments[place][index]
        };
        let mut out: Vec<&mut [f64]> = expected.iter_mut().map(Vec::as_mut_slice).collect();
        engine.run(function.kind, load, &mut out);
        let mut out: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        let given: Vec<&[f64]> = arguments.iter().map(Vec::as_slice).collect();
        let bytes = table.words.bytes(CELLS);
        let evaluated = table::Table::<CELLS>::new(&bytes);
        evaluated.evaluate::<f64>(&numbers.list, &given, &mut out);
        for ((found, expected), output) in found.iter().zip(&expected).zip(signature.outputs) {
            let error = found.iter().zip(expected).map(|(x, y)| (x - y).abs());
            let error = error.fold(0.0, keep_largest);
            let scale = largest(expected);
            let place = format!("{name}: {} of {}", output.name, signature.name);
            assert!(error <= TOLERANCE * scale, "{place}: {error:e} of {scale:e}");
        }
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
