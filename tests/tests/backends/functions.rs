//! What the interpreter computes for all functions of a mechanism, for other forms of them to be compared with.

use lamc::pipeline::Compiled;
use lamc::program::{Argument, Engine, Function, Interpretation, Interpreter, Slot};
use lamc_runtime::{Mechanism, assemble};
use lamc_tests::compare::{keep_largest, largest};
use lamc_tests::random::Random;

/// How far values may differ, as a share of the largest of an output: products are rounded together with sums
/// on some processors, and sums may have another order.
pub const TOLERANCE: f64 = 1e-12;

/// A function, its arguments and outputs.
pub struct Sample<'a> {
    pub function: &'a Function,
    /// In the order of the function's signature.
    pub arguments: Vec<Vec<f64>>,
    /// In the order of the outputs.
    pub expected: Vec<Vec<f64>>,
}

/// Closed angles near those of the start.
pub fn closed(system: &Interpreter) -> Vec<f64> {
    let mut q = system.initial().q;
    let pinned = vec![false; system.dimensions().joints];
    assemble(system, 0.0, &mut q, &pinned, &mut system.workspace()).unwrap();
    q
}

/// Evaluates all functions of a mechanism at random numbers, and at angles within `beside` of closed ones.
pub fn samples<'a>(compiled: &'a Compiled, beside: f64) -> Vec<Sample<'a>> {
    let program = &compiled.program;
    let (system, engine) = (Interpreter::new(program), Interpretation::new(program));
    let closed = closed(&system);
    let mut random = Random::new(7);
    let mut argument = |argument: Argument| match argument {
        Argument::Positions => {
            closed.iter().map(|angle| angle + beside * random.range(-1.0, 1.0)).collect()
        }
        Argument::Parameters => system.parameters().to_vec(),
        argument => {
            let length = argument.array().shape.length(&program.interface);
            (0..length).map(|_| random.range(-1.0, 1.0)).collect()
        }
    };
    let functions = program.functions.iter().filter(|function| !function.outputs.is_empty());
    let sample = |function: &'a Function| {
        let signature = function.kind.signature();
        let arguments: Vec<Vec<f64>> = signature.inputs.iter().map(|&x| argument(x)).collect();
        let load = |slot: Slot| {
            let (argument, index) = slot.place();
            let place = signature.inputs.iter().position(|&input| input == argument).unwrap();
            arguments[place][index]
        };
        let lengths = signature.lengths(&program.interface);
        let mut expected: Vec<Vec<f64>> = lengths.map(|length| vec![0.5; length]).collect();
        let mut out: Vec<&mut [f64]> = expected.iter_mut().map(Vec::as_mut_slice).collect();
        engine.run(function.kind, load, &mut out);
        Sample { function, arguments, expected }
    };
    functions.map(sample).collect()
}

impl Sample<'_> {
    /// Compares what another form of the function of mechanism `name` has computed.
    pub fn check(&self, name: &str, found: &[Vec<f64>]) {
        let signature = self.function.kind.signature();
        for ((found, expected), output) in found.iter().zip(&self.expected).zip(signature.outputs) {
            let error = found.iter().zip(expected).map(|(x, y)| (x - y).abs());
            let error = error.fold(0.0, keep_largest);
            let scale = largest(expected);
            let place = format!("{name}: {} of {}", output.name, signature.name);
            assert!(error <= TOLERANCE * scale, "{place}: {error:e} of {scale:e}");
        }
    }
}
