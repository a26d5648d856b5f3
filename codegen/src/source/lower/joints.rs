//! Joints: hinge line, spring, damper, limits, torque.

use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, array, items};
use crate::source::ids::BodyId;
use crate::source::model::{Friction, HingeModel, Joint, Material, Spring};
use crate::source::names::alternatives;
use crate::source::polynomial::{Polynomial, Term};
use crate::source::units::{
    ANGLE, ANGULAR_SPEED, AREA, CUBIC_STIFFNESS, DAMPING, LENGTH, NUMBER, Quantity, STIFFNESS,
    TORQUE,
};
use crate::source::yaml::{Entry, Node, shorten};

use super::{Lowering, Uses};

const KEYS: &[&str] = &[
    "bodies",
    "axis",
    "z",
    "stiffness",
    "damping",
    "rest",
    "limits",
    "torque",
    "hinge",
    "drive",
    "cubic_stiffness",
    "friction",
];
const BEAM_KEYS: &[&str] = &["model", "material", "length", "width", "gaps"];
const HINGE_MODELS: &[&str] = &["beam", "sharifzadeh2018"];
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
        fields.get("z").into_iter().for_each(|node| self.note_decimals(node));
        let spring = self.spring(&fields, at, materials);
        let damping = self.law(&fields, at, "damping", &DAMPING, NO_MOTION);
        let rest = self.law(&fields, at, "rest", &ANGLE, NO_MOTION);
        let cubic_stiffness = self.law(&fields, at, "cubic_stiffness", &CUBIC_STIFFNESS, NO_MOTION);
        let friction = self.friction(&fields);
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
            cubic_stiffness: cubic_stiffness?,
            friction: friction?,
            limits: limits?,
            torque: torque?,
            drive: drive?,
            span: entry.span(),
        })
    }

    #[allow(clippy::option_option, reason = "absent and wrong are different things")]
    fn friction(&mut self, joint: &Fields) -> Option<Option<Friction>> {
        let Some(entry) = joint.entry("friction") else { return Some(None) };
        let (at, known) = (entry.key.span, ["torque", "speed"]);
        let fields = Fields::new(&entry.value, at, "`friction`", &known, &mut self.diagnostics)?;
        let torque = fields.require("torque", &mut self.diagnostics);
        let torque = torque.and_then(|node| self.expression(node, &TORQUE, NO_MOTION));
        let speed = fields.require("speed", &mut self.diagnostics);
        let speed = speed.and_then(|node| self.number(node, &ANGULAR_SPEED));
        Some(Some(Friction { torque: torque?, speed: speed? }))
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
        let [from, to] = nodes.each_ref().map(|node| self.drawn_point(node));
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
            (Some(hinge), None) => self.hinge(&hinge.value, hinge.key.span, fields, materials),
            _ => self.law(fields, at, "stiffness", &STIFFNESS, NO_MOTION).map(Spring::Stiffness),
        }
    }

    /// Each model has keys of its own: the model comes first.
    fn hinge(
        &mut self,
        node: &Node,
        at: Span,
        joint: &Fields,
        materials: &Option<Vec<Material>>,
    ) -> Option<Spring> {
        let Some(model) = node.get("model").filter(|model| !model.is_null()) else {
            let fields = Fields::new(node, at, "`hinge`", BEAM_KEYS, &mut self.diagnostics)?;
            fields.require("model", &mut self.diagnostics);
            return None;
        };
        let name = self.text(model, "the name of a hinge model")?;
        match name.value.as_str() {
            "beam" => self.beam(node, at, materials),
            "sharifzadeh2018" => self.sharifzadeh2018(node, at, joint),
            other => {
                let named = &self.names.hinge_models;
                if let Some(model) = named.iter().position(|known| known == other) {
                    return self.family(node, at, joint, model);
                }
                let mut known = HINGE_MODELS.to_vec();
                known.extend(named.iter().map(String::as_str));
                let message = format!("there is no hinge model `{}`", shorten(other));
                let hint = alternatives(other, &known, "hinge models");
                self.note(Diagnostic::error("unknown-hinge", name.span, message).hint(hint));
                None
            }
        }
    }

    fn beam(&mut self, node: &Node, at: Span, materials: &Option<Vec<Material>>) -> Option<Spring> {
        let fields = Fields::new(node, at, "`hinge`", BEAM_KEYS, &mut self.diagnostics)?;
        let material = fields.require("material", &mut self.diagnostics);
        let material = material.and_then(|node| {
            let value = self.material_named(node)?;
            self.stiff_material(node, value, materials)?;
            Some(Spanned { value, span: node.span })
        });
        let [length, width] = self.hinge_size(&fields);
        let gaps = self.optional(fields.get("gaps"), &LENGTH);
        Some(Spring::Beam { material: material?, length: length?, width: width?, gaps: gaps? })
    }

    fn sharifzadeh2018(&mut self, node: &Node, at: Span, joint: &Fields) -> Option<Spring> {
        let known = ["model", "length", "width", "area", "coefficients"];
        let fields = Fields::new(node, at, "`hinge`", &known, &mut self.diagnostics)?;
        let [length, width] = self.hinge_size(&fields);
        let area = self.optional(fields.get("area"), &AREA);
        let printed = match fields.get("coefficients") {
            None => Some(false),
            Some(node) => {
                let name = self.text(node, "`corrected` or `printed`")?;
                let known = ["corrected", "printed"];
                let found = known.iter().position(|known| *known == name.value);
                if found.is_none() {
                    let message = format!("there are no coefficients `{}`", shorten(&name.value));
                    let hint = alternatives(&name.value, &known, "coefficients");
                    self.note(
                        Diagnostic::error("unknown-coefficients", name.span, message).hint(hint),
                    );
                }
                found.map(|index| index == 1)
            }
        };
        self.no_other_damping(joint, at)?;
        let (length, width) = (length?, width?);
        Some(Spring::Sharifzadeh2018 { length, width, area: area?, printed: printed?, span: at })
    }

    fn family(&mut self, node: &Node, at: Span, joint: &Fields, model: usize) -> Option<Spring> {
        let known = ["model", "length", "width", "area"];
        let fields = Fields::new(node, at, "`hinge`", &known, &mut self.diagnostics)?;
        let [length, width] = self.hinge_size(&fields);
        let area = self.optional(fields.get("area"), &AREA);
        self.no_other_damping(joint, at)?;
        Some(Spring::Family { model, length: length?, width: width?, area: area?, span: at })
    }

    /// A model that gives the damping leaves no place for another.
    fn no_other_damping(&mut self, joint: &Fields, hinge: Span) -> Option<()> {
        let Some(damping) = joint.entry("damping") else { return Some(()) };
        self.note(
            Diagnostic::error("two-dampings", damping.key.span, "`damping` besides `hinge`")
                .label("a second damping")
                .also(hinge, "the first is computed from this")
                .hint("this hinge model gives stiffness and damping: remove `damping`"),
        );
        None
    }

    /// Polynomials of a family of hinges, SI whatever `units` says.
    pub(super) fn hinge_model(&mut self, entry: &Entry) -> Option<HingeModel> {
        let known = ["stiffness", "damping", "specimens"];
        let owner = format!("hinge model `{}`", entry.key.value);
        let at = entry.key.span;
        if HINGE_MODELS.contains(&entry.key.value.as_str()) {
            let message = format!("`{}` is a hinge model of lamc's own", entry.key.value);
            self.note(Diagnostic::error("duplicate-name", at, message).hint("choose another name"));
        }
        let fields = Fields::new(&entry.value, at, owner, &known, &mut self.diagnostics)?;
        let [stiffness, damping] = ["stiffness", "damping"].map(|key| {
            let node = fields.require(key, &mut self.diagnostics)?;
            let what = "a list of terms, `[coefficient, l, w, a]`";
            let terms = items(node, what, &mut self.diagnostics)?;
            let terms: Vec<_> = terms.iter().map(|node| self.term(node)).collect();
            terms.into_iter().collect::<Option<Vec<Term>>>().map(Polynomial)
        });
        let specimens = fields.require("specimens", &mut self.diagnostics)?;
        let what = "a list of `[length, width, area]`";
        let specimens = items(specimens, what, &mut self.diagnostics)?;
        let specimens: Vec<_> = specimens
            .iter()
            .map(|node| self.numbers::<3>(node, "`[length, width, area]`", &NUMBER))
            .collect();
        Some(HingeModel {
            name: entry.key.clone(),
            stiffness: stiffness?,
            damping: damping?,
            specimens: specimens.into_iter().collect::<Option<_>>()?,
        })
    }

    fn term(&mut self, node: &Node) -> Option<Term> {
        let what = "a coefficient and the exponents of length, width and area";
        let [coefficient, powers @ ..] = self.numbers::<4>(node, what, &NUMBER)?;
        if powers.iter().any(|power| power.fract() != 0.0 || !(0.0..=9.0).contains(power)) {
            let message = "exponents are whole numbers from 0 to 9";
            self.note(Diagnostic::error("bad-exponent", node.span, message));
            return None;
        }
        Some(Term { coefficient, powers: powers.map(|power| power as u8) })
    }

    /// Length and width of a hinge.
    fn hinge_size(&mut self, fields: &Fields) -> [Option<Spanned<f64>>; 2] {
        ["length", "width"].map(|key| {
            let node = fields.require(key, &mut self.diagnostics);
            node.and_then(|node| self.number(node, &LENGTH))
        })
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
