//! Inputs that change during a motion: those that controllers drive, and those that the caller sets.

use lamc::program::FunctionKind;
use lamc_runtime::{ControlLoop, Integrator};

use super::{Simulation, SimulationError};
use crate::execution::Jit;

/// The controllers of a mechanism, if it has any and the program has their function.
pub(super) struct Control(Option<ControlLoop<Jit>>);

impl Control {
    /// Controllers that sample for the first time at `t` (s) or after it.
    pub(super) fn new(system: &Jit, t: f64) -> Self {
        let is_there =
            !system.interface().controllers.is_empty() && system.has(FunctionKind::Control);
        Self(is_there.then(|| ControlLoop::new(system, t)))
    }

    /// How far the inputs are constant towards `t`, s.
    pub(super) fn until(&self, system: &Jit, t: f64) -> f64 {
        self.0.as_ref().map_or(t, |control| control.until(system, t))
    }
}

impl Simulation {
    /// Lets the controllers do what is due at the time that was reached.
    pub(super) fn act(&mut self) -> Result<(), SimulationError> {
        let Some(control) = &mut self.control.0 else { return Ok(()) };
        match control.act(&mut self.system.system, &self.state) {
            Ok(false) => {}
            Ok(true) => {
                if let Some(work) = &mut self.work {
                    work.set_inputs(self.system.system.inputs());
                }
                self.restart();
            }
            Err(error) => return Err(self.failure(&error)),
        }
        Ok(())
    }

    /// Sets all inputs, SI, from the time that was reached on: they are held until they are set again. Those that
    /// controllers drive stay as they are. From the first call on the energy is not audited.
    pub fn hold_inputs(&mut self, inputs: &[f64]) {
        let system = &mut self.system.system;
        let mut inputs = inputs.to_vec();
        for id in system.interface().commands() {
            inputs[id.index()] = system.inputs()[id.index()];
        }
        system.set_inputs(&inputs);
        self.restart();
        self.work = None;
    }

    /// Tells the integrators that the accelerations have jumped.
    pub(super) fn restart(&mut self) {
        self.explicit.restart();
        self.implicit.restart();
        if let Some(switches) = &mut self.switches {
            switches.forget();
        }
    }

    /// Records the inputs that controllers drive in each further sample.
    pub fn record_inputs(&mut self) {
        let interface = self.system.system.interface();
        let names =
            interface.commands().map(|id| format!("inputs.{}", interface.inputs[id.index()]));
        self.motion.inputs = names.collect();
    }
}
