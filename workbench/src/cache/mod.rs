//! Derived models on disk: the second command on a model starts in milliseconds.
//!
//! An entry is a file whose name is a hash of the model, of everything that the user changed in it, and of
//! this build of lamc. It holds the model's [`Derived`] as bytes, with a checksum. Entries appear whole, by a
//! rename, so that processes may read, write and remove them at the same time. A model whose entry is damaged is derived
//! anew. No problem of the cache is an error of the command: a folder that cannot be read or written is as if it
//! were empty.
//!
//! [`Derived`]: lamc::pipeline::Derived

#[cfg(test)]
mod tests;

use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use directories::ProjectDirs;
use lamc::files;
use lamc::pipeline::{CompileError, Derived, Read};
use sha2::{Digest, Sha256};

/// Most bytes of all entries. The entry of a sheet of 100 facets has some megabytes.
const MOST_BYTES: u64 = 512 << 20;

/// A folder of derived models.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
    /// Identifies this build of lamc.
    compiler: [u8; 32],
    most_bytes: u64,
}

impl Cache {
    /// Returns the cache of the user: `lamc/models` in `$XDG_CACHE_HOME` or `~/.cache`, in `~/Library/Caches` on
    /// macOS, in `%LOCALAPPDATA%` on Windows. Returns nothing if there is no such folder, or if this build of lamc cannot
    /// be identified.
    pub fn of_user() -> Option<Self> {
        let folder = ProjectDirs::from("", "", "lamc")?.cache_dir().join("models");
        Self::at(folder, MOST_BYTES)
    }

    /// Returns the cache in a folder, which need not exist, of at most so many bytes.
    pub fn at(folder: PathBuf, most_bytes: u64) -> Option<Self> {
        Some(Self { folder, compiler: compiler().ok()?, most_bytes })
    }

    /// Returns what is derived from a model: from the cache, or else by `derive`, after which the cache has it.
    ///
    /// # Errors
    /// Those of `derive`.
    pub fn derived(
        &self,
        read: &Read<'_>,
        derive: impl FnOnce() -> Result<Derived, CompileError>,
    ) -> Result<Derived, CompileError> {
        let key = self.key(read);
        if let Some(known) = self.get(&key) {
            return Ok(known);
        }
        let derived = derive()?;
        // Without the entry, the next command takes as long as this one.
        let _ = self.put(&key, &derived);
        Ok(derived)
    }

    fn key(&self, read: &Read<'_>) -> [u8; 32] {
        Sha256::new().chain_update(self.compiler).chain_update(read.fingerprint()).finalize().into()
    }

    fn path(&self, key: &[u8; 32]) -> PathBuf {
        let name: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
        self.folder.join(name)
    }

    fn get(&self, key: &[u8; 32]) -> Option<Derived> {
        let path = self.path(key);
        let derived = Derived::from_bytes(&fs::read(&path).ok()?, key).ok()?;
        // Those that were not used for longest go first. If the time cannot be written, they go by age.
        let _ = File::options()
            .append(true)
            .open(path)
            .and_then(|file| file.set_modified(SystemTime::now()));
        Some(derived)
    }

    fn put(&self, key: &[u8; 32], derived: &Derived) -> io::Result<()> {
        let bytes = derived.to_bytes(key);
        if bytes.len() as u64 > self.most_bytes {
            return Ok(());
        }
        fs::create_dir_all(&self.folder)?;
        files::write(&self.path(key), &bytes)?;
        keep_within(&self.folder, self.most_bytes)
    }
}

/// Identifies the build of lamc that runs, by its file. While lamc is developed, its version stays the same.
fn compiler() -> io::Result<[u8; 32]> {
    let path = std::env::current_exe()?;
    let found = fs::metadata(&path)?;
    let built =
        found.modified()?.duration_since(SystemTime::UNIX_EPOCH).map_err(io::Error::other)?;
    let identity = format!(
        "{} {} {} {}",
        env!("CARGO_PKG_VERSION"),
        path.display(),
        found.len(),
        built.as_nanos()
    );
    Ok(Sha256::digest(identity).into())
}

/// Removes the files that were not used for longest, until the folder has at most so many bytes. Files that a
/// killed process left half written are removed like entries.
fn keep_within(folder: &Path, most_bytes: u64) -> io::Result<()> {
    let known = |entry: fs::DirEntry| -> Option<(SystemTime, u64, PathBuf)> {
        let found = entry.metadata().ok().filter(Metadata::is_file)?;
        Some((found.modified().ok()?, found.len(), entry.path()))
    };
    let mut entries: Vec<_> = fs::read_dir(folder)?.flatten().filter_map(known).collect();
    entries.sort();
    let mut bytes: u64 = entries.iter().map(|(_, length, _)| length).sum();
    for (_, length, path) in entries {
        if bytes <= most_bytes {
            break;
        }
        // Another process may have removed it.
        let _ = fs::remove_file(path);
        bytes -= length;
    }
    Ok(())
}
