//! Joints: hinge line, spring, damper, limits, torque.

use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, array};
use crate::source::ids::BodyId;
use crate::source::model::{Joint, Material, Spring};
use crate::source::units::{ANGLE, DAMPING, LENGTH, Quantity, STIFFNESS, TORQUE};
use crate::source::yaml::{Entry, Node};

use super::{Lowering, Uses};

const KEYS: &[&str] =
    &["bodies", "axis", "z", "stiffness", "damping", "rest", "limits", "torque", "hinge", "drive"];
const PRESCRIBED: Uses = Uses::Constants(
    "a prescribed angle is a function of t, parameters and inputs; a law of q and u goes into \
     `torque`",
);
const NO_MOTION: Uses = Uses::Constants(
    "the spring k*(q - rest) and the damper b*u have their q and u already; other laws of q and u \
     go into `torque`",
);

impl Lowering<'_> {
    pub(super) fn joint(
        &mut self,
        entry: &Entry,
        fixed: &[bool],
        materials: &Option<Vec<Material>>,
    ) -> Option<Joint> {
        let name = &entry.key.value;
        let at = entry.key.span;
        let owner = format!("joint `{name}`");
        let fields = Fields::new(&entry.value, at, owner, KEYS, &mut self.diagnostics)?;
        let bodies = fields.require("bodies", &mut self.diagnostics);
        let bodies = bodies.and_then(|node| self.joint_bodies(node, fixed));
        let axis = fields.require("axis", &mut self.diagnostics);
        let axis = axis.and_then(|node| self.axis(node));
        let z = self.optional(fields.get("z"), &LENGTH);
        let spring = self.spring(&fields, at, materials);
        let damping = self.law(&fields, at, "damping", &DAMPING, NO_MOTION);
        let rest = self.law(&fields, at, "rest", &ANGLE, NO_MOTION);
        let torque = self.law(&fields, at, "torque", &TORQUE, Uses::Motion);
        let drive = self.drive(&fields);
        let limits = match fields.get("limits") {
            None => Some(None),
            Some(node) => self.limits(node).map(Some),
        };
        Some(Joint {
            name: entry.key.clone(),
            bodies: bodies?,
            axis: axis?,
            z: z?.map_or(0.0, |z| z.value),
            spring: spring?,
            damping: damping?,
            rest: rest?,
            limits: limits?,
            torque: torque?,
            drive: drive?,
            span: entry.span(),
        })
    }

    fn joint_bodies(&mut self, node: &Node, fixed: &[bool]) -> Option<[Spanned<BodyId>; 2]> {
        let nodes: &[Node; 2] =
            array(node, "two bodies, `[first, second]`", &mut self.diagnostics)?;
        let [first, second] = nodes
            .each_ref()
            .map(|node| self.body_named(node).map(|value| Spanned { value, span: node.span }));
        let (first, second) = (first?, second?);
        let (code, message, hint) = if first.value == second.value {
            ("same-body", "a joint between a body and itself", "name two different bodies")
        } else if fixed[first.value.index()] && fixed[second.value.index()] {
            (
                "both-fixed",
                "a joint between two fixed bodies",
                "it can never turn: remove the joint, or `fixed` from one of the bodies",
            )
        } else {
            return Some([first, second]);
        };
        self.note(Diagnostic::error(code, node.span, message).hint(hint));
        None
    }

    fn axis(&mut self, node: &Node) -> Option<Spanned<[[f64; 2]; 2]>> {
        let what = "two points of the hinge line, `[[x, y], [x, y]]`";
        let nodes: &[Node; 2] = array(node, what, &mut self.diagnostics)?;
        let [from, to] = nodes.each_ref().map(|node| self.numbers::<2>(node, "`[x, y]`", &LENGTH));
        let (from, to) = (from?, to?);
        // Also lines so short that their length underflows: they have no direction either.
        if (to[0] - from[0]).hypot(to[1] - from[1]) < f64::MIN_POSITIVE {
            self.note(
                Diagnostic::error("zero-axis", node.span, "the hinge line has no length")
                    .label("twice the same point")
                    .hint(
                        "give two different points; the joint turns about the line from the first \
                           to the second",
                    ),
            );
            return None;
        }
        Some(Spanned { value: [from, to], span: node.span })
    }

    fn limits(&mut self, node: &Node) -> Option<Spanned<[f64; 2]>> {
        let value = self.numbers::<2>(node, "`[lowest, highest]`", &ANGLE)?;
        if value[0] >= value[1] {
            let error =
                Diagnostic::error("empty-limits", node.span, "no angle is within these limits");
            self.note(error.label("the first must be less than the second"));
            return None;
        }
        Some(Spanned { value, span: node.span })
    }

    /// An expression that is 0 when it is not given.
    fn law(
        &mut self,
        fields: &Fields,
        at: Span,
        key: &str,
        quantity: &Quantity,
        uses: Uses,
    ) -> Option<Spanned<Expression>> {
        match fields.get(key) {
            None => Some(Spanned { value: Expression::ZERO, span: at }),
            Some(node) => self.expression(node, quantity, uses),
        }
    }

    /// The prescribed angle, which stands in the place of a torque.
    #[allow(clippy::option_option, reason = "absent and wrong are different things")]
    fn drive(&mut self, fields: &Fields) -> Option<Option<Spanned<Expression>>> {
        let Some(drive) = fields.entry("drive") else { return Some(None) };
        if let Some(torque) = fields.entry("torque") {
            self.note(
                Diagnostic::error("driven-torque", torque.key.span, "`torque` besides `drive`")
                    .label("changes nothing of a prescribed motion")
                    .also(drive.key.span, "the joint follows this")
                    .hint("keep one of them: the torque that `drive` needs is a result"),
            );
            return None;
        }
        self.expression(&drive.value, &ANGLE, PRESCRIBED).map(Some)
    }

    fn spring(
        &mut self,
        fields: &Fields,
        at: Span,
        materials: &Option<Vec<Material>>,
    ) -> Option<Spring> {
        match (fields.entry("hinge"), fields.entry("stiffness")) {
            (Some(hinge), Some(stiffness)) => {
                self.note(
                    Diagnostic::error(
                        "two-springs",
                        stiffness.key.span,
                        "`stiffness` besides `hinge`",
                    )
                    .label("a second stiffness")
                    .also(hinge.key.span, "the first is computed from this")
                    .hint("keep one of them"),
                );
                None
            }
            (Some(hinge), None) => self.beam(&hinge.value, hinge.key.span, materials),
            _ => self.law(fields, at, "stiffness", &STIFFNESS, NO_MOTION).map(Spring::Stiffness),
        }
    }

    fn beam(&mut self, node: &Node, at: Span, materials: &Option<Vec<Material>>) -> Option<Spring> {
        // Other models have keys of their own: the model comes first.
        if let Some(model) = node.get("model").filter(|model| !model.is_null()) {
            let name = self.text(model, "the name of a hinge model")?;
            if name.value != "beam" {
                let message = format!("lamc has no hinge model `{}` yet", name.value);
                self.note(
                    Diagnostic::error("unknown-hinge", name.span, message)
                        .hint("the hinge model is `beam`; or give the `stiffness` itself"),
                );
                return None;
            }
        }
        let known = ["model", "material", "length", "width"];
        let fields = Fields::new(node, at, "`hinge`", &known, &mut self.diagnostics)?;
        let model = fields.require("model", &mut self.diagnostics);
        let material = fields.require("material", &mut self.diagnostics);
        let material = material.and_then(|node| {
            let value = self.material_named(node)?;
            self.stiff_material(node, value, materials)?;
            Some(Spanned { value, span: node.span })
        });
        let length = fields.require("length", &mut self.diagnostics);
        let length = length.and_then(|node| self.number(node, &LENGTH));
        let width = fields.require("width", &mut self.diagnostics);
        let width = width.and_then(|node| self.number(node, &LENGTH));
        model?;
        Some(Spring::Beam { material: material?, length: length?, width: width? })
    }

    /// A beam's material needs a Young's modulus. Materials with errors of their own are let by.
    fn stiff_material(
        &mut self,
        node: &Node,
        material: usize,
        materials: &Option<Vec<Material>>,
    ) -> Option<()> {
        let Some(material) = materials.as_ref().map(|materials| &materials[material]) else {
            return Some(());
        };
        if material.youngs_modulus.is_some() {
            return Some(());
        }
        let name = &material.name;
        self.note(
            Diagnostic::error(
                "no-modulus",
                node.span,
                format!("`{}` has no `youngs_modulus`", name.value),
            )
            .label("a beam's stiffness needs it")
            .also(name.span, "the material")
            .hint("add it to the material, as in `youngs_modulus: 4.4 GPa`"),
        );
        None
    }
}
