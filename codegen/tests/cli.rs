//! The command `lamc` as a user meets it.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

fn lamc() -> Command {
    Command::new(env!("CARGO_BIN_EXE_lamc"))
}

fn run(arguments: &[&str]) -> Output {
    lamc().args(arguments).output().unwrap_or_else(|error| panic!("lamc: {error}"))
}

fn example(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name).display().to_string()
}

fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let path = folder.path().to_owned();
    (folder, path)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{error}"));
    entries.flatten().map(|entry| entry.file_name().display().to_string()).collect()
}

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
    assert!(text(&stale.stderr).contains("is stale: line"));
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
fn usage_is_code_two() {
    assert_eq!(run(&["--nonsense"]).status.code(), Some(2));
    assert_eq!(run(&[]).status.code(), Some(2));
    let version = text(&run(&["--version"]).stdout);
    assert!(version.contains("Symbolica") && version.contains("SYMBOLICA_LICENSE"), "{version}");
}

#[test]
fn two_processes_take_turns() {
    let start = || {
        let mut command = lamc();
        command.args([&example("sixbar.yaml"), "-o", "-"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().unwrap_or_else(|error| panic!("{error}"))
    };
    let running: Vec<_> = (0..4).map(|_| start()).collect();
    let mut modules = Vec::new();
    for process in running {
        let output = process.wait_with_output().unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        modules.push(output.stdout);
    }
    assert!(modules.iter().all(|module| *module == modules[0] && !module.is_empty()));
}

#[test]
fn eval_answers_in_the_stated_keys_and_names_the_wrong_state() {
    let ask = |states: &str| {
        let mut child = lamc()
            .args(["eval", &example("pendulum.yaml"), "--states", "-"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{error}"));
        if let Some(mut stdin) = child.stdin.take() {
            stdin.write_all(states.as_bytes()).ok();
        }
        child.wait_with_output().unwrap_or_else(|error| panic!("{error}"))
    };
    let good = ask(r#"{"states": [{"q": [0.1]}, {"q": [0.2], "u": [1.0], "t": 3}]}"#);
    assert_eq!(good.status.code(), Some(0), "{}", text(&good.stderr));
    let answer: serde_json::Value = serde_json::from_slice(&good.stdout).unwrap_or_default();
    assert_eq!(answer["model"], "pendulum");
    assert_eq!(answer["joints"][0], "hinge");
    let keys: Vec<_> = answer["states"][1].as_object().into_iter().flatten().collect();
    let mut keys: Vec<_> = keys.into_iter().map(|(key, _)| key.as_str()).collect();
    keys.sort_unstable();
    assert_eq!(
        keys,
        [
            "acceleration",
            "closure_residual",
            "constraint_rank",
            "dof",
            "forcing",
            "kinetic_energy",
            "mass_matrix",
            "potential_energy"
        ]
    );
    for (wrong, problem) in [
        (r#"{"states": [{"q": [0.1]}, {"q": [0.1, 0.2]}]}"#, "state 1: `q` has 2 numbers"),
        (r#"{"states": [{"q": [0.1], "params": {"k": 1}}]}"#, "no parameter or input"),
        (r#"{"states": [{"q": [0.1], "v": [1]}]}"#, "unknown field"),
        ("{", "EOF"),
    ] {
        let output = ask(wrong);
        assert_eq!(output.status.code(), Some(1), "{wrong}");
        assert!(text(&output.stderr).contains(problem), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn import_writes_a_model_that_compiles_to_the_same_motion() {
    let (_guard, folder) = folder();
    let copy = folder.join("sixbar.yaml").display().to_string();
    assert_eq!(run(&["import", &example("sixbar.yaml"), "-o", &copy]).status.code(), Some(0));
    let body = |model: &str| {
        let module = text(&run(&[model, "-o", "-"]).stdout);
        module.lines().filter(|line| !line.starts_with("//")).map(str::to_owned).collect::<Vec<_>>()
    };
    let original = body(&example("sixbar.yaml"));
    assert!(!original.is_empty());
    assert_eq!(original, body(&copy));
}

#[test]
fn simulate_writes_a_table_and_a_picture() {
    let (_guard, folder) = folder();
    let picture = folder.join("fourbar.svg").display().to_string();
    let model = example("pendulum.yaml");
    let table = run(&[
        "simulate",
        &model,
        "--csv",
        "-",
        "--plot",
        &picture,
        "--duration",
        "0.5",
        "--rate",
        "20",
        "--initial",
        "hinge=10deg",
    ]);
    assert_eq!(table.status.code(), Some(0), "{}", text(&table.stderr));
    let csv = text(&table.stdout);
    let mut lines = csv.lines();
    assert!(lines.next().is_some_and(|header| header.starts_with("t [s],q.hinge [rad]")));
    assert_eq!(lines.clone().count(), 11);
    let first: Vec<f64> =
        lines.next().into_iter().flat_map(|line| line.split(',')).flat_map(str::parse).collect();
    assert!((first[1] - 10.0_f64.to_radians()).abs() < 1e-15);
    assert!(
        fs::read_to_string(&picture).is_ok_and(|svg| svg.contains("<svg") && svg.contains("hinge"))
    );
    let wrong = run(&["simulate", &model, "--initial", "elbow=3"]);
    assert_eq!(wrong.status.code(), Some(1));
    assert!(text(&wrong.stderr).contains("no joint `elbow`"));
}
