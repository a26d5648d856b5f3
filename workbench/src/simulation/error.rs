//! Why a simulation ends before its time.

use lamc::program::Interface;
use lamc_runtime::{Error, Mechanism as _};

use super::Simulation;
use super::suspect::suspect;
use crate::motion::Gain;

/// Loops whose joints are all this near to zero, rad, lie flat.
const FLAT: f64 = 1e-2;

/// Why a simulation cannot be continued.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The steps become so short that the end is out of reach.
    #[error(
        "gave up after {steps} steps, at t = {t} s: the motion is not smooth there, or the tolerance is \
         too small{}; {suspect}",
        advice(*.started_flat)
    )]
    NotSmooth {
        /// Steps taken.
        steps: usize,
        /// s.
        t: f64,
        /// Whether it started from a flat sheet with loops.
        started_flat: bool,
        /// What is likely to be the cause.
        suspect: String,
    },
    /// The motion stays where the loops are loose in more directions than usual.
    #[error(
        "gave up at t = {t} s: the motion does not leave the singular state in which it started, \
         such as the flat state, in which many motions are possible; start from a folded guess; \
         {suspect}"
    )]
    StaysSingular {
        /// s.
        t: f64,
        /// What is likely to be the cause.
        suspect: String,
    },
    /// The energy grows though nothing does work.
    #[error(
        "the energy increases although nothing does work: by {:.3e} J until t = {t:.6} s, where \
         the largest kinetic energy is {:.3e} J; either the equations of a loop contradict each \
         other, for example because hinge lines are almost parallel or almost concurrent (see \
         `lamc check`, and `tolerance:` in the model), or the motion cannot pass a flat or \
         otherwise singular state (start from a folded guess)",
        .gain.energy,
        .gain.largest_kinetic
    )]
    EnergyGain {
        /// How much.
        gain: Gain,
        /// s.
        t: f64,
    },
    /// The steps become too small to advance the time.
    #[error("{reason}: {suspect}{}", advice(*.started_flat))]
    BreaksOff {
        /// The runtime's error with the names of the joints.
        reason: String,
        /// Whether it started from a flat sheet with loops.
        started_flat: bool,
        /// What is likely to be the cause.
        suspect: String,
    },
    /// The equations cannot be evaluated or the loops cannot be closed.
    #[error("{reason}, at t = {t} s{}", listed(.at_stop))]
    Failed {
        /// The runtime's error with the names of the joints.
        reason: String,
        /// s.
        t: f64,
        /// The joints at a stop, quoted.
        at_stop: Vec<String>,
    },
    /// The function of an event gives no number.
    #[error("the function of event {event} has no value at t = {t} s")]
    NoValue {
        /// Its number, from 0 on.
        event: usize,
        /// s.
        t: f64,
    },
}

impl Simulation {
    /// Whether it started from a sheet with loops that lay flat.
    pub(super) fn started_flat(&self) -> bool {
        let first = self.motion.samples.first();
        let is_flat = first.is_some_and(|sample| sample.q.iter().all(|q| q.abs() < FLAT));
        is_flat && self.system.dimensions().loops > 0
    }

    /// An error of the runtime with what is known here about its cause.
    pub(super) fn failure(&self, error: &Error) -> SimulationError {
        let interface = self.system.system.interface();
        let held =
            interface.joints.iter().zip(&self.system.sides).filter(|(_, side)| **side != 0.0);
        let at_stop: Vec<_> = held.map(|(joint, _)| format!("`{}`", joint.name)).collect();
        let reason = describe(error, interface);
        if matches!(error, Error::StepTooSmall { .. }) && at_stop.is_empty() {
            let suspect = suspect(&self.system, &self.state);
            return SimulationError::BreaksOff {
                reason,
                started_flat: self.started_flat(),
                suspect,
            };
        }
        SimulationError::Failed { reason, t: self.state.t, at_stop }
    }
}

fn advice(started_flat: bool) -> &'static str {
    if started_flat { "; start a flat sheet from a folded guess" } else { "" }
}

fn listed(at_stop: &[String]) -> String {
    match at_stop {
        [] => String::new(),
        names => format!(" with {} at a stop", names.join(", ")),
    }
}

/// The runtime's error with the name of the joint it is about.
pub fn describe(error: &Error, interface: &Interface) -> String {
    let joint = match *error {
        Error::NotClosed { joint, .. } => joint,
        Error::NotDriven { joint } | Error::NotFinite { joint } => Some(joint),
        _ => None,
    };
    if let Error::NotFinite { joint } = *error
        && joint >= interface.joints.len()
        && let Some((speed, _)) = interface.speed_columns().nth(joint)
    {
        return format!("`{speed}` has a value that is not finite");
    }
    if let Error::MassMatrix { joint } = *error
        && let Some((speed, _)) = interface.speed_columns().nth(joint)
    {
        return format!("{error} (`{speed}`)");
    }
    if let Error::Command { controller } = *error
        && let Some(controller) = interface.controllers.get(controller)
    {
        return format!("the controller `{}` has a value that is not finite", controller.name);
    }
    match joint.and_then(|joint| interface.joints.get(joint)) {
        Some(joint) => format!("{error} (`{}`)", joint.name),
        None => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use lamc::program::{FreeBodyInfo, JointInfo};

    use super::*;

    #[test]
    fn a_speed_of_a_free_body_has_its_name() {
        let joint = JointInfo { name: "hinge".into(), ..JointInfo::default() };
        let hull = FreeBodyInfo { name: "hull".into(), q: [0.0; 7], u: [0.0; 6] };
        let interface = Interface { joints: vec![joint], free: vec![hull], ..Interface::default() };
        let said = |joint| describe(&Error::NotFinite { joint }, &interface);
        assert_eq!(said(0), "joint 0 has a value that is not finite (`hinge`)");
        assert_eq!(said(2), "`hull.vy` has a value that is not finite");
    }
}
