//! The command `cargo xtask TASK`: the daily commands of contributors, each a list of other commands.
//!
//! A task stops at the first command that fails. Further arguments go to the last command:
//! `cargo xtask test --test formulation`.

use std::env;
use std::path::Path;
use std::process::{Command, ExitCode};

/// The name of a task, its description, and its commands. The words of a command are separated by
/// spaces. Words before the program set environment variables.
type Task = (&'static str, &'static str, &'static [&'static str]);

const TASKS: [Task; 6] = [
    (
        "check",
        "format, lints and architecture: before every commit",
        &[
            "cargo fmt --all -- --check",
            "cargo clippy --locked --workspace --all-targets -- -D warnings",
            "cargo test --locked --package lamc-tests --test repository",
        ],
    ),
    ("test", "all tests, or those that are named", &["cargo test --locked --workspace"]),
    (
        "bless",
        "write generated/ and all pinned outputs anew, then show what changed",
        &[
            "LAMC_BLESS=1 cargo test --locked --package lamc-tests --test backends --test formulation --test commands",
            "git status --short",
        ],
    ),
    (
        "bench",
        "benchmarks of the generated modules",
        &[
            "RUSTFLAGS=-Ctarget-cpu=native cargo bench --locked --package lamc-generated --target-dir target/native",
        ],
    ),
    (
        "doc",
        "documentation of all crates in target/doc",
        &["RUSTDOCFLAGS=-Dwarnings cargo doc --locked --workspace --no-deps"],
    ),
    ("ci", "everything that must hold before a change lands", &[".ci/run"]),
];

fn main() -> ExitCode {
    let mut arguments = env::args().skip(1);
    let name = arguments.next().unwrap_or_default();
    let Some((_, _, commands)) = TASKS.iter().find(|(task, ..)| *task == name) else {
        eprintln!("cargo xtask TASK [ARGUMENTS]\n");
        for (task, description, _) in TASKS {
            eprintln!("  {task:<6} {description}");
        }
        return ExitCode::from(2);
    };
    let rest: Vec<String> = arguments.collect();
    for (i, command) in commands.iter().enumerate() {
        let further = if i + 1 == commands.len() { &rest[..] } else { &[] };
        if !run(command, further) {
            eprintln!("failed: {command} {}", further.join(" "));
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Runs a command in the folder of the workspace, and returns whether it succeeded.
fn run(command: &str, further: &[String]) -> bool {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut words = command.split(' ').peekable();
    let mut variables = Vec::new();
    while let Some(variable) = words.next_if(|word| word.contains('=')) {
        variables.extend(variable.split_once('='));
    }
    let Some(program) = words.next() else { return false };
    let program = if program.starts_with('.') { workspace.join(program) } else { program.into() };
    eprintln!("$ {command} {}", further.join(" "));
    let status = Command::new(program)
        .args(words)
        .args(further)
        .envs(variables)
        .current_dir(&workspace)
        .status();
    status.is_ok_and(|status| status.success())
}
