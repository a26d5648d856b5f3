//! Loops that lock in the middle of a fold.

use lamc::arithmetic::larger;

use super::*;

/// Nine facets around four vertices, the middle one divided in two by a joint without `fold`.
fn nine_facets(inner: [[f64; 2]; 4]) -> String {
    let at = |i: usize, j: usize| match (i, j) {
        (1 | 2, 1 | 2) => inner[2 * (i - 1) + j - 1],
        _ => [30.0 * i as f64, 30.0 * j as f64 - if i % 2 == 1 { 8.0 } else { 0.0 }],
    };
    let mut text = "units: { length: mm, angle: deg }\n\
         materials: { card: { density: 700, thickness: 0.3 } }\nlayup: [card]\ntolerance: 1e-9\nbodies:\n\
         joints:\n"
        .to_owned();
    let mut body = |name: &str, outline: &[[f64; 2]]| {
        let fixed = if name == "f00" { "fixed: true, " } else { "" };
        let line = format!("  {name}: {{ {fixed}outline: {outline:?} }}\n");
        text.insert_str(text.find("joints:").unwrap(), &line);
    };
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        match (i, j) {
            (1, 1) => (body("f11", &[a, b, d]), body("half", &[b, c, d])).0,
            _ => body(&format!("f{i}{j}"), &[a, b, c, d]),
        }
    }
    // The second body is to the left of its hinge line.
    let mut joint = |name: &str, bodies: [&str; 2], axis: [[f64; 2]; 2], mountain: Option<bool>| {
        let fold = mountain.map_or("", |it| if it { ", fold: -180" } else { ", fold: 180" });
        let [right, left] = bodies;
        let _ = writeln!(text, "  {name}: {{ bodies: [{right}, {left}], axis: {axis:?}{fold} }}");
    };
    let facet = |i: usize, j: usize| format!("f{i}{j}");
    let before =
        |i, j, line| if [i, j, line] == [1, 1, 2] { "half".to_owned() } else { facet(i, j) };
    for (line, along) in [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)] {
        let (left, right) = (before(line - 1, along, line), facet(line, along));
        let axis = [at(line, along), at(line, along + 1)];
        joint(&format!("up{line}{along}"), [&right, &left], axis, Some(line == 1));
        let (below, above) = (before(along, line - 1, line), facet(along, line));
        let axis = [at(along, line), at(along + 1, line)];
        joint(
            &format!("level{line}{along}"),
            [&below, &above],
            axis,
            Some((along + line) % 2 == 0),
        );
    }
    joint("bend", ["half", "f11"], [at(2, 1), at(1, 2)], None);
    text
}

/// The loops as rows of a dense matrix, and how far they are open.
fn closure(sheet: &Fold, q: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
    let equations = &sheet.problem.equations;
    let placed = equations.place(q);
    let (mut jacobian, mut gap) =
        (DMatrix::zeros(3 * placed.len(), q.len()), DVector::zeros(3 * placed.len()));
    for (number, (placed, chain)) in placed.iter().zip(&equations.chains).enumerate() {
        (0..3).for_each(|row| gap[3 * number + row] = placed.gap[row]);
        for (joint, twist) in chain.joints().zip(&placed.twists) {
            (0..3).for_each(|row| jacobian[(3 * number + row, joint)] = twist[row]);
        }
    }
    (jacobian, gap)
}

/// What can still be gained is found by going on along the only motion that is left, without targets.
#[test]
fn loops_that_lock_end_a_fold() {
    let inner = [[30.9720, 22.1505], [27.5876, 50.6337], [62.2166, 29.9103], [57.9553, 57.8930]];
    let mut sheet = fold(&nine_facets(inner));
    let path = followed(&mut sheet, 1.0);
    let End::Locked { loops, is_open: false, .. } = &path.end else { panic!("{:?}", path.end) };
    assert_eq!(loops.len(), 4);
    let last = path.samples.last().unwrap();
    assert_eq!(sheet.mobility_of_all(&last.q), 1);
    let along = |q: &[f64]| sheet.problem.along_targets(q);
    let mut q = DVector::from_column_slice(&last.q);
    let mut direction = DVector::from_column_slice(&sheet.problem.targets);
    let (mut most, mut steps) = (last.reached, 0);
    // The motion reaches its most, and comes back.
    while along(q.as_slice()) > last.reached - 0.05 {
        let (jacobian, _) = closure(&sheet, q.as_slice());
        let squared = (jacobian.transpose() * &jacobian).symmetric_eigen();
        let motion = squared.eigenvectors.column(squared.eigenvalues.imin()).into_owned();
        direction = &motion * motion.dot(&direction).signum();
        q += 0.02 * &direction;
        for _ in 0..4 {
            let (jacobian, gap) = closure(&sheet, q.as_slice());
            q -= jacobian.svd(true, true).solve(&gap, 1e-9).unwrap();
        }
        assert!(largest(closure(&sheet, q.as_slice()).1.iter()) < 1e-9);
        most = larger(most, along(q.as_slice()));
        steps += 1;
        assert!(steps < 500, "the motion goes on to {most}");
    }
    assert!(most < last.reached + 0.01, "{most} can be reached, not only {}", last.reached);
}
