//! The keys of one mapping, read according to its table: unknown keys and missing required keys are
//! errors.

use super::codes;
use super::diagnostic::{Diagnostic, Diagnostics, Span};
use super::names::{hint, quote_list};
use super::schema::{Key, Mapping, Presence, Value};
use super::yaml::{Content, Entry, Node, shorten};

/// A mapping of the file, with the table of its keys.
pub struct Fields<'n> {
    entries: &'n [Entry],
    table: &'static Mapping,
    /// Position at which a missing key is reported.
    at: Span,
    /// What the mapping describes, such as "joint `j0`".
    owner: String,
}

impl<'n> Fields<'n> {
    /// Checks that `node` is a mapping with keys of the table only. Keys that `owner` lacks are
    /// reported at `at`.
    pub fn new(
        node: &'n Node,
        at: Span,
        owner: impl Into<String>,
        table: &'static Mapping,
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        let (owner, known) = (owner.into(), table.names());
        let Content::Mapping(entries) = &node.content else {
            let message = format!("{owner} must be a mapping of {}", quote_list(&known));
            let error = Diagnostic::error(
                codes::WRONG_TYPE,
                if node.is_null() { at } else { node.span },
                message,
            );
            diagnostics.push(error.label(format!("this is {}", node.describe())));
            return None;
        };
        for Entry { key, value, .. } in entries {
            if !known.contains(&key.value.as_str()) {
                let hint = hint(diagnostics.0.len(), &key.value, || known.clone(), "keys");
                let message = format!("unknown key `{}`", shorten(&key.value));
                let error = Diagnostic::error(codes::UNKNOWN_KEY, key.span, message)
                    .label(format!("{owner} has no such key"));
                diagnostics.push(Diagnostic { hint, ..error });
            } else if value.is_null() {
                diagnostics.push(
                    Diagnostic::error(
                        codes::NO_VALUE,
                        key.span,
                        format!("`{}` has no value", key.value),
                    )
                    .hint("write a value, or remove the key"),
                );
            }
        }
        Some(Self { entries, table, at, owner })
    }

    /// Position at which a missing key is reported.
    pub fn at(&self) -> Span {
        self.at
    }

    /// Returns what the table says of `key`.
    pub fn key(&self, key: &str) -> Option<&'static Key> {
        self.table.key(key)
    }

    /// Returns what the value of `key` may be.
    pub fn expected(&self, key: &str) -> &'static Value {
        debug_assert!(self.table.key(key).is_some(), "{} has no `{key}`", self.table.name);
        self.table.key(key).map_or(&Value::Parameter, |key| &key.value)
    }

    /// Returns the value of `key`. A missing key is reported if the table requires it. Keys without
    /// value (reported already) count as absent.
    pub fn read(&self, key: &str, diagnostics: &mut Diagnostics) -> Option<&'n Node> {
        match self.table.key(key).map(|key| key.presence) {
            Some(Presence::Required) => self.require(key, diagnostics),
            // A key without value (reported already) is there too.
            Some(Presence::Without(other)) if !self.has(other) => self.require(key, diagnostics),
            _ => self.get(key),
        }
    }

    /// Returns the value of `key`. Keys without value (reported already) count as absent.
    pub fn get(&self, key: &str) -> Option<&'n Node> {
        self.entry(key).map(|entry| &entry.value)
    }

    /// Returns the key with its value.
    pub fn entry(&self, key: &str) -> Option<&'n Entry> {
        self.entries.iter().find(|entry| entry.key.value == key && !entry.value.is_null())
    }

    /// Returns whether the key is there, with or without a value.
    fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|entry| entry.key.value == key)
    }

    /// Returns the value of a key that is required by the table or by another key.
    pub fn require(&self, key: &str, diagnostics: &mut Diagnostics) -> Option<&'n Node> {
        debug_assert!(
            self.table.key(key).is_some_and(|key| key.presence.may_be_required()),
            "the table of {} does not require `{key}`",
            self.table.name
        );
        // A key without value has been reported already.
        if !self.has(key) {
            diagnostics.push(
                Diagnostic::error(
                    codes::MISSING_KEY,
                    self.at,
                    format!("{} needs `{key}`", self.owner),
                )
                .label(format!("`{key}` is missing")),
            );
        }
        self.get(key)
    }
}

/// Returns the entries of a mapping from names to values, such as `bodies`; no entries if `node` is
/// absent.
pub fn entries<'n>(
    node: Option<&'n Node>,
    what: &str,
    diagnostics: &mut Diagnostics,
) -> &'n [Entry] {
    match node.map(|node| (&node.content, node)) {
        None => &[],
        Some((Content::Mapping(entries), _)) => entries,
        Some((_, node)) => {
            let error = Diagnostic::error(
                codes::WRONG_TYPE,
                node.span,
                format!("expected a mapping from names to {what}"),
            );
            diagnostics.push(
                error
                    .label(format!("this is {}", node.describe()))
                    .hint("write `name: { .. }` for each of them"),
            );
            &[]
        }
    }
}

/// Returns the items of a list.
pub fn items<'n>(node: &'n Node, what: &str, diagnostics: &mut Diagnostics) -> Option<&'n [Node]> {
    if let Content::Sequence(items) = &node.content {
        return Some(items);
    }
    let error = Diagnostic::error(codes::WRONG_TYPE, node.span, format!("expected {what}"));
    diagnostics.push(error.label(format!("this is {}", node.describe())));
    None
}

/// Returns the items of a list of known length.
pub fn array<'n, const K: usize>(
    node: &'n Node,
    what: &str,
    diagnostics: &mut Diagnostics,
) -> Option<&'n [Node; K]> {
    let items = items(node, what, diagnostics)?;
    if let Ok(array) = items.try_into() {
        return Some(array);
    }
    let error = Diagnostic::error(codes::WRONG_LENGTH, node.span, format!("expected {what}"));
    diagnostics.push(error.label(match items.len() {
        1 => format!("one item instead of {K}"),
        given => format!("{given} items instead of {K}"),
    }));
    None
}
