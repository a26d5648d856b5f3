//! A model of the leg that moves along with the real one: no heap, no standard library.
#![no_std]

mod leg {
    include!(concat!(env!("OUT_DIR"), "/leg.rs"));
}

use lamc_runtime::{Error, Rk4, StateOf};
use leg::Leg;

/// Time between two calls of `Model::advance`, s.
pub const STEP: f32 = 1e-3;

/// The leg as it should move under the commands that the motors get.
pub struct Model {
    leg: Leg,
    state: StateOf<Leg>,
    integrator: Rk4<Leg>,
}

impl Model {
    /// The leg in its initial state, its loop closed.
    pub fn new() -> Result<Self, Error> {
        let leg = Leg::default();
        Ok(Self { state: leg.assembled()?, integrator: Rk4::new(&leg), leg })
    }

    /// One step in time. Takes the wanted hip angles (rad) and the push of the ground (N); returns
    /// where the toe is (m).
    pub fn advance(&mut self, left: f32, right: f32, push: f32) -> Result<[f32; 3], Error> {
        self.leg.inputs.left = left;
        self.leg.inputs.right = right;
        self.leg.inputs.push = push;
        self.integrator.step(&self.leg, &mut self.state, STEP)?;
        let [toe] = self.leg.points(&self.state.q);
        Ok(toe)
    }
}
