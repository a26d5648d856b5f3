//! Formulas: resolves their names and checks their units.

use std::collections::HashMap;

use crate::source::argument::beyond_a_turn;
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::expression::{Expression, Operator, Unary};
use crate::source::fields::{Fields, array};
use crate::source::formula::{self, Scope};
use crate::source::ids::{InputId, JointId, MemoryId, ParameterId, PointId};
use crate::source::schema::{Uses, Value};
use crate::source::units::{self, ANGLE, Quantity};
use crate::source::yaml::Node;

use super::controllers::SAMPLE;
use super::{Lowering, Names};

/// Why numbers of the drawing do not depend on q, u, t and inputs.
const NO_MOTION: &str = "the drawing is the same at all times: it may depend on parameters only";

/// What formulas of one controller see besides the names of the model.
pub(super) struct Own<'d> {
    /// The names of its memory.
    pub memory: Vec<String>,
    /// The first of its memory.
    pub first: MemoryId,
    /// The time between samples, s.
    pub sample: f64,
    /// Which controller drives which input.
    pub driven: &'d HashMap<String, String>,
}

struct Symbols<'n> {
    names: &'n Names,
    uses: Uses,
    /// What the formulas of a controller see, too.
    own: Option<&'n Own<'n>>,
    /// The number of mistakes in the file before this formula.
    earlier: usize,
}

impl Scope for Symbols<'_> {
    fn symbol(&self, name: &str) -> Option<Expression> {
        if let Some(own) = self.own {
            let mut memory = own.memory.iter();
            if let Some(index) = memory.position(|known| known == name) {
                return Some(Expression::Memory(MemoryId(own.first.index() + index)));
            }
            if name == SAMPLE {
                return Some(Expression::Number(own.sample));
            }
        }
        let Names { parameters, inputs, .. } = self.names;
        let parameter = parameters.position(name).map(|i| Expression::Parameter(ParameterId(i)));
        parameter.or_else(|| inputs.position(name).map(|i| Expression::Input(InputId(i))))
    }

    fn symbols(&self) -> Vec<&str> {
        let parameters = self.names.parameters.names();
        let own = self.own.into_iter().flat_map(|own| own.memory.iter().map(String::as_str));
        let own = own.chain(self.own.map(|_| SAMPLE));
        match self.uses {
            Uses::Parameters => parameters.collect(),
            Uses::Motion | Uses::Constants(_) => {
                parameters.chain(self.names.inputs.names()).chain(own).chain(["t"]).collect()
            }
        }
    }

    fn joint(&self, name: &str) -> Option<JointId> {
        self.names.joints.position(name).map(JointId)
    }

    fn joints(&self) -> Vec<&str> {
        self.names.joints.names().collect()
    }

    fn symbol_refused(&self, name: &str) -> Option<String> {
        let by = self.own?.driven.get(name)?;
        Some(format!(
            "the controller `{by}` drives this input: remember the command in the `memory` of a controller"
        ))
    }

    fn point(&self, name: &str) -> Option<PointId> {
        self.names.points.position(name).map(PointId)
    }

    fn points(&self) -> Option<Vec<&str>> {
        self.own.map(|_| self.names.points.names().collect())
    }

    fn motion_refused(&self) -> Option<&'static str> {
        match self.uses {
            Uses::Parameters => Some(NO_MOTION),
            Uses::Constants(reason) => Some(reason),
            Uses::Motion => None,
        }
    }

    fn earlier_mistakes(&self) -> usize {
        self.earlier
    }
}

impl Lowering<'_> {
    /// Reads the formula of a key, 0 if it is left out.
    pub(super) fn law(&mut self, fields: &Fields, key: &str) -> Option<Spanned<Expression>> {
        match fields.get(key) {
            None => Some(Spanned { value: Expression::ZERO, span: fields.at() }),
            Some(node) => self.expression(node, fields.expected(key)),
        }
    }

    /// Reads the formula of a required key.
    pub(super) fn required_law(
        &mut self,
        fields: &Fields,
        key: &str,
    ) -> Option<Spanned<Expression>> {
        let node = fields.read(key, &mut self.diagnostics)?;
        self.expression(node, fields.expected(key))
    }

    /// Reads a quantity, or an expression in SI and radians.
    pub(super) fn expression(&mut self, node: &Node, value: &Value) -> Option<Spanned<Expression>> {
        let (quantity, uses) = value.measured();
        let expression = self.formula_or_number(node, quantity, uses, None)?;
        if uses == Uses::Parameters {
            self.depends_on_parameters(node, &expression)?;
        }
        self.measures(node, &expression, quantity)?;
        Some(Spanned { value: expression, span: node.span })
    }

    /// Reads a formula of a controller, in SI units and radians.
    pub(super) fn law_of_controller(
        &mut self,
        node: &Node,
        own: &Own,
    ) -> Option<Spanned<Expression>> {
        let value = self.formula_or_number(node, &units::NUMBER, Uses::Motion, Some(own))?;
        Some(Spanned { value, span: node.span })
    }

    fn formula_or_number(
        &mut self,
        node: &Node,
        quantity: &Quantity,
        uses: Uses,
        own: Option<&Own>,
    ) -> Option<Expression> {
        match node.scalar().filter(|_| !node.is_null()) {
            Some(scalar) if units::split_quantity(scalar.text.trim()).is_none() => {
                if self.is_infinite(node) {
                    return None;
                }
                let text = &*scalar.text;
                let earlier = self.diagnostics.0.len();
                match formula::parse(text, &Symbols { names: &self.names, uses, own, earlier }) {
                    Ok(expression) => Some(expression),
                    Err(problems) => {
                        problems.into_iter().for_each(|problem| self.problem(node, problem));
                        None
                    }
                }
            }
            _ => Some(Expression::Number(self.number(node, quantity)?.value)),
        }
    }

    /// Reports a formula that depends on t or an input.
    fn depends_on_parameters(&mut self, node: &Node, expression: &Expression) -> Option<()> {
        let mut inputs = self.names.inputs.names().enumerate();
        let input = inputs.find(|(i, _)| expression.contains(&Expression::Input(InputId(*i))));
        let time = expression.contains(&Expression::Time).then_some("t");
        let message = match input.map(|(_, name)| name).or(time) {
            None => return Some(()),
            Some(name) => format!("`{name}` is not allowed here"),
        };
        drop(inputs);
        self.note(Diagnostic::error(codes::NOT_HERE, node.span, message).hint(NO_MOTION));
        None
    }

    /// A parameter that is the whole formula must have the quantity of its key.
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
        // A parameter that could not be read has been reported.
        let parameter = self.parameters.get(id.index())?.as_ref()?;
        let (name, at) = (&parameter.name.value, parameter.name.span);
        match parameter.dimension {
            Some(found) if found != quantity.dimension => {
                let message = format!("expected {}, found {found}", quantity.name);
                let error = Diagnostic::error(codes::WRONG_DIMENSION, node.span, message)
                    .label(format!("`{name}` is {found}"))
                    .also(at, "its unit is set here")
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

    /// Returns an upper bound of the magnitude of an expression, if there is a simple one: 30 for
    /// `30*sin(t)`.
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
    pub(super) fn warn_of_turns(&mut self, span: Span, angle: f64) {
        let Some(turns) = Some(angle).filter(|angle| angle.is_finite()).and_then(beyond_a_turn)
        else {
            return;
        };
        let hint = "angles without a unit are in the unit of `units: { angle: .. }`, formulas \
                    and parameters in radians: for degrees write `30 deg`, in a formula \
                    `30*pi/180`";
        let warning =
            Diagnostic::warning(codes::MANY_TURNS, span, turns).label("an angle in radians");
        self.note(warning.hint(hint));
    }

    fn problem(&mut self, node: &Node, problem: formula::Problem) {
        let span = node.span_within(self.source, problem.range.start, problem.range.end);
        let error = Diagnostic::error(problem.code, span, problem.message).label(problem.label);
        self.note(Diagnostic { hint: problem.hint, ..error });
    }

    /// Reads three expressions.
    pub(super) fn vector(&mut self, node: &Node, value: &Value) -> Option<[Expression; 3]> {
        let nodes: &[Node; 3] = array(node, value.form(), &mut self.diagnostics)?;
        let [x, y, z] = nodes.each_ref().map(|node| self.expression(node, value));
        Some([x?.value, y?.value, z?.value])
    }
}
