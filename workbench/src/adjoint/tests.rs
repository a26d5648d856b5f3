//! Functions in reverse mode, steps of free bodies, and motions in pieces.

use lamc::program::{
    Engine as _, Function, FunctionKind, Instruction, Interface, Interpretation, Op, Output,
    ParameterInfo, Phase, Program, Section, Slot, Value,
};
use lamc::source::{ParameterId, SourceFile};
use lamc_runtime::{Mechanism as _, free_body};

use super::reverse::{Reversed, weight};
use super::{Course, Differentiated, Method, Schedule, Slopes, orientation};
use crate::execution::Jit;

/// Central differences with this step have an error of about its square.
const STEP: f64 = 1e-5;

/// A program whose only function has two outputs, which depend on two parameters by some operations on each other's results.
fn program(op: impl Fn(Value, Value) -> Op) -> Program {
    let load = |index| Op::Load(Slot::Parameter(ParameterId(index)));
    let ops = [
        load(0),
        load(1),
        op(Value(0), Value(1)),
        Op::Mul(Value(2), Value(0)),
        op(Value(1), Value(0)),
        Op::Sub(Value(4), Value(3)),
    ];
    let section = Section::mechanism(Phase::Drawing);
    let instruction = |op| Instruction { op, section, name: None };
    let output = Output { name: "numbers", rows: 2, columns: 1, entries: vec![Value(3), Value(5)] };
    let function = |kind| Function { kind, instructions: vec![], outputs: vec![] };
    let mut functions: Vec<Function> = FunctionKind::ALL.into_iter().map(function).collect();
    functions[FunctionKind::Drawing as usize] = Function {
        kind: FunctionKind::Drawing,
        instructions: ops.into_iter().map(instruction).collect(),
        outputs: vec![output],
    };
    let parameter =
        |name: &str| ParameterInfo { name: name.into(), value: 0.0, doc: String::new() };
    let parameters = vec![parameter("x"), parameter("y")];
    Program {
        interface: Interface { parameters, ..Interface::default() },
        facts: vec![],
        functions,
    }
}

#[test]
fn every_operation_has_the_adjoints_of_central_differences() {
    let operations: [fn(Value, Value) -> Op; 19] = [
        |x, _| Op::Neg(x),
        Op::Add,
        Op::Sub,
        Op::Mul,
        Op::Div,
        |x, _| Op::Sqrt(x),
        |x, _| Op::Sin(x),
        |x, _| Op::Cos(x),
        |x, _| Op::Tan(x),
        |x, _| Op::Exp(x),
        |x, _| Op::Abs(x),
        |x, _| Op::Tanh(x),
        |x, _| Op::Ln(x),
        |x, _| Op::Step(x),
        Op::Min,
        Op::Max,
        Op::Pow,
        Op::Atan2,
        |x, y| Op::Atan2(y, x),
    ];
    let weights = [0.3, -1.7];
    for (number, op) in operations.into_iter().enumerate() {
        let program = program(op);
        let reversed = Reversed::of(&program);
        let [plain, back] = [&program, &reversed.program].map(Interpretation::new);
        let x = [0.7, 1.9];
        let load = |slot: Slot| match slot {
            Slot::Parameter(id) => x[id.index()],
            slot => weights
                .iter()
                .enumerate()
                .find(|(k, _)| slot == weight(*k))
                .map_or(f64::NAN, |it| *it.1),
        };
        let places = &reversed.places[FunctionKind::Drawing as usize].rest;
        let mut written = vec![f64::NAN; places.len()];
        back.run(FunctionKind::Drawing, load, &mut [&mut written]);
        for direction in 0..2 {
            let moved = |by: f64| {
                let mut out = [f64::NAN; 2];
                let load = |slot: Slot| {
                    let index = slot.place().1;
                    x[index] + if index == direction { by } else { 0.0 }
                };
                plain.run(FunctionKind::Drawing, load, &mut [&mut out]);
                weights[0] * out[0] + weights[1] * out[1]
            };
            let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
            let found = places.iter().position(|place| *place == direction);
            let found = found.map_or(0.0, |k| written[k]);
            let error = (found - slope).abs() / slope.abs().max(1.0);
            assert!(error < 1e-8, "operation {number}, parameter {direction}: {found}, {slope}");
        }
    }
}

/// A joint and a free body: the adjoints of a step and of rates, against differences.
#[test]
fn steps_of_free_bodies() {
    let mut q = [0.4, 0.1, 0.2, 0.3, 0.5, -0.5, 0.1, 0.7];
    free_body::normalise(&mut q, 1);
    let weights = [0.2, 1.0, -0.4, 0.7, 0.3, -1.1, 0.9, 0.5];
    let sum = |q: &[f64]| q.iter().zip(weights).map(|(q, weight)| q * weight).sum::<f64>();
    for turn in [0.3, 2e-4] {
        let step = [0.1, 0.2, -0.3, 0.4, turn, -2.0 * turn, 0.5 * turn];
        let advanced = |q: &[f64; 8], step: &[f64; 7]| {
            let mut q = *q;
            free_body::advance(&mut q, step, 1);
            sum(&q)
        };
        let rated = |q: &[f64; 8], u: &[f64; 7]| {
            let mut rates = [0.0; 8];
            free_body::write_rates(q, u, &mut rates, 1);
            sum(&rates)
        };
        let (mut of_q, mut of_step) = (weights, [0.0; 7]);
        orientation::advance(&q, &step, 1, &mut of_q, &mut of_step);
        compare(&advanced, q, step, of_q, of_step);
        let (mut of_q, mut of_u) = ([0.0; 8], [0.0; 7]);
        orientation::rates(&q, &step, 1, &weights, &mut of_q, &mut of_u);
        compare(&rated, q, step, of_q, of_u);
    }
    let raw = q.map(|q| 1.3 * q);
    let mut of_q = weights;
    orientation::normalise(&raw, 1, &mut of_q);
    let normalised = |q: &[f64; 8], _: &[f64; 7]| {
        let mut q = *q;
        free_body::normalise(&mut q, 1);
        sum(&q)
    };
    compare(&normalised, raw, [0.0; 7], of_q, [0.0; 7]);
}

fn compare(
    f: &dyn Fn(&[f64; 8], &[f64; 7]) -> f64,
    q: [f64; 8],
    u: [f64; 7],
    of_q: [f64; 8],
    of_u: [f64; 7],
) {
    let by_q = |index: usize, by: f64| {
        let mut q = q;
        q[index] += by;
        f(&q, &u)
    };
    let by_u = |index: usize, by: f64| {
        let mut u = u;
        u[index] += by;
        f(&q, &u)
    };
    for (index, found) in of_q.into_iter().enumerate() {
        let slope = (by_q(index, STEP) - by_q(index, -STEP)) / (2.0 * STEP);
        assert!((found - slope).abs() < 1e-9, "q {index}: {found} is not {slope}");
    }
    for (index, found) in of_u.into_iter().enumerate() {
        let slope = (by_u(index, STEP) - by_u(index, -STEP)) / (2.0 * STEP);
        assert!((found - slope).abs() < 1e-9, "u {index}: {found} is not {slope}");
    }
}

const PENDULUM: &str = "
bodies:
  base: { fixed: true }
  arm: { mass: 2 g, com: [0.01, 0.002, 0], inertia: [[2e-8, 0, 0], [0, 3e-8, 0], [0, 0, 4e-8]] }
parameters: { k: 2e-4 }
inputs: [motor]
joints:
  hinge:
    { bodies: [base, arm], axis: [[0, 0], [0, 0.02]], stiffness: k, torque: motor, limits: [-1, 1] }
";

fn pendulum() -> (Differentiated, lamc_runtime::State<Vec<f64>, f64>) {
    let file = SourceFile { path: "pendulum.yaml".into(), text: PENDULUM.into() };
    let compiled = lamc::pipeline::compile(&file).unwrap();
    let system = Jit::new(&compiled.program);
    let state = system.initial();
    (Differentiated::new(&compiled.program, system), state)
}

/// The way back repeats the pieces of a motion whose record would be too long: the same numbers, also the second time.
#[test]
fn a_motion_in_pieces_has_the_same_derivatives() {
    let (differentiated, start) = pendulum();
    for method in [Method::Rk4, Method::Euler, Method::Rodas] {
        let inputs = [vec![1e-6], vec![-2e-6], vec![3e-6]];
        let schedule = Schedule { method, samples: &[0.01, 0.02, 0.03], steps: 7, inputs: &inputs };
        let mut course = Course::new(&differentiated, start.clone(), schedule).unwrap();
        let numbers: Vec<Slopes> = (1..3)
            .map(|k| Slopes {
                states: (0..4).map(|sample| vec![f64::from(k), f64::from(k * sample)]).collect(),
                energies: (0..4).map(|sample| [f64::from(k - 1), f64::from(sample)]).collect(),
                points: vec![],
            })
            .collect();
        let whole = course.pull(&numbers).unwrap();
        assert_eq!(course.pull(&numbers).unwrap(), whole);
        assert!(whole[0].inputs.iter().flatten().all(|x| *x != 0.0));
        for most in [0, 10, 100] {
            course.run(most).unwrap();
            assert_eq!(course.pull(&numbers).unwrap(), whole, "{method:?}, {most}");
            assert_eq!(course.pull(&numbers).unwrap(), whole, "{method:?}, {most}");
        }
    }
}

/// Stops are no part of the steps: who asks for derivatives is told.
#[test]
fn a_motion_that_comes_to_a_stop_has_no_derivatives() {
    let (differentiated, start) = pendulum();
    let inputs = [vec![1e-2]];
    let schedule = Schedule { method: Method::Rk4, samples: &[0.1], steps: 1000, inputs: &inputs };
    let error = Course::new(&differentiated, start, schedule).err().unwrap();
    let text = error.describe(differentiated.system.interface());
    assert!(text.starts_with("`hinge` comes to its stop at 0.0"), "{text}");
}
