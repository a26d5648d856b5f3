//! `lamc check MODEL`: a report on the model.

use lamc_workbench::check::Check;

use super::{Derivation, Outcome, load, output, warn};

pub fn run(model: &str, derivation: Derivation) -> Outcome {
    let compiled = load(model, derivation)?;
    let check = Check::new(&compiled);
    check.warnings().iter().for_each(warn);
    output::print(&check.report())
}
