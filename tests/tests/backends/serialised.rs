//! Programs that were written to bytes and read: every backend writes the same text, machine code and interpreter
//! return the same bits. What was made by hand and passes the verifier harms neither.

use std::panic::{AssertUnwindSafe, catch_unwind};

use lamc::backend::c::Real;
use lamc::backend::fmu::Version;
use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline::{self, Compiled, c_header, c_source, fmu_files, python_module, rust_module};
use lamc::program::{
    Engine, FORMAT_VERSION, FunctionKind, Interpretation, Program, ReadError, Selection, Slot,
};
use lamc::sealed::Format;
use lamc::source::SourceFile;
use lamc_tests::random::Random;
use lamc_tests::{EXAMPLES, ROBOTS, compile, workspace};
use lamc_workbench::execution::MachineCode;
use proptest::prelude::*;
use serde::ser::{Serialize, SerializeTuple, Serializer};

/// Bytes before the payload.
const FRAME: usize = 44;

/// All texts that backends write for a model.
fn texts(compiled: &Compiled) -> Vec<String> {
    let options = |scalar, functions| Options { scalar, extern_c: false, functions };
    let all = Selection::named(["all"]).unwrap();
    let rust =
        [options(ScalarChoice::Generic, all), options(ScalarChoice::F64, Selection::default())];
    let mut texts: Vec<String> =
        rust.iter().map(|options| rust_module(compiled, options).unwrap()).collect();
    texts.push(c_header(compiled, Real::Double));
    texts.push(c_source(compiled, Real::Double, "model.h").unwrap());
    texts.push(python_module(compiled, Real::Double, "model.c", "model.h"));
    // FMUs are refused for models with controllers.
    if compiled.program.interface.controllers.is_empty() {
        texts.extend(fmu_files(compiled, Version::Fmi3).unwrap().into_iter().map(|(_, text)| text));
    }
    texts.push(compiled.program.to_string());
    texts
}

/// The bits of all outputs of all functions at random numbers.
fn bits<E: Engine>(program: &Program) -> Vec<u64> {
    let engine = E::new(program);
    let mut bits = Vec::new();
    for function in program.functions.iter().filter(|function| !function.outputs.is_empty()) {
        let mut random = Random::new(7);
        let numbers: Vec<f64> = (0..97).map(|_| random.range(-1.0, 1.0)).collect();
        let load = |slot: Slot| {
            let (argument, index) = slot.place();
            numbers[(13 * argument as usize + index) % numbers.len()]
        };
        let mut outputs: Vec<Vec<f64>> =
            function.outputs.iter().map(|output| vec![0.0; output.entries.len()]).collect();
        let mut places: Vec<&mut [f64]> = outputs.iter_mut().map(Vec::as_mut_slice).collect();
        engine.run(function.kind, load, &mut places);
        bits.extend(outputs.iter().flatten().map(|number| number.to_bits()));
    }
    bits
}

/// Bits with one pattern for all that are not numbers: which of them an operation returns depends on the processor.
fn same_nan(mut bits: Vec<u64>) -> Vec<u64> {
    bits.iter_mut()
        .filter(|bits| f64::from_bits(**bits).is_nan())
        .for_each(|bits| *bits = u64::MAX);
    bits
}

/// Machine code of all functions now, not after many calls.
struct Compiling(MachineCode);

impl Engine for Compiling {
    fn new(program: &Program) -> Self {
        let engine = MachineCode::new(program);
        assert!(engine.compile(&FunctionKind::ALL));
        Self(engine)
    }

    fn run(&self, kind: FunctionKind, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]) {
        self.0.run(kind, load, out);
    }
}

fn check(name: &str, compiled: &Compiled) {
    let bytes = compiled.program.to_bytes();
    let program = Program::from_bytes(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_eq!(bits::<Compiling>(&program), bits::<Compiling>(&compiled.program), "{name}");
    assert_eq!(
        bits::<Interpretation>(&program),
        bits::<Interpretation>(&compiled.program),
        "{name}"
    );
    let read = Compiled { program, ..compiled.clone() };
    for (read, written) in texts(&read).iter().zip(texts(compiled)) {
        assert!(*read == written, "{name}");
    }
    println!("{name}: {} bytes", bytes.len());
}

/// With every kind of force element, and with controllers, besides.
fn models() -> impl Iterator<Item = &'static str> {
    EXAMPLES.into_iter().chain(ROBOTS).chain(["finger", "servo"])
}

#[test]
fn programs_that_are_read_are_those_that_were_written() {
    for name in models() {
        check(name, &compile(&workspace().join(format!("examples/{name}.yaml"))));
    }
}

/// What a cache keeps of a model is all that a command needs.
#[test]
fn models_that_are_read_are_those_that_were_compiled() {
    for name in models() {
        let path = workspace().join(format!("examples/{name}.yaml"));
        let file = SourceFile::read(&path.display().to_string()).unwrap();
        let read = pipeline::read(&file, |_| Ok(())).unwrap();
        let derived = read.derive(|_, _| ()).unwrap();
        let bytes = derived.to_bytes(b"key");
        // Another process, which has read nothing, derives the same.
        let other = pipeline::Read::from_bytes(&read.to_bytes()).unwrap();
        assert!(other.derive(|_, _| ()).unwrap().to_bytes(b"key") == bytes, "{name}");
        assert!(pipeline::Derived::from_bytes(&bytes, b"other key").is_err());
        let again = pipeline::Derived::from_bytes(&bytes, b"key").unwrap();
        assert_eq!(again.to_bytes(b"key"), bytes, "{name}");
        let [derived, again] = [derived, again].map(|derived| read.clone().compiled(derived));
        assert!(format!("{derived:?}") == format!("{again:?}"), "{name}");
        assert!(format!("{derived:?}") == format!("{:?}", compile(&path)), "{name}");
    }
}

/// Bytes as they are.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut bytes = to.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| bytes.serialize_element(byte))?;
        bytes.end()
    }
}

#[test]
fn programs_made_by_hand_are_refused_or_compiled() {
    let compiled = compile(&workspace().join("examples/fourbar.yaml"));
    let format = Format { name: *b"lamcprog", version: FORMAT_VERSION };
    let bytes = compiled.program.to_bytes();
    let change = (FRAME..bytes.len(), any::<u8>());
    let valid = std::cell::Cell::new(0);
    proptest!(|(changes in prop::collection::vec(change, 1..3))| {
        let mut bytes = bytes.clone();
        changes.iter().for_each(|&(index, byte)| bytes[index] = byte);
        match Program::from_bytes(&format.write(&Raw(&bytes[FRAME..]), &[])) {
            Err(ReadError::Unreadable(_) | ReadError::Invalid(_)) => {}
            Ok(program) => {
                valid.set(valid.get() + 1);
                let model = Compiled { program, ..compiled.clone() };
                let outcome = catch_unwind(AssertUnwindSafe(|| {
                    let program = &model.program;
                    let machine = same_nan(bits::<Compiling>(program));
                    assert_eq!(machine, same_nan(bits::<Interpretation>(program)));
                    // A number may be too large for f32.
                    let _ = c_source(&model, Real::Float, "model.h");
                    rust_module(&model, &Options::default()).unwrap()
                }));
                prop_assert!(outcome.is_ok(), "{changes:?}");
            }
        }
    });
    assert!(valid.get() > 20, "only {} programs were valid", valid.get());
}
