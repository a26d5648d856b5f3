//! Contacts of points with planes.

use std::collections::HashMap;

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, items};
use crate::source::model::{Contact, ContactPlane, ContactPoints};
use crate::source::schema::{ALL, BODIES_FORM, CONTACT, CORNERS, OUTLINE, PLANE, POINTS_FORM};
use crate::source::yaml::{Entry, Node, shorten};

use super::Lowering;

/// Dissipation of a contact that gives none, s/m: an impact at 1 m/s rebounds with three quarters of its speed.
const DISSIPATION: f64 = 0.5;
/// Slip speed of a contact that gives none, m/s.
const SLIP_SPEED: f64 = 1e-3;

impl Lowering<'_> {
    pub(super) fn contact(&mut self, entry: &Entry) -> Option<Contact> {
        let owner = format!("contact `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &CONTACT, found)?;
        let at = entry.key.span;
        let plane = fields.read("plane", &mut self.diagnostics);
        let plane = plane.and_then(|node| self.contact_plane(node, &fields));
        let points = self.contact_points(&fields);
        let mut law = |key: &str| match fields.get(key) {
            None => Some(None),
            Some(node) => self.expression(node, fields.expected(key)).map(Some),
        };
        let (stiffness, dissipation) = (law("stiffness"), law("dissipation"));
        let friction = self.required_law(&fields, "friction");
        let slip_speed = self.optional(&fields, "slip_speed");
        Some(Contact {
            name: entry.key.clone(),
            plane: plane?,
            points: points?,
            stiffness: stiffness?,
            dissipation: dissipation?
                .unwrap_or(Spanned { value: Expression::Number(DISSIPATION), span: at }),
            friction: friction?,
            slip_speed: slip_speed?.unwrap_or(Spanned { value: SLIP_SPEED, span: at }),
        })
    }

    fn contact_plane(&mut self, node: &Node, contact: &Fields) -> Option<ContactPlane> {
        let at = contact.entry("plane").map_or(node.span, |entry| entry.key.span);
        let fields = Fields::new(node, at, "`plane`", &PLANE, &mut self.diagnostics)?;
        let point = self.required_place(&fields, "point");
        let normal = self.required_numbers(&fields, "normal");
        let body = match fields.get("body") {
            None => Some(None),
            Some(node) => {
                self.body_named(node).map(|value| Some(Spanned { value, span: node.span }))
            }
        };
        let within = match fields.get("within") {
            None => Some(None),
            Some(node) => self.word(node, OUTLINE).map(Some),
        };
        let normal = normal?;
        // Squares of smaller components underflow.
        if !normal.value.iter().any(|x| x.abs() > 1e-150) {
            let error =
                Diagnostic::error(codes::ZERO_NORMAL, normal.span, "the normal has no length");
            self.note(
                error.hint("give the direction in which the plane pushes, as in `[0, 0, 1]`"),
            );
            return None;
        }
        Some(ContactPlane { point: point?, normal, body: body?, within: within? })
    }

    /// Reads the only word that a key allows.
    fn word(&mut self, node: &Node, word: &str) -> Option<Spanned<()>> {
        if is_word(node, word) {
            return Some(Spanned { value: (), span: node.span });
        }
        let error = Diagnostic::error(codes::WRONG_TYPE, node.span, format!("expected `{word}`"));
        self.note(error.label(format!("this is {}", node.describe())));
        None
    }

    fn contact_points(&mut self, fields: &Fields) -> Option<ContactPoints> {
        let bodies = match fields.get("bodies").filter(|node| !is_word(node, ALL)) {
            None => Some(None),
            Some(node) => self.each_named(node, BODIES_FORM, Self::body_named).map(Some),
        };
        let points = match fields.get("points").filter(|node| !is_word(node, CORNERS)) {
            None => Some(None),
            Some(node) => self.each_named(node, POINTS_FORM, Self::point_named).map(Some),
        };
        match (bodies?, points?, fields.entry("bodies")) {
            (_, Some(_), Some(bodies)) => {
                let error = Diagnostic::error(
                    codes::BODIES_OF_POINTS,
                    bodies.key.span,
                    "both `bodies` and a list of `points`",
                );
                self.note(error.hint("remove `bodies`: each point belongs to a body already"));
                None
            }
            (_, Some(points), None) => Some(ContactPoints::Named(points)),
            (Some(bodies), None, _) => Some(ContactPoints::CornersOf(bodies)),
            (None, None, _) => Some(ContactPoints::Corners),
        }
    }

    /// Reads a list of names, each once.
    fn each_named<T>(
        &mut self,
        node: &Node,
        form: &str,
        named: impl Fn(&mut Self, &Node) -> Option<T>,
    ) -> Option<Vec<Spanned<T>>> {
        let nodes = items(node, form, &mut self.diagnostics)?;
        let mut seen = HashMap::new();
        let read: Vec<_> = nodes
            .iter()
            .map(|node| {
                let value = named(self, node)?;
                let name = self.text(node, "a name")?;
                self.once(&mut seen, &name).then_some(Spanned { value, span: node.span })
            })
            .collect();
        read.into_iter().collect()
    }
}

/// Returns whether a node is this word.
fn is_word(node: &Node, word: &str) -> bool {
    node.scalar().is_some_and(|scalar| scalar.text.trim() == word)
}
