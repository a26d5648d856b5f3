//! Angles of the finished fold: of the drawing, of the model, by default.

use super::*;

#[test]
fn the_drawing_comes_before_the_model_and_the_model_before_the_default() {
    let half = "#f00' stroke-opacity='0.5";
    let line = |colour| strip(&[(colour, [15.0, 0.0, 15.0, 20.0])]);
    for (colour, pattern, expected) in [
        (half, "", Some(-PI / 2.0)),
        (half, ", fold: { valley: 30 }", Some(-PI / 2.0)),
        (MOUNTAIN, "", Some(-PI)),
        (MOUNTAIN, ", fold: { mountain: -30 }", Some(-PI / 6.0)),
        (VALLEY, ", fold: { valley: 45, mountain: -30 }", Some(PI / 4.0)),
        (UNDRIVEN, "", None),
        (VALLEY, ", fold: { mountain: -30 }", Some(PI)),
    ] {
        let fold = model(&line(colour), pattern).joints[0].fold.as_ref().map(|fold| fold.value);
        let is_same = match (fold, expected) {
            (Some(fold), Some(expected)) => (fold - expected).abs() < 1e-12,
            (found, expected) => found == expected,
        };
        assert!(is_same, "{colour}{pattern}: {fold:?}");
    }
}

/// An angle that the drawing overrides everywhere is said to be in vain; one that some creases take is not.
#[test]
fn angles_that_no_crease_takes_are_said() {
    let opaque = ("#f00' stroke-opacity='1", [15.0, 0.0, 15.0, 20.0]);
    let plain = (MOUNTAIN, [25.0, 0.0, 25.0, 20.0]);
    let fold = ", fold: { mountain: -30, valley: 30 }";
    for (lines, expected) in
        [(vec![opaque], &["unused-fold"][..]), (vec![opaque, plain], &[]), (vec![plain], &[])]
    {
        let (model, found) = read(&strip(&lines), "layup: [card]", fold).unwrap();
        assert_eq!(found.0.iter().map(|it| it.code.name).collect::<Vec<_>>(), expected);
        let folds = model.joints.iter().map(|joint| joint.fold.as_ref().map(|fold| fold.value));
        let angle = |line: &Stroke| if *line == plain { -PI / 6.0 } else { -PI };
        assert!(folds.eq(lines.iter().map(|line| Some(angle(line)))), "{lines:?}");
    }
}
