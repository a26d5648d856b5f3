//! Stage 1: text -> [`SourceModel`], with spans and diagnostics.
//!
//! [`parse`] reads our schema and the files of popupCAD / foldable_robotics, which it distinguishes
//! by their tag; [`to_yaml`] writes any model in our schema.
//!
//! ```text
//! text -> yaml (nodes with spans) -> lower    (our schema)  -> SourceModel
//!                                    popupcad (DynamicsInfo, older exports)
//! ```

use std::collections::BTreeSet;

mod argument;
pub mod codes;
pub mod controllers;
pub mod diagnostic;
mod drawn;
mod edit;
pub mod elements;
pub mod expression;
pub mod fields;
mod file;
mod formula;
pub mod free;
pub mod ids;
mod lower;
mod model;
mod names;
mod parameters;
#[cfg(feature = "drawings")]
pub mod pattern;
mod polynomial;
mod popupcad;
mod render;
mod rewrite;
mod rounding;
pub mod schema;
#[cfg(test)]
mod tests;
mod tunable;
mod units;
mod uses;
mod vocabulary;
mod write;
pub mod yaml;

pub use argument::{
    AngleUnit, beyond_a_turn, has_no_unit, read_angle, read_as, read_in, read_quantity,
};
pub use codes::Code;
pub use controllers::Controller;
pub use diagnostic::{Diagnostic, Diagnostics, Severity, SourceFile, Span, Spanned};
pub use drawn::{Drawn, Places};
pub use edit::EditError;
pub use expression::{Binary, Expression, Operator, Unary};
pub use file::{MAX_FILE_BYTES, ReadError};
pub use ids::{
    BodyId, ContactId, CoordinateId, InputId, JointId, MemoryId, ParameterId, PointId, SpeedId,
};
pub use model::*;
pub use names::{alternatives, closest as closest_name, is_identifier, is_keyword};
pub use polynomial::{Polynomial, Term};
pub use rewrite::with_parameters;
pub use tunable::Tunable;
pub use units::Dimension;
pub use uses::Numbers;
pub use vocabulary::Vocabulary;
pub use write::to_yaml;

use popupcad::Origin;
use yaml::{Content, Entry, Node};

/// Reads a model. All errors are reported together; a model is returned with its warnings.
pub fn parse(file: &SourceFile) -> Result<(SourceModel, Diagnostics), Diagnostics> {
    let (root, mut diagnostics) = yaml::parse(&file.text).map_err(|mut found| {
        let empty = found.0.iter_mut().filter(|found| found.code == codes::EMPTY_FILE);
        empty.for_each(|found| {
            found.hint = Some("a model needs at least `bodies` and `joints`".into())
        });
        found
    })?;
    let (model, found) = match popupcad::origin(&root) {
        Origin::Schema => {
            refuse_tags(&root, &mut diagnostics);
            lower::lower(&root, file)
        }
        Origin::DynamicsInfo => popupcad::import(&root, file),
        Origin::OlderExport => popupcad::import_older(&root, file),
        Origin::OtherObject => {
            return Err(popupcad::other_object(popupcad::beginning(&root)).into());
        }
        Origin::Unknown => return Err(popupcad::no_model(popupcad::beginning(&root)).into()),
    };
    diagnostics.extend(found.0);
    // A mistake in a value that aliases repeat is reported once.
    let mut reported = BTreeSet::new();
    diagnostics
        .0
        .retain(|found| reported.insert((found.code.name, found.span, found.message.clone())));
    match model {
        Some(model) if !diagnostics.has_errors() => Ok((model, diagnostics)),
        _ => Err(diagnostics),
    }
}

/// Reports tags, which our schema does not have. The tags of YAML's own types change nothing and
/// are allowed.
fn refuse_tags(node: &Node, diagnostics: &mut Diagnostics) {
    const CORE: &str = "tag:yaml.org,2002:";
    const TYPES: &[&str] = &["str", "int", "float", "bool", "seq", "map"];
    if let Some(tag) = &node.tag
        && !tag.value.strip_prefix(CORE).is_some_and(|tag| TYPES.contains(&tag))
    {
        let shown = tag.value.replace(CORE, "!!");
        let message = format!("unexpected tag `{}`", yaml::shorten(&shown));
        diagnostics
            .push(Diagnostic::error(codes::UNEXPECTED_TAG, tag.span, message).hint("remove it"));
    }
    match &node.content {
        Content::Scalar(_) => {}
        Content::Sequence(items) => items.iter().for_each(|item| refuse_tags(item, diagnostics)),
        Content::Mapping(entries) => {
            for Entry { object, value, .. } in entries {
                object.iter().for_each(|key| refuse_tags(key, diagnostics));
                refuse_tags(value, diagnostics);
            }
        }
    }
}
