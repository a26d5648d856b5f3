//! A model, from its file to its program.

use lamc::pipeline::{self, CompileError, Compiled, Stage};
use lamc::source::{EditError, SourceFile, SourceModel};
use lamc_workbench::cache::Cache;

use super::progress::Busy;
use super::{Derivation, Failed, fail, read, report, worker};

/// Reads and compiles a model, reporting errors and warnings.
pub fn load(path: &str, derivation: Derivation) -> Result<Compiled, Failed> {
    load_edited(path, derivation, |_| Ok(()))
}

/// As [`load`], after a change of the model as read.
pub fn load_edited(
    path: &str,
    derivation: Derivation,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
) -> Result<Compiled, Failed> {
    let file = read(path)?;
    let edit = |model: &mut SourceModel| {
        model.max_hinges = derivation.size.max_hinges;
        edit(model)
    };
    let cache = if derivation.no_cache { None } else { Cache::of_user() };
    compiled(&file, cache, edit)
}

/// Compiles a model, reporting errors and warnings.
pub fn compiled(
    file: &SourceFile,
    cache: Option<Cache>,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
) -> Result<Compiled, Failed> {
    let busy = Busy::new(format!("reading {}", file.path));
    let enter = |stage, joints| {
        let doing = match stage {
            Stage::Topology => "finding the loops",
            Stage::Equations => "deriving the equations",
            Stage::Program => "writing the program",
        };
        busy.now(format!("{doing} of {joints} hinges"));
    };
    let compiled = pipeline::read(file, edit).and_then(|read| {
        let derive = || worker::derive(&read, enter);
        let derived = match cache {
            Some(cache) => cache.derived(&read, derive)?,
            None => derive()?,
        };
        Ok(read.compiled(derived))
    });
    drop(busy);
    match compiled {
        Ok(compiled) => {
            report(&compiled.warnings, file);
            Ok(compiled)
        }
        Err(CompileError::Model(problems)) => {
            report(&problems, file);
            Err(Failed(1))
        }
        Err(error) => Err(fail(error)),
    }
}
