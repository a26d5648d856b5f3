//! Hinges, fits and motion capture.

use std::fs;
use std::path::Path;

use super::common::{SWING, example, folder, run, text, told};

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
        (&["--gaps", "20mm"][..], "--width minus --gaps must be greater than zero"),
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
    assert_eq!(told(&within), "");
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
        (
            vec!["fit", &model, "--data", &run_csv, "--free", "k"],
            "there is no parameter or constant `k`",
        ),
        (vec!["fit", &model, "--data", "nowhere.csv", "--free", "damping"], "nowhere.csv"),
        (vec!["fit", &model, "--data", &quats, "--free", "damping"], "no column is an angle"),
        (vec!["mocap", &run_csv, "--model", &model], "no column belongs to a body"),
    ] {
        let refused = run(&arguments);
        assert_eq!(refused.status.code(), Some(1), "{arguments:?}");
        assert!(text(&refused.stderr).contains(says), "{}", text(&refused.stderr));
    }
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
    assert!(
        text(&output.stderr).contains("the record does not determine"),
        "{}",
        text(&output.stderr)
    );
}

/// Two plates with a hinge that tumble as they fall.
const PLATES: &str = "
units: { length: mm }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  wing: { outline: [[40, 0], [80, 0], [80, 30], [40, 20]] }
joints:
  hinge: { bodies: [hull, wing], axis: [[40, 0], [40, 20]], stiffness: STIFFNESS, damping: 1e-7, rest: 0.6 }
initial: { bodies: { hull: { position: [0, 0, 500], velocity: [1, 0, 0], angular_velocity: [3, -5, 10] } } }
";

#[test]
fn a_robot_without_a_base_is_fitted_with_and_without_its_pose() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    let [exact, guess, whole, angles] =
        ["exact.yaml", "guess.yaml", "run.csv", "angles.csv"].map(at);
    fs::write(&exact, PLATES.replace("STIFFNESS", "1e-4")).unwrap();
    fs::write(&guess, PLATES.replace("STIFFNESS", "2e-4")).unwrap();
    let motion = ["--duration", "0.2", "--rate", "360", "--tolerance", "1e-12", "--csv", &whole];
    let simulated = run(&[&["simulate", &exact][..], &motion].concat());
    assert_eq!(simulated.status.code(), Some(0), "{}", told(&simulated));
    let columns = fs::read_to_string(&whole).unwrap();
    let first = columns.lines().map(|line| line.split(',').take(2).collect::<Vec<_>>().join(","));
    fs::write(&angles, first.collect::<Vec<_>>().join("\n")).unwrap();
    let [plot, fitted] = ["left.svg", "fitted.csv"].map(at);
    let outputs = ["--plot", &plot, "--csv", &fitted];
    let unknown = "not in the record, so that the model tells their start: hull.vx, hull.vy";
    for (data, kept) in [(&whole, false), (&angles, true)] {
        let given = ["fit", &guess, "--data", data, "--free", "stiffness,damping"];
        let fit = run(&[&given[..], &outputs].concat());
        let found = text(&fit.stdout);
        assert!(found.contains("1.000000e-4") && found.contains("1.000000e-7"), "{found}");
        // The drawing is 80 mm long and 30 mm wide; a free body reaches out by its radius of gyration too.
        assert!(found.contains("they are divided by 86.7308 mm"), "{found}");
        assert_eq!(found.contains(unknown), kept, "{found}");
        assert_eq!(told(&fit), "");
    }
    let header = "t [s],q.hinge [rad],q.hull.x [m],q.hull.y [m],q.hull.z [m],q.hull.qw [1]";
    assert!(fs::read_to_string(&fitted).unwrap().starts_with(header));
    assert!(Path::new(&plot).is_file());
    fs::write(&angles, columns.replacen("q.hull.qy [1]", "quux", 1)).unwrap();
    let refused = run(&["fit", &guess, "--data", &angles, "--free", "stiffness"]);
    assert_eq!(refused.status.code(), Some(1));
    let says = "the orientation of `hull` has no column `q.hull.qy`";
    assert!(text(&refused.stderr).contains(says), "{}", text(&refused.stderr));
}
