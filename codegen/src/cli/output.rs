//! Writing: files, and standard output without complaint into a closed pipe.

use std::io::{self, ErrorKind, Write};
use std::path::Path;

use lamc::files;

use super::{Failed, Outcome, fail};

/// Writes text, or anything, to standard output. A reader that went away is no failure.
pub fn print(contents: &(impl AsRef<[u8]> + ?Sized)) -> Outcome {
    let mut out = io::stdout().lock();
    match out.write_all(contents.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(fail(format_args!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a file (`-`: standard output): whole or not at all.
pub fn write(path: &str, contents: &(impl AsRef<[u8]> + ?Sized)) -> Outcome {
    if path == "-" {
        return print(contents);
    }
    files::write(Path::new(path), contents.as_ref())
        .map_err(|error| -> Failed { fail(format_args!("cannot write {path}: {error}")) })
}
