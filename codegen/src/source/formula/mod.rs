//! Text -> [`Expression`]: operator precedence parsing (V. Pratt, "Top down operator precedence",
//! 1973), with names resolved at the same time.
//!
//! `^` binds tightest and to the right, then unary minus (`-2^2` is -4), then `* /`, then `+ -`.

use std::ops::Range;

use super::codes::{self, Code};
use super::expression::{Binary, Expression, Unary};
use super::names;
use super::units::split_number;
use super::yaml::shorten;

mod functions;
mod operators;
mod print;
mod scope;
#[cfg(test)]
mod tests;

use functions::{Function, domain, function};
pub(super) use functions::{functions, is_function};
use operators::{Infix, SIGN, chained};
pub(super) use print::{number, print};
pub(super) use scope::{Problem, Scope};

/// Deepest nesting of parentheses, calls, signs and powers. It is limited because later stages walk
/// trees recursively.
const MAX_NESTING: usize = 64;
/// Most numbers and names in one expression, so that the derived equations stay small enough to be
/// compiled.
const MAX_TERMS: usize = 100_000;

/// Parses `text`. All unknown names are reported together; a syntax error stops the parser.
pub(super) fn parse(text: &str, scope: &dyn Scope) -> Result<Expression, Vec<Problem>> {
    let mut parser = Parser { text, at: 0, nesting: 0, terms: 0, scope, problems: Vec::new() };
    let result = parser.expression(0).and_then(|tree| match parser.peek() {
        Token::End => Ok(tree),
        _ => Err(parser.expected("an operator")),
    });
    match result {
        Ok(expression) if parser.problems.is_empty() => Ok(expression),
        Ok(_) => Err(parser.problems),
        Err(problem) => {
            parser.problems.push(problem);
            Err(parser.problems)
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Token<'t> {
    Number(f64),
    /// With its prefix, as in `q.j0`.
    Name(&'t str),
    Symbol(char),
    End,
}

struct Parser<'t> {
    text: &'t str,
    at: usize,
    nesting: usize,
    terms: usize,
    scope: &'t dyn Scope,
    problems: Vec<Problem>,
}

impl<'t> Parser<'t> {
    /// The next token and its bytes.
    fn token(&self) -> (Token<'t>, Range<usize>) {
        let rest = self.text[self.at..].trim_start();
        let start = self.text.len() - rest.len();
        let Some(first) = rest.chars().next() else { return (Token::End, start..start) };
        let in_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        if first.is_ascii_alphabetic() || first == '_' {
            let end = rest.find(|c| !in_name(c)).unwrap_or(rest.len());
            return (Token::Name(&rest[..end]), start..start + end);
        }
        match split_number(rest) {
            Some((number, _)) if !matches!(first, '+' | '-') => {
                (Token::Number(number.parse().unwrap_or(f64::NAN)), start..start + number.len())
            }
            _ => (Token::Symbol(first), start..start + first.len_utf8()),
        }
    }

    fn peek(&self) -> Token<'t> {
        self.token().0
    }

    fn next(&mut self) -> (Token<'t>, Range<usize>) {
        let (token, range) = self.token();
        self.at = range.end;
        (token, range)
    }

    fn problem(&self, code: Code, range: Range<usize>, message: String, label: &str) -> Problem {
        Problem { code, range, message, label: label.into(), hint: None }
    }

    /// A hint for an unknown name.
    fn hint<'k>(
        &self,
        name: &str,
        known: impl FnOnce() -> Vec<&'k str>,
        plural: &str,
    ) -> Option<String> {
        let earlier = self.scope.earlier_mistakes() + self.problems.len();
        names::hint(earlier, name, known, plural)
    }

    /// The next token is not the expected one.
    fn expected(&self, what: &str) -> Problem {
        let (token, range) = self.token();
        let found = match token {
            Token::End => "the end of the expression".into(),
            _ => format!("`{}`", &self.text[range.clone()]),
        };
        let mut problem = self.problem(
            codes::BAD_EXPRESSION,
            range.clone(),
            format!("expected {what}, found {found}"),
            &format!("expected {what}"),
        );
        problem.hint = match token {
            Token::Name(name) if super::units::find(name).is_some() => Some(
                "expressions are in SI and radians; a unit is allowed only if the value is a \
                 single number, as in `30 deg`"
                    .into(),
            ),
            Token::Name(_) | Token::Number(_) | Token::Symbol('(')
                if what.starts_with("an operator") =>
            {
                Some("a product needs its `*`".into())
            }
            Token::Symbol('*') if self.text[..range.start].ends_with('*') => {
                Some("powers are written `^`".into())
            }
            _ => None,
        };
        problem
    }

    /// Reports a constant part that is not finite, such as `10^10^10` in `q.j + 10^10^10`, and
    /// replaces it by 0 to find further mistakes. After another problem a 0 may stand for an
    /// unknown name, so nothing is reported.
    fn finite(&mut self, expression: Expression, start: usize) -> Expression {
        match expression.constant() {
            Some(value) if !value.is_finite() && self.problems.is_empty() => {
                let message = format!("the value of this expression is {value}");
                let label = "not a finite number";
                self.problems.push(self.problem(codes::NOT_FINITE, start..self.at, message, label));
                Expression::ZERO
            }
            _ => expression,
        }
    }

    /// An expression of operators that bind at least as tightly as `least`.
    fn expression(&mut self, least: u8) -> Result<Expression, Problem> {
        self.nesting += 1;
        if self.nesting > MAX_NESTING {
            return Err(self.limit(
                codes::NESTED_FORMULA,
                "this expression is nested too deeply",
                format!(
                    "at most {MAX_NESTING} parentheses, calls, signs and powers nested in each \
                     other"
                ),
            ));
        }
        let start = self.token().1.start;
        let mut left = self.operand()?;
        while let Token::Symbol(symbol) = self.peek() {
            let Some(infix) = Infix::of(symbol) else { break };
            let (left_power, right_power) = infix.powers();
            if left_power < least {
                break;
            }
            self.next();
            let right = self.expression(right_power)?;
            left = match infix {
                Infix::Chained(operator) => chained(left, operator, right),
                Infix::Power => {
                    let power = Expression::Binary(Binary::Pow, Box::new(left), Box::new(right));
                    self.finite(power, start)
                }
            };
        }
        self.nesting -= 1;
        Ok(self.finite(left, start))
    }

    fn operand(&mut self) -> Result<Expression, Problem> {
        match self.peek() {
            Token::Number(value) => {
                let (_, range) = self.next();
                if !value.is_finite() {
                    let message = "this number is too large".into();
                    return Err(self.problem(
                        codes::NOT_FINITE,
                        range,
                        message,
                        "not a finite number",
                    ));
                }
                self.count()?;
                Ok(Expression::Number(value))
            }
            Token::Name(name) => {
                let (_, range) = self.next();
                self.name(name, range)
            }
            Token::Symbol('-') => {
                self.next();
                Ok(match self.expression(SIGN)? {
                    Expression::Number(value) => Expression::Number(-value),
                    other => Expression::Unary(Unary::Neg, Box::new(other)),
                })
            }
            Token::Symbol('(') => {
                self.next();
                let inner = self.expression(0)?;
                self.close()?;
                Ok(inner)
            }
            _ => Err(self.expected("a number, a name or `(`")),
        }
    }

    fn close(&mut self) -> Result<(), Problem> {
        if self.peek() != Token::Symbol(')') {
            return Err(self.expected("an operator or `)`"));
        }
        self.next();
        Ok(())
    }

    /// Counts a number or a name.
    fn count(&mut self) -> Result<(), Problem> {
        self.terms += 1;
        if self.terms <= MAX_TERMS {
            return Ok(());
        }
        let hint = format!("at most {MAX_TERMS} numbers and names");
        Err(self.limit(codes::TOO_LONG, "this expression is too long", hint))
    }

    /// Returns the problem of an expression that exceeds a limit.
    fn limit(&self, code: Code, message: &str, hint: String) -> Problem {
        let problem = self.problem(code, 0..self.text.len(), message.into(), "");
        Problem { hint: Some(hint), ..problem }
    }

    /// Returns the meaning of a name. An unknown name is reported and replaced by 0 to find further
    /// mistakes.
    fn name(&mut self, name: &str, range: Range<usize>) -> Result<Expression, Problem> {
        if self.peek() == Token::Symbol('(') {
            return self.call(name, range);
        }
        self.count()?;
        let known = match name {
            "pi" => Some(Expression::Number(std::f64::consts::PI)),
            "t" => Some(Expression::Time),
            _ => match name.split_once('.') {
                Some((prefix @ ("q" | "u"), joint)) => self.motion(prefix, joint, &range),
                Some((axis @ ("x" | "y" | "z"), point)) if self.scope.points().is_some() => {
                    self.place(axis, point, &range)
                }
                _ => self.symbol(name, &range),
            },
        };
        Ok(known.unwrap_or(Expression::ZERO))
    }

    fn motion(&mut self, prefix: &str, joint: &str, range: &Range<usize>) -> Option<Expression> {
        if let Some(reason) = self.scope.motion_refused() {
            let message = format!("`{prefix}.{joint}` is not allowed here");
            let mut problem =
                self.problem(codes::NOT_HERE, range.clone(), message, "depends on the motion");
            problem.hint = Some(reason.into());
            self.problems.push(problem);
            return None;
        }
        let Some(id) = self.scope.joint(joint) else {
            let message = format!("there is no joint `{}`", shorten(joint));
            let start = range.start + prefix.len() + 1;
            let mut problem =
                self.problem(codes::UNKNOWN_JOINT, start..range.end, message, "unknown joint");
            problem.hint = self.hint(joint, || self.scope.joints(), "joints");
            self.problems.push(problem);
            return None;
        };
        Some(if prefix == "q" { Expression::Position(id) } else { Expression::Rate(id) })
    }

    fn place(&mut self, axis: &str, point: &str, range: &Range<usize>) -> Option<Expression> {
        let id = self.scope.point(point);
        if id.is_none() {
            let message = format!("there is no point `{}`", shorten(point));
            let range = range.start + axis.len() + 1..range.end;
            let mut problem = self.problem(codes::UNKNOWN_POINT, range, message, "unknown point");
            let points = || self.scope.points().unwrap_or_default();
            problem.hint = self.hint(point, points, "points");
            self.problems.push(problem);
        }
        let axis = ["x", "y", "z"].iter().position(|known| *known == axis)?;
        Some(Expression::Place(id?, axis))
    }

    fn symbol(&mut self, name: &str, range: &Range<usize>) -> Option<Expression> {
        if let Some(reason) = self.scope.symbol_refused(name) {
            let message = format!("`{name}` is not allowed here");
            let mut problem =
                self.problem(codes::NOT_HERE, range.clone(), message, "driven by a controller");
            problem.hint = Some(reason);
            self.problems.push(problem);
            return None;
        }
        if let Some(symbol) = self.scope.symbol(name) {
            return Some(symbol);
        }
        let mut problem = self.problem(
            codes::UNKNOWN_NAME,
            range.clone(),
            format!("unknown name `{}`", shorten(name)),
            "unknown name",
        );
        problem.hint = if is_function(name) {
            problem.message = format!("`{name}` is a function");
            problem.label = "the arguments are missing".into();
            Some(format!("write `{name}(..)`"))
        } else if self.scope.joint(name).is_some() {
            Some(format!("write `q.{name}` for the joint's angle, `u.{name}` for its speed"))
        } else if matches!(name, "q" | "u") {
            Some(format!("write `{name}.` and the joint's name"))
        } else {
            let known = || self.scope.symbols().into_iter().chain(["pi"]).collect();
            self.hint(name, known, "names an expression may use")
        };
        self.problems.push(problem);
        None
    }

    /// `name(..)`: the opening parenthesis is next.
    fn call(&mut self, name: &str, range: Range<usize>) -> Result<Expression, Problem> {
        self.next();
        let problems = self.problems.len();
        let mut arguments = vec![self.expression(0)?];
        while self.peek() == Token::Symbol(',') {
            self.next();
            arguments.push(self.expression(0)?);
        }
        self.close()?;
        let whole = range.start..self.at;
        let Some(function) = function(name) else {
            let message = format!("unknown function `{}`", shorten(name));
            let mut problem =
                self.problem(codes::UNKNOWN_FUNCTION, range, message, "unknown function");
            problem.hint = if self.scope.symbol(name).is_some() || matches!(name, "t" | "pi") {
                Some(format!("`{name}` is a number: a product is written `{name}*(..)`"))
            } else {
                self.hint(name, || functions().collect(), "functions")
            };
            self.problems.push(problem);
            return Ok(Expression::ZERO);
        };
        let given = arguments.len();
        let mut arguments = arguments.into_iter().map(Box::new);
        let value = match (function, arguments.next(), arguments.next(), arguments.next()) {
            (Function::One(function), Some(x), None, None) => Expression::Unary(function, x),
            (Function::Two(function), Some(x), Some(y), None) => Expression::Binary(function, x, y),
            _ => {
                let takes = match function {
                    Function::One(_) => "one argument",
                    Function::Two(_) => "two arguments",
                };
                let message = format!("`{name}` takes {takes}, not {given}");
                self.problems.push(self.problem(codes::WRONG_ARGUMENTS, whole, message, ""));
                return Ok(Expression::ZERO);
            }
        };
        // If an argument is wrong, the value that replaced it is meaningless.
        let sound = self.problems.len() == problems;
        if let Some(number) = value.constant().filter(|number| sound && !number.is_finite()) {
            let call = &self.text[whole.clone()];
            let message = format!("the value of `{}` is {number}", shorten(call));
            let mut problem =
                self.problem(codes::NOT_FINITE, whole, message, "not a finite number");
            problem.hint = domain(function).map(|domain| format!("`{name}` takes {domain}"));
            self.problems.push(problem);
            return Ok(Expression::ZERO);
        }
        Ok(value)
    }
}
