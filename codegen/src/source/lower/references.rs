//! Names in the file: declarations and references.

use std::collections::HashMap;

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::fields::{Fields, entries};
use crate::source::ids::{BodyId, PointId};
use crate::source::names::{self, hint};
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
    pub springs: &'n [Entry],
    pub tendons: &'n [Entry],
    pub motors: &'n [Entry],
    pub contacts: &'n [Entry],
    pub controllers: &'n [Entry],
    pub hinge_models: &'n [Entry],
}

/// Names of one kind, in the order of the file.
#[derive(Default)]
pub(super) struct Known {
    pub all: Vec<String>,
    positions: HashMap<String, usize>,
}

impl Known {
    fn of<'n>(names: impl Iterator<Item = &'n String>) -> Self {
        let all: Vec<String> = names.cloned().collect();
        let mut positions = HashMap::with_capacity(all.len());
        for (position, name) in all.iter().enumerate() {
            positions.entry(name.clone()).or_insert(position);
        }
        Self { all, positions }
    }

    /// Adds names that are not in the file.
    #[cfg(feature = "drawings")]
    pub fn extend<'n>(&mut self, names: impl Iterator<Item = &'n String>) {
        for name in names {
            self.positions.entry(name.clone()).or_insert(self.all.len());
            self.all.push(name.clone());
        }
    }

    /// Returns the position of a name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.positions.get(name).copied()
    }

    /// Iterates over the names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.all.iter().map(String::as_str)
    }
}

/// All names in the file, collected before anything that may refer to them is read.
#[derive(Default)]
pub(super) struct Names {
    pub materials: Known,
    pub bodies: Known,
    pub joints: Known,
    pub parameters: Known,
    pub inputs: Known,
    pub points: Known,
    pub hinge_models: Known,
}

impl Names {
    /// The names of entries and inputs.
    pub fn of(declared: &Declared, inputs: &[Spanned<String>]) -> Self {
        let names = |entries: &[Entry]| Known::of(entries.iter().map(|entry| &entry.key.value));
        Self {
            materials: names(declared.materials),
            bodies: names(declared.bodies),
            joints: names(declared.joints),
            parameters: names(declared.parameters),
            inputs: Known::of(inputs.iter().map(|input| &input.value)),
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
            springs: named("springs"),
            tendons: named("tendons"),
            motors: named("motors"),
            contacts: named("contacts"),
            controllers: named("controllers"),
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
        list: impl Fn(&Names) -> &Known,
    ) -> Option<usize> {
        let name = self.text(node, &format!("the name of a {kind}"))?;
        self.look_up(&name, kind, plural, list)
    }

    pub(super) fn look_up(
        &mut self,
        name: &Spanned<String>,
        kind: &str,
        plural: &str,
        list: impl Fn(&Names) -> &Known,
    ) -> Option<usize> {
        let names = list(&self.names);
        let position = names.position(&name.value);
        if position.is_none() {
            let earlier = self.diagnostics.0.len();
            let hint = hint(earlier, &name.value, || names.names().collect(), plural);
            let message = format!("there is no {kind} `{}`", shorten(&name.value));
            let code = match kind {
                "material" => codes::UNKNOWN_MATERIAL,
                "body" => codes::UNKNOWN_BODY,
                "joint" => codes::UNKNOWN_JOINT,
                _ => codes::UNKNOWN_POINT,
            };
            self.note(Diagnostic { hint, ..Diagnostic::error(code, name.span, message) });
        }
        position
    }

    /// Remembers a name; returns false and reports it if it was there before.
    pub(super) fn once(
        &mut self,
        earlier: &mut HashMap<String, Span>,
        name: &Spanned<String>,
    ) -> bool {
        if let Some(first) = earlier.get(&name.value) {
            let message = format!("`{}` is listed twice", shorten(&name.value));
            let error = Diagnostic::error(codes::DUPLICATE_NAME, name.span, message);
            self.note(error.label("second time").also(*first, "first time"));
            return false;
        }
        earlier.insert(name.value.clone(), name.span);
        true
    }
}
