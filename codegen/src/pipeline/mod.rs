//! The pipeline: every stage of the compiler, in order.

mod output;
#[cfg(feature = "derive")]
mod tree;

use std::borrow::Cow;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

#[cfg(feature = "derive")]
use crate::kane::{self, DeriveError, Equations};
#[cfg(feature = "derive")]
use crate::laminate::Geometry;
#[cfg(feature = "derive")]
use crate::lowering;
use crate::program::{self, Program, ReadError};
use crate::sealed::Format;
use crate::source::codes;
use crate::source::{self, Diagnostic, Diagnostics, EditError, Numbers, SourceFile, SourceModel};
#[cfg(feature = "derive")]
use crate::symbolic::SessionError;
use crate::topology::Topology;
use crate::topology::range::{self, analysed};

pub use output::{c_header, c_source, fmu_files, python_module, rust_module};

/// Why a model could not be compiled.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// The model has errors.
    #[error("{0}")]
    Model(Diagnostics),
    /// A change names a joint or force that the model does not have.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A number of the model is too large for the number type.
    #[error("the number {0:e} of the equations does not fit f32: use f64")]
    OutOfRange(f64),
    /// The model has controllers, and this output needs constant inputs. The text says which, and what to do.
    #[error("{0}")]
    Controlled(String),
    /// The symbolic engine could not be started.
    #[cfg(feature = "derive")]
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The process that derived the equations has ended early. The text says how, and what to do.
    #[cfg(feature = "derive")]
    #[error("{0}")]
    Ended(String),
}

impl From<Diagnostics> for CompileError {
    fn from(diagnostics: Diagnostics) -> Self {
        Self::Model(diagnostics)
    }
}

#[cfg(feature = "derive")]
impl From<DeriveError> for CompileError {
    fn from(error: DeriveError) -> Self {
        match error {
            DeriveError::Session(error) => Self::Session(error),
            DeriveError::Model(diagnostics) => Self::Model(diagnostics),
        }
    }
}

/// A model compiled to a program, with the warnings of all stages.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Compiled {
    /// The mechanism with its tree and loops.
    pub topology: Topology,
    /// Its equations as straight-line code.
    pub program: Program,
    /// The model, if its drawing depends on parameters.
    pub model: Option<Box<SourceModel>>,
    /// Units of numbers that are given on a command line.
    pub numbers: Numbers,
    /// Warnings of every stage, in the order of the stages.
    pub warnings: Diagnostics,
}

/// A model that was read, and perhaps changed, with the warnings of the stage `source`.
#[derive(Clone, Debug)]
pub struct Read<'a> {
    file: Cow<'a, SourceFile>,
    model: SourceModel,
    warnings: Diagnostics,
}

/// The results of the stages from `laminate` to `program`, which take most of the time: what a cache keeps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Derived {
    topology: Topology,
    program: Program,
    /// Warnings of these stages.
    warnings: Diagnostics,
}

/// [`Compiled`] as bytes. They are bound to [`RELEASE`], so that this version needs not be raised when a type
/// changes.
const COMPILED: Format = Format { name: *b"lamcmodl", version: 1 };

/// [`Read`] as bytes, for another process of the same build.
const READ: Format = Format { name: *b"lamcread", version: 1 };

/// The release of lamc.
const RELEASE: &[u8] = env!("CARGO_PKG_VERSION").as_bytes();

/// [`Derived`] as bytes. A cache is bound to one build of the compiler, so that this version needs not be raised
/// when a type changes.
const FORMAT: Format = Format { name: *b"lamcderi", version: 1 };

/// Stages that take a long time for large models.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Tree, loops and mobility.
    Topology,
    /// The equations of motion.
    Equations,
    /// The program that evaluates them.
    Program,
}

#[cfg(feature = "derive")]
/// As [`compile`], after a change of the model that was read.
///
/// # Errors
/// As [`compile`]; [`CompileError::Edit`] if the change names something that does not exist.
pub fn compile_edited(
    file: &SourceFile,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
) -> Result<Compiled, CompileError> {
    compile_watched(file, edit, |_, _| ())
}

#[cfg(feature = "derive")]
/// As [`compile_edited`]; `enter` is called before each stage, with the stage and the number of
/// joints.
///
/// # Errors
/// As [`compile_edited`].
pub fn compile_watched(
    file: &SourceFile,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
    enter: impl FnMut(Stage, usize),
) -> Result<Compiled, CompileError> {
    let read = read(file, edit)?;
    let derived = read.derive(enter)?;
    Ok(read.compiled(derived))
}

/// Runs the stage `source`, and changes the model that was read.
///
/// # Errors
/// As [`compile_edited`].
pub fn read(
    file: &SourceFile,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
) -> Result<Read<'_>, CompileError> {
    let (mut model, warnings) = source::parse(file)?;
    edit(&mut model)?;
    refuse_too_many_hinges(&model)?;
    Ok(Read { file: Cow::Borrowed(file), model, warnings })
}

impl Read<'_> {
    /// Returns a hash of everything that the later stages depend on, but for the compiler itself: models with the same
    /// hash have the same [`Derived`].
    pub fn fingerprint(&self) -> [u8; 32] {
        // `Debug` is derived for all types of the model, which hold no hash maps: it shows every number with
        // all its digits, and what the user changed. The text is in the program as a hash.
        let model = format!("{:?}", self.model);
        let parts = [self.file.name(), &self.file.text, &model];
        let hash = parts.iter().fold(Sha256::new(), |hash, part| {
            hash.chain_update((part.len() as u64).to_le_bytes()).chain_update(part)
        });
        hash.finalize().into()
    }

    /// Returns what [`derive`](Self::derive) needs as bytes, so that another process can do it.
    pub fn to_bytes(&self) -> Vec<u8> {
        READ.write(&(&self.file, &self.model, self.model.drawing.as_deref()), RELEASE)
    }

    #[cfg(feature = "derive")]
    /// Runs the stages from `laminate` to `program`; `enter` is called before each that takes long, with the number
    /// of joints.
    ///
    /// # Errors
    /// As [`compile`].
    pub fn derive(&self, mut enter: impl FnMut(Stage, usize)) -> Result<Derived, CompileError> {
        let mut is_first = true;
        let mut derived = tree::cheapest(&self.model, |model| {
            let is_shown = std::mem::take(&mut is_first);
            self.derive_cut(model, |stage, joints| {
                if is_shown {
                    enter(stage, joints)
                }
            })
        })?;
        // A module repeats what the user asked for.
        if self.model.cuts.is_empty() {
            derived.program.interface.cuts.clear();
        }
        Ok(derived)
    }

    /// Runs these stages with loops cut where the model says.
    #[cfg(feature = "derive")]
    fn derive_cut(
        &self,
        model: &SourceModel,
        mut enter: impl FnMut(Stage, usize),
    ) -> Result<Derived, CompileError> {
        let joints = model.joints.len();
        enter(Stage::Topology, joints);
        let (topology, warnings) = analysed(model)?;
        range::check(model, &topology)?;
        let geometry = Geometry::new(model, &topology.mechanism)?;
        enter(Stage::Equations, joints);
        let equations: Equations = kane::derive(&topology, &geometry)?;
        enter(Stage::Program, joints);
        // The module says from which texts it was made.
        let drawing = self.model.drawing.as_ref().map_or("", |drawing| drawing.text.as_str());
        let text = self.file.text.clone() + drawing;
        let program = lowering::lower(&equations, self.file.name(), &text);
        Ok(Derived { topology: equations.topology, program, warnings })
    }

    /// Adds what was derived from this model.
    pub fn compiled(self, derived: Derived) -> Compiled {
        let Derived { topology, program, warnings: found } = derived;
        let numbers = self.model.numbers();
        let mut warnings = self.warnings;
        warnings.extend(found.0);
        // At other values of the parameters, the tree is the same.
        let model = SourceModel { cuts: topology.mechanism.cuts.clone(), ..self.model };
        let model = model.is_parametric().then(|| Box::new(model));
        Compiled { topology, program, model, numbers, warnings }
    }
}

impl Read<'static> {
    /// Reads what [`to_bytes`](Self::to_bytes) wrote, without warnings.
    ///
    /// # Errors
    /// Returns an error if the bytes are damaged or of another release.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        let (file, mut model, drawing): (SourceFile, SourceModel, Option<SourceFile>) =
            READ.read(bytes, RELEASE)?;
        model.drawing = drawing.map(Arc::new);
        Ok(Self { file: Cow::Owned(file), model, warnings: Diagnostics::default() })
    }
}

impl Compiled {
    /// Returns the topology at values of all parameters of the program, SI: that of the defaults, unless the drawing
    /// depends on parameters.
    ///
    /// # Errors
    /// Returns an error if a value is outside its range, or if the drawing is impossible or has other loops with these
    /// values.
    pub fn topology_at(&self, parameters: &[f64]) -> Result<Cow<'_, Topology>, Diagnostics> {
        let known = self.topology.mechanism.parameters.iter().map(|known| known.value);
        match &self.model {
            Some(model) if !known.eq(parameters.iter().copied()) => {
                range::at(model, &self.topology, parameters).map(Cow::Owned)
            }
            _ => Ok(Cow::Borrowed(&self.topology)),
        }
    }

    /// Returns the compiled model as bytes: what another process of the same release needs to run it, without the
    /// algebra.
    pub fn to_bytes(&self) -> Vec<u8> {
        COMPILED.write(self, RELEASE)
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote. The program is verified.
    ///
    /// # Errors
    /// Returns an error if the bytes are damaged or of another release.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        let compiled: Self = COMPILED.read(bytes, RELEASE)?;
        program::verify(&compiled.program)?;
        Ok(compiled)
    }
}

impl Derived {
    /// Returns what was derived as bytes. They can be read for the same `key` only.
    pub fn to_bytes(&self, key: &[u8]) -> Vec<u8> {
        FORMAT.write(self, key)
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote. The program is verified.
    ///
    /// # Errors
    /// Returns an error if the bytes are damaged, of another version or for another key.
    pub fn from_bytes(bytes: &[u8], key: &[u8]) -> Result<Self, ReadError> {
        let derived: Self = FORMAT.read(bytes, key)?;
        program::verify(&derived.program)?;
        Ok(derived)
    }
}

#[cfg(feature = "derive")]
/// Compiles a model to a program: every stage except the backend.
///
/// # Errors
/// All errors of the model that the first stage that fails found, together.
pub fn compile(file: &SourceFile) -> Result<Compiled, CompileError> {
    compile_edited(file, |_| Ok(()))
}

/// Runs the stages before the algebra: source, laminate, topology.
///
/// # Errors
/// As [`compile`].
pub fn analyse(file: &SourceFile) -> Result<(Topology, Diagnostics), Diagnostics> {
    let (_, topology, warnings) = analyse_edited(file, |_| ())?;
    Ok((topology, warnings))
}

/// As [`analyse`], after a change of the model that was read; returns the changed model too.
///
/// # Errors
/// As [`analyse`].
pub fn analyse_edited(
    file: &SourceFile,
    edit: impl FnOnce(&mut SourceModel),
) -> Result<(SourceModel, Topology, Diagnostics), Diagnostics> {
    let (mut model, mut warnings) = source::parse(file)?;
    edit(&mut model);
    refuse_too_many_hinges(&model)?;
    let (topology, found) = analysed(&model)?;
    warnings.extend(found.0);
    Ok((model, topology, warnings))
}

/// Refuses models whose equations would take more memory or time than the user expects.
fn refuse_too_many_hinges(model: &SourceModel) -> Result<(), Diagnostics> {
    let (most, there) = (model.max_hinges, model.joints.len());
    let Some(first) = model.joints.get(most) else { return Ok(()) };
    let message = format!("{there} hinges are more than the {most} that lamc compiles");
    let problem = Diagnostic::error(codes::TOO_MANY_HINGES, first.name.span, message)
        .label(format!("number {} of {there}", most + 1))
        .hint(format!(
            "--max-hinges {there} raises the limit (in a build script: Config::max_hinges); memory \
             and time grow as the square of the number; `lamc import` has no such limit"
        ));
    Err(problem.into())
}
