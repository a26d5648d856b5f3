//! `lamc MODEL -o FILE`: the model as Rust, C, Python or an FMU.

use std::fs;
use std::path::Path;

use lamc::backend::c::Real;
use lamc::backend::fmu::Version;
use lamc::backend::rust::Options;
use lamc::pipeline;
use lamc::program::Selection;
use lamc_workbench::archive;

use super::paths::Paths;
use super::progress::Busy;
use super::{
    Compile, Derivation, Failed, Fmi, Outcome, Scalar, Size, fail, load_edited, misused, output,
};

pub fn run(arguments: &Compile) -> Outcome {
    if let Some(path) = &arguments.output {
        is_for_rust(path)?;
    }
    if !arguments.check {
        let Compile { model, output, c, header, python, fmu, .. } = arguments;
        Paths::default()
            .input("the model", [model])
            .output("--output", output)
            .output("--c", c)
            .output("--header", header)
            .output("--python", python)
            .output("--fmu", fmu)
            .check()?;
    }
    for (path, content) in contents(arguments)? {
        match arguments.check {
            true => check(path, &content)?,
            false => output::write(path, &content)?,
        }
    }
    Ok(())
}

/// Refuses a file for Rust whose name says that it is for something else.
fn is_for_rust(path: &str) -> Outcome {
    let options = [("c", "--c"), ("h", "--header"), ("py", "--python"), ("fmu", "--fmu")];
    let ending = Path::new(path).extension();
    let other =
        options.iter().find(|(other, _)| ending.is_some_and(|it| it.eq_ignore_ascii_case(other)));
    match other {
        Some((_, option)) => Err(misused(format_args!(
            "--output writes Rust, and `{path}` does not end in .rs: for this file write `{option} {path}`"
        ))),
        None => Ok(()),
    }
}

/// All requested files with their contents; all are generated before the first is written.
fn contents(arguments: &Compile) -> Result<Vec<(&String, Vec<u8>)>, Failed> {
    let beside = match (&arguments.python, &arguments.c, &arguments.header) {
        (Some(python), Some(c), Some(header)) => Some(beside(python, c, header)?),
        _ => None,
    };
    let size = Size { max_hinges: arguments.max_hinges };
    let derivation = Derivation { size, no_cache: arguments.no_cache };
    let functions = selection(arguments)?;
    let mut compiled = load_edited(&arguments.model, derivation, |model| {
        arguments.cut.iter().try_for_each(|joint| model.cut(joint))
    })?;
    let real = match arguments.scalar {
        Scalar::F32 => Real::Float,
        Scalar::F64 | Scalar::Generic => Real::Double,
    };
    let _busy = Busy::new("writing the module");
    let mut contents = Vec::new();
    if let Some(path) = &arguments.output {
        let options =
            Options { scalar: arguments.scalar.into(), extern_c: arguments.extern_c, functions };
        let text = pipeline::rust_module(&compiled, &options).map_err(fail)?;
        contents.push((path, text.into_bytes()));
    }
    if let Some(path) = &arguments.fmu {
        let version = match arguments.fmi {
            Fmi::Two => Version::Fmi2,
            Fmi::Three => Version::Fmi3,
        };
        contents
            .push((path, archive::pack(&pipeline::fmu_files(&compiled, version).map_err(fail)?)));
    }
    compiled.program = compiled.program.only(functions);
    if let Some(path) = &arguments.c {
        let header = arguments.header.as_deref().unwrap_or_default();
        let standard = format!("{}.h", compiled.program.interface.name);
        let name = file_name(header).unwrap_or(&standard);
        if name.contains(|c: char| matches!(c, '"' | '\\') || c.is_control()) {
            return Err(misused(format_args!("C cannot include a header called {name}")));
        }
        let text = pipeline::c_source(&compiled, real, name).map_err(fail)?;
        contents.push((path, text.into_bytes()));
    }
    if let Some(path) = &arguments.header {
        contents.push((path, pipeline::c_header(&compiled, real).into_bytes()));
    }
    if let (Some(path), Some([c, header])) = (&arguments.python, beside) {
        let text = pipeline::python_module(&compiled, real, c, header);
        contents.push((path, text.into_bytes()));
    }
    Ok(contents)
}

/// The requested functions.
fn selection(arguments: &Compile) -> Result<Selection, Failed> {
    if arguments.functions.is_empty() {
        return Ok(Selection::default());
    }
    Selection::named(&arguments.functions).map_err(misused)
}

/// A file's name without folders; none of standard output.
fn file_name(path: &str) -> Option<&str> {
    Path::new(path).file_name().and_then(|name| name.to_str()).filter(|&name| name != "-")
}

/// The names of the C files, which Python looks for in its own folder.
fn beside<'a>(python: &str, c: &'a str, header: &'a str) -> Result<[&'a str; 2], Failed> {
    let folder = Path::new(python).parent();
    let name = |path: &'a str| file_name(path).filter(|_| Path::new(path).parent() == folder);
    match (name(c), name(header)) {
        (Some(c), Some(header)) if python != "-" => Ok([c, header]),
        _ => Err(misused("--python, --c and --header must name files in one folder")),
    }
}

/// Fails if a file differs from what would be written.
fn check(path: &str, new: &[u8]) -> Outcome {
    let old = fs::read(path).map_err(|error| fail(format_args!("cannot read {path}: {error}")))?;
    if old == new {
        return Ok(());
    }
    let lines = |content: &[u8]| content.split(|&byte| byte == b'\n').map(<[u8]>::to_vec).collect();
    let (old, new): (Vec<_>, Vec<_>) = (lines(&old), lines(new));
    let differs = old.iter().zip(&new).take_while(|(old, new)| old == new).count() + 1;
    Err(fail(format_args!(
        "{path} is out of date: line {differs} differs from what lamc writes now; run lamc \
         without --check"
    )))
}
