//! Snapshots of the diagnostics for invalid or odd models: `wrong/<name>.yaml` is the model, and
//! `wrong/<name>.stderr` is what the user reads ([`golden`](lamc_tests::golden) says how to change them).
//! The examples in `docs/ERRORS.md` are the smallest of these models. Files of numbers have the name of their reader
//! before the extension: `wrong/<name>.angles.csv`. Drawings are imported.

use std::fs;
use std::path::{Path, PathBuf};

use lamc::pipeline::{CompileError, Compiled, compile};
use lamc::source::pattern::{Options, import};
use lamc::source::{AngleUnit, Diagnostics, SourceFile};
use lamc_tests::golden::is_pinned;
use lamc_workbench::identify::{Record, family};
use lamc_workbench::mocap::Quaternions;
use lamc_workbench::optimise::Goals;
use lamc_workbench::reading::{configurations, states};
use lamc_workbench::sweep::plan::{Plan, Quantities, Quantity, Target};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("wrong")
}

/// The rendered errors and warnings about the model at `path`.
fn check(path: &Path) -> String {
    let mut file = SourceFile::read(path.to_str().expect("a fixture's path is UTF-8")).unwrap();
    // The same text wherever the project lies.
    file.path = format!("wrong/{}", path.file_name().unwrap().to_str().unwrap());
    let diagnostics = match numbers(&file) {
        Some(diagnostics) => diagnostics,
        None => match compile(&file) {
            Ok(compiled) => compiled.warnings,
            Err(CompileError::Model(errors)) => errors,
            Err(error) => panic!("{error}"),
        },
    };
    diagnostics.render(&file, false)
}

/// What is wrong with a drawing or a file of numbers; `None` for a model.
fn numbers(file: &SourceFile) -> Option<Diagnostics> {
    let text = &file.text;
    let joints = ["knee", "hip"];
    let bodies = [("base", true), ("arm", false)];
    let mut words = file.path.rsplit('.');
    let read = match (words.next()?, words.next()?) {
        ("csv", "angles") => Record::read(text, &joints, &[]).map(drop),
        ("csv", "rotations") => Quaternions::read(text, &bodies).map(drop),
        ("csv", "specimens") => family::read(text).map(drop),
        ("csv", "configurations") => configurations(text, &joints).map(drop),
        ("json", "states") => states(text).map(drop),
        ("yaml", "plan") => Plan::read(file, &quantities(), AngleUnit::default()).map(drop),
        ("yaml", "goals") => Goals::read(file, &designs()).map(drop),
        ("svg" | "fold" | "dxf", _) => {
            let bytes = text.clone().into_bytes();
            return Some(import(&file.path, bytes, "wrong", &Options::default()).found);
        }
        ("yaml", _) => return None,
        _ => panic!("{}: no reader has this name", file.path),
    };
    Some(read.expect_err("a file with a mistake"))
}

/// What the plans may name.
fn quantities() -> Quantities {
    let quantity = |name: &str, target, value| Quantity {
        name: name.to_owned(),
        target,
        value,
        dimension: None,
        has_effect: true,
    };
    Quantities(vec![
        quantity("k", Target::Parameter(0), 0.01),
        quantity("input.motor", Target::Input(0), 0.0),
        quantity("initial.knee", Target::Initial(0), 0.5),
        quantity("initial.hip", Target::Initial(1), 0.0),
    ])
}

/// What the goals are about: a plate on a hinge.
fn designs() -> Compiled {
    let text = "
units: { length: mm }
parameters: { crank: { value: 20 mm, range: [16 mm, 24 mm] }, width: 20 mm, slot: 1 mm }
materials: { card: { density: 700, thickness: 0.4 }, film: { density: 1380, thickness: 0.05, youngs_modulus: 4 GPa } }
layup: [card, film, card]
bodies:
  base: { fixed: true }
  arm: { outline: [[0, 0], [crank, 0], [crank, width], [0, width]] }
joints: { knee: { bodies: [base, arm], axis: [[0, 0], [0, 1]], hinge: { model: beam, material: film, length: slot, width: 10 } } }
points: { tip: { body: arm, at: [crank, 0, 0] } }
";
    compile(&SourceFile { path: "designs.yaml".to_owned(), text: text.to_owned() }).unwrap()
}

#[test]
fn diagnostics_are_as_pinned() {
    let mut inputs: Vec<_> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension != "stderr"))
        .collect();
    inputs.sort();
    assert!(inputs.len() >= 30, "only {} invalid models", inputs.len());
    let mut wrong = Vec::new();
    for input in inputs {
        let pinned = input.with_extension("stderr");
        let answer = check(&input);
        let is_reported = ["error[", "warning[", "note["].iter().any(|it| answer.starts_with(it));
        assert!(is_reported, "nothing is reported about {}:\n{answer}", input.display());
        wrong.extend((!is_pinned(&pinned, &answer)).then_some(pinned));
    }
    assert!(wrong.is_empty(), "{wrong:?} differ; `cargo xtask bless` rewrites them");
}

#[test]
fn every_snapshot_has_its_model() {
    for entry in fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        let has_input = ["yaml", "csv", "json", "svg", "fold", "dxf"]
            .iter()
            .any(|it| path.with_extension(it).is_file());
        assert!(has_input, "{} is left over", path.display());
    }
}

#[test]
fn text_that_is_not_utf8_is_located() {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), b"name: fine\nbodies: { b\xe4se: {} }\n").unwrap();
    let error = SourceFile::read(file.path().to_str().unwrap()).unwrap_err().to_string();
    assert!(
        error.ends_with(":2:12: [not-utf8] not UTF-8 text (byte 0xe4); save the file as UTF-8"),
        "{error}"
    );
}
