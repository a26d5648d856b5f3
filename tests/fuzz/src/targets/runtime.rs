//! The functions of the runtime, on modules that `lamc` wrote: any numbers as times, states, parameters and steps. A
//! result is finite, and where a function promises so, a failure changes nothing.

use std::slice::Iter;

use lamc_generated::crawler::Crawler;
use lamc_generated::fourbar::Fourbar;
use lamc_generated::jumper::Jumper;
use lamc_generated::linkage::{self, Linkage};
use lamc_generated::pendulum::Pendulum;
use lamc_generated::servo::Servo;
use lamc_generated::sixbar::Sixbar;
use lamc_generated::swing::Swing;
use lamc_runtime::{
    Arithmetic, Batch, Change, ControlLoop, Controlled, Dopri5, Error, Integrator, JacobianMut,
    LinearizationMut, Mechanism, Rigid, Rk4, Rodas, Scalar, SemiImplicitEuler, State, StateOf,
    Stopped, acceleration, acceleration_and_forces, acceleration_in_motion, assemble,
    derivatives_along, equilibrium, f64x4, free_body, jacobian, linearize, project,
};

/// What is called.
#[derive(Clone, Copy)]
pub enum Function {
    Acceleration,
    InMotion,
    Forces,
    Jacobian,
    Along,
    Assemble,
    Project,
    Equilibrium,
    Linearize,
    Rk4,
    Euler,
    Dopri5,
    Rodas,
    Stopped,
    Rigid,
}

/// Numbers that need care, besides those of any bits.
const SPECIAL: [f64; 16] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    5e-324,
    -1e-310,
    f64::MIN_POSITIVE,
    f64::MAX,
    f64::MIN,
    1e9,
    -1e9,
    1e38,
    3.4e-38,
    1e-45,
    std::f64::consts::PI,
];

/// Steps of an integrator for one input.
const STEPS: usize = 5;

/// An input as numbers: most bytes are an angle, some a small or special number or the start of any bits.
struct Numbers<'a>(Iter<'a, u8>);

impl Numbers<'_> {
    fn byte(&mut self) -> u8 {
        self.0.next().copied().unwrap_or_default()
    }

    fn one_in(&mut self, count: u8) -> bool {
        self.byte().is_multiple_of(count)
    }

    fn number(&mut self) -> f64 {
        match self.byte() {
            angle @ 0..=200 => (f64::from(angle) - 100.0) / 32.0,
            exponent @ 201..=230 => 10_f64.powi(200 - i32::from(exponent)),
            255 => f64::from_bits(u64::from_le_bytes([0; 8].map(|_: u8| self.byte()))),
            special => SPECIAL[usize::from(special) % SPECIAL.len()],
        }
    }

    fn scalar<S: Scalar>(&mut self) -> S {
        S::from_f64(self.number())
    }

    /// Replaces some of the entries, or moves them a little.
    fn change<S: Scalar>(&mut self, entries: &mut [S]) {
        for entry in entries {
            match self.byte() % 4 {
                0 => *entry = self.scalar(),
                1 => *entry += self.scalar::<S>() * S::from_f64(1e-3),
                _ => {}
            }
        }
    }
}

/// A mechanism, a number type and a state of bytes, and a function at that state.
pub fn call(function: Function, input: &[u8]) {
    let numbers = &mut Numbers(input.iter());
    let parameters = |numbers: &mut Numbers| {
        let mut values = [0.02, 0.05, 0.04, 0.02];
        numbers.change(&mut values);
        let [crank, coupler, rocker, width] = values;
        linkage::Params { crank, coupler, rocker, width }
    };
    match numbers.byte() % 10 {
        0 => at(function, &Pendulum::<f64>::default(), numbers),
        1 => at(function, &Fourbar::<f64>::default(), numbers),
        2 => at(function, &Sixbar::<f64>::default(), numbers),
        3 => at(function, &Sixbar::<f32>::default(), numbers),
        4 => at(function, &Linkage::with_params(parameters(numbers)), numbers),
        5 => at(function, &Jumper::<f64>::default(), numbers),
        6 => at(function, &Jumper::<f32>::default(), numbers),
        7 => {
            let mut robot = Crawler::<f64>::default();
            (robot.params.rate, robot.params.gain) = (numbers.number(), numbers.number());
            at(function, &robot, numbers);
        }
        8 => {
            let mut robot = Swing::<f64>::default();
            (robot.params.k, robot.params.b) = (numbers.number(), numbers.number());
            at(function, &robot, numbers);
        }
        _ => at(function, &Servo::<f64>::default(), numbers),
    }
}

/// A state, near a closed one or anywhere.
fn state_of<M: Mechanism>(robot: &M, numbers: &mut Numbers) -> StateOf<M> {
    let closed = if numbers.one_in(4) { None } else { robot.assembled().ok() };
    let mut state = closed.unwrap_or_else(|| robot.initial());
    if numbers.one_in(4) {
        state.t = numbers.scalar();
    }
    numbers.change(state.q.as_mut());
    numbers.change(state.u.as_mut());
    state
}

fn at<M: Mechanism>(function: Function, robot: &M, numbers: &mut Numbers) {
    let mut state = state_of(robot, numbers);
    match function {
        Function::Stopped => stopped(robot, state, numbers),
        Function::Rk4 => {
            let mut rk4 = Rk4::new(robot);
            steps::<M>(state, numbers, |state, dt| rk4.step(robot, state, dt));
        }
        Function::Euler => {
            let mut euler = SemiImplicitEuler::new(robot);
            steps::<M>(state, numbers, |state, dt| euler.step(robot, state, dt));
        }
        Function::Rigid => {
            let mut rigid = Rigid::new(robot);
            rigid.restitution = numbers.scalar();
            steps::<M>(state, numbers, |state, dt| rigid.step(robot, state, dt));
        }
        Function::Dopri5 => adaptive(robot, &mut Dopri5::new(robot), &mut state, numbers),
        Function::Rodas => adaptive(robot, &mut Rodas::new(robot), &mut state, numbers),
        Function::Assemble | Function::Project | Function::Equilibrium | Function::Linearize => {
            configurations(function, robot, state, numbers);
        }
        _ => rates(function, robot, &state, numbers),
    }
}

/// du/dt, what goes with it, and its derivatives.
fn rates<M: Mechanism>(function: Function, robot: &M, state: &StateOf<M>, numbers: &mut Numbers) {
    let sizes = robot.dimensions();
    let zeros = |count: usize| vec![M::Scalar::ZERO; count];
    let n = sizes.speeds;
    let (mut workspace, mut out) = (robot.workspace(), robot.speeds());
    let (workspace, out) = (workspace.as_mut(), out.as_mut());
    let (t, q, u) = (state.t, state.q.as_ref(), state.u.as_ref());
    match function {
        Function::Acceleration => {
            let done = acceleration(robot, t, q, u, workspace, out);
            finite(done, &[out]);
        }
        Function::InMotion => {
            let done = acceleration_in_motion(robot, t, q, u, workspace, out);
            finite(done, &[out]);
        }
        Function::Forces => {
            let mut lambda = zeros(sizes.rows + sizes.drives);
            let done = acceleration_and_forces(robot, t, q, u, workspace, out, &mut lambda);
            finite(done, &[out, &lambda]);
        }
        Function::Jacobian => {
            let [mut dq, mut du, mut dt] = [n * n, n * n, n].map(zeros);
            let into = JacobianMut { acceleration: out, dq: &mut dq, du: &mut du, dt: &mut dt };
            let done = jacobian(robot, t, q, u, workspace, into);
            finite(done, &[out, &dq, &du, &dt]);
        }
        _ => {
            let (mut step, mut parameters) = (zeros(n), zeros(sizes.parameters));
            numbers.change(&mut step);
            numbers.change(&mut parameters);
            let (t_change, inputs) = (numbers.scalar(), zeros(sizes.inputs));
            let change = Change {
                t: t_change,
                q: &step,
                u: &step,
                parameters: &parameters,
                inputs: &inputs,
            };
            let mut out = zeros(2 * n);
            let changes = [change].into_iter();
            let done = derivatives_along(robot, t, q, u, changes, workspace, &mut out);
            finite(done, &[&out]);
        }
    }
}

/// Configurations that are sought, and small motions about one.
fn configurations<M: Mechanism>(
    function: Function,
    robot: &M,
    mut state: StateOf<M>,
    numbers: &mut Numbers,
) {
    let sizes = robot.dimensions();
    let n = sizes.speeds;
    let mut workspace = robot.workspace();
    let workspace = workspace.as_mut();
    let State { t, q, u } = &mut state;
    let t = *t;
    let before = bits(q.as_ref());
    match function {
        Function::Assemble => {
            let pinned: Vec<bool> = (0..sizes.joints).map(|_| numbers.one_in(4)).collect();
            let done = assemble(robot, t, q.as_mut(), &pinned, workspace);
            finite_or_kept(done, before, q.as_ref());
        }
        Function::Equilibrium => {
            let done = equilibrium(robot, t, q, workspace);
            finite_or_kept(done, before, q.as_ref());
        }
        Function::Linearize => {
            let zeros = |count: usize| vec![M::Scalar::ZERO; count];
            let [mut basis, mut stiffness, mut damping] = [n * n; 3].map(zeros);
            let mut inputs = zeros(n * sizes.inputs);
            let into = LinearizationMut {
                basis: &mut basis,
                stiffness: &mut stiffness,
                damping: &mut damping,
                inputs: &mut inputs,
            };
            let done = linearize(robot, t, q.as_ref(), workspace, into);
            let freedoms = done.unwrap_or_default();
            let square = freedoms * freedoms;
            finite(done, &[&basis[..freedoms * n], &stiffness[..square], &damping[..square]]);
        }
        _ => {
            let done = project(robot, t, q.as_mut(), u.as_mut(), workspace);
            finite(done, &[q.as_ref(), u.as_ref()]);
        }
    }
}

/// Steps of any length by a method with fixed steps.
fn steps<M: Mechanism>(
    mut state: StateOf<M>,
    numbers: &mut Numbers,
    mut step: impl FnMut(&mut StateOf<M>, M::Scalar) -> Result<(), Error>,
) {
    for _ in 0..STEPS {
        let dt = if numbers.one_in(2) { M::Scalar::from_f64(1e-3) } else { numbers.scalar() };
        let before = bits_of::<M>(&state);
        let done = step(&mut state, dt);
        finite_or_same::<M>(done, before, &state);
    }
}

fn adaptive<M: Mechanism>(
    robot: &M,
    integrator: &mut impl Integrator<M>,
    state: &mut StateOf<M>,
    numbers: &mut Numbers,
) {
    for _ in 0..STEPS {
        let ahead = numbers.number().abs() / 100.0;
        let before = bits_of::<M>(state);
        let done = integrator.step(robot, state, state.t + M::Scalar::from_f64(ahead));
        finite_or_same::<M>(done, before, state);
    }
}

fn stopped<M: Mechanism>(robot: &M, mut state: StateOf<M>, numbers: &mut Numbers) {
    let mut stopped = Stopped::new(robot);
    stopped.restitution = numbers.scalar();
    let mut integrator = Dopri5::new(&stopped);
    for _ in 0..STEPS {
        let until = state.t + M::Scalar::from_f64(numbers.number().abs() / 100.0);
        let done = stopped.step_with(&mut integrator, &mut state, until);
        if done.is_ok() {
            finite(done, &[state.q.as_ref(), state.u.as_ref()]);
        }
    }
}

/// A robot with controllers, from one thing that they do to the next.
pub fn control(input: &[u8]) {
    let numbers = &mut Numbers(input.iter());
    let mut robot = Servo::<f64>::default();
    let params = &mut robot.params;
    for parameter in [&mut params.target, &mut params.kp, &mut params.ki, &mut params.kd] {
        numbers.change(std::slice::from_mut(parameter));
    }
    let mut state = state_of(&robot, numbers);
    let mut control = ControlLoop::new(&robot, state.t);
    for _ in 0..STEPS {
        let acted = control.act(&mut robot, &state);
        if acted.is_ok() {
            finite(acted, &[control.commands(), control.memory()]);
        }
        state.t = control.until(&robot, state.t + 0.01);
        numbers.change(&mut state.q);
        numbers.change(&mut state.u);
    }
    let _ = robot.controller(0);
}

/// Several motions at once, each with numbers of its own.
pub fn batch(input: &[u8]) {
    let numbers = &mut Numbers(input.iter());
    let mut robots = Swing::<f64x4>::default();
    let lanes = |numbers: &mut Numbers| f64x4::new([0; 4].map(|_: u8| numbers.number()));
    (robots.params.k, robots.params.b) = (lanes(numbers), lanes(numbers));
    let mut states = robots.zeros();
    (states.t, states.q[0], states.u[0]) = (lanes(numbers), lanes(numbers), lanes(numbers));
    let vectors =
        |vectors: &[f64x4]| vectors.iter().flat_map(|it| it.to_array()).collect::<Vec<_>>();
    if let Ok(rates) = robots.acceleration(states.t, &states.q, &states.u) {
        finite(Ok::<_, Error>(()), &[&vectors(&rates)]);
    }
    for _ in 0..STEPS {
        let before = bits(&vectors(&[states.q, states.u].concat()));
        let stepped = robots.step(&mut states, numbers.number());
        finite_or_kept(stepped, before, &vectors(&[states.q, states.u].concat()));
    }
}

/// Rotations of free bodies, with vectors of any length.
pub fn rotations(input: &[u8]) {
    let numbers = &mut Numbers(input.iter());
    let joints = usize::from(numbers.byte() % 4);
    let vector = |numbers: &mut Numbers| -> Vec<f64> {
        let count = numbers.byte() % 24;
        (0..count).map(|_| numbers.number()).collect()
    };
    let [mut q, to, step] = [0; 3].map(|_: u8| vector(numbers));
    let mut out = vector(numbers);
    free_body::advance(&mut q, &step, joints);
    free_body::write_rates(&q, &step, &mut out, joints);
    free_body::write_difference(&q, &to, &mut out, joints);
    free_body::normalise(&mut q, joints);
    let _ = free_body::extent(&step, joints, numbers.number());
}

/// Asserts that what was computed is finite.
fn finite<T, E, S: Scalar>(done: Result<T, E>, results: &[&[S]]) {
    if done.is_ok() {
        for result in results {
            assert!(result.iter().all(|number| number.is_finite()), "{result:?}");
        }
    }
}

/// Asserts that numbers are finite, or after a failure those that they were.
fn finite_or_kept<T, E, S: Scalar>(done: Result<T, E>, before: Vec<u64>, numbers: &[S]) {
    match done {
        Ok(_) => assert!(numbers.iter().all(|number| number.is_finite()), "{numbers:?}"),
        Err(_) => assert!(before == bits(numbers), "a failure changed {numbers:?}"),
    }
}

fn finite_or_same<M: Mechanism>(done: Result<(), Error>, before: Vec<u64>, state: &StateOf<M>) {
    let numbers = [state.q.as_ref(), state.u.as_ref()].concat();
    finite_or_kept(done, before, &numbers);
}

fn bits_of<M: Mechanism>(state: &StateOf<M>) -> Vec<u64> {
    bits(&[state.q.as_ref(), state.u.as_ref()].concat())
}

fn bits<S: Scalar>(numbers: &[S]) -> Vec<u64> {
    numbers.iter().map(|number| number.to_f64().to_bits()).collect()
}
