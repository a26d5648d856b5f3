//! Names and values of a plan.

use std::f64::consts::TAU;

use lamc::source::yaml::{Entry, Node, shorten};
use lamc::source::{
    Code, Diagnostic, Diagnostics, Dimension, alternatives, beyond_a_turn, codes, has_no_unit,
    read_as,
};

use super::read::Reader;
use super::{Quantity, Target};
use crate::reading::Terms;

impl Terms for Reader<'_> {
    fn found(&mut self) -> &mut Diagnostics {
        &mut self.found
    }

    fn code(&self) -> Code {
        self.code
    }
}

impl Reader<'_> {
    /// The quantity that a key names.
    pub(super) fn quantity(&mut self, entry: &Entry) -> Option<Quantity> {
        let name = entry.key.value.as_str();
        if let Some(found) = self.quantities.iter().find(|it| it.name == name) {
            if !found.has_effect {
                let message = format!("nothing in the model depends on `{name}`");
                let error = Diagnostic::error(self.code, entry.key.span, message);
                self.found.push(error.hint(
                    "remove it; an input that was replaced by a formula has no value any more",
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
            let error = Diagnostic::error(self.code, node.span, turns);
            self.found.push(
                error.hint(format!(
                    "write `{value}deg` if degrees are meant, else `{degrees:.4}deg`"
                )),
            );
        }
    }
}
