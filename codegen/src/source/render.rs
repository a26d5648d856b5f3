//! Diagnostics as text: `file:line:column`, the line, a caret and a hint.

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use super::diagnostic::{Diagnostic, Diagnostics, Severity, SourceFile, Span};

/// Columns of a rendered line; longer source lines are trimmed around the caret.
const WIDTH: usize = 100;
/// Largest number of diagnostics in one report: longer reports are not read.
pub(super) const MOST_SHOWN: usize = 100;

impl Diagnostics {
    /// Renders all diagnostics in the order of the file, then those of its drawing, each as a block of
    /// text; `color` is for terminals.
    pub fn render(&self, file: &SourceFile, color: bool) -> String {
        let renderer = if color { Renderer::styled() } else { Renderer::plain() }.term_width(WIDTH);
        let mut ordered: Vec<&Diagnostic> = self.0.iter().collect();
        ordered.sort_by_key(|it| (it.file.is_some(), it.span.map(|span| span.start)));
        let shown = ordered.iter().take(MOST_SHOWN);
        let mut text: String = shown.map(|one| render(one, file, &renderer) + "\n").collect();
        if let Some(more) = ordered.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0) {
            text += &format!("... and {more} more\n");
        }
        text
    }
}

fn render(diagnostic: &Diagnostic, file: &SourceFile, renderer: &Renderer) -> String {
    let file = diagnostic.file.as_deref().unwrap_or(file);
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    };
    let title = level.primary_title(&diagnostic.message).id(diagnostic.code.name);
    let group = match diagnostic.span {
        Some(span) => Group::with_title(title).element(snippet(diagnostic, span, file)),
        None => Group::with_title(title).element(Origin::path(&file.path)),
    };
    let group = match &diagnostic.hint {
        Some(hint) => group.element(Level::HELP.message(hint)),
        None => group,
    };
    renderer.render(&[group]) + "\n"
}

/// Returns the lines that the diagnostic concerns. Only these are rendered, because a file may have
/// thousands of lines.
fn snippet<'a>(
    diagnostic: &'a Diagnostic,
    span: Span,
    file: &'a SourceFile,
) -> Snippet<'a, annotate_snippets::Annotation<'a>> {
    let text = &file.text;
    let span = on_one_line(text, span);
    let also = diagnostic.also.as_ref().map(|(span, label)| (on_one_line(text, *span), label));
    let first = also.as_ref().map_or(span.start, |(also, _)| also.start.min(span.start));
    let last = also.as_ref().map_or(span.end, |(also, _)| also.end.max(span.end));
    let start = text[..first].rfind('\n').map_or(0, |newline| newline + 1);
    let end = text[last..].find('\n').map_or(text.len(), |newline| last + newline);
    let shift = |range: Range<usize>| range.start - start..range.end - start;
    let primary = AnnotationKind::Primary.span(shift(span));
    let primary =
        if diagnostic.label.is_empty() { primary } else { primary.label(&diagnostic.label) };
    let secondary =
        also.map(|(span, label)| AnnotationKind::Context.span(shift(span)).label(label));
    // A carriage return at the end is shown by nothing, unless the mistake is behind it.
    let end = (start + text[start..end].trim_end_matches('\r').len()).max(last);
    Snippet::source(&text[start..end])
        .line_start(text[..start].matches('\n').count() + 1)
        .path(&file.path)
        .annotation(primary)
        .annotations(secondary)
}

/// Returns the part of a span on its first line, moved to character boundaries within the text. A
/// whole entry is marked by its first line.
fn on_one_line(text: &str, span: Span) -> Range<usize> {
    let boundary = |at: usize| (0..=at.min(text.len())).rev().find(|&i| text.is_char_boundary(i));
    let start = boundary(span.start).unwrap_or(0);
    let end = boundary(span.end).unwrap_or(0).max(start);
    let line = text[start..end].find(['\n', '\r']).map_or(end, |newline| start + newline);
    start..line
}
