//! Names, numbers and words of a plan.

use std::f64::consts::TAU;

use lamc::source::fields::Fields;
use lamc::source::schema::{Presence, Range};
use lamc::source::yaml::{Entry, Node, shorten};
use lamc::source::{
    Diagnostic, Dimension, Span, alternatives, beyond_a_turn, codes, has_no_unit, read_as, read_in,
};

use super::read::Reader;
use super::{Quantity, Target};

impl Reader<'_> {
    /// The quantity that a key names.
    pub(super) fn quantity(&mut self, entry: &Entry) -> Option<Quantity> {
        let name = entry.key.value.as_str();
        if let Some(found) = self.quantities.iter().find(|it| it.name == name) {
            if !found.has_effect {
                let message = format!("nothing in the model depends on `{name}`");
                let error = Diagnostic::error(codes::BAD_PLAN, entry.key.span, message);
                self.found.push(error.hint(
                    "remove it from the plan; an input that was replaced by a formula has no value any more",
                ));
            }
            return Some(found.clone());
        }
        let known: Vec<&str> = self.quantities.iter().map(|it| it.name.as_str()).collect();
        let message = format!("the model has no quantity `{}`", shorten(name));
        let error = Diagnostic::error(codes::UNKNOWN_NAME, entry.key.span, message)
            .label("neither a parameter nor `initial.<joint>` nor `input.<input>`")
            .hint(alternatives(name, &known, "quantities"));
        self.found.push(error);
        None
    }

    /// A value of a quantity, SI.
    pub(super) fn value(&mut self, node: &Node, quantity: &Quantity) -> Option<f64> {
        let Some(scalar) = node.scalar().filter(|_| !node.is_null()) else {
            self.not_a_number(node, "expected a number".to_owned());
            return None;
        };
        let text = scalar.text.trim();
        let read = match quantity.target {
            Target::Initial(_) => {
                self.angle.read(text).ok_or_else(|| "expected an angle, such as `30deg`".to_owned())
            }
            Target::Parameter(_) | Target::Input(_) => read_as(text, quantity.dimension),
        };
        match read {
            Ok(value) => {
                self.warn_of_turns(node, quantity, value);
                Some(value)
            }
            Err(reason) => {
                self.not_a_number(node, reason);
                None
            }
        }
    }

    /// Refuses an angle of more than a turn without a unit, which was meant in degrees.
    pub(super) fn warn_of_turns(&mut self, node: &Node, quantity: &Quantity, value: f64) {
        let is_radian = match quantity.target {
            Target::Initial(_) => self.angle.is_radian(),
            _ => quantity.dimension.is_some_and(Dimension::is_angle),
        };
        let bare = node.scalar().is_some_and(|scalar| has_no_unit(&scalar.text));
        if let Some(turns) = beyond_a_turn(value).filter(|_| is_radian && bare) {
            let degrees = (value % TAU).to_degrees();
            let error = Diagnostic::error(codes::BAD_PLAN, node.span, turns);
            self.found.push(
                error.hint(format!(
                    "write `{value}deg` if degrees are meant, else `{degrees:.4}deg`"
                )),
            );
        }
    }

    /// A number of a key, or its default.
    pub(super) fn number(&mut self, fields: &Fields, key: &str, unit: &str) -> Option<f64> {
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
    pub(super) fn whole(&mut self, fields: &Fields, key: &'static str) -> Option<u64> {
        let Some(node) = fields.read(key, &mut self.found) else {
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
    pub(super) fn word(
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

    pub(super) fn one_of(
        &mut self,
        node: &Node,
        words: &'static [&'static str],
    ) -> Option<&'static str> {
        let text = node.scalar().map(|scalar| &*scalar.text);
        let found = words.iter().copied().find(|word| Some(*word) == text);
        if found.is_none() {
            let error = Diagnostic::error(codes::WRONG_TYPE, node.span, "expected another word");
            let hint = alternatives(text.unwrap_or_default(), words, "words");
            self.found.push(error.label(format!("this is {}", node.describe())).hint(hint));
        }
        found
    }

    pub(super) fn wrong(&mut self, at: Span, message: impl Into<String>) {
        self.found.push(Diagnostic::error(codes::BAD_PLAN, at, message));
    }

    pub(super) fn not_a_number(&mut self, node: &Node, message: String) {
        let error = Diagnostic::error(codes::NOT_A_NUMBER, node.span, message);
        self.found.push(error.label(format!("this is {}", node.describe())));
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
