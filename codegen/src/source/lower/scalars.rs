//! Numbers with units, expressions, vectors and texts.

use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::expression::{Expression, Operator, Unary};
use crate::source::fields::array;
use crate::source::formula::{self, Scope};
use crate::source::given::beyond_a_turn;
use crate::source::ids::{InputId, JointId, ParameterId};
use crate::source::model::{Body, Joint};
use crate::source::names::alternatives;
use crate::source::rounding;
use crate::source::units::{self, ANGLE, Dimension, LENGTH, Quantity, SI, Unit, UnitError};
use crate::source::yaml::{Content, Node, shorten};

use super::{Lowering, Names};

/// More, over the size of the drawing, is no rounding but another drawing.
const LARGEST_TOLERANCE: f64 = 1e-2;

/// What an expression may depend on, besides parameters, inputs and t.
#[derive(Clone, Copy)]
pub(super) enum Uses {
    /// Nothing else, for this reason.
    Constants(&'static str),
    /// `q.<joint>` and `u.<joint>`.
    Motion,
}

struct Symbols<'n> {
    names: &'n Names,
    uses: Uses,
}

impl Scope for Symbols<'_> {
    fn symbol(&self, name: &str) -> Option<Expression> {
        let at = |list: &[String]| list.iter().position(|known| known == name);
        let parameter = at(&self.names.parameters).map(|i| Expression::Parameter(ParameterId(i)));
        parameter.or_else(|| at(&self.names.inputs).map(|i| Expression::Input(InputId(i))))
    }

    fn symbols(&self) -> Vec<&str> {
        self.names.parameters.iter().chain(&self.names.inputs).map(String::as_str).collect()
    }

    fn joint(&self, name: &str) -> Option<JointId> {
        self.names.joints.iter().position(|known| known == name).map(JointId)
    }

    fn joints(&self) -> Vec<&str> {
        self.names.joints.iter().map(String::as_str).collect()
    }

    fn motion_refused(&self) -> Option<&'static str> {
        match self.uses {
            Uses::Constants(reason) => Some(reason),
            Uses::Motion => None,
        }
    }
}

impl Lowering<'_> {
    /// A text, such as a name.
    pub(super) fn text(&mut self, node: &Node, what: &str) -> Option<Spanned<String>> {
        match node.scalar().filter(|_| !node.is_null()) {
            Some(scalar) => Some(Spanned { value: scalar.text.to_string(), span: node.span }),
            None => {
                let error = Diagnostic::error("wrong-type", node.span, format!("expected {what}"));
                self.note(error.label(format!("this is {}", node.describe())));
                None
            }
        }
    }

    /// A finite number with or without unit.
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
        let error =
            Diagnostic::error("not-a-number", node.span, format!("expected {}", quantity.name))
                .label(format!("{} is not a number", node.describe()));
        let units = quantity.examples;
        let hint = match text.filter(|_| !node.is_null()) {
            Some(_) => format!("write a number, bare or in {units}; expressions cannot stand here"),
            None => format!("write a number, bare or in {units}"),
        };
        self.note(error.hint(hint));
        None
    }

    /// A number that may be absent: `Some(None)` when it is.
    #[allow(clippy::option_option, reason = "absent and wrong are different things")]
    pub(super) fn optional(
        &mut self,
        node: Option<&Node>,
        quantity: &Quantity,
    ) -> Option<Option<Spanned<f64>>> {
        match node {
            None => Some(None),
            Some(node) => self.number(node, quantity).map(Some),
        }
    }

    /// A parameter's default: a number, and what it measures where a unit says it.
    pub(super) fn parameter_value(&mut self, node: &Node) -> Option<(f64, Option<Dimension>)> {
        let text = node.scalar().map(|scalar| scalar.text.trim());
        if let Some((number, unit)) = text.and_then(units::split_quantity) {
            let value = self.quantity(node, number, unit, None)?;
            let dimension = units::parse_unit(unit.trim_end()).ok().map(|unit| unit.dimension);
            let dimension = dimension.filter(|dimension| *dimension != units::NUMBER.dimension);
            return Some((value, dimension));
        }
        if !self.is_infinite(node) {
            let error =
                Diagnostic::error("not-a-number", node.span, "a parameter's default is a number")
                    .label(format!("this is {}", node.describe()));
            self.note(
                error.hint("bare numbers are SI and radians; a unit may follow, as in `20 mm`"),
            );
        }
        None
    }

    /// Reports YAML's infinities and not-a-number.
    fn is_infinite(&mut self, node: &Node) -> bool {
        let Some(scalar) = node.scalar() else { return false };
        let text = scalar.text.trim_start_matches(['+', '-']).to_ascii_lowercase();
        let infinite = matches!(text.as_str(), ".inf" | ".nan" | "inf" | "nan" | "infinity");
        if infinite {
            self.note(not_finite(node.span, &scalar.text));
        }
        infinite
    }

    /// The value of `number` in `unit`, in SI; bare numbers take the file's units.
    fn quantity(
        &mut self,
        node: &Node,
        number: &str,
        unit: &str,
        quantity: Option<&Quantity>,
    ) -> Option<f64> {
        let unit = match (unit, quantity) {
            ("", Some(quantity)) => self.bare_unit(quantity),
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

    /// What bare numbers are in.
    fn bare_unit(&self, quantity: &Quantity) -> Unit {
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
                    "wrong-dimension",
                    node.span,
                    format!("expected {}, found {}", quantity.name, found.dimension),
                    format!("`{}` is {}", unit.trim_end(), found.dimension),
                    format!("{} is in {}", quantity.name, quantity.examples),
                ),
            },
            Err(UnitError::Unknown(range)) => {
                let name = &unit[range.clone()];
                let symbols = self.names.parameters.iter().chain(&self.names.inputs);
                let hint = if symbols.map(String::as_str).chain(["t", "pi"]).any(|n| n == name) {
                    format!("`{name}` is no unit but a name: write the product with its `*`")
                } else {
                    let known = units::unit_names();
                    match (crate::source::names::closest(name, &known), quantity) {
                        (None, Some(quantity)) => {
                            format!("{} is in {}", quantity.name, quantity.examples)
                        }
                        _ => alternatives(name, &known, "units"),
                    }
                };
                let message = format!("unknown unit `{}`", shorten(name));
                ("unknown-unit", within(&range), message, "unknown unit".into(), hint)
            }
            Err(UnitError::Malformed(range)) => (
                "bad-unit",
                within(&range),
                format!("`{}` is no unit", shorten(unit)),
                "cannot be read from here".into(),
                "a unit is a product of powers, as in `mN*m/rad` or `g*mm^2`".into(),
            ),
        };
        self.note(Diagnostic::error(code, span, message).label(label).hint(hint));
        None
    }

    /// A quantity, or an expression in SI and radians.
    pub(super) fn expression(
        &mut self,
        node: &Node,
        quantity: &Quantity,
        uses: Uses,
    ) -> Option<Spanned<Expression>> {
        let expression = match node.scalar().filter(|_| !node.is_null()) {
            Some(scalar) if units::split_quantity(scalar.text.trim()).is_none() => {
                if self.is_infinite(node) {
                    return None;
                }
                let text = &*scalar.text;
                match formula::parse(text, &Symbols { names: &self.names, uses }) {
                    Ok(expression) => expression,
                    Err(problems) => {
                        problems.into_iter().for_each(|problem| self.problem(node, problem));
                        return None;
                    }
                }
            }
            _ => Expression::Number(self.number(node, quantity)?.value),
        };
        self.measures(node, &expression, quantity)?;
        Some(Spanned { value: expression, span: node.span })
    }

    /// A parameter that stands alone must measure what the field does.
    fn measures(
        &mut self,
        node: &Node,
        expression: &Expression,
        quantity: &Quantity,
    ) -> Option<()> {
        let Expression::Parameter(id) = expression else {
            if *quantity == ANGLE
                && !matches!(expression, Expression::Number(_))
                && let Some(most) = self.most(expression)
            {
                self.warn_of_turns(node.span, most);
            }
            return Some(());
        };
        // One that could not be read has been reported.
        let parameter = self.parameters.get(id.index())?.as_ref()?;
        let (name, at) = (&parameter.name.value, parameter.name.span);
        match parameter.dimension {
            Some(found) if found != quantity.dimension => {
                let message = format!("expected {}, found {found}", quantity.name);
                let error = Diagnostic::error("wrong-dimension", node.span, message)
                    .label(format!("`{name}` is {found}"))
                    .also(at, "its unit is given here")
                    .hint(format!("{} is in {}", quantity.name, quantity.examples));
                self.note(error);
                None
            }
            None if *quantity == ANGLE => {
                let value = parameter.value;
                self.warn_of_turns(at, value);
                Some(())
            }
            _ => Some(()),
        }
    }

    /// No more than this is the magnitude of an expression, where its parts say so: of
    /// `30*sin(t)` it is 30.
    fn most(&self, expression: &Expression) -> Option<f64> {
        Some(match expression {
            Expression::Number(number) => number.abs(),
            Expression::Parameter(id) => self.parameters.get(id.index())?.as_ref()?.value.abs(),
            Expression::Unary(Unary::Neg | Unary::Abs, x) => self.most(x)?,
            Expression::Unary(Unary::Sin | Unary::Cos | Unary::Tanh, _) => 1.0,
            Expression::Unary(Unary::Sign | Unary::Step, _) => 1.0,
            Expression::Chain(first, rest) => {
                rest.iter().try_fold(self.most(first)?, |most, (operator, next)| {
                    Some(match operator {
                        Operator::Add | Operator::Sub => most + self.most(next)?,
                        Operator::Mul => most * self.most(next)?,
                        Operator::Div => most / next.constant()?.abs(),
                    })
                })?
            }
            _ => return None,
        })
    }

    /// Warns of radians that may have been meant as degrees.
    fn warn_of_turns(&mut self, span: Span, angle: f64) {
        let Some(turns) = Some(angle).filter(|angle| angle.is_finite()).and_then(beyond_a_turn)
        else {
            return;
        };
        let hint = "bare angles are in the unit of `units: { angle: .. }`, formulas and parameters \
                    in radians: for degrees write `30 deg`, in a formula `30*pi/180`";
        let warning = Diagnostic::warning("many-turns", span, turns).label("an angle in radians");
        if self
            .diagnostics
            .0
            .iter()
            .all(|known| (known.code, known.span) != ("many-turns", Some(span)))
        {
            self.note(warning.hint(hint));
        }
    }

    fn problem(&mut self, node: &Node, problem: formula::Problem) {
        let span = node.span_within(self.source, problem.range.start, problem.range.end);
        let error = Diagnostic::error(problem.code, span, problem.message).label(problem.label);
        self.note(Diagnostic { hint: problem.hint, ..error });
    }

    /// Three expressions.
    pub(super) fn vector(
        &mut self,
        node: &Node,
        quantity: &Quantity,
        uses: Uses,
    ) -> Option<[Expression; 3]> {
        let nodes: &[Node; 3] = array(node, "`[x, y, z]`", &mut self.diagnostics)?;
        let [x, y, z] = nodes.each_ref().map(|node| self.expression(node, quantity, uses));
        Some([x?.value, y?.value, z?.value])
    }

    /// Three numbers.
    pub(super) fn numbers<const K: usize>(
        &mut self,
        node: &Node,
        what: &str,
        quantity: &Quantity,
    ) -> Option<[f64; K]> {
        let nodes: &[Node; K] = array(node, what, &mut self.diagnostics)?;
        let read = nodes.each_ref().map(|node| self.number(node, quantity));
        read.iter().all(Option::is_some).then(|| read.map(|x| x.map_or(f64::NAN, |x| x.value)))
    }

    /// A point of the drawing, whose decimals count for its tolerance.
    pub(super) fn drawn_point(&mut self, node: &Node) -> Option<[f64; 2]> {
        let point = self.numbers::<2>(node, "`[x, y]`", &LENGTH)?;
        if let Content::Sequence(coordinates) = &node.content {
            coordinates.iter().for_each(|coordinate| self.note_decimals(coordinate));
        }
        Some(point)
    }

    /// Notes how finely a coordinate is written.
    pub(super) fn note_decimals(&mut self, node: &Node) {
        let text = node.scalar().map(|scalar| scalar.text.trim());
        let Some((number, unit)) = text.and_then(units::split_quantity) else { return };
        let unit = if unit.is_empty() { Ok(self.length) } else { units::parse_unit(unit) };
        unit.into_iter().for_each(|unit| self.decimals.note(number, unit));
    }

    /// How far the coordinates of hinge lines may be moved, m: as given, or by their decimals.
    pub(super) fn tolerance(
        &mut self,
        given: Option<Spanned<f64>>,
        bodies: &[Body],
        joints: &[Joint],
    ) -> Option<f64> {
        let Some(Spanned { value: tolerance, span }) = given else {
            return Some(self.decimals.tolerance(bodies, joints));
        };
        let most = LARGEST_TOLERANCE * rounding::size(bodies, joints);
        if (0.0..=most).contains(&tolerance) {
            return Some(tolerance);
        }
        let message = match tolerance < 0.0 {
            true => "the tolerance is negative".to_owned(),
            false => format!("the tolerance is more than a hundredth of the drawing, {most:.3e} m"),
        };
        self.note(Diagnostic::error("bad-tolerance", span, message).hint(
            "it is a length: how far the coordinates of hinge lines are off by rounding; 0 takes \
             them as they are",
        ));
        None
    }
}

fn not_finite(span: Span, text: &str) -> Diagnostic {
    Diagnostic::error("not-finite", span, format!("`{}` is not a finite number", shorten(text)))
        .label("too large, or not a number")
}
