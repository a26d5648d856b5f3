//! Mechanisms of any structure: which bodies hinges join, where, with what limits and guesses.

use std::fmt::Write;

use arbitrary::{Arbitrary, Result, Unstructured};

struct Hinge {
    bodies: [u8; 2],
    axis: [[i8; 2]; 2],
    z: i8,
    limits: Option<[i8; 2]>,
    guess: Option<i8>,
    rest: i8,
}

struct Body {
    is_fixed: bool,
    corners: Vec<[i8; 2]>,
    point_mass: Option<[i8; 3]>,
}

struct Mechanism {
    bodies: Vec<Body>,
    hinges: Vec<Hinge>,
    /// A power of ten by which coordinates are divided.
    scale: u8,
}

impl Arbitrary<'_> for Hinge {
    fn arbitrary(bytes: &mut Unstructured) -> Result<Self> {
        Ok(Self {
            bodies: bytes.arbitrary()?,
            axis: bytes.arbitrary()?,
            z: bytes.arbitrary()?,
            limits: bytes.arbitrary()?,
            guess: bytes.arbitrary()?,
            rest: bytes.arbitrary()?,
        })
    }
}

impl Arbitrary<'_> for Body {
    fn arbitrary(bytes: &mut Unstructured) -> Result<Self> {
        Ok(Self {
            is_fixed: bytes.arbitrary()?,
            corners: bytes.arbitrary()?,
            point_mass: bytes.arbitrary()?,
        })
    }
}

impl Arbitrary<'_> for Mechanism {
    fn arbitrary(bytes: &mut Unstructured) -> Result<Self> {
        Ok(Self {
            scale: bytes.arbitrary()?,
            bodies: bytes.arbitrary()?,
            hinges: bytes.arbitrary()?,
        })
    }
}

/// Any bytes as a mechanism.
pub fn structure(input: &[u8]) {
    if let Ok::<Mechanism, _>(mechanism) = Unstructured::new(input).arbitrary() {
        super::read(&text(&mechanism));
    }
}

fn text(mechanism: &Mechanism) -> String {
    let Mechanism { bodies, hinges, scale } = mechanism;
    let count = bodies.len().max(1) as u8;
    let e = scale % 12;
    let number = |value: i8| format!("{value}e-{e}");
    let point = |point: &[i8; 2]| format!("[{}, {}]", number(point[0]), number(point[1]));
    let mut text = String::from(
        "name: m\nmaterials: { card: { density: 700, thickness: 0.3 mm } }\nlayup: [card]\nbodies:\n",
    );
    for (index, body) in bodies.iter().take(40).enumerate() {
        let mut entries = Vec::new();
        if body.is_fixed || index == 0 {
            entries.push("fixed: true".to_owned());
        }
        if !body.corners.is_empty() {
            let corners: Vec<_> = body.corners.iter().map(point).collect();
            entries.push(format!("outline: [{}]", corners.join(", ")));
        }
        if let Some([x, y, z]) = body.point_mass {
            let at = format!("[{}, {}, {}]", number(x), number(y), number(z));
            entries.push(format!("point_masses: [{{ mass: 1e-3, at: {at} }}]"));
        }
        let _ = writeln!(text, "  b{index}: {{ {} }}", entries.join(", "));
    }
    text.push_str("joints:\n");
    for (index, hinge) in hinges.iter().take(60).enumerate() {
        let [first, second] = hinge.bodies.map(|body| body % count);
        let [from, to] = hinge.axis.each_ref().map(point);
        let mut entry = format!(
            "bodies: [b{first}, b{second}], axis: [{from}, {to}], z: {}, rest: {}e-1",
            number(hinge.z),
            hinge.rest
        );
        if let Some([least, greatest]) = hinge.limits {
            let _ = write!(entry, ", limits: [{least}e-1, {greatest}e-1]");
        }
        let _ = writeln!(text, "  j{index}: {{ {entry} }}");
    }
    let guesses =
        hinges.iter().take(60).enumerate().filter_map(|(index, hinge)| Some((index, hinge.guess?)));
    let guesses: Vec<_> = guesses.map(|(index, guess)| format!("j{index}: {guess}e-1")).collect();
    if !guesses.is_empty() {
        let _ = writeln!(text, "initial: {{ q: {{ {} }} }}", guesses.join(", "));
    }
    text
}
