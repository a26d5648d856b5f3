//! Motions: where they start, what drives them, what is recorded of them.

use super::compare::{largest_difference, maximum};
use std::fs;
use std::process::Command;

use super::common::{SWING, example, files, folder, json, number_before, run, text};
use super::not_checked::is_there;

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
    let highest = maximum(&angles);
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
        (vec!["simulate", &model, "--step", "1e-3"], 2),
        (vec!["simulate", &model, "--integrator", "rigid", "--step", "0"], 2),
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
    let off = |other: &[f64]| largest_difference(&driven, other);
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
    assert!(number_before(&free, "J drift") < 1e-10, "{free}");
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
    if !is_there("python3", &["-c", "import numpy"], "NumPy arrays") {
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
