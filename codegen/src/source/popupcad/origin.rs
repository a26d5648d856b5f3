//! Which program wrote a file, and the errors about files that lamc cannot read.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span};
use crate::source::yaml::{Content, Node};

/// The end of the tag of the file's root.
const ROOT_TAG: &str = ".DynamicsInfo";

/// Which program wrote a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::source) enum Origin {
    /// A file in our schema, written by hand.
    Schema,
    /// foldable_robotics, with `DynamicsInfo`.
    DynamicsInfo,
    /// popupCAD, before `DynamicsInfo`: Python objects in which the data have no names.
    OlderExport,
    /// Another object of a Python program, such as popupCAD's own design.
    OtherObject,
    /// An unknown kind of file.
    Unknown,
}

/// Prefix of the tags of Python objects.
const PYTHON_TAG: &str = "tag:yaml.org,2002:python/";

/// Determines the program by the tag of the root or, without a tag, by the contents.
pub(in crate::source) fn origin(root: &Node) -> Origin {
    let tag = root.tag.as_ref().map_or("", |tag| &tag.value);
    match (tag.strip_prefix(PYTHON_TAG), &root.content) {
        (Some(object), _) if object.starts_with("object:") && object.ends_with(ROOT_TAG) => {
            Origin::DynamicsInfo
        }
        (Some(object), _) if object.starts_with("object") => Origin::OtherObject,
        (Some(_), _) => Origin::OlderExport,
        (None, Content::Mapping(_)) if root.get("bodies").is_some() => Origin::Schema,
        (None, _) if holds_python(root) => Origin::OlderExport,
        (None, Content::Sequence(_)) => Origin::Unknown,
        (None, _) => Origin::Schema,
    }
}

/// Returns whether the node contains Python objects.
fn holds_python(node: &Node) -> bool {
    node.tag.as_ref().is_some_and(|tag| tag.value.starts_with(PYTHON_TAG))
        || match &node.content {
            Content::Scalar(_) => false,
            Content::Sequence(items) => items.iter().any(holds_python),
            Content::Mapping(entries) => entries.iter().any(|entry| holds_python(&entry.value)),
        }
}

/// Returns whether a text is an older export if it is not valid YAML because of an alias without an
/// anchor at this byte. PyYAML wrote `*id003: 600.0`, and the current YAML standard counts the
/// colon as part of the name.
pub(in crate::source) fn is_older_export(text: &str, alias: usize) -> bool {
    let name = text.get(alias..).map_or("", |rest| rest.trim_start_matches('*'));
    let digits = name.strip_prefix("id").unwrap_or_default();
    let number = digits.bytes().take_while(u8::is_ascii_digit).count();
    let is_key = number >= 3 && digits[number..].starts_with(':');
    is_key || (text.contains("!!python/") && !text.contains(ROOT_TAG))
}

const EXPORT_AGAIN: &str = "export the design with foldable_robotics' `DynamicsInfo`, or describe \
                            the mechanism in lamc's own schema (see README.md)";

/// The error for [`Origin::OlderExport`].
pub(in crate::source) fn older_export(span: Span) -> Diagnostic {
    Diagnostic::error(
        codes::OLD_EXPORT,
        span,
        "this is an older export of popupCAD, which lamc cannot read",
    )
    .label("lamc reads the `DynamicsInfo` of foldable_robotics")
    .hint(EXPORT_AGAIN)
}

/// The error for [`Origin::OtherObject`].
pub(in crate::source) fn other_object(span: Span) -> Diagnostic {
    let message = "this is a Python object that lamc cannot read";
    Diagnostic::error(codes::OTHER_OBJECT, span, message)
        .label("lamc reads the `DynamicsInfo` of foldable_robotics")
        .hint(EXPORT_AGAIN)
}

/// The error for [`Origin::Unknown`].
pub(in crate::source) fn no_model(span: Span) -> Diagnostic {
    let message = "this is neither a model nor a `DynamicsInfo` of foldable_robotics";
    Diagnostic::error(codes::NO_MODEL, span, message)
        .label("expected a mapping, or the tag of `DynamicsInfo`")
        .hint("a model needs at least `bodies` and `joints`")
}

/// Returns the position at which a file that is not a model begins.
pub(in crate::source) fn beginning(root: &Node) -> Span {
    let start = root.span.start;
    root.tag.as_ref().map_or(Span { start, end: start + 1 }, |tag| tag.span)
}
