//! YAML text -> a tree of nodes with their positions in the text.
//!
//! This reader uses the event parser of `serde-saphyr` rather than its `Spanned<T>`, which gives a
//! mapping the location of its first event only, drops the tags that identify a popupCAD file,
//! gives scalars a type before we know whether they are a name or a number, and stops at the first
//! duplicate key. Its limits on aliases are in the same layer, so this reader has its own limit:
//! the number of nodes after the expansion of aliases.

use std::collections::HashMap;
use std::sync::Arc;

use serde_saphyr::granit_parser::{self, Event, Parser, ScalarStyle, StructureStyle};

use super::codes;
use super::diagnostic::{Diagnostic, Diagnostics, Span, Spanned};

mod alias_keys;
mod errors;
mod merge;

use errors::{syntax_error, too_deep, too_many};

/// Deepest nesting of mappings and sequences, with aliases expanded.
const MAX_DEPTH: usize = 64;
/// Largest number of nodes of a file, with aliases expanded.
const MAX_NODES: usize = 1_000_000;
/// A text counts as one more node for each of so many bytes, because aliases copy keys too.
const BYTES_PER_NODE: usize = 64;

/// A value of the file.
#[derive(Clone, Debug)]
pub struct Node {
    /// What it is.
    pub content: Content,
    /// The resolved tag (`tag:yaml.org,2002:python/tuple`), if the file has one.
    pub tag: Option<Spanned<String>>,
    /// From the first to the last byte of the value, without the tag.
    pub span: Span,
}

/// Content of a node.
#[derive(Clone, Debug)]
pub enum Content {
    /// A text, which may be a number.
    Scalar(Scalar),
    /// A list.
    Sequence(Vec<Node>),
    /// Keys with their values, in the order of the file.
    Mapping(Vec<Entry>),
}

/// Text with YAML's escapes resolved. The reader of the key decides whether it is a number.
#[derive(Clone, Debug)]
pub struct Scalar {
    /// The text.
    pub text: Arc<str>,
    /// Whether it is written without quotes.
    plain: bool,
    /// Start of `text` in the file, if the file contains it literally.
    verbatim: Option<usize>,
}

/// One `key: value`.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The key.
    pub key: Spanned<String>,
    /// The key itself if it is an object of a Python program. `key` is then a text that no other object
    /// of the file has.
    pub object: Option<Box<Node>>,
    /// The value.
    pub value: Node,
}

impl Entry {
    /// Key and value.
    pub fn span(&self) -> Span {
        Span { start: self.key.span.start, end: self.value.span.end.max(self.key.span.end) }
    }
}

/// Prefix of the tags of Python objects.
pub(super) const PYTHON_TAG: &str = "tag:yaml.org,2002:python/";

impl Node {
    /// Returns whether the node is an object of a Python program.
    pub fn is_python(&self) -> bool {
        self.tag.as_ref().is_some_and(|tag| tag.value.starts_with(PYTHON_TAG))
    }

    /// Returns the scalar if the node is a scalar.
    pub fn scalar(&self) -> Option<&Scalar> {
        match &self.content {
            Content::Scalar(scalar) => Some(scalar),
            _ => None,
        }
    }

    /// Returns the value of a mapping's key.
    pub fn get(&self, key: &str) -> Option<&Node> {
        match &self.content {
            Content::Mapping(entries) => {
                entries.iter().find(|entry| entry.key.value == key).map(|entry| &entry.value)
            }
            _ => None,
        }
    }

    /// Returns true for `key:` without a value, `null` and `~`.
    pub fn is_null(&self) -> bool {
        self.scalar().is_some_and(|s| s.plain && matches!(&*s.text, "" | "~" | "null"))
    }

    /// Returns the position of bytes `start..end` of a scalar's text in `source`; the whole scalar
    /// if escapes make this ambiguous.
    pub fn span_within(&self, source: &str, start: usize, end: usize) -> Span {
        let Some(scalar) = self.scalar() else { return self.span };
        if let Some(at) = scalar.verbatim {
            return Span { start: at + start, end: at + end };
        }
        // Folded lines differ only in their blanks, so the other characters are counted.
        let solid = |text: &str| text.chars().filter(|c| !c.is_whitespace()).count();
        let raw = source.get(self.span.start..self.span.end).unwrap_or_default();
        let unquoted = raw.trim_start_matches(['"', '\'']);
        let offset = self.span.start + (raw.len() - unquoted.len());
        let raw = unquoted.trim_end_matches(['"', '\'']);
        let same = raw.split_whitespace().flat_map(str::chars);
        if raw.is_empty() || !same.eq(scalar.text.split_whitespace().flat_map(str::chars)) {
            return self.span;
        }
        let skipped = solid(&scalar.text[..start]);
        let kept = solid(&scalar.text[start..end]).max(1);
        let mut places = raw.char_indices().filter(|(_, c)| !c.is_whitespace()).skip(skipped);
        match (places.next(), places.nth(kept.saturating_sub(2))) {
            (Some((from, c)), _) if kept == 1 => {
                Span { start: offset + from, end: offset + from + c.len_utf8() }
            }
            (Some((from, _)), Some((last, c))) => {
                Span { start: offset + from, end: offset + last + c.len_utf8() }
            }
            _ => self.span,
        }
    }

    /// Describes the node, for messages.
    pub fn describe(&self) -> String {
        match &self.content {
            Content::Scalar(_) if self.is_null() => "nothing".into(),
            Content::Scalar(scalar) => format!("`{}`", shorten(&scalar.text)),
            Content::Sequence(_) => "a list".into(),
            Content::Mapping(_) => "a mapping".into(),
        }
    }
}

/// Shortens a user's text to at most one line.
pub fn shorten(text: &str) -> String {
    const LONGEST: usize = 40;
    let line = text.lines().next().unwrap_or_default();
    if line.chars().count() <= LONGEST && line.len() == text.len() {
        return line.into();
    }
    line.chars().take(LONGEST).chain(['…']).collect()
}

/// Reads `text`, which must have one document. The diagnostics returned with the tree are errors
/// after which reading can continue: duplicate keys and keys that are not text.
///
/// # Errors
/// Returns the mistakes after which nothing can be read.
pub fn parse(text: &str) -> Result<(Node, Diagnostics), Diagnostics> {
    let mut options = granit_parser::options! {
        flow_nesting_limit: MAX_DEPTH,
        block_nesting_limit: MAX_DEPTH,
    };
    options.set_emit_comments(false);
    let spaced = alias_keys::spaced(text);
    let mut builder = Builder { text, ..Builder::default() };
    for event in Parser::new_from_str_with_options(&spaced, options) {
        let (event, span) = event.map_err(|error| syntax_error(text, &error, &builder.open))?;
        builder.event(event, span)?;
    }
    match builder.root {
        Some(root) => Ok((root, builder.diagnostics)),
        None => {
            Err(Diagnostic::error(codes::EMPTY_FILE, Span::default(), "the file is empty").into())
        }
    }
}

/// A finished value, with its size and depth after expansion of aliases.
#[derive(Clone)]
struct Built {
    node: Node,
    size: usize,
    depth: usize,
}

/// A sequence or mapping being read.
struct Open {
    anchor: usize,
    tag: Option<Spanned<String>>,
    start: usize,
    end: usize,
    flow: bool,
    size: usize,
    depth: usize,
    children: Children,
}

enum Children {
    Items(Vec<Node>),
    /// `merge` is the position of `<<`, YAML's key that inserts the entries of other mappings.
    Entries {
        entries: Vec<Entry>,
        key: Option<Node>,
        merge: Option<Span>,
    },
}

#[derive(Default)]
struct Builder<'t> {
    text: &'t str,
    root: Option<Node>,
    open: Vec<Open>,
    /// `None` while the anchored value is still being read.
    anchors: HashMap<usize, Option<Built>>,
    nodes: usize,
    diagnostics: Diagnostics,
}

impl Builder<'_> {
    fn event(&mut self, event: Event, at: granit_parser::Span) -> Result<(), Diagnostics> {
        let range = at.byte_range().unwrap_or(0..0);
        let span = Span { start: range.start, end: range.end };
        let tag = |tag: Option<std::borrow::Cow<granit_parser::Tag>>| {
            let written = at.tag_span().and_then(|s| s.byte_range()).unwrap_or(range.clone());
            tag.map(|tag| Spanned {
                value: format!("{}{}", tag.handle(), tag.suffix()),
                span: Span { start: written.start, end: written.end },
            })
        };
        match event {
            Event::DocumentStart(..) if self.root.is_some() => {
                return Err(Diagnostic::error(
                    codes::SEVERAL_DOCUMENTS,
                    span,
                    "a second YAML document",
                )
                .hint("a file has one document: remove `---`")
                .into());
            }
            Event::Scalar(text, style, anchor, written_tag) => {
                let plain = style == ScalarStyle::Plain;
                let at = span.start + usize::from(!plain);
                let verbatim = self.text.get(at..).is_some_and(|t| t.starts_with(&*text));
                let scalar = Scalar { text: text.into(), plain, verbatim: verbatim.then_some(at) };
                let size = 1 + scalar.text.len() / BYTES_PER_NODE;
                let node = Node { content: Content::Scalar(scalar), tag: tag(written_tag), span };
                self.finish(anchor, Built { node, size, depth: 0 })?;
            }
            Event::Alias(anchor) => match self.anchors.get(&anchor).cloned().flatten() {
                Some(built) => self.add(built, span)?,
                None => {
                    return Err(Diagnostic::error(
                        codes::SELF_ALIAS,
                        span,
                        "an alias inside its own value",
                    )
                    .hint("write the value out")
                    .into());
                }
            },
            Event::SequenceStart(style, anchor, written_tag) => {
                self.start(style, anchor, tag(written_tag), span, Children::Items(Vec::new()));
            }
            Event::MappingStart(style, anchor, written_tag) => {
                let children = Children::Entries { entries: Vec::new(), key: None, merge: None };
                self.start(style, anchor, tag(written_tag), span, children);
            }
            Event::SequenceEnd | Event::MappingEnd => self.end(span)?,
            _ => {}
        }
        Ok(())
    }

    fn start(
        &mut self,
        style: StructureStyle,
        anchor: usize,
        tag: Option<Spanned<String>>,
        span: Span,
        children: Children,
    ) {
        if anchor != 0 {
            self.anchors.insert(anchor, None);
        }
        let flow = style == StructureStyle::Flow;
        let (start, end) = (span.start, span.end);
        self.open.push(Open { anchor, tag, start, end, flow, size: 1, depth: 0, children });
    }

    fn end(&mut self, span: Span) -> Result<(), Diagnostics> {
        let Some(open) = self.open.pop() else { return Ok(()) };
        let content = match open.children {
            Children::Items(items) => Content::Sequence(items),
            Children::Entries { entries, merge, .. } => {
                let mut entries = merge::distinct(entries, &mut self.diagnostics);
                if let Some(at) = entries.iter().position(|entry| Some(entry.key.span) == merge) {
                    merge::entries_of(&mut entries, at, &mut self.diagnostics);
                }
                Content::Mapping(entries)
            }
        };
        // A block ends with its last child; its end event is at the next token.
        let end = if open.flow { span.end } else { open.end };
        let node = Node { content, tag: open.tag, span: Span { start: open.start, end } };
        self.finish(open.anchor, Built { node, size: open.size, depth: open.depth + 1 })
    }

    fn finish(&mut self, anchor: usize, built: Built) -> Result<(), Diagnostics> {
        self.nodes += 1;
        if anchor != 0 {
            self.nodes = self.nodes.saturating_add(built.size);
        }
        let at = built.node.span;
        if self.nodes > MAX_NODES {
            return Err(too_many(at));
        }
        // The copy counts too: anchors within anchors copy their values once for each.
        if anchor != 0 {
            self.anchors.insert(anchor, Some(built.clone()));
        }
        self.insert(built, at)
    }

    /// Inserts a copy of an anchored value at its alias (at `at`).
    fn add(&mut self, built: Built, at: Span) -> Result<(), Diagnostics> {
        self.nodes = self.nodes.saturating_add(built.size);
        if self.nodes > MAX_NODES {
            return Err(too_many(at));
        }
        if self.open.len() + built.depth > MAX_DEPTH {
            return Err(too_deep(at).into());
        }
        self.insert(built, at)
    }

    fn insert(&mut self, built: Built, at: Span) -> Result<(), Diagnostics> {
        let Some(parent) = self.open.last_mut() else {
            self.root = Some(built.node);
            return Ok(());
        };
        parent.size += built.size;
        parent.depth = parent.depth.max(built.depth);
        parent.end = parent.end.max(at.end);
        match &mut parent.children {
            Children::Items(items) => items.push(built.node),
            Children::Entries { key: key @ None, .. } => *key = Some(built.node),
            Children::Entries { entries, key, merge } => {
                let Some(key) = key.take() else { return Ok(()) };
                if key.is_python() && key.scalar().is_none() {
                    let value = format!("object {}", key.span.start);
                    let text = Spanned { value, span: key.span };
                    let object = Some(Box::new(key));
                    entries.push(Entry { key: text, object, value: built.node });
                    return Ok(());
                }
                let Some(scalar) = key.scalar() else {
                    let error = Diagnostic::error(codes::BAD_KEY, key.span, "a key must be text");
                    self.diagnostics.push(error.label(format!("this is {}", key.describe())));
                    return Ok(());
                };
                if scalar.plain && &*scalar.text == "<<" {
                    merge.get_or_insert(key.span);
                }
                let key = Spanned { value: scalar.text.to_string(), span: key.span };
                entries.push(Entry { key, object: None, value: built.node });
            }
        }
        Ok(())
    }
}
