//! Writing: files, and standard output without complaint into a closed pipe.

use std::io::{self, ErrorKind, Write};
use std::path::Path;

use lamc::files;

use super::{Failed, Outcome, fail};

/// Writes `text` to standard output. A reader that went away is no failure.
pub fn print(text: &str) -> Outcome {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(fail(format_args!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes `text` to a file (`-`: standard output): whole or not at all.
pub fn write(path: &str, text: &str) -> Outcome {
    if path == "-" {
        return print(text);
    }
    files::write(Path::new(path), text)
        .map_err(|error| -> Failed { fail(format_args!("cannot write {path}: {error}")) })
}
