//! Controllers in discrete time: at the instants 0, T, 2 T, .. they read the state, and their commands are held until the
//! next ones act (a zero-order hold). Between these instants the inputs of a mechanism are constant, so that any
//! integrator may advance it:
//!
//! ```text
//! at t = k T               commands, memory = control(t, q, u, memory)
//! at t = k T + delay       inputs = commands, or with pulse-width modulation from the next period on
//! at t = k T + i P         the upper level, for the share (command - lower) / (upper - lower) of the period P
//! ```
//!
//! [`ControlLoop`] keeps the instants: [`until`](ControlLoop::until) says how far an integrator may go, and
//! [`act`](ControlLoop::act) does what is due there. Firmware has timers instead, and calls the method `control` of the
//! module from them.

use core::ops::Range;

use crate::{Arithmetic, Error, Mechanism, Scalar, StateOf};

/// Instants that are nearer to each other than this share of the time between samples are one.
const SAME: f64 = 1e-9;
/// The rounding of a time that is computed in two ways, as a multiple of the distance between two numbers.
const ROUNDINGS: f64 = 4.0;

/// Samples can be counted up to here: beyond, a whole number is no longer a number of its own in `f64`.
const MOST: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;

/// Pulse-width modulation: in each period an input is first at the upper level and then at the lower one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pwm<S> {
    /// The period, s. It fits a whole number of times into the time between samples.
    pub period: S,
    /// The lower and the upper level of the inputs, SI.
    pub levels: [S; 2],
    /// The least and the greatest share of a period at the upper level, from 0 to 1.
    pub duty: [S; 2],
}

impl<S: Scalar> Pwm<S> {
    /// The share of a period at the upper level at which the mean of the input is the command, within the limits.
    pub fn duty(&self, command: S) -> S {
        let [lower, upper] = self.levels;
        let [least, greatest] = self.duty;
        ((command - lower) / (upper - lower)).max(least).min(greatest)
    }
}

/// A controller. Its numbers in memory and its commands follow those of the controllers before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller<S> {
    /// The time T between its samples, s.
    pub sample: S,
    /// The time from a sample to the moment at which its commands act, s: from 0 to T.
    pub delay: S,
    /// How many numbers it remembers.
    pub memory: usize,
    /// How many inputs it drives.
    pub commands: usize,
    /// How its commands are modulated, if they are.
    pub pwm: Option<Pwm<S>>,
}

/// The next instants of a controller, as counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// The next sample is at `samples` T.
    samples: u64,
    /// The next commands to act are those of the sample at `acts` T. There are none while it equals `samples`.
    acts: u64,
    /// The next period of the modulation begins at `cycles` T + `pulses` P.
    cycles: u64,
    pulses: u64,
}

/// The memory and the commands of all controllers at one sample, as a generated module returns them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control<S, const M: usize, const K: usize> {
    /// The memory at the next sample.
    pub next: [S; M],
    /// The commands, SI.
    pub commands: [S; K],
}

/// A mechanism with controllers. The compiler implements it for the type of a module.
pub trait Controlled: Mechanism {
    /// Numbers that all controllers remember.
    type Memory: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// Numbers of all commands.
    type Commands: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// A clock of each controller.
    type Clocks: Clone + AsRef<[Clock]> + AsMut<[Clock]>;

    /// The memory before the first sample.
    fn memory(&self) -> Self::Memory;
    /// As many zeros as there are commands.
    fn commands(&self) -> Self::Commands;
    /// As many clocks as there are controllers.
    fn clocks(&self) -> Self::Clocks;
    /// A controller.
    fn controller(&self, index: usize) -> Controller<Self::Scalar>;
    /// What all controllers remember at the next sample and command now, from the state and their memory.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_control(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        memory: &[Self::Scalar],
        next: &mut [Self::Scalar],
        commands: &mut [Self::Scalar],
    ) -> Result<(), Error>;
    /// Sets the input that a command drives, SI.
    fn set_command(&mut self, command: usize, value: Self::Scalar);
}

/// Controllers at work on a mechanism.
///
/// ```
/// use lamc_runtime::{ControlLoop, Controlled, Error, Rk4};
///
/// /// Advances a mechanism with controllers to a time, s, by steps of at most `dt`.
/// fn run<M: Controlled<Scalar = f64>>(robot: &mut M, end: f64, dt: f64) -> Result<(), Error> {
///     let mut state = robot.assembled()?;
///     let mut rk4 = Rk4::new(robot);
///     let mut control = ControlLoop::new(robot, state.t);
///     control.act(robot, &state)?;
///     while state.t < end {
///         let to = control.until(robot, end.min(state.t + dt));
///         let step = to - state.t;
///         rk4.step(robot, &mut state, step)?;
///         state.t = to;
///         control.act(robot, &state)?;
///     }
///     Ok(())
/// }
/// ```
#[derive(Clone, Debug)]
pub struct ControlLoop<M: Controlled> {
    memory: M::Memory,
    /// The commands of the last sample, and those that act.
    sampled: M::Commands,
    acting: M::Commands,
    /// When the modulated inputs fall to their lower level, s.
    falls: M::Commands,
    clocks: M::Clocks,
}

/// A controller with its clock, and where its numbers begin.
struct Part<S> {
    controller: Controller<S>,
    clock: Clock,
    memory: usize,
    command: usize,
}

impl<S: Scalar> Part<S> {
    /// The places of its numbers in memory.
    fn memory(&self) -> Range<usize> {
        self.memory..self.memory + self.controller.memory
    }

    /// The places of its commands.
    fn commands(&self) -> Range<usize> {
        self.command..self.command + self.controller.commands
    }

    /// The instant a T + b P, or a T + delay, s.
    fn at(&self, samples: u64, later: S) -> S {
        S::from_f64(samples as f64) * self.controller.sample + later
    }

    fn sample(&self) -> S {
        self.at(self.clock.samples, S::ZERO)
    }

    /// When the commands act that do not act yet.
    fn act(&self) -> Option<S> {
        let Clock { samples, acts, .. } = self.clock;
        (acts < samples).then(|| self.at(acts, self.controller.delay))
    }

    /// When the next period of the modulation begins.
    fn pulse(&self) -> Option<S> {
        let pulses = S::from_f64(self.clock.pulses as f64);
        self.controller.pwm.map(|pwm| self.at(self.clock.cycles, pulses * pwm.period))
    }

    /// Goes on to the period after this one.
    fn end_pulse(&mut self, pwm: &Pwm<S>) {
        self.clock.pulses += 1;
        // The last one of a sample ends where the next sample is, but for rounding.
        let half = S::from_f64(0.5) * pwm.period;
        if S::from_f64(self.clock.pulses as f64) * pwm.period > self.controller.sample - half {
            (self.clock.cycles, self.clock.pulses) = (self.clock.cycles + 1, 0);
        }
    }

    /// How far two instants at about `t` may be apart and still be one, s.
    fn same(&self, t: S) -> S {
        let rounding = S::from_f64(ROUNDINGS) * S::EPSILON * t.abs();
        S::from_f64(SAME) * self.controller.sample + rounding
    }
}

impl<M: Controlled> ControlLoop<M> {
    /// Controllers that sample for the first time at `t` (s), or at the first multiple of their T after it. Until then
    /// their commands are zero.
    pub fn new(mechanism: &M, t: M::Scalar) -> Self {
        let commands = mechanism.commands();
        let mut control = Self {
            memory: mechanism.memory(),
            sampled: commands.clone(),
            acting: commands.clone(),
            falls: commands,
            clocks: mechanism.clocks(),
        };
        let never = M::Scalar::from_f64(f64::INFINITY);
        control.falls.as_mut().fill(never);
        for index in 0..control.clocks.as_ref().len() {
            let part = control.part(mechanism, index);
            let passed = ((t - part.same(t)) / part.controller.sample).to_f64();
            // The cast saturates, at 0 for negative numbers.
            let mut first = passed as u64;
            if (first as f64) < passed {
                first = first.saturating_add(1);
            }
            control.clocks.as_mut()[index] =
                Clock { samples: first, acts: first, cycles: first, pulses: 0 };
        }
        control
    }

    /// The numbers that the controllers remember.
    pub fn memory(&self) -> &[M::Scalar] {
        self.memory.as_ref()
    }

    /// The commands that act, SI.
    pub fn commands(&self) -> &[M::Scalar] {
        self.acting.as_ref()
    }

    /// How far an integrator may go towards `t`, s: to the next time at which [`act`](Self::act) has something to do, or
    /// to `t`.
    pub fn until(&self, mechanism: &M, t: M::Scalar) -> M::Scalar {
        (0..self.clocks.as_ref().len()).fold(t, |until, index| {
            let part = self.part(mechanism, index);
            let falls = self.falls.as_ref()[part.commands()].iter().copied();
            let instants = [Some(part.sample()), part.act(), part.pulse()];
            // What is as good as `t` is due there.
            let before = t - part.same(t);
            let instants = instants.into_iter().flatten().chain(falls);
            instants
                .filter(|instant| *instant < before)
                .fold(until, |until, instant| until.min(instant))
        })
    }

    /// Does everything that is due at the time of the state: samples it, and sets inputs. Returns whether it did
    /// something: then the inputs may have changed.
    ///
    /// # Errors
    ///
    /// [`Error::Command`] if a command or a number in memory is not finite; the memory is then as before. [`Error::Time`]
    /// at a time that is no number, or that has more samples before it than can be counted.
    pub fn act(&mut self, mechanism: &mut M, state: &StateOf<M>) -> Result<bool, Error> {
        let mut acts = false;
        for index in 0..self.clocks.as_ref().len() {
            let mut part = self.part(mechanism, index);
            if !(state.t < M::Scalar::from_f64(MOST) * part.controller.sample) {
                return Err(Error::Time);
            }
            let due = state.t + part.same(state.t);
            loop {
                if part.act().is_some_and(|at| at <= due) {
                    self.take_effect(mechanism, &part);
                    part.clock.acts += 1;
                } else if part.sample() <= due {
                    if !self.sample(mechanism, &part, state)? {
                        return Err(Error::Command { controller: index });
                    }
                    part.clock.samples += 1;
                } else {
                    break;
                }
                acts = true;
            }
            acts |= self.modulate(mechanism, &mut part, due);
            self.clocks.as_mut()[index] = part.clock;
        }
        Ok(acts)
    }

    /// A controller and where its numbers begin.
    fn part(&self, mechanism: &M, index: usize) -> Part<M::Scalar> {
        let before = (0..index).map(|index| mechanism.controller(index));
        let sums = before.fold((0, 0), |(memory, command), controller| {
            (memory + controller.memory, command + controller.commands)
        });
        Part {
            controller: mechanism.controller(index),
            clock: self.clocks.as_ref()[index],
            memory: sums.0,
            command: sums.1,
        }
    }

    /// Evaluates a controller and keeps what it commands and remembers. Returns false if a number is not finite.
    fn sample(
        &mut self,
        mechanism: &M,
        part: &Part<M::Scalar>,
        state: &StateOf<M>,
    ) -> Result<bool, Error> {
        let (mut next, mut commands) = (self.memory.clone(), self.sampled.clone());
        let (q, u) = (state.q.as_ref(), state.u.as_ref());
        let memory = self.memory.as_ref();
        mechanism.write_control(state.t, q, u, memory, next.as_mut(), commands.as_mut())?;
        let (next, commands) = (&next.as_ref()[part.memory()], &commands.as_ref()[part.commands()]);
        if !commands.iter().chain(next).all(|number| number.is_finite()) {
            return Ok(false);
        }
        self.memory.as_mut()[part.memory()].copy_from_slice(next);
        self.sampled.as_mut()[part.commands()].copy_from_slice(commands);
        Ok(true)
    }

    /// The commands of the last sample act from now on.
    fn take_effect(&mut self, mechanism: &mut M, part: &Part<M::Scalar>) {
        for command in part.commands() {
            let value = self.sampled.as_ref()[command];
            self.acting.as_mut()[command] = value;
            if part.controller.pwm.is_none() {
                mechanism.set_command(command, value);
            }
        }
    }

    /// Begins and ends pulses that are due. Returns whether there was one.
    fn modulate(&mut self, mechanism: &mut M, part: &mut Part<M::Scalar>, due: M::Scalar) -> bool {
        let Some(pwm) = part.controller.pwm else { return false };
        let mut acts = false;
        while let Some(begin) = part.pulse().filter(|&begin| begin <= due) {
            acts = true;
            for command in part.commands() {
                let duty = pwm.duty(self.acting.as_ref()[command]);
                let [lower, upper] = pwm.levels;
                let is_on = duty > M::Scalar::ZERO;
                mechanism.set_command(command, if is_on { upper } else { lower });
                let ends = is_on && duty < M::Scalar::ONE;
                let never = M::Scalar::from_f64(f64::INFINITY);
                self.falls.as_mut()[command] = if ends { begin + duty * pwm.period } else { never };
            }
            part.end_pulse(&pwm);
        }
        for command in part.commands() {
            if self.falls.as_ref()[command] <= due {
                acts = true;
                mechanism.set_command(command, pwm.levels[0]);
                self.falls.as_mut()[command] = M::Scalar::from_f64(f64::INFINITY);
            }
        }
        acts
    }
}
