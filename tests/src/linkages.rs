//! Linkages whose rank and mobility are known from the literature, as texts in our schema.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write;

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::random::Random;

/// A hinge between two bodies (0 is the ground) along a line at a height, m.
#[derive(Clone, Copy, Debug)]
pub struct Hinge {
    /// First and second body.
    pub bodies: [usize; 2],
    /// Two points of its line.
    pub axis: [[f64; 2]; 2],
    /// Its height.
    pub z: f64,
}

/// A linkage with its known rank and mobility.
#[derive(Clone, Debug)]
pub struct Linkage {
    /// An identifier.
    pub name: &'static str,
    /// In the order of the coordinates.
    pub hinges: Vec<Hinge>,
    /// The corners of the bodies' plates, if they are given.
    pub outlines: Vec<Vec<[f64; 2]>>,
    /// A folded configuration to start from, rad; zeros if any configuration will do.
    pub folded: Vec<f64>,
    /// Generic rank of all closure equations.
    pub rank: usize,
    /// Generic mobility.
    pub mobility: usize,
}

impl Linkage {
    fn new(name: &'static str, hinges: Vec<Hinge>, rank: usize) -> Self {
        let n = hinges.len();
        let mobility = n - rank;
        Self { name, hinges, outlines: Vec::new(), folded: vec![0.0; n], rank, mobility }
    }

    fn ring(name: &'static str, lines: &[([f64; 2], f64, f64)], rank: usize) -> Self {
        let n = lines.len();
        let hinges = lines.iter().enumerate().map(|(i, line)| ray([i, (i + 1) % n], *line));
        Self::new(name, hinges.collect(), rank)
    }

    /// The linkage with random masses, springs, dampers and skew gravity; the same for the same
    /// seed. Springs and dampers are weak, so that gamma weighs as much as the rest.
    pub fn text(&self, seed: u64) -> String {
        let mut random = Random::new(seed);
        let mut text = format!("name: {}\n", self.name);
        let [x, y] = [0, 1].map(|_| random.range(3.0, 6.0));
        text.push_str(&format!("gravity: [{x}, -{y}, -6.7]\n"));
        text.push_str("materials: { card: { density: 700, thickness: 4e-4 } }\nlayup: [card]\n");
        text.push_str("bodies:\n  b0: { fixed: true }\n");
        let bodies = 1 + self.hinges.iter().flat_map(|hinge| hinge.bodies).max().unwrap_or(0);
        for body in 1..bodies {
            let near: Vec<&Hinge> =
                self.hinges.iter().filter(|hinge| hinge.bodies.contains(&body)).collect();
            let shape = match self.outlines.get(body) {
                Some(outline) => format!("outline: {outline:?}"),
                None if body % 2 == 0 => plate(&mut random, &near),
                None => rigid(&mut random, &near),
            };
            writeln!(text, "  b{body}: {{ {shape} }}").unwrap();
        }
        text.push_str("joints:\n");
        for (index, Hinge { bodies: [first, second], axis, z }) in self.hinges.iter().enumerate() {
            let stiffness = random.range(1e-5, 1e-4);
            let damping = random.range(1e-7, 1e-6);
            let rest = random.range(-0.6, 0.6);
            writeln!(
                text,
                "  j{index}: {{ bodies: [b{first}, b{second}], axis: {axis:?}, z: {z}, \
                 stiffness: {stiffness}, damping: {damping}, rest: {rest} }}"
            )
            .unwrap();
        }
        text
    }
}

/// The middle of a body's hinges.
fn middle(hinges: &[&Hinge]) -> Vector3<f64> {
    let middles = hinges.iter().map(|Hinge { axis: [a, b], z, .. }| {
        Vector3::new((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0, *z)
    });
    middles.sum::<Vector3<f64>>() / hinges.len() as f64
}

/// A star-shaped plate about the middle of a body's hinges.
fn plate(random: &mut Random, hinges: &[&Hinge]) -> String {
    let middle = middle(hinges);
    let corners = (0..5).map(|i| {
        let (angle, radius) = (TAU * f64::from(i) / 5.0, random.range(0.02, 0.05));
        format!("[{}, {}]", middle.x + radius * angle.cos(), middle.y + radius * angle.sin())
    });
    format!("outline: [{}]", corners.collect::<Vec<_>>().join(", "))
}

/// A turned box near a body's hinges.
fn rigid(random: &mut Random, hinges: &[&Hinge]) -> String {
    let mass = random.range(5e-4, 3e-3);
    let com = middle(hinges) + Vector3::from_fn(|_, _| random.range(-0.02, 0.02));
    let [a, b, c] = [0; 3].map(|_| random.range(0.02, 0.06).powi(2) * mass / 12.0);
    let turn = Rotation3::new(Vector3::from_fn(|_, _| random.range(-2.0, 2.0))).into_inner();
    let inertia = turn * Matrix3::from_diagonal(&[b + c, c + a, a + b].into()) * turn.transpose();
    let inertia = (inertia + inertia.transpose()) * 0.5;
    let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| inertia[(i, j)]));
    format!("mass: {mass}, com: {:?}, inertia: {rows:?}", [com.x, com.y, com.z])
}

/// A hinge from a point under an angle, at a height.
fn ray(bodies: [usize; 2], (from, angle, z): ([f64; 2], f64, f64)) -> Hinge {
    let to = [from[0] + 0.05 * angle.cos(), from[1] + 0.05 * angle.sin()];
    Hinge { bodies, axis: [from, to], z }
}

/// A ring whose lines meet in one point, under these angles in degrees.
pub fn spherical(name: &'static str, degrees: &[f64]) -> Linkage {
    let lines: Vec<_> =
        degrees.iter().map(|angle| ([0.02, -0.01], angle.to_radians(), 0.0005)).collect();
    Linkage::ring(name, &lines, 3)
}

/// Plates folded back over each other, of lengths 1, 3, 3.5 and 2.
pub fn planar_four_bar() -> Linkage {
    let line = |x: f64| ([0.03 * x, 0.0], FRAC_PI_2, 0.0);
    Linkage::ring("planar_four_bar", &[0.0, 1.0, 4.0, 0.5].map(line), 3)
}

/// Seven skew lines.
pub fn spatial_seven_bar() -> Linkage {
    let line = |i: usize| {
        let t = i as f64;
        let at = [0.1 * (2.3 * t).sin(), 0.075 * (1.7 * t + 1.0).cos()];
        (at, 1.9 * t + 0.3 * (t * t), 0.01 * (t * 1.3).sin())
    };
    Linkage::ring("spatial_seven_bar", &(0..7).map(line).collect::<Vec<_>>(), 6)
}

/// Lines across one vertical line: lengths a, b and twists alpha, beta with sin(alpha) / a =
/// sin(beta) / b (Bennett, "A new mechanism", 1903).
pub fn bennett() -> Linkage {
    let (a, alpha, beta) = (0.05, 0.5_f64, 1.1_f64);
    let b = a * beta.sin() / alpha.sin();
    let lines = [(0.0, 0.0), (a, alpha), (a - b, alpha - beta), (-b, -beta)];
    Linkage::ring("bennett", &lines.map(|(z, angle)| ([0.0, 0.0], angle, z)), 3)
}

/// Two triples of parallel hinges at right angles. One leg folds the top onto the base; the other
/// has a longer upper half, so that its angles are no fixed multiples of each other.
pub fn sarrus() -> Linkage {
    let mut hinges = Vec::new();
    for (leg, (angle, top)) in [(0.0, 0.03), (FRAC_PI_2, 0.02)].into_iter().enumerate() {
        let (low, high) = (1 + 2 * leg, 2 + 2 * leg);
        for (bodies, at) in [([0, low], 0.03), ([low, high], 0.08), ([high, 5], top)] {
            let from = [-f64::sin(angle) * at, f64::cos(angle) * at];
            hinges.push(ray(bodies, (from, angle, 0.0)));
        }
    }
    // In the other branches a leg turns about itself, and there are two degrees of freedom.
    let folded = [0.5, -1.0, 0.5, 0.6, -1.1, 0.5].to_vec();
    Linkage { folded, ..Linkage::new("sarrus", hinges, 5) }
}

/// Watt's six-bar, folded flat: two four-bars that share two bodies and the hinge between them.
pub fn watt() -> Linkage {
    let hinge = |(bodies, x): ([usize; 2], f64)| ray(bodies, ([0.03 * x, 0.0], FRAC_PI_2, 0.0));
    let hinges = [
        ([0, 1], 0.0),
        ([1, 2], 1.0),
        ([2, 3], 4.0),
        ([3, 0], 0.5),
        ([2, 4], 3.0),
        ([4, 5], 4.2),
        ([5, 3], 1.3),
    ];
    Linkage::new("watt", hinges.map(hinge).to_vec(), 6)
}

/// A Miura-ori sheet of n x n facets: parallelograms in columns that zigzag.
pub fn miura(n: usize) -> Linkage {
    const SIDE: f64 = 0.03;
    const LEAN: f64 = 0.6;
    let vertex = |row: usize, column: usize| {
        let lean = if row.is_multiple_of(2) { 0.0 } else { LEAN };
        [SIDE * (column as f64 + lean), SIDE * row as f64]
    };
    let facet = |row: usize, column: usize| row * n + column;
    // Zigzags fold all one way and in turn; along a straight crease every other vertex turns the
    // fold: tan(straight / 2) = cos(corner) tan(zigzag / 2).
    let zigzag = 1.2_f64;
    let straight = 2.0 * ((zigzag / 2.0).tan() * LEAN / LEAN.hypot(1.0)).atan();
    let sign = |odd: bool| if odd { -1.0 } else { 1.0 };
    let (mut hinges, mut outlines, mut folded) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..n {
        for column in 0..n {
            let ends = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)];
            outlines.push(ends.map(|(row, column)| vertex(row, column)).to_vec());
            if column + 1 < n {
                let bodies = [facet(row, column), facet(row, column + 1)];
                let axis = [vertex(row, column + 1), vertex(row + 1, column + 1)];
                hinges.push(Hinge { bodies, axis, z: 0.0 });
                folded.push(zigzag * sign(column % 2 == 1));
            }
            if row + 1 < n {
                let bodies = [facet(row, column), facet(row + 1, column)];
                let axis = [vertex(row + 1, column), vertex(row + 1, column + 1)];
                hinges.push(Hinge { bodies, axis, z: 0.0 });
                folded.push(straight * sign((row + column) % 2 == 1));
            }
        }
    }
    let rank = hinges.len() - 1;
    Linkage { outlines, folded, ..Linkage::new("miura", hinges, rank) }
}
