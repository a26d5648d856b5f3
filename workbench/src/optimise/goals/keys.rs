//! The keys of a file of goals, as data: one table for each kind of mapping, as those of the model file.

use lamc::source::schema::{Key, Kind, Mapping, NUMBER, Presence, Range, TIME, Value, key};

use super::path_keys::{CLEARANCE, PATH, SETTLE, STROKE};
use crate::sweep::plan::DISTRIBUTION;

/// Every mapping, in the order of the reference.
pub static MAPPINGS: &[&Mapping] =
    &[&GOALS, &VARIABLE, &GOAL, &PATH, &STROKE, &CLEARANCE, &SETTLE, &CONSTRAINT];

/// The words of `norm`.
pub const NORMS: &[&str] = &["squares", "max"];
/// The words of `energy`.
pub const ENERGIES: &[&str] = &["kinetic", "potential"];
/// The words of `extent`.
pub const AXES: &[&str] = &["x", "y"];

const ONE: Presence = Presence::Optional("one measure is given");
const LIMIT: Presence = Presence::Optional("no such limit");

/// The whole file.
pub static GOALS: Mapping = Mapping {
    name: "goals",
    title: "The goals of an optimisation",
    path: "",
    doc: "What `lamc optimise` varies, and what it aims at. See [OPTIMISE.md](OPTIMISE.md).",
    keys: &[
        key(
            "parameters",
            Value::Named(Kind::Other("a parameter of the model"), &Value::Mapping(&VARIABLE)),
            Presence::Required,
            "{ crank: {}, rocker: { range: [30 mm, 60 mm] } }",
            "The parameters that vary.",
        ),
        key(
            "goals",
            Value::Named(Kind::Other("a goal"), &Value::Mapping(&GOAL)),
            Presence::Required,
            "{ bend: { angle: j0, target: 30deg } }",
            "What the design should come near to.",
        ),
        key(
            "constraints",
            Value::Named(Kind::Other("a constraint"), &Value::Mapping(&CONSTRAINT)),
            Presence::Optional("none"),
            "{ light: { mass: all, at_most: 3 g } }",
            "What the design has to keep.",
        ),
        key(
            "tolerances",
            Value::Named(Kind::Other("a parameter of the model"), &Value::Mapping(&DISTRIBUTION)),
            Presence::Optional("robots are built as designed"),
            "{ crank: { normal: 0.05 mm }, rocker: { uniform: 1% } }",
            "By how much built robots differ from the design: a tolerance of any parameter about its value, as in the plan of a \
             sweep. See [YIELD.md](YIELD.md).",
        ),
        key(
            "robust",
            Value::Number(&NUMBER),
            Presence::Optional("the design itself counts"),
            "3",
            "The search takes the mean over built robots plus so many standard deviations, of errors and of constraints.",
        ),
        key(
            "robots",
            Value::Number(&NUMBER),
            Presence::Default("32"),
            "128",
            "With `robust`: how many built robots stand for all.",
        ),
        key(
            "norm",
            Value::Word(NORMS),
            Presence::Default("squares"),
            "max",
            "`squares`: the sum over the goals of weight times mean square of the errors is least. `max`: the \
             largest of all errors, each times its weight, is least.",
        ),
        key(
            "starts",
            Value::Number(&NUMBER),
            Presence::Default("16"),
            "100",
            "From how many designs the search starts: a Latin hypercube within the ranges.",
        ),
        key(
            "seed",
            Value::Number(&NUMBER),
            Presence::Default("0"),
            "7",
            "A whole number. With another one the search starts from other designs.",
        ),
    ],
    choices: &[],
};

/// An entry of `parameters`.
pub static VARIABLE: Mapping = Mapping {
    name: "variable",
    title: "Parameters that vary",
    path: "parameters.<parameter>",
    doc: "`{}` takes the range that the parameter has in the model.",
    keys: &[key(
        "range",
        Value::Array { of: &Value::Parameter, length: 2, form: "`[lowest, highest]`" },
        Presence::Optional("the `range` of the parameter in the model"),
        "[30 mm, 60 mm]",
        "Between which values it varies.",
    )],
    choices: &[],
};

const fn measure(
    name: &'static str,
    value: Value,
    example: &'static str,
    doc: &'static str,
) -> Key {
    key(name, value, ONE, example, doc)
}

const ANGLE_AT_REST: Key = measure(
    "angle",
    Value::Reference { to: "joint", among: "joints" },
    "j0",
    "The angle of this joint at rest.",
);
const POSITION: Key = measure(
    "position",
    Value::Text,
    "tip.z",
    "A coordinate of a point at rest: its name, a dot, and `x`, `y` or `z`.",
);
const FREQUENCY: Key = measure(
    "frequency",
    Value::Number(&NUMBER),
    "1",
    "The natural frequency, undamped, of this mode about the state of rest; 1 is the slowest.",
);
const MASS: Key = measure(
    "mass",
    Value::Text,
    "all",
    "The mass of a body by its name, or of `all` bodies that are not fixed.",
);
const STIFFNESS: Key = measure(
    "stiffness",
    Value::Text,
    "tip.z",
    "A small force on a point along an axis over how far the point moves along it, at rest.",
);
const TORQUE: Key = measure(
    "torque",
    Value::Reference { to: "joint", among: "joints" },
    "knee",
    "The torque that holds this joint, whose angle is prescribed by its `drive`, at rest.",
);
const FORCE: Key = measure(
    "force",
    Value::Reference { to: "joint", among: "joints" },
    "j0",
    "The force that this hinge transmits at rest.",
);
const CLEARANCE_OF: Key = measure(
    "clearance",
    Value::Mapping(&CLEARANCE),
    "{ between: [left, right] }",
    "How far plates are apart, at rest or while a joint is turned.",
);
const SETTLE_OF: Key = measure(
    "settle",
    Value::Mapping(&SETTLE),
    "{ angle: knee, within: 1deg, until: 2 s }",
    "The time until an angle or a position stays near its value at rest.",
);
const EXTENT: Key = measure(
    "extent",
    Value::Word(AXES),
    "x",
    "How far all outlines of the flat drawing extend along an axis, which says whether they fit the stock.",
);
const ENERGY: Key = measure(
    "energy",
    Value::Word(ENERGIES),
    "potential",
    "The energy at rest: that of gravity and springs; with `at`, also the kinetic energy.",
);
const STROKE_OF: Key = measure(
    "stroke",
    Value::Mapping(&STROKE),
    "{ point: pen, drive: crank, angles: [0deg, 90deg] }",
    "How far a point or a joint moves while another joint is turned.",
);
const AT: Key = Key {
    range: Range::Positive,
    ..key(
        "at",
        Value::Number(&TIME),
        Presence::Optional("at rest"),
        "0.2 s",
        "The time at which an angle, a position or an energy counts, of the motion from the initial state with constant inputs.",
    )
};
const AT_MOST: Key =
    key("at_most", Value::Parameter, LIMIT, "3 g", "The value that it must not exceed.");
const AT_LEAST: Key =
    key("at_least", Value::Parameter, LIMIT, "12 Hz", "The value that it must reach.");

/// An entry of `goals`.
pub static GOAL: Mapping = Mapping {
    name: "goal",
    title: "Goals",
    path: "goals.<goal>",
    doc: "A path, or a number with a target or one limit. The error of a goal has no unit: a distance is divided by \
          the size of the mechanism, an angle is in radians, and everything else is divided by its target.",
    keys: &[
        key(
            "path",
            Value::Mapping(&PATH),
            ONE,
            "{ point: pen, drive: crank, angles: [0deg, 90deg], through: [[0, 0, 0], [0.02, 0, 0]] }",
            "A point passes near given ones while a joint is turned.",
        ),
        ANGLE_AT_REST,
        POSITION,
        FREQUENCY,
        STIFFNESS,
        TORQUE,
        FORCE,
        MASS,
        EXTENT,
        CLEARANCE_OF,
        ENERGY,
        STROKE_OF,
        SETTLE_OF,
        AT,
        key(
            "target",
            Value::Parameter,
            Presence::Optional("a limit is given"),
            "30deg",
            "The value that it should have.",
        ),
        AT_MOST,
        AT_LEAST,
        key(
            "within",
            Value::Parameter,
            Presence::Optional("built robots are not judged by a target or a path"),
            "0.5 mm",
            "How far a built robot may be from the target, or from any point of the path. `lamc yield` counts the robots that keep it.",
        ),
        Key {
            range: Range::Positive,
            ..key(
                "weight",
                Value::Number(&NUMBER),
                Presence::Default("1"),
                "10",
                "How much its error counts.",
            )
        },
    ],
    choices: &[
        &[
            &["path"],
            &["angle"],
            &["position"],
            &["frequency"],
            &["stiffness"],
            &["torque"],
            &["force"],
            &["mass"],
            &["extent"],
            &["clearance"],
            &["energy"],
            &["stroke"],
            &["settle"],
        ],
        &[&["target"], &["at_most"], &["at_least"]],
    ],
};

/// An entry of `constraints`.
pub static CONSTRAINT: Mapping = Mapping {
    name: "constraint",
    title: "Constraints",
    path: "constraints.<constraint>",
    doc: "A number with one limit or both.",
    keys: &[
        ANGLE_AT_REST,
        POSITION,
        FREQUENCY,
        STIFFNESS,
        TORQUE,
        FORCE,
        MASS,
        EXTENT,
        CLEARANCE_OF,
        ENERGY,
        STROKE_OF,
        SETTLE_OF,
        AT,
        AT_MOST,
        AT_LEAST,
    ],
    choices: &[&[
        &["angle"],
        &["position"],
        &["frequency"],
        &["stiffness"],
        &["torque"],
        &["force"],
        &["mass"],
        &["extent"],
        &["clearance"],
        &["energy"],
        &["stroke"],
        &["settle"],
    ]],
};
