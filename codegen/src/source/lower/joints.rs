//! Joints: hinge line, spring, damper, limits, torque.

use std::f64::consts::PI;

use crate::arithmetic::hypot;
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Spanned};
use crate::source::drawn::Drawn;
use crate::source::expression::Expression;
use crate::source::fields::{Fields, array};
use crate::source::formula::number;
use crate::source::ids::BodyId;
use crate::source::model::{Friction, Joint, Material};
use crate::source::schema::{FRICTION, JOINT};
use crate::source::yaml::{Entry, Node, shorten};

use super::Lowering;

/// Largest angle of a fold, rad: half a turn, and the rounding error of other units than degrees.
const MOST_FOLDED: f64 = PI * (1.0 + 4.0 * f64::EPSILON);

impl Lowering<'_> {
    pub(super) fn joint(
        &mut self,
        entry: &Entry,
        fixed: &[bool],
        materials: &Option<Vec<Material>>,
    ) -> Option<Joint> {
        let name = &entry.key.value;
        let at = entry.key.span;
        let owner = format!("joint `{}`", shorten(name));
        let fields = Fields::new(&entry.value, at, owner, &JOINT, &mut self.diagnostics)?;
        let bodies = self.two_bodies(&fields, fixed, "joint");
        let axis = self.axis(&fields);
        let z = self.optional_drawn(&fields, "z");
        fields.get("z").into_iter().for_each(|node| self.note_decimals(node));
        let spring = self.spring(&fields, materials);
        let damping = self.law(&fields, "damping");
        let rest = self.law(&fields, "rest");
        let cubic_stiffness = self.law(&fields, "cubic_stiffness");
        let friction = self.friction(&fields);
        let torque = self.law(&fields, "torque");
        let drive = self.drive(&fields);
        let limits = self.limits(&fields);
        let fold = self.fold(&fields);
        Some(Joint {
            name: entry.key.clone(),
            bodies: bodies?,
            axis: axis?,
            z: z?.unwrap_or_default(),
            spring: spring?,
            damping: damping?,
            rest: rest?,
            cubic_stiffness: cubic_stiffness?,
            friction: friction?,
            limits: limits?,
            torque: torque?,
            drive: drive?,
            fold: fold?,
            span: entry.span(),
        })
    }

    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different \
                                             cases"
    )]
    pub(super) fn friction(&mut self, joint: &Fields) -> Option<Option<Friction>> {
        let Some(entry) = joint.entry("friction") else { return Some(None) };
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, "`friction`", &FRICTION, found)?;
        let torque = self.required_law(&fields, "torque");
        let speed = self.required(&fields, "speed");
        Some(Some(Friction { torque: torque?, speed: speed? }))
    }

    /// Reads the two bodies between which something, such as a joint, acts.
    pub(super) fn two_bodies(
        &mut self,
        fields: &Fields,
        fixed: &[bool],
        what: &str,
    ) -> Option<[Spanned<BodyId>; 2]> {
        let node = fields.read("bodies", &mut self.diagnostics)?;
        let form = fields.expected("bodies").form();
        let nodes: &[Node; 2] = array(node, form, &mut self.diagnostics)?;
        let [first, second] = nodes
            .each_ref()
            .map(|node| self.body_named(node).map(|value| Spanned { value, span: node.span }));
        let (first, second) = (first?, second?);
        let (code, message, hint) = if first.value == second.value {
            let message = format!("a {what} between a body and itself");
            (codes::SAME_BODY, message, "name two different bodies".to_owned())
        } else if fixed[first.value.index()] && fixed[second.value.index()] {
            (
                codes::BOTH_FIXED,
                format!("a {what} between two fixed bodies"),
                format!("it can never turn: remove the {what}, or `fixed` from one of the bodies"),
            )
        } else {
            return Some([first, second]);
        };
        self.note(Diagnostic::error(code, node.span, message).hint(hint));
        None
    }

    fn axis(&mut self, joint: &Fields) -> Option<Drawn<[[f64; 2]; 2]>> {
        let node = joint.read("axis", &mut self.diagnostics)?;
        let form = joint.expected("axis").form();
        let nodes: &[Node; 2] = array(node, form, &mut self.diagnostics)?;
        let ends = self.drawn_points(node, nodes)?;
        let (from, to) = (ends.value[0], ends.value[1]);
        // This includes lines so short that their length underflows: they have no direction either.
        if hypot(to[0] - from[0], to[1] - from[1]) < f64::MIN_POSITIVE {
            self.note(
                Diagnostic::error(codes::ZERO_AXIS, node.span, "the hinge line has no length")
                    .label("the same point twice")
                    .hint(
                        "give two different points; the joint turns about the line from the first \
                           to the second",
                    ),
            );
            return None;
        }
        Some(Drawn { value: [from, to], span: node.span, formulas: ends.formulas })
    }

    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different \
                                             cases"
    )]
    pub(super) fn limits(&mut self, joint: &Fields) -> Option<Option<Spanned<[f64; 2]>>> {
        let Some(node) = joint.get("limits") else { return Some(None) };
        let value = self.numbers::<2>(node, joint.expected("limits"))?;
        if value[0] >= value[1] {
            let error =
                Diagnostic::error(codes::EMPTY_LIMITS, node.span, "these limits allow no angle");
            self.note(error.label("the first must be less than the second"));
            return None;
        }
        Some(Some(Spanned { value, span: node.span }))
    }

    /// Reads the angle of the finished fold.
    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different \
                                             cases"
    )]
    pub(super) fn fold(&mut self, fields: &Fields) -> Option<Option<Spanned<f64>>> {
        let fold = self.optional(fields, "fold")?;
        if let Some(fold) = fold.as_ref().filter(|fold| fold.value.abs() > MOST_FOLDED) {
            let message = format!("a fold by {} deg", number(fold.value.to_degrees()));
            let error = Diagnostic::error(codes::FOLD_ANGLE, fold.span, message);
            self.note(error.label("more than half a turn").hint(
                "give the angle of the finished fold, from -180 deg (mountain) to 180 deg (valley)",
            ));
            return None;
        }
        Some(fold)
    }

    /// Reads the prescribed angle, which replaces a torque.
    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different \
                                             cases"
    )]
    pub(super) fn drive(&mut self, fields: &Fields) -> Option<Option<Spanned<Expression>>> {
        let Some(drive) = fields.entry("drive") else { return Some(None) };
        if let Some(torque) = fields.entry("torque") {
            self.note(
                Diagnostic::error(
                    codes::DRIVEN_TORQUE,
                    torque.key.span,
                    "both `torque` and `drive`",
                )
                .label("has no effect on a prescribed motion")
                .also(drive.key.span, "the motion is prescribed here")
                .hint("keep one of them: the torque that `drive` needs is computed"),
            );
            return None;
        }
        self.expression(&drive.value, fields.expected("drive")).map(Some)
    }
}
