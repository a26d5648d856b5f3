//! The likely cause when a motion breaks off: a driven joint that cannot follow, a loop that opens, or
//! the joint or free body with the largest acceleration.

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

/// Whether the loops are loose in a direction more than they usually are, as in the flat state.
/// By which branch the motion leaves it is for the implicit method to find.
pub fn is_singular(system: &Stopped<Jit>, state: &State<Vec<f64>, f64>) -> bool {
    let d = system.dimensions();
    let mut rates = system.speeds();
    let found =
        acceleration(system, state.t, &state.q, &state.u, &mut system.workspace(), &mut rates);
    let usual = system.system.interface().rank + d.drives;
    found.is_ok_and(|constraint| constraint.rank < usual.min(d.speeds))
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
    // Metres count in sizes of the mechanism, so that they compare with radians.
    let in_radians = |unit: &str, rate: f64| match unit {
        "m/s" => rate.abs() / system.size(),
        _ => rate.abs(),
    };
    let speeds = interface.speed_columns().zip(&rates);
    let rated = speeds.map(|((name, unit), rate)| (in_radians(unit, *rate), name, unit, rate));
    match rated.max_by(|(a, ..), (b, ..)| a.total_cmp(b)) {
        Some((_, name, unit, rate)) => {
            format!("`{name}` accelerates most, by {rate:.3e} {unit}^2")
        }
        None => "nothing can move".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lamc::pipeline;
    use lamc::source::SourceFile;

    /// A free plate of 40 mm falls, and its wing is turned back by a spring.
    #[test]
    fn free_bodies_are_blamed_too() {
        let said = |stiffness: &str| {
            let text = format!(
                "units: {{ length: mm }}\n\
                 materials: {{ card: {{ density: 700, thickness: 0.4 }} }}\n\
                 layup: [card]\n\
                 bodies:\n  hull: {{ free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }}\n  \
                 wing: {{ outline: [[40, 0], [80, 0], [80, 20], [40, 20]] }}\n\
                 joints: {{ hinge: {{ bodies: [hull, wing], axis: [[40, 0], [40, 20]], stiffness: {stiffness} }} }}\n"
            );
            let file = SourceFile { path: "suspect.yaml".into(), text };
            let system = Stopped::new(Jit::new(&pipeline::compile(&file).unwrap().program));
            let mut state = system.initial();
            state.q[0] = 0.5;
            suspect(&system, &state)
        };
        assert_eq!(said("0"), "`hull.vz` accelerates most, by -9.810e0 m/s^2");
        let stiff = said("1");
        assert!(
            stiff.starts_with("`hinge` accelerates most") && stiff.ends_with(" rad/s^2"),
            "{stiff}"
        );
    }
}
