//! The last stage: a compiled model as modules in several languages.

use super::{CompileError, Compiled};
use crate::backend::c::{self, Real};
use crate::backend::fmu::{self, Version};
use crate::backend::python;
use crate::backend::rust::{self, ScalarChoice};
use crate::program::{Op, Program};

/// Writes the Rust module of a compiled model.
///
/// # Errors
/// [`CompileError::OutOfRange`].
pub fn rust_module(compiled: &Compiled, options: &rust::Options) -> Result<String, CompileError> {
    if options.scalar == ScalarChoice::F32 {
        fits_single(&compiled.program)?;
    }
    Ok(rust::write(&compiled.program, options))
}

/// Writes the header of the C module, or of a Rust module that exports the same functions.
pub fn c_header(compiled: &Compiled, real: Real) -> String {
    c::header(&compiled.program, real)
}

/// Writes the C module of a compiled model, which includes its header by this name.
///
/// # Errors
/// [`CompileError::OutOfRange`].
pub fn c_source(
    compiled: &Compiled,
    real: Real,
    header_name: &str,
) -> Result<String, CompileError> {
    if real == Real::Float {
        fits_single(&compiled.program)?;
    }
    Ok(c::source(&compiled.program, real, header_name))
}

/// Writes the Python wrapper of the C module, whose source and header have these names in the same folder.
pub fn python_module(
    compiled: &Compiled,
    real: Real,
    source_name: &str,
    header_name: &str,
) -> String {
    python::write(&compiled.program, real, source_name, header_name)
}

/// Writes the files of a source FMU: for each, its path in the archive and its text.
///
/// # Errors
/// [`CompileError::Controlled`].
pub fn fmu_files(
    compiled: &Compiled,
    version: Version,
) -> Result<Vec<(String, String)>, CompileError> {
    let uncontrolled = compiled.program.interface.without_controllers("FMUs");
    uncontrolled.map_err(CompileError::Controlled)?;
    Ok(fmu::files(&compiled.program, version))
}

/// Checks that every finite constant is also finite in single precision.
fn fits_single(program: &Program) -> Result<(), CompileError> {
    let instructions = program.functions.iter().flat_map(|function| &function.instructions);
    let constants = instructions.filter_map(|instruction| match instruction.op {
        Op::Const(number) => Some(number),
        _ => None,
    });
    let parameters = program.interface.parameters.iter().map(|parameter| parameter.value);
    let mut numbers = constants.chain(parameters);
    match numbers.find(|number| number.is_finite() && !(*number as f32).is_finite()) {
        Some(number) => Err(CompileError::OutOfRange(number)),
        None => Ok(()),
    }
}
