//! Compiling models from a build script.
//!
//! ```no_run
//! fn main() -> Result<(), lamc::BuildError> {
//!     lamc::Config::new().precision(lamc::Precision::F32).compile("robot/sixbar.yaml")?;
//!     Ok(())
//! }
//! ```
//!
//! writes `$OUT_DIR/sixbar.rs`, which the crate includes:
//!
//! ```text
//! mod sixbar {
//!     include!(concat!(env!("OUT_DIR"), "/sixbar.rs"));
//! }
//! ```

use std::path::{Path, PathBuf};
use std::{env, fmt, io};

use crate::backend::rust::Options;
pub use crate::backend::rust::ScalarChoice as Precision;
use crate::files;
use crate::pipeline::{self, CompileError};
use crate::program::{Selection, UnknownFunction};
use crate::source::{Diagnostics, ReadError, Severity, SourceFile, Span, Spanned, Tunable};

/// Options for compiling models in a build script.
#[derive(Clone, Debug, Default)]
pub struct Config {
    precision: Precision,
    out_dir: Option<PathBuf>,
    tunable: Vec<Tunable>,
    extern_c: bool,
    functions: Option<Vec<String>>,
    cuts: Vec<String>,
    max_hinges: Option<usize>,
}

/// Why a model could not be compiled in a build script.
///
/// Cargo prints the `Debug` form of the error that `main` of a build script returns, so it is the same report as
/// that of `Display`.
#[derive(thiserror::Error)]
pub enum BuildError {
    /// The model cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The model has errors: the diagnostics, with lines and columns.
    #[error("{0}")]
    Model(String),
    /// The model cannot be compiled.
    #[error("{0}")]
    Compile(String),
    /// No folder was given, and `OUT_DIR` is not set.
    #[error("OUT_DIR is not set: call this from a build script, or set `out_dir`")]
    NoFolder,
    /// No function has a name that was given to [`Config::functions`].
    #[error(transparent)]
    Function(#[from] UnknownFunction),
    /// The module could not be written.
    #[error("cannot write {path}: {error}")]
    Write {
        /// The module.
        path: PathBuf,
        /// The error of the operating system.
        error: io::Error,
    },
}

impl fmt::Debug for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl Config {
    /// The default options: modules generic over the number type, in `OUT_DIR`.
    pub fn new() -> Self {
        Self::default()
    }

    /// The number type of the modules.
    #[must_use]
    pub fn precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// Writes to this folder instead of cargo's `OUT_DIR`.
    #[must_use]
    pub fn out_dir(mut self, folder: impl Into<PathBuf>) -> Self {
        self.out_dir = Some(folder.into());
        self
    }

    /// Turns these constants of every joint (body) into parameters, as `tunable` in the model does.
    #[must_use]
    pub fn tunable(mut self, tunable: impl IntoIterator<Item = Tunable>) -> Self {
        self.tunable.extend(tunable);
        self
    }

    /// Makes the modules export the functions of their C header (`lamc MODEL --header FILE`), which
    /// is written next to each module.
    #[must_use]
    pub fn extern_c(mut self, extern_c: bool) -> Self {
        self.extern_c = extern_c;
        self
    }

    /// Chooses the functions that the modules contain besides those that every motion needs: `poses`, `points`,
    /// `energy`, `reactions`, `tangent`, `acceleration`, `projection`, `jacobian`; `all`; `none`. The default is all
    /// but `jacobian` and `jacobian_params`, which are longer than the rest of a module.
    ///
    /// Without `acceleration` or `projection`, the runtime uses its own algorithms, which take more
    /// time. Without `tangent`, nothing works that needs derivatives: Rosenbrock's method, equilibria, the
    /// Jacobian.
    #[must_use]
    pub fn functions<N: Into<String>>(mut self, names: impl IntoIterator<Item = N>) -> Self {
        self.functions.get_or_insert_default().extend(names.into_iter().map(Into::into));
        self
    }

    /// Cuts loops at these joints. By default loops are cut where the equations take the fewest operations, of the places that the
    /// compiler compares. It changes how many operations the equations take (see the module's header), and may
    /// change how a guess that is far from closed is assembled, not the motion.
    #[must_use]
    pub fn cut<N: Into<String>>(mut self, joints: impl IntoIterator<Item = N>) -> Self {
        self.cuts.extend(joints.into_iter().map(Into::into));
        self
    }

    /// Accepts models with up to this many hinges, instead of
    /// [`MAX_HINGES`](crate::source::MAX_HINGES): memory and time grow as the square of the number.
    #[must_use]
    pub fn max_hinges(mut self, most: usize) -> Self {
        self.max_hinges = Some(most);
        self
    }

    /// Compiles a model to a module named after its file, and returns the path of the module. Cargo is told to run
    /// the build script again when the model or its drawing changes, and shows the model's warnings.
    ///
    /// # Errors
    /// [`BuildError`]; nothing is written in that case.
    pub fn compile(&self, model: impl AsRef<Path>) -> Result<PathBuf, BuildError> {
        let model = model.as_ref();
        println!("cargo:rerun-if-changed={}", model.display());
        let file = SourceFile::read(&model.display().to_string())?;
        for other in file.others() {
            println!("cargo:rerun-if-changed={}", other.display());
        }
        let compiled = pipeline::compile_edited(&file, |source| {
            for &value in &self.tunable {
                if source.tunable.iter().all(|there| there.value != value) {
                    source.tunable.push(Spanned { value, span: Span::default() });
                }
            }
            source.max_hinges = self.max_hinges.unwrap_or(source.max_hinges);
            self.cuts.iter().try_for_each(|joint| source.cut(joint))
        });
        let compiled = compiled.map_err(|error| match error {
            CompileError::Model(problems) => BuildError::Model(problems.render(&file, false)),
            other => BuildError::Compile(other.to_string()),
        })?;
        // Cargo shows warnings only. Notes, which need no action, appear on the command line of `lamc`.
        let warnings = compiled.warnings.0.iter().filter(|d| d.severity == Severity::Warning);
        for line in Diagnostics(warnings.cloned().collect()).render(&file, false).lines() {
            println!("cargo:warning={line}");
        }
        let folder = match &self.out_dir {
            Some(folder) => folder.clone(),
            None => env::var_os("OUT_DIR").map(PathBuf::from).ok_or(BuildError::NoFolder)?,
        };
        let path = folder.join(file.module_name()).with_extension("rs");
        let options = Options {
            scalar: self.precision,
            extern_c: self.extern_c,
            functions: self.selection()?,
        };
        let text = pipeline::rust_module(&compiled, &options)
            .map_err(|error| BuildError::Compile(error.to_string()))?;
        let write = |path: &Path, text: &str| match files::write(path, text) {
            Ok(()) => Ok(()),
            Err(error) => Err(BuildError::Write { path: path.to_owned(), error }),
        };
        write(&path, &text)?;
        if self.extern_c {
            let mut compiled = compiled;
            compiled.program = compiled.program.only(options.functions);
            let header = pipeline::c_header(&compiled, options.c_real());
            write(&path.with_extension("h"), &header)?;
        }
        Ok(path)
    }

    fn selection(&self) -> Result<Selection, BuildError> {
        Ok(self.functions.as_ref().map(Selection::named).transpose()?.unwrap_or_default())
    }

    /// As [`compile`](Self::compile), for several models.
    ///
    /// # Errors
    /// The error of the first model that fails; the models before it have been written.
    pub fn compile_all<P: AsRef<Path>>(
        &self,
        models: impl IntoIterator<Item = P>,
    ) -> Result<Vec<PathBuf>, BuildError> {
        models.into_iter().map(|model| self.compile(model)).collect()
    }
}
