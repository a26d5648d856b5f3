//! Controllers in discrete time: motions of an arm without gravity against closed forms, and the same controllers in
//! a generated module.
//!
//! Between two changes of its input the arm has the constant acceleration a = torque / I, so that with a hold of the
//! commands every motion is a sequence of parabolas that are written here once more.

use lamc_generated::servo::{self, Servo};
use lamc_runtime::{ControlLoop, Error, Mechanism, Rk4, State};
use lamc_tests::{compile, compile_text, workspace};
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::{Method, Settings, Simulation};

/// The moment of inertia of the arm about its hinge, kg m^2.
const INERTIA: f64 = 1e-6;

/// An arm that turns freely under the torque `motor`, with these controllers.
fn arm(controllers: &str) -> Jit {
    let text = format!(
        "gravity: [0, 0, 0]\ninputs: [motor, wish]\nparameters: {{ kp: 3e-4, kd: 2e-5, ki: 2e-3, target: 0.5 }}\n\
         bodies:\n  base: {{ fixed: true }}\n  \
         arm: {{ mass: 1 g, com: [0, 0, 0], inertia: [[1e-6,0,0],[0,1e-6,0],[0,0,1e-6]] }}\n\
         joints: {{ knee: {{ bodies: [base, arm], axis: [[0,0],[0,1]], torque: motor }} }}\n\
         points: {{ tip: {{ body: arm, at: [0.1, 0, 0] }} }}\n\
         controllers:\n{controllers}\n"
    );
    Jit::new(&compile_text(&text).program)
}

/// The motion at these times, s.
fn run(system: Jit, times: &[f64], method: Method) -> Vec<State<Vec<f64>, f64>> {
    let start = system.initial();
    let settings = Settings { method, ..Settings::default() };
    let mut simulation = Simulation::new(system, start, None, &settings).unwrap();
    let reach = |&t: &f64| {
        simulation.reach(t, || false).unwrap();
        simulation.state().clone()
    };
    times.iter().map(reach).collect()
}

/// The angle and the speed after constant accelerations (rad/s^2) for times (s), one after the other.
fn parabolas(start: [f64; 2], pieces: &[(f64, f64)]) -> [f64; 2] {
    pieces.iter().fold(start, |[q, u], &(a, t)| [q + u * t + a * t * t / 2.0, u + a * t])
}

fn check(found: &State<Vec<f64>, f64>, expected: [f64; 2], tolerance: f64) {
    let errors = [found.q[0] - expected[0], found.u[0] - expected[1]];
    for error in errors {
        assert!(error.abs() < tolerance, "t = {}: {errors:?}, {expected:?}", found.t);
    }
}

/// Proportional and derivative: each delay from none to a sample, explicit and implicit.
#[test]
fn commands_act_after_their_delay_and_are_held() {
    let sample = 5e-3;
    for delay in [0.0, 2e-3, sample] {
        for (method, tolerance) in [(Method::Dopri5, 1e-10), (Method::Rodas, 1e-10)] {
            let system = arm(&format!(
                "  pd: {{ sample: 5 ms, delay: {delay}, \
                 inputs: {{ motor: \"kp*(target - q.knee) - kd*u.knee\" }} }}"
            ));
            let times: Vec<f64> = (1..=100).map(|k| f64::from(k) * sample).collect();
            let found = run(system, &times, method);
            let (mut state, mut before) = ([0.0, 0.0], 0.0);
            for found in &found {
                let a = (3e-4 * (0.5 - state[0]) - 2e-5 * state[1]) / INERTIA;
                state = parabolas(state, &[(before, delay), (a, sample - delay)]);
                before = a;
                check(found, state, tolerance);
            }
        }
    }
}

/// Samples of a motion at times that are no instants of the controller, and no multiples of each other.
#[test]
fn samples_of_the_motion_do_not_matter() {
    let law = "  pd: { sample: 5 ms, delay: 1 ms, inputs: { motor: \"kp*(target - q.knee) - kd*u.knee\" } }";
    let coarse = run(arm(law), &[0.1, 0.25], Method::Dopri5);
    let fine: Vec<f64> = (1..=750).map(|k| f64::from(k) / 3000.0).collect();
    let fine = run(arm(law), &fine, Method::Dopri5);
    for (one, other) in [(&coarse[0], &fine[299]), (&coarse[1], &fine[749])] {
        check(one, [other.q[0], other.u[0]], 1e-11);
    }
}

/// Every formula sees the memory, the state and the point before the sample.
#[test]
fn controllers_remember() {
    let law = "  pid:\n    sample: 4 ms\n    memory:\n      \
               sum: { initial: 0.01, next: \"sum + (target - q.knee)*Ts\" }\n      \
               last: { next: q.knee }\n      \
               height: { next: z.tip }\n    \
               inputs: { motor: \"kp*(target - q.knee) + ki*sum - kd*(q.knee - last)/Ts + 1e-4*height\" }";
    let times: Vec<f64> = (1..=60).map(|k| f64::from(k) * 4e-3).collect();
    let found = run(arm(law), &times, Method::Dopri5);
    let (mut state, mut sum, mut last, mut height) = ([0.0, 0.0], 0.01, 0.0, 0.0);
    for found in &found {
        let q: f64 = state[0];
        let torque = 3e-4 * (0.5 - q) + 2e-3 * sum - 2e-5 * (q - last) / 4e-3 + 1e-4 * height;
        // The hinge turns about y: x goes to -z.
        (sum, last, height) = (sum + (0.5 - q) * 4e-3, q, -0.1 * q.sin());
        state = parabolas(state, &[(torque / INERTIA, 4e-3)]);
        check(found, state, 1e-10);
    }
}

/// Two controllers of different rates; the second reads an input of the caller.
#[test]
fn controllers_have_their_own_rates() {
    let text = "gravity: [0, 0, 0]\ninputs: [slow, fast, wish]\n\
         bodies:\n  base: { fixed: true }\n  \
         arm: { mass: 1 g, com: [0, 0, 0], inertia: [[1e-6,0,0],[0,1e-6,0],[0,0,1e-6]] }\n\
         joints: { knee: { bodies: [base, arm], axis: [[0,0],[0,1]], torque: slow + fast } }\n\
         controllers:\n  \
         slow: { sample: 3 ms, inputs: { slow: \"1e-4*(wish - q.knee)\" } }\n  \
         fast: { sample: 2 ms, memory: { n: { next: n + 1 } }, inputs: { fast: \"-2e-6*u.knee + 1e-6*n\" } }\n";
    let mut system = Jit::new(&compile_text(text).program);
    system.set_input("wish", 0.25).unwrap();
    let times: Vec<f64> = (1..=60).map(|k| f64::from(k) * 1e-3).collect();
    let found = run(system, &times, Method::Dopri5);
    let (mut state, mut slow, mut fast, mut samples) = ([0.0_f64, 0.0], 0.0, 0.0, 0.0);
    for (millisecond, found) in found.iter().enumerate() {
        if millisecond % 3 == 0 {
            slow = 1e-4 * (0.25 - state[0]);
        }
        if millisecond % 2 == 0 {
            fast = -2e-6 * state[1] + 1e-6 * samples;
            samples += 1.0;
        }
        state = parabolas(state, &[((slow + fast) / INERTIA, 1e-3)]);
        check(found, state, 1e-11);
    }
}

/// The upper level for the duty, then the lower one; a command beyond the levels saturates.
#[test]
fn pulses_have_the_mean_of_the_command() {
    let law = "  bridge: { sample: 4 ms, inputs: { motor: \"1e-5 + 2e-4*(t - 0.006)\" }, \
               pwm: { period: 1 ms, levels: [-1e-5, 3e-5], duty: [0.1, 0.95] } }";
    let times: Vec<f64> = (1..=60).map(|k| f64::from(k) * 1e-3).collect();
    let found = run(arm(law), &times, Method::Dopri5);
    let mut state = [0.0, 0.0];
    for (period, found) in found.iter().enumerate() {
        let command = 1e-5 + 2e-4 * ((period / 4 * 4) as f64 * 1e-3 - 0.006);
        let duty = ((command + 1e-5) / 4e-5).clamp(0.1, 0.95);
        let (upper, lower) = (3e-5 / INERTIA, -1e-5 / INERTIA);
        state = parabolas(state, &[(upper, duty * 1e-3), (lower, (1.0 - duty) * 1e-3)]);
        check(found, state, 1e-11);
    }
}

/// A gain at which the continuous loop is damped: with a delay of one sample, it is not.
#[test]
fn a_delay_destabilises() {
    let law = |delay: &str| {
        format!(
            "  pd: {{ sample: 5 ms, delay: {delay}, inputs: {{ motor: \"9e-3*(target - q.knee) - 2.4e-4*u.knee\" }} }}"
        )
    };
    let end = |delay| run(arm(&law(delay)), &[1.0], Method::Dopri5)[0].q[0];
    assert!((end("0") - 0.5).abs() < 1e-3, "{}", end("0"));
    assert!((end("1 sample") - 0.5).abs() > 10.0, "{}", end("1 sample"));
}

/// The torque has no value where the square root has none.
#[test]
fn a_command_without_a_value_ends_the_motion() {
    let system = arm("  odd: { sample: 5 ms, inputs: { motor: \"sqrt(0.012 - t)\" } }");
    let start = system.initial();
    let mut simulation = Simulation::new(system, start, None, &Settings::default()).unwrap();
    let error = simulation.reach(0.1, || false).unwrap_err().to_string();
    assert_eq!(error, "the controller `odd` has a value that is not finite, at t = 0.015 s");
}

/// The generated module with the loop of the runtime, in fixed steps, against the simulation of the model.
#[test]
fn the_module_controls_as_the_simulation_does() {
    let system = Jit::new(&compile(&workspace().join("examples/servo.yaml")).program);
    let expected = run(system, &[0.3], Method::Dopri5);
    let mut robot = Servo::<f64>::default();
    let found = held(&mut robot, 0.3, 1e-4).unwrap();
    check(
        &State { t: found.t, q: found.q.to_vec(), u: found.u.to_vec() },
        [expected[0].q[0], expected[0].u[0]],
        1e-6,
    );
    // It holds near its target, and not by having stayed where it began.
    assert!((found.q[servo::joint::SHOULDER] - 0.7).abs() < 0.1, "{found:?}");
}

/// Advances the arm to a time, s, by steps of at most `dt`.
fn held(robot: &mut Servo<f64>, end: f64, dt: f64) -> Result<State<[f64; 1], f64>, Error> {
    let mut state = robot.assembled()?;
    let mut rk4 = Rk4::new(robot);
    let mut control = ControlLoop::new(robot, state.t);
    control.act(robot, &state)?;
    while state.t < end {
        let to = control.until(robot, end.min(state.t + dt));
        let step = to - state.t;
        rk4.step(robot, &mut state, step)?;
        state.t = to;
        control.act(robot, &state)?;
    }
    Ok(state)
}

/// What firmware does: it calls `control` at each sample, with the memory that it keeps.
#[test]
fn control_alone_is_what_the_loop_calls() {
    let robot = Servo::<f64>::default();
    let mut memory = lamc_runtime::Controlled::memory(&robot);
    let (q, u) = ([0.2], [1.0]);
    let first = robot.control(0.0, &q, &u, &memory);
    let target = 40.0_f64.to_radians();
    let error = target - 0.2;
    assert!((first.commands[0] - (12.0 * error - 0.25 * 0.2 / 5e-3)).abs() < 1e-12, "{first:?}");
    memory = first.next;
    assert_eq!(servo::MEMORY, ["pid.last", "pid.sum"]);
    assert!((memory[0] - 0.2).abs() < 1e-15 && (memory[1] - error * 5e-3).abs() < 1e-15);
    let second = robot.control(5e-3, &q, &u, &memory);
    assert!((second.commands[0] - (12.0 * error + 40.0 * memory[1])).abs() < 1e-12, "{second:?}");
}

/// In single precision, with a start between two samples: after 20 s no instant is lost, doubled or out of place.
#[test]
fn instants_are_counted() {
    let mut robot = Servo::<f32>::default();
    let q = [robot.params.target];
    let mut state = State { t: 1.003_f32, q, u: [0.0] };
    let mut control = ControlLoop::new(&robot, state.t);
    assert!(!control.act(&mut robot, &state).unwrap(), "the first sample is at 1.005 s");
    for t in [f32::NAN, f32::INFINITY, 1e20] {
        let odd = State { t, ..state };
        assert_eq!(ControlLoop::new(&robot, t).act(&mut robot, &odd), Err(Error::Time), "{t}");
    }
    let mut instants = Vec::new();
    while state.t < 20.0 {
        state.t = control.until(&robot, 20.0);
        assert!(control.act(&mut robot, &state).unwrap(), "{}", state.t);
        instants.push(f64::from(state.t));
    }
    // At rest at its target it commands 0 V: pulses of half their period. The first difference of two angles is not one.
    let halves: Vec<f64> = instants.into_iter().filter(|t| *t > 1.0295).collect();
    let expected = (2060..=40_000).map(|half| f64::from(half) * 5e-4);
    assert_eq!(halves.len(), expected.clone().count());
    for (found, expected) in halves.iter().zip(expected) {
        // Three roundings of numbers up to 20 s, each half their distance, and those of T and P.
        assert!((found - expected).abs() < 4e-6, "{found} {expected}");
    }
}
