//! Linkages whose best proportions are known.

use super::*;

const CHEBYSHEV: &str = include_str!("../../../../examples/optimise/chebyshev.yaml");
const CHEBYSHEV_GOALS: &str = include_str!("../../../../examples/optimise/chebyshev_goals.yaml");
const HOECKEN: &str = include_str!("../../../../examples/optimise/hoecken.yaml");
const HOECKEN_GOALS: &str = include_str!("../../../../examples/optimise/hoecken_goals.yaml");
const PATH: &str = include_str!("../../../../examples/optimise/path.yaml");
const PATH_GOALS: &str = include_str!("../../../../examples/optimise/path_goals.yaml");
const FIVE_POINTS: &str = include_str!("../../../../examples/optimise/five_points.yaml");
const FIVE_POINTS_GOALS: &str =
    include_str!("../../../../examples/optimise/five_points_goals.yaml");

/// How many searches end within a share of these values (SI), in the order of the variables.
fn near(problem: &Problem<'_>, outcome: &Outcome, wanted: &[f64], share: f64) -> usize {
    let is_near = |found: &&Found| {
        let values = problem.parameters(&found.x);
        let varied = problem.goals.variables.iter().zip(wanted);
        varied.into_iter().all(|(it, wanted)| (values[it.parameter] / wanted - 1.0).abs() < share)
    };
    outcome.found.iter().filter(is_near).count()
}

/// Chebyshev's linkage has ground : arm : coupler = 4 : 5 : 2. With equal arms and a coupler that is upright at the ends of
/// its travel, over the pivots, arm = (ground^2 + coupler^2)/(2 coupler) (E. A. Dijksman, "Motion Geometry of
/// Mechanisms", 1976). The height of the pen at the ends and in the middle is then ground^2/(2 coupler) and
/// sqrt(arm^2 - (ground + coupler)^2/4). Where they are equal, coupler = ground/2: there the largest error is least, because
/// with another coupler the one or the other rises.
#[test]
fn chebyshevs_linkage_is_found_from_random_starts() {
    let compiled = compiled(CHEBYSHEV);
    let mut problem = problem(&compiled, CHEBYSHEV_GOALS);
    problem.goals.starts = 100;
    let outcome = optimised(&problem);
    assert_eq!(outcome.found.len(), 100);
    let found = near(&problem, &outcome, &[0.020], 1e-3);
    assert!(found >= 90, "{found} of 100");
    assert!(outcome.reached >= 90, "{}", outcome.reached);
}

/// Hoecken's linkage has crank : ground : coupler = 1 : 2 : 2.5. Over half a turn its pen goes from above the pivot of the
/// crank over twice the ground; at the quarter turns it is at the same height.
#[test]
fn hoeckens_linkage_is_found_from_random_starts() {
    let compiled = compiled(HOECKEN);
    let mut problem = problem(&compiled, HOECKEN_GOALS);
    problem.goals.starts = 100;
    let outcome = optimised(&problem);
    assert_eq!(outcome.found.len(), 100);
    let found = near(&problem, &outcome, &[0.010, 0.020, 0.040, 0.040], 1e-3);
    assert!(found >= 90, "{found} of 100");
    assert!(outcome.found[outcome.best].objective.sqrt() < 1e-9);
}

/// R. L. Norton, "Design of Machinery", table 3-1: the straightest of Hoecken's linkages for ranges of the crank, deg, with
/// ground and coupler in cranks, and the deviation in percent of the travel. His proportions are multiples of 0.025. (For
/// half a turn, the linkage 1 : 2 : 2.5 deviates by 0.244 %.)
const NORTON: [[f64; 4]; 3] =
    [[180.0, 2.200, 2.800, 0.096], [160.0, 2.350, 3.025, 0.047], [140.0, 2.500, 3.250, 0.023]];

#[test]
fn the_straightest_of_hoeckens_linkages_are_at_least_as_good_as_the_published_ones() {
    let compiled = compiled(HOECKEN);
    for [range, published_ground, published_coupler, published] in NORTON {
        let end = 0.5 * range;
        let goals = format!(
            "
            parameters: {{ ground: {{}}, height: {{}}, base: {{}} }}
            starts: 10
            norm: max
            goals:
              line:
                path: {{ point: pen, drive: drive, angles: [-{end}deg, {end}deg], plane: xz, timed: true, through: [[~, 0]], samples: 181 }}
            "
        );
        let mut problem = problem(&compiled, &goals);
        problem.system.set_parameter("crank", 0.010).unwrap();
        let outcome = optimised(&problem);
        assert_eq!(outcome.reached, 10);
        let best = &outcome.found[outcome.best];
        let values = problem.parameters(&best.x);
        let [ground, height] = [values[1] / 0.010, values[2] / 0.010];
        let coupler = 0.5 * (ground + 1.0).hypot(height);
        assert!((ground - published_ground).abs() < 0.025, "{range} deg: {ground}");
        assert!((coupler - published_coupler).abs() < 0.025, "{range} deg: {coupler}");
        // The pen goes up and down by twice the largest error. By the closed form of this linkage, the coupler's end is
        // k (ground - cos, sin) from the pivot of the rocker, with the crank at its angle.
        let deviation = 2.0 * best.evaluation.goals[0].largest.unwrap() / 0.010;
        let (sin, cos) = (end.to_radians().sin(), -end.to_radians().cos());
        let square = 1.0 + ground * ground - 2.0 * ground * cos;
        let travel = 2.0 * sin * (4.0 * coupler * coupler / square - 1.0).sqrt();
        let share = 100.0 * deviation / travel;
        assert!(share < published, "{range} deg: {share:.4} %");
    }
}

/// The closed path of 18 points with prescribed timing, of A. Kunjur and S. Krishnamurty, "Genetic algorithms in mechanism
/// synthesis", J. Applied Mechanisms and Robotics 4(2), 1997. The least sum of squares of all ten dimensions is
/// 0.0090289: the best of 150 starts of SciPy's `least_squares` on the closed form of the four-bar.
#[test]
fn the_path_of_18_points_is_as_near_as_an_independent_search_came() {
    const LEAST: f64 = 0.009_028_884_6;
    let compiled = compiled(PATH);
    let problem = problem(&compiled, PATH_GOALS);
    let outcome = optimised(&problem);
    let reached = &outcome.found[outcome.best].evaluation.goals[0];
    // The mean of 18 squares, with 10 mm for the unit of the benchmark.
    let sum = 18.0 * (reached.value / 0.010).powi(2);
    assert!((sum / LEAST - 1.0).abs() < 1e-6, "{sum}");
}

/// Five points with prescribed timing, case 2 of J. A. Cabrera, A. Simon and M. Prado, "Optimal synthesis of mechanisms with genetic
/// algorithms", Mechanism and Machine Theory 37(10), 2002. The least sum of squares is 7.4158e-7: the best of 400 starts of SciPy's
/// `least_squares` on the closed form of the four-bar, within the bounds of the benchmark.
#[test]
fn the_path_of_five_points_is_as_near_as_an_independent_search_came() {
    const LEAST: f64 = 7.415_751_3e-7;
    let compiled = compiled(FIVE_POINTS);
    let problem = problem(&compiled, FIVE_POINTS_GOALS);
    let outcome = optimised(&problem);
    let reached = &outcome.found[outcome.best].evaluation.goals[0];
    let sum = 5.0 * (reached.value / 0.010).powi(2);
    assert!((sum / LEAST - 1.0).abs() < 1e-6, "{sum}");
}

/// Searches depend on their start only.
#[test]
fn one_thread_and_two_find_the_same() {
    let compiled = compiled(HOECKEN);
    let problem = problem(&compiled, HOECKEN_GOALS);
    let [one, two] = [1, 2].map(|threads| problem.optimise(threads, &|| false, &|| ()).unwrap());
    let bits = |outcome: &Outcome| -> Vec<u64> {
        let all = outcome.found.iter().flat_map(|found| found.x.iter().chain([&found.objective]));
        all.map(|number| number.to_bits()).collect()
    };
    assert_eq!(bits(&one), bits(&two));
    assert_eq!((one.best, one.drawn), (two.best, two.drawn));
}

/// The rocker of a crank and rocker swings between the two positions in which crank and coupler are in line: its angle there
/// follows from the law of cosines.
#[test]
fn the_stroke_of_a_rocker_is_that_of_the_closed_form() {
    let compiled = compiled(PATH);
    let goals = "
        parameters: { ox: { range: [4 mm, 6 mm] } }
        goals: { swing: { stroke: { joint: pivot, drive: drive, angles: [0deg, 360deg] }, target: 1 } }
    ";
    let problem = problem(&compiled, goals);
    let found = problem.evaluate(&[0.5]).unwrap().goals[0].value;
    let length = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let [o, a, b, d] = [[5.0, 7.0], [8.0, 9.0], [8.0, 22.0], [20.0, 5.0]];
    let (crank, coupler, rocker, ground) = (length(o, a), length(a, b), length(b, d), length(o, d));
    let angle = |side: f64| {
        ((rocker * rocker + ground * ground - side * side) / (2.0 * rocker * ground)).acos()
    };
    let swing = angle(coupler + crank) - angle(coupler - crank);
    assert!((found - swing).abs() < 1e-12, "{found} {swing}");
}
