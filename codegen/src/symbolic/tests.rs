//! Tests properties of the algebra: order of terms, exact numbers, derivatives through bindings.

use super::{Algebra, Expr, Tree, session};

/// Returns the tree of a sum of symbols that are created in a fixed order.
fn sum_of_three() -> Tree<char> {
    session(|algebra: &mut Algebra<char, ()>| {
        let [a, b, c] = ['a', 'b', 'c'].map(|leaf| algebra.leaf(leaf));
        algebra.tree(&(&(&c * &a) + &(&b + &a)), &|_| '?')
    })
    .unwrap()
}

#[test]
fn order_of_terms_does_not_depend_on_earlier_sessions() {
    let first = sum_of_three();
    session(|algebra: &mut Algebra<usize, ()>| {
        let leaves: Vec<Expr> = (0..40).map(|leaf| algebra.leaf(leaf)).collect();
        leaves.iter().rev().fold(Expr::zero(), |sum, leaf| &sum + leaf)
    })
    .unwrap();
    assert_eq!(first, sum_of_three());
}

#[test]
fn numbers_are_exact_and_cancel() {
    session(|algebra: &mut Algebra<char, ()>| {
        let (x, third) = (algebra.leaf('x'), algebra.number(1.0 / 3.0));
        let negative = algebra.number(-1.0 / 3.0);
        assert_eq!(algebra.value(&third), Some(1.0 / 3.0));
        assert_eq!(algebra.value(&negative), Some(-1.0 / 3.0));
        assert_eq!(algebra.value(&x), None);
        assert!((&(&third * &x) + &(&negative * &x)).is_zero());
        assert_eq!(algebra.tree(&third, &|_| '?'), Tree::Number(1.0 / 3.0));
    })
    .unwrap();
}

#[test]
fn whole_numbers_become_symbols_when_bound() {
    session(|algebra: &mut Algebra<char, ()>| {
        let one = algebra.number(1.0);
        let two = algebra.bind(&one + &one, ());
        assert_eq!(two, algebra.number(2.0));
        assert_eq!(algebra.value(&two), Some(2.0));
        assert!(algebra.definitions(&|_| '?').is_empty());
    })
    .unwrap();
}

#[test]
fn derivatives_follow_bindings() {
    session(|algebra: &mut Algebra<char, &str>| {
        let (x, y) = (algebra.leaf('x'), algebra.leaf('y'));
        let square = algebra.bind(&x * &x, "square");
        let derivative = algebra.derivative(&(&square * &y), &x, &|_| "derivative");
        let labels: Vec<_> = algebra.definitions(&|_| '?').into_iter().map(|(l, _)| l).collect();
        assert_eq!(labels, ["square", "derivative"]);
        let bound = Tree::Product(vec![Tree::Leaf('y'), Tree::Leaf('?')]);
        assert_eq!(algebra.tree(&derivative, &|_| '?'), bound);
    })
    .unwrap();
}
