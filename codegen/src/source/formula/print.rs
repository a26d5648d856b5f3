//! [`Expression`] -> text that is parsed to the same tree again.

use super::functions::{FUNCTIONS, Function};
use super::operators::{POWER, SIGN, powers};
use crate::source::expression::{Binary, Expression, Operator, Unary};
use crate::source::ids::JointId;
use crate::source::model::SourceModel;

/// Binding power above that of every operator.
const ATOM: u8 = u8::MAX;

/// Prints the expression in the notation of model files, with as few parentheses as possible.
pub(in crate::source) fn print(expression: &Expression, model: &SourceModel) -> String {
    let mut text = String::new();
    write(expression, 0, model, &mut text);
    text
}

/// Returns the binding power of the outermost operation.
fn binding(expression: &Expression) -> u8 {
    match expression {
        Expression::Number(value) if value.is_sign_negative() => SIGN,
        Expression::Unary(Unary::Neg, _) => SIGN,
        Expression::Binary(Binary::Pow, ..) => POWER.1,
        Expression::Chain(_, rest) => {
            rest.first().map_or(ATOM, |(operator, _)| powers(*operator).0)
        }
        _ => ATOM,
    }
}

fn symbol(operator: Operator) -> &'static str {
    match operator {
        Operator::Add => " + ",
        Operator::Sub => " - ",
        Operator::Mul => "*",
        Operator::Div => "/",
    }
}

fn name_of(is_it: impl Fn(Function) -> bool) -> &'static str {
    FUNCTIONS.iter().find(|(_, function)| is_it(*function)).map_or("", |(name, _)| name)
}

/// Returns a number or a name as it is written.
fn leaf(expression: &Expression, model: &SourceModel) -> String {
    let joint = |id: &JointId| &model.joints[id.index()].name.value;
    match expression {
        Expression::Number(std::f64::consts::PI) => "pi".to_owned(),
        Expression::Number(value) => number(*value),
        Expression::Parameter(id) => model.parameters[id.index()].name.value.clone(),
        Expression::Input(id) => model.inputs[id.index()].value.clone(),
        Expression::Time => "t".to_owned(),
        Expression::Position(id) => format!("q.{}", joint(id)),
        Expression::Rate(id) => format!("u.{}", joint(id)),
        Expression::Place(id, axis) => {
            format!("{}.{}", ["x", "y", "z"][*axis], model.points[id.index()].name.value)
        }
        Expression::Memory(id) => {
            let mut memory = model.controllers.iter().flat_map(|controller| &controller.memory);
            memory.nth(id.index()).map_or(String::new(), |memory| memory.name.clone())
        }
        Expression::Unary(..) | Expression::Binary(..) | Expression::Chain(..) => {
            unreachable!("an operation has operands")
        }
    }
}

fn write(expression: &Expression, least: u8, model: &SourceModel, text: &mut String) {
    let parentheses = binding(expression) < least;
    if parentheses {
        text.push('(');
    }
    match expression {
        Expression::Number(_)
        | Expression::Parameter(_)
        | Expression::Input(_)
        | Expression::Time
        | Expression::Position(_)
        | Expression::Rate(_)
        | Expression::Place(..)
        | Expression::Memory(_) => text.push_str(&leaf(expression, model)),
        Expression::Unary(Unary::Neg, x) => {
            text.push('-');
            write(x, SIGN, model, text);
        }
        Expression::Unary(function, x) => {
            text.push_str(name_of(|known| matches!(known, Function::One(f) if f == *function)));
            text.push('(');
            write(x, 0, model, text);
            text.push(')');
        }
        Expression::Binary(Binary::Pow, x, y) => {
            write(x, POWER.0, model, text);
            text.push('^');
            // A sign may begin any operand. Parentheses around it would nest the text one level deeper than the
            // text that was read, and the next reader might refuse it.
            let least = if binding(y) == SIGN { SIGN } else { POWER.1 };
            write(y, least, model, text);
        }
        Expression::Binary(function, x, y) => {
            text.push_str(name_of(|known| matches!(known, Function::Two(f) if f == *function)));
            text.push('(');
            write(x, 0, model, text);
            text.push_str(", ");
            write(y, 0, model, text);
            text.push(')');
        }
        Expression::Chain(first, rest) => {
            write(first, binding(expression), model, text);
            for (operator, x) in rest {
                text.push_str(symbol(*operator));
                write(x, powers(*operator).1, model, text);
            }
        }
    }
    if parentheses {
        text.push(')');
    }
}

/// Returns the shortest text that is parsed to the same double again.
pub(in crate::source) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.strip_suffix(".0") {
        Some(whole) => whole.into(),
        None => text,
    }
}
