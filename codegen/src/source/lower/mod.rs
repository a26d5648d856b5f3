//! Node tree of our schema -> [`SourceModel`]: resolves names and converts quantities to SI and
//! radians.
//!
//! Errors are collected and reading continues, so that one run reports all of them. If a function
//! here returns `None`, the reason has been reported. The keys and their quantities are defined in
//! [`schema`].

use super::argument::AngleUnit;
use super::codes;
use super::diagnostic::{Diagnostic, Diagnostics, SourceFile, Span};
use super::fields::Fields;
use super::model::{MAX_HINGES, Parameter, SourceModel};
use super::rounding::Decimals;
use super::schema;
use super::units::{self, Unit};
use super::yaml::{Entry, Node};

mod bodies;
mod formulas;
mod hinges;
mod joints;
mod outputs;
mod references;
mod scalars;
mod sheet;
mod symbols;

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
        let layers = fields.get("layup").map(|_| layup.as_ref().map_or(0, Vec::len));
        let bodies = self.each(declared.bodies, |this, entry| this.body(entry, layers));
        let fixed = bodies::fixed(declared.bodies);
        self.refuse_without_motion(&fields, &declared);
        let hinge_models = self.each(declared.hinge_models, Self::hinge_model);
        let joints = self.each(declared.joints, |this, it| this.joint(it, &fixed, &materials));
        let tunable = self.tunable(&fields, declared.parameters, &inputs, &fixed);
        let [initial_q, initial_u] = self.initial(&fields);
        let points = self.each(declared.points, Self::point);
        let forces = self.each(declared.forces, Self::force);
        let air = self.air(&fields);
        let tolerance = self.optional(&fields, "tolerance");
        let (bodies, joints) = (bodies?, joints?);
        let tolerance = self.tolerance(tolerance?, &bodies, &joints);
        Some(SourceModel {
            cuts: Vec::new(),
            max_hinges: MAX_HINGES,
            name: name?,
            angle: AngleUnit(self.angle),
            gravity: gravity?,
            materials: materials?,
            layup: layup?,
            bodies,
            joints,
            parameters: std::mem::take(&mut self.parameters).into_iter().collect::<Option<_>>()?,
            inputs,
            tunable,
            initial_q,
            initial_u,
            points: points?,
            forces: forces?,
            hinge_models: hinge_models?,
            air: air?,
            tolerance: tolerance?,
        })
    }

    /// Reports a model without a fixed body or without joints.
    fn refuse_without_motion(&mut self, model: &Fields, declared: &Declared) {
        if !declared.bodies.is_empty() && bodies::none_fixed(declared.bodies) {
            self.no_fixed_body(model, declared.bodies);
        }
        if let Some(entry) = model.entry("joints").filter(|_| declared.joints.is_empty()) {
            let error = Diagnostic::error(codes::NO_JOINTS, entry.span(), "there are no joints");
            self.note(error.hint("nothing can move: a mechanism needs a joint"));
        }
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
