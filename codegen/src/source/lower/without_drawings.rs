//! `pattern` in a build without the readers of drawings: an error that says how to get them.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, SourceFile};
use crate::source::fields::Fields;
use crate::source::model::{Material, SourceModel};

use super::Lowering;
use super::references::Declared;

/// A pattern, which this build cannot read.
pub(super) enum Patterned {}

impl Patterned {
    pub fn is_grounded(&self) -> bool {
        match *self {}
    }

    pub fn fixed(&self) -> impl Iterator<Item = bool> {
        std::iter::empty()
    }

    pub fn free(&self) -> impl Iterator<Item = bool> {
        std::iter::empty()
    }

    pub fn tolerance(&self) -> f64 {
        match *self {}
    }

    pub fn add(&self, _: &mut SourceModel, _: &mut Diagnostics) -> Option<()> {
        match *self {}
    }
}

impl Lowering<'_> {
    /// Refuses a pattern.
    #[allow(
        clippy::option_option,
        reason = "a missing pattern and a wrong pattern are different cases"
    )]
    pub(super) fn pattern(
        &mut self,
        model: &Fields,
        _: &SourceFile,
        _: &Declared,
        _: (&Option<Vec<Material>>, &Option<Vec<usize>>),
        _: Option<f64>,
    ) -> Option<Option<Patterned>> {
        let Some(entry) = model.entry("pattern") else { return Some(None) };
        let message = "this build of lamc reads no drawings";
        let error = Diagnostic::error(codes::NO_DRAWINGS, entry.key.span, message);
        self.note(error.label("needs the feature `drawings`").hint(
            "write `lamc = { version = \"..\", features = [\"drawings\"] }` under \
             `[build-dependencies]`, or let `lamc import` write bodies and joints",
        ));
        None
    }
}

#[cfg(test)]
mod tests {
    use crate::source::{SourceFile, parse};

    #[test]
    fn a_pattern_needs_the_feature() {
        let text = "pattern: { file: sheet.svg }\njoints: { j: { bodies: [a, facet_1_2] } }\n";
        let errors = parse(&SourceFile { path: "m.yaml".into(), text: text.into() }).unwrap_err();
        let found: Vec<_> = errors.0.iter().map(|error| error.code.name).collect();
        assert_eq!(found, ["no-drawings", "missing-key"]);
        assert_eq!(errors.0[0].span.map(|span| &text[span.start..span.end]), Some("pattern"));
    }
}
