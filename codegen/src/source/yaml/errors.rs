//! Errors of the reader: what the parser found, and the limits on size and depth.

use serde_saphyr::granit_parser::{ErrorKind, ScanError};

use super::{MAX_DEPTH, MAX_NODES, Open};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, Span};

/// Converts an error of the parser, with its position.
pub(super) fn syntax_error(text: &str, error: &ScanError, open: &[Open]) -> Diagnostics {
    let at = error.marker().byte_offset().unwrap_or(text.len()).min(text.len());
    let next = text.get(at..).and_then(|rest| rest.chars().next());
    let width = next.filter(|c| !matches!(c, '\n' | '\r')).map_or(0, char::len_utf8);
    let span = Span { start: at, end: at + width };
    if *error.kind() == ErrorKind::RecursionLimitExceeded {
        return too_deep(span).into();
    }
    if *error.kind() == ErrorKind::UnknownAnchor {
        return Diagnostic::error(codes::UNKNOWN_ALIAS, span, "this alias has no anchor before it")
            .hint("write `&name` in front of the value that `*name` refers to")
            .into();
    }
    let message = format!("not valid YAML: {}", error.info());
    let found =
        Diagnostic::error(codes::YAML_SYNTAX, span, message).label("the parser stopped here");
    match open.last().filter(|open| open.flow) {
        // The end of this is missing; it often begins several lines above.
        Some(Open { start, .. }) => {
            found.also(Span { start: *start, end: start + 1 }, "opened here").into()
        }
        None => found.into(),
    }
}

/// The error for a text that is nested too deeply.
pub(super) fn too_deep(span: Span) -> Diagnostic {
    Diagnostic::error(codes::TOO_DEEP, span, format!("nested more than {MAX_DEPTH} levels deep"))
        .hint("a model needs about ten")
}

/// The error for a text that has too many values.
pub(super) fn too_many(at: Span) -> Diagnostics {
    Diagnostic::error(
        codes::TOO_LARGE,
        at,
        format!("the file expands to more than {MAX_NODES} values"),
    )
    .hint("aliases of aliases multiply: write the values out")
    .into()
}
