//! The keys of a mapping: no key stands twice, and merge keys are followed.
//!
//! Merge keys (YAML 1.1): `<<: *anchor` or `<<: [*one, *other]` stands for the entries of other
//! mappings.
//!
//! A key that the mapping has itself wins, then the mapping that comes first in the list. Merged
//! entries stand where `<<` does: the order of joints is the order of coordinates.

use std::collections::{HashMap, HashSet};

use super::{Content, Entry, Node};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, Span, Spanned};

/// Puts the entries that the merge key at `at` stands for in its place.
pub(super) fn entries_of(entries: &mut Vec<Entry>, at: usize, diagnostics: &mut Diagnostics) {
    let Entry { key, value } = entries.remove(at);
    let mut known: HashSet<String> = entries.iter().map(|entry| entry.key.value.clone()).collect();
    let sources = match value.content {
        Content::Sequence(items) => items,
        content => vec![Node { content, ..value }],
    };
    let mut merged = Vec::new();
    for source in sources {
        let Content::Mapping(given) = source.content else {
            // The value may stand elsewhere: the key is what is wrong here.
            diagnostics.push(
                Diagnostic::error(
                    codes::BAD_MERGE,
                    key.span,
                    "`<<` takes a mapping, or a list of them",
                )
                .label("merges something else")
                .also(source.span, format!("this is {}", source.describe()))
                .hint("write `<<: *name`, with `&name` in front of the mapping that is meant"),
            );
            break;
        };
        merged.extend(given.into_iter().filter(|entry| known.insert(entry.key.value.clone())));
    }
    entries.splice(at..at, merged);
}

/// Drops the second of two equal keys, and reports it.
pub(super) fn distinct(entries: Vec<Entry>, diagnostics: &mut Diagnostics) -> Vec<Entry> {
    let mut seen: HashMap<String, Span> = HashMap::with_capacity(entries.len());
    let mut kept = Vec::with_capacity(entries.len());
    for entry in entries {
        let Spanned { value: key, span } = &entry.key;
        if let Some(&first) = seen.get(key) {
            let error =
                Diagnostic::error(codes::DUPLICATE_KEY, *span, format!("`{key}` stands twice"));
            diagnostics.push(error.label("second time").also(first, "first time"));
            continue;
        }
        seen.insert(key.clone(), *span);
        kept.push(entry);
    }
    kept
}
