//! Comparison of a model with another description of it.

use lamc::pipeline::Compiled;
use lamc::source::elements::Tension;
use lamc::source::{Expression, Shape, SourceModel, Spring};
use lamc_runtime::plumbing::Balance;
use lamc_runtime::{Mechanism, acceleration_and_forces};
use lamc_workbench::execution::Jit;
use lamc_workbench::verify::{ACCELERATION, ENERGY, Solution, Values};
use nalgebra::{Rotation3, Vector3};

use crate::compare::{keep_largest, largest, largest_difference};
use crate::uniform::Random;

use super::path::{PERTURBATION, ROUNDING};
use super::subject::{Pair, Subject};
use super::work::mass;
use super::{Found, VAGUE, VAGUELY};

/// Another description.
pub struct Other {
    /// The model.
    pub subject: Option<Subject>,
    /// For each of its joints, the joint of the first description.
    pub order: Vec<usize>,
    /// Whether the bodies of all joints have changed places.
    pub swapped: bool,
    /// By how much the drawing has been moved in its plane, m.
    pub moved: [f64; 2],
}

/// What a description says at a state.
struct Said {
    acceleration: Vec<f64>,
    kinetic: f64,
    potential: f64,
    /// Force and moment of each joint.
    reactions: Vec<[Vector3<f64>; 2]>,
}

/// Accelerations, energies and, where the hinges determine them, reactions. Errors of accelerations are
/// relative to what they would be without drives, too, those of reactions to the largest, both divided by the
/// condition number of the hinges' equations, as in `lamc verify`.
/// What is allowed is the same, and what rounding of the angles changes: in another description loops close at
/// others.
pub fn compare(pair: &Pair, other: &Other) -> Result<Found, String> {
    let subject = other.subject.as_ref().ok_or("there is no other description")?;
    let mut found = Found::NONE;
    for (values, solution) in &pair.states {
        let expected = said(&pair.moves.with_inputs(&values.inputs), values)?;
        let [q, u] = other.state(values);
        let there = Values { q, u, ..values.clone() };
        let got = said(&subject.with_inputs(&values.inputs), &there)?;

        let accelerations = other.numbers(&expected.acceleration);
        let off = largest_difference(&got.acceleration, &accelerations);
        let scale = solution.magnitude * solution.condition();
        let rounding = ROUNDING * sensitivity(&pair.moves, values, &expected) / scale;
        let allowed = ACCELERATION + rounding;
        // A state at which rounding decides says nothing.
        if allowed > VAGUE {
            continue;
        }
        add(&mut found, off, scale, allowed);

        let lifted = lifted(&pair.moves.compiled, values, other.moved);
        let total = expected.kinetic + expected.potential.abs() + lifted.abs();
        add(&mut found, got.kinetic - expected.kinetic, total, ENERGY);
        add(&mut found, got.potential - expected.potential - lifted, total, ENERGY);

        if is_determined(&pair.moves.compiled, solution) {
            let least = held(&pair.moves.compiled, values, solution, &expected);
            let scale = (solution.condition(), allowed);
            compare_reactions([&expected, &got], other, values, least, scale, &mut found);
        }
    }
    match found.cases {
        0 => Err(VAGUELY.to_owned()),
        _ => Ok(found),
    }
}

/// By how much accelerations change with the angles, rad/s^2 per rad: in a random direction, in which that of the
/// largest change has a share of one in N on average.
fn sensitivity(subject: &Subject, values: &Values, expected: &Said) -> f64 {
    let system = subject.with_inputs(&values.inputs);
    let mut random = Random::new(values.q.len() as u64);
    let mut moved = values.clone();
    moved.q.iter_mut().for_each(|q| *q += random.range(-PERTURBATION, PERTURBATION));
    let Ok(said) = said(&system, &moved) else { return f64::INFINITY };
    let change = largest_difference(&said.acceleration, &expected.acceleration);
    values.q.len() as f64 * change / PERTURBATION
}

fn add(found: &mut Found, off: f64, scale: f64, allowed: f64) {
    let error = if off == 0.0 { 0.0 } else { off.abs() / scale };
    found.add(error, allowed);
}

/// The forces, N, and moments, N m, to which the reactions are rounded where motors hold against more than what
/// is left: those of all moving masses at the accelerations that there would be without drives.
fn held(compiled: &Compiled, values: &Values, solution: &Solution, expected: &Said) -> [f64; 2] {
    if solution.magnitude <= 2.0 * largest(&expected.acceleration) {
        return [0.0; 2];
    }
    let mechanism = &compiled.topology.mechanism;
    let moving = mechanism.bodies.iter().filter(|body| !body.fixed);
    let masses: f64 = moving.map(|body| mass(body, values)).sum();
    let force = masses * mechanism.size * solution.magnitude;
    [force, force * mechanism.size]
}

/// Whether no two equations of the hinges say the same: otherwise many reactions have the same effect.
fn is_determined(compiled: &Compiled, solution: &Solution) -> bool {
    let joints = &compiled.topology.mechanism.joints;
    let driven = joints.iter().filter(|joint| joint.drive.is_some()).count();
    solution.rank == 5 * joints.len() + driven
}

/// The reactions are those on the second body in its frame: of a joint whose bodies have changed places, the
/// opposite in the frame of the other body, from which the second is turned by q about the hinge.
fn compare_reactions(
    [expected, got]: [&Said; 2],
    other: &Other,
    values: &Values,
    least: [f64; 2],
    (condition, allowed): (f64, f64),
    found: &mut Found,
) {
    for kind in [0, 1] {
        let (mut off, mut scale) = (0.0_f64, least[kind]);
        for (got, &joint) in got.reactions.iter().zip(&other.order) {
            let mut reaction = expected.reactions[joint][kind];
            if other.swapped {
                let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), values.q[joint]);
                reaction = -(turn * reaction);
            }
            off = keep_largest(off, largest(&(got[kind] - reaction)));
            scale = keep_largest(scale, largest(&reaction));
        }
        add(found, off, scale * condition, allowed);
    }
}

/// What the movement of the drawing adds to the potential energy, J.
fn lifted(compiled: &Compiled, values: &Values, [x, y]: [f64; 2]) -> f64 {
    let mechanism = &compiled.topology.mechanism;
    // The move is that of the turned drawing.
    let back = Rotation3::from_axis_angle(&Vector3::z_axis(), -super::descriptions::TURN);
    let by = back * Vector3::new(x, y, 0.0);
    let gravity = Vector3::from_fn(|i, _| values.of(&mechanism.gravity[i]));
    let moving = mechanism.bodies.iter().filter(|body| !body.fixed);
    -moving.map(|body| mass(body, values)).sum::<f64>() * gravity.dot(&by)
}

fn said(system: &Jit, Values { t, q, u, .. }: &Values) -> Result<Said, String> {
    let d = system.dimensions();
    let (mut acceleration, mut lambda) = (vec![0.0; u.len()], vec![0.0; d.rows + d.drives]);
    let workspace = &mut system.workspace();
    let describe = |error: lamc_runtime::Error| error.to_string();
    acceleration_and_forces(system, *t, q, u, workspace, &mut acceleration, &mut lambda)
        .map_err(describe)?;
    let energy = system.energy(*t, q, u).map_err(describe)?;
    let mut reactions = vec![0.0; 6 * u.len()];
    let multipliers = &lambda[..d.rows];
    let at = Balance { t: *t, q, u, acceleration: &acceleration, multipliers };
    system.write_reactions(at, &mut reactions).map_err(describe)?;
    let vectors =
        |six: &[f64]| [Vector3::new(six[0], six[1], six[2]), Vector3::new(six[3], six[4], six[5])];
    let reactions = reactions.chunks_exact(6).map(vectors).collect();
    Ok(Said { acceleration, kinetic: energy.kinetic, potential: energy.potential, reactions })
}

/// Lengths in mm and angles in degrees.
pub fn in_millimetres(model: &mut SourceModel) {
    let mm = |metres: &mut f64| *metres *= 1e3;
    let degrees = |radians: &mut f64| *radians = radians.to_degrees();
    mm(&mut model.tolerance);
    model.materials.iter_mut().for_each(|material| mm(&mut material.thickness.value));
    for body in &mut model.bodies {
        body.point_masses.iter_mut().flat_map(|point| &mut point.at.value).for_each(mm);
        match &mut body.shape {
            Shape::None => {}
            Shape::Plates(layers) => {
                for plate in layers.iter_mut().flatten() {
                    let rings = plate.holes.iter_mut().chain([&mut plate.outline]);
                    rings.flat_map(|ring| &mut ring.value).flatten().for_each(mm);
                }
            }
            Shape::Rigid { com, .. } => com.value.iter_mut().for_each(mm),
        }
    }
    model.points.iter_mut().flat_map(|point| &mut point.at.value).for_each(mm);
    model.contacts.iter_mut().flat_map(|contact| &mut contact.plane.point.value).for_each(mm);
    let elements = &mut model.elements;
    for tendon in elements.bands.iter_mut().chain(&mut elements.tendons) {
        if let Tension::Elastic { rest_length: Some(length), .. } = &mut tendon.tension
            && let Expression::Number(length) = &mut length.value
        {
            mm(length);
        }
    }
    for twist in &mut elements.twists {
        twist.axis.value.iter_mut().flatten().for_each(mm);
        if let Expression::Number(rest) = &mut twist.rest.value {
            degrees(rest);
        }
    }
    for joint in &mut model.joints {
        joint.axis.value.iter_mut().flatten().for_each(mm);
        mm(&mut joint.z.value);
        match &mut joint.spring {
            Spring::Stiffness(_) => {}
            Spring::Beam { length, width, gaps, .. } => {
                [length, width].into_iter().chain(gaps).for_each(|size| mm(&mut size.value));
            }
            Spring::Sharifzadeh2018 { length, width, .. }
            | Spring::Family { length, width, .. } => {
                [length, width].into_iter().for_each(|size| mm(&mut size.value));
            }
        }
        // Laws that are not numbers are in radians whatever the unit.
        for law in [Some(&mut joint.rest), joint.drive.as_mut()].into_iter().flatten() {
            if let Expression::Number(angle) = &mut law.value {
                degrees(angle);
            }
        }
        joint.limits.iter_mut().flat_map(|limits| &mut limits.value).for_each(degrees);
        joint.friction.iter_mut().for_each(|friction| degrees(&mut friction.speed.value));
    }
    let guesses = model.initial_q.iter_mut().chain(&mut model.initial_u);
    guesses.for_each(|(_, value)| degrees(value));
}
