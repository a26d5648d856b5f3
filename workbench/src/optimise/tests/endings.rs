//! How searches end: beside designs that cannot be evaluated, with parameters that do not count, or not at all.

use super::numbers::ROD;
use super::*;

#[test]
fn designs_that_cannot_be_evaluated_are_counted_by_their_reason() {
    let compiled = compiled(include_str!("../../../../examples/linkage.yaml"));
    let goals = "
        parameters: { crank: {}, coupler: {} }
        starts: 2
        goals: { way: { path: { point: pen, drive: drive, angles: [60deg, 400deg], through: [[0, 0, 0]] } } }
    ";
    let problem = problem(&compiled, goals);
    let failure = problem.optimise(2, &|| false, &|| ()).unwrap_err();
    let Failure::NoStart { drawn, times, reason } = failure else { panic!("{failure}") };
    assert_eq!(drawn, 100);
    assert_eq!(times, 100);
    assert!(reason.starts_with("`way`: the mechanism does not move beyond "), "{reason}");
    assert!(reason.ends_with(" deg of the driven joint") && !reason.contains(".."), "{reason}");
}

/// With a longer crank, coupler (50 mm) and rocker (40 mm) do not reach from its end at 175 deg to the pivot, which is
/// crank + 10 mm away. The path that is asked for lies beyond.
#[test]
fn a_search_that_ends_beside_designs_that_cannot_be_evaluated_says_why() {
    let model = include_str!("../../../../examples/linkage.yaml");
    let compiled = compiled(&model.replace("range: [16 mm, 24 mm]", "range: [16 mm, 60 mm]"));
    let problem = problem(
        &compiled,
        "
        parameters: { crank: {} }
        starts: 4
        goals:
          way: { path: { point: pen, drive: drive, angles: [60deg, 175deg], plane: xz, unit: mm, through: [[0, 200], [-200, 0]] } }
        ",
    );
    let outcome = optimised(&problem);
    let crank = problem.parameters(&outcome.found[outcome.best].x)[0];
    let ground = crank + 0.010;
    let away = (crank * crank + ground * ground
        - 2.0 * crank * ground * 175_f64.to_radians().cos())
    .sqrt();
    assert!((0.0..1e-4).contains(&(0.090 - away)), "{away}");
    let remarks = remarks(&problem, &outcome);
    let [remark] = &remarks[..] else { panic!("{remarks:?}") };
    assert!(
        remark.starts_with(
            "the goals would come nearer beyond this design, but the next designs cannot be evaluated: `way`: the mechanism does not move beyond 17"
        ),
        "{remark}"
    );
}

/// All designs keep the limit: the best one is that of the model, and so are its numbers.
#[test]
fn goals_within_their_limits_have_the_values_of_the_design_that_is_written() {
    let compiled = compiled(ROD);
    for norm in ["squares", "max"] {
        let problem = problem(
            &compiled,
            &format!(
                "
            parameters: {{ k: {{}} }}
            starts: 4
            norm: {norm}
            goals: {{ bend: {{ angle: hinge, at_most: 3 }}, heavy: {{ mass: all, at_most: 1 kg }} }}
            "
            ),
        );
        let outcome = optimised(&problem);
        let best = &outcome.found[outcome.best];
        assert!((problem.parameters(&best.x)[0] - 2e-3).abs() < 1e-15);
        assert!(
            (best.evaluation.goals[0].value - 0.5).abs() < 1e-9,
            "{}",
            best.evaluation.goals[0].value
        );
    }
}

/// Nothing depends on the length without a frequency: it stays as it is, and the search says so.
#[test]
fn a_parameter_without_influence_keeps_its_value() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, l: {} }
        starts: 4
        goals: { bend: { angle: hinge, target: 0.4 } }
        ",
    );
    let outcome = optimised(&problem);
    let best = &outcome.found[outcome.best];
    let values = problem.parameters(&best.x);
    assert!((values[0] - 1e-3 / 0.4).abs() < 1e-8, "{}", values[0]);
    assert!((values[1] - 0.020).abs() < 1e-15, "{}", values[1]);
    assert_eq!(outcome.idle, [1]);
    let remarks = remarks(&problem, &outcome);
    assert_eq!(
        remarks,
        ["no error of a goal and no constraint depends on `l`: it keeps its value"]
    );
}

/// The linkage is drawn flat, and its hinge lines are in one plane again after a turn of the crank. There it may go on in
/// two ways, which steps from one angle to the next would choose by chance.
#[test]
fn a_path_that_leads_through_a_state_where_the_motion_branches_is_refused() {
    let compiled = compiled(include_str!("../../../../examples/linkage.yaml"));
    for angles in ["[20deg, 380deg]", "[300deg, 420deg]", "[60deg, -60deg]"] {
        for timed in [true, false] {
            let goals = format!("
                parameters: {{ crank: {{}} }}
                goals:
                  way:
                    path: {{ point: pen, drive: drive, angles: {angles}, plane: xz, timed: {timed}, through: [[0, 0], [0.01, 0], [0.02, 0]] }}
            ");
            let problem = problem(&compiled, &goals);
            for x in [0.1, 0.5, 0.83] {
                let reason = problem.evaluate(&[x]).unwrap_err();
                assert!(
                    reason.starts_with("`way`: the mechanism does not move beyond "),
                    "{reason}"
                );
            }
        }
    }
}
