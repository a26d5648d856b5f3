//! Numbers and words of files that people write in YAML beside a model: plans of sweeps, goals.
//!
//! The tables of keys ([`Fields`]) give the defaults. A reader collects its mistakes, each under its own code where
//! no general one fits.

use lamc::source::fields::Fields;
use lamc::source::schema::{Presence, Range};
use lamc::source::yaml::{Node, shorten};
use lamc::source::{Code, Diagnostic, Diagnostics, Span, alternatives, codes, read_in};

/// A reader of a file beside a model.
pub trait Terms {
    /// The mistakes so far.
    fn found(&mut self) -> &mut Diagnostics;

    /// The code of mistakes that only such a file can have.
    fn code(&self) -> Code;

    /// A number of a key, or its default, in SI; `unit` is one of its dimension.
    fn number(&mut self, fields: &Fields, key: &str, unit: &str) -> Option<f64> {
        let node = fields.get(key);
        let text = match node {
            Some(node) => node.scalar().map_or("", |scalar| &scalar.text),
            None => default(fields, key),
        };
        let is_positive = fields.key(key).is_some_and(|key| key.range == Range::Positive);
        match (read_in(text, unit), node) {
            (Ok(value), Some(node)) if is_positive && value <= 0.0 => {
                self.wrong(node.span, format!("`{key}` must be more than 0"));
                None
            }
            (Ok(value), _) => Some(value),
            (Err(reason), Some(node)) => {
                self.not_a_number(node, reason);
                None
            }
            (Err(_), None) => None,
        }
    }

    /// A whole number of a key, or its default.
    fn whole(&mut self, fields: &Fields, key: &'static str) -> Option<u64> {
        let Some(node) = fields.read(key, self.found()) else {
            return default(fields, key).parse().ok();
        };
        let read = node.scalar().and_then(|scalar| {
            let text = scalar.text.trim().replace('_', "");
            // As 1e4 and 10.0, too.
            let number = || text.parse::<f64>().ok().filter(|number| is_whole(*number));
            text.parse().ok().or_else(|| number().map(|number| number as u64))
        });
        if read.is_none() {
            self.not_a_number(node, format!("`{key}` must be a whole number, 0 or more"));
        }
        read
    }

    /// A word of a key, or its default.
    fn word(
        &mut self,
        fields: &Fields,
        key: &str,
        words: &'static [&'static str],
    ) -> Option<&'static str> {
        match fields.get(key) {
            Some(node) => self.one_of(node, words),
            None => words.iter().copied().find(|word| *word == default(fields, key)),
        }
    }

    /// One of these words.
    fn one_of(&mut self, node: &Node, words: &'static [&'static str]) -> Option<&'static str> {
        let text = node.scalar().map(|scalar| &*scalar.text);
        let found = words.iter().copied().find(|word| Some(*word) == text);
        if found.is_none() {
            let error = Diagnostic::error(codes::WRONG_TYPE, node.span, "expected another word");
            let hint = alternatives(text.unwrap_or_default(), words, "words");
            self.found().push(error.label(format!("this is {}", node.describe())).hint(hint));
        }
        found
    }

    /// The place of a name among those that the model has of a kind: `point`.
    fn name(&mut self, at: Span, name: &str, known: &[&str], kind: &str) -> Option<usize> {
        let found = known.iter().position(|known| *known == name);
        if found.is_none() {
            let message = format!("the model has no {kind} `{}`", shorten(name));
            let many =
                kind.strip_suffix('y').map_or(format!("{kind}s"), |stem| format!("{stem}ies"));
            let hint = alternatives(name, known, &many);
            self.found().push(Diagnostic::error(codes::UNKNOWN_NAME, at, message).hint(hint));
        }
        found
    }

    /// Reports what only such a file can have wrong.
    fn wrong(&mut self, at: Span, message: impl Into<String>) {
        let error = Diagnostic::error(self.code(), at, message);
        self.found().push(error);
    }

    /// Reports what should be a number.
    fn not_a_number(&mut self, node: &Node, message: String) {
        let error = Diagnostic::error(codes::NOT_A_NUMBER, node.span, message);
        self.found().push(error.label(format!("this is {}", node.describe())));
    }
}

/// Whether a number is a whole one that a double holds exactly.
fn is_whole(number: f64) -> bool {
    const EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
    (0.0..=EXACT).contains(&number) && number.fract() == 0.0
}

/// The default of a key, as text.
fn default(fields: &Fields, key: &str) -> &'static str {
    match fields.key(key).map(|key| key.presence) {
        Some(Presence::Default(text)) => text,
        _ => "",
    }
}
