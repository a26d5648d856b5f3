//! Parameters, inputs, and the constants that `tunable` turns into parameters.

use std::collections::HashMap;

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::fields::{Fields, array, items};
use crate::source::model::Parameter;
use crate::source::names::{self, Kind, hint};
use crate::source::schema::PARAMETER;
use crate::source::tunable::Tunable;
use crate::source::units::Dimension;
use crate::source::yaml::{Content, Entry, Node, shorten};

use super::Lowering;

impl Lowering<'_> {
    pub(super) fn parameter(&mut self, entry: &Entry) -> Option<Parameter> {
        let name = entry.key.clone();
        let Content::Mapping(_) = entry.value.content else {
            let (value, dimension) = self.parameter_value(&entry.value)?;
            return Some(Parameter { name, value, dimension, range: None });
        };
        let owner = format!("parameter `{}`", shorten(&name.value));
        let fields =
            Fields::new(&entry.value, name.span, owner, &PARAMETER, &mut self.diagnostics)?;
        let value = fields.require("value", &mut self.diagnostics);
        let value = value.and_then(|node| self.parameter_value(node));
        let range = match fields.get("range") {
            None => Some(None),
            Some(node) => self.range(node, &fields, value).map(Some),
        };
        let ((value, dimension), range) = (value?, range?);
        Some(Parameter { name, value, dimension, range })
    }

    /// Reads the smallest and the largest value of a parameter.
    fn range(
        &mut self,
        node: &Node,
        parameter: &Fields,
        value: Option<(f64, Option<Dimension>)>,
    ) -> Option<Spanned<[f64; 2]>> {
        let form = parameter.expected("range").form();
        let nodes: &[Node; 2] = array(node, form, &mut self.diagnostics)?;
        let ends = nodes.each_ref().map(|node| self.parameter_value(node));
        let ([Some(low), Some(high)], Some((value, dimension))) = (ends, value) else {
            return None;
        };
        for (end, node) in [low, high].into_iter().zip(nodes) {
            if let (Some(found), expected) = (end.1, dimension)
                && expected != Some(found)
            {
                let expected =
                    expected.map_or("a number without a unit".into(), |it| it.to_string());
                let message = format!("expected {expected}, found {found}");
                let error = Diagnostic::error(codes::WRONG_DIMENSION, node.span, message);
                self.note(error.hint("`value` and `range` have the same unit"));
                return None;
            }
        }
        let range = [low.0, high.0];
        if range[0] >= range[1] {
            let error = Diagnostic::error(codes::EMPTY_RANGE, node.span, "the range is empty");
            self.note(error.hint("give the smallest value first, then the largest"));
            return None;
        }
        if !(range[0]..=range[1]).contains(&value) {
            let message = format!("the value {value} is not in the range");
            let error = Diagnostic::error(codes::OUTSIDE_RANGE, node.span, message);
            self.note(error.hint("widen the range, or choose another value"));
            return None;
        }
        Some(Spanned { value: range, span: node.span })
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
