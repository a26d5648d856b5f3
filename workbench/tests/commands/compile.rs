//! What `lamc MODEL` writes, and what it refuses.

use std::fs;

use super::common::{example, files, folder, run, text};

#[test]
fn compiles_to_a_file_and_to_standard_output() {
    let (_guard, folder) = folder();
    let file = folder.join("fourbar.rs").display().to_string();
    let model = example("fourbar.yaml");
    let written = run(&[&model, "-o", &file]);
    assert_eq!((written.status.code(), text(&written.stdout)), (Some(0), String::new()));
    let printed = run(&[&model, "-o", "-"]);
    assert_eq!(printed.status.code(), Some(0));
    assert_eq!(fs::read(&file).unwrap_or_default(), printed.stdout);
    let before = fs::metadata(&file).and_then(|data| data.modified()).ok();
    run(&[&model, "-o", &file]);
    let after = fs::metadata(&file).and_then(|data| data.modified()).ok();
    assert_eq!(before, after, "an unchanged file was written again");
}

#[test]
fn check_tells_fresh_from_stale_and_missing() {
    let (_guard, folder) = folder();
    let file = folder.join("pendulum.rs").display().to_string();
    let model = example("pendulum.yaml");
    let check = || run(&[&model, "-o", &file, "--check"]);
    assert_eq!(check().status.code(), Some(1));
    assert!(files(&folder).is_empty());
    run(&[&model, "-o", &file]);
    assert_eq!(check().status.code(), Some(0));
    let old = fs::read_to_string(&file).unwrap_or_default();
    fs::write(&file, old.replace("9.81", "1.62").replacen("N", "M", 1)).ok();
    let stale = check();
    assert_eq!(stale.status.code(), Some(1));
    assert!(text(&stale.stderr).contains("is out of date: line"));
}

#[test]
fn a_wrong_model_leaves_nothing_behind() {
    let (_guard, folder) = folder();
    let model = folder.join("wrong.yaml");
    fs::write(&model, "bodies: { a: { fixed: true } }\njonts: {}\n").ok();
    let file = folder.join("wrong.rs").display().to_string();
    let output = run(&[&model.display().to_string(), "-o", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    let report = text(&output.stderr);
    assert!(report.contains("wrong.yaml:2:1") && report.contains("joints"), "{report}");
    assert_eq!(files(&folder), ["wrong.yaml"]);
}

#[test]
fn c_is_written_with_its_header_or_not_at_all() {
    let (_guard, folder) = folder();
    let model = example("fourbar.yaml");
    let [c, h, odd] = ["motion.c", "motion.h", "a\"b.h"].map(|name| folder.join(name));
    let [c, h, odd] = [&c, &h, &odd].map(|path| path.display().to_string());
    for arguments in [
        vec![&*model, "--c", &c],
        vec![&model, "--c", &c, "--header", &c],
        vec![&model, "--c", &c, "--header", &odd],
        vec![&model, "--header", &h, "--extern-c"],
        vec![&model, "-o", &c, "--extern-c", "--header", &h],
        vec![&model],
    ] {
        assert_eq!(run(&arguments).status.code(), Some(2), "{arguments:?}");
    }
    let refused = text(&run(&[&model, "-o", &c]).stderr);
    assert!(refused.contains(&format!("for this file write `--c {c}`")), "{refused}");
    let failed = run(&[&model, "--c", &c, "--header", &h, "--cut", "hip"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(text(&failed.stderr).contains("there is no joint `hip`"));
    assert_eq!(files(&folder), Vec::<String>::new());
    let both = [&*model, "--c", &c, "--header", &h];
    assert_eq!(run(&both).status.code(), Some(0));
    let source = fs::read_to_string(&c).unwrap();
    assert!(source.contains("#include \"motion.h\""), "the header by the name it was given");
    let check: Vec<&str> = both.iter().copied().chain(["--check"]).collect();
    assert_eq!(run(&check).status.code(), Some(0));
    fs::write(&h, "stale").unwrap();
    assert_eq!(run(&check).status.code(), Some(1));
}

#[test]
fn numbers_that_single_precision_cannot_hold_are_refused() {
    let (_guard, folder) = folder();
    let path = folder.join("huge.yaml").display().to_string();
    let model = fs::read_to_string(example("pendulum.yaml")).unwrap();
    fs::write(&path, format!("{model}\nparameters: {{ huge: 1e300 }}\n")).unwrap();
    assert_eq!(run(&[&path, "-o", "-", "--scalar", "f64"]).status.code(), Some(0));
    for arguments in [vec!["-o", "-"], vec!["--c", "-", "--header", "x.h"]] {
        let mut all = vec![&*path, "--scalar", "f32"];
        all.extend(arguments);
        let output = run(&all);
        assert_eq!(output.status.code(), Some(1));
        assert!(text(&output.stderr).contains("1e300"), "{}", text(&output.stderr));
        assert_eq!(text(&output.stdout), "");
    }
}

#[test]
fn usage_is_code_two() {
    assert_eq!(run(&["--nonsense"]).status.code(), Some(2));
    assert_eq!(run(&[]).status.code(), Some(2));
    let version = text(&run(&["--version"]).stdout);
    assert!(version.contains("Symbolica") && version.contains("SYMBOLICA_LICENSE"), "{version}");
}

#[test]
fn python_and_fmus_are_written_whole_or_refused() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    let model = example("pendulum.yaml");
    let (c, header, python) = (at("p.c"), at("p.h"), at("p.py"));
    let elsewhere = run(&[&model, "--c", "p.c", "--header", &header, "--python", &python]);
    assert_eq!(elsewhere.status.code(), Some(2));
    assert!(text(&elsewhere.stderr).contains("in one folder"));
    for usage in [&["--python", &python][..], &["-o", "-", "--fmi", "3"][..]] {
        assert_eq!(run(&[&[model.as_str()], usage].concat()).status.code(), Some(2));
    }
    assert!(files(&folder).is_empty());
    let written = run(&[&model, "--c", &c, "--header", &header, "--python", &python]);
    assert_eq!(written.status.code(), Some(0));
    assert!(fs::read_to_string(&python).is_ok_and(|text| text.contains("\nclass Pendulum:\n")));

    let fmu = at("p.fmu");
    let check = || run(&[&model, "--fmu", &fmu, "--check"]).status.code();
    assert_eq!(run(&[&model, "--fmu", &fmu, "--fmi", "3"]).status.code(), Some(0));
    assert_eq!(check(), Some(1), "one version of FMI was taken for the other");
    assert_eq!(run(&[&model, "--fmu", &fmu]).status.code(), Some(0));
    assert_eq!(check(), Some(0));
    assert_eq!(fs::read(&fmu).ok(), Some(run(&[&model, "--fmu", "-"]).stdout));
}

#[test]
fn completions_and_manual() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = text(&run(&["completions", shell]).stdout);
        assert!(script.contains("simulate") && script.contains("duration"), "{shell}");
    }
    let (_guard, folder) = folder();
    assert_eq!(run(&["man", &folder.display().to_string()]).status.code(), Some(0));
    let page = |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_default();
    assert!(page("lamc.1").contains(".TH lamc 1") && page("lamc.1").contains("simulate"));
    assert!(page("lamc-simulate.1").contains("duration"));
}

/// The limits of stability of the method of order 4, 2 sqrt(2) along the imaginary axis and 2.785 along
/// the real one, over the eigenvalues of a swing and of a decay.
#[test]
fn check_prints_the_longest_stable_step() {
    let (_guard, folder) = folder();
    let file = folder.join("swing.yaml").display().to_string();
    // 1e-5 + 0.01 * 0.05^2 about the hinge.
    let inertia = 3.5e-5_f64;
    for (law, expected) in [
        ("stiffness: 0.01", 8.0_f64.sqrt() / (0.01 / inertia).sqrt()),
        ("stiffness: 1e-9, damping: 0.01", 2.785_293_563 * inertia / 0.01),
    ] {
        let model = format!(
            "gravity: [0, 0, 0]\nbodies:\n  base: {{ fixed: true }}\n  arm: {{ mass: 0.01, \
             com: [0.05, 0, 0], inertia: [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]] }}\njoints:\n  \
             j: {{ bodies: [base, arm], axis: [[0, 0], [0, 0.02]], {law} }}\n"
        );
        fs::write(&file, model).unwrap();
        let output = run(&["check", &file]);
        let report = text(&output.stdout);
        let line = report.lines().find(|line| line.starts_with("longest stable step of RK4"));
        let step = line.and_then(|line| line.split_whitespace().rev().nth(1)).expect(&report);
        let step: f64 = step.parse().unwrap();
        assert!((step / expected - 1.0).abs() < 2e-3, "{law}: {step} is not {expected}");
    }
}

#[test]
fn check_shows_bodies_of_any_size() {
    let (_guard, folder) = folder();
    let file = folder.join("speck.yaml").display().to_string();
    // A square of a micrometre and of a tenth of it, 700 kg/m^3, in grams and millimetres.
    let model = "units: { length: um }\nmaterials: { card: { density: 700, thickness: 0.1 } }\nlayup: [card]\n\
                 bodies:\n  base: { fixed: true }\n  \
                 flake: { outline: [[0, 0], [1, 0], [1, 1], [0, 1]] }\njoints:\n  \
                 j: { bodies: [base, flake], axis: [[0, 0], [0, 1]] }\n";
    fs::write(&file, model).unwrap();
    let output = run(&["check", &file]);
    let report = text(&output.stdout);
    let line = report.lines().find(|line| line.starts_with("flake")).expect(&report);
    let numbers: Vec<f64> =
        line.split_whitespace().skip(1).map(|word| word.parse().unwrap()).collect();
    let mass = 7e-14;
    let side = mass * 1e-6 * (1.0 + 0.01) / 12.0;
    let expected = [mass, 5e-4, 5e-4, 5e-5, side, side, mass * 1e-6 / 6.0];
    assert_eq!(numbers.len(), expected.len(), "{line}");
    for (found, expected) in numbers.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{line}: {found} is not {expected}");
    }
}
