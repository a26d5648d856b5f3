//! What the fuzzer calls: the stages that read a model, up to its loops, the readers of numbers, and the runtime.

#![allow(dead_code, unused_imports, reason = "the crates' own files, of which a part is used")]

// The files that are taken from the crates, and the targets, call the crates by their names.
extern crate self as lamc;
extern crate self as lamc_workbench;

#[path = "../../../codegen/src/arithmetic.rs"]
pub mod arithmetic;
#[path = "../../../codegen/src/laminate/mod.rs"]
pub mod laminate;
#[path = "../../../workbench/src/mocap/mod.rs"]
pub mod mocap;
#[path = "../../../workbench/src/reading/mod.rs"]
pub mod reading;
#[path = "../../../codegen/src/source/mod.rs"]
pub mod source;
#[path = "../../../codegen/src/topology/mod.rs"]
pub mod topology;

/// The readers of measured angles and hinges.
#[path = "../../../workbench/src/identify"]
pub mod identify {
    pub mod family;
    pub mod fourier;
    mod record;

    pub use record::Record;
}

pub mod corpus;
pub mod targets;

use std::sync::LazyLock;

/// Runs the target whose name is in the variable `TARGET`.
pub fn run(input: &[u8]) {
    static TARGET: LazyLock<targets::Target> = LazyLock::new(|| {
        let name = std::env::var("TARGET").expect("the variable TARGET");
        let target = targets::TARGETS.iter().find(|(known, _)| *known == name);
        target.unwrap_or_else(|| panic!("there is no target {name}")).1
    });
    TARGET(input);
}
