//! Generated modules in a package of their own. A program in this package evaluates them and prints results.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::{fs, thread};

use lamc::backend::identifiers::type_name;
use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline::{Compiled, rust_module};
use tempfile::TempDir;

use crate::workspace;

/// Reads lines `module kind numbers..` and answers each with a line of numbers.
const MAIN: &str = r#"//! Evaluates generated modules.
#![deny(missing_docs)]

#[allow(dead_code, reason = "the tests' own, of which this program uses a part")]
mod compare;

use std::io::BufRead;

use lamc_runtime::{Dopri5, Error, Integrator, Mechanism, Rk4, Rodas, Scalar, State};

MODULES

fn answer<S: Scalar, M, const N: usize>(model: M, kind: &str, x: &[f64]) -> Vec<f64>
where
    M: Mechanism<Scalar = S, Coordinates = [S; N], Speeds = [S; N]>,
{
    let array = |x: &[f64]| -> [S; N] { std::array::from_fn(|i| S::from_f64(x[i])) };
    match kind {
        "acceleration" => {
            let (q, u) = (array(x), array(&x[N..]));
            let rates = model.acceleration(S::ZERO, &q, &u).unwrap();
            let energy = model.energy(S::ZERO, &q, &u).unwrap();
            let energies = [energy.kinetic, energy.potential];
            rates.into_iter().chain(energies).map(Scalar::to_f64).collect()
        }
        "parameters" => {
            let (q, u) = (array(x), array(&x[N..]));
            let mut rates = [S::ZERO; N];
            let mut slopes = vec![S::ZERO; N * model.dimensions().parameters];
            let margin = model.write_jacobian_params(S::ZERO, &q, &u, &mut rates, &mut slopes);
            assert!(margin.unwrap().is_some_and(|margin| margin.conditioning > S::ZERO));
            rates.into_iter().chain(slopes).map(Scalar::to_f64).collect()
        }
        "rank" => {
            let (q, u) = (array(x), array(&x[N..]));
            let (mut workspace, mut rates) = (model.workspace(), [S::ZERO; N]);
            let workspace = workspace.as_mut();
            let found = lamc_runtime::acceleration(&model, S::ZERO, &q, &u, workspace, &mut rates);
            vec![found.unwrap().rank as f64]
        }
        "trajectory" => {
            let mut state = State { t: S::ZERO, q: array(x), u: array(&x[N..]) };
            let mut integrator = Dopri5::new(&model);
            integrator.relative = S::from_f64(1e-10);
            integrator.absolute = S::from_f64(1e-10);
            let mut motion = Vec::new();
            for &t in &x[2 * N..] {
                integrator.run(&model, &mut state, S::from_f64(t), |_| ()).unwrap();
                motion.extend(state.q.iter().map(|q| q.to_f64()));
                let residuals = 9 * model.dimensions().loops;
                let (mut residual, mut rows) = (vec![S::ZERO; residuals], vec![S::ZERO; residuals * N]);
                model.write_closure(&state.q, &mut residual, &mut rows).unwrap();
                let open = compare::largest(residual.iter().map(|r| r.to_f64()));
                motion.push(open / model.size().to_f64());
            }
            motion
        }
        "steps" => {
            let mut state = State { t: S::ZERO, q: array(x), u: array(&x[N..]) };
            let (count, dt) = (x[2 * N] as usize, S::from_f64(x[2 * N + 1]));
            let mut rk4 = Rk4::new(&model);
            for _ in 0..count {
                rk4.step(&model, &mut state, dt).unwrap();
            }
            state.q.into_iter().chain(state.u).map(Scalar::to_f64).collect()
        }
        "implicit" => {
            let mut state = State { t: S::ZERO, q: array(x), u: array(&x[N..]) };
            let mut rodas = Rodas::new(&model);
            (rodas.relative, rodas.absolute) = (S::from_f64(1e-9), S::from_f64(1e-9));
            match rodas.run(&model, &mut state, S::from_f64(x[2 * N]), |_| ()) {
                Ok(_) => state.q.into_iter().chain(state.u).map(Scalar::to_f64).collect(),
                Err(Error::LeftOut { .. }) => Vec::new(),
                Err(error) => panic!("{error}"),
            }
        }
        _ => unreachable!(),
    }
}

fn main() {
    for line in std::io::stdin().lock().lines() {
        let line = line.unwrap();
        let mut words = line.split(' ');
        let (module, kind) = (words.next().unwrap(), words.next().unwrap());
        let x: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        let numbers = match module {
ARMS
            _ => unreachable!(),
        };
        let words: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
        println!("{}", words.join(" "));
    }
}
"#;

const MANIFEST: &str = r#"[package]
name = "compiled"
version = "0.0.0"
edition = "2024"

[dependencies]
lamc-runtime = { path = RUNTIME }

[profile.release]
opt-level = 1

[workspace]
"#;

/// A package that is being put together, and the questions for its program.
#[derive(Debug)]
pub struct Package {
    folder: TempDir,
    modules: String,
    arms: String,
    questions: String,
}

impl Default for Package {
    fn default() -> Self {
        Self::new()
    }
}

impl Package {
    /// Creates an empty package in a temporary folder.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        fs::create_dir_all(folder.path().join("src")).unwrap_or_else(|error| panic!("{error}"));
        Self { folder, modules: String::new(), arms: String::new(), questions: String::new() }
    }

    /// Writes a model's module under a name of its own. Generic ones are asked in `f64`.
    pub fn add(&mut self, module: &str, compiled: &Compiled, scalar: ScalarChoice) {
        self.add_with(module, compiled, &Options { scalar, ..Options::default() });
    }

    /// As [`add`](Self::add), with all options of the backend.
    pub fn add_with(&mut self, module: &str, compiled: &Compiled, options: &Options) {
        let ty = if options.scalar == ScalarChoice::Generic { "::<f64>" } else { "" };
        let text =
            rust_module(compiled, options).unwrap_or_else(|error| panic!("{module}: {error}"));
        write(&self.folder.path().join(format!("src/{module}.rs")), &text);
        let model = type_name(&compiled.program.interface.name);
        let _ = writeln!(self.modules, "mod {module};");
        let _ = writeln!(
            self.arms,
            "            \"{module}\" => answer({module}::{model}{ty}::default(), kind, &x),"
        );
    }

    /// Asks a module for du/dt and the energies at q, u (`acceleration`); for du/dt and its derivative by the parameters, of a module
    /// that has the function (`parameters`); for the rank there (`rank`); for q
    /// and the largest residual, as a share of the size, at times: q, u, t.. (`trajectory`); for q, u after
    /// steps of Runge and Kutta: q, u, count, dt (`steps`); for q, u at a time by Rosenbrock's method: q, u, t
    /// (`implicit`), which is an empty answer where the module has no derivatives.
    pub fn ask(&mut self, module: &str, kind: &str, numbers: &[&[f64]]) {
        let _ = write!(self.questions, "{module} {kind}");
        for number in numbers.concat() {
            let _ = write!(self.questions, " {number:?}");
        }
        self.questions.push('\n');
    }

    /// Compiles the package, which must cause no warning, and returns the answers to the questions in their order.
    pub fn answers(self) -> impl Iterator<Item = Vec<f64>> {
        let folder = self.folder.path();
        let runtime = workspace().join("runtime");
        let runtime = runtime.canonicalize().unwrap_or(runtime);
        write(&folder.join("Cargo.toml"), &MANIFEST.replace("RUNTIME", &format!("{runtime:?}")));
        let main = MAIN.replace("MODULES\n", &self.modules).replace("ARMS\n", &self.arms);
        write(&folder.join("src/main.rs"), &main);
        write(&folder.join("src/compare.rs"), include_str!("compare.rs"));
        let text = run(folder, self.questions);
        let number = |word: &str| word.parse().unwrap_or(f64::NAN);
        let lines: Vec<_> =
            text.lines().map(|line| line.split_whitespace().map(number).collect()).collect();
        lines.into_iter()
    }
}

fn write(path: &Path, text: &str) {
    fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

fn run(folder: &Path, questions: String) -> String {
    let target = folder.join("target");
    let build = Command::new(env!("CARGO"))
        .args(["build", "--release", "--offline"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", &target)
        .output()
        .unwrap_or_else(|error| panic!("{error}"));
    assert!(build.status.success(), "{}", String::from_utf8_lossy(&build.stderr));
    let warnings = String::from_utf8_lossy(&build.stderr);
    assert!(!warnings.contains("warning:"), "{warnings}");
    let mut child = Command::new(target.join("release/compiled"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{error}"));
    // The answers are longer than the buffer of a pipe, so another thread writes the questions.
    let mut stdin = child.stdin.take();
    let asker =
        thread::spawn(move || stdin.as_mut().map(|stdin| stdin.write_all(questions.as_bytes())));
    let output = child.wait_with_output().unwrap_or_else(|error| panic!("{error}"));
    assert!(output.status.success() && asker.join().is_ok());
    String::from_utf8_lossy(&output.stdout).into_owned()
}
