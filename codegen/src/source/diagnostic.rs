//! Diagnostics: where a mistake in the source text is, what is wrong, and how to correct it.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::codes::Code;

/// A half-open range of bytes in the source text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Span {
    /// Index of the first byte.
    pub start: usize,
    /// Index after the last byte.
    pub end: usize,
}

/// A value with its position in the source text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Its position in the source text.
    pub span: Span,
}

/// The text a model was read from, under the name shown in diagnostics.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SourceFile {
    /// Path as the user gave it; `<stdin>` for standard input.
    pub path: String,
    /// The whole text.
    pub text: String,
}

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Severity {
    /// The mechanism cannot be compiled.
    Error,
    /// The mechanism can be compiled, but it may contain a mistake.
    Warning,
    /// Information on what the compiler did.
    Note,
}

/// A message about the source text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Error, warning or note.
    pub severity: Severity,
    /// Stable identifier, such as `unknown-key`.
    pub code: Code,
    /// Message of one line that says what is wrong.
    pub message: String,
    /// Position in the source text; `None` for the file as a whole.
    pub span: Option<Span>,
    /// Short text under the caret.
    pub label: String,
    /// A second, related position with a short text.
    pub also: Option<(Span, String)>,
    /// How to correct the mistake.
    pub hint: Option<String>,
    /// The file that the positions are in, if it is not that of the model: a drawing.
    #[serde(with = "shared")]
    pub file: Option<Arc<SourceFile>>,
    /// The points of a drawing that it is about, in the drawing's units.
    pub points: Vec<[f64; 2]>,
}

/// A file that diagnostics share, serialised as if it were not shared.
mod shared {
    use super::{Arc, Deserialize, SourceFile};
    use serde::{Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(
        file: &Option<Arc<SourceFile>>,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        file.as_deref().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<Option<Arc<SourceFile>>, D::Error> {
        Ok(Option::deserialize(from)?.map(Arc::new))
    }
}

impl Diagnostic {
    /// Creates an error at `span`.
    pub fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self {
            severity: Severity::Error,
            code,
            message: message.into(),
            span: Some(span),
            label: String::new(),
            also: None,
            hint: None,
            file: None,
            points: Vec::new(),
        }
    }

    /// Creates an error that concerns the file as a whole.
    pub fn whole_file(code: Code, message: impl Into<String>) -> Self {
        Self { span: None, ..Self::error(code, Span::default(), message) }
    }

    /// Creates a warning at `span`.
    pub fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, ..Self::error(code, span, message) }
    }

    /// Creates a note at `span`.
    pub fn note(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Note, ..Self::error(code, span, message) }
    }

    /// Adds the text under the caret.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Adds a second, related position.
    pub fn also(mut self, span: Span, label: impl Into<String>) -> Self {
        self.also = Some((span, label.into()));
        self
    }

    /// Adds a hint that says how to correct the mistake.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

/// All diagnostics of one model, reported together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// Adds a diagnostic.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.0.push(diagnostic);
    }

    /// Returns true if at least one diagnostic is an error.
    pub fn has_errors(&self) -> bool {
        self.0.iter().any(|d| d.severity == Severity::Error)
    }
}

impl Extend<Diagnostic> for Diagnostics {
    fn extend<I: IntoIterator<Item = Diagnostic>>(&mut self, diagnostics: I) {
        self.0.extend(diagnostics);
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(diagnostic: Diagnostic) -> Self {
        Self(vec![diagnostic])
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for diagnostic in &self.0 {
            writeln!(f, "{}", diagnostic.message)?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostics {}
