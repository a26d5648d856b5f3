//! `lamc MODEL -o FILE`: the model as Rust or C.

use std::fs;
use std::path::Path;

use lamc::backend::c::Real;
use lamc::backend::rust::Options;
use lamc::pipeline;

use super::{Compile, Failed, Outcome, Scalar, fail, load_edited, misused, output};

pub fn run(arguments: &Compile) -> Outcome {
    let paths = [&arguments.output, &arguments.c, &arguments.header];
    let paths: Vec<&String> = paths.into_iter().flatten().collect();
    if let Some(twice) = paths.iter().enumerate().find(|(i, path)| paths[..*i].contains(path)) {
        return Err(misused(format_args!("{} is given for two outputs", twice.1)));
    }
    for (path, text) in texts(arguments)? {
        match arguments.check {
            true => check(path, &text)?,
            false => output::write(path, &text)?,
        }
    }
    Ok(())
}

/// Every file asked for, with its text: all are made before the first is written.
fn texts(arguments: &Compile) -> Result<Vec<(&String, String)>, Failed> {
    let compiled = load_edited(&arguments.model, |model| {
        arguments.cut.iter().try_for_each(|joint| model.cut(joint))
    })?;
    let real = match arguments.scalar {
        Scalar::F32 => Real::Float,
        Scalar::F64 | Scalar::Generic => Real::Double,
    };
    let mut texts = Vec::new();
    if let Some(path) = &arguments.output {
        let options = Options { scalar: arguments.scalar.into(), extern_c: arguments.extern_c };
        texts.push((path, pipeline::rust_module(&compiled, &options).map_err(fail)?));
    }
    if let Some(path) = &arguments.c {
        let header = arguments.header.as_deref().unwrap_or_default();
        let standard = format!("{}.h", compiled.program.interface.name);
        let name = Path::new(header).file_name().and_then(|name| name.to_str());
        let name = name.filter(|&name| name != "-").unwrap_or(&standard);
        if name.contains(|c: char| matches!(c, '"' | '\\') || c.is_control()) {
            return Err(misused(format_args!("C cannot include a header called {name}")));
        }
        texts.push((path, pipeline::c_source(&compiled, real, name).map_err(fail)?));
    }
    if let Some(path) = &arguments.header {
        texts.push((path, pipeline::c_header(&compiled, real)));
    }
    Ok(texts)
}

/// Fails when a file is not what would be written.
fn check(path: &str, text: &str) -> Outcome {
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
