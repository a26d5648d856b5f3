//! Writing files: whole or not at all, and only what changed.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Links to links that are followed, as many as Linux follows.
const MOST_LINKS: usize = 40;

/// Writes a text or bytes to a file, not when they are there already. Links are followed, also to
/// a file that is not there yet; what is no file (a device, a pipe) is written to as it is.
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
            replace(&place(path), contents)
        }
        Ok(found) if !found.is_dir() => {
            fs::OpenOptions::new().write(true).open(path)?.write_all(contents)
        }
        _ => replace(&place(path), contents),
    }
}

/// Where a file is, or would come to be: without links, also such as lead to no file yet. A path
/// through a folder that does not exist stays as it is.
pub fn place(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        let (folder, name) = (folder(&path).to_owned(), path.file_name());
        match (fs::canonicalize(&path), fs::read_link(&path), name) {
            (Ok(found), ..) => return found,
            (_, Ok(link), _) => path = folder.join(link),
            (.., Some(name)) => {
                return fs::canonicalize(folder).map_or(path.clone(), |folder| folder.join(name));
            }
            (.., None) => break,
        }
    }
    path
}

/// The folder a file is in.
pub fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether [`write`](fn@write) can be expected to succeed: to be asked before long work. Nothing is
/// written.
///
/// # Errors
/// The system's.
pub fn probe(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => Ok(()),
        _ => temporary(&place(path)).map(drop),
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
    let folder = folder(path);
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

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_are_followed_to_files_that_are_not_there_yet() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        symlink("b", at("a")).unwrap();
        symlink("../nowhere/c", at("d")).unwrap();
        symlink("e", at("e")).unwrap();
        let there = fs::canonicalize(folder.path()).unwrap();
        assert_eq!(place(&at("a")), there.join("b"));
        write(&at("a"), "text").unwrap();
        assert!(fs::symlink_metadata(at("a")).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(at("b")).unwrap(), "text");
        assert!(write(&at("d"), "text").is_err());
        place(&at("e"));
    }
}
