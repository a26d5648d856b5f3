//! Generated modules of one model at a time, compiled by rustc and by a C compiler, and asked for du/dt and
//! energies at given states.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{fs, thread};

use lamc::backend::c::Real;
use lamc::backend::identifiers::{Names, type_name};
use lamc::backend::rust::Options;
use lamc::pipeline::{Compiled, c_header, c_source, rust_module};
use lamc_workbench::verify::Values;
use tempfile::TempDir;

use crate::workspace;

/// du/dt and the energies, or the error that came instead of them.
pub type Answer = Result<Vec<f64>, String>;

/// Folders in which module after module is compiled, so that the runtime is compiled once.
#[derive(Debug)]
pub struct Workshop {
    folder: TempDir,
}

const MANIFEST: &str = r#"[package]
name = "compiled"
version = "0.0.0"
edition = "2024"

[dependencies]
lamc-runtime = { path = RUNTIME }

[profile.dev]
opt-level = 1
debug = false
incremental = false

[lints.rust]
warnings = "deny"

[workspace]
"#;

/// Reads lines of parameters, inputs, t, q, u; writes du/dt and the energies.
const MAIN: &str = r#"//! Asks a module.
mod model;

fn main() {
    for line in std::io::stdin().lines() {
        let line = line.unwrap();
        let mut numbers = line.split(' ').map(|word| word.parse::<f64>().unwrap());
        let mut next = || numbers.next().unwrap();
        let mut model = model::TYPE::<f64>::default();
FIELDS
        let t = next();
        let q: [f64; model::NQ] = std::array::from_fn(|_| next());
        let u: [f64; model::NU] = std::array::from_fn(|_| next());
        let found = model.acceleration(t, &q, &u);
        let energy = model.energy(t, &q, &u);
        match found {
            Ok(rates) => {
                let all = rates.into_iter().chain([energy.kinetic, energy.potential]);
                let words: Vec<String> = all.map(|x| format!("{x:?}")).collect();
                println!("{}", words.join(" "));
            }
            Err(error) => println!("error: {error}"),
        }
    }
}
"#;

impl Workshop {
    /// An empty one in a temporary folder.
    ///
    /// # Errors
    /// Of the operating system, as text.
    pub fn new() -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
        let runtime =
            workspace().join("runtime").canonicalize().map_err(|error| error.to_string())?;
        fs::create_dir_all(folder.path().join("src")).map_err(|error| error.to_string())?;
        let manifest = MANIFEST.replace("RUNTIME", &format!("{runtime:?}"));
        write(&folder.path().join("Cargo.toml"), &manifest)?;
        Ok(Self { folder })
    }

    /// The answers of the Rust module.
    ///
    /// # Errors
    /// When it cannot be written, compiled without a warning, or asked.
    pub fn rust(&self, compiled: &Compiled, states: &[Values]) -> Result<Vec<Answer>, String> {
        let folder = self.folder.path();
        let text = rust_module(compiled, &Options::default()).map_err(|error| error.to_string())?;
        write(&folder.join("src/model.rs"), &text)?;
        let interface = &compiled.program.interface;
        let mut fields = String::new();
        let mut names = Names::default();
        for parameter in &interface.parameters {
            let _ =
                writeln!(fields, "        model.params.{} = next();", names.give(&parameter.name));
        }
        let mut names = Names::default();
        for input in &interface.inputs {
            let _ = writeln!(fields, "        model.inputs.{} = next();", names.give(input));
        }
        let model = if fields.is_empty() { "let model" } else { "let mut model" };
        let main = MAIN.replace("let mut model", model).replace("FIELDS\n", &fields);
        let main = main.replace("TYPE", &type_name(&interface.name));
        write(&folder.join("src/main.rs"), &main)?;
        let target = folder.join("target");
        let mut build = Command::new(env!("CARGO"));
        build.args(["build", "--quiet", "--offline"]).current_dir(folder);
        successful(build.env("CARGO_TARGET_DIR", &target))?;
        let questions: Vec<String> = states.iter().map(|values| line("", values)).collect();
        let answers = asked(&target.join("debug/compiled"), questions.concat())?;
        Ok(answers.lines().map(numbers).collect())
    }

    /// The answers of the C module.
    ///
    /// # Errors
    /// When it cannot be written, compiled without a warning, or asked.
    pub fn c(&self, compiled: &Compiled, states: &[Values]) -> Result<Vec<Answer>, String> {
        let (folder, name) = (self.folder.path(), &compiled.program.interface.name);
        let header = format!("{name}.h");
        let source =
            c_source(compiled, Real::Double, &header).map_err(|error| error.to_string())?;
        write(&folder.join("model.c"), &source)?;
        write(&folder.join(&header), &c_header(compiled, Real::Double))?;
        let program: PathBuf = folder.join("driver");
        let mut compiler = Command::new("cc");
        compiler
            .args([
                "-std=c99",
                "-O1",
                "-ffp-contract=off",
                "-Wall",
                "-Wextra",
                "-Wpedantic",
                "-Werror",
            ])
            .arg(format!("-DHEADER=\"{header}\""))
            .arg(format!("-DMODEL={name}"))
            .arg(format!("-DUPPER={}", name.to_ascii_uppercase()))
            .args(["-DREAL=double", "-I", "."])
            .args((!compiled.program.interface.free.is_empty()).then_some("-DFREE"))
            .arg(
                workspace()
                    .canonicalize()
                    .map_err(|error| error.to_string())?
                    .join("tests/c/driver.c"),
            )
            .args(["model.c", "-lm", "-o"])
            .arg(&program)
            .current_dir(folder);
        successful(&mut compiler)?;
        let question = |values: &Values| {
            let constants: Vec<f64> = [&values.parameters[..], &values.inputs].concat();
            let state: Vec<f64> = [&[values.t][..], &values.q, &values.u].concat();
            format!("c{}\ns{}\n", words(&constants), words(&state))
        };
        let questions: Vec<String> = states.iter().map(question).collect();
        let text = asked(&program, questions.concat())?;
        let lines =
            |name: &'static str| text.lines().filter_map(move |line| line.strip_prefix(name));
        let answer = |(rates, energy): (&str, &str)| -> Answer {
            match rates.split_once(' ') {
                Some(("0", rates)) => numbers(&format!("{rates} {}", &energy["0 ".len()..])),
                _ => Err(format!("status {rates}")),
            }
        };
        Ok(lines("acceleration ").zip(lines("energy ")).map(answer).collect())
    }
}

/// Parameters, inputs, t, q, u.
fn line(begin: &str, values: &Values) -> String {
    let all = [&values.parameters[..], &values.inputs, &[values.t], &values.q, &values.u].concat();
    format!("{begin}{}\n", words(&all).trim_start())
}

fn words(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!(" {number:?}")).collect()
}

fn numbers(text: &str) -> Answer {
    let number = |word: &str| word.parse().map_err(|_| text.to_owned());
    text.split_whitespace().map(number).collect()
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}

fn successful(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| error.to_string())?;
    match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

/// What a program prints when it is asked.
fn asked(program: &Path, questions: String) -> Result<String, String> {
    let child = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = child.map_err(|error| error.to_string())?;
    // The answers are longer than a pipe holds: ask from another thread.
    let mut stdin = child.stdin.take();
    let asker =
        thread::spawn(move || stdin.as_mut().map(|stdin| stdin.write_all(questions.as_bytes())));
    let output = child.wait_with_output().map_err(|error| error.to_string())?;
    if asker.join().is_err() || !output.status.success() {
        return Err(format!("{} failed", program.display()));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
