//! [`Expression`] -> text that reads back as the same tree.

use super::{FUNCTIONS, Function, POWER, PRODUCT, SIGN, SUM};
use crate::source::expression::{Binary, Expression, Unary};
use crate::source::model::SourceModel;

/// Tighter than every operator.
const ATOM: u8 = u8::MAX;

/// The expression in the notation of model files, with the fewest parentheses.
pub(in crate::source) fn print(expression: &Expression, model: &SourceModel) -> String {
    let mut text = String::new();
    write(expression, 0, model, &mut text);
    text
}

/// How tightly the outermost operation binds.
fn binding(expression: &Expression) -> u8 {
    match expression {
        Expression::Number(value) if value.is_sign_negative() => SIGN,
        Expression::Unary(Unary::Neg, _) => SIGN,
        Expression::Binary(operator, ..) => {
            operator_of(*operator).map_or(ATOM, |(_, powers)| powers.0.min(powers.1))
        }
        _ => ATOM,
    }
}

/// An operator's text and binding powers; `None` for functions.
fn operator_of(operator: Binary) -> Option<(&'static str, (u8, u8))> {
    match operator {
        Binary::Add => Some((" + ", SUM)),
        Binary::Sub => Some((" - ", SUM)),
        Binary::Mul => Some(("*", PRODUCT)),
        Binary::Div => Some(("/", PRODUCT)),
        Binary::Pow => Some(("^", POWER)),
        Binary::Min | Binary::Max => None,
    }
}

fn name_of(is_it: impl Fn(Function) -> bool) -> &'static str {
    FUNCTIONS.iter().find(|(_, function)| is_it(*function)).map_or("", |(name, _)| name)
}

fn write(expression: &Expression, least: u8, model: &SourceModel, text: &mut String) {
    let parentheses = binding(expression) < least;
    if parentheses {
        text.push('(');
    }
    match expression {
        Expression::Number(std::f64::consts::PI) => text.push_str("pi"),
        Expression::Number(value) => text.push_str(&number(*value)),
        Expression::Parameter(id) => text.push_str(&model.parameters[id.index()].name.value),
        Expression::Input(id) => text.push_str(&model.inputs[id.index()].value),
        Expression::Time => text.push('t'),
        Expression::Position(id) => {
            text.push_str("q.");
            text.push_str(&model.joints[id.index()].name.value);
        }
        Expression::Rate(id) => {
            text.push_str("u.");
            text.push_str(&model.joints[id.index()].name.value);
        }
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
        Expression::Binary(operator, x, y) => match operator_of(*operator) {
            Some((symbol, (left, right))) => {
                write(x, left, model, text);
                text.push_str(symbol);
                write(y, right, model, text);
            }
            None => {
                text.push_str(name_of(|known| matches!(known, Function::Two(f) if f == *operator)));
                text.push('(');
                write(x, 0, model, text);
                text.push_str(", ");
                write(y, 0, model, text);
                text.push(')');
            }
        },
    }
    if parentheses {
        text.push(')');
    }
}

/// The shortest text that reads back as the same double.
pub(in crate::source) fn number(value: f64) -> String {
    let text = format!("{value:?}");
    match text.strip_suffix(".0") {
        Some(whole) => whole.into(),
        None => text,
    }
}
