//! Writing: files, and standard output where a closed pipe is not an error.

use std::io::{self, ErrorKind, Write};
use std::path::Path;

use lamc::files;

use super::{Failed, Outcome, fail, misused};

/// Writes a text or bytes to standard output. A reader that has closed the pipe is not an error.
pub fn print(contents: &(impl AsRef<[u8]> + ?Sized)) -> Outcome {
    let mut out = io::stdout().lock();
    match out.write_all(contents.as_ref()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(fail(format_args!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Writes a text or bytes to a file (`-`: standard output): completely or not at all.
pub fn write(path: &str, contents: &(impl AsRef<[u8]> + ?Sized)) -> Outcome {
    if path == "-" {
        return print(contents);
    }
    files::write(Path::new(path), contents).map_err(|error| unwritable(path, &error))
}

/// Reports a file whose extension belongs to another format.
pub fn has_extension(path: Option<&String>, extension: &str) -> Outcome {
    let says_other = |path: &&String| {
        Path::new(path).extension().is_some_and(|found| !found.eq_ignore_ascii_case(extension))
    };
    match path.filter(says_other) {
        Some(path) => Err(misused(format_args!("`{path}` does not end in .{extension}"))),
        None => Ok(()),
    }
}

/// Fails where [`write`] would, as far as can be known before there is something to write.
pub fn probe(path: &str) -> Outcome {
    if path == "-" {
        return Ok(());
    }
    files::probe(Path::new(path)).map_err(|error| unwritable(path, &error))
}

fn unwritable(path: &str, error: &io::Error) -> Failed {
    fail(format_args!("cannot write {path}: {error}"))
}

/// A number for people: an angle in degrees, and anything else under a name with its unit, lengths in mm.
pub fn shown(name: &str, unit: &str, number: f64) -> (String, f64) {
    match unit {
        "rad" => (name.to_owned(), number.to_degrees()),
        "m" => (format!("{name} mm"), number * 1e3),
        "1" => (format!("{name} -"), number),
        unit => (format!("{name} {unit}"), number),
    }
}
