//! `lamc eval MODEL --states FILE`: numbers at given states, or at the assembled initial one.

use std::collections::BTreeMap;

use lamc::laminate::verdicts;
use lamc::pipeline::Compiled;
use lamc::source::Severity;
use lamc_runtime::plumbing::{Balance, EquationsMut};
use lamc_runtime::{Constraint, Error, Mechanism as _, State, acceleration_and_forces, project};
use lamc_workbench::execution::Jit;
use lamc_workbench::motion::Tensions;
use lamc_workbench::reading::{StateInput, states};
use lamc_workbench::simulation::describe;
use serde::Serialize;

use clap::Args;

use super::paths::Paths;
use super::start::Start;

use super::{Outcome, fail, output, read_numbers};

/// Evaluate a model (JSON in, JSON out).
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// The states: {"states": [{"q": [..], "u": [..], "t": 0}]}; `-` reads standard input. Without
    /// this option, the assembled initial configuration is evaluated
    #[arg(long, value_name = "FILE", conflicts_with = "initial")]
    states: Option<String>,
}

#[derive(Serialize)]
struct Report {
    model: String,
    joints: Vec<String>,
    /// q and u go on with the free bodies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    free_bodies: Vec<String>,
    states: Vec<StateReport>,
}

/// Of all moving bodies together, in the base frame.
#[derive(Serialize)]
struct MomentumReport {
    /// m.
    centre_of_mass: [f64; 3],
    /// kg m/s.
    linear: [f64; 3],
    /// About the centre of mass, kg m^2/s.
    angular: [f64; 3],
}

#[derive(Serialize)]
struct StateReport {
    t: f64,
    q: Vec<f64>,
    u: Vec<f64>,
    acceleration: Vec<f64>,
    constraint_rank: usize,
    dof: usize,
    closure_residual: f64,
    kinetic_energy: f64,
    potential_energy: f64,
    mass_matrix: Vec<Vec<f64>>,
    forcing: Vec<f64>,
    /// For each joint force (N) and moment (N m) of the first body on the second, in the joint's
    /// frame.
    reactions: Vec<Vec<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    momentum: Option<MomentumReport>,
    /// By contact point, position (m) and force on the body (N), in the base frame.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    contacts: BTreeMap<String, Vec<f64>>,
    /// Of springs between points and tendons, N.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    tensions: BTreeMap<String, f64>,
    /// Of driven joints, N m.
    motor_torques: BTreeMap<String, f64>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let paths = Paths::default().input("the model", [&arguments.start.model]);
    paths.input("--states", &arguments.states).check()?;
    let given = arguments.states.as_deref();
    let given = given.map(|path| read_numbers(path, states)).transpose()?;
    let compiled = arguments.start.compile(&[])?;
    let system = arguments.start.system(&compiled)?;
    let mut reports = Vec::new();
    match (&arguments.states, given) {
        (Some(path), Some(states)) => {
            for (index, state) in states.iter().enumerate() {
                // Parameters and inputs that a state sets apply to this state only.
                let report = evaluate(&compiled, &mut system.clone(), state)
                    .map_err(|problem| fail(format_args!("{path}: state {index}: {problem}")))?;
                reports.push(report);
            }
        }
        _ => {
            let state = arguments.start.assembled(&compiled, &system)?;
            let state = StateInput { q: state.q, u: Some(state.u), ..StateInput::default() };
            reports.push(evaluate(&compiled, &mut system.clone(), &state).map_err(fail)?);
        }
    }
    let interface = system.interface();
    let report = Report {
        model: interface.name.clone(),
        joints: interface.joints.iter().map(|joint| joint.name.clone()).collect(),
        free_bodies: interface.free.iter().map(|body| body.name.clone()).collect(),
        states: reports,
    };
    let json = serde_json::to_string_pretty(&report).map_err(fail)?;
    output::print(&(json + "\n"))
}

/// Sets the parameters and inputs of a state.
fn set(compiled: &Compiled, system: &mut Jit, state: &StateInput) -> Result<(), String> {
    for (name, &value) in &state.params {
        system.set_parameter(name, value).map_err(|error| format!("`params`: {error}"))?;
    }
    let topology = compiled.topology_at(system.parameters()).map_err(|wrong| wrong.to_string())?;
    let mut judged = verdicts(&topology.mechanism, system.parameters()).into_iter();
    if let Some(wrong) = judged.find(|verdict| verdict.severity == Severity::Error) {
        return Err(wrong.to_string());
    }
    for (name, &value) in &state.inputs {
        system.set_input(name, value).map_err(|error| format!("`inputs`: {error}"))?;
    }
    Ok(())
}

/// What solves a state.
struct Solution {
    /// The state, or the nearest closed state if the acceleration depends on more digits than
    /// states in files usually have.
    q: Vec<f64>,
    u: Vec<f64>,
    acceleration: Vec<f64>,
    /// Closure forces, then motor torques.
    lambda: Vec<f64>,
    constraint: Constraint,
}

fn solve(system: &Jit, state: &StateInput) -> Result<Solution, String> {
    let d = system.dimensions();
    let (mut q, mut u) = (state.q.clone(), state.u.clone().unwrap_or(vec![0.0; d.speeds]));
    for (name, numbers, n) in [("q", &q, d.coordinates), ("u", &u, d.speeds)] {
        if numbers.len() != n {
            let (given, joints) = (numbers.len(), d.joints);
            return Err(match d.speeds == d.joints {
                true => format!("`{name}` has {given} numbers, but the model has {joints} joints"),
                false => format!(
                    "`{name}` has {given} numbers, but the joints and free bodies of the model have {n}"
                ),
            });
        }
    }
    let mut acceleration = system.speeds();
    let mut lambda = vec![0.0; d.rows + d.drives];
    let mut workspace = system.workspace();
    let mut solve = |q: &[f64], u: &[f64]| {
        let (rates, forces) = (&mut acceleration, &mut lambda);
        acceleration_and_forces(system, state.t, q, u, &mut workspace, rates, forces)
            .map_err(|error| describe(&error, system.interface()))
    };
    let mut constraint = solve(&q, &u)?;
    if constraint.is_weak {
        let (mut near_q, mut near_u) = (q.clone(), u.clone());
        let room = &mut system.workspace();
        if project(system, state.t, &mut near_q, &mut near_u, room).is_ok() {
            (q, u) = (near_q, near_u);
            constraint = solve(&q, &u)?;
        }
    }
    Ok(Solution { q, u, acceleration, lambda, constraint })
}

fn evaluate(
    compiled: &Compiled,
    system: &mut Jit,
    state: &StateInput,
) -> Result<StateReport, String> {
    let d = system.dimensions();
    let n = d.speeds;
    set(compiled, system, state)?;
    let Solution { q, u, acceleration, lambda, constraint } = solve(system, state)?;
    let mut reactions = vec![0.0; 6 * d.joints];
    let multipliers = &lambda[..d.rows];
    let at = Balance { t: state.t, q: &q, u: &u, acceleration: &acceleration, multipliers };
    let message = |error| describe(&error, system.interface());
    system.write_reactions(at, &mut reactions).map_err(message)?;
    let mut contacts = vec![0.0; 6 * d.contacts];
    system.write_contacts(state.t, &q, &u, &mut contacts).map_err(message)?;
    let named = system.interface().contacts.iter().cloned();
    let contacts = named.zip(contacts.chunks(6).map(<[f64]>::to_vec)).collect();
    let tensions = Tensions::new(&compiled.topology.mechanism);
    let here = State { t: state.t, q: q.clone(), u: u.clone() };
    let found =
        tensions.at(system, (system.parameters(), system.inputs()), &here).map_err(message)?;
    let tensions = tensions.names().zip(found).collect();
    let mut motor_torques = BTreeMap::new();
    for (joint, &torque) in system.interface().driven().iter().zip(&lambda[d.rows..]) {
        motor_torques.insert(system.interface().joints[joint.index()].name.clone(), torque);
    }
    let (mass, forcing) = mass_and_forcing(system, state.t, &q, &u).map_err(message)?;
    let mut residual = vec![0.0; 9 * d.loops];
    let rows = &mut vec![0.0; 9 * d.loops * n];
    system.write_closure(&q, &mut residual, rows).map_err(message)?;
    let energy = system.energy(state.t, &q, &u).map_err(message)?;
    if !(energy.kinetic.is_finite() && energy.potential.is_finite()) {
        return Err("its energy is too large for a double".to_owned());
    }
    // Momenta of mechanisms that the ground holds are not computed.
    let momentum = system.momentum(&q, &u).ok();
    Ok(StateReport {
        t: state.t,
        momentum: momentum.map(|found| MomentumReport {
            centre_of_mass: found.centre,
            linear: found.linear,
            angular: found.angular,
        }),
        q,
        u,
        reactions: reactions.chunks(6).map(<[f64]>::to_vec).collect(),
        contacts,
        tensions,
        motor_torques,
        acceleration,
        constraint_rank: constraint.rank,
        dof: n - constraint.rank,
        closure_residual: lamc::arithmetic::largest(&residual),
        kinetic_energy: energy.kinetic,
        potential_energy: energy.potential,
        mass_matrix: mass.chunks(n.max(1)).map(<[f64]>::to_vec).collect(),
        forcing,
    })
}

/// M, row-major, and f.
fn mass_and_forcing(
    system: &Jit,
    t: f64,
    q: &[f64],
    u: &[f64],
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let (n, rows) = (u.len(), system.dimensions().rows);
    let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut jacobian, mut gamma) = (vec![0.0; rows * n], vec![0.0; rows]);
    let out = EquationsMut {
        mass: &mut mass,
        forcing: &mut forcing,
        jacobian: &mut jacobian,
        gamma: &mut gamma,
    };
    system.write_equations(t, q, u, out)?;
    Ok((mass, forcing))
}
