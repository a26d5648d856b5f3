//! Output points and the forces on them.

use crate::source::fields::Fields;
use crate::source::model::{Force, Point};
use crate::source::units::{FORCE, LENGTH};
use crate::source::yaml::Entry;

use super::{Lowering, Uses};

impl Lowering<'_> {
    pub(super) fn point(&mut self, entry: &Entry) -> Option<Point> {
        let owner = format!("point `{}`", entry.key.value);
        let known = ["body", "at"];
        let fields =
            Fields::new(&entry.value, entry.key.span, owner, &known, &mut self.diagnostics)?;
        let body = fields.require("body", &mut self.diagnostics);
        let body = body.and_then(|node| self.body_named(node));
        let at = fields.require("at", &mut self.diagnostics);
        let at = at.and_then(|node| self.numbers::<3>(node, "`[x, y, z]`", &LENGTH));
        Some(Point { name: entry.key.clone(), body: body?, at: at? })
    }

    pub(super) fn force(&mut self, entry: &Entry) -> Option<Force> {
        let owner = format!("force `{}`", entry.key.value);
        let known = ["point", "force"];
        let fields =
            Fields::new(&entry.value, entry.key.span, owner, &known, &mut self.diagnostics)?;
        let point = fields.require("point", &mut self.diagnostics);
        let point = point.and_then(|node| self.point_named(node));
        let force = fields.require("force", &mut self.diagnostics);
        let force = force.and_then(|node| self.vector(node, &FORCE, Uses::Motion));
        Some(Force { name: entry.key.clone(), point: point?, force: force? })
    }
}
