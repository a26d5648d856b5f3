//! `lamc eval MODEL --states FILE`: numbers at given states, through the interpreter.

use std::collections::BTreeMap;
use std::io::Read;

use lamc::program::Interpreter;
use lamc_runtime::{EquationsMut, RANK_TOLERANCE, System, acceleration};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::{Outcome, fail, load, output};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Input {
    states: Vec<StateInput>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StateInput {
    q: Vec<f64>,
    u: Option<Vec<f64>>,
    #[serde(default)]
    t: f64,
    #[serde(default)]
    inputs: BTreeMap<String, f64>,
    #[serde(default)]
    params: BTreeMap<String, f64>,
}

#[derive(Serialize)]
struct Report {
    model: String,
    joints: Vec<String>,
    states: Vec<StateReport>,
}

#[derive(Serialize)]
struct StateReport {
    acceleration: Vec<f64>,
    constraint_rank: usize,
    dof: usize,
    closure_residual: f64,
    kinetic_energy: f64,
    potential_energy: f64,
    mass_matrix: Vec<Vec<f64>>,
    forcing: Vec<f64>,
}

pub fn run(model: &str, states: &str) -> Outcome {
    let text = if states == "-" {
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text).map(|_| text)
    } else {
        std::fs::read_to_string(states)
    };
    let text = text.map_err(|error| fail(format_args!("cannot read {states}: {error}")))?;
    let input: Input =
        serde_json::from_str(&text).map_err(|error| fail(format_args!("{states}: {error}")))?;
    let compiled = load(model)?;
    let mut interpreter = Interpreter::new(&compiled.program);
    let mut reports = Vec::new();
    for (index, state) in input.states.iter().enumerate() {
        let report = evaluate(&mut interpreter, state)
            .map_err(|problem| fail(format_args!("{states}: state {index}: {problem}")))?;
        reports.push(report);
    }
    let interface = interpreter.interface();
    let report = Report {
        model: interface.name.clone(),
        joints: interface.joints.iter().map(|joint| joint.name.clone()).collect(),
        states: reports,
    };
    let json = serde_json::to_string_pretty(&report).map_err(fail)?;
    output::print(&(json + "\n"))
}

fn evaluate(system: &mut Interpreter, state: &StateInput) -> Result<StateReport, String> {
    let d = system.dimensions();
    let n = d.coordinates;
    let zeros = vec![0.0; n];
    let (q, u) = (&state.q, state.u.as_ref().unwrap_or(&zeros));
    for (name, numbers) in [("q", q), ("u", u)] {
        if numbers.len() != n {
            return Err(format!("`{name}` has {} numbers, the model {n} joints", numbers.len()));
        }
    }
    system.reset();
    for (name, &value) in &state.params {
        system.set_parameter(name, value).map_err(|error| format!("`params`: {error}"))?;
    }
    for (name, &value) in &state.inputs {
        system.set_input(name, value).map_err(|error| format!("`inputs`: {error}"))?;
    }
    let mut rates = system.vector();
    acceleration(system, state.t, q, u, &mut system.workspace(), &mut rates)
        .map_err(|error| error.to_string())?;
    let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut rows, mut gamma) = (vec![0.0; d.rows * n], vec![0.0; d.rows]);
    let out = EquationsMut {
        mass: &mut mass,
        forcing: &mut forcing,
        jacobian: &mut rows,
        gamma: &mut gamma,
    };
    system.write_equations(state.t, q, u, out);
    let (mut residual, mut jacobian) = (vec![0.0; 9 * d.loops], vec![0.0; 9 * d.loops * n]);
    system.write_closure(q, &mut residual, &mut jacobian);
    let constraint_rank = rank(&mass, &jacobian, n);
    let energy = system.energy(state.t, q, u);
    Ok(StateReport {
        acceleration: rates,
        constraint_rank,
        dof: n - constraint_rank,
        closure_residual: residual.iter().fold(0.0, |most, x| x.abs().max(most)),
        kinetic_energy: energy.kinetic,
        potential_energy: energy.potential,
        mass_matrix: mass.chunks(n).map(<[f64]>::to_vec).collect(),
        forcing,
    })
}

/// Rank of all nine closure rows per loop, weighted by the mass matrix as in the dynamics.
fn rank(mass: &[f64], jacobian: &[f64], n: usize) -> usize {
    let rows = jacobian.len() / n;
    let Some(factor) = DMatrix::from_row_slice(n, n, mass).cholesky() else { return 0 };
    let transposed = DMatrix::from_row_slice(rows, n, jacobian).transpose();
    match factor.l().solve_lower_triangular(&transposed) {
        Some(weighted) if rows > 0 => {
            let values = weighted.singular_values();
            let least = values.max() * RANK_TOLERANCE.sqrt();
            values.iter().filter(|&&value| value > least).count()
        }
        _ => 0,
    }
}
