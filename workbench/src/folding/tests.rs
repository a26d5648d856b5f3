//! Folds against closed forms, the conditions of the nearest state, and sheets that do not fold.

mod locks;

use std::f64::consts::PI;
use std::fmt::Write;

use lamc::arithmetic::largest;
use lamc::pipeline;
use lamc::source::SourceFile;
use nalgebra::{DMatrix, DVector};

use super::chain::bracket;
use super::state::LEAST;
use super::*;

#[allow(dead_code, reason = "a part of it serves here")]
#[path = "../../../tests/src/sheets.rs"]
mod sheets;

/// How far loops may be open, over the sheet's size.
const CLOSED: f64 = 1e-11;

fn fold(text: &str) -> Fold {
    let file = SourceFile { path: "sheet.yaml".into(), text: text.into() };
    let (model, topology, _) =
        pipeline::analyse_edited(&file, |_| ()).unwrap_or_else(|found| panic!("{found}\n{text}"));
    Fold::new(&model, topology).unwrap_or_else(|| panic!("{text}"))
}

/// A vertex with creases at these angles, deg, and with these keys.
fn vertex(creases: &[(f64, &str)]) -> String {
    let n = creases.len();
    let at = |k: usize| {
        let (sin, cos) = creases[k % n].0.to_radians().sin_cos();
        format!("[{:?}, {:?}]", 30.0 * cos, 30.0 * sin)
    };
    let mut text = "units: { length: mm, angle: deg }\n\
         materials: { card: { density: 700, thickness: 0.3 } }\nlayup: [card]\ntolerance: 1e-6\nbodies:\n"
        .to_owned();
    for k in 0..n {
        let fixed = if k == 0 { "fixed: true, " } else { "" };
        let _ = writeln!(text, "  f{k}: {{ {fixed}outline: [[0, 0], {}, {}] }}", at(k), at(k + 1));
    }
    text.push_str("joints:\n");
    for (k, (_, keys)) in creases.iter().enumerate() {
        let (right, end) = ((k + n - 1) % n, at(k));
        let _ =
            writeln!(text, "  c{k}: {{ bodies: [f{right}, f{k}], axis: [[0, 0], {end}], {keys} }}");
    }
    text
}

const VALLEY: &str = "fold: 180";
const MOUNTAIN: &str = "fold: -180";

fn waterbomb() -> String {
    vertex(&[
        (0.0, MOUNTAIN),
        (45.0, VALLEY),
        (135.0, VALLEY),
        (180.0, MOUNTAIN),
        (225.0, VALLEY),
        (315.0, VALLEY),
    ])
}

fn followed(fold: &mut Fold, to: f64) -> Path {
    let path = fold.follow(to, 20, |_| true);
    for sample in &path.samples {
        assert!(sample.open <= CLOSED, "{} is open by {:e}", sample.progress, sample.open);
    }
    for pair in path.samples.windows(2) {
        let steps = pair[0].q.iter().zip(&pair[1].q).map(|(a, b)| (a - b).abs());
        assert!(largest(steps) < 0.7, "a jump at {}", pair[1].progress);
    }
    path
}

fn assert_signs(fold: &Fold, path: &Path) {
    for sample in &path.samples[1..] {
        for (q, target) in sample.q.iter().zip(fold.targets()) {
            let right = *target == 0.0 || q * target > 0.0;
            assert!(right, "{q} towards {target} at {}", sample.progress);
        }
    }
}

#[test]
fn sheets_of_miura_fold_by_their_closed_form() {
    for (rows, columns) in [(2, 2), (3, 3), (12, 13)] {
        let mut sheet = fold(&sheets::miura(rows, columns));
        let path = followed(&mut sheet, 0.8);
        assert_eq!(path.end, End::Reached);
        assert_signs(&sheet, &path);
        let joints = &sheet.topology().mechanism.joints;
        for sample in &path.samples {
            let angle = |kind: &str| {
                let all =
                    joints.iter().zip(&sample.q).filter(|(joint, _)| joint.name.starts_with(kind));
                let all: Vec<f64> = all.map(|(_, q)| q.abs()).collect();
                assert!(all.iter().all(|q| (q - all[0]).abs() < 1e-9), "{kind}: {all:?}");
                all[0]
            };
            let [zigzag, straight] = ["zigzag", "straight"].map(angle);
            let expected = 2.0 * (0.6 * (zigzag / 2.0).tan()).atan();
            assert!((straight - expected).abs() < 1e-9, "{straight} is not {expected}");
        }
        let middle = &path.samples[10].q;
        assert_eq!(sheet.mobility_of_all(middle), 1);
        assert!(sheet.mobility_of_all(&path.samples[0].q) > 1);
        assert!(sheet.not_flat_foldable().is_empty());
    }
}

#[test]
fn flat_foldable_sheets_end_in_their_folds() {
    for text in [sheets::miura(3, 4), waterbomb()] {
        let mut sheet = fold(&text);
        let path = followed(&mut sheet, 1.0);
        assert_eq!(path.end, End::Reached);
        assert_eq!(path.samples.last().map(|last| last.q.as_slice()), Some(sheet.targets()));
        assert!((path.samples.last().unwrap().reached - 1.0).abs() < 1e-12);
    }
}

/// The gradient of what is minimised is a combination of the rows of the closure.
#[test]
fn states_are_the_nearest_ones() {
    let spread = [
        ("fold: 100", 0.0),
        ("fold: -20", 75.0),
        ("", 130.0),
        ("fold: 150", 190.0),
        ("fold: 90", 290.0),
    ];
    let creases =
        spread.map(|(keys, angle)| (angle, if keys.is_empty() { "rest: 0" } else { keys }));
    for text in [waterbomb(), vertex(&creases)] {
        let mut sheet = fold(&text);
        let path = followed(&mut sheet, 0.6);
        assert_eq!(path.end, End::Reached, "{text}");
        assert_signs(&sheet, &path);
        for sample in &path.samples[1..] {
            let Problem { equations, targets, weights, .. } = &sheet.problem;
            let rows: Vec<_> =
                equations.place(&sample.q).into_iter().zip(&equations.chains).collect();
            let mut jacobian = DMatrix::zeros(sample.q.len(), 3 * rows.len());
            for (number, (placed, chain)) in rows.iter().enumerate() {
                for (joint, twist) in chain.joints().zip(&placed.twists) {
                    (0..3).for_each(|row| jacobian[(joint, 3 * number + row)] = twist[row]);
                }
            }
            let gradient = DVector::from_fn(sample.q.len(), |joint, _| {
                weights[joint] * (sample.q[joint] - sample.progress * targets[joint])
            });
            // A joint that is held at its bound may be pushed.
            for joint in 0..sample.q.len() {
                let due = sample.progress * targets[joint];
                if due != 0.0 && sample.q[joint] / due < 1.001 * LEAST {
                    let mut unit = DVector::zeros(sample.q.len());
                    unit[joint] = 1.0;
                    jacobian = jacobian.insert_column(0, 0.0);
                    jacobian.set_column(0, &unit);
                }
            }
            let factors = jacobian.clone().svd(true, true);
            let multipliers = factors.solve(&gradient, 1e-9).unwrap();
            let left = largest((&gradient - jacobian * multipliers).iter());
            assert!(left < 1e-6, "{left:e} at {}", sample.progress);
        }
    }
}

/// The twists and their brackets are the first and second derivatives of a loop.
#[test]
fn loops_are_known_to_second_order() {
    let mut sheet = fold(&waterbomb());
    let q = followed(&mut sheet, 0.5).samples.pop().unwrap().q;
    let chain = &sheet.problem.equations.chains[0];
    let placed = chain.place(&q);
    let joints: Vec<usize> = chain.joints().collect();
    let error = |size: f64| {
        let change = |k: usize| size * (1.0 + 2.0 * k as f64).sin();
        let mut moved = q.clone();
        joints.iter().enumerate().for_each(|(k, joint)| moved[*joint] += change(k));
        let mut expected = placed.gap;
        for (k, twist) in placed.twists.iter().enumerate() {
            expected += twist * change(k);
            for (i, earlier) in placed.twists[..k].iter().enumerate() {
                expected += bracket(earlier, twist) * (0.5 * change(i) * change(k));
            }
        }
        (chain.place(&moved).gap - expected).norm()
    };
    // Of third order: eight times less for half the change.
    let ratio = error(2e-3) / error(1e-3);
    assert!((ratio - 8.0).abs() < 0.2, "{ratio}");
}

#[test]
fn what_does_not_leave_the_flat_state_is_named() {
    // All valleys; three valleys that do not surround the vertex.
    for last in [VALLEY, MOUNTAIN] {
        let mut sheet =
            fold(&vertex(&[(0.0, VALLEY), (80.0, VALLEY), (170.0, VALLEY), (280.0, last)]));
        let path = sheet.follow(0.5, 10, |_| true);
        assert!(matches!(&path.end, End::Flat(stuck) if stuck.loops == [0]), "{:?}", path.end);
        assert!(!sheet.leaves_alone(0));
        assert_eq!(path.samples.len(), 1);
    }
    // Two straight lines that cross: all that closes is the flat state, which small angles come near. Flaps apart
    // from the vertex change the angles that are tried.
    let mut crossing =
        vertex(&[(0.0, MOUNTAIN), (103.0, MOUNTAIN), (180.0, MOUNTAIN), (283.0, MOUNTAIN)]);
    for flap in 0..12 {
        let outline = "[[40, 0], [50, 0], [50, 10]]";
        let parts = format!(
            "  e{flap}: {{ outline: {outline} }}\njoints:\n  a{flap}: {{ bodies: [f0, e{flap}], axis: [[40, 0], \
             [40, 9]] }}\n"
        );
        crossing = crossing.replace("joints:\n", &parts);
        let mut sheet = fold(&crossing);
        assert!(!sheet.leaves_alone(0), "{flap}");
        let path = sheet.follow(0.5, 10, |_| true);
        assert!(matches!(path.end, End::Flat(_)), "{flap}: {:?}", path.end);
    }
    // The mountain where the others surround the vertex.
    let mut sheet =
        fold(&vertex(&[(0.0, VALLEY), (80.0, MOUNTAIN), (170.0, VALLEY), (280.0, VALLEY)]));
    let path = followed(&mut sheet, 0.3);
    assert_eq!(path.end, End::Reached);
    assert_signs(&sheet, &path);
    let twist = include_str!("../../../examples/fold/square_twist.yaml");
    let mut sheet = fold(twist);
    let path = sheet.follow(0.5, 10, |_| true);
    let End::Flat(stuck) = &path.end else { panic!("{:?}", path.end) };
    assert!(!stuck.loops.is_empty() && (0..4).all(|vertex| sheet.leaves_alone(vertex)));
}

#[test]
fn joints_end_a_fold_at_half_a_turn_and_at_their_limits() {
    // Kawasaki's condition does not hold.
    let creases = [(0.0, VALLEY), (80.0, MOUNTAIN), (170.0, VALLEY), (280.0, VALLEY)];
    let mut sheet = fold(&vertex(&creases));
    let path = followed(&mut sheet, 1.0);
    let End::AtBounds { most, least } = &path.end else { panic!("{:?}", path.end) };
    let last = &path.samples.last().unwrap().q;
    assert!(
        least.is_empty() && most.iter().all(|joint| (last[*joint].abs() - PI).abs() < 1e-6),
        "{last:?}"
    );
    let limited = "fold: 180, limits: [-10, 40]";
    let mut sheet = fold(&vertex(&[creases[0], creases[1], (170.0, limited), creases[3]]));
    let path = followed(&mut sheet, 1.0);
    assert_eq!(path.end, End::AtBounds { most: vec![2], least: vec![] });
    let most = largest(path.samples.iter().map(|sample| sample.q[2]));
    assert!((most - 40_f64.to_radians()).abs() < 1e-6, "{most}");
}

#[test]
fn conditions_of_flat_folded_vertices() {
    let violations = |creases: &[(f64, &str)]| -> Vec<Violation> {
        fold(&vertex(creases)).not_flat_foldable().into_iter().map(|(_, broken)| broken).collect()
    };
    // Sectors of 60, 120, 120 and 60 deg.
    let kite = |last| [(0.0, VALLEY), (60.0, MOUNTAIN), (180.0, VALLEY), (300.0, last)];
    assert_eq!(violations(&kite(VALLEY)), []);
    assert_eq!(violations(&kite(MOUNTAIN)), [Violation::Maekawa { mountains: 2, valleys: 2 }]);
    // Sectors of 60, 110, 70 and 120 deg.
    let odd = violations(&[(0.0, VALLEY), (60.0, VALLEY), (170.0, MOUNTAIN), (240.0, VALLEY)]);
    let [Violation::Kawasaki(sum)] = odd[..] else { panic!("{odd:?}") };
    assert!((sum.to_degrees() - 130.0).abs() < 1e-6 || (sum.to_degrees() - 230.0).abs() < 1e-6);
    // Pieces of a crease on both sides of the vertex are one joint, whose middle may be on the other side.
    for (long, behind) in [("axis: [[0, 0], [30.0,", -90), ("axis: [[0, 0], [-30.0,", 90)] {
        let text = vertex(&kite(VALLEY));
        assert_eq!(text.matches(long).count(), 1, "{text}");
        let text = text.replace(long, &long.replace("[0, 0]", &format!("[{behind}, 0]")));
        assert_eq!(fold(&text).not_flat_foldable(), [], "{text}");
    }
    // A crease that is not folded flat frees the vertex.
    assert!(violations(&kite("fold: 90")).is_empty());
    assert_eq!(fold(&waterbomb()).not_flat_foldable(), []);
}

#[test]
fn a_fold_whose_nearest_state_ends_passes_through_closed_states() {
    // The angles of a vertex with corners of 85 deg change at very different times.
    let creases = [(0.0, MOUNTAIN), (85.0, VALLEY), (180.0, VALLEY), (275.0, VALLEY)];
    let mut sheet = fold(&vertex(&creases));
    let path = followed(&mut sheet, 1.0);
    assert_eq!(path.end, End::Reached);
    assert!(!path.slides.is_empty());
}

/// Two strips of three plates each, beside each other, fixed at one end.
#[test]
fn facets_that_cross_are_found() {
    let text = "units: { length: mm, angle: deg }
materials: { card: { density: 700, thickness: 0.3 } }
layup: [card]
bodies:
  base: { fixed: true, outline: [[0, 0], [10, 0], [10, 10], [0, 10]] }
  a: { outline: [[10, 0], [40, 0], [40, 10], [10, 10]] }
  b: { outline: [[-35, 2], [0, 2], [0, 8], [-35, 8]] }
joints:
  right: { bodies: [base, a], axis: [[10, 0], [10, 10]], fold: -150 }
  left: { bodies: [base, b], axis: [[0, 10], [0, 0]], fold: -150 }
";
    let mut sheet = fold(text);
    let path = followed(&mut sheet, 1.0);
    let facets = Facets::new(&sheet.topology().mechanism);
    let crossing: Vec<bool> = path
        .samples
        .iter()
        .map(|sample| !facets.crossing(&sheet.poses(&sample.q)).is_empty())
        .collect();
    assert!(!crossing[0] && !crossing[10], "{crossing:?}");
    assert!(crossing[20], "{crossing:?}");
    let pairs = facets.crossing(&sheet.poses(&path.samples[20].q));
    assert_eq!(pairs, [[1, 2]]);
}
