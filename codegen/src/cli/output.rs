//! Writing: atomically, only what changed, and without complaint into a closed pipe.

use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

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

/// Writes `text` to a file (`-`: standard output): whole or not at all, and not when it is there
/// already. Links are followed; what is no file (a device, a pipe) is written to as it is.
pub fn write(path: &str, text: &str) -> Outcome {
    if path == "-" {
        return print(text);
    }
    let failure = |error| -> Failed { fail(format_args!("cannot write {path}: {error}")) };
    match fs::metadata(path) {
        Ok(found) if found.is_file() => {
            if fs::read(path).is_ok_and(|old| old == text.as_bytes()) {
                return Ok(());
            }
            let target = fs::canonicalize(path).map_err(failure)?;
            replace(&target, text).map_err(failure)
        }
        Ok(found) if !found.is_dir() => {
            let written = fs::OpenOptions::new().write(true).open(path);
            written.and_then(|mut file| file.write_all(text.as_bytes())).map_err(failure)
        }
        _ => replace(Path::new(path), text).map_err(failure),
    }
}

/// A temporary file in the same folder takes the place of the old one.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    // Temporary files are private; what we write is as readable as any new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // The system's reason alone: the temporary file's name means nothing to the user.
    let reason = |error: io::Error| io::Error::from(error.kind());
    let mut file = builder.prefix(".lamc-").tempfile_in(folder).map_err(reason)?;
    file.write_all(text.as_bytes())?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}
