//! Options and values that would change nothing, or that are out of range.

use std::fs;

use crate::common::{SWING, example, folder, run, text, told};

/// A model is not drawn: what says how to read a drawing is refused, and nothing is written.
#[test]
fn a_model_takes_no_options_of_drawings() {
    let (_guard, folder) = folder();
    let model = folder.join("swing.yaml").display().to_string();
    fs::write(&model, SWING.replace("TORQUE", "motor")).unwrap();
    let options: [&[&str]; 7] = [
        &["--scale", "2mm"],
        &["--tolerance", "1mm"],
        &["--layer", "cut=OUTLINE"],
        &["--crease-width", "3mm"],
        &["--triangulate"],
        &["--ground", "largest"],
        &["--explain", "problems.svg"],
    ];
    for option in options {
        let output = run(&[&["import", &model, "-o", "-"], option].concat());
        assert_eq!(output.status.code(), Some(2), "{option:?}");
        assert!(told(&output).contains(&format!("{} says how a drawing is read", option[0])));
        assert_eq!(text(&output.stdout), "");
    }
    assert_eq!(run(&["import", &model, "-o", "-"]).status.code(), Some(0));
}

/// A negative number after an option is its value, so that the option can say what it takes.
#[test]
fn negative_values_are_told_their_range() {
    let model = example("miura_sheet.yaml");
    let drawing = example("miura_sheet.svg");
    let commands: [(&[&str], &str); 7] = [
        (&["cut", &model, "--svg", "-", "--kerf", "-1mm"], "a length cannot be negative"),
        (&["cut", &model, "--svg", "-", "--registration", "-.5mm"], "a length cannot be negative"),
        (&["simulate", &model, "--duration", "-1"], "--duration must be a positive number"),
        (&["verify", &model, "--duration", "-1"], "--duration must be a positive number"),
        (&["fold", &model, "--to", "-10%"], "more than 0 and at most 100 %"),
        (&["import", &drawing, "-o", "-", "--crease-width", "-1mm"], "a length of 0 or more"),
        (&["import", &drawing, "-o", "-", "--scale", "-1mm"], "a length greater than 0"),
    ];
    for (command, range) in commands {
        let output = run(command);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{command:?}: {said}");
        assert!(said.contains(range) && !said.contains("-- -"), "{command:?}: {said}");
    }
    // It stays the value of an option that takes one.
    let output = run(&["import", &drawing, "-o", "-", "--ground", "-30,5"]);
    assert!(text(&output.stderr).contains("no facet is around the point (-30, 5)"));
}
