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
