//! Rounded drawings: what hinge lines have in common survives a few decimals.

use crate::uniform::Random;
use std::f64::consts::{PI, TAU};

use super::{Hinge, codes, hinge, largest_gap, mechanism, ray};
use crate::laminate::Mechanism;
use crate::topology::{LoopClass, Topology, build};

/// The hinges turned by an angle, shifted, and written with so many decimals.
fn drawn(hinges: &[Hinge], angle: f64, decimals: i32) -> Mechanism {
    let unit = 10_f64.powi(decimals);
    let (sine, cosine) = angle.sin_cos();
    let written = |[x, y]: [f64; 2]| {
        let turned = [cosine * x - sine * y + 3.3, sine * x + cosine * y - 7.1];
        turned.map(|x| (x * unit).round() / unit)
    };
    let hinges: Vec<_> = hinges.iter().map(|h| Hinge { line: h.line.map(written), ..*h }).collect();
    Mechanism { tolerance: 0.5 / unit, ..mechanism(&hinges) }
}

/// Builds, and checks that no hinge line left its tolerance.
#[track_caller]
fn built(mechanism: &Mechanism) -> Topology {
    let topology = build(mechanism.clone()).unwrap();
    for (before, after) in mechanism.joints.iter().zip(&topology.mechanism.joints) {
        assert!(before.direction.dot(&after.direction) > 0.9, "{} was reversed", before.name);
        for end in [before.point, before.point + before.direction * before.length] {
            let off = (end - after.point).cross(&after.direction).norm();
            let allowed = 1.06 * 2.0_f64.sqrt() * mechanism.tolerance + 1e-13 * mechanism.size;
            assert!(off <= allowed, "{} moved by {off:e} of {allowed:e}", before.name);
        }
    }
    topology
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Class {
    Planar,
    Spherical,
    Spatial,
}

/// The classes of all loops.
fn classes(topology: &Topology) -> Vec<Class> {
    let class = |class: &LoopClass| match class {
        LoopClass::Planar { .. } => Class::Planar,
        LoopClass::Spherical { .. } => Class::Spherical,
        LoopClass::Spatial => Class::Spatial,
    };
    topology.loops.iter().map(|closed| class(&closed.class)).collect()
}

/// Draws at many angles and decimals: one loop, with this class, rank and mobility.
#[track_caller]
fn check(
    hinges: &[Hinge],
    decimals: std::ops::RangeInclusive<i32>,
    expected: (Class, usize, usize),
) {
    for decimals in decimals {
        for angle in [0.0, 1e-3, 0.3, 0.651, PI / 4.0, 1.3, PI / 2.0, 2.2, 4.0, 6.1] {
            let topology = built(&drawn(hinges, angle, decimals));
            let context = format!("{decimals} decimals at {angle} rad: {}", topology.warnings);
            let [closed] = &topology.loops[..] else { panic!("{context}") };
            assert_eq!(classes(&topology), [expected.0], "{context}");
            assert_eq!((closed.rank, closed.mobility), (expected.1, expected.2), "{context}");
            assert!(codes(&topology.warnings).iter().all(|code| *code == "rounded"), "{context}");
            let q = topology.assembled.as_ref().expect("an assembled configuration");
            assert!(largest_gap(&topology, q) < 1e-12 * topology.mechanism.size, "{context}");
        }
    }
}

/// A ring of bodies, the ground among them, joined by these lines.
fn ring(lines: &[[[f64; 2]; 2]]) -> Vec<Hinge> {
    let n = lines.len();
    let joint = |(i, line): (usize, &[[f64; 2]; 2])| Hinge {
        bodies: [i, (i + 1) % n],
        line: *line,
        z: 0.5,
    };
    lines.iter().enumerate().map(joint).collect()
}

/// Parallel lines at these places, of unlike lengths, some reversed.
fn parallel(places: &[f64]) -> Vec<Hinge> {
    let line = |(i, x): (usize, &f64)| {
        let y = 20.0 + 7.0 * i as f64;
        if i == 1 { [[*x, y], [*x, 0.0]] } else { [[*x, 3.0 * i as f64], [*x, y]] }
    };
    ring(&places.iter().enumerate().map(line).collect::<Vec<_>>())
}

/// Lines through a point under these angles in degrees, at unlike distances from it.
fn concurrent(degrees: &[f64]) -> Vec<Hinge> {
    let line = |(i, degrees): (usize, &f64)| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let near = 9.0 * (i % 3) as f64;
        [near, near + 25.0 + 4.0 * i as f64].map(|r| [12.0 + r * cosine, -4.0 + r * sine])
    };
    ring(&degrees.iter().enumerate().map(line).collect::<Vec<_>>())
}

#[test]
fn four_bar_is_planar_at_any_angle_and_decimals() {
    check(&parallel(&[0.0, 90.0, 125.0, 40.0]), 2..=12, (Class::Planar, 3, 1));
    check(&parallel(&[0.0, 90.0, 125.0, 40.0, 60.0]), 2..=4, (Class::Planar, 3, 2));
}

#[test]
fn lines_through_a_point_are_spherical() {
    let six = concurrent(&[0.0, 50.0, 140.0, 180.0, 220.0, 290.0]);
    check(&six, 2..=12, (Class::Spherical, 3, 3));
    check(&concurrent(&[0.0, 80.0, 170.0, 260.0]), 2..=4, (Class::Spherical, 3, 1));
}

#[test]
fn sarrus_linkage_keeps_its_mobility() {
    let mut hinges = Vec::new();
    for (leg, angle) in [0.0_f64, 1.9].into_iter().enumerate() {
        let (along, out) = ([angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]);
        let (low, high) = (1 + 2 * leg, 2 + 2 * leg);
        for (bodies, at, by) in
            [([0, low], 30.0, 0.0), ([low, high], 80.0, 4.0), ([high, 5], 30.0, 9.0)]
        {
            let from = [out[0] * at + along[0] * by, out[1] * at + along[1] * by];
            let to = [from[0] + 20.0 * along[0], from[1] + 20.0 * along[1]];
            hinges.push(Hinge { z: 0.5, ..hinge(bodies, from, to) });
        }
    }
    check(&hinges, 2..=8, (Class::Spatial, 5, 1));
}

#[test]
fn two_pieces_of_one_hinge_are_in_line() {
    let pieces = [[[0.0, 0.0], [30.0, 0.0]], [[45.0, 0.0], [60.0, 0.0]]];
    let hinges = pieces.map(|line| Hinge { bodies: [0, 1], line, z: 0.5 });
    check(&hinges, 2..=8, (Class::Planar, 1, 1));
}

#[test]
fn loops_that_share_hinges_are_made_exact_together() {
    // Watt's six-bar, and a four-bar one of whose hinges is also one of a spherical loop.
    let at = |bodies, x: f64| hinge(bodies, [40.0 * x, 0.0], [40.0 * x, 25.0]);
    let watt = [
        at([0, 1], 0.0),
        at([1, 2], 1.0),
        at([2, 3], 4.0),
        at([3, 0], 0.5),
        at([2, 4], 3.0),
        at([4, 5], 4.2),
        at([5, 3], 1.3),
    ];
    let spoke = |bodies, degrees: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        hinge(bodies, [9.0 * cosine, 9.0 * sine], [40.0 * cosine, 40.0 * sine])
    };
    let mixed = [
        at([0, 1], 0.0),
        at([1, 2], 1.0),
        at([2, 3], 2.5),
        at([3, 0], 0.5),
        spoke([1, 4], 10.0),
        spoke([4, 5], 190.0),
        spoke([5, 6], 240.0),
        spoke([6, 0], 320.0),
    ];
    for (angle, decimals) in [(0.4, 2), (0.4, 4), (2.0, 3), (5.0, 6)] {
        let topology = built(&drawn(&watt, angle, decimals));
        assert_eq!(classes(&topology), [Class::Planar, Class::Planar]);
        assert_eq!((topology.rank, topology.mobility), (6, 1));
        let topology = built(&drawn(&mixed, angle, decimals));
        let mut found = classes(&topology);
        found.sort_by_key(|class| format!("{class:?}"));
        assert_eq!(found, [Class::Planar, Class::Spherical], "{}", topology.warnings);
        assert_eq!(codes(&topology.warnings), ["rounded"]);
    }
}

#[test]
fn what_is_beyond_the_tolerance_stays_as_drawn() {
    let rounded = drawn(&parallel(&[0.0, 90.0, 125.0, 40.0]), 0.651, 4);
    for tolerance in [0.0, rounded.tolerance / 10.0] {
        let mechanism = Mechanism { tolerance, ..rounded.clone() };
        let topology = build(mechanism.clone()).unwrap();
        assert_eq!(classes(&topology), [Class::Spatial]);
        assert_eq!(codes(&topology.warnings), ["near-miss", "immobile"], "{tolerance:e}");
        for (before, after) in mechanism.joints.iter().zip(&topology.mechanism.joints) {
            assert_eq!((before.point, before.direction), (after.point, after.direction));
        }
    }
    // One line off by six times what rounding can do.
    let mut hinges = parallel(&[0.0, 90.0, 125.0, 40.0]);
    hinges[2].line[1][0] += 6e-4;
    let topology = build(drawn(&hinges, 0.651, 4)).unwrap();
    assert_eq!(classes(&topology), [Class::Spatial]);
    assert_eq!(codes(&topology.warnings)[0], "near-miss");
    // Heights are coordinates, too.
    let mut hinges = concurrent(&[0.0, 80.0, 170.0, 260.0]);
    hinges[1].z += 0.8e-4;
    assert_eq!(classes(&built_level(&hinges)), [Class::Spherical]);
    hinges[1].z += 2e-4;
    assert_eq!(classes(&built_level(&hinges)), [Class::Spatial]);
}

fn built_level(hinges: &[Hinge]) -> Topology {
    build(drawn(hinges, 0.651, 4)).unwrap()
}

#[test]
fn exact_drawings_keep_their_bits() {
    for hinges in [parallel(&[0.0, 90.0, 125.0, 40.0]), concurrent(&[0.0, 80.0, 170.0, 260.0])] {
        let exact = Mechanism { tolerance: 1e-3, ..mechanism(&hinges) };
        let topology = build(exact.clone()).unwrap();
        assert_eq!(codes(&topology.warnings), [""; 0]);
        for (before, after) in exact.joints.iter().zip(&topology.mechanism.joints) {
            assert_eq!((before.point, before.direction), (after.point, after.direction));
        }
    }
}

#[test]
fn lines_of_one_direction_share_its_bits() {
    let topology = built(&drawn(&parallel(&[0.0, 90.0, 125.0, 40.0]), 0.651, 3));
    let directions = topology.mechanism.joints.iter().map(|joint| joint.direction);
    let first = topology.mechanism.joints[0].direction;
    assert!(directions.into_iter().all(|d| d == first || d == -first));
    assert_eq!(codes(&topology.warnings), ["rounded"]);
    let message = &topology.warnings.0[0].message;
    assert!(message.starts_with("hinge lines were moved by at most 0."), "{message}");
}

#[test]
fn random_loops_at_three_decimals_are_what_they_were() {
    let mut numbers = Random::new(7);
    let mut random = |low: f64, high: f64| numbers.range(low, high);
    for case in 0..60 {
        let n = 4 + case % 3;
        let angle = random(0.0, TAU);
        let centre = [0, 1].map(|_| random(-60.0, 60.0));
        let mut lines = [Vec::new(), Vec::new()];
        for i in 0..n {
            let [x, y] = [0, 1].map(|_| random(-100.0, 100.0));
            let length = random(8.0, 60.0);
            let reach = |angle: f64, r: f64| [r * angle.cos(), r * angle.sin()];
            let [dx, dy] = reach(angle, length);
            lines[0].push(Hinge {
                bodies: [i, (i + 1) % n],
                line: [[x, y], [x + dx, y + dy]],
                z: random(0.0, 3.0),
            });
            let spoke = random(0.0, TAU);
            let near = random(0.0, 40.0);
            let ends = [near, near + length]
                .map(|r| reach(spoke, r))
                .map(|[x, y]| [centre[0] + x, centre[1] + y]);
            lines[1].push(Hinge { bodies: [i, (i + 1) % n], line: ends, z: 0.5 });
        }
        for (hinges, class) in lines.iter().zip([Class::Planar, Class::Spherical]) {
            let topology = built(&drawn(hinges, 0.0, 3));
            let exact = build(mechanism(hinges)).unwrap();
            assert_eq!(classes(&topology), [class], "case {case}");
            assert_eq!(topology.mobility, exact.mobility, "case {case}");
        }
    }
}

#[test]
fn parallel_lines_are_not_taken_for_lines_through_a_far_point() {
    // Three parallel lines, one crossed by a fourth: within the tolerance the three also meet, at
    // a point a million times the size away.
    let skew = ray([3, 0], [10.0, -30.0], 0.4, 0.9);
    let mut hinges = parallel(&[0.0, 90.0, 40.0]);
    hinges[2].bodies = [2, 3];
    hinges.push(skew);
    let topology = built(&drawn(&hinges, 0.651, 6));
    assert_eq!(classes(&topology), [Class::Spatial]);
}
