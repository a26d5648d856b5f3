//! Node tree of our schema -> [`SourceModel`]: resolves names and converts quantities to SI and
//! radians.
//!
//! Errors are collected and reading continues, so that one run reports all of them. If a function
//! here returns `None`, the reason has been reported. The keys and their quantities are defined in
//! [`schema`].

use super::argument::AngleUnit;
use super::codes;
use super::diagnostic::{Diagnostic, Diagnostics, SourceFile, Span, Spanned};
use super::fields::Fields;
use super::model::{Joint, MAX_HINGES, Parameter, SourceModel};
use super::rounding::Decimals;
use super::schema;
use super::units::{self, Unit};
use super::yaml::{Entry, Node};

mod bodies;
mod contacts;
mod controllers;
#[cfg(feature = "drawings")]
mod creases;
mod drawn;
mod elements;
#[cfg(feature = "drawings")]
mod folds;
mod formulas;
mod hinges;
mod joints;
mod outputs;
#[cfg(feature = "drawings")]
mod pattern;
#[cfg(not(feature = "drawings"))]
#[path = "without_drawings.rs"]
mod pattern;
mod references;
mod scalars;
mod sheet;
mod symbols;

use pattern::Patterned;
use references::{Declared, Names};

/// Acceleration of gravity on Earth, along -z, m/s^2.
pub(super) const STANDARD_GRAVITY: f64 = 9.81;

struct Lowering<'s> {
    /// The text of the file.
    source: &'s str,
    diagnostics: Diagnostics,
    /// The units of lengths and angles that are written without a unit.
    length: Unit,
    angle: Unit,
    names: Names,
    /// The materials in file order, without those that could not be read.
    parameters: Vec<Option<Parameter>>,
    /// The decimals of the coordinates read so far.
    decimals: Decimals,
}

/// Reads a model in our schema. Errors are in the diagnostics; without errors there is a model.
pub(super) fn lower(root: &Node, file: &SourceFile) -> (Option<SourceModel>, Diagnostics) {
    let mut lowering = Lowering {
        source: &file.text,
        diagnostics: Diagnostics::default(),
        length: units::SI,
        angle: units::SI,
        names: Names::default(),
        parameters: Vec::new(),
        decimals: Decimals::default(),
    };
    let model = lowering.model(root, file);
    (model, lowering.diagnostics)
}

/// Returns which bodies are fixed and which are free, those of the file first.
fn fixed_and_free(bodies: &[Entry], pattern: Option<&Option<Patterned>>) -> [Vec<bool>; 2] {
    let [mut fixed, mut free] = ["fixed", "free"].map(|key| bodies::marked(bodies, key));
    for pattern in pattern.into_iter().flatten() {
        fixed.extend(pattern.fixed());
        free.extend(pattern.free());
    }
    [fixed, free]
}

impl Lowering<'_> {
    fn model(&mut self, root: &Node, file: &SourceFile) -> Option<SourceModel> {
        let start = Span { start: root.span.start, end: root.span.start };
        let fields = Fields::new(root, start, "a model", &schema::MODEL, &mut self.diagnostics)?;
        self.units(&fields);
        let declared = self.declared(&fields);
        let inputs = self.inputs(&fields);
        self.names = Names::of(&declared, &inputs);
        self.parameters = declared.parameters.iter().map(|entry| self.parameter(entry)).collect();
        let name = self.name(fields.get("name"), file);
        let gravity = self.gravity(&fields);
        let materials = self.each(declared.materials, Self::material);
        let layup = self.layup(&fields);
        let tolerance = self.optional(&fields, "tolerance");
        let given = tolerance.iter().flatten().map(|tolerance| tolerance.value).next();
        let pattern = self.pattern(&fields, file, &declared, (&materials, &layup), given);
        let layers = fields.get("layup").map(|_| layup.as_ref().map_or(0, Vec::len));
        let bodies = self.each(declared.bodies, |this, entry| this.body(entry, layers));
        let [fixed, free] = fixed_and_free(declared.bodies, pattern.as_ref());
        self.refuse_without_motion(&fields, &declared, &pattern);
        let hinge_models = self.each(declared.hinge_models, Self::hinge_model);
        let joints = self.each(declared.joints, |this, it| this.joint(it, &fixed, &materials));
        let tunable = self.tunable(&fields, declared.parameters, &inputs, &fixed);
        let initial = self.initial(&fields, &free);
        let points = self.each(declared.points, Self::point);
        let elements = self.elements(&declared, points.as_deref(), &fixed);
        let contacts = self.each(declared.contacts, Self::contact);
        let controllers = self.controllers(declared.controllers);
        let (forces, air) = (self.each(declared.forces, Self::force), self.air(&fields));
        if pattern.is_none() {
            self.forget_consequences();
        }
        let model = SourceModel {
            cuts: Vec::new(),
            max_hinges: MAX_HINGES,
            name: name?,
            angle: AngleUnit(self.angle),
            gravity: gravity?,
            materials: materials?,
            layup: layup?,
            bodies: bodies?,
            joints: joints?,
            parameters: std::mem::take(&mut self.parameters).into_iter().collect::<Option<_>>()?,
            inputs,
            tunable,
            initial_q: initial.q,
            initial_u: initial.u,
            initial_fold: initial.fold,
            initial_bodies: initial.bodies,
            points: points?,
            forces: forces?,
            elements: elements?,
            contacts: contacts?,
            controllers: controllers?,
            hinge_models: hinge_models?,
            air: air?,
            tolerance: 0.0,
            drawing: None,
        };
        self.finish(model, pattern?, tolerance?)
    }

    /// Adds the bodies and joints of the pattern, and finds the tolerance.
    fn finish(
        &mut self,
        mut model: SourceModel,
        pattern: Option<Patterned>,
        tolerance: Option<Spanned<f64>>,
    ) -> Option<SourceModel> {
        if let Some(pattern) = &pattern {
            pattern.add(&mut model, &mut self.diagnostics)?;
        }
        let moving = model.joints.iter().find(|it| !(it.axis.is_fixed() && it.z.is_fixed()));
        model.tolerance = match (tolerance.clone(), &pattern) {
            (None, _) if moving.is_some() => 0.0,
            (None, Some(pattern)) => pattern.tolerance(),
            (given, _) => self.tolerance(given, &model.bodies, &model.joints)?,
        };
        self.refuse_moving_lines(tolerance, moving, model.tolerance);
        Some(model)
    }

    /// Reports hinge lines that depend on parameters and shall be moved because they are rounded.
    fn refuse_moving_lines(
        &mut self,
        given: Option<Spanned<f64>>,
        moving: Option<&Joint>,
        tolerance: f64,
    ) {
        if let (Some(given), Some(joint)) = (given.filter(|_| tolerance > 0.0), moving) {
            let name = &joint.name.value;
            let message = format!("the hinge line of `{name}` depends on parameters");
            let error = Diagnostic::error(codes::NOT_PARAMETRIC, joint.axis.span, message);
            self.note(
                error
                    .label("a formula is exact")
                    .also(given.span, "hinge lines are moved by up to this")
                    .hint("remove `tolerance`: it is 0 where hinge lines have formulas"),
            );
        }
    }

    /// Reports a model without a fixed or free body, or without joints and free bodies. A pattern that could
    /// not be read may have all of them.
    fn refuse_without_motion(
        &mut self,
        model: &Fields,
        declared: &Declared,
        pattern: &Option<Option<Patterned>>,
    ) {
        let Some(pattern) = pattern else { return };
        let is_grounded = pattern.as_ref().is_some_and(Patterned::is_grounded);
        if !declared.bodies.is_empty() && !bodies::some_root(declared.bodies) && !is_grounded {
            self.no_fixed_body(model, declared.bodies);
        }
        let may_move = bodies::marked(declared.bodies, "free").contains(&true);
        let moves = !declared.joints.is_empty() || may_move || pattern.is_some();
        let bodies = model.entry("bodies");
        if let Some(entry) = model.entry("joints").or(bodies).filter(|_| !moves) {
            let error = Diagnostic::error(codes::NO_JOINTS, entry.key.span, "there are no joints");
            self.note(error.hint("nothing can move: a mechanism needs a joint or a free body"));
        }
    }

    /// Forgets mistakes that follow from a pattern that could not be read: what refers to its facets.
    fn forget_consequences(&mut self) {
        let follows = [codes::UNKNOWN_BODY, codes::UNKNOWN_JOINT];
        self.diagnostics.0.retain(|found| !follows.contains(&found.code));
    }

    fn note(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Reads every entry, even after an error; `None` if there was an error.
    fn each<T>(
        &mut self,
        entries: &[Entry],
        mut read: impl FnMut(&mut Self, &Entry) -> Option<T>,
    ) -> Option<Vec<T>> {
        let read: Vec<Option<T>> = entries.iter().map(|entry| read(self, entry)).collect();
        read.into_iter().collect()
    }
}
