//! Precedence against values computed by hand, round trips, and every kind of error.

use super::*;
use crate::source::diagnostic::{Span, Spanned};
use crate::source::drawn::Drawn;
use crate::source::ids::{InputId, JointId, ParameterId};
use crate::source::model::{Joint, Parameter, SourceModel, Spring};

struct Names {
    motion: Option<&'static str>,
}

impl Scope for Names {
    fn symbol(&self, name: &str) -> Option<Expression> {
        match name {
            "k" => Some(Expression::Parameter(ParameterId(0))),
            "motor" => Some(Expression::Input(InputId(0))),
            _ => None,
        }
    }
    fn symbols(&self) -> Vec<&str> {
        vec!["k", "motor", "t"]
    }
    fn joint(&self, name: &str) -> Option<JointId> {
        (name == "knee").then_some(JointId(0))
    }
    fn joints(&self) -> Vec<&str> {
        vec!["knee"]
    }
    fn motion_refused(&self) -> Option<&'static str> {
        self.motion
    }
}

const FREE: Names = Names { motion: None };

/// k = 3, motor = 5, t = 7, q.knee = 11, u.knee = 13.
fn value(expression: &Expression) -> f64 {
    match expression {
        Expression::Parameter(_) => 3.0,
        Expression::Input(_) => 5.0,
        Expression::Time => 7.0,
        Expression::Position(_) => 11.0,
        Expression::Rate(_) => 13.0,
        Expression::Place(..) | Expression::Memory(_) => f64::NAN,
        Expression::Number(number) => *number,
        Expression::Unary(function, x) => function.apply(value(x)),
        Expression::Binary(function, x, y) => function.apply(value(x), value(y)),
        Expression::Chain(first, rest) => {
            rest.iter().fold(value(first), |x, (operator, y)| operator.apply(x, value(y)))
        }
    }
}

/// A model with the names of [`Names`], for printing.
fn model() -> SourceModel {
    let named = |name: &str| Spanned { value: name.to_owned(), span: Span::default() };
    let zero = Spanned { value: Expression::ZERO, span: Span::default() };
    let body = Spanned { value: crate::source::BodyId(0), span: Span::default() };
    SourceModel {
        tolerance: 0.0,
        drawing: None,
        cuts: Vec::new(),
        max_hinges: crate::source::MAX_HINGES,
        name: named("m"),
        angle: Default::default(),
        gravity: [Expression::ZERO, Expression::ZERO, Expression::ZERO],
        materials: vec![],
        layup: vec![],
        contacts: vec![],
        controllers: vec![],
        bodies: vec![],
        joints: vec![Joint {
            name: named("knee"),
            bodies: [body.clone(), body],
            axis: Drawn::default(),
            z: Drawn::default(),
            spring: Spring::Stiffness(zero.clone()),
            damping: zero.clone(),
            rest: zero.clone(),
            cubic_stiffness: zero.clone(),
            friction: None,
            limits: None,
            torque: zero,
            drive: None,
            fold: None,
            span: Span::default(),
        }],
        parameters: vec![Parameter { name: named("k"), value: 0.0, dimension: None, range: None }],
        inputs: vec![named("motor")],
        tunable: vec![],
        initial_q: vec![],
        initial_u: vec![],
        initial_fold: None,
        initial_bodies: vec![],
        points: vec![],
        forces: vec![],
        elements: Default::default(),
        hinge_models: vec![],
        air: None,
    }
}

#[test]
fn precedence_and_values() {
    for (text, expected) in [
        ("1 + 2*3", 7.0),
        ("(1 + 2)*3", 9.0),
        ("10 - 4 - 3", 3.0),
        ("24/4/3", 2.0),
        ("24/4*3", 18.0),
        ("2^3^2", 512.0),
        ("(2^3)^2", 64.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("2^-1", 0.5),
        ("2^-k^2", 2f64.powi(-9)),
        ("-k*-2", 6.0),
        ("2 - -3", 5.0),
        ("--k", 3.0),
        ("motor - 0.02*t^2", 5.0 - 0.02 * 49.0),
        ("q.knee - u.knee", -2.0),
        ("min(k, t) + max(k, t)", 10.0),
        ("abs(k - t)*sqrt(16)", 16.0),
        ("sin(pi/2) + cos(0) + tan(0) + exp(0) + tanh(0)", 3.0),
        (".5e1 + 1.", 6.0),
        ("asin(1) + acos(-1) + atan(0)", 1.5 * std::f64::consts::PI),
        ("atan2(k, -k) + atan2(-k, -k) + 1", 1.0),
        ("atan2(t, k)", 7f64.atan2(3.0)),
        ("log(exp(motor))", 5.0),
        ("sign(-k) + 10*sign(k - 3) + 100*sign(t)", 99.0),
        ("step(-k) + 10*step(k - 3) + 100*step(t)", 110.0),
    ] {
        let tree = parse(text, &FREE).unwrap_or_else(|e| panic!("{text}: {e:?}"));
        assert!(
            (value(&tree) - expected).abs() < 1e-15 * expected.abs(),
            "{text}: {}",
            value(&tree)
        );
        let printed = print(&tree, &model());
        assert_eq!(parse(&printed, &FREE).as_ref(), Ok(&tree), "{text} printed as {printed}");
    }
}

#[test]
fn printing_keeps_the_tree() {
    for text in [
        "k - (t - motor)",
        "k/(t/motor)",
        "k/(t*motor)",
        "(k^t)^motor",
        "k^t^motor",
        "-(k + t)",
        "-(k*t)",
        "(-k)*t",
        "(-k)^t",
        "-k^t",
        "(-2)^t",
        "k + (t + motor)",
        "k*(-2)",
        "k*(t*motor)",
        "2^(-t)",
        "-(-k)",
        "sin(-k)",
        "-sin(k)^2",
        "(k + t)^2",
        "k - -t",
        "k - t + motor - (k - t) + k",
        "k/t*motor/(k/t)",
        "k*t + motor/t - k",
        "(k + t)*motor",
        "atan2(k - t, -motor)",
    ] {
        let tree = parse(text, &FREE).unwrap();
        let printed = print(&tree, &model());
        assert_eq!(parse(&printed, &FREE).as_ref(), Ok(&tree), "{text} printed as {printed}");
    }
    assert_eq!(print(&parse("((k))*((t)+(1))", &FREE).unwrap(), &model()), "k*(t + 1)");
}

/// What lamc writes must be read again, also if it is nested as deeply as it may be.
#[test]
fn printing_nests_no_deeper() {
    assert_eq!(print(&parse("2^(-t)", &FREE).unwrap(), &model()), "2^-t");
    for (before, after) in [
        ("2^-", ""),
        ("k^-t^-", ""),
        ("-", ""),
        ("k*-", ""),
        ("k - (", ")"),
        ("(k + ", ")^2"),
        ("-(k*", ")"),
        ("2^(-t*", ")"),
        ("sin(-", ")"),
        ("min(k, -", ")"),
    ] {
        let nested = |levels: usize| format!("{}k{}", before.repeat(levels), after.repeat(levels));
        let readable = (1..MAX_NESTING).take_while(|&levels| parse(&nested(levels), &FREE).is_ok());
        let deepest = readable.last().unwrap();
        let tree = parse(&nested(deepest), &FREE).unwrap();
        let printed = print(&tree, &model());
        assert_eq!(parse(&printed, &FREE).as_ref(), Ok(&tree), "{before}..{after}: {printed}");
    }
}

#[test]
fn errors_stand_at_their_place() {
    for (text, code, range, words) in [
        ("k +", "bad-expression", 3..3, "the end of the expression"),
        ("(k", "bad-expression", 2..2, "`)`"),
        ("k t", "bad-expression", 2..3, "expected an operator"),
        ("2 deg + k", "bad-expression", 2..5, "SI and radians"),
        ("k**2", "bad-expression", 2..3, "`^`"),
        ("k % 2", "bad-expression", 2..3, "`%`"),
        ("mtor*2", "unknown-name", 0..4, "did you mean `motor`?"),
        ("knee + 1", "unknown-name", 0..4, "`q.knee`"),
        ("sin + 1", "unknown-name", 0..3, "`sin(..)`"),
        ("q.kne", "unknown-joint", 2..5, "did you mean `knee`?"),
        ("sine(t)", "unknown-function", 0..4, "did you mean `sin`?"),
        ("k(t)", "unknown-function", 0..1, "`k*(..)`"),
        ("sin(t, k)", "wrong-arguments", 0..9, "one argument, not 2"),
        ("min(t)", "wrong-arguments", 0..6, "two arguments, not 1"),
        ("1e999 + k", "not-finite", 0..5, "too large"),
        ("1/0", "not-finite", 0..3, "inf"),
        ("k + log(-1)", "not-finite", 4..11, "a number greater than 0"),
        ("k + log(0)", "not-finite", 4..10, "`log(0)` is -inf"),
        ("k*sqrt(1 - 2)", "not-finite", 2..13, "not negative"),
        ("asin(1 + 1e-9)*k", "not-finite", 0..14, "from -1 to 1"),
        ("sin(acos(-2)) + k", "not-finite", 4..12, "from -1 to 1"),
        ("exp(1000) + k", "not-finite", 0..9, "is inf"),
        ("log(kk)", "unknown-name", 4..6, "did you mean `k`?"),
        ("atan2(t)", "wrong-arguments", 0..8, "two arguments, not 1"),
    ] {
        let problems = parse(text, &FREE).expect_err(text);
        let Problem { code: got, range: at, message, hint, .. } = &problems[0];
        assert_eq!((got.name, at), (code, &range), "{text}: {message}");
        assert!(
            message.contains(words) || hint.as_deref().is_some_and(|h| h.contains(words)),
            "{text}: {message} / {hint:?}"
        );
    }
}

#[test]
fn all_unknown_names_are_reported() {
    let problems = parse("a*k + b + q.hip", &FREE).unwrap_err();
    let ranges: Vec<_> = problems.iter().map(|p| p.range.clone()).collect();
    assert_eq!(ranges, [0..1, 6..7, 12..15]);
}

#[test]
fn motion_is_refused_where_it_must_be() {
    let scope = Names { motion: Some("because") };
    let problems = parse("k + q.knee", &scope).unwrap_err();
    assert_eq!((problems[0].code.name, problems[0].hint.as_deref()), ("not-here", Some("because")));
}

#[test]
fn absurd_expressions_are_refused() {
    let deep = "(".repeat(100_000) + "1";
    assert_eq!(parse(&deep, &FREE).unwrap_err()[0].code.name, "nested-formula");
    assert_eq!(
        parse(&("-".repeat(100_000) + "1"), &FREE).unwrap_err()[0].code.name,
        "nested-formula"
    );
    assert_eq!(parse(&"2^".repeat(100_000), &FREE).unwrap_err()[0].code.name, "nested-formula");
    let many = |count: usize| format!("1{}", "+k".repeat(count));
    assert_eq!(parse(&many(MAX_TERMS), &FREE).unwrap_err()[0].code.name, "too-long");
    // What is long is not deep: nothing that walks the tree runs out of stack.
    for operator in ["+", "-", "*", "/"] {
        let long = ["k", "sin(t)", "2"].repeat(MAX_TERMS / 3).join(operator);
        let tree = parse(&long, &FREE).unwrap();
        let printed = print(&tree, &model());
        assert!(parse(&printed, &FREE) == Ok(tree.clone()), "{operator}");
        let sum = |n: f64| n * (3.0 + 7f64.sin() + 2.0);
        let expected = match operator {
            "+" => sum((MAX_TERMS / 3) as f64),
            "-" => 6.0 - sum((MAX_TERMS / 3) as f64),
            _ => continue,
        };
        assert!((value(&tree) - expected).abs() < 1e-9 * expected.abs(), "{operator}");
    }
    let nested = |levels: usize| format!("{}k{}", "(".repeat(levels), ")".repeat(levels));
    assert!(parse(&nested(MAX_NESTING - 1), &FREE).is_ok());
    assert_eq!(parse(&nested(MAX_NESTING), &FREE).unwrap_err()[0].code.name, "nested-formula");
}
