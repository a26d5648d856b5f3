//! The stiff four-bar of the published designs.

use std::time::Instant;

use lamc::program::Interpreter;
use lamc_runtime::{Integrator, Rodas, State, System};
use lamc_tests::{Reference, compile, dopri5, shared};

#[test]
fn experiment() {
    let Some(shared) = shared() else { return };
    let reference = Reference::read(&shared, "newMechanism");
    let compiled = compile(&shared.join("designs/newMechanism.cad.joints"));
    let system = Interpreter::new(&compiled.program);
    let trajectory = &reference.trajectory;
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let mut state = State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() };
        let mut rodas = Rodas::new(&system);
        rodas.relative = tolerance;
        rodas.absolute = tolerance * 1e-2;
        let (mut steps, begin) = (0, Instant::now());
        let mut worst = 0.0_f64;
        for (&t, q) in trajectory.t.iter().zip(&trajectory.q) {
            if let Err(error) = rodas.run(&system, &mut state, t, |_| steps += 1) {
                println!("{error}");
                break;
            }
            worst = state.q.iter().zip(q).fold(worst, |w, (a, b)| w.max((a - b).abs()));
        }
        println!("rodas {tolerance:e}: {steps} steps, error {worst:e}, {:?}", begin.elapsed());
    }
    for tolerance in [1e-6, 1e-8] {
        let mut state = State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() };
        let mut integrator = dopri5(&system, tolerance);
        let (mut steps, begin) = (0, Instant::now());
        let mut worst = 0.0_f64;
        for (&t, q) in trajectory.t.iter().zip(&trajectory.q) {
            integrator.run(&system, &mut state, t, |_| steps += 1).unwrap();
            worst = state.q.iter().zip(q).fold(worst, |w, (a, b)| w.max((a - b).abs()));
        }
        println!("dopri5 {tolerance:e}: {steps} steps, error {worst:e}, {:?}", begin.elapsed());
    }
    let mut state = State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() };
    let mut rodas = Rodas::new(&system);
    let mut steps = 0;
    let mut next = 0.0;
    let result = rodas.run(
        &system,
        &mut state,
        std::env::var("T").map_or(0.1, |t| t.parse().unwrap()),
        |state| {
            steps += 1;
            if state.t >= next || steps % 100000 == 0 {
                let e = system.energy(state.t, &state.q, &state.u);
                println!(
                    "{steps} t {:e} q {:?} u {:?} E {:e} {:e}",
                    state.t, state.q, state.u, e.kinetic, e.potential
                );
                next = if state.t == 0.0 { 1e-3 } else { state.t * 1.3 };
            }
        },
    );
    println!("{steps} {result:?} {:?} {:?}", state.q, state.u);
}

#[test]
fn equilibria() {
    use lamc_runtime::equilibrium;
    let Some(shared) = shared() else { return };
    for name in lamc_tests::DESIGNS {
        let reference = Reference::read(&shared, name);
        let compiled = compile(&shared.join(format!("designs/{name}.cad.joints")));
        let system = Interpreter::new(&compiled.program);
        for state in &reference.states {
            let mut q = state.q.clone();
            let begin = Instant::now();
            let found = equilibrium(&system, 0.0, &mut q, &mut system.workspace());
            let v = system.energy(0.0, &q, &vec![0.0; q.len()]).potential;
            println!("{name} {found:?} V {v:e} {:?} {q:?}", begin.elapsed());
        }
        let mut q = vec![0.0; reference.states[0].q.len()];
        let found = equilibrium(&system, 0.0, &mut q, &mut system.workspace());
        println!("{name} from flat {found:?} {q:?}");
    }
}
