//! Rigid origami: sheets of facets joined by their creases.

use nalgebra::{DVector, Vector2};

use super::{Hinge, codes, hinge, largest_gap, mechanism, ray, topology};
use crate::arithmetic::largest;
use crate::laminate::Joint;
use crate::source::Expression;
use crate::topology::rounded::{Vertex, unlocked};
use crate::topology::{LoopClass, build};

/// A Miura-ori sheet of n x n facets.
fn miura(n: usize) -> Vec<Hinge> {
    sheet(n, CORNER)
}

/// From a corner of a facet of Miura-ori to the next one along a column.
const CORNER: [f64; 2] = [0.6, 1.0];

/// A sheet of n x n facets: parallelograms in columns that zigzag.
fn sheet(n: usize, [lean, height]: [f64; 2]) -> Vec<Hinge> {
    let vertex = |row: usize, column: usize| {
        let lean = if row.is_multiple_of(2) { 0.0 } else { lean };
        [column as f64 + lean, row as f64 * height]
    };
    let facet = |row: usize, column: usize| row * n + column;
    let mut hinges = Vec::new();
    for row in 0..n {
        for column in 0..n {
            if column + 1 < n {
                let bodies = [facet(row, column), facet(row, column + 1)];
                hinges.push(hinge(bodies, vertex(row, column + 1), vertex(row + 1, column + 1)));
            }
            if row + 1 < n {
                let bodies = [facet(row, column), facet(row + 1, column)];
                hinges.push(hinge(bodies, vertex(row + 1, column), vertex(row + 1, column + 1)));
            }
        }
    }
    hinges
}

/// Which creases of Miura-ori are mountains (1) and valleys (-1), hinge by hinge.
fn signs(n: usize) -> Vec<f64> {
    let mut signs = Vec::new();
    for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
        let sign = |index: usize| if index.is_multiple_of(2) { 1.0 } else { -1.0 };
        signs.extend((column + 1 < n).then(|| sign(column)));
        signs.extend((row + 1 < n).then(|| sign(row + column)));
    }
    signs
}

/// A flat sheet of that size has motions of nine degrees of freedom that fold some creases only, and these are found more
/// easily. Which are mountains and valleys says which motion is meant: their finished folds, or else the angles of rest.
#[test]
fn a_flat_sheet_moves_as_its_mountains_and_valleys_say() {
    let (n, signs) = (10, signs(10));
    let mark: [fn(&mut Joint, f64); 2] = [
        |joint, sign| joint.fold = Some(sign * std::f64::consts::PI),
        |joint, sign| joint.rest = Expression::Number(sign),
    ];
    for mark in mark {
        let mut mechanism = mechanism(&miura(n));
        mechanism.joints.iter_mut().zip(&signs).for_each(|(joint, sign)| mark(joint, *sign));
        let topology = build(mechanism).expect("a sheet");
        assert_eq!((topology.rank, topology.mobility), (signs.len() - 1, 1));
        let q = topology.assembled.expect("a folded state");
        let most = largest(&q);
        assert!(
            most > 0.02 && q.iter().zip(&signs).all(|(q, sign)| q * sign > 0.3 * most),
            "{q:?}"
        );
    }
}

#[test]
fn miura_sheets_have_one_degree_of_freedom() {
    for n in [2, 3, 4, 6] {
        let hinges = miura(n);
        let topology = topology(&hinges);
        assert_eq!(hinges.len(), 2 * n * (n - 1));
        assert_eq!(topology.loops.len(), (n - 1) * (n - 1));
        assert_eq!((topology.rank, topology.mobility), (hinges.len() - 1, 1), "{n} x {n}");
        assert_eq!(codes(&topology.warnings), [""; 0]);
        // The loops are those about the inner vertices, wherever they are in the tree.
        for closed in &topology.loops {
            let spherical = matches!(closed.class, LoopClass::Spherical { .. });
            assert!(spherical && closed.joints.len() == 4, "{closed}");
        }
        let q = topology.assembled.as_ref().unwrap();
        assert!(largest_gap(&topology, q) < 1e-10);
        // The Miura motion folds every crease; larger sheets have many others of its rank.
        assert!(n > 4 || q.iter().all(|q| q.abs() > 1e-2), "{q:?}");
    }
}

/// The angles of a sheet whose zigzag creases are folded by `zigzag`, in the order of its hinges.
fn folded(n: usize, [lean, height]: [f64; 2], zigzag: f64) -> Vec<f64> {
    let corner = height.atan2(lean);
    let straight = 2.0 * (corner.cos() * (zigzag / 2.0).tan()).atan();
    let sign = |even: bool| if even { 1.0 } else { -1.0 };
    let mut angles = Vec::new();
    for row in 0..n {
        for column in 0..n {
            if column + 1 < n {
                angles.push(sign(column % 2 == 0) * zigzag);
            }
            if row + 1 < n {
                angles.push(sign((row + column) % 2 == 0) * straight);
            }
        }
    }
    angles
}

/// Checks that a sheet whose drawing is turned and rounded moves, by hinge lines that move less than the rounding, from the
/// guess.
fn check_rounded(n: usize, corner: [f64; 2], zigzag: f64, turn: f64, decimals: i32) {
    let (sin, cos) = turn.sin_cos();
    let unit = 10.0_f64.powi(-decimals);
    let rounded = |x: f64| (x / unit).round() * unit;
    // Plates of 30 mm, in mm.
    let turned = |[x, y]: [f64; 2]| {
        [rounded(30.0 * (cos * x - sin * y)), rounded(30.0 * (sin * x + cos * y))]
    };
    let mut hinges = sheet(n, corner);
    hinges.iter_mut().for_each(|hinge| hinge.line = hinge.line.map(turned));
    let mut drawn = mechanism(&hinges);
    drawn.tolerance = 0.5 * unit;
    // As a person would write them.
    drawn.initial_q = folded(n, corner, zigzag).iter().map(|q| (q * 1e4).round() / 1e4).collect();
    let topology = build(drawn.clone()).unwrap();
    let name = format!("{n} x {n}, turned by {turn} rad, {decimals} decimals");
    assert_eq!((topology.rank, topology.mobility), (hinges.len() - 1, 1), "{name}");
    let q = topology.assembled.as_ref().unwrap();
    assert!(largest_gap(&topology, q) < 1e-10 * drawn.size, "{name}");
    let off = q.iter().zip(&drawn.initial_q).map(|(q, guess)| (q - guess).abs());
    assert!(largest(off) < 0.05, "{name}: {q:?}");
    // Along both axes by the tolerance, and what ends a search.
    let allowed = 1.05 * 2.0_f64.sqrt() * drawn.tolerance;
    for (joint, drawn) in topology.mechanism.joints.iter().zip(&drawn.joints) {
        for end in [drawn.point, drawn.point + drawn.direction * drawn.length] {
            let off = (end - joint.point).cross(&joint.direction).norm();
            assert!(off <= allowed, "{name}: {off:e}");
        }
    }
}

#[test]
fn rounded_miura_sheets_move() {
    for (n, degrees, decimals) in
        [(3, 37.3, 4), (3, 0.0, 2), (4, 71.0, 12), (6, 37.3, 2), (6, 123.4, 3), (10, 11.0, 6)]
    {
        check_rounded(n, CORNER, 0.7, f64::to_radians(degrees), decimals);
    }
}

/// Where the search for the lines ends depends on every digit of a drawing.
#[test]
fn small_rounded_sheets_move_however_they_are_turned() {
    let corner = [0.5, 0.75_f64.sqrt()];
    for (n, turn, decimals) in [(3, 0.85, 3), (3, 0.675, 6), (3, 1.15, 2), (4, 0.8, 2)] {
        check_rounded(n, corner, 0.8, turn, decimals);
    }
    for decimals in [2, 4, 9] {
        for turn in 0..10 {
            check_rounded(3, corner, 0.8, 0.05 + 0.15 * f64::from(turn), decimals);
        }
    }
}

/// A guess that is far from closed does not move the lines of exact drawings.
#[test]
fn exact_sheets_keep_their_bits() {
    let hinges = miura(3);
    let mut drawn = mechanism(&hinges);
    drawn.tolerance = 1e-4;
    for wild in [0.1, 0.4, 0.9] {
        let angles = folded(3, CORNER, 0.7).into_iter().enumerate();
        drawn.initial_q = angles.map(|(i, q)| q + wild * (i as f64).sin()).collect();
        let topology = build(drawn.clone()).unwrap();
        assert_eq!(topology.mobility, 1);
        for (joint, drawn) in topology.mechanism.joints.iter().zip(&drawn.joints) {
            assert_eq!((joint.point, joint.direction), (drawn.point, drawn.direction), "{wild}");
        }
    }
}

/// Where no row depends on the others there is nothing to unlock.
#[test]
fn a_vertex_alone_is_not_moved() {
    let rays: Vec<Hinge> =
        (0..5).map(|i| ray([i, (i + 1) % 5], [0.0, 0.0], 1.2 * i as f64, 0.0)).collect();
    let mut drawn = mechanism(&rays);
    drawn.tolerance = 1e-4;
    let hinges = (0..5).map(|joint| (joint, 1.0)).collect();
    let vertex = Vertex { hinges, centre: Vector2::zeros() };
    let states = [0.3, 0.5].map(|angle| {
        DVector::from_iterator(5, (0..5).map(|i| 0.02 * angle * (i as f64 + angle).sin()))
    });
    assert!(unlocked(&drawn, &drawn.joints, &[vertex], &states, 1e-3).is_none());
}
