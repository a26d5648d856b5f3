//! Faults of drawings as diagnostics.

use std::sync::Arc;

use lamc_drawings::{Cause, Fault, Mark, MarkKind};

use crate::source::codes::{self, Code};
use crate::source::diagnostic::{Diagnostic, Diagnostics, Severity, SourceFile, Span};

/// Largest number of points that a diagnostic lists.
const MOST_POINTS: usize = 4;

/// The code of each cause.
fn code(cause: Cause) -> Code {
    match cause {
        Cause::Syntax => codes::DRAWING_SYNTAX,
        Cause::Number => codes::DRAWING_NUMBER,
        Cause::Limit => codes::DRAWING_LIMIT,
        Cause::Empty => codes::EMPTY_DRAWING,
        Cause::OpenOutline => codes::OPEN_OUTLINE,
        Cause::Contradiction => codes::CONTRADICTION,
        Cause::Dangling => codes::DANGLING_LINE,
        Cause::Thin => codes::THIN_FACET,
        Cause::Rim => codes::CREASED_RIM,
        Cause::Layers => codes::UNUSED_LAYERS,
    }
}

/// What makes a drawing unusable.
pub(super) fn errors(faults: &[Fault], file: &Arc<SourceFile>, is_text: bool) -> Diagnostics {
    diagnostics(Severity::Error, faults, file, is_text)
}

/// What is doubtful about a drawing.
pub(super) fn doubts(faults: &[Fault], file: &Arc<SourceFile>, is_text: bool) -> Diagnostics {
    diagnostics(Severity::Warning, faults, file, is_text)
}

fn diagnostics(
    severity: Severity,
    faults: &[Fault],
    file: &Arc<SourceFile>,
    is_text: bool,
) -> Diagnostics {
    let diagnostic = |fault: &Fault| {
        let place = fault.place.filter(|_| is_text);
        Diagnostic {
            severity,
            span: place.map(|place| Span { start: place.start, end: place.end }),
            file: Some(file.clone()),
            hint: fault.hint.clone(),
            ..Diagnostic::whole_file(code(fault.cause), &fault.message)
        }
        .at(fault.at.clone())
    };
    Diagnostics(faults.iter().map(diagnostic).collect())
}

impl Diagnostic {
    /// Adds the points that it is about, of which the message lists some.
    pub(super) fn at(self, points: Vec<[f64; 2]>) -> Self {
        Self { message: placed(&self.message, &points), points, ..self }
    }

    /// The mark of a picture that shows what is wrong with a drawing.
    pub(super) fn mark(&self) -> Mark {
        let kind = match self.severity {
            Severity::Error => MarkKind::Error,
            Severity::Warning => MarkKind::Warning,
            Severity::Note => MarkKind::Note,
        };
        Mark {
            kind,
            message: self.message.clone(),
            hint: self.hint.clone(),
            at: self.points.clone(),
        }
    }
}

/// A message with the points that it is about: `2 ends were joined, at (12.5, 30), (40, 30)`.
fn placed(message: &str, points: &[[f64; 2]]) -> String {
    if points.is_empty() {
        return message.to_owned();
    }
    let some: Vec<String> = points.iter().take(MOST_POINTS).map(|point| shown(*point)).collect();
    // The message may say it already.
    if some.iter().all(|point| message.contains(point.as_str())) {
        return message.to_owned();
    }
    let more = match points.len().saturating_sub(MOST_POINTS) {
        0 => String::new(),
        1 => " and 1 more point".into(),
        more => format!(" and {more} more points"),
    };
    format!("{message}, at {}{more}", some.join(", "))
}

/// A point with the digits that a reader can use: `(12.5, -30)`.
pub(super) fn shown(point: [f64; 2]) -> String {
    let [x, y] = point.map(|value| {
        let text = format!("{value:.4}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    });
    format!("({x}, {y})")
}
