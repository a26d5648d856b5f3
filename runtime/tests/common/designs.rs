//! Mechanisms to test with: plates of card, a few centimetres large.

use std::f64::consts::PI;
use std::marker::PhantomData;

use nalgebra::Matrix3;

use super::{Body, Loop, Tree, V3};

/// A plate of 0.1 g per hinge, hinged at a line, its centre of mass at `com`.
pub fn plate(parent: Option<usize>, at: V3, axis: V3, mass: f64, com: V3) -> Body {
    let radius = 0.01_f64;
    let inertia = Matrix3::from_diagonal(&V3::new(1.0, 1.2, 2.1)) * (mass * radius * radius / 3.0);
    Body {
        parent,
        at,
        axis,
        mass,
        com,
        inertia,
        stiffness: 0.0,
        damping: 0.0,
        guess: None,
        limits: [f64::NEG_INFINITY, f64::INFINITY],
    }
}

pub fn tree<S>(bodies: Vec<Body>, loops: Vec<Loop>, rows: &[usize], size: f64) -> Tree<S> {
    Tree {
        bodies,
        loops,
        rows: rows.to_vec(),
        gravity: V3::new(0.0, 0.0, -9.81),
        size,
        scalar: PhantomData,
    }
}

/// Every row.
pub const ALL: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
/// P1: x y z, P2: y z, P3: z, as for general loops.
pub const SIX: [usize; 6] = [0, 1, 2, 4, 5, 8];

fn flat(angle: f64) -> V3 {
    V3::new(angle.cos(), angle.sin(), 0.0)
}

/// A chain of plates around a centre, hinged along rays of it at `angles` (rad, ascending) from a
/// ground plate and back to the ground: a spherical linkage, drawn flat where the angles span the
/// full turn.
pub fn spherical<S>(angles: &[f64], rows: &[usize]) -> Tree<S> {
    let n = angles.len();
    let radius = 0.03;
    let mut bodies = Vec::new();
    for (j, &angle) in angles.iter().enumerate() {
        // The last plate is the ground again: the ghost, with a mass as copies have.
        let next = if j + 1 < n { angles[j + 1] } else { angles[0] + 2.0 * PI };
        let com = flat((angle + next) / 2.0) * radius * 0.6;
        let parent = j.checked_sub(1);
        bodies.push(plate(parent, V3::zeros(), flat(angle), 6e-4, com));
    }
    let middle = (angles[n - 1] + angles[0] + 2.0 * PI) / 2.0;
    let points = [-0.3_f64, 0.0, 0.3].map(|turn| flat(middle + turn) * radius * (1.0 + turn));
    let loops = vec![Loop { original: None, ghost: n - 1, points }];
    tree(bodies, loops, rows, 2.0 * radius * 2.0_f64.sqrt())
}

/// Six equal sectors.
pub fn sixbar<S>(rows: &[usize]) -> Tree<S> {
    spherical(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(|k| k * PI / 3.0), rows)
}

/// Four unequal sectors that fold: opposite ones sum to half a turn.
pub fn four_vertex<S>(rows: &[usize]) -> Tree<S> {
    spherical(&[0.0, 1.2, 1.2 + 1.7, 1.2 + 1.7 + (PI - 1.2)], rows)
}

/// A planar four-bar drawn folded flat: hinges along y at x = `places` in order around the loop,
/// the ground link between the first and the last. The last body is the ground's ghost.
pub fn planar<S>(places: [f64; 4], rows: &[usize]) -> Tree<S> {
    let mut bodies = Vec::new();
    for j in 0..4 {
        let com = V3::new((places[j] + places[(j + 1) % 4]) / 2.0, 0.005, 0.0);
        bodies.push(plate(j.checked_sub(1), V3::new(places[j], 0.0, 0.0), V3::y(), 6e-4, com));
    }
    let points = [V3::new(0.01, 0.0, 0.0), V3::new(0.03, 0.02, 0.0), V3::new(0.02, -0.01, 0.0)];
    let loops = vec![Loop { original: None, ghost: 3, points }];
    tree(bodies, loops, rows, 0.06)
}

/// Hinge places of a four-bar with four different links.
pub const PLACES: [f64; 4] = [0.0, 0.02, 0.055, 0.03];

/// Two spherical four-vertices that share a plate: the second hangs on the first's plate 1.
pub fn two_loops<S>(rows: &[usize]) -> Tree<S> {
    let mut first = four_vertex::<S>(rows);
    let second = spherical::<S>(&[0.0, 1.9, 3.3, 3.3 + (PI - 1.9)], rows);
    let shift = V3::new(0.0, 0.06, 0.0);
    let count = first.bodies.len();
    for (j, mut body) in second.bodies.into_iter().enumerate() {
        body.parent = Some(if j == 0 { 1 } else { count + j - 1 });
        body.at += shift;
        body.com += shift;
        first.bodies.push(body);
    }
    for mut each in second.loops {
        each.original = Some(1);
        each.ghost += count;
        each.points = each.points.map(|point| point + shift);
        first.loops.push(each);
    }
    first.size = 0.15;
    first
}

/// An open chain of `n` plates with hinges in different directions.
pub fn chain<S>(n: usize) -> Tree<S> {
    let mut bodies = Vec::new();
    for j in 0..n {
        let at = V3::new(0.02 * j as f64, 0.003 * (j % 3) as f64, 0.0);
        let com = at + V3::new(0.012, 0.002, 0.001);
        bodies.push(plate(j.checked_sub(1), at, flat(1.3 - 0.4 * j as f64), 6e-4, com));
    }
    tree(bodies, vec![], &ALL, 0.02 * n as f64)
}
