//! Generated modules of the published designs, compiled by rustc in a package of their own, against
//! the reference values, in every number type.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::{fs, path::Path};

use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline::rust_module;
use lamc_tests::{DESIGNS, Reference, compile, relative_error, shared, workspace};

/// Reads lines `design number-type kind numbers..` and answers each with a line of numbers.
const MAIN: &str = r#"//! Evaluates generated modules.
#![deny(missing_docs)]
#![allow(dead_code)]

use std::io::BufRead;

use lamc_runtime::{Dopri5, Integrator, Mechanism, Scalar, State};

MODULES

fn answer<S: Scalar, M, const N: usize, const C: usize>(model: M, kind: &str, x: &[f64]) -> Vec<f64>
where
    M: Mechanism<S, N, C>,
{
    let array = |x: &[f64]| -> [S; N] { std::array::from_fn(|i| S::from_f64(x[i])) };
    match kind {
        "acceleration" => {
            let (q, u) = (array(x), array(&x[N..]));
            let rates = model.acceleration(S::ZERO, &q, &u).unwrap();
            let energy = model.energy(S::ZERO, &q, &u);
            let energies = [energy.kinetic, energy.potential];
            rates.into_iter().chain(energies).map(Scalar::to_f64).collect()
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
                let mut closure = model.closure(&state.q).residual;
                let open = closure.as_mut().iter().map(|r| r.to_f64().abs()).fold(0.0, f64::max);
                motion.push(open / model.size().to_f64());
            }
            motion
        }
        _ => unreachable!(),
    }
}

fn main() {
    for line in std::io::stdin().lock().lines() {
        let line = line.unwrap();
        let mut words = line.split(' ');
        let (design, scalar, kind) =
            (words.next().unwrap(), words.next().unwrap(), words.next().unwrap());
        let x: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        let numbers = match (design, scalar) {
ARMS
            _ => unreachable!(),
        };
        let words: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
        println!("{}", words.join(" "));
    }
}
"#;

#[test]
fn compiled_modules_agree_with_the_reference() {
    let Some(shared) = shared() else { return };
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    write_package(folder.path(), &shared);
    let references: Vec<_> = DESIGNS.iter().map(|name| Reference::read(&shared, name)).collect();
    let mut questions = String::new();
    let mut ask = |words: std::fmt::Arguments<'_>, numbers: &[&[f64]]| {
        let _ = questions.write_fmt(words);
        for number in numbers.concat() {
            let _ = write!(questions, " {number:?}");
        }
        questions.push('\n');
    };
    for (index, reference) in references.iter().enumerate() {
        for scalar in ["generic", "f64", "f32"] {
            for state in &reference.states {
                ask(format_args!("d{index} {scalar} acceleration"), &[&state.q, &state.u]);
            }
        }
        let motion = &reference.trajectory;
        ask(format_args!("d{index} generic trajectory"), &[&motion.q0, &motion.u0, &motion.t]);
    }
    let answers = run(folder.path(), &questions);
    let mut answers = answers.lines().map(|line| -> Vec<f64> {
        line.split(' ').map(|word| word.parse().unwrap_or(f64::NAN)).collect()
    });
    let mut next = || answers.next().unwrap_or_default();
    for (name, reference) in DESIGNS.iter().zip(&references) {
        for (scalar, tolerance) in [("generic", 1e-9), ("f64", 1e-9), ("f32", 2e-3)] {
            for (index, state) in reference.states.iter().enumerate() {
                let answer = next();
                let n = state.q.len();
                let error = relative_error(&answer[..n], &state.acceleration);
                assert!(error <= tolerance, "{name} {scalar} state {index}: {error:e}");
                let energies = [state.kinetic_energy, state.potential_energy];
                for (value, expected) in answer[n..].iter().zip(energies) {
                    let error = (value - expected).abs() / expected.abs();
                    assert!(error <= tolerance, "{name} {scalar} state {index}: energy {error:e}");
                }
            }
        }
        let answer = next();
        let n = reference.trajectory.q0.len();
        for (sample, expected) in answer.chunks(n + 1).zip(&reference.trajectory.q) {
            let error = sample.iter().zip(expected).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            assert!(error <= 1e-6, "{name}: off by {error:e}");
            assert!(sample[n] <= 1e-9, "{name}: open by {:e} of its size", sample[n]);
        }
    }
}

fn write_package(folder: &Path, shared: &Path) {
    let runtime = workspace().join("runtime");
    let runtime = runtime.canonicalize().unwrap_or(runtime);
    let manifest = format!(
        "[package]\nname = \"compiled\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[dependencies]\n\
         lamc-runtime = {{ path = {runtime:?} }}\n\n[profile.release]\nopt-level = 1\n\n[workspace]\n"
    );
    let source = folder.join("src");
    let mut arms = String::new();
    let mut modules = String::new();
    let write = |path: &Path, text: &str| {
        fs::write(path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    };
    fs::create_dir_all(&source).unwrap_or_else(|error| panic!("{error}"));
    for (index, name) in DESIGNS.iter().enumerate() {
        let compiled = compile(&shared.join("designs").join(format!("{name}.cad.joints")));
        let model = lamc::backend::identifiers::type_name(&compiled.program.interface.name);
        for (scalar, choice, ty) in [
            ("generic", ScalarChoice::Generic, "::<f64>"),
            ("f64", ScalarChoice::F64, ""),
            ("f32", ScalarChoice::F32, ""),
        ] {
            let module = format!("d{index}_{scalar}");
            let text =
                rust_module(&compiled, &Options { scalar: choice, extern_c: false }).unwrap();
            write(&source.join(format!("{module}.rs")), &text);
            let _ = writeln!(modules, "mod {module};");
            let _ = writeln!(
                arms,
                "            (\"d{index}\", \"{scalar}\") => \
                 answer({module}::{model}{ty}::default(), kind, &x),"
            );
        }
    }
    write(&folder.join("Cargo.toml"), &manifest);
    let main = MAIN.replace("MODULES\n", &modules).replace("ARMS\n", &arms);
    write(&source.join("main.rs"), &main);
}

fn run(folder: &Path, questions: &str) -> String {
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
    // The answers are longer than a pipe holds: ask from another thread.
    let mut stdin = child.stdin.take();
    let questions = questions.to_owned();
    let asker = std::thread::spawn(move || {
        stdin.as_mut().map(|stdin| stdin.write_all(questions.as_bytes()))
    });
    let output = child.wait_with_output().unwrap_or_else(|error| panic!("{error}"));
    assert!(output.status.success() && asker.join().is_ok());
    String::from_utf8_lossy(&output.stdout).into_owned()
}
