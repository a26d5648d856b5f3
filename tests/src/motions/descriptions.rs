//! The same mechanism described in another way: what each way changes in the model, and what it makes of a
//! state, its accelerations, potential energy and reactions.

use lamc::source::{Expression, JointId, Shape, SourceModel, to_yaml};
use lamc_workbench::verify::{Check, Values};
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::edits::{changed, laws, plus, times};
use super::same::{Other, compare};
use super::subject::{Pair, Subject};
use super::{NAMES, check};

/// The turn of a drawing in its plane, rad, and by what it is moved then, in its size.
pub const TURN: f64 = 0.83;
const MOVED: [f64; 2] = [0.7, -1.3];

/// Share of the size up to which lines of a drawing are made parallel or concurrent once they are so.
const EXACT: f64 = 1e-9;

/// Joints at which another cut is tried.
const TRIED_CUTS: usize = 4;

/// All other descriptions of the second model, compared with the first.
pub fn checks(pair: &Pair) -> Vec<Check> {
    let rotated = other(pair, rotated(pair.moves.compiled.topology.mechanism.size));
    let mut checks = vec![
        compared(NAMES[9], rotated, pair),
        compared(NAMES[10], reordered(pair), pair),
        compared(NAMES[11], other(pair, swapped), pair),
        compared(NAMES[12], units(pair), pair),
    ];
    if !pair.moves.compiled.topology.loops.is_empty() {
        checks.push(compared(NAMES[13], recut(pair), pair));
    }
    checks
}

fn compared(name: &'static str, other: Result<Other, String>, pair: &Pair) -> Check {
    check(name, other.and_then(|other| compare(pair, &other)))
}

/// The second model after a change, with the lines of hinges that lamc made exact: in another description,
/// what is left of rounding would be another number.
fn other(pair: &Pair, change: impl FnOnce(&mut SourceModel) -> Other) -> Result<Other, String> {
    let mut other = None;
    let subject = Subject::edited(pair.saying(), |model| {
        exact(model, pair);
        other = Some(change(model));
    })?;
    let mut other = other.ok_or("the model was not changed")?;
    other.subject = Some(subject);
    Ok(other)
}

fn exact(model: &mut SourceModel, pair: &Pair) {
    let mechanism = &pair.moves.compiled.topology.mechanism;
    for (joint, exact) in model.joints.iter_mut().zip(&mechanism.joints) {
        let end = exact.point + exact.direction * exact.length;
        joint.axis.value = [[exact.point.x, exact.point.y], [end.x, end.y]];
        joint.z.value = exact.point.z;
    }
    model.tolerance = model.tolerance.min(EXACT * mechanism.size);
}

/// Turned in its plane with gravity and forces, then moved.
fn rotated(size: f64) -> impl FnOnce(&mut SourceModel) -> Other {
    move |model| {
        let (sin, cos) = TURN.sin_cos();
        let by = MOVED.map(|share| share * size);
        let turn = |[x, y]: [f64; 2]| [cos * x - sin * y + by[0], sin * x + cos * y + by[1]];
        let lift = |[x, y, z]: [f64; 3]| {
            let [x, y] = turn([x, y]);
            [x, y, z]
        };
        let matrix: Matrix3<f64> = Rotation3::from_axis_angle(&Vector3::z_axis(), TURN).into();
        for body in &mut model.bodies {
            body.point_masses.iter_mut().for_each(|point| point.at.value = lift(point.at.value));
            match &mut body.shape {
                Shape::None => {}
                Shape::Plates(layers) => {
                    for plate in layers.iter_mut().flatten() {
                        let rings = plate.holes.iter_mut().chain([&mut plate.outline]);
                        let vertices = rings.flat_map(|ring| &mut ring.value);
                        vertices.for_each(|vertex| *vertex = turn(*vertex));
                    }
                }
                Shape::Rigid { com, inertia, .. } => {
                    com.value = lift(com.value);
                    let given = Matrix3::from_fn(|i, j| inertia.value[i][j]);
                    let turned = matrix * given * matrix.transpose();
                    let turned = (turned + turned.transpose()) * 0.5;
                    inertia.value = [0, 1, 2].map(|i| [0, 1, 2].map(|j| turned[(i, j)]));
                }
            }
        }
        let lines = model.joints.iter_mut().flat_map(|joint| &mut joint.axis.value);
        lines.for_each(|point| *point = turn(*point));
        let axes = model.elements.twists.iter_mut().flat_map(|twist| &mut twist.axis.value);
        axes.for_each(|point| *point = turn(*point));
        model.points.iter_mut().for_each(|point| point.at.value = lift(point.at.value));
        for contact in &mut model.contacts {
            contact.plane.point.value = lift(contact.plane.point.value);
            let normal = &mut contact.plane.normal.value;
            *normal = (matrix * Vector3::from(*normal)).into();
        }
        let vectors = model.forces.iter_mut().map(|force| &mut force.force);
        for vector in vectors.chain([&mut model.gravity]) {
            let [x, y, z] = vector.clone();
            let turned = |x: f64, y: f64, laws: [&Expression; 2]| {
                plus(times(laws[0].clone(), x), times(laws[1].clone(), y))
            };
            *vector = [turned(cos, -sin, [&x, &y]), turned(sin, cos, [&x, &y]), z];
        }
        Other { moved: [by[0], by[1]], ..Other::of(model.joints.len()) }
    }
}

/// The first body of every joint is the second: q turns the other way, and so does everything that depends on it.
fn swapped(model: &mut SourceModel) -> Other {
    for joint in &mut model.joints {
        joint.bodies.swap(0, 1);
        let laws = [Some(&mut joint.rest), Some(&mut joint.torque), joint.drive.as_mut()];
        laws.into_iter().flatten().for_each(|law| law.value = negative(law.value.clone()));
        if let Some(limits) = &mut joint.limits {
            limits.value = [-limits.value[1], -limits.value[0]];
        }
    }
    for motor in &mut model.elements.motors {
        motor.voltage.value = negative(motor.voltage.value.clone());
    }
    let guesses = model.initial_q.iter_mut().chain(&mut model.initial_u);
    guesses.for_each(|(_, value)| *value = -*value);
    for law in laws(model) {
        *law = changed(law, &|leaf| match leaf {
            Expression::Position(_) | Expression::Rate(_) => negative(leaf.clone()),
            other => other.clone(),
        });
    }
    let joints = model.joints.len();
    Other { swapped: true, ..Other::of(joints) }
}

/// The law with the sign changed; numbers stay numbers, as `tunable` needs them.
fn negative(law: Expression) -> Expression {
    match law {
        Expression::Number(number) => Expression::Number(-number),
        law => times(law, -1.0),
    }
}

/// The text of the second model with exact lines.
fn written(pair: &Pair) -> String {
    let mut model = pair.says.model.clone();
    exact(&mut model, pair);
    to_yaml(&model)
}

/// Bodies and joints in the opposite order, which grows another tree.
fn reordered(pair: &Pair) -> Result<Other, String> {
    let mut text = String::new();
    let mut entries: Vec<String> = Vec::new();
    let mut is_list = false;
    for line in written(pair).lines() {
        if !line.starts_with(' ') {
            entries.drain(..).rev().for_each(|entry| text.push_str(&entry));
            is_list = ["bodies:", "joints:"].contains(&line);
        }
        match (is_list && line.starts_with("  "), entries.last_mut()) {
            (true, Some(entry)) if line.starts_with("   ") => entry.push_str(&format!("{line}\n")),
            (true, _) => entries.push(format!("{line}\n")),
            (false, _) => text.push_str(&format!("{line}\n")),
        }
    }
    entries.drain(..).rev().for_each(|entry| text.push_str(&entry));
    let joints = pair.says.model.joints.len();
    let subject = Subject::new(&text)?;
    let order = (0..joints).rev().collect();
    Ok(Other { subject: Some(subject), order, ..Other::of(joints) })
}

/// The same numbers in mm, degrees and g.
fn units(pair: &Pair) -> Result<Other, String> {
    let mut model = pair.says.model.clone();
    exact(&mut model, pair);
    super::same::in_millimetres(&mut model);
    let mut text = String::from("units: { length: mm, angle: deg }\n");
    for line in to_yaml(&model).lines() {
        // Masses follow in their own lines or, of points, in braces.
        let (before, rest) = line.split_once("mass: ").unwrap_or((line, ""));
        let end = rest.find([',', ' ']).unwrap_or(rest.len());
        match rest[..end].parse::<f64>() {
            Ok(mass) => {
                text.push_str(&format!("{before}mass: {:?} g{}\n", mass * 1e3, &rest[end..]));
            }
            Err(_) => text.push_str(&format!("{line}\n")),
        }
    }
    let joints = model.joints.len();
    Ok(Other { subject: Some(Subject::new(&text)?), ..Other::of(joints) })
}

/// Loops cut at other joints.
fn recut(pair: &Pair) -> Result<Other, String> {
    let topology = &pair.moves.compiled.topology;
    let usual: Vec<JointId> = topology.loops.iter().map(|closed| closed.joint).collect();
    let around = topology.loops.iter().flat_map(|closed| &closed.joints);
    let joints: Vec<JointId> = around.copied().filter(|joint| !usual.contains(joint)).collect();
    // From the middle of the loop, far from the usual cut.
    let tried = joints.iter().skip(joints.len() / 2).take(TRIED_CUTS);
    for &joint in tried {
        let cut = |model: &mut SourceModel| {
            model.cuts.push(joint);
            Other::of(model.joints.len())
        };
        if let Ok(other) = other(pair, cut) {
            return Ok(other);
        }
    }
    Err("no loop can be cut elsewhere".to_owned())
}

impl Other {
    /// The same description of so many joints.
    fn of(joints: usize) -> Self {
        let order = (0..joints).collect();
        Self { subject: None, order, swapped: false, moved: [0.0; 2] }
    }

    /// A state of the first description in this one.
    pub fn state(&self, values: &Values) -> [Vec<f64>; 2] {
        [self.numbers(&values.q), self.numbers(&values.u)]
    }

    /// Numbers of all joints.
    pub fn numbers(&self, numbers: &[f64]) -> Vec<f64> {
        let sign = if self.swapped { -1.0 } else { 1.0 };
        self.order.iter().map(|&joint| sign * numbers[joint]).collect()
    }
}
