//! `pattern.joints`: creases at which something else acts than at all.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, entries};
use crate::source::model::{Friction, Joint, Spring};
use crate::source::schema::CREASE_JOINT;
use crate::source::yaml::{Entry, shorten};

use super::Lowering;

type Law = Spanned<Expression>;

/// What acts at one crease; None for what acts as at all creases.
pub(super) struct Actions {
    /// The number of the joint among those of the model.
    pub joint: usize,
    stiffness: Option<Law>,
    damping: Option<Law>,
    rest: Option<Law>,
    cubic_stiffness: Option<Law>,
    torque: Option<Law>,
    drive: Option<Law>,
    friction: Option<Friction>,
    limits: Option<Spanned<[f64; 2]>>,
    fold: Option<Spanned<f64>>,
}

impl Actions {
    /// Replaces what acts at the joint.
    pub fn replace(&self, joint: &mut Joint) {
        let Self { stiffness, damping, rest, cubic_stiffness, torque, drive, .. } = self;
        if let Some(stiffness) = stiffness {
            joint.spring = Spring::Stiffness(stiffness.clone());
        }
        let laws = [
            (damping, &mut joint.damping),
            (rest, &mut joint.rest),
            (cubic_stiffness, &mut joint.cubic_stiffness),
            (torque, &mut joint.torque),
        ];
        for (own, law) in laws {
            if let Some(own) = own {
                law.clone_from(own);
            }
        }
        joint.drive = drive.clone().or(joint.drive.take());
        joint.friction = self.friction.clone().or(joint.friction.take());
        joint.limits = self.limits.clone().or(joint.limits.take());
        joint.fold = self.fold.clone().or(joint.fold.take());
    }
}

impl Lowering<'_> {
    /// Reads what acts at single creases, whose names are known. `others` is the number of joints before those of
    /// the pattern, and `hinge` the place of a hinge model that gives the damping.
    pub(super) fn single_creases(
        &mut self,
        pattern: &Fields,
        others: usize,
        hinge: Option<Span>,
    ) -> Option<Vec<Actions>> {
        let entries = entries(pattern.get("joints"), "creases", &mut self.diagnostics);
        self.each(entries, |this, entry| this.actions(entry, others, hinge))
    }

    fn actions(&mut self, entry: &Entry, others: usize, hinge: Option<Span>) -> Option<Actions> {
        let at = entry.key.span;
        let joint = self.look_up(&entry.key, "joint", "joints", |names| &names.joints)?;
        let name = shorten(&entry.key.value);
        if joint < others {
            let message = format!("`{name}` is no crease of the pattern");
            let error = Diagnostic::error(codes::UNKNOWN_JOINT, at, message);
            self.note(error.hint("what acts at it stands in its entry of the model's `joints`"));
            return None;
        }
        let owner = format!("crease `{name}`");
        let fields = Fields::new(&entry.value, at, owner, &CREASE_JOINT, &mut self.diagnostics)?;
        let mut law = |key| match fields.get(key) {
            Some(_) => self.law(&fields, key).map(Some),
            None => Some(None),
        };
        let [stiffness, damping, rest, cubic_stiffness, torque] =
            ["stiffness", "damping", "rest", "cubic_stiffness", "torque"].map(&mut law);
        if let (Some(hinge), Some(None)) = (hinge, &stiffness) {
            self.no_other_damping(&fields, hinge)?;
        }
        let (drive, friction) = (self.drive(&fields), self.friction(&fields));
        let (limits, fold) = (self.limits(&fields), self.fold(&fields));
        Some(Actions {
            joint,
            stiffness: stiffness?,
            damping: damping?,
            rest: rest?,
            cubic_stiffness: cubic_stiffness?,
            torque: torque?,
            drive: drive?,
            friction: friction?,
            limits: limits?,
            fold: fold?,
        })
    }
}
