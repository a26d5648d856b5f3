//! Names in the file: declarations and references.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Spanned};
use crate::source::fields::{Fields, entries};
use crate::source::ids::{BodyId, PointId};
use crate::source::names::{self, alternatives};
use crate::source::schema::Value;
use crate::source::yaml::{Entry, Node, shorten};

use super::Lowering;

/// The entries of the file that have names.
pub(super) struct Declared<'n> {
    pub materials: &'n [Entry],
    pub bodies: &'n [Entry],
    pub joints: &'n [Entry],
    pub parameters: &'n [Entry],
    pub points: &'n [Entry],
    pub forces: &'n [Entry],
    pub hinge_models: &'n [Entry],
}

/// All names in the file, collected before anything that may refer to them is read.
#[derive(Default)]
pub(super) struct Names {
    pub materials: Vec<String>,
    pub bodies: Vec<String>,
    pub joints: Vec<String>,
    pub parameters: Vec<String>,
    pub inputs: Vec<String>,
    pub points: Vec<String>,
    pub hinge_models: Vec<String>,
}

impl Names {
    /// The names of entries and inputs.
    pub fn of(declared: &Declared, inputs: &[Spanned<String>]) -> Self {
        let names =
            |entries: &[Entry]| entries.iter().map(|entry| entry.key.value.clone()).collect();
        Self {
            materials: names(declared.materials),
            bodies: names(declared.bodies),
            joints: names(declared.joints),
            parameters: names(declared.parameters),
            inputs: inputs.iter().map(|input| input.value.clone()).collect(),
            points: names(declared.points),
            hinge_models: names(declared.hinge_models),
        }
    }
}

impl Lowering<'_> {
    /// Finds all entries with names and checks the names.
    pub(super) fn declared<'n>(&mut self, model: &Fields<'n>) -> Declared<'n> {
        let mut named = |key: &str| {
            let node = model.read(key, &mut self.diagnostics);
            let entries = entries(node, &key.replace('_', " "), &mut self.diagnostics);
            if let Value::Named(kind, _) = model.expected(key) {
                entries.iter().for_each(|it| names::check(&it.key, *kind, &mut self.diagnostics));
            }
            entries
        };
        Declared {
            materials: named("materials"),
            bodies: named("bodies"),
            joints: named("joints"),
            parameters: named("parameters"),
            points: named("points"),
            forces: named("forces"),
            hinge_models: named("hinge_models"),
        }
    }

    pub(super) fn material_named(&mut self, node: &Node) -> Option<usize> {
        self.refer(node, "material", "materials", |names| &names.materials)
    }

    pub(super) fn body_named(&mut self, node: &Node) -> Option<BodyId> {
        self.refer(node, "body", "bodies", |names| &names.bodies).map(BodyId)
    }

    pub(super) fn point_named(&mut self, node: &Node) -> Option<PointId> {
        self.refer(node, "point", "points", |names| &names.points).map(PointId)
    }

    /// Returns the position of the entry that a node names.
    fn refer(
        &mut self,
        node: &Node,
        kind: &str,
        plural: &str,
        list: impl Fn(&Names) -> &Vec<String>,
    ) -> Option<usize> {
        let name = self.text(node, &format!("the name of a {kind}"))?;
        self.look_up(&name, kind, plural, list)
    }

    pub(super) fn look_up(
        &mut self,
        name: &Spanned<String>,
        kind: &str,
        plural: &str,
        list: impl Fn(&Names) -> &Vec<String>,
    ) -> Option<usize> {
        let names: Vec<&str> = list(&self.names).iter().map(String::as_str).collect();
        let position = names.iter().position(|known| *known == name.value);
        if position.is_none() {
            let hint = alternatives(&name.value, &names, plural);
            let message = format!("there is no {kind} `{}`", shorten(&name.value));
            let code = match kind {
                "material" => codes::UNKNOWN_MATERIAL,
                "body" => codes::UNKNOWN_BODY,
                "joint" => codes::UNKNOWN_JOINT,
                _ => codes::UNKNOWN_POINT,
            };
            self.note(Diagnostic::error(code, name.span, message).hint(hint));
        }
        position
    }

    /// Returns false and reports a name that is already in the list.
    pub(super) fn once(&mut self, earlier: &[Spanned<String>], name: &Spanned<String>) -> bool {
        if let Some(first) = earlier.iter().find(|other| other.value == name.value) {
            let message = format!("`{}` is listed twice", name.value);
            let error = Diagnostic::error(codes::DUPLICATE_NAME, name.span, message);
            self.note(error.label("second time").also(first.span, "first time"));
            return false;
        }
        true
    }
}
