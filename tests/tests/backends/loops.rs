//! Functions as loops: their values against the interpreter, and a module that has them.

use lamc::backend::loops::{Loops, Number, Numbers, Operand, Statement, Table, Term};
use lamc::backend::rust::Options;
use lamc::pipeline::{Compiled, rust_module};
use lamc::program::{Form, FunctionKind, Interpreter};
use lamc_runtime::{Mechanism, acceleration};
use lamc_tests::modules::Workshop;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile, compile_text, relative_error, workspace};
use lamc_workbench::verify::Values;

use super::functions::{Sample, closed, samples};

/// Evaluates the loops of a function as a generated module does.
fn evaluate(loops: &Loops, numbers: &[f64], sample: &Sample) -> Vec<f64> {
    let mut cells = vec![f64::NAN; loops.cells];
    let inputs = sample.function.kind.signature().inputs;
    for &(argument, first) in &loops.arguments {
        let place = inputs.iter().position(|&input| input == argument).unwrap();
        let argument = &sample.arguments[place];
        cells[first..][..argument.len()].copy_from_slice(argument);
    }
    let mut done = vec![0; loops.kernels.len()];
    for &(kernel, count) in &loops.runs {
        let table = &loops.kernels[kernel];
        for record in &table.records[done[kernel]..][..count] {
            follow(table, record, numbers, &mut cells);
        }
        done[kernel] += count;
    }
    cells
}

/// Computes the values of a record.
fn follow(table: &Table, record: &[usize], numbers: &[f64], cells: &mut [f64]) {
    let mut values: Vec<f64> = Vec::new();
    for statement in &table.shape.statements {
        let operand = |operand: &Operand| match *operand {
            Operand::Own(place) => values[place],
            Operand::Read(place) => {
                let (column, distance) = table.reads[place];
                cells[record[column] + distance]
            }
            Operand::Number(place) => match table.numbers[place] {
                Number::Same(number) => number,
                Number::Listed(distance) => numbers[record.last().unwrap() + distance],
            },
        };
        let value = match statement {
            Statement::Sum(terms) => terms.iter().fold(-0.0, |sum, term| {
                let Term { is_negative, factors } = term;
                let product: f64 = factors.iter().map(operand).product();
                if *is_negative { sum - product } else { sum + product }
            }),
            Statement::SineCosine(angle) => {
                let [(sine, cosine), ..] =
                    lamc_runtime::Arithmetic::sin_cos_all([operand(angle); 8]);
                let (column, distance) = table.writes[0];
                cells[record[column] + distance] = sine;
                cells[record[column] + distance + 1] = cosine;
                return;
            }
            Statement::Call(name, operands) => {
                let x: Vec<f64> = operands.iter().map(operand).collect();
                match *name {
                    "div" => x[0] / x[1],
                    "sqrt" => x[0].sqrt(),
                    "abs" => x[0].abs(),
                    "tan" => x[0].tan(),
                    "exp" => x[0].exp(),
                    "ln" => x[0].ln(),
                    "tanh" => x[0].tanh(),
                    "step" => f64::from(u8::from(x[0] >= 0.0)),
                    "min" => x[0].min(x[1]),
                    "max" => x[0].max(x[1]),
                    "pow" => x[0].powf(x[1]),
                    "atan2" => x[0].atan2(x[1]),
                    name => panic!("{name} is no operation"),
                }
            }
        };
        values.push(value);
    }
    for (&place, &(column, distance)) in table.shape.kept.iter().zip(&table.writes) {
        cells[record[column] + distance] = values[place];
    }
}

/// Compares all functions of a mechanism near closed angles, where residuals are not just what rounding leaves.
fn check(name: &str, compiled: &Compiled) {
    let mut numbers = Numbers::default();
    for sample in samples(compiled, 0.05) {
        let loops = Loops::of(sample.function, &compiled.program.interface, &mut numbers);
        let cells = evaluate(&loops, &numbers.list, &sample);
        let outputs = loops.outputs.iter().zip(&sample.expected).map(|(entries, expected)| {
            let mut found = vec![0.0; expected.len()];
            entries.iter().for_each(|&(index, cell)| found[index] = cells[cell]);
            found
        });
        sample.check(name, &outputs.collect::<Vec<_>>());
    }
}

#[test]
fn loops_of_examples_give_the_same_values() {
    for name in ["pendulum", "fourbar", "sixbar", "miura", "triple_pendulum", "jumper"] {
        let path = workspace().join("examples").join(format!("{name}.yaml"));
        check(name, &compile(&path));
    }
}

#[test]
fn loops_of_sheets_give_the_same_values() {
    check("miura 5x7", &compile_text(&miura(5, 7)));
    check("yoshimura 3x3", &compile_text(&yoshimura(3, 3)));
}

/// What is computed for one plate or vertex is computed for all of them by few kernels.
#[test]
fn most_of_a_sheet_is_repeated() {
    let compiled = compile_text(&miura(10, 10));
    let program = &compiled.program;
    let function = program.function_of(FunctionKind::Acceleration);
    let loops = Loops::of(function, &program.interface, &mut Numbers::default());
    let statements = |table: &Table| table.shape.statements.len() * table.records.len();
    let all: usize = loops.kernels.iter().map(statements).sum();
    let often = loops.kernels.iter().filter(|table| table.records.len() >= 8);
    let often: usize = often.map(statements).sum();
    assert!(10 * often >= 8 * all, "{often} of {all} statements are in kernels of many records");
    let records: usize = loops.kernels.iter().map(|table| table.records.len()).sum();
    assert!(loops.runs.len() * 4 < records, "{} runs of {records} records", loops.runs.len());
}

/// The module of a sheet whose parts of the acceleration are loops, compiled by rustc.
#[test]
fn modules_with_loops_accelerate_as_the_interpreter() {
    let compiled = compile_text(&yoshimura(8, 9));
    let program = &compiled.program;
    assert_eq!(program.form(FunctionKind::Reduction), Form::Loops);
    assert_eq!(program.form(FunctionKind::ProjectionReduction), Form::Loops);
    let module = rust_module(&compiled, &Options::default()).unwrap();
    assert!(module.contains("mod loops"));
    let system = Interpreter::new(program);
    let q = closed(&system);
    let u = vec![0.0; q.len()];
    let mut rates = system.speeds();
    acceleration(&system, 0.0, &q, &u, &mut system.workspace(), &mut rates).unwrap();
    let energy = system.energy(0.0, &q, &u).unwrap();
    let expected: Vec<f64> = rates.into_iter().chain([energy.kinetic, energy.potential]).collect();
    let states = [Values { q, u, ..Values::default() }];
    let answers = Workshop::new().unwrap().rust(&compiled, &states).unwrap();
    let found = answers[0].as_ref().unwrap();
    assert!(relative_error(found, &expected) < 1e-10);
}
