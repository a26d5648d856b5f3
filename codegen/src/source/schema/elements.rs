//! The tables of force elements: springs, tendons and motors.

use super::parts::FIXED_VERTEX;
use super::{Mapping, Presence, Range, Uses, Value, key, optional, required};
use crate::source::units::{
    ANGLE, CURRENT, DAMPING, FORCE, INERTIA, LENGTH, LINEAR_DAMPING, LINEAR_STIFFNESS, NUMBER,
    RESISTANCE, STIFFNESS, TORQUE_CONSTANT, VOLTAGE,
};

const NO_LENGTH: Uses = Uses::Constants(
    "the spring and the damper already contain the length and its rate of change; write other formulas \
     with q and u into the `tension` of a tendon or the `torque` of a joint",
);
const NO_ANGLE: Uses = Uses::Constants(
    "the spring and the damper already contain the angle and its rate of change; write other formulas \
     with q and u into the `torque` of a joint",
);
const NO_STATE: Uses =
    Uses::Constants("this describes the motor itself; only its `voltage` may depend on q and u");

/// What a point of a line is.
const POINT: Value = Value::Reference { to: "point", among: "points" };

/// An entry of `springs` between two points.
pub static BAND: Mapping = Mapping {
    name: "band",
    title: "Springs between points",
    path: "springs.<spring>",
    doc: "A spring and a damper between two points, such as a rubber band. With the length l, it pulls its ends \
          together with the force k (l - `rest_length`) + b dl/dt; a negative force pushes, unless the spring is \
          `tension_only`. See [FORCES.md](FORCES.md#springs-between-points).",
    keys: &[
        required("from", POINT, "tip", "The point at one end."),
        required("to", POINT, "hook", "The point at the other end, on another body."),
        required(
            "stiffness",
            Value::Formula(&LINEAR_STIFFNESS, NO_LENGTH),
            "20 N/m",
            "Stiffness k.",
        )
        .range(Range::NotNegative),
        key(
            "damping",
            Value::Formula(&LINEAR_DAMPING, NO_LENGTH),
            Presence::Default("0"),
            "0.01 N*s/m",
            "Damping b.",
        )
        .range(Range::NotNegative),
        optional(
            "rest_length",
            Value::Formula(&LENGTH, NO_LENGTH),
            "the length in the flat drawing",
            "10 mm",
            "The length at which the spring is relaxed.",
        )
        .range(Range::NotNegative),
        key(
            "tension_only",
            Value::Boolean,
            Presence::Default("false"),
            "true",
            "Whether the spring is slack while it is shorter than its `rest_length`, and never pushes.",
        ),
    ],
    choices: &[],
};

/// An entry of `springs` between two bodies.
pub static TWIST: Mapping = Mapping {
    name: "twist",
    title: "Torsion springs between bodies",
    path: "springs.<spring>",
    doc: "A torsion spring and a damper between two bodies that need not be neighbours. The angle is the twist of \
          the second body relative to the first about the axis, from -180 to 180 deg; where all hinges between \
          the bodies are parallel to the axis, it is the sum of their angles. See \
          [FORCES.md](FORCES.md#torsion-springs-between-bodies).",
    keys: &[
        required(
            "bodies",
            Value::Array {
                of: &Value::Reference { to: "body", among: "bodies" },
                length: 2,
                form: "two bodies, `[first, second]`",
            },
            "[base, hand]",
            "The angle turns the second body relative to the first by the right-hand rule. At least one of \
             them is not fixed.",
        ),
        required(
            "axis",
            Value::Array {
                of: &FIXED_VERTEX,
                length: 2,
                form: "two points of a line along the axis, `[[x, y], [x, y]]`",
            },
            "[[0, 0], [0, 20]]",
            "Two different points of a line along the axis in the flat sheet. Only its direction matters.",
        ),
        required(
            "stiffness",
            Value::Formula(&STIFFNESS, NO_ANGLE),
            "2 mN*m/rad",
            "Stiffness k: the torque on the second body is -k (angle - `rest`) - b d(angle)/dt.",
        )
        .range(Range::NotNegative),
        key(
            "damping",
            Value::Formula(&DAMPING, NO_ANGLE),
            Presence::Default("0"),
            "1e-6 N*m*s/rad",
            "Damping b.",
        )
        .range(Range::NotNegative),
        key(
            "rest",
            Value::Formula(&ANGLE, NO_ANGLE),
            Presence::Default("0"),
            "15 deg",
            "The angle at which the spring is relaxed.",
        ),
    ],
    choices: &[],
};

/// An entry of `tendons`.
pub static TENDON: Mapping = Mapping {
    name: "tendon",
    title: "Tendons",
    path: "tendons.<tendon>",
    doc: "A line that slides without friction through points and pulls only. Its length l is the sum of the \
          distances between them. Either its `tension` is given, or it is elastic: k (l - `rest_length`) + b dl/dt \
          where it is longer than the `rest_length`, and 0 otherwise. See [FORCES.md](FORCES.md#tendons).",
    keys: &[
        required(
            "through",
            Value::List { of: &POINT, items: [2, usize::MAX], form: "a list of points" },
            "[hook, guide, tip]",
            "The points from one end to the other, on at least two bodies.",
        ),
        optional(
            "tension",
            Value::Formula(&FORCE, Uses::Motion),
            "the tendon is elastic",
            "\"0.5 + 0.1*motor\"",
            "The tension. Where the formula is negative, it is 0.",
        )
        .range(Range::NotNegative),
        key(
            "stiffness",
            Value::Formula(&LINEAR_STIFFNESS, NO_LENGTH),
            Presence::Without("tension"),
            "200 N/m",
            "Stiffness k.",
        )
        .range(Range::NotNegative),
        key(
            "damping",
            Value::Formula(&LINEAR_DAMPING, NO_LENGTH),
            Presence::Default("0"),
            "0.01 N*s/m",
            "Damping b.",
        )
        .range(Range::NotNegative),
        optional(
            "rest_length",
            Value::Formula(&LENGTH, NO_LENGTH),
            "the length in the flat drawing",
            "40 mm",
            "The length at which the tendon is relaxed.",
        )
        .range(Range::NotNegative),
    ],
    choices: &[&[&["tension"], &["stiffness", "damping", "rest_length"]]],
};

/// An entry of `motors`.
pub static MOTOR: Mapping = Mapping {
    name: "motor",
    title: "Motors",
    path: "motors.<motor>",
    doc: "A direct-current motor that turns a joint through a gear. With the `torque_constant` c, the `resistance` R, \
          the `gear` N and the voltage V, the current is i = (V - c N u) / R, and the torque on the joint's second \
          body is N c i. The rotor adds N^2 times its `inertia` to the inertia of the joint's coordinate. See \
          [FORCES.md](FORCES.md#motors).",
    keys: &[
        required(
            "joint",
            Value::Reference { to: "joint", among: "joints" },
            "knee",
            "The joint, which has no `drive` and no other motor.",
        ),
        required(
            "torque_constant",
            Value::Formula(&TORQUE_CONSTANT, NO_STATE),
            "5 mN*m/A",
            "Torque of the rotor per current, which is also the voltage per speed of the rotor, V s/rad.",
        )
        .range(Range::Positive),
        required(
            "resistance",
            Value::Formula(&RESISTANCE, NO_STATE),
            "8 ohm",
            "Resistance of the winding.",
        )
        .range(Range::Positive),
        required(
            "gear",
            Value::Number(&NUMBER),
            "50",
            "Turns of the rotor per turn of the joint; 1 without a gear.",
        )
        .range(Range::Positive),
        key(
            "inertia",
            Value::Number(&INERTIA),
            Presence::Default("0"),
            "1e-9 kg*m^2",
            "Moment of inertia of the rotor about its own axis.",
        )
        .range(Range::NotNegative),
        required(
            "voltage",
            Value::Formula(&VOLTAGE, Uses::Motion),
            "\"motor\"",
            "The voltage at the motor, usually an input.",
        ),
        optional(
            "max_voltage",
            Value::Formula(&VOLTAGE, NO_STATE),
            "the voltage has no limit",
            "6 V",
            "The largest magnitude of the voltage: with the resistance, it is the limit of the torque at a speed.",
        )
        .range(Range::Positive),
        optional(
            "max_current",
            Value::Formula(&CURRENT, NO_STATE),
            "the current has no limit",
            "0.5 A",
            "The largest magnitude of the current, which limits the torque.",
        )
        .range(Range::Positive),
    ],
    choices: &[],
};
