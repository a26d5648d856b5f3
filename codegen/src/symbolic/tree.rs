//! Finished expressions as plain data, which a symbolic session returns.

/// An expression over leaves `L` in the engine's canonical form.
#[derive(Clone, Debug, PartialEq)]
pub enum Tree<L> {
    /// An exact rational number: numerator and denominator (the denominator is positive).
    Rational(i64, i64),
    /// A number greater than 0, as passed to [`Algebra::number`](super::Algebra::number).
    Number(f64),
    /// A symbol.
    Leaf(L),
    /// A sum of at least two terms.
    Sum(Vec<Tree<L>>),
    /// A product of at least two factors.
    Product(Vec<Tree<L>>),
    /// An integer power. The exponent is not 0 or 1; a negative exponent means division.
    Power(Box<Tree<L>>, i64),
    /// A function applied to one or two arguments.
    Apply(Function, Vec<Tree<L>>),
}

/// Functions that the equations may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "each is the function of its name")]
pub enum Function {
    Sin,
    Cos,
    Tan,
    Exp,
    Ln,
    Sqrt,
    Abs,
    Step,
    Tanh,
    Atan2,
    Min,
    Max,
    Pow,
}

impl<L> Tree<L> {
    /// The number 0.
    pub const ZERO: Self = Self::Rational(0, 1);
    /// The number 1.
    pub const ONE: Self = Self::Rational(1, 1);
}
