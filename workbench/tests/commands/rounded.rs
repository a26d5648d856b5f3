//! A drawing of few decimals at the command line.

use super::compare::largest;
use std::fs;
use std::process::Output;

/// A planar four-bar of our own, drawn along the axes, turned by an angle in degrees, in
/// millimetres with so many decimals.
fn four_bar(degrees: f64, decimals: usize, more: &str) -> String {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let point = |x: f64, y: f64| {
        format!("[{:.decimals$}, {:.decimals$}]", cosine * x - sine * y, sine * x + cosine * y)
    };
    let line = |x: f64| format!("[{}, {}]", point(x, 0.0), point(x, 24.0));
    let plate = |from: f64, to: f64, low: f64| {
        let corners = [(from, low), (to, low), (to, low + 24.0), (from, low + 24.0)];
        format!("[{}]", corners.map(|(x, y)| point(x, y)).join(", "))
    };
    format!(
        "units: {{ length: mm, angle: deg }}\n\
         materials: {{ card: {{ density: 800, thickness: 0.5 }} }}\nlayup: [card]\nbodies:\n  \
         base: {{ fixed: true }}\n  crank: {{ outline: {} }}\n  rocker: {{ outline: {} }}\n  \
         coupler: {{ outline: {} }}\njoints:\n  \
         a: {{ bodies: [base, crank], axis: {}, z: 0.25 }}\n  \
         b: {{ bodies: [base, rocker], axis: {}, z: 0.25 }}\n  \
         c: {{ bodies: [crank, coupler], axis: {}, z: 0.25 }}\n  \
         d: {{ bodies: [rocker, coupler], axis: {}, z: 0.25 }}\n{more}\n",
        plate(0.0, 35.0, 0.0),
        plate(80.0, 122.0, 24.0),
        plate(35.0, 122.0, 0.0),
        line(0.0),
        line(80.0),
        line(35.0),
        line(122.0),
    )
}

fn lamc(command: &str, model: &str, more: &[&str]) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fourbar.yaml");
    fs::write(&path, model).unwrap();
    let mut lamc = super::common::lamc();
    lamc.arg(command).arg(&path).args(more).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Rows of the motion from a folded state, without header.
fn motion(model: &str) -> Vec<Vec<f64>> {
    let asked = ["--duration", "0.3", "--rate", "50", "--tolerance", "1e-10", "--csv", "-"];
    let output = lamc("simulate", model, &asked);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let rows = text(&output.stdout);
    rows.lines().skip(1).map(|row| row.split(',').map(|x| x.parse().unwrap()).collect()).collect()
}

#[test]
fn its_motion_is_the_exact_one_to_the_size_of_the_rounding() {
    const FOLDED: &str = "initial: { q: { a: 20 } }";
    let exact = motion(&four_bar(0.0, 0, FOLDED));
    assert_eq!(exact.len(), 16);
    for (degrees, decimals) in [(37.3, 2), (37.3, 4), (123.0, 7), (-71.0, 10), (200.0, 12)] {
        let rounded = motion(&four_bar(degrees, decimals, FOLDED));
        let angles = exact.iter().zip(&rounded).flat_map(|(a, b)| a[1..5].iter().zip(&b[1..5]));
        let off = largest(angles.map(|(a, b)| a - b));
        // A link of 35 mm, and a motion of some radians that takes small errors some ten times.
        let rounding = 0.5 * 10_f64.powi(-(decimals as i32)) / 35.0;
        assert!(off <= 20.0 * rounding + 1e-9, "{off:e} at {degrees} deg, {decimals} decimals");
    }
}

#[test]
fn what_was_moved_is_said_once_and_is_no_failure() {
    let output = lamc("check", &four_bar(37.3, 4, ""), &[]);
    assert_eq!(output.status.code(), Some(0));
    let said = text(&output.stderr);
    assert!(said.starts_with("note[rounded]: hinge lines were moved by at most "), "{said}");
    assert!(said.contains("tolerance of 5.000e-5 mm") && !said.contains("warning"), "{said}");
    let report = text(&output.stdout);
    assert!(report.contains("mobility 1") && report.contains("planar, 9 equations, 3"), "{report}");
    // Nothing to move, nothing to say.
    for exact in [four_bar(0.0, 4, ""), four_bar(90.0, 0, "")] {
        let output = lamc("check", &exact, &[]);
        assert_eq!((output.status.code(), text(&output.stderr)), (Some(0), String::new()));
    }
}

#[test]
fn an_import_keeps_the_tolerance() {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("copy.yaml").display().to_string();
    for (model, tolerance) in [
        (four_bar(37.3, 4, ""), "5e-8"),
        (four_bar(37.3, 4, "tolerance: 0.002"), "2e-6"),
        (four_bar(37.3, 4, "tolerance: 0"), "0"),
    ] {
        assert_eq!(lamc("import", &model, &["-o", &copy]).status.code(), Some(0));
        let written = fs::read_to_string(&copy).unwrap();
        let line = written.lines().find_map(|line| line.strip_prefix("tolerance: ")).unwrap();
        assert_eq!(line.parse::<f64>().unwrap(), tolerance.parse::<f64>().unwrap());
    }
}

#[test]
fn a_loop_that_rounding_makes_rigid_is_no_quiet_success() {
    // In the flat state its equations allow a motion of which none comes, and beside it they contradict each
    // other.
    let output = lamc("simulate", &four_bar(37.3, 4, "tolerance: 0"), &[]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("near-miss") && said.contains("misses being planar"), "{said}");
    let error = said.lines().find(|line| line.starts_with("error: ")).unwrap();
    assert!(error.contains("cannot move") && error.contains("do not exist"), "{error}");
}

#[test]
fn motions_that_lose_or_exchange_energy_are_no_gain() {
    // Stiff, damped, fed by a motor, hardly moving, coarsely integrated: none of them is a fault.
    let model = |law: &str| four_bar(37.3, 3, "inputs: [motor]").replace("z: 0.25", law);
    for (law, asked) in [
        ("z: 0.25", vec!["--initial", "a=20deg", "--tolerance", "1e-3"]),
        ("z: 0.25, stiffness: 1e-3, rest: 0.01", vec!["--initial", "a=0.5deg"]),
        ("z: 0.25, stiffness: 1, damping: 1e-3, rest: 25", vec!["--initial", "a=20deg"]),
        (
            "z: 0.25, damping: 1e-6, torque: \"motor*sin(200*t)\"",
            vec!["--initial", "a=20deg", "--input", "motor=1e-4"],
        ),
        ("z: 0.25, stiffness: 1e-2, damping: 1e-5", vec!["--initial", "a=20deg", "--settle"]),
    ] {
        for method in ["auto", "rodas"] {
            let mut all = vec!["--duration", "0.5", "--integrator", method];
            all.extend(&asked);
            let output = lamc("simulate", &model(law), &all);
            assert_eq!(output.status.code(), Some(0), "{law}: {}", text(&output.stderr));
        }
    }
}

/// Number of facets along each side of the sheet below.
const FACETS: usize = 4;

/// Sector angle of the sheet below, rad.
const SECTOR: f64 = std::f64::consts::FRAC_PI_3;

/// A sheet of Miura-ori of our own as SVG, turned by an angle in degrees, in millimetres with so many decimals.
fn miura(degrees: f64, decimals: usize) -> String {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let point = |i: usize, j: usize| {
        let x = 20.0 * SECTOR.sin() * i as f64;
        let y = 15.0 * j as f64 + 20.0 * SECTOR.cos() * (i % 2) as f64;
        [cosine * x - sine * y, sine * x + cosine * y]
    };
    let mut text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"200mm\" height=\"200mm\" \
                    viewBox=\"-100 -50 200 200\">\n"
        .to_owned();
    let mut line = |from: [f64; 2], to: [f64; 2], colour: &str| {
        let [[x1, y1], [x2, y2]] = [from, to];
        text.push_str(&format!(
            "<line x1=\"{x1:.decimals$}\" y1=\"{y1:.decimals$}\" x2=\"{x2:.decimals$}\" \
             y2=\"{y2:.decimals$}\" stroke=\"{colour}\"/>\n"
        ));
    };
    let colour = |is_border: bool, is_mountain: bool| match (is_border, is_mountain) {
        (true, _) => "black",
        (false, true) => "red",
        (false, false) => "blue",
    };
    for i in 0..=FACETS {
        for j in 0..=FACETS {
            let is_edge = |k: usize| k == 0 || k == FACETS;
            if i < FACETS {
                line(point(i, j), point(i + 1, j), colour(is_edge(j), j % 2 == 1));
            }
            if j < FACETS {
                line(point(i, j), point(i, j + 1), colour(is_edge(i), (i + j) % 2 == 0));
            }
        }
    }
    text + "</svg>\n"
}

/// Opposite creases of a vertex fold by the same angle, and those of the two pairs by a < b with
/// tan(a/2) = cos(sector) tan(b/2).
#[test]
fn a_rounded_sheet_folds_as_the_exact_one() {
    let folder = tempfile::tempdir().unwrap();
    let model = "units: { length: mm, angle: deg }\nmaterials: { card: { density: 700, thickness: 0.3 } }\n\
                 layup: [card]\npattern: { file: sheet.svg, crease: { stiffness: 1e-3, damping: 1e-6 } }\n";
    fs::write(folder.path().join("sheet.yaml"), model).unwrap();
    for (degrees, decimals) in [(0.0, 2), (11.0, 2), (37.3, 2), (11.0, 3), (37.3, 6)] {
        fs::write(folder.path().join("sheet.svg"), miura(degrees, decimals)).unwrap();
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_lamc"))
            .args(["fold", "sheet.yaml", "--to", "50%", "--csv", "sheet.csv"])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let report = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{degrees} deg, {decimals} decimals: {report}");
        let table = fs::read_to_string(folder.path().join("sheet.csv")).unwrap();
        let header = table.lines().next().unwrap().split(',');
        let last = table.lines().last().unwrap().split(',');
        let angles = header.zip(last).filter(|(name, _)| name.starts_with("q."));
        let halves = angles.map(|(_, angle)| (angle.parse::<f64>().unwrap().abs() / 2.0).tan());
        let (mut less, mut more): (Vec<f64>, Vec<f64>) = {
            let mut halves: Vec<f64> = halves.collect();
            halves.sort_by(f64::total_cmp);
            let more = halves.split_off(halves.len() / 2);
            (halves, more)
        };
        // What the decimals are over the length of a crease.
        let rounding = 20.0 * 0.5 * 0.1_f64.powi(decimals as i32) / 15.0;
        for group in [&mut less, &mut more] {
            let (first, last) = (group[0], group[group.len() - 1]);
            assert!(first > 0.1 && last - first <= rounding * last, "{first} to {last}");
        }
        let ratio = less[0] / more[0];
        assert!((ratio - SECTOR.cos()).abs() <= rounding, "{degrees} deg, {decimals}: {ratio}");
    }
}
