//! The tables of controllers.

use super::{Mapping, Presence, Range, Uses, Value, key, optional, required};
use crate::source::names::Kind;
use crate::source::units::{NUMBER, TIME};

/// The longest delay, as a word.
pub(crate) const ONE_SAMPLE: &str = "1 sample";

/// A formula of a controller. Numbers are in SI units and radians.
const LAW: Value = Value::Formula(&NUMBER, Uses::Motion);

/// An entry of `controllers`.
pub static CONTROLLER: Mapping = Mapping {
    name: "controller",
    title: "Controllers",
    path: "controllers.<controller>",
    doc: "A controller in discrete time. At t = 0, T, 2 T, .. it reads the state and sets inputs, which are held in \
          between. Its formulas may use q, u, t, parameters, inputs that no controller drives, its own `memory`, the \
          time between samples as `Ts`, and the positions of output points as `x.tip`, `y.tip` and `z.tip`. See \
          [CONTROLLERS.md](CONTROLLERS.md).",
    keys: &[
        required("sample", Value::Number(&TIME), "5 ms", "The time T between samples.")
            .range(Range::Positive),
        key(
            "delay",
            Value::Either(&Value::Number(&TIME), &Value::Word(&[ONE_SAMPLE])),
            Presence::Default("0"),
            "1 sample",
            "The time from a sample to the moment at which its commands act, at most one sample.",
        )
        .range(Range::NotNegative),
        required(
            "inputs",
            Value::Per("input", &LAW),
            "{ motor: \"k*(1 - q.knee) - 1e-4*u.knee\" }",
            "The inputs that the controller drives, with a formula for each, in SI units.",
        ),
        optional(
            "memory",
            Value::Named(Kind::Symbol("a memory"), &Value::Mapping(&MEMORY)),
            "the controller has no memory",
            "{ i: { initial: 0, next: \"i + (1 - q.knee)*Ts\" } }",
            "Numbers that the controller remembers from one sample to the next. All formulas see the values before \
             the sample.",
        ),
        optional(
            "pwm",
            Value::Mapping(&PWM),
            "the commands act as they are",
            "{ period: 1 ms, levels: [-6, 6] }",
            "Pulse-width modulation: the inputs are switched between two levels so that their mean is the command.",
        ),
    ],
    choices: &[],
};

/// An entry of `memory`.
pub static MEMORY: Mapping = Mapping {
    name: "memory",
    title: "Memory of controllers",
    path: "controllers.<controller>.memory.<memory>",
    doc: "A number that a controller remembers.",
    keys: &[
        key(
            "initial",
            Value::Number(&NUMBER),
            Presence::Default("0"),
            "0.5",
            "Its value at the first sample.",
        ),
        required("next", LAW, "\"i + q.knee*Ts\"", "Its value at the next sample."),
    ],
    choices: &[],
};

/// `pwm`.
pub static PWM: Mapping = Mapping {
    name: "PWM",
    title: "Pulse-width modulation",
    path: "controllers.<controller>.pwm",
    doc: "In each period an input is first at the upper and then at the lower of two levels. The share of the time at \
          the upper level is the duty. It follows from the command that acts when the period begins: (command - lower) \
          / (upper - lower), within the limits of `duty`.",
    keys: &[
        required(
            "period",
            Value::Number(&TIME),
            "1 ms",
            "The period. It fits a whole number of times into the time between samples.",
        )
        .range(Range::Positive),
        required(
            "levels",
            Value::Array { of: &Value::Number(&NUMBER), length: 2, form: "`[lower, upper]`" },
            "[-6, 6]",
            "The two values of the inputs, in SI units.",
        ),
        key(
            "duty",
            Value::Array { of: &Value::Number(&NUMBER), length: 2, form: "`[least, greatest]`" },
            Presence::Default("[0, 1]"),
            "[0.05, 0.95]",
            "The least and the greatest duty, from 0 to 1.",
        ),
    ],
    choices: &[],
};
