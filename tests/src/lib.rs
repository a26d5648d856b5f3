//! Common parts of the end-to-end tests: mechanisms with reference values, compiled models,
//! comparisons, and formulations of mechanics that are independent of lamc.

pub mod campaign;
pub mod chain;
pub mod compare;
pub mod designs;
pub mod dual;
pub mod golden;
pub mod linkages;
pub mod modules;
pub mod motions;
pub mod near_flat;
pub mod nine_rows;
pub mod not_checked;
pub mod package;
pub mod random;
pub mod schema_cases;
pub mod sheets;
pub mod shrink;
pub mod udwadia;
pub mod uniform;
pub mod varied;

/// The Rust code of README.md and other pages, compiled and run as doc-tests.
#[cfg(doctest)]
mod documents {
    #[doc = include_str!("../../README.md")]
    struct Readme;
    #[doc = include_str!("../../docs/LANES.md")]
    struct Lanes;
    #[doc = include_str!("../../docs/PARAMETERS.md")]
    struct Parameters;
}

use std::path::{Path, PathBuf};

pub use compare::{largest, largest_difference, maximum, relative_error};
pub use designs::{Reference, designs, drawings, published};
use lamc::pipeline::{self, Compiled};
use lamc::program::Selection;
use lamc::source::SourceFile;
use lamc_runtime::{Dopri5, Mechanism};
pub use not_checked::{is_there, not_checked};

/// The workspace's folder.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Our examples that are bolted to the bench; those of the paper, which `generated` has modules of, first.
pub const EXAMPLES: [&str; 9] = [
    "pendulum",
    "triple_pendulum",
    "fourbar",
    "sixbar",
    "miura",
    "sixbar_markers",
    "miura_sheet",
    "fold/bird_base",
    "fold/pop_up",
];

/// Our examples with free bodies, contacts, motors and springs.
pub const ROBOTS: [&str; 2] = ["crawler", "jumper"];

/// The examples that `generated` has modules of.
pub const MODULES: [&str; 9] = [
    "pendulum",
    "triple_pendulum",
    "fourbar",
    "sixbar",
    "crawler",
    "jumper",
    "linkage",
    "servo",
    "swing",
];

/// The functions of the module of an example in `generated/`.
pub fn functions_of(module: &str) -> Selection {
    let names = match module {
        // What firmware needs to estimate parameters.
        "swing" => ["acceleration", "jacobian", "jacobian_params"],
        _ => return Selection::default(),
    };
    Selection::named(names).unwrap_or_default()
}

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

/// An adaptive integrator with one tolerance for relative and absolute errors.
pub fn dopri5<Y: Mechanism<Scalar = f64>>(system: &Y, tolerance: f64) -> Dopri5<Y> {
    let mut integrator = Dopri5::new(system);
    integrator.relative = tolerance;
    integrator.absolute = tolerance;
    integrator
}
