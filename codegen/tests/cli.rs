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
        vec![&model],
    ] {
        assert_eq!(run(&arguments).status.code(), Some(2), "{arguments:?}");
    }
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
            "motor_torques",
            "potential_energy",
            "q",
            "reactions",
            "t",
            "u"
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

fn json(output: &Output) -> serde_json::Value {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap_or_default()
}

#[test]
fn equilibrium_agrees_with_published_end_states() {
    let model = example("sixbar_markers.yaml");
    let csv = example("../docs/sixbar_published.csv");
    let table = run(&["equilibrium", &model, "--compare", &csv]);
    assert_eq!(table.status.code(), Some(0), "{}", text(&table.stderr));
    assert!(text(&table.stdout).contains("two-step"));
    // Of the authors' simulations that close first; rad, printed to six digits.
    let published = [
        ("0.0102", [0.280474, 0.0579898, 0.431370, -0.470499, -0.199470, -0.235800]),
        ("0.0114", [0.265413, 0.057515, 0.388605, -0.434225, -0.180187, -0.216840]),
        ("0.01315", [0.244296, 0.0552327, 0.339353, -0.389250, -0.157832, -0.193760]),
    ];
    let order = [
        "ground_east",
        "ground_west",
        "south_east_east",
        "west_south_west",
        "south_south_east",
        "south_west_south",
    ];
    for (k, angles) in published {
        let found = json(&run(&["equilibrium", &model, "--set", &format!("k={k}"), "--json"]));
        assert_eq!(found["stable"], true);
        assert!(found["closure_residual"].as_f64().is_some_and(|open| open < 1e-13));
        assert!(found["generalized_force"].as_f64().is_some_and(|force| force < 1e-12));
        let joints = found["joints"].as_array().cloned().unwrap_or_default();
        for (name, angle) in order.iter().zip(angles) {
            let index = joints.iter().position(|joint| joint == name).unwrap_or(99);
            let ours = found["q"][index].as_f64().unwrap_or(f64::NAN);
            assert!((ours - angle).abs() < 3e-5, "k = {k}, {name}: {ours} is not {angle}");
        }
    }
}

#[test]
fn modes_of_a_pendulum_by_hand() {
    let (_guard, folder) = folder();
    let file = folder.join("swing.yaml");
    let model = "
gravity: [0, -9.81, 0]
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints: { hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: 1e-3, damping: 4e-6 } }
";
    fs::write(&file, model).ok();
    let found = json(&run(&["modes", &file.display().to_string(), "--json"]));
    let inertia = 3e-7 + 0.002 * 0.02 * 0.02;
    let omega = f64::sqrt((1e-3 + 0.002 * 9.81 * 0.02) / inertia);
    let mode = &found["modes"][0];
    let near = |key: &str, expected: f64| {
        let value = mode[key].as_f64().unwrap_or(f64::NAN);
        assert!((value - expected).abs() < 1e-9 * expected, "{key}: {value} is not {expected}");
    };
    near("frequency", omega / std::f64::consts::TAU);
    near("damping_ratio", 4e-6 / inertia / (2.0 * omega));
    assert_eq!((&found["stable"], &mode["shape"][0][0]), (&true.into(), &1.0.into()));
}

/// A lever that a force holds up: it settles, is let go, and swings about where it then rests.
#[test]
fn settle_and_release() {
    let (_guard, folder) = folder();
    let file = folder.join("lever.yaml").display().to_string();
    let model = "
bodies:
  base: { fixed: true }
  lever: { mass: 2 g, com: [0.02, 0, 0], inertia: [[1e-9, 0, 0], [0, 3e-7, 0], [0, 0, 3e-7]] }
joints: { hinge: { bodies: [base, lever], axis: [[0, 0], [0, 1]], stiffness: 2e-3 } }
points: { tip: { body: lever, at: [0.04, 0, 0] } }
forces: { pull: { point: tip, force: [0, 0, 0.02] } }
";
    fs::write(&file, model).ok();
    let rest = |release: &[&str]| {
        let arguments = [&["equilibrium", &file, "--json"], release].concat();
        json(&run(&arguments))["q"][0].as_f64().unwrap_or(f64::NAN)
    };
    let (pulled, free) = (rest(&[]), rest(&["--release", "pull"]));
    // k q = (m g l - F b) cos q about +y, where positive angles lower the lever.
    for (q, torque) in [(pulled, 0.002 * 9.81 * 0.02 - 0.02 * 0.04), (free, 0.002 * 9.81 * 0.02)] {
        assert!((2e-3 * q - torque * q.cos()).abs() < 1e-12, "{q}");
    }
    let csv = folder.join("swing.csv").display().to_string();
    let output = run(&["simulate", &file, "--release", "pull", "--csv", &csv, "--duration", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = fs::read_to_string(&csv).unwrap_or_default();
    let angles: Vec<f64> =
        table.lines().skip(1).filter_map(|line| line.split(',').nth(1)?.parse().ok()).collect();
    assert_eq!(angles[0], pulled);
    let highest = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!(highest > free && angles.iter().all(|q| *q >= pulled - 1e-6), "{highest} {free}");
    let settled = run(&["simulate", &file, "--settle", "--csv", "-", "--duration", "0.1"]);
    let still = text(&settled.stdout);
    assert!(still.lines().skip(1).all(|line| {
        line.split(',').nth(2) == Some("0.0")
            || line
                .split(',')
                .nth(2)
                .and_then(|u| u.parse().ok())
                .is_some_and(|u: f64| u.abs() < 1e-9)
    }));
    let unknown = run(&["simulate", &file, "--release", "pul"]);
    assert_eq!(unknown.status.code(), Some(1));
    assert!(text(&unknown.stderr).contains("did you mean `pull`?"), "{}", text(&unknown.stderr));
}

#[test]
fn locks_stops_and_usage() {
    let model = example("sixbar.yaml");
    let locked = json(&run(&["equilibrium", &model, "--lock", "ground_west=10deg", "--json"]));
    let q = locked["q"][5].as_f64().unwrap_or(f64::NAN);
    assert!((q - 10.0_f64.to_radians()).abs() < 1e-15);
    for (arguments, code) in [
        (vec!["simulate", &model, "--duration", "0"], 2),
        (vec!["simulate", &model, "--restitution", "1.5"], 2),
        (vec!["simulate", &model, "--lock", "ground_west"], 2),
        (vec!["simulate", &model, "--lock", "ground_est=1deg"], 1),
        (vec!["equilibrium", &model, "--lock", "ground_west=190deg"], 1),
        (vec!["equilibrium", &model, "--json", "--compare", "x.csv"], 2),
        (vec!["equilibrium", &model, "--compare", "nowhere.csv"], 1),
        (vec!["eval", &model, "--states", "-", "--initial", "ground_west=1deg"], 2),
    ] {
        let output = run(&arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", text(&output.stderr));
        assert!(output.stdout.is_empty() && !output.stderr.is_empty());
    }
    // An assembled initial configuration, evaluated.
    let found = json(&run(&["eval", &model, "--initial", "ground_west=10deg"]));
    assert!(found["states"][0]["closure_residual"].as_f64().is_some_and(|open| open < 1e-12));
}

/// Links are followed, devices stay devices.
#[cfg(unix)]
#[test]
fn what_is_no_plain_file_stays_what_it_is() {
    let (_guard, folder) = folder();
    let (link, target) = (folder.join("link.csv"), folder.join("target.csv"));
    fs::write(&target, "old").ok();
    std::os::unix::fs::symlink(&target, &link).ok();
    let write = |path: &Path| {
        let path = path.display().to_string();
        run(&["simulate", &example("pendulum.yaml"), "--duration", "0.05", "--csv", &path])
    };
    assert_eq!(write(&link).status.code(), Some(0));
    assert!(fs::symlink_metadata(&link).is_ok_and(|data| data.is_symlink()));
    assert!(fs::read_to_string(&target).unwrap_or_default().starts_with("t [s]"));
    assert_eq!(write(Path::new("/dev/full")).status.code(), Some(1));
    let missing = write(&folder.join("nowhere").join("out.csv"));
    assert_eq!(missing.status.code(), Some(1));
    assert_eq!(files(&folder).len(), 2);
}

/// Flat four-bars and six-bars leave their singular start, and a loop driven twice is warned of.
#[test]
fn flat_starts_and_too_many_drives() {
    let (_guard, folder) = folder();
    let bar = |name: &str, mass: f64, x: f64| {
        format!(
            "  {name}: {{ mass: {mass}, com: [{x}, 0.01, 0], \
             inertia: [[1e-7, 0, 0], [0, 1e-6, 0], [0, 0, 1.1e-6]] }}\n"
        )
    };
    let model = |first: &str, last: &str| {
        format!(
            "bodies:\n  base: {{ fixed: true }}\n{}{}{}joints:
  j0: {{ bodies: [base, a], axis: [[0, 0], [0, 0.02]], {first} }}
  j1: {{ bodies: [a, b], axis: [[0.03, 0], [0.03, 0.02]], stiffness: 1e-3 }}
  j2: {{ bodies: [b, c], axis: [[0.12, 0], [0.12, 0.02]], stiffness: 1e-3 }}
  j3: {{ bodies: [c, base], axis: [[0.015, 0], [0.015, 0.02]], {last} }}\n",
            bar("a", 0.001, 0.015),
            bar("b", 0.003, 0.075),
            bar("c", 0.0035, 0.0675)
        )
    };
    let file = folder.join("flat.yaml").display().to_string();
    fs::write(&file, model("stiffness: 1e-3", "stiffness: 1e-3")).ok();
    let output = run(&["simulate", &file, "--duration", "0.5"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let report = text(&output.stdout);
    assert!(report.contains("RODASP") && report.contains("Dormand-Prince"), "{report}");
    fs::write(&file, model("drive: t", "drive: -0.1*t")).ok();
    let output = run(&["check", &file]);
    let report = text(&output.stderr);
    assert!(report.contains("warning[overdriven]") && report.contains("`j0`, `j3`"), "{report}");
    assert!(text(&output.stdout).contains("driven: `j0`, `j3`"));
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

/// A pendulum with an input.
const SWING: &str = "
parameters: { gain: 2e-3 }
inputs: [motor]
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: 1e-3, damping: 4e-6,
           torque: TORQUE }
points: { tip: { body: rod, at: [0, -0.04, 0] } }
";

#[test]
fn an_input_given_as_a_formula_is_that_formula() {
    let (_guard, folder) = folder();
    let model = |name: &str, torque: &str| {
        let file = folder.join(name).display().to_string();
        fs::write(&file, SWING.replace("TORQUE", torque)).ok();
        file
    };
    let (by_input, written) = (model("a.yaml", "0.5*motor"), model("b.yaml", "gain*sin(9*t)/2"));
    let table = |arguments: &[&str]| {
        let arguments = [&["simulate", "--csv", "-", "--duration", "1"], arguments].concat();
        let output = run(&arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let table = text(&output.stdout);
        let cells = table.lines().skip(1).flat_map(|line| line.split(','));
        cells.map(|cell| cell.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>()
    };
    let driven = table(&[&by_input, "--input", "motor=gain*sin(9*t)", "--set", "gain=3mN*m"]);
    let same = table(&[&written, "--set", "gain=3mN*m"]);
    let still = table(&[&by_input]);
    let off = |other: &[f64]| {
        assert_eq!(driven.len(), other.len());
        driven.iter().zip(other).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    };
    assert!(off(&same) < 1e-9 && off(&still) > 1e-2, "{} {}", off(&same), off(&still));
    for (input, code, reason) in [
        ("motor=gain*sin(9*x)", 1, "`x`"),
        ("motor=u.hinge", 1, "it may depend on t and parameters"),
        ("mottor=sin(t)", 1, "did you mean `motor`?"),
        ("motor", 2, "--input motor=0.02"),
    ] {
        let output = run(&["simulate", &by_input, "--input", input]);
        assert_eq!(output.status.code(), Some(code), "{input}");
        assert!(text(&output.stderr).contains(reason), "{input}: {}", text(&output.stderr));
    }
}

/// The number before a word of a report.
fn number_before(report: &str, word: &str) -> f64 {
    let before = report.split(word).next().unwrap_or_default().trim_end();
    before.rsplit(' ').next().and_then(|number| number.parse().ok()).unwrap_or(f64::NAN)
}

/// T + V against the integral of what torques and dampers do, found apart from it.
#[test]
fn the_energy_balance_adds_up() {
    let (_guard, folder) = folder();
    let file = folder.join("swing.yaml").display().to_string();
    fs::write(&file, SWING.replace("TORQUE", "motor + 1e-4*tanh(u.hinge)")).ok();
    let report = |arguments: &[&str]| {
        let output = run(&[&["simulate"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    for arguments in [
        vec![file.as_str(), "--initial", "hinge=30deg", "--input", "motor=gain*cos(7*t)"],
        vec![&example("pendulum.yaml")],
        vec![&example("sixbar.yaml")],
        vec![&example("fourbar.yaml"), "--integrator", "rodas"],
    ] {
        let report = report(&arguments);
        let balance = report.split("balance: ").nth(1).unwrap_or_default();
        let (did, off) = (number_before(balance, "J;"), number_before(balance, "J unaccounted"));
        assert!(did.abs() > 1e-6 && off < 1e-5 * did.abs(), "{arguments:?}: {report}");
    }
    // What takes energy besides is not known: nothing is claimed.
    let lock = report(&[&example("sixbar.yaml"), "--lock", "ground_west=20deg"]);
    assert!(lock.contains("energy:") && !lock.contains("balance:"), "{lock}");
    // Nothing takes any.
    let free = folder.join("free.yaml").display().to_string();
    fs::write(&free, SWING.replace("TORQUE", "0").replace(", damping: 4e-6", "")).ok();
    let free = report(&[&free, "--initial", "hinge=1"]);
    assert!(number_before(&free, "J drifted away") < 1e-10, "{free}");
}

#[test]
fn numpy_reads_the_archive() {
    let (_guard, folder) = folder();
    let file = |name: &str| folder.join(name).display().to_string();
    let (npz, csv) = (file("m.npz"), file("m.csv"));
    let model = example("fourbar.yaml");
    let output = run(&["simulate", &model, "--duration", "0.2", "--npz", &npz, "--csv", &csv]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(fs::read(&npz).is_ok_and(|bytes| bytes.starts_with(b"PK")));
    let numpy = Command::new("python3").args(["-c", "import numpy"]).output();
    if !numpy.is_ok_and(|output| output.status.success()) {
        eprintln!("NOT CHECKED: python3 with numpy is absent");
        return;
    }
    // The point is where the pose of its body puts what was drawn; the table has the same numbers.
    let script = "
import sys, numpy as np
z = np.load(sys.argv[1])
table = np.genfromtxt(sys.argv[2], delimiter=',', skip_header=1)
names = open(sys.argv[2]).readline().strip().split(',')
joints = list(z['joints'])
assert joints == ['crank_hinge', 'rocker_hinge', 'coupler_crank', 'coupler_rocker'], joints
for key, unit in ('q', 'rad'), ('u', 'rad/s'), ('a', 'rad/s^2'):
    for j, joint in enumerate(joints):
        assert (z[key][:, j] == table[:, names.index(f'{key}.{joint} [{unit}]')]).all()
for key, unit in ('t', 's'), ('kinetic', 'J'), ('potential', 'J'), ('closure', 'm'):
    assert (z[key] == table[:, names.index(f'{key} [{unit}]')]).all()
body, drawn = list(z['bodies']).index('coupler'), np.array([0.36, -0.247, 0.0025])
tip = z['rotations'][:, body] @ drawn + z['translations'][:, body]
assert abs(tip - z['positions'][:, list(z['points']).index('tip')]).max() < 1e-15
assert abs(tip[:, 0] - table[:, names.index('tip.x [m]')]).max() < 1e-15
assert abs(tip - tip[0]).max() > 1e-3
";
    let output = Command::new("python3").args(["-c", script, &npz, &csv]).output();
    let output = output.unwrap_or_else(|error| panic!("{error}"));
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn pictures_of_every_panel() {
    let (_guard, folder) = folder();
    let model = example("triple_pendulum.yaml");
    let file = |name: &str| folder.join(name).display().to_string();
    let draw = |name: &str| {
        let panels = "angles,rates,accelerations,energy,closure,phase,paths";
        let picture = file(name);
        run(&["simulate", &model, "--duration", "0.2", "--panels", panels, "--plot", &picture])
    };
    assert_eq!(draw("m.svg").status.code(), Some(0));
    let svg = fs::read_to_string(file("m.svg")).unwrap_or_default();
    for label in ["angle, deg", "rate, deg/s", "energy, J", "z, mm", "elbow", "tip", "potential"] {
        assert!(svg.contains(label), "no `{label}`");
    }
    assert_eq!(draw("m.png").status.code(), Some(0));
    let png = fs::read(file("m.png")).unwrap_or_default();
    assert!(png.starts_with(b"\x89PNG") && png.len() > 50_000, "{} bytes", png.len());
    assert_eq!(draw("m.pdf").status.code(), Some(2));
    assert_eq!(files(&folder).len(), 2);
}

/// An interrupt keeps what has been simulated, whole, and says so.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_is_done() {
    let (_guard, folder) = folder();
    let (model, csv) = (folder.join("swing.yaml"), folder.join("m.csv"));
    // It never comes to rest.
    fs::write(&model, SWING.replace("TORQUE", "0").replace(", damping: 4e-6", "")).ok();
    let child = lamc()
        .args(["simulate", &model.display().to_string(), "--duration", "1e6", "--rate", "1"])
        .args(["--initial", "hinge=1", "--csv", &csv.display().to_string()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{error}"));
    std::thread::sleep(std::time::Duration::from_secs(3));
    assert_eq!(files(&folder), ["swing.yaml"], "a file before its time");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("interrupted"), "{}", text(&output.stdout));
    assert_eq!(files(&folder).len(), 2);
    let table = fs::read_to_string(&csv).unwrap_or_default();
    let columns = table.lines().next().map_or(0, |header| header.split(',').count());
    let lines = table.lines().count();
    assert!(lines > 2 && lines < 1_000_000 && table.ends_with('\n'), "{lines} lines");
    assert!(table.lines().all(|line| line.split(',').count() == columns));
}

/// Said before the work, not after it.
#[test]
fn where_nothing_can_be_written() {
    let (_guard, folder) = folder();
    let locked = folder.join("nowhere/m.npz").display().to_string();
    for (path, reason) in
        [(locked.as_str(), "there is no folder"), (&folder.display().to_string(), "directory")]
    {
        let begin = std::time::Instant::now();
        let long = ["simulate", &example("sixbar.yaml"), "--duration", "10000", "--rate", "1"];
        let output = run(&[&long[..], &["--npz", path]].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(text(&output.stderr).contains(reason), "{}", text(&output.stderr));
        assert!(begin.elapsed().as_secs() < 20);
    }
    assert!(files(&folder).is_empty());
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

#[test]
fn hinges_answer_and_refuse() {
    let beam = |more: &[&str]| {
        let strip = ["--thickness", "0.127mm", "--length", "1.75mm", "--width", "20mm"];
        run(&[&["hinge", "beam", "--youngs-modulus", "4383.27MPa"][..], &strip, more].concat())
    };
    let answer = text(&beam(&["--yield-stress", "42.84MPa"]).stdout);
    // E w t^3 / 12 x, and 2 sigma x / (E t).
    assert!(answer.contains("8.551063e-3 N m/rad") && answer.contains("15.4326 deg"), "{answer}");
    for (more, says) in [
        (&["--gaps", "20mm"][..], "--width less --gaps must be more than zero"),
        (&["--yield-stress", "1 mm"][..], "as in `1 Pa`"),
        (&["--arm", "1m"][..], "--yield-stress"),
    ] {
        let refused = beam(more);
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains(says), "{}", text(&refused.stderr));
    }
    let long = run(&["hinge", "sharifzadeh2018", "--length", "1cm", "--width", "5cm"]);
    assert_eq!(long.status.code(), Some(1));
    assert!(text(&long.stderr).contains("the length 0.01 m is not within 0.0005 .. 0.0049 m"));
}

#[test]
fn a_motion_beyond_the_linear_range_is_told() {
    let (_guard, folder) = folder();
    let model = folder.join("strip.yaml").display().to_string();
    let yaml = "
materials: { film: { density: 1380, thickness: 0.127 mm, youngs_modulus: 4383.27 MPa, yield_stress: 42.84 MPa } }
layup: [film]
bodies: { base: { fixed: true }, flap: { outline: [[0, 0], [0.04, 0], [0.04, 0.02], [0, 0.02]] } }
joints: { j: { bodies: [base, flap], axis: [[0, 0], [0, 0.02]], hinge: { model: beam, material: film, length: 1 mm, width: 20 mm } } }
initial: { q: { j: 10 deg } }
";
    fs::write(&model, yaml).ok();
    for command in [&["check", &model][..], &["simulate", &model, "--duration", "0.1"][..]] {
        let output = run(command);
        assert_eq!(output.status.code(), Some(0));
        let told = text(&output.stderr);
        assert!(told.contains("`j` leaves its linear range of 8.82 deg at t = 0.000 s"), "{told}");
    }
    let within = run(&["simulate", &model, "--duration", "0.1", "--initial", "j=5deg"]);
    assert_eq!(text(&within.stderr), "");
}

#[test]
fn fits_and_motion_capture_go_from_file_to_file() {
    let (_guard, folder) = folder();
    let path = |name: &str| folder.join(name).display().to_string();
    let model = example("pendulum.yaml");
    let (run_csv, quats, angles) = (path("run.csv"), path("quats.csv"), path("angles.csv"));
    let simulated =
        run(&["simulate", &model, "--duration", "0.5", "--rate", "200", "--csv", &run_csv]);
    assert_eq!(simulated.status.code(), Some(0));
    let (left, fitted) = (path("left.svg"), path("fitted.csv"));
    let fit = run(&[
        "fit",
        &model,
        "--data",
        &run_csv,
        "--free",
        "damping,stiffness_hinge",
        "--plot",
        &left,
        "--csv",
        &fitted,
    ]);
    let found = text(&fit.stdout);
    assert!(found.contains("7.600000e-3") && found.contains("2.500000e-5"), "{found}");
    assert!(Path::new(&left).is_file() && Path::new(&fitted).is_file());
    let made = run(&["mocap", &quats, "--model", &model, "--synthesize", "0.5"]);
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let read = run(&["mocap", &quats, "--model", &model, "--output", &angles]);
    assert!(text(&read.stdout).contains("hinge"), "{}", text(&read.stderr));
    let again = run(&["fit", &model, "--data", &angles, "--free", "stiffness", "--from-rest"]);
    assert!(text(&again.stdout).contains("7.6000"), "{}", text(&again.stdout));
    for (arguments, says) in [
        (vec!["fit", &model, "--data", &run_csv, "--free", "k"], "no parameter `k`"),
        (vec!["fit", &model, "--data", "nowhere.csv", "--free", "damping"], "nowhere.csv"),
        (vec!["fit", &model, "--data", &quats, "--free", "damping"], "no column is an angle"),
        (vec!["mocap", &run_csv, "--model", &model], "no column is a body's"),
    ] {
        let refused = run(&arguments);
        assert_eq!(refused.status.code(), Some(1), "{arguments:?}");
        assert!(text(&refused.stderr).contains(says), "{}", text(&refused.stderr));
    }
}

#[test]
fn outputs_are_what_their_names_say_and_apart() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    let model = example("pendulum.yaml");
    let (one, avi, jpg) = (at("one.csv"), at("one.avi"), at("one.jpg"));
    for arguments in [
        &["simulate", &model, "--csv", "-", "--plot", "-"][..],
        &["simulate", &model, "--csv", &one, "--npz", &one],
        &["simulate", &model, "--video", &avi],
        &["simulate", &model, "--png", &jpg],
        &["fit", &model, "--data", &one, "--free", "damping", "--plot", &jpg],
        &["fit", &model, "--data", &one, "--free", "damping", "--initial", "hinge=1"],
        &["mocap", &one, "--model", &model, "--plot", &jpg],
        &["hinge", "family", &one, "--name", "a b", "--output", &jpg],
        &["hinge", "family", &one, "--name", "beam", "--output", &jpg],
    ] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stderr));
    }
    assert!(files(&folder).is_empty());
}

#[test]
fn a_fit_says_what_its_record_does_not_tell() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    let (model, data) = (at("rest.yaml"), at("rest.csv"));
    // At rest at 0.3 rad nothing is damped.
    let still = SWING.replace("TORQUE", "0").replace("4e-6", "4e-6, rest: 0.3");
    fs::write(&model, format!("gravity: [0, 0, 0]\n{still}")).unwrap();
    let rows: String = (0..100).map(|k| format!("{},0.3\n", f64::from(k) / 100.0)).collect();
    fs::write(&data, format!("t [s],q.hinge [rad]\n{rows}")).unwrap();
    let output = run(&["fit", &model, "--data", &data, "--free", "stiffness,damping"]);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stdout));
    assert!(text(&output.stderr).contains("the record does not tell"), "{}", text(&output.stderr));
}
