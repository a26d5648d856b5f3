//! Vectors and symmetric tensors of symbolic components.

use std::array;

use crate::symbolic::Expr;

/// Three components in some frame.
pub type Vector = [Expr; 3];

/// A symmetric 3x3 tensor: xx, xy, xz, yy, yz, zz.
pub type Tensor = [Expr; 6];

/// The zero vector.
pub fn zero() -> Vector {
    array::from_fn(|_| Expr::zero())
}

/// a + b.
pub fn add<const K: usize>(a: &[Expr; K], b: &[Expr; K]) -> [Expr; K] {
    array::from_fn(|i| &a[i] + &b[i])
}

/// a - b.
pub fn sub(a: &Vector, b: &Vector) -> Vector {
    array::from_fn(|i| &a[i] - &b[i])
}

/// s a.
pub fn scale<const K: usize>(s: &Expr, a: &[Expr; K]) -> [Expr; K] {
    array::from_fn(|i| s * &a[i])
}

/// a . b.
pub fn dot(a: &Vector, b: &Vector) -> Expr {
    &(&(&a[0] * &b[0]) + &(&a[1] * &b[1])) + &(&a[2] * &b[2])
}

/// a x b.
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        &(&a[j] * &b[k]) - &(&a[k] * &b[j])
    })
}

/// T a.
pub fn apply(t: &Tensor, a: &Vector) -> Vector {
    let [xx, xy, xz, yy, yz, zz] = t.clone();
    [[xx, xy.clone(), xz.clone()], [xy, yy, yz.clone()], [xz, yz, zz]].map(|row| dot(&row, a))
}

/// (a . b) 1 - (a b^T + b a^T) / 2, twice: the symmetric part of -[a]x [b]x, doubled.
///
/// Moves an inertia tensor: about O + r less about O it is `shift(r, h) + m shift(r, r) / 2`, with
/// h the first moment about O.
pub fn shift(a: &Vector, b: &Vector) -> Tensor {
    let twice = |i: usize, j: usize| &(&a[i] * &b[j]) + &(&a[i] * &b[j]);
    let mixed = |i: usize, j: usize| -&(&(&a[i] * &b[j]) + &(&a[j] * &b[i]));
    [
        &twice(1, 1) + &twice(2, 2),
        mixed(0, 1),
        mixed(0, 2),
        &twice(0, 0) + &twice(2, 2),
        mixed(1, 2),
        &twice(0, 0) + &twice(1, 1),
    ]
}
