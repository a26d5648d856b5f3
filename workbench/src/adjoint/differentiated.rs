//! A mechanism whose functions can be differentiated in reverse mode.

use std::cell::RefCell;
use std::fmt;
use std::sync::Arc;

use lamc::program::{Engine as _, FunctionKind, Interface, Program, Slot};
use lamc_runtime::constants::{SAFE_CONDITIONING, WEAK_SHARE};
use lamc_runtime::plumbing::{Margin, ProjectionMut};
use lamc_runtime::{Error, JacobianMut, Mechanism as _};

use super::motion::MOST_STEPS;
use super::reverse::{Layout, Places, Reversed, weight};
use crate::execution::{Jit, MachineCode};
use crate::simulation::describe;

/// Why there is no derivative of a motion.
#[derive(Clone, Debug, PartialEq)]
pub enum Undifferentiable {
    /// The motion itself cannot be continued.
    Motion {
        /// The time, s.
        t: f64,
        /// The reason.
        error: Error,
    },
    /// The mechanism is so close to a singular state that its acceleration is not determined by the state alone.
    Singular {
        /// The time, s.
        t: f64,
    },
    /// A joint comes to a stop.
    Stop {
        /// The time, s.
        t: f64,
        /// The joint.
        joint: usize,
    },
    /// An adjoint is not finite.
    NotFinite,
    /// No number of steps that is allowed is accurate.
    TooManySteps,
}

impl Undifferentiable {
    /// The reason as a text, with the names of the mechanism.
    pub fn describe(&self, interface: &Interface) -> String {
        match self {
            Self::Motion { t, error } => {
                format!("the motion ends at {t} s: {}", describe(error, interface))
            }
            Self::Singular { t } => format!(
                "the mechanism is next to a singular state at {t} s, where derivatives of a motion are not defined"
            ),
            Self::Stop { t, joint } => format!(
                "`{}` comes to its stop at {t} s, and derivatives of motions do not handle stops",
                interface.joints[*joint].name
            ),
            Self::TooManySteps => format!(
                "{MOST_STEPS} steps from one sample to the next are not accurate enough: is the mechanism stiff, or does the \
                 motion have jumps?"
            ),
            Self::NotFinite => "a derivative of the motion is not finite".to_owned(),
        }
    }
}

/// Time and state at which a function is differentiated.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// s.
    pub t: f64,
    /// The coordinates, NQ.
    pub q: &'a [f64],
    /// The speeds, NU.
    pub u: &'a [f64],
}

/// Adjoints: of a number that depends on a motion, the derivatives by a state of it, and by what does not change with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Adjoints {
    /// By q, NQ, and then by u, NU.
    pub state: Vec<f64>,
    /// By the parameters, the inputs, and the numbers of the drawing.
    pub rest: Vec<f64>,
}

impl Adjoints {
    /// Zeros.
    pub fn zeros(layout: Layout) -> Self {
        Self { state: vec![0.0; layout.state()], rest: vec![0.0; layout.rest()] }
    }

    /// Adds others.
    pub fn add(&mut self, shares: &Self) {
        for (sums, shares) in [(&mut self.state, &shares.state), (&mut self.rest, &shares.rest)] {
            sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share);
        }
    }

    /// Makes them invalid, so that no gradient comes of them.
    pub fn spoil(&mut self) {
        self.state.fill(f64::NAN);
    }
}

/// A mechanism with its functions in reverse mode.
#[derive(Clone)]
pub struct Differentiated {
    /// The mechanism, with its parameters and inputs.
    pub system: Jit,
    /// The order of adjoints.
    pub layout: Layout,
    reversed: MachineCode,
    places: Arc<[Places]>,
    /// What the function that was evaluated last has written.
    written: RefCell<Vec<f64>>,
}

impl fmt::Debug for Differentiated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Differentiated").field("system", &self.system).finish_non_exhaustive()
    }
}

impl Differentiated {
    /// Differentiates the functions of a program, which is the one of `system`.
    pub fn new(program: &Program, system: Jit) -> Self {
        let Reversed { program, places } = Reversed::of(program);
        Self {
            layout: Layout::of(&program.interface),
            reversed: MachineCode::new(&program),
            places: places.into(),
            written: RefCell::default(),
            system,
        }
    }

    /// The same mechanism with other parameters and inputs, those of `system`.
    #[must_use]
    pub fn with(&self, system: Jit) -> Self {
        Self { system, ..self.clone() }
    }

    /// Compiles what a motion needs now, instead of after some hundred calls.
    pub fn compile(&self) {
        let kinds = [FunctionKind::Acceleration, FunctionKind::Projection];
        self.system.engine().compile(&kinds);
        self.reversed.compile(&kinds);
    }

    /// Adds to `adjoints` those of what a function reads, with given adjoints of its outputs.
    pub fn pull(&self, kind: FunctionKind, at: At<'_>, outputs: &[f64], adjoints: &mut Adjoints) {
        let Places { state, rest } = &self.places[kind as usize];
        let load = |slot: Slot| match slot {
            Slot::Time => at.t,
            Slot::Position(id) => at.q[id.index()],
            Slot::Rate(id) => at.u[id.index()],
            Slot::Parameter(id) => self.system.parameters()[id.index()],
            Slot::Input(id) => self.system.inputs()[id.index()],
            Slot::Drawn(place) => self.system.drawing()[place],
            slot => {
                debug_assert_eq!(slot, weight(slot.place().1));
                outputs.get(slot.place().1).copied().unwrap_or(0.0)
            }
        };
        let mut written = self.written.borrow_mut();
        written.resize(state.len() + rest.len(), 0.0);
        self.reversed.run(kind, load, &mut [&mut written]);
        let (of_state, of_rest) = written.split_at(state.len());
        state.iter().zip(of_state).for_each(|(place, share)| adjoints.state[*place] += share);
        rest.iter().zip(of_rest).for_each(|(place, share)| adjoints.rest[*place] += share);
    }

    /// du/dt by elimination; whether that holds.
    ///
    /// # Errors
    /// An error of the mechanism.
    pub fn accelerate(&self, at: At<'_>, out: &mut [f64]) -> Result<bool, Undifferentiable> {
        let margin = self.system.write_acceleration(at.t, at.q, at.u, out);
        Ok(holds(at.t, margin)? && out.iter().all(|x| x.is_finite()))
    }

    /// du/dt with its derivatives by elimination; whether that holds.
    ///
    /// # Errors
    /// An error of the mechanism.
    pub fn jacobian(
        &self,
        at: At<'_>,
        out: JacobianMut<'_, f64>,
    ) -> Result<bool, Undifferentiable> {
        holds(at.t, self.system.write_jacobian(at.t, at.q, at.u, out))
    }

    /// The step of q that closes loops and the change of u that keeps them closed, both to be taken away, and the residuals;
    /// whether that holds.
    ///
    /// # Errors
    /// An error of the mechanism.
    pub fn project(
        &self,
        at: At<'_>,
        out: ProjectionMut<'_, f64>,
    ) -> Result<bool, Undifferentiable> {
        holds(at.t, self.system.write_projection(at.q, at.u, out))
    }
}

/// Whether a solution by elimination holds at a time, s.
fn holds(t: f64, margin: Result<Option<Margin<f64>>, Error>) -> Result<bool, Undifferentiable> {
    let margin = margin.map_err(|error| Undifferentiable::Motion { t, error })?;
    Ok(margin.is_some_and(|margin| {
        margin.inverse_pivot > 0.0
            && margin.conditioning > SAFE_CONDITIONING.of::<f64>()
            && margin.pivot > WEAK_SHARE
    }))
}
