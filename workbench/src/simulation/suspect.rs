//! The likely cause when a motion breaks off: a driven joint that cannot follow, a loop that opens, or
//! the joint with the largest acceleration.

use lamc_runtime::{Mechanism, State, Stopped, acceleration, project};

use super::describe;
use crate::execution::Jit;

/// How far ahead, s, driven joints must be able to follow.
const AHEAD: f64 = 1e-3;

/// How near to its limit a joint is at it, rad.
const STOP: f64 = 1e-6;

/// Whether a joint is at one of its limits, rad.
pub fn is_at_stop([least, greatest]: [f64; 2], q: f64) -> bool {
    q <= least + STOP || q >= greatest - STOP
}

/// What to say about a state from which an integrator could not go on.
pub fn suspect(system: &Stopped<Jit>, state: &State<Vec<f64>, f64>) -> String {
    let interface = system.system.interface();
    let joints = interface.joints.iter().zip(&state.q);
    let stopped = joints.filter(|(joint, q)| is_at_stop(joint.limits, **q));
    let stopped: Vec<_> = stopped.map(|(joint, _)| format!("`{}`", joint.name)).collect();
    if !stopped.is_empty() {
        return format!("{} at a stop", stopped.join(", "));
    }
    let (mut q, mut u) = (state.q.clone(), state.u.clone());
    let workspace = &mut system.workspace();
    if system.dimensions().drives > 0
        && let Err(error) = project(system, state.t + AHEAD, &mut q, &mut u, workspace)
    {
        return describe(&error, interface);
    }
    let mut rates = system.speeds();
    let found = acceleration(system, state.t, &state.q, &state.u, workspace, &mut rates);
    if let Err(error) = found {
        return describe(&error, interface);
    }
    let joints = interface.joints.iter().zip(&rates);
    match joints.max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs())) {
        Some((joint, rate)) => {
            format!("`{}` accelerates most, by {rate:.3e} rad/s^2", joint.name)
        }
        None => "there are no joints".to_owned(),
    }
}
