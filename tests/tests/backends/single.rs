//! How far the modules of the examples in `f32` are from those in `f64`: the errors that docs/ACCURACY.md states.

use std::collections::BTreeMap;
use std::fs;

use lamc_generated::crawler::Crawler;
use lamc_generated::fourbar::Fourbar;
use lamc_generated::jumper::Jumper;
use lamc_generated::linkage::Linkage;
use lamc_generated::pendulum::Pendulum;
use lamc_generated::servo::Servo;
use lamc_generated::sixbar::Sixbar;
use lamc_generated::swing::Swing;
use lamc_generated::triple_pendulum::TriplePendulum;
use lamc_runtime::{Mechanism, State, acceleration, assemble, project};
use lamc_tests::compare::keep_largest;
use lamc_tests::random::Random;
use lamc_tests::{largest, largest_difference, workspace};

/// States of each example.
const STATES: usize = 1000;

/// A closed state whose numbers are those of `f32`, far from singular ones.
fn state<M: Mechanism<Scalar = f64>>(
    robot: &M,
    random: &mut Random,
) -> Option<State<Vec<f64>, f64>> {
    let sizes = robot.dimensions();
    let mut workspace = robot.workspace();
    let workspace = workspace.as_mut();
    let t = random.range(0.0, 1.0);
    let mut q = robot.initial().q.as_ref().to_vec();
    q.iter_mut().for_each(|q| *q += random.range(-1.2, 1.2));
    let mut u: Vec<f64> = (0..sizes.speeds).map(|_| random.range(-3.0, 3.0)).collect();
    assemble(robot, t, &mut q, &vec![false; sizes.joints], workspace).ok()?;
    project(robot, t, &mut q, &mut u, workspace).ok()?;
    let round = |numbers: &[f64]| -> Vec<f64> {
        numbers.iter().map(|&number| f64::from(number as f32)).collect()
    };
    let state = State { t: f64::from(t as f32), q: round(&q), u: round(&u) };
    let mut rates = robot.speeds();
    let found = acceleration(robot, state.t, &state.q, &state.u, workspace, rates.as_mut());
    found.is_ok_and(|found| !found.is_weak).then_some(state)
}

/// The largest error of du/dt in `f32`, relative to the largest of all states, and the states that were compared.
fn error<D, S>(double: &D, single: &S) -> (f64, usize)
where
    D: Mechanism<Scalar = f64>,
    S: Mechanism<Scalar = f32>,
{
    let mut random = Random::new(1);
    let (mut off, mut most, mut count) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..STATES {
        let Some(State { t, q, u }) = state(double, &mut random) else { continue };
        let mut exact = double.speeds();
        acceleration(double, t, &q, &u, double.workspace().as_mut(), exact.as_mut()).unwrap();
        let [q, u] = [q, u].map(|numbers| numbers.iter().map(|&x| x as f32).collect::<Vec<_>>());
        let mut rates = single.speeds();
        acceleration(single, t as f32, &q, &u, single.workspace().as_mut(), rates.as_mut())
            .unwrap();
        let rates: Vec<f64> = rates.as_ref().iter().map(|&rate| f64::from(rate)).collect();
        off = keep_largest(off, largest_difference(&rates, exact.as_ref()));
        most = keep_largest(most, largest(exact.as_ref()));
        count += 1;
    }
    (off / most, count)
}

#[test]
fn errors_of_single_precision_are_as_stated() {
    macro_rules! errors {
        ($($name:literal $module:ident),+) => {
            BTreeMap::from([$(($name, error(&$module::<f64>::default(), &$module::<f32>::default()))),+])
        };
    }
    let errors = errors!(
        "pendulum" Pendulum, "triple_pendulum" TriplePendulum, "fourbar" Fourbar, "sixbar" Sixbar, "linkage" Linkage,
        "crawler" Crawler, "jumper" Jumper, "servo" Servo, "swing" Swing
    );
    let text = fs::read_to_string(workspace().join("docs/ACCURACY.md")).unwrap();
    let mut wrong = Vec::new();
    for (name, (error, count)) in errors {
        assert!(count >= STATES / 2, "{name}: {count} states");
        let prefix = format!("| {name} | ");
        let mut rows = text.lines().filter_map(|line| line.strip_prefix(&prefix));
        let stated: Option<f64> = rows.find_map(|row| row.split(' ').next()?.parse().ok());
        if !stated.is_some_and(|stated| error <= stated && stated <= 5.0 * error) {
            wrong.push(format!("{name}: {error:.1e}, stated {stated:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
