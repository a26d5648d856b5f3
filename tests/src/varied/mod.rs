//! Random mechanisms of every kind that the schema can say: trees, loops of every class and sheets, from
//! micrometres to kilometres, with masses over ten decades, drawn exactly or rounded, turned in their plane,
//! with every key of the model file.

mod bodies;
mod contacts;
mod elements;
mod joints;
mod scale;
mod sheet;

#[cfg(test)]
mod tests;

use std::fmt::Write;

use crate::random::{FIXED, Hinge, Lines, Random, Recipe, hinges};
use scale::Scale;

/// One in so many mechanisms has no ground: a free body takes its place.
const FREE: u64 = 8;

/// A triangle of a sheet.
type Facet = [[f64; 2]; 3];

/// The bodies and hinges of a mechanism of some 0.2 m, not turned.
struct Drawing {
    /// Those whose index is below are fixed.
    fixed: usize,
    bodies: usize,
    hinges: Vec<Hinge>,
    /// The outline of each body, if it is given.
    facets: Vec<Facet>,
}

/// The text of a random mechanism; the same for the same seed.
pub fn mechanism(seed: u64) -> String {
    text(seed, seed % FREE == FREE - 1)
}

/// The same, but always with a ground.
pub fn grounded(seed: u64) -> String {
    text(seed, false)
}

fn text(seed: u64, is_free: bool) -> String {
    let mut random = Random::new(seed ^ 0x0a11);
    let drawing = drawing(&mut random);
    let scale = Scale::random(&mut random, drawing.closes());
    let mut writer = Writer { random, scale, drawing, is_free, text: String::new() };
    writer.model(seed);
    writer.text
}

impl Drawing {
    /// Whether there are loops.
    fn closes(&self) -> bool {
        self.hinges.len() > self.bodies - self.fixed
    }
}

fn drawing(random: &mut Random) -> Drawing {
    let branches = random.below(4);
    let recipe = match random.below(6) {
        0 => Recipe { branches: 1 + random.below(12), loops: 0, lines: Lines::Any },
        1 => Recipe { branches, loops: 1 + random.below(3), lines: Lines::Parallel },
        2 | 3 => Recipe { branches, loops: 1 + random.below(3), lines: Lines::Concurrent },
        4 => Recipe { branches, loops: 1 + random.below(2), lines: Lines::Any },
        _ => return sheet::triangulated(random),
    };
    let hinges = hinges(random, recipe);
    let bodies = 1 + hinges.iter().flat_map(|hinge| hinge.bodies).max().unwrap_or(FIXED);
    Drawing { fixed: FIXED, bodies, hinges, facets: Vec::new() }
}

/// Writes the text of a mechanism.
struct Writer {
    random: Random,
    scale: Scale,
    drawing: Drawing,
    is_free: bool,
    text: String,
}

impl Writer {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn model(&mut self, seed: u64) {
        self.line(&format!("name: varied{seed}"));
        let angle = if self.scale.degrees { "deg" } else { "rad" };
        self.line(&format!("units: {{ length: {}, angle: {angle} }}", self.scale.unit));
        if let Some(tolerance) = self.scale.tolerance().filter(|_| self.random.chance(0.3)) {
            self.line(&format!("tolerance: {tolerance:e}"));
        }
        let [x, y, z] = [0.0; 3].map(|_: f64| self.random.range(-12.0, 12.0));
        self.line(&format!("gravity: [{x}, \"{y} + swing*t\", {z}]"));
        self.materials();
        let k = self.scale.torque(self.random.range(0.5, 2.0));
        self.line(&format!(
            "parameters: {{ k: {k:e}, swing: {{ value: 0.3, range: [0.1, 0.5] }} }}"
        ));
        self.line("inputs: [motor]");
        if self.random.chance(0.3) {
            let all = ["stiffness", "damping", "rest", "mass"];
            let chosen: Vec<&str> = all.into_iter().filter(|_| self.random.chance(0.5)).collect();
            self.line(&format!("tunable: [{}]", chosen.join(", ")));
        }
        self.line("bodies:");
        for body in 0..self.drawing.bodies {
            if self.known(body) == body {
                self.body(body);
            }
        }
        if self.random.chance(0.3) {
            self.line("hinge_models:");
            self.family();
        }
        self.line("joints:");
        for joint in 0..self.drawing.hinges.len() {
            self.joint(joint);
        }
        self.points_and_forces();
        self.elements(seed);
        if self.random.chance(0.3) {
            self.line("air: { density: \"1.2 + 0.1*sin(t)\", drag: 1.1 }");
        }
        self.contacts(seed);
        self.initial(seed);
    }

    /// A thin stack, so that the mass is that of a sheet at any size.
    fn materials(&mut self) {
        self.line("materials:");
        for (name, density, least, most) in
            [("card", 700.0, 3e-4, 5e-4), ("film", 1380.0, 5e-5, 2e-4)]
        {
            let metres = self.random.range(least, most);
            let thickness = self.scale.exact(metres);
            let mut entry = format!("density: {density}, thickness: {thickness:e}");
            if name == "film" {
                entry.push_str(", youngs_modulus: 4 GPa, yield_stress: 60 MPa");
            }
            self.line(&format!("  {name}: {{ {entry} }}"));
        }
        self.line("layup: [card, film, card]");
    }

    fn points_and_forces(&mut self) {
        self.line("points:");
        let moving = self.drawing.bodies - self.drawing.fixed;
        for point in 0..2 {
            let body = self.drawing.fixed + self.random.below(moving);
            let at = self.at();
            self.line(&format!("  p{point}: {{ body: b{body}, at: {at} }}"));
        }
        let [x, y] = self.scale.drawn([0.01, -0.02]);
        self.line(&format!("  p2: {{ body: b0, at: [{x}, {y}, {:e}] }}", self.scale.exact(0.03)));
        let joint = self.random.below(self.drawing.hinges.len());
        let pull = self.scale.force(self.random.range(-1.0, 1.0));
        let push = self.scale.force(0.1);
        self.line("forces:");
        self.line(&format!(
            "  pull: {{ point: p0, force: [{pull:e}, 0, \"{pull:e}*t + motor\"] }}"
        ));
        self.line(&format!(
            "  push: {{ point: p1, force: [\"{push:e}*sin(q.j{joint})\", \"-{push:e}*u.j{joint}\", 0] }}"
        ));
    }

    /// Initial values of a joint that moves by itself, and of the free body.
    fn initial(&mut self, seed: u64) {
        let joint = (0..self.drawing.hinges.len()).find(|joint| !self.is_driven(*joint));
        let mut entries = Vec::new();
        if let Some(joint) = joint.filter(|_| self.random.chance(0.5)) {
            let [q, u] = [0.1, 0.5].map(|value| self.scale.angle(value));
            let fold = if self.random.chance(0.3) { ", fold: 20 %" } else { "" };
            entries.push(format!("q: {{ j{joint}: {q} }}, u: {{ j{joint}: {u} }}{fold}"));
        }
        if self.is_free {
            entries.push(self.adrift(&mut Random::new(seed ^ 0xf4ee)));
        }
        if !entries.is_empty() {
            self.line(&format!("initial: {{ {} }}", entries.join(", ")));
        }
    }

    /// The body that takes the place of a fixed one.
    fn known(&self, body: usize) -> usize {
        if self.is_free && body < self.drawing.fixed { 0 } else { body }
    }

    /// Where the free body is, and how it moves.
    fn adrift(&self, random: &mut Random) -> String {
        let mut row = |scale: &dyn Fn(f64) -> f64, most: f64| {
            let [x, y, z] = [0.0; 3].map(|_: f64| scale(random.range(-most, most)));
            format!("[{x:e}, {y:e}, {z:e}]")
        };
        let (length, angle) = (|x| self.scale.exact(x), |x| self.scale.angle(x));
        let (position, velocity) = (row(&length, 0.1), row(&length, 0.1));
        let (turn, rate) = (row(&angle, 1.5), row(&angle, 0.5));
        let way = match random.chance(0.5) {
            true => format!("turn: {turn}"),
            false => "orientation: [0.5, 0.1, -0.7, 0.5]".to_owned(),
        };
        format!(
            "bodies: {{ b0: {{ position: {position}, {way}, velocity: {velocity}, angular_velocity: {rate} }} }}"
        )
    }

    /// A point near the drawing.
    fn at(&mut self) -> String {
        let [x, y, z] = [0.1, 0.1, 0.01].map(|most| self.random.range(-most, most));
        let [x, y] = self.scale.drawn([x, y]);
        format!("[{x}, {y}, {:e}]", self.scale.exact(z))
    }

    /// Vertices on a circle in order, at random distances from its centre.
    fn ring(&mut self, centre: [f64; 2], count: usize, [least, most]: [f64; 2]) -> String {
        let mut text = String::new();
        for vertex in 0..count {
            let angle = std::f64::consts::TAU * vertex as f64 / count as f64;
            let radius = self.random.range(least, most);
            let at = [centre[0] + radius * angle.cos(), centre[1] + radius * angle.sin()];
            let [x, y] = self.scale.drawn(at);
            let comma = if vertex > 0 { ", " } else { "" };
            write!(text, "{comma}[{x}, {y}]").unwrap_or_default();
        }
        format!("[{text}]")
    }
}
