//! The way through the house: every stage, in order.

use crate::backend::rust;
use crate::kane::{self, DeriveError, Equations};
use crate::laminate;
use crate::program::{self, Program};
use crate::source::{self, Diagnostic, Diagnostics, EditError, SourceFile, SourceModel};
use crate::symbolic::SessionError;
use crate::topology::{self, Topology};

/// Why a model could not be compiled.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// The model is wrong.
    #[error("{0}")]
    Model(Diagnostics),
    /// A change asks for a joint or force that the model has not.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// The symbolic engine is not to be had.
    #[error(transparent)]
    Session(#[from] SessionError),
}

impl From<Diagnostics> for CompileError {
    fn from(diagnostics: Diagnostics) -> Self {
        Self::Model(diagnostics)
    }
}

impl From<DeriveError> for CompileError {
    fn from(error: DeriveError) -> Self {
        match error {
            DeriveError::Session(error) => Self::Session(error),
            DeriveError::Model(diagnostics) => Self::Model(diagnostics),
        }
    }
}

/// A model compiled to a program, with what was noticed on the way.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The mechanism with its tree and loops.
    pub topology: Topology,
    /// Its equations as straight-line code.
    pub program: Program,
    /// Warnings of every stage, in the order of the stages.
    pub warnings: Diagnostics,
}

/// As [`compile`], after a change of the model as read.
///
/// # Errors
/// As [`compile`]; [`CompileError::Edit`] when the change asks for something there is not.
pub fn compile_edited(
    file: &SourceFile,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
) -> Result<Compiled, CompileError> {
    let (mut model, warnings) = source::parse(file)?;
    edit(&mut model)?;
    lower(&analysed(&model, warnings)?, file)
}

/// Compiles a model as far as its program: every stage but the backend.
///
/// # Errors
/// Everything wrong with the model that one stage could see, together.
pub fn compile(file: &SourceFile) -> Result<Compiled, CompileError> {
    lower(&analyse(file)?, file)
}

/// The stages from the algebra on.
fn lower(
    (topology, warnings): &(Topology, Diagnostics),
    file: &SourceFile,
) -> Result<Compiled, CompileError> {
    let equations: Equations = kane::derive(topology)?;
    let program = program::lower(&equations, file.name(), &file.text);
    Ok(Compiled { topology: equations.topology, program, warnings: warnings.clone() })
}

/// The stages before the algebra: source, laminate, topology.
///
/// # Errors
/// As [`compile`].
pub fn analyse(file: &SourceFile) -> Result<(Topology, Diagnostics), Diagnostics> {
    let (model, warnings) = source::parse(file)?;
    analysed(&model, warnings)
}

/// The stages between: laminate and topology.
fn analysed(
    model: &SourceModel,
    found: Diagnostics,
) -> Result<(Topology, Diagnostics), Diagnostics> {
    let mut warnings: Vec<Diagnostic> = found.0;
    let mut physical = Diagnostics::default();
    let mechanism = laminate::build(model, &mut physical)?;
    let topology = topology::build(mechanism)?;
    warnings.extend(physical.0);
    warnings.extend(topology.warnings.0.iter().cloned());
    Ok((topology, Diagnostics(warnings)))
}

/// The Rust module of a compiled model.
pub fn rust_module(compiled: &Compiled, options: &rust::Options) -> String {
    rust::write(&compiled.program, options)
}
