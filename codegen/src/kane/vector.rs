//! Vectors and symmetric tensors with symbolic components.

use std::array;

use crate::symbolic::Expr;

/// Three components of a vector in some frame.
pub type Vector = [Expr; 3];

/// Components of a symmetric 3x3 tensor: xx, xy, xz, yy, yz, zz.
pub type Tensor = [Expr; 6];

/// Returns the zero vector.
pub fn zero() -> Vector {
    array::from_fn(|_| Expr::zero())
}

/// Returns a + b.
pub fn add<const K: usize>(a: &[Expr; K], b: &[Expr; K]) -> [Expr; K] {
    array::from_fn(|i| &a[i] + &b[i])
}

/// Returns a - b.
pub fn sub(a: &Vector, b: &Vector) -> Vector {
    array::from_fn(|i| &a[i] - &b[i])
}

/// Returns s a.
pub fn scale<const K: usize>(s: &Expr, a: &[Expr; K]) -> [Expr; K] {
    array::from_fn(|i| s * &a[i])
}

/// Returns a . b.
pub fn dot(a: &Vector, b: &Vector) -> Expr {
    Expr::sum(array::from_fn(|i| &a[i] * &b[i]))
}

/// Returns a x b.
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        &(&a[j] * &b[k]) + &Expr::negative_product(&a[k], &b[j])
    })
}

/// Returns T a.
pub fn apply(t: &Tensor, a: &Vector) -> Vector {
    let [xx, xy, xz, yy, yz, zz] = t.clone();
    [[xx, xy.clone(), xz.clone()], [xy, yy, yz.clone()], [xz, yz, zz]].map(|row| dot(&row, a))
}

/// Returns a b^T + b a^T.
pub fn twice_symmetric(a: &Vector, b: &Vector) -> Tensor {
    let entry = |i: usize, j: usize| &(&a[i] * &b[j]) + &(&b[i] * &a[j]);
    [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)]
}
