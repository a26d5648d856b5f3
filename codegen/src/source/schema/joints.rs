//! The tables of joints, and of creases that differ from the others.

use super::parts::{DRAWN_LENGTH, HINGES, NO_MOTION, VERTEX};
use super::{Key, Mapping, Presence, Range, Uses, Value, key, optional, required};
use crate::source::units::{ANGLE, ANGULAR_SPEED, CUBIC_STIFFNESS, DAMPING, STIFFNESS, TORQUE};

const PRESCRIBED: Uses = Uses::Constants(
    "a prescribed angle is a function of t, parameters and inputs; write a formula with q and u \
     into `torque`",
);

/// A key with a formula that is 0 if it is left out.
const fn law(name: &'static str, value: Value, example: &'static str, doc: &'static str) -> Key {
    key(name, value, Presence::Default("0"), example, doc)
}

/// What acts at a joint, wherever it is from.
const ACTIONS: [Key; 9] = [
    law(
        "stiffness",
        Value::Formula(&STIFFNESS, NO_MOTION),
        "11.4 mN*m/rad",
        "Stiffness k of the spring. A negative one is allowed, with a warning.",
    ),
    law("damping", Value::Formula(&DAMPING, NO_MOTION), "3.5e-6 N*m*s/rad", "Damping b.")
        .range(Range::NotNegative),
    law(
        "rest",
        Value::Formula(&ANGLE, NO_MOTION),
        "15 deg",
        "The angle at which the spring is relaxed.",
    ),
    optional(
        "limits",
        Value::Array { of: &Value::Number(&ANGLE), length: 2, form: "`[lowest, highest]`" },
        "the joint has no stops",
        "[-90 deg, 90 deg]",
        "The angles of the joint's stops, the lower one first.",
    ),
    law(
        "torque",
        Value::Formula(&TORQUE, Uses::Motion),
        "\"motor - 0.02*sin(2*pi*t)\"",
        "A torque on the second body about the hinge line.",
    ),
    optional(
        "drive",
        Value::Formula(&ANGLE, PRESCRIBED),
        "the joint moves freely",
        "\"0.3*sin(2*pi*t)\"",
        "The prescribed angle. The torque of the motor is then computed. Constant angles lie \
         within `limits`.",
    ),
    optional(
        "fold",
        Value::Number(&ANGLE),
        "the joint has no part in the fold",
        "-180 deg",
        "The angle of the finished fold, from -180 to 180 deg: positive for a valley, whose sides come \
         up, and negative for a mountain, if the first body is to the right of the way along \
         the axis. `initial` and `lamc fold` use it. See [FOLDING.md](FOLDING.md).",
    ),
    law(
        "cubic_stiffness",
        Value::Formula(&CUBIC_STIFFNESS, NO_MOTION),
        "2 mN*m/rad^3",
        "Cubic stiffness k3 of the spring.",
    ),
    optional(
        "friction",
        Value::Mapping(&FRICTION),
        "there is no friction",
        "{ torque: 0.1 mN*m, speed: 2 deg/s }",
        "Dry friction.",
    ),
];

/// The actions of a crease, which has those of all creases unless it has its own.
const OWN_ACTIONS: [Key; 9] = {
    let mut keys = ACTIONS;
    let mut index = 0;
    while index < keys.len() {
        keys[index].presence = Presence::Optional("that of all creases holds");
        index += 1;
    }
    keys
};

/// An entry of `joints`.
pub static JOINT: Mapping = Mapping {
    name: "joint",
    title: "Joints",
    path: "joints.<joint>",
    doc: "A flexure hinge between two bodies. Its angle q is 0 in the flat sheet, its speed is u. The \
          torque on the second body about the hinge line is -k (q - rest) - k3 (q - rest)^3 - b u \
          - T tanh(u / speed) + `torque`, with the `stiffness` k, the `cubic_stiffness` k3, the `damping` \
          b and the `friction` T. See [HINGES.md](HINGES.md).",
    keys: &{
        let [stiffness, damping, rest, limits, torque, drive, fold, cubic_stiffness, friction] =
            ACTIONS;
        [
            required(
                "bodies",
                Value::Array {
                    of: &Value::Reference { to: "body", among: "bodies" },
                    length: 2,
                    form: "two bodies, `[first, second]`",
                },
                "[base, arm]",
                "The angle turns the second body relative to the first by the right-hand rule. At \
             least one of them is not fixed.",
            ),
            required(
                "axis",
                Value::Array {
                    of: &VERTEX,
                    length: 2,
                    form: "two points of the hinge line, `[[x, y], [x, y]]`",
                },
                "[[0, 0], [0, 20]]",
                "Two different points of the hinge line in the flat sheet. The joint turns about the line \
             from the first to the second.",
            ),
            law("z", DRAWN_LENGTH, "0.25 mm", "Height of the hinge line in the stack."),
            stiffness,
            damping,
            rest,
            limits,
            torque,
            optional(
                "hinge",
                Value::OneOf { by: "model", variants: HINGES },
                "the spring has the constant `stiffness`",
                "{ model: beam, material: film, length: 1 mm, width: 20 mm }",
                "A model of the hinge, which computes the stiffness. `sharifzadeh2018` and the \
             models of `hinge_models` compute the damping too, so `damping` is not allowed with \
             them.",
            ),
            drive,
            fold,
            cubic_stiffness,
            friction,
        ]
    },
    choices: &[&[&["hinge"], &["stiffness"]], &[&["drive"], &["torque"]]],
};

/// `friction` of a joint.
pub static FRICTION: Mapping = Mapping {
    name: "friction",
    title: "Friction",
    path: "joints.<joint>.friction",
    doc: "Coulomb's friction, smoothed: the torque -T tanh(u / speed).",
    keys: &[
        required("torque", Value::Formula(&TORQUE, NO_MOTION), "0.1 mN*m", "The torque T.")
            .range(Range::NotNegative),
        required(
            "speed",
            Value::Number(&ANGULAR_SPEED),
            "2 deg/s",
            "The speed at which 76 % of the torque acts.",
        )
        .range(Range::Positive),
    ],
    choices: &[],
};

/// `pattern.joints`.
pub static CREASE_JOINT: Mapping = Mapping {
    name: "crease joint",
    title: "Single creases",
    path: "pattern.joints.<crease>",
    doc: "What acts at one crease in another way than at all: a motor, a stop, a stronger spring. The first body is \
          the one that is nearer to the ground. Names of creases come from their positions: [PATTERNS.md](PATTERNS.md).",
    keys: &OWN_ACTIONS,
    choices: &[&[&["drive"], &["torque"]]],
};
