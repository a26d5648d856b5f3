//! Warnings: suspicious drawings cause them, correct ones do not.

use lamc::pipeline::compile as compile_file;
use lamc::source::SourceFile;
use lamc_tests::{EXAMPLES, ROBOTS, compile, designs, workspace};

/// The warnings of the model at `path`.
fn warnings(path: &std::path::Path) -> String {
    compile(path).warnings.to_string()
}

#[test]
fn sound_models_cause_no_warning() {
    for name in EXAMPLES.into_iter().chain(ROBOTS) {
        let path = workspace().join("examples").join(format!("{name}.yaml"));
        assert_eq!(warnings(&path), "", "{name}");
    }
    for design in designs() {
        assert_eq!(design.compiled.warnings.to_string(), "", "{}", design.name);
    }
}

/// The hand lies on the arm, and their hinge is ten times too far.
const ODD: &str = "units: { length: mm, angle: deg }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  base: { fixed: true, outline: [[-20, 0], [0, 0], [0, 20], [-20, 20]] }
  arm: { outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  hand: { outline: [[38, 0], [60, 0], [60, 20], [38, 20]] }
joints:
  shoulder: { bodies: [base, arm], axis: [[0, 0], [0, 20]] }
  wrist: { bodies: [arm, hand], axis: [[400, 0], [400, 20]] }
";

const ANSWER: &str = "\
warning[overlapping-bodies]: `arm` and `hand` overlap by 40.0000 mm^2 in layer 1, counted from the bottom
 --> odd.yaml:7:20
  |
6 |   arm: { outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  |                   ------------------------------------ `arm`
7 |   hand: { outline: [[38, 0], [60, 0], [60, 20], [38, 20]] }
  |                    ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ overlaps `arm`
  |
  = help: the material of a sheet can belong to one body only: cut one of the plates back

warning[far-hinge]: the hinge line of `wrist` is 360.0000 mm from `arm` and 340.0000 mm from `hand`
  --> odd.yaml:10:39
   |
10 |   wrist: { bodies: [arm, hand], axis: [[400, 0], [400, 20]] }
   |                                       ^^^^^^^^^^^^^^^^^^^^^ far from the plates it joins
   |
   = help: are the points of its `axis` and its height `z` right, and their units?

";

#[test]
fn odd_drawings_are_warned_of() {
    let file = SourceFile { path: "odd.yaml".into(), text: ODD.into() };
    let warnings = compile_file(&file).unwrap_or_else(|error| panic!("{error}")).warnings;
    assert_eq!(warnings.render(&file, false), ANSWER);
}

/// A thousand plates on top of each other have half a million overlaps.
#[test]
fn overlaps_are_bounded() {
    let plate = |k: usize| format!("{{ outline: [[{k}, 0], [{}, 0], [{k}, 2000]] }}", k + 2000);
    let plates: Vec<_> = (0..1000).map(plate).collect();
    let text = format!(
        "units: {{ length: mm }}\nmaterials: {{ card: {{ density: 700, thickness: 0.4 }} }}
layup: [card]\nbodies: {{ base: {{ fixed: true }}, arm: {{ layers: [[{}]] }} }}
joints: {{ j: {{ bodies: [base, arm], axis: [[0, 0], [0, 20]] }} }}",
        plates.join(", ")
    );
    let compiled = compile_file(&SourceFile { path: "plates.yaml".into(), text }).unwrap();
    let codes: Vec<_> = compiled.warnings.0.iter().map(|warning| warning.code.name).collect();
    assert_eq!(codes, ["overlapping-plates"; 20]);
}
