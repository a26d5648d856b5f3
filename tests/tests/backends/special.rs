//! Numbers that no robot has: NaN, infinities, the smallest and the largest numbers, angles of 1e9 rad. C says of them what the
//! runtime says, reports no number that is not finite as a result, and changes nothing where it fails.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use lamc::backend::c::Real;
use lamc_generated::linkage::{self, Linkage};
use lamc_runtime::{Error, Mechanism, Rk4, State, acceleration, assemble, project};
use lamc_tests::relative_error;

use super::c::{
    Answer, Case, FORMULAS, State64, ask, build_driver, code, compilers, words, write_c,
};
use super::c_free::free_sixbar;

const SPECIAL: [f64; 10] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    1e200,
    1e9,
    f64::MIN_POSITIVE,
    5e-324,
    -0.0,
    -1e9,
];

/// A step that is short for each mechanism, s.
const STEP: f64 = 1e-4;

/// A state with each of its numbers replaced by each of the special ones.
fn spoiled(state: &State64) -> Vec<State64> {
    let (nq, nu) = (state.q.len(), state.u.len());
    let mut states = vec![state.clone()];
    for special in SPECIAL {
        for index in 0..=nq + nu {
            let mut state = state.clone();
            match index {
                0 => state.t = special,
                _ if index <= nq => state.q[index - 1] = special,
                _ => state.u[index - 1 - nq] = special,
            }
            states.push(state);
        }
    }
    states
}

/// What the driver is asked about a state.
fn questions(State { t, q, u }: &State64, joints: usize) -> String {
    let mut text = String::new();
    let pinned = vec![0.0; joints];
    let _ = writeln!(text, "s{}", words(&[&[*t], q, u]));
    let _ = writeln!(text, "a{}", words(&[&[*t], q, &pinned]));
    let _ = writeln!(text, "p{}", words(&[&[*t], q, u]));
    let _ = writeln!(text, "r{}", words(&[&[1.0, STEP, *t], q, u]));
    text
}

/// What the runtime answers.
fn answers(case: &Case, State { t, q, u }: &State64) -> Vec<Answer> {
    let system = &case.system;
    let workspace = &mut system.workspace();
    let mut answers = Vec::new();
    let mut push = |name: &str, status, numbers| answers.push((name.to_owned(), status, numbers));
    let mut rates = system.speeds();
    let done = acceleration(system, *t, q, u, workspace, &mut rates);
    push("acceleration", code(&done), rates);
    let mut moved = q.clone();
    let done =
        assemble(system, *t, &mut moved, &vec![false; system.dimensions().joints], workspace);
    push("assembled", code(&done), moved);
    let (mut moved, mut speeds) = (q.clone(), u.clone());
    let done = project(system, *t, &mut moved, &mut speeds, workspace);
    push("projected q", code(&done), moved);
    push("projected u", code(&done), speeds);
    let mut state = State { t: *t, q: q.clone(), u: u.clone() };
    let done = Rk4::new(system).step(system, &mut state, STEP);
    push("t after steps", code(&done), vec![state.t]);
    push("q after steps", code(&done), state.q);
    push("u after steps", code(&done), state.u);
    answers
}

/// Compares the answers of C about a state with those of the runtime.
fn compare(case: &Case, state: &State64, found: &[Answer]) {
    let name = &case.compiled.program.interface.name;
    for (what, due, expected) in answers(case, state) {
        let (_, status, numbers) = found.iter().find(|(found, ..)| *found == what).unwrap();
        let where_ = format!("{name}: {what} at {state:?}: {numbers:?}, runtime {expected:?}");
        assert_eq!(*status, due, "{where_}");
        if due == 0 {
            let finite = |numbers: &[f64]| numbers.iter().all(|number| number.is_finite());
            assert!(finite(numbers) && finite(&expected), "{where_}");
            // An assembly ends near the nearest configuration: `RESULT_NEAR`.
            let allowed = if what == "assembled" { 1e-4 } else { 1e-6 };
            let error = relative_error(numbers, &expected);
            assert!(error <= allowed, "{where_}: {error:e}");
        } else if what == "assembled" || what.ends_with("after steps") {
            let before = match &what[..1] {
                "t" => vec![state.t],
                "u" => state.u.clone(),
                _ => state.q.clone(),
            };
            let same = |numbers: &[f64]| {
                numbers
                    .iter()
                    .zip(&before)
                    .all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
            };
            assert!(same(numbers) && same(&expected), "{where_}");
        }
    }
}

#[test]
fn special_numbers_are_results_or_failures_alike() {
    if !compilers().contains(&"gcc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut counts = [0, 0];
    for case in [Case::varied(FORMULAS, 1, 1), free_sixbar()] {
        let name = case.compiled.program.interface.name.clone();
        let states = spoiled(&case.states[0]);
        let joints = case.system.dimensions().joints;
        let source = write_c(folder.path(), &case, Real::Double, &[]);
        let flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
        let module = [flags[0], flags[1], case.flag(), source.to_str().unwrap()];
        let program = build_driver(folder.path(), &name, Real::Double, &module);
        let constants = format!("c{}\n", words(&[&case.constants]));
        for state in &states {
            let found = ask(&program, &format!("{constants}{}", questions(state, joints)));
            compare(&case, state, &found);
            counts[usize::from(found[0].1 != 0)] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 20), "{counts:?}");
}

/// Bodies are where they are without the whole turns of an angle of 1e9 rad.
#[test]
fn turns_are_not_counted() {
    let case = free_sixbar();
    let mut state = case.states[1].clone();
    let expected = case.system.poses(&state.q).unwrap().into_flattened();
    let turns = (1e9 / TAU).round();
    state.q[0] += turns * TAU;
    let error = relative_error(&case.system.poses(&state.q).unwrap().into_flattened(), &expected);
    // Half the distance between two numbers there is 6e-8, and TAU has an error of 2.5e-16.
    assert!(error < 2e-7, "{error:e}");
}

/// A parameter out of its range may make a mass negative, or nothing at all: then there is no acceleration.
#[test]
fn masses_that_parameters_make_negative_are_failures() {
    let robot = Linkage::<f64>::default();
    let state = robot.assembled().unwrap();
    let with = |width| Linkage::with_params(linkage::Params { width, ..*robot.params() });
    for (width, expected) in [
        (-0.02, Error::MassMatrix { joint: 0 }.code()),
        (f64::NAN, Error::NotFinite { joint: 0 }.code()),
        (f64::INFINITY, Error::NotFinite { joint: 0 }.code()),
    ] {
        let robot = with(width);
        let mut moved = state;
        for found in
            [robot.acceleration(0.0, &state.q, &state.u).map(|_| ()), robot.step(&mut moved, STEP)]
        {
            assert_eq!(code(&found), expected, "{width}: {found:?}");
        }
        assert_eq!(moved, state);
    }
    assert!(with(0.021).acceleration(0.0, &state.q, &state.u).is_ok());
}
