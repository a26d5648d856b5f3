//! Symbolic expressions: a wrapper of the engine's expressions and their arithmetic.

use std::ops::{Add, Mul, Neg, Sub};

use symbolica::atom::{Atom, AtomCore, AtomView, Symbol};
use symbolica::{function, symbol};

use super::tree::Function;

/// A symbolic expression, always in the engine's canonical form.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Expr(pub(super) Atom);

impl Expr {
    /// Returns the number 0.
    pub fn zero() -> Self {
        Self::integer(0)
    }

    /// Returns the number 1.
    pub fn one() -> Self {
        Self::integer(1)
    }

    /// Returns a whole number.
    pub(super) fn integer(value: i64) -> Self {
        Self(Atom::num(value))
    }

    /// Returns whether this is the number 0.
    pub fn is_zero(&self) -> bool {
        self.0.is_zero()
    }

    /// Returns the value, if this is a whole number.
    pub(super) fn as_integer(&self) -> Option<i64> {
        match &self.0 {
            Atom::Zero => Some(0),
            Atom::Num(_) => i64::try_from(&self.0).ok(),
            _ => None,
        }
    }

    /// Returns the sum of three, as two additions would.
    pub fn sum(terms: [Expr; 3]) -> Self {
        Self(sum(terms.each_ref().map(|term| &term.0)))
    }

    /// Returns -x y, as a product and its negative would.
    pub fn negative_product(x: &Expr, y: &Expr) -> Self {
        match (x.as_integer(), y.as_integer()) {
            (Some(0), _) | (_, Some(0)) => Expr::zero(),
            _ => Expr(product([&Atom::num(-1), &x.0, &y.0])),
        }
    }

    /// Returns whether this is a number, a symbol, or the negative of a symbol, which is not worth a
    /// name.
    pub(super) fn is_atomic(&self) -> bool {
        match self.0.as_view() {
            AtomView::Num(_) | AtomView::Var(_) => true,
            AtomView::Mul(product) => {
                let mut factors = product.iter();
                let is_number = |factor| matches!(factor, AtomView::Num(_));
                product.get_nargs() == 2
                    && factors.any(|factor| factor == Self::integer(-1).0.as_view())
                    && product
                        .iter()
                        .filter(|factor| !is_number(*factor))
                        .all(|factor| matches!(factor, AtomView::Var(_)))
            }
            _ => false,
        }
    }

    /// Returns an integer power; negative exponents divide. The power with exponent 0 is 1, also for
    /// base 0, as in floating point: the engine leaves 0^0 undefined.
    pub fn power(&self, exponent: i64) -> Self {
        match exponent {
            0 => Self::one(),
            _ => Self(self.0.pow(Atom::num(exponent))),
        }
    }

    /// Applies a function to one or two arguments.
    ///
    /// Sine and cosine are the engine's own functions, and it knows their derivatives. The others occur
    /// only in the user's expressions. They stay opaque, so that the engine cannot rewrite them into an
    /// expression with a different domain.
    pub fn apply(function: Function, arguments: &[Expr]) -> Self {
        match (function, arguments) {
            (Function::Sin, [x]) => Self(x.0.sin()),
            (Function::Cos, [x]) => Self(x.0.cos()),
            (_, [x]) => {
                let head = opaque(function);
                Self(function!(head, x.0.clone()))
            }
            (_, [x, y]) => {
                let head = opaque(function);
                Self(function!(head, x.0.clone(), y.0.clone()))
            }
            _ => unreachable!("functions take one or two arguments"),
        }
    }
}

/// Functions that the engine treats as opaque.
const OPAQUE: [Function; 11] = [
    Function::Tan,
    Function::Exp,
    Function::Ln,
    Function::Sqrt,
    Function::Abs,
    Function::Step,
    Function::Tanh,
    Function::Atan2,
    Function::Min,
    Function::Max,
    Function::Pow,
];

/// Returns the engine's symbol of an opaque function.
fn opaque(function: Function) -> Symbol {
    symbol!(format!("lamc::{function:?}"))
}

/// Creates the symbols of all opaque functions, so that all others are younger.
pub(super) fn create_opaque() {
    for function in OPAQUE {
        opaque(function);
    }
}

/// Returns the opaque function with this name (without its namespace).
pub(super) fn opaque_function(name: &str) -> Option<Function> {
    OPAQUE.into_iter().find(|function| format!("{function:?}") == name)
}

// The engine's functions of many arguments take a third of the time of its operators, for the same results.

fn sum<const K: usize>(terms: [&Atom; K]) -> Atom {
    Atom::add_many(terms.map(Atom::as_view))
}

fn product<const K: usize>(factors: [&Atom; K]) -> Atom {
    Atom::mul_many(factors.map(Atom::as_view))
}

// Where an operand is 0 or 1, the engine would still build and normalise an expression.
impl Add for &Expr {
    type Output = Expr;
    fn add(self, other: &Expr) -> Expr {
        match (self.is_zero(), other.is_zero()) {
            (true, _) => other.clone(),
            (_, true) => self.clone(),
            _ => Expr(sum([&self.0, &other.0])),
        }
    }
}

impl Sub for &Expr {
    type Output = Expr;
    fn sub(self, other: &Expr) -> Expr {
        match (self.is_zero(), other.is_zero()) {
            (_, true) => self.clone(),
            (true, _) => -other,
            _ => self + &-other,
        }
    }
}

impl Mul for &Expr {
    type Output = Expr;
    fn mul(self, other: &Expr) -> Expr {
        match (self.as_integer(), other.as_integer()) {
            (Some(0), _) | (_, Some(0)) => Expr::zero(),
            (Some(1), _) => other.clone(),
            (_, Some(1)) => self.clone(),
            _ => Expr(product([&self.0, &other.0])),
        }
    }
}

impl Neg for &Expr {
    type Output = Expr;
    fn neg(self) -> Expr {
        if self.is_zero() { Expr::zero() } else { Expr(product([&Atom::num(-1), &self.0])) }
    }
}
