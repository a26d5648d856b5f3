//! The keys of a mapping: each key must be unique, and merge keys are expanded.
//!
//! Merge keys (YAML 1.1): `<<: *anchor` or `<<: [*one, *other]` inserts the entries of other
//! mappings.
//!
//! A key of the mapping itself has precedence, then the mapping that comes first in the list.
//! Merged entries take the position of `<<`, because the order of joints is the order of
//! coordinates.

use std::collections::{HashMap, HashSet};

use super::{Content, Entry, Node, shorten};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, Span, Spanned};

/// Replaces the merge key at `at` by the entries that it inserts.
pub(super) fn entries_of(entries: &mut Vec<Entry>, at: usize, diagnostics: &mut Diagnostics) {
    let Entry { key, value, .. } = entries.remove(at);
    let mut known: HashSet<String> = entries.iter().map(|entry| entry.key.value.clone()).collect();
    let sources = match value.content {
        Content::Sequence(items) => items,
        content => vec![Node { content, ..value }],
    };
    let mut merged = Vec::new();
    for source in sources {
        let Content::Mapping(given) = source.content else {
            // The value may be at another position; the mistake here is the key.
            diagnostics.push(
                Diagnostic::error(
                    codes::BAD_MERGE,
                    key.span,
                    "`<<` takes a mapping, or a list of them",
                )
                .label("its value is something else")
                .also(source.span, format!("this is {}", source.describe()))
                .hint("write `<<: *name`, with `&name` in front of the mapping"),
            );
            break;
        };
        merged.extend(given.into_iter().filter(|entry| known.insert(entry.key.value.clone())));
    }
    entries.splice(at..at, merged);
}

/// Drops the second of two equal keys and reports it.
pub(super) fn distinct(entries: Vec<Entry>, diagnostics: &mut Diagnostics) -> Vec<Entry> {
    let mut seen: HashMap<String, Span> = HashMap::with_capacity(entries.len());
    let mut kept = Vec::with_capacity(entries.len());
    for entry in entries {
        let Spanned { value: key, span } = &entry.key;
        if let Some(&first) = seen.get(key) {
            let error = Diagnostic::error(
                codes::DUPLICATE_KEY,
                *span,
                format!("duplicate key `{}`", shorten(key)),
            );
            diagnostics.push(error.label("second time").also(first, "first time"));
            continue;
        }
        seen.insert(key.clone(), *span);
        kept.push(entry);
    }
    kept
}
