//! `lamc MODEL -o FILE`.

use std::fs;

use lamc::backend::rust::Options;
use lamc::pipeline;

use super::{Compile, Outcome, fail, load, output};

pub fn run(arguments: &Compile) -> Outcome {
    let compiled = load(&arguments.model)?;
    let text = pipeline::rust_module(&compiled, &Options { scalar: arguments.scalar.into() });
    if !arguments.check {
        return output::write(&arguments.output, &text);
    }
    let path = &arguments.output;
    let old = fs::read_to_string(path)
        .map_err(|error| fail(format_args!("cannot read {path}: {error}")))?;
    if old == text {
        return Ok(());
    }
    let lines = text.lines().map(Some).chain(std::iter::repeat(None));
    let stale = old.lines().map(Some).chain(std::iter::repeat(None)).zip(lines);
    let differs = stale.take_while(|(old, new)| old == new).count() + 1;
    Err(fail(format_args!(
        "{path} is stale: line {differs} differs from what lamc writes now; run lamc without --check"
    )))
}
