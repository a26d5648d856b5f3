//! What every target computes, for a second each: the six-bar, released at its closed guess; the jumper of the examples,
//! which leaps off the ground, lands and comes to rest; and the estimation of a hinge's stiffness.

#![no_std]
#![forbid(unsafe_code)]

mod estimate;

pub use estimate::Estimation;

use lamc_generated::{jumper::Jumper, sixbar::Sixbar};
use lamc_runtime::{Arithmetic, Error, Mechanism, Rk4, Scalar, StateOf};

/// What firmware does in each step.
pub trait Task: Sized {
    /// The type of its numbers.
    type Number: Scalar;
    /// Steps of a second.
    const STEPS: u32;

    /// The start.
    ///
    /// # Errors
    ///
    /// Those of the assembly.
    fn assembled() -> Result<Self, Error>;

    /// A step.
    ///
    /// # Errors
    ///
    /// Those of [`Rk4::step`].
    fn step(&mut self) -> Result<(), Error>;

    /// What is compared between targets.
    fn coordinates(&self) -> impl Iterator<Item = Self::Number>;
}

/// A mechanism in motion.
pub struct Motion<M: Mechanism> {
    robot: M,
    state: StateOf<M>,
    rk4: Rk4<M>,
}

/// A mechanism and its steps.
pub trait Robot: Mechanism + Default {
    /// Steps of a second.
    const STEPS: u32;
    /// Length of a step, s.
    const STEP: f64;
}

impl<S: Scalar> Robot for Sixbar<S> {
    const STEPS: u32 = 1_000;
    const STEP: f64 = 1e-3;
}

impl<S: Scalar> Robot for Jumper<S> {
    const STEPS: u32 = 10_000;
    // Its contacts are stiff: steps of a millisecond are not stable while it lands.
    const STEP: f64 = 1e-4;
}

impl<M: Robot> Task for Motion<M> {
    type Number = M::Scalar;
    const STEPS: u32 = M::STEPS;

    /// The initial state, loops closed.
    #[inline(never)]
    fn assembled() -> Result<Self, Error> {
        let robot = M::default();
        let state = robot.assembled()?;
        let rk4 = Rk4::new(&robot);
        Ok(Self { robot, state, rk4 })
    }

    /// Advances the motion by a step of the classical Runge-Kutta method, with projection.
    #[inline(never)]
    fn step(&mut self) -> Result<(), Error> {
        self.rk4.step(&self.robot, &mut self.state, M::Scalar::from_f64(M::STEP))
    }

    /// q, then u (m, rad, s).
    fn coordinates(&self) -> impl Iterator<Item = M::Scalar> {
        self.state.q.as_ref().iter().chain(self.state.u.as_ref()).copied()
    }
}

impl<M: Robot> Motion<M> {
    /// The number of contact points.
    pub fn contacts(&self) -> usize {
        self.robot.dimensions().contacts
    }

    /// Writes position (m) and force (N) of each contact point, six numbers per point.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    pub fn write_contacts(&self, out: &mut [M::Scalar]) -> Result<(), Error> {
        let StateOf::<M> { t, q, u } = &self.state;
        self.robot.write_contacts(*t, q.as_ref(), u.as_ref(), out)
    }
}
