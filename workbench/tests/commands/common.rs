//! What the tests of the command line have in common.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

/// The command. What one test derives, others find in a cache below `target`; it is bound to this build of lamc.
pub fn lamc() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lamc"));
    command.env("XDG_CACHE_HOME", concat!(env!("CARGO_TARGET_TMPDIR"), "/cache"));
    command
}

/// What it answers to arguments.
pub fn run(arguments: &[&str]) -> Output {
    lamc().args(arguments).output().unwrap_or_else(|error| panic!("lamc: {error}"))
}

/// The path of an example.
pub fn example(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name).display().to_string()
}

/// A folder that is gone when its guard is dropped.
pub fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let path = folder.path().to_owned();
    (folder, path)
}

/// Bytes as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The names of what is in a folder.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{error}"));
    entries.flatten().map(|entry| entry.file_name().display().to_string()).collect()
}

/// Standard output as JSON.
pub fn json(output: &Output) -> serde_json::Value {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap_or_default()
}

/// A pendulum with an input.
pub const SWING: &str = "
parameters: { gain: 2e-3 }
inputs: [motor]
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: 1e-3, damping: 4e-6,
           torque: TORQUE }
points: { tip: { body: rod, at: [0, -0.04, 0] } }
";

/// The number before a word of a report.
pub fn number_before(report: &str, word: &str) -> f64 {
    let before = report.split(word).next().unwrap_or_default().trim_end();
    before.rsplit(' ').next().and_then(|number| number.parse().ok()).unwrap_or(f64::NAN)
}

/// What was said on standard error, but for how long the work takes.
pub fn told(output: &Output) -> String {
    let said = text(&output.stderr);
    let is_progress = |line: &&str| line.starts_with("waiting for") || line.ends_with(" ..");
    said.lines().filter(|line| !is_progress(line)).collect()
}
