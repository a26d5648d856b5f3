//! What is fuzzed: for each target, what is done with an input. A panic is a fault.
//!
//! The fuzzer calls these functions with new inputs (`fuzz_targets/`), and the tests with the inputs that are kept
//! in `corpus/` and `regressions/`.

use std::sync::OnceLock;

use lamc::laminate::{self, Mechanism};
use lamc::source::{self, Diagnostics, SourceFile, SourceModel};
use lamc::topology;
use lamc_workbench::identify::{Record, family};
use lamc_workbench::mocap::{Quaternions, angles};
use lamc_workbench::reading::{configurations, states};

mod drawings;
mod runtime;
mod structure;

use runtime::{Function, call};

/// A target.
pub type Target = fn(&[u8]);

/// Every target by its name.
pub const TARGETS: [(&str, Target); 31] = [
    ("yaml", yaml),
    ("popupcad", popupcad),
    ("formula", formula),
    ("wkt", wkt),
    ("structure", structure::structure),
    ("states", read_states),
    ("measurements", measurements),
    ("specimens", specimens),
    ("quaternions", quaternions),
    ("svg", drawings::read_svg),
    ("fold", drawings::read_fold),
    ("dxf", drawings::read_dxf),
    ("pattern", drawings::pattern),
    ("acceleration", |input| call(Function::Acceleration, input)),
    ("acceleration_in_motion", |input| call(Function::InMotion, input)),
    ("acceleration_and_forces", |input| call(Function::Forces, input)),
    ("jacobian", |input| call(Function::Jacobian, input)),
    ("derivatives_along", |input| call(Function::Along, input)),
    ("assemble", |input| call(Function::Assemble, input)),
    ("project", |input| call(Function::Project, input)),
    ("equilibrium", |input| call(Function::Equilibrium, input)),
    ("linearize", |input| call(Function::Linearize, input)),
    ("rk4", |input| call(Function::Rk4, input)),
    ("euler", |input| call(Function::Euler, input)),
    ("dopri5", |input| call(Function::Dopri5, input)),
    ("rodas", |input| call(Function::Rodas, input)),
    ("stopped", |input| call(Function::Stopped, input)),
    ("rigid", |input| call(Function::Rigid, input)),
    ("control", runtime::control),
    ("batch", runtime::batch),
    ("rotations", runtime::rotations),
];

/// Any text as a model.
fn yaml(input: &[u8]) {
    read(text(input));
}

/// Any text as what follows the tag of popupCAD's file.
fn popupcad(input: &[u8]) {
    read(&format!("!!python/object:foldable_robotics.dynamics_info.DynamicsInfo\n{}", text(input)));
}

/// Any text as the formula of a torque.
fn formula(input: &[u8]) {
    let quoted = format!("{:?}", text(input));
    // The physics of the model is always the same.
    parsed(&SourceFile {
        path: "formula.yaml".into(),
        text: format!(
            "name: m
parameters: {{ k: 0.5 }}
inputs: [motor]
bodies: {{ base: {{ fixed: true }}, arm: {{ point_masses: [{{ mass: 1, at: [1, 0, 0] }}] }} }}
joints: {{ j: {{ bodies: [base, arm], axis: [[0, 0], [0, 1]], torque: {quoted} }} }}
"
        ),
    });
}

/// Any text as the geometry of a popupCAD part.
fn wkt(input: &[u8]) {
    let quoted = format!("{:?}", text(input));
    read(&format!(
        "!!python/object:foldable_robotics.dynamics_info.DynamicsInfo
connected_items:
- {{id: 1, layers: [{{geoms: ['POLYGON ((0 0, 1 0, 1 1, 0 1, 0 0))'], id: 3}}]}}
- {{id: 2, layers: [{{geoms: [{quoted}], id: 4}}]}}
connections:
- !!python/tuple
  - !!python/tuple [!!python/tuple [0.1, 0.0], !!python/tuple [0.1, 0.1]]
  - !!python/tuple [2, 1]
  - !!python/object:foldable_robotics.dynamics_info.JointProps {{damping: 1.0e-05,
    limit_neg: -90, limit_pos: 45, preload: 10.0, stiffness: 0.01, z_pos: 0.0005}}
material_properties:
- !!python/object:foldable_robotics.dynamics_info.MaterialProperty
  {{color: [0.2, 0.2, 0.2, 0.5], density: 1000, name: glue, thickness: 0.0005}}
newtonian_ids: [1]
"
    ));
}

/// Any text as the states of `lamc eval`.
fn read_states(input: &[u8]) {
    read_numbers(text(input), states);
}

/// Any text as measured angles of `lamc fit`, and as configurations of `lamc equilibrium`.
fn measurements(input: &[u8]) {
    let joints = ["knee", "hip"];
    let record = read_numbers(text(input), |text| Record::read(text, &joints, &["hull"]));
    if let Some(record) = record {
        let counts = [0, 1].map(|joint| record.seen(joint).0.len());
        assert!(counts.iter().all(|count| *count <= record.t.len()));
    }
    read_numbers(text(input), |text| configurations(text, &joints));
}

/// Any text as a table of measured hinges of `lamc hinge family`.
fn specimens(input: &[u8]) {
    /// More specimens take longer and meet no other code.
    const MOST: usize = 40;
    let specimens = read_numbers(text(input), family::read);
    if let Some(Ok(regressions)) =
        specimens.filter(|it| it.len() <= MOST).map(|it| family::regress(&it))
    {
        let _ = family::to_yaml("hinge", &regressions, &[]);
    }
}

/// Any text as the rotations of `lamc mocap`.
fn quaternions(input: &[u8]) {
    /// More samples take longer and meet no other code.
    const MOST: usize = 20;
    let bodies = [("base", true), ("arm", false), ("wall", true)];
    let measured = read_numbers(text(input), |text| Quaternions::read(text, &bodies));
    let Some(mut measured) = measured.filter(|measured| measured.t.len() <= MOST) else { return };
    let motion = angles(mechanism(), &measured);
    assert!(motion.iter().flatten().all(|joint| joint.angle.len() == measured.t.len()));
    let _ = measured.flatten(measured.t[0], &bodies.map(|(_, fixed)| fixed));
    let _ = angles(mechanism(), &measured);
}

/// A mechanism of the bodies whose rotations are read.
fn mechanism() -> &'static Mechanism {
    static MECHANISM: OnceLock<Mechanism> = OnceLock::new();
    MECHANISM.get_or_init(|| {
        let text = "
bodies: { base: { fixed: true }, arm: { point_masses: [{ mass: 1, at: [1, 0, 0] }] },
          wall: { fixed: true } }
joints: { hip: { bodies: [base, arm], axis: [[0, 0], [0, 1]] },
          knee: { bodies: [arm, wall], axis: [[0, 0], [0, 1]] } }
";
        let file = SourceFile { path: "model.yaml".into(), text: text.into() };
        let (model, _) = source::parse(&file).expect("a valid model");
        laminate::build(&model, &mut Diagnostics::default()).expect("a valid mechanism")
    })
}

/// The text at the beginning of an input.
fn text(input: &[u8]) -> &str {
    let end = std::str::from_utf8(input).map_or_else(|error| error.valid_up_to(), str::len);
    std::str::from_utf8(&input[..end]).unwrap_or_default()
}

/// Reads a model, as the compiler does before the algebra.
fn read(text: &str) {
    let file = SourceFile { path: "model.yaml".into(), text: text.to_owned() };
    let Some(model) = parsed(&file) else { return };
    let mechanism = laminate::build(&model, &mut Diagnostics::default());
    if let Err(problems) = mechanism.and_then(topology::build) {
        refused(&problems, &file);
    }
}

/// Returns the model of a text, `None` if the text is refused. What is read is written, and must be read as the same
/// model again.
fn parsed(file: &SourceFile) -> Option<SourceModel> {
    let (model, warnings) = match source::parse(file) {
        Ok(read) => read,
        Err(problems) => {
            refused(&problems, file);
            return None;
        }
    };
    render(&warnings, file);
    let written = SourceFile { path: "again.yaml".into(), text: source::to_yaml(&model) };
    match source::parse(&written) {
        Ok((again, _)) => assert_eq!(source::to_yaml(&again), written.text, "another model"),
        Err(problems) => panic!(
            "what was written cannot be read:\n{}\n{}",
            written.text,
            problems.render(&written, false)
        ),
    }
    Some(model)
}

/// Reads numbers; `None` if the text is refused.
fn read_numbers<T>(text: &str, read: impl FnOnce(&str) -> Result<T, Diagnostics>) -> Option<T> {
    let file = SourceFile { path: "numbers".into(), text: text.to_owned() };
    read(text).map_err(|problems| refused(&problems, &file)).ok()
}

fn refused(problems: &Diagnostics, file: &SourceFile) {
    assert!(problems.has_errors(), "a refusal says why");
    render(problems, file);
}

/// Renders the report on a text: of one text in eight, because reading takes a fraction of the time
/// of rendering.
fn render(problems: &Diagnostics, file: &SourceFile) {
    let sum = file.text.bytes().fold(0_u8, u8::wrapping_add);
    if sum.is_multiple_of(8) {
        let _ = problems.render(file, false);
    }
}
