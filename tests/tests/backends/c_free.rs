//! C modules of mechanisms with free bodies against the runtime: a tumbling book, a six-bar that nothing holds, and
//! plates that jump on the ground.

use std::fs;

use lamc::backend::c::{self, Real};
use lamc_runtime::{Mechanism, Rk4, project};
use lamc_tests::random::{Random, closed_state};
use lamc_tests::{ROBOTS, compile_text, largest, workspace};

use super::c::{Case, agrees, ask, build_driver, compilers};

/// A box that turns about its middle axis of inertia, without gravity.
const BOOK: &str = "
name: book
gravity: [0, 0, 0]
bodies:
  book: { free: true, mass: 0.3, com: [0.4, -0.2, 0.1],
          inertia: [[1e-4, 0, 0], [0, 2e-4, 0], [0, 0, 2.7e-4]] }
initial:
  bodies:
    book: { position: [0.1, 0.2, 0.3], turn: [0.3, -0.2, 0.5], velocity: [0.2, 0.1, -0.3],
            angular_velocity: [0.01, 6.3, 0.02] }
";

/// The six-bar of the examples without its fixed body.
pub(super) fn free_sixbar() -> Case {
    let text = fs::read_to_string(workspace().join("examples/sixbar.yaml")).unwrap();
    let text = text.replacen("name: sixbar", "name: free_sixbar", 1);
    let text = text.replacen("fixed: true", "free: true", 1);
    let mut case = Case::new(compile_text(&text), Vec::new());
    let mut state = case.system.assembled().unwrap();
    let joints = case.system.dimensions().joints;
    state.u[joints..].copy_from_slice(&[0.3, -0.2, 0.5, 4.0, -3.0, 5.0]);
    project(&case.system, 0.0, &mut state.q, &mut state.u, &mut case.system.workspace()).unwrap();
    case.states = vec![state, closed_state(&case.system, &mut Random::new(3))];
    case
}

/// A model at its initial state.
fn started(text: &str) -> Case {
    let mut case = Case::new(compile_text(text), Vec::new());
    case.states = vec![case.system.assembled().unwrap()];
    case
}

/// A mechanism from where the ground pushes hardest in its first tenth of a second.
fn touching(mut case: Case) -> Case {
    let system = &case.system;
    let mut contacts = vec![0.0; 6 * system.dimensions().contacts];
    let (mut state, mut rk4, mut hardest) = (case.states[0].clone(), Rk4::new(system), 0.0);
    for _ in 0..1000 {
        rk4.step(system, &mut state, 1e-4).unwrap();
        system.write_contacts(state.t, &state.q, &state.u, &mut contacts).unwrap();
        let forces: Vec<f64> = contacts.chunks(6).flat_map(|row| row[3..].to_vec()).collect();
        let force = largest(&forces);
        if force > hardest {
            hardest = force;
            case.states = vec![state.clone()];
        }
    }
    case
}

#[test]
fn free_bodies_move_in_c_as_in_the_runtime() {
    let (compilers, folder) = (compilers(), tempfile::tempdir().unwrap());
    let mut random = Random::new(11);
    let mut book = started(BOOK);
    book.states.push(closed_state(&book.system, &mut random));
    let jumper = fs::read_to_string(workspace().join("tests/bindings/jumper.yaml")).unwrap();
    let mut jumper = started(&jumper);
    // A few impacts: each one parts neighbouring motions, and single precision loses them.
    jumper.steps = 40;
    // Its contacts are soft enough for the steps of this comparison.
    let hopper = fs::read_to_string(workspace().join("tests/data/hopper.yaml")).unwrap();
    let hopper = touching(started(&hopper));
    for case in [book, free_sixbar(), jumper, hopper] {
        agrees(&case, folder.path(), &compilers);
    }
}

#[test]
fn robots_are_in_c_what_they_are_in_the_runtime() {
    let (compilers, folder) = (compilers(), tempfile::tempdir().unwrap());
    for name in ROBOTS {
        let path = workspace().join(format!("examples/{name}.yaml"));
        let mut case = touching(started(&fs::read_to_string(path).unwrap()));
        // Their contacts are stiff: they need shorter steps.
        case.steps = 0;
        agrees(&case, folder.path(), &compilers);
    }
}

/// Ten seconds and ten turns of the book in C: its centre of mass follows a line, its angular momentum and energy
/// stay, and its quaternion is a unit quaternion.
#[test]
fn a_book_tumbles_in_c() {
    if !compilers().contains(&"gcc") {
        return;
    }
    let (case, folder) = (started(BOOK), tempfile::tempdir().unwrap());
    let program = &case.compiled.program;
    for (real, bound) in [(Real::Double, 1e-9), (Real::Float, 2e-4)] {
        let source = folder.path().join("book.c");
        fs::write(&source, c::source(program, real, "book.h")).unwrap();
        fs::write(folder.path().join("book.h"), c::header(program, real)).unwrap();
        let module = ["-O1", "-DFREE", source.to_str().unwrap()];
        let driver = build_driver(folder.path(), "book", real, &module);
        let of = |what: &str, questions: &str| -> Vec<f64> {
            let answers = ask(&driver, questions);
            let found = answers.into_iter().find(|(name, ..)| name == what).unwrap();
            assert_eq!(found.1, 0, "{what}");
            found.2
        };
        let words = |numbers: &[f64]| numbers.iter().map(|x| format!(" {x:?}")).collect::<String>();
        let start = &case.states[0];
        let state = words(&[&[0.0], &start.q[..], &start.u].concat());
        let run = format!("r 10000 1e-3{state}\n");
        let (q, u) = (of("q after steps", &run), of("u after steps", &run));
        let moved = words(&[&[10.0], &q[..], &u].concat());
        let [before, after] = [state, moved].map(|state| {
            let state = format!("s{state}\n");
            (of("momentum", &state), of("energy", &state))
        });
        for k in 0..3 {
            let expected = before.0[k] + 10.0 * start.u[k];
            assert!((after.0[k] - expected).abs() <= bound * 10.0, "{real:?}: centre {k}");
            let change = after.0[6 + k] - before.0[6 + k];
            let most = before.0[7].abs();
            assert!(change.abs() <= bound * most, "{real:?}: angular momentum {k} {change:e}");
        }
        let gain = after.1[0] / before.1[0] - 1.0;
        assert!(gain.abs() <= bound, "{real:?}: energy {gain:e}");
        let norm = q[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        let rounding = if real == Real::Double { 1e-15 } else { 2e-7 };
        assert!((norm - 1.0).abs() <= rounding, "{real:?}: norm {norm}");
    }
}

/// Modules of mechanisms without free bodies contain nothing of them.
#[test]
fn other_modules_contain_nothing_of_free_bodies() {
    let compiled = lamc_tests::compile(&workspace().join("examples/sixbar.yaml"));
    let mut text = c::source(&compiled.program, Real::Double, "sixbar.h");
    text.push_str(&c::header(&compiled.program, Real::Double));
    let words: Vec<_> = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
    assert!(words.contains(&"COORDINATES") && words.contains(&"FEW_SPEEDS"));
    for word in ["FREE_COUNT", "SPEEDS", "JOINTS", "quaternion", "sixbar_momentum"] {
        assert!(!words.contains(&word), "{word}");
    }
}
