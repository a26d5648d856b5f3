//! Parameters, inputs, and the constants that `tunable` turns into parameters.

use std::collections::HashMap;

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::fields::{Fields, items};
use crate::source::model::{Parameter, Tunable};
use crate::source::names::{self, Kind, hint};
use crate::source::yaml::{Entry, shorten};

use super::Lowering;

impl Lowering<'_> {
    pub(super) fn parameter(&mut self, entry: &Entry) -> Option<Parameter> {
        let (value, dimension) = self.parameter_value(&entry.value)?;
        Some(Parameter { name: entry.key.clone(), value, dimension })
    }

    /// Reads the names of the inputs, each once.
    pub(super) fn inputs(&mut self, model: &Fields) -> Vec<Spanned<String>> {
        let Some(node) = model.get("inputs") else { return Vec::new() };
        let form = model.expected("inputs").form();
        let nodes = items(node, form, &mut self.diagnostics).unwrap_or_default();
        let (mut inputs, mut seen) = (Vec::new(), HashMap::new());
        for node in nodes {
            let Some(name) = self.text(node, "the name of an input") else { continue };
            names::check(&name, Kind::Symbol("an input"), &mut self.diagnostics);
            if self.once(&mut seen, &name) {
                inputs.push(name);
            }
        }
        inputs
    }

    /// Reads `tunable` and checks that the names of parameters, inputs and the parameters it makes
    /// are different.
    pub(super) fn tunable(
        &mut self,
        model: &Fields,
        parameters: &[Entry],
        inputs: &[Spanned<String>],
        fixed: &[bool],
    ) -> Vec<Spanned<Tunable>> {
        let parameters = parameters.iter().map(|entry| (entry.key.value.as_str(), entry.key.span));
        let mut symbols: HashMap<&str, Span> = parameters.collect();
        for input in inputs {
            if let Some(first) = symbols.get(input.value.as_str()) {
                let message = format!("`{}` is both a parameter and an input", input.value);
                let error = Diagnostic::error(codes::DUPLICATE_NAME, input.span, message);
                self.note(error.label("the input").also(*first, "the parameter"));
            }
        }
        symbols.extend(inputs.iter().map(|input| (input.value.as_str(), input.span)));
        let tunable = self.tunable_constants(model);
        for kind in &tunable {
            for made in self.made_by(kind.value, fixed) {
                if let Some(clash) = symbols.get(made.as_str()) {
                    let message = format!("`{made}` is the name of a parameter made by `tunable`");
                    let error = Diagnostic::error(codes::DUPLICATE_NAME, *clash, message);
                    self.note(error.label("declared here").also(kind.span, "made here"));
                }
            }
        }
        tunable
    }

    /// Returns the names of the parameters that an item of `tunable` makes.
    fn made_by(&self, kind: Tunable, fixed: &[bool]) -> Vec<String> {
        match kind {
            Tunable::Mass => {
                let moving = self.names.bodies.all.iter().zip(fixed).filter(|(_, fixed)| !**fixed);
                moving.map(|(name, _)| kind.parameter_name(name)).collect()
            }
            _ => self.names.joints.all.iter().map(|name| kind.parameter_name(name)).collect(),
        }
    }

    fn tunable_constants(&mut self, model: &Fields) -> Vec<Spanned<Tunable>> {
        let form = model.expected("tunable").form();
        let nodes = model.get("tunable").and_then(|node| items(node, form, &mut self.diagnostics));
        let mut tunable: Vec<Spanned<Tunable>> = Vec::new();
        let mut seen = HashMap::new();
        for node in nodes.unwrap_or_default() {
            let Some(name) = self.text(node, "the name of a constant that becomes tunable") else {
                continue;
            };
            let known: Vec<_> = Tunable::ALL.iter().map(|kind| kind.name()).collect();
            let Some(kind) = Tunable::ALL.into_iter().find(|kind| kind.name() == name.value) else {
                let message = format!("`{}` cannot be tunable", shorten(&name.value));
                let earlier = self.diagnostics.0.len();
                let hint = hint(earlier, &name.value, || known, "tunable constants");
                let error = Diagnostic::error(codes::UNKNOWN_TUNABLE, name.span, message);
                self.note(Diagnostic { hint, ..error });
                continue;
            };
            if self.once(&mut seen, &name) {
                tunable.push(Spanned { value: kind, span: node.span });
            }
        }
        tunable
    }
}
