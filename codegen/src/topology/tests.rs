//! Trees, loops and mobilities of mechanisms whose mobility is known.

use std::fmt::Write;

use super::{LoopClass, Topology, build};
use crate::source::{Diagnostics, SourceFile, parse};

/// A mechanism of bodies `b0` (fixed), `b1`, ... from hinge lines (first body, second body, axis).
fn mechanism(bodies: usize, hinges: &[(usize, usize, [[f64; 2]; 2])]) -> Topology {
    let lines: Vec<_> = hinges.iter().map(|&(a, b, axis)| (a, b, axis, 0.0)).collect();
    at_heights(bodies, &lines)
}

fn at_heights(bodies: usize, hinges: &[(usize, usize, [[f64; 2]; 2], f64)]) -> Topology {
    let mut text = "bodies:\n  b0: { fixed: true }\n".to_owned();
    for body in 1..bodies {
        let inertia = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
        writeln!(text, "  b{body}: {{ mass: 1, com: [0, 0, 0], inertia: {inertia} }}").ok();
    }
    text.push_str("joints:\n");
    for (index, (a, b, axis, z)) in hinges.iter().enumerate() {
        let entry = format!("{{ bodies: [b{a}, b{b}], axis: {axis:?}, z: {z} }}");
        writeln!(text, "  j{index}: {entry}").ok();
    }
    let file = SourceFile { path: "test.yaml".into(), text };
    let (model, _) = parse(&file).unwrap_or_else(|problems| panic!("{problems}"));
    let mechanism = crate::laminate::build(&model, &mut Diagnostics::default())
        .unwrap_or_else(|problems| panic!("{problems}"));
    build(mechanism).unwrap_or_else(|problems| panic!("{problems}"))
}

/// A ring of bodies, `b0` first, around lines from the origin at these angles (degrees).
fn spherical(angles: &[f64]) -> Topology {
    let n = angles.len();
    let hinges: Vec<_> = angles
        .iter()
        .enumerate()
        .map(|(i, angle)| {
            let (sin, cos) = angle.to_radians().sin_cos();
            (i, (i + 1) % n, [[0.0, 0.0], [cos, sin]])
        })
        .collect();
    mechanism(n, &hinges)
}

#[test]
fn spherical_loops_have_rank_three() {
    for (angles, mobility) in [
        (&[0.0, 70.0, 160.0, 250.0][..], 1),
        (&[0.0, 70.0, 130.0, 210.0, 290.0], 2),
        (&[0.0, 60.0, 115.0, 180.0, 240.0, 300.0], 3),
    ] {
        let topology = spherical(angles);
        assert!(matches!(topology.loops[0].class, LoopClass::Spherical { .. }));
        assert_eq!((topology.rank, topology.mobility), (3, mobility), "{angles:?}");
    }
}

#[test]
fn a_planar_four_bar_moves_once() {
    let line = |x: f64| [[x, 0.0], [x, 1.0]];
    // Drawn stretched out it would be locked: the ground's hinges are next to each other.
    let hinges = [(0, 1, line(0.0)), (0, 2, line(1.0)), (1, 3, line(2.5)), (2, 3, line(3.3))];
    let topology = mechanism(4, &hinges);
    assert!(matches!(topology.loops[0].class, LoopClass::Planar { .. }));
    assert_eq!((topology.loops[0].rank, topology.mobility), (3, 1));
}

#[test]
fn a_general_seven_bar_moves_once_and_a_six_bar_does_not() {
    let line = |i: usize| {
        let (x, angle) = (i as f64, 0.9 * i as f64 + 0.3);
        [[x, 0.1 * x * x], [x + angle.cos(), 0.1 * x * x + angle.sin()]]
    };
    for (n, mobility) in [(7, 1), (6, 0)] {
        let hinges: Vec<_> =
            (0..n).map(|i| (i, (i + 1) % n, line(i), 0.05 * (i * i % 5) as f64)).collect();
        let topology = at_heights(n, &hinges);
        assert!(matches!(topology.loops[0].class, LoopClass::Spatial));
        assert_eq!((topology.loops[0].rank, topology.mobility), (6, mobility));
    }
}

#[test]
fn a_sarrus_linkage_has_rank_five() {
    // Two chains of three parallel hinges each, at right angles, lift the plate.
    let across = |y: f64| [[0.0, y], [1.0, y]];
    let along = |x: f64| [[x, 0.0], [x, 1.0]];
    let hinges = [
        (0, 1, across(0.0)),
        (1, 2, across(1.5)),
        (2, 3, across(1.0)),
        (0, 4, along(0.0)),
        (4, 5, along(1.5)),
        (5, 3, along(1.0)),
    ];
    let topology = mechanism(6, &hinges);
    assert_eq!((topology.rank, topology.mobility), (5, 1));
}

#[test]
fn a_miura_sheet_of_nine_vertices_moves_once() {
    // 4 x 4 facets; fold lines along x are straight, those along y zigzag.
    let at = |i: usize, j: usize| {
        let shift = 0.4 * (j % 2) as f64;
        [i as f64 + shift, j as f64]
    };
    let facet = |i: usize, j: usize| 4 * j + i;
    let mut hinges = Vec::new();
    for j in 0..4 {
        for i in 0..4 {
            if i < 3 {
                hinges.push((facet(i, j), facet(i + 1, j), [at(i + 1, j), at(i + 1, j + 1)]));
            }
            if j < 3 {
                hinges.push((facet(i, j), facet(i, j + 1), [at(i, j + 1), at(i + 1, j + 1)]));
            }
        }
    }
    let topology = mechanism(16, &hinges);
    assert_eq!((topology.nodes.len(), topology.loops.len()), (24, 9));
    assert_eq!((topology.rank, topology.mobility), (23, 1));
    let shares: f64 = topology.nodes.iter().filter(|n| n.body.index() == 5).map(|n| n.share).sum();
    assert!((shares - 1.0).abs() < 1e-15);
}

#[test]
fn two_hinges_to_the_ground_lock_or_share_a_line() {
    let apart = [(0, 1, [[0.0, 0.0], [1.0, 0.0]]), (0, 1, [[0.0, 1.0], [1.0, 1.3]])];
    assert_eq!(mechanism(2, &apart).mobility, 0);
    let in_line = [(0, 1, [[0.0, 0.0], [1.0, 0.0]]), (0, 1, [[2.0, 0.0], [3.0, 0.0]])];
    assert_eq!(mechanism(2, &in_line).mobility, 1);
}

#[test]
fn several_loops_through_one_body_share_its_mass() {
    // Three legs carry body 1: the first holds the original, the others a ghost each.
    let line = |x: f64| [[x, 0.0], [x, 1.0]];
    let hinges = [
        (0, 2, line(0.0)),
        (0, 3, line(1.0)),
        (0, 4, line(2.0)),
        (2, 1, line(4.0)),
        (3, 1, line(5.0)),
        (4, 1, line(6.0)),
    ];
    let topology = mechanism(5, &hinges);
    assert_eq!((topology.loops.len(), topology.nodes.len()), (2, 6));
    let shares: Vec<_> =
        topology.nodes.iter().filter(|n| n.body.index() == 1).map(|n| n.share).collect();
    assert_eq!(shares, [1.0 / 3.0; 3]);
}

#[test]
fn a_near_miss_is_reported() {
    let hinges: Vec<_> = [0.0_f64, 70.0, 160.0, 250.0]
        .iter()
        .enumerate()
        .map(|(i, angle)| {
            let (sin, cos) = angle.to_radians().sin_cos();
            let miss = if i == 2 { 0.001 } else { 0.0 };
            (i, (i + 1) % 4, [[0.0, miss], [cos, sin + miss]])
        })
        .collect();
    let topology = mechanism(4, &hinges);
    assert!(matches!(topology.loops[0].class, LoopClass::Spatial));
    assert_eq!(topology.warnings.0[0].code, "near-miss");
}
