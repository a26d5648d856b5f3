//! The checks along a motion.

use lamc::arithmetic::{larger, largest};
use lamc::pipeline::Compiled;
use lamc_runtime::Mechanism;

use super::{Check, Remark, Settings};
use crate::execution::Jit;
use crate::motion::Work;
use crate::simulation::{Infinitesimal, Settings as Simulated, Simulation, unfold};

/// Relative and absolute error of each step.
const TOLERANCE: f64 = 1e-9;

/// Samples of the motion.
const SAMPLES: usize = 100;

/// Energy that may be missing, as a share of what was exchanged.
const BALANCE: f64 = 1e-6;

/// How far loops may open, as a share of the model's size.
const DRIFT: f64 = 1e-9;

const NAMES: [&str; 2] = ["balance", "drift"];

/// Simulates the model from its initial state.
pub fn checks(compiled: &Compiled, settings: &Settings) -> Vec<Check> {
    match simulated(compiled, settings) {
        Ok(simulation) => compared(&simulation),
        Err(remark) => NAMES.map(|name| Check::without(name, remark.clone())).to_vec(),
    }
}

fn simulated(compiled: &Compiled, settings: &Settings) -> Result<Simulation, Remark> {
    let system = Jit::new(&compiled.program);
    let failed = |error: &dyn std::fmt::Display| Remark::Failed(error.to_string());
    let mut state = system.assembled().map_err(|error| failed(&error))?;
    if let Some(found) = Infinitesimal::find(&compiled.topology, &system, &state.q) {
        return Err(Remark::NotChecked(found.to_string()));
    }
    unfold(&system, &mut state);
    let mechanism = &compiled.topology.mechanism;
    let work = Work::new(mechanism, system.parameters(), system.inputs());
    let how =
        Simulated { tolerance: TOLERANCE, duration: settings.duration, ..Simulated::default() };
    let simulation = Simulation::new(system, state, work, &how);
    let mut simulation = simulation.map_err(|error| failed(&error))?;
    let times = (0..=SAMPLES).map(|k| settings.duration * k as f64 / SAMPLES as f64);
    let run = simulation.run(times, || false, |_| ());
    run.map_err(|error| failed(&error))?;
    Ok(simulation)
}

fn compared(simulation: &Simulation) -> Vec<Check> {
    let motion = simulation.motion();
    let samples = &motion.samples;
    let energy = |k: usize| samples[k].energy.kinetic + samples[k].energy.potential;
    let balance = match simulation.work() {
        None => {
            let reason = "forces, tendons, dampers between bodies, contacts, air, drives, friction or stops \
                          change the energy too";
            Check::without(NAMES[0], Remark::NotChecked(reason.to_owned()))
        }
        Some(work) => {
            let last = samples.len() - 1;
            let kinetic = largest(samples.iter().map(|sample| sample.energy.kinetic));
            let off = (energy(last) - energy(0) - work.total).abs();
            let scale = larger(work.exchanged + kinetic, energy(0).abs() * f64::EPSILON);
            let share = |energy: f64| if energy == 0.0 { 0.0 } else { energy / scale };
            // Simpson's rule integrates the work.
            Check::new(NAMES[0], samples.len(), share(off), BALANCE + share(work.doubt))
        }
    };
    let open = largest(samples.iter().map(|sample| &sample.closure)) / motion.size;
    vec![balance, Check::new(NAMES[1], samples.len(), open, DRIFT)]
}
