//! Numbers with units, lists of numbers, and texts.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::fields::{Fields, array};
use crate::source::names::{closest, hint};
use crate::source::schema::Value;
use crate::source::units::{self, ANGLE, Dimension, Quantity, SI, Unit, UnitError};
use crate::source::yaml::{Content, Node, shorten};

use super::{Lowering, Names};

impl Lowering<'_> {
    /// Reads a text, such as a name.
    pub(super) fn text(&mut self, node: &Node, what: &str) -> Option<Spanned<String>> {
        match node.scalar().filter(|_| !node.is_null()) {
            Some(scalar) => Some(Spanned { value: scalar.text.to_string(), span: node.span }),
            None => {
                let error =
                    Diagnostic::error(codes::WRONG_TYPE, node.span, format!("expected {what}"));
                self.note(error.label(format!("this is {}", node.describe())));
                None
            }
        }
    }

    /// Reads a finite number with or without unit.
    pub(super) fn number(&mut self, node: &Node, quantity: &Quantity) -> Option<Spanned<f64>> {
        let text = node.scalar().map(|scalar| scalar.text.trim());
        if let Some((number, unit)) = text.and_then(units::split_quantity) {
            let value = self.quantity(node, number, unit, Some(quantity))?;
            if unit.is_empty() && *quantity == ANGLE && self.angle == SI {
                self.warn_of_turns(node.span, value);
            }
            return Some(Spanned { value, span: node.span });
        }
        if self.is_infinite(node) {
            return None;
        }
        let error = Diagnostic::error(
            codes::NOT_A_NUMBER,
            node.span,
            format!("expected {}", quantity.name),
        )
        .label(format!("{} is not a number", node.describe()));
        let units = quantity.examples;
        let hint = match text.filter(|_| !node.is_null()) {
            Some(_) => format!(
                "write a number without a unit or in {units}; expressions are not \
                                allowed here"
            ),
            None => format!("write a number without a unit or in {units}"),
        };
        self.note(error.hint(hint));
        None
    }

    /// Reads the number of a required key.
    pub(super) fn required(&mut self, fields: &Fields, key: &str) -> Option<Spanned<f64>> {
        let node = fields.require(key, &mut self.diagnostics)?;
        self.number(node, fields.expected(key).measured().0)
    }

    /// Reads the number of an optional key: `Some(None)` if the key is missing.
    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different \
                                             cases"
    )]
    pub(super) fn optional(&mut self, fields: &Fields, key: &str) -> Option<Option<Spanned<f64>>> {
        match fields.get(key) {
            None => Some(None),
            Some(node) => self.number(node, fields.expected(key).measured().0).map(Some),
        }
    }

    /// Reads the numbers of a required key.
    pub(super) fn required_numbers<const K: usize>(
        &mut self,
        fields: &Fields,
        key: &str,
    ) -> Option<Spanned<[f64; K]>> {
        let node = fields.require(key, &mut self.diagnostics)?;
        let value = self.numbers(node, fields.expected(key))?;
        Some(Spanned { value, span: node.span })
    }

    /// Reads the default of a parameter: a number, and its dimension if it has a unit.
    pub(super) fn parameter_value(&mut self, node: &Node) -> Option<(f64, Option<Dimension>)> {
        let text = node.scalar().map(|scalar| scalar.text.trim());
        if let Some((number, unit)) = text.and_then(units::split_quantity) {
            let value = self.quantity(node, number, unit, None)?;
            let dimension = units::parse_unit(unit.trim_end()).ok().map(|unit| unit.dimension);
            let dimension = dimension.filter(|dimension| *dimension != units::NUMBER.dimension);
            return Some((value, dimension));
        }
        if !self.is_infinite(node) {
            let error = Diagnostic::error(
                codes::NOT_A_NUMBER,
                node.span,
                "the default of a parameter must be a number",
            )
            .label(format!("this is {}", node.describe()));
            self.note(error.hint(
                "numbers without a unit are in SI and radians; a unit may follow, as \
                            in `20 mm`",
            ));
        }
        None
    }

    /// Reports the infinities and the NaN of YAML.
    pub(super) fn is_infinite(&mut self, node: &Node) -> bool {
        let Some(scalar) = node.scalar() else { return false };
        let text = scalar.text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        let infinite = matches!(text.as_str(), ".inf" | ".nan" | "inf" | "nan" | "infinity");
        if infinite {
            self.note(not_finite(node.span, &scalar.text));
        }
        infinite
    }

    /// Returns the value of `number` in `unit`, in SI; numbers without a unit are in the file's
    /// units.
    fn quantity(
        &mut self,
        node: &Node,
        number: &str,
        unit: &str,
        quantity: Option<&Quantity>,
    ) -> Option<f64> {
        let unit = match (unit, quantity) {
            ("", Some(quantity)) => self.default_unit(quantity),
            ("", None) => SI,
            _ => self.unit(node, unit, quantity)?,
        };
        let value = unit.to_si(number);
        if !value.is_finite() {
            self.note(not_finite(node.span, number));
            return None;
        }
        Some(value)
    }

    /// Returns the unit of numbers without a unit.
    fn default_unit(&self, quantity: &Quantity) -> Unit {
        match quantity {
            _ if *quantity == units::LENGTH => self.length,
            _ if *quantity == units::ANGLE || *quantity == units::ANGULAR_SPEED => self.angle,
            _ => SI,
        }
    }

    /// Reads a unit and checks that it measures `quantity`.
    fn unit(&mut self, node: &Node, unit: &str, quantity: Option<&Quantity>) -> Option<Unit> {
        let text = node.scalar().map_or("", |scalar| &scalar.text);
        // The unit is the end of the text.
        let at = text.trim_end().len() - unit.trim_end().len();
        let within = |range: &std::ops::Range<usize>| {
            node.span_within(self.source, at + range.start, at + range.end)
        };
        let (code, span, message, label, hint) = match units::parse_unit(unit.trim_end()) {
            Ok(found) => match quantity.filter(|quantity| quantity.dimension != found.dimension) {
                None => return Some(found),
                Some(quantity) => (
                    codes::WRONG_DIMENSION,
                    node.span,
                    format!("expected {}, found {}", quantity.name, found.dimension),
                    format!("`{}` is {}", unit.trim_end(), found.dimension),
                    format!("{} is in {}", quantity.name, quantity.examples),
                ),
            },
            Err(UnitError::Unknown(range)) => {
                let name = &unit[range.clone()];
                let Names { parameters, inputs, .. } = &self.names;
                let is_symbol = [parameters, inputs].iter().any(|it| it.position(name).is_some());
                let hint = if is_symbol || matches!(name, "t" | "pi") {
                    format!("`{name}` is a name and not a unit: write a product with `*`")
                } else {
                    self.unit_hint(name, quantity)
                };
                let message = format!("unknown unit `{}`", shorten(name));
                (codes::UNKNOWN_UNIT, within(&range), message, "unknown unit".into(), hint)
            }
            Err(UnitError::Malformed(range)) => (
                codes::BAD_UNIT,
                within(&range),
                format!("`{}` is not a unit", shorten(unit)),
                "the unit cannot be read from here on".into(),
                "a unit is a product of powers, as in `mN*m/rad` or `g*mm^2`".into(),
            ),
        };
        self.note(Diagnostic::error(code, span, message).label(label).hint(hint));
        None
    }

    /// A hint for an unknown unit.
    fn unit_hint(&self, name: &str, quantity: Option<&Quantity>) -> String {
        let known = || units::all_units();
        match (hint(self.diagnostics.0.len(), name, known, "units"), quantity) {
            (Some(hint), _) if closest(name, &known()).is_some() => hint,
            (_, Some(quantity)) => format!("{} is in {}", quantity.name, quantity.examples),
            (hint, None) => hint.unwrap_or_default(),
        }
    }

    /// Reads a list of numbers of known length.
    pub(super) fn numbers<const K: usize>(
        &mut self,
        node: &Node,
        value: &Value,
    ) -> Option<[f64; K]> {
        let nodes: &[Node; K] = array(node, value.form(), &mut self.diagnostics)?;
        let (quantity, _) = value.measured();
        let read = nodes.each_ref().map(|node| self.number(node, quantity));
        read.iter().all(Option::is_some).then(|| read.map(|x| x.map_or(f64::NAN, |x| x.value)))
    }

    /// Records the number of decimals of each coordinate of a point.
    pub(super) fn note_decimals_of(&mut self, point: &Node) {
        if let Content::Sequence(coordinates) = &point.content {
            coordinates.iter().for_each(|coordinate| self.note_decimals(coordinate));
        }
    }

    /// Records the number of decimals of a coordinate.
    pub(super) fn note_decimals(&mut self, node: &Node) {
        let text = node.scalar().map(|scalar| scalar.text.trim());
        let Some((number, unit)) = text.and_then(units::split_quantity) else { return };
        let unit = if unit.is_empty() { Ok(self.length) } else { units::parse_unit(unit) };
        unit.into_iter().for_each(|unit| self.decimals.note(number, unit));
    }
}

fn not_finite(span: Span, text: &str) -> Diagnostic {
    Diagnostic::error(
        codes::NOT_FINITE,
        span,
        format!("`{}` is not a finite number", shorten(text)),
    )
    .label("this is too large or not a number")
}
