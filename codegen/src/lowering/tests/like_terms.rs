//! Like terms and signs.

use super::super::like_terms::merge;
use super::*;

/// `sum` over two coordinates x and y, folded, merged and folded.
fn merged(sum: impl FnOnce(&mut dyn FnMut(Op) -> Value, [Value; 2]) -> Value) -> Function {
    let mut ops = Vec::new();
    let mut push = |op| {
        ops.push((op, formula()));
        Value(ops.len() - 1)
    };
    let coordinates = [0, 1].map(|joint| push(Op::Load(Slot::Position(CoordinateId(joint)))));
    let result = sum(&mut push, coordinates);
    let function = function(ops, vec![result]);
    let reduce = |function| dead::dead(number::number(fold::fold(function)));
    reduce(merge(reduce(function)))
}

#[test]
fn like_terms_become_one() {
    // 2 x + y + 3 x
    let function = merged(|push, [x, y]| {
        let [two, three] = [2.0, 3.0].map(|number| push(Op::Const(number)));
        let (first, last) = (push(Op::Mul(two, x)), push(Op::Mul(three, x)));
        let sum = push(Op::Add(first, y));
        push(Op::Add(sum, last))
    });
    assert_eq!((function.cost().mul, function.cost().add), (1, 1));
    assert_eq!(run(&function, &[0.5, 4.0]), [6.5]);
}

#[test]
fn terms_that_differ_by_rounding_cancel() {
    // 0.3 x + y - (0.1 + 0.2) x
    let function = merged(|push, [x, y]| {
        let [one, other] = [0.3, 0.1 + 0.2].map(|number| push(Op::Const(number)));
        let (first, last) = (push(Op::Mul(one, x)), push(Op::Mul(other, x)));
        let sum = push(Op::Add(first, y));
        push(Op::Sub(sum, last))
    });
    assert_eq!(function.cost().total(), 0);
    assert_eq!(run(&function, &[0.5, 4.0]), [4.0]);
}

#[test]
fn signs_move_into_differences_and_numbers() {
    // -(x - y) and -(2 x)
    let difference = merged(|push, [x, y]| {
        let difference = push(Op::Sub(x, y));
        push(Op::Neg(difference))
    });
    assert_eq!(difference.cost().total(), 1);
    assert_eq!(run(&difference, &[0.5, 4.0]), [3.5]);
    let product = merged(|push, [x, _]| {
        let two = push(Op::Const(2.0));
        let product = push(Op::Mul(two, x));
        push(Op::Neg(product))
    });
    assert_eq!(product.cost().total(), 1);
    assert_eq!(run(&product, &[0.5, 4.0]), [-1.0]);
}
