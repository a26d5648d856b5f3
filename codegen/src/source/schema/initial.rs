//! The tables of the initial state.

use super::{Mapping, Presence, Range, Value, key, optional};
use crate::source::units::{ANGLE, ANGULAR_SPEED, LENGTH, NUMBER, SHARE, SPEED};

/// Three components of a vector.
const fn vector(quantity: &'static Value) -> Value {
    Value::Array { of: quantity, length: 3, form: "`[x, y, z]`" }
}

/// An entry of `initial.bodies`.
pub static FREE_BODY: Mapping = Mapping {
    name: "state of a free body",
    title: "Initial state of a free body",
    path: "initial.bodies.<body>",
    doc: "Where a free body is at the start, and how it moves. Without `orientation` and `turn` it is \
          oriented as drawn. The bodies that hang on it move with it. See [FREE.md](FREE.md).",
    keys: &[
        key(
            "position",
            vector(&Value::Number(&LENGTH)),
            Presence::Default("[0, 0, 0]"),
            "[0, 0, 50]",
            "How far its centre of mass is from where it is drawn.",
        ),
        optional(
            "orientation",
            Value::Array { of: &Value::Number(&NUMBER), length: 4, form: "`[w, x, y, z]`" },
            "`turn` holds",
            "[0.966, 0, 0.259, 0]",
            "Its orientation as a quaternion, scalar first, of any length but 0.",
        ),
        optional(
            "turn",
            vector(&Value::Number(&ANGLE)),
            "`orientation` holds",
            "[0, 30 deg, 0]",
            "Its orientation as a rotation vector: the direction is the axis, the length is the angle.",
        ),
        key(
            "velocity",
            vector(&Value::Number(&SPEED)),
            Presence::Default("[0, 0, 0]"),
            "[0.2, 0, 0]",
            "Velocity of its centre of mass, in the base frame.",
        ),
        key(
            "angular_velocity",
            vector(&Value::Number(&ANGULAR_SPEED)),
            Presence::Default("[0, 0, 0]"),
            "[0, 0, 10 rad/s]",
            "Angular velocity, in its own frame.",
        ),
    ],
    choices: &[&[&["orientation"], &["turn"]]],
};

/// `initial`.
pub static INITIAL: Mapping = Mapping {
    name: "initial",
    title: "Initial state",
    path: "initial",
    doc: "Angles and speeds at the start, by joint. Those of other joints start at 0. If \
          the loops can close with the given angles, these are kept; if they nearly can, as with rounded numbers, these \
          hardly change; otherwise closed loops change all angles as little as possible.",
    keys: &[
        key(
            "q",
            Value::Per("joint", &Value::Number(&ANGLE)),
            Presence::Default("{}"),
            "{ knee: 30 deg }",
            "Angles. The angle of a joint with `limits` must lie within them.",
        ),
        key(
            "u",
            Value::Per("joint", &Value::Number(&ANGULAR_SPEED)),
            Presence::Default("{}"),
            "{ knee: 1.5 rad/s }",
            "Angular speeds.",
        ),
        optional(
            "fold",
            Value::Number(&SHARE),
            "all other angles start at 0",
            "30 %",
            "A share of the joints' `fold`, from 0 to 100 %: where those joints start that `q` does not \
             name. The angle of a joint with `limits` stays within them.",
        )
        .range(Range::NotNegative),
        key(
            "bodies",
            Value::Per("body", &Value::Mapping(&FREE_BODY)),
            Presence::Default("{}"),
            "{ hull: { position: [0, 0, 50] } }",
            "Positions and velocities of free bodies.",
        ),
    ],
    choices: &[],
};
