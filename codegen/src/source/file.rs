//! Reading the source text from a file or standard input.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::diagnostic::SourceFile;
use super::{codes, yaml};

/// Largest source text, bytes: 16 MiB. The largest published design has 23 kB.
pub const MAX_FILE_BYTES: usize = 16 << 20;

/// Name of standard input in diagnostics.
const STDIN: &str = "<stdin>";

/// Why a source file could not be read.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The operating system reported an error.
    #[error("cannot read {path}: {source}")]
    Io {
        /// Path as the user gave it.
        path: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is longer than lamc reads such a file, [`MAX_FILE_BYTES`] for a model.
    #[error(
        "{path}:{line}:{column}: [{}] the file is larger than {} MiB, the largest size that lamc reads",
        codes::FILE_TOO_LARGE,
        limit >> 20
    )]
    TooLarge {
        /// Path as the user gave it.
        path: String,
        /// Line of the first byte that is not read, counted from 1.
        line: usize,
        /// Column of that byte in characters, counted from 1.
        column: usize,
        /// Most bytes of such a file.
        limit: usize,
    },
    /// The file is not UTF-8 text.
    #[error(
        "{path}:{line}:{column}: [{}] not UTF-8 text (byte 0x{byte:02x}); save the file as UTF-8",
        codes::NOT_UTF8
    )]
    NotUtf8 {
        /// Path as the user gave it.
        path: String,
        /// Line of the first invalid byte, counted from 1.
        line: usize,
        /// Column of that byte in characters, counted from 1.
        column: usize,
        /// The invalid byte.
        byte: u8,
    },
}

impl SourceFile {
    /// Reads a model from `path`; `-` is standard input, shown as `<stdin>`. A byte order mark is dropped.
    pub fn read(path: &str) -> Result<Self, ReadError> {
        Self::read_at_most(path, MAX_FILE_BYTES)
    }

    /// As [`read`](Self::read), for a file of at most `limit` bytes.
    pub fn read_at_most(path: &str, limit: usize) -> Result<Self, ReadError> {
        let name = if path == "-" { STDIN } else { path };
        let io = |source| ReadError::Io { path: name.into(), source };
        let reader: Box<dyn Read> = if path == "-" {
            Box::new(std::io::stdin())
        } else {
            Box::new(File::open(path).map_err(io)?)
        };
        let mut bytes = Vec::new();
        reader.take(limit as u64 + 1).read_to_end(&mut bytes).map_err(io)?;
        if bytes.len() > limit {
            let (line, column) = place(&bytes[..limit]);
            return Err(ReadError::TooLarge { path: name.into(), line, column, limit });
        }
        let text = String::from_utf8(bytes).map_err(|error| not_utf8(name, &error))?;
        let text = text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text);
        Ok(Self { path: name.into(), text })
    }

    /// Returns the name of the file without folders; `<stdin>` for standard input.
    pub fn name(&self) -> &str {
        self.path.rsplit(['/', '\\']).next().unwrap_or_default()
    }

    /// Returns the path of a file that this one names: it is relative to the folder of this one.
    pub fn beside(&self, path: &str) -> PathBuf {
        match Path::new(&self.path).parent() {
            Some(folder) => folder.join(path),
            None => path.into(),
        }
    }

    /// Returns the files besides this one from which a model is made: the drawing of its `pattern`. They are also
    /// known if the model or the drawing has mistakes.
    pub fn others(&self) -> Vec<PathBuf> {
        let Ok((root, _)) = yaml::parse(&self.text) else { return Vec::new() };
        let file = root.get("pattern").and_then(|pattern| pattern.get("file"));
        let path = file.and_then(|file| file.scalar()).map(|path| self.beside(&path.text));
        path.into_iter().collect()
    }

    /// Returns an identifier made from the file's stem: `designs/4th_Design.cad.joints` ->
    /// `m4th_Design`.
    pub fn module_name(&self) -> String {
        super::names::identifier_from(self.stem())
    }

    /// Returns the file's stem without extensions: `designs/4th_Design.cad.joints` -> `4th_Design`.
    pub fn stem(&self) -> &str {
        if self.path == STDIN {
            return "model";
        }
        let mut stem = self.name();
        while let Some((rest, "yaml" | "yml" | "joints" | "cad" | "svg" | "fold" | "dxf")) =
            stem.rsplit_once('.')
        {
            stem = rest;
        }
        stem
    }
}

fn not_utf8(path: &str, error: &std::string::FromUtf8Error) -> ReadError {
    let at = error.utf8_error().valid_up_to();
    let (line, column) = place(&error.as_bytes()[..at]);
    ReadError::NotUtf8 { path: path.into(), line, column, byte: error.as_bytes()[at] }
}

/// Returns the line and the column, in characters, of the byte after these.
fn place(before: &[u8]) -> (usize, usize) {
    let before = String::from_utf8_lossy(before);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn read(bytes: &[u8]) -> Result<SourceFile, ReadError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(bytes).unwrap();
        SourceFile::read(file.path().to_str().unwrap())
    }

    #[test]
    fn bad_bytes_are_located() {
        let error = read(b"name: a\ngr\xc3\xb6\xdfe: 1\n").unwrap_err();
        assert!(
            matches!(error, ReadError::NotUtf8 { line: 2, column: 4, byte: 0xdf, .. }),
            "{error}"
        );
    }

    #[test]
    fn the_byte_order_mark_is_dropped() {
        assert_eq!(read(b"\xef\xbb\xbfname: a").unwrap().text, "name: a");
    }

    #[test]
    fn a_file_of_the_limit_is_read_and_one_byte_more_is_not() {
        assert!(read(&vec![b'#'; MAX_FILE_BYTES]).is_ok());
        let mut bytes = vec![b'#'; MAX_FILE_BYTES + 1];
        bytes[MAX_FILE_BYTES - 3] = b'\n';
        let error = read(&bytes).unwrap_err();
        assert!(matches!(error, ReadError::TooLarge { line: 2, column: 3, .. }), "{error}");
        let says = ":2:3: [file-too-large] the file is larger than 16 MiB, the largest size that lamc reads";
        assert!(error.to_string().ends_with(says), "{error}");
    }

    #[test]
    fn a_drawing_is_a_file_of_the_model() {
        for (text, expected) in [
            ("pattern: { file: sheet.svg }", vec!["robots/sheet.svg"]),
            ("pattern: { file: ../sheet.svg, scale: none }", vec!["robots/../sheet.svg"]),
            ("pattern: { scale: 1 mm }", vec![]),
            ("pattern: [", vec![]),
        ] {
            let file = SourceFile { path: "robots/m.yaml".into(), text: text.into() };
            assert_eq!(file.others(), expected.into_iter().map(PathBuf::from).collect::<Vec<_>>());
        }
        let file = SourceFile { path: STDIN.into(), text: String::new() };
        assert_eq!(file.beside("sheet.svg"), PathBuf::from("sheet.svg"));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = SourceFile::read("nowhere/robot.yaml").unwrap_err().to_string();
        assert!(error.starts_with("cannot read nowhere/robot.yaml: "), "{error}");
    }
}
