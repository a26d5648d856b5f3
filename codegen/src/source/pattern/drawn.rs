//! A drawing that was read: its text, its lines and its planar graph.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use lamc_drawings::{Cause, Drawing, Fault, Format, Pattern, Place, Reading};

use super::faults;
use crate::arithmetic::hypot;
use crate::source::codes::{self, Code};
use crate::source::diagnostic::{Diagnostic, Diagnostics, Severity, SourceFile, Span};
use crate::source::rounding::LARGEST_SHARE;

/// Largest drawing, bytes: 64 MiB. A hundred thousand lines have some ten.
pub const MAX_DRAWING_BYTES: usize = 64 << 20;

/// A drawing with its planar graph.
pub struct Drawn {
    /// Its text, in which diagnostics have their places.
    pub file: Arc<SourceFile>,
    /// Whether the text is what the file holds, and not a file in binary form.
    is_text: bool,
    /// Its lines.
    pub drawing: Drawing,
    /// The planar graph.
    pub pattern: Pattern,
    /// The tolerance that was given, in units of the drawing.
    tolerance: Option<f64>,
}

/// The bytes of a drawing, and the path under which diagnostics show it.
pub(in crate::source) struct Bytes {
    pub path: String,
    pub bytes: Vec<u8>,
}

impl Bytes {
    /// Reads the file of a drawing.
    ///
    /// # Errors
    /// A message of one line.
    pub fn read(path: &Path) -> Result<Self, String> {
        let shown = path.display().to_string();
        let failed = |error: std::io::Error| format!("cannot read {shown}: {error}");
        let file = File::open(path).map_err(failed)?;
        // Reading a device or a pipe might never end.
        if !file.metadata().map_err(failed)?.is_file() {
            return Err(format!("{shown} is no file"));
        }
        let mut bytes = Vec::new();
        file.take(MAX_DRAWING_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
        if bytes.len() > MAX_DRAWING_BYTES {
            let most = MAX_DRAWING_BYTES >> 20;
            return Err(format!(
                "{shown} is larger than {most} MiB, the largest drawing that lamc reads"
            ));
        }
        Ok(Self { path: shown, bytes })
    }
}

/// A drawing that has no planar graph.
pub(in crate::source) struct Unusable {
    /// What is wrong, in its text.
    pub found: Diagnostics,
    /// Its lines.
    pub drawing: Drawing,
}

/// The lines of a drawing, before their planar graph is made.
pub(in crate::source) struct Lines {
    file: Arc<SourceFile>,
    is_text: bool,
    pub drawing: Drawing,
}

impl Lines {
    /// Reads the lines of a drawing in any of the formats.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub fn read(Bytes { path, bytes }: &Bytes, reading: &Reading) -> Result<Self, Diagnostics> {
        let (file, is_text) = as_text(path, bytes);
        let read = match Format::of(path, bytes) {
            Some(format) => lamc_drawings::read(format, bytes, reading),
            None => Err(vec![Fault {
                cause: Cause::Syntax,
                message: format!("{path} is no drawing that lamc reads"),
                place: None,
                at: Vec::new(),
                hint: Some("save it as SVG, FOLD or DXF".into()),
            }]),
        };
        match read {
            Ok(drawing) => Ok(Self { file, is_text, drawing }),
            Err(wrong) => Err(faults::errors(&wrong, &file, is_text)),
        }
    }

    /// Makes the planar graph, in which points are mended by no more than `tolerance`, in units of the
    /// drawing; without it, by a part of the size of the drawing.
    ///
    /// # Errors
    /// What is wrong with the drawing, with its lines.
    pub fn drawn(self, tolerance: Option<f64>) -> Result<Drawn, Box<Unusable>> {
        let Self { file, is_text, drawing } = self;
        match Pattern::of(&drawing, tolerance) {
            Ok(pattern) => Ok(Drawn { file, is_text, drawing, pattern, tolerance }),
            Err(faults) => {
                let found = faults::errors(&faults, &file, is_text);
                Err(Box::new(Unusable { found, drawing }))
            }
        }
    }
}

impl Drawn {
    /// How far hinge lines may be moved, in units of the drawing: as far as was given, or a ten-thousandth
    /// of its size. A point that the mending moved is where all its lines meet.
    pub(in crate::source) fn tolerance(&self) -> f64 {
        self.tolerance.unwrap_or(LARGEST_SHARE * self.across())
    }

    /// The diagonal of the drawing, in its units.
    pub(super) fn across(&self) -> f64 {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for vertex in &self.pattern.vertices {
            for axis in 0..2 {
                low[axis] = low[axis].min(vertex[axis]);
                high[axis] = high[axis].max(vertex[axis]);
            }
        }
        hypot(high[0] - low[0], high[1] - low[1])
    }

    /// A diagnostic in the drawing.
    pub(super) fn finding(
        &self,
        severity: Severity,
        code: Code,
        place: Option<Place>,
        message: String,
    ) -> Diagnostic {
        let place = place.filter(|_| self.is_text);
        let span = place.map(|Place { start, end }| Span { start, end });
        let file = Some(self.file.clone());
        Diagnostic { severity, span, file, ..Diagnostic::whole_file(code, message) }
    }

    /// What was mended, what is doubtful, and what was not read.
    pub fn notes(&self) -> Diagnostics {
        let mut notes = faults::doubts(&self.pattern.doubts, &self.file, self.is_text);
        for mended in &self.pattern.mended {
            let message = mended.message.clone();
            let note = self.finding(Severity::Note, codes::MENDED, Some(mended.place), message);
            notes.push(note.at(mended.at.clone()));
        }
        for ignored in &self.drawing.ignored {
            let message = match ignored.count {
                1 => format!("`{}` is no line of the pattern", ignored.what),
                count => format!("{count} x `{}` are no lines of the pattern", ignored.what),
            };
            let note = self.finding(Severity::Note, codes::IGNORED, Some(ignored.place), message);
            notes.push(note.label("ignored"));
        }
        notes
    }
}

/// Returns the text in which places are shown, and whether it is a text at all. Bytes that are not
/// UTF-8 are shown as `?`, each as one, so that places stay right.
fn as_text(path: &str, bytes: &[u8]) -> (Arc<SourceFile>, bool) {
    let is_text = !bytes.contains(&0);
    let text = match std::str::from_utf8(bytes) {
        _ if !is_text => String::new(),
        Ok(text) => text.to_owned(),
        Err(_) => {
            let shown = |byte: &u8| if byte.is_ascii() { char::from(*byte) } else { '?' };
            bytes.iter().map(shown).collect()
        }
    };
    (Arc::new(SourceFile { path: path.to_owned(), text }), is_text)
}
