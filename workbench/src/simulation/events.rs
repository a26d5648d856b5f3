//! Events: times at which a function of the state changes its sign.
//!
//! After each step the sign is compared with the one before. Where it differs, the time of the change is
//! bracketed on the continuous extension of the step and found by the ITP method (I. Oliveira,
//! R. Takahashi, "An Enhancement of the Bisection Method Average Performance Preserving Minmax
//! Optimality", 2020), which takes at most one evaluation more than bisection. A function that changes
//! its sign twice within a step is not seen; steps never reach beyond the next sample.

use lamc::arithmetic::powi;
use lamc_runtime::State;

use super::{Simulation, SimulationError};

/// The bracket of a change is made this short, relative to the time.
const RESOLUTION: f64 = 4.0 * f64::EPSILON;
/// The weights of truncation of the ITP method: the first relative to the first bracket.
const TRUNCATION: (f64, i32) = (0.2, 2);

/// What is watched: it returns `None` to interrupt the simulation. Its arguments are the state and the inputs, SI.
pub type Watched = Box<dyn FnMut(&State<Vec<f64>, f64>, &[f64]) -> Option<f64> + Send>;

/// Which changes of sign count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// All.
    #[default]
    Either,
    /// From negative to positive.
    Rising,
    /// From positive to negative.
    Falling,
}

/// A function whose changes of sign are recorded. From zero, as at the start of a motion, it does not change.
pub struct Event {
    /// The function.
    pub function: Watched,
    /// Which changes count.
    pub direction: Direction,
    /// The motion ends at the change of this number, from 1 on.
    pub ends_at: Option<usize>,
}

/// An event and what is known of it so far.
pub(super) struct Watch {
    event: Event,
    /// Its value at the state that was reached; `None` before the first look.
    value: Option<f64>,
    found: Vec<State<Vec<f64>, f64>>,
}

/// How far a simulation got.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reached {
    /// The time that was asked for.
    Time,
    /// An event that ends the motion, before or at that time.
    Event,
    /// Neither, because it was interrupted.
    Interrupted,
}

/// Why a look at an event is not completed.
enum Halt {
    Interrupted,
    /// Its function gives no number at this time, s.
    NoValue(f64),
    Failed(SimulationError),
}

impl Watch {
    /// Whether it has not been looked at yet.
    pub(super) fn is_new(&self) -> bool {
        self.value.is_none()
    }

    fn value_at(&mut self, state: &State<Vec<f64>, f64>, inputs: &[f64]) -> Result<f64, Halt> {
        match (self.event.function)(state, inputs) {
            Some(value) if value.is_nan() => Err(Halt::NoValue(state.t)),
            Some(value) => Ok(value),
            None => Err(Halt::Interrupted),
        }
    }

    /// Whether the sign changes between two values in a way that counts.
    fn counts(&self, before: f64, after: f64) -> bool {
        let (rises, falls) = (before < 0.0 && after >= 0.0, before > 0.0 && after <= 0.0);
        match self.event.direction {
            Direction::Either => rises || falls,
            Direction::Rising => rises,
            Direction::Falling => falls,
        }
    }
}

impl Simulation {
    /// Looks for an event from the state that was reached on. Events are numbered in the order of these calls.
    pub fn watch(&mut self, event: Event) {
        self.watches.push(Watch { event, value: None, found: Vec::new() });
    }

    /// The states just after the changes of each event, by time.
    pub fn events(&self) -> impl Iterator<Item = &[State<Vec<f64>, f64>]> {
        self.watches.iter().map(|watch| &*watch.found)
    }

    /// Records the events of the step that began at `begin`, s, with joints held at these sides. If one of them ends
    /// the motion, the state becomes that of the event. Without a step: the first values.
    pub(super) fn look(&mut self, begin: f64, sides: &[f64]) -> Result<Reached, SimulationError> {
        let inputs = self.system.system.inputs().to_vec();
        let mut watches = std::mem::take(&mut self.watches);
        let mut changes = Vec::new();
        let outcome = watches.iter_mut().enumerate().try_for_each(|(index, watch)| {
            let found = self.change(watch, begin, &inputs).map_err(|halt| (index, halt))?;
            changes.extend(found.map(|state| (index, state)));
            Ok(())
        });
        changes.sort_by(|(_, a), (_, b)| a.t.total_cmp(&b.t));
        let mut reached = Reached::Time;
        for (index, state) in changes {
            let Watch { event, found, .. } = &mut watches[index];
            found.push(state.clone());
            if event.ends_at == Some(found.len()) {
                self.state = state;
                self.system.sides.copy_from_slice(sides);
                reached = Reached::Event;
                break;
            }
        }
        self.watches = watches;
        match outcome {
            Ok(()) => Ok(reached),
            Err((_, Halt::Interrupted)) => Ok(Reached::Interrupted),
            Err((event, Halt::NoValue(t))) => Err(SimulationError::NoValue { event, t }),
            Err((_, Halt::Failed(error))) => Err(error),
        }
    }

    /// The state just after the change of an event within the step that began at `begin`, s, if it changed.
    fn change(
        &mut self,
        watch: &mut Watch,
        begin: f64,
        inputs: &[f64],
    ) -> Result<Option<State<Vec<f64>, f64>>, Halt> {
        let after = watch.value_at(&self.state, inputs)?;
        let Some(before) = watch.value.replace(after).filter(|&it| watch.counts(it, after)) else {
            return Ok(None);
        };
        let end = self.state.t;
        let mut at = |simulation: &mut Self, t: f64| {
            let state = simulation.between(t).map_err(Halt::Failed)?;
            let value = watch.value_at(&state, inputs)?;
            Ok((state, before.signum() * value))
        };
        // The inputs may have changed it at the start of the step, and an impact at the end.
        let (first, low) = at(self, begin)?;
        if low <= 0.0 {
            return Ok(Some(first));
        }
        let (mut latest, high) = at(self, end)?;
        if high > 0.0 {
            return Ok(Some(self.state.clone()));
        }
        let mut bracket = Bracket::new([begin, end], [low, high]);
        while let Some(t) = bracket.guess() {
            let (state, value) = at(self, t)?;
            if bracket.narrow(t, value) {
                latest = state;
            }
        }
        Ok(Some(latest))
    }

    /// The state at a time within the last step, s.
    fn between(&mut self, t: f64) -> Result<State<Vec<f64>, f64>, SimulationError> {
        self.extension(t).map_err(|error| self.failure(&error))
    }
}

/// Two times between which a function falls through zero, and its values there.
struct Bracket {
    times: [f64; 2],
    values: [f64; 2],
    /// The length of the first bracket, s, and the longest that is allowed now by bisection.
    first: f64,
    allowed: f64,
}

impl Bracket {
    fn new(times: [f64; 2], values: [f64; 2]) -> Self {
        let first = times[1] - times[0];
        // One evaluation more than bisection would take.
        Self { times, values, first, allowed: 2.0 * first }
    }

    /// Where to look next; `None` when the bracket is short enough.
    fn guess(&mut self) -> Option<f64> {
        let ([a, b], [low, high]) = (self.times, self.values);
        let (middle, length) = (a + 0.5 * (b - a), b - a);
        if length <= RESOLUTION * b.abs() || !(middle > a && middle < b) || high == 0.0 {
            return None;
        }
        let secant = a + length * (low / (low - high));
        let (weight, power) = TRUNCATION;
        let truncated = weight / self.first * powi(length, power);
        let sign = (middle - secant).signum();
        let nearer = match truncated <= (middle - secant).abs() {
            true => secant + sign * truncated,
            false => middle,
        };
        self.allowed *= 0.5;
        let radius = (self.allowed - 0.5 * length).max(0.0);
        let next = match (nearer - middle).abs() <= radius {
            true => nearer,
            false => middle - sign * radius,
        };
        Some(if next > a && next < b { next } else { middle })
    }

    /// Takes the value at a time. Returns whether it is the later end now.
    fn narrow(&mut self, t: f64, value: f64) -> bool {
        let end = usize::from(value <= 0.0);
        (self.times[end], self.values[end]) = (t, value);
        end == 1
    }
}
