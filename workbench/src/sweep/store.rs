//! Where the results of a sweep are kept: finished parts in a folder beside the file, and at the end the file.
//!
//! A part is written under another name and renamed, and so is the file. Whenever the process is killed, what is there is
//! whole; what is not there is computed again, with the same values.

use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use arrow_array::RecordBatch;
use arrow_schema::SchemaRef;
use arrow_select::concat::concat_batches;
use lamc::files;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use thiserror::Error;

use super::table::{as_io, writer};

/// The key under which a file says of which sweep it is.
const FINGERPRINT: &str = "lamc.sweep";
/// The key under which a file has its plan.
const PLAN: &str = "lamc.plan";

/// Why results cannot be kept.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The folder has parts of an earlier sweep.
    #[error(
        "`{0}` has parts of a sweep that was not finished: continue it with --resume, or remove the folder"
    )]
    Unfinished(String),
    /// What is there is not of this sweep.
    #[error(
        "`{0}` is of another sweep (another model, other parameters, another plan, another shard or another \
         release of lamc): it cannot be resumed"
    )]
    Another(String),
    /// Somebody else writes.
    #[error("another process is writing `{0}`")]
    Busy(String),
    /// The system's reason.
    #[error("cannot write `{0}`: {1}")]
    Failed(String, io::Error),
}

/// The results of one sweep.
pub struct Store {
    file: PathBuf,
    folder: PathBuf,
    schema: SchemaRef,
    fingerprint: String,
    plan: String,
    parts: usize,
    parts_of_a_group: usize,
    /// Held as long as this process writes.
    _lock: File,
}

/// What there is of a sweep.
pub enum Opened {
    /// Nothing, or some parts.
    Begun(Store),
    /// All of it.
    Complete,
}

/// What a file of results says of itself.
pub struct Description<'d> {
    /// Its columns.
    pub schema: SchemaRef,
    /// Of model, plan, shard and release: results of sweeps with the same fingerprint are the same.
    pub fingerprint: &'d str,
    /// The text of the plan.
    pub plan: &'d str,
    /// Parts of the sweep.
    pub parts: usize,
    /// Parts whose rows make a row group of the file.
    pub parts_of_a_group: usize,
}

impl Store {
    /// Begins to keep results for a file, or goes on.
    ///
    /// # Errors
    /// If there are results of an unfinished or another sweep, or the folder cannot be written.
    pub fn open(file: &Path, about: &Description, resumes: bool) -> Result<Opened, StoreError> {
        let file = files::place(file);
        let mut name = file.file_name().unwrap_or_default().to_owned();
        name.push(".parts");
        let folder = files::folder(&file).join(name);
        let shown = folder.display().to_string();
        let failed = |error| StoreError::Failed(shown.clone(), error);
        if resumes && !folder.exists() && file.exists() {
            return match fingerprint(&file).is_some_and(|found| found == about.fingerprint) {
                true => Ok(Opened::Complete),
                false => Err(StoreError::Another(file.display().to_string())),
            };
        }
        if folder.exists() && !resumes {
            return Err(StoreError::Unfinished(shown));
        }
        files::probe(&file)
            .map_err(|error| StoreError::Failed(file.display().to_string(), error))?;
        match fs::create_dir(&folder) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                return Err(failed(error));
            }
            _ => {}
        }
        let lock = File::create(folder.join("lock")).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(StoreError::Busy(shown)),
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let label = folder.join("sweep");
        match fs::read_to_string(&label) {
            Ok(found) if found != about.fingerprint => return Err(StoreError::Another(shown)),
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                files::write(&label, about.fingerprint).map_err(failed)?;
            }
            Err(error) => return Err(failed(error)),
        }
        Ok(Opened::Begun(Self {
            file,
            folder,
            schema: about.schema.clone(),
            fingerprint: about.fingerprint.to_owned(),
            plan: about.plan.to_owned(),
            parts: about.parts,
            parts_of_a_group: about.parts_of_a_group,
            _lock: lock,
        }))
    }

    /// The parts that are not there yet, ascending.
    pub fn missing(&self) -> Vec<usize> {
        // To look at a name in the list is much faster than to open what is not there.
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let there: HashSet<PathBuf> = entries.map(|entry| entry.path()).collect();
        let is_there = |part| there.contains(&self.path(part)) && self.read(part).is_ok();
        (0..self.parts).filter(|part| !is_there(*part)).collect()
    }

    /// Keeps the bytes of a part.
    ///
    /// # Errors
    /// The system's.
    pub fn keep(&self, part: usize, bytes: &[u8]) -> Result<(), StoreError> {
        let path = self.path(part);
        files::write(&path, bytes)
            .map_err(|error| StoreError::Failed(path.display().to_string(), error))
    }

    /// Writes the file from all parts, and removes them.
    ///
    /// # Errors
    /// The system's, also if a part is missing. The parts stay.
    pub fn join(self) -> Result<(), StoreError> {
        let failed = |error| StoreError::Failed(self.file.display().to_string(), error);
        let whole = self.folder.join("whole");
        self.write(&whole).map_err(failed)?;
        fs::rename(&whole, &self.file).map_err(failed)?;
        fs::remove_dir_all(&self.folder).map_err(failed)
    }

    fn write(&self, whole: &Path) -> io::Result<()> {
        let notes = [(FINGERPRINT, self.fingerprint.as_str()), (PLAN, &self.plan)];
        let file = File::create(whole)?;
        let mut writer = writer(file, self.schema.clone(), &notes).map_err(as_io)?;
        for first in (0..self.parts).step_by(self.parts_of_a_group) {
            let last = (first + self.parts_of_a_group).min(self.parts);
            let parts =
                (first..last).map(|part| self.read(part)).collect::<io::Result<Vec<_>>>()?;
            let group = concat_batches(&self.schema, &parts).map_err(io::Error::other)?;
            writer.write(&group).and_then(|()| writer.flush()).map_err(as_io)?;
        }
        writer.into_inner().map_err(as_io)?.sync_all()
    }

    fn read(&self, part: usize) -> io::Result<RecordBatch> {
        let file = File::open(self.path(part))?;
        let reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(as_io)?;
        let batches = reader.build().map_err(as_io)?.collect::<Result<Vec<_>, _>>();
        concat_batches(&self.schema, &batches.map_err(io::Error::other)?).map_err(io::Error::other)
    }

    fn path(&self, part: usize) -> PathBuf {
        self.folder.join(format!("{part:08}.parquet"))
    }
}

/// Which sweep a file is of.
fn fingerprint(file: &Path) -> Option<String> {
    let reader = SerializedFileReader::new(File::open(file).ok()?).ok()?;
    let notes = reader.metadata().file_metadata().key_value_metadata()?;
    notes.iter().find(|note| note.key == FINGERPRINT)?.value.clone()
}
