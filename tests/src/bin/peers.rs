//! Writes data of lamc for `tests/peers/run`, which compares lamc with other programs.
//!
//! ```text
//! peers chain 12            the chain of twelve hinges in lamc's schema, to standard output
//! peers miura 3 4           a sheet of three by four parallelograms, to standard output
//! peers yoshimura 3 4       a sheet of three strips of eight triangles, to standard output
//! peers export MODEL 64     the numeric model and 64 of its states as JSON, to standard output
//! peers contacts MODEL 64   the same of a robot on the ground, with its contact points, in motion
//! ```
//!
//! SI and radians; vectors and tensors in flat coordinates, where all q = 0.

use std::path::Path;

use lamc::program::Interpreter;
use lamc::source::Expression;
use lamc::topology::{LoopClass, Node, Topology};
use lamc_runtime::{Integrator, Mechanism, acceleration};
use lamc_tests::chain::chain;
use lamc_tests::random::{Random, closed_state, closed_state_about};
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile, dopri5, largest};
use lamc_workbench::execution::Jit;
use nalgebra::Matrix3;
use serde_json::{Value, json};

/// The motion of a robot on the ground is looked at so many times, and so often, s.
const SAMPLES: u32 = 400;
const SAMPLE: f64 = 1e-3;

/// Share of the largest acceleration below which a robot is at rest.
const AT_REST: f64 = 1e-3;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["chain", hinges] => print!("{}", chain(number(hinges))),
        ["miura", rows, columns] => print!("{}", miura(number(rows), number(columns))),
        ["yoshimura", rows, columns] => print!("{}", yoshimura(number(rows), number(columns))),
        ["export", model, states] => println!("{}", export(Path::new(model), number(states))),
        ["contacts", model, states] => println!("{}", contacts(Path::new(model), number(states))),
        _ => usage(),
    }
}

fn usage() -> ! {
    eprintln!(
        "usage: peers chain HINGES | peers miura|yoshimura ROWS COLUMNS | peers export|contacts MODEL STATES"
    );
    std::process::exit(2)
}

fn number(text: &str) -> usize {
    text.parse().unwrap_or_else(|_| usage())
}

fn export(path: &Path, states: usize) -> Value {
    let compiled = compile(path);
    let topology = &compiled.topology;
    let mut model = numeric(topology);
    let system = Interpreter::new(&compiled.program);
    let mut workspace = system.workspace();
    let initial = &topology.mechanism.initial_q;
    let mut random = Random::new(7);
    let mut state = || {
        // Few of the random angles of a sheet lead to one that is folded everywhere.
        let state = match topology.loops.len() {
            0 | 1 => closed_state(&system, &mut random),
            _ => closed_state_about(&system, initial, &mut random),
        };
        // The models compared do not depend on time.
        let mut rates = |u: &[f64]| {
            let mut rates = vec![0.0; state.q.len()];
            acceleration(&system, 0.0, &state.q, u, &mut workspace, &mut rates)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            rates
        };
        json!({
            "q": state.q,
            "u": state.u,
            "acceleration": rates(&state.u),
            "acceleration_at_rest": rates(&vec![0.0; state.q.len()]),
        })
    };
    model["states"] = (0..states).map(|_| state()).collect();
    model
}

/// A robot and its contact points, in states of its motion in which at least one of them touches, and which are not at rest: there,
/// an acceleration is what rounding leaves of forces that cancel.
fn contacts(path: &Path, states: usize) -> Value {
    let compiled = compile(path);
    let topology = &compiled.topology;
    let mut model = numeric(topology);
    let [contact] = &topology.mechanism.contacts[..] else { panic!("peers know one contact only") };
    let points = contact.points.iter().map(|point| {
        let is_original = |node: &Node| node.body == point.body && node.ghost.is_none();
        json!({
            "node": topology.nodes.iter().position(is_original),
            "at": point.at.as_slice(),
        })
    });
    model["contact"] = json!({
        "point": contact.plane.point.as_slice(),
        "normal": contact.plane.normal.as_slice(),
        "friction": contact.friction.constant(),
        "points": points.collect::<Vec<_>>(),
    });
    let system = Jit::new(&compiled.program);
    let mut forces = vec![0.0; 6 * contact.points.len()];
    let mut touching = Vec::new();
    let mut workspace = system.workspace();
    let mut state = system.assembled().unwrap_or_else(|error| panic!("{error}"));
    for sample in 1..=SAMPLES {
        let end = f64::from(sample) * SAMPLE;
        dopri5(&system, 1e-6)
            .run(&system, &mut state, end, |_| {})
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        system.write_contacts(state.t, &state.q, &state.u, &mut forces).expect("its own length");
        if forces.chunks(6).any(|point| point[3..] != [0.0; 3]) {
            let mut rates = state.u.clone();
            acceleration(&system, 0.0, &state.q, &state.u, &mut workspace, &mut rates)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            touching.push(json!({
                "q": state.q, "u": state.u, "acceleration": rates, "contacts": forces
            }));
        }
    }
    let size = |row: &Value| {
        let rates = row["acceleration"].as_array().expect("written above");
        largest(rates.iter().filter_map(Value::as_f64))
    };
    let most = largest(touching.iter().map(size));
    touching.retain(|row| size(row) > AT_REST * most);
    assert!(
        touching.len() >= states,
        "{}: it touches in {} states only",
        path.display(),
        touching.len()
    );
    let every = touching.len() / states;
    model["states"] = touching.into_iter().step_by(every).take(states).collect();
    model
}

/// Joints in the order of coordinates; nodes of the spanning tree, parents first, with their share
/// of the body's mass and inertia; loops, each a pair of nodes that must coincide.
fn numeric(topology: &Topology) -> Value {
    let mechanism = &topology.mechanism;
    let constant = |expression: &Expression| {
        expression.constant().unwrap_or_else(|| panic!("peers know constants only: {expression:?}"))
    };
    let joints = mechanism.joints.iter().map(|joint| {
        json!({
            "name": joint.name,
            "bodies": joint.bodies.map(|body| body.index()),
            "point": joint.point.as_slice(),
            "direction": joint.direction.as_slice(),
            "stiffness": constant(&joint.stiffness),
            "damping": constant(&joint.damping),
            "rest": constant(&joint.rest),
        })
    });
    let nodes = topology.nodes.iter().map(|node| {
        let properties = &mechanism.bodies[node.body.index()].mass_properties;
        json!({
            "joint": node.joint().map(lamc::source::JointId::index),
            "body": node.body.index(),
            "ghost": node.ghost.is_some(),
            "parent": node.parent.map(|parent| parent.index()),
            "sense": node.sense,
            "mass": node.share * properties.mass,
            "com": properties.com.as_slice(),
            "inertia": rows(&(properties.inertia * node.share)),
        })
    });
    let loops = topology.loops.iter().map(|closed| {
        let centre = match &closed.class {
            LoopClass::Spherical { centre } => Some(centre.as_slice().to_vec()),
            LoopClass::Planar { .. } | LoopClass::Spatial => None,
        };
        // The peers close the loops of the tree, each at the joint that closes the short one.
        let ghost = topology.nodes.iter().position(|node| node.joint() == Some(closed.joint));
        let body = ghost.map(|ghost| topology.nodes[ghost].body);
        let is_original = |node: &Node| Some(node.body) == body && node.ghost.is_none();
        json!({
            "original": topology.nodes.iter().position(is_original),
            "ghost": ghost,
            "class": closed.class.to_string(),
            "centre": centre,
            "points": closed.points.each_ref().map(|point| point.as_slice()),
            "frame": rows(&closed.frame),
            "rows": closed.rows.iter().map(|row| [row.point, row.axis]).collect::<Vec<_>>(),
            "rank": closed.rank,
            "joints": closed.joints.iter().map(|joint| joint.index()).collect::<Vec<_>>(),
        })
    });
    json!({
        "name": mechanism.name,
        "gravity": mechanism.gravity.each_ref().map(constant),
        "size": mechanism.size,
        "joints": joints.collect::<Vec<_>>(),
        "nodes": nodes.collect::<Vec<_>>(),
        "loops": loops.collect::<Vec<_>>(),
    })
}

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)]))
}
