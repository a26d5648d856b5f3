//! Machine code in process against the interpreter and against reference values.

use std::time::Instant;

use lamc::program::{FunctionKind, Interpreter, Program};
use lamc_runtime::plumbing::{Balance, Drive};
use lamc_runtime::{
    Change, Dopri5, Integrator, Mechanism, State, acceleration_and_forces, assemble,
};
use lamc_tests::{
    EXAMPLES, ROBOTS, compile, compile_text, designs, largest_difference, published, workspace,
};
use lamc_workbench::execution::Jit;

/// Everything a system can be asked, at a state.
fn answers<Y>(system: &Y, t: f64, q: &[f64], u: &[f64]) -> Vec<f64>
where
    Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
{
    let d = system.dimensions();
    let n = d.speeds;
    let (mut rates, mut lambda) = (vec![0.0; n], vec![0.0; d.rows + d.drives]);
    let mut workspace = system.workspace();
    acceleration_and_forces(system, t, q, u, workspace.as_mut(), &mut rates, &mut lambda)
        .unwrap_or_else(|error| panic!("{error}"));
    let position = q.to_vec();
    let energy = system.energy(t, &position, &u.to_vec()).unwrap();
    let (mut residual, mut slopes) = (vec![0.0; 9 * d.loops], vec![0.0; 9 * d.loops * n]);
    system.write_closure(q, &mut residual, &mut slopes).unwrap();
    let poses = system.poses(&position).unwrap().as_ref().as_flattened().to_vec();
    let points = system.points(&position).unwrap().as_ref().as_flattened().to_vec();
    let at = Balance { t, q, u, acceleration: &rates, multipliers: &lambda[..d.rows] };
    let mut reactions = vec![0.0; 6 * d.joints];
    system.write_reactions(at, &mut reactions).unwrap();
    let mut contacts = vec![0.0; 6 * d.contacts];
    system.write_contacts(t, q, u, &mut contacts).unwrap();
    let (parameters, inputs) = (vec![0.3; d.parameters], vec![0.7; d.inputs]);
    let change = Change { t: 0.5, q: u, u: &q[..n], parameters: &parameters, inputs: &inputs };
    let (mut forces, mut closure) = (vec![0.0; n], vec![0.0; d.rows]);
    system.write_tangent(at, change, &mut forces, &mut closure).unwrap();
    let mut drives = Vec::new();
    system.drives(t, |drive| {
        let Drive { joint: _, position, speed, acceleration, jerk } = drive;
        drives.extend([position, speed, acceleration, jerk]);
    });
    let energies = vec![energy.kinetic, energy.potential];
    let last = [residual, slopes, poses, points, reactions, forces, closure, drives, energies];
    [rates, lambda, contacts].into_iter().chain(last).flatten().collect()
}

/// A configuration that closes as the initial one does, in motion.
fn moving(system: &Interpreter) -> State<Vec<f64>, f64> {
    let mut state = system.initial();
    let pinned: Vec<bool> = (0..state.q.len()).map(|joint| system.is_pinned(joint)).collect();
    let mut workspace = system.workspace();
    let _ = assemble(system, 0.0, &mut state.q, &pinned, &mut workspace);
    state.u.iter_mut().enumerate().for_each(|(j, u)| *u = 0.4 - 0.3 * j as f64);
    state
}

fn check(name: &str, program: &Program) {
    let (plain, machine) = (Interpreter::new(program), Jit::new(program));
    let begin = Instant::now();
    assert!(machine.engine().compile(&FunctionKind::ALL), "{name}: no machine code on this host");
    let seconds = begin.elapsed().as_secs_f64();
    let state = moving(&plain);
    let expected = answers(&plain, 0.1, &state.q, &state.u);
    let got = answers(&machine, 0.1, &state.q, &state.u);
    assert!(got.iter().zip(&expected).all(|(x, y)| x.to_bits() == y.to_bits()), "{name}");
    let operations: usize = program.functions.iter().map(|f| f.instructions.len()).sum();
    println!("{name}: {operations} instructions compiled in {:.1} ms", 1e3 * seconds);
}

#[test]
fn examples_and_designs_bit_for_bit() {
    for name in EXAMPLES.into_iter().chain(ROBOTS) {
        let path = workspace().join("examples").join(format!("{name}.yaml"));
        check(name, &compile(&path).program);
    }
    for design in designs() {
        check(design.name, &design.compiled.program);
    }
}

/// Inputs, drives, forces and every function of formulas.
#[test]
fn formulas_bit_for_bit() {
    let text = "
parameters: { k: 0.3 }
inputs: [motor]
bodies:
  base: { fixed: true }
  a: { mass: 1, com: [0.1, 0.2, 0], inertia: [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]] }
  b: { mass: 1, com: [0.3, 0.2, 0], inertia: [[0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]] }
joints:
  j0: { bodies: [base, a], axis: [[0, 0], [0, 1]], stiffness: k,
        torque: 'motor + tanh(q.j0)*min(u.j0, t) + max(abs(u.j1), exp(-t))^1.3 + tan(q.j0/3)
          + atan2(q.j0, u.j1) + asin(sin(q.j0)) - acos(cos(q.j1)) + atan(u.j0) + log(2 + t)
          + sign(u.j0)*step(q.j1)' }
  j1: { bodies: [a, b], axis: [[0.2, 0], [0.2, 1]], drive: '0.3*sin(2*pi*t)*sqrt(1 + t) + abs(t)' }
points: { tip: { body: b, at: [0.4, 0, 0] } }
forces: { pull: { point: tip, force: [0, t, 'cos(t)*k'] } }
contacts:
  ground: { plane: { point: [0, 0, 0.1], normal: [0, 1, 2] }, points: [tip], stiffness: k, friction: 0.3 }
";
    check("formulas", &compile_text(text).program);
}

#[test]
fn a_sixbar_is_compiled_within_50_ms_and_runs_ten_seconds_within_100_ms() {
    let path = workspace().join("examples/sixbar.yaml");
    let program = compile(&path).program;
    let best = |measure: &dyn Fn() -> f64| (0..20).map(|_| measure()).fold(f64::INFINITY, f64::min);
    let compiling = best(&|| {
        let machine = Jit::new(&program);
        // What a motion calls: derivatives are for implicit integrators, and for those who ask.
        use FunctionKind::{Jacobian, Reactions, Tangent};
        let mut kinds = FunctionKind::ALL.to_vec();
        kinds.retain(|kind| !matches!(kind, Jacobian | Reactions | Tangent));
        let begin = worked();
        assert!(machine.engine().compile(&kinds));
        worked() - begin
    });
    let start = moving(&Interpreter::new(&program));
    let running = best(&|| {
        let machine = Jit::new(&program);
        let mut state = State { u: vec![0.0; start.u.len()], ..start.clone() };
        let mut integrator = Dopri5::new(&machine);
        let begin = worked();
        let times = (0..=300).map(|frame| f64::from(frame) / 30.0);
        let outcome = integrator.sample(&machine, &mut state, 10.0, times, |_| ());
        outcome.unwrap_or_else(|error| panic!("{error}"));
        worked() - begin
    });
    println!("compiled in {:.1} ms, ten seconds in {:.1} ms", 1e3 * compiling, 1e3 * running);
    assert!(compiling < 0.05, "compiling takes {compiling} s");
    assert!(running < 0.1, "ten seconds take {running} s");
}

/// Seconds this thread has been at work: other processes do not count, where the system tells.
fn worked() -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    static BEGIN: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let wall = || BEGIN.get_or_init(Instant::now).elapsed().as_secs_f64();
    nanoseconds.map_or_else(wall, |nanoseconds| 1e-9 * nanoseconds)
}

/// The reference motions, integrated through machine code.
#[test]
fn reference_trajectories() {
    for design in published() {
        let (name, trajectory) = (design.name, design.reference.trajectory());
        let system = Jit::new(&design.compiled.program);
        let mut state = State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() };
        let mut integrator = Dopri5::new(&system);
        (integrator.relative, integrator.absolute) = (1e-10, 1e-10);
        for (&t, expected) in trajectory.t.iter().zip(&trajectory.q) {
            let outcome = integrator.run(&system, &mut state, t, |_| ());
            outcome.unwrap_or_else(|error| panic!("{name} at t = {t}: {error}"));
            let error = largest_difference(&state.q, expected);
            assert!(error <= 1e-6, "{name} at t = {t}: off by {error:e}");
        }
        assert!(format!("{system:?}").contains(&format!("{:?}", FunctionKind::Acceleration)));
    }
}
