//! A motion on its way: which method integrates it, when to give up, when to stop.

use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueEnum;
use lamc_runtime::{Dopri5, Error, Integrator, Rodas, State, Stopped, System, acceleration};
use lamc_workbench::execution::Jit;
use lamc_workbench::motion::{Audit, Motion, Work};

use super::start::describe;
use super::suspect::suspect;
use super::{Failed, fail};

/// Explicit steps within which a motion must get on by a share of its duration.
const PATIENCE: (usize, f64) = (1000, 0.01);

/// More steps than any smooth motion takes.
const MOST_STEPS: f64 = 2e6;

/// What both are meant for, s: a longer motion may take as many for each such part of it.
const USUAL: f64 = 2.0;

/// What may be spent to leave a singular state, steps times joints cubed: one or two seconds.
const MOST_TO_LEAVE: f64 = 5e6;
/// Loops whose joints are all this near to zero, rad, lie flat.
const FLAT: f64 = 1e-2;

/// Advice for a motion that starts there.
const FOLD_FIRST: &str = "; out of a flat sheet, start from a folded guess (--initial)";

/// How near to its limit a joint may have struck it, rad.
const STOP: f64 = 1e-6;

/// Whether the user asked to stop.
pub static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// How to integrate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Explicit, and implicit from where the motion turns out to be stiff
    #[default]
    Auto,
    /// Dormand and Prince's pair of order 5(4), explicit
    Dopri5,
    /// RODASP of order 4(3), implicit and L-stable
    Rodas,
}

/// How to run a motion.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    pub method: Method,
    /// s.
    pub duration: f64,
    /// Error allowed per step, relative and absolute.
    pub tolerance: f64,
    /// Share of its speed with which a joint leaves a stop.
    pub restitution: f64,
}

/// Whether the loops are loose in a direction more than they usually are, as in the flat state.
/// Which branch the motion leaves by is for the implicit method to find.
fn is_singular(system: &Stopped<Jit>, state: &State<Vec<f64>, f64>) -> bool {
    let d = system.dimensions();
    let mut rates = system.vector();
    let found =
        acceleration(system, state.t, &state.q, &state.u, &mut system.workspace(), &mut rates);
    let usual = system.system.interface().rank + d.drives;
    found.is_ok_and(|constraint| constraint.rank < usual.min(d.coordinates))
}

/// A motion on its way.
pub struct Run {
    system: Stopped<Jit>,
    state: State<Vec<f64>, f64>,
    explicit: Dopri5<Stopped<Jit>>,
    implicit: Rodas<Stopped<Jit>>,
    method: Method,
    /// Whether the implicit method is only to lead out of a singular state.
    leaves: bool,
    duration: f64,
    pub explicit_steps: usize,
    pub implicit_steps: usize,
    /// Steps and the time, s, when progress was last looked at.
    mark: (usize, f64),
    pub motion: Motion,
    /// Of torques and dampers, while nothing else changes the energy.
    pub work: Option<Work>,
    /// Whether energy appears beyond that work.
    audit: Audit,
    /// Joints that were at a stop.
    pub stopped: Vec<bool>,
}

impl Run {
    /// About to set off from a state, at which the system is closed.
    pub fn new(
        system: Jit,
        state: State<Vec<f64>, f64>,
        work: Option<Work>,
        settings: &Settings,
    ) -> Self {
        let motion = Motion::new(system.interface());
        let audit = Audit::new(&system, &state, settings.tolerance);
        let stopped = vec![false; state.q.len()];
        let mut system = Stopped::new(system);
        system.restitution = settings.restitution;
        let leaves = settings.method == Method::Auto && is_singular(&system, &state);
        let method = if leaves { Method::Rodas } else { settings.method };
        let (mut explicit, mut implicit) = (Dopri5::new(&system), Rodas::new(&system));
        (explicit.relative, explicit.absolute) = (settings.tolerance, settings.tolerance);
        (implicit.relative, implicit.absolute) = (settings.tolerance, settings.tolerance);
        Self {
            system,
            state,
            explicit,
            implicit,
            method,
            leaves,
            duration: settings.duration,
            explicit_steps: 0,
            implicit_steps: 0,
            mark: (0, 0.0),
            motion,
            work,
            audit,
            stopped,
        }
    }

    /// Runs through ascending times, s, and records the state at each, until the last or until
    /// the user asks to stop; shows how many have been recorded.
    pub fn through(
        &mut self,
        times: impl Iterator<Item = f64>,
        mut show: impl FnMut(usize),
    ) -> Result<(), Failed> {
        for (sample, t) in times.enumerate() {
            if !self.advance(t)? {
                break;
            }
            self.record()?;
            show(sample + 1);
        }
        Ok(())
    }

    /// To a time, s; false when the user asked to stop before.
    fn advance(&mut self, t: f64) -> Result<bool, Failed> {
        while self.state.t < t {
            if INTERRUPTED.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let before = self.work.as_ref().map(|_| self.state.clone());
            let outcome = match self.method {
                Method::Rodas => {
                    self.implicit_steps += 1;
                    self.system.step(&mut self.implicit, &mut self.state, t)
                }
                Method::Auto | Method::Dopri5 => {
                    self.explicit_steps += 1;
                    self.system.step(&mut self.explicit, &mut self.state, t)
                }
            };
            if outcome.is_ok() {
                self.add_work(before)?;
            }
            if self.is_hopeless() {
                return Err(fail(format_args!(
                    "gave up after {} steps, at t = {} s: the motion is not smooth there, or \
                     --tolerance asks for too much{}; {}",
                    self.explicit_steps + self.implicit_steps,
                    self.state.t,
                    if self.started_flat() { FOLD_FIRST } else { "" },
                    suspect(&self.system, &self.state)
                )));
            }
            if self.leaves && !is_singular(&self.system, &self.state) {
                (self.leaves, self.method) = (false, Method::Auto);
                self.mark = (self.explicit_steps + self.implicit_steps, self.state.t);
            }
            if self.leaves
                && self.implicit_steps as f64 * (self.state.q.len() as f64).powi(3) > MOST_TO_LEAVE
            {
                return Err(fail(format_args!(
                    "gave up at t = {} s: it does not leave the singular state in which it started, \
                     such as flat, where it can move in many ways; start it from a folded guess \
                     (--initial); {}",
                    self.state.t,
                    suspect(&self.system, &self.state)
                )));
            }
            let gives_up = matches!(outcome, Err(Error::StepTooSmall { .. }));
            let stuck = self.explicit.is_stiff() || self.is_slow();
            if self.method == Method::Auto && (gives_up || stuck) {
                self.method = Method::Rodas;
                continue;
            }
            outcome.map_err(|error| self.explain(&error))?;
            for (stopped, &side) in self.stopped.iter_mut().zip(&self.system.sides) {
                *stopped |= side != 0.0;
            }
        }
        Ok(true)
    }

    /// Adds the work of the step from `before`. A stop takes energy, too: from then on it is not
    /// known. Fails where energy appears that nothing feeds.
    fn add_work(&mut self, before: Option<State<Vec<f64>, f64>>) -> Result<(), Failed> {
        let (Some(work), Some(before)) = (&mut self.work, before) else { return Ok(()) };
        let is_at_stop = self.state.q.iter().enumerate().any(|(joint, &q)| {
            let [least, greatest] = self.system.limits(joint);
            q <= least + STOP || q >= greatest - STOP
        });
        let middle = 0.5 * (before.t + self.state.t);
        let middle = match self.method {
            Method::Rodas => self.implicit.between(&self.system, middle),
            Method::Auto | Method::Dopri5 => self.explicit.between(&self.system, middle),
        };
        match middle {
            Ok(middle) if !is_at_stop => work.add([&before, &middle, &self.state]),
            _ => {
                self.work = None;
                return Ok(());
            }
        }
        match self.audit.look(&self.system, &before, &self.state, work) {
            None => Ok(()),
            Some(gain) => Err(fail(format_args!(
                "energy appears that nothing feeds: {:.3e} J by t = {:.6} s, where the largest \
                 kinetic energy is {:.3e} J; either the equations of a loop contradict each other, \
                 as where hinge lines nearly have a direction or a point in common (see `lamc \
                 check`, and `tolerance:` in the model), or the motion cannot pass a flat or \
                 otherwise singular state (start folded: --initial)",
                gain.energy, self.state.t, gain.largest_kinetic
            ))),
        }
    }

    /// Records the state as it is.
    pub fn record(&mut self) -> Result<(), Failed> {
        let outcome = self.motion.record(&self.system, &self.state);
        outcome.map_err(|error| self.explain(&error))
    }

    /// Whether it set off from a sheet with loops that lay flat.
    fn started_flat(&self) -> bool {
        let first = self.motion.samples.first();
        let is_flat = first.is_some_and(|sample| sample.q.iter().all(|q| q.abs() < FLAT));
        is_flat && self.system.dimensions().loops > 0
    }

    /// Whether the implicit method, too, hardly gets on: at this pace it would take far more steps
    /// than any smooth motion.
    fn is_hopeless(&mut self) -> bool {
        let steps = self.explicit_steps + self.implicit_steps;
        if self.method != Method::Rodas || steps - self.mark.0 < PATIENCE.0 {
            return steps as f64 >= MOST_STEPS * (self.duration / USUAL).max(1.0);
        }
        let gone = self.state.t - self.mark.1;
        let pace = (steps - self.mark.0) as f64 / gone;
        self.mark = (steps, self.state.t);
        pace * self.duration.min(USUAL) > MOST_STEPS
    }

    /// Whether the explicit method hardly gets on, as between the ranks of a singular state.
    fn is_slow(&mut self) -> bool {
        let (steps, share) = PATIENCE;
        let now = self.explicit_steps + self.implicit_steps;
        if self.method == Method::Rodas || now - self.mark.0 < steps {
            return false;
        }
        let gone = self.state.t - self.mark.1;
        self.mark = (now, self.state.t);
        gone < share * self.duration.min(USUAL)
    }

    /// An error with the joints that were at a stop.
    fn explain(&self, error: &Error) -> Failed {
        let interface = self.system.system.interface();
        let mut reason = describe(error, interface);
        let is_at_stop = self.system.sides.iter().any(|&side| side != 0.0);
        if matches!(error, Error::StepTooSmall { .. }) && !is_at_stop {
            let advice = if self.started_flat() { FOLD_FIRST } else { "" };
            reason = format!("{reason}: {}{advice}", suspect(&self.system, &self.state));
        }
        let held =
            interface.joints.iter().zip(&self.system.sides).filter(|(_, side)| **side != 0.0);
        let names: Vec<_> = held.map(|(joint, _)| format!("`{}`", joint.name)).collect();
        match names.is_empty() {
            true if matches!(error, Error::StepTooSmall { .. }) => fail(reason),
            true => fail(format_args!("{reason}, at t = {} s", self.state.t)),
            false => {
                let names = names.join(", ");
                fail(format_args!("{reason}, at t = {} s with {names} at a stop", self.state.t))
            }
        }
    }
}
