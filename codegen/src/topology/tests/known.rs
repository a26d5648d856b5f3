//! Mobilities known from the literature.

use crate::compare::largest;
use std::f64::consts::PI;

use super::{Hinge, codes, hinge, largest_gap, mechanism, rank_of_rows, ray, topology};
use crate::source::Expression;
use crate::topology::{LoopClass, Topology, build};

#[derive(Debug, PartialEq)]
enum Class {
    Planar,
    Spherical,
    Spatial,
}

fn class(class: &LoopClass) -> Class {
    match class {
        LoopClass::Planar { .. } => Class::Planar,
        LoopClass::Spherical { .. } => Class::Spherical,
        LoopClass::Spatial => Class::Spatial,
    }
}

/// One loop with this class, rank and mobility, which assembles away from the flat state.
#[track_caller]
fn check(hinges: &[Hinge], expected: (Class, usize, usize)) -> Topology {
    let topology = topology(hinges);
    assert_eq!(topology.loops.len(), 1);
    let closed = &topology.loops[0];
    assert_eq!((class(&closed.class), closed.rank, closed.mobility), expected);
    assert_eq!((topology.rank, topology.mobility), (expected.1, expected.2));
    assert_eq!(codes(&topology.warnings), [""; 0]);
    let q = topology.assembled.as_ref().expect("an assembled configuration");
    assert!(largest_gap(&topology, q) < 1e-10);
    let furthest = largest(q);
    assert!((0.3..=PI).contains(&furthest), "{q:?}");
    assert_eq!(rank_of_rows(&topology, q), expected.1);
    topology
}

/// A ring of bodies, the ground among them, joined by these lines in order.
fn ring(lines: &[([f64; 2], f64, f64)]) -> Vec<Hinge> {
    let n = lines.len();
    let joint = |(i, (from, angle, z)): (usize, &([f64; 2], f64, f64))| {
        ray([i, (i + 1) % n], *from, *angle, *z)
    };
    lines.iter().enumerate().map(joint).collect()
}

fn degrees(angles: &[f64]) -> Vec<([f64; 2], f64, f64)> {
    angles.iter().map(|angle| ([0.02, -0.01], angle.to_radians(), 0.0005)).collect()
}

#[test]
fn spherical_loops() {
    check(&ring(&degrees(&[0.0, 80.0, 170.0, 260.0])), (Class::Spherical, 3, 1));
    check(&ring(&degrees(&[0.0, 80.0, 140.0, 220.0, 290.0])), (Class::Spherical, 3, 2));
    check(&ring(&degrees(&[0.0, 50.0, 140.0, 180.0, 220.0, 290.0])), (Class::Spherical, 3, 3));
    // The crease pattern of a Miura-ori vertex: two creases in line.
    check(&ring(&degrees(&[0.0, 60.0, 180.0, 300.0])), (Class::Spherical, 3, 1));
}

#[test]
fn planar_loops() {
    let row = |xs: &[f64]| -> Vec<_> { xs.iter().map(|x| ([*x, 0.0], PI / 2.0, 0.0)).collect() };
    // Plates folded back over each other: lengths 1, 3, 3.5, 2.
    check(&ring(&row(&[0.0, 1.0, 4.0, 0.5])), (Class::Planar, 3, 1));
    check(&ring(&row(&[0.0, 1.0, 4.0, 0.5, -1.0])), (Class::Planar, 3, 2));
    // Parallelogram: the flat state is a change point.
    check(&ring(&row(&[0.0, 1.0, 3.0, 2.0])), (Class::Planar, 3, 1));
    // Lines drawn in opposite senses are parallel still.
    let mut opposed = row(&[0.0, 1.0, 4.0, 0.5]);
    opposed[2].1 = -PI / 2.0;
    check(&ring(&opposed), (Class::Planar, 3, 1));
    // Heights make links too.
    let mut high = row(&[0.0, 0.03, 0.03, 0.0]);
    (high[2].2, high[3].2) = (0.02, 0.02);
    check(&ring(&high), (Class::Planar, 3, 1));
}

#[test]
fn hinges_in_a_row_on_one_sheet_are_locked() {
    // Lengths 1, 1, 1 and 3: closed when stretched only, though 4 joints have 3 equations.
    let row: Vec<_> = [0.0, 1.0, 2.0, 3.0].map(|x| ([x, 0.0], PI / 2.0, 0.0)).to_vec();
    let topology = topology(&ring(&row));
    assert_eq!((topology.loops[0].rank, topology.loops[0].mobility), (3, 0));
    assert_eq!((topology.rank, topology.mobility), (3, 0));
    assert_eq!(topology.assembled, None);
    assert_eq!(codes(&topology.warnings), ["immobile"]);
    let message = &topology.warnings.0[0].message;
    assert!(message.contains("only in the flat state (3 independent"), "{message}");
    assert!(message.contains("3000.000 mm, is as long as the others together"), "{message}");
}

/// The corners on one side of a plate's straight edge add up to half a turn: as long as the arc between two opposite
/// points of a sphere, which no chain of them can leave.
#[test]
fn creases_at_a_straight_edge_cannot_turn() {
    let several =
        [[40.0, 100.0, 130.0], [50.0, 129.0, 140.0], [65.0, 118.0, 140.0], [65.0, 129.0, 140.0]];
    let several = several.iter().map(|inner| &inner[..]);
    for inner in [&[60.0, 120.0][..], &[25.0, 70.0, 110.0, 150.0]].into_iter().chain(several) {
        let angles: Vec<f64> = [&[0.0], inner, &[180.0]].concat();
        let mut mechanism = mechanism(&ring(&degrees(&angles)));
        let topology = build(mechanism.clone()).expect("a mechanism");
        assert_eq!((topology.rank, topology.mobility), (2, 1));
        assert_eq!((topology.loops[0].rank, topology.loops[0].mobility), (2, 1));
        assert_eq!(topology.infinitesimal.len(), inner.len() - 1);
        assert_eq!(codes(&topology.warnings), ["immobile"]);
        let names: Vec<_> = (1..=inner.len()).map(|joint| format!("`j{joint}`")).collect();
        let message = &topology.warnings.0[0].message;
        assert!(message.starts_with(&format!("{} cannot turn", names.join(", "))), "{message}");
        // All but one of them hold that one, too.
        for joint in &mut mechanism.joints[2..=inner.len()] {
            joint.drive = Some(Expression::ZERO);
        }
        let held = build(mechanism).expect("a mechanism");
        assert_eq!(held.mobility, 1);
        assert_eq!(codes(&held.warnings), [""; 0]);
    }
}

/// Eight plates around the hole that a sheet of 3 x 3 parallelograms has without its middle one. Folded as the whole sheet
/// would be, five of the six equations are independent. All states beside these are like that, and two dimensions more:
/// the third direction of the null space is no motion. (Seen in states that were computed apart from this program.)
#[test]
fn a_ring_of_a_folded_sheet_is_loose_to_first_order_only() {
    let corner = |column: f64, row: f64| {
        let shift = if row.rem_euclid(2.0) == 0.0 { 0.0 } else { 18.0 };
        [30.0 * column + shift, 24.0 * row]
    };
    let zigzag = |row: f64, column: f64| [corner(column, row), corner(column, row + 1.0)];
    let straight = |row: f64, column: f64| [corner(column, row), corner(column + 1.0, row)];
    let around = [
        zigzag(0.0, 1.0),
        zigzag(0.0, 2.0),
        straight(1.0, 2.0),
        straight(2.0, 2.0),
        zigzag(2.0, 2.0),
        zigzag(2.0, 1.0),
        straight(2.0, 0.0),
        straight(1.0, 0.0),
    ];
    let hinges: Vec<Hinge> = around
        .iter()
        .enumerate()
        .map(|(index, [from, to])| hinge([index, (index + 1) % 8], *from, *to))
        .collect();
    let mut mechanism = mechanism(&hinges);
    let straight = 24.637942882669687_f64;
    let folded = [40.0, -40.0, straight, -straight, -40.0, 40.0, -straight, straight];
    mechanism.initial_q = [1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0]
        .iter()
        .zip(folded)
        .map(|(sense, angle)| sense * angle.to_radians())
        .collect();
    let topology = build(mechanism).expect("a mechanism");
    let q = topology.assembled.as_ref().expect("a closed state");
    assert!((q[0].abs() - 40_f64.to_radians()).abs() < 1e-6, "{q:?}");
    assert_eq!((topology.rank, topology.mobility), (5, 2));
    assert!(topology.is_shaky);
    assert_eq!(codes(&topology.warnings), ["immobile"]);
}

#[test]
fn triangle_is_rigid() {
    let row: Vec<_> = [0.0, 1.0, 3.0].map(|x| ([x, 0.0], PI / 2.0, 0.0)).to_vec();
    let topology = topology(&ring(&row));
    assert_eq!((topology.rank, topology.mobility), (3, 0));
    assert_eq!(codes(&topology.warnings), ["immobile"]);
    let topology = self::topology(&ring(&degrees(&[0.0, 100.0, 230.0])));
    assert_eq!((topology.rank, topology.mobility), (3, 0));
    assert_eq!(codes(&topology.warnings), ["immobile"]);
}

#[test]
fn two_hinges_between_ground_and_body() {
    // In line: one hinge in two pieces. The two angles are one: rank 1, mobility 1.
    let in_line = [hinge([0, 1], [0.0, 0.0], [0.0, 1.0]), hinge([0, 1], [0.0, 2.0], [0.0, 3.0])];
    let topology = check(&in_line, (Class::Planar, 1, 1));
    let q = topology.assembled.unwrap();
    assert!((q[0] - q[1]).abs() < 1e-11);
    // Aside, or crossing: locked.
    for line in [[[1.0, 0.0], [1.0, 1.0]], [[0.0, 0.5], [1.0, 0.5]]] {
        let locked = [hinge([0, 1], [0.0, 0.0], [0.0, 1.0]), hinge([1, 0], line[0], line[1])];
        let topology = self::topology(&locked);
        assert_eq!((topology.rank, topology.mobility), (2, 0));
        assert_eq!(topology.assembled, None);
        assert_eq!(codes(&topology.warnings), ["immobile"]);
    }
}

/// Two triples of parallel hinges under an angle, the top folded onto the base.
fn sarrus(angle: f64) -> Vec<Hinge> {
    let mut hinges = Vec::new();
    for (leg, angle) in [0.0, angle].into_iter().enumerate() {
        let (along, out) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
        let (low, high) = (1 + 2 * leg, 2 + 2 * leg);
        for (bodies, at) in [([0, low], 0.3), ([low, high], 0.8), ([high, 5], 0.3)] {
            let from = [out[0] * at, out[1] * at];
            let to = [from[0] + 0.2 * along[0], from[1] + 0.2 * along[1]];
            hinges.push(hinge(bodies, from, to));
        }
    }
    hinges
}

#[test]
fn sarrus_linkage_has_one_redundant_equation() {
    check(&sarrus(PI / 2.0), (Class::Spatial, 5, 1));
    check(&sarrus(1.0), (Class::Spatial, 5, 1));
}

#[test]
fn bennett_linkage() {
    // Lines across one vertical line, at heights and angles of the flat state of a Bennett
    // linkage: lengths a, b and twists alpha, beta with sin(alpha)/a = sin(beta)/b.
    let (a, alpha, beta) = (0.05, 0.5_f64, 1.1_f64);
    let b = a * beta.sin() / alpha.sin();
    let lines = [(0.0, 0.0), (a, alpha), (a - b, alpha - beta), (-b, -beta)];
    let at = |b: f64| lines.map(|(z, angle)| ([0.0, 0.0], angle, z + b)).to_vec();
    check(&ring(&at(0.0)), (Class::Spatial, 3, 1));
    // Without that ratio, four skew lines lock.
    let mut locked = at(0.0);
    locked[2].2 *= 1.2;
    let topology = topology(&ring(&locked));
    assert_eq!(topology.mobility, 0);
    assert_eq!(codes(&topology.warnings), ["immobile"]);
}

fn skew(n: usize) -> Vec<([f64; 2], f64, f64)> {
    let line = |i: usize| {
        let t = i as f64;
        (
            [0.2 * (2.3 * t).sin(), 0.15 * (1.7 * t + 1.0).cos()],
            1.9 * t + 0.3 * (t * t),
            0.02 * (t * 1.3).sin(),
        )
    };
    (0..n).map(line).collect()
}

#[test]
fn spatial_loops() {
    check(&ring(&skew(7)), (Class::Spatial, 6, 1));
    check(&ring(&skew(8)), (Class::Spatial, 6, 2));
    let rigid = topology(&ring(&skew(6)));
    assert_eq!((rigid.rank, rigid.mobility), (6, 0));
    assert_eq!(codes(&rigid.warnings), ["immobile"]);
}

#[test]
fn two_loops_that_share_a_body() {
    // Watt's six-bar, folded flat: two four-bars that share the ternary body b2.
    let at = |bodies, x: f64| hinge(bodies, [x, 0.0], [x, 1.0]);
    let watt = [
        at([0, 1], 0.0),
        at([1, 2], 1.0),
        at([2, 3], 4.0),
        at([3, 0], 0.5),
        at([2, 4], 3.0),
        at([4, 5], 4.2),
        at([5, 3], 1.3),
    ];
    let topology = topology(&watt);
    assert_eq!(topology.loops.len(), 2);
    assert_eq!((topology.rank, topology.mobility), (6, 1));
    assert!(topology.loops.iter().all(|l| l.rank == 3 && l.mobility == l.joints.len() - 3));
    assert!(largest_gap(&topology, topology.assembled.as_ref().unwrap()) < 1e-10);
}

#[test]
fn a_rigid_loop_does_not_hide_what_else_moves() {
    let at = |bodies, x: f64| hinge(bodies, [x, 0.0], [x, 1.0]);
    // A triangle b0 b1 b2, on b1 a pendulum, on b2 a four-bar.
    let hinges = [
        at([0, 1], 0.0),
        at([1, 2], 1.0),
        at([2, 0], 2.0),
        at([1, 3], 0.5),
        at([2, 4], 0.0),
        at([4, 5], 1.0),
        at([5, 6], 4.0),
        at([6, 2], 0.5),
    ];
    let topology = topology(&hinges);
    assert_eq!(topology.loops.len(), 2);
    assert_eq!((topology.rank, topology.mobility), (6, 2));
    assert_eq!(codes(&topology.warnings), ["immobile"]);
    let q = topology.assembled.as_ref().unwrap();
    assert_eq!(q[..4], [0.0; 4]);
    assert!(q[4..].iter().any(|q| q.abs() > 0.3));
}

#[test]
fn the_branch_of_the_guess_is_kept() {
    // Either of two mirrored branches: a rough guess near one decides.
    let row: Vec<_> = [0.0, 1.0, 4.0, 0.5].map(|x| ([x, 0.0], PI / 2.0, 0.0)).to_vec();
    let mut mechanism = mechanism(&ring(&row));
    let plain = build(mechanism.clone()).unwrap().assembled.unwrap();
    for sign in [1.0, -1.0] {
        mechanism.initial_q = plain.iter().map(|q| sign * q + 0.05).collect();
        let assembled = build(mechanism.clone()).unwrap().assembled.unwrap();
        let close = |(q, p): (&f64, &f64)| (q - sign * p).abs() < 0.3;
        assert!(assembled.iter().zip(&plain).all(close), "{assembled:?} {plain:?}");
    }
}

#[test]
fn limits_are_respected_where_possible() {
    let row: Vec<_> = [0.0, 1.0, 4.0, 0.5].map(|x| ([x, 0.0], PI / 2.0, 0.0)).to_vec();
    for limits in [[-0.05, 1.0], [-1.0, 0.05]] {
        let mut mechanism = mechanism(&ring(&row));
        mechanism.joints[0].limits = limits;
        let topology = build(mechanism).unwrap();
        assert_eq!(topology.mobility, 1);
        let q = topology.assembled.unwrap()[0];
        assert!((limits[0]..=limits[1]).contains(&q), "{q}");
    }
}
