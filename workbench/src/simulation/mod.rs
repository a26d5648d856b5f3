//! A simulation: which method integrates a motion, when to change it, when to give up.
//!
//! ```no_run
//! use lamc_workbench::execution::Jit;
//! use lamc_workbench::simulation::{Settings, Simulation};
//! use lamc_runtime::{State, Mechanism, assemble};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let file = lamc::source::SourceFile::read("examples/sixbar.yaml")?;
//! let system = Jit::new(&lamc::pipeline::compile(&file)?.program);
//! let mut state = system.initial();
//! let pinned: Vec<bool> = (0..system.dimensions().joints).map(|joint| system.is_pinned(joint)).collect();
//! assemble(&system, 0.0, &mut state.q, &pinned, &mut system.workspace())?;
//! let mut simulation = Simulation::new(system, state, None, &Settings::default())?;
//! simulation.run((0..=100).map(|i| f64::from(i) * 0.01), || false, |_| ())?;
//! println!("{}", simulation.motion().to_csv());
//! # Ok(())
//! # }
//! ```

mod control;
mod error;
mod events;
mod infinitesimal;
mod pace;
mod plates;
mod samples;
mod start;
mod steps;
mod suspect;
mod switches;
#[cfg(test)]
mod tests;
mod unfold;

pub use error::{SimulationError, describe};
pub use events::{Direction, Event, Reached, Watched};
pub use infinitesimal::{Held, Infinitesimal};
pub use samples::{TooMany, sample_times};
pub use start::{Asked, allowed, lost_fold, moves, start};
pub use unfold::{Fold, unfold};

use lamc_runtime::{Dopri5, Error, Mechanism, Rodas, State, Stopped};

use crate::execution::Jit;
use crate::motion::{Audit, Motion, Tensions, Work};
use control::Control;
use events::Watch;
use pace::Pace;
use plates::Plates;
use steps::RigidSteps;
pub use steps::Steps;
use suspect::{is_at_stop, is_singular, suspect};
use switches::Switches;

/// What may be spent to leave a singular state, steps times joints cubed: one or two seconds.
const MOST_TO_LEAVE: f64 = 5e6;

/// How to integrate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Method {
    /// The explicit method, and the implicit one from where the motion turns out to be stiff.
    #[default]
    Auto,
    /// The explicit pair of order 5(4) of Dormand and Prince.
    Dopri5,
    /// RODASP of order 4(3), which is implicit and L-stable.
    Rodas,
    /// Rigid contacts and stops at steps of fixed length, of order 1.
    Rigid {
        /// The length of a step, s.
        step: f64,
    },
}

/// How to run a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The method.
    pub method: Method,
    /// The time at which the motion is meant to end, s: it decides when progress is too slow.
    pub duration: f64,
    /// The error allowed per step, relative and absolute (rad, rad/s).
    pub tolerance: f64,
    /// The share of its speed with which a joint leaves a stop.
    pub restitution: f64,
}

impl Default for Settings {
    /// One second, with the tolerance of `lamc simulate`, without a rebound at stops.
    fn default() -> Self {
        Self { method: Method::Auto, duration: 1.0, tolerance: TOLERANCE, restitution: 0.0 }
    }
}

/// The error allowed per step unless another is chosen, relative and absolute (rad, rad/s).
pub const TOLERANCE: f64 = 1e-8;

/// A simulation of a mechanism in process.
pub struct Simulation {
    system: Stopped<Jit>,
    state: State<Vec<f64>, f64>,
    explicit: Dopri5<Stopped<Jit>>,
    implicit: Rodas<Stopped<Jit>>,
    rigid: RigidSteps,
    method: Method,
    /// Whether the implicit method is only to lead out of a singular state.
    leaves: bool,
    steps: Steps,
    pace: Pace,
    motion: Motion,
    tensions: Tensions,
    work: Option<Work>,
    audit: Audit,
    stopped: Vec<bool>,
    watches: Vec<Watch>,
    plates: Option<Plates>,
    switches: Option<Switches>,
    /// The state on the other side of the surface at which the last step ended.
    beyond: Option<State<Vec<f64>, f64>>,
    control: Control,
}

impl Simulation {
    /// A simulation that starts from `state`, at which the loops of the system are closed. With
    /// `work`, as [`Work::new`] gives it, the energy is audited after every step.
    ///
    /// # Errors
    /// [`Error::LeftOut`] if the program has no function for the energy.
    pub fn new(
        system: Jit,
        state: State<Vec<f64>, f64>,
        work: Option<Work>,
        settings: &Settings,
    ) -> Result<Self, Error> {
        let motion = Motion::new(system.interface());
        let is_rigid = matches!(settings.method, Method::Rigid { .. });
        let work = work.filter(|_| !is_rigid);
        let control = Control::new(&system, state.t);
        let audit = Audit::new(&system, &state, settings.tolerance)?;
        let stopped = vec![false; system.interface().joints.len()];
        let mut system = Stopped::new(system);
        system.restitution = settings.restitution;
        let leaves = settings.method == Method::Auto && is_singular(&system, &state);
        let method = if leaves { Method::Rodas } else { settings.method };
        let (mut explicit, mut implicit) = (Dopri5::new(&system), Rodas::new(&system));
        (explicit.relative, explicit.absolute) = (settings.tolerance, settings.tolerance);
        (implicit.relative, implicit.absolute) = (settings.tolerance, settings.tolerance);
        let rigid = RigidSteps::new(&system, &state, settings.restitution);
        // Rigid contacts look ahead by themselves.
        let plates = if is_rigid { None } else { Plates::new(&system.system, &state.q)? };
        let switches = if is_rigid { None } else { Switches::new(&system.system) };
        Ok(Self {
            system,
            state,
            explicit,
            implicit,
            rigid,
            method,
            leaves,
            steps: Steps::default(),
            pace: Pace::new(settings.duration),
            motion,
            tensions: Tensions::default(),
            work,
            audit,
            stopped,
            watches: Vec::new(),
            plates,
            switches,
            beyond: None,
            control,
        })
    }

    /// Runs through ascending times, s, and records the state at each; a time that has been
    /// reached already is recorded at once. Ends before the last time when `is_interrupted` says
    /// so, which is asked before every step, and with a last sample at an [`Event`] that ends the motion.
    /// `recorded` is told the number of samples so far. Afterwards [`Motion::complete`] says whether the
    /// motion was interrupted.
    ///
    /// # Errors
    /// Where the motion cannot be continued; the samples recorded until then are good.
    pub fn run(
        &mut self,
        times: impl IntoIterator<Item = f64>,
        mut is_interrupted: impl FnMut() -> bool,
        mut recorded: impl FnMut(usize),
    ) -> Result<(), SimulationError> {
        self.motion.complete = false;
        for t in times {
            let reached = self.reach(t, &mut is_interrupted)?;
            if reached == Reached::Interrupted {
                return Ok(());
            }
            self.record().map_err(|error| self.failure(&error))?;
            recorded(self.motion.samples.len());
            if reached == Reached::Event {
                break;
            }
        }
        self.motion.complete = true;
        Ok(())
    }

    /// Integrates to a time, s, or to an event that ends the motion, and records no sample. Controllers act on the way
    /// and at that time. Interrupted as [`run`](Self::run) is.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn reach(
        &mut self,
        t: f64,
        mut is_interrupted: impl FnMut() -> bool,
    ) -> Result<Reached, SimulationError> {
        self.act()?;
        while self.state.t < t {
            let until = self.control.until(&self.system.system, t);
            let reached = self.reach_held(until, &mut is_interrupted)?;
            if reached != Reached::Time {
                return Ok(reached);
            }
            self.act()?;
        }
        Ok(Reached::Time)
    }

    /// As [`reach`](Self::reach), with constant inputs.
    fn reach_held(
        &mut self,
        t: f64,
        is_interrupted: &mut impl FnMut() -> bool,
    ) -> Result<Reached, SimulationError> {
        while self.state.t < t {
            if is_interrupted() {
                return Ok(Reached::Interrupted);
            }
            if self.watches.iter().any(Watch::is_new)
                && self.look(self.state.t, &[])? != Reached::Time
            {
                return Ok(Reached::Interrupted);
            }
            self.switch_at_once(t);
            if self.state.t >= t {
                break;
            }
            let (begin, sides) = (self.state.t, self.system.sides.clone());
            let before = self.work.as_ref().map(|_| self.state.clone());
            let outcome = self.step_to_surface(t);
            if outcome.is_ok() {
                self.add_work(before)?;
                self.cross();
                let reached = self.look(begin, &sides)?;
                if reached != Reached::Time {
                    return Ok(reached);
                }
            }
            self.check_progress()?;
            let gives_up = matches!(outcome, Err(Error::StepTooSmall { .. }));
            if self.method == Method::Auto && (gives_up || self.is_stuck()) {
                self.method = Method::Rodas;
                continue;
            }
            outcome.map_err(|error| self.failure(&error))?;
            for (stopped, &side) in self.stopped.iter_mut().zip(&self.system.sides) {
                *stopped |= side != 0.0;
            }
            if let Method::Rigid { .. } = self.method {
                self.rigid.note_stops(&self.system, &mut self.stopped);
            }
        }
        Ok(Reached::Time)
    }

    /// What moves.
    pub fn system(&self) -> &Jit {
        &self.system.system
    }

    /// The state that was reached.
    pub fn state(&self) -> &State<Vec<f64>, f64> {
        &self.state
    }

    /// What has been recorded.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// The steps taken so far.
    pub fn steps(&self) -> Steps {
        self.steps
    }

    /// The work of torques and dampers, as long as nothing else has changed the energy.
    pub fn work(&self) -> Option<&Work> {
        self.work.as_ref()
    }

    /// For each joint, whether it was at a stop at some time.
    pub fn stopped(&self) -> &[bool] {
        &self.stopped
    }

    /// One step of the present method, to `t` at most, s.
    fn step(&mut self, t: f64) -> Result<(), Error> {
        match self.method {
            Method::Rodas => {
                self.steps.implicit += 1;
                self.system.step_with(&mut self.implicit, &mut self.state, t)
            }
            Method::Rigid { step } => {
                self.steps.rigid += 1;
                let taken = self.rigid.step(&self.system, &mut self.state, t, step);
                self.steps.unsolved = self.rigid.unsolved();
                taken
            }
            Method::Auto | Method::Dopri5 => {
                self.steps.explicit += 1;
                self.system.step_with(&mut self.explicit, &mut self.state, t)
            }
        }
    }

    /// Whether the explicit method makes too little progress: the motion is stiff, or lies between
    /// the ranks of a singular state.
    fn is_stuck(&mut self) -> bool {
        self.explicit.is_stiff()
            || (self.method != Method::Rodas && self.pace.is_slow(self.steps.total(), self.state.t))
    }

    /// Gives up where the motion hardly advances; returns to the explicit method where the motion
    /// has left the singular state in which it started.
    fn check_progress(&mut self) -> Result<(), SimulationError> {
        let (steps, t) = (self.steps.total(), self.state.t);
        if let Method::Rigid { .. } = self.method {
            return Ok(());
        }
        if self.pace.is_hopeless(steps, t, self.method == Method::Rodas) {
            let suspect = suspect(&self.system, &self.state);
            let started_flat = self.started_flat();
            return Err(SimulationError::NotSmooth { steps, t, started_flat, suspect });
        }
        if self.leaves && !is_singular(&self.system, &self.state) {
            (self.leaves, self.method) = (false, Method::Auto);
            self.pace.restart(steps, t);
        }
        let spent = self.steps.implicit as f64 * (self.state.u.len() as f64).powi(3);
        if self.leaves && spent > MOST_TO_LEAVE {
            let suspect = suspect(&self.system, &self.state);
            return Err(SimulationError::StaysSingular { t, suspect });
        }
        Ok(())
    }

    /// Adds the work of the step from `before`. A stop takes energy, too: from then on the work is
    /// not known.
    fn add_work(&mut self, before: Option<State<Vec<f64>, f64>>) -> Result<(), SimulationError> {
        let Some(before) = before else { return Ok(()) };
        let middle = self.extension(0.5 * (before.t + self.state.t));
        let Some(work) = &mut self.work else { return Ok(()) };
        let touches = self.state.q.iter().enumerate();
        let touches = touches.map(|(joint, &q)| is_at_stop(self.system.limits(joint), q));
        match middle {
            Ok(middle) if !touches.into_iter().any(|touches| touches) => {
                work.add([&before, &middle, &self.state]);
            }
            _ => {
                self.work = None;
                return Ok(());
            }
        }
        match self.audit.look(&self.system, &before, &self.state, work) {
            Ok(None) => Ok(()),
            Ok(Some(gain)) => Err(SimulationError::EnergyGain { gain, t: self.state.t }),
            Err(error) => Err(self.failure(&error)),
        }
    }
}
