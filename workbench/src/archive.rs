//! ZIP archives of texts, such as FMUs.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Returns the bytes of a ZIP archive; each file is given by its path in the archive and its text. Equal files
/// give equal bytes, because the archive contains neither the time nor the machine.
///
/// # Panics
/// If a path or a text has 4 GiB or more, or if there are 65,536 files or more: such archives need
/// another format.
pub fn pack(files: &[(String, String)]) -> Vec<u8> {
    match try_pack(files) {
        Ok(bytes) => bytes,
        Err(error) => panic!("the files do not fit an archive: {error}"),
    }
}

fn try_pack(files: &[(String, String)]) -> zip::result::ZipResult<Vec<u8>> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (path, text) in files {
        archive.start_file(path.as_str(), options)?;
        archive.write_all(text.as_bytes())?;
    }
    Ok(archive.finish()?.into_inner())
}
