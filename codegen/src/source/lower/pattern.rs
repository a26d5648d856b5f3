//! `pattern`: a drawing whose facets become bodies and whose creases become joints.

use std::collections::HashSet;

use lamc_drawings::{Reading, Role};

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, SourceFile, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, items};
use crate::source::ids::JointId;
use crate::source::model::{Material, SourceModel};
use crate::source::pattern::{
    Bytes, Crease, CreaseSpring, Drawn, Ground, Lines, Link, Settings, Sheet, Stack,
};
use crate::source::schema::{CREASE, CREASE_HINGE, DRAWN, LAYER_NAMES, LAYERS, PATTERN};
use crate::source::yaml::{Content, Entry, Node};

use super::creases::Actions;
use super::references::Declared;
use super::{Lowering, bodies};

/// A pattern that was read, before its bodies and joints are made.
pub(super) struct Patterned {
    drawn: Drawn,
    pub sheet: Sheet,
    settings: Settings,
    /// What acts at single creases; None after a mistake.
    actions: Option<Vec<Actions>>,
    span: Span,
}

impl Patterned {
    /// Which of its bodies are fixed.
    pub fn fixed(&self) -> impl Iterator<Item = bool> {
        (0..self.sheet.parts.len()).map(|part| self.sheet.ground == Some(part))
    }

    /// Default of the tolerance of the model, m.
    pub fn tolerance(&self) -> f64 {
        self.drawn.tolerance() * self.settings.scale
    }

    /// Whether a facet is fixed.
    pub fn is_grounded(&self) -> bool {
        self.sheet.ground.is_some()
    }

    /// Adds its bodies and joints to the model, after those that the model has.
    pub fn add(&self, model: &mut SourceModel, found: &mut Diagnostics) -> Option<()> {
        let before = [model.bodies.len(), model.joints.len()];
        let stack = Stack { materials: &model.materials, layup: &model.layup };
        let Self { drawn, sheet, settings, actions, span } = self;
        let built = sheet.build(drawn, settings, &stack, *span, before, found)?;
        model.bodies.extend(built.bodies);
        model.joints.extend(built.joints);
        actions.as_ref()?.iter().for_each(|own| own.replace(&mut model.joints[own.joint]));
        model.drawing = Some(drawn.file.clone());
        // The model may give other angles than the folded state of the drawing.
        let given: HashSet<JointId> = model.initial_q.iter().map(|(joint, _)| *joint).collect();
        let others = built.initial_q.into_iter().filter(|(joint, _)| !given.contains(joint));
        model.initial_q.extend(others);
        Some(())
    }
}

impl Lowering<'_> {
    /// Reads the pattern, if there is one, and makes its names known.
    #[allow(
        clippy::option_option,
        reason = "a missing pattern and a wrong pattern are different cases"
    )]
    pub(super) fn pattern(
        &mut self,
        model: &Fields,
        file: &SourceFile,
        declared: &Declared,
        sheet: (&Option<Vec<Material>>, &Option<Vec<usize>>),
        tolerance: Option<f64>,
    ) -> Option<Option<Patterned>> {
        let Some(entry) = model.entry("pattern") else { return Some(None) };
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, "`pattern`", &PATTERN, found)?;
        let path = fields.require("file", &mut self.diagnostics);
        let path = path.and_then(|node| self.text(node, "the path of a drawing"));
        let scale = self.scale(&fields);
        let ground = self.ground(&fields, declared);
        let triangulate = self.truth(&fields, "triangulate");
        let crease = self.crease(&fields, sheet);
        let fold = self.folds(&fields);
        let layers = self.layers_of_drawing(&fields);
        if model.get("layup").is_none() {
            let error = Diagnostic::error(codes::NO_LAYUP, at, "`pattern` needs a `layup`");
            self.note(
                error
                    .label("the materials of the sheet are missing")
                    .hint("add `layup: [..]`, the materials from bottom to top"),
            );
        }
        let (path, layers) = (path?, layers?);
        let reading = Reading { layers, ..Reading::default() };
        let (drawn, scale) = self.drawing(&path, file, &reading, scale?, tolerance)?;
        let (links, fixed) = (links(declared.joints), fixed_names(declared.bodies));
        let ground = (ground?, fields.get("ground").map(|node| node.span));
        let sheet =
            Sheet::of(&drawn, triangulate?, ground, (&links, &fixed), &mut self.diagnostics)?;
        self.declare(&sheet, declared)?;
        self.unused_folds(&fields, &sheet);
        let settings = Settings { scale, fold: fold?, crease: crease? };
        let hinge = fields.get("crease").and_then(|crease| crease.get("hinge"));
        let hinge = hinge.filter(|_| settings.crease.spring.damps()).map(|hinge| hinge.span);
        let actions = self.single_creases(&fields, declared.joints.len(), hinge);
        Some(Some(Patterned { drawn, sheet, settings, actions, span: path.span }))
    }

    /// Reads the drawing itself, and returns it with the length of its unit, m.
    fn drawing(
        &mut self,
        path: &Spanned<String>,
        file: &SourceFile,
        reading: &Reading,
        scale: Option<f64>,
        tolerance: Option<f64>,
    ) -> Option<(Drawn, f64)> {
        let bytes = match Bytes::read(&file.beside(&path.value)) {
            Ok(bytes) => bytes,
            Err(message) => {
                let error = Diagnostic::error(codes::UNREADABLE_DRAWING, path.span, message);
                self.note(error.hint("the path is relative to the folder of the model"));
                return None;
            }
        };
        let lines = match Lines::read(&bytes, reading) {
            Ok(lines) => lines,
            Err(errors) => {
                self.diagnostics.extend(errors.0);
                return None;
            }
        };
        let Some(scale) = scale.or(lines.drawing.unit) else {
            let message = format!("{} {}", bytes.path, lines.drawing.why_no_unit());
            let error = Diagnostic::error(codes::NO_SCALE, path.span, message);
            self.note(error.hint("give the length of one unit, as in `scale: 1 mm`"));
            return None;
        };
        // A tolerance of 0 is for the hinge lines, as they are after the drawing is mended.
        let tolerance = tolerance.filter(|tolerance| *tolerance > 0.0);
        match lines.drawn(tolerance.map(|tolerance| tolerance / scale)) {
            Ok(drawn) => {
                self.diagnostics.extend(drawn.notes().0);
                Some((drawn, scale))
            }
            Err(wrong) => {
                self.diagnostics.extend(wrong.found.0);
                None
            }
        }
    }

    /// Makes the names of facets and creases known, and refuses those that the model has too.
    fn declare(&mut self, sheet: &Sheet, declared: &Declared) -> Option<()> {
        let parts = sheet.parts.iter().map(|part| &part.name);
        let lines = sheet.lines.iter().map(|line| &line.name);
        let clash = |entries: &[Entry], names: &mut dyn Iterator<Item = &String>| {
            let names: HashSet<&String> = names.collect();
            entries.iter().find(|entry| names.contains(&entry.key.value)).map(|it| it.key.clone())
        };
        let clashes = [
            (clash(declared.bodies, &mut parts.clone()), "facet"),
            (clash(declared.joints, &mut lines.clone()), "crease"),
        ];
        let mut is_clear = true;
        for (name, what) in clashes {
            let Some(name) = name else { continue };
            let message = format!("`{}` is the name of a {what} of the pattern", name.value);
            let error = Diagnostic::error(codes::DUPLICATE_NAME, name.span, message);
            self.note(error.hint("choose another name"));
            is_clear = false;
        }
        self.names.bodies.extend(parts);
        self.names.joints.extend(lines);
        is_clear.then_some(())
    }

    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different cases"
    )]
    fn scale(&mut self, fields: &Fields) -> Option<Option<f64>> {
        let Some(scale) = self.optional(fields, "scale")? else { return Some(None) };
        if scale.value > 0.0 {
            return Some(Some(scale.value));
        }
        let error = Diagnostic::error(codes::NOT_POSITIVE, scale.span, "the scale is not positive");
        self.note(error.hint("give the length of one unit of the drawing"));
        None
    }

    fn ground(&mut self, fields: &Fields, declared: &Declared) -> Option<Ground> {
        let Some(node) = fields.get("ground") else { return Some(Ground::Largest) };
        if let Content::Sequence(_) = node.content {
            return self.numbers::<2>(node, &DRAWN).map(Ground::Around);
        }
        match node.scalar().map(|scalar| &*scalar.text) {
            Some("largest") => Some(Ground::Largest),
            Some("none") if bodies::none_fixed(declared.bodies) => {
                let message = "`ground: none` needs a fixed body under `bodies`";
                let error = Diagnostic::error(codes::NO_FIXED_BODY, node.span, message);
                self.note(error.hint("add `base: { fixed: true }`, and joints to facets"));
                None
            }
            Some("none") => Some(Ground::None),
            _ => {
                let message = "expected `largest`, `none` or a point `[x, y]`";
                let error = Diagnostic::error(codes::WRONG_TYPE, node.span, message);
                self.note(error.label(format!("this is {}", node.describe())));
                None
            }
        }
    }

    fn layers_of_drawing(&mut self, pattern: &Fields) -> Option<Vec<(Role, String)>> {
        let Some(entry) = pattern.entry("layers") else { return Some(Vec::new()) };
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, "`layers`", &LAYERS, found)?;
        let roles = [
            ("border", Role::Border),
            ("mountain", Role::Mountain),
            ("valley", Role::Valley),
            ("flat", Role::Flat),
            ("hinge", Role::Hinge),
            ("cut", Role::Cut),
        ];
        let mut layers = Vec::new();
        for (key, role) in roles {
            let Some(node) = fields.get(key) else { continue };
            let names = match node.content {
                Content::Sequence(_) => items(node, LAYER_NAMES.form(), &mut self.diagnostics)?,
                _ => std::slice::from_ref(node),
            };
            for name in names {
                layers.push((role, self.text(name, "the name of a layer")?.value));
            }
        }
        Some(layers)
    }

    fn crease(
        &mut self,
        pattern: &Fields,
        (materials, layup): (&Option<Vec<Material>>, &Option<Vec<usize>>),
    ) -> Option<Crease> {
        let zero = |span| Spanned { value: Expression::ZERO, span };
        let Some(entry) = pattern.entry("crease") else {
            let spring = CreaseSpring::Stiffness(zero(pattern.at()));
            let damping = zero(pattern.at());
            return Some(Crease { width: 0.0, spring, flexible: None, damping });
        };
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, "`crease`", &CREASE, found)?;
        let width = self.width(&fields);
        let damping = self.law(&fields, "damping");
        let Some(hinge) = fields.entry("hinge") else {
            let spring = CreaseSpring::Stiffness(self.law(&fields, "stiffness")?);
            return Some(Crease { width: width?, spring, flexible: None, damping: damping? });
        };
        let mut is_sound = true;
        if let Some(stiffness) = fields.entry("stiffness") {
            self.two_springs(hinge.key.span, stiffness.key.span);
            is_sound = false;
        }
        let (spring, flexible) = self.crease_hinge(hinge, &fields, materials, layup)?;
        let width = width?;
        if width == 0.0 {
            let message = "a `hinge` needs the `width` of the crease";
            let error = Diagnostic::error(codes::NO_CREASE_WIDTH, hinge.key.span, message);
            self.note(error.hint("give the width of the gap between the plates: `width: 1 mm`"));
            return None;
        }
        is_sound.then_some(Crease { width, spring, flexible, damping: damping? })
    }

    fn width(&mut self, crease: &Fields) -> Option<f64> {
        let Some(width) = self.optional(crease, "width")? else { return Some(0.0) };
        if width.value >= 0.0 {
            return Some(width.value);
        }
        let message = "the width of a crease is negative";
        self.note(Diagnostic::error(codes::NOT_POSITIVE, width.span, message));
        None
    }

    /// Reads the model of the hinges and the material of the flexible layer.
    fn crease_hinge(
        &mut self,
        entry: &Entry,
        crease: &Fields,
        materials: &Option<Vec<Material>>,
        layup: &Option<Vec<usize>>,
    ) -> Option<(CreaseSpring, Option<usize>)> {
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, "`hinge`", &CREASE_HINGE, found)?;
        let model = fields.require("model", &mut self.diagnostics);
        let model = model.and_then(|node| self.text(node, "the name of a hinge model"));
        let node = fields.get("material");
        let flexible = match node {
            None => None,
            Some(node) => Some(self.layer_named(node, layup)?),
        };
        let model = model?;
        let spring = match model.value.as_str() {
            "beam" => {
                let (Some(node), Some(value)) = (node, flexible) else {
                    let message = "a `beam` needs its `material`";
                    let error = Diagnostic::error(codes::NO_CREASE_MATERIAL, at, message);
                    self.note(error.hint("name the flexible material of the `layup`"));
                    return None;
                };
                self.stiff_material(node, value, materials)?;
                return Some((CreaseSpring::Beam(Spanned { value, span: node.span }), flexible));
            }
            "sharifzadeh2018" => CreaseSpring::Sharifzadeh2018,
            other => match self.names.hinge_models.position(other) {
                Some(family) => CreaseSpring::Family(family),
                None => {
                    self.unknown_hinge(&model);
                    return None;
                }
            },
        };
        self.no_other_damping(crease, at)?;
        Some((spring, flexible))
    }

    /// Returns the material of a layer.
    fn layer_named(&mut self, node: &Node, layup: &Option<Vec<usize>>) -> Option<usize> {
        let material = self.material_named(node)?;
        // A layup that could not be read has been reported.
        if layup.as_ref().is_none_or(|layup| layup.contains(&material)) {
            return Some(material);
        }
        let message = format!("{} is not in the `layup`", node.describe());
        let error = Diagnostic::error(codes::NO_CREASE_MATERIAL, node.span, message);
        self.note(error.hint("name the material of the layer that bends at the creases"));
        None
    }
}

/// The bodies of the joints of the model, as far as they can be read.
fn links(joints: &[Entry]) -> Vec<Link<'_>> {
    fn of(entry: &Entry) -> Option<Link<'_>> {
        let Content::Sequence(bodies) = &entry.value.get("bodies")?.content else { return None };
        let [one, other] = bodies.as_slice() else { return None };
        Some([&*one.scalar()?.text, &*other.scalar()?.text])
    }
    joints.iter().filter_map(of).collect()
}

/// The names of the fixed bodies of the model.
fn fixed_names(bodies: &[Entry]) -> Vec<&str> {
    let fixed = bodies::fixed(bodies);
    let named = bodies.iter().zip(fixed).filter(|(_, fixed)| *fixed);
    named.map(|(entry, _)| entry.key.value.as_str()).collect()
}
