//! Writing files: whole or not at all, and only what changed.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// Writes a text or bytes to a file, not when they are there already. Links are
/// followed; what is no file (a device, a pipe) is written to as it is.
///
/// # Errors
/// The system's; a file that could not be written whole is as it was.
pub fn write(path: &Path, contents: &(impl AsRef<[u8]> + ?Sized)) -> io::Result<()> {
    let contents = contents.as_ref();
    match fs::metadata(path) {
        Ok(found) if found.is_file() => {
            if fs::read(path).is_ok_and(|old| old == contents) {
                return Ok(());
            }
            replace(&fs::canonicalize(path)?, contents)
        }
        Ok(found) if !found.is_dir() => {
            fs::OpenOptions::new().write(true).open(path)?.write_all(contents)
        }
        _ => replace(path, contents),
    }
}

/// Whether [`write()`] can be expected to succeed: to be asked before long work. Nothing is written.
///
/// # Errors
/// The system's.
pub fn probe(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => Ok(()),
        Ok(_) => temporary(&fs::canonicalize(path)?).map(drop),
        Err(_) => temporary(path).map(drop),
    }
}

/// A temporary file in the same folder takes the place of the old one.
fn replace(path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut file = temporary(path)?;
    // Past the wrapper, which would name the temporary file.
    file.as_file_mut().write_all(contents)?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// A file beside this one, gone when it is dropped.
fn temporary(path: &Path) -> io::Result<tempfile::NamedTempFile> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.exists() {
        let reason = format!("there is no folder `{}`", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, reason));
    }
    let mut builder = tempfile::Builder::new();
    // Temporary files are private; what we write is as readable as any new file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // The system's reason alone: the temporary file's name means nothing to the user.
    let reason = |error: io::Error| io::Error::from(error.kind());
    builder.prefix(".lamc-").tempfile_in(folder).map_err(reason)
}
