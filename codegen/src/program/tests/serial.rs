//! The program as bytes: that of each version is read as what it was, and nothing else is read.

use proptest::prelude::*;
use serde::ser::{Serialize, SerializeTuple, Serializer};
use sha2::{Digest, Sha256};

use crate::pipeline;
use crate::program::{
    BodyInfo, ControllerInfo, FORMAT_VERSION, Fact, FreeBodyInfo, FunctionKind, Interface,
    Interpreter, JointInfo, Moving, Op, ParameterInfo, Phase, Program, Pwm, Quantity, ReadError,
    ReductionInfo, Section, Slot, SparseRows, Subject, Value, VerifyError,
};
use crate::sealed::{Format, Unreadable};
use crate::source::{CoordinateId, InputId, MemoryId, ParameterId, SourceFile, SpeedId};
use crate::topology::{LoopId, NodeId};

const FORMAT: Format = Format { name: *b"lamcprog", version: FORMAT_VERSION };

/// A loop of four hinges with a parameter.
const FOUR_BAR: &str = "
parameters: { k: 1e-3 }
bodies:
  base: { fixed: true }
  left: { mass: 2 g, com: [0, 0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
  top: { mass: 1 g, com: [0.03, 0.04, 0], inertia: [[1e-9, 0, 0], [0, 3e-7, 0], [0, 0, 3e-7]] }
  right: { mass: 2 g, com: [0.05, 0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints:
  a: { bodies: [base, left], axis: [[0, 0], [0, 1]], stiffness: k, damping: 4e-6 }
  b: { bodies: [left, top], axis: [[0.02, 0], [0.02, 1]], stiffness: k, damping: 4e-6 }
  c: { bodies: [top, right], axis: [[0.05, 0], [0.05, 1]], stiffness: k, damping: 4e-6 }
  d: { bodies: [base, right], axis: [[0.08, 0], [0.08, 1]], stiffness: k, damping: 4e-6 }
";

fn four_bar() -> Program {
    let file = SourceFile { path: "four_bar.yaml".to_owned(), text: FOUR_BAR.to_owned() };
    pipeline::compile(&file).unwrap().program
}

/// One value of each kind that a program can hold.
fn each() -> impl Serialize {
    let [x, y] = [Value(1), Value(300)];
    let ops = [
        [Op::Const(-0.0), Op::Neg(x), Op::Add(x, y), Op::Sub(x, y), Op::Mul(x, y), Op::Div(x, y)],
        [Op::Sqrt(x), Op::Sin(x), Op::Cos(x), Op::Tan(x), Op::Exp(x), Op::Abs(x)],
        [Op::Tanh(x), Op::Ln(x), Op::Step(x), Op::Min(x, y), Op::Max(x, y), Op::Pow(x, y)],
        [
            Op::Atan2(x, y),
            Op::Load(Slot::Time),
            Op::Load(Slot::Multiplier(5)),
            Op::Neg(y),
            Op::Ln(y),
            Op::Sin(y),
        ],
    ];
    let (coordinate, speed) = (CoordinateId(1), SpeedId(1));
    let (parameter, input) = (ParameterId(2), InputId(3));
    let movings = [
        Moving::Time,
        Moving::Position(speed),
        Moving::Rate(speed),
        Moving::Parameter(parameter),
        Moving::Input(input),
    ];
    let slots = [
        Slot::Position(coordinate),
        Slot::Rate(speed),
        Slot::Parameter(parameter),
        Slot::Input(input),
        Slot::Acceleration(speed),
        Slot::Memory(MemoryId(3)),
    ];
    let subjects = [Subject::Mechanism, Subject::Body(NodeId(3)), Subject::Loop(LoopId(4))];
    let quantity = Some(Quantity::new("mass", "mass, kg"));
    let fact = Fact { name: "m".to_owned(), quantity, subject: subjects[1], value: 0.1 };
    let text = |text: &str| text.to_owned();
    let interface = Interface {
        name: text("model"),
        source_name: text("model.yaml"),
        source_hash: text("00"),
        joints: vec![JointInfo {
            name: text("joint"),
            bodies: [text("first"), text("second")],
            limits: [-1.0, f64::INFINITY],
            initial_q: 0.25,
            initial_given: true,
            initial_u: 0.5,
            driven: false,
        }],
        free: vec![FreeBodyInfo {
            name: text("body"),
            q: [0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0],
            u: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        }],
        controllers: vec![ControllerInfo {
            name: text("controller"),
            sample: 0.005,
            delay: 0.001,
            memory: vec![(text("sum"), 0.5)],
            inputs: vec![InputId(0)],
            pwm: Some(Pwm { period: 0.001, levels: [-6.0, 6.0], duty: [0.0, 1.0] }),
        }],
        bodies: vec![BodyInfo { name: text("body"), fixed: true }],
        nodes: vec![text("node")],
        points: vec![text("point")],
        contacts: vec![text("contact")],
        parameters: vec![ParameterInfo { name: text("k"), value: 2.0, doc: text("doc") }],
        drawn: 2,
        inputs: vec![text("input")],
        rows: 3,
        loops: vec![text("loop")],
        rank: 2,
        mobility: 1,
        cuts: vec![text("cut")],
        size: 4.0,
        reduction: Some(ReductionInfo {
            branches: vec![(0, 1)],
            independent: vec![2],
            steps: vec![vec![3]],
            rows: vec![10],
            closure: SparseRows { ends: vec![4], columns: vec![5] },
            lower: SparseRows { ends: vec![6], columns: vec![7] },
            upper: SparseRows { ends: vec![8], columns: vec![9] },
        }),
    };
    let sections = Phase::ALL.iter().map(|&phase| Section { subject: subjects[2], phase });
    let sections: Vec<Section> = sections.collect();
    (ops, movings.map(Slot::Change), slots, subjects, fact, interface, sections, FunctionKind::ALL)
}

/// If this fails, the bytes of a type of the program have changed: raise `FORMAT_VERSION`, and write the new
/// hash here.
#[test]
fn the_version_is_raised_with_the_types() {
    let bytes = FORMAT.write(&each(), &[]);
    let hash: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!((FORMAT_VERSION, &hash[..16]), (11, "b17d36ab847d08ac"));
}

#[test]
fn a_program_is_read_as_it_was_written() {
    let program = four_bar();
    let bytes = program.to_bytes();
    let read = Program::from_bytes(&bytes).unwrap();
    assert_eq!(format!("{read:?}"), format!("{program:?}"));
    assert_eq!(read.to_bytes(), bytes);
}

#[test]
fn bytes_that_are_cut_or_changed_are_refused() {
    let bytes = four_bar().to_bytes();
    let refused = |bytes: &[u8]| Program::from_bytes(bytes).unwrap_err();
    proptest!(|(length in 0..bytes.len(), flip in 0..8 * bytes.len())| {
        prop_assert!(matches!(refused(&bytes[..length]), ReadError::Unreadable(_)));
        let mut flipped = bytes.clone();
        flipped[flip / 8] ^= 1 << (flip % 8);
        prop_assert!(matches!(refused(&flipped), ReadError::Unreadable(_)));
    });
    let mut older = bytes;
    older[8] = 0;
    let expected = Unreadable::Version { found: 0, known: FORMAT_VERSION };
    assert_eq!(refused(&older), ReadError::Unreadable(expected));
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

/// Whoever makes a file by hand can also make its checksum.
#[test]
fn programs_made_by_hand_are_refused_or_run() {
    let program = four_bar();
    let payload = &program.to_bytes()[44..];
    assert_eq!(FORMAT.write(&Raw(payload), &[]), program.to_bytes());
    let change = (0..payload.len(), any::<u8>());
    let refused = std::cell::Cell::new([0; 3]);
    let count = |index: usize| {
        let mut counts = refused.get();
        counts[index] += 1;
        refused.set(counts);
    };
    let config = ProptestConfig::with_cases(4000);
    proptest!(config, |(changes in prop::collection::vec(change, 1..4))| {
        let mut bytes = payload.to_vec();
        changes.into_iter().for_each(|(index, byte)| bytes[index] = byte);
        match Program::from_bytes(&FORMAT.write(&Raw(&bytes), &[])) {
            Err(ReadError::Unreadable(_)) => count(0),
            Err(ReadError::Invalid(_)) => count(1),
            Ok(program) => {
                count(2);
                runs(&program);
            }
        }
    });
    assert!(refused.get().iter().all(|&count| count > 100), "{refused:?}");
}

/// Evaluates what a valid program offers, and prints it.
fn runs(program: &Program) {
    use lamc_runtime::Mechanism;
    let system = Interpreter::new(program);
    let (n, state) = (system.dimensions().joints, system.initial());
    let (mut workspace, mut out) = (system.workspace(), system.speeds());
    let _ = lamc_runtime::acceleration(&system, 0.0, &state.q, &state.u, &mut workspace, &mut out);
    let _ = (system.poses(&state.q), system.energy(0.0, &state.q, &state.u));
    assert_eq!((system.speeds().len(), state.u.len()), (n, n));
    assert!(!program.to_string().is_empty());
}

#[test]
fn what_a_program_refers_to_exists() {
    let verified = |change: &dyn Fn(&mut Program)| {
        let mut program = four_bar();
        change(&mut program);
        match Program::from_bytes(&program.to_bytes()) {
            Err(ReadError::Invalid(error)) => Some(error),
            other => panic!("{other:?}"),
        }
    };
    let missing = Subject::Body(NodeId(99));
    let found = verified(&|program| program.functions[0].instructions[3].section.subject = missing);
    assert_eq!(found, Some(VerifyError::Subject(missing)));
    let found = verified(&|program| program.facts[0].subject = missing);
    assert_eq!(found, Some(VerifyError::Subject(missing)));
    let found = verified(&|program| program.interface.rank = usize::MAX);
    assert_eq!(found, Some(VerifyError::Count("independent equations")));
    let found = verified(&|program| program.interface.name = "a b".to_owned());
    assert_eq!(found, Some(VerifyError::Text("the name of the model")));
    let found = verified(&|program| program.interface.parameters[0].doc = "*/\nint".to_owned());
    assert_eq!(found, Some(VerifyError::Text("the text of a parameter")));
    let found = verified(&|program| program.interface.drawn = 1);
    assert_eq!(found, Some(VerifyError::Outputs(FunctionKind::Drawing)));
    let found = verified(&|program| {
        program.functions.pop();
    });
    assert_eq!(found, Some(VerifyError::Functions));
}
