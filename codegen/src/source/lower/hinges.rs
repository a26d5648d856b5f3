//! The springs of joints: a stiffness, or a model of the hinge.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::fields::{Fields, items};
use crate::source::model::{HingeModel, Material, Spring};
use crate::source::names::hint;
use crate::source::polynomial::{Polynomial, Term};
use crate::source::schema::{
    HINGE_BEAM, HINGE_FAMILY, HINGE_MODEL, HINGE_SHARIFZADEH2018, HINGES, SPECIMEN, TERM,
};
use crate::source::yaml::{Entry, Node, shorten};

use super::Lowering;

/// The names of the hinge models that need no entry in the file.
fn built_in() -> impl Iterator<Item = &'static str> {
    HINGES.iter().filter_map(|(name, _)| *name)
}

impl Lowering<'_> {
    pub(super) fn spring(
        &mut self,
        fields: &Fields,
        materials: &Option<Vec<Material>>,
    ) -> Option<Spring> {
        match (fields.entry("hinge"), fields.entry("stiffness")) {
            (Some(hinge), Some(stiffness)) => {
                self.two_springs(hinge.key.span, stiffness.key.span);
                None
            }
            (Some(hinge), None) => self.hinge(&hinge.value, hinge.key.span, fields, materials),
            _ => self.law(fields, "stiffness").map(Spring::Stiffness),
        }
    }

    /// The keys depend on the model, so the model is read first.
    fn hinge(
        &mut self,
        node: &Node,
        at: Span,
        joint: &Fields,
        materials: &Option<Vec<Material>>,
    ) -> Option<Spring> {
        let Some(model) = node.get("model").filter(|model| !model.is_null()) else {
            let fields = Fields::new(node, at, "`hinge`", &HINGE_BEAM, &mut self.diagnostics)?;
            fields.require("model", &mut self.diagnostics);
            return None;
        };
        let name = self.text(model, "the name of a hinge model")?;
        match name.value.as_str() {
            "beam" => self.beam(node, at, materials),
            "sharifzadeh2018" => self.sharifzadeh2018(node, at, joint),
            other => {
                let named = &self.names.hinge_models;
                if let Some(model) = named.position(other) {
                    return self.family(node, at, joint, model);
                }
                self.unknown_hinge(&name);
                None
            }
        }
    }

    /// Reports a `stiffness` in addition to a model that computes it.
    pub(super) fn two_springs(&mut self, hinge: Span, stiffness: Span) {
        self.note(
            Diagnostic::error(codes::TWO_SPRINGS, stiffness, "both `stiffness` and `hinge`")
                .label("a second stiffness")
                .also(hinge, "the first is computed from this")
                .hint("keep one of them"),
        );
    }

    pub(super) fn unknown_hinge(&mut self, name: &Spanned<String>) {
        let named = &self.names.hinge_models;
        let known = || {
            let mut known: Vec<&str> = built_in().collect();
            known.extend(named.names());
            known
        };
        let message = format!("there is no hinge model `{}`", shorten(&name.value));
        let hint = hint(self.diagnostics.0.len(), &name.value, known, "hinge models");
        let error = Diagnostic::error(codes::UNKNOWN_HINGE, name.span, message);
        self.note(Diagnostic { hint, ..error });
    }

    fn beam(&mut self, node: &Node, at: Span, materials: &Option<Vec<Material>>) -> Option<Spring> {
        let fields = Fields::new(node, at, "`hinge`", &HINGE_BEAM, &mut self.diagnostics)?;
        let material = fields.require("material", &mut self.diagnostics);
        let material = material.and_then(|node| {
            let value = self.material_named(node)?;
            self.stiff_material(node, value, materials)?;
            Some(Spanned { value, span: node.span })
        });
        let [length, width] = ["length", "width"].map(|key| self.required_drawn(&fields, key));
        let gaps = self.optional_drawn(&fields, "gaps");
        Some(Spring::Beam { material: material?, length: length?, width: width?, gaps: gaps? })
    }

    fn sharifzadeh2018(&mut self, node: &Node, at: Span, joint: &Fields) -> Option<Spring> {
        let found = &mut self.diagnostics;
        let fields = Fields::new(node, at, "`hinge`", &HINGE_SHARIFZADEH2018, found)?;
        let [length, width] = self.hinge_size(&fields);
        let area = self.optional(&fields, "area");
        let printed = self.printed(&fields);
        self.no_other_damping(joint, at)?;
        let (length, width) = (length?, width?);
        Some(Spring::Sharifzadeh2018 { length, width, area: area?, printed: printed?, span: at })
    }

    /// Reads whether to use the coefficients as they are printed in the paper.
    fn printed(&mut self, fields: &Fields) -> Option<bool> {
        let Some(node) = fields.get("coefficients") else { return Some(false) };
        let name = self.text(node, "`corrected` or `printed`")?;
        let known = ["corrected", "printed"];
        let found = known.iter().position(|known| *known == name.value);
        if found.is_none() {
            let message = format!("there are no coefficients `{}`", shorten(&name.value));
            let earlier = self.diagnostics.0.len();
            let hint = hint(earlier, &name.value, || known.to_vec(), "coefficients");
            let error = Diagnostic::error(codes::UNKNOWN_COEFFICIENTS, name.span, message);
            self.note(Diagnostic { hint, ..error });
        }
        found.map(|index| index == 1)
    }

    fn family(&mut self, node: &Node, at: Span, joint: &Fields, model: usize) -> Option<Spring> {
        let fields = Fields::new(node, at, "`hinge`", &HINGE_FAMILY, &mut self.diagnostics)?;
        let [length, width] = self.hinge_size(&fields);
        let area = self.optional(&fields, "area");
        self.no_other_damping(joint, at)?;
        Some(Spring::Family { model, length: length?, width: width?, area: area?, span: at })
    }

    /// Reports a `damping` in addition to a model that computes it.
    pub(super) fn no_other_damping(&mut self, joint: &Fields, hinge: Span) -> Option<()> {
        let Some(damping) = joint.entry("damping") else { return Some(()) };
        self.note(
            Diagnostic::error(codes::TWO_DAMPINGS, damping.key.span, "both `damping` and `hinge`")
                .label("a second damping")
                .also(hinge, "the first is computed from this")
                .hint("this hinge model gives stiffness and damping: remove `damping`"),
        );
        None
    }

    /// Reads the polynomials of a family of hinges, which are in SI whatever `units` says.
    pub(super) fn hinge_model(&mut self, entry: &Entry) -> Option<HingeModel> {
        let owner = format!("hinge model `{}`", shorten(&entry.key.value));
        let at = entry.key.span;
        if built_in().any(|name| name == entry.key.value) {
            let message = format!("`{}` is a built-in hinge model", entry.key.value);
            self.note(
                Diagnostic::error(codes::DUPLICATE_NAME, at, message).hint("choose another name"),
            );
        }
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, at, owner, &HINGE_MODEL, found)?;
        let [stiffness, damping] = ["stiffness", "damping"].map(|key| {
            let node = fields.require(key, &mut self.diagnostics)?;
            let terms = items(node, fields.expected(key).form(), &mut self.diagnostics)?;
            let terms: Vec<_> = terms.iter().map(|node| self.term(node)).collect();
            terms.into_iter().collect::<Option<Vec<Term>>>().map(Polynomial)
        });
        let specimens = fields.require("specimens", &mut self.diagnostics)?;
        let form = fields.expected("specimens").form();
        let specimens = items(specimens, form, &mut self.diagnostics)?;
        let specimens: Vec<_> =
            specimens.iter().map(|node| self.numbers::<3>(node, &SPECIMEN)).collect();
        Some(HingeModel {
            name: entry.key.clone(),
            stiffness: stiffness?,
            damping: damping?,
            specimens: specimens.into_iter().collect::<Option<_>>()?,
        })
    }

    fn term(&mut self, node: &Node) -> Option<Term> {
        let [coefficient, powers @ ..] = self.numbers::<4>(node, &TERM)?;
        if powers.iter().any(|power| power.fract() != 0.0 || !(0.0..=9.0).contains(power)) {
            let message = "exponents are whole numbers from 0 to 9";
            self.note(Diagnostic::error(codes::BAD_EXPONENT, node.span, message));
            return None;
        }
        Some(Term { coefficient, powers: powers.map(|power| power as u8) })
    }

    /// Reads length and width of a hinge.
    fn hinge_size(&mut self, fields: &Fields) -> [Option<Spanned<f64>>; 2] {
        ["length", "width"].map(|key| self.required(fields, key))
    }

    /// Checks that the material of a beam has a Young's modulus. A material that could not be read
    /// has been reported already.
    pub(super) fn stiff_material(
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
                codes::NO_MODULUS,
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
