//! What takes long: another process's turn, large models, flat sheets.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{Seek, Write};
use std::time::{Duration, Instant};
use std::{env, thread};

use std::process::Stdio;

use super::common::{example, folder, lamc, run, text};

#[test]
fn two_processes_take_turns() {
    let start = || {
        let mut command = lamc();
        command.args([&example("sixbar.yaml"), "-o", "-", "--no-cache"]);
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

/// A process that holds the lock and does not let go, as one that was stopped.
#[test]
fn who_waits_says_for_whom() {
    let home = env::home_dir().map(|home| home.join(".cache").join("lamc"));
    let lock = home.unwrap_or_else(env::temp_dir).join("symbolic.lock");
    // The folder is there once a process has had its turn.
    let check = ["check", &example("pendulum.yaml"), "--no-cache"];
    assert_eq!(run(&check).status.code(), Some(0));
    let mut file = File::options().read(true).write(true).open(&lock).unwrap();
    file.lock().unwrap();
    file.set_len(0).and_then(|()| file.rewind()).and_then(|()| write!(file, "4711")).unwrap();
    let mut waiting = lamc();
    waiting.args(check).stdout(Stdio::null()).stderr(Stdio::piped());
    let waiting = waiting.spawn().unwrap();
    thread::sleep(Duration::from_millis(2500));
    drop(file);
    let output = waiting.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let said = text(&output.stderr);
    assert!(said.contains("waiting for another lamc (pid 4711), for at most 600 s\n"), "{said}");
    // And what it waits with.
    assert!(said.contains("deriving the equations of 1 hinges ..\n"), "{said}");
    // By now the file may be another's, who is about to write its number.
    let mut holders = (0..100).map(|_| {
        thread::sleep(Duration::from_millis(10));
        fs::read_to_string(&lock).unwrap()
    });
    let holder = holders.find(|holder| holder.parse::<u32>().is_ok());
    assert!(holder.is_some_and(|holder| holder != "4711"));
}

/// A row of plates.
fn chain(hinges: usize) -> String {
    let mut bodies = "  b0: { fixed: true }\n".to_owned();
    let mut joints = String::new();
    for k in 1..=hinges {
        let _ =
            writeln!(bodies, "  b{k}: {{ outline: [[{k}, 0], [{k}.9, 0], [{k}.9, 1], [{k}, 1]] }}");
        let line = format!("[[{k}, 0], [{k}, 1]]");
        let _ = writeln!(joints, "  j{k}: {{ bodies: [b{}, b{k}], axis: {line} }}", k - 1);
    }
    let material = "materials: { card: { density: 700, thickness: 0.1 } }\nlayup: [card]\n";
    format!("{material}bodies:\n{bodies}joints:\n{joints}")
}

#[test]
fn too_many_hinges_are_refused_at_once() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    fs::write(at("chain.yaml"), chain(2001)).unwrap();
    let begin = Instant::now();
    let refused = run(&["simulate", &at("chain.yaml")]);
    let said = text(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        said.contains("error[too-many-hinges]: 2001 hinges") && said.contains("j2001"),
        "{said}"
    );
    assert!(said.contains("--max-hinges 2001") && begin.elapsed() < Duration::from_secs(20));
    // Reading and writing them takes no equations.
    let imported = run(&["import", &at("chain.yaml"), "-o", &at("copy.yaml")]);
    assert_eq!(imported.status.code(), Some(0), "{}", text(&imported.stderr));
    let model = example("triple_pendulum.yaml");
    for command in [
        &["check", &model][..],
        &["eval", &model],
        &["simulate", &model, "--duration", "0.1"],
        &["equilibrium", &model],
        &["modes", &model],
        &[&model, "-o", "-"],
        &["mocap", &at("quaternions.csv"), "--model", &model, "--synthesize", "0.1"],
    ] {
        for (most, code) in [("3", 0), ("2", 1)] {
            let output = run(&[command, &["--max-hinges", most]].concat());
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(code), "{command:?}: {said}");
            assert_eq!(said.contains("3 hinges are more than the 2"), code == 1, "{said}");
        }
    }
}

/// A sheet of Miura-ori as it is drawn, creased or not.
fn sheet(rows: usize, columns: usize, creased: bool) -> String {
    let x = |row: usize, column: usize| 30 * column + 18 * (row % 2);
    let mut bodies = String::new();
    let mut joints = String::new();
    for i in 0..rows {
        for j in 0..columns {
            let (y, above) = (24 * i, 24 * (i + 1));
            let fixed = if i + j == 0 { "fixed: true, " } else { "" };
            let [a, b, c, d] = [x(i, j), x(i, j + 1), x(i + 1, j + 1), x(i + 1, j)];
            let outline = format!("[[{a}, {y}], [{b}, {y}], [{c}, {above}], [{d}, {above}]]");
            let _ = writeln!(bodies, "  f{i}{j}: {{ {fixed}outline: {outline} }}");
            let mut joint = |name: &str, with: (usize, usize), axis: String, rest: f64| {
                let rest = if creased { rest } else { 0.0 };
                let other = format!("f{}{}", with.0, with.1);
                let _ = writeln!(
                    joints,
                    "  {name}{i}{j}: {{ bodies: [f{i}{j}, {other}], axis: {axis}, z: 0.3, \
                     stiffness: 1.3e-3, damping: 2e-6, rest: {rest} }}"
                );
            };
            if j + 1 < columns {
                let side = if j % 2 == 0 { 60.0 } else { -60.0 };
                joint("z", (i, j + 1), format!("[[{b}, {y}], [{c}, {above}]]"), side);
            }
            if i + 1 < rows {
                let side = if (i + j) % 2 == 0 { 38.2 } else { -38.2 };
                joint("s", (i + 1, j), format!("[[{d}, {above}], [{c}, {above}]]"), side);
            }
        }
    }
    format!(
        "units: {{ length: mm, angle: deg }}\nmaterials: {{ card: {{ density: 700, thickness: 0.6 }} }}\n\
         layup: [card]\nbodies:\n{bodies}joints:\n{joints}"
    )
}

/// Where nothing is said of how it folds: it starts, or says soon what is to be said.
#[test]
fn flat_sheets_start_or_ask_for_a_guess() {
    let (_guard, folder) = folder();
    for creased in [true, false] {
        let model = folder.join("sheet.yaml").display().to_string();
        fs::write(&model, sheet(4, 4, creased)).unwrap();
        let begin = Instant::now();
        let output = run(&["simulate", &model, "--duration", "0.02", "--rate", "1000"]);
        let said = text(&output.stderr);
        assert!(begin.elapsed() < Duration::from_secs(60), "{:?}", begin.elapsed());
        assert!(matches!(output.status.code(), Some(0 | 1)), "{said}");
        assert!(said.contains("warning: a flat sheet can fold") && said.contains("--initial"));
        // By the rest angles of its creases: as drawn, alternately up and down.
        assert_eq!(creased, said.contains("it starts bent by"), "{said}");
        let table = text(&output.stdout);
        for (name, sign) in [("z00", 1.0), ("z01", -1.0), ("z32", 1.0), ("s00", 1.0), ("s10", -1.0)]
        {
            let line = table.lines().find(|line| line.starts_with(name)).unwrap_or_default();
            let start: f64 = line.split_whitespace().nth(1).and_then(|x| x.parse().ok()).unwrap();
            assert!(if creased { start * sign > 0.01 } else { start == 0.0 }, "{line}");
        }
    }
}
