//! `lamc check MODEL`: a report on the model.

use lamc_workbench::check::{report, warnings};

use super::{Derivation, Outcome, load, output, warn};

pub fn run(model: &str, derivation: Derivation) -> Outcome {
    let compiled = load(model, derivation)?;
    warnings(&compiled).iter().for_each(warn);
    output::print(&report(&compiled))
}
