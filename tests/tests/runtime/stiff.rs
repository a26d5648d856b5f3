//! The stiff four-bar of the paper: k = 10 N m/rad and b = 0.1 N m s/rad on plates of
//! 0.6 g, at rest 1e-4 rad from the flat, singular state. Its modes there decay
//! at 107 and 1548 1/s.

use std::time::Instant;

use lamc::program::Interpreter;
use lamc_runtime::{Error, Integrator, Mechanism, Rodas, State, equilibrium};
use lamc_tests::compare::keep_largest;
use lamc_tests::designs::published_design;
use lamc_tests::{Reference, dopri5, largest, largest_difference};

fn four_bar() -> (Reference, Interpreter) {
    let design = published_design("paper_fourbar");
    (design.reference, Interpreter::new(&design.compiled.program))
}

fn start(reference: &Reference) -> State<Vec<f64>, f64> {
    let trajectory = reference.trajectory();
    State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() }
}

/// Largest error of q at the reference's samples.
fn error<I: Integrator<Interpreter>>(
    integrator: &mut I,
    system: &Interpreter,
    reference: &Reference,
) -> Result<f64, Error> {
    let trajectory = reference.trajectory();
    let (mut index, mut worst) = (0, 0.0_f64);
    let end = trajectory.t[trajectory.t.len() - 1];
    let times = trajectory.t.iter().copied();
    integrator.sample(system, &mut start(reference), end, times, |state| {
        worst = keep_largest(worst, largest_difference(&state.q, &trajectory.q[index]));
        index += 1;
    })?;
    assert_eq!(index, trajectory.t.len());
    Ok(worst)
}

#[test]
fn the_reference_trajectory() {
    let (reference, system) = four_bar();
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let mut rodas = Rodas::new(&system);
        (rodas.relative, rodas.absolute) = (tolerance, 1e-2 * tolerance);
        let worst = error(&mut rodas, &system, &reference).unwrap();
        println!("tolerance {tolerance:e}: {worst:e}");
        assert!(worst < f64::min(1e-6, tolerance), "{worst:e}");
    }
}

/// Ten seconds through the singular state: finite, the energy never grows, and it ends at rest
/// where the equilibrium is.
#[test]
fn through_the_singular_state_to_rest() {
    let (reference, system) = four_bar();
    let mut state = start(&reference);
    let mut rodas = Rodas::new(&system);
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        energy.kinetic + energy.potential
    };
    let begin = total(&state);
    let (mut last, mut steps, mut signs) = (begin, 0, [false; 2]);
    let (mut residual, mut jacobian) = ([0.0; 9], [0.0; 36]);
    rodas
        .run(&system, &mut state, 10.0, |state| {
            let now = total(state);
            assert!(now.is_finite() && state.q.iter().chain(&state.u).all(|x| x.is_finite()));
            assert!(now <= last + 1e-12 * begin, "energy grew by {:e} J", now - last);
            last = now;
            steps += 1;
            signs[usize::from(state.q[0] > 0.0)] = true;
            system.write_closure(&state.q, &mut residual, &mut jacobian).unwrap();
            let open = largest(residual);
            assert!(open <= 1e-9 * system.size(), "open by {open:e} m");
        })
        .unwrap();
    assert_eq!(signs, [true, true], "it never passed the flat state");
    let mut rest = state.q.clone();
    let found = equilibrium(&system, 0.0, &mut rest, &mut system.workspace()).unwrap();
    let away = largest_difference(&rest, &state.q);
    let speed = largest(&state.u);
    println!("{steps} steps; {away:e} rad from rest, {speed:e} rad/s");
    assert!(found.stable && away < 1e-9 && speed < 1e-9, "{away:e} rad, {speed:e} rad/s");
    assert!(steps < 2000, "{steps} steps");
}

/// How much work each method takes, Jacobians counted: along the reference, where accuracy limits
/// both and an implicit step costs four explicit ones; and then at rest, where stability limits the
/// explicit one to steps of 3 ms.
#[test]
fn what_it_costs_beside_an_explicit_method() {
    let (reference, system) = four_bar();
    let mut report = String::new();
    for (end, ratio) in [(reference.trajectory().t[40], 0.15..0.4), (8.0, 6.0..12.0)] {
        let mut state = start(&reference);
        let mut rodas = Rodas::new(&system);
        (rodas.relative, rodas.absolute) = (1e-5, 1e-7);
        let (mut implicit, begin) = (0, Instant::now());
        rodas.run(&system, &mut state, end, |_| implicit += 1).unwrap();
        let fast = begin.elapsed();
        let mut state = start(&reference);
        let mut integrator = dopri5(&system, 1e-6);
        let (mut explicit, begin) = (0, Instant::now());
        integrator.run(&system, &mut state, end, |_| explicit += 1).unwrap();
        let slow = begin.elapsed();
        // A step of RODASP: six evaluations and nine tangents of about twice their operations.
        let cost = |steps: usize, per_step: f64| steps as f64 * per_step;
        let found = cost(explicit, 6.0) / cost(implicit, 6.0 + 9.0 * 2.0);
        report.push_str(&format!(
            "{end:.4} s: {implicit} steps of RODASP in {fast:?}, {explicit} of Dormand-Prince in \
             {slow:?}: {found:.1} times the work\n"
        ));
        assert!(ratio.contains(&found), "not in {ratio:?}: {report}");
    }
    println!("{report}");
}
