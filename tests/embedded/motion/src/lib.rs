//! The motion that every target computes: the six-bar, released at its closed guess, for a second.

#![no_std]
#![forbid(unsafe_code)]

use lamc_generated::sixbar::{NQ, NU, Sixbar};
use lamc_runtime::{Error, Rk4, Scalar, StateOf};

/// Steps of a second.
pub const STEPS: usize = 1000;

/// The six-bar in motion.
pub struct Motion<S: Scalar> {
    robot: Sixbar<S>,
    state: StateOf<Sixbar<S>>,
    rk4: Rk4<Sixbar<S>>,
}

impl<S: Scalar> Motion<S> {
    /// The initial state, loops closed.
    ///
    /// # Errors
    ///
    /// Those of the assembly.
    #[inline(never)]
    pub fn assembled() -> Result<Self, Error> {
        let robot = Sixbar::default();
        let state = robot.assembled()?;
        let rk4 = Rk4::new(&robot);
        Ok(Self { robot, state, rk4 })
    }

    /// Advances the motion by a millisecond, by the classical Runge-Kutta method with projection.
    ///
    /// # Errors
    ///
    /// Those of [`Rk4::step`].
    #[inline(never)]
    pub fn step(&mut self) -> Result<(), Error> {
        self.rk4.step(&self.robot, &mut self.state, S::from_f64(1e-3))
    }

    /// q (rad), then u (rad/s).
    pub fn coordinates(&self) -> [S; NQ + NU] {
        core::array::from_fn(|i| if i < NQ { self.state.q[i] } else { self.state.u[i - NQ] })
    }
}
