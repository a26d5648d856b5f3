//! Products that become one operation with the sum that they are part of.

use crate::backend::statements::{Expression, Infix};

/// The operation factors[0] factors[1] + sum. `negative` negates the product, `less` negates the sum.
pub struct Fused<'a> {
    pub negative: bool,
    pub factors: [&'a Expression; 2],
    pub sum: &'a Expression,
    pub less: bool,
}

/// Returns a sum or difference with a product as one fused operation. If both operands are products,
/// the second is fused, because its factors are more likely to be computed late.
pub fn fused(expression: &Expression) -> Option<Fused<'_>> {
    let Expression::Infix(x, operator @ (Infix::Add | Infix::Sub), y) = expression else {
        return None;
    };
    let less = *operator == Infix::Sub;
    match (bare(x), bare(y)) {
        (_, Expression::Infix(a, Infix::Mul, b)) => {
            Some(Fused { negative: less, factors: [a, b], sum: x, less: false })
        }
        (Expression::Infix(a, Infix::Mul, b), _) => {
            Some(Fused { negative: false, factors: [a, b], sum: y, less })
        }
        _ => None,
    }
}

/// Returns the expression without the parentheses around it.
pub fn bare(expression: &Expression) -> &Expression {
    match expression {
        Expression::Parenthesised(x) => bare(x),
        x => x,
    }
}
