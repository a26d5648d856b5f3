//! Generated C modules, and Rust modules that export the same functions, compiled and called by a
//! C program, against the runtime with the interpreted program.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use lamc::backend::c::{Real, STATUS};
use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline::{self, Compiled};
use lamc::program::{Form, FunctionKind, Interpreter};
use lamc_runtime::constants::RESULT_NEAR;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{
    Error, Mechanism, Rk4, State, acceleration, acceleration_and_forces, assemble, project,
};
use lamc_tests::random::{Lines, Random, Recipe, closed_state, driven, model};
use lamc_tests::sheets::miura;
use lamc_tests::{
    EXAMPLES, compile, compile_text, drawings, is_there, largest, relative_error, workspace,
};
use nalgebra::DMatrix;

use super::c_free::free_sixbar;

/// Every function of the formulas, and names that C or its preprocessors have other uses for.
pub(super) const FORMULAS: &str = r#"
name: r
bodies:
  base: { fixed: true }
  arm: { outline: [[0, 0], [0.05, 0], [0.05, 0.02], [0, 0.02]] }
  end: { outline: [[0.05, 0], [0.09, 0], [0.09, 0.02], [0.05, 0.02]] }
  free: { outline: [[0, 0], [-0.03, 0], [-0.03, 0.02], [0, 0.02]] }
materials: { card: { density: 700, thickness: 0.0004 } }
layup: [card]
parameters: { Double: 0.3, k: 0.02, linux: 0.5 }
inputs: [motor]
joints:
  hip: { bodies: [base, arm], axis: [[0, 0], [0, 0.02]], stiffness: k, damping: 1e-5, limits: [-2, 2],
         torque: "motor + 1e-4*tanh(u.hip) - 1e-3*min(q.hip, linux) + 1e-4*max(0, q.knee)" }
  knee: { bodies: [arm, end], axis: [[0.05, 0], [0.05, 0.02]], damping: 1e-5,
          torque: "1e-5*(exp(-t)*sqrt(abs(q.hip) + 1) + (2 + q.hip)^Double + tan(q.knee/3)
                   + atan2(q.hip, q.knee - t) + asin(0.5*sin(q.hip)) - acos(0.5*cos(q.knee))
                   + atan(u.hip) + log(2 + q.knee^2) + sign(u.knee)*step(q.hip))" }
  tail: { bodies: [base, free], axis: [[0, 0], [0, 0.02]], drive: "k*sin(20*t) + linux*cos(t)*motor" }
initial: { q: { hip: 0.3, knee: -0.4 }, u: { knee: 1 } }
points: { tip: { body: end, at: [0.09, 0.01, 0] }, mid: { body: arm, at: [0.02, 0.01, 0] } }
forces: { pull: { point: tip, force: [0, "1e-4*sin(t)", "1e-3*t"] } }
contacts:
  ground:
    plane: { point: [0, 0, 0.05], normal: [0, 0.1, 1] }
    points: [tip, mid]
    stiffness: "k + linux/10"
    dissipation: "0.1 + motor"
    friction: Double
    slip_speed: 0.2
  lap:
    plane: { point: [0, 0, 0.01], normal: [0, 0, -1], body: arm }
    bodies: [end, free]
    stiffness: 0.05
    friction: 0
"#;

const RECIPES: [(u64, Recipe); 5] = [
    (27, Recipe { branches: 9, loops: 0, lines: Lines::Any }),
    (28, Recipe { branches: 2, loops: 1, lines: Lines::Parallel }),
    (29, Recipe { branches: 1, loops: 3, lines: Lines::Parallel }),
    (30, Recipe { branches: 0, loops: 2, lines: Lines::Concurrent }),
    (32, Recipe { branches: 1, loops: 2, lines: Lines::Any }),
];

/// Steps of most motions, and their length, s.
const STEPS: usize = 200;
const STEP: f64 = 1e-3;

pub(super) const STRICT: [&str; 7] =
    ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wdouble-promotion", "-Werror"];

pub(super) type State64 = State<Vec<f64>, f64>;
/// Name, status, numbers.
pub(super) type Answer = (String, i32, Vec<f64>);

/// A mechanism, with constants and states to ask about.
pub(super) struct Case {
    pub(super) compiled: Compiled,
    pub(super) system: Interpreter,
    /// Parameters and inputs.
    pub(super) constants: Vec<f64>,
    pub(super) states: Vec<State64>,
    /// Steps of a motion that are compared: none where neighbouring motions part.
    pub(super) steps: usize,
}

impl Case {
    pub(super) fn new(compiled: Compiled, states: Vec<State64>) -> Self {
        // Next to singular states C decides by decompositions.
        let system = Interpreter::new(&compiled.program.without_reduction());
        let interface = &compiled.program.interface;
        let mut constants: Vec<f64> = interface.parameters.iter().map(|p| p.value).collect();
        constants.extend(interface.inputs.iter().map(|_| 0.0));
        Self { compiled, system, constants, states, steps: STEPS }
    }

    /// With other constants than the model's, and closed states that fit them.
    pub(super) fn varied(text: &str, seed: u64, count: usize) -> Self {
        let mut case = Self::new(compile_text(text), Vec::new());
        let mut random = Random::new(seed);
        let interface = case.compiled.program.interface.clone();
        case.constants.clear();
        for parameter in &interface.parameters {
            let value = parameter.value * random.range(0.8, 1.2);
            case.system.set_parameter(&parameter.name, value).unwrap();
            case.constants.push(value);
        }
        for name in &interface.inputs {
            let value = random.range(-1e-3, 1e-3);
            case.system.set_input(name, value).unwrap();
            case.constants.push(value);
        }
        case.states = (0..count).map(|_| closed_state(&case.system, &mut random)).collect();
        case
    }

    fn name(&self) -> &str {
        &self.compiled.program.interface.name
    }

    /// Which joints an assembly pins.
    fn pinned(&self) -> Vec<bool> {
        let joints = self.system.dimensions().joints;
        (0..joints).map(|joint| joint == 0 && joints > 1).collect()
    }

    /// What tells the driver whether there are free bodies, or whether the drawing depends on parameters.
    pub(super) fn flag(&self) -> &'static str {
        let interface = &self.compiled.program.interface;
        match (interface.free.is_empty(), interface.drawn) {
            (true, 0) => "-UFREE",
            (true, _) => "-DDRAWN",
            (false, _) => "-DFREE",
        }
    }

    /// The questions, for the driver.
    fn questions(&self, pinned: &[bool]) -> String {
        let mut text = format!("i\nc{}\n", words(&[&self.constants]));
        let flags: Vec<f64> = pinned.iter().map(|&pinned| f64::from(u8::from(pinned))).collect();
        for State { t, q, u } in &self.states {
            let _ = writeln!(text, "s{}", words(&[&[*t], q, u]));
            let _ = writeln!(text, "a{}", words(&[&[*t], &astray(q), &flags]));
            let _ = writeln!(text, "p{}", words(&[&[*t], &nudged(q), u]));
        }
        if self.steps > 0
            && let Some(State { t, q, u }) = self.states.first()
        {
            let _ = writeln!(text, "r{}", words(&[&[self.steps as f64, STEP, *t], q, u]));
        }
        text
    }

    /// The answers of the runtime.
    fn answers(&self, pinned: &[bool]) -> Vec<Answer> {
        let mut answers = Vec::new();
        let initial = Interpreter::new(&self.compiled.program);
        let workspace = &mut initial.workspace();
        let mut state: State64 = initial.initial();
        let given: Vec<bool> = (0..pinned.len()).map(|joint| initial.is_pinned(joint)).collect();
        let done = assemble(&initial, 0.0, &mut state.q, &given, workspace)
            .and_then(|_| project(&initial, 0.0, &mut state.q, &mut state.u, workspace));
        answers.push(("initial q".to_owned(), code(&done), state.q));
        answers.push(("initial u".to_owned(), code(&done), state.u));
        for State { t, q, u } in &self.states {
            self.evaluate(*t, q, u, &mut answers);
            let mut moved = astray(q);
            let done = assemble(&self.system, *t, &mut moved, pinned, workspace);
            answers.push(("assembled".to_owned(), code(&done), moved));
            let (mut moved, mut speeds) = (nudged(q), u.clone());
            let done = project(&self.system, *t, &mut moved, &mut speeds, workspace);
            answers.push(("projected q".to_owned(), code(&done), moved));
            answers.push(("projected u".to_owned(), code(&done), speeds));
        }
        if self.steps > 0
            && let Some(state) = self.states.first()
        {
            let (mut state, mut rk4) = (state.clone(), Rk4::new(&self.system));
            let done = (0..self.steps).try_for_each(|_| rk4.step(&self.system, &mut state, STEP));
            answers.push(("t after steps".to_owned(), code(&done), vec![state.t]));
            answers.push(("q after steps".to_owned(), code(&done), state.q));
            answers.push(("u after steps".to_owned(), code(&done), state.u));
        }
        answers
    }

    /// Whether a direction of the closure is weak at some step of the motion.
    fn comes_near_a_singular_state(&self) -> bool {
        let Some(state) = self.states.first().filter(|_| self.steps > 0) else { return false };
        let (mut state, mut rk4) = (state.clone(), Rk4::new(&self.system));
        (0..self.steps).any(|_| {
            let weak = is_weak(&self.system, &state);
            weak || rk4.step(&self.system, &mut state, STEP).is_err()
        })
    }

    fn evaluate(&self, t: f64, q: &[f64], u: &[f64], answers: &mut Vec<Answer>) {
        let (system, d) = (&self.system, self.system.dimensions());
        let n = d.speeds;
        let mut push = |name: &str, status: i32, numbers: Vec<f64>| {
            answers.push((name.to_owned(), status, numbers));
        };
        let workspace = &mut system.workspace();
        let mut rates = vec![0.0; n];
        let found = acceleration(system, t, q, u, workspace, &mut rates);
        let (mut alone, mut lambda) = (vec![0.0; n], vec![0.0; d.rows + d.drives]);
        let done = acceleration_and_forces(system, t, q, u, workspace, &mut alone, &mut lambda);
        // Next to a singular state only the first takes directions that have faded along the motion.
        if found.is_ok_and(|constraint| !constraint.is_weak) {
            let difference = error(self, &rates, &alone);
            assert!(difference <= 1e-12, "{}: two ways differ by {difference:e}", self.name());
        }
        push("acceleration", code(&found), rates);
        let (position, speed) = (q.to_vec(), u.to_vec());
        let energy = system.energy(t, &position, &speed).unwrap();
        push("energy", 0, vec![energy.kinetic, energy.potential]);
        push("poses", 0, system.poses(&position).unwrap().into_flattened());
        let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
        let (mut jacobian, mut gamma) = (vec![0.0; d.rows * n], vec![0.0; d.rows]);
        let out = EquationsMut {
            mass: &mut mass,
            forcing: &mut forcing,
            jacobian: &mut jacobian,
            gamma: &mut gamma,
        };
        system.write_equations(t, q, u, out).unwrap();
        if d.rows > 0 {
            push("jacobian", 0, jacobian);
            push("gamma", 0, gamma);
        }
        push("mass", 0, mass);
        push("forcing", 0, forcing);
        if d.loops > 0 {
            let (mut residual, mut slopes) = (vec![0.0; 9 * d.loops], vec![0.0; 9 * d.loops * n]);
            system.write_closure(q, &mut residual, &mut slopes).unwrap();
            push("residual", 0, residual);
            push("residual's jacobian", 0, slopes);
        }
        if d.points > 0 {
            push("points", 0, system.points(&position).unwrap().into_flattened());
        }
        if d.contacts > 0 {
            let mut contacts = vec![0.0; 6 * d.contacts];
            system.write_contacts(t, q, u, &mut contacts).unwrap();
            assert!(contacts.chunks(6).any(|row| row[3..] != [0.0; 3]), "nothing is touched");
            push("contacts", 0, contacts);
        }
        if !self.compiled.program.interface.free.is_empty() {
            let momentum = system.momentum(&position, &speed).unwrap();
            push("momentum", 0, [momentum.centre, momentum.linear, momentum.angular].concat());
        }
        if d.drives > 0 {
            let mut torque = vec![0.0; d.joints];
            let driven = self.compiled.program.interface.driven();
            for (joint, lambda) in driven.iter().zip(&lambda[d.rows..]) {
                torque[joint.index()] = *lambda;
            }
            push("motor torques", code(&done), torque);
        }
    }
}

/// Whether a direction of the closure is weak.
fn is_weak(system: &Interpreter, State { t, q, u }: &State64) -> bool {
    let (mut rates, mut workspace) = (system.speeds(), system.workspace());
    acceleration(system, *t, q, u, &mut workspace, &mut rates).is_ok_and(|found| found.is_weak)
}

/// A guess some way off.
fn astray(q: &[f64]) -> Vec<f64> {
    q.iter().enumerate().map(|(joint, q)| q + 0.2 * f64::cos(3.0 * joint as f64)).collect()
}

/// What an integrator may leave.
fn nudged(q: &[f64]) -> Vec<f64> {
    q.iter().enumerate().map(|(joint, q)| q + 1e-4 * f64::sin(1.0 + joint as f64)).collect()
}

pub(super) fn code<T>(done: &Result<T, Error>) -> i32 {
    done.as_ref().map_or_else(Error::code, |_| 0)
}

pub(super) fn words(numbers: &[&[f64]]) -> String {
    numbers.concat().iter().map(|number| format!(" {number:?}")).collect()
}

fn cases() -> Vec<Case> {
    let mut cases = vec![Case::varied(FORMULAS, 1, 4)];
    for (seed, recipe) in RECIPES {
        let text = driven(&model(seed, recipe));
        cases.push(Case::varied(&text, seed, 3));
    }
    for name in EXAMPLES {
        let compiled = compile(&workspace().join("examples").join(format!("{name}.yaml")));
        let mut case = Case::new(compiled, Vec::new());
        case.states = vec![closed_state(&case.system, &mut Random::new(3))];
        // The four-bar is too stiff for explicit steps of this length. The card springs through its flat state
        // several times, where branches meet, and single precision loses the motion.
        if ["fourbar", "fold/pop_up"].contains(&name) {
            case.steps = 0;
        }
        cases.push(case);
    }
    // The functions of a long module are tables, also where there are parameters.
    let text = miura(6, 6) + "parameters: { spare: 1 }\n";
    let mut case = Case::new(compile_text(&text), Vec::new());
    assert_eq!(case.compiled.program.form(FunctionKind::Energy), Form::Tables);
    let mut state = case.system.assembled().unwrap();
    state.u.fill(1.0);
    project(&case.system, 0.0, &mut state.q, &mut state.u, &mut case.system.workspace()).unwrap();
    // Some 1e-6 rad from the flat state: directions of the closure are taken along the motion.
    let singular = closed_state(&case.system, &mut Random::new(3));
    assert!(is_weak(&case.system, &singular));
    case.states = vec![state, singular];
    cases.push(case);
    // A loop with a redundant equation; the other drawings and the published mechanisms are like the examples.
    for design in drawings().filter(|design| design.name == "drawn_sarrus") {
        let mut case = Case::new(design.compiled, Vec::new());
        case.steps = 0;
        let states = design.reference.states.iter();
        let states = states.map(|state| State { t: 0.0, q: state.q.clone(), u: state.u.clone() });
        let rank = design.reference.rank;
        case.states = states.filter(|state| weakest(&case.system, &state.q, rank) > 0.05).collect();
        assert!(case.states.len() >= 3, "{} states far from singular ones", case.states.len());
        cases.push(case);
    }
    cases
}

/// The smallest singular value of the closure Jacobian that is not zero, beside the largest. Single
/// precision has few digits where it is small.
fn weakest(system: &Interpreter, q: &[f64], rank: usize) -> f64 {
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * q.len()]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    let mut values = DMatrix::from_row_slice(rows, q.len(), &jacobian).singular_values();
    values.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
    values[rank - 1] / values[0]
}

/// The compilers of C there are.
pub(super) fn compilers() -> Vec<&'static str> {
    let runs = |name: &&str| is_there(name, &["--version"], "the C backend");
    ["gcc", "clang", "arm-none-eabi-gcc"].into_iter().filter(runs).collect()
}

pub(super) fn successful(command: &mut Command, what: &str) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{what}: {error}"));
    let problems = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{what}: {problems}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Writes source and header, and compiles them strictly with every compiler there is.
pub(super) fn write_c(folder: &Path, case: &Case, real: Real, compilers: &[&str]) -> PathBuf {
    let name = case.name();
    let source = folder.join(format!("{name}.c"));
    let header = format!("{name}.h");
    let text = pipeline::c_source(&case.compiled, real, &header).unwrap();
    fs::write(&source, text).unwrap();
    fs::write(folder.join(&header), pipeline::c_header(&case.compiled, real)).unwrap();
    for compiler in compilers {
        let mut command = Command::new(compiler);
        command.args(STRICT).arg(&source);
        // What may be uninitialised gcc knows only when it optimises.
        match (*compiler, real) {
            ("gcc", Real::Double) => {
                command.args(["-O1", "-c", "-o"]).arg(folder.join("strict.o"));
            }
            _ => {
                command.arg("-fsyntax-only");
            }
        }
        successful(&mut command, &format!("{compiler} on {name} ({})", real.name()));
    }
    source
}

/// The driver for a module, with what it is linked with.
pub(super) fn build_driver(folder: &Path, name: &str, real: Real, module: &[&str]) -> PathBuf {
    let program = folder.join(format!("{name}_{}", real.name()));
    let mut command = Command::new("gcc");
    command
        .args(["-std=c99", "-g"])
        .arg(format!("-DHEADER=\"{name}.h\""))
        .arg(format!("-DMODEL={name}"))
        .arg(format!("-DUPPER={}", name.to_ascii_uppercase()))
        .arg(format!("-DREAL={}", real.name()))
        .arg("-I")
        .arg(folder)
        .arg(workspace().join("tests/c/driver.c"))
        .args(module)
        .args(["-lm", "-o"])
        .arg(&program);
    successful(&mut command, &format!("the driver of {name}"));
    program
}

pub(super) fn ask(program: &Path, questions: &str) -> Vec<Answer> {
    use std::io::Write as _;
    let mut child = Command::new(program)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // Beside each other: a pipe that is full of answers would make both wait.
    let output = thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(questions.as_bytes()).unwrap());
        child.wait_with_output().unwrap()
    });
    let problems = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && problems.is_empty(), "{}: {problems}", program.display());
    let line = |line: &str| {
        let at = line.find(|c: char| c.is_ascii_digit()).unwrap();
        let mut words = line[at..].split(' ');
        let status = words.next().unwrap().parse().unwrap();
        (line[..at].trim().to_owned(), status, words.map(|word| word.parse().unwrap()).collect())
    };
    String::from_utf8_lossy(&output.stdout).lines().map(line).collect()
}

/// Largest error allowed, as [`error`] measures it.
fn tolerance(real: Real, what: &str, weak: bool) -> f64 {
    match (real, what) {
        // Next to a singular state single precision has few digits, or none: docs/ACCURACY.md.
        (Real::Float, _) if weak && what.contains("after steps") => 5e-2,
        (Real::Double, _) if what.contains("after steps") => 1e-9,
        (Real::Double, "assembled" | "initial q" | "initial u") => 1e-9,
        (Real::Double, _) => 1e-12,
        (
            Real::Float,
            "assembled" | "initial q" | "initial u" | "projected q" | "projected u"
            | "motor torques",
        ) => 1e-2,
        (Real::Float, _) => 1e-3,
    }
}

fn compare(case: &Case, real: Real, found: &[Answer], expected: &[Answer]) {
    let name = case.name();
    let weak = case.comes_near_a_singular_state();
    assert_eq!(found.len(), expected.len(), "{name}");
    // The initial state is that of the default parameters.
    let default = Interpreter::new(&case.compiled.program);
    let initial: State64 = default.initial();
    let mut guesses = case.states.iter().map(|state| astray(&state.q));
    let mut closed: &[f64] = &[];
    for ((what, status, found), (wanted, due, expected)) in found.iter().zip(expected) {
        assert_eq!((what, status), (wanted, due), "{name} ({})", real.name());
        if matches!(what.as_str(), "assembled" | "initial q") && *status == 0 {
            let system = if what == "initial q" { &default } else { &case.system };
            let open = openness(system, found);
            let allowed = if real == Real::Double { 1e-11 } else { 1e-5 };
            assert!(open <= allowed, "{name} ({}): {what} open by {open:e}", real.name());
        }
        let guess = if what == "assembled" { guesses.next() } else { None };
        let difference = error(case, found, expected);
        let error = match what.as_str() {
            "assembled" if *status == 0 => {
                detour(found, expected, &guess.expect("a guess for each assembly"))
            }
            "initial q" if *status == 0 => {
                closed = found;
                detour(found, expected, &initial.q)
            }
            "initial u" if *status == 0 => slip(&default, closed, found),
            _ => difference,
        };
        // Along the closure an assembly stops within this distance of the nearest point, so rounding may move
        // where it ends.
        let near = real == Real::Float || difference <= RESULT_NEAR.constant;
        assert!(near, "{name}: {what} differs by {difference:e}");
        let allowed = tolerance(real, what, weak);
        assert!(error <= allowed, "{name} ({}): {what} off by {error:e}", real.name());
    }
}

/// The largest difference, relative to the largest number; by the mechanism's size where that is zero but
/// for rounding.
fn error(case: &Case, found: &[f64], expected: &[f64]) -> f64 {
    if largest(expected) < 1e-9 * case.system.size() {
        largest(found) / case.system.size()
    } else {
        relative_error(found, expected)
    }
}

/// How much further from the guess than the expected point an assembly is, as a share of the way: in single
/// precision it may find another point that is as near.
fn detour(found: &[f64], expected: &[f64], guess: &[f64]) -> f64 {
    let way =
        |q: &[f64]| q.iter().zip(guess).map(|(q, guess)| (q - guess).powi(2)).sum::<f64>().sqrt();
    let (found, expected) = (way(found), way(expected));
    if found <= expected { 0.0 } else { (found - expected) / expected.max(1e-3) }
}

/// How fast the loops open at these speeds, relative to the speeds and to the closure Jacobian.
fn slip(system: &Interpreter, q: &[f64], u: &[f64]) -> f64 {
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * u.len()]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    let opening = jacobian
        .chunks_exact(u.len())
        .map(|row| row.iter().zip(u).map(|(j, u)| j * u).sum::<f64>());
    let opening = largest(opening);
    if opening == 0.0 { 0.0 } else { opening / (largest(&jacobian) * largest(u)) }
}

/// The largest closure residual, by the mechanism's size.
fn openness(system: &Interpreter, q: &[f64]) -> f64 {
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) =
        (vec![0.0; rows], vec![0.0; rows * system.dimensions().speeds]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    largest(&residual) / system.size()
}

#[test]
fn c_modules_agree_with_the_runtime_and_no_compiler_complains() {
    let compilers = compilers();
    let folder = tempfile::tempdir().unwrap();
    for case in cases() {
        agrees(&case, folder.path(), &compilers);
    }
}

/// Compares C in both types of number with the runtime.
pub(super) fn agrees(case: &Case, folder: &Path, compilers: &[&str]) {
    let pinned = case.pinned();
    let (questions, expected) = (case.questions(&pinned), case.answers(&pinned));
    // The largest takes a compiler long enough once.
    let reals = [Real::Double, Real::Float];
    for &real in &reals[..if pinned.len() > 20 { 1 } else { 2 }] {
        let source = write_c(folder, case, real, compilers);
        if !compilers.contains(&"gcc") {
            continue;
        }
        let flags = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
        let module = [flags[0], flags[1], case.flag(), source.to_str().unwrap()];
        let program = build_driver(folder, case.name(), real, &module);
        compare(case, real, &ask(&program, &questions), &expected);
    }
}

#[test]
fn a_header_is_c_plus_plus_too() {
    if !is_there("g++", &["--version"], "headers in C++") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    for case in cases() {
        let name = case.name();
        let header = pipeline::c_header(&case.compiled, Real::Double);
        fs::write(folder.path().join(format!("{name}.h")), header).unwrap();
        let text = format!("#include \"{name}.h\"\n#include \"{name}.h\"\nint main() {{}}\n");
        let source = folder.path().join(format!("{name}.cpp"));
        fs::write(&source, text).unwrap();
        let mut command = Command::new("g++");
        command.args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"]).arg(source);
        successful(&mut command, name);
    }
}

#[test]
fn a_rust_module_exports_what_its_header_declares() {
    if !is_there("gcc", &["--version"], "exported functions") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("src");
    fs::create_dir_all(&source).unwrap();
    let runtime = workspace().join("runtime").canonicalize().unwrap();
    let manifest = format!(
        "[package]\nname = \"exported\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
         [lib]\ncrate-type = [\"staticlib\"]\n\n\
         [dependencies]\nlamc-runtime = {{ path = {runtime:?} }}\n\n\
         [lints.rust]\nwarnings = \"deny\"\nmissing_docs = \"deny\"\nunsafe_code = \"deny\"\n\
         [lints.clippy]\nall = \"deny\"\n\n[workspace]\n"
    );
    fs::write(folder.path().join("Cargo.toml"), manifest).unwrap();
    let sixbar = workspace().join("examples/sixbar.yaml");
    let pendulum = workspace().join("examples/pendulum.yaml");
    let linkage = fs::read_to_string(workspace().join("examples/linkage.yaml")).unwrap();
    let mut random = Random::new(5);
    let mut cases = [
        (Case::varied(&linkage, 3, 2), ScalarChoice::Generic),
        (free_sixbar(), ScalarChoice::F64),
        (Case::varied(FORMULAS, 1, 2), ScalarChoice::F64),
        (Case::varied(&driven(&model(28, RECIPES[1].1)), 28, 2), ScalarChoice::Generic),
        (Case::new(compile(&sixbar), Vec::new()), ScalarChoice::F32),
        (Case::new(compile(&pendulum), Vec::new()), ScalarChoice::Generic),
    ];
    let mut library = "//! Modules that C programs call.\n".to_owned();
    for (case, scalar) in &mut cases {
        if case.states.is_empty() {
            case.states = vec![closed_state(&case.system, &mut random)];
        }
        let options = Options { scalar: *scalar, extern_c: true, ..Options::default() };
        let text = pipeline::rust_module(&case.compiled, &options).unwrap();
        let name = case.name();
        fs::write(source.join(format!("m_{name}.rs")), text).unwrap();
        let header = pipeline::c_header(&case.compiled, options.c_real());
        fs::write(folder.path().join(format!("{name}.h")), header).unwrap();
        let _ = writeln!(library, "/// A mechanism.\npub mod m_{name};");
    }
    fs::write(source.join("lib.rs"), library).unwrap();
    let target = folder.path().join("target");
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["build", "--quiet", "--offline"])
        .current_dir(folder.path())
        .env("CARGO_TARGET_DIR", &target);
    successful(&mut cargo, "the exporting modules");
    let archive = target.join("debug/libexported.a");
    for (case, scalar) in &cases {
        let real = Options { scalar: *scalar, extern_c: true, ..Options::default() }.c_real();
        let pinned = case.pinned();
        let module = [case.flag(), archive.to_str().unwrap(), "-lpthread", "-ldl"];
        let program = build_driver(folder.path(), case.name(), real, &module);
        let found = ask(&program, &case.questions(&pinned));
        compare(case, real, &found, &case.answers(&pinned));
    }
}

#[test]
fn status_codes_are_those_of_the_runtime() {
    let errors = [
        Error::MassMatrix { joint: 0 },
        Error::NotFinite { joint: 0 },
        Error::NotClosed { loop_index: 0, residual: 1.0, joint: None },
        Error::NotDriven { joint: 0 },
        Error::Time,
    ];
    assert_eq!(STATUS[0].number, 0);
    for (status, error) in STATUS[1..].iter().zip(&errors) {
        assert_eq!(status.number, error.code(), "{error}");
    }
    assert_eq!(STATUS.len(), errors.len() + 1);
}
