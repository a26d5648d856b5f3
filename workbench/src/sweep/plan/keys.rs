//! The keys of a plan, as data: one table for each kind of mapping, as those of the model file.

use lamc::source::schema::{
    FREQUENCY, Key, Kind, Mapping, NUMBER, Presence, Quantity, Range, SHARE, TIME, Value, key,
};

/// Every mapping, in the order of the reference.
pub static MAPPINGS: &[&Mapping] = &[&PLAN, &AXIS, &DISTRIBUTION, &SAMPLES];

/// The words of `task`.
pub const TASKS: &[&str] = &["simulate", "equilibrium"];
/// The words of `record`.
pub const RECORDS: &[&str] = &["end", "extremes", "settling", "energy", "motion", "frequencies"];
/// The words of `method`.
pub const METHODS: &[&str] = &["auto", "dopri5", "rodas"];
/// The words of `samples.method`.
pub const SAMPLERS: &[&str] = &["random", "latin_hypercube", "sobol"];
/// The words of `spacing`.
pub const SPACINGS: &[&str] = &["linear", "logarithmic"];

const VARIED: Kind = Kind::Other("a quantity of the model");
/// Two numbers, or one about the value of the model.
const SPREAD: Value = Value::List {
    of: &Value::Parameter,
    items: [1, 2],
    form: "`[a, b]`, or one number or percentage",
};
const ONE: Presence = Presence::Optional("one of the three is given");

/// The whole plan.
pub static PLAN: Mapping = Mapping {
    name: "plan",
    title: "The plan of a sweep",
    path: "",
    doc: "What `lamc sweep` varies, and what it records of each run. A quantity is a parameter of the model \
          by its name (`k`, or `stiffness_j0` of a `tunable`), the guess of an initial angle \
          (`initial.j0`), or an input that is held (`input.motor`). See [SWEEPS.md](SWEEPS.md).",
    keys: &[
        key(
            "grid",
            Value::Named(
                VARIED,
                &Value::Either(
                    &Value::List {
                        of: &Value::Parameter,
                        items: [1, usize::MAX],
                        form: "a list of values",
                    },
                    &Value::Mapping(&AXIS),
                ),
            ),
            Presence::Optional("one point"),
            "{ k: [0.01, 0.02], initial.j0: { from: 10deg, to: 60deg, count: 6 } }",
            "Values of which every combination is a point of the grid. The last quantity changes fastest.",
        ),
        key(
            "vary",
            Value::Named(VARIED, &Value::Mapping(&DISTRIBUTION)),
            Presence::Optional("nothing varies at random"),
            "{ k: { normal: 5% }, input.motor: { uniform: [0, 2mN*m] } }",
            "Quantities that are drawn from a distribution.",
        ),
        key(
            "samples",
            Value::Mapping(&SAMPLES),
            Presence::Optional("required with `vary`"),
            "{ count: 1000, method: sobol }",
            "How the quantities of `vary` are drawn. Each point of the grid is run with each of the samples.",
        ),
        key(
            "seed",
            Value::Number(&NUMBER),
            Presence::Default("0"),
            "7",
            "A whole number. With another one other samples are drawn.",
        ),
        key(
            "task",
            Value::Word(TASKS),
            Presence::Default("simulate"),
            "equilibrium",
            "What a run does: simulate a motion, or find the equilibrium.",
        ),
        key(
            "record",
            Value::List { of: &Value::Word(RECORDS), items: [1, 6], form: "a list of records" },
            Presence::Default("[end, energy]"),
            "[end, extremes, settling]",
            "What is kept of a run: `end` (the last state, and the points), `extremes` of angles and speeds, \
             `settling` (the time to settle), `energy`, the whole `motion`; of an equilibrium `end`, `energy` \
             and `frequencies`.",
        ),
        positive("duration", &TIME, "2 s", "1 s", "Time to simulate."),
        positive(
            "rate",
            &FREQUENCY,
            "100 Hz",
            "1 kHz",
            "Samples per second: those of `motion`, and those among which `extremes` and `settling` look.",
        ),
        positive(
            "tolerance",
            &NUMBER,
            "1e-8",
            "1e-6",
            "Error allowed per step, relative and absolute.",
        ),
        key(
            "method",
            Value::Word(METHODS),
            Presence::Default("auto"),
            "rodas",
            "How to integrate, as `--integrator` of `lamc simulate`.",
        ),
        key(
            "restitution",
            Value::Number(&NUMBER),
            Presence::Default("0"),
            "0.5",
            "Coefficient of restitution at the stops, 0 to 1.",
        ),
        positive(
            "settling_band",
            &SHARE,
            "2%",
            "5%",
            "A motion has settled when every joint stays this near to its equilibrium: a share of the largest \
             distance of a joint from there.",
        ),
    ],
    choices: &[],
};

/// An entry of `grid`.
pub static AXIS: Mapping = Mapping {
    name: "axis",
    title: "Axes of the grid",
    path: "grid.<quantity>",
    doc: "Evenly spaced values.",
    keys: &[
        key("from", Value::Parameter, Presence::Required, "10deg", "The first value."),
        key("to", Value::Parameter, Presence::Required, "60deg", "The last value."),
        key(
            "count",
            Value::Number(&NUMBER),
            Presence::Required,
            "6",
            "How many values, at least two.",
        ),
        key(
            "spacing",
            Value::Word(SPACINGS),
            Presence::Default("linear"),
            "logarithmic",
            "Whether neighbours have the same difference or the same ratio.",
        ),
    ],
    choices: &[],
};

/// An entry of `vary`.
pub static DISTRIBUTION: Mapping = Mapping {
    name: "distribution",
    title: "Distributions",
    path: "vary.<quantity>",
    doc: "A single number or a percentage is a tolerance about the value that the model has: `{ normal: 5% }`.",
    keys: &[
        key(
            "uniform",
            SPREAD,
            ONE,
            "[9mN*m/rad, 12mN*m/rad]",
            "All values between these two are equally likely; or within this tolerance on either side.",
        ),
        key(
            "log_uniform",
            Value::Array { of: &Value::Parameter, length: 2, form: "`[a, b]`" },
            ONE,
            "[1e-3, 1e-1]",
            "The logarithm is uniform between those of these two, which have the same sign.",
        ),
        key(
            "normal",
            SPREAD,
            ONE,
            "[11mN*m/rad, 0.5mN*m/rad]",
            "Mean and standard deviation; or the standard deviation alone.",
        ),
    ],
    choices: &[&[&["uniform"], &["log_uniform"], &["normal"]]],
};

/// `samples`.
pub static SAMPLES: Mapping = Mapping {
    name: "samples",
    title: "Samples",
    path: "samples",
    doc: "The sample of a run depends on the seed and on the run's number only, whoever computes it.",
    keys: &[
        key("count", Value::Number(&NUMBER), Presence::Required, "1000", "How many."),
        key(
            "method",
            Value::Word(SAMPLERS),
            Presence::Default("random"),
            "latin_hypercube",
            "`random`: independent. `latin_hypercube`: each quantity has one value in each of `count` parts of \
             equal probability. `sobol`: Sobol's sequence with a random shift, best with a power of two.",
        ),
    ],
    choices: &[],
};

const fn positive(
    name: &'static str,
    quantity: &'static Quantity,
    default: &'static str,
    example: &'static str,
    doc: &'static str,
) -> Key {
    let range = Range::Positive;
    Key { range, ..key(name, Value::Number(quantity), Presence::Default(default), example, doc) }
}
