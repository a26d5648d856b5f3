//! Files that commands read.

use std::sync::OnceLock;

use lamc::source::{Diagnostics, SourceFile};
use lamc_workbench::reading::MAX_TABLE_BYTES;

use super::{Failed, fail, report};

/// Reads a file. Standard input, which can be read once only, is kept: a command may need it twice.
pub fn read(path: &str) -> Result<SourceFile, Failed> {
    static STDIN: OnceLock<SourceFile> = OnceLock::new();
    let is_stdin = path == "-";
    if let Some(file) = STDIN.get().filter(|_| is_stdin) {
        return Ok(file.clone());
    }
    let file = SourceFile::read(path).map_err(fail)?;
    if is_stdin {
        STDIN.get_or_init(|| file.clone());
    }
    Ok(file)
}

/// Reads a table or another file of numbers with `parse`, and reports what is wrong with it.
pub fn read_numbers<T>(
    path: &str,
    parse: impl FnOnce(&str) -> Result<T, Diagnostics>,
) -> Result<T, Failed> {
    let file = SourceFile::read_at_most(path, MAX_TABLE_BYTES).map_err(fail)?;
    parse(&file.text).map_err(|problems| {
        report(&problems, &file);
        Failed(1)
    })
}
