//! What the end-to-end tests share: reference files, compiled models, comparisons, and mechanics
//! of its own to compare with.

pub mod chain;
pub mod expression;
pub mod linkages;
pub mod near_flat;
pub mod newton_euler;
pub mod nine_rows;
pub mod package;
pub mod random;
mod reference;
pub mod udwadia;

/// The Rust code of README.md and other pages, compiled and run as doc-tests.
#[cfg(doctest)]
mod documents {
    #[doc = include_str!("../../README.md")]
    struct Readme;
    #[doc = include_str!("../../docs/LANES.md")]
    struct Lanes;
}

use std::path::{Path, PathBuf};

use lamc::pipeline::{self, Compiled};
use lamc::source::SourceFile;
use lamc_runtime::{Dopri5, System};
use serde::Deserialize;

/// The folder of published designs and reference values beside the workspace, when it is there.
pub fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    if path.join("reference").is_dir() {
        return Some(path);
    }
    eprintln!("NOT CHECKED: ../shared (published designs, reference values) is absent");
    None
}

/// The workspace's folder.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The published designs.
pub const DESIGNS: [&str; 4] = ["W_3.5", "pendulum2", "newMechanism", "4th_Design"];

/// Our examples; those of the paper, which `generated` has modules of, first.
pub const EXAMPLES: [&str; 6] =
    ["pendulum", "triple_pendulum", "fourbar", "sixbar", "miura", "sixbar_markers"];

/// The examples that `generated` has modules of.
pub const MODULES: &[&str] = EXAMPLES.split_at(4).0;

/// Compiles a file, or panics with its diagnostics.
pub fn compile(path: &Path) -> Compiled {
    let file = match SourceFile::read(&path.display().to_string()) {
        Ok(file) => file,
        Err(error) => panic!("{error}"),
    };
    compile_file(&file)
}

/// Compiles a text, or panics with its diagnostics.
pub fn compile_text(text: &str) -> Compiled {
    compile_file(&SourceFile { path: "model.yaml".into(), text: text.into() })
}

fn compile_file(file: &SourceFile) -> Compiled {
    match pipeline::compile(file) {
        Ok(compiled) => compiled,
        Err(pipeline::CompileError::Model(problems)) => panic!("{}", problems.render(file, false)),
        Err(error) => panic!("{error}"),
    }
}

/// A reference file: values computed independently of lamc.
#[derive(Debug, Deserialize)]
pub struct Reference {
    /// Gravity, m/s^2.
    pub gravity: [f64; 3],
    /// Bodies in file order.
    pub bodies: Vec<ReferenceBody>,
    /// Joints in file order.
    pub joints: Vec<ReferenceJoint>,
    /// Closed configurations with consistent rates.
    pub states: Vec<ReferenceState>,
    /// A motion from rest.
    pub trajectory: Trajectory,
}

/// A body with its mass properties.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct ReferenceBody {
    pub name: String,
    pub fixed: bool,
    pub mass: f64,
    pub com: [f64; 3],
    pub inertia: [[f64; 3]; 3],
}

/// A hinge; a child "ghost of b3" is the body b3.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct ReferenceJoint {
    pub name: String,
    pub parent: String,
    pub child: String,
    pub axis: [f64; 3],
    pub point: [f64; 3],
    pub stiffness: f64,
    pub damping: f64,
    pub rest: f64,
}

/// Values at one state.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct ReferenceState {
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub acceleration: Vec<f64>,
    pub constraint_rank: usize,
    pub dof: usize,
    pub kinetic_energy: f64,
    pub potential_energy: f64,
    pub mass_matrix: Option<Vec<Vec<f64>>>,
    pub forcing: Option<Vec<f64>>,
}

/// A motion from rest.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct Trajectory {
    pub q0: Vec<f64>,
    pub u0: Vec<f64>,
    pub t: Vec<f64>,
    pub q: Vec<Vec<f64>>,
}

impl Reference {
    /// Reads the reference of a published design.
    pub fn read(shared: &Path, name: &str) -> Self {
        let path = shared.join("reference").join(format!("{name}.json"));
        let text = std::fs::read_to_string(&path)
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }
}

/// An adaptive integrator with one tolerance for relative and absolute errors.
pub fn dopri5<Y: System<Scalar = f64>>(system: &Y, tolerance: f64) -> Dopri5<Y> {
    let mut integrator = Dopri5::new(system);
    integrator.relative = tolerance;
    integrator.absolute = tolerance;
    integrator
}

/// Largest difference over largest magnitude of the right side.
pub fn relative_error(left: &[f64], right: &[f64]) -> f64 {
    assert_eq!(left.len(), right.len(), "vectors of different lengths");
    let scale = right.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let error = left.iter().zip(right).fold(0.0_f64, |most, (x, y)| {
        let difference = (x - y).abs();
        if difference.is_nan() { f64::INFINITY } else { most.max(difference) }
    });
    if error == 0.0 { 0.0 } else { error / scale }
}
