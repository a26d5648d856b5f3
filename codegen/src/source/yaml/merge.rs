//! Merge keys (YAML 1.1): `<<: *anchor` or `<<: [*one, *other]` stands for the entries of other
//! mappings.
//!
//! A key that the mapping has itself wins, then the mapping that comes first in the list. Merged
//! entries stand where `<<` does: the order of joints is the order of coordinates.

use std::collections::HashSet;

use super::{Content, Entry, Node};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics};

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
