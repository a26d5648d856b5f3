//! The controllers of a program.

use lamc_runtime::{Clock, Controlled, Controller, Error, Pwm};

use super::{Executable, State};
use crate::program::{Engine, FunctionKind};

impl<E: Engine> Controlled for Executable<E> {
    type Memory = Vec<f64>;
    type Commands = Vec<f64>;
    type Clocks = Vec<Clock>;

    fn memory(&self) -> Vec<f64> {
        self.interface.memory().map(|(_, initial)| *initial).collect()
    }

    fn commands(&self) -> Vec<f64> {
        vec![0.0; self.interface.commands().count()]
    }

    fn clocks(&self) -> Vec<Clock> {
        vec![Clock::default(); self.interface.controllers.len()]
    }

    fn controller(&self, index: usize) -> Controller<f64> {
        let controller = &self.interface.controllers[index];
        Controller {
            sample: controller.sample,
            delay: controller.delay,
            memory: controller.memory.len(),
            commands: controller.inputs.len(),
            pwm: controller.pwm.map(|pwm| Pwm {
                period: pwm.period,
                levels: pwm.levels,
                duty: pwm.duty,
            }),
        }
    }

    fn write_control(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        memory: &[f64],
        next: &mut [f64],
        commands: &mut [f64],
    ) -> Result<(), Error> {
        let at = State { t, q, u, memory, ..State::default() };
        self.evaluate(FunctionKind::Control, at, &mut [next, commands])
    }

    fn set_command(&mut self, command: usize, value: f64) {
        if let Some(input) = self.interface.commands().nth(command) {
            self.inputs[input.index()] = value;
        }
    }
}
