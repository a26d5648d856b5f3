//! Random mechanisms in our schema: trees, and loops of every class.
//!
//! A loop is a chain of new plates between two bodies that exist already, so loops share bodies,
//! reach the ground several times and pass through one body together. What class it has follows
//! from its hinge lines: all parallel, all through one point, or any.

use std::f64::consts::TAU;
use std::fmt::Write;

use lamc::program::Interpreter;
use lamc::topology::LoopClass;
use lamc_runtime::plumbing::Dimensions;
use lamc_runtime::{Mechanism, State, assemble, project};

pub use crate::uniform::Random;

/// The parts of a random mechanism.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// The number of plates with one hinge each.
    pub branches: usize,
    /// The number of closed loops.
    pub loops: usize,
    /// Class of their hinge lines.
    pub lines: Lines,
}

/// Class of the hinge lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lines {
    /// They have nothing in common.
    Any,
    /// They have the same direction.
    Parallel,
    /// They meet in one point.
    Concurrent,
}

impl Lines {
    /// The class lamc must find for a loop of such hinges.
    pub fn is(self, class: &LoopClass) -> bool {
        match self {
            Self::Any => matches!(class, LoopClass::Spatial),
            Self::Parallel => matches!(class, LoopClass::Planar { .. }),
            Self::Concurrent => matches!(class, LoopClass::Spherical { .. }),
        }
    }

    /// The number of independent closure equations of one loop.
    pub fn rank(self) -> usize {
        if self == Self::Any { 6 } else { 3 }
    }
}

/// The text of a random mechanism; the same for the same seed.
pub fn model(seed: u64, recipe: Recipe) -> String {
    let mut random = Random::new(seed);
    let hinges = hinges(&mut random, recipe);
    let bodies = 1 + hinges.iter().map(|hinge| hinge.bodies[0].max(hinge.bodies[1])).max().unwrap();
    let mut writer = Writer { millimetres: random.chance(0.5), random, text: String::new() };
    writer.model(seed, bodies, &hinges);
    writer.text
}

/// A random mechanism for a comparison: a tree or loops of any class, driven or not, from micrometres to
/// hundreds of metres, turned in its plane.
pub fn mechanism(seed: u64) -> String {
    let mut random = Random::new(seed ^ 0x5eed);
    let recipe = match random.below(5) {
        0 | 1 => Recipe { branches: 1 + random.below(12), loops: 0, lines: Lines::Any },
        2 => {
            Recipe { branches: random.below(4), loops: 1 + random.below(3), lines: Lines::Parallel }
        }
        3 => Recipe {
            branches: random.below(4),
            loops: 1 + random.below(3),
            lines: Lines::Concurrent,
        },
        _ => Recipe { branches: random.below(3), loops: 1 + random.below(2), lines: Lines::Any },
    };
    let mut text = model(seed, recipe);
    // A loop may have no freedom left for a driven joint.
    if recipe.loops == 0 && random.chance(0.3) {
        text = driven(&text);
    }
    if random.chance(0.3) {
        text = text.replacen("gravity:", "air: { density: 1.2, drag: 1.1 }\ngravity:", 1);
    }
    if random.chance(0.3) {
        let law = "friction: { torque: 1e-4, speed: 0.1 }, cubic_stiffness: 0.01, torque:";
        text = text.replacen("torque:", law, 1);
    }
    match random.below(6) {
        // A thousandth, and a thousand times the size.
        0 => text.replace("length: mm", "length: um"),
        1 => text.replace("length: mm", "length: m"),
        _ => text,
    }
}

/// A hinge between two bodies; bodies 0 and 1 are fixed.
pub(crate) struct Hinge {
    pub(crate) bodies: [usize; 2],
    pub(crate) axis: [[f64; 2]; 2],
    pub(crate) z: f64,
}

/// Bodies 0 .. FIXED are the ground.
pub(crate) const FIXED: usize = 2;

pub(crate) fn hinges(random: &mut Random, recipe: Recipe) -> Vec<Hinge> {
    let centre = [random.range(-0.05, 0.05), random.range(-0.05, 0.05)];
    let height = random.range(0.0, 0.003);
    let common = random.range(0.0, TAU);
    let line = |random: &mut Random, lines: Lines| {
        let angle = if lines == Lines::Parallel { common } else { random.range(0.0, TAU) };
        let length = random.range(0.02, 0.06);
        let (from, z) = match lines {
            Lines::Concurrent => (centre, height),
            _ => ([random.range(-0.1, 0.1), random.range(-0.1, 0.1)], random.range(-0.03, 0.03)),
        };
        let to = [from[0] + length * angle.cos(), from[1] + length * angle.sin()];
        ([from, to], z)
    };
    let mut hinges = Vec::new();
    let mut bodies = FIXED;
    let mut connect = |random: &mut Random, from: usize, to: usize, lines: Lines| {
        let (axis, z) = line(random, lines);
        // The order of the two bodies determines the sign of q, not the direction of the tree.
        let bodies = if random.chance(0.5) { [from, to] } else { [to, from] };
        hinges.push(Hinge { bodies, axis, z });
    };
    for _ in 0..recipe.loops {
        let from = random.below(bodies);
        let to = random.below(bodies);
        // One hinge more than equations leaves every loop a freedom of its own. Four lines through
        // a point are often locked nevertheless: the widest angle equals the others' sum.
        let spare = usize::from(recipe.lines == Lines::Concurrent);
        let links = recipe.lines.rank() + spare + random.below(2);
        let mut last = from;
        for _ in 0..links {
            connect(random, last, bodies, recipe.lines);
            last = bodies;
            bodies += 1;
        }
        connect(random, last, to, recipe.lines);
    }
    for _ in 0..recipe.branches {
        // Mostly one of the last few bodies, which makes long chains with side branches.
        let nearby = bodies.min(if random.chance(0.7) { 2 } else { bodies });
        let from = bodies - 1 - random.below(nearby);
        connect(random, from, bodies, Lines::Any);
        bodies += 1;
    }
    // The order in the file is the order of the coordinates, and decides which hinge closes a loop.
    for i in (1..hinges.len()).rev() {
        hinges.swap(i, random.below(i + 1));
    }
    hinges
}

struct Writer {
    random: Random,
    millimetres: bool,
    text: String,
}

impl Writer {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// A length in the model's unit.
    fn length(&self, metres: f64) -> f64 {
        if self.millimetres { metres * 1e3 } else { metres }
    }

    fn at(&mut self) -> String {
        let xyz = [0.1, 0.1, 0.01].map(|most| self.random.range(-most, most));
        let [x, y, z] = xyz.map(|x| self.length(x));
        format!("[{x}, {y}, {z}]")
    }

    fn model(&mut self, seed: u64, bodies: usize, hinges: &[Hinge]) {
        self.line(&format!("name: random{seed}"));
        if self.millimetres {
            self.line("units: { length: mm, angle: deg }");
        }
        let [x, y, z] = [0.0; 3].map(|_: f64| self.random.range(-12.0, 12.0));
        self.line(&format!("gravity: [{x}, {y}, \"{z} + 0*swing\"]"));
        self.line("materials:");
        for (name, density, least, most) in
            [("card", 700.0, 3e-4, 5e-4), ("film", 1380.0, 5e-5, 2e-4)]
        {
            let thickness = self.random.range(least, most);
            let thickness = self.length(thickness);
            self.line(&format!("  {name}: {{ density: {density}, thickness: {thickness} }}"));
        }
        self.line("layup: [card, film, card]");
        self.line("parameters: { k: 0.0114, swing: 0.003 }");
        self.line("inputs: [motor]");
        if self.random.chance(0.3) {
            self.line("tunable: [stiffness, rest, mass]");
        }
        self.line("bodies:");
        for body in 0..bodies {
            self.body(body);
        }
        self.line("joints:");
        for (index, hinge) in hinges.iter().enumerate() {
            self.joint(index, hinge, hinges.len());
        }
        self.line("points:");
        for point in 0..2 {
            let body = FIXED + self.random.below(bodies - FIXED);
            let at = self.at();
            self.line(&format!("  p{point}: {{ body: b{body}, at: {at} }}"));
        }
        self.line("forces:");
        let joint = self.random.below(hinges.len());
        let pull = self.random.range(-0.02, 0.02);
        self.line(&format!("  pull: {{ point: p0, force: [{pull}, 0, \"motor*t\"] }}"));
        let push = format!("[\"swing*sin(q.j{joint})\", \"-1e-3*u.j{joint}\", 0]");
        self.line(&format!("  push: {{ point: p1, force: {push} }}"));
    }

    fn body(&mut self, body: usize) {
        if body == 0 {
            return self.line("  b0: { fixed: true }");
        }
        let fixed = if body < FIXED { "fixed: true, " } else { "" };
        let shape = match self.random.below(4) {
            0 => self.plates(),
            1 => self.rigid(),
            _ => {
                let (outline, hole) = self.plate();
                let weight = self.random.range(1e-4, 1e-3);
                let at = self.at();
                format!(
                    "outline: {outline}, holes: [{hole}], \
                     point_masses: [{{ mass: {weight}, at: {at} }}]"
                )
            }
        };
        self.line(&format!("  b{body}: {{ {fixed}{shape} }}"));
    }

    /// A star-shaped polygon and a triangle inside it.
    fn plate(&mut self) -> (String, String) {
        let count = 3 + self.random.below(6);
        let centre = [0.0; 2].map(|_: f64| self.random.range(-0.08, 0.08));
        let mut ring = |count: usize, least: f64, most: f64| {
            let corners = (0..count).map(|i| {
                let angle = TAU * i as f64 / count as f64;
                let radius = self.random.range(least, most);
                let x = self.length(centre[0] + radius * angle.cos());
                let y = self.length(centre[1] + radius * angle.sin());
                format!("[{x}, {y}]")
            });
            format!("[{}]", corners.collect::<Vec<_>>().join(", "))
        };
        (ring(count, 0.02, 0.05), ring(3, 0.003, 0.008))
    }

    fn plates(&mut self) -> String {
        let layers = [0, 1, 2].map(|layer| {
            let (outline, hole) = self.plate();
            match layer {
                0 => format!("[{{ outline: {outline} }}]"),
                1 if self.random.chance(0.5) => "[]".to_owned(),
                _ => format!("[{{ outline: {outline}, holes: [{hole}] }}]"),
            }
        });
        format!("layers: [{}]", layers.join(", "))
    }

    /// Principal moments of a box, turned about a random direction by a random angle.
    fn rigid(&mut self) -> String {
        let mass = self.random.range(5e-4, 3e-3);
        let [a, b, c] = [0.0; 3].map(|_: f64| self.random.range(0.01, 0.05).powi(2) * mass / 12.0);
        let axis = nalgebra::Vector3::from_fn(|_, _| self.random.range(-2.0, 2.0));
        let turn = nalgebra::Rotation3::new(axis).into_inner();
        let principal = nalgebra::Matrix3::from_diagonal(&[b + c, c + a, a + b].into());
        let inertia = turn * principal * turn.transpose();
        let inertia = (inertia + inertia.transpose()) * 0.5;
        let rows = [0, 1, 2].map(|i| {
            let [x, y, z] = [0, 1, 2].map(|j| inertia[(i, j)]);
            format!("[{x:e}, {y:e}, {z:e}]")
        });
        let com = self.at();
        format!("mass: {mass}, com: {com}, inertia: [{}]", rows.join(", "))
    }

    fn joint(&mut self, index: usize, hinge: &Hinge, joints: usize) {
        let [a, b] = hinge.axis.map(|[x, y]| [self.length(x), self.length(y)]);
        let z = self.length(hinge.z);
        let mut entry = String::new();
        let [first, second] = hinge.bodies;
        write!(entry, "bodies: [b{first}, b{second}], axis: [{a:?}, {b:?}], z: {z}").unwrap();
        match self.random.below(3) {
            0 => {}
            1 => entry.push_str(", stiffness: k"),
            _ => write!(entry, ", stiffness: {}", self.random.range(1e-3, 0.02)).unwrap(),
        }
        match self.random.below(3) {
            0 => {}
            1 => entry.push_str(", damping: \"1e-5*(1 + t)\""),
            _ => write!(entry, ", damping: {}", self.random.range(1e-6, 2e-5)).unwrap(),
        }
        if self.random.chance(0.5) {
            let rest = self.random.range(-0.5, 0.5);
            let rest = if self.millimetres { rest.to_degrees() } else { rest };
            write!(entry, ", rest: {rest}").unwrap();
        }
        let other = self.random.below(joints);
        let torque = match self.random.below(8) {
            0 => "motor - 0.002*sin(2*pi*t)".to_owned(),
            1 => format!("k*q.j{other}/10 - 1e-6*u.j{other}*abs(u.j{index})"),
            2 => format!("0.001*tanh(10*u.j{other})"),
            3 => format!("max(0.0005*cos(q.j{other}), 1e-4*exp(-t))"),
            4 => format!("1e-3*sqrt(q.j{other}^2 + 0.01) - min(motor, 1e-3)"),
            _ => "0".to_owned(),
        };
        self.line(&format!("  j{index}: {{ {entry}, torque: \"{torque}\" }}"));
    }
}

/// The model with its first joint driven by time, a parameter and an input.
///
/// # Panics
/// If the model has no joint `j0` with a torque.
pub fn driven(text: &str) -> String {
    let (mut lines, mut done) = (Vec::new(), false);
    for line in text.lines() {
        match line.find(", torque: ").filter(|_| line.starts_with("  j0: {") && !done) {
            Some(at) => {
                let law = "k*20 + motor*30 + 0.2*sin(3*t) + 0.1*t^3";
                lines.push(format!("{}, drive: \"{law}\" }}", &line[..at]));
                done = true;
            }
            None => lines.push(line.to_owned()),
        }
    }
    assert!(done, "no joint j0");
    lines.join("\n") + "\n"
}

/// A random closed configuration with speeds that the loops allow.
///
/// # Panics
/// If none of thirty guesses leads to one.
pub fn closed_state(system: &Interpreter, random: &mut Random) -> State<Vec<f64>, f64> {
    let n = system.dimensions().coordinates;
    closed_state_from(system, random, |random| (0..n).map(|_| random.range(-1.2, 1.2)).collect())
}

/// A closed configuration where all angles are about some share of the given ones, with speeds that the loops
/// allow.
///
/// # Panics
/// If none of thirty guesses leads to one.
pub fn closed_state_about(
    system: &Interpreter,
    folded: &[f64],
    random: &mut Random,
) -> State<Vec<f64>, f64> {
    closed_state_from(system, random, |random| {
        let share = random.range(0.3, 1.5);
        folded.iter().map(|angle| share * angle + random.range(-0.05, 0.05)).collect()
    })
}

fn closed_state_from(
    system: &Interpreter,
    random: &mut Random,
    guess: impl Fn(&mut Random) -> Vec<f64>,
) -> State<Vec<f64>, f64> {
    let Dimensions { joints, speeds, .. } = system.dimensions();
    let mut workspace = system.workspace();
    for _ in 0..30 {
        let t = random.range(0.0, 1.0);
        let mut q = guess(random);
        let mut u: Vec<f64> = (0..speeds).map(|_| random.range(-3.0, 3.0)).collect();
        if assemble(system, t, &mut q, &vec![false; joints], &mut workspace).is_ok()
            && project(system, t, &mut q, &mut u, &mut workspace).is_ok()
        {
            return State { t, q, u };
        }
    }
    panic!("no closed configuration found");
}
