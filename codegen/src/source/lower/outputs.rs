//! Output points and the forces on them.

use crate::source::fields::Fields;
use crate::source::model::{Force, Point};
use crate::source::schema::{FORCE, POINT};
use crate::source::yaml::{Entry, shorten};

use super::Lowering;

impl Lowering<'_> {
    pub(super) fn point(&mut self, entry: &Entry) -> Option<Point> {
        let owner = format!("point `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &POINT, found)?;
        let body = fields.read("body", &mut self.diagnostics);
        let body = body.and_then(|node| self.body_named(node));
        let at = self.required_place(&fields, "at");
        Some(Point { name: entry.key.clone(), body: body?, at: at? })
    }

    pub(super) fn force(&mut self, entry: &Entry) -> Option<Force> {
        let owner = format!("force `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &FORCE, found)?;
        let point = fields.read("point", &mut self.diagnostics);
        let point = point.and_then(|node| self.point_named(node));
        let force = fields.read("force", &mut self.diagnostics);
        let force = force.and_then(|node| self.vector(node, fields.expected("force")));
        Some(Force { name: entry.key.clone(), point: point?, force: force? })
    }
}
