//! `lamc fold`: its files, its exit codes, and what it says.

use std::fs;

use super::common::{example, folder, lamc, run, text};

#[test]
fn angles_and_the_last_state_are_written() {
    let (_guard, folder) = folder();
    let file = |name: &str| folder.join(name).display().to_string();
    let (csv, state, page) = (file("fold.csv"), file("fold.json"), file("fold.html"));
    let model = example("fold/waterbomb.yaml");
    let output = run(&[
        "fold",
        &model,
        "--to",
        "80%",
        "--steps",
        "8",
        "--csv",
        &csv,
        "--state",
        &state,
        "--view",
        &page,
        "--plot",
        &file("fold.svg"),
        "--png",
        &file("fold.png"),
        "--size",
        "64x64",
    ]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stdout);
    assert!(said.contains("folded to 80.0000 %"), "{said}");
    assert!(said.contains("mobility 4 flat, 3 folded"), "{said}");
    let table = fs::read_to_string(&csv).unwrap();
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(header[..4], ["progress [%]", "reached [%]", "closure [m]", "q.c4_0 [rad]"]);
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|number| number.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 9);
    assert_eq!((rows[0][0], rows[8][0]), (0.0, 80.0));
    assert!(rows.iter().all(|row| row.len() == 9 && row[2] < 1e-11));
    // `lamc eval` reads the state, which is closed.
    let evaluated = run(&["eval", &model, "--states", &state]);
    assert_eq!(evaluated.status.code(), Some(0), "{}", text(&evaluated.stderr));
    let state: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&state).unwrap()).unwrap();
    assert_eq!(state["states"][0]["q"][0].as_f64(), Some(rows[8][3]));
    assert!(fs::read_to_string(&page).unwrap().contains("\"unit\":\"%\""));
}

#[test]
fn what_ends_a_fold_is_an_error_after_the_files() {
    let (_guard, folder) = folder();
    let csv = folder.join("fold.csv").display().to_string();
    let output = run(&["fold", &example("fold/square_twist.yaml"), "--csv", &csv]);
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stderr);
    let expected = "error: the sheet cannot leave the flat state as its folds say: each loop closes alone, but not \
                    all together; the vertex at (";
    assert!(said.contains(expected), "{said}");
    assert_eq!(fs::read_to_string(&csv).unwrap().lines().count(), 2);
    let bent = run(&["fold", &example("fold/square_twist_bent.yaml")]);
    assert_eq!(bent.status.code(), Some(0), "{}", text(&bent.stderr));
    assert!(text(&bent.stdout).contains("pairs of facets pass through each other"));
}

#[test]
fn wrong_arguments_are_refused() {
    let model = example("fold/waterbomb.yaml");
    for to in ["80", "0%", "120 %", "-5%", "much", "80 deg"] {
        let output = lamc().args(["fold", &model, &format!("--to={to}")]).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{to}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains("--to 80%"), "{}", text(&output.stderr));
    }
    assert_eq!(run(&["fold", &model, "--steps", "0"]).status.code(), Some(2));
    let output = run(&["fold", &example("fourbar.yaml")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("no joint has a `fold`"), "{}", text(&output.stderr));
}

/// A motor at one crease moves all: by the spherical trigonometry of a vertex with two angles a and two angles
/// pi - a between its creases, tan(straight / 2) = cos(a) tan(zigzag / 2).
#[test]
fn a_motor_at_one_crease_moves_the_sheet() {
    let (_guard, folder) = folder();
    fs::copy(example("miura_sheet.svg"), folder.join("miura_sheet.svg")).unwrap();
    let own = "pattern:\n  joints: { crease_48_m50: { drive: \"-0.6 - 0.3*sin(2*pi*t)\", stiffness: 0 } }";
    let text_of_model = fs::read_to_string(example("miura_sheet.yaml")).unwrap();
    let [model, csv] =
        ["driven.yaml", "driven.csv"].map(|name| folder.join(name).display().to_string());
    fs::write(&model, text_of_model.replace("pattern:", own)).unwrap();
    let output = run(&["simulate", &model, "--duration", "0.75", "--csv", &csv]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = fs::read_to_string(&csv).unwrap();
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|it| it.starts_with(name)).unwrap();
    let [time, driven, straight] = ["t", "q.crease_48_m50", "q.crease_37_m65"].map(column);
    let cosine = 14.0 / 14_f64.hypot(30.0);
    let mut rows = 0;
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        let angle = 0.6 + 0.3 * (std::f64::consts::TAU * row[time]).sin();
        assert!((row[driven] + angle).abs() < 1e-9, "{line}");
        let expected = 2.0 * (cosine * (angle / 2.0).tan()).atan();
        assert!((row[straight].abs() - expected).abs() < 1e-8, "{line}");
        rows += 1;
    }
    assert!(rows > 10);
}
