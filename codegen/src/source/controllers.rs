//! Controllers as written in the file: blocks in discrete time that read the motion and drive inputs.

use serde::{Deserialize, Serialize};

use super::diagnostic::Span;
use super::expression::Expression;
use super::ids::InputId;

/// A controller. At the instants k T it computes commands and the next values of its memory from the state and
/// its memory; the commands act after a delay and are held until the next ones act.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Controller {
    /// Its name.
    pub name: String,
    /// Position of its name in the file.
    pub span: Span,
    /// Time T between its samples, s.
    pub sample: f64,
    /// Time from a sample to the moment at which its commands act, s: from 0 to T.
    pub delay: f64,
    /// What it remembers from one sample to the next.
    pub memory: Vec<Memory>,
    /// What it drives.
    pub commands: Vec<Command>,
    /// How its commands are switched, if they are.
    pub pwm: Option<Pwm>,
}

/// A number that a controller remembers.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Memory {
    /// Its name.
    pub name: String,
    /// Its value at the first sample.
    pub initial: f64,
    /// Its value at the next sample.
    pub next: Expression,
    /// Position of the formula in the file.
    pub span: Span,
}

/// An input that a controller drives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Command {
    /// The input.
    pub input: InputId,
    /// Its value.
    pub value: Expression,
    /// Position of the formula in the file.
    pub span: Span,
}

/// Pulse-width modulation: within each period the input is `levels[1]` for a share of the time, the duty, and then
/// `levels[0]`, so that its mean is the command.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pwm {
    /// The period, s: a whole fraction of the time between samples.
    pub period: f64,
    /// The input while it is off and while it is on.
    pub levels: [f64; 2],
    /// The least and the greatest duty.
    pub duty: [f64; 2],
}
