//! Which program wrote a file, and the errors about files that lamc cannot read.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span};
use crate::source::yaml::{Content, Node, PYTHON_TAG};

/// The end of the tag of the file's root.
const ROOT_TAG: &str = ".DynamicsInfo";

/// Which program wrote a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::source) enum Origin {
    /// A file in our schema, written by hand.
    Schema,
    /// foldable_robotics, with `DynamicsInfo`.
    DynamicsInfo,
    /// popupCAD, before `DynamicsInfo`: a tuple of lists.
    OlderExport,
    /// Other objects of a Python program, such as popupCAD's own design.
    OtherObject,
    /// An unknown kind of file.
    Unknown,
}

/// Determines the program by the tag of the root or, without a tag, by the contents.
pub(in crate::source) fn origin(root: &Node) -> Origin {
    let tag = root.tag.as_ref().map_or("", |tag| &tag.value);
    match (tag.strip_prefix(PYTHON_TAG), &root.content) {
        (Some(object), _) if object.starts_with("object:") && object.ends_with(ROOT_TAG) => {
            Origin::DynamicsInfo
        }
        (Some("tuple"), Content::Sequence(_)) => Origin::OlderExport,
        (Some(_), _) => Origin::OtherObject,
        (None, Content::Mapping(_)) if root.get("bodies").is_some() => Origin::Schema,
        (None, _) if holds_python(root) => Origin::OtherObject,
        (None, Content::Sequence(_)) => Origin::Unknown,
        (None, _) => Origin::Schema,
    }
}

/// Returns whether the node contains Python objects.
fn holds_python(node: &Node) -> bool {
    node.is_python()
        || match &node.content {
            Content::Scalar(_) => false,
            Content::Sequence(items) => items.iter().any(holds_python),
            Content::Mapping(entries) => {
                entries.iter().any(|entry| entry.object.is_some() || holds_python(&entry.value))
            }
        }
}

const EXPORT_AGAIN: &str = "export the design with foldable_robotics' `DynamicsInfo`, or describe \
                            the mechanism in lamc's own schema (see README.md)";

/// The error for [`Origin::OtherObject`].
pub(in crate::source) fn other_object(span: Span) -> Diagnostic {
    let message = "this is a Python object that lamc cannot read";
    Diagnostic::error(codes::OTHER_OBJECT, span, message)
        .label("lamc reads `DynamicsInfo` of foldable_robotics, and popupCAD's older tuples")
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
