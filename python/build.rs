//! Builds the command `lamc`, which the wheel carries: it derives models for the package, in a process of its own.

use std::env;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folders of the main workspace from which the command is built.
const SOURCES: [&str; 8] = [
    "Cargo.lock",
    "Cargo.toml",
    "codegen",
    "drawings",
    "runtime",
    "templates",
    "workbench/Cargo.toml",
    "workbench/src",
];

/// What cargo tells this build script about this crate, and what it would tell the other build.
const OF_THIS_BUILD: [&str; 6] = [
    "CARGO_ENCODED_RUSTFLAGS",
    "CARGO_MANIFEST_DIR",
    "CARGO_TARGET_DIR",
    "RUSTC",
    "RUSTDOC",
    "RUSTFLAGS",
];

/// Names a command that is built already, of the same sources: where this build has the target folder of the workspace,
/// which it holds locked.
const BUILT: &str = "LAMC_BUILT";

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new("..").canonicalize()?;
    for source in SOURCES {
        println!("cargo::rerun-if-changed={}", root.join(source).display());
    }
    println!("cargo::rerun-if-env-changed={BUILT}");
    let out = PathBuf::from(env::var("OUT_DIR")?).join(format!("lamc{}", env::consts::EXE_SUFFIX));
    let built = match env::var_os(BUILT) {
        Some(built) => PathBuf::from(built),
        None => build(&root)?,
    };
    fs::copy(&built, &out).map_err(|error| format!("{}: {error}", built.display()))?;
    // Names of functions are half of the file. Without `strip` the wheel is larger.
    let _ = Command::new("strip").arg(&out).status();
    Ok(())
}

/// Builds the command in the workspace at `root`; returns its path.
fn build(root: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let mut cargo = Command::new(env::var("CARGO")?);
    cargo.args(["build", "--locked", "-p", "lamc-workbench", "--bin", "lamc"]).current_dir(root);
    OF_THIS_BUILD.iter().for_each(|name| {
        cargo.env_remove(name);
    });
    if !cargo.status()?.success() {
        return Err("the command lamc could not be built".into());
    }
    // The profile of the tests, so that they and the wheel share what takes minutes to build.
    Ok(root.join("target/debug").join(format!("lamc{}", env::consts::EXE_SUFFIX)))
}
